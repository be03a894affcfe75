/* Views: what an edit makes stale (counters), relighting bit for bit, odd sizes, empty scenes, threads, cancelling,
 * short memory. */
#include "tests/support/rig.h"

static void lit_room(struct rig *r, uint32_t threads)
{
    rig_begin(r, threads);
    rig_room(r);
    struct lum_light_desc lamp = rig_quad(rig_v(0, 2.9, 0), rig_v(0.8, 0, 0), rig_v(0, 0, 0.8), 300);
    struct lum_light_desc bulb = rig_point(rig_v(-1, 2, 0.5), 60), far = rig_point(rig_v(1, 2.5, 1), 30);
    rig_light(r, "lamp", &lamp);
    rig_light(r, "bulb", &bulb);
    rig_light(r, "far", &far);
    struct lum_material_desc glass = lum_material_default(), mirror = lum_material_default(), glow = rig_diffuse(0.3f);
    glass.transmission = 1.0f;
    glass.roughness = 0.0f;
    glass.attenuation_color = lum_rgb(0.5f, 0.9f, 0.5f);
    glass.attenuation_distance_m = 0.3;
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    glow.emission_cd_m2 = 40;
    rig_material(r, "glass", &glass);
    rig_material(r, "mirror", &mirror);
    rig_material(r, "glow", &glow);
    rig_box(r, "cube", 0.3, 0.3, 0.3);
    rig_object(r, "glass", "cube", "glass", rig_v(-0.6, 0.3, 0.2));
    rig_object(r, "mirror", "cube", "mirror", rig_v(0.4, 1.35, -0.3));
    rig_object(r, "glow", "cube", "glow", rig_v(-1.2, 0.4, -1.2));
    struct lum_light_desc sky = {.kind = LUM_LIGHT_ENVIRONMENT, .color = lum_grey(1), .intensity = 5, .on = true};
    rig_light(r, "sky", &sky);
    rig_commit(r);
    r->settings.shadow_samples = 4;
}

static void use(struct rig *r, const char *method)
{
    r->settings.method = lum_method_find(method);
    assert_non_null(r->settings.method);
}

static void assert_no_rays(const struct lum_pass_stats *s, const char *what)
{
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        if (s->rays[k] != 0)
            fail_msg("%s: %llu %s rays", what, (unsigned long long)s->rays[k], lum_ray_kind_names[k]);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (s->effects[e].rays || s->effects[e].tiles || s->effects[e].ns)
            fail_msg("%s: the effect %s did something", what, lum_effect_names[e]);
}

