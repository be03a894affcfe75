#include "core/interleave/interleave.h"

#include <math.h>

/* At most one less than max: the first iteration has been done. */
static uint32_t further(uint32_t iterations, uint32_t max)
{
    return iterations < max ? iterations : max - 1;
}

static uint32_t ceil_div(uint64_t a, uint64_t b)
{
    return (uint32_t)((a + b - 1) / b);
}

uint32_t lum_guidance_indirect(const uint16_t *sampled, const uint16_t *missed, uint32_t n_pixels, uint32_t max)
{
    double total = 0.0;
    for (uint32_t i = 0; i < n_pixels; i++)
        if (missed[i] > 0)
            total += (double)missed[i] / (double)sampled[i];
    if (!(total > 0.0))
        return 0;
    /* 2^-40 is above the rounding of a sum of up to 16 quotients, and far below their steps of 2^-16: a whole number
     * stays one. */
    return further((uint32_t)ceil(total / n_pixels * max - 0x1p-40), max);
}

uint32_t lum_guidance_shadow(uint32_t sampled, uint32_t missed, uint32_t max)
{
    if (missed == 0 || missed >= sampled)
        return 0;
    return further(ceil_div((uint64_t)missed * max, sampled), max);
}

float lum_guidance_media_value(uint32_t missed, uint32_t in_halo, uint32_t n)
{
    float value = 0.0f;
    int parts = 0;
    if (missed > 0 && missed < n) {
        value += (float)missed / (float)n;
        parts++;
    }
    if (in_halo > 0 && in_halo < n) {
        value += (float)in_halo / (float)n;
        parts++;
    }
    return parts > 1 ? value / (float)parts : value;
}

uint32_t lum_guidance_media(const float *value, uint32_t n_pixels, uint32_t n_steps, uint32_t max)
{
    if (n_pixels == 0 || n_steps == 0)
        return 0;
    /* With one light, values are multiples of half a step: the limit lies between one step and one and a half. */
    float same = 1.25f / (float)n_steps;
    uint32_t different = 0;
    for (uint32_t i = 1; i < n_pixels; i++)
        different += fabsf(value[i] - value[i - 1]) > same;
    return further(ceil_div((uint64_t)different * max, n_pixels), max);
}

struct lum_rgb lum_guidance_color(uint32_t iterations, uint32_t max)
{
    if (iterations == 0)
        return lum_rgb(0.02f, 0.05f, 0.6f);
    float share = lum_min((float)iterations / (float)(max > 1 ? max - 1 : 1), 1.0f);
    return lum_rgb(0.15f + 0.85f * share, 0.02f, 0.02f);
}
