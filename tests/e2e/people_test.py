"""Tokens of people: roles, the file and its mistakes, what SIGHUP takes away, and the lines of --audit."""
import hashlib
import os
import re
import signal
import subprocess
import tempfile
import unittest

from daemon import LUMEND, Daemon, write_people
from requests_test import FORMS
from wsclient import WAIT_S, RpcError, WebSocket

TOKENS = {name: f"token-of-{name}-0123456789" for name in ("vera", "mia", "ed", "ann")}
ROLES = {"vera": "view", "mia": "measure", "ed": "edit", "ann": "admin"}
RANK = ["view", "measure", "edit", "admin"]
EDIT = {"op_id": "a-1", "ops": [{"op": "set", "id": "render", "path": "/exposure_ev", "value": 3}]}


def least_roles():
    """method: role, as the protocol's page has it."""
    with open(os.path.join(os.path.dirname(__file__), "..", "..", "protocol", "PROTOCOL.md"), encoding="utf-8") as page:
        rows = re.findall(r"^\| `(view|measure|edit|admin)` \| ((?:`[a-z_]+\.?[a-z_]*` ?)+)\|$", page.read(), re.M)
    return {method: role for role, methods in rows for method in re.findall(r"`([^`]+)`", methods)}


class People(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.path = os.path.join(self.folder, "people")
        self.write({name: (ROLES[name], TOKENS[name]) for name in ROLES})

    def write(self, people):
        write_people(self.path, people)

    def start(self, *options, **more):
        return self.enterContext(Daemon("--tokens", self.path, *options, **more))

    def connect(self, daemon, name):
        ws = WebSocket(daemon.port)
        ws.said = ws.hello(TOKENS[name], client="lumend-web")
        return ws

    def refused(self, ws, method, params):
        with self.assertRaises(RpcError, msg=method) as caught:
            ws.call(method, params)
        return caught.exception

    # ---- roles ----

    def test_hello_tells_the_role_and_names_the_person(self):
        daemon = self.start()
        self.assertIsNone(daemon.token)  # nobody else may come
        for name, role in ROLES.items():
            said = self.connect(daemon, name).said
            self.assertEqual(said["role"], role)
            self.assertRegex(said["session"], rf"^{name}\.[0-9]+-[0-9]+$")

    def test_each_request_is_for_those_whom_the_page_names(self):
        """All requests by all roles: nothing is missing in the table, and nothing in the daemon."""
        daemon, roles = self.start(), least_roles()
        self.assertEqual(set(FORMS), set(roles) - {"frame.ack"})
        for name, role in ROLES.items():
            ws = self.connect(daemon, name)
            for method, params in FORMS.items():
                allowed = RANK.index(role) >= RANK.index(roles[method])
                for given in (params, {"nonsense": 1}):
                    try:
                        ws.call(method, given)
                        app, text = None, ""
                    except RpcError as error:
                        app, text = error.app, str(error)
                    self.assertEqual(app != "forbidden", allowed, f"{name} {method} {given}")
                    if not allowed:
                        self.assertIn(f"{method} needs the role {roles[method]}, and yours is {role}", text)
            ws.close()

    def test_what_is_forbidden_changes_nothing(self):
        daemon = self.start()
        ed, mia = self.connect(daemon, "ed"), self.connect(daemon, "mia")
        before = ed.call("scene.get", {"expand": True})
        mia.notify("scene.apply", EDIT)
        error = self.refused(mia, "scene.apply", EDIT)
        self.assertEqual((error.code, error.app, error.data["path"]), (-32000, "forbidden", "method"))
        self.assertEqual(ed.call("scene.get", {"expand": True}), before)

    def test_metrics_are_for_everybody_with_a_token(self):
        daemon = self.start()
        for token in TOKENS.values():
            self.assertEqual(daemon.get("/metrics", {"Authorization": f"Bearer {token}"})[0], 200)
        for token in ("", "x", TOKENS["ann"] + "x", TOKENS["ann"][:-1]):
            self.assertEqual(daemon.get("/metrics", {"Authorization": f"Bearer {token}"})[0], 401)

    def test_the_one_token_goes_on_beside_them(self):
        one = os.path.join(self.folder, "one")
        with open(os.open(one, os.O_WRONLY | os.O_CREAT, 0o600), "w", encoding="utf-8") as file:
            file.write("the-one-token-of-all-edits\n")
        daemon = self.start("--token-file", one)
        self.assertEqual(daemon.token, "the-one-token-of-all-edits")  # of its URL
        self.assertEqual(WebSocket(daemon.port).hello(daemon.token)["role"], "edit")
        self.assertEqual(self.connect(daemon, "vera").said["role"], "view")

    # ---- coming and going ----

    def test_wrong_and_late_tokens_open_nothing(self):
        self.write({"ed": ("edit", TOKENS["ed"]), "mia": ("measure", TOKENS["mia"], "2020-02-29"),
                    "ann": ("admin", TOKENS["ann"], "2999-12-31")})
        daemon = self.start()
        for token, why in ((None, "a token is needed"), ("", "a token is needed"), ("x" * 30, "not a token of this server"),
                           (TOKENS["ed"][:-1], "not a token"), (TOKENS["vera"], "not a token"),
                           (hashlib.sha256(TOKENS["ed"].encode()).hexdigest(), "not a token"),  # what the file has
                           (TOKENS["mia"], "the time of this token, of mia, is over")):
            ws = WebSocket(daemon.port)
            with self.assertRaisesRegex(RpcError, why) as caught:
                ws.hello(token)
            self.assertEqual(caught.exception.app, "not_authorised")
            self.assertEqual(ws.wait_close(), 4001)
        self.assertEqual(self.connect(daemon, "ann").said["role"], "admin")

    def test_sighup_ends_who_is_gone_or_changed_and_nobody_else(self):
        daemon = self.start()
        sessions = {name: self.connect(daemon, name) for name in ROLES}
        self.write({"vera": ("edit", TOKENS["vera"]),  # another role
                    "ed": ("edit", TOKENS["ed"]),
                    "ann": ("admin", "another-token-of-ann-0123")})
        daemon.process.send_signal(signal.SIGHUP)
        for name in ("vera", "mia", "ann"):
            self.assertEqual(sessions[name].wait_close(), 4003, name)
        sessions["ed"].call("scene.apply", EDIT)
        self.assertEqual(self.connect(daemon, "vera").said["role"], "edit")
        for name in ("mia", "ann"):
            with self.assertRaises(RpcError):
                self.connect(daemon, name)

    def wait_log(self, daemon, text):
        while text not in daemon.read_log():
            self.assertIsNone(daemon.process.poll())
        return daemon.read_log()

    def test_a_file_that_is_wrong_changes_nothing(self):
        daemon = self.start()
        sessions = {name: self.connect(daemon, name) for name in ROLES}
        with open(self.path, "a", encoding="utf-8") as file:
            file.write("bob edit secret-token-of-bob\n")
        daemon.process.send_signal(signal.SIGHUP)
        log = self.wait_log(daemon, "the people stay who they were")
        self.assertRegex(log, r"people:7: third comes sha256:")
        self.assertNotIn("secret-token-of-bob", log)
        os.unlink(self.path)
        daemon.process.send_signal(signal.SIGHUP)
        self.wait_log(daemon, "No such file")
        for name, ws in sessions.items():
            self.assertIn("methods", ws.call("stats.get"), name)

    def test_without_a_file_of_people_sighup_ends_the_daemon_as_ever(self):
        before = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under nohup it is ignored, and so by those that are started
        self.addCleanup(signal.signal, signal.SIGHUP, before)
        daemon = Daemon()
        daemon.process.send_signal(signal.SIGHUP)
        self.assertEqual(daemon.process.wait(WAIT_S), -signal.SIGHUP)

    # ---- administration ----

    def test_an_administrator_sees_who_is_here_and_ends_sessions(self):
        daemon = self.start()
        ann, ed, vera = (self.connect(daemon, name) for name in ("ann", "ed", "vera"))
        WebSocket(daemon.port)  # has not said hello
        listed = ann.call("session.list")["sessions"]
        self.assertEqual({s["session"]: (s["person"], s["role"], s["address"]) for s in listed},
                         {ws.said["session"]: (name, ROLES[name], "127.0.0.1")
                          for name, ws in (("ann", ann), ("ed", ed), ("vera", vera))})
        self.assertEqual(ann.call("session.end", {"session": ed.said["session"]}), {})
        self.assertEqual(ed.wait_close(), 4004)
        self.assertEqual(self.refused(ann, "session.end", {"session": ed.said["session"]}).app, "not_found")
        vera.call("scene.get")
        self.assertEqual(len(ann.call("session.list")["sessions"]), 2)

    # ---- audit ----

    def test_audit_has_a_line_for_each_edit_whatever_the_log_is(self):
        daemon = self.start("--audit", "--log", "error")
        ed, ann = self.connect(daemon, "ed"), self.connect(daemon, "ann")
        n = 300  # more than the log takes in a burst
        pending = [ed.send_request("scene.apply", EDIT) for _ in range(n)]
        revisions = [ed.reply(request)["scene_rev"] for request in pending]
        lamp = {"op": "add", "type": "light", "id": "lamp", "kind": "point", "position": [0, 1, 0], "flux_lm": 1}
        camera = {"op": "set", "id": "main", "path": "/vfov_deg", "value": 50}
        added = ann.call("scene.apply", {"ops": [lamp, camera]})["scene_rev"]
        undone = ann.call("scene.undo")["scene_rev"]
        many = [{"op": "set", "id": "render", "path": "/exposure_ev", "value": 3}] * 100
        last = ed.call("scene.apply", {"ops": many})["scene_rev"]
        log = daemon.read_log()
        ed_is, ann_is = ed.said["session"], ann.said["session"]
        self.assertIn(f'level=audit at=session text="{ed_is} came from 127.0.0.1, role edit"', log)
        for revision in revisions:
            self.assertIn(f'level=audit at=edit text="{ed_is} revision {revision} apply a-1: set render/exposure_ev"', log)
        self.assertIn(f'text="{ann_is} revision {added} apply: add lamp, set main/vfov_deg"', log)
        self.assertRegex(log, rf'text="{re.escape(ann_is)} revision {undone} undo: ')
        self.assertRegex(log, rf'text="{re.escape(ed_is)} revision {last} apply: set render/exposure_ev, .*, and [0-9]+ more"')
        self.assertNotIn(" dropped=", log)

    def test_without_audit_edits_are_not_logged(self):
        daemon = self.start()
        self.connect(daemon, "ed").call("scene.apply", EDIT)
        self.assertNotIn("render/exposure_ev", daemon.read_log())


class Command(unittest.TestCase):
    def setUp(self):
        self.path = os.path.join(self.enterContext(tempfile.TemporaryDirectory()), "people")

    def token(self, *arguments):
        return subprocess.run([LUMEND, "token", *arguments], capture_output=True, text=True, timeout=WAIT_S, check=False)

    def test_what_it_makes_opens_the_door(self):
        made = {}
        for name, more in (("ann", ["--role", "admin"]), ("bob", ["--until", "2999-01-01"]), ("cy.1", ["--role", "view"])):
            done = self.token(name, *more, "--tokens", self.path)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            made[name] = done.stdout.strip()
            self.assertRegex(made[name], r"^[A-Za-z0-9_~.-]{32}$")
        self.assertEqual(os.stat(self.path).st_mode & 0o777, 0o600)
        with open(self.path, encoding="utf-8") as file:
            text = file.read()
        self.assertEqual(text.count("\n"), 3)
        with Daemon("--tokens", self.path) as daemon:
            for (name, token), role in zip(made.items(), ("admin", "edit", "view")):
                self.assertNotIn(token, text)
                self.assertEqual(WebSocket(daemon.port).hello(token)["role"], role)

    def test_without_a_file_the_line_goes_to_standard_error(self):
        done = self.token("ann", "--until", "2027-01-31")
        sha = hashlib.sha256(done.stdout.strip().encode()).hexdigest()
        self.assertEqual((done.returncode, done.stderr), (0, f"ann edit sha256:{sha} 2027-01-31\n"))

    def test_what_it_refuses(self):
        for arguments, status, why in (([], 2, "needs a name"), (["a", "b"], 2, "needs a name"), (["a b"], 2, "a name has"),
                                       (["a" * 33], 2, "a name has"), (["a", "--role", "king"], 2, "view, measure, edit or admin"),
                                       (["a", "--until", "2027-02-29"], 2, "a date like"), (["a", "--until", "soon"], 2, "a date"),
                                       (["a", "--tokens", "/nowhere/x"], 1, "cannot be written")):
            done = self.token(*arguments)
            self.assertEqual((done.returncode, done.stdout), (status, ""), arguments)
            self.assertIn(why, done.stderr)
        self.assertEqual(self.token("ann", "--tokens", self.path).returncode, 0)
        again = self.token("ann", "--tokens", self.path)
        self.assertEqual((again.returncode, again.stdout), (1, ""))
        self.assertIn("ann has a line", again.stderr)
        os.chmod(self.path, 0o660)
        self.assertIn("chmod 600", self.token("bob", "--tokens", self.path).stderr)

    def test_the_daemon_names_the_line_that_is_wrong(self):
        sha = "sha256:" + "0" * 64
        for line, why in (("ann", "a line is NAME ROLE"), ("a/b edit " + sha, "a name has"), ("ann king " + sha, "the role of ann"),
                          ("ann edit sha256:00", "third comes"), ("ann edit " + sha.upper(), "third comes"),
                          (f"ann edit {sha} 2027-13-01", "last day of ann"), (f"ann edit {sha} 2027-01-01 x", "a line is"),
                          (f"bob edit {sha}\nann edit {sha}", "3: the token of ann is that of another"),
                          (f"ann edit {sha}\nann view sha256:{'1' * 64}", "3: ann has a line already")):
            write_people(self.path, {})
            with open(self.path, "w", encoding="utf-8") as file:
                file.write("# people\n" + line + "\n")
            with self.assertRaisesRegex(AssertionError, why):
                Daemon("--tokens", self.path)
        for mode in (0o644, 0o660, 0o604):
            os.chmod(self.path, mode)
            with self.assertRaisesRegex(AssertionError, f"its mode is {mode:o}"):
                Daemon("--tokens", self.path)
        with self.assertRaisesRegex(AssertionError, "--no-auth and --tokens exclude each other"):
            Daemon("--tokens", self.path, "--no-auth")


if __name__ == "__main__":
    unittest.main()
