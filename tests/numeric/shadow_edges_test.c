/* Anti-aliasing of hard shadows in `live`: pixels at an edge against the mean of many finer ones, and edits. */
#include "tests/support/rig.h"

#include <math.h>

#define FINE 8u

/* A floor under a bulb, in part in the shadow of a triangle, seen from between the two. */
static void shadowed_floor(struct rig *r, uint32_t threads)
{
    static const double corners[] = {-0.3, 2.4, -0.4, 0.5, 2.4, 0.1, -0.1, 2.4, 0.5};
    static const uint32_t triangle[] = {0, 1, 2};
    rig_begin(r, threads);
    rig_square(r, "floor", 6);
    rig_diffuse_object(r, "floor", "floor", 0.5f, rig_v(0, 0, 0));
    rig_mesh(r, "board", corners, 3, triangle, 1);
    rig_object(r, "board", "board", "floor", rig_v(0, 0, 0));
    rig_bulb(r, "bulb", rig_v(0.1, 4, 0.1), 100);
    rig_camera(r, rig_v(0, 2.3, 0), rig_v(0, 0, 0), 60);
    rig_commit(r);
    r->settings.method = lum_method_find("live");
    r->settings.effects_off = 1u << LUM_EFFECT_INDIRECT_DIFFUSE;
    r->settings.antialias = true;
    r->settings.max_spp = 1;
}

/* The picture again, without anti-aliasing, of FINE * FINE pixels for each. */
static float *fine_means(struct rig *r)
{
    uint32_t w = r->settings.w, h = r->settings.h;
    float *mean = lum_calloc((size_t)w * h, sizeof *mean);
    assert_non_null(mean);
    r->settings.w *= FINE;
    r->settings.h *= FINE;
    r->settings.antialias = false;
    rig_pass(r);
    for (uint32_t y = 0; y < h * FINE; y++)
        for (uint32_t x = 0; x < w * FINE; x++)
            mean[y / FINE * w + x / FINE] += lum_film_mean(lum_view_film(r->view), x, y).g / (FINE * FINE);
    r->settings.w = w;
    r->settings.h = h;
    r->settings.antialias = true;
    return mean;
}

/* Root mean square error over pixels that are lit in part, relative to what lights them whole; how many there are. */
static double error_at_edges(const struct rig *r, const float *mean, uint32_t *ret_n)
{
    double sum = 0.0;
    *ret_n = 0;
    for (uint32_t y = 0; y < r->settings.h; y++)
        for (uint32_t x = 0; x < r->settings.w; x++) {
            double dx = (x + 0.5) / r->settings.h - 0.5 * r->settings.w / r->settings.h,
                   dy = (y + 0.5) / r->settings.h - 0.5;
            double half = 2.0 * 2.3 * tan(30.0 * LUM_PI_D / 180.0), px = dx * half - 0.1, pz = dy * half - 0.1;
            double square = 16.0 + px * px + pz * pz, whole = 100.0 * 4.0 / (square * sqrt(square)) * 0.5 / LUM_PI_D;
            double share = (double)mean[y * r->settings.w + x] / whole;
            if (share < 0.02 || share > 0.98)
                continue;
            double e = (double)lum_film_mean(lum_view_film(r->view), x, y).g / whole - share;
            sum += e * e;
            (*ret_n)++;
        }
    return sqrt(sum / *ret_n);
}

/* Of the middle alone a share that is as likely to be any is off by 1 / sqrt(12) = 0.29. Five points, each row and
 * column of a quarter of the pixel with one of them, are off by a step of 1/5 at most where the edge runs along an
 * axis, half of it on average: 0.1; 0.12 leaves room for slanted ones. */
static void a_pixel_is_lit_in_part(void **state)
{
    (void)state;
    struct rig r;
    uint32_t n;
    shadowed_floor(&r, 0);
    float *mean = fine_means(&r);
    struct lum_pass_stats s = rig_pass(&r);
    double smooth = error_at_edges(&r, mean, &n);
    assert_true(n > 50);
    assert_true(s.rays[LUM_RAY_ANTIALIAS] > 0 &&
                s.rays[LUM_RAY_ANTIALIAS] < 32u * n); /* four for it and those around */
    r.settings.antialias = false;
    s = rig_pass(&r);
    assert_int_equal(s.rays[LUM_RAY_ANTIALIAS], 0);
    double hard = error_at_edges(&r, mean, &n);
    if (!(smooth < 0.12 && hard > 0.2))
        fail_msg("%u pixels at edges are off by %.3f, by %.3f without anti-aliasing", n, smooth, hard);
    lum_free(mean);
    rig_end(&r);
}

