/* Media against closed forms: Beer and Lambert, the airlight of Sun et al. 2005, the phase function's integrals; the
 * samplers against their pdfs; and pictures in which fog must not, or must not suddenly, change anything. */
#include "tests/support/rig.h"

#include "core/math/sampler.h"
#include "tests/numeric/stats.h"

#define PI 3.14159265358979323846

static void set_path(struct rig *r)
{
    r->settings.method = lum_method_find("path");
    r->settings.antialias = false;
}

static struct lum_medium_desc fog_everywhere(float sigma_s, float sigma_a, float g)
{
    return (struct lum_medium_desc){
        .sigma_s = lum_grey(sigma_s), .sigma_a = lum_grey(sigma_a), .g = g, .everywhere = true};
}

static struct lum_medium_desc fog_box(float sigma_s, float sigma_a, struct lum_vec3d lo, struct lum_vec3d hi)
{
    return (struct lum_medium_desc){.sigma_s = lum_grey(sigma_s), .sigma_a = lum_grey(sigma_a), .lo = lo, .hi = hi};
}

static void put_fog(struct rig *r, const char *id, const struct lum_medium_desc *m)
{
    RIG_OK(lum_scene_put_medium(r->scene, id, m, &err));
}

/* ---- the phase function ---- */

/* Simpson's rule in s with 1 - c = 2 s^4 on the side of the lobe, which spreads its peak (width 1e-4 at g = 0.99) over
 * the interval. float rounds p to 1e-6. */
static void phase_is_normalised(void **state)
{
    (void)state;
    const float gs[] = {-0.99f, -0.9f, -0.5f, -0.1f, 0.0f, 0.1f, 0.5f, 0.9f, 0.99f};
    const int n = 20000;
    for (size_t k = 0; k < LUM_ARRAY_LEN(gs); k++) {
        double sum = 0.0, mean = 0.0, side = gs[k] < 0.0f ? -1.0 : 1.0;
        for (int i = 0; i <= n; i++) {
            double s = (double)i / n, c = side * (1.0 - 2.0 * s * s * s * s), dc = 8.0 * s * s * s;
            double w = (i == 0 || i == n ? 1.0 : i % 2 ? 4.0 : 2.0) / (3.0 * n);
            double p = 2.0 * PI * (double)lum_phase_hg(gs[k], (float)c) * dc * w;
            sum += p;
            mean += p * c;
        }
        if (!(fabs(sum - 1.0) < 1e-4) || !(fabs(mean - (double)gs[k]) < 1e-4))
            fail_msg("g = %g: integral %.7f, mean cosine %.7f", (double)gs[k], sum, mean);
    }
    /* forward is forward, and rounded cosines beyond 1 do no harm */
    assert_true(lum_phase_hg(0.5f, 1.0f) > lum_phase_hg(0.5f, -1.0f));
    assert_true(lum_phase_hg(0.99f, 1.0000001f) == lum_phase_hg(0.99f, 1.0f));
}

/* ---- transmittance ---- */

/* A snapshot with nothing but media. */
static struct lum_snapshot bare(const struct lum_medium *media, uint32_t n)
{
    return (struct lum_snapshot){.media = media, .n_media = n};
}

static void beer_lambert(void **state)
{
    (void)state;
    const struct lum_medium slab = {
        .lo = {-1, -2, 3}, .hi = {1, 2, 7}, .sigma_s = {0.25f, 0.5f, 0}, .sigma_t = {0.5f, 0.5f, 0}};
    struct lum_snapshot s = bare(&slab, 1);
    const struct {
        struct lum_vec3 o, d;
        float tmax;
        double depth; /* of length */
    } rays[] = {
        {{0, 0, 0}, {0, 0, 1}, INFINITY, 4},         {{0, 0, 0}, {0, 0, 1}, 5, 2},
        {{0, 0, 5}, {0, 0, -1}, INFINITY, 2},        {{0, 0, 5}, {0, -1, 0}, INFINITY, 2},
        {{0, 0, 0}, {0, 0, -1}, INFINITY, 0},        {{0, 0, 0}, {0, 0, 1}, 3, 0},
        {{1, 0, 0}, {0, 0, 1}, INFINITY, 0}, /* along a face: only touches */
        {{-1, 0, 5}, {1, 0, 0}, INFINITY, 2},        {{-1, 0, 5}, {-1, 0, 0}, INFINITY, 0},
        {{0, 0, 0}, {0.6f, 0, 0.8f}, INFINITY, 0},   {{-2, 0, 4}, {0.8f, 0, 0.6f}, INFINITY, 2.5},
        {{0, 0, 0}, {0x1p-140f, 0, 1}, INFINITY, 4}, /* a denormal */
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(rays); i++) {
        struct lum_rgb t = lum_media_transmittance(&s, rays[i].o, rays[i].d, rays[i].tmax);
        /* float rounding of the depth (2 ulps) and of exp */
        if (!(fabs((double)t.r - exp(-0.5 * rays[i].depth)) < 4e-7) || t.b != 1.0f)
            fail_msg("ray %zu: %.8g %.8g, depth %g", i, (double)t.r, (double)t.b, rays[i].depth);
    }
}

