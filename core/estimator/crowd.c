#include "core/estimator/crowd.h"

#include <string.h>

#include "core/estimator/components.h"
#include "core/estimator/direct.h"
#include "core/estimator/layers.h"
#include "core/estimator/soft.h"
#include "core/interleave/interleave.h"
#include "core/math/warp.h"
#include "core/medium/medium.h"

#define PAIR_CROWD 0x50000000u
#define CULL_SHARE (1.0f / 512) /* of a tile's brightness: half a step of 8 bits */
#define OCTAVES 64              /* that bounds are told apart by, from the brightest */

#define CUT_OPEN UINT8_MAX            /* not decided */
#define CUT_FORGOTTEN (UINT8_MAX - 1) /* nor do the tile's bits mean anything */
_Static_assert(OCTAVES < CUT_FORGOTTEN, "a tile's cut is a number of octaves");

static bool reserve_pixels(struct lum_crowd *c, const struct lum_pass *pass)
{
    size_t n = (size_t)pass->tiling.w * pass->tiling.h;
    if (c->raw)
        return true;
    c->raw = lum_calloc(n, sizeof *c->raw);
    c->smooth = lum_calloc(n, sizeof *c->smooth);
    c->gloss = lum_calloc(n, sizeof *c->gloss);
    c->done = lum_calloc(pass->tiling.n, 1);
    c->joined = lum_calloc(pass->tiling.n, 1);
    c->cut = lum_calloc(pass->tiling.n, 1);
    if (!c->raw || !c->smooth || !c->gloss || !c->done || !c->joined || !c->cut)
        return false;
    memset(c->cut, CUT_FORGOTTEN, pass->tiling.n);
    return true;
}

#define BYTES_PER_LIGHT (LUM_TILE_PIXELS / 4u) /* of bits, in a tile */

static bool reserve_lights(struct lum_crowd *c, const struct lum_pass *pass)
{
    uint32_t n = pass->snapshot->lights.n_lights;
    if (c->lights && n == c->n_lights)
        return true;
    size_t bytes = (size_t)pass->tiling.n * n * BYTES_PER_LIGHT;
    lum_free(c->lights);
    lum_free(c->seen);
    c->lights = lum_calloc(n, sizeof *c->lights);
    c->seen = bytes <= LUM_CROWD_BYTES ? lum_calloc(bytes, 1) : NULL;
    c->n_lights = n;
    lum_crowd_relight(c, pass);
    memset(c->cut, CUT_FORGOTTEN, pass->tiling.n);
    return c->lights && (c->seen || bytes > LUM_CROWD_BYTES);
}

/* A light that first shines, or far brighter than it was planned for, is planned by the power that it has. */
static void plan_lights(struct lum_crowd *c, const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    bool anew = false;
    for (uint32_t i = 0; i < lights->n_lights; i++) {
        const struct lum_light *l = &lights->lights[i];
        struct lum_crowd_light *own = &c->lights[i];
        struct lum_bounds b;
        own->p = l->p;
        own->radius = l->kind == LUM_EMIT_QUAD ? lum_length(l->u) + lum_length(l->v) : l->radius;
        if (l->kind == LUM_EMIT_MESH && lum_light_bounds(pass->snapshot, l, &b)) {
            own->p = lum_v3_mul(lum_v3_add(b.lo, b.hi), 0.5f);
            own->radius = 0.5f * lum_length(lum_v3_sub(b.hi, b.lo));
        }
        float luminance = l->on ? lum_luminance(l->power) : 0.0f;
        if (lum_layers_in_crowd(pass->layers, i) && luminance > LUM_CROWD_BRIGHTER * own->reference) {
            own->reference = luminance;
            anew = true;
        }
    }
    for (uint32_t t = 0; anew && t < pass->tiling.n; t++)
        if (c->cut[t] != CUT_FORGOTTEN)
            c->cut[t] = CUT_OPEN;
}

bool lum_crowd_reserve(struct lum_crowd *c, const struct lum_pass *pass)
{
    if (!reserve_pixels(c, pass) || !reserve_lights(c, pass)) {
        lum_crowd_finish(c);
        return false;
    }
    plan_lights(c, pass);
    return true;
}

