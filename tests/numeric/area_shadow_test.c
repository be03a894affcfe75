/* Soft shadows of `live`: closed forms, agreement with whitted, the budget, edits. */
#include "core/effect/direct/layers.h"
#include "core/light/irradiance.h"
#include "tests/numeric/live_shadows.h"
#include "tests/support/effort.h"

#include <math.h>

static uint64_t shadow_rays(const struct lum_pass_stats *s)
{
    return s->rays[LUM_RAY_SOFT_SHADOW] + s->rays[LUM_RAY_ENVIRONMENT];
}

static void put_lamp(struct rig *r, const char *id, double x, double cd_m2)
{
    struct lum_light_desc l = rig_quad(rig_v(x, 2.8, 0), rig_v(1, 0, 0), rig_v(0, 0, 0.7), cd_m2);
    rig_light(r, id, &l);
}

static void furnished_room(struct rig *r, uint32_t threads)
{
    rig_begin(r, threads);
    rig_room(r);
    put_lamp(r, "lamp", -0.5, 100);
    struct lum_light_desc ball = {.kind = &lum_light_kind_sphere,
                                  .position = rig_v(-1, 0.6, 0.5),
                                  .radius_m = 0.15,
                                  .color = lum_grey(1),
                                  .intensity = 300,
                                  .on = true,
                                  .camera_visible = true};
    rig_light(r, "ball", &ball);
    rig_commit(r);
    set_live(r, 20000);
}

/* A floor with nothing above but the lamp. */
static void open_floor(struct rig *r)
{
    rig_begin(r, 0);
    rig_square(r, "floor", 3);
    rig_diffuse_object(r, "floor", "floor", 0.5f, rig_v(0, 0, 0));
    put_lamp(r, "lamp", 0, 100);
    rig_camera(r, rig_v(1, 2, 2), rig_v(0, 0, 0), 30);
    rig_commit(r);
    set_live(r, 1000000);
}

/* Every pixel of it is the closed form. Returns how many there are. */
static uint32_t assert_closed_form(const struct rig *r)
{
    uint32_t n = 0;
    struct lum_light l = {.kind = &lum_emitter_quad, .p = {0, 2.8f, 0}, .n = {0, -1, 0}, .u = {0.5f, 0, 0}};
    l.v = lum_v3(0, 0, 0.35f);
    l.area = 0.7f;
    for (uint32_t y = 0; y < r->settings.h; y++)
        for (uint32_t x = 0; x < r->settings.w; x++) {
            struct lum_pick pick;
            lum_pick_at(r->snapshot, &r->settings.camera, r->settings.w, r->settings.h, x + 0.5, y + 0.5, &pick);
            if (!pick.hit || strcmp(pick.id, "floor") != 0)
                continue;
            n++;
            struct lum_vec3 p = {(float)pick.point_world.x, (float)pick.point_world.y, (float)pick.point_world.z};
            struct lum_irradiance e;
            lum_light_irradiance(&l, 1, &p, &(struct lum_vec3){0, 1, 0}, &e);
            double want = 100.0 * 0.5 * (double)e.cosine_integral / LUM_PI_D;
            double got = (double)lum_film_mean(lum_view_film(r->view), x, y).g;
            if (!(fabs(got / want - 1.0) < 1e-5)) /* floats: the point, and four products */
                fail_msg("%u x %u, seed %u, pixel %u,%u: %.8g, closed form %.8g", r->settings.w, r->settings.h,
                         r->settings.seed, x, y, got, want);
        }
    return n;
}

/* A ray for one pixel of four. */
static void lit_is_exact(void **state)
{
    (void)state;
    struct rig r;
    open_floor(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_int_equal(shadow_rays(&s), r.settings.w * r.settings.h / 4);
    assert_int_equal(assert_closed_form(&r), r.settings.w * r.settings.h);
    rig_end(&r);
}

/* Tiles of the pattern that the border cuts, wherever the pixels lie that are asked first. */
static void cut_tiles_are_lit(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {1, 9}, {7, 1}, {2, 3}, {5, 50}, {49, 6}};
    struct rig r;
    open_floor(&r);
    for (size_t i = 0; i < LUM_ARRAY_LEN(sizes); i++)
        for (r.settings.seed = 0; r.settings.seed < 8; r.settings.seed++) {
            r.settings.w = sizes[i][0];
            r.settings.h = sizes[i][1];
            rig_pass(&r);
            assert_true(assert_closed_form(&r) > 0);
        }
    rig_end(&r);
}

