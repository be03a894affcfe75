/* Adaptive interleaved sampling against its maximum, against instant global illumination, and against the product's own
 * method: the thesis' tables 5.1 to 5.3 on our scenes.
 *
 * One process a run, one scene after the other, 600 x 400, rays through pixel centres, 256 VPLs as in 5.4, which the
 * thesis' methods get as many slots for as that takes (slots.h), and whose 9 shadow samples a light are the pattern's.
 * Every timed frame is fresh: the view forgets what it memoised, but keeps its memory. Methods and parts take turns;
 * each round runs them once forwards and once backwards (A B B A), and ratios are taken within a round, so that a drift
 * of the machine cancels. A part alone is the frame with all other effects off.
 *
 * Of glossy surfaces ais shows what lights they reflect, and live also what else they do, by paths. So that methods are
 * compared at the same effects, gloss is off in the first of two rows of such a scene; the second one is ais and live
 * with all that they have.
 *
 * Errors are against path tracing through the same pixels (reference.h).
 *
 * Error against cost: the same frame at more and fewer VPLs and, in live, rays for soft shadows and records; and path,
 * sample by sample. Of these a method's front is left, without those that cost more than others of less error. Which
 * VPLs are drawn shows in the error, so that the best of many budgets is one that was lucky, too: half of the draws
 * pick the front, and the other half say what its errors are. */
#include "tests/bench/ais.h"

#include <math.h>
#include <string.h>

#include "core/vpl/vpl.h"
#include "server/world/scene_source.h"
#include "tests/bench/slots.h"
#include "tests/bench/variants.h"

const char *const ais_methods[AIS_METHODS] = {"ais", "ais-max", "igi", "live"};
const char *const ais_parts[AIS_PARTS] = {"ID", "SS", "PM", "FULL"};

/* --quick takes the first three. */
static const char *const scene_names[] = {"cornell",    "cornell-media", "desk",         "office",        "sibenik",
                                          "conference", "shirley6",      "office-media", "shirley6-media"};
#define QUICK_SCENES 3u

#define BIT(effect) (1u << (effect))
#define DIRECT_BITS (BIT(LUM_EFFECT_DIRECT) | BIT(LUM_EFFECT_SOFT_SHADOW) | BIT(LUM_EFFECT_ENVIRONMENT))
#define ALL_BITS (BIT(LUM_EFFECT_COUNT) - 1u)
#define PARTLY_BITS BIT(LUM_EFFECT_GLOSSY) /* what ais serves in part */

static const uint32_t part_bits[AIS_PARTS] = {
    [AIS_ID] = BIT(LUM_EFFECT_INDIRECT_DIFFUSE) | BIT(LUM_EFFECT_TRANSMISSION), /* else rooms have no windows */
    [AIS_SS] = DIRECT_BITS,
    [AIS_PM] = BIT(LUM_EFFECT_MEDIA),
    [AIS_FULL] = ALL_BITS,
};
/* What a method must serve to be compared in full. */
#define CORE_BITS (DIRECT_BITS | BIT(LUM_EFFECT_INDIRECT_DIFFUSE) | BIT(LUM_EFFECT_MEDIA))

/* The last two numbers are of live alone. What a frame of live is best spent on is another thing in every scene: all
 * three together, or many VPLs for few records, or for hard shadows. */
static const struct budget {
    uint32_t n_vpls, shadow_budget;
    float cache_accuracy;
    bool live_alone;
} budgets[] = {{32, 0, 0.6f, false},
               {64, 0, 0.5f, false},
               {128, 0, 0.4f, false},
               {192, 25000, 0.3f, false},
               {AIS_VPLS, 100000, LUM_CACHE_ACCURACY, false}, /* DEFAULT */
               {AIS_VPLS, 25000, 0.5f, true},
               {AIS_VPLS, 50000, 0.3f, true},
               {384, 25000, 0.6f, true},
               {384, 50000, 0.3f, true},
               {512, 50000, 0.5f, true},
               {512, 200000, LUM_CACHE_ACCURACY, false},
               {1024, 400000, LUM_CACHE_ACCURACY, false}};
