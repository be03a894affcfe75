/* Mirrors and glass, as Whitted (1980): from each pixel that shows a specular surface, both branches are followed by
 * closest hits to where light is scattered with spread, which is then shaded with direct light. Deterministic: nothing
 * is sampled but the shadows.
 *
 * Branches wait on a stack, sorted by depth; the deepest are traced first, a batch of one depth at a time. A depth gets
 * at most two branches for each of a batch of parents, and only when it is empty: 512 at the deepest and 256 left
 * behind at each depth above are all that ever wait. */
#include "core/effect/direct/direct.h"
#include "core/effect/specular/echo.h"
#include "core/effect/specular/specular.h"
#include "core/effect/indirect/records.h"
#include "core/math/sampler.h"
#include "core/math/sampler_pairs.h"
#include "core/pass/components.h"
#include "core/path/wave.h"
#include "core/scene/surface.h"
#include "core/vpl/gather.h"
#include "core/vpl/vpl.h"

#include <string.h>

#define BRANCH_DEPTH 30u        /* segments, as many as fit branch.path; a glass ball in a mirror room takes 8 */
#define BRANCH_MIN (1.0f / 512) /* of the pixel: half a step of 8 bits; a lesser branch is dropped */
#define STACK_MAX ((BRANCH_DEPTH + 1) * LUM_RAY_BATCH)

struct branch {
    struct lum_vec3 o, d;
    struct lum_rgb weight;
    uint32_t slot, depth; /* depth: segments up to its end */
    uint32_t path;        /* 1, and then a bit for each segment: 1 for a reflection. Names it within its pixel */
};

/* Light on its way to points in media that branches pass. */
struct fog {
    struct lum_rays rays;
    struct lum_rgb value[LUM_RAY_BATCH];
    uint32_t slot[LUM_RAY_BATCH];
};

/* Vertices by how much they weigh in their pixel: 1/2 and more, 1/4, ... A vertex that brings 1/2^k of its pixel
 * gathers from 1/2^k of the VPLs: no noisier in the picture, where most branches in glass and on water are faint.
 * CornellBox-Water (600 x 400) takes 0.74 million rays for indirect light instead of 1.62. */
#define FAINTNESS 4u
#define FAR_SIDES FAINTNESS /* and far sides of sheets that the eye sees, whose indirect light records may bring */

/* About 800 KiB: lives on a worker's stack. */
struct tree {
    const struct lum_pass *pass;
    struct lum_counters *counters;
    uint32_t tile, max_depth, n_branches;
    struct branch branches[STACK_MAX], batch[LUM_RAY_BATCH];
    struct lum_rays rays;
    struct lum_hits hits;
    struct lum_vertices vertices[FAINTNESS + 1];
    struct fog fog;
};

static uint32_t faintness(struct lum_rgb weight)
{
    uint32_t faint = 0;
    for (float w = lum_rgb_max(weight); faint + 1 < FAINTNESS && w < 0.5f; w *= 2.0f)
        faint++;
    return faint;
}

/* That of a cache stays the same while VPLs move, so that light in which none of them takes part does, too. */
static float spacing_of(const struct lum_pass *pass)
{
    return pass->records ? pass->records->cache->spacing : pass->vpls->spacing;
}

/* ---- what is kept ---- */

struct echoes {
    struct lum_echo *tiles; /* of indirect light; NULL: there is none, or fog, which terms leave out; or no memory */
    uint32_t n_tiles;
    _Atomic uint64_t vpl_hash; /* lum_echo_hash of the pass's VPLs; 0: nobody asked yet */
};

static void finish(void *state)
{
    struct echoes *e = state;
    lum_echo_destroy(e->tiles, e->n_tiles);
    *e = (struct echoes){0};
}

static bool keeps_echoes(const struct lum_pass *pass)
{
    return pass->components && pass->on[LUM_EFFECT_INDIRECT_DIFFUSE] &&
           !(pass->on[LUM_EFFECT_MEDIA] && pass->snapshot->n_media > 0);
}

