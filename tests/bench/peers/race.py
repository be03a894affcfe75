#!/usr/bin/env python3
"""How long Blender's Cycles and lumend take to the same error, on models that neither was made for. Run by hand: minutes a model.

usage: tests/bench/peers/race.py [--bin build/release/bin] [--models ../shared/scenes] [--model PATH:CAMERA]... [--size 300x200]
                                 [--reference-spp 1024] --out DIR

Needs Debian's package blender. Each renderer is measured against its own converged picture of another seed, so that what their
importers make of a material is no error of either; how far apart the two converged pictures are is told. Cycles renders as its
defaults are but for: no denoising, no adaptive sampling, no clamping, no blur of gloss, 64 bounces as lumend has.

Times are CPU seconds of all threads, without reading the model and building its tree, which each has done for a picture of one
pixel before. SMAPE is that of `lumend compare`. Writes race.json, and race.md: a table.
"""
import argparse
import json
import math
import os
import resource
import subprocess
import sys

here = os.path.dirname(os.path.abspath(__file__))
top = os.path.normpath(os.path.join(here, "../../.."))
MODELS = ["cornell/cornell_measured.glb:cornell_camera", "classic_gi/erw_scene6.glb:viewing_ps", "interiors/office.glb:model_vp",
          "interiors/conf_lbl_mgf.glb:current_vf", "interiors/conference_mcguire.glb:corner",
          "interiors/crytek_sponza.glb:atrium_floor", "interiors/dabrovic_sponza.glb:atrium", "interiors/sibenik.glb:nave"]
CYCLES_SPP = [1, 4, 16, 64, 256]
PATH_SPP = [1, 4, 16, 64, 256]
LIVE_SPP = [1, 2, 4, 8, 16, 32, 64, 128]
EQUAL_SPP = 64  # of Cycles, whose error the others are to reach


def run(command):
    print("+", " ".join(command), file=sys.stderr)
    # Blender takes the Python that PATH finds first, and its modules: the system's are those that it was built with.
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PATH": "/usr/bin:/bin"})
    if done.returncode:
        raise SystemExit(f"race: {command[0]} failed:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.stdout


def compare(a, x, r):
    out = json.loads(run([f"{a.bin}/lumend", "compare", x, r, "--metric", "smape,relmse,blocks"]))
    return {"smape": out["smape"], "relmse": out["relmse"], "blocks": out["blocks"]}


def lumend(a, model, camera, method, spp, seed, size, out):
    stats = out + ".json"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    camera_id = os.path.splitext(os.path.basename(model))[0] + "/" + camera
    run([f"{a.bin}/lumend", "render", "--scene", model, "--camera", camera_id, "--method", method, "--spp", str(spp), "--seed",
         str(seed), "--size", size, "--stats", stats, "--out", out])
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    with open(stats, encoding="utf-8") as f:
        frame = json.load(f)["frames"][0]
    return {"cpu_s": frame["cpu_ms"] * 1e-3, "wall_s": frame["ms"] * 1e-3,
            "process_cpu_s": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime}


def cycles(a, model, camera, exposure, seed, samples, out):
    os.makedirs(out, exist_ok=True)
    run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
         os.path.join(here, "cycles_model.py"), "--", model, camera, out, a.size, repr(exposure), str(seed)] +
        [str(n) for n in samples])
    with open(os.path.join(out, "cycles.json"), encoding="utf-8") as f:
        return json.load(f)


def time_at(points, error):
    """CPU seconds on the line through the points, on logarithmic paper. None: none of them comes down to it."""
    best = sorted(points, key=lambda p: p["cpu_s"])
    for i, p in enumerate(best):
        if p["smape"] <= error:
            if i == 0:
                return p["cpu_s"]
            q = best[i - 1]
            share = math.log(q["smape"] / error) / math.log(q["smape"] / p["smape"])
            return q["cpu_s"] * (p["cpu_s"] / q["cpu_s"]) ** share
    return None


