/* From radiance to display code values.
 *
 * Exposed radiance x (1 = display white) is mapped to display-linear [0,1] by a tone map, then encoded by the exact
 * sRGB transfer function. All maps are bounded and non-decreasing on grey; none sees a value outside [0, EXPOSED_MAX].
 */
#include "core/film/film.h"

#include <float.h>
#include <math.h>
#include <string.h>

const char *const lum_tone_map_names[] = {"agx", "aces", "reinhard", "none", NULL};

/* Over this every map is at its limit in 8 bits; bounding here keeps the rational fits finite. */
#define EXPOSED_MAX 1e9f
#define MIDDLE_GREY 0.18  /* what a grey card reflects, and the mean of a picture is exposed to */
#define EXPOSURE_BLOCK 8u /* pixels a side */

double lum_exposure_white(double ev100)
{
    return 1.2 * exp2(ev100);
}

/* Mean luminance of the block whose corner is x, y; 0 where it is not finite. Of each picture that is shown: so without
 * lum_film_mean, a call for every pixel. */
static double block_luminance(const struct lum_film *film, uint32_t x, uint32_t y)
{
    double sum = 0.0;
    uint32_t w = film->w - x < EXPOSURE_BLOCK ? film->w - x : EXPOSURE_BLOCK;
    uint32_t h = film->h - y < EXPOSURE_BLOCK ? film->h - y : EXPOSURE_BLOCK;
    for (uint32_t j = y; j < y + h; j++)
        for (size_t i = (size_t)j * film->w + x; i < (size_t)j * film->w + x + w; i++) {
            const double *a = &film->half[0][3 * i], *b = &film->half[1][3 * i];
            double n = (double)film->n[0][i] + (double)film->n[1][i];
            struct lum_rgb all = lum_rgb((float)(a[0] + b[0]), (float)(a[1] + b[1]), (float)(a[2] + b[2]));
            sum += n > 0.0 ? (double)lum_luminance(all) / n : 0.0;
        }
    return isfinite(sum) ? sum / (w * h) : 0.0;
}

/* Blocks by the octave of their luminance, from 2^OCTAVE_MIN cd/m2 on: so the film is read once. */
enum { OCTAVE_MIN = -64, N_OCTAVES = 128 };
struct octave {
    double log_sum, n;
};

static int octave_of(double luminance)
{
    int octave = ilogb(luminance) - OCTAVE_MIN;
    return octave < 0 ? 0 : octave >= N_OCTAVES ? N_OCTAVES - 1 : octave;
}

/* The logarithm is taken of blocks, not of pixels: in a picture of few samples many pixels are still black by chance.
 * What is black in truth (more than four decades below the mean of the picture, to an octave) has no say. */
double lum_exposure_auto(const struct lum_film *film)
{
    struct octave octaves[N_OCTAVES] = {{0.0, 0.0}};
    double sum = 0.0, n = 0.0, log_sum = 0.0, n_lit = 0.0;
    for (uint32_t y = 0; y < film->h; y += EXPOSURE_BLOCK)
        for (uint32_t x = 0; x < film->w; x += EXPOSURE_BLOCK, n += 1.0) {
            double luminance = block_luminance(film, x, y);
            if (!(luminance > 0.0))
                continue;
            struct octave *at = &octaves[octave_of(luminance)];
            at->log_sum += log2(luminance);
            at->n += 1.0;
            sum += luminance;
        }
    if (!(sum > 0.0))
        return 0.0;
    for (int i = octave_of(1e-4 * sum / n); i < N_OCTAVES; i++) {
        log_sum += octaves[i].log_sum;
        n_lit += octaves[i].n;
    }
    return log_sum / n_lit - log2(MIDDLE_GREY * lum_exposure_white(0.0));
}

/* 2^x and log2(x) for x in the range of normal floats, within 2e-7 of the exact value (relative; log2: absolute): half
 * a step of 8 bits is 2e-3. Without calls and branches, so that loops over pixels become vector code. */
static float fast_exp2(float x)
{
    x = lum_clamp(x, -126.0f, 126.0f);
    float whole = floorf(x), f = x - whole - 0.5f;
    /* Taylor series of 2^(f + 1/2) in f ln 2, |f| <= 1/2: the next term is below 1e-8 */
    float t = f * 0.69314718f, p = 1.0f / 5040.0f;
    p = p * t + 1.0f / 720.0f;
    p = p * t + 1.0f / 120.0f;
    p = p * t + 1.0f / 24.0f;
    p = p * t + 1.0f / 6.0f;
    p = p * t + 0.5f;
    p = p * t + 1.0f;
    p = p * t + 1.0f;
    int32_t bits = ((int32_t)whole + 127) * (1 << 23);
    float scale;
    memcpy(&scale, &bits, sizeof scale);
    return p * 1.41421356f * scale;
}

