/* The fast frame corrected by samples. */
#include "core/effect/antialias/antialias.h"
#include "tests/numeric/residual_stage.h"

/* ---- bias ---- */

/* A frame that is wrong by +3 on one wall and by -3 on the other, samples with a deviation of 4: two of them, so 2.8
 * each pixel. The widest level averages at least 90 % of what a Gaussian of 26 pixels does that ends at the edges of a
 * wall of 80 x 96 pixels: more than 2000 pixels, so its noise is 2.8 / sqrt(2000) = 0.06. The levels' errors are
 * estimated over some 150 pixels, as squares with a deviation of 2.8^2 sqrt(2 / 150) = 0.9, so a narrower level may be
 * taken for as good, whose noise is at most that of the 150: 0.23. Nothing of the 3 stays on average, not even at the
 * edge between the walls, where half as many pixels are known. Of single ones there a part may: the frame's own error
 * of 9 is estimated as roughly, with 1.3, and weights of levels go by ratios of errors that may be near 0; not half of
 * it. */
static void bias_goes_on_each_wall(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++) {
        s.frame[i] = lum_grey((float)(TRUTH + (is_left(i) ? 3.0 : -3.0)));
        for (uint32_t k = 0; k < 2; k++)
            add(&s, i, k, TRUTH + 4.0 * noise(i, k));
    }
    apply(&s);
    assert_true(mean_square(&s, even) < 0.23 * 0.23);
    for (uint32_t x = W / 2 - 1; x <= W / 2; x++) {
        double sum = 0.0;
        for (uint32_t y = 0; y < H; y++) {
            double off = shown(&s, y * W + x) - TRUTH;
            assert_true(fabs(off) < 1.5);
            sum += off / H;
        }
        assert_true(fabs(sum) < 0.23);
    }
    stage_end(&s);
}

/* ---- detail ---- */

static double squares(uint32_t i)
{
    return TRUTH + (((i % W) / 2 + (i / W) / 2) % 2 ? 4.0 : -4.0);
}

/* What the frame does not show at all comes when the samples know it: four with a deviation of 0.4 each, 0.2 for all,
 * against a detail of 4. What of it is filtered stands out from what is around, so that the unfiltered level has most
 * of the weight; what is beyond the limits is alike in both halves but for 0.28 of 8: one part in 28 of their sum where
 * one in 5 is let pass, so that a sixth of it may be shared out instead, over squares in which it is as often above as
 * below: 0.67 is lost at most. */
static void detail_comes_with_the_samples(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t k = 0; k < 4; k++)
            add(&s, i, k, squares(i) + 0.4 * noise(i, k));
    apply(&s);
    assert_true(mean_square(&s, squares) < 0.04 + 0.67 * 0.67);
    stage_end(&s);
}

static bool is_of_lattice(uint32_t i)
{
    return i % W % 2 == 1 && i / W % 2 == 1;
}

/* Samples are noisy at every second pixel of every second row, where the frame is right. All pixels around know of that
 * noise, whatever the steps of the filter: its pixels are no judges of it by the others alone, which have what the
 * frame lacks, a detail of 0.5, without noise, and would leave all of theirs. At least some 150 pixels are averaged, a
 * quarter of which has a noise of 8 / sqrt(2): 5.7 / 2 / sqrt(150) = 0.23. */
static void noise_of_every_second_pixel_is_filtered(void **state)
{
    (void)state;
    struct stage s;
    double sum = 0.0;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t k = 0; k < 2; k++)
            add(&s, i, k, TRUTH + (is_of_lattice(i) ? 8.0 * noise(i, k) : 0.5 * noise(i, 0)));
    apply(&s);
    for (uint32_t i = 0; i < N; i++)
        sum += is_of_lattice(i) ? (shown(&s, i) - TRUTH) * (shown(&s, i) - TRUTH) / (N / 4.0) : 0.0;
    if (!(sqrt(sum) < 0.23))
        fail_msg("a noise of %g is left", sqrt(sum));
    stage_end(&s);
}

