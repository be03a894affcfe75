#include "server/world/apply.h"

#include <stdio.h>
#include <string.h>

#include "core/math/color.h"
#include "core/light/emitter.h"
#include "core/medium/medium.h"
#include "core/scene/light_kind.h"
#include "core/scene/shapes.h"
#include "protocol/record/aim.h"
#include "server/base/suggest.h"
#include "server/base/web_desc.h"
#include "server/world/daylight.h"
#include "server/world/light_kinds.h"
#include "server/world/sensors.h"

static struct lum_vec3d vec3d(const double v[3])
{
    return (struct lum_vec3d){v[0], v[1], v[2]};
}

static struct lum_rgb rgb(const double v[3])
{
    return lum_rgb((float)v[0], (float)v[1], (float)v[2]);
}

/* Scales a colour to luminance 1. False when its luminance is not above 0. */
static bool normalise_color(const double color[3], struct lum_rgb *ret_color)
{
    double luminance = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
    if (!(luminance > 0.0) || !isfinite(luminance))
        return false;
    *ret_color = lum_rgb((float)(color[0] / luminance), (float)(color[1] / luminance), (float)(color[2] / luminance));
    return true;
}

/* ---- meshes and images ---- */

/* Vertex attributes as floats; *inout_owned holds the copy when they came in double. */
static enum lum_status floats_of(const struct lum_floats *f, const char *field, float **ret_owned,
                                 const float **ret_floats, struct lum_error *err)
{
    *ret_owned = NULL;
    *ret_floats = f->f32;
    if (f->n == 0 || f->f32)
        return LUM_OK;
    float *copy = lum_calloc(f->n, sizeof *copy);
    if (!copy)
        return lum_fail(err, LUM_ERR_NOMEM, field, "no memory for %zu numbers", f->n);
    for (size_t i = 0; i < f->n; i++)
        copy[i] = (float)f->f64[i];
    *ret_owned = copy;
    *ret_floats = copy;
    return LUM_OK;
}

/* Where a mesh goes: into the scene, or beside it. */
struct mesh_end {
    struct lum_scene *scene;
    const struct lum_scene *beside;
    struct lum_made_mesh *made; /* NULL: into the scene */
};

static enum lum_status end_mesh(const struct mesh_end *end, const char *id, const struct lum_mesh_desc *desc,
                                struct lum_error *err)
{
    return end->made ? lum_scene_make_mesh(end->beside, desc, end->made, err)
                     : lum_scene_put_mesh(end->scene, id, desc, err);
}

static enum lum_status put_shape(const struct mesh_end *end, const struct lum_record *r, struct lum_error *err)
{
    const struct lum_record_mesh *m = &r->mesh;
    struct lum_shape_params params = {.segments = {(uint32_t)m->segments[0], (uint32_t)m->segments[1]}};
    memcpy(params.size, m->size, sizeof params.size);
    memcpy(params.param, m->param, sizeof params.param);
    struct lum_shape_mesh shape;
    enum lum_status st = lum_shape_make(m->shape, &params, &shape, err);
    if (st)
        return st;
    struct lum_mesh_desc desc = {.positions_f = shape.positions,
                                 .normals = shape.normals,
                                 .uvs = shape.uvs,
                                 .indices = shape.indices,
                                 .n_vertices = shape.n_vertices,
                                 .n_triangles = shape.n_triangles,
                                 .deforming = m->deforming};
    st = end_mesh(end, r->id, &desc, err);
    lum_shape_finish(&shape);
    return st;
}

static enum lum_status put_mesh(const struct mesh_end *end, const struct lum_record *r, struct lum_error *err)
{
    const struct lum_record_mesh *m = &r->mesh;
    if (m->shape[0])
        return put_shape(end, r, err);
    struct lum_mesh_desc desc = {.positions = m->positions.f64,
                                 .positions_f = m->positions.f64 ? NULL : m->positions.f32,
                                 .indices = m->indices.u32,
                                 .n_vertices = (uint32_t)(m->positions.n / 3),
                                 .n_triangles = (uint32_t)(m->indices.n / 3),
                                 .deforming = m->deforming};
    float *normals = NULL, *uvs = NULL, *tangents = NULL, *colors = NULL;
    enum lum_status st = floats_of(&m->normals, "normals", &normals, &desc.normals, err);
    if (!st)
        st = floats_of(&m->uvs, "uvs", &uvs, &desc.uvs, err);
    if (!st)
        st = floats_of(&m->tangents, "tangents", &tangents, &desc.tangents, err);
    if (!st)
        st = floats_of(&m->colors, "colors", &colors, &desc.colors, err);
    if (!st)
        st = end_mesh(end, r->id, &desc, err);
    lum_free(normals);
    lum_free(uvs);
    lum_free(tangents);
    lum_free(colors);
    return st;
}

