/* Lights of `live` that are dimmed, recoloured and switched trace no ray: not on matte surfaces, not by way of glossy
 * ones, not in fog. */
#include "tests/numeric/fog.h"

static void put_lamp(struct rig *r, double power, bool on)
{
    struct lum_light_desc d = rig_quad(rig_v(0, 2.9, 0), rig_v(0.5, 0, 0), rig_v(0, 0, 0.5), 300 * power);
    d.on = on;
    rig_light(r, "lamp", &d);
}

static void put_bulb(struct rig *r, double power, bool on)
{
    struct lum_light_desc d = rig_point(rig_v(-1, 2, 0.5), 60 * power);
    d.on = on;
    rig_light(r, "bulb", &d);
}

/* A brushed crate between a lamp and a bulb, with or without fog around it. */
static void room(struct rig *r, bool fog)
{
    rig_begin(r, 0);
    rig_room(r);
    struct lum_material_desc brushed = rig_diffuse(0.8f);
    brushed.metallic = 1.0f;
    brushed.roughness = 0.4f;
    rig_material(r, "brushed", &brushed);
    rig_box(r, "crate", 0.5, 0.5, 0.5);
    rig_object(r, "crate", "crate", "brushed", rig_v(0.3, 0.5, -0.5));
    put_lamp(r, 1, true);
    put_bulb(r, 1, true);
    struct lum_medium_desc haze = fog_everywhere(0.2f, 0.1f, 0.5f);
    if (fog)
        put_fog(r, "fog", &haze);
    rig_camera(r, rig_v(0.3, 1.5, 1.9), rig_v(0, 1, -1), 70);
    r->settings.method = lum_method_find("live");
    r->settings.antialias = false; /* eye rays at edges are traced for every picture */
    r->settings.max_spp = 1;
    r->settings.shadow_budget = 0; /* or shadows learn more from frame to frame */
    r->settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    r->settings.w = 60;
    r->settings.h = 50;
}

static void pass_without_a_ray(struct rig *r, const char *what)
{
    rig_commit(r);
    struct lum_pass_stats s = rig_pass(r);
    if (rig_all_rays(&s) != 0)
        fail_msg("%s: %llu rays", what, (unsigned long long)rig_all_rays(&s));
}

/* Whatever happened to the lights in between, the same power gives the same bits. */
static void there_and_back(void **state)
{
    (void)state;
    for (int fog = 0; fog < 2; fog++) {
        struct rig r;
        room(&r, fog);
        rig_commit(&r);
        rig_pass(&r);
        struct lum_rgb *first = rig_picture(&r);
        put_lamp(&r, 0.1, true);
        pass_without_a_ray(&r, "lamp dimmed");
        put_bulb(&r, 1, false);
        pass_without_a_ray(&r, "bulb off");
        put_lamp(&r, 7, true);
        put_bulb(&r, 3, true);
        pass_without_a_ray(&r, "both brighter");
        put_lamp(&r, 7, false);
        pass_without_a_ray(&r, "the only soft light off");
        put_bulb(&r, 1, false);
        pass_without_a_ray(&r, "all off");
        assert_true(rig_mean(&r).g == 0.0f);
        put_lamp(&r, 1, true);
        put_bulb(&r, 1, true);
        pass_without_a_ray(&r, "all on");
        rig_assert_picture(&r, first, fog ? "fog, there and back" : "there and back");
        lum_free(first);
        rig_end(&r);
    }
}

/* Half the power of everything is no other decision anywhere, and halves every float: a new view makes the same bits.
 */
static void half_the_power_is_a_new_picture(void **state)
{
    (void)state;
    for (int fog = 0; fog < 2; fog++) {
        struct rig r;
        room(&r, fog);
        rig_commit(&r);
        rig_pass(&r);
        put_lamp(&r, 0.5, true);
        put_bulb(&r, 0.5, true);
        pass_without_a_ray(&r, "half");
        struct lum_rgb *relit = rig_picture(&r);
        rig_fresh_view(&r);
        rig_pass(&r);
        rig_assert_picture(&r, relit, "half");
        lum_free(relit);
        rig_end(&r);
    }
}

/* Nobody looked for a light that was dark: paths are traced anew, and find what a new view's find. */
static void first_light_is_looked_for(void **state)
{
    (void)state;
    struct rig r;
    room(&r, false);
    put_bulb(&r, 1, false);
    rig_commit(&r);
    rig_pass(&r);
    put_bulb(&r, 1, true);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_true(s.rays[LUM_RAY_DIRECT] > 0 && s.rays[LUM_RAY_GLOSSY] > 0);
    assert_int_equal(s.rays[LUM_RAY_PRIMARY], 0);
    struct lum_rgb *lit = rig_picture(&r);
    rig_fresh_view(&r);
    rig_pass(&r);
    rig_assert_picture(&r, lit, "first light");
    lum_free(lit);
    rig_end(&r);
}

/* More lamps in fog than have a buffer: those that share one are traced anew, and the counters say so. */
static void a_crowd_in_fog_is_traced_anew(void **state)
{
    (void)state;
    struct rig r;
    room(&r, true);
    for (int i = 0; i < 20; i++) {
        char id[8];
        snprintf(id, sizeof id, "p%02d", i);
        struct lum_light_desc d = rig_point(rig_v(-1 + 0.1 * i, 2.5, -0.5), 5);
        rig_light(&r, id, &d);
    }
    rig_commit(&r);
    rig_pass(&r);
    put_lamp(&r, 0.5, true);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_true(s.rays[LUM_RAY_MEDIA] > 0);
    assert_int_equal(rig_all_rays(&s), s.rays[LUM_RAY_MEDIA]);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(there_and_back),
        cmocka_unit_test(half_the_power_is_a_new_picture),
        cmocka_unit_test(first_light_is_looked_for),
        cmocka_unit_test(a_crowd_in_fog_is_traced_anew),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
