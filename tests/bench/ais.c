/* Adaptive interleaved sampling against its maximum, against instant global illumination, and against the product's own
 * method: the thesis' tables 5.1 to 5.3 on our scenes.
 *
 * One process a run, one scene after the other, 600 x 400, rays through pixel centres, 256 VPLs and 9 shadow samples a
 * light as in 5.4. Every timed frame is fresh: the view forgets what it memoised, but keeps its memory. Methods and
 * parts take turns; each round runs them once forwards and once backwards (A B B A), and ratios are taken within a
 * round, so that a drift of the machine cancels. A part alone is the frame with all other effects forced off.
 *
 * Errors are against path tracing through the same pixels (reference.h).
 *
 * Error against cost: the same frame at more and fewer VPLs and shadow samples; and path, sample by sample. */
#include "tests/bench/ais.h"

#include <math.h>
#include <string.h>

#include "server/scene_source.h"

const char *const ais_methods[AIS_METHODS] = {"ais", "ais-max", "igi", "live"};
const char *const ais_parts[AIS_PARTS] = {"ID", "SS", "PM", "FULL"};

/* --quick takes the first two. */
static const char *const scene_names[] = {"cornell", "cornell-media", "desk",     "office",
                                          "sibenik", "conference",    "shirley6", "office-media"};
#define QUICK_SCENES 2u

#define BIT(effect) (1u << (effect))
#define DIRECT_BITS (BIT(LUM_EFFECT_DIRECT) | BIT(LUM_EFFECT_SOFT_SHADOW) | BIT(LUM_EFFECT_ENVIRONMENT))
#define ALL_BITS (BIT(LUM_EFFECT_COUNT) - 1u)

static const uint32_t part_bits[AIS_PARTS] = {
    [AIS_ID] = BIT(LUM_EFFECT_INDIRECT_DIFFUSE),
    [AIS_SS] = DIRECT_BITS,
    [AIS_PM] = BIT(LUM_EFFECT_MEDIA),
    [AIS_FULL] = ALL_BITS,
};
/* What a method must serve to be compared in full. */
#define CORE_BITS (DIRECT_BITS | BIT(LUM_EFFECT_INDIRECT_DIFFUSE) | BIT(LUM_EFFECT_MEDIA))

static const struct {
    uint32_t n_vpls, shadow_samples;
} budgets[] = {{32, 1}, {64, 4}, {128, 4}, {256, 9}, {512, 9}, {1024, 16}};

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
static bool takes_part(const struct rig *r, const struct lum_method *m, enum ais_part part)
{
    if (!m)
        return false;
    uint32_t wanted = demanded(&r->reference.demand) & part_bits[part] & CORE_BITS;
    return wanted != 0 && (wanted & ~served(m)) == 0;
}

static struct lum_view_settings settings_of(const struct rig *r, const struct lum_method *m, enum ais_part part)
{
    struct lum_view_settings s = r->settings;
    s.method = m;
    s.effects_off = ALL_BITS & ~part_bits[part];
    return s;
}

static bool fresh_frame(const struct rig *r, struct lum_view *view, const struct lum_view_settings *settings,
                        struct lum_pass_stats *ret_stats)
{
    struct lum_error err = {0};
    lum_view_forget(view);
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
    bool quick = r->options->quick;
    struct lum_bench_truth truth = {&r->world, &r->settings, quick ? 16 : 64, quick ? 16 : 128, r->options->references};
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
    struct lum_view_settings settings;
    struct ais_cell *cell;
};

static bool time_configs(struct rig *r, struct config *configs, size_t n)
{
    struct lum_pass_stats stats;
    size_t rounds = r->options->quick ? 2 : AIS_ROUNDS;
    for (size_t i = 0; i < n; i++) { /* warm-up; makes the buffers */
        if (!fresh_frame(r, configs[i].view, &configs[i].settings, &stats))
            return false;
        memcpy(configs[i].cell->rays, stats.rays, sizeof stats.rays);
        configs[i].cell->n = rounds;
    }
    for (size_t round = 0; round < rounds; round++)
        for (size_t i = 0; i < 2 * n; i++) {
            struct config *c = &configs[i < n ? i : 2 * n - 1 - i];
            if (!fresh_frame(r, c->view, &c->settings, &stats))
                return false;
            c->cell->ms[round] += 0.5 * stats.ms;
            c->cell->cpu_ms[round] += 0.5 * stats.cpu_ms;
        }
    return true;
}

static bool measure_frames(struct rig *r)
{
    struct config configs[AIS_METHODS * AIS_PARTS];
    struct lum_error err = {0};
    size_t n = 0;
    bool ok = true;
    for (int m = 0; m < AIS_METHODS; m++)
        for (int p = 0; ok && p < AIS_PARTS; p++) {
            const struct lum_method *method = lum_method_find(ais_methods[m]);
            if (!takes_part(r, method, (enum ais_part)p))
                continue;
            struct config c = {NULL, settings_of(r, method, (enum ais_part)p), &r->out->cells[m][p]};
            ok = lum_view_create(r->world.pool, &c.view, &err) == LUM_OK || failed(&err);
            if (ok)
                configs[n++] = c;
        }
    ok = ok && time_configs(r, configs, n);
    for (int m = 0; m < AIS_METHODS; m++)
        r->out->errors[m] = (struct lum_bench_error){(double)NAN, (double)NAN};
    for (size_t i = 0; i < n; i++) {
        ptrdiff_t cell = configs[i].cell - &r->out->cells[0][0];
        if (ok && cell % AIS_PARTS == AIS_FULL)
            r->out->errors[cell / AIS_PARTS] = lum_bench_error_of(&r->reference, configs[i].view);
        lum_view_destroy(configs[i].view);
    }
    return ok;
}