enum lum_status lum_apply_make_mesh(const struct lum_scene *scene, const struct lum_record *mesh,
                                    struct lum_made_mesh *ret_made, struct lum_error *err)
{
    return put_mesh(&(struct mesh_end){.beside = scene, .made = ret_made}, mesh, err);
}

static enum lum_status put_image(struct lum_scene *scene, const struct lum_record *r, struct lum_error *err)
{
    const struct lum_record_image *im = &r->image;
    if (!im->pixels)
        return lum_fail(err, LUM_ERR_INVALID, "asset", "the image %s has no pixels: its asset was not decoded", r->id);
    struct lum_image_desc desc = {.width = im->width, .height = im->height, .pixels = im->pixels};
    size_t texel_bytes = 4;
    if (strcmp(im->texel, "rgb32f") == 0) {
        desc.texel = LUM_TEXEL_RGB32F;
        texel_bytes = 12;
    } else {
        desc.texel = strcmp(im->texel, "linear8") == 0 ? LUM_TEXEL_LINEAR8 : LUM_TEXEL_SRGB8;
    }
    if (im->n_bytes != (size_t)im->width * im->height * texel_bytes)
        return lum_fail(err, LUM_ERR_INVALID, "pixels", "%zu bytes of pixels do not make %u x %u texels of %zu bytes",
                        im->n_bytes, im->width, im->height, texel_bytes);
    if (desc.texel == LUM_TEXEL_RGB32F)
        return lum_scene_put_image(scene, r->id, &desc, err);
    enum lum_status st = lum_scene_share_image(scene, r->id, &desc, lum_bulk_unref, lum_bulk_ref(im->pixels), err);
    if (st)
        lum_bulk_unref(im->pixels);
    return st;
}

/* ---- materials ---- */

static enum lum_wrap wrap_of(const char *name)
{
    if (strcmp(name, "mirror") == 0)
        return LUM_WRAP_MIRROR;
    return strcmp(name, "clamp") == 0 ? LUM_WRAP_CLAMP : LUM_WRAP_REPEAT;
}

static struct lum_texture_desc texture_of(const struct lum_record_texture *t)
{
    return (struct lum_texture_desc){.image = t->image[0] ? t->image : NULL,
                                     .offset = {(float)t->offset[0], (float)t->offset[1]},
                                     .scale = {(float)t->scale[0], (float)t->scale[1]},
                                     .rotation_rad = (float)t->rotation_rad,
                                     .wrap_u = wrap_of(t->wrap_u),
                                     .wrap_v = wrap_of(t->wrap_v)};
}

static enum lum_alpha_mode alpha_mode_of(const char *name)
{
    if (strcmp(name, "mask") == 0)
        return LUM_ALPHA_MASK;
    return strcmp(name, "blend") == 0 ? LUM_ALPHA_BLEND : LUM_ALPHA_OPAQUE;
}

