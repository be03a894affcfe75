"""Runs inside Blender: builds a lumend scene for Cycles and renders it to a linear EXR in cd/m2. See compare.py."""
import json
import math
import sys

import bpy
from mathutils import Matrix, Vector

scene_file, obj_file, out_file, size, spp = sys.argv[sys.argv.index("--") + 1:]
LUMINANCE = (0.2126, 0.7152, 0.0722)  # Rec.709

records = {}
with open(scene_file, encoding="utf-8") as f:
    for line in f:
        if line.startswith("#") or not line.strip():
            continue
        op = json.loads(line)
        if op.get("op") == "add":
            records[op["id"]] = op


def emission_material(name, color, luminance, one_sided):
    """Radiance with luminance in cd/m2; black seen from behind when one_sided."""
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    nodes, links = m.node_tree.nodes, m.node_tree.links
    nodes.clear()
    out = nodes.new("ShaderNodeOutputMaterial")
    emit = nodes.new("ShaderNodeEmission")
    emit.inputs["Color"].default_value = (*color, 1)
    emit.inputs["Strength"].default_value = luminance
    if not one_sided:
        links.new(emit.outputs[0], out.inputs["Surface"])
        return m
    black = nodes.new("ShaderNodeBsdfDiffuse")
    black.inputs["Color"].default_value = (0, 0, 0, 1)
    mix = nodes.new("ShaderNodeMixShader")
    facing = nodes.new("ShaderNodeNewGeometry")
    links.new(facing.outputs["Backfacing"], mix.inputs[0])
    links.new(emit.outputs[0], mix.inputs[1])
    links.new(black.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], out.inputs["Surface"])
    return m


def diffuse_material(record):
    if record.get("metallic", 0) or record.get("specular", 1) or record.get("transmission", 0) or record.get("emission_cd_m2", 0):
        raise SystemExit(f"cycles_scene: material {record['id']} is not purely diffuse")
    m = bpy.data.materials.new(record["id"])
    m.use_nodes = True
    nodes, links = m.node_tree.nodes, m.node_tree.links
    nodes.clear()
    out = nodes.new("ShaderNodeOutputMaterial")
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*record["base_color"], 1)
    diffuse.inputs["Roughness"].default_value = 0
    links.new(diffuse.outputs[0], out.inputs["Surface"])
    return m


def planckian_rgb(kelvin):
    """The colour lumend gives a light of this temperature, read from lumend-bench export's comment lines."""
    with open(obj_file, encoding="utf-8") as f:
        for line in f:
            if line.startswith(f"# cct {kelvin:g} "):
                return tuple(float(v) for v in line.split()[3:6])
    raise SystemExit(f"cycles_scene: {obj_file} does not say what {kelvin} K looks like")


def light_color(record):
    if "cct_k" in record:
        return planckian_rgb(record["cct_k"])
    color = record.get("color", [1, 1, 1])
    y = sum(c * w for c, w in zip(color, LUMINANCE))
    return tuple(c / y for c in color)


def add_mesh(name, vertices, faces, material, smooth=False):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material)
    if smooth:
        mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    bpy.context.collection.objects.link(bpy.data.objects.new(name, mesh))


def add_quad_light(r):
    p, u, v = Vector(r["position"]), Vector(r["u"]), Vector(r["v"])
    luminance = r["luminance_cd_m2"] if "luminance_cd_m2" in r else r["flux_lm"] / (math.pi * u.cross(v).length)
    corners = [p - u / 2 - v / 2, p + u / 2 - v / 2, p + u / 2 + v / 2, p - u / 2 + v / 2]
    add_mesh(r["id"], corners, [(0, 1, 2, 3)], emission_material(r["id"], light_color(r), luminance, True))


def add_disc_light(r):
    p, n = Vector(r["position"]), Vector(r["direction"]).normalized()
    luminance = r["luminance_cd_m2"] if "luminance_cd_m2" in r else r["flux_lm"] / (math.pi * math.pi * r["radius"] ** 2)
    t = n.orthogonal().normalized()
    b = n.cross(t)
    ring = [p + (t * math.cos(a) + b * math.sin(a)) * r["radius"] for a in (2 * math.pi * k / 512 for k in range(512))]
    add_mesh(r["id"], ring, [tuple(range(512))], emission_material(r["id"], light_color(r), luminance, True))


def add_sphere_light(r):
    area = 4 * math.pi * r["radius"] ** 2
    luminance = r["luminance_cd_m2"] if "luminance_cd_m2" in r else r["flux_lm"] / (math.pi * area)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, radius=r["radius"], location=r["position"])
    ball = bpy.context.object
    ball.data.materials.append(emission_material(r["id"], light_color(r), luminance, False))
    bpy.ops.object.shade_smooth()


for o in list(bpy.data.objects):
    bpy.data.objects.remove(o)
for r in records.values():
    if r["type"] == "material":
        diffuse_material(r)
before = set(bpy.data.objects)
# OBJ is Y up, like lumend; the whole scene stays so (no conversion), and the camera is placed in the same frame.
bpy.ops.wm.obj_import(filepath=obj_file, forward_axis="Y", up_axis="Z", validate_meshes=False, import_vertex_groups=False)
for o in set(bpy.data.objects) - before:
    wanted = o.data.materials[0].name.split(".")[0] if o.data.materials else None
    o.data.materials.clear()
    o.data.materials.append(bpy.data.materials[wanted])
lights = {"quad": add_quad_light, "disc": add_disc_light, "sphere": add_sphere_light}
for r in records.values():
    if r["type"] == "light":
        if r["kind"] not in lights:
            raise SystemExit(f"cycles_scene: light {r['id']} of kind {r['kind']} has no exact equal in Cycles")
        lights[r["kind"]](r)

c = records["main"]
eye, target, up = (Vector(c[k]) for k in ("position", "target", "up"))
back = (eye - target).normalized()
right = up.cross(back).normalized()
m = Matrix.Identity(4)
for i in range(3):
    m[i][0], m[i][1], m[i][2], m[i][3] = right[i], back.cross(right)[i], back[i], eye[i]
camera = bpy.data.objects.new("main", bpy.data.cameras.new("main"))
camera.matrix_world = m
camera.data.sensor_fit = "VERTICAL"
camera.data.angle = math.radians(c["vfov_deg"])
camera.data.clip_start = 1e-3
bpy.context.collection.objects.link(camera)

s = bpy.context.scene
s.camera = camera
s.world = bpy.data.worlds.new("black")
s.world.use_nodes = True
s.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
s.render.engine = "CYCLES"
s.render.resolution_x, s.render.resolution_y = (int(v) for v in size.split("x"))
s.render.resolution_percentage = 100
s.render.image_settings.file_format = "OPEN_EXR"
s.render.image_settings.color_depth = "32"
s.render.filepath = out_file
s.view_settings.view_transform = "Raw"
k = s.cycles
k.device, k.samples, k.use_adaptive_sampling, k.use_denoising = "CPU", int(spp), False, False
k.max_bounces = k.diffuse_bounces = k.glossy_bounces = k.transmission_bounces = 32
k.sample_clamp_direct = k.sample_clamp_indirect = 0  # 0: off
k.light_sampling_threshold = 0
k.pixel_filter_type = "BOX"
k.seed = 1
bpy.ops.render.render(write_still=True)
