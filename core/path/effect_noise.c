#include "core/path/effect_noise.h"

#include <math.h>
#include <string.h>

enum lum_status lum_effect_noise_init(struct lum_effect_noise *noise, uint32_t w, uint32_t h, struct lum_error *err)
{
    *noise = (struct lum_effect_noise){.w = (w + LUM_EFFECT_NOISE_STEP - 1) / LUM_EFFECT_NOISE_STEP,
                                       .h = (h + LUM_EFFECT_NOISE_STEP - 1) / LUM_EFFECT_NOISE_STEP};
    noise->sum = lum_calloc((size_t)noise->w * noise->h, sizeof *noise->sum);
    if (noise->sum)
        return LUM_OK;
    *noise = (struct lum_effect_noise){0};
    return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for the noise of effects");
}

void lum_effect_noise_finish(struct lum_effect_noise *noise)
{
    lum_free(noise->sum);
    *noise = (struct lum_effect_noise){0};
}

void lum_effect_noise_add(struct lum_effect_noise *noise, uint32_t x, uint32_t y, uint32_t sample,
                          const float parts[LUM_EFFECT_COUNT])
{
    if (x % LUM_EFFECT_NOISE_STEP != 0 || y % LUM_EFFECT_NOISE_STEP != 0)
        return;
    float(*sum)[LUM_EFFECT_COUNT] =
        noise->sum[(size_t)(y / LUM_EFFECT_NOISE_STEP) * noise->w + x / LUM_EFFECT_NOISE_STEP];
    if (sample == 0)
        memset(sum, 0, 2 * sizeof *sum);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (isfinite(parts[e]))
            sum[sample % 2][e] += parts[e];
}

void lum_effect_noise_read(const struct lum_effect_noise *noise, uint32_t n_samples, double ret_noise[LUM_EFFECT_COUNT])
{
    double square[LUM_EFFECT_COUNT] = {0}, light = 0.0, n_pixels = (double)noise->w * (double)noise->h;
    for (size_t i = 0; i < (size_t)noise->w * noise->h; i++)
        for (int e = 0; e < LUM_EFFECT_COUNT; e++) {
            double a = (double)noise->sum[i][0][e], b = (double)noise->sum[i][1][e];
            light += a + b;
            square[e] += (a - b) * (a - b);
        }
    /* Halves of n / 2 samples: (A - B) / 2 is the difference of sums over n. The mean luminance is light / n, too. */
    bool known = n_samples >= 2 && n_samples % 2 == 0 && light > 0.0;
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        ret_noise[e] = known ? sqrt(square[e] / n_pixels) / (light / n_pixels) : (double)NAN;
}
