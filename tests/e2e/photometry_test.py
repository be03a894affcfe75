"""Lamps with photometric files, through the daemon and by the command: read in the sandbox, told, dimmed, kept, rebuilt."""
import json
import math
import os
import shutil
import subprocess
import tempfile
import unittest

from daemon import LUMEND, Daemon
from wsclient import RpcError

FILES = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../photometry"))
LAMP = {"op": "add", "type": "light", "id": "lamp", "kind": "ies", "asset": "downlight.ies", "position": [0, 0.9, 0]}


def command(*files, status=0):
    done = subprocess.run([LUMEND, "photometry", "--json", *files], capture_output=True, text=True, check=False)
    assert done.returncode == status, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


class Photometry(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.assets = cls.enterClassContext(tempfile.TemporaryDirectory())
        for name in os.listdir(FILES):
            shutil.copy(os.path.join(FILES, name), cls.assets)
        with open(os.path.join(cls.assets, "broken.ies"), "w", encoding="utf-8") as f:
            f.write("IESNA:LM-63-2002\n[TEST] 1\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0 1 1 1\n0 90 45\n0\n1 1 1\n")
        os.symlink("/etc/passwd", os.path.join(cls.assets, "link.ies"))

    def setUp(self):
        self.daemon = self.enterContext(Daemon("--assets", self.assets))
        self.ws = self.daemon.connect()

    def apply(self, *ops):
        return self.ws.call("scene.apply", {"ops": list(ops)})

    def light(self, name="lamp"):
        ops = self.ws.call("scene.get", {"expand": True})["ops"]
        return next(op for op in ops if op["id"] == name)

    def refused(self, app, text, *ops):
        with self.assertRaises(RpcError) as caught:
            self.apply(*ops)
        self.assertEqual(caught.exception.app, app)
        self.assertIn(text, str(caught.exception))

    def test_what_a_file_says_is_told(self):
        self.assertNotIn("warnings", self.apply(LAMP))
        self.assertIn("TILT", self.apply({**LAMP, "id": "flood", "asset": "floodlight.ies"})["warnings"][0])
        asked, told = self.ws.call("photometry", {"id": "lamp"}), self.light()["photometry"]
        said = command(os.path.join(FILES, "downlight.ies"))[0]
        self.assertEqual({k: v for k, v in asked.items() if k != "polar_cd"}, {k: v for k, v in said.items() if k not in ("file", "warnings")})
        polar, _ = asked.pop("polar_cd"), asked.pop("ugr")
        self.assertEqual(asked, told, "what takes a table of glare is not in the record")
        self.assertAlmostEqual(told["flux_lm"], 877.7, delta=0.1)
        self.assertEqual((told["watts"], told["symmetry"], told["opening"]), (9.5, "axial", "disc"))
        self.assertEqual((polar["c0"][0], polar["gamma_deg"][18], polar["c270"][18]), (1200, 90, 0))
        self.assertIn("downlight.ies: 877.7 lm by its intensities, 9.5 W", self.daemon.read_log())
        with self.assertRaises(RpcError):
            self.ws.call("photometry", {"id": "ceiling-panel"})

    def test_glare_as_catalogues_print_it(self):
        """Twice the lumens from the same opening are 8 lg 2 = 2.41 more, in all rooms."""
        said = command("--ugr", os.path.join(FILES, "linear.ldt"))[0]
        table = said["ugr_table"]
        self.assertEqual((table["spacing_h"], len(table["rooms"]), len(table["reflectances"])), (0.25, 19, 5))
        whole = {tuple(room["size_h"]): room for room in table["rooms"]}
        self.assertEqual(said["ugr"], [whole[4, 8]["crosswise"][0], whole[4, 8]["endwise"][0]])
        self.assertGreater(said["ugr"][0], said["ugr"][1] + 5, "its sides shine more than its ends")
        with open(os.path.join(FILES, "linear.ldt"), encoding="latin-1") as f:
            half = f.read().replace("3200,5", "1600,25")
        with tempfile.NamedTemporaryFile("w", suffix=".ldt", encoding="latin-1") as f:
            f.write(half)
            f.flush()
            dimmed = command("--ugr", f.name)[0]["ugr_table"]
        for a, b in zip(table["rooms"], dimmed["rooms"], strict=True):
            for view in ("crosswise", "endwise"):
                for x, y in zip(a[view], b[view], strict=True):
                    self.assertAlmostEqual(x - y, 8 * math.log10(2), places=4)
        printed = subprocess.run([LUMEND, "photometry", "--ugr", os.path.join(FILES, "linear.ldt")], capture_output=True, text=True,
                                 check=True).stdout
        self.assertIn(f"{whole[12, 8]['endwise'][4]:.1f}\n", printed)
        point = command("--ugr", os.path.join(FILES, "floodlight.ies"))[0]
        self.assertEqual("ugr" in point, bool(point["ugr_table"]))

    def test_glare_does_not_depend_on_the_kind_of_file(self):
        """EULUMDAT's first plane lies across the length, that of IES along it: one box, written as both."""
        gamma, across, between, along = "0 30 60 80 90", "300 260 90 40 25", "300 240 70 25 15", "300 220 45 12 4"
        ldt = ["Box", 2, 4, 8, 45, 5, 0, "", "Box", "", "", "", 1250, 350, 80, 1200, 300, 50, 50, 50, 50, 100, 100, 1, 0,
               1, 1, "LED", 2000, 0, 0, 20, *[0] * 10, *range(0, 360, 45), *f"{gamma} {across} {between} {along}".split()]
        ies = ["IESNA:LM-63-2002", "[TEST] 1", "TILT=NONE", "1 2000 2 5 3 1 2 0.3 1.2 0.05", "1 1 20", gamma, "0 45 90",
               along, between, across]
        rooms = []
        for ending, lines in ((".ldt", ldt), (".ies", ies)):
            with tempfile.NamedTemporaryFile("w", suffix=ending) as f:
                f.write("\n".join(map(str, lines)) + "\n")
                f.flush()
                rooms.append(command("--ugr", f.name)[0]["ugr_table"]["rooms"])
        for a, b in zip(*rooms, strict=True):
            self.assertEqual(a["size_h"], b["size_h"])
            self.assertGreater(a["crosswise"][0], a["endwise"][0] + 1, "its sides shine more than its ends")
            for view in ("crosswise", "endwise"):
                for x, y in zip(a[view], b[view], strict=True):
                    self.assertAlmostEqual(x, y, places=4)  # intensities are floats, of 7 digits

    def test_a_scene_keeps_its_lamps(self):
        self.apply(LAMP, {**LAMP, "id": "twin", "multiplier": 0.5, "roll_deg": 30, "direction": [1, -1, 0]})
        self.apply({"op": "set", "id": "lamp", "path": "/flux_lm", "value": 300})
        ops = self.ws.call("scene.get")["ops"]
        mine = {op["id"]: op for op in ops if op["id"] in ("lamp", "twin")}
        self.assertNotIn("web", mine["lamp"])  # the file says it
        self.assertEqual(mine["lamp"]["asset"], "downlight.ies")
        with tempfile.NamedTemporaryFile("w", suffix=".jsonl", dir=self.assets) as scene:
            scene.write("\n".join(json.dumps(line) for line in [{"lumend": 1, "kind": "scene"}, *ops]))
            scene.flush()
            with Daemon("--scene", scene.name, "--assets", self.assets) as again:
                self.assertEqual(again.connect().call("scene.get")["ops"], ops)

    def test_a_web_needs_no_file(self):
        web = {"c_deg": [0, 90, 180, 270, 360], "gamma_deg": [0, 45, 90], "candela": [9, 5, 0] * 5, "watts": 3}
        op = {"op": "add", "type": "light", "id": "own", "kind": "ies", "web": web}
        self.apply(op)
        kept = next(o for o in self.ws.call("scene.get")["ops"] if o["id"] == "own")["web"]
        self.assertEqual({**kept, **web}, kept)
        self.assertEqual(self.light("own")["photometry"]["symmetry"], "axial")
        self.assertNotIn("web", self.light("own"))  # arrays in bulk are left out

    def test_undo_and_another_file(self):
        self.apply(LAMP)
        self.apply({"op": "set", "id": "lamp", "path": "/asset", "value": "linear.ldt"})
        self.assertEqual(self.light()["photometry"]["symmetry"], "quadrant")
        self.ws.call("scene.undo")
        self.assertEqual(self.light()["photometry"]["symmetry"], "axial")
        self.assertEqual(self.light()["asset"], "downlight.ies")
        self.ws.call("scene.redo")
        self.assertEqual(self.light()["photometry"]["symmetry"], "quadrant")
        self.apply({"op": "set", "id": "lamp", "path": "", "value": {"asset": "floodlight.ies", "flux_lm": 100}})
        self.assertEqual(self.light()["photometry"]["type"], "b")
        self.apply({"op": "remove", "id": "lamp"}, LAMP)
        self.assertEqual(self.light()["photometry"]["symmetry"], "axial")
        self.refused("not_found", "no such file", {"op": "set", "id": "lamp", "path": "/asset", "value": "nowhere.ies"})
        self.refused("invalid_value", "must end in .ies", {"op": "set", "id": "lamp", "path": "/asset", "value": "a.txt"})
        self.refused("invalid_value", "only an ies light",
                     {"op": "set", "id": "ceiling-panel", "path": "/asset", "value": "downlight.ies"})

    def test_a_state_folder_keeps_what_files_said(self):
        with tempfile.TemporaryDirectory() as state:
            with Daemon("--assets", self.assets, "--state", state) as daemon:
                ws = daemon.connect()
                ws.call("scene.apply", {"ops": [LAMP, {**LAMP, "id": "twin"}]})
                ws.call("scene.apply", {"ops": [{"op": "set", "id": "lamp", "path": "/asset", "value": "linear.ldt"}]})
                before = ws.call("scene.get", {"expand": True})["ops"]
            for _ in range(2):  # from the edits, then from the snapshot of the second start
                with Daemon("--state", state) as daemon:  # the files are not there any more
                    ws = daemon.connect()
                    self.assertEqual(ws.call("scene.get", {"expand": True})["ops"], before)
                    self.assertEqual(ws.call("photometry", {"id": "lamp"})["symmetry"], "quadrant")
                subprocess.run([LUMEND, "state", "compact", state], check=True, capture_output=True)

    def test_what_the_folder_offers(self):
        """Plain files with the names of photometric ones, however deep, but for links and what is hidden."""
        with tempfile.TemporaryDirectory() as folder:
            deep = os.path.join(folder, *"abcdefgh")
            os.makedirs(deep)
            for name in ("Zeta.IES", "a/one.ldt", "a/b/Two.Ies", "a/b/model.glb", ".hidden.ies", "a/b/c/d/e/f/g/deep.ies",
                         "a/b/c/d/e/f/g/h/too-deep.ies", "line\nbreak.ies", "back\\slash.ies"):
                shutil.copy(os.path.join(FILES, "downlight.ies"), os.path.join(folder, name))
            with open(os.path.join(os.fsencode(folder), b"latin\xe9.ies"), "wb"):
                pass
            os.symlink("/etc", os.path.join(folder, "out"))
            os.symlink("Zeta.IES", os.path.join(folder, "link.ies"))
            os.mkdir(os.path.join(folder, "folder.ies"))
            with Daemon("--assets", folder) as daemon:
                ws = daemon.connect()
                told = ws.call("asset.list", {"kind": "photometry"})
                self.assertEqual([a["asset"] for a in told["assets"]],
                                 ["Zeta.IES", "a/b/Two.Ies", "a/b/c/d/e/f/g/deep.ies", "a/one.ldt"])
                self.assertFalse(told["whole"])  # there is more, deeper
                self.assertEqual(told["assets"][0]["bytes"], os.path.getsize(os.path.join(FILES, "downlight.ies")))
                found = ws.call("asset.list", {"kind": "photometry", "match": "A/B"})
                self.assertEqual(len(found["assets"]), 2)
                for params, app in (({"kind": "model"}, "invalid_value"), ({}, "missing_field"),
                                    ({"kind": "photometry", "match": "a" * 65}, "invalid_value")):
                    with self.assertRaises(RpcError) as caught:
                        ws.call("asset.list", params)
                    self.assertEqual(caught.exception.app, app)

    def test_more_files_than_an_answer_has(self):
        with tempfile.TemporaryDirectory() as folder:
            for i in range(4097):
                with open(os.path.join(folder, f"{i:04}.ies"), "w", encoding="utf-8"):
                    pass
            with Daemon("--assets", folder) as daemon:
                ws = daemon.connect()
                told = ws.call("asset.list", {"kind": "photometry"})
                self.assertEqual((len(told["assets"]), told["whole"]), (4096, False))
                os.remove(os.path.join(folder, "0000.ies"))
                told = ws.call("asset.list", {"kind": "photometry"})
                self.assertEqual((len(told["assets"]), told["whole"]), (4096, True))

    def test_what_a_file_says_before_it_is_placed(self):
        told = self.ws.call("asset.photometry", {"asset": "floodlight.ies"})
        self.assertIn("TILT", told.pop("warnings")[0])
        self.apply({**LAMP, "asset": "floodlight.ies"})
        self.assertEqual(told, self.ws.call("photometry", {"id": "lamp"}))
        for asset, app, text in (("broken.ies", "import_failed", "line 5: vertical angles must ascend"),
                                 ("nowhere.ies", "not_found", "no such file"), ("link.ies", "import_failed", ""),
                                 ("../downlight.ies", "not_found", "asset directory"),
                                 ("model.glb", "invalid_value", "must end in .ies")):
            with self.assertRaises(RpcError) as caught:
                self.ws.call("asset.photometry", {"asset": asset})
            self.assertEqual(caught.exception.app, app)
            self.assertIn(text, str(caught.exception))
        with Daemon("--upload-mib", "0") as bare:
            ws = bare.connect()
            for method, params in (("asset.list", {"kind": "photometry"}), ("asset.photometry", {"asset": "a.ies"})):
                with self.assertRaises(RpcError) as caught:
                    ws.call(method, params)
                self.assertEqual(caught.exception.app, "unsupported")

    def test_questions_about_files_wait_in_a_queue_with_an_end(self):
        n = 128
        asked = [self.ws.send_request("asset.photometry", {"asset": "downlight.ies"}) for _ in range(n)]
        other = self.daemon.connect()
        gone = self.daemon.connect()
        gone.send_request("asset.photometry", {"asset": "downlight.ies"})
        gone.close()
        self.assertEqual(other.call("asset.photometry", {"asset": "linear.ldt"})["symmetry"], "quadrant")
        busy = 0
        for request in asked:
            try:
                self.assertGreater(self.ws.reply(request)["flux_lm"], 800)
            except RpcError as e:
                self.assertEqual(e.app, "busy")
                busy += 1
        self.assertTrue(0 < busy <= n - 64)

    def test_files_that_are_refused(self):
        self.refused("import_failed", "line 5: vertical angles must ascend", {**LAMP, "asset": "broken.ies"})
        self.refused("not_found", "no such file", {**LAMP, "asset": "nowhere.ies"})
        self.refused("import_failed", "link.ies", {**LAMP, "asset": "link.ies"})
        self.refused("invalid_value", "relative path", {**LAMP, "asset": "../lamp.ies"})
        self.assertIn("ops", self.ws.call("scene.get"))
        self.assertEqual(command(os.path.join(self.assets, "broken.ies"), status=1)[0]["error"],
                         "broken.ies: line 5: vertical angles must ascend: 45 follows 90")


if __name__ == "__main__":
    unittest.main()
