"""What a disk does to --state: it is full, it tears the last write, it flips a bit. What was answered is there, or the record
that is damaged is named by its place, and the rest is kept.

LUMEND_FAULTS=N does so many of each instead of 6; LUMEND_SEED=N chooses others.
"""
import os
import random
import re
import resource
import shutil
import struct
import tempfile
import time
import unittest

from daemon import SKY
from state_test import BIG_MESH, HERE, end_started, kill, lamp, launch, state
from wsclient import WAIT_S, RpcError

FAULTS = int(os.environ.get("LUMEND_FAULTS", "6"))
SEED = int(os.environ.get("LUMEND_SEED", "5"))
LAMPS = 24          # each is set by one edit: what the loss of one costs is seen
EACH_STATE = 20     # faults of one folder, which is a copy each time
HEAD, BLOCK = 80, struct.Struct("<4sIQQQII")  # server/journal/block.h


def scene_of(daemon):
    """{id: what was edited of it}, of all that did not come with the scene."""
    found, ws = {}, daemon.connect()
    for op in ws.call("scene.get", {"expand": True})["ops"]:
        if re.match(r"(l\d|mesh|model)", op["id"]):
            found[op["id"]] = op.get("flux_lm", 0)
    ws.close()
    return found


def blocks_of(path):
    """[(offset, end, revision)] of a file that is whole."""
    with open(path, "rb") as file:
        data = file.read()
    at, found = HEAD, []
    while at < len(data):
        magic, n_json, n_blobs, _, rev, _, _ = BLOCK.unpack_from(data, at)
        assert magic == b"LUMR", (path, at)
        end = at + BLOCK.size + (n_json + n_blobs + 7) // 8 * 8
        found.append((at, end, rev))
        at = end
    return found