/* Under a roof as large as the floor nothing arrives, exactly. */
static void umbra_is_black(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_square(&r, "floor", 1);
    rig_diffuse_object(&r, "floor", "floor", 0.5f, rig_v(0, 0, 0));
    rig_square(&r, "roof", 6);
    rig_object(&r, "roof", "roof", "floor", rig_v(0, 2.5, 0));
    put_lamp(&r, "lamp", 0, 100);
    rig_camera(&r, rig_v(1, 2, 2), rig_v(0, 0, 0), 10);
    rig_commit(&r);
    set_live(&r, 1000000);
    struct lum_pass_stats s = rig_pass(&r);
    assert_int_equal(shadow_rays(&s), r.settings.w * r.settings.h / 4);
    const struct lum_film *f = lum_view_film(r.view);
    for (uint32_t i = 0; i < f->w * f->h; i++)
        assert_true(lum_film_mean(f, i % f->w, i / f->w).g == 0.0f);
    rig_end(&r);
}

/* All 1 m long, 2.8 m above the floor, of 100 cd/m^2. */
enum lamp { QUAD, MESH, DISC };

static void put_lamp_of(struct rig *r, enum lamp lamp)
{
    static const double p[] = {-0.5, 0, -0.35, 0.5, 0, -0.35, 0.5, 0, 0.35, -0.5, 0, 0.35};
    static const uint32_t i[] = {0, 1, 2, 0, 2, 3};
    struct lum_light_desc disc = rig_quad(rig_v(0, 2.8, 0), rig_v(1, 0, 0), rig_v(0, 0, 0.7), 100);
    struct lum_material_desc glow = rig_diffuse(0.0f);
    glow.emission_cd_m2 = 100;
    if (lamp == QUAD) {
        put_lamp(r, "lamp", 0, 100);
    } else if (lamp == MESH) { /* the same as two triangles */
        rig_material(r, "glow", &glow);
        rig_mesh(r, "pane", p, 4, i, 2);
        rig_object(r, "lamp", "pane", "glow", rig_v(0, 2.8, 0));
    } else {
        disc.kind = &lum_light_kind_disc;
        disc.direction = rig_v(0, -1, 0);
        disc.radius_m = 0.5;
        rig_light(r, "lamp", &disc);
    }
}

/* What p on the floor gets of the lamp where its x is more than from: cosine integral. Of the disc, strips of it. */
static double light_beyond(enum lamp lamp, struct lum_vec3 p, float from)
{
    int n = lamp == DISC ? 64 : 1;
    float width = (0.5f - from) / (float)n;
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        float x = from + ((float)i + 0.5f) * width, half = lamp == DISC ? sqrtf(0.25f - x * x) : 0.35f;
        struct lum_light strip = {
            .kind = &lum_emitter_quad, .p = {x, 2.8f, 0}, .n = {0, -1, 0}, .area = 2 * half * width};
        struct lum_irradiance e;
        strip.u = lum_v3(width / 2, 0, 0);
        strip.v = lum_v3(0, 0, half);
        lum_light_irradiance(&strip, 1, &p, &(struct lum_vec3){0, 1, 0}, &e);
        sum += (double)e.cosine_integral;
    }
    return sum;
}

/* The edge of a roof halfway up to the lamp: a point at x sees of the lamp what lies beyond -x. Of the 16 strata those
 * 4 that the edge cuts through are as chance has it, with a variance of 1/6 on average: a window of one ray a pixel is
 * off by sqrt(4 / 6) / 16 = 0.051, nine of them that agree by 0.017. Where all pixels know all strata each of them is,
 * and the mean of those alike in a window of 19 (1 over the sum of the squared weights), if all are, by 0.012. */
static double share_error(enum lamp lamp, uint32_t budget, uint64_t *ret_rays)
{
    struct rig r;
    rig_begin(&r, 0);
    rig_square(&r, "floor", 3);
    rig_diffuse_object(&r, "floor", "floor", 0.5f, rig_v(0, 0, 0));
    rig_object(&r, "roof", "floor", "floor", rig_v(-3, 1.4, 0));
    put_lamp_of(&r, lamp);
    rig_camera(&r, rig_v(0.5, 1.3, 0.2), rig_v(0, 0, 0), 30);
    rig_commit(&r);
    set_live(&r, budget);
    r.settings.w = 96;
    r.settings.h = 64;
    struct lum_pass_stats s = rig_pass(&r);
    *ret_rays = shadow_rays(&s);
    double sum = 0.0, n = 0.0;
    for (uint32_t y = 0; y < r.settings.h; y++)
        for (uint32_t x = 0; x < r.settings.w; x++) {
            struct lum_pick pick;
            lum_pick_at(r.snapshot, &r.settings.camera, r.settings.w, r.settings.h, x + 0.5, y + 0.5, &pick);
            float edge = (float)pick.point_world.x;
            if (!(fabsf(edge) < 0.45f))
                continue;
            struct lum_vec3 p = lum_v3(edge, (float)pick.point_world.y, (float)pick.point_world.z);
            double got = (double)lum_film_mean(lum_view_film(r.view), x, y).g * LUM_PI_D / (100.0 * 0.5);
            double off = (got - light_beyond(lamp, p, -edge)) / light_beyond(lamp, p, -0.5f);
            sum += off * off;
            n += 1.0;
        }
    assert_true(n > 1000.0);
    rig_end(&r);
    return sqrt(sum / n);
}

