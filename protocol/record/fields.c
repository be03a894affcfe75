/* The tables. PROTOCOL.md repeats them; a test compares the two. */
#include "protocol/record/field.h"

#include <stdio.h>
#include <string.h>

#include "protocol/base/nearest.h"
#include "protocol/json/json.h"
#include "protocol/record/light_kinds.h"

#define COORD LUM_LIMIT_COORD_M
#define COUNT(a) (sizeof(a) / sizeof((a)[0]))
#define ROW(s, m, k) .name = #m, .kind = LUM_FIELD_##k, .offset = offsetof(struct lum_record_##s, m)

/* clang-format off */
/* s: struct, m: member and JSON name, d: default, u: unit, t: one line for PROTOCOL.md, and more members */
#define NUMBER(s, m, lo, hi, d, u, ...) {ROW(s, m, NUMBER), .min = lo, .max = hi, .def = {d}, .unit = u, .doc = __VA_ARGS__}
#define INTEGER(s, m, lo, hi, d, ...) {ROW(s, m, INTEGER), .min = lo, .max = hi, .def = {d}, .unit = "", .doc = __VA_ARGS__}
#define U32(s, m, hi, u, t) {ROW(s, m, U32), .max = hi, .unit = u, .doc = t}
#define OPT(s, m, lo, hi, g, u, ...) {ROW(s, m, OPT), .min = lo, .max = hi, .group = g, .unit = u, .doc = __VA_ARGS__}
#define BOOL(s, m, d, ...) {ROW(s, m, BOOL), .def = {d}, .unit = "", .doc = __VA_ARGS__}
#define XYZ(x, y, z) x, y, z
#define NUMBERS(s, m) .n = sizeof((struct lum_record_##s *)0)->m / sizeof(double)
#define CHARS(s, m) .n = sizeof((struct lum_record_##s *)0)->m
#define VECTOR(s, m, f, lo, hi, d, u, ...) \
    {ROW(s, m, VECTOR), NUMBERS(s, m), .flags = f, .min = lo, .max = hi, .def = {d}, .unit = u, .doc = __VA_ARGS__}
#define CHOICE(s, m, f, words, t) {ROW(s, m, CHOICE), CHARS(s, m), .flags = f, .text = words, .unit = "", .doc = t}
#define NAME(s, m, d, t) {ROW(s, m, NAME), CHARS(s, m), .text = d, .unit = "", .doc = t}
#define TEXT(s, m, t) {ROW(s, m, TEXT), CHARS(s, m), .unit = "", .doc = t}
#define ASSET(s, m, f, t) {ROW(s, m, ASSET), CHARS(s, m), .flags = f, .unit = "", .doc = t}
#define REF(s, m, f, r, ...) {ROW(s, m, REF), CHARS(s, m), .flags = f, .ref = LUM_RECORD_##r, .unit = "", .doc = __VA_ARGS__}
#define FLOATS(s, m, f, k, lo, hi, u, t) \
    {ROW(s, m, FLOATS), .n = k, .flags = f, .min = lo, .max = hi, .unit = u, .doc = t}
#define TEXTURE(s, m, t) {ROW(s, m, TEXTURE), .unit = "", .doc = t}
/* clang-format on */

static const struct lum_field texture[] = {
    REF(texture, image, LUM_FIELD_REQUIRED, IMAGE, "the picture"),
    VECTOR(texture, offset, 0, -1e6, 1e6, XYZ(0, 0, 0), "uv", "as KHR_texture_transform"),
    VECTOR(texture, scale, 0, -1e6, 1e6, XYZ(1, 1, 1), "", ""),
    NUMBER(texture, rotation_rad, -1e6, 1e6, 0, "rad", "counter-clockwise about the uv origin"),
    CHOICE(texture, wrap_u, 0, "repeat|mirror|clamp", ""),
    CHOICE(texture, wrap_v, 0, "repeat|mirror|clamp", ""),
};