/* At the foot of a wall points in a pixel lie behind it: they are no shadow, though the shadow of a post that runs up
 * the wall has one look for edges there. The bulb is as far above the foot as before the wall, so that both are as
 * bright. */
static void no_shadow_at_the_foot_of_a_wall(void **state)
{
    (void)state;
    struct rig r;
    uint32_t n = 0;
    shadowed_floor(&r, 0);
    rig_bulb(&r, "bulb", rig_v(0, 2, 1.5), 100);
    rig_box(&r, "wall", 3, 0.5, 0.3);
    rig_object(&r, "wall", "wall", "floor", rig_v(0, 0.5, -0.8));
    rig_box(&r, "post", 0.03, 0.2, 0.03);
    rig_object(&r, "post", "post", "floor", rig_v(0, 0.5, 0.1));
    rig_camera(&r, rig_v(0.2, 1.2, 1), rig_v(0.1, 0.1, -0.5), 40);
    rig_commit(&r);
    r.settings.antialias = false;
    rig_pass(&r);
    struct lum_rgb *hard = rig_picture(&r);
    r.settings.antialias = true;
    struct lum_pass_stats s = rig_pass(&r);
    assert_true(s.rays[LUM_RAY_ANTIALIAS] > 0);
    for (uint32_t y = 1; y + 1 < r.settings.h; y++)
        for (uint32_t x = 1; x + 1 < r.settings.w; x++) {
            float least = INFINITY, most = 0.0f, smooth = lum_film_mean(lum_view_film(r.view), x, y).g;
            for (uint32_t k = 0; k < 9; k++) {
                float around = hard[(y + k / 3 - 1) * r.settings.w + x + k % 3 - 1].g;
                least = lum_min(least, around);
                most = lum_max(most, around);
            }
            if (!(least > 0.85f * most)) /* a shadow, or an edge of what is lit otherwise */
                continue;
            n++;
            if (!(smooth > 0.99f * least)) /* what is smoothed is a mean of these nine; floats */
                fail_msg("pixel %u,%u is %g, and those around are %g or more", x, y, (double)smooth, (double)least);
        }
    assert_true(n > r.settings.w * r.settings.h / 2);
    lum_free(hard);
    rig_end(&r);
}

static void edits_ask_nothing(void **state)
{
    (void)state;
    struct rig r;
    shadowed_floor(&r, 0);
    rig_pass(&r);
    rig_bulb(&r, "bulb", rig_v(0.1, 4, 0.1), 30);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_int_equal(rig_all_rays(&s), 0);
    rig_assert_as_fresh(&r, "dimmed");

    struct lum_material_desc red = rig_diffuse(0.5f);
    red.base_color = lum_rgb(0.7f, 0.1f, 0.1f);
    rig_material(&r, "floor", &red);
    rig_commit(&r);
    s = rig_pass(&r);
    assert_int_equal(rig_all_rays(&s), 0);
    rig_assert_as_fresh(&r, "painted");

    rig_object(&r, "board", "board", "floor", rig_v(0.2, 0, 0.1));
    rig_commit(&r);
    rig_pass(&r);
    rig_assert_as_fresh(&r, "moved");

    /* of glass that scatters light through, and back: what it asked for the other side is forgotten */
    struct lum_material_desc glass = rig_diffuse(0.5f);
    glass.transmission = 1.0f;
    glass.roughness = 0.5f;
    rig_material(&r, "floor", &glass);
    rig_commit(&r);
    rig_pass(&r);
    rig_assert_as_fresh(&r, "of glass");
    rig_material(&r, "floor", &red);
    rig_commit(&r);
    rig_pass(&r);
    rig_assert_as_fresh(&r, "of no glass");
    rig_end(&r);
}

static void any_size_and_any_threads(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {1, 40}, {40, 1}, {17, 33}, {97, 53}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(sizes); i++) {
        struct lum_rgb *one = NULL;
        for (uint32_t threads = 1; threads <= 7; threads += 3) {
            struct rig r;
            shadowed_floor(&r, threads);
            r.settings.w = sizes[i][0];
            r.settings.h = sizes[i][1];
            r.settings.camera.vfov_deg = sizes[i][1] == 1 ? 3.0 : 60.0;
            struct lum_pass_stats s = rig_pass(&r);
            if (i > 0 && s.rays[LUM_RAY_ANTIALIAS] == 0)
                fail_msg("no edge in a picture of %u x %u", sizes[i][0], sizes[i][1]);
            one = one ? one : rig_picture(&r);
            rig_assert_picture(&r, one, "by other threads");
            rig_end(&r);
        }
        lum_free(one);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_pixel_is_lit_in_part),
        cmocka_unit_test(no_shadow_at_the_foot_of_a_wall),
        cmocka_unit_test(edits_ask_nothing),
        cmocka_unit_test(any_size_and_any_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
