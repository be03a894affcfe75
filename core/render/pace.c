#include "core/render/pace.h"

#include "core/base/base.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

static const uint32_t sides[LUM_PACE_SIDES] = {1, 2, 3, 4, 6, 8, 12, LUM_PREVIEW_WHOLE, LUM_PREVIEW_MAX};
#define UNKNOWN_SIDE 8u   /* of 16 a lamp's halo fills blocks: twice the light of CornellBox-Sphere */
#define CLEARLY 0.85      /* of the time, for a finer picture than before: near the limit sides would alternate */
#define WORTH_EASING 0.97 /* of the time is left: what gives less is noise */
#define FORGOTTEN 30u     /* passes: a drag of a second, in which one may be too dear */
/* What of a pass's time is not fixed falls as side^-this. A rough frame makes nearly all virtual point lights of a
 * whole one, and records as fine as that needs them, if fewer: .42 of its time for a side of 2, .18 for 4, .08 for 8,
 * in twelve rooms of 600 x 400. Of path traced samples there is one in each block. */
#define OF_FRAMES 1.25
#define OF_SAMPLES 2.0
#define HALF 0.25 /* of the time of blocks of 16, of the same at half the size: it has a quarter of the pixels */

/* Of all settings of all methods that were measured while something moves (tests/bench/RESULTS.md, settings) those that
 * give more time for less error than the next coarser side, and need no cache of their own that is not made anew
 * anyway. Of blocks of 4, `live` without refinement of shadows takes .78 to .83 of the time, and has 1.05 to 1.26 times
 * the relMSE; blocks of 8 .67 to .73, for 1.5 times and more. `irrcache` with a quarter of its records' rays: .29,
 * for 1.02. What is left of a stage's time is what is not these rays'. */
static const struct lum_pace_ease eases[] = {
    {"live", "shadow_rays", LUM_STAGE_REFINE, 0.0},
    {"irrcache", "record_rays", LUM_STAGE_INDIRECT, 0.3},
};
#define RECORD_RAYS_PART 4u /* of irrcache's rays a record is left */

const struct lum_pace_ease *lum_pace_ease_of(const struct lum_method *method)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(eases); i++)
        if (strcmp(eases[i].method, method->name) == 0)
            return &eases[i];
    return NULL;
}

void lum_pace_apply_ease(struct lum_view_settings *s)
{
    const struct lum_pace_ease *ease = lum_pace_ease_of(s->method);
    if (ease && ease->stage == LUM_STAGE_REFINE)
        s->shadow_budget = 0;
    else if (ease)
        s->n_vpls = s->n_vpls > RECORD_RAYS_PART ? s->n_vpls / RECORD_RAYS_PART : 1;
}

static uint32_t index_of(uint32_t side)
{
    uint32_t i = 0;
    while (i + 1 < LUM_PACE_SIDES && sides[i] < side)
        i++;
    return i;
}

double lum_pace_fixed_ms(const struct lum_pass_stats *pass)
{
    return pass->stage_ms[LUM_STAGE_CACHE] + pass->stage_ms[LUM_STAGE_UPSAMPLE];
}

/* What is left of a pass's time when it is eased. */
static double eased_part(const struct lum_pace *p, const struct lum_method *method)
{
    const struct lum_pace_ease *ease = lum_pace_ease_of(method);
    return ease ? 1.0 - p->share * (1.0 - ease->left) : 1.0;
}

static void grow_older(struct lum_pace *p)
{
    for (uint32_t i = 0; i < LUM_PACE_SIDES; i++)
        if (++p->age[i] > FORGOTTEN)
            p->ms[i] = 0.0;
    if (++p->share_age > FORGOTTEN)
        p->share = 0.0;
}

