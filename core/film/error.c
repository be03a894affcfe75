#include "core/film/error_map.h"
#include "core/math/sampler.h"

/* Let A = t + a and B = t + b be the means of a pixel's halves, t the truth; a and b are independent with mean 0. The
 * picture is (A + B) / 2. Then, exactly,
 *
 *   squared error ((a + b) / 2)^2 = D + a b,   D = (A - B)^2 / 4.
 *
 * So the sum of D over the picture is what its squared error is expected to be, and off by the sum of a b: of mean 0,
 * however the pixels' noise is distributed. A firefly is in D and in the error alike.
 *
 * Pixels near each other may be noisy together, so that sums over blocks of pixels are looked at: X of a b, Y of D,
 * P of a^2, Q of b^2. Y = (P + Q - 2 X) / 4, and products like P X have mean 0. With |X| <= (P + Q) / 2 (Cauchy)
 *
 *   E[Y^2] = (E[(P + Q)^2] + 4 E[X^2]) / 16 >= E[X^2] / 2,
 *
 * whatever the noise and however alike the pixels of a block are. Blocks are independent of each other: the variance
 * of the sum of all X is at most twice the sum of E[Y^2], of which the Y themselves are an estimate. So the squared
 * error is sum Y with a deviation of sqrt(2 sum Y^2) at most. With few blocks the deviation is as uncertain as the
 * sum, and small where that is small: the ratio of both is taken for the deviation of a logarithm, so that the bound is
 * a factor.
 *
 * Halves of unlike size, as of an odd number of samples, are weighed so that D has the right mean: the variance of
 * A - B is s^2 (na + nb) / (na nb) for samples of variance s^2, that of the picture s^2 / (na + nb). */
#define SIDE 8u /* of a block */
/* Of a picture with one sample, so many are looked at: it is one in motion, and whoever moves it waits. 512 x 512. */
#define BLOCKS_BESIDE 4096u

/* Rec.709 luminance of three sums, in double. */
static double luminance_of(const double *sum)
{
    return 0.2126 * sum[0] + 0.7152 * sum[1] + 0.0722 * sum[2];
}

struct sums {
    double square, light; /* of D, and of the picture */
};

/* Of a pixel. False: it has no sample in one half. */
static bool look_at(const struct lum_film *f, uint32_t x, uint32_t y, struct sums *ret)
{
    size_t i = (size_t)y * f->w + x;
    double na = (double)f->n[0][i], nb = (double)f->n[1][i], n = na + nb;
    if (!(na > 0.0) || !(nb > 0.0))
        return false;
    double a = luminance_of(&f->half[0][3 * i]), b = luminance_of(&f->half[1][3 * i]), apart = a / na - b / nb;
    *ret = (struct sums){apart * apart * na * nb / (n * n), (a + b) / n};
    return true;
}

/* Of a pixel whose neighbour is the other half: (A - B)^2 = a^2 + b^2 - 2 a b for the errors a^2 + b^2 of both, and
 * what they are to be apart only adds to it. The sum of Y = (A - B)^2 is off by that of 2 X, with E[Y^2] >= 8 E[X^2]:
 * less than above. A last column without a partner has that of the one before. */
static bool look_beside(const struct lum_film *f, uint32_t x, uint32_t y, struct sums *ret)
{
    uint32_t other = (x ^ 1u) < f->w ? x ^ 1u : x - 1;
    if (f->w < 2)
        return false;
    double here = (double)lum_luminance(lum_film_mean(f, x, y));
    double apart = here - (double)lum_luminance(lum_film_mean(f, other, y));
    *ret = (struct sums){apart * apart * (other == (x ^ 1u) ? 0.5 : 1.0), here};
    return true;
}

typedef bool (*look_fn)(const struct lum_film *f, uint32_t x, uint32_t y, struct sums *ret);

/* Of the block whose first pixel is (x0, y0). False: a pixel tells nothing. */
static bool sum_block(const struct lum_film *f, uint32_t x0, uint32_t y0, look_fn look, struct sums *ret_sums)
{
    struct sums sums = {0}, pixel;
    for (uint32_t y = y0; y < f->h && y < y0 + SIDE; y++)
        for (uint32_t x = x0; x < f->w && x < x0 + SIDE; x++) {
            if (!look(f, x, y, &pixel))
                return false;
            sums.square += pixel.square;
            sums.light += pixel.light;
        }
    *ret_sums = sums;
    return true;
}

/* Of one in `stride` blocks in a row of all, which one is drawn. Then the sums are off by which blocks these are, too:
 * by the variance of as many that are drawn from all, at most. rel^2 goes by the square of light. */
static struct lum_film_error error_by(const struct lum_film *film, look_fn look, uint32_t stride)
{
    double square = 0.0, square2 = 0.0, light = 0.0, light2 = 0.0, n = 0.0;
    uint32_t nx = (film->w + SIDE - 1) / SIDE, n_blocks = nx * ((film->h + SIDE - 1) / SIDE);
    for (uint32_t first = 0; first < n_blocks; first += stride) {
        uint32_t left = n_blocks - first,
                 i = first + (stride > 1 ? lum_hash_u32(first) : 0) % (left < stride ? left : stride);
        uint32_t x = i % nx * SIDE, y = i / nx * SIDE;
        struct sums s;
        if (!sum_block(film, x, y, look, &s))
            return LUM_FILM_ERROR_UNKNOWN;
        square += s.square;
        square2 += s.square * s.square;
        light += s.light;
        light2 += s.light * s.light;
        n += (double)(film->w - x < SIDE ? film->w - x : SIDE) * (film->h - y < SIDE ? film->h - y : SIDE);
    }
    if (!(light > 0.0)) /* it may only not have been found, and there is nothing that the error could be a part of */
        return LUM_FILM_ERROR_UNKNOWN;
    double variance = square > 0.0 ? 2.0 * square2 / (square * square) : 0.0;
    if (stride > 1)
        variance = 1.5 * variance + 4.0 * light2 / (light * light);
    double most = square * exp(LUM_SURE * sqrt(variance));
    return (struct lum_film_error){sqrt(square * n) / light, sqrt(most * n) / light, n, 1.0};
}

struct lum_film_error lum_film_error(const struct lum_film *film)
{
    return error_by(film, look_at, 1);
}

struct lum_film_error lum_film_error_at_most(const struct lum_film *film)
{
    uint32_t n_blocks = ((film->w + SIDE - 1) / SIDE) * ((film->h + SIDE - 1) / SIDE);
    return error_by(film, look_beside, (n_blocks + BLOCKS_BESIDE - 1) / BLOCKS_BESIDE);
}

void lum_error_map_add_halves(struct lum_error_map *map, const struct lum_film *film)
{
    struct sums pixel;
    for (uint32_t y = 0; y < film->h; y++)
        for (uint32_t x = 0; x < film->w; x++)
            if (look_at(film, x, y, &pixel))
                lum_error_map_add(map, x, y, pixel.square, 1.0);
}
