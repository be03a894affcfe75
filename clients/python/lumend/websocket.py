"""A WebSocket (RFC 6455) of a client, as far as lumend needs one: no extensions."""
import base64
import hashlib
import http.client
import io
import os
import re
import shutil
import socket
import ssl
import struct
import threading

from lumend.tls import TlsLine

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10
GUID = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
MESSAGE_BYTES_MAX = 1 << 30  # of what a server may send; a scene.get of the largest scenes stays below


class Disconnected(ConnectionError):
    """The connection is gone. code: of the close frame, None where there was none."""

    def __init__(self, message, code=None):
        super().__init__(message)
        self.code = code


def masked(payload, key):
    """XOR with the repeated key, as one large integer: a loop over bytes would take seconds for a mesh."""
    n = len(payload)
    pad = (key * (n // 4 + 1))[:n]
    return (int.from_bytes(payload, "big") ^ int.from_bytes(pad, "big")).to_bytes(n, "big")


def _line_to(host, port, timeout_s):
    try:
        line = socket.create_connection((host, port), timeout_s)
    except OSError as error:
        raise Disconnected(f"{host}:{port}: {error.strerror or error}: does lumend run there?") from None
    line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return line


def _by_tls(line, host, port, ca):
    try:
        return TlsLine(line, host, ca)
    except OSError as error:  # ssl's are, too
        line.close()
        if isinstance(error, ssl.SSLCertVerificationError):
            raise Disconnected(f"{host}:{port} is not trusted: {error.verify_message}: "
                               "ca= names the file of who signed its certificate") from None
        if isinstance(error, FileNotFoundError):
            raise ValueError(f"ca={ca}: there is no such file") from None
        raise Disconnected(f"{host}:{port}: no connection by TLS: {error.strerror or error}") from None


class WebSocket:
    """One thread may read while others send."""

    def __init__(self, url, timeout_s, ca=None):
        parts = re.fullmatch(r"(?:http|ws)(s?)://(\[[0-9a-fA-F:]+\]|[^/:?#]+)(?::(\d+))?"  # its port, unless it is 80 or 443
                             r"(/[!\"$->@-~]*)?(?:\?project=(\w+))?(?:#t=(.*))?", url)  # its path, which a proxy may look at
        if not parts:
            raise ValueError(f"{url} is not a URL as the server prints it: http://127.0.0.1:9460/#t=TOKEN")
        secure, host, port, path, self.project, self.token = parts.groups()
        port = port or ("443" if secure else "80")
        self._address = (bool(secure), host.strip("[]"), int(port), path or "/", timeout_s, ca)
        if ca and not secure:
            raise ValueError(f"ca={ca} is for https, and this URL is of http")
        self._line = _line_to(host.strip("[]"), int(port), timeout_s)
        if secure:
            self._line = _by_tls(self._line, host.strip("[]"), port, ca)
        self._incoming = io.BufferedReader(self._line) if secure else self._line.makefile("rb")
        self._sending = threading.Lock()
        try:
            self._handshake(host, port, path or "/")
        except BaseException as error:
            self.close()
            if isinstance(error, OSError) and not isinstance(error, (Disconnected, TimeoutError)):
                raise Disconnected(f"{host}:{port} hung up: does its address begin with {'http' if secure else 'https'}?") from None
            raise
        self._line.settimeout(None)  # whoever waits has a limit of their own

    def _handshake(self, host, port, path):
        key = base64.b64encode(os.urandom(16))
        self._line.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                           f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key.decode()}\r\n"
                           "Sec-WebSocket-Protocol: lumend.v1\r\n\r\n".encode())
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            line = self._incoming.readline(8192)
            if not line or len(head) > 65536:
                raise Disconnected(f"{host}:{port} answers something else than a web server would")
            head += line
        accept = base64.b64encode(hashlib.sha1(key + GUID).digest()).lower()
        if not head.startswith(b"HTTP/1.1 101 ") or accept not in head.lower():
            status = head.split(b"\r\n")[0].decode(errors="replace")
            raise Disconnected(f"{host}:{port} does not speak lumend.v1: {status}")

    def fetch(self, where, file):
        """What `where`, below the server's address, has, written to a file that is open. On a line of its own."""
        secure, host, port, path, timeout_s, ca = self._address
        line = (http.client.HTTPSConnection(host, port, timeout=timeout_s, context=ssl.create_default_context(cafile=ca)) if secure
                else http.client.HTTPConnection(host, port, timeout=timeout_s))
        try:
            line.request("GET", f"{path.rpartition('/')[0]}/{where}")
            reply = line.getresponse()
            if reply.status != 200:
                raise Disconnected(f"{host}:{port} does not give {where.partition('/')[0]}: {reply.status} {reply.reason}")
            shutil.copyfileobj(reply, file)
            if reply.length:  # what it still owes
                raise Disconnected(f"{host}:{port} stopped {reply.length} bytes before the end")
        except (OSError, http.client.HTTPException) as error:
            raise error if isinstance(error, Disconnected) else Disconnected(f"{host}:{port}: {error}") from None
        finally:
            line.close()

    def send(self, payload, kind=TEXT):
        n = len(payload)
        size = (struct.pack("!B", 128 | n) if n < 126 else
                struct.pack("!BH", 128 | 126, n) if n < 65536 else struct.pack("!BQ", 128 | 127, n))
        key = os.urandom(4)  # what a client sends is masked
        frame = bytes([128 | kind]) + size + key + masked(payload, key)
        try:
            with self._sending:
                self._line.sendall(frame)
        except OSError as error:
            raise Disconnected(f"the connection broke: {error.strerror or error}") from None

    def _exactly(self, n):
        data = self._incoming.read(n)
        if len(data) < n:
            raise Disconnected("the server closed the connection")
        return data

    def _frame(self):
        first, second = self._exactly(2)
        size = second & 127
        if size >= 126:
            size = int.from_bytes(self._exactly(2 if size == 126 else 8), "big")
        if second & 128 or first & 112 or size > MESSAGE_BYTES_MAX:
            raise Disconnected("the server sent what no WebSocket server may")
        return bool(first & 128), first & 15, self._exactly(size)

    def receive(self):
        """The next message, (TEXT or BINARY, bytes). Answers pings on the way. Raises Disconnected."""
        message, kind = [], None
        try:
            while True:
                last, opcode, payload = self._frame()
                if opcode == PING:
                    self.send(payload, PONG)
                elif opcode == CLOSE:
                    code = int.from_bytes(payload[:2], "big") if len(payload) >= 2 else None
                    raise Disconnected(f"the server closed the connection: {code} "
                                       f"{payload[2:].decode(errors='replace')}".rstrip(), code)
                elif opcode < 8:
                    kind = opcode or kind
                    message.append(payload)
                    if sum(map(len, message)) > MESSAGE_BYTES_MAX:
                        raise Disconnected("the server sent a message without end")
                    if last:
                        return kind, b"".join(message)
        except (OSError, ValueError) as error:  # closed here, or the line broke
            if isinstance(error, Disconnected):
                raise
            raise Disconnected("the connection broke") from None

    def shut(self):
        """Of any thread: ends a receive() of another."""
        try:
            self._line.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass

    def close(self):
        """Of the thread that receives, or the last."""
        self.shut()
        self._incoming.close()
        self._line.close()
