/* Materials: metallic-roughness with the dielectric extensions, and specular-glossiness brought to it. */
#include <math.h>
#include <string.h>

#include "server/importer/gltf.h"
#include "server/importer/gltf_json.h"
#include "server/importer/gltf_ours.h"

#define PI 3.14159265358979323846

static const double unit_range[2] = {0.0, 1.0};

struct texture {
    const char *image; /* id, NULL: none */
    uint32_t uv_set;
    double offset[2], scale[2], rotation;
    const char *wrap_u, *wrap_v;
};

/* What becomes the op's fields. */
struct look {
    double base_color[4];
    double metallic, roughness, ior, specular, specular_color[3], transmission, normal_scale;
    double diffuse_transmittance[3], diffuse_transmission_share, sheen_color[3], sheen_roughness, clearcoat,
        clearcoat_roughness, clearcoat_normal_scale;
    double anisotropy, anisotropy_rotation_deg;
    bool thin, has_attenuation, unlit, double_sided;
    double attenuation_color[3], attenuation_distance;
    double emission[3]; /* cd/m2 by channel */
    double emission_color[3], emission_cd_m2;
    const cJSON *record; /* of extras; NULL: none */
    const char *alpha_mode;
    double alpha_cutoff;
    struct texture base_color_texture, metallic_roughness_texture, emission_texture, normal_texture, anisotropy_texture;
    struct texture specular_texture, specular_color_texture, transmission_texture, diffuse_transmission_texture;
    struct texture clearcoat_texture, clearcoat_roughness_texture, clearcoat_normal_texture;
};

