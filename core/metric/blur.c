#include "core/metric/blur.h"

#include <math.h>
#include <string.h>

#include "core/base/base.h"

double lum_kernel_gauss(double sigma_px, int radius, struct lum_kernel *k)
{
    double sum = 0.0;
    k->radius = radius;
    for (int i = -radius; i <= radius; i++)
        sum += exp(-0.5 * i * i / (sigma_px * sigma_px));
    for (int i = -radius; i <= radius; i++)
        k->weights[i + radius] = (float)(exp(-0.5 * i * i / (sigma_px * sigma_px)) / sum);
    return sum;
}

static double derivative(double x, double sigma, int order)
{
    double t = x / sigma, g = exp(-0.5 * t * t);
    return order == 1 ? -t * g : (t * t - 1.0) * g;
}

void lum_kernel_gauss_derivative(double sigma_px, int order, int radius, struct lum_kernel *k)
{
    double above = 0.0, below = 0.0;
    k->radius = radius;
    for (int i = -radius; i <= radius; i++) {
        double d = derivative(i, sigma_px, order);
        *(d > 0.0 ? &above : &below) += d;
    }
    for (int i = -radius; i <= radius; i++) {
        double d = derivative(i, sigma_px, order);
        k->weights[i + radius] = (float)(d / (d > 0.0 ? above : -below));
    }
}

/* ret[x] += weight * row[x + shift], the row going on beyond its ends. */
static void add_shifted(const float *row, int64_t w, int64_t shift, float weight, float *ret)
{
    int64_t begin = shift < 0 ? -shift : 0, end = shift > 0 ? w - shift : w;
    begin = begin < w ? begin : w;
    end = end > 0 ? end : 0;
    for (int64_t x = 0; x < begin; x++)
        ret[x] += weight * row[0];
    for (int64_t x = begin; x < end; x++)
        ret[x] += weight * row[x + shift];
    for (int64_t x = end > begin ? end : begin; x < w; x++)
        ret[x] += weight * row[w - 1];
}

void lum_blur(const float *in, uint32_t w, uint32_t h, const struct lum_kernel *along[2], float *work, float *ret)
{
    memset(work, 0, (size_t)w * h * sizeof *work);
    for (uint32_t y = 0; y < h; y++)
        for (int i = -along[0]->radius; i <= along[0]->radius; i++)
            add_shifted(in + (size_t)y * w, w, i, along[0]->weights[i + along[0]->radius], work + (size_t)y * w);
    memset(ret, 0, (size_t)w * h * sizeof *ret);
    for (int64_t y = 0; y < (int64_t)h; y++)
        for (int i = -along[1]->radius; i <= along[1]->radius; i++) {
            int64_t from = y + i < 0 ? 0 : y + i < (int64_t)h ? y + i : (int64_t)h - 1;
            add_shifted(work + (size_t)from * w, w, 0, along[1]->weights[i + along[1]->radius], ret + (size_t)y * w);
        }
}
