"""Compares the pictures of every built-in scene by every method with those that were right: by the mean colour of blocks of 25 x 25
pixels, in cd/m2. Those of some scenes are rendered with one thread and with three, which must agree bit for bit.

usage: golden.py LUMEND [--only TEXT] [--write | --faults]

--only: cases that have TEXT in their name, like desk: or :live. --write: what is rendered now is right; look at the pictures first.
--faults: whether faults that are made on purpose are found."""
import argparse
import concurrent.futures
import json
import os
import shlex
import sys
import tempfile

here = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(here, "..", "support"))
from exr import Exr  # noqa: E402
from renders import listed, render, render_command  # noqa: E402

GOLDEN = os.path.join(here, "golden.txt")
SIZE, SIDE, ACROSS, DOWN = "150x100", 25, 6, 4
SAMPLES = {"path": 16, "live": 4}  # of live: its fast frame, and three that refine it; of the others: the frame
COARSE = {"irrcache": ["--cache-accuracy", "0.5"]}  # in less than half the time
# A thousand lights, 16 rays to each for every pixel: half a minute. With one ray each, two seconds.
FEW_SHADOW_RAYS = [("many-lights", "whitted")]
ONE_RAY = '{"lumend":1,"kind":"scene"}\n{"op":"set","id":"render","path":"/shadow_samples","value":1}\n'
# As long as fifty other pictures together: half a minute. `ais` is left to stand for it, and other scenes have it.
LEFT_OUT = [("many-lights", "ais-max")]
# Fog, mirrors, gloss, glass, sun and area lights are in these; that of all others would double the time.
ON_ONE_THREAD_TOO = ["bunnies-1", "cornell-media", "desk", "office"]

# How far a block may be off, in terms of t = |now - golden| / (golden + mean of the picture), for each colour.
#
# Random numbers are the same each time. But kernels of other instruction sets round differently, so that here and there a ray meets
# something else, and a path or a virtual point light goes another way: it is exchanged for one as good. If a share f of what a block sums
# is exchanged, the block moves by sqrt(f) times what it moves by when all is exchanged, which other seeds show: that is the noise of
# a picture, measured by --write as the largest t of all blocks and of SEEDS, and stored. So the bound is noise * sqrt(f).
#   path: what samples learn of where light comes from guides all later ones, so that one exchange moves all: f = 1.
#   live: the same is true of its samples, but what they correct is a part of its picture: f = 1/4.
#   others: nothing is learned. One virtual point light of 256 is f = 1/256, four are 1/64; of rays of pixels fewer are exchanged.
# Measured over all pictures with sse4.2, avx2 and avx512, the largest t, less EDGES, over noise: 0.25 of path (cornell-indirect; of 64
# samples 0.67), 0.06 of live and of others (office-media, cornell-media).
EXCHANGED = {"path": 1, "live": 1 / 4}
EXCHANGED_ELSE = 1 / 64
SEEDS = [1, 2, 3, 4]
# Where there is no noise, pixels at an edge may fall to its other side: two of a block, each by as much as block and picture have.
EDGES = 2 / SIDE**2
# Of a number that is stored: half a unit of the fourth digit.
DIGITS = 0.5e-3

# Each must be found. An op of the scene, or options.
FAULTS = [
    (("cornell", "path"), {"id": "ceiling-panel", "path": "/flux_lm", "value": 1.03 * 11000}),
    (("shirley6", "irrcache"), {"id": "luminaire", "path": "/flux_lm", "value": 0.97 * 8000}),
    (("sponza", "whitted"), {"id": "sun", "path": "/illuminance_lx", "value": 1.03 * 70000}),
    (("sibenik", "whitted"), {"id": "rose-glass", "path": "/emission_texture/scale", "value": [2, 2]}),
    (("cornell", "tic"), ["--effects-off", "indirect_diffuse"]),
    (("sponza", "ais"), ["--effects-off", "indirect_diffuse"]),
    (("office", "irrcache"), ["--effects-off", "reflection"]),
    (("office-media", "ais"), ["--effects-off", "media"]),
    (("desk", "live"), ["--effects-off", "glossy"]),
]


def tolerance(case, noise):
    return noise * EXCHANGED.get(case[1], EXCHANGED_ELSE)**0.5 + EDGES + DIGITS


def options_of(case, few_rays):
    edits = ["--edits", few_rays] if case in FEW_SHADOW_RAYS else []
    return ["--spp", str(SAMPLES.get(case[1], 1)), *COARSE.get(case[1], []), *edits]


def blocks_of(picture):
    """(r, g, b) of each block, row by row."""
    rows, blocks = picture.rows(), []
    for y in range(0, DOWN * SIDE, SIDE):
        for x in range(0, ACROSS * SIDE, SIDE):
            blocks.append(tuple(sum(sum(row[c][x:x + SIDE]) for row in rows[y:y + SIDE]) / SIDE**2 for c in "RGB"))
    return blocks


def off_by(now, golden):
    """The t of each block, by its worst colour."""
    mean = [sum(block[c] for block in golden) / len(golden) for c in range(3)]
    return [max(abs(a[c] - b[c]) / max(b[c] + mean[c], 1e-30) for c in range(3)) for a, b in zip(now, golden)]


def read_golden():
    with open(GOLDEN, encoding="utf-8") as file:
        for line in file:
            name, noise, *values = line.split()
            values = [float(v) for v in values]
            yield name, (float(noise), [tuple(values[i:i + 3]) for i in range(0, len(values), 3)])


