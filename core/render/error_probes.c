#include "core/render/error_probes.h"

#include <string.h>

#include "core/math/sampler.h"
#include "core/pass/share.h"
#include "core/path/wave.h"
#include "core/render/error_places.h"

/* Noise of n pairs of paths leaves its square over n in what a probe says; what is far off in few pixels is found by
 * many probes. So both grow: n pairs in each of PER_PAIR * n probes, until there is no room for more. (To measure which
 * of the two is worse, and grow by that, was worse itself: outliers make noise look larger than it is in the mean.) */
#define PER_PAIR 256u
#define MAX_PROBES 4096u /* of 16 pairs each. Fewer: what few pixels have is missed; more: memory and time */

/* Fewer probes say nothing: what a tenth of them would meet, all of these miss in 3 % of the draws. And few may all
 * have missed the worst: of n the deviation is taken to be 1 + 16 / n times what they say. Simulated as in
 * error_places.c, of first frames of nine methods, 64 x 48, a pair each: in 17 scenes 32 cover 98.8 % and 64 99.0 %,
 * and bounds are 3.6 and 2.9 times the error in the median; without it 97.4 and 98.5 %. */
#define FEWEST 32u
#define PLUS 16.0

/* Deviations above the estimate that the bound is: 99 % of a normal variable. Squared errors have tails so long that
 * their deviation is mostly estimated too low: with those of 95 %, 90 % of the pictures of `office` were covered (96 x
 * 64, at rest), with these 96 %. */
#define SURE 2.33

#define KEEP 0.7 /* of what a picture's error was measured by counts for the next one: about the last three count */

#define FIRST_RAYS_PER_PATH 8.0 /* until it is known */
#define JOB_PAIRS (LUM_RAY_BATCH / 2)
#define MAX_BATCH 1e6          /* probes: a count that no pass affords */
#define PROBE_SEED 0x70726f62u /* "prob": not the numbers of the picture's own samples */

struct probe {
    uint32_t x, y, near;
    float weight;     /* 1 / (chance * number of pixels): 1 where all are drawn alike */
    uint32_t n_begun; /* pairs */
    uint32_t n;       /* of these, in the sums */
    double sum[2];    /* of luminance, by the paths' place in their pair */
};

struct pair {
    uint32_t probe, sample;
    float y[2]; /* luminance */
    bool traced, sound;
};

/* Of squared errors over the squared mean luminance of their pictures. */
struct moments {
    double n, sum, sum2, sum3;
};

struct lum_error_probes {
    uint32_t n_pictures;
    uint32_t n, n_each; /* probes, and how many pairs each of them is to get; before next all have them */
    uint32_t next;
    uint64_t n_done;               /* paths of this picture */
    double rays, paths;            /* so far */
    double credit;                 /* rays that were allowed and not traced */
    struct moments before;         /* of the pictures before this one */
    struct moments now;            /* of this one, when it was last looked at */
    struct moments first;          /* the same before it was bettered */
    struct lum_counters *counters; /* by worker */
    struct pair *batch;
    uint32_t max_batch;
    struct lum_error_looks looks;
    struct probe probes[MAX_PROBES];
};

enum lum_status lum_error_probes_create(uint32_t n_workers, struct lum_error_probes **ret_probes, struct lum_error *err)
{
    struct lum_error_probes *p = lum_calloc(1, sizeof *p);
    struct lum_counters *counters = lum_calloc(n_workers, sizeof *counters);
    if (!p || !counters) {
        lum_free(p);
        lum_free(counters);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for measuring the error");
    }
    p->counters = counters;
    *ret_probes = p;
    return LUM_OK;
}

void lum_error_probes_destroy(struct lum_error_probes *p)
{
    if (!p)
        return;
    lum_free(p->counters);
    lum_free(p->batch);
    lum_error_looks_finish(&p->looks);
    lum_free(p);
}

static float luminance_at(const struct lum_film *f, uint32_t x, uint32_t y)
{
    return lum_luminance(lum_film_mean(f, x, y));
}

/* ---- their paths ---- */

