#!/usr/bin/env python3
"""A crowd that edits one scene while others attack: is every edit still seen, how soon, and does memory stay flat?

usage: LUMEND=build/release/bin/lumend tests/stress/crowd.py [--seconds 1800] [--clients 50] [--attackers 10] [--interval 30]
           [--elsewhere]

Each client has a view and a lamp of its own, changes it now and then, and waits for the first whole picture that shows it;
clients leave, or are cut off, and others come. Quiet intervals alternate with those in which attackers, a process of their
own, do what ATTACKS says, so that what the machine does besides hits both alike. With --elsewhere the attackers attack another
daemon in quiet intervals: what they take of the processors themselves, where they and the daemon share a machine, is in both,
too. Prints JSON: percentiles of edit to
picture in both, and the slope of the daemon's memory after --warm seconds: a line through the means of each pair of
intervals, with its standard error. Exit status 1 where a client was closed or refused, an edit was never seen, or an
attacker could not attack.
"""
import argparse
import contextlib
import json
import math
import os
import random
import select
import socket
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "e2e"))
from daemon import Daemon  # noqa: E402
from wsclient import (BROKEN, LAST_TILE, PING, TEXT, Closed, HandshakeFailed, WebSocket, connect_tcp, frame,  # noqa: E402
                      tile_header)

VIEW = [64, 48]
LEAVES_PER_S = 0.2  # who is replaced
MESSAGE_BYTES = 8 << 20
NEVER_S = 300.0     # after which it is said that something does not happen
SETTLE_S = 2.0      # of an interval, not counted: attackers come, or what they left is done


class Client:
    """One that behaves: reads, acknowledges, and has one edit under way at most."""

    def __init__(self, daemon, name, rng):
        self.ws = daemon.connect(hello=False)
        self.ws.hello(daemon.token, client=name)
        self.lamp, self.flux, self.seq = name, 100, None
        self.edit = self.edit_id = self.rev = None  # when it was sent; until its picture is there
        self.seen = []  # (when, revision) of whole pictures since
        self.view_id = self.ws.call("view.open", {"size": VIEW, "camera_id": "main", "codec": "jpeg", "stats": False})["view_id"]
        self.ws.call("scene.apply", {"ops": [{"op": "add", "type": "light", "id": name, "kind": "point", "flux_lm": self.flux,
                                              "position": [rng.uniform(-.8, .8), rng.uniform(.5, 1.8), rng.uniform(-.8, .8)]}]})

    def begin_edit(self):
        self.flux = 700 - self.flux  # 100 and 600: the picture changes
        self.edit, self.rev, self.seen = time.monotonic(), None, []
        self.edit_id = self.ws.send_request("scene.apply", {"ops": [{"op": "set", "id": self.lamp, "path": "/flux_lm",
                                                                      "value": self.flux}]})

    def take(self):
        """What has come; returns the seconds that an edit took until it was seen, or None."""
        if not self.ws.sock.recv(1, socket.MSG_PEEK):  # it was readable
            raise Closed()
        self.ws.sip(1 << 18)
        now = time.monotonic()
        for tile in self.ws.binaries:
            header = tile_header(tile)
            if header["flags"] & LAST_TILE:
                self.ws.notify("frame.ack", {"view_id": self.view_id, "frame_seq": header["frame_seq"]})
                self.seen.append((now, header["scene_rev"]))
        for reply in self.ws.replies.values():
            if "error" in reply:
                raise AssertionError(f"{self.lamp} was refused: {reply['error']}")
            if reply["id"] == self.edit_id:
                self.rev = reply["result"]["scene_rev"]
        for list_of in (self.ws.binaries, self.ws.replies, self.ws.notifications):
            list_of.clear()
        done = next((at for at, rev in self.seen if rev >= self.rev), None) if self.edit and self.rev else None
        took = done - self.edit if done else None
        if done:
            self.edit = self.edit_id = None
        if not self.edit:
            self.seen.clear()
        return took

    def leave(self, politely):
        if politely:  # its lamp goes with it
            self.ws.call("scene.apply", {"ops": [{"op": "remove", "id": self.lamp}]})
            self.ws.leave()
        else:
            self.ws.close()