void lum_crowd_finish(struct lum_crowd *c)
{
    lum_free(c->raw);
    lum_free(c->smooth);
    lum_free(c->gloss);
    lum_free(c->done);
    lum_free(c->joined);
    lum_free(c->cut);
    lum_free(c->lights);
    lum_free(c->seen);
    *c = (struct lum_crowd){0};
}

void lum_crowd_relight(struct lum_crowd *c, const struct lum_pass *pass)
{
    if (!c->raw)
        return;
    memset(c->done, 0, pass->tiling.n);
    memset(c->joined, 0, pass->tiling.n);
}

void lum_crowd_forget(struct lum_crowd *c, const struct lum_pass *pass)
{
    lum_crowd_relight(c, pass);
    if (c->cut)
        memset(c->cut, CUT_FORGOTTEN, pass->tiling.n);
    if (c->lights)
        memset(c->lights, 0, c->n_lights * sizeof *c->lights);
}

void lum_crowd_add(const struct lum_pass *pass, uint32_t tile, uint32_t n_pixels, struct lum_rgb *inout_radiance)
{
    const struct lum_crowd *c = &pass->layers->crowd;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    for (uint32_t i = 0; i < n_pixels; i++) {
        size_t pixel = (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w;
        inout_radiance[i] =
            lum_rgb_add(inout_radiance[i], lum_rgb_mul(pass->surfaces->albedo[pixel], c->smooth[pixel]));
        inout_radiance[i] = lum_rgb_add(inout_radiance[i], c->gloss[pixel]);
    }
}

/* ---- what a light can bring to a tile ---- */

struct extent {
    struct lum_vec3 lo, hi;
    struct lum_vec3 n; /* of all of them; 0: they differ */
    bool gloss;        /* whose peaks have no useful bound */
};

static struct extent extent_of(const struct lum_vertices *v, bool gloss)
{
    struct extent e = {.lo = v->p[0], .hi = v->p[0], .n = v->bsdf[0].frame.n, .gloss = gloss};
    for (uint32_t i = 0; i < v->n; i++) {
        struct lum_vec3 p = v->p[i], n = v->bsdf[i].frame.n;
        e.lo = lum_v3(lum_min(e.lo.x, p.x), lum_min(e.lo.y, p.y), lum_min(e.lo.z, p.z));
        e.hi = lum_v3(lum_max(e.hi.x, p.x), lum_max(e.hi.y, p.y), lum_max(e.hi.z, p.z));
        if (n.x != e.n.x || n.y != e.n.y || n.z != e.n.z)
            e.n = lum_v3(0.0f, 0.0f, 0.0f);
    }
    return e;
}

/* Largest value of n.(x - p) over the box. */
static float farthest(const struct extent *e, struct lum_vec3 n, struct lum_vec3 p)
{
    struct lum_vec3 x = {n.x > 0.0f ? e->hi.x : e->lo.x, n.y > 0.0f ? e->hi.y : e->lo.y,
                         n.z > 0.0f ? e->hi.z : e->lo.z};
    return lum_dot(n, lum_v3_sub(x, p));
}

static float outside(float x, float lo, float hi)
{
    return lum_max(lum_max(lo - x, x - hi), 0.0f);
}

/* At most so much luminance a matte white surface in the box sends on from the light, were it as bright as it is
 * planned for. INFINITY: the light is too near to say, or has no place. A sphere's is exact where it is faced; other
 * shapes send at most area / distance^2, and of what is closed half of the area is seen. */
static float bound_of(const struct lum_light *l, const struct lum_crowd_light *own, const struct extent *e)
{
    struct lum_vec3 d = {outside(own->p.x, e->lo.x, e->hi.x), outside(own->p.y, e->lo.y, e->hi.y),
                         outside(own->p.z, e->lo.z, e->hi.z)};
    bool flat = l->kind == LUM_EMIT_QUAD || l->kind == LUM_EMIT_DISC, sphere = l->kind == LUM_EMIT_SPHERE;
    bool point = l->kind == LUM_EMIT_POINT || l->kind == LUM_EMIT_SPOT, mesh = l->kind == LUM_EMIT_MESH;
    if (!(own->reference > 0.0f))
        return 0.0f;
    if (!flat && !sphere && !point && !mesh)
        return INFINITY;
    float radius = point ? 0.0f : own->radius;
    bool one_normal = lum_dot(e->n, e->n) > 0.0f;
    if (flat && !(farthest(e, l->n, l->p) > 0.0f))
        return 0.0f; /* all is behind the light */
    if (one_normal && !e->gloss && !(farthest(e, lum_v3_neg(e->n), own->p) + radius > 0.0f))
        return 0.0f; /* the light is behind all */
    float centre = lum_length(d), near = lum_max(centre - radius, point ? LUM_POINT_LIGHT_NEAR : 0.0f);
    if (!(near > 0.0f))
        return INFINITY;
    float size = point ? 1.0f : l->kind == LUM_EMIT_QUAD || mesh ? l->area : LUM_PI * radius * radius;
    float brightest =
        mesh ? lum_max(l->mean_emission, 1.0f) : 1.0f; /* a texel of 1, or more in a picture of high range */
    float from = sphere ? centre : near;
    return LUM_INV_PI * own->reference * brightest * size / (from * from);
}

/* ---- the samples of a tile ---- */

/* About 90 KiB: lives on a worker's stack. */
struct tile_job {
    const struct lum_pass *pass;
    struct lum_counters *counters;
    uint32_t tile;
    struct lum_tile_rect r;
    struct extent extent;
    struct lum_vertices vertices;
    struct lum_rays rays;
    struct lum_rgb diffuse[LUM_RAY_BATCH],
        gloss[LUM_RAY_BATCH]; /* of a waiting ray: what it brings if nothing is there */
    uint8_t vertex[LUM_RAY_BATCH];
    uint32_t light[LUM_RAY_BATCH];
    enum lum_ray_kind kind;
};

static size_t pixel_of(const struct tile_job *t, uint32_t i)
{
    uint32_t slot = t->vertices.slot[i];
    return (size_t)(t->r.y + slot / t->r.w) * t->pass->tiling.w + t->r.x + slot % t->r.w;
}

static void keep(struct tile_job *t, uint32_t i, struct lum_rgb diffuse, struct lum_rgb gloss)
{
    struct lum_layers *l = t->pass->layers;
    struct lum_rgb *raw = &l->crowd.raw[pixel_of(t, i)];
    *raw = lum_rgb_add(*raw, diffuse);
    struct lum_rgb *other = &l->crowd.gloss[pixel_of(t, i)];
    *other = lum_rgb_add(*other, gloss);
}

enum { ASKED = 1, VISIBLE = 2 };

/* Where the bits of a sample are, and by how much they are shifted; NULL: they are not kept. */
static uint8_t *bits_of(const struct tile_job *t, uint32_t light, uint32_t i, uint32_t *ret_shift)
{
    const struct lum_crowd *c = &t->pass->layers->crowd;
    if (!c->seen)
        return NULL;
    uint32_t slot = t->vertices.slot[i];
    *ret_shift = 2 * (slot % 4);
    return &c->seen[((size_t)t->tile * c->n_lights + light) * BYTES_PER_LIGHT + slot / 4];
}

static void remember(struct tile_job *t, uint32_t light, uint32_t i, bool visible)
{
    uint32_t shift;
    uint8_t *bits = bits_of(t, light, i, &shift);
    if (bits)
        *bits |= (uint8_t)((ASKED | (visible ? VISIBLE : 0)) << shift);
}

static bool is_white(struct lum_rgb c)
{
    return c.r == 1.0f && c.g == 1.0f && c.b == 1.0f;
}

static void flush(struct tile_job *t)
{
    if (t->rays.n == 0)
        return;
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH];
    struct lum_trace trace = lum_trace_of_light(t->pass->snapshot, t->counters, lum_pass_panes(t->pass));
    lum_trace_light(&trace, &t->rays, occluded, left);
    t->counters->rays[t->kind] += t->rays.n;
    for (uint32_t i = 0; i < t->rays.n; i++) {
        struct lum_rgb share = trace.panes && !occluded[i] ? left[i] : lum_grey(1.0f);
        if (occluded[i] || is_white(share)) /* what panes dim is asked again */
            remember(t, t->light[i], t->vertex[i], !occluded[i]);
        if (!occluded[i])
            keep(t, t->vertex[i], lum_rgb_mul(t->diffuse[i], share), lum_rgb_mul(t->gloss[i], share));
    }
    t->rays.n = 0;
}

