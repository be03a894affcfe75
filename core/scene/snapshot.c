
#include <string.h>

#include "core/accel/trace.h"
#include "core/light/emitter.h"
#include "core/material/bsdf.h"
#include "core/math/sampler.h"
#include "core/scene/mesh_lights.h"
#include "core/scene/parts.h"
#include "core/scene/surface.h"

const struct lum_snapshot *lum_snapshot_ref(const struct lum_snapshot *s)
{
    lum_refs_get(&((struct lum_snapshot *)s)->refs); /* the count is the one thing that is not const */
    return s;
}

void lum_snapshot_unref(const struct lum_snapshot *snapshot)
{
    struct lum_snapshot *s = (struct lum_snapshot *)snapshot;
    if (!s || !lum_refs_put(&s->refs))
        return;
    if (s->whole) {
        lum_snapshot_unref(s->whole);
        lum_light_part_unref(s->relit);
        lum_free(s);
        return;
    }
    lum_accel_top_unref(s->top);
    lum_instance_part_unref(s->parts->instances);
    lum_material_part_unref(s->parts->materials);
    lum_light_part_unref(s->parts->lights);
    lum_camera_part_unref(s->parts->cameras);
    lum_free(s->parts);
    lum_free(s);
}

/* ---- in other light ---- */

/* A version of its own for each look: far above those that are counted. */
static uint64_t version_of_look(uint64_t version, const struct lum_light_part *part)
{
    uint32_t high = (uint32_t)(version >> 32), low = (uint32_t)version;
    for (uint32_t i = 0; i < part->n; i++) {
        uint32_t power[3];
        if (!part->items[i].on)
            continue;
        memcpy(power, &part->items[i].power, sizeof power);
        uint32_t hash = lum_hash_combine(lum_hash_combine(lum_hash_combine(i, power[0]), power[1]), power[2]);
        high = lum_hash_combine(high, hash);
        low = lum_hash_combine(low, ~hash);
    }
    return (uint64_t)(high | 1u << 31) << 32 | low;
}

enum lum_status lum_snapshot_relit(const struct lum_snapshot *s, void (*change)(void *, struct lum_light *), void *user,
                                   const struct lum_snapshot **ret_snapshot, struct lum_error *err)
{
    struct lum_snapshot *relit = lum_calloc(1, sizeof *relit);
    struct lum_light_part *part = lum_lights_relit(s->relit ? s->relit : s->parts->lights, change, user);
    if (!relit || !part) {
        lum_free(relit);
        lum_light_part_unref(part);
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for %u lights", s->lights.n_lights);
    }
    *relit = *s;
    lum_refs_init(&relit->refs);
    relit->whole = lum_snapshot_ref(s);
    relit->relit = part;
    relit->lights = part->table;
    relit->versions.light_power = version_of_look(s->versions.light_power, part);
    *ret_snapshot = relit;
    return LUM_OK;
}

/* ---- cameras ---- */

enum lum_status lum_snapshot_camera(const struct lum_snapshot *s, const char *id, struct lum_camera *ret_camera,
                                    struct lum_error *err)
{
    const struct lum_camera_part *part = s->parts->cameras;
    const struct lum_camera_row *found = NULL;
    for (uint32_t i = 0; i < part->n && !found; i++)
        if (strcmp(part->items[i].id, id ? id : "main") == 0)
            found = &part->items[i];
    if (!found && !id && part->n)
        found = &part->items[0];
    if (!found)
        return lum_fail(err, LUM_ERR_NOT_FOUND, "camera", "there is no camera \"%.*s\"", LUM_ID_MAX, id ? id : "main");
    *ret_camera = found->camera;
    return LUM_OK;
}

static struct lum_vec3d to_world(const struct lum_normalisation *norm, struct lum_vec3 p)
{
    return (struct lum_vec3d){norm->centre.x + (double)p.x / norm->scale, norm->centre.y + (double)p.y / norm->scale,
                              norm->centre.z + (double)p.z / norm->scale};
}

/* How far an eye that looks along f at the middle of a box of half sides h has to be to see all corners, within a
 * slope of slope upwards and of wide times that sideways. r, u: to its right, and up. */
