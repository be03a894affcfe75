#include "core/light/cie_sky.h"

#include <math.h>

#include "core/base/base.h"

/* CIE S 011, table 1. */
static const float gradation[6][2] = {{4.0f, -0.70f},  {1.1f, -0.80f},  {0.0f, -1.00f},
                                      {-1.0f, -0.55f}, {-1.0f, -0.32f}, {-1.0f, -0.15f}};
static const float indicatrix[6][3] = {{0.0f, -1.0f, 0.00f},  {2.0f, -1.5f, 0.15f},  {5.0f, -2.5f, 0.30f},
                                       {10.0f, -3.0f, 0.45f}, {16.0f, -3.0f, 0.30f}, {24.0f, -2.8f, 0.15f}};
static const struct {
    uint8_t gradation, indicatrix;
} parts[15] = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {2, 0}, {2, 1}, {2, 2}, {2, 3},
               {3, 1}, {3, 2}, {3, 3}, {4, 3}, {4, 4}, {5, 4}, {5, 5}};

#define TRADITIONAL 16 /* overcast sky: its number in the standard */

/* L over per_zenith; cos_z > 0. exp(b / cos_z) is 0 where cos_z is. */
static float relative(const struct lum_cie_sky *s, float cos_z, float cos_chi)
{
    if (s->type == TRADITIONAL)
        return 1.0f + 2.0f * cos_z;
    float cos_near = lum_clamp(cos_chi, -1.0f, 1.0f), chi = acosf(cos_near);
    float phi = 1.0f + s->a * expf(s->b / cos_z);
    return phi * (s->offset + s->c * expf(s->d * chi) + s->e * cos_near * cos_near);
}

float lum_cie_sky_luminance(const struct lum_cie_sky *s, struct lum_vec3 d)
{
    if (!(d.y > 0.0f))
        return s->ground;
    return lum_max(s->per_zenith * relative(s, d.y, d.x * s->sun_x + d.y * s->sun_y), 0.0f);
}

/* Gauss-Legendre with three points, over [0, 1]. */
static const double node[3] = {0.1127016653792583, 0.5, 0.8872983346207417};
static const double weight[3] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};

/* Integral of L cos Z over azimuths at this height. */
static double ring(const struct lum_cie_sky *s, double cos_z)
{
    enum { PANELS = 16 }; /* 48 azimuths over half a turn: more for the sharpest glow around a sun, fewer for time */
    double sum = 0.0, sin_z = sqrt(fmax(0.0, 1.0 - cos_z * cos_z));
    for (int k = 0; k < PANELS; k++)
        for (int i = 0; i < 3; i++) {
            double part = (k + node[i]) / PANELS, phi = LUM_PI_D * part * part; /* denser at the sun */
            struct lum_vec3 d = lum_v3((float)(sin_z * cos(phi)), (float)cos_z, 0.0f);
            sum += weight[i] / PANELS * 2.0 * part * (double)lum_cie_sky_luminance(s, d);
        }
    return 2.0 * LUM_PI_D * cos_z * sum;
}

/* The panels end at the sun's height, where the luminance has a cusp, and are denser there: with the sun in the zenith
 * it goes by the root of 1 - cos Z. */
static double horizontal(const struct lum_cie_sky *s)
{
    enum { PANELS = 12 }; /* on each side of the sun: 72 heights in all */
    double cut = sin(s->sun_elevation_rad), sum = 0.0;
    for (int side = 0; side < 2; side++) {
        double width = side ? 1.0 - cut : cut;
        for (int k = 0; k < PANELS; k++)
            for (int i = 0; i < 3; i++) {
                double part = (k + node[i]) / PANELS, far = width * part * part;
                sum += weight[i] / PANELS * 2.0 * width * part * ring(s, side ? cut + far : cut - far);
            }
    }
    return sum;
}

/* FNV-1a over the bits of the numbers. */
static uint64_t hash_of(int type, double elevation, double albedo)
{
    const union {
        double number[3];
        uint8_t byte[3 * sizeof(double)];
    } bits = {.number = {type, elevation, albedo}};
    uint64_t h = UINT64_C(14695981039346656037);
    for (size_t i = 0; i < sizeof bits.byte; i++)
        h = (h ^ bits.byte[i]) * UINT64_C(1099511628211);
    return h ? h : 1;
}

struct lum_cie_sky lum_cie_sky_make(int type, double sun_elevation_rad, double ground_albedo)
{
    double elevation = fmin(fmax(sun_elevation_rad, 0.0), 0.5 * LUM_PI_D);
    struct lum_cie_sky s = {.type = type, .sun_elevation_rad = elevation, .per_zenith = 1.0f / 3.0f};
    s.sun_x = (float)cos(elevation);
    s.sun_y = (float)sin(elevation);
    if (type != TRADITIONAL) {
        const float *g = gradation[parts[type - 1].gradation], *f = indicatrix[parts[type - 1].indicatrix];
        s.a = g[0], s.b = g[1], s.c = f[0], s.d = f[1], s.e = f[2];
        s.offset = 1.0f - s.c * expf(s.d * 0.5f * LUM_PI);
        s.per_zenith = 1.0f / relative(&s, 1.0f, s.sun_y);
    }
    s.horizontal = horizontal(&s);
    s.ground = (float)(ground_albedo * s.horizontal / LUM_PI_D);
    s.hash = hash_of(type, elevation, ground_albedo);
    return s;
}
