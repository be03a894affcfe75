"""Absent effects cost nothing: instructions of a frame, counted by callgrind, with an effect that the scene does
not call for, against the same frame with it forced off. "Compiled out" is realised as forced off: the renderer has no other way
of being without an effect. Counted: what passes do (lum_view_pass and the tiles of its stages), not the reading of the scene.
callgrind counts repeat exactly where no number of rays is a matter of time (--deterministic); valgrind runs Embree without
AVX-512."""
import concurrent.futures
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

LUMEND = os.environ["LUMEND"]
TOLERANCE = 1e-3
# What is absent together: half the runs of valgrind, and each effect is in the scene of most others.
ABSENT = [["direct", "transmission"], ["soft_shadow", "media"], ["environment", "reflection", "glossy"], ["indirect_diffuse"]]
DIFFUSE = {"roughness": 1, "specular": 0}


def add(type_, name, **fields):
    return {"op": "add", "type": type_, "id": name, **fields}


def item(name, at, **material):
    return [add("material", name + "-paint", **{**DIFFUSE, **material}),
            add("object", name, mesh="box", material=name + "-paint", transform={"translate": at})]


def scene_without(effects):
    """The scene calls for all effects but these. Without indirect light nothing may face anything: floor and lamps alone."""
    ops = [add("mesh", "plane", shape="quad", size=[4, 0, 4]), add("mesh", "box", shape="box", size=[0.5, 0.5, 0.5]),
           add("material", "paint", base_color=[0.7] * 3, **DIFFUSE), add("object", "floor", mesh="plane", material="paint"),
           add("camera", "main", position=[0.2, 1.1, 2.6], target=[0, 0.4, -0.2])]
    if "direct" not in effects:
        ops.append(add("light", "bulb", kind="point", position=[-1, 2, 0.5], intensity_cd=60))
    if "soft_shadow" not in effects:
        ops.append(add("light", "panel", kind="quad", position=[0.5, 2.2, 0], u=[0.5, 0, 0], v=[0, 0, 0.5], luminance_cd_m2=90))
    if "environment" not in effects:
        ops.append(add("light", "sky", kind="environment", luminance_cd_m2=3))
    if "indirect_diffuse" in effects:
        return ops
    ops += item("crate", [0.3, 0.25, -0.6], base_color=[0.5] * 3)
    ops += item("mirror", [-0.7, 0.25, -0.5], **({} if "reflection" in effects else {"metallic": 1, "roughness": 0}))
    ops += item("vase", [0.8, 0.25, 0.3], **({} if "glossy" in effects else {"specular": 1, "roughness": 0.4}))
    if "transmission" not in effects:
        ops += item("pane", [0, 0.25, 0.5], transmission=1, thin=True, ior=1, base_color=[0.6, 0.9, 0.7])
    if "media" not in effects:
        ops.append(add("medium", "fog", sigma_s=[0.1] * 3, box={"min": [-1.5, 0, -1.5], "max": [1.5, 1, 1]}))
    return ops


def instructions(scene, method, name, *options):
    """Of the passes of one picture; name: of the files it leaves."""
    command = [LUMEND, "render", "--scene", scene, "--method", method, "--size", "24x16", "--spp", "1", "--threads", "1",
               "--deterministic", "--out",
               name + ".png", "--stats", name + ".json", *options]
    valgrind = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "--toggle-collect=lum_view_pass",
                "--toggle-collect=run_tile"]
    run = subprocess.run(valgrind + command, capture_output=True, text=True, check=False)
    refs = re.search(r"refs:\s*([\d,]+)", run.stderr)
    if run.returncode != 0 or not refs:
        raise AssertionError(f"{' '.join(command)}: status {run.returncode}\n{run.stderr}")
    return int(refs.group(1).replace(",", ""))


class Instructions(unittest.TestCase):
    def check(self, folder, effects, method):
        scene, name = os.path.join(folder, effects[0] + ".jsonl"), os.path.join(folder, f"{effects[0]}-{method}")
        absent = instructions(scene, method, name)
        with open(name + ".json", encoding="utf-8") as f:
            demands = json.load(f)["frames"][0]["effects"]
        off = instructions(scene, method, name + "-off", "--effects-off", ",".join(effects))
        return effects, method, absent, off, demands

    def test_absent_effects_take_no_instructions(self):
        methods = [line.split()[0] for line in subprocess.run([LUMEND, "methods"], capture_output=True, text=True,
                                                              check=True).stdout.splitlines()]
        with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            for effects in ABSENT:
                with open(os.path.join(folder, effects[0] + ".jsonl"), "w", encoding="utf-8") as f:
                    lines = [{"lumend": 1, "kind": "scene"}] + scene_without(effects)
                    f.write("".join(json.dumps(line) + "\n" for line in lines))
            worst = 0.0
            # live everywhere; each other method with half of the effects, and each effect with half of them: numeric.effects has them all,
            # by rays, tiles and pixels.
            pairs = [(e, m) for i, e in enumerate(ABSENT) for k, m in enumerate(methods) if m == "live" or (i + k) % 2 == 0]
            runs = [pool.submit(self.check, folder, e, m) for e, m in pairs]
            for run in runs:
                effects, method, absent, off, demands = run.result()
                worst = max(worst, abs(absent - off) / off)
                with self.subTest(effects=effects, method=method):
                    for effect in effects:
                        self.assertFalse(demands[effect]["on"], demands[effect]["why"])
                    self.assertGreater(off, 100_000)  # the passes were counted: thousands of instructions, were it only the loop around them
                    self.assertLessEqual(abs(absent - off), TOLERANCE * off, f"{absent} absent, {off} forced off")
        print(f"worst of {len(runs)}: {worst:.1e}")


if __name__ == "__main__":
    if not shutil.which("valgrind"):
        print("skipped: no valgrind")
        sys.exit(0)
    unittest.main()
