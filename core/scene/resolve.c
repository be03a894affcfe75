/* Materials, instances, cameras and media as a renderer reads them. Every commit resolves all entries; parts that come
 * out equal to the last snapshot's are shared with it (commit.c), so nothing has to remember what was edited. Arrays
 * come zeroed and fields are set one by one, so that equal parts are equal bytes, padding included. */
#include "core/scene/tables.h"

#include <string.h>

#include "core/material/brushed.h"
#include "core/math/sampler.h"
#include "core/scene/parts.h"

/* ---- materials ---- */

static const struct lum_image *part_image(struct lum_image_entry *entry)
{
    return entry ? lum_image_ref(entry->image) : NULL;
}

/* KHR_texture_transform: translation * rotation * scale, with rotation counter-clockwise as seen with v down. */
static void resolve_texture(struct lum_texture *out, const struct lum_texture_desc *d, struct lum_image_entry *image)
{
    double c = cos((double)d->rotation_rad), s = sin((double)d->rotation_rad);
    double sx = (double)d->scale[0], sy = (double)d->scale[1];
    out->image = part_image(image);
    out->m[0][0] = (float)(c * sx);
    out->m[0][1] = (float)(s * sy);
    out->m[0][2] = d->offset[0];
    out->m[1][0] = (float)(-s * sx);
    out->m[1][1] = (float)(c * sy);
    out->m[1][2] = d->offset[1];
    out->wrap_u = d->wrap_u;
    out->wrap_v = d->wrap_v;
}

/* Beer-Lambert: attenuation_color is left after attenuation_distance. */
static float absorption(float color, double distance_scene)
{
    return (float)(-log(fmax((double)color, 1e-6)) / distance_scene);
}

static void resolve_material(struct lum_material *out, const struct lum_material_entry *entry,
                             const struct lum_normalisation *norm, bool straight_glass)
{
    const struct lum_material_desc *d = &entry->desc;
#define RESOLVE(SLOT, name)                                                                                            \
    resolve_texture(&out->name##_tex, &d->name##_texture, entry->images[LUM_SLOT_##SLOT]);                             \
    out->has_maps |= out->name##_tex.image != NULL;
    LUM_TEXTURES(RESOLVE)
    out->base_color = d->base_color;
    out->specular_color = d->specular_color;
    out->emission = lum_rgb_scale(d->emission, (float)d->emission_cd_m2);
    double distance = d->attenuation_distance_m * norm->scale;
    if (isfinite(distance))
        out->sigma_a =
            lum_rgb(absorption(d->attenuation_color.r, distance), absorption(d->attenuation_color.g, distance),
                    absorption(d->attenuation_color.b, distance));
    out->metallic = d->metallic;
    out->roughness = d->roughness;
    out->ior = d->ior;
    out->specular = d->specular;
    out->transmission = d->transmission;
    out->diffuse_transmittance = d->diffuse_transmittance;
    out->diffuse_transmission_share = d->diffuse_transmission_share;
    out->sheen_color = d->sheen_color;
    out->sheen_roughness = d->sheen_roughness;
    out->clearcoat = d->clearcoat;
    out->clearcoat_roughness = d->clearcoat_roughness;
    double stretch = d->anisotropy_rotation_deg * (double)LUM_PI / 180.0;
    out->brushed = entry->brushed ? lum_brushed_table_ref(entry->brushed) : NULL;
    out->anisotropy = d->anisotropy;
    out->stretch = (struct lum_vec2){(float)cos(stretch), (float)sin(stretch)};
    out->normal_scale = d->normal_scale;
    out->clearcoat_normal_scale = d->clearcoat_normal_scale;
    out->alpha = d->alpha;
    out->alpha_cutoff = d->alpha_cutoff;
    out->alpha_mode = d->alpha_mode;
    out->thin = d->thin;
    out->unlit = d->unlit;
    out->straight = straight_glass && !d->thin && d->transmission > 0.0f;
    out->front_emission = d->front_emission;
    out->reflects = lum_material_reflects(out);
    memcpy(out->id, entry->base.id, sizeof out->id);
}

enum lum_status lum_resolve_materials(const struct lum_scene *scene, const struct lum_normalisation *norm,
                                      struct lum_material_part **ret_part, struct lum_error *err)
{
    const struct lum_table *table = &scene->tables[LUM_ENTITY_MATERIAL];
    struct lum_material_part *part = lum_calloc(1, sizeof *part);
    struct lum_material *items = lum_calloc(table->n, sizeof *items);
    if (!part || !items) {
        lum_free(part);
        lum_free(items);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u materials", table->n);
    }
    lum_refs_init(&part->refs);
    part->items = items;
    part->n = table->n;
    for (uint32_t i = 0; i < table->n; i++)
        resolve_material(&items[i], (const struct lum_material_entry *)table->rows[i], norm, scene->straight_glass);
    *ret_part = part;
    return LUM_OK;
}

void lum_material_part_unref(struct lum_material_part *part)
{
    if (!part || !lum_refs_put(&part->refs))
        return;
    for (uint32_t i = 0; i < part->n; i++) {
        const struct lum_material *m = &part->items[i];
#define UNREF(SLOT, name) lum_image_unref((struct lum_image *)m->name##_tex.image);
        LUM_TEXTURES(UNREF)
        lum_brushed_table_unref(m->brushed);
    }
    lum_free(part->items);
    lum_free(part);
}

/* ---- instances ---- */

/* An instance that is flatter than 2^-30 units in some direction, in a scene of 32..64 units, is below what float rays
 * can resolve, and would make Embree's object-space rays overflow: it is left out. */
#define SHRINK_MAX 1073741824.0

static bool resolve_instance(struct lum_instance *out, const struct lum_object_entry *o, const struct lum_scene *scene,
                             const struct lum_normalisation *norm)
{
    const struct lum_mesh *mesh = o->mesh->mesh;
    struct lum_affined m = lum_affined_mul(&o->local_to_world, &mesh->local_to_given);
    const double centre[3] = {norm->centre.x, norm->centre.y, norm->centre.z};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            m.m[i][j] *= norm->scale;
        m.m[i][3] = (m.m[i][3] - centre[i]) * norm->scale;
    }
    struct lum_affined inverse;
    if (!lum_affined_invert(&m, &inverse))
        return false;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            if (fabs(inverse.m[i][j]) > SHRINK_MAX)
                return false;
            out->normal_m[i][j] = (float)inverse.m[j][i];
        }
    out->local_to_scene = lum_affine_from_double(&m);
    out->material = lum_table_lower_bound(&scene->tables[LUM_ENTITY_MATERIAL], o->material->base.id);
    out->light = LUM_NO_OBJECT;
    out->hash = lum_hash64_text(o->base.id);
    memcpy(out->id, o->base.id, sizeof out->id);
    out->mesh = lum_mesh_ref(o->mesh->mesh);
    return true;
}

