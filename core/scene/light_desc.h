/* Descriptions of lights that are put into a scene, as the others in desc.h. */
#ifndef LUM_CORE_SCENE_LIGHT_DESC_H
#define LUM_CORE_SCENE_LIGHT_DESC_H

#include <stdbool.h>

#include "core/base/status.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_web;

/* What tells kinds of light apart (light_kind.h): a row. These are asked for by name; the list of all is the protocol's
 * (server/world/light_kinds.h). */
struct lum_light_kind_row;
extern const struct lum_light_kind_row lum_light_kind_point, lum_light_kind_spot, lum_light_kind_ies,
    lum_light_kind_directional, lum_light_kind_quad, lum_light_kind_disc, lum_light_kind_sphere,
    lum_light_kind_environment, lum_light_kind_sky, lum_light_kind_sun;

/* Of a lamp with a web: the flat shape that shines. A disc has the area of the ellipse of its two diameters. */
enum lum_opening { LUM_OPENING_POINT, LUM_OPENING_RECTANGLE, LUM_OPENING_DISC };

/* What a sky's intensity is: luminance of its zenith; lx on the open horizontal plane; or none, and its sun's elevation
 * says how much light that is (core/light/solar.h). */
enum lum_sky_amount { LUM_SKY_ZENITH, LUM_SKY_HORIZONTAL, LUM_SKY_BY_SUN };

struct lum_light_desc {
    const struct lum_light_kind_row *kind;
    struct lum_vec3d position;  /* point, spot, ies, disc, sphere: centre; quad: centre */
    struct lum_vec3d direction; /* spot, ies, directional, disc, sun: where light goes; need not be unit */
    struct lum_vec3d u, v;      /* quad: full edges; emits towards cross(u, v). ies: u is, but for what it has
                                 * of the direction, where the web's c is 0 (core/light/web.h) */
    double radius_m;            /* disc, sphere */
    double diameter_rad;        /* directional, sun: angle across its disc; 0: parallel light */
    double inner_cone_rad, outer_cone_rad; /* spot: half angles; glTF falloff (smooth in cos) */
    struct lum_rgb color;                  /* chromaticity, luminance 1 */
    const struct lum_web *web;             /* ies: the scene takes a reference of its own */
    enum lum_opening opening;              /* ies; where a side of it is 0, a point */
    double opening_m[2];                   /* along c0, along c90 */
    /* The photometric size, in the unit natural to the kind (records in lm are converted by the caller with
     * lum_light_from_flux): point, spot: cd; ies: cd of its brightest direction; directional, sun: lx on a facing
     * plane; area, environment: cd/m2; sky: as sky_amount says. 0 to 1e12 */
    double intensity;
    const char *image;   /* environment: equirectangular image id, or NULL: constant. A texel of value 1 shines with
                          * intensity cd/m2 times color; a picture in cd/m2 takes intensity 1 */
    double rotation_rad; /* environment: about +Y */
    /* sky: its sun is the first light of kind sun, by id, on or off; where there is none, one that stands 45 degrees
     * high over +Z. While skies are on the first by id shines, and no environment; else the first of those that is. */
    int cie_type;                   /* 1..16 (core/light/cie_sky.h) */
    double ground_albedo;           /* 0..1: of what lies below the horizon */
    enum lum_sky_amount sky_amount; /* what intensity is */
    bool on, camera_visible;        /* camera_visible: area lights, environment and sky seen directly */
    const char *group;              /* mixing group, "" = its own id */
};
/* Intensity (in the kind's natural unit) of a light that emits flux_lm in all: point 4 pi sr; spot and ies by the
 * integral of their falloff; quad, disc, sphere: Lambertian, L = flux / (pi A). LUM_ERR_INVALID for directional and
 * environment, and where so much from so small a light is over 1e12. */
LUM_MUST_USE enum lum_status lum_light_from_flux(const struct lum_light_desc *light, double flux_lm,
                                                 double *ret_intensity, struct lum_error *err);

#endif