static void extreme_depths(void **state)
{
    (void)state;
    struct lum_vec3 o = {0, 0, 0}, d = {0, 0, 1};
    struct lum_medium m = {.lo = {-INFINITY, -INFINITY, -INFINITY}, .hi = {INFINITY, INFINITY, INFINITY}};
    m.sigma_t = lum_rgb(1e30f, 0.0f, 1e-30f);
    struct lum_snapshot s = bare(&m, 1);
    struct lum_rgb t = lum_media_transmittance(&s, o, d, 1e20f);
    assert_true(t.r == 0.0f && t.g == 1.0f && t.b == 1.0f);
    t = lum_media_transmittance(&s, o, d, INFINITY);
    assert_true(t.r == 0.0f && t.g == 1.0f && t.b == 0.0f);
    t = lum_media_transmittance(&s, o, d, 0.0f);
    assert_true(t.r == 1.0f && t.g == 1.0f && t.b == 1.0f);
    s.n_media = 0;
    t = lum_media_transmittance(&s, o, d, INFINITY);
    assert_true(t.r == 1.0f);
}

/* Boxes that overlap everywhere are one of the summed coefficients: rounding of sums of two terms. */
static void overlapping_boxes_add_up(void **state)
{
    (void)state;
    const struct lum_medium two[2] = {{.lo = {-1, -1, -1}, .hi = {1, 1, 1}, .sigma_t = {0.25f, 0.5f, 1}},
                                      {.lo = {-1, -1, -1}, .hi = {1, 1, 1}, .sigma_t = {0.5f, 0.5f, 0.125f}}};
    const struct lum_medium one = {.lo = {-1, -1, -1}, .hi = {1, 1, 1}, .sigma_t = {0.75f, 1, 1.125f}};
    struct lum_snapshot a = bare(two, 2), b = bare(&one, 1);
    struct rng rng = {1};
    for (int i = 0; i < 1000; i++) {
        float v[6];
        for (int k = 0; k < 6; k++)
            v[k] = (float)(4.0 * rng_unit(&rng) - 2.0);
        struct lum_vec3 o = {v[0], v[1], v[2]}, d = lum_normalize(lum_v3(v[3], v[4], v[5]));
        struct lum_rgb x = lum_media_transmittance(&a, o, d, INFINITY), y = lum_media_transmittance(&b, o, d, INFINITY);
        assert_true(fabsf(x.r - y.r) < 1e-6f && fabsf(x.g - y.g) < 1e-6f && fabsf(x.b - y.b) < 1e-6f);
    }
}

/* ---- samplers ---- */

/* Each cell of the cumulative distribution gets its share. The pdf is integrated by the midpoint rule, 64 steps a cell.
 */
