/* The storages of the shared irradiance cache against each other: tables 7.0 and 7.1 of the thesis on our scenes.
 *
 * One process a run, one scene after the other, 600 x 400, method `irrcache` in its free-running mode: a pixel that no
 * record serves makes one at once, and shares it. Every timed frame is fresh and begins with an empty cache, but with
 * the memory of the frame before. Storages and numbers of threads take turns; each round runs them once forwards and
 * once backwards (A B B A), and speed-ups are taken within a round. The accuracy is such
 * that a picture takes a few thousand records, as the thesis'.
 *
 * Two cameras turn on the spot, in the middle of their scene, once around in 100 frames; records that are there stay.
 */
#include "tests/bench/irrcache.h"

#include <math.h>
#include <string.h>

#include "core/render/view.h"
#include "tests/bench/bench.h"

const char *const irr_storages[IRR_STORAGES] = {"TRA", "LCK", "LW", "WF"};
const uint32_t irr_threads[IRR_CREWS] = {1, 2, 4, 8};
_Static_assert((int)IRR_STORAGES == (int)LUM_STORAGE_COUNT, "a name for each storage");

/* --quick takes the first two, of which one has panes: that is another cache. */
static const char *const scene_names[IRR_SCENES] = {"cornell", "desk", "conference", "office", "sponza"};
static const char *const animation_names[IRR_ANIMATIONS] = {"cornell", "conference"};

/* One storage and crew, with a cache and a view of their own, so that no buffer is made while a frame is timed. */
struct config {
    struct lum_view *view;
    struct lum_caches *caches;
    struct lum_cache *cache; /* held: to be emptied, and for what its storage cost */
    struct lum_view_settings settings;
    enum irr_storage storage;
    uint32_t crew;
    double overhead; /* before the last frame */
};

/* One scene at work. */
struct rig {
    const struct lum_bench_options *options;
    struct irr_study *study;
    struct lum_world world;
    struct lum_view_settings settings;
    struct lum_pool *pools[IRR_CREWS];
};

static bool failed(const struct lum_error *err)
{
    fprintf(stderr, "lumend-bench: %s\n", err->text);
    return false;
}

/* ---- configurations ---- */

static void config_finish(struct config *c)
{
    lum_view_destroy(c->view);
    irr_cache_release(c->caches, c->cache);
    lum_caches_destroy(c->caches);
    *c = (struct config){0};
}

static bool config_init(struct config *c, const struct rig *r, enum irr_storage storage, uint32_t crew)
{
    struct lum_error err = {0};
    struct lum_pool *pool = r->pools[crew];
    *c = (struct config){.settings = r->settings, .storage = storage, .crew = crew};
    c->settings.storage = (enum lum_storage)storage;
    if (lum_caches_create(lum_pool_size(pool), &c->caches, &err) != LUM_OK ||
        irr_cache_acquire(c->caches, &c->settings, r->world.snapshot->has_panes, &c->cache, &err) != LUM_OK ||
        lum_view_create(pool, &c->view, &err) != LUM_OK)
        return failed(&err);
    lum_view_share(c->view, c->caches);
    return true;
}

static bool pools_create(struct rig *r)
{
    struct lum_error err = {0};
    for (uint32_t k = 0; k < r->study->n_crews; k++)
        if (lum_pool_create(irr_threads[k], &r->pools[k], &err) != LUM_OK)
            return failed(&err);
    return true;
}

/* ---- a frame ---- */

/* The next frame; `empty`: from an empty cache. */
static bool frame(const struct rig *r, struct config *c, bool empty, struct lum_pass_stats *ret_stats)
{
    struct lum_error err = {0};
    if (empty) {
        lum_view_forget(c->view);
        irr_cache_empty(c->cache);
    }
    c->overhead = irr_cache_overhead(c->cache);
    if (lum_view_pass(c->view, r->world.snapshot, &c->settings, NULL, ret_stats, &err) != LUM_OK)
        return failed(&err);
    if (!irr_cache_is_used(c->cache))
        return fprintf(stderr, "lumend-bench: the view uses another cache: is there a medium?\n"), false;
    if (ret_stats->nonfinite == 0 && ret_stats->bad_rays == 0)
        return true;
    fprintf(stderr, "lumend-bench: %llu values are not finite, %llu rays were not fit to trace\n",
            (unsigned long long)ret_stats->nonfinite, (unsigned long long)ret_stats->bad_rays);
    return false;
}

/* ---- still images ---- */

