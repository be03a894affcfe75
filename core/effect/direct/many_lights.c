#include "core/effect/direct/many_lights.h"

#include <string.h>

#include "core/effect/direct/layers.h"
#include "core/math/sampler.h"

#define BLOCKS_ACROSS (LUM_TILE_SIDE / LUM_MOTION_BLOCK_SIDE)
_Static_assert(BLOCKS_ACROSS *BLOCKS_ACROSS <= 32, "blocks of a tile by bit");

static bool reserve_pixels(struct lum_many_lights *c, const struct lum_pass *pass)
{
    size_t n = (size_t)pass->tiling.w * pass->tiling.h;
    if (c->cut)
        return true;
    bool whole = true;
    for (uint32_t part = 0; part < LUM_MANY_LIGHTS_PARTS; part++)
        for (uint32_t k = 0; k < LUM_MANY_LIGHTS_WINDOWS; k++)
            whole = (c->sum[part][k] = lum_calloc(n, sizeof *c->sum[part][k])) && whole;
    whole = lum_memo_reserve(&c->summed, pass->tiling.n) && lum_memo_reserve(&c->joined, pass->cells.n) && whole;
    c->cut = lum_calloc(pass->tiling.n, 1);
    if (!whole || !c->cut)
        return false;
    memset(c->cut, LUM_CUT_FORGOTTEN, pass->tiling.n);
    return true;
}

static bool reserve_lights(struct lum_many_lights *c, const struct lum_pass *pass)
{
    uint32_t n = pass->snapshot->lights.n_lights;
    if (c->lights && n == c->n_lights)
        return true;
    size_t bytes = (size_t)pass->tiling.n * n * LUM_MANY_LIGHTS_TILE_BYTES;
    lum_free(c->lights);
    lum_free(c->visibility);
    c->lights = lum_calloc(n, sizeof *c->lights);
    c->visibility = bytes <= LUM_MANY_LIGHTS_BYTES ? lum_calloc(bytes, 1) : NULL;
    c->n_lights = n;
    c->moved = true;
    lum_many_lights_relight(c);
    memset(c->cut, LUM_CUT_FORGOTTEN, pass->tiling.n);
    return c->lights && (c->visibility || bytes > LUM_MANY_LIGHTS_BYTES);
}

static void open_cuts(struct lum_many_lights *c, const struct lum_pass *pass)
{
    for (uint32_t t = 0; t < pass->tiling.n; t++)
        if (c->cut[t] != LUM_CUT_FORGOTTEN)
            c->cut[t] = LUM_CUT_OPEN;
}

/* All is planned as by a view that is new; what is known of who sees which light stays. */
static void plan_anew(struct lum_many_lights *c, const struct lum_pass *pass)
{
    for (uint32_t i = 0; i < c->n_lights; i++)
        c->lights[i].reference = 0.0f;
    open_cuts(c, pass);
}

/* Of lights that moved nothing is known. */
static void follow_lights(struct lum_many_lights *c, const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    bool moved = false;
    for (uint32_t i = 0; i < lights->n_lights; i++) {
        const struct lum_light *l = &lights->lights[i], *own = &c->lights[i].light;
        if (strcmp(own->id, l->id) == 0 && lum_light_same_shape(own, l))
            continue;
        moved = true;
        for (uint32_t t = 0; c->visibility && t < pass->tiling.n; t++)
            if (c->cut[t] != LUM_CUT_FORGOTTEN)
                memset(lum_many_lights_bits(c, t, i), 0, LUM_MANY_LIGHTS_TILE_BYTES);
        c->lights[i].light = *l;
    }
    if (moved)
        plan_anew(c, pass);
    c->moved = false;
}

