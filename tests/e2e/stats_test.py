"""frame.stats and --stats: PROTOCOL.md explains every member that is sent, and none that is not."""
import json
import os
import re
import subprocess
import tempfile
import unittest

from daemon import LUMEND, Daemon
from wsclient import tile_header

PAGE = os.path.join(os.path.dirname(__file__), "..", "..", "protocol", "PROTOCOL.md")
# So that `caustics` has lights: a lamp without extent, and a mirror that it shines on.
MIRROR = [
    {"op": "add", "type": "light", "id": "bulb", "kind": "point", "position": [0, 3, 1], "flux_lm": 800},
    {"op": "add", "type": "material", "id": "mirror", "metallic": 1, "roughness": 0},
    {"op": "add", "type": "mesh", "id": "ball", "shape": "sphere", "size": [1, 1, 1]},
    {"op": "add", "type": "object", "id": "mirror-ball", "mesh": "ball", "material": "mirror",
     "transform": {"translate": [0, 1.5, 1]}},
]

FLOOR = [
    {"op": "add", "type": "mesh", "id": "plane", "shape": "quad", "size": [8, 0, 8]},
    {"op": "add", "type": "material", "id": "white", "base_color": [0.8, 0.8, 0.8]},
    {"op": "add", "type": "object", "id": "floor", "mesh": "plane", "material": "white"},
]


def rows(table):
    """First cells of the page's tables <!-- members:table -->."""
    with open(PAGE, encoding="utf-8") as page:
        parts = re.findall(rf"<!-- members:{table} -->\n(.*?)<!-- end -->", page.read(), re.S)
    found = [name for part in parts for name in re.findall(r"^\| `([^`]+)` \|", part, re.M)]
    assert found and len(found) == len(set(found)), "no rows, or two of one name"
    return set(found)


