/* What glossy surfaces show in the first frame of `live` is no mottle: paths of several windows of the filter are
 * joined; and no dots, but no light is lost for that. */
#include <string.h>

#include "core/effect/gloss/gloss.h"
#include "tests/support/rig.h"

#define SIZE 96u
#define SEEDS 16u
#define WINDOW 16.0 /* paths, of a pattern of 4 */

/* A brushed floor below a ceiling, of which a strip so wide on the left is white and the
 * rest reflects less. A spot lights the
 * ceiling and not the floor. */
static void begin(struct rig *r, double white_m, float rest)
{
    rig_begin(r, 2);
    struct lum_material_desc brushed = rig_diffuse(0.9f), white = rig_diffuse(0.8f), dark = rig_diffuse(rest);
    brushed.metallic = 1.0f;
    brushed.roughness = 0.3f;
    rig_material(r, "brushed", &brushed);
    rig_material(r, "white", &white);
    rig_material(r, "dark", &dark);
    rig_square(r, "floor", 4);
    rig_box(r, "strip", white_m / 2, 0.1, 8);
    rig_box(r, "half", 4, 0.1, 8);
    rig_object(r, "floor", "floor", "brushed", rig_v(0, 0, 0));
    rig_object(r, "left", "strip", "white", rig_v(-white_m / 2, 3, 0));
    rig_object(r, "right", "half", "dark", rig_v(4, 3, 0));
    struct lum_light_desc spot = rig_point(rig_v(0, 0.5, 0), 100);
    spot.kind = &lum_light_kind_spot;
    spot.direction = rig_v(0, 1, 0);
    spot.inner_cone_rad = 1.2;
    spot.outer_cone_rad = 1.3;
    rig_light(r, "spot", &spot);
    rig_camera(r, rig_v(0, 2.5, 0), rig_v(0, 0, 0), 40);
    r->settings.method = lum_method_find("live");
    r->settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    r->settings.antialias = false;
    r->settings.max_spp = 1;
    r->settings.w = r->settings.h = SIZE;
    rig_commit(r);
}

/* Below the seam one path in two meets nothing that shines: the variance of a path is no less than the square of the
 * mean, and that of a window's mean no less than 1/16 of it. The lobe is 0.09 wide, the ceiling 3 m away and a pixel 19
 * mm, so that seven windows each way are joined (core/effect/gloss/gloss_filter.c), by 1, 3/4, 1/2 and 1/4: a variance
 * of (2.75 / 4^2)^2 = 0.030 of a window's. Four times that is not met by one window, nor by five: in 72 rows and 16
 * seeds are at least 16 x 3 independent means, whose variance is known to sqrt(2 / 48) = 20 %. */
static void first_frame_is_smooth(void **state)
{
    (void)state;
    struct rig r;
    double sum[SIZE] = {0}, squares[SIZE] = {0}, mean = 0.0, variance = 0.0;
    const uint32_t from = 12, to = SIZE - 12;
    begin(&r, 8, 0.0f);
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        r.settings.seed = seed;
        rig_fresh_view(&r);
        struct lum_pass_stats stats = rig_pass(&r);
        assert_true(stats.rays[LUM_RAY_GLOSSY] > 0);
        for (uint32_t y = from; y < to; y++) {
            double v = (double)lum_film_mean(lum_view_film(r.view), SIZE / 2, y).g;
            sum[y] += v / SEEDS;
            squares[y] += v * v / SEEDS;
        }
    }
    for (uint32_t y = from; y < to; y++) {
        mean += sum[y] / (to - from);
        variance += (squares[y] - sum[y] * sum[y]) * SEEDS / (SEEDS - 1) / (to - from);
    }
    print_message("mean %g, variance %.3f of that of a window\n", mean, variance * WINDOW / (mean * mean));
    assert_true(mean > 0.0);
    assert_true(variance < 0.12 * mean * mean / WINDOW);
    rig_end(&r);
}

