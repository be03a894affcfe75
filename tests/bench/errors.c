/* Does the error that pictures state cover the one that they have? Every scene, every method, several seeds: of a first
 * frame, of one after the eye has moved, and at rest as samples are added, against path tracing through the same
 * pixels.
 *
 * A reading is covered when the true error is no more than the bound. The true one is measured with the two halves of
 * the reference, whose noise cancels (reference.h). Beside it, what measuring cost: rays, which are exact, and time. */
#include <math.h>
#include <string.h>

#include "tests/bench/places.h"
#include "tests/bench/reference.h"
#include "tests/bench/table.h"

#define METHODS "whitted,igi,ais,ais-max,ic,tic,irrcache,path,live"
#define SHARE 0.05 /* of the rays of a picture, for its error: what views have */

enum { MAX_SEEDS = 30, QUICK_SEEDS = 1, STEPS = 6, REST_SPP = 16, STOP_SPP = 256, MAX_READINGS = MAX_SEEDS * 8 };
#define STOP 0.5      /* of the first frame's error, what a picture is to be stopped at */
#define ROUGH_SIDE 8u /* of blocks: what views have while nothing is known of their time */
enum when { FIRST, MOVED, ROUGHLY, REST, STOPPED, WHENS };
static const char *const when_names[] = {
    [FIRST] = "first", [MOVED] = "moving", [ROUGHLY] = "rough", [REST] = "rest", [STOPPED] = "stopped"};

/* Of a scene, a method and a moment. */
struct readings {
    size_t n, n_unknown, n_covered;
    double limit; /* what the error is to be under; 0: the bound */
    double is[MAX_READINGS], rel[MAX_READINGS], bound[MAX_READINGS];
    double rays, probe_rays, ms, probe_ms;
};

struct rig {
    struct lum_bench_stand at;
    const struct lum_method *method;
    struct lum_bench_reference smooth, centers; /* with antialiasing, and without */
    struct readings readings[WHENS];
};

/* ---- a reading ---- */

static void note_reading(struct rig *rig, const struct lum_view *view, const struct lum_pass_stats *stats,
                         enum when when)
{
    struct readings *r = &rig->readings[when];
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        *(k == LUM_RAY_PROBE ? &r->probe_rays : &r->rays) += (double)stats->rays[k];
    r->probe_ms += stats->stage_ms[LUM_STAGE_ERROR];
    r->ms += stats->ms - stats->stage_ms[LUM_STAGE_ERROR];
    if (!isfinite(stats->error.bound)) {
        r->n_unknown++;
        return;
    }
    lum_bench_picture_of(view, rig->at.picture);
    bool smooth = rig->method->serves[LUM_EFFECT_ANTIALIAS] != NULL;
    r->is[r->n] = lum_bench_rms_of_picture(smooth ? &rig->smooth : &rig->centers, rig->at.picture);
    r->rel[r->n] = stats->error.rel;
    r->bound[r->n] = stats->error.bound;
    r->n_covered += r->is[r->n] <= (r->limit > 0.0 ? r->limit : r->bound[r->n]);
    r->n++;
}

static bool pass(struct rig *rig, struct lum_view *view, struct lum_pass_stats *ret_stats)
{
    struct lum_error err = {0};
    return lum_view_pass(view, rig->at.world.snapshot, &rig->at.settings, NULL, ret_stats, &err) == LUM_OK ||
           lum_bench_failed(err.text);
}

/* ---- a seed ---- */

/* The eye before it gets where the reference is: it comes forward, a hundredth of the way to its target a step. */
static struct lum_camera before(struct lum_camera c, uint32_t steps)
{
    double t = -0.01 * steps;
    c.position.x += t * (c.target.x - c.position.x);
    c.position.y += t * (c.target.y - c.position.y);
    c.position.z += t * (c.target.z - c.position.z);
    return c;
}

static bool measure_first(struct rig *rig, struct lum_view *view)
{
    struct lum_pass_stats stats;
    if (!pass(rig, view, &stats))
        return false;
    note_reading(rig, view, &stats, FIRST);
    while (lum_method_adds_samples(rig->method) && stats.spp < REST_SPP) {
        if (!pass(rig, view, &stats))
            return false;
        if ((stats.spp & (stats.spp - 1)) == 0)
            note_reading(rig, view, &stats, REST);
    }
    return true;
}

static bool measure_motion(struct rig *rig, struct lum_view *view, enum when when)
{
    struct lum_camera camera = rig->at.settings.camera;
    struct lum_pass_stats stats;
    bool ok = true;
    for (uint32_t left = STEPS + 1; left-- > 0 && ok;) {
        rig->at.settings.camera = before(camera, left);
        ok = pass(rig, view, &stats);
    }
    rig->at.settings.camera = camera;
    if (ok)
        note_reading(rig, view, &stats, when);
    return ok;
}

static bool measure_moved(struct rig *rig, struct lum_view *view)
{
    return measure_motion(rig, view, MOVED);
}

/* A drag of which nothing but rough pictures are seen. */
static bool measure_rough(struct rig *rig, struct lum_view *view)
{
    rig->at.settings.preview = ROUGH_SIDE;
    bool ok = measure_motion(rig, view, ROUGHLY);
    rig->at.settings.preview = 0;
    return ok;
}

