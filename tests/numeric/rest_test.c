/* `live` while a picture rests: passes that are cut short, and what pictures depend on. */
#include "tests/support/cut_short.h"

static void put_lamp(struct rig *r, double x)
{
    struct lum_light_desc l = rig_quad(rig_v(x, 2.8, 0), rig_v(1, 0, 0), rig_v(0, 0, 0.7), 100);
    rig_light(r, "lamp", &l);
}

static void shadowed_room(struct rig *r, uint32_t budget)
{
    rig_begin(r, 2);
    rig_room(r);
    put_lamp(r, -0.5);
    rig_commit(r);
    r->settings.method = lum_method_find("live");
    r->settings.effects_off = 1u << LUM_EFFECT_INDIRECT_DIFFUSE;
    r->settings.max_spp = 0;
    r->settings.shadow_budget = budget;
    r->settings.deterministic = false;
}

/* What there is after so many passes of a view that knew nothing: a fast frame, and samples. */
static struct lum_rgb *picture_after(struct rig *r, uint32_t passes)
{
    rig_fresh_view(r);
    for (uint32_t i = 0; i < passes; i++)
        rig_pass(r);
    return rig_picture(r);
}

/* ---- passes that are cut short ---- */

/* The second sample, cut short wherever it can be: the film shows the frame, the corrected picture, or some rows of
 * each. Afterwards all is as if it had not been, the next time samples are shown. */
static void cancelled_at_rest(void **state)
{
    (void)state;
    struct rig r;
    shadowed_room(&r, UINT32_MAX);
    struct lum_rgb *later = picture_after(&r, 5);
    uint32_t n_cancelled = 0;
    for (uint32_t loop = 1;; loop++) {
        struct lum_pass_stats stats;
        uint32_t left;
        lum_free(picture_after(&r, 2));
        bool cut = pass_is_cut_short(&r, loop, 3, &stats, &left);
        if (left > 0) /* it has not so many */
            break;
        if (!cut)
            continue; /* all jobs were begun */
        n_cancelled++;
        while (stats.spp < 5)
            stats = rig_pass(&r);
        rig_assert_picture(&r, later, "after a pass that was cut short");
    }
    assert_true(n_cancelled > 3);
    lum_free(later);
    rig_end(&r);
}

/* ---- where it ends ---- */

/* The last samples are there, and the picture of them is cut short: it is made up for, and not complete before. */
static void last_correction_cancelled(void **state)
{
    (void)state;
    struct rig r;
    shadowed_room(&r, 0);
    r.settings.max_spp = 5;
    struct lum_rgb *last = picture_after(&r, 5);
    uint32_t n_owed = 0;
    for (uint32_t loop = 1;; loop++) {
        struct lum_pass_stats stats;
        uint32_t left;
        lum_free(picture_after(&r, 4));
        bool cut = pass_is_cut_short(&r, loop, 1, &stats, &left);
        if (left > 0)
            break;
        n_owed += cut && stats.spp == 5;
        assert_true(!cut || !stats.complete);
        for (int i = 0; i < 4; i++)
            stats = rig_pass(&r);
        assert_true(stats.complete);
        rig_assert_picture(&r, last, "after the last correction was cut short");
    }
    assert_true(n_owed > 3);
    lum_free(last);
    rig_end(&r);
}

/* The picture is not made after each sample, but after the last ones: they change it. */
static void last_samples_show(void **state)
{
    (void)state;
    struct rig r;
    shadowed_room(&r, 0);
    for (uint32_t max_spp = 5; max_spp <= 41; max_spp += 12) { /* a frame, and an even number of samples */
        r.settings.max_spp = max_spp;
        struct lum_rgb *before = picture_after(&r, max_spp - 2), *last = picture_after(&r, max_spp);
        size_t n = (size_t)lum_view_film(r.view)->w * lum_view_film(r.view)->h;
        if (!memcmp(before, last, n * sizeof *last))
            fail_msg("samples %u and %u of %u change nothing", max_spp - 1, max_spp, max_spp);
        lum_free(before);
        lum_free(last);
    }
    rig_end(&r);
}

/* ---- what is said of its error ---- */

static double luminance_at(const struct lum_rgb *picture, size_t i)
{
    return (double)lum_luminance(picture[i]);
}

/* A lamp seen in a room: nearly all of the error is along its edges, of pixels that show a part of it. Were the frame's
 * places within a pixel those of the samples, these would not tell. What is said is a bound by 95 % of the error of the
 * picture, to which a draw with few such pixels adds its own chance: it holds for the mean of the squares of sixteen
 * draws. References: two independent ones, whose noise is kept out by taking the product of the differences. */
static void the_error_of_edges_is_said(void **state)
{
    (void)state;
    struct rig r;
    struct lum_rgb *reference[2];
    double said = 0.0, is = 0.0, mean = 0.0;
    const uint32_t draws = 16;
    shadowed_room(&r, UINT32_MAX);
    rig_camera(&r, rig_v(-0.3, 1.4, 1.8), rig_v(0.2, 1.9, -0.5), 60);
    r.settings.antialias = true;
    r.settings.w = 192;
    r.settings.h = 128;
    const struct lum_method *live = r.settings.method;
    r.settings.method = lum_method_find("path");
    for (uint32_t k = 0; k < 2; k++) {
        r.settings.seed = 1000 + k;
        reference[k] = picture_after(&r, 256);
    }
    r.settings.method = live;
    const size_t n = (size_t)lum_view_film(r.view)->w * lum_view_film(r.view)->h;
    for (size_t i = 0; i < n; i++)
        mean += luminance_at(reference[0], i) / (double)n;
    for (uint32_t draw = 0; draw < draws; draw++) {
        r.settings.seed = draw;
        rig_fresh_view(&r);
        struct lum_pass_stats stats;
        do
            stats = rig_pass(&r);
        while (stats.spp < 11);
        struct lum_rgb *picture = rig_picture(&r);
        for (size_t i = 0; i < n; i++) {
            double y = luminance_at(picture, i);
            is += (y - luminance_at(reference[0], i)) * (y - luminance_at(reference[1], i)) / ((double)n * mean * mean);
        }
        said += stats.error.bound * stats.error.bound;
        lum_free(picture);
    }
    print_message("relative squared error %g, %g is said\n", is / draws, said / draws);
    assert_true(is < said && said < 4.0 * is);
    lum_free(reference[0]);
    lum_free(reference[1]);
    rig_end(&r);
}

