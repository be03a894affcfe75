"""Lamps that a view shows alone: that view's matter. The scene, the other views and the shared cache are as they were."""
import unittest

from daemon import Daemon
from wsclient import CONVERGED, LAST_TILE, RpcError, tile_header

LAMPS = [{"op": "add", "type": "light", "id": id, "kind": "point", "position": [x, 1.5, 0.5], "flux_lm": 900, "group": group}
         for id, x, group in (("left", -0.5, "pair"), ("right", 0.5, "pair"), ("extra", 0.0, "other"))]


class View:
    def __init__(self, daemon, **options):
        self.ws = daemon.connect()
        self.id = self.ws.call("view.open", {"camera_id": "main", "size": [64, 48], "codec": "rgba8", "spp": 2,
                                             "exposure_ev": 8, **options})["view_id"]

    def update(self, **params):
        self.ws.call("view.update", {"view_id": self.id, **params})

    def edit(self, *ops):
        return self.ws.call("scene.apply", {"ops": list(ops)})["scene_rev"]

    def at_rest(self, seq):
        """The statistics of all frames from the first that shows change `seq` to the last, and its pixels: nothing comes after."""
        frames = []
        while True:
            stats = self.ws.wait_notification("frame.stats")
            self.ws.notify("frame.ack", {"view_id": self.id, "frame_seq": stats["frame_seq"]})
            if stats["camera_seq"] < seq:
                continue
            frames.append(stats)
            if stats["converged"]:
                return frames


    def brightness(self, seq):
        """Sum over the pixels of change `seq`, which has come to rest."""
        tiles = []
        while not any(h["flags"] & CONVERGED and h["flags"] & LAST_TILE for h, _ in tiles):
            if tiles or not self.ws.binaries:
                self.ws.pump()
            tiles = [(h, b[64:]) for b in self.ws.binaries for h in [tile_header(b)] if h["camera_seq"] <= seq]
        picture = {(h["x"], h["y"]): sum(b) for h, b in tiles}  # the newest of each tile
        return sum(picture.values())


def rays(frames):
    return sum(n for f in frames for kind, n in f["rays"].items() if kind != "probe")


class Solo(unittest.TestCase):
    def test_is_of_one_view_and_traces_no_ray(self):
        with Daemon("--deterministic") as daemon:
            first, second = (View(daemon, method="whitted", stats=True) for _ in range(2))
            rev = first.edit(*LAMPS)
            first.update(camera_seq=1)
            first.at_rest(1)
            second.update(camera_seq=1)
            second.at_rest(1)
            seq = 1
            luminance = []
            for solo in (["left"], ["pair"], ["pair", "extra"], [], ["nobody"], ["left", "nobody"], None):
                seq += 1
                first.update(camera_seq=seq, solo=solo)
                frames = first.at_rest(seq)
                self.assertEqual(rays(frames), 0, f"solo {solo}: {frames[0]['rays']}")
                self.assertEqual(frames[-1]["scene_rev"], rev)
                luminance.append(first.brightness(seq))
            left, pair, lamps, everything, nobody, left_again, end = luminance
            self.assertTrue(left < pair < lamps < everything, luminance)
            self.assertEqual([nobody, left_again, end], [everything, left, everything])
            self.assertEqual(second.ws.call("scene.get", {"expand": False})["scene_rev"], rev, "no edit was made")
            second.ws.call("stats.get")
            told = [name for name, _ in second.ws.notifications]
            self.assertNotIn("frame.stats", told, "the other view got no frame")
            self.assertEqual(told.count("scene.changed"), 1, "and no news but of the lamps")

    def test_in_the_default_method_known_light_is_only_summed_anew(self):
        with Daemon("--deterministic") as daemon:
            view = View(daemon, method="live", spp=1)
            view.edit(*LAMPS)
            view.update(camera_seq=1)
            view.at_rest(1)
            for seq, solo in ((2, ["left"]), (3, []), (4, ["right"])):
                view.update(camera_seq=seq, solo=solo)
                frames = view.at_rest(seq)
                self.assertEqual(rays(frames), 0, f"solo {solo}: {[f['rays'] for f in frames]}")

    def test_shines_although_switched_off_and_follows_edits(self):
        with Daemon("--deterministic") as daemon:
            view = View(daemon, method="whitted")
            view.edit(*LAMPS, {"op": "set", "id": "left", "path": "/on", "value": False})
            view.update(camera_seq=1, solo=["left"])
            view.at_rest(1)
            alone = view.brightness(1)
            view.edit({"op": "set", "id": "left", "path": "/flux_lm", "value": 1800})
            view.update(camera_seq=2)
            view.at_rest(2)
            brighter = view.brightness(2)
            self.assertGreater(brighter, alone)
            view.edit({"op": "remove", "id": "left"})
            view.update(camera_seq=3)
            view.at_rest(3)
            self.assertGreater(view.brightness(3), brighter, "what is gone cannot be alone: all are shown")

    def test_probes_measure_what_their_view_shows(self):
        with Daemon("--deterministic") as daemon:
            view = View(daemon, method="whitted")
            rev = view.edit(*LAMPS)
            at = {"point": [0, 0.01, 0.5], "normal": [0, 1, 0], "samples": 256}

            def lux(**more):
                reply = view.ws.call("probe", {**at, **more})
                self.assertEqual(reply["scene_rev"], rev)
                return reply["illuminance_lx"]

            every = lux(view_id=view.id)
            self.assertEqual(lux(), every)
            view.update(solo=["left"])
            left = lux(view_id=view.id)
            self.assertTrue(0 < left < every)
            self.assertEqual(lux(), every, "that of no view")
            with self.assertRaises(RpcError) as refused:
                lux(view_id=4000)
            self.assertEqual(refused.exception.data["path"], "view_id")

    def test_what_is_no_list_of_names_is_refused(self):
        with Daemon() as daemon:
            view = View(daemon)
            for solo in ("left", [1], ["a b"], [str(i) for i in range(17)]):
                with self.assertRaises(RpcError) as refused:
                    view.update(solo=solo)
                self.assertEqual(refused.exception.data["path"], "solo")


class Resend(unittest.TestCase):
    def test_brings_all_tiles_of_a_picture_that_did_not_change(self):
        with Daemon("--deterministic") as daemon:
            view = View(daemon, method="whitted", size=[300, 200])
            view.update(camera_seq=1)
            view.at_rest(1)
            view.update(camera_seq=2, resend=True)
            frames = view.at_rest(2)
            self.assertEqual(rays(frames), 0)
            tiles = []
            while not any(h["flags"] & LAST_TILE for h in tiles):
                view.ws.pump()
                tiles = [h for h in map(tile_header, view.ws.binaries) if h["camera_seq"] == 2]
            covered = sum(h["w"] * h["h"] for h in tiles)
            self.assertEqual(covered, 300 * 200)
            view.update(camera_seq=3)
            self.assertLessEqual(sum(f["tiles"] for f in view.at_rest(3)), 1, "of that message alone: the tile that ends a frame")


if __name__ == "__main__":
    unittest.main()
