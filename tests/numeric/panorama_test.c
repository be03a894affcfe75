/* Pictures all around: where directions are in them, closed forms of what they show, light at the eye by them and by
 * a meter, and that what a view keeps from one to the next changes no bit. */
#include "core/measure/sensor.h"
#include "core/method/method.h"
#include "core/pass/eye.h"
#include "tests/support/rig.h"

#define PI 3.14159265358979323846

static void look_around(struct rig *r, struct lum_vec3d from, struct lum_vec3d target, uint32_t h)
{
    rig_camera(r, from, target, 45);
    r->settings.camera.panorama = true;
    r->settings.w = 2 * h;
    r->settings.h = h;
}

static void set_method(struct rig *r, const char *name)
{
    r->settings.method = lum_method_find(name);
    assert_non_null(r->settings.method);
}

/* ---- directions ---- */

static struct lum_eye eye_of(struct lum_vec3d target, struct lum_vec3d up, uint32_t w, uint32_t h)
{
    const struct lum_camera c = {.target = target, .up = up, .vfov_deg = 45, .panorama = true};
    struct lum_eye eye;
    RIG_OK(lum_eye_init(&eye, &c, &(struct lum_normalisation){.scale = 1.0}, w, h, &err));
    return eye;
}

static void expect_direction(const struct lum_eye *eye, double x, double y, struct lum_vec3d want)
{
    struct lum_vec3 d = lum_eye_direction(eye, (float)x, (float)y);
    double off = hypot(hypot((double)d.x - want.x, (double)d.y - want.y), (double)d.z - want.z);
    if (!(off < 1e-6))
        fail_msg("through %g,%g: %g %g %g, expected %g %g %g", x, y, (double)d.x, (double)d.y, (double)d.z, want.x,
                 want.y, want.z);
}

/* Looking down at 45 degrees changes nothing: the horizon is level. Straight down, the picture's middle is where the
 * upper edge of a perspective would be. */
static void directions_are_where_they_belong(void **state)
{
    (void)state;
    const double s = sqrt(0.5);
    for (int tilt = -1; tilt <= 1; tilt++) {
        struct lum_eye eye = eye_of(rig_v(0, tilt, -1), rig_v(0, 2, 0), 200, 100);
        expect_direction(&eye, 100, 50, rig_v(0, 0, -1));
        expect_direction(&eye, 150, 50, rig_v(1, 0, 0));
        expect_direction(&eye, 50, 50, rig_v(-1, 0, 0));
        expect_direction(&eye, 0, 50, rig_v(0, 0, 1));
        expect_direction(&eye, 200, 50, rig_v(0, 0, 1));
        expect_direction(&eye, 100, 25, rig_v(0, s, -s));
        expect_direction(&eye, 150, 75, rig_v(s, -s, 0));
        expect_direction(&eye, 31, 0, rig_v(0, 1, 0));
        expect_direction(&eye, 77, 100, rig_v(0, -1, 0));
    }
    struct lum_eye on_its_side = eye_of(rig_v(0, -1, 0), rig_v(0, 0, -1), 200, 100);
    expect_direction(&on_its_side, 100, 50, rig_v(0, -1, 0));
    expect_direction(&on_its_side, 100, 0, rig_v(0, 0, -1));
    struct lum_eye along_up = eye_of(rig_v(0, -1, 0), rig_v(0, 1, 0), 200, 100);
    expect_direction(&along_up, 100, 0, rig_v(0, 1, 0));
}

static void pixels_of_points_are_those_of_their_rays(void **state)
{
    (void)state;
    const uint32_t w = 61, h = 37;
    struct lum_eye eye = eye_of(rig_v(1, -2, 3), rig_v(0.2, 1, 0), w, h);
    for (uint32_t i = 0; i < w * h; i++) {
        uint32_t x, y;
        struct lum_vec3 d = lum_eye_direction(&eye, (float)(i % w) + 0.5f, (float)(i / w) + 0.5f);
        assert_true(lum_eye_pixel(&eye, lum_v3_mad(eye.o, d, 0.1f + (float)i), &x, &y));
        assert_true(x == i % w && y == i / w);
    }
    uint32_t x, y;
    assert_false(lum_eye_pixel(&eye, eye.o, &x, &y));
}

