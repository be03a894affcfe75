"""--state: what was answered is there again, after any end.

LUMEND_KILLS=N kills the daemon N times under load instead of 20 (sanitizers: 10), LUMEND_HOURS=N has ten clients edit for N hours instead of
one; LUMEND_SEED=N chooses other moments, edits and ends.
"""
import collections
import json
import os
import random
import re
import resource
import shutil
import statistics
import subprocess
import tempfile
import threading
import time
import unittest

from daemon import LUMEND, SANITIZE, Daemon
from wsclient import LAST_TILE, WAIT_S, Closed, RpcError, tile_header

HERE = os.path.dirname(os.path.abspath(__file__))
KILLS = int(os.environ.get("LUMEND_KILLS", "10" if SANITIZE else "20"))
SEED = int(os.environ.get("LUMEND_SEED", "7"))
HOURS = int(os.environ.get("LUMEND_HOURS", "1"))
CLIENTS = 4
WINDOW = 6  # edits of one client that wait for their answers
EDITS = 450  # of one client in one run: a burst of the server's limit of messages has 480
HOUR_CLIENTS, HOUR_EDITS = 10, 360  # one in ten seconds; time that nothing happens in is left out
BIG_MESH = {"op": "add", "type": "mesh", "positions": [round(i % 977 / 3 + 0.1, 6) for i in range(9000)],
            "indices": list(range(2997))}  # 80 kB of text, and content of its own in a snapshot


STARTED = []  # ended by tearDown where a test fails


def launch(*options, **more):
    STARTED.append(Daemon(*options, **more))
    return STARTED[-1]


def end_started():
    for daemon in STARTED:
        if daemon.process.poll() is None:
            daemon.process.kill()
            daemon.process.wait()
    STARTED.clear()


def kill(daemon):
    daemon.process.kill()
    daemon.process.wait()
    daemon.process.stdout.close()
    log = daemon.read_log()
    daemon.log.close()
    return log


def stop(daemon):
    """SIGTERM; it must end well."""
    status, log = daemon.stop(), daemon.read_log()
    daemon.log.close()
    assert status == 0, log
    return log


def state(*arguments):
    return subprocess.run([LUMEND, "state", *arguments], capture_output=True, text=True, timeout=2 * WAIT_S, check=False)


def lamp(name, flux=100):
    return {"op": "add", "type": "light", "id": name, "kind": "point", "flux_lm": flux}


class Model:
    """What the edits of one client make of its own records, with undo as the server has it: {id: flux}, by client."""

    def __init__(self, who):
        self.who, self.records, self.undos, self.redos = who, {}, [], []

    def apply(self, edit):
        before = dict(self.records)
        kind, name, flux = edit
        if kind in ("undo", "redo"):
            source, target = (self.undos, self.redos) if kind == "undo" else (self.redos, self.undos)
            target.append(before)
            self.records = dict(source.pop())
            return
        if kind == "remove":
            del self.records[name]
        else:
            self.records[name] = flux
        self.undos.append(before)
        del self.undos[:-256]  # LUM_LIMIT_UNDO
        self.redos.clear()

    def next_edit(self, rng, n):
        """One that the server accepts, given all before."""
        kind = rng.choice(("add", "set", "set", "set", "set", "remove", "undo", "undo", "redo"))
        if kind == "undo" and self.undos or kind == "redo" and self.redos:
            return kind, None, None
        lamps = sorted(name for name in self.records if re.fullmatch(r"c\d\.\d+", name))
        if kind == "remove" and lamps:
            return "remove", rng.choice(lamps), None
        if self.who == 1 and n % 16 == 0:
            models = [name for name in self.records if "model" in name]
            return ("remove", models[0], None) if len(models) > 2 else ("import", f"c1.model{n}", 0)
        if self.who == 0 and n % 5 == 0:
            meshes = [name for name in self.records if "mesh" in name]
            return ("remove", meshes[0], None) if len(meshes) > 3 else ("mesh", f"c0.mesh{n}", 0)
        if kind == "set" and lamps or len(lamps) > 12:
            return "set", rng.choice(lamps), n + 1
        return "add", f"c{self.who}.{n}", n + 1


