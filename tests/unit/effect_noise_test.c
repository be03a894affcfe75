/* How much of the noise of path traced samples is of which effect. */
#include <math.h>

#include "core/math/sampler.h"
#include "core/pass/eye.h"
#include "core/path/effect_noise.h"
#include "core/path/wave.h"
#include "tests/support/lit_room.h"

enum { W = 64, H = 64, PARTS = LUM_EFFECT_COUNT };

/* Uniform of mean 0 and deviation 1, independent. */
static float noise_at(uint32_t x, uint32_t y, uint32_t sample)
{
    return sqrtf(12.0f) * ((float)(lum_hash_u32((sample * W + x) * H + y) >> 8) * 0x1p-24f - 0.5f);
}

/* 16 samples of which the soft shadows have a deviation of 1 leave 1/4; the mean of all light is 3 + 1. 256 pixels are
 * looked at: the mean of so many squares of a nearly normal variable is right to sqrt(2 / 256), its root to half of
 * that: 4.4 % by a standard deviation, 18 % by four. What is not noisy has none at all. */
static void noise_is_that_of_the_mean(void **state)
{
    (void)state;
    struct lum_effect_noise noise;
    double got[LUM_EFFECT_COUNT];
    RIG_OK(lum_effect_noise_init(&noise, W, H, &err));
    for (int picture = 0; picture < 2; picture++) /* the first one is forgotten */
        for (uint32_t sample = 0; sample < 16; sample++)
            for (uint32_t y = 0; y < H; y++)
                for (uint32_t x = 0; x < W; x++) {
                    float parts[PARTS] = {0};
                    parts[LUM_EFFECT_DIRECT] = picture == 0 ? 100.0f * noise_at(y, x, sample) : 2.0f;
                    parts[LUM_EFFECT_SOFT_SHADOW] = 1.0f + noise_at(x, y, sample);
                    parts[LUM_EFFECT_ANTIALIAS] = 1.0f;
                    lum_effect_noise_add(&noise, x, y, sample, parts);
                }
    lum_effect_noise_read(&noise, 16, got);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++) {
        double expected = e == LUM_EFFECT_SOFT_SHADOW ? 0.25 / 4.0 : 0.0;
        if (!(fabs(got[e] - expected) <= 0.18 * expected))
            fail_msg("%s: %g, not %g", lum_effect_names[e], got[e], expected);
    }
    lum_effect_noise_read(&noise, 15, got); /* halves of unlike size */
    assert_true(isnan(got[LUM_EFFECT_SOFT_SHADOW]));
    lum_effect_noise_finish(&noise);
}

/* A path gains some ten floats, each rounded once more when it is added: 1e-5 is eight times what that comes to. */
static void parts_add_up_to_the_light(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 1);
    struct lum_eye eye;
    RIG_OK(lum_eye_init(&eye, &r.settings.camera, &r.snapshot->norm, r.settings.w, r.settings.h, &err));
    static struct lum_wave w;
    static float parts[LUM_RAY_BATCH][PARTS];
    struct lum_counters counters = {0};
    double found[PARTS] = {0};
    for (uint32_t batch = 0; batch < 8; batch++) {
        memset(parts, 0, sizeof parts);
        lum_wave_begin(&w, r.snapshot, &counters, 16, 0);
        w.parts = parts;
        for (uint32_t i = 0; i < LUM_RAY_BATCH; i++) {
            struct lum_sampler s = lum_sampler_at(i, batch, 0, 7);
            struct lum_vec2 at = lum_sampler_2d(&s, LUM_WAVE_PAIR_PIXEL);
            lum_wave_add_eye(&w, i, s, eye.o,
                             lum_eye_direction(&eye, at.x * (float)r.settings.w, at.y * (float)r.settings.h));
        }
        lum_wave_run(&w, 0);
        for (uint32_t i = 0; i < LUM_RAY_BATCH; i++) {
            double sum = 0.0, light = (double)lum_luminance(w.radiance[i]);
            for (int e = 0; e < PARTS; e++) {
                assert_true(parts[i][e] >= 0.0f);
                sum += (double)parts[i][e];
                found[e] += (double)parts[i][e];
            }
            if (!(fabs(sum - light) <= 1e-5 * light))
                fail_msg("path %u of batch %u: parts add up to %g, not %g", i, batch, sum, light);
        }
    }
    const enum lum_effect wanted[] = {LUM_EFFECT_DIRECT, LUM_EFFECT_SOFT_SHADOW, LUM_EFFECT_INDIRECT_DIFFUSE,
                                      LUM_EFFECT_REFLECTION, LUM_EFFECT_TRANSMISSION};
    for (size_t k = 0; k < LUM_ARRAY_LEN(wanted); k++)
        if (!(found[wanted[k]] > 0.0))
            fail_msg("no %s", lum_effect_names[wanted[k]]);
    assert_true(found[LUM_EFFECT_MEDIA] == 0.0 && found[LUM_EFFECT_ANTIALIAS] > 0.0);
    rig_end(&r);
}

