/* Fog for tests, and the closed form of what a lamp scatters in it. Header only. */
#ifndef LUM_TESTS_NUMERIC_FOG_H
#define LUM_TESTS_NUMERIC_FOG_H

#include "tests/support/rig.h"

#define PI 3.14159265358979323846

static inline struct lum_medium_desc fog_everywhere(float sigma_s, float sigma_a, float g)
{
    return (struct lum_medium_desc){
        .sigma_s = lum_grey(sigma_s), .sigma_a = lum_grey(sigma_a), .g = g, .everywhere = true};
}

static inline struct lum_medium_desc fog_box(float sigma_s, float sigma_a, struct lum_vec3d lo, struct lum_vec3d hi)
{
    return (struct lum_medium_desc){.sigma_s = lum_grey(sigma_s), .sigma_a = lum_grey(sigma_a), .lo = lo, .hi = hi};
}

static inline void put_fog(struct rig *r, const char *id, const struct lum_medium_desc *m)
{
    RIG_OK(lum_scene_put_medium(r->scene, id, m, &err));
}

/* Sun et al. 2005, for intensity 1 and isotropic scattering: from a light at distance d_light, at angle gamma from a
 * ray of length d, in a medium that only scatters. F by Simpson's rule: its integrand is smooth, also at pi / 2. */
static inline double sun_f(double u, double v)
{
    const int n = 20000;
    double sum = 0.0;
    for (int i = 0; i <= n; i++)
        sum += (i == 0 || i == n ? 1.0 : i % 2 ? 4.0 : 2.0) * exp(-u * tan(v * i / n));
    return sum * v / (3.0 * n);
}

static inline double sun_airlight(double b, double d_light, double gamma, double d)
{
    double a1 = b * d_light * sin(gamma), a0 = b * exp(-b * d_light * cos(gamma)) / (2 * PI * d_light * sin(gamma));
    double v = PI / 4 + 0.5 * atan((d - d_light * cos(gamma)) / (d_light * sin(gamma)));
    return a0 * (sun_f(a1, v) - sun_f(a1, gamma / 2));
}

static inline void check_near(const char *what, double got, double want, double tolerance)
{
    if (!(fabs(got - want) <= tolerance * fabs(want)))
        fail_msg("%s: %.9g, closed form %.9g, tolerance %g", what, got, want, tolerance);
}

#endif
