/* Samples that are far brighter than those around them: no spots, and no light is lost. */
#include "tests/numeric/residual_stage.h"

static bool is_right(uint32_t i)
{
    return !is_left(i);
}

static bool anywhere(uint32_t i)
{
    (void)i;
    return true;
}

/* One sample of 1e5 among those of 10. */
#define BRIGHT 1e5

static void add_with_outlier(struct stage *s, uint32_t at, double (*truth)(uint32_t i))
{
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t k = 0; k < 2; k++)
            add(s, i, k, i == at && k == 0 ? BRIGHT : truth(i) + 0.1 * truth(i) * noise(i, k));
}

static double light_of(const struct stage *s, bool (*counts)(uint32_t i), bool of_samples)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < N; i++)
        if (counts(i))
            sum += of_samples ? (double)lum_film_mean(&s->samples, i % W, i / W).g : shown(s, i);
    return sum;
}

/* It is no spot, and no light is lost. */
static void an_outlier_is_shared_out(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    add_with_outlier(&s, H / 2 * W + W / 4, even);
    apply(&s);
    /* 5e4 over blocks of 48 x 48: 22; the nearest four corners of blocks share it bilinearly */
    for (uint32_t i = 0; i < N; i++)
        assert_true(shown(&s, i) < TRUTH + 0.5 * BRIGHT / 2304.0 + 10.0);
    /* What is shared out comes to rest whole. What is filtered keeps its sum but for the weights where the filter meets
     * an edge, which is less than the noise of the sum itself; four of its deviations. */
    double before = light_of(&s, anywhere, true), after = light_of(&s, anywhere, false);
    assert_true(fabs(after / before - 1.0) < 4.0 / (TRUTH * sqrt(2.0 * N)));
    stage_end(&s);
}

/* It is in some samples of both halves: in 64 of them each half's share of it is known to 27 %. */
static void a_lamp_smaller_than_a_pixel_stays(void **state)
{
    (void)state;
    struct stage s;
    uint32_t at = H / 2 * W + W / 4;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t k = 0; k < 64; k++) {
            bool lamp = i == at && noise_of(5, i, k) > 0.4 * sqrt(3.0); /* 3 of 10 */
            add(&s, i, k, lamp ? 1000.0 : TRUTH * (1.0 + 0.1 * noise(i, k)));
        }
    apply(&s);
    double mean = (double)lum_film_mean(&s.samples, at % W, at / W).g;
    if (!(shown(&s, at) > 0.9 * mean && shown(&s, at) < 1.1 * mean))
        fail_msg("%g is shown of %g", shown(&s, at), mean);
    stage_end(&s);
}

/* Two lamps that the eye sees: one the frame shows, too, as bright; the other is smaller than a pixel, no middle of one
 * shows it, and of the samples of its pixel one. Of k samples the frame is another 1 / k. What is around shows
 * what it shows without lamps, bit for bit. */
static void lamps_that_are_seen_light_nothing_around(void **state)
{
    (void)state;
    struct stage dark, lit;
    struct lum_error err;
    const uint32_t seen = H / 3 * W + W / 4, missed = H / 2 * W + 3 * W / 4;
    stage_begin(&dark, 2);
    stage_begin(&lit, 2);
    assert_int_equal(lum_film_keep_first(&dark.samples, &err), LUM_OK);
    assert_int_equal(lum_film_keep_first(&lit.samples, &err), LUM_OK);
    lit.shine[seen] = lum_grey((float)BRIGHT);
    for (uint32_t k = 0; k < 4; k++) {
        for (uint32_t i = 0; i < N; i++) {
            struct lum_rgb value = lum_grey((float)(TRUTH * (1.0 + 0.1 * noise(i, k))));
            bool shines = i == seen || (i == missed && k == 2);
            uint64_t nonfinite = 0;
            struct lum_film_first first = {.albedo = dark.albedo[i]};
            lum_film_add_apart(&dark.samples, i % W, i / W, k, value, &first, &nonfinite);
            first.shine = lum_grey(shines ? (float)BRIGHT : 0.0f);
            lum_film_add_apart(&lit.samples, i % W, i / W, k, value, &first, &nonfinite);
            assert_int_equal(nonfinite, 0);
        }
        if (k != 0 && k != 1 && k != 3)
            continue;
        apply(&dark);
        apply(&lit);
        for (uint32_t i = 0; i < N; i++) {
            double more = i == seen ? BRIGHT : i == missed && k == 3 ? BRIGHT / 4.25 : 0.0;
            if (!(fabs(shown(&lit, i) - shown(&dark, i) - more) <= 1e-6 * more))
                fail_msg("%u samples: pixel %u shows %g, and without lamps %g", k + 1, i, shown(&lit, i),
                         shown(&dark, i));
        }
    }
    /* One lamp in five samples is off by as much as halves of 0 and 1 in 2 samples and half a frame are apart */
    assert_true(lit.result.error > 1e6 * dark.result.error);
    stage_end(&lit);
    stage_end(&dark);
}

