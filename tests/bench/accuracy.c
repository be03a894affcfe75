/* What accuracy costs in time: every method at every setting, first frames from nothing and what samples add to them,
 * against path tracing through pixel centres, so that only the light is compared.
 *
 * Settings vary one at a time around the default. All views of a scene are measured seed by seed, one after the other
 * in one process, so that what the machine does meanwhile is in all alike; and one of them twice, to see how alike
 * (A/A). Times are those of a machine of its own: CPU time of the workers over their number, and that of the thread
 * between them. Rays are exact. */
#include "tests/bench/accuracy.h"

#include <math.h>
#include <string.h>

#define METHODS "whitted,igi,ais,ic,tic,irrcache,live,path"

enum {
    MAX_VIEWS = 7 * LUM_BENCH_METHODS,
    /* four numbers of VPLs, two accuracies, and one for the control */ MAX_SPP = 1024,
    QUICK_MAX_SPP = 4
};

/* A way to render, and its view, which stays open from seed to seed. */
struct way {
    const struct lum_method *method;
    char setting[32];
    struct lum_view_settings settings;
    struct lum_view *view;
    struct lum_caches *caches;
    bool adds_samples; /* it goes on until time is up */
    bool control;      /* path once more: only its time counts */
    size_t first;      /* point */
};

struct rig {
    struct lum_bench_stand at;
    struct lum_bench_reference reference;
    struct accuracy_scene scene;
    struct accuracy_report *report;
    struct way ways[MAX_VIEWS];
    size_t n_ways;
    double white;
};

/* ---- ways ---- */

static struct way *add_way(struct rig *rig, const struct lum_method *method, const char *setting)
{
    struct way *w = &rig->ways[rig->n_ways++];
    *w = (struct way){.method = method, .settings = rig->at.settings};
    w->settings.method = method;
    snprintf(w->setting, sizeof w->setting, "%s", setting);
    return w;
}

static void list_ways(struct rig *rig, const struct lum_method *method)
{
    static const uint32_t vpls[] = {16, 64, 256, 1024};
    static const float accuracies[] = {0.4f, 0.1f};
    char setting[32];
    if (method->progressive || !lum_method_counts_vpls(method)) {
        add_way(rig, method, "")->adds_samples = method->progressive;
        return;
    }
    for (size_t i = 0; i < LUM_ARRAY_LEN(vpls); i++) {
        snprintf(setting, sizeof setting, "%u %s", vpls[i], strcmp(method->name, "irrcache") == 0 ? "rays" : "VPLs");
        struct way *w = add_way(rig, method, setting);
        w->settings.n_vpls = vpls[i];
        w->adds_samples = method->refines && vpls[i] == LUM_VPL_DEFAULT;
    }
    for (size_t i = 0; method->cache && i < LUM_ARRAY_LEN(accuracies); i++) {
        snprintf(setting, sizeof setting, "accuracy %.1f", (double)accuracies[i]);
        add_way(rig, method, setting)->settings.cache_accuracy = accuracies[i];
    }
}

static bool open_ways(struct rig *rig)
{
    for (size_t m = 0; m < rig->at.n_methods; m++)
        list_ways(rig, rig->at.methods[m]);
    add_way(rig, lum_method_find("path"), "")->control = true;
    for (size_t i = 0; i < rig->n_ways; i++)
        if (!lum_bench_open_view(rig->at.world.pool, &rig->ways[i].view, &rig->ways[i].caches))
            return false;
    return true;
}

static void close_ways(struct rig *rig)
{
    for (size_t i = 0; i < rig->n_ways; i++) {
        lum_view_destroy(rig->ways[i].view);
        lum_caches_destroy(rig->ways[i].caches);
    }
}

/* ---- a picture ---- */

struct cost {
    double own_ms, rays;
};

