/* Materials, objects, lights, cameras and media: checked, then stored. */
#include "core/light/web.h"
#include "core/material/brushed.h"
#include "core/math/vec3d.h"
#include "core/scene/light_kind.h"
#include "core/scene/tables.h"

#include <stdio.h>
#include <string.h>

/* ---- materials ---- */

static enum lum_status check_material_numbers(const struct lum_material_desc *d, struct lum_error *err)
{
    const struct {
        const char *field;
        double value, lo, hi;
    } checks[] = {
        {"metallic", (double)d->metallic, 0, 1},
        {"roughness", (double)d->roughness, 0, 1},
        {"ior", (double)d->ior, 1, 4},
        {"specular", (double)d->specular, 0, 1},
        {"transmission", (double)d->transmission, 0, 1},
        {"diffuse_transmission_share", (double)d->diffuse_transmission_share, 0, (double)0.999f},
        {"sheen_roughness", (double)d->sheen_roughness, 0, 1},
        {"clearcoat", (double)d->clearcoat, 0, 1},
        {"clearcoat_roughness", (double)d->clearcoat_roughness, 0, 1},
        {"anisotropy", (double)d->anisotropy, 0, 1},
        {"anisotropy_rotation_deg", d->anisotropy_rotation_deg, -3600, 3600},
        {"normal_scale", (double)d->normal_scale, -100, 100},
        {"clearcoat_normal_scale", (double)d->clearcoat_normal_scale, -100, 100},
        {"emission_cd_m2", d->emission_cd_m2, 0, LUM_POWER_MAX},
        {"alpha", (double)d->alpha, 0, 1},
        {"alpha_cutoff", (double)d->alpha_cutoff, 0, 1000},
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(checks); i++) {
        enum lum_status status = lum_check_range(checks[i].field, checks[i].value, checks[i].lo, checks[i].hi, err);
        if (status != LUM_OK)
            return status;
    }
    if ((unsigned)d->alpha_mode > LUM_ALPHA_BLEND)
        return lum_fail(err, LUM_ERR_INVALID, "alpha_mode", "is not a kind of alpha");
    if (!(d->attenuation_distance_m > 0.0))
        return lum_fail(err, LUM_ERR_INVALID, "attenuation_distance_m", "must be above 0 (infinite: clear)");
    return LUM_OK;
}

/* What is transmitted is not reflected. The excess that is let pass is the rounding of two floats that add up to 1. */
static enum lum_status check_sheet(const struct lum_material_desc *d, struct lum_error *err)
{
    const float reflected[3] = {d->base_color.r, d->base_color.g, d->base_color.b};
    const float passed[3] = {d->diffuse_transmittance.r, d->diffuse_transmittance.g, d->diffuse_transmittance.b};
    for (int c = 0; c < 3; c++)
        if (passed[c] > 0.0f && !(reflected[c] + passed[c] <= 1.0f + 0x1p-20f))
            return lum_fail(err, LUM_ERR_INVALID, "diffuse_transmittance",
                            "and base_color must add up to at most 1 in each channel; %g and %g do not",
                            (double)passed[c], (double)reflected[c]);
    return LUM_OK;
}

static enum lum_status check_material(const struct lum_material_desc *d, struct lum_error *err)
{
    const struct {
        const char *field;
        struct lum_rgb value;
        float most;
    } colors[] = {{"base_color", d->base_color, 1.0f},
                  {"specular_color", d->specular_color, 100.0f},
                  {"attenuation_color", d->attenuation_color, 1.0f},
                  {"emission", d->emission, 100.0f},
                  {"diffuse_transmittance", d->diffuse_transmittance, 1.0f},
                  {"sheen_color", d->sheen_color, 1.0f}};
    enum lum_status status = check_material_numbers(d, err);
    for (size_t i = 0; i < LUM_ARRAY_LEN(colors) && status == LUM_OK; i++)
        status = lum_check_rgb(colors[i].field, colors[i].value, colors[i].most, err);
    return status == LUM_OK ? check_sheet(d, err) : status;
}

static struct lum_texture_desc *texture_slot(struct lum_material_desc *d, int slot)
{
#define SLOT(SLOT, name) &d->name##_texture,
    struct lum_texture_desc *const slots[LUM_SLOT_COUNT] = {LUM_TEXTURES(SLOT)};
    return slots[slot];
}

