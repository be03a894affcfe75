/* Airlight: trace and refine. */
#include "core/effect/fog/airlight.h"
#include "core/math/sampler.h"
#include "core/math/sampler_pairs.h"

#include <string.h>

#define N_SUBSETS (LUM_AIRLIGHT_SIDE * LUM_AIRLIGHT_SIDE)
#define TILES_SIDE (LUM_CELL_SIDE / LUM_AIRLIGHT_SIDE)
#define N_TILES (TILES_SIDE * TILES_SIDE)
#define N_PIXELS (LUM_CELL_SIDE * LUM_CELL_SIDE)
_Static_assert(LUM_CELL_SIDE % LUM_AIRLIGHT_SIDE == 0, "a packet is made of whole tiles of the pattern");

/* Points of a pixel and pair, at most; and the error of a tile, relative to its light, that is worth further ones. */
#define POINTS_MAX 5u
#define TOLERANCE 0.05f

/* Of more pairs than so many with a slot of their own one in 2 strata is looked at for each. A first frame of
 * office-media, 225 x 150, three draws, takes .73 million rays instead of .88, for a SMAPE of .1436 instead of .1435.
 */
#define ALL_STRATA 4u
/* Of the others one in so many, 1 to 16, so that a pixel asks about so many rays for all of them. */
#define RAYS_SHARED 4u

/* About 110 KiB: lives on a worker's stack. */
struct airlight {
    const struct lum_pass *pass;
    struct lum_airlights *kept;
    struct lum_counters *counters;
    struct lum_tile_rect r;
    struct lum_airlight_pair pair; /* at hand */
    uint32_t salt;
    uint32_t thin, phase;                                    /* it takes the strata that are phase modulo thin */
    struct lum_airlight sum[N_PIXELS];                       /* of the pair, over the points of each pixel */
    uint8_t n_points[N_TILES];                               /* that its pixels shall have, per tile of the pattern */
    float error[LUM_AIRLIGHTS_MAX][N_TILES], total[N_TILES]; /* luminance: standard error by pair; seen in all */
    bool fresh[LUM_AIRLIGHTS_MAX];                           /* the pair was traced in this pass */
    struct lum_rays rays;
    struct lum_rgb value[LUM_RAY_BATCH];
    uint16_t pixel[LUM_RAY_BATCH];
};

/* ---- along one ray ---- */

static void see(struct airlight *a, uint32_t pixel, struct lum_rgb value)
{
    a->sum[pixel].seen = lum_rgb_add(a->sum[pixel].seen, value);
}

static void flush(struct airlight *a)
{
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH];
    if (a->rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of_light(a->pass->snapshot, a->counters, lum_pass_panes(a->pass));
    lum_trace_light(&trace, &a->rays, occluded, left);
    a->counters->rays[LUM_RAY_MEDIA] += a->rays.n;
    for (uint32_t r = 0; r < a->rays.n; r++)
        if (!occluded[r])
            see(a, a->pixel[r], trace.panes ? lum_rgb_mul(a->value[r], left[r]) : a->value[r]);
    a->rays.n = 0;
}

/* Tiles have samples of their own: what one misses another one finds. */
static struct lum_sampler sampler_of_tile(const struct airlight *a, uint32_t pixel)
{
    uint32_t x = (a->r.x + pixel % LUM_CELL_SIDE) / LUM_AIRLIGHT_SIDE;
    uint32_t y = (a->r.y + pixel / LUM_CELL_SIDE) / LUM_AIRLIGHT_SIDE;
    struct lum_sampler s = lum_sampler_at(x, y, 0, a->pass->settings->seed);
    s.pixel_seed = lum_hash_combine(s.pixel_seed, a->salt);
    return s;
}

