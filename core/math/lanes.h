/* Loops that are to become vector code: over LUM_LANES values, without a branch, from pointers (an index of 32 bits may
 * wrap, so that values beside each other are not known to be). What a loop finds out it adds up as bits in the same
 * loop. */
#ifndef LUM_CORE_MATH_LANES_H
#define LUM_CORE_MATH_LANES_H

#include <stdint.h>

#define LUM_LANES 16u /* an AVX-512 register, or two of AVX2 */

/* Lane i as bit i. */
static const uint32_t lum_lane_bit[LUM_LANES] = {1u << 0,  1u << 1,  1u << 2,  1u << 3, 1u << 4,  1u << 5,
                                                 1u << 6,  1u << 7,  1u << 8,  1u << 9, 1u << 10, 1u << 11,
                                                 1u << 12, 1u << 13, 1u << 14, 1u << 15};

#endif
