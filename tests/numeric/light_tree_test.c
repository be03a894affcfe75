/* One of many lights is picked for a place: what is picked and what its probability is said to be agree, no light that
 * reaches a place is left out, and picks are spent where light comes from. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/light/sample.h"
#include "core/light/tree.h"
#include "tests/support/scene_fixture.h"

enum { LAMPS = 90, PLACES = 60 };

static void place_lamp(struct lum_light_desc *l, struct random_stream *r)
{
    l->position = (struct lum_vec3d){4.0 * random_double(r) - 2.0, 4.0 * random_double(r) - 2.0, random_double(r)};
    struct lum_vec3 d = random_direction(r);
    l->direction = (struct lum_vec3d){(double)d.x, (double)d.y, (double)d.z};
}

/* Lamps of all kinds that are somewhere, fluxes a hundred thousand apart, some off; shining objects; a sun. */
static const struct lum_snapshot *light_up(struct fixture *f)
{
    static const struct lum_light_kind_row *const kinds[] = {&lum_light_kind_point, &lum_light_kind_spot,
                                                             &lum_light_kind_quad, &lum_light_kind_disc,
                                                             &lum_light_kind_sphere};
    static const char *shapes[] = {"box", "sphere", "quad"};
    struct random_stream r = {7};
    char id[16];
    for (uint32_t i = 0; i < LAMPS; i++) {
        struct lum_light_desc l = light_desc(kinds[i % LUM_ARRAY_LEN(kinds)]);
        place_lamp(&l, &r);
        CHECK_OK(lum_light_from_flux(&l, pow(10.0, 5.0 * random_double(&r)), &l.intensity, err));
        l.on = i % 9 != 0;
        snprintf(id, sizeof id, "l%02u", i);
        put_light(f->scene, id, &l);
    }
    put_emissive(f->scene, "glow", 500.0);
    for (uint32_t i = 0; i < LUM_ARRAY_LEN(shapes); i++) {
        put_shape(f->scene, shapes[i], shapes[i], 8, 8);
        snprintf(id, sizeof id, "glowing-%s", shapes[i]);
        put_object(f->scene, id, shapes[i], "glow",
                   scaled_at(0.2, 3.0 * random_double(&r) - 1.5, random_double(&r), 0.5));
    }
    struct lum_light_desc sun = light_desc(&lum_light_kind_directional);
    put_light(f->scene, "sun", &sun);
    return commit(f);
}

struct spot {
    struct lum_vec3 p, n;
};

/* Every third place faces nothing: it is of fog, or lets light through. */
static struct spot spot_at(const struct lum_snapshot *s, struct random_stream *r, uint32_t i)
{
    struct spot at = {
        .p = to_scene(s, 5.0 * random_double(r) - 2.5, 5.0 * random_double(r) - 2.5, 1.6 * random_double(r) - 0.3)};
    struct lum_vec3 n = random_direction(r);
    if (i % 3 != 0)
        at.n = n;
    return at;
}

/* Illuminance that one sample of a light says there is, nothing in between. */
static double sampled(const struct lum_snapshot *s, uint32_t light, const struct spot *at, struct lum_vec2 u)
{
    struct lum_light_sample ls;
    if (!lum_light_sample_at(s, light, at->p, u, &ls))
        return 0.0;
    float cos_at = lum_dot(at->n, at->n) > 0.0f ? lum_dot(ls.wi, at->n) : 1.0f;
    float per = ls.pdf_sa > 0.0f ? 1.0f / ls.pdf_sa : 1.0f;
    return (double)(lum_max(cos_at, 0.0f) * lum_luminance(ls.radiance) * per);
}

static double mean_of(const struct lum_snapshot *s, uint32_t light, const struct spot *at)
{
    enum { SIDE = 8 };
    double sum = 0.0;
    for (uint32_t k = 0; k < SIDE * SIDE; k++)
        sum += sampled(s, light, at,
                       (struct lum_vec2){((float)(k % SIDE) + 0.5f) / SIDE, ((float)(k / SIDE) + 0.5f) / SIDE});
    return sum / (SIDE * SIDE);
}

