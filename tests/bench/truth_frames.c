/* The truth study's measurements of one scene. */
#include <math.h>
#include <string.h>

#include "core/render/pace.h"
#include "tests/bench/truth.h"

const double truth_times_s[TRUTH_TIMES] = {0.1, 0.3, 1.0, 3.0, 10.0, 30.0};

#define ROUNDS 3u

static size_t pixel_count(const struct truth_rig *rig)
{
    return (size_t)rig->settings.w * rig->settings.h;
}

/* ---- views ---- */

bool truth_view_open(const struct truth_rig *rig, const struct lum_method *method, struct truth_view *ret_view)
{
    *ret_view = (struct truth_view){.settings = rig->settings};
    ret_view->settings.method = method;
    return lum_bench_open_view(rig->world.pool, &ret_view->view, &ret_view->caches);
}

void truth_view_close(struct truth_view *view)
{
    lum_view_destroy(view->view);
    lum_caches_destroy(view->caches);
    *view = (struct truth_view){0};
}

static void forget(struct truth_view *v)
{
    lum_view_forget(v->view);
    lum_caches_forget(v->caches);
}

bool truth_pass(const struct truth_rig *rig, const struct truth_view *view, struct lum_pass_stats *ret_stats,
                struct truth_time *inout_time)
{
    struct lum_error err = {0};
    int64_t begin_ns = lum_cpu_clock_ns();
    if (lum_view_pass(view->view, rig->world.snapshot, &view->settings, NULL, ret_stats, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    double between_s = (double)(lum_cpu_clock_ns() - begin_ns) * 1e-9;
    inout_time->own_s += ret_stats->cpu_ms * 1e-3 / lum_pool_size(rig->world.pool) + between_s;
    inout_time->wall_s += ret_stats->ms * 1e-3;
    if (ret_stats->nonfinite == 0 && ret_stats->bad_rays == 0)
        return true;
    fprintf(stderr, "lumend-bench: %s: %s: %llu values are not finite, %llu rays were not fit to trace\n", rig->scene,
            view->settings.method->name, (unsigned long long)ret_stats->nonfinite,
            (unsigned long long)ret_stats->bad_rays);
    return false;
}

/* ---- references ---- */

static void find_luminance(const float *rgb, size_t n, float *ret_luminance)
{
    for (size_t i = 0; i < n; i++)
        ret_luminance[i] = lum_luminance(lum_rgb(rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]));
}

bool truth_reference_make(const struct truth_rig *rig, const struct lum_view_settings *settings, uint32_t spp,
                          struct truth_reference *ret_reference)
{
    struct lum_bench_truth truth = lum_bench_truth_of(rig->options, &rig->world, settings);
    size_t n = pixel_count(rig);
    *ret_reference = (struct truth_reference){0};
    truth.least_spp = truth.most_spp = spp; /* blocks want all of them, however little noise a pixel has */
    truth.or_more = true;
    if (!lum_bench_reference_make(&ret_reference->r, &truth))
        return false;
    float *values = ret_reference->luminance = lum_calloc(3 * n, sizeof *values);
    if (!values)
        return lum_bench_failed("out of memory");
    find_luminance(ret_reference->r.truth, n, values);
    for (int i = 0; i < 2; i++) {
        ret_reference->halves[i] = values + (size_t)(i + 1) * n;
        find_luminance(ret_reference->r.half[i], n, values + (size_t)(i + 1) * n);
    }
    return true;
}

void truth_reference_finish(struct truth_reference *reference)
{
    lum_bench_reference_finish(&reference->r);
    lum_free(reference->luminance);
    *reference = (struct truth_reference){0};
}

/* ---- judging ---- */

/* The halves are independent of each other, so their noise cancels in the mean (reference.h). */
static double error_rms(const struct truth_reference *ref, const float *luminance, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += ((double)luminance[i] - (double)ref->halves[0][i]) * ((double)luminance[i] - (double)ref->halves[1][i]);
    return sqrt(sum / (double)n) / ref->r.mean;
}

static bool judge(const struct truth_reference *ref, const float *picture, double *ret_ratios,
                  struct truth_row *inout_row)
{
    struct lum_error err = {0};
    size_t n = (size_t)ref->r.w * ref->r.h;
    float *luminance = lum_calloc(n, sizeof *luminance);
    if (!luminance)
        return lum_bench_failed("out of memory");
    find_luminance(picture, n, luminance);
    struct lum_blocks_input in = {ref->r.w, ref->r.h, luminance, ref->luminance, {ref->halves[0], ref->halves[1]}};
    enum lum_status st = lum_blocks_compare(&in, ret_ratios, &inout_row->blocks, &err);
    inout_row->error = lum_bench_error_of_picture(&ref->r, picture);
    inout_row->error_rms = error_rms(ref, luminance, n);
    inout_row->reference_spp = ref->r.spp;
    lum_free(luminance);
    return !st || lum_bench_failed(err.text);
}

static struct truth_row new_row(const struct truth_rig *rig, const struct lum_method *method, const char *when)
{
    struct truth_row row = {.method = method->name, .error_said = (double)NAN};
    snprintf(row.scene, sizeof row.scene, "%s", rig->scene);
    snprintf(row.when, sizeof row.when, "%s", when);
    return row;
}

bool truth_tell_picture(struct truth_rig *rig, const struct truth_reference *ref, struct truth_row *row,
                        const float *picture, bool show)
{
    char text[160], file[64];
    const struct lum_blocks_result *b = &row->blocks;
    struct lum_blocks_grid grid = lum_blocks_grid(ref->r.w, ref->r.h);
    double *ratios = lum_calloc((size_t)grid.nx * grid.ny, sizeof *ratios);
    if (!ratios)
        return lum_bench_failed("out of memory");
    bool ok = judge(ref, picture, ratios, row);
    if (ok) {
        rig->study->rows[rig->study->n_rows++] = *row;
        snprintf(text, sizeof text, "%s, %s: mean %.3f, median %.3f, 5 .. 95 %% %.3f .. %.3f, SMAPE %.3f", row->method,
                 row->when, b->mean, b->median, b->p5, b->p95, row->error.smape);
        lum_bench_progress("truth: %s: %s", rig->scene, text);
        snprintf(file, sizeof file, "%s-%.*s", row->method, (int)strcspn(row->when, " "), row->when);
        ok = !show || truth_page_picture(rig, text, file, picture, ratios);
    }
    lum_free(ratios);
    return ok;
}

/* ---- at rest ---- */

/* A method that is left alone. shown: its newest picture. */
struct rest {
    struct truth_view view;
    float *shown;
    struct truth_row row;  /* of the picture that is shown; spp 0: none yet */
    uint32_t n_times, max; /* of truth_times_s: that are told; that are to be told */
    struct truth_time time;
};

/* What was shown at that time, if anything was. The last one up to 10 seconds is for the page. */
static bool tell_time(struct truth_rig *rig, struct rest *r)
{
    uint32_t i = r->n_times++;
    struct truth_row row = r->row;
    bool show = truth_times_s[i] <= 10.0 && (i + 1 == r->max || truth_times_s[i + 1] > 10.0);
    snprintf(row.when, sizeof row.when, "%g s", truth_times_s[i]);
    return !row.spp || truth_tell_picture(rig, &rig->reference, &row, r->shown, show);
}

/* The picture that a pass left. A first one of path is noise, and not for the page. */
static bool take_picture(struct truth_rig *rig, struct rest *r, const struct lum_pass_stats *stats)
{
    bool first = r->row.spp == 0;
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        r->row.rays[k] += stats->rays[k];
    if (!stats->changed)
        return true;
    r->row.own_s = r->time.own_s;
    r->row.wall_s = r->time.wall_s;
    r->row.spp = stats->spp;
    r->row.error_said = stats->error.bound;
    lum_bench_picture_of(r->view.view, r->shown);
    return !first || truth_tell_picture(rig, &rig->reference, &r->row, r->shown, !r->view.settings.method->progressive);
}

/* At a time counts what the last pass that had ended by then left. */
static bool rest_until(struct truth_rig *rig, struct rest *r)
{
    struct lum_pass_stats stats = {0};
    bool ok = true;
    while (ok && (r->n_times < r->max || r->row.spp == 0)) {
        if (stats.complete) { /* nothing changes any more */
            ok = tell_time(rig, r);
            continue;
        }
        ok = truth_pass(rig, &r->view, &stats, &r->time);
        while (ok && r->n_times < r->max && r->time.own_s > truth_times_s[r->n_times])
            ok = tell_time(rig, r);
        ok = ok && take_picture(rig, r, &stats);
    }
    return ok;
}

/* What a viewer who opens the scene sees first: of methods that refine a rough picture, of the block that a server
 * takes when it does not know yet how long a frame takes. */
static bool measure_rough(struct truth_rig *rig, const struct lum_method *method)
{
    struct truth_view view = {0};
    struct truth_time time = {0};
    struct lum_pass_stats stats;
    struct truth_row row = new_row(rig, method, "rough");
    float *picture = lum_calloc(3 * pixel_count(rig), sizeof *picture);
    bool ok = picture ? truth_view_open(rig, method, &view) : lum_bench_failed("out of memory");
    view.settings.preview = ok ? lum_pace_choose(&(struct lum_pace){0}, method, LUM_PREVIEW_MS).side : 0;
    if (ok && truth_pass(rig, &view, &stats, &time)) {
        row.own_s = time.own_s;
        row.wall_s = time.wall_s;
        memcpy(row.rays, stats.rays, sizeof row.rays);
        lum_bench_picture_of(view.view, picture);
        ok = truth_tell_picture(rig, &rig->reference, &row, picture, true);
    } else {
        ok = false;
    }
    lum_free(picture);
    truth_view_close(&view);
    return ok;
}

bool truth_measure_rest(struct truth_rig *rig)
{
    double max_s = rig->options->quick ? fmin(rig->options->seconds, 0.3) : rig->options->seconds;
    bool ok = true;
    for (size_t m = 0; m < rig->n_methods && ok; m++)
        ok = !rig->methods[m]->refines || measure_rough(rig, rig->methods[m]);
    for (size_t m = 0; m < rig->n_methods && ok; m++) {
        struct rest r = {.row = new_row(rig, rig->methods[m], "first")};
        while (r.max < TRUTH_TIMES && truth_times_s[r.max] <= max_s)
            r.max++;
        ok = truth_view_open(rig, rig->methods[m], &r.view);
        r.shown = ok ? lum_calloc(3 * pixel_count(rig), sizeof *r.shown) : NULL;
        if (ok && !r.shown)
            ok = lum_bench_failed("out of memory");
        ok = ok && rest_until(rig, &r);
        lum_free(r.shown);
        truth_view_close(&r.view);
    }
    return ok;
}

/* ---- what the first picture costs ---- */

/* A fresh frame, and a fresh sample of `path`, one after the other; in the next round the other way round. */
static bool measure_round(struct truth_rig *rig, struct truth_view views[2], uint32_t round,
                          struct truth_time ret_times[2], double *inout_cpu_s, double *inout_wall_s)
{
    for (uint32_t k = 0; k < 2; k++) {
        struct lum_pass_stats stats;
        uint32_t i = (k + round) % 2;
        ret_times[i] = (struct truth_time){0};
        forget(&views[i]);
        if (!truth_pass(rig, &views[i], &stats, &ret_times[i]))
            return false;
        *inout_cpu_s += i ? stats.cpu_ms * 1e-3 : 0.0;
        *inout_wall_s += i ? stats.ms * 1e-3 : 0.0;
    }
    return true;
}

static bool measure_cost(struct truth_rig *rig, const struct lum_method *method)
{
    double own[2][ROUNDS], wall[2][ROUNDS], cpu_s = 0.0, wall_s = 0.0;
    uint32_t rounds = rig->options->quick ? 1 : ROUNDS;
    char text[128];
    struct truth_view views[2] = {0};
    struct truth_time times[2];
    bool ok = truth_view_open(rig, method, &views[0]) && truth_view_open(rig, lum_method_find("path"), &views[1]);
    for (uint32_t i = 0; i < rounds && ok; i++) {
        ok = measure_round(rig, views, i, times, &cpu_s, &wall_s);
        for (int k = 0; k < 2; k++) {
            own[k][i] = times[k].own_s;
            wall[k][i] = times[k].wall_s;
        }
    }
    if (ok) {
        struct truth_cost *c = &rig->study->costs[rig->study->n_costs++];
        *c = (struct truth_cost){.method = method->name,
                                 .first_ms = 1e3 * lum_bench_median_of(own[0], rounds),
                                 .sample_ms = 1e3 * lum_bench_median_of(own[1], rounds),
                                 .own = lum_bench_ratio(own[0], own[1], rounds),
                                 .wall = lum_bench_ratio(wall[0], wall[1], rounds),
                                 .share = cpu_s / (wall_s * lum_pool_size(rig->world.pool))};
        snprintf(c->scene, sizeof c->scene, "%s", rig->scene);
        snprintf(text, sizeof text, "%s: first frame %.0f ms, a sample of path %.0f ms", method->name, c->first_ms,
                 c->sample_ms);
        lum_bench_progress("truth: %s: %s", rig->scene, text);
        truth_page_text(rig, text);
    }
    truth_view_close(&views[0]);
    truth_view_close(&views[1]);
    return ok;
}

bool truth_measure_costs(struct truth_rig *rig)
{
    bool ok = true;
    for (size_t m = 0; m < rig->n_methods && ok; m++)
        ok = rig->methods[m]->progressive || measure_cost(rig, rig->methods[m]);
    return ok;
}