class Tester:
    def __init__(self, lumend, folder):
        self.lumend, self.folder, self.few_rays = lumend, folder, os.path.join(folder, "one-ray.jsonl")
        with open(self.few_rays, "w", encoding="utf-8") as file:
            file.write(ONE_RAY)

    def picture(self, case, threads, more=()):
        out = os.path.join(self.folder, f"{case[0]}-{case[1]}-{threads}-{abs(hash(tuple(more)))}.exr")
        render(self.lumend, case, SIZE, threads, out, [*options_of(case, self.few_rays), *more])
        picture = Exr(out)
        os.remove(out)
        return picture

    def faulty(self, case, fault):
        if isinstance(fault, list):
            return self.picture(case, 3, fault)
        edit = os.path.join(self.folder, "fault.jsonl")
        with open(edit, "w", encoding="utf-8") as file:
            file.write('{"lumend":1,"kind":"scene"}\n' + json.dumps({"op": "set", **fault}) + "\n")
        return self.picture(case, 3, ["--edits", edit])

    def line(self, case):
        """Of the file of what is right."""
        blocks = blocks_of(self.picture(case, 1))
        noise = max(max(off_by(blocks_of(self.picture(case, 1, ["--seed", str(seed)])), blocks)) for seed in SEEDS)
        return " ".join([":".join(case), f"{noise:.4f}", *(f"{v:.4g}" for block in blocks for v in block)])

    def compare(self, case, noise, golden):
        """What is wrong, line by line."""
        picture = self.picture(case, 3)
        now, wrong = blocks_of(picture), []
        if case[0] in ON_ONE_THREAD_TOO and self.picture(case, 1).block_bytes() != picture.block_bytes():
            wrong.append("one thread and three do not make the same picture")
        t, most = off_by(now, golden), tolerance(case, noise)
        off = [i for i in range(len(golden)) if not t[i] <= most]
        off.sort(key=lambda i: -t[i])
        for i in off[:3]:
            told = ["(" + " ".join(f"{v:.4g}" for v in block) + ")" for block in (golden[i], now[i])]
            wrong.append(f"block in column {i % ACROSS + 1} of {ACROSS}, row {i // ACROSS + 1} of {DOWN} was {told[0]} cd/m2, is {told[1]}: "
                         f"off by {t[i]:.4f}, {most:.4f} is allowed")
        if off:
            wrong.append(f"{len(off)} of {len(golden)} blocks are off")
            wrong.append("to see it: " + shlex.join(render_command(self.lumend, case, SIZE, 1, "now.png", options_of(case, "one-ray.jsonl"))))
            if case in FEW_SHADOW_RAYS:
                wrong.append(f"one-ray.jsonl: {ONE_RAY!r}")
        return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lumend")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--faults", action="store_true")
    parser.add_argument("--only", metavar="TEXT", default="")
    options = parser.parse_args()
    scenes = [s for s in listed(options.lumend, "scenes") if not s.endswith("-moves")]
    cases = [(scene, method) for scene in scenes for method in listed(options.lumend, "methods")
             if (scene, method) not in LEFT_OUT]
    chosen = [case for case in cases if options.only in ":".join(case)]
    with tempfile.TemporaryDirectory() as folder:
        tester = Tester(options.lumend, folder)
        if options.faults:
            return find_faults(tester)
        return write(tester, cases, chosen) if options.write else compare(tester, cases, chosen)


def write(tester, cases, chosen):
    """Lines of cases that were not chosen stay."""
    lines = {}
    if os.path.exists(GOLDEN):
        with open(GOLDEN, encoding="utf-8") as file:
            lines = {line.split()[0]: line.rstrip("\n") for line in file}
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        lines.update(zip(map(":".join, chosen), pool.map(tester.line, chosen)))
    with open(GOLDEN, "w", encoding="utf-8") as file:
        file.writelines(lines[name] + "\n" for name in map(":".join, cases) if name in lines)
    print(f"{len(chosen)} pictures written")
    return 0


def compare(tester, cases, chosen):
    golden, failed = dict(read_golden()), 0
    for case in chosen:
        name = ":".join(case)
        wrong = tester.compare(case, *golden[name]) if name in golden else ["is not in tests/golden/golden.txt"]
        failed += bool(wrong)
        for line in wrong:
            print(f"{name}: {line}", flush=True)
    for name in sorted(golden.keys() - set(map(":".join, cases))):
        print(f"{name}: is in tests/golden/golden.txt, but not in lumend")
        failed += 1
    print(f"{len(chosen)} pictures, {failed} wrong")
    if failed:
        print(f"again: python3 tests/golden/golden.py {tester.lumend} --only SCENE:METHOD; if the pictures are right: the same with --write")
    return 1 if failed else 0


def find_faults(tester):
    golden, missed = dict(read_golden()), 0
    for case, fault in FAULTS:
        noise, blocks = golden[":".join(case)]
        t, most = max(off_by(blocks_of(tester.faulty(case, fault)), blocks)), tolerance(case, noise)
        missed += not t > most
        print(f"{':'.join(case)} with {fault}: {'found' if t > most else 'NOT FOUND'}: off by {t:.4f}, {most:.4f} is allowed")
    print(f"{len(FAULTS)} faults, {missed} not found")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
