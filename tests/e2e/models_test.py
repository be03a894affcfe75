"""Real architectural models, streamed: from a daemon started with them, and imported into a running scene."""
import os
import unittest

from daemon import Daemon
from wsclient import CONVERGED, LAST_TILE, tile_header

HERE = os.path.dirname(os.path.abspath(__file__))
INTERIORS = os.path.normpath(os.path.join(HERE, "../../../shared/scenes/interiors"))
W, H = 96, 64
RGBA8 = 0

# file: triangles, as the pack's own index counts them
MODELS = {"sibenik.glb": 75275, "dabrovic_sponza.glb": 66402, "office.glb": 22428}


def converged_picture(ws, **view):
    """RGB tuples of the first converged frame of a new view."""
    view_id = ws.call("view.open", {"size": [W, H], "codec": "rgba8", "spp": 4, **view})["view_id"]
    pixels = [None] * (W * H)
    while True:
        while not ws.binaries:
            ws.pump()
        message = ws.binaries.pop(0)
        header = tile_header(message)
        if header["codec"] == RGBA8 and header["downscale"] == 0:
            for y in range(header["h"]):
                for x in range(header["w"]):
                    at = 64 + 4 * (y * header["w"] + x)
                    pixels[(header["y"] + y) * W + header["x"] + x] = tuple(message[at:at + 3])
        if header["flags"] & LAST_TILE:
            ws.notify("frame.ack", {"view_id": header["view_id"], "frame_seq": header["frame_seq"]})
        if header["flags"] & LAST_TILE and header["flags"] & CONVERGED:
            ws.call("view.close", {"view_id": view_id})
            ws.binaries.clear()
            return pixels


def triangles(ws):
    return ws.call("stats.get")["scene"]["triangles"]


@unittest.skipUnless(os.path.isdir(INTERIORS), "no ../shared/scenes")
class Models(unittest.TestCase):
    def assert_shows_something(self, pixels):
        self.assertNotIn(None, pixels)
        mean = sum(map(sum, pixels)) / (3 * W * H)
        self.assertTrue(5 < mean < 250, f"mean code value {mean}")
        self.assertGreater(len(set(pixels)), 200, "a picture of a room has many colours")

    def test_started_with_a_model(self):
        for name, count in MODELS.items():
            with self.subTest(name), Daemon("--scene", os.path.join(INTERIORS, name)) as daemon:
                ws = daemon.connect()
                self.assertEqual(triangles(ws), count)
                self.assert_shows_something(converged_picture(ws))

    def test_imported_into_a_running_scene(self):
        with Daemon("--assets", INTERIORS) as daemon:
            ws = daemon.connect()
            before = triangles(ws)
            self.assert_shows_something(converged_picture(ws, camera_id="main"))
            for name, count in MODELS.items():
                room = name.split(".")[0].replace("_", "-")
                ws.call("scene.apply", {"ops": [{"op": "import", "id": room, "asset": name,
                                                 "transform": {"translate": [0, 100, 0]}}]})
                self.assertEqual(triangles(ws), before + count)
                camera = next(op["id"] for op in ws.call("scene.get", {"expand": True})["ops"]
                              if op["op"] == "add" and op["type"] == "camera" and op["id"].startswith(room + "/"))
                self.assert_shows_something(converged_picture(ws, camera_id=camera, exposure_ev=None))
                ws.call("scene.undo")
                self.assertEqual(triangles(ws), before)


if __name__ == "__main__":
    if not os.path.isdir(INTERIORS):
        print("skipped: no ../shared/scenes")
    unittest.main()
