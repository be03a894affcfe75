#include "core/render/error_probes.h"

#include <string.h>

#include "core/math/sampler.h"
#include "core/pass/share.h"
#include "core/path/wave.h"

/* Noise of n pairs of paths leaves its square over n in what a probe says; what is far off in few pixels is found by
 * many probes. So both grow: n pairs in each of PER_PAIR * n probes, until there is no room for more. (To measure which
 * of the two is worse, and grow by that, was worse itself: outliers make noise look larger than it is in the mean.) */
#define PER_PAIR 256u
#define MAX_PROBES 4096u /* of 16 pairs each. Fewer: what few pixels have is missed; more: memory and time */
#define ENOUGH 256u      /* of fewer the deviation is not known: they may all have missed what is far off */

/* Deviations above the estimate that the bound is: 99 % of a normal variable. Squared errors have tails so long that
 * their deviation is mostly estimated too low: with those of 95 %, 90 % of the pictures of `office` were covered (96 x
 * 64, at rest), with these 96 %. */
#define SURE 2.33

/* Probes are drawn from candidates, BLOCK_PROBES from BLOCK, which are drawn alike: with a chance of a
 * third each for being one, for the square of the light that the picture has there, and for that of its contrast, as
 * pictures are off most where they are bright, and at edges; at most 1. Looking at five pixels a candidate takes a
 * third of the time of a probe's first two paths. */
#define BLOCK 512u
#define BLOCK_PROBES 64u

#define KEEP 0.7 /* of what a picture's error was measured by counts for the next one: about the last three count */

#define FIRST_RAYS_PER_PATH 8.0 /* until it is known */
#define JOB_PAIRS (LUM_RAY_BATCH / 2)
#define MAX_BATCH 1e6          /* probes: a count that no pass affords */
#define PROBE_SEED 0x70726f62u /* "prob": not the numbers of the picture's own samples */

struct probe {
    uint32_t x, y;
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
    lum_free(p);
}

static float luminance_at(const struct lum_film *f, uint32_t x, uint32_t y)
{
    return lum_luminance(lum_film_mean(f, x < f->w ? x : f->w - 1, y < f->h ? y : f->h - 1));
}

/* ---- which pixels ---- */

/* Of a pixel: its squared luminance, and the squared difference of the brightest and the darkest of it and its four
 * neighbours. */
struct look {
    double light, detail;
};

static struct look look_at(const struct lum_film *f, uint32_t x, uint32_t y)
{
    float around[5] = {luminance_at(f, x, y), luminance_at(f, x > 0 ? x - 1 : 0, y), luminance_at(f, x + 1, y),
                       luminance_at(f, x, y > 0 ? y - 1 : 0), luminance_at(f, x, y + 1)};
    float least = around[0], most = around[0];
    for (int i = 1; i < 5; i++) {
        least = lum_min(least, around[i]);
        most = lum_max(most, around[i]);
    }
    double apart = (double)most - (double)least;
    return (struct look){(double)around[0] * (double)around[0], apart * apart};
}

struct candidates {
    uint32_t x[BLOCK], y[BLOCK];
    float chance[BLOCK]; /* before it is scaled: the mass */
};

/* Scales masses so that chances of at most 1 add up to BLOCK_PROBES. Each round makes some 1, and gives the others what
 * these had too much; few are needed, as few candidates have nearly all the mass. */
static void find_chances(struct candidates *c)
{
    for (int round = 0; round < 16; round++) {
        double mass = 0.0;
        uint32_t n_sure = 0;
        for (uint32_t i = 0; i < BLOCK; i++) {
            n_sure += c->chance[i] >= 1.0f;
            mass += c->chance[i] >= 1.0f ? 0.0 : (double)c->chance[i];
        }
        double scale = mass > 0.0 ? (double)(BLOCK_PROBES - n_sure) / mass : 1.0;
        if (fabs(scale - 1.0) < 1e-6) /* off by a probe in 15 thousand blocks */
            return;
        for (uint32_t i = 0; i < BLOCK; i++)
            if (c->chance[i] < 1.0f)
                c->chance[i] = lum_min((float)((double)c->chance[i] * scale), 1.0f);
    }
}