static void check_sampler(const char *name, double (*sample)(const void *, float), double (*pdf)(const void *, double),
                          const void *how, double t0, double t1)
{
    enum { CELLS = 64, STEPS = 64, N = 1 << 16 };
    struct chi2_cell cells[CELLS];
    double total = 0.0, width = (t1 - t0) / CELLS;
    for (int c = 0; c < CELLS; c++) {
        double sum = 0.0;
        for (int k = 0; k < STEPS; k++)
            sum += pdf(how, t0 + width * (c + (k + 0.5) / STEPS)) * width / STEPS;
        cells[c] = (struct chi2_cell){sum * N, 0.0};
        total += sum;
    }
    if (!(fabs(total - 1.0) < 2e-3))
        fail_msg("%s: the pdf integrates to %.6f", name, total);
    struct rng rng = {7};
    for (int i = 0; i < N; i++) {
        double t = sample(how, (float)(rng_u64(&rng) >> 40) * 0x1p-24f);
        if (!(t >= t0 * (1.0 - 1e-6) - 1e-6 && t <= t1))
            fail_msg("%s: %.9g is not in %g to %g", name, t, t0, t1);
        int c = (int)((t - t0) / width);
        cells[c < 0 ? 0 : c < CELLS ? c : CELLS - 1].observed += 1.0;
    }
    double p = chi2_p_value(cells, CELLS);
    if (!(p > 1e-4)) /* one in a thousand runs with another seed, over the ten calls */
        fail_msg("%s: chi-squared p = %g", name, p);
}

static double sample_angle(const void *e, float u)
{
    return (double)lum_equiangular_sample(e, u);
}
static double pdf_angle(const void *e, double t)
{
    return (double)lum_equiangular_pdf(e, (float)t);
}
struct exponential {
    float sigma, length;
};
static double sample_exponential(const void *e, float u)
{
    const struct exponential *x = e;
    return (double)lum_exponential_sample(x->sigma, x->length, u);
}
static double pdf_exponential(const void *e, double t)
{
    const struct exponential *x = e;
    return (double)lum_exponential_pdf(x->sigma, x->length, (float)t);
}

static void samplers_match_their_pdfs(void **state)
{
    (void)state;
    const struct {
        float t0, t1;
        struct lum_vec3 light; /* of a ray from the origin along +z */
    } angles[] = {
        {0, 10, {1, 0, 5}}, {0, 10, {0.5f, 0, -3}}, {2, 10, {0, 2, 15}}, {3, 4, {30, 0, 0}}, {0, 20, {0.3f, 0, 0}}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(angles); i++) {
        struct lum_segment s = {{0, 0, 0}, {0, 0, 1}, angles[i].t0, angles[i].t1};
        struct lum_equiangular e = lum_equiangular_init(&s, angles[i].light);
        check_sampler("by angle", sample_angle, pdf_angle, &e, (double)s.t0, (double)s.t1);
    }
    const struct exponential depths[] = {{0, 3}, {1e-35f, 3}, {1e-6f, 3}, {0.5f, 3}, {4, 3}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(depths); i++)
        check_sampler("exponential", sample_exponential, pdf_exponential, &depths[i], 0, (double)depths[i].length);
}

/* ---- airlight ---- */

/* Sun et al. 2005, for intensity 1 and isotropic scattering: from a light at distance d_light, at angle gamma from a
 * ray of length d, in a medium that only scatters. F by Simpson's rule: its integrand is smooth, also at pi / 2. */
static double sun_f(double u, double v)
{
    const int n = 20000;
    double sum = 0.0;
    for (int i = 0; i <= n; i++)
        sum += (i == 0 || i == n ? 1.0 : i % 2 ? 4.0 : 2.0) * exp(-u * tan(v * i / n));
    return sum * v / (3.0 * n);
}

static double sun_airlight(double b, double d_light, double gamma, double d)
{
    double a1 = b * d_light * sin(gamma), a0 = b * exp(-b * d_light * cos(gamma)) / (2 * PI * d_light * sin(gamma));
    double v = PI / 4 + 0.5 * atan((d - d_light * cos(gamma)) / (d_light * sin(gamma)));
    return a0 * (sun_f(a1, v) - sun_f(a1, gamma / 2));
}

/* A scene of one point light of 1 cd and infinite fog. Nothing has a surface, so a scene unit is a metre. */
static void airlight_scene(struct rig *r, double b, double d_light, double gamma)
{
    struct lum_medium_desc fog = fog_everywhere((float)b, 0, 0);
    struct lum_light_desc bulb = rig_point(rig_v(d_light * sin(gamma), 0, -d_light * cos(gamma)), 1);
    put_fog(r, "fog", &fog);
    rig_light(r, "bulb", &bulb);
    rig_commit(r);
    assert_true(r->snapshot->norm.scale == 1.0);
}

/* Mean over n points of a Sobol sequence of what medium and light 0 scatter into the ray from the world's origin along
 * -z, tmax metres long. */
