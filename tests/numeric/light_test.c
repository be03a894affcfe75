/* Irradiance of lights against closed forms; flux, continuity, hostile input. */
#include <math.h>
#include <string.h>

#include "core/light/rect.h"
#include "core/light/sample.h"
#include "core/math/sampler.h"
#include "tests/numeric/stats.h"
#include "tests/support/lights.h"

/* Irradiance at p on a plane facing n, by n_samples of the light. */
static double irradiance(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n, uint32_t n_samples)
{
    struct lum_snapshot s = snapshot_of(l);
    double sum = 0.0;
    for (uint32_t i = 0; i < n_samples; i++) {
        struct lum_sampler q = lum_sampler_at(5, 6, i, 7);
        struct lum_light_sample ls;
        if (!lum_light_sample_at(&s, 0, p, lum_sampler_2d(&q, 0), &ls))
            continue;
        double cos_p = fmax(0.0, (double)lum_dot(ls.wi, n));
        sum += (double)ls.radiance.g * cos_p / (l->delta ? 1.0 : (double)ls.pdf_sa);
    }
    return sum / n_samples;
}

/* ---- closed forms ---- */

/* Lambert 1760: irradiance of a polygon of radiance 1: half the sum over edges of angle times the z of the edge plane's
 * normal; the polygon is cut at the horizon of n first. In double. */
static double polygon_irradiance(const struct lum_vec3 *v, int n_v, struct lum_vec3 p, struct lum_vec3 n)
{
    struct lum_vec3d q[16];
    int m = 0;
    for (int i = 0; i < n_v; i++) {
        struct lum_vec3 a = lum_v3_sub(v[i], p), b = lum_v3_sub(v[(i + 1) % n_v], p);
        double ha = (double)a.x * (double)n.x + (double)a.y * (double)n.y + (double)a.z * (double)n.z;
        double hb = (double)b.x * (double)n.x + (double)b.y * (double)n.y + (double)b.z * (double)n.z;
        if (ha > 0.0)
            q[m++] = (struct lum_vec3d){(double)a.x, (double)a.y, (double)a.z};
        if ((ha > 0.0) != (hb > 0.0)) {
            double t = ha / (ha - hb);
            q[m++] = (struct lum_vec3d){(double)a.x + t * (double)(b.x - a.x), (double)a.y + t * (double)(b.y - a.y),
                                        (double)a.z + t * (double)(b.z - a.z)};
        }
    }
    double sum = 0.0;
    for (int i = 0; i < m; i++) {
        struct lum_vec3d a = q[i], b = q[(i + 1) % m];
        struct lum_vec3d c = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
        double s = sqrt(c.x * c.x + c.y * c.y + c.z * c.z), cosine = a.x * b.x + a.y * b.y + a.z * b.z;
        if (s > 0.0)
            sum += atan2(s, cosine) * (c.x * (double)n.x + c.y * (double)n.y + c.z * (double)n.z) / s;
    }
    return 0.5 * fabs(sum);
}

static double quad_irradiance(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n)
{
    struct lum_vec3 v[4];
    for (int i = 0; i < 4; i++)
        v[i] = lum_v3_mad(lum_v3_mad(l->p, l->u, i == 0 || i == 3 ? -1.0f : 1.0f), l->v, i < 2 ? -1.0f : 1.0f);
    return polygon_irradiance(v, 4, p, n);
}

/* 2^14 points of a net; the error of a smooth integrand is far below 0.1 %, and the horizon's edge costs about N^-3/4.
 */
