#!/usr/bin/env python3
"""Compares `path` with an independent renderer, Blender's Cycles, on the same scene. Run by hand: minutes.

usage: tests/bench/peers/compare.py [--bin build/release/bin] [--scene cornell] [--size 300x200] [--spp 4096] --out DIR

Needs Debian's package blender. Geometry goes over as OBJ (lumend-bench export), materials and lights from the scene's
own file; only diffuse materials and area, sphere and disc lights have an equal in both renderers, others are refused.
Prints lumend compare's JSON; exit 0 when relMSE < 1e-3.
"""
import argparse
import json
import os
import subprocess
import sys

here = os.path.dirname(os.path.abspath(__file__))
top = os.path.normpath(os.path.join(here, "../../.."))


def run(command):
    print("+", " ".join(command), file=sys.stderr)
    subprocess.run(command, check=True, stdout=sys.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=os.path.join(top, "build/release/bin"))
    parser.add_argument("--scene", default="cornell")
    parser.add_argument("--size", default="300x200")
    parser.add_argument("--spp", type=int, default=4096)
    parser.add_argument("--out", required=True)
    a = parser.parse_args()
    os.makedirs(a.out, exist_ok=True)
    ours, theirs, edits = (os.path.join(a.out, n) for n in ("lumend.exr", "cycles.exr", "edits.jsonl"))
    with open(edits, "w", encoding="utf-8") as f:
        f.write('{"lumend":1,"kind":"scene"}\n{"op":"set","id":"render","path":"/max_depth","value":32}\n')
    run([f"{a.bin}/lumend", "render", "--scene", a.scene, "--edits", edits, "--method", "path", "--size", a.size, "--spp", str(a.spp),
         "--out", ours])
    run([f"{a.bin}/lumend-bench", "export", "--scene", a.scene, "--out", a.out])
    run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
         os.path.join(here, "cycles_scene.py"), "--", os.path.join(top, "server/scenes", a.scene + ".jsonl"),
         os.path.join(a.out, "scene.obj"), theirs, a.size, str(a.spp)])
    out = subprocess.run([f"{a.bin}/lumend", "compare", ours, theirs, "--metric", "relmse,rmse,smape", "--heatmap",
                          os.path.join(a.out, "difference.png")], check=True, capture_output=True, text=True)
    print(out.stdout, end="")
    return 0 if json.loads(out.stdout)["relmse"] < 1e-3 else 1


if __name__ == "__main__":
    sys.exit(main())
