/* Points of a square among records: looked up all at once, and one by one. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <string.h>

#include "core/effect/indirect/tile_points.h"
#include "core/math/sampler.h"

enum { N_RECORDS = 300 };

static float uniform(uint32_t i)
{
    return (float)(lum_hash_u32(i) >> 8) * 0x1p-24f;
}

/* Records on a floor and a wall of a unit cube, of all sizes. */
static struct lum_store *make_store(void)
{
    struct lum_store *store = NULL;
    struct lum_error err;
    struct lum_store_config config = {.storage = LUM_STORAGE_WAITFREE,
                                      .hi = {1, 1, 1},
                                      .n_workers = 1,
                                      .record_bytes = sizeof(struct lum_cache_record),
                                      .capacity = N_RECORDS};
    assert_int_equal(lum_store_create(&config, &store, &err), LUM_OK);
    for (uint32_t i = 0; i < N_RECORDS; i++) {
        struct lum_cache_record *r = lum_store_new(store, 0);
        assert_non_null(r);
        float u = uniform(4 * i), v = uniform(4 * i + 1);
        r->p = i % 2 ? lum_v3(u, 0.0f, v) : lum_v3(0.0f, u, v);
        r->n = r->ng = i % 2 ? lum_v3(0, 1, 0) : lum_v3(1, 0, 0);
        r->radius = 0.01f + 0.2f * uniform(4 * i + 2) * uniform(4 * i + 3);
        r->irradiance = lum_rgb(u, v, 1.0f);
        r->gradient[0] = lum_rgb(1.0f, 0.0f, 0.3f);
        assert_true(lum_store_insert(store, 0, r));
    }
    return store;
}

/* Across the edge between both. */
static void fill_square(struct lum_tile_points *s)
{
    memset(s, 0, sizeof *s);
    s->n = LUM_TILE_PIXELS;
    for (uint32_t i = 0; i < s->n; i++) {
        float u = 0.02f * (float)(i % LUM_TILE_SIDE), v = 0.3f + 0.02f * (float)(i / LUM_TILE_SIDE);
        s->px[i] = i % 3 ? u : 0.0f;
        s->py[i] = i % 3 ? 0.0f : u;
        s->pz[i] = v;
        s->nx[i] = i % 3 ? 0.0f : 1.0f;
        s->ny[i] = i % 3 ? 1.0f : 0.0f;
        s->slot[i] = (uint8_t)i;
    }
}

/* What a point gets does not depend on which other records were found with those that serve it. */
static void one_by_one_is_the_same(void **state)
{
    (void)state;
    struct lum_store *store = make_store();
    struct lum_weighting w = lum_weighting_of(0.2f);
    struct lum_lookup l = {
        .store = store, .metric = LUM_METRIC_TENTS, .weighting = w, .least_dot = 0.5f, .pixel = 1.0f};
    struct lum_cache_record *found[LUM_TILE_RECORDS];
    struct lum_candidates c = {0, found};
    struct lum_tile_points all, alone;
    struct lum_rgb e[LUM_TILE_PIXELS], e_alone[LUM_TILE_PIXELS];
    struct lum_pixel_mask unserved, unserved_alone;
    memset(&unserved, 0xff, sizeof unserved);
    memset(&unserved_alone, 0xff, sizeof unserved_alone);
    fill_square(&all);
    fill_square(&alone);
    assert_true(lum_tile_points_find(&l, &all, &c));
    assert_true(c.n > 20 && c.n < N_RECORDS);
    lum_tile_points_interpolate(&l, &c, &all, e);
    lum_tile_points_interpolate(&l, NULL, &alone, e_alone);
    assert_memory_equal(e, e_alone, sizeof e);
    lum_tile_points_serve(&l, &c, &all, &unserved, NULL);
    lum_tile_points_serve(&l, NULL, &alone, &unserved_alone, NULL);
    assert_memory_equal(&unserved, &unserved_alone, sizeof unserved);
    uint32_t n_lit = 0;
    for (uint32_t i = 0; i < LUM_TILE_PIXELS; i++) {
        /* all records have some blue; one counts further out than it serves */
        assert_true(e[i].b > 0.0f || lum_pixel_mask_has(&unserved, i));
        n_lit += e[i].b > 0.0f;
    }
    assert_true(n_lit > 0 && n_lit < LUM_TILE_PIXELS);
    lum_store_destroy(store);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(one_by_one_is_the_same)};
    return cmocka_run_group_tests_name("unit.square", tests, NULL, NULL);
}
