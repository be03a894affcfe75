/* Film: where radiance is summed, and how it becomes a picture.
 *
 * Two independent halves (even samples of even columns and odd ones of odd columns; the others) are kept apart in
 * double precision: their difference is an unbiased measure of the noise that is left. So after one sample each half
 * has every second pixel. Whatever adds a sample refuses and counts non-finite values:
 * the count must stay 0. */
#ifndef LUM_CORE_FILM_FILM_H
#define LUM_CORE_FILM_FILM_H

#include "core/base/base.h"
#include "core/math/rgb.h"

/* What samples meet first: what of it shines by itself, which is no part of the samples then, and its albedo. */
struct lum_film_first {
    struct lum_rgb shine, albedo;
};

struct lum_film {
    uint32_t w, h;
    double *half[2];                 /* 3 per pixel: sums of samples */
    uint32_t *n[2];                  /* samples in each half, per pixel */
    struct lum_film_first *first[2]; /* lum_film_keep_first: means. NULL: not kept */
};

LUM_MUST_USE enum lum_status lum_film_init(struct lum_film *film, uint32_t w, uint32_t h, struct lum_error *err);
void lum_film_finish(struct lum_film *film);

/* Adds sample number `sample` to a pixel. One that is not finite is dropped and *nonfinite incremented.
 * Thread: one writer per pixel. */
void lum_film_add(struct lum_film *film, uint32_t x, uint32_t y, uint32_t sample, struct lum_rgb radiance,
                  uint64_t *nonfinite);

/* From the next samples on it is kept. */
LUM_MUST_USE enum lum_status lum_film_keep_first(struct lum_film *film, struct lum_error *err);
/* lum_film_add of a film that keeps it. */
void lum_film_add_apart(struct lum_film *film, uint32_t x, uint32_t y, uint32_t sample, struct lum_rgb radiance,
                        const struct lum_film_first *first, uint64_t *nonfinite);

/* Forgets a pixel's samples: a deferred method writes each pixel anew. */
void lum_film_reset_pixel(struct lum_film *film, uint32_t x, uint32_t y);
/* Forgets a pixel's samples for this one, of the first half. */
void lum_film_set(struct lum_film *film, uint32_t x, uint32_t y, struct lum_rgb radiance, uint64_t *nonfinite);

/* Mean of both halves: cd/m2 as Rec.709, without shine that is kept apart. Black where there is no sample. */
struct lum_rgb lum_film_mean(const struct lum_film *film, uint32_t x, uint32_t y);

double lum_film_mean_luminance(const struct lum_film *film); /* cd/m2, over the picture */
bool lum_film_is_black(const struct lum_film *film);         /* every pixel. Quick where one of the first is not */

/* How far a picture is off in luminance: root mean square error over mean luminance of the picture. NAN: unknown. */
struct lum_film_error {
    double rel;    /* an estimate, whose square is right in the mean */
    double bound;  /* the error is no larger than this, with 95 % confidence */
    double probes; /* pixels of this picture that it is made from */
    double fresh;  /* 0 to 1: how much of it is of this picture; the rest is of those before it */
};
#define LUM_FILM_ERROR_UNKNOWN ((struct lum_film_error){.rel = (double)NAN, .bound = (double)NAN})
#define LUM_MANY_PROBES 256.0 /* of fewer `rel` says little: bounds are wide */
#define LUM_SURE 1.645 /* deviations: less than so much above its mean is a normal variable in 95 % of all cases */

/* Of the mean of both halves; unknown until each pixel has a sample in both, and of black. Asks only that the halves
 * are independent of each other, and blocks of 8 x 8 pixels: the noise in them may be of any kind, alike in near
 * pixels, and rare. Light that no sample has found yet is not in it. */
struct lum_film_error lum_film_error(const struct lum_film *film);
/* Of a film with one sample in each pixel: as above, from pixels side by side, if all are independent of each other.
 * Edges count as noise, so that `rel` is no less than the error in the mean. Unknown of a single column, and of black.
 */
struct lum_film_error lum_film_error_at_most(const struct lum_film *film);

enum lum_tone_map { LUM_TONE_AGX, LUM_TONE_ACES, LUM_TONE_REINHARD, LUM_TONE_NONE };
extern const char *const lum_tone_map_names[]; /* "agx", "aces", "reinhard", "none"; NULL-terminated */

/* Luminance in cd/m2 that display white stands for at exposure value ev100: 1.2 * 2^ev100 (ISO 2720 with q = 0.65:
 * the saturation-based speed). */
double lum_exposure_white(double ev100);
/* ev100 at which the log-average luminance of the picture lands on middle grey; 0 for a black picture. */
double lum_exposure_auto(const struct lum_film *film);

/* One pixel: exposed, tone mapped, sRGB-encoded, 0..255. Finite input gives finite output; NaN gives 0. */
void lum_tone_pixel(struct lum_rgb radiance, double white, enum lum_tone_map tone, uint8_t ret_rgb[3]);

/* How radiance becomes a picture. */
struct lum_display {
    double ev100;
    enum lum_tone_map tone;
    bool balanced;       /* false: balance is not read */
    float balance[3][3]; /* lum_white_balance, before exposure */
};
/* A rectangle of the film as RGBA8 rows, stride in bytes. Thread: any, while nobody writes those pixels. */
void lum_film_resolve(const struct lum_film *film, uint32_t x, uint32_t y, uint32_t w, uint32_t h,
                      const struct lum_display *display, uint8_t *ret_rgba, size_t stride);

#endif
