"""Looks of the room's light: stored and recalled as edits; a crossfade is how the picture gets there, without a ray."""
import json
import os
import re
import tempfile
import time
import unittest

from daemon import Daemon
from wsclient import RpcError

N_GROUPS = 20
ALL = {f"lamp-{k}" for k in range(N_GROUPS)}


def room():
    """A room with twenty lamps, each a mixing group, and a panel that shines by its material."""
    ops = [{"op": "add", "type": "mesh", "id": "box", "shape": "box", "size": [8, 3, 8]},
           {"op": "add", "type": "mesh", "id": "plate", "shape": "quad", "size": [1, 0, 1]},
           {"op": "add", "type": "material", "id": "white", "base_color": [0.7, 0.7, 0.7], "specular": 0},
           {"op": "add", "type": "material", "id": "glow", "base_color": [0, 0, 0], "specular": 0, "emission_cd_m2": 200},
           {"op": "add", "type": "object", "id": "walls", "mesh": "box", "material": "white", "transform": {"translate": [0, 1.5, 0]}},
           {"op": "add", "type": "object", "id": "panel", "mesh": "plate", "material": "glow", "transform": {"translate": [0, 1, 0]}},
           {"op": "add", "type": "camera", "id": "main", "position": [3, 1.5, 3], "target": [0, 1, 0]}]
    for k in range(N_GROUPS):
        ops.append({"op": "add", "type": "light", "id": f"lamp-{k}", "kind": "point", "group": f"g{k}",
                    "position": [k % 5 * 1.4 - 2.8, 2.6, k // 5 * 1.8 - 2.7], "flux_lm": 300 + 10 * k, "cct_k": 3000})
    return ops


class Presets(unittest.TestCase):
    @classmethod
    def setUpClass(cls):

        path = os.path.join(cls.enterClassContext(tempfile.TemporaryDirectory()), "room.jsonl")
        with open(path, "w", encoding="utf-8") as file:
            file.write("\n".join(json.dumps(line) for line in [{"lumend": 1, "kind": "scene"}, *room()]))
        cls.scene = path

    def setUp(self):
        self.daemon = self.enterContext(Daemon("--scene", self.scene))
        self.ws = self.daemon.connect()

    def tearDown(self):
        self.ws.close()
        self.daemon.assert_well()

    def lamps(self):
        ops = self.ws.call("scene.get", {"expand": True})["ops"]
        return {op["id"]: {key: op.get(key) for key in ("on", "flux_lm", "luminance_cd_m2", "color", "cct_k")}
                for op in ops if op.get("type") == "light" or op["id"] == "panel"}

    def dim(self, ops):
        self.ws.call("scene.apply", {"ops": [{"op": "set", "id": id, "path": "", "value": value} for id, value in ops.items()]})

    def fails(self, app, method, params):
        with self.assertRaises(RpcError) as caught:
            self.ws.call(method, params)
        self.assertEqual(caught.exception.app, app)
        return caught.exception

    def told(self):
        return [params for method, params in self.ws.notifications if method == "preset.fading"]

    def test_a_recall_brings_all_of_a_look_back(self):
        day = self.lamps()
        self.ws.call("preset.store", {"id": "day", "name": "Day"})
        self.dim({"lamp-0": {"on": False}, "lamp-1": {"flux_lm": 5, "color": [1, 0, 0]}, "lamp-2": {"intensity_cd": 9},
                  "panel": {"flux_lm": 40, "cct_k": 2700}})
        evening = self.lamps()
        self.ws.call("preset.store", {"id": "evening"})
        self.ws.call("preset.recall", {"id": "day"})
        self.assertEqual(self.lamps(), day)
        self.ws.call("preset.recall", {"id": "evening"})
        self.assertEqual(self.lamps(), evening)
        self.ws.call("scene.undo")
        self.assertEqual(self.lamps(), day)
        self.ws.call("scene.redo")
        self.assertEqual(self.lamps(), evening)

    def test_store_keeps_a_record_as_all_others(self):
        self.ws.call("preset.store", {"id": "day", "name": "Day", "fade_s": 2})
        self.ws.call("preset.store", {"id": "night", "name": "Night"})
        presets = {op["id"]: op for op in self.ws.call("scene.get", {})["ops"] if op.get("type") == "preset"}
        self.assertEqual(presets["day"]["fade_s"], 2)
        self.assertLess(presets["day"]["order"], presets["night"]["order"])
        self.assertEqual({lamp["id"] for lamp in presets["day"]["lamps"]}, ALL | {"panel"})
        self.assertIn({"id": "lamp-3", "on": True, "flux_lm": 330, "cct_k": 3000}, presets["day"]["lamps"])
        self.dim({"lamp-3": {"flux_lm": 1}})
        self.ws.call("preset.store", {"id": "day"})  # anew, under its name
        day = next(op for op in self.ws.call("scene.get", {})["ops"] if op["id"] == "day")
        self.assertEqual((day["name"], day["fade_s"]), ("Day", 2))
        self.assertIn({"id": "lamp-3", "on": True, "flux_lm": 1, "cct_k": 3000}, day["lamps"])
        self.ws.call("scene.apply", {"ops": [{"op": "set", "id": "day", "path": "/name", "value": "Morning"}, {"op": "remove", "id": "night"}]})
        self.fails("not_found", "preset.recall", {"id": "night"})
        self.fails("conflict", "preset.store", {"id": "walls"})

    def test_only_named_lamps_change_and_lost_ones_are_told(self):
        self.ws.call("preset.store", {"id": "day"})
        lamps = [{"id": "lamp-1", "flux_lm": 7}, {"id": "lamp-2", "illuminance_lx": 7}, {"id": "gone", "flux_lm": 7}]
        self.ws.call("scene.apply", {"ops": [{"op": "set", "id": "day", "path": "/lamps", "value": lamps}]})
        was = self.lamps()
        answer = self.ws.call("preset.recall", {"id": "day"})
        self.assertEqual([re.match('"(.*?)"', text)[1] for text in answer["warnings"]], ["lamp-2", "gone"])
        now = self.lamps()
        self.assertEqual(now.pop("lamp-1")["flux_lm"], 7)
        was.pop("lamp-1")
        self.assertEqual(now, was)
        self.ws.call("scene.apply", {"ops": [{"op": "set", "id": "day", "path": "/lamps", "value": lamps[2:]}]})
        self.fails("not_found", "preset.recall", {"id": "day"})

    def prepare_two_looks(self):
        """All lamps have shone; the room has been at rest."""
        self.ws.call("preset.store", {"id": "day"})
        self.dim({id: {"flux_lm": 20, "cct_k": 2200} for id in ALL} | {"panel": {"luminance_cd_m2": 20}, "lamp-7": {"on": False}})
        self.ws.call("preset.store", {"id": "evening"})
        return self.lamps()

    def frames_until(self, view, done):
        """frame.stats of frames, acknowledged as they come, until one is such, or (done() of None) something else is so."""
        seen, n_read = [], 0
        while not done(seen[-1] if seen else None):
            self.ws.pump()
            for method, params in self.ws.notifications[n_read:]:
                if method == "frame.stats":
                    seen.append(params)
                    self.ws.notify("frame.ack", {"view_id": view, "frame_seq": params["frame_seq"]})
            n_read = len(self.ws.notifications)
        return seen

    def rest(self, view, rev):
        self.ws.notifications.clear()
        self.frames_until(view, lambda frame: frame and frame["converged"] and frame["scene_rev"] >= rev)
        self.ws.notifications.clear()

    def open_view(self, **more):
        return self.ws.call("view.open", {"camera_id": "main", "size": [300, 200], "method": "live", "spp": 1, "codec": "jpeg", **more})["view_id"]

    def arrived(self, _):
        return self.told() and self.told()[-1]["left_s"] == 0

    def test_a_crossfade_of_twenty_groups_traces_no_ray(self):
        evening = self.prepare_two_looks()
        view = self.open_view()
        self.rest(view, 0)
        begun = time.monotonic()
        self.rest(view, self.ws.call("preset.recall", {"id": "day"})["scene_rev"])  # all lamps have shone
        fade_s = max(2.0, round(2 * (time.monotonic() - begun), 1))  # of some frames, however slow the machine
        begun = time.monotonic()
        rev = self.ws.call("preset.recall", {"id": "evening", "fade_s": fade_s})["scene_rev"]
        self.assertEqual(self.lamps(), evening, "the scene has its end at once")
        frames = [f for f in self.frames_until(view, self.arrived) if f["scene_rev"] >= rev]
        took = time.monotonic() - begun
        rays = {kind: sum(f["rays"][kind] for f in frames) for kind in frames[0]["rays"]}
        print(f"crossfade of {N_GROUPS} groups: {len(frames)} frames in {took:.2f} s, {len(frames) / took:.0f} a second, "
              f"rays: {sum(rays.values()) - rays['probe']}, and {rays['probe']} of probes that tell the error")
        self.assertGreater(len(frames), 2)
        self.assertEqual(sum(rays.values()) - rays["probe"], 0, rays)
        summed = [f for f in frames if f["stage_ms"]["filter"] == 0 and f["stage_ms"]["records"] == 0]
        self.assertTrue(summed, "pictures on the way are sums of those of both ends")
        self.assertEqual([(t["id"], t["left_s"]) for t in self.told()], [("evening", fade_s), ("evening", 0)])
        self.assertEqual(self.lamps(), evening)

    def lux(self):
        return self.ws.call("probe", {"point": [0, 0.01, 0.9], "normal": [0, 1, 0], "samples": 1024})["illuminance_lx"]

    def assert_shines(self, wanted):
        self.assertAlmostEqual(self.lux() / wanted, 1, delta=0.05)

    def test_what_is_on_its_way_goes_on_from_there(self):
        """An hour is so long that lamps are where they were for all of this test."""
        day_lux, day = self.lux(), self.lamps()
        evening = self.prepare_two_looks()
        evening_lux = self.lux()
        self.assertLess(evening_lux, day_lux / 3)
        self.ws.call("preset.recall", {"id": "day", "fade_s": 3600})
        self.assertEqual(self.lamps(), day)
        self.assert_shines(evening_lux)
        self.ws.call("preset.recall", {"id": "evening", "fade_s": 3600})  # back before it began
        self.assert_shines(evening_lux)
        self.ws.call("preset.recall", {"id": "day", "fade_s": 3600})
        self.assert_shines(evening_lux)
        self.ws.call("preset.recall", {"id": "day", "fade_s": 0})  # no change of the scene, and there at once
        self.assert_shines(day_lux)
        self.ws.call("preset.recall", {"id": "evening", "fade_s": 3600})
        self.assert_shines(day_lux)
        self.ws.call("scene.undo")  # all of it
        self.assertEqual(self.lamps(), day)
        self.assert_shines(day_lux)
        self.ws.call("scene.redo")
        self.assertEqual(self.lamps(), evening)
        self.assert_shines(evening_lux)

    def test_lamps_are_edited_and_removed_on_their_way(self):
        self.prepare_two_looks()
        self.ws.call("preset.recall", {"id": "day", "fade_s": 3600})
        dark = self.lux()
        self.ws.call("scene.apply", {"ops": [{"op": "remove", "id": f"lamp-{k}"} for k in range(5)]})
        self.assertLess(self.lux(), dark)
        self.dim({"lamp-12": {"flux_lm": 5000}})  # over the probe, and there at once
        self.assertGreater(self.lux(), 2 * dark)
        self.assertEqual(self.told()[-1]["left_s"], 3600, "the others go on")
        self.ws.call("scene.apply", {"ops": [{"op": "set", "id": id, "path": "/on", "value": False} for id in sorted((ALL | {"panel"}) - {f"lamp-{k}" for k in range(5)})]})
        self.assertEqual(self.ws.wait_notification("preset.fading")["left_s"], 3600)
        self.assertEqual(self.ws.wait_notification("preset.fading")["left_s"], 0, "none is left")

    def test_stop_keeps_lamps_as_they_shine(self):
        evening = self.prepare_two_looks()
        evening_lux = self.lux()
        self.fails("not_found", "preset.stop", {})
        self.ws.call("preset.recall", {"id": "day", "fade_s": 3600})
        self.ws.call("preset.stop")
        self.assertEqual([self.ws.wait_notification("preset.fading")["left_s"] for _ in range(2)], [3600, 0])
        self.assert_shines(evening_lux)
        now = self.lamps()
        for id in ALL:
            if not evening[id]["on"]:  # some seconds of an hour may have passed
                self.assertLess(now[id]["flux_lm"] if now[id]["on"] else 0, 15)
            else:
                self.assertTrue(now[id]["on"])
                self.assertAlmostEqual(now[id]["flux_lm"] / 20, 1, delta=0.05)
        self.ws.call("scene.undo")  # the stop
        self.ws.call("scene.undo")  # the recall
        self.assertEqual(self.lamps(), evening)


if __name__ == "__main__":
    unittest.main()
