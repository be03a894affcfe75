"""Clients whose connection breaks: they come back as who they were, with their undo, know what was changed meanwhile, and
send again what nobody answered. Nothing is done twice, nothing is lost, wherever the line is cut."""
import os
import random
import tempfile
import unittest

from cutting_proxy import CuttingProxy
from daemon import TLS, LUMEND, Daemon, write_people
from wsclient import Closed, HandshakeFailed, RpcError, WebSocket

HERE = os.path.dirname(os.path.abspath(__file__))
N_CUTS = 200


def lamp(name, flux):
    return {"op": "add", "type": "light", "id": name, "kind": "point", "position": [0, 1, 0], "flux_lm": flux}


def dim(name, flux):
    return {"op": "set", "id": name, "path": "/flux_lm", "value": flux}


class Resume(unittest.TestCase):
    def setUp(self):
        self.daemon = self.enterContext(Daemon())
        self.bob = self.connect()[0]
        self.bob.call("scene.apply", {"ops": [lamp("l", 1)]})

    def connect(self, token=None, **more):
        ws = self.daemon.connect(hello=False)
        return ws, ws.hello(token or self.daemon.token, **more)

    def back(self, hello, **more):
        return self.connect(**{"resume": hello["session"], "key": hello["key"], **more})

    def flux(self, ws, name="l"):
        return {op["id"]: op.get("flux_lm") for op in ws.call("scene.get")["ops"]}.get(name)

    def test_a_first_hello_gives_a_key(self):
        keys = set()
        for _ in range(3):
            hello = self.connect()[1]
            self.assertRegex(hello["key"], r"^[A-Za-z0-9_~.-]{32}$")
            self.assertIs(hello["resumed"], False)
            self.assertIsNone(hello["missed"])
            keys.add(hello["key"])
        self.assertEqual(len(keys), 3)

    def test_who_was_cut_off_has_her_name_and_her_undo_again(self):
        ws, hello = self.connect()
        for flux in (2, 3):
            ws.call("scene.apply", {"ops": [dim("l", flux)]})
        for flux in (2, 1):
            ws.close()
            ws, again = self.back(hello)
            self.assertEqual((again["session"], again["key"], again["resumed"]), (hello["session"], hello["key"], True))
            ws.call("scene.undo")
            self.assertEqual(self.flux(ws), flux)

    def test_she_is_told_what_was_changed_meanwhile_and_only_that(self):
        ws, hello = self.connect()
        rev = ws.call("scene.apply", {"ops": [dim("l", 2)]})["scene_rev"]
        ws.close()
        others = [self.bob.call("scene.apply", {"op_id": f"b{i}", "ops": [dim("l", 10 + i)]})["scene_rev"] for i in range(5)]
        self.bob.call("stats.get")
        ws, again = self.back(hello, scene_rev=rev)
        self.assertEqual(again["missed"], 5)
        ws.call("stats.get")
        told = [params for method, params in ws.notifications if method == "scene.changed"]
        self.assertEqual([(t["scene_rev"], t["op_id"]) for t in told], [(r, f"b{i}") for i, r in enumerate(others)])
        for known, missed in ((others[-1], 0), (others[2], 2), (others[-1] + 1, None), (0, None)):
            ws.close()
            ws, again = self.back(hello, scene_rev=known)
            self.assertEqual(again["missed"], missed, known)
        ws.close()
        self.assertIsNone(self.back(hello)[1]["missed"])  # does not say what she knows

    def test_more_changes_than_are_kept_are_not_told(self):
        ws, hello = self.connect()
        rev = ws.call("scene.apply", {"ops": [dim("l", 2)]})["scene_rev"]
        ws.close()
        for n, missed in ((1023, 1023), (1, 1024), (1, None)):
            for _ in range(n):
                self.patiently("scene.apply", {"ops": [dim("l", 3)]})
            self.patiently("stats.get", {})  # the news of the last are out: they come right after its reply
            ws, again = self.back(hello, scene_rev=rev)
            self.assertEqual(again["missed"], missed)
            ws.close()

    def patiently(self, method, params):
        while True:
            try:
                return self.bob.call(method, params)
            except RpcError as error:
                if error.app != "limit_exceeded":
                    raise

    def test_a_connection_that_the_server_takes_for_alive_makes_way(self):
        ws, hello = self.connect()
        ws.call("scene.apply", {"ops": [dim("l", 2)]})
        ws.notify("scene.apply", {"ops": [dim("l", 3)]})
        ws.call("stats.get")  # read, and so is all before it
        again, said = self.back(hello)
        self.assertTrue(said["resumed"])
        self.assertEqual(ws.wait_close(), 4009)
        again.call("scene.undo")
        self.assertEqual(self.flux(again), 2)

    def test_without_the_key_nobody_is_somebody_else(self):
        ws, hello = self.connect()
        ws.call("scene.apply", {"ops": [dim("l", 2)]})
        key = hello["key"]
        wrong = [None, "", "x", key[:-1], key + "x", ("y" if key[0] == "x" else "x") + key[1:], "z" * 32]
        for is_open in (True, False):
            if not is_open:
                ws.close()
                while self.daemon.metric("sessions") > 1:
                    pass
            for guess in wrong:
                other, said = self.connect(resume=hello["session"], **({} if guess is None else {"key": guess}))
                self.assertIs(said["resumed"], False, guess)
                self.assertNotEqual(said["session"], hello["session"])
                self.assertNotEqual(said["key"], key)
                with self.assertRaises(RpcError):
                    other.call("scene.undo")
                other.leave()
            if is_open:
                ws.call("stats.get")  # she was not disturbed
        self.assertTrue(self.back(hello)[1]["resumed"])

    def test_who_says_goodbye_is_gone(self):
        ws, hello = self.connect()
        ws.call("scene.apply", {"ops": [dim("l", 2)]})
        ws.leave()
        ws, said = self.back(hello)
        self.assertIs(said["resumed"], False)
        with self.assertRaises(RpcError) as caught:
            ws.call("scene.undo")
        self.assertEqual(caught.exception.app, "not_found")

    def test_who_was_cut_off_longest_makes_room(self):
        first = None
        for i in range(65):
            ws, hello = self.connect()
            first = first or hello
            ws.close()
            while self.daemon.metric("sessions") > 1:
                pass
        self.assertIs(self.back(first)[1]["resumed"], False)
        self.assertIs(self.back(hello)[1]["resumed"], True)

    # ---- sent again ----

    def test_an_edit_that_is_sent_again_is_done_once(self):
        ws, hello = self.connect()
        edit = {"op_id": "e1", "ops": [lamp("new", 5)]}
        rev = ws.call("scene.apply", edit)["scene_rev"]
        ws.close()
        ws, _ = self.back(hello)
        self.assertEqual(ws.call("scene.apply", {**edit, "repeat": True}), {"scene_rev": rev, "repeated": True})
        with self.assertRaises(RpcError) as caught:
            ws.call("scene.apply", edit)  # does not say that it may have been done
        self.assertEqual(caught.exception.app, "conflict")
        later = ws.call("scene.apply", {"op_id": "e2", "repeat": True, "ops": [dim("new", 6)]})  # was not done
        self.assertNotIn("repeated", later)
        self.assertEqual(self.flux(ws, "new"), 6)
        self.bob.call("scene.apply", {"op_id": "e2", "repeat": True, "ops": [dim("new", 7)]})  # of somebody else
        self.assertEqual(self.flux(ws, "new"), 7)

    def test_undo_and_redo_are_done_once(self):
        ws, hello = self.connect()
        for flux in (2, 3, 4):
            ws.call("scene.apply", {"ops": [dim("l", flux)]})
        for method, op_id, flux in (("scene.undo", "u1", 3), ("scene.undo", "u2", 2), ("scene.redo", "r1", 3)):
            rev = ws.call(method, {"op_id": op_id})["scene_rev"]
            ws.close()
            ws, _ = self.back(hello)
            self.assertEqual(ws.call(method, {"op_id": op_id, "repeat": True}), {"scene_rev": rev, "repeated": True})
            self.assertEqual(self.flux(ws), flux)

    def test_an_undo_that_was_refused_takes_no_other_step_when_it_is_sent_again(self):
        ws, _ = self.connect()
        ws.call("scene.apply", {"ops": [lamp("mine", 1)]})
        ws.call("scene.apply", {"ops": [dim("l", 2)]})
        self.bob.call("scene.apply", {"ops": [dim("l", 3)]})
        for more in ({}, {"repeat": True}):
            with self.assertRaises(RpcError) as caught:
                ws.call("scene.undo", {"op_id": "u", **more})
            self.assertEqual(caught.exception.app, "conflict")
        self.assertEqual(self.flux(ws, "mine"), 1)

    def test_as_many_edits_are_known_as_the_page_says(self):
        ws, _ = self.connect()
        for i in range(257):
            ws.call("scene.apply", {"op_id": f"e{i}", "ops": [dim("l", 2)]})
        self.assertTrue(ws.call("scene.apply", {"op_id": "e1", "repeat": True, "ops": [dim("l", 9)]}).get("repeated"))
        self.assertEqual(self.flux(ws), 2)
        self.assertNotIn("repeated", ws.call("scene.apply", {"op_id": "e0", "repeat": True, "ops": [dim("l", 9)]}))

    def test_repeat_needs_an_op_id(self):
        for method, params in (("scene.apply", {"ops": [dim("l", 2)]}), ("scene.undo", {}), ("scene.redo", {})):
            with self.assertRaises(RpcError) as caught:
                self.bob.call(method, {**params, "repeat": True})
            self.assertEqual((caught.exception.app, caught.exception.data["path"]), ("missing_field", "op_id"))