static bool draw_probes(struct lum_error_probes *p, const struct lum_film *f, uint32_t seed)
{
    struct lum_error_place places[LUM_ERROR_PLACES];
    if (lum_error_places_draw(&p->looks, f, seed, p->n / LUM_ERROR_PLACES, places) != LUM_OK)
        return false;
    uint32_t near = p->n / LUM_ERROR_NEAR;
    for (uint32_t i = 0; i < LUM_ERROR_PLACES; i++)
        p->probes[p->n++] = (struct probe){
            .x = places[i].x, .y = places[i].y, .near = near + places[i].near, .weight = places[i].weight};
    return true;
}

/* The probe that gets the next pair: one that has fewer than n_each, or a new one. False: out of memory. */
static bool find_next(struct lum_error_probes *p, const struct lum_film *f, uint32_t seed)
{
    while (p->next < p->n && p->probes[p->next].n_begun >= p->n_each)
        p->next++;
    if (p->next < p->n)
        return true;
    if (p->n < MAX_PROBES && p->n < p->n_each * PER_PAIR)
        return draw_probes(p, f, seed);
    p->n_each = p->n_each > 0 ? 2 * p->n_each : 1;
    p->next = 0;
    return find_next(p, f, seed);
}

static bool plan(struct lum_error_probes *p, const struct lum_pass *pass, uint32_t seed, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        if (!find_next(p, pass->film, seed))
            return false;
        p->batch[i] = (struct pair){.probe = p->next, .sample = p->probes[p->next].n_begun++};
    }
    return true;
}

struct tracing {
    struct lum_error_probes *p;
    const struct lum_pass *pass;
    uint32_t seed, n;
};

static uint32_t n_pairs(const struct tracing *t, uint32_t job)
{
    uint32_t rest = t->n - job * JOB_PAIRS;
    return rest < JOB_PAIRS ? rest : JOB_PAIRS;
}

/* Those of a probe that are first in their pair are a sequence, the others another one: that spreads each well. */
static size_t trace_job(void *ctx, uint32_t job, void *left, struct lum_counters *counters)
{
    const struct tracing *t = ctx;
    const struct lum_pass *pass = t->pass;
    uint32_t n = n_pairs(t, job);
    struct pair *pairs = t->p->batch + job * JOB_PAIRS;
    struct lum_wave w;
    lum_wave_begin(&w, pass->snapshot, counters, pass->settings->max_depth, lum_pass_effects_off(pass));
    w.illuminance = pass->settings->illuminance;
    w.portals = pass->portals;
    for (uint32_t i = 0; i < 2 * n; i++) {
        const struct probe *probe = &t->p->probes[pairs[i / 2].probe];
        struct lum_sampler sampler = lum_sampler_at(pairs[i / 2].probe, i % 2, pairs[i / 2].sample, t->seed);
        struct lum_vec2 at = {0.5f, 0.5f};
        if (lum_pass_antialiased(pass))
            at = lum_sampler_2d(&sampler, LUM_WAVE_PAIR_PIXEL);
        lum_wave_add_eye(&w, i, sampler, pass->eye.o,
                         lum_eye_direction(&pass->eye, (float)probe->x + at.x, (float)probe->y + at.y));
    }
    lum_wave_run(&w, 0);
    for (uint32_t i = 0; i < n; i++) {
        pairs[i].y[0] = lum_luminance(w.radiance[2 * i]);
        pairs[i].y[1] = lum_luminance(w.radiance[2 * i + 1]);
        pairs[i].traced = true;
        pairs[i].sound = isfinite(pairs[i].y[0]) && isfinite(pairs[i].y[1]);
        counters->nonfinite += !pairs[i].sound;
    }
    if (left)
        memcpy(left, pairs, n * sizeof *pairs);
    return n * sizeof *pairs;
}

static void take_pairs_over(void *ctx, uint32_t job, const void *left, uint32_t worker)
{
    (void)worker;
    const struct tracing *t = ctx;
    memcpy(t->p->batch + job * JOB_PAIRS, left, n_pairs(t, job) * sizeof(struct pair));
}

