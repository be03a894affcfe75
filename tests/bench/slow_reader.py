#!/usr/bin/env python3
"""A slow reader beside a fast one, for minutes: is the fast one's frame rate unaffected, and is memory flat?

usage: LUMEND=build/release/bin/lumend tests/bench/slow_reader.py [--seconds 300] [--slow 1] [--rate 20000]

Measures in pairs, alternating, so that what the machine does besides hits both alike: an interval with the fast client
alone, then one with the slow ones connected too. The slow ones read --rate bytes a second. Prints JSON: frames per second
of both, their ratio, and the daemon's largest memory in each interval with slow readers. Exit status 1 when the ratio is
below 0.95, or memory grew from the first such interval to the last by more than two frames of each view.
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

SIZE = [800, 600]   # so large that the changes of the fast one stay below the limit of messages a second
INTERVAL_S = 10.0
WARM_S = 3.0     # not measured: a view that opens has its first picture rendered, slow reader or not
TURN_S = 0.05  # the slow ones read a share of their rate this often


def interval(daemon, fast, slow, rate, seconds=INTERVAL_S):
    """Frames per second of the fast view over one interval, and the largest memory of the daemon in it."""
    peak = 0
    begin = last = time.monotonic()
    first = fast.n_frames
    while (now := time.monotonic()) - begin < seconds:
        fast.whole_frame()
        if now - last >= TURN_S:
            for view in slow:
                view.sip(max(1, int(rate * (now - last))))
            peak = max(peak, daemon.rss_bytes())
            last = now
    return (fast.n_frames - first) / (time.monotonic() - begin), peak


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=300)
    parser.add_argument("--slow", type=int, default=1)
    parser.add_argument("--rate", type=float, default=20000, help="bytes a second of each slow reader")
    arguments = parser.parse_args()
    alone, beside, peaks = [], [], []
    with Daemon(threads=0) as daemon:
        fast = View(daemon.connect(), SIZE)
        interval(daemon, fast, [], 0)  # warm
        for _ in range(max(2, round(arguments.seconds / (2 * INTERVAL_S + WARM_S)))):
            alone.append(interval(daemon, fast, [], 0)[0])
            slow = [View(daemon.connect(rcvbuf=4096), SIZE) for _ in range(arguments.slow)]
            interval(daemon, fast, slow, arguments.rate, WARM_S)
            fps, peak = interval(daemon, fast, slow, arguments.rate)
            beside.append(fps)
            peaks.append(peak)
            for view in slow:
                view.ws.close()
    ratio = statistics.median(b / a for a, b in zip(alone, beside))
    grown, allowed = peaks[-1] - peaks[0], 2 * (1 + arguments.slow) * SIZE[0] * SIZE[1] * 4
    print(json.dumps({"fps_alone": statistics.median(alone), "fps_beside_slow": statistics.median(beside), "ratio": ratio,
                      "slow_readers": arguments.slow, "bytes_per_s_each": arguments.rate, "rss_bytes_by_interval": peaks,
                      "rss_grown_bytes": grown, "rss_allowed_bytes": allowed}))
    return 0 if ratio >= 0.95 and grown <= allowed else 1


if __name__ == "__main__":
    sys.exit(main())