static double luminance_of(const double c[3])
{
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

/* ---- textures ---- */

static const char *wrap_name(uint64_t mode)
{
    return mode == 33071 ? "clamp" : mode == 33648 ? "mirror" : "repeat";
}

static void read_transform(struct lum_gltf *g, const cJSON *info, struct texture *t)
{
    t->uv_set = (uint32_t)lum_gltf_uint(g, info, "texCoord", 0, 15);
    t->scale[0] = t->scale[1] = 1.0;
    const cJSON *ext = lum_gltf_extension(g, info, "KHR_texture_transform");
    if (!ext)
        return;
    lum_gltf_numbers(g, ext, "offset", t->offset, 2);
    lum_gltf_numbers(g, ext, "scale", t->scale, 2);
    t->rotation = lum_gltf_number(g, ext, "rotation", 0.0);
    t->uv_set = (uint32_t)lum_gltf_uint(g, ext, "texCoord", t->uv_set, 15);
}

static void read_texture(struct lum_gltf *g, const cJSON *o, const char *key, bool linear, struct texture *t)
{
    const cJSON *info = lum_gltf_object(g, o, key);
    memset(t, 0, sizeof *t);
    if (!info)
        return;
    uint32_t index = lum_gltf_index(g, info, "index", LUM_GLTF_TEXTURES);
    const cJSON *texture = lum_gltf_item(g, LUM_GLTF_TEXTURES, index);
    uint32_t source = lum_gltf_index(g, texture, "source", LUM_GLTF_IMAGES);
    const cJSON *sampler =
        lum_gltf_item(g, LUM_GLTF_SAMPLERS, lum_gltf_index(g, texture, "sampler", LUM_GLTF_SAMPLERS));
    read_transform(g, info, t);
    t->wrap_u = wrap_name(lum_gltf_uint(g, sampler, "wrapS", 10497, UINT32_MAX));
    t->wrap_v = wrap_name(lum_gltf_uint(g, sampler, "wrapT", 10497, UINT32_MAX));
    if (!lum_gltf_ok(g))
        return;
    if (!texture)
        lum_gltf_fail(g, LUM_ERR_INVALID, "%s has no index", key);
    else if (source == LUM_GLTF_NONE)
        lum_gltf_warn(g, "%s left out: it has no PNG or JPEG image", key);
    else
        t->image = lum_gltf_image(g, source, linear);
}

/* ---- reading ---- */

static void read_metallic_roughness(struct lum_gltf *g, const cJSON *o, struct look *m)
{
    const cJSON *pbr = lum_gltf_object(g, o, "pbrMetallicRoughness");
    lum_gltf_clamped_numbers(g, pbr, "baseColorFactor", m->base_color, 4, unit_range);
    m->metallic = lum_gltf_clamped(g, pbr, "metallicFactor", 1.0, unit_range);
    m->roughness = lum_gltf_clamped(g, pbr, "roughnessFactor", 1.0, unit_range);
    read_texture(g, pbr, "baseColorTexture", false, &m->base_color_texture);
    read_texture(g, pbr, "metallicRoughnessTexture", true, &m->metallic_roughness_texture);
}

/* KHR_materials_pbrSpecularGlossiness. A dielectric's reflectance at normal incidence becomes its index of refraction,
 * F0 = ((n-1)/(n+1))^2; above the F0 of n = 4 it is a metal, whose colour is the specular one. */
static void read_specular_glossiness(struct lum_gltf *g, const cJSON *ext, struct look *m)
{
    double f0[3] = {1.0, 1.0, 1.0};
    lum_gltf_clamped_numbers(g, ext, "diffuseFactor", m->base_color, 4, unit_range);
    lum_gltf_clamped_numbers(g, ext, "specularFactor", f0, 3, unit_range);
    m->roughness = 1.0 - lum_gltf_clamped(g, ext, "glossinessFactor", 1.0, unit_range);
    m->metallic = 0.0;
    read_texture(g, ext, "diffuseTexture", false, &m->base_color_texture);
    if (lum_gltf_object(g, ext, "specularGlossinessTexture"))
        lum_gltf_warn(g, "specularGlossinessTexture is not supported; its factors are used alone");
    double top = fmax(f0[0], fmax(f0[1], f0[2]));
    bool black = m->base_color[0] + m->base_color[1] + m->base_color[2] < 0.04 && !m->base_color_texture.image;
    if (top > 0.36 && black) {
        m->metallic = 1.0;
        memcpy(m->base_color, f0, sizeof f0);
    } else if (top > 0.0) {
        double root = sqrt(fmin(top, 0.36));
        m->ior = (1.0 + root) / (1.0 - root);
        for (int i = 0; i < 3; i++)
            m->specular_color[i] = f0[i] / top;
    } else {
        m->specular = 0.0;
    }
}

static void read_dielectric(struct lum_gltf *g, const cJSON *o, struct look *m)
{
    static const double ior_range[2] = {1.0, 4.0}, color_range[2] = {0.0, 100.0};
    const cJSON *ext = lum_gltf_extension(g, o, "KHR_materials_ior");
    if (ext)
        m->ior = lum_gltf_clamped(g, ext, "ior", 1.5, ior_range);
    if ((ext = lum_gltf_extension(g, o, "KHR_materials_specular"))) {
        m->specular = lum_gltf_clamped(g, ext, "specularFactor", 1.0, unit_range);
        lum_gltf_clamped_numbers(g, ext, "specularColorFactor", m->specular_color, 3, color_range);
        /* one picture may be both: of the alpha of how much it is all the same whether its colours are sRGB */
        read_texture(g, ext, "specularTexture", false, &m->specular_texture);
        read_texture(g, ext, "specularColorTexture", false, &m->specular_color_texture);
    }
    if ((ext = lum_gltf_extension(g, o, "KHR_materials_transmission"))) {
        m->transmission = lum_gltf_clamped(g, ext, "transmissionFactor", 0.0, unit_range);
        if (m->transmission > 0.0)
            read_texture(g, ext, "transmissionTexture", true, &m->transmission_texture);
    }
    if ((ext = lum_gltf_extension(g, o, "KHR_materials_volume"))) {
        static const double metres[2] = {1e-9, LUM_LIMIT_COORD_M};
        m->thin = !(lum_gltf_number(g, ext, "thicknessFactor", 0.0) > 0.0);
        lum_gltf_clamped_numbers(g, ext, "attenuationColor", m->attenuation_color, 3, unit_range);
        m->has_attenuation = cJSON_HasObjectItem(ext, "attenuationDistance");
        m->attenuation_distance = lum_gltf_clamped(g, ext, "attenuationDistance", 1.0, metres);
    }
}

/* KHR_materials_diffuse_transmission: of the diffuse base, a share transmits with a colour of its own, and reflects no
 * more. */
static void read_diffuse_transmission(struct lum_gltf *g, const cJSON *o, struct look *m)
{
    double color[3] = {1.0, 1.0, 1.0};
    const cJSON *ext = lum_gltf_extension(g, o, "KHR_materials_diffuse_transmission");
    bool metal = m->metallic >= 1.0 && !m->metallic_roughness_texture.image;
    bool glass = m->transmission >= 1.0 && !m->transmission_texture.image;
    if (!ext || m->unlit || glass || metal) /* there is no diffuse base */
        return;
    double share = lum_gltf_clamped(g, ext, "diffuseTransmissionFactor", 0.0, unit_range);
    if (share > 0.0)
        read_texture(g, ext, "diffuseTransmissionTexture", false, &m->diffuse_transmission_texture);
    if (m->diffuse_transmission_texture.image)
        share = m->diffuse_transmission_share = fmin(share, 0.999); /* of all, nothing would be left to tell */
    lum_gltf_clamped_numbers(g, ext, "diffuseTransmissionColorFactor", color, 3, unit_range);
    for (int i = 0; i < 3; i++) {
        m->diffuse_transmittance[i] = share * color[i];
        m->base_color[i] *= 1.0 - share;
    }
    if (lum_gltf_object(g, ext, "diffuseTransmissionColorTexture"))
        lum_gltf_warn(g, "diffuseTransmissionColorTexture is not supported; its factor is used alone");
}

static void read_sheen(struct lum_gltf *g, const cJSON *o, struct look *m)
{
    const cJSON *ext = lum_gltf_extension(g, o, "KHR_materials_sheen");
    if (!ext || m->unlit)
        return;
    lum_gltf_clamped_numbers(g, ext, "sheenColorFactor", m->sheen_color, 3, unit_range);
    m->sheen_roughness = lum_gltf_clamped(g, ext, "sheenRoughnessFactor", 0.0, unit_range);
    bool any = m->sheen_color[0] + m->sheen_color[1] + m->sheen_color[2] > 0.0;
    if (any && (lum_gltf_object(g, ext, "sheenColorTexture") || lum_gltf_object(g, ext, "sheenRoughnessTexture")))
        lum_gltf_warn(g, "the textures of KHR_materials_sheen are not supported; its factors are used alone");
}

static void read_anisotropy(struct lum_gltf *g, const cJSON *o, struct look *m)
{
    const cJSON *ext = lum_gltf_extension(g, o, "KHR_materials_anisotropy");
    if (!ext || m->unlit)
        return;
    m->anisotropy = lum_gltf_clamped(g, ext, "anisotropyStrength", 0.0, unit_range);
    m->anisotropy_rotation_deg = fmod(lum_gltf_number(g, ext, "anisotropyRotation", 0.0) * 180.0 / PI, 360.0);
    if (m->anisotropy > 0.0)
        read_texture(g, ext, "anisotropyTexture", true, &m->anisotropy_texture);
}

static void read_clearcoat(struct lum_gltf *g, const cJSON *o, struct look *m)
{
    const cJSON *ext = lum_gltf_extension(g, o, "KHR_materials_clearcoat");
    if (!ext || m->unlit)
        return;
    m->clearcoat = lum_gltf_clamped(g, ext, "clearcoatFactor", 0.0, unit_range);
    m->clearcoat_roughness = lum_gltf_clamped(g, ext, "clearcoatRoughnessFactor", 0.0, unit_range);
    if (!(m->clearcoat > 0.0))
        return;
    read_texture(g, ext, "clearcoatTexture", true, &m->clearcoat_texture);
    read_texture(g, ext, "clearcoatRoughnessTexture", true, &m->clearcoat_roughness_texture);
    read_texture(g, ext, "clearcoatNormalTexture", true, &m->clearcoat_normal_texture);
    m->clearcoat_normal_scale = lum_gltf_number(g, lum_gltf_object(g, ext, "clearcoatNormalTexture"), "scale", 1.0);
}

/* emissiveFactor times KHR_materials_emissive_strength is cd/m2 (the extension's text). A factor above 1 breaks the
 * letter of glTF, but its meaning is plain. */
static void read_emission(struct lum_gltf *g, const cJSON *o, struct look *m)
{
    static const double strength_range[2] = {0.0, 1e9};
    lum_gltf_numbers(g, o, "emissiveFactor", m->emission, 3);
    const cJSON *ext = lum_gltf_extension(g, o, "KHR_materials_emissive_strength");
    double strength = lum_gltf_clamped(g, ext, "emissiveStrength", 1.0, strength_range);
    for (int i = 0; i < 3; i++)
        m->emission[i] = fmin(fmax(m->emission[i], 0.0), 1e9) * strength;
    read_texture(g, o, "emissiveTexture", false, &m->emission_texture);
}

static void read_alpha(struct lum_gltf *g, const cJSON *o, struct look *m)
{
    const char *mode = lum_gltf_string(g, o, "alphaMode");
    m->alpha_mode = "opaque";
    if (mode && strcmp(mode, "MASK") == 0)
        m->alpha_mode = "mask";
    else if (mode && strcmp(mode, "BLEND") == 0)
        m->alpha_mode = "blend";
    else if (mode && strcmp(mode, "OPAQUE") != 0)
        lum_gltf_warn(g, "alphaMode %.20s is unknown; opaque is used", mode);
    m->alpha_cutoff = lum_gltf_clamped(g, o, "alphaCutoff", 0.5, unit_range);
}

static void warn_left_out(struct lum_gltf *g, const cJSON *o)
{
    static const char *const names[] = {
        "KHR_materials_iridescence",
        "KHR_materials_dispersion",
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(names); i++)
        if (lum_gltf_extension(g, o, names[i]))
            lum_gltf_warn(g, "%s is not supported and left out", names[i]);
}

/* Shown alike whatever light there is: nothing real is, and glTF gives its colour no unit. Many scans of rooms are so,
 * and would be black by day. As paint, the scene's light falls on it. */
static void make_matt(struct lum_gltf *g, struct look *m)
{
    m->metallic = m->specular = m->transmission = 0.0;
    m->roughness = 1.0;
    m->metallic_roughness_texture = m->specular_texture = m->transmission_texture = (struct texture){0};
    m->specular_color_texture = (struct texture){0};
    m->emission_cd_m2 = 0.0;
    lum_gltf_warn(g, "KHR_materials_unlit: taken as matt paint, lit by the scene's light");
}

/* ---- extras ---- */

/* Numbers differ less where a program has read and written them as floats. */
#define SAME 1e-5

static bool is_same(const double *a, const double *b, int n)
{
    for (int i = 0; i < n; i++)
        if (!(fabs(a[i] - b[i]) <= SAME * fmax(fabs(a[i]), fabs(b[i]))))
            return false;
    return true;
}

static bool record_numbers(const cJSON *record, const char *key, double *ret, int n)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(record, key);
    for (int i = 0; i < n; i++) {
        const cJSON *one = cJSON_IsArray(v) ? cJSON_GetArrayItem(v, i) : n == 1 ? v : NULL;
        if (!cJSON_IsNumber(one) || !isfinite(one->valuedouble))
            return false;
        ret[i] = one->valuedouble;
    }
    return true;
}