/* ---- error against cost ---- */

/* A frame at settings, and the median of its CPU time; dear ones are not repeated. */
static bool measure_point(struct rig *r, struct lum_view *view, const struct lum_view_settings *s,
                          struct ais_point *ret_point)
{
    enum { FRAMES = 3 };
    double cpu_ms[FRAMES], sum_ms = 0.0, enough_ms = r->options->quick ? 0.0 : 1000.0;
    struct lum_pass_stats stats = {0};
    size_t n = 0;
    do {
        if (!fresh_frame(r, view, s, &stats))
            return false;
        cpu_ms[n++] = stats.cpu_ms;
        sum_ms += stats.cpu_ms;
    } while (n < FRAMES && sum_ms < enough_ms);
    *ret_point = (struct ais_point){
        .n_vpls = s->n_vpls,
        .shadow_samples = s->shadow_samples,
        .cpu_ms = lum_bench_quantile(cpu_ms, n, 0.5),
        .relmse = lum_bench_error_of(&r->reference, view).relmse,
        .rays = sum_rays(stats.rays),
    };
    return true;
}

/* Ends where a frame takes seconds. */
static bool measure_budgets(struct rig *r, const struct lum_method *method, struct ais_curve *ret_curve)
{
    struct lum_view *view = NULL;
    struct lum_error err = {0};
    if (lum_view_create(r->world.pool, &view, &err) != LUM_OK)
        return failed(&err);
    struct lum_view_settings s = settings_of(r, method, AIS_FULL);
    bool ok = true, dear = false;
    for (size_t i = 0; ok && !dear && i < LUM_ARRAY_LEN(budgets); i += r->options->quick ? 3 : 1) {
        struct ais_point *p = &ret_curve->points[ret_curve->n];
        s.n_vpls = budgets[i].n_vpls;
        s.shadow_samples = budgets[i].shadow_samples;
        ok = measure_point(r, view, &s, p);
        ret_curve->n += ok;
        dear = p->cpu_ms > 2000.0;
    }
    lum_view_destroy(view);
    return ok;
}

/* After 1, 2, 4 .. samples. */
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
    while (ok && ret_curve->n < (r->options->quick ? 3 : AIS_POINTS)) {
        struct lum_pass_stats stats = {0};
        ok = lum_view_pass(view, r->world.snapshot, &s, NULL, &stats, &err) == LUM_OK || failed(&err);
        p.cpu_ms += stats.cpu_ms;
        p.rays += sum_rays(stats.rays);
        p.spp++;
        if (ok && (p.spp & (p.spp - 1u)) == 0) {
            p.relmse = lum_bench_error_of(&r->reference, view).relmse;
            ret_curve->points[ret_curve->n++] = p;
        }
    }
    lum_view_destroy(view);
    return ok;
}

/* ---- a scene ---- */

static bool measure_scene(struct rig *r)
{
    struct lum_error err = {0};
    if (lum_snapshot_camera(r->world.snapshot, NULL, &r->settings.camera, &err) != LUM_OK)
        return failed(&err);
    lum_bench_progress("ais: %s: reference", r->out->name);
    if (!make_reference(r))
        return false;
    lum_bench_progress("ais: %s: frames, after %u samples of the reference", r->out->name, r->out->reference_spp);
    if (!measure_frames(r))
        return false;
    for (int m = 0; m < AIS_METHODS; m++) {
        if (!r->out->cells[m][AIS_FULL].n)
            continue;
        lum_bench_progress("ais: %s: error against cost of %s", r->out->name, ais_methods[m]);
        if (!measure_budgets(r, lum_method_find(ais_methods[m]), &r->out->curves[m]))
            return false;
    }
    lum_bench_progress("ais: %s: error against cost of path", r->out->name);
    return measure_path(r, &r->out->curves[AIS_METHODS]);
}

static bool run_scene(const struct lum_bench_options *options, const char *name, struct ais_study *study)
{
    struct rig r = {.options = options, .settings = lum_view_settings_default()};
    r.settings.w = study->w;
    r.settings.h = study->h;
    r.settings.antialias = false;
    r.settings.n_vpls = 256;
    r.settings.shadow_samples = 9;
    r.settings.seed = 1;
    if (!lum_bench_world(name, 0, &r.world))
        return false;
    lum_device_trace_singly(r.world.device, options->single_rays);
    lum_bench_machine(&r.world, study->machine, sizeof study->machine);
    r.out = &study->scenes[study->n_scenes++];
    r.out->name = lum_bench_scene_name(name);
    bool ok = measure_scene(&r);
    lum_bench_reference_finish(&r.reference);
    lum_world_finish(&r.world);
    return ok;
}

int lum_bench_ais(const struct lum_bench_options *options)
{
    struct ais_study *study = lum_calloc(1, sizeof *study);
    if (!study)
        return fprintf(stderr, "lumend-bench: out of memory\n"), 1;
    study->w = options->quick ? 120 : 600;
    study->h = options->quick ? 80 : 400;
    lum_thread_init_fp();
    for (int m = 0; m < AIS_METHODS; m++)
        if (!lum_method_find(ais_methods[m]))
            printf("skipped: there is no method %s\n", ais_methods[m]);
    bool ok = true;
    if (options->scene)
        ok = run_scene(options, options->scene, study);
    size_t n = options->scene ? 0 : options->quick ? QUICK_SCENES : LUM_ARRAY_LEN(scene_names);
    for (size_t i = 0; ok && i < n; i++) {
        if (lum_scene_builtin(scene_names[i]))
            ok = run_scene(options, scene_names[i], study);
        else
            printf("skipped: there is no scene %s\n", scene_names[i]);
    }
    ok = ok && ais_report(study, options);
    lum_free(study);
    return ok ? 0 : 1;
}
