/* What a film says of its error, against the error: for noise of many kinds, and for path traced pictures. */
#include "tests/numeric/stats.h"
#include "tests/support/built_in.h"
#include "tests/support/rig.h"

#define SURE_SHARE 0.93 /* of readings, the least that the error must be under its bound of 95 % in */

/* ---- made-up noise ---- */

enum { W = 96, H = 64, N = W * H, DRAWS = 200 };
#define TRUTH 10.0

static double normal(struct rng *r)
{
    return sqrt(-2.0 * log(1.0 - rng_unit(r))) * cos(2.0 * (double)LUM_PI * rng_unit(r));
}

/* All of mean 0. */
static double gaussian(struct rng *r)
{
    return normal(r);
}

static double log_normal(struct rng *r)
{
    return exp(2.0 * normal(r)) - exp(2.0);
}

/* Of infinite fourth moment, barely of finite variance: exponent 2.5, mean 2.5 / 1.5. */
static double pareto(struct rng *r)
{
    return pow(1.0 - rng_unit(r), -1.0 / 2.5) - 2.5 / 1.5;
}

/* One sample in so many has all the light. */
#define FIREFLY_ONE_IN 200

static double firefly(struct rng *r)
{
    return (rng_unit(r) * FIREFLY_ONE_IN < 1.0 ? FIREFLY_ONE_IN : 0.0) - 1.0;
}

struct kind {
    double (*draw)(struct rng *r);
    uint32_t side, shift; /* pixels of a square of this side have the same noise; squares begin so many pixels aside */
    uint32_t spp;
};

/* One draw of a picture: what is said, and what is. */
static bool is_covered(const struct kind *k, struct lum_film *f, struct rng *rng, double *inout_over)
{
    static double of_square[H + 32][W + 32];
    double square = 0.0, light = 0.0;
    uint64_t bad = 0;
    for (uint32_t i = 0; i < N; i++)
        lum_film_reset_pixel(f, i % W, i / W);
    for (uint32_t s = 0; s < k->spp; s++)
        for (uint32_t y = 0; y < H; y++)
            for (uint32_t x = 0; x < W; x++) {
                uint32_t cx = (x + k->shift) / k->side, cy = (y + k->shift) / k->side;
                if (((x + k->shift) % k->side == 0 || x == 0) && ((y + k->shift) % k->side == 0 || y == 0))
                    of_square[cy][cx] = k->draw(rng);
                /* in the half that the sample's number alone says: samples of squares are alike over columns */
                lum_film_add(f, x, y, s ^ (x & 1u), lum_grey((float)(TRUTH + of_square[cy][cx])), &bad);
            }
    for (uint32_t i = 0; i < N; i++) {
        double y = (double)lum_film_mean(f, i % W, i / W).g;
        square += (y - TRUTH) * (y - TRUTH) / N;
        light += y / N;
    }
    struct lum_film_error said = k->spp > 1 ? lum_film_error(f) : lum_film_error_at_most(f);
    *inout_over += said.bound / (sqrt(square) / light) / DRAWS;
    return sqrt(square) / TRUTH <= said.bound;
}

static void it_covers_any_noise(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double (*draw)(struct rng *r);
    } noises[] = {{"gaussian", gaussian}, {"log-normal", log_normal}, {"pareto", pareto}, {"fireflies", firefly}};
    static const uint32_t sides[][2] = {{1, 0}, {3, 0}, {4, 2}, {5, 2}, {8, 0}}, spps[] = {2, 4};
    struct lum_film f;
    assert_int_equal(lum_film_init(&f, W, H, NULL), LUM_OK);
    for (size_t k = 0; k < LUM_ARRAY_LEN(noises) * LUM_ARRAY_LEN(sides) * LUM_ARRAY_LEN(spps); k++) {
        const uint32_t *side = sides[k / 2 % LUM_ARRAY_LEN(sides)], spp = spps[k % 2], n_noise = (uint32_t)k / 10;
        struct kind kind = {noises[n_noise].draw, side[0], side[1], spp};
        struct rng rng = {.state = k};
        uint32_t n_covered = 0;
        double over = 0.0;
        if (kind.draw == firefly && N / (side[0] * side[0]) * spp < 10 * FIREFLY_ONE_IN)
            continue; /* light that no sample has found */
        for (uint32_t draw = 0; draw < DRAWS; draw++)
            n_covered += is_covered(&kind, &f, &rng, &over);
        print_message("%s, alike in squares of %u + %u, %u samples: covered %.3f, bound over error %.2f\n",
                      noises[n_noise].name, side[0], side[1], spp, (double)n_covered / DRAWS, over);
        if (n_covered < SURE_SHARE * DRAWS)
            fail_msg("the error is covered in %u of %u draws", n_covered, DRAWS);
    }
    lum_film_finish(&f);
}