static const struct lum_field transform[] = {
    VECTOR(transform, translate, 0, -COORD, COORD, XYZ(0, 0, 0), "m", "applied last"),
    VECTOR(transform, rotate_deg, 0, -1e6, 1e6, XYZ(0, 0, 0), "deg", "about X first, then Y, then Z"),
    VECTOR(transform, scale, 0, -1e6, 1e6, XYZ(1, 1, 1), "", "applied first; no factor may be 0"),
};

static const struct lum_field web[] = {
    TEXT(web, name, "of maker and luminaire, as the file says"),
    CHOICE(web, type, 0, "c|b|a", "of photometry, as LM-63 has it"),
    FLOATS(web, c_deg, LUM_FIELD_REQUIRED, 1, -360, 720, "deg",
           "of each plane, ascending, over 360 at most; dark beyond. One: all are the same. Types a, b: horizontal, "
           "vertical angle"),
    FLOATS(
        web, gamma_deg, LUM_FIELD_REQUIRED, 1, 0, 180, "deg",
        "in each plane, ascending; dark beyond. 0: where it aims. Types a, b: 90 less the vertical, horizontal angle"),
    FLOATS(web, candela, LUM_FIELD_REQUIRED, 1, 0, 1e12, "cd", "of each plane, all angles; linear between angles"),
    CHOICE(web, opening, 0, "point|rectangle|disc|sphere", "shape that shines"),
    VECTOR(web, size, 0, 0, 1e6, XYZ(0, 0, 0), "m", "of the opening: along c 0, along c 90, height"),
    OPT(web, rated_lm, 0, 1e12, 0, "lm", "of its lamps, as the file says; null: absolute photometry"),
    OPT(web, watts, 0, 1e9, 0, "W", "it takes; null: the file does not say"),
};

static const struct lum_field box[] = {
    {ROW(box, min, VECTOR), .n = 3, .flags = LUM_FIELD_REQUIRED, .min = -COORD, .max = COORD, .unit = "m", .doc = ""},
    {ROW(box, max, VECTOR), .n = 3, .flags = LUM_FIELD_REQUIRED, .min = -COORD, .max = COORD, .unit = "m", .doc = ""},
};

static const struct lum_field mesh[] = {
    NAME(mesh, shape, "", "a built-in shape; empty: the arrays below"),
    VECTOR(mesh, size, 0, 0, COORD, XYZ(1, 1, 1), "m", "of a shape: edges of its box"),
    VECTOR(mesh, segments, LUM_FIELD_WHOLE, 0, LUM_LIMIT_SEGMENTS, XYZ(0, 0, 0), "",
           "of a shape: tessellation around and along; 0: its default"),
    VECTOR(mesh, param, 0, -COORD, COORD, XYZ(0, 0, 0), "", "of a shape: its own knobs; 0: its default"),
    FLOATS(mesh, positions, LUM_FIELD_DOUBLE, 3, -COORD, COORD, "m", "x, y, z of each vertex"),
    {ROW(mesh, indices, INDICES), .unit = "",
     .doc = "three vertices of each triangle, counter-clockwise from the front"},
    FLOATS(mesh, normals, 0, 3, -1e6, 1e6, "", "per vertex; none: flat shading"),
    FLOATS(mesh, uvs, 0, 2, -1e6, 1e6, "uv", "per vertex"),
    FLOATS(mesh, tangents, 0, 4, -1e6, 1e6, "",
           "per vertex, for relief and brushed metal: which way u grows, and 1 or -1: falling v runs along normal x "
           "tangent, or against it; none: by uvs"),
    FLOATS(mesh, colors, 0, 3, 0, 1e6, "", "per vertex, linear; multiply base_color"),
    BOOL(mesh, deforming, 0, "positions will be set again: the index structure is refitted, not rebuilt"),
};

static const struct lum_field image[] = {
    {ROW(image, asset, ASSET), CHARS(image, asset), .group = LUM_GROUP_FILE, .unit = "",
     .doc = "PNG, JPEG, HDR or EXR below the asset root; excludes pixels"},
    U32(image, width, LUM_LIMIT_IMAGE_SIDE, "px", "of pixels"),
    U32(image, height, LUM_LIMIT_IMAGE_SIDE, "px", "of pixels"),
    CHOICE(image, texel, 0, "srgb8|linear8|rgb32f", "4 bytes RGBA, or 3 little-endian floats RGB"),
    {ROW(image, pixels, PIXELS), .group = LUM_GROUP_FILE, .unit = "",
     .doc = "base64, rows from the top; excludes asset"},
};

