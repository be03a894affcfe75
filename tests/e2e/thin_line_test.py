"""What goes over a thin line: WebP for clients that read it, as the line needs it; JPEG as before for all others; and at rest
always the exact picture.

The line is a proxy that passes on so many bytes a second. What is asserted is which codec runs and what the tiles hold, not how
long anything took. A busy machine makes a thin line thinner, which changes nothing; over a wide one it answers as late as if that
were thin. So there the client says how long it had the picture by then (held_ms), from its first tile on, and WebP is held against
what the server took the line to be."""
import ctypes
import ctypes.util
import time
import unittest

from daemon import Daemon
from thin_line import ThinLine
from wsclient import CONVERGED, LAST_TILE, LOSSLESS, RpcError, WebSocket, tile_header

SIZE = [400, 300]
RGBA8, JPEG, PNG, WEBP = 0, 1, 2, 3
THIN, WIDE = 60_000, 4_000_000  # bytes a second; a JPEG of 85 of this picture has 15 to 25 KB
FRAMES = 60  # of a drag, at most: a step down takes four, and what is known of the line a few
MANY = 1000  # likewise, where a busy machine may answer late again and again: a hang must not hang the suite
AT_ONCE_S = 0.05  # JPEG that is with the client so soon is left alone: SEEN_AT_ONCE_S of server/stream/coding.c, less the encoding


def has_webp(daemon):
    ws = daemon.connect()
    try:
        ws.call("view.open", {"size": [16, 16], "camera_id": "main", "codec": "webp"})
    except RpcError as error:
        assert error.data["code"] == "unsupported" and error.data["path"] == "codec", error.error
        return False
    finally:
        ws.close()
    return True


def libwebp():
    name = ctypes.util.find_library("webp") or "libwebp.so.7"
    try:
        library = ctypes.CDLL(name)
    except OSError:
        return None
    library.WebPDecodeRGBAInto.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int]
    library.WebPDecodeRGBAInto.restype = ctypes.c_void_p
    return library


class View:
    """A view whose camera moves on with each frame, until it stops."""

    def __init__(self, port, token, **members):
        self.ws = WebSocket(port)
        self.ws.hello(token)
        self.seq = 0
        self.wide = False  # what the first tile says of the line is all there is to say
        self.id = self.ws.call("view.open", {"size": SIZE, "codec": "jpeg", "quality": 85, "method": "live", "spp": 4,
                                             "exposure_ev": 6, **self.camera(), **members})["view_id"]

    def camera(self):
        self.seq += 1
        x = 0.3 * ((self.seq * 7) % 11 - 5) / 5
        return {"camera": {"position": [x, 1, 3.2], "target": [0, 1, 0], "vfov_deg": 40}, "camera_seq": self.seq}

    def move(self):
        self.ws.notify("view.update", {"view_id": self.id, **self.camera()})

    def frame(self):
        """The next whole frame, acknowledged: headers and payloads of its tiles."""
        tiles = []
        while True:
            while not self.ws.binaries:
                self.ws.pump()
            if not tiles:
                came_s = time.monotonic()
            message = self.ws.binaries.pop(0)
            header = tile_header(message)
            tiles.append((header, message[64:]))
            if header["flags"] & LAST_TILE:
                held = {"held_ms": 1e3 * (time.monotonic() - came_s)} if self.wide else {}
                self.ws.notify("frame.ack", {"view_id": self.id, "frame_seq": header["frame_seq"], **held})
                return tiles

    def stats(self):
        return [p for name, p in self.ws.notifications if name == "frame.stats"]

    def drag(self, n, until=lambda tiles: False):
        """Moves n times, once for each frame, or until a frame is such. How its frames were coded, but for those that came last
        of a picture, as where this machine halted for a while."""
        seen = []
        for _ in range(n):
            self.move()
            tiles = self.frame()
            seen.append({(h["codec"], h["quality"]) for h, _ in tiles if not h["flags"] & CONVERGED})
            if until(tiles):
                break
        return seen

    def rest(self):
        """Until nothing more comes: the last tile of each place, and the header of the last frame."""
        shown = {}
        while True:
            tiles = self.frame()
            for header, payload in tiles:
                shown[header["x"], header["y"]] = header, payload
            last = tiles[-1][0]
            if last["flags"] & CONVERGED and last["camera_seq"] == self.seq:
                return shown, last