static float over(float a, float b)
{
    return b > 0.0f ? a / b : 0.0f;
}

/* What a sample brings: reflected by the base, albedo taken out, and otherwise. False: nothing. */
static bool value_of(const struct tile_job *t, uint32_t i, const struct lum_light_sample *ls, float times,
                     struct lum_rgb *ret_diffuse, struct lum_rgb *ret_gloss)
{
    const struct lum_vertices *v = &t->vertices;
    struct lum_bsdf_value f = lum_bsdf_eval_parts(&v->bsdf[i], v->wo[i], ls->wi);
    struct lum_rgb albedo = t->pass->surfaces->albedo[pixel_of(t, i)];
    bool delta = !(ls->pdf_sa > 0.0f);
    struct lum_rgb light = lum_rgb_scale(ls->radiance, delta ? times : times / ls->pdf_sa);
    if (t->pass->on[LUM_EFFECT_MEDIA])
        light = lum_rgb_mul(light, lum_media_transmittance(t->pass->snapshot, v->p[i], ls->wi, ls->distance));
    float weight = t->pass->on[LUM_EFFECT_GLOSSY] && !delta ? lum_power_heuristic(ls->pdf_sa, f.gloss_pdf_sa) : 1.0f;
    *ret_diffuse = lum_rgb(over(f.diffuse.r, albedo.r), over(f.diffuse.g, albedo.g), over(f.diffuse.b, albedo.b));
    *ret_diffuse = lum_rgb_mul(*ret_diffuse, light);
    *ret_gloss = lum_rgb_mul(f.gloss, lum_rgb_scale(light, weight));
    return !lum_rgb_black(*ret_diffuse) || !lum_rgb_black(*ret_gloss);
}

