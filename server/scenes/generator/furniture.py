"""Furniture that several scenes share."""
import math

from .mesh import Mesh, cup, cushion, tube
from .scene import Frame


def swivel_chair(s, name, at, turn, cloth, fine=1):
    """A meeting chair on castors in cloth, steel and black plastic, its sitter looking along -z. fine multiplies the number
    of triangles, about 1 900, by its square; one fineness a scene."""
    f = Frame(s, name, at, turn)
    s.geometry("swivel-seat", lambda: cushion((0.52, 0.11, 0.50), 0.55, 0.5, 28 * fine, 8 * fine))
    s.geometry("swivel-back", lambda: curved_back(fine))
    s.geometry("swivel-arm", lambda: chair_arm(fine))
    s.geometry("swivel-spoke", lambda: chair_spoke(fine))
    s.mesh("castor", "torus", [0.055, 0.034, 0.055], segments=[9 * fine, 4 * fine], param=[0.45, 0, 0, 0])
    s.mesh("gas-lift", "cylinder", [0.055, 0.30, 0.055], segments=[16 * fine, 1])
    s.mesh("swivel-hub", "cylinder", [0.09, 0.06, 0.09], segments=[16 * fine, 1])
    f.object("seat", "swivel-seat", cloth, (0, 0.47, 0))
    f.object("back", "swivel-back", cloth, (0, 0.60, 0.23), (10, 0, 0))
    f.box("spine", [0.06, 0.26, 0.018], "black", (0, 0.53, 0.285), (14, 0, 0))
    f.box("plate", [0.30, 0.02, 0.34], "black", (0, 0.41, 0.04))
    f.object("lift", "gas-lift", "steel", (0, 0.265, 0))
    f.object("hub", "swivel-hub", "steel", (0, 0.105, 0))
    for side, x in (("l", -0.275), ("r", 0.275)):
        f.object(f"arm-{side}", "swivel-arm", "black", (x, 0, 0))
    for k in range(5):
        a = 72 * k + 18
        c, d = math.cos(math.radians(a)), -math.sin(math.radians(a))
        f.object(f"spoke-{k}", "swivel-spoke", "steel", (0, 0.10, 0), (0, a, 0))
        f.object(f"castor-{k}", "castor", "black", (0.30 * c, 0.0275, 0.30 * d), (90, a, 0))


def curved_back(fine):
    """A cushion bent around the sitter and leaning back at the top; y = 0 is its foot."""
    height = 0.50
    mesh = cushion((0.46, height, 0.07), 0.5, 0.35, 22 * fine, 12 * fine)
    p = mesh.positions
    for i in range(0, len(p), 3):
        p[i + 2] += 0.25 * p[i + 1] ** 2 - 0.9 * p[i] * p[i] + 0.05
        p[i + 1] += height / 2
    return mesh


def chair_arm(fine):
    """A hoop from the seat up and back down, and a pad on it."""
    steps = 4 * fine
    arc = [math.radians(90 * k / steps) for k in range(steps + 1)]
    path = [(0, 0.43, -0.14)] + [(0, 0.60 + 0.06 * math.sin(a), -0.08 - 0.06 * math.cos(a)) for a in arc]
    path += [(0, 0.60 + 0.06 * math.cos(a), 0.10 + 0.06 * math.sin(a)) for a in arc] + [(0, 0.43, 0.16)]
    mesh = tube(path, 0.026, (1, 0, 0), 5 * fine)
    return mesh.add(cushion((0.055, 0.03, 0.27), 0.5, 0.6, 12 * fine, 5 * fine), (0, 0.672, 0.01))


def chair_spoke(fine):
    """Along +x, thinner and lower at its end."""
    rows, sides = [], 6 * fine
    for k in range(3 * fine + 1):
        t = k / (3 * fine)
        x, y, w, h = 0.03 + 0.275 * t, -0.030 * t * t, 0.026 - 0.010 * t, 0.022 - 0.009 * t
        rows.append([(x, y + h * math.sin(a), w * math.cos(a)) for a in (2 * math.pi * j / sides for j in range(sides + 1))])
    return Mesh().grid(rows)


def mug(s, name, at, turn, material):
    f = Frame(s, name, at, turn)
    s.geometry("mug-mesh", lambda: cup(0.042, 0.095, 0.005, 32, 0.92))
    s.mesh("mug-ear-mesh", "torus", [0.064, 0.011, 0.070], segments=[20, 8], param=[0.2, 0, 0, 0])
    f.object("body", "mug-mesh", material)
    f.object("ear", "mug-ear-mesh", material, (0.052, 0.05, 0), (90, 0, 0))


def book(s, name, size, at, cover, paper="paper", turn=(0, 0, 0)):
    """Lying: width x thickness x height of the page along x, y, z. The spine is at -x."""
    w, t, h = size
    f = Frame(s, name, at, turn[1])
    f.box("pages", [w - 0.006, t - 0.006, h - 0.008], paper, (0.001, 0, 0))
    f.box("front", [w, 0.003, h], cover, (0, t / 2 - 0.0015, 0))
    f.box("cover", [w, 0.003, h], cover, (0, -t / 2 + 0.0015, 0))
    f.box("spine", [0.003, t, h], cover, (-w / 2 + 0.0015, 0, 0))


def standing_book(s, name, size, at, cover, paper="paper"):
    """On a shelf along x, its spine to +z: thickness x height x depth; at: the middle of its foot."""
    t, h, d = size
    f = Frame(s, name, at)
    f.box("pages", [t - 0.006, h - 0.008, d - 0.006], paper, (0, h / 2, -0.001))
    f.box("front", [0.003, h, d], cover, (t / 2 - 0.0015, h / 2, 0))
    f.box("cover", [0.003, h, d], cover, (-t / 2 + 0.0015, h / 2, 0))
    f.box("spine", [t, h, 0.003], cover, (0, h / 2, d / 2 - 0.0015))


def leaf_mesh(length, width, droop, steps=8):
    """A blade along +x, pointed at both ends, folded along its middle and hanging down; both sides are its front."""
    def at(u, v):
        w = width * math.sin(math.pi * u ** 0.8) * (v - 0.5)
        return (length * u, length * (0.45 * u - droop * u * u) + 0.5 * abs(w), -w)
    return Mesh().patch(at, steps, 4)


def plant(s, name, at, leaves, size=1.0, material="leaf", pot="pot"):
    """A pot with leaves on a spiral."""
    f = Frame(s, name, at)
    s.geometry("pot-mesh", lambda: cup(0.17, 0.30, 0.02, 32, 0.72))
    s.geometry("leaf-mesh", lambda: leaf_mesh(0.62, 0.13, 0.75))
    s.mesh("soil-mesh", "disc", [0.30, 0, 0.30], segments=[32, 1])
    f.object("pot", "pot-mesh", pot, scale=(size,) * 3)
    f.object("soil", "soil-mesh", "soil", (0, 0.27 * size, 0), scale=(size, 1, size))
    for k in range(leaves):
        up = k / max(leaves - 1, 1)
        f.object(f"leaf-{k:02d}", "leaf-mesh", material, (0, (0.26 + 0.42 * up) * size, 0),
                 (0, 137.508 * k, 12 + 34 * up), (size * (1.05 - 0.3 * up),) * 3)
