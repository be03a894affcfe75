/* What probes say of a picture's error, against the error where the truth is known. Of views: error_views_test.c. */
#include "core/render/error_probes.h"
#include "core/render/measure.h"
#include "tests/numeric/stats.h"
#include "tests/support/rig.h"

#define SURE_SHARE 0.93 /* of readings, the least that the error must be under its bound of 95 % in */

/* ---- a truth without noise: nothing but a sky ---- */

enum { W = 96, H = 64, DRAWS = 200 };
#define SKY 2.0f

struct sky {
    struct rig rig;
    struct lum_film film;
    struct lum_pass pass;
    struct lum_counters counters[2];
    struct lum_pass_stats stats;
    struct lum_stage_runner runner;
    struct lum_error_probes *probes;
};

static void sky_begin_with(struct sky *s, uint32_t threads, void (*put_before)(struct rig *r))
{
    memset(s, 0, sizeof *s);
    rig_begin(&s->rig, threads);
    RIG_OK(lum_scene_put_light(s->rig.scene, "sky",
                               &(struct lum_light_desc){.kind = &lum_light_kind_environment,
                                                        .intensity = SKY,
                                                        .on = true,
                                                        .camera_visible = true,
                                                        .color = lum_grey(1.0f)},
                               &err));
    if (put_before)
        put_before(&s->rig);
    rig_commit(&s->rig);
    s->rig.settings.w = W;
    s->rig.settings.h = H;
    s->pass =
        (struct lum_pass){.snapshot = s->rig.snapshot, .settings = &s->rig.settings, .film = &s->film, .block = 1};
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        s->pass.on[e] = true;
    RIG_OK(lum_eye_init(&s->pass.eye, &s->rig.settings.camera, &s->rig.snapshot->norm, W, H, &err));
    RIG_OK(lum_film_init(&s->film, W, H, &err));
    RIG_OK(lum_error_probes_create(threads, &s->probes, &err));
    s->runner = (struct lum_stage_runner){s->rig.pool, s->counters, NULL, &s->stats, NULL};
}

static void sky_begin(struct sky *s, uint32_t threads)
{
    sky_begin_with(s, threads, NULL);
}

static void sky_end(struct sky *s)
{
    lum_error_probes_destroy(s->probes);
    lum_film_finish(&s->film);
    rig_end(&s->rig);
}

/* How far a pixel is off. */
typedef float (*pattern_fn)(uint32_t x, uint32_t y);
static float everywhere(uint32_t x, uint32_t y)
{
    (void)x, (void)y;
    return 0.3f;
}
static float at_an_edge(uint32_t x, uint32_t y)
{
    (void)y;
    return x == 40 ? 20.0f : 0.01f;
}
static float here_and_there(uint32_t x, uint32_t y)
{
    return (x * 31 + y * 17) % 97 == 0 ? 5.0f : 0.0f;
}

/* A fifth of a percent of the pixels. */
static float in_a_short_row(uint32_t x, uint32_t y)
{
    return y == 20 && x >= 40 && x < 52 ? 20.0f : 0.0f;
}

/* Its relative squared error. */
static double draw_picture(struct sky *s, pattern_fn off)
{
    double square = 0.0, mean = 0.0;
    uint64_t nonfinite = 0;
    for (uint32_t y = 0; y < H; y++)
        for (uint32_t x = 0; x < W; x++) {
            float v = SKY + off(x, y);
            lum_film_set(&s->film, x, y, lum_grey(v), &nonfinite);
            square += (double)(v - SKY) * (double)(v - SKY) / (W * H);
            mean += (double)v / (W * H);
        }
    return square / (mean * mean);
}

/* Wherever the error is, the mean of what is said over many draws is the error, whatever the chances of the pixels: off
 * by no more than four times what the draws themselves say of their mean. And a bound covers as often as it says. */