def race(a, name, camera):
    model = os.path.join(a.models, name)
    out = os.path.join(a.out, os.path.splitext(os.path.basename(name))[0])
    os.makedirs(out, exist_ok=True)
    path = lambda n: os.path.join(out, n)
    result = {"model": name, "camera": camera, "size": a.size}

    result["lumend_scene_cpu_s"] = lumend(a, model, camera, "path", 1, 1, "1x1", path("one.exr"))["process_cpu_s"]
    lumend(a, model, camera, "path", a.reference_spp, 1000003, a.size, path("lumend-reference.exr"))
    for method, samples in (("path", PATH_SPP), ("live", LIVE_SPP)):
        points = []
        for spp in samples:
            p = lumend(a, model, camera, method, spp, 1, a.size, path(f"{method}-{spp}.exr"))
            points.append({"spp": spp, **p, **compare(a, path(f"{method}-{spp}.exr"), path("lumend-reference.exr"))})
        result[method] = points

    cycles(a, model, camera, 1.0, 7, [64], path("scale"))
    unit = compare(a, path("lumend-reference.exr"), path("scale/cycles-64.exr"))["blocks"]["mean"]
    cycles(a, model, camera, unit, 1000003, [a.reference_spp], path("reference"))
    reference = path(f"reference/cycles-{a.reference_spp}.exr")
    made = cycles(a, model, camera, unit, 1, CYCLES_SPP, path("cycles"))
    result["blender"] = made["blender"]
    result["cycles_scene_cpu_s"] = made["pixel"]["cpu_s"]
    result["cycles"] = [{"spp": spp, "cpu_s": made["renders"][str(spp)]["cpu_s"] - made["pixel"]["cpu_s"],
                         "wall_s": made["renders"][str(spp)]["wall_s"] - made["pixel"]["wall_s"],
                         **compare(a, path(f"cycles/cycles-{spp}.exr"), reference)} for spp in CYCLES_SPP]
    result["apart"] = {"unit": unit, **compare(a, path("lumend-reference.exr"), reference)}

    equal = next(p for p in result["cycles"] if p["spp"] == EQUAL_SPP)
    result["equal"] = {"smape": equal["smape"], "cycles_cpu_s": equal["cpu_s"], "path_cpu_s": time_at(result["path"], equal["smape"]),
                       "live_cpu_s": time_at(result["live"], equal["smape"])}
    return result


def table(results):
    lines = ["| model | first picture: Cycles, CPU s, SMAPE | `live` | SMAPE of Cycles with 64 samples | CPU s to it: Cycles | `path` | `live` | "
             "blocks of the converged pictures, lumend over Cycles, 5 .. 95 % |", "|---|---|---|---|---|---|---|---|"]
    known = lambda v: "" if v is None else f"{v:.2f}"
    for r in results:
        c, l, e, b = r["cycles"][0], r["live"][0], r["equal"], r["apart"]["blocks"]
        lines.append(f"| {r['model']} ({r['camera']}) | {c['cpu_s']:.2f}, {c['smape']:.3f} | {l['cpu_s']:.2f}, {l['smape']:.3f} | {e['smape']:.3f} | "
                     f"{e['cycles_cpu_s']:.2f} | {known(e['path_cpu_s'])} | {known(e['live_cpu_s'])} | {b['p5']:.2f} .. {b['p95']:.2f} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=os.path.join(top, "build/release/bin"))
    parser.add_argument("--models", default=os.path.join(top, "../shared/scenes"))
    parser.add_argument("--model", action="append", metavar="PATH:CAMERA")
    parser.add_argument("--size", default="300x200")
    parser.add_argument("--reference-spp", type=int, default=1024)
    parser.add_argument("--out", required=True)
    a = parser.parse_args()
    results = []
    for model in a.model or MODELS:
        name, camera = model.rsplit(":", 1)
        if not os.path.exists(os.path.join(a.models, name)):
            print(f"skipped: no {os.path.join(a.models, name)}")
            continue
        results.append(race(a, name, camera))
        with open(os.path.join(a.out, "race.json"), "w", encoding="utf-8") as f:
            json.dump(results, f, indent=1)
        with open(os.path.join(a.out, "race.md"), "w", encoding="utf-8") as f:
            f.write(table(results))
    print(table(results), end="")


if __name__ == "__main__":
    main()
