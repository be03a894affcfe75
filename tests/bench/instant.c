/* Instant caching against instant global illumination, against itself without memory of the frame before, and against
 * the product's own method: the thesis' tables 6.1 to 6.5 on our scenes.
 *
 * 600 x 400, rays through pixel centres, 256 VPLs as in 6.3, which all methods of the thesis get as many slots for as
 * that takes (slots.h); every method with one shadow ray a light, and without the budget that `live` has for soft
 * shadows: what is compared is indirect light. RT is `whitted`: no indirect light.
 *
 * First frames: each is fresh, that is, the view forgets what it memoised and its cache, but keeps its memory. Methods
 * and parts take turns; each round runs them once forwards and once backwards (A B B A), and ratios are taken within a
 * round, so that a drift of the machine cancels.
 *
 * The diffuse component: a frame with all other effects forced off but what goes through glass, and of that the stages
 * VPLs to filter; so without primary rays.
 *
 * Animations: the built-in replays of 6.3.2, one pose a frame. Every method and part has a view and a cache of its own
 * and sees the same snapshots; they take turns pose by pose, in one order and then in the other, and ratios are taken
 * pose by pose. The first pose, which builds all, does not count. What the scene itself needs to move is the same for
 * all and left out.
 *
 * Errors are against path tracing through the same pixels (reference.h), of the first frame and of the last pose: of
 * whole frames, in which `ic` and `tic` have hard shadows and `igi` and `live` soft ones; and of indirect light alone,
 * in which all do the same. Each method bounds its VPLs as suits it best: of 1/2, 1 and 2 radii, and in the thesis' way
 * or by a clamp, `igi` had the least error with one (core/vpl/gather.h), `ic` and `tic` with another
 * (core/cache/instant.c). */
#include "tests/bench/instant.h"

#include <string.h>

#include "server/world/scene_source.h"
#include "tests/bench/slots.h"
#include "tests/bench/variants.h"

const char *const instant_methods[INSTANT_METHODS] = {"whitted", "igi", "ic", "tic", "live"};
const char *const instant_parts[INSTANT_PARTS] = {"whole", "diffuse"};
const char *const instant_growths[INSTANT_GROWTHS] = {"vpls", "accuracy", "movers", "triangles", "pixels"};

/* Accuracy: `a` of 6.2.5 in metres, which the thesis does not give. 0.2 makes some thousand records in a room; in the
 * cathedral it makes 32 000, and 0.35 makes 15 000; a larger one lets normals differ so much that edges of patches
 * show. --quick takes the first two. */
static const struct {
    const char *name;
    float accuracy;
} scenes[] = {
    {"cornell", 0.2f},     {"wobble", 0.2f},    {"desk", 0.2f},      {"bunnies-1", 0.2f},
    {"bunnies-2", 0.2f},   {"bunnies-4", 0.2f}, {"bunnies-9", 0.2f}, {"cornell-indirect", 0.2f},
    {"conference", 0.25f}, {"sibenik", 0.35f},  {"office", 0.2f},    {"cornell-mirrors", 0.2f},
};
#define QUICK_SCENES 2u

#define BIT(effect) (1u << (effect))
#define ALL_BITS (BIT(LUM_EFFECT_COUNT) - 1u)

/* A scene at work. */
struct rig {
    const struct lum_bench_options *options;
    struct lum_world world;
    struct lum_view_settings settings;
    struct lum_ops moves; /* its replay */
    size_t n_moves_done;
    struct lum_bench_reference reference;
};

/* A method and part at work. */
struct config {
    struct lum_view *view;
    struct lum_caches *caches; /* its own */
    struct lum_view_settings settings;
    bool diffuse; /* what is timed: the stages of indirect light, in a frame that has nothing else */
    struct instant_cell *cell;
};
enum { MAX_CONFIGS = INSTANT_METHODS * INSTANT_PARTS };
struct configs {
    struct config items[MAX_CONFIGS];
    size_t n;
};

/* ---- frames ---- */

