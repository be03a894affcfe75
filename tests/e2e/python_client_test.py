"""clients/python: sessions, edits, pictures and sensors of a running daemon; what is refused, and what breaks."""
import contextlib
import io
import json
import os
import queue
import random
import struct
import subprocess
import sys
import tempfile
import threading
import unittest
import zlib
from unittest import mock

from daemon import Daemon

PYTHON = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", "clients", "python"))
SUPPORT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "support"))
sys.path[:0] = [PYTHON, os.path.join(PYTHON, "examples"), SUPPORT]
import even_light
from exr import Exr
import lumend
import lumend.session
from lumend.websocket import TEXT
from lumend.picture import HEADER, Canvas, read_tile

LAMP = "ceiling-panel"


def url_of(daemon, token=None):
    return f"http://{daemon.host}:{daemon.port}/#t={daemon.token if token is None else token}"


def tile(flags=1, frame=1, codec=0, x=0, y=0, w=2, h=2, full=(4, 2), payload=None, downscale=0):
    payload = bytes([frame] * 4 * w * h) if payload is None else payload
    return HEADER.pack(b"LUMF", 1, 1, 64, flags, len(payload), frame, 1, 1, 0, x, y, w, h, *full, codec, 0, downscale, 0, 0, 0,
                       0) + payload


