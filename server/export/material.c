/* Materials: metallic-roughness with the KHR extensions that lumend-import reads. */
#include <math.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "core/math/color.h"
#include "core/scene/desc.h"
#include "protocol/json/json.h"
#include "server/export/internal.h"

#define PI 3.14159265358979323846

static double luminance_of(const double c[3])
{
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

static bool any(const double c[3])
{
    return c[0] > 0.0 || c[1] > 0.0 || c[2] > 0.0;
}

static bool add_numbers(cJSON *o, const char *key, const double *v, int n)
{
    return lum_json_add(o, key, cJSON_CreateDoubleArray(v, n));
}

void lum_export_emission(const struct lum_record_material *m, double ret_emission[3])
{
    double y = luminance_of(m->emission_color);
    for (int i = 0; i < 3; i++)
        ret_emission[i] = y > 0.0 ? m->emission_cd_m2 * m->emission_color[i] / y : 0.0;
}

/* ---- diffuse transmission ---- */

/* glTF has a share of the base that passes, in a colour of its own, and leaves the rest of the base's colour to what is
 * reflected; a data sheet has the two colours. The share is as large as the colour that passes needs it, or as the
 * record says it. False: glTF cannot say both. */
static bool split_base(const struct lum_record_material *m, double ret_base[3], double *ret_share, double ret_color[3])
{
    double share = fmax(m->diffuse_transmittance[0], fmax(m->diffuse_transmittance[1], m->diffuse_transmittance[2]));
    bool ok = !m->diffuse_transmission_texture.image[0] || m->diffuse_transmission_share >= share;
    share = share > 0.0 ? fmax(share, m->diffuse_transmission_share) : 0.0;
    *ret_share = share;
    for (int i = 0; i < 3; i++) {
        double base = share < 1.0 ? m->base_color[i] / (1.0 - share) : 0.0;
        ok = ok && base <= 1.0 + 1e-9 && (share < 1.0 || m->base_color[i] == 0.0);
        ret_base[i] = fmin(base, 1.0);
        ret_color[i] = share > 0.0 ? m->diffuse_transmittance[i] / share : 1.0;
    }
    return ok;
}

/* ---- parts ---- */

static bool add_base(struct lum_exporting *x, cJSON *o, const struct lum_record_material *m, bool *ret_whole)
{
    cJSON *pbr = cJSON_CreateObject();
    double base[4] = {0, 0, 0, m->alpha}, share, color[3];
    bool ok = true;
    *ret_whole = !split_base(m, base, &share, color);
    if (share > 0.0) {
        cJSON *ext = lum_glb_extension(x->glb, o, "KHR_materials_diffuse_transmission");
        ok = ext && lum_json_add_number(ext, "diffuseTransmissionFactor", share) &&
             add_numbers(ext, "diffuseTransmissionColorFactor", color, 3);
        lum_export_texture(x, ext, "diffuseTransmissionTexture", &m->diffuse_transmission_texture);
    }
    ok = ok && add_numbers(pbr, "baseColorFactor", base, 4) &&
         lum_json_add_number(pbr, "metallicFactor", m->metallic) &&
         lum_json_add_number(pbr, "roughnessFactor", m->roughness);
    lum_export_texture(x, pbr, "baseColorTexture", &m->base_color_texture);
    lum_export_texture(x, pbr, "metallicRoughnessTexture", &m->metallic_roughness_texture);
    return lum_json_add(o, "pbrMetallicRoughness", pbr) && ok;
}

static bool add_dielectric(struct lum_exporting *x, cJSON *o, const struct lum_record_material *m)
{
    static const double white[3] = {1.0, 1.0, 1.0};
    bool ok = true;
    if (m->ior != 1.5)
        ok = lum_json_add_number(lum_glb_extension(x->glb, o, "KHR_materials_ior"), "ior", m->ior);
    bool colored = memcmp(m->specular_color, white, sizeof white) != 0;
    if (m->specular != 1.0 || colored || m->specular_texture.image[0] || m->specular_color_texture.image[0]) {
        cJSON *ext = lum_glb_extension(x->glb, o, "KHR_materials_specular");
        ok = ok && lum_json_add_number(ext, "specularFactor", m->specular) &&
             add_numbers(ext, "specularColorFactor", m->specular_color, 3);
        lum_export_texture(x, ext, "specularTexture", &m->specular_texture);
        lum_export_texture(x, ext, "specularColorTexture", &m->specular_color_texture);
    }
    if (m->transmission <= 0.0)
        return ok;
    cJSON *passes = lum_glb_extension(x->glb, o, "KHR_materials_transmission");
    ok = ok && lum_json_add_number(passes, "transmissionFactor", m->transmission);
    lum_export_texture(x, passes, "transmissionTexture", &m->transmission_texture);
    if (m->thin)
        return ok;
    cJSON *volume = lum_glb_extension(x->glb, o, "KHR_materials_volume");
    ok = ok && lum_json_add_number(volume, "thicknessFactor", 1.0) && /* any above 0: the mesh says how thick it is */
         add_numbers(volume, "attenuationColor", m->attenuation_color, 3);
    return ok && (!m->attenuation_distance.set ||
                  lum_json_add_number(volume, "attenuationDistance", m->attenuation_distance.value));
}

static bool add_coats(struct lum_exporting *x, cJSON *o, const struct lum_record_material *m)
{
    bool ok = true;
    if (any(m->sheen_color)) {
        cJSON *ext = lum_glb_extension(x->glb, o, "KHR_materials_sheen");
        ok = add_numbers(ext, "sheenColorFactor", m->sheen_color, 3) &&
             lum_json_add_number(ext, "sheenRoughnessFactor", m->sheen_roughness);
    }
    if (m->clearcoat > 0.0) {
        cJSON *ext = lum_glb_extension(x->glb, o, "KHR_materials_clearcoat");
        ok = ok && lum_json_add_number(ext, "clearcoatFactor", m->clearcoat) &&
             lum_json_add_number(ext, "clearcoatRoughnessFactor", m->clearcoat_roughness);
        lum_export_texture(x, ext, "clearcoatTexture", &m->clearcoat_texture);
        lum_export_texture(x, ext, "clearcoatRoughnessTexture", &m->clearcoat_roughness_texture);
        lum_export_texture(x, ext, "clearcoatNormalTexture", &m->clearcoat_normal_texture);
        cJSON *normal = cJSON_GetObjectItemCaseSensitive(ext, "clearcoatNormalTexture");
        if (normal && m->clearcoat_normal_scale != 1.0)
            ok = ok && lum_json_add_number(normal, "scale", m->clearcoat_normal_scale);
    }
    if (m->anisotropy > 0.0) {
        cJSON *ext = lum_glb_extension(x->glb, o, "KHR_materials_anisotropy");
        ok = ok && lum_json_add_number(ext, "anisotropyStrength", m->anisotropy) &&
             lum_json_add_number(ext, "anisotropyRotation", m->anisotropy_rotation_deg * PI / 180.0);
        lum_export_texture(x, ext, "anisotropyTexture", &m->anisotropy_texture);
    }
    return ok;
}

/* A factor of 1 at most, and how often that many cd/m2. */
static bool add_emission(struct lum_exporting *x, cJSON *o, const struct lum_record_material *m,
                         const double emission[3])
{
    double most = fmax(emission[0], fmax(emission[1], emission[2]));
    if (!(most > 0.0))
        return true;
    double factor[3] = {emission[0] / most, emission[1] / most, emission[2] / most};
    lum_export_texture(x, o, "emissiveTexture", &m->emission_texture);
    return add_numbers(o, "emissiveFactor", factor, 3) &&
           lum_json_add_number(lum_glb_extension(x->glb, o, "KHR_materials_emissive_strength"), "emissiveStrength",
                               most);
}

static bool add_surface(struct lum_exporting *x, cJSON *o, const struct lum_record_material *m)
{
    bool mask = strcmp(m->alpha_mode, "mask") == 0, blend = strcmp(m->alpha_mode, "blend") == 0, ok = true;
    lum_export_texture(x, o, "normalTexture", &m->normal_texture);
    cJSON *normal = cJSON_GetObjectItemCaseSensitive(o, "normalTexture");
    if (normal && m->normal_scale != 1.0)
        ok = lum_json_add_number(normal, "scale", m->normal_scale);
    if (mask || blend)
        ok = ok && lum_json_add_string(o, "alphaMode", mask ? "MASK" : "BLEND");
    if (mask)
        ok = ok && lum_json_add_number(o, "alphaCutoff", m->alpha_cutoff);
    if (strcmp(m->emission_sides, "front") != 0) /* surfaces are seen from both sides; which shine is what it says */
        ok = ok && lum_json_add_bool(o, "doubleSided", true);
    if (m->unlit)
        ok = ok && lum_glb_extension(x->glb, o, "KHR_materials_unlit");
    return ok;
}

/* ---- materials ---- */

static cJSON *material_json(struct lum_exporting *x, const struct lum_record *r, const double emission[3],
                            bool *ret_whole)
{
    const struct lum_record_material *m = &r->material;
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "name", r->id) && add_base(x, o, m, ret_whole) && add_dielectric(x, o, m) &&
              add_coats(x, o, m) && add_emission(x, o, m, emission) && add_surface(x, o, m);
    if (!ok)
        lum_glb_fail_memory(x->glb);
    return o;
}

