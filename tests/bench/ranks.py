"""Ranks of one thread each against threads of one process, by turns: the time of a frame and the CPU time of both, and what ranks tell
each other. Who waits for another yields (Open MPI spins otherwise), since the cores may have other work.

usage: ranks.py LUMEND MPIRUN [--rounds N] [--ranks N] [--size WxH] [--spp N] [SCENE:METHOD...]
"""
import argparse
import json
import os
import resource
import statistics
import subprocess
import tempfile

ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
               "OMPI_MCA_mpi_yield_when_idle": "1"}


def measure(command, stats):
    """Milliseconds of the frame, CPU seconds of the whole command, what is told."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, env=ENVIRONMENT, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    with open(stats, encoding="utf-8") as file:
        frame = json.load(file)["frames"][0]
    return frame["ms"], after.ru_utime - before.ru_utime, frame.get("team", {}).get("heard_bytes", 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("lumend")
    parser.add_argument("mpirun")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--size", default="300x200")
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("cases", nargs="*", default=["cornell:path", "office:path", "cornell:live", "office:live"])
    o = parser.parse_intermixed_args()
    print("case           threads: ms (CPU s)   ranks: ms (CPU s)   speed of ranks over threads: least, median, most   KB heard")
    for case in o.cases:
        scene, method = case.split(":")
        ratios, threads, ranks, heard = [], [], [], 0
        with tempfile.TemporaryDirectory() as folder:
            stats = f"{folder}/s.json"
            render = [o.lumend, "render", "--scene", scene, "--method", method, "--size", o.size, "--spp", str(o.spp), "--deterministic",
                      "--out", f"{folder}/a.exr", "--stats", stats]
            for _ in range(o.rounds):
                threads.append(measure([*render, "--threads", str(o.ranks)], stats)[:2])
                *cost, heard = measure([o.mpirun, "-n", str(o.ranks), *render, "--threads", "1"], stats)
                ranks.append(cost)
                ratios.append(threads[-1][0] / cost[0])
        best = [min(runs) for runs in (threads, ranks)]
        print(f"{case:14} {best[0][0]:9.0f} ({best[0][1]:.1f}) {best[1][0]:11.0f} ({best[1][1]:.1f})"
              f"   {min(ratios):.2f} {statistics.median(ratios):.2f} {max(ratios):.2f}   best over best {best[0][0] / best[1][0]:.2f}"
              f"   {heard / 1e3:.0f}")


if __name__ == "__main__":
    main()
