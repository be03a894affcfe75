"""lumend render as several ranks: the pictures of one, whatever their number; told once; and an end to all if one ends.

Only in builds with LUMEND_MPI. One thread a rank, more ranks than processors if need be.
"""
import json
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from exr import Exr  # noqa: E402

LUMEND = os.environ["LUMEND"]
MPIRUN = os.environ["LUMEND_MPIRUN"]
ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
               "OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_hwloc_base_binding_policy": "none"}
SIZE = "104x56"  # tiles at the edges are cut


def ranks(n, *options):
    return ["-n", str(n), LUMEND, "render", "--threads", "1", *options]


def mpirun(*command, tmp=None):
    environment = {**ENVIRONMENT, "TMPDIR": tmp} if tmp else ENVIRONMENT
    return subprocess.run([MPIRUN, *command], env=environment, capture_output=True, text=True, check=False)


def look_at(pid):
    """Name and parent of a process; None: there is none."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as file:
            name, rest = file.read().split("(", 1)[1].rsplit(")", 1)
    except OSError:
        return None
    return name, int(rest.split()[1])


def ranks_of(mpirun_pid):
    """Open MPI's ranks are mpirun's own children, MPICH's those of a proxy."""
    seen = {pid: process for pid in map(int, filter(str.isdigit, os.listdir("/proc"))) if (process := look_at(pid))}
    found = []
    for pid, (name, parent) in seen.items():
        while parent != mpirun_pid and parent in seen:
            parent = seen[parent][1]
        if name == "lumend" and parent == mpirun_pid:
            found.append(pid)
    return found