static struct lum_pass_stats pass_until(struct rig *r, uint32_t spp)
{
    struct lum_pass_stats s = rig_pass(r);
    while (s.spp < spp)
        s = rig_pass(r);
    return s;
}

/* Of `live` the frame is the first sample. */
static void views_tell_it_of_their_samples(void **state)
{
    (void)state;
    const struct {
        const char *method;
        uint32_t even;
    } rows[] = {{"path", 2}, {"live", 3}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        struct rig r;
        lit_room(&r, 1);
        use_method(&r, rows[i].method);
        r.settings.max_spp = 64;
        struct lum_pass_stats s = pass_until(&r, rows[i].even);
        assert_true(isnan(s.effects[LUM_EFFECT_DIRECT].noise)); /* nobody asked for errors */
        struct lum_rgb *silent = rig_picture(&r);
        rig_fresh_view(&r);
        r.settings.error_share = 0.05;
        s = pass_until(&r, rows[i].even - 1);
        assert_true(isnan(s.effects[LUM_EFFECT_INDIRECT_DIFFUSE].noise));
        s = pass_until(&r, rows[i].even);
        for (int e = 0; e < LUM_EFFECT_ANTIALIAS; e++)
            if (!(s.demand.on[e] ? s.effects[e].noise >= 0.0 : s.effects[e].noise == 0.0))
                fail_msg("%s, %s: %g", rows[i].method, lum_effect_names[e], s.effects[e].noise);
        assert_true(s.effects[LUM_EFFECT_INDIRECT_DIFFUSE].noise > 0.0);
        rig_assert_picture(&r, silent, "that the noise is looked at");
        double known = s.effects[LUM_EFFECT_SOFT_SHADOW].noise;
        s = rig_pass(&r); /* halves of unlike size: as it was */
        assert_true(s.effects[LUM_EFFECT_SOFT_SHADOW].noise == known);
        r.settings.camera.position.x += 0.01;
        s = rig_pass(&r);
        assert_true(isnan(s.effects[LUM_EFFECT_SOFT_SHADOW].noise));
        lum_free(silent);
        rig_end(&r);
    }
}

static void threads_do_not_matter(void **state)
{
    (void)state;
    struct rig one, three;
    lit_room(&one, 1);
    lit_room(&three, 3);
    struct rig *rigs[] = {&one, &three};
    struct lum_pass_stats s[2];
    for (int i = 0; i < 2; i++) {
        use_method(rigs[i], "path");
        rigs[i]->settings.max_spp = 4;
        rigs[i]->settings.error_share = 0.05;
        s[i] = pass_until(rigs[i], 4);
    }
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        assert_true(s[0].effects[e].noise == s[1].effects[e].noise);
    rig_end(&one);
    rig_end(&three);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_is_that_of_the_mean),
        cmocka_unit_test(parts_add_up_to_the_light),
        cmocka_unit_test(views_tell_it_of_their_samples),
        cmocka_unit_test(threads_do_not_matter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