/* Mean of a pass's picture. */
static double brightness(struct rig *r, uint32_t seed)
{
    double sum = 0.0;
    r->settings.seed = seed;
    rig_fresh_view(r);
    assert_true(rig_pass(r).rays[LUM_RAY_GLOSSY] > 0);
    for (uint32_t y = 0; y < SIZE; y++)
        for (uint32_t x = 0; x < SIZE; x++)
            sum += (double)lum_film_mean(lum_view_film(r->view), x, y).g;
    return sum / (SIZE * SIZE);
}

struct spread {
    double mean, error; /* error: standard error of the mean */
};

static struct spread brightness_of(struct rig *r, const char *method)
{
    double sum = 0.0, squares = 0.0;
    r->settings.method = lum_method_find(method);
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        double v = brightness(r, seed);
        sum += v / SEEDS;
        squares += v * v / SEEDS;
    }
    return (struct spread){sum, sqrt(fmax(squares - sum * sum, 0.0) / (SEEDS - 1))};
}

/* A narrow strip is met by few paths, which are too bright to be shown: of all the light that they bring most. The
 * pixels around get it. Tolerance: four standard errors, of sixteen draws each. Where a tile's neighbours have less
 * than they are to get it stays away (GIVE_MOST): the strip is so wide that they have not. */
static void no_light_is_lost_to_tame_dots(void **state)
{
    (void)state;
    struct rig r;
    begin(&r, 0.25, 0.01f);
    struct spread path = brightness_of(&r, "path"), live = brightness_of(&r, "live");
    double tolerance = 4.0 * hypot(path.error, live.error);
    print_message("path %.5g +- %.2g, live %.5g +- %.2g\n", path.mean, path.error, live.mean, live.error);
    assert_true(tolerance < 0.1 * path.mean); /* else this shows nothing */
    assert_true(fabs(live.mean - path.mean) < tolerance);
    rig_end(&r);
}

static float luminance_of(struct lum_rgb *radiance, uint32_t n_lit, float bright, struct lum_gloss_tile *ret_tile)
{
    float whole = bright;
    memset(radiance, 0, LUM_TILE_PIXELS * sizeof *radiance);
    radiance[7] = lum_grey(bright);
    for (uint32_t i = 1; i < n_lit; i++, whole += 1.0f)
        radiance[7 + i] = lum_grey(1.0f);
    *ret_tile = (struct lum_gloss_tile){.kept = 0.0f};
    lum_gloss_tame(ret_tile, radiance, LUM_TILE_PIXELS, LUM_TILE_PIXELS);
    assert_float_equal(ret_tile->kept + ret_tile->cut, whole, 1e-5f * whole);
    return lum_luminance(radiance[7]);
}

/* A path that found something a hundred times as bright as the others did is limited by these, however few they are: to
 * 6 times (BRIGHTEST) their mean or that of all pixels, whichever is more. One like the others is not. No light is
 * lost. */
static void a_path_alone_is_no_dot(void **state)
{
    (void)state;
    struct lum_rgb radiance[LUM_TILE_PIXELS];
    struct lum_gloss_tile tile;
    const float n = (float)LUM_TILE_PIXELS;
    for (uint32_t n_lit = 2; n_lit <= 12; n_lit++) {
        float all = 6.0f * (100.0f + (float)(n_lit - 1)) / n;
        assert_true(luminance_of(radiance, n_lit, 100.0f, &tile) <= fmaxf(6.0f, all) * 1.00001f);
        assert_float_equal(luminance_of(radiance, n_lit, 1.0f, &tile), 1.0f, 0.0f);
        assert_float_equal(tile.cut, 0.0f, 0.0f);
    }
    assert_true(luminance_of(radiance, 1, 100.0f, &tile) <= 6.0f * 100.0f / n);
}

/* Under an even sky metals side by side, on one plane, show it each in its own colour, up to the seam: the filter is as
 * wide as it gets, and smooths what arrives. Tolerance: lobes of 0.09 reflect 1 to 2 % more or less by angle, and a
 * mean of 25 paths of SEEDS draws, weighted by G2 / G1 of up to 1.1, is known better than that. */
