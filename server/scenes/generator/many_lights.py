"""A courtyard at night."""
import math

from .scene import Scene, rounded


def many_lights():
    """A courtyard at night under strings of 1 000 bulbs, each its own light."""
    s = Scene(title="A courtyard under a thousand bulbs")
    s.material("stone", [0.42, 0.40, 0.37])
    s.material("plaster", [0.62, 0.55, 0.45])
    s.material("wood", [0.34, 0.21, 0.12], roughness=0.55, specular=0.8)
    s.material("cloth", [0.74, 0.72, 0.68])
    s.material("iron", [0.10, 0.10, 0.11], roughness=0.5, specular=0.8)
    s.material("marble", [0.76, 0.74, 0.70], roughness=0.4, specular=0.7)
    s.mesh("ground-mesh", "quad", [26, 0, 26])
    s.object("ground", "ground-mesh", "stone", (0, 0, 0))
    s.box("wall-north", [24, 6, 0.4], "plaster", (0, 3, -11))
    s.box("wall-west", [0.4, 6, 22], "plaster", (-12, 3, 0))
    s.box("wall-east", [0.4, 6, 22], "plaster", (12, 3, 0))
    s.mesh("column", "cylinder", [0.5, 3.6, 0.5], segments=[32, 1])
    s.mesh("statue-mesh", "figure", [1.0, 2.4, 1.0])
    s.box("statue-plinth", [1.3, 0.9, 1.3], "stone", (0, 0.45, -3.5))
    s.object("statue", "statue-mesh", "marble", (0, 0.9 + 1.2, -3.5))
    for k in range(7):
        x = -9 + 3 * k
        s.object(f"column-{k}", "column", "plaster", (x, 1.8, -9.2))
    s.box("arcade", [20, 0.5, 1.0], "plaster", (0, 3.85, -9.2))
    s.mesh("table-top", "cylinder", [1.3, 0.05, 1.3], segments=[48, 1])
    s.mesh("table-leg", "cylinder", [0.1, 0.72, 0.1], segments=[20, 1])
    s.mesh("stool", "cylinder", [0.38, 0.46, 0.38], segments=[24, 1])
    n = 0
    for ix in range(4):
        for iz in range(3):
            x, z = -7.2 + 4.8 * ix + (0.6 if iz % 2 else 0), -5.5 + 4.0 * iz
            if abs(x) < 2 and z < -2:
                continue
            s.object(f"table-{n}", "table-top", "cloth", (x, 0.75, z))
            s.object(f"table-{n}-leg", "table-leg", "iron", (x, 0.36, z))
            for k in range(4):
                a = math.radians(45 + 90 * k + 11 * n)
                s.object(f"table-{n}-stool-{k}", "stool", "wood", (x + 1.0 * math.cos(a), 0.23, z + 1.0 * math.sin(a)))
            n += 1
    # strings: 20 catenaries of 50 bulbs between the west and the east wall
    colors = ([1.0, 0.72, 0.42], [1.0, 0.55, 0.28], [1.0, 0.85, 0.62], [1.0, 0.40, 0.22], [0.95, 0.9, 0.8])
    for row in range(20):
        z = -10 + row
        for k in range(50):
            u = (k + 0.5) / 50
            x = -11.7 + 23.4 * u
            sag = 1.3 + 0.5 * math.sin(row * 1.7)
            y = 5.2 - sag * 4 * u * (1 - u) + 0.05 * math.sin(13.7 * k + row)
            s.add("light", f"bulb-{row:02d}-{k:02d}", kind="sphere", position=rounded((x, y, z)), radius=0.035,
                  flux_lm=26 + 10 * ((k * 7 + row * 3) % 5), color=colors[(k * 3 + row * 5) % 5], group=f"string-{row:02d}")
    s.add("light", "night-sky", kind="environment", luminance_cd_m2=0.06, color=[0.35, 0.5, 1.0], group="sky")
    s.add("camera", "main", position=[5.2, 1.9, 8.6], target=[-1.2, 1.9, -4.0], up=[0, 1, 0], vfov_deg=52)
    s.op("set", id="render", path="/exposure_ev", value=4.6)
    return s