static void add_frame(struct irr_cell *cell, size_t round, const struct config *c, const struct lum_pass_stats *s)
{
    cell->ms[round] += 0.5 * s->ms;
    cell->cpu_ms[round] += 0.5 * s->cpu_ms;
    cell->indirect_ms[round] +=
        0.5 * (s->stage_ms[LUM_STAGE_CACHE] + s->stage_ms[LUM_STAGE_RECORDS] + s->stage_ms[LUM_STAGE_INDIRECT]);
    cell->records[round] += 0.5 * (double)s->cache.created;
    cell->discarded[round] += 0.5 * (double)s->cache.discarded;
    cell->overhead[round] += 0.5 * (irr_cache_overhead(c->cache) - c->overhead);
}

static bool time_configs(const struct rig *r, struct irr_scene *out, struct config *configs, size_t n)
{
    struct lum_pass_stats stats;
    size_t rounds = lum_bench_rounds(r->options, IRR_ROUNDS, 2);
    for (size_t i = 0; i < n; i++) { /* warm-up; makes the buffers */
        struct irr_cell *cell = &out->cells[configs[i].storage][configs[i].crew];
        if (!frame(r, &configs[i], true, &stats))
            return false;
        cell->n = rounds;
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
            cell->rays += stats.rays[k];
    }
    for (size_t round = 0; round < rounds; round++) {
        lum_bench_progress("irrcache: %s, round %zu of %zu", out->name, round + 1, rounds);
        for (size_t i = 0; i < 2 * n; i++) {
            struct config *c = &configs[i < n ? i : 2 * n - 1 - i];
            if (!frame(r, c, true, &stats))
                return false;
            add_frame(&out->cells[c->storage][c->crew], round, c, &stats);
        }
    }
    return true;
}

static bool measure_stills(const struct rig *r, struct irr_scene *out)
{
    struct config configs[IRR_STORAGES * IRR_CREWS];
    size_t n = 0;
    bool ok = true;
    for (uint32_t crew = 0; crew < r->study->n_crews; crew++)
        for (int s = IRR_TRA; ok && s < IRR_STORAGES; s++)
            if (s != IRR_TRA || irr_threads[crew] == 1)
                ok = config_init(&configs[n++], r, (enum irr_storage)s, crew);
    ok = ok && time_configs(r, out, configs, n);
    for (size_t i = 0; i < n; i++)
        config_finish(&configs[i]);
    return ok;
}

/* ---- animations ---- */

/* Frame i of n: on the spot, in the middle of the scene, level. */
static struct lum_camera turned(const struct lum_snapshot *s, double vfov_deg, uint32_t i, uint32_t n)
{
    const struct lum_vec3 lo = s->bounds_lo, hi = s->bounds_hi;
    struct lum_vec3d p = {0.5 * ((double)lo.x + (double)hi.x) / s->norm.scale + s->norm.centre.x,
                          0.5 * ((double)lo.y + (double)hi.y) / s->norm.scale + s->norm.centre.y,
                          0.5 * ((double)lo.z + (double)hi.z) / s->norm.scale + s->norm.centre.z};
    double angle = 2.0 * LUM_PI_D * i / n;
    return (struct lum_camera){p, {p.x + sin(angle), p.y, p.z - cos(angle)}, {0, 1, 0}, vfov_deg, false};
}

/* All storages take turns frame by frame, so that a drift of the machine meets them alike. */
static bool turn(struct rig *r, struct config *configs, size_t n, uint32_t which, struct irr_animation *out)
{
    struct lum_pass_stats stats;
    for (uint32_t i = 0; i < out->n_frames; i++)
        for (size_t k = 0; k < n; k++) {
            struct config *c = &configs[i % 2 ? n - 1 - k : k];
            c->settings.camera = turned(r->world.snapshot, r->settings.camera.vfov_deg, i, out->n_frames);
            if (!frame(r, c, i == 0, &stats))
                return false;
            out->ms[c->storage][which][i] = stats.ms;
            out->created[c->storage][which][i] = (double)stats.cache.created;
        }
    return true;
}