enum lum_status lum_apply_material(const struct lum_record *r, struct lum_material_desc *ret_material,
                                   struct lum_error *err)
{
    const struct lum_record_material *m = &r->material;
    struct lum_material_desc d = {
        .base_color = rgb(m->base_color),
        .base_color_texture = texture_of(&m->base_color_texture),
        .metallic_roughness_texture = texture_of(&m->metallic_roughness_texture),
        .emission_texture = texture_of(&m->emission_texture),
        .normal_texture = texture_of(&m->normal_texture),
        .specular_texture = texture_of(&m->specular_texture),
        .specular_color_texture = texture_of(&m->specular_color_texture),
        .transmission_texture = texture_of(&m->transmission_texture),
        .diffuse_transmission_texture = texture_of(&m->diffuse_transmission_texture),
        .anisotropy_texture = texture_of(&m->anisotropy_texture),
        .clearcoat_texture = texture_of(&m->clearcoat_texture),
        .clearcoat_roughness_texture = texture_of(&m->clearcoat_roughness_texture),
        .clearcoat_normal_texture = texture_of(&m->clearcoat_normal_texture),
        .normal_scale = (float)m->normal_scale,
        .clearcoat_normal_scale = (float)m->clearcoat_normal_scale,
        .metallic = (float)m->metallic,
        .roughness = (float)m->roughness,
        .ior = (float)m->ior,
        .specular = (float)m->specular,
        .specular_color = rgb(m->specular_color),
        .transmission = (float)m->transmission,
        .diffuse_transmission_share = (float)m->diffuse_transmission_share,
        .diffuse_transmittance = rgb(m->diffuse_transmittance),
        .sheen_color = rgb(m->sheen_color),
        .sheen_roughness = (float)m->sheen_roughness,
        .clearcoat = (float)m->clearcoat,
        .clearcoat_roughness = (float)m->clearcoat_roughness,
        .anisotropy = (float)m->anisotropy,
        .anisotropy_rotation_deg = m->anisotropy_rotation_deg,
        .thin = m->thin,
        .attenuation_color = rgb(m->attenuation_color),
        .attenuation_distance_m = m->attenuation_distance.set ? m->attenuation_distance.value : (double)INFINITY,
        .emission = lum_grey(1.0f),
        .emission_cd_m2 = m->emission_cd_m2,
        .front_emission = strcmp(m->emission_sides, "front") == 0,
        .alpha_mode = alpha_mode_of(m->alpha_mode),
        .alpha = (float)m->alpha,
        .alpha_cutoff = (float)m->alpha_cutoff,
        .unlit = m->unlit,
    };
    if (!normalise_color(m->emission_color, &d.emission) && m->emission_cd_m2 > 0.0)
        return lum_fail(err, LUM_ERR_INVALID, "emission_color",
                        "emission_color must have a luminance above 0; for no light set emission_cd_m2 to 0");
    *ret_material = d;
    return LUM_OK;
}

/* ---- lights ---- */

static enum lum_status light_kind_of(const char *name, const struct lum_light_kind_row **ret_kind,
                                     struct lum_error *err)
{
    for (size_t k = 0; k < LUM_LIGHT_KIND_COUNT; k++)
        if (strcmp(name, lum_light_kinds[k].name) == 0) {
            *ret_kind = lum_light_kinds[k].row;
            return LUM_OK;
        }
    return lum_fail(err, LUM_ERR_UNSUPPORTED, "kind", "lights of kind %s are not in this version", name);
}

/* The size in the unit natural to the kind; the record's validator has seen to it that only fitting ones are set. d is
 * complete but for its intensity. */
static enum lum_status light_intensity(const struct lum_record_light *l, const struct lum_light_desc *d,
                                       double *ret_intensity, struct lum_error *err)
{
    if (d->kind == &lum_light_kind_sun || d->kind == &lum_light_kind_sky)
        return LUM_OK;
    if (l->flux_lm.set)
        return lum_light_from_flux(d, l->flux_lm.value, ret_intensity, err);
    if (d->web) {
        *ret_intensity = d->web->peak_cd * (l->multiplier.set ? l->multiplier.value : 1.0);
        return LUM_OK;
    }
    enum lum_power_unit unit = d->kind->emitter->unit;
    const struct lum_opt *natural = unit == LUM_POWER_INTENSITY     ? &l->intensity_cd
                                    : unit == LUM_POWER_ILLUMINANCE ? &l->illuminance_lx
                                                                    : &l->luminance_cd_m2;
    if (!natural->set)
        return lum_fail(err, LUM_ERR_INVALID, "kind", "a %s light needs a size in a unit of its kind", l->kind);
    *ret_intensity = natural->value;
    return LUM_OK;
}

static enum lum_status light_color(const struct lum_record_light *l, struct lum_rgb *ret_color, struct lum_error *err)
{
    if (l->cct_k.set) {
        *ret_color = lum_cct_to_rgb(l->cct_k.value);
        return LUM_OK;
    }
    if (!normalise_color(l->color, ret_color))
        return lum_fail(err, LUM_ERR_INVALID, "color",
                        "color must have a luminance above 0; for no light set on to false");
    return LUM_OK;
}

