"""An office for two, behind blinds."""
import math

from .scene import Scene, rounded


def desk_chair(s, name, x, z, turn):
    c, t = math.cos(math.radians(turn)), math.sin(math.radians(turn))

    def place(dx, y, dz):
        return (x + c * dx + t * dz, y, z - t * dx + c * dz)

    s.mesh("cushion", "sphere", [0.5, 0.12, 0.48], segments=[32, 16])
    s.mesh("back-rest", "sphere", [0.46, 0.62, 0.09], segments=[32, 16])
    s.mesh("post", "cylinder", [0.06, 0.36, 0.06], segments=[20, 1])
    s.mesh("castor", "sphere", [0.07, 0.07, 0.07], segments=[16, 8])
    s.mesh("arm-ring", "torus", [0.24, 0.04, 0.30], segments=[32, 10])
    s.object(f"{name}-seat", "cushion", "fabric", place(0, 0.46, 0), (0, turn, 0))
    s.object(f"{name}-back", "back-rest", "fabric", place(0, 0.84, 0.24), (-8, turn, 0))
    s.object(f"{name}-post", "post", "steel", place(0, 0.24, 0))
    for k in range(5):
        a = 2 * math.pi * k / 5
        s.box(f"{name}-leg-{k}", [0.30, 0.03, 0.04], "steel", place(0.15 * math.cos(a), 0.075, -0.15 * math.sin(a)),
              (0, turn + math.degrees(a), 0))
        s.object(f"{name}-castor-{k}", "castor", "black", place(0.29 * math.cos(a), 0.035, -0.29 * math.sin(a)))
    for side in (-1, 1):
        s.object(f"{name}-arm-{'l' if side < 0 else 'r'}", "arm-ring", "black", place(0.27 * side, 0.60, 0.02), (0, turn, 90))


def desk_with_things(s, name, x, z, lamp_cd, lamp_on=True):
    """A desk along x, its sitter on the +z side."""
    s.box(f"{name}-top", [1.6, 0.035, 0.8], "oak", (x, 0.735, z))
    for dx in (-0.74, 0.74):
        for dz in (-0.34, 0.34):
            s.mesh("desk-leg", "cylinder", [0.05, 0.72, 0.05], segments=[20, 1])
            s.object(f"{name}-leg-{'l' if dx < 0 else 'r'}{'b' if dz < 0 else 'f'}", "desk-leg", "steel",
                     (x + dx, 0.36, z + dz))
    s.box(f"{name}-screen", [0.62, 0.36, 0.02], "black", (x - 0.05, 1.08, z - 0.22), (-4, 0, 0))
    s.box(f"{name}-picture", [0.59, 0.33, 0.004], "screen", (x - 0.05, 1.08, z - 0.2085), (-4, 0, 0))
    s.box(f"{name}-screen-post", [0.06, 0.20, 0.03], "steel", (x - 0.05, 0.84, z - 0.25))
    s.box(f"{name}-screen-foot", [0.24, 0.012, 0.18], "steel", (x - 0.05, 0.759, z - 0.24))
    s.box(f"{name}-keyboard", [0.44, 0.018, 0.14], "black", (x - 0.05, 0.762, z + 0.12))
    s.mesh("mug", "cylinder", [0.08, 0.1, 0.08], segments=[40, 1])
    s.object(f"{name}-mug", "mug", "ceramic", (x + 0.42, 0.803, z + 0.10))
    s.mesh("mug-ring", "torus", [0.07, 0.012, 0.07], segments=[32, 12])
    s.object(f"{name}-mug-ring", "mug-ring", "ceramic", (x + 0.465, 0.805, z + 0.10), (90, 0, 0))
    for k in range(4):
        s.box(f"{name}-book-{k}", [0.16, 0.025, 0.22], ("paper-red", "paper-blue", "paper-white", "paper-green")[k],
              (x - 0.62, 0.766 + 0.026 * k, z - 0.1), (0, 7 * k - 12, 0))
    # lamp: foot, two arms, a shade and the light that hangs in it
    s.mesh("lamp-foot", "cylinder", [0.18, 0.02, 0.18], segments=[40, 1])
    s.mesh("lamp-arm", "cylinder", [0.016, 0.38, 0.016], segments=[16, 1])
    s.mesh("lamp-shade", "cone", [0.17, 0.13, 0.17], segments=[48, 1])
    s.object(f"{name}-lamp-foot", "lamp-foot", "lamp-red", (x + 0.62, 0.763, z - 0.22))
    s.object(f"{name}-lamp-arm-low", "lamp-arm", "lamp-red", (x + 0.56, 0.955, z - 0.22), (0, 0, 18))
    s.object(f"{name}-lamp-arm-high", "lamp-arm", "lamp-red", (x + 0.40, 1.235, z - 0.20), (0, 0, 58))
    s.object(f"{name}-lamp-shade", "lamp-shade", "lamp-red", (x + 0.20, 1.31, z - 0.18), (0, 0, 14))
    s.add("light", f"{name}-lamp", kind="spot", position=rounded((x + 0.20, 1.235, z - 0.18)), direction=[-0.22, -1, 0.12],
          inner_cone_deg=32, outer_cone_deg=58, intensity_cd=lamp_cd, cct_k=2700, group="desk-lamps", on=lamp_on)