/* Without memory for them what they would tell is traced again. */
static bool reserve(void *state, const struct lum_pass *pass)
{
    struct echoes *e = state;
    e->vpl_hash = 0;
    e->n_tiles = pass->tiling.n;
    if (keeps_echoes(pass) && !e->tiles)
        e->tiles = lum_calloc(e->n_tiles, sizeof *e->tiles);
    return true;
}

static void invalidate(void *state, const struct lum_pass *pass, const struct lum_outcome *outcome)
{
    (void)pass;
    struct echoes *e = state;
    for (uint32_t t = 0; outcome->light > LUM_FATE_DIMMED && e->tiles && t < e->n_tiles; t++)
        e->tiles[t].whole = false;
}

static const struct lum_state_kind echoes_kind = {sizeof(struct echoes), reserve, invalidate, finish};

/* NULL: nothing is kept. */
static struct lum_echo *echo_of(const struct lum_pass *pass, uint32_t tile)
{
    const struct echoes *e = lum_pass_state(pass, &echoes_kind);
    bool kept = pass->components && e->tiles && !(pass->on[LUM_EFFECT_MEDIA] && pass->snapshot->n_media > 0);
    return kept ? &e->tiles[tile] : NULL;
}

static uint64_t hash_of(const struct lum_pass *pass)
{
    struct echoes *e = lum_pass_state(pass, &echoes_kind);
    uint64_t hash = e->vpl_hash;
    if (hash == 0)
        e->vpl_hash = hash = lum_echo_hash(pass->vpls, spacing_of(pass));
    return hash;
}

static void add_indirect(const struct lum_pass *pass, const struct lum_echo_job *job,
                         const struct lum_echo_point *points, const struct lum_rgb *irradiance)
{
    enum lum_effect which = job->far ? LUM_EFFECT_TRANSMISSION : LUM_EFFECT_GLOSSY;
    for (uint32_t k = 0; k < job->n_points; k++)
        lum_component_add(pass->components, which, points[k].pixel,
                          lum_rgb_scale(lum_rgb_mul(points[k].weight, irradiance[k]), (float)job->step * LUM_INV_PI));
}

/* A vertex asks as many of a cache's VPLs as the settings say, and leaves those that it has to spare: of the VPLs of
 * its set one in so many. Faint ones leave more, but every set has one that is asked. */
static uint32_t spare_of(const struct lum_pass *pass, uint32_t n_sets, uint32_t faint)
{
    uint32_t spare = pass->records ? pass->records->cache->key.kind->spare : 0;
    faint = faint == FAR_SIDES ? 0 : faint;
    for (spare = spare > 0 ? spare : 1; faint > 0 && 2 * spare * n_sets <= pass->vpls->n_bounced; faint--)
        spare *= 2;
    return spare;
}

/* Vertices of pixels at one place of the pattern gather from that place's VPLs, faint ones from a part of them; what
 * neighbours gather from the others, the filter brings. */
