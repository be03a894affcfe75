/* Unshadowed irradiance of lights with a shape, against plain integration over the emitter. */
#include "core/light/irradiance.h"

#include <math.h>

#include "tests/support/rig.h"

struct spot {
    struct lum_vec3 p, n;
};

static struct lum_vec3 unit(float x, float y, float z)
{
    return lum_normalize(lum_v3(x, y, z));
}

static struct lum_vec3d wide(struct lum_vec3 a)
{
    return (struct lum_vec3d){(double)a.x, (double)a.y, (double)a.z};
}

static double dot(struct lum_vec3d a, struct lum_vec3d b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

/* cos cos' / r^2 at point x of an emitter with normal nl; 0 below either horizon. */
static double kernel(const struct spot *s, struct lum_vec3d x, struct lum_vec3d nl)
{
    struct lum_vec3d p = wide(s->p), d = {x.x - p.x, x.y - p.y, x.z - p.z};
    double r2 = dot(d, d), here = dot(d, wide(s->n)), there = -dot(d, nl);
    return here > 0.0 && there > 0.0 ? here * there / (r2 * r2) : 0.0;
}

/* Midpoint rule over N x N cells: the error of a smooth integrand falls with N^-2, that of the kink at the horizon too,
 * since the integrand is 0 there. */
#define N 1000

static double integrate_quad(const struct lum_light *l, const struct spot *s)
{
    struct lum_vec3d c = wide(l->p), u = wide(l->u), v = wide(l->v), nl = wide(l->n);
    double sum = 0.0;
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            double a = (2.0 * i + 1.0) / N - 1.0, b = (2.0 * j + 1.0) / N - 1.0;
            struct lum_vec3d x = {c.x + a * u.x + b * v.x, c.y + a * u.y + b * v.y, c.z + a * u.z + b * v.z};
            sum += kernel(s, x, nl);
        }
    return sum * (double)l->area / ((double)N * N);
}

/* Over rings of equal width; a sphere is integrated over its whole surface by height. */
static double integrate_round(const struct lum_light *l, const struct spot *s)
{
    struct lum_frame f = lum_frame_from_normal(l->n);
    struct lum_vec3d c = wide(l->p), t = wide(f.t), b = wide(f.b), nl = wide(l->n);
    double sum = 0.0, radius = (double)l->radius;
    bool sphere = l->kind == &lum_emitter_sphere;
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            double h = (j + 0.5) / N, phi = 2.0 * LUM_PI_D * (i + 0.5) / N;
            double z = sphere ? 2.0 * h - 1.0 : 0.0, r = sphere ? sqrt(1.0 - z * z) : h;
            double x = radius * r * cos(phi), y = radius * r * sin(phi);
            struct lum_vec3d e = {x * t.x + y * b.x, x * t.y + y * b.y, x * t.z + y * b.z};
            struct lum_vec3d at = {c.x + e.x + radius * z * nl.x, c.y + e.y + radius * z * nl.y,
                                   c.z + e.z + radius * z * nl.z};
            struct lum_vec3d out = {(at.x - c.x) / radius, (at.y - c.y) / radius, (at.z - c.z) / radius};
            sum += kernel(s, at, sphere ? out : nl) * (sphere ? 2.0 : 2.0 * h);
        }
    double area = sphere ? 2.0 * LUM_PI_D * radius * radius : LUM_PI_D * radius * radius;
    return sum * area / ((double)N * N);
}

static struct lum_light lamp(const struct lum_emitter_row *kind)
{
    struct lum_light l = {.kind = kind, .p = {0.2f, 1.0f, -0.1f}, .n = {0.0f, -1.0f, 0.0f}, .radius = 0.4f};
    l.u = lum_v3(0.5f, 0.0f, 0.0f);
    l.v = lum_v3(0.0f, 0.0f, 0.3f);
    l.area = 4.0f * 0.5f * 0.3f;
    return l;
}

