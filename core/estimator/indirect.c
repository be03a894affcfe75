/* Indirect diffuse light of the method `live`, from virtual point lights, at a quarter of the resolution.
 *
 * Interleaved 4 x 4: a coarse pixel gathers from one of 16 sets of VPLs, and the filter takes the other 15 from the
 * neighbours. What spoils that is not how many VPLs a pixel cannot see (listing 5.2 refines on this) but a
 * neighbourhood in which sets are missing: at an edge, behind a railing, on a leaf. So refinement goes where sets are
 * missing, which the G-buffer tells before any ray, and gathers from exactly those: every coarse pixel ends with all 16
 * sets, each from its own surface.
 *
 * Going up to full resolution, pixels on whose surface no coarse pixel lies are gathered by themselves, from all sets.
 */
#include "core/estimator/components.h"
#include "core/vpl/vpl.h"

#include <string.h>

#define SIDE 4u
#define N_SETS (SIDE * SIDE)
#define ALL_SETS 0xffffu
#define COARSE_SIDE (LUM_PACKET_SIDE / 2)
#define LONE UINT8_MAX /* iterations of a pixel that was gathered at full resolution */

/* Which pixels gather from which sets into which sums. About 15 KiB: lives on a worker's stack. */
struct gathering {
    const struct lum_pass *pass;
    struct lum_counters *counters;
    uint32_t *slots; /* n_vpls / 16, rounded up */
    struct lum_gather_points points;
    size_t target[LUM_RAY_BATCH];
    struct lum_rgb irradiance[LUM_RAY_BATCH];
};

/* The two coarse pictures in component INDIRECT: what each pixel's own set gives, and what the sets that it misses do;
 * after joining, the second holds the sum of all. And the window that each pixel takes the other sets from. */
struct coarse {
    uint32_t w, h;
    struct lum_rgb *own, *rest;
    uint64_t *windows;
};

static struct coarse coarse_of(const struct lum_pass *pass)
{
    uint32_t w = lum_filter_size(pass->tiling.w, 2), h = lum_filter_size(pass->tiling.h, 2);
    struct lum_rgb *raw = pass->components->buffer[LUM_COMPONENT_INDIRECT].raw;
    return (struct coarse){w, h, raw, raw + (size_t)w * h, pass->components->windows};
}

/* ---- what is missing ---- */

static size_t site(const struct lum_pass *pass, uint32_t i, uint32_t j)
{
    return (size_t)(2 * j) * pass->tiling.w + 2 * i;
}

/* The window of a coarse pixel: 7 x 7, weighted by a tent that reaches 0 at 4. So each set has a weight of 1 in all,
 * and is interpolated bilinearly between the pixels that use it; with a box, which is 4 wide, its steps would show as
 * blocks. Bit (dy + 3) * 7 + dx + 3 stands for the pixel at (dx, dy) from its middle. */
#define REACH 3u
#define WINDOW (2 * REACH + 1)
#define WHOLE_WINDOW ((UINT64_C(1) << WINDOW * WINDOW) - 1)
static const float tent[WINDOW] = {0.25f, 0.5f, 0.75f, 1.0f, 0.75f, 0.5f, 0.25f};
#define BLOCK (COARSE_SIDE + 2 * REACH)

/* Surfaces at the coarse pixels of a packet and around it, as structures of arrays: all pixels of a row are tested at
 * once against their neighbours at one offset. */
struct block {
    _Alignas(64) float px[BLOCK * BLOCK];
    float py[BLOCK * BLOCK], pz[BLOCK * BLOCK], nx[BLOCK * BLOCK], ny[BLOCK * BLOCK], nz[BLOCK * BLOCK];
    float limit[BLOCK * BLOCK];
};

static void load_block(const struct lum_guide *g, const struct coarse *c, uint32_t x0, uint32_t y0, struct block *b)
{
    for (uint32_t k = 0; k < BLOCK * BLOCK; k++) {
        uint32_t i = x0 + k % BLOCK - REACH, j = y0 + k / BLOCK - REACH; /* wraps around at the picture's edge */
        bool there = i < c->w && j < c->h;
        size_t at = there ? (size_t)(2 * j) * g->w + 2 * i : 0;
        there = there && g->kind[at] & LUM_PIXEL_DIFFUSE; /* others gather nothing */
        b->px[k] = there ? g->p[at].x : 0.0f;
        b->py[k] = there ? g->p[at].y : 0.0f;
        b->pz[k] = there ? g->p[at].z : 0.0f;
        b->nx[k] = there ? g->n[at].x : 0.0f; /* no normal: on no surface */
        b->ny[k] = there ? g->n[at].y : 0.0f;
        b->nz[k] = there ? g->n[at].z : 0.0f;
        b->limit[k] = there ? lum_guide_limit(g, at) : 0.0f;
    }
}

