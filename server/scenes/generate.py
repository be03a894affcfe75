#!/usr/bin/env python3
"""Writes the built-in scenes and replays beside this file.   usage: generate.py [OUT_DIR] [NAME...]

Metres, Y up, photometric units. Everything is deterministic: a test compares the committed files with a fresh run.
"""
import os
import sys

sys.dont_write_bytecode = True  # beside the sources, in every build
from generator import bunnies, conference, cornell, desk, many_lights, moves, office, shirley6, sibenik, sponza  # noqa: E402

SCENES = {
    "bunnies-1": lambda: bunnies.bunnies(1),
    "bunnies-2": lambda: bunnies.bunnies(2),
    "bunnies-4": lambda: bunnies.bunnies(4),
    "bunnies-9": lambda: bunnies.bunnies(9),
    "conference": conference.conference,
    "cornell": cornell.cornell,
    "cornell-indirect": cornell.cornell_indirect,
    "cornell-media": cornell.cornell_media,
    "desk": desk.desk_scene,
    "furnace": cornell.furnace,
    "many-lights": many_lights.many_lights,
    "office": office.office,
    "office-media": office.office_media,
    "shirley6": shirley6.shirley6,
    "sibenik": sibenik.sibenik,
    "sponza": sponza.sponza,
    "wobble": cornell.wobble,
}
# NAME-moves: the replay of NAME
REPLAYS = {
    "bunnies-1-moves": lambda: moves.bunnies(1),
    "bunnies-2-moves": lambda: moves.bunnies(2),
    "bunnies-4-moves": lambda: moves.bunnies(4),
    "bunnies-9-moves": lambda: moves.bunnies(9),
    "conference-moves": moves.conference,
    "cornell-moves": moves.cornell,
    "desk-moves": moves.desk,
    "sibenik-moves": moves.sibenik,
    "wobble-moves": moves.wobble,
}


def main(out=os.path.dirname(os.path.abspath(__file__)), *names):
    files = {**SCENES, **REPLAYS}
    for name in names or files:
        with open(os.path.join(out, name + ".jsonl"), "w", encoding="utf-8") as f:
            f.write(files[name]().text())


if __name__ == "__main__":
    main(*sys.argv[1:])