static struct lum_rgb scatter_mean(const struct rig *r, uint32_t medium, double tmax, uint32_t n)
{
    const struct lum_normalisation *norm = &r->snapshot->norm;
    struct lum_scatter_query q = {.snapshot = r->snapshot, .medium = medium, .d = {0, 0, -1}};
    q.o = lum_v3((float)(-norm->centre.x * norm->scale), (float)(-norm->centre.y * norm->scale),
                 (float)(-norm->centre.z * norm->scale));
    q.tmax = (float)(tmax * norm->scale);
    double sum[3] = {0};
    for (uint32_t i = 0; i < n; i++) {
        struct lum_sampler sampler = lum_sampler_at(0, 0, i, 1);
        struct lum_scatter s;
        if (!lum_medium_scatter(&q, lum_sampler_2d(&sampler, 0), lum_sampler_2d(&sampler, 1), &s))
            continue;
        assert_true(lum_rgb_finite(s.radiance));
        sum[0] += (double)s.radiance.r;
        sum[1] += (double)s.radiance.g;
        sum[2] += (double)s.radiance.b;
    }
    return lum_rgb((float)(sum[0] / n), (float)(sum[1] / n), (float)(sum[2] / n));
}

static void check_near(const char *what, double got, double want, double tolerance)
{
    if (!(fabs(got - want) <= tolerance * fabs(want)))
        fail_msg("%s: %.9g, closed form %.9g, tolerance %g", what, got, want, tolerance);
}

static void airlight_of_a_point_light(void **state)
{
    (void)state;
    /* the closed form's values as published with it (algorithms D), and ours beside them */
    const struct {
        double b, d_light, gamma, d, published;
    } rows[] = {{0.1, 5, 0.3, 20, 0.00709172018}, {1, 2, 0.1, 5, 0.118495746}, {0.01, 10, 1.2, 30, 1.10365695e-4}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        struct rig r;
        rig_begin(&r, 0);
        airlight_scene(&r, rows[i].b, rows[i].d_light, rows[i].gamma);
        double want = sun_airlight(rows[i].b, rows[i].d_light, rows[i].gamma, rows[i].d);
        assert_true(fabs(want / rows[i].published - 1.0) < 1e-8);
        double got = (double)scatter_mean(&r, 0, rows[i].d, 1u << 14).g;
        check_near("airlight", got, want, 1e-3); /* Sobol points in two dimensions, a bounded integrand: about 1e-4 */
        rig_end(&r);
    }
}

/* D26: the light is next to the ray, at 1e-2 to 1e-5 of its length. */
static void halo_is_exact(void **state)
{
    (void)state;
    const double ratios[] = {1e-2, 1e-3, 1e-4, 1e-5};
    for (size_t i = 0; i < LUM_ARRAY_LEN(ratios); i++) {
        double length = 16, gamma = atan(ratios[i] * length / 8.0), d_light = 8.0 / cos(gamma);
        struct rig r;
        rig_begin(&r, 0);
        airlight_scene(&r, 0.05, d_light, gamma);
        double want = sun_airlight(0.05, d_light, gamma, length);
        double got = (double)scatter_mean(&r, 0, length, 1u << 16).g;
        /* at 1e-5 the light is 1.6e-4 from the ray, and points on the ray are 1e-6 apart: 1/r^2 is known to 1e-2 */
        double tolerance = ratios[i] < 1e-4 ? 1e-2 : 1e-3;
        check_near("halo", got, want, tolerance);
        rig_end(&r);
    }
}

/* The same through a picture: a black wall ends the ray. */
static void airlight_in_a_picture(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    set_path(&r);
    struct lum_material_desc black = rig_diffuse(0.0f);
    rig_material(&r, "black", &black);
    rig_box(&r, "wall", 8, 8, 0.5);
    rig_object(&r, "wall", "wall", "black", rig_v(0, 0, -20.5));
    struct lum_medium_desc fog = fog_everywhere(0.1f, 0, 0);
    struct lum_light_desc bulb = rig_point(rig_v(5 * sin(0.3), 0, -5 * cos(0.3)), 1000);
    put_fog(&r, "fog", &fog);
    rig_light(&r, "bulb", &bulb);
    rig_commit(&r);
    rig_camera(&r, rig_v(0, 0, 0), rig_v(0, 0, -1), 1);
    r.settings.w = r.settings.h = 1;
    r.settings.max_spp = 0;
    for (int i = 0; i < 4096; i++) {
        struct lum_pass_stats s = rig_pass(&r);
        assert_int_equal(s.rays[LUM_RAY_MEDIA], 1);
        assert_int_equal(s.effects[LUM_EFFECT_MEDIA].rays, 1);
    }
    check_near("picture", (double)rig_mean(&r).g, 1000.0 * 0.00709172018, 1e-3);
    rig_end(&r);
}