/* The record's value of a member counts to its last bit; but where another program has set what glTF says, that does.
 */
static void restore(const cJSON *record, bool whole, const char *key, double *inout, int n)
{
    double v[3];
    if (record_numbers(record, key, v, n) && (whole || is_same(v, inout, n)))
        memcpy(inout, v, (size_t)n * sizeof *v);
}

static void restore_emission(const cJSON *record, bool whole, struct look *m)
{
    double color[3], cd_m2, seen[3], y;
    if (!record_numbers(record, "emission_color", color, 3) || !record_numbers(record, "emission_cd_m2", &cd_m2, 1))
        return;
    y = luminance_of(color);
    for (int i = 0; i < 3; i++)
        seen[i] = y > 0.0 ? cd_m2 * color[i] / y : 0.0;
    if (!whole && !is_same(seen, m->emission, 3))
        return;
    memcpy(m->emission_color, color, sizeof color);
    m->emission_cd_m2 = cd_m2;
}

static bool record_bool(const cJSON *record, const char *key, bool absent)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(record, key);
    return cJSON_IsBool(v) ? cJSON_IsTrue(v) : absent;
}

/* What lumend has written of it beside what glTF says. */
static void read_ours(struct lum_gltf *g, const cJSON *o, struct look *m)
{
    const cJSON *ours = lum_gltf_ours(o), *record = cJSON_GetObjectItemCaseSensitive(ours, "record");
    double y = luminance_of(m->emission);
    m->emission_cd_m2 = y;
    for (int i = 0; i < 3; i++)
        m->emission_color[i] = y > 0.0 ? m->emission[i] / y : 1.0;
    if (!cJSON_IsObject(record))
        return;
    bool whole = g->is_ours || record_bool(ours, "whole", false);
    const struct {
        const char *key;
        double *value;
        int n;
    } all[] = {
        {"base_color", m->base_color, 3},
        {"alpha", &m->base_color[3], 1},
        {"metallic", &m->metallic, 1},
        {"roughness", &m->roughness, 1},
        {"normal_scale", &m->normal_scale, 1},
        {"ior", &m->ior, 1},
        {"specular", &m->specular, 1},
        {"specular_color", m->specular_color, 3},
        {"transmission", &m->transmission, 1},
        {"diffuse_transmittance", m->diffuse_transmittance, 3},
        {"diffuse_transmission_share", &m->diffuse_transmission_share, 1},
        {"sheen_color", m->sheen_color, 3},
        {"sheen_roughness", &m->sheen_roughness, 1},
        {"clearcoat", &m->clearcoat, 1},
        {"clearcoat_roughness", &m->clearcoat_roughness, 1},
        {"clearcoat_normal_scale", &m->clearcoat_normal_scale, 1},
        {"anisotropy", &m->anisotropy, 1},
        {"anisotropy_rotation_deg", &m->anisotropy_rotation_deg, 1},
        {"attenuation_color", m->attenuation_color, 3},
        {"attenuation_distance", &m->attenuation_distance, 1},
        {"alpha_cutoff", &m->alpha_cutoff, 1},
    };
    m->record = record;
    for (size_t i = 0; i < LUM_ARRAY_LEN(all); i++)
        restore(record, whole, all[i].key, all[i].value, all[i].n);
    restore_emission(record, whole, m);
    if (!whole)
        return;
    double distance_m;
    const char *sides = lum_gltf_ours_text(record, "emission_sides");
    m->has_attenuation = record_numbers(record, "attenuation_distance", &distance_m, 1);
    m->thin = record_bool(record, "thin", m->thin);
    m->unlit = record_bool(record, "unlit", m->unlit);
    m->double_sided = sides ? strcmp(sides, "both") == 0 : m->double_sided;
}