static void quad_irradiance_is_lamberts(void **state)
{
    (void)state;
    struct rng r = {4};
    double worst = 0.0;
    for (int i = 0; i < 300; i++) {
        struct lum_frame f = lum_frame_from_normal(direction(2.0 * rng_unit(&r) - 1.0, 6.3 * rng_unit(&r)));
        float w = (float)pow(10.0, 2.0 * rng_unit(&r) - 1.5), h = (float)pow(10.0, 2.0 * rng_unit(&r) - 1.5);
        struct lum_light l = quad(lum_v3(0.3f, -0.2f, 1.0f), lum_v3_mul(f.t, w), lum_v3_mul(f.b, h));
        struct lum_vec3 offset = direction(2.0 * rng_unit(&r) - 1.0, 6.3 * rng_unit(&r));
        if (lum_dot(offset, l.n) < 0.0f)
            offset = lum_v3_neg(offset);
        struct lum_vec3 p = lum_v3_mad(l.p, offset, (float)pow(10.0, 2.5 * rng_unit(&r) - 0.5));
        struct lum_vec3 n =
            lum_normalize(lum_v3_add(lum_normalize(lum_v3_sub(l.p, p)),
                                     lum_v3_mul(direction(2.0 * rng_unit(&r) - 1.0, 6.3 * rng_unit(&r)), 0.7f)));
        double want = quad_irradiance(&l, p, n), got = irradiance(&l, p, n, 1 << 14);
        worst = fmax(worst, fabs(got / want - 1.0));
        if (fabs(got - want) > 0.005 * want)
            fail_msg("case %d: %g, Lambert %g (half edges %g x %g, distance %g)", i, got, want, (double)w, (double)h,
                     (double)lum_length(lum_v3_sub(p, l.p)));
    }
    print_message("worst relative error over 300 quads: %.5f\n", worst);
}

/* The panel is seen, or faces, at 89.9 degrees. */
static void quad_irradiance_holds_at_grazing(void **state)
{
    (void)state;
    float c = (float)cos(89.9 * LUM_PI_D / 180.0), s = (float)sin(89.9 * LUM_PI_D / 180.0);
    struct lum_light l = quad(lum_v3(0, 0, 0), lum_v3(0, 0.5f, 0), lum_v3(0.5f, 0, 0)); /* emits towards -z */
    static const float distances[] = {0.6f, 1.0f, 3.0f, 30.0f};
    for (size_t i = 0; i < LUM_ARRAY_LEN(distances); i++) {
        struct lum_vec3 edge_on = {distances[i] * s, 0.0f, -distances[i] * c},
                        to = lum_v3_mul(edge_on, -1.0f / distances[i]);
        struct lum_vec3 below = {0.0f, 0.0f, -distances[i]}, tilted = {s, 0.0f, c};
        struct {
            struct lum_vec3 p, n;
        } cases[] = {{edge_on, to}, {below, tilted}};
        for (size_t k = 0; k < 2; k++) {
            double want = quad_irradiance(&l, cases[k].p, cases[k].n);
            double got = irradiance(&l, cases[k].p, cases[k].n, 1 << 16);
            if (fabs(got - want) > 0.005 * want)
                fail_msg("distance %g, case %zu: %g, Lambert %g", (double)distances[i], k, got, want);
        }
    }
}

/* On the axis E = pi L sin^2. Area sampling: cos^2 / r^2 varies by (1 + (R/d)^2)^2 over the disc. */
static void disc_on_its_axis(void **state)
{
    (void)state;
    static const double distances[] = {0.1, 0.5, 1.0, 2.0, 100.0};
    for (size_t i = 0; i < LUM_ARRAY_LEN(distances); i++) {
        double d = distances[i], want = LUM_PI_D / (1.0 + d * d);
        struct lum_light l = disc(lum_v3(0, 0, (float)d), lum_v3(0, 0, -1), 1.0f);
        double got = irradiance(&l, lum_v3(0, 0, 0), lum_v3(0, 0, 1), 1 << 16);
        if (fabs(got - want) > 0.002 * want)
            fail_msg("distance %g: %g, closed form %g", d, got, want);
    }
}

/* A sphere wholly above the horizon: E = pi L (R / d)^2 cos. */
static void sphere_is_as_if_a_point(void **state)
{
    (void)state;
    static const double distances[] = {1.05, 2.0, 10.0, 1e4};
    for (size_t i = 0; i < LUM_ARRAY_LEN(distances); i++)
        for (double cosine = 1.0; cosine > 1.02 / distances[i]; cosine *= 0.7) {
            double d = distances[i], want = LUM_PI_D / (d * d) * cosine;
            struct lum_light l = sphere(lum_v3_mul(direction(cosine, 0.5), (float)d), 1.0f);
            double got = irradiance(&l, lum_v3(0, 0, 0), lum_v3(0, 0, 1), 1 << 14);
            if (fabs(got - want) > 0.001 * want)
                fail_msg("distance %g, cos %g: %g, closed form %g", d, cosine, got, want);
        }
}