_Static_assert(LUM_ARRAY_LEN(budgets) <= AIS_POINTS, "a curve holds them all");
#define DEFAULT 4u /* what the product has */

/* One scene at work. */
struct rig {
    const struct lum_bench_options *options;
    struct lum_world world;
    struct lum_view_settings settings; /* the thesis' */
    struct lum_bench_reference reference;
    struct ais_scene *out;
};

static bool failed(const struct lum_error *err)
{
    fprintf(stderr, "lumend-bench: %s\n", err->text);
    return false;
}

static uint32_t demanded(const struct lum_demand *d)
{
    uint32_t bits = 0;
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        bits |= d->on[e] ? BIT(e) : 0u;
    return bits;
}

static uint32_t served(const struct lum_method *m)
{
    uint32_t bits = 0;
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        bits |= m->serves[e] ? BIT(e) : 0u;
    return bits;
}

/* True when there is something to compare. */
static bool takes_part(const struct rig *r, enum ais_method method, enum ais_part part)
{
    const struct lum_method *m = lum_method_find(ais_methods[method]);
    if (!m || (r->out->partly && (part != AIS_FULL || (method != AIS_A && method != AIS_LIVE))))
        return false;
    uint32_t wanted = demanded(&r->reference.demand) & part_bits[part] & CORE_BITS;
    return wanted != 0 && (wanted & ~served(m)) == 0;
}

/* Slots for so many virtual point lights. */
static uint32_t slots_of(const struct rig *r, bool live, uint32_t n_vpls)
{
    uint64_t n = live ? n_vpls : (uint64_t)n_vpls * r->out->n_slots / AIS_VPLS;
    return n < LUM_VPL_MAX ? (uint32_t)n : LUM_VPL_MAX;
}

static struct lum_view_settings settings_of(const struct rig *r, enum ais_method method, enum ais_part part)
{
    struct lum_view_settings s = r->settings;
    s.method = lum_method_find(ais_methods[method]);
    s.effects_off |= ALL_BITS & ~part_bits[part];
    s.n_vpls = slots_of(r, method == AIS_LIVE, AIS_VPLS);
    return s;
}

static bool fresh_frame(const struct rig *r, struct lum_view *view, struct lum_caches *caches,
                        const struct lum_view_settings *settings, struct lum_pass_stats *ret_stats)
{
    struct lum_error err = {0};
    lum_view_forget(view);
    lum_caches_forget(caches);
    if (lum_view_pass(view, r->world.snapshot, settings, NULL, ret_stats, &err) != LUM_OK)
        return failed(&err);
    if (ret_stats->nonfinite == 0 && ret_stats->bad_rays == 0)
        return true;
    fprintf(stderr, "lumend-bench: %s: %llu values are not finite, %llu rays were not fit to trace\n",
            settings->method->name, (unsigned long long)ret_stats->nonfinite, (unsigned long long)ret_stats->bad_rays);
    return false;
}

static uint64_t sum_rays(const uint64_t rays[LUM_RAY_KIND_COUNT])
{
    uint64_t sum = 0;
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        sum += rays[k];
    return sum;
}

/* ---- the reference ---- */

static bool make_reference(struct rig *r)
{
    struct lum_bench_truth truth = lum_bench_truth_of(r->options, &r->world, &r->settings);
    if (!lum_bench_reference_make(&r->reference, &truth))
        return false;
    r->out->reference_spp = r->reference.spp;
    r->out->reference_relmse = r->reference.relmse;
    return true;
}

/* ---- frames per second ---- */

/* The configurations of a scene, with a view each, so that no buffer is made while a frame is timed. */
struct config {
    struct lum_view *view;
    struct lum_caches *caches; /* its own */
    struct lum_view_settings settings;
    struct ais_cell *cell;
    struct lum_bench_error *error; /* NULL, like curve: not of AIS_FULL */
    struct ais_curve *curve;
};
struct configs {
    struct config at[AIS_METHODS * AIS_PARTS];
    size_t n;
};

/* A frame for which something was kept costs less than a fresh one, and is none: threads may share out the making of
 * records otherwise, but no tenth of the rays goes by that. */
