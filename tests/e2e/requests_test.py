"""Every request with missing, extra, wrong, huge and hostile params: the right error, and the connection lives."""
import json
import os
import re
import tempfile
import unittest

from daemon import Daemon, write_people
from wsclient import RpcError, TEXT, frame

# What may stand in any place where it does not belong.
JUNK = [None, True, False, -1, 1.5, 1e308, -1e308, 2 ** 53, 2 ** 64, "", "x", "\u202e\u0001", "x" * 5000, [], [[]], [1, 2],
        {}, {"a": 1}, [None] * 4, {"view_id": 1}]

CAMERA = {"position": [0, 1, 3], "target": [0, 1, 0]}
# method: params that are right as far as their form goes. Of others the first example of the page has them, and needs all that it has.
FORMS = {
    "presence.set": {"camera": CAMERA, "point": [0, 1, 0]},
    "project.create": {"name": "Foyer", "scene": "furnace"},
    "project.rename": {"project": "aaaaaaaaaaaa", "name": "Foyer"},
    "project.delete": {"project": "aaaaaaaaaaaa"},
    "project.restore": {"project": "aaaaaaaaaaaa"},
    "project.erase": {"project": "aaaaaaaaaaaa"},
    "version.list": {"project": "aaaaaaaaaaaa"},
    "version.remove": {"project": "aaaaaaaaaaaa", "version": "bbbbbbbbbbbb"},
    "scene.get": {"expand": False},
    "scene.apply": {"op_id": "a-1", "repeat": False, "base_rev": 0,
                    "ops": [{"op": "set", "id": "render", "path": "/exposure_ev", "value": 3}]},
    "scene.undo": {"op_id": "a-2", "repeat": False},
    "scene.redo": {"op_id": "a-3", "repeat": False},
    "scene.revert": {"scene_rev": 1, "op_id": "a-7", "repeat": False},
    "timeline.get": {"since_rev": 0},
    "preset.store": {"id": "evening", "name": "Evening", "fade_s": 2, "op_id": "a-4", "repeat": False},
    "preset.recall": {"id": "evening", "fade_s": 0, "op_id": "a-5", "repeat": False},
    "preset.stop": {"op_id": "a-6", "repeat": False},
    "view.open": {"camera": CAMERA, "size": [64, 48], "codec": "jpeg", "quality": 80, "white_balance_k": 4000},
    "view.update": {"view_id": 4000000000, "camera_id": "main", "size": [64, 48], "camera_seq": 1},
    "view.close": {"view_id": 4000000000},
    "pick": {"view_id": 4000000000, "x": 1, "y": 1},
    "view.read": {"view_id": 4000000000, "x": 1, "y": 1},
    "surroundings": {"view_id": 4000000000},
    "photometry": {"id": "panel"},
    "asset.list": {"kind": "photometry", "match": "down"},
    "asset.photometry": {"asset": "maker/downlight.ies"},
    "probe": {"view_id": 4000000000, "x": 1, "y": 1, "samples": 4},
    "sensor.watch": {"on": False, "points": True},
    "sensor.read": {"id": "floor"},
    "sensor.place": {"on": "floor", "height_m": 1, "border_m": 0, "directions": 8},
    "report.get": {"view_id": 4000000000},
    "stats.get": {},
}
REQUIRED = {"project.create": ["name"], "project.rename": ["project", "name"], "project.delete": ["project"],
            "project.restore": ["project"], "project.erase": ["project"], "version.list": ["project"],
            "version.remove": ["project", "version"],
            "scene.apply": ["ops"], "scene.revert": ["scene_rev"], "timeline.name": ["scene_rev", "name"], "preset.store": ["id"], "preset.recall": ["id"], "view.open": ["size"], "view.update": ["view_id"], "view.close": ["view_id"],
            "pick": ["view_id", "x", "y"], "view.read": ["view_id", "x", "y"], "surroundings": ["view_id"], "photometry": ["id"],
            "asset.list": ["kind"], "asset.photometry": ["asset"], "sensor.read": ["id"], "probe": ["view_id", "x", "y"]}
with open(os.path.join(os.path.dirname(__file__), "..", "..", "protocol", "PROTOCOL.md"), encoding="utf-8") as page:
    EXAMPLES = [json.loads(line) for line in re.findall(r'^\u2192 (\{"jsonrpc":.*"method":.*)$', page.read(), re.M)]