/* One half in 50 is a hundred times as bright as it should be: of N pixels 6 have two such halves, by chance. In the
 * area of a block less than one is expected, and with it two deviations of that are taken for chance: half of what is
 * beyond the limits would stay from 6 on, which no area in 1000 has. The light is there as before, but for what is
 * within the limits (an_outlier_is_shared_out). */
static void halves_alike_by_chance_are_no_spots(void **state)
{
    (void)state;
    uint32_t n = 0;
    for (uint32_t draw = 0; draw < 4; draw++) {
        struct stage s;
        stage_begin(&s, 2);
        for (uint32_t i = 0; i < N; i++)
            for (uint32_t k = 0; k < 4; k++) {
                bool bright = fabs(noise_of(draw, i, k % 2)) > sqrt(3.0) * (1.0 - 1.0 / 50.0);
                add(&s, i, k, bright ? 100.0 * TRUTH : TRUTH + 0.1 * noise(i, k));
            }
        apply(&s);
        for (uint32_t i = 0; i < N; i++) {
            bool both = (double)lum_film_mean(&s.samples, i % W, i / W).g > 90.0 * TRUTH;
            n += both;
            if (both && shown(&s, i) > 50.0 * TRUTH)
                fail_msg("draw %u: pixel %u shows %g", draw, i, shown(&s, i));
        }
        double kept = light_of(&s, anywhere, false) / light_of(&s, anywhere, true);
        if (!(fabs(kept - 1.0) < 0.01))
            fail_msg("draw %u: %.4f of the light is left", draw, kept);
        stage_end(&s);
    }
    print_message("%u pixels with two bright halves\n", n);
    assert_true(n > 8);
}

/* Among dark pixels it is those that the frame lights that get what is shared out. */
static void black_among_the_dark_stays_black(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++)
        if (is_right(i)) {
            bool black = i % 2 == 1;
            s.frame[i] = lum_grey(black ? 0.0f : 1e-3f * (float)TRUTH);
            for (uint32_t k = 0; k < 2; k++)
                add(&s, i, k, i == H / 2 * W + W * 3 / 4 && k == 0 ? BRIGHT : black ? 0.0 : 1e-3 * TRUTH);
        } else {
            for (uint32_t k = 0; k < 2; k++)
                add(&s, i, k, TRUTH);
        }
    apply(&s);
    double lit = 0.0, black = 0.0;
    for (uint32_t i = 0; i < N; i++)
        if (is_right(i))
            *(i % 2 == 1 ? &black : &lit) += shown(&s, i);
    if (!(black < 0.1 * lit && lit > 1e-3 * TRUTH * N / 4.0))
        fail_msg("black pixels show %g, dark ones %g", black, lit);
    stage_end(&s);
}

static double dark_on_the_right(uint32_t i)
{
    return is_left(i) ? TRUTH : TRUTH / 64.0;
}

/* Four classes of light apart: the dark wall gets nothing of what is too bright on the other, which gets it whole,
 * although it has but a part of the blocks where they meet. Tolerances as above: noise is a tenth. */
