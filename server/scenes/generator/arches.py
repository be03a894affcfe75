"""Arches, walls with arched openings, ribs and vaults."""
import math

from .mesh import Mesh, smooth_runs, unit


def arch_curve(half, rise, steps):
    """From (half, 0) over the top to (-half, 0). rise up to half: an ellipse, round where equal; above, pointed: two arcs
    with their centres on the springing line."""
    if rise <= half:
        angles = [math.pi * k / steps for k in range(steps)]
        return [(half * math.cos(a), rise * math.sin(a)) for a in angles] + [(-half, 0.0)]
    radius = (half * half + rise * rise) / (2 * half)
    top = math.asin(rise / radius)
    angles = [top * 2 * k / steps for k in range(steps // 2 + 1)]
    right = [(half - radius + radius * math.cos(a), radius * math.sin(a)) for a in angles[:-1]] + [(0.0, rise)]
    return right + [(-x, y) for x, y in reversed(right[:-1])]


def arch_panel(width, top, opening, depth, steps=16):
    """A wall of that width from y = 0 to top, with an arched opening = (half width, springing height, rise): both faces
    and the inside of the opening. Its middle is at x = z = 0."""
    half, spring, rise = opening
    arch = [(x, y + spring) for x, y in arch_curve(half, rise, steps)]
    # the springing points meet the upper corners, too
    inner = [(half, 0), (half, spring)] + arch + [(-half, spring), (-half, 0)]
    outer = [(x / half * width / 2, top) for x, _ in arch]
    outer = [(width / 2, 0), (width / 2, spring)] + outer + [(-width / 2, spring), (-width / 2, 0)]
    mesh = Mesh()
    z = depth / 2
    mesh.grid([[(*a, z), (*b, z)] for a, b in zip(outer, inner)], normal=(0, 0, 1))
    mesh.grid([[(*b, -z), (*a, -z)] for a, b in zip(outer, inner)], normal=(0, 0, -1))
    jambs = [inner[:2], inner[-2:]] if spring else []
    for run in jambs + smooth_runs(arch):
        mesh.grid([[(*p, z), (*p, -z)] for p in run])
    return mesh


def moulding(half, rise, profile, steps=20, legs=0.0):
    """A profile = (outward from the arch, along z), counter-clockwise, carried along an arch in the xy plane and down its
    straight legs."""
    curve = arch_curve(half, rise, steps)
    if legs:
        curve = [(half, -legs)] + curve + [(-half, -legs)]
    rows = []
    for i, (x, y) in enumerate(curve):
        ahead, behind = curve[min(i + 1, len(curve) - 1)], curve[max(i - 1, 0)]
        d = unit((ahead[0] - behind[0], ahead[1] - behind[1], 0))
        rows.append((x, y, d[1], -d[0]))
    mesh = Mesh()
    for run in smooth_runs(profile, closed=True):
        mesh.grid([[(x + a * out_x, y + a * out_y, b) for a, b in run] for x, y, out_x, out_y in rows])
    return mesh


def groin_vault(width, length, rise, steps=16, across=6):
    """Two barrels crossing over a bay of width (x) by length (z), springing at y = 0: four webs, seen from below. Both
    follow one curve, stretched, so that they meet on the diagonals."""
    curve = arch_curve(1.0, rise / (length / 2), steps)
    curve = [(t, y * length / 2) for t, y in curve]
    mesh = Mesh()
    for sign in (1, -1):
        for along_x in (False, True):
            rows = []
            for t, y in curve:
                row = []
                for k in range(across + 1):
                    s = sign * (1 + (abs(t) - 1) * k / across)  # from the wall to the diagonal
                    x, z = (t, s) if along_x else (s, t)
                    row.append((x * width / 2, y, z * length / 2))
                rows.append(row)
            mesh.grid(rows if along_x == (sign > 0) else rows[::-1])
    return mesh


def diagonal_rib(width, length, rise, profile, steps=16):
    """Below one groin of the vault of the same measures, from corner (+, +) to (-, -)."""
    curve = arch_curve(1.0, rise / (length / 2), steps)
    path = [(t * width / 2, y * length / 2, t * length / 2) for t, y in curve]
    return Mesh().sweep(path, profile, (0, 1, 0))
