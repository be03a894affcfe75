"""A WebSocket client (RFC 6455) on a raw socket, for tests: it can also send what a correct client never would.

Only the standard library. Every wait has a limit of WAIT_S, which fails the test; nothing sleeps to synchronise.
"""
import base64
import hashlib
import json
import os
import socket
import ssl
import struct

WAIT_S = 60.0
SUBPROTOCOL = "lumend.v1"
GUID = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"

BROKEN = (ConnectionError, ssl.SSLError)  # how a connection ends that is cut off


def read_to_end(sock):
    data = b""
    try:
        while chunk := sock.recv(1 << 16):
            data += chunk
    except BROKEN:
        pass
    return data


CONTINUATION, TEXT, BINARY, CLOSE, PING, PONG = 0, 1, 2, 8, 9, 10


class Closed(Exception):
    """The connection is closed. code: of the close frame, or None when there was none."""

    def __init__(self, code=None, reason=""):
        super().__init__(f"closed: {code} {reason}")
        self.code = code
        self.reason = reason


class HandshakeFailed(Exception):
    """The server did not switch protocols. status: of its HTTP answer, or None when it just hung up."""

    def __init__(self, status, head=b""):
        super().__init__(f"handshake refused: {status}")
        self.status = status
        self.head = head


class RpcError(Exception):
    def __init__(self, error):
        super().__init__(f"{error.get('code')} {error.get('message')} {error.get('data')}")
        self.code = error.get("code")
        self.data = error.get("data", {})
        self.app = self.data.get("code")


