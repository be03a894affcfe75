"""--projects: many scenes in one daemon. Nobody sees anything of another's, and all is there again after any end."""
import fcntl
import http.client
import json
import os
import re
import tempfile
import time
import unittest

from daemon import Daemon
from wsclient import Closed, RpcError

HERE = os.path.dirname(os.path.abspath(__file__))
LAMP = {"op": "add", "type": "light", "kind": "point", "position": [0, 1, 0], "flux_lm": 100}
NAMES = ["Sankt Nikolai – Chor", "../../etc/passwd", "a/b", "'; DROP TABLE", "<img src=x onerror=alert(1)>", "日本語", "x" * 120,
         "%s%n", ".", ".."]
NO_NAMES = ["", " ", " a", "a ", "a\nb", "\u007f", "\u0085", "\u202eabc", "\u2066", "x" * 121, "\u00e4" * 61, 5, []]
NO_IDS = ["", ".", "..", "../..", "/etc", "trash", "lock", "a" * 12, "A" * 12, "a" * 13, "aaaaaaaaaaa/", "part.aaaaaaa", "\u00e4" * 6, 7,
          None, {}]


class Projects(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())

    def start(self, *options):
        return Daemon("--projects", self.folder, *options, scene=None)

    def enter(self, daemon, project, **more):
        ws = daemon.connect(hello=False)
        self.hello = ws.hello(daemon.token, project=project, **more)
        return ws

    def lamps(self, ws):
        return sorted(op["id"] for op in ws.call("scene.get")["ops"] if op.get("type") == "light")

    def add(self, ws, name):
        return ws.call("scene.apply", {"ops": [{**LAMP, "id": name}]})["scene_rev"]

    def wait_closed(self, daemon):
        while daemon.metric("projects_open") > 0:
            time.sleep(0.05)  # between questions: it closes by itself

    def refused(self, code, call):
        with self.assertRaises(RpcError) as caught:
            call()
        self.assertEqual(caught.exception.app, code, caught.exception)
        return str(caught.exception)

    def test_two_that_see_nothing_of_each_other(self):
        with self.start() as daemon:
            lobby = daemon.connect(hello=False)
            hello = lobby.hello(daemon.token)
            self.assertEqual((hello["projects"], hello["project"], hello["scene_rev"]), (True, None, None))
            self.refused("unsupported", lambda: lobby.call("scene.get"))
            a = lobby.call("project.create", {"name": "A"})["project"]
            b = lobby.call("project.create", {"name": "B", "scene": "furnace"})["project"]
            in_a = self.enter(daemon, a)
            self.assertEqual(self.hello["project"], {"id": a, "name": "A"})
            in_b = self.enter(daemon, b)
            for i in range(3):
                self.add(in_a, f"a{i}")
                self.add(in_b, f"b{i}")
            self.assertEqual(self.lamps(in_a), ["a0", "a1", "a2"])
            self.assertEqual([lamp for lamp in self.lamps(in_b) if lamp.startswith(("a", "b"))], ["b0", "b1", "b2"])
            changed = {ws: [p["ops"][0]["id"] for m, p in ws.notifications if m == "scene.changed"] for ws in (in_a, in_b)}
            self.assertEqual(changed, {in_a: ["a0", "a1", "a2"], in_b: ["b0", "b1", "b2"]})
            view = in_a.call("view.open", {"size": [16, 16], "camera_id": "main"})["view_id"]
            self.refused("not_found", lambda: in_b.call("view.read", {"view_id": view, "x": 1, "y": 1}))
            in_a.call("scene.undo")
            other_in_a = self.enter(daemon, a)
            self.refused("not_found", lambda: other_in_a.call("scene.undo"))
            listed = {p["name"]: p for p in lobby.call("project.list")["projects"]}
            self.assertEqual([listed[n]["id"] for n in "AB"], [a, b])
            self.assertIn(self.hello["session"], listed["A"]["people"])
            self.assertEqual(len(listed["B"]["people"]), 1)
            self.assertEqual(daemon.get("/readyz")[0], 200)
            self.assertEqual(daemon.metric("projects_open"), 2)
            self.assertEqual(daemon.metric("edits_total"), 7)

    def test_closed_when_unused_and_there_again_after_any_end(self):
        with self.start("--close-unused", "1") as daemon:
            lobby = daemon.connect()
            project = lobby.call("project.create", {"name": "Foyer"})["project"]
            ws = self.enter(daemon, project)
            self.add(ws, "kept")
            ws.leave()
            self.wait_closed(daemon)
            ws = self.enter(daemon, project)
            self.assertEqual(self.lamps(ws), ["kept"])
            self.assertGreaterEqual(daemon.metric("projects_closed_total"), 1)
            self.add(ws, "killed")
            daemon.process.kill()
            daemon.process.wait()
            daemon.stop = lambda: 0
            daemon.process.stdout.close()
        os.mkdir(os.path.join(self.folder, "part." + "a" * 12))  # a creation that a crash cut short
        os.mkdir(os.path.join(self.folder, "b" * 12))  # a folder that is none of ours
        os.symlink("/", os.path.join(self.folder, "c" * 12))
        with self.start() as daemon:
            lobby = daemon.connect()
            self.assertEqual([p["name"] for p in lobby.call("project.list")["projects"]], ["Foyer"])
            self.assertFalse(os.path.exists(os.path.join(self.folder, "part." + "a" * 12)))
            self.assertEqual(self.lamps(self.enter(daemon, project)), ["kept", "killed"])

    def test_the_longest_unused_makes_room(self):
        with self.start("--open-projects", "1") as daemon:
            lobby = daemon.connect()
            a, b = (lobby.call("project.create", {"name": n})["project"] for n in "AB")
            ws = self.enter(daemon, a)
            self.add(ws, "mine")
            self.assertIn("--open-projects", self.refused("busy", lambda: self.enter(daemon, b)))
            ws.leave()
            ws = self.enter(daemon, b)  # waits until A is closed
            self.assertEqual(self.lamps(ws), [])
            ws.leave()
            self.assertEqual(self.lamps(self.enter(daemon, a)), ["mine"])

    def test_deleted_and_brought_back(self):
        with self.start() as daemon:
            lobby = daemon.connect()
            project = lobby.call("project.create", {"name": "Foyer"})["project"]
            ws = self.enter(daemon, project)
            self.add(ws, "kept")
            self.refused("in_use", lambda: lobby.call("project.delete", {"project": project}))
            ws.leave()
            while True:
                try:
                    lobby.call("project.delete", {"project": project})
                    break
                except RpcError as error:
                    self.assertEqual(error.app, "in_use")  # the daemon has not seen yet that she left
            self.refused("not_found", lambda: self.enter(daemon, project))
            listed = lobby.call("project.list")
            self.assertEqual(([p["id"] for p in listed["projects"]], [p["id"] for p in listed["trash"]]), ([], [project]))
        with self.start() as daemon:
            lobby = daemon.connect()
            self.refused("not_found", lambda: lobby.call("project.rename", {"project": project, "name": "x"}))
            lobby.call("project.restore", {"project": project})
            lobby.call("project.rename", {"project": project, "name": "Foyer, 2nd"})
            self.refused("not_found", lambda: lobby.call("project.restore", {"project": project}))
            self.assertEqual(self.lamps(self.enter(daemon, project)), ["kept"])
            self.assertEqual(self.hello["project"]["name"], "Foyer, 2nd")

    def test_removed_for_ever(self):
        left = lambda: sorted(name.split(".")[0] for name in os.listdir(self.folder) if name != "lock")
        with self.start("--close-unused", "1", "--audit") as daemon:
            lobby = daemon.connect()
            first, second, third = (lobby.call("project.create", {"name": n})["project"] for n in ("First", "Second", "Third"))
            ws = self.enter(daemon, first)
            self.add(ws, "a")
            lobby.call("version.keep", {"project": first, "name": "with a"})
            self.assertIn("trash", self.refused("in_use", lambda: lobby.call("project.erase", {"project": first})))
            ws.leave()
            self.wait_closed(daemon)
            self.assertIn("trash", self.refused("not_found", lambda: lobby.call("project.erase", {"project": first})))
            self.refused("not_found", lambda: lobby.call("project.erase", {"project": "a" * 12}))
            lobby.call("project.delete", {"project": first})
            self.assertEqual(lobby.call("project.erase", {"project": first}), {"project": first})
            self.assertEqual(left(), sorted([second, third]))
            self.refused("not_found", lambda: lobby.call("project.restore", {"project": first}))
            self.refused("not_found", lambda: self.enter(daemon, first))
            for project in (second, third):
                lobby.call("project.delete", {"project": project})
            self.assertEqual(lobby.call("trash.empty"), {"erased": 2})
            self.assertEqual((left(), lobby.call("trash.empty"), lobby.call("project.list")["trash"]), ([], {"erased": 0}, []))
            self.assertRegex(daemon.read_log(), f'{first} is removed for ever by [^ ]+: .*First')
            self.assertRegex(daemon.read_log(), "the trash is emptied by [^ ]+: 2 projects")
        os.makedirs(os.path.join(self.folder, "part." + first, "content"))  # of a removal that a crash cut short
        with self.start() as daemon:
            listed = daemon.connect().call("project.list")
            self.assertEqual((listed["projects"], listed["trash"], left()), ([], [], []))

    def test_killed_while_the_trash_is_emptied(self):
        with self.start() as daemon:
            lobby = daemon.connect()
            made = [lobby.call("project.create", {"name": f"room {i}", "scene": "furnace"})["project"] for i in range(12)]
            for project in made:
                lobby.call("version.keep", {"project": project, "name": "as it was"})
                lobby.call("project.delete", {"project": project})
            lobby.send_request("trash.empty")
            while sum(name.startswith("trash.") for name in os.listdir(self.folder)) > 8:
                pass  # in the midst of it, wherever that is
            daemon.process.kill()
            daemon.process.wait()
            daemon.stop = lambda: 0
            daemon.process.stdout.close()
        with self.start() as daemon:
            lobby = daemon.connect()
            self.assertEqual([name for name in os.listdir(self.folder) if name.startswith("part.")], [])
            trash = [p["id"] for p in lobby.call("project.list")["trash"]]
            self.assertLessEqual(set(trash), set(made))
            for project in trash:  # whole, with its version
                lobby.call("project.restore", {"project": project})
                self.assertEqual(len(lobby.call("version.list", {"project": project})["versions"]), 1)
            if trash:
                self.assertIn("ops", self.enter(daemon, trash[0]).call("scene.get"))

    def test_copies_and_versions_go_their_own_way(self):
        model = os.path.join(HERE, "web", "lamp.gltf")
        with open(model, "rb") as file:
            body = file.read()
        with self.start("--close-unused", "1") as daemon:
            lobby = daemon.connect()
            first = lobby.call("project.create", {"name": "First"})["project"]
            ws = self.enter(daemon, first)
            put = ws.call("asset.upload", {"files": [{"name": "lamp.gltf", "bytes": len(body)}]})["put"]
            connection = http.client.HTTPConnection("127.0.0.1", daemon.port)
            connection.request("PUT", "/" + put, body=body)
            asset = json.load(connection.getresponse())["folder"] + "/lamp.gltf"
            connection.close()
            ws.call("scene.apply", {"ops": [{"op": "import", "id": "lamp", "asset": asset}]})
            self.add(ws, "a")
            version = ws.call("version.keep", {"project": first, "name": "with a"})["version"]
            self.add(ws, "b")
            copy = ws.call("project.create", {"name": "Copy", "from": first})["project"]  # of one that is open
            self.add(ws, "c")
            ws.leave()
            in_copy = self.enter(daemon, copy)
            self.assertEqual(self.lamps(in_copy), ["a", "b"])
            self.refused("not_found", lambda: in_copy.call("scene.undo"))
            in_copy.call("scene.apply", {"ops": [{"op": "remove", "id": "lamp"}, {"op": "import", "id": "again", "asset": asset}]})
            in_copy.leave()
            self.wait_closed(daemon)
            late = lobby.call("project.create", {"name": "Late", "from": first})["project"]  # of one that is closed
            then = lobby.call("project.create", {"name": "Then", "from": first, "version": version})["project"]
            untouched = lobby.call("project.create", {"name": "Untouched", "scene": "furnace"})["project"]
            same = lobby.call("project.create", {"name": "Same", "from": untouched})["project"]  # nobody was ever in it
            self.assertEqual(self.lamps(self.enter(daemon, late)), ["a", "b", "c"])
            self.assertEqual(self.lamps(self.enter(daemon, then)), ["a"])
            self.assertTrue(self.enter(daemon, same).call("scene.get")["ops"])
            listed = lobby.call("version.list", {"project": first})["versions"]
            self.assertEqual([(v["version"], v["name"]) for v in listed], [(version, "with a")])
            lobby.call("version.remove", {"project": first, "version": version})
            self.refused("not_found", lambda: lobby.call("version.remove", {"project": first, "version": version}))
            self.refused("not_found", lambda: lobby.call("project.create", {"name": "x", "from": first, "version": version}))
            self.refused("not_found", lambda: lobby.call("project.create", {"name": "x", "from": "a" * 12}))
            self.refused("invalid_value", lambda: lobby.call("project.create", {"name": "x", "from": first, "scene": "furnace"}))
            self.refused("invalid_value", lambda: lobby.call("project.create", {"name": "x", "version": version}))
            self.assertEqual(lobby.call("version.list", {"project": first})["versions"], [])
        left = [name for _, folders, files in os.walk(self.folder) for name in folders + files if name.startswith("part")]
        self.assertEqual(left, [])

    def test_names_and_ids_from_anywhere(self):
        with self.start() as daemon:
            lobby = daemon.connect()
            for name in NAMES:
                lobby.call("project.create", {"name": name})
            for name in NO_NAMES:
                self.refused("invalid_value", lambda name=name: lobby.call("project.create", {"name": name}))
            for project in NO_IDS:
                for method in ("delete", "restore", "erase", "rename"):
                    more = {"name": "x"} if method == "rename" else {}
                    with self.assertRaises(RpcError):
                        lobby.call(f"project.{method}", {"project": project, **more})
                if project:
                    with self.assertRaises(RpcError):
                        self.enter(daemon, project)
            self.assertEqual([p["name"] for p in lobby.call("project.list")["projects"]], NAMES)
            folders = [name for name in os.listdir(self.folder) if name != "lock"]
            self.assertEqual((len(folders), {len(name) for name in folders}), (len(NAMES), {12}))

    def test_who_comes_back_comes_back_to_hers(self):
        with self.start() as daemon:
            lobby = daemon.connect()
            a, b = (lobby.call("project.create", {"name": n})["project"] for n in "AB")
            ws = self.enter(daemon, a)
            me = {"resume": self.hello["session"], "key": self.hello["key"]}
            self.add(ws, "mine")
            ws.close()
            self.enter(daemon, b, **me)
            self.assertFalse(self.hello["resumed"])
            ws = self.enter(daemon, a, **me)
            self.assertTrue(self.hello["resumed"])
            ws.call("scene.undo")
            self.assertEqual(self.lamps(ws), [])

    def test_who_waits_hears_so_and_who_is_refused_has_an_end(self):
        with self.start() as daemon:
            lobby = daemon.connect()
            a, b = (lobby.call("project.create", {"name": n})["project"] for n in "AB")
            ws = daemon.connect(hello=False)
            with open(os.path.join(self.folder, a, "lock"), "w", encoding="utf-8") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)  # another writes there: it cannot be opened
                self.refused("conflict", lambda: ws.hello(daemon.token, project=a))
                told = {"project": a, "stage": "opening", "waited_s": 0}
                self.assertEqual(ws.notifications[0], ("project.opening", told))
                ws.hello(daemon.token, project=b)  # another one, in time
                self.assertEqual(ws.notifications[-1][1]["project"], b)
                silent = daemon.connect(hello=False)
                self.refused("conflict", lambda: silent.hello(daemon.token, project=a))
                with self.assertRaises(Closed) as caught:
                    silent.wait_notification("nothing more")
                self.assertEqual(caught.exception.code, 4001)
            ws.call("scene.get")  # who said hello in time stays
            silent = self.enter(daemon, a)
            self.assertEqual(self.lamps(silent), [])

    def test_the_list_tells_each_change_and_reads_nothing(self):
        with self.start("--close-unused", "1") as daemon:
            lobby = daemon.connect()

            def listed(again=True):
                answer = lobby.call("project.list")
                if again:  # what was written is given again
                    self.assertEqual(answer, lobby.call("project.list"))
                return [(p["name"], p["open"], len(p["people"])) for p in answer["projects"]], [p["name"] for p in answer["trash"]]

            def comes(what):  # what the daemon sees by itself: that somebody left
                while listed(again=False) != what:
                    time.sleep(0.05)  # between questions, of which a session may ask so many a second

            self.assertEqual(listed(), ([], []))
            a = lobby.call("project.create", {"name": "A"})["project"]
            self.assertEqual(listed(), ([("A", False, 0)], []))
            ann = self.enter(daemon, a)
            self.assertEqual(listed(), ([("A", True, 1)], []))
            bob = self.enter(daemon, a)
            self.assertEqual(listed(), ([("A", True, 2)], []))
            changed_s = lobby.call("project.list")["projects"][0]["changed_s"]
            while lobby.call("project.list")["projects"][0]["changed_s"] == changed_s:
                ann.call("scene.apply", {"ops": [{"op": "set", "id": "render", "path": "/exposure_ev", "value": 3}]})
                time.sleep(0.05)  # until a second is over, of which a session may send so many messages
            lobby.call("project.rename", {"project": a, "name": "B"})
            self.assertEqual(listed(), ([("B", True, 2)], []))
            ann.leave()
            comes(([("B", True, 1)], []))
            bob.close()
            comes(([("B", False, 0)], []))
            lobby.call("project.delete", {"project": a})
            self.assertEqual(listed(), ([], ["B"]))
            lobby.call("project.restore", {"project": a})
            self.assertEqual(listed(), ([("B", False, 0)], []))
            lobby.call("project.delete", {"project": a})
            lobby.call("project.erase", {"project": a})
            self.assertEqual(listed(), ([], []))
            for i in range(30):
                lobby.call("project.create", {"name": f"room {i}"})
            read = lambda: self.bytes_read(daemon.process.pid)
            before = read()
            for _ in range(100):
                lobby.call("project.list")
            self.assertLess(read() - before, 100 * 30)  # the thread of the network wakes up, and reads no file

    def bytes_read(self, pid):
        with open(f"/proc/{pid}/task/{pid}/io", encoding="ascii") as file:
            return int(re.search(r"rchar: (\d+)", file.read())[1])

    def test_one_scene_has_no_projects(self):
        with Daemon() as daemon:
            ws = daemon.connect()
            self.refused("unsupported", lambda: ws.call("project.list"))
            self.refused("unsupported", lambda: ws.call("project.create", {"name": "x"}))
            self.refused("unsupported", lambda: self.enter(daemon, "a" * 12))


if __name__ == "__main__":
    unittest.main()