static bool is_fresh(const struct config *c, const struct lum_pass_stats *stats)
{
    if ((double)sum_rays(stats->rays) >= 0.9 * (double)sum_rays(c->cell->rays))
        return true;
    fprintf(stderr, "lumend-bench: %s: a fresh frame took %llu rays, the first one %llu: something was kept\n",
            c->settings.method->name, (unsigned long long)sum_rays(stats->rays),
            (unsigned long long)sum_rays(c->cell->rays));
    return false;
}

/* The map has those after the first one. Pixels without indirect light, such as the sky's, have none of them. */
static double iterations_of(const struct rig *r, const struct lum_view *view)
{
    const uint8_t *map = lum_view_guidance(view, LUM_EFFECT_INDIRECT_DIFFUSE);
    size_t n = (size_t)r->settings.w * r->settings.h;
    double sum = 0.0;
    for (size_t i = 0; map && i < n; i++)
        sum += map[i];
    return map ? 1.0 + sum / (double)n : (double)NAN;
}

static bool time_configs(struct rig *r, const struct configs *configs)
{
    struct lum_pass_stats stats;
    size_t rounds = lum_bench_rounds(r->options, AIS_ROUNDS, 2), n = configs->n;
    for (size_t i = 0; i < n; i++) { /* warm-up; makes the buffers */
        const struct config *c = &configs->at[i];
        if (!fresh_frame(r, c->view, c->caches, &c->settings, &stats))
            return false;
        memcpy(c->cell->rays, stats.rays, sizeof stats.rays);
        c->cell->n = rounds;
    }
    for (size_t round = 0; round < rounds; round++)
        for (size_t i = 0; i < 2 * n; i++) {
            const struct config *c = &configs->at[i < n ? i : 2 * n - 1 - i];
            if (!fresh_frame(r, c->view, c->caches, &c->settings, &stats) || !is_fresh(c, &stats))
                return false;
            c->cell->ms[round] += 0.5 * stats.ms;
            c->cell->cpu_ms[round] += 0.5 * stats.cpu_ms;
        }
    for (size_t i = 0; i < n; i++) {
        if (configs->at[i].error)
            *configs->at[i].error = lum_bench_error_of(&r->reference, configs->at[i].view);
        if (configs->at[i].cell == &r->out->cells[AIS_A][AIS_ID])
            r->out->iterations = iterations_of(r, configs->at[i].view);
    }
    return true;
}

/* ---- error against cost ---- */

/* Frames of a method at a budget, each with a draw of VPLs and light samples of its own. */
struct draws {
    size_t n;
    double cpu_ms[AIS_DRAWS];
    struct lum_bench_error error[2]; /* sums: of even draws, and of odd ones */
    uint64_t rays;                   /* sum */
};

/* Left out are draws beyond two of frames that take a second, and of methods whose curves are drawn, but not compared;
 * and, but for the default, methods that took two seconds with fewer VPLs. */
static bool is_enough(const struct rig *r, const struct config *c, const struct budget *budget, const struct draws *d)
{
    bool live = c->cell == &r->out->cells[AIS_LIVE][AIS_FULL], compared = c->curve != &r->out->curves[AIS_MAX];
    if (!c->curve || (budget->live_alone && !live))
        return true;
    for (size_t i = 0; i < c->curve->n; i++)
        if (c->curve->points[i].cpu_ms > 2000.0 && c->curve->points[i].n_vpls < budget->n_vpls &&
            budget != &budgets[DEFAULT])
            return true;
    return d->n >= 2 && (!compared || d->cpu_ms[0] > 1000.0);
}

/* False: it failed. */
static bool draw_frame(struct rig *r, const struct config *c, const struct budget *budget, struct draws *inout)
{
    struct lum_pass_stats stats = {0};
    struct lum_view_settings s = c->settings;
    s.n_vpls = slots_of(r, c->cell == &r->out->cells[AIS_LIVE][AIS_FULL], budget->n_vpls);
    s.shadow_budget = budget->shadow_budget;
    s.cache_accuracy = budget->cache_accuracy;
    s.seed += (uint32_t)inout->n;
    if (is_enough(r, c, budget, inout))
        return true;
    if (!fresh_frame(r, c->view, c->caches, &s, &stats))
        return false;
    struct lum_bench_error error = lum_bench_error_of(&r->reference, c->view);
    inout->error[inout->n % 2].relmse += error.relmse;
    inout->error[inout->n % 2].smape += error.smape;
    inout->rays += sum_rays(stats.rays);
    inout->cpu_ms[inout->n++] = stats.cpu_ms;
    return true;
}