def mask_bytes(payload, key):
    """XOR with the repeated key, as one big integer: fast without a loop over bytes."""
    if not payload:
        return b""
    n = len(payload)
    pad = (key * (n // 4 + 1))[:n]
    return (int.from_bytes(payload, "big") ^ int.from_bytes(pad, "big")).to_bytes(n, "big")


def frame(opcode, payload=b"", fin=True, reserved=0, masked=True, declared=None):
    """The bytes of one frame. declared: a length to announce instead of the true one."""
    n = len(payload) if declared is None else declared
    first = (0x80 if fin else 0) | (reserved << 4) | opcode
    mask_bit = 0x80 if masked else 0
    if n < 126:
        head = struct.pack("!BB", first, mask_bit | n)
    elif n < 1 << 16:
        head = struct.pack("!BBH", first, mask_bit | 126, n)
    else:
        head = struct.pack("!BBQ", first, mask_bit | 127, n)
    if not masked:
        return head + payload
    key = os.urandom(4)
    return head + key + mask_bytes(payload, key)


def connect_tcp(port, host="127.0.0.1", rcvbuf=None, source=None, trust=None):
    """trust: by TLS, whose handshake comes with the first byte that is sent or waited for."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    sock.settimeout(WAIT_S)
    if rcvbuf:  # before connecting: it decides the window that is offered
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, rcvbuf)
    if source:
        sock.bind((source, 0))
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.connect((host, port))
    return trust.wrap_socket(sock, server_hostname=host, do_handshake_on_connect=False) if trust else sock


class WebSocket:
    """One connection. Messages that come while something else is waited for are kept in order."""

    def __init__(self, port, origin=None, host=None, path="/", subprotocol=SUBPROTOCOL, headers=(), rcvbuf=None,
                 source=None, pong=True, trust=None, wrap=lambda sock: sock):
        self.sock = wrap(connect_tcp(port, rcvbuf=rcvbuf, source=source, trust=trust))
        self.buffer = bytearray()
        self.next_id = 1
        self.replies = {}
        self.notifications = []
        self.binaries = []
        self.pongs = []
        self.parts, self.part_opcode = [], None
        self.answer_pings = pong
        self._handshake(port, origin, host, path, subprotocol, headers)

    def _handshake(self, port, origin, host, path, subprotocol, headers):
        key = base64.b64encode(os.urandom(16))
        lines = [f"GET {path} HTTP/1.1", f"Host: {host if host is not None else f'127.0.0.1:{port}'}",
                 "Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key.decode()}",
                 "Sec-WebSocket-Version: 13"]
        if subprotocol:
            lines.append(f"Sec-WebSocket-Protocol: {subprotocol}")
        if origin is not None:
            lines.append(f"Origin: {origin}")
        lines.extend(headers)
        try:
            self.sock.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
            while b"\r\n\r\n" not in self.buffer:
                self._more()
        except (Closed, *BROKEN):
            raise HandshakeFailed(None) from None
        head, rest = bytes(self.buffer).split(b"\r\n\r\n", 1)
        status = int(head.split(b" ", 2)[1])
        if status != 101:
            self.sock.close()
            raise HandshakeFailed(status, head)
        self.buffer = bytearray(rest)
        expected = base64.b64encode(hashlib.sha1(key + GUID).digest())
        self.head = head
        assert b"sec-websocket-accept: " + expected.lower() in head.lower(), head

    # ---- bytes ----

    def _more(self):
        try:
            data = self.sock.recv(1 << 16)
        except BROKEN:
            raise Closed() from None
        if not data:
            raise Closed()
        self.buffer += data

    def send_raw(self, data):
        try:
            self.sock.sendall(data)
        except BROKEN:
            pass  # the server has closed: the next read says how

    def close(self):
        self.sock.close()

    def leave(self):
        """Ends the session for good, unlike a connection that breaks."""
        self.send_raw(frame(CLOSE, struct.pack("!H", 1000)))
        self.wait_close()
        self.close()

    def __del__(self):
        if hasattr(self, "sock"):
            self.sock.close()

    # ---- frames and messages ----

    def _buffered_frame(self):
        """(fin, opcode, payload) of the frame at the head of the buffer, or None while it is not all there."""
        buffer = self.buffer
        if len(buffer) < 2:
            return None
        first, second = buffer[0], buffer[1]
        assert not second & 0x80, "a server must not mask"
        assert not first & 0x70, "reserved bits set"
        n, at = second & 0x7F, 2
        if n >= 126:
            at = 4 if n == 126 else 10
            if len(buffer) < at:
                return None
            n = int.from_bytes(buffer[2:at], "big")
        if len(buffer) < at + n:
            return None
        payload = bytes(buffer[at:at + n])
        del buffer[:at + n]
        return bool(first & 0x80), first & 0x0F, payload

    def _message_of(self, received):
        """Takes a frame in; (opcode, payload) when it completes a data message, else None. Raises Closed."""
        fin, opcode, payload = received
        if opcode == CLOSE:
            code = int.from_bytes(payload[:2], "big") if len(payload) >= 2 else None
            raise Closed(code, payload[2:].decode(errors="replace"))
        if opcode == PING:
            if self.answer_pings:
                self.send_raw(frame(PONG, payload))
        elif opcode == PONG:
            self.pongs.append(payload)
        else:
            assert (opcode == CONTINUATION) == (self.part_opcode is not None), "bad fragmentation"
            self.part_opcode = opcode if self.part_opcode is None else self.part_opcode
            self.parts.append(payload)
            if fin:
                message = self.part_opcode, b"".join(self.parts)
                self.parts, self.part_opcode = [], None
                return message
        return None

    def recv_message(self):
        """(opcode, payload) of the next data message; answers pings on the way. Raises Closed."""
        while True:
            received = self._buffered_frame()
            if received is None:
                self._more()
                continue
            message = self._message_of(received)
            if message:
                return message

    def sip(self, n_bytes):
        """Reads at most n_bytes, does not wait, and files the messages that are complete: a slow line."""
        self.sock.settimeout(0)
        try:
            self.buffer += self.sock.recv(n_bytes)
        except (BlockingIOError, ssl.SSLWantReadError):
            pass
        finally:
            self.sock.settimeout(WAIT_S)
        while (received := self._buffered_frame()) is not None:
            message = self._message_of(received)
            if message:
                self._file(*message)

    def send_text(self, text):
        self.send_raw(frame(TEXT, text.encode() if isinstance(text, str) else text))

    def wait_close(self):
        """Reads until the connection ends; returns the close code, or None for a connection that was cut."""
        try:
            while True:
                self.recv_message()
        except Closed as closed:
            return closed.code

    # ---- JSON-RPC ----

    def pump(self):
        """Takes one message and files it."""
        self._file(*self.recv_message())

    def _file(self, opcode, payload):
        if opcode == BINARY:
            self.binaries.append(payload)
            return
        message = json.loads(payload)
        assert message.get("jsonrpc") == "2.0", message
        if "method" in message:
            self.notifications.append((message["method"], message.get("params", {})))
        else:
            self.replies[message["id"]] = message

    def notify(self, method, params):
        self.send_text(json.dumps({"jsonrpc": "2.0", "method": method, "params": params}))

    def send_request(self, method, params=None):
        request = {"jsonrpc": "2.0", "id": self.next_id, "method": method}
        if params is not None:
            request["params"] = params
        self.next_id += 1
        self.send_text(json.dumps(request))
        return request["id"]

    def reply(self, request_id):
        while request_id not in self.replies:
            self.pump()
        message = self.replies.pop(request_id)
        if "error" in message:
            raise RpcError(message["error"])
        return message["result"]

    def call(self, method, params=None):
        return self.reply(self.send_request(method, params))

    def hello(self, token, client="test", **more):
        params = {"client": client, **more}
        if token is not None:
            params["token"] = token
        return self.call("session.hello", params)

    def wait_notification(self, method):
        while True:
            for i, (name, params) in enumerate(self.notifications):
                if name == method:
                    del self.notifications[i]
                    return params
            self.pump()


# ---- frames of pictures ----

HEADER = struct.Struct("<4sBBHIIQQIIHHHHHHBBBBIHH")
HEADER_FIELDS = ("magic", "version", "kind", "header_len", "flags", "payload_len", "frame_seq", "scene_rev", "view_id",
                 "camera_seq", "x", "y", "w", "h", "full_w", "full_h", "codec", "quality", "downscale", "zero",
                 "server_us", "error", "spp")
LAST_TILE, LOSSLESS, CONVERGED = 1, 2, 4


def tile_header(message):
    header = dict(zip(HEADER_FIELDS, HEADER.unpack(message[:HEADER.size])))
    assert HEADER.size == 64 and header["magic"] == b"LUMF" and header["version"] == 1, header
    assert header["header_len"] == 64 and header["payload_len"] == len(message) - 64, header
    assert header["zero"] == 0, header
    return header