static void gather_subset(struct tree *t, uint32_t faint, uint32_t set, uint32_t n_sets, uint32_t *slots)
{
    const struct lum_pass *pass = t->pass;
    const struct lum_vertices *v = &t->vertices[faint];
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, t->tile);
    struct lum_gather_points points = {.n_points = 0};
    uint32_t vertex[LUM_RAY_BATCH], n_slots = 0;
    for (uint32_t i = 0; i < v->n; i++) {
        uint32_t x = r.x + v->slot[i] % r.w, y = r.y + v->slot[i] / r.w;
        if (lum_pattern_subset(pass->settings->method->pattern, x, y) != set)
            continue;
        vertex[points.n_points] = i;
        points.p[points.n_points] = v->p[i];
        points.n[points.n_points] = v->bsdf[i].frame.n;
        points.ng[points.n_points++] = v->bsdf[i].ng;
    }
    if (points.n_points == 0)
        return;
    uint32_t spare = spare_of(pass, n_sets, faint), step = n_sets * spare,
             first = set + n_sets * (lum_hash_u32(set) % spare); /* the same in all tiles: else they would show */
    for (uint32_t k = first; k < pass->vpls->n_bounced; k += step)
        slots[n_slots++] = k;
    struct lum_rgb irradiance[LUM_RAY_BATCH] = {{0}};
    struct lum_echo_point seen[LUM_RAY_BATCH];
    for (uint32_t k = 0; k < points.n_points; k++) {
        uint32_t i = vertex[k], x = r.x + v->slot[i] % r.w, y = r.y + v->slot[i] / r.w;
        seen[k].pixel = y * pass->tiling.w + x;
        seen[k].weight =
            faint == FAR_SIDES ? lum_grey(1.0f) : lum_rgb_mul(v->weight[i], lum_bsdf_diffuse_albedo(&v->bsdf[i]));
    }
    struct lum_echo_job job = {
        .first = first, .step = step, .n_slots = n_slots, .n_points = points.n_points, .far = faint == FAR_SIDES};
    struct lum_echo *echo = echo_of(pass, t->tile);
    bool kept = echo && lum_echo_add(echo, &job, seen, LUM_ECHO_BYTES / pass->tiling.n);
    size_t first_term = kept ? echo->jobs[echo->n_jobs - 1].first_term : 0;
    lum_vpl_gather(&(struct lum_gather){
        .snapshot = pass->snapshot,
        .set = pass->vpls,
        .slots = slots,
        .n_slots = n_slots,
        .bound = lum_vpl_bound(spacing_of(pass)),
        .media = pass->on[LUM_EFFECT_MEDIA],
        .panes = lum_pass_panes(pass),
        .points = &points,
        .irradiance = irradiance,
        .terms = kept ? echo->terms + first_term : NULL,
        .left = kept && echo->panes ? echo->left + first_term : NULL,
        .counters = t->counters,
    });
    if (kept) /* the sum that a dimmed light will have made again */
        lum_echo_sum(echo, echo->n_jobs - 1, pass->vpls, irradiance);
    add_indirect(pass, &job, seen, irradiance);
}

/* Shows indirect light as it is now, where all is known of it. False: the tile has to be traced. */
static bool replay_echo(const struct lum_pass *pass, uint32_t tile)
{
    const struct lum_echo *e = echo_of(pass, tile);
    struct lum_rgb irradiance[LUM_RAY_BATCH];
    if (!e || !e->whole || (pass->vpls && e->hash != hash_of(pass)))
        return false;
    if (!pass->vpls) /* no indirect light at all */
        return true;
    if (!lum_echo_known(e, pass->vpls))
        return false;
    for (uint32_t k = 0; k < e->n_jobs; k++) {
        lum_echo_sum(e, k, pass->vpls, irradiance);
        add_indirect(pass, &e->jobs[k], e->points + e->jobs[k].first_point, irradiance);
    }
    return true;
}

static void shade_vertices(struct tree *t, uint32_t faint)
{
    if (t->vertices[faint].n == 0)
        return;
    if (faint == FAR_SIDES)
        lum_layers_light_matte(t->pass, t->tile, &t->vertices[faint], LUM_LAYER_COMPLETE, t->counters);
    else
        lum_layers_light(t->pass, t->tile, &t->vertices[faint], LUM_LAYER_COMPLETE, t->counters);
    if (faint == FAR_SIDES && t->pass->records) {
        t->vertices[faint].n = 0;
        return;
    }
    struct lum_echo *echo = echo_of(t->pass, t->tile);
    if (echo && t->pass->vpls && t->pass->vpls->n_lit == 0)
        echo->whole = false; /* what they will gather from is not asked for */
    if (t->pass->vpls && t->pass->vpls->n_lit > 0) {
        uint32_t slots[LUM_VPL_MAX / 4],
            n_sets = t->pass->settings->method->pattern * t->pass->settings->method->pattern;
        for (uint32_t set = 0; set < n_sets; set++)
            gather_subset(t, faint, set, n_sets, slots);
    }
    t->vertices[faint].n = 0;
}

