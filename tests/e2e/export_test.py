"""A scene as a glTF file and back: the same records, the same picture to the last bit, and the same light; for other
programs a valid file, which they may change."""
import json
import math
import os
import struct
import subprocess
import tempfile
import unittest

import glb
from daemon import LUMEND, SANITIZE, Daemon
from wsclient import RpcError

HERE = os.path.dirname(os.path.abspath(__file__))
SHARED = os.path.normpath(os.path.join(HERE, "../../../shared/scenes"))
IMPORT = os.path.join(os.path.dirname(LUMEND), "lumend-import")
VALIDATOR = os.path.normpath(os.path.join(HERE, "../../clients/web/node_modules/gltf-validator"))
NODE = os.environ.get("LUMEND_NODE")
PIXELS = "gIAA/////wAAgID/QEDA/w=="  # 2 x 2 texels RGBA, one of them clear

# A record of every kind, and of every kind of light; what glTF has words for, and what it has none for.
EVERYTHING = [
    {"op": "add", "type": "image", "id": "tiles", "width": 2, "height": 2, "texel": "srgb8", "pixels": PIXELS},
    {"op": "add", "type": "image", "id": "same", "width": 2, "height": 2, "texel": "linear8", "pixels": PIXELS},
    {"op": "add", "type": "image", "id": "sunset", "width": 2, "height": 1, "texel": "rgb32f",
     "pixels": "AABAQAAAgD8AAAA/AACAPwAAAEAAAMBA"},
    {"op": "add", "type": "mesh", "id": "plane", "shape": "quad", "size": [4, 0, 4]},
    {"op": "add", "type": "mesh", "id": "dance", "shape": "wobble", "size": [0.3, 1, 0.3], "deforming": True},
    {"op": "add", "type": "mesh", "id": "sheet", "positions": [0, 0, 0, 0.1, 0, 0, 0, 0.3, 0, 0.1, 0.3, 1e-9],
     "indices": [0, 1, 2, 1, 3, 2], "uvs": [0, 0, 1, 0, 0, 1, 1, 1], "normals": [0, 0, 1, 0, 0, 2, 0, 0, 1, 0, 0, 1],
     "tangents": [1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, -1], "colors": [1, 1, 1, 2, 1, 1, 1, 1, 1, 1, 1, 0.5]},
    {"op": "add", "type": "material", "id": "paint", "base_color": [0.7, 0.6, 0.5], "specular": 0.4,
     "base_color_texture": {"image": "tiles", "scale": [2, 3], "rotation_rad": 0.3, "wrap_u": "mirror"},
     "alpha_mode": "mask", "alpha_cutoff": 0.3},
    {"op": "add", "type": "material", "id": "brushed", "metallic": 1, "roughness": 0.3, "anisotropy": 0.7,
     "anisotropy_rotation_deg": 33, "anisotropy_texture": {"image": "same"}, "normal_texture": {"image": "same"},
     "normal_scale": 0.4, "clearcoat": 0.5, "clearcoat_roughness": 0.1, "clearcoat_texture": {"image": "same"},
     "clearcoat_roughness_texture": {"image": "same"}, "clearcoat_normal_texture": {"image": "same"},
     "clearcoat_normal_scale": 0.7},
    {"op": "add", "type": "material", "id": "glass", "roughness": 0.1, "transmission": 1, "ior": 1.33,
     "attenuation_color": [0.9, 0.5, 0.4], "attenuation_distance": 0.2, "transmission_texture": {"image": "same"},
     "specular_texture": {"image": "same"}, "specular_color_texture": {"image": "tiles"}},
    {"op": "add", "type": "material", "id": "shade", "base_color": [0.3, 0.2, 0.2],
     "diffuse_transmittance": [0.5, 0.4, 0.1], "sheen_color": [0.1, 0.2, 0.3], "sheen_roughness": 0.4,
     "diffuse_transmission_texture": {"image": "same"}, "diffuse_transmission_share": 0.6},
    {"op": "add", "type": "material", "id": "odd-sheet", "base_color": [0.1, 0.9, 0.9],
     "diffuse_transmittance": [0.9, 0.1, 0], "diffuse_transmission_texture": {"image": "same"}},
    {"op": "add", "type": "material", "id": "glow", "base_color": [0, 0, 0], "emission_cd_m2": 800,
     "emission_color": [1, 0.6, 0.1], "emission_sides": "front"},
    {"op": "add", "type": "material", "id": "sign", "base_color": [0.2, 0.7, 0.3], "unlit": True, "roughness": 0.2},
    {"op": "add", "type": "object", "id": "floor", "mesh": "plane", "material": "paint",
     "transform": {"translate": [0, -1, 0]}},
    {"op": "add", "type": "object", "id": "sheared", "mesh": "sheet", "material": "brushed",
     "transform": [1, 0.5, 0, 0.2, 0, 1, 0.25, 0, -0.3, 0, 2, 0, 0, 0, 0, 1]},
    {"op": "add", "type": "object", "id": "mirrored", "mesh": "sheet", "material": "glass",
     "transform": {"translate": [1, 0, 0], "rotate_deg": [10, 20, 30], "scale": [-1, 1, 2]}},
    {"op": "add", "type": "object", "id": "column", "mesh": "dance", "material": "shade"},
    {"op": "add", "type": "object", "id": "unseen", "mesh": "plane", "material": "odd-sheet", "visible": False},
    {"op": "add", "type": "object", "id": "panel", "mesh": "plane", "material": "glow", "flux_lm": 1234, "cct_k": 3000,
     "group": "house", "transform": {"translate": [0, 3, 0], "scale": [0.1, 1, 0.1], "rotate_deg": [180, 0, 0]}},
    {"op": "add", "type": "object", "id": "panel-off", "mesh": "plane", "material": "glow", "on": False,
     "transform": {"translate": [1, 3, 0], "scale": [0.1, 1, 0.1]}},
    {"op": "add", "type": "object", "id": "board", "mesh": "sheet", "material": "sign"},
    {"op": "add", "type": "light", "id": "bulb", "kind": "point", "position": [0.5, 2, 0], "flux_lm": 800, "cct_k": 2700},
    {"op": "add", "type": "light", "id": "beam", "kind": "spot", "position": [0, 2, 1], "direction": [0.1, -1, 0.2],
     "inner_cone_deg": 10, "outer_cone_deg": 25, "intensity_cd": 900, "color": [1, 0.5, 0.2], "group": "house"},
    {"op": "add", "type": "light", "id": "tube", "kind": "quad", "position": [0, 2.5, 0], "u": [0.1, 0, 0.02],
     "v": [0, 0.01, 1.2], "flux_lm": 3000, "camera_visible": False},
    {"op": "add", "type": "light", "id": "disc", "kind": "disc", "position": [1, 2.5, 0], "radius": 0.2, "flux_lm": 500},
    {"op": "add", "type": "light", "id": "globe", "kind": "sphere", "position": [-1, 2, 0], "luminance_cd_m2": 5000,
     "on": False},
    {"op": "add", "type": "light", "id": "far", "kind": "directional", "direction": [0.3, -1, 0.1],
     "illuminance_lx": 2000, "diameter_deg": 0.5},
    {"op": "add", "type": "light", "id": "sun", "kind": "sun", "date": "2026-06-21", "latitude_deg": 50, "on": False},
    {"op": "add", "type": "light", "id": "sky", "kind": "environment", "image": "sunset", "luminance_cd_m2": 100},
    {"op": "add", "type": "light", "id": "clouds", "kind": "sky", "cie_type": 3, "on": False},
    {"op": "add", "type": "light", "id": "down", "kind": "ies", "position": [0, 2.7, 0.5], "direction": [0.2, -1, 0],
     "roll_deg": 25, "flux_lm": 1500, "web": {"name": "M\u00fcller 1", "c_deg": [0, 90, 180, 270, 360],
     "gamma_deg": [0, 45, 90], "candela": [500, 200.1, 0, 500, 90, 1, 500, 333.25, 0, 500, 70, 2, 500, 200.1, 0],
     "opening": "rectangle", "size": [0.6, 0.2, 0], "rated_lm": 1800, "watts": 18}},
    {"op": "add", "type": "light", "id": "flood", "kind": "ies", "position": [1, 2, 1], "as_point": True,
     "web": {"type": "b", "c_deg": [-40, 0, 40], "gamma_deg": [60, 90, 120],
             "candela": [1, 10, 1, 20, 300, 20, 1, 10, 1], "opening": "disc", "size": [0.2, 0.2, 0]}},
    {"op": "add", "type": "medium", "id": "fog", "sigma_s": [0.01, 0.01, 0.01],
     "box": {"min": [-1, -1, -1], "max": [1, 1, 1]}},
    {"op": "add", "type": "camera", "id": "main", "position": [0, 1, 5], "target": [0, 0.5, 0]},
    {"op": "add", "type": "camera", "id": "around", "position": [0, 1, 0], "target": [1, 1, 0],
     "projection": "panorama"},
    {"op": "add", "type": "sensor", "id": "desks", "kind": "grid", "position": [0, 0, 0], "u": [2, 0, 0],
     "v": [0, 0, 2], "target_lx": 500, "name": "Desks"},
    {"op": "add", "type": "patch", "id": "fader", "target": "house", "address": 3},
    {"op": "add", "type": "patch", "id": "fader-2", "target": "bulb", "address": 4},
    {"op": "add", "type": "preset", "id": "evening", "name": "Evening", "lamps": [
        {"id": "bulb", "flux_lm": 100}, {"id": "gone", "on": False}, {"id": "panel", "on": False}]},
    {"op": "set", "id": "render", "path": "", "value": {"exposure_ev": 7.5, "glass": "architectural"}},
]