class Scene(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = cls.enterClassContext(Daemon("--deterministic"))

    def setUp(self):
        self.session = self.enterContext(lumend.connect(url_of(self.daemon), client="test"))

    def test_edits(self):
        before = self.session.scene()
        self.assertEqual(before[LAMP]["type"], "light")
        self.assertEqual(before["render"]["type"], "render")
        with self.session.edit(undo_group="one") as edit:
            edit.add_light("key", kind="point", position=[0, 2, 0], flux_lm=800)
            edit.set("key", cct_k=3000, on=False)
            edit.set_part("key", "/position/1", 2.5)
        now = self.session.scene()["key"]
        self.assertEqual((now["position"], now["cct_k"], now["on"], now["flux_lm"]), ([0, 2.5, 0], 3000, False, 800))
        self.assertEqual(edit.scene_rev, self.session.scene_rev)
        self.session.undo()
        self.assertNotIn("key", self.session.scene())
        self.session.redo()
        with self.session.edit() as edit:
            edit.remove("key")
        self.assertEqual(self.session.scene(), before)
        with self.assertRaises(ZeroDivisionError), self.session.edit() as edit:
            edit.remove(LAMP)
            1 / 0
        self.assertIn(LAMP, self.session.scene())  # what was not finished is not sent

    def test_refusals(self):
        with self.assertRaises(lumend.Refused) as caught, self.session.edit() as edit:
            edit.set(LAMP, flux_lm=-1)
        self.assertEqual((caught.exception.code, caught.exception.min), ("invalid_value", 0))
        self.assertIn("flux_lm", caught.exception.path)
        for wrong, code in ((lambda: self.session.call("scene.gte"), None), (lambda: self.session.sensor("desk"), "not_found"),
                            (lambda: self.session.view(0, 4), "invalid_value"),
                            (lambda: self.session.apply([{"op": "remove", "id": "nobody"}]), "not_found")):
            with self.assertRaises(lumend.Refused) as caught:
                wrong()
            if code:
                self.assertEqual(caught.exception.code, code)
        with self.assertRaises(ValueError):  # JSON has none; nothing is sent
            self.session.apply([{"op": "set", "id": LAMP, "path": "/flux_lm", "value": float("nan")}])
        self.assertIn(LAMP, self.session.scene())

    def test_scenes_are_files(self):
        """Both kinds, opened by another daemon, are the scene: its edits and its lamps."""
        with self.session.edit() as edit:
            edit.add_light("key", kind="point", position=[0, 2.5, 0], flux_lm=800, cct_k=3000)
        mine, folder = self.session.scene(), self.enterContext(tempfile.TemporaryDirectory())
        for kind in ("jsonl", "glb"):
            path = os.path.join(folder, f"room.{kind}")
            self.session.save_scene(path)
            self.assertEqual(os.listdir(folder), [f"room.{kind}"])
            with Daemon("--scene", path) as again, lumend.connect(url_of(again)) as other:
                below = "room/" if kind == "glb" else ""  # a model's records are below its name
                theirs = {id.removeprefix(below): record for id, record in other.scene().items()}
                for id in ("key", LAMP, "globe", "main"):
                    for field in ("position", "flux_lm", "cct_k", "on", "vfov_deg"):
                        self.assertEqual(theirs[id].get(field), mine[id].get(field), (kind, id, field))
                if kind == "jsonl":
                    self.assertEqual(theirs, mine)
            os.remove(path)
        self.session.undo()
        with self.assertRaises(ValueError):
            self.session.save_scene(os.path.join(folder, "room.obj"))
        with self.assertRaises(FileNotFoundError):
            self.session.save_scene(os.path.join(folder, "nowhere", "room.glb"))
        with self.assertRaises(lumend.Disconnected):
            self.session._socket.fetch("download/nothing", io.BytesIO())
        self.assertEqual(os.listdir(folder), [])

    def test_another_session_sees_it(self):
        with lumend.connect(url_of(self.daemon)) as other:
            with self.session.edit() as edit:
                edit.set("render", exposure_ev=3)
            self.assertEqual(other.scene()["render"]["exposure_ev"], 3)
            self.assertEqual(other.scene_rev, edit.scene_rev)  # told by scene.changed, which comes before that reply
        self.session.undo()


class Pictures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = cls.enterClassContext(Daemon("--deterministic"))

    def test_pictures_show_edits(self):
        with lumend.connect(url_of(self.daemon)) as session, \
                session.view(96, 72, linear=True, method="path", spp=4) as view, tempfile.TemporaryDirectory() as folder:
            lit = view.picture()
            self.assertTrue(lit.converged and lit.linear and lit.stats["spp"] == 4, lit.stats)
            said = view.read(48, 60)
            self.assertEqual(said["unit"], "cd/m2")
            self.assertLess(abs(lit.luminance()[96 * 60 + 48] / said["value"] - 1), 2 ** -10)  # half floats have 11 bits
            with session.edit() as edit:
                for lamp in (LAMP, "globe"):
                    edit.set(lamp, on=False)
            dark = view.picture()
            self.assertEqual(max(dark.luminance()), 0)
            self.assertEqual(dark.scene_rev, edit.scene_rev)
            session.undo()
            self.assertEqual(view.picture().pixels, lit.pixels)
            self.assertEqual(view.pick(48, 70)["id"], "floor")
            view.update(camera={"position": [0, 2, 7.4], "target": [0, 2, 17]})  # looks away from the room
            self.assertEqual(max(view.picture().luminance()), 0)
            with self.assertRaises(ValueError):
                lit.save_png(os.path.join(folder, "no.png"))
            lit.save_exr(os.path.join(folder, "lit.exr"))
            saved = Exr(os.path.join(folder, "lit.exr"))
            self.assertEqual((saved.width, saved.height), (96, 72))
            for y, row in enumerate(saved.rows()):
                for x in range(0, 96, 7):
                    self.assertEqual(tuple(row[c][x] for c in "RGB"), lit.pixel(x, y), (x, y))
            with session.view(64, 48, spp=1) as small:
                picture = small.picture(converged=False)
                self.assertEqual((picture.width, picture.height, picture.linear), (64, 48, False))
                path = os.path.join(folder, "small.png")
                picture.save_png(path)
                with open(path, "rb") as file:
                    data = file.read()
                self.assertEqual(struct.unpack_from("!2I", data, 16), (64, 48))
                self.assertEqual(picture.pixel(63, 47), tuple(picture.pixels[-4:-1]))
                with self.assertRaises(IndexError):
                    picture.pixel(64, 0)
                with self.assertRaises(ValueError):
                    picture.save_exr(path)

    def test_tiles_come_together(self):
        canvas = Canvas()
        self.assertTrue(canvas.take(read_tile(tile(w=4))))
        whole = canvas.picture(1, False, {}).pixels
        self.assertFalse(canvas.take(read_tile(tile(flags=0, frame=2))))
        self.assertEqual(canvas.picture(1, False, {}).pixels, whole)
        self.assertTrue(canvas.take(read_tile(tile(frame=3, x=2))))  # 2 was cut off: nothing of it shows
        rows = bytes([1] * 8 + [3] * 8)
        self.assertEqual(canvas.picture(1, False, {}).pixels, rows * 2)

    def test_tiles_of_fewer_pixels(self):
        """As rough pictures of `path` have: each pixel covers a square, but for what is beyond the edge."""
        a, b, c, d = (bytes([value] * 4) for value in range(4))
        got = read_tile(tile(w=3, h=3, full=(3, 3), downscale=1, payload=a + b + c + d)).pixels
        self.assertEqual(got, (a * 2 + b) * 2 + c * 2 + d)
        self.assertEqual(read_tile(tile(w=3, h=2, full=(3, 2), downscale=4, payload=a)).pixels, a * 6)

    def test_tiles_that_do_not_fit(self):
        for wrong in (tile()[:63], tile(x=3), tile(downscale=1), tile(downscale=255), tile(payload=b"1234"), tile(codec=1), b"LUMG" + tile()[4:]):
            with self.assertRaises(ValueError):
                read_tile(wrong)
        bomb = tile(codec=4, w=1, h=1, payload=zlib.compress(bytes(1 << 24)))
        with self.assertRaises(ValueError):
            read_tile(bomb)
        rng = random.Random(1)
        for _ in range(2000):
            data = bytearray(tile(codec=rng.choice((0, 4))))
            for _ in range(rng.randrange(1, 8)):
                data[rng.randrange(len(data))] = rng.randrange(256)
            try:
                read_tile(bytes(data))
            except (ValueError, zlib.error):
                pass


class Light(unittest.TestCase):
    def test_sensors_and_the_example(self):
        scene = os.path.join(PYTHON, "examples", "empty.jsonl")
        with Daemon("--scene", scene, "--deterministic", threads=2) as daemon:
            even_light.ROUNDS, even_light.STEPS, even_light.ENOUGH = 1, 2, 0.05
            with contextlib.redirect_stdout(io.StringIO()):
                first, last = even_light.run(url_of(daemon))
            self.assertGreater(last, first)
            with lumend.connect(url_of(daemon)) as session:
                enough = lambda value: value["em_stderr_lx"] < 0.02 * value["em_lx"]
                full = session.sensor("work-plane", enough)
                with session.edit() as edit:
                    for i in range(4):
                        edit.set(f"lamp-{i + 1}", flux_lm=250)
                dim = session.sensor("work-plane", enough)
                self.assertEqual(dim["scene_rev"], edit.scene_rev)
                noise = 4 * ((full["em_stderr_lx"] / full["em_lx"]) ** 2 + (dim["em_stderr_lx"] / dim["em_lx"]) ** 2) ** 0.5
                self.assertLess(abs(10 * dim["em_lx"] / full["em_lx"] - 1), noise + 1e-6)
                probed = session.probe([0, 0.75, 0], [0, 1, 0], samples=256)
                self.assertGreater(probed["illuminance_lx"], dim["emin_lx"] - 5 * probed["stderr_lx"])
                self.assertIn("<h2>Results</h2>", session.report())
            done = subprocess.run([sys.executable, even_light.__file__, url_of(daemon)], capture_output=True, text=True)
            self.assertIn("there are objects in this scene", done.stderr)
            self.assertEqual(done.returncode, 1)


class SlowOpening:
    """In the place of a WebSocket: a server that opens a project for five times 50 s of its clock, and then answers."""
    token = project = None

    def __init__(self, *_):
        self.now_s, self.left, self.ends = 0, 5, threading.Event()
        self.sent = queue.Queue()

    def send(self, message):
        self.sent.put(json.loads(message))

    def receive(self):
        if self.left < 0:
            self.ends.wait()
            raise lumend.Disconnected("the test is over")
        self.left -= 1
        if self.left >= 0:
            self.now_s += 50
            return TEXT, json.dumps({"jsonrpc": "2.0", "method": "project.opening",
                                     "params": {"project": "abc", "stage": "opening", "waited_s": self.now_s}})
        hello = {"session": "a.0-1", "limits": {}, "saved": "no", "project": {"id": "abc", "name": "A"}, "scene_rev": 1}
        return TEXT, json.dumps({"jsonrpc": "2.0", "id": self.sent.get()["id"], "result": hello})

    def shut(self):
        self.ends.set()

    def close(self):
        pass


class Breaks(unittest.TestCase):
    def test_a_project_that_is_being_opened_is_waited_for(self):
        made = []
        make = lambda *_: made.append(SlowOpening()) or made[-1]
        with mock.patch.object(lumend.session, "WebSocket", make), \
             mock.patch.object(lumend.session.time, "monotonic", lambda: made[-1].now_s if made else 0):
            with lumend.Session("", timeout_s=60, project="abc") as session:
                self.assertEqual((session.project["name"], made[-1].now_s), ("A", 250))

    def test_what_is_no_server(self):
        with Daemon() as daemon:
            with self.assertRaisesRegex((lumend.Refused, lumend.Disconnected), "token"):
                lumend.connect(url_of(daemon, "wrong"))
            session = lumend.connect(url_of(daemon), timeout_s=30)
            view = session.view(64, 48, spp=1)
            with self.assertRaises(TimeoutError):
                session.call("stats.get", timeout_s=0)
            view.picture()
            daemon.assert_well()
        with self.assertRaises(lumend.Disconnected):  # it stopped
            while True:
                session.scene()
        with self.assertRaises(lumend.Disconnected):
            view.picture(timeout_s=30) and session.scene()
        session.close()
        with self.assertRaisesRegex(lumend.Disconnected, "does lumend run there"):
            lumend.connect(url_of(daemon))
        for wrong in (daemon.token, "http://localhost:1/a b", "http://localhost:1/?project=a&b", "http://localhost:1/\r\n"):
            with self.assertRaisesRegex(ValueError, "is not a URL"):
                lumend.connect(wrong)

    def test_addresses(self):
        """Where a URL leads to, and what is asked for there."""
        for url, place, path in (("http://a.example:81/#t=x", ("a.example", 81), "/"), ("http://a.example", ("a.example", 80), "/"),
                                 ("http://a.example/b/?project=abc#t=x", ("a.example", 80), "/b/"),
                                 ("ws://[::1]:9460/b/c/", ("::1", 9460), "/b/c/")):
            with mock.patch("socket.create_connection") as create:
                create.return_value.makefile.return_value.readline.return_value = b""
                with self.assertRaises(lumend.Disconnected):
                    lumend.connect(url)
            self.assertEqual(create.call_args[0][0], place)
            asked = create.return_value.sendall.call_args[0][0]
            self.assertTrue(asked.startswith(f"GET {path} HTTP/1.1\r\n".encode()), asked)
        with mock.patch("socket.create_connection", side_effect=OSError) as create:
            with self.assertRaises(lumend.Disconnected):
                lumend.connect("https://a.example/b/")
        self.assertEqual(create.call_args[0][0], ("a.example", 443))

    def test_projects(self):
        with tempfile.TemporaryDirectory() as folder, Daemon("--projects", folder, scene=None) as daemon:
            with lumend.connect(url_of(daemon)) as lobby:
                self.assertIsNone(lobby.project)
                made = lobby.call("project.create", name="Foyer")["project"]
            for session in (lambda: lumend.connect(url_of(daemon), project=made),
                            lambda: lumend.connect(url_of(daemon).replace("/#", f"/?project={made}#"))):
                with session() as session:
                    self.assertEqual(session.project, {"id": made, "name": "Foyer"})
                    self.assertIn("main", session.scene())
            with lumend.connect(url_of(daemon)) as lobby:
                gone = [lobby.call("project.create", name=f"gone {i}")["project"] for i in range(3)]
                for project in gone:
                    lobby.call("project.delete", project=project)
                self.assertEqual(lobby.call("project.erase", project=gone[0]), {"project": gone[0]})
                self.assertEqual(lobby.call("trash.empty"), {"erased": 2})

    def test_records_are_those_of_the_protocol(self):
        done = subprocess.run([sys.executable, os.path.join(PYTHON, "records_from_protocol.py"), "--check"],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    unittest.main()
