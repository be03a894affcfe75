"""Finds where four lamps must hang for the most even light on a work plane.

usage: python3 clients/python/examples/even_light.py 'http://127.0.0.1:9460/#t=TOKEN' [picture.png]

The server must have a scene without objects (`lumend --scene clients/python/examples/empty.jsonl`): a room of 6 x 4 x 2.8 m
is put into it, with four lamps in two rows and a sensor over the work plane. Then the rows and the lamps within them are
moved apart, one at a time, by golden sections, and the sensor says how even it is: Uo, the least illuminance over the mean.
What is found stays in the scene: open the same URL in a browser, and drag a lamp.
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import lumend

WIDTH, DEPTH, HEIGHT = 6.0, 4.0, 2.8  # m, of the room
WALL = 0.1
LAMPS = [(x, z) for x in (-1, 1) for z in (-1, 1)]
GOLDEN = 0.6180339887
ROUNDS, STEPS = 2, 5
ENOUGH = 0.015  # standard error of Uo: below it the next place is tried


def build(edit):
    edit.add_mesh("box", shape="box")
    edit.add_material("paint", base_color=[0.7, 0.7, 0.7], specular=0)
    edit.add_material("carpet", base_color=[0.2, 0.2, 0.2], specular=0)
    half = WALL / 2
    for name, at, size in (("floor", [0, -half, 0], [WIDTH, WALL, DEPTH]),
                           ("ceiling", [0, HEIGHT + half, 0], [WIDTH, WALL, DEPTH]),
                           ("west", [-WIDTH / 2 - half, HEIGHT / 2, 0], [WALL, HEIGHT, DEPTH]),
                           ("east", [WIDTH / 2 + half, HEIGHT / 2, 0], [WALL, HEIGHT, DEPTH]),
                           ("north", [0, HEIGHT / 2, -DEPTH / 2 - half], [WIDTH, HEIGHT, WALL]),
                           ("south", [0, HEIGHT / 2, DEPTH / 2 + half], [WIDTH, HEIGHT, WALL])):
        edit.add_object(name, mesh="box", material="carpet" if name == "floor" else "paint",
                        transform={"translate": at, "scale": size})
    for i in range(len(LAMPS)):
        edit.add_light(f"lamp-{i + 1}", kind="disc", radius=0.15, flux_lm=2500, direction=[0, -1, 0])
    edit.add_sensor("work-plane", kind="grid", position=[0, 0.75, 0], u=[WIDTH - 1, 0, 0], v=[0, 0, DEPTH - 1],
                    spacing_m=0.5, target_lx=300, target_uo=0.6)
    edit.add_camera("main", position=[-WIDTH / 2 + 0.2, 2.2, DEPTH / 2 - 0.2], target=[0.6, 0.9, -0.6], vfov_deg=75)


def hang(edit, apart):
    for i, (x, z) in enumerate(LAMPS):
        edit.set(f"lamp-{i + 1}", position=[x * apart[0] / 2, HEIGHT - 0.02, z * apart[1] / 2])


def measure(session, apart):
    with session.edit() as edit:
        hang(edit, apart)
    value = session.sensor("work-plane", enough=lambda value: value["uo_stderr"] < ENOUGH)
    print(f"{apart[0]:5.2f} m, {apart[1]:5.2f} m apart: Uo {value['uo']:.3f} +/- {value['uo_stderr']:.3f}, "
          f"mean {value['em_lx']:.0f} lx", flush=True)
    return value["uo"]


def best_along(session, apart, axis, low, high):
    """Golden sections: each step measures one new place and leaves 0.618 of the interval."""
    def uo(x):
        apart[axis] = x
        return measure(session, apart)
    a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    uo_a, uo_b = uo(a), uo(b)
    for _ in range(STEPS - 2):
        if uo_a > uo_b:
            high, b, uo_b = b, a, uo_a
            a = high - GOLDEN * (high - low)
            uo_a = uo(a)
        else:
            low, a, uo_a = a, b, uo_b
            b = low + GOLDEN * (high - low)
            uo_b = uo(b)
    apart[axis] = a if uo_a > uo_b else b


def run(url, picture=None):
    """Uo before and after."""
    with lumend.connect(url, client="even-light") as session:
        if any(record["type"] == "object" for record in session.scene().values()):
            sys.exit("there are objects in this scene already: start lumend with --scene clients/python/examples/empty.jsonl")
        apart = [1.0, 1.0]
        with session.edit() as edit:
            build(edit)
            hang(edit, apart)
        first = measure(session, apart)
        for _ in range(ROUNDS):
            best_along(session, apart, 0, 1.0, WIDTH - 0.6)
            best_along(session, apart, 1, 1.0, DEPTH - 0.6)
        last = measure(session, apart)
        print(f"Uo {first:.2f} before, {last:.2f} now: lamps {apart[0]:.2f} m and {apart[1]:.2f} m apart")
        if picture:
            with session.view(600, 400, spp=16) as view:
                view.picture().save_png(picture)
        return first, last


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    try:
        run(*sys.argv[1:])
    except (lumend.Disconnected, lumend.Refused, TimeoutError, ValueError) as error:
        sys.exit(f"{error}")