static void push_branches(struct tree *t, const struct lum_bsdf *b, struct lum_vec3 p, struct lum_vec3 wo,
                          const struct branch *from)
{
    struct lum_bsdf_sample lobes[2];
    if (from->depth >= t->max_depth)
        return;
    uint32_t n = lum_bsdf_delta_lobes(b, wo, lobes);
    for (uint32_t i = 0; i < n; i++) {
        struct lum_rgb weight = lum_rgb_mul(from->weight, lobes[i].weight);
        bool mirror = lobes[i].lobe == LUM_LOBE_REFLECT;
        if (!(lum_rgb_max(weight) >= BRANCH_MIN) ||
            !t->pass->on[mirror ? LUM_EFFECT_REFLECTION : LUM_EFFECT_TRANSMISSION])
            continue;
        struct lum_vec3 side = lum_dot(lobes[i].wi, b->ng) >= 0.0f ? b->ng : lum_v3_neg(b->ng);
        t->branches[t->n_branches++] = (struct branch){
            lum_ray_offset(p, side), lobes[i].wi, weight, from->slot, from->depth + 1, 2 * from->path + mirror};
        t->counters->rays[mirror ? LUM_RAY_REFLECTION : LUM_RAY_TRANSMISSION]++;
    }
}

static void add_emission(struct tree *t, const struct branch *from, uint32_t light, struct lum_rgb per_power)
{
    struct lum_emission e = {from->slot, light, lum_rgb_mul(from->weight, per_power)};
    lum_layers_add(t->pass, t->tile, &e, LUM_LAYER_COMPLETE);
}

/* The vertex is shaded with direct light, if light from there still fits the depth. */
static void queue_vertex(struct tree *t, uint32_t faint, const struct lum_bsdf *b, struct lum_vec3 p,
                         struct lum_vec3 wo, const struct branch *from)
{
    if (!lum_bsdf_spreads(b) || from->depth >= t->max_depth)
        return;
    struct lum_vertices *v = &t->vertices[faint];
    if (v->n == LUM_RAY_BATCH)
        shade_vertices(t, faint);
    uint32_t i = v->n;
    struct lum_tile_rect r = lum_tile_at(&t->pass->tiling, t->tile);
    v->bsdf[i] = *b;
    /* Each vertex behind the pixel has samples of its own, whatever other pixels show. */
    uint32_t seed =
        lum_sampler_at(r.x + from->slot % r.w, r.y + from->slot / r.w, 0, t->pass->settings->seed).pixel_seed;
    lum_vertices_push(v, from->slot, p, wo, lum_hash_combine(seed, from->path));
    v->weight[i] = from->weight;
}

/* What arrives on the far side of a sheet, and is seen on this one: a surface like any other. */
static void queue_far_side(struct tree *t, const struct lum_bsdf *b, struct lum_vec3 p, struct lum_vec3 wo,
                           const struct branch *from)
{
    if (lum_rgb_black(b->through) || !t->pass->on[LUM_EFFECT_TRANSMISSION])
        return;
    struct lum_bsdf far = lum_bsdf_far_side(b);
    queue_vertex(t, from->depth == 0 ? FAR_SIDES : faintness(from->weight), &far, p, lum_v3_neg(wo), from);
}

/* ---- media ---- */

/* Per branch, medium and light, fewer of faint ones; neighbours have others, and the filter joins them. */
#define FOG_POINTS 4u

static void add_fog(struct tree *t, uint32_t slot, struct lum_rgb value)
{
    struct lum_tile_rect r = lum_tile_at(&t->pass->tiling, t->tile);
    size_t pixel = (size_t)(r.y + slot / r.w) * t->pass->tiling.w + r.x + slot % r.w;
    lum_component_add(t->pass->components, LUM_EFFECT_GLOSSY, pixel, value);
}

