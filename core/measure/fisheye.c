#include "core/measure/fisheye.h"

#include <string.h>

#include "core/math/sampler.h"
#include "core/math/warp.h"
#include "core/measure/position_index.h"
#include "core/pass/settings.h"
#include "core/path/wave.h"

#define MERGED_RAD 0.2
#define SOURCES_MAX 512u /* discs of 0.1 rad leave room for 200 on the hemisphere, twice: peaks are apart */
#define CELLS_MAX (LUM_FISHEYE_SIDE * LUM_FISHEYE_SIDE)
#define HEMISPHERE_SR (2.0 * 3.14159265358979323846)

struct lum_fisheye {
    uint32_t side, round, next; /* the cell whose turn it is */
    uint64_t n_paths;
    float *half[2]; /* sums of luminance, cd/m2, of the rounds of each */
};

enum lum_status lum_fisheye_create(struct lum_fisheye **ret, struct lum_error *err)
{
    struct lum_fisheye *f = lum_calloc(1, sizeof *f);
    if (f)
        for (int h = 0; h < 2; h++)
            f->half[h] = lum_calloc(CELLS_MAX, sizeof *f->half[h]);
    if (!f || !f->half[0] || !f->half[1]) {
        lum_fisheye_destroy(f);
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for what an eye sees");
    }
    *ret = f;
    return LUM_OK;
}

void lum_fisheye_destroy(struct lum_fisheye *f)
{
    if (!f)
        return;
    lum_free(f->half[0]);
    lum_free(f->half[1]);
    lum_free(f);
}

enum lum_status lum_fisheye_copy(const struct lum_fisheye *of, struct lum_fisheye **ret, struct lum_error *err)
{
    enum lum_status st = lum_fisheye_create(ret, err);
    if (st)
        return st;
    struct lum_fisheye *f = *ret;
    for (int h = 0; h < 2; h++)
        memcpy(f->half[h], of->half[h], CELLS_MAX * sizeof *f->half[h]);
    f->side = of->side;
    f->round = of->round;
    f->next = of->next;
    f->n_paths = of->n_paths;
    return LUM_OK;
}

void lum_fisheye_begin(struct lum_fisheye *f, uint32_t side)
{
    f->side = side;
    f->round = f->next = 0;
    f->n_paths = 0;
    for (int h = 0; h < 2; h++)
        memset(f->half[h], 0, CELLS_MAX * sizeof *f->half[h]);
}

uint64_t lum_fisheye_paths(const struct lum_fisheye *f)
{
    return f->n_paths;
}

uint32_t lum_fisheye_rounds(const struct lum_fisheye *f)
{
    return f->next > 0 || f->round % 2 > 0 ? 0 : f->round / 2;
}

/* ---- paths ---- */

/* Where the eye looks: frame.n is the line of sight. */
static struct lum_frame frame_of(const struct lum_observer *o)
{
    struct lum_frame f;
    f.n = lum_normalize(o->direction);
    f.b = lum_observer_upright(f.n);
    f.t = lum_cross(f.n, f.b);
    return f;
}

/* Of a point of the unit square; equal areas are equal solid angles (Lambert's azimuthal projection). */
static struct lum_vec3 direction_at(const struct lum_frame *f, float x, float y)
{
    struct lum_vec2 d = lum_warp_disc((struct lum_vec2){x, y});
    float r2 = lum_min(d.x * d.x + d.y * d.y, 1.0f), k = sqrtf(2.0f - r2);
    return lum_frame_to_scene(f, lum_v3(k * d.x, k * d.y, 1.0f - r2));
}

struct tracing {
    struct lum_fisheye *eye;
    const struct lum_snapshot *snapshot;
    struct lum_vec3 from;
    struct lum_frame frame;
    uint32_t n, seed;
};

/* No two jobs of a slice have a cell in common: a slice is of one round. */
static void trace_job(void *ctx, uint32_t job, uint32_t worker)
{
    (void)worker;
    const struct tracing *t = ctx;
    const struct lum_fisheye *f = t->eye;
    uint32_t begin = job * LUM_RAY_BATCH, end = begin + LUM_RAY_BATCH;
    end = end < t->n ? end : t->n;
    struct lum_counters counters = {0};
    struct lum_wave w;
    lum_wave_begin(&w, t->snapshot, &counters, LUM_DEPTH_DEFAULT, 0);
    w.every_light = t->snapshot->lights.n_active <= LUM_WAVE_LIGHTS;
    w.lamps_apart = true;
    w.apart_cd_m2 = (float)LUM_DGP_PEAK_CD_M2;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t cell = f->next + i;
        struct lum_sampler sampler = lum_sampler_halves(cell, f->side, f->round, t->seed);
        struct lum_vec2 u = lum_sampler_2d(&sampler, LUM_WAVE_PAIR_PIXEL);
        float x = ((float)(cell % f->side) + u.x) / (float)f->side,
              y = ((float)(cell / f->side) + u.y) / (float)f->side;
        lum_wave_add_eye(&w, i - begin, sampler, t->from, direction_at(&t->frame, x, y));
    }
    lum_wave_run(&w, 1); /* no first segment of a picture, in which some lights may not be seen */
    for (uint32_t i = begin; i < end; i++) {
        float cd_m2 = lum_luminance(w.radiance[i - begin]);
        f->half[f->round % 2][f->next + i] += isfinite(cd_m2) ? cd_m2 : 0.0f;
    }
}

