#include "tests/bench/seen.h"

#include "core/metric/flip.h"
#include "core/metric/hdrvdp.h"
#include "tests/bench/bench.h"

enum { PLANES = 8 }; /* two pictures of three channels, two of luminance */

/* Three planes of it, and its luminance. */
static void take_apart(const float *rgb, size_t n, float *ret_planes, float *ret_luminance)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < 3; k++)
            ret_planes[k * n + i] = rgb[3 * i + k];
        ret_luminance[i] = lum_luminance(lum_rgb(rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]));
    }
}

/* Both pictures, so that the mean of r is LUM_BENCH_DIM. */
static void dim(float *x, float *r, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += (double)r[i];
    const float scale = sum > 0.0 ? (float)(LUM_BENCH_DIM * (double)n / sum) : 1.0f;
    for (size_t i = 0; i < n; i++) {
        x[i] *= scale;
        r[i] *= scale;
    }
}

bool lum_bench_look(uint32_t w, uint32_t h, const float *x, const float *r, struct lum_bench_seen *ret_seen)
{
    const size_t n = (size_t)w * h;
    struct lum_error err = {0};
    struct lum_hdrvdp_result vdp, dark;
    struct lum_flip_result flip;
    struct lum_hdrflip_exposures exposures;
    float *p = lum_calloc(PLANES * n, sizeof *p);
    if (!p)
        return lum_bench_failed("out of memory");
    take_apart(x, n, p, p + 6 * n);
    take_apart(r, n, p + 3 * n, p + 7 * n);
    const struct lum_hdrvdp_input luminance = {w, h, p + 6 * n, p + 7 * n, LUM_HDRVDP_PIXELS_PER_DEGREE};
    const struct lum_flip_input rgb = {
        w, h, {p, p + n, p + 2 * n}, {p + 3 * n, p + 4 * n, p + 5 * n}, LUM_FLIP_PIXELS_PER_DEGREE};
    bool ok = lum_hdrvdp_compare(&luminance, NULL, &vdp, &err) == LUM_OK &&
              lum_hdrflip_compare(&rgb, NULL, &flip, &exposures, &err) == LUM_OK;
    dim(p + 6 * n, p + 7 * n, n);
    ok = ok && lum_hdrvdp_compare(&luminance, NULL, &dark, &err) == LUM_OK;
    lum_free(p);
    if (!ok)
        return lum_bench_failed(err.text);
    *ret_seen =
        (struct lum_bench_seen){100.0 * vdp.p75, 100.0 * vdp.p95, 100.0 * dark.p75, 100.0 * dark.p95, flip.mean};
    return true;
}
