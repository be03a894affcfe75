/* Media in pictures of the path tracer: against closed forms, and where fog must not, or must not suddenly, change
 * anything. */
#include "tests/numeric/fog.h"
#include "tests/support/probe_at.h"

static void set_path(struct rig *r)
{
    r->settings.method = lum_method_find("path");
    r->settings.antialias = false;
}

/* The first of medium_test.c's values for a lamp in fog: a black wall ends the ray. */
static void airlight_in_a_picture(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    set_path(&r);
    fog_scatters_once(&r);
    fog_with_bulb(&r, 0.1f, 5, 0.3, 20);
    r.settings.max_spp = 0;
    for (int i = 0; i < 4096; i++) {
        struct lum_pass_stats s = rig_pass(&r);
        assert_int_equal(s.rays[LUM_RAY_MEDIA], 1);
        assert_int_equal(s.effects[LUM_EFFECT_MEDIA].rays, 1);
    }
    check_near("picture", (double)rig_mean(&r).g, 1000.0 * 0.00709172018, 1e-3);
    rig_end(&r);
}

/* A lit floor through a slab that only absorbs: no ray of the media, and exact but for a handful of roundings. */
static void absorbing_slab_in_a_picture(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    set_path(&r);
    rig_square(&r, "floor", 1);
    rig_diffuse_object(&r, "floor", "floor", 1.0f, rig_v(0, 0, 0));
    rig_bulb(&r, "bulb", rig_v(0, 4, 0), 100);
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

/* A white wall instead of the black one starts paths that scatter no more. */
static void airlight_in_a_mirror(void **state)
{
    (void)state;
    for (int white = 0; white < 2; white++) {
        struct rig r;
        rig_begin(&r, 0);
        set_path(&r);
        fog_scatters_once(&r);
        double want = fog_with_mirror(&r, 0.2, white ? 0.9f : 0.0f);
        r.settings.w = r.settings.h = 1;
        r.settings.max_spp = 0;
        for (int i = 0; i < 4096; i++) {
            struct lum_pass_stats s = rig_pass(&r);
            assert_int_equal(s.rays[LUM_RAY_MEDIA], 2);
            assert_true(s.rays[LUM_RAY_INDIRECT_DIFFUSE] == 0 || white);
        }
        if (!white)
            check_near("mirror", (double)rig_mean(&r).g, want, 1e-3);
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

/* NOTES H22, and (a), (d) of effects_test.c: a medium of no strength, one in a box elsewhere, and one that is switched
 * off are none. */
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

/* NOTES H24: the eye on either side of a face, and on it. A step of 1e-4 m in fog of 0.5 / m changes 5e-5 of the light.
 */
static void the_eye_crosses_a_face(void **state)
{
    (void)state;
    const double steps[] = {0, -1e-4, 1e-4, -1e-6, 1e-6};
    const struct lum_vec3d faces[] = {{0.25, 1.5, 2}, {0.25, 1.5, -2}, {2, 1.5, 0.25}};
    struct rig r;
    rig_begin(&r, 0);
    rig_bulb(&r, "bulb", rig_v(0.3, 1.2, 0.4), 60);
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
    struct lum_light_desc sky = {.kind = &lum_light_kind_environment,
                                 .color = lum_grey(1),
                                 .intensity = 1000,
                                 .on = true,
                                 .camera_visible = true};
    struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                 .direction = {0, -1, 0},
                                 .color = lum_grey(1),
                                 .intensity = 1e5,
                                 .on = true};
    rig_light(&r, "sky", &sky);
    rig_light(&r, "sun", &sun);
    struct lum_medium_desc fog = fog_everywhere(1e-3f, 0, 0);
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    set_path(&r);
    rig_camera(&r, rig_v(0, 0, 0), rig_v(0, 0, -1), 40);
    rig_pass(&r);
    assert_true(rig_mean(&r).g == 0.0f);
    rig_bulb(&r, "bulb", rig_v(1, 0, -3), 100);
    rig_commit(&r);
    rig_pass(&r);
    assert_true(rig_mean(&r).g > 0.0f);
    rig_end(&r);
}

/* NOTES H23: every strength, the eye in the middle, on a face, at the light itself. rig_pass asserts that no
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

/* The fog is in the shadow of a wall. */
static void walls_shade_the_fog(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    set_path(&r);
    rig_box(&r, "wall", 0.1, 4, 4);
    rig_diffuse_object(&r, "wall", "black", 0.0f, rig_v(1, 0, -2));
    rig_bulb(&r, "bulb", rig_v(1.5, 0, -2), 100);
    struct lum_medium_desc fog = fog_box(1, 0, rig_v(-0.5, -0.5, -2.5), rig_v(0.5, 0.5, -1.5));
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    rig_camera(&r, rig_v(0, 0, 0), rig_v(0, 0, -1), 10);
    struct lum_pass_stats s = rig_pass(&r);
    assert_true(s.rays[LUM_RAY_MEDIA] > 0);
    assert_true(rig_mean(&r).g == 0.0f);
    rig_end(&r);
}

/* The same scene larger by a power of two, its fog thinner and its lamp brighter by the square: bit for bit (NOTES H3).
 */
static void scale_does_not_matter(void **state)
{
    (void)state;
    const double scales[] = {1, 0x1p-16, 0x1p10};
    struct lum_rgb *first = NULL;
    for (size_t k = 0; k < LUM_ARRAY_LEN(scales); k++) {
        double s = scales[k];
        struct rig r;
        rig_begin(&r, 0);
        set_path(&r);
        rig_box(&r, "room", 2 * s, 1.5 * s, 2 * s);
        rig_diffuse_object(&r, "room", "white", 0.75f, rig_v(0, 0, 0));
        rig_bulb(&r, "bulb", rig_v(-1 * s, 0.75 * s, 0.5 * s), 100 * s * s);
        struct lum_medium_desc fog =
            fog_box((float)(0.25 / s), (float)(0.125 / s), rig_v(-s, -s, -s), rig_v(2 * s, s, s));
        put_fog(&r, "fog", &fog);
        rig_commit(&r);
        rig_camera(&r, rig_v(-0.25 * s, 0, 1.75 * s), rig_v(0.25 * s, -0.5 * s, -0.5 * s), 60);
        rig_pass(&r);
        if (first)
            rig_assert_picture(&r, first, "scaled");
        else
            first = rig_picture(&r);
        rig_end(&r);
    }
    lum_free(first);
}

/* A probe's light is dimmed; and what fog scatters lights it, as it lights the surface in a picture. */
static void probes_are_in_the_fog(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_bulb(&r, "bulb", rig_v(0, 2, 0), 100);
    rig_square(&r, "floor", 0.1);
    rig_diffuse_object(&r, "floor", "floor", 1.0f, rig_v(0, 0, 0));
    rig_camera(&r, rig_v(0, 0.4, 0), rig_v(0, 0, 0), 2); /* below the fog */
    set_path(&r);
    r.settings.w = r.settings.h = 1;
    r.settings.max_spp = 4096;
    for (int scatters = 0; scatters < 2; scatters++) {
        float sigma = scatters ? 0.25f : 0.0f;
        struct lum_medium_desc fog = fog_box(sigma, 0.5f - sigma, rig_v(-1, 0.5, -1), rig_v(1, 1.5, 1));
        put_fog(&r, "fog", &fog);
        rig_commit(&r);
        struct lum_probe p;
        uint64_t rays = 0;
        RIG_OK(probe_at(r.pool, r.snapshot, rig_v(0, 1e-3, 0), lum_v3(0, 1, 0), 4096, 1, &p, &rays, &err));
        while (!rig_pass(&r).complete)
            ;
        if (!scatters)
            check_near("probe", p.illuminance_lx, 25 * exp(-0.5), 2e-3); /* it is a millimetre nearer */
        else
            assert_true(p.illuminance_lx > 1.05 * 25 * exp(-0.5));
        /* a fifth of the light is by chance: 4096 samples, four standard errors */
        check_near("picture", (double)rig_mean(&r).g * PI, p.illuminance_lx, scatters ? 0.02 : 2e-3);
    }
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(airlight_in_a_picture),  cmocka_unit_test(absorbing_slab_in_a_picture),
        cmocka_unit_test(airlight_in_a_mirror),   cmocka_unit_test(no_medium_is_no_change),
        cmocka_unit_test(the_eye_crosses_a_face), cmocka_unit_test(infinite_fog_hides_what_is_infinitely_far),
        cmocka_unit_test(extremes_are_finite),    cmocka_unit_test(walls_shade_the_fog),
        cmocka_unit_test(scale_does_not_matter),  cmocka_unit_test(probes_are_in_the_fog),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