/* The pixel's point of a stratum in an iteration, of n. */
static void sample_pixel(struct airlight *a, uint32_t pixel, uint32_t stratum, uint32_t iteration, uint32_t n)
{
    struct lum_scatter_query q =
        lum_airlight_query(a->pass, &a->pair, a->r.x + pixel % LUM_CELL_SIDE, a->r.y + pixel / LUM_CELL_SIDE);
    struct lum_airlight_draw w;
    if (!lum_airlight_plan(&q, &w))
        return;
    struct lum_sampler sampler = sampler_of_tile(a, pixel);
    float shift = lum_sampler_1d(&sampler, LUM_PAIRS_AIRLIGHT + 1) + (float)iteration / (float)n;
    uint32_t n_strata = N_SUBSETS / a->thin;
    float pdf, u = ((float)(stratum / a->thin) + shift - floorf(shift)) / (float)n_strata;
    float t = lum_airlight_distance(&w, u, &pdf);
    sampler.sample = N_SUBSETS * iteration + stratum;
    struct lum_vec2 u_light = {0.5f, 0.5f};
    if (!q.snapshot->lights.lights[q.light].delta)
        u_light = lum_sampler_2d(&sampler, LUM_PAIRS_AIRLIGHT);
    struct lum_scatter s;
    if (!lum_medium_scatter_at(&q, t, pdf / (float)a->thin, u_light, &s))
        return;
    a->sum[pixel].open += lum_luminance(s.radiance);
    if (a->rays.n == LUM_RAY_BATCH)
        flush(a);
    uint32_t r = a->rays.n;
    if (lum_shadow_ray(&a->rays, s.p, lum_v3(0, 0, 0), s.wi, s.distance)) {
        a->value[r] = s.radiance;
        a->pixel[r] = (uint16_t)pixel;
    } else {
        see(a, pixel, s.radiance);
    }
}

/* ---- a cell ---- */

static uint32_t tile_of(uint32_t pixel)
{
    return pixel / LUM_CELL_SIDE / LUM_AIRLIGHT_SIDE * TILES_SIDE + pixel % LUM_CELL_SIDE / LUM_AIRLIGHT_SIDE;
}

/* The stratum of a subset of the pattern. Subsets of a 2 x 2 block differ in their upper two bits: reversed, a block
 * holds four strata in a row, and the pixels that lie alike in their blocks every fourth one. */
static uint32_t stratum_of(uint32_t subset)
{
    return (subset & 1u) << 3 | (subset & 2u) << 1 | (subset & 4u) >> 1 | (subset & 8u) >> 3;
}

/* Of all pixels of tiles that want more points than `iteration`; those in the same stratum one after the other. */
static void take_points(struct airlight *a, uint32_t iteration)
{
    for (uint32_t at = 0; at < N_SUBSETS; at++) {
        uint32_t dx = at % LUM_AIRLIGHT_SIDE, dy = at / LUM_AIRLIGHT_SIDE;
        uint32_t subset = lum_pattern_next(LUM_AIRLIGHT_SIDE, lum_pattern_subset(LUM_AIRLIGHT_SIDE, dx, dy), iteration);
        for (uint32_t y = dy; y < a->r.h; y += LUM_AIRLIGHT_SIDE)
            for (uint32_t x = dx; x < a->r.w; x += LUM_AIRLIGHT_SIDE) {
                uint32_t pixel = y * LUM_CELL_SIDE + x, n = a->n_points[tile_of(pixel)];
                if (n > iteration && stratum_of(subset) % a->thin == a->phase)
                    sample_pixel(a, pixel, stratum_of(subset), iteration, n);
            }
    }
    flush(a);
}

/* By how many pairs there are, whether they shine or not. */
static uint32_t thinning(const struct airlight *a, const struct lum_airlight_pair *pair)
{
    const struct lum_snapshot *s = a->pass->snapshot;
    uint32_t n_scatter = 0, thin = 1;
    for (uint32_t i = 0; i < s->n_media; i++)
        n_scatter += !lum_rgb_black(s->media[i].sigma_s);
    uint32_t n_pairs = n_scatter * s->lights.n_lights, n_alone = n_pairs;
    if (a->kept->shared && a->kept->n - 1 < n_pairs)
        n_alone = a->kept->n - 1;
    if (pair->alone)
        return n_alone > ALL_STRATA ? 2 : 1;
    while (thin < N_SUBSETS && n_pairs - n_alone > RAYS_SHARED * thin)
        thin *= 2;
    return thin;
}

static void begin_pair(struct airlight *a, const struct lum_airlight_pair *pair)
{
    const struct lum_snapshot *s = a->pass->snapshot;
    a->pair = *pair;
    a->salt =
        lum_hash_combine(lum_hash_text(s->lights.lights[pair->light].id), lum_hash_text(s->media[pair->medium].id));
    a->thin = thinning(a, pair);
    a->phase = a->salt % a->thin;
}

static struct lum_airlight *kept_at(const struct airlight *a, uint32_t x, uint32_t y)
{
    return lum_airlight_at(a->kept, a->pair.slot, (size_t)(a->r.y + y) * a->pass->tiling.w + a->r.x + x);
}

