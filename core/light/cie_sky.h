/* CIE general skies: luminance by direction in closed form (CIE S 011/E:2003, ISO 15469:2004).
 *
 * Local directions: +Y is the zenith, the sun stands over +X. Luminances are over that of the zenith:
 *   L / Lz = f(chi) phi(Z) / (f(Zs) phi(0)),  Z, Zs: angles from the zenith to the place and to the sun, chi: between
 *   phi(Z) = 1 + a exp(b / cos Z)                             gradation, from horizon to zenith
 *   f(chi) = 1 + c (exp(d chi) - exp(d pi / 2)) + e cos^2 chi indicatrix, around the sun
 * Below the horizon lies the ground, which is lit by this sky alone and reflects a share of it evenly. */
#ifndef LUM_CORE_LIGHT_CIE_SKY_H
#define LUM_CORE_LIGHT_CIE_SKY_H

#include <stdint.h>

#include "core/math/vec.h"

/* Types 1 to 15 of the standard, and 16, its traditional overcast sky: L / Lz = (1 + 2 cos Z) / 3. */
#define LUM_CIE_SKY_TYPES 16

struct lum_cie_sky {
    int type;
    double sun_elevation_rad;    /* 0..pi/2: a sun below the horizon leaves the sky as one on it */
    double horizontal;           /* lx on the open horizontal plane from a zenith of 1 cd/m2 */
    float a, b, c, d, e, offset; /* offset: 1 - c exp(d pi / 2) */
    float sun_x, sun_y, per_zenith, ground;
    uint64_t hash; /* of what it was made from; never 0 */
};

/* type: 1..LUM_CIE_SKY_TYPES; ground_albedo: 0..1. */
struct lum_cie_sky lum_cie_sky_make(int type, double sun_elevation_rad, double ground_albedo);

/* From a unit direction; 0 or more, finite. */
float lum_cie_sky_luminance(const struct lum_cie_sky *sky, struct lum_vec3 d);

#endif
