/* Counter-based random numbers: value = f(pixel, dimension, sample, seed), never a state. The same pixel and sample
 * give the same numbers on any thread, which is what makes images reproducible and single samples replayable.
 *
 * Owen-scrambled Sobol (Burley 2020), padded: dimensions are taken in pairs; each pair is a 2D Sobol sequence whose
 * index is shuffled by a full nested uniform scramble and whose coordinates are Owen-scrambled, both seeded by a hash
 * of (pixel, pair, seed). */
#ifndef LUM_CORE_MATH_SAMPLER_H
#define LUM_CORE_MATH_SAMPLER_H

#include <stdint.h>

#include "core/math/vec.h"

struct lum_sampler {
    uint32_t pixel_seed; /* hash of pixel and user seed */
    uint32_t sample;     /* index of the sample in its pixel */
};

struct lum_sampler lum_sampler_at(uint32_t px, uint32_t py, uint32_t sample, uint32_t seed);

/* For film whose even and odd samples are two halves that shall be independent: each half is a sequence of its own.
 * Even and odd members of one sequence lie in complementary strata: their difference overstates the error, up to
 * several times. */
struct lum_sampler lum_sampler_halves(uint32_t px, uint32_t py, uint32_t sample, uint32_t seed);

/* Two numbers in [0,1), stratified over samples. pair: which decision of the path this is. */
struct lum_vec2 lum_sampler_2d(const struct lum_sampler *s, uint32_t pair);
float lum_sampler_1d(const struct lum_sampler *s, uint32_t pair);

/* 32-bit mixer "lowbias32" (C. Wellons, Hash function prospecting, 2018): bias 0.17 of the ideal avalanche. */
static inline uint32_t lum_hash_u32(uint32_t x)
{
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}
static inline uint32_t lum_hash_combine(uint32_t seed, uint32_t value)
{
    return lum_hash_u32(seed ^ (lum_hash_u32(value) + 0x9e3779b9u + (seed << 6) + (seed >> 2)));
}
uint32_t lum_hash_text(const char *text);
uint64_t lum_hash64_text(const char *text); /* for what stands for an id itself: collisions are not to be met */

#endif
