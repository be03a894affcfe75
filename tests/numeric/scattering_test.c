/* Light that fog scatters any number of times, in pictures of the path tracer: white furnaces, a slab against the
 * integral equation of radiative transfer, and a walk in double that looks for no light: it meets lamps by chance.
 *
 * Tolerances are four standard errors of the estimate, and 1e-4 for float; each case says how small that has to be. */
#include "tests/numeric/fog.h"

#include "core/medium/collide.h"
#include "tests/numeric/stats.h"
#include "tests/support/effort.h"

static void set_path(struct rig *r)
{
    r->settings.method = lum_method_find("path");
    r->settings.antialias = false;
    r->settings.w = r->settings.h = 8;
}

struct estimate {
    double mean[3], stderr[3];
};

/* n samples of each of the 64 pixels; the standard error is that of their passes. */
static struct estimate mean_of_passes(struct rig *r, uint32_t n)
{
    n = TEST_EFFORT(n);
    double before[3] = {0}, sum[3] = {0}, square[3] = {0};
    r->settings.max_spp = n;
    for (uint32_t i = 1; i <= n; i++) {
        rig_pass(r);
        struct lum_rgb m = rig_mean(r);
        const double total[3] = {(double)m.r * i, (double)m.g * i, (double)m.b * i};
        for (int k = 0; k < 3; k++) {
            double pass = total[k] - before[k];
            before[k] = total[k];
            sum[k] += pass;
            square[k] += pass * pass;
        }
    }
    struct estimate e;
    for (int k = 0; k < 3; k++) {
        e.mean[k] = sum[k] / n;
        e.stderr[k] = sqrt(fmax(0.0, square[k] / n - e.mean[k] * e.mean[k]) / (n - 1));
    }
    return e;
}

/* error_max: what the standard error may be of want at most, or the test would say little. */
static void check(const char *what, const struct estimate *e, const double want[3], double error_max)
{
    if (!TEST_TELLS)
        return;
    for (int k = 0; k < 3; k++) {
        if (!(fabs(e->mean[k] - want[k]) <= 4.0 * e->stderr[k] + 1e-4 * want[k]))
            fail_msg("%s, colour %d: %.6f +- %.6f, not %.6f", what, k, e->mean[k], e->stderr[k], want[k]);
        if (!(e->stderr[k] < error_max * want[k]))
            fail_msg("%s, colour %d: standard error %.6f of %.6f", what, k, e->stderr[k], want[k]);
    }
}

static const double ones[3] = {1, 1, 1};

/* ---- white furnaces: fog that only scatters does not show in even light ---- */

static void even_sky(void **state)
{
    (void)state;
    const float sigmas[] = {1e-4f, 0.1f, 1.0f, 5.0f}, gs[] = {-0.9f, 0.0f, 0.6f, 0.95f};
    struct rig r;
    rig_begin(&r, 0);
    struct lum_light_desc sky = {
        .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 1, .on = true, .camera_visible = true};
    rig_light(&r, "sky", &sky);
    rig_camera(&r, rig_v(0.3, 0.2, 2.5), rig_v(0, 0, 0), 50);
    set_path(&r);
    for (size_t i = 0; i < LUM_ARRAY_LEN(sigmas); i++)
        for (size_t k = 0; k < LUM_ARRAY_LEN(gs); k++) {
            struct lum_medium_desc fog = fog_box(sigmas[i], 0, rig_v(-1, -1, -1), rig_v(1, 1, 1));
            fog.sigma_s = lum_rgb(sigmas[i], 0.3f * sigmas[i], 2.0f * sigmas[i]);
            fog.g = gs[k];
            put_fog(&r, "fog", &fog);
            struct lum_medium_desc more = fog_box(0.5f * sigmas[i], 0, rig_v(0, -0.5, -2), rig_v(2, 0.5, 3));
            put_fog(&r, "more", &more); /* across the first, and the eye in it */
            rig_commit(&r);
            struct estimate e = mean_of_passes(&r, 256);
            char what[64];
            snprintf(what, sizeof what, "sky, %g/m, g %g", (double)sigmas[i], (double)gs[k]);
            check(what, &e, ones, 0.02);
        }
    rig_end(&r);
}

