/* Samples of lights follow their densities, and shine as their points do. */
#include <math.h>

#include "core/light/sample.h"
#include "core/math/sampler.h"
#include "tests/numeric/stats.h"
#include "tests/support/lights.h"

enum { SIDE = 16, SAMPLES = 100000 };

/* Where on the light samples fall, in cells of a parametrisation of its surface, against the integral of the pdf
 * over them. On the light there are no silhouettes: the integrand is smooth. */
struct patch {
    struct lum_vec3 x, n;
    double area; /* of the cell around x */
};

static struct patch quad_patch(const struct lum_light *l, double a, double b, double cells)
{
    struct lum_vec3 x = lum_v3_mad(lum_v3_mad(l->p, l->u, (float)(2.0 * a - 1.0)), l->v, (float)(2.0 * b - 1.0));
    return (struct patch){x, l->n, (double)l->area / cells};
}

/* a: squared relative radius, b: angle. */
static struct patch disc_patch(const struct lum_light *l, double a, double b, double cells)
{
    struct lum_frame f = lum_frame_from_normal(l->n);
    struct lum_vec3 d = direction(0.0, 2.0 * LUM_PI_D * b);
    float r = l->radius * (float)sqrt(a);
    return (struct patch){lum_v3_mad(lum_v3_mad(l->p, f.t, r * d.x), f.b, r * d.y), l->n, (double)l->area / cells};
}

static double wrap01(double x)
{
    return x - floor(x);
}

typedef bool sample_fn(const struct lum_snapshot *, uint32_t, struct lum_vec3, struct lum_vec2,
                       struct lum_light_sample *);
typedef float pdf_fn(const struct lum_snapshot *, uint32_t, struct lum_vec3, struct lum_vec3, struct lum_vec3,
                     struct lum_vec3);