static const struct lum_field material[] = {
    VECTOR(material, base_color, 0, 0, 1, XYZ(1, 1, 1), "", "linear"),
    TEXTURE(material, base_color_texture, "sRGB, multiplies base_color; its alpha multiplies alpha"),
    NUMBER(material, metallic, 0, 1, 0, "", ""),
    NUMBER(material, roughness, 0, 1, 1, "", "GGX alpha = roughness^2; 0: a mirror"),
    TEXTURE(material, metallic_roughness_texture, "G multiplies roughness, B metallic"),
    TEXTURE(material, normal_texture, "tangent space"),
    NUMBER(material, normal_scale, -100, 100, 1, "", ""),
    NUMBER(material, ior, 1, 4, 1.5, "", "index of refraction"),
    NUMBER(material, specular, 0, 1, 1, "", "scales the dielectric reflection; 0: purely diffuse"),
    TEXTURE(material, specular_texture, "alpha multiplies specular"),
    VECTOR(material, specular_color, 0, 0, 100, XYZ(1, 1, 1), "", ""),
    TEXTURE(material, specular_color_texture, "sRGB, multiplies specular_color"),
    NUMBER(material, transmission, 0, 1, 0, "", "share of light that passes through"),
    TEXTURE(material, transmission_texture, "R multiplies transmission"),
    VECTOR(material, diffuse_transmittance, 0, 0, 1, XYZ(0, 0, 0), "",
           "of paper, cloth, opal: what leaves the far side evenly; with base_color at most 1"),
    TEXTURE(material, diffuse_transmission_texture, "alpha multiplies diffuse_transmittance"),
    NUMBER(material, diffuse_transmission_share, 0, 0.999, 0, "",
           "with that texture at alpha a the base reflects base_color * (1 - share * a) / (1 - share)"),
    VECTOR(material, sheen_color, 0, 0, 1, XYZ(0, 0, 0), "", "of the fuzz of cloth, seen where the surface turns away"),
    NUMBER(material, sheen_roughness, 0, 1, 0, "", "of that; below 0.27 it is as at 0.27"),
    NUMBER(material, clearcoat, 0, 1, 0, "", "how much of a clear lacquer lies over all of it"),
    NUMBER(material, clearcoat_roughness, 0, 1, 0, "", "of that: GGX alpha = clearcoat_roughness^2; 0: a mirror"),
    TEXTURE(material, clearcoat_texture, "R multiplies clearcoat"),
    TEXTURE(material, clearcoat_roughness_texture,
            "G multiplies clearcoat_roughness; with it a coat is nowhere a mirror"),
    TEXTURE(material, clearcoat_normal_texture, "tangent space, of the coat alone"),
    NUMBER(material, clearcoat_normal_scale, -100, 100, 1, "", ""),
    NUMBER(material, anisotropy, 0, 1, 0, "",
           "brushed: how far highlights are stretched; 1: alpha along the stretch is 1"),
    NUMBER(material, anisotropy_rotation_deg, -3600, 3600, 0, "deg", "of the stretch: 0 along +u, 90 along -v of uv"),
    TEXTURE(material, anisotropy_texture,
            "R, G: direction of the stretch along +u and -v, 0.5: 0; turned by anisotropy_rotation_deg. B multiplies "
            "anisotropy"),
    BOOL(material, thin, 0, "a surface without volume: transmission does not bend"),
    VECTOR(material, attenuation_color, 0, 0, 1, XYZ(1, 1, 1), "", "what is left after attenuation_distance"),
    OPT(material, attenuation_distance, 1e-9, COORD, 0, "m", "null: clear"),
    VECTOR(material, emission_color, 0, 0, 1e6, XYZ(1, 1, 1), "", "normalised to luminance 1"),
    TEXTURE(material, emission_texture, "sRGB, multiplies emission"),
    NUMBER(material, emission_cd_m2, 0, 1e12, 0, "cd/m2", "emitted luminance"),
    CHOICE(material, emission_sides, 0, "both|front", "which shine; front: around which the triangles wind"),
    CHOICE(material, alpha_mode, 0, "opaque|mask|blend", ""),
    NUMBER(material, alpha, 0, 1, 1, "", ""),
    NUMBER(material, alpha_cutoff, 0, 1, 0.5, "", "mask: less is invisible"),
    BOOL(material, unlit, 0, "shown as base_color, reflects nothing"),
};

