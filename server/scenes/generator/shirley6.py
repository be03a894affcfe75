"""A table and four chairs under one square luminaire: the sixth test scene of Shirley's set, drawn anew."""
from .scene import Frame, Scene


def chair(s, name, at, turn):
    """15 boxes; its sitter looks along -z."""
    f = Frame(s, name, at, turn)
    f.box("seat", [0.44, 0.035, 0.44], "beech", (0, 0.45, 0))
    for side, x in (("l", -0.195), ("r", 0.195)):
        f.box(f"leg-{side}f", [0.04, 0.435, 0.04], "beech", (x, 0.2175, -0.195))
        f.box(f"leg-{side}b", [0.04, 0.94, 0.04], "beech", (x, 0.47, 0.20))
        f.box(f"stretcher-{side}", [0.022, 0.03, 0.36], "beech", (x, 0.18, 0.0))
        f.box(f"rail-{side}", [0.03, 0.06, 0.36], "beech", (x, 0.40, 0.0))
    f.box("stretcher", [0.37, 0.03, 0.022], "beech", (0, 0.18, 0.0))
    f.box("rail", [0.35, 0.06, 0.03], "beech", (0, 0.40, -0.195))
    f.box("crest", [0.43, 0.11, 0.028], "beech", (0, 0.895, 0.20))
    f.box("slat-low", [0.36, 0.05, 0.02], "beech", (0, 0.60, 0.20))
    f.box("slat-high", [0.36, 0.05, 0.02], "beech", (0, 0.73, 0.20))


def table(s):
    f = Frame(s, "table")
    f.box("top", [1.7, 0.045, 1.0], "walnut", (0, 0.7375, 0))
    for side, x in (("l", -0.77), ("r", 0.77)):
        for end, z in (("f", 0.42), ("b", -0.42)):
            f.box(f"leg-{side}{end}", [0.07, 0.715, 0.07], "walnut", (x, 0.3575, z))
        f.box(f"apron-{side}", [0.03, 0.09, 0.77], "walnut", (x, 0.67, 0))
    for end, z in (("f", 0.42), ("b", -0.42)):
        f.box(f"apron-{end}", [1.47, 0.09, 0.03], "walnut", (0, 0.67, z))


def room(s, width=6.0, height=3.0):
    h = width / 2
    s.mesh("square", "quad", [width, 0, width])
    s.mesh("wall", "quad", [width, 0, height])
    s.object("floor", "square", "tiles", (0, 0, 0))
    s.object("ceiling", "square", "plaster", (0, height, 0), (180, 0, 0))
    s.object("back-wall", "wall", "plaster", (0, height / 2, -h), (90, 0, 0))
    s.object("front-wall", "wall", "plaster", (0, height / 2, h), (90, 180, 0))
    s.object("left-wall", "wall", "ochre-wash", (-h, height / 2, 0), (90, 90, 0))
    s.object("right-wall", "wall", "blue-wash", (h, height / 2, 0), (90, -90, 0))


def shirley6():
    s = Scene(title="A table and four chairs under one square luminaire")
    s.material("plaster", [0.73, 0.71, 0.67])
    s.material("blue-wash", [0.24, 0.38, 0.50])
    s.material("ochre-wash", [0.66, 0.46, 0.24])
    s.material("tiles", [0.36, 0.31, 0.27])
    s.material("walnut", [0.32, 0.18, 0.10], roughness=0.45, specular=0.8)
    s.material("beech", [0.60, 0.42, 0.25], roughness=0.6, specular=0.6)
    s.material("frame", [0.25, 0.25, 0.26], roughness=0.6, specular=0.5)
    room(s)
    table(s)
    chair(s, "chair-south", (0.25, 0, 0.80), 8)
    chair(s, "chair-north", (-0.2, 0, -0.72), 180)
    chair(s, "chair-east", (1.32, 0, 0.02), 82)
    chair(s, "chair-west", (-1.55, 0, 0.25), -118)
    for name, size, at in (("l", [0.03, 0.1, 1.06], (-0.515, 2.85, 0)), ("r", [0.03, 0.1, 1.06], (0.515, 2.85, 0)),
                           ("f", [1.0, 0.1, 0.03], (0, 2.85, 0.515)), ("b", [1.0, 0.1, 0.03], (0, 2.85, -0.515))):
        s.box(f"luminaire-{name}", size, "frame", at)
    s.box("luminaire-back", [1.0, 0.02, 1.0], "frame", (0, 2.89, 0))
    s.add("light", "luminaire", kind="quad", position=[0, 2.82, 0], u=[1, 0, 0], v=[0, 0, 1], flux_lm=8000, cct_k=4200,
          group="luminaire")
    s.camera("main", [-2.35, 1.72, 2.35], [0.12, 0.74, -0.15], 49)
    return s