/* Without noise the samples are the picture, but for rounding. */
static void it_ends_at_the_samples(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t k = 0; k < 4; k++)
            add(&s, i, k, squares(i));
    apply(&s);
    for (uint32_t i = 0; i < N; i++)
        assert_true(fabs(shown(&s, i) - squares(i)) < 1e-5 * TRUTH);
    stage_end(&s);
}

/* A frame that is wrong in every way at once: little by little, from pixel to pixel, and on one of the walls in spots.
 * Whatever the noise of its eight samples is, the picture is no worse than they are, but for 1 % that levels chosen by
 * chance may add (2 % of the square), and becomes better as they do. */
static void it_is_never_worse_than_its_samples(void **state)
{
    (void)state;
    double before = INFINITY;
    for (double sd = 8.0; sd > 1e-3; sd /= 2.0) {
        struct stage s;
        double samples = 0.0;
        stage_begin(&s, 2);
        for (uint32_t i = 0; i < N; i++) {
            uint32_t x = i % W, y = i / W;
            double wide = 0.5 * cos(x * 0.05) + 0.2 * cos(y * 0.3), fine = x % 2 ? 0.05 : -0.05, sum = 0.0;
            double spot = is_left(i) && x % 20 < 5 && y % 20 < 5 ? 2.0 : 0.0;
            s.frame[i] = lum_grey((float)(TRUTH + wide + fine + spot));
            for (uint32_t k = 0; k < 8; k++) {
                add(&s, i, k, TRUTH + sd * noise(i, k));
                sum += sd * noise(i, k) / 8.0;
            }
            samples += sum * sum / N;
        }
        apply(&s);
        double is = mean_square(&s, even);
        if (!(is < 1.02 * samples && is < before))
            fail_msg("noise of %g: samples with an error of %g, a picture with %g, before that %g", sd, sqrt(samples),
                     sqrt(is), sqrt(before));
        before = is;
        stage_end(&s);
    }
}

/* ---- errors ---- */

/* What is said of the error against what it is: a sum over N pixels of an estimate with the deviation of about v
 * sqrt(2) a pixel, v the variance of four samples: v sqrt(2 / N), and what it is itself. Choosing the best level by
 * estimates from the same samples makes the sum a little too small: by no more than the deviation of an estimate over
 * 150 pixels, v sqrt(2 / 150), times the share of pixels where another level would be as good. */
static void the_error_is_what_it_says(void **state)
{
    (void)state;
    static const struct {
        double bias, sd, detail;
    } cases[] = {{0, 4, 0}, {3, 4, 0}, {3, 1, 1}, {0, 0.4, 4}, {2, 2, 2}};
    for (size_t c = 0; c < LUM_ARRAY_LEN(cases); c++) {
        struct stage s;
        double sum = 0.0, v = cases[c].sd * cases[c].sd / 4.0;
        stage_begin(&s, 2);
        for (uint32_t i = 0; i < N; i++) {
            double truth = TRUTH + (squares(i) - TRUTH) * cases[c].detail / 4.0;
            s.frame[i] = lum_grey((float)(TRUTH + cases[c].bias));
            for (uint32_t k = 0; k < 4; k++)
                add(&s, i, k, truth + cases[c].sd * noise(i, k));
        }
        apply(&s);
        for (uint32_t i = 0; i < N; i++) {
            double d = shown(&s, i) - (TRUTH + (squares(i) - TRUTH) * cases[c].detail / 4.0);
            sum += d * d;
        }
        double is = sum / N, said = s.result.error / N;
        if (!(fabs(said - is) < 4.0 * v * sqrt(2.0 / N) + v * sqrt(2.0 / 150.0)))
            fail_msg("case %zu: the mean square error is %g, %g is said", c, is, said);
        stage_end(&s);
    }
}

/* A frame that is right, and one that is wrong by a quarter of the noise, in 100 draws of two samples each: what is
 * said with its doubt is no less than the error in 95 of them, or in 95 - 4 sqrt(100 * 0.05 * 0.95) at least. */
