/* Single scattering in media, for the method `live`: interleaved 4 x 4, each pixel of the pattern looks at one stratum
 * of the distance along its ray.
 *
 *   trace    per pixel and pair of medium and light one point: where the light passes near the ray it is drawn by the
 *            angle under which the light sees the ray, which makes halos as even as the rest; else as the medium dims.
 *            Strata are in that variable, and only over the part of the ray that the light can reach (the cone of a
 *            spot, the front of a panel). Where in its stratum a point lies changes from tile to tile.
 *   refine   where the four interleaved quarters of a tile's strata disagree on what is hidden, or its neighbours' do,
 *            by more than is lost in what the tile gets in all, its pixels take further strata, shifted such that all
 *            points of the tile are evenly spaced
 *   resolve  light at one place, whose scattered light varies fast over the picture, is integrated as if nothing were
 * in the way, pixel by pixel without a ray, and multiplied by the share that the points around it see (the ratio
 *            estimator of Heitz, Hill & McGuire 2018); all else is the mean of the points around
 *   join     and is smoothed once more
 * Neighbours lend what they know if their rays end at about the same depth: normals do not matter to fog.
 *
 * Points are kept per unit of power: another colour, intensity or switch of a light is another sum of them, without a
 * ray, but for the pairs that share a buffer. How many points a tile has was decided by the powers when it was traced:
 * a fresh view may take others there, and what it shows in their windows differs by what is let pass (TOLERANCE). */
#include "core/estimator/components.h"
#include "core/estimator/layers.h"
#include "core/math/warp.h"

#include <string.h>

#define SIDE 4u
#define N_SETS (SIDE * SIDE)
#define TILES_SIDE (LUM_PACKET_SIDE / SIDE)
#define N_TILES (TILES_SIDE * TILES_SIDE)
#define N_PIXELS (LUM_PACKET_SIDE * LUM_PACKET_SIDE)
_Static_assert(LUM_PACKET_SIDE % SIDE == 0, "a packet is made of whole tiles of the pattern");

/* Sampler pairs of points on lights. */
#define PAIR_AIRLIGHT 0xa0000000u

/* Nearer to the ray than this, relative to the ray's length in the medium, and for less optical depth than this, a
 * light's halo is aimed at. For the samples 0.06 would do; the closed form, which has few points, gains up to 0.3. */
#define NEAR_RATIO 0.3f
#define NEAR_DEPTH 2.0f

/* Points of a pixel and pair, at most; and the error of a tile, relative to its light, that is worth further ones. */
#define POINTS_MAX 5u
#define TOLERANCE 0.05f

/* What is done in a packet; of a pair: up to RESOLVED. */
enum { UNTRACED, TRACED, RESOLVED, JOINED };

/* Pairs of medium and light that shines. Those for which there is no buffer share the last, at their present power, and
 * are not refined. */
struct pair {
    uint32_t medium, light, slot;
    bool alone;
};

/* What its points are made with. */
static const struct lum_snapshot *snapshot_of(const struct lum_pass *pass, const struct pair *pair)
{
    return pair->alone ? &pass->layers->unit : pass->snapshot;
}

/* What they are multiplied by. */
static struct lum_rgb power_of(const struct lum_pass *pass, const struct pair *pair)
{
    return pair->alone ? pass->snapshot->lights.lights[pair->light].power : lum_grey(1.0f);
}

