#include "core/effect/area_shadow/area_window.h"

#include <stdlib.h>
#include <string.h>

#include "core/pass/components.h"
#include "core/light/irradiance.h"

#define BORDER LUM_WINDOW_BORDER
#define WINDOW LUM_WINDOW_SIDE
#define BLOCK LUM_WINDOW_BLOCK
#define MIDDLE (WINDOW * WINDOW / 2)

/* A pixel that knows all strata of its own takes the mean of those in its window that do, too, and say about the same:
 * their weight falls to 0 where shares differ by ALIKE deviations of a single sample, and by what CHANCE makes of a few
 * samples near 0 and 1. 16 stratified samples are off by 0.08 of a deviation at an edge, by 0.25 where many things are
 * in the way. Thin shadows ask for little, wide penumbrae for much: where all strata are known, relMSE of direct light
 * for ALIKE 0.6 with CHANCE 0, 0.15 and 0.22, and for 0.9 with 0.15, is 2.0e-3, 2.3e-3, 2.5e-3 and 3.4e-3 under a grid
 * of bars and 2.6e-3, 2.2e-3, 2.5e-3 and 2.7e-3 in shirley6, where grain shows below 0.2. */
#define ALIKE 0.6f
#define CHANCE 0.2f
#define FAR 1e3f /* as a share: from any other */

void lum_area_window_init(struct lum_area_window *w, const struct lum_pass *pass, uint32_t tile)
{
    w->pass = pass;
    w->guide = lum_components_guide(pass);
    w->r = lum_tile_at(&pass->tiling, tile);
    memset(w->from_x, 0xff, sizeof w->from_x); /* LUM_NOWHERE, where the border of the picture cuts the tile */
    memset(w->from_y, 0xff, sizeof w->from_y);
    lum_pattern_positions(w->r.x, w->r.w, BORDER, LUM_AREA_SIDE, w->guide.w, w->from_x);
    lum_pattern_positions(w->r.y, w->r.h, BORDER, LUM_AREA_SIDE, w->guide.h, w->from_y);
    w->surfaces_known = false;
    memset(w->same_known, 0, sizeof w->same_known);
}

/* ---- the samples of a pixel ---- */

struct lum_rgb lum_area_arriving(const struct lum_pass *pass, size_t pixel, const struct lum_light_sample *ls)
{
    if (!pass->on[LUM_EFFECT_MEDIA])
        return ls->radiance;
    return lum_rgb_mul(ls->radiance,
                       lum_media_transmittance(pass->snapshot, pass->surfaces->p[pixel], ls->wi, ls->distance));
}

/* What decides the visible share of a light that is known in closed form. */
static struct lum_moments sum_shares(const struct lum_area_view *view)
{
    const struct lum_surfaces *s = view->pass->surfaces;
    size_t pixel = view->pixel;
    struct lum_visibility visibility = view->layer->area.visibility[pixel];
    bool through = (s->kind[pixel] & LUM_PIXEL_GLOSS) && (s->kind[pixel] & LUM_PIXEL_SPECULAR); /* rough glass */
    struct lum_moments m = {0};
    float weight[LUM_AREA_POINTS];
    if (!visibility.traced)
        return m;
    lum_area_weights(view, visibility.traced, weight);
    for (uint32_t left = visibility.traced; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left);
        float f = through ? fabsf(weight[k]) : lum_max(weight[k], 0.0f);
        m.traced += f;
        m.visibility += visibility.visible >> k & 1 ? f : 0.0f;
    }
    return m;
}