/* A small sphere of luminance L shines as a point of L pi r^2; but its surface is nearer than its centre, by 2 r / 3 on
 * the average, so that fog of 0.1 / m takes 3e-4 less. */
static void airlight_of_a_small_sphere(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    const double radius = 0.005;
    struct lum_medium_desc fog = fog_everywhere(0.1f, 0, 0);
    struct lum_light_desc ball = {.kind = LUM_LIGHT_SPHERE,
                                  .position = {5 * sin(0.3), 0, -5 * cos(0.3)},
                                  .radius_m = radius,
                                  .color = lum_grey(1),
                                  .intensity = 1 / (PI * radius * radius),
                                  .on = true};
    put_fog(&r, "fog", &fog);
    rig_light(&r, "ball", &ball);
    rig_commit(&r);
    assert_true(r.snapshot->norm.scale > 1.0);
    check_near("sphere", (double)scatter_mean(&r, 0, 20, 1u << 16).g, 0.00709172018, 1e-3);
    rig_end(&r);
}

/* Sun along the line of sight, from behind the eye and from ahead, into a slab 2 m thick: with tau = sigma_t h,
 *   from behind: L = sigma_s p(-1) E (1 - exp(-2 tau)) / (2 sigma_t), from ahead: L = sigma_s p(1) E h exp(-tau).
 * Different in every channel; and the lobe is on the right side. */
static void sun_in_a_slab(void **state)
{
    (void)state;
    const float s[3] = {0.5f, 0.0f, 2.0f}, a[3] = {0.25f, 1.0f, 0.0f}, g = 0.5f;
    for (int side = -1; side <= 1; side += 2) {
        struct rig r;
        rig_begin(&r, 0);
        struct lum_medium_desc fog = fog_box(0, 0, rig_v(-4, -4, -3), rig_v(4, 4, -1));
        fog.sigma_s = lum_rgb(s[0], s[1], s[2]);
        fog.sigma_a = lum_rgb(a[0], a[1], a[2]);
        fog.g = g;
        struct lum_light_desc sun = {.kind = LUM_LIGHT_DIRECTIONAL,
                                     .direction = {0, 0, side},
                                     .color = lum_grey(1),
                                     .intensity = 1000,
                                     .on = true};
        put_fog(&r, "fog", &fog);
        rig_light(&r, "sun", &sun);
        rig_commit(&r);
        struct lum_rgb mean = scatter_mean(&r, 0, (double)INFINITY, 1u << 14);
        const double got[3] = {(double)mean.r, (double)mean.g, (double)mean.b};
        for (int c = 0; c < 3; c++) {
            double sigma_s = (double)s[c], sigma = sigma_s + (double)a[c], gd = (double)g;
            double p = (1 - gd * gd) / (4 * PI * pow(1 + gd * gd - 2 * gd * side, 1.5));
            double path = side < 0 ? (1 - exp(-2 * sigma * 2)) / (2 * sigma) : 2 * exp(-sigma * 2);
            check_near(side < 0 ? "sun behind" : "sun ahead", got[c], sigma_s * p * 1000 * path, 1e-3);
        }
        rig_end(&r);
    }
}

/* ---- pictures ---- */