static const struct lum_field object[] = {
    REF(object, mesh, LUM_FIELD_REQUIRED, MESH, ""),
    REF(object, material, LUM_FIELD_REQUIRED, MATERIAL, ""),
    {ROW(object, transform, TRANSFORM), .unit = "", .doc = "mesh to world; must be invertible"},
    BOOL(object, visible, 1, ""),
    BOOL(object, on, 1, "false: it gives no light"),
    OPT(object, flux_lm, 0, 1e12, LUM_GROUP_PHOTOMETRIC, "lm", "all light that leaves it; null: as its material says"),
    OPT(object, luminance_cd_m2, 0, 1e12, LUM_GROUP_PHOTOMETRIC, "cd/m2",
        "emitted luminance; null: as its material says"),
    {ROW(object, color, VECTOR), .n = 3, .flags = LUM_FIELD_NULLABLE, .group = LUM_GROUP_COLOR, .max = 1e6, .unit = "",
     .doc = "of its light: linear, normalised to luminance 1; null: its material's; excludes cct_k"},
    OPT(object, cct_k, 1667, 25000, LUM_GROUP_COLOR, "K", "correlated colour temperature of its light; excludes color"),
    {ROW(object, group, ID), CHARS(object, group), .unit = "", .doc = "mixing group of its light; null: its own id"},
};