static void the_error_is_covered(void **state)
{
    (void)state;
    for (double bias = 0.0; bias <= 1.0; bias++) {
        uint32_t n_covered = 0;
        for (uint32_t draw = 0; draw < 100; draw++) {
            struct stage s;
            stage_begin(&s, 2);
            for (uint32_t i = 0; i < N; i++) {
                s.frame[i] = lum_grey((float)(TRUTH + bias));
                for (uint32_t k = 0; k < 2; k++)
                    add(&s, i, k, TRUTH + 4.0 * noise_of(draw, i, k));
            }
            apply(&s);
            n_covered += s.result.error + 1.645 * s.result.doubt >= mean_square(&s, even) * N;
            stage_end(&s);
        }
        if (n_covered < 87)
            fail_msg("bias %g: the error is covered in %u of 100 draws", bias, n_covered);
    }
}

/* All that is lit so much more, with samples that stand out everywhere: lamps of 1e12 cd at a tenth of a millimetre.
 * The estimate is the same in units of the picture, but for rounding to
 * floats, of which the sums have tens. */
static void the_error_is_a_number_in_any_light(void **state)
{
    (void)state;
    double error[2] = {0.0}, doubt[2] = {0.0};
    for (int bright = 0; bright < 2; bright++) {
        struct stage s;
        double scale = bright ? 0x1p80 : 1.0;
        stage_begin(&s, 2);
        for (uint32_t i = 0; i < N; i++) {
            s.object[i] = i % 7 == 0;
            s.frame[i] = lum_grey((float)(TRUTH * scale));
            for (uint32_t k = 0; k < 2; k++)
                add(&s, i, k, (TRUTH + 2.0 * noise(i, k) + (i % 97 == k ? 100.0 : 0.0)) * scale);
        }
        apply(&s);
        error[bright] = s.result.error / (scale * scale);
        doubt[bright] = s.result.doubt / (scale * scale);
        stage_end(&s);
    }
    assert_true(error[0] != 0.0 && fabs(error[1] / error[0] - 1.0) < 1e-5);
    assert_true(doubt[0] > 0.0 && fabs(doubt[1] / doubt[0] - 1.0) < 1e-5);
}

/* A wall that the frame shows 2^70 times as bright as all else, by a lamp that the first samples miss: residuals are
 * that many times the samples' mean, and squares of them are no floats. */
static void samples_that_miss_a_lamp_are_numbers(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++) {
        s.frame[i] = lum_grey(is_left(i) ? (float)TRUTH * 0x1p70f : (float)TRUTH);
        for (uint32_t k = 0; k < 2; k++)
            add(&s, i, k, TRUTH + 2.0 * noise(i, k));
    }
    apply(&s); /* asserts that all is finite */
    assert_true(isfinite(s.result.error) && isfinite(s.result.doubt) && s.result.mean > 0.0);
    stage_end(&s);
}

/* ---- one sample ---- */

/* Each half has every second column. A frame that is wrong by 3, a sample with a deviation of 4 of each pixel: the bias
 * goes as it does with two. */
static void one_sample_corrects(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++) {
        s.frame[i] = lum_grey((float)(TRUTH + (is_left(i) ? 3.0 : -3.0)));
        add(&s, i, 0, TRUTH + 4.0 * noise(i, 0));
    }
    apply(&s);
    double off = sqrt(mean_square(&s, even));
    print_message("root mean square error %g\n", off);
    assert_true(off < 4.0 / sqrt(150.0)); /* as above, from one sample */

    uint32_t alone = H / 2 * W + W / 4; /* a surface that no other pixel shows: one sample is no judge of it */
    s.kind[alone] ^= LUM_PIXEL_SPECULAR;
    lum_film_reset_pixel(&s.samples, alone % W, alone / W);
    add(&s, alone, 0, TRUTH + 100.0);
    apply(&s);
    assert_true(fabs(shown(&s, alone) - (double)s.frame[alone].g) < 0.1); /* but for its part in what is shared out */
    stage_end(&s);
}

/* ---- edges ---- */

/* The pixels right of the edge show as much of the left wall as of the right one, and the frame was smoothed so. It is
 * wrong by 5 on the left and by -10 on the right, so by -2.5 there. Noise of each filtered residual: 0.23, as above,
 * where samples have a deviation of 4. */