def members(value, path=""):
    """Paths of all members of a JSON value: a.b, and a[].b for members of an array's elements."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield f"{path}.{name}".lstrip(".")
            yield from members(inner, f"{path}.{name}".lstrip("."))
    elif isinstance(value, list):
        for inner in value:
            yield from members(inner, f"{path}[]")


def explains(row, member):
    """A star stands for one name."""
    return re.fullmatch(re.escape(row).replace(r"\*", r"[^.\[\]]+"), member) is not None


class StatsOnThePage(unittest.TestCase):
    def check(self, sent, page):
        sent = set(sent)
        for member in sent:
            self.assertTrue(any(explains(row, member) for row in page), f"PROTOCOL.md does not explain {member}")
        for row in page:
            self.assertTrue(any(explains(row, member) for member in sent), f"PROTOCOL.md explains {row}, which is not sent")

    def test_frame_stats(self):
        with Daemon() as daemon:
            ws = daemon.connect()
            ws.call("scene.apply", {"ops": MIRROR})
            view = ws.call("view.open", {"size": [64, 48], "method": "path", "spp": 4, "overlay": "luminance"})["view_id"]
            sent, final = [], False
            while not final:
                stats = ws.wait_notification("frame.stats")
                ws.notify("frame.ack", {"view_id": view, "frame_seq": stats["frame_seq"]})
                sent += members(stats)
                final = stats["converged"]
                self.assertEqual(stats["stopped_by"], "spp" if stats["spp"] == 4 else None)
            self.assertLess(stats["error"]["rel"], stats["error"]["bound"])
            self.assertEqual(stats["frame"], stats["frame_seq"] - 1)
            self.assertEqual([light["id"] for light in stats["caustics"]["lights"]], ["bulb"])
            self.check(sent, rows("frame") | rows("view"))

    def frames_of(self, ws, view):
        """frame.stats until the picture rests."""
        while True:
            stats = ws.wait_notification("frame.stats")
            ws.notify("frame.ack", {"view_id": view, "frame_seq": stats["frame_seq"]})
            yield stats
            if stats["converged"]:
                return

    def test_a_budget_is_predicted_and_judged(self):
        with Daemon() as daemon:
            ws = daemon.connect()
            ws.call("scene.apply", {"ops": MIRROR})
            view = ws.call("view.open", {"size": [64, 48], "method": "path", "budget": {"error": 0.05}})["view_id"]
            frames = list(self.frames_of(ws, view))
            first = next(f["predicted"] for f in frames if f["predicted"])
            self.assertTrue(first["ms_most"] is None or first["ms_least"] <= first["ms"] <= first["ms_most"], first)
            self.assertLessEqual(first["error_least"], first["error"])
            spent = [f["spent_ms"] for f in frames]
            self.assertEqual(spent, sorted(spent))
            self.assertEqual((frames[0]["predicted"], frames[0]["budget_verdict"]), (None, "open"))
            final = frames[-1]
            self.assertEqual((final["stopped_by"], final["budget_verdict"]), ("error", "met"))
            self.assertLessEqual(final["error"]["bound"], 0.05)
            self.assertIn(final["predicted"]["stopped_by"], ("error", "spp"))
            # Without light by way of other surfaces it is off by more, which the first measurement tells.
            ws.call("view.update", {"view_id": view, "method": "whitted", "budget": {"error": 0.0001}})
            final = [f for f in self.frames_of(ws, view) if f["method"] == "whitted"][-1]
            self.assertEqual((final["stopped_by"], final["budget_verdict"], final["predicted"]), ("whole", "missed", None))

    def test_a_budget_of_time_chooses_more_than_resolution(self):
        """What is chosen is expected to be in time, by what passes took before, or is the least that there is. So it
        hangs on what passes said of themselves, not on the machine."""
        with Daemon() as daemon:
            ws = daemon.connect()
            view = ws.call("view.open", {"size": [300, 200], "method": "live", "spp": 1})["view_id"]
            whole = list(self.frames_of(ws, view))[-1]
            self.assertEqual(whole["budget_chose"], {"blocks": 8, "eased": None, "ms": None})  # nothing was known
            for step, limit in enumerate([60000, 30, 10, 1, 1, 1]):
                camera = {"position": [0.01 * step, 2.5, 7.5], "target": [0, 2.5, 0]}
                ws.call("view.update", {"view_id": view, "camera": camera, "budget": {"time_ms": limit}})
                chose = list(self.frames_of(ws, view))[-1]["budget_chose"]
                least = (chose["blocks"], chose["eased"]) == (32, "shadow_rays")
                self.assertTrue(chose["ms"] <= limit or least, (limit, chose))
                self.assertTrue(limit < 60000 or chose["blocks"] == 1, chose)
            self.assertTrue(least, chose)  # of 60,000 pixels none is there within 1 ms

    def test_rough_pictures_are_sent_as_sharp_as_they_are(self):
        """Those of samples have no more detail than their blocks; all others have that of every surface that they saw.
        Their first, of which nothing is known, is of blocks of 8."""
        with Daemon() as daemon:
            ws = daemon.connect()
            for method, downscale in [("path", 3), ("live", 0), ("tic", 0), ("igi", 0)]:
                ws.call("view.open", {"size": [96, 64], "method": method, "spp": 1, "budget": {"time_ms": 30}})
                while not ws.binaries:
                    ws.pump()
                header = tile_header(ws.binaries.pop(0))
                self.assertEqual((header["spp"], header["downscale"]), (0, downscale), method)
                ws.call("view.close", {"view_id": header["view_id"]})
                ws.binaries.clear()

    def test_render_stats(self):
        with tempfile.TemporaryDirectory() as folder:
            scene, stats = os.path.join(folder, "scene.jsonl"), os.path.join(folder, "stats.json")
            camera = {"op": "add", "type": "camera", "id": "main", "position": [0, 2, 7], "target": [0, 1, 0]}
            with open(scene, "w", encoding="utf-8") as file:
                file.writelines(json.dumps(line) + "\n" for line in [{"lumend": 1, "kind": "scene"}, *FLOOR, *MIRROR, camera])
            subprocess.run([LUMEND, "render", "--scene", scene, "--size", "64x48", "--method", "path", "--spp", "4",
                            "--threads", "1", "--out", os.path.join(folder, "picture.png"), "--stats", stats],
                           check=True, capture_output=True)
            with open(stats, encoding="utf-8") as file:
                frames = json.load(file)["frames"]
            self.check((member for frame in frames for member in members(frame)), rows("frame"))


if __name__ == "__main__":
    unittest.main()
