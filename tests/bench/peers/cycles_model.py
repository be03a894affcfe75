"""Runs inside Blender: renders a glTF model by Cycles through one of its own cameras, with several numbers of samples.

Punctual lights are brought to the unit of emission, candela and lux as they are, from which Blender's importer divides. Writes
OUT/cycles-SPP.exr and OUT/cycles.json: CPU seconds of each render, and of one of a single pixel, which is what reading the
scene into Cycles and building its tree costs. See race.py.

A camera `card:X0,Y,Z0,X1,Z1` (glTF's axes, metres) looks down on a card of white paper at that height which no other light meets
than that of the camera's rays, so that the picture is illuminance / pi of its cells: columns along x, rows along z. See
measure.py."""
import json
import math
import os
import struct
import sys
import time

import bpy
import numpy

numpy.bool = bool  # the importer of Debian's Blender asks for it, its numpy no longer has it

model, camera_end, out, size, exposure, seed, *samples = sys.argv[sys.argv.index("--") + 1:]
LUMENS_PER_WATT = 683.0  # what Blender's importer divides candela and lux by; emission it takes as it is


def rename_materials(path, to):
    """Copies a GLB, each of whose materials is called by its number then. Returns its JSON."""
    with open(path, "rb") as f:
        magic, version, _ = struct.unpack("<4sII", f.read(12))
        n, kind = struct.unpack("<II", f.read(8))
        records = json.loads(f.read(n))
        rest = f.read()
    for i, material in enumerate(records.get("materials", [])):
        material["name"] = f"material-{i}"
    text = json.dumps(records).encode()
    text += b" " * (-len(text) % 4)
    with open(to, "wb") as f:
        f.write(struct.pack("<4sII", magic, version, 20 + len(text) + len(rest)))
        f.write(struct.pack("<II", len(text), kind) + text + rest)
    return records


def fix_lights():
    for light in bpy.data.lights:
        light.energy *= LUMENS_PER_WATT
        if light.type == "SUN":
            light.angle = 0.0
        else:
            light.shadow_soft_size = 0.0


def shine_in_front(tree, shader):
    """Emission from the side alone that faces come from: times 1 - backfacing."""
    strength = shader.inputs["Emission Strength"]
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    front = tree.nodes.new("ShaderNodeMath")
    front.operation = "MULTIPLY_ADD"
    front.inputs[1].default_value = -strength.default_value
    front.inputs[2].default_value = strength.default_value
    tree.links.new(geometry.outputs["Backfacing"], front.inputs[0])
    tree.links.new(front.outputs[0], strength)


def fix_materials(records):
    """What the importer does not know: KHR_materials_specular, of which glTF's default is Blender's 0.5, and emission of one side."""
    for i, record in enumerate(records):
        material = bpy.data.materials.get(f"material-{i}")
        for shader in material.node_tree.nodes if material and material.use_nodes else []:
            if shader.type != "BSDF_PRINCIPLED":
                continue
            extension = record.get("extensions", {}).get("KHR_materials_specular", {})
            shader.inputs["Specular"].default_value = 0.5 * extension.get("specularFactor", 1.0)
            if any(record.get("emissiveFactor", [])) and not record.get("doubleSided", False):
                shine_in_front(material.node_tree, shader)


def lay_card(x0, y, z0, x1, z1):
    """Returns a camera that sees all of it and no more."""
    middle = ((x0 + x1) / 2, -(z0 + z1) / 2, y)  # Blender's z is up
    bpy.ops.mesh.primitive_plane_add(size=1, location=middle)
    card = bpy.context.object
    card.scale = (x1 - x0, z1 - z0, 1)
    card.visible_diffuse = card.visible_glossy = card.visible_transmission = card.visible_shadow = False
    card.visible_volume_scatter = False
    paper = bpy.data.materials.new("paper")
    paper.use_nodes = True
    paper.node_tree.nodes.clear()
    shader = paper.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (1, 1, 1, 1)
    end = paper.node_tree.nodes.new("ShaderNodeOutputMaterial")
    paper.node_tree.links.new(shader.outputs[0], end.inputs["Surface"])
    card.data.materials.append(paper)
    camera = bpy.data.objects.new("card", bpy.data.cameras.new("card"))
    bpy.context.scene.collection.objects.link(camera)
    camera.location = (middle[0], middle[1], y + 0.02)  # above it nothing is in the way
    camera.data.type = "ORTHO"
    camera.data.sensor_fit = "HORIZONTAL"
    camera.data.ortho_scale = x1 - x0
    return camera


for o in list(bpy.data.objects):
    bpy.data.objects.remove(o)
renamed = os.path.join(out, "model.glb")
gltf = rename_materials(model, renamed)
bpy.ops.import_scene.gltf(filepath=renamed)
fix_lights()
fix_materials(gltf.get("materials", []))
s = bpy.context.scene
if camera_end.startswith("card:"):
    cameras = [lay_card(*map(float, camera_end[5:].split(",")))]
else:
    cameras = [o for o in bpy.data.objects if o.type == "CAMERA" and o.name.endswith(camera_end)]
if not cameras:
    raise SystemExit(f"cycles_model: no camera {camera_end}; there are {[o.name for o in bpy.data.objects if o.type == 'CAMERA']}")
s.camera = cameras[0]
# The file tells the vertical field of view.
for c in gltf.get("cameras", []):
    if "perspective" in c and c.get("name", "").endswith(camera_end):
        s.camera.data.sensor_fit = "VERTICAL"
        s.camera.data.angle = c["perspective"]["yfov"]
s.camera.data.clip_start = 1e-3
s.camera.data.clip_end = 1e4

s.world = bpy.data.worlds.new("black")
s.world.use_nodes = True
s.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
s.render.engine = "CYCLES"
width, height = (int(v) for v in size.split("x"))
s.render.resolution_percentage = 100
s.render.image_settings.file_format = "OPEN_EXR"
s.render.image_settings.color_depth = "32"
s.view_settings.view_transform = "Raw"
k = s.cycles
k.device, k.use_adaptive_sampling, k.use_denoising = "CPU", False, False
k.max_bounces = k.diffuse_bounces = k.glossy_bounces = k.transmission_bounces = 64
k.transparent_max_bounces = 64
k.sample_clamp_direct = k.sample_clamp_indirect = 0  # 0: off
k.blur_glossy = 0
k.caustics_reflective = k.caustics_refractive = True
k.light_sampling_threshold = 0
k.pixel_filter_type = "BOX"
k.film_exposure = float(exposure)
k.seed = int(seed)


def render(w, h, spp, name):
    s.render.resolution_x, s.render.resolution_y = w, h
    s.render.filepath = os.path.join(out, name)
    k.samples = spp
    begin, wall = time.process_time(), time.monotonic()
    bpy.ops.render.render(write_still=True)
    return {"cpu_s": time.process_time() - begin, "wall_s": time.monotonic() - wall}


render(1, 1, 1, "one.exr")  # warms up
result = {"blender": bpy.app.version_string, "pixel": render(1, 1, 1, "one.exr"), "renders": {}}
for spp in samples:
    result["renders"][spp] = render(width, height, int(spp), f"cycles-{spp}.exr")
with open(os.path.join(out, "cycles.json"), "w", encoding="utf-8") as f:
    json.dump(result, f)
