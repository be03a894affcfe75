#include "core/math/sampler.h"

/* FNV-1a. */
uint32_t lum_hash_text(const char *text)
{
    uint32_t h = 2166136261u;
    for (; *text; text++)
        h = (h ^ (uint8_t)*text) * 16777619u;
    return h;
}

uint64_t lum_hash64_text(const char *text)
{
    uint64_t h = UINT64_C(14695981039346656037);
    for (; *text; text++)
        h = (h ^ (uint8_t)*text) * UINT64_C(1099511628211);
    return h;
}

struct lum_sampler lum_sampler_at(uint32_t px, uint32_t py, uint32_t sample, uint32_t seed)
{
    uint32_t h = lum_hash_combine(lum_hash_combine(lum_hash_u32(seed ^ 0x6c756d65u), px), py);
    return (struct lum_sampler){h, sample};
}

struct lum_sampler lum_sampler_halves(uint32_t px, uint32_t py, uint32_t sample, uint32_t seed)
{
    struct lum_sampler s = lum_sampler_at(px, py, sample >> 1, seed);
    if (sample & 1u)
        s.pixel_seed = lum_hash_u32(s.pixel_seed ^ 0x6f646421u);
    return s;
}

static uint32_t reverse_bits(uint32_t x)
{
    x = __builtin_bswap32(x);
    x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
    x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
    return (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
}

/* Laine-Karras permutation: each output bit depends only on the bits below it, so that on a bit-reversed number it is a
 * nested uniform (Owen) scramble. Constants: N. Vegdahl, Building a better LK hash, 2021. */
static uint32_t laine_karras(uint32_t x, uint32_t seed)
{
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

/* Second Sobol dimension of index i, given rev = the bit reversal of i. Its matrix is Pascal's triangle mod 2, the
 * fifth Kronecker power of [[1,1],[0,1]]: one step per factor. */
static uint32_t sobol_second(uint32_t rev)
{
    rev ^= rev << 16;
    rev ^= (rev & 0x00ff00ffu) << 8;
    rev ^= (rev & 0x0f0f0f0fu) << 4;
    rev ^= (rev & 0x33333333u) << 2;
    rev ^= (rev & 0x55555555u) << 1;
    return rev;
}

/* The top 24 bits as a float: exact, and below 1. */
static float unit_float(uint32_t x)
{
    return (float)(x >> 8) * 0x1p-24f;
}

static uint32_t pair_seed(const struct lum_sampler *s, uint32_t pair)
{
    return lum_hash_combine(s->pixel_seed, pair);
}

/* reverse-LK of the index, left reversed: the third step of the full scramble cancels against the reversal that makes
 * the first Sobol dimension (van der Corput) of it. */
static uint32_t shuffled_reversed(uint32_t sample, uint32_t seed)
{
    return laine_karras(reverse_bits(sample), seed);
}

static float scramble(uint32_t x, uint32_t seed)
{
    return unit_float(reverse_bits(laine_karras(reverse_bits(x), seed)));
}

struct lum_vec2 lum_sampler_2d(const struct lum_sampler *s, uint32_t pair)
{
    uint32_t seed = pair_seed(s, pair);
    uint32_t rev = shuffled_reversed(s->sample, lum_hash_u32(seed ^ 0xa511e9b3u));
    return (struct lum_vec2){scramble(rev, lum_hash_u32(seed ^ 0x63d83595u)),
                             scramble(sobol_second(rev), lum_hash_u32(seed ^ 0xa3d95fa8u))};
}

float lum_sampler_1d(const struct lum_sampler *s, uint32_t pair)
{
    uint32_t seed = pair_seed(s, pair);
    uint32_t rev = shuffled_reversed(s->sample, lum_hash_u32(seed ^ 0xa511e9b3u));
    return scramble(rev, lum_hash_u32(seed ^ 0x63d83595u));
}