/* lum_guide_same_surface for the `n` pixels from `a` on, and those `step` behind them; sets `bit` where it holds. */
static void test_row(const struct block *b, uint32_t a, uint32_t step, uint32_t n, uint64_t bit, uint64_t *window)
{
    for (uint32_t i = 0; i < n; i++) {
        uint32_t p = a + i, q = a + i + step;
        float cosine = b->nx[p] * b->nx[q] + b->ny[p] * b->ny[q] + b->nz[p] * b->nz[q];
        float off = (b->nx[p] + b->nx[q]) * (b->px[q] - b->px[p]) + (b->ny[p] + b->ny[q]) * (b->py[q] - b->py[p]) +
                    (b->nz[p] + b->nz[q]) * (b->pz[q] - b->pz[p]);
        uint32_t same = (uint32_t)(cosine > LUM_SAME_COS) & (uint32_t)(fabsf(off) <= b->limit[p] + b->limit[q]);
        window[i] |= same ? bit : 0;
    }
}

/* Windows of a packet's coarse pixels, cut off at the edges of surfaces and of the picture: w x h of them, COARSE_SIDE
 * apart. */
static void find_windows(const struct block *b, uint32_t w, uint32_t h, uint64_t *ret_windows)
{
    memset(ret_windows, 0, COARSE_SIDE * COARSE_SIDE * sizeof *ret_windows);
    for (uint32_t j = 0; j < h; j++)
        for (uint32_t k = 0; k < WINDOW * WINDOW; k++) {
            uint32_t step = k / WINDOW * BLOCK + k % WINDOW - (REACH * BLOCK + REACH); /* wraps to what is before */
            test_row(b, (j + REACH) * BLOCK + REACH, step, w, UINT64_C(1) << k, ret_windows + j * COARSE_SIDE);
        }
}

/* Sets that are found in a window around coarse pixel (i, j). */
static uint32_t sets_in(uint64_t window, uint32_t i, uint32_t j)
{
    uint32_t sets = 0;
    if (window == WHOLE_WINDOW)
        return ALL_SETS;
    for (; window; window &= window - 1) {
        uint32_t k = (uint32_t)__builtin_ctzll(window);
        sets |= 1u << lum_pattern_set(SIDE, i + k % WINDOW - REACH, j + k / WINDOW - REACH);
    }
    return sets;
}

static bool is_diffuse(const struct lum_pass *pass, size_t pixel)
{
    return (pass->surfaces->kind[pixel] & LUM_PIXEL_DIFFUSE) != 0;
}

/* The joined picture, whose pixels are upsampled as they are. */
static struct lum_filter upsampling(const struct lum_pass *pass, const struct lum_guide *guide)
{
    return (struct lum_filter){
        .guide = guide, .need = LUM_PIXEL_DIFFUSE, .side = 1, .step = 2, .in = coarse_of(pass).rest};
}

/* ---- gathering ---- */

static void flush(struct gathering *g, uint32_t set, struct lum_rgb *sums)
{
    uint32_t n = 0, n_points = g->points.n_points;
    if (n_points == 0)
        return;
    for (uint32_t k = set; k < g->pass->vpls->n; k += N_SETS)
        g->slots[n++] = k;
    memset(g->irradiance, 0, n_points * sizeof g->irradiance[0]);
    struct lum_gather job = {
        .snapshot = g->pass->snapshot,
        .set = g->pass->vpls,
        .slots = g->slots,
        .n_slots = n,
        .bound = lum_vpl_bound(g->pass->vpls),
        .media = g->pass->on[LUM_EFFECT_MEDIA],
        .points = &g->points,
        .irradiance = g->irradiance,
        .counters = g->counters,
    };
    lum_vpl_gather(&job);
    for (uint32_t i = 0; i < n_points; i++)
        sums[g->target[i]] = lum_rgb_mad(sums[g->target[i]], g->irradiance[i], LUM_INV_PI);
    g->points.n_points = 0;
}

