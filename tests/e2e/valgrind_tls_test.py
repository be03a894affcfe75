"""TLS under valgrind: handshakes that end nowhere, or make room, connections that are cut, a flood that is not read. What
libwebsockets and OpenSSL do then no sanitizer sees."""
import os
import shutil
import socket
import ssl
import struct
import sys
import tempfile
import unittest

from authority import Authority
from daemon import Daemon
from wsclient import BROKEN, TEXT, connect_tcp, frame


class Tls(unittest.TestCase):
    def half_open(self, port, hello):
        """More than one address may have, so that the oldest make room."""
        socks = []
        for i in range(80):
            socks.append(connect_tcp(port))
            try:
                socks[-1].sendall((b"", hello[:7], hello, b"GET / HTTP/1.1\r\n\r\n", os.urandom(300))[i % 5])
            except ConnectionError:
                pass
        return socks

    def cut(self, daemon, after):
        """By RST, at several moments of a connection's life."""
        sock = daemon.tcp()
        try:
            if after > 0:
                sock.do_handshake()
            if after > 1:
                sock.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n" + (b"\r\n" if after > 2 else b""))
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        except BROKEN:
            pass
        sock.close()

    def flood(self, daemon):
        """Beyond what may come at once, in records that hold many messages: it may be not read from for a while."""
        ws = daemon.connect(hello=False)
        ws.hello(None)
        flood = frame(TEXT, b'{"jsonrpc":"2.0","id":1,"method":"x","params":"%b"}' % (b"a" * 65536)) * 16
        for _ in range(32):  # MiB: twice the burst; valgrind reads more slowly than it is let
            ws.send_raw(flood)
        ws.send_raw(frame(TEXT, b'{"jsonrpc":"2.0","id":2,"method":"stats.get"}') * 400)
        ws.reply(2)
        ws.close()

    def test_connections_that_end_anyhow(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        authority = Authority(folder)
        cert, key = authority.issue("daemon")
        sent = ssl.MemoryBIO()
        with self.assertRaises(ssl.SSLWantReadError):
            authority.trust().wrap_bio(ssl.MemoryBIO(), sent, server_hostname="localhost").do_handshake()
        report = os.path.join(folder, "report")
        # Of values that OpenSSL's assembler leaves undefined nothing is asked.
        valgrind = ["valgrind", "--error-exitcode=99", f"--log-file={report}", "--undef-value-errors=no"]
        try:
            with Daemon("--no-auth", "--tls-cert", cert, "--tls-key", key, wrapper=valgrind, scene="furnace",
                        trust=authority.trust()) as daemon:
                socks = self.half_open(daemon.port, sent.read())
                for i in range(12):
                    self.cut(daemon, i % 4)
                self.flood(daemon)
                self.assertEqual(daemon.get("/healthz")[0], 200)
                for sock in socks:
                    sock.close()
        except AssertionError:
            with open(report, encoding="utf-8") as file:
                print(file.read())
            raise
        with open(report, encoding="utf-8") as file:
            self.assertIn("ERROR SUMMARY: 0 errors", file.read())


if __name__ == "__main__":
    if not shutil.which("valgrind") or not shutil.which("openssl"):
        print("skipped: no valgrind, or no openssl")
        sys.exit(0)
    unittest.main()