/* A light that first shines, or far brighter than it was planned for, is planned by the power that it has. */
static void plan_lights(struct lum_many_lights *c, const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    bool brighter = false;
    for (uint32_t i = 0; i < lights->n_lights; i++) {
        const struct lum_light *l = &lights->lights[i];
        struct lum_sampled_light *own = &c->lights[i];
        struct lum_bounds b;
        own->salt = lum_hash_text(l->id);
        own->p = l->p;
        own->radius = lum_length(l->u) + lum_length(l->v) + l->radius; /* what a shape has not is 0 */
        if (l->kind == &lum_emitter_mesh && lum_light_bounds(pass->snapshot, l, &b)) {
            own->p = lum_v3_mul(lum_v3_add(b.lo, b.hi), 0.5f);
            own->radius = 0.5f * lum_length(lum_v3_sub(b.hi, b.lo));
        }
        float luminance = l->on ? lum_luminance(l->power) : 0.0f;
        if (lum_layers_in_many_lights(pass->layers, i) && luminance > LUM_MANY_LIGHTS_BRIGHTER * own->reference) {
            own->reference = luminance;
            brighter = true;
        }
    }
    if (brighter)
        open_cuts(c, pass);
}

bool lum_many_lights_reserve(struct lum_many_lights *c, const struct lum_pass *pass)
{
    if (!reserve_pixels(c, pass) || !reserve_lights(c, pass)) {
        lum_many_lights_finish(c);
        return false;
    }
    if (c->moved)
        follow_lights(c, pass);
    plan_lights(c, pass);
    return true;
}

void lum_many_lights_finish(struct lum_many_lights *c)
{
    for (uint32_t part = 0; part < LUM_MANY_LIGHTS_PARTS; part++)
        for (uint32_t k = 0; k < LUM_MANY_LIGHTS_WINDOWS; k++)
            lum_free(c->sum[part][k]);
    lum_memo_finish(&c->summed);
    lum_memo_finish(&c->joined);
    lum_free(c->cut);
    lum_free(c->lights);
    lum_free(c->visibility);
    *c = (struct lum_many_lights){0};
}

void lum_many_lights_relight(struct lum_many_lights *c)
{
    if (!c->cut)
        return;
    lum_memo_forget(&c->summed);
    lum_memo_forget(&c->joined);
    for (uint32_t k = 0; k < LUM_MANY_LIGHTS_WINDOWS; k++)
        c->used[k] = false;
}

void lum_many_lights_forget(struct lum_many_lights *c, const struct lum_pass *pass)
{
    lum_many_lights_relight(c);
    if (c->cut)
        memset(c->cut, LUM_CUT_FORGOTTEN, pass->tiling.n);
    if (c->lights)
        memset(c->lights, 0, c->n_lights * sizeof *c->lights);
    c->moved = true;
}

void lum_many_lights_reshade(struct lum_many_lights *c, const struct lum_pass *pass)
{
    lum_many_lights_relight(c);
    if (c->cut && c->lights)
        plan_anew(c, pass);
}

/* ---- what moves ---- */

static bool any_bit(const uint8_t *bits)
{
    for (uint32_t k = 0; k < LUM_MANY_LIGHTS_TILE_BYTES; k++)
        if (bits[k])
            return true;
    return false;
}

/* Of the blocks of a tile, one by bit, forgets the light's bits. */
static void forget_blocks(uint8_t *bits, const struct lum_tile_rect *r, uint32_t blocks)
{
    for (; blocks; blocks &= blocks - 1) {
        uint32_t block = (uint32_t)__builtin_ctz(blocks);
        uint32_t x0 = block % BLOCKS_ACROSS * LUM_MOTION_BLOCK_SIDE, x1 = x0 + LUM_MOTION_BLOCK_SIDE;
        uint32_t y0 = block / BLOCKS_ACROSS * LUM_MOTION_BLOCK_SIDE, y1 = y0 + LUM_MOTION_BLOCK_SIDE;
        for (uint32_t y = y0; y < y1 && y < r->h; y++)
            for (uint32_t x = x0; x < x1 && x < r->w; x++)
                bits[(y * r->w + x) / 4] &= (uint8_t) ~(3u << 2 * ((y * r->w + x) % 4));
    }
}