def office_room(s, slats=31, slat_width=0.05, tilt=28):
    """slats: of the blinds, over the height of the window; tilt: degrees, upwards into the room."""
    s.material("wall-paint", [0.76, 0.75, 0.71])
    s.material("carpet", [0.23, 0.25, 0.29])
    s.material("ceiling-tile", [0.82, 0.82, 0.80])
    s.material("oak", [0.52, 0.34, 0.19], roughness=0.5, specular=1.0)
    s.material("steel", [0.56, 0.57, 0.58], roughness=0.35, metallic=1.0, specular=1.0)
    s.material("black", [0.04, 0.04, 0.045], roughness=0.5, specular=1.0)
    s.material("fabric", [0.10, 0.20, 0.30])
    s.material("ceramic", [0.85, 0.84, 0.80], roughness=0.2, specular=1.0)
    s.material("lamp-red", [0.60, 0.09, 0.06], roughness=0.4, specular=1.0)
    s.material("slat", [0.80, 0.78, 0.72])
    s.material("leaf", [0.09, 0.26, 0.07], roughness=0.6, specular=0.6)
    s.material("pot", [0.48, 0.27, 0.19])
    s.material("screen", [0.02, 0.02, 0.02], emission_color=[0.75, 1.0, 1.5], emission_cd_m2=60)
    for name, color in (("red", [0.55, 0.12, 0.10]), ("blue", [0.12, 0.20, 0.45]), ("white", [0.8, 0.79, 0.74]),
                        ("green", [0.14, 0.34, 0.20])):
        s.material(f"paper-{name}", color)

    w, h, d = 6.0, 2.8, 5.0  # x, y, z
    t = 0.12
    s.box("floor", [w, t, d], "carpet", (0, -t / 2, 0))
    s.box("ceiling", [w, t, d], "ceiling-tile", (0, h + t / 2, 0))
    s.box("wall-back", [w + 2 * t, h, t], "wall-paint", (0, h / 2, -d / 2 - t / 2))
    s.box("wall-front", [w + 2 * t, h, t], "wall-paint", (0, h / 2, d / 2 + t / 2))
    s.box("wall-right", [t, h, d], "wall-paint", (w / 2 + t / 2, h / 2, 0))
    # the window wall, left: sill, lintel, and a pier at each end of a 3.6 m opening
    s.box("window-sill", [t, 0.9, d], "wall-paint", (-w / 2 - t / 2, 0.45, 0))
    s.box("window-lintel", [t, 0.3, d], "wall-paint", (-w / 2 - t / 2, h - 0.15, 0))
    for z, name in ((-2.15, "back"), (2.15, "front")):
        s.box(f"window-pier-{name}", [t, 1.6, 0.7], "wall-paint", (-w / 2 - t / 2, 1.7, z))
    s.box("window-mullion", [0.05, 1.6, 0.05], "steel", (-w / 2 - t / 2, 1.7, 0))
    for name, z in (("back", (-1.8, -0.025)), ("front", (0.025, 1.8))):
        s.pane(f"window-pane-{name}", z, (0.9, 2.5), -w / 2 - t / 2)
    for k in range(slats):
        s.box(f"blind-{k:02d}", [slat_width, 0.003, 3.7], "slat",
              (-w / 2 + 0.06, 0.915 + 0.0535 * 30 / (slats - 1) * k, 0), (0, 0, tilt))

    desk_with_things(s, "desk-a", -1.35, -1.15, 420)
    desk_with_things(s, "desk-b", 1.15, -1.15, 380)
    desk_chair(s, "chair-a", -1.45, -0.25, 12)
    desk_chair(s, "chair-b", 1.20, -0.05, -35)
    for k in range(4):
        s.box(f"shelf-{k}", [1.8, 0.03, 0.32], "oak", (1.6, 0.45 + 0.45 * k, -d / 2 + 0.17))
    for side, x in (("l", 0.7), ("r", 2.5)):
        s.box(f"shelf-side-{side}", [0.03, 1.95, 0.32], "oak", (x, 0.975, -d / 2 + 0.17))
    seed = 7
    for row in range(3):
        x = 0.76
        k = 0
        while x < 2.3:
            seed = (seed * 1103515245 + 12345) % (1 << 31)
            thick, tall = 0.025 + 0.03 * (seed % 97) / 97, 0.22 + 0.12 * (seed // 97 % 89) / 89
            s.box(f"binder-{row}-{k:02d}", [thick, tall, 0.22], ("paper-red", "paper-blue", "paper-white", "paper-green")[seed // 7 % 4],
                  (x + thick / 2, 0.465 + 0.45 * row + tall / 2, -d / 2 + 0.17))
            x += thick + 0.006 + (0.16 if seed % 11 == 0 else 0)
            k += 1
    # a plant in the corner: leaves on a spiral
    s.mesh("pot-mesh", "cylinder", [0.36, 0.34, 0.36], segments=[48, 1])
    s.object("plant-pot", "pot-mesh", "pot", (-2.55, 0.17, -2.1))
    s.mesh("leaf-mesh", "sphere", [0.30, 0.015, 0.10], segments=[16, 6])
    for k in range(26):
        a = k * 137.508
        lift = 0.42 + 0.034 * k
        reach = 0.15 + 0.11 * math.sin(math.pi * k / 26)
        s.object(f"leaf-{k:02d}", "leaf-mesh", "leaf", (-2.55 + reach * math.cos(math.radians(a)), lift, -2.1 - reach * math.sin(math.radians(a))),
                 (0, a, 24 - k * 0.6))
    s.mesh("waste-bin-mesh", "cylinder", [0.28, 0.34, 0.28], segments=[48, 1])
    s.object("waste-bin", "waste-bin-mesh", "steel", (-0.15, 0.17, -1.3))
    s.mesh("clock-rim-mesh", "torus", [0.36, 0.04, 0.36], segments=[64, 16])
    s.object("clock-rim", "clock-rim-mesh", "black", (-0.9, 2.05, -d / 2 + 0.03), (90, 0, 0))
    s.mesh("clock-face-mesh", "disc", [0.32, 0, 0.32], segments=[64, 1])
    s.object("clock-face", "clock-face-mesh", "paper-white", (-0.9, 2.05, -d / 2 + 0.02), (90, 0, 0))
    s.box("clock-hour", [0.012, 0.09, 0.004], "black", (-0.92, 2.08, -d / 2 + 0.035), (0, 0, 30))
    s.box("clock-minute", [0.008, 0.13, 0.004], "black", (-0.85, 2.02, -d / 2 + 0.035), (0, 0, -120))


def office_cameras(s):
    s.add("camera", "main", position=[2.55, 1.75, 2.3], target=[-0.35, 0.95, -1.2], up=[0, 1, 0], vfov_deg=52)
    s.add("camera", "window", position=[1.6, 1.35, 0.9], target=[-3.0, 1.3, -0.5], up=[0, 1, 0], vfov_deg=50)


def office():
    s = Scene(title="An office in the evening sun, behind blinds")
    office_room(s)
    # light: two ceiling panels (dimmed), the desk lamps above, a low sun and the sky outside the window
    for name, x in (("a", -1.35), ("b", 1.35)):
        s.add("light", f"panel-{name}", kind="quad", position=[x, 2.79, -0.4], u=[0.6, 0, 0], v=[0, 0, 1.2],
              flux_lm=1400, cct_k=4000, group="ceiling")
    s.add("light", "sky", kind="environment", luminance_cd_m2=260, cct_k=9000, group="daylight")
    s.add("light", "sun", kind="directional", direction=[0.83, -0.50, -0.30], illuminance_lx=5000, cct_k=3400, group="daylight")
    office_cameras(s)
    s.op("set", id="render", path="/exposure_ev", value=7.4)
    return s


def office_media():
    """The same room without its panels, with wider slats and dusty air: the blinds cut the sun into sheets."""
    s = Scene(title="A dusty office: the blinds cut the sun into sheets")
    office_room(s, 16, 0.09, 4)
    s.add("light", "sky", kind="environment", luminance_cd_m2=300, cct_k=9000, group="daylight")
    s.add("light", "sun", kind="directional", direction=[0.83, -0.50, -0.12], illuminance_lx=30000, cct_k=3600, group="daylight")
    s.add("medium", "dust", sigma_s=[0.09, 0.09, 0.09], sigma_a=[0.001, 0.001, 0.001], g=0.5,
          box={"min": [-3, 0, -2.5], "max": [3, 2.8, 2.5]})
    office_cameras(s)
    return s
