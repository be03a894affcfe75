"""A meeting room: a long table, many chairs, light from panels in the ceiling."""

from .furniture import mug, plant, swivel_chair
from .mesh import Mesh, cup
from .scene import Frame, Scene

WIDTH, HEIGHT, DEPTH = 11.0, 2.9, 7.2  # x, y, z
TOP = 0.745  # of the table


def materials(s):
    s.material("plaster", [0.72, 0.70, 0.65])
    s.material("ceiling-tile", [0.80, 0.79, 0.76])
    s.material("grid", [0.62, 0.62, 0.60])
    s.material("carpet", [0.16, 0.20, 0.27])
    s.material("walnut", [0.27, 0.145, 0.075], roughness=0.38, specular=1.0)
    s.material("walnut-light", [0.40, 0.24, 0.13], roughness=0.5, specular=0.8)
    s.material("inlay", [0.05, 0.035, 0.03], roughness=0.3, specular=1.0)
    s.material("leather", [0.075, 0.045, 0.035], roughness=0.5, specular=0.8)
    s.material("cloth", [0.36, 0.10, 0.075])
    s.material("steel", [0.60, 0.60, 0.61], roughness=0.3, metallic=1.0, specular=1.0)
    s.material("brass", [0.78, 0.58, 0.27], roughness=0.3, metallic=1.0, specular=1.0)
    s.material("black", [0.035, 0.035, 0.04], roughness=0.5, specular=1.0)
    s.material("whiteboard", [0.84, 0.85, 0.86], roughness=0.25, specular=1.0)
    s.material("marker", [0.06, 0.12, 0.42])
    s.material("paper", [0.82, 0.80, 0.75])
    s.material("ceramic", [0.80, 0.79, 0.75], roughness=0.2, specular=1.0)
    s.material("glass", [0.95, 0.97, 0.97], roughness=0.0, specular=1.0, transmission=1.0, thin=True)
    s.material("shade", [0.55, 0.53, 0.48])
    s.material("leaf", [0.09, 0.25, 0.08], roughness=0.5, specular=0.6)
    s.material("pot", [0.20, 0.20, 0.21], roughness=0.5, specular=0.6)
    s.material("soil", [0.07, 0.05, 0.04])
    s.material("canvas", [0.70, 0.66, 0.56])
    for name, color in (("rust", [0.52, 0.20, 0.08]), ("sea", [0.10, 0.28, 0.36]), ("sand", [0.66, 0.48, 0.22])):
        s.material(f"paint-{name}", color)


def room(s):
    x, y, z, t = WIDTH / 2, HEIGHT, DEPTH / 2, 0.2
    s.block("floor", (-x - t, -t, -z - t), (x + t, 0, z + t), "carpet")
    s.block("ceiling", (-x - t, y + 0.08, -z - t), (x + t, y + t, z + t), "ceiling-tile")
    s.block("wall-back", (-x - t, 0, -z - t), (x + t, y + 0.1, -z), "plaster")
    s.block("wall-front", (-x - t, 0, z), (x + t, y + 0.1, z + t), "plaster")
    s.block("wall-left", (-x - t, 0, -z), (-x, y + 0.1, z), "plaster")
    s.block("wall-right", (x, 0, -z), (x + t, y + 0.1, z), "plaster")
    # a wainscot of panels, and the rail above it
    for k in range(11):
        s.box(f"panel-back-{k:02d}", [0.96, 0.86, 0.03], "walnut-light", (-x + 0.5 + k, 0.53, -z + 0.015))
    for k in range(7):
        s.box(f"panel-left-{k}", [0.03, 0.86, 0.98], "walnut-light", (-x + 0.015, 0.53, -z + 0.56 + 1.013 * k))
    for name, size, at in (("back", [WIDTH, 0.05, 0.05], (0, 0.985, -z + 0.025)),
                           ("left", [0.05, 0.05, DEPTH], (-x + 0.025, 0.985, 0))):
        s.box(f"rail-{name}", size, "walnut", at)
        s.box(f"skirting-{name}", [size[0], 0.10, size[2]], "walnut", (at[0], 0.05, at[2]))


LAMPS = [(x, z) for x in (-3.6, -1.2, 1.2, 3.6) for z in (-1.5, 1.5)]