/* ---- a material ---- */

static bool read_look(struct lum_gltf *g, const cJSON *o, struct look *m)
{
    *m = (struct look){.base_color = {1, 1, 1, 1},
                       .ior = 1.5,
                       .specular = 1,
                       .clearcoat_normal_scale = 1,
                       .specular_color = {1, 1, 1},
                       .thin = true,
                       .attenuation_color = {1, 1, 1}};
    const cJSON *glossy = lum_gltf_extension(g, o, "KHR_materials_pbrSpecularGlossiness");
    if (glossy)
        read_specular_glossiness(g, glossy, m);
    else
        read_metallic_roughness(g, o, m);
    read_dielectric(g, o, m);
    m->unlit = lum_gltf_extension(g, o, "KHR_materials_unlit") != NULL;
    read_diffuse_transmission(g, o, m);
    read_sheen(g, o, m);
    read_clearcoat(g, o, m);
    read_anisotropy(g, o, m);
    read_emission(g, o, m);
    read_alpha(g, o, m);
    read_texture(g, o, "normalTexture", true, &m->normal_texture);
    m->normal_scale = lum_gltf_number(g, lum_gltf_object(g, o, "normalTexture"), "scale", 1.0);
    m->double_sided = lum_gltf_bool(g, o, "doubleSided", false);
    read_ours(g, o, m);
    if (m->unlit && !m->record)
        make_matt(g, m);
    warn_left_out(g, o);
    return lum_gltf_ok(g);
}