static double distance_to_see(struct lum_vec3d h, struct lum_vec3d r, struct lum_vec3d u, struct lum_vec3d f,
                              double slope, double wide)
{
    double distance = 0.0;
    for (int k = 0; k < 8; k++) {
        struct lum_vec3d c = {k & 1 ? h.x : -h.x, k & 2 ? h.y : -h.y, k & 4 ? h.z : -h.z};
        double right = fabs(c.x * r.x + c.y * r.y + c.z * r.z), up = fabs(c.x * u.x + c.y * u.y + c.z * u.z);
        double ahead = c.x * f.x + c.y * f.y + c.z * f.z;
        distance = fmax(distance, fmax(up, right / wide) / slope - ahead);
    }
    return distance;
}

#define FRAMING_WIDE 1.25  /* pictures are at least that wide, for their height */
#define FRAMING_MARGIN 1.1 /* around what is shown */

/* From the front, a little to the right and above; far enough that the bounds just fit. */
struct lum_camera lum_snapshot_framing_camera(const struct lum_snapshot *s)
{
    const double vfov_deg = 40.0, pi = 3.14159265358979323846;
    const double azimuth = 30.0 * pi / 180.0, elevation = 18.0 * pi / 180.0;
    struct lum_vec3d centre = s->norm.centre, half = {1, 1, 1};
    if (s->bounds_lo.x <= s->bounds_hi.x) {
        struct lum_vec3 size = lum_v3_mul(lum_v3_sub(s->bounds_hi, s->bounds_lo), 0.5f);
        centre = to_world(&s->norm, lum_v3_mul(lum_v3_add(s->bounds_lo, s->bounds_hi), 0.5f));
        half = (struct lum_vec3d){(double)size.x / s->norm.scale, (double)size.y / s->norm.scale,
                                  (double)size.z / s->norm.scale};
    }
    struct lum_vec3d back = {cos(elevation) * sin(azimuth), sin(elevation), cos(elevation) * cos(azimuth)};
    struct lum_vec3d right = {cos(azimuth), 0, -sin(azimuth)}, ahead = {-back.x, -back.y, -back.z};
    struct lum_vec3d up = {-sin(elevation) * sin(azimuth), cos(elevation), -sin(elevation) * cos(azimuth)};
    double slope = tan(0.5 * vfov_deg * pi / 180.0) / FRAMING_MARGIN;
    double distance = distance_to_see(half, right, up, ahead, slope, FRAMING_WIDE);
    return (struct lum_camera){
        .position = {centre.x + distance * back.x, centre.y + distance * back.y, centre.z + distance * back.z},
        .target = centre,
        .up = {0, 1, 0},
        .vfov_deg = vfov_deg,
    };
}

/* ---- bounds ---- */

static bool is_or_is_below(const char *id, const char *name)
{
    size_t n = strlen(name);
    return strncmp(id, name, n) == 0 && (id[n] == '\0' || id[n] == '/');
}

bool lum_snapshot_bounds(const struct lum_snapshot *s, const char *id, struct lum_box *ret_world)
{
    struct lum_bounds all = LUM_BOUNDS_EMPTY;
    for (uint32_t i = 0; i < s->n_instances; i++) {
        const struct lum_mesh *m = s->instances[i].mesh;
        if ((id && !is_or_is_below(s->instances[i].id, id)) || m->bounds_lo.x > m->bounds_hi.x)
            continue;
        struct lum_bounds b = lum_instance_bounds(&s->instances[i]);
        all = lum_bounds_join(&all, &b);
    }
    if (lum_bounds_empty(&all))
        return false;
    *ret_world = (struct lum_box){to_world(&s->norm, all.lo), to_world(&s->norm, all.hi)};
    return true;
}

/* ---- luminaires ---- */

bool lum_snapshot_luminaire(const struct lum_snapshot *s, uint32_t light, struct lum_luminaire *ret)
{
    const struct lum_light *l = &s->lights.lights[light];
    if (l->kind != &lum_emitter_mesh)
        return false;
    struct lum_vec3 at = lum_mesh_light_reach(s->parts->lights, &s->instances[l->instance], light).centre;
    double own = (double)lum_luminance(s->materials[s->instances[l->instance].material].emission);
    double luminance = (double)lum_luminance(l->power), area = (double)l->area / (s->norm.scale * s->norm.scale);
    *ret = (struct lum_luminaire){
        .id = l->id,
        .centre = to_world(&s->norm, at),
        .area_m2 = area,
        .luminance_cd_m2 = luminance * (double)l->mean_emission,
        .flux_lm = lum_mesh_light_flux(l, area) * luminance,
        .material_flux_lm = lum_mesh_light_flux(l, area) * own,
        .color = luminance > 0.0 ? lum_rgb_scale(l->power, (float)(1.0 / luminance)) : lum_grey(1.0f),
        .both_sides = l->both_sides,
    };
    return true;
}

