#!/usr/bin/env python3
"""Writes the built-in scenes and replays beside this file.   usage: generate.py [OUT_DIR] [NAME...]

Metres, Y up, photometric units. Everything is deterministic: a test compares the committed files with a fresh run.
"""
import os
import sys

sys.dont_write_bytecode = True  # beside the sources, in every build
from generator import conference, cornell, desk, many_lights, office, shirley6, sibenik, sponza  # noqa: E402

SCENES = {
    "conference": conference.conference,
    "cornell": cornell.cornell,
    "cornell-indirect": cornell.cornell_indirect,
    "cornell-media": cornell.cornell_media,
    "cornell-turn": cornell.cornell_turn,
    "desk": desk.desk_scene,
    "furnace": cornell.furnace,
    "many-lights": many_lights.many_lights,
    "office": office.office,
    "office-media": office.office_media,
    "shirley6": shirley6.shirley6,
    "sibenik": sibenik.sibenik,
    "sponza": sponza.sponza,
}


def main(out=os.path.dirname(os.path.abspath(__file__)), *names):
    for name in names or SCENES:
        with open(os.path.join(out, name + ".jsonl"), "w", encoding="utf-8") as f:
            f.write(SCENES[name]().text())


if __name__ == "__main__":
    main(*sys.argv[1:])
