"""Tells what a change did to pictures: renders every built-in scene, by every method, at rest and through its edits, with one thread
and with three, and writes a hash of each picture's pixels; or compares with hashes written before.

usage: pictures.py LUMEND --write FILE | --compare FILE  [--only TEXT]

Hashes hold for one machine and one compiler. Exit status 1: some differ, by name."""
import argparse
import hashlib
import os
import struct
import subprocess
import sys
import tempfile

SIZE, SAMPLES, FRAMES = "96x64", "3", "4"


def pixels_of(path):
    """The scanline blocks of an EXR file: the header, which has times in it, and the table of offsets left out."""
    with open(path, "rb") as file:
        data = file.read()
    at, window = 8, None
    while data[at]:
        name_end = data.index(0, at)
        type_end = data.index(0, name_end + 1)
        size = struct.unpack_from("<i", data, type_end + 1)[0]
        if data[at:name_end] == b"dataWindow":
            window = struct.unpack_from("<4i", data, type_end + 5)
        at = type_end + 5 + size
    first_block = struct.unpack_from("<Q", data, at + 1)[0]
    assert window and first_block < len(data), path
    return data[first_block:]


def listed(lumend, what):
    lines = subprocess.run([lumend, what], check=True, capture_output=True, text=True).stdout.splitlines()
    return [line.split()[0] for line in lines if line.strip()]


def render(lumend, folder, scene, method, threads, edits):
    """Hash of all frames of one run."""
    command = [lumend, "render", "--scene", scene, "--method", method, "--size", SIZE, "--deterministic",
               "--threads", str(threads), "--out", os.path.join(folder, "%04d.exr" if edits else "one.exr")]
    command += ["--edits", edits, "--frames", FRAMES, "--spp", "1"] if edits else ["--spp", SAMPLES]
    subprocess.run(command, check=True, capture_output=True)
    digest = hashlib.sha256()
    for name in sorted(os.listdir(folder)):
        digest.update(pixels_of(os.path.join(folder, name)))
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
            one, three = (render(options.lumend, folder, scene, method, n, edits) for n in (1, 3))
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