/* A mesh has one set of texture coordinates: that of the base colour, else of the first texture there is. Textures that
 * use another one are left out. */
static uint32_t choose_uv_set(struct lum_gltf *g, struct look *m)
{
    struct texture *const all[] = {
        &m->base_color_texture,          &m->emission_texture,         &m->normal_texture,
        &m->metallic_roughness_texture,  &m->anisotropy_texture,       &m->clearcoat_texture,
        &m->clearcoat_roughness_texture, &m->clearcoat_normal_texture, &m->specular_texture,
        &m->specular_color_texture,      &m->transmission_texture,     &m->diffuse_transmission_texture};
    const struct texture *first = NULL;
    for (size_t i = 0; i < LUM_ARRAY_LEN(all); i++) {
        if (!all[i]->image)
            continue;
        if (!first)
            first = all[i];
        if (all[i]->uv_set != first->uv_set) {
            lum_gltf_warn(g, "a texture on TEXCOORD_%u is left out: others use TEXCOORD_%u", all[i]->uv_set,
                          first->uv_set);
            all[i]->image = NULL;
        }
    }
    return first ? first->uv_set : 0;
}

/* ---- sending ---- */

static void put_texture(struct lum_op_text *op, const char *key, const struct texture *t)
{
    if (!t->image)
        return;
    lum_op_object(op, key);
    lum_op_string(op, "image", t->image);
    lum_op_numbers(op, "offset", t->offset, 2);
    lum_op_numbers(op, "scale", t->scale, 2);
    lum_op_number(op, "rotation_rad", t->rotation);
    lum_op_string(op, "wrap_u", t->wrap_u);
    lum_op_string(op, "wrap_v", t->wrap_v);
    lum_op_close(op);
}

