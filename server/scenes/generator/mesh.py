"""Meshes of arrays: what the built-in shapes do not offer, made of grids of points."""
import math

CREASE_COS = math.cos(math.radians(38))  # a profile bends smoothly below this angle, and has an edge above


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    return (a[0] / length, a[1] / length, a[2] / length) if length > 1e-12 else None


class Mesh:
    """positions and normals: 3 numbers a vertex; indices: 3 a triangle, counter-clockwise from the front."""

    def __init__(self):
        self.positions, self.normals, self.indices = [], [], []

    def vertex(self, p, n):
        self.positions += p
        self.normals += n
        return len(self.positions) // 3 - 1

    def grid(self, rows, closed=False, normal=None):
        """A surface through rows[i][j]; its front is along d/di x d/dj. closed: the last row meets the first. normal:
        one for all, else from neighbouring points, so that it is smooth."""
        n, m = len(rows), len(rows[0])
        first = len(self.positions) // 3
        for i in range(n):
            for j in range(m):
                self.vertex(rows[i][j], normal or grid_normal(rows, i, j, closed))
        for i in range(n if closed else n - 1):
            for j in range(m - 1):
                a, b = first + i * m + j, first + (i + 1) % n * m + j
                self.indices += (a, b, b + 1, a, b + 1, a + 1)
        return self

    def add(self, other, at):
        """Another mesh, moved."""
        first = len(self.positions) // 3
        self.positions += [v + at[i % 3] for i, v in enumerate(other.positions)]
        self.normals += other.normals
        self.indices += [i + first for i in other.indices]
        return self

    def triangles_with_area(self):
        """All but those at poles, and those that rounding made flat."""
        kept = []
        for k in range(0, len(self.indices), 3):
            corners = self.indices[k:k + 3]
            p, q, r = (self.positions[3 * i:3 * i + 3] for i in corners)
            if unit(cross(sub(q, p), sub(r, p))):
                kept += corners
        return kept

    def patch(self, at, nu, nv):
        """at(u, v) for u, v in 0..1."""
        return self.grid([[at(i / nu, j / nv) for j in range(nv + 1)] for i in range(nu + 1)])

    def lathe(self, profile, around, arc=360):
        """(radius, y) upwards with the outside to the right, turned about y."""
        closed = arc == 360
        angles = [math.radians(arc * i / around) for i in range(around if closed else around + 1)]
        for run in smooth_runs(profile):
            self.grid([[(r * math.cos(a), y, -r * math.sin(a)) for r, y in run] for a in angles], closed)
        return self

    def sweep(self, path, profile, up, closed=False, smooth=False):
        """A closed profile of (side, up) points, counter-clockwise seen against the path, carried along it. up: what the
        profile's second axis leans to. smooth: the profile has no edges, however few its points."""
        n = len(path)
        frames = []
        for i, p in enumerate(path):
            ahead = path[(i + 1) % n] if closed or i + 1 < n else p
            behind = path[i - 1] if closed or i > 0 else p
            along = unit(sub(ahead, behind))
            side = unit(cross(along, up))
            frames.append((p, side, cross(side, along)))
        for run in [profile + profile[:1]] if smooth else smooth_runs(profile, closed=True):
            self.grid([[tuple(p[k] + a * s[k] + b * u[k] for k in range(3)) for a, b in run] for p, s, u in frames], closed)
        return self

    def fan(self, outline, normal):
        """A flat polygon, star-shaped about its mean; counter-clockwise seen against the normal."""
        n = len(outline)
        centre = self.vertex(tuple(sum(p[k] for p in outline) / n for k in range(3)), normal)
        ring = [self.vertex(p, normal) for p in outline]
        for i in range(n):
            self.indices += (centre, ring[i], ring[(i + 1) % n])
        return self

    def prism(self, outline, lo, hi):
        """An outline of (x, z), counter-clockwise seen from above, from height lo to hi."""
        for run in smooth_runs(outline, closed=True):
            self.grid([[(x, lo, z), (x, hi, z)] for x, z in run])
        self.fan([(x, hi, z) for x, z in outline], (0, 1, 0))
        return self.fan([(x, lo, z) for x, z in reversed(outline)], (0, -1, 0))

    def block(self, lo, hi):
        """A box without sharing: six flat sides."""
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for sign, face in ((-1, lo), (1, hi)):
                n, rows = [0, 0, 0], []
                n[axis] = sign
                for a in (lo[u], hi[u]) if sign > 0 else (hi[u], lo[u]):
                    row = []
                    for b in (lo[v], hi[v]):
                        p = [0, 0, 0]
                        p[axis], p[u], p[v] = face[axis], a, b
                        row.append(tuple(p))
                    rows.append(row)
                self.grid(rows, normal=tuple(n))
        return self