static void smoothed_edges_get_the_residual_of_both_sides(void **state)
{
    (void)state;
    static uint32_t neighbours[N];
    struct stage s;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++) {
        uint32_t left = LUM_NEIGHBOUR_SELF - 1, half = LUM_EDGE_RAYS / 2 * LUM_NEIGHBOUR_BITS;
        bool mixed = i % W == W / 2;
        neighbours[i] = LUM_NEIGHBOURS_SELF;
        if (mixed)
            neighbours[i] = LUM_NEIGHBOURS_SELF << half | (UINT32_MAX / LUM_NEIGHBOUR_MASK * left) >> half;
        double truth = mixed ? TRUTH + 2.5 : is_left(i) ? TRUTH - 5.0 : TRUTH + 10.0;
        for (uint32_t k = 0; k < 2; k++)
            add(&s, i, k, truth + 4.0 * noise(i, k));
    }
    s.neighbours = neighbours;
    apply(&s);
    double sum = 0.0;
    for (uint32_t y = 0; y < H; y++)
        sum += (shown(&s, y * W + W / 2) - TRUTH) / H;
    print_message("corrected by %.3f, 2.5 is right\n", sum);
    assert_true(fabs(sum - 2.5) < 3.0 * 0.23);
    stage_end(&s);
}

/* ---- odd cases ---- */

/* Of a texture of two colours that is finer than pixels: the albedo seen through a pixel's middle is not that of its
 * samples. The mean of every channel is right. */
static void fine_texture(const struct lum_rgb colour[2], uint32_t spp)
{
    struct stage s;
    stage_begin(&s, 2);
    struct lum_rgb want = lum_grey(0.0f), got = want;
    for (uint32_t i = 0; i < N; i++) {
        s.albedo[i] = colour[noise_of(3, i, 0) > 0.0];
        s.frame[i] = lum_rgb_scale(s.albedo[i], 0.5f * (float)TRUTH); /* half of the light is missing */
        for (uint32_t k = 0; k < spp; k++) {
            float light = (float)(TRUTH + 10.0 * noise(i, k));
            struct lum_rgb value = lum_rgb_scale(colour[noise_of(4, i, k) > 0.0], light);
            add_rgb(&s, i, k, value);
            want = lum_rgb_mad(want, value, 1.0f / (float)spp);
        }
    }
    apply(&s);
    for (uint32_t i = 0; i < N; i++)
        got = lum_rgb_add(got, lum_film_mean(&s.picture, i % W, i / W));
    struct lum_rgb ratio = lum_rgb_div(got, want);
    /* 2 %: limits of outliers, of which two samples tell little, are not even about two-valued noise. */
    if (!(fabsf(ratio.r - 1.0f) < 0.02f && fabsf(ratio.g - 1.0f) < 0.02f && fabsf(ratio.b - 1.0f) < 0.02f))
        fail_msg("over the mean of %u samples: %g %g %g", spp, (double)ratio.r, (double)ratio.g, (double)ratio.b);
    stage_end(&s);
}

static void a_fine_texture_is_as_bright_as_its_samples(void **state)
{
    (void)state;
    const struct lum_rgb grey[2] = {{0.3f, 0.3f, 0.3f}, {0.7f, 0.7f, 0.7f}},
                         brick[2] = {{0.5f, 0.2f, 0.12f}, {0.5f, 0.48f, 0.45f}},
                         cloth[2] = {{0.7f, 0.1f, 0.1f}, {0.1f, 0.1f, 0.7f}};
    for (uint32_t spp = 2; spp <= 8; spp *= 2) {
        fine_texture(grey, spp);  /* with means of ratios 1.16 at two samples, */
        fine_texture(brick, spp); /* and with weights by luminance 1.14 in blue */
        fine_texture(cloth, spp);
    }
}