/* Clear glass that bends nothing, tints nothing and shines by nothing is not there: light passes it as it passes air,
 * so rays need not stop at it (NOTES H19). */
static bool is_air(const struct lum_object_entry *o)
{
    const struct lum_material_desc *m = &o->material->desc;
    bool white = m->base_color.r == 1.0f && m->base_color.g == 1.0f && m->base_color.b == 1.0f &&
                 !o->material->images[LUM_SLOT_BASE_COLOR] && !o->mesh->mesh->colors;
    bool glass = m->transmission == 1.0f && !o->material->images[LUM_SLOT_TRANSMISSION];
    const struct lum_rgb *left = &m->attenuation_color;
    bool clear =
        m->thin || !isfinite(m->attenuation_distance_m) || (left->r == 1.0f && left->g == 1.0f && left->b == 1.0f);
    return glass && m->metallic == 0.0f && lum_ior_is_matched(m->ior) && white && clear && !m->unlit &&
           (m->emission_cd_m2 == 0.0 || lum_rgb_black(m->emission)) && o->shine.unit == LUM_SHINE_AS_MATERIAL;
}

enum lum_status lum_resolve_instances(const struct lum_scene *scene, const struct lum_normalisation *norm,
                                      struct lum_instance_part **ret_part, struct lum_error *err)
{
    const struct lum_table *table = &scene->tables[LUM_ENTITY_OBJECT];
    struct lum_instance_part *part = lum_calloc(1, sizeof *part);
    struct lum_instance *items = lum_calloc(table->n, sizeof *items);
    if (!part || !items) {
        lum_free(part);
        lum_free(items);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u objects", table->n);
    }
    lum_refs_init(&part->refs);
    part->items = items;
    for (uint32_t i = 0; i < table->n; i++) {
        const struct lum_object_entry *o = (const struct lum_object_entry *)table->rows[i];
        if (!o->visible || o->mesh->mesh->n_triangles == 0 || is_air(o))
            continue;
        if (resolve_instance(&items[part->n], o, scene, norm))
            part->n++;
        else
            memset(&items[part->n], 0, sizeof *items);
        if (o->material->brushed && !lum_mesh_make_tangents(o->mesh->mesh)) {
            lum_instance_part_unref(part);
            return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for tangents of \"%s\"", o->mesh->base.id);
        }
    }
    *ret_part = part;
    return LUM_OK;
}