static void ask(struct tile_job *t, uint32_t light, uint32_t i, struct lum_sampler sampler, float times)
{
    struct lum_light_sample ls;
    struct lum_rgb diffuse, gloss;
    const struct lum_vertices *v = &t->vertices;
    if (!lum_light_sample_at(t->pass->snapshot, light, v->p[i], lum_sampler_2d(&sampler, PAIR_CROWD), &ls) ||
        !value_of(t, i, &ls, times, &diffuse, &gloss))
        return;
    if (light == t->pass->cached_sky) { /* the records bring it */
        if (lum_rgb_black(gloss))
            return;
        diffuse = lum_grey(0.0f);
    }
    uint32_t at = t->rays.n, shift;
    const uint8_t *bits = bits_of(t, light, i, &shift);
    uint32_t known = bits ? (uint32_t)*bits >> shift : 0;
    if (known & ASKED) {
        if (known & VISIBLE)
            keep(t, i, diffuse, gloss);
        return;
    }
    if (!lum_shadow_ray(&t->rays, v->p[i], v->bsdf[i].ng, ls.wi, ls.distance)) {
        keep(t, i, diffuse, gloss);
        return;
    }
    t->diffuse[at] = diffuse;
    t->gloss[at] = gloss;
    t->vertex[at] = (uint8_t)i;
    t->light[at] = light;
    if (t->rays.n == LUM_RAY_BATCH)
        flush(t);
}

