#!/usr/bin/env python3
"""From `kill -9` to the first picture again, with a large model in the state.

usage: LUMEND=build/release/bin/lumend tests/bench/restart.py [--mib 1024] [--starts 3] [--meshes-only] [--size 600x400]

Makes glTF files of 64 MiB, in turn a height field of 2.6 million triangles and a picture of 4096 x 4096 on a wall, imports
them until the state holds --mib, kills the daemon and starts it again. Prints JSON: bytes of the state and of memory, and
for each start the seconds to the ready line, to an answer, to the first picture of --size (rough or not) and to the first
that has whole samples, with the processors' time until then: others may use the machine.
"""
import argparse
import array
import json
import math
import os
import shutil
import struct
import sys
import tempfile
import time
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "e2e"))
from daemon import Daemon  # noqa: E402
from glb import Glb  # noqa: E402
from wsclient import LAST_TILE, tile_header  # noqa: E402

SIDE = 1150      # of a height field: 1150^2 vertices of 24 bytes, and twice as many triangles of 12
TEXELS = 4096
WAIT_S = 600.0


def glb(body, views, more):
    """views: [(offset, bytes)]"""
    made = Glb.__new__(Glb)
    made.bin = body
    made.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                 "buffers": [{"byteLength": len(body)}],
                 "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": n} for at, n in views], **more}
    return made.pack()


def height_field():
    positions, normals, indices = array.array("f"), array.array("f"), array.array("I")
    for z in range(SIDE):
        wave = math.sin(0.05 * z)
        for x in range(SIDE):
            positions.extend((x / SIDE, 0.05 * wave * math.sin(0.07 * x), z / SIDE))
        normals.extend((0.0, 1.0, 0.0) * SIDE)
    for z in range(SIDE - 1):
        for x in range(z * SIDE, z * SIDE + SIDE - 1):
            indices.extend((x, x + SIDE, x + 1, x + 1, x + SIDE, x + SIDE + 1))
    parts = [bytes(memoryview(p)) for p in (positions, normals, indices)]
    at = [0, len(parts[0]), len(parts[0]) + len(parts[1])]
    return glb(b"".join(parts), list(zip(at, map(len, parts))), {
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": SIDE * SIDE, "type": "VEC3",
                       "min": [0, -1, 0], "max": [1, 1, 1]},
                      {"bufferView": 1, "componentType": 5126, "count": SIDE * SIDE, "type": "VEC3"},
                      {"bufferView": 2, "componentType": 5125, "count": len(indices), "type": "SCALAR"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}]})


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def picture():
    row = b"\0" + os.urandom(4 * TEXELS)
    png = (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", TEXELS, TEXELS, 8, 6, 0, 0, 0)) +
           chunk(b"IDAT", zlib.compress(row * TEXELS, 1)) + chunk(b"IEND", b""))
    corners = struct.pack("<12f8f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 0, 0, 1, 1, 1)
    indices = struct.pack("<6H", 0, 1, 2, 2, 1, 3)
    body = corners + indices + png
    body += bytes(-len(body) % 4)
    return glb(body, [(0, 48), (48, 32), (80, 12), (92, len(png))], {
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
                      {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
                      {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}], "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}]})


def bytes_of(folder):
    return sum(os.path.getsize(os.path.join(at, name)) for at, _, names in os.walk(folder) for name in names)


def fill(daemon, assets, state, o):
    ws = daemon.connect()
    ws.sock.settimeout(WAIT_S)
    field, n = height_field(), 0
    while bytes_of(os.path.join(state, "content")) < o.mib << 20:
        if n % 2 == 0 or o.meshes_only:
            made = bytearray(field)
            struct.pack_into("<f", made, len(made) - 4 * 3 * (2 * SIDE * SIDE), n / 1000)  # a number that no other has
        else:
            made = picture()
        with open(os.path.join(assets, "piece.glb"), "wb") as file:
            file.write(made)
        ws.call("scene.apply", {"ops": [{"op": "import", "id": f"piece-{n}", "asset": "piece.glb",
                                         "transform": {"translate": [n % 4 - 2, 0.2 + n // 4 * 0.3, 0]}}]})
        n += 1
    ws.close()
    return n


def frame(ws, is_wanted):
    while True:
        ws.pump()
        for tile in ws.binaries:
            header = tile_header(tile)
            if header["flags"] & LAST_TILE:
                ws.notify("frame.ack", {"view_id": header["view_id"], "frame_seq": header["frame_seq"]})
                if is_wanted(header):
                    return
        ws.binaries.clear()


def cpu_s(daemon):
    with open(f"/proc/{daemon.process.pid}/stat", encoding="ascii") as stat:
        return sum(map(int, stat.read().rpartition(")")[2].split()[11:13])) / os.sysconf("SC_CLK_TCK")


def start(state, o):
    begin = time.monotonic()
    daemon = Daemon("--state", state, threads=0)
    seconds = {"ready_s": time.monotonic() - begin}
    ws = daemon.connect()
    ws.sock.settimeout(WAIT_S)
    ws.call("view.open", {"size": [int(n) for n in o.size.split("x")], "camera_id": "main", "codec": "jpeg", "stats": False})
    seconds["answer_s"] = time.monotonic() - begin
    frame(ws, lambda header: True)
    seconds["first_frame_s"] = time.monotonic() - begin
    seconds["first_cpu_s"] = cpu_s(daemon)
    frame(ws, lambda header: header["downscale"] == 0)
    seconds["first_whole_frame_s"] = time.monotonic() - begin
    seconds["cpu_s"] = cpu_s(daemon)
    seconds["rss_bytes"] = daemon.rss_bytes()
    kill(daemon)
    return {key: round(value, 3) for key, value in seconds.items()}


def kill(daemon):
    daemon.process.kill()
    daemon.process.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mib", type=int, default=1024)
    parser.add_argument("--starts", type=int, default=3)
    parser.add_argument("--size", default="600x400")
    parser.add_argument("--meshes-only", action="store_true")
    o = parser.parse_args()
    folder = tempfile.mkdtemp(prefix="lumend-restart-")
    try:
        assets, state = os.path.join(folder, "assets"), os.path.join(folder, "state")
        os.mkdir(assets)
        daemon = Daemon("--state", state, "--assets", assets, threads=0)
        n = fill(daemon, assets, state, o)
        kill(daemon)
        print(json.dumps({"pieces": n, "state_bytes": bytes_of(state), "starts": [start(state, o) for _ in range(o.starts)]}))
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
