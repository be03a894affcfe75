"""Binary glTF 2.0: taken apart, and held to what its specification says of containers, buffers and accessors."""
import json
import math
import struct

SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Glb:
    def __init__(self, data):
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data)), (magic, version, length, len(data))
        n_json, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON" and n_json % 4 == 0
        self.json = json.loads(data[20:20 + n_json])
        self.bin = b""
        at = 20 + n_json
        if at < len(data):
            n_bin, kind = struct.unpack_from("<I4s", data, at)
            assert kind == b"BIN\0" and n_bin % 4 == 0 and at + 8 + n_bin == len(data)
            self.bin = data[at + 8:]

    def list(self, name):
        return self.json.get(name, [])

    def lights(self, extension="KHR_lights_punctual"):
        return self.json.get("extensions", {}).get(extension, {}).get("lights", [])

    def view(self, index):
        v = self.list("bufferViews")[index]
        return self.bin[v.get("byteOffset", 0):v.get("byteOffset", 0) + v["byteLength"]]

    def node(self, name):
        """The one with the content: a name may be that of its parent, too."""
        return [n for n in self.list("nodes") if n.get("name") == name][-1]

    def record(self, name):
        for n in self.list("nodes"):
            if n.get("name") == name and "extras" in n:
                return n["extras"]["lumend"]["record"]
        return next(r for r in self.list("scenes")[0]["extras"]["lumend"]["records"] if r["id"] == name)

    def accessor(self, index):
        a = self.list("accessors")[index]
        n = a["count"] * COMPONENTS[a["type"]]
        return struct.unpack_from("<%d%s" % (n, "f" if a["componentType"] == 5126 else "I"),
                                  self.view(a["bufferView"]), a.get("byteOffset", 0))

    def pack(self):
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        body = struct.pack("<I4s", len(text), b"JSON") + text
        if self.bin:
            body += struct.pack("<I4s", len(self.bin), b"BIN\0") + self.bin
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def check(glb):
    """Raises AssertionError where the file is not as the specification says."""
    views = glb.list("bufferViews")
    if views:
        assert glb.list("buffers") == [{"byteLength": len(glb.bin)}]
    spans = []
    for v in views:
        at = v.get("byteOffset", 0)
        assert v["buffer"] == 0 and v["byteLength"] > 0 and at % 4 == 0 and at + v["byteLength"] <= len(glb.bin), v
        spans.append((at, at + v["byteLength"]))
    spans.sort()
    assert all(a[1] <= b[0] for a, b in zip(spans, spans[1:])), "views do not overlap"
    for i, a in enumerate(glb.list("accessors")):
        n = a["count"] * COMPONENTS[a["type"]]
        assert a["count"] > 0 and SIZES[a["componentType"]] * n == views[a["bufferView"]]["byteLength"], a
        if a["componentType"] == 5126:
            assert all(map(math.isfinite, glb.accessor(i))), a
    for mesh in glb.list("meshes"):
        for p in mesh["primitives"]:
            check_primitive(glb, p)
    check_references(glb)


def check_primitive(glb, p):
    accessors = glb.list("accessors")
    position = accessors[p["attributes"]["POSITION"]]
    values = glb.accessor(p["attributes"]["POSITION"])
    for c in range(3):
        assert position["min"][c] == min(values[c::3]) and position["max"][c] == max(values[c::3]), position
    for name, accessor in p["attributes"].items():
        assert accessors[accessor]["count"] == position["count"], name
        if name == "NORMAL":
            n = glb.accessor(accessor)
            assert all(abs(math.hypot(*n[k:k + 3]) - 1) < 0.0006 for k in range(0, len(n), 3)), "normals have length 1"
    indices = glb.accessor(p["indices"])
    assert len(indices) % 3 == 0 and max(indices) < position["count"], "indices are in range"
    assert p["material"] < len(glb.list("materials"))


def check_references(glb):
    parents = {}
    for i, n in enumerate(glb.list("nodes")):
        for child in n.get("children", []):
            assert child not in parents
            parents[child] = i
        for key, where in (("mesh", "meshes"), ("camera", "cameras")):
            assert n.get(key, 0) < max(1, len(glb.list(where)))
        for extension in ("KHR_lights_punctual", "EXT_lights_ies"):
            light = n.get("extensions", {}).get(extension, {}).get("light")
            assert light is None or light < len(glb.lights(extension))
        if "rotation" in n:
            assert abs(math.hypot(*n["rotation"]) - 1) < 1e-6
    assert sorted(glb.list("scenes")[0].get("nodes", [])) == sorted(set(range(len(glb.list("nodes")))) - set(parents))
    for t in glb.list("textures"):
        assert t["source"] < len(glb.list("images")) and t["sampler"] < len(glb.list("samplers"))
    used = set()
    collect(glb.json, used)
    assert used <= set(glb.json.get("extensionsUsed", [])), used
    for image in glb.list("images"):
        assert glb.view(image["bufferView"]).startswith(b"\x89PNG"), image


def collect(value, used):
    if isinstance(value, dict):
        used |= set(value.get("extensions", {}))
        for key, v in value.items():
            if key != "extras":
                collect(v, used)
    elif isinstance(value, list):
        for v in value:
            collect(v, used)
