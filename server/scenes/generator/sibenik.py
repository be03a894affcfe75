"""A cathedral: nave, aisles, vaults and apse; little light, and most of the stone behind other stone."""
import base64
import math

from .arches import arch_panel, diagonal_rib, groin_vault, moulding
from .mesh import Mesh, tube
from .scene import Frame, Scene, rounded

BAYS, BAY = 6, 5.0
WEST, EAST = -BAYS * BAY / 2, BAYS * BAY / 2
NAVE = 4.6  # half width, to the middle of the arcades
AISLE = 4.2
WALL = 0.9  # thickness of the arcade walls
ARCADE = (1.85, 5.6, 2.3)  # half width of the opening, springing, rise
STOREY = 9.0  # top of the arcades
SPRING, RISE = 11.2, 5.6  # nave vault
AISLE_SPRING, AISLE_RISE = 5.6, 2.75
ROOF = 17.6
APSE = (3.3, 6.4, 3.3)  # half width, springing, rise
ROSE_Y, ROSE_R = 13.1, 1.75
STEP = 0.16  # three steps up to the choir
CHOIR = EAST - BAY  # where they are


def materials(s):
    s.material("limestone", [0.62, 0.57, 0.49])
    s.material("limestone-pale", [0.70, 0.66, 0.58])
    s.material("plaster", [0.66, 0.62, 0.55])
    s.material("vault", [0.64, 0.60, 0.53])
    s.material("floor-light", [0.58, 0.52, 0.44], roughness=0.35, specular=0.8)
    s.material("floor-dark", [0.24, 0.13, 0.10], roughness=0.35, specular=0.8)
    s.material("oak", [0.24, 0.14, 0.075], roughness=0.5, specular=0.8)
    s.material("marble", [0.75, 0.73, 0.69], roughness=0.3, specular=0.8)
    s.material("gold", [0.85, 0.63, 0.26], roughness=0.3, metallic=1.0, specular=1.0)
    s.material("iron", [0.07, 0.07, 0.075], roughness=0.5, specular=0.8)
    s.material("cloth", [0.40, 0.04, 0.05])
    s.material("linen", [0.78, 0.76, 0.70])
    s.material("wax", [0.82, 0.77, 0.62])
    s.material("pane", [0.03, 0.04, 0.06], roughness=0.2, specular=1.0)
    s.material("fresco", [0.10, 0.17, 0.34])


def column():
    """Attic base, a shaft that swells, a bell capital; its foot is at y = 0, its abacus' at 5.3."""
    profile = [(0.62, 0.22), (0.70, 0.25), (0.73, 0.32), (0.70, 0.39), (0.62, 0.42), (0.60, 0.47), (0.64, 0.51), (0.65, 0.55),
               (0.62, 0.60), (0.545, 0.63), (0.54, 1.4), (0.525, 2.6), (0.49, 4.3), (0.54, 4.33), (0.55, 4.38), (0.53, 4.43),
               (0.50, 4.46), (0.53, 4.70), (0.62, 4.95), (0.72, 5.12), (0.74, 5.2), (0.70, 5.3)]
    return Mesh().lathe(profile, 24)


def leaves(radius, height, n):
    """A ring of bent leaves for a capital."""
    mesh = Mesh()
    for k in range(n):
        a = 2 * math.pi * k / n
        rows = []
        for i in range(7):
            t = i / 6
            out = radius + 0.16 * t * t + 0.05 * math.sin(math.pi * t)
            up = height * (t - 0.35 * max(t - 0.75, 0) * 4)
            w = 0.10 * math.sin(math.pi * (0.15 + 0.8 * t))
            rows.append([(out * math.cos(a) - d * w * math.sin(a), up + 0.03 * abs(d), -(out * math.sin(a) + d * w * math.cos(a)))
                         for d in (1, 0, -1)])
        mesh.grid(rows)
    return mesh


PROFILE = [(0.0, -0.16), (0.10, -0.16), (0.16, -0.09), (0.16, 0.09), (0.10, 0.16), (0.0, 0.16)]  # of ribs: below, across