/* A ball is a disc as wide: it is seen from below. */
static void open_up(const struct lum_record_web *web, struct lum_light_desc *d)
{
    bool round = strcmp(web->opening, "disc") == 0 || strcmp(web->opening, "sphere") == 0;
    if (strcmp(web->opening, "point") == 0)
        return;
    d->opening = round ? LUM_OPENING_DISC : LUM_OPENING_RECTANGLE;
    d->opening_m[0] = web->size[0];
    d->opening_m[1] = web->size[1];
}

enum lum_status lum_apply_light(const struct lum_record *r, const struct lum_web *web, struct lum_light_desc *ret_light,
                                struct lum_error *err)
{
    const struct lum_record_light *l = &r->light;
    struct lum_light_desc d = {
        .position = vec3d(l->position),
        .direction = vec3d(l->direction),
        .u = vec3d(l->u),
        .v = vec3d(l->v),
        .radius_m = l->radius,
        .diameter_rad = l->diameter_deg * LUM_RAD_PER_DEG,
        .inner_cone_rad = l->inner_cone_deg * LUM_RAD_PER_DEG,
        .outer_cone_rad = l->outer_cone_deg * LUM_RAD_PER_DEG,
        .image = l->image[0] ? l->image : NULL,
        .rotation_rad = l->rotation_deg * LUM_RAD_PER_DEG,
        .web = web,
        .on = l->on,
        .camera_visible = l->camera_visible,
        .group = l->group,
    };
    if (web) {
        double c0[3];
        lum_aim_c0(l->direction, l->roll_deg, c0);
        d.u = vec3d(c0);
        if (l->web && !l->as_point)
            open_up(l->web, &d);
    }
    enum lum_status st = light_kind_of(l->kind, &d.kind, err);
    if (!st)
        st = light_color(l, &d.color, err);
    if (!st)
        lum_daylight_apply(l, &d);
    if (!st)
        st = light_intensity(l, &d, &d.intensity, err);
    if (!st)
        *ret_light = d;
    return st;
}

static enum lum_status put_light(struct lum_scene *scene, const struct lum_record *r, struct lum_error *err)
{
    const struct lum_record_web *file = r->light.web;
    bool measured = strcmp(r->light.kind, "ies") == 0;
    struct lum_light_desc d;
    struct lum_web *web = NULL;
    enum lum_status st = LUM_OK;
    if (measured && !file)
        return lum_fail(err, LUM_ERR_INVALID, "asset",
                        "the asset of the light %s was not read: its name must end in .ies, .ldt, .eul or .pho", r->id);
    if (measured) {
        struct lum_web_desc desc = lum_web_desc_of(file);
        st = lum_scene_take_web(scene, &desc, &web, err);
    }
    if (!st)
        st = lum_apply_light(r, web, &d, err);
    if (!st)
        st = lum_scene_put_light(scene, r->id, &d, err);
    lum_web_unref(web);
    return st;
}

/* ---- the rest ---- */

_Static_assert(LUM_LIMIT_MEDIA == LUM_MEDIA_MAX, "what a document may hold can be rendered");

struct lum_medium_desc lum_apply_medium(const struct lum_record *r)
{
    const struct lum_record_medium *m = &r->medium;
    return (struct lum_medium_desc){.sigma_s = rgb(m->sigma_s),
                                    .sigma_a = rgb(m->sigma_a),
                                    .g = (float)m->g,
                                    .everywhere = !m->box.set,
                                    .lo = vec3d(m->box.min),
                                    .hi = vec3d(m->box.max)};
}

struct lum_camera lum_apply_camera(const struct lum_record_camera *c)
{
    return (struct lum_camera){vec3d(c->position), vec3d(c->target), vec3d(c->up), c->vfov_deg,
                               strcmp(c->projection, "panorama") == 0};
}

enum lum_status lum_apply_tone_map(const char *name, enum lum_tone_map *ret_tone, struct lum_error *err)
{
    for (int i = 0; lum_tone_map_names[i]; i++)
        if (strcmp(name, lum_tone_map_names[i]) == 0) {
            *ret_tone = (enum lum_tone_map)i;
            return LUM_OK;
        }
    return lum_fail(err, LUM_ERR_UNSUPPORTED, "tone_map", "there is no tone map %s", name);
}

