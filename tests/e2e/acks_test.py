"""Acknowledgements as simple clients send them: whenever a frame's number is known. None of them may be lost, as two lost
ones would starve the view for good.

Frames are kept on their way by size: they are larger than what the sockets between server and client hold, so while the
client does not read, the last tile is not sent, whatever the machine's speed.
"""
import unittest

from daemon import SKY, Daemon
from wsclient import LAST_TILE, tile_header

RCVBUF = 1 << 17
SIZE = [1280, 1024]  # in rgba8 5.2 MB; Linux lets a socket's send buffer grow to 4 MiB (tcp_wmem)
N_FRAMES = 6  # more than may be unacknowledged


class Viewer:
    def __init__(self, daemon, **options):
        self.ws = daemon.connect(rcvbuf=RCVBUF)
        self.view_id = self.ws.call("view.open", {"camera_id": "main", "codec": "rgba8", "method": "whitted",
                                                  "size": SIZE, **options})["view_id"]

    def change(self, i):
        """Every tile is new."""
        self.ws.call("view.update", {"view_id": self.view_id, "exposure_ev": 1 + i})

    def ack(self, frame_seq):
        """With the reply: the server has taken it."""
        self.ws.call("frame.ack", {"view_id": self.view_id, "frame_seq": frame_seq})

    def ack_next_stats(self):
        stats = self.ws.wait_notification("frame.stats")
        self.ack(stats["frame_seq"])
        return stats

    def last_tiles(self):
        """Numbers of the frames that are complete."""
        headers = map(tile_header, self.ws.binaries)
        return [h["frame_seq"] for h in headers if h["flags"] & LAST_TILE]

    def next_last_tile(self):
        while not (complete := self.last_tiles()):
            self.ws.pump()
        self.ws.binaries.clear()
        return complete[-1]


class Acks(unittest.TestCase):
    def test_at_the_stats_before_the_last_tile(self):
        with Daemon("--scene", SKY) as daemon:
            viewer = Viewer(daemon)
            for i in range(N_FRAMES):
                frame_seq = viewer.ack_next_stats()["frame_seq"]
                self.assertEqual(daemon.metric("frames_acked_total"), i + 1)
                self.assertNotIn(frame_seq, viewer.last_tiles(), "the test is void: the frame was complete already")
                viewer.ws.binaries.clear()
                viewer.change(i)

    def test_one_covers_all_before_it(self):
        with Daemon("--scene", SKY) as daemon:
            viewer = Viewer(daemon, size=[64, 64], stats=False)
            n_unacked = 2
            for i in range(N_FRAMES):
                frame_seq = viewer.next_last_tile()
                if i % n_unacked == n_unacked - 1:
                    viewer.ack(frame_seq)
                viewer.change(i)

    def test_of_two_clients_in_turn(self):
        """Each edits, and both wait for the picture of it: what a client does that knows frame.stats alone."""
        with Daemon() as daemon:
            viewers = [Viewer(daemon, size=[300, 200], codec="jpeg", spp=2) for _ in range(2)]
            n_acks = 0
            for i in range(2 * N_FRAMES):
                rev = viewers[i % 2].ws.call("scene.apply", {"ops": [
                    {"op": "set", "id": "ceiling-panel", "path": "/flux_lm", "value": 5000 + i}]})["scene_rev"]
                for viewer in viewers:
                    shown = 0
                    while shown < rev:
                        shown = viewer.ack_next_stats()["scene_rev"]
                        n_acks += 1
                        self.assertEqual(daemon.metric("frames_acked_total"), n_acks)


if __name__ == "__main__":
    unittest.main()