static struct lum_bench_error mean_of(const struct lum_bench_error *sum, size_t n)
{
    return (struct lum_bench_error){sum->relmse / (double)n, sum->smape / (double)n};
}

/* Methods take turns. A point's CPU time is the least of its draws, its errors are means. */
static bool measure_budget(struct rig *r, const struct configs *configs, const struct budget *budget)
{
    struct draws draws[LUM_ARRAY_LEN(configs->at)] = {0};
    size_t rounds = lum_bench_rounds(r->options, AIS_DRAWS, 1);
    for (size_t round = 0; round < rounds; round++)
        for (size_t i = 0; i < configs->n; i++)
            if (!draw_frame(r, &configs->at[i], budget, &draws[i]))
                return false;
    for (size_t i = 0; i < configs->n; i++) {
        struct draws *d = &draws[i];
        size_t n_odd = d->n / 2;
        if (!d->n)
            continue;
        configs->at[i].curve->points[configs->at[i].curve->n++] = (struct ais_point){
            .at_default = budget == &budgets[DEFAULT],
            .n_vpls = budget->n_vpls,
            .shadow_budget = budget->shadow_budget,
            .cache_accuracy = (double)budget->cache_accuracy,
            .cpu_ms = lum_bench_quantile(d->cpu_ms, d->n, 0.0),
            .picked_by = mean_of(&d->error[0], d->n - n_odd),
            .error = n_odd ? mean_of(&d->error[1], n_odd) : mean_of(&d->error[0], d->n),
            .rays = d->rays / d->n,
        };
    }
    return true;
}

static bool measure_configs(struct rig *r, const struct configs *configs)
{
    lum_bench_progress("ais: %s: frames, after %u samples of the reference", r->out->name, r->out->reference_spp);
    bool ok = time_configs(r, configs);
    lum_bench_progress("ais: %s: error against cost", r->out->name);
    for (size_t i = 0; ok && i < LUM_ARRAY_LEN(budgets); i++)
        if (!r->options->quick || i % DEFAULT == 0) /* then the first, the default, and one of live alone */
            ok = measure_budget(r, configs, &budgets[i]);
    return ok;
}

static bool measure_methods(struct rig *r)
{
    struct configs configs = {.n = 0};
    struct lum_error err = {0};
    bool ok = true;
    for (int m = 0; m < AIS_METHODS; m++) {
        r->out->errors[m] = (struct lum_bench_error){(double)NAN, (double)NAN};
        for (int p = 0; ok && p < AIS_PARTS; p++) {
            if (!takes_part(r, (enum ais_method)m, (enum ais_part)p))
                continue;
            struct config c = {.settings = settings_of(r, (enum ais_method)m, (enum ais_part)p),
                               .cell = &r->out->cells[m][p],
                               .error = p == AIS_FULL ? &r->out->errors[m] : NULL,
                               .curve = p == AIS_FULL ? &r->out->curves[m] : NULL};
            ok = lum_view_create(r->world.pool, &c.view, &err) == LUM_OK || failed(&err);
            ok = ok && (lum_caches_create(lum_pool_size(r->world.pool), &c.caches, &err) == LUM_OK || failed(&err));
            if (ok)
                lum_view_share(c.view, c.caches);
            if (c.view)
                configs.at[configs.n++] = c;
        }
    }
    ok = ok && measure_configs(r, &configs);
    for (size_t i = 0; i < configs.n; i++) {
        lum_view_destroy(configs.at[i].view);
        lum_caches_destroy(configs.at[i].caches);
    }
    return ok;
}