/* Every fourth column of a wall is a hundred times as bright as the others. There the frame has 30 % too much and
 * samples have more noise than that, so that what is taken off is filtered. The dark columns, which are right, pay for
 * none of it: they show no more error than their own two samples may have, which are uniform with a deviation of 0.1.
 * The bright ones keep that of their sum, 0.5 / sqrt(2 N / 4); four of its deviations. */
static void the_dark_pays_for_nothing(void **state)
{
    (void)state;
    struct stage s;
    double bright = 0.0;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++) {
        double truth = i % 4 == 0 ? TRUTH : 0.01 * TRUTH;
        s.frame[i] = lum_grey((float)(i % 4 == 0 ? 1.3 * truth : truth));
        for (uint32_t k = 0; k < 2; k++)
            add(&s, i, k, truth * (1.0 + (i % 4 == 0 ? 0.5 : 0.1) * noise(i, k)));
    }
    apply(&s);
    for (uint32_t i = 0; i < N; i++) {
        if (i % 4 == 0)
            bright += shown(&s, i) / TRUTH / (N / 4.0);
        else if (!(fabs(shown(&s, i) / (0.01 * TRUTH) - 1.0) < 0.1 * sqrt(3.0)))
            fail_msg("%g is shown of %g at (%u, %u)", shown(&s, i), 0.01 * TRUTH, i % W, i / W);
    }
    if (!(fabs(bright - 1.0) < 4.0 * 0.5 / sqrt(2.0 * N / 4.0)))
        fail_msg("%g of the bright columns", bright);
    stage_end(&s);
}

/* The samples know nothing of it. */
static void a_spot_of_the_frame_goes(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    uint32_t at = H / 2 * W + W / 4;
    for (uint32_t k = 0; k < 9; k++)
        s.frame[at + k % 3 + k / 3 * W] = lum_grey(20.0f * (float)TRUTH);
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t k = 0; k < 8; k++)
            add(&s, i, k, TRUTH + noise(i, k));
    apply(&s);
    for (uint32_t k = 0; k < 9; k++)
        if (!(shown(&s, at + k % 3 + k / 3 * W) < 2.0 * TRUTH))
            fail_msg("%g is left of it", shown(&s, at + k % 3 + k / 3 * W));
    stage_end(&s);
}

/* The night beside a wall, whose edge some of its pixels see. */
static void night_stays_black(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 2);
    for (uint32_t i = 0; i < N; i++) {
        bool night = !is_left(i);
        if (night) {
            s.kind[i] = 0;
            s.object[i] = LUM_NO_OBJECT;
            s.albedo[i] = s.frame[i] = lum_grey(0.0f);
            s.depth[i] = INFINITY;
        }
        for (uint32_t k = 0; k < 4; k++)
            add(&s, i, k, !night || (i % W == W / 2 && noise(i, k) > 0.0) ? TRUTH : 0.0);
    }
    apply(&s);
    for (uint32_t i = 0; i < N; i++)
        if (i % W > W / 2 && shown(&s, i) > 0.0)
            fail_msg("%g at (%u, %u)", shown(&s, i), i % W, i / W);
    stage_end(&s);
}

static void black_stays_black(void **state)
{
    (void)state;
    struct stage s;
    stage_begin(&s, 1);
    for (uint32_t i = 0; i < N; i++) {
        s.frame[i] = s.albedo[i] = lum_grey(0.0f);
        s.object[i] = i % 3 ? 0 : LUM_NO_OBJECT;
        for (uint32_t k = 0; k < 2; k++)
            add(&s, i, k, 0.0);
    }
    apply(&s);
    for (uint32_t i = 0; i < N; i++)
        assert_true(shown(&s, i) == 0.0);
    assert_true(s.result.error == 0.0 && s.result.mean == 0.0);
    stage_end(&s);
}

/* One wall is exactly right, and what it has from the noise of the other, whose normal is all but at right angles, is
 * less than a float can tell a share of. No weight is lost in that. */