static struct lum_moments sum_samples(const struct lum_area_window *w, size_t pixel)
{
    struct lum_area_view view;
    lum_area_look(w->pass, w->layer, pixel, &view);
    if (!view.wanted)
        return (struct lum_moments){0}; /* nobody asked what light it gets: it must not count as unlit */
    if (w->n_moments == 2)
        return sum_shares(&view);
    struct lum_visibility visibility = w->layer->area.visibility[pixel];
    struct lum_moments m = {.n = (float)__builtin_popcount(visibility.traced | visibility.visible)};
    for (uint32_t left = visibility.traced; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left);
        struct lum_light_sample ls;
        if (lum_area_sample(&view, k, &ls) == LUM_AREA_NEEDLESS)
            continue;
        float cosine = fabsf(lum_dot(ls.wi, w->pass->surfaces->n[pixel]));
        float f = cosine / ls.pdf_sa;
        m.traced += f;
        if (!(visibility.visible >> k & 1))
            continue;
        m.visibility += f;
        m.cosine += f * cosine;
        m.light = lum_rgb_mad(m.light, lum_area_arriving(w->pass, pixel, &ls), f);
    }
    return m;
}

/* ---- the tile and its border ---- */

/* The pixel at (x, y) of the block. */
static bool pixel_of(const struct lum_area_window *w, uint32_t x, uint32_t y, size_t *ret_pixel)
{
    *ret_pixel = (size_t)w->from_y[y] * w->guide.w + w->from_x[x];
    return w->from_x[x] != LUM_NOWHERE && w->from_y[y] != LUM_NOWHERE;
}

/* What is not there has no normal, and so fails every test. */
static void load_surfaces(struct lum_area_window *w)
{
    const struct lum_guide *g = &w->guide;
    for (uint32_t i = 0, y = 0; y < BLOCK; y++)
        for (uint32_t x = 0; x < BLOCK; x++, i++) {
            size_t at;
            bool there = pixel_of(w, x, y, &at);
            struct lum_vec3 p = there ? g->p[at] : lum_v3(0.0f, 0.0f, 0.0f);
            struct lum_vec3 n = there ? g->n[at] : lum_v3(0.0f, 0.0f, 0.0f);
            w->px[i] = p.x, w->py[i] = p.y, w->pz[i] = p.z;
            w->nx[i] = n.x, w->ny[i] = n.y, w->nz[i] = n.z;
            w->limit[i] = there ? lum_guide_limit(g, at) : 0.0f;
        }
    w->surfaces_known = true;
}

/* Where a row of the tile begins in the block, and where its neighbours j do. */
static size_t row_at(uint32_t y, uint32_t j)
{
    return (size_t)(y + j / WINDOW) * BLOCK + j % WINDOW;
}

/* Sets bit j of those pixels of a row whose neighbour j is on the same surface: as lum_guide_same_surface. Here and
 * below no choice is written as one, or it would become a branch, and the loop would not be vectorised. */
static void test_neighbour(const struct lum_area_window *w, uint32_t y, uint32_t j, uint32_t *restrict inout_same)
{
    size_t a = row_at(y, MIDDLE), b = row_at(y, j);
    for (size_t i = 0; i < LUM_TILE_SIDE; i++) {
        float nx = w->nx[a + i], ny = w->ny[a + i], nz = w->nz[a + i];
        float mx = w->nx[b + i], my = w->ny[b + i], mz = w->nz[b + i];
        float cosine = nx * mx + ny * my + nz * mz;
        float off = (nx + mx) * (w->px[b + i] - w->px[a + i]) + (ny + my) * (w->py[b + i] - w->py[a + i]) +
                    (nz + mz) * (w->pz[b + i] - w->pz[a + i]);
        uint32_t alike = cosine > LUM_SAME_COS, near = fabsf(off) <= w->limit[a + i] + w->limit[b + i];
        inout_same[i] |= (alike & near) << j;
    }
}

static void find_same(struct lum_area_window *w, uint32_t y)
{
    uint32_t *same = w->same + y * LUM_TILE_SIDE;
    if (w->same_known[y])
        return;
    if (!w->surfaces_known)
        load_surfaces(w);
    for (uint32_t i = 0; i < LUM_TILE_SIDE; i++)
        same[i] = 1u << MIDDLE;
    for (uint32_t j = 0; j < WINDOW * WINDOW; j++)
        test_neighbour(w, y, j, same);
    w->same_known[y] = true;
}

/* ---- windows ---- */