def run(*words, status=0):
    done = subprocess.run([LUMEND, *words], capture_output=True, text=True, check=False)
    assert done.returncode == status, f"{words}: {done.stderr}"
    return done


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, ops):
        with open(self.path(name), "w", encoding="utf-8") as f:
            for line in [{"lumend": 1, "kind": "scene"}, *ops]:
                f.write(json.dumps(line) + "\n")
        return self.path(name)

    def export(self, scene, name, *options):
        run("export", "--scene", scene, "--out", self.path(name), *options)
        with open(self.path(name), "rb") as f:
            return f.read()

    def read_back(self, name):
        """As a scene of ops, with the ids and settings that it had."""
        done = subprocess.run([IMPORT, "--to-jsonl", self.path(name)], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, "", "nothing is left out")
        lines = done.stdout.replace('"model/', '"').splitlines()[1:]  # as they are: Python reads -0 as 0
        with open(self.path(name), "rb") as f:
            settings = glb.Glb(f.read()).list("scenes")[0]["extras"]["lumend"]["settings"]
        scene = self.write(name + ".jsonl", [])
        with open(scene, "a", encoding="utf-8") as f:
            f.write("\n".join([*lines, json.dumps({"op": "set", "id": "render", "path": "", "value": settings})]) + "\n")
        return scene

    def picture(self, scene, name):
        run("render", "--scene", scene, "--method", "path", "--spp", "2", "--size", "64x48", "--seed", "5", "--out",
            self.path(name))
        return self.path(name)

    def assert_same_picture(self, a, b):
        compared = json.loads(run("compare", self.picture(a, "a.exr"), self.picture(b, "b.exr"), "--metric", "rmse").stdout)
        self.assertEqual((compared["rmse"], compared["nonfinite"]), (0, 0), f"{a} and {b}")

    def assert_round_trip(self, scene):
        first = self.export(scene, "first.glb")
        glb.check(glb.Glb(first))
        back = self.read_back("first.glb")
        self.assert_same_picture(scene, back)
        second = self.export(back, "second.glb")
        self.assertEqual(glb.Glb(first).json, glb.Glb(second).json, "every record to its last bit")
        self.assertEqual(first, second)
        return glb.Glb(first)