static void the_least_errors_are_numbers(void **state)
{
    (void)state;
    for (float tilt = 0.003f; tilt < 0.012f; tilt += 0.0005f) {
        struct stage s;
        stage_begin(&s, 2);
        for (uint32_t i = 0; i < N; i++) {
            s.p[i] = lum_v3((float)(i % W), (float)(i / W), 0.0f);
            s.n[i] = is_left(i) ? lum_v3(0, 0, 1) : lum_v3(-1, 0, tilt);
            for (uint32_t k = 0; k < 2; k++)
                add(&s, i, k, TRUTH + (is_left(i) ? 0.0 : 4.0 * noise(i, k)));
        }
        apply(&s); /* asserts that all is finite */
        stage_end(&s);
    }
}

static void threads_do_not_matter(void **state)
{
    (void)state;
    static struct stage one, three;
    struct stage *stages[] = {&one, &three};
    for (uint32_t t = 0; t < 2; t++) {
        stage_begin(stages[t], t ? 3 : 1);
        for (uint32_t i = 0; i < N; i++)
            for (uint32_t k = 0; k < 2; k++)
                add(stages[t], i, k, squares(i) + 2.0 * noise(i, k));
        apply(stages[t]);
    }
    assert_memory_equal(one.picture.half[0], three.picture.half[0], 3 * N * sizeof(double));
    assert_true(one.result.error == three.result.error);
    stage_end(&one);
    stage_end(&three);
}

/* Even light on a texture finer than pixels: each sample meets the one paint or the other, by chance. All of the error
 * is how many of each a pixel's samples met, and it is said: over all pixels to a deviation of sqrt(2 / N), 1 %, and as
 * far as ten samples tell the variance of a binomial, whose kurtosis is below 3. */
static void the_error_of_a_fine_texture_is_said(void **state)
{
    (void)state;
    struct stage s;
    struct lum_error err;
    stage_begin(&s, 2);
    assert_int_equal(lum_film_keep_first(&s.samples, &err), LUM_OK);
    const double light = 2.0 * TRUTH, dark = 0.2, bright = 0.8, floor = 0.05; /* as residuals are divided */
    for (uint32_t i = 0; i < N; i++)
        s.frame[i] = lum_grey((float)(light * (0.5 + floor)));
    for (uint32_t k = 0; k < 10; k++)
        for (uint32_t i = 0; i < N; i++) {
            double paint = noise(i, k) > 0.0 ? bright : dark;
            struct lum_film_first first = {.albedo = lum_grey((float)paint)};
            uint64_t nonfinite = 0;
            lum_film_add_apart(&s.samples, i % W, i / W, k, lum_grey((float)(light * (paint + floor))), &first,
                               &nonfinite);
        }
    apply(&s);
    double is = 0.0, all = light * (0.5 * (dark + bright) + floor);
    for (uint32_t i = 0; i < N; i++)
        is += (shown(&s, i) - all) * (shown(&s, i) - all);
    print_message("squared error %g, %g is said\n", is / N, s.result.error / N);
    assert_true(is > 0.0 && s.result.error > 0.8 * is && s.result.error < 1.5 * is);
    stage_end(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bias_goes_on_each_wall),
        cmocka_unit_test(detail_comes_with_the_samples),
        cmocka_unit_test(noise_of_every_second_pixel_is_filtered),
        cmocka_unit_test(the_dark_pays_for_nothing),
        cmocka_unit_test(it_ends_at_the_samples),
        cmocka_unit_test(it_is_never_worse_than_its_samples),
        cmocka_unit_test(the_error_is_what_it_says),
        cmocka_unit_test(the_error_is_covered),
        cmocka_unit_test(the_error_of_a_fine_texture_is_said),
        cmocka_unit_test(the_error_is_a_number_in_any_light),
        cmocka_unit_test(samples_that_miss_a_lamp_are_numbers),
        cmocka_unit_test(one_sample_corrects),
        cmocka_unit_test(smoothed_edges_get_the_residual_of_both_sides),
        cmocka_unit_test(a_fine_texture_is_as_bright_as_its_samples),
        cmocka_unit_test(a_spot_of_the_frame_goes),
        cmocka_unit_test(night_stays_black),
        cmocka_unit_test(black_stays_black),
        cmocka_unit_test(threads_do_not_matter),
        cmocka_unit_test(the_least_errors_are_numbers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