/* Finds the images and clears the borrowed ids. */
static enum lum_status bind_textures(const struct lum_scene *scene, struct lum_material_desc *d,
                                     struct lum_image_entry *images[LUM_SLOT_COUNT], struct lum_error *err)
{
    static const char *const fields[LUM_SLOT_COUNT] = {LUM_TEXTURES(LUM_TEXTURE_FIELD)};
    for (int i = 0; i < LUM_SLOT_COUNT; i++) {
        struct lum_texture_desc *t = texture_slot(d, i);
        if (!t->image || !t->image[0])
            continue;
        const float numbers[] = {t->offset[0], t->offset[1], t->scale[0], t->scale[1], t->rotation_rad};
        for (size_t k = 0; k < LUM_ARRAY_LEN(numbers); k++)
            if (!(fabsf(numbers[k]) <= 1e6f))
                return lum_fail(err, LUM_ERR_INVALID, fields[i], "the texture transform must be finite, at most 1e6");
        if ((unsigned)t->wrap_u > LUM_WRAP_CLAMP || (unsigned)t->wrap_v > LUM_WRAP_CLAMP)
            return lum_fail(err, LUM_ERR_INVALID, fields[i], "is not a kind of wrapping");
        struct lum_entry *entry = NULL;
        enum lum_status status = lum_scene_lookup(scene, LUM_ENTITY_IMAGE, t->image, fields[i], &entry, err);
        if (status != LUM_OK)
            return status;
        images[i] = (struct lum_image_entry *)entry;
        t->image = NULL;
    }
    return LUM_OK;
}

/* What textures say is not known here: tables are then for all that they may. One that serves is shared, also with the
 * material that is replaced. */
static enum lum_status find_brushed(const struct lum_scene *scene, const struct lum_material_desc *d,
                                    struct lum_image_entry *const images[LUM_SLOT_COUNT],
                                    struct lum_brushed_table **ret_table, struct lum_error *err)
{
    float strength = images[LUM_SLOT_ANISOTROPY] ? -1.0f : d->anisotropy;
    float alpha = images[LUM_SLOT_METALLIC_ROUGHNESS] ? -1.0f : d->roughness * d->roughness;
    const struct lum_table *table = &scene->tables[LUM_ENTITY_MATERIAL];
    *ret_table = NULL;
    if (!(d->anisotropy > 0.0f))
        return LUM_OK;
    for (uint32_t i = 0; i < table->n && !*ret_table; i++) {
        const struct lum_brushed_table *other = ((const struct lum_material_entry *)table->rows[i])->brushed;
        if (other && lum_brushed_table_serves(other, strength, alpha))
            *ret_table = lum_brushed_table_ref(other);
    }
    if (!*ret_table)
        *ret_table = lum_brushed_table_create(strength, alpha);
    return *ret_table ? LUM_OK : lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a brushed material");
}

enum lum_status lum_scene_put_material(struct lum_scene *scene, const char *id, const struct lum_material_desc *desc,
                                       struct lum_error *err)
{
    struct lum_material_desc d = *desc;
    struct lum_image_entry *images[LUM_SLOT_COUNT] = {NULL};
    enum lum_status status = check_material(&d, err);
    if (status == LUM_OK)
        status = bind_textures(scene, &d, images, err);
    struct lum_entry *base = NULL;
    struct lum_table *table = &scene->tables[LUM_ENTITY_MATERIAL];
    struct lum_brushed_table *brushed = NULL;
    if (status == LUM_OK)
        status = lum_table_open(table, id, sizeof(struct lum_material_entry), &base, err);
    if (status != LUM_OK)
        return status;
    status = find_brushed(scene, &d, images, &brushed, err);
    if (status != LUM_OK) {
        lum_table_drop(table, base);
        return status;
    }
    struct lum_material_entry *entry = (struct lum_material_entry *)base;
    lum_brushed_table_unref(entry->brushed);
    entry->brushed = brushed;
    for (int i = 0; i < LUM_SLOT_COUNT; i++) {
        lum_entry_move_use(entry->images[i], images[i]);
        entry->images[i] = images[i];
    }
    entry->desc = d;
    lum_table_keep(table, base);
    return LUM_OK;
}

/* ---- objects ---- */

/* The name of what shines in no group is its own id. */
static void name_group(char ret_group[LUM_ID_MAX + 1], const char *group, const char *id)
{
    snprintf(ret_group, LUM_ID_MAX + 1, "%s", group && group[0] ? group : id);
}