static void draw_candidates(const struct lum_error_probes *p, const struct lum_film *f, uint32_t seed,
                            struct candidates *ret)
{
    struct look looks[BLOCK];
    double light = 0.0, detail = 0.0; /* all of it */
    for (uint32_t i = 0; i < BLOCK; i++) {
        struct lum_sampler s = lum_sampler_at(p->n, i, 1, seed);
        struct lum_vec2 at = lum_sampler_2d(&s, 0);
        ret->x[i] = (uint32_t)(at.x * (float)f->w) % f->w;
        ret->y[i] = (uint32_t)(at.y * (float)f->h) % f->h;
        looks[i] = look_at(f, ret->x[i], ret->y[i]);
        light += looks[i].light;
        detail += looks[i].detail;
    }
    for (uint32_t i = 0; i < BLOCK; i++) {
        double mass = 1.0 / BLOCK;
        if (light > 0.0)
            mass += looks[i].light / light;
        if (detail > 0.0)
            mass += looks[i].detail / detail;
        ret->chance[i] = (float)(0.33 * mass); /* below 1, whatever is rounded */
    }
    find_chances(ret);
}

/* BLOCK_PROBES more: where the running sum of chances passes a whole number and a random part. */
static void draw_block(struct lum_error_probes *p, const struct lum_film *f, uint32_t seed)
{
    struct candidates c;
    draw_candidates(p, f, seed, &c);
    struct lum_sampler s = lum_sampler_at(p->n, BLOCK, 1, seed);
    double next = (double)lum_sampler_1d(&s, 0), sum = 0.0;
    for (uint32_t i = 0; i < BLOCK; i++) {
        sum += (double)c.chance[i];
        if (sum <= next || p->n == MAX_PROBES)
            continue;
        next += 1.0;
        p->probes[p->n++] =
            (struct probe){.x = c.x[i], .y = c.y[i], .weight = (float)BLOCK_PROBES / BLOCK / c.chance[i]};
    }
}

/* ---- their paths ---- */

static void grow(struct lum_error_probes *p, const struct lum_film *f, uint32_t seed)
{
    p->next = 0;
    p->n_each = p->n_each > 0 ? 2 * p->n_each : 1;
    uint32_t wanted = p->n_each < MAX_PROBES / PER_PAIR ? p->n_each * PER_PAIR : MAX_PROBES;
    while (p->n < wanted)
        draw_block(p, f, seed);
}

static void plan(struct lum_error_probes *p, const struct lum_pass *pass, uint32_t seed, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        while (p->next == p->n || p->probes[p->next].n_begun >= p->n_each)
            if (p->next == p->n)
                grow(p, pass->film, seed);
            else
                p->next++;
        p->batch[i] = (struct pair){.probe = p->next, .sample = p->probes[p->next].n_begun++};
    }
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
    plan(p, pass, seed, n);
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

static struct moments moments_of(const struct lum_error_probes *p, const struct lum_film *film, double mean)
{
    struct moments m = {0};
    for (uint32_t i = 0; i < p->n; i++) {
        const struct probe *probe = &p->probes[i];
        if (probe->n == 0)
            continue;
        double square = square_at(probe, film) * (double)probe->weight / (mean * mean);
        m.n++;
        m.sum += square;
        m.sum2 += square * square;
        m.sum3 += square * square * square;
    }
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

struct lum_film_error lum_error_probes_error(struct lum_error_probes *p, const struct lum_film *film)
{
    double mean = mean_luminance(film);
    if (!(mean > 0.0))
        return LUM_FILM_ERROR_UNKNOWN;
    struct moments m = moments_of(p, film, mean);
    p->now = isfinite(m.sum3) ? m : (struct moments){0};
    double own = m.n;
    add_moments(&m, &p->before, 1.0);
    if (m.n < ENOUGH || !isfinite(m.sum3))
        return LUM_FILM_ERROR_UNKNOWN;
    /* Few probes find what is far off: the sum of squares is as skewed as a count of rare things is, and low where its
     * deviation is estimated low. To the first order in 1 / sqrt(n) of Edgeworth's expansion the studentised mean
     * passes below -k as often as a normal variable does, if skew (1 + 2 k^2) / (6 sqrt(n)) is added to k (Johnson
     * 1978). */
    double e = m.sum / m.n, variance = fmax(m.sum2 / m.n - e * e, 0.0), deviation = sqrt(variance / m.n);
    double third = m.sum3 / m.n - 3.0 * e * m.sum2 / m.n + 2.0 * e * e * e;
    double skew = variance > 0.0 ? fmax(third / (variance * sqrt(variance)), 0.0) : 0.0;
    double k = SURE + skew * (1.0 + 2.0 * SURE * SURE) / (6.0 * sqrt(m.n));
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
