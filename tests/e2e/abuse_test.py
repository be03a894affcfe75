"""Hostile connections: half-open, dribbling, too many, cut off in the middle. The others notice nothing."""
import os
import random
import socket
import struct
import time
import unittest

from daemon import Daemon, eventually
from wsclient import BROKEN, PING, TEXT, Closed, HandshakeFailed, RpcError, frame, read_to_end

PER_ADDRESS = 64   # LUM_LIMIT_CONNECTIONS_PER_IP
SESSIONS = 64      # LUM_LIMIT_SESSIONS
CONNECTIONS = 256  # LUM_LIMIT_CONNECTIONS
RX_PER_S = 4 << 20     # LUM_LIMIT_RX_BYTES_PER_S
RX_BURST = 16 << 20    # LUM_LIMIT_RX_BURST_BYTES
MESSAGE_BYTES = 8 << 20
QUEUE_BYTES = 16 << 20  # LUM_LIMIT_CONTROL_QUEUE_BYTES
SEED = int(os.environ.get("SEED", "1"))


def reset(sock):
    """Closes with RST instead of FIN."""
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    sock.close()


class Abuse(unittest.TestCase):
    def setUp(self):
        self.daemon = self.enterContext(Daemon())
        self.good = self.daemon.connect()

    def tearDown(self):
        self.good.call("scene.get")
        self.daemon.assert_well()

    def test_half_open_and_dribbling_headers_are_cut_off(self):
        """All at once, because each takes the 10 s after which the server hangs up; 25 s where pings go unanswered."""
        mute = self.daemon.connect(pong=False)
        socks = []
        for start in (b"", b"G", b"GET / HTTP/1.1\r\n", b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ",
                      b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", b"CONNECT / HTTP/1.1\r\nHost: localhost\r\n\r\n",
                      b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000000\r\n\r\nabc"):
            sock = self.daemon.tcp()
            sock.sendall(start)
            socks.append(sock)
        dribble = self.daemon.tcp()
        dribble.settimeout(0.5)
        cut = False
        for byte in b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: " + b"a" * 200:  # the time-out is the pace
            try:
                dribble.sendall(bytes([byte]))
                cut = dribble.recv(1) == b""
            except TimeoutError:
                continue
            except BROKEN:
                cut = True
            if cut:
                break
        self.assertTrue(cut, "a dribbled header was never cut off")
        for sock in socks:
            read_to_end(sock)  # ends, or the socket's own time-out fails the test
            sock.close()
        mute.sock.settimeout(0.5)
        while True:
            self.good.sip(4096)  # this one answers its pings
            try:
                mute.recv_message()
            except TimeoutError:
                continue
            except Closed as closed:
                self.assertIsNone(closed.code)
                break

    def test_huge_header(self):
        sock = self.daemon.tcp()
        try:
            sock.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"a" * 65536 + b"\r\n\r\n")
        except BROKEN:
            pass
        self.assertNotIn(b" 200 ", read_to_end(sock)[:20])

    def test_garbage_instead_of_http(self):
        rng = random.Random(SEED)
        for _ in range(60):
            sock = self.daemon.tcp()
            try:
                sock.sendall(rng.randbytes(rng.randrange(1, 3000)) + b"\r\n\r\n")
            except BROKEN:
                pass
            reset(sock)

    def test_other_upgrades_are_refused(self):
        page = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"
        for upgrade in (b"foo", b"h2c", b"websocketx", b"web", b"a" * 100, b"h2c, websocket"):
            request = (b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade, HTTP2-Settings\r\n"
                       b"HTTP2-Settings: AAMAAABkAAQAAP__\r\nUpgrade: " + upgrade + b"\r\n\r\n")
            for before in (b"", page, page + page):  # also as a later request of a kept-alive connection
                sock = self.daemon.tcp()
                sock.sendall(before)
                for _ in range(before.count(b"\r\n\r\n")):
                    answer = b""
                    while b"\r\n\r\n" not in answer:
                        answer += sock.recv(1)
                    n_body = int(answer.lower().split(b"content-length: ")[1].split(b"\r\n")[0])
                    while n_body:
                        n_body -= len(sock.recv(n_body))
                sock.sendall(request)
                self.assertNotIn(b" 101 ", read_to_end(sock), upgrade)
                sock.close()

    def test_too_many_connections_of_one_address(self):
        """Who has said hello is not turned out; of the others the oldest makes room."""
        sessions = [self.daemon.connect() for _ in range(PER_ADDRESS - 2)]  # with self.good one is left
        first = self.daemon.tcp()
        second = self.daemon.tcp()
        self.assertEqual(read_to_end(first), b"")  # within the limit it would wait for a request, and be told so
        sessions.append(self.daemon.connect())
        self.assertEqual(read_to_end(second), b"")
        self.assertEqual(read_to_end(self.daemon.tcp()), b"")
        with self.assertRaises(HandshakeFailed):
            self.daemon.connect(hello=False)
        for ws in (self.good, *sessions):
            ws.call("stats.get")
        other = self.daemon.connect(hello=False, source="127.0.0.2")  # another address is not shut out
        other.send_request("session.hello", {"token": self.daemon.token})
        self.assertEqual(other.wait_close(), 1013)  # it had all its say: the sessions are 64 in all
        for ws in sessions:
            ws.close()

    def dribble(self, sock, data):
        """By TLS the first byte comes with a handshake, of which an address may begin so many at once."""
        try:
            sock.sendall(data)
        except BROKEN:
            self.assertIsNotNone(self.daemon.trust)

    def come(self, source):
        while True:
            try:
                return self.daemon.connect(hello=False, source=source)
            except HandshakeFailed:  # by TLS it waits for what its address begins in a second
                self.assertIsNotNone(self.daemon.trust)

    def test_half_open_connections_shut_nobody_out(self):
        """More than there are places for, of one address and of many, dribbling or not: who comes is served."""
        starts = (b"", b"G", b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: ", b"GET / HTTP/1.1\r\nUpgrade: websocket\r\n")
        socks = []
        for sources in (["127.0.0.9"], [f"127.0.0.{2 + i}" for i in range(7)]):
            for i in range(CONNECTIONS + PER_ADDRESS):
                sock = self.daemon.tcp(source=sources[i % len(sources)])
                self.dribble(sock, starts[i % len(starts)])
                socks.append(sock)
            for source in (sources[0], "127.0.0.99"):
                ws = self.come(source)
                ws.hello(self.daemon.token)
                for sock in socks[-20:]:  # half of a header more, and more of them
                    self.dribble(sock, b"a")
                    socks.append(self.daemon.tcp(source=sources[-1]))
                ws.call("scene.get")
                ws.close()
            self.assertEqual(self.daemon.get("/")[0], 200)
            self.good.call("scene.get")
        self.assertGreater(self.daemon.metric("connections_turned_out_total"), PER_ADDRESS)
        for sock in socks:
            reset(sock)

    def test_too_many_sessions(self):
        sources = ["127.0.0.3", "127.0.0.4"]
        sessions = []
        for i in range(SESSIONS - 1):
            ws = self.daemon.connect(hello=False, source=sources[i % 2])
            ws.hello(self.daemon.token)
            sessions.append(ws)
        over = self.daemon.connect(hello=False, source="127.0.0.5")
        over.send_request("session.hello", {"token": self.daemon.token})
        self.assertEqual(over.wait_close(), 1013)
        sessions.pop().close()
        while True:  # the server learns of the close in its own time
            ws = self.daemon.connect(hello=False, source="127.0.0.5")
            try:
                ws.send_request("session.hello", {"token": self.daemon.token})
                ws.pump()
            except Closed:
                continue
            if any("result" in reply for reply in ws.replies.values()):
                break

    def test_silent_guests_do_not_take_the_seats(self):
        """Connections that have not said hello do not count as sessions."""
        guests = [self.daemon.connect(hello=False, source=f"127.0.0.{3 + i % 3}") for i in range(SESSIONS + 10)]
        ws = self.daemon.connect(hello=False, source="127.0.0.9")
        self.assertIn("session", ws.hello(self.daemon.token))
        for guest in guests:
            reset(guest.sock)

    def test_cut_off_everywhere(self):
        """Connections that end at every kind of bad moment, most by RST."""
        rng = random.Random(SEED)
        request = frame(TEXT, b'{"jsonrpc":"2.0","id":1,"method":"scene.get"}')
        opening = frame(TEXT, b'{"jsonrpc":"2.0","id":2,"method":"view.open","params":{"size":[256,256],"camera_id":"main"}}')
        for i in range(60):
            ws = self.daemon.connect()
            data = rng.choice([request, opening, opening + request, request * 5, frame(TEXT, b"x" * 100000)])
            ws.send_raw(data[:rng.randrange(len(data) + 1)])
            if i % 3 == 0 and data.startswith(opening):
                ws.sock.settimeout(0.05)
                try:
                    ws.pump()
                except (TimeoutError, Closed):
                    pass
            if i % 2:
                reset(ws.sock)
            else:
                ws.close()

    def test_a_flood_of_large_messages_is_read_at_its_pace(self):
        """More than the burst waits with the sender: nothing is lost, and others are read meanwhile."""
        n = 4
        flooder = self.daemon.connect()
        head, tail = b'{"jsonrpc":"2.0","id":%d,"method":"no.such","params":{"x":"', b'"}}'
        begins = [head % (1000 + i) for i in range(n)]
        # made before: masking them may take a slow machine longer than the server takes to read them at its pace
        flood = [frame(TEXT, begin + b"a" * (MESSAGE_BYTES - len(begin) - len(tail)) + tail) for begin in begins]
        start = time.monotonic()
        flooder.sock.sendall(flood[0])
        self.assert_unsupported(flooder, 1000)
        unhurried = n * (time.monotonic() - start)  # what all take on this machine without a pace: one is in the burst
        for message in flood[1:]:
            flooder.sock.sendall(message)
            self.good.call("scene.get")
        for i in range(1, n):
            self.assert_unsupported(flooder, 1000 + i)
        pace = (n * MESSAGE_BYTES - RX_BURST) / RX_PER_S
        self.assertGreaterEqual(time.monotonic() - start, pace)
        if unhurried < 0.5 * pace:  # a slow machine sends no faster than the pace
            self.assertGreater(self.daemon.metric("ws_rx_waits_total"), 0)

    def test_a_flood_of_pings_is_paid_for(self):
        """What is no message costs time, too: it is counted, beyond what is free, and others are served."""
        flooder = self.daemon.connect(pong=False)
        flood, sent = frame(PING, b"a" * 125) * 300, 0
        served_each = 32 * len(flood)  # a session may ask 240 times a second, and a fast machine counts in less
        while self.daemon.metric("ws_rx_rest_bytes_total") == 0:
            flooder.send_raw(flood)
            flooder.sip(1 << 16)  # a pong or more
            if sent % served_each == 0:
                self.good.call("stats.get")
            sent += len(flood)
            self.assertLess(sent, 1 << 28, "it was never counted")
        self.good.call("stats.get")
        flooder.close()

    def assert_unsupported(self, ws, rpc_id):
        with self.assertRaises(RpcError) as caught:
            ws.reply(rpc_id)
        self.assertEqual(caught.exception.app, "unsupported")

    def test_a_flooder_that_does_not_read_is_cut_off(self):
        """What waits for it has an end, also while nothing wakes the server but the flood itself."""
        flooder = self.daemon.connect(rcvbuf=4096)
        control = b"\\u0001" * 64  # six bytes for one in the message and in its refusal, which has it three times
        flood = frame(TEXT, b'{"jsonrpc":"2.0","id":"%b","method":"x","%b":1}' % (control, control)) * 64
        with self.assertRaises(BROKEN):
            for _ in range(4 * QUEUE_BYTES // len(flood)):
                flooder.sock.sendall(flood)

    def test_sessions_leave_nothing_behind(self):
        for _ in range(30):
            ws = self.daemon.connect()
            ws.call("view.open", {"size": [64, 64], "camera_id": "main"})
            ws.close()
        eventually(lambda: self.daemon.metric("sessions") <= 1, "sessions are gone")
        if not os.environ.get("LUMEND_FAKE"):
            eventually(lambda: self.daemon.metric("views") == 0, "views are gone")


if __name__ == "__main__":
    unittest.main()