def inward(profile):
    """A profile on the inner side of an arch, counter-clockwise in (outward, z)."""
    return [(-a, b) for a, b in reversed(profile)]


def meshes(s):
    s.geometry("column", column)
    s.geometry("capital-leaves", lambda: leaves(0.50, 0.42, 12))
    s.geometry("arcade-arch", lambda: arch_panel(BAY, STOREY - ARCADE[1], (ARCADE[0], 0, ARCADE[2]), WALL, 20))
    order = [(0, -0.22), (0.12, -0.22), (0.17, -0.15), (0.17, 0.15), (0.12, 0.22), (0, 0.22)]
    s.geometry("arcade-order", lambda: moulding(ARCADE[0] + 0.02, ARCADE[2] + 0.02, inward(order), 20))
    z = WALL / 2
    label = [(0, z - 0.02), (0.12, z - 0.02), (0.12, z + 0.06), (0.06, z + 0.09), (0, z + 0.05)]
    s.geometry("arcade-label", lambda: moulding(ARCADE[0] + 0.22, ARCADE[2] + 0.24, label, 20))
    s.geometry("nave-vault", lambda: groin_vault(BAY, 2 * NAVE, RISE, 20, 6))
    s.geometry("nave-rib", lambda: diagonal_rib(BAY, 2 * NAVE, RISE, rib_profile(0.11), 24))
    s.geometry("transverse-rib", lambda: moulding(NAVE, RISE, inward(PROFILE), 28))
    s.geometry("aisle-vault", lambda: groin_vault(BAY, AISLE, AISLE_RISE, 12, 5))
    s.geometry("aisle-rib", lambda: diagonal_rib(BAY, AISLE, AISLE_RISE, rib_profile(0.08), 20))
    s.geometry("aisle-arch", lambda: moulding(AISLE / 2, AISLE_RISE, inward(PROFILE), 20))
    s.geometry("clerestory", lambda: arch_panel(BAY, SPRING + RISE - STOREY, (0.62, 3.3, 0.75), WALL, 16))
    frame = [(0, -0.08), (0.10, -0.08), (0.10, 0.08), (0, 0.08)]
    s.geometry("clerestory-frame", lambda: moulding(0.64, 0.77, inward(frame), 16, legs=3.3))
    capital = [(0.13, 0), (0.16, 0.03), (0.13, 0.06), (0.16, 0.2), (0.24, 0.34), (0.24, 0.42), (0, 0.42)]
    s.geometry("shaft-capital", lambda: Mesh().lathe(capital, 16))
    s.mesh("shaft", "cylinder", [0.30, 1, 0.30], segments=[20, 1])


def rib_profile(r):
    """Half round, below the vault: (side, up)."""
    return [(-r * math.cos(a), -1.4 * r * math.sin(a)) for a in (math.pi * k / 5 for k in range(6))]


def bay_x(k):
    return WEST + (k + 0.5) * BAY


def nave(s):
    for k in range(BAYS):
        x = bay_x(k)
        for side, sign in (("n", -1), ("s", 1)):
            f = Frame(s, f"bay-{side}{k}", (x, 0, sign * NAVE), 0 if sign < 0 else 180)
            f.object("arcade", "arcade-arch", "limestone", (0, ARCADE[1], 0))
            f.object("order", "arcade-order", "limestone-pale", (0, ARCADE[1], 0))
            f.object("label", "arcade-label", "limestone-pale", (0, ARCADE[1], 0))
            f.box("string", [BAY, 0.16, WALL + 0.22], "limestone-pale", (0, STOREY + 0.08, 0))
            f.box("band", [BAY, 0.44, WALL], "limestone", (0, STOREY + 0.38, 0))
            f.object("clerestory", "clerestory", "plaster", (0, STOREY + 0.6, 0))
            f.object("window-frame", "clerestory-frame", "limestone-pale", (0, STOREY + 0.6 + 3.3, 0.3))
        s.object(f"vault-{k}", "nave-vault", "vault", (x, SPRING, 0))
        for way, flip in (("a", 1), ("b", -1)):
            s.object(f"vault-{k}-rib-{way}", "nave-rib", "limestone-pale", (x, SPRING, 0), scale=(1, 1, flip))
        s.mesh("boss", "sphere", [0.6, 0.3, 0.6], segments=[16, 8])
        s.object(f"vault-{k}-boss", "boss", "gold", (x, SPRING + RISE - 0.12, 0))
    for k in range(BAYS + 1):
        s.object(f"transverse-{k}", "transverse-rib", "limestone-pale", (WEST + k * BAY, SPRING, 0), (0, 90, 0))
    s.block("nave-roof", (WEST - 1, ROOF, -NAVE - 1), (EAST + 1, ROOF + 0.4, NAVE + 1), "plaster")