static void a_wide_penumbra_is_smooth(void **state)
{
    (void)state;
    uint64_t rays_first, rays_all;
    double first = share_error(QUAD, 0, &rays_first), all = share_error(QUAD, UINT32_MAX, &rays_all);
    print_message("share of the lamp off by %.4f; by %.4f where all strata are known\n", first, all);
    assert_true(rays_first <= 96u * 64u); /* fewer beside the penumbra */
    assert_true(rays_all > 4u * 96u * 64u);
    assert_true(first < 0.051 / 2);
    assert_true(all < 0.012);
}

/* Meshes and discs have 64 places in each stratum. Were the 16 samples of a pixel anywhere on the lamp, its share would
 * be off by sqrt(1 / 6) / 4 = 0.102, and the mean of 19 such by 0.023. With one place in each stratum all pixels would
 * be off alike, and no mean would help. */
static void places_lie_everywhere(void **state)
{
    (void)state;
    static const enum lamp lamps[] = {MESH, DISC};
    for (size_t i = 0; i < LUM_ARRAY_LEN(lamps); i++) {
        uint64_t rays;
        double all = share_error(lamps[i], UINT32_MAX, &rays);
        print_message("share of the %s off by %.4f where all strata are known\n", i ? "disc" : "mesh", all);
        assert_true(all < 0.023);
    }
}

static double square_difference(const struct rig *r, const struct lum_rgb *reference)
{
    const struct lum_film *f = lum_view_film(r->view);
    double sum = 0.0;
    for (uint32_t i = 0; i < f->w * f->h; i++) {
        double d = (double)lum_film_mean(f, i % f->w, i / f->w).g - (double)reference[i].g;
        sum += d * d;
    }
    return sum / (f->w * f->h);
}

static void whitted_pass(struct rig *r, uint32_t seed, uint32_t samples)
{
    struct lum_view_settings keep = r->settings;
    r->settings.method = lum_method_find("whitted");
    r->settings.seed = seed;
    r->settings.shadow_samples = samples;
    rig_pass(r);
    r->settings = keep;
}

/* The mean of PICTURES of `whitted` with 16 samples each. */
enum { PICTURES = TEST_EFFORT(32) };

static struct lum_rgb *whitted_reference(struct rig *r)
{
    struct lum_rgb *sum = lum_calloc((size_t)r->settings.w * r->settings.h, sizeof *sum);
    assert_non_null(sum);
    for (uint32_t seed = 100; seed < 100 + PICTURES; seed++) {
        whitted_pass(r, seed, 16);
        struct lum_rgb *one = rig_picture(r);
        for (uint32_t i = 0; i < r->settings.w * r->settings.h; i++)
            sum[i] = lum_rgb_mad(sum[i], one[i], 1.0f / PICTURES);
        lum_free(one);
    }
    return sum;
}

/* With one ray a pixel the error is far below whitted's with one; with all strata at shadow borders about that of all
 * everywhere; and the light is the same. */
static void agrees_with_whitted(void **state)
{
    (void)state;
    struct rig r;
    furnished_room(&r, 0);
    r.settings.w = 96;
    r.settings.h = 64;
    struct lum_rgb *reference = whitted_reference(&r);
    whitted_pass(&r, 7, 1);
    double plain_one = square_difference(&r, reference);
    whitted_pass(&r, 7, 16);
    double plain_all = square_difference(&r, reference);
    r.settings.shadow_budget = 0;
    rig_pass(&r);
    double one = square_difference(&r, reference);
    rig_fresh_view(&r);
    r.settings.shadow_budget = UINT32_MAX;
    rig_pass(&r);
    double all = square_difference(&r, reference);
    if (TEST_TELLS && !(one < plain_one / 10.0 && all < 2.0 * plain_all))
        fail_msg("mean square error %g and %g; whitted with 1 and 16: %g, %g", one, all, plain_one, plain_all);
    double mean = 0.0;
    for (uint32_t i = 0; i < r.settings.w * r.settings.h; i++)
        mean += (double)reference[i].g / (r.settings.w * r.settings.h);
    /* 256 samples in each window of some 1000 pixels of penumbra, off by 0.03 each, a sixth of the picture: 2e-4 */
    assert_true(!TEST_TELLS || fabs((double)rig_mean(&r).g / mean - 1.0) < 1e-3);
    lum_free(reference);
    rig_end(&r);
}