/* One sample, and pixels that are independent of each other: their halves lie side by side. */
static void it_covers_a_single_sample(void **state)
{
    (void)state;
    static double (*const noises[])(struct rng * r) = {gaussian, log_normal, pareto, firefly};
    struct lum_film f;
    assert_int_equal(lum_film_init(&f, W, H, NULL), LUM_OK);
    assert_true(isnan(lum_film_error(&f).bound));
    for (size_t k = 0; k < LUM_ARRAY_LEN(noises); k++) {
        struct kind kind = {noises[k], 1, 0, 1};
        struct rng rng = {.state = 11 + k};
        uint32_t n_covered = 0;
        double over = 0.0;
        for (uint32_t draw = 0; draw < DRAWS; draw++)
            n_covered += is_covered(&kind, &f, &rng, &over);
        print_message("noise %zu, one sample: covered in %u of %d, bound over error %.2f\n", k, n_covered, DRAWS, over);
        assert_true(n_covered >= SURE_SHARE * DRAWS);
    }
    lum_film_finish(&f);
}

/* Edges count as noise: stripes of 2 and 0, without any, are said to be off by a square of 2, with a last column that
 * has no partner by 4 there. */
static void edges_are_noise_to_a_single_sample(void **state)
{
    (void)state;
    for (uint32_t w = 95; w <= 96; w++) {
        struct lum_film f;
        uint64_t bad = 0;
        assert_int_equal(lum_film_init(&f, w, H, NULL), LUM_OK);
        for (uint32_t i = 0; i < w * H; i++)
            lum_film_add(&f, i % w, i / w, 0, lum_grey(i % w % 2 == 0 ? 2.0f : 0.0f), &bad);
        double square = w == 95 ? (94.0 * 2.0 + 4.0) / 95.0 : 2.0, mean = w == 95 ? 96.0 / 95.0 : 1.0;
        struct lum_film_error said = lum_film_error_at_most(&f);
        assert_true(fabs(said.rel - sqrt(square) / mean) < 1e-6 && said.bound > said.rel);
        lum_film_finish(&f);
    }
}

/* Nothing is known of light that no sample has found, of one or of many. */
static void black_tells_nothing(void **state)
{
    (void)state;
    struct lum_film f;
    uint64_t bad = 0;
    assert_int_equal(lum_film_init(&f, W, H, NULL), LUM_OK);
    for (uint32_t i = 0; i < N; i++)
        lum_film_add(&f, i % W, i / W, 0, lum_grey(0.0f), &bad);
    assert_true(isnan(lum_film_error_at_most(&f).bound));
    for (uint32_t sample = 1; sample < 4; sample++)
        for (uint32_t i = 0; i < N; i++)
            lum_film_add(&f, i % W, i / W, sample, lum_grey(0.0f), &bad);
    assert_true(isnan(lum_film_error(&f).bound));
    lum_film_finish(&f);
}

/* Of a large one a share of the blocks is looked at, evenly over the picture, of which one half is bright and noisy and
 * the other dark. Noise of 1 in a mean of 5.5: 1 / (5.5 sqrt(2)). The edge between the halves is in no pair. */
static void a_large_single_sample_is_looked_at_in_part(void **state)
{
    (void)state;
    enum { SIDE = 1024 };
    struct lum_film f;
    struct rng rng = {.state = 5};
    uint64_t bad = 0;
    assert_int_equal(lum_film_init(&f, SIDE, SIDE, NULL), LUM_OK);
    for (uint32_t i = 0; i < SIDE * SIDE; i++)
        lum_film_add(&f, i % SIDE, i / SIDE, 0, lum_grey(i % SIDE < SIDE / 2 ? 1.0f : (float)(10.0 + normal(&rng))),
                     &bad);
    struct lum_film_error said = lum_film_error_at_most(&f);
    double want = 1.0 / (5.5 * sqrt(2.0));
    if (!(fabs(said.rel / want - 1.0) < 0.05) || !(said.bound > want) || !(said.bound < 1.1 * want))
        fail_msg("%g, at most %g, not %g", said.rel, said.bound, want);
    assert_true(said.probes == 512.0 * 512.0);
    lum_film_finish(&f);
}