/* As --error does. One that does not get there does not count. */
static bool measure_stopped(struct rig *rig, struct lum_view *view)
{
    struct readings *r = &rig->readings[STOPPED];
    struct lum_pass_stats stats;
    if (r->limit == 0.0)
        r->limit = STOP * lum_bench_median_of(rig->readings[FIRST].is, rig->readings[FIRST].n);
    if (!(r->limit > 0.0)) /* nothing is known of a first frame */
        return true;
    do {
        if (!pass(rig, view, &stats))
            return false;
    } while (!(stats.error.bound <= r->limit) && stats.spp < STOP_SPP);
    if (stats.error.bound <= r->limit)
        note_reading(rig, view, &stats, STOPPED);
    return true;
}

/* On a view of its own, with caches of its own. */
static bool measure(struct rig *rig, bool (*fn)(struct rig *rig, struct lum_view *view))
{
    struct lum_error err = {0};
    struct lum_view *view = NULL;
    bool ok = lum_view_create(rig->at.world.pool, &view, &err) == LUM_OK ? fn(rig, view) : lum_bench_failed(err.text);
    lum_view_destroy(view);
    return ok;
}

/* ---- a scene ---- */

static bool make_reference(struct rig *rig, bool antialias, struct lum_bench_reference *ret_reference)
{
    struct lum_view_settings settings = rig->at.settings;
    settings.antialias = antialias;
    struct lum_bench_truth truth = lum_bench_truth_of(rig->at.options, &rig->at.world, &settings);
    truth.least_spp = truth.most_spp;
    truth.or_more = true;
    return lum_bench_reference_make(ret_reference, &truth);
}

static bool open_rig(struct rig *rig)
{
    if (!lum_bench_stand_open(&rig->at, (const uint32_t[]){240, 160}, (const uint32_t[]){48, 32}))
        return false;
    rig->at.settings.max_spp = LUM_LIMIT_SPP;
    rig->at.settings.error_share = SHARE;
    return true;
}

static const struct lum_bench_column columns[] = {
    {"scene", "scene", LUM_BENCH_TEXT},
    {"method", "method", LUM_BENCH_TEXT},
    {"when", "when", LUM_BENCH_TEXT},
    {"readings", "readings", 0},
    {"unknown", "unknown", 0},
    {"covered", "covered", 3},
    {"error", "true error, median", 4},
    {"rel_over_error", "estimate / true, median", 3},
    {"bound_over_error", "bound / true, median", 3},
    {"ray_share", "its rays / the picture's", 4},
    {"time_share", "its time / the picture's", 4},
};

static void tell(struct rig *rig, enum when when, struct lum_bench_table *table)
{
    struct readings *r = &rig->readings[when];
    if (r->n + r->n_unknown == 0)
        return;
    double rel[MAX_READINGS], bound[MAX_READINGS];
    size_t n_known = 0; /* a picture that is right has no ratio */
    for (size_t i = 0; i < r->n; i++)
        if (r->is[i] > 0.0) {
            rel[n_known] = r->rel[i] / r->is[i];
            bound[n_known++] = r->bound[i] / r->is[i];
        }
    LUM_BENCH_TEXTS(table, rig->at.place->scene, rig->method->name, when_names[when]);
    LUM_BENCH_NUMBERS(table, (double)r->n, (double)r->n_unknown,
                      r->n ? (double)r->n_covered / (double)r->n : (double)NAN, lum_bench_quantile(r->is, r->n, 0.5),
                      lum_bench_quantile(rel, n_known, 0.5), lum_bench_quantile(bound, n_known, 0.5),
                      when == STOPPED ? (double)NAN : r->probe_rays / r->rays,
                      when == STOPPED ? (double)NAN : r->probe_ms / r->ms);
}

static bool measure_method(struct rig *rig, struct lum_bench_table *table)
{
    uint32_t n_seeds = rig->at.options->quick ? QUICK_SEEDS : (uint32_t)rig->at.options->seeds;
    memset(rig->readings, 0, sizeof rig->readings);
    rig->at.settings.method = rig->method;
    for (uint32_t seed = 0; seed < n_seeds; seed++) {
        rig->at.settings.seed = seed;
        if (!measure(rig, measure_first) || !measure(rig, measure_moved) || !measure(rig, measure_rough))
            return false;
    }
    for (uint32_t seed = 0; seed < n_seeds && lum_method_adds_samples(rig->method); seed++) {
        rig->at.settings.seed = seed;
        if (!measure(rig, measure_stopped))
            return false;
    }
    for (enum when when = 0; when < WHENS; when++)
        tell(rig, when, table);
    return true;
}

static bool measure_scene(void *of, void *table)
{
    struct rig *rig = of;
    lum_bench_progress("errors: %s", rig->at.place->scene);
    if (!open_rig(rig)) {
        printf("skipped: %s\n", rig->at.place->scene);
        return true;
    }
    bool ok = make_reference(rig, true, &rig->smooth) && make_reference(rig, false, &rig->centers);
    for (size_t m = 0; m < rig->at.n_methods && ok; m++) {
        lum_bench_progress("errors: %s: %s", rig->at.place->scene, rig->at.methods[m]->name);
        rig->method = rig->at.methods[m];
        ok = measure_method(rig, table);
    }
    return ok;
}

static void close_rig(void *of)
{
    struct rig *rig = of;
    lum_bench_reference_finish(&rig->smooth);
    lum_bench_reference_finish(&rig->centers);
    lum_bench_stand_close(&rig->at);
}

int lum_bench_errors(const struct lum_bench_options *options)
{
    const struct lum_bench_tour tour = {METHODS, sizeof(struct rig), measure_scene, close_rig};
    struct lum_bench_table table = LUM_BENCH_TABLE(columns);
    bool ok = lum_bench_go(&tour, options, &table);
    ok = lum_bench_table_finish(&table, options, "errors") && ok;
    return ok ? 0 : 1;
}
