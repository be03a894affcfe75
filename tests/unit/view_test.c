/* What a view traces again after an edit, and what its effects are called for. */
#include "tests/support/lit_room.h"

static void nothing_changed_nothing_runs(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, "whitted");
    struct lum_pass_stats s = rig_pass(&r);
    assert_true(s.changed && s.complete && s.spp == 1);
    assert_true(s.rays[LUM_RAY_PRIMARY] == 48 * 32);
    assert_true(s.rays[LUM_RAY_REFLECTION] > 0 && s.rays[LUM_RAY_TRANSMISSION] > 0 && s.rays[LUM_RAY_SOFT_SHADOW] > 0);
    s = rig_pass(&r);
    assert_no_rays(&s, "second pass");
    assert_true(!s.changed && s.complete);
    r.settings.max_spp = 77; /* no matter to a deferred method */
    rig_commit(&r);          /* a new revision with nothing in it */
    s = rig_pass(&r);
    assert_no_rays(&s, "empty commit");
    assert_true(!s.changed);
    assert_int_equal(s.scene_rev, 2);
    rig_end(&r);
}

static void relighting_traces_nothing(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 3);
    use_method(&r, "whitted");
    rig_pass(&r);
    struct lum_light_desc bulb = rig_point(rig_v(-1, 2, 0.5), 61.7);
    bulb.color = lum_rgb(2.0f, 0.8f, 0.1f);
    rig_light(&r, "bulb", &bulb);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_no_rays(&s, "dimmed");
    assert_true(s.changed && s.complete);
    struct lum_rgb *dimmed = rig_picture(&r);

    bulb.on = false;
    rig_light(&r, "bulb", &bulb);
    struct lum_light_desc lamp = rig_quad(rig_v(0, 2.9, 0), rig_v(0.8, 0, 0), rig_v(0, 0, 0.8), 17);
    rig_light(&r, "lamp", &lamp);
    struct lum_material_desc glow = rig_diffuse(0.3f);
    glow.emission_cd_m2 = 90;
    glow.emission = lum_rgb(0.2f, 1.1f, 2.0f);
    rig_material(&r, "glow", &glow);
    rig_commit(&r);
    s = rig_pass(&r);
    assert_no_rays(&s, "one off, one dimmed, an emissive mesh recoloured");
    rig_assert_as_fresh(&r, "relit");

    bulb.on = true; /* the view is fresh: it never saw this light */
    rig_light(&r, "bulb", &bulb);
    lamp.intensity = 300;
    rig_light(&r, "lamp", &lamp);
    glow.emission_cd_m2 = 40;
    glow.emission = lum_grey(1);
    rig_material(&r, "glow", &glow);
    rig_commit(&r);
    s = rig_pass(&r);
    assert_true(s.rays[LUM_RAY_DIRECT] > 0);
    assert_int_equal(s.rays[LUM_RAY_PRIMARY] + s.rays[LUM_RAY_SOFT_SHADOW] + s.rays[LUM_RAY_ENVIRONMENT], 0);
    rig_assert_picture(&r, dimmed, "switched on");
    lum_free(dimmed);
    rig_end(&r);
}

static void moved_light_retraces_itself(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, "whitted");
    uint64_t all = rig_pass(&r).rays[LUM_RAY_DIRECT];
    rig_bulb(&r, "bulb", rig_v(-1, 1.9, 0.5), 60);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_int_equal(s.rays[LUM_RAY_PRIMARY], 0);
    assert_int_equal(s.rays[LUM_RAY_SOFT_SHADOW], 0);
    assert_int_equal(s.rays[LUM_RAY_ENVIRONMENT], 0);
    if (!(s.rays[LUM_RAY_DIRECT] > 0 && s.rays[LUM_RAY_DIRECT] < all))
        fail_msg("%llu of %llu rays to lights that are points", (unsigned long long)s.rays[LUM_RAY_DIRECT],
                 (unsigned long long)all);
    rig_assert_as_fresh(&r, "moved light");

    /* a light added before all others by name: the others keep what they have */
    rig_bulb(&r, "a-first", rig_v(0.1, 2.2, 1.2), 10);
    rig_commit(&r);
    s = rig_pass(&r);
    assert_int_equal(s.rays[LUM_RAY_PRIMARY] + s.rays[LUM_RAY_SOFT_SHADOW], 0);
    rig_assert_as_fresh(&r, "added light");
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "a-first", &err));
    rig_commit(&r);
    s = rig_pass(&r);
    assert_no_rays(&s, "removed light");
    rig_assert_as_fresh(&r, "removed light");
    rig_end(&r);
}