class RoundTrip(Case):
    def test_built_in_scenes(self):
        for scene in ("cornell", "office-media", "desk", "many-lights", "furnace"):
            with self.subTest(scene):
                self.assert_round_trip(scene)

    def test_every_kind_of_record(self):
        g = self.assert_round_trip(self.write("all.jsonl", EVERYTHING))
        self.assertEqual(len(g.list("images")), 3)
        images = {i["name"]: i["bufferView"] for i in g.list("images")}
        self.assertEqual(images["tiles"], images["same"], "the same texels once")
        self.assertEqual([n["name"] for n in g.list("nodes")][0], "main", "who looks comes first")

    def test_real_models(self):
        if not os.path.isdir(SHARED):
            self.skipTest("no ../shared/scenes")
        names = ["office", "corner_desk"]
        if not SANITIZE:  # these have more of the same, and import.shared_scenes reads all there are
            names += ["conf_lbl_mgf", "conference_mcguire", "dabrovic_sponza", "crytek_sponza"]
        for name in names:
            with self.subTest(name):
                self.assert_round_trip(os.path.join(SHARED, "interiors", name + ".glb"))
        with self.subTest("textures"):
            self.assert_round_trip(os.path.join(SHARED, "gltf_features/DamagedHelmet.glb"))

    def test_edits_of_what_an_import_made(self):
        """A model, one part moved, one dimmed, one removed: the file has that, and no import."""
        model = self.path("room.glb")
        self.export("office", "room.glb")
        edits = [{"op": "import", "id": "room", "asset": "room.glb", "transform": {"translate": [2, 0, 1]}},
                 {"op": "set", "id": "room/desk-a-lamp", "path": "/flux_lm", "value": 77},
                 {"op": "set", "id": "room/waste-bin", "path": "/transform", "value": {"translate": [0.25, 0, 0]}},
                 {"op": "remove", "id": "room/desk-b-mug"}]
        self.assertTrue(os.path.exists(model))
        g = self.assert_round_trip(self.write("edited.jsonl", edits))
        self.assertEqual(g.record("room/desk-a-lamp")["flux_lm"], 77)
        self.assertEqual(g.node("room/waste-bin")["translation"][0], 0.25)
        self.assertFalse([n for n in g.list("nodes") if n["name"] == "room/desk-b-mug"])

    def test_settings_and_darkness_are_the_scenes(self):
        """A file of lumend's own, opened as a scene, gets no sky that it did not have."""
        self.write("dark.jsonl", [op for op in EVERYTHING if op.get("type") in ("mesh", "image", "camera") or
                                  op["id"] in ("paint", "floor", "render")])
        self.export(self.path("dark.jsonl"), "dark.glb")
        g = glb.Glb(self.export(self.path("dark.glb"), "again.glb"))
        self.assertEqual(g.lights(), [])
        extras = g.list("scenes")[0]["extras"]["lumend"]
        self.assertEqual((extras["settings"]["exposure_ev"], extras["settings"]["glass"], extras["records"]),
                         (7.5, "architectural", []))


