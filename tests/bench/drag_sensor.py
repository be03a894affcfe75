#!/usr/bin/env python3
"""A luminaire of twelve is dragged over a work plane: how often do its values follow, and how late?

usage: LUMEND=build/release/bin/lumend tests/bench/drag_sensor.py [--seconds 10] [--size 600x400] [--edits 60] [--lamps 12]

An office of 9 x 6 x 2.8 m under luminaires with a photometric file (tests/photometry), 54 points, a view of --size that
watches. One lamp is moved --edits times a second. Prints JSON: readings a second, of a newer scene each (`hz`); how long
after the edit that it is of each came (median and 95th percentile of `late_ms`; null: none came). Exit
status 1 below 10 readings a second.
"""
import argparse
import json
import os
import statistics
import sys
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "e2e"), os.path.join(HERE, "..", "..", "clients", "python")]
import lumend  # noqa: E402
from daemon import Daemon  # noqa: E402

EMPTY = os.path.join(HERE, "..", "..", "clients", "python", "examples", "empty.jsonl")
PHOTOMETRY = os.path.join(HERE, "..", "photometry")
LENGTH, WIDTH, HEIGHT, GAP = 9.0, 6.0, 2.8, 0.02
PLACES = [(x, z) for z in (-2, 0, 2) for x in (-3.375, -1.125, 1.125, 3.375)]
WARM_S = 5.0  # not measured: the first picture of a view


def build(edit, n_lamps):
    for name, share in (("ceiling", 0.7), ("wall", 0.5), ("floor", 0.2)):
        edit.add_material(name + "-paint", base_color=[share] * 3, specular=0)
    for name, paint, size, at, turn in (
            ("floor", "floor", [LENGTH, 0, WIDTH], [0, 0, 0], [0, 0, 0]),
            ("ceiling", "ceiling", [LENGTH, 0, WIDTH], [0, HEIGHT, 0], [180, 0, 0]),
            ("back", "wall", [LENGTH, 0, HEIGHT], [0, HEIGHT / 2, -WIDTH / 2], [90, 0, 0]),
            ("front", "wall", [LENGTH, 0, HEIGHT], [0, HEIGHT / 2, WIDTH / 2], [-90, 0, 0]),
            ("left", "wall", [HEIGHT, 0, WIDTH], [-LENGTH / 2, HEIGHT / 2, 0], [0, 0, -90]),
            ("right", "wall", [HEIGHT, 0, WIDTH], [LENGTH / 2, HEIGHT / 2, 0], [0, 0, 90])):
        edit.add_mesh(name + "-mesh", shape="quad", size=size)
        edit.add_object(name, mesh=name + "-mesh", material=paint + "-paint",
                        transform={"translate": at, "rotate_deg": turn})
    for i in range(n_lamps):
        x, z = PLACES[i % len(PLACES)]
        edit.add_light(f"lamp-{i}", kind="ies", asset="linear.ldt", position=[x, HEIGHT - GAP, z], direction=[0, -1, 0])
    edit.add_sensor("work-plane", kind="grid", position=[0, 0.75, 0], u=[LENGTH - 1, 0, 0], v=[0, 0, WIDTH - 1])
    edit.add_camera("main", position=[-3.9, 1.6, 2.4], target=[1, 1.2, -1], vfov_deg=65)


class Readings:
    """Of the sensor, from a thread of their own: when each came, and of which scene."""

    def __init__(self, session):
        self.session, self.all, self.stop, self.fault = session, [], threading.Event(), None
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        try:
            self.read()
        except Exception as fault:  # pylint: disable=broad-except
            self.fault = fault  # for end()

    def read(self):
        newest = 0
        while not self.stop.is_set():
            value = self.session.sensor("work-plane",
                                        enough=lambda value: self.stop.is_set() or value["scene_rev"] > newest)
            if value["scene_rev"] > newest:
                newest = value["scene_rev"]
                self.all.append((time.monotonic(), newest))
            else:
                time.sleep(0.002)  # it is settled: nothing new was done to the scene

    def end(self):
        self.stop.set()
        self.thread.join()
        if self.fault:
            raise self.fault


def drag(session, seconds, rate):
    """When the edit that made each revision was sent."""
    sent, begin, n = {}, time.monotonic(), 0
    while (now := time.monotonic()) < begin + seconds:
        rev = session.apply([{"op": "set", "id": "lamp-0", "path": "/position",
                              "value": [-3.375 + 0.02 * (n % 100), HEIGHT - GAP, -2]}], undo_group="drag")
        sent[rev] = now
        n += 1
        time.sleep(max(0.0, begin + n / rate - time.monotonic()))
    return sent


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--size", default="600x400")
    parser.add_argument("--edits", type=float, default=60, metavar="PER_S")
    parser.add_argument("--lamps", type=int, default=12)
    o = parser.parse_args()
    w, h = map(int, o.size.split("x"))
    with Daemon("--scene", EMPTY, "--assets", PHOTOMETRY, threads=0) as daemon:
        with lumend.connect(f"http://{daemon.host}:{daemon.port}/#t={daemon.token}") as session:
            with session.edit() as edit:
                build(edit, o.lamps)
            with session.view(w, h) as view:
                view.picture(converged=False)
                readings = Readings(session)
                try:
                    drag(session, WARM_S, o.edits)
                    begin = time.monotonic()
                    sent = drag(session, o.seconds, o.edits)
                    end = time.monotonic()
                finally:
                    readings.end()
    came = [(at, rev) for at, rev in readings.all if begin <= at <= end]
    late = sorted(1e3 * (at - sent[rev]) for at, rev in came if rev in sent)
    hz = len(came) / (end - begin)
    print(json.dumps({"hz": round(hz, 1),
                      "late_ms": {"median": round(statistics.median(late)) if late else None,
                                  "p95": round(late[int(0.95 * len(late))]) if late else None},
                      "edits_per_s": round(len(sent) / (end - begin), 1), "lamps": o.lamps, "size": o.size}))
    return 0 if hz >= 10 else 1


if __name__ == "__main__":
    sys.exit(main())