static void material_edit_keeps_visibility(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_OBJECT, "glass", &err));
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_OBJECT, "mirror", &err));
    rig_commit(&r);
    use_method(&r, "whitted");
    rig_pass(&r);
    struct lum_material_desc red = rig_diffuse(0.1f);
    red.base_color = lum_rgb(0.1f, 0.7f, 0.1f);
    rig_material(&r, "red", &red);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_no_rays(&s, "recoloured");
    assert_true(s.changed);
    rig_assert_as_fresh(&r, "recoloured");
    red.base_color = lum_grey(0); /* black and back: samples that could not contribute are caught up */
    rig_material(&r, "red", &red);
    rig_commit(&r);
    rig_fresh_view(&r);
    rig_pass(&r);
    red.base_color = lum_grey(0.5f);
    rig_material(&r, "red", &red);
    rig_commit(&r);
    s = rig_pass(&r);
    assert_true(rig_all_rays(&s) > 0);
    assert_int_equal(s.rays[LUM_RAY_PRIMARY], 0);
    rig_assert_as_fresh(&r, "from black");
    rig_end(&r);
}

static void camera_and_objects_make_all_stale(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, "whitted");
    rig_pass(&r);
    r.settings.camera.position.x += 0.01;
    struct lum_pass_stats s = rig_pass(&r);
    assert_int_equal(s.rays[LUM_RAY_PRIMARY], 48 * 32);
    rig_assert_as_fresh(&r, "camera");
    rig_object(&r, "crate", "crate", "red", rig_v(0.6, 0.5, -0.4));
    rig_commit(&r);
    s = rig_pass(&r);
    assert_int_equal(s.rays[LUM_RAY_PRIMARY], 48 * 32);
    rig_assert_as_fresh(&r, "object");
    rig_end(&r);
}

static void effects_not_called_for_do_nothing(void **state)
{
    (void)state;
    const char *methods[] = {"whitted", "path"};
    for (int i = 0; i < 2; i++) {
        struct rig r;
        rig_begin(&r, 2);
        rig_room(&r);
        rig_commit(&r);
        use_method(&r, methods[i]);
        struct lum_pass_stats s = rig_pass(&r);
        for (int e = 0; e < LUM_EFFECT_ANTIALIAS; e++) {
            assert_false(s.demand.on[e]);
            assert_true(s.demand.why[e][0] != 0);
            assert_true(s.effects[e].rays == 0 && s.effects[e].tiles == 0 && s.effects[e].ns == 0);
        }
        assert_true(lum_luminance(rig_mean(&r)) == 0.0f);
        struct lum_light_desc bulb = rig_point(rig_v(-1, 2, 0.5), 60);
        rig_light(&r, "bulb", &bulb);
        rig_commit(&r);
        s = rig_pass(&r);
        assert_true(s.demand.on[LUM_EFFECT_DIRECT] && s.demand.on[LUM_EFFECT_INDIRECT_DIFFUSE]);
        assert_non_null(strstr(s.demand.why[LUM_EFFECT_DIRECT], "bulb"));
        assert_true(s.rays[LUM_RAY_DIRECT] > 0);
        const enum lum_effect none[] = {LUM_EFFECT_SOFT_SHADOW,  LUM_EFFECT_ENVIRONMENT, LUM_EFFECT_REFLECTION,
                                        LUM_EFFECT_TRANSMISSION, LUM_EFFECT_GLOSSY,      LUM_EFFECT_MEDIA};
        for (size_t k = 0; k < LUM_ARRAY_LEN(none); k++)
            assert_true(!s.demand.on[none[k]] && s.effects[none[k]].rays == 0 && s.effects[none[k]].tiles == 0);
        rig_end(&r);
    }
}

/* [H19] What is matched to its surroundings has no interface at all; what is denser reflects totally from inside, even
 * where its specular is 0. */
