"""An atrium with two storeys of arcades round an open court, in the sun."""
import math

from .arches import arch_panel, groin_vault, moulding
from .furniture import plant
from .mesh import Mesh, cup
from .scene import Frame, Random, Scene

BAY = 2.5
LONG, SHORT = 9, 3  # bays of the court along x and z
HX, HZ = LONG * BAY / 2, SHORT * BAY / 2  # half of the court, to the middle of its arcades
AISLE = 3.4  # depth of the galleries
UPPER = 5.3  # floor of the upper storey
EAVES, TOP = 10.4, 12.4
OUT_X, OUT_Z = HX + AISLE, HZ + AISLE

LOWER_ARCH = (1.02, 3.05, 1.02)  # half width, springing, rise
UPPER_ARCH = (0.98, 2.75, 0.98)


def materials(s):
    s.material("limestone", [0.66, 0.56, 0.43])
    s.material("limestone-dark", [0.50, 0.42, 0.32])
    s.material("plaster", [0.70, 0.62, 0.50])
    s.material("vault", [0.66, 0.63, 0.58])
    s.material("marble", [0.74, 0.71, 0.65], roughness=0.35, specular=0.8)
    for name, color in (("a", [0.46, 0.40, 0.33]), ("b", [0.40, 0.345, 0.28]), ("c", [0.51, 0.45, 0.37])):
        s.material(f"paving-{name}", color, roughness=0.7, specular=0.4)
    s.material("beam", [0.26, 0.16, 0.09], roughness=0.6, specular=0.5)
    s.material("bronze", [0.40, 0.28, 0.15], roughness=0.45, metallic=1.0, specular=1.0)
    s.material("roof-tile", [0.42, 0.19, 0.11])
    s.material("leaf", [0.10, 0.26, 0.07], roughness=0.5, specular=0.6)
    s.material("pot", [0.56, 0.29, 0.17])
    s.material("soil", [0.08, 0.06, 0.04])
    s.material("water", [0.05, 0.12, 0.13], roughness=0.05, specular=1.0)
    for name, color in (("red", [0.50, 0.035, 0.03]), ("blue", [0.035, 0.10, 0.36]), ("green", [0.04, 0.24, 0.09])):
        s.material(f"cloth-{name}", color)


def lower_column():
    return Mesh().lathe([(0.30, 0.18), (0.36, 0.20), (0.375, 0.25), (0.35, 0.30), (0.30, 0.33), (0.31, 0.38), (0.285, 0.42),
                         (0.27, 1.0), (0.262, 1.6), (0.235, 2.42), (0.26, 2.45), (0.26, 2.49), (0.24, 2.52), (0.26, 2.64),
                         (0.33, 2.78), (0.37, 2.84)], 18)


def upper_column():
    return Mesh().lathe([(0.15, 0.0), (0.20, 0.02), (0.20, 0.07), (0.16, 0.12), (0.15, 0.6), (0.125, 1.55), (0.145, 1.57),
                         (0.145, 1.60), (0.135, 1.62), (0.16, 1.72), (0.22, 1.84)], 16)


def baluster():
    return Mesh().lathe([(0.03, 0.0), (0.055, 0.16), (0.026, 0.36), (0.032, 0.46), (0.03, 0.52)], 6)


def meshes(s):
    s.geometry("lower-column", lower_column)
    s.geometry("upper-column", upper_column)
    s.geometry("baluster", baluster)
    for name, (half, spring, rise), height, depth in (("lower", LOWER_ARCH, UPPER - 0.35, 0.42),
                                                      ("upper", UPPER_ARCH, EAVES - UPPER, 0.36)):
        s.geometry(f"{name}-arch", lambda: arch_panel(BAY, height - spring, (half, 0, rise), depth, 14))
        s.geometry(f"{name}-archivolt", lambda: moulding(half, rise, archivolt(depth / 2), 14))
    s.geometry("gallery-vault", lambda: groin_vault(BAY, AISLE, 1.25, 10, 4))
    s.geometry("drape", drape)


