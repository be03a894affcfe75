/* What each effect costs: every scene, every subset of the effects that it calls for, rays and CPU time by effect.
 *
 * Frames are fresh: the view forgets what it memoised but keeps its memory. `live` is timed by its first frame, `path`
 * by a sample of each pixel. A subset is made by forcing the other effects off, which costs what their absence costs
 * (tests/numeric/effects_test.c). An effect's own time is its share of a tile's by rays; what a frame saves without it
 * is the other way to see its cost.
 *
 * The energy that a method leaves out is path traced: one minus the mean luminance without the effects that the method
 * does not serve, over that with all. It is below 0 where fog is left out that would have dimmed more than it scatters.
 */
#include "tests/bench/effects.h"

#include <math.h>
#include <string.h>

#include "server/world/scene_source.h"

/* --quick takes the first two. */
static const char *const scene_names[] = {"cornell",      "cornell-media", "desk",        "office",
                                          "office-media", "conference",    "many-lights", "shirley6"};
static const char *const method_names[] = {"live", "path"};
#define QUICK_SCENES 2u
#define ROUNDS 3u

struct bench {
    const struct lum_bench_options *options;
    struct lum_world world;
    struct lum_view *view;
    struct lum_caches *caches; /* of the view alone */
    struct lum_view_settings settings;
};

static bool failed(const struct lum_error *err)
{
    fprintf(stderr, "lumend-bench: %s\n", err->text);
    return false;
}

static bool pass(struct bench *b, uint32_t off, struct lum_pass_stats *ret_stats)
{
    struct lum_error err = {0};
    b->settings.effects_off = off;
    return lum_view_pass(b->view, b->world.snapshot, &b->settings, NULL, ret_stats, &err) == LUM_OK || failed(&err);
}

/* ---- frames ---- */

static bool measure_frame(struct bench *b, const struct effects_case *c, struct effects_frame *inout_frame)
{
    double ms[ROUNDS];
    uint32_t n = b->options->quick ? 1 : ROUNDS;
    struct lum_pass_stats stats = {0};
    b->settings.method = c->method;
    for (uint32_t i = 0; i < n; i++) {
        lum_view_forget(b->view);
        lum_caches_forget(b->caches);
        if (!pass(b, c->demanded & ~inout_frame->on, &stats))
            return false;
        ms[i] = stats.cpu_ms;
    }
    inout_frame->cpu_ms = lum_bench_quantile(ms, n, 0.5);
    inout_frame->primary_rays = stats.rays[LUM_RAY_PRIMARY];
    memcpy(inout_frame->effects, stats.effects, sizeof stats.effects);
    return true;
}

/* The next subset of set after `from`, in the order of binary numbers spread over its bits. */
static uint32_t next_subset(uint32_t set, uint32_t from)
{
    return (from - set) & set;
}

static bool measure_subsets(struct bench *b, struct effects_case *c)
{
    c->n_frames = 1u << __builtin_popcount(c->varied);
    c->frames = lum_calloc(c->n_frames, sizeof *c->frames);
    if (!c->frames)
        return fprintf(stderr, "lumend-bench: out of memory\n"), false;
    uint32_t on = 0;
    for (uint32_t i = 0; i < c->n_frames; i++, on = next_subset(c->varied, on)) {
        c->frames[i].on = on;
        if (!measure_frame(b, c, &c->frames[i]))
            return false;
    }
    return true;
}

const struct effects_frame *effects_frame_with(const struct effects_case *c, uint32_t on)
{
    for (uint32_t i = 0; i < c->n_frames; i++)
        if (c->frames[i].on == on)
            return &c->frames[i];
    return NULL;
}

/* ---- energy ---- */

static bool mean_luminance(struct bench *b, uint32_t off, double *ret_mean)
{
    struct lum_pass_stats stats;
    b->settings.method = lum_method_find("path");
    lum_view_forget(b->view);
    for (uint32_t i = 0; i < (b->options->quick ? 4u : 32u); i++)
        if (!pass(b, off, &stats))
            return false;
    const struct lum_film *f = lum_view_film(b->view);
    double sum = 0.0;
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 0; x < f->w; x++)
            sum += (double)lum_luminance(lum_film_mean(f, x, y));
    *ret_mean = sum / ((double)f->w * f->h);
    return true;
}