def columns(s):
    """Free columns between the bays, half hidden ones at both ends; a wall shaft above each up to the vault."""
    for k in range(BAYS + 1):
        for side, sign in (("n", -1), ("s", 1)):
            f = Frame(s, f"pier-{side}{k}", (WEST + k * BAY, 0, sign * NAVE), 0 if sign < 0 else 180)
            f.box("plinth", [1.55, 0.22, 1.55], "limestone", (0, 0.11, 0))
            f.object("column", "column", "limestone-pale")
            f.object("leaves", "capital-leaves", "limestone-pale", (0, 4.62, 0))
            f.box("abacus", [1.5, 0.30, 1.5], "limestone", (0, 5.45, 0))
            z = WALL / 2 + 0.04
            f.object("shaft", "shaft", "limestone-pale", (0, (5.6 + SPRING) / 2, z), scale=(1, SPRING - 5.9, 1))
            f.object("shaft-capital", "shaft-capital", "limestone-pale", (0, SPRING - 0.40, z), scale=(1.15, 1, 1.15))


def aisles(s):
    z_mid, z_out = NAVE + AISLE / 2, NAVE + AISLE
    for side, sign in (("n", -1), ("s", 1)):
        for k in range(BAYS):
            x = bay_x(k)
            s.object(f"aisle-{side}{k}-vault", "aisle-vault", "vault", (x, AISLE_SPRING, sign * z_mid))
            for way, flip in (("a", 1), ("b", -1)):
                s.object(f"aisle-{side}{k}-rib-{way}", "aisle-rib", "limestone-pale", (x, AISLE_SPRING, sign * z_mid),
                         scale=(1, 1, flip))
        for k in range(BAYS + 1):
            x = WEST + k * BAY
            s.object(f"aisle-{side}{k}-arch", "aisle-arch", "limestone-pale", (x, AISLE_SPRING, sign * z_mid), (0, 90, 0))
            s.box(f"aisle-{side}{k}-pilaster", [0.7, AISLE_SPRING, 0.24], "limestone",
                  (x, AISLE_SPRING / 2, sign * (z_out - 0.1)))
        s.box(f"aisle-wall-{side}", [EAST - WEST + 2, ROOF + 0.4, 0.8], "plaster",
              (0, (ROOF + 0.4) / 2, sign * (z_out + 0.4)))
        s.box(f"aisle-roof-{side}", [EAST - WEST + 2, 0.3, AISLE], "plaster", (0, STOREY + 0.2, sign * z_mid))
        s.box(f"aisle-bench-{side}", [EAST - WEST, 0.45, 0.45], "limestone", (0, 0.225, sign * (z_out - 0.22)))