/* ---- surfaces ---- */

struct triangle {
    const uint32_t *index;
    struct lum_vec3 p[3]; /* local */
    float w[3];           /* barycentric */
};

static struct lum_vec3 blend3(const float *array, const struct triangle *t)
{
    struct lum_vec3 v = lum_v3_mul(lum_v3_load(array, t->index[0]), t->w[0]);
    v = lum_v3_mad(v, lum_v3_load(array, t->index[1]), t->w[1]);
    return lum_v3_mad(v, lum_v3_load(array, t->index[2]), t->w[2]);
}

struct lum_vec3 lum_instance_normal(const struct lum_instance *instance, struct lum_vec3 n)
{
    const float(*m)[3] = instance->normal_m;
    return lum_normalize(lum_v3(m[0][0] * n.x + m[0][1] * n.y + m[0][2] * n.z,
                                m[1][0] * n.x + m[1][1] * n.y + m[1][2] * n.z,
                                m[2][0] * n.x + m[2][1] * n.y + m[2][2] * n.z));
}

/* Interpolates uv; where a normal map asks for it, solves for the change of position with uv. */
static void set_uv(struct lum_surface *s, const struct lum_instance *instance, const struct triangle *t, bool tangents)
{
    const float *uvs = instance->mesh->uvs;
    struct lum_vec2 c[3];
    for (int k = 0; k < 3; k++)
        c[k] = (struct lum_vec2){uvs[2 * (size_t)t->index[k]], uvs[2 * (size_t)t->index[k] + 1]};
    s->uv.x = t->w[0] * c[0].x + t->w[1] * c[1].x + t->w[2] * c[2].x;
    s->uv.y = t->w[0] * c[0].y + t->w[1] * c[1].y + t->w[2] * c[2].y;
    if (!tangents)
        return;
    float u1 = c[1].x - c[0].x, v1 = c[1].y - c[0].y, u2 = c[2].x - c[0].x, v2 = c[2].y - c[0].y;
    float inverse = 1.0f / (u1 * v2 - u2 * v1);
    if (!isfinite(inverse))
        return; /* uv does not span an area here */
    struct lum_vec3 e1 = lum_affine_vector(&instance->local_to_scene, lum_v3_sub(t->p[1], t->p[0]));
    struct lum_vec3 e2 = lum_affine_vector(&instance->local_to_scene, lum_v3_sub(t->p[2], t->p[0]));
    s->dpdu = lum_v3_mul(lum_v3_sub(lum_v3_mul(e1, v2), lum_v3_mul(e2, v1)), inverse);
    s->dpdv = lum_v3_mul(lum_v3_sub(lum_v3_mul(e2, u1), lum_v3_mul(e1, u2)), inverse);
}

/* Which way u and falling v run as the mesh says itself. False: it does not, or nothing that serves. The bitangent is
 * moved like a part of the mesh, so that what is mirrored shows a mirrored relief. */
static bool given_tangents(const struct lum_instance *instance, const struct triangle *t, struct lum_vec3 *ret_along,
                           struct lum_vec3 *ret_across)
{
    const struct lum_mesh *mesh = instance->mesh;
    if (!mesh->tangent_signs)
        return false;
    const struct lum_vec3 zero = {0.0f, 0.0f, 0.0f};
    struct lum_vec3 along = blend3(mesh->tangents, t), n = mesh->normals ? blend3(mesh->normals, t) : zero;
    if (!(lum_dot(n, n) > 0.0f))
        n = lum_normalize(lum_cross(lum_v3_sub(t->p[1], t->p[0]), lum_v3_sub(t->p[2], t->p[0])));
    float sign = 0.0f;
    for (int k = 0; k < 3; k++)
        sign += t->w[k] * mesh->tangent_signs[t->index[k]];
    struct lum_vec3 across = lum_cross(n, along);
    if (!(lum_dot(across, across) > 1e-6f * lum_dot(n, n))) /* they cancel out, or run along the normal */
        return false;
    *ret_along = lum_affine_vector(&instance->local_to_scene, along);
    *ret_across = lum_affine_vector(&instance->local_to_scene, sign < 0.0f ? lum_v3_neg(across) : across);
    return true;
}