/* Adds the first points to what is kept, and notes what they say about each tile. */
static void keep_first(struct airlight *a)
{
    float open[N_TILES][4] = {{0}}, seen[N_TILES][4] = {{0}};
    for (uint32_t y = 0; y < a->r.h; y++)
        for (uint32_t x = 0; x < a->r.w; x++) {
            uint32_t pixel = y * LUM_CELL_SIDE + x, t = tile_of(pixel);
            uint32_t quarter = stratum_of(lum_pattern_subset(LUM_AIRLIGHT_SIDE, x, y)) / a->thin % 4;
            const struct lum_airlight *sum = &a->sum[pixel];
            struct lum_airlight *kept = kept_at(a, x, y);
            kept->seen = lum_rgb_add(kept->seen, sum->seen);
            kept->open += sum->open;
            open[t][quarter] += sum->open;
            seen[t][quarter] += lum_luminance(sum->seen);
        }
    float power = lum_luminance(lum_airlight_power(a->pass, &a->pair));
    for (uint32_t t = 0; t < N_TILES; t++) {
        float share[4], mean = 0.0f, square = 0.0f, all = 0.0f, n = 0.0f;
        for (uint32_t k = 0; k < 4; k++) {
            all += open[t][k] / N_SUBSETS;
            if (!(open[t][k] > 0.0f))
                continue;
            share[k] = seen[t][k] / open[t][k];
            mean += share[k];
            n++;
        }
        for (uint32_t k = 0; k < 4; k++)
            if (open[t][k] > 0.0f)
                square += (share[k] - mean / n) * (share[k] - mean / n);
        if (a->pair.alone)
            a->error[a->pair.slot][t] = n > 1.0f ? power * all * sqrtf(square / (n * (n - 1.0f))) : 0.0f;
    }
}

/* What the tiles get of all pairs. */
static void sum_total(struct airlight *a, const struct lum_airlight_pair *pair)
{
    a->pair = *pair;
    struct lum_rgb power = lum_airlight_power(a->pass, pair);
    for (uint32_t y = 0; y < a->r.h; y++)
        for (uint32_t x = 0; x < a->r.w; x++)
            a->total[tile_of(y * LUM_CELL_SIDE + x)] +=
                lum_luminance(lum_rgb_mul(kept_at(a, x, y)->seen, power)) / N_SUBSETS;
}

/* Four quarters may agree by chance: a neighbour's doubts count by half. */
static float error_around(const float error[N_TILES], uint32_t tile)
{
    uint32_t x = tile % TILES_SIDE, y = tile / TILES_SIDE;
    float most = 2.0f * error[tile];
    for (uint32_t j = y > 0 ? y - 1 : 0; j <= y + 1 && j < TILES_SIDE; j++)
        for (uint32_t i = x > 0 ? x - 1 : 0; i <= x + 1 && i < TILES_SIDE; i++)
            most = lum_max(most, error[j * TILES_SIDE + i]);
    return 0.5f * most;
}

/* A tile with less light than so much of the cell's mean has errors relative to that. Larger: the dark beside a beam is
 * coarse; smaller: points go to where hardly any light is. */
#define DARK 0.25f

/* How many points the tiles get for the pair: the error of a midpoint rule falls as their number. False: no tile gets
 * more than it has. */
static bool choose_points(struct airlight *a)
{
    float mean = 0.0f;
    bool any = false;
    for (uint32_t t = 0; t < N_TILES; t++)
        mean += a->total[t] / N_TILES;
    for (uint32_t t = 0; t < N_TILES; t++) {
        float limit = TOLERANCE * lum_max(a->total[t], DARK * mean), error = error_around(a->error[a->pair.slot], t);
        float wanted = limit > 0.0f ? lum_min(error / limit, (float)POINTS_MAX) : 1.0f;
        a->n_points[t] = (uint8_t)ceilf(lum_max(wanted, 1.0f));
        any = any || a->n_points[t] > 1;
    }
    return any;
}

static void refine_pair(struct airlight *a)
{
    uint32_t last = 1;
    memset(a->sum, 0, sizeof a->sum);
    for (uint32_t t = 0; t < N_TILES; t++)
        last = a->n_points[t] > last ? a->n_points[t] : last;
    for (uint32_t i = 1; i < last; i++)
        take_points(a, i);
    for (uint32_t y = 0; y < a->r.h; y++)
        for (uint32_t x = 0; x < a->r.w; x++) {
            uint32_t pixel = y * LUM_CELL_SIDE + x, n = a->n_points[tile_of(pixel)];
            struct lum_airlight *kept = kept_at(a, x, y);
            uint8_t *noted = &a->pass->components->buffer[LUM_EFFECT_MEDIA]
                                  .iterations[(size_t)(a->r.y + y) * a->pass->tiling.w + a->r.x + x];
            kept->seen = lum_rgb_scale(lum_rgb_add(kept->seen, a->sum[pixel].seen), 1.0f / (float)n);
            kept->open = (kept->open + a->sum[pixel].open) / (float)n;
            *noted = n - 1 > *noted ? (uint8_t)(n - 1) : *noted;
        }
}