#define FOR(what) .has = LUM_HAS_##what
#define WORD(name, has) "|" #name
#define KINDS (LUM_LIGHT_KINDS(WORD))
static const struct lum_field light[] = {
    CHOICE(light, kind, LUM_FIELD_REQUIRED, &KINDS[1], ""),
    VECTOR(light, position, 0, -COORD, COORD, XYZ(0, 0, 0), "m", "centre"),
    VECTOR(light, direction, 0, -COORD, COORD, XYZ(0, -1, 0), "", "where light goes", FOR(DIRECTION)),
    NUMBER(light, roll_deg, -3600, 3600, 0, "deg",
           "about the direction, from c 0 to c 90. At 0 c 0, the length of the lamp, lies along +X where it aims down",
           FOR(WEB)),
    VECTOR(light, u, 0, -COORD, COORD, XYZ(1, 0, 0), "m", "full edge; it emits towards u x v", FOR(EDGES)),
    VECTOR(light, v, 0, -COORD, COORD, XYZ(0, 0, 1), "m", "full edge", FOR(EDGES)),
    NUMBER(light, radius, 0, COORD, 0.1, "m", "", FOR(RADIUS)),
    NUMBER(light, diameter_deg, 0, 90, 0, "deg",
           "under which it is seen: the sun's is 0.53, and shadows have soft edges; 0: sharp ones", FOR(DIAMETER)),
    NUMBER(light, inner_cone_deg, 0, 90, 0, "deg", "half angle of full intensity", FOR(CONES)),
    NUMBER(light, outer_cone_deg, 0.01, 90, 45, "deg", "half angle where it ends", FOR(CONES)),
    OPT(light, flux_lm, 0, 1e12, LUM_GROUP_PHOTOMETRIC, "lm", "all that it emits", FOR(FLUX)),
    OPT(light, intensity_cd, 0, 1e12, LUM_GROUP_PHOTOMETRIC, "cd", "", FOR(INTENSITY)),
    OPT(light, luminance_cd_m2, 0, 1e12, LUM_GROUP_PHOTOMETRIC, "cd/m2", "of a sky: at its zenith", FOR(LUMINANCE)),
    OPT(light, illuminance_lx, 0, 1e12, LUM_GROUP_PHOTOMETRIC, "lx",
        "on a facing plane; of a sky: on the open horizontal plane", FOR(ILLUMINANCE)),
    OPT(light, multiplier, 0, 1e6, LUM_GROUP_PHOTOMETRIC, "", "of the intensities of its web; null, and no flux_lm: 1",
        FOR(WEB)),
    {ROW(light, asset, ASSET), CHARS(light, asset), .group = LUM_GROUP_FILE, .unit = "", FOR(WEB),
     .doc = "IES LM-63 or EULUMDAT file below the asset root; excludes web"},
    {ROW(light, web, WEB), .group = LUM_GROUP_FILE, .unit = "", FOR(WEB),
     .doc = "what such a file says; excludes asset"},
    {ROW(light, color, VECTOR), .n = 3, .group = LUM_GROUP_COLOR, .max = 1e6, .def = {1, 1, 1}, .unit = "",
     .doc = "linear, normalised to luminance 1 when used; excludes cct_k"},
    OPT(light, cct_k, 1667, 25000, LUM_GROUP_COLOR, "K", "correlated colour temperature; excludes color"),
    REF(light, image, 0, IMAGE, "equirectangular picture, scaled by luminance_cd_m2", FOR(IMAGE)),
    NUMBER(light, rotation_deg, -3600, 3600, 0, "deg", "about +Y", FOR(IMAGE)),
    INTEGER(light, cie_type, 1, 16, 12, "CIE general sky; 16: the traditional overcast one", FOR(SKY)),
    NUMBER(light, ground_albedo, 0, 1, 0.2, "", "of what lies below the horizon, lit by the sky alone", FOR(SKY)),
    {ROW(light, date, NAME), CHARS(light, date), .text = "", .unit = "", FOR(SUN),
     .doc = "YYYY-MM-DD, of the place's calendar"},
    NUMBER(light, time_h, 0, 24, 12, "h", "of the place's clock: 13.5 is half past one", FOR(SUN)),
    NUMBER(light, utc_offset_h, -14, 14, 0, "h", "by which that clock is ahead of UTC", FOR(SUN)),
    NUMBER(light, latitude_deg, -90, 90, 0, "deg", "north is positive", FOR(SUN)),
    NUMBER(light, longitude_deg, -180, 180, 0, "deg", "east is positive", FOR(SUN)),
    NUMBER(light, north_deg, -360, 360, 0, "deg", "of north from -Z, towards +X", FOR(SUN)),
    OPT(light, azimuth_deg, 0, 360, 0, "deg", "from north by east; with elevation_deg, in place of place and time",
        FOR(SUN)),
    OPT(light, elevation_deg, -90, 90, 0, "deg", "over the horizon; with azimuth_deg", FOR(SUN)),
    NUMBER(light, extinction, 0, 10, 0.21, "", "of the air, towards the zenith, where illuminance_lx is null",
           FOR(SUN)),
    {ROW(light, group, ID), CHARS(light, group), .unit = "", .doc = "mixing group; null: its own id"},
    BOOL(light, on, 1, ""),
    BOOL(light, camera_visible, 1, "seen directly", FOR(BODY)),
    BOOL(light, as_point, 0, "shines from its centre, whatever opening its web has", FOR(WEB)),
};

static const struct lum_field medium[] = {
    VECTOR(medium, sigma_s, 0, 0, 1e6, XYZ(0, 0, 0), "1/m", "scattering"),
    VECTOR(medium, sigma_a, 0, 0, 1e6, XYZ(0, 0, 0), "1/m", "absorption"),
    NUMBER(medium, g, -0.99, 0.99, 0, "", "Henyey-Greenstein asymmetry"),
    {ROW(medium, box, BOX), .unit = "", .doc = "where it is; null: everywhere"},
};

static const struct lum_field camera[] = {
    VECTOR(camera, position, LUM_FIELD_REQUIRED, -COORD, COORD, XYZ(0, 0, 0), "m", ""),
    VECTOR(camera, target, LUM_FIELD_REQUIRED, -COORD, COORD, XYZ(0, 0, 0), "m", "looked at"),
    VECTOR(camera, up, 0, -COORD, COORD, XYZ(0, 1, 0), "", "not parallel to the view direction"),
    NUMBER(camera, vfov_deg, 1, 179, 45, "deg", "vertical field of view, of a perspective"),
    CHOICE(camera, projection, 0, "perspective|panorama", "panorama: all around, up at the upper edge"),
};

