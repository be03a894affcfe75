/* Interleaved methods against closed forms, against the path tracer, against the plain sum of their virtual point
 * lights and against each other. */
#include "tests/support/rig.h"

#include "core/effect/ais/ais.h"
#include "core/vpl/gather.h"
#include "core/vpl/vpl.h"

static const char *const names[] = {"igi", "ais", "ais-max"};
enum { IGI, AIS, AIS_MAX, METHODS };

static struct lum_pass_stats render(struct rig *r, const char *method)
{
    r->settings.method = lum_method_find(method);
    assert_non_null(r->settings.method);
    r->settings.antialias = false;
    rig_fresh_view(r);
    return rig_pass(r);
}

static double path_mean(struct rig *r, uint32_t spp)
{
    r->settings.method = lum_method_find("path");
    r->settings.max_spp = spp;
    r->settings.antialias = false;
    rig_fresh_view(r);
    while (rig_pass(r).spp < spp)
        ;
    return (double)rig_mean(r).g;
}

static uint64_t sum_of_map(const struct rig *r, enum lum_effect effect)
{
    const uint8_t *map = lum_view_guidance(r->view, effect);
    uint64_t sum = 0;
    assert_non_null(map);
    for (uint32_t i = 0; i < r->settings.w * r->settings.h; i++)
        sum += map[i];
    return sum;
}

/* ---- soft shadows ---- */

static void lit_floor(struct rig *r, const struct lum_material_desc *m, bool occluder)
{
    rig_material(r, "floor", m);
    rig_square(r, "floor", 3);
    rig_object(r, "floor", "floor", "floor", rig_v(0, 0, 0));
    struct lum_light_desc l = rig_quad(rig_v(0.3, 2, 0.1), rig_v(1, 0, 0), rig_v(0, 0, 1.5), 100);
    rig_light(r, "lamp", &l);
    if (occluder) {
        rig_square(r, "lid", 0.5);
        rig_object(r, "lid", "lid", "floor", rig_v(0.2, 1, 0.2));
    }
    rig_camera(r, rig_v(0.1, 1.6, 3), rig_v(0.2, 0, 0.2), 40);
    r->settings.max_depth = 1;
    rig_commit(r);
}

/* Unoccluded, solid angle sampling leaves only the cosine to vary over the light: nine stratified points know its mean
 * to well below 1 %, and the path tracer's 256 samples of 1536 pixels to below 0.1 %. */
static void unoccluded_light_equals_path(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    struct lum_material_desc m = rig_diffuse(0.8f);
    lit_floor(&r, &m, false);
    double want = path_mean(&r, 256);
    uint64_t rays[METHODS];
    for (int k = 0; k < METHODS; k++) {
        rays[k] = render(&r, names[k]).rays[LUM_RAY_SOFT_SHADOW];
        double got = (double)rig_mean(&r).g;
        if (!(fabs(got / want - 1.0) < 0.01))
            fail_msg("%s %.6f, path %.6f", names[k], got, want);
        assert_int_equal(sum_of_map(&r, LUM_EFFECT_SOFT_SHADOW) > 0, k == AIS_MAX);
    }
    assert_int_equal(rays[IGI], rays[AIS]);
    assert_int_equal(rays[AIS_MAX], 9 * rays[IGI]); /* every iteration traces what the first one does */
    rig_end(&r);
}

/* In a penumbra the visible share of the lamp is known to within about one sample: of nine or, wholly refined, of 81.
 * All pixels share their samples, so that the error does not average out over the picture, half of which is penumbra
 * where half of the lamp is seen: 1/9 and 1/81, times a quarter to a half. */
static void penumbra_equals_path(void **state)
{
    (void)state;
    const double tolerance[METHODS] = {0.055, 0.03, 0.006};
    struct rig r;
    rig_begin(&r, 0);
    struct lum_material_desc m = rig_diffuse(0.8f);
    lit_floor(&r, &m, true);
    double want = path_mean(&r, 256);
    uint64_t rays[METHODS];
    for (int k = 0; k < METHODS; k++) {
        rays[k] = render(&r, names[k]).rays[LUM_RAY_SOFT_SHADOW];
        double got = (double)rig_mean(&r).g;
        if (!(fabs(got / want - 1.0) < tolerance[k]))
            fail_msg("%s %.6f, path %.6f", names[k], got, want);
    }
    assert_true(rays[IGI] < rays[AIS] && rays[AIS] < rays[AIS_MAX]);
    rig_end(&r);
}

