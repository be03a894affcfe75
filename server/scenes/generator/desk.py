"""A study: a desk by the window, with a lamp."""
import math

from .furniture import book, mug, plant, standing_book, swivel_chair
from .mesh import Mesh, cup
from .scene import Frame, Random, Scene, rounded


def materials(s):
    s.material("wall-paint", [0.55, 0.60, 0.57])
    s.material("ceiling-paint", [0.80, 0.79, 0.76])
    s.material("trim", [0.80, 0.79, 0.75], roughness=0.6, specular=0.6)
    s.material("oak", [0.50, 0.31, 0.16], roughness=0.42, specular=1.0)
    s.material("oak-dark", [0.36, 0.21, 0.11], roughness=0.5, specular=0.8)
    for name, color in (("a", [0.40, 0.25, 0.14]), ("b", [0.45, 0.29, 0.17]), ("c", [0.36, 0.22, 0.12])):
        s.material(f"plank-{name}", color, roughness=0.5, specular=0.7)
    s.material("brass", [0.80, 0.60, 0.28], roughness=0.3, metallic=1.0, specular=1.0)
    s.material("steel", [0.58, 0.58, 0.59], roughness=0.35, metallic=1.0, specular=1.0)
    s.material("black", [0.035, 0.035, 0.04], roughness=0.45, specular=1.0)
    s.material("dark-glass", [0.012, 0.013, 0.016], roughness=0.08, specular=1.0)
    s.material("key", [0.16, 0.16, 0.17], roughness=0.7, specular=0.5)
    s.material("lamp-green", [0.05, 0.22, 0.14], roughness=0.25, specular=1.0)
    s.material("lamp-white", [0.85, 0.84, 0.80])
    s.material("cloth", [0.42, 0.13, 0.09])
    s.material("wool", [0.55, 0.47, 0.36])
    s.material("wool-border", [0.28, 0.12, 0.10])
    s.material("ceramic", [0.80, 0.78, 0.72], roughness=0.2, specular=1.0)
    s.material("paper", [0.80, 0.78, 0.72])
    s.material("ocean", [0.14, 0.30, 0.42], roughness=0.35, specular=1.0)
    s.material("leaf", [0.10, 0.27, 0.08], roughness=0.5, specular=0.6)
    s.material("pot", [0.52, 0.27, 0.16])
    s.material("soil", [0.07, 0.05, 0.04])
    for name, color in (("red", [0.48, 0.08, 0.06]), ("blue", [0.08, 0.16, 0.36]), ("ochre", [0.62, 0.40, 0.10]),
                        ("green", [0.10, 0.26, 0.16]), ("grey", [0.30, 0.30, 0.32])):
        s.material(f"cover-{name}", color, roughness=0.6, specular=0.6)


ROOM = {"x": 2.1, "z0": -1.8, "z1": 2.2, "y": 2.7}
WINDOW = {"z0": -1.05, "z1": 0.55, "y0": 0.95, "y1": 2.30}  # in the left wall


def room(s):
    x, z0, z1, y, t = ROOM["x"], ROOM["z0"], ROOM["z1"], ROOM["y"], 0.2
    s.block("subfloor", (-x - t, -0.2, z0 - t), (x + t, -0.02, z1 + t), "oak-dark")
    random = Random(5)
    width, n = 0.14, 30
    for k in range(n):
        lo = -x + k * width
        s.block(f"plank-{k:02d}", (lo, -0.02, z0), (min(lo + width, x), 0, z1), "plank-" + "abc"[random.whole(3)])
    s.block("ceiling", (-x - t, y, z0 - t), (x + t, y + t, z1 + t), "ceiling-paint")
    s.block("wall-back", (-x - t, -0.2, z0 - t), (x + t, y, z0), "wall-paint")
    s.block("wall-front", (-x - t, -0.2, z1), (x + t, y, z1 + t), "wall-paint")
    s.block("wall-right", (x, -0.2, z0), (x + t, y, z1), "wall-paint")
    w = WINDOW
    s.block("wall-below-window", (-x - t, -0.2, z0), (-x, w["y0"], z1), "wall-paint")
    s.block("wall-above-window", (-x - t, w["y1"], z0), (-x, y, z1), "wall-paint")
    s.block("wall-behind-window", (-x - t, w["y0"], z0), (-x, w["y1"], w["z0"]), "wall-paint")
    s.block("wall-before-window", (-x - t, w["y0"], w["z1"]), (-x, w["y1"], z1), "wall-paint")
    s.block("skirting-back", (-x, 0, z0), (x, 0.09, z0 + 0.015), "trim")
    s.block("skirting-left", (-x, 0, z0), (-x + 0.015, 0.09, z1), "trim")
    s.block("skirting-right", (x - 0.015, 0, z0), (x, 0.09, z1), "trim")