def ceiling(s):
    """A grid of 0.6 m tiles; eight of them, two long, are light."""
    x, z, y = WIDTH / 2, DEPTH / 2, HEIGHT
    columns, rows = int(WIDTH / 0.6), int(DEPTH / 0.6)
    for i in range(columns + 1):
        s.box(f"bar-x-{i:02d}", [0.02, 0.03, DEPTH], "grid", ((i - columns / 2) * 0.6, y + 0.02, 0))
    for k in range(rows + 1):
        s.box(f"bar-z-{k:02d}", [WIDTH, 0.03, 0.02], "grid", (0, y + 0.0195, (k - rows / 2) * 0.6))
    s.block("tiles", (-x, y + 0.02, -z), (x, y + 0.08, z), "ceiling-tile")
    for k, (lx, lz) in enumerate(LAMPS):
        s.box(f"lamp-{k}-frame", [1.26, 0.05, 0.66], "grid", (lx, y, lz))
        s.add("light", f"lamp-{k}", kind="quad", position=[lx, y - 0.027, lz], u=[1.2, 0, 0], v=[0, 0, 0.6], flux_lm=4200,
              cct_k=4000, group="front" if lx > 0 else "back")


def boat(length, width, bulge, n=48):
    """A table's outline: straight ends, long sides that bend out. Counter-clockwise from above."""
    side = [(length * (0.5 - k / n), -(width / 2 + bulge * (1 - (2 * k / n - 1) ** 2))) for k in range(n + 1)]
    return side + [(-x, -z) for x, z in side]


def table(s):
    s.geometry("table-top", lambda: Mesh().prism(boat(6.6, 1.25, 0.32), -0.035, 0))
    s.geometry("table-inlay", lambda: Mesh().prism(boat(6.0, 0.75, 0.26), -0.001, 0.0006))
    s.geometry("table-field", lambda: Mesh().prism(boat(5.96, 0.71, 0.26), -0.001, 0.0012))
    s.object("table-top-board", "table-top", "walnut", (0, TOP, 0))
    s.object("table-inlay-line", "table-inlay", "inlay", (0, TOP, 0))
    s.object("table-inlay-field", "table-field", "walnut", (0, TOP, 0))
    s.geometry("apron", lambda: Mesh().prism(boat(5.9, 0.8, 0.26), 0, 0.09))
    s.object("table-apron", "apron", "walnut-light", (0, TOP - 0.125, 0))
    for k, x in enumerate((-1.9, 1.9)):
        s.box(f"pedestal-{k}", [0.9, 0.58, 0.12], "walnut-light", (x, 0.33, 0))
        s.box(f"pedestal-{k}-cross", [0.12, 0.58, 0.7], "walnut-light", (x, 0.33, 0))
        s.box(f"pedestal-{k}-foot", [1.1, 0.04, 0.9], "walnut", (x, 0.025, 0))


def chairs(s):
    """Nine on each long side, one at each end, two along the wall: 22."""
    for side, name in ((1, "front"), (-1, "back")):
        for k in range(9):
            x = -2.88 + 0.72 * k
            edge = 0.625 + 0.32 * (1 - (x / 3.3) ** 2)
            turn = ((k * 5 + (3 if side > 0 else 0)) % 7 - 3) * 3 + (0 if side > 0 else 180)
            swivel_chair(s, f"chair-{name}-{k}", (x, 0, side * (edge + 0.26 + 0.02 * (k % 3))), turn, "cloth", 2)
    swivel_chair(s, "chair-head", (-3.75, 0, 0), -90, "leather", 2)
    swivel_chair(s, "chair-foot", (3.85, 0, 0.1), 104, "leather", 2)
    for k, z in enumerate((-2.3, 2.1)):
        swivel_chair(s, f"chair-wall-{k}", (-4.95, 0, z), -94 + 9 * k, "cloth", 2)


def things_on_the_table(s):
    s.geometry("tumbler", lambda: cup(0.034, 0.10, 0.004, 40, 0.85))
    n = 0
    for side in (1, -1):
        for k in range(9):
            x = -2.88 + 0.72 * k
            z = side * (0.625 + 0.32 * (1 - (x / 3.3) ** 2) - 0.22)
            if (k + (side > 0)) % 2:
                s.box(f"pad-{n:02d}", [0.21, 0.008, 0.297], "paper", (x, TOP + 0.0045, z), (0, 9 * (k % 5) - 18, 0))
                pen = Frame(s, f"pen-{n:02d}", (x, TOP, z), 40 * k)
                pen.rod("body", (-0.07, 0.0125, 0.02), (0.07, 0.0125, 0.02), 0.009, "black", 12)
            elif (k * 2 + side) % 3:
                s.object(f"tumbler-{n:02d}", "tumbler", "glass", (x + 0.12, TOP, z))
            else:
                mug(s, f"mug-{n:02d}", (x + 0.1, TOP, z), 50 * k, "ceramic")
            n += 1
    profile = [(0, 0), (0.065, 0), (0.07, 0.01), (0.07, 0.15), (0.05, 0.20), (0.036, 0.215), (0.036, 0.25), (0.028, 0.262),
               (0, 0.265)]
    s.geometry("flask", lambda: Mesh().lathe(profile, 48))
    for k, x in enumerate((-1.5, 1.3)):
        s.object(f"flask-{k}", "flask", "steel", (x, TOP, 0.08))
    bowl = [(0, 0), (0.07, 0), (0.07, 0.012), (0.14, 0.05), (0.17, 0.09), (0.165, 0.092), (0.13, 0.055), (0.06, 0.02),
            (0, 0.018)]
    s.geometry("bowl", lambda: Mesh().lathe(bowl, 48))
    s.object("fruit-bowl", "bowl", "brass", (-0.1, TOP, 0))
    s.mesh("fruit", "sphere", [0.08, 0.075, 0.08], segments=[24, 12])
    fruit = ((0.05, 0.07, 0.02, "rust"), (-0.04, 0.07, 0.05, "sand"), (-0.03, 0.07, -0.05, "rust"), (0.0, 0.125, 0.01, "sand"))
    for k, (x, y, z, paint) in enumerate(fruit):
        s.object(f"fruit-{k}", "fruit", f"paint-{paint}", (-0.1 + x, TOP + y, z))