static void nothing_changed_nothing_runs(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use(&r, "whitted");
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
    use(&r, "whitted");
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
    struct lum_rgb *off = rig_picture(&r);
    rig_assert_as_fresh(&r, "relit");
    rig_assert_picture(&r, off, "relit twice");
    lum_free(off);

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
    use(&r, "whitted");
    uint64_t all = rig_pass(&r).rays[LUM_RAY_DIRECT];
    struct lum_light_desc bulb = rig_point(rig_v(-1, 1.9, 0.5), 60);
    rig_light(&r, "bulb", &bulb);
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
    struct lum_light_desc extra = rig_point(rig_v(0.1, 2.2, 1.2), 10);
    rig_light(&r, "a-first", &extra);
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
    use(&r, "whitted");
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
    use(&r, "whitted");
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
        use(&r, methods[i]);
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

/* [19] What is matched to its surroundings has no interface at all; what is denser reflects totally from inside, even
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
        struct lum_light_desc bulb = rig_point(rig_v(-1, 2, 0.5), 60);
        rig_light(&r, "bulb", &bulb);
        rig_commit(&r);
        use(&r, "path");
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
        use(&r, methods[i]);
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
    use(&r, "whitted");
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
            struct lum_light_desc star = rig_point(rig_v(0, 0.6 * distances[i], 0.8 * distances[i]), 1e12);
            rig_light(&r, "star", &star);
            rig_commit(&r);
            use(&r, "whitted");
            rig_pass(&r);
            if ((lum_luminance(rig_mean(&r)) > 0.0f) != open)
                fail_msg("%g m: %s, mean luminance %g", distances[i], open ? "open" : "closed",
                         (double)lum_luminance(rig_mean(&r)));
            rig_end(&r);
        }
}

/* Pixels of a small picture are those of a bigger one's corner that see the same rays: the eye's arithmetic depends on
 * the size only through the centre, so pictures of equal parity are compared at equal pixel size, without noise. */
static void odd_sizes_equal_the_crop(void **state)
{
    (void)state;
    const uint32_t sizes[][2] = {{1, 1}, {1, 33}, {47, 1}, {17, 31}, {15, 15}, {33, 65}};
    struct rig r;
    rig_begin(&r, 2);
    rig_room(&r);
    struct lum_light_desc bulb = rig_point(rig_v(-1, 2, 0.5), 60);
    rig_light(&r, "bulb", &bulb);
    rig_commit(&r);
    use(&r, "whitted");
    const double tan_of_pixel = 0.01;
    for (size_t k = 0; k < LUM_ARRAY_LEN(sizes); k++) {
        uint32_t w = sizes[k][0], h = sizes[k][1], big_w = w + 34, big_h = h + 50;
        r.settings.w = w;
        r.settings.h = h;
        r.settings.camera.vfov_deg = fmax(1.0, 2.0 * atan(tan_of_pixel * h / 2) * (180.0 / 3.14159265358979323846));
        double tan_half = tan(r.settings.camera.vfov_deg * (3.14159265358979323846 / 360.0));
        rig_pass(&r);
        struct lum_rgb *small = rig_picture(&r);
        r.settings.w = big_w;
        r.settings.h = big_h;
        r.settings.camera.vfov_deg = 2.0 * atan(tan_half / h * big_h) * (180.0 / 3.14159265358979323846);
        rig_pass(&r);
        const struct lum_film *f = lum_view_film(r.view);
        uint32_t off = 0;
        for (uint32_t y = 0; y < h; y++)
            for (uint32_t x = 0; x < w; x++) {
                struct lum_rgb big = lum_film_mean(f, x + 17, y + 25), one = small[y * w + x];
                /* tan(atan()) rounds differently: a ray is off by an ulp, which matters at edges only */
                off += !(fabsf(big.r - one.r) <= 1e-4f * one.r);
            }
        if (off > (w * h) / 50)
            fail_msg("%u x %u: %u pixels differ from the crop", w, h, off);
        lum_free(small);
    }
    rig_end(&r);
}

static void empty_scenes_and_walls(void **state)
{
    (void)state;
    const char *methods[] = {"whitted", "path"};
    for (int i = 0; i < 2; i++) {
        struct rig r;
        rig_begin(&r, 2);
        use(&r, methods[i]);
        rig_commit(&r); /* nothing at all */
        struct lum_pass_stats s = rig_pass(&r);
        assert_true(lum_luminance(rig_mean(&r)) == 0.0f);
        assert_int_equal(rig_all_rays(&s), s.rays[LUM_RAY_PRIMARY]);

        struct lum_light_desc sky = {
            .kind = LUM_LIGHT_ENVIRONMENT, .color = lum_grey(1), .intensity = 5, .on = true, .camera_visible = true};
        rig_light(&r, "sky", &sky);
        rig_commit(&r); /* no object: all sky */
        rig_pass(&r);
        assert_true(fabsf(lum_luminance(rig_mean(&r)) - 5.0f) < 1e-4f);

        rig_box(&r, "box", 1, 1, 1);
        rig_diffuse_object(&r, "box", "white", 0.75f, rig_v(0, 0, 0));
        rig_commit(&r);
        const double eyes[] = {1.0, 1.0 + 1e-7, 1.0 - 1e-7, 0.0}; /* in the wall, beside it, inside the box */
        for (size_t k = 0; k < LUM_ARRAY_LEN(eyes); k++) {
            rig_camera(&r, rig_v(eyes[k], 0.1, 0.2), rig_v(-5, 0.1, 0.3), 90);
            rig_pass(&r); /* finite, and no bad ray */
        }
        rig_end(&r);
    }
}

static void threads_do_not_matter(void **state)
{
    (void)state;
    const uint32_t threads[] = {1, 2, 3, 7};
    const char *methods[] = {"whitted", "path"};
    for (int i = 0; i < 2; i++) {
        struct lum_rgb *first = NULL;
        uint64_t rays = 0;
        for (size_t k = 0; k < LUM_ARRAY_LEN(threads); k++) {
            struct rig r;
            lit_room(&r, threads[k]);
            use(&r, methods[i]);
            r.settings.max_depth = 4;
            struct lum_pass_stats s = rig_pass(&r);
            if (i == 1)
                s = rig_pass(&r);
            if (!first) {
                first = rig_picture(&r);
                rays = rig_all_rays(&s);
            }
            rig_assert_picture(&r, first, methods[i]);
            assert_int_equal(rig_all_rays(&s), rays);
            rig_end(&r);
        }
        lum_free(first);
    }
}

static void cancelled_pass_leaves_a_consistent_film(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use(&r, "path");
    r.settings.max_depth = 2;
    rig_pass(&r);
    rig_pass(&r);
    struct lum_rgb *two = rig_picture(&r);
    rig_fresh_view(&r);
    rig_pass(&r);
    struct lum_pass_stats s;
    _Atomic bool cancel = true;
    struct lum_error err = {0};
    assert_int_equal(lum_view_pass(r.view, r.snapshot, &r.settings, &cancel, &s, &err), LUM_ERR_CANCELLED);
    assert_int_equal(s.spp, 1);
    assert_false(s.complete);
    rig_pass(&r);
    rig_assert_picture(&r, two, "after a cancelled pass");
    lum_free(two);

    use(&r, "whitted");
    rig_pass(&r);
    struct lum_rgb *whole = rig_picture(&r);
    rig_fresh_view(&r);
    assert_int_equal(lum_view_pass(r.view, r.snapshot, &r.settings, &cancel, &s, &err), LUM_ERR_CANCELLED);
    assert_int_equal(s.spp, 0);
    rig_pass(&r);
    rig_assert_picture(&r, whole, "whitted after a cancelled pass");
    lum_free(whole);
    rig_end(&r);
}

/* One rough pass per picture, one path a block; the samples after it are those of a view that never had one. */
static void rough_passes_come_first_and_leave_no_trace(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use(&r, "path");
    r.settings.w = 50, r.settings.h = 35; /* no multiple of a block or a tile */
    r.settings.max_depth = 2;
    rig_pass(&r);
    struct lum_rgb *one = rig_picture(&r);
    for (uint32_t side = 2; side <= 16; side *= 2) {
        rig_fresh_view(&r);
        r.settings.preview = side;
        struct lum_pass_stats s = rig_pass(&r);
        /* tiles of 16 are cut into blocks on their own; the last column of tiles is 2 wide, the last row 3 high */
        uint32_t columns = 3 * (16 / side) + 1, rows = 2 * (16 / side) + (3 + side - 1) / side;
        assert_int_equal(s.rays[LUM_RAY_PRIMARY], columns * rows);
        assert_int_equal(s.preview, side);
        assert_int_equal(s.spp, 0);
        assert_true(s.changed && !s.complete && isnan(s.error_rel));
        s = rig_pass(&r);
        assert_int_equal(s.preview, 0);
        assert_int_equal(s.spp, 1);
        rig_assert_picture(&r, one, "after a rough pass");
    }
    lum_free(one);
    rig_end(&r);
}

static void progress_stops_and_starts_over(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use(&r, "path");
    r.settings.max_depth = 2;
    r.settings.max_spp = 3;
    for (uint32_t i = 1; i <= 3; i++) {
        struct lum_pass_stats s = rig_pass(&r);
        assert_int_equal(s.spp, i);
        assert_true(s.complete == (i == 3));
        assert_true(isnan(s.error_rel) == (i < 2));
    }
    struct lum_pass_stats s = rig_pass(&r);
    assert_no_rays(&s, "complete");
    assert_true(!s.changed && s.complete);
    r.settings.max_spp = 4; /* goes on */
    s = rig_pass(&r);
    assert_int_equal(s.spp, 4);
    r.settings.seed++; /* starts over */
    s = rig_pass(&r);
    assert_int_equal(s.spp, 1);
    rig_end(&r);
}

static void first_hits_and_picks(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    struct lum_aovs a;
    RIG_OK(lum_view_aovs(r.view, r.snapshot, &r.settings, &a, &err));
    uint32_t w = r.settings.w, h = r.settings.h;
    for (uint32_t y = 0; y < h; y++)
        for (uint32_t x = 0; x < w; x++) {
            struct lum_pick p;
            lum_pick_at(r.snapshot, &r.settings.camera, w, h, x + 0.5, y + 0.5, &p);
            assert_true(p.hit);
            size_t i = y * w + x;
            assert_true(fabs(p.distance_m - (double)a.depth_m[i]) < 1e-5);
            if (a.instance[i] != LUM_NO_OBJECT)
                assert_string_equal(p.id, r.snapshot->instances[a.instance[i]].id);
            assert_true(fabsf(lum_length(a.normal_world[i]) - 1.0f) < 1e-5f);
        }
    struct lum_pick p;
    struct lum_camera up = {{0, 1, 0}, {0, 5, 0}, {0, 0, 1}, 10};
    lum_pick_at(r.snapshot, &up, 3, 3, 1.5, 1.5, &p);
    assert_true(p.hit);
    assert_string_equal(p.id, "lamp");
    assert_true(fabs(p.distance_m - 1.9) < 1e-5 && fabs(p.point_world.y - 2.9) < 1e-5 && p.normal.y < -0.999f);
    lum_pick_at(r.snapshot, &up, 0, 0, (double)NAN, 0, &p);
    assert_false(p.hit);
    rig_end(&r);
}

static void refusals_name_the_field(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 1);
    const struct lum_view_settings good = r.settings;
    struct lum_view_settings bad[8];
    for (size_t i = 0; i < LUM_ARRAY_LEN(bad); i++)
        bad[i] = good;
    bad[0].w = 0;
    bad[1].method = NULL;
    bad[2].shadow_samples = 17;
    bad[3].camera.vfov_deg = (double)NAN;
    bad[4].camera.target = bad[4].camera.position;
    bad[5].camera.position.x = 1e300;
    bad[6].camera.up.x = (double)INFINITY;
    bad[7].camera.position.x = 2e7; /* 8 units to the metre: over what a ray may start from */
    const char *fields[] = {"size", "method", "shadow_samples", "vfov_deg", "target", "position", "camera", "position"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(bad); i++) {
        struct lum_pass_stats s;
        struct lum_error err = {0};
        assert_int_equal(lum_view_pass(r.view, r.snapshot, &bad[i], NULL, &s, &err), LUM_ERR_INVALID);
        assert_string_equal(err.field, fields[i]);
    }
    r.settings.camera.up = rig_v(0, 0, 0); /* any up will do */
    r.settings.shadow_samples = 1;
    rig_pass(&r);
    r.settings.camera.position.x = 1e7;
    rig_pass(&r);
    rig_end(&r);
}