class Imports(unittest.TestCase):
    """They take their time, and go on when who asked for them is cut off."""

    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.gate = os.path.join(self.folder, "gate")
        importer = os.path.join(self.folder, "importer")
        os.mkfifo(self.gate)
        real = os.path.join(os.path.dirname(os.path.abspath(LUMEND)), "lumend-import")
        with open(os.open(importer, os.O_WRONLY | os.O_CREAT, 0o700), "w", encoding="utf-8") as file:
            file.write(f'#!/bin/sh\nread go < "{self.gate}"\nexec "{real}" "$@"\n')
        self.daemon = self.enterContext(Daemon("--assets", os.path.join(HERE, "web"), "--importer", importer))

    def let_it_go(self):
        with open(self.gate, "w", encoding="utf-8") as gate:  # waits until the importer asks
            gate.write("go\n")

    def come(self, **more):
        ws = self.daemon.connect(hello=False)
        return ws, ws.hello(self.daemon.token, **more)

    def test_one_that_is_under_way_is_not_begun_again_and_its_answer_is_for_the_newest_connection(self):
        edit = {"op_id": "i", "ops": [{"op": "import", "id": "room", "asset": "lamp.gltf"}]}
        observer = self.daemon.connect()
        ws, hello = self.come()
        ws.send_request("scene.apply", edit)
        ws.call("stats.get")  # the import waits at the gate
        for _ in range(2):
            ws.close()
            ws, again = self.come(resume=hello["session"], key=hello["key"])
            self.assertTrue(again["resumed"])
            asked = ws.send_request("scene.apply", {**edit, "repeat": True})
            ws.call("stats.get")
        self.let_it_go()
        rev = ws.reply(asked)["scene_rev"]
        self.assertEqual(ws.call("scene.apply", {**edit, "repeat": True}), {"scene_rev": rev, "repeated": True})
        observer.call("stats.get")
        told = [params["op_id"] for method, params in observer.notifications if method == "scene.changed"]
        self.assertEqual(told, ["i"])
        ws.call("scene.undo")
        self.assertFalse([op for op in ws.call("scene.get")["ops"] if op["id"].startswith("room")])