/* About 110 KiB: lives on a worker's stack. */
struct airlight {
    const struct lum_pass *pass;
    struct lum_counters *counters;
    struct lum_tile_rect r;
    struct pair pair; /* at hand */
    uint32_t salt;
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
    if (a->rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of(a->pass->snapshot, a->counters);
    lum_trace_any(&trace, &a->rays, occluded);
    a->counters->rays[LUM_RAY_MEDIA] += a->rays.n;
    for (uint32_t r = 0; r < a->rays.n; r++)
        if (!occluded[r])
            see(a, a->pixel[r], a->value[r]);
    a->rays.n = 0;
}

/* Where the distance is drawn: by angle, or as light is dimmed. */
struct draw {
    struct lum_segment segment;
    bool by_angle;
    struct lum_equiangular angle;
    float sigma;
};

/* The least that dims what is scattered. */
static float least_sigma(const struct lum_medium *m)
{
    float sigma = INFINITY;
    if (m->sigma_s.r > 0.0f)
        sigma = m->sigma_t.r;
    if (m->sigma_s.g > 0.0f)
        sigma = lum_min(sigma, m->sigma_t.g);
    if (m->sigma_s.b > 0.0f)
        sigma = lum_min(sigma, m->sigma_t.b);
    return sigma;
}

static bool has_place(const struct lum_light *l)
{
    return l->kind != LUM_EMIT_DIRECTIONAL && l->kind != LUM_EMIT_ENVIRONMENT && l->kind != LUM_EMIT_MESH;
}

/* Towards the light the way to it gets shorter: light is dimmed by exp(-sigma (s + r(s))), of which the exponent grows
 * as s (1 - cos) at first. How much it grows up to where the ray passes the light decides which of the two is aimed at.
 */
static void aim(struct draw *w, struct lum_vec3 light, float length)
{
    const struct lum_segment *s = &w->segment;
    float ahead = w->angle.nearest - s->t0, way = lum_clamp(ahead, 0.0f, s->t1 - s->t0);
    float r0 = lum_length(lum_v3_sub(light, lum_v3_mad(s->o, s->d, s->t0)));
    float r = lum_length(lum_v3_sub(light, lum_v3_mad(s->o, s->d, s->t0 + way)));
    w->by_angle = w->angle.miss < NEAR_RATIO * length && w->sigma * (way + r - r0) < NEAR_DEPTH;
    if (r0 > 0.0f)
        w->sigma *= 1.0f - lum_clamp(ahead / r0, -1.0f, 1.0f);
}

static bool plan_draw(const struct lum_scatter_query *q, struct draw *ret_draw)
{
    const struct lum_light *light = &q->snapshot->lights.lights[q->light];
    struct draw w = {.segment = {.o = q->o, .d = q->d}};
    if (!lum_medium_scatters(q, &w.segment.t0, &w.segment.t1))
        return false;
    float length = w.segment.t1 - w.segment.t0;
    if (!lum_light_reaches(light, &w.segment))
        return false;
    w.sigma = least_sigma(&q->snapshot->media[q->medium]);
    if (has_place(light)) {
        w.angle = lum_equiangular_init(&w.segment, light->p);
        aim(&w, light->p, length);
    }
    *ret_draw = w;
    return true;
}

static float draw_distance(const struct draw *w, float u, float *ret_pdf)
{
    float length = w->segment.t1 - w->segment.t0;
    float t = w->by_angle ? lum_equiangular_sample(&w->angle, u)
                          : w->segment.t0 + lum_exponential_sample(w->sigma, length, u);
    *ret_pdf =
        w->by_angle ? lum_equiangular_pdf(&w->angle, t) : lum_exponential_pdf(w->sigma, length, t - w->segment.t0);
    return t;
}

static struct lum_scatter_query query_at(const struct lum_pass *pass, const struct pair *pair, uint32_t x, uint32_t y)
{
    return (struct lum_scatter_query){
        .snapshot = snapshot_of(pass, pair),
        .medium = pair->medium,
        .light = pair->light,
        .o = pass->eye.o,
        .d = lum_eye_direction(&pass->eye, (float)x + 0.5f, (float)y + 0.5f),
        .tmax = pass->surfaces->depth[(size_t)y * pass->tiling.w + x],
    };
}

/* Tiles have samples of their own: what one misses another one finds. */
static struct lum_sampler sampler_of_tile(const struct airlight *a, uint32_t pixel)
{
    uint32_t x = (a->r.x + pixel % LUM_PACKET_SIDE) / SIDE, y = (a->r.y + pixel / LUM_PACKET_SIDE) / SIDE;
    struct lum_sampler s = lum_sampler_at(x, y, 0, a->pass->settings->seed);
    s.pixel_seed = lum_hash_combine(s.pixel_seed, a->salt);
    return s;
}

/* The pixel's point of a stratum in an iteration, of n. */
static void sample_pixel(struct airlight *a, uint32_t pixel, uint32_t stratum, uint32_t iteration, uint32_t n)
{
    struct lum_scatter_query q =
        query_at(a->pass, &a->pair, a->r.x + pixel % LUM_PACKET_SIDE, a->r.y + pixel / LUM_PACKET_SIDE);
    struct draw w;
    if (!plan_draw(&q, &w))
        return;
    struct lum_sampler sampler = sampler_of_tile(a, pixel);
    float shift = lum_sampler_1d(&sampler, PAIR_AIRLIGHT + 1) + (float)iteration / (float)n;
    float pdf, u = ((float)stratum + shift - floorf(shift)) / N_SETS, t = draw_distance(&w, u, &pdf);
    sampler.sample = N_SETS * iteration + stratum;
    struct lum_vec2 u_light = {0.5f, 0.5f};
    if (!q.snapshot->lights.lights[q.light].delta)
        u_light = lum_sampler_2d(&sampler, PAIR_AIRLIGHT);
    struct lum_scatter s;
    if (!lum_medium_scatter_at(&q, t, pdf, u_light, &s))
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

/* ---- a packet ---- */

static uint32_t tile_of(uint32_t pixel)
{
    return pixel / LUM_PACKET_SIDE / SIDE * TILES_SIDE + pixel % LUM_PACKET_SIDE / SIDE;
}

/* The stratum of a set of the pattern. Sets of a 2 x 2 block differ in their upper two bits: reversed, a block holds
 * four strata in a row, and the pixels that lie alike in their blocks every fourth one. */
static uint32_t stratum_of(uint32_t set)
{
    return (set & 1u) << 3 | (set & 2u) << 1 | (set & 4u) >> 1 | (set & 8u) >> 3;
}

/* Of all pixels of tiles that want more points than `iteration`; those in the same stratum one after the other. */
static void take_points(struct airlight *a, uint32_t iteration)
{
    for (uint32_t at = 0; at < N_SETS; at++) {
        uint32_t dx = at % SIDE, dy = at / SIDE;
        uint32_t set = lum_pattern_next(SIDE, lum_pattern_set(SIDE, dx, dy), iteration);
        for (uint32_t y = dy; y < a->r.h; y += SIDE)
            for (uint32_t x = dx; x < a->r.w; x += SIDE) {
                uint32_t pixel = y * LUM_PACKET_SIDE + x, n = a->n_points[tile_of(pixel)];
                if (n > iteration)
                    sample_pixel(a, pixel, stratum_of(set), iteration, n);
            }
    }
    flush(a);
}

static void begin_pair(struct airlight *a, const struct pair *pair)
{
    const struct lum_snapshot *s = a->pass->snapshot;
    a->pair = *pair;
    a->salt =
        lum_hash_combine(lum_hash_text(s->lights.lights[pair->light].id), lum_hash_text(s->media[pair->medium].id));
}

static struct lum_airlight *kept_at(const struct airlight *a, uint32_t x, uint32_t y)
{
    const struct lum_components *c = a->pass->components;
    return &c->airlight[((size_t)a->pair.slot * c->h + a->r.y + y) * c->w + a->r.x + x];
}

/* Adds the first points to what is kept, and notes what they say about each tile. */
static void keep_first(struct airlight *a)
{
    float open[N_TILES][4] = {{0}}, seen[N_TILES][4] = {{0}};
    for (uint32_t y = 0; y < a->r.h; y++)
        for (uint32_t x = 0; x < a->r.w; x++) {
            uint32_t pixel = y * LUM_PACKET_SIDE + x, t = tile_of(pixel);
            uint32_t quarter = stratum_of(lum_pattern_set(SIDE, x, y)) % 4;
            const struct lum_airlight *sum = &a->sum[pixel];
            struct lum_airlight *kept = kept_at(a, x, y);
            kept->seen = lum_rgb_add(kept->seen, sum->seen);
            kept->open += sum->open;
            open[t][quarter] += sum->open;
            seen[t][quarter] += lum_luminance(sum->seen);
        }
    float power = lum_luminance(power_of(a->pass, &a->pair));
    for (uint32_t t = 0; t < N_TILES; t++) {
        float share[4], mean = 0.0f, square = 0.0f, all = 0.0f, n = 0.0f;
        for (uint32_t k = 0; k < 4; k++) {
            all += open[t][k] / N_SETS;
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
static void sum_total(struct airlight *a, const struct pair *pair)
{
    a->pair = *pair;
    struct lum_rgb power = power_of(a->pass, pair);
    for (uint32_t y = 0; y < a->r.h; y++)
        for (uint32_t x = 0; x < a->r.w; x++)
            a->total[tile_of(y * LUM_PACKET_SIDE + x)] +=
                lum_luminance(lum_rgb_mul(kept_at(a, x, y)->seen, power)) / N_SETS;
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

/* How many points the tiles get for the pair: the error of a midpoint rule falls as their number. False: no tile gets
 * more than it has. */
static bool choose_points(struct airlight *a)
{
    float mean = 0.0f;
    bool any = false;
    for (uint32_t t = 0; t < N_TILES; t++)
        mean += a->total[t] / N_TILES;
    for (uint32_t t = 0; t < N_TILES; t++) {
        float limit = TOLERANCE * lum_max(a->total[t], 0.25f * mean), error = error_around(a->error[a->pair.slot], t);
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
            uint32_t pixel = y * LUM_PACKET_SIDE + x, n = a->n_points[tile_of(pixel)];
            struct lum_airlight *kept = kept_at(a, x, y);
            uint8_t *noted = &a->pass->components->buffer[LUM_COMPONENT_MEDIA]
                                  .iterations[(size_t)(a->r.y + y) * a->pass->tiling.w + a->r.x + x];
            kept->seen = lum_rgb_scale(lum_rgb_add(kept->seen, a->sum[pixel].seen), 1.0f / (float)n);
            kept->open = (kept->open + a->sum[pixel].open) / (float)n;
            *noted = n - 1 > *noted ? (uint8_t)(n - 1) : *noted;
        }
}

static bool next_pair(const struct lum_pass *pass, uint32_t i, struct pair *ret_pair)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    if (i >= pass->snapshot->n_media * lights->n_active)
        return false;
    uint32_t medium = i / lights->n_active, light = lights->active[i % lights->n_active];
    uint32_t slots = pass->components->n_airlights,
             at = medium * lights->n_lights + light; /* whatever is switched on */
    bool alone = !pass->components->airlights_shared || at < slots - 1;
    *ret_pair = (struct pair){medium, light, alone ? at : slots - 1, alone};
    return true;
}

/* What the slot holds of the packet. */
static uint8_t *traced_at(const struct lum_pass *pass, uint32_t slot, uint32_t packet)
{
    return &pass->components->airlight_traced[(size_t)slot * pass->packets.n + packet];
}

/* First points of the pairs that have none. False: all have. */
static bool trace_first(struct airlight *a, uint32_t packet)
{
    struct pair pair;
    bool any = false;
    memset(a->n_points, 1, sizeof a->n_points);
    memset(a->fresh, 0, sizeof a->fresh);
    for (uint32_t i = 0; next_pair(a->pass, i, &pair); i++) {
        if (*traced_at(a->pass, pair.slot, packet) && !a->fresh[pair.slot])
            continue;
        begin_pair(a, &pair);
        memset(a->sum, 0, sizeof a->sum);
        take_points(a, 0);
        keep_first(a);
        *traced_at(a->pass, pair.slot, packet) = TRACED;
        any = a->fresh[pair.slot] = true;
    }
    return any;
}

static void trace_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    uint8_t *done = &pass->components->done[LUM_STAGE_MEDIA][packet];
    if (*done != UNTRACED)
        return;
    *done = TRACED;
    if (pass->settings->max_depth == 0) /* and what is kept is black */
        return;
    struct airlight a;
    a.pass = pass;
    a.counters = counters;
    a.r = lum_tile_at(&pass->packets, packet);
    a.rays.n = 0;
    if (!trace_first(&a, packet))
        return;
    memset(a.total, 0, sizeof a.total);
    struct pair pair;
    uint32_t last = UINT32_MAX;
    for (uint32_t i = 0; next_pair(pass, i, &pair); last = pair.slot, i++)
        if (pair.slot != last)
            sum_total(&a, &pair);
    for (uint32_t i = 0; next_pair(pass, i, &pair); i++) {
        if (!pair.alone || !a.fresh[pair.slot])
            continue;
        begin_pair(&a, &pair);
        if (choose_points(&a))
            refine_pair(&a);
    }
}

/* ---- resolve ---- */

/* Depths of rays that see about the same fog. */
static bool same_depth(float a, float b)
{
    return a == b || fabsf(a - b) <= 0.1f * lum_min(a, b);
}

/* Weights of the pixels around one, `step` apart: 5 x 5, half at the ends, so that in steps of 1 each stratum counts
 * once. */
#define WINDOW 5u
struct window {
    uint32_t n;
    uint32_t pixel[WINDOW * WINDOW];
    float weight[WINDOW * WINDOW];
};

/* Beyond an edge of the picture, the pixel of the same stratum a period further in. */
static bool inside(uint32_t at, uint32_t offset, uint32_t size, uint32_t step, uint32_t *ret_at)
{
    int64_t q = (int64_t)at + ((int64_t)offset - 2) * step;
    q += q < 0 ? SIDE * step : q >= size ? -(int64_t)(SIDE * step) : 0;
    *ret_at = (uint32_t)q;
    return q >= 0 && q < size;
}

static struct window window_at(const struct lum_pass *pass, uint32_t x, uint32_t y, uint32_t step)
{
    const float *depth = pass->surfaces->depth;
    uint32_t w = pass->tiling.w, h = pass->tiling.h, qx, qy;
    struct window win = {.n = 0};
    for (uint32_t j = 0; j < WINDOW; j++)
        for (uint32_t i = 0; i < WINDOW; i++) {
            if (!inside(x, i, w, step, &qx) || !inside(y, j, h, step, &qy) ||
                !same_depth(depth[(size_t)y * w + x], depth[(size_t)qy * w + qx]))
                continue;
            win.pixel[win.n] = qy * w + qx;
            win.weight[win.n++] = (i % 4 == 0 ? 0.5f : 1.0f) * (j % 4 == 0 ? 0.5f : 1.0f);
        }
    return win;
}

/* Gauss and Legendre's points and weights on (0, 1): few where the light is far from the ray and all is smooth. */
struct rule {
    uint32_t n;
    float u[6], weight[6];
};
static const struct rule far_rule = {4,
                                     {0.0694318442f, 0.3300094782f, 0.6699905218f, 0.9305681558f},
                                     {0.1739274226f, 0.3260725774f, 0.3260725774f, 0.1739274226f}};
static const struct rule near_rule = {
    6,
    {0.0337652429f, 0.1693953068f, 0.3806904070f, 0.6193095930f, 0.8306046932f, 0.9662347571f},
    {0.0856622462f, 0.1803807865f, 0.2339569673f, 0.2339569673f, 0.1803807865f, 0.0856622462f}};

/* Light that the pair would send to the eye if nothing were in the way, by the light's middle. */
static struct lum_rgb open_light(const struct lum_pass *pass, const struct pair *pair, uint32_t x, uint32_t y)
{
    struct lum_scatter_query q = query_at(pass, pair, x, y);
    struct lum_rgb sum = lum_grey(0.0f);
    struct draw w;
    if (!plan_draw(&q, &w))
        return sum;
    const struct rule *rule = w.by_angle ? &near_rule : &far_rule;
    for (uint32_t k = 0; k < rule->n; k++) {
        struct lum_scatter s;
        float pdf, t = draw_distance(&w, rule->u[k], &pdf);
        if (lum_medium_scatter_at(&q, t, pdf, (struct lum_vec2){0.5f, 0.5f}, &s))
            sum = lum_rgb_mad(sum, s.radiance, rule->weight[k]);
    }
    return sum;
}

/* True when the light's middle tells well what all of it would give, and how that falls off. */
static bool is_sharp(const struct lum_pass *pass, const struct pair *pair)
{
    enum lum_emitter kind = pass->snapshot->lights.lights[pair->light].kind;
    return pair->alone && (kind == LUM_EMIT_POINT || kind == LUM_EMIT_SPOT || kind == LUM_EMIT_SPHERE);
}

/* Mean over the window of what the pair's points see, and of what they would see if nothing were in the way. */
static struct lum_airlight mean_around(const struct lum_pass *pass, const struct pair *pair, const struct window *win)
{
    const struct lum_airlight *kept = &pass->components->airlight[(size_t)pair->slot * pass->tiling.w * pass->tiling.h];
    struct lum_airlight sum = {.open = 0.0f};
    float weight = 0.0f;
    for (uint32_t k = 0; k < win->n; k++) {
        sum.seen = lum_rgb_mad(sum.seen, kept[win->pixel[k]].seen, win->weight[k]);
        sum.open += win->weight[k] * kept[win->pixel[k]].open;
        weight += win->weight[k];
    }
    return (struct lum_airlight){.seen = lum_rgb_scale(sum.seen, 1.0f / weight), .open = sum.open / weight};
}

static struct lum_rgb resolve_pixel(const struct lum_pass *pass, const struct pair *pair, const struct window *win,
                                    uint32_t x, uint32_t y)
{
    struct lum_airlight mean = mean_around(pass, pair, win);
    if (!is_sharp(pass, pair))
        return mean.seen;
    float share = lum_luminance(mean.seen) / mean.open;
    if (!(share > 0.0f)) /* nobody looked, or sees anything */
        return lum_grey(0.0f);
    return lum_rgb_scale(open_light(pass, pair, x, y), lum_min(share, 1.0f));
}

/* Slots that the packet has, in turn, with their pairs that shine; those that were traced since they were resolved. */
struct slots {
    uint32_t n, n_stale;
    struct pair pairs[LUM_AIRLIGHTS_MAX], stale[LUM_AIRLIGHTS_MAX];
};

static struct slots slots_of(const struct lum_pass *pass, uint32_t packet)
{
    struct slots s = {.n = 0};
    struct pair pair;
    for (uint32_t i = 0; next_pair(pass, i, &pair); i++) {
        if (s.n > 0 && s.pairs[s.n - 1].slot == pair.slot)
            continue;
        s.pairs[s.n++] = pair;
        if (*traced_at(pass, pair.slot, packet) == TRACED)
            s.stale[s.n_stale++] = pair;
    }
    return s;
}

/* To `smooth` goes light that takes the ratio, to `raw` all other. */
static void sum_pixel(const struct lum_pass *pass, const struct slots *s, size_t pixel)
{
    const struct lum_components *c = pass->components;
    struct lum_rgb sum[2] = {lum_grey(0.0f), lum_grey(0.0f)};
    for (uint32_t i = 0; i < s->n; i++) {
        const struct pair *pair = &s->pairs[i];
        struct lum_rgb light = c->airlight[(size_t)pair->slot * c->w * c->h + pixel].resolved;
        bool sharp = is_sharp(pass, pair);
        sum[sharp] = lum_rgb_add(sum[sharp], lum_rgb_mul(light, power_of(pass, pair)));
    }
    c->buffer[LUM_COMPONENT_MEDIA].raw[pixel] = sum[0];
    c->buffer[LUM_COMPONENT_MEDIA].smooth[pixel] = sum[1];
}

static void resolve_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    (void)counters;
    uint8_t *done = &pass->components->done[LUM_STAGE_MEDIA][packet];
    if (*done != TRACED)
        return;
    *done = RESOLVED;
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    struct slots slots = slots_of(pass, packet);
    for (uint32_t y = r.y; y < r.y + r.h; y++)
        for (uint32_t x = r.x; x < r.x + r.w; x++) {
            struct lum_components *c = pass->components;
            size_t pixel = (size_t)y * c->w + x;
            struct window win = {.n = 0};
            if (slots.n_stale > 0)
                win = window_at(pass, x, y, 1);
            for (uint32_t i = 0; i < slots.n_stale; i++)
                c->airlight[(size_t)slots.stale[i].slot * c->w * c->h + pixel].resolved =
                    resolve_pixel(pass, &slots.stale[i], &win, x, y);
            sum_pixel(pass, &slots, pixel);
        }
    for (uint32_t i = 0; i < slots.n_stale; i++)
        *traced_at(pass, slots.stale[i].slot, packet) = RESOLVED;
}

static bool any_even(const struct lum_pass *pass)
{
    struct pair pair;
    for (uint32_t i = 0; next_pair(pass, i, &pair); i++)
        if (!is_sharp(pass, &pair))
            return true;
    return false;
}

/* Light without a place changes slowly over the picture: means around are joined once more, over three periods of the
 * pattern. */
#define JOIN_STEP 3u

static void join_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    (void)counters;
    struct lum_component_buffer *b = &pass->components->buffer[LUM_COMPONENT_MEDIA];
    uint8_t *done = &pass->components->done[LUM_STAGE_MEDIA][packet];
    if (*done != RESOLVED)
        return;
    *done = JOINED;
    if (!any_even(pass))
        return;
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    for (uint32_t y = r.y; y < r.y + r.h; y++)
        for (uint32_t x = r.x; x < r.x + r.w; x++) {
            struct window win = window_at(pass, x, y, JOIN_STEP);
            struct lum_rgb sum = lum_grey(0.0f);
            float weight = 0.0f;
            for (uint32_t k = 0; k < win.n; k++) {
                sum = lum_rgb_mad(sum, b->raw[win.pixel[k]], win.weight[k]);
                weight += win.weight[k];
            }
            struct lum_rgb *smooth = &b->smooth[(size_t)y * pass->tiling.w + x];
            *smooth = lum_rgb_mad(*smooth, sum, 1.0f / weight);
        }
}

static const struct lum_estimator join_stage = {
    .name = "airlight, join", .stage = LUM_STAGE_UPSAMPLE, .tile = join_packet, .packets = true, .surfaces = true};
static const struct lum_estimator resolve_stage = {.name = "airlight, resolve",
                                                   .stage = LUM_STAGE_FILTER,
                                                   .tile = resolve_packet,
                                                   .packets = true,
                                                   .surfaces = true,
                                                   .then = &join_stage};

const struct lum_estimator lum_estimator_airlight = {
    .name = "airlight",
    .stage = LUM_STAGE_MEDIA,
    .tile = trace_packet,
    .packets = true,
    .components = LUM_COMPONENT_BIT(LUM_COMPONENT_MEDIA),
    .surfaces = true,
    .then = &resolve_stage,
};