static void flush_fog(struct tree *t)
{
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH];
    if (t->fog.rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of_light(t->pass->snapshot, t->counters, lum_pass_panes(t->pass));
    lum_trace_light(&trace, &t->fog.rays, occluded, left);
    t->counters->rays[LUM_RAY_MEDIA] += t->fog.rays.n;
    for (uint32_t i = 0; i < t->fog.rays.n; i++)
        if (!occluded[i])
            add_fog(t, t->fog.slot[i], trace.panes ? lum_rgb_mul(t->fog.value[i], left[i]) : t->fog.value[i]);
    t->fog.rays.n = 0;
}

/* One point of one medium and one light on a branch. */
static void sample_fog(struct tree *t, const struct branch *b, const struct lum_scatter_query *q,
                       const struct lum_sampler *sampler, uint32_t n_points)
{
    uint32_t pair = LUM_PAIRS_SPECULAR_FOG + 2 * (q->medium + LUM_MEDIA_MAX * q->light);
    struct lum_scatter s;
    if (!lum_medium_scatter(q, lum_sampler_2d(sampler, pair), lum_sampler_2d(sampler, pair + 1), &s))
        return;
    struct lum_rgb value = lum_rgb_scale(lum_rgb_mul(b->weight, s.radiance), 1.0f / (float)n_points);
    if (t->fog.rays.n == LUM_RAY_BATCH)
        flush_fog(t);
    uint32_t i = t->fog.rays.n;
    if (!lum_shadow_ray(&t->fog.rays, s.p, lum_v3(0, 0, 0), s.wi, s.distance)) {
        add_fog(t, b->slot, value);
        return;
    }
    t->fog.value[i] = value;
    t->fog.slot[i] = b->slot;
}

/* What a branch's segment gains and loses in media. */
static void cross_media(struct tree *t, struct branch *b, float tmax)
{
    const struct lum_snapshot *s = t->pass->snapshot;
    struct lum_scatter_query q = {.snapshot = s, .o = b->o, .d = b->d, .tmax = tmax};
    struct lum_tile_rect r = lum_tile_at(&t->pass->tiling, t->tile);
    struct lum_sampler sampler = lum_sampler_at(r.x + b->slot % r.w, r.y + b->slot / r.w, 0, t->pass->settings->seed);
    sampler.pixel_seed = lum_hash_combine(sampler.pixel_seed, b->path);
    uint32_t fewer = FOG_POINTS >> faintness(b->weight), n_points = fewer > 0 ? fewer : 1;
    for (q.medium = 0; q.medium < s->n_media && b->depth < t->max_depth; q.medium++)
        for (uint32_t a = 0; a < s->lights.n_active; a++) {
            q.light = s->lights.active[a];
            for (sampler.sample = 0; sampler.sample < n_points; sampler.sample++)
                sample_fog(t, b, &q, &sampler, n_points);
        }
    b->weight = lum_rgb_mul(b->weight, lum_media_transmittance(s, b->o, b->d, tmax));
}

/* ---- branches ---- */

static void remember(const struct tree *t, const struct lum_branch *branch)
{
    struct lum_branches *tiles = t->pass->layers->branches;
    if (tiles)
        lum_branches_add(&tiles[t->tile], branch,
                         (uint32_t)(LUM_BRANCHES_BYTES / (t->pass->tiling.n * sizeof *tiles->branches)));
}

/* Remembers where the batch went. */
static void remember_batch(const struct tree *t, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        bool hit = t->hits.object[i] != LUM_NO_OBJECT;
        float length = hit ? lum_min(t->hits.t[i], LUM_SEGMENT_FAR) : LUM_SEGMENT_FAR;
        struct lum_vec3 o = t->batch[i].o;
        remember(t, &(struct lum_branch){.from = o, .to = lum_v3_mad(o, t->batch[i].d, length), .lit = hit});
    }
}