class Photometry(Case):
    def flux(self, data):
        with open(self.path("x.ies"), "wb") as f:
            f.write(data)
        return json.loads(run("photometry", "--json", self.path("x.ies")).stdout)

    def assert_web_kept(self, asset):
        told = json.loads(run("photometry", "--json", asset).stdout)
        scene = self.write("lamp.jsonl", [
            {"op": "add", "type": "light", "id": "lamp", "kind": "ies", "asset": os.path.basename(asset),
             "position": [0, 2, 0]},
            {"op": "add", "type": "camera", "id": "main", "position": [0, 1, 5], "target": [0, 0.5, 0]}])
        data = self.export(scene, "lamp.glb", "--assets", os.path.dirname(asset))
        g = glb.Glb(data)
        glb.check(g)
        file = self.flux(g.view(g.lights("EXT_lights_ies")[0]["bufferView"]))
        # nine digits of each intensity; webs of types A and B are sampled by 2.5 and 5 degrees
        tolerance = 1e-6 if told["type"] == "c" else 0.03
        self.assertLess(abs(file["flux_lm"] / told["flux_lm"] - 1), tolerance, asset)
        for key in ("opening", "watts", "rated_lm"):
            self.assertEqual(file.get(key), told.get(key), (asset, key))
        self.assertEqual(self.export(self.read_back("lamp.glb"), "second.glb"), data, "the web to its last bit")

    def test_webs_of_the_tests(self):
        files = os.path.normpath(os.path.join(HERE, "../photometry"))
        for name in sorted(os.listdir(files)):
            if name.endswith((".ies", ".ldt")):
                with self.subTest(name):
                    self.assert_web_kept(os.path.join(files, name))

    def test_webs_of_makers(self):
        folder = os.path.join(SHARED, "ies")
        if not os.path.isdir(folder):
            self.skipTest("no ../shared/scenes")
        names = [n for n in sorted(os.listdir(folder)) if n.endswith(".ies") and not n.startswith("NOT_")]
        self.assertGreater(len(names), 15)
        for name in names:
            with self.subTest(name):
                self.assert_web_kept(os.path.join(folder, name))

    def test_fluxes_for_other_programs(self):
        """What a lamp gives, by the words of glTF alone: cd of a point are lm over 4 pi."""
        g = glb.Glb(self.export(self.write("all.jsonl", EVERYTHING), "all.glb"))
        lights = {light["name"]: light for light in g.lights()}

        def brightness(name):
            light = lights[name]
            return light["intensity"] * sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), light["color"]))

        self.assertAlmostEqual(4 * math.pi * brightness("bulb"), 800, delta=1e-3)
        self.assertAlmostEqual(brightness("beam"), 900, delta=1e-3)
        self.assertAlmostEqual(brightness("far"), 2000, delta=1e-2)
        self.assertAlmostEqual(math.pi * brightness("tube"), 3000, delta=1e-2)
        self.assertAlmostEqual(math.pi * brightness("disc"), 500, delta=1e-3)
        self.assertEqual(brightness("globe"), 0, "it is off")
        measured = g.node("down")["extensions"]["EXT_lights_ies"]
        web = self.flux(g.view(g.lights("EXT_lights_ies")[measured["light"]]["bufferView"]))
        self.assertAlmostEqual(measured["multiplier"] * web["flux_lm"], 1500, delta=0.01)
        self.assert_emission_of_panel(g)

    def assert_emission_of_panel(self, g):
        """4 x 4 m by a tenth, one side: 1234 lm are pi L A."""
        node = g.node("panel")
        material = g.list("materials")[g.list("meshes")[node["mesh"]]["primitives"][0]["material"]]
        strength = material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"]
        luminance = strength * sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), material["emissiveFactor"]))
        self.assertAlmostEqual(luminance * math.pi * 0.16, 1234, delta=1e-3)


