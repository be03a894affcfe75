"""Tells what a change did to pictures: renders every built-in scene, by every method, at rest and through its edits, with one thread
and with three, and writes a hash of each picture's pixels; or compares with hashes written before.

usage: pictures.py LUMEND --write FILE | --compare FILE  [--only TEXT]

Hashes hold for one machine and one compiler. Exit status 1: some differ, by name."""
import argparse
import hashlib
import os
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "support"))
from exr import Exr  # noqa: E402
from renders import listed, render  # noqa: E402

SIZE, SAMPLES, FRAMES = "96x64", "3", "4"


def hash_of(lumend, folder, scene, method, threads, edits):
    """Of all frames of one run."""
    more = ["--edits", edits, "--frames", FRAMES, "--spp", "1"] if edits else ["--spp", SAMPLES]
    render(lumend, (scene, method), SIZE, threads, os.path.join(folder, "%04d.exr" if edits else "one.exr"), more)
    digest = hashlib.sha256()
    for name in sorted(os.listdir(folder)):
        digest.update(Exr(os.path.join(folder, name)).block_bytes())
        os.remove(os.path.join(folder, name))
    return digest.hexdigest()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lumend")
    parser.add_argument("--write", metavar="FILE")
    parser.add_argument("--compare", metavar="FILE")
    parser.add_argument("--only", metavar="TEXT", default="", help="cases that have it in their name, like desk or :live")
    options = parser.parse_args()
    if bool(options.write) == bool(options.compare):
        parser.error("either --write or --compare")
    names, methods = listed(options.lumend, "scenes"), listed(options.lumend, "methods")
    cases = [(scene, method, edits) for scene in names if not scene.endswith("-moves") for method in methods
             for edits in ([None, scene + "-moves"] if scene + "-moves" in names else [None])]
    before = {}
    if options.compare:
        with open(options.compare, encoding="utf-8") as file:
            before = dict(line.split() for line in file)
    now, differing = {}, 0
    with tempfile.TemporaryDirectory() as folder:
        for scene, method, edits in cases:
            case = f"{edits or scene}:{method}"
            if options.only not in case:
                continue
            one, three = (hash_of(options.lumend, folder, scene, method, n, edits) for n in (1, 3))
            now[case] = one
            told = "" if one == three else "differs with the number of threads"
            if options.compare and before.get(case) != one:
                told = "differs" if case in before else "was not there before"
            differing += bool(told)
            print(f"{case}: {told or 'ok'}", flush=True)
    if options.write:
        with open(options.write, "w", encoding="utf-8") as file:
            file.writelines(f"{case} {digest}\n" for case, digest in now.items())
    print(f"{len(now)} cases, {differing} differ")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