def back_wall(s):
    """A whiteboard, two paintings, and a door."""
    z = -DEPTH / 2
    s.box("whiteboard-frame", [3.3, 1.35, 0.04], "steel", (0.4, 1.75, z + 0.02))
    s.box("whiteboard-face", [3.2, 1.25, 0.004], "whiteboard", (0.4, 1.75, z + 0.041))
    s.box("whiteboard-tray", [3.2, 0.02, 0.09], "steel", (0.4, 1.07, z + 0.07))
    for k, h in enumerate((0.22, 0.35, 0.30, 0.52, 0.66)):  # a chart
        s.box(f"chart-bar-{k}", [0.12, h, 0.002], "marker", (-0.7 + 0.22 * k, 1.35 + h / 2, z + 0.044))
    s.box("chart-axis-x", [1.25, 0.012, 0.002], "black", (-0.25, 1.344, z + 0.044))
    s.box("chart-axis-y", [0.012, 0.80, 0.002], "black", (-0.87, 1.744, z + 0.044))
    for k in range(6):
        s.box(f"note-line-{k}", [0.5 + 0.17 * ((k * 5) % 4), 0.014, 0.002], "black", (1.25, 2.15 - 0.13 * k, z + 0.044))
    for k, x in enumerate((-3.9, -2.5)):
        s.box(f"painting-{k}-frame", [1.0, 0.8, 0.04], "inlay", (x, 1.8, z + 0.02))
        s.box(f"painting-{k}-canvas", [0.92, 0.72, 0.004], "canvas", (x, 1.8, z + 0.042))
        s.box(f"painting-{k}-sea", [0.92, 0.26, 0.002], "paint-sea", (x, 1.57, z + 0.045))
        hill = "paint-rust" if k else "paint-sand"
        s.box(f"painting-{k}-hill", [0.55, 0.20, 0.002], hill, (x + 0.185 - 0.37 * k, 1.80, z + 0.045))
    s.box("door-frame", [1.06, 2.2, 0.07], "walnut", (4.2, 1.1, z + 0.035))
    s.box("door-leaf", [0.92, 2.08, 0.03], "walnut-light", (4.2, 1.04, z + 0.075))
    s.mesh("handle", "sphere", [0.06, 0.06, 0.06], segments=[24, 12])
    s.object("door-handle", "handle", "brass", (3.83, 1.02, z + 0.12))


def left_wall(s):
    """A screen that is rolled down, and a plant in each corner."""
    x = -WIDTH / 2
    s.box("screen-case", [0.12, 0.12, 2.9], "ceiling-tile", (x + 0.12, 2.72, 0))
    s.box("screen-cloth", [0.004, 1.55, 2.7], "whiteboard", (x + 0.12, 1.90, 0))
    s.box("screen-weight", [0.03, 0.04, 2.7], "black", (x + 0.12, 1.12, 0))
    plant(s, "plant-left", (x + 0.55, 0.004, -DEPTH / 2 + 0.6), 30, 1.5)
    plant(s, "plant-right", (WIDTH / 2 - 0.6, 0.004, -DEPTH / 2 + 0.65), 30, 1.5)


def conference():
    s = Scene(title="A meeting room with a long table")
    materials(s)
    room(s)
    ceiling(s)
    table(s)
    chairs(s)
    things_on_the_table(s)
    back_wall(s)
    left_wall(s)
    s.camera("main", [4.7, 2.05, 3.1], [-0.9, 0.78, -0.75], 52)
    return s
