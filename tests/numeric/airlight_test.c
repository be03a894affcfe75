/* Media in pictures of the method `live`, which scatter light once: against closed forms and the path tracer, at all
 * sizes, and where there are none. */
#include "tests/numeric/fog.h"

static void set_method(struct rig *r, const char *name)
{
    r->settings.method = lum_method_find(name);
    r->settings.antialias = false;
    r->settings.max_spp = 1;
    fog_scatters_once(r);
}

static double lamp_in_fog(float b, double d_light, double gamma, double d)
{
    struct rig r;
    rig_begin(&r, 0);
    set_method(&r, "live");
    fog_with_bulb(&r, b, d_light, gamma, d);
    struct lum_pass_stats s = rig_pass(&r);
    assert_int_equal(s.rays[LUM_RAY_MEDIA], 1);
    double seen = (double)rig_mean(&r).g;
    rig_end(&r);
    return seen;
}

/* NOTES H26: one ray, to see whether the lamp is hidden; its light is integrated without one. 5e-3: what six points of
 * Gauss and Legendre leave of an integrand that falls off within the last hundredth of its range (row 3: 2.5e-3; others
 * below 1e-3). The refinement to path tracing removes it. */
static void lamps_in_fog(void **state)
{
    (void)state;
    static const struct {
        float b;
        double d_light, gamma, d;
    } rows[] = {
        {0.1f, 5, 0.3, 20},  {0.1f, 5, 2.5, 20},    {0.02f, 5, 1, 20},
        {0.1f, 5, 1e-2, 10}, {0.05f, 10, 4e-4, 20}, {0.1f, 1, 1.5, 10},
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        double want = 1000 * sun_airlight((double)rows[i].b, rows[i].d_light, rows[i].gamma, rows[i].d);
        char what[64];
        snprintf(what, sizeof what, "row %zu", i);
        check_near(what, lamp_in_fog(rows[i].b, rows[i].d_light, rows[i].gamma, rows[i].d), want, 5e-3);
    }
}

/* NOTES H26, in a picture of a lamp in fog that is 10 m away, by all methods with fog. `path` and `live` draw by angle:
 * right to their noise from the pixel beside the lamp on. `ais` marches: a window of 3 x 3 pixels has 72 points 0.28 m
 * apart, which know the halo of a ray that passes at D = 0.6 m or more, three pixels, to coth(pi D / 0.28) - 1 = 2e-3.
 * But each pixel has points of its own, and what is near the lamp, as 1 / D^2, may fall to one that passes a diagonal
 * nearer or farther. Still nearer the window takes in the pixel of the lamp, where steps tell nothing of 1 / D: there
 * it is finite, and no more than a step that meets the lamp, 1 / (h / 2)^2 h, of the least h = 20 m / 648. */
static void a_lamp_seen_in_fog(void **state)
{
    (void)state;
    static const char *const names[] = {"ais", "ais-max", "live", "path"};
    enum { SIDE = 27, SPP = 64 };
    double wants[SIDE * SIDE] = {0};
    struct rig r;
    rig_begin(&r, 0);
    rig_box(&r, "wall", 30, 30, 0.5);
    rig_diffuse_object(&r, "wall", "black", 0.0f, rig_v(0, 0, -20.5));
    struct lum_medium_desc fog = fog_everywhere(0.05f, 0, 0);
    put_fog(&r, "fog", &fog);
    rig_bulb(&r, "bulb", rig_v(0, 0, -10), 1000);
    rig_commit(&r);
    rig_camera(&r, rig_v(0, 0, 0), rig_v(0, 0, -1), 30);
    r.settings.w = r.settings.h = SIDE;
    for (size_t m = 0; m < LUM_ARRAY_LEN(names); m++) {
        bool sampled = m == 3, marches = m < 2;
        set_method(&r, names[m]);
        r.settings.max_spp = sampled ? SPP : 1;
        rig_fresh_view(&r);
        while (!rig_pass(&r).complete)
            ;
        for (int i = 0; i < SIDE * SIDE; i++) {
            int x = i % SIDE - SIDE / 2, y = i / SIDE - SIDE / 2, away = abs(x) > abs(y) ? abs(x) : abs(y);
            double got = (double)lum_film_mean(lum_view_film(r.view), (uint32_t)(i % SIDE), (uint32_t)(i / SIDE)).g;
            if (away == 0 || y < 0 || x < 0) /* one quarter is as the others */
                continue;
            double angle = atan(sqrt(x * x + y * y) * 2 * tan(15 * PI / 180) / SIDE), h = 20.0 / 648;
            if (m == 0)
                wants[i] = 1000 * sun_airlight(0.05, 10, angle, 20 / cos(angle));
            double want = wants[i];
            double d = sqrt(x * x + y * y), near = d / (d - sqrt(2)), far = d / (d + sqrt(2));
            if (marches && away < 3)
                assert_true(got >= 0.0 && got <= 1000 * 0.05 / (4 * PI) * 4 / h);
            else if (marches)
                assert_true(got >= want * far * far * 0.99 && got <= want * near * near * 1.01);
            else
                check_near(names[m], got, want, sampled ? 4.0 / sqrt(SPP) : 0.01);
        }
    }
    rig_end(&r);
}