/* A back that glTF does not show ("doubleSided": false) gives no light. */
static void put_emission(struct lum_op_text *op, const struct look *m)
{
    if (!(m->emission_cd_m2 > 0.0) && !m->record)
        return;
    lum_op_numbers(op, "emission_color", m->emission_color, 3);
    lum_op_number(op, "emission_cd_m2", m->emission_cd_m2);
    lum_op_string(op, "emission_sides", m->double_sided ? "both" : "front");
    put_texture(op, "emission_texture", &m->emission_texture);
}

static enum lum_status send_look(struct lum_gltf *g, const char *id, const struct look *m, struct lum_error *err)
{
    struct lum_op_text op;
    lum_op_begin(&op, "material", id);
    lum_op_numbers(&op, "base_color", m->base_color, 3);
    lum_op_number(&op, "metallic", m->metallic);
    lum_op_number(&op, "roughness", m->roughness);
    lum_op_number(&op, "ior", m->ior);
    lum_op_number(&op, "specular", m->specular);
    lum_op_numbers(&op, "specular_color", m->specular_color, 3);
    put_texture(&op, "specular_texture", &m->specular_texture);
    put_texture(&op, "specular_color_texture", &m->specular_color_texture);
    if (m->transmission > 0.0 || m->record) {
        lum_op_number(&op, "transmission", m->transmission);
        put_texture(&op, "transmission_texture", &m->transmission_texture);
        lum_op_bool(&op, "thin", m->thin);
        lum_op_numbers(&op, "attenuation_color", m->attenuation_color, 3);
        if (m->has_attenuation)
            lum_op_number(&op, "attenuation_distance", m->attenuation_distance);
    }
    if (m->diffuse_transmittance[0] + m->diffuse_transmittance[1] + m->diffuse_transmittance[2] > 0.0) {
        lum_op_numbers(&op, "diffuse_transmittance", m->diffuse_transmittance, 3);
        lum_op_number(&op, "diffuse_transmission_share", m->diffuse_transmission_share);
        put_texture(&op, "diffuse_transmission_texture", &m->diffuse_transmission_texture);
    }
    if (m->sheen_color[0] + m->sheen_color[1] + m->sheen_color[2] > 0.0 || m->record) {
        lum_op_numbers(&op, "sheen_color", m->sheen_color, 3);
        lum_op_number(&op, "sheen_roughness", m->sheen_roughness);
    }
    if (m->anisotropy > 0.0 || m->record) {
        lum_op_number(&op, "anisotropy", m->anisotropy);
        lum_op_number(&op, "anisotropy_rotation_deg", m->anisotropy_rotation_deg);
        put_texture(&op, "anisotropy_texture", &m->anisotropy_texture);
    }
    if (m->clearcoat > 0.0 || m->record) {
        lum_op_number(&op, "clearcoat", m->clearcoat);
        lum_op_number(&op, "clearcoat_roughness", m->clearcoat_roughness);
        lum_op_number(&op, "clearcoat_normal_scale", m->clearcoat_normal_scale);
        put_texture(&op, "clearcoat_texture", &m->clearcoat_texture);
        put_texture(&op, "clearcoat_roughness_texture", &m->clearcoat_roughness_texture);
        put_texture(&op, "clearcoat_normal_texture", &m->clearcoat_normal_texture);
    }
    put_emission(&op, m);
    lum_op_string(&op, "alpha_mode", m->alpha_mode);
    lum_op_number(&op, "alpha", m->base_color[3]);
    lum_op_number(&op, "alpha_cutoff", m->alpha_cutoff);
    put_texture(&op, "base_color_texture", &m->base_color_texture);
    put_texture(&op, "metallic_roughness_texture", &m->metallic_roughness_texture);
    if (m->unlit && m->record)
        lum_op_bool(&op, "unlit", true);
    if (m->normal_texture.image || m->record)
        lum_op_number(&op, "normal_scale", m->normal_scale);
    put_texture(&op, "normal_texture", &m->normal_texture);
    return lum_emit_op(&g->im->emit, &op, err);
}

