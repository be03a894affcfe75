/* How much of each effect's light is in a method's first frame, over that in `path`.
 *
 * An effect's light is what a picture with it alone has more than one with nothing but what shines itself. Mirrors,
 * glass and gloss only pass on what something else lit: theirs is what a picture with them and with the light of lamps
 * has more than one with the light of lamps. The same sample of `path` sees the same points in both, so the noise of
 * these cancels in the difference. */
#include <math.h>
#include <string.h>

#include "tests/bench/truth.h"

#define ALL_EFFECTS (LUM_EFFECT_BIT(LUM_EFFECT_COUNT) - 1u)
#define LAMPS                                                                                                          \
    (LUM_EFFECT_BIT(LUM_EFFECT_DIRECT) | LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW) |                                      \
     LUM_EFFECT_BIT(LUM_EFFECT_ENVIRONMENT))
#define PASSING                                                                                                        \
    (LUM_EFFECT_BIT(LUM_EFFECT_REFLECTION) | LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION) |                                 \
     LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY))
#define LEAST_SHARE 1e-3 /* of all light: below, a ratio says nothing */

/* The pictures that effects are measured from: with none, and with lamps. */
enum base { BASE_NONE, BASE_LAMPS, BASE_COUNT };
static const uint32_t base_effects[BASE_COUNT] = {0, LAMPS};

struct part {
    float *values; /* luminance, w * h */
    uint64_t rays[LUM_RAY_KIND_COUNT];
};

struct effects_bench {
    struct truth_rig *rig;
    struct lum_demand demand;
    struct truth_reference bases[BASE_COUNT];
    struct part *frames; /* of each method, by base */
    uint32_t spp;
};

static enum base base_of(uint32_t effect)
{
    return LUM_EFFECT_BIT(effect) & PASSING ? BASE_LAMPS : BASE_NONE;
}

static struct lum_view_settings settings_with(const struct truth_rig *rig, uint32_t on)
{
    struct lum_view_settings s = rig->settings;
    s.effects_off = ALL_EFFECTS & ~on & ~LUM_EFFECT_BIT(LUM_EFFECT_ANTIALIAS);
    return s;
}

/* A method's first frame with some effects. */
static bool make_frame(const struct truth_rig *rig, const struct lum_method *method, uint32_t on, struct part *ret_part)
{
    struct truth_view view;
    struct truth_time time = {0};
    struct lum_pass_stats stats;
    bool ok = truth_view_open(rig, method, &view);
    if (ok) {
        view.settings = settings_with(rig, on);
        view.settings.method = method;
        ok = truth_pass(rig, &view, &stats, &time);
    }
    size_t n = (size_t)rig->settings.w * rig->settings.h;
    if (ok && !(ret_part->values = lum_calloc(n, sizeof(float))))
        ok = lum_bench_failed("out of memory");
    for (size_t i = 0; i < n && ok; i++)
        ret_part->values[i] = lum_luminance(
            lum_film_mean(lum_view_film(view.view), (uint32_t)(i % rig->settings.w), (uint32_t)(i / rig->settings.w)));
    if (ok)
        memcpy(ret_part->rays, stats.rays, sizeof stats.rays);
    truth_view_close(&view);
    return ok;
}

/* x -= base. */
static void subtract(float *inout_x, const float *base, size_t n)
{
    for (size_t i = 0; i < n; i++)
        inout_x[i] -= base[i];
}

static double mean_of(const float *values, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += (double)values[i];
    return sum / (double)n;
}

static void tell(const struct truth_rig *rig, const struct truth_effect *e)
{
    char text[160];
    snprintf(text, sizeof text, "%s, %s in the first frame: mean %.3f, median %.3f, 5 .. 95 %% %.3f .. %.3f", e->method,
             e->effect, e->blocks.mean, e->blocks.median, e->blocks.p5, e->blocks.p95);
    lum_bench_progress("truth: %s: %s", rig->scene, text);
    truth_page_text(rig, text);
}