static bool run_frame(const struct rig *r, const struct config *c, struct lum_pass_stats *ret_stats)
{
    struct lum_error err = {0};
    if (lum_view_pass(c->view, r->world.snapshot, &c->settings, NULL, ret_stats, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    if (ret_stats->nonfinite == 0 && ret_stats->bad_rays == 0)
        return true;
    fprintf(stderr, "lumend-bench: %s: %llu values are not finite, %llu rays were not fit to trace\n",
            c->settings.method->name, (unsigned long long)ret_stats->nonfinite,
            (unsigned long long)ret_stats->bad_rays);
    return false;
}

static void close_configs(struct configs *all)
{
    for (size_t i = 0; i < all->n; i++) {
        lum_view_destroy(all->items[i].view);
        lum_caches_destroy(all->items[i].caches);
    }
    all->n = 0;
}

static bool open_config(const struct rig *r, struct config *c)
{
    struct lum_error err = {0};
    if (lum_view_create(r->world.pool, &c->view, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    if (lum_caches_create(lum_pool_size(r->world.pool), &c->caches, &err) != LUM_OK) {
        lum_view_destroy(c->view);
        return lum_bench_failed(err.text);
    }
    lum_view_share(c->view, c->caches);
    return true;
}

/* Effects that are left out. Panes stay: a room that is lit through its window is dark without. */
static uint32_t off_in(enum instant_part part)
{
    return part == INSTANT_DIFFUSE ? ALL_BITS & ~(BIT(LUM_EFFECT_INDIRECT_DIFFUSE) | BIT(LUM_EFFECT_TRANSMISSION)) : 0;
}

/* parts: bits of enum instant_part. cells: of each method and part. Live keeps the number of slots that settings ask
 * for. */
static bool open_configs(const struct rig *r, uint32_t parts, struct instant_cell (*cells)[INSTANT_PARTS],
                         struct configs *ret_all)
{
    uint32_t n_slots = lum_bench_slots_for(&r->world, &r->settings, r->settings.n_vpls);
    ret_all->n = 0;
    if (n_slots == 0)
        return false;
    for (int m = 0; m < INSTANT_METHODS; m++)
        for (int p = 0; p < INSTANT_PARTS; p++) {
            struct config c = {NULL, NULL, r->settings, p == INSTANT_DIFFUSE, &cells[m][p]};
            c.settings.method = lum_method_find(instant_methods[m]);
            c.settings.effects_off = off_in((enum instant_part)p);
            c.settings.n_vpls = m == INSTANT_LIVE ? r->settings.n_vpls : n_slots;
            if (!c.settings.method || !(parts >> p & 1u) || (p == INSTANT_DIFFUSE && m == INSTANT_RT))
                continue;
            if (!open_config(r, &c)) {
                close_configs(ret_all);
                return false;
            }
            ret_all->items[ret_all->n++] = c;
        }
    return true;
}

/* Wall time of the frame, or of the stages of its indirect light. */
static double ms_of(const struct config *c, const struct lum_pass_stats *stats)
{
    static const enum lum_stage stages[] = {LUM_STAGE_VPLS,     LUM_STAGE_CACHE,  LUM_STAGE_RECORDS,
                                            LUM_STAGE_INDIRECT, LUM_STAGE_FILTER, LUM_STAGE_UPSAMPLE};
    double sum = 0.0;
    for (size_t i = 0; i < LUM_ARRAY_LEN(stages); i++)
        sum += stats->stage_ms[stages[i]];
    return c->diffuse ? sum : stats->ms;
}

/* CPU time is not told stage by stage: it is shared out by wall time. */
static double cpu_ms_of(const struct config *c, const struct lum_pass_stats *stats)
{
    return stats->cpu_ms * ms_of(c, stats) / stats->ms;
}

static void count(struct instant_cell *cell, const struct lum_pass_stats *stats, double share)
{
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        cell->rays[k] += share * (double)stats->rays[k];
    cell->records += share * (double)stats->cache.records;
    cell->created += share * (double)stats->cache.created;
    cell->updated += share * (double)stats->cache.updated;
}

/* The turn that comes k-th: forwards, or backwards. */
static struct config *turn(struct configs *all, size_t k, bool backwards)
{
    return &all->items[backwards ? all->n - 1 - k : k];
}

/* Fresh frames of the snapshot. */
static bool time_first(const struct rig *r, struct configs *all)
{
    struct lum_pass_stats stats;
    size_t rounds = lum_bench_rounds(r->options, INSTANT_ROUNDS, 2);
    for (size_t i = 0; i < all->n; i++) { /* warm-up; makes the buffers */
        if (!run_frame(r, &all->items[i], &stats))
            return false;
        count(all->items[i].cell, &stats, 1.0);
        all->items[i].cell->n = rounds;
    }
    for (size_t round = 0; round < rounds; round++)
        for (size_t k = 0; k < 2 * all->n; k++) {
            struct config *c = turn(all, k % all->n, k >= all->n);
            lum_view_forget(c->view);
            lum_caches_forget(c->caches);
            if (!run_frame(r, c, &stats))
                return false;
            c->cell->ms[round] += 0.5 * ms_of(c, &stats);
            c->cell->cpu_ms[round] += 0.5 * cpu_ms_of(c, &stats);
        }
    return true;
}

/* ---- animations ---- */

/* Edits and publishes. */
static bool apply(struct rig *r, const struct lum_ops *ops)
{
    struct lum_changes changes;
    struct lum_proto_error perr;
    struct lum_error err = {0};
    if (!lum_world_apply(&r->world, &(struct lum_edit){.user = "bench", .ops = ops}, &changes, &perr))
        return lum_bench_failed(perr.text);
    lum_changes_finish(&changes);
    return lum_world_commit(&r->world, &err) == LUM_OK || lum_bench_failed(err.text);
}

/* The edits of the next instant. */
static bool next_pose(struct rig *r)
{
    size_t from = r->n_moves_done, n = 1;
    while (from + n < r->moves.n && r->moves.t_ms[from + n] == r->moves.t_ms[from])
        n++;
    r->n_moves_done += n;
    return apply(r, &(struct lum_ops){.ops = r->moves.ops + from, .n = n});
}

static bool time_pose(const struct rig *r, struct configs *all, size_t pose, size_t n_poses)
{
    struct lum_pass_stats stats;
    for (size_t k = 0; k < all->n; k++) {
        struct config *c = turn(all, k, pose % 2 == 1);
        if (!run_frame(r, c, &stats))
            return false;
        if (pose == 0)
            continue; /* builds all */
        c->cell->ms[pose - 1] = ms_of(c, &stats);
        c->cell->cpu_ms[pose - 1] = cpu_ms_of(c, &stats);
        c->cell->n = pose;
        count(c->cell, &stats, 1.0 / (double)n_poses);
    }
    return true;
}

/* n_poses frames after the first; fewer where the replay ends. */
static bool time_moving(struct rig *r, struct configs *all, size_t n_poses)
{
    size_t pose = 0;
    for (; pose <= n_poses && r->n_moves_done < r->moves.n; pose++)
        if (!next_pose(r) || !time_pose(r, all, pose, n_poses))
            return false;
    for (size_t i = 0; i < all->n && pose <= n_poses; i++) { /* averages are over fewer */
        struct instant_cell *c = all->items[i].cell;
        double share = (double)n_poses / (double)(pose - 1);
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
            c->rays[k] *= share;
        c->records *= share;
        c->created *= share;
        c->updated *= share;
    }
    return true;
}

/* ---- a scene ---- */

static void close_rig(struct rig *r)
{
    lum_bench_reference_finish(&r->reference);
    lum_ops_finish(&r->moves);
    lum_world_finish(&r->world);
}

static bool open_rig(struct rig *r, const struct lum_bench_options *options, const char *scene, float accuracy)
{
    char replay[80];
    struct lum_error err = {0};
    struct lum_proto_error perr;
    *r = (struct rig){.options = options, .settings = lum_view_settings_default()};
    lum_bench_size(options, (const uint32_t[]){600, 400}, (const uint32_t[]){60, 40}, &r->settings);
    r->settings.antialias = false;
    r->settings.n_vpls = 256;
    r->settings.shadow_samples = 1;
    r->settings.shadow_budget = 0;
    r->settings.seed = 1;
    r->settings.cache_accuracy = accuracy;
    if (!lum_bench_world(scene, 0, &r->world))
        return false;
    lum_device_trace_singly(r->world.device, options->single_rays);
    snprintf(replay, sizeof replay, "%s-moves", lum_bench_variant_base(scene));
    if (lum_replay_builtin(replay) && !lum_edits_load(replay, &r->moves, &perr)) {
        close_rig(r);
        return lum_bench_failed(perr.text);
    }
    if (lum_snapshot_camera(r->world.snapshot, NULL, &r->settings.camera, &err) == LUM_OK)
        return true;
    close_rig(r);
    return lum_bench_failed(err.text);
}

/* The view of a method and part; NULL: there is none. */
static const struct lum_view *view_of(const struct configs *all, const struct instant_frames *frames,
                                      enum instant_method m, enum instant_part part)
{
    for (size_t i = 0; i < all->n; i++)
        if (all->items[i].cell == &frames->cells[m][part])
            return all->items[i].view;
    return NULL;
}

/* Table 6.5: what is seen of each method's error, and of what tic and igi differ by. */
static bool look_at_part(const struct rig *r, enum instant_part part, const struct configs *all,
                         struct instant_frames *frames)
{
    const uint32_t w = r->settings.w, h = r->settings.h;
    const size_t n = 3 * (size_t)w * h;
    float *pictures = lum_calloc(n * INSTANT_METHODS, sizeof *pictures);
    bool ok = pictures || lum_bench_failed("out of memory");
    ok = ok && lum_bench_look(w, h, r->reference.half[0], r->reference.half[1], &frames->noise[part]);
    for (int m = 0; ok && m < INSTANT_METHODS; m++) {
        const struct lum_view *view = view_of(all, frames, (enum instant_method)m, part);
        frames->seen[m][part] = LUM_BENCH_NOT_SEEN;
        if (!view)
            continue;
        lum_bench_picture_of(view, pictures + n * (size_t)m);
        ok = lum_bench_look(w, h, pictures + n * (size_t)m, r->reference.truth, &frames->seen[m][part]);
    }
    ok = ok && lum_bench_look(w, h, pictures + n * INSTANT_TIC, pictures + n * INSTANT_IGI, &frames->tic_igi[part]);
    lum_free(pictures);
    return ok;
}

/* Of what the views show of a part. */
static bool measure_errors_of(struct rig *r, enum instant_part part, const struct configs *all,
                              struct instant_frames *frames)
{
    struct lum_view_settings settings = r->settings;
    settings.effects_off = off_in(part);
    struct lum_bench_truth truth = lum_bench_truth_of(r->options, &r->world, &settings);
    for (int m = 0; m < INSTANT_METHODS; m++)
        frames->errors[m][part] = (struct lum_bench_error){(double)NAN, (double)NAN};
    lum_bench_reference_finish(&r->reference);
    lum_bench_progress("instant: the same by path tracing: %s", instant_parts[part]);
    if (!lum_bench_reference_make(&r->reference, &truth))
        return false;
    frames->reference_spp = r->reference.spp;
    frames->reference_relmse[part] = r->reference.relmse;
    for (size_t i = 0; i < all->n; i++) {
        ptrdiff_t cell = all->items[i].cell - &frames->cells[0][0];
        if (cell % INSTANT_PARTS == (ptrdiff_t)part)
            frames->errors[cell / INSTANT_PARTS][part] = lum_bench_error_of(&r->reference, all->items[i].view);
    }
    return look_at_part(r, part, all, frames);
}

static bool measure_errors(struct rig *r, const struct configs *all, struct instant_frames *frames)
{
    return measure_errors_of(r, INSTANT_WHOLE, all, frames) && measure_errors_of(r, INSTANT_DIFFUSE, all, frames);
}

#define ALL_PARTS (1u << INSTANT_WHOLE | 1u << INSTANT_DIFFUSE)

static bool measure_first(struct rig *r, struct instant_frames *frames)
{
    struct configs all;
    if (!open_configs(r, ALL_PARTS, frames->cells, &all))
        return false;
    bool ok = time_first(r, &all) && measure_errors(r, &all, frames);
    close_configs(&all);
    return ok;
}

static bool measure_moving(struct rig *r, struct instant_frames *frames)
{
    struct configs all;
    if (!open_configs(r, ALL_PARTS, frames->cells, &all))
        return false;
    size_t n_poses =
        r->options->quick ? 6 : INSTANT_POSES / INSTANT_ROUNDS * lum_bench_rounds(r->options, INSTANT_ROUNDS, 2);
    bool ok = time_moving(r, &all, n_poses) && measure_errors(r, &all, frames);
    close_configs(&all);
    return ok;
}

static bool run_scene(const struct lum_bench_options *options, const char *name, float accuracy,
                      struct instant_study *study)
{
    struct rig r;
    if (!open_rig(&r, options, name, accuracy))
        return false;
    struct instant_scene *s = &study->scenes[study->n_scenes++];
    s->name = lum_bench_scene_name(name);
    s->accuracy = (double)accuracy;
    s->n_slots = lum_bench_slots_for(&r.world, &r.settings, r.settings.n_vpls);
    s->moves = r.moves.n > 0;
    study->w = r.settings.w;
    study->h = r.settings.h;
    lum_bench_machine(&r.world, study->machine, sizeof study->machine);
    lum_bench_progress("instant: %s: first frame", s->name);
    bool ok = measure_first(&r, &s->first);
    if (ok && s->moves) {
        lum_bench_progress("instant: %s: animation", s->name);
        ok = measure_moving(&r, &s->moving);
    }
    close_rig(&r);
    return ok;
}

/* ---- growth ---- */

static const struct {
    enum instant_growth what;
    double x;
    const char *scene;
} growth[] = {
    {INSTANT_VPLS, 64, "bunnies-1"},        {INSTANT_VPLS, 128, "bunnies-1"},
    {INSTANT_VPLS, 256, "bunnies-1"},       {INSTANT_VPLS, 512, "bunnies-1"},
    {INSTANT_VPLS, 1024, "bunnies-1"},      {INSTANT_RECORDS, 0.4, "bunnies-1"},
    {INSTANT_RECORDS, 0.28, "bunnies-1"},   {INSTANT_RECORDS, 0.2, "bunnies-1"},
    {INSTANT_RECORDS, 0.14, "bunnies-1"},   {INSTANT_RECORDS, 0.1, "bunnies-1"},
    {INSTANT_MOVERS, 1, "bunnies-1"},       {INSTANT_MOVERS, 2, "bunnies-2"},
    {INSTANT_MOVERS, 4, "bunnies-4"},       {INSTANT_MOVERS, 9, "bunnies-9"},
    {INSTANT_PIXELS, 0.5, "bunnies-1"},     {INSTANT_PIXELS, 1, "bunnies-1"},
    {INSTANT_PIXELS, 2, "bunnies-1"},       {INSTANT_TRIANGLES, 70, "bunnies-1"},
    {INSTANT_TRIANGLES, 224, "bunnies-1"},  {INSTANT_TRIANGLES, 707, "bunnies-1"},
    {INSTANT_TRIANGLES, 2048, "bunnies-1"},
};

/* Makes what moves a knot of 2 * segments * segments triangles: a bunny has few. */
static bool refine(struct rig *r, uint32_t segments)
{
    char text[320];
    struct lum_proto_error perr;
    snprintf(text, sizeof text,
             "{\"lumend\":1,\"kind\":\"scene\"}\n"
             "{\"op\":\"set\",\"id\":\"bunny-mesh\",\"path\":\"/shape\",\"value\":\"knot\"}\n"
             "{\"op\":\"set\",\"id\":\"bunny-mesh\",\"path\":\"/segments\",\"value\":[%u,%u]}\n",
             segments, segments);
    struct lum_ops ops;
    if (!lum_ops_from_jsonl(text, strlen(text), &ops, &perr))
        return lum_bench_failed(perr.text);
    bool ok = apply(r, &ops);
    lum_ops_finish(&ops);
    return ok;
}

static bool run_growth(const struct lum_bench_options *options, size_t i, struct instant_study *study)
{
    struct rig r;
    struct instant_curve *curve = &study->growth[growth[i].what];
    struct instant_cell cells[INSTANT_METHODS][INSTANT_PARTS];
    struct configs all;
    double x = growth[i].x;
    if (!open_rig(&r, options, growth[i].scene, 0.2f))
        return false;
    if (growth[i].what == INSTANT_VPLS)
        r.settings.n_vpls = (uint32_t)x;
    if (growth[i].what == INSTANT_RECORDS)
        r.settings.cache_accuracy = (float)x;
    if (growth[i].what == INSTANT_PIXELS) {
        r.settings.w = (uint32_t)(x * r.settings.w);
        r.settings.h = (uint32_t)(x * r.settings.h);
        x = (double)r.settings.w * r.settings.h;
    }
    if (growth[i].what == INSTANT_TRIANGLES) {
        if (!refine(&r, (uint32_t)x)) {
            close_rig(&r);
            return false;
        }
        x = (double)r.world.snapshot->n_triangles;
    }
    lum_bench_machine(&r.world, study->machine, sizeof study->machine);
    lum_bench_progress("growth: %s %g", instant_growths[growth[i].what], x);
    memset(cells, 0, sizeof cells);
    bool ok = open_configs(&r, 1u << INSTANT_DIFFUSE, cells, &all);
    if (ok) {
        ok = time_moving(&r, &all, options->quick ? 3 : 30);
        close_configs(&all);
    }
    for (int m = 0; m < INSTANT_METHODS; m++)
        curve->cells[curve->n][m] = cells[m][INSTANT_DIFFUSE];
    curve->x[curve->n++] = x;
    close_rig(&r);
    return ok;
}

int lum_bench_instant(const struct lum_bench_options *options)
{
    struct instant_study *study = lum_calloc(1, sizeof *study);
    if (!study)
        return lum_bench_failed("out of memory"), 1;
    lum_thread_init_fp();
    bool ok = true;
    if (options->scene) {
        float accuracy = lum_view_settings_default().cache_accuracy;
        for (size_t i = 0; i < LUM_ARRAY_LEN(scenes); i++)
            accuracy = strcmp(options->scene, scenes[i].name) == 0 ? scenes[i].accuracy : accuracy;
        ok = run_scene(options, options->scene, accuracy, study);
    } else {
        size_t n = options->quick ? QUICK_SCENES : LUM_ARRAY_LEN(scenes);
        for (size_t i = 0; ok && i < n; i++)
            ok = run_scene(options, scenes[i].name, scenes[i].accuracy, study);
    }
    ok = ok && instant_report(study, options);
    lum_free(study);
    return ok ? 0 : 1;
}

int lum_bench_growth(const struct lum_bench_options *options)
{
    struct instant_study *study = lum_calloc(1, sizeof *study);
    if (!study)
        return lum_bench_failed("out of memory"), 1;
    lum_thread_init_fp();
    bool ok = true;
    for (size_t i = 0; ok && i < LUM_ARRAY_LEN(growth); i += options->quick ? 2 : 1)
        ok = run_growth(options, i, study);
    ok = ok && instant_report_growth(study, options);
    lum_free(study);
    return ok ? 0 : 1;
}