class Persons(unittest.TestCase):
    def test_a_session_goes_on_for_its_person_alone(self):
        tokens = {name: f"token-of-{name}-0123456789" for name in ("ann", "bob")}
        path = os.path.join(self.enterContext(tempfile.TemporaryDirectory()), "people")
        write_people(path, {name: ("edit", token) for name, token in tokens.items()})
        daemon = self.enterContext(Daemon("--tokens", path))
        ann = daemon.connect(hello=False)
        hello = ann.hello(tokens["ann"])
        ann.close()
        for who, key, resumed in (("bob", hello["key"], False), ("ann", "", False), ("ann", hello["key"], True)):
            ws = daemon.connect(hello=False)
            said = ws.hello(tokens[who], resume=hello["session"], key=key)
            self.assertIs(said["resumed"], resumed)
            self.assertEqual(said["session"] == hello["session"], resumed)
            ws.close()


class Model:
    """What the scene must be: lamps and their light, and the steps that can be undone and done again."""

    def __init__(self):
        self.lamps, self.undo, self.redo = {}, [], []

    def choose(self, rng, number):
        """A request that the model says will be accepted, done in the model at once."""
        kinds = ["add"] + ["set", "set", "remove"] * bool(self.lamps) + ["undo"] * bool(self.undo) + ["redo"] * bool(self.redo)
        kind = rng.choice(kinds)
        if kind in ("undo", "redo"):
            steps, others = (self.undo, self.redo) if kind == "undo" else (self.redo, self.undo)
            name, before, after = steps.pop()
            others.append((name, before, after))
            self._put(name, before if kind == "undo" else after)
            return f"scene.{kind}", {}
        name = f"lamp-{number}" if kind == "add" else rng.choice(sorted(self.lamps))
        before, after = self.lamps.get(name), None if kind == "remove" else number + 1
        self.undo.append((name, before, after))
        self.undo = self.undo[-250:]  # fewer than the server keeps
        self.redo = []
        self._put(name, after)
        op = lamp(name, after) if kind == "add" else {"op": "remove", "id": name} if kind == "remove" else dim(name, after)
        return "scene.apply", {"ops": [op]}

    def _put(self, name, flux):
        if flux is None:
            self.lamps.pop(name, None)
        else:
            self.lamps[name] = flux


