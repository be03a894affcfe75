/* Environments: radiance by direction with its sampling distribution. Of an equirectangular image, or of a sky in
 * closed form (cie_sky.h), whose distribution is that of a picture of it.
 *
 * Local directions: +Y is the top row, the centre of the picture looks along +X and u grows towards +Z (so that it is
 * not mirrored seen from inside; the same as three.js). lum_light.frame turns local to scene: t, b, n are the
 * images of local +X, +Y, +Z.
 *
 * Radiance of an image is bilinear between texels, that of a sky exact. The distribution is constant over each texel,
 * in proportion to the exact mean of the bilinear luminance there (of a sky by quadrature, to about a thousandth) times
 * the texel's solid angle; within a texel it is uniform in solid angle. So its pdf is never 0 where there is light (to
 * 2^-24 of a row), and needs no division by sin(theta) at the poles. */
#ifndef LUM_CORE_LIGHT_ENVIRONMENT_H
#define LUM_CORE_LIGHT_ENVIRONMENT_H

#include "core/base/base.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_cie_sky;
struct lum_image;
struct lum_env_map;

/* The image is borrowed and must outlive the map. NULL when memory is short. An image that is black everywhere makes a
 * map that is never sampled. */
struct lum_env_map *lum_env_map_create(const struct lum_image *image);
/* The zenith has luminance 1; the sun stands over +X. NULL when memory is short. */
struct lum_env_map *lum_env_map_create_sky(const struct lum_cie_sky *sky);
void lum_env_map_destroy(struct lum_env_map *map); /* accepts NULL */

/* Mean luminance over the sphere, in the image's own unit: flux of the light = pi * mean * area it falls on. */
double lum_env_map_mean_luminance(const struct lum_env_map *map);

/* What it was made from; NULL: an image. */
const struct lum_cie_sky *lum_env_map_sky(const struct lum_env_map *map);

/* Luminance of the brightest texel, in means. 0: the image is black. */
double lum_env_map_peak(const struct lum_env_map *map);

/* Radiance from local unit direction d (which points away from the scene's centre). */
struct lum_rgb lum_env_map_radiance(const struct lum_env_map *map, struct lum_vec3 d);

/* Direction with pdf in solid angle. False when the image is black. */
bool lum_env_map_sample(const struct lum_env_map *map, struct lum_vec2 u, struct lum_vec3 *ret_d, float *ret_pdf_sa);
float lum_env_map_pdf(const struct lum_env_map *map, struct lum_vec3 d);

#endif