/* Which pixels of the block are in the window of any of these. */
static void find_needed(const uint32_t pixels[LUM_TILE_SIDE], uint32_t ret_needed[BLOCK])
{
    memset(ret_needed, 0, BLOCK * sizeof *ret_needed);
    for (uint32_t y = 0; y < LUM_TILE_SIDE; y++) {
        uint32_t row = 0;
        for (uint32_t k = 0; k < WINDOW; k++)
            row |= pixels[y] << k;
        for (uint32_t k = 0; k < WINDOW; k++)
            ret_needed[y + k] |= row;
    }
}
_Static_assert(BLOCK <= 32, "a row of the block is a word of bits");

static void load_moments(struct lum_area_window *w, const uint32_t pixels[LUM_TILE_SIDE])
{
    uint32_t needed[BLOCK];
    find_needed(pixels, needed);
    memset(w->moments, 0, w->n_moments * sizeof w->moments[0]);
    for (uint32_t i = 0; i < BLOCK * BLOCK; i++)
        w->whole_ratio[i] = FAR;
    for (uint32_t y = 0; y < BLOCK; y++)
        for (uint32_t left = needed[y]; left; left &= left - 1) {
            uint32_t x = (uint32_t)__builtin_ctz(left), i = y * BLOCK + x;
            size_t pixel;
            if (!pixel_of(w, x, y, &pixel))
                continue;
            struct lum_moments m = sum_samples(w, pixel);
            float all[LUM_MOMENTS] = {m.traced, m.visibility, m.n, m.cosine, m.light.r, m.light.g, m.light.b};
            for (uint32_t k = 0; k < w->n_moments; k++)
                w->moments[k][i] = all[k];
            if (lum_visibility_whole(w->layer->area.visibility[pixel]))
                w->whole_ratio[i] = lum_moments_share(&m);
        }
}

/* 1 or 0. */
static float bit_of(uint32_t bits, uint32_t j)
{
    return (float)(int32_t)(bits >> j & 1u);
}

/* Adds to the sums of moment k of a row of pixels what they have in common with row dy of their windows, by
 * the weights of its ends and of the rest. */
static void add_window_row(const struct lum_area_window *w, uint32_t k, uint32_t y, uint32_t dy, const float weight[2],
                           float *restrict inout_sum)
{
    const uint32_t *restrict same = w->same + y * LUM_TILE_SIDE;
    const float *restrict value = w->moments[k] + row_at(y, dy * WINDOW);
    float ends = weight[0], rest = weight[1];
    for (uint32_t i = 0; i < LUM_TILE_SIDE; i++) {
        uint32_t bits = same[i] >> dy * WINDOW;
        float sum = inout_sum[i];
        sum += value[i] * ends * bit_of(bits, 0);
        sum += value[i + 1] * rest * bit_of(bits, 1);
        sum += value[i + 2] * rest * bit_of(bits, 2);
        sum += value[i + 3] * rest * bit_of(bits, 3);
        sum += value[i + 4] * ends * bit_of(bits, 4);
        inout_sum[i] = sum;
    }
}
_Static_assert(WINDOW == 5, "a row of it is five neighbours");

static void sum_row(struct lum_area_window *w, uint32_t y)
{
    static const float outer[2] = {0.25f, 0.5f}, middle[2] = {0.5f, 1.0f};
    for (uint32_t k = 0; k < w->n_moments; k++) {
        float sum[LUM_TILE_SIDE] = {0};
        for (uint32_t dy = 0; dy < WINDOW; dy++)
            add_window_row(w, k, y, dy, dy % (WINDOW - 1) == 0 ? outer : middle, sum);
        memcpy(w->sum[k] + y * LUM_TILE_SIDE, sum, sizeof sum);
    }
}

/* ---- what is alike ---- */

static struct lum_moments moments_of(const float *first, uint32_t n)
{
    float m[LUM_MOMENTS] = {0};
    for (uint32_t k = 0; k < n; k++)
        m[k] = first[k * LUM_TILE_PIXELS];
    return (struct lum_moments){m[0], m[1], m[2], m[3], lum_rgb(m[4], m[5], m[6])};
}

