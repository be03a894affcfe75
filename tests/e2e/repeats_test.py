"""What was done is known after kill -9: an edit that is sent again is answered as it was, and not done twice."""
import os
import struct
import subprocess
import tempfile
import unittest
import zlib

from daemon import LUMEND, Daemon
from wsclient import RpcError


def lamp(name, flux):
    return {"op": "add", "type": "light", "id": name, "kind": "point", "flux_lm": flux}


def dim(flux):
    return {"op": "set", "id": "l", "path": "/flux_lm", "value": flux}


class Repeats(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.begin()

    def begin(self):
        self.daemon = Daemon("--state", self.folder)
        self.addCleanup(self.end, self.daemon)

    def end(self, daemon):
        if daemon.process.poll() is None:
            daemon.process.kill()
            daemon.process.wait()
        daemon.process.stdout.close()
        daemon.log.close()

    def hello(self, name, resume=None):
        ws = self.daemon.connect(hello=False)
        more = {"resume": resume} if resume else {}
        return ws, ws.call("session.hello", {"token": self.daemon.token, "client": name, **more})["session"]

    def killed_and_back(self, *names, compact=False):
        self.end(self.daemon)
        if compact:
            subprocess.run([LUMEND, "state", "compact", self.folder], check=True, capture_output=True)
        self.begin()
        return [self.hello("x", name)[0] for name in names]

    def flux(self, ws):
        return next(op["flux_lm"] for op in ws.call("scene.get")["ops"] if op.get("id") == "l")

    def again(self, ws, method, op_id, rev, **more):
        answer = ws.call(method, {"op_id": op_id, "repeat": True, **more})
        self.assertEqual(answer, {"scene_rev": rev, "repeated": True})

    def test_edits_undo_and_redo(self):
        ws, ann = self.hello("ann")
        ws.call("scene.apply", {"ops": [lamp("l", 1)]})
        revs = {"a1": ws.call("scene.apply", {"op_id": "a1", "ops": [dim(2)]})["scene_rev"],
                "a2": ws.call("scene.apply", {"op_id": "a2", "ops": [dim(3)]})["scene_rev"],
                "u1": ws.call("scene.undo", {"op_id": "u1"})["scene_rev"],
                "u2": ws.call("scene.undo", {"op_id": "u2"})["scene_rev"],
                "r1": ws.call("scene.redo", {"op_id": "r1"})["scene_rev"]}
        for compact in (False, False, True):  # from the journal, then from snapshots
            ws, = self.killed_and_back(ann, compact=compact)
            before = ws.call("scene.get")["scene_rev"]
            for op_id, flux in (("a1", 8), ("a2", 9)):
                self.again(ws, "scene.apply", op_id, revs[op_id], ops=[dim(flux)])
            self.again(ws, "scene.undo", "u1", revs["u1"])
            self.again(ws, "scene.undo", "u2", revs["u2"])
            self.again(ws, "scene.redo", "r1", revs["r1"])
            self.assertEqual(self.flux(ws), 2)
            self.assertEqual(ws.call("scene.get")["scene_rev"], before)
        self.assertNotIn("repeated", ws.call("scene.apply", {"op_id": "a3", "repeat": True, "ops": [dim(5)]}))

    def test_an_undo_that_was_refused_is_refused_again(self):
        ws, ann = self.hello("ann")
        bob, _ = self.hello("bob")
        for flux in (2, 3):
            ws.call("scene.apply", {"ops": [lamp("l", 1), dim(flux)] if flux == 2 else [dim(flux)]})
        bob.call("scene.apply", {"ops": [dim(9)]})
        for again in (False, True, True):
            if again:
                ws, = self.killed_and_back(ann)
            with self.assertRaises(RpcError) as caught:
                ws.call("scene.undo", {"op_id": "u", "repeat": again})
            self.assertEqual(caught.exception.app, "conflict")
        self.assertEqual(self.flux(ws), 9)

    def test_one_with_nothing_to_take_is_refused_again(self):
        """An undo and a redo that came before there was a step: sent again after it, they must not take it."""
        ws, ann = self.hello("ann")
        revs = []
        for again in (False, True, True, True):
            if again:
                ws, = self.killed_and_back(ann, compact=len(revs) > 2)
            for method, op_id in (("scene.undo", "u"), ("scene.redo", "r")):
                with self.assertRaises(RpcError) as caught:
                    ws.call(method, {"op_id": op_id, "repeat": again})
                self.assertEqual(caught.exception.app, "conflict" if again else "not_found")
            if not again:
                ws.call("scene.apply", {"ops": [lamp("l", 1)]})
                ws.call("scene.apply", {"ops": [dim(2)]})
                ws.call("scene.apply", {"ops": [dim(3)]})
                ws.call("scene.undo")
            revs.append(ws.call("scene.get")["scene_rev"])
            self.assertEqual(self.flux(ws), 2)
        self.assertEqual(set(revs), {revs[0]})
        self.assertNotIn("repeated", ws.call("scene.undo", {"op_id": "v", "repeat": True}))
        self.assertEqual(self.flux(ws), 1)

    def test_two_users_have_the_same_op_id(self):
        ws, ann = self.hello("ann")
        other, bob = self.hello("bob")
        ws.call("scene.apply", {"ops": [lamp("l", 1)]})
        of_ann = ws.call("scene.apply", {"op_id": "e", "ops": [dim(2)]})["scene_rev"]
        of_bob = other.call("scene.apply", {"op_id": "e", "ops": [dim(3)]})["scene_rev"]
        for _ in range(2):
            ws, other = self.killed_and_back(ann, bob)
            self.again(ws, "scene.apply", "e", of_ann, ops=[dim(4)])
            self.again(other, "scene.apply", "e", of_bob, ops=[dim(5)])
            self.assertEqual(self.flux(ws), 3)

    def test_a_folder_of_the_format_before(self):
        """Format 1: undo and redo without op_ids, and snapshots without what was done."""
        ws, ann = self.hello("ann")
        ws.call("scene.apply", {"ops": [lamp("l", 1)]})
        rev = ws.call("scene.apply", {"op_id": "a", "ops": [dim(2)]})["scene_rev"]
        ws.call("scene.apply", {"ops": [dim(3)]})
        ws.call("scene.undo")
        self.end(self.daemon)
        for name in os.listdir(self.folder):
            if name.startswith(("snapshot-", "journal-")):
                with open(os.path.join(self.folder, name), "r+b") as file:
                    head = file.read(8) + struct.pack("<I", 1) + file.read(28)[4:]
                    file.seek(0)
                    file.write(head + struct.pack("<I", zlib.crc32(head)))
        self.begin()
        ws, _ = self.hello("x", ann)
        self.assertEqual(self.flux(ws), 2)
        self.again(ws, "scene.apply", "a", rev, ops=[dim(9)])
        ws.call("scene.redo")
        self.assertEqual(self.flux(ws), 3)


if __name__ == "__main__":
    unittest.main()