def pixels(shown, decode):
    """The picture as RGB rows of bytes."""
    w, h = SIZE
    picture = bytearray(3 * w * h)
    for header, payload in shown.values():
        tile = decode(header, payload)
        for row in range(header["h"]):
            line = tile[4 * header["w"] * row:4 * header["w"] * (row + 1)]
            at = 3 * (w * (header["y"] + row) + header["x"])
            for c in range(3):
                picture[at + c:at + 3 * header["w"]:3] = line[c::4]
    return bytes(picture)


def raw(_, payload):
    return payload


class Thin(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--scene", "cornell", "--deterministic").__enter__()
        cls.webp = has_webp(cls.daemon)

    @classmethod
    def tearDownClass(cls):
        cls.daemon.assert_well()
        cls.daemon.__exit__(None, None, None)

    def skip_without_webp(self):
        if not self.webp:
            self.skipTest("skipped: this build has no WebP")

    def compare(self, view, shown):
        library = libwebp()
        if not library:
            self.skipTest("skipped: no libwebp to look at tiles with")

        def decode(header, payload):
            self.assertEqual((header["codec"], header["flags"] & LOSSLESS), (WEBP, LOSSLESS), header)
            room = ctypes.create_string_buffer(4 * header["w"] * header["h"])
            self.assertTrue(library.WebPDecodeRGBAInto(payload, len(payload), room, len(room), 4 * header["w"]))
            return room.raw

        self.assertEqual(pixels(shown, decode), pixels(self.beside(view).rest()[0], raw))

    def beside(self, view, **members):
        """A view of the same, without loss and without the thin line. By path traced samples: of other methods a view keeps what it
        found where the eye was before."""
        view.seq -= 1
        other = View(self.daemon.port, self.daemon.token, codec="rgba8", method="path", **view.camera(), **members)
        other.seq = view.seq
        return other

    def test_a_client_that_reads_it_gets_webp_and_at_rest_the_exact_picture(self):
        self.skip_without_webp()
        with ThinLine(self.daemon.port, THIN) as line:
            view = View(line.port, self.daemon.token, codecs=["jpeg", "png", "webp", "a-codec-to-come"], method="path")
            # Whether of less quality, too, is a matter of how soon pictures follow each other (unit.coding).
            seen = view.drag(FRAMES, lambda tiles: all(h["codec"] == WEBP for h, _ in tiles))
            self.assertLessEqual(seen[-1], {(WEBP, 85), (WEBP, 50)}, seen)
            self.assertLessEqual(set().union(*seen), {(JPEG, 85), (WEBP, 85), (WEBP, 50)})
            view.move()
            shown, last = view.rest()
            self.assertEqual((last["codec"], last["quality"]), (WEBP, 100))
            self.compare(view, shown)
            stats = view.stats()
            self.assertEqual((stats[-1]["codec"], stats[-1]["quality"], stats[0]["codec"], stats[0]["line_bytes_s"]),
                             ("webp", 100, "jpeg", None))
            # Never more than the line brings, but for what lies in its buffers, and what a busy machine adds.
            self.assertLess(stats[-1]["line_bytes_s"], 4 * THIN)
            line.bytes_s = 100 * WIDE  # the line is wide again
            view.wide = True
            seen = view.drag(MANY, lambda tiles: all(h["codec"] == JPEG for h, _ in tiles))
            self.assertEqual(seen[-1], {(JPEG, 85)}, seen)

    def test_who_does_not_read_it_gets_jpeg_and_png_as_ever(self):
        with ThinLine(self.daemon.port, THIN) as line:
            view = View(line.port, self.daemon.token, codecs=["png", "a-codec-to-come"])
            self.assertEqual(set().union(*view.drag(8)), {(JPEG, 85)})
            view.move()
            shown, _ = view.rest()
            self.assertEqual({(h["codec"], h["flags"] & LOSSLESS) for h, _ in shown.values()}, {(PNG, LOSSLESS)})

    def test_the_exact_picture_waits_for_the_one_before(self):
        """A client that does not say that it has the newest frame, but the one before that, gets it two seconds later."""
        begin_s = time.monotonic()
        view = View(self.daemon.port, self.daemon.token, method="whitted")
        header = {"flags": 0}
        while not header["flags"] & CONVERGED:
            while not view.ws.binaries:
                view.ws.pump()
            header = tile_header(view.ws.binaries.pop(0))
            self.assertEqual(header["codec"], PNG if header["flags"] & CONVERGED else JPEG)
            if header["flags"] & LAST_TILE and header["frame_seq"] > 1:
                view.ws.notify("frame.ack", {"view_id": view.id, "frame_seq": header["frame_seq"] - 1})
        self.assertGreaterEqual(time.monotonic() - begin_s, 2)

    def test_who_does_not_read_it_any_more_gets_all_of_it_otherwise(self):
        """A tile that is exact already comes anew: it may be one that waits, or that the client could not read."""
        self.skip_without_webp()
        view = View(self.daemon.port, self.daemon.token, codecs=["webp"])
        places = set(view.rest()[0])
        view.ws.call("view.update", {"view_id": view.id, "codecs": ["png"]})
        shown, header = {}, {"flags": 0}
        while not header["flags"] & CONVERGED:
            for header, _ in view.frame():
                shown[header["x"], header["y"]] = header["codec"]
        self.assertEqual(shown, {place: PNG for place in places})

    def test_no_quality_above_90_has_webp_but_a_rougher_one(self):
        self.skip_without_webp()
        with ThinLine(self.daemon.port, THIN) as line:
            view = View(line.port, self.daemon.token, codecs=["webp"], quality=95)
            seen = view.drag(FRAMES, lambda tiles: all(h["quality"] == 50 for h, _ in tiles))
            self.assertEqual(seen[-1], {(WEBP, 50)}, seen)
            self.assertLessEqual(set().union(*seen), {(JPEG, 95), (WEBP, 50)})

    def test_nothing_exact_comes_while_a_hand_moves(self):
        """A line that brings nothing for longer than two seconds, and then one acknowledgement, while a hand moves."""
        view = View(self.daemon.port, self.daemon.token, method="whitted")
        frames = []
        while len(frames) < 2:
            view.move()
            frames.append(self.unheard(view))
        begin_s = time.monotonic()
        while time.monotonic() < begin_s + 2.2:
            view.move()
            time.sleep(0.02)  # as a mouse does
        view.ws.notify("frame.ack", {"view_id": view.id, "frame_seq": frames[0]["frame_seq"]})
        header = self.unheard(view)
        self.assertEqual((header["codec"], header["flags"] & CONVERGED), (JPEG, 0), header)

    def unheard(self, view):
        """The header that ends the next whole frame, which is not acknowledged."""
        while True:
            while not view.ws.binaries:
                view.ws.pump()
            header = tile_header(view.ws.binaries.pop(0))
            if header["flags"] & LAST_TILE:
                return header

    def test_a_wide_line_has_jpeg(self):
        view = View(self.daemon.port, self.daemon.token, codecs=["webp"])
        view.wide = True
        n_bytes = 0
        for _ in range(20):
            view.move()
            tiles = [(h, payload) for h, payload in view.frame() if not h["flags"] & CONVERGED]
            if {h["codec"] for h, _ in tiles} <= {JPEG}:
                n_bytes = max(n_bytes, sum(len(payload) for _, payload in tiles))
            else:
                slowest = min(p["line_bytes_s"] for p in view.stats() if p["line_bytes_s"])
                self.assertLess(slowest, n_bytes / AT_ONCE_S)

    def test_what_is_named_stays(self):
        """Codecs other than jpeg are as the client named them, whatever it reads and whatever the line."""
        for codec, kinds in (("png", {(PNG, 100)}), ("webp", {(WEBP, 85)})):
            if codec == "webp" and not self.webp:
                continue
            with ThinLine(self.daemon.port, WIDE) as line:
                view = View(line.port, self.daemon.token, codec=codec, codecs=["jpeg", "png", "webp"])
                self.assertEqual(set().union(*view.drag(6)), kinds)

    def test_false_colours_are_no_rougher_than_asked_for(self):
        self.skip_without_webp()
        with ThinLine(self.daemon.port, THIN) as line:
            view = View(line.port, self.daemon.token, codecs=["webp"], overlay="luminance", method="path")
            seen = view.drag(12)
            self.assertIn((WEBP, 85), set().union(*seen))
            self.assertLessEqual(set().union(*seen), {(JPEG, 85), (WEBP, 85)})
            view.move()
            self.compare_readings(view)

    def compare_readings(self, view):
        """A value read off a picture that came lossily is that of the film."""
        view.rest()
        wide = self.beside(view, overlay="luminance")
        wide.rest()
        for x, y in ((10, 10), (200, 150), (390, 290)):
            here, there = (v.ws.call("view.read", {"view_id": v.id, "x": x, "y": y}) for v in (view, wide))
            self.assertEqual((here["value"], here["unit"]), (there["value"], there["unit"]))


if __name__ == "__main__":
    unittest.main()