class Crowd:
    def __init__(self, daemon, n, seed, edits_per_s):
        self.daemon, self.rng, self.n_came, self.n_edits = daemon, random.Random(seed), 0, 0
        self.edits_per_s = edits_per_s
        self.left_behind = []  # lamps of those who were cut off: the next who comes takes them away
        self.clients = [self.come() for _ in range(n)]

    def come(self):
        self.n_came += 1
        client = Client(self.daemon, f"lamp-{self.n_came}", self.rng)
        while self.left_behind:
            client.ws.call("scene.apply", {"ops": [{"op": "remove", "id": self.left_behind.pop()}]})
        return client

    def replace(self):
        i = self.rng.randrange(len(self.clients))
        client = self.clients[i]
        if client.edit:
            return  # its edit is waited for first
        politely = self.rng.random() < 0.8
        if not politely:
            self.left_behind.append(client.lamp)
        client.leave(politely)
        self.clients[i] = self.come()

    def interval(self, seconds):
        """[(when, seconds it took)] of edits, [bytes of the daemon]; ends when no edit is under way."""
        took, memory = [], []
        begin = time.monotonic()
        next_edit = next_leave = next_look = begin
        while True:
            now = time.monotonic()
            over = now - begin >= seconds
            if over and not any(c.edit for c in self.clients):
                return took, memory
            if over and now - begin > seconds + NEVER_S:
                raise AssertionError(f"edits of {[c.lamp for c in self.clients if c.edit]} were never seen")
            if not over and now >= next_edit:
                idle = [c for c in self.clients if not c.edit]
                if idle:
                    self.rng.choice(idle).begin_edit()
                    self.n_edits += 1
                next_edit = now + self.rng.expovariate(self.edits_per_s)
            if not over and now >= next_leave:
                self.replace()
                next_leave = now + self.rng.expovariate(LEAVES_PER_S)
            if now >= next_look:
                memory.append(self.daemon.rss_bytes())
                next_look = now + 1
            by_socket = {c.ws.sock: c for c in self.clients}
            for sock in select.select(list(by_socket), [], [], 0.02)[0]:
                seconds_taken = by_socket[sock].take()
                if seconds_taken is not None:
                    took.append((time.monotonic() - begin, seconds_taken))


# ---- attackers: a process of their own ----

def ask(method, params):
    return frame(TEXT, json.dumps({"jsonrpc": "2.0", "id": 1, "method": method, "params": params}).encode())


GIANT = frame(TEXT, b'{"jsonrpc":"2.0","id":1,"method":"no.such","params":{"x":"' + b"a" * (MESSAGE_BYTES - 61) + b'"}}')
DEEP = frame(TEXT, b'{"jsonrpc":"2.0","id":1,"method":"no.such","params":[' + b"0," * 50000 + b"0]}")
PROBE = ask("probe", {"point": [0, 1, 0], "normal": [0, 1, 0], "samples": 65536})
BIG_VIEW = ask("view.open", {"size": [640, 480], "camera_id": "main", "codec": "rgba8", "stats": False})
ATTACKS = {  # what is sent again and again; how much of what comes is read; what is sent once
    "gets": (ask("scene.get", {"expand": True}) * 8, 1 << 18, b""),
    "slow": (ask("view.update", {"view_id": 1, "exposure_ev": 1}) + ask("view.update", {"view_id": 1, "exposure_ev": 2}), 512,
             BIG_VIEW),
    "giant": (GIANT, 1 << 16, b""),
    "half-open": (None, 0, b""),
    "pings": (frame(PING, b"a" * 125) * 64, 1 << 16, b""),
    "probes": (PROBE * 8, 1 << 16, b""),
    "deaf": (ask("scene.get", {}) * 8, 0, b""),
    "values": (DEEP, 1 << 16, b""),
    "refused": (ask("scene.apply", {"ops": [{"op": "remove", "id": "no-such"}]}) * 8, 1 << 16, b""),
    "comes": (b"", 0, None),  # hello and away, as often as it may
}


class Attacker:
    def __init__(self, kind, port, token, source):
        self.kind, self.port, self.token, self.source = kind, port, token, source
        self.data, self.n_read, self.first = ATTACKS[kind]
        self.socks, self.ws, self.rest, self.n_sent = [], None, b"", 0

    def step(self):
        """A bit of its attack, without waiting. Being cut off is an answer: it comes again."""
        try:
            if self.kind == "half-open":
                self.socks.append(connect_tcp(self.port, source=self.source))
                self.socks[-1].sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: a")
                self.n_sent += 1
                if len(self.socks) > 200:
                    self.socks.pop(0).close()
                return
            if not self.ws:
                self.ws = WebSocket(self.port, source=self.source, rcvbuf=4096 if self.n_read < 4096 else None)
                self.ws.hello(self.token)
                self.rest = self.first or b""
            if self.first is None:
                self.ws.close()
                self.ws = None
                self.n_sent += 1
                return
            if self.n_read:
                self.ws.sip(self.n_read)
                for kept in (self.ws.binaries, self.ws.replies, self.ws.notifications, self.ws.pongs):
                    kept.clear()
            self.rest = self.rest or self.data
            self.ws.sock.settimeout(0)
            n = self.ws.sock.send(self.rest[:1 << 16])
            self.rest = self.rest[n:]
            self.n_sent += n
        except (BlockingIOError, HandshakeFailed):
            pass
        except (Closed, *BROKEN, TimeoutError):
            self.ws = None