/* ---- closed forms ---- */

static void expect_everywhere(const struct rig *r, double cd_m2)
{
    const struct lum_film *f = lum_view_film(r->view);
    for (uint32_t i = 0; i < f->w * f->h; i++) {
        double is = (double)lum_luminance(lum_film_mean(f, i % f->w, i / f->w));
        if (!(fabs(is - cd_m2) < 1e-5 * cd_m2))
            fail_msg("%s: pixel %u,%u is %g, all around is %g", r->settings.method->name, i % f->w, i / f->w, is,
                     cd_m2);
    }
}

/* A sky of one luminance; and the walls of a room that shine and reflect nothing. */
static void even_light_is_even(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (int room = 0; room < 2; room++) {
        struct rig r;
        rig_begin(&r, 1);
        const struct lum_light_desc sky = {.kind = &lum_light_kind_environment,
                                           .color = lum_grey(1),
                                           .intensity = 120,
                                           .on = true,
                                           .camera_visible = true};
        if (room)
            rig_furnace(&r, 1.0, 0.0f, 120);
        else
            rig_light(&r, "sky", &sky);
        rig_commit(&r);
        look_around(&r, rig_v(0.1, 0.2, 0.3), rig_v(1, 1, 1), 16);
        for (size_t i = 0; i < n; i++) {
            r.settings.method = &methods[i];
            rig_fresh_view(&r);
            rig_pass(&r);
            expect_everywhere(&r, 120);
        }
        rig_end(&r);
    }
}

/* A ball that shines, 3 m away, smaller than a pixel: that pixel shows it, and no other. */
static void lamps_are_at_their_pixel(void **state)
{
    (void)state;
    static const char *const names[] = {"whitted", "path", "live"};
    static const uint32_t at[][2] = {{40, 12}, {1, 16}, {62, 9}, {20, 22}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(at) * LUM_ARRAY_LEN(names); k++) {
        const uint32_t *pixel = at[k / LUM_ARRAY_LEN(names)];
        double azimuth = (pixel[0] + 0.5 - 32) / 32 * PI, elevation = (16 - pixel[1] - 0.5) / 32 * PI;
        struct rig r;
        rig_begin(&r, 1);
        const struct lum_light_desc ball = {.kind = &lum_light_kind_sphere,
                                            .position = rig_v(3 * cos(elevation) * sin(azimuth), 1 + 3 * sin(elevation),
                                                              -3 * cos(elevation) * cos(azimuth)),
                                            .radius_m = 0.09,
                                            .color = lum_grey(1),
                                            .intensity = 1000,
                                            .on = true,
                                            .camera_visible = true};
        rig_light(&r, "ball", &ball);
        rig_commit(&r);
        look_around(&r, rig_v(0, 1, 0), rig_v(0, 0.5, -1), 32);
        set_method(&r, names[k % LUM_ARRAY_LEN(names)]);
        r.settings.max_spp = 16;
        for (uint32_t i = 0; i < 16; i++)
            rig_pass(&r);
        const struct lum_film *f = lum_view_film(r.view);
        for (uint32_t i = 0; i < f->w * f->h; i++) {
            double is = (double)lum_luminance(lum_film_mean(f, i % f->w, i / f->w));
            bool here = i % f->w == pixel[0] && i / f->w == pixel[1];
            if (here ? !(is > 100.0) : !(is < 1.0))
                fail_msg("%s: a ball at %u,%u, and pixel %u,%u is %g", r.settings.method->name, pixel[0], pixel[1],
                         i % f->w, i / f->w, is);
        }
        rig_end(&r);
    }
}

/* ---- light at the eye ---- */