static void every_light_that_reaches_a_place_is_picked(void **state)
{
    const struct lum_snapshot *s = light_up(*state);
    struct random_stream r = {1};
    assert_true(s->lights.tree_share > 0.0f && s->lights.tree_share < 1.0f);
    uint32_t n_reaching = 0, n_spared = 0;
    for (uint32_t i = 0; i < PLACES; i++) {
        struct spot at = spot_at(s, &r, i);
        for (uint32_t light = 0; light < s->lights.n_lights; light++) {
            float blind = s->lights.pick_pdf[light], pdf = lum_lights_pick_pdf(&s->lights, at.p, at.n, light);
            bool from_tree = s->lights.tree->leaf_of[light] != LUM_NO_OBJECT;
            assert_true(from_tree || pdf == blind);
            float guided = from_tree ? pdf - LUM_LIGHT_BLIND_SHARE * blind : blind;
            double e = mean_of(s, light, &at);
            n_reaching += e > 0.0;
            n_spared += from_tree && blind > 0.0f && !(guided > 0.0f);
            if (blind > 0.0f && e > 1e-6 * (double)lum_luminance(s->lights.lights[light].power) && !(guided > 0.0f))
                fail_msg("place %u: light %s brings %g lx and is not looked for", i, s->lights.lights[light].id, e);
        }
    }
    assert_true(n_reaching > 1000 && n_spared > 500); /* or this shows nothing */
    lum_snapshot_unref(s);
}

/* Numbers u in even steps meet each light as often as its probability says, to a step for each interval of u that
 * belongs to it: one in the part of each lamp of the table, and its own. */
static void picks_are_as_probable_as_they_say(void **state)
{
    enum { STEPS = 1 << 18 };
    const struct lum_snapshot *s = light_up(*state);
    struct random_stream r = {2};
    static uint32_t count[256];
    for (uint32_t i = 0; i < 8; i++) {
        struct spot at = spot_at(s, &r, i);
        memset(count, 0, sizeof count);
        double none = 1.0;
        for (uint32_t k = 0; k < STEPS; k++) {
            float prob = 0.0f;
            uint32_t light = lum_lights_pick_from(&s->lights, at.p, at.n, ((float)k + 0.5f) / STEPS, &prob);
            if (light == LUM_NO_OBJECT)
                continue;
            float pdf = lum_lights_pick_pdf(&s->lights, at.p, at.n, light);
            assert_true(light < s->lights.n_lights && prob > 0.0f);
            assert_true(fabsf(prob - pdf) <= 1e-5f * pdf); /* the same factors, in another order */
            count[light]++;
            none -= 1.0 / STEPS;
        }
        double sum = 0.0;
        for (uint32_t light = 0; light < s->lights.n_lights; light++) {
            double pdf = (double)lum_lights_pick_pdf(&s->lights, at.p, at.n, light);
            sum += pdf;
            if (fabs(count[light] - pdf * STEPS) > s->lights.n_active + 1.0)
                fail_msg("place %u: light %s was picked %u times, not %g", i, s->lights.lights[light].id, count[light],
                         pdf * STEPS);
        }
        assert_true(fabs(sum + none - 1.0) < 1e-3);
    }
    lum_snapshot_unref(s);
}

/* What one pick says of the light of all lamps that are somewhere: mean square over the square of the mean, summed over
 * all picks. */
static double spread(const struct lum_snapshot *s, const struct spot *at, bool by_place)
{
    double sum = 0.0, square = 0.0;
    for (uint32_t light = 0; light < s->lights.n_lights; light++) {
        float pdf = by_place ? lum_lights_pick_pdf(&s->lights, at->p, at->n, light) : s->lights.pick_pdf[light];
        if (!(pdf > 0.0f) || s->lights.tree->leaf_of[light] == LUM_NO_OBJECT)
            continue;
        double e = mean_of(s, light, at);
        sum += e;
        square += e * e / (double)pdf;
    }
    return sum > 0.0 ? square / (sum * sum) : 1.0;
}

