#include "core/effect/direct/crowd.h"

#include <string.h>

#include "core/effect/direct/layers.h"

#define SQUARES_ACROSS (LUM_TILE_SIDE / LUM_SWEPT_SIDE)
_Static_assert(SQUARES_ACROSS *SQUARES_ACROSS <= 32, "squares of a tile by bit");

static bool reserve_pixels(struct lum_crowd *c, const struct lum_pass *pass)
{
    size_t n = (size_t)pass->tiling.w * pass->tiling.h;
    if (c->cut)
        return true;
    bool whole = true;
    for (uint32_t part = 0; part < LUM_CROWD_PARTS; part++)
        for (uint32_t k = 0; k < LUM_CROWD_WINDOWS; k++)
            whole = (c->sum[part][k] = lum_calloc(n, sizeof *c->sum[part][k])) && whole;
    c->done = lum_calloc(pass->tiling.n, 1);
    c->joined = lum_calloc(pass->packets.n, 1);
    c->cut = lum_calloc(pass->tiling.n, 1);
    if (!whole || !c->done || !c->joined || !c->cut)
        return false;
    memset(c->cut, LUM_CUT_FORGOTTEN, pass->tiling.n);
    return true;
}

static bool reserve_lights(struct lum_crowd *c, const struct lum_pass *pass)
{
    uint32_t n = pass->snapshot->lights.n_lights;
    if (c->lights && n == c->n_lights)
        return true;
    size_t bytes = (size_t)pass->tiling.n * n * LUM_CROWD_TILE_BYTES;
    lum_free(c->lights);
    lum_free(c->seen);
    c->lights = lum_calloc(n, sizeof *c->lights);
    c->seen = bytes <= LUM_CROWD_BYTES ? lum_calloc(bytes, 1) : NULL;
    c->n_lights = n;
    c->moved = true;
    lum_crowd_relight(c, pass);
    memset(c->cut, LUM_CUT_FORGOTTEN, pass->tiling.n);
    return c->lights && (c->seen || bytes > LUM_CROWD_BYTES);
}

static void open_cuts(struct lum_crowd *c, const struct lum_pass *pass)
{
    for (uint32_t t = 0; t < pass->tiling.n; t++)
        if (c->cut[t] != LUM_CUT_FORGOTTEN)
            c->cut[t] = LUM_CUT_OPEN;
}

/* All is planned as by a view that is new; what is known of who sees which light stays. */
static void plan_anew(struct lum_crowd *c, const struct lum_pass *pass)
{
    for (uint32_t i = 0; i < c->n_lights; i++)
        c->lights[i].reference = 0.0f;
    open_cuts(c, pass);
}

/* Of lights that moved nothing is known. */
static void follow_lights(struct lum_crowd *c, const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    bool moved = false;
    for (uint32_t i = 0; i < lights->n_lights; i++) {
        const struct lum_light *l = &lights->lights[i], *own = &c->lights[i].light;
        if (strcmp(own->id, l->id) == 0 && lum_light_same_shape(own, l))
            continue;
        moved = true;
        for (uint32_t t = 0; c->seen && t < pass->tiling.n; t++)
            if (c->cut[t] != LUM_CUT_FORGOTTEN)
                memset(lum_crowd_bits(c, t, i), 0, LUM_CROWD_TILE_BYTES);
        c->lights[i].light = *l;
    }
    if (moved)
        plan_anew(c, pass);
    c->moved = false;
}

/* A light that first shines, or far brighter than it was planned for, is planned by the power that it has. */
static void plan_lights(struct lum_crowd *c, const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    bool brighter = false;
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
            brighter = true;
        }
    }
    if (brighter)
        open_cuts(c, pass);
}

bool lum_crowd_reserve(struct lum_crowd *c, const struct lum_pass *pass)
{
    if (!reserve_pixels(c, pass) || !reserve_lights(c, pass)) {
        lum_crowd_finish(c);
        return false;
    }
    if (c->moved)
        follow_lights(c, pass);
    plan_lights(c, pass);
    return true;
}

void lum_crowd_finish(struct lum_crowd *c)
{
    for (uint32_t part = 0; part < LUM_CROWD_PARTS; part++)
        for (uint32_t k = 0; k < LUM_CROWD_WINDOWS; k++)
            lum_free(c->sum[part][k]);
    lum_free(c->done);
    lum_free(c->joined);
    lum_free(c->cut);
    lum_free(c->lights);
    lum_free(c->seen);
    *c = (struct lum_crowd){0};
}

void lum_crowd_relight(struct lum_crowd *c, const struct lum_pass *pass)
{
    if (!c->cut)
        return;
    memset(c->done, 0, pass->tiling.n);
    memset(c->joined, 0, pass->packets.n);
    for (uint32_t k = 0; k < LUM_CROWD_WINDOWS; k++)
        c->used[k] = false;
}