static void follow(sample_fn *sample, pdf_fn *pdf_of)
{
    struct lum_light lights[] = {
        quad(lum_v3(0, 0, 2), lum_v3(0, 1, 0), lum_v3(0.5f, 0, 0)),    /* solid angle */
        quad(lum_v3(0, 0, 2), lum_v3(0.3f, 1, 0), lum_v3(0.5f, 0, 0)), /* a parallelogram: area */
        disc(lum_v3(0, 0, 2), lum_v3(0, 0, -1), 1.0f),
    };
    static const struct lum_vec3 points[] = {{0, 0, 0}, {2, 1, 0}, {0.4f, 0, 1.7f}, {5, 0, 1.5f}, {20, 20, 0}};
    struct rng r = {1};
    for (size_t k = 0; k < LUM_ARRAY_LEN(lights); k++)
        for (size_t c = 0; c < LUM_ARRAY_LEN(points); c++) {
            const struct lum_light *l = &lights[k];
            struct lum_snapshot s = snapshot_of(l);
            static struct chi2_cell cell[SIDE * SIDE];
            double total = 0.0;
            if (lum_dot(l->n, lum_v3_sub(points[c], l->p)) <= 0.0f)
                fail_msg("point %zu does not see light %zu", c, k);
            for (int i = 0; i < SIDE * SIDE; i++) {
                double sum = 0.0;
                enum { sub = 16 };
                for (int j = 0; j < sub * sub; j++) {
                    double a = (i / SIDE + (j / sub + 0.5) / sub) / SIDE, b = (i % SIDE + (j % sub + 0.5) / sub) / SIDE;
                    double cells = (double)SIDE * SIDE * sub * sub;
                    struct patch at =
                        l->kind == &lum_emitter_quad ? quad_patch(l, a, b, cells) : disc_patch(l, a, b, cells);
                    struct lum_vec3 d = lum_v3_sub(at.x, points[c]), wi = lum_normalize(d);
                    double pdf = (double)pdf_of(&s, 0, points[c], wi, at.x, at.n);
                    sum += pdf * (double)(-lum_dot(wi, at.n) / lum_dot(d, d)) * at.area;
                }
                cell[i] = (struct chi2_cell){sum * SAMPLES, 0.0};
                total += sum;
            }
            if (fabs(total - 1.0) > 2e-3) /* midpoint rule on 256 x 256 cells, 1 / r^2 over a distance of 0.3 */
                fail_msg("light %zu point %zu: pdf integrates to %g", k, c, total);
            for (int i = 0; i < SAMPLES; i++) {
                struct lum_light_sample ls;
                struct lum_vec2 u = {(float)(rng_u64(&r) >> 40) * 0x1p-24f, (float)(rng_u64(&r) >> 40) * 0x1p-24f};
                assert_true(sample(&s, 0, points[c], u, &ls));
                struct lum_vec3 x = lum_v3_mad(points[c], ls.wi, ls.distance), d = lum_v3_sub(x, l->p);
                float pdf = pdf_of(&s, 0, points[c], ls.wi, x, l->n);
                assert_true(fabsf(pdf - ls.pdf_sa) <
                            1e-3f * pdf); /* x is rounded: 2^-22 of a distance, over its cosine */
                double a, b;
                if (l->kind == &lum_emitter_quad) { /* coordinates of d in the basis u, v */
                    double uu = (double)lum_dot(l->u, l->u), uv = (double)lum_dot(l->u, l->v),
                           vv = (double)lum_dot(l->v, l->v);
                    double du = (double)lum_dot(d, l->u), dv = (double)lum_dot(d, l->v), det = uu * vv - uv * uv;
                    a = 0.5 + 0.5 * (du * vv - dv * uv) / det, b = 0.5 + 0.5 * (dv * uu - du * uv) / det;
                } else {
                    struct lum_frame f = lum_frame_from_normal(l->n);
                    double x1 = (double)lum_dot(d, f.t), y1 = (double)lum_dot(d, f.b);
                    a = (x1 * x1 + y1 * y1) / (double)(l->radius * l->radius);
                    b = wrap01(atan2(y1, x1) / (2.0 * LUM_PI_D));
                }
                int ia = (int)fmin(fmax(a, 0.0) * SIDE, SIDE - 1), ib = (int)fmin(fmax(b, 0.0) * SIDE, SIDE - 1);
                cell[ia * SIDE + ib].observed += 1.0;
            }
            double p = chi2_p_value(cell, SIDE * SIDE);
            if (p < sidak(0.01, 30))
                fail_msg("light %zu point %zu: p = %g", k, c, p);
        }
}

static void area_lights_follow_their_pdf(void **state)
{
    (void)state;
    follow(lum_light_sample_at, lum_light_pdf);
    follow(lum_light_sample_plainly, lum_light_plain_pdf);
}

static void sphere_fills_its_cone_evenly(void **state)
{
    (void)state;
    static const double distances[] = {1.0001, 1.5, 10.0, 1000.0};
    struct rng r = {2};
    for (size_t c = 0; c < LUM_ARRAY_LEN(distances); c++) {
        struct lum_light l = sphere(lum_v3(0, 0, (float)distances[c]), 1.0f);
        struct lum_snapshot s = snapshot_of(&l);
        double sin2 = pow((double)l.radius / (double)l.p.z, 2.0), omc = sin2 / (1.0 + sqrt(1.0 - sin2));
        static struct chi2_cell cell[SIDE * SIDE];
        for (int i = 0; i < SIDE * SIDE; i++)
            cell[i] = (struct chi2_cell){(double)SAMPLES / (SIDE * SIDE), 0.0};
        for (int i = 0; i < SAMPLES; i++) {
            struct lum_light_sample ls;
            struct lum_vec2 u = {(float)rng_unit(&r), (float)rng_unit(&r)};
            struct lum_vec3 o = {0, 0, 0};
            assert_true(lum_light_sample_at(&s, 0, o, u, &ls));
            double s2 = (double)ls.wi.x * (double)ls.wi.x + (double)ls.wi.y * (double)ls.wi.y;
            double one_minus_cos = ls.wi.z > 0.0f ? s2 / (1.0 + sqrt(1.0 - s2)) : 1.0 - (double)ls.wi.z;
            int ia = (int)fmin(one_minus_cos / omc * SIDE, SIDE - 1);
            int ib = (int)fmin(wrap01(atan2((double)ls.wi.y, (double)ls.wi.x) / (2.0 * LUM_PI_D)) * SIDE, SIDE - 1);
            cell[ia * SIDE + ib].observed += 1.0;
            assert_true(fabs((double)ls.pdf_sa * 2.0 * LUM_PI_D * omc - 1.0) < 1e-4);
            struct lum_vec3 x = lum_v3_mul(ls.wi, ls.distance), n = lum_v3_sub(x, l.p);
            /* on the surface: at the rim the distance is a root of what cancels to 2^-23 of its square */
            assert_true(fabs((double)lum_length(n) - 1.0) < 1e-3 * (distances[c] > 100.0 ? 100.0 : 1.0));
            assert_true(lum_light_pdf(&s, 0, o, ls.wi, x, lum_normalize(n)) == ls.pdf_sa);
        }
        double p = chi2_p_value(cell, SIDE * SIDE);
        if (p < sidak(0.01, 4))
            fail_msg("distance %g: p = %g", distances[c], p);
    }
}