/* Refined where the lamp is partly hidden, and nowhere else. */
static void refines_penumbrae_only(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    struct lum_material_desc m = rig_diffuse(0.8f);
    lit_floor(&r, &m, true);
    render(&r, "ais");
    const uint8_t *map = lum_view_guidance(r.view, LUM_EFFECT_SOFT_SHADOW);
    uint32_t n[LUM_GUIDANCE_MAX + 1] = {0}, w = r.settings.w, h = r.settings.h;
    for (uint32_t y = 0; y < h; y++)
        for (uint32_t x = 0; x < w; x++) {
            assert_true(map[y * w + x] < LUM_AIS_SUBSETS);
            n[map[y * w + x]]++;
            /* a tile is refined as a whole */
            assert_int_equal(map[y * w + x],
                             map[y / LUM_AIS_SIDE * LUM_AIS_SIDE * w + x / LUM_AIS_SIDE * LUM_AIS_SIDE]);
        }
    assert_true(n[0] > w * h / 4 && w * h - n[0] > w * h / 16);
    rig_end(&r);
}

/* A coat over a diffuse base: what it reflects and what it lets through are in two components, and add up. */
static void coated_surfaces_equal_path(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    struct lum_material_desc m = lum_material_default();
    m.base_color = lum_rgb(0.6f, 0.5f, 0.4f);
    m.roughness = 0.5f;
    lit_floor(&r, &m, false);
    double want = path_mean(&r, 256);
    for (int k = 0; k < METHODS; k++) {
        struct lum_pass_stats s = render(&r, names[k]);
        double got = (double)rig_mean(&r).g;
        assert_true(s.demand.on[LUM_EFFECT_GLOSSY]);
        /* nine points of a lobe of roughness 0.5: within 2 %; the mean albedo alone is 4 % off */
        if (!(fabs(got / want - 1.0) < 0.02))
            fail_msg("%s %.6f, path %.6f", names[k], got, want);
    }
    rig_end(&r);
}

/* Coated planks side by side, of albedo 0.1 and, every second one, `other`; a lamp beside them lights them at four
 * degrees. */
static void lay_planks(struct rig *r, float other)
{
    struct lum_material_desc dark = lum_material_default(), bright;
    dark.roughness = 0.3f;
    bright = dark;
    dark.base_color = lum_grey(0.1f);
    bright.base_color = lum_grey(other);
    rig_material(r, "dark", &dark);
    rig_material(r, "bright", &bright);
    const double p[] = {-0.03, 0, -3, -0.03, 0, 3, 0.03, 0, 3, 0.03, 0, -3};
    const uint32_t i[] = {0, 1, 2, 0, 2, 3};
    rig_mesh(r, "plank", p, 4, i, 2);
    for (int k = 0; k < 24; k++) {
        char id[16];
        snprintf(id, sizeof id, "plank-%d", k);
        rig_object(r, id, "plank", k % 2 ? "bright" : "dark", rig_v(0.06 * k - 0.72, 0, 0));
    }
    struct lum_light_desc lamp = rig_quad(rig_v(4, 0.3, 0), rig_v(0, 0, 1), rig_v(0, 0.4, 0), 100);
    lamp.camera_visible = false;
    rig_light(r, "lamp", &lamp);
    rig_camera(r, rig_v(0, 0.3, 3), rig_v(0, 0, 0), 12);
    r->settings.max_depth = 1;
    rig_commit(r);
}

/* Of light that grazes, a coat of roughness 0.3 lets less than half of its mean through. The filter averages this over
 * planks of both kinds. Were it told as light, a dark plank would lose what a bright one does, which is more than it
 * has. It is told as a share of the albedo, which hangs on the colour only by what facets send on that light meets
 * twice: 1 % of it is not of the base, beside 0.1 of the dark base, of which half comes through: a fifth of the share
 * at most, and where the other half of the window has the same share, half of that. */
static void dark_planks_keep_their_light(void **state)
{
    (void)state;
    for (int k = 0; k < METHODS; k++) {
        struct rig r[2];
        double sum[2] = {0};
        for (int other = 0; other < 2; other++) {
            rig_begin(&r[other], 0);
            lay_planks(&r[other], other ? 0.9f : 0.1f);
            render(&r[other], names[k]);
        }
        const struct lum_film *all_dark = lum_view_film(r[0].view), *mixed = lum_view_film(r[1].view);
        for (uint32_t i = 0; i < all_dark->w * all_dark->h; i++) {
            double a = (double)lum_film_mean(all_dark, i % all_dark->w, i / all_dark->w).g;
            double b = (double)lum_film_mean(mixed, i % mixed->w, i / mixed->w).g;
            assert_true(a >= 0.0 && b >= 0.0);
            if (b < 2.0 * a) { /* a dark one */
                sum[0] += a;
                sum[1] += b;
            }
        }
        if (!(sum[0] > 0.0 && fabs(sum[1] / sum[0] - 1.0) < 0.1))
            fail_msg("%s: dark planks give %.4f among bright ones, %.4f among dark ones", names[k], sum[1], sum[0]);
        rig_end(&r[0]);
        rig_end(&r[1]);
    }
}