/* One pixel in `of` samples the light and counts as many times. */
static void sample_light(struct tile_job *t, uint32_t light, uint32_t of)
{
    const struct lum_light *l = &t->pass->snapshot->lights.lights[light];
    uint32_t salt = lum_hash_text(l->id);
    if (t->kind != lum_light_ray_kind(l))
        flush(t);
    t->kind = lum_light_ray_kind(l);
    for (uint32_t i = 0; i < t->vertices.n; i++) {
        uint32_t set = lum_pattern_set(LUM_SOFT_SIDE, t->r.x + t->vertices.slot[i] % t->r.w,
                                       t->r.y + t->vertices.slot[i] / t->r.w);
        if ((set + salt) % of != 0)
            continue;
        struct lum_sampler sampler = {lum_hash_combine(salt, t->pass->settings->seed), set};
        ask(t, light, i, sampler, (float)of);
    }
}

/* ---- which lights, how densely ---- */

/* The next light of the crowd, with *inout_i from 0; LUM_NO_OBJECT ends. Also those that do not shine now: what is
 * planned for the others must not depend on it. */
static uint32_t next_light(const struct lum_pass *pass, uint32_t *inout_i)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    while (*inout_i < lights->n_lights) {
        uint32_t light = (*inout_i)++;
        if (lum_layers_in_crowd(pass->layers, light) && pass->on[lum_light_effect(&lights->lights[light])])
            return light;
    }
    return LUM_NO_OBJECT;
}

/* Octave 0: brightest, or without a bound. */
static uint32_t octave_of(float bound, float largest)
{
    if (!(bound < INFINITY) || !(bound < largest))
        return 0;
    float o = log2f(largest / bound);
    return o < (float)(OCTAVES - 1) ? (uint32_t)o : OCTAVES - 1;
}

struct bounds {
    float largest; /* of those that are finite */
    double sum[OCTAVES];
    double all;
    uint32_t n[OCTAVES];
};

static struct bounds sum_bounds(const struct tile_job *t)
{
    const struct lum_light *lights = t->pass->snapshot->lights.lights;
    const struct lum_crowd_light *own = t->pass->layers->crowd.lights;
    struct bounds b = {0};
    for (int round = 0; round < 2; round++) {
        uint32_t a = 0;
        for (uint32_t light; (light = next_light(t->pass, &a)) != LUM_NO_OBJECT;) {
            float bound = bound_of(&lights[light], &own[light], &t->extent);
            if (round == 0) {
                b.largest = bound < INFINITY ? lum_max(b.largest, bound) : b.largest;
                continue;
            }
            if (!(bound > 0.0f))
                continue;
            uint32_t o = octave_of(bound, b.largest);
            b.n[o]++;
            b.sum[o] += bound < INFINITY ? (double)bound : 0.0;
        }
    }
    for (uint32_t o = 0; o < OCTAVES; o++)
        b.all += b.sum[o];
    return b;
}

/* Luminance that the samples so far bring to a pixel of the tile, on average. */
static double brightness(const struct tile_job *t)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < t->vertices.n; i++) {
        size_t pixel = pixel_of(t, i);
        struct lum_rgb c = lum_rgb_mul(t->pass->surfaces->albedo[pixel], t->pass->layers->crowd.raw[pixel]);
        sum += (double)lum_luminance(c);
    }
    return sum / t->vertices.n;
}

/* A light of 1/16 of all is sampled by every pixel, lesser ones by fewer. */
static uint32_t one_in(float bound, double all)
{
    uint32_t of = 1;
    while (of < LUM_SOFT_POINTS && bound < INFINITY && (double)bound * of * LUM_SOFT_POINTS < all)
        of *= 2;
    return of;
}

/* From the brightest octave down, until the rest cannot be seen. */
static void sample_lights(struct tile_job *t)
{
    const struct lum_light_table *table = &t->pass->snapshot->lights;
    const struct lum_light *lights = table->lights;
    const struct lum_crowd_light *own = t->pass->layers->crowd.lights;
    struct bounds b = sum_bounds(t);
    double rest = b.all;
    uint8_t *cut = &t->pass->layers->crowd.cut[t->tile];
    for (uint32_t o = 0; o < (*cut == CUT_OPEN ? OCTAVES : *cut); o++) {
        double bright = *cut == CUT_OPEN ? brightness(t) : 0.0;
        if (o > 0 && *cut == CUT_OPEN && !t->extent.gloss && rest <= (double)CULL_SHARE * bright) {
            double share = bright > 0.0 ? rest / bright : 0.0;
            t->counters->culled_bound = fmax(t->counters->culled_bound, share);
            *cut = (uint8_t)o;
            return;
        }
        uint32_t a = 0;
        for (uint32_t light; b.n[o] > 0 && (light = next_light(t->pass, &a)) != LUM_NO_OBJECT;) {
            float bound = bound_of(&lights[light], &own[light], &t->extent);
            if (bound > 0.0f && octave_of(bound, b.largest) == o && table->pick_pdf[light] > 0.0f)
                sample_light(t, light, one_in(bound, b.all));
        }
        flush(t);
        rest -= b.sum[o];
    }
    if (*cut == CUT_OPEN)
        *cut = OCTAVES;
}