static void mesh_is_sampled_evenly_over_area(void **state)
{
    (void)state;
    struct mesh_light m;
    mesh_light_init(&m);
    enum { cells = 16 }; /* per triangle: 4 x 4 in (sum of weights)^2 and their ratio, which is even */
    struct chi2_cell cell[2 * cells];
    for (int t = 0; t < 2; t++)
        for (int i = 0; i < cells; i++)
            cell[t * cells + i] = (struct chi2_cell){
                0.5 * (double)lum_length(mesh_normal(&m, t ? 2 : 0)) / (double)m.light.area / cells * SAMPLES, 0.0};
    struct rng r = {3};
    struct lum_vec3 p = {1.0f, 0.5f, 0.0f};
    for (int i = 0; i < SAMPLES; i++) {
        struct lum_light_sample ls;
        struct lum_vec2 u = {(float)(rng_u64(&r) >> 40) * 0x1p-24f, (float)(rng_u64(&r) >> 40) * 0x1p-24f};
        assert_true(lum_light_sample_at(&m.snapshot, 0, p, u, &ls));
        struct lum_vec3 x = lum_v3_mad(p, ls.wi, ls.distance);
        int found = -1;
        double w[2] = {0, 0};
        for (int t = 0; t < 3 && found < 0; t += 2) { /* barycentric coordinates, and off the plane by less than 1e-4 */
            struct lum_vec3 a = mesh_vertex(&m, (uint32_t)t, 0), n = mesh_normal(&m, (uint32_t)t), d = lum_v3_sub(x, a);
            struct lum_vec3 e1 = lum_v3_sub(mesh_vertex(&m, (uint32_t)t, 1), a);
            struct lum_vec3 e2 = lum_v3_sub(mesh_vertex(&m, (uint32_t)t, 2), a);
            w[0] = (double)(lum_dot(lum_cross(d, e2), n) / lum_dot(n, n));
            w[1] = (double)(lum_dot(lum_cross(e1, d), n) / lum_dot(n, n));
            bool inside = w[0] > -1e-4 && w[1] > -1e-4 && w[0] + w[1] < 1.0001;
            if (inside && fabsf(lum_dot(d, lum_normalize(n))) < 1e-4f)
                found = t / 2;
        }
        assert_true(found >= 0);
        float pdf = lum_light_pdf(&m.snapshot, 0, p, ls.wi, x, lum_normalize(mesh_normal(&m, found ? 2 : 0)));
        bool on_an_edge = fmin(fmin(w[0], w[1]), 1.0 - w[0] - w[1]) < 1e-3; /* may belong to the neighbour */
        assert_true(on_an_edge || fabsf(pdf - ls.pdf_sa) < 1e-3f * pdf);
        double sum = fmin(fmax(w[0] + w[1], 1e-9), 1.0);
        int ia = (int)fmin(sum * sum * 4, 3), ib = (int)fmin(fmax(w[1] / sum, 0.0) * 4, 3);
        cell[found * cells + ia * 4 + ib].observed += 1.0;
    }
    double p_value = chi2_p_value(cell, 2 * cells);
    if (p_value < 0.01)
        fail_msg("p = %g", p_value);
}

