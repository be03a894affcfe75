#include "core/interleave/interleave.h"

/* Ordered dither matrices (Bayer 1973), and one of odd size alike. */
static const uint8_t dither[LUM_PATTERN_MAX][LUM_PATTERN_MAX * LUM_PATTERN_MAX] = {
    {0},
    {0, 2, 3, 1},
    {0, 7, 3, 6, 5, 2, 4, 1, 8},
    {0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5},
};

uint32_t lum_pattern_subset(uint32_t side, uint32_t x, uint32_t y)
{
    return dither[side - 1][y % side * side + x % side];
}

void lum_pattern_pixel(uint32_t side, uint32_t subset, uint32_t *ret_x, uint32_t *ret_y)
{
    uint32_t at = 0;
    while (dither[side - 1][at] != subset)
        at++;
    *ret_x = at % side;
    *ret_y = at / side;
}

/* Steps without a common divisor with side * side, next to its golden section: any few iterations in a row spread well.
 */
static const uint8_t stride[LUM_PATTERN_MAX] = {1, 3, 5, 9};

uint32_t lum_pattern_next(uint32_t side, uint32_t subset, uint32_t iteration)
{
    uint32_t n = side * side;
    return (subset + iteration % n * stride[side - 1]) % n;
}

void lum_pattern_positions(uint32_t first, uint32_t n, uint32_t border, uint32_t period, uint32_t size,
                           uint32_t *ret_at)
{
    for (uint32_t i = 0; i < n + 2 * border; i++) {
        int64_t q = (int64_t)first + i - border;
        q += q < 0 ? (int64_t)period : q >= size ? -(int64_t)period : 0;
        ret_at[i] = q >= 0 && q < size ? (uint32_t)q : LUM_NOWHERE;
    }
}