/* Textures are told by glTF alone. */
static void drop_textures(cJSON *record)
{
    static const char *const textures[] = {LUM_TEXTURES(LUM_TEXTURE_FIELD)};
    for (size_t i = 0; i < LUM_ARRAY_LEN(textures); i++)
        cJSON_DeleteItemFromObjectCaseSensitive(record, textures[i]);
}

uint32_t lum_export_material(struct lum_exporting *x, struct lum_export_entry *e)
{
    double emission[3];
    bool whole = false;
    if (e->index != LUM_EXPORT_NONE || !lum_glb_ok(x->glb))
        return e->index;
    lum_export_emission(&e->record->material, emission);
    cJSON *o = material_json(x, e->record, emission, &whole), *ours = lum_export_extras(x, o, e->record);
    if (ours)
        drop_textures(cJSON_GetObjectItemCaseSensitive(ours, "record"));
    if (ours && (whole || e->record->material.unlit) && !lum_json_add_bool(ours, "whole", true))
        lum_glb_fail_memory(x->glb);
    return e->index = lum_glb_add(x->glb, LUM_GLB_MATERIALS, o);
}

uint32_t lum_export_variant(struct lum_exporting *x, struct lum_export_entry *e, const double emission[3])
{
    double own[3];
    bool whole;
    lum_export_emission(&e->record->material, own);
    if (memcmp(own, emission, sizeof own) == 0)
        return e->index;
    for (const struct lum_export_variant *v = e->variants; v; v = v->next)
        if (memcmp(v->emission, emission, sizeof v->emission) == 0)
            return v->material;
    struct lum_export_variant *v = lum_calloc(1, sizeof *v);
    cJSON *o = material_json(x, e->record, emission, &whole), *extras = cJSON_CreateObject(),
          *ours = cJSON_CreateObject();
    bool ok = lum_json_add_string(ours, "same_as", e->record->id);
    ok = lum_json_add(extras, "lumend", ours) && ok;
    ok = lum_json_add(o, "extras", extras) && ok;
    if (!ok || !v)
        lum_glb_fail_memory(x->glb);
    uint32_t index = lum_glb_add(x->glb, LUM_GLB_MATERIALS, o);
    if (!v)
        return index;
    *v = (struct lum_export_variant){.next = e->variants, .material = index};
    memcpy(v->emission, emission, sizeof v->emission);
    e->variants = v;
    return index;
}
