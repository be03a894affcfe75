/* What pixels of the windows of many lights have in common: filters from the widest window to the narrowest, each of
 * which adds what it makes to the samples of the next. On one surface they are together what each of them has to be, a
 * filter under which all places of its window count alike: a tent over places 8 pixels apart makes of a window of 16
 * one of 8, one over places 4 pixels apart makes of that a window of 4, and the box filter of 4 x 4 does the rest. */
#include "core/pass/components.h"
#include "core/effect/many_lights/many_lights_stages.h"
#include "core/effect/direct/layers.h"
#include "core/effect/direct/area_visibility.h"
#include "core/interleave/interleave.h"

static const uint8_t needs[LUM_MANY_LIGHTS_PARTS] = {LUM_PIXEL_DIFFUSE, LUM_PIXEL_GLOSS};

static bool any_of(const struct lum_pass *pass, const struct lum_tile_rect *r, uint8_t kinds)
{
    for (uint32_t y = r->y; y < r->y + r->h; y++)
        for (uint32_t x = r->x; x < r->x + r->w; x++)
            if (pass->surfaces->kind[(size_t)y * pass->tiling.w + x] & kinds)
                return true;
    return false;
}

/* The sums of a window, filtered by a pattern whose places lie so far apart, are added to those of window `to`, or
 * become them. */
static void pass_on(const struct lum_pass *pass, uint32_t cell, const struct lum_filter *pattern, uint32_t from,
                    uint32_t to, bool add)
{
    struct lum_rgb filtered[LUM_CELL_SIDE * LUM_CELL_SIDE];
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    struct lum_many_lights *c = &pass->layers->many_lights;
    if (add && !c->used[from])
        return;
    for (int part = 0; part < LUM_MANY_LIGHTS_PARTS; part++) {
        struct lum_filter f = *pattern;
        f.guide = &guide, f.need = needs[part], f.step = 1, f.in = c->sum[part][from];
        bool any = any_of(pass, &r, f.need);
        if (any)
            lum_filter_box(&f, &(struct lum_filter_rect){r.x, r.y, r.w, r.h}, filtered, r.w);
        for (uint32_t i = 0; i < r.w * r.h; i++) {
            size_t pixel = (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w;
            struct lum_rgb *out = &c->sum[part][to][pixel], value = any ? filtered[i] : lum_grey(0.0f);
            *out = add ? lum_rgb_add(*out, value) : value;
        }
    }
    if (add)
        c->used[to] = true;
}

static bool enter(const struct lum_pass *pass, uint32_t cell, uint32_t step)
{
    struct lum_many_lights *c = &pass->layers->many_lights;
    return c->on && lum_memo_advance(&c->joined, cell, step);
}

static void widen_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)counters;
    if (enter(pass, cell, 0))
        pass_on(pass, cell, &(struct lum_filter){.side = 2, .apart = 2 * LUM_AREA_SIDE}, 2, 1, true);
}

static void narrow_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)counters;
    if (enter(pass, cell, 1))
        pass_on(pass, cell, &(struct lum_filter){.side = 2, .apart = LUM_AREA_SIDE}, 1, 0, true);
}

static void join_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)counters;
    if (enter(pass, cell, 2))
        pass_on(pass, cell, &(struct lum_filter){.side = LUM_AREA_SIDE, .apart = 1}, 0, LUM_MANY_LIGHTS_WINDOWS - 1,
                false);
}

static const struct lum_estimator join = {
    .name = "many lights, join", .stage = LUM_STAGE_FILTER, .tile = join_cell, .cells = true, .surfaces = true};
static const struct lum_estimator narrow = {.name = "many lights, 8 to 4",
                                            .stage = LUM_STAGE_FILTER,
                                            .tile = narrow_cell,
                                            .cells = true,
                                            .surfaces = true,
                                            .then = &join};
const struct lum_estimator lum_many_lights_widen = {.name = "many lights, 16 to 8",
                                                    .stage = LUM_STAGE_FILTER,
                                                    .tile = widen_cell,
                                                    .cells = true,
                                                    .surfaces = true,
                                                    .then = &narrow};
