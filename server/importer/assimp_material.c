/* Materials of an Assimp scene: metallic-roughness where the format has it, else Phong brought to it. */
#include <assimp/material.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "server/importer/assimp.h"

struct look {
    double base_color[3], alpha, metallic, roughness, ior, specular, transmission, emission[3];
    char color_map[1024], opacity_map[1024], normal_map[1024], emission_map[1024];
};

static double clamp01(double v)
{
    return v > 0.0 ? fmin(v, 1.0) : 0.0;
}

/* A number of the material; absent when it is not there or not finite. */
static double get_number(const struct aiMaterial *m, const char *key, double absent)
{
    ai_real v = 0;
    if (aiGetMaterialFloatArray(m, key, 0, 0, &v, NULL) != aiReturn_SUCCESS || !isfinite(v))
        return absent;
    return (double)v;
}

static bool get_color(const struct aiMaterial *m, const char *key, double ret_color[3])
{
    struct aiColor4D c = {0, 0, 0, 1};
    if (aiGetMaterialColor(m, key, 0, 0, &c) != aiReturn_SUCCESS)
        return false;
    const double v[3] = {(double)c.r, (double)c.g, (double)c.b};
    for (int i = 0; i < 3; i++)
        ret_color[i] = isfinite(v[i]) ? v[i] : 0.0;
    return true;
}

static void get_map(const struct aiMaterial *m, const enum aiTextureType types[2], char ret_path[1024])
{
    struct aiString path;
    ret_path[0] = 0;
    for (int i = 0; i < 2 && !ret_path[0]; i++)
        if (aiGetMaterialTexture(m, types[i], 0, &path, NULL, NULL, NULL, NULL, NULL, NULL) == aiReturn_SUCCESS &&
            path.length < 1024)
            snprintf(ret_path, 1024, "%s", path.data);
}

/* Phong exponent n to GGX roughness: alpha = sqrt(2 / (n + 2)) (Walter et al. 2007, of Beckmann), roughness =
 * sqrt(alpha). No specular colour is a purely diffuse surface. */
static void read_phong(const struct aiMaterial *m, struct look *l)
{
    double specular[3] = {0, 0, 0};
    double n = get_number(m, "$mat.shininess", 0.0);
    get_color(m, "$clr.specular", specular);
    l->specular = n > 0.0 ? clamp01(fmax(specular[0], fmax(specular[1], specular[2]))) : 0.0;
    l->roughness = l->specular > 0.0 ? sqrt(sqrt(2.0 / (n + 2.0))) : 1.0;
}

static void read_look(const struct aiMaterial *m, struct look *l)
{
    static const enum aiTextureType color_types[2] = {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE};
    static const enum aiTextureType opacity_types[2] = {aiTextureType_OPACITY, aiTextureType_OPACITY};
    static const enum aiTextureType normal_types[2] = {aiTextureType_NORMAL_CAMERA, aiTextureType_NORMALS};
    static const enum aiTextureType emission_types[2] = {aiTextureType_EMISSION_COLOR, aiTextureType_EMISSIVE};
    memset(l, 0, sizeof *l);
    l->base_color[0] = l->base_color[1] = l->base_color[2] = 0.8;
    if (!get_color(m, "$clr.base", l->base_color))
        get_color(m, "$clr.diffuse", l->base_color);
    get_map(m, color_types, l->color_map);
    get_map(m, opacity_types, l->opacity_map);
    get_map(m, normal_types, l->normal_map);
    get_map(m, emission_types, l->emission_map);
    l->ior = fmin(fmax(get_number(m, "$mat.refracti", 1.5), 1.0), 4.0);
    l->metallic = clamp01(get_number(m, "$mat.metallicFactor", 0.0));
    l->specular = 1.0;
    l->roughness = get_number(m, "$mat.roughnessFactor", -1.0);
    if (l->roughness < 0.0)
        read_phong(m, l);
    l->roughness = clamp01(l->roughness);
    get_color(m, "$clr.emissive", l->emission);
    double strength = get_number(m, "$mat.emissiveIntensity", 1.0);
    for (int i = 0; i < 3; i++) {
        l->base_color[i] = clamp01(l->base_color[i]);
        l->emission[i] = fmin(fmax(l->emission[i] * strength, 0.0), 1e6);
    }
    double opacity = clamp01(get_number(m, "$mat.opacity", 1.0));
    l->transmission = clamp01(get_number(m, "$mat.transmission.factor", 0.0));
    /* A see-through material with an index of refraction is glass, one without a stencil. */
    if (opacity < 1.0 && get_number(m, "$mat.refracti", 1.0) > 1.0) {
        l->transmission = 1.0 - opacity;
        l->specular = 1.0;
        opacity = 1.0;
    }
    l->alpha = opacity;
}

