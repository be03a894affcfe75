/* Pictures against closed forms: furnace, form factor, inverse square, energy through glass; the two methods against
 * each other; scale of the scene; probes. Tolerances are standard errors of the estimate, or rounding; each is derived
 * in place. */
#include "tests/support/probe_at.h"
#include "tests/support/rig.h"

static void set_method(struct rig *r, const char *name)
{
    r->settings.method = lum_method_find(name);
    assert_non_null(r->settings.method);
}

/* Renders n samples a pixel; returns the mean over the film and its standard error from pass means. */
static double mean_of_passes(struct rig *r, uint32_t n, double *ret_stderr)
{
    double before = 0.0, sum = 0.0, square = 0.0;
    r->settings.max_spp = n;
    for (uint32_t i = 1; i <= n; i++) {
        struct lum_pass_stats s = rig_pass(r);
        assert_int_equal(s.spp, i);
        double total = (double)rig_mean(r).g * i, pass = total - before;
        before = total;
        sum += pass;
        square += pass * pass;
    }
    double mean = sum / n;
    *ret_stderr = sqrt(fmax(0.0, square / n - mean * mean) / (n - 1));
    return mean;
}

/* Le everywhere and albedo rho everywhere: L = Le sum of rho^i, i = 0..k. */
static void furnace_series(void **state)
{
    (void)state;
    const float rho = 0.5f;
    const uint32_t depths[] = {0, 1, 2, 3, 7, 40};
    struct rig r;
    rig_begin(&r, 0);
    rig_furnace(&r, 1, rho, 0.5);
    rig_camera(&r, rig_v(0.2, 0.1, 0.3), rig_v(-0.5, -0.4, -1), 90);
    rig_commit(&r);
    set_method(&r, "path");
    for (size_t i = 0; i < LUM_ARRAY_LEN(depths); i++) {
        r.settings.max_depth = depths[i];
        double err, got = mean_of_passes(&r, 64, &err);
        double want = 0.5 * (1.0 - pow((double)rho, depths[i] + 1)) / (1.0 - (double)rho);
        /* four standard errors, and the rounding of float sums of up to 41 terms */
        double tolerance = 4.0 * err + 1e-5 * want;
        if (!(fabs(got - want) <= tolerance))
            fail_msg("%u segments: %.6f, closed form %.6f, tolerance %.6f", depths[i], got, want, tolerance);
        assert_true(err < 0.01 * want);
    }
    rig_end(&r);
}

/* Irradiance from a rectangle at a point, by Lambert's edge formula: E = L / 2 sum of angle_i (n . gamma_i). */
static double rectangle_irradiance(struct lum_vec3d p, const struct lum_vec3d corner[4], double radiance)
{
    double sum = 0.0;
    for (int i = 0; i < 4; i++) {
        const struct lum_vec3d *a = &corner[i], *b = &corner[(i + 1) % 4];
        double ax = a->x - p.x, ay = a->y - p.y, az = a->z - p.z, bx = b->x - p.x, by = b->y - p.y, bz = b->z - p.z;
        double la = sqrt(ax * ax + ay * ay + az * az), lb = sqrt(bx * bx + by * by + bz * bz);
        double cx = ay * bz - az * by, cy = az * bx - ax * bz, cz = ax * by - ay * bx;
        double lc = sqrt(cx * cx + cy * cy + cz * cz);
        sum += acos((ax * bx + ay * by + az * bz) / (la * lb)) * cy / lc; /* the plane's normal is +Y */
    }
    return 0.5 * radiance * fabs(sum);
}

static void quad_light_scene(struct rig *r)
{
    rig_square(r, "floor", 3);
    rig_diffuse_object(r, "floor", "floor", 1.0f, rig_v(0, 0, 0));
    struct lum_light_desc l = rig_quad(rig_v(0.3, 1, 0.1), rig_v(1, 0, 0), rig_v(0, 0, 1.5), 100);
    rig_light(r, "lamp", &l);
    rig_camera(r, rig_v(2, 2, 2), rig_v(0.8, 0, 0.7), 10);
    r->settings.w = r->settings.h = 16;
    r->settings.antialias = false;
    rig_commit(r);
}

