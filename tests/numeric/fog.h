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

/* What closed forms of single scattering tell of: without the effect `scattering`. */
static inline void fog_scatters_once(struct rig *r)
{
    r->settings.effects_off |= LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING);
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

/* One pixel: a bulb of 1000 cd at distance d_light and angle gamma from its ray, which a black wall at distance d ends,
 * in fog that only scatters. sun_airlight has the closed form. */
static inline void fog_with_bulb(struct rig *r, float b, double d_light, double gamma, double d)
{
    rig_box(r, "wall", 8, 8, 0.5);
    rig_diffuse_object(r, "wall", "black", 0.0f, rig_v(0, 0, -d - 0.5));
    struct lum_medium_desc fog = fog_everywhere(b, 0, 0);
    struct lum_light_desc bulb = rig_point(rig_v(d_light * sin(gamma), 0, -d_light * cos(gamma)), 1000);
    put_fog(r, "fog", &fog);
    rig_light(r, "bulb", &bulb);
    rig_commit(r);
    rig_camera(r, rig_v(0, 0, 0), rig_v(0, 0, -1), 1);
    r->settings.w = r->settings.h = 1;
}

/* Eye, mirror, wall, and a bulb of 1000 cd: the fog of both segments is seen, the second one through the first. Returns
 * the closed form, of a black wall. */
static inline double fog_with_mirror(struct rig *r, double b, float albedo)
{
    const double light = sqrt(10.0);
    struct lum_material_desc wall = rig_diffuse(albedo), mirror = lum_material_default();
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    rig_material(r, "wall", &wall);
    rig_material(r, "mirror", &mirror);
    rig_box(r, "slab", 8, 8, 0.5);
    rig_object(r, "wall", "slab", "wall", rig_v(0, 0, 10.5));
    rig_object(r, "mirror", "slab", "mirror", rig_v(0, 0, -2.5));
    struct lum_medium_desc fog = fog_everywhere((float)b, 0, 0);
    struct lum_light_desc bulb = rig_point(rig_v(1, 0, 3), 1000);
    put_fog(r, "fog", &fog);
    rig_light(r, "bulb", &bulb);
    rig_commit(r);
    rig_camera(r, rig_v(0, 0, 0), rig_v(0, 0, -1), 1);
    double first = sun_airlight(b, light, acos(-3 / light), 2);
    double second = sun_airlight(b, sqrt(26.0), acos(5 / sqrt(26.0)), 12);
    return 1000 * (first + exp(-2 * b) * second);
}

static inline void check_near(const char *what, double got, double want, double tolerance)
{
    if (!(fabs(got - want) <= tolerance * fabs(want)))
        fail_msg("%s: %.9g, closed form %.9g, tolerance %g", what, got, want, tolerance);
}

#endif