/* How much neighbour j counts for the pixels of a row: what is alike and near counts most. per_share: 1 over the
 * difference at which nothing is left of it. */
static void weigh_neighbour(const struct lum_area_window *w, uint32_t y, uint32_t j, const float *restrict per_share,
                            float *restrict ret_weight)
{
    static const float by_distance[] = {1.0f, 0.7788f, 0.3679f}; /* exp -d^2 / 4 */
    int dx = (int)(j % WINDOW) - (int)BORDER, dy = (int)(j / WINDOW) - (int)BORDER;
    const float *own = w->whole_ratio + row_at(y, MIDDLE), *other = w->whole_ratio + row_at(y, j);
    const uint32_t *same = w->same + y * LUM_TILE_SIDE;
    float near = by_distance[abs(dx)] * by_distance[abs(dy)];
    for (uint32_t i = 0; i < LUM_TILE_SIDE; i++) {
        float d = (other[i] - own[i]) * per_share[i], alike = lum_max(1.0f - d * d, 0.0f);
        ret_weight[i] = alike * alike * near * bit_of(same[i], j);
    }
}

static void sum_alike_row(struct lum_area_window *w, uint32_t y)
{
    float per_share[LUM_TILE_SIDE], weight[LUM_TILE_SIDE], sum[LUM_MOMENTS][LUM_TILE_SIDE] = {0};
    for (uint32_t i = 0; i < LUM_TILE_SIDE; i++) {
        struct lum_moments m = moments_of(&w->sum[0][y * LUM_TILE_SIDE + i], 2);
        float ratio = lum_moments_share(&m), variance = lum_max(ratio * (1.0f - ratio), 0.0f);
        per_share[i] = 1.0f / sqrtf(ALIKE * ALIKE * variance + CHANCE * CHANCE);
    }
    for (uint32_t j = 0; j < WINDOW * WINDOW; j++) {
        weigh_neighbour(w, y, j, per_share, weight);
        for (uint32_t k = 0; k < w->n_moments; k++) {
            const float *value = w->moments[k] + row_at(y, j);
            for (uint32_t i = 0; i < LUM_TILE_SIDE; i++)
                sum[k][i] += weight[i] * value[i];
        }
    }
    for (uint32_t k = 0; k < w->n_moments; k++)
        memcpy(w->alike[k] + y * LUM_TILE_SIDE, sum[k], sizeof sum[k]);
}

/* True when any of these pixels of the row knows all strata. */
static bool any_whole(const struct lum_area_window *w, uint32_t y, uint32_t pixels)
{
    for (uint32_t left = pixels; left; left &= left - 1)
        if (w->whole_ratio[row_at(y, MIDDLE) + (uint32_t)__builtin_ctz(left)] != FAR)
            return true;
    return false;
}

void lum_area_window_gather(struct lum_area_window *w, const struct lum_layer *layer,
                            const uint32_t pixels[LUM_TILE_SIDE])
{
    uint32_t any = 0;
    for (uint32_t y = 0; y < LUM_TILE_SIDE; y++)
        any |= pixels[y];
    w->layer = layer;
    w->n_moments = lum_light_has_irradiance(&w->pass->layers->unit.lights.lights[layer->index]) ? 2 : LUM_MOMENTS;
    if (!any)
        return;
    load_moments(w, pixels);
    for (uint32_t y = 0; y < LUM_TILE_SIDE; y++) {
        if (!pixels[y])
            continue;
        find_same(w, y);
        sum_row(w, y);
        if (any_whole(w, y, pixels[y]))
            sum_alike_row(w, y);
    }
}

struct lum_moments lum_area_window_at(const struct lum_area_window *w, uint32_t x, uint32_t y)
{
    bool whole = w->whole_ratio[row_at(y, MIDDLE) + x] != FAR;
    return moments_of(&(whole ? w->alike : w->sum)[0][y * LUM_TILE_SIDE + x], w->n_moments);
}
