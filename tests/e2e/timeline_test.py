"""What was: moments, by whom and when; names; going back; views of a moment, while all others see the scene as it is."""
import os
import subprocess
import tempfile
import time
import unittest

from daemon import LUMEND, Daemon, write_people
from solo_test import View
from wsclient import CONVERGED, LAST_TILE, RpcError, tile_header

HERE = os.path.dirname(os.path.abspath(__file__))
LAMP = {"op": "add", "type": "light", "id": "lamp", "kind": "point", "position": [0.3, 1.5, 0.5], "flux_lm": 900}

GONE = {"op": "remove", "id": "lamp"}
WALL = {"op": "add", "type": "material", "id": "lamp"}


def dim(flux, id="lamp"):
    return {"op": "set", "id": id, "path": "/flux_lm", "value": flux}


def join(daemon, client, token=None):
    ws = daemon.connect(hello=False)
    ws.hello(token or daemon.token, client)
    return ws


class Timeline(unittest.TestCase):
    def refused(self, ws, app, method, params):
        with self.assertRaises(RpcError) as caught:
            ws.call(method, params)
        self.assertEqual(caught.exception.app, app, caught.exception)
        return str(caught.exception)

    def moments(self, ws, **params):
        return ws.call("timeline.get", params)["moments"]

    def flux(self, ws):
        ops = ws.call("scene.get", {"expand": True})["ops"]
        return next(op["flux_lm"] for op in ops if op["id"] == "lamp")

    def test_who_did_what_and_when(self):
        began = time.time() * 1000
        with Daemon() as daemon:
            ann, bob = (join(daemon, client) for client in ("ann", "bob"))
            first = ann.call("timeline.get")
            self.assertEqual([m["scene_rev"] for m in first["moments"]], [first["scene_rev"]])
            self.assertNotIn("user", first["moments"][0], "nobody made the scene that was there")
            ann.call("scene.apply", {"ops": [LAMP]})
            for flux in (1, 2, 3):
                rev = bob.call("scene.apply", {"ops": [dim(flux)], "undo_group": "drag"})["scene_rev"]
            ann.call("scene.apply", {"ops": [{"op": "remove", "id": "lamp"}]})
            ann.call("scene.undo")
            moments = self.moments(ann)[1:]
            told = [(m["user"].split(".")[0], m["did"], m["changes"]) for m in moments]
            self.assertEqual(told, [("ann", "apply", [["add", "lamp", "light"]]), ("bob", "apply", [["set", "lamp", "flux_lm"]]),
                                    ("ann", "apply", [["remove", "lamp", "light"]]), ("ann", "undo", [["add", "lamp", "light"]])])
            self.assertEqual(moments[1]["scene_rev"], rev, "a drag is one moment: its end")
            at = [m["at_ms"] for m in moments]
            self.assertTrue(began - 1000 <= at[0] <= at[1] <= at[2] <= at[3] <= time.time() * 1000 + 1000, (began, at))
            self.assertEqual(self.moments(ann, since_rev=rev), moments[1:])

    def test_an_id_that_is_of_another_type_now(self):
        with Daemon() as daemon:
            ann = join(daemon, "ann")
            ann.call("scene.apply", {"ops": [LAMP]})
            for op in ({"op": "remove", "id": "lamp"}, {"op": "add", "type": "material", "id": "lamp"}):
                ann.call("scene.apply", {"ops": [op], "undo_group": "one"})  # not in one transaction: that is refused
            self.assertEqual(self.moments(ann)[-1]["changes"], [["set", "lamp", "type"]])

    def test_back_and_on_and_undone(self):
        with Daemon() as daemon:
            ann, bob = join(daemon, "ann"), join(daemon, "bob")
            revs = [ann.call("scene.apply", {"ops": ops})["scene_rev"] for ops in ([LAMP], [dim(1)], [dim(2)])]
            back = bob.call("scene.revert", {"scene_rev": revs[1], "op_id": "back"})["scene_rev"]
            self.assertEqual(self.flux(ann), 1)
            changed = [p for n, p in ann.notifications if n == "scene.changed"][-1]
            self.assertEqual((changed["scene_rev"], changed["op_id"], changed["ops"]), (back, "back", [dim(1)]))
            again = bob.call("scene.revert", {"scene_rev": revs[2], "op_id": "back", "repeat": True})
            self.assertEqual((again["scene_rev"], again["repeated"]), (back, True), "it was done, and is not done twice")
            bob.call("scene.apply", {"ops": [dim(7)]})  # a branch
            bob.call("scene.revert", {"scene_rev": revs[2]})
            self.assertEqual(self.flux(ann), 2, "what was left is not lost")
            for flux in (7, 1, 2):
                bob.call("scene.undo")
                self.assertEqual(self.flux(ann), flux)
            self.assertEqual(self.moments(ann)[4]["to"], revs[1])
            self.refused(bob, "not_found", "scene.revert", {"scene_rev": 10 ** 6})
            self.refused(bob, "conflict", "scene.revert", {"scene_rev": revs[2]})
            self.refused(bob, "invalid_value", "scene.revert", {"scene_rev": -1})
            self.refused(bob, "missing_field", "scene.revert", {})

    def test_names(self):
        with Daemon() as daemon:
            ann, bob = join(daemon, "ann"), join(daemon, "bob")
            rev = ann.call("scene.apply", {"ops": [LAMP]})["scene_rev"]
            ann.call("timeline.name", {"scene_rev": rev, "name": "one lamp ✨"})
            told = bob.wait_notification("timeline.named")
            self.assertEqual((told["scene_rev"], told["name"], told["user"].split(".")[0]), (rev, "one lamp ✨", "ann"))
            moment = self.moments(bob)[-1]
            self.assertEqual((moment["name"], moment["named_by"].split(".")[0]), ("one lamp ✨", "ann"))
            for name in ("x" * 121, " x", "x ", "\t", "\u200b", "x" * 127, "x" * 200):
                self.refused(ann, "invalid_value", "timeline.name", {"scene_rev": rev, "name": name})
            self.refused(ann, "not_found", "timeline.name", {"scene_rev": rev + 1, "name": "to come"})
            ann.call("timeline.name", {"scene_rev": rev, "name": "x" * 120})
            bob.call("timeline.name", {"scene_rev": rev, "name": ""})
            self.assertNotIn("name", self.moments(ann)[-1])

    def test_a_view_of_a_moment_is_of_that_view(self):
        """Its pixels are those that the scene had then, bit by bit; the other view has no frame, and traces no ray, for it."""
        with Daemon("--deterministic") as daemon:
            looker, other = (View(daemon, method="path", stats=True) for _ in range(2))
            looker.edit({**LAMP, "flux_lm": 30})
            moved = {"op": "set", "id": "lamp", "path": "/position", "value": [-0.3, 0.4, 0.2]}
            pictures, revs, seq = [], [], 0
            for ops in ([dim(900)], [moved], [{"op": "remove", "id": "lamp"}, {"op": "set", "id": "white", "path": "/base_color", "value": [0.2, 0.4, 0.6]}]):
                seq += 1
                revs.append(looker.edit(*ops))
                looker.update(camera_seq=seq)
                self.assertEqual(looker.at_rest(seq)[-1]["scene_rev"], revs[-1])
                pictures.append(self.pixels(looker, seq))
            self.assertEqual(len(set(pictures)), 3)
            other.update(camera_seq=1)
            other.at_rest(1)
            other.ws.notifications.clear()
            for i in (0, 1, 2, 1, 0):
                seq += 1
                looker.update(camera_seq=seq, moment=revs[i])
                self.assertEqual(looker.at_rest(seq)[-1]["scene_rev"], revs[i])
                self.assertTrue(self.pixels(looker, seq) == pictures[i], f"of revision {revs[i]}")
            self.assertEqual(other.ws.call("scene.get", {"expand": False})["scene_rev"], revs[2], "no edit was made")
            self.assertNotIn("frame.stats", [name for name, _ in other.ws.notifications], "and the other view got no frame")
            rev = other.edit({"op": "set", "id": "white", "path": "/base_color", "value": [0.1, 0.1, 0.1]})
            seq += 1
            looker.update(camera_seq=seq)
            self.assertTrue(self.pixels(looker, seq) == pictures[0], "edits do not reach a moment")
            seq += 1
            looker.update(camera_seq=seq, moment=None)
            self.assertEqual(looker.at_rest(seq)[-1]["scene_rev"], rev)
            opened = View(daemon, method="path", stats=True, moment=revs[1], camera_seq=9)
            opened.at_rest(9)
            self.assertTrue(self.pixels(opened, 9) == pictures[1])
            self.refused(looker.ws, "not_found", "view.update", {"view_id": looker.id, "moment": 10 ** 6})
            self.refused(looker.ws, "invalid_value", "view.update", {"view_id": looker.id, "moment": 1.5})

    def pixels(self, view, seq):
        """Of change `seq`, at rest; a tile that did not change is not sent again."""
        def ended(h):
            return h["camera_seq"] == seq and h["flags"] & CONVERGED and h["flags"] & LAST_TILE
        while not any(ended(tile_header(b)) for b in view.ws.binaries):
            view.ws.pump()
        tiles = {b[40:48]: b[64:] for b in view.ws.binaries}  # the newest of each place
        return b"".join(tiles[place] for place in sorted(tiles))

    def test_what_is_seen_and_measured_there_is_of_then(self):
        with Daemon("--deterministic") as daemon:
            view = View(daemon, method="path")
            view.edit(LAMP)
            rev = view.edit({"op": "add", "type": "object", "id": "screen", "mesh": "unit-box", "material": "white",
                             "transform": {"translate": [0, 1, 1], "scale": [4, 4, 0.1]}})
            view.edit({"op": "remove", "id": "screen"}, {"op": "remove", "id": "lamp"})
            at = {"view_id": view.id, "x": 32, "y": 24}
            self.assertNotEqual(view.ws.call("pick", at)["id"], "screen")
            now = view.ws.call("probe", {**at, "samples": 64})["illuminance_lx"]
            view.update(moment=rev)
            self.assertEqual(view.ws.call("pick", at)["id"], "screen")
            self.assertNotEqual(view.ws.call("probe", {**at, "samples": 64})["illuminance_lx"], now)

    def test_limit_of_views_of_moments(self):
        with Daemon() as daemon:
            ws = [daemon.connect() for _ in range(2)]
            rev = ws[0].call("scene.apply", {"ops": [LAMP]})["scene_rev"]
            ws[0].call("scene.apply", {"ops": [dim(5)]})
            wanted = {"size": [16, 16], "codec": "png", "moment": rev, "spp": 1}
            ids = [ws[i % 2].call("view.open", wanted)["view_id"] for i in range(8)]  # LUM_LIMIT_MOMENTS_SHOWN
            self.refused(ws[0], "limit_exceeded", "view.open", wanted)
            ws[0].call("view.update", {"view_id": ids[0], "moment": rev - 1})  # in place of its own
            ws[0].call("view.update", {"view_id": ids[0], "moment": None})
            ws[1].call("view.open", wanted)
            self.refused(ws[0], "limit_exceeded", "view.update", {"view_id": ids[0], "moment": rev})

    def test_roles(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "people")
            write_people(path, {"eve": ("view", "e" * 32), "ann": ("edit", "a" * 32)})
            with Daemon("--tokens", path) as daemon:
                eve, ann = join(daemon, "eve", "e" * 32), join(daemon, "ann", "a" * 32)
                rev = ann.call("scene.apply", {"ops": [LAMP]})["scene_rev"]
                self.assertEqual(self.moments(eve)[-1]["scene_rev"], rev)
                eve.call("view.open", {"size": [16, 16], "moment": rev})
                self.refused(eve, "forbidden", "scene.revert", {"scene_rev": rev})
                self.refused(eve, "forbidden", "timeline.name", {"scene_rev": rev, "name": "x"})

    def test_all_of_it_outlives_the_daemon(self):
        with tempfile.TemporaryDirectory() as folder:
            options = ("--state", os.path.join(folder, "state"))
            with Daemon(*options) as daemon:
                ws = join(daemon, "ann")
                revs = [ws.call("scene.apply", {"ops": ops})["scene_rev"] for ops in ([LAMP], [dim(1)], [dim(2)])]
                ws.call("timeline.name", {"scene_rev": revs[1], "name": "dim"})
                ws.call("scene.revert", {"scene_rev": revs[1]})
                before = self.moments(ws)
                daemon.process.kill()
                daemon.process.wait()
                daemon.process.returncode = 0
            for _ in range(2):
                with Daemon(*options) as daemon:
                    ws = join(daemon, "bob")
                    self.assertEqual(self.moments(ws), before)
                    ws.call("scene.revert", {"scene_rev": revs[2]})
                    self.assertEqual(self.flux(ws), 2)
                    ws.call("scene.revert", {"scene_rev": revs[0]})
                    before = self.moments(ws)


