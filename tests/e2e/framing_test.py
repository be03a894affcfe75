"""RFC 6455 on the wire: fragments, control frames, UTF-8, sizes, and frames that break the rules."""
import json
import struct
import unittest

from daemon import Daemon
from wsclient import BINARY, CLOSE, CONTINUATION, PING, PONG, TEXT, frame

BIG = 8 << 20  # LUM_LIMIT_MESSAGE_BYTES
BEFORE_HELLO = 4096


def padded(n_bytes):
    """A request of exactly n_bytes: an unknown method, padded with spaces inside the object."""
    text = '{"jsonrpc":"2.0","id":7,"method":"no.such"}'
    return ("{" + " " * (n_bytes - len(text)) + text[1:]).encode()


class Framing(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = cls.enterClassContext(Daemon())

    def tearDown(self):
        self.daemon.assert_well()

    def closes_with(self, code, *frames, hello=True):
        ws = self.daemon.connect(hello=hello)
        for data in frames:
            ws.send_raw(data)
        self.assertEqual(ws.wait_close(), code)

    def answers(self, ws, code=-32601):
        while 7 not in ws.replies:
            ws.pump()
        self.assertEqual(ws.replies.pop(7)["error"]["code"], code)

    # ---- good ----

    def test_fragments_down_to_single_bytes(self):
        message = padded(200)
        for size in (1, 7, 199):
            ws = self.daemon.connect()
            parts = [message[i:i + size] for i in range(0, len(message), size)]
            for i, part in enumerate(parts):
                ws.send_raw(frame(CONTINUATION if i else TEXT, part, fin=i == len(parts) - 1))
            self.answers(ws)

    def test_empty_fragments_and_pings_between(self):
        ws = self.daemon.connect()
        message = padded(100)
        ws.send_raw(frame(TEXT, b"", fin=False) + frame(CONTINUATION, message[:50], fin=False) + frame(PING, b"in between")
                    + frame(CONTINUATION, b"", fin=False) + frame(CONTINUATION, message[50:], fin=False)
                    + frame(CONTINUATION, b""))
        self.answers(ws)
        self.assertEqual(ws.pongs, [b"in between"])

    def test_frames_split_at_every_byte_of_the_stream(self):
        ws = self.daemon.connect()
        for byte in frame(PING, b"slow") + frame(TEXT, padded(60)):
            ws.send_raw(bytes([byte]))
        self.answers(ws)
        self.assertEqual(ws.pongs, [b"slow"])

    def test_many_messages_in_one_write(self):
        ws = self.daemon.connect()
        ids = range(100, 200)
        ws.send_raw(b"".join(frame(TEXT, json.dumps({"jsonrpc": "2.0", "id": i, "method": "no.such"}).encode()) for i in ids))
        while len(ws.replies) < len(ids):
            ws.pump()
        self.assertEqual(list(ws.replies), list(ids))  # in order

    def test_ping_of_every_length(self):
        ws = self.daemon.connect()
        for n in (0, 1, 124, 125):
            ws.send_raw(frame(PING, b"p" * n))
            ws.send_raw(frame(TEXT, padded(60)))
            self.answers(ws)
            self.assertEqual(ws.pongs.pop(), b"p" * n)

    def test_unasked_pong_is_ignored(self):
        ws = self.daemon.connect()
        ws.send_raw(frame(PONG, b"nobody asked"))
        ws.send_raw(frame(TEXT, padded(60)))
        self.answers(ws)

    def test_text_in_every_script(self):
        ws = self.daemon.connect()
        for text in ("\u00e4", "\u4e2d", "\U0001f4a1", "\uffff", "\U0010ffff", "\ue000"):
            data = text.encode()
            for cut in range(len(data) + 1):  # a character may be cut by a fragment
                ws.send_raw(frame(TEXT, b'{"jsonrpc":"2.0","id":7,"method":"' + data[:cut], fin=False))
                ws.send_raw(frame(CONTINUATION, data[cut:] + b'"}'))
                self.answers(ws)

    def test_close_is_echoed(self):
        for code in (1000, 1001, 3000, 4999):
            self.closes_with(code, frame(CLOSE, struct.pack("!H", code) + b"bye"))

    def test_large_and_small_messages_keep_their_order(self):
        """Large ones are parsed beside the small ones, which may not overtake them; a client may go meanwhile."""
        asked = [(i, b"x" * (40000 if i % 3 == 1 else 1 if i % 2 else 0)) for i in range(100, 160)]
        stream = b"".join(frame(TEXT, b'{"jsonrpc":"2.0","id":%d,"method":"no.such","params":{"x":"%s"}}' % one) for one in asked)
        ws = self.daemon.connect()
        ws.send_raw(stream)
        while len(ws.replies) < len(asked):
            ws.pump()
        self.assertEqual(list(ws.replies), [i for i, _ in asked])
        for _ in range(20):
            gone = self.daemon.connect()
            gone.send_raw(stream)
            gone.close()

    # ---- sizes: one below, at, one above ----

    def test_message_size(self):
        ws = self.daemon.connect()
        for n in (BIG - 1, BIG):
            ws.send_raw(frame(TEXT, padded(n)))
            self.answers(ws)
        self.closes_with(1009, frame(TEXT, padded(BIG + 1)))

    def test_message_size_in_fragments(self):
        half = padded(BIG)
        ws = self.daemon.connect()
        ws.send_raw(frame(TEXT, half[:BIG // 2], fin=False) + frame(CONTINUATION, half[BIG // 2:]))
        self.answers(ws)
        self.closes_with(1009, frame(TEXT, half, fin=False) + frame(CONTINUATION, b" "))

    def test_message_size_before_hello(self):
        for n in (BEFORE_HELLO - 1, BEFORE_HELLO):
            ws = self.daemon.connect(hello=False)
            ws.send_raw(frame(TEXT, padded(n)))
            self.answers(ws, -32000)
        self.closes_with(1009, frame(TEXT, padded(BEFORE_HELLO + 1)), hello=False)

    def test_announced_size_is_enough(self):
        for declared in (BIG + 1, 1 << 40, (1 << 63) - 1):
            self.closes_with(1009, frame(TEXT, b"x", declared=declared))

    # ---- bad ----

    def test_invalid_utf8(self):
        bad = (b"\xff", b"\xc0\x80", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"a\x80b", b"\xe4\xb8", b"\xf0\x9f\x92")
        for data in bad:
            self.closes_with(1007, frame(TEXT, data))
            self.closes_with(1007, frame(TEXT, b"ok", fin=False) + frame(CONTINUATION, data))

    def test_binary_is_not_understood(self):
        self.closes_with(1003, frame(BINARY, b"\x00\x01\x02"))
        self.closes_with(1003, frame(BINARY, b"\x00" * 100000))
        self.closes_with(1003, frame(BINARY, b"x", fin=False))

    def test_reserved_opcodes_and_bits(self):
        for opcode in (3, 4, 5, 6, 7, 11, 12, 13, 14, 15):
            self.closes_with(1002, frame(opcode, b"x"))
        for bits in (1, 2, 4, 7):
            self.closes_with(1002, frame(TEXT, b"x", reserved=bits))

    def test_order_of_fragments(self):
        self.closes_with(1002, frame(CONTINUATION, b"x"))
        self.closes_with(1002, frame(TEXT, b"x", fin=False) + frame(TEXT, b"y"))

    def test_bad_control_frames(self):
        # The library cuts these connections without a close frame.
        for data in (frame(PING, b"p" * 126), frame(PING, b"x", fin=False), frame(CLOSE, b"x")):
            ws = self.daemon.connect()
            ws.send_raw(data)
            self.assertIn(ws.wait_close(), (None, 1002))

    def test_garbage_instead_of_frames(self):
        for data in (b"\x00" * 64, b"\xff" * 64, b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", bytes(range(256)) * 8):
            ws = self.daemon.connect()
            ws.send_raw(data)
            self.assertIn(ws.wait_close(), (None, 1002, 1003, 1007, 1009), data[:8])


class Subprotocol(unittest.TestCase):
    def test_absent_is_fine_and_unknown_is_refused(self):
        from wsclient import HandshakeFailed
        with Daemon() as daemon:
            for subprotocol in (None, "lumend.v1", "other, lumend.v1"):
                ws = daemon.connect(hello=False, subprotocol=subprotocol)
                ws.hello(daemon.token)
                self.assertEqual(b"Sec-WebSocket-Protocol: lumend.v1" in ws.head, subprotocol is not None)
            with self.assertRaises(HandshakeFailed):
                daemon.connect(hello=False, subprotocol="other")
            daemon.assert_well()


if __name__ == "__main__":
    unittest.main()
