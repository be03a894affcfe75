"""clients/minimal: it ends well, its file is a PNG of the whole picture, and that picture shows the edit."""
import os
import socket
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

from daemon import Daemon
from wsclient import PING, PONG, WAIT_S, frame, mask_bytes

CLIENT = os.path.join(os.path.dirname(__file__), "..", "..", "clients", "minimal", "client.py")
LAMP = "ceiling-panel"
W, H = 320, 240
BLACK = b"\0\0\0\xff"  # a pixel


def run_client(daemon, out, lamp=LAMP, lumens="5500", token=None):
    url = f"http://{daemon.host}:{daemon.port}/#t={daemon.token if token is None else token}"
    return subprocess.run([sys.executable, CLIENT, url, out, lamp, lumens], capture_output=True, text=True,
                          timeout=5 * WAIT_S)  # a hang must not hang the suite


def png_pixels(path):
    """(width, height, RGBA bytes) of an 8-bit RGBA file whose rows are not filtered; checks sums and order."""
    with open(path, "rb") as file:
        data = file.read()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", data[:8]
    chunks, at = [], 8
    while at < len(data):
        n, name = struct.unpack_from("!I4s", data, at)
        body = data[at + 8:at + 8 + n]
        assert struct.unpack_from("!I", data, at + 8 + n)[0] == zlib.crc32(name + body), name
        chunks.append((name, body))
        at += 12 + n
    assert [name for name, _ in chunks] == [b"IHDR", b"IDAT", b"IEND"], chunks
    width, height, *kind = struct.unpack("!2I5B", chunks[0][1])
    assert kind == [8, 6, 0, 0, 0], kind
    raw, step = zlib.decompress(chunks[1][1]), 4 * width + 1
    assert len(raw) == height * step and not any(raw[::step]), "rows are filtered, or too few"
    return width, height, b"".join(raw[i * step + 1:(i + 1) * step] for i in range(height))


class Minimal(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.out = os.path.join(self.folder.name, "picture.png")

    def tearDown(self):
        self.folder.cleanup()

    def picture(self, daemon, lumens):
        done = run_client(daemon, self.out, lumens=lumens)
        self.assertEqual(done.returncode, 0, done.stderr)
        return png_pixels(self.out)

    def flux(self, daemon):
        ws = daemon.connect()
        ops = ws.call("scene.get", {"expand": True})["ops"]
        ws.close()
        return next(op["flux_lm"] for op in ops if op["id"] == LAMP)

    def check_room(self, lit):
        """Every tile is there, and where it belongs: cornell fills columns 35 to 284, red at the left, green at the right."""
        pixel = lambda x, y: lit[4 * (W * y + x):4 * (W * y + x) + 4]
        n_black = sum(pixel(x, y) == BLACK for y in range(H) for x in range(35, 285))
        self.assertLess(n_black, 400)  # the globe that is off has about 160; of the smallest tile 29 x 112 are inside
        self.assertEqual({pixel(x, y) for y in (0, H // 2, H - 1) for x in (0, W - 1)}, {BLACK})
        for y in (60, 120, 180):
            self.assertGreater(pixel(58, y)[0], 2 * pixel(58, y)[1])
            self.assertGreater(pixel(262, y)[1], pixel(262, y)[0])
        self.assertGreater(min(pixel(160, 26)[:3]), 200)  # the lamp itself

    def test_the_picture_shows_the_edit(self):
        with Daemon("--deterministic") as daemon:
            ws = daemon.connect()
            ws.call("scene.apply", {"ops": [{"op": "set", "id": "globe", "path": "/on", "value": False}]})
            width, height, lit = self.picture(daemon, "11000")
            self.assertEqual((width, height), (W, H))
            self.assertEqual(set(lit[3::4]), {255})
            self.check_room(lit)
            self.assertEqual(self.flux(daemon), 11000)
            self.assertLess(sum(self.picture(daemon, "1100")[2]), sum(lit))
            self.assertEqual(self.flux(daemon), 1100)
            # The only lamp is off: nothing shines, and every pixel is black.
            self.assertEqual(self.picture(daemon, "0")[2], BLACK * (W * H))

    def test_pings_are_answered(self):
        """Else the server takes it for dead while a picture takes long."""
        with socket.create_server(("127.0.0.1", 0)) as server:
            server.settimeout(WAIT_S)
            url = f"http://127.0.0.1:{server.getsockname()[1]}/"
            client = subprocess.Popen([sys.executable, CLIENT, url, self.out, LAMP, "1"], stderr=subprocess.DEVNULL)
            with server.accept()[0] as line, line.makefile("rb") as incoming:
                line.settimeout(WAIT_S)
                while incoming.readline() not in (b"\r\n", b""):
                    pass
                line.sendall(b"HTTP/1.1 101 Switching Protocols\r\n\r\n" + frame(PING, b"still there?", masked=False))
                answer = None
                while answer is None:
                    first, second = incoming.read(2)
                    size = second & 127 if second & 127 < 126 else int.from_bytes(incoming.read(2), "big")
                    key, data = incoming.read(4), incoming.read(size)
                    if first & 15 == PONG:
                        answer = mask_bytes(data, key)
            self.assertEqual(answer, b"still there?")
            self.assertNotEqual(client.wait(WAIT_S), 0)

    def test_refusals_end_it(self):
        with Daemon() as daemon:
            done = run_client(daemon, self.out, lamp="ceiling-pane")
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(LAMP, done.stderr)  # the server names what is near
            done = run_client(daemon, self.out, token="wrong")
            self.assertNotEqual(done.returncode, 0)
            self.assertIn("token", done.stderr)
            self.assertFalse(os.path.exists(self.out))
            daemon.assert_well()
        done = run_client(daemon, self.out)  # that has stopped
        self.assertRegex(done.stderr, r"^http://\S+: Connection refused: does lumend run there\?\n$")
        done = subprocess.run([sys.executable, CLIENT, daemon.token, self.out, LAMP, "1"], capture_output=True, text=True)
        self.assertRegex(done.stderr, r"^\S+ is not a URL")


if __name__ == "__main__":
    unittest.main()