class OtherPrograms(Case):
    def changed(self, change):
        g = glb.Glb(self.export(self.write("all.jsonl", EVERYTHING), "all.glb"))
        g.json["asset"]["generator"] = "another program"
        change(g)
        with open(self.path("changed.glb"), "wb") as f:
            f.write(g.pack())
        done = subprocess.run([IMPORT, "--to-jsonl", self.path("changed.glb")], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        ops = [json.loads(line) for line in done.stdout.splitlines()[1:]]
        return {op["id"].removeprefix("model/"): op for op in ops}

    def test_what_was_moved_stands_where_it_was_put(self):
        def move(g):
            for name in ("disc", "main", "column"):
                g.node(name)["translation"] = [v + d for v, d in zip(g.node(name).get("translation", [0, 0, 0]), (1, 2, 3))]
        records = self.changed(move)
        self.assertEqual([round(v, 6) for v in records["disc"]["position"]], [2, 4.5, 3])
        self.assertEqual(records["disc"]["flux_lm"], 500, "it is the same lamp")
        self.assertEqual([round(v, 6) for v in records["main"]["target"]], [1, 2.5, 3])
        self.assertEqual([round(v, 6) for v in records["column"]["transform"][3::4]][:3], [1, 2, 3])
        self.assertEqual(records["tube"]["u"], [0.1, 0, 0.02], "what was not moved is as it was")

    def test_materials_that_were_painted_are_so(self):
        def paint(g):
            m = next(m for m in g.list("materials") if m["name"] == "paint")
            m["pbrMetallicRoughness"]["baseColorFactor"] = [0.1, 0.2, 0.3, 1]
        records = self.changed(paint)
        self.assertEqual(records["paint"]["base_color"], [0.1, 0.2, 0.3])
        self.assertEqual(records["odd-sheet"]["base_color"], [0.1, 0.9, 0.9], "glTF cannot say it: extras do")

    def test_numbers_of_buffers_are_not_believed(self):
        """After another program they are those of other bytes."""
        def shift(g):
            g.json["bufferViews"].insert(0, {"buffer": 0, "byteLength": 4})
            for a in g.json["accessors"]:
                a["bufferView"] += 1
            for i in g.json["images"]:
                i["bufferView"] += 1
            for light in g.lights("EXT_lights_ies"):
                light["bufferView"] += 1
        records = self.changed(shift)
        self.assertEqual(records["down"]["web"]["candela"][:2], [500, 200.10000610351562], "by EXT_lights_ies")
        self.assertEqual([round(v, 6) for v in records["sheet"]["positions"][3:6]], [0.1, 0, 0])

    def test_hostile_extras_are_refused_politely(self):
        for record in ({"type": "object", "id": "floor", "mesh": 7}, {"type": "light", "id": "../x", "kind": "point"},
                       {"type": "light", "id": "bulb", "kind": "point", "flux_lm": 1e300}, {"type": "render"}, 5, []):
            with self.subTest(record=record):
                g = glb.Glb(self.export(self.write("all.jsonl", EVERYTHING), "all.glb"))
                for name in ("floor", "bulb"):
                    g.node(name)["extras"]["lumend"]["record"] = record
                g.list("scenes")[0]["extras"]["lumend"]["records"].append(record)
                with open(self.path("changed.glb"), "wb") as f:
                    f.write(g.pack())
                done = subprocess.run([IMPORT, "--to-jsonl", self.path("changed.glb")], capture_output=True, check=False)
                self.assertIn(done.returncode, (0, 1), "it ends by itself")

    @unittest.skipUnless(NODE and os.path.isdir(VALIDATOR), "no gltf-validator: npm install in clients/web")
    def test_the_validator_of_khronos_finds_no_error(self):
        scenes = {"cornell": "cornell", "all": self.write("all.jsonl", EVERYTHING)}
        if os.path.isdir(SHARED):
            scenes["conference"] = os.path.join(SHARED, "interiors/conf_lbl_mgf.glb")
        script = ("const v=require(process.argv[1]),fs=require('fs');v.validateBytes(new Uint8Array("
                  "fs.readFileSync(process.argv[2]))).then(r=>console.log(JSON.stringify(r.issues)))")
        for name, scene in scenes.items():
            with self.subTest(name):
                self.export(scene, name + ".glb")
                done = subprocess.run([NODE, "-e", script, VALIDATOR, self.path(name + ".glb")], capture_output=True,
                                      text=True, check=True)
                issues = json.loads(done.stdout)
                self.assertEqual(issues["numErrors"], 0, [m for m in issues["messages"] if m["severity"] == 0][:5])


class Command(Case):
    def test_usage(self):
        for words, said in ((["--scene", "cornell"], "--out FILE.glb is missing"),
                            (["--out", "x.glb"], "--scene NAME|FILE is missing"),
                            (["--scene", "cornell", "--out", "x.gltf"], "must end in .glb")):
            self.assertIn(said, run("export", *words, status=2).stderr)
        self.assertIn("no-such", run("export", "--scene", "no-such", "--out", self.path("x.glb"), status=1).stderr)
        self.assertIn("/no/such", run("export", "--scene", "cornell", "--out", "/no/such/x.glb", status=1).stderr)

    def test_edits_of_a_replay(self):
        still, moved = self.export("cornell", "a.glb"), self.export("cornell", "b.glb", "--edits", "cornell-moves")
        self.assertNotEqual(still, moved)


class FromTheDaemon(Case):
    def setUp(self):
        super().setUp()
        self.daemon = self.enterContext(Daemon("--scene", self.write("all.jsonl", EVERYTHING)))
        self.ws = self.daemon.connect()

    def fetch(self, get):
        return self.daemon.get("/" + get)

    def test_it_is_the_file_of_the_command(self):
        told = self.ws.call("scene.export")
        status, headers, body = self.fetch(told["get"])
        self.assertEqual((status, len(body)), (200, told["bytes"]))
        self.assertEqual(headers["content-type"], "model/gltf-binary")
        self.assertEqual(body, self.export(self.path("all.jsonl"), "all.glb"))
        self.assertEqual(self.fetch(told["get"])[0], 404, "a ticket works once")

    def test_it_has_the_edits_before_it(self):
        rev = self.ws.call("scene.apply", {"ops": [{"op": "set", "id": "bulb", "path": "/flux_lm", "value": 55}]})["scene_rev"]
        told = self.ws.call("scene.export")
        self.assertEqual(told["scene_rev"], rev)
        self.assertEqual(glb.Glb(self.fetch(told["get"])[2]).record("bulb")["flux_lm"], 55)

    def test_one_at_a_time_and_the_next_replaces_it(self):
        first, second = self.ws.call("scene.export"), self.ws.call("scene.export")
        self.assertEqual(self.fetch(first["get"])[0], 404)
        self.assertEqual(self.fetch(second["get"])[0], 200)
        ids = [self.ws.send_request("scene.export", {}) for _ in range(2)]
        self.assertIn("get", self.ws.reply(ids[0]))
        try:
            self.ws.reply(ids[1])  # the first was written before the second was read
        except RpcError as error:
            self.assertEqual(error.data["code"], "busy")

    def test_it_ends_with_the_session(self):
        get = self.ws.call("scene.export")["get"]
        self.assertEqual(self.daemon.get("/download/" + "A" * 32)[0], 404)
        self.assertEqual(self.daemon.get("/download/")[0], 404)
        self.assertEqual(self.daemon.get("/" + get, method="HEAD")[0], 404, "HEAD fetches nothing")
        self.ws.close()
        other = self.daemon.connect()
        for _ in range(200):  # until the server has seen that it left
            if self.daemon.metric("sessions") == 1:
                break
            other.call("stats.get")
        self.assertEqual(self.fetch(get)[0], 404)


if __name__ == "__main__":
    # Commands read and write with one thread, and what they render others render, too: races are looked for in the daemon.
    unittest.main(defaultTest="FromTheDaemon" if "thread" in SANITIZE else None)
