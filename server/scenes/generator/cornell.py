"""Cornell boxes, and the room whose light is known."""
from .scene import Scene


def cornell_room(s, size=4.0):
    """A Cornell box scaled up to a room: red on the left, green on the right, open towards the camera."""
    h = size / 2
    s.material("white", [0.74, 0.73, 0.70])
    s.material("red", [0.61, 0.06, 0.05])
    s.material("green", [0.12, 0.42, 0.09])
    s.mesh("wall", "quad", [size, 0, size])
    s.object("floor", "wall", "white", (0, 0, 0))
    s.object("ceiling", "wall", "white", (0, size, 0), (180, 0, 0))
    s.object("back-wall", "wall", "white", (0, h, -h), (90, 0, 0))
    s.object("left-wall", "wall", "red", (-h, h, 0), (0, 0, -90))
    s.object("right-wall", "wall", "green", (h, h, 0), (0, 0, 90))


def cornell_statues(s):
    """Two statues of 24 000 triangles each, one mesh: the complexity of the thesis' Cornell scene (7.2.1)."""
    s.material("marble", [0.78, 0.76, 0.72])
    s.material("terracotta", [0.66, 0.36, 0.20])
    s.material("plinth", [0.55, 0.53, 0.50])
    s.mesh("statue", "figure", [0.9, 2.1, 0.9])
    s.box("tall-plinth", [1.1, 0.75, 1.1], "plinth", (-0.8, 0.375, -0.75), (0, 18, 0))
    s.object("tall-statue", "statue", "marble", (-0.8, 0.75 + 1.05, -0.75), (0, 18, 0))
    s.box("short-plinth", [0.95, 0.25, 0.95], "plinth", (0.85, 0.125, 0.45), (0, -16, 0))
    s.object("short-statue", "statue", "terracotta", (0.85, 0.25 + 0.819, 0.45), (0, -28, 0), (0.78, 0.78, 0.78))


def cornell_camera(s):
    s.add("camera", "main", position=[0, 2.0, 7.4], target=[0, 1.95, 0], up=[0, 1, 0], vfov_deg=39)


def cornell():
    s = Scene(title="Cornell box with two statues")
    cornell_room(s)
    cornell_statues(s)
    s.add("light", "ceiling-panel", kind="quad", position=[0, 3.98, 0], u=[1.3, 0, 0], v=[0, 0, 1.05], flux_lm=11000,
          cct_k=3500, group="ceiling")
    s.add("light", "globe", kind="sphere", position=[-0.05, 0.30, 0.75], radius=0.14, flux_lm=900, cct_k=2400, group="globe")
    cornell_camera(s)
    s.op("set", id="render", path="/exposure_ev", value=7.6)
    return s


def cornell_indirect():
    s = Scene(title="Cornell box lit only by what its ceiling reflects")
    cornell_room(s)
    cornell_statues(s)
    s.material("shade", [0.30, 0.27, 0.24])
    s.mesh("bowl", "cylinder", [0.9, 0.22, 0.9], segments=[48, 1])
    s.object("uplight-bowl", "bowl", "shade", (0, 2.75, 0))
    s.mesh("rod", "cylinder", [0.03, 1.2, 0.03], segments=[16, 1])
    s.object("uplight-rod", "rod", "shade", (0, 3.4, 0))
    s.add("light", "uplight", kind="disc", position=[0, 2.87, 0], direction=[0, 1, 0], radius=0.38, flux_lm=16000, cct_k=3000,
          group="uplight")
    cornell_camera(s)
    s.op("set", id="render", path="/exposure_ev", value=7.2)
    return s


def cornell_media():
    """A narrow beam through fog: the air itself is lit, and what the statues hide is not."""
    s = Scene(title="Cornell box full of fog, lit by a beam")
    cornell_room(s)
    cornell_statues(s)
    s.material("shade", [0.12, 0.12, 0.13])
    s.mesh("can", "cylinder", [0.26, 0.34, 0.26], segments=[48, 1])
    s.object("beam-can", "can", "shade", (1.15, 3.80, -0.5), (0, 0, -35))
    s.add("light", "beam", kind="spot", position=[1.03, 3.63, -0.5], direction=[-0.70, -1, -0.05], inner_cone_deg=11,
          outer_cone_deg=19, intensity_cd=11000, cct_k=3800, group="beam")
    s.add("light", "globe", kind="sphere", position=[-0.05, 0.30, 0.75], radius=0.14, flux_lm=1400, cct_k=2400, group="globe")
    s.add("medium", "fog", sigma_s=[0.11, 0.11, 0.11], sigma_a=[0.004, 0.004, 0.004], g=0.35,
          box={"min": [-2, 0, -2], "max": [2, 4, 2]})
    cornell_camera(s)
    return s


def wobble():
    """moves.py bends the column: a mesh that deforms (6.3.2)."""
    s = Scene(title="A column in a box, to be bent by a sine wave")
    cornell_room(s)
    s.material("coral", [0.78, 0.42, 0.30])
    s.material("plinth", [0.55, 0.53, 0.50])
    s.mesh("column-mesh", "wobble", [1.7, 2.6, 1.1], param=[0.35, 1, 0, 0], deforming=True)
    s.object("column", "column-mesh", "coral", (-0.15, 0.2 + 1.3, -0.35))
    s.box("column-plinth", [1.9, 0.2, 1.3], "plinth", (-0.15, 0.1, -0.35))
    s.box("stone", [0.7, 0.55, 0.7], "white", (1.2, 0.275, 0.75), (0, 24, 0))
    s.add("light", "ceiling-panel", kind="quad", position=[0, 3.98, 0], u=[1.3, 0, 0], v=[0, 0, 1.05], flux_lm=11000,
          cct_k=3500, group="ceiling")
    s.add("light", "globe", kind="sphere", position=[-1.25, 0.35, 0.95], radius=0.14, flux_lm=900, cct_k=2400, group="globe")
    cornell_camera(s)
    s.op("set", id="render", path="/exposure_ev", value=7.6)
    return s


def furnace():
    """Every surface emits 1 cd/m2 and reflects one half: L = 1 / (1 - 0.5) = 2 cd/m2 in every direction, everywhere."""
    s = Scene(title="White furnace: every pixel must be 2 cd/m2")
    s.material("glow", [0.5, 0.5, 0.5], emission_cd_m2=1)
    s.mesh("side", "quad", [2, 0, 2])
    for name, at, turn in (("floor", (0, -1, 0), (0, 0, 0)), ("ceiling", (0, 1, 0), (180, 0, 0)),
                           ("back", (0, 0, -1), (90, 0, 0)), ("front", (0, 0, 1), (-90, 0, 0)),
                           ("left", (-1, 0, 0), (0, 0, -90)), ("right", (1, 0, 0), (0, 0, 90))):
        s.object(name, "side", "glow", at, turn)
    s.mesh("ball-mesh", "sphere", [0.6, 0.6, 0.6], segments=[48, 24])
    s.object("ball", "ball-mesh", "glow", (0.2, -0.3, -0.3))
    s.add("camera", "main", position=[-0.5, 0.3, 0.9], target=[0.1, -0.2, -0.3], up=[0, 1, 0], vfov_deg=60)
    s.op("set", id="render", path="/exposure_ev", value=1.5)
    s.op("set", id="render", path="/tone_map", value="none")
    return s