/* In the order of pairs, so that sums do not depend on threads. */
static void take(struct lum_error_probes *p, uint32_t n, const struct lum_stage_runner *runner)
{
    for (uint32_t i = 0; i < n; i++) {
        p->n_done += p->batch[i].traced ? 2 : 0;
        if (!p->batch[i].sound)
            continue;
        struct probe *probe = &p->probes[p->batch[i].probe];
        probe->n++;
        probe->sum[0] += (double)p->batch[i].y[0];
        probe->sum[1] += (double)p->batch[i].y[1];
        p->paths += 2.0;
    }
    for (uint32_t w = 0; w < lum_pool_size(runner->pool); w++) {
        uint64_t rays = 0;
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
            rays += p->counters[w].rays[k];
        runner->counters[w].rays[LUM_RAY_PROBE] += rays;
        runner->counters[w].nonfinite += p->counters[w].nonfinite;
        runner->counters[w].bad_rays += p->counters[w].bad_rays;
        p->rays += (double)rays;
        p->credit -= (double)rays;
    }
}

static bool reserve(struct lum_error_probes *p, uint32_t n)
{
    if (n <= p->max_batch)
        return true;
    struct pair *batch = lum_calloc(n, sizeof *batch);
    if (!batch)
        return false;
    lum_free(p->batch);
    p->batch = batch;
    p->max_batch = n;
    return true;
}

enum lum_status lum_error_probes_trace(struct lum_error_probes *p, const struct lum_pass *pass, uint64_t max_rays,
                                       const struct lum_stage_runner *runner)
{
    if (max_rays == 0)
        return LUM_OK;
    double per_path = p->paths > 0.0 ? p->rays / p->paths : FIRST_RAYS_PER_PATH;
    /* What is left over is for the next call; were it not at least a pair, a small picture would never get one. */
    p->credit = fmin(p->credit, fmax((double)max_rays, 2.0 * per_path)) + (double)max_rays;
    uint32_t n = (uint32_t)fmax(0.0, fmin(p->credit / (2.0 * per_path), MAX_BATCH));
    if (n == 0)
        return LUM_OK;
    if (!reserve(p, n))
        return LUM_ERR_NOMEM;
    uint32_t seed = lum_hash_combine(lum_hash_u32(pass->settings->seed ^ PROBE_SEED), p->n_pictures);
    if (!plan(p, pass, seed, n))
        return LUM_ERR_NOMEM;
    memset(p->counters, 0, lum_pool_size(runner->pool) * sizeof *p->counters);
    struct tracing tracing = {p, pass, seed, n};
    struct lum_stage_runner apart = *runner;
    apart.counters = p->counters;
    const struct lum_shared_loop loop = {(n + JOB_PAIRS - 1) / JOB_PAIRS, JOB_PAIRS * sizeof(struct pair), trace_job,
                                         take_pairs_over, &tracing};
    enum lum_status status = lum_stage_share(&apart, &loop);
    take(p, n, runner);
    return status;
}

/* ---- what they say ---- */

static void add_moments(struct moments *m, const struct moments *more, double weight)
{
    m->n += weight * more->n;
    m->sum += weight * more->sum;
    m->sum2 += weight * more->sum2;
    m->sum3 += weight * more->sum3;
}

/* Of every few pixels: all of them take longer than the probes. */
static double mean_luminance(const struct lum_film *f)
{
    uint32_t step = 1, n = 0;
    while ((uint64_t)f->w * f->h / ((uint64_t)step * step) > 65536)
        step++;
    double sum = 0.0;
    for (uint32_t y = step / 2; y < f->h; y += step)
        for (uint32_t x = step / 2; x < f->w; x += step, n++)
            sum += (double)luminance_at(f, x, y);
    return n > 0 ? sum / n : 0.0;
}

/* Squared error of what the picture shows at a probe that has paths. */
static double square_at(const struct probe *probe, const struct lum_film *film)
{
    double b = (double)luminance_at(film, probe->x, probe->y);
    return (b - probe->sum[0] / probe->n) * (b - probe->sum[1] / probe->n);
}

/* What the halves of a probe's paths are off by, squared: its noise is in it. */
static double noisy_square_at(const struct probe *probe, const struct lum_film *film)
{
    double b = (double)luminance_at(film, probe->x, probe->y);
    double d0 = b - probe->sum[0] / probe->n, d1 = b - probe->sum[1] / probe->n;
    return 0.5 * (d0 * d0 + d1 * d1);
}

/* Of neighbours. */
struct neighbours {
    double sum, n;
};