/* Of n squares of 64 pixels each, with Gaussian noise that no two share, E[Y^2] = E[Y]^2 (1 + 2 / 64), and the bound is
 * exp(1.645 sqrt(2 (1 + 2 / 64) / n) / 2) above the error. Of draws, the roots of sums over N pixels, said and true,
 * are off by 1 / sqrt(2 N) each: 0.0009 in the mean of 200; four of those, with both. */
static void it_is_not_far_above_plain_noise(void **state)
{
    (void)state;
    struct kind kind = {gaussian, 1, 0, 2};
    struct rng rng = {.state = 7};
    struct lum_film f;
    double over = 0.0, n = N / 64.0;
    assert_int_equal(lum_film_init(&f, W, H, NULL), LUM_OK);
    for (uint32_t draw = 0; draw < DRAWS; draw++)
        is_covered(&kind, &f, &rng, &over);
    assert_true(fabs(over / exp(0.5 * LUM_SURE * sqrt(2.0 * (1.0 + 2.0 / 64.0) / n)) - 1.0) < 4.0 * 0.0009 * sqrt(2.0));
    lum_film_finish(&f);
}

/* ---- path traced pictures ---- */

enum { SEEDS = 30, REFERENCE_SPP = 256 };

struct scene {
    struct built_in *built_in;
    struct lum_view *view;
    struct lum_view_settings settings;
    double *reference;  /* luminance */
    double mean, noise; /* of it: mean, and square error per pixel */
};

static double luminance(const struct lum_film *f, size_t i)
{
    return (double)lum_luminance(lum_film_mean(f, (uint32_t)(i % f->w), (uint32_t)(i / f->w)));
}

static struct lum_pass_stats pass(struct scene *s)
{
    struct lum_pass_stats stats;
    RIG_OK(lum_view_pass(s->view, built_in_snapshot(s->built_in), &s->settings, NULL, &stats, &err));
    assert_int_equal(stats.nonfinite + stats.bad_rays, 0);
    return stats;
}

static void scene_begin(struct scene *s, const char *name)
{
    *s = (struct scene){.built_in = built_in_open(name, 2), .settings = lum_view_settings_default()};
    s->settings.method = lum_method_find("path");
    s->settings.w = 48;
    s->settings.h = 32;
    s->settings.seed = 1000;
    RIG_OK(lum_view_create(built_in_pool(s->built_in), &s->view, &err));
    RIG_OK(lum_snapshot_camera(built_in_snapshot(s->built_in), NULL, &s->settings.camera, &err));
    struct lum_pass_stats stats;
    do
        stats = pass(s);
    while (stats.spp < REFERENCE_SPP);
    const struct lum_film *f = lum_view_film(s->view);
    size_t n = (size_t)f->w * f->h;
    s->reference = lum_calloc(n, sizeof *s->reference);
    assert_non_null(s->reference);
    for (size_t i = 0; i < n; i++) {
        s->reference[i] = luminance(f, i);
        s->mean += s->reference[i] / (double)n;
    }
    s->noise = stats.error.rel * stats.error.rel * s->mean * s->mean;
}

static void scene_end(struct scene *s)
{
    lum_free(s->reference);
    lum_view_destroy(s->view);
    built_in_close(s->built_in);
}

/* The relative error of the picture; without the reference's noise, which is independent of it. */
static double error_of(const struct scene *s)
{
    const struct lum_film *f = lum_view_film(s->view);
    size_t n = (size_t)f->w * f->h;
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        double d = luminance(f, i) - s->reference[i];
        sum += d * d / (double)n;
    }
    return sqrt(fmax(sum - s->noise, 0.0)) / s->mean;
}

/* Thirty pictures of each scene, each refined until its bound is below `error`, as --error does: each reading on the
 * way counts, and so does the end, which is a reading that was waited for. */
static void pictures(const char *name, double error)
{
    struct scene s;
    uint32_t n_read = 0, n_covered = 0, n_kept = 0, spp = 0;
    double over = 0.0;
    scene_begin(&s, name);
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        struct lum_pass_stats stats;
        s.settings.seed = seed;
        do {
            stats = pass(&s);
            if (stats.spp % 2)
                continue;
            double is = error_of(&s);
            n_read++;
            n_covered += is <= stats.error.bound;
            over += stats.error.bound / is;
        } while (!(stats.error.bound <= error));
        n_kept += error_of(&s) <= error;
        spp += stats.spp;
    }
    print_message("%s: covered in %u of %u readings, bound over error %.2f; an error of %g kept in %u of %u pictures, "
                  "with %.1f samples; of the reference %.4f\n",
                  name, n_covered, n_read, over / n_read, error, n_kept, SEEDS, (double)spp / SEEDS,
                  sqrt(s.noise) / s.mean);
    assert_true(n_covered >= SURE_SHARE * n_read);
    assert_true(n_kept >= SURE_SHARE * SEEDS);
    scene_end(&s);
}

