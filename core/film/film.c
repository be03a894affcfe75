#include "core/film/film.h"

#include <string.h>

enum lum_status lum_film_init(struct lum_film *film, uint32_t w, uint32_t h, struct lum_error *err)
{
    struct lum_film f = {.w = w, .h = h};
    size_t n = (size_t)w * h;
    for (int i = 0; i < 2; i++) {
        f.half[i] = lum_calloc(n * 3, sizeof *f.half[i]);
        f.n[i] = lum_calloc(n, sizeof *f.n[i]);
        if (!f.half[i] || !f.n[i]) {
            lum_film_finish(&f);
            return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for a film of %u x %u", w, h);
        }
    }
    *film = f;
    return LUM_OK;
}

enum lum_status lum_film_keep_first(struct lum_film *film, struct lum_error *err)
{
    for (int i = 0; i < 2; i++) {
        if (!film->first[i])
            film->first[i] = lum_calloc((size_t)film->w * film->h, sizeof *film->first[i]);
        if (!film->first[i])
            return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for a film of %u x %u", film->w, film->h);
    }
    return LUM_OK;
}

void lum_film_finish(struct lum_film *film)
{
    for (int i = 0; i < 2; i++) {
        lum_free(film->first[i]);
        lum_free(film->half[i]);
        lum_free(film->n[i]);
    }
    *film = (struct lum_film){0};
}

void lum_film_add(struct lum_film *film, uint32_t x, uint32_t y, uint32_t sample, struct lum_rgb radiance,
                  uint64_t *nonfinite)
{
    if (!isfinite(radiance.r) || !isfinite(radiance.g) || !isfinite(radiance.b)) {
        (*nonfinite)++;
        return;
    }
    size_t i = (size_t)y * film->w + x;
    uint32_t half = (sample ^ x) & 1u;
    double *sum = &film->half[half][3 * i];
    sum[0] += (double)radiance.r;
    sum[1] += (double)radiance.g;
    sum[2] += (double)radiance.b;
    film->n[half][i]++;
}

/* A mean of n that is kept up to date: a sum of floats would lose what is 2^24 times less than it. */
static struct lum_rgb mean_with(struct lum_rgb mean, struct lum_rgb value, uint32_t n)
{
    return n < 2 ? value : lum_rgb_mad(mean, lum_rgb_mad(value, mean, -1.0f), 1.0f / (float)n);
}

void lum_film_add_apart(struct lum_film *film, uint32_t x, uint32_t y, uint32_t sample, struct lum_rgb radiance,
                        const struct lum_film_first *first, uint64_t *nonfinite)
{
    size_t i = (size_t)y * film->w + x;
    uint32_t half = (sample ^ x) & 1u;
    if (!lum_rgb_finite(radiance) || !lum_rgb_finite(first->shine) || !lum_rgb_finite(first->albedo)) {
        (*nonfinite)++;
        return;
    }
    lum_film_add(film, x, y, sample, radiance, nonfinite);
    struct lum_film_first *mean = &film->first[half][i];
    mean->shine = mean_with(mean->shine, first->shine, film->n[half][i]);
    mean->albedo = mean_with(mean->albedo, first->albedo, film->n[half][i]);
}

void lum_film_reset_pixel(struct lum_film *film, uint32_t x, uint32_t y)
{
    size_t i = (size_t)y * film->w + x;
    for (int half = 0; half < 2; half++) {
        memset(&film->half[half][3 * i], 0, 3 * sizeof film->half[half][0]);
        film->n[half][i] = 0;
    }
}

void lum_film_set(struct lum_film *film, uint32_t x, uint32_t y, struct lum_rgb radiance, uint64_t *nonfinite)
{
    size_t i = (size_t)y * film->w + x;
    bool sound = isfinite(radiance.r) && isfinite(radiance.g) && isfinite(radiance.b);
    double *sum = &film->half[0][3 * i];
    *nonfinite += !sound;
    sum[0] = sound ? (double)radiance.r : 0.0;
    sum[1] = sound ? (double)radiance.g : 0.0;
    sum[2] = sound ? (double)radiance.b : 0.0;
    film->n[0][i] = sound;
    if (film->n[1][i] == 0) /* its sum is 0: the other half of the film is not touched */
        return;
    memset(&film->half[1][3 * i], 0, 3 * sizeof film->half[1][0]);
    film->n[1][i] = 0;
}

struct lum_rgb lum_film_mean(const struct lum_film *film, uint32_t x, uint32_t y)
{
    size_t i = (size_t)y * film->w + x;
    double n = (double)film->n[0][i] + (double)film->n[1][i];
    if (!(n > 0.0))
        return lum_grey(0.0f);
    const double *a = &film->half[0][3 * i], *b = &film->half[1][3 * i];
    return lum_rgb((float)((a[0] + b[0]) / n), (float)((a[1] + b[1]) / n), (float)((a[2] + b[2]) / n));
}

double lum_film_mean_luminance(const struct lum_film *film)
{
    double sum = 0.0;
    for (uint32_t y = 0; y < film->h; y++)
        for (uint32_t x = 0; x < film->w; x++)
            sum += (double)lum_luminance(lum_film_mean(film, x, y));
    return sum / ((double)film->w * film->h);
}

bool lum_film_is_black(const struct lum_film *film)
{
    for (uint32_t y = 0; y < film->h; y++)
        for (uint32_t x = 0; x < film->w; x++)
            if (!lum_rgb_black(lum_film_mean(film, x, y)))
                return false;
    return true;
}