void lum_fisheye_trace(struct lum_fisheye *f, const struct lum_snapshot *snapshot, const struct lum_observer *observer,
                       struct lum_pool *pool, uint32_t n, uint32_t seed)
{
    uint32_t n_cells = f->side * f->side, left = n_cells - f->next;
    struct tracing t = {.eye = f,
                        .snapshot = snapshot,
                        .from = lum_world_to_scene(&snapshot->norm, observer->eye_world),
                        .frame = frame_of(observer),
                        .n = n < left ? n : left,
                        .seed = seed};
    (void)lum_pool_run(pool, (t.n + LUM_RAY_BATCH - 1) / LUM_RAY_BATCH, trace_job, &t, NULL); /* nobody cancels it */
    f->next += t.n;
    f->n_paths += t.n;
    if (f->next < n_cells)
        return;
    f->next = 0;
    f->round++;
}

/* ---- sources ---- */

struct source {
    bool peak;
    double solid_angle, weighted; /* sr; cd/m2 sr */
    double variance;              /* of the latter */
    struct lum_vec3 middle;       /* not unit */
};

struct sources {
    struct source list[SOURCES_MAX];
    uint32_t n;
};

/* What a cell adds: half of it for each half that finds it bright, with the luminance that the other has. */
static bool describe(const double cd_m2[2], double cell_sr, struct source *ret)
{
    bool bright[2];
    *ret = (struct source){0};
    for (int h = 0; h < 2; h++) {
        bright[h] = cd_m2[h] > LUM_DGP_SOURCE_CD_M2;
        ret->peak = ret->peak || cd_m2[h] > LUM_DGP_PEAK_CD_M2;
        if (!bright[h])
            continue;
        ret->solid_angle += 0.5 * cell_sr;
        ret->weighted += 0.5 * cell_sr * cd_m2[1 - h];
    }
    if (!bright[0] && !bright[1])
        return false;
    /* of the mean of two values, by their difference; at an edge, whether it is bright at all */
    double error = bright[0] && bright[1] ? 0.5 * cell_sr * (cd_m2[0] - cd_m2[1]) : ret->weighted;
    ret->variance = error * error;
    return true;
}

/* The nearest of its kind within reach, or one more. */
static struct source *source_for(struct sources *s, bool peak, struct lum_vec3 d)
{
    struct source *nearest = NULL;
    double most = s->n < SOURCES_MAX ? cos(MERGED_RAD) : -2.0;
    for (uint32_t i = 0; i < s->n; i++) {
        struct source *one = &s->list[i];
        double cosine = (double)(lum_dot(one->middle, d) / lum_length(one->middle));
        if (one->peak == peak && cosine > most) {
            most = cosine;
            nearest = one;
        }
    }
    return nearest ? nearest : &s->list[s->n < SOURCES_MAX ? s->n++ : 0];
}

static void find_sources(const struct lum_fisheye *f, const struct lum_frame *frame, struct sources *s)
{
    double cell_sr = HEMISPHERE_SR / (f->side * f->side), rounds = lum_fisheye_rounds(f);
    for (uint32_t i = 0; i < f->side * f->side; i++) {
        const double cd_m2[2] = {(double)f->half[0][i] / rounds, (double)f->half[1][i] / rounds};
        struct source cell;
        if (!describe(cd_m2, cell_sr, &cell))
            continue;
        float x = ((float)(i % f->side) + 0.5f) / (float)f->side, y = ((float)(i / f->side) + 0.5f) / (float)f->side;
        struct lum_vec3 d = direction_at(frame, x, y);
        struct source *one = source_for(s, cell.peak, d);
        one->peak = cell.peak;
        one->solid_angle += cell.solid_angle;
        one->weighted += cell.weighted;
        one->variance += cell.variance;
        one->middle = lum_v3_mad(one->middle, d, (float)cell.solid_angle);
    }
}

struct lum_bright lum_fisheye_bright(const struct lum_fisheye *f, const struct lum_observer *observer)
{
    struct lum_frame frame = frame_of(observer);
    struct sources s = {.n = 0};
    struct lum_bright bright = {0};
    double variance = 0.0;
    if (lum_fisheye_rounds(f) > 0)
        find_sources(f, &frame, &s);
    for (uint32_t i = 0; i < s.n; i++) {
        const struct source *one = &s.list[i];
        double p = lum_position_index(frame.n, frame.b, lum_normalize(one->middle));
        if (!isfinite(p))
            continue;
        double slope = one->weighted / (one->solid_angle * p * p); /* L^2 w = (L w)^2 / w */
        bright.sum += one->weighted * slope;
        variance += 4.0 * slope * slope * one->variance;
        bright.n += one->weighted > LUM_DGP_SOURCE_CD_M2 * one->solid_angle; /* else noise made it */
    }
    bright.sum_stderr = sqrt(variance);
    return bright;
}
