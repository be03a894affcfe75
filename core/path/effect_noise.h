/* How much of the noise of path traced samples is of which effect: where more samples, or better ones, would help.
 *
 * Every sixteenth pixel keeps what its samples found of each effect, in two halves that are independent (film.h). With
 * A and B their means, ((A - B) / 2)^2 has the mean of the squared error of (A + B) / 2, as core/film/error.c has it
 * for all of the light. The squares of effects add up to that but for what they have in common, as paths that go dark
 * together do. */
#ifndef LUM_CORE_PATH_EFFECT_NOISE_H
#define LUM_CORE_PATH_EFFECT_NOISE_H

#include "core/base/base.h"
#include "core/trace/effect.h"

#define LUM_EFFECT_NOISE_STEP 4u /* pixels between those that are looked at; even, so that all have the same halves */

struct lum_effect_noise {
    uint32_t w, h;                     /* pixels that are looked at */
    float (*sum)[2][LUM_EFFECT_COUNT]; /* by pixel and half: luminance of each effect, as lum_wave.parts has it */
};

LUM_MUST_USE enum lum_status lum_effect_noise_init(struct lum_effect_noise *noise, uint32_t w, uint32_t h,
                                                   struct lum_error *err);
void lum_effect_noise_finish(struct lum_effect_noise *noise); /* accepts a zeroed one */

/* Adds sample number `sample` of pixel (x, y), if that is one that is looked at; number 0 forgets those before. One
 * that is not finite is dropped. Thread: one writer per pixel. */
void lum_effect_noise_add(struct lum_effect_noise *noise, uint32_t x, uint32_t y, uint32_t sample,
                          const float parts[LUM_EFFECT_COUNT]);

/* Root mean square noise of each effect over the mean luminance of all, after n_samples: as many in one half as in the
 * other, or it is not known (NAN). */
void lum_effect_noise_read(const struct lum_effect_noise *noise, uint32_t n_samples,
                           double ret_noise[LUM_EFFECT_COUNT]);

#endif