def ends(s):
    """West wall with its door; the east wall, pierced by the apse's arch and the rose."""
    z = NAVE + AISLE + 0.8
    s.block("west-wall", (WEST - 0.9, -0.3, -z), (WEST, ROOF + 0.4, z), "plaster")
    s.box("west-door", [0.12, 3.6, 2.4], "oak", (WEST + 0.05, 1.8, 0))
    jamb = [(0, -0.2), (0.35, -0.2), (0.35, 0.1), (0.2, 0.2), (0, 0.2)]
    s.geometry("door-arch", lambda: moulding(1.2, 1.2, jamb, 20, legs=3.6))
    s.object("west-door-arch", "door-arch", "limestone-pale", (WEST + 0.1, 3.6, 0), (0, 90, 0))
    s.geometry("apse-wall", lambda: arch_panel(2 * NAVE, ROSE_Y - ROSE_R - 0.1, APSE, 0.9, 28))
    s.object("apse-wall-low", "apse-wall", "limestone", (EAST + 0.45, 0, 0), (0, -90, 0))
    order = [(0, -0.5), (0.12, -0.5), (0.2, -0.42), (0.2, 0.3), (0, 0.3)]
    s.geometry("apse-order", lambda: moulding(APSE[0] + 0.02, APSE[2] + 0.02, inward(order), 28, legs=APSE[1]))
    s.object("apse-wall-order", "apse-order", "limestone-pale", (EAST + 0.4, APSE[1], 0), (0, -90, 0))
    rose_wall(s)
    for side, sign in (("n", -1), ("s", 1)):
        s.box(f"east-wall-{side}", [0.9, ROOF + 0.7, z - NAVE], "plaster", (EAST + 0.45, ROOF / 2 + 0.05, sign * (NAVE + z) / 2))
        # an altar at the end of the aisle
        at = sign * (NAVE + AISLE / 2)
        s.box(f"side-altar-{side}", [0.7, 0.95, 1.7], "marble", (EAST - 0.45, 0.475, at))
        s.box(f"side-altar-{side}-picture", [0.08, 2.2, 1.5], "gold", (EAST - 0.05, 2.4, at))
        s.box(f"side-altar-{side}-panel", [0.02, 2.0, 1.3], "fresco", (EAST - 0.10, 2.4, at))


def rose_wall(s):
    """A square of wall with a round hole, from the apse's arch to the roof, and what fills the hole."""
    lo, top, n = ROSE_Y - ROSE_R - 0.1, ROOF + 0.2, 48

    def at_border(a):
        c, d = math.cos(a), math.sin(a)
        height = top - ROSE_Y if d > 0 else ROSE_Y - lo
        reach = min(NAVE / max(abs(c), 1e-9), height / max(abs(d), 1e-9))
        return (reach * c, ROSE_Y + reach * d)

    def wall():
        corners = [math.atan2(y - ROSE_Y, x) % (2 * math.pi) for x in (NAVE, -NAVE) for y in (lo, top)]
        angles = sorted([2 * math.pi * k / n for k in range(n)] + corners)
        inner = [(ROSE_R * math.cos(a), ROSE_Y + ROSE_R * math.sin(a)) for a in angles]
        outer = [at_border(a) for a in angles]
        mesh = Mesh().grid([[(*a, 0.45), (*b, 0.45)] for a, b in zip(outer, inner)], closed=True, normal=(0, 0, 1))
        mesh.grid([[(*b, -0.45), (*a, -0.45)] for a, b in zip(outer, inner)], closed=True, normal=(0, 0, -1))
        return mesh.grid([[(*p, 0.45), (*p, -0.45)] for p in inner], closed=True)

    s.geometry("rose-wall", wall)
    s.object("apse-wall-high", "rose-wall", "limestone", (EAST + 0.45, 0, 0), (0, -90, 0))
    f = Frame(s, "rose", (EAST + 0.35, ROSE_Y, 0), -90)
    s.mesh("rose-ring", "torus", [3.7, 0.26, 3.7], segments=[64, 10], param=[0.08, 0, 0, 0])
    s.mesh("rose-hub-ring", "torus", [0.95, 0.12, 0.95], segments=[32, 8], param=[0.14, 0, 0, 0])
    s.mesh("rose-petal", "torus", [0.72, 0.09, 0.72], segments=[20, 6], param=[0.13, 0, 0, 0])
    f.object("rim", "rose-ring", "limestone-pale", (0, 0, 0.05), (90, 0, 0))
    f.object("hub", "rose-hub-ring", "limestone-pale", (0, 0, 0), (90, 0, 0))
    for k in range(12):
        a = math.radians(30 * k)
        c, d = math.cos(a), math.sin(a)
        f.rod(f"spoke-{k:02d}", (0.42 * c, 0.42 * d, 0), (1.06 * c, 1.06 * d, 0), 0.08, "limestone-pale", 10)
        b = a + math.radians(15)
        f.object(f"petal-{k:02d}", "rose-petal", "limestone-pale", (1.36 * math.cos(b), 1.36 * math.sin(b), 0), (90, 0, 0))