static float fast_log2(float x)
{
    int32_t bits;
    memcpy(&bits, &x, sizeof bits);
    int32_t exponent = (bits - 0x3f3504f3) >> 23; /* mantissa in [sqrt(1/2), sqrt(2)) */
    bits -= exponent * (1 << 23);
    float m;
    memcpy(&m, &bits, sizeof m);
    /* log2 m = 2 / ln 2 * atanh((m - 1) / (m + 1)), argument at most 0.172: the next term is below 1e-8 */
    float r = (m - 1.0f) / (m + 1.0f), q = r * r;
    float p = 1.0f / 9.0f;
    p = p * q + 1.0f / 7.0f;
    p = p * q + 1.0f / 5.0f;
    p = p * q + 1.0f / 3.0f;
    p = p * q + 1.0f;
    return (float)exponent + 2.88539008f * r * p;
}

/* x^y for x in [0, 1] and y > 0; below 2^-100 both are 0 in 8 bits. */
static float fast_pow(float x, float y)
{
    return fast_exp2(y * fast_log2(lum_max(x, 0x1p-100f)));
}

/* NaN and negative values give 0. */
static float bounded(float v)
{
    return v > 0.0f ? lum_min(v, EXPOSED_MAX) : 0.0f;
}

static struct lum_rgb mul3(const float m[3][3], struct lum_rgb c)
{
    return lum_rgb(m[0][0] * c.r + m[0][1] * c.g + m[0][2] * c.b, m[1][0] * c.r + m[1][1] * c.g + m[1][2] * c.b,
                   m[2][0] * c.r + m[2][1] * c.g + m[2][2] * c.b);
}

/* AgX (Troy Sobotka), default look: inset matrix, log2 over 16.5 stops, the sigmoid as the polynomial published by
 * B. Wrensch (2023), outset matrix, 2.2 power. */
static float agx_curve(float x)
{
    const float lo = -12.47393f, hi = 4.026069f;
    float t = (fast_log2(lum_max(x, FLT_MIN)) - lo) / (hi - lo);
    t = lum_clamp01(t);
    float t2 = t * t, t4 = t2 * t2;
    return 15.5f * t4 * t2 - 40.14f * t4 * t + 31.96f * t4 - 6.868f * t2 * t + 0.4298f * t2 + 0.1191f * t - 0.00232f;
}

static const float agx_inset[3][3] = {{0.842479062253094f, 0.0784335999999992f, 0.0792237451477643f},
                                      {0.0423282422610123f, 0.878468636469772f, 0.0791661274605434f},
                                      {0.0423756549057051f, 0.0784336f, 0.879142973793104f}};
static const float agx_outset[3][3] = {{1.19687900512017f, -0.0980208811401368f, -0.0990297440797205f},
                                       {-0.0528968517574562f, 1.15190312990417f, -0.0989611768448433f},
                                       {-0.0529716355144438f, -0.0980434501171241f, 1.15107367264116f}};

/* ACES RRT + sRGB ODT, the fit by S. Hill (2016): rational curve between two matrices. */
static float aces_curve(float v)
{
    return (v * (v + 0.0245786f) - 0.000090537f) / (v * (0.983729f * v + 0.4329510f) + 0.238081f);
}

static struct lum_rgb tone_aces(struct lum_rgb c)
{
    static const float in[3][3] = {
        {0.59719f, 0.35458f, 0.04823f}, {0.07600f, 0.90834f, 0.01566f}, {0.02840f, 0.13383f, 0.83777f}};
    static const float out[3][3] = {
        {1.60475f, -0.53108f, -0.07367f}, {-0.10208f, 1.10813f, -0.00605f}, {-0.00327f, -0.07276f, 1.07602f}};
    c = mul3(in, c);
    return mul3(out, lum_rgb(aces_curve(c.r), aces_curve(c.g), aces_curve(c.b)));
}

/* Reinhard et al. 2002 eq. 3 on luminance; hue and saturation are kept. */
static struct lum_rgb tone_reinhard(struct lum_rgb c)
{
    return lum_rgb_scale(c, 1.0f / (1.0f + lum_luminance(c)));
}