/* ---- indirect light ---- */

/* An empty room, where every virtual point light sees every wall, lit by a point whose own light is left out. */
static void empty_room(struct rig *r)
{
    rig_box(r, "room", 2, 1.5, 2);
    rig_diffuse_object(r, "room", "white", 0.75f, rig_v(0, 1.5, 0));
    rig_bulb(r, "bulb", rig_v(0.5, 2, 0.3), 100);
    rig_camera(r, rig_v(-0.3, 1.4, 1.5), rig_v(0.2, 0.9, -2), 1);
    r->settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_DIRECT);
    r->settings.w = r->settings.h = 18;
    rig_commit(r);
}

/* Radiance of the point in the middle of the picture by the plain sum over all virtual point lights. */
static double plain_sum(struct rig *r)
{
    struct lum_vpl_set set = {0};
    struct lum_counters counters = {0};
    struct lum_vpl_request request = {.snapshot = r->snapshot,
                                      .n = r->settings.n_vpls,
                                      .max_bounces = r->settings.max_depth - 1,
                                      .seed = r->settings.seed,
                                      .counters = &counters};
    RIG_OK(lum_vpl_update(&set, &request, &err));
    struct lum_pick pick;
    lum_pick_at(r->snapshot, &r->settings.camera, r->settings.w, r->settings.h, r->settings.w * 0.5,
                r->settings.h * 0.5, &pick);
    assert_true(pick.hit);
    struct lum_gather_points points = {.n_points = 1, .n = {pick.normal}, .ng = {pick.normal}};
    points.p[0] = rig_to_scene(r, pick.point_world.x, pick.point_world.y, pick.point_world.z);
    uint32_t slots[LUM_VPL_DEFAULT];
    assert_int_equal(set.n, LUM_VPL_DEFAULT);
    for (uint32_t k = 0; k < set.n; k++)
        slots[k] = k;
    struct lum_rgb irradiance = lum_grey(0.0f);
    uint16_t missed = 0;
    lum_vpl_gather(&(struct lum_gather){.snapshot = r->snapshot,
                                        .set = &set,
                                        .slots = slots,
                                        .n_slots = set.n,
                                        .bound = lum_vpl_bound(set.spacing),
                                        .points = &points,
                                        .irradiance = &irradiance,
                                        .missed = &missed,
                                        .counters = &counters});
    lum_vpl_finish(&set);
    assert_int_equal(missed, 0);
    return 0.75 / 3.14159265358979323846 * (double)irradiance.g;
}

/* The filter puts the nine subsets together again, whatever the resolution and however many iterations: the picture
 * shows 6 cm of a wall 3.5 m away, over which the sum changes by less than 1 % to either side. */
static void subsets_make_up_the_sum(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    empty_room(&r);
    r.settings.w = r.settings.h = 36;
    double want = plain_sum(&r);
    uint64_t rays[METHODS];
    for (int k = 0; k < METHODS; k++) {
        rays[k] = render(&r, names[k]).rays[LUM_RAY_INDIRECT_DIFFUSE];
        const struct lum_film *f = lum_view_film(r.view);
        for (uint32_t y = 0; y < f->h; y++)
            for (uint32_t x = 0; x < f->w; x++) {
                double got = (double)lum_film_mean(f, x, y).g;
                if (!(fabs(got / want - 1.0) < 0.01))
                    fail_msg("%s: pixel %u,%u %.6f, sum %.6f", names[k], x, y, got, want);
            }
    }
    assert_int_equal(rays[IGI], 16 * rays[AIS]); /* 36 x 36 are whole tiles at both resolutions */
    assert_int_equal(rays[AIS_MAX], 9 * rays[AIS]);
    rig_end(&r);
}

/* Where nothing is occluded nothing is refined. Where all is, it is refined by the share of the virtual point lights
 * that face a tile (listing 5.2): of those on the inside of a box at least the ones on its far side, a sixth of them,
 * hence ceil(9 / 6) iterations, and less than all, since those on its near side face away. */
