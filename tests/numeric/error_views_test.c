/* What views say of their pictures' errors, by probes and by their own samples: of rooms and built-in scenes. */
#include "tests/numeric/stats.h"
#include "tests/support/built_in.h"
#include "tests/support/effort.h"
#include "tests/support/rig.h"

#define SURE_SHARE 0.93 /* of readings, the least that the error must be under its bound of 95 % in */

enum { W = 96, H = 64 };

/* A picture that nothing shines in is right. One that is black where a lamp is on tells nothing, however many samples
 * it has: none found that lamp, which shines outside of the room. */
static void only_what_nothing_shines_in_is_surely_black(void **state)
{
    (void)state;
    static const char *const methods[] = {"path", "live", "tic"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(methods); i++)
        for (int k = 0; k < 4; k++) {
            const bool lit = k & 1, measured = k & 2;
            struct rig r;
            rig_begin(&r, 2);
            rig_room(&r);
            if (lit)
                rig_bulb(&r, "lamp", rig_v(0, 50, 0), 100);
            rig_commit(&r);
            r.settings.w = 24;
            r.settings.h = 16;
            r.settings.method = lum_method_find(methods[i]);
            r.settings.error_share = measured ? LUM_ERROR_SHARE : 0.0;
            r.settings.measure_at_rest = true;
            r.settings.max_spp = 16;
            struct lum_pass_stats stats = rig_pass(&r);
            while (!stats.complete)
                stats = rig_pass(&r);
            assert_true(lum_film_mean_luminance(lum_view_film(r.view)) == 0.0);
            assert_true(stats.unlit == lit);
            if (lit)
                assert_true(isnan(stats.error.bound));
            else
                assert_true(stats.error.bound == 0.0 && stats.error.rel == 0.0 && stats.error.fresh == 1.0);
            rig_end(&r);
        }
}

/* A room with one bulb below its ceiling. */
static void begin_room(struct rig *r, const char *method)
{
    rig_begin(r, 2);
    rig_room(r);
    rig_bulb(r, "lamp", rig_v(0, 2.5, 0), 100);
    rig_commit(r);
    r->settings.w = W;
    r->settings.h = H;
    r->settings.method = lum_method_find(method);
}

/* What samples make of a picture is not what the next one begins with. */
static void what_rest_did_is_forgotten(void **state)
{
    (void)state;
    struct rig r;
    begin_room(&r, "path");
    r.settings.error_share = 1.0;
    double first = 0.0;
    for (int spp = 1; spp <= 64; spp++) {
        struct lum_pass_stats stats = rig_pass(&r);
        if (spp == 1)
            first = stats.error.rel;
    }
    r.settings.error_share = 1e-9; /* no path of its own */
    r.settings.camera.position.x += 0.01;
    struct lum_pass_stats stats = rig_pass(&r);
    assert_true(stats.error.fresh == 0.0 && fabs(stats.error.rel / first - 1.0) < 1e-6);
    rig_end(&r);
}

/* Few probes are few also where all of them are of the picture before: pixels side by side are surer then. */
static void few_of_before_are_few(void **state)
{
    (void)state;
    struct rig r;
    begin_room(&r, "path");
    r.settings.deterministic = true;
    r.settings.error_share = 0.1; /* of about 30000 rays; a probe takes some ten */
    struct lum_pass_stats stats = rig_pass(&r);
    assert_true(stats.rays[LUM_RAY_PROBE] > 0 && stats.error.fresh == 1.0);
    r.settings.error_share = 1e-9; /* no path of its own */
    r.settings.camera.position.x += 0.01;
    stats = rig_pass(&r);
    assert_true(stats.rays[LUM_RAY_PROBE] == 0);
    assert_true(stats.error.fresh == 1.0 && stats.error.probes == (double)W * H);
    rig_end(&r);
}

/* What a picture's error is said to be, by itself and by its map; cd/m2. */
struct said {
    double off, bound, map;
};

static struct said error_said(const char *method, uint32_t spp, uint32_t seed)
{
    struct rig r;
    begin_room(&r, method);
    r.settings.seed = seed;
    r.settings.error_share = LUM_ERROR_SHARE;
    r.settings.deterministic = r.settings.measure_at_rest = true;
    r.settings.max_spp = spp;
    struct lum_pass_stats stats = rig_pass(&r);
    while (!stats.complete)
        stats = rig_pass(&r);
    double mean = lum_film_mean_luminance(lum_view_film(r.view)), sum = 0.0;
    struct lum_error_map map;
    RIG_OK(lum_view_error_map(r.view, &map, &err));
    for (uint32_t y = 0; y < H; y++)
        for (uint32_t x = 0; x < W; x++) {
            double rms = (double)lum_error_map_at(&map, map.rms, x, y);
            sum += rms * rms / (W * H);
        }
    lum_error_map_finish(&map);
    rig_end(&r);
    return (struct said){stats.error.rel * mean, stats.error.bound * mean, sqrt(sum)};
}