static void the_estimate_is_unbiased(void **state)
{
    (void)state;
    static const pattern_fn patterns[] = {everywhere, at_an_edge, here_and_there};
    for (size_t k = 0; k < LUM_ARRAY_LEN(patterns); k++) {
        struct sky s;
        sky_begin(&s, 2);
        double truth = draw_picture(&s, patterns[k]), sum = 0.0, sum2 = 0.0;
        uint32_t n_covered = 0;
        for (uint32_t draw = 0; draw < DRAWS; draw++) {
            lum_error_probes_begin(s.probes, false);
            RIG_OK(lum_error_probes_trace(s.probes, &s.pass, 8000, &s.runner));
            struct lum_film_error said = lum_error_probes_error(s.probes, &s.film);
            assert_true(said.fresh == 1.0 && said.probes >= 256.0);
            sum += said.rel * said.rel / DRAWS;
            sum2 += said.rel * said.rel * said.rel * said.rel / DRAWS;
            n_covered += said.bound * said.bound >= truth * (1.0 - 1e-5); /* sums of floats, in another order */
        }
        double deviation = sqrt(fmax(sum2 - sum * sum, 0.0) / DRAWS);
        print_message("pattern %zu: %g, said %g +- %g, covered in %u of %d\n", k, truth, sum, deviation, n_covered,
                      DRAWS);
        assert_true(fabs(sum - truth) <= 4.0 * deviation + 1e-5 * truth);
        assert_true(n_covered >= SURE_SHARE * DRAWS);
        sky_end(&s);
    }
}

/* What is off in few pixels that are bright is found by nearly every draw: what is said scatters by no more than a
 * quarter. */
static void what_is_bright_and_small_is_found(void **state)
{
    (void)state;
    struct sky s;
    sky_begin(&s, 2);
    double truth = draw_picture(&s, in_a_short_row), sum = 0.0, sum2 = 0.0;
    for (uint32_t draw = 0; draw < DRAWS; draw++) {
        lum_error_probes_begin(s.probes, false);
        RIG_OK(lum_error_probes_trace(s.probes, &s.pass, 8000, &s.runner));
        double said = lum_error_probes_error(s.probes, &s.film).rel;
        sum += said * said / DRAWS;
        sum2 += said * said * said * said / DRAWS;
    }
    print_message("%g, said %g +- %g\n", truth, sum, sqrt(fmax(sum2 - sum * sum, 0.0)));
    assert_true(sqrt(fmax(sum2 - sum * sum, 0.0)) <= 0.25 * truth);
    sky_end(&s);
}

#define SLIT 0.05 /* of a pixel */

/* A black fence before the sky, with a slit in each pixel. */
static void put_fence(struct rig *r)
{
    enum { BARS = W + 4 };
    double pixel = 2.0 * 3.0 * tan(22.5 * (double)LUM_PI / 180.0) / H, positions[12 * BARS];
    uint32_t indices[6 * BARS];
    for (uint32_t i = 0; i < BARS; i++) {
        double left = ((double)i - 0.5 * BARS) * pixel, right = left + (1.0 - SLIT) * pixel;
        const double p[] = {left, -1, 0, right, -1, 0, right, 3, 0, left, 3, 0};
        const uint32_t k = 4 * i, t[] = {k, k + 1, k + 2, k, k + 2, k + 3};
        memcpy(positions + 12 * (size_t)i, p, sizeof p);
        memcpy(indices + 6 * (size_t)i, t, sizeof t);
    }
    rig_mesh(r, "fence", positions, 4 * BARS, indices, 2 * BARS);
    rig_diffuse_object(r, "fence", "black", 0.0f, rig_v(0, 0, 0));
    rig_camera(r, rig_v(0, 1, 3), rig_v(0, 1, 0), 45);
}

/* Of 400 pairs of paths one goes through the slit both times, and no other tells that the picture is too dark: nearly
 * half of all draws have none. The bound covers nevertheless, from how those are scattered that go through once. */
static void what_few_paths_find_is_covered(void **state)
{
    (void)state;
    struct sky s;
    const float shown = 0.02f;
    const double off = SLIT * (double)SKY - (double)shown, truth = off / (double)shown;
    uint32_t n_covered = 0, n_low = 0;
    sky_begin_with(&s, 2, put_fence);
    uint64_t nonfinite = 0;
    for (uint32_t i = 0; i < W * H; i++)
        lum_film_set(&s.film, i % W, i / W, lum_grey(shown), &nonfinite);
    for (uint32_t draw = 0; draw < DRAWS; draw++) {
        lum_error_probes_begin(s.probes, false);
        for (int round = 0; round < 4 && lum_error_probes_paths(s.probes) < 512; round++)
            RIG_OK(lum_error_probes_trace(s.probes, &s.pass, 600, &s.runner));
        struct lum_film_error said = lum_error_probes_error(s.probes, &s.film);
        assert_true(isfinite(said.bound));
        n_covered += said.bound >= truth;
        n_low += said.rel < 0.5 * truth;
    }
    print_message("off by %g of what it shows: covered in %u of %d, in %u the estimate is low\n", truth, n_covered,
                  DRAWS, n_low);
    assert_true(n_low > DRAWS / 10); /* that it is a hard case */
    assert_true(n_covered >= SURE_SHARE * DRAWS);
    sky_end(&s);
}

