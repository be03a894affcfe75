"""A scene file as a list of ops, and frames to place furniture in."""
import json
import math


def rounded(values, digits=5):
    return [round(v, digits) + 0.0 for v in values]


def short(values, digits):
    """Rounded, and whole numbers without a point: meshes are most of a file."""
    return [int(v) if v == int(v) else v for v in (round(v, digits) for v in values)]


class Scene:
    """Collects ops; add() returns the id, so that calls read like a parts list."""

    def __init__(self, kind="scene", **header):
        self.lines = [json.dumps({"lumend": 1, "kind": kind, **header})]
        self.made = set()
        self.ids = set()

    def op(self, op, **fields):
        self.lines.append(json.dumps({"op": op, **fields}))

    def note(self, text):
        self.lines.append(f"# {text}")

    def add(self, record, id, **fields):
        assert id not in self.ids, f"{id} is taken: one name space for all types"
        self.ids.add(id)
        self.op("add", type=record, id=id, **fields)
        return id

    def material(self, id, color, roughness=1.0, specular=0.0, **fields):
        return self.add("material", id, base_color=color, roughness=roughness, specular=specular, **fields)

    def mesh(self, id, shape, size, **fields):
        if id not in self.made:
            self.made.add(id)
            self.add("mesh", id, shape=shape, size=size, **fields)
        return id

    def geometry(self, id, make):
        """A mesh of arrays (mesh.py), made when it is first asked for."""
        if id not in self.made:
            self.made.add(id)
            self.ids.add(id)
            mesh = make()
            mesh.positions = short(mesh.positions, 4)
            fields = {"op": "add", "type": "mesh", "id": id, "positions": mesh.positions,
                      "normals": short(mesh.normals, 3), "indices": mesh.triangles_with_area()}
            self.lines.append(json.dumps(fields, separators=(",", ":")))
        return id

    def object(self, id, mesh, material, at=(0, 0, 0), turn=(0, 0, 0), scale=(1, 1, 1)):
        assert mesh in self.ids and material in self.ids, f"{id}: no {mesh}, or no {material}"
        transform = {"translate": rounded(at)}
        if any(turn):
            transform["rotate_deg"] = rounded(turn)
        if tuple(scale) != (1, 1, 1):
            transform["scale"] = rounded(scale)
        return self.add("object", id, mesh=mesh, material=material, transform=transform)

    def box(self, id, size, material, at, turn=(0, 0, 0)):
        """A box stretched from the unit box, so that all boxes share one mesh."""
        self.mesh("unit-box", "box", [1, 1, 1])
        return self.object(id, "unit-box", material, at, turn, size)

    def block(self, id, lo, hi, material):
        """A box from corner to corner: for walls that have to meet."""
        return self.box(id, [b - a for a, b in zip(lo, hi)], material, [(a + b) / 2 for a, b in zip(lo, hi)])

    def pane(self, id, z, y, x):
        """Clear glass in a wall that faces along x, over ranges of z and y: one sheet."""
        if "window-glass" not in self.ids:
            self.material("window-glass", [1, 1, 1], roughness=0.0, specular=1.0, transmission=1.0, thin=True)
        self.mesh("unit-quad", "quad", [1, 0, 1])
        return self.object(id, "unit-quad", "window-glass", (x, (y[0] + y[1]) / 2, (z[0] + z[1]) / 2), (0, 0, 90),
                           (y[1] - y[0], 1, z[1] - z[0]))

    def camera(self, id, position, target, vfov_deg):
        return self.add("camera", id, position=position, target=target, up=[0, 1, 0], vfov_deg=vfov_deg)

    def text(self):
        return "\n".join(self.lines) + "\n"


class Frame:
    """A piece of furniture: its parts are placed in its own axes, which are turned about y and moved. Ids begin with
    its name."""

    def __init__(self, scene, name, at=(0, 0, 0), turn=0):
        self.scene, self.name, self.origin, self.turn = scene, name, at, turn
        self.cos, self.sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))

    def point(self, p):
        x, y, z = p
        ox, oy, oz = self.origin
        return (ox + self.cos * x + self.sin * z, oy + y, oz - self.sin * x + self.cos * z)

    def direction(self, d):
        return (self.cos * d[0] + self.sin * d[2], d[1], -self.sin * d[0] + self.cos * d[2])

    def object(self, id, mesh, material, at=(0, 0, 0), turn=(0, 0, 0), scale=(1, 1, 1)):
        angles = turned_about_y(turn, self.turn) if turn[2] else (turn[0], turn[1] + self.turn, 0)
        return self.scene.object(f"{self.name}-{id}", mesh, material, self.point(at), angles, scale)

    def box(self, id, size, material, at, turn=(0, 0, 0)):
        self.scene.mesh("unit-box", "box", [1, 1, 1])
        return self.object(id, "unit-box", material, at, turn, size)

    def rod(self, id, a, b, thickness, material, sides=16):
        """A round bar from a to b, stretched from one cylinder of height 1."""
        mesh = self.scene.mesh(f"rod-{sides}", "cylinder", [1, 1, 1], segments=[sides, 1])
        d = [q - p for p, q in zip(a, b)]
        length = math.sqrt(sum(c * c for c in d))
        # Rz Ry Rx y = d: tilt from y towards z about x, then turn about y
        tilt, heading = math.degrees(math.acos(max(-1.0, min(1.0, d[1] / length)))), math.degrees(math.atan2(d[0], d[2]))
        turn = (tilt, heading, 0) if tilt > 1e-6 else (0, 0, 0)
        return self.object(id, mesh, material, [(p + q) / 2 for p, q in zip(a, b)], turn, (thickness, length, thickness))


def turned_about_y(turn, angle):
    """Euler angles (x first, then y, then z) of: turn, then a turn about y."""
    x, y, z = (math.radians(v) for v in turn)
    a = math.radians(angle)
    cx, sx, cy, sy, cz, sz, ca, sa = (f(v) for v in (x, y, z, a) for f in (math.cos, math.sin))
    r = [[cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
         [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
         [-sy, cy * sx, cy * cx]]
    m = [[ca * p + sa * q for p, q in zip(r[0], r[2])], r[1], [ca * q - sa * p for p, q in zip(r[0], r[2])]]
    return (math.degrees(math.atan2(m[2][1], m[2][2])), math.degrees(math.asin(max(-1.0, min(1.0, -m[2][0])))),
            math.degrees(math.atan2(m[1][0], m[0][0])))


class Random:
    """A small congruential generator: the same numbers everywhere."""

    def __init__(self, seed):
        self.state = seed

    def whole(self, n):
        self.state = (self.state * 1103515245 + 12345) % (1 << 31)
        return (self.state >> 8) % n

    def between(self, lo, hi):
        return lo + (hi - lo) * self.whole(4096) / 4095
