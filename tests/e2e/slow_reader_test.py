"""A client that hardly reads, beside one that does: the fast one's pictures keep coming, and the daemon's memory is flat.

The short form of tests/bench/slow_reader.py, which runs for minutes and compares rates.
"""
import os
import socket
import unittest

from daemon import Daemon
from wsclient import LAST_TILE, WAIT_S, tile_header

SIZE = [640, 480]


class View:
    """A view that is kept busy: its exposure changes with each frame, so that every tile is new."""

    def __init__(self, ws):
        self.ws = ws
        self.n_frames = 0
        self.view_id = ws.call("view.open", {"size": SIZE, "camera_id": "main", "codec": "rgba8", "stats": False})["view_id"]

    def whole_frame(self):
        """Reads one frame to its last tile, acknowledges it, and asks for something new."""
        seq = None
        while True:
            while not self.ws.binaries:
                self.ws.pump()
            header = tile_header(self.ws.binaries.pop(0))
            assert seq in (None, header["frame_seq"]), "a torn frame"
            seq = header["frame_seq"]
            if header["flags"] & LAST_TILE:
                break
        self.n_frames += 1
        self.ws.notify("frame.ack", {"view_id": self.view_id, "frame_seq": seq})
        self.ws.notify("view.update", {"view_id": self.view_id, "exposure_ev": 1 + self.n_frames % 7})
        self.ws.replies.clear()


class SlowReader(unittest.TestCase):
    def test_fast_one_goes_on_and_memory_is_flat(self):
        n_frames = int(os.environ.get("SLOW_READER_FRAMES", "60"))
        with Daemon() as daemon:
            fast = View(daemon.connect())
            for _ in range(10):  # everything that is allocated once is there
                fast.whole_frame()
            slow = [View(daemon.connect(rcvbuf=4096)) for _ in range(3)]
            for view in slow:  # asks for ever new pictures and reads none of them
                view.ws.sock.settimeout(WAIT_S)
                for i in range(20):
                    view.ws.notify("view.update", {"view_id": view.view_id, "exposure_ev": i % 5})
            for _ in range(10):
                fast.whole_frame()
            before = daemon.rss_bytes()
            for _ in range(n_frames):
                fast.whole_frame()
            grown = daemon.rss_bytes() - before
            # Frames of 1.2 MB each: a queue of those that the slow ones did not read would be 3 * n_frames * 1.2 MB.
            # Allowed: what one view may hold (two frames, its film's copies) for allocator noise.
            self.assertLess(grown, 4 * SIZE[0] * SIZE[1] * 4, f"grew by {grown} bytes")
            for view in slow:  # the slow ones are alive, and what they get next is whole and new
                view.ws.sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
                for _ in range(3):
                    view.whole_frame()
            daemon.assert_well()


if __name__ == "__main__":
    unittest.main()