class Types(unittest.TestCase):
    """A moment holds what several edits did. In it an id may become another type, or what an import brought one's own."""

    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.state = os.path.join(self.folder, "state")

    def run_state(self, command):
        return subprocess.run([LUMEND, "state", command, self.state], capture_output=True, text=True)

    def assert_whole(self):
        done = self.run_state("check")
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)

    def daemon(self):
        return Daemon("--state", self.state, "--assets", os.path.join(HERE, "web"))

    def assert_kept(self, moments):
        """Twice: from what the last run wrote, and from what a start makes of it."""
        for _ in range(2):
            self.assert_whole()
            with self.daemon() as daemon:
                self.assertEqual(join(daemon, "bob").call("timeline.get")["moments"], moments)
        self.assertEqual([name for name in os.listdir(self.state) if name.endswith(".damaged")], [])

    def test_in_a_drag(self):
        with self.daemon() as daemon:
            ann = join(daemon, "ann")
            ann.call("scene.apply", {"ops": [LAMP]})
            for op in (GONE, WALL):
                ann.call("scene.apply", {"ops": [op], "undo_group": "drag"})
            moments = ann.call("timeline.get")["moments"]
            self.assertEqual(moments[-1]["n_changes"], 1)
        self.assert_kept(moments)

    def test_in_what_is_joined_for_its_number(self):
        with self.daemon() as daemon:
            ann = join(daemon, "ann")
            others = [join(daemon, f"n{i}") for i in range(8)]  # one may send 240 messages a second
            rev = ann.call("scene.apply", {"ops": [LAMP]})["scene_rev"]
            ann.call("timeline.name", {"scene_rev": rev, "name": "a lamp"})
            for op in (GONE, WALL):
                ann.call("scene.apply", {"ops": [op]})
            for i in range(1022):  # one more than LUM_LIMIT_PAST_STEPS
                others[i % 8].call("scene.apply", {"ops": [{"op": "set", "id": "white", "path": "/roughness", "value": i / 1024}]})
            moments = ann.call("timeline.get")["moments"]
            self.assertEqual((moments[2]["joined"], [change[:2] for change in moments[2]["changes"]]), (2, [["set", "lamp"]]))
        self.assert_kept(moments)

    def test_in_what_is_compacted(self):
        with self.daemon() as daemon:
            ann = join(daemon, "ann")
            rev = ann.call("scene.apply", {"ops": [LAMP]})["scene_rev"]
            ann.call("timeline.name", {"scene_rev": rev, "name": "a lamp"})
            for op in (GONE, WALL):
                ann.call("scene.apply", {"ops": [op]})
        self.assertEqual(self.run_state("compact").returncode, 0)
        with self.daemon() as daemon:
            moments = join(daemon, "bob").call("timeline.get")["moments"]
        self.assertEqual([m.get("name", "") for m in moments], ["", "a lamp", ""])
        self.assert_kept(moments)

    def test_what_was_of_an_import(self):
        with self.daemon() as daemon:
            ann = join(daemon, "ann")
            for i, group in enumerate(("drag", "")):  # in two edits that are one moment, and in one edit
                ann.call("scene.apply", {"ops": [{"op": "import", "id": f"room{i}", "asset": "lamp.gltf"}]})
                made = next(op for op in ann.call("scene.get", {"expand": True})["ops"] if op.get("origin") == f"room{i}" and op["type"] == "material")
                ops = [{"op": "remove", "id": f"room{i}"}, {"op": "add", "type": "material", "id": made["id"], "roughness": 0.25}]
                for some in ([[op] for op in ops] if group else [ops]):
                    ann.call("scene.apply", {"ops": some, **({"undo_group": group} if group else {})})
            before = ann.call("scene.get", {"expand": True})["ops"]
            moments = ann.call("timeline.get")["moments"]
        self.assert_kept(moments)
        with self.daemon() as daemon:
            ann = daemon.connect(hello=False)
            ann.call("session.hello", {"token": daemon.token, "resume": "ann.0-1"})
            ann.call("scene.undo")
            self.assertTrue(any(op["id"] == "room1" for op in ann.call("scene.get", {"expand": True})["ops"]))
            ann.call("scene.redo")
            self.assertEqual(ann.call("scene.get", {"expand": True})["ops"], before)


if __name__ == "__main__":
    unittest.main()