/* A sampled point of a textured emitter shines as its own texel. */
static void mesh_emission_is_textured(void **state)
{
    (void)state;
    static const float ramp[3 * 2] = {0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 1.0f};
    struct lum_image image = {.texel = LUM_TEXEL_RGB32F, .width = 2, .height = 1, .pixels = ramp};
    struct mesh_light m;
    mesh_light_init(&m);
    float uvs[10];
    for (int i = 0; i < 5; i++) { /* u from a quarter to three quarters, where the ramp is linear, over x from 0 to 2 */
        uvs[2 * i] = 0.25f + 0.25f * m.positions[3 * i];
        uvs[2 * i + 1] = 0.5f;
    }
    m.mesh.uvs = uvs;
    m.light.power = m.material.emission = lum_rgb(30.0f, 20.0f, 10.0f);
    m.material.emission_tex =
        (struct lum_texture){.image = &image, .m = {{1, 0, 0}, {0, 1, 0}}, .wrap_u = LUM_WRAP_CLAMP};
    struct rng r = {11};
    struct lum_vec3 p = {1.0f, 0.5f, 0.0f};
    for (int i = 0; i < 10000; i++) {
        struct lum_light_sample ls;
        struct lum_vec2 u = {(float)(rng_u64(&r) >> 40) * 0x1p-24f, (float)(rng_u64(&r) >> 40) * 0x1p-24f};
        assert_true(lum_light_sample_at(&m.snapshot, 0, p, u, &ls));
        float x = lum_v3_mad(p, ls.wi, ls.distance).x; /* scene: 2 x + 1 */
        struct lum_vec2 uv = {0.25f + 0.125f * (x - 1.0f), 0.5f};
        struct lum_rgb want = lum_material_emission(&m.material, m.light.power, uv, lum_grey(1.0f));
        assert_true(fabsf(ls.radiance.r - want.r) < 1e-3f && fabsf(ls.radiance.b - want.b) < 1e-3f);
    }
}

static void lights_are_picked_as_the_table_says(void **state)
{
    (void)state;
    static const uint32_t active[] = {4, 0, 2};
    static const float cdf[] = {0.125f, 0.5f, 1.0f}, pdf[] = {0.375f, 0, 0.5f, 0, 0.125f};
    struct lum_light_table t = {.active = active, .active_cdf = cdf, .pick_pdf = pdf, .n_active = 3};
    double count[5] = {0}, moment[5] = {0};
    enum { n = 1 << 16 };
    for (int i = 0; i < n; i++) {
        float u = (float)i / n, prob;
        uint32_t k = lum_lights_pick(&t, &u, &prob);
        assert_true(k < 5 && prob == pdf[k] && u >= 0.0f && u < 1.0f);
        count[k] += 1.0 / n;
        moment[k] += (double)u / n;
    }
    for (int k = 0; k < 5; k++) {
        assert_true(count[k] == (double)pdf[k]);
        assert_true(fabs(moment[k] - 0.5 * (double)pdf[k]) < 1e-4); /* u is fresh: even again */
    }
    float u = 0x1.fffffep-1f, prob;
    assert_int_equal(lum_lights_pick(&t, &u, &prob), 2);
    assert_true(u < 1.0f);
    t.n_active = 0;
    assert_int_equal(lum_lights_pick(&t, &u, &prob), LUM_NO_OBJECT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(area_lights_follow_their_pdf),        cmocka_unit_test(sphere_fills_its_cone_evenly),
        cmocka_unit_test(mesh_is_sampled_evenly_over_area),    cmocka_unit_test(mesh_emission_is_textured),
        cmocka_unit_test(lights_are_picked_as_the_table_says),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