static bool measure_left_out(struct bench *b, struct effects_case *c)
{
    double all, part;
    const uint32_t edges = LUM_EFFECT_BIT(LUM_EFFECT_ANTIALIAS); /* carries no energy: noise, where samples differ */
    uint32_t off = c->demanded & ~c->varied & ~edges;
    c->left_out = 0.0;
    if (!off)
        return true;
    if (!mean_luminance(b, edges, &all) || !mean_luminance(b, off | edges, &part))
        return false;
    c->left_out = all > 0.0 ? 1.0 - part / all : 0.0;
    return true;
}

/* ---- scenes ---- */

static bool measure_method(struct bench *b, const char *scene, const struct lum_method *method,
                           struct effects_study *study, bool subsets)
{
    struct lum_pass_stats stats;
    struct effects_case *c = &study->cases[study->n_cases++];
    *c = (struct effects_case){.scene = scene, .method = method};
    b->settings.method = method;
    if (!pass(b, 0, &stats))
        return false;
    c->demand = stats.demand;
    for (uint32_t e = 0; e < LUM_EFFECT_COUNT; e++) {
        c->demanded |= c->demand.on[e] ? LUM_EFFECT_BIT(e) : 0;
        c->varied |= c->demand.on[e] && method->serves[e] ? LUM_EFFECT_BIT(e) : 0;
    }
    return (!subsets || measure_subsets(b, c)) && measure_left_out(b, c);
}

static bool is_studied(const struct lum_method *m)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(method_names); i++)
        if (strcmp(m->name, method_names[i]) == 0)
            return true;
    return false;
}

static bool measure_scene(struct bench *b, const char *scene, struct effects_study *study)
{
    struct lum_error err = {0};
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    if (!lum_bench_world(scene, 0, &b->world))
        return false;
    lum_bench_machine(&b->world, study->machine, sizeof study->machine);
    b->settings = lum_view_settings_default();
    b->settings.w = b->options->quick ? 48 : 300;
    b->settings.h = b->options->quick ? 32 : 200;
    if (lum_snapshot_camera(b->world.snapshot, NULL, &b->settings.camera, &err) != LUM_OK)
        b->settings.camera = lum_snapshot_framing_camera(b->world.snapshot);
    bool ok = (lum_caches_create(lum_pool_size(b->world.pool), &b->caches, &err) == LUM_OK &&
               lum_view_create(b->world.pool, &b->view, &err) == LUM_OK) ||
              failed(&err);
    if (ok)
        lum_view_share(b->view, b->caches);
    for (size_t m = 0; m < n && ok; m++) {
        lum_bench_progress("effects: %s: %s", scene, methods[m].name);
        ok = measure_method(b, scene, &methods[m], study, is_studied(&methods[m]));
    }
    lum_view_destroy(b->view);
    lum_caches_destroy(b->caches);
    b->view = NULL;
    b->caches = NULL;
    lum_world_finish(&b->world);
    return ok;
}

int lum_bench_effects(const struct lum_bench_options *options)
{
    const char *const *names = options->scene ? &options->scene : scene_names;
    size_t n = options->scene ? 1 : options->quick ? QUICK_SCENES : LUM_ARRAY_LEN(scene_names), n_methods;
    lum_methods(&n_methods);
    struct bench b = {.options = options};
    struct effects_study study = {.cases = lum_calloc(n * n_methods, sizeof *study.cases)};
    if (!study.cases)
        return fprintf(stderr, "lumend-bench: out of memory\n"), 1;
    bool ok = true;
    for (size_t i = 0; i < n && ok; i++)
        ok = measure_scene(&b, names[i], &study);
    ok = ok && effects_report(&study, options);
    for (size_t i = 0; i < study.n_cases; i++)
        lum_free(study.cases[i].frames);
    lum_free(study.cases);
    return ok ? 0 : 1;
}
