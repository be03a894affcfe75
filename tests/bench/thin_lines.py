#!/usr/bin/env python3
"""Frames a second over thin lines, with and without WebP, of a camera that moves; and how soon the picture at rest is exact.

LUMEND=build/release/bin/lumend python3 tests/bench/thin_lines.py [--scene S] [--size WxH] [--seconds S] [RATE ...]

RATE is in Mbit/s. For each a client that reads WebP and one that does not take turns on a line of its own (tests/e2e/thin_line.py)."""
import argparse
import pathlib
import statistics
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
from daemon import Daemon  # noqa: E402
from thin_line import ThinLine  # noqa: E402
from wsclient import CONVERGED, LAST_TILE, WebSocket, tile_header  # noqa: E402

CODECS = {0: "rgba8", 1: "jpeg", 2: "png", 3: "webp"}


class Eye:
    def __init__(self, port, token, size, codecs):
        self.ws = WebSocket(port)
        self.ws.hello(token)
        self.seq, self.size = 0, size
        self.sent_s = {}
        self.id = self.ws.call("view.open", {"size": size, "codec": "jpeg", "quality": 85, "method": "live", "codecs": codecs,
                                             "budget": {"error": 10}, "camera_id": "main"})["view_id"]

    def move(self):
        """The light of the picture changes, and with it every tile: so that no scene needs a path for the eye."""
        self.seq += 1
        self.sent_s[self.seq] = time.monotonic()
        self.ws.notify("view.update", {"view_id": self.id, "white_balance_k": 5000 + 40 * (self.seq % 50), "camera_seq": self.seq})

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


def measure(daemon, rate, codecs, options):
    """Frames a second, median latency in ms, bytes of a frame, its coding, and seconds and bytes until the exact picture."""
    with ThinLine(daemon.port, rate * 125_000) as line:
        eye = Eye(line.port, daemon.token, options.size, codecs)
        eye.frame()
        latencies, frames = [], []
        warm_s = time.monotonic() + options.seconds / 2
        end_s = warm_s + options.seconds
        while (now_s := time.monotonic()) < end_s:
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
        codings = statistics.mode(f[1:] for f in frames)
        return (len(frames) / options.seconds, 1000 * statistics.median(latencies), statistics.median(f[0] for f in frames),
                "{} {}".format(*codings), time.monotonic() - rest_s, rest_bytes)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scene", default="office")
    parser.add_argument("--size", default="760x520", type=lambda s: [int(n) for n in s.split("x")])
    parser.add_argument("--seconds", default=10.0, type=float)
    parser.add_argument("rates", nargs="*", type=float, default=[1.0, 4.0, 16.0, 100.0])
    options = parser.parse_args()
    print("| Mbit/s | reads | frames/s | latency, ms | bytes/frame | coding | exact after, s | bytes of that |")
    print("|-------:|-------|---------:|------------:|------------:|--------|---------------:|--------------:|")
    with Daemon("--scene", options.scene, threads=2) as daemon:
        for rate in options.rates:
            for codecs in (None, ["webp"]):
                fps, ms, n_bytes, coding, rest_s, rest_bytes = measure(daemon, rate, codecs, options)
                print(f"| {rate:g} | {'WebP' if codecs else 'JPEG, PNG'} | {fps:.1f} | {ms:.0f} | {n_bytes:.0f} | {coding} "
                      f"| {rest_s:.1f} | {rest_bytes} |", flush=True)
        daemon.assert_well()


if __name__ == "__main__":
    main()