/* (b - y1)(b - y2) is large where both halves met what is rare, and that is rarer by far: few probes may all have
 * missed it, and their squares then tell too small a deviation. With c = E (b - y)^2 of one half the product has the
 * mean square c^2, and c is known well long before, from either half. c is a pixel's own; taken from neighbours
 * together, as the square of their mean, it is less than of each where they differ: the larger of both counts.
 * Simulated as in error_places.c: 97 % are covered with it, 92 % without, and bounds are a fifth wider in the mean. */
static struct moments moments_of(const struct lum_error_probes *p, const struct lum_film *film, double mean)
{
    struct neighbours near[MAX_PROBES / LUM_ERROR_NEAR] = {0};
    struct moments m = {0};
    double pooled2 = 0.0;
    for (uint32_t i = 0; i < p->n; i++) {
        const struct probe *probe = &p->probes[i];
        if (probe->n == 0)
            continue;
        double weight = (double)probe->weight / (mean * mean), square = square_at(probe, film) * weight;
        m.n++;
        m.sum += square;
        m.sum2 += square * square;
        m.sum3 += square * square * square;
        near[probe->near].sum += noisy_square_at(probe, film) * weight;
        near[probe->near].n++;
    }
    for (uint32_t i = 0; i < LUM_ARRAY_LEN(near); i++)
        pooled2 += near[i].n > 0.0 ? near[i].sum * near[i].sum / near[i].n : 0.0;
    m.sum2 = fmax(m.sum2, pooled2);
    return m;
}

void lum_error_probes_begin(struct lum_error_probes *p, bool alike)
{
    struct moments before = {0};
    if (alike) {
        add_moments(&before, &p->before, KEEP);
        add_moments(&before, &p->first, KEEP);
    }
    p->before = before;
    p->now = p->first = (struct moments){0};
    p->n_pictures++;
    p->n = p->n_each = p->next = 0;
    p->n_done = 0;
}

void lum_error_probes_note(struct lum_error_probes *p)
{
    p->first = p->now;
}

uint64_t lum_error_probes_paths(const struct lum_error_probes *p)
{
    return p->n_done;
}

double lum_error_probes_known(const struct lum_error_probes *p)
{
    return p->now.n + p->before.n;
}

struct lum_film_error lum_error_probes_error(struct lum_error_probes *p, const struct lum_film *film)
{
    double mean = mean_luminance(film);
    if (!(mean > 0.0))
        return LUM_FILM_ERROR_UNKNOWN;
    struct moments m = moments_of(p, film, mean);
    p->now = isfinite(m.sum3) ? m : (struct moments){0};
    double own = m.n;
    add_moments(&m, &p->before, 1.0);
    if (m.n < FEWEST || !isfinite(m.sum3))
        return LUM_FILM_ERROR_UNKNOWN;
    /* Few probes find what is far off: the sum of squares is as skewed as a count of rare things is, and low where its
     * deviation is estimated low. To the first order in 1 / sqrt(n) of Edgeworth's expansion the studentised mean
     * passes below -k as often as a normal variable does, if skew (1 + 2 k^2) / (6 sqrt(n)) is added to k (Johnson
     * 1978). */
    double e = m.sum / m.n, variance = fmax(m.sum2 / m.n - e * e, 0.0), deviation = sqrt(variance / m.n);
    double third = m.sum3 / m.n - 3.0 * e * m.sum2 / m.n + 2.0 * e * e * e;
    double skew = variance > 0.0 ? fmax(third / (variance * sqrt(variance)), 0.0) : 0.0;
    double k = (SURE + skew * (1.0 + 2.0 * SURE * SURE) / (6.0 * sqrt(m.n))) * (1.0 + PLUS / m.n);
    double most = fmax(e, 0.0) + k * deviation;
    return (struct lum_film_error){.rel = sqrt(fmax(e, 0.0)), .bound = sqrt(most), .probes = own, .fresh = own / m.n};
}

void lum_error_probes_add_errors(const struct lum_error_probes *p, const struct lum_film *film,
                                 struct lum_error_map *map)
{
    for (uint32_t i = 0; i < p->n; i++)
        if (p->probes[i].n > 0)
            lum_error_map_add(map, p->probes[i].x, p->probes[i].y, square_at(&p->probes[i], film),
                              (double)p->probes[i].weight);
}
