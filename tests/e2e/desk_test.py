"""A lighting desk: sACN and Art-Net over loopback, built byte by byte from their layouts (clients/minimal/desk.py, and here), dim and colour lamps by a patch that is part
of the scene. The picture follows without a ray of light; nothing of it is an edit."""
import os
import socket
import struct
import subprocess
import sys
import tempfile
import unittest

from daemon import Daemon
from wsclient import CONVERGED, LAST_TILE, RpcError, tile_header

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../clients/minimal"))
from desk import packet as sacn  # noqa: E402

SENDER_PACKAGE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../clients/web/node_modules/sacn")
LAMPS = [{"op": "add", "type": "light", "id": f"lamp{i}", "kind": "point", "position": [(i - 1) * 0.4, 1.5, 0.5], "flux_lm": 900,
          "group": "row"} for i in range(3)]


def artnet(port_address, sequence, slots):
    return (b"Art-Net\0" + struct.pack("<H", 0x5000)
            + struct.pack(">HBBBBH", 14, sequence, 0, port_address & 255, port_address >> 8, len(slots)) + bytes(slots))


class Desk:
    """Sends to one port of the daemon."""

    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.to = ("127.0.0.1", port)
        self.sequence = -1

    def send(self, universe, slots, **more):
        self.sequence += 1
        self.socket.sendto(sacn(universe, self.sequence, slots, name="desk ä", **more), self.to)

    def send_raw(self, data):
        self.socket.sendto(data, self.to)


class View:
    def __init__(self, daemon, method="whitted", **more):
        self.ws = daemon.connect()
        self.id = self.ws.call("view.open", {"camera_id": "main", "size": [64, 48], "codec": "rgba8", "spp": 1, "exposure_ev": 8, "tone_map": "none",
                                             "method": method, **more})["view_id"]
        self.tiles = {}

    def edit(self, *ops):
        return self.ws.call("scene.apply", {"ops": list(ops)})["scene_rev"]

    def desk(self):
        return self.ws.call("stats.get")["desk"]

    def next_frame(self):
        """Statistics of the next frame; self.tiles is the picture then."""
        while True:
            while self.ws.binaries:
                data = self.ws.binaries.pop(0)
                h = tile_header(data)
                self.tiles[h["x"], h["y"]] = data[64:]
                if h["flags"] & LAST_TILE:
                    self.ws.notify("frame.ack", {"view_id": self.id, "frame_seq": h["frame_seq"]})
                    return h
            self.ws.pump()

    def at_rest(self):
        while not self.next_frame()["flags"] & CONVERGED:
            pass

    def until(self, fits):
        """Frames until the picture fits; it must come to that."""
        while not fits(self.light()):
            self.next_frame()

    def until_sources(self, sources):
        """Packets take their way beside requests: asks until the first universe has these sources."""
        while self.desk()["universes"][0]["sources"] != sources:
            pass

    def light(self):
        """Sums of red, green, blue."""
        return [sum(sum(t[c::4]) for t in self.tiles.values()) for c in range(3)]

    def rays(self):
        """Of light transport, over all frames told of so far."""
        return sum(n for name, f in self.ws.notifications if name == "frame.stats" for kind, n in f["rays"].items() if kind != "probe")

    def forget(self):
        self.ws.notifications.clear()


def patch(id, target, address, **more):
    return {"op": "add", "type": "patch", "id": id, "target": target, "address": address, **more}