static void constant_environment_gives_pi(void **state)
{
    (void)state;
    struct lum_light l = light(&lum_emitter_environment);
    l.frame = lum_frame_from_normal(lum_v3(0, 0, 1));
    for (int i = 0; i < 10; i++) {
        double got = irradiance(&l, lum_v3(0, 0, 0), direction(i / 5.0 - 1.0, i), 1 << 16);
        assert_true(fabs(got / LUM_PI_D - 1.0) < 0.001);
    }
    struct lum_light_table t = {.lights = &l, .n_lights = 1, .environment = 0};
    assert_true(lum_lights_background(&t, lum_v3(0, 1, 0), false).g == 1.0f);
    assert_true(lum_lights_background(&t, lum_v3(0, 1, 0), true).g == 0.0f); /* not visible to the camera */
    l.camera_visible = true;
    assert_true(lum_lights_background(&t, lum_v3(0, 1, 0), true).g == 1.0f);
    l.on = false;
    assert_true(lum_lights_background(&t, lum_v3(0, 1, 0), false).g == 0.0f);
    t.environment = LUM_NO_OBJECT;
    assert_true(lum_lights_background(&t, lum_v3(0, 1, 0), false).g == 0.0f);
}

static void spot_ramps_as_in_gltf(void **state)
{
    (void)state;
    struct lum_light l = spot();
    l.omc_inner = 0.125f, l.omc_outer = 0.5f;
    assert_true(lum_spot_share(&l, 0.0625f) == 1.0f && lum_spot_share(&l, 0.125f) == 1.0f);
    assert_true(fabsf(lum_spot_share(&l, 0.3125f) - 0.25f) < 1e-6f);
    assert_true(lum_spot_share(&l, 0.5f) == 0.0f && lum_spot_share(&l, 2.0f) == 0.0f);
    l.omc_inner = l.omc_outer = 0.5f; /* a hard edge */
    assert_true(lum_spot_share(&l, 0.5f) == 1.0f && lum_spot_share(&l, 0.5001f) == 0.0f);
    assert_true(lum_spot_share(&l, NAN) == 0.0f);
}

/* Half way to the edge of a cone that has no inner one, the falloff is (1 - 1/4)^2: 1 - cos goes with the square of a
 * small angle. Directions are good to 2^-23, so half the narrowest angle to 3e-4, its square to twice that and the
 * falloff by as much again; plus angle^2 / 16 of the series, 2.5e-5 at 0.02. */
static void narrow_spots_keep_their_edge(void **state)
{
    (void)state;
    const double angles[] = {1e-3, 2e-3, 5e-3, 2e-2};
    for (size_t i = 0; i < LUM_ARRAY_LEN(angles); i++) {
        struct lum_light l = spot();
        l.n = lum_normalize(lum_v3(0.3f, -1.0f, 0.2f));
        l.power = lum_grey(64.0f);
        l.omc_outer = (float)(2.0 * sin(0.5 * angles[i]) * sin(0.5 * angles[i]));
        struct lum_frame f = lum_frame_from_normal(l.n);
        struct lum_snapshot s = snapshot_of(&l);
        for (int k = 0; k < 8; k++) {
            struct lum_vec3 d = direction(cos(0.5 * angles[i]), 0.7 * k);
            struct lum_light_sample ls;
            assert_true(lum_light_sample_at(&s, 0, lum_v3_mul(lum_frame_to_scene(&f, d), 8.0f),
                                            (struct lum_vec2){0.5f, 0.5f}, &ls));
            if (fabs((double)ls.radiance.g - 0.5625) > 1.5e-3 * 0.5625)
                fail_msg("cone of %g rad: %g, expected 0.5625", angles[i], (double)ls.radiance.g);
        }
    }
}

/* ---- flux ---- */