/* The mean over the pixels' centres, each evaluated in closed form. Reflected L = E / pi with albedo 1. */
static double form_factor_mean(struct rig *r)
{
    const struct lum_vec3d corner[4] = {{-0.2, 1, -0.65}, {0.8, 1, -0.65}, {0.8, 1, 0.85}, {-0.2, 1, 0.85}};
    double sum = 0.0;
    for (uint32_t y = 0; y < r->settings.h; y++)
        for (uint32_t x = 0; x < r->settings.w; x++) {
            struct lum_pick pick;
            lum_pick_at(r->snapshot, &r->settings.camera, r->settings.w, r->settings.h, x + 0.5, y + 0.5, &pick);
            assert_true(pick.hit);
            assert_string_equal(pick.id, "floor");
            sum += rectangle_irradiance(pick.point_world, corner, 100.0) / 3.14159265358979323846;
        }
    return sum / ((double)r->settings.w * r->settings.h);
}

static void quad_light_equals_form_factor(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    quad_light_scene(&r);
    double want = form_factor_mean(&r), err;
    set_method(&r, "whitted");
    rig_pass(&r);
    double whitted = (double)rig_mean(&r).g;
    set_method(&r, "path");
    r.settings.max_depth = 1;
    double path = mean_of_passes(&r, 64, &err);
    if (!(fabs(whitted / want - 1.0) < 0.005))
        fail_msg("whitted %.6f, form factor %.6f", whitted, want);
    if (!(fabs(path / want - 1.0) < 0.005) || !(fabs(path - want) < 4.0 * err + 1e-5 * want))
        fail_msg("path %.6f +- %.6f, form factor %.6f", path, err, want);
    rig_end(&r);
}

static void point_light_falls_with_square(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    struct lum_material_desc m = rig_diffuse(1.0f);
    rig_material(&r, "floor", &m);
    rig_square(&r, "floor", 1);
    rig_object(&r, "floor", "floor", "floor", rig_v(0, 0, 0));
    rig_camera(&r, rig_v(0, 0.5, 0), rig_v(0, 0, 0), 2);
    r.settings.w = r.settings.h = 1;
    r.settings.antialias = false;
    r.settings.max_depth = 1;
    for (int k = 0; k < 8; k++) {
        double height = 0.75 * exp2(k);
        rig_bulb(&r, "bulb", rig_v(0, height, 0), 100);
        rig_commit(&r);
        double want = 100.0 / (height * height) / 3.14159265358979323846;
        const char *methods[] = {"whitted", "path"};
        for (int i = 0; i < 2; i++) {
            set_method(&r, methods[i]);
            rig_pass(&r);
            double got = (double)rig_mean(&r).g;
            /* exact but for the rounding of a handful of float operations; the centre of the film is the origin */
            if (!(fabs(got / want - 1.0) < 2e-6))
                fail_msg("%s at %g m: %.9g, expected %.9g", methods[i], height, got, want);
        }
    }
    rig_end(&r);
}