static void colours_of_metals_stay_sharp(void **state)
{
    (void)state;
    const double color[2] = {0.9, 0.1};
    double sum[SIZE] = {0};
    struct rig r;
    rig_begin(&r, 2);
    rig_box(&r, "half", 4, 0.1, 8);
    for (int i = 0; i < 2; i++) {
        struct lum_material_desc metal = rig_diffuse((float)color[i]);
        metal.metallic = 1.0f;
        metal.roughness = 0.3f;
        rig_material(&r, i ? "dark" : "bright", &metal);
        rig_object(&r, i ? "right" : "left", "half", i ? "dark" : "bright", rig_v(i ? 4 : -4, 0, 0));
    }
    rig_light(&r, "sky",
              &(struct lum_light_desc){
                  .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 1000, .on = true});
    rig_camera(&r, rig_v(0, 2.5, 0), rig_v(0, 0, 0), 40);
    r.settings.method = lum_method_find("live");
    r.settings.antialias = false;
    r.settings.max_spp = 1;
    r.settings.w = r.settings.h = SIZE;
    rig_commit(&r);
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        r.settings.seed = seed;
        rig_fresh_view(&r);
        assert_true(rig_pass(&r).rays[LUM_RAY_GLOSSY] > 0);
        for (uint32_t x = 0; x < SIZE; x++)
            sum[x] += (double)lum_film_mean(lum_view_film(r.view), x, SIZE / 2).g / SEEDS;
    }
    bool bright_left = sum[0] > sum[SIZE - 1];
    for (uint32_t x = SIZE / 4; x < 3 * SIZE / 4; x++) {
        double want = 1000 * color[(x < SIZE / 2) != bright_left];
        if (fabs(sum[x] - want) >= 0.05 * want)
            fail_msg("pixel %u: %.1f instead of %.1f cd/m2", x, sum[x], want);
    }
    rig_end(&r);
}

static double gloss_rays(float specular)
{
    struct rig r;
    begin(&r, 8, 0.8f);
    struct lum_material_desc plain = rig_diffuse(0.6f); /* but for its specular, what glTF has where nothing is said */
    plain.roughness = 1.0f;
    plain.specular = specular;
    rig_material(&r, "brushed", &plain);
    rig_commit(&r);
    double rays = 0.0;
    for (uint32_t seed = 0; seed < 4; seed++) {
        r.settings.seed = seed;
        rig_fresh_view(&r);
        rays += (double)rig_pass(&r).rays[LUM_RAY_GLOSSY];
    }
    rig_end(&r);
    return rays / (4.0 * SIZE * SIZE);
}

/* Gloss that brings little costs little, without a threshold below which it is left out: paths start four times as
 * often as it is a share of what its pixel reflects. Seen from above the default material reflects .0123 of its light
 * with a gloss (E for alpha 1, f0 .04) and .6 x .98 otherwise: .08 of the pixels send a path, most of one ray. A
 * quarter of the specular starts a quarter of them: 760 of 36,864 pixels, known to 4 %, and 3,000, to 2 %. */
static void what_brings_little_costs_little(void **state)
{
    (void)state;
    double whole = gloss_rays(1.0f), quarter = gloss_rays(0.25f), none = gloss_rays(0.0f);
    print_message("glossy rays a pixel: %.3f, with a quarter of the specular %.3f\n", whole, quarter);
    assert_true(none == 0.0);
    assert_true(whole > 0.0 && whole < 0.3);
    assert_true(quarter > 0.2 * whole && quarter < 0.3 * whole);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(first_frame_is_smooth),           cmocka_unit_test(no_light_is_lost_to_tame_dots),
        cmocka_unit_test(a_path_alone_is_no_dot),          cmocka_unit_test(colours_of_metals_stay_sharp),
        cmocka_unit_test(what_brings_little_costs_little),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