/* Light through a large sphere around the light: the mean irradiance on it times its area. */
static double flux_of(const struct lum_light *l, double radius)
{
    enum { n = 1 << 16 };
    struct lum_snapshot s = snapshot_of(l);
    double sum = 0.0;
    for (uint32_t i = 0; i < n; i++) {
        struct lum_sampler q = lum_sampler_at(0, 0, i, 1);
        struct lum_vec2 u = lum_sampler_2d(&q, 0);
        struct lum_vec3 out = direction(1.0 - 2.0 * (double)u.x, 2.0 * LUM_PI_D * (double)u.y);
        struct lum_light_sample ls;
        if (lum_light_sample_at(&s, 0, lum_v3_mul(out, (float)radius), lum_sampler_2d(&q, 1), &ls))
            sum +=
                fmax(0.0, -(double)lum_dot(ls.wi, out)) * (double)ls.radiance.g / (l->delta ? 1.0 : (double)ls.pdf_sa);
    }
    return sum / n * 4.0 * LUM_PI_D * radius * radius;
}

/* 800 lm go in, 800 lm come out. */
static void flux_is_kept(void **state)
{
    (void)state;
    static const struct lum_light_kind_row *const kinds[] = {&lum_light_kind_point, &lum_light_kind_spot,
                                                             &lum_light_kind_quad, &lum_light_kind_disc,
                                                             &lum_light_kind_sphere};
    for (size_t i = 0; i < LUM_ARRAY_LEN(kinds); i++) {
        struct lum_light_desc d = {.kind = kinds[i],
                                   .direction = {0, 0, -1},
                                   .u = {0, 0.5, 0},
                                   .v = {0.25, 0, 0},
                                   .radius_m = 0.3,
                                   .inner_cone_rad = 0.3,
                                   .outer_cone_rad = 0.8,
                                   .color = {1, 1, 1}};
        double intensity = 0.0;
        assert_int_equal(lum_light_from_flux(&d, 800.0, &intensity, NULL), LUM_OK);
        struct lum_light lights[] = {light(&lum_emitter_point), spot(),
                                     quad(lum_v3(0, 0, 0), lum_v3(0, 0.25f, 0), lum_v3(0.125f, 0, 0)),
                                     disc(lum_v3(0, 0, 0), lum_v3(0, 0, -1), 0.3f), sphere(lum_v3(0, 0, 0), 0.3f)};
        struct lum_light *l = &lights[i];
        l->delta = i < 2;
        l->omc_inner = 1.0f - cosf(0.3f), l->omc_outer = 1.0f - cosf(0.8f);
        l->power = lum_grey((float)intensity);
        double got = flux_of(l, 5.0);
        if (fabs(got / 800.0 - 1.0) > 0.002)
            fail_msg("kinds[%zu]: %g lm", i, got);
    }
}

/* ---- hard cases ---- */

/* Solid angle against area sampling: both must give the same light on either side of the switch, and their pdfs at the
 * middle of the rectangle agree to its curvature, S / 4. */
static void quad_switches_without_a_step(void **state)
{
    (void)state;
    struct lum_light l = quad(lum_v3(0, 0, 0), lum_v3(0, 0.5f, 0), lum_v3(0.5f, 0, 0));
    static const struct lum_vec3 towards[] = {{0, 0, -1}, {0.6f, 0, -0.8f}, {0.99f, 0, -0.1410674f}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(towards); k++) {
        double lo = 1.0, hi = 1000.0; /* distance where the solid angle crosses the threshold */
        for (int i = 0; i < 60; i++) {
            double mid = 0.5 * (lo + hi);
            struct lum_rect_view v;
            assert_true(lum_rect_view_init(&v, lum_v3_mul(towards[k], (float)mid), l.p, l.u, l.v));
            *(v.solid_angle >= LUM_RECT_MIN_SR ? &lo : &hi) = mid;
        }
        double near = lo * (1.0 - 1e-5), far = hi * (1.0 + 1e-5);
        struct lum_vec3 n = lum_v3_neg(towards[k]);
        double a = irradiance(&l, lum_v3_mul(towards[k], (float)near), n, 1 << 16);
        double b = irradiance(&l, lum_v3_mul(towards[k], (float)far), n, 1 << 16);
        /* the light itself falls by 2 * 2e-5 between the two */
        if (fabs(a / b - 1.0) > 1e-3)
            fail_msg("direction %zu: %g at %g, %g at %g", k, a, near, b, far);
    }
}

