#!/usr/bin/env python3
"""All lamps of a scene, or of a model, in twenty groups: how many frames a second has a crossfade of them, and how often do the
values of a work plane follow one lamp that is dragged?

usage: LUMEND=build/release/bin/lumend tests/bench/mixing.py [--scene FILE|NAME] [--groups 20] [--seconds 10] [--size 600x400]

Prints JSON: `lamps`; of the crossfade `frames_per_s`, `cpu_ms` of a frame on all threads (median; what others run beside it does
not count), and `rays`, which is 0 but for those of probes that tell the error of pictures; of the drag `hz`, readings a second of a
newer scene each, `cpu_ms`, what the daemon takes for one with the pictures between, and `late_ms`, how long after its edit a reading
came (median and 95th percentile). Exit status 1 below 30 frames or 10 readings a second, or where a ray was traced.
"""
import argparse
import json
import os
import statistics
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "e2e"), os.path.join(HERE, "..", "..", "clients", "python")]
import lumend  # noqa: E402
from daemon import Daemon  # noqa: E402
from drag_sensor import Readings  # noqa: E402

LAMP_KINDS = ("point", "spot", "ies", "quad", "disc", "sphere")


def lamps_of(session):
    """Ids, those that give most light first, and what is set to move one, from where."""
    lamps = {}
    for id, r in session.scene().items():
        if r.get("emits"):
            lamps[id] = (r["emits"]["flux_lm"], "/transform", r["transform"])
        elif r["type"] == "light" and r["kind"] in LAMP_KINDS and r["on"]:
            lamps[id] = (r.get("flux_lm") or r.get("photometry", {}).get("flux_lm") or 0, "/position", r["position"])
    return dict(sorted(lamps.items(), key=lambda item: -item[1][0]))


class Frames:
    """What comes to a connection of its own: frames are acknowledged, and told of."""

    def __init__(self, daemon, w, h):
        self.ws = daemon.connect()
        self.view = self.ws.call("view.open", {"size": [w, h], "method": "live", "spp": 1, "codec": "jpeg"})["view_id"]

    def until(self, done):
        """Statistics of frames until done(frame, fading): of the newest, and whether a crossfade has ended."""
        frames, read, faded = [], 0, False
        while not (frames and done(frames[-1], faded)):
            self.ws.pump()
            for method, params in self.ws.notifications[read:]:
                if method == "frame.stats":
                    frames.append(params)
                    self.ws.notify("frame.ack", {"view_id": self.view, "frame_seq": params["frame_seq"]})
                faded = faded or method == "preset.fading" and params["left_s"] == 0
            read = len(self.ws.notifications)
        self.ws.notifications.clear()
        return frames


def crossfade(daemon, session, lamps, o, size):
    with session.edit() as edit:
        for i, id in enumerate(lamps):
            edit.set(id, group=f"group-{i % o.groups}")
    session.call("preset.store", id="day")
    with session.edit() as edit:
        for id, (flux, _, _) in lamps.items():
            edit.set(id, flux_lm=flux / 10, cct_k=2200)
    session.call("preset.store", id="evening")
    frames = Frames(daemon, *size)
    rev = session.scene_rev
    for look in ("evening", "day"):  # all have shone in both
        frames.until(lambda f, _: f["converged"] and f["scene_rev"] >= rev)
        rev = session.call("preset.recall", id=look)["scene_rev"]
    frames.until(lambda f, _: f["converged"] and f["scene_rev"] >= rev)
    rev = session.call("preset.recall", id="evening", fade_s=o.seconds)["scene_rev"]
    begin = time.monotonic()
    seen = [f for f in frames.until(lambda f, faded: faded) if f["scene_rev"] >= rev]
    took = time.monotonic() - begin
    rays = sum(n for f in seen for kind, n in f["rays"].items() if kind != "probe")
    frames.ws.close()
    cpu_ms = statistics.median(f["cpu_ms"] for f in seen)
    return {"frames_per_s": round(len(seen) / took, 1), "rays": rays, "cpu_ms": round(cpu_ms)}


def cpu_ms_of(process):
    """That it has had, of all threads."""
    with open(f"/proc/{process.pid}/stat", encoding="utf-8") as stat:
        fields = stat.read().rpartition(")")[2].split()
    return 1e3 * (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")  # user and system


def drag(daemon, session, lamps, o, size):
    bounds = [session.call("bounds", id=id) for id, r in session.scene().items() if r["type"] in ("object", "import")]
    low, high = ([pick(b[end][k] for b in bounds) for k in range(3)] for end, pick in (("min", min), ("max", max)))
    middle = [(a + b) / 2 for a, b in zip(low, high)]
    with session.edit() as edit:
        edit.add_sensor("work-plane", kind="grid", position=[middle[0], low[1] + 0.75, middle[2]], u=[(high[0] - low[0]) * 0.6, 0, 0],
                        v=[0, 0, (high[2] - low[2]) * 0.6])
    id, (_, path, at) = next(iter(lamps.items()))
    sent, n = {}, 0
    with session.view(*size) as view:
        view.picture(converged=False)
        readings = Readings(session)
        try:
            begin, cpu_ms = time.monotonic(), cpu_ms_of(daemon.process)
            while (now := time.monotonic()) < begin + o.seconds:
                moved = list(at)
                moved[3 if path == "/transform" else 0] += 0.02 * (n % 50)  # of 16 numbers, row by row, the first row's last
                sent[session.apply([{"op": "set", "id": id, "path": path, "value": moved}], undo_group="drag")] = now
                n += 1
                time.sleep(max(0.0, begin + n / 60 - time.monotonic()))
            end, cpu_ms = time.monotonic(), cpu_ms_of(daemon.process) - cpu_ms
        finally:
            readings.end()
    late = sorted(1e3 * (at - sent[rev]) for at, rev in readings.all if rev in sent)
    n_read = sum(begin <= at <= end for at, _ in readings.all)
    return {"hz": round(n_read / (end - begin), 1), "lamp": id, "cpu_ms": round(cpu_ms / n_read) if n_read else None,
            "late_ms": {"median": round(statistics.median(late)), "p95": round(late[int(0.95 * len(late))])} if late else None}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", default="office")
    parser.add_argument("--groups", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--size", default="600x400")
    o = parser.parse_args()
    size = tuple(map(int, o.size.split("x")))
    with Daemon("--scene", o.scene, threads=0) as daemon:
        with lumend.connect(f"http://{daemon.host}:{daemon.port}/#t={daemon.token}") as session:
            lamps = lamps_of(session)
            result = {"scene": os.path.basename(o.scene), "lamps": len(lamps), "size": o.size,
                      "crossfade": crossfade(daemon, session, lamps, o, size), "drag": drag(daemon, session, lamps, o, size)}
    print(json.dumps(result))
    fade, moved = result["crossfade"], result["drag"]
    return 0 if fade["frames_per_s"] >= 30 and fade["rays"] == 0 and moved["hz"] >= 10 else 1


if __name__ == "__main__":
    sys.exit(main())