/* truth: the effect's light in `path`, of which `share` is known. */
static bool measure_method(struct effects_bench *b, size_t m, uint32_t effect, const struct truth_reference *truth,
                           double share)
{
    struct truth_rig *rig = b->rig;
    struct lum_error err = {0};
    const struct lum_method *method = rig->methods[m];
    enum base base = base_of(effect);
    struct part part = {0};
    if (!make_frame(rig, method, base_effects[base] | LUM_EFFECT_BIT(effect), &part))
        return false;
    subtract(part.values, b->frames[m * BASE_COUNT + base].values, (size_t)rig->settings.w * rig->settings.h);
    struct truth_effect *e = &rig->study->effects[rig->study->n_effects++];
    *e = (struct truth_effect){.method = method->name,
                               .effect = lum_effect_names[effect],
                               .share = share,
                               .rays = part.rays[LUM_RAY_DIRECT + effect],
                               .reference_spp = truth->r.spp};
    snprintf(e->scene, sizeof e->scene, "%s", rig->scene);
    struct lum_blocks_input in = {
        rig->settings.w, rig->settings.h, part.values, truth->luminance, {truth->halves[0], truth->halves[1]}};
    bool ok = lum_blocks_compare(&in, NULL, &e->blocks, &err) == LUM_OK || lum_bench_failed(err.text);
    if (!(share >= LEAST_SHARE))
        e->blocks.n_counted = 0;
    else if (ok)
        tell(rig, e);
    lum_free(part.values);
    return ok;
}

static bool measure_effect(struct effects_bench *b, uint32_t effect)
{
    struct truth_rig *rig = b->rig;
    struct truth_reference truth;
    enum base base = base_of(effect);
    struct lum_view_settings s = settings_with(rig, base_effects[base] | LUM_EFFECT_BIT(effect));
    size_t n = (size_t)rig->settings.w * rig->settings.h;
    bool ok = truth_reference_make(rig, &s, b->spp, &truth);
    if (ok) {
        subtract(truth.luminance, b->bases[base].luminance, n);
        for (int i = 0; i < 2; i++)
            subtract(truth.halves[i], b->bases[base].halves[i], n);
        double share = mean_of(truth.luminance, n) / rig->reference.r.mean;
        for (size_t m = 0; m < rig->n_methods && ok; m++)
            if (!rig->methods[m]->progressive && rig->methods[m]->serves[effect])
                ok = measure_method(b, m, effect, &truth, share);
    }
    truth_reference_finish(&truth);
    return ok;
}

static bool measure_bases(struct effects_bench *b)
{
    struct truth_rig *rig = b->rig;
    bool ok = true, needed[BASE_COUNT] = {true, false};
    for (uint32_t e = 0; e < LUM_EFFECT_COUNT; e++)
        needed[base_of(e)] = needed[base_of(e)] || b->demand.on[e];
    for (uint32_t k = 0; k < BASE_COUNT && ok; k++) {
        struct lum_view_settings s = settings_with(rig, base_effects[k]);
        ok = !needed[k] || truth_reference_make(rig, &s, b->spp, &b->bases[k]);
        for (size_t m = 0; m < rig->n_methods && ok && needed[k]; m++)
            if (!rig->methods[m]->progressive)
                ok = make_frame(rig, rig->methods[m], base_effects[k], &b->frames[m * BASE_COUNT + k]);
    }
    return ok;
}

bool truth_measure_effects(struct truth_rig *rig)
{
    struct part frames[LUM_BENCH_METHODS * BASE_COUNT] = {0};
    uint32_t spp = rig->options->reference_spp / 8;
    struct effects_bench b = {.rig = rig, .frames = frames, .spp = rig->options->quick ? 4 : spp < 8 ? 8 : spp};
    lum_demand_derive(rig->world.snapshot, &b.demand);
    bool ok = measure_bases(&b);
    for (uint32_t e = 0; e < LUM_EFFECT_ANTIALIAS && ok; e++)
        ok = !b.demand.on[e] || measure_effect(&b, e);
    for (size_t i = 0; i < LUM_ARRAY_LEN(frames); i++)
        lum_free(frames[i].values);
    for (int k = 0; k < BASE_COUNT; k++)
        truth_reference_finish(&b.bases[k]);
    return ok;
}