/* Of few probes the bound is wide, and covers as often. Of fewer than 32 nothing is said. */
static void few_probes_cover_as_well(void **state)
{
    (void)state;
    static const pattern_fn patterns[] = {everywhere, at_an_edge, here_and_there};
    for (size_t k = 0; k < LUM_ARRAY_LEN(patterns); k++) {
        struct sky s;
        sky_begin(&s, 2);
        double truth = draw_picture(&s, patterns[k]), over = 0.0;
        uint32_t n_covered = 0, n_least = UINT32_MAX, n_most = 0;
        for (uint32_t draw = 0; draw < DRAWS; draw++) {
            struct lum_film_error said = {0};
            lum_error_probes_begin(s.probes, false);
            while (lum_error_probes_paths(s.probes) < 64) { /* a path is a ray here: two pairs a call, or three */
                said = lum_error_probes_error(s.probes, &s.film);
                assert_true(isnan(said.bound));
                RIG_OK(lum_error_probes_trace(s.probes, &s.pass, 5, &s.runner));
            }
            said = lum_error_probes_error(s.probes, &s.film);
            n_least = said.probes < n_least ? (uint32_t)said.probes : n_least;
            n_most = said.probes > n_most ? (uint32_t)said.probes : n_most;
            n_covered += said.bound * said.bound >= truth * (1.0 - 1e-5);
            over += said.bound / sqrt(truth) / DRAWS;
        }
        print_message("pattern %zu: covered in %u of %d by %u to %u probes, bound over error %.2f\n", k, n_covered,
                      DRAWS, n_least, n_most, over);
        assert_true(n_least >= 32 && n_most < 40);
        assert_true(n_covered >= SURE_SHARE * DRAWS);
        sky_end(&s);
    }
}

/* Which rays are traced, and what they say, does not depend on threads. No ray, where none is allowed. */
static void threads_do_not_change_it(void **state)
{
    (void)state;
    struct lum_film_error said[2];
    uint64_t rays[2];
    for (uint32_t i = 0; i < 2; i++) {
        struct sky s;
        sky_begin(&s, i + 1);
        draw_picture(&s, at_an_edge);
        RIG_OK(lum_error_probes_trace(s.probes, &s.pass, 0, &s.runner));
        assert_int_equal(s.counters[0].rays[LUM_RAY_PROBE] + s.counters[1].rays[LUM_RAY_PROBE], 0);
        assert_true(isnan(lum_error_probes_error(s.probes, &s.film).bound));
        for (int round = 0; round < 5; round++)
            RIG_OK(lum_error_probes_trace(s.probes, &s.pass, 8000, &s.runner));
        said[i] = lum_error_probes_error(s.probes, &s.film);
        rays[i] = s.counters[0].rays[LUM_RAY_PROBE] + s.counters[1].rays[LUM_RAY_PROBE];
        sky_end(&s);
    }
    assert_memory_equal(&said[0], &said[1], sizeof said[0]);
    assert_int_equal(rays[0], rays[1]);
}

static float by_half(uint32_t x, uint32_t y)
{
    (void)y;
    return x < W / 2 ? 1.0f : 0.1f;
}

/* A map shows where the picture is off, a window of few cells away from where that changes exactly: the truth has no
 * noise. */
static void a_map_shows_where(void **state)
{
    (void)state;
    struct sky s;
    struct lum_error_map map;
    sky_begin(&s, 2);
    draw_picture(&s, by_half);
    RIG_OK(lum_error_probes_trace(s.probes, &s.pass, 8000, &s.runner));
    RIG_OK(lum_error_map_init(&map, &s.film, &err));
    lum_error_probes_add_errors(s.probes, &s.film, &map);
    lum_error_map_settle(&map);
    for (uint32_t y = 0; y < H; y++)
        for (uint32_t x = 0; x < W; x++) {
            float off = by_half(x, y);
            if (x + 24 <= W / 2 || x >= W / 2 + 24) {
                assert_true(fabsf(lum_error_map_at(&map, map.rms, x, y) / off - 1.0f) < 1e-3f);
                assert_true(fabsf(lum_error_map_at(&map, map.rel, x, y) * (SKY + off) / off - 1.0f) < 1e-3f);
            }
        }
    lum_error_map_finish(&map);
    sky_end(&s);
}

static void next_picture(struct sky *s)
{
    lum_error_probes_error(s->probes, &s->film);
    lum_error_probes_note(s->probes);
    lum_error_probes_begin(s->probes, true);
}