/* Walls that send out 1 in all: what they reflect of it, and the rest by themselves. The eye is in the fog. */
static void white_room(void **state)
{
    (void)state;
    const float sigmas[] = {0.05f, 1.0f, 10.0f}, gs[] = {-0.5f, 0.0f, 0.8f};
    for (size_t i = 0; i < LUM_ARRAY_LEN(sigmas); i++)
        for (size_t k = 0; k < LUM_ARRAY_LEN(gs); k++) {
            struct rig r;
            rig_begin(&r, 0);
            rig_furnace(&r, 1, 0.5f, 0.5);
            rig_camera(&r, rig_v(0.2, 0.1, 0.3), rig_v(-0.5, -0.4, -1), 90);
            set_path(&r);
            struct lum_medium_desc fog = fog_everywhere(sigmas[i], 0, gs[k]);
            put_fog(&r, "fog", &fog);
            rig_commit(&r);
            struct estimate e = mean_of_passes(&r, 256);
            char what[64];
            snprintf(what, sizeof what, "room, %g/m, g %g", (double)sigmas[i], (double)gs[k]);
            check(what, &e, ones, 0.02);
            rig_end(&r);
        }
}

/* ---- a slab that scatters evenly, lit by a sun above it ---- */

/* E2(x) = exp(-x) - x E1(x), E1 by its series, or its continued fraction (Abramowitz and Stegun 5.1.11, 5.1.22). */
static double exp_integral_2(double x)
{
    if (x <= 0.0)
        return 1.0;
    double e1 = 0.0;
    if (x < 1.0) {
        double term = 1.0;
        e1 = -0.57721566490153286 - log(x);
        for (int k = 1; k < 30; k++) {
            term *= -x / k;
            e1 -= term / k;
        }
    } else {
        for (int k = 200; k > 0; k--)
            e1 = k / (1.0 + k / (x + e1));
        e1 = exp(-x) / (x + e1);
    }
    return exp(-x) - x * e1;
}

enum { LAYERS = 400 };

/* Radiance that leaves the slab's top along cosine mu, or its bottom: S = albedo / (4 pi) E exp(-tau / mu0) +
 * albedo / 2 integral of E1(|tau - t|) S(t) dt, in layers of even S, by iteration. E: of the sun on a plane that faces
 * it. */
static void slab(double albedo, double depth, double mu0, double mu, double *ret_top, double *ret_bottom)
{
    static double source[LAYERS], first[LAYERS], kernel[LAYERS];
    double h = depth / LAYERS;
    for (int i = 0; i < LAYERS; i++) {
        source[i] = first[i] = albedo / (4 * PI) * exp(-(i + 0.5) * h / mu0);
        /* integral of E1 over a layer i away from the middle of one */
        kernel[i] = i == 0 ? 2.0 * (1.0 - exp_integral_2(0.5 * h))
                           : exp_integral_2((i - 0.5) * h) - exp_integral_2((i + 0.5) * h);
    }
    for (int n = 0; n < 200; n++) {
        double next[LAYERS];
        for (int i = 0; i < LAYERS; i++) {
            next[i] = first[i];
            for (int k = 0; k < LAYERS; k++)
                next[i] += 0.5 * albedo * kernel[abs(i - k)] * source[k];
        }
        memcpy(source, next, sizeof next);
    }
    *ret_top = *ret_bottom = 0.0;
    for (int i = 0; i < LAYERS; i++) {
        *ret_top += source[i] * (exp(-i * h / mu) - exp(-(i + 1) * h / mu));
        *ret_bottom += source[i] * (exp(-(LAYERS - 1 - i) * h / mu) - exp(-(LAYERS - i) * h / mu));
    }
}