/* Which way a surface is brushed. Where there is no uv, or it says nothing, about the object's y axis as the lines on a
 * turned part run; on what faces along that axis, its x axis. n: of the front, scene. */
static void set_tangent(struct lum_surface *s, const struct lum_instance *instance, const struct triangle *t,
                        struct lum_vec3 n)
{
    const struct lum_affine *m = &instance->local_to_scene;
    if (instance->mesh->uvs) {
        s->tangent = s->dpdu;
        s->bitangent = lum_v3_neg(s->dpdv);
    }
    if (instance->mesh->tangents && !instance->mesh->tangent_signs) {
        struct lum_vec3 mean = lum_affine_vector(m, blend3(instance->mesh->tangents, t));
        if (lum_dot(mean, mean) > 0.0f)
            s->tangent = mean;
    }
    if (lum_dot(s->tangent, s->tangent) > 0.0f)
        return;
    struct lum_vec3 up = lum_normalize(lum_affine_vector(m, lum_v3(0.0f, 1.0f, 0.0f)));
    struct lum_vec3 about = lum_cross(up, n);
    if (!(lum_dot(about, about) > 1e-6f))
        about = lum_affine_vector(m, lum_v3(1.0f, 0.0f, 0.0f));
    s->tangent = about;
    s->bitangent = lum_cross(n, about);
}

static void triangle_surface(const struct lum_snapshot *snapshot, const struct lum_hits *hits, uint32_t i,
                             struct lum_vec3 d, struct lum_surface *s)
{
    const struct lum_instance *instance = &snapshot->instances[hits->object[i]];
    const struct lum_mesh *mesh = instance->mesh;
    struct triangle t = {.index = mesh->indices + 3 * (size_t)hits->prim[i],
                         .w = {1.0f - hits->u[i] - hits->v[i], hits->u[i], hits->v[i]}};
    for (int k = 0; k < 3; k++)
        t.p[k] = lum_v3_load(mesh->positions, t.index[k]);
    s->instance = hits->object[i];
    s->material = instance->material;
    s->light = instance->light;
    s->p = lum_affine_point(&instance->local_to_scene, blend3(mesh->positions, &t));
    s->ng = lum_instance_normal(instance, lum_cross(lum_v3_sub(t.p[1], t.p[0]), lum_v3_sub(t.p[2], t.p[0])));
    s->backface = lum_dot(s->ng, d) > 0.0f;
    if (s->backface)
        s->ng = lum_v3_neg(s->ng);
    if (s->light != LUM_NO_OBJECT)
        s->emission = lum_light_emitted(&snapshot->lights.lights[s->light], d, s->backface);
    s->ns = s->ng;
    if (mesh->normals) {
        struct lum_vec3 n = lum_instance_normal(instance, blend3(mesh->normals, &t));
        float side = lum_dot(n, s->ng); /* 0 where the mesh brought no usable normal */
        if (side != 0.0f)
            s->ns = side < 0.0f ? lum_v3_neg(n) : n;
    }
    const struct lum_material *material = &snapshot->materials[s->material];
    bool brushed = lum_material_is_brushed(material),
         mapped = mesh->uvs && (material->normal_tex.image || material->clearcoat_normal_tex.image);
    if (mesh->uvs)
        set_uv(s, instance, &t, mapped || brushed);
    struct lum_vec3 along, across;
    bool given = (mapped || brushed) && given_tangents(instance, &t, &along, &across);
    if (given && mapped)
        s->dpdu = along, s->dpdv = lum_v3_neg(across);
    if (given && brushed)
        s->tangent = along, s->bitangent = across;
    else if (brushed)
        set_tangent(s, instance, &t, s->backface ? lum_v3_neg(s->ns) : s->ns);
    if (mesh->colors) {
        struct lum_vec3 c = blend3(mesh->colors, &t);
        s->vertex_color = lum_rgb(c.x, c.y, c.z);
    }
}

