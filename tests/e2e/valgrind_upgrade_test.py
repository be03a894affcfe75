"""The upgrade guard under valgrind. libwebsockets 4.1.6 reads a freed header block when a later request of a kept-alive
connection asks for an upgrade it does not know; the distribution's library carries no sanitizer, so only valgrind sees it."""
import os
import shutil
import sys
import tempfile
import unittest

from daemon import Daemon
from wsclient import connect_tcp

PAGE = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"
UPGRADE = b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: %s\r\n\r\n"


class Upgrade(unittest.TestCase):
    def test_kept_alive_then_upgrade(self):
        with tempfile.NamedTemporaryFile("r", suffix=".valgrind") as report:
            valgrind = ["valgrind", "--error-exitcode=99", f"--log-file={report.name}", "--undef-value-errors=no"]
            # furnace: the smallest scene. The daemon is not asked for a picture, so the renderer hardly runs.
            os.environ["LUMEND_TEST_SCENE"] = "furnace"
            try:
                with Daemon("--no-auth", wrapper=valgrind) as daemon:
                    for upgrade in (b"foo", b"h2c", b"websocket-", b"x" * 300):
                        sock = connect_tcp(daemon.port)
                        sock.sendall(PAGE)
                        self.assertIn(b" 200 ", sock.recv(4096))
                        sock.sendall(UPGRADE % upgrade)
                        data = b""
                        while chunk := sock.recv(4096):
                            data += chunk
                        self.assertNotIn(b" 101 ", data)
                        sock.close()
                    self.assertEqual(daemon.get("/healthz")[0], 200)
            except AssertionError:
                print(report.read())
                raise
            self.assertIn("ERROR SUMMARY: 0 errors", report.read())


if __name__ == "__main__":
    if not shutil.which("valgrind"):
        print("skipped: no valgrind")
        sys.exit(0)
    unittest.main()
