/* What each setting of a method gives in time while something moves (motion.h): a ball and the eye, or a lamp alone;
 * and what it costs in error: each alone, beside rough passes, which are what pictures that must be there in time are
 * made by. So it is shown whether a budget of time should choose anything but the resolution.
 *
 * All ways of a scene are measured pose by pose, one after the other in one process, over frames that build nothing
 * from scratch; the last one is compared. Times are those of a machine of its own (accuracy.c), rays are exact. */
#include <math.h>
#include <string.h>

#include "tests/bench/motion.h"
#include "tests/bench/places.h"
#include "tests/bench/reference.h"
#include "tests/bench/table.h"

#define METHODS "live,tic,ic,irrcache,igi,ais"
#define QUICK_METHODS "live,igi"

enum { POSES = 6, QUICK_POSES = 2, MAX_SEEDS = 16, MAX_WAYS = 24 };

/* A way to render, and its view, which stays open. */
struct way {
    char name[64];
    struct lum_view_settings settings;
    struct lum_view *view;
    struct lum_caches *caches;
    double ms[MAX_SEEDS * POSES], rays; /* of frames that count */
    double first_ms[MAX_SEEDS];         /* of those that build all, as after a change of what records are made of */
    size_t n, n_first;
    double relmse[MAX_SEEDS], smape[MAX_SEEDS];
};

struct rig {
    struct lum_bench_stand at;
    struct lum_bench_reference reference;
    struct lum_bench_motion motion;
    bool lamp; /* it is a lamp that moves, and nothing else */
    struct way ways[MAX_WAYS];
    size_t n_ways;
};

/* ---- ways ---- */

static struct lum_view_settings *add_way(struct rig *rig, uint32_t side, const char *setting)
{
    struct way *w = &rig->ways[rig->n_ways++];
    w->settings = rig->at.settings;
    w->settings.preview = side;
    if (side > 1)
        snprintf(w->name, sizeof w->name, "blocks of %u%s%s", side, *setting ? ", " : "", setting);
    else
        snprintf(w->name, sizeof w->name, "%s", *setting ? setting : "as it is");
    return &w->settings;
}

/* Each setting alone, rough passes alone, and both: what else is there once a picture is rough. */
static void list_ways(struct rig *rig, const struct lum_method *method)
{
    static const uint32_t sides[] = {1, 2, 4, 8, LUM_PREVIEW_WHOLE, LUM_PREVIEW_MAX};
    rig->at.settings.method = method;
    rig->n_ways = 0;
    memset(rig->ways, 0, sizeof rig->ways);
    for (size_t i = 0; i < LUM_ARRAY_LEN(sides); i++) {
        uint32_t side = sides[i];
        add_way(rig, side, "");
        if (side > LUM_PREVIEW_WHOLE && method->progressive)
            break;
        if (side == 2 || side >= LUM_PREVIEW_WHOLE)
            continue;
        if (lum_method_counts_vpls(method))
            add_way(rig, side, "VPLs / 4")->n_vpls /= 4;
        if (method->cache)
            add_way(rig, side, "accuracy 0.4")->cache_accuracy = 0.4f;
        if (method->refines)
            add_way(rig, side, "no shadow rays")->shadow_budget = 0;
        if (method->serves[LUM_EFFECT_ANTIALIAS] && side == 1) /* rough pictures have none */
            add_way(rig, side, "no antialias")->antialias = false;
        if (method->serves[LUM_EFFECT_GLOSSY] && rig->reference.demand.on[LUM_EFFECT_GLOSSY])
            add_way(rig, side, "no gloss")->effects_off = LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY);
        if (method->serves[LUM_EFFECT_MEDIA] && rig->reference.demand.on[LUM_EFFECT_MEDIA])
            add_way(rig, side, "no fog")->effects_off = LUM_EFFECT_BIT(LUM_EFFECT_MEDIA);
    }
}

static bool open_ways(struct rig *rig)
{
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
    rig->n_ways = 0;
}

/* ---- frames ---- */