#define ONLY(kinds) .only = kinds
static const struct lum_field sensor[] = {
    CHOICE(sensor, kind, LUM_FIELD_REQUIRED, "point|line|grid|observer", "where it measures; observer: glare"),
    CHOICE(sensor, quantity, 0, "plane|cylindrical|semicylindrical|modelling|ugr",
           "point, line, grid: which illuminance; or glare of eyes there"),
    VECTOR(sensor, position, LUM_FIELD_REQUIRED, -COORD, COORD, XYZ(0, 0, 0), "m",
           "the point; the middle of a line or grid; the eye"),
    VECTOR(sensor, u, 0, -COORD, COORD, XYZ(1, 0, 0), "m", "full edge", ONLY("line|grid")),
    VECTOR(sensor, v, 0, -COORD, COORD, XYZ(0, 0, 1), "m", "full edge", ONLY("grid")),
    VECTOR(sensor, normal, 0, -COORD, COORD, XYZ(0, 1, 0), "",
           "of the plane, to the side that is lit: up, a horizontal one; or the axis of the cylinder",
           ONLY("point|line|grid")),
    VECTOR(sensor, direction, 0, -COORD, COORD, XYZ(0, 0, -1), "",
           "line of sight of an observer, and the first of eyes (ugr); where a half cylinder faces"),
    INTEGER(sensor, directions, 1, LUM_LIMIT_DIRECTIONS, 8,
            "ugr: lines of sight of each eye, evenly around the vertical", ONLY("point|line|grid")),
    OPT(sensor, spacing_m, 1e-6, COORD, 0, "m", "between points, at most; null: by EN 12464-1", ONLY("line|grid")),
    OPT(sensor, floor_m2, 1e-6, 1e18, 0, "m2", "of the room, over which power is told; null: the grid's own area",
        ONLY("grid")),
    OPT(sensor, target_lx, 1e-6, 1e9, 0, "lx", "mean that is wanted, at least", ONLY("point|line|grid")),
    OPT(sensor, target_uo, 1e-6, 1, 0, "", "least over mean, at least", ONLY("line|grid")),
    OPT(sensor, target_ugr, 1e-6, 100, 0, "", "at most; else with quantity ugr alone",
        ONLY("point|line|grid|observer")),
    OPT(sensor, target_dgp, 1e-6, 1, 0, "", "at most", ONLY("observer")),
    TEXT(sensor, name, "for people"),
};

static const struct lum_field patch[] = {
    CHOICE(patch, protocol, 0, "sacn|artnet", ""),
    INTEGER(patch, universe, 0, 63999, 1, "sacn: 1 to 63999; artnet: the port address, 0 to 32767"),
    INTEGER(patch, address, 1, 512, 1, "of its first channel"),
    CHOICE(patch, channels, 0, "dim|dim16|rgb|rgb16", "from there on; 16: two a value, the coarse one first"),
    CHOICE(patch, curve, 0, "linear|square|dali",
           "light by value; square: dark values are finer; dali: as IEC 62386-102 has it, 0.1 % to all by even ratios"),
    {ROW(patch, target, ID), CHARS(patch, target), .flags = LUM_FIELD_REQUIRED, .unit = "",
     .doc = "a light, an object or a mixing group, there when it is set"},
};

