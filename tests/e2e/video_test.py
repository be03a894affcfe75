"""Video over lines that are too thin for tiles: chunks that follow each other and whose headers say which stand alone; more pictures
of the same bytes than WebP gives; at rest the exact picture by tiles; and none for whom it is not.

As in thin_line_test nothing is asserted of how long anything took. Pictures are counted by what the line brought, not by seconds:
on a busy machine both clients wait for the renderer."""
import math
import os
import subprocess
import unittest

from daemon import Daemon
from thin_line import ThinLine
from thin_line_test import FRAMES, View
from wsclient import CONVERGED, LAST_TILE, LOSSLESS

TILE, JPEG, PNG, WEBP, VP9 = 1, 1, 2, 3, 5
KEY = 8
THIN = 12_000  # bytes a second: WebP of 50 of this picture takes longer than a tenth of a second
SIZE, SMALL = [400, 300], [240, 180]
LINE, LARGE = 25_000, [760, 520]  # a picture of a video has the line for 0.2 s at most, also where this machine is slow
BROUGHT = 200_000  # bytes


def is_video(tiles):
    return [h["codec"] for h, _ in tiles] == [VP9]


class Turning(View):
    """It stands in the office, and turns to and fro."""

    def camera(self):
        if self.seq == 0:
            self.eye = next(op for op in self.ws.call("scene.get", {})["ops"] if op["type"] == "camera")
        self.seq += 1
        (x, y, z), (tx, ty, tz) = self.eye["position"], self.eye["target"]
        angle = math.radians(0.7 * (30 - abs(self.seq % 60 - 30)))
        c, s = math.cos(angle), math.sin(angle)
        target = [x + c * (tx - x) - s * (tz - z), ty, z + s * (tx - x) + c * (tz - z)]
        return {"camera": {"position": [x, y, z], "target": target, "vfov_deg": 45}, "camera_seq": self.seq}


