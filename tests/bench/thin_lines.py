#!/usr/bin/env python3
"""Frames a second over thin lines, with and without WebP and VP9, of a picture that changes; and how soon the one at rest is exact.

LUMEND=build/release/bin/lumend python3 tests/bench/thin_lines.py [--scene S] [--size WxH] [--seconds S] [RATE ...]

RATE is in Mbit/s. For each clients that read neither, WebP, and both take turns on a line of their own (tests/e2e/thin_line.py).
--turn: the eye turns, by so many degrees a frame, as the camera called --camera (the scene's first) has it. Without it the
light's colour changes, for which no scene needs a path for the eye."""
import argparse
import math
import pathlib
import statistics
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
from daemon import Daemon  # noqa: E402
from thin_line import ThinLine  # noqa: E402
from wsclient import CONVERGED, LAST_TILE, WebSocket, tile_header  # noqa: E402

CODECS = {0: "rgba8", 1: "jpeg", 2: "png", 3: "webp", 5: "vp9"}
READS = {"JPEG, PNG": None, "WebP": ["webp"], "WebP, VP9": ["webp", "vp9"]}


SWEEP = 30  # frames that the eye turns one way


def turned(camera, degrees):
    """The camera, turned about the axis that its up is nearest to."""
    position, target, up = camera["position"], camera["target"], camera.get("up", [0, 1, 0])
    axis = max(range(3), key=lambda i: abs(up[i]))
    a, b = (i for i in range(3) if i != axis)
    ahead = [t - p for t, p in zip(target, position)]
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    ahead[a], ahead[b] = c * ahead[a] - s * ahead[b], s * ahead[a] + c * ahead[b]
    return {"position": position, "target": [p + d for p, d in zip(position, ahead)], "up": up,
            "vfov_deg": camera.get("vfov_deg", 45)}


def camera_of(daemon, name):
    """The scene's first whose id ends so, once its models are there."""
    ws = daemon.connect()
    for _ in range(120):
        ops = ws.call("scene.get", {"expand": True})["ops"]
        found = [op for op in ops if op.get("type") == "camera" and op["id"].endswith(name)]
        if found:
            ws.close()
            return found[0]
        time.sleep(1)
    sys.exit(f"there is no camera {name}")


class Eye:
    def __init__(self, port, token, options, codecs, camera):
        self.ws = WebSocket(port)
        self.ws.hello(token)
        self.seq, self.turn_deg, self.camera = 0, options.turn, camera
        self.sent_s = {}
        self.id = self.ws.call("view.open", {"size": options.size, "codec": "jpeg", "quality": 85, "method": "live", "codecs": codecs,
                                             "budget": {"error": 10}, "camera": turned(camera, 0)})["view_id"]

    def move(self):
        """The light of the picture changes, and with it every tile; or the eye turns to and fro."""
        self.seq += 1
        self.sent_s[self.seq] = time.monotonic()
        way = SWEEP - abs(self.seq % (2 * SWEEP) - SWEEP)
        change = {"camera": turned(self.camera, self.turn_deg * way)} if self.turn_deg else {"white_balance_k": 5000 + 40 * (self.seq % 50)}
        self.ws.notify("view.update", {"view_id": self.id, **change, "camera_seq": self.seq})

    def frame(self):
        n_bytes = 0
        while True:
            while not self.ws.binaries:
                self.ws.pump()
            message = self.ws.binaries.pop(0)
            header, n_bytes = tile_header(message), n_bytes + len(message)
            if header["flags"] & LAST_TILE:
                self.ws.notify("frame.ack", {"view_id": self.id, "frame_seq": header["frame_seq"]})
                return header, n_bytes


def measure(daemon, rate, codecs, options, camera):
    """Frames a second, median latency in ms, bytes of a frame, its coding, and seconds and bytes until the exact picture."""
    with ThinLine(daemon.port, rate * 125_000) as line:
        eye = Eye(line.port, daemon.token, options, codecs, camera)
        eye.frame()
        latencies, frames = [], []
        warm_s = time.monotonic() + options.seconds / 2
        end_s = warm_s + options.seconds
        while (now_s := time.monotonic()) < end_s or len(frames) < 3:
            eye.move()
            header, n_bytes = eye.frame()
            if now_s > warm_s:
                frames.append((n_bytes, CODECS[header["codec"]], header["quality"]))
                if header["camera_seq"]:
                    latencies.append(time.monotonic() - eye.sent_s[header["camera_seq"]])
        rest_s, rest_bytes = time.monotonic(), 0
        eye.move()
        while True:
            header, n_bytes = eye.frame()
            rest_bytes += n_bytes
            if header["flags"] & CONVERGED and header["camera_seq"] == eye.seq:
                break
        codec = statistics.mode(f[1] for f in frames)
        quality = statistics.median_low([f[2] for f in frames if f[1] == codec])
        return (len(frames) / options.seconds, 1000 * statistics.median(latencies), statistics.median(f[0] for f in frames),
                f"{codec} {quality}", time.monotonic() - rest_s, rest_bytes)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scene", default="office")
    parser.add_argument("--size", default="760x520", type=lambda s: [int(n) for n in s.split("x")])
    parser.add_argument("--seconds", default=10.0, type=float)
    parser.add_argument("--camera", default="")
    parser.add_argument("--turn", default=0.0, type=float)
    parser.add_argument("rates", nargs="*", type=float, default=[1.0, 4.0, 16.0, 100.0])
    options = parser.parse_args()
    print("| Mbit/s | reads | frames/s | latency, ms | bytes/frame | coding | exact after, s | bytes of that |")
    print("|-------:|-------|---------:|------------:|------------:|--------|---------------:|--------------:|")
    with Daemon("--scene", options.scene, threads=2) as daemon:
        camera = camera_of(daemon, options.camera)
        for rate in options.rates:
            for reads, codecs in READS.items():
                fps, ms, n_bytes, coding, rest_s, rest_bytes = measure(daemon, rate, codecs, options, camera)
                print(f"| {rate:g} | {reads} | {fps:.1f} | {ms:.0f} | {n_bytes:.0f} | {coding} "
                      f"| {rest_s:.1f} | {rest_bytes} |", flush=True)
        daemon.assert_well()


if __name__ == "__main__":
    main()
