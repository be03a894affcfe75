/* GGX: normalisation, visible normals, and the albedo table against quadrature in double. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/base/base.h"
#include "core/material/ggx.h"
#include "core/math/sampler.h"
#include "tests/numeric/stats.h"

static struct lum_vec3 direction(double cos_theta, double phi)
{
    double s = sqrt(fmax(0.0, 1.0 - cos_theta * cos_theta));
    return lum_v3((float)(s * cos(phi)), (float)(s * sin(phi)), (float)cos_theta);
}

/* Integral over the hemisphere of D(h) cos(h) = 1. With t = tan^2(h) / alpha^2 = x / (1 - x) the integrand is smooth:
 * D cos dw = dx, so the midpoint rule sees only the float rounding of D. */
static void distribution_is_normalised(void **state)
{
    (void)state;
    static const float alphas[] = {LUM_ALPHA_MIN, 0.01f, 0.1f, 0.5f, 1.0f};
    enum { n = 2000 };
    for (size_t k = 0; k < LUM_ARRAY_LEN(alphas); k++) {
        double a2 = (double)alphas[k] * (double)alphas[k], sum = 0.0;
        for (int i = 0; i < n; i++) {
            double x = (i + 0.5) / n, tan2 = a2 * x / (1.0 - x), cos2 = 1.0 / (1.0 + tan2);
            double dx_dcos = 2.0 * a2 / (sqrt(cos2) * pow(a2 * cos2 + 1.0 - cos2, 2.0)) * cos2;
            sum += (double)lum_ggx_d(direction(sqrt(cos2), 0.0), alphas[k]) * sqrt(cos2) * 2.0 * LUM_PI_D / dx_dcos / n;
        }
        assert_true(fabs(sum - 1.0) < 1e-4);
    }
}

/* Distribution of sampled facets against G1(o) max(0, o.h) D(h) / o.z. Facets are binned in phi and
 * s = 1 - sqrt(1 - x) with x = tan^2 / (alpha^2 + tan^2), whose density under D is even; the root removes the
 * singularity that o.h / cos(h) has at x = 1. */
static void visible_normals_follow_their_density(void **state)
{
    (void)state;
    enum { rows = 16, columns = 32, sub = 24, n = 200000, tests = 5 * 6 };
    static const float alphas[] = {LUM_ALPHA_MIN, 0.03f, 0.2f, 0.6f, 1.0f};
    static const double cosines[] = {1.0, 0.9, 0.5, 0.1, 0.01, 1e-4};
    struct rng r = {7};
    for (size_t k = 0; k < LUM_ARRAY_LEN(alphas); k++)
        for (size_t c = 0; c < LUM_ARRAY_LEN(cosines); c++) {
            double alpha = (double)alphas[k], a2 = alpha * alpha;
            struct lum_vec3 o = direction(cosines[c], 0.7);
            static struct chi2_cell cell[rows * columns];
            double total = 0.0;
            for (int i = 0; i < rows * columns; i++) {
                double sum = 0.0;
                for (int s = 0; s < sub * sub; s++) {
                    double t = 1.0 - (i / columns + (s / sub + 0.5) / sub) / rows, x = 1.0 - t * t;
                    double phi = (i % columns + (s % sub + 0.5) / sub) / columns * 2.0 * LUM_PI_D;
                    double cos_h = 1.0 / sqrt(1.0 + a2 * x / (1.0 - x));
                    struct lum_vec3 h = direction(cos_h, phi);
                    /* D cos dw = dx dphi / 2 pi */
                    sum += 2.0 * t * fmax(0.0, (double)lum_dot(o, h)) / cos_h *
                           (double)lum_ggx_g1_over_cos(o.z, alphas[k]);
                }
                cell[i] = (struct chi2_cell){sum / (sub * sub * rows * columns) * n, 0.0};
                total += cell[i].expected;
            }
            if (fabs(total / n - 1.0) > 2e-3) /* the kink at o.h = 0 limits the midpoint rule */
                fail_msg("alpha %g, cos %g: density integrates to %g", alpha, cosines[c], total / n);
            for (int i = 0; i < n; i++) {
                struct lum_vec2 u = {(float)rng_unit(&r), (float)rng_unit(&r)};
                struct lum_vec3 h = lum_ggx_sample_visible(o, alphas[k], u);
                double tan2 = (double)(h.x * h.x + h.y * h.y) / fmax((double)(h.z * h.z), 1e-30);
                int row = (int)fmin((1.0 - sqrt(a2 / (a2 + tan2))) * rows, rows - 1);
                double phi = atan2((double)h.y, (double)h.x) / (2.0 * LUM_PI_D);
                int column = (int)fmin((phi < 0.0 ? phi + 1.0 : phi) * columns, columns - 1);
                cell[row * columns + column].observed += total / n;
            }
            double p = chi2_p_value(cell, rows * columns);
            if (p < sidak(0.01, tests))
                fail_msg("alpha %g, cos %g: p = %g", alpha, cosines[c], p);
        }
}