/* lx on a plane at the eye: the integral over the picture. */
static double received(const struct rig *r, const struct lum_eye *eye, struct lum_vec3 n)
{
    const struct lum_film *f = lum_view_film(r->view);
    double sum = 0.0;
    for (uint32_t i = 0; i < f->w * f->h; i++) {
        uint32_t x = i % f->w, y = i / f->w;
        double level = cos(((double)y + 0.5 - 0.5 * f->h) / f->h * PI), sr = 2 * PI * PI / (f->w * f->h) * level;
        float cosine = lum_dot(lum_eye_direction(eye, (float)x + 0.5f, (float)y + 0.5f), n);
        sum += (double)lum_luminance(lum_film_mean(f, x, y)) * sr * (double)lum_max(cosine, 0.0f);
    }
    return sum;
}

static double metered(const struct rig *r, struct lum_vec3d at, struct lum_vec3 n)
{
    const struct lum_meter_goal goal = {0.002, 0.1, 1u << 17};
    struct lum_sensor_result result;
    struct lum_sensor *s = NULL;
    bool more = true;
    RIG_OK(lum_sensor_create(&(struct lum_sensor_desc){.kind = LUM_SENSOR_POINT, .position = at, .normal = n}, 1, &s,
                             &err));
    lum_sensor_aim(s, r->snapshot);
    while (more)
        RIG_OK(lum_sensor_refine(s, r->pool, &goal, 4096, &more, &err));
    assert_true(lum_sensor_result(s, &result));
    lum_sensor_destroy(s);
    return result.mean.value;
}

/* A room under one panel. 4608 pixels of 32 paths, of which one is off by about three times its mean: 0.8 %; and the
 * panel's edges, in pixels of 4 degrees. */
static void light_at_the_eye_is_the_meters(void **state)
{
    (void)state;
    static const char *const names[] = {"path", "live"};
    static const struct lum_vec3 to[] = {{1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}, {0, 1, 0}};
    const struct lum_vec3d at = {-0.3, 1.4, 1.2};
    struct rig r;
    struct lum_eye eye;
    double want[LUM_ARRAY_LEN(to)];
    rig_begin(&r, 1);
    rig_room(&r);
    struct lum_light_desc panel = rig_quad(rig_v(0.4, 2.9, -0.4), rig_v(0.8, 0, 0), rig_v(0, 0, 0.8), 2000);
    rig_light(&r, "panel", &panel);
    rig_commit(&r);
    look_around(&r, at, rig_v(0.2, 0.9, -0.5), 48);
    r.settings.max_spp = 32;
    RIG_OK(lum_eye_init(&eye, &r.settings.camera, &r.snapshot->norm, r.settings.w, r.settings.h, &err));
    for (size_t i = 0; i < LUM_ARRAY_LEN(to); i++)
        want[i] = metered(&r, at, to[i]);
    for (size_t k = 0; k < LUM_ARRAY_LEN(names); k++) {
        set_method(&r, names[k]);
        rig_fresh_view(&r);
        for (uint32_t i = 0; i < r.settings.max_spp; i++)
            rig_pass(&r);
        for (size_t i = 0; i < LUM_ARRAY_LEN(to); i++) {
            double is = received(&r, &eye, to[i]);
            if (!(fabs(is - want[i]) < 0.02 * want[i]))
                fail_msg("%s, plane %zu: %g lx, the meter has %g", names[k], i, is, want[i]);
        }
    }
    rig_end(&r);
}

/* Under an even sky of L all around there are pi L on a plane that faces anywhere: in the picture but for what sums
 * over pixels of 180 / 64 degrees are off by. A lamp without an extent is in no picture: the meter has its I cos / r^2
 * more. */