/* IEC 61966-2-1. */
static int32_t srgb_code(float v)
{
    v = lum_clamp01(v);
    float e = v <= 0.0031308f ? 12.92f * v : 1.055f * fast_pow(v, 1.0f / 2.4f) - 0.055f;
    return (int32_t)(e * 255.0f + 0.5f);
}

/* ---- spans of pixels ---- */

/* Planes, so that one instruction serves eight pixels. */
#define SPAN 64u
struct span {
    float r[SPAN], g[SPAN], b[SPAN];
};

static void set_pixel(struct span *s, uint32_t i, struct lum_rgb c)
{
    s->r[i] = c.r;
    s->g[i] = c.g;
    s->b[i] = c.b;
}

static void multiply(struct span *s, const float m[3][3])
{
    for (uint32_t i = 0; i < SPAN; i++)
        set_pixel(s, i, mul3(m, lum_rgb(s->r[i], s->g[i], s->b[i])));
}

static void agx_curves(float *v)
{
    for (uint32_t i = 0; i < SPAN; i++)
        v[i] = agx_curve(v[i]);
}

static void agx_powers(float *v)
{
    for (uint32_t i = 0; i < SPAN; i++)
        v[i] = fast_pow(lum_clamp01(v[i]), 2.2f);
}

static void map_agx(struct span *s)
{
    multiply(s, agx_inset);
    agx_curves(s->r);
    agx_curves(s->g);
    agx_curves(s->b);
    multiply(s, agx_outset);
    agx_powers(s->r);
    agx_powers(s->g);
    agx_powers(s->b);
}

/* The loops are over whole spans: what lies past the pixels in use is finite and not read. */
static void map_span(struct span *s, enum lum_tone_map tone)
{
    switch (tone) {
    case LUM_TONE_AGX:
        map_agx(s);
        break;
    case LUM_TONE_ACES:
        for (uint32_t i = 0; i < SPAN; i++)
            set_pixel(s, i, tone_aces(lum_rgb(s->r[i], s->g[i], s->b[i])));
        break;
    case LUM_TONE_REINHARD:
        for (uint32_t i = 0; i < SPAN; i++)
            set_pixel(s, i, tone_reinhard(lum_rgb(s->r[i], s->g[i], s->b[i])));
        break;
    case LUM_TONE_NONE:
        break;
    }
}

static void encode_plane(const float *v, int32_t *ret_codes)
{
    for (uint32_t i = 0; i < SPAN; i++)
        ret_codes[i] = srgb_code(v[i]);
}

static void encode_span(const struct span *s, uint32_t n, uint8_t *ret_rgba)
{
    int32_t codes[3][SPAN];
    encode_plane(s->r, codes[0]);
    encode_plane(s->g, codes[1]);
    encode_plane(s->b, codes[2]);
    for (uint32_t i = 0; i < n; i++) {
        for (int c = 0; c < 3; c++)
            ret_rgba[4 * i + (uint32_t)c] = (uint8_t)codes[c][i];
        ret_rgba[4 * i + 3] = 255;
    }
}

static struct lum_rgb exposed(struct lum_rgb radiance, float scale)
{
    return lum_rgb(bounded(radiance.r * scale), bounded(radiance.g * scale), bounded(radiance.b * scale));
}

void lum_tone_pixel(struct lum_rgb radiance, double white, enum lum_tone_map tone, uint8_t ret_rgb[3])
{
    struct span s = {0};
    uint8_t rgba[4];
    set_pixel(&s, 0, exposed(radiance, (float)(1.0 / white)));
    map_span(&s, tone);
    encode_span(&s, 1, rgba);
    memcpy(ret_rgb, rgba, 3);
}

void lum_film_resolve(const struct lum_film *film, uint32_t x, uint32_t y, uint32_t w, uint32_t h,
                      const struct lum_display *display, uint8_t *ret_rgba, size_t stride)
{
    float scale = (float)(1.0 / lum_exposure_white(display->ev100));
    struct span s = {0};
    for (uint32_t j = 0; j < h; j++)
        for (uint32_t i = 0; i < w; i += SPAN) {
            uint32_t n = w - i < SPAN ? w - i : SPAN;
            for (uint32_t k = 0; k < n; k++) {
                struct lum_rgb radiance = lum_film_mean(film, x + i + k, y + j);
                if (display->balanced)
                    radiance = mul3(display->balance, radiance);
                set_pixel(&s, k, exposed(radiance, scale));
            }
            map_span(&s, display->tone);
            encode_span(&s, n, ret_rgba + j * stride + 4 * (size_t)i);
        }
}