void lum_pace_note(struct lum_pace *p, const struct lum_method *method, const struct lum_pace_pass *pass)
{
    uint32_t at = index_of(pass->side);
    if (!(pass->ms > 0.0))
        return;
    double was = p->ms[at], ms = pass->eased ? pass->ms / eased_part(p, method) : pass->ms;
    grow_older(p);
    p->age[at] = 0;
    p->fixed_ms = fmin(fmax(pass->fixed_ms, 0.0), pass->ms);
    if (!pass->eased) {
        p->share = fmin(fmax(pass->stage_ms / pass->ms, 0.0), 1.0);
        p->share_age = 0;
    }
    bool again = p->noted == sides[at];
    p->noted = sides[at];
    p->ms[at] = was; /* it is not forgotten */
    if (was > 0.0)
        lum_pace_scale(p, again ? (ms > was ? ms : 0.5 * (ms + was)) / was : sqrt(ms / was));
    if (!again || !(was > 0.0))
        p->ms[at] = ms;
}

void lum_pace_scale(struct lum_pace *p, double pixels)
{
    for (uint32_t i = 0; i < LUM_PACE_SIDES; i++)
        p->ms[i] *= pixels;
}

/* Of what hangs on the side, over that of a whole picture. */
static double work(uint32_t side, double exponent)
{
    bool half = side > LUM_PREVIEW_WHOLE;
    return (half ? HALF : 1.0) * pow(half ? side / 2.0 : side, -exponent);
}

/* What does not hang on the side is mostly the way to all pixels, of which half the size has fewer: that is not counted
 * upon, but a picture of the whole size has four times as many. */
static double expected_from(const struct lum_pace *p, uint32_t known, uint32_t at, double exponent)
{
    double fixed_ms = fmin(p->fixed_ms, p->ms[known]), fixed_at_ms = fixed_ms;
    if (sides[known] > LUM_PREVIEW_WHOLE && sides[at] <= LUM_PREVIEW_WHOLE)
        fixed_at_ms = p->noted > LUM_PREVIEW_WHOLE ? fixed_ms / HALF : p->fixed_ms; /* of the last pass, as it was */
    return fixed_at_ms + (p->ms[known] - fixed_ms) * work(sides[at], exponent) / work(sides[known], exponent);
}

/* From the nearest side that is known; 0: none is. */
static double expected(const struct lum_pace *p, uint32_t at, double exponent)
{
    for (uint32_t far = 0; far < LUM_PACE_SIDES; far++) {
        if (at + far < LUM_PACE_SIDES && p->ms[at + far] > 0.0)
            return expected_from(p, at + far, at, exponent);
        if (at >= far && p->ms[at - far] > 0.0)
            return expected_from(p, at - far, at, exponent);
    }
    return 0.0;
}

/* Blocks of path traced samples fill tiles. */
static bool is_allowed(uint32_t side, const struct lum_method *method)
{
    return !method->progressive || (side <= LUM_PREVIEW_WHOLE && (side & (side - 1)) == 0);
}

static struct lum_pace_choice decide(const struct lum_pace *p, const struct lum_method *method, double limit_ms)
{
    double exponent = method->progressive ? OF_SAMPLES : OF_FRAMES, part = eased_part(p, method);
    struct lum_pace_choice c = {UNKNOWN_SIDE, NULL, (double)NAN};
    if (!(expected(p, 0, exponent) > 0.0))
        return c;
    for (uint32_t i = 0; i < LUM_PACE_SIDES; i++)
        for (int eased = 0; eased <= (i > 0 && part < WORTH_EASING); eased++) {
            if (!is_allowed(sides[i], method))
                continue;
            c = (struct lum_pace_choice){sides[i], eased ? lum_pace_ease_of(method)->name : NULL,
                                         expected(p, i, exponent) * (eased ? part : 1.0)};
            bool finer = c.side < p->last.side || (c.side == p->last.side && !c.eased && p->last.eased);
            if (c.ms <= (finer ? CLEARLY * limit_ms : limit_ms))
                return c;
        }
    return c;
}

struct lum_pace_choice lum_pace_choose(struct lum_pace *p, const struct lum_method *method, double limit_ms)
{
    return p->last = decide(p, method, limit_ms);
}
