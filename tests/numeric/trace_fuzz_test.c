/* Rays of any bits. Those in brackets are rows of the table of hard cases in core/NOTES.md. */
#include "tests/support/scene_fixture.h"

#include <string.h>

#include "core/accel/trace.h"
#include "core/scene/scene.h"

static struct lum_rays rays;
static struct lum_hits hits;

static float bits_to_float(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* What the gate promises, written again plainly. */
static bool fit(uint32_t i)
{
    const float limit = 1e8f, v[] = {rays.ox[i], rays.oy[i], rays.oz[i], rays.dx[i], rays.dy[i], rays.dz[i]};
    for (size_t k = 0; k < LUM_ARRAY_LEN(v); k++)
        if (!(fabsf(v[k]) <= limit))
            return false;
    bool moves = fabsf(v[3]) > 0.0f || fabsf(v[4]) > 0.0f || fabsf(v[5]) > 0.0f;
    return moves && rays.tnear[i] >= 0.0f && rays.tnear[i] <= rays.tfar[i];
}

/* A number with random bits, or a plain one, so that many rays are refused for one reason only. */
static float wild(struct random_stream *r)
{
    static const float special[] = {0.0f, -0.0f, NAN, INFINITY, -INFINITY, 1e-40f, 1e38f, 1e8f, -1e8f, 1.0f};
    uint32_t kind = random_bits(r) % 8;
    if (kind == 0)
        return bits_to_float(random_bits(r));
    if (kind == 1)
        return special[random_bits(r) % LUM_ARRAY_LEN(special)];
    return (float)(4.0 * random_double(r) - 2.0);
}

/* [H6] Any bits: nothing aborts, and the refused are counted exactly. */
static void fuzzed_rays_are_counted_not_traced(void **state)
{
    struct fixture *f = *state;
    put_shape(f->scene, "ball", "sphere", 16, 8);
    put_material(f->scene, "white");
    put_object(f->scene, "big", "ball", "white", scaled_at(50, 0, 0, 0));
    put_object(f->scene, "tiny", "ball", "white", scaled_at(1e-7, 1, 0, 0));
    put_object(f->scene, "flat", "ball", "white", (struct lum_affined){{{1, 0, 0, 0}, {0, 1e-7, 0, 0}, {0, 0, 1, 0}}});
    struct lum_light_desc light = light_desc(&lum_light_kind_sphere);
    put_light(f->scene, "sphere", &light);
    light.kind = &lum_light_kind_disc;
    put_light(f->scene, "disc", &light);
    const struct lum_snapshot *s = commit(f);
    assert_int_equal(s->n_instances, 3);
    struct random_stream r = {7};
    uint64_t bad = 0, expected = 0;
    const struct lum_trace t = {.top = s->top, .bad_rays = &bad};
    static uint8_t occluded[LUM_RAY_BATCH];
    for (uint32_t round = 0; round < 4000; round++) {
        rays.n = 1 + random_bits(&r) % LUM_RAY_BATCH;
        for (uint32_t i = 0; i < rays.n; i++) {
            set_ray(&rays, i, lum_v3(wild(&r), wild(&r), wild(&r)), lum_v3(wild(&r), wild(&r), wild(&r)));
            rays.tnear[i] = wild(&r);
            rays.tfar[i] = wild(&r);
            if (rays.tnear[i] < 0.0f && random_bits(&r) % 4)
                rays.tnear[i] = -rays.tnear[i];
            expected += !fit(i);
        }
        lum_trace_closest(&t, &rays, &hits);
        lum_trace_any(&t, &rays, occluded);
        for (uint32_t i = 0; i < rays.n; i++)
            if (!fit(i)) {
                assert_int_equal(hits.object[i], LUM_NO_OBJECT);
                assert_int_equal(occluded[i], 0);
            }
    }
    assert_int_equal(bad, 2 * expected);
    lum_snapshot_unref(s);
}

/* Embree traces packets of 16 in another way there, in which it does not heed its own mask. */
static void fuzzed_rays_on_a_narrow_processor(void **state)
{
    fuzzed_rays_are_counted_not_traced(state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(fuzzed_rays_are_counted_not_traced, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(fuzzed_rays_on_a_narrow_processor, fixture_setup_narrow, fixture_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
