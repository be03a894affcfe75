"""Clients on slow lines beside a fast one: the fast one's pictures keep coming, and the daemon's memory is flat.

The short form of tests/bench/slow_reader.py, which runs for minutes and compares rates.
"""
import unittest

from daemon import SKY, Daemon
from wsclient import LAST_TILE, tile_header

SIZE = [320, 240]
N_FRAMES = 40


class View:
    """A view that is kept busy: its exposure changes with each frame, so that every tile is new."""

    def __init__(self, ws, size, n_changes=7):
        self.ws = ws
        self.n_frames = 0
        self.n_changes = n_changes
        self.seq = None
        self.view_id = ws.call("view.open", {"size": size, "camera_id": "main", "codec": "rgba8", "method": "whitted",
                                             "stats": False})["view_id"]

    def take_tiles(self):
        """Acknowledges what has come, and asks for something new after each whole frame."""
        for message in self.ws.binaries:
            header = tile_header(message)
            assert self.seq in (None, header["frame_seq"]), "a torn frame"
            self.seq = header["frame_seq"]
            if header["flags"] & LAST_TILE:
                self.ws.notify("frame.ack", {"view_id": self.view_id, "frame_seq": self.seq})
                self.n_frames += 1
                self.seq = None
                # A request, so that a refusal is seen: a change that was refused brings no frame to wait for.
                self.ws.send_request("view.update", {"view_id": self.view_id,
                                                     "exposure_ev": 1 + self.n_frames % self.n_changes})
        self.ws.binaries.clear()
        for reply in self.ws.replies.values():
            assert "error" not in reply, reply
        self.ws.replies.clear()

    def whole_frame(self):
        n = self.n_frames
        while self.n_frames == n:
            self.ws.pump()
            self.take_tiles()

    def sip(self, n_bytes):
        self.ws.sip(n_bytes)
        self.take_tiles()


class SlowReader(unittest.TestCase):
    def test_fast_one_goes_on_and_memory_is_flat(self):
        # Freed memory is kept for a while under AddressSanitizer, which would look like growth.
        with Daemon("--scene", SKY, environment={"ASAN_OPTIONS": "quarantine_size_mb=1"}) as daemon:
            fast = View(daemon.connect(), SIZE)
            slow = [View(daemon.connect(rcvbuf=4096), SIZE) for _ in range(3)]
            for _ in range(10):  # everything that is allocated once is there
                fast.whole_frame()
                for view in slow:
                    view.sip(2048)
            before = daemon.rss_bytes()
            for _ in range(N_FRAMES):
                fast.whole_frame()
                for view in slow:
                    view.sip(2048)
            grown = daemon.rss_bytes() - before
            # A queue of the frames that the slow ones did not take would be 3 * N_FRAMES * 300 KB = 36 MB. Allowed, for
            # the allocator's own ways: what the four views may hold, two frames each, and what is made once when a frame
            # first takes long: a rough picture's buffers, as much again, and what it adds to, 12 bytes a pixel.
            frame_bytes = SIZE[0] * SIZE[1] * 4
            self.assertLess(grown, 4 * (4 + 3) * frame_bytes, f"grew by {grown} bytes")
            for view in slow:  # they are alive, and what they get is whole
                view.whole_frame()
                view.whole_frame()
            daemon.assert_well()


if __name__ == "__main__":
    unittest.main()