def archivolt(face):
    """A band round an arch, standing out of the wall's face at that z; counter-clockwise in (outward, z)."""
    return [(0.02, face - 0.01), (0.20, face - 0.01), (0.20, face + 0.035), (0.13, face + 0.05), (0.02, face + 0.05)]


def bays():
    """(name, x, z, turn): the middle of each bay of the court's sides; turned so that +z of the bay looks into the court."""
    for k in range(LONG):
        x = (k - (LONG - 1) / 2) * BAY
        yield f"south-{k}", x, HZ, 180
        yield f"north-{k}", x, -HZ, 0
    for k in range(SHORT):
        z = (k - (SHORT - 1) / 2) * BAY
        yield f"west-{k}", -HX, z, 90
        yield f"east-{k}", HX, z, -90


def arcades(s):
    for name, x, z, turn in bays():
        low, high = Frame(s, f"arcade-{name}", (x, 0, z), turn), Frame(s, f"loggia-{name}", (x, UPPER, z), turn)
        low.object("arch", "lower-arch", "plaster", (0, LOWER_ARCH[1], 0))
        low.object("archivolt", "lower-archivolt", "limestone", (0, LOWER_ARCH[1], 0))
        low.object("vault", "gallery-vault", "vault", (0, LOWER_ARCH[1] + 0.35, -AISLE / 2))
        low.box("cornice", [BAY, 0.10, 0.60], "limestone", (0, UPPER - 0.30, 0))
        low.box("cornice-top", [BAY, 0.12, 0.74], "limestone", (0, UPPER - 0.19, 0))
        high.object("arch", "upper-arch", "plaster", (0, UPPER_ARCH[1], 0))
        high.object("archivolt", "upper-archivolt", "limestone", (0, UPPER_ARCH[1], 0))
        high.box("rail", [BAY - 0.4, 0.09, 0.26], "limestone", (0, 0.80, 0))
        high.box("plinth", [BAY - 0.4, 0.14, 0.26], "limestone", (0, 0.07, 0))
        for k in range(6):
            high.object(f"baluster-{k}", "baluster", "limestone", (-0.85 + 0.34 * k, 0.14, 0), scale=(1.5, 1.18, 1.5))
        high.box("beam", [0.16, 0.22, AISLE], "beam", (0, EAVES - UPPER - 0.15, -AISLE / 2))


def pillars(s):
    """One between two bays, square ones at the corners."""
    at = [((k - LONG / 2) * BAY, side * HZ) for k in range(1, LONG) for side in (1, -1)]
    at += [(side * HX, (k - SHORT / 2) * BAY) for k in range(1, SHORT) for side in (1, -1)]
    for k, (x, z) in enumerate(at):
        f = Frame(s, f"column-{k:02d}", (x, 0, z))
        f.box("foot", [0.80, 0.18, 0.80], "limestone-dark", (0, 0.09, 0))
        f.object("shaft", "lower-column", "limestone")
        f.box("abacus", [0.82, 0.21, 0.82], "limestone", (0, 2.945, 0))
        g = Frame(s, f"colonnette-{k:02d}", (x, UPPER, z))
        g.box("foot", [0.42, 0.90, 0.42], "limestone", (0, 0.45, 0))
        g.object("shaft", "upper-column", "limestone", (0, 0.84, 0))
        g.box("abacus", [0.58, 0.12, 0.50], "limestone", (0, 2.70, 0))
    for k, (x, z) in enumerate(((-HX, -HZ), (HX, -HZ), (-HX, HZ), (HX, HZ))):
        s.box(f"corner-{k}", [0.62, EAVES, 0.62], "limestone", (x, EAVES / 2, z))
        s.box(f"corner-{k}-foot", [0.82, 0.3, 0.82], "limestone-dark", (x, 0.15, z))
        s.box(f"corner-{k}-cap", [0.80, 0.2, 0.80], "limestone", (x, 2.95, z))


