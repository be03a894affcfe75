#include "core/render/pace.h"

#include "core/base/base.h"

#include <math.h>
#include <stdbool.h>

static const uint32_t sides[LUM_PACE_SIDES] = {1, 2, 3, 4, 6, 8, 12, 16};
#define UNKNOWN_SIDE 8u /* of 16 a lamp's halo fills blocks: twice the light of CornellBox-Sphere */
#define CLEARLY 0.85
#define FORGOTTEN 30u /* passes: a drag of a second, in which one may be too dear */
/* Time falls as side^-this. A rough frame makes nearly all virtual point lights of a whole one, and records as fine as
 * that needs them, if fewer: .42 of its time for a side of 2, .18 for 4, .08 for 8, in twelve rooms of 600 x 400. Of
 * path traced samples there is one in each block. */
#define OF_FRAMES 1.25
#define OF_SAMPLES 2.0

static uint32_t index_of(uint32_t side)
{
    uint32_t i = 0;
    while (i + 1 < LUM_PACE_SIDES && sides[i] < side)
        i++;
    return i;
}

void lum_pace_note(struct lum_pace *p, uint32_t side, double ms)
{
    uint32_t at = index_of(side);
    double was = p->ms[at];
    if (!(ms > 0.0))
        return;
    for (uint32_t i = 0; i < LUM_PACE_SIDES; i++)
        if (++p->age[i] > FORGOTTEN)
            p->ms[i] = 0.0;
    p->age[at] = 0;
    if (!(was > 0.0)) {
        p->ms[at] = ms;
        return;
    }
    p->ms[at] = was; /* it is not forgotten */
    lum_pace_scale(p, (ms > was ? ms : 0.5 * (ms + was)) / was);
}

void lum_pace_scale(struct lum_pace *p, double pixels)
{
    for (uint32_t i = 0; i < LUM_PACE_SIDES; i++)
        p->ms[i] *= pixels;
}

/* From the nearest side that is known; 0: none is. */
static double expected(const struct lum_pace *p, uint32_t at, double exponent)
{
    for (uint32_t far = 0; far < LUM_PACE_SIDES; far++) {
        if (at + far < LUM_PACE_SIDES && p->ms[at + far] > 0.0)
            return p->ms[at + far] * pow((double)sides[at + far] / sides[at], exponent);
        if (at >= far && p->ms[at - far] > 0.0)
            return p->ms[at - far] * pow((double)sides[at - far] / sides[at], exponent);
    }
    return 0.0;
}

/* Blocks of path traced samples fill tiles. */
static bool is_allowed(uint32_t side, const struct lum_method *method)
{
    return !method->progressive || (side & (side - 1)) == 0;
}

uint32_t lum_pace_choose(struct lum_pace *p, const struct lum_method *method, double limit_ms)
{
    double exponent = method->progressive ? OF_SAMPLES : OF_FRAMES;
    if (!(expected(p, 0, exponent) > 0.0))
        return p->side = UNKNOWN_SIDE;
    for (uint32_t i = 0; i < LUM_PACE_SIDES; i++)
        if (is_allowed(sides[i], method) &&
            expected(p, i, exponent) <= (sides[i] < p->side ? CLEARLY * limit_ms : limit_ms))
            return p->side = sides[i];
    return p->side = sides[LUM_PACE_SIDES - 1];
}