/* First points of the pairs that have none. False: all have. */
static bool trace_first(struct airlight *a, uint32_t cell)
{
    struct lum_airlight_pair pair;
    bool any = false;
    memset(a->n_points, 1, sizeof a->n_points);
    memset(a->fresh, 0, sizeof a->fresh);
    for (uint32_t i = 0; lum_airlight_next(a->pass, i, &pair); i++) {
        if (lum_memo_step(&a->kept->made, lum_airlight_item(a->kept, pair.slot, cell)) && !a->fresh[pair.slot])
            continue;
        begin_pair(a, &pair);
        memset(a->sum, 0, sizeof a->sum);
        take_points(a, 0);
        keep_first(a);
        lum_memo_set(&a->kept->made, lum_airlight_item(a->kept, pair.slot, cell), LUM_AIRLIGHT_TRACED);
        any = a->fresh[pair.slot] = true;
    }
    return any;
}

static void trace_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    if (!lum_memo_advance(&pass->components->made[LUM_EFFECT_MEDIA], cell, LUM_AIRLIGHT_UNTRACED))
        return;
    if (pass->settings->max_depth == 0) /* and what is kept is black */
        return;
    struct airlight a;
    a.pass = pass;
    a.kept = lum_airlights_of(pass);
    a.counters = counters;
    a.r = lum_tile_at(&pass->cells, cell);
    a.rays.n = 0;
    if (!trace_first(&a, cell))
        return;
    memset(a.total, 0, sizeof a.total);
    struct lum_airlight_pair pair;
    uint32_t last = UINT32_MAX;
    for (uint32_t i = 0; lum_airlight_next(pass, i, &pair); last = pair.slot, i++)
        if (pair.slot != last)
            sum_total(&a, &pair);
    for (uint32_t i = 0; lum_airlight_next(pass, i, &pair); i++) {
        if (!pair.alone || !a.fresh[pair.slot])
            continue;
        begin_pair(&a, &pair);
        if (choose_points(&a))
            refine_pair(&a);
    }
}

const struct lum_estimator lum_estimator_airlight = {
    .name = "airlight",
    .stage = LUM_STAGE_MEDIA,
    .tile = trace_cell,
    .cells = true,
    .state = &lum_airlights_kind,
    .components = LUM_EFFECT_BIT(LUM_EFFECT_MEDIA),
    .lasting = LUM_EFFECT_BIT(LUM_EFFECT_MEDIA),
    .surfaces = true,
    .then = &lum_airlight_resolve,
};

/* Black stays black in fog: without any light there is nothing to dim or to scatter. */
static void demand_media(const struct lum_sights *see, const struct lum_effect_row *row, enum lum_effect effect,
                         struct lum_demand *d)
{
    (void)row;
    const struct lum_snapshot *s = see->snapshot;
    bool anything = see->lit;
    for (uint32_t i = 0; i < s->n_instances && !anything; i++)
        anything = s->materials[s->instances[i].material].unlit;
    for (uint32_t i = 0; i < s->n_media && anything; i++)
        lum_demand_call(d, effect, s->media[i].id,
                        lum_rgb_black(s->media[i].sigma_s) ? "absorbs light" : "scatters light");
    lum_demand_refuse(d, effect, s->n_media ? "no light is on" : "no medium scatters or absorbs light");
}
const struct lum_effect_row lum_effect_media = {.demand = demand_media, .adds = LUM_ADDS_AIR, .guided = true};

/* What scatters light once scatters it twice, and lights what stands in it. */
static void demand_scattering(const struct lum_sights *see, const struct lum_effect_row *row, enum lum_effect effect,
                              struct lum_demand *d)
{
    (void)row;
    const struct lum_snapshot *s = see->snapshot;
    bool any = false;
    for (uint32_t i = 0; i < s->n_media; i++) {
        any = any || !lum_rgb_black(s->media[i].sigma_s);
        if (see->lit && !lum_rgb_black(s->media[i].sigma_s))
            lum_demand_call(d, effect, s->media[i].id, "scatters light");
    }
    lum_demand_refuse(d, effect, any ? "no light is on" : "no medium scatters light");
}
const struct lum_effect_row lum_effect_scattering = {.demand = demand_scattering, .adds = LUM_ADDS_AIR};