/* A lit floor through a slab that only absorbs: no ray of the media, and exact but for a handful of roundings. */
static void absorbing_slab_in_a_picture(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    set_path(&r);
    struct lum_material_desc m = rig_diffuse(1.0f);
    rig_material(&r, "floor", &m);
    rig_square(&r, "floor", 1);
    rig_object(&r, "floor", "floor", "floor", rig_v(0, 0, 0));
    struct lum_light_desc bulb = rig_point(rig_v(0, 4, 0), 100);
    rig_light(&r, "bulb", &bulb);
    struct lum_medium_desc slab = fog_box(0, 0.5f, rig_v(-2, 0.5, -2), rig_v(2, 1.5, 2));
    put_fog(&r, "slab", &slab);
    rig_commit(&r);
    rig_camera(&r, rig_v(0, 3, 0), rig_v(0, 0, 0), 2);
    r.settings.w = r.settings.h = 1;
    r.settings.max_depth = 1;
    struct lum_pass_stats s = rig_pass(&r);
    assert_true(s.demand.on[LUM_EFFECT_MEDIA]);
    assert_string_equal(s.demand.why[LUM_EFFECT_MEDIA], "slab absorbs light");
    assert_int_equal(s.rays[LUM_RAY_MEDIA], 0);
    check_near("slab", (double)rig_mean(&r).g, 100.0 / 16 / PI * exp(-0.5) * exp(-0.5), 4e-6);
    rig_end(&r);
}

/* Eye, mirror, wall: the fog of both segments is seen, the second one through the first. A white wall instead of the
 * black one starts paths that scatter no more. */
static void airlight_in_a_mirror(void **state)
{
    (void)state;
    const double b = 0.2, light = sqrt(10.0);
    for (int white = 0; white < 2; white++) {
        struct rig r;
        rig_begin(&r, 0);
        set_path(&r);
        struct lum_material_desc wall = rig_diffuse(white ? 0.9f : 0.0f), mirror = lum_material_default();
        mirror.metallic = 1.0f;
        mirror.roughness = 0.0f;
        rig_material(&r, "wall", &wall);
        rig_material(&r, "mirror", &mirror);
        rig_box(&r, "slab", 8, 8, 0.5);
        rig_object(&r, "wall", "slab", "wall", rig_v(0, 0, 10.5));
        rig_object(&r, "mirror", "slab", "mirror", rig_v(0, 0, -2.5));
        struct lum_medium_desc fog = fog_everywhere((float)b, 0, 0);
        struct lum_light_desc bulb = rig_point(rig_v(1, 0, 3), 1000);
        put_fog(&r, "fog", &fog);
        rig_light(&r, "bulb", &bulb);
        rig_commit(&r);
        rig_camera(&r, rig_v(0, 0, 0), rig_v(0, 0, -1), 1);
        r.settings.w = r.settings.h = 1;
        r.settings.max_spp = 0;
        for (int i = 0; i < 4096; i++) {
            struct lum_pass_stats s = rig_pass(&r);
            assert_int_equal(s.rays[LUM_RAY_MEDIA], 2);
            assert_true(s.rays[LUM_RAY_INDIRECT_DIFFUSE] == 0 || white);
        }
        double first = sun_airlight(b, light, acos(-3 / light), 2);
        double second = sun_airlight(b, sqrt(26.0), acos(5 / sqrt(26.0)), 12);
        if (!white)
            check_near("mirror", (double)rig_mean(&r).g, 1000 * (first + exp(-2 * b) * second), 1e-3);
        rig_end(&r);
    }
}

static void foggy_room(struct rig *r)
{
    rig_room(r);
    struct lum_light_desc lamp = rig_quad(rig_v(0, 2.9, 0), rig_v(0.8, 0, 0), rig_v(0, 0, 0.8), 300);
    struct lum_light_desc bulb = rig_point(rig_v(-1, 2, 0.5), 60);
    rig_light(r, "lamp", &lamp);
    rig_light(r, "bulb", &bulb);
    set_path(r);
}

static struct lum_rgb *first_picture(struct rig *r)
{
    rig_commit(r);
    rig_fresh_view(r);
    rig_pass(r);
    return rig_picture(r);
}

