/* The stride study's table and the thesis' four figures. */
#include "tests/bench/stride.h"

#include <string.h>

#include "tests/bench/plot.h"
#include "tests/bench/table.h"

static const char *const part_names[STRIDE_PARTS] = {"primary", "both", "secondary"};
static const char *const rays_names[STRIDE_RAYS] = {"packets", "single"};

/* Of one curve, by stride. */
struct curve {
    double ns[STRIDE_STRIDES], q1[STRIDE_STRIDES], q3[STRIDE_STRIDES]; /* a pixel; quartiles over rounds */
    double speedup[STRIDE_STRIDES]; /* normalised: 1 when a share of the pixels takes that share of the time */
};

struct report {
    struct stride_study *study;
    const struct lum_bench_options *options;
    char machine[256];
    double strides[STRIDE_STRIDES];
    struct curve curves[STRIDE_SCENES][STRIDE_PARTS][STRIDE_RAYS][STRIDE_CREWS];
};

static void make_curve(struct stride_study *st, double samples[STRIDE_STRIDES][STRIDE_ROUNDS], struct curve *ret_curve)
{
    for (uint32_t s = 0; s < st->n_strides; s++) {
        double per_pixel = 1e9 / (double)stride_pixels(st, s);
        ret_curve->ns[s] = lum_bench_quantile(samples[s], st->n_samples[s], 0.5) * per_pixel;
        ret_curve->q1[s] = lum_bench_quantile(samples[s], st->n_samples[s], 0.25) * per_pixel;
        ret_curve->q3[s] = lum_bench_quantile(samples[s], st->n_samples[s], 0.75) * per_pixel;
        ret_curve->speedup[s] = ret_curve->ns[0] / ret_curve->ns[s];
    }
}

/* ---- the table ---- */

static const struct lum_bench_column columns[] = {
    {"scene", NULL, LUM_BENCH_TEXT},
    {"part", NULL, LUM_BENCH_TEXT},
    {"rays", NULL, LUM_BENCH_TEXT},
    {"threads", NULL, 0},
    {"stride", NULL, 0},
    {"pixels", NULL, 0},
    {"secondary_rays", NULL, 0},
    {"ns_per_pixel", NULL, 1},
    {"ns_q1", NULL, 1},
    {"ns_q3", NULL, 1},
    {"speedup_normalised", NULL, 4},
    {"sweeps", NULL, 0},
};

static void put_curve(struct lum_bench_table *t, const struct report *r, uint32_t scene, const uint32_t at[3])
{
    const struct stride_study *st = r->study;
    const struct curve *c = &r->curves[scene][at[0]][at[1]][at[2]];
    for (uint32_t s = 0; s < st->n_strides; s++) {
        LUM_BENCH_TEXTS(t, st->scenes[scene].name, part_names[at[0]], rays_names[at[1]]);
        LUM_BENCH_NUMBERS(t, at[2] == STRIDE_ONE ? 1.0 : (double)lum_pool_size(st->scenes[0].world.pool),
                          (double)st->strides[s], (double)stride_pixels(st, s),
                          at[0] == STRIDE_PRIMARY ? 0.0 : (double)st->n_secondary[scene][s], c->ns[s], c->q1[s],
                          c->q3[s], c->speedup[s], (double)st->n_samples[s]);
    }
}

static bool save_table(const struct report *r)
{
    struct lum_bench_table t = LUM_BENCH_TABLE(columns);
    for (uint32_t scene = 0; scene < r->study->n_scenes; scene++)
        for (uint32_t i = 0; i < STRIDE_PARTS * STRIDE_RAYS * STRIDE_CREWS; i++) {
            const uint32_t at[3] = {i % STRIDE_PARTS, i / STRIDE_PARTS % STRIDE_RAYS, i / STRIDE_PARTS / STRIDE_RAYS};
            put_curve(&t, r, scene, at);
        }
    return lum_bench_table_finish(&t, r->options, "stride");
}

/* ---- figures ---- */

