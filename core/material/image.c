/* Texture lookup. */
#include "core/material/material.h"

#include "core/math/color.h"

/* Coordinate in texels of a texture coordinate, before the half texel shift. Not finite reads as 0: a file may hold
 * anything. The result is in [0, n]. */
static float texel_coordinate(float x, uint32_t n, enum lum_wrap wrap)
{
    if (!isfinite(x))
        return 0.0f;
    switch (wrap) {
    case LUM_WRAP_REPEAT:
        x -= floorf(x);
        break;
    case LUM_WRAP_MIRROR:
        x -= 2.0f * floorf(0.5f * x);
        x = x > 1.0f ? 2.0f - x : x;
        break;
    case LUM_WRAP_CLAMP:
        x = lum_clamp(x, 0.0f, 1.0f);
        break;
    }
    return x * (float)n;
}

/* The two texels around coordinate x of texel_coordinate, and the weight of the second. A mirrored border repeats its
 * own texel, just as a clamped one. */
struct taps {
    uint32_t i[2];
    float w;
};

static struct taps taps_at(float x, uint32_t n, enum lum_wrap wrap)
{
    float shifted = x - 0.5f, lo = floorf(shifted);
    uint32_t below = wrap == LUM_WRAP_REPEAT ? n - 1 : 0, above = wrap == LUM_WRAP_REPEAT ? 0 : n - 1;
    struct taps t = {.w = shifted - lo};
    t.i[0] = lo < 0.0f ? below : (uint32_t)lo;
    if (t.i[0] >= n)
        t.i[0] = n - 1;
    t.i[1] = lo < 0.0f ? 0 : t.i[0] + 1 < n ? t.i[0] + 1 : above;
    return t;
}

static const void *texel_at(const struct lum_image *image, uint32_t x, uint32_t y)
{
    size_t i = (size_t)y * image->width + x;
    return (const char *)image->pixels + i * (image->texel == LUM_TEXEL_RGB32F ? 3 * sizeof(float) : 4);
}

static struct lum_texel_value fetch(const struct lum_image *image, uint32_t x, uint32_t y)
{
    const void *texel = texel_at(image, x, y);
    if (image->texel == LUM_TEXEL_RGB32F) {
        const float *f = texel;
        return (struct lum_texel_value){{f[0], f[1], f[2]}, 1.0f};
    }
    const uint8_t *b = texel;
    float a = (float)b[3] * (1.0f / 255.0f);
    if (image->texel == LUM_TEXEL_SRGB8)
        return (struct lum_texel_value){
            {lum_srgb8_to_linear[b[0]], lum_srgb8_to_linear[b[1]], lum_srgb8_to_linear[b[2]]}, a};
    return (struct lum_texel_value){lum_rgb_scale(lum_rgb(b[0], b[1], b[2]), 1.0f / 255.0f), a};
}

/* Of a texture that is half black at random the mean is 1.6 % off. */
#define MEAN_SIDE 32u

struct lum_rgb lum_image_mean(const struct lum_image *image)
{
    struct lum_rgb sum = {0, 0, 0};
    for (uint32_t i = 0; i < MEAN_SIDE * MEAN_SIDE; i++) {
        uint64_t x = 2 * (i % MEAN_SIDE) + 1, y = 2 * (i / MEAN_SIDE) + 1; /* half steps */
        sum = lum_rgb_add(sum, fetch(image, (uint32_t)(x * image->width / (2 * MEAN_SIDE)),
                                     (uint32_t)(y * image->height / (2 * MEAN_SIDE)))
                                   .rgb);
    }
    return lum_rgb_scale(sum, 1.0f / (MEAN_SIDE * MEAN_SIDE));
}

/* Exact where a = b, and never below 0 for values that are not. */
static struct lum_texel_value lerp(struct lum_texel_value a, struct lum_texel_value b, float w)
{
    return (struct lum_texel_value){
        {a.rgb.r + (b.rgb.r - a.rgb.r) * w, a.rgb.g + (b.rgb.g - a.rgb.g) * w, a.rgb.b + (b.rgb.b - a.rgb.b) * w},
        a.a + (b.a - a.a) * w};
}

struct lum_texel_value lum_image_sample(const struct lum_image *image, struct lum_vec2 uv, enum lum_wrap wrap_u,
                                        enum lum_wrap wrap_v)
{
    struct taps x = taps_at(texel_coordinate(uv.x, image->width, wrap_u), image->width, wrap_u);
    struct taps y = taps_at(texel_coordinate(uv.y, image->height, wrap_v), image->height, wrap_v);
    struct lum_texel_value top = lerp(fetch(image, x.i[0], y.i[0]), fetch(image, x.i[1], y.i[0]), x.w);
    struct lum_texel_value bottom = lerp(fetch(image, x.i[0], y.i[1]), fetch(image, x.i[1], y.i[1]), x.w);
    return lerp(top, bottom, y.w);
}

static struct lum_vec2 image_uv(const struct lum_texture *texture, struct lum_vec2 uv)
{
    const float(*m)[3] = texture->m;
    return (struct lum_vec2){m[0][0] * uv.x + m[0][1] * uv.y + m[0][2], m[1][0] * uv.x + m[1][1] * uv.y + m[1][2]};
}

struct lum_texel_value lum_texture_sample(const struct lum_texture *texture, struct lum_vec2 uv)
{
    if (!texture->image)
        return (struct lum_texel_value){{1.0f, 1.0f, 1.0f}, 1.0f};
    return lum_image_sample(texture->image, image_uv(texture, uv), texture->wrap_u, texture->wrap_v);
}

void lum_texture_ask(const struct lum_texture *texture, struct lum_vec2 uv)
{
    const struct lum_image *image = texture->image;
    struct lum_vec2 t = image_uv(texture, uv);
    struct taps x = taps_at(texel_coordinate(t.x, image->width, texture->wrap_u), image->width, texture->wrap_u);
    struct taps y = taps_at(texel_coordinate(t.y, image->height, texture->wrap_v), image->height, texture->wrap_v);
    for (int k = 0; k < 4; k++)
        lum_ask_memory(texel_at(image, x.i[k & 1], y.i[k >> 1]));
}
