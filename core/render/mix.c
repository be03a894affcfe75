#include "core/render/mix.h"

#include <float.h>

#include "core/vpl/share.h"

void lum_mix_finish(struct lum_mix *m)
{
    lum_snapshot_unref(m->start);
    lum_snapshot_unref(m->end);
    lum_snapshot_unref(m->shown);
    lum_free(m->from);
    lum_free(m->to);
    *m = (struct lum_mix){0};
}

/* ---- how far ---- */

/* What a fade rounds a power by, over the larger of its ends, and what the share itself is off by: 1 - share, both
 * products and the sum are floats, each off by half of FLT_EPSILON, and as much again is in the share, as it is told by
 * that lamp whose way is longest for what it gives. */
#define ROUNDED (8.0 * (double)FLT_EPSILON)

static void powers_of(const struct lum_snapshot *s, uint32_t i, double ret[3])
{
    struct lum_rgb p = lum_light_present_power(&s->lights, i);
    ret[0] = (double)p.r, ret[1] = (double)p.g, ret[2] = (double)p.b;
}

/* One primary of a lamp. */
struct way {
    double from, to, now;
};

static double length_of(const struct way *w)
{
    double largest = fmax(w->from, w->to);
    return largest > 0.0 ? fabs(w->to - w->from) / largest : 0.0;
}

static bool has_gone(const struct way *w, double share)
{
    double there = w->from + share * (w->to - w->from);
    return fabs(w->now - there) <= ROUNDED * fmax(w->from, w->to);
}

static struct way way_of(const struct lum_snapshot *start, const struct lum_snapshot *end,
                         const struct lum_snapshot *now, uint32_t k)
{
    double from[3], to[3], at[3];
    powers_of(start, k / 3, from);
    powers_of(end, k / 3, to);
    powers_of(now, k / 3, at);
    return (struct way){from[k % 3], to[k % 3], at[k % 3]};
}

double lum_mix_share(const struct lum_snapshot *start, const struct lum_snapshot *end, const struct lum_snapshot *now)
{
    uint32_t n = 3 * now->lights.n_lights;
    double longest = 0.0, share = (double)NAN;
    if (start->lights.n_lights != now->lights.n_lights || end->lights.n_lights != now->lights.n_lights)
        return (double)NAN;
    for (uint32_t k = 0; k < n; k++) {
        struct way w = way_of(start, end, now, k);
        if (!(length_of(&w) > longest))
            continue;
        longest = length_of(&w);
        share = (w.now - w.from) / (w.to - w.from);
    }
    if (!(share >= 0.0 && share <= 1.0))
        return (double)NAN;
    for (uint32_t k = 0; k < n; k++) {
        struct way w = way_of(start, end, now, k);
        if (!has_gone(&w, share))
            return (double)NAN;
    }
    return share;
}

/* ---- both pictures ---- */

static void copy_film(const struct lum_film *f, struct lum_rgb *ret)
{
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 0; x < f->w; x++)
            ret[(size_t)y * f->w + x] = lum_film_mean(f, x, y);
}

bool lum_mix_begin(struct lum_mix *m, const struct lum_film *film, const struct lum_snapshot *start)
{
    const struct lum_snapshot *held = lum_snapshot_ref(start); /* it may be m's own */
    size_t n = (size_t)film->w * film->h;
    lum_mix_finish(m);
    m->start = held;
    m->from = lum_calloc(n, sizeof *m->from);
    m->to = lum_calloc(n, sizeof *m->to);
    if (!m->from || !m->to) {
        lum_mix_finish(m);
        return false;
    }
    copy_film(film, m->from);
    return true;
}

void lum_mix_take_end(struct lum_mix *m, const struct lum_film *film, const struct lum_snapshot *end)
{
    lum_snapshot_unref(m->end);
    m->end = lum_snapshot_ref(end);
    copy_film(film, m->to);
}

struct mixing {
    const struct lum_mix *mix;
    const struct lum_pass *pass;
    float share;
};

static void mix_tile(void *ctx, uint32_t tile, struct lum_counters *counters)
{
    const struct mixing *job = ctx;
    const struct lum_pass *pass = job->pass;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    float to = job->share, from = 1.0f - to;
    for (uint32_t y = r.y; y < r.y + r.h; y++)
        for (uint32_t x = r.x; x < r.x + r.w; x++) {
            size_t i = (size_t)y * pass->tiling.w + x;
            struct lum_rgb sum = lum_rgb_mad(lum_rgb_scale(job->mix->from[i], from), job->mix->to[i], to);
            lum_film_set(pass->film, x, y, sum, &counters->nonfinite);
        }
    pass->tile_spp[tile] = pass->target_spp;
}

enum lum_status lum_mix_show(struct lum_mix *m, const struct lum_pass *pass, double share,
                             const struct lum_stage_runner *runner)
{
    int64_t begin_ns = lum_clock_ns();
    struct mixing job = {m, pass, (float)share};
    const struct lum_snapshot *held = lum_snapshot_ref(pass->snapshot);
    lum_snapshot_unref(m->shown);
    m->shown = held;
    enum lum_status status = lum_stage_loop(runner, pass->tiling.n, mix_tile, &job);
    runner->stats->stage_ms[LUM_STAGE_COMPOSITE] += (double)(lum_clock_ns() - begin_ns) * 1e-6;
    return status;
}
