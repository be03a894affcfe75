"""Where people are: who says so hears of the others in the same scene, at a rate that the server sets, until they go."""
import os
import tempfile
import time
import unittest

from daemon import Daemon, write_people
from wsclient import RpcError, WebSocket

PER_S = 10  # LUM_LIMIT_PRESENCE_PER_S
TOKENS = {"vera": ("view", "token-of-vera-0123456789"), "ed": ("edit", "token-of-ed-0123456789")}


def camera(x):
    return {"position": [x, 1, 3], "target": [0, 1, 0]}


def people(ws):
    return {p["session"]: p for p in ws.wait_notification("presence")["people"]}


def until(ws, wanted):
    """The first news of which that holds; all before it are counted."""
    for n in range(1, 10 ** 6):
        news = people(ws)
        if wanted(news):
            return news, n


class Presence(unittest.TestCase):
    def come(self, daemon, token=None, **more):
        ws = WebSocket(daemon.port)
        ws.name = ws.hello(token or daemon.token, **more)["session"]
        return ws

    def refused(self, ws, params):
        with self.assertRaises(RpcError) as caught:
            ws.call("presence.set", params)
        return caught.exception

    def test_two_see_where_the_other_stands_and_points_until_she_goes(self):
        with Daemon() as daemon:
            ann, bob, script = (self.come(daemon) for _ in range(3))
            ann.call("presence.set", {"camera": camera(1), "point": [0.5, 0, 0.25]})
            bob.call("presence.set", {})
            news, _ = until(bob, lambda p: p[ann.name]["camera"])
            self.assertEqual(set(news), {ann.name, bob.name, script.name})
            self.assertEqual(news[ann.name], {"session": ann.name, "person": "", "role": "edit", "point": [0.5, 0, 0.25], "camera": {
                **camera(1), "up": [0, 1, 0], "vfov_deg": 45, "projection": "perspective"}})
            self.assertEqual((news[bob.name]["camera"], news[bob.name]["point"]), (None, None))
            bob.call("presence.set", {"camera": camera(2)})
            until(ann, lambda p: p[bob.name]["camera"] and p[bob.name]["camera"]["position"][0] == 2)
            ann.call("presence.set", {"point": None})
            news, _ = until(bob, lambda p: p[ann.name]["point"] is None)
            self.assertEqual(news[ann.name]["camera"]["position"], [1, 1, 3], "what is left out stays")
            late = self.come(daemon)
            until(bob, lambda p: late.name in p)
            ann.close()
            news, _ = until(bob, lambda p: ann.name not in p)
            self.assertEqual(set(news), {bob.name, script.name, late.name})
            script.call("stats.get")
            self.assertEqual([n for n, _ in script.notifications if n == "presence"], [], "who says nothing of itself hears nothing")

    def test_news_come_no_faster_than_the_limit_and_end_with_the_newest(self):
        with Daemon() as daemon:
            ann, bob = self.come(daemon), self.come(daemon)
            begin = time.monotonic()
            bob.call("presence.set", {})
            for i in range(1, 301):
                ann.notify("presence.set", {"camera": camera(i)})
                time.sleep(0.005)  # a hand that moves, below the limit of messages: no test waits for it
            news, n = until(bob, lambda p: p[ann.name]["camera"] and p[ann.name]["camera"]["position"][0] == 300)
            elapsed_s = time.monotonic() - begin
            self.assertLessEqual(n, elapsed_s * PER_S + 2, "one in each tenth of a second that this time touches")
            self.assertGreater(n, 1, "and it is followed")

    def test_roles_are_told_and_any_may_say_where_it_is(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "people")
            write_people(path, TOKENS)
            with Daemon("--tokens", path) as daemon:
                vera, ed = (self.come(daemon, TOKENS[name][1]) for name in ("vera", "ed"))
                vera.call("presence.set", {"camera": camera(1)})
                ed.call("presence.set", {"camera": camera(2)})
                news, _ = until(vera, lambda p: p[ed.name]["camera"])
                self.assertEqual({p["person"]: p["role"] for p in news.values()}, {"vera": "view", "ed": "edit"})
                self.assertNotIn("address", news[ed.name], "that is for administrators")

    def test_what_is_said_is_held_to_the_fields_of_a_camera(self):
        with Daemon() as daemon:
            ann = self.come(daemon)
            for params, path in (({"camera": {"position": [0, 1, 3]}}, "camera/target"), ({"camera": {**camera(1), "vfov_deg": 180}}, "camera/vfov_deg"),
                                 ({"camera": {"position": [0, 1, 0], "target": [0, 1, 0]}}, "camera/target"), ({"camera": {**camera(1), "roll": 1}}, "camera/roll"),
                                 ({"point": [0, 1]}, "point"), ({"point": [0, 1, 2e9]}, "point/2"), ({"person": "bob"}, "person")):
                self.assertEqual(self.refused(ann, params).data.get("path"), path, params)
            ann.call("presence.set", {})
            self.assertIsNone(people(ann)[ann.name]["camera"], "nothing of what was refused is known")

    def test_nobody_hears_of_another_project(self):
        with tempfile.TemporaryDirectory() as folder, Daemon("--projects", folder, scene=None) as daemon:
            lobby = self.come(daemon)
            a, b = (lobby.call("project.create", {"name": name})["project"] for name in "AB")
            self.assertEqual(self.refused(lobby, {}).app, "unsupported")
            in_a, also_in_a, in_b = (self.come(daemon, project=p) for p in (a, a, b))
            for ws in (in_a, also_in_a, in_b):
                ws.call("presence.set", {"camera": camera(1)})
            until(in_a, lambda p: p.keys() == {in_a.name, also_in_a.name})
            until(in_b, lambda p: p.keys() == {in_b.name})
            in_b.close()
            also_in_a.close()
            news, _ = until(in_a, lambda p: also_in_a.name not in p)
            self.assertEqual(set(news), {in_a.name})


if __name__ == "__main__":
    unittest.main()