def copy_of(model):
    copy = Model(model.who)
    copy.records, copy.undos, copy.redos = dict(model.records), list(model.undos), list(model.redos)
    return copy


def request_of(edit):
    kind, name, flux = edit
    if kind in ("undo", "redo"):
        return f"scene.{kind}", {}
    op = {"add": lambda: lamp(name, flux), "mesh": lambda: {**BIG_MESH, "id": name},
          "import": lambda: {"op": "import", "id": name, "asset": "lamp.gltf"},
          "set": lambda: {"op": "set", "id": name, "path": "/flux_lm", "value": flux},
          "remove": lambda: {"op": "remove", "id": name}}[kind]()
    return "scene.apply", {"ops": [op]}


class Client:
    """Edits its own records as fast as they are answered, until the daemon is gone."""

    def __init__(self, who, n_edits=EDITS):
        self.who, self.n_edits = who, n_edits
        self.user = None     # its name, which it takes again after each start
        self.model = Model(who)  # as it was at the last check
        self.n = 0

    def connect(self, daemon):
        self.ws = daemon.connect(hello=False)
        params = {"token": daemon.token, "client": f"client{self.who}"}
        if self.user:
            params["resume"] = self.user
        name = self.ws.call("session.hello", params)["session"]
        assert self.user in (None, name), f"{self.user} is called {name} now"
        self.user = name
        self.sent, self.n_acked, self.last_rev = [], 0, 0
        self.error = None

    def answer(self, waiting, count_ack):
        self.last_rev = self.ws.reply(waiting.pop(0))["scene_rev"]
        self.n_acked += 1
        count_ack()
        self.ws.notifications.clear()

    def run(self, rng, count_ack):
        """sent: edits in order; the first n_acked of them were answered. What leads back to a state that there was before
        waits for all answers, so that no two states look alike among those between the last answer and the last edit. So
        does an import, before which a later edit may be done."""
        ahead, waiting = copy_of(self.model), []
        try:
            while len(self.sent) < self.n_edits:
                edit = ahead.next_edit(rng, self.n)
                while waiting and (len(waiting) == WINDOW or "import" in (edit[0], self.sent[-1][0]) or
                                   edit[0] in ("remove", "undo", "redo")):
                    self.answer(waiting, count_ack)
                self.n += 1
                ahead.apply(edit)
                self.sent.append(edit)
                waiting.append(self.ws.send_request(*request_of(edit)))
            while waiting:
                self.answer(waiting, count_ack)
            self.ws.wait_close()
        except (Closed, ConnectionError, TimeoutError):
            pass  # killed
        except Exception as error:  # of the server: told by the main thread
            self.error = error

    def settle(self, records):
        """Finds how many of the edits sent are in `records` ({id: flux} of this client), at least those answered; the model
        is as after them. Returns their number."""
        model = copy_of(self.model)
        for k in range(len(self.sent) + 1):
            if k >= self.n_acked and model.records == records:
                self.model = model
                return k
            if k < len(self.sent):
                model.apply(self.sent[k])
        raise AssertionError(f"client {self.who}: {self.n_acked} of {len(self.sent)} edits were answered, found {records} "
                             f"instead; last: {self.sent[-8:]}")


