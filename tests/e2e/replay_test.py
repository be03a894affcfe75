"""lumend-replay against the running daemon: every edit and every camera step is seen in a frame, and frames are kept."""
import json
import os
import subprocess
import tempfile
import unittest

from daemon import LUMEND, Daemon

REPLAY = os.environ.get("LUMEND_REPLAY", "lumend-replay")
HEADER = '{"lumend":1,"kind":"replay"}\n'


def set_op(t_ms, id, path, value):
    return json.dumps({"t_ms": t_ms, "op": "set", "id": id, "path": path, "value": value}) + "\n"


class Replay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = cls.enterClassContext(Daemon())

    def play(self, *options, text=None, token=None):
        """(exit status, report or None, stderr)"""
        command = [REPLAY, "--url", f"ws://127.0.0.1:{self.daemon.port}", "--token", token or self.daemon.token,
                   "--view-size", "96x64", "--method", "whitted", "--json", *options] + (["-"] if text else [])
        done = subprocess.run(command, input=text, capture_output=True, text=True)
        return done.returncode, json.loads(done.stdout) if done.stdout else None, done.stderr

    def test_each_edit_is_seen(self):
        text = HEADER + "".join(set_op(i, "render", "/exposure_ev", 3 + i / 4) for i in range(8))
        status, report, log = self.play("--speed", "0", text=text)
        self.assertEqual((status, log), (0, ""))
        self.assertEqual((report["edits"], report["refused"], report["edit_to_frame_us"]["n"]), (8, 0, 8))
        # one after the other, so each has a frame of its own, and the server's share of the time is not the whole of it
        self.assertEqual(report["server_us"]["n"], 8)
        self.assertLessEqual(report["server_us"]["min"], report["edit_to_frame_us"]["max"])
        self.assertIsNone(report["camera_to_frame_us"])

    def test_time_is_kept(self):
        text = HEADER + "".join(set_op(100 * i, "render", "/exposure_ev", 3 + i / 4) for i in range(4))
        status, report, _ = self.play("--speed", "0.5", text=text)
        self.assertEqual((status, report["edits"], report["edit_to_frame_us"]["n"]), (0, 4, 4))
        # the last edit is due 600 ms after the first frame
        self.assertGreaterEqual(report["seconds"], 0.6)

    def test_camera_and_pictures(self):
        with tempfile.TemporaryDirectory() as folder:
            status, report, log = self.play("--camera-orbit", "4", "--record", folder)
            self.assertEqual((status, log), (0, ""))
            self.assertEqual(report["camera_to_frame_us"]["n"], 4)
            pictures = []
            for name in sorted(os.listdir(folder)):
                with open(os.path.join(folder, name), "rb") as f:
                    pictures.append(f.read())
            self.assertEqual(len(pictures), report["frames"])
            for picture in pictures:
                self.assertEqual(picture[:8], b"\x89PNG\r\n\x1a\n")
                self.assertEqual(picture[16:24], (96).to_bytes(4, "big") + (64).to_bytes(4, "big"))
            self.assertGreater(len(set(pictures)), 1)  # the camera moved

    def test_refused_edits_are_counted(self):
        text = HEADER + set_op(0, "nobody", "/on", True) + set_op(1, "render", "/exposure_ev", 4)
        status, report, log = self.play("--speed", "0", text=text)
        self.assertEqual((status, report["edits"], report["refused"], report["edit_to_frame_us"]["n"]), (1, 2, 1, 1))
        self.assertIn("nobody", log)

    def test_what_cannot_work_says_so(self):
        for options, text, words in (((), HEADER + "{}\n", "line 2"), (("--url", "ws://127.0.0.1:1"), HEADER,
                                      "cannot connect to ws://127.0.0.1:1 "),
                                     (("--url", "http://x"), HEADER, "ws://")):
            status, report, log = self.play(*options, text=text)
            self.assertEqual((status, report), (1, None))
            self.assertIn(words, log)
        status, _, log = self.play(text=HEADER, token="wrong")
        self.assertEqual(status, 1)
        self.assertIn("token", log)
        self.assertEqual(self.play("--speed", "fast", text=HEADER)[0], 2)


class BuiltIn(unittest.TestCase):
    """A replay of the server's own, as a user plays it: lumend scenes NAME | lumend-replay -"""

    def test_a_deforming_mesh_through_the_daemon(self):
        text = subprocess.run([LUMEND, "scenes", "wobble-moves"], capture_output=True, text=True, check=True).stdout
        with Daemon("--scene", "wobble") as daemon, tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([REPLAY, "--url", f"ws://127.0.0.1:{daemon.port}", "--token", daemon.token, "--view-size",
                                   "48x32", "--method", "whitted", "--speed", "0", "--json", "--record", folder, "-"],
                                  input=text, capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            report = json.loads(done.stdout)
            self.assertEqual((report["edits"], report["refused"], report["edit_to_frame_us"]["n"]), (100, 0, 100))
            pictures = set()
            for name in os.listdir(folder):
                with open(os.path.join(folder, name), "rb") as f:
                    pictures.add(f.read())
            # two waves of 50 poses each: the second shows the pictures of the first again
            self.assertGreaterEqual(len(pictures), 50)


if __name__ == "__main__":
    unittest.main()