/* The surface at full-resolution pixel `pixel` gathers from a set into sums[target]. */
static void add_point(struct gathering *g, uint32_t set, size_t pixel, size_t target, struct lum_rgb *sums)
{
    const struct lum_surfaces *s = g->pass->surfaces;
    uint32_t i = g->points.n_points++;
    g->points.p[i] = s->p[pixel];
    g->points.n[i] = s->n[pixel];
    g->points.ng[i] = s->ng[pixel];
    g->target[i] = target;
    if (g->points.n_points == LUM_RAY_BATCH)
        flush(g, set, sums);
}

struct coarse_packet {
    uint32_t x, y, w, h; /* in coarse pixels */
    uint16_t missing[COARSE_SIDE * COARSE_SIDE];
};

static void find_missing(const struct lum_pass *pass, const struct lum_guide *guide, struct coarse_packet *c)
{
    struct coarse all = coarse_of(pass);
    struct block block;
    uint64_t windows[COARSE_SIDE * COARSE_SIDE];
    load_block(guide, &all, c->x, c->y, &block);
    find_windows(&block, c->w, c->h, windows);
    uint8_t *iterations = pass->components->buffer[LUM_COMPONENT_INDIRECT].iterations;
    for (uint32_t k = 0; k < c->w * c->h; k++) {
        uint32_t i = c->x + k % c->w, j = c->y + k / c->w;
        size_t at = site(pass, i, j);
        uint64_t window = windows[k / c->w * COARSE_SIDE + k % c->w];
        uint32_t missing = is_diffuse(pass, at) ? ALL_SETS & ~sets_in(window, i, j) : 0;
        all.windows[(size_t)j * all.w + i] = window;
        c->missing[k] = (uint16_t)missing;
        for (uint32_t y = 2 * j; y <= 2 * j + 1 && y < pass->tiling.h; y++)
            for (uint32_t x = 2 * i; x <= 2 * i + 1 && x < pass->tiling.w; x++)
                iterations[(size_t)y * pass->tiling.w + x] = (uint8_t)__builtin_popcount(missing);
    }
}

static void gather_coarse(struct gathering *g, const struct coarse_packet *c)
{
    const struct lum_pass *pass = g->pass;
    struct coarse all = coarse_of(pass);
    for (uint32_t set = 0; set < N_SETS; set++) {
        for (uint32_t own = 0; own < 2; own++) {
            struct lum_rgb *sums = own ? all.own : all.rest;
            for (uint32_t k = 0; k < c->w * c->h; k++) {
                uint32_t i = c->x + k % c->w, j = c->y + k / c->w;
                size_t at = site(pass, i, j);
                bool wanted =
                    own ? lum_pattern_set(SIDE, i, j) == set && is_diffuse(pass, at) : c->missing[k] >> set & 1u;
                if (wanted)
                    add_point(g, set, at, (size_t)j * all.w + i, sums);
            }
            flush(g, set, sums);
        }
    }
}

/* Full-resolution pixels that no coarse pixel serves. Straight into `smooth`; marked by all iterations. */
static void gather_lone(struct gathering *g, const struct lum_guide *guide, const struct lum_tile_rect *r)
{
    const struct lum_pass *pass = g->pass;
    struct lum_component_buffer *b = &pass->components->buffer[LUM_COMPONENT_INDIRECT];
    struct lum_filter f = upsampling(pass, guide);
    size_t lone[LUM_PACKET_SIDE * LUM_PACKET_SIDE];
    uint32_t n = 0;
    for (uint32_t y = r->y; y < r->y + r->h; y++)
        for (uint32_t x = r->x; x < r->x + r->w; x++) {
            size_t pixel = (size_t)y * pass->tiling.w + x;
            if (is_diffuse(pass, pixel) && !lum_upsample_serves(&f, x, y))
                lone[n++] = pixel;
        }
    for (uint32_t k = 0; k < n; k++) {
        b->smooth[lone[k]] = lum_grey(0.0f);
        b->iterations[lone[k]] = LONE;
    }
    for (uint32_t set = 0; set < N_SETS && n > 0; set++) {
        for (uint32_t k = 0; k < n; k++)
            add_point(g, set, lone[k], lone[k], b->smooth);
        flush(g, set, b->smooth);
    }
}

static void indirect_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    if (lum_components_enter(pass, LUM_STAGE_INDIRECT, packet))
        return;
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    struct coarse_packet c = {r.x / 2, r.y / 2, lum_filter_size(r.w, 2), lum_filter_size(r.h, 2), {0}};
    uint32_t slots[LUM_VPL_MAX / N_SETS];
    struct gathering g = {.pass = pass, .counters = counters, .slots = slots};
    find_missing(pass, &guide, &c);
    gather_coarse(&g, &c);
    gather_lone(&g, &guide, &r);
}

