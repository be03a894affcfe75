/* Lights and media as a snapshot has them: scene units, emissive objects, who is picked how often. */
#include <stdio.h>
#include <string.h>

#include "core/light/sample.h"
#include "core/scene/scene.h"
#include "tests/support/scene_fixture.h"

static uint32_t light_index(const struct lum_snapshot *s, const char *id)
{
    for (uint32_t i = 0; i < s->lights.n_lights; i++)
        if (strcmp(s->lights.lights[i].id, id) == 0)
            return i;
    fail_msg("there is no light \"%s\"", id);
    return 0;
}

/* ---- media ---- */

/* What a renderer reads of media: those with coefficients, by id, per scene unit. */
static void media_reach_the_snapshot(void **state)
{
    struct fixture *f = *state;
    furnish(f->scene); /* 5 m: a scene unit is not a metre */
    struct lum_medium_desc m = {
        .sigma_s = {1, 2, 3}, .sigma_a = {0.5f, 0, 0}, .g = -0.25f, .lo = {-1, 0, 0}, .hi = {3, 4, 5}};
    CHECK_OK(lum_scene_put_medium(f->scene, "b", &m, err));
    m.everywhere = true;
    CHECK_OK(lum_scene_put_medium(f->scene, "a", &m, err));
    put_fog(f->scene, "clear", 0.0f);
    const struct lum_snapshot *s = commit(f);
    float scale = (float)s->norm.scale;
    assert_true(scale > 1.0f);
    assert_int_equal(s->n_media, 3);
    const struct lum_medium *a = &s->media[0], *b = &s->media[1];
    assert_string_equal(a->id, "a");
    assert_string_equal(b->id, "b");
    assert_string_equal(s->media[2].id, "fog");
    assert_true(a->lo.x == -INFINITY && a->hi.z == INFINITY);
    struct lum_vec3 lo = to_scene(s, -1, 0, 0), hi = to_scene(s, 3, 4, 5);
    assert_memory_equal(&b->lo, &lo, sizeof lo);
    assert_memory_equal(&b->hi, &hi, sizeof hi);
    assert_true(b->sigma_s.g * scale == 2.0f && b->sigma_t.r * scale == 1.5f && b->g == -0.25f);
    lum_snapshot_unref(s);
}