static void an_even_sky_gives_pi_times_its_luminance(void **state)
{
    (void)state;
    static const struct lum_vec3 to[] = {{1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}, {0, 1, 0}, {0, -1, 0}};
    const struct lum_light_desc sky = {
        .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 10, .on = true, .camera_visible = true};
    for (int lamp = 0; lamp < 2; lamp++) {
        struct rig r;
        struct lum_eye eye;
        rig_begin(&r, 1);
        rig_square(&r, "crumb", 0.01);
        rig_diffuse_object(&r, "crumb", "black", 0.0f, rig_v(0, -90, 0));
        rig_light(&r, "sky", &sky);
        if (lamp)
            rig_bulb(&r, "bulb", rig_v(2, 1, -2), 100);
        rig_commit(&r);
        look_around(&r, rig_v(0, 0, 0), rig_v(1, 1, 1), 64);
        set_method(&r, "path");
        r.settings.max_spp = 1;
        RIG_OK(lum_eye_init(&eye, &r.settings.camera, &r.snapshot->norm, r.settings.w, r.settings.h, &err));
        rig_pass(&r);
        for (size_t i = 0; i < LUM_ARRAY_LEN(to); i++) {
            double bulb = lamp ? 100 * fmax(0.0, (double)lum_dot(to[i], lum_v3(2, 1, -2)) / 3.0) / 9.0 : 0.0;
            double shown = received(&r, &eye, to[i]), all = metered(&r, rig_v(0, 0, 0), to[i]);
            if (!(fabs(shown - 10 * PI) < 1e-3 * 10 * PI))
                fail_msg("plane %zu: %g lx, not pi times 10", i, shown);
            if (!(fabs(all - shown - bulb) < 0.01 * all))
                fail_msg("plane %zu: the meter has %g lx, the picture %g, the lamp gives %g", i, all, shown, bulb);
        }
        rig_end(&r);
    }
}

/* ---- from one picture to the next ---- */

static void put_crate(struct rig *r, double x)
{
    rig_object(r, "crate", "crate", "red", rig_v(x, 0.5, -0.4));
    rig_commit(r);
}

/* But for caches, whose records last. */
static void memory_changes_no_bit(void **state)
{
    (void)state;
    static const char *const names[] = {"whitted", "igi", "ais", "live"};
    for (size_t k = 0; k < LUM_ARRAY_LEN(names); k++) {
        struct rig r;
        rig_begin(&r, 1);
        rig_room(&r);
        rig_bulb(&r, "bulb", rig_v(0.5, 2.2, 0.5), 200);
        rig_commit(&r);
        look_around(&r, rig_v(-0.3, 1.4, 1.2), rig_v(0.2, 0.9, -0.5), 40);
        set_method(&r, names[k]);
        r.settings.max_spp = 1;
        r.settings.reproject_shadows = false;
        r.settings.effects_off = r.settings.method->cache ? LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE) : 0;
        rig_pass(&r);
        put_crate(&r, -0.6);
        rig_pass(&r);
        put_crate(&r, -0.6 - 0.01);
        rig_pass(&r);
        rig_assert_as_fresh(&r, names[k]);
        r.settings.camera.panorama = false;
        rig_pass(&r);
        rig_assert_as_fresh(&r, "as a perspective");
        rig_end(&r);
    }
}

/* Sizes that no block divides: the rough picture shows the full one, not a part of it. */
static void rough_pictures_are_all_around(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_room(&r);
    rig_bulb(&r, "bulb", rig_v(0.5, 2.2, 0.5), 200);
    rig_commit(&r);
    look_around(&r, rig_v(-0.3, 1.4, 1.2), rig_v(0.2, 0.9, -0.5), 79);
    r.settings.w = 161;
    set_method(&r, "whitted");
    r.settings.preview = 4;
    rig_pass(&r);
    struct lum_rgb *rough = rig_picture(&r);
    rig_pass(&r);
    double off = 0.0;
    for (uint32_t i = 0; i < r.settings.w * r.settings.h; i++)
        off += fabs((double)lum_luminance(lum_film_mean(lum_view_film(r.view), i % r.settings.w, i / r.settings.w)) -
                    (double)lum_luminance(rough[i]));
    off /= r.settings.w * r.settings.h * (double)lum_luminance(rig_mean(&r));
    if (!(off > 0.0 && off < 0.05))
        fail_msg("the rough picture is off by %g", off);
    lum_free(rough);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(directions_are_where_they_belong),
        cmocka_unit_test(pixels_of_points_are_those_of_their_rays),
        cmocka_unit_test(even_light_is_even),
        cmocka_unit_test(lamps_are_at_their_pixel),
        cmocka_unit_test(light_at_the_eye_is_the_meters),
        cmocka_unit_test(an_even_sky_gives_pi_times_its_luminance),
        cmocka_unit_test(memory_changes_no_bit),
        cmocka_unit_test(rough_pictures_are_all_around),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