void lum_instance_part_unref(struct lum_instance_part *part)
{
    if (!part || !lum_refs_put(&part->refs))
        return;
    for (uint32_t i = 0; i < part->n; i++)
        lum_mesh_unref((struct lum_mesh *)part->items[i].mesh);
    lum_free(part->items);
    lum_free(part);
}

bool lum_instances_same_geometry(const struct lum_instance_part *a, const struct lum_instance_part *b)
{
    if (a->n != b->n)
        return false;
    for (uint32_t i = 0; i < a->n; i++)
        if (strcmp(a->items[i].id, b->items[i].id) != 0 || a->items[i].mesh != b->items[i].mesh ||
            memcmp(&a->items[i].local_to_scene, &b->items[i].local_to_scene, sizeof(struct lum_affine)) != 0)
            return false;
    return true;
}

struct lum_bounds lum_instance_bounds(const struct lum_instance *instance)
{
    const struct lum_mesh *mesh = instance->mesh;
    struct lum_bounds b = LUM_BOUNDS_EMPTY;
    for (int corner = 0; corner < 8; corner++) {
        struct lum_vec3 p = lum_v3(corner & 1 ? mesh->bounds_hi.x : mesh->bounds_lo.x,
                                   corner & 2 ? mesh->bounds_hi.y : mesh->bounds_lo.y,
                                   corner & 4 ? mesh->bounds_hi.z : mesh->bounds_lo.z);
        lum_bounds_grow(&b, lum_affine_point(&instance->local_to_scene, p));
    }
    return b;
}

struct lum_bounds lum_instances_bounds(const struct lum_instance_part *part)
{
    struct lum_bounds all = LUM_BOUNDS_EMPTY;
    for (uint32_t i = 0; i < part->n; i++) {
        struct lum_bounds b = lum_instance_bounds(&part->items[i]);
        all = lum_bounds_join(&all, &b);
    }
    return all;
}

/* ---- cameras ---- */

enum lum_status lum_resolve_cameras(const struct lum_scene *scene, struct lum_camera_part **ret_part,
                                    struct lum_error *err)
{
    const struct lum_table *table = &scene->tables[LUM_ENTITY_CAMERA];
    struct lum_camera_part *part = lum_calloc(1, sizeof *part);
    struct lum_camera_row *items = lum_calloc(table->n, sizeof *items);
    if (!part || !items) {
        lum_free(part);
        lum_free(items);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u cameras", table->n);
    }
    lum_refs_init(&part->refs);
    part->items = items;
    part->n = table->n;
    for (uint32_t i = 0; i < table->n; i++) {
        const struct lum_camera_entry *entry = (const struct lum_camera_entry *)table->rows[i];
        memcpy(items[i].id, entry->base.id, sizeof items[i].id);
        items[i].camera = entry->camera;
    }
    *ret_part = part;
    return LUM_OK;
}

void lum_camera_part_unref(struct lum_camera_part *part)
{
    if (!part || !lum_refs_put(&part->refs))
        return;
    lum_free(part->items);
    lum_free(part);
}

/* ---- media ---- */

static void resolve_medium(struct lum_medium *out, const struct lum_medium_entry *entry,
                           const struct lum_normalisation *norm)
{
    const struct lum_medium_desc *d = &entry->desc;
    float metres = (float)(1.0 / norm->scale); /* a power of two */
    out->lo = lum_v3(-INFINITY, -INFINITY, -INFINITY);
    out->hi = lum_v3(INFINITY, INFINITY, INFINITY);
    if (!d->everywhere) {
        out->lo = lum_world_to_scene(norm, d->lo);
        out->hi = lum_world_to_scene(norm, d->hi);
    }
    out->sigma_s = lum_rgb_scale(d->sigma_s, metres);
    out->sigma_t = lum_rgb_scale(lum_rgb_add(d->sigma_s, d->sigma_a), metres);
    out->g = d->g;
    memcpy(out->id, entry->base.id, sizeof out->id);
}

enum lum_status lum_resolve_media(const struct lum_scene *scene, const struct lum_normalisation *norm,
                                  struct lum_snapshot_parts *parts, struct lum_error *err)
{
    const struct lum_table *table = &scene->tables[LUM_ENTITY_MEDIUM];
    if (table->n > LUM_MEDIA_MAX)
        return lum_fail(err, LUM_ERR_LIMIT, "medium", "a scene may have %u media, not %u", LUM_MEDIA_MAX, table->n);
    for (uint32_t i = 0; i < table->n; i++) {
        struct lum_medium m;
        memset(&m, 0, sizeof m); /* compared as bytes */
        resolve_medium(&m, (const struct lum_medium_entry *)table->rows[i], norm);
        if (!lum_rgb_black(m.sigma_t))
            memcpy(&parts->media[parts->n_media++], &m, sizeof m);
    }
    return LUM_OK;
}