struct figure {
    const char *file, *title;
    enum stride_part part;
    bool speedup;
    enum lum_plot_scale scale;
};

/* The thesis' figures 4.3.1 to 4.3.4, but for its linear time axis in the third: waking workers for one pixel costs a
 * hundred times the pixel. */
static const struct figure figures[] = {
    {"stride-primary.svg", "Primary rays only", STRIDE_PRIMARY, false, LUM_PLOT_LOG10},
    {"stride-both.svg", "Primary and secondary rays", STRIDE_BOTH, false, LUM_PLOT_LOG10},
    {"stride-secondary.svg", "Secondary rays only", STRIDE_SECONDARY, false, LUM_PLOT_LOG10},
    {"stride-speedup.svg", "Normalised speed-up, primary and secondary rays", STRIDE_BOTH, true, LUM_PLOT_LINEAR},
};

/* Solid packets and dashed single rays in one colour a scene; two grey entries explain. */
#define MAX_SERIES (STRIDE_SCENES * STRIDE_RAYS + 2)

static size_t make_series(const struct report *r, const struct figure *f, uint32_t crew,
                          struct lum_plot_series ret_series[MAX_SERIES])
{
    size_t n = 0;
    for (uint32_t scene = 0; scene < r->study->n_scenes; scene++)
        for (uint32_t rays = 0; rays < STRIDE_RAYS; rays++) {
            const struct curve *c = &r->curves[scene][f->part][rays][crew];
            ret_series[n++] = (struct lum_plot_series){
                .label = rays == STRIDE_PACKETS ? r->study->scenes[scene].name : NULL,
                .color = scene,
                .dashed = rays == STRIDE_SINGLES,
                .n = r->study->n_strides,
                .x = r->strides,
                .y = f->speedup ? c->speedup : c->ns,
                .y_lo = f->speedup ? NULL : c->q1,
                .y_hi = f->speedup ? NULL : c->q3,
            };
        }
    ret_series[n++] = (struct lum_plot_series){.label = "packets of 16", .color = LUM_PLOT_GREY};
    ret_series[n++] = (struct lum_plot_series){.label = "single rays", .color = LUM_PLOT_GREY, .dashed = true};
    return n;
}

static bool draw(const struct report *r, const struct figure *figure)
{
    struct lum_plot_series series[STRIDE_CREWS][MAX_SERIES];
    struct lum_plot_panel panels[STRIDE_CREWS];
    char many[64], subtitle[256];
    snprintf(many, sizeof many, "(b) all threads: %u", lum_pool_size(r->study->scenes[0].world.pool));
    snprintf(subtitle, sizeof subtitle, "%u × %u pixels, of which every stride-th in x and in y is rendered. %s",
             r->study->side, r->study->side,
             figure->speedup ? "1: a share of the pixels takes that share of the time" : "Bars: quartiles");
    for (uint32_t crew = 0; crew < STRIDE_CREWS; crew++)
        panels[crew] = (struct lum_plot_panel){
            .title = crew == STRIDE_ONE ? "(a) one thread" : many,
            .x = {"stride", LUM_PLOT_LOG2, 1.0, (double)r->study->side},
            .y = {figure->speedup ? "normalised speed-up" : "time per pixel, ns", figure->scale, 0.0, 0.0},
            .series = series[crew],
            .n_series = make_series(r, figure, crew, series[crew]),
        };
    const struct lum_plot plot = {figure->title, subtitle, panels, STRIDE_CREWS, figure->speedup};
    return lum_bench_plot(r->options, figure->file, &plot, r->machine);
}

/* ---- what stdout shows ---- */

static const struct lum_bench_column scene_columns[] = {
    {"scene", "scene", LUM_BENCH_TEXT}, {"objects", "objects", 0}, {"triangles", "triangles", 0},
    {"materials", "materials", 0},      {"lights", "lights", 0},   {"secondary", "secondary rays a pixel", 2},
};