/* Whoever knows the error, the picture's own samples or probes: its map is known everywhere, and adds up to no less.
 * Where the map is unsure it says the more, and windows count the cells at the border less: twice as much at most. That
 * is of the error that is right in the mean: few probes may say of one picture that there is none, so several are
 * drawn, and of each only the bound is asked. */
static void maps_add_up(void **state)
{
    (void)state;
    enum { SEEDS = 6 };
    static const struct {
        const char *method;
        uint32_t spp;
    } cases[] = {{"path", 16}, {"live", 17}, {"live", 1}, {"tic", 1}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++) {
        double off2 = 0.0, map2 = 0.0;
        for (uint32_t seed = 1; seed <= SEEDS; seed++) {
            struct said s = error_said(cases[i].method, cases[i].spp, seed);
            print_message("%s, %u samples, seed %u: off by %g cd/m2, surely by no more than %g, by the map %g\n",
                          cases[i].method, cases[i].spp, seed, s.off, s.bound, s.map);
            assert_true(s.map >= 0.9 * s.off && s.map <= 2.0 * s.bound);
            off2 += s.off * s.off / SEEDS;
            map2 += s.map * s.map / SEEDS;
        }
        print_message("together: %g, by the map %g\n", sqrt(off2), sqrt(map2));
        assert_true(sqrt(map2) <= 2.0 * sqrt(off2));
    }
}

/* ---- pictures ---- */

enum { REFERENCE_SPP = 256 };

struct scene {
    struct built_in *built_in;
    struct lum_view_settings settings;
    double *half[2]; /* of the reference: luminance */
};

static struct lum_pass_stats pass(const struct scene *s, struct lum_view *view)
{
    struct lum_pass_stats stats;
    RIG_OK(lum_view_pass(view, built_in_snapshot(s->built_in), &s->settings, NULL, &stats, &err));
    assert_int_equal(stats.nonfinite + stats.bad_rays, 0);
    return stats;
}

static struct lum_view *open_view(const struct scene *s)
{
    struct lum_view *view = NULL;
    RIG_OK(lum_view_create(built_in_pool(s->built_in), &view, &err));
    return view;
}

static void make_reference(struct scene *s)
{
    struct lum_view *view = open_view(s);
    s->settings.method = lum_method_find("path");
    s->settings.seed = 1000;
    while (pass(s, view).spp < REFERENCE_SPP) {
    }
    const struct lum_film *f = lum_view_film(view);
    size_t n = (size_t)f->w * f->h;
    for (int h = 0; h < 2; h++) {
        s->half[h] = lum_calloc(n, sizeof *s->half[h]);
        assert_non_null(s->half[h]);
        for (size_t i = 0; i < n; i++) {
            const double *sum = &f->half[h][3 * i];
            s->half[h][i] = (0.2126 * sum[0] + 0.7152 * sum[1] + 0.0722 * sum[2]) / f->n[h][i];
        }
    }
    lum_view_destroy(view);
}

/* The noise of the halves cancels. */
static double error_of(const struct scene *s, const struct lum_film *f)
{
    double square = 0.0, mean = 0.0, n = (double)f->w * f->h;
    for (size_t i = 0; i < (size_t)f->w * f->h; i++) {
        double b = (double)lum_luminance(lum_film_mean(f, (uint32_t)(i % f->w), (uint32_t)(i / f->w)));
        square += (b - s->half[0][i]) * (b - s->half[1][i]) / n;
        mean += b / n;
    }
    return sqrt(fmax(square, 0.0)) / mean;
}

enum moment { FIRST, REST, MOMENTS };
static const char *const moment_names[] = {"first frames", "at rest"};

struct tally {
    uint32_t n, n_covered;
    double over; /* sum of bounds over errors */
};

static void note(struct tally *t, const struct scene *s, struct lum_view *view, const struct lum_film_error *said)
{
    double is = error_of(s, lum_view_film(view));
    assert_true(isfinite(said->bound) && said->rel <= said->bound);
    t->n++;
    t->n_covered += is <= said->bound;
    t->over += said->bound / is;
}