void lum_crowd_forget(struct lum_crowd *c, const struct lum_pass *pass)
{
    lum_crowd_relight(c, pass);
    if (c->cut)
        memset(c->cut, LUM_CUT_FORGOTTEN, pass->tiling.n);
    if (c->lights)
        memset(c->lights, 0, c->n_lights * sizeof *c->lights);
    c->moved = true;
}

void lum_crowd_reshade(struct lum_crowd *c, const struct lum_pass *pass)
{
    lum_crowd_relight(c, pass);
    if (c->cut && c->lights)
        plan_anew(c, pass);
}

/* ---- what moves ---- */

static bool any_bit(const uint8_t *bits)
{
    for (uint32_t k = 0; k < LUM_CROWD_TILE_BYTES; k++)
        if (bits[k])
            return true;
    return false;
}

/* Of the squares of a tile, one by bit, forgets the light's bits. */
static void forget_squares(uint8_t *bits, const struct lum_tile_rect *r, uint32_t squares)
{
    for (uint32_t slot = 0; slot < r->w * r->h; slot++) {
        uint32_t square = slot / r->w / LUM_SWEPT_SIDE * SQUARES_ACROSS + slot % r->w / LUM_SWEPT_SIDE;
        if (squares >> square & 1u)
            bits[slot / 4] &= (uint8_t) ~(3u << 2 * (slot % 4));
    }
}

/* What the eye saw in a tile, by square. */
struct tile_seen {
    struct lum_tile_rect r;
    uint32_t changed, lit; /* squares by bit: they show something else; surfaces were there */
    struct lum_bounds seen[SQUARES_ACROSS * SQUARES_ACROSS], all;
};

static struct tile_seen look_at(const struct lum_pass *pass, uint32_t tile)
{
    const struct lum_swept *swept = pass->swept;
    struct tile_seen t = {.r = lum_tile_at(&pass->tiling, tile),
                          .all = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}}};
    uint32_t nx = swept->squares.nx, first = t.r.y / LUM_SWEPT_SIDE * nx + t.r.x / LUM_SWEPT_SIDE;
    for (uint32_t k = 0; k < SQUARES_ACROSS * SQUARES_ACROSS; k++) {
        uint32_t x = k % SQUARES_ACROSS, y = k / SQUARES_ACROSS;
        if (x * LUM_SWEPT_SIDE >= t.r.w || y * LUM_SWEPT_SIDE >= t.r.h)
            continue;
        t.seen[k] = swept->seen[first + y * nx + x];
        t.changed |= (uint32_t)(swept->changed[first + y * nx + x] != LUM_SWEPT_SAME) << k;
        t.lit |= (uint32_t)(t.seen[k].lo.x <= t.seen[k].hi.x) << k;
        if (t.lit >> k & 1u) {
            lum_bounds_grow(&t.all, t.seen[k].lo);
            lum_bounds_grow(&t.all, t.seen[k].hi);
        }
    }
    return t;
}

/* Squares in which the light may be seen otherwise. */
static uint32_t doubted(const struct tile_seen *t, const struct lum_motion *motion, const struct lum_bounds *light)
{
    uint32_t squares = t->changed;
    if (t->lit == 0 || !lum_motion_meets_between(motion, &t->all, light))
        return squares;
    for (uint32_t left = t->lit & ~squares; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left);
        squares |= (uint32_t)lum_motion_meets_between(motion, &t->seen[k], light) << k;
    }
    return squares;
}

void lum_crowd_follow_motion(struct lum_crowd *c, const struct lum_pass *pass)
{
    if (!c->seen || !c->lights) {
        lum_crowd_forget(c, pass);
        return;
    }
    lum_crowd_reshade(c, pass);
    for (uint32_t tile = 0; tile < pass->tiling.n; tile++) {
        if (c->cut[tile] == LUM_CUT_FORGOTTEN)
            continue;
        struct tile_seen t = look_at(pass, tile);
        for (uint32_t i = 0; i < c->n_lights; i++) {
            uint8_t *bits = lum_crowd_bits(c, tile, i);
            struct lum_bounds box;
            if (!any_bit(bits))
                continue;
            bool still = lum_layers_still_light(pass->swept, &c->lights[i].light, &box);
            forget_squares(bits, &t.r, still ? doubted(&t, &pass->swept->motion, &box) : UINT32_MAX);
        }
    }
}

void lum_crowd_add(const struct lum_pass *pass, uint32_t tile, uint32_t n_pixels, struct lum_rgb *inout_radiance)
{
    const struct lum_crowd *c = &pass->layers->crowd;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    for (uint32_t i = 0; i < n_pixels; i++) {
        size_t pixel = (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w;
        struct lum_rgb diffuse = c->sum[LUM_CROWD_DIFFUSE][LUM_CROWD_WINDOWS - 1][pixel];
        struct lum_rgb gloss = c->sum[LUM_CROWD_GLOSS][LUM_CROWD_WINDOWS - 1][pixel];
        inout_radiance[i] = lum_rgb_add(inout_radiance[i], lum_rgb_mul(pass->surfaces->albedo[pixel], diffuse));
        inout_radiance[i] = lum_rgb_add(inout_radiance[i], gloss);
    }
}