static const struct spot spots[] = {
    {{0.1f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
    {{2.0f, 0.0f, 1.0f}, {0.0f, 1.0f, 0.0f}},
    {{0.2f, 0.9f, -0.1f}, {0.0f, 1.0f, 0.0f}}, /* next to it */
    {{1.5f, 0.2f, 0.3f}, {-1.0f, 0.0f, 0.0f}}, /* the light crosses no horizon, and shines along */
    {{0.3f, 0.1f, 0.2f}, {1.0f, 0.0f, 0.0f}},  /* it crosses the horizon */
    {{0.3f, 0.1f, 0.2f}, {-0.6f, 0.0f, 0.8f}},
    {{0.2f, 0.2f, -0.1f}, {0.0f, 0.0f, 1.0f}},
    {{0.2f, 0.2f, -0.1f}, {0.0f, -0.28f, 0.96f}},
    {{573.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}}, /* 89.9 degrees off the normal */
    {{0.0f, 0.0f, 0.0f}, {0.0f, -1.0f, 0.0f}},  /* turned away: nothing */
    {{3.0f, 1.5f, 0.0f}, {-1.0f, 0.0f, 0.0f}},  /* behind quad and disc: nothing */
};

static void closed_forms_are_the_integrals(void **state)
{
    (void)state;
    const struct lum_emitter_row *const kinds[] = {&lum_emitter_quad, &lum_emitter_disc, &lum_emitter_sphere};
    for (size_t k = 0; k < LUM_ARRAY_LEN(kinds); k++)
        for (size_t i = 0; i < LUM_ARRAY_LEN(spots); i++) {
            struct lum_light l = lamp(kinds[k]);
            struct spot s = {spots[i].p, lum_normalize(spots[i].n)};
            struct lum_irradiance got;
            lum_light_irradiance(&l, 1, &s.p, &s.n, &got);
            double want = l.kind == &lum_emitter_quad ? integrate_quad(&l, &s) : integrate_round(&l, &s);
            /* Smooth: N^-2, a hundredfold where the light is near. The sphere's integrand goes with the root of the
             * height at its poles: N^-1.5, a tenfold. */
            double tolerance = 3e-4 * want + 1e-9;
            if (!(fabs((double)got.cosine_integral - want) <= tolerance))
                fail_msg("kind %d, spot %zu: %.9g, integral %.9g", k, i, (double)got.cosine_integral, want);
            assert_true(got.mean_cos >= 0.0f && got.mean_cos <= 1.0f);
            assert_true((got.mean_cos > 0.0f) == (want > 0.0));
        }
}

/* A wall and floors of light, and lights so small that they are points. */
static void closed_forms_at_their_limits(void **state)
{
    (void)state;
    struct lum_irradiance got;
    struct lum_light l = lamp(&lum_emitter_disc);
    const float h = 0.6f;
    struct lum_vec3 up = {0.0f, 1.0f, 0.0f}, wall = {1.0f, 0.0f, 0.0f}, below = {l.p.x, l.p.y - h, l.p.z};
    lum_light_irradiance(&l, 1, &below, &up, &got); /* on the axis: pi R^2 / (R^2 + h^2) */
    double r = (double)l.radius, want = LUM_PI_D * r * r / (r * r + (double)h * (double)h);
    assert_true(fabs((double)got.cosine_integral - want) < 1e-6);

    l = lamp(&lum_emitter_quad);
    l.u.x = l.v.z = 1e4f; /* almost the whole sky: what is missing is below pi h^2 / 1e8 */
    l.area = 4e8f;
    lum_light_irradiance(&l, 1, &below, &up, &got);
    assert_true(fabs((double)got.cosine_integral - LUM_PI_D) < 1e-6);
    lum_light_irradiance(&l, 1, &below, &wall, &got);                       /* half the sky of a wall */
    assert_true(fabs((double)got.cosine_integral - 0.5 * LUM_PI_D) < 1e-3); /* that ends at 1e4: 1e-4 of it */

    const struct lum_emitter_row *const kinds[] = {&lum_emitter_quad, &lum_emitter_disc, &lum_emitter_sphere};
    for (size_t k = 0; k < LUM_ARRAY_LEN(kinds); k++)
        for (float size = 1.0f; size > 1e-12f; size *= 0.25f) { /* E / area tends to cos cos' / r^2, without a jump */
            l = lamp(kinds[k]);
            l.u = lum_v3_mul(l.u, size);
            l.v = lum_v3_mul(l.v, size);
            l.radius *= size;
            l.area *= size * size;
            struct spot s = {{1.0f, 0.0f, 0.5f}, unit(0.1f, 1.0f, 0.2f)};
            double area =
                kinds[k] == &lum_emitter_quad ? (double)l.area : LUM_PI_D * (double)l.radius * (double)l.radius;
            struct lum_vec3d d = {(double)(l.p.x - s.p.x), (double)(l.p.y - s.p.y), (double)(l.p.z - s.p.z)};
            double r2 = dot(d, d), facing = kinds[k] == &lum_emitter_sphere ? 1.0 : d.y / sqrt(r2);
            double point = dot(d, wide(s.n)) / sqrt(r2) * facing * area / r2;
            lum_light_irradiance(&l, 1, &s.p, &s.n, &got);
            /* relative difference of the order of (size / distance)^2 */
            double off = fabs((double)got.cosine_integral / point - 1.0);
            if (!(off < 0.3 * (double)(size * size) + 2e-6))
                fail_msg("kind %d, size %g: off by %g", k, (double)size, off);
        }
}

/* In the plane of the light, on it, in its middle, inside: finite, and 0 where it does not shine. */
static void closed_forms_in_odd_places(void **state)
{
    (void)state;
    const struct lum_emitter_row *const kinds[] = {&lum_emitter_quad, &lum_emitter_disc, &lum_emitter_sphere};
    const struct lum_vec3 places[] = {{0.2f, 1.0f, -0.1f}, {3.0f, 1.0f, 0.0f}, {0.7f, 1.0f, 0.2f},
                                      {0.6f, 1.0f, -0.1f}, {0.2f, 1.0f, 0.2f}, {0.2f, 1.4f, -0.1f}};
    const struct lum_vec3 normals[] = {{0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {0, 0, -1}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(kinds); k++)
        for (size_t i = 0; i < LUM_ARRAY_LEN(places); i++)
            for (size_t j = 0; j < LUM_ARRAY_LEN(normals); j++) {
                struct lum_light l = lamp(kinds[k]);
                struct lum_irradiance got;
                lum_light_irradiance(&l, 1, &places[i], &normals[j], &got);
                assert_true(got.cosine_integral >= 0.0f && got.cosine_integral <= LUM_PI);
                if (kinds[k] != &lum_emitter_sphere)
                    assert_true(got.cosine_integral == 0.0f);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_forms_are_the_integrals),
        cmocka_unit_test(closed_forms_at_their_limits),
        cmocka_unit_test(closed_forms_in_odd_places),
    };
    return cmocka_run_group_tests_name("light_irradiance", tests, NULL, NULL);
}