static void tiny_lights_keep_their_light(void **state)
{
    (void)state;
    float half = 0.5e-3f; /* area 1e-6 */
    struct lum_vec3 o = {0, 0, 0}, up = {0, 0, 1};
    for (float d = 0.01f; d < 200.0f; d *= 3.0f) {
        struct lum_light q = quad(lum_v3(0, 0, d), lum_v3(0, half, 0), lum_v3(half, 0, 0));
        double want = quad_irradiance(&q, o, up);
        assert_true(fabs(irradiance(&q, o, up, 4096) / want - 1.0) < 0.001);
        struct lum_light s = sphere(lum_v3(0, 0, d), 1e-6f);
        want = LUM_PI_D * pow((double)s.radius / (double)d, 2.0);
        assert_true(fabs(irradiance(&s, o, up, 4096) / want - 1.0) < 0.001);
    }
}

static void nothing_reaches_from_behind_or_from_no_area(void **state)
{
    (void)state;
    struct lum_vec3 o = {0, 0, 0}, up = {0, 0, 1};
    struct lum_light lights[] = {
        quad(lum_v3(0, 0, 1), lum_v3(1, 0, 0), lum_v3(0, 1, 0)),       /* emits towards +z */
        quad(lum_v3(1, 0, 0), lum_v3(0.5f, 0, 0), lum_v3(0, 0.5f, 0)), /* the point lies in its plane */
        quad(lum_v3(0, 0, 1), lum_v3(0, 0, 0), lum_v3(1, 0, 0)),
        quad(lum_v3(0, 0, 1), lum_v3(1, 0, 0), lum_v3(1, 0, 0)),
        disc(lum_v3(0, 0, 1), lum_v3(0, 0, 1), 1.0f),
        disc(lum_v3(0, 0, 1), lum_v3(0, 0, -1), 0.0f),
        disc(o, up, 1.0f),
        sphere(lum_v3(0, 0, 1), 0.0f),
        sphere(lum_v3(0, 0, 0.5f), 1.0f), /* the point is inside */
        sphere(o, 1.0f),
        light(&lum_emitter_point), /* at the point */
        spot(),
    };
    lights[10].delta = lights[11].delta = true;
    for (size_t i = 0; i < LUM_ARRAY_LEN(lights); i++) {
        double e = irradiance(&lights[i], o, up, 64);
        if (e != 0.0)
            fail_msg("light %zu: %g", i, e);
        struct lum_snapshot s = snapshot_of(&lights[i]);
        float pdf = lum_light_pdf(&s, 0, o, up, lum_v3(0, 0, 1), lum_v3(0, 0, -1));
        assert_true(isfinite(pdf));
    }
    struct lum_light q = quad(lum_v3(0, 0, 1), lum_v3(0, 1, 0), lum_v3(1, 0, 0));
    assert_true(lum_light_emitted(&q, q.n, false).g == 1.0f && lum_light_emitted(&q, q.n, true).g == 0.0f);
    q.on = false;
    assert_true(lum_light_emitted(&q, q.n, false).g == 0.0f);
}

static float hostile(struct rng *r)
{
    static const float values[] = {0.0f, 1e-30f, -1e-30f, 1e-6f, 1.0f, -1.0f, 100.0f, 1e-38f};
    return rng_unit(r) < 0.3 ? values[rng_u64(r) % LUM_ARRAY_LEN(values)] : (float)(2.0 * rng_unit(r) - 1.0);
}

static struct lum_vec3 hostile_vec(struct rng *r)
{
    return lum_v3(hostile(r), hostile(r), hostile(r));
}