static void slab_in_the_sun(void **state)
{
    (void)state;
    const struct {
        double albedo, depth;
    } cases[] = {{1.0, 0.05}, {1.0, 1.0}, {0.9, 2.0}, {0.5, 2.0}, {1.0, 4.0}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++)
        for (int below = 0; below < 2; below++) {
            struct rig r;
            rig_begin(&r, 0);
            struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                         .direction = {0.6, -0.8, 0},
                                         .color = lum_grey(1),
                                         .intensity = 100,
                                         .on = true};
            rig_light(&r, "sun", &sun);
            double sigma = cases[i].depth, albedo = cases[i].albedo; /* it is a metre thick */
            struct lum_medium_desc fog = fog_box((float)(sigma * albedo), (float)(sigma * (1.0 - albedo)),
                                                 rig_v(-200, 0, -200), rig_v(200, 1, 200));
            put_fog(&r, "fog", &fog);
            rig_commit(&r);
            /* through the middle of its pixel: cosine 0.8 */
            rig_camera(&r, rig_v(0, below ? -3 : 4, 0), rig_v(0, below ? 1 : 0, 3), 1);
            set_path(&r);
            r.settings.w = r.settings.h = 1;
            struct estimate e = mean_of_passes(&r, 16384);
            double top, bottom;
            slab(albedo, cases[i].depth, 0.8, 0.8, &top, &bottom);
            double want = 100 * (below ? bottom : top);
            char what[64];
            snprintf(what, sizeof what, "albedo %g, depth %g, from %s", albedo, cases[i].depth,
                     below ? "below" : "above");
            check(what, &e, (const double[3]){want, want, want}, 0.05);
            rig_end(&r);
        }
}

/* ---- a cube of coloured fog beside a panel, and a walk that knows nothing of either ---- */

struct walker {
    double p[3], d[3];
};

/* How far the ray goes in the box from where it enters it. False: it does not. */
static bool crosses(const double lo[3], const double hi[3], const struct walker *a, double *ret_t0, double *ret_t1)
{
    double t0 = 0.0, t1 = INFINITY;
    for (int k = 0; k < 3; k++) {
        double x = (lo[k] - a->p[k]) / a->d[k], y = (hi[k] - a->p[k]) / a->d[k];
        t0 = fmax(t0, fmin(x, y));
        t1 = fmin(t1, fmax(x, y));
    }
    *ret_t0 = t0;
    *ret_t1 = t1;
    return t0 < t1;
}

static void turn(struct walker *a, double g, struct rng *rng)
{
    double u = rng_unit(rng), s = (1 - g * g) / (1 - g + 2 * g * u), c = (1 + g * g - s * s) / (2 * g);
    double phi = 2 * PI * rng_unit(rng), sine = sqrt(fmax(0.0, 1 - c * c)), *d = a->d;
    double side[3] = {-d[1], d[0], 0}, n = hypot(d[0], d[1]); /* no direction is along z, but by chance */
    side[0] /= n;
    side[1] /= n;
    double up[3] = {d[1] * side[2] - d[2] * side[1], d[2] * side[0] - d[0] * side[2], d[0] * side[1] - d[1] * side[0]};
    for (int k = 0; k < 3; k++)
        d[k] = c * d[k] + sine * (cos(phi) * side[k] + sin(phi) * up[k]);
}

#define CUBE_G 0.6
static const double cube_lo[3] = {-1, -1, -1}, cube_hi[3] = {1, 1, 1};
static const double cube_s[3] = {0.4, 1.0, 2.0}, cube_a[3] = {0.4, 0.1, 0.0};