static void an_outlier_stays_where_it_is_lit_alike(void **state)
{
    (void)state;
    for (uint32_t from_edge = 4; from_edge <= 64; from_edge += 12) {
        struct stage s;
        stage_begin(&s, 2);
        for (uint32_t i = 0; i < N; i++)
            s.frame[i] = lum_grey((float)dark_on_the_right(i));
        add_with_outlier(&s, H / 3 * W + W / 2 - from_edge, dark_on_the_right);
        apply(&s);
        double left = light_of(&s, is_left, false) / light_of(&s, is_left, true) - 1.0;
        double right = light_of(&s, is_right, false) / light_of(&s, is_right, true) - 1.0;
        if (!(fabs(left) < 4.0 * 0.1 / sqrt(1.0 * N) && fabs(right) < 4.0 * 0.1 / sqrt(1.0 * N)))
            fail_msg("%u pixels from the edge: %.5f too much on the left, %.5f on the right", from_edge, left, right);
        stage_end(&s);
    }
}

/* Posts of 8 columns, so that a quarter of the pixels is at an edge. */
static bool is_at_a_post(uint32_t i)
{
    return i % 8 == 0 || i % 8 == 7;
}

static void put_posts(struct stage *s)
{
    for (uint32_t i = 0; i < N; i++)
        s->object[i] = i % W / 8;
}

/* One sample in 200 brings half of the light, at edges as elsewhere. Of the outliers there 2 N / 4 / 200 = 38 are
 * expected, so that 4 / 38 of their light is taken for chance, give or take as much: an eighth of all light is theirs.
 */
static void outliers_at_edges_are_not_lost(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    put_posts(&s);
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t k = 0; k < 2; k++) {
            bool bright = fabs(noise_of(1, i, k)) > sqrt(3.0) * (1.0 - 1.0 / 200.0);
            add(&s, i, k, TRUTH * (bright ? 100.5 : 0.5) + 0.1 * noise(i, k));
        }
    apply(&s);
    double lost = 1.0 - light_of(&s, anywhere, false) / light_of(&s, anywhere, true);
    print_message("%.4f of the light is lost\n", lost);
    assert_true(fabs(lost) < 2.0 * 4.0 / 38.0 / 8.0);
    stage_end(&s);
}

/* Samples at edges that are as often far above what the frame shows as below: were all of it shared out, the other
 * pixels would be off by the deviation of its sum. By more than two deviations it is in a case of 20, and what is taken
 * off then leaves less than half. */
static void edges_do_not_light_what_is_around(void **state)
{
    (void)state;
    const uint32_t draws = 40;
    double square = 0.0, all = 0.0;
    for (uint32_t draw = 0; draw < draws; draw++) {
        struct stage s;
        double sum = 0.0, n = 0.0;
        stage_begin(&s, 2);
        put_posts(&s);
        for (uint32_t i = 0; i < N; i++) {
            bool seen = i / W % 12 == 0 && is_at_a_post(i);
            for (uint32_t k = 0; k < 2; k++)
                add(&s, i, k, TRUTH + (seen ? copysign(50.0 * TRUTH, noise_of(draw, i, k)) : 0.1 * noise(i, k)));
            n += seen;
        }
        apply(&s);
        for (uint32_t i = 0; i < N; i++)
            sum += is_at_a_post(i) ? 0.0 : (shown(&s, i) - TRUTH) / (0.75 * N);
        square += sum * sum / draws;
        all = 50.0 * TRUTH * sqrt(0.5 * n) / N;
        stage_end(&s);
    }
    print_message("root mean square %.3f, %.3f were it all\n", sqrt(square), all);
    assert_true(sqrt(square) < 0.5 * all);
}

/* Where both samples at some edges see what the frame lacks, and at as many others what they see is chance, half of
 * what is beyond the limits stays where it is. The other half is no light of other pixels. */
static void details_of_edges_do_not_light_what_is_around(void **state)
{
    (void)state;
    struct stage s;
    double sum = 0.0, n = 0.0;
    stage_begin(&s, 2);
    put_posts(&s);
    for (uint32_t i = 0; i < N; i++) {
        bool detail = i / W % 12 == 0 && is_at_a_post(i), chance = i / W % 12 == 6 && is_at_a_post(i);
        for (uint32_t k = 0; k < 2; k++) {
            double off = chance ? copysign(50.0 * TRUTH, noise(i, k)) : detail ? 50.0 * TRUTH : 0.1 * noise(i, k);
            add(&s, i, k, TRUTH + off);
        }
        n += detail;
    }
    apply(&s);
    for (uint32_t i = 0; i < N; i++)
        sum += is_at_a_post(i) ? 0.0 : (shown(&s, i) - TRUTH) / (0.75 * N);
    double half = 0.5 * 50.0 * TRUTH * n / N;
    print_message("other pixels get %.3f, %.3f were it half of the details\n", sum, half);
    assert_true(fabs(sum) < 0.25 * half); /* what is within the limits is filtered, to others as well */
    stage_end(&s);
}