def apse_shell():
    """Half a cylinder open to the nave, and half a dome on it; the front is inside."""
    half, spring, _ = APSE
    arc = [math.pi * k / 32 for k in range(33)][::-1]
    ring = [(half * math.sin(a), half * math.cos(a)) for a in arc]
    rise = [math.pi / 2 * j / 12 for j in range(13)]
    mesh = Mesh().grid([[(x, 0, z), (x, spring, z)] for x, z in ring])
    return mesh.grid([[(x * math.cos(b), spring + half * math.sin(b), z * math.cos(b)) for b in rise] for x, z in ring])


def apse(s):
    """The shell, a string course where its dome begins, ribs on shafts, and painted panels between them."""
    half, spring, _ = APSE
    x0 = EAST + 0.9
    s.geometry("apse-shell", apse_shell)
    s.object("apse-shell-wall", "apse-shell", "plaster", (x0, 0, 0))
    r = half - 0.02
    course = [(r * math.sin(a), 0, r * math.cos(a)) for a in (math.pi * k / 32 for k in range(33))]
    s.geometry("apse-string", lambda: Mesh().sweep(course, [(0.1, -0.1), (0.1, 0.1), (-0.14, 0.1), (-0.08, -0.1)], (0, 1, 0)))
    s.object("apse-string-course", "apse-string", "limestone-pale", (x0, spring, 0))
    rib = [(half * math.cos(b), half * math.sin(b), 0) for b in (math.pi / 2 * j / 14 for j in range(15))]
    s.geometry("apse-rib", lambda: tube(rib, 0.2, (0, 0, 1), 8))
    for k in range(5):
        a = math.radians(60 - 30 * k)
        x, z = x0 + (half - 0.05) * math.cos(a), -(half - 0.05) * math.sin(a)
        s.object(f"apse-rib-{k}", "apse-rib", "limestone-pale", (x0, spring, 0), (0, 60 - 30 * k, 0))
        s.object(f"apse-shaft-{k}", "shaft", "limestone-pale", (x, spring / 2, z), scale=(0.7, spring, 0.7))
    for k in range(4):
        a = math.radians(45 - 30 * k)
        x, z = x0 + (half - 0.05) * math.cos(a), -(half - 0.05) * math.sin(a)
        s.box(f"apse-panel-{k}", [0.06, 2.6, 1.0], "fresco", (x, 3.6, z), (0, 45 - 30 * k, 0))
    s.block("apse-floor", (x0, -0.3, -half - 0.3), (EAST + 4.6, 0, half + 0.3), "floor-light")


def floor(s):
    """Slabs in two colours, laid as one mesh of each; the choir is three steps higher."""
    s.block("floor", (WEST - 0.9, -0.3, -NAVE - AISLE - 0.8), (EAST + 0.9, 0, NAVE + AISLE + 0.8), "floor-light")
    size, n_x, n_z = 0.625, int((CHOIR - WEST) / 0.625), 12

    def slabs():
        mesh = Mesh()
        for i in range(n_x):
            for k in range(n_z):
                if (i + k) % 2:
                    x, z = WEST + i * size, (k - n_z / 2) * size
                    mesh.grid([[(a, 0.003, z), (a, 0.003, z + size)] for a in (x + size, x)], normal=(0, 1, 0))
        return mesh

    s.geometry("dark-slabs", slabs)
    s.object("floor-dark-slabs", "dark-slabs", "floor-dark")
    for k in range(3):
        x = CHOIR + 0.38 * k
        s.block(f"choir-step-{k}", (x, 0, -NAVE + 0.9), (EAST + 4.3, STEP * (k + 1), NAVE - 0.9),
                "limestone-pale" if k < 2 else "floor-light")
    s.block("carpet", (WEST + 1.5, 0, -0.7), (CHOIR - 0.1, 0.008, 0.7), "cloth")


