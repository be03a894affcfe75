"""lumend render --tev: the packets that a viewer of HDR images gets, parsed as it would, are the picture of the file."""
import os
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import unittest

from daemon import LUMEND

sys.path.insert(0, os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "support")))
from exr import Exr  # noqa: E402

CLOSE, CREATE, UPDATE = 2, 4, 6
PACKET_BYTES_MAX = 8 << 20


class Packet:
    """Fields one after the other, of a packet without its length."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def list(self, code, n):
        values = struct.unpack_from(f"<{n}{code}", self.data, self.at)
        self.at += struct.calcsize(f"<{n}{code}")
        return values

    def take(self, code):
        return self.list(code, 1)[0]

    def text(self):
        end = self.data.index(0, self.at)
        self.at, text = end + 1, self.data[self.at:end].decode()
        return text


class Viewer:
    """What tev does with packets: images by name, each a grid of floats per channel. Reads until the other side hangs up; or
    hangs up itself after `stop_after` packets."""

    def __init__(self, stop_after=None):
        self.images, self.log, self.fault, self.stop_after = {}, [], None, stop_after
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.thread = threading.Thread(target=self.run)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.listener.shutdown(socket.SHUT_RDWR)  # wakes accept(), where nobody came
        self.thread.join()
        self.listener.close()
        if self.fault:
            raise self.fault

    def run(self):
        try:
            try:
                line, _ = self.listener.accept()
            except OSError:
                return
            with line, line.makefile("rb") as stream:
                while (head := stream.read(4)) and (self.stop_after is None or len(self.log) < self.stop_after):
                    size = struct.unpack("<I", head)[0]
                    assert 5 <= size <= PACKET_BYTES_MAX, size
                    data = stream.read(size - 4)
                    assert len(data) == size - 4, "it hung up within a packet"
                    self.take(Packet(data))
        except Exception as fault:  # pylint: disable=broad-except
            self.fault = fault

    def take(self, p):
        kind = p.take("B")
        self.log.append(kind)
        if kind == CLOSE:
            self.images.pop(p.text(), None)
        elif kind == CREATE:
            p.take("B")
            name = p.text()
            w, h = p.list("i", 2)
            names = [p.text() for _ in range(p.take("i"))]
            assert len(set(names)) == len(names) and name not in self.images, (name, names)
            self.images[name] = (w, h, {channel: [None] * (w * h) for channel in names})
        else:
            assert kind == UPDATE, kind
            self.update(p)
        assert p.at == len(p.data), "bytes at the end that no field takes"

    def update(self, p):
        p.take("B")
        w, h, channels = self.images[p.text()]
        names = [p.text() for _ in range(p.take("i"))]
        x0, y0, cw, ch = p.list("i", 4)
        assert x0 >= 0 and y0 >= 0 and x0 + cw <= w and y0 + ch <= h
        offsets, strides = p.list("q", len(names)), p.list("q", len(names))
        values = p.list("f", (len(p.data) - p.at) // 4)
        for name, offset, stride in zip(names, offsets, strides, strict=True):
            for i in range(cw * ch):
                channels[name][(y0 + i // cw) * w + x0 + i % cw] = values[offset + i * stride]


class Tev(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())

    def render(self, port, *options, out="a.exr", status=0):
        path = os.path.join(self.folder, out)
        done = subprocess.run([LUMEND, "render", "--scene", "cornell", "--size", "60x40", "--out", path, "--tev", str(port), *options],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, status, done.stderr)
        return path, done.stderr

    def same(self, image, path):
        """All channels of the file, float for float."""
        exr, (w, h, channels) = Exr(path), image
        self.assertEqual((w, h), (exr.width, exr.height))
        self.assertEqual(sorted(channels), sorted(name for name, _ in exr.channels))
        for y, row in enumerate(exr.rows()):
            for name, values in row.items():
                shown = channels[name][y * w:(y + 1) * w]
                self.assertEqual(struct.pack(f"<{w}f", *shown), struct.pack(f"<{w}f", *values), (name, y))

    def test_the_picture_is_that_of_the_file(self):
        with Viewer() as viewer:
            path, _ = self.render(viewer.port, "--spp", "8", "--method", "path")
        self.assertEqual(list(viewer.images), ["lumend cornell"])
        self.same(viewer.images["lumend cornell"], path)
        self.assertEqual(viewer.log[:3], [CLOSE, CREATE, UPDATE])
        self.assertIn("albedo.R", viewer.images["lumend cornell"][2])

    def test_light_groups_are_layers_of_it(self):
        with Viewer() as viewer:
            path, _ = self.render(viewer.port, "--spp", "2", "--light-groups")
        self.same(viewer.images["lumend cornell"], path)
        self.assertEqual(viewer.log, [CLOSE, CREATE, UPDATE], "when all are there")

    def test_frames_have_names(self):
        with Viewer() as viewer:
            self.render(viewer.port, "--edits", "cornell-moves", "--frames", "2", "--spp", "1", out="a%d.exr")
        self.assertEqual(sorted(viewer.images), ["lumend cornell, frame 0", "lumend cornell, frame 1"])
        for i in range(2):
            self.same(viewer.images[f"lumend cornell, frame {i}"], os.path.join(self.folder, f"a{i}.exr"))

    def test_large_pictures_come_in_bands(self):
        with Viewer() as viewer:
            path, _ = self.render(viewer.port, "--method", "whitted", "--size", "500x400", out="a.png")
        w, h, channels = viewer.images["lumend cornell"]
        self.assertEqual((w, h), (500, 400))
        self.assertTrue(os.path.getsize(path) > 0 and all(None not in values for values in channels.values()))
        self.assertGreater(viewer.log.count(UPDATE), 2)

    def test_a_viewer_that_goes_costs_no_picture(self):
        """It hangs up after the first packet: what was sent by then tells the other side."""
        with Viewer(stop_after=1) as viewer:
            path, told = self.render(viewer.port, "--method", "whitted", "--size", "1200x900")
        self.assertIn("takes no more", told)
        self.assertEqual(Exr(path).width, 1200)

    def test_without_a_viewer_it_says_so(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
        _, told = self.render(port, status=1)
        self.assertIn(f"no tev at 127.0.0.1 port {port}", told)
        for wrong in ("0", "here:14158", "127.0.0.1:99999", "x"):
            _, told = self.render(wrong, status=2)
            self.assertIn("--tev", told)


if __name__ == "__main__":
    unittest.main()