/* Direct light only, in a room with every kind of light: the methods must agree. */
static void methods_agree_on_direct_light(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_room(&r);
    struct lum_light_desc lamp = rig_quad(rig_v(0, 2.9, 0), rig_v(0.8, 0, 0), rig_v(0, 0, 0.8), 300);
    struct lum_light_desc bulb = rig_point(rig_v(-1, 2, 0.5), 60);
    struct lum_light_desc ball = {.kind = &lum_light_kind_sphere,
                                  .position = {1.2, 1.8, 0.3},
                                  .radius_m = 0.2,
                                  .color = lum_grey(1),
                                  .intensity = 200,
                                  .on = true,
                                  .camera_visible = true};
    struct lum_light_desc disc = {.kind = &lum_light_kind_disc,
                                  .position = {-1.9, 1.5, 0},
                                  .direction = {1, 0, 0},
                                  .radius_m = 0.3,
                                  .color = lum_grey(1),
                                  .intensity = 200,
                                  .on = true,
                                  .camera_visible = true};
    struct lum_material_desc glow = rig_diffuse(0.3f);
    glow.emission_cd_m2 = 150;
    rig_material(&r, "glow", &glow);
    rig_box(&r, "cube", 0.15, 0.15, 0.15);
    rig_object(&r, "glow", "cube", "glow", rig_v(-0.9, 0.4, -0.9));
    rig_light(&r, "lamp", &lamp);
    rig_light(&r, "bulb", &bulb);
    rig_light(&r, "ball", &ball);
    rig_light(&r, "disc", &disc);
    rig_commit(&r);
    r.settings.antialias = false;
    r.settings.max_depth = 1;
    set_method(&r, "whitted");
    /* the standard error of whitted, from independent seeds */
    double sum = 0.0, square = 0.0, err;
    const int n = 16;
    for (int i = 0; i < n; i++) {
        r.settings.seed = (uint32_t)i;
        rig_pass(&r);
        double v = (double)rig_mean(&r).g;
        sum += v;
        square += v * v;
    }
    double whitted = sum / n, whitted_err = sqrt(fmax(0.0, square / n - whitted * whitted) / (n - 1));
    set_method(&r, "path");
    double path = mean_of_passes(&r, 128, &err);
    double tolerance = 4.0 * sqrt(err * err + whitted_err * whitted_err);
    if (!(fabs(path - whitted) < tolerance) || !(tolerance < 0.02 * path))
        fail_msg("whitted %.5f +- %.5f, path %.5f +- %.5f", whitted, whitted_err, path, err);
    rig_end(&r);
}

/* A lamp seen in a mirror, and through a pane: no noise at all, so both methods give the closed form. */
static void mirror_and_pane(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    struct lum_material_desc mirror = lum_material_default(), pane = lum_material_default();
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    mirror.base_color = lum_rgb(0.9f, 0.5f, 0.25f);
    pane.transmission = 1.0f;
    pane.roughness = 0.0f;
    pane.thin = true;
    pane.ior = 1.0f; /* matched: nothing is reflected */
    pane.base_color = lum_grey(0.5f);
    rig_material(&r, "mirror", &mirror);
    rig_material(&r, "pane", &pane);
    rig_square(&r, "square", 1);
    rig_object(&r, "mirror", "square", "mirror", rig_v(0, 0, 0));
    rig_object(&r, "pane", "square", "pane", rig_v(0, 0.25, 0));
    struct lum_light_desc lamp = rig_quad(rig_v(0, 1, 0), rig_v(4, 0, 0), rig_v(0, 0, 4), 80);
    rig_light(&r, "lamp", &lamp);
    rig_camera(&r, rig_v(0.1, 0.5, 0.1), rig_v(0.1, 0, 0.1), 20);
    rig_commit(&r);
    r.settings.antialias = false;
    r.settings.w = r.settings.h = 8;
    const char *methods[] = {"whitted", "path"};
    for (int i = 0; i < 2; i++) {
        set_method(&r, methods[i]);
        r.settings.max_spp = 0;
        rig_pass(&r);
        struct lum_rgb m = rig_mean(&r);
        /* pane, mirror (its reflectance at normal incidence; Schlick adds at most (1 - cos 14 deg)^5 = 2e-8), pane */
        const double want[3] = {80 * 0.25 * 0.9, 80 * 0.25 * 0.5, 80 * 0.25 * 0.25};
        const double got[3] = {(double)m.r, (double)m.g, (double)m.b};
        for (int c = 0; c < 3; c++)
            if (!(fabs(got[c] / want[c] - 1.0) < 1e-5))
                fail_msg("%s channel %d: %.7g, expected %.7g", methods[i], c, got[c], want[c]);
    }
    rig_end(&r);
}

