"""1 to 9 bunnies in a box. They are of one size, so that only their number differs (6.3.2)."""
from .cornell import cornell_room
from .scene import Scene

HEIGHT = 1.15
COLORS = ([0.74, 0.70, 0.64], [0.62, 0.40, 0.24], [0.30, 0.38, 0.52], [0.70, 0.54, 0.26], [0.52, 0.28, 0.30],
          [0.34, 0.46, 0.34], [0.66, 0.62, 0.66], [0.44, 0.32, 0.26], [0.60, 0.52, 0.44])
# x, z and where it looks, degrees about y
PLACES = {
    1: ((0.1, -0.1, 28),),
    2: ((-0.75, -0.45, 36), (0.75, 0.25, -30)),
    4: ((-0.8, -0.85, 20), (0.8, -0.7, -40), (-0.75, 0.75, 58), (0.85, 0.8, -14)),
    9: tuple((1.22 * (k % 3 - 1), 1.22 * (k // 3 - 1), (k * 47 + 10) % 100 - 50) for k in range(9)),
}


def place(n, k, lift=0.0):
    x, z, _ = PLACES[n][k]
    return (x, HEIGHT / 2 + lift, z)


def bunnies(n):
    s = Scene(title="A bunny in a box" if n == 1 else f"{n} bunnies in a box")
    cornell_room(s)
    s.mesh("bunny-mesh", "bunny", [0.495 * HEIGHT, HEIGHT, 0.805 * HEIGHT])
    for k, (_, _, turn) in enumerate(PLACES[n], 1):
        s.material(f"fur-{k}", COLORS[k - 1])
        s.object(f"bunny-{k}", "bunny-mesh", f"fur-{k}", place(n, k - 1), (0, turn, 0))
    s.add("light", "ceiling-panel", kind="quad", position=[0, 3.98, 0], u=[1.3, 0, 0], v=[0, 0, 1.05], flux_lm=11000,
          cct_k=3500, group="ceiling")
    s.add("light", "globe", kind="sphere", position=[-1.75, 3.2, 1.6], radius=0.14, flux_lm=1800, cct_k=2400, group="globe")
    s.camera("main", [0, 2.35, 5.5], [0, 1.25, -0.3], 41)
    s.op("set", id="render", path="/exposure_ev", value=7.6)
    return s