def pew(s, name, x, z):
    f = Frame(s, name, (x, 0, z))
    f.box("seat", [0.42, 0.04, 2.3], "oak", (0, 0.44, 0))
    f.box("back", [0.04, 0.50, 2.3], "oak", (-0.22, 0.70, 0), (0, 0, 8))
    f.box("rail", [0.09, 0.04, 2.3], "oak", (-0.26, 0.95, 0))
    f.box("kneeler", [0.16, 0.06, 2.2], "oak", (0.42, 0.14, 0))
    for side, dz in (("l", -1.17), ("r", 1.17)):
        f.box(f"end-{side}", [0.50, 0.62, 0.05], "oak", (-0.02, 0.31, dz))
        f.box(f"end-{side}-top", [0.12, 0.45, 0.05], "oak", (-0.23, 0.79, dz))


def furnishing(s):
    for k in range(12):
        for side, z in (("n", -2.2), ("s", 2.2)):
            pew(s, f"pew-{side}{k:02d}", WEST + 4.8 + 1.15 * k, z)
    base = 3 * STEP
    s.box("altar", [1.0, 1.0, 2.6], "marble", (EAST + 1.0, base + 0.5, 0))
    s.box("altar-cloth", [1.06, 0.03, 2.7], "linen", (EAST + 1.0, base + 1.015, 0))
    s.box("altar-front", [0.01, 0.65, 1.2], "cloth", (EAST + 0.493, base + 0.62, 0))
    s.box("cross-post", [0.05, 1.1, 0.07], "gold", (EAST + 1.25, base + 1.58, 0))
    s.box("cross-bar", [0.05, 0.07, 0.6], "gold", (EAST + 1.25, base + 1.80, 0))
    candlestick = [(0, 0), (0.09, 0), (0.08, 0.03), (0.025, 0.06), (0.02, 0.12), (0.035, 0.16), (0.018, 0.22), (0.02, 0.34),
                   (0.055, 0.38), (0, 0.38)]
    s.geometry("candlestick", lambda: Mesh().lathe(candlestick, 16))
    s.mesh("candle", "cylinder", [0.035, 0.32, 0.035], segments=[12, 1])
    for k, z in enumerate((-1.1, -0.75, 0.75, 1.1)):
        s.object(f"candlestick-{k}", "candlestick", "gold", (EAST + 1.1, base + 1.03, z))
        s.object(f"candle-{k}", "candle", "wax", (EAST + 1.1, base + 1.57, z))
    pulpit(s)


def pulpit(s):
    f = Frame(s, "pulpit", (CHOIR - 1.6, 0, -NAVE + 1.7))
    octagon = [(0.62 * math.cos(a), -0.62 * math.sin(a)) for a in (2 * math.pi * (k + 0.5) / 8 for k in range(8))]
    s.geometry("pulpit-tub", lambda: Mesh().prism(octagon, 0, 1.05))
    stem = [(0.35, 0), (0.30, 0.12), (0.15, 0.2), (0.13, 1.3), (0.2, 1.45), (0.58, 1.75)]
    s.geometry("pulpit-stem", lambda: Mesh().lathe(stem, 24))
    f.object("foot", "pulpit-stem", "marble")
    f.object("box", "pulpit-tub", "marble", (0, 1.75, 0))
    f.object("ledge", "pulpit-tub", "oak", (0, 2.80, 0), scale=(1.12, 0.08, 1.12))


