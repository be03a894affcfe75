/* Which triangles of a mesh that shines are one lamp. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "server/importer/fixtures.h"

enum { MOST_BOXES = 5000 };
static float positions[MOST_BOXES * 12];
static uint32_t indices[MOST_BOXES * 6], fixture[MOST_BOXES * 2];
static uint32_t n_quads;

/* A square of its own four vertices, the triangles of which share a diagonal. */
static void quad(float x, float y, float z, float side)
{
    const float corners[12] = {x, y, z, x + side, y, z, x + side, y, z + side, x, y, z + side};
    memcpy(positions + 12 * (size_t)n_quads, corners, sizeof corners);
    const uint32_t order[6] = {0, 1, 2, 0, 2, 3};
    for (uint32_t k = 0; k < 6; k++)
        indices[6 * (size_t)n_quads + k] = 4 * n_quads + order[k];
    n_quads++;
}

static uint32_t find(uint32_t most)
{
    struct lum_fixture_query q = {positions, indices, 4 * n_quads, 2 * n_quads, most};
    uint32_t n = lum_fixtures_find(&q, fixture), next = 0;
    for (uint32_t t = 0; t < 2 * n_quads; t++) { /* all are numbered, in the order of their first triangles */
        assert_true(fixture[t] <= next);
        next += fixture[t] == next;
        assert_int_equal(fixture[t], fixture[t - t % 2]);
    }
    assert_int_equal(n, next);
    return n;
}

static void luminaires_of_a_ceiling_are_apart(void **state)
{
    (void)state;
    n_quads = 0;
    for (int i = 0; i < 32; i++)
        quad(2.4f * (float)(i % 8), 3, 1.8f * (float)(i / 8), 1.2f);
    assert_int_equal(find(256), 32);
    for (uint32_t i = 0; i < 32; i++)
        assert_int_equal(fixture[2 * i], i);
}

/* Vertices of their own at the same place, or as near as a float's rounding: one strip. */
static void what_touches_is_one(void **state)
{
    (void)state;
    n_quads = 0;
    for (int i = 0; i < 10; i++)
        quad(0.1f * (float)i * (1 + 0x1p-23f), 1, 0, 0.1f);
    quad(5, 1, 0, 0.1f);
    assert_int_equal(find(256), 2);
    assert_int_equal(fixture[20], 1);
}

/* The two faces of a panel; a bulb in its shade. */
static void what_lies_within_or_close_is_one(void **state)
{
    (void)state;
    n_quads = 0;
    quad(0, 1, 0, 0.6f);
    quad(5, 1, 0, 1);
    quad(0, 1.005f, 0, 0.6f);  /* 5 mm over 0.85 m */
    quad(5.4f, 1, 0.4f, 0.1f); /* within, without touching an edge */
    quad(0, 1.05f, 0, 0.6f);   /* 5 cm */
    assert_int_equal(find(256), 3);
    assert_int_equal(fixture[4], 0);
    assert_int_equal(fixture[6], 1);
    assert_int_equal(fixture[8], 2);
}

static void a_chain_of_lights_is_grouped(void **state)
{
    (void)state;
    static const uint32_t numbers[] = {300, 2049, MOST_BOXES};
    for (size_t k = 0; k < 3; k++) {
        n_quads = 0;
        for (uint32_t i = 0; i < numbers[k]; i++)
            quad(0.02f * (float)i, 1, 0, 0.003f);
        uint32_t n = find(256);
        assert_true(n > 64 && n <= 256);
        for (uint32_t i = 1; i < numbers[k]; i++) /* along it */
            assert_true(fixture[2 * i] == fixture[2 * i - 2] || fixture[2 * i] == fixture[2 * i - 2] + 1);
        assert_int_equal(find(1), 1);
    }
}

static void points_without_extent_do_no_harm(void **state)
{
    (void)state;
    n_quads = 0;
    quad(1e30f, 1e30f, -1e30f, 0);
    assert_int_equal(find(256), 1);
    quad(-1e30f, 1, 1, 0);
    quad(3e38f, -3e38f, 3e38f, 0);
    assert_int_equal(find(256), 2); /* the third is so far off that the others are in one place */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(luminaires_of_a_ceiling_are_apart), cmocka_unit_test(what_touches_is_one),
        cmocka_unit_test(what_lies_within_or_close_is_one),  cmocka_unit_test(a_chain_of_lights_is_grouped),
        cmocka_unit_test(points_without_extent_do_no_harm),
    };
    return cmocka_run_group_tests_name("fixtures", tests, NULL, NULL);
}