static bool run_pass(struct rig *rig, struct way *w, struct lum_pass_stats *ret_stats, struct cost *inout_cost)
{
    struct lum_error err = {0};
    int64_t begin_ns = lum_cpu_clock_ns();
    if (lum_view_pass(w->view, rig->at.world.snapshot, &w->settings, NULL, ret_stats, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    inout_cost->own_ms +=
        ret_stats->cpu_ms / lum_pool_size(rig->at.world.pool) + (double)(lum_cpu_clock_ns() - begin_ns) * 1e-6;
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        inout_cost->rays += (double)ret_stats->rays[k];
    return ret_stats->nonfinite == 0 || lum_bench_failed("a value is not finite");
}

/* The i-th point of the way, which is new with the first seed. */
static struct accuracy_point *point_of(struct rig *rig, struct way *w, size_t i, uint32_t seed, uint32_t spp)
{
    struct accuracy_scene *s = &rig->scene;
    if (seed == 0) {
        if (s->n == ACCURACY_POINTS)
            return NULL;
        if (i == 0)
            w->first = s->n;
        struct accuracy_point *p = &s->points[s->n++];
        *p = (struct accuracy_point){.method = w->method, .spp = spp, .first = i == 0};
        if (w->adds_samples && (i > 0 || w->method->progressive))
            snprintf(p->setting, sizeof p->setting, "%u spp", spp);
        else
            snprintf(p->setting, sizeof p->setting, "%.31s", w->setting);
    }
    struct accuracy_point *p = w->first + i < s->n ? &s->points[w->first + i] : NULL;
    return p && p->method == w->method && p->spp == spp ? p : NULL; /* another seed may have got further in time */
}

static void note(struct rig *rig, struct way *w, size_t i, uint32_t seed, uint32_t spp, const struct cost *cost)
{
    struct accuracy_point *p = point_of(rig, w, i, seed, spp);
    if (!p || p->n != seed)
        return;
    lum_bench_picture_of(w->view, rig->at.picture);
    p->own_ms[p->n] = cost->own_ms;
    struct lum_bench_error error = lum_bench_error_of_picture(&rig->reference, rig->at.picture);
    p->error[ACCURACY_RELMSE][p->n] = error.relmse;
    p->error[ACCURACY_SMAPE][p->n] = error.smape;
    p->n++;
    if (seed == 0)
        p->rays = cost->rays / ((double)rig->at.settings.w * rig->at.settings.h);
}

/* From nothing to a first frame, and on to more samples, each time they have doubled, while there is time. */
static bool measure_way(struct rig *rig, struct way *w, uint32_t seed, double *ret_first_ms)
{
    struct lum_pass_stats stats;
    struct cost cost = {0};
    uint32_t next = 1, most = w->adds_samples ? rig->at.options->quick ? QUICK_MAX_SPP : MAX_SPP : 1;
    lum_view_forget(w->view);
    lum_caches_forget(w->caches);
    w->settings.seed = seed + 1; /* the reference's is 0 */
    for (size_t i = 0; next <= most; next *= 2, i++) {
        do
            if (!run_pass(rig, w, &stats, &cost))
                return false;
        while (stats.spp < next);
        if (i == 0)
            *ret_first_ms = cost.own_ms;
        if (!w->control)
            note(rig, w, i, seed, next, &cost);
        if (cost.own_ms > 1e3 * rig->at.options->seconds)
            break;
    }
    return true;
}

static bool measure_seed(struct rig *rig, uint32_t seed)
{
    double path_ms = (double)NAN, ms;
    for (size_t i = 0; i < rig->n_ways; i++) {
        struct way *w = &rig->ways[i];
        if (!measure_way(rig, w, seed, &ms))
            return false;
        if (w->control && isfinite(path_ms))
            rig->scene.same[rig->scene.n_same++] = path_ms / ms;
        if (w->method->progressive)
            path_ms = ms;
    }
    return true;
}

/* ---- a scene ---- */

static bool expose(struct rig *rig)
{
    struct lum_film film;
    struct lum_error err = {0};
    uint64_t nonfinite = 0;
    if (lum_film_init(&film, rig->at.settings.w, rig->at.settings.h, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    for (size_t i = 0; i < (size_t)film.w * film.h; i++) {
        const float *v = rig->reference.truth + 3 * i;
        lum_film_set(&film, (uint32_t)(i % film.w), (uint32_t)(i / film.w), lum_rgb(v[0], v[1], v[2]), &nonfinite);
    }
    rig->white = lum_exposure_white(lum_exposure_auto(&film));
    lum_film_finish(&film);
    return true;
}

static bool open_rig(struct rig *rig)
{
    if (!lum_bench_stand_open(&rig->at, (const uint32_t[]){600, 400}, (const uint32_t[]){48, 32}))
        return false;
    snprintf(rig->scene.name, sizeof rig->scene.name, "%s", rig->at.place->scene);
    rig->scene.w = rig->at.settings.w;
    rig->scene.h = rig->at.settings.h;
    rig->at.settings.max_spp = 0;
    lum_bench_machine(&rig->at.world, rig->scene.machine, sizeof rig->scene.machine);
    rig->at.settings.antialias = false;
    return true;
}

static void close_rig(void *of)
{
    struct rig *rig = of;
    close_ways(rig);
    lum_bench_reference_finish(&rig->reference);
    lum_bench_stand_close(&rig->at);
}

/* First frames at the settings that views have. */
static bool show_pictures(struct rig *rig)
{
    bool ok =
        accuracy_report_picture(rig->report, &rig->scene, "reference", "reference", rig->reference.truth, rig->white);
    for (size_t i = 0; i < rig->n_ways && ok; i++) {
        struct way *w = &rig->ways[i];
        struct lum_pass_stats stats;
        struct cost cost = {0};
        char title[96];
        if (w->control || w->settings.n_vpls != rig->at.settings.n_vpls ||
            w->settings.cache_accuracy != rig->at.settings.cache_accuracy)
            continue;
        lum_view_forget(w->view);
        lum_caches_forget(w->caches);
        ok = run_pass(rig, w, &stats, &cost);
        lum_bench_picture_of(w->view, rig->at.picture);
        snprintf(title, sizeof title, "%s, first frame: %.0f ms, relMSE %.4f", w->method->name, cost.own_ms,
                 lum_bench_error_of_picture(&rig->reference, rig->at.picture).relmse);
        ok = ok &&
             accuracy_report_picture(rig->report, &rig->scene, title, w->method->name, rig->at.picture, rig->white);
    }
    return ok;
}

static bool measure_scene(void *of, void *report)
{
    struct rig *rig = of;
    rig->report = report;
    uint32_t n_seeds = rig->at.options->quick                    ? 2
                       : rig->at.options->seeds < ACCURACY_SEEDS ? rig->at.options->seeds
                                                                 : ACCURACY_SEEDS;
    if (!open_rig(rig)) {
        printf("skipped: %s\n", rig->at.place->scene);
        return true;
    }
    struct lum_bench_truth truth = lum_bench_truth_of(rig->at.options, &rig->at.world, &rig->at.settings);
    truth.or_more = true;
    lum_bench_progress("accuracy: %s: reference", rig->at.place->scene);
    if (!lum_bench_reference_make(&rig->reference, &truth) || !expose(rig) || !open_ways(rig))
        return false;
    rig->scene.reference_relmse = rig->reference.relmse;
    rig->scene.reference_spp = rig->reference.spp;
    bool ok = true;
    for (uint32_t seed = 0; seed < n_seeds && ok; seed++) {
        lum_bench_progress("accuracy: %s: seed %u of %u, %zu ways", rig->at.place->scene, seed + 1, n_seeds,
                           rig->n_ways);
        ok = measure_seed(rig, seed);
    }
    return ok && show_pictures(rig) && accuracy_report_scene(rig->report, &rig->scene);
}

int lum_bench_accuracy(const struct lum_bench_options *options)
{
    const struct lum_bench_tour tour = {METHODS, sizeof(struct rig), measure_scene, close_rig};
    struct accuracy_report *report = accuracy_report_open(options);
    bool ok = report && lum_bench_go(&tour, options, report);
    return accuracy_report_close(report, ok) ? 0 : 1;
}