/* A branch ended on hit i of the batch. */
static void visit(struct tree *t, uint32_t i)
{
    const struct lum_snapshot *unit = &t->pass->layers->unit;
    struct branch from = t->batch[i];
    bool missed = t->hits.object[i] == LUM_NO_OBJECT;
    if (t->pass->on[LUM_EFFECT_MEDIA])
        cross_media(t, &from, missed ? INFINITY : t->hits.t[i]);
    if (missed) {
        if (unit->lights.environment != LUM_NO_OBJECT)
            add_emission(t, &from, unit->lights.environment, lum_lights_background(&unit->lights, from.d, false));
        return;
    }
    struct lum_surface s;
    lum_snapshot_surface(unit, &t->hits, i, from.d, &s);
    if (s.instance == LUM_NO_OBJECT) {
        add_emission(t, &from, s.light, s.emission);
        return;
    }
    const struct lum_material *m = &unit->materials[s.material];
    if (s.backface)
        from.weight = lum_rgb_mul(from.weight, lum_material_transmittance(m, t->hits.t[i]));
    struct lum_vec3 wo = lum_v3_neg(from.d);
    struct lum_bsdf b;
    lum_bsdf_init(&b, m, &s, wo);
    if (!lum_rgb_black(b.emission))
        add_emission(t, &from, s.light, b.emission);
    queue_vertex(t, faintness(from.weight), &b, s.p, wo, &from);
    queue_far_side(t, &b, s.p, wo, &from);
    push_branches(t, &b, s.p, wo, &from);
}

/* Sheets that the eye sees are lit on their far side: boxes around what blocks of pixels show of them. At 4K a box for
 * each pixel would take all the room there is. */
#define SHEET_BLOCK 4u
enum { SHEET_BLOCKS = LUM_TILE_SIDE / SHEET_BLOCK };

static void remember_sheets(const struct tree *t, struct lum_bounds sheets[SHEET_BLOCKS][SHEET_BLOCKS])
{
    for (uint32_t k = 0; k < SHEET_BLOCKS * SHEET_BLOCKS; k++) {
        const struct lum_bounds *b = &sheets[k / SHEET_BLOCKS][k % SHEET_BLOCKS];
        if (b->lo.x <= b->hi.x)
            remember(t, &(struct lum_branch){.from = b->lo, .to = b->hi, .lit = true, .box = true});
    }
}

/* First vertices: what the eye sees, as in the G-buffer. Their own direct light is the shadow estimator's. */
static void plant(struct tree *t)
{
    const struct lum_snapshot *unit = &t->pass->layers->unit;
    const struct lum_hits *hits = &t->pass->gbuffer->tiles[t->tile];
    if (hits->white)
        return;
    struct lum_bounds sheets[SHEET_BLOCKS][SHEET_BLOCKS];
    struct lum_tile_rect r = lum_tile_at(&t->pass->tiling, t->tile);
    for (uint32_t k = 0; k < SHEET_BLOCKS * SHEET_BLOCKS; k++)
        sheets[k / SHEET_BLOCKS][k % SHEET_BLOCKS] = LUM_BOUNDS_EMPTY;
    lum_tile_center_rays(t->pass, t->tile, &t->rays);
    for (uint32_t i = 0; i < t->rays.n; i++) {
        if (hits->object[i] >= unit->n_instances) /* background and emitters */
            continue;
        const struct lum_material *m = &unit->materials[unit->instances[hits->object[i]].material];
        if (!lum_material_is_specular(m) && !lum_material_is_sheet(m))
            continue;
        struct lum_vec3 d = lum_rays_direction(&t->rays, i), wo = lum_v3_neg(d);
        struct lum_surface s;
        struct lum_bsdf b;
        lum_snapshot_surface(unit, hits, i, d, &s);
        lum_bsdf_init(&b, m, &s, wo);
        struct branch root = {.weight = lum_grey(1.0f), .slot = i, .path = 1};
        if (!lum_rgb_black(b.through) && t->pass->on[LUM_EFFECT_TRANSMISSION])
            lum_bounds_grow(&sheets[i / r.w / SHEET_BLOCK][i % r.w / SHEET_BLOCK], s.p);
        queue_far_side(t, &b, s.p, wo, &root);
        push_branches(t, &b, s.p, wo, &root);
    }
    remember_sheets(t, sheets);
}