static void bad_media_are_refused(void **state)
{
    struct fixture *f = *state;
    struct lum_error refusal;
    const struct lum_medium_desc good = {.sigma_s = {1, 1, 1}, .hi = {1, 1, 1}};
    struct lum_medium_desc m = good;
    m.sigma_s.g = -1.0f;
    assert_int_equal(lum_scene_put_medium(f->scene, "m", &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "sigma_s");
    m = good;
    m.sigma_a.b = NAN;
    assert_int_equal(lum_scene_put_medium(f->scene, "m", &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "sigma_a");
    m = good;
    m.g = 1.0f;
    assert_int_equal(lum_scene_put_medium(f->scene, "m", &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "g");
    m = good;
    m.hi.y = 0.0;
    assert_int_equal(lum_scene_put_medium(f->scene, "m", &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "box");
    m.hi.y = (double)NAN;
    assert_int_equal(lum_scene_put_medium(f->scene, "m", &m, &refusal), LUM_ERR_INVALID);
    m.everywhere = true; /* the box is not looked at */
    m.g = 0.99f;
    CHECK_OK(lum_scene_put_medium(f->scene, "m", &m, err));
    CHECK_OK(lum_scene_remove(f->scene, LUM_ENTITY_MEDIUM, "m", err));
    assert_int_equal(lum_scene_remove(f->scene, LUM_ENTITY_MEDIUM, "m", &refusal), LUM_ERR_NOT_FOUND);
}

/* An edit may put new media before it removes the old ones: only what is published is limited. */
static void too_many_media_are_not_published(void **state)
{
    struct fixture *f = *state;
    char id[] = "fog0";
    for (uint32_t i = 0; i <= LUM_MEDIA_MAX; i++) {
        id[3] = (char)('0' + i);
        put_fog(f->scene, id, 1.0f);
    }
    const struct lum_snapshot *s = NULL;
    struct lum_error refusal;
    assert_int_equal(lum_scene_commit(f->scene, 1, &s, &refusal), LUM_ERR_LIMIT);
    assert_string_equal(refusal.field, "medium");
    assert_null(s);
    CHECK_OK(lum_scene_remove(f->scene, LUM_ENTITY_MEDIUM, "fog0", err));
    s = commit(f);
    assert_int_equal(s->n_media, LUM_MEDIA_MAX);
    lum_snapshot_unref(s);
}

/* ---- units, lights ---- */

static void lengths_and_powers_are_in_scene_units(void **state)
{
    struct fixture *f = *state;
    furnish(f->scene);
    struct lum_material_desc glass = lum_material_default();
    glass.attenuation_color = lum_grey(0.25f);
    glass.attenuation_distance_m = 0.5;
    CHECK_OK(lum_scene_put_material(f->scene, "glass", &glass, err));
    const struct lum_snapshot *s = commit(f);
    double scale = s->norm.scale;
    const struct lum_light *fill_light = &s->lights.lights[light_index(s, "fill")];
    assert_true(fabs((double)fill_light->power.g / (100.0 * scale * scale) - 1.0) < 1e-6);
    const struct lum_light *key = &s->lights.lights[light_index(s, "key")];
    assert_true(fabs((double)key->area / (scale * scale) - 1.0) < 1e-6);
    assert_true(fabs((double)key->power.g - 100.0) < 1e-4);
    assert_true(key->n.y == -1.0f || fabsf(key->n.y + 1.0f) < 1e-6f);
    assert_string_equal(s->materials[0].id, "glass"); /* exp(-sigma * 0.5 m) = 0.25 */
    assert_true(fabs((double)s->materials[0].sigma_a.r * scale * 0.5 - 1.3862943611198906) < 1e-5);
    lum_snapshot_unref(s);
}

static void emissive_objects_are_lights(void **state)
{
    struct fixture *f = *state;
    furnish(f->scene);
    const struct lum_snapshot *s = commit(f);
    const struct lum_light *lamp = &s->lights.lights[light_index(s, "lamp")];
    assert_int_equal(lamp->kind, &lum_emitter_mesh);
    assert_string_equal(s->instances[lamp->instance].id, "lamp");
    assert_int_equal(s->instances[lamp->instance].light, light_index(s, "lamp"));
    const struct lum_mesh *mesh = s->instances[lamp->instance].mesh;
    double area = 0.0;
    for (uint32_t i = 0; i < mesh->n_triangles; i++) {
        struct lum_vec3 p[3];
        for (uint32_t k = 0; k < 3; k++) {
            const float *v = mesh->positions + 3 * (size_t)mesh->indices[3 * i + k];
            p[k] = lum_affine_point(&s->instances[lamp->instance].local_to_scene, lum_v3(v[0], v[1], v[2]));
        }
        area += 0.5 * (double)lum_length(lum_cross(lum_v3_sub(p[1], p[0]), lum_v3_sub(p[2], p[0])));
        assert_true(fabs((double)lamp->tri_cdf[i] / area - 1.0) < 1e-5);
    }
    assert_true(lamp->tri_cdf[mesh->n_triangles - 1] == lamp->area);
    assert_true(fabsf(lamp->power.g - 50.0f) < 1e-4f);
    lum_snapshot_unref(s);
}

/* Where the alpha test cuts a hole, nothing shines. */
static void emitters_shine_where_they_are(void **state)
{
    struct fixture *f = *state;
    put_shape(f->scene, "sheet", "quad", 1, 1);
    const struct {
        enum lum_alpha_mode mode;
        float alpha;
        double share;
    } rows[] = {{LUM_ALPHA_MASK, 0.4f, 0.0}, {LUM_ALPHA_MASK, 0.6f, 1.0}, {LUM_ALPHA_BLEND, 0.25f, 0.25}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        struct lum_material_desc m = lum_material_default();
        m.emission_cd_m2 = 50.0;
        m.alpha_mode = rows[i].mode;
        m.alpha = rows[i].alpha;
        CHECK_OK(lum_scene_put_material(f->scene, "neon", &m, err));
        put_object(f->scene, "sign", "sheet", "neon", at(0, 0, 0));
        const struct lum_snapshot *s = commit(f);
        struct random_stream random = {1};
        enum { n = 4096 };
        int lit = 0;
        for (int k = 0; k < n; k++) {
            struct lum_vec2 u = {(float)random_double(&random), (float)random_double(&random)};
            struct lum_light_sample sample;
            lit += lum_light_sample_at(s, 0, to_scene(s, 0, 1, 0), u, &sample);
        }
        /* five standard deviations of the count of n coins */
        double tolerance = 5.0 * sqrt(n * rows[i].share * (1.0 - rows[i].share));
        if (!(fabs(lit - n * rows[i].share) <= tolerance))
            fail_msg("row %zu: %d of %d samples are lit, expected %g", i, lit, n, n * rows[i].share);
        lum_snapshot_unref(s);
    }
}

/* The brightest light in the smallest scene: 1 / r^2 stays finite, with room for sharp lobes and rare picks. */
static void no_power_overflows(void **state)
{
    struct fixture *f = *state;
    put_shape(f->scene, "box", "box", 1, 1);
    put_material(f->scene, "white");
    put_object(f->scene, "mote", "box", "white", scaled_at(1e-10, 0, 0, 0));
    struct lum_light_desc l = light_desc(&lum_light_kind_point);
    l.position = (struct lum_vec3d){0, 0, 0};
    l.intensity = 1e12;
    l.color = lum_grey(100.0f);
    put_light(f->scene, "nova", &l);
    const struct lum_snapshot *s = commit(f);
    assert_int_equal(s->lights.n_active, 1);
    struct lum_light_sample sample;
    assert_true(lum_light_sample_at(s, 0, lum_v3(1e-6f, 0, 0), (struct lum_vec2){0.5f, 0.5f}, &sample));
    assert_true(isfinite(sample.radiance.r * 0x1p30f));
    lum_snapshot_unref(s);
}

static void lights_are_picked_half_by_flux(void **state)
{
    struct fixture *f = *state;
    struct lum_error refusal;
    const struct lum_light_kind_row *const kinds[] = {&lum_light_kind_point, &lum_light_kind_spot, &lum_light_kind_quad,
                                                      &lum_light_kind_disc, &lum_light_kind_sphere};
    for (uint32_t i = 0; i < LUM_ARRAY_LEN(kinds); i++) {
        char id[8];
        snprintf(id, sizeof id, "l%u", i);
        struct lum_light_desc l = light_desc(kinds[i]);
        l.position.x = i;
        CHECK_OK(lum_light_from_flux(&l, 100.0 * (i + 1), &l.intensity, err));
        put_light(f->scene, id, &l);
    }
    struct lum_light_desc off = light_desc(&lum_light_kind_point);
    off.on = false;
    put_light(f->scene, "off", &off);
    const struct lum_snapshot *s = commit(f);
    assert_int_equal(s->lights.n_lights, 6);
    assert_int_equal(s->lights.n_active, 5);
    float before = 0.0f;
    for (uint32_t i = 0; i < 5; i++) { /* fluxes 1 : 2 : 3 : 4 : 5 */
        assert_true(fabs((double)s->lights.pick_pdf[i] - (0.5 * (i + 1) / 15.0 + 0.5 / 5.0)) < 1e-6);
        assert_true(s->lights.active_cdf[i] - before == s->lights.pick_pdf[i]);
        before = s->lights.active_cdf[i];
    }
    assert_true(before == 1.0f);
    assert_true(s->lights.pick_pdf[5] == 0.0f);
    struct lum_light_desc sun = light_desc(&lum_light_kind_directional);
    double intensity = 0.0;
    assert_int_equal(lum_light_from_flux(&sun, 1.0, &intensity, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "flux_lm");
    struct lum_light_desc spark = light_desc(&lum_light_kind_sphere);
    spark.radius_m = 1e-9; /* 1 lm from here is 2.5e16 cd/m2 */
    assert_int_equal(lum_light_from_flux(&spark, 1.0, &intensity, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "flux_lm");
    lum_snapshot_unref(s);
}

int main(void)
{
#define TEST(function) cmocka_unit_test_setup_teardown(function, fixture_setup, fixture_teardown)
    const struct CMUnitTest tests[] = {
        TEST(media_reach_the_snapshot),
        TEST(bad_media_are_refused),
        TEST(too_many_media_are_not_published),
        TEST(lengths_and_powers_are_in_scene_units),
        TEST(emissive_objects_are_lights),
        TEST(emitters_shine_where_they_are),
        TEST(no_power_overflows),
        TEST(lights_are_picked_half_by_flux),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