class Kill(unittest.TestCase):
    """SIGKILL at random moments, with four clients in the middle of their edits."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="lumend-state-")
        self.addCleanup(shutil.rmtree, self.folder)
        self.addCleanup(end_started)
        self.rng = random.Random(SEED)
        self.ready_s, self.frame_s = [], []  # from each start on

    def start(self):
        """Starts it; some starts are killed themselves, at any moment."""
        while self.rng.random() < 0.25:
            process = subprocess.Popen([LUMEND, "--listen", "127.0.0.1:0", "--threads", "1", "--state", self.folder],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(self.rng.random() * 0.2)  # waits for nothing: the moment is random
            process.kill()
            process.wait()
            self.n_killed_starts += 1
        self.started = time.monotonic()
        daemon = launch("--state", self.folder, "--snapshot-kib", "32", "--assets", os.path.join(HERE, "web"))
        self.ready_s.append(time.monotonic() - self.started)
        return daemon

    def snapshots(self):
        return {name for name in os.listdir(self.folder) if name.startswith("snapshot-")}

    def load(self, daemon, clients, n_acks):
        """Edits until n_acks answers have come, then kills."""
        lock, enough, count = threading.Lock(), threading.Event(), [0]

        def count_ack():
            with lock:
                count[0] += 1
                if count[0] >= n_acks:
                    enough.set()

        for client in clients:
            client.connect(daemon)
        before = self.snapshots()
        clients[0].ws.call("view.open", {"size": [32, 32], "camera_id": "main"})
        threads = [threading.Thread(target=c.run, args=(random.Random(self.rng.random()), count_ack)) for c in clients]
        for thread in threads:
            thread.start()
        if n_acks > 0:
            while not enough.wait(0.1) and all(t.is_alive() for t in threads):
                pass
        log = kill(daemon)
        for thread in threads:
            thread.join()
        self.n_snapshots += len(self.snapshots() - before)
        for client in clients:
            self.assertIsNone(client.error, log)
        return log

    def check(self, daemon, clients, rev):
        """The scene is what each client's edits up to some point make, at least up to the last answer; returns its revision."""
        ws = daemon.connect()
        ws.call("view.open", {"size": [32, 32], "camera_id": "main"})
        while not any(tile_header(tile)["flags"] & LAST_TILE for tile in ws.binaries):
            ws.pump()
        self.frame_s.append(time.monotonic() - self.started)
        found = ws.call("scene.get", {"expand": True})
        ws.close()
        records, made = [{} for _ in clients], collections.Counter()
        for op in found["ops"]:
            if "origin" in op:
                made[op["origin"]] += 1
            elif re.match(r"c\d\.", op["id"]):
                records[int(op["id"][1])][op["id"]] = op.get("flux_lm", 0)
        for name in records[1]:
            if "model" in name:
                self.n_made = self.n_made or made[name]
                self.assertGreater(self.n_made, 2)
                self.assertEqual(made[name], self.n_made, name)  # a model is there as a whole
        n = sum(client.settle(records[client.who]) for client in clients)
        self.assertEqual(found["scene_rev"], rev + n)  # each edit is one revision
        self.assertGreaterEqual(found["scene_rev"], max(client.last_rev for client in clients))
        return found["scene_rev"]

    def test_what_was_answered_is_there(self):
        self.edit_and_kill([Client(who) for who in range(CLIENTS)], KILLS, (0, 1, 5, 20, 60, 150))

    def test_hours_of_edits(self):
        """What ten clients edit is what a model says, hour after hour; then it is killed, with nothing under way."""
        self.edit_and_kill([Client(who, HOUR_EDITS) for who in range(HOUR_CLIENTS)], HOURS, (HOUR_CLIENTS * HOUR_EDITS,))

    def edit_and_kill(self, clients, n_kills, acks):
        """Kills as often, each after one of so many answers."""
        rev, n_acked, started = 1, 0, time.monotonic()
        self.n_killed_starts, self.n_snapshots, self.n_made = 0, 0, 0
        for i in range(n_kills):
            daemon = self.start()
            if i > 0:
                rev = self.check(daemon, clients, rev)
            self.load(daemon, clients, self.rng.choice(acks))
            n_acked += sum(client.n_acked for client in clients)
            done = state("check", self.folder)
            self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        with self.start() as daemon:
            self.check(daemon, clients, rev)
        print(f"{n_kills} kills under load of {len(clients)}, {self.n_killed_starts} in a start, {n_acked} edits answered, none lost, "
              f"{self.n_snapshots} snapshots meanwhile, in {time.monotonic() - started:.0f} s; LUMEND_SEED={SEED}")
        for what, seconds in (("that it is ready", self.ready_s), ("the first frame", self.frame_s)):
            seconds.sort()
            print(f"from a start to {what}: median {statistics.median(seconds):.3f} s, 95 % "
                  f"{seconds[len(seconds) * 95 // 100]:.3f} s, longest {seconds[-1]:.3f} s")
        self.assertGreater(n_acked, n_kills)
        self.assertGreater(self.n_made, 0, "no model was imported")


