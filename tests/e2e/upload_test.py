"""Files that are sent: announced, put, kept by content, imported. And what is not taken: too much, too little, names that
lead elsewhere, what is cut off, what the disk does not take."""
import json
import os
import resource
import tempfile
import unittest

from daemon import Daemon, write_people
from wsclient import RpcError

MIB = 1 << 20
PER_ADDRESS = 64  # LUM_LIMIT_CONNECTIONS_PER_IP
OBJ = b"mtllib m/red.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"
MTL = b"newmtl red\nKd 0.8 0.1 0.1\n"
GLTF = json.dumps({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "buffers": [{"uri": "bin/chair.bin", "byteLength": 36}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
}).encode()
BIN = bytes(12) + b"\0\0\x80\x3f" + bytes(8) + bytes(4) + b"\0\0\x80\x3f" + bytes(4)


def announce(ws, files):
    """files: [(name, bytes)]. Where they are put to."""
    return "/" + ws.call("asset.upload", {"files": [{"name": n, "bytes": len(b)} for n, b in files]})["put"]


def put(daemon, path, body, headers=None):
    """(status, answer); the answer of errors is text."""
    connection = daemon.http()
    connection.request("PUT", path, body=body, headers=headers or {})
    response = connection.getresponse()
    text = response.read().decode()
    connection.close()
    return response.status, json.loads(text) if response.getheader("content-type") == "application/json" else text


def send(daemon, ws, files):
    status, answer = put(daemon, announce(ws, files), b"".join(b for _, b in files))
    assert status == 200, (status, answer)
    return answer["folder"]


def bring(ws, asset, name="m"):
    ws.call("scene.apply", {"ops": [{"op": "import", "id": name, "asset": asset}]})


def names_below(folder):
    return sorted(os.path.relpath(os.path.join(at, f), folder) for at, _, files in os.walk(folder) for f in files)


class Uploads(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.daemon = None

    def serve(self, *options):
        self.daemon = self.enterContext(Daemon("--state", self.folder, *options))
        return self.daemon.connect()

    def begin(self, path, n_bytes, body=b"x", daemon=None):
        """A connection by which only a beginning came."""
        line = (daemon or self.daemon).tcp()
        line.sendall(f"PUT {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {n_bytes}\r\n\r\n".encode() + body)
        return line

    def kept(self):
        return names_below(os.path.join(self.folder, "upload"))

    def refused(self, ws, files, app, part):
        """files: what asset.upload is asked."""
        with self.assertRaises(RpcError) as caught:
            ws.call("asset.upload", {"files": files})
        self.assertEqual(caught.exception.app, app, str(caught.exception))
        self.assertIn(part, str(caught.exception))

    # ---- what is taken ----

    def test_models_with_their_files(self):
        ws = self.serve()
        folder = send(self.daemon, ws, [("one.obj", OBJ), ("m/red.mtl", MTL)])
        self.assertRegex(folder, "^upload/[0-9a-f]{32}$")
        bring(ws, folder + "/one.obj", "o")
        made = {op["id"]: op for op in ws.call("scene.get", {"expand": True})["ops"] if op.get("origin") == "o"}
        self.assertIn([0.8, 0.1, 0.1], [[round(c, 3) for c in r["base_color"]] for r in made.values() if r["type"] == "material"])
        folder = send(self.daemon, ws, [("g/chair.gltf", GLTF), ("g/bin/chair.bin", BIN), ("g/empty.txt", b"")])
        bring(ws, folder + "/g/chair.gltf", "g")
        self.assertIn("g", {op.get("origin") for op in ws.call("scene.get", {"expand": True})["ops"]})
        for at, _, files in os.walk(os.path.join(self.folder, "upload")):
            self.assertEqual(os.stat(at).st_mode & 0o777, 0o700)
            for name in files:
                self.assertEqual(os.stat(os.path.join(at, name)).st_mode & 0o777, 0o600)

    def test_the_same_is_kept_once_and_another_name_is_another(self):
        ws = self.serve("--upload-mib", "1")
        body = os.urandom(300000)
        first = send(self.daemon, ws, [("a.glb", body)])
        for _ in range(5):  # 1 MiB would not hold them
            self.assertEqual(send(self.daemon, ws, [("a.glb", body)]), first)
        self.assertNotEqual(send(self.daemon, ws, [("b.glb", body)]), first)
        self.assertNotEqual(send(self.daemon, ws, [("a.glb", body[:-1]), ("b", body[-1:])]), first)
        self.refused(ws, [{"name": "c.glb", "bytes": 300000}], "limit_exceeded", "keeps 1 MiB of uploads")
        self.assertEqual(len(self.kept()), 4)

    def test_it_outlives_a_start(self):
        ws = self.serve()
        folder = send(self.daemon, ws, [("one.obj", OBJ), ("m/red.mtl", MTL)])
        os.mkdir(os.path.join(self.folder, "upload", "part-7"))  # as a crash leaves it
        with open(os.path.join(self.folder, "upload", "part-7", "x"), "wb") as file:
            file.write(bytes(100))
        self.daemon.stop()
        ws = self.serve("--upload-mib", "1")
        self.assertFalse(os.path.exists(os.path.join(self.folder, "upload", "part-7")))
        bring(ws, folder + "/one.obj")
        self.refused(ws, [{"name": "c", "bytes": MIB - len(OBJ + MTL) + 1}], "limit_exceeded", "MiB of uploads")
        announce(ws, [("c", bytes(MIB - len(OBJ + MTL)))])

    def test_without_state_it_is_kept_as_long_as_the_daemon_runs(self):
        with tempfile.TemporaryDirectory() as tmp:
            with Daemon(environment={"TMPDIR": tmp}) as daemon:
                ws = daemon.connect()
                bring(ws, send(daemon, ws, [("one.obj", OBJ), ("m/red.mtl", MTL)]) + "/one.obj")
                self.assertEqual(len(names_below(tmp)), 2)
            self.assertEqual(os.listdir(tmp), [])

    def test_what_a_killed_one_left_is_removed_and_nothing_else(self):
        with tempfile.TemporaryDirectory() as tmp:
            for name, mode in (("lumend-backup", 0o700), ("lumend-uploads-shared", 0o755)):  # of people
                os.mkdir(os.path.join(tmp, name))
                os.chmod(os.path.join(tmp, name), mode)
            os.symlink(tmp, os.path.join(tmp, "lumend-uploads-link"))
            people = sorted(os.listdir(tmp))
            with Daemon(environment={"TMPDIR": tmp}) as running:
                ws = running.connect()
                kept = send(running, ws, [("one.obj", OBJ), ("m/red.mtl", MTL)])
                before = set(os.listdir(tmp))
                killed = Daemon(environment={"TMPDIR": tmp})
                left = os.path.join(tmp, (set(os.listdir(tmp)) - before).pop())
                sender = killed.connect()
                line = self.begin(announce(sender, [("a", bytes(3 * MIB))]), 3 * MIB, bytes(MIB), killed)
                while not names_below(left):  # a part of it is on disk
                    sender.call("scene.get")
                for end in (killed.process.kill, killed.process.wait, killed.process.stdout.close, killed.log.close, line.close):
                    end()
                with Daemon(environment={"TMPDIR": tmp}):
                    self.assertFalse(os.path.exists(left))
                    self.assertEqual(len(os.listdir(tmp)), len(people) + 2)
                bring(ws, kept + "/one.obj")  # what the running one has is still there
            self.assertEqual(sorted(os.listdir(tmp)), people)

    def test_photometry_is_in_the_list(self):
        ws = self.serve()
        folder = send(self.daemon, ws, [("lamp.ies", b"IESNA:LM-63-2002\n")])
        self.assertEqual([a["asset"] for a in ws.call("asset.list", {"kind": "photometry"})["assets"]], [folder + "/lamp.ies"])

    def test_a_large_one_stops_nobody(self):
        ws = self.serve()
        other = self.daemon.connect()
        body = os.urandom(MIB) * 48
        path = announce(ws, [("large.bin", body)])
        line = self.begin(path, len(body), b"")
        for at in range(0, len(body), 4 * MIB):
            line.sendall(body[at:at + 4 * MIB])
            other.call("scene.get")
        self.assertTrue(line.recv(100).startswith(b"HTTP/1.1 200 "))
        line.close()
        kept, = self.kept()
        with open(os.path.join(self.folder, "upload", kept), "rb") as file:
            self.assertEqual(file.read(), body)

    # ---- what is not ----

    def test_names(self):
        ws = self.serve()
        for name in ("", "/a", "a/", "a//b", ".", "..", "../a", "a/../b", "a/./b", ".hidden", "a/.b", "a\\b", "a\nb", "\x7f",
                     "..\\a", "x" * 181, "C:\\a", "a/..", "/etc/passwd", "\u0001"):
            with self.subTest(name), self.assertRaises(RpcError) as caught:
                ws.call("asset.upload", {"files": [{"name": name, "bytes": 1}]})
            self.assertEqual(caught.exception.data["path"], "files/0/name")
        self.refused(ws, [{"name": "a", "bytes": 1}, {"name": "a", "bytes": 2}], "invalid_value", 'the name "a"')
        path = announce(ws, [("a", b"1"), ("a/b", b"2")])  # a file cannot be a folder: the disk says so
        status, answer = put(self.daemon, path, b"12")
        self.assertEqual(status, 507)
        self.assertIn("a", answer["error"])
        self.assertEqual(self.kept(), [])
        for asset in ("upload/../journal-0", "upload/part-0/a", "../upload/a", "upload"):
            with self.assertRaises(RpcError):
                bring(ws, asset)

    def test_announcements(self):
        ws = self.serve()
        for files in (None, {}, [], [1], [{"name": "a"}], [{"bytes": 1}], [{"name": "a", "bytes": -1}], [{"name": "a", "bytes": 1.5}],
                      [{"name": "a", "bytes": 1, "x": 1}], [{"name": "a", "bytes": 0}],
                      [{"name": f"f{i}", "bytes": 1} for i in range(257)]):
            with self.subTest(str(files)[:60]), self.assertRaises(RpcError):
                ws.call("asset.upload", {"files": files})
        self.refused(ws, [{"name": "a", "bytes": 512 * MIB + 1}], "limit_exceeded", "at most 512 MiB")
        self.refused(ws, [{"name": "a", "bytes": 2 ** 53}, {"name": "b", "bytes": 2 ** 53}], "limit_exceeded", "at most 512 MiB")
        announce(ws, [(f"f{i}", b"1") for i in range(256)])
        self.daemon.assert_well()

    def test_a_session_has_its_share(self):
        ws = self.serve("--upload-mib", "1048576")
        n = 0
        while n < 4:  # 2 GiB in all; none of it comes
            try:
                path = "/" + ws.call("asset.upload", {"files": [{"name": "a", "bytes": 512 * MIB}]})["put"]
            except RpcError as error:
                self.assertEqual(error.app, "busy")  # the one before is not over yet
                continue
            n += 1
            line = self.begin(path, 512 * MIB)
            while not self.kept():
                ws.call("scene.get")
            line.close()
            while self.kept():
                ws.call("scene.get")
        self.refused(ws, [{"name": "a", "bytes": 1}], "limit_exceeded", "2048 MiB in all")
        other = self.daemon.connect()
        self.assertEqual(put(self.daemon, announce(other, [("a", b"1")]), b"1")[0], 200)

    def test_lengths(self):
        ws = self.serve()
        for body, headers, status in ((b"12", None, 400), (b"1234", None, 400), (b"", None, 400),
                                      (iter([b"123"]), {"Transfer-Encoding": "chunked"}, 411),
                                      (b"123", {"Content-Length": "+3"}, 411), (b"123", {"Content-Length": "3x"}, 411)):
            with self.subTest(str(headers)):
                path = announce(ws, [("a", b"123")])
                self.assertEqual(put(self.daemon, path, body, headers)[0], status)
                self.assertEqual(put(self.daemon, path, b"123")[0], 200)  # who is wrong may try again
        self.assertEqual(len(self.kept()), 1)

    def test_tickets(self):
        ws = self.serve()
        path = announce(ws, [("a", b"123")])
        for wrong in (path[:-1], path + "x", path[:-1] + ("A" if path[-1] != "A" else "B"), "/upload/"):
            self.assertEqual(put(self.daemon, wrong, b"123")[0], 404, wrong)
        for wrong in ("/", "/upload", path.replace("upload", "uploads")):
            self.assertEqual(put(self.daemon, wrong, b"123")[0], 405, wrong)
        self.assertEqual(put(self.daemon, path, b"123", {"Origin": "http://evil.example"})[0], 403)
        self.assertEqual(put(self.daemon, path, b"123", {"Host": "evil.example"})[0], 403)
        self.assertEqual(self.daemon.get(path)[0], 404)
        self.assertEqual(put(self.daemon, path, b"123")[0], 200)
        self.assertEqual(put(self.daemon, path, b"123")[0], 404)  # once
        path = announce(ws, [("b", b"123")])
        ws.leave()
        other = self.daemon.connect()
        other.call("scene.get")
        while put(self.daemon, path, b"12")[0] != 404:  # a wrong length does not take it, until the session is gone
            other.call("scene.get")
        self.daemon.assert_well()

    def test_two_at_once(self):
        ws = self.serve()
        first = announce(ws, [("a", b"123")])
        self.refused(ws, [{"name": "b", "bytes": 1}], "busy", "on their way already")
        others = [self.daemon.connect() for _ in range(4)]
        paths = [announce(other, [("a", bytes([i]))]) for i, other in enumerate(others[:3])]
        self.refused(others[3], [{"name": "b", "bytes": 1}], "busy", "4 uploads are on their way")
        for path, body in ((first, b"123"), *((p, bytes([i])) for i, p in enumerate(paths))):
            self.assertEqual(put(self.daemon, path, body)[0], 200)
        self.assertEqual(len(self.kept()), 4)

    def test_who_sends_makes_no_room_for_guests(self):
        """However many connect from the same address: behind a proxy, or in an office, that is everybody."""
        ws, body = self.serve(), bytes(100000)
        line = self.begin(announce(ws, [("a", body)]), len(body), body[:1000])
        while not self.kept():  # it has begun
            ws.call("scene.get")
        guests = [self.daemon.tcp() for _ in range(PER_ADDRESS + 10)]
        while self.daemon.metric("connections_turned_out_total") < 10:
            pass
        line.sendall(body[1000:])
        self.assertIn(b" 200 ", line.recv(1000)[:20])
        for sock in (line, *guests):
            sock.close()

    def test_cut_off_in_the_middle(self):
        """By its own connection, or because its session ended: nothing is kept, and the place is free again."""
        ws = self.serve("--upload-mib", "1")
        for end in ("line", "session"):
            owner = self.daemon.connect()
            path = announce(owner, [("a", bytes(700000))])
            line = self.begin(path, 700000, bytes(1000))
            while not self.kept():  # it has begun
                ws.call("scene.get")
            if end == "line":
                line.close()
            else:
                owner.leave()
            while self.kept():
                ws.call("scene.get")
            if end == "session":
                line.sendall(bytes(1000))
                self.assertEqual(line.recv(100), b"")
                line.close()
        self.assertEqual(put(self.daemon, self.announce_when_free(ws, bytes(700000)), bytes(700000))[0], 200)
        self.assertEqual(len(self.kept()), 1)

    def announce_when_free(self, ws, body):
        """The path of a PUT, as soon as there is room: a cut-off upload gives back its place a moment after its files are gone."""
        while True:
            try:
                return announce(ws, [("a", body)])
            except RpcError as refused:
                if refused.app != "limit_exceeded":
                    raise

    def test_a_full_disk(self):
        """A limit of the size of files stands for the disk."""
        ws = self.serve()
        path = announce(ws, [("a", bytes(3 * MIB)), ("b", b"1")])
        resource.prlimit(self.daemon.process.pid, resource.RLIMIT_FSIZE, (MIB, resource.RLIM_INFINITY))
        status, answer = put(self.daemon, path, bytes(3 * MIB) + b"1")
        self.assertEqual(status, 507)
        self.assertIn("cannot write a", answer["error"])
        self.assertEqual(self.kept(), [])
        resource.prlimit(self.daemon.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        self.assertEqual(put(self.daemon, announce(ws, [("a", bytes(3 * MIB))]), bytes(3 * MIB))[0], 200)

    def test_it_can_be_off(self):
        ws = self.serve("--upload-mib", "0")
        self.refused(ws, [{"name": "a", "bytes": 1}], "unsupported", "takes no files")
        self.assertEqual(put(self.daemon, "/upload/" + "a" * 32, b"1")[0], 405)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "upload")))

    def test_who_may(self):
        people = os.path.join(self.folder, "people")
        token = "a-token-long-enough-for-this-test"
        write_people(people, {"vic": ("view", token + "v"), "mia": ("measure", token + "m"), "eve": ("edit", token + "e")})
        daemon = self.enterContext(Daemon("--tokens", people))
        for letter in "vm":
            daemon.token = token + letter
            self.refused(daemon.connect(), [{"name": "a", "bytes": 1}], "forbidden", "needs the role edit")
        daemon.token = token + "e"
        announce(daemon.connect(), [("a", b"1")])

    def test_it_ends_while_files_come(self):
        ws = self.serve()
        path = announce(ws, [("a", bytes(1000))])
        line = self.begin(path, 1000)
        while not self.kept():
            ws.call("scene.get")
        self.assertEqual(self.daemon.stop(), 0)
        self.assertEqual(self.kept(), [])
        line.close()


if __name__ == "__main__":
    unittest.main()