static void budget_is_kept(void **state)
{
    (void)state;
    struct rig r;
    furnished_room(&r, 0);
    r.settings.shadow_budget = 0;
    struct lum_pass_stats none = rig_pass(&r);
    assert_true(shadow_rays(&none) <= 2u * r.settings.w * r.settings.h); /* two lights */
    for (uint32_t budget = 16; budget < 100000; budget *= 4) {
        rig_fresh_view(&r);
        r.settings.shadow_budget = budget;
        struct lum_pass_stats s = rig_pass(&r);
        assert_true(shadow_rays(&s) <= shadow_rays(&none) + budget);
    }
    rig_end(&r);
}

/* Power and colour of a light are a sum; a material is another response from the same samples. */
static void edits_trace_nothing(void **state)
{
    (void)state;
    struct rig r;
    furnished_room(&r, 0);
    r.settings.shadow_budget = UINT32_MAX; /* all is known: what a new view shows does not depend on what came first */
    rig_pass(&r);
    put_lamp(&r, "lamp", -0.5, 3);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_int_equal(rig_all_rays(&s), 0);
    rig_assert_as_fresh(&r, "dimmed");

    struct lum_material_desc blue = rig_diffuse(0.4f);
    blue.base_color = lum_rgb(0.1f, 0.1f, 0.7f);
    rig_material(&r, "red", &blue);
    rig_commit(&r);
    s = rig_pass(&r);
    assert_int_equal(rig_all_rays(&s), 0);
    rig_assert_as_fresh(&r, "painted");

    s = rig_pass(&r); /* nothing changed */
    assert_int_equal(rig_all_rays(&s), 0);
    rig_end(&r);
}

/* An emitter is a shape that others' rays meet, so that the other light is traced again, too. */
static void moved_light_leaves_no_trace(void **state)
{
    (void)state;
    struct rig r;
    furnished_room(&r, 0);
    r.settings.shadow_budget = 0;
    rig_pass(&r);
    put_lamp(&r, "lamp", -0.4, 100);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_true(shadow_rays(&s) > 0 && shadow_rays(&s) <= 2u * r.settings.w * r.settings.h);
    rig_assert_as_fresh(&r, "moved");
    rig_end(&r);
}

/* Samples belong to a light's id: the order in which lights were added is not seen, but for the order of a sum of
 * floats. */
static void order_of_lights_does_not_matter(void **state)
{
    (void)state;
    struct lum_rgb *first = NULL;
    for (int order = 0; order < 2; order++) {
        struct rig r;
        rig_begin(&r, 0);
        rig_room(&r);
        for (int k = 0; k < 3; k++) {
            int i = order ? 2 - k : k;
            const char id[] = {(char)('a' + i), 0};
            put_lamp(&r, id, i - 1.0, 50 + 20 * i);
        }
        rig_commit(&r);
        set_live(&r, 0);
        rig_pass(&r);
        struct lum_rgb *p = rig_picture(&r);
        for (uint32_t i = 0; first && i < r.settings.w * r.settings.h; i++)
            assert_true(fabsf(p[i].g - first[i].g) <= 4e-7f * first[i].g); /* three terms */
        if (first)
            lum_free(p);
        else
            first = p;
        rig_end(&r);
    }
    lum_free(first);
}

static void any_size_and_any_threads(void **state)
{
    (void)state;
    const uint32_t sizes[][2] = {{1, 1}, {1, 9}, {2, 3}, {7, 1}, {5, 50}, {97, 49}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(sizes); i++) {
        struct lum_rgb *first = NULL;
        for (uint32_t threads = 1; threads <= 3; threads++) {
            struct rig r;
            furnished_room(&r, threads);
            r.settings.w = sizes[i][0];
            r.settings.h = sizes[i][1];
            rig_pass(&r);
            if (first)
                rig_assert_picture(&r, first, "threads");
            else
                first = rig_picture(&r);
            rig_end(&r);
        }
        lum_free(first);
    }
}

/* ---- samples that are carried on ---- */