class Restart(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="lumend-state-")
        self.addCleanup(shutil.rmtree, self.folder)
        self.addCleanup(end_started)

    def restart(self, daemon, *options, end=kill):
        end(daemon)
        return launch("--state", self.folder, *options)

    def hello(self, daemon, resume=None):
        ws = daemon.connect(hello=False)
        params = {"token": daemon.token, "client": "ann"}
        if resume:
            params["resume"] = resume
        return ws, ws.call("session.hello", params)

    def test_undo_after_a_kill_and_after_a_stop(self):
        for end in (kill, stop):
            daemon = launch("--state", self.folder)
            ws, hello = self.hello(daemon)
            self.assertEqual(hello["saved"], "commit")
            ws.call("scene.apply", {"ops": [lamp("l", 1)]})
            for flux in (2, 3):
                ws.call("scene.apply", {"ops": [{"op": "set", "id": "l", "path": "/flux_lm", "value": flux}]})
            before = ws.call("scene.undo")["scene_rev"]
            daemon = self.restart(daemon, end=end)
            other, again = self.hello(daemon)
            self.assertNotEqual(again["session"], hello["session"])  # nobody gets somebody else's undo by chance
            self.assertEqual(again["scene_rev"], before)
            with self.assertRaisesRegex(RpcError, "nothing to undo"):
                other.call("scene.undo")
            ws, again = self.hello(daemon, resume=hello["session"])
            self.assertEqual(again["session"], hello["session"])
            ws.call("scene.redo")
            self.assertEqual(self.flux(ws, "l"), 3)
            for flux in (2, 1):
                ws.call("scene.undo")
                self.assertEqual(self.flux(ws, "l"), flux)
            ws.call("scene.undo")
            self.assertIsNone(self.flux(ws, "l"))
            stop(daemon)

    def flux(self, ws, name):
        return {op["id"]: op.get("flux_lm") for op in ws.call("scene.get")["ops"]}.get(name)

    def test_an_import_needs_neither_its_file_nor_the_importer_again(self):
        with tempfile.TemporaryDirectory() as assets:
            shutil.copy(os.path.join(HERE, "web", "lamp.gltf"), assets)
            daemon = launch("--state", self.folder, "--assets", assets)
            ws, hello = self.hello(daemon)
            ws.call("scene.apply", {"ops": [{"op": "import", "id": "a", "asset": "lamp.gltf"}]})
            ws.call("scene.apply", {"ops": [{"op": "set", "id": "a", "path": "/transform/translate", "value": [1, 0, 0]}]})
            made = [op for op in ws.call("scene.get", {"expand": True})["ops"] if op.get("origin") == "a"]
            self.assertGreater(len(made), 2)
            thing = next(op["id"] for op in made if op.get("type") == "object")
            ws.call("scene.apply", {"ops": [{"op": "set", "id": thing, "path": "/visible", "value": False}]})
            whole, ops = ws.call("scene.get", {"expand": True}), ws.call("scene.get")
        daemon = self.restart(daemon, "--importer", "/bin/false")
        for _ in range(2):  # from its journal, then from its snapshot
            ws, _ = self.hello(daemon, resume=hello["session"])
            self.assertEqual(ws.call("scene.get", {"expand": True}), whole)
            self.assertEqual(ws.call("scene.get"), ops)
            daemon = self.restart(daemon, "--importer", "/bin/false")
        ws, _ = self.hello(daemon, resume=hello["session"])
        for _ in range(3):
            ws.call("scene.undo")
        self.assertFalse([op for op in ws.call("scene.get")["ops"] if op["id"].startswith("a")])
        ws.call("scene.redo")
        self.assertEqual(len([op for op in ws.call("scene.get", {"expand": True})["ops"] if op.get("origin") == "a"]), len(made))
        stop(daemon)
        # as a scene file, the model is in it
        done = state("export", self.folder, "--out", os.path.join(self.folder, "x.jsonl"))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        with Daemon("--scene", os.path.join(self.folder, "x.jsonl")) as plain:
            found = plain.connect().call("scene.get", {"expand": True})["ops"]
            self.assertEqual(len([op for op in found if op["id"].startswith("a/")]), len(made))
        done = subprocess.run([LUMEND, "render", "--scene", os.path.join(self.folder, "x.jsonl"), "--size", "16x16", "--spp",
                               "1", "--out", os.path.join(self.folder, "x.png")], capture_output=True, text=True, check=False)
        told = [line for line in done.stderr.splitlines() if not line.startswith("lumend render: frame ")]  # progress
        self.assertEqual((done.returncode, told), (0, []))

    def test_a_second_daemon_is_refused(self):
        with Daemon("--state", self.folder) as daemon:
            for arguments in (["serve", "--listen", "127.0.0.1:0", "--state", self.folder],
                              *(["state", command, self.folder] for command in ("check", "export", "compact"))):
                done = subprocess.run([LUMEND, *arguments], capture_output=True, text=True, timeout=2 * WAIT_S, check=False)
                self.assertEqual(done.returncode, 1)
                self.assertIn("another lumend writes the state in " + self.folder, done.stderr.splitlines()[-1])
            daemon.connect().call("scene.apply", {"ops": [lamp("l")]})

    def test_the_state_comes_before_the_scene(self):
        daemon = launch("--state", self.folder)
        daemon.connect().call("scene.apply", {"ops": [lamp("l")]})
        daemon = self.restart(daemon)
        self.assertIn("l", [op["id"] for op in daemon.connect().call("scene.get")["ops"]])
        self.assertIn("is left aside: it is for an empty folder", stop(daemon))

    def test_a_full_disk_takes_back_and_comes_back(self):
        """A limit of the size of files stands for the disk: the write of one edit fails, the next start is as answered."""
        daemon = launch("--state", self.folder)
        ann, bob = daemon.connect(), daemon.connect()
        ann.call("scene.apply", {"ops": [lamp("l", 1)]})
        used = max(os.path.getsize(os.path.join(self.folder, name)) for name in os.listdir(self.folder))
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (100, resource.RLIM_INFINITY))
        with self.assertRaises(RpcError) as refused:
            ann.call("scene.apply", {"ops": [{"op": "set", "id": "l", "path": "/flux_lm", "value": 2}]})
        self.assertEqual(refused.exception.app, "io")
        self.assertIn("could not be saved, and is taken back", str(refused.exception))
        with self.assertRaises(RpcError) as refused:  # at once, and for everybody
            bob.call("scene.apply", {"ops": [lamp("m")]})
        self.assertEqual(refused.exception.app, "io")
        self.assertIn("cannot be edited until it can be saved", str(refused.exception))
        self.assertEqual(self.flux(bob, "l"), 1)  # looking goes on
        told = [p for name, p in bob.notifications if name == "scene.changed"]
        self.assertEqual([p["user"] for p in told][-1], "(server)")
        self.assertEqual([p["ops"] for p in told][-1], [{"value": 1, "op": "set", "id": "l", "path": "/flux_lm"}])
        self.assertTrue(bob.call("stats.get")["state"]["read_only"])
        self.assertEqual(daemon.metric("state_read_only"), 1)
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        while daemon.metric("state_read_only"):
            pass
        rev = bob.call("scene.apply", {"ops": [lamp("m", 3)]})["scene_rev"]
        self.assertGreater(rev, told[-1]["scene_rev"])
        self.assertGreater(used, 100)
        ann.call("scene.undo")
        log = kill(daemon)
        self.assertIn("the scene is saved again", log)
        again = launch("--state", self.folder)
        self.assertEqual(self.flux(again.connect(), "m"), 3)
        self.assertIsNone(self.flux(again.connect(), "l"))
        stop(again)

    def test_interval(self):
        daemon = launch("--state", self.folder, "--durability", "interval")
        ws, hello = self.hello(daemon)
        self.assertEqual(hello["saved"], "interval")
        for i in range(50):
            ws.call("scene.apply", {"ops": [lamp(f"row-{i}")]})
        daemon = self.restart(daemon, end=stop)
        self.assertEqual(sum(op["id"].startswith("row-") for op in daemon.connect().call("scene.get")["ops"]), 50)
        stop(daemon)

    def test_without_a_state_nothing_is_kept_and_said_so(self):
        with Daemon() as daemon:
            ws, hello = self.hello(daemon)
            self.assertEqual(hello["saved"], "no")
            self.assertIsNone(ws.call("stats.get")["state"])