static bool run_frame(struct rig *rig, struct way *w, bool counts)
{
    struct lum_pass_stats stats;
    struct lum_error err = {0};
    int64_t begin_ns = lum_cpu_clock_ns();
    if (lum_view_pass(w->view, rig->at.world.snapshot, &w->settings, NULL, &stats, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    double ms = stats.cpu_ms / lum_pool_size(rig->at.world.pool) + (double)(lum_cpu_clock_ns() - begin_ns) * 1e-6;
    if (counts)
        w->ms[w->n++] = ms;
    else
        w->first_ms[w->n_first++] = ms;
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        w->rays += counts ? (double)stats.rays[k] : 0.0;
    return true;
}

/* A drag begins at a picture that is whole. */
static bool rest(struct rig *rig, struct way *w)
{
    struct lum_pass_stats stats = {0};
    struct lum_error err = {0};
    bool ok = true;
    while (ok && stats.spp == 0)
        ok = lum_view_pass(w->view, rig->at.world.snapshot, &w->settings, NULL, &stats, &err) == LUM_OK;
    return ok || lum_bench_failed(err.text);
}

static bool take_pose(struct rig *rig, uint32_t pose, struct lum_camera *ret_camera)
{
    *ret_camera = rig->at.settings.camera;
    return rig->lamp ? lum_bench_lamp_pose(&rig->motion, pose, &rig->at.world)
                     : lum_bench_motion_pose(&rig->motion, pose, &rig->at.world, ret_camera);
}

static uint32_t n_poses(const struct rig *rig)
{
    return rig->at.options->quick ? QUICK_POSES : POSES;
}

/* The first pose builds all and does not count. */
static bool measure_seed(struct rig *rig, uint32_t seed)
{
    bool ok = true;
    for (size_t i = 0; i < rig->n_ways; i++) {
        lum_view_forget(rig->ways[i].view);
        lum_caches_forget(rig->ways[i].caches);
    }
    for (uint32_t pose = 0; pose <= n_poses(rig) && ok; pose++) {
        struct lum_camera camera;
        ok = take_pose(rig, pose, &camera);
        for (size_t i = 0; i < rig->n_ways && ok; i++) {
            rig->ways[i].settings.camera = camera;
            rig->ways[i].settings.seed = seed + 1; /* the reference's is 0 */
            ok = run_frame(rig, &rig->ways[i], pose > 0) && (pose > 0 || rest(rig, &rig->ways[i]));
        }
    }
    for (size_t i = 0; i < rig->n_ways && ok; i++) {
        struct way *w = &rig->ways[i];
        lum_bench_picture_of(w->view, rig->at.picture);
        struct lum_bench_error error = lum_bench_error_of_picture(&rig->reference, rig->at.picture);
        w->relmse[seed] = error.relmse;
        w->smape[seed] = error.smape;
    }
    return ok;
}

/* ---- a scene ---- */

static const struct lum_bench_column columns[] = {
    {"scene", "scene", LUM_BENCH_TEXT},
    {"moves", "moves", LUM_BENCH_TEXT},
    {"method", "method", LUM_BENCH_TEXT},
    {"setting", "setting", LUM_BENCH_TEXT},
    {"ms", "ms", 1},
    {"time", "of the time as it is", 2},
    {"rays", "of its rays", 2},
    {"first_ms", "built from nothing, ms", 1},
    {"relmse", "relMSE", 4},
    {"smape", "SMAPE", 4},
    {"relmse_ratio", "of its relMSE", 2},
    {"smape_ratio", "of its SMAPE", 2},
};

static void tell(const struct rig *rig, const struct way *w, uint32_t seeds, struct lum_bench_table *table)
{
    const struct way *base = &rig->ways[0];
    double ratio[MAX_SEEDS * POSES], relmse = 0.0, smape = 0.0, base_relmse = 0.0, base_smape = 0.0;
    for (size_t i = 0; i < w->n; i++)
        ratio[i] = w->ms[i] / base->ms[i]; /* of the same pose */
    for (uint32_t s = 0; s < seeds; s++) {
        relmse += w->relmse[s] / seeds;
        smape += w->smape[s] / seeds;
        base_relmse += base->relmse[s] / seeds;
        base_smape += base->smape[s] / seeds;
    }
    LUM_BENCH_TEXTS(table, rig->at.place->scene, rig->lamp ? "lamp" : "ball and eye", w->settings.method->name,
                    w->name);
    LUM_BENCH_NUMBERS(table, lum_bench_median_of(w->ms, w->n), lum_bench_median_of(ratio, w->n), w->rays / base->rays,
                      lum_bench_median_of(w->first_ms, w->n_first), relmse, smape, relmse / base_relmse,
                      smape / base_smape);
}

static bool measure_method(struct rig *rig, const struct lum_method *method, struct lum_bench_table *table)
{
    uint32_t most = rig->at.options->quick ? 1 : MAX_SEEDS;
    uint32_t seeds = rig->at.options->seeds < most ? rig->at.options->seeds : most;
    lum_bench_progress("settings: %s: %s", rig->at.place->scene, method->name);
    list_ways(rig, method);
    bool ok = open_ways(rig);
    for (uint32_t seed = 0; seed < seeds && ok; seed++)
        ok = measure_seed(rig, seed);
    for (size_t i = 0; i < rig->n_ways && ok; i++)
        tell(rig, &rig->ways[i], seeds, table);
    close_ways(rig);
    return ok;
}

static bool mean_of(struct rig *rig, double *ret_mean)
{
    struct lum_view *view = NULL;
    struct lum_caches *caches = NULL;
    struct way whole = {.settings = rig->at.settings};
    bool ok = lum_bench_open_view(rig->at.world.pool, &view, &caches);
    whole.view = view;
    ok = ok && rest(rig, &whole);
    if (ok) {
        lum_bench_picture_of(view, rig->at.picture);
        size_t n = (size_t)rig->at.settings.w * rig->at.settings.h;
        *ret_mean = 0.0;
        for (size_t i = 0; i < n; i++)
            *ret_mean += (double)lum_luminance(
                             lum_rgb(rig->at.picture[3 * i], rig->at.picture[3 * i + 1], rig->at.picture[3 * i + 2])) /
                         (double)n;
    }
    lum_view_destroy(view);
    lum_caches_destroy(caches);
    return ok;
}

#define LAMP_BRINGS 0.5 /* of the picture's light without it */
#define LAMP_MOST_LM 1e7

/* So bright that it matters, whatever the scene: tenfold until that shows, and from there in proportion. */
static bool add_lamp(struct rig *rig)
{
    double without, with = 0.0, lm = 0.1;
    bool ok = mean_of(rig, &without) && lum_bench_lamp_begin(&rig->motion, &rig->at.world);
    while (ok && lm < LAMP_MOST_LM && with < (1.0 + 0.5 * LAMP_BRINGS) * without) {
        lm *= 10.0;
        ok = lum_bench_lamp_set_lm(&rig->at.world, lm) && mean_of(rig, &with);
    }
    if (ok && with > without)
        ok = lum_bench_lamp_set_lm(&rig->at.world, fmin(lm * LAMP_BRINGS * without / (with - without), LAMP_MOST_LM));
    return ok;
}

/* Of the last pose. */
static bool make_reference(struct rig *rig)
{
    struct lum_view_settings settings = rig->at.settings;
    rig->motion = lum_bench_motion_plan(&rig->at.world, &rig->at.settings);
    bool ok = rig->lamp ? lum_bench_motion_end(&rig->at.world) && add_lamp(rig)
                        : lum_bench_motion_begin(&rig->motion, &rig->at.world);
    if (!ok || !take_pose(rig, n_poses(rig), &settings.camera))
        return false;
    struct lum_bench_truth truth = lum_bench_truth_of(rig->at.options, &rig->at.world, &settings);
    truth.or_more = true;
    return lum_bench_reference_make(&rig->reference, &truth);
}

static void close_rig(void *of)
{
    struct rig *rig = of;
    lum_bench_reference_finish(&rig->reference);
    lum_bench_stand_close(&rig->at);
}

static bool measure_scene(void *of, void *table)
{
    struct rig *rig = of;
    bool ok = lum_bench_stand_open(&rig->at, (const uint32_t[]){600, 400}, (const uint32_t[]){48, 32});
    for (int lamp = 0; lamp <= 1 && ok; lamp++) {
        rig->lamp = lamp;
        lum_bench_progress("settings: %s: reference", rig->at.place->scene);
        ok = make_reference(rig);
        for (size_t m = 0; m < rig->at.n_methods && ok; m++)
            ok = measure_method(rig, rig->at.methods[m], table);
        if (lamp == 0)
            lum_bench_reference_finish(&rig->reference);
    }
    return ok;
}

int lum_bench_settings(const struct lum_bench_options *options)
{
    const struct lum_bench_tour tour = {options->quick ? QUICK_METHODS : METHODS, sizeof(struct rig), measure_scene,
                                        close_rig};
    struct lum_bench_table table = LUM_BENCH_TABLE(columns);
    bool ok = lum_bench_go(&tour, options, &table);
    ok = lum_bench_table_finish(&table, options, "settings") && ok;
    return ok ? 0 : 1;
}