/* ---- filtering ---- */

/* Every set is there, with a weight of 1 in all. */
static struct lum_rgb sum_whole(const struct lum_rgb *middle, uint32_t pitch)
{
    struct lum_rgb all = lum_grey(0.0f);
    for (uint32_t y = 0; y < WINDOW; y++) {
        const struct lum_rgb *v = middle + (size_t)y * pitch - (size_t)REACH * pitch - REACH;
        struct lum_rgb row = lum_grey(0.0f);
        for (uint32_t x = 0; x < WINDOW; x++)
            row = lum_rgb_mad(row, v[x], tent[x]);
        all = lum_rgb_mad(all, row, tent[y]);
    }
    return all;
}

/* All 16 sets at coarse pixel (i, j): each the mean over its window; to be added to the ones it gathered because none
 * was there. */
static struct lum_rgb sum_around(const struct coarse *c, uint32_t i, uint32_t j)
{
    uint64_t window = c->windows[(size_t)j * c->w + i];
    const struct lum_rgb *middle = &c->own[(size_t)j * c->w + i];
    if (window == WHOLE_WINDOW)
        return sum_whole(middle, c->w);
    struct lum_rgb sum[N_SETS] = {{0}}, all = lum_grey(0.0f);
    float weight[N_SETS] = {0};
    for (; window; window &= window - 1) {
        uint32_t k = (uint32_t)__builtin_ctzll(window), x = i + k % WINDOW - REACH, y = j + k / WINDOW - REACH;
        uint32_t set = lum_pattern_set(SIDE, x, y);
        float w = tent[k % WINDOW] * tent[k / WINDOW];
        sum[set] = lum_rgb_mad(sum[set], c->own[(size_t)y * c->w + x], w);
        weight[set] += w;
    }
    for (uint32_t set = 0; set < N_SETS; set++)
        if (weight[set] > 0.0f)
            all = lum_rgb_mad(all, sum[set], 1.0f / weight[set]);
    return all;
}

static void join_sets(const struct lum_pass *pass, const struct lum_tile_rect *r)
{
    struct coarse c = coarse_of(pass);
    for (uint32_t j = r->y / 2; 2 * j < r->y + r->h; j++)
        for (uint32_t i = r->x / 2; 2 * i < r->x + r->w; i++)
            if (is_diffuse(pass, site(pass, i, j))) {
                struct lum_rgb *rest = &c.rest[(size_t)j * c.w + i];
                *rest = lum_rgb_add(*rest, sum_around(&c, i, j));
            }
}

static void join_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    (void)counters;
    if (lum_components_enter(pass, LUM_STAGE_FILTER, packet))
        return;
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    if (pass->components->buffer[LUM_COMPONENT_INDIRECT].raw && !pass->records) /* those come joined */
        join_sets(pass, &r);
    const struct lum_component_buffer *gloss = &pass->components->buffer[LUM_COMPONENT_GLOSS];
    const uint8_t kinds = LUM_PIXEL_GLOSS | LUM_PIXEL_SPECULAR;
    struct lum_filter f = {.guide = &guide, .need = kinds, .side = SIDE, .step = 1, .in = gloss->raw};
    if (gloss->raw)
        lum_filter_box(&f, &(struct lum_filter_rect){r.x, r.y, r.w, r.h}, gloss->smooth + (size_t)r.y * guide.w + r.x,
                       guide.w);
}

static void upsample_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    (void)counters;
    struct lum_component_buffer *b = &pass->components->buffer[LUM_COMPONENT_INDIRECT];
    if (!b->raw || lum_components_enter(pass, LUM_STAGE_UPSAMPLE, packet))
        return;
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_filter f = upsampling(pass, &guide);
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    lum_filter_upsampled(&f, &(struct lum_filter_rect){r.x, r.y, r.w, r.h}, b->smooth);
}

const struct lum_estimator lum_estimator_indirect = {
    .name = "indirect",
    .stage = LUM_STAGE_INDIRECT,
    .tile = indirect_packet,
    .packets = true,
    .components = LUM_COMPONENT_BIT(LUM_COMPONENT_INDIRECT),
    .vpls = true,
};
const struct lum_estimator lum_stage_join = {
    .name = "join", .stage = LUM_STAGE_FILTER, .tile = join_packet, .packets = true};
const struct lum_estimator lum_stage_upsample = {
    .name = "upsample", .stage = LUM_STAGE_UPSAMPLE, .tile = upsample_packet, .packets = true};