const struct lum_gltf_material *lum_gltf_material(struct lum_gltf *g, uint32_t index)
{
    uint32_t n = g->arrays[LUM_GLTF_MATERIALS].n;
    bool is_default = index >= n;
    struct lum_gltf_material *material = &g->materials[is_default ? n : index];
    if (material->done)
        return material;
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_MATERIALS, index);
    enum lum_gltf_kind kind = g->at_kind;
    uint32_t at = g->at_index;
    struct look look;
    const char *same_as = lum_gltf_ours_text(lum_gltf_ours(o), "same_as");
    uint32_t other;
    if (same_as && lum_ids_again(&g->im->ids, same_as, material->id) &&
        lum_ids_find(&g->im->ids, material->id, &other) && other < n && g->materials[other].done) {
        *material = g->materials[other]; /* with the light of an object, whose record says so */
        return material;
    }
    if (!is_default)
        lum_gltf_at(g, LUM_GLTF_MATERIALS, index);
    if (!read_look(g, o, &look))
        return NULL;
    material->uv_set = choose_uv_set(g, &look);
    material->shines = look.emission_cd_m2 > 0.0;
    material->evenly = !look.emission_texture.image;
    material->turns = look.normal_texture.image || look.clearcoat_normal_texture.image || look.anisotropy > 0.0;
    struct lum_id_request name = {"material/", is_default ? "default" : lum_gltf_string(g, o, "name"), "material",
                                  index};
    struct lum_error err;
    const char *was = lum_gltf_ours_text(look.record, "id");
    bool known = was && lum_ids_again(&g->im->ids, was, material->id) && !lum_ids_find(&g->im->ids, material->id, NULL);
    enum lum_status status = known ? lum_ids_take(&g->im->ids, material->id, index, &err)
                                   : lum_ids_make(&g->im->ids, &name, material->id, &err);
    if (!status)
        status = send_look(g, material->id, &look, &err);
    if (status) {
        lum_gltf_fail(g, status, "%s", err.text);
        return NULL;
    }
    material->done = true;
    lum_gltf_at(g, kind, at);
    return material;
}
