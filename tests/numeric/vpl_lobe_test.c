/* Virtual point lights of glossy surfaces send light where it goes. */
#include "core/material/ggx.h"
#include "core/vpl/lobe.h"
#include "tests/support/lit_room.h"

static struct lum_vec3 direction(float cosine, float phi)
{
    float sine = sqrtf(1.0f - cosine * cosine);
    return lum_v3(sine * cosf(phi), sine * sinf(phi), cosine);
}

/* All light that a lobe gets goes somewhere: its mean over the hemisphere, weighted by the cosine, is 1. The table of
 * albedos is within 0.01 of the truth, over albedos of 0.04 and more; the sum over 256 x 256 directions is good to
 * 1e-3. */
static void lobes_keep_the_light(void **state)
{
    (void)state;
    const float alphas[] = {0.3f, 0.5f, 0.8f, 1.0f}, cosines[] = {0.05f, 0.2f, 0.5f, 0.9f, 1.0f},
                f0s[] = {0.04f, 0.5f, 1.0f};
    const struct lum_vec3 n = {0.0f, 0.0f, 1.0f};
    enum { SIDE = 256 };
    for (size_t a = 0; a < LUM_ARRAY_LEN(alphas); a++)
        for (size_t c = 0; c < LUM_ARRAY_LEN(cosines); c++)
            for (size_t f = 0; f < LUM_ARRAY_LEN(f0s); f++) {
                struct lum_ggx_albedo e = lum_ggx_albedo(lum_ggx_row(alphas[a]), cosines[c]);
                float albedo = f0s[f] * e.scale + e.bias;
                double sum = 0.0;
                for (int k = 0; k < SIDE * SIDE; k++) {
                    float u = ((float)(k / SIDE) + 0.5f) / SIDE,
                          phi = 2.0f * LUM_PI * ((float)(k % SIDE) + 0.5f) / SIDE;
                    float lobe = lum_vpl_lobe(n, direction(cosines[c], 0.0f), direction(sqrtf(u), phi), 1.0f, alphas[a],
                                              f0s[f] / albedo, 1.0f / albedo);
                    assert_true(lobe >= 0.0f && isfinite(lobe));
                    sum += (double)lobe / (SIDE * SIDE);
                }
                if (!(fabs(sum - 1.0) <= 0.01 / (double)albedo + 1e-3))
                    fail_msg("alpha %g, cosine %g, f0 %g: %g of the light", (double)alphas[a], (double)cosines[c],
                             (double)f0s[f], sum);
            }
    /* without gloss all directions get the same; and none is without a number, not even those that nothing goes to */
    assert_true(lum_vpl_lobe(n, n, direction(0.3f, 1.0f), 0.0f, 0.3f, 0.0f, 0.0f) == 1.0f);
    assert_true(isfinite(lum_vpl_lobe(n, n, lum_v3(0.0f, 0.0f, -1.0f), 1.0f, 0.3f, 1.0f, 1.0f)));
}

/* Luminance of the floor in front of a wall that the sun grazes, by all light but the sun's own. */
static double floor_by_the_wall(const char *method, uint32_t spp, uint32_t seed)
{
    struct rig r;
    rig_begin(&r, 2);
    struct lum_material_desc wall = rig_diffuse(0.3f);
    wall.specular = 1.0f;
    wall.roughness = 0.7f; /* alpha 0.49: wider than the narrowest lobe */
    rig_material(&r, "wall", &wall);
    rig_square(&r, "floor", 3);
    rig_diffuse_object(&r, "floor", "floor", 0.5f, rig_v(0, 0, 0));
    rig_box(&r, "slab", 3, 2, 0.1);
    rig_object(&r, "slab", "slab", "wall", rig_v(0, 2, -3.1));
    struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                 .direction = {0, -4, -1},
                                 .color = lum_grey(1),
                                 .intensity = 10000.0,
                                 .on = true};
    rig_light(&r, "sun", &sun);
    rig_camera(&r, rig_v(0, 4, 0), rig_v(0, 0, -1), 40);
    rig_commit(&r);
    use_method(&r, method);
    r.settings.max_spp = spp;
    r.settings.seed = seed;
    r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_DIRECT);
    while (!rig_pass(&r).complete)
        continue;
    double mean = (double)rig_mean(&r).g;
    rig_end(&r);
    return mean;
}

/* At 76 degrees much of what leaves the wall is gloss, and goes down. Spread evenly it brought the floor 0.83 of its
 * light. */
static void gloss_goes_where_it_is_sent(void **state)
{
    (void)state;
    enum { SEEDS = 8 };
    double want = floor_by_the_wall("path", 256, 99), sum = 0.0, square = 0.0;
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        double got = floor_by_the_wall("live", 1, seed);
        sum += got;
        square += got * got;
    }
    double mean = sum / SEEDS, error = sqrt(fmax(square / SEEDS - mean * mean, 0.0) / (SEEDS - 1));
    print_message("floor by a glossy wall: %.3f +- %.3f, path traced %.3f\n", mean, error, want);
    /* 4 standard errors; 4 % for the noise of path traced samples (1 %) and lifts at the wall's foot (vpl_sum.h) */
    assert_true(fabs(mean - want) <= 4.0 * error + 0.04 * want);
    assert_true(error < 0.03 * want);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lobes_keep_the_light),
        cmocka_unit_test(gloss_goes_where_it_is_sent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