/* A pan to where the room is looked at. */
static struct lum_pass_stats pan(struct rig *r, int n_frames)
{
    struct lum_camera end = r->settings.camera;
    struct lum_pass_stats s = {0};
    for (int k = n_frames - 1; k >= 0; k--) {
        r->settings.camera.position.x = end.position.x + 0.01 * k;
        s = rig_pass(r);
    }
    return s;
}

/* In a slow pan a frame takes fewer rays than from scratch, and is nearer to the truth: half of all strata are known,
 * from scratch one. */
static void a_pan_learns(void **state)
{
    (void)state;
    struct rig r;
    furnished_room(&r, 0);
    r.settings.w = 96;
    r.settings.h = 64;
    struct lum_rgb *reference = whitted_reference(&r);
    r.settings.shadow_budget = 0;
    struct lum_pass_stats fresh = rig_pass(&r);
    double alone = square_difference(&r, reference);
    rig_fresh_view(&r);
    r.settings.reproject_shadows = true;
    struct lum_pass_stats s = pan(&r, 12);
    double reprojected = square_difference(&r, reference);
    if (!(reprojected < alone && shadow_rays(&s) < shadow_rays(&fresh)))
        fail_msg("mean square %g, from scratch %g; rays %llu, %llu", reprojected, alone,
                 (unsigned long long)shadow_rays(&s), (unsigned long long)shadow_rays(&fresh));
    s = rig_pass(&r);
    assert_int_equal(rig_all_rays(&s), 0);
    lum_free(reference);
    rig_end(&r);
}

/* Visibility of a spot is carried, so that it is dropped with what it depends on: where light or object moved, the
 * picture is that of a view that never looked elsewhere. */
static void nothing_outdated_is_carried(void **state)
{
    (void)state;
    for (int object = 0; object < 2; object++) {
        struct rig r;
        furnished_room(&r, 0);
        r.settings.shadow_budget = 0;
        r.settings.reproject_shadows = true;
        pan(&r, 3);
        r.settings.camera.position.x += 0.02;
        if (object)
            rig_object(&r, "crate", "crate", "red", rig_v(-0.2, 0.5, -0.4));
        else
            put_lamp(&r, "lamp", 0.4, 100);
        rig_commit(&r);
        rig_pass(&r);
        rig_assert_as_fresh(&r, object ? "object moved" : "light moved");
        rig_end(&r);
    }
}

/* After a pan the eye rests, and a material gets another colour: samples of before the pan are not taken over again. */
static void a_recolour_after_a_pan_traces_nothing(void **state)
{
    (void)state;
    struct rig r;
    furnished_room(&r, 0);
    r.settings.reproject_shadows = true;
    pan(&r, 4);
    struct lum_material_desc blue = rig_diffuse(0.4f);
    blue.base_color = lum_rgb(0.1f, 0.1f, 0.7f);
    rig_material(&r, "red", &blue);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_int_equal(shadow_rays(&s), 0);
    r.settings.reproject_shadows = false; /* forgets all; must not look for what it no longer keeps */
    s = rig_pass(&r);
    assert_true(shadow_rays(&s) > 0);
    rig_end(&r);
}

static void nothing_to_light(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_room(&r);
    rig_commit(&r);
    set_live(&r, 1000);
    struct lum_pass_stats s = rig_pass(&r);
    assert_int_equal(shadow_rays(&s), 0);
    assert_true(rig_mean(&r).g == 0.0f);
    put_lamp(&r, "lamp", 0, 100);
    rig_commit(&r);
    r.settings.max_depth = 0;
    s = rig_pass(&r);
    assert_int_equal(shadow_rays(&s), 0);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lit_is_exact),
        cmocka_unit_test(cut_tiles_are_lit),
        cmocka_unit_test(umbra_is_black),
        cmocka_unit_test(a_wide_penumbra_is_smooth),
        cmocka_unit_test(places_lie_everywhere),
        cmocka_unit_test(agrees_with_whitted),
        cmocka_unit_test(budget_is_kept),
        cmocka_unit_test(edits_trace_nothing),
        cmocka_unit_test(moved_light_leaves_no_trace),
        cmocka_unit_test(order_of_lights_does_not_matter),
        cmocka_unit_test(any_size_and_any_threads),
        cmocka_unit_test(a_pan_learns),
        cmocka_unit_test(nothing_outdated_is_carried),
        cmocka_unit_test(a_recolour_after_a_pan_traces_nothing),
        cmocka_unit_test(nothing_to_light),
    };
    return cmocka_run_group_tests_name("penumbra", tests, NULL, NULL);
}