enum lum_status lum_apply_settings(const struct lum_record *render, struct lum_view_settings *inout_settings,
                                   struct lum_error *err)
{
    const struct lum_record_render *r = &render->render;
    const struct lum_method *method = lum_method_find(r->method);
    if (!method) {
        char near[LUM_SUGGEST_BYTES];
        lum_suggest_method(r->method, near);
        return lum_fail(err, LUM_ERR_UNSUPPORTED, "method", "there is no method \"%s\"%s", r->method, near);
    }
    inout_settings->method = method;
    inout_settings->max_spp = (uint32_t)r->spp;
    inout_settings->max_depth = (uint32_t)r->max_depth;
    inout_settings->shadow_samples = (uint32_t)r->shadow_samples;
    inout_settings->seed = (uint32_t)r->seed;
    inout_settings->antialias = r->antialias;
    inout_settings->n_vpls = (uint32_t)r->vpls;
    inout_settings->cache_accuracy = (float)r->cache_accuracy;
    return LUM_OK;
}

static enum lum_status check_render(const struct lum_record *r, struct lum_error *err)
{
    struct lum_view_settings settings = lum_view_settings_default();
    enum lum_tone_map tone;
    enum lum_status st = lum_apply_settings(r, &settings, err);
    return st ? st : lum_apply_tone_map(r->render.tone_map, &tone, err);
}

static struct lum_shine shine_of(const struct lum_record_object *o)
{
    struct lum_shine s = {.off = !o->on, .group = o->group};
    const struct lum_opt *amount = o->flux_lm.set ? &o->flux_lm : &o->luminance_cd_m2;
    if (amount->set) {
        s.unit = o->flux_lm.set ? LUM_SHINE_FLUX : LUM_SHINE_LUMINANCE;
        s.amount = amount->value;
    }
    s.has_color = o->cct_k.set || normalise_color(o->color, &s.color);
    if (o->cct_k.set)
        s.color = lum_cct_to_rgb(o->cct_k.value);
    return s;
}

static enum lum_status put_object(struct lum_scene *scene, const struct lum_record *r, struct lum_error *err)
{
    const struct lum_record_object *o = &r->object;
    struct lum_object_desc d = {.mesh = o->mesh, .material = o->material, .visible = o->visible, .shine = shine_of(o)};
    lum_record_transform_affine(&o->transform, d.local_to_world.m);
    return lum_scene_put_object(scene, r->id, &d, err);
}

enum lum_status lum_apply_put(struct lum_scene *scene, const struct lum_record *r, struct lum_error *err)
{
    enum lum_status st;
    switch (r->type) {
    case LUM_RECORD_MESH:
        return put_mesh(&(struct mesh_end){.scene = scene}, r, err);
    case LUM_RECORD_IMAGE:
        return put_image(scene, r, err);
    case LUM_RECORD_MATERIAL: {
        struct lum_material_desc d;
        st = lum_apply_material(r, &d, err);
        return st ? st : lum_scene_put_material(scene, r->id, &d, err);
    }
    case LUM_RECORD_OBJECT:
        return put_object(scene, r, err);
    case LUM_RECORD_LIGHT:
        return put_light(scene, r, err);
    case LUM_RECORD_CAMERA: {
        struct lum_camera c = lum_apply_camera(&r->camera);
        return lum_scene_put_camera(scene, r->id, &c, err);
    }
    case LUM_RECORD_RENDER:
        st = check_render(r, err);
        if (st == LUM_OK)
            lum_scene_straighten_glass(scene, strcmp(r->render.glass, "architectural") == 0);
        return st;
    case LUM_RECORD_SENSOR: {
        struct lum_sensor_desc d = lum_sensor_desc_of(r);
        return lum_sensor_check(&d, LUM_LIMIT_SENSOR_POINTS, err);
    }
    case LUM_RECORD_MEDIUM: {
        struct lum_medium_desc d = lum_apply_medium(r);
        return lum_scene_put_medium(scene, r->id, &d, err);
    }
    default:
        return LUM_OK;
    }
}