def window(s):
    """Frame, bars, glass and sill; the sky behind it is one light that fills the opening."""
    x, w = ROOM["x"], WINDOW
    zm, ym = (w["z0"] + w["z1"]) / 2, (w["y0"] + w["y1"]) / 2
    lz, ly = w["z1"] - w["z0"], w["y1"] - w["y0"]
    at = -x - 0.10
    for name, z in (("back", w["z0"] + 0.03), ("front", w["z1"] - 0.03), ("middle", zm)):
        s.box(f"window-stile-{name}", [0.05, ly, 0.06 if name != "middle" else 0.07], "trim", (at, ym, z))
    for name, yy in (("low", w["y0"] + 0.03), ("high", w["y1"] - 0.03)):
        s.box(f"window-rail-{name}", [0.05, 0.06, lz], "trim", (at, yy, zm))
    s.box("window-bar", [0.03, 0.03, lz], "trim", (at, w["y0"] + 0.62 * ly, zm))
    for name, z in (("back", (w["z0"] + 0.06, zm - 0.035)), ("front", (zm + 0.035, w["z1"] - 0.06))):
        s.pane(f"window-pane-{name}", z, (w["y0"] + 0.06, w["y1"] - 0.06), at)
    s.box("window-sill", [0.34, 0.03, lz + 0.16], "trim", (-x - 0.04, w["y0"] - 0.015, zm))
    s.add("light", "window", kind="quad", position=[-x - 0.19, ym, zm], u=[0, ly, 0], v=[0, 0, lz], luminance_cd_m2=1800,
          cct_k=6500, group="daylight")


def desk(s):
    f = Frame(s, "desk", (-0.35, 0, -1.36))
    f.box("top", [1.75, 0.04, 0.80], "oak", (0, 0.74, 0))
    f.box("panel", [0.04, 0.72, 0.72], "oak", (0.82, 0.36, 0))
    f.box("back", [1.28, 0.36, 0.02], "oak-dark", (0.17, 0.54, -0.33))
    f.box("pedestal", [0.42, 0.70, 0.70], "oak-dark", (-0.63, 0.37, -0.01))
    s.mesh("knob", "sphere", [0.03, 0.03, 0.03], segments=[10, 6])
    for k, (y, h) in enumerate(((0.61, 0.19), (0.40, 0.19), (0.165, 0.25))):
        f.box(f"drawer-{k}", [0.39, h, 0.02], "oak", (-0.63, y, 0.35))
        f.object(f"knob-{k}", "knob", "brass", (-0.63, y, 0.374))


def monitor(s):
    f = Frame(s, "monitor", (-0.32, 0.76, -1.52), 3)
    f.box("case", [0.62, 0.37, 0.025], "black", (0, 0.33, 0), (-5, 0, 0))
    f.box("glass", [0.60, 0.345, 0.004], "dark-glass", (0, 0.331, 0.0135), (-5, 0, 0))
    f.box("post", [0.07, 0.26, 0.02], "steel", (0, 0.14, -0.035), (-8, 0, 0))
    f.box("foot", [0.26, 0.012, 0.18], "steel", (0, 0.006, -0.02))