def attack(port, token, kinds, n, seconds):
    """Prints how much each sent."""
    all_of = [Attacker(kinds[i % len(kinds)], port, token, f"127.0.1.{1 + i}") for i in range(n)]
    end = time.monotonic() + seconds
    while time.monotonic() < end or not all(a.n_sent for a in all_of) and time.monotonic() < end + NEVER_S:
        for attacker in all_of:
            attacker.step()
        time.sleep(0.001)  # else it takes the processor that the others want
    print(json.dumps({f"{a.kind}-{i}": a.n_sent for i, a in enumerate(all_of)}), flush=True)


# ---- what is told ----

def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))] if values else None


def slope(points):
    """Of a straight line through (x, y), with its standard error."""
    n = len(points)
    if n < 3:
        return None, None
    mx, my = (sum(p[k] for p in points) / n for k in (0, 1))
    sxx = sum((x - mx) ** 2 for x, _ in points)
    b = sum((x - mx) * (y - my) for x, y in points) / sxx
    rest = sum((y - my - b * (x - mx)) ** 2 for x, y in points)
    return b, math.sqrt(rest / (n - 2) / sxx)


def run_attackers(daemon, o):
    if not daemon or not o.attackers:
        return None
    return subprocess.Popen([sys.executable, os.path.abspath(__file__), "--attack", str(daemon.port), daemon.token,
                             "--attackers", str(o.attackers), "--attacks", o.attacks, "--seconds", str(o.interval)],
                            stdout=subprocess.PIPE, text=True, preexec_fn=lambda: os.nice(5))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=1800)
    parser.add_argument("--interval", type=float, default=30)
    parser.add_argument("--warm", type=float, default=300, help="not counted in the slope: those cut off are kept so long")
    parser.add_argument("--clients", type=int, default=50)
    parser.add_argument("--attackers", type=int, default=10)
    parser.add_argument("--attacks", default=",".join(ATTACKS), help="what attackers do, in turn; default: %(default)s")
    parser.add_argument("--edits", type=float, default=2, help="a second, of all clients: the views of all show each")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--elsewhere", action="store_true", help="in quiet intervals another daemon is attacked")
    parser.add_argument("--attack", nargs=2, metavar=("PORT", "TOKEN"), help=argparse.SUPPRESS)
    o = parser.parse_args()
    if o.attack:
        attack(int(o.attack[0]), o.attack[1], o.attacks.split(","), o.attackers, o.seconds)
        return 0
    took, means, sent = {"quiet": [], "attacked": []}, [], {}
    begin = time.monotonic()
    with Daemon() as daemon, (Daemon() if o.elsewhere else contextlib.nullcontext()) as other:
        crowd = Crowd(daemon, o.clients, o.seed, o.edits)
        while time.monotonic() - begin < o.seconds:
            pair = []
            for kind in took:
                attackers = run_attackers(daemon if kind == "attacked" else other, o)
                edits, memory = crowd.interval(o.interval)
                took[kind] += [seconds for at, seconds in edits if at >= SETTLE_S]
                pair += memory
                if attackers:
                    told = json.loads(attackers.communicate()[0])
                    for name in told if kind == "attacked" else ():
                        sent[name] = sent.get(name, 0) + told[name]
            now = time.monotonic() - begin
            means.append((now, sum(pair) / len(pair)))
            print(f"{now:.0f} s: p95 " + ", ".join(f"{k} {percentile(v, .95):.3f} s" for k, v in took.items() if v) +
                  f", memory {means[-1][1] / 1e6:.1f} MB", file=sys.stderr, flush=True)
        daemon.assert_well()
    b, error = slope([p for p in means if p[0] >= o.warm])
    print(json.dumps({
        "clients": o.clients, "came": crowd.n_came, "edits": crowd.n_edits, "seed": o.seed,
        **{f"{kind}_ms": {"n": len(v), **{f"p{p}": percentile(v, p / 100) and round(1e3 * percentile(v, p / 100), 1)
                                          for p in (50, 95, 99)}} for kind, v in took.items()},
        "memory_bytes": [round(y) for _, y in means], "slope_bytes_per_s": b, "slope_standard_error": error, "sent": sent}))
    return 0 if all(sent.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