static enum lum_status remove_record(struct lum_scene *scene, const struct lum_record *r, struct lum_error *err)
{
    static const int entities[LUM_RECORD_TYPE_COUNT] = {
        [LUM_RECORD_MESH] = LUM_ENTITY_MESH,
        [LUM_RECORD_IMAGE] = LUM_ENTITY_IMAGE,
        [LUM_RECORD_MATERIAL] = LUM_ENTITY_MATERIAL,
        [LUM_RECORD_OBJECT] = LUM_ENTITY_OBJECT,
        [LUM_RECORD_LIGHT] = LUM_ENTITY_LIGHT,
        [LUM_RECORD_CAMERA] = LUM_ENTITY_CAMERA,
        [LUM_RECORD_MEDIUM] = LUM_ENTITY_MEDIUM,
        [LUM_RECORD_SENSOR] = -1,
        [LUM_RECORD_PATCH] = -1,
        [LUM_RECORD_PRESET] = -1,
        [LUM_RECORD_RENDER] = -1,
        [LUM_RECORD_IMPORT] = -1,
    };
    int entity = entities[r->type];
    return entity < 0 ? LUM_OK : lum_scene_remove(scene, (enum lum_entity)entity, r->id, err);
}

/* From what the scene holds to what it shall hold; either may be NULL. */
static enum lum_status apply_one(struct lum_scene *scene, const struct lum_record *from, const struct lum_record *to,
                                 struct lum_error *err)
{
    bool removes = from && (!to || from->type != to->type);
    enum lum_status st = removes ? remove_record(scene, from, err) : LUM_OK;
    if (st || !to)
        return st;
    st = lum_apply_put(scene, to, err);
    if (st && removes && lum_apply_put(scene, from, NULL))
        return LUM_ERR_INTERNAL;
    return st;
}

static enum lum_status reverse_first(struct lum_scene *scene, const struct lum_changes *changes, size_t n,
                                     struct lum_error *err)
{
    for (size_t i = n; i-- > 0;) {
        enum lum_status st = apply_one(scene, changes->changes[i].after, changes->changes[i].before, err);
        if (st)
            return st;
    }
    return LUM_OK;
}

enum lum_status lum_apply_changes(struct lum_scene *scene, const struct lum_changes *changes,
                                  const struct lum_go_on *go_on, size_t *ret_failed, struct lum_error *err)
{
    for (size_t i = 0; i < changes->n; i++) {
        if (go_on->ask && !go_on->ask(go_on->user))
            return lum_fail(err, LUM_ERR_CANCELLED, "", "the server stops");
        enum lum_status st = apply_one(scene, changes->changes[i].before, changes->changes[i].after, err);
        if (!st)
            continue;
        if (ret_failed)
            *ret_failed = i;
        /* err keeps the first cause: it is what the user can mend */
        return reverse_first(scene, changes, i, NULL) ? LUM_ERR_INTERNAL : st;
    }
    return LUM_OK;
}

enum lum_status lum_apply_reverse(struct lum_scene *scene, const struct lum_changes *changes, struct lum_error *err)
{
    return reverse_first(scene, changes, changes->n, err);
}

bool lum_apply_error(const struct lum_error *e, const char *path, struct lum_proto_error *ret_error)
{
    static const struct {
        enum lum_proto_code code;
        const char *app;
    } codes[] = {
        [LUM_OK] = {LUM_PROTO_INTERNAL, "internal"},
        [LUM_ERR_NOMEM] = {LUM_PROTO_APPLICATION, "limit_exceeded"},
        [LUM_ERR_INVALID] = {LUM_PROTO_BAD_PARAMS, "invalid_value"},
        [LUM_ERR_NOT_FOUND] = {LUM_PROTO_APPLICATION, "not_found"},
        [LUM_ERR_CONFLICT] = {LUM_PROTO_APPLICATION, "in_use"},
        [LUM_ERR_LIMIT] = {LUM_PROTO_APPLICATION, "limit_exceeded"},
        [LUM_ERR_IO] = {LUM_PROTO_APPLICATION, "io"},
        [LUM_ERR_UNSUPPORTED] = {LUM_PROTO_APPLICATION, "unsupported"},
        [LUM_ERR_CANCELLED] = {LUM_PROTO_INTERNAL, "internal"},
        [LUM_ERR_INTERNAL] = {LUM_PROTO_INTERNAL, "internal"},
    };
    char full[sizeof ret_error->path];
    snprintf(full, sizeof full, "%s%s%s", path, path[0] && e->field[0] ? "/" : "", e->field);
    bool subjectless = e->field[0] && strncmp(e->text, "must ", 5) == 0; /* the core leaves it to the field */
    return lum_proto_fail(ret_error, codes[e->status].code, codes[e->status].app, full, "%s%s%s",
                          subjectless ? e->field : "", subjectless ? " " : "", e->text);
}