static void short_memory_is_survived(void **state)
{
    (void)state;
    const char *methods[] = {"whitted", "path"};
    for (int i = 0; i < 2; i++) {
        struct rig r;
        lit_room(&r, 1);
        use(&r, methods[i]);
        rig_pass(&r);
        struct lum_rgb *whole = rig_picture(&r);
        bool done = false;
        for (uint64_t k = 1; !done; k++) {
            lum_view_destroy(r.view);
            r.view = NULL;
            struct lum_pass_stats s;
            struct lum_error err = {0};
            lum_alloc_fail_after(k);
            enum lum_status status = lum_view_create(r.pool, &r.view, &err);
            if (status == LUM_OK)
                status = lum_view_pass(r.view, r.snapshot, &r.settings, NULL, &s, &err);
            lum_alloc_fail_after(0);
            if (status != LUM_OK)
                assert_int_equal(status, LUM_ERR_NOMEM);
            done = status == LUM_OK;
            if (!r.view)
                continue;
            rig_pass(&r); /* the view goes on where it was */
            if (strcmp(methods[i], "whitted") == 0)
                rig_assert_picture(&r, whole, "after short memory");
        }
        lum_free(whole);
        rig_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_changed_nothing_runs),
        cmocka_unit_test(relighting_traces_nothing),
        cmocka_unit_test(moved_light_retraces_itself),
        cmocka_unit_test(material_edit_keeps_visibility),
        cmocka_unit_test(camera_and_objects_make_all_stale),
        cmocka_unit_test(effects_not_called_for_do_nothing),
        cmocka_unit_test(counters_follow_the_demand),
        cmocka_unit_test(silent_edits_show),
        cmocka_unit_test(switched_off_lamps_are_dark),
        cmocka_unit_test(far_lights_cast_shadows),
        cmocka_unit_test(odd_sizes_equal_the_crop),
        cmocka_unit_test(empty_scenes_and_walls),
        cmocka_unit_test(threads_do_not_matter),
        cmocka_unit_test(cancelled_pass_leaves_a_consistent_film),
        cmocka_unit_test(rough_passes_come_first_and_leave_no_trace),
        cmocka_unit_test(progress_stops_and_starts_over),
        cmocka_unit_test(first_hits_and_picks),
        cmocka_unit_test(refusals_name_the_field),
        cmocka_unit_test(short_memory_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
