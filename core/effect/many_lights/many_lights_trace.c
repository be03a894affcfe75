/* The samples of many lights (many_lights.h), tile by tile. */
#include <string.h>

#include "core/pass/components.h"
#include "core/effect/many_lights/many_lights_stages.h"
#include "core/effect/direct/direct.h"
#include "core/effect/direct/layers.h"
#include "core/effect/direct/area_visibility.h"
#include "core/interleave/interleave.h"
#include "core/light/emitter.h"
#include "core/math/sampler.h"
#include "core/math/sampler_pairs.h"
#include "core/math/warp.h"
#include "core/medium/medium.h"
#include "core/scene/surface.h"

#define CULL_SHARE (1.0f / 512) /* of a tile's brightness: half a step of 8 bits */
#define OCTAVES 64              /* that bounds are told apart by, from the brightest */
_Static_assert(OCTAVES < LUM_CUT_FORGOTTEN, "a tile's cut is a number of octaves");

/* ---- what a light can bring to a tile ---- */

struct extent {
    struct lum_vec3 lo, hi;
    struct lum_vec3 n; /* of all of them; 0: they differ */
    bool gloss;        /* whose peaks have no useful bound */
};

static struct extent extent_of(const struct lum_vertices *v, const struct lum_vec3 *normal, bool gloss)
{
    struct extent e = {.lo = v->p[0], .hi = v->p[0], .n = normal[0], .gloss = gloss};
    for (uint32_t i = 0; i < v->n; i++) {
        struct lum_vec3 p = v->p[i], n = normal[i];
        e.lo = lum_v3_min(e.lo, p);
        e.hi = lum_v3_max(e.hi, p);
        if (!lum_v3_same(n, e.n))
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
 * planned for; of a mesh whose texels are of high range it is by their mean, and bright spots of it may send more.
 * INFINITY: the light is too near to say, or has no place. A sphere's is exact where it is faced; other shapes send at
 * most area / distance^2, and of what is closed half of the area is seen. Where all surfaces face one way, and where
 * the light does, what arrives has the cosines of at least that slant. */
static float bound_of(const struct lum_light *l, const struct lum_sampled_light *own, const struct extent *e)
{
    struct lum_vec3 d = {outside(own->p.x, e->lo.x, e->hi.x), outside(own->p.y, e->lo.y, e->hi.y),
                         outside(own->p.z, e->lo.z, e->hi.z)};
    bool flat = l->kind->flat, sphere = l->kind == &lum_emitter_sphere;
    bool point = l->kind == &lum_emitter_point, mesh = l->kind == &lum_emitter_mesh;
    if (!(own->reference > 0.0f))
        return 0.0f;
    if (!flat && !sphere && !point && !mesh)
        return INFINITY;
    float radius = point ? 0.0f : own->radius;
    bool one_normal = lum_dot(e->n, e->n) > 0.0f;
    float before_light = flat ? farthest(e, l->n, l->p) : INFINITY;
    if (!(before_light > 0.0f))
        return 0.0f; /* all is behind the light */
    float above = one_normal && !e->gloss ? farthest(e, lum_v3_neg(e->n), own->p) + radius : INFINITY;
    if (!(above > 0.0f))
        return 0.0f; /* the light is behind all */
    float centre = lum_length(d), near = centre - radius;
    if (!(near > (point ? LUM_POINT_LIGHT_NEAR : 0.0f))) /* nearer the distance of points is bounded, no cosine is */
        return INFINITY;
    float size = point ? 1.0f : sphere ? LUM_PI * radius * radius : l->area;
    float brightest =
        mesh ? lum_max(l->mean_emission, 1.0f) : 1.0f; /* a texel of 1, or more in a picture of high range */
    float from = sphere ? centre : near;
    /* Of a sphere size / from^2 is pi sin^2 of its cone, whose solid angle is 2 / (1 + cos) times that. */
    float sin2 = sphere ? radius * radius / (from * from) : 0.0f;
    float wide = 2.0f / (1.0f + sqrtf(lum_max(1.0f - sin2, 0.0f)));
    float cosines = lum_min(wide * above / near, 1.0f) * lum_min(before_light / near, 1.0f);
    return LUM_INV_PI * own->reference * brightest * size * cosines / (from * from);
}

/* ---- the samples of a tile ---- */

#define NOWHERE UINT16_MAX

/* About 90 KiB: lives on a worker's stack. */
struct tile_job {
    const struct lum_pass *pass;
    struct lum_counters *counters;
    uint32_t tile;
    struct lum_tile_rect r;
    struct extent extent;
    struct lum_vertices vertices;                            /* bsdf and wo: of those that are not matte */
    struct lum_vec3 n[LUM_TILE_PIXELS], ng[LUM_TILE_PIXELS]; /* by vertex, as the next one */
    bool matte[LUM_TILE_PIXELS];
    double bright; /* luminance that the samples so far bring to all of them */
    bool used[LUM_MANY_LIGHTS_WINDOWS];
    uint16_t vertex_at[LUM_TILE_PIXELS]; /* by place (place_of); NOWHERE: there is none */
    /* samples that wait for their rays; those that need none wait with them, as the order of a sum shows in its last
     * bits */
    uint32_t n_waiting;
    struct waiting {
        struct lum_rgb diffuse, gloss; /* what it brings if nothing is there */
        uint32_t light;
        uint8_t vertex, window;
        bool known; /* it is visible; else its ray is the next one */
    } waiting[LUM_RAY_BATCH];
    struct lum_rays rays;
    enum lum_ray_kind kind;
};

static size_t pixel_of(const struct tile_job *t, uint32_t i)
{
    uint32_t slot = t->vertices.slot[i];
    return (size_t)(t->r.y + slot / t->r.w) * t->pass->tiling.w + t->r.x + slot % t->r.w;
}

static void keep(struct tile_job *t, uint32_t i, uint32_t window, struct lum_rgb diffuse, struct lum_rgb gloss)
{
    const struct lum_many_lights *c = &t->pass->layers->many_lights;
    size_t pixel = pixel_of(t, i);
    struct lum_rgb *d = &c->sum[LUM_MANY_LIGHTS_DIFFUSE][window][pixel],
                   *g = &c->sum[LUM_MANY_LIGHTS_GLOSS][window][pixel];
    *d = lum_rgb_add(*d, diffuse);
    t->bright += (double)lum_luminance(lum_rgb_mul(t->pass->surfaces->albedo[pixel], diffuse));
    if (!t->matte[i])
        *g = lum_rgb_add(*g, gloss);
}

enum { ASKED = 1, VISIBLE = 2 }; /* bits that are kept of a sample */

/* Where the bits of a sample are, and by how much they are shifted; NULL: they are not kept. */
static uint8_t *bits_of(const struct tile_job *t, uint32_t light, uint32_t i, uint32_t *ret_shift)
{
    const struct lum_many_lights *c = &t->pass->layers->many_lights;
    if (!c->visibility)
        return NULL;
    uint32_t slot = t->vertices.slot[i];
    *ret_shift = 2 * (slot % 4);
    return &lum_many_lights_bits(c, t->tile, light)[slot / 4];
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

/* Traces what waits, and adds it up. */
static void flush(struct tile_job *t)
{
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH];
    struct lum_trace trace = lum_trace_of_light(t->pass->snapshot, t->counters, lum_pass_panes(t->pass));
    if (t->rays.n > 0)
        lum_trace_light(&trace, &t->rays, occluded, left);
    t->counters->rays[t->kind] += t->rays.n;
    for (uint32_t k = 0, ray = 0; k < t->n_waiting; k++) {
        struct waiting *w = &t->waiting[k];
        bool visible = w->known || !occluded[ray];
        struct lum_rgb share = trace.panes && !w->known && visible ? left[ray] : lum_grey(1.0f);
        if (!w->known && (!visible || is_white(share))) /* what panes dim is asked again */
            remember(t, w->light, w->vertex, visible);
        if (visible)
            keep(t, w->vertex, w->window, lum_rgb_mul(w->diffuse, share), lum_rgb_mul(w->gloss, share));
        ray += !w->known;
    }
    t->rays.n = t->n_waiting = 0;
}

/* What a sample brings: reflected by the base, albedo taken out, and otherwise. False: nothing. */
static bool value_of(const struct tile_job *t, uint32_t i, const struct lum_light_sample *ls, float times,
                     struct lum_rgb *ret_diffuse, struct lum_rgb *ret_gloss)
{
    const struct lum_vertices *v = &t->vertices;
    float cosine = lum_dot(t->n[i], ls->wi);
    if (t->matte[i] && !(cosine > 0.0f && lum_dot(t->ng[i], ls->wi) > 0.0f))
        return false;
    bool delta = !(ls->pdf_sa > 0.0f);
    struct lum_rgb light = lum_rgb_scale(ls->radiance, delta ? times : times / ls->pdf_sa);
    if (t->pass->on[LUM_EFFECT_MEDIA])
        light = lum_rgb_mul(light, lum_media_transmittance(t->pass->snapshot, v->p[i], ls->wi, ls->distance));
    if (t->matte[i]) {
        *ret_diffuse = lum_rgb_scale(light, cosine * LUM_INV_PI);
        *ret_gloss = lum_grey(0.0f);
        return !lum_rgb_black(*ret_diffuse);
    }
    struct lum_bsdf_value f = lum_bsdf_eval_parts(&v->bsdf[i], v->wo[i], ls->wi);
    struct lum_rgb albedo = t->pass->surfaces->albedo[pixel_of(t, i)];
    float weight = t->pass->on[LUM_EFFECT_GLOSSY] && !delta ? lum_power_heuristic(ls->pdf_sa, f.gloss_pdf_sa) : 1.0f;
    *ret_diffuse = lum_rgb_mul(lum_rgb_share(f.diffuse, albedo), light);
    *ret_gloss = lum_rgb_mul(f.gloss, lum_rgb_scale(light, weight));
    return !lum_rgb_black(*ret_diffuse) || !lum_rgb_black(*ret_gloss);
}

/* A sample that all pixels of one set have in common. */
struct shot {
    uint32_t light;
    uint8_t window;
    float times;
    struct lum_vec2 u;
    struct lum_light_place place; /* that u leads to */
    bool placed;                  /* it is the same from wherever it is seen */
    struct lum_vec3 p;            /* of the ball that the light is in */
    float radius;                 /* INFINITY: it has no place */
};

static bool aim(const struct tile_job *t, const struct shot *shot, struct lum_vec3 p, struct lum_light_sample *ret)
{
    const struct lum_snapshot *s = t->pass->snapshot;
    const struct lum_light *l = &s->lights.lights[shot->light];
    if (shot->placed)
        return lum_light_sample_near(l, p, shot->u, ret) || lum_light_sample_place(l, p, &shot->place, ret);
    return lum_light_sample_at(s, shot->light, p, shot->u, ret);
}

static void ask(struct tile_job *t, const struct shot *shot, uint32_t i)
{
    struct lum_light_sample ls;
    struct lum_rgb diffuse, gloss;
    const struct lum_vertices *v = &t->vertices;
    uint32_t light = shot->light;
    if (t->matte[i] && !(lum_dot(t->n[i], lum_v3_sub(shot->p, v->p[i])) + shot->radius > 0.0f))
        return; /* all of it is below the horizon */
    if (!aim(t, shot, v->p[i], &ls) || !value_of(t, i, &ls, shot->times, &diffuse, &gloss))
        return;
    if (light == t->pass->cached_sky) { /* the records bring it */
        if (lum_rgb_black(gloss))
            return;
        diffuse = lum_grey(0.0f);
    }
    uint32_t shift;
    const uint8_t *bits = bits_of(t, light, i, &shift);
    uint32_t state = bits ? (uint32_t)*bits >> shift : 0;
    if ((state & ASKED) && !(state & VISIBLE))
        return;
    bool known = (state & ASKED) || !lum_shadow_ray(&t->rays, v->p[i], t->ng[i], ls.wi, ls.distance);
    t->waiting[t->n_waiting++] = (struct waiting){diffuse, gloss, light, (uint8_t)i, shot->window, known};
    if (t->n_waiting == LUM_RAY_BATCH)
        flush(t);
}

/* Where a pixel lies in the pattern of 16 x 16: its set in that of 4 x 4, and 16 times which of those it is. */
static uint32_t place_of(uint32_t x, uint32_t y)
{
    uint32_t near = lum_pattern_subset(2, x / LUM_AREA_SIDE, y / LUM_AREA_SIDE);
    uint32_t far = lum_pattern_subset(2, x / (2 * LUM_AREA_SIDE), y / (2 * LUM_AREA_SIDE));
    return lum_pattern_subset(LUM_AREA_SIDE, x, y) + LUM_AREA_POINTS * (near + 4 * far);
}

static bool has_place(const struct lum_light *l)
{
    return l->kind->flat || l->kind == &lum_emitter_sphere || l->kind == &lum_emitter_point ||
           l->kind == &lum_emitter_mesh;
}

/* One pixel in `of` samples the light and counts as many times. */
static void sample_light(struct tile_job *t, uint32_t light, uint32_t of)
{
    const struct lum_light *l = &t->pass->snapshot->lights.lights[light];
    const struct lum_sampled_light *own = &t->pass->layers->many_lights.lights[light];
    uint32_t salt = own->salt, first = (of - salt % of) % of;
    uint32_t sets = of < LUM_AREA_POINTS ? of : LUM_AREA_POINTS, places = of < LUM_AREA_POINTS ? LUM_AREA_POINTS : of;
    if (t->kind != lum_light_ray_kind(l))
        flush(t);
    t->kind = lum_light_ray_kind(l);
    struct lum_sampler sampler = {.pixel_seed = lum_hash_combine(salt, t->pass->settings->seed)};
    struct shot shot = {
        .light = light, .times = (float)of, .p = own->p, .radius = has_place(l) ? own->radius : INFINITY};
    shot.window = of <= LUM_AREA_POINTS ? 0 : of <= 4 * LUM_AREA_POINTS ? 1 : 2;
    t->used[shot.window] = true;
    for (uint32_t set = first % sets; set < LUM_AREA_POINTS; set += sets) {
        sampler.sample = set;
        shot.u = lum_sampler_2d(&sampler, LUM_PAIRS_MANY_LIGHTS);
        shot.placed = lum_light_place(t->pass->snapshot, l, shot.u, &shot.place);
        for (uint32_t at = of < LUM_AREA_POINTS ? set : first; at < LUM_TILE_PIXELS; at += places)
            if (t->vertex_at[at] != NOWHERE)
                ask(t, &shot, t->vertex_at[at]);
    }
}

/* ---- which lights, how densely ---- */

/* The next of the many lights, with *inout_i from 0; LUM_NO_OBJECT ends. Also those that do not shine now: what is
 * planned for the others must not depend on it. */
static uint32_t next_light(const struct lum_pass *pass, uint32_t *inout_i)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    while (*inout_i < lights->n_lights) {
        uint32_t light = (*inout_i)++;
        if (lum_layers_in_many_lights(pass->layers, light) && pass->on[lum_light_effect(&lights->lights[light])])
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

/* Lights that can bring the tile something, from the brightest octave down, and in their order within one. */
struct candidate {
    uint32_t light;
    float bound, now; /* at the power that it is planned for, and at the present one */
};
struct candidates {
    struct candidate *memory, *by_octave;
    uint32_t first[OCTAVES + 1]; /* of each octave */
    double sum[OCTAVES], all;    /* of finite bounds */
    double now[OCTAVES], all_now;
};

/* The light's power over what it is planned for. */
static float power_now(const struct tile_job *t, uint32_t light)
{
    const struct lum_light *l = &t->pass->snapshot->lights.lights[light];
    return l->on ? lum_luminance(l->power) / t->pass->layers->many_lights.lights[light].reference : 0.0f;
}

/* memory: to be freed with lum_free. False: memory is short. */
static bool find_candidates(const struct tile_job *t, struct candidates *ret)
{
    const struct lum_light_table *table = &t->pass->snapshot->lights;
    struct candidate *memory = lum_calloc(2 * (size_t)table->n_lights, sizeof *memory), *found = memory;
    uint32_t n = 0, next[OCTAVES] = {0}, a = 0;
    float largest = 0.0f;
    if (!memory)
        return false;
    *ret = (struct candidates){.memory = memory, .by_octave = memory + table->n_lights};
    for (uint32_t light; (light = next_light(t->pass, &a)) != LUM_NO_OBJECT;) {
        float bound = bound_of(&table->lights[light], &t->pass->layers->many_lights.lights[light], &t->extent);
        if (bound > 0.0f)
            found[n++] = (struct candidate){light, bound, bound * power_now(t, light)};
        largest = bound < INFINITY ? lum_max(largest, bound) : largest;
    }
    for (uint32_t k = 0; k < n; k++)
        ret->first[octave_of(found[k].bound, largest) + 1]++;
    for (uint32_t o = 0; o < OCTAVES; o++) {
        next[o] = ret->first[o];
        ret->first[o + 1] += ret->first[o];
    }
    for (uint32_t k = 0; k < n; k++) {
        uint32_t o = octave_of(found[k].bound, largest);
        ret->by_octave[next[o]++] = found[k];
        ret->sum[o] += found[k].bound < INFINITY ? (double)found[k].bound : 0.0;
        ret->now[o] += found[k].now < INFINITY ? (double)found[k].now : 0.0;
    }
    for (uint32_t o = 0; o < OCTAVES; o++) {
        ret->all += ret->sum[o];
        ret->all_now += ret->now[o];
    }
    return true;
}

/* A light of 1/16 of all is sampled by every pixel, lesser ones by fewer: those of 1/256 by one in a window of 4 x 4.
 * Those below that are asked half as often, those of 1/2048 by one in a tile: NOTES.md has what that saves and costs,
 * and why all others are not. */
static uint32_t one_in_of(float bound, double all)
{
    uint32_t of = 1;
    while (of < LUM_TILE_PIXELS && bound < INFINITY && (double)bound * of * LUM_AREA_POINTS < all)
        of *= 2;
    return of > LUM_AREA_POINTS && of < LUM_TILE_PIXELS ? 2 * of : of;
}

/* By the powers that lights are planned for, or, where a light has become so many times more of all that there is, by
 * the present ones: what was little beside a lamp that is dark by now shall not keep the detail of that. */
#define MORE_OF_ALL 16u

static uint32_t one_in(const struct candidates *c, const struct candidate *light)
{
    uint32_t planned = one_in_of(light->bound, c->all), now = one_in_of(light->now, c->all_now);
    return now * MORE_OF_ALL <= planned ? now : planned;
}

/* Octaves that were left out beside what is dark by now are sampled after all: once they may bring so many times more
 * of what there is than was left out. */
#define CULL_AGAIN 4.0

/* True when all from this octave on may be left out. */
static bool is_enough(const struct tile_job *t, const struct candidates *c, uint32_t octave, bool open)
{
    double rest = 0.0;
    if (octave == 0 || t->extent.gloss)
        return false;
    for (uint32_t o = octave; o < OCTAVES; o++)
        rest += open ? c->sum[o] : c->now[o];
    double bright = t->bright / t->vertices.n;
    if (!(rest <= (double)CULL_SHARE * (open ? 1.0 : CULL_AGAIN) * bright))
        return false;
    t->counters->culled_bound = fmax(t->counters->culled_bound, bright > 0.0 ? rest / bright : 0.0);
    return true;
}

/* From the brightest octave down, until the rest cannot be seen. False: memory is short. */
static bool sample_lights(struct tile_job *t)
{
    const float *pick_pdf = t->pass->snapshot->lights.pick_pdf;
    struct candidates c;
    if (!find_candidates(t, &c))
        return false;
    uint8_t *cut = &t->pass->layers->many_lights.cut[t->tile];
    bool open = *cut == LUM_CUT_OPEN;
    uint32_t o = 0;
    for (; o < OCTAVES; o++) {
        if ((open || o >= *cut) && is_enough(t, &c, o, open))
            break;
        for (uint32_t k = c.first[o]; k < c.first[o + 1]; k++)
            if (pick_pdf[c.by_octave[k].light] > 0.0f)
                sample_light(t, c.by_octave[k].light, one_in(&c, &c.by_octave[k]));
        flush(t);
    }
    *cut = (uint8_t)o;
    lum_free(c.memory);
    return true;
}

/* True when one of them reflects with a gloss. */
static bool fill_vertices(struct tile_job *t)
{
    bool gloss = false;
    const struct lum_pass *pass = t->pass;
    struct lum_rays rays;
    lum_tile_center_rays(pass, t->tile, &rays);
    t->vertices.n = 0;
    memset(t->vertex_at, 0xff, sizeof t->vertex_at);
    for (uint32_t i = 0; i < rays.n; i++) {
        size_t pixel = (size_t)(t->r.y + i / t->r.w) * pass->tiling.w + t->r.x + i % t->r.w;
        for (uint32_t part = 0; part < LUM_MANY_LIGHTS_PARTS; part++)
            for (uint32_t k = 0; k < LUM_MANY_LIGHTS_WINDOWS; k++)
                pass->layers->many_lights.sum[part][k][pixel] = lum_grey(0.0f);
        uint8_t kind = pass->surfaces->kind[pixel];
        if (!(kind & (LUM_PIXEL_DIFFUSE | LUM_PIXEL_GLOSS)))
            continue;
        gloss = gloss || (kind & LUM_PIXEL_GLOSS);
        struct lum_vec3 d = lum_rays_direction(&rays, i), wo = lum_v3_neg(d);
        uint32_t n = t->vertices.n;
        t->n[n] = pass->surfaces->n[pixel];
        t->ng[n] = pass->surfaces->ng[pixel];
        t->matte[n] = !(kind & (LUM_PIXEL_GLOSS | LUM_PIXEL_SPECULAR | LUM_PIXEL_SHEET));
        if (!t->matte[n]) { /* else what the eye saw says all */
            struct lum_surface s;
            lum_snapshot_surface(pass->snapshot, &pass->gbuffer->tiles[t->tile], i, d, &s);
            lum_bsdf_init(&t->vertices.bsdf[n], &pass->snapshot->materials[s.material], &s, wo);
        }
        t->vertex_at[place_of(t->r.x + i % t->r.w, t->r.y + i / t->r.w)] = (uint16_t)n;
        lum_vertices_push(&t->vertices, i, pass->surfaces->p[pixel], wo, 0);
    }
    return gloss;
}

static void trace_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    struct lum_many_lights *c = &pass->layers->many_lights;
    if (!c->on || lum_memo_step(&c->summed, tile))
        return;
    if (c->cut[tile] == LUM_CUT_FORGOTTEN && c->visibility)
        memset(c->visibility + (size_t)tile * c->n_lights * LUM_MANY_LIGHTS_TILE_BYTES, 0,
               (size_t)c->n_lights * LUM_MANY_LIGHTS_TILE_BYTES);
    if (c->cut[tile] == LUM_CUT_FORGOTTEN)
        c->cut[tile] = LUM_CUT_OPEN;
    struct tile_job t;
    t.pass = pass;
    t.counters = counters;
    t.tile = tile;
    t.r = lum_tile_at(&pass->tiling, tile);
    t.rays.n = t.n_waiting = 0;
    t.bright = 0.0;
    memset(t.used, 0, sizeof t.used);
    t.kind = LUM_RAY_SOFT_SHADOW;
    bool gloss = fill_vertices(&t);
    if (t.vertices.n > 0 && pass->settings->max_depth > 0) {
        t.extent = extent_of(&t.vertices, t.n, gloss);
        if (!sample_lights(&t)) {
            pass->layers->starved = true;
            return;
        }
        for (uint32_t k = 0; k < LUM_MANY_LIGHTS_WINDOWS; k++)
            if (t.used[k])
                c->used[k] = true;
    }
    lum_memo_set(&c->summed, tile, 1);
}

const struct lum_estimator lum_many_lights_trace = {.name = "many lights",
                                                    .stage = LUM_STAGE_REFINE,
                                                    .tile = trace_tile,
                                                    .surfaces = true,
                                                    .then = &lum_many_lights_widen};