/* Takes a batch of the deepest branches off the stack. */
static uint32_t pop_batch(struct tree *t)
{
    uint32_t n = 0, depth = t->branches[t->n_branches - 1].depth;
    t->rays.n = 0;
    while (n < LUM_RAY_BATCH && t->n_branches > 0 && t->branches[t->n_branches - 1].depth == depth) {
        t->batch[n] = t->branches[--t->n_branches];
        lum_rays_push(&t->rays, t->batch[n].o, t->batch[n].d, INFINITY);
        n++;
    }
    return n;
}

static void specular_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    bool gathered = !pass->components || lum_components_enter(pass, LUM_EFFECT_REFLECTION, tile);
    if (lum_layers_reached(pass, tile, LUM_LAYER_COMPLETE) && (gathered || replay_echo(pass, tile)))
        return;
    if (echo_of(pass, tile))
        lum_echo_begin(echo_of(pass, tile), pass->vpls ? hash_of(pass) : 0, lum_pass_panes(pass));
    struct tree t;
    t.pass = pass;
    t.counters = counters;
    t.tile = tile;
    t.max_depth = pass->settings->max_depth < BRANCH_DEPTH ? pass->settings->max_depth : BRANCH_DEPTH;
    t.n_branches = t.fog.rays.n = 0;
    for (uint32_t faint = 0; faint <= FAR_SIDES; faint++)
        t.vertices[faint].n = 0;
    if (pass->layers->branches)
        lum_branches_begin(&pass->layers->branches[tile]);
    plant(&t);
    while (t.n_branches > 0) {
        uint32_t n = pop_batch(&t);
        struct lum_trace trace = lum_trace_of(pass->snapshot, counters);
        lum_trace_closest(&trace, &t.rays, &t.hits);
        remember_batch(&t, n);
        for (uint32_t i = 0; i < n; i++) {
            lum_snapshot_ask_ahead(&pass->layers->unit, &t.hits, i, n);
            visit(&t, i);
        }
    }
    for (uint32_t faint = 0; faint <= FAR_SIDES; faint++)
        shade_vertices(&t, faint);
    flush_fog(&t);
    lum_layers_reach(pass, tile, LUM_LAYER_COMPLETE);
}

const struct lum_estimator lum_estimator_specular = {
    .name = "specular",
    .stage = LUM_STAGE_SPECULAR,
    .tile = specular_tile,
    .state = &echoes_kind,
    /* indirect light and fog behind mirrors and glass; indirect light that sheets let through */
    .joins = LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY) | LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION),
};

const struct lum_effect_row lum_effect_reflection = {.demand = lum_demand_by_surface,
                                                     .scatter = LUM_SCATTER_MIRROR,
                                                     .lamps_count = true,
                                                     .glow_counts = true,
                                                     .why = "is a mirror",
                                                     .why_not = "no object is a mirror",
                                                     .usual = &lum_estimator_specular};
/* A sheet shows what shines on its far side, whatever else there is. */
static void demand_transmission(const struct lum_sights *see, const struct lum_effect_row *row, enum lum_effect effect,
                                struct lum_demand *d)
{
    const struct lum_snapshot *s = see->snapshot;
    for (uint32_t i = 0; i < s->n_instances && see->lit; i++)
        if (lum_material_is_sheet(&s->materials[s->instances[i].material]))
            lum_demand_call(d, effect, s->instances[i].id, row->why);
    lum_demand_by_surface(see, row, effect, d);
}

const struct lum_effect_row lum_effect_transmission = {.demand = demand_transmission,
                                                       .scatter = LUM_SCATTER_THROUGH,
                                                       .lamps_count = true,
                                                       .glow_counts = true,
                                                       .why = "lets light through",
                                                       .why_not = "no object lets light through",
                                                       .usual = &lum_estimator_specular,
                                                       .adds = LUM_ADDS_SURFACE};