class Command(unittest.TestCase):
    def test_check_names_what_is_damaged(self):
        with tempfile.TemporaryDirectory() as folder:
            with Daemon("--state", folder) as daemon:
                ws = daemon.connect()
                for i in range(5):
                    ws.call("scene.apply", {"ops": [lamp(f"l{i}")]})
            done = state("check", folder)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertRegex(done.stdout, r"^revision 6, \d+ records, 5 edits since the snapshot, 0 files of content\n$")
            path = os.path.join(folder, "journal-0")
            with open(path, "r+b") as journal:
                text = journal.read()
                journal.seek(text.index(b'"l2"') + 1)
                journal.write(b"x")
            done = state("check", folder)
            self.assertEqual(done.returncode, 1)
            self.assertIn("journal-0: edit 3 at offset ", done.stdout)
            self.assertIn("is damaged: a start loses 1 edits, and keeps the rest", done.stderr)
            done = state("compact", folder)
            self.assertEqual(done.returncode, 0, done.stderr)
            done = state("check", folder)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertEqual(sorted(n.split("-")[0] for n in os.listdir(folder)),
                             ["content", "journal", "journal", "journal", "lock", "snapshot", "snapshot", "upload"])
            self.assertIn("journal-0.damaged", os.listdir(folder))
            lines = state("export", folder).stdout.splitlines()
            self.assertEqual([op["id"] for op in map(json.loads, lines) if op.get("kind") == "point"],
                             ["l0", "l1", "l3", "l4"])

    def test_a_flipped_bit_in_each_record_of_a_model_is_named(self):
        """By number and place, in whatever record it is; all others are kept."""
        with tempfile.TemporaryDirectory() as folder:
            with Daemon("--state", folder, "--assets", os.path.join(HERE, "web")) as daemon:
                ws = daemon.connect()
                ws.call("scene.apply", {"ops": [lamp("l", 7), {"op": "import", "id": "a", "asset": "lamp.gltf"}]})
            (name,) = os.listdir(os.path.join(folder, "content"))
            path = os.path.join(folder, "content", name)
            with open(path, "rb") as content:
                whole = content.read()
            heads = [m.start() for m in re.finditer(rb"LUMR", whole)]  # each record: a head of 40 bytes, and its text
            self.assertGreater(len(heads), 3)
            for number, at in enumerate(heads, 1):
                for place in (at + 21, at + 45):
                    with open(path, "wb") as content:
                        content.write(whole[:place] + bytes([whole[place] ^ 8]) + whole[place + 1:])
                    done = state("check", folder)
                    self.assertEqual(done.returncode, 1)
                    told = re.findall(rf"content/{name[:12]}: record (\d+) at offset (\d+) is damaged", done.stdout)
                    self.assertEqual({int(offset) for _, offset in told}, {at}, done.stdout)
                    self.assertIn(number if place > at + 40 else 0, [int(n) for n, _ in told])  # the head has the number
                    self.assertIn(f"content/{name[:12]} is damaged: its bytes do not give its name", done.stdout)
                    self.assertIn("is damaged: a start loses 1 edits, and keeps the rest", done.stderr)
            with open(path, "wb") as content:
                content.write(whole)
            self.assertEqual(state("check", folder).returncode, 0)

    def test_compact_removes_models_that_nobody_needs(self):
        with tempfile.TemporaryDirectory() as folder:
            content = os.path.join(folder, "content")
            with Daemon("--state", folder, "--assets", os.path.join(HERE, "web")) as daemon:
                ann, bob = daemon.connect(), daemon.connect()
                for name in ("a", "b"):
                    bob.call("scene.apply", {"ops": [{"op": "import", "id": name, "asset": "lamp.gltf"}]})
                ann.call("scene.apply", {"ops": [{"op": "remove", "id": "a"}]})
                self.assertEqual(len(os.listdir(content)), 2)
            self.assertEqual(state("compact", folder).returncode, 0)
            self.assertEqual(len(os.listdir(content)), 2)  # ann may come back, and take the removal back
            with Daemon("--state", folder) as daemon:
                ws = daemon.connect(hello=False)
                ws.call("session.hello", {"token": daemon.token, "resume": "test.0-1"})
                ws.call("scene.undo")
                ws.call("scene.redo")
                ws.leave()  # she will not
                other = daemon.connect(hello=False)
                other.call("session.hello", {"token": daemon.token, "resume": "test.1-1"})
                other.leave()
                while daemon.metric("sessions"):
                    pass
                daemon.assert_well()
            self.assertEqual(state("compact", folder).returncode, 0)
            self.assertEqual(len(os.listdir(content)), 1)
            done = state("check", folder)
            self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_what_is_no_state(self):
        with tempfile.TemporaryDirectory() as folder:
            for command in ("check", "export", "compact"):
                done = state(command, folder)
                self.assertEqual((done.returncode, done.stdout), (1, ""))
                self.assertIn("holds no state of lumend", done.stderr)
        for arguments in ((), ("check",), ("frob", "x"), ("check", "x", "y"), ("check", "x", "--imports"), ("check", "--out")):
            self.assertEqual(state(*arguments).returncode, 2, arguments)
        self.assertEqual(state("--help").returncode, 0)