/* A ceiling in a mirror, lit by a lamp of which a box hides a part. */
static void begin_reflection(struct rig *r, float reflectance)
{
    struct lum_material_desc mirror = lum_material_default();
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    mirror.base_color = lum_grey(reflectance);
    rig_begin(r, 2);
    rig_material(r, "mirror", &mirror);
    rig_square(r, "floor", 4);
    rig_box(r, "ceiling", 4, 0.1, 4);
    rig_box(r, "shade", 0.5, 0.1, 0.5);
    rig_object(r, "floor", "floor", "mirror", rig_v(0, 0, 0));
    rig_diffuse_object(r, "ceiling", "white", 0.8f, rig_v(0, 3, 0));
    rig_diffuse_object(r, "shade", "black", 0.0f, rig_v(0, 2.3, 0));
    struct lum_light_desc lamp = rig_quad(rig_v(0, 1.5, 0), rig_v(0, 0, 1), rig_v(1, 0, 0), 100);
    rig_light(r, "lamp", &lamp);
    rig_camera(r, rig_v(0, 1, 1.5), rig_v(0, 0, 1), 30);
    rig_commit(r);
    r->settings.antialias = false;
    r->settings.effects_off = 1u << LUM_EFFECT_INDIRECT_DIFFUSE;
    r->settings.w = r->settings.h = 24;
    r->settings.max_spp = 1;
    set_method(r, "live");
}

/* A mirror that reflects a twentieth shows the same room a twentieth as bright, by 2 shadow rays of 16: on average over
 * draws, within four standard errors of their means. Schlick adds (1 - cos 40 deg)^5 = 7e-4 of a reflectance of 1. */
static void faint_reflections(void **state)
{
    (void)state;
    const float reflectance[] = {1.0f, 0.05f};
    const uint32_t draws = 16;
    double mean[2], error[2];
    uint64_t rays[2] = {0};
    for (int k = 0; k < 2; k++) {
        struct rig r;
        double sum = 0.0, squares = 0.0;
        begin_reflection(&r, reflectance[k]);
        for (uint32_t draw = 0; draw < draws; draw++) {
            r.settings.seed = draw;
            rig_fresh_view(&r);
            rays[k] += rig_pass(&r).rays[LUM_RAY_SOFT_SHADOW];
            double y = (double)(rig_mean(&r).g / reflectance[k]);
            sum += y / draws;
            squares += y * y / draws;
        }
        mean[k] = sum;
        error[k] = sqrt(fmax(squares - sum * sum, 0.0) / (draws - 1));
        rig_end(&r);
    }
    print_message("%.5f +- %.5f by %llu rays, faintly %.5f +- %.5f by %llu\n", mean[0], error[0],
                  (unsigned long long)rays[0], mean[1], error[1], (unsigned long long)rays[1]);
    double tolerance = 4.0 * hypot(error[0], error[1]) + 7e-4 / 0.05 * mean[0];
    assert_true(tolerance < 0.05 * mean[0]);
    assert_true(fabs(mean[1] - mean[0]) < tolerance);
    assert_true(rays[1] > 0 &&
                8 * rays[1] <= rays[0] + rays[0] / 100); /* where a sample meets no ceiling there is no ray */
}

/* The whole scene scaled by s, intensities in cd by s^2: the same picture; for powers of two bit for bit (NOTES H2,
 * H3). */
static void scale_does_not_matter(void **state)
{
    (void)state;
    const double scales[] = {1.0, 0x1p-20, 0x1p12, 1e-3, 1e3, 1e-6};
    struct lum_rgb *first = NULL;
    for (size_t k = 0; k < LUM_ARRAY_LEN(scales); k++) {
        double s = scales[k];
        struct rig r;
        rig_begin(&r, 2);
        struct lum_material_desc white = rig_diffuse(0.75f);
        rig_material(&r, "white", &white);
        rig_box(&r, "room", 2 * s, 1.5 * s, 2 * s);
        rig_box(&r, "crate", 0.4 * s, 0.5 * s, 0.4 * s);
        rig_object(&r, "room", "room", "white", rig_v(0, 0, 0));
        rig_object(&r, "crate", "crate", "white", rig_v(0.5 * s, -1.0 * s, -0.375 * s));
        struct lum_light_desc bulb = rig_point(rig_v(-1 * s, 0.75 * s, 0.5 * s), 100 * s * s);
        struct lum_light_desc lamp = rig_quad(rig_v(0, 1.25 * s, 0), rig_v(s, 0, 0), rig_v(0, 0, s), 100);
        rig_light(&r, "bulb", &bulb);
        rig_light(&r, "lamp", &lamp);
        rig_camera(&r, rig_v(-0.25 * s, 0, 1.75 * s), rig_v(0.25 * s, -0.5 * s, -0.5 * s), 60);
        rig_commit(&r);
        set_method(&r, "path");
        r.settings.max_depth = 3;
        rig_pass(&r);
        rig_pass(&r);
        if (!first)
            first = rig_picture(&r);
        int exponent;
        if (frexp(s, &exponent) == 0.5) {
            rig_assert_picture(&r, first, "scaled by a power of two");
        } else {
            /* Rounding moves a few hits across edges and roulettes; the mean stays within the noise of two samples */
            double sum = 0.0, change = 0.0;
            const struct lum_film *f = lum_view_film(r.view);
            for (uint32_t i = 0; i < f->w * f->h; i++) {
                struct lum_rgb c = lum_film_mean(f, i % f->w, i / f->w);
                sum += (double)first[i].g;
                change += fabs((double)(c.g - first[i].g)) > 1e-3 * (double)first[i].g;
            }
            assert_true(sum > 0.0);
            if (!(change < 0.02 * f->w * f->h))
                fail_msg("scaled by %g: %g pixels differ", s, change);
        }
        rig_end(&r);
    }
    lum_free(first);
}