def keyboard(s):
    f = Frame(s, "keyboard", (-0.30, 0.76, -1.17), 2)
    f.box("case", [0.44, 0.014, 0.14], "black", (0, 0.009, 0), (3, 0, 0))
    for row in range(4):
        for k in range(13):
            f.box(f"key-{row}-{k:02d}", [0.027, 0.008, 0.024], "key",
                  (-0.198 + 0.033 * k, 0.020 - 0.0012 * row, -0.050 + 0.029 * row))
    f.box("space", [0.20, 0.008, 0.014], "key", (0, 0.0155, 0.059))
    s.mesh("mouse-mesh", "sphere", [0.062, 0.045, 0.105], segments=[16, 8])
    s.object("mouse", "mouse-mesh", "black", (0.06, 0.765, -1.15), (0, -8, 0))


def lamp(s):
    """A banker's arm lamp: a foot, two arms, and a shade with a disc of light in its mouth."""
    f = Frame(s, "lamp", (0.28, 0.76, -1.52))
    foot = [(0, 0), (0.095, 0), (0.095, 0.012), (0.085, 0.020), (0.03, 0.026), (0.018, 0.045), (0, 0.045)]
    outside = [(0.105, 0), (0.102, 0.03), (0.085, 0.075), (0.052, 0.105), (0.024, 0.12), (0.024, 0.16), (0, 0.165)]
    inside = [(0, 0.10), (0.048, 0.10), (0.080, 0.072), (0.099, 0.029), (0.105, 0)]
    s.geometry("lamp-foot-mesh", lambda: Mesh().lathe(foot, 28))
    s.geometry("lamp-shade-mesh", lambda: Mesh().lathe(outside, 28).lathe(inside, 28))
    s.mesh("joint", "sphere", [0.03, 0.03, 0.03], segments=[12, 6])
    f.object("foot", "lamp-foot-mesh", "lamp-green")
    elbow, head = (0.16, 0.36, -0.03), (-0.14, 0.55, 0.10)
    f.rod("arm-low", (0, 0.04, 0), elbow, 0.014, "brass")
    f.rod("arm-high", elbow, head, 0.014, "brass")
    f.object("elbow", "joint", "brass", elbow)
    f.object("head", "joint", "brass", head)
    f.object("shade", "lamp-shade-mesh", "lamp-green", (head[0] - 0.02, head[1] - 0.16, head[2] + 0.005))
    x, y, z = f.point((head[0] - 0.02, head[1] - 0.135, head[2] + 0.005))
    s.add("light", "desk-lamp", kind="disc", position=rounded((x, y, z), 4), direction=[0, -1, 0], radius=0.06, flux_lm=620,
          cct_k=2800, group="lamp")


def things_on_the_desk(s):
    top = 0.76
    mug(s, "mug", (0.17, top, -1.12), -35, "ceramic")
    book(s, "book-low", (0.21, 0.035, 0.28), (-1.0, top + 0.0175, -1.15), "cover-blue", turn=(0, 12, 0))
    book(s, "book-mid", (0.19, 0.028, 0.25), (-1.0, top + 0.049, -1.15), "cover-ochre", turn=(0, -4, 0))
    book(s, "book-high", (0.16, 0.022, 0.22), (-0.99, top + 0.074, -1.16), "cover-red", turn=(0, 24, 0))
    s.box("sheet-low", [0.21, 0.001, 0.297], "paper", (0.30, top + 0.001, -1.22), (0, -14, 0))
    s.box("sheet-high", [0.21, 0.001, 0.297], "paper", (0.33, top + 0.002, -1.20), (0, 6, 0))
    s.geometry("pencil-cup-mesh", lambda: cup(0.038, 0.10, 0.003, 24, 1.0))
    s.object("pencil-cup", "pencil-cup-mesh", "brass", (0.05, top, -1.60))
    f = Frame(s, "pencils", (0.05, top, -1.60))
    for k, material in enumerate(("cover-red", "cover-blue", "cover-ochre", "cover-green", "black")):
        a = 2 * math.pi * k / 5
        f.rod(str(k), (0.018 * math.cos(a), 0.006, 0.018 * math.sin(a)),
              (0.038 * math.cos(a + 0.5), 0.165 + 0.008 * k, 0.038 * math.sin(a + 0.5)), 0.007, material, 8)
    globe(s, (-1.02, top, -1.55))


