/* The effects study as tables on stdout, as CSV and JSON, and as bars. */
#include "tests/bench/effects.h"

#include <math.h>
#include <string.h>

#include "tests/bench/bars.h"
#include "tests/bench/table.h"

#define TEXT LUM_BENCH_TEXT

/* "direct+media"; "none". */
static void name_effects(uint32_t bits, char *ret_text, size_t size)
{
    size_t n = 0;
    snprintf(ret_text, size, "none");
    for (uint32_t e = 0; e < LUM_EFFECT_COUNT; e++)
        if (bits & LUM_EFFECT_BIT(e) && n < size)
            n += (size_t)snprintf(ret_text + n, size - n, "%s%s", n ? "+" : "", lum_effect_names[e]);
}

static double ms_of(const struct effects_frame *f, uint32_t effect)
{
    return (double)f->effects[effect].ns * 1e-6;
}

/* ---- what each effect costs ---- */

static const struct lum_bench_column cost_columns[] = {
    {"scene", "scene", TEXT},
    {"method", "method", TEXT},
    {"effect", "effect", TEXT},
    {"why", "needed because", TEXT},
    {"rays", "rays", 0},
    {"tiles", "tiles", 0},
    {"ms_in_frame", "ms in the frame", 2},
    {"ms_alone", "ms alone", 2},
    {"ms_saved", "ms saved without", 2},
};

/* Alone: over the frame with no effect at all. */
static void add_cost(struct lum_bench_table *t, const struct effects_case *c, uint32_t e)
{
    uint32_t bit = LUM_EFFECT_BIT(e);
    const struct effects_frame *none = effects_frame_with(c, 0), *full = effects_frame_with(c, c->varied);
    const struct effects_frame *alone = effects_frame_with(c, bit), *without = effects_frame_with(c, c->varied & ~bit);
    bool served = c->varied & bit;
    LUM_BENCH_TEXTS(t, c->scene, c->method->name, lum_effect_names[e], c->demand.why[e]);
    LUM_BENCH_NUMBERS(t, (double)full->effects[e].rays, (double)full->effects[e].tiles, ms_of(full, e),
                      served ? alone->cpu_ms - none->cpu_ms : (double)NAN,
                      served ? full->cpu_ms - without->cpu_ms : (double)NAN);
}

static bool report_costs(const struct effects_study *study, const struct lum_bench_options *options)
{
    struct lum_bench_table t = LUM_BENCH_TABLE(cost_columns);
    for (size_t i = 0; i < study->n_cases; i++)
        for (uint32_t e = 0; e < LUM_EFFECT_COUNT && study->cases[i].n_frames; e++)
            add_cost(&t, &study->cases[i], e);
    printf("CPU time of a fresh frame by effect, %s\n", study->machine);
    return lum_bench_table_finish(&t, options, "effects");
}

/* ---- every subset ---- */

static const struct lum_bench_column subset_columns[] = {
    {"scene", NULL, TEXT},     {"method", NULL, TEXT},    {"subset", NULL, TEXT},
    {"frame_cpu_ms", NULL, 3}, {"primary_rays", NULL, 0}, {"effect", NULL, TEXT},
    {"on", NULL, 0},           {"rays", NULL, 0},         {"effect_cpu_ms", NULL, 4},
};

static void add_subset(struct lum_bench_table *t, const struct effects_case *c, const struct effects_frame *f)
{
    char subset[128];
    name_effects(f->on, subset, sizeof subset);
    for (uint32_t e = 0; e < LUM_EFFECT_COUNT; e++) {
        LUM_BENCH_TEXTS(t, c->scene, c->method->name, subset);
        LUM_BENCH_NUMBERS(t, f->cpu_ms, (double)f->primary_rays);
        lum_bench_table_text(t, lum_effect_names[e]);
        LUM_BENCH_NUMBERS(t, f->on & LUM_EFFECT_BIT(e) ? 1.0 : 0.0, (double)f->effects[e].rays, ms_of(f, e));
    }
}

static bool report_subsets(const struct effects_study *study, const struct lum_bench_options *options)
{
    struct lum_bench_table t = LUM_BENCH_TABLE(subset_columns);
    for (size_t i = 0; i < study->n_cases; i++)
        for (uint32_t k = 0; k < study->cases[i].n_frames; k++)
            add_subset(&t, &study->cases[i], &study->cases[i].frames[k]);
    return lum_bench_table_finish(&t, options, "effects-subsets");
}

/* ---- what methods leave out ---- */

static const struct lum_bench_column left_columns[] = {
    {"scene", "scene", TEXT},
    {"method", "method", TEXT},
    {"left_out", "leaves out", TEXT},
    {"percent", "% of the energy", 2},
};

static bool report_left_out(const struct effects_study *study, const struct lum_bench_options *options)
{
    char names[128];
    struct lum_bench_table t = LUM_BENCH_TABLE(left_columns);
    for (size_t i = 0; i < study->n_cases; i++) {
        const struct effects_case *c = &study->cases[i];
        name_effects(c->demanded & ~c->varied, names, sizeof names);
        LUM_BENCH_TEXTS(&t, c->scene, c->method->name, names);
        lum_bench_table_number(&t, 100.0 * c->left_out);
    }
    printf("\nWhat each method leaves out of what the scene calls for\n");
    return lum_bench_table_finish(&t, options, "effects-left-out");
}

/* ---- bars ---- */

static void fill_row(struct lum_bars_row *row, const struct effects_case *c)
{
    const struct effects_frame *full = effects_frame_with(c, c->varied);
    double rest = full->cpu_ms;
    snprintf(row->label, sizeof row->label, "%s, %s", c->scene, c->method->name);
    for (uint32_t e = 0; e < LUM_EFFECT_COUNT; e++) {
        row->parts[e] = ms_of(full, e);
        rest -= row->parts[e];
    }
    row->parts[LUM_EFFECT_COUNT] = fmax(rest, 0.0);
}

static bool report_bars(const struct effects_study *study, const struct lum_bench_options *options)
{
    const char *parts[LUM_EFFECT_COUNT + 1];
    memcpy(parts, lum_effect_names, sizeof lum_effect_names);
    parts[LUM_EFFECT_COUNT] = "all else";
    struct lum_bars_row *rows = lum_calloc(study->n_cases, sizeof *rows);
    size_t n = 0;
    FILE *f = rows ? lum_bench_open(options, "effects-bars.svg") : NULL;
    if (!f) {
        lum_free(rows);
        return false;
    }
    for (size_t i = 0; i < study->n_cases; i++)
        if (study->cases[i].n_frames)
            fill_row(&rows[n++], &study->cases[i]);
    char subtitle[320];
    snprintf(subtitle, sizeof subtitle, "One frame from nothing, all effects that the scene calls for. %s%s",
             study->machine, options->quick ? LUM_BENCH_QUICK : "");
    lum_bars_write(f, &(struct lum_bars){.title = "Where a frame's CPU time goes",
                                         .subtitle = subtitle,
                                         .axis = "CPU time of all threads together",
                                         .unit = "ms",
                                         .parts = parts,
                                         .n_parts = LUM_ARRAY_LEN(parts),
                                         .rows = rows,
                                         .n_rows = n});
    lum_free(rows);
    return lum_bench_close(f, "effects-bars.svg");
}
_Static_assert(LUM_EFFECT_COUNT + 1 <= LUM_BARS_PARTS, "a colour for each effect, and one for the rest");

bool effects_report(const struct effects_study *study, const struct lum_bench_options *options)
{
    return report_costs(study, options) && report_subsets(study, options) && report_left_out(study, options) &&
           report_bars(study, options);
}
