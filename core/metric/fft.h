/* Fourier transforms of planes of complex floats, by kissfft; filters that are real and even in frequency.
 *
 * Such a filter works on two real pictures at once: as the real and the imaginary part of one complex picture they stay
 * apart. */
#ifndef LUM_CORE_METRIC_FFT_H
#define LUM_CORE_METRIC_FFT_H

#include "core/base/base.h"

struct lum_fft {
    uint32_t w, h;
    void *forward, *inverse; /* kissfft's plans */
};

/* The least size not under n that is a product of 2, 3 and 5: others take up to ten times as long. */
uint32_t lum_fft_fast_size(uint32_t n);

/* w, h: 1 to 2^16. lum_fft_finish frees; an all-zero struct lum_fft may be finished. */
LUM_MUST_USE enum lum_status lum_fft_init(struct lum_fft *fft, uint32_t w, uint32_t h, struct lum_error *err);
void lum_fft_finish(struct lum_fft *fft);

/* 2 * w * h floats: real and imaginary part in turn; ret must not be in. The inverse divides by w * h. Thread: one at a
 * time. */
void lum_fft_forward(const struct lum_fft *fft, const float *in, float *ret);
void lum_fft_inverse(const struct lum_fft *fft, const float *in, float *ret);

/* Cycles per pixel of column i of n, or row: 0, 1/n, 2/n ... to a half, then from there below 0. */
static inline double lum_fft_frequency(uint32_t i, uint32_t n)
{
    return (i <= n / 2 ? (double)i : (double)i - (double)n) / (double)n;
}

#endif