/* D22 and E.4 (a), (d): a medium of no strength, one in a box elsewhere, and one that is switched off are none. */
static void no_medium_is_no_change(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    foggy_room(&r);
    struct lum_rgb *clear = first_picture(&r);
    struct lum_medium_desc fog = fog_everywhere(0, 0, 0.5f);
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    rig_fresh_view(&r);
    struct lum_pass_stats s = rig_pass(&r);
    rig_assert_picture(&r, clear, "no coefficients");
    assert_true(!s.demand.on[LUM_EFFECT_MEDIA] && s.rays[LUM_RAY_MEDIA] == 0);
    assert_true(s.effects[LUM_EFFECT_MEDIA].tiles == 0 && s.effects[LUM_EFFECT_MEDIA].ns == 0);

    fog = fog_box(1, 1, rig_v(5, 0, 0), rig_v(6, 1, 1)); /* outside of the room */
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    rig_fresh_view(&r);
    s = rig_pass(&r);
    rig_assert_picture(&r, clear, "elsewhere");
    assert_true(s.demand.on[LUM_EFFECT_MEDIA] && s.rays[LUM_RAY_MEDIA] == 0);

    fog = fog_everywhere(0.2f, 0.1f, 0.5f);
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    rig_fresh_view(&r);
    s = rig_pass(&r);
    assert_true(s.rays[LUM_RAY_MEDIA] > 0);
    r.settings.effects_off = 1u << LUM_EFFECT_MEDIA;
    s = rig_pass(&r);
    assert_int_equal(s.rays[LUM_RAY_MEDIA], 0);
    rig_assert_picture(&r, clear, "switched off");
    lum_free(clear);
    rig_end(&r);
}

/* One box of the sums and two boxes in the same place: the same light. */
static void two_boxes_scatter_as_one(void **state)
{
    (void)state;
    double sum[2] = {0};
    for (int two = 0; two < 2; two++) {
        struct rig r;
        rig_begin(&r, 0);
        struct lum_light_desc bulb = rig_point(rig_v(1, 0.5, -2), 100);
        rig_light(&r, "bulb", &bulb);
        const struct lum_vec3d lo = {-1, -1, -4}, hi = {2, 1, -1};
        struct lum_medium_desc a = fog_box(0.75f, 0.5f, lo, hi), b = fog_box(0.25f, 0.125f, lo, hi);
        if (!two)
            a = fog_box(1.0f, 0.625f, lo, hi);
        put_fog(&r, "a", &a);
        if (two)
            put_fog(&r, "b", &b);
        rig_commit(&r);
        for (uint32_t m = 0; m < r.snapshot->n_media; m++)
            sum[two] += (double)scatter_mean(&r, m, (double)INFINITY, 1u << 14).g;
        rig_end(&r);
    }
    check_near("two boxes", sum[1], sum[0], 1e-3);
}

/* D24: the eye on either side of a face, and on it. A step of 1e-4 m in fog of 0.5 / m changes 5e-5 of the light. */
static void the_eye_crosses_a_face(void **state)
{
    (void)state;
    const double steps[] = {0, -1e-4, 1e-4, -1e-6, 1e-6};
    const struct lum_vec3d faces[] = {{0.25, 1.5, 2}, {0.25, 1.5, -2}, {2, 1.5, 0.25}};
    struct rig r;
    rig_begin(&r, 0);
    struct lum_light_desc bulb = rig_point(rig_v(0.3, 1.2, 0.4), 60);
    rig_light(&r, "bulb", &bulb);
    struct lum_medium_desc fog = fog_box(0.3f, 0.2f, rig_v(-2, 0, -2), rig_v(2, 3, 2));
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    set_path(&r);
    r.settings.w = r.settings.h = 8;
    r.settings.max_spp = 64;
    for (size_t f = 0; f < LUM_ARRAY_LEN(faces); f++) {
        double first = 0.0;
        for (size_t i = 0; i < LUM_ARRAY_LEN(steps); i++) {
            struct lum_vec3d at = faces[f];
            at.x += faces[f].x == 2 ? steps[i] : 0;
            at.z += faces[f].x == 2 ? 0 : steps[i];
            rig_camera(&r, at, rig_v(0, 1.4, 0), 50);
            while (!rig_pass(&r).complete)
                ;
            double mean = (double)rig_mean(&r).g;
            if (i == 0)
                first = mean;
            assert_true(mean > 0.0);
            check_near("across the face", mean, first, 1e-3);
        }
    }
    rig_end(&r);
}