/* True when one of them reflects with a gloss. */
static bool fill_vertices(struct tile_job *t)
{
    bool gloss = false;
    const struct lum_pass *pass = t->pass;
    struct lum_rays rays;
    lum_tile_center_rays(pass, t->tile, &rays);
    t->vertices.n = 0;
    for (uint32_t i = 0; i < rays.n; i++) {
        size_t pixel = (size_t)(t->r.y + i / t->r.w) * pass->tiling.w + t->r.x + i % t->r.w;
        pass->layers->crowd.raw[pixel] = pass->layers->crowd.gloss[pixel] = lum_grey(0.0f);
        uint8_t kind = pass->surfaces->kind[pixel];
        if (!(kind & (LUM_PIXEL_DIFFUSE | LUM_PIXEL_GLOSS)))
            continue;
        gloss = gloss || (kind & LUM_PIXEL_GLOSS);
        struct lum_vec3 d = lum_rays_direction(&rays, i), wo = lum_v3_neg(d);
        struct lum_surface s;
        lum_snapshot_surface(pass->snapshot, &pass->gbuffer->tiles[t->tile], i, d, &s);
        lum_bsdf_init(&t->vertices.bsdf[t->vertices.n], &pass->snapshot->materials[s.material], &s, wo);
        lum_vertices_push(&t->vertices, i, s.p, wo, 0);
    }
    return gloss;
}

static void trace_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    struct lum_crowd *c = &pass->layers->crowd;
    if (!c->on || c->done[tile])
        return;
    if (c->cut[tile] == CUT_FORGOTTEN && c->seen)
        memset(c->seen + (size_t)tile * c->n_lights * BYTES_PER_LIGHT, 0, (size_t)c->n_lights * BYTES_PER_LIGHT);
    if (c->cut[tile] == CUT_FORGOTTEN)
        c->cut[tile] = CUT_OPEN;
    struct tile_job t;
    t.pass = pass;
    t.counters = counters;
    t.tile = tile;
    t.r = lum_tile_at(&pass->tiling, tile);
    t.rays.n = 0;
    t.kind = LUM_RAY_SOFT_SHADOW;
    bool gloss = fill_vertices(&t);
    if (t.vertices.n > 0 && pass->settings->max_depth > 0) {
        t.extent = extent_of(&t.vertices, gloss);
        sample_lights(&t);
    }
    c->done[tile] = 1;
}

static void join_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    (void)counters;
    struct lum_crowd *c = &pass->layers->crowd;
    if (!c->on || c->joined[tile])
        return;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_filter f = {.guide = &guide, .need = LUM_PIXEL_DIFFUSE, .side = LUM_SOFT_SIDE, .step = 1, .in = c->raw};
    struct lum_filter_rect rect = {r.x, r.y, r.w, r.h};
    lum_filter_box(&f, &rect, c->smooth + (size_t)r.y * pass->tiling.w + r.x, pass->tiling.w);
    c->joined[tile] = 1;
}

const struct lum_estimator lum_crowd_trace = {
    .name = "crowd", .stage = LUM_STAGE_REFINE, .tile = trace_tile, .surfaces = true, .then = &lum_crowd_join};
const struct lum_estimator lum_crowd_join = {
    .name = "crowd, join", .stage = LUM_STAGE_FILTER, .tile = join_tile, .surfaces = true};