/* Behind the mirror points are drawn at random, 4 a pixel: over 32 x 32 pixels of one picture their mean, whose
 * standard error is below 0.5 %. */
static void fog_in_a_mirror(void **state)
{
    (void)state;
    static const char *const names[] = {"live", "ais-max"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(names); i++) {
        struct rig r;
        rig_begin(&r, 0);
        set_method(&r, names[i]);
        double want = fog_with_mirror(&r, 0.2, 0.0f);
        r.settings.w = r.settings.h = 32;
        rig_pass(&r);
        check_near(names[i], (double)rig_mean(&r).g, want, 1e-2);
        rig_end(&r);
    }
}

/* Lamps of every kind in a room with a table that throws shafts of shadow into the fog. */
static void foggy_room(struct rig *r)
{
    rig_room(r);
    struct lum_light_desc lamp = rig_quad(rig_v(0, 2.9, 0), rig_v(0.8, 0, 0), rig_v(0, 0, 0.8), 300);
    struct lum_light_desc bulb = rig_point(rig_v(-1, 2, 0.5), 60);
    struct lum_light_desc spot = rig_point(rig_v(1.2, 2.8, -0.5), 300);
    spot.kind = &lum_light_kind_spot;
    spot.direction = rig_v(-0.5, -1, 0);
    spot.inner_cone_rad = 0.2;
    spot.outer_cone_rad = 0.35;
    rig_light(r, "lamp", &lamp);
    rig_light(r, "bulb", &bulb);
    rig_light(r, "spot", &spot);
    rig_square(r, "table", 0.6);
    rig_object(r, "table", "table", "white", rig_v(0, 1.2, 0));
    rig_camera(r, rig_v(0.3, 1.5, 1.9), rig_v(0, 1.3, -1), 70);
}

static double mean_of(struct rig *r, const char *method, uint32_t spp)
{
    set_method(r, method);
    r->settings.max_spp = spp;
    while (!rig_pass(r).complete)
        ;
    return (double)rig_mean(r).g;
}

/* The fast frame has the energy of the path tracer's. Tolerance: live stops where a tile's error is 5 %, and the mean
 * over 24 tiles of the pattern and more has less; the path tracer's standard error is below 0.3 % (its halves differ by
 * that). Boxes, everywhere, forward and backward. */
static void energy_is_that_of_path_tracing(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    foggy_room(&r);
    r.settings.w = r.settings.h = 64;
    r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    fog_scatters_once(&r);
    struct lum_medium_desc fogs[] = {fog_everywhere(0.2f, 0.05f, 0.5f), fog_everywhere(0.1f, 0, -0.6f),
                                     fog_box(0.3f, 0, rig_v(-1, 0.2, -1), rig_v(1, 2, 1)), fog_everywhere(3, 0, 0)};
    for (size_t i = 0; i < LUM_ARRAY_LEN(fogs); i++) {
        put_fog(&r, "fog", &fogs[i]);
        rig_commit(&r);
        char what[64];
        snprintf(what, sizeof what, "energy in fog %zu", i);
        double want = mean_of(&r, "path", 128);
        check_near(what, mean_of(&r, "live", 1), want, 0.02);
    }
    rig_end(&r);
}

static struct lum_rgb *first_picture(struct rig *r, struct lum_pass_stats *ret_stats)
{
    rig_commit(r);
    rig_fresh_view(r);
    *ret_stats = rig_pass(r);
    return rig_picture(r);
}

/* NOTES H22, and (a), (d) of effects_test.c. */
static void no_medium_is_no_change(void **state)
{
    (void)state;
    struct rig r;
    struct lum_pass_stats s;
    rig_begin(&r, 0);
    foggy_room(&r);
    set_method(&r, "live");
    struct lum_rgb *clear = first_picture(&r, &s);
    assert_int_equal(s.rays[LUM_RAY_MEDIA], 0);
    assert_true(s.stage_ms[LUM_STAGE_MEDIA] == 0.0);
    struct lum_medium_desc fog = fog_box(1, 1, rig_v(5, 0, 0), rig_v(6, 1, 1)); /* outside of the room */
    put_fog(&r, "fog", &fog);
    lum_free(first_picture(&r, &s));
    rig_assert_picture(&r, clear, "elsewhere");
    assert_true(s.demand.on[LUM_EFFECT_MEDIA] && s.rays[LUM_RAY_MEDIA] == 0);
    fog = fog_everywhere(0.2f, 0.1f, 0.5f);
    put_fog(&r, "fog", &fog);
    lum_free(first_picture(&r, &s));
    assert_true(s.rays[LUM_RAY_MEDIA] > 0);
    r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_MEDIA);
    fog_scatters_once(&r);
    s = rig_pass(&r);
    assert_int_equal(s.rays[LUM_RAY_MEDIA], 0);
    rig_assert_picture(&r, clear, "switched off");
    lum_free(clear);
    rig_end(&r);
}