class Damage(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="lumend-damage-"))
        self.addCleanup(end_started)
        self.rng = random.Random(SEED)
        print(f"LUMEND_SEED={SEED}", flush=True)

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def start(self, name, *options):
        return launch("--state", self.path(name), "--assets", os.path.join(HERE, "web"), *options, scene=SKY)

    def make(self):
        """A folder "whole": lamps, each set by an edit of its own, models and meshes between them, killed at its end.
        Returns {revision: what that edit made}, in order, and the scene."""
        shutil.rmtree(self.path("whole"), ignore_errors=True)
        made = {}
        daemon = self.start("whole", *(("--snapshot-kib", "8") if self.rng.random() < 0.5 else ()))
        ws = daemon.connect()
        ws.call("scene.apply", {"ops": [lamp(f"l{i}", 1) for i in range(LAMPS)]})
        order = [("set", i) for i in range(LAMPS)] + [("import", i) for i in range(2)] + [("mesh", i) for i in range(2)]
        self.rng.shuffle(order)
        for kind, i in order:
            op, name = {"set": ({"op": "set", "id": f"l{i}", "path": "/flux_lm", "value": i + 2}, f"l{i}"),
                        "import": ({"op": "import", "id": f"model{i}", "asset": "lamp.gltf"}, f"model{i}"),
                        "mesh": ({**BIG_MESH, "id": f"mesh{i}"}, f"mesh{i}")}[kind]
            made[ws.call("scene.apply", {"ops": [op]})["scene_rev"]] = name
        whole = scene_of(daemon)
        self.assertGreater(len(whole), LAMPS + 4)
        kill(daemon)
        self.assertEqual(state("check", self.path("whole")).returncode, 0)
        return made, whole

    def damaged_copy(self, damage):
        """A copy of the folder, in which damage(path of it) does something. Returns (what check says, the scene of a start
        on it); a second start has the same scene."""
        shutil.rmtree(self.path("copy"), ignore_errors=True)
        shutil.copytree(self.path("whole"), self.path("copy"))
        damage(self.path("copy"))
        done = state("check", self.path("copy"))
        self.assertIn(done.returncode, (0, 1), done.stderr)
        scenes = []
        for _ in range(2):
            daemon = self.start("copy")
            scenes.append(scene_of(daemon))
            kill(daemon)
        self.assertEqual(scenes[0], scenes[1])
        return done, scenes[0]

    def newest_journal(self):
        """Path below the folder, and blocks, of the newest one that has an edit; None: all edits are in a snapshot."""
        names = sorted((n for n in os.listdir(self.path("whole")) if re.fullmatch(r"journal-\d+", n)),
                       key=lambda n: -int(n.split("-")[1]))
        blocks = blocks_of(self.path("whole", names[0]))
        return (names[0], blocks) if blocks else None

    def test_a_torn_write(self):
        """The last edit is written in part: all before it are there. Junk at its end is told, missing bytes are cut off."""
        n_told = 0
        for i in range(FAULTS):
            if i % EACH_STATE == 0:
                journal = None
                while not journal:
                    made, whole = self.make()
                    journal = self.newest_journal()
            name, blocks = journal
            at, end, rev = blocks[-1]
            cut, junk = self.rng.randrange(at, end), self.rng.choice((0, 1, 2))

            def tear(folder):
                with open(os.path.join(folder, name), "r+b") as file:
                    file.truncate(cut)
                    if junk:
                        file.seek(cut)
                        file.write(bytes(end - cut) if junk == 1 else self.rng.randbytes(end - cut))

            done, found = self.damaged_copy(tear)
            lost = {key for key in whole if found.get(key) != whole[key]}
            self.assertFalse(found.keys() - whole.keys())
            self.assertLessEqual({key.split("/")[0] for key in lost}, {made[rev]}, f"{name}, cut at {cut} of {at}..{end}, {junk}")
            if not junk:
                self.assertEqual(done.returncode, 0, done.stdout)
            n_told += done.returncode
        print(f"{FAULTS} torn writes, {n_told} of them told as damage, all edits before are there")

    def test_a_flipped_bit(self):
        """Anywhere in the folder. Only what the damaged record made may be lost, and then it is named by its place."""
        n_lost = 0
        for i in range(FAULTS):
            if i % EACH_STATE == 0:
                made, whole = self.make()
                files = [os.path.relpath(os.path.join(at, f), self.path("whole"))
                         for at, _, names in os.walk(self.path("whole")) for f in names]
                files = sorted(f for f in files if os.path.getsize(self.path("whole", f)))
            name = self.rng.choice(files)
            place, bit = self.rng.randrange(os.path.getsize(self.path("whole", name))), self.rng.randrange(8)
            blocks = [b for b in blocks_of(self.path("whole", name)) if b[0] <= place < b[1]] if "-" in name or "/" in name else []

            def flip(folder):
                with open(os.path.join(folder, name), "r+b") as file:
                    file.seek(place)
                    byte = file.read(1)[0]
                    file.seek(place)
                    file.write(bytes([byte ^ 1 << bit]))

            done, found = self.damaged_copy(flip)
            what = f"{name}, byte {place}, bit {bit}: {done.stdout}"
            lost = {key.split("/")[0] for key in whole if found.get(key) != whole[key]}
            self.assertFalse(found.keys() - whole.keys(), what)
            if name.startswith("snapshot"):
                self.assertEqual(lost, set(), what)
            elif lost:
                n_lost += 1
                (at, _, rev), = blocks  # a head of a file is there twice
                self.assertEqual(done.returncode, 1, what)
                self.assertIn(f" at offset {at} is damaged", done.stdout, what)
                self.assertIn(name[:20].replace("upload/", ""), done.stdout, what)
                if name.startswith("journal"):
                    self.assertEqual(lost, {made[rev]}, what)
                else:
                    self.assertEqual(len(lost), 1, what)
        print(f"{FAULTS} flipped bits, of which {n_lost} cost the edit that they hit, and none another")

    def any_edit(self, scene, mesh, flux):
        """Of a lamp, or a mesh more or less; scene is as after it."""
        meshes = [name for name in scene if name.startswith("mesh")]
        if meshes and self.rng.random() < 0.1:
            del scene[meshes[0]]
            return {"op": "remove", "id": meshes[0]}
        if self.rng.random() < 0.1:
            scene[mesh] = 0
            return {**BIG_MESH, "id": mesh}
        name = self.rng.choice(sorted(scene.keys() - meshes))
        scene[name] = flux
        return {"op": "set", "id": name, "path": "/flux_lm", "value": flux}

    def wait_until_saving(self, daemon):
        """The disk has room again, which the daemon finds out by itself."""
        end = time.monotonic() + WAIT_S
        while daemon.metric("state_read_only"):
            self.assertLess(time.monotonic(), end, "it saves nothing, though there is room")
            time.sleep(0.01)  # between two questions: an answer costs the daemon time of its own

    def test_a_full_disk(self):
        """A limit of the size of files, at any byte, stands for the disk. What was answered is there, what was refused is not."""
        daemon, n_refused, n_done, n_kills = self.start("full"), 0, 0, 0
        expected = {f"l{i}": 1 for i in range(LAMPS)}
        ws = daemon.connect()
        ws.call("scene.apply", {"ops": [lamp(name, 1) for name in expected]})
        for i in range(FAULTS):
            sizes = {f: os.path.getsize(self.path("full", f)) for f in os.listdir(self.path("full"))}
            used = sizes[max((f for f in sizes if f.startswith("journal")), key=lambda f: int(f.split("-")[1]))]
            most = self.rng.choice((0, self.rng.randrange(max(sizes.values())), *(used + self.rng.randrange(2500) for _ in "xyz")))
            resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
            for n in range(self.rng.randrange(2, 14)):
                after = dict(expected)
                op = self.any_edit(after, f"mesh{i}.{n}", 1000 * (i + 1) + n)
                try:
                    ws.call("scene.apply", {"ops": [op]})
                    expected = after
                    n_done += 1
                except RpcError as refused:
                    self.assertEqual(refused.app, "io", str(refused))
                    n_refused += 1
            if self.rng.random() < 0.5:
                kill(daemon)
                n_kills += 1
                self.assertEqual(state("check", self.path("full")).returncode, 0)
                daemon = self.start("full")
                ws = daemon.connect()
            else:
                resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
                self.wait_until_saving(daemon)
            self.assertEqual(scene_of(daemon), expected, f"fault {i}, at {most} bytes")
        self.assertGreater(n_refused, 0)
        print(f"{FAULTS} full disks, {n_kills} ended by a kill: {n_done} edits answered, and there; {n_refused} refused, and not")


if __name__ == "__main__":
    unittest.main()