def shell(s):
    """Outer walls, the floors of the galleries, the attic above the loggias with its cornice and roof."""
    t = 0.5
    s.block("wall-north", (-OUT_X - t, 0, -OUT_Z - t), (OUT_X + t, EAVES, -OUT_Z), "plaster")
    s.block("wall-south", (-OUT_X - t, 0, OUT_Z), (OUT_X + t, EAVES, OUT_Z + t), "plaster")
    s.block("wall-west", (-OUT_X - t, 0, -OUT_Z), (-OUT_X, EAVES, OUT_Z), "plaster")
    s.block("wall-east", (OUT_X, 0, -OUT_Z), (OUT_X + t, EAVES, OUT_Z), "plaster")
    rings = (("gallery-floor", UPPER - 0.25, UPPER, 0.15, "paving-c"), ("gallery-roof", EAVES, EAVES + 0.3, 0.18, "beam"))
    for name, lo, hi, over, material in rings:
        s.block(f"{name}-north", (-OUT_X, lo, -OUT_Z), (OUT_X, hi, -HZ + over), material)
        s.block(f"{name}-south", (-OUT_X, lo, HZ - over), (OUT_X, hi, OUT_Z), material)
        s.block(f"{name}-west", (-OUT_X, lo, -HZ + over), (-HX + over, hi, HZ - over), material)
        s.block(f"{name}-east", (HX - over, lo, -HZ + over), (OUT_X, hi, HZ - over), material)
    for side, sign in (("north", -1), ("south", 1)):
        s.box(f"attic-{side}", [2 * HX + 0.36, TOP - EAVES - 0.3, 0.36], "plaster", (0, (TOP + EAVES + 0.3) / 2, sign * HZ))
        s.box(f"frieze-{side}", [2 * HX + 0.2, 0.16, 0.60], "limestone", (0, EAVES + 0.14, sign * HZ))
        s.box(f"cornice-{side}", [2 * HX + 0.2, 0.18, 0.90], "limestone", (0, TOP, sign * HZ))
        s.box(f"roof-{side}", [2 * OUT_X, 0.12, AISLE + 0.9], "roof-tile", (0, TOP + 0.18, sign * (HZ + AISLE / 2 - 0.1)))
    for side, sign in (("west", -1), ("east", 1)):
        s.box(f"attic-{side}", [0.36, TOP - EAVES - 0.3, 2 * HZ], "plaster", (sign * HX, (TOP + EAVES + 0.3) / 2, 0))
        s.box(f"frieze-{side}", [0.60, 0.16, 2 * HZ], "limestone", (sign * HX, EAVES + 0.141, 0))
        s.box(f"cornice-{side}", [0.90, 0.18, 2 * HZ], "limestone", (sign * HX, TOP + 0.001, 0))
        s.box(f"roof-{side}", [AISLE + 0.9, 0.12, 2 * HZ], "roof-tile", (sign * (HX + AISLE / 2 - 0.1), TOP + 0.181, 0))
    s.mesh("oculus", "torus", [0.9, 0.14, 0.9], segments=[20, 6], param=[0.15, 0, 0, 0])
    s.mesh("oculus-pane", "disc", [0.72, 0, 0.72], segments=[20, 1])
    for name, x, z, turn in bays():
        f = Frame(s, f"oculus-{name}", (x, TOP - 1.0, z), turn)
        f.object("rim", "oculus", "limestone", (0, 0, 0.19), (90, 0, 0))
        f.object("pane", "oculus-pane", "water", (0, 0, 0.184), (90, 0, 0))