static void put_texture(struct lum_op_text *op, const char *key, const char *image)
{
    if (!image[0])
        return;
    lum_op_object(op, key);
    lum_op_string(op, "image", image);
    lum_op_close(op);
}

struct maps {
    lum_id color, normal, emission;
};

static enum lum_status send_maps(struct lum_assimp *a, const struct look *l, struct maps *maps, struct lum_error *err)
{
    enum lum_status status = lum_assimp_image(a, l->color_map, l->opacity_map, false, maps->color, err);
    if (!status)
        status = lum_assimp_image(a, l->normal_map, "", true, maps->normal, err);
    if (!status)
        status = lum_assimp_image(a, l->emission_map, "", false, maps->emission, err);
    return status;
}

static void put_emission(struct lum_assimp *a, struct lum_op_text *op, const struct look *l, const struct maps *maps,
                         struct lum_assimp_material *inout_material)
{
    double y = 0.2126 * l->emission[0] + 0.7152 * l->emission[1] + 0.0722 * l->emission[2];
    if (!(y > 0.0))
        return;
    inout_material->shines = true;
    inout_material->evenly = !maps->emission[0];
    const double color[3] = {l->emission[0] / y, l->emission[1] / y, l->emission[2] / y};
    lum_op_numbers(op, "emission_color", color, 3);
    lum_op_number(op, "emission_cd_m2", y * LUM_LUMENS_PER_WATT);
    put_texture(op, "emission_texture", maps->emission);
    lum_assimp_warn_units(a);
}

enum lum_status lum_assimp_material(struct lum_assimp *a, uint32_t i, struct lum_error *err)
{
    const struct aiMaterial *m = a->scene->mMaterials[i];
    if (a->materials[i].id[0])
        return LUM_OK;
    struct aiString label = {0};
    struct look l;
    struct maps maps = {0};
    aiGetMaterialString(m, AI_MATKEY_NAME, &label);
    read_look(m, &l);
    struct lum_id_request name = {"material/", label.data, "material", i};
    enum lum_status status = send_maps(a, &l, &maps, err);
    if (!status)
        status = lum_ids_make(&a->im->ids, &name, a->materials[i].id, err);
    if (status)
        return status;
    /* a picture stands for the colour: exporters leave black or arbitrary factors beside it */
    static const double white[3] = {1.0, 1.0, 1.0};
    bool black = l.base_color[0] + l.base_color[1] + l.base_color[2] <= 0.0;
    bool cut_out = maps.color[0] && l.opacity_map[0];
    struct lum_op_text op;
    lum_op_begin(&op, "material", a->materials[i].id);
    lum_op_numbers(&op, "base_color", maps.color[0] && black ? white : l.base_color, 3);
    lum_op_number(&op, "metallic", l.metallic);
    lum_op_number(&op, "roughness", l.roughness);
    lum_op_number(&op, "ior", l.ior);
    lum_op_number(&op, "specular", l.specular);
    lum_op_number(&op, "transmission", l.transmission);
    lum_op_bool(&op, "thin", l.transmission > 0.0); /* nothing says that the mesh is closed */
    lum_op_string(&op, "alpha_mode", cut_out ? "mask" : l.alpha < 1.0 ? "blend" : "opaque");
    lum_op_number(&op, "alpha", cut_out ? 1.0 : l.alpha);
    put_emission(a, &op, &l, &maps, &a->materials[i]);
    put_texture(&op, "base_color_texture", maps.color);
    put_texture(&op, "normal_texture", maps.normal);
    return lum_emit_op(&a->im->emit, &op, err);
}