static void counters_follow_the_demand(void **state)
{
    (void)state;
    const struct {
        float ior, specular, transmission;
        bool reflects;
    } rows[] = {
        {1.0f, 1.0f, 0.0f, false}, {1.0f, 1.0f, 1.0f, false}, {1.5f, 0.0f, 1.0f, true}, {1.5f, 0.0f, 0.0f, false}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        struct rig r;
        rig_begin(&r, 1);
        rig_room(&r);
        struct lum_material_desc m = lum_material_default();
        m.roughness = 0.0f;
        m.ior = rows[i].ior;
        m.specular = rows[i].specular;
        m.transmission = rows[i].transmission;
        rig_material(&r, "red", &m);
        rig_bulb(&r, "bulb", rig_v(-1, 2, 0.5), 60);
        rig_commit(&r);
        use_method(&r, "path");
        struct lum_pass_stats s = rig_pass(&r);
        if (s.demand.on[LUM_EFFECT_REFLECTION] != rows[i].reflects ||
            (s.effects[LUM_EFFECT_REFLECTION].rays > 0) != rows[i].reflects || s.rays[LUM_RAY_GLOSSY] > 0)
            fail_msg("row %zu: reflection is %s, %llu mirror and %llu glossy rays", i,
                     s.demand.on[LUM_EFFECT_REFLECTION] ? "on" : "off", (unsigned long long)s.rays[LUM_RAY_REFLECTION],
                     (unsigned long long)s.rays[LUM_RAY_GLOSSY]);
        rig_end(&r);
    }
}

/* Edits that leave every triangle where it was, and still show. */
static void silent_edits_show(void **state)
{
    (void)state;
    const char *methods[] = {"whitted", "path"};
    for (int i = 0; i < 2; i++) {
        struct rig r;
        lit_room(&r, 2);
        struct lum_material_desc glow = rig_diffuse(0.3f);
        const float before[3] = {1, 1, 1}, after[3] = {0.1f, 3, 0.5f};
        struct lum_image_desc image = {LUM_TEXEL_RGB32F, 1, 1, before};
        RIG_OK(lum_scene_put_image(r.scene, "slide", &image, &err));
        glow.emission_cd_m2 = 40;
        glow.emission_texture.image = "slide";
        rig_material(&r, "glow", &glow);
        rig_commit(&r);
        use_method(&r, methods[i]);
        rig_pass(&r);

        RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_OBJECT, "crate", &err));
        rig_object(&r, "chest", "crate", "white", rig_v(0.5, 0.5, -0.4));
        rig_commit(&r);
        rig_pass(&r);
        rig_assert_as_fresh(&r, "another object of another material in the same place");

        image.pixels = after;
        RIG_OK(lum_scene_put_image(r.scene, "slide", &image, &err));
        rig_commit(&r);
        rig_pass(&r);
        rig_assert_as_fresh(&r, "another picture on an emitter");
        rig_end(&r);
    }
}

/* The shared layer is on because something is unlit. */
static void switched_off_lamps_are_dark(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_room(&r);
    struct lum_material_desc sign = rig_diffuse(0.5f);
    sign.unlit = true;
    rig_material(&r, "red", &sign);
    struct lum_light_desc bulb = rig_point(rig_v(-1, 2, 0.5), 60);
    struct lum_light_desc lamp = rig_quad(rig_v(0, 1.5, -1), rig_v(1, 0, 0), rig_v(0, 1, 0), 1e9);
    lamp.on = false;
    rig_light(&r, "bulb", &bulb);
    rig_light(&r, "lamp", &lamp);
    rig_commit(&r);
    use_method(&r, "whitted");
    rig_pass(&r);
    assert_true(lum_luminance(rig_mean(&r)) > 0.0f && lum_luminance(rig_mean(&r)) < 1e4f);
    rig_end(&r);
}

/* However far, walls keep its light out, and no ray leaves the range that Embree can take. */
static void far_lights_cast_shadows(void **state)
{
    (void)state;
    const double distances[] = {1e3, 1e6, 1e9, 1e14};
    for (size_t i = 0; i < LUM_ARRAY_LEN(distances); i++)
        for (int open = 0; open < 2; open++) {
            struct rig r;
            rig_begin(&r, 1);
            rig_room(&r);
            if (open)
                RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_OBJECT, "room", &err));
            rig_bulb(&r, "star", rig_v(0, 0.6 * distances[i], 0.8 * distances[i]), 1e12);
            rig_commit(&r);
            use_method(&r, "whitted");
            rig_pass(&r);
            if ((lum_luminance(rig_mean(&r)) > 0.0f) != open)
                fail_msg("%g m: %s, mean luminance %g", distances[i], open ? "open" : "closed",
                         (double)lum_luminance(rig_mean(&r)));
            rig_end(&r);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_changed_nothing_runs),      cmocka_unit_test(relighting_traces_nothing),
        cmocka_unit_test(moved_light_retraces_itself),       cmocka_unit_test(material_edit_keeps_visibility),
        cmocka_unit_test(camera_and_objects_make_all_stale), cmocka_unit_test(effects_not_called_for_do_nothing),
        cmocka_unit_test(counters_follow_the_demand),        cmocka_unit_test(silent_edits_show),
        cmocka_unit_test(switched_off_lamps_are_dark),       cmocka_unit_test(far_lights_cast_shadows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
