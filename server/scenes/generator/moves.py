"""The animations of the thesis (6.3.2) as replays: 100 poses, 30 a second. The first is due at 0 ms, with what the replay
brings along."""
import json
import math

from . import bunnies as bunny_places
from .desk import desk_scene
from .scene import Scene, rounded

FRAMES, FPS = 100, 30


class Replay(Scene):
    def __init__(self, scene, title):
        super().__init__("replay", title=title, scene=scene)
        self.t_ms = 0

    def frames(self):
        """Progress 0..1 of each frame. t_ms rounds down: a pose is never later than the frame it is for."""
        for i in range(FRAMES):
            self.t_ms = math.floor(i * 1e6 / FPS) / 1000
            yield i / FRAMES

    def op(self, op, **fields):
        self.lines.append(json.dumps({"t_ms": self.t_ms, "op": op, **fields}))

    def move(self, id, at):
        self.op("set", id=id, path="/transform/translate", value=rounded(at, 4))


def there_and_back(t):
    """0 at t = 0, 1 in the middle, 0 again at 1; smooth."""
    return (1 - math.cos(2 * math.pi * t)) / 2


def hop(t):
    """A ball that bounces at whole numbers, 1 high."""
    t -= math.floor(t)
    return 4 * t * (1 - t)


def smooth(t):
    t = min(max(t, 0), 1)
    return t * t * (3 - 2 * t)


def cornell():
    """The short statue takes off, flies once around the tall one, and lands."""
    s = Replay("cornell", "The terracotta statue flies around the marble one")
    (cx, cz), (x, y, z) = (-0.8, -0.75), (0.85, 1.069, 0.45)  # the tall one; where the short one stands
    start, far, near = math.atan2(z - cz, x - cx), math.hypot(x - cx, z - cz), 0.83
    for t in s.frames():
        away = smooth(t / 0.2) if t < 0.5 else smooth((1 - t) / 0.2)
        up = smooth(t / 0.1) if t < 0.5 else smooth((1 - t) / 0.1)
        angle = start - 2 * math.pi * smooth((t - 0.1) / 0.8)
        r = far + (near - far) * away
        s.move("short-statue", (cx + r * math.cos(angle), y + 0.55 * up, cz + r * math.sin(angle)))
    return s


def wobble():
    s = Replay("wobble", "A sine wave runs twice down the column")
    for t in s.frames():
        s.op("set", id="column-mesh", path="/param/2", value=round(2 * t % 1, 4))
    return s


def desk():
    """All parts of the chair, by the same way."""
    s = Replay("desk", "The chair rolls over the rug and back")
    chair = [op for op in map(json.loads, desk_scene().lines[1:]) if op["op"] == "add" and op["id"].startswith("chair-")]
    for t in s.frames():
        dx, dz = -1.35 * there_and_back(t), 0.45 * there_and_back(t)
        for part in chair:
            x, y, z = part["transform"]["translate"]
            s.move(part["id"], (x + dx, y, z + dz))
    return s


def bunnies(n):
    s = Replay(f"bunnies-{n}", "The bunny bounces" if n == 1 else f"{n} bunnies bounce")
    for t in s.frames():
        for k in range(n):
            # each in its own time: 4 to 6 bounces, begun at its own height
            s.move(f"bunny-{k + 1}", bunny_places.place(n, k, (0.9 + 0.1 * (k % 3)) * hop((4 + k % 3) * t + 0.37 * k)))
    return s


def conference():
    """A bunny that the replay brings hops along the table."""
    s = Replay("conference", "A green bunny crosses the table")
    height, top = 0.42, 0.7462
    for t in s.frames():
        at = rounded((2.3 - 4.6 * t, top + height / 2 + 0.15 * hop(10 * t), -0.30), 4)
        if t == 0:
            s.material("bunny-green", [0.16, 0.50, 0.12])
            s.mesh("bunny-mesh", "bunny", [0.495 * height, height, 0.805 * height])
            s.object("bunny", "bunny-mesh", "bunny-green", at, (0, -90, 0))
        else:
            s.move("bunny", at)
    return s


def sibenik():
    """A box that the replay brings glides down the nave and back."""
    s = Replay("sibenik", "A yellow box glides through the nave")
    size = [1.0, 1.5, 1.0]
    for t in s.frames():
        at = rounded((-7.5 + 6.0 * there_and_back(t), 1.05 + size[1] / 2, 1.2 * math.sin(2 * math.pi * t)), 4)
        if t == 0:
            s.material("yellow", [0.80, 0.62, 0.06])
            s.mesh("yellow-box-mesh", "box", size)
            s.object("yellow-box", "yellow-box-mesh", "yellow", at)
        else:
            s.move("yellow-box", at)
    return s