#define LAMP_CD_M2 1000.0

/* A lamp all over a wall behind a pane, and before that, at eye level, a white bar of two fifths of a pixel, which no
 * ray through the centre of a pixel meets: between two rows of an even number. */
static void put_barred_window(struct rig *r)
{
    struct lum_material_desc grey = rig_diffuse(0.2f), glass = lum_material_default();
    glass.base_color = lum_grey(1.0f);
    glass.transmission = 1.0f;
    glass.thin = true;
    glass.roughness = 0.0f;
    rig_material(r, "grey", &grey);
    rig_material(r, "glass", &glass);
    rig_box(r, "room", 2, 1.5, 2);
    rig_object(r, "room", "room", "grey", rig_v(0, 1.5, 0));
    struct lum_light_desc l = rig_quad(rig_v(0, 1.4, -1.5), rig_v(2.4, 0, 0), rig_v(0, 2, 0), LAMP_CD_M2);
    rig_light(r, "lamp", &l);
    const double pane[] = {-0.9, 0.7, -1.2, 0.9, 0.7, -1.2, 0.9, 2.1, -1.2, -0.9, 2.1, -1.2};
    const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    rig_mesh(r, "pane", pane, 4, indices, 2);
    rig_object(r, "pane", "pane", "glass", rig_v(0, 0, 0));
    rig_box(r, "bar", 0.8, 0.02, 0.005);
    rig_diffuse_object(r, "bar", "white", 0.8f, rig_v(0, 1.4, -1.0));
    rig_camera(r, rig_v(0, 1.4, 1.8), rig_v(0, 1.4, -1), 60);
}

/* Samples meet what the frame does not: a white bar before a pane, which has no albedo of its own. What is seen through
 * it is no brighter for that than the lamp behind; nothing is that the eye sees. Through 5 %, as samples are noisy. */
static void a_bar_does_not_brighten_a_window(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    put_barred_window(&r);
    rig_commit(&r);
    r.settings.method = lum_method_find("live");
    r.settings.antialias = true;
    r.settings.max_spp = 0;
    r.settings.w = 48;
    r.settings.h = 32; /* 0.10 m a pixel at the bar */
    double least = INFINITY;
    for (uint32_t spp = 1; spp <= 9; spp++) {
        rig_pass(&r);
        struct lum_rgb *picture = rig_picture(&r);
        for (uint32_t y = 15; y <= 16; y++)
            for (uint32_t x = 20; x < 28; x++) {
                double seen = luminance_at(picture, y * 48 + x);
                if (seen > 1.05 * LAMP_CD_M2)
                    fail_msg("after %u passes (%u, %u) has %g cd/m2", spp, x, y, seen);
                least = fmin(least, seen);
            }
        lum_free(picture);
    }
    print_message("through the pane at least %g cd/m2\n", least);
    assert_true(least < 0.9 * LAMP_CD_M2); /* that the bar is there */
    rig_end(&r);
}

/* ---- where a picture depends on the edits alone ---- */

static void paint(struct rig *r, float albedo)
{
    struct lum_material_desc m = rig_diffuse(albedo);
    rig_material(r, "red", &m);
    rig_commit(r);
}

static void put_crate(struct rig *r, double x)
{
    rig_object(r, "crate", "crate", "red", rig_v(x, 0.5, -0.4));
    rig_commit(r);
}

static void rest(struct rig *r, uint32_t passes)
{
    while (passes--)
        rig_pass(r);
}

/* It does not matter how long it rested between them. */
static void deterministic_pictures_do_not_rest(void **state)
{
    (void)state;
    static const uint32_t passes[] = {1, 9};
    struct lum_rgb *moved[2];
    struct rig r;
    shadowed_room(&r, 500);
    r.settings.deterministic = true;
    for (int i = 0; i < 2; i++) {
        paint(&r, 0.5f);
        put_crate(&r, 0.5);
        rig_fresh_view(&r);
        rest(&r, passes[i]);
        put_crate(&r, 0.4);
        rest(&r, passes[i]);
        paint(&r, 0.2f); /* what is known of shadows is looked at again */
        rest(&r, passes[i]);
        put_crate(&r, 0.3);
        rest(&r, 1);
        moved[i] = rig_picture(&r);
    }
    rig_assert_picture(&r, moved[0], "moved after a rest");
    lum_free(moved[0]);
    lum_free(moved[1]);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cancelled_at_rest),          cmocka_unit_test(last_samples_show),
        cmocka_unit_test(last_correction_cancelled),  cmocka_unit_test(deterministic_pictures_do_not_rest),
        cmocka_unit_test(the_error_of_edges_is_said), cmocka_unit_test(a_bar_does_not_brighten_a_window),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
