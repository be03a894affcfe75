/* What glossy surfaces, mirrors and glass show becomes smooth by the filter of its interleaved samples; what paths of
 * gloss brought home by a wider one, too.
 *
 * One path says little of what a rough lobe shows, and neighbours on a surface show about the same: from a step of x on
 * the surface the lobe, about alpha wide, lights what is at a distance t as if it had turned by x / t. So a pixel takes
 * the light of those around that are nearer than REACH alpha t, and whose normals differ by less than REACH alpha: in
 * crytek_sponza, most of whose gloss is of cloth and stone, that ends a mottle. Who takes of whom hangs on where things
 * are and not on light: a dimmed lamp is another sum all the same. */
#include "core/effect/gloss/gloss.h"

#include <math.h>
#include <string.h>

/* SMAPE of first frames (mean of two draws, 300 x 200) with one window, with 0.5, 1 and 2: crytek_sponza .201, .172,
 * .169, .168, conference_mcguire .076, .071, .070, .070, desk .064, .063, .062, .062. With 2 floors reflect a blur. */
#define REACH 1.0f
/* Windows TAP apart, the side of live's pattern, so many each way. With 2 it is .172, .070, .062, and mottle is left.
 */
#define TAPS 3
#define TAP 4
#define REACH_MAX ((float)(TAPS * TAP))

static struct lum_filter filter_of(const struct lum_pass *pass, const struct lum_guide *guide, uint8_t need,
                                   const struct lum_rgb *in)
{
    return (struct lum_filter){
        .guide = guide, .need = need, .side = pass->settings->method->pattern, .apart = 1, .step = 1, .in = in};
}

/* A window of the pattern: light, and how far a pixel may look for more of it. */
static void average_paths(const struct lum_pass *pass, const struct lum_guide *guide, const struct lum_tile_rect *r)
{
    const struct lum_gloss_pixels *pixels = &((struct lum_gloss *)lum_pass_state(pass, &lum_gloss_kind))->pixels;
    struct lum_filter_rect rect = {r->x, r->y, r->w, r->h};
    struct lum_filter of_light = filter_of(pass, guide, LUM_PIXEL_GLOSS, pixels->light);
    struct lum_filter of_hits = filter_of(pass, guide, LUM_PIXEL_GLOSS, pixels->hit);
    struct lum_rgb hits[LUM_CELL_SIDE * LUM_CELL_SIDE];
    lum_filter_box(&of_light, &rect, pixels->mean + (size_t)r->y * guide->w + r->x, guide->w);
    lum_filter_box(&of_hits, &rect, hits, r->w);
    for (uint32_t i = 0; i < r->w * r->h; i++) {
        size_t pixel = (size_t)(r->y + i / r->w) * guide->w + r->x + i % r->w;
        struct lum_rgb hit = hits[i];
        float wide = REACH * hit.b * hit.g, footprint = guide->pixel * guide->depth[pixel] * hit.r;
        pixels->reach[pixel] = wide < REACH_MAX * footprint ? wide / footprint : REACH_MAX;
    }
}

static void average_raw(const struct lum_pass *pass, const struct lum_guide *guide, const struct lum_tile_rect *r)
{
    const struct lum_component_buffer *gloss = &pass->components->buffer[LUM_EFFECT_GLOSSY];
    const uint8_t kinds = LUM_PIXEL_SPECULAR | (pass->on[LUM_EFFECT_GLOSSY] ? LUM_PIXEL_GLOSS : 0);
    struct lum_filter f = filter_of(pass, guide, kinds, gloss->raw);
    lum_filter_box(&f, &(struct lum_filter_rect){r->x, r->y, r->w, r->h},
                   gloss->smooth + (size_t)r->y * guide->w + r->x, guide->w);
}

static void gloss_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)counters;
    const struct lum_component_buffer *gloss = &pass->components->buffer[LUM_EFFECT_GLOSSY];
    if (!gloss->raw || lum_components_enter_filter(pass, LUM_EFFECT_GLOSSY, cell))
        return;
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    bool paths = lum_pass_state(pass, &lum_gloss_kind);
    if (paths)
        average_paths(pass, &guide, &r);
    if (!paths || pass->on[LUM_EFFECT_REFLECTION] || pass->on[LUM_EFFECT_TRANSMISSION])
        average_raw(pass, &guide, &r);
    else /* nobody adds to it */
        for (uint32_t y = r.y; y < r.y + r.h; y++)
            memset(gloss->smooth + (size_t)y * guide.w + r.x, 0, r.w * sizeof *gloss->smooth);
}

/* Mean of the windows around a pixel, by tents as wide as its reach. */
static struct lum_rgb widen(const struct lum_gloss_pixels *pixels, const struct lum_guide *guide, int32_t x, int32_t y)
{
    size_t at = (size_t)y * guide->w + (size_t)x;
    float reach = pixels->reach[at], bend = REACH * pixels->hit[at].b, weight = 1.0f;
    int32_t taps = (int32_t)ceilf(reach / TAP);
    struct lum_rgb sum = pixels->mean[at];
    for (int32_t j = -taps; j <= taps; j++)
        for (int32_t i = -taps; i <= taps; i++) {
            int32_t qx = x + TAP * i, qy = y + TAP * j;
            if ((i == 0 && j == 0) || qx < 0 || qy < 0 || qx >= (int32_t)guide->w || qy >= (int32_t)guide->h)
                continue;
            size_t q = (size_t)qy * guide->w + (size_t)qx;
            struct lum_vec3 turn = lum_v3_sub(guide->n[q], guide->n[at]);
            if (!(guide->kind[q] & LUM_PIXEL_GLOSS) || lum_dot(turn, turn) > bend * bend ||
                !lum_guide_same_surface(guide, at, q))
                continue;
            float per = TAP / (reach + TAP);
            float w = (1.0f - fabsf((float)i) * per) * (1.0f - fabsf((float)j) * per);
            sum = lum_rgb_mad(sum, pixels->mean[q], w);
            weight += w;
        }
    return lum_rgb_scale(sum, 1.0f / weight);
}

static void wide_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)counters;
    const struct lum_gloss *gloss = lum_pass_state(pass, &lum_gloss_kind);
    struct lum_components *c = pass->components;
    if (!gloss || !c->buffer[LUM_EFFECT_GLOSSY].raw || !lum_memo_advance(&c->filtered[LUM_EFFECT_GLOSSY], cell, 1))
        return;
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    struct lum_rgb light[LUM_CELL_SIDE * LUM_CELL_SIDE] = {{0}};
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        uint32_t x = r.x + i % r.w, y = r.y + i / r.w;
        size_t pixel = (size_t)y * guide.w + x;
        if (guide.kind[pixel] & LUM_PIXEL_GLOSS)
            light[i] = lum_rgb_mul(widen(&gloss->pixels, &guide, (int32_t)x, (int32_t)y), gloss->pixels.albedo[pixel]);
    }
    lum_gloss_give_back(gloss, pass, &r, light);
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        struct lum_rgb *smooth =
            &c->buffer[LUM_EFFECT_GLOSSY].smooth[(size_t)(r.y + i / r.w) * guide.w + r.x + i % r.w];
        *smooth = lum_rgb_add(*smooth, light[i]);
    }
}

const struct lum_estimator lum_stage_gloss = {
    .name = "gloss", .stage = LUM_STAGE_FILTER, .tile = gloss_cell, .cells = true};
const struct lum_estimator lum_stage_gloss_wide = {
    .name = "gloss_wide", .stage = LUM_STAGE_FILTER, .tile = wide_cell, .cells = true};