def chandelier(s, name, x, y, flux):
    """An iron ring of candles on a chain round a globe, which is the light."""
    f = Frame(s, name, (x, y, 0))
    s.mesh("chandelier-hoop", "torus", [1.9, 0.06, 1.9], segments=[48, 6], param=[0.03, 0, 0, 0])
    f.object("ring", "chandelier-hoop", "iron")
    for k in range(12):
        a = math.radians(30 * k)
        f.object(f"candle-{k:02d}", "candle", "wax", (0.92 * math.cos(a), 0.18, 0.92 * math.sin(a)))
        if k % 3 == 0:
            f.rod(f"chain-{k // 3}", (0.92 * math.cos(a), 0.03, 0.92 * math.sin(a)), (0, 1.3, 0), 0.025, "iron", 6)
    f.rod("rope", (0, 1.3, 0), (0, SPRING + RISE - y, 0), 0.03, "iron", 6)
    s.add("light", f"{name}-globe", kind="sphere", position=rounded((x, y + 0.25, 0)), radius=0.16, flux_lm=flux, cct_k=2500,
          group="chandeliers")


def windows(s):
    """Two windows of the south clerestory are bright; the others, leaded and in the shade, are dark panes."""
    y, high = STOREY + 0.6, 4.1
    for k in range(BAYS):
        for side, sign in (("n", -1), ("s", 1)):
            name, x, z = f"window-{side}{k}", bay_x(k), sign * (NAVE + 0.36)
            for i in range(4):
                s.box(f"{name}-bar-{i}", [1.24, 0.04, 0.05], "iron", (x, y + 0.75 + 0.85 * i, z - sign * 0.06))
            s.box(f"{name}-mullion", [0.07, high, 0.07], "limestone-pale", (x, y + high / 2, z - sign * 0.06))
            if side == "s" and k in (1, 3):
                s.add("light", name, kind="quad", position=rounded((x, y + high / 2, z)), u=[1.3, 0, 0], v=[0, -high, 0],
                      luminance_cd_m2=5000, cct_k=4700, group="clerestory")
            else:
                s.box(f"{name}-pane", [1.3, high, 0.02], "pane", (x, y + high / 2, z))


def rose_glass(s):
    """The glass of the rose: polar, a column of the picture for each direction and a row for each distance."""
    wide, tall, pixels = 48, 12, bytearray()
    for j in range(tall):
        r = (j + 0.5) / tall  # 0 in the middle
        for i in range(wide):
            petal, inside = i * 12 // wide, (i % 4) in (1, 2)
            if r < 0.24:
                rgb = (255, 214, 120)
            elif r < 0.58:
                rgb = (40, 70, 210) if petal % 2 else (190, 40, 130)
            elif r < 0.95 and inside:
                rgb = (225, 40, 25) if petal % 2 else (40, 110, 235)
            else:
                rgb = (235, 170, 60)
            pixels += bytes(rgb) + b"\xff"
    s.add("image", "rose-picture", width=wide, height=tall, texel="srgb8", pixels=base64.b64encode(pixels).decode())
    s.material("rose-glass", [0.05, 0.05, 0.05], emission_cd_m2=700, emission_texture={"image": "rose-picture"})
    s.mesh("rose-pane", "disc", [3.6, 0, 3.6], segments=[48, 3])
    s.object("rose-glass-pane", "rose-pane", "rose-glass", (EAST + 0.5, ROSE_Y, 0), (0, 0, 90))


def lights(s):
    """Daylight through the rose and two windows, a chandelier, and a lamp hidden behind the apse's arch: all else is
    reflected."""
    windows(s)
    rose_glass(s)
    chandelier(s, "chandelier", WEST + 3.0 * BAY, 6.6, 6000)
    s.add("light", "apse-lamp", kind="disc", position=[EAST + 1.1, 9.2, 0], direction=[0.55, -1, 0], radius=0.15, flux_lm=9000,
          cct_k=2900, group="apse")


def sibenik():
    s = Scene(title="A cathedral, most of it out of sight of its few lights")
    materials(s)
    meshes(s)
    floor(s)
    nave(s)
    columns(s)
    aisles(s)
    ends(s)
    apse(s)
    furnishing(s)
    lights(s)
    s.camera("main", [WEST + 1.2, 1.9, 1.3], [2.0, 5.9, -0.75], 62)
    return s