/* Through infinite fog: no background, no sky, no sun; lamps nearby are seen. */
static void infinite_fog_hides_what_is_infinitely_far(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    struct lum_light_desc sky = {
        .kind = LUM_LIGHT_ENVIRONMENT, .color = lum_grey(1), .intensity = 1000, .on = true, .camera_visible = true};
    struct lum_light_desc sun = {
        .kind = LUM_LIGHT_DIRECTIONAL, .direction = {0, -1, 0}, .color = lum_grey(1), .intensity = 1e5, .on = true};
    rig_light(&r, "sky", &sky);
    rig_light(&r, "sun", &sun);
    struct lum_medium_desc fog = fog_everywhere(1e-3f, 0, 0);
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    set_path(&r);
    rig_camera(&r, rig_v(0, 0, 0), rig_v(0, 0, -1), 40);
    rig_pass(&r);
    assert_true(rig_mean(&r).g == 0.0f);
    struct lum_light_desc bulb = rig_point(rig_v(1, 0, -3), 100);
    rig_light(&r, "bulb", &bulb);
    rig_commit(&r);
    rig_pass(&r);
    assert_true(rig_mean(&r).g > 0.0f);
    rig_end(&r);
}

/* D23 and the like: every strength, the eye in the middle, on a face, at the light itself. rig_pass asserts that no
 * value is not finite and no ray is bad. */
static void extremes_are_finite(void **state)
{
    (void)state;
    const float sigmas[] = {1e-30f, 1e-6f, 1.0f, 1e6f};
    const struct lum_vec3d eyes[] = {{0, 1, 1}, {0, 1, 2}, {-1, 2, 0.5}, {0, 1.0000001, 1e5}};
    struct rig r;
    rig_begin(&r, 0);
    foggy_room(&r);
    for (size_t i = 0; i < LUM_ARRAY_LEN(sigmas); i++)
        for (int box = 0; box < 3; box++) {
            struct lum_medium_desc fog = fog_everywhere(sigmas[i], sigmas[i], -0.99f);
            fog.everywhere = box == 0;
            fog.lo = rig_v(-2, 0, -2);
            fog.hi = box == 1 ? rig_v(2, 3, 2) : rig_v(1e9, 1e9, 1e9);
            put_fog(&r, "fog", &fog);
            rig_commit(&r);
            for (size_t e = 0; e < LUM_ARRAY_LEN(eyes); e++) {
                r.settings.camera.position = eyes[e];
                rig_pass(&r);
                struct lum_rgb mean = rig_mean(&r);
                if (sigmas[i] >= 1e6f) /* nothing gets through a metre, and no light is nearer */
                    assert_true(mean.g == 0.0f || e == 2);
                assert_true(lum_rgb_finite(mean));
            }
        }
    rig_end(&r);
}

/* A probe's light is dimmed. */
static void probes_are_in_the_fog(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    struct lum_light_desc bulb = rig_point(rig_v(0, 2, 0), 100);
    rig_light(&r, "bulb", &bulb);
    struct lum_medium_desc fog = fog_box(0.25f, 0.25f, rig_v(-1, 0.5, -1), rig_v(1, 1.5, 1));
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    struct lum_probe p;
    uint64_t rays = 0;
    RIG_OK(lum_probe_at(r.pool, r.snapshot, rig_v(0, 0, 0), lum_v3(0, 1, 0), 100, 1, &p, &rays, &err));
    check_near("probe", p.illuminance_lx, 25 * exp(-0.5), 4e-6);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(phase_is_normalised),
        cmocka_unit_test(beer_lambert),
        cmocka_unit_test(extreme_depths),
        cmocka_unit_test(overlapping_boxes_add_up),
        cmocka_unit_test(samplers_match_their_pdfs),
        cmocka_unit_test(airlight_of_a_point_light),
        cmocka_unit_test(halo_is_exact),
        cmocka_unit_test(airlight_in_a_picture),
        cmocka_unit_test(airlight_of_a_small_sphere),
        cmocka_unit_test(sun_in_a_slab),
        cmocka_unit_test(absorbing_slab_in_a_picture),
        cmocka_unit_test(airlight_in_a_mirror),
        cmocka_unit_test(no_medium_is_no_change),
        cmocka_unit_test(two_boxes_scatter_as_one),
        cmocka_unit_test(the_eye_crosses_a_face),
        cmocka_unit_test(infinite_fog_hides_what_is_infinitely_far),
        cmocka_unit_test(extremes_are_finite),
        cmocka_unit_test(probes_are_in_the_fog),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