def paving(s):
    """Slabs of the court in three tones, bands along the arcades, and the galleries' floor below all."""
    s.block("ground", (-OUT_X - 0.5, -0.4, -OUT_Z - 0.5), (OUT_X + 0.5, -0.02, OUT_Z + 0.5), "paving-b")
    random = Random(3)
    nx, nz = 24, 8
    for i in range(nx):
        for k in range(nz):
            w, d = (2 * HX - 1.2) / nx, (2 * HZ - 1.2) / nz
            x, z = -HX + 0.6 + (i + 0.5) * w, -HZ + 0.6 + (k + 0.5) * d
            s.box(f"slab-{i:02d}-{k}", [w, 0.05, d], "paving-" + "abc"[random.whole(3)], (x, -0.025, z))
    s.block("walk-north", (-OUT_X, -0.06, -OUT_Z), (OUT_X, 0, -HZ + 0.6), "paving-c")
    s.block("walk-south", (-OUT_X, -0.06, HZ - 0.6), (OUT_X, 0, OUT_Z), "paving-c")
    for side, x0, x1 in (("west", -OUT_X, -HX + 0.6), ("east", HX - 0.6, OUT_X)):
        s.block(f"walk-{side}", (x0, -0.06, -HZ + 0.6), (x1, 0.0, HZ - 0.6), "paving-c")


def drape():
    """A banner hung from its upper edge: folds that widen downwards."""
    def at(u, v):
        x, y = 1.5 * (u - 0.5) * (1 - 0.10 * math.sin(math.pi * v)), -3.4 * v
        return (-x, y, (0.05 + 0.10 * v) * math.sin(2 * math.pi * 3.5 * u) + 0.10 * v * math.sin(2.6 * math.pi * u + 1.1))
    return Mesh().patch(at, 32, 8)


def furnishing(s):
    """Banners in the loggias, a fountain in the middle, plants along the walks."""
    hung = {"north-1": "red", "north-3": "green", "north-5": "blue", "north-7": "red",
            "south-1": "blue", "south-3": "red", "south-5": "green", "south-7": "blue"}
    for name, x, z, turn in bays():
        if name in hung:
            f = Frame(s, f"banner-{name}", (x, UPPER, z), turn)
            f.object("cloth", "drape", f"cloth-{hung[name]}", (0, 0.86, 0.30))
            f.rod("pole", (-0.85, 0.88, 0.30), (0.85, 0.88, 0.30), 0.05, "bronze", 12)
    s.geometry("basin", lambda: cup(1.25, 0.55, 0.14, 48, 0.86))
    bowl = [(0.13, 0.0), (0.20, 0.06), (0.11, 0.18), (0.10, 0.75), (0.16, 0.86), (0.60, 1.05), (0.66, 1.13), (0.60, 1.13),
            (0.20, 1.02), (0, 1.0)]
    s.geometry("fountain-bowl", lambda: Mesh().lathe(bowl, 40))
    s.mesh("pool", "disc", [2.2, 0, 2.2], segments=[48, 1])
    s.mesh("fountain-ball", "sphere", [0.3, 0.3, 0.3], segments=[24, 12])
    at = (3.4, 0, 0)
    s.object("fountain-basin", "basin", "marble", at)
    s.object("fountain-pool", "pool", "water", (at[0], 0.42, 0))
    s.object("fountain-stem", "fountain-bowl", "marble", (at[0], 0.10, 0))
    s.object("fountain-top", "fountain-ball", "bronze", (at[0], 1.25, 0))
    for k in range(8):
        plant(s, f"plant-{k}", (-8.2 + 2.5 * k, 0, 2.75 if k % 2 else -2.75), 11, 1.5)


def sponza():
    s = Scene(title="An atrium with two storeys of arcades, in the sun")
    materials(s)
    meshes(s)
    shell(s)
    paving(s)
    arcades(s)
    pillars(s)
    furnishing(s)
    s.add("light", "sky", kind="environment", luminance_cd_m2=5500, color=[0.55, 0.75, 1.15], group="sky")
    s.add("light", "sun", kind="directional", direction=[0.38, -0.86, -0.33], illuminance_lx=70000, cct_k=5000, group="sun")
    s.camera("main", [-9.6, 1.75, 1.25], [2.5, 4.1, -0.75], 62)
    s.camera("loggia", [-9.5, UPPER + 1.6, 5.0], [4, UPPER + 0.8, -2.5], 60)
    return s