class Patched(unittest.TestCase):
    def setUp(self):
        self.daemon = Daemon("--deterministic", "--sacn", "127.0.0.1:0", "--artnet", "127.0.0.1:0")
        self.daemon.__enter__()
        self.addCleanup(self.daemon.__exit__, None, None, None)

    def begin(self, *patches, **more):
        view = View(self.daemon, **more)
        off = [{"op": "set", "id": id, "path": "/on", "value": False} for id in ("ceiling-panel", "globe")]
        view.edit(*LAMPS, *off, *patches)
        view.at_rest()
        view.desk()
        view.forget()
        return view, Desk(view.desk()["sacn"]["port"])

    def test_dims_a_lamp_and_a_group_without_a_ray_and_without_an_edit(self):
        for method in ("whitted", "live"):
            with self.subTest(method):
                if method == "live":
                    self.doCleanups()
                    self.setUp()
                view, desk = self.begin(patch("one", "lamp0", 1), patch("all", "row", 2, channels="dim16"), method=method)
                rev = view.ws.call("scene.get", {"expand": False})["scene_rev"]
                full = sum(view.light())
                desk.send(1, [0, 255, 255])
                view.until(lambda c: sum(c) < full)
                two = sum(view.light())
                self.assertGreater(two, 0.3 * full)
                desk.send(1, [255, 128, 0])
                view.until(lambda c: 0 < sum(c) < full and sum(c) != two)
                desk.send(1, [255, 0, 0])
                view.until(lambda c: sum(c) == 0)
                lux = view.ws.call("probe", {"point": [0, 0.01, 0.5], "normal": [0, 1, 0], "samples": 4})["illuminance_lx"]
                self.assertEqual(lux, 0, "meters see what is shown")
                desk.send(1, [255, 255, 255])
                view.until(lambda c: sum(c) == full)
                told = view.desk()
                self.assertEqual(view.rays(), 0, "light is summed anew")
                self.assertEqual(told["looks"], 4)
                self.assertEqual(view.ws.call("scene.get", {"expand": False})["scene_rev"], rev)
                self.assertNotIn("scene.changed", [name for name, _ in view.ws.notifications])
                view.ws.call("scene.undo")
                with self.assertRaises(RpcError):  # that was the one edit that there is
                    view.ws.call("scene.undo")

    def test_512_channels_drive_the_picture_and_only_the_newest_look_is_shown(self):
        patches = [patch(f"p{i}", f"lamp{i % 3}", i + 1, curve="square") for i in range(512)]
        view, desk = self.begin(*patches)
        full = sum(view.light())
        n = 440  # ten seconds of a desk
        for i in range(n):
            desk.send(1, [i % 200] * 512)
            if i % 32 == 31:  # so that the kernel's queue has room, however slow this machine is
                while view.desk()["universes"][0]["packets"] < i + 1:
                    pass
        desk.send(1, [255] * 512)
        while view.desk()["universes"][0]["packets"] < n + 1:  # a frame from before may be as bright
            pass
        view.until(lambda c: sum(c) == full)
        told = view.desk()
        one = told["universes"][0]
        self.assertEqual((one["packets"], one["late"], one["lost"], one["channels"]), (n + 1, 0, 0, 512))
        self.assertEqual((told["sacn"]["dropped"], told["sacn"]["bad"], told["patches_heard"]), (0, 0, 512))
        self.assertLessEqual(told["looks"], n + 1)
        self.assertEqual(view.rays(), 0)
        self.assertEqual(one["sources"][0]["name"], "desk ä")

    def test_colours_by_rgb_of_both_protocols(self):
        view, desk = self.begin(patch("color", "row", 1, channels="rgb", universe=9),
                                patch("fine", "row", 10, channels="rgb16", protocol="artnet", universe=0x123))
        desk.send(9, [255, 0, 0])
        view.until(lambda c: c[0] > 5 * (c[1] + c[2]))
        desk.send(9, [255, 255, 255])
        view.until(lambda c: c[1] > 0.5 * c[0])
        other = Desk(view.desk()["artnet"]["port"])
        other.send_raw(artnet(0x123, 1, [0] * 9 + [0, 0, 0, 0, 255, 255, 0]))
        view.until(lambda c: c[2] > 2 * c[0])
        self.assertEqual(view.rays(), 0)
        self.assertEqual([u["protocol"] for u in view.desk()["universes"]], ["sacn", "artnet"])

    def test_the_last_look_holds_and_edits_go_on_under_it(self):
        view, desk = self.begin(patch("all", "row", 1))
        full = sum(view.light())
        desk.send(1, [64])
        view.until(lambda c: sum(c) < full)
        dim = sum(view.light())
        desk.send(1, [64], options=0x40)  # it says that it ends
        view.edit({"op": "set", "id": "lamp0", "path": "/flux_lm", "value": 1800})
        view.until(lambda c: dim < sum(c) < full)
        view.until_sources([])
        view.edit({"op": "remove", "id": "all"})
        view.until(lambda c: sum(c) > full)
        self.assertEqual(view.desk()["universes"], [])

    def test_what_nobody_patched_and_what_is_broken_changes_nothing(self):
        view, desk = self.begin(patch("all", "row", 1))
        for data in (b"", b"\0" * 1400, sacn(1, 0, [0])[:-1], artnet(1, 1, [0, 0])):
            desk.send_raw(data)
        desk.send(2, [0])
        desk.send(1, [0], options=0x80)
        while (told := view.desk())["sacn"]["packets"] < 6:
            pass
        self.assertEqual((told["sacn"]["bad"], told["sacn"]["unpatched"], told["looks"]), (4, 1, 0))
        self.assertEqual(told["universes"][0]["previews"], 1)

    def test_a_patch_that_names_nothing_is_refused_with_the_field_and_the_limit(self):
        view = View(self.daemon)
        view.edit(*LAMPS)
        for wrong, path in ((patch("p", "lamp9", 1), "ops/0/target"), (patch("p", "row", 513), "ops/0/address"),
                            (patch("p", "row", 511, channels="rgb"), "ops/0/address"), (patch("p", "row", 1, universe=0), "ops/0/universe"),
                            (patch("p", "row", 1, universe=32768, protocol="artnet"), "ops/0/universe"),
                            (patch("p", "row", 1, channels="cmy"), "ops/0/channels"), ({"op": "add", "type": "patch", "id": "p"}, "ops/0/target")):
            with self.assertRaises(RpcError) as refused:
                view.edit(wrong)
            self.assertEqual(refused.exception.data["path"], path, wrong)
        view.edit(patch("p", "row", 510, channels="rgb"))
        with self.assertRaises(RpcError) as refused:
            view.edit({"op": "set", "id": "p", "path": "/target", "value": "nobody"})
        self.assertEqual(refused.exception.data["path"], "ops/0/target")
        view.edit(*({"op": "remove", "id": lamp["id"]} for lamp in LAMPS))  # it outlives what it names ...
        kept = view.ws.call("scene.get", {"expand": False})["ops"]
        self.assertFalse([op for op in kept if op.get("type") == "patch"])  # ... and then is not saved
        self.assertTrue([op for op in view.ws.call("scene.get", {"expand": True})["ops"] if op.get("type") == "patch"])


    @unittest.skipUnless(os.environ.get("LUMEND_NODE") and os.path.isdir(SENDER_PACKAGE), "no node, or not its package")
    def test_an_independent_sender_drives_512_channels_at_44_hz(self):
        """That of npm's "sacn". On this machine and in this order nothing is lost: each packet is a look, or coalesced into one."""
        frames = 66
        patches = [patch(f"p{i}", f"lamp{i % 3}", i + 1, universe=3) for i in range(512)]
        view, _ = self.begin(*patches)
        full = sum(view.light())
        sender = os.path.join(os.path.dirname(os.path.abspath(__file__)), "web/desk_sender.mjs")
        node = subprocess.Popen([os.environ["LUMEND_NODE"], sender, str(view.desk()["sacn"]["port"]), "3", "1", str(frames)],
                                stdout=subprocess.DEVNULL)
        self.addCleanup(node.wait)
        view.until(lambda c: sum(c) < full)
        view.until(lambda c: sum(c) == full)
        told = view.desk()
        one = told["universes"][0]
        self.assertEqual((one["packets"], one["late"], one["lost"], one["channels"]), (frames, 0, 0, 512))
        self.assertEqual((told["sacn"]["dropped"], told["sacn"]["bad"]), (0, 0))
        self.assertEqual((one["sources"][0]["name"], one["sources"][0]["priority"]), ("npm", 120))
        self.assertEqual(view.rays(), 0)