class ExportFile(unittest.TestCase):
    """What --out names has all of the scene, or what it had before."""

    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.kept, self.out = os.path.join(self.folder, "kept"), os.path.join(self.folder, "scene.jsonl")
        with Daemon("--state", self.kept) as daemon:
            daemon.connect().call("scene.apply", {"ops": [lamp(f"lamp-{i}", i + 1) for i in range(200)]})
        with open(self.out, "w", encoding="utf-8") as file:
            file.write("mine\n")

    def read(self):
        with open(self.out, encoding="utf-8") as file:
            return file.read()

    def test_a_disk_that_is_full_leaves_the_file_that_was_there(self):
        for left in (0, 4096, 8192):
            done = subprocess.run([LUMEND, "state", "export", self.kept, "--out", self.out], capture_output=True, text=True,
                                  check=False, restore_signals=False,  # SIGXFSZ stays ignored: a write fails instead
                                  preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (left, left)))
            self.assertEqual(done.returncode, 1)
            self.assertIn(f"cannot write {self.out}: File too large", done.stderr)
            self.assertEqual(self.read(), "mine\n")
            self.assertEqual(sorted(os.listdir(self.folder)), ["kept", "scene.jsonl"])

    def test_one_that_is_killed_leaves_it_too(self):
        done = subprocess.run([LUMEND, "state", "export", self.kept, "--out", self.out], capture_output=True, check=False,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)))
        self.assertLess(done.returncode, 0)
        self.assertEqual(self.read(), "mine\n")

    def test_all_of_it_takes_its_place(self):
        self.assertEqual(state("export", self.kept, "--out", self.out).returncode, 0)
        self.assertEqual(self.read().count("lamp-"), 200)
        self.assertEqual(self.read(), state("export", self.kept).stdout)
        self.assertEqual(sorted(os.listdir(self.folder)), ["kept", "scene.jsonl"])

    def test_what_is_no_plain_file_is_written_itself(self):
        self.assertEqual(state("export", self.kept, "--out", "/dev/stdout").stdout, state("export", self.kept).stdout)
        done = state("export", self.kept, "--out", "/dev/full")
        self.assertEqual(done.returncode, 1)
        self.assertIn("No space left", done.stderr)
        self.assertIn("cannot write", state("export", self.kept, "--out", os.path.join(self.folder, "no", "x")).stderr)


if __name__ == "__main__":
    # The commands have one thread.
    unittest.main(defaultTest=["Kill", "Restart"] if "thread" in SANITIZE else None)