static void shape_surface(const struct lum_snapshot *snapshot, const struct lum_hits *hits, uint32_t i,
                          struct lum_vec3 d, struct lum_surface *s)
{
    s->light = snapshot->parts->lights->shape_lights[hits->object[i] - snapshot->n_instances];
    const struct lum_light *l = &snapshot->lights.lights[s->light];
    s->uv = (struct lum_vec2){hits->u[i], hits->v[i]};
    s->ng = lum_v3(hits->ngx[i], hits->ngy[i], hits->ngz[i]);
    s->p = l->kind->at(l, s->uv, &s->ng);
    s->backface = lum_dot(s->ng, d) > 0.0f;
    if (s->backface)
        s->ng = lum_v3_neg(s->ng);
    s->ns = s->ng;
    s->emission = lum_light_emitted(l, d, s->backface);
}

void lum_snapshot_surface(const struct lum_snapshot *snapshot, const struct lum_hits *hits, uint32_t i,
                          struct lum_vec3 d, struct lum_surface *ret_surface)
{
    struct lum_surface s = {
        .instance = LUM_NO_OBJECT,
        .material = LUM_NO_OBJECT,
        .light = LUM_NO_OBJECT,
        .prim = hits->prim[i],
        .vertex_color = lum_grey(1.0f),
    };
    if (hits->object[i] < snapshot->n_instances)
        triangle_surface(snapshot, hits, i, d, &s);
    else
        shape_surface(snapshot, hits, i, d, &s);
    s.white = hits->white;
    if (s.white)
        s.emission = lum_grey(0.0f);
    *ret_surface = s;
}

/* ---- alpha ---- */

/* A fraction in [0, 1) from the place of the hit, so that a see-through surface lets the same rays through every time,
 * whatever other objects come and go. */
static float place_hash(uint64_t object, uint32_t prim, float u, float v)
{
    uint32_t bits[2];
    memcpy(&bits[0], &u, sizeof u);
    memcpy(&bits[1], &v, sizeof v);
    uint32_t h = lum_hash_combine(lum_hash_combine((uint32_t)object, prim), lum_hash_combine(bits[0], bits[1]));
    return (float)(h >> 8) * 0x1p-24f;
}

bool lum_snapshot_opaque(const void *user, uint32_t object, uint32_t prim, float u, float v)
{
    const struct lum_snapshot *snapshot = user;
    const struct lum_instance *instance = &snapshot->instances[object];
    const struct lum_material *m = &snapshot->materials[instance->material];
    if (m->alpha_mode == LUM_ALPHA_OPAQUE)
        return true;
    float alpha = m->alpha;
    if (m->base_color_tex.image && instance->mesh->uvs) {
        const uint32_t *index = instance->mesh->indices + 3 * (size_t)prim;
        const float *a = instance->mesh->uvs + 2 * (size_t)index[0], *b = instance->mesh->uvs + 2 * (size_t)index[1],
                    *c = instance->mesh->uvs + 2 * (size_t)index[2];
        float w = 1.0f - u - v;
        struct lum_vec2 uv = {w * a[0] + u * b[0] + v * c[0], w * a[1] + u * b[1] + v * c[1]};
        alpha *= lum_texture_sample(&m->base_color_tex, uv).a;
    }
    return m->alpha_mode == LUM_ALPHA_MASK ? alpha >= m->alpha_cutoff : alpha > place_hash(instance->hash, prim, u, v);
}

/* ---- panes ---- */

bool lum_snapshot_passes(const void *user, uint32_t object, uint32_t prim, float u, float v, struct lum_vec3 d,
                         struct lum_accel_pane *ret_pane)
{
    const struct lum_snapshot *snapshot = user;
    const struct lum_material *m = &snapshot->materials[snapshot->instances[object].material];
    if (!lum_material_is_pane(m))
        return false;
    struct lum_hits hits; /* the first alone */
    struct lum_surface s;
    struct lum_bsdf b;
    struct lum_vec3 wi = lum_normalize(d);
    hits.object[0] = object;
    hits.prim[0] = prim;
    hits.u[0] = u;
    hits.v[0] = v;
    hits.white = false;
    lum_snapshot_surface(snapshot, &hits, 0, wi, &s);
    lum_bsdf_init(&b, m, &s, lum_v3_neg(wi));
    float inside = m->thin ? 0.0f : s.backface ? 1.0f : -1.0f;
    *ret_pane = (struct lum_accel_pane){
        .left = lum_bsdf_straight(&b, lum_v3_neg(wi)),
        .depth = lum_rgb_scale(m->sigma_a, inside),
        .steep = fabsf(lum_dot(s.ng, d)),
    };
    return !lum_rgb_black(ret_pane->left);
}