class Kept(unittest.TestCase):
    def test_patches_are_kept_and_what_the_desk_says_is_not(self):
        with tempfile.TemporaryDirectory() as state:
            options = ("--deterministic", "--sacn", "127.0.0.1:0", "--state", state)
            with Daemon(*options) as daemon:
                view = View(daemon)
                rev = view.edit(*LAMPS, patch("all", "row", 1))
                view.at_rest()
                full = view.light()
                size = view.ws.call("stats.get")["state"]["journal_bytes"]
                for value in range(100):
                    Desk(view.desk()["sacn"]["port"]).send(1, [value])
                view.until(lambda c: c != full)
                self.assertEqual(view.ws.call("stats.get")["state"]["journal_bytes"], size)
            with Daemon(*options) as daemon:
                view = View(daemon)
                view.at_rest()
                self.assertEqual(view.light(), full)
                self.assertEqual(view.ws.call("scene.get", {"expand": False})["scene_rev"], rev)
                Desk(view.desk()["sacn"]["port"]).send(1, [0])
                view.until(lambda c: c != full)


class Closed(unittest.TestCase):
    def test_nothing_listens_unless_asked(self):
        with Daemon() as daemon:
            self.assertIsNone(daemon.connect().call("stats.get")["desk"])


if __name__ == "__main__":
    unittest.main()
