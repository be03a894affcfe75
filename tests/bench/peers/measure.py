#!/usr/bin/env python3
"""Compares `lumend measure` with an independent renderer, Blender's Cycles, on a model that neither was made for. Run by hand: minutes.

usage: tests/bench/peers/measure.py [--bin build/release/bin] [--model ../shared/scenes/interiors/conf_lbl_mgf.glb] [--height 1.2]
                                    [--area X0,Z0,X1,Z1] [--spacing 0.5] [--spp 1024] --out DIR

Needs Debian's package blender. lumend path traces illuminance at points; Cycles a picture of a white card there, which only its
camera sees (cycles_model.py): each pixel is the mean of the cell around a point. Prints JSON: the mean of both, their ratio, how
far points are off (median, 95th percentile of the ratio's distance from 1: a point is no mean of its cell, above all beside walls), and the error that lumend tells. Exit status 1 where the
means differ by more than 5 %.
"""
import argparse
import json
import math
import os
import subprocess
import sys

here = os.path.dirname(os.path.abspath(__file__))
top = os.path.normpath(os.path.join(here, "../../.."))
sys.path.insert(0, os.path.join(top, "tests/support"))
from exr import Exr  # noqa: E402


def run(command):
    print("+", " ".join(command), file=sys.stderr)
    # Blender takes the Python that PATH finds first, and its modules: the system's are those that it was built with.
    done = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, "PATH": "/usr/bin:/bin"})
    if done.returncode:
        raise SystemExit(f"measure: {command[0]} failed:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=os.path.join(top, "build/release/bin"))
    parser.add_argument("--model", default=os.path.join(top, "../shared/scenes/interiors/conf_lbl_mgf.glb"))
    parser.add_argument("--height", default="1.2")
    parser.add_argument("--area")
    parser.add_argument("--spacing", default="0.5")
    parser.add_argument("--spp", default="1024")
    parser.add_argument("--out", required=True)
    a = parser.parse_args()
    os.makedirs(a.out, exist_ok=True)
    ours = os.path.join(a.out, "measure.json")
    run([f"{a.bin}/lumend", "measure", "--scene", a.model, "--height", a.height, "--spacing", a.spacing, "--json", ours,
         *(["--area", a.area] if a.area else [])])
    with open(ours, encoding="utf-8") as f:
        told = json.load(f)
    points, nu, nv = told["points"], told["nu"], told["nv"]
    (x0, y, z0), (x1, _, z1) = points[0]["point"], points[-1]["point"]
    hx, hz = abs(x1 - x0) / (nu - 1) / 2, abs(z1 - z0) / (nv - 1) / 2
    card = [min(x0, x1) - hx, y, min(z0, z1) - hz, max(x0, x1) + hx, max(z0, z1) + hz]
    run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python", os.path.join(here, "cycles_model.py"), "--",
         a.model, "card:" + ",".join(f"{v:.6f}" for v in card), a.out, f"{nu}x{nv}", "1", "1", a.spp])
    rows = Exr(os.path.join(a.out, f"cycles-{a.spp}.exr")).rows()
    ratios, sums = [], [0.0, 0.0]
    for p in points:
        if p.get("lx") is None:
            continue
        x, _, z = p["point"]
        row = rows[min(int((z - card[2]) / (2 * hz)), nv - 1)]
        i = min(int((x - card[0]) / (2 * hx)), nu - 1)
        r, g, b = (next(row[name][i] for name in row if name.split(".")[-1] == c) for c in "RGB")
        theirs = math.pi * (0.2126 * r + 0.7152 * g + 0.0722 * b)
        sums[0] += p["lx"]
        sums[1] += theirs
        ratios.append(p["lx"] / theirs if theirs > 0 else math.inf)
    off = sorted(abs(r - 1) for r in ratios)
    n = len(ratios)
    print(json.dumps({"model": os.path.basename(a.model), "points": n, "lumend_lx": round(sums[0] / n, 1), "cycles_lx": round(sums[1] / n, 1),
                      "ratio": round(sums[0] / sums[1], 4), "points_off": {"median": round(off[n // 2], 4), "p95": round(off[int(0.95 * n)], 4)},
                      "em_stderr": round(told["em_stderr_lx"] / told["em_lx"], 4)}))
    return 0 if abs(sums[0] / sums[1] - 1) <= 0.05 else 1


if __name__ == "__main__":
    sys.exit(main())