static enum lum_status check_group(const char *group, struct lum_error *err)
{
    if (lum_bounded_length(group, LUM_ID_MAX + 1) > LUM_ID_MAX)
        return lum_fail(err, LUM_ERR_INVALID, "group", "a group name has at most %d bytes", LUM_ID_MAX);
    return LUM_OK;
}

static enum lum_status check_transform(const struct lum_affined *m, struct lum_error *err)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            if (!(fabs(m->m[i][j]) <= LUM_LENGTH_MAX))
                return lum_fail(err, LUM_ERR_INVALID, "transform", "must be finite and at most %g", LUM_LENGTH_MAX);
    struct lum_affined inverse;
    if (!lum_affined_invert(m, &inverse))
        return lum_fail(err, LUM_ERR_INVALID, "transform", "is singular: it flattens the object");
    return LUM_OK;
}

static enum lum_status check_shine(const struct lum_shine *s, struct lum_error *err)
{
    static const char *const fields[] = {"emission", "flux_lm", "luminance_cd_m2"};
    if ((unsigned)s->unit > LUM_SHINE_LUMINANCE)
        return lum_fail(err, LUM_ERR_INVALID, "emission", "is not a unit of light");
    enum lum_status status = lum_check_range(fields[s->unit], s->amount, 0.0, LUM_POWER_MAX, err);
    if (status == LUM_OK && s->has_color)
        status = lum_check_rgb("color", s->color, 100.0f, err);
    return status == LUM_OK ? check_group(s->group, err) : status;
}

enum lum_status lum_scene_put_object(struct lum_scene *scene, const char *id, const struct lum_object_desc *desc,
                                     struct lum_error *err)
{
    struct lum_entry *mesh = NULL, *material = NULL, *base = NULL;
    enum lum_status status = lum_scene_lookup(scene, LUM_ENTITY_MESH, desc->mesh, "mesh", &mesh, err);
    if (status == LUM_OK)
        status = lum_scene_lookup(scene, LUM_ENTITY_MATERIAL, desc->material, "material", &material, err);
    if (status == LUM_OK)
        status = check_transform(&desc->local_to_world, err);
    if (status == LUM_OK)
        status = check_shine(&desc->shine, err);
    struct lum_table *table = &scene->tables[LUM_ENTITY_OBJECT];
    if (status == LUM_OK)
        status = lum_table_open(table, id, sizeof(struct lum_object_entry), &base, err);
    if (status != LUM_OK)
        return status;
    struct lum_object_entry *entry = (struct lum_object_entry *)base;
    lum_entry_move_use(entry->mesh, mesh);
    lum_entry_move_use(entry->material, material);
    entry->mesh = (struct lum_mesh_entry *)mesh;
    entry->material = (struct lum_material_entry *)material;
    entry->local_to_world = desc->local_to_world;
    entry->visible = desc->visible;
    entry->shine = desc->shine;
    entry->shine.group = NULL;
    name_group(entry->group, desc->shine.group, id);
    lum_table_keep(table, base);
    return LUM_OK;
}

/* ---- lights ---- */

static enum lum_status check_light(const struct lum_light_desc *d, struct lum_error *err)
{
    enum lum_status status = check_group(d->group, err);
    if (status == LUM_OK)
        status = lum_light_kind_check(d, err);
    if (status == LUM_OK)
        status = lum_check_rgb("color", d->color, 100.0f, err);
    if (status == LUM_OK)
        status = lum_check_range("intensity", d->intensity, 0.0, LUM_POWER_MAX, err);
    return status;
}

enum lum_status lum_scene_take_web(const struct lum_scene *scene, const struct lum_web_desc *desc,
                                   struct lum_web **ret_web, struct lum_error *err)
{
    const struct lum_table *lights = &scene->tables[LUM_ENTITY_LIGHT];
    uint64_t hash = lum_web_desc_hash(desc);
    for (uint32_t i = 0; i < lights->n; i++) {
        const struct lum_web *web = ((const struct lum_light_entry *)lights->rows[i])->desc.web;
        if (web && web->hash == hash) {
            *ret_web = lum_web_ref(web);
            return LUM_OK;
        }
    }
    return lum_web_create(desc, ret_web, err);
}