class Video(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        version = subprocess.run([os.environ["LUMEND"], "--version"], capture_output=True, text=True, check=True).stdout
        if "with VP9\n" not in version:
            raise unittest.SkipTest("skipped: this build has no VP9")
        cls.webp = "with WebP\n" in version
        cls.daemon = Daemon("--scene", "cornell", "--deterministic").__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.assert_well()
        cls.daemon.__exit__(None, None, None)

    def view(self, line, codecs, **members):
        return View(line.port, self.daemon.token, codecs=codecs, **members)

    def until_video(self, view):
        """Frames up to the first that is video; those of tiles before it may have been on their way."""
        for _ in range(FRAMES):
            view.move()
            tiles = view.frame()
            if is_video(tiles):
                return tiles[0]
        self.fail(f"no video in {FRAMES} frames; the line: {[p['line_bytes_s'] for p in view.stats()]}")

    def next_video(self, view):
        view.move()
        tiles = view.frame()
        self.assertTrue(is_video(tiles), [h for h, _ in tiles])
        return tiles[0]

    def check_header(self, header, size):
        self.assertEqual([header[k] for k in ("kind", "x", "y", "w", "h", "full_w", "full_h", "downscale")], [TILE, 0, 0, *size, *size, 0])
        self.assertEqual(header["flags"] & (LAST_TILE | LOSSLESS | CONVERGED), LAST_TILE)
        self.assertLessEqual(header["quality"], 100)

    def test_a_video_begins_with_a_key_and_at_rest_all_of_the_picture_is_exact(self):
        for codecs in (["webp", "vp9"], ["vp9"]):
            with ThinLine(self.daemon.port, THIN) as line:
                view = self.view(line, codecs)
                header, _ = self.until_video(view)
                self.check_header(header, SIZE)
                self.assertTrue(header["flags"] & KEY)
                for _ in range(3):
                    header, _ = self.next_video(view)
                    self.check_header(header, SIZE)
                    self.assertFalse(header["flags"] & KEY)
                self.assertEqual(view.stats()[-1]["codec"], "vp9")
                line.bytes_s = 100 * LINE
                view.move()
                shown, last = view.rest()
                exact = [h for h, _ in shown.values() if h["codec"] != VP9 and h["flags"] & LOSSLESS and h["frame_seq"] == last["frame_seq"]]
                self.assertEqual(sum(h["w"] * h["h"] for h in exact), SIZE[0] * SIZE[1])
                self.assertEqual(last["codec"], WEBP if "webp" in codecs and self.webp else PNG)

    def test_what_was_lost_or_has_another_size_begins_with_a_key(self):
        with ThinLine(self.daemon.port, THIN) as line:
            view = self.view(line, ["webp", "vp9"])
            self.until_video(view)
            self.assertFalse(self.next_video(view)[0]["flags"] & KEY)
            view.ws.call("view.update", {"view_id": view.id, "resend": True})
            keys = []
            while not any(keys) and len(keys) < FRAMES:  # one that was made before may come first
                keys.append(self.next_video(view)[0]["flags"] & KEY)
            self.assertTrue(keys[-1], keys)
            self.assertFalse(self.next_video(view)[0]["flags"] & KEY)
            view.ws.call("view.update", {"view_id": view.id, "size": SMALL})
            for _ in range(FRAMES):
                view.move()
                tiles = view.frame()
                if tiles[-1][0]["full_w"] == SMALL[0]:
                    break
            if is_video(tiles):  # tiles of a picture this small may do
                self.check_header(tiles[0][0], SMALL)
                self.assertTrue(tiles[0][0]["flags"] & KEY)

    def test_who_does_not_read_it_any_more_gets_tiles(self):
        with ThinLine(self.daemon.port, THIN) as line:
            view = self.view(line, ["webp", "vp9"])
            self.until_video(view)
            view.ws.call("view.update", {"view_id": view.id, "codecs": ["webp"]})
            seen = []
            while len(seen) < FRAMES and not (seen and VP9 not in seen[-1]):
                view.move()
                seen.append({h["codec"] for h, _ in view.frame()})
            self.assertNotIn(VP9, seen[-1])
            self.assertLessEqual(len(seen), 3, seen)  # one in the stream, and one more on the line
            self.assertNotIn(VP9, {codec for frame in view.drag(5) for codec, _ in frame})

    def test_values_and_wide_lines_and_others_have_none(self):
        # PNG is the largest: of a whole picture each would have this line for seconds.
        wanted = [({"codecs": ["webp", "vp9"], "overlay": "luminance"}, THIN), ({"codecs": ["webp"]}, THIN), ({}, THIN),
                  ({"codecs": ["webp", "vp9"], "codec": "png", "size": SMALL}, THIN), ({"codecs": ["webp", "vp9"], "downscale": 1}, THIN)]
        for members, rate in wanted:
            with ThinLine(self.daemon.port, rate) as line:
                view = View(line.port, self.daemon.token, **members)
                self.assertNotIn(VP9, {codec for frame in view.drag(8) for codec, _ in frame}, members)

    def test_a_colour_map_ends_it(self):
        with ThinLine(self.daemon.port, THIN) as line:
            view = self.view(line, ["webp", "vp9"], method="path")
            self.until_video(view)
            view.ws.call("view.update", {"view_id": view.id, "overlay": "luminance"})
            map_seq = None
            while map_seq is None:
                view.move()
                view.frame()
                map_seq = next((p["frame_seq"] for p in view.stats() if p["overlay_map"]), None)
            for _ in range(4):
                view.move()
                for header, _ in view.frame():
                    self.assertFalse(header["codec"] == VP9 and header["frame_seq"] >= map_seq, header)

    def pictures_of_the_same_bytes(self, daemon, codecs):
        """How many come with so many bytes, once it is known what the line is."""
        with ThinLine(daemon.port, LINE) as line:
            view = Turning(line.port, daemon.token, codecs=codecs, size=LARGE)
            view.drag(15)
            brought = n = 0
            while brought < BROUGHT:
                view.move()
                brought += sum(64 + len(payload) for _, payload in view.frame())
                n += 1
            return n

    def test_the_same_bytes_bring_more_pictures_than_as_webp(self):
        if not self.webp:
            self.skipTest("skipped: this build has no WebP")
        with Daemon("--scene", "office") as daemon:
            video, tiles = (self.pictures_of_the_same_bytes(daemon, c) for c in (["webp", "vp9"], ["webp"]))
        self.assertGreater(video, 2 * tiles)


if __name__ == "__main__":
    unittest.main()