#define LAMP(m) .name = #m, .offset = offsetof(struct lum_lamp, m)
static const struct lum_field lamp[] = {
    {LAMP(id), .kind = LUM_FIELD_ID, .n = sizeof(lum_id), .flags = LUM_FIELD_REQUIRED, .unit = "",
     .doc = "a light, or an object that shines"},
    {LAMP(on), .kind = LUM_FIELD_BOOL, .def = {1}, .unit = "", .doc = ""},
    {LAMP(flux_lm), .kind = LUM_FIELD_OPT, .group = LUM_GROUP_PHOTOMETRIC, .max = 1e12, .unit = "lm", .doc = ""},
    {LAMP(intensity_cd), .kind = LUM_FIELD_OPT, .group = LUM_GROUP_PHOTOMETRIC, .max = 1e12, .unit = "cd", .doc = ""},
    {LAMP(luminance_cd_m2), .kind = LUM_FIELD_OPT, .group = LUM_GROUP_PHOTOMETRIC, .max = 1e12, .unit = "cd/m2",
     .doc = ""},
    {LAMP(illuminance_lx), .kind = LUM_FIELD_OPT, .group = LUM_GROUP_PHOTOMETRIC, .max = 1e12, .unit = "lx", .doc = ""},
    {LAMP(multiplier), .kind = LUM_FIELD_OPT, .group = LUM_GROUP_PHOTOMETRIC, .max = 1e6, .unit = "",
     .doc = "one of these five at most; none: as its file, material, or place and time make it"},
    {LAMP(color), .kind = LUM_FIELD_VECTOR, .n = 3, .flags = LUM_FIELD_NULLABLE, .group = LUM_GROUP_COLOR, .max = 1e6,
     .unit = "", .doc = "linear; excludes cct_k. Neither: white, or its material's"},
    {LAMP(cct_k), .kind = LUM_FIELD_OPT, .group = LUM_GROUP_COLOR, .min = 1667, .max = 25000, .unit = "K",
     .doc = "correlated colour temperature"},
};

static const struct lum_field preset[] = {
    TEXT(preset, name, "for people"),
    NUMBER(preset, order, -1e6, 1e6, 0, "", "where it stands among the others: less comes first, then by id"),
    NUMBER(preset, fade_s, 0, LUM_LIMIT_FADE_S, 0, "s", "that a recall takes which says nothing else; 0: at once"),
    {ROW(preset, lamps, LAMPS), .unit = "", .doc = "that it changes; all others stay as they are"},
};

static const struct lum_field render[] = {
    NAME(render, method, "live", "default of views; see `lumend methods`"),
    INTEGER(render, spp, 0, LUM_LIMIT_SPP, 1024, "samples per pixel at which a resting picture stops; 0: never"),
    INTEGER(render, max_depth, 0, LUM_LIMIT_DEPTH, LUM_LIMIT_DEPTH,
            "path segments after the first hit; roulette ends nearly all before"),
    INTEGER(render, shadow_samples, 1, 16, 16, "per area light and pixel in deferred methods: 1, 4, 9 or 16"),
    INTEGER(render, seed, 0, 4294967295.0, 0, ""),
    INTEGER(render, vpls, 1, 65536, 256,
            "virtual point lights, of methods that use them; `live` places eight times as many, up to "
            "65536 in all, and asks its choice of them"),
    NUMBER(render, cache_accuracy, 0.01, 1, 0.2, "",
           "error that records of a cache may have: less is finer and slower"),
    BOOL(render, antialias, 1,
         "smooth edges of surfaces and, in `live`, of hard shadows; false: rays through pixel centres"),
    OPT(render, exposure_ev, -30, 30, 0, "EV100", "higher is darker; null: automatic"),
    CHOICE(render, tone_map, 0, "agx|aces|reinhard|none", ""),
    CHOICE(
        render, glass, 0, "physical|architectural",
        "of smooth solids: architectural lets light straight through, so that lamps shine through it in every method"),
    {ROW(render, camera, ID), CHARS(render, camera), .unit = "",
     .doc = "of views that name none, there when it is set; null, or gone: `main`, else the first by id"},
};

static const struct lum_field import[] = {
    ASSET(import, asset, LUM_FIELD_REQUIRED, "model file below the asset root"),
    {ROW(import, transform, TRANSFORM), .unit = "", .doc = "model to world; must be invertible"},
};

