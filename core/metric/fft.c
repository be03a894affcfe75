#include "core/metric/fft.h"

#include <kiss_fftnd.h>

uint32_t lum_fft_fast_size(uint32_t n)
{
    return (uint32_t)kiss_fft_next_fast_size((int)n);
}

enum lum_status lum_fft_init(struct lum_fft *fft, uint32_t w, uint32_t h, struct lum_error *err)
{
    const int sizes[2] = {(int)h, (int)w};
    struct lum_fft made = {w, h, NULL, NULL};
    if (w < 1 || h < 1 || w > 1u << 16 || h > 1u << 16)
        return lum_fail(err, LUM_ERR_LIMIT, "", "a Fourier transform of %u x %u: sides must be 1 to %u", w, h,
                        1u << 16);
    made.forward = kiss_fftnd_alloc(sizes, 2, 0, NULL, NULL);
    made.inverse = kiss_fftnd_alloc(sizes, 2, 1, NULL, NULL);
    if (!made.forward || !made.inverse) {
        lum_fft_finish(&made);
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a Fourier transform of %u x %u", w, h);
    }
    *fft = made;
    return LUM_OK;
}

void lum_fft_finish(struct lum_fft *fft)
{
    kiss_fft_free(fft->forward);
    kiss_fft_free(fft->inverse);
    *fft = (struct lum_fft){0};
}

void lum_fft_forward(const struct lum_fft *fft, const float *in, float *ret)
{
    kiss_fftnd((kiss_fftnd_cfg)fft->forward, (const kiss_fft_cpx *)in, (kiss_fft_cpx *)ret);
}

void lum_fft_inverse(const struct lum_fft *fft, const float *in, float *ret)
{
    const size_t n = (size_t)2 * fft->w * fft->h;
    const float scale = 2.0f / (float)n;
    kiss_fftnd((kiss_fftnd_cfg)fft->inverse, (const kiss_fft_cpx *)in, (kiss_fft_cpx *)ret);
    for (size_t i = 0; i < n; i++)
        ret[i] *= scale;
}