/* Mean share of walks from the eye, along its axis, that meet the panel's lower side: |x|, |z| < 2 at y = 2. */
static double walk(int colour, int n, double *ret_stderr)
{
    struct rng rng = {11 + (uint64_t)colour};
    double s = cube_s[colour], t = s + cube_a[colour], sum = 0.0, square = 0.0;
    for (int i = 0; i < n; i++) {
        struct walker a = {{0.1, 0.2, 4}, {1e-9, 1e-9, -1}};
        double t0, t1, weight = 1.0;
        while (crosses(cube_lo, cube_hi, &a, &t0, &t1)) {
            double step = t0 - log(1.0 - rng_unit(&rng)) / t;
            if (step >= t1)
                break;
            for (int k = 0; k < 3; k++)
                a.p[k] += step * a.d[k];
            weight *= s / t;
            turn(&a, CUBE_G, &rng);
        }
        double up = a.d[1] > 0.0 ? (2.0 - a.p[1]) / a.d[1] : -1.0;
        bool met = up > 0.0 && fabs(a.p[0] + up * a.d[0]) < 2.0 && fabs(a.p[2] + up * a.d[2]) < 2.0;
        sum += met ? weight : 0.0;
        square += met ? weight * weight : 0.0;
    }
    *ret_stderr = sqrt((square / n - sum / n * (sum / n)) / n);
    return sum / n;
}

static void cube_beside_a_panel(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    struct lum_light_desc panel = rig_quad(rig_v(0, 2, 0), rig_v(4, 0, 0), rig_v(0, 0, 4), 1);
    rig_light(&r, "panel", &panel);
    struct lum_medium_desc fog = fog_box(0, 0, rig_v(-1, -1, -1), rig_v(1, 1, 1));
    fog.sigma_s = lum_rgb((float)cube_s[0], (float)cube_s[1], (float)cube_s[2]);
    fog.sigma_a = lum_rgb((float)cube_a[0], (float)cube_a[1], (float)cube_a[2]);
    fog.g = (float)CUBE_G;
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    rig_camera(&r, rig_v(0.1, 0.2, 4), rig_v(0.1, 0.2, 0), 1);
    set_path(&r);
    r.settings.w = r.settings.h = 1;
    struct estimate e = mean_of_passes(&r, 32768);
    double want[3];
    for (int k = 0; k < 3; k++) {
        double stderr_of_walk;
        want[k] = walk(k, TEST_EFFORT(400000), &stderr_of_walk);
        e.stderr[k] = hypot(e.stderr[k], stderr_of_walk); /* what the two may differ by */
    }
    check("cube", &e, want, 0.02);
    rig_end(&r);
}

/* ---- limits ---- */

/* In thin fog next to all that is scattered is scattered once, and towards no depth at all exactly so. */
static void thin_fog_scatters_once(void **state)
{
    (void)state;
    double share[2];
    for (int i = 0; i < 2; i++) {
        double mean[2];
        for (int once = 0; once < 2; once++) {
            struct rig r;
            rig_begin(&r, 0);
            set_path(&r);
            fog_with_bulb(&r, i == 0 ? 1e-4f : 1e-2f, 5, 0.3, 20);
            r.settings.effects_off = once ? LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING) : 0;
            mean[once] = mean_of_passes(&r, 16384).mean[1];
            rig_end(&r);
        }
        share[i] = mean[0] / mean[1] - 1.0;
    }
    /* Of the order of the depths of the ways: 20 m to the wall, and as much around. */
    assert_true(!TEST_TELLS || (fabs(share[0]) < 0.01 && share[1] > 0.01 && share[1] < 0.4));
}

/* NOTES H23: strengths that no path leaves, or that none is scattered by; phase functions like needles. rig_pass
 * asserts that nothing is not finite and that no ray is bad. */
static void extremes_are_finite(void **state)
{
    (void)state;
    const float sigmas[] = {1e-30f, 1e-6f, 1e2f, 1e6f}, gs[] = {-0.99f, 0.0f, 0.99f};
    struct rig r;
    rig_begin(&r, 0);
    rig_room(&r);
    struct lum_light_desc lamp = rig_quad(rig_v(0, 2.9, 0), rig_v(0.8, 0, 0), rig_v(0, 0, 0.8), 300);
    rig_light(&r, "lamp", &lamp);
    rig_bulb(&r, "bulb", rig_v(-1, 2, 0.5), 60);
    set_path(&r);
    for (size_t i = 0; i < LUM_ARRAY_LEN(sigmas); i++)
        for (size_t k = 0; k < LUM_ARRAY_LEN(gs); k++)
            for (int everywhere = 0; everywhere < 2; everywhere++) {
                struct lum_medium_desc fog = fog_box(sigmas[i], 0, rig_v(-1, 0, -1), rig_v(1, 2, 1));
                fog.g = gs[k];
                fog.everywhere = everywhere;
                fog.sigma_s.g *= 1e-3f;
                put_fog(&r, "fog", &fog);
                rig_commit(&r);
                rig_pass(&r);
                assert_true(lum_rgb_finite(rig_mean(&r)));
            }
    rig_end(&r);
}