/* What was measured counts on in pictures that are made alike, less with each, and not in others. */
static void what_was_measured_fades(void **state)
{
    (void)state;
    struct sky s;
    sky_begin(&s, 1);
    draw_picture(&s, everywhere);
    for (int round = 0; round < 2; round++)
        RIG_OK(lum_error_probes_trace(s.probes, &s.pass, 8000, &s.runner));
    double rel = lum_error_probes_error(s.probes, &s.film).rel, n_known = lum_error_probes_known(s.probes);
    assert_true(n_known == lum_error_probes_error(s.probes, &s.film).probes);
    next_picture(&s);
    struct lum_film_error old = lum_error_probes_error(s.probes, &s.film);
    assert_true(old.fresh == 0.0 && old.probes == 0.0 && fabs(old.rel / rel - 1.0) < 1e-6);
    assert_true(fabs(lum_error_probes_known(s.probes) / n_known - 0.7) < 1e-6);
    double fresh = 0.0;
    for (int picture = 0; picture < 3; picture++) {
        RIG_OK(lum_error_probes_trace(s.probes, &s.pass, 8000, &s.runner));
        struct lum_film_error now = lum_error_probes_error(s.probes, &s.film);
        assert_true(now.fresh > 0.0 && now.fresh < 1.0);
        fresh = now.fresh;
        next_picture(&s);
    }
    assert_true(fresh >
                0.25); /* the geometric series of 0.7: at least 0.3, but for what rounding rays to paths changes */
    lum_error_probes_begin(s.probes, false);
    assert_true(isnan(lum_error_probes_error(s.probes, &s.film).bound));
    sky_end(&s);
}

/* Time that went without a ray, as of pictures so small that they buy none, is not taken from the next one's share. */
static void a_share_is_of_its_own_time(void **state)
{
    (void)state;
    double rays[2];
    for (int timed = 0; timed < 2; timed++) {
        struct sky s;
        sky_begin(&s, 1);
        draw_picture(&s, everywhere);
        s.rig.settings.deterministic = false;
        s.rig.settings.error_share = 0.05;
        struct lum_measurement m = {.ms = 1e6};
        lum_measure_begin(&m, false);
        /* less than went before, and far more than these rays take */
        const struct lum_measure_cost cost = {.rays = 300000, .ms = timed ? 0.9e6 / 0.05 : 0.0, .first = true};
        lum_measure_share(&m, &s.pass, s.pass.on, cost, &s.runner);
        assert_true(m.n_known == m.error.probes);
        rays[timed] = m.rays;
        lum_measure_finish(&m);
        sky_end(&s);
    }
    assert_true(rays[0] > 0.0 && rays[1] > rays[0]);
}

/* However few pixels there are, they get paths: one pixel, where a call allows fewer rays than a path takes. A picture
 * that is not finite, or black, has no error that is known. */
static void odd_pictures(void **state)
{
    (void)state;
    struct sky s;
    sky_begin(&s, 1);
    draw_picture(&s, everywhere);
    for (int call = 0; call < 10000 && lum_error_probes_paths(s.probes) < 1024; call++)
        RIG_OK(lum_error_probes_trace(s.probes, &s.pass, 2, &s.runner));
    assert_true(lum_error_probes_paths(s.probes) >= 1024);
    assert_true(isfinite(lum_error_probes_error(s.probes, &s.film).bound));
    uint64_t nonfinite = 0;
    for (uint32_t y = 0; y < H; y++)
        for (uint32_t x = 0; x < W; x++)
            lum_film_set(&s.film, x, y, lum_grey(0.0f), &nonfinite);
    assert_true(isnan(lum_error_probes_error(s.probes, &s.film).bound));
    lum_film_set(&s.film, 3, 3, lum_grey(3e38f), &nonfinite);
    lum_error_probes_begin(s.probes, false);
    for (int call = 0; call < 8; call++)
        RIG_OK(lum_error_probes_trace(s.probes, &s.pass, 8000, &s.runner));
    struct lum_film_error said = lum_error_probes_error(s.probes, &s.film);
    assert_true(isnan(said.bound) || said.bound > 0.0);
    sky_end(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_estimate_is_unbiased),
        cmocka_unit_test(what_is_bright_and_small_is_found),
        cmocka_unit_test(what_few_paths_find_is_covered),
        cmocka_unit_test(few_probes_cover_as_well),
        cmocka_unit_test(threads_do_not_change_it),
        cmocka_unit_test(a_map_shows_where),
        cmocka_unit_test(what_was_measured_fades),
        cmocka_unit_test(a_share_is_of_its_own_time),
        cmocka_unit_test(odd_pictures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
