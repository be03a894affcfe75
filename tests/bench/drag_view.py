#!/usr/bin/env python3
"""The eye is dragged through a scene: does a view with a budget of time keep its frame time?

usage: LUMEND=build/release/bin/lumend tests/bench/drag_view.py [--scene cornell] [--size 600x400] [--seconds 10]
           [--times 30,60,120,240] [--method live] [--rate 60] [--threads 0]

For each budget `{time_ms}` the eye swings about what it looks at, --rate times a second. Prints a row of each: frames, the
median of what a picture's first pass took over the budget, the share of them that took no more than 1.2 of it, the same
two by CPU time of the workers over their number, of how many pixels a side its blocks were (median), and the time from
frame to frame. A budget that is longer than a whole picture takes is met by a whole one, in less time. What the choice is
worth without a clock that others share is measured by lumend-bench drag.
"""
import argparse
import math
import os
import statistics
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "e2e"), os.path.join(HERE, "..", "..", "clients", "python")]
import lumend  # noqa: E402
from daemon import Daemon  # noqa: E402

WARM_S = 3.0  # not counted: a view learns first what passes take
SWING_RAD = 0.15
SWING_M = 0.25  # no farther: behind a wall there is nothing to be seen, in no time


class Watched(lumend.Session):
    """Keeps what it hears of frames, and when."""

    def __init__(self, url):
        self.heard = []
        super().__init__(url)

    def _take_text(self, message):
        if message.get("method") == "frame.stats":
            self.heard.append((time.monotonic(), message["params"]))
        super()._take_text(message)


def swung(camera, swing):
    (px, py, pz), (tx, ty, tz) = camera["position"], camera["target"]
    x, z = px - tx, pz - tz
    angle = swing * min(SWING_RAD, SWING_M / max(math.hypot(x, z), SWING_M))
    sin, cos = math.sin(angle), math.cos(angle)
    eye = {"position": [tx + cos * x - sin * z, py, tz + sin * x + cos * z], "target": [tx, ty, tz]}
    return {**eye, **{k: camera[k] for k in ("up", "vfov_deg") if camera.get(k) is not None}}


def drag(view, camera, seconds, rate):
    begin, n = time.monotonic(), 0
    while time.monotonic() < begin + seconds:
        view.update(camera=swung(camera, math.sin(0.05 * n)))
        n += 1
        time.sleep(max(0.0, begin + n / rate - time.monotonic()))


def measure(session, camera, time_ms, o):
    w, h = map(int, o.size.split("x"))
    with session.view(w, h, method=o.method, budget={"time_ms": time_ms}) as view:
        view.picture(converged=False)
        drag(view, camera, WARM_S, o.rate)
        begin = time.monotonic()
        drag(view, camera, o.seconds, o.rate)
    frames = [(at, stats) for at, stats in list(session.heard)
              if at >= begin and stats["view_id"] == view.view_id and stats["budget_chose"]]
    first = [(at, s) for (at, s), (_, before) in zip(frames[1:], frames) if s["camera_seq"] != before["camera_seq"]]
    over = [s["ms"] / time_ms for _, s in first]
    workers = o.threads or os.cpu_count()
    own = [s["cpu_ms"] / workers / time_ms for _, s in first]
    gaps = [1e3 * (b - a) for (a, _), (b, _) in zip(first, first[1:])]
    if not gaps:
        return f"| {time_ms} | {len(first)} | | | | | | |"
    return (f"| {time_ms} | {len(first)} | {statistics.median(over):.2f} | {sum(x <= 1.2 for x in over) / len(over):.2f} | "
            f"{statistics.median(own):.2f} | {sum(x <= 1.2 for x in own) / len(own):.2f} | "
            f"{statistics.median(s['budget_chose']['blocks'] for _, s in first):g} | {statistics.median(gaps):.0f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", default="cornell")
    parser.add_argument("--size", default="600x400")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--times", default="30,60,120,240", metavar="MS,MS")
    parser.add_argument("--method", default="live")
    parser.add_argument("--rate", type=float, default=60, metavar="PER_S")
    parser.add_argument("--threads", type=int, default=0)
    o = parser.parse_args()
    print("| budget, ms | frames | took / budget | within 1.2 | CPU time / budget | within 1.2 | blocks | "
          "ms from frame to frame |\n|---|---|---|---|---|---|---|---|")
    with Daemon(scene=o.scene, threads=o.threads) as daemon:
        with Watched(f"http://{daemon.host}:{daemon.port}/#t={daemon.token}") as session:
            camera = next(r for r in session.scene().values() if r["type"] == "camera")
            for time_ms in map(float, o.times.split(",")):
                print(measure(session, camera, time_ms, o), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
