/* A floor under panes, lamps of every kind above them, and what these leave of their light. */
#ifndef LUM_TESTS_NUMERIC_PANES_H
#define LUM_TESTS_NUMERIC_PANES_H

#include <math.h>

#include "core/pass/pass.h"
#include "tests/support/rig.h"

enum { SIDE = 16, SPP = 64 };

/* ---- what is right ---- */

static inline double fresnel(double cosine, double n)
{
    double t = sqrt(1.0 - (1.0 - cosine * cosine) / (n * n));
    double s = (cosine - n * t) / (cosine + n * t), p = (n * cosine - t) / (n * cosine + t);
    return 0.5 * (s * s + p * p);
}

/* Of light that crosses glass which leaves `tint` of it each time, summed over all reflections between the faces. */
static inline double left_by_pane(double cosine, double n, double tint)
{
    double r = fresnel(cosine, n);
    return (1.0 - r) * (1.0 - r) * tint / (1.0 - r * r * tint * tint);
}

/* The same of an even sky on a floor, through panes that lie flat: weighted by cos over the hemisphere. */
static inline double left_of_sky(uint32_t n_panes, double ior, double tint)
{
    const int n = 2000;
    double sum = 0.0;
    for (int i = 0; i < n; i++) /* u = sin^2 of the angle to the normal is even */
        sum += pow(left_by_pane(sqrt(1.0 - (i + 0.5) / n), ior, tint), (double)n_panes) / n;
    return sum;
}

/* ---- a floor under panes ---- */

enum lamp { SUN, SKY, POINT, SPOT, DISC, QUAD, SPHERE, MESH, N_LAMPS };
static const char *const lamp_names[] = {"sun", "sky", "point", "spot", "disc", "quad", "sphere", "mesh"};
static const char *const methods[] = {"path", "live", "whitted", "igi", "ais", "ais-max", "irrcache", "ic", "tic"};

#define HIGH 2.0 /* where the lamp hangs, in metres; panes are at half of it */

static inline struct lum_material_desc glass(double ior, double tint_r, double tint_g, double tint_b)
{
    struct lum_material_desc m = lum_material_default();
    m.base_color = lum_rgb((float)tint_r, (float)tint_g, (float)tint_b);
    m.transmission = 1.0f;
    m.thin = true;
    m.ior = (float)ior;
    m.roughness = 0.0f;
    return m;
}

static inline void put_mesh_lamp(struct rig *r, double x, double cd_m2)
{
    struct lum_material_desc m = rig_diffuse(0.0f);
    const double p[] = {x - .02, HIGH, -.02, x + .02, HIGH, -.02, x + .02, HIGH, .02, x - .02, HIGH, .02};
    const uint32_t i[] = {0, 1, 2, 0, 2, 3};
    m.emission = lum_grey(1.0f);
    m.emission_cd_m2 = cd_m2;
    rig_material(r, "glow", &m);
    rig_mesh(r, "lamp", p, 4, i, 2);
    rig_object(r, "lamp", "lamp", "glow", rig_v(0, 0, 0));
}

/* times: of its usual light. x: how far from above the origin. */
static inline void put_lamp(struct rig *r, enum lamp kind, double x, double times)
{
    static const struct lum_light_kind_row *const kinds[N_LAMPS] = {
        &lum_light_kind_directional, &lum_light_kind_environment, &lum_light_kind_point,  &lum_light_kind_spot,
        &lum_light_kind_disc,        &lum_light_kind_quad,        &lum_light_kind_sphere, &lum_light_kind_quad};
    struct lum_light_desc l = {.kind = kinds[kind],
                               .position = rig_v(x, HIGH, 0),
                               .direction = rig_v(-x, -HIGH, 0),
                               .u = rig_v(0.04, 0, 0),
                               .v = rig_v(0, 0, 0.04),
                               .radius_m = 0.02,
                               .inner_cone_rad = 0.5,
                               .outer_cone_rad = 0.6,
                               .color = lum_grey(1),
                               .intensity = 1000.0 * times,
                               .on = true,
                               .camera_visible = true};
    if (kind == MESH)
        put_mesh_lamp(r, x, 1000.0 * times);
    else
        rig_light(r, "lamp", &l);
}

/* Each pane of its own mesh, or all of one. */
static inline void put_panes(struct rig *r, uint32_t n, const struct lum_material_desc *m)
{
    rig_material(r, "glass", m);
    for (uint32_t i = 0; i < n; i++) {
        char id[] = "pane0";
        id[4] = (char)('0' + i);
        rig_object(r, id, "pane", "glass", rig_v(0, 0.5 * HIGH + 0.05 * i, 0));
    }
}

/* The camera looks at a hand's breadth of the floor, from below the panes. Reflections are left out: between panes, and
 * between them and the floor, light is sent back that no closed form here knows. (Hemisphere records and VPLs do not
 * leave them out: under panes that reflect, so is indirect light.) */
static inline void begin(struct rig *r)
{
    rig_begin(r, 1);
    r->settings.w = r->settings.h = SIDE;
    r->settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_REFLECTION);
    r->settings.antialias = false;
    rig_square(r, "floor", 0.5);
    rig_square(r, "pane", 60.0);
    rig_diffuse_object(r, "floor", "matte", 0.5f, rig_v(0, 0, 0));
    rig_camera(r, rig_v(0, 0.6, 0.6), rig_v(0, 0, 0), 5);
}

static inline void use(struct rig *r, const char *method)
{
    r->settings.method = lum_method_find(method);
    assert_non_null(r->settings.method);
}

/* Mean of the picture, over n_seeds. */
static inline struct lum_rgb render(struct rig *r, const char *method, uint32_t n_seeds)
{
    struct lum_rgb sum = lum_grey(0.0f);
    use(r, method);
    for (r->settings.seed = 0; r->settings.seed < n_seeds; r->settings.seed++) {
        rig_fresh_view(r);
        for (int i = 0; i < (r->settings.method->progressive ? SPP : 1); i++)
            rig_pass(r);
        sum = lum_rgb_mad(sum, rig_mean(r), 1.0f / (float)n_seeds);
    }
    return sum;
}

static inline bool is_near(double value, double expected, double relative)
{
    return fabs(value - expected) <= relative * expected;
}

#endif
