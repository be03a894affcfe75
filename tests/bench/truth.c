/* How right the light is: every built-in scene and third-party models, for `live`, `path` and whatever methods are
 * asked for, against `path` of another seed, anti-aliased like them, 600 x 400.
 *
 * By blocks (core/metric/blocks.h), so that light that is missing shows and noise does not; SMAPE and relMSE beside
 * them. Of the rough picture before it, at the first full frame, while something moves, and after 0.1 to 30 seconds at
 * rest; what each effect alone has of its light; the cost of the first frame in samples of `path`, in turns. A figure
 * says how sure its reference is.
 *
 * Others may use the machine: time is that of a machine of its own (truth_time), and rays are exact. */
#include "tests/bench/truth.h"

#include <stdlib.h>

#include "server/world/apply.h"

/* ---- a scene ---- */

static bool open_rig(struct truth_rig *rig, const struct lum_bench_place *place)
{
    struct lum_error err = {0};
    snprintf(rig->scene, sizeof rig->scene, "%s", place->scene);
    if (!lum_bench_world(place->source, 0, &rig->world))
        return false;
    rig->settings = lum_view_settings_default();
    if (lum_apply_settings(lum_world_render(&rig->world), &rig->settings, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    rig->settings.w = rig->options->quick ? 60 : 600;
    rig->settings.h = rig->options->quick ? 40 : 400;
    rig->settings.max_spp = LUM_LIMIT_SPP;
    lum_bench_machine(&rig->world, rig->study->machine, sizeof rig->study->machine);
    return lum_bench_place_camera(place, &rig->world, &rig->settings.camera);
}

static bool measure_scene(struct truth_rig *rig, const struct lum_bench_place *place)
{
    lum_bench_progress("truth: %s", place->scene);
    if (!open_rig(rig, place)) {
        printf("skipped: %s\n", place->scene);
        return true;
    }
    uint32_t spp = rig->options->quick ? 8 : rig->options->reference_spp;
    lum_bench_progress("truth: %s: reference", rig->scene);
    if (!truth_reference_make(rig, &rig->settings, spp, &rig->reference) || !truth_page_scene(rig))
        return false;
    return truth_measure_rest(rig) && truth_measure_costs(rig) && truth_measure_effects(rig) &&
           truth_measure_moving(rig);
}

/* ---- the study ---- */

static bool make_room(struct truth_study *s, size_t n_scenes)
{
    s->max_rows = n_scenes * LUM_BENCH_METHODS * (TRUTH_TIMES + 3);
    s->max_costs = n_scenes * LUM_BENCH_METHODS;
    s->max_effects = n_scenes * LUM_BENCH_METHODS * LUM_EFFECT_COUNT;
    s->rows = lum_calloc(s->max_rows, sizeof *s->rows);
    s->costs = lum_calloc(s->max_costs, sizeof *s->costs);
    s->effects = lum_calloc(s->max_effects, sizeof *s->effects);
    return (s->rows && s->costs && s->effects) || lum_bench_failed("out of memory");
}

static void free_study(struct truth_study *s)
{
    lum_free(s->rows);
    lum_free(s->costs);
    lum_free(s->effects);
}

int lum_bench_truth_study(const struct lum_bench_options *options)
{
    struct truth_study study = {0};
    struct truth_rig methods = {.options = options};
    struct lum_bench_places *places = lum_calloc(1, sizeof *places);
    bool ok = places ? lum_bench_find_methods(options->methods ? options->methods : "live,path", methods.methods,
                                              &methods.n_methods)
                     : lum_bench_failed("out of memory");
    if (ok) {
        lum_bench_list_places(options, places);
        ok = make_room(&study, places->n) && truth_page_open(&study, options);
    }
    for (size_t i = 0; i < (ok ? places->n : 0) && ok; i++) {
        struct truth_rig rig = methods;
        rig.study = &study;
        ok = measure_scene(&rig, &places->items[i]);
        truth_reference_finish(&rig.reference);
        lum_world_finish(&rig.world);
    }
    ok = ok && truth_report(&study, options);
    ok = truth_page_close(&study) && ok;
    free_study(&study);
    lum_free(places);
    return ok ? 0 : 1;
}