class Client:
    """Keeps what was not answered, and sends it again under the same op_id."""

    def __init__(self, proxy, token):
        self.proxy, self.token = proxy, token
        self.hello, self.known_rev, self.told = None, 0, []
        self.waiting = {}  # op_id: (method, params), in order
        self.n_comebacks = 0
        self.come()

    def come(self, before_hello=lambda: None):
        while True:
            before_hello()
            try:
                self.ws = WebSocket(self.proxy.port, trust=TLS and TLS.trust)
                more = {} if self.hello is None else {"resume": self.hello["session"], "key": self.hello["key"],
                                                      "scene_rev": self.known_rev}
                said = self.ws.hello(self.token, client="cut", **more)
            except (Closed, HandshakeFailed, OSError):
                self.note()
                continue
            if self.hello is not None:
                assert said["resumed"] and said["session"] == self.hello["session"], said
                assert said["missed"] is not None, said
                self.n_comebacks += 1
            else:
                self.known_rev = said["scene_rev"]
            self.hello = said
            return

    def note(self):
        """What came until the connection broke counts."""
        for method, params in self.ws.notifications if hasattr(self, "ws") else ():
            if method == "scene.changed":
                self.told.append(params["scene_rev"])
                self.known_rev = params["scene_rev"]
        if hasattr(self, "ws"):
            self.ws.notifications = []

    def send(self, repeat):
        return {self.ws.send_request(method, {**params, "op_id": op_id, **({"repeat": True} if repeat else {})}): op_id
                for op_id, (method, params) in self.waiting.items()}

    def work(self, requests, before_hello):
        """All of them, until each is answered."""
        self.waiting.update(requests)
        repeat = False
        while self.waiting:
            try:
                sent = self.send(repeat)
                for request, op_id in sent.items():
                    self.ws.reply(request)
                    del self.waiting[op_id]
            except (Closed, OSError):
                self.note()
                self.ws.close()
                self.come(before_hello)
                repeat = True
        self.note()


class Cuts(unittest.TestCase):
    def run_cuts(self, daemon, seed):
        rng = random.Random(seed)
        model, number = Model(), 0
        observer, bob = daemon.connect(), daemon.connect()
        bob.call("scene.apply", {"ops": [lamp("of-bob", 1)]})
        with CuttingProxy(daemon.port) as proxy:
            client = Client(proxy, daemon.token)
            first_rev = client.known_rev

            def arm():
                """Up to some requests' bytes, or answers' bytes, from now on; sometimes the server does not notice."""
                proxy.arm(*rng.choice([("up", rng.randrange(1, 700)), ("down", rng.randrange(1, 1200))]), rng.random() < 0.3)

            def before_hello():
                """Coming back may fail, too."""
                if rng.random() < 0.3:
                    arm()
                else:
                    proxy.disarm()

            while proxy.n_cuts < N_CUTS:
                requests = {}
                for _ in range(rng.randrange(1, 6)):
                    requests[f"e{number}"] = model.choose(rng, number)
                    number += 1
                arm()
                client.work(requests, before_hello)
                if rng.random() < 0.3:
                    bob.call("scene.apply", {"ops": [dim("of-bob", number + 1)]})
            proxy.disarm()
            bob_said = bob.call("scene.apply", {"op_id": "last", "ops": [dim("of-bob", 7)]})["scene_rev"]
            while client.known_rev < bob_said:
                try:
                    client.ws.pump()
                except Closed:  # an armed cut came late
                    client.ws.close()
                    client.come()
                client.note()
            client.ws.close()
        while not any(params.get("op_id") == "last" for _, params in observer.notifications):
            observer.pump()
        done = [params["op_id"] for _, params in observer.notifications if params.get("user") == client.hello["session"]]
        self.assertEqual(done, [f"e{i}" for i in range(number)])  # each once, in order
        self.assertEqual(client.told, list(range(first_rev + 1, bob_said + 1)))  # and each change was told once
        lamps = {op["id"]: op["flux_lm"] for op in observer.call("scene.get")["ops"] if op["id"].startswith("lamp-")}
        self.assertEqual(lamps, model.lamps)
        self.assertGreaterEqual(client.n_comebacks, N_CUTS // 2)
        return number, client.n_comebacks

    def test_in_200_cuts_nothing_is_done_twice_and_nothing_is_lost(self):
        for kept in (False, True):
            seed = int(os.environ.get("LUMEND_SEED", random.SystemRandom().randrange(1 << 32)))
            with self.subTest(f"LUMEND_SEED={seed} {'with' if kept else 'without'} --state"), \
                    tempfile.TemporaryDirectory() as folder:
                with Daemon(*(("--state", folder) if kept else ())) as daemon:
                    edits, comebacks = self.run_cuts(daemon, seed)
                print(f"seed {seed}: {edits} edits, {comebacks} times back")


if __name__ == "__main__":
    unittest.main()