def grid_normal(rows, i, j, closed):
    """From the neighbours; at a pole, where a row or a column shrinks to a point, as one step inside."""
    n, m = len(rows), len(rows[0])
    for k, l in ((i, j), (i, 1 if j == 0 else j - 1), (1 if i == 0 else i - 1, j)):
        up, down = ((k + 1) % n, k - 1) if closed else (min(k + 1, n - 1), max(k - 1, 0))
        across = unit(sub(rows[up][l], rows[down][l]))
        along = unit(sub(rows[k][min(l + 1, m - 1)], rows[k][max(l - 1, 0)]))
        normal = unit(cross(across, along)) if across and along else None
        if normal:
            return normal
    raise ValueError("a surface without an area")


def smooth_runs(points, closed=False):
    """A polyline cut at its edges. Each piece shares its end points with the next, but not the normals there."""
    n = len(points)
    directions = [unit((points[(i + 1) % n][0] - points[i][0], points[(i + 1) % n][1] - points[i][1], 0)) for i in range(n)]

    def is_edge(i):
        a, b = directions[i - 1], directions[i]
        return a and b and a[0] * b[0] + a[1] * b[1] < CREASE_COS

    if not closed:
        cuts = [0] + [i for i in range(1, n - 1) if is_edge(i)] + [n - 1]
        return [points[a:b + 1] for a, b in zip(cuts, cuts[1:])]
    cuts = [i for i in range(n) if is_edge(i)] or [0]
    around = [points[(cuts[0] + k) % n] for k in range(n + 1)]
    ends = [c - cuts[0] for c in cuts] + [n]
    return [around[a:b + 1] for a, b in zip(ends, ends[1:])]


# ---------------------------------------------------------------- shapes for all scenes

def cushion(size, corner=0.4, flatness=0.45, around=40, along=20):
    """A pillow: a superellipsoid. Smaller exponents are boxier."""
    def power(value, exponent):
        return math.copysign(abs(value) ** exponent, value)

    def at(u, v):
        phi, theta = 2 * math.pi * u, math.pi * (v - 0.5)
        ring = power(max(math.cos(theta), 0.0), flatness) if 0 < v < 1 else 0.0
        return (0.5 * size[0] * ring * power(math.cos(phi), corner), 0.5 * size[1] * power(math.sin(theta), flatness),
                -0.5 * size[2] * ring * power(math.sin(phi), corner))

    rows = [[at(i / around, j / along) for j in range(along + 1)] for i in range(around)]
    return Mesh().grid(rows, closed=True)


def round_profile(width, height, sides):
    """An ellipse to sweep."""
    angles = [2 * math.pi * k / sides for k in range(sides)]
    return [(0.5 * width * math.cos(a), 0.5 * height * math.sin(a)) for a in angles]


def tube(path, thickness, up, sides=10, closed=False):
    return Mesh().sweep(path, round_profile(thickness, thickness, sides), up, closed, smooth=True)


def cup(radius, height, wall, around, foot=0.8):
    """A vessel with a wall, standing on y = 0: foot is its radius below, as a share."""
    low = radius * foot
    return Mesh().lathe([(0, 0), (low * 0.9, 0), (low, 0.04 * height), (radius, height - wall / 2), (radius - wall / 2, height),
                         (radius - wall, height - wall / 2), (low - wall, wall), (0, wall)], around)