class Ranks(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="lumend-mpi-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def pixels(self, name):
        """All layers of the file: also those of surfaces, of measured errors, and of illuminance."""
        return Exr(self.path(name)).block_bytes()

    def hold_against_one(self, options, frames=1):
        """Renders by one process, and by 1, 2 and 3 ranks; the statistics of all."""
        stats = {}
        for n in (0, 1, 2, 3):
            more = ["--size", SIZE, "--stats", self.path(f"{n}.json"), "--out", self.path(f"{n}-%d.exr"), *options]
            if n:
                done = mpirun(*ranks(n, *more))
            else:
                done = subprocess.run([LUMEND, "render", "--threads", "2", "--deterministic", *more], capture_output=True,
                                      text=True, check=False)
            self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)
            with open(self.path(f"{n}.json"), encoding="utf-8") as file:
                stats[n] = json.load(file)
            self.assertEqual(len(stats[n]["frames"]), frames)
            for frame in range(frames):
                one, other = stats[0]["frames"][frame], stats[n]["frames"][frame]
                for member in ("rays", "cache", "error", "spp"):
                    self.assertEqual(other.get(member), one.get(member), (n, frame, member))
                self.assertTrue(self.pixels(f"{n}-{frame}.exr") == self.pixels(f"0-{frame}.exr"), (n, frame))
        return stats

    def test_path_is_that_of_one(self):
        stats = self.hold_against_one(["--scene", "cornell", "--method", "path", "--spp", "9"])
        self.assertNotIn("team", stats[0])
        self.assertNotIn("team", stats[0]["frames"][0])
        self.assertEqual(stats[1]["team"], {"ranks": 1, "scene_bytes": 0, "edits_bytes": 0})
        self.assertEqual(stats[1]["frames"][0]["team"], {"heard_bytes": 0})
        heard = stats[3]["frames"][0]["team"]["heard_bytes"]
        pixels = 112 * 64  # whole tiles
        self.assertGreater(heard, 0)
        self.assertLess(heard, 9 * pixels * 16 + 4e6, "12 bytes a pixel and sample, what is told of noise, and what guides")

    def test_edits_are_those_of_one(self):
        for method in ("live", "tic", "irrcache"):
            with self.subTest(method):
                stats = self.hold_against_one(["--scene", "cornell", "--method", method, "--spp", "4", "--frames", "3", "--fps", "5",
                                               "--edits", "cornell-moves"], 3)
                self.assertGreater(stats[2]["frames"][0]["cache"]["created"], 0)
                self.assertTrue(all(frame["team"]["heard_bytes"] > 0 for frame in stats[2]["frames"]))
                self.assertGreater(stats[2]["team"]["edits_bytes"], 0)
                self.assertEqual(stats[1]["team"]["edits_bytes"], 0, "nobody is told")

    def test_light_groups_and_illuminance(self):
        self.hold_against_one(["--scene", "office", "--method", "live", "--spp", "2", "--illuminance"])
        self.hold_against_one(["--scene", "cornell", "--method", "live", "--spp", "2", "--light-groups"])

    def test_png_is_that_of_one(self):
        """With and without a map, which needs first hits: frames after it, too, are the same."""
        for overlay in ([], ["--overlay", "illuminance"]):
            options = ["--scene", "cornell", "--method", "live", "--spp", "2", "--size", SIZE, "--frames", "2", "--fps", "5",
                       "--edits", "cornell-moves", *overlay]
            one = subprocess.run([LUMEND, "render", "--deterministic", *options, "--out", self.path("0-%d.png")], capture_output=True, text=True,
                                 check=False)
            team = mpirun(*ranks(2, *options, "--out", self.path("2-%d.png")))
            self.assertEqual((one.returncode, team.returncode, team.stdout), (0, 0, one.stdout), one.stderr + team.stderr)
            for frame in range(2):
                with open(self.path(f"0-{frame}.png"), "rb") as file, open(self.path(f"2-{frame}.png"), "rb") as other:
                    self.assertTrue(other.read() == file.read(), (overlay, frame))

    def test_rank_0_alone_reads_files(self):
        """Also of an import: the others have no such folder."""
        model = os.path.join(os.path.dirname(os.path.abspath(__file__)), "web", "lamp.gltf")
        here, there = self.path("here"), self.path("there")
        os.mkdir(here)
        os.mkdir(there)
        shutil.copy(model, here)
        ops = [{"lumend": 1, "kind": "scene"},
               {"op": "import", "id": "lamp", "asset": "lamp.gltf"},
               {"op": "add", "type": "light", "id": "key", "kind": "point", "position": [0, 2, 1], "flux_lm": 500},
               {"op": "add", "type": "camera", "id": "main", "position": [0, 1.5, 4], "target": [0, 0.5, 0], "up": [0, 1, 0], "vfov_deg": 50}]
        with open(f"{here}/scene.jsonl", "w", encoding="utf-8") as file:
            file.writelines(json.dumps(op) + "\n" for op in ops)
        out = ["--method", "live", "--spp", "2", "--size", SIZE]
        done = subprocess.run([LUMEND, "render", "--deterministic", "--scene", f"{here}/scene.jsonl", "--out", self.path("0.exr"), *out],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = mpirun(*ranks(1, "--scene", f"{here}/scene.jsonl", "--out", self.path("1.exr"), *out), ":",
                      *ranks(2, "--scene", f"{there}/scene.jsonl", "--out", self.path("1.exr"), *out))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(self.pixels("1.exr") == self.pixels("0.exr"))

    def test_it_stops_by_the_clock_of_one(self):
        done = mpirun(*ranks(3, "--scene", "cornell", "--method", "path", "--size", SIZE, "--time", "0.3", "--out", self.path("a.exr")))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(os.listdir(self.folder), ["a.exr"])

    def test_it_is_told_once(self):
        done = mpirun(*ranks(3, "--scene", "cornell", "--method", "tic", "--size", SIZE, "--spp", "4", "--out", self.path("a.png")))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr.count("--spp and --time have no effect"), 1, done.stderr)
        self.assertEqual(os.listdir(self.folder), ["a.png"])

    def test_other_options_end_all(self):
        out = ["--out", self.path("a.exr"), "--size", SIZE]
        done = mpirun(*ranks(1, "--scene", "cornell", "--isa", "sse2", *out), ":", *ranks(1, "--scene", "cornell", "--isa", "avx2", *out))
        self.assertNotEqual(done.returncode, 0)
        self.assertRegex(done.stderr, "--isa: .* of rank 1 is not that of rank 0")
        done = mpirun(*ranks(2, "--scene", "cornell", "--tev", "14158", *out))
        self.assertNotEqual(done.returncode, 0)
        self.assertRegex(done.stderr, "not shown in tev")
        done = mpirun(*ranks(1, "--scene", "cornell", "--seed", "1", *out), ":", *ranks(1, "--scene", "cornell", "--seed", "2", *out))
        self.assertNotEqual(done.returncode, 0)
        self.assertRegex(done.stderr, "the picture of rank 1 is not that of rank 0|ranks are not at the same work")
        self.assertEqual(os.listdir(self.folder), [])

    def test_a_rank_that_fails_ends_all(self):
        done = mpirun(*ranks(3, "--scene", self.path("none.jsonl"), "--out", self.path("a.exr")), tmp=self.folder)
        self.assertNotEqual(done.returncode, 0)
        self.assertEqual([name for name in os.listdir(self.folder) if name.startswith("lumend-")], [])
        self.assertEqual(done.stderr.count("none.jsonl"), 1, "it is rank 0 that reads it")
        self.assertIn("rank 0 of 3 ends all", done.stderr)
        out = ["--scene", "cornell", "--size", SIZE, "--out", self.path("a.exr")]
        done = mpirun(*ranks(1, *out), ":", *ranks(1, *out, "--camera", "none"))
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("rank 1 of 2 ends all", done.stderr)

    def test_a_rank_that_is_killed_ends_all(self):
        command = [MPIRUN, *ranks(3, "--scene", "cornell", "--method", "path", "--spp", "4096", "--size", "600x400", "--out", self.path("a.exr"))]
        with subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
            self.addCleanup(lambda: run.poll() is None and run.kill())
            told = []
            for line in run.stderr:
                told.append(line)
                if "samples" in line:  # it is under way
                    break
            else:
                self.fail("it ended before it was under way: " + "".join(told) + run.stdout.read())
            found = ranks_of(run.pid)
            self.assertEqual(len(found), 3)
            ends = [os.pidfd_open(pid) for pid in found]
            for end in ends:
                self.addCleanup(os.close, end)
            os.kill(max(found), signal.SIGKILL)
            stdout, stderr = run.communicate()
        self.assertNotEqual(run.returncode, 0)
        self.assertRegex(stdout + stderr, re.compile("killed|signal 9", re.I), "MPICH tells it on stdout")
        for end in ends:  # mpirun does not wait for them
            select.select([end], [], [])


if __name__ == "__main__":
    unittest.main()