for example in EXAMPLES:
    if example["method"] not in FORMS and example["method"] not in ("session.hello", "frame.ack"):  # those two are the session's own
        FORMS[example["method"]] = example.get("params", {})
        if FORMS[example["method"]]:
            REQUIRED[example["method"]] = list(FORMS[example["method"]])
KNOWN_CODES = {-32700, -32600, -32601, -32602, -32603, -32000}


ADMIN = "token-of-one-who-may-ask-for-all"


class Requests(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        people = os.path.join(cls.enterClassContext(tempfile.TemporaryDirectory()), "people")
        write_people(people, {"ann": ("admin", ADMIN)})
        cls.daemon = cls.enterClassContext(Daemon("--tokens", people))
        cls.daemon.token = ADMIN

    def setUp(self):
        self.ws = self.daemon.connect()

    def tearDown(self):
        self.assertIn("ops", self.patiently("scene.get", {}))  # the connection lives, be its bucket empty
        self.ws.close()
        self.daemon.assert_well()

    def fails(self, method, params, code=None, app=None, path=None):
        with self.assertRaises(RpcError, msg=f"{method} {str(params)[:200]}") as caught:
            self.patiently(method, params)
        error, what = caught.exception, f"{method} {str(params)[:200]}: {caught.exception}"
        self.assertIn(error.code, KNOWN_CODES, what)
        if code is not None:
            self.assertEqual(error.code, code, what)
        if app is not None:
            self.assertEqual(error.app, app, what)
        if path is not None:
            self.assertEqual(error.data.get("path"), path, what)
        return error

    def patiently(self, method, params):
        """A call that comes back when this test asks faster than LUM_LIMIT_MESSAGES_PER_S."""
        while True:
            try:
                return self.ws.call(method, params)
            except RpcError as error:
                if error.app != "limit_exceeded" or "messages a second" not in str(error):
                    raise

    def raw(self, text):
        """The error of a text that is no good; its id is null when it cannot be known."""
        self.ws.send_text(text)
        while None not in self.ws.replies and 7 not in self.ws.replies:
            self.ws.pump()
        reply = self.ws.replies.pop(None, None) or self.ws.replies.pop(7)
        return reply["error"]

    # ---- envelopes ----

    def test_not_json(self):
        for text in ("", " ", "x", "{", "}", '{"jsonrpc":"2.0"', "[1,]", '{"a":1,}', "'a'", '"\\x"', "nul", "01", "+1", ".5",
                     "1.", "1e", "0x10", "NaN", "Infinity", "-Infinity", "[NaN]", '{"a":1e999}', "{'a':1}", "// c", '"a\nb"',
                     '"\\ud800"', '"\\u0000"', "\ufeff{}", "{}{}", "\x00", "[" * 33 + "]" * 33, "[" * 100000,
                     '{"a":' * 50000, '"' + "a" * 5000 + '"'):
            error = self.raw(text)
            self.assertIn(error["code"], (-32700, -32600, -32000, -32602), text[:40])

    def test_not_a_request(self):
        good = {"jsonrpc": "2.0", "id": 7, "method": "scene.get"}
        for change in ({"jsonrpc": "1.0"}, {"jsonrpc": 2.0}, {"jsonrpc": None}, {"method": 5}, {"method": None},
                       {"method": "m" * 65}, {"params": []}, {"params": 5}, {"params": "x"}, {"id": 1.5}, {"id": []},
                       {"id": {}}, {"id": True}, {"id": "x" * 65}, {"id": 1e300}, {"extra": 1}):
            error = self.raw(json.dumps({**good, **change}))
            self.assertIn(error["code"], (-32600, -32602), change)
        for missing in ("jsonrpc", "method"):
            self.assertEqual(self.raw(json.dumps({k: v for k, v in good.items() if k != missing}))["code"], -32600)
        for other in ("[]", "5", '"x"', "null", "true", json.dumps([good, good])):
            self.assertEqual(self.raw(other)["code"], -32600, other)
        self.assertIn(self.raw('{"jsonrpc":"2.0","id":7,"id":8,"method":"scene.get"}')["code"], (-32700, -32600, -32602))

    def test_ids_come_back_as_they_were(self):
        for request_id in (0, -5, 2 ** 53, "a", "", "\u00e4\"\\", "7"):
            self.ws.send_text(json.dumps({"jsonrpc": "2.0", "id": request_id, "method": "scene.get"}))
            while request_id not in self.ws.replies:
                self.ws.pump()
            self.assertIn("result", self.ws.replies.pop(request_id))

    def test_notifications_get_no_reply_even_when_wrong(self):
        for method in (*FORMS, "no.such", "frame.ack", "session.hello"):
            self.ws.notify(method, {"wrong": 1})
        self.ws.send_text('{"jsonrpc":"2.0","method":"scene.get"}')
        self.ws.call("scene.get")
        self.assertEqual(self.ws.replies, {})

    def test_unknown_methods(self):
        for method in ("", "x", "scene", "scene.", "scene.get ", "SCENE.GET", "rpc.discover", "__proto__"):
            self.fails(method, {}, -32601, "unsupported")

    # ---- params ----

    def test_no_form_is_of_a_request_that_is_gone(self):
        self.assertEqual(set(FORMS) - {example["method"] for example in EXAMPLES}, set())

    def test_missing_fields_are_named(self):
        for method, names in REQUIRED.items():
            for name in names:
                params = {k: v for k, v in FORMS[method].items() if k != name}
                self.fails(method, params, -32602, "missing_field", name)
            self.fails(method, None, -32602, "missing_field")

    def test_extra_fields_are_named(self):
        for method, params in FORMS.items():
            for name in ("extra", "Size", "__proto__", "x" * 200):
                error = self.fails(method, {**params, name: 1}, -32602, "unknown_field")
                self.assertTrue(name.startswith(error.data["path"][:60]), error)

    def test_junk_in_every_field(self):
        """No junk value is ever an internal error, closes the connection, or goes without an answer."""
        for method, form in FORMS.items():
            for name in form:
                for junk in JUNK:
                    if method == "report.get" and junk is None:
                        continue  # no view, which is right: two pictures, made for seconds, which other tests ask for
                    try:
                        self.patiently(method, {**form, name: junk})
                    except RpcError as error:
                        self.assertIn(error.code, (-32602, -32000), f"{method} {name}={str(junk)[:50]}: {error}")

    def test_numbers_no_json_can_carry(self):
        for number in ("NaN", "Infinity", "-Infinity", "1e999", "-1e999", "0x1", "1_0"):
            text = '{"jsonrpc":"2.0","id":7,"method":"view.open","params":{"size":[%s,48]}}' % number
            self.assertIn(self.raw(text)["code"], (-32700, -32602, -32600), number)

    def test_sizes_of_views(self):
        side, pixels = 4096, 1 << 23
        for size in ([0, 1], [1, 0], [-1, 1], [side + 1, 1], [1, side + 1], [1.5, 1], [1], [1, 1, 1], [], ["1", "1"],
                     [[1], [1]], [1e300, 1], [side, pixels // side + 1]):
            error = self.fails("view.open", {"size": size})
            self.assertTrue(error.data["path"].startswith("size"), error)
        self.fails("view.open", {"size": [side, pixels // side + 1]}, -32602, "limit_exceeded", "size")
        for size in ([1, 1], [side, 1], [1, side]):
            view = self.patiently("view.open", {"size": size, "camera_id": "main"})
            self.patiently("view.close", {"view_id": view["view_id"]})

    def test_cameras(self):
        for camera in ({}, {"position": [0, 0, 0]}, {"target": [0, 0, 0]}, {**CAMERA, "position": [0, 0]},
                       {**CAMERA, "position": [0, 0, 1e10]}, {**CAMERA, "vfov_deg": 0}, {**CAMERA, "vfov_deg": 180},
                       {**CAMERA, "extra": 1}, {**CAMERA, "target": CAMERA["position"]}, {**CAMERA, "up": [0, 0, 0]}, []):
            self.fails("view.open", {"size": [64, 48], "camera": camera})
        self.fails("view.open", {"size": [64, 48], "camera": CAMERA, "camera_id": "main"}, -32602, "invalid_value")
        self.fails("view.open", {"size": [64, 48], "camera_id": "no-such-camera"})

    def test_normals_of_probes(self):
        at = {"point": [0, 1, 0], "samples": 4}
        self.assertGreaterEqual(self.ws.call("probe", {**at, "normal": [0, 0.5, 0]})["illuminance_lx"], 0)
        for normal in ([0, 0, 0], [0, 1e-300, 0]):
            self.fails("probe", {**at, "normal": normal}, -32602, "invalid_value")

    def test_other_peoples_views(self):
        other = self.daemon.connect()
        view_id = other.call("view.open", {"size": [32, 32], "camera_id": "main"})["view_id"]
        for method in ("view.update", "view.close", "view.read", "pick", "surroundings", "probe"):
            self.fails(method, {**FORMS[method], "view_id": view_id}, -32000, "not_found")
        other.call("view.close", {"view_id": view_id})

    def test_views_per_session(self):
        views = [self.ws.call("view.open", {"size": [16, 16], "camera_id": "main"})["view_id"] for _ in range(8)]
        self.assertEqual(len(set(views)), 8)
        self.fails("view.open", {"size": [16, 16], "camera_id": "main"}, None, "limit_exceeded")
        self.ws.call("view.close", {"view_id": views[3]})
        self.ws.call("view.open", {"size": [16, 16], "camera_id": "main"})

    def test_acknowledgements_of_nothing(self):
        for params in ({}, {"view_id": 1}, {"view_id": "1", "frame_seq": 1}, {"view_id": 1, "frame_seq": -1},
                       {"view_id": 1, "frame_seq": 2 ** 53 + 2}, {"view_id": 1, "frame_seq": 1, "x": 1},
                       {"view_id": 1, "frame_seq": 1, "held_ms": "1"}, {"view_id": 1, "frame_seq": 1, "held_ms": [1]}):
            self.fails("frame.ack", params, -32602)
        self.raw('{"jsonrpc":"2.0","id":7,"method":"frame.ack","params":{"view_id":1,"frame_seq":1,"held_ms":1e999}}')
        for _ in range(50):
            self.ws.notify("frame.ack", {"view_id": 4000000000, "frame_seq": 2 ** 53})

    def test_acknowledgements_held_for_odd_times(self):
        """A time out of range is taken as the nearest in it, and so is the acknowledgement: what is lost does not come again."""
        for held_ms in ("-1", "0", "1e9", "1000000001", "1e308", "null"):
            view_id = self.ws.call("view.open", {"size": [16, 16], "camera_id": "main"})["view_id"]
            while (stats := self.ws.wait_notification("frame.stats"))["view_id"] != view_id:
                pass
            before = self.daemon.metric("frames_acked_total")
            self.ws.send_text('{"jsonrpc":"2.0","method":"frame.ack","params":{"view_id":%d,"frame_seq":%d,"held_ms":%s}}'
                              % (view_id, stats["frame_seq"], held_ms))
            self.ws.call("view.close", {"view_id": view_id})
            self.assertEqual(self.daemon.metric("frames_acked_total"), before + 1, held_ms)

    # ---- limits ----

    def test_depth(self):
        def nested(depth):  # arrays in params in the message: two levels are there already
            return '{"jsonrpc":"2.0","id":7,"method":"scene.get","params":{"x":' + "[" * depth + "]" * depth + "}}"
        self.assertEqual(self.raw(nested(30))["data"]["code"], "unknown_field")
        for depth in (31, 1000, 1000000):
            self.assertIn(self.raw(nested(depth))["data"]["code"], ("limit_exceeded",), depth)

    def test_rate(self):
        """More than the bucket holds at once: the rest is refused by name, nothing is closed."""
        n = 1200
        request = b'{"jsonrpc":"2.0","id":%d,"method":"no.such"}'
        self.ws.send_raw(b"".join(frame(TEXT, request % (1000 + i)) for i in range(n)))
        while len(self.ws.replies) < n:
            self.ws.pump()
        apps = [self.ws.replies[1000 + i]["error"]["data"]["code"] for i in range(n)]
        self.ws.replies.clear()
        self.assertEqual(apps[:479], ["unsupported"] * 479)  # two seconds of LUM_LIMIT_MESSAGES_PER_S, less hello
        self.assertIn("limit_exceeded", apps[479:])
        self.patiently("scene.get", {})

    def test_order_of_replies_and_edits(self):
        """Pipelined edits are applied in the order they came, and each reply has its own revision."""
        before = self.ws.call("scene.get")["scene_rev"]
        ids = [self.ws.send_request("scene.apply", {"ops": [{"op": "set", "id": "render", "path": "/exposure_ev", "value": i}]})
               for i in range(20)]
        self.assertEqual([self.ws.reply(i)["scene_rev"] for i in ids], list(range(before + 1, before + 21)))

    def test_base_rev(self):
        rev = self.ws.call("scene.get")["scene_rev"]
        ops = [{"op": "set", "id": "render", "path": "/exposure_ev", "value": 1}]
        self.ws.call("scene.apply", {"base_rev": rev, "ops": ops})
        self.fails("scene.apply", {"base_rev": rev, "ops": ops}, -32000, "rev_conflict")


ROLES = {"vera": "view", "mia": "measure", "ed": "edit", "ann": "admin"}
OF_NO_SCENE = ("session.", "project.", "version.", "trash.")
READ_ONLY = ("project.list", "version.list")


class OfProjects(unittest.TestCase):
    """Where there are many scenes: roles are of the server, and a session may be in no project."""

    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        people = os.path.join(folder, "people")
        write_people(people, {name: (role, cls.token(name)) for name, role in ROLES.items()})
        cls.daemon = cls.enterClassContext(Daemon("--tokens", people, "--projects", os.path.join(folder, "projects"), scene=None))
        cls.daemon.token = cls.token("ann")

    @staticmethod
    def token(name):
        return f"token-of-{name}-0123456789"

    def come(self, name, **more):
        ws = self.daemon.connect(hello=False)
        ws.hello(self.token(name), **more)
        return ws

    def answer(self, ws, method, params):
        """What app code it is refused with; None: it is not."""
        while True:
            try:
                ws.call(method, params)
                return None
            except RpcError as error:
                self.assertIn(error.code, (-32602, -32000), f"{method} {str(params)[:80]}: {error}")
                if error.app != "limit_exceeded" or "messages a second" not in str(error):
                    return error.app

    def make(self, ws, trash=False):
        project = ws.call("project.create", {"name": "Foyer", "scene": "furnace"})["project"]
        version = ws.call("version.keep", {"project": project, "name": "evening"})["version"]
        if trash:
            ws.call("project.delete", {"project": project})
        return {"project": project, "version": version}

    def params(self, method, made):
        """Those that are right, of what is there."""
        return {k: made.get(k, v) for k, v in FORMS[method].items()}

    def test_of_no_project(self):
        for name, role in ROLES.items():
            ws = self.come(name)
            for method, params in FORMS.items():
                if not method.startswith(OF_NO_SCENE):
                    self.assertIn(self.answer(ws, method, params), ("unsupported", "forbidden"), f"{role} {method}")
            ws.close()
        ws = self.come("ann")
        for method in FORMS:
            if not method.startswith(OF_NO_SCENE):
                with self.assertRaisesRegex(RpcError, "in no project", msg=method):
                    ws.call(method, FORMS[method])
        ws.close()

    def test_roles(self):
        """Whoever may look may list; whoever may edit may do all else, in a project or in none, and others change nothing."""
        ann = self.come("ann")
        for name, role in ROLES.items():
            here, gone = self.make(ann), self.make(ann, trash=True)
            may = role in ("edit", "admin")
            for ws in (self.come(name), self.come(name, project=here["project"])):
                before = (ann.call("project.list"), ann.call("version.list", {"project": here["project"]}))
                for method in ("project.list", "version.list", "project.rename", "project.create", "version.keep", "project.restore",
                               "project.erase", "version.remove", "project.delete", "trash.empty"):
                    made = gone if method in ("project.restore", "project.erase") else here
                    app = self.answer(ws, method, self.params(method, made))
                    if method in READ_ONLY:
                        self.assertIsNone(app, f"{role} {method}")
                    elif not may:
                        self.assertEqual(app, "forbidden", f"{role} {method}")
                    else:  # a restored one is not there to be erased; one that somebody is in not to be deleted
                        self.assertIn(app, (None, "not_found", "in_use"), f"{role} {method}")
                    if may and method == "project.restore":
                        ann.call("project.delete", {"project": gone["project"]})
                if may:
                    break  # most of it is gone
                after = (ann.call("project.list"), ann.call("version.list", {"project": here["project"]}))
                self.assertEqual([p["name"] for p in after[0]["projects"]], [p["name"] for p in before[0]["projects"]])
                self.assertEqual((after[0]["trash"], after[1]), (before[0]["trash"], before[1]))
                ws.close()
        ann.close()

    def test_junk_in_every_field(self):
        ws = self.come("ed")
        for method in FORMS:
            if not method.startswith(("project.", "version.")):
                continue
            made = self.make(ws, trash=method in ("project.restore", "project.erase"))
            for name in FORMS[method]:
                for junk in JUNK:
                    self.answer(ws, method, {**self.params(method, made), name: junk})
        ws.call("trash.empty")
        ws.close()


if __name__ == "__main__":
    unittest.main()
