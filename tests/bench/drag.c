/* Does a view whose eye is dragged keep the time that it was given? By CPU time, as on a machine of its own: what
 * others do there meanwhile is not in it (tests/bench/drag_view.py has a daemon, and the clock).
 *
 * The eye swings about what it looks at; how rough each frame is, is chosen from what those before took, as a daemon
 * does (core/render/pace.h). A frame that takes less than its time is no fault: a whole picture may be had for it. */
#include <math.h>
#include <string.h>

#include "core/render/pace.h"
#include "tests/bench/places.h"
#include "tests/bench/table.h"

#define METHODS "live"
#define SWING_RAD 0.15 /* either way: what stands in the middle is seen past */
#define SWING_M 0.25   /* and no farther: behind a wall there is nothing to be seen, in no time */
#define STEP_RAD 0.003 /* of the swing's phase, for each ms of a frame: .05 for each of 60 a second */
#define MOST 1.2       /* of what was promised: within a fifth of it */

enum { WARM = 10, FRAMES = 60, QUICK_FRAMES = 4, MAX_FRAMES = LUM_BENCH_SAMPLES };

struct rig {
    struct lum_bench_stand at;
    struct lum_view *view;
    struct lum_caches *caches;
    struct lum_pace pace;
    double phase;
    /* of frames that count */
    size_t n;
    double over_budget[MAX_FRAMES], over_foreseen[MAX_FRAMES], side[MAX_FRAMES];
    uint32_t n_kept, n_foreseen, n_below;
};

struct tables {
    struct lum_bench_table drags, frames;
};

static const struct lum_bench_column columns[] = {
    {"scene", "scene", LUM_BENCH_TEXT},
    {"method", "method", LUM_BENCH_TEXT},
    {"budget_ms", "budget, ms", 0},
    {"frames", "frames", 0},
    {"over_budget", "took / budget", 2},
    {"within_budget", "within 1.2 of it", 2},
    {"kept", "or of what was foreseen, where that is more", 2},
    {"over_foreseen", "took / foreseen", 2},
    {"foreseen", "foreseen within a fifth", 2},
    {"side", "blocks", 0},
    {"side_least", NULL, 0},
    {"side_most", NULL, 0},
};
static const struct lum_bench_column frame_columns[] = {
    {"scene", NULL, LUM_BENCH_TEXT},
    {"method", NULL, LUM_BENCH_TEXT},
    {"eased", NULL, LUM_BENCH_TEXT},
    {"budget_ms", NULL, 0},
    {"frame", NULL, 0},
    {"side", NULL, 0},
    {"foreseen_ms", NULL, 2},
    {"ms", NULL, 2},
    {"fixed_ms", NULL, 2},
};

/* Turned about the point that it looks at, about the axis of y. swing: -1 to 1. */
static struct lum_camera swung(const struct lum_camera *camera, double swing)
{
    struct lum_camera c = *camera;
    double x = c.position.x - c.target.x, z = c.position.z - c.target.z;
    double angle = swing * fmin(SWING_RAD, SWING_M / fmax(hypot(x, z), SWING_M)), sine = sin(angle),
           cosine = cos(angle);
    c.position.x = c.target.x + cosine * x - sine * z;
    c.position.z = c.target.z + sine * x + cosine * z;
    return c;
}

/* As note_pace of the daemon's views does. */
static void note_pace(struct rig *rig, const struct lum_view_settings *s, const struct lum_pass_stats *pass, double ms)
{
    const struct lum_pace_ease *ease = lum_pace_ease_of(s->method);
    double own = pass->ms > 0.0 ? ms / pass->ms : 1.0; /* of a stage's time by the clock */
    lum_pace_note(&rig->pace, s->method,
                  &(struct lum_pace_pass){.side = pass->preview,
                                          .eased = pass->preview > 1 && s->preview_eased,
                                          .ms = ms,
                                          .fixed_ms = own * lum_pace_fixed_ms(pass),
                                          .stage_ms = ease ? own * pass->stage_ms[ease->stage] : 0.0});
}