static void it_covers_path_traced_pictures(void **state)
{
    (void)state;
    lum_thread_init_fp();
    pictures("cornell", 0.6);
    pictures("office", 1.2);
}

/* A first sample says how far it is off, though no probe does: each pixel and that beside it are two draws. */
static void it_covers_first_samples(void **state)
{
    (void)state;
    static const char *const names[] = {"cornell", "office"};
    lum_thread_init_fp();
    for (size_t k = 0; k < LUM_ARRAY_LEN(names); k++) {
        struct scene s;
        uint32_t n_covered = 0;
        double over = 0.0;
        scene_begin(&s, names[k]);
        s.settings.error_share = 1e-9; /* no path for probes */
        for (s.settings.seed = 0; s.settings.seed < SEEDS; s.settings.seed++) {
            struct lum_pass_stats stats = pass(&s);
            assert_true(stats.spp == 1 && isfinite(stats.error.bound) && isnan(stats.noise));
            n_covered += error_of(&s) <= stats.error.bound;
            over += stats.error.bound / error_of(&s) / SEEDS;
        }
        print_message("%s: covered in %u of %u first samples, bound over error %.2f\n", names[k], n_covered, SEEDS,
                      over);
        assert_true(n_covered >= SURE_SHARE * SEEDS);
        scene_end(&s);
    }
}

/* A floor, and a mirror that sends a lamp's light to it: paths find the lamp in the mirror by chance, one in a hundred,
 * and bring a hundred times what others do. What has been found is covered. (Of a lamp so small that no path has found
 * it yet nothing is known: film.h.) */
static void it_covers_caustics_that_were_found(void **state)
{
    enum { SIDE = 16, PIXELS = SIDE * SIDE, REFERENCE = 4096, SPP = 32 };
    struct rig r;
    double reference[PIXELS], mean = 0.0;
    uint32_t n_covered = 0;
    (void)state;
    rig_begin(&r, 0);
    struct lum_material_desc mirror = lum_material_default();
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    rig_material(&r, "mirror", &mirror);
    rig_square(&r, "floor", 2);
    rig_diffuse_object(&r, "floor", "white", 0.7f, rig_v(0, 0, 0));
    rig_box(&r, "slab", 0.5, 0.5, 0.05);
    rig_object(&r, "slab", "slab", "mirror", rig_v(0, 0.5, -0.6));
    struct lum_light_desc lamp = rig_quad(rig_v(0.3, 1.5, 0.6), rig_v(0.3, 0, 0), rig_v(0, 0, 0.3), 1000);
    rig_light(&r, "lamp", &lamp);
    rig_camera(&r, rig_v(0.2, 2.2, 2.2), rig_v(0, 0, 0), 40);
    rig_commit(&r);
    r.settings.w = r.settings.h = SIDE;
    r.settings.method = lum_method_find("path");
    for (uint32_t seed = 0; seed <= SEEDS; seed++) { /* the first is the reference */
        struct lum_pass_stats stats;
        double sum = 0.0;
        r.settings.seed = seed;
        r.settings.max_spp = seed == 0 ? REFERENCE : SPP;
        rig_fresh_view(&r);
        do
            stats = rig_pass(&r);
        while (!stats.complete);
        for (uint32_t i = 0; i < PIXELS; i++) {
            double y = luminance(lum_view_film(r.view), i), d = y - reference[i];
            if (seed == 0)
                mean += (reference[i] = y) / PIXELS;
            else
                sum += d * d / PIXELS;
        }
        n_covered += seed > 0 && sqrt(sum) / mean <= stats.error.bound;
    }
    print_message("caustics: covered in %u of %u pictures\n", n_covered, SEEDS);
    assert_true(n_covered >= SURE_SHARE * SEEDS);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_covers_any_noise),
        cmocka_unit_test(it_covers_a_single_sample),
        cmocka_unit_test(edges_are_noise_to_a_single_sample),
        cmocka_unit_test(black_tells_nothing),
        cmocka_unit_test(a_large_single_sample_is_looked_at_in_part),
        cmocka_unit_test(it_is_not_far_above_plain_noise),
        cmocka_unit_test(it_covers_path_traced_pictures),
        cmocka_unit_test(it_covers_first_samples),
        cmocka_unit_test(it_covers_caustics_that_were_found),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