static void picks_go_where_light_comes_from(void **state)
{
    const struct lum_snapshot *s = light_up(*state);
    struct random_stream r = {3};
    double blind = 0.0, by_place = 0.0;
    for (uint32_t i = 0; i < PLACES; i++) {
        struct spot at = spot_at(s, &r, i);
        blind += spread(s, &at, false) / PLACES;
        by_place += spread(s, &at, true) / PLACES;
    }
    printf("variance of one pick, over the square of the mean: %.3g by flux, %.3g by place\n", blind - 1.0,
           by_place - 1.0);
    assert_true(by_place - 1.0 < 0.5 * (blind - 1.0));
    lum_snapshot_unref(s);
}

static void blacken(void *user, struct lum_light *light)
{
    if (strcmp(light->id, user) != 0)
        light->on = false;
}

/* A lamp that is dimmed or off moves nothing: the tree is as bright as its lamps are now. */
static void dark_lights_are_not_picked(void **state)
{
    const struct lum_snapshot *s = light_up(*state);
    struct random_stream r = {4};
    const struct lum_snapshot *relit = NULL;
    char id[] = "l01";
    CHECK_OK(lum_snapshot_relit(s, blacken, id, &relit, err));
    assert_true(relit->lights.n_active == 1 && relit->lights.tree_share == 0.0f);
    for (uint32_t i = 0; i < PLACES; i++) {
        struct spot at = spot_at(s, &r, i);
        float prob;
        uint32_t light = lum_lights_pick_from(&relit->lights, at.p, at.n, (float)random_double(&r), &prob);
        assert_string_equal(relit->lights.lights[light].id, "l01");
        assert_true(prob == 1.0f);
    }
    lum_snapshot_unref(relit);
    lum_snapshot_unref(s);
}

/* The mesh, its size and its light stay as they were: where it is does not. */
static void a_glowing_object_that_moved_is_looked_for_where_it_is(void **state)
{
    struct fixture *f = *state;
    const double places[2][3] = {{0.3, 0.4, 0.5}, {-0.9, 0.1, 0.6}};
    for (uint32_t k = 0; k < 2; k++) {
        const struct lum_snapshot *s = NULL;
        if (k == 0)
            lum_snapshot_unref(light_up(f));
        put_object(f->scene, "glowing-sphere", "sphere", "glow",
                   scaled_at(0.2, places[k][0], places[k][1], places[k][2]));
        s = commit(f);
        for (uint32_t light = 0; light < s->lights.n_lights; light++) {
            if (strcmp(s->lights.lights[light].id, "glowing-sphere") != 0)
                continue;
            uint32_t leaf = s->lights.tree->leaf_of[light], side = leaf % LUM_LIGHT_SIDES;
            const struct lum_light_node *node = &s->lights.tree->nodes[leaf / LUM_LIGHT_SIDES];
            struct lum_vec3 is = lum_v3(node->centre[0][side], node->centre[1][side], node->centre[2][side]);
            struct lum_vec3 at = to_scene(s, places[k][0], places[k][1], places[k][2]);
            assert_true(lum_length(lum_v3_sub(is, at)) < 1e-3f * sqrtf(node->radius2[side]));
        }
        lum_snapshot_unref(s);
    }
}

int main(void)
{
#define TEST(function) cmocka_unit_test_setup_teardown(function, fixture_setup, fixture_teardown)
    const struct CMUnitTest tests[] = {
        TEST(every_light_that_reaches_a_place_is_picked),
        TEST(picks_are_as_probable_as_they_say),
        TEST(picks_go_where_light_comes_from),
        TEST(dark_lights_are_not_picked),
        TEST(a_glowing_object_that_moved_is_looked_for_where_it_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