enum lum_status lum_scene_put_light(struct lum_scene *scene, const char *id, const struct lum_light_desc *desc,
                                    struct lum_error *err)
{
    enum lum_status status = check_light(desc, err);
    struct lum_entry *image = NULL, *base = NULL;
    if (status == LUM_OK && desc->kind == &lum_light_kind_environment && desc->image && desc->image[0])
        status = lum_scene_lookup(scene, LUM_ENTITY_IMAGE, desc->image, "image", &image, err);
    struct lum_table *table = &scene->tables[LUM_ENTITY_LIGHT];
    if (status == LUM_OK)
        status = lum_table_open(table, id, sizeof(struct lum_light_entry), &base, err);
    if (status != LUM_OK)
        return status;
    struct lum_light_entry *entry = (struct lum_light_entry *)base;
    const struct lum_web *web = entry->desc.web;
    name_group(entry->group, desc->group, id);
    lum_entry_move_use(entry->image, image);
    entry->image = (struct lum_image_entry *)image;
    entry->desc = *desc;
    entry->desc.image = entry->desc.group = NULL;
    entry->desc.web = desc->kind == &lum_light_kind_ies ? lum_web_ref(desc->web) : NULL;
    lum_web_unref(web);
    lum_table_keep(table, base);
    return LUM_OK;
}

/* ---- cameras ---- */

enum lum_status lum_scene_put_camera(struct lum_scene *scene, const char *id, const struct lum_camera *camera,
                                     struct lum_error *err)
{
    enum lum_status status = lum_check_vec("position", camera->position, err);
    if (status == LUM_OK)
        status = lum_check_vec("target", camera->target, err);
    if (status == LUM_OK)
        status = lum_check_vec("up", camera->up, err);
    if (status == LUM_OK)
        status = lum_check_range("vfov_deg", camera->vfov_deg, 1.0, 179.0, err);
    if (status != LUM_OK)
        return status;
    struct lum_vec3d gaze = lum_v3d_sub(camera->target, camera->position);
    if (!(lum_v3d_length(gaze) > 0.0))
        return lum_fail(err, LUM_ERR_INVALID, "target", "must differ from the position");
    if (!(lum_v3d_length(lum_v3d_cross(gaze, camera->up)) > 1e-9 * lum_v3d_length(gaze) * lum_v3d_length(camera->up)))
        return lum_fail(err, LUM_ERR_INVALID, "up", "must not be parallel to the line of sight");
    struct lum_table *table = &scene->tables[LUM_ENTITY_CAMERA];
    struct lum_entry *base = NULL;
    status = lum_table_open(table, id, sizeof(struct lum_camera_entry), &base, err);
    if (status != LUM_OK)
        return status;
    ((struct lum_camera_entry *)base)->camera = *camera;
    lum_table_keep(table, base);
    return LUM_OK;
}

/* ---- media ---- */

#define SIGMA_MAX 1e6f /* 1/m: nothing is seen through a micrometre */

static enum lum_status check_box(const struct lum_medium_desc *d, struct lum_error *err)
{
    enum lum_status status = lum_check_vec("box", d->lo, err);
    if (status == LUM_OK)
        status = lum_check_vec("box", d->hi, err);
    if (status == LUM_OK && !(d->lo.x < d->hi.x && d->lo.y < d->hi.y && d->lo.z < d->hi.z))
        return lum_fail(err, LUM_ERR_INVALID, "box", "min must be below max on every axis");
    return status;
}

enum lum_status lum_scene_put_medium(struct lum_scene *scene, const char *id, const struct lum_medium_desc *desc,
                                     struct lum_error *err)
{
    enum lum_status status = lum_check_rgb("sigma_s", desc->sigma_s, SIGMA_MAX, err);
    if (status == LUM_OK)
        status = lum_check_rgb("sigma_a", desc->sigma_a, SIGMA_MAX, err);
    if (status == LUM_OK)
        status = lum_check_range("g", (double)desc->g, -(double)LUM_MEDIUM_G_MAX, (double)LUM_MEDIUM_G_MAX, err);
    if (status == LUM_OK && !desc->everywhere)
        status = check_box(desc, err);
    struct lum_table *table = &scene->tables[LUM_ENTITY_MEDIUM];
    struct lum_entry *base = NULL;
    if (status == LUM_OK)
        status = lum_table_open(table, id, sizeof(struct lum_medium_entry), &base, err);
    if (status != LUM_OK)
        return status;
    ((struct lum_medium_entry *)base)->desc = *desc;
    lum_table_keep(table, base);
    return LUM_OK;
}
