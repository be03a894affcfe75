/* What glossy surfaces show in the first frame of `live` is no mottle: paths of several windows of the filter are
 * joined. */
#include "tests/support/rig.h"

#define SIZE 96u
#define SEEDS 16u
#define WINDOW 16.0 /* paths, of a pattern of 4 */

/* A brushed floor below a ceiling, of which the half on the left is white and the other black. A spot lights the
 * ceiling and not the floor. */
static void begin(struct rig *r)
{
    rig_begin(r, 2);
    struct lum_material_desc brushed = rig_diffuse(0.9f), white = rig_diffuse(0.8f), black = rig_diffuse(0.0f);
    brushed.metallic = 1.0f;
    brushed.roughness = 0.3f;
    rig_material(r, "brushed", &brushed);
    rig_material(r, "white", &white);
    rig_material(r, "black", &black);
    rig_square(r, "floor", 4);
    rig_box(r, "half", 4, 0.1, 8);
    rig_object(r, "floor", "floor", "brushed", rig_v(0, 0, 0));
    rig_object(r, "left", "half", "white", rig_v(-4, 3, 0));
    rig_object(r, "right", "half", "black", rig_v(4, 3, 0));
    struct lum_light_desc spot = rig_point(rig_v(0, 0.5, 0), 100);
    spot.kind = LUM_LIGHT_SPOT;
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
 * mean, and that of a window's mean no less than 1/16 of it. 0.64 of this is met by five windows (0.2 for equal
 * brightness of all that shines), and not by one: about 40 pixels along the seam times 16 seeds are 16 x 12
 * independent cells, whose variance is known to sqrt(2 / 192) = 10 %. */
static void first_frame_is_smooth(void **state)
{
    (void)state;
    struct rig r;
    double sum[SIZE] = {0}, squares[SIZE] = {0}, mean = 0.0, variance = 0.0;
    const uint32_t from = 12, to = SIZE - 12;
    begin(&r);
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
    assert_true(variance < 0.64 * mean * mean / WINDOW);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(first_frame_is_smooth),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
