#include "core/light/environment.h"

#include "core/light/cie_sky.h"
#include "core/material/material.h"
#include "core/math/cdf.h"

struct lum_env_map {
    const struct lum_image *image; /* NULL: a sky */
    struct lum_cie_sky sky;
    uint32_t w, h;
    float *row_cdf;    /* h: inclusive, last = 1; all 0 when black */
    float *column_cdf; /* h rows of w: inclusive, last = 1; a black row is all 0 */
    double mean_luminance, peak;
};

static double texel_luminance(const struct lum_image *image, uint32_t x, uint32_t y)
{
    struct lum_vec2 centre = {((float)x + 0.5f) / (float)image->width, ((float)y + 0.5f) / (float)image->height};
    float l = lum_luminance(lum_image_sample(image, centre, LUM_WRAP_REPEAT, LUM_WRAP_CLAMP).rgb);
    return isfinite(l) && l > 0.0f ? (double)l : 0.0;
}

/* Mean of the bilinear interpolant over texel (x, y): weights 1, 6, 1 over 8 along each axis. lum: the rows above, at
 * and below. */
static double texel_mean(double *const lum[3], uint32_t x, uint32_t w)
{
    static const double weight[3] = {0.125, 0.75, 0.125};
    uint32_t left = x > 0 ? x - 1 : w - 1, right = x + 1 < w ? x + 1 : 0;
    double sum = 0.0;
    for (int k = 0; k < 3; k++)
        sum += weight[k] * (0.125 * lum[k][left] + 0.75 * lum[k][x] + 0.125 * lum[k][right]);
    return sum;
}

/* cos(theta) of the upper border of row y. */
static double row_cos(uint32_t y, uint32_t h)
{
    return cos(LUM_PI_D * (double)y / (double)h);
}

/* Turns n non-negative values into an inclusive distribution whose last is exactly 1; all 0 when their sum is. */
static void make_cdf(const double *value, uint32_t n, float *ret_cdf)
{
    double sum = 0.0, total = 0.0;
    for (uint32_t i = 0; i < n; i++)
        total += value[i];
    for (uint32_t i = 0; i < n; i++) {
        sum += value[i];
        ret_cdf[i] = total > 0.0 ? (float)(sum / total) : 0.0f;
    }
    /* Trailing empty entries must stay empty: raise to 1 from the last that is not. */
    for (uint32_t i = n; total > 0.0 && i-- > 0;) {
        ret_cdf[i] = 1.0f;
        if (value[i] > 0.0)
            break;
    }
}

/* Takes over the means of a row's texels; what they come to. */
static double keep_row(struct lum_env_map *map, uint32_t y, const double *mean)
{
    double sum = 0.0;
    for (uint32_t x = 0; x < map->w; x++) {
        sum += mean[x];
        map->peak = fmax(map->peak, mean[x]);
    }
    make_cdf(mean, map->w, map->column_cdf + (size_t)y * map->w);
    return sum / (double)map->w * (row_cos(y, map->h) - row_cos(y + 1, map->h));
}

static void keep_rows(struct lum_env_map *map, const double *row)
{
    double total = 0.0;
    for (uint32_t y = 0; y < map->h; y++)
        total += row[y];
    make_cdf(row, map->h, map->row_cdf);
    map->mean_luminance = 0.5 * total; /* the row heights in cos add up to 2 */
    map->peak = total > 0.0 ? map->peak / map->mean_luminance : 0.0;
}

/* scratch: 4 * w doubles and h doubles. */
static void build(struct lum_env_map *map, double *scratch)
{
    uint32_t w = map->w, h = map->h;
    double *ring[3] = {scratch, scratch + w, scratch + 2 * (size_t)w}, *mean = scratch + 3 * (size_t)w;
    double *row = scratch + 4 * (size_t)w;
    for (uint32_t x = 0; x < w; x++) {
        ring[1][x] = ring[2][x] = texel_luminance(map->image, x, 0);
    }
    for (uint32_t y = 0; y < h; y++) {
        double *free_row = ring[0];
        ring[0] = ring[1], ring[1] = ring[2], ring[2] = free_row;
        for (uint32_t x = 0; x < w; x++)
            ring[2][x] = y + 1 < h ? texel_luminance(map->image, x, y + 1) : ring[1][x];
        for (uint32_t x = 0; x < w; x++)
            mean[x] = texel_mean(ring, x, w);
        row[y] = keep_row(map, y, mean);
    }
    keep_rows(map, row);
}

/* Of a sky: the horizon is the border of two rows. 2.8 degrees a texel: it changes by no more than a half across one.
 */
enum { SKY_W = 128, SKY_H = 64 };

/* Mean over texel (x, y): by Gauss and Legendre, three points in height and two around. */
static double sky_mean(const struct lum_env_map *map, uint32_t x, uint32_t y)
{
    static const double at[3] = {0.1127016653792583, 0.5, 0.8872983346207417}, weight[3] = {5.0, 8.0, 5.0};
    double top = row_cos(y, map->h), bottom = row_cos(y + 1, map->h), sum = 0.0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++) {
            double cos_y = top + at[i] * (bottom - top), sin_y = sqrt(fmax(0.0, 1.0 - cos_y * cos_y));
            double phi = 2.0 * LUM_PI_D * ((x + (k ? 0.7886751345948129 : 0.2113248654051871)) / map->w - 0.5);
            struct lum_vec3 d = lum_v3((float)(sin_y * cos(phi)), (float)cos_y, (float)(sin_y * sin(phi)));
            sum += weight[i] / 36.0 * (double)lum_cie_sky_luminance(&map->sky, d);
        }
    return sum;
}