static void nothing_is_ever_not_finite(void **state)
{
    (void)state;
    static const struct lum_emitter_row *const kinds[] = {
        &lum_emitter_point, &lum_emitter_directional, &lum_emitter_far_disc,          &lum_emitter_quad,
        &lum_emitter_disc,  &lum_emitter_sphere,      &lum_emitter_opening_rectangle, &lum_emitter_opening_disc,
        &lum_emitter_mesh,  &lum_emitter_environment};
    struct rng r = {9};
    struct mesh_light m;
    mesh_light_init(&m);
    for (int i = 0; i < 1000000; i++) {
        const struct lum_emitter_row *kind = kinds[i % LUM_ARRAY_LEN(kinds)];
        struct lum_light l = light(kind);
        if (kind == &lum_emitter_quad)
            l = quad(hostile_vec(&r), hostile_vec(&r), hostile_vec(&r));
        else if (kind == &lum_emitter_disc)
            l = disc(hostile_vec(&r), lum_normalize(hostile_vec(&r)), fabsf(hostile(&r)));
        else if (kind == &lum_emitter_sphere)
            l = sphere(hostile_vec(&r), fabsf(hostile(&r)));
        else if (kind == &lum_emitter_mesh)
            l = m.light;
        else
            l.p = hostile_vec(&r), l.omc_inner = hostile(&r), l.omc_outer = hostile(&r),
            l.n = direction(2.0 * rng_unit(&r) - 1.0, 1.0);
        l.frame = lum_frame_from_normal(lum_v3(0, 0, 1));
        m.snapshot.lights.lights = &l;
        struct lum_vec3 p = i % 5 == 0 ? l.p : hostile_vec(&r);
        struct lum_vec2 u = {(float)(rng_u64(&r) >> 40) * 0x1p-24f,
                             i % 7 ? (float)(rng_u64(&r) >> 40) * 0x1p-24f : 0.0f};
        struct lum_light_sample s = {0};
        bool got = lum_light_sample_at(&m.snapshot, 0, p, u, &s);
        struct lum_vec3 x = hostile_vec(&r);
        float pdf = lum_light_pdf(&m.snapshot, 0, p, lum_normalize(x), x, lum_normalize(hostile_vec(&r)));
        bool delta = kind == &lum_emitter_point || kind == &lum_emitter_directional;
        bool ok = isfinite(pdf) && pdf >= 0.0f;
        if (got)
            ok = ok && lum_v3_finite(s.wi) && fabsf(lum_length(s.wi) - 1.0f) < 1e-4f && lum_rgb_finite(s.radiance) &&
                 s.distance >= 0.0f && isfinite(s.pdf_sa) && (delta ? s.pdf_sa == 0.0f : s.pdf_sa > 0.0f);
        if (!ok)
            fail_msg("case %d, kinds[%d]: pdf %g, sample %g %g %g distance %g pdf %g", i, i % (int)LUM_ARRAY_LEN(kinds),
                     (double)pdf, (double)s.wi.x, (double)s.wi.y, (double)s.wi.z, (double)s.distance, (double)s.pdf_sa);
    }
}

/* ---- views ---- */

static void assert_same_sample(const struct lum_light_sample *a, const struct lum_light_sample *b, int i)
{
    bool same = a->wi.x == b->wi.x && a->wi.y == b->wi.y && a->wi.z == b->wi.z && a->distance == b->distance &&
                a->pdf_sa == b->pdf_sa && a->radiance.r == b->radiance.r && a->radiance.g == b->radiance.g &&
                a->radiance.b == b->radiance.b;
    if (!same)
        fail_msg("case %d: %.9g %.9g %.9g pdf %.9g, not %.9g %.9g %.9g pdf %.9g", i, (double)a->wi.x, (double)a->wi.y,
                 (double)a->wi.z, (double)a->pdf_sa, (double)b->wi.x, (double)b->wi.y, (double)b->wi.z,
                 (double)b->pdf_sa);
}

/* A light of each kind that has an area, of about 1 and at most 2 across. */
static struct lum_light light_with_area(const struct mesh_light *m, int i)
{
    switch (i % 5) {
    case 0:
        return quad(lum_v3(0.1f, 0.2f, 0.3f), lum_v3(0.5f, 0, 0), lum_v3(0, 0.6f, 0));
    case 1:
        return disc(lum_v3(0.1f, 0.2f, 0.3f), lum_v3(0, 0, -1), 0.7f);
    case 2:
        return sphere(lum_v3(0.1f, 0.2f, 0.3f), 0.4f);
    case 3:
        return m->light;
    default:
        return light(&lum_emitter_environment);
    }
}