/* What the eye saw in a tile, by block. */
struct tile_visibility {
    struct lum_tile_rect r;
    uint32_t changed, lit; /* blocks by bit: they show something else; surfaces were there */
    struct lum_bounds visibility[BLOCKS_ACROSS * BLOCKS_ACROSS], all;
};

static struct tile_visibility look_at(const struct lum_pass *pass, uint32_t tile)
{
    const struct lum_motion_mask *motion_mask = pass->motion_mask;
    struct tile_visibility t = {.r = lum_tile_at(&pass->tiling, tile), .all = LUM_BOUNDS_EMPTY};
    uint32_t nx = motion_mask->blocks.nx, first = t.r.y / LUM_MOTION_BLOCK_SIDE * nx + t.r.x / LUM_MOTION_BLOCK_SIDE;
    for (uint32_t k = 0; k < BLOCKS_ACROSS * BLOCKS_ACROSS; k++) {
        uint32_t x = k % BLOCKS_ACROSS, y = k / BLOCKS_ACROSS;
        if (x * LUM_MOTION_BLOCK_SIDE >= t.r.w || y * LUM_MOTION_BLOCK_SIDE >= t.r.h)
            continue;
        t.visibility[k] = motion_mask->seen[first + y * nx + x];
        t.changed |= (uint32_t)(motion_mask->changed[first + y * nx + x] != LUM_MOTION_SAME) << k;
        t.lit |= (uint32_t)!lum_bounds_empty(&t.visibility[k]) << k;
        t.all = lum_bounds_join(&t.all, &t.visibility[k]);
    }
    return t;
}

/* Blocks in which the light may be seen otherwise. */
static uint32_t doubted(const struct tile_visibility *t, const struct lum_motion *motion,
                        const struct lum_bounds *light)
{
    uint32_t blocks = t->changed;
    if (t->lit == 0 || !lum_motion_meets_between(motion, &t->all, light))
        return blocks;
    for (uint32_t left = t->lit & ~blocks; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left);
        blocks |= (uint32_t)lum_motion_meets_between(motion, &t->visibility[k], light) << k;
    }
    return blocks;
}

void lum_many_lights_follow_motion(struct lum_many_lights *c, const struct lum_pass *pass)
{
    if (!c->visibility || !c->lights) {
        lum_many_lights_forget(c, pass);
        return;
    }
    lum_many_lights_reshade(c, pass);
    for (uint32_t tile = 0; tile < pass->tiling.n; tile++) {
        if (c->cut[tile] == LUM_CUT_FORGOTTEN)
            continue;
        struct tile_visibility t = look_at(pass, tile);
        for (uint32_t i = 0; i < c->n_lights; i++) {
            uint8_t *bits = lum_many_lights_bits(c, tile, i);
            struct lum_bounds box;
            if (!any_bit(bits))
                continue;
            bool still = lum_motion_mask_light(pass->motion_mask, &c->lights[i].light, &box);
            forget_blocks(bits, &t.r, still ? doubted(&t, &pass->motion_mask->motion, &box) : UINT32_MAX);
        }
    }
}

void lum_many_lights_add(const struct lum_pass *pass, uint32_t tile, uint32_t n_pixels, struct lum_rgb *inout_radiance)
{
    const struct lum_many_lights *c = &pass->layers->many_lights;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    for (uint32_t i = 0; i < n_pixels; i++) {
        size_t pixel = (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w;
        struct lum_rgb diffuse = c->sum[LUM_MANY_LIGHTS_DIFFUSE][LUM_MANY_LIGHTS_WINDOWS - 1][pixel];
        struct lum_rgb gloss = c->sum[LUM_MANY_LIGHTS_GLOSS][LUM_MANY_LIGHTS_WINDOWS - 1][pixel];
        inout_radiance[i] = lum_rgb_add(inout_radiance[i], lum_rgb_mul(pass->surfaces->albedo[pixel], diffuse));
        inout_radiance[i] = lum_rgb_add(inout_radiance[i], gloss);
    }
}