static void refines_where_occluded(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    empty_room(&r);
    render(&r, "ais");
    assert_int_equal(sum_of_map(&r, LUM_EFFECT_INDIRECT_DIFFUSE), 0);
    rig_box(&r, "box", 0.1, 0.1, 0.1); /* around the light: what it lights is hidden from the walls */
    rig_object(&r, "box", "box", "white", rig_v(0.5, 2, 0.3));
    rig_commit(&r);
    render(&r, "ais");
    uint32_t sum = sum_of_map(&r, LUM_EFFECT_INDIRECT_DIFFUSE);
    assert_in_range(sum, 2 * 18 * 18, (LUM_AIS_SUBSETS - 2) * 18 * 18);
    assert_true(lum_rgb_black(rig_mean(&r)));
    rig_end(&r);
}

/* Pixels that no coarse sample serves get the exact sum: a grating of strips one pixel wide. */
static void unserved_pixels_are_computed(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_room(&r);
    rig_bulb(&r, "bulb", rig_v(0.5, 2, 1.5), 100);
    rig_box(&r, "rod", 0.004, 1, 0.004);
    for (int k = 0; k < 12; k++) {
        char id[8];
        snprintf(id, sizeof id, "rod%d", k);
        rig_object(&r, id, "rod", "white", rig_v(-0.8 + 0.12 * k, 1.4, 0.6));
    }
    rig_commit(&r);
    r.settings.w = 151;
    r.settings.h = 101;
    r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_DIRECT);
    render(&r, "ais-max");
    const struct lum_film *f = lum_view_film(r.view);
    uint32_t n_black = 0;
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 0; x < f->w; x++)
            n_black += lum_rgb_black(lum_film_mean(f, x, y));
    assert_int_equal(n_black, 0); /* no pixel of a closed room is without indirect light */
    rig_end(&r);
}

/* ---- media ---- */

/* A picture of 9 x 9 pixels within a hundredth of a degree of one ray of length d, past a point light at distance D and
 * angle gamma, in fog that only scatters: Sun et al. 2005, values from reference quadrature. Marching with 81 times 8
 * steps by the midpoint rule errs by step^2 / 24 times the change of the integrand's slope: below 1e-3 for these, whose
 * light is seen more than a step away. */
static void airlight_equals_closed_form(void **state)
{
    (void)state;
    const struct {
        double b, light, gamma, d, want;
    } cases[] = {{0.1, 5, 0.3, 20, 0.00709172018}, {1, 2, 0.1, 5, 0.118495746}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(cases); k++) {
        struct rig r;
        rig_begin(&r, 0);
        rig_box(&r, "wall", 30, 30, 0.5);
        rig_diffuse_object(&r, "wall", "black", 0.0f, rig_v(0, 0, -cases[k].d - 0.5));
        struct lum_light_desc l =
            rig_point(rig_v(cases[k].light * sin(cases[k].gamma), 0, -cases[k].light * cos(cases[k].gamma)), 1);
        rig_light(&r, "bulb", &l);
        struct lum_medium_desc fog = {.sigma_s = lum_grey((float)cases[k].b), .everywhere = true};
        RIG_OK(lum_scene_put_medium(r.scene, "fog", &fog, &err));
        rig_commit(&r);
        rig_camera(&r, rig_v(0, 0, 0), rig_v(0, 0, -1), 1);
        r.settings.w = r.settings.h = 9;
        render(&r, "ais-max");
        double got = (double)lum_film_mean(lum_view_film(r.view), 4, 4).g;
        if (!(fabs(got / cases[k].want - 1.0) < 0.01))
            fail_msg("b %g: %.9f, closed form %.9f", cases[k].b, got, cases[k].want);
        rig_end(&r);
    }
}

/* ---- hard cases ---- */

static void furnish(struct rig *r)
{
    rig_room(r);
    struct lum_light_desc lamp = rig_quad(rig_v(0, 2.9, 0), rig_v(0.5, 0, 0), rig_v(0, 0, -0.5), 500);
    rig_light(r, "lamp", &lamp);
    rig_bulb(r, "bulb", rig_v(-1, 2, 0.5), 20);
    struct lum_medium_desc fog = {.sigma_s = lum_grey(0.1f), .lo = rig_v(-2, 0, -2), .hi = rig_v(2, 1, 2)};
    RIG_OK(lum_scene_put_medium(r->scene, "fog", &fog, &err));
}

static void any_size(void **state)
{
    (void)state;
    const uint32_t sizes[][2] = {{1, 1}, {1, 13}, {13, 1}, {2, 3}, {47, 49}, {97, 5}};
    struct rig r;
    rig_begin(&r, 2);
    furnish(&r);
    rig_commit(&r);
    for (size_t i = 0; i < LUM_ARRAY_LEN(sizes); i++)
        for (int k = 0; k < METHODS; k++) {
            r.settings.w = sizes[i][0];
            r.settings.h = sizes[i][1];
            render(&r, names[k]);
            assert_true(rig_mean(&r).g > 0.0f);
        }
    rig_end(&r);
}

