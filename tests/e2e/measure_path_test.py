"""What sensors and `lumend measure` show, against pictures by `path` and against probes, in rooms of real luminaires and models."""
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

from daemon import LUMEND, Daemon

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "support"), os.path.join(HERE, "..", "..", "clients", "python")]
import lumend  # noqa: E402
from exr import Exr  # noqa: E402

PHOTOMETRY = os.path.join(HERE, "..", "photometry")
MODEL = os.path.join(HERE, "..", "..", "..", "shared/scenes/interiors/conf_lbl_mgf.glb")
SANITIZED = bool(os.environ.get("LUMEND_SANITIZE"))
SPP = 16 if SANITIZED else 256
LENGTH, WIDTH, HEIGHT = 4.0, 3.0, 2.8
EYE, SIZE = 2.7, (160, 120)
FOV = 80.0  # it sees 4.5 m of the floor from back to front


def room():
    """Six luminaires of three files, of which one leans, over a floor that an eye under the ceiling looks down on."""
    ops = []
    for name, share in (("ceiling", 0.7), ("wall", 0.5), ("floor", 0.2)):
        ops.append({"op": "add", "type": "material", "id": f"{name}-paint", "base_color": [share] * 3, "specular": 0})
    for name, paint, size, at, turn in (("floor", "floor", [LENGTH, 0, WIDTH], [0, 0, 0], [0, 0, 0]),
                                        ("ceiling", "ceiling", [LENGTH, 0, WIDTH], [0, HEIGHT, 0], [180, 0, 0]),
                                        ("back", "wall", [LENGTH, 0, HEIGHT], [0, HEIGHT / 2, -WIDTH / 2], [90, 0, 0]),
                                        ("front", "wall", [LENGTH, 0, HEIGHT], [0, HEIGHT / 2, WIDTH / 2], [-90, 0, 0]),
                                        ("left", "wall", [HEIGHT, 0, WIDTH], [-LENGTH / 2, HEIGHT / 2, 0], [0, 0, -90]),
                                        ("right", "wall", [HEIGHT, 0, WIDTH], [LENGTH / 2, HEIGHT / 2, 0], [0, 0, 90])):
        ops.append({"op": "add", "type": "mesh", "id": f"{name}-mesh", "shape": "quad", "size": size})
        ops.append({"op": "add", "type": "object", "id": name, "mesh": f"{name}-mesh", "material": f"{paint}-paint",
                    "transform": {"translate": at, "rotate_deg": turn}})
    files = ("linear.ldt", "downlight.ies", "floodlight.ies")
    for i, (x, z) in enumerate((x, z) for x in (-1.2, 0, 1.2) for z in (-0.75, 0.75)):
        ops.append({"op": "add", "type": "light", "id": f"lamp-{i}", "kind": "ies", "asset": files[i // 2], "position": [x, 2.75, z],
                    "direction": [0.2 if i == 5 else 0, -1, 0], "flux_lm": 1500})
    ops.append({"op": "add", "type": "camera", "id": "main", "position": [0, EYE, 0], "target": [0, 0, 0], "up": [0, 0, -1], "vfov_deg": FOV})
    return ops


def pixel_of(x, z):
    scale = SIZE[1] / 2 / (EYE * math.tan(math.radians(FOV / 2)))
    return int(SIZE[0] / 2 + scale * x), int(SIZE[1] / 2 + scale * z)


class Measures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        for name in os.listdir(PHOTOMETRY):
            shutil.copy(os.path.join(PHOTOMETRY, name), cls.folder)
        cls.scene = os.path.join(cls.folder, "room.jsonl")
        with open(cls.scene, "w", encoding="utf-8") as file:
            file.write("\n".join(json.dumps(line) for line in [{"lumend": 1, "kind": "scene"}, *room()]))

    def path(self, name):
        return os.path.join(self.folder, name)

    def run_lumend(self, *command):
        done = subprocess.run([LUMEND, *command], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)

    def measure(self, scene, *options):
        self.run_lumend("measure", "--scene", scene, "--json", self.path("m.json"), *options)
        with open(self.path("m.json"), encoding="utf-8") as file:
            return json.load(file)

    def test_a_grid_is_what_path_shows_of_the_floor(self):
        """Windows of 5 x 5 pixels, 0.19 m across. Of a point 5 % and four of its standard errors; in the mean of all 2 %."""
        grid = self.measure(self.scene, "--height", "0.001", "--border", "0.4", "--spacing", "0.4")
        self.run_lumend("render", "--scene", self.scene, "--method", "path", "--spp", str(SPP), "--illuminance", "--size", "160x120",
                        "--out", self.path("floor.exr"))
        rows, shown = Exr(self.path("floor.exr")).rows(), []
        for p in grid["points"]:
            x, y = pixel_of(p["point"][0], p["point"][2])
            window = [rows[y + j]["illuminance.Y"][x + i] for j in range(-2, 3) for i in range(-2, 3)]
            errors = [rows[y + j]["illuminance.error"][x + i] for j in range(-2, 3) for i in range(-2, 3)]
            mean, stderr = sum(window) / 25, math.hypot(max(errors) / 5, p["stderr_lx"])
            shown.append(mean)
            if not SANITIZED:
                self.assertLess(abs(mean - p["lx"]), 0.05 * p["lx"] + 4 * stderr, (p, mean))
        self.assertGreater(len(shown), 30)
        ratio = sum(shown) / len(shown) / grid["em_lx"]
        print(f"floor of {len(shown)} points: path shows {ratio:.4f} of what measure says, {grid['em_lx']:.1f} lx")
        self.assertLess(abs(ratio - 1), 0.05 if SANITIZED else 0.02)

    def test_cylinders_are_means_of_walls(self):
        """Cylindrical illuminance is the mean of vertical ones all around: of twelve probes, each with an error of its own."""
        with Daemon("--scene", self.scene, "--assets", self.folder) as daemon, \
                lumend.connect(f"http://{daemon.host}:{daemon.port}/#t={daemon.token}") as session:
            at = [0.6, 1.2, 0.4]
            with session.edit() as edit:
                edit.add_sensor("face", kind="point", position=at, normal=[0, 1, 0], quantity="cylindrical")
            value = session.sensor("face")
            probes = [session.probe(at, [math.cos(a), 0, math.sin(a)], samples=4096)
                      for a in (2 * math.pi * k / 12 for k in range(12))]
            mean = sum(p["illuminance_lx"] for p in probes) / 12
            stderr = math.hypot(math.hypot(*(p["stderr_lx"] for p in probes)) / 12, value["em_stderr_lx"])
            self.assertLess(abs(value["em_lx"] - mean), 0.01 * mean + 4 * stderr, (value["em_lx"], mean))

    def follow(self, scene, sensor, *assets):
        """The first value that a sensor has, while pictures are fast ones, and the exact one."""
        with Daemon("--scene", scene, *assets) as daemon, \
                lumend.connect(f"http://{daemon.host}:{daemon.port}/#t={daemon.token}") as session:
            with session.edit() as edit:
                edit.add_sensor("work-plane", kind="grid", **sensor)
            first = session.sensor("work-plane", enough=lambda value: value["em_lx"] is not None)
            exact = session.sensor("work-plane")
            print(f"{os.path.basename(scene)}: {first['em_lx']:.1f} lx at first ({'settled' if first['settled'] else 'live'}), "
                  f"{exact['em_lx']:.1f} +/- {exact['em_stderr_lx']:.2g} lx exactly")
            self.assertTrue(exact["settled"])
            return first["em_lx"], exact["em_lx"], exact["em_stderr_lx"]

    def test_live_values_are_near_the_exact_ones(self):
        first, exact, _ = self.follow(self.scene, {"position": [0, 0.75, 0], "u": [3, 0, 0], "v": [0, 0, 2]}, "--assets", self.folder)
        self.assertLess(abs(first / exact - 1), 0.05)

    @unittest.skipUnless(os.path.exists(MODEL), "skipped: no ../shared/scenes")
    @unittest.skipIf(SANITIZED, "it takes minutes")
    def test_a_model_is_measured_by_both_alike(self):
        first, exact, stderr = self.follow(MODEL, {"position": [5.25, 1.2, -3.5], "u": [8.5, 0, 0], "v": [0, 0, 5], "spacing_m": 1})
        self.assertLess(abs(first / exact - 1), 0.05)
        told = self.measure(MODEL, "--height", "1.2", "--area=1,-6,9.5,-1", "--spacing", "1")
        self.assertLess(abs(told["em_lx"] - exact), 0.005 * exact + 4 * math.hypot(stderr, told["em_stderr_lx"]), (told["em_lx"], exact))


if __name__ == "__main__":
    unittest.main()