/* The median over some turns, frame by frame. */
static bool measure_turns(struct rig *r, struct config *configs, size_t n, uint32_t which, struct irr_animation *out)
{
    double ms[IRR_STORAGES][IRR_FRAMES][IRR_TURNS];
    size_t turns = lum_bench_rounds(r->options, IRR_TURNS, 1);
    for (size_t t = 0; t < turns; t++) {
        lum_bench_progress("irrcache: %s, turn with %u threads, %zu of %zu", out->name, out->n_threads[which], t + 1,
                           turns);
        if (!turn(r, configs, n, which, out))
            return false;
        for (size_t s = 0; s < IRR_STORAGES; s++)
            for (uint32_t i = 0; i < out->n_frames; i++)
                ms[s][i][t] = out->ms[s][which][i];
    }
    for (size_t s = 0; s < IRR_STORAGES; s++)
        for (uint32_t i = 0; i < out->n_frames; i++)
            out->ms[s][which][i] = lum_bench_quantile(ms[s][i], turns, 0.5);
    return true;
}

/* With as many threads as there are processors, and with the most. */
static bool measure_animation(struct rig *r, struct irr_animation *out)
{
    uint32_t most = r->study->n_crews - 1, fitting = 0;
    while (fitting < most && irr_threads[fitting + 1] <= r->study->n_processors)
        fitting++;
    const uint32_t crews[2] = {fitting, most};
    bool ok = true;
    out->n_frames = r->options->quick ? 8 : IRR_FRAMES / IRR_ROUNDS * lum_bench_rounds(r->options, IRR_ROUNDS, 2);
    for (uint32_t which = 0; ok && which < 2; which++) {
        struct config configs[IRR_STORAGES];
        size_t n = 0;
        out->n_threads[which] = irr_threads[crews[which]];
        if (which == 1 && crews[1] == crews[0])
            break;
        for (int s = IRR_LCK; ok && s < IRR_STORAGES; s++)
            ok = config_init(&configs[n++], r, (enum irr_storage)s, crews[which]);
        ok = ok && measure_turns(r, configs, n, which, out);
        for (size_t i = 0; i < n; i++)
            config_finish(&configs[i]);
    }
    return ok;
}

/* ---- the study ---- */

static bool is_turned(const char *name)
{
    for (size_t i = 0; i < IRR_ANIMATIONS; i++)
        if (strcmp(animation_names[i], name) == 0)
            return true;
    return false;
}

static bool measure_scene(struct rig *r, const char *name)
{
    struct irr_study *study = r->study;
    struct lum_error err = {0};
    if (lum_snapshot_camera(r->world.snapshot, NULL, &r->settings.camera, &err) != LUM_OK)
        return failed(&err);
    struct irr_scene *scene = &study->scenes[study->n_scenes++];
    scene->name = lum_bench_scene_name(name);
    scene->n_triangles = r->world.snapshot->n_triangles;
    if (!pools_create(r) || !measure_stills(r, scene))
        return false;
    if (!is_turned(name))
        return true;
    struct irr_animation *animation = &study->animations[study->n_animations++];
    animation->name = scene->name;
    return measure_animation(r, animation);
}

static bool run_scene(const struct lum_bench_options *options, const char *name, struct irr_study *study)
{
    struct rig r = {.options = options, .study = study, .settings = lum_view_settings_default()};
    r.settings.w = study->w;
    r.settings.h = study->h;
    r.settings.antialias = false;
    r.settings.seed = 1;
    r.settings.deterministic = false;
    r.settings.method = lum_method_find("irrcache");
    r.settings.cache_accuracy = study->accuracy;
    if (!lum_bench_world(name, 0, &r.world))
        return false;
    study->n_processors = lum_pool_size(r.world.pool);
    lum_bench_machine(&r.world, study->machine, sizeof study->machine);
    bool ok = measure_scene(&r, name);
    for (size_t i = 0; i < IRR_CREWS; i++)
        lum_pool_destroy(r.pools[i]);
    lum_world_finish(&r.world);
    return ok;
}

int lum_bench_irrcache(const struct lum_bench_options *options)
{
    struct irr_study *study = lum_calloc(1, sizeof *study);
    if (!study)
        return fprintf(stderr, "lumend-bench: out of memory\n"), 1;
    struct lum_view_settings size;
    lum_bench_size(options, (const uint32_t[]){600, 400}, (const uint32_t[]){30, 20}, &size);
    study->w = size.w;
    study->h = size.h;
    study->accuracy = 0.3f;
    study->n_crews = options->quick ? 3 : IRR_CREWS;
    lum_thread_init_fp();
    size_t n = options->scene ? 1 : options->quick ? 2 : IRR_SCENES;
    bool ok = true;
    for (size_t i = 0; ok && i < n; i++)
        ok = run_scene(options, options->scene ? options->scene : scene_names[i], study);
    ok = ok && irr_measure_lookups(study, options->quick) && irr_report(study, options);
    lum_free(study);
    return ok ? 0 : 1;
}