static void same_bits_for_any_number_of_threads(void **state)
{
    (void)state;
    for (int k = 0; k < METHODS; k++) {
        struct lum_rgb *picture = NULL;
        for (uint32_t threads = 1; threads <= 5; threads += 2) {
            struct rig r;
            rig_begin(&r, threads);
            furnish(&r);
            rig_commit(&r);
            r.settings.w = 100;
            r.settings.h = 70;
            render(&r, names[k]);
            if (picture)
                rig_assert_picture(&r, picture, names[k]);
            else
                picture = rig_picture(&r);
            rig_end(&r);
        }
        lum_free(picture);
    }
}

static void no_light(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_room(&r);
    rig_commit(&r);
    for (int k = 0; k < METHODS; k++) {
        struct lum_pass_stats s = render(&r, names[k]);
        assert_int_equal(rig_all_rays(&s), s.rays[LUM_RAY_PRIMARY]);
        assert_true(lum_rgb_black(rig_mean(&r)));
    }
    rig_end(&r);
}

static void nothing_at_all(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_commit(&r);
    for (int k = 0; k < METHODS; k++) {
        render(&r, names[k]);
        assert_true(lum_rgb_black(rig_mean(&r)));
    }
    rig_end(&r);
}

static void camera_in_a_wall(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    furnish(&r);
    rig_commit(&r);
    rig_camera(&r, rig_v(0.5, 0.5, -0.4), rig_v(1, 0.5, -0.4), 60); /* inside the crate */
    for (int k = 0; k < METHODS; k++)
        render(&r, names[k]);
    rig_camera(&r, rig_v(2, 1.5, 0), rig_v(0, 1.5, 0), 60); /* in the plane of a wall */
    for (int k = 0; k < METHODS; k++)
        render(&r, names[k]);
    rig_end(&r);
}

/* An effect that the scene does not call for, or that the view switches off, traces nothing and changes no bit of what
 * remains. */
static void effects_left_out_cost_nothing(void **state)
{
    (void)state;
    for (int k = 0; k < METHODS; k++) {
        struct rig r;
        rig_begin(&r, 2);
        rig_room(&r);
        rig_bulb(&r, "bulb", rig_v(-1, 2, 0.5), 20);
        rig_commit(&r);
        struct lum_pass_stats s = render(&r, names[k]);
        assert_int_equal(s.rays[LUM_RAY_SOFT_SHADOW] + s.rays[LUM_RAY_ENVIRONMENT] + s.rays[LUM_RAY_MEDIA] +
                             s.rays[LUM_RAY_GLOSSY],
                         0);
        assert_true(s.rays[LUM_RAY_INDIRECT_DIFFUSE] > 0);
        struct lum_rgb *plain = rig_picture(&r);
        r.settings.effects_on = LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW) | LUM_EFFECT_BIT(LUM_EFFECT_MEDIA) |
                                LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY) | LUM_EFFECT_BIT(LUM_EFFECT_ENVIRONMENT);
        s = render(&r, names[k]);
        rig_assert_picture(&r, plain, names[k]);
        assert_int_equal(s.rays[LUM_RAY_SOFT_SHADOW] + s.rays[LUM_RAY_ENVIRONMENT] + s.rays[LUM_RAY_MEDIA], 0);
        r.settings.effects_on = 0;
        r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
        s = render(&r, names[k]);
        assert_int_equal(s.rays[LUM_RAY_INDIRECT_DIFFUSE] + s.rays[LUM_RAY_VPL], 0);
        lum_free(plain);
        rig_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(unoccluded_light_equals_path),
        cmocka_unit_test(penumbra_equals_path),
        cmocka_unit_test(refines_penumbrae_only),
        cmocka_unit_test(coated_surfaces_equal_path),
        cmocka_unit_test(dark_planks_keep_their_light),
        cmocka_unit_test(subsets_make_up_the_sum),
        cmocka_unit_test(refines_where_occluded),
        cmocka_unit_test(unserved_pixels_are_computed),
        cmocka_unit_test(airlight_equals_closed_form),
        cmocka_unit_test(any_size),
        cmocka_unit_test(same_bits_for_any_number_of_threads),
        cmocka_unit_test(no_light),
        cmocka_unit_test(nothing_at_all),
        cmocka_unit_test(camera_in_a_wall),
        cmocka_unit_test(effects_left_out_cost_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