def globe(s, at):
    f = Frame(s, "globe", at, 25)
    s.mesh("globe-ball-mesh", "sphere", [0.22, 0.22, 0.22], segments=[28, 14])
    s.mesh("globe-ring-mesh", "torus", [0.26, 0.010, 0.26], segments=[24, 6], param=[0.04, 0, 0, 0])
    foot = [(0, 0), (0.075, 0), (0.07, 0.012), (0.02, 0.022), (0.012, 0.055), (0, 0.055)]
    s.geometry("globe-foot-mesh", lambda: Mesh().lathe(foot, 32))
    f.object("foot", "globe-foot-mesh", "oak-dark")
    f.object("ball", "globe-ball-mesh", "ocean", (0, 0.18, 0))
    f.object("ring", "globe-ring-mesh", "brass", (0, 0.18, 0), (90, 0, 23))


def shelf(s):
    """On the right of the back wall, two boards of books."""
    random = Random(11)
    for row, y in enumerate((1.45, 1.85)):
        s.block(f"shelf-{row}", (0.75, y, -1.8), (1.95, y + 0.025, -1.58), "oak")
        for side in (0.85, 1.85):
            s.box(f"bracket-{row}-{'l' if side < 1 else 'r'}", [0.02, 0.10, 0.16], "black", (side, y - 0.05, -1.72))
        x, k = 0.82, 0
        while x < (1.55 if row else 1.75):
            t, h = random.between(0.022, 0.05), random.between(0.19, 0.29)
            cover = "cover-" + ("red", "blue", "ochre", "green", "grey")[random.whole(5)]
            standing_book(s, f"book-{row}-{k:02d}", (t, h, random.between(0.14, 0.19)), (x + t / 2, y + 0.025, -1.69), cover)
            x += t + 0.002
            k += 1
    vase = [(0, 0), (0.05, 0), (0.075, 0.05), (0.08, 0.09), (0.055, 0.15), (0.025, 0.19), (0.028, 0.22), (0.033, 0.225),
            (0.022, 0.20), (0, 0.19)]
    s.geometry("vase-mesh", lambda: Mesh().lathe(vase, 24))
    s.object("vase", "vase-mesh", "ceramic", (1.76, 1.875, -1.69))


def pictures(s):
    for name, x, y, w, h, inner in (("large", -0.42, 1.78, 0.70, 0.50, "cover-grey"),
                                    ("small", 0.32, 1.72, 0.30, 0.38, "cover-ochre")):
        s.box(f"picture-{name}-frame", [w, h, 0.025], "oak-dark", (x, y, -1.787))
        s.box(f"picture-{name}-mount", [w - 0.05, h - 0.05, 0.004], "paper", (x, y, -1.774))
        s.box(f"picture-{name}-sky", [w - 0.18, (h - 0.18) * 0.6, 0.002], "ocean", (x, y + (h - 0.18) * 0.2, -1.772))
        s.box(f"picture-{name}-land", [w - 0.18, (h - 0.18) * 0.4, 0.002], inner, (x, y - (h - 0.18) * 0.3, -1.772))


def desk_scene():
    s = Scene(title="A study: desk, lamp and window")
    materials(s)
    room(s)
    window(s)
    desk(s)
    monitor(s)
    keyboard(s)
    lamp(s)
    things_on_the_desk(s)
    shelf(s)
    pictures(s)
    s.box("rug-border", [2.1, 0.008, 1.5], "wool-border", (-0.1, 0.004, -0.15))
    s.box("rug", [1.9, 0.010, 1.3], "wool", (-0.1, 0.005, -0.15))
    swivel_chair(s, "chair", (0.62, 0.01, -0.38), -38, "cloth")
    plant(s, "plant", (1.66, 0, -1.40), 14, 1.1)
    s.geometry("basket-mesh", lambda: cup(0.15, 0.30, 0.006, 28, 0.8))
    s.object("basket", "basket-mesh", "steel", (0.86, 0, -1.45))
    s.camera("main", [1.40, 1.66, 1.85], [0.02, 0.93, -1.15], 47)
    return s