struct ab {
    double a, b;
};

/* Albedo with F = 1 and F = (1 - o.h)^5: mean of G2 / G1 over visible normals on an n x n midpoint grid. */
static struct ab albedo_by_quadrature(double cos_o, double alpha, int n)
{
    double s = sqrt(1.0 - cos_o * cos_o), wx = s * alpha, length = sqrt(wx * wx + cos_o * cos_o);
    wx /= length;
    double wz = cos_o / length, a2 = alpha * alpha, so = sqrt(a2 + (1.0 - a2) * cos_o * cos_o);
    struct ab sum = {0.0, 0.0};
    for (int i = 0; i < n * n; i++) {
        double phi = 2.0 * LUM_PI_D * (i / n + 0.5) / n, z = (1.0 - (i % n + 0.5) / n) * (1.0 + wz) - wz;
        double r = sqrt(fmax(0.0, 1.0 - z * z));
        double hx = (r * cos(phi) + wx) * alpha, hy = r * sin(phi) * alpha, hz = z + wz;
        double l = sqrt(hx * hx + hy * hy + hz * hz), c = (hx * s + hz * cos_o) / l, ci = 2.0 * c * hz / l - cos_o;
        if (ci <= 0.0)
            continue;
        double g = ci * (cos_o + so) / (ci * so + cos_o * sqrt(a2 + (1.0 - a2) * ci * ci));
        sum.a += g;
        sum.b += g * pow(fmax(0.0, 1.0 - c), 5.0);
    }
    return (struct ab){sum.a / n / n, sum.b / n / n};
}

/* Everywhere within 0.01 as ggx.h says, on average within 0.002; includes points between the nodes. */
static void albedo_table_agrees_with_quadrature(void **state)
{
    (void)state;
    struct rng r = {3};
    double worst = 0.0, sum = 0.0;
    enum { n = 1500 };
    for (int i = 0; i < n; i++) {
        double cos_o = pow(rng_unit(&r), 3.0) * 0.999 + 1e-6, alpha = pow(10.0, -3.0 * rng_unit(&r));
        struct ab want = albedo_by_quadrature(cos_o, alpha, 120);
        struct lum_ggx_albedo got = lum_ggx_albedo(lum_ggx_row((float)alpha), (float)cos_o);
        double error = fmax(fabs((double)got.bias - want.b), fabs((double)(got.scale + got.bias) - want.a));
        sum += error / n;
        worst = fmax(worst, error);
        if (error > 0.01)
            fail_msg("cos %g alpha %g: table %g %g, quadrature %g %g", cos_o, alpha, (double)(got.scale + got.bias),
                     (double)got.bias, want.a, want.b);
    }
    print_message("worst %.4f, mean %.5f\n", worst, sum);
    assert_true(sum < 0.002);
}

static void mean_albedo_is_the_mean(void **state)
{
    (void)state;
    for (double alpha = 1e-4; alpha <= 1.0; alpha *= 1.7) {
        double a = 0.0, b = 0.0;
        enum { n = 4000 };
        for (int i = 0; i < n; i++) {
            double x = (i + 0.5) / n, c = x * x * x; /* dense at grazing, where the albedo varies */
            struct lum_ggx_albedo e = lum_ggx_albedo(lum_ggx_row((float)alpha), (float)c);
            a += (double)(e.scale + e.bias) * 2.0 * c * 3.0 * x * x / n;
            b += (double)e.bias * 2.0 * c * 3.0 * x * x / n;
        }
        struct lum_ggx_albedo mean = lum_ggx_albedo_mean(lum_ggx_row((float)alpha));
        if (fabs((double)(mean.scale + mean.bias) - a) > 2e-3 || fabs((double)mean.bias - b) > 2e-3)
            fail_msg("alpha %g: table %g %g, mean %g %g", alpha, (double)(mean.scale + mean.bias), (double)mean.bias, a,
                     b);
    }
}

/* Mirror: Schlick's mean is 1/21, and roughness only takes light away. */
static void albedo_tends_to_the_mirror(void **state)
{
    (void)state;
    struct lum_ggx_albedo mirror = lum_ggx_albedo(lum_ggx_row(0.0f), 0.3f);
    assert_true(mirror.scale + mirror.bias == 1.0f);
    for (double c = 0.2; c <= 1.0; c += 0.1) {
        float before = 1.0f;
        for (double alpha = 1e-3; alpha <= 1.0; alpha *= 1.2) {
            struct lum_ggx_albedo e = lum_ggx_albedo(lum_ggx_row((float)alpha), (float)c);
            assert_true(e.scale + e.bias <= before + 1e-6f); /* rounding of the interpolation */
            before = e.scale + e.bias;
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distribution_is_normalised),          cmocka_unit_test(visible_normals_follow_their_density),
        cmocka_unit_test(albedo_table_agrees_with_quadrature), cmocka_unit_test(mean_albedo_is_the_mean),
        cmocka_unit_test(albedo_tends_to_the_mirror),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