static const struct lum_fields tables[LUM_RECORD_TYPE_COUNT] = {
    [LUM_RECORD_MESH] = {mesh, COUNT(mesh)},
    [LUM_RECORD_IMAGE] = {image, COUNT(image)},
    [LUM_RECORD_MATERIAL] = {material, COUNT(material)},
    [LUM_RECORD_OBJECT] = {object, COUNT(object)},
    [LUM_RECORD_LIGHT] = {light, COUNT(light)},
    [LUM_RECORD_MEDIUM] = {medium, COUNT(medium)},
    [LUM_RECORD_CAMERA] = {camera, COUNT(camera)},
    [LUM_RECORD_SENSOR] = {sensor, COUNT(sensor)},
    [LUM_RECORD_PATCH] = {patch, COUNT(patch)},
    [LUM_RECORD_PRESET] = {preset, COUNT(preset)},
    [LUM_RECORD_RENDER] = {render, COUNT(render)},
    [LUM_RECORD_IMPORT] = {import, COUNT(import)},
};
const struct lum_fields lum_texture_fields = {texture, COUNT(texture)};
const struct lum_fields lum_transform_fields = {transform, COUNT(transform)};
const struct lum_fields lum_box_fields = {box, COUNT(box)};
const struct lum_fields lum_web_fields = {web, COUNT(web)};
const struct lum_fields lum_lamp_fields = {lamp, COUNT(lamp)};
const struct lum_fields lum_camera_fields = {camera, COUNT(camera)};

const char *const lum_record_type_names[LUM_RECORD_TYPE_COUNT] = {
    [LUM_RECORD_MESH] = "mesh",     [LUM_RECORD_IMAGE] = "image",   [LUM_RECORD_MATERIAL] = "material",
    [LUM_RECORD_OBJECT] = "object", [LUM_RECORD_LIGHT] = "light",   [LUM_RECORD_MEDIUM] = "medium",
    [LUM_RECORD_CAMERA] = "camera", [LUM_RECORD_SENSOR] = "sensor", [LUM_RECORD_PATCH] = "patch",
    [LUM_RECORD_PRESET] = "preset", [LUM_RECORD_RENDER] = "render", [LUM_RECORD_IMPORT] = "import",
};

unsigned lum_light_kind_has(const char *kind)
{
#define HAS(name, has) {#name, has},
    static const struct {
        const char *name;
        unsigned has;
    } kinds[] = {LUM_LIGHT_KINDS(HAS)};
    for (size_t k = 0; k < COUNT(kinds); k++)
        if (strcmp(kind, kinds[k].name) == 0)
            return kinds[k].has;
    return 0;
}

const struct lum_fields *lum_fields_of(enum lum_record_type type)
{
    return &tables[type];
}

const struct lum_fields *lum_field_parts(const struct lum_field *f)
{
    switch (f->kind) {
    case LUM_FIELD_TEXTURE:
        return &lum_texture_fields;
    case LUM_FIELD_TRANSFORM:
        return &lum_transform_fields;
    case LUM_FIELD_BOX:
        return &lum_box_fields;
    default:
        return f->parts;
    }
}

const struct lum_field *lum_fields_find(const struct lum_fields *t, const char *name)
{
    for (size_t i = 0; i < t->n; i++)
        if (strcmp(t->fields[i].name, name) == 0)
            return &t->fields[i];
    return NULL;
}

/* Fields that there were once: old files may name them. */
static const struct {
    enum lum_record_type type;
    const char *name, *text;
} gone[] = {
    {LUM_RECORD_RENDER, "storage",
     "storage is no field of a scene any more: leave it out. It never changed a picture, but how threads share the "
     "records of a cache, which is an option of lumend render now"},
};

bool lum_fields_unknown(const struct lum_fields *t, const char *name, struct lum_proto_error *err)
{
    for (size_t i = 0; i < sizeof gone / sizeof gone[0]; i++)
        if (t == lum_fields_of(gone[i].type) && strcmp(name, gone[i].name) == 0)
            return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "unknown_field", name, "%s", gone[i].text);
    const char *names[LUM_LIMIT_JSON_MEMBERS];
    char text[sizeof err->text / 2];
    for (size_t i = 0; i < t->n; i++)
        names[i] = t->fields[i].name;
    lum_nearest_among(name, names, t->n, text, sizeof text);
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "unknown_field", name, "unknown field \"%.64s\"%s", name, text);
}