static bool run_pass(struct rig *rig, const struct lum_view_settings *s, struct lum_pass_stats *ret_pass,
                     double *ret_ms)
{
    struct lum_error err = {0};
    int64_t begin_ns = lum_cpu_clock_ns();
    if (lum_view_pass(rig->view, rig->at.world.snapshot, s, NULL, ret_pass, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    *ret_ms = ret_pass->cpu_ms / lum_pool_size(rig->at.world.pool) + (double)(lum_cpu_clock_ns() - begin_ns) * 1e-6;
    return true;
}

static bool open_view(struct rig *rig)
{
    struct lum_view_settings s = rig->at.settings;
    struct lum_pass_stats pass = {0};
    double ms = 0.0;
    rig->pace = (struct lum_pace){0};
    rig->phase = 0.0;
    rig->n = 0;
    rig->n_kept = rig->n_foreseen = rig->n_below = 0;
    if (!lum_bench_open_view(rig->at.world.pool, &rig->view, &rig->caches))
        return false;
    while (pass.spp == 0) { /* a drag begins at a picture that is whole */
        if (!run_pass(rig, &s, &pass, &ms))
            return false;
        note_pace(rig, &s, &pass, ms);
    }
    return true;
}

static void close_view(struct rig *rig)
{
    lum_view_destroy(rig->view);
    lum_caches_destroy(rig->caches);
    rig->view = NULL;
    rig->caches = NULL;
}

static void count(struct rig *rig, double budget_ms, const struct lum_pace_choice *c, double ms)
{
    double foreseen = isfinite(c->ms) ? c->ms : budget_ms;
    rig->over_budget[rig->n] = ms / budget_ms;
    rig->over_foreseen[rig->n] = ms / foreseen;
    rig->side[rig->n++] = c->side;
    rig->n_below += ms <= MOST * budget_ms;
    rig->n_kept += ms <= MOST * fmax(budget_ms, foreseen);
    rig->n_foreseen += ms <= MOST * foreseen && ms >= (2.0 - MOST) * foreseen;
}

static bool run_frame(struct rig *rig, double budget_ms, bool counts, struct lum_bench_table *frames)
{
    struct lum_view_settings s = rig->at.settings;
    struct lum_pace_choice c = lum_pace_choose(&rig->pace, s.method, budget_ms);
    struct lum_pass_stats pass;
    double ms = 0.0;
    s.preview = c.side;
    s.preview_eased = c.eased != NULL;
    s.camera = swung(&rig->at.settings.camera, sin(rig->phase));
    if (!run_pass(rig, &s, &pass, &ms))
        return false;
    note_pace(rig, &s, &pass, ms);
    rig->phase += STEP_RAD * fmax(ms, budget_ms);
    if (!counts)
        return true;
    LUM_BENCH_TEXTS(frames, rig->at.place->scene, s.method->name, c.eased ? c.eased : "");
    LUM_BENCH_NUMBERS(frames, budget_ms, (double)rig->n, (double)c.side, c.ms, ms, lum_pace_fixed_ms(&pass));
    count(rig, budget_ms, &c, ms);
    return true;
}

static void tell(struct rig *rig, double budget_ms, struct lum_bench_table *table)
{
    double n = (double)rig->n, least = INFINITY, most = 0.0;
    for (size_t i = 0; i < rig->n; i++) {
        least = fmin(least, rig->side[i]);
        most = fmax(most, rig->side[i]);
    }
    LUM_BENCH_TEXTS(table, rig->at.place->scene, rig->at.settings.method->name);
    LUM_BENCH_NUMBERS(table, budget_ms, n, lum_bench_median_of(rig->over_budget, rig->n), rig->n_below / n,
                      rig->n_kept / n, lum_bench_median_of(rig->over_foreseen, rig->n), rig->n_foreseen / n,
                      lum_bench_median_of(rig->side, rig->n), least, most);
}

static bool measure_budget(struct rig *rig, double budget_ms, struct tables *t)
{
    uint32_t n = rig->at.options->quick ? QUICK_FRAMES : FRAMES;
    lum_bench_progress("drag: %s: %s, %.0f ms", rig->at.place->scene, rig->at.settings.method->name, budget_ms);
    bool ok = open_view(rig);
    for (uint32_t i = 0; i < WARM + n && ok; i++)
        ok = run_frame(rig, budget_ms, i >= WARM, &t->frames);
    close_view(rig);
    if (ok)
        tell(rig, budget_ms, &t->drags);
    return ok;
}

static void close_rig(void *of)
{
    struct rig *rig = of;
    close_view(rig);
    lum_bench_stand_close(&rig->at);
}

static bool measure_scene(void *of, void *tables)
{
    static const double budgets_ms[] = {60.0, 120.0, 240.0};
    struct rig *rig = of;
    if (!lum_bench_stand_open(&rig->at, (const uint32_t[]){600, 400}, (const uint32_t[]){48, 32}))
        return false;
    bool ok = true;
    rig->at.settings.error_share = LUM_ERROR_SHARE;                                    /* as of a daemon's views */
    double pixels = (double)rig->at.settings.w * rig->at.settings.h / (600.0 * 400.0); /* smaller ones have less time */
    for (size_t m = 0; m < rig->at.n_methods && ok; m++) {
        rig->at.settings.method = rig->at.methods[m];
        for (size_t i = 0; i < LUM_ARRAY_LEN(budgets_ms) && ok; i++)
            ok = measure_budget(rig, fmax(1.0, budgets_ms[i] * pixels), tables);
    }
    return ok;
}

int lum_bench_drag(const struct lum_bench_options *options)
{
    const struct lum_bench_tour tour = {METHODS, sizeof(struct rig), measure_scene, close_rig};
    struct tables t = {LUM_BENCH_TABLE(columns), LUM_BENCH_TABLE(frame_columns)};
    bool ok = lum_bench_go(&tour, options, &t);
    ok = lum_bench_table_finish(&t.drags, options, "drag") && ok;
    ok = lum_bench_table_finish(&t.frames, options, "drag-frames") && ok;
    return ok ? 0 : 1;
}