/* Under a point light, and in a furnace where E = pi L. */
/* However it is cut, every number comes out the same. */
static void probe_in_slices(struct rig *r, const struct lum_probe *whole, uint64_t whole_rays)
{
    static const uint32_t slices[] = {1, 64, 1000, 20000};
    for (size_t i = 0; i < LUM_ARRAY_LEN(slices); i++) {
        struct lum_probing *g;
        struct lum_probe p;
        uint64_t rays;
        bool more = true;
        RIG_OK(lum_probing_create(r->snapshot, rig_v(0.1, 0.2, -0.3), lum_v3(0, 2, 0), 20000, 1, &g, &err));
        while (more)
            RIG_OK(lum_probing_go_on(g, r->pool, slices[i], &more, &err));
        lum_probing_result(g, &p, &rays);
        assert_true(p.illuminance_lx == whole->illuminance_lx && p.stderr_lx == whole->stderr_lx);
        assert_memory_equal(&p.irradiance, &whole->irradiance, sizeof p.irradiance);
        assert_int_equal(rays, whole_rays);
        lum_probing_destroy(g);
    }
}

static void probe_measures_illuminance(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_furnace(&r, 1, 0.5f, 10);
    rig_commit(&r);
    struct lum_probe p;
    uint64_t rays = 0;
    RIG_OK(probe_at(r.pool, r.snapshot, rig_v(0.1, 0.2, -0.3), lum_v3(0, 2, 0), 20000, 1, &p, &rays, &err));
    double want = 3.14159265358979323846 * 20.0;
    if (!(fabs(p.illuminance_lx - want) < 4.0 * p.stderr_lx) || !(p.stderr_lx < 0.01 * want))
        fail_msg("furnace: %.4f +- %.4f lx, closed form %.4f", p.illuminance_lx, p.stderr_lx, want);
    assert_true(rays > 20000);
    probe_in_slices(&r, &p, rays);

    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_OBJECT, "room", &err));
    rig_bulb(&r, "bulb", rig_v(0, 2, 0), 100);
    rig_commit(&r);
    RIG_OK(probe_at(r.pool, r.snapshot, rig_v(0, 0, 0), lum_v3(0, 1, 0), 100, 1, &p, &rays, &err));
    assert_true(fabs(p.illuminance_lx - 25.0) < 25.0 * 2e-6);
    assert_true(p.stderr_lx < 1e-4);
    struct lum_error err = {0};
    assert_int_equal(probe_at(r.pool, r.snapshot, rig_v(0, 0, 0), lum_v3(0, 0, 0), 100, 1, &p, &rays, &err),
                     LUM_ERR_INVALID);
    assert_string_equal(err.field, "normal");
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(furnace_series),
        cmocka_unit_test(quad_light_equals_form_factor),
        cmocka_unit_test(point_light_falls_with_square),
        cmocka_unit_test(methods_agree_on_direct_light),
        cmocka_unit_test(mirror_and_pane),
        cmocka_unit_test(faint_reflections),
        cmocka_unit_test(scale_does_not_matter),
        cmocka_unit_test(probe_measures_illuminance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