/* The two sides of the sun are alike, and the ground is even. */
static void build_sky(struct lum_env_map *map, double *scratch)
{
    double *mean = scratch, *row = scratch + map->w;
    for (uint32_t y = 0; y < map->h; y++) {
        for (uint32_t x = 0; x < map->w / 2; x++)
            mean[x] = mean[map->w - 1 - x] = y < map->h / 2 ? sky_mean(map, x, y) : (double)map->sky.ground;
        row[y] = keep_row(map, y, mean);
    }
    keep_rows(map, row);
}

/* ret_scratch: as build wants it. NULL when memory is short. */
static struct lum_env_map *map_alloc(uint32_t w, uint32_t h, double **ret_scratch)
{
    struct lum_env_map *map = lum_calloc(1, sizeof(*map));
    if (!map)
        return NULL;
    *map = (struct lum_env_map){.w = w, .h = h};
    map->row_cdf = lum_calloc(h, sizeof(float));
    map->column_cdf = lum_calloc((size_t)w * h, sizeof(float));
    *ret_scratch = lum_calloc(4 * (size_t)w + h, sizeof(double));
    if (map->row_cdf && map->column_cdf && *ret_scratch)
        return map;
    lum_free(*ret_scratch);
    lum_env_map_destroy(map);
    return NULL;
}

struct lum_env_map *lum_env_map_create(const struct lum_image *image)
{
    double *scratch;
    struct lum_env_map *map = map_alloc(image->width, image->height, &scratch);
    if (!map)
        return NULL;
    map->image = image;
    build(map, scratch);
    lum_free(scratch);
    return map;
}

struct lum_env_map *lum_env_map_create_sky(const struct lum_cie_sky *sky)
{
    double *scratch;
    struct lum_env_map *map = map_alloc(SKY_W, SKY_H, &scratch);
    if (!map)
        return NULL;
    map->sky = *sky;
    build_sky(map, scratch);
    lum_free(scratch);
    return map;
}

void lum_env_map_destroy(struct lum_env_map *map)
{
    if (!map)
        return;
    lum_free(map->column_cdf);
    lum_free(map->row_cdf);
    lum_free(map);
}

double lum_env_map_mean_luminance(const struct lum_env_map *map)
{
    return map->mean_luminance;
}

const struct lum_cie_sky *lum_env_map_sky(const struct lum_env_map *map)
{
    return map->image ? NULL : &map->sky;
}

double lum_env_map_peak(const struct lum_env_map *map)
{
    return map->peak;
}

/* Picture coordinates of a direction, each in [0, 1]. */
static struct lum_vec2 to_uv(struct lum_vec3 d)
{
    /* acos loses all precision near the poles; atan2 does not. */
    return (struct lum_vec2){0.5f + atan2f(d.z, d.x) * (0.5f * LUM_INV_PI),
                             atan2f(sqrtf(d.x * d.x + d.z * d.z), d.y) * LUM_INV_PI};
}

struct lum_rgb lum_env_map_radiance(const struct lum_env_map *map, struct lum_vec3 d)
{
    if (!map->image)
        return lum_grey(lum_cie_sky_luminance(&map->sky, d));
    return lum_image_sample(map->image, to_uv(d), LUM_WRAP_REPEAT, LUM_WRAP_CLAMP).rgb;
}

/* Picks an entry by u; its probability, and u made fresh. */
static uint32_t pick(const float *cdf, uint32_t n, float *inout_u, float *ret_prob)
{
    float below;
    uint32_t i = lum_cdf_find(cdf, n, *inout_u, &below);
    *ret_prob = cdf[i] - below;
    *inout_u = (*inout_u - below) / *ret_prob;
    return i;
}

/* Constant density of a texel of row y that is picked with probability prob. */
static float texel_pdf(const struct lum_env_map *map, uint32_t y, float prob)
{
    double solid_angle = 2.0 * LUM_PI_D / (double)map->w * (row_cos(y, map->h) - row_cos(y + 1, map->h));
    return (float)((double)prob / solid_angle);
}

bool lum_env_map_sample(const struct lum_env_map *map, struct lum_vec2 u, struct lum_vec3 *ret_d, float *ret_pdf_sa)
{
    if (!(map->row_cdf[map->h - 1] > 0.0f))
        return false;
    float row_prob, column_prob;
    uint32_t y = pick(map->row_cdf, map->h, &u.y, &row_prob);
    uint32_t x = pick(map->column_cdf + (size_t)y * map->w, map->w, &u.x, &column_prob);
    double top = row_cos(y, map->h), bottom = row_cos(y + 1, map->h), c = top + (double)u.y * (bottom - top);
    double s = sqrt(fmax(0.0, 1.0 - c * c));
    double phi = 2.0 * LUM_PI_D * (((double)x + (double)u.x) / (double)map->w - 0.5);
    *ret_d = lum_v3((float)(s * cos(phi)), (float)c, (float)(s * sin(phi)));
    *ret_pdf_sa = texel_pdf(map, y, row_prob * column_prob);
    return true;
}

float lum_env_map_pdf(const struct lum_env_map *map, struct lum_vec3 d)
{
    struct lum_vec2 uv = to_uv(d);
    float fx = uv.x * (float)map->w, fy = uv.y * (float)map->h;
    uint32_t x = fx < (float)(map->w - 1) ? (uint32_t)fx : map->w - 1;
    uint32_t y = fy < (float)(map->h - 1) ? (uint32_t)fy : map->h - 1;
    const float *column = map->column_cdf + (size_t)y * map->w;
    float row_prob = map->row_cdf[y] - (y > 0 ? map->row_cdf[y - 1] : 0.0f);
    return texel_pdf(map, y, row_prob * (column[x] - (x > 0 ? column[x - 1] : 0.0f)));
}
