#!/usr/bin/env python3
"""A slow reader beside a fast one, for minutes: is the fast one's frame rate unaffected, and is memory flat?

usage: LUMEND=build/release/bin/lumend tests/bench/slow_reader.py [--seconds 300] [--slow 1] [--rate 20000]

Measures in pairs, alternating, so that what the machine does besides hits both alike: an interval with the fast client
alone, then one with the slow ones connected too. The slow ones read --rate bytes a second. Prints JSON: frames per second
of both, their ratio, the least-squares slope of the daemon's memory over the intervals with slow readers. Exit status 1 when
the ratio is below 0.95 or the slope over the whole time exceeds what two frames of each view take.
"""
import argparse
import json
import os
import statistics
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "e2e"))
from daemon import Daemon  # noqa: E402
from slow_reader_test import View  # noqa: E402

SIZE = [320, 240]
INTERVAL_S = 10.0
TURN_S = 0.05  # the slow ones read a share of their rate this often


def interval(daemon, fast, slow, rate, samples):
    """Frames per second of the fast view over one interval."""
    begin = last = time.monotonic()
    first = fast.n_frames
    while (now := time.monotonic()) - begin < INTERVAL_S:
        fast.whole_frame()
        if slow and now - last >= TURN_S:
            for view in slow:
                view.sip(max(1, int(rate * (now - last))))
            samples.append((now, daemon.rss_bytes()))
            last = now
    return (fast.n_frames - first) / (time.monotonic() - begin)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=300)
    parser.add_argument("--slow", type=int, default=1)
    parser.add_argument("--rate", type=float, default=20000, help="bytes a second of each slow reader")
    arguments = parser.parse_args()
    alone, beside, samples = [], [], []
    with Daemon(threads=0) as daemon:
        fast = View(daemon.connect(), SIZE)
        slow = []
        interval(daemon, fast, [], 0, [])  # warm
        for _ in range(max(2, round(arguments.seconds / (2 * INTERVAL_S)))):
            alone.append(interval(daemon, fast, [], 0, []))
            slow = [View(daemon.connect(rcvbuf=4096), SIZE) for _ in range(arguments.slow)]
            beside.append(interval(daemon, fast, slow, arguments.rate, samples))
            for view in slow:
                view.ws.close()
        n_slow_frames = sum(view.n_frames for view in slow)
    ratio = statistics.median(b / a for a, b in zip(alone, beside))
    times = [t - samples[0][0] for t, _ in samples]
    slope = statistics.linear_regression(times, [rss for _, rss in samples]).slope
    grown = slope * times[-1]
    allowed = 2 * (1 + arguments.slow) * SIZE[0] * SIZE[1] * 4
    print(json.dumps({"fps_alone": statistics.median(alone), "fps_beside_slow": statistics.median(beside), "ratio": ratio,
                      "slow_readers": arguments.slow, "slow_frames_in_last_interval": n_slow_frames, "seconds": times[-1],
                      "rss_bytes_max": max(rss for _, rss in samples), "rss_slope_bytes_per_s": slope,
                      "rss_grown_bytes": grown, "rss_allowed_bytes": allowed}))
    return 0 if ratio >= 0.95 and grown <= allowed else 1


if __name__ == "__main__":
    sys.exit(main())