/* A view's samples are those of lum_light_sample_plainly, bit by bit. */
static void views_see_what_samples_see(void **state)
{
    (void)state;
    struct rng r = {12};
    struct mesh_light m;
    mesh_light_init(&m);
    int n[LUM_VIEW_OTHER + 1] = {0};
    for (int i = 0; i < 10000; i++) {
        struct lum_light l = light_with_area(&m, i);
        l.frame = lum_frame_from_normal(lum_v3(0, 0, 1));
        if (l.kind == &lum_emitter_mesh && i % 2)
            l.facets = &m.facets;
        m.snapshot.lights.lights = &l;
        struct lum_vec3 p =
            lum_v3_mad(l.facets ? l.facets_at : l.p, direction(2.0 * rng_unit(&r) - 1.0, 6.3 * rng_unit(&r)),
                       (float)pow(10.0, 1.5 * rng_unit(&r) - 0.5));
        struct lum_vec2 u = {(float)rng_unit(&r), (float)rng_unit(&r)};
        struct lum_light_view view;
        struct lum_light_sample a, b;
        lum_light_look(&m.snapshot, 0, p, &view);
        bool got = lum_light_view_sample(&view, u, &a);
        assert_int_equal(got, lum_light_sample_plainly(&m.snapshot, 0, p, u, &b));
        if (got)
            assert_same_sample(&a, &b, i);
        n[view.kind]++;
    }
    for (int k = 0; k <= LUM_VIEW_OTHER; k++)
        assert_true(n[k] > 100);
}

/* Weights are cosine over pdf. By area they are computed without the direction: each of the cosines is then right to
 * some eight roundings of numbers up to 1. */
static void weights_are_those_of_samples(void **state)
{
    (void)state;
    struct rng r = {13};
    struct mesh_light m;
    mesh_light_init(&m);
    for (int i = 0; i < 10000; i++) {
        struct lum_light l = light_with_area(&m, i);
        l.frame = lum_frame_from_normal(lum_v3(0, 0, 1));
        m.snapshot.lights.lights = &l;
        struct lum_vec3 n = direction(2.0 * rng_unit(&r) - 1.0, 6.3 * rng_unit(&r));
        struct lum_vec3 p = lum_v3_mad(l.p, direction(2.0 * rng_unit(&r) - 1.0, 6.3 * rng_unit(&r)),
                                       (float)pow(10.0, 1.5 * rng_unit(&r) - 0.5));
        struct lum_vec2 u[LUM_LIGHT_WEIGHTS];
        for (uint32_t k = 0; k < LUM_LIGHT_WEIGHTS; k++)
            u[k] = (struct lum_vec2){(float)rng_unit(&r), (float)rng_unit(&r)};
        struct lum_light_view view;
        float weight[LUM_LIGHT_WEIGHTS];
        uint32_t asked = (uint32_t)rng_u64(&r) & 0xffff;
        lum_light_look(&m.snapshot, 0, p, &view);
        lum_light_view_weights(&view, n, u, asked, weight);
        for (uint32_t k = 0; k < LUM_LIGHT_WEIGHTS; k++) {
            struct lum_light_sample s = {.pdf_sa = 1.0f, .distance = 1.0f};
            bool got = asked >> k & 1 && lum_light_view_sample(&view, u[k], &s);
            float expected = got ? lum_dot(s.wi, n) / s.pdf_sa : 0.0f;
            float limit = view.kind == LUM_VIEW_AREA ? 0x1p-20f * l.area / (s.distance * s.distance) : 0.0f;
            if (asked >> k & 1 && !(fabsf(weight[k] - expected) <= limit))
                fail_msg("case %d, sample %u: %.9g, not %.9g", i, k, (double)weight[k], (double)expected);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(views_see_what_samples_see),
        cmocka_unit_test(weights_are_those_of_samples),
        cmocka_unit_test(quad_irradiance_is_lamberts),
        cmocka_unit_test(quad_irradiance_holds_at_grazing),
        cmocka_unit_test(disc_on_its_axis),
        cmocka_unit_test(sphere_is_as_if_a_point),
        cmocka_unit_test(constant_environment_gives_pi),
        cmocka_unit_test(spot_ramps_as_in_gltf),
        cmocka_unit_test(narrow_spots_keep_their_edge),
        cmocka_unit_test(flux_is_kept),
        cmocka_unit_test(quad_switches_without_a_step),
        cmocka_unit_test(tiny_lights_keep_their_light),
        cmocka_unit_test(nothing_reaches_from_behind_or_from_no_area),
        cmocka_unit_test(nothing_is_ever_not_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