/* After 1, 2, 4 .. 128 samples. */
static bool measure_path(struct rig *r, struct ais_curve *ret_curve)
{
    struct lum_view *view = NULL;
    struct lum_error err = {0};
    if (lum_view_create(r->world.pool, &view, &err) != LUM_OK)
        return failed(&err);
    struct lum_view_settings s = r->settings;
    s.method = lum_method_find("path");
    struct ais_point p = {0};
    bool ok = true;
    while (ok && ret_curve->n < (r->options->quick ? 3 : 8)) {
        struct lum_pass_stats stats = {0};
        ok = lum_view_pass(view, r->world.snapshot, &s, NULL, &stats, &err) == LUM_OK || failed(&err);
        p.cpu_ms += stats.cpu_ms;
        p.rays += sum_rays(stats.rays);
        p.spp++;
        if (ok && (p.spp & (p.spp - 1u)) == 0) {
            p.error = lum_bench_error_of(&r->reference, view);
            p.picked_by = p.error;
            ret_curve->points[ret_curve->n++] = p;
        }
    }
    lum_view_destroy(view);
    return ok;
}

/* ---- a scene ---- */

/* off: effects that all methods and the reference go without. */
static bool measure_row(struct rig *r, struct ais_study *study, const char *name, uint32_t off)
{
    struct lum_demand demand;
    lum_demand_derive(r->world.snapshot, &demand);
    uint32_t partly = demanded(&demand) & PARTLY_BITS;
    if (off && !partly)
        return true;
    r->out = &study->scenes[study->n_scenes++];
    r->out->partly = partly & ~off;
    snprintf(r->out->name, sizeof r->out->name, "%s%s", name, off ? "-no-gloss" : "");
    r->settings.effects_off = off;
    lum_bench_progress("ais: %s: reference", r->out->name);
    r->out->n_slots = lum_bench_slots_for(&r->world, &r->settings, AIS_VPLS);
    bool ok = r->out->n_slots > 0 && make_reference(r) && measure_methods(r);
    if (ok)
        lum_bench_progress("ais: %s: error against cost of path", r->out->name);
    ok = ok && measure_path(r, &r->out->curves[AIS_METHODS]);
    lum_bench_reference_finish(&r->reference);
    return ok;
}

static bool run_scene(const struct lum_bench_options *options, const char *scene, struct ais_study *study)
{
    struct lum_error err = {0};
    struct rig r = {.options = options, .settings = lum_view_settings_default()};
    r.settings.w = study->w;
    r.settings.h = study->h;
    r.settings.antialias = false;
    r.settings.n_vpls = AIS_VPLS;
    r.settings.seed = 1;
    if (!lum_bench_world(scene, 0, &r.world))
        return false;
    lum_device_trace_singly(r.world.device, options->single_rays);
    lum_bench_machine(&r.world, study->machine, sizeof study->machine);
    const char *name = lum_bench_scene_name(scene);
    bool ok = lum_snapshot_camera(r.world.snapshot, NULL, &r.settings.camera, &err) == LUM_OK || failed(&err);
    ok = ok && measure_row(&r, study, name, PARTLY_BITS) && measure_row(&r, study, name, 0);
    lum_world_finish(&r.world);
    return ok;
}

int lum_bench_ais(const struct lum_bench_options *options)
{
    struct ais_study *study = lum_calloc(1, sizeof *study);
    if (!study)
        return fprintf(stderr, "lumend-bench: out of memory\n"), 1;
    struct lum_view_settings size;
    lum_bench_size(options, (const uint32_t[]){600, 400}, (const uint32_t[]){60, 40}, &size);
    study->w = size.w;
    study->h = size.h;
    lum_thread_init_fp();
    for (int m = 0; m < AIS_METHODS; m++)
        if (!lum_method_find(ais_methods[m]))
            printf("skipped: there is no method %s\n", ais_methods[m]);
    bool ok = true;
    if (options->scene)
        ok = run_scene(options, options->scene, study);
    size_t n = options->scene ? 0 : options->quick ? QUICK_SCENES : LUM_ARRAY_LEN(scene_names);
    for (size_t i = 0; ok && i < n; i++) {
        if (lum_scene_builtin(lum_bench_variant_base(scene_names[i])))
            ok = run_scene(options, scene_names[i], study);
        else
            printf("skipped: there is no scene %s\n", scene_names[i]);
    }
    ok = ok && ais_report(study, options);
    lum_free(study);
    return ok ? 0 : 1;
}