/* Every second post is black sky, at the rim of which one sample in 20 sees the next post: the sky between stays black.
 */
static void the_sky_between_posts_stays_black(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    put_posts(&s);
    for (uint32_t i = 0; i < N; i++) {
        bool sky = i % W / 8 % 2;
        if (sky) {
            s.kind[i] = LUM_PIXEL_SHINES;
            s.object[i] = LUM_NO_OBJECT;
            s.albedo[i] = s.frame[i] = lum_grey(0.0f);
            s.depth[i] = INFINITY;
        }
        for (uint32_t k = 0; k < 2; k++) {
            bool seen = is_at_a_post(i) && fabs(noise(i, k)) > 0.95 * sqrt(3.0);
            add(&s, i, k, !sky || seen ? TRUTH : 0.0);
        }
    }
    apply(&s);
    for (uint32_t i = 0; i < N; i++)
        if (s.object[i] == LUM_NO_OBJECT && i % 8 >= 3 && i % 8 < 5) /* what is within the limits is filtered */
            assert_true(shown(&s, i) < 0.01 * TRUTH);
    stage_end(&s);
}

/* What does not reflect, fog before the sky, has outliers as well. */
static void an_outlier_of_fog_is_shared_out(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++) {
        if (is_left(i))
            continue;
        s.kind[i] = LUM_PIXEL_SHINES;
        s.object[i] = LUM_NO_OBJECT;
        s.albedo[i] = lum_grey(0.0f);
        s.depth[i] = INFINITY;
    }
    add_with_outlier(&s, H / 2 * W + W * 3 / 4, even);
    apply(&s);
    double left = light_of(&s, is_left, false) / light_of(&s, is_left, true) - 1.0;
    double right = light_of(&s, is_right, false) / light_of(&s, is_right, true) - 1.0;
    if (!(fabs(left) < 4.0 * 0.1 / sqrt(1.0 * N) && fabs(right) < 4.0 * 0.1 / sqrt(1.0 * N)))
        fail_msg("%.5f too much on the wall, %.5f in the fog", left, right);
    stage_end(&s);
}

/* A texture that the frame lacks, and that samples know but for one in 100, which is bright: what is within the limits
 * is best not filtered at all, which would leave all outliers where they are. Their light is as much as the texture. */
static void unfiltered_samples_have_their_outliers(void **state)
{
    (void)state;
    const double texture = 0.1 * TRUTH;
    struct stage s;
    double square = 0.0, of_samples = 0.0;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++) {
        double truth = TRUTH + ((i + i / W) % 2 ? texture : -texture);
        for (uint32_t k = 0; k < 2; k++) {
            bool bright = fabs(noise(i, k)) > sqrt(3.0) * (1.0 - 1.0 / 100.0);
            add(&s, i, k, truth + (bright ? 99.0 : -1.0) * texture);
        }
    }
    apply(&s);
    for (uint32_t i = 0; i < N; i++) {
        double truth = TRUTH + ((i + i / W) % 2 ? texture : -texture);
        double sampled = (double)lum_film_mean(&s.samples, i % W, i / W).g;
        square += (shown(&s, i) - truth) * (shown(&s, i) - truth) / (N * texture * texture);
        of_samples += (sampled - truth) * (sampled - truth) / (N * texture * texture);
    }
    print_message("squared error over that of the frame %.4f, of the samples %.4f\n", square, of_samples);
    assert_true(square < 0.1 * of_samples);
    stage_end(&s);
}

/* A pane in the left wall: its samples mirror what is bright once in ten times, and else see the night. What a white
 * surface in its place would show is what the wall does. */