/* It is called for by what scatters, and by that alone; only methods that have it trace rays for it. */
static void called_for_by_what_scatters(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = 0; m < n; m++) {
        struct rig r;
        rig_begin(&r, 0);
        rig_room(&r);
        rig_bulb(&r, "bulb", rig_v(-1, 2, 0.5), 60);
        struct lum_medium_desc smoke = fog_box(0, 0.2f, rig_v(-2, 0, -2), rig_v(2, 3, 2)), fog = smoke;
        fog.sigma_s = lum_grey(0.2f);
        put_fog(&r, "smoke", &smoke);
        r.settings.method = &methods[m];
        rig_commit(&r);
        struct lum_pass_stats s = rig_pass(&r);
        assert_false(s.demand.on[LUM_EFFECT_SCATTERING]);
        assert_string_equal(s.demand.why[LUM_EFFECT_SCATTERING], "no medium scatters light");
        assert_int_equal(s.rays[LUM_RAY_SCATTERING], 0);
        put_fog(&r, "fog", &fog);
        rig_commit(&r);
        s = rig_pass(&r);
        assert_string_equal(s.demand.why[LUM_EFFECT_SCATTERING], "fog scatters light");
        assert_int_equal(s.rays[LUM_RAY_SCATTERING] > 0, methods[m].serves[LUM_EFFECT_SCATTERING] != NULL);
        rig_end(&r);
    }
}

/* A lone floor in fog gets light by way of others only where fog scatters it. */
static void costs_nothing_without_its_light(void **state)
{
    (void)state;
    const char *names[] = {"tic", "igi", "live", "path"};
    for (size_t m = 0; m < LUM_ARRAY_LEN(names); m++)
        for (int once = 0; once < 2; once++) {
            struct rig r;
            rig_begin(&r, 0);
            rig_box(&r, "floor", 2, 0.01, 2);
            rig_diffuse_object(&r, "floor", "grey", 0.5f, rig_v(0, 0, 0));
            struct lum_light_desc bulb = rig_point(rig_v(0, 1, 0), 100);
            rig_light(&r, "bulb", &bulb);
            struct lum_medium_desc fog = fog_box(0.3f, 0, rig_v(-3, -1, -3), rig_v(3, 2, 3));
            put_fog(&r, "fog", &fog);
            rig_commit(&r);
            rig_camera(&r, rig_v(0, 1, 2), rig_v(0, 0, 0), 50);
            r.settings.method = lum_method_find(names[m]);
            r.settings.max_spp = 1;
            r.settings.w = r.settings.h = 16;
            if (once)
                fog_scatters_once(&r);
            struct lum_pass_stats s = rig_pass(&r);
            bool carries = m >= 2 && !once;
            uint64_t rays = s.rays[LUM_RAY_VPL] + s.rays[LUM_RAY_INDIRECT_DIFFUSE] + s.rays[LUM_RAY_GLOSSY];
            if ((rays > 0 || s.cache.created > 0) != carries)
                fail_msg("%s, scattering %s: %llu rays, %llu records", names[m], once ? "off" : "on",
                         (unsigned long long)rays, (unsigned long long)s.cache.created);
            rig_end(&r);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(even_sky),
        cmocka_unit_test(white_room),
        cmocka_unit_test(slab_in_the_sun),
        cmocka_unit_test(cube_beside_a_panel),
        cmocka_unit_test(thin_fog_scatters_once),
        cmocka_unit_test(extremes_are_finite),
        cmocka_unit_test(called_for_by_what_scatters),
        cmocka_unit_test(costs_nothing_without_its_light),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