/* After the thesis' table 4.1. */
static bool print_scenes(const struct report *r)
{
    struct lum_bench_table t = LUM_BENCH_TABLE(scene_columns);
    for (uint32_t i = 0; i < r->study->n_scenes; i++) {
        const struct lum_snapshot *s = r->study->scenes[i].world.snapshot;
        lum_bench_table_text(&t, r->study->scenes[i].name);
        LUM_BENCH_NUMBERS(&t, (double)s->n_instances, (double)s->n_triangles, (double)s->n_materials,
                          (double)s->lights.n_lights,
                          (double)r->study->n_secondary[i][0] / (double)stride_pixels(r->study, 0));
    }
    return lum_bench_table_finish(&t, r->options, NULL);
}

static const struct lum_bench_column summary_columns[] = {
    {"scene", "scene", LUM_BENCH_TEXT},
    {"threads", "threads", 0},
    {"rays", "rays", LUM_BENCH_TEXT},
    {"first", "ns a pixel", 0},
    {"primary", "16: primary", 2},
    {"secondary", "secondary", 2},
    {"both", "speed-up", 2},
    {"primary_far", "256: primary", 2},
    {"secondary_far", "secondary", 2},
    {"both_far", "speed-up", 2},
};

/* At strides 16 and 256: how many times more a pixel costs, and what part of the ideal speed-up remains. */
static bool print_summary(const struct report *r)
{
    struct lum_bench_table t = LUM_BENCH_TABLE(summary_columns);
    for (uint32_t i = 0; i < r->study->n_scenes * STRIDE_RAYS * STRIDE_CREWS; i++) {
        uint32_t scene = i / STRIDE_CREWS / STRIDE_RAYS, crew = i / STRIDE_RAYS % STRIDE_CREWS, rays = i % STRIDE_RAYS;
        const struct curve *primary = &r->curves[scene][STRIDE_PRIMARY][rays][crew];
        const struct curve *both = &r->curves[scene][STRIDE_BOTH][rays][crew];
        const struct curve *secondary = &r->curves[scene][STRIDE_SECONDARY][rays][crew];
        lum_bench_table_text(&t, r->study->scenes[scene].name);
        lum_bench_table_number(&t, crew == STRIDE_ONE ? 1.0 : (double)lum_pool_size(r->study->scenes[0].world.pool));
        lum_bench_table_text(&t, rays_names[rays]);
        lum_bench_table_number(&t, both->ns[0]);
        for (uint32_t s = 0; s < r->study->n_strides; s++) {
            if (r->study->strides[s] != 16 && r->study->strides[s] != 256)
                continue;
            LUM_BENCH_NUMBERS(&t, 1.0 / primary->speedup[s], 1.0 / secondary->speedup[s], both->speedup[s]);
        }
    }
    return lum_bench_table_finish(&t, r->options, NULL);
}

bool stride_report(struct stride_study *study, const struct lum_bench_options *options)
{
    static struct report r;
    r.study = study;
    r.options = options;
    lum_bench_machine(&study->scenes[0].world, r.machine, sizeof r.machine);
    for (uint32_t s = 0; s < study->n_strides; s++)
        r.strides[s] = (double)study->strides[s];
    for (uint32_t scene = 0; scene < study->n_scenes; scene++)
        for (uint32_t part = 0; part < STRIDE_PARTS; part++)
            for (uint32_t rays = 0; rays < STRIDE_RAYS; rays++)
                for (uint32_t crew = 0; crew < STRIDE_CREWS; crew++)
                    make_curve(study, study->seconds[scene][part][rays][crew], &r.curves[scene][part][rays][crew]);
    printf("%u x %u pixels; %s\n", study->side, study->side, r.machine);
    bool ok = print_scenes(&r);
    puts(
        "\nStride 1: what a pixel costs, primary and secondary rays. Strides 16 and 256: how many times that, and the\n"
        "speed-up as a part of the ideal one.");
    ok = ok && print_summary(&r) && save_table(&r);
    for (size_t i = 0; ok && i < LUM_ARRAY_LEN(figures); i++)
        ok = draw(&r, &figures[i]);
    return ok;
}