/* Of a first frame no more rays than its share, twice over where it was saved up, which are enough to say something;
 * then as many as it takes. */
static void measure_picture(struct scene *s, struct tally inout_tally[MOMENTS])
{
    struct lum_view *view = open_view(s);
    struct lum_pass_stats stats = pass(s, view);
    uint64_t probe = stats.rays[LUM_RAY_PROBE], rays = rig_all_rays(&stats) - probe;
    assert_true(probe > 0 && (double)probe <= 2.0 * s->settings.error_share * (double)rays);
    assert_false(stats.measuring || stats.complete);
    note(&inout_tally[FIRST], s, view, &stats.error);
    while (!stats.complete) {
        stats = pass(s, view);
        assert_true(stats.measuring && !stats.changed && rig_all_rays(&stats) == stats.rays[LUM_RAY_PROBE]);
    }
    note(&inout_tally[REST], s, view, &stats.error);
    stats = pass(s, view);
    assert_int_equal(rig_all_rays(&stats), 0);
    lum_view_destroy(view);
}

static void pictures(const char *scene, struct tally inout_tally[MOMENTS])
{
    static const char *const methods[] = {"igi", "tic", "live"};
    struct scene s = {.built_in = built_in_open(scene, 2), .settings = lum_view_settings_default()};
    s.settings.w = W;
    s.settings.h = H;
    s.settings.antialias = false;    /* the same truth for all methods */
    s.settings.deterministic = true; /* shares are of rays, not of time */
    RIG_OK(lum_snapshot_camera(built_in_snapshot(s.built_in), NULL, &s.settings.camera, &err));
    make_reference(&s);
    s.settings.max_spp = 1;
    s.settings.error_share = LUM_ERROR_SHARE;
    s.settings.measure_at_rest = true;
    for (size_t i = 0; i < LUM_ARRAY_LEN(methods); i++) {
        struct tally t[MOMENTS] = {0};
        s.settings.method = lum_method_find(methods[i]);
        for (s.settings.seed = 0; s.settings.seed < TEST_EFFORT(10); s.settings.seed++)
            measure_picture(&s, t);
        for (enum moment m = 0; m < MOMENTS; m++) {
            print_message("%s, %s, %s: covered in %u of %u, bound over error %.2f\n", scene, methods[i],
                          moment_names[m], t[m].n_covered, t[m].n, t[m].over / t[m].n);
            inout_tally[m].n += t[m].n;
            inout_tally[m].n_covered += t[m].n_covered;
        }
    }
    lum_free(s.half[0]);
    lum_free(s.half[1]);
    built_in_close(s.built_in);
}

static void it_covers_pictures_of_every_kind(void **state)
{
    (void)state;
    struct tally tally[MOMENTS] = {0};
    lum_thread_init_fp();
    pictures("cornell", tally);
    pictures("office", tally);
    for (enum moment m = 0; m < MOMENTS; m++)
        assert_true(tally[m].n_covered >= SURE_SHARE * tally[m].n);
}

/* A dimmed lamp is a new sum without a ray: what is said of it was measured in the picture before, and at rest in this.
 */
static void a_dimmed_lamp_is_measured_at_rest(void **state)
{
    (void)state;
    struct rig r;
    begin_room(&r, "tic");
    r.settings.error_share = LUM_ERROR_SHARE;
    r.settings.measure_at_rest = true;
    struct lum_pass_stats stats;
    do
        stats = rig_pass(&r);
    while (!stats.complete);
    assert_true(stats.error.fresh == 1.0);
    rig_bulb(&r, "lamp", rig_v(0, 2.5, 0), 50);
    rig_commit(&r);
    stats = rig_pass(&r);
    assert_int_equal(rig_all_rays(&stats), 0);
    assert_true(isfinite(stats.error.bound) && stats.error.fresh == 0.0);
    do
        stats = rig_pass(&r);
    while (!stats.complete);
    assert_true(stats.rays[LUM_RAY_PROBE] > 0 && stats.error.fresh > 0.5);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(only_what_nothing_shines_in_is_surely_black),
        cmocka_unit_test(what_rest_did_is_forgotten),
        cmocka_unit_test(few_of_before_are_few),
        cmocka_unit_test(maps_add_up),
        cmocka_unit_test(it_covers_pictures_of_every_kind),
        cmocka_unit_test(a_dimmed_lamp_is_measured_at_rest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