/* Another fog dims the same light: no shadow ray of any surface; and the picture is that of a new view. */
static void editing_fog_traces_fog_only(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    foggy_room(&r);
    set_method(&r, "live");
    r.settings.shadow_budget = 0; /* or what is known of soft shadows grows from frame to frame */
    r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    fog_scatters_once(&r);
    struct lum_medium_desc fog = fog_everywhere(0.2f, 0.1f, 0.5f);
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    rig_pass(&r);
    fog = fog_everywhere(0.4f, 0.1f, 0.25f);
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_true(s.rays[LUM_RAY_MEDIA] > 0);
    assert_int_equal(rig_all_rays(&s), s.rays[LUM_RAY_MEDIA]);
    struct lum_rgb *edited = rig_picture(&r);
    lum_free(first_picture(&r, &s));
    rig_assert_picture(&r, edited, "edited");
    lum_free(edited);
    rig_end(&r);
}

/* Sizes that no pattern divides; without a light; and the same bits for any number of threads. */
static void sizes_and_threads(void **state)
{
    (void)state;
    const uint32_t sizes[][2] = {{1, 1}, {1, 7}, {3, 1}, {5, 50}, {97, 49}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(sizes); i++) {
        struct lum_rgb *first = NULL;
        for (uint32_t threads = 1; threads <= 3; threads++) {
            struct rig r;
            rig_begin(&r, threads);
            foggy_room(&r);
            set_method(&r, "live");
            r.settings.w = sizes[i][0];
            r.settings.h = sizes[i][1];
            struct lum_medium_desc fog = fog_everywhere(0.2f, 0.1f, 0.5f);
            put_fog(&r, "fog", &fog);
            rig_commit(&r);
            assert_true(rig_pass(&r).rays[LUM_RAY_MEDIA] > 0);
            if (first)
                rig_assert_picture(&r, first, "threads");
            else
                first = rig_picture(&r);
            RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "lamp", &err));
            RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "bulb", &err));
            RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "spot", &err));
            rig_commit(&r);
            struct lum_pass_stats s = rig_pass(&r);
            assert_true(rig_mean(&r).g == 0.0f && s.rays[LUM_RAY_MEDIA] == 0);
            rig_end(&r);
        }
        lum_free(first);
    }
}

/* More lights than are kept apart: what they share is still all of the light. */
static void many_lights(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_room(&r);
    for (int i = 0; i < 20; i++) {
        char id[16];
        snprintf(id, sizeof id, "bulb-%02d", i);
        struct lum_light_desc bulb = rig_point(rig_v(-1.8 + 0.9 * (i % 5), 0.4 + 0.7 * (i / 5), -1), 10);
        rig_light(&r, id, &bulb);
    }
    struct lum_medium_desc fog = fog_everywhere(0.2f, 0, 0);
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    rig_camera(&r, rig_v(0.3, 1.5, 1.9), rig_v(0, 1.3, -1), 70);
    r.settings.w = r.settings.h = 64;
    r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    fog_scatters_once(&r);
    double want = mean_of(&r, "path", 256);
    check_near("20 lamps", mean_of(&r, "live", 1), want, 0.02);
    rig_end(&r);
}

/* H23, H24: every strength, the eye in the middle, on a face, at a light. rig_pass asserts that every value is finite.
 */
static void extremes_are_finite(void **state)
{
    (void)state;
    const float sigmas[] = {1e-30f, 1e-6f, 1.0f, 1e6f};
    const struct lum_vec3d eyes[] = {{0, 1, 1}, {0, 1, 2}, {-1, 2, 0.5}, {1.2, 2.8, -0.5}, {0, 1.0000001, 1e5}};
    struct rig r;
    rig_begin(&r, 0);
    foggy_room(&r);
    set_method(&r, "live");
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
                assert_true(lum_rgb_finite(rig_mean(&r)));
            }
        }
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lamps_in_fog),           cmocka_unit_test(a_lamp_seen_in_fog),
        cmocka_unit_test(fog_in_a_mirror),        cmocka_unit_test(energy_is_that_of_path_tracing),
        cmocka_unit_test(no_medium_is_no_change), cmocka_unit_test(editing_fog_traces_fog_only),
        cmocka_unit_test(sizes_and_threads),      cmocka_unit_test(many_lights),
        cmocka_unit_test(extremes_are_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