#define PANE_ALBEDO 0.05 /* the floor of residuals' albedo, its own is black */
#define PANE_TRUTH (TRUTH * PANE_ALBEDO / (0.5 + PANE_ALBEDO))
#define MIRRORED 0.1
#define PANE_ERROR 0.3 /* of its frame */

static bool is_pane(uint32_t i)
{
    return i % W >= 16 && i % W < 56 && i / W >= 20 && i / W < 76;
}

static void put_pane(struct stage *s)
{
    for (uint32_t i = 0; i < N; i++)
        if (is_pane(i)) {
            s->kind[i] = LUM_PIXEL_SURFACE | LUM_PIXEL_SPECULAR;
            s->object[i] = 1;
            s->albedo[i] = lum_grey(0.0f);
            s->frame[i] = lum_grey((float)(PANE_TRUTH * (1.0 + PANE_ERROR)));
        }
}

/* But for its rim, of which samples see the wall as well. */
static bool is_in_pane(uint32_t i)
{
    return is_pane(i - 1) && is_pane(i + 1) && is_pane(i - W) && is_pane(i + W);
}

/* Mean squares of what is off, over those of what is true. */
struct off {
    double pane, wall;
};

static struct off off_after(uint32_t samples, uint32_t draw)
{
    struct stage s;
    struct off off = {0};
    double n_pane = 0.0, n_wall = 0.0;
    stage_begin(&s, 2);
    put_pane(&s);
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t k = 0; k < samples; k++) {
            double u = noise_of(draw * 32 + k, i, k % 2); /* each for itself: no two share a sequence */
            bool mirrored = u > sqrt(3.0) * (1.0 - 2.0 * MIRRORED);
            add(&s, i, k, !is_pane(i) ? TRUTH * (1.0 + 0.1 * u) : mirrored ? PANE_TRUTH / MIRRORED : 0.0);
        }
    apply(&s);
    for (uint32_t i = 0; i < N; i++) {
        double rel = shown(&s, i) / (is_pane(i) ? PANE_TRUTH : TRUTH) - 1.0;
        off.pane += is_in_pane(i) ? rel * rel : 0.0;
        off.wall += is_pane(i) ? 0.0 : rel * rel;
        n_pane += is_in_pane(i);
        n_wall += !is_pane(i);
    }
    stage_end(&s);
    return (struct off){off.pane / n_pane, off.wall / n_wall};
}

/* However few samples: the frame, and then several times as many: the more, the less is off, in the mean of draws. */
static void more_samples_of_a_pane_are_no_worse(void **state)
{
    (void)state;
    static const uint32_t samples[] = {1, 8, 32};
    const uint32_t draws = 8;
    double before = PANE_ERROR * PANE_ERROR;
    for (size_t k = 0; k < sizeof samples / sizeof samples[0]; k++) {
        struct off sum = {0};
        for (uint32_t draw = 0; draw < draws; draw++) {
            struct off off = off_after(samples[k], draw);
            sum.pane += off.pane / draws;
            sum.wall += off.wall / draws;
        }
        print_message("%u samples: pane %.5f, wall %.6f\n", samples[k], sum.pane, sum.wall);
        if (!(sum.pane < before))
            fail_msg("%u samples of a pane: relative squared error %.5f, %.5f before", samples[k], sum.pane, before);
        before = sum.pane;
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_outlier_is_shared_out),
        cmocka_unit_test(a_lamp_smaller_than_a_pixel_stays),
        cmocka_unit_test(lamps_that_are_seen_light_nothing_around),
        cmocka_unit_test(halves_alike_by_chance_are_no_spots),
        cmocka_unit_test(black_among_the_dark_stays_black),
        cmocka_unit_test(an_outlier_stays_where_it_is_lit_alike),
        cmocka_unit_test(an_outlier_of_fog_is_shared_out),
        cmocka_unit_test(outliers_at_edges_are_not_lost),
        cmocka_unit_test(edges_do_not_light_what_is_around),
        cmocka_unit_test(the_sky_between_posts_stays_black),
        cmocka_unit_test(unfiltered_samples_have_their_outliers),
        cmocka_unit_test(more_samples_of_a_pane_are_no_worse),
        cmocka_unit_test(details_of_edges_do_not_light_what_is_around),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
