/* The store of records: every storage against a plain list that is searched by brute force. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "core/cache/store.h"
#include "core/math/sampler.h"

enum { N_MODEL = 3000, N_FOUND = 4096, WORKERS = 3 };

/* What a record of the tests carries beside it. */
struct note {
    struct lum_cache_record base;
    uint64_t value;
};

struct model {
    struct lum_store *store;
    struct lum_cache_record *records[N_MODEL]; /* NULL: not there */
    uint32_t n;
    uint32_t seed, dimension;
};

static struct lum_cache_record *found[N_FOUND];

static uint32_t bits(struct model *m)
{
    return lum_hash_combine(m->seed, m->dimension++);
}

static float uniform(struct model *m, float lo, float hi)
{
    return lo + (hi - lo) * (float)(bits(m) >> 8) * 0x1p-24f;
}

static struct lum_store *store_new(enum lum_storage storage, uint32_t capacity)
{
    const struct lum_store_config config = {
        .storage = storage,
        .lo = {-1.0f, -0.5f, -1.0f},
        .hi = {1.0f, 0.75f, 1.0f},
        .n_workers = WORKERS,
        .record_bytes = sizeof(struct note),
        .capacity = capacity,
    };
    struct lum_store *store = NULL;
    struct lum_error err = {0};
    if (lum_store_create(&config, &store, &err) != LUM_OK)
        fail_msg("lum_store_create: %s", err.text);
    return store;
}

/* Anywhere in the box; on borders of cells; outside of the box, near and far. */
static struct lum_vec3 any_point(struct model *m)
{
    struct lum_vec3 p = {uniform(m, -1.0f, 1.0f), uniform(m, -0.5f, 0.75f), uniform(m, -1.0f, 1.0f)};
    switch (bits(m) % 8) {
    case 0:
        return lum_v3(floorf(p.x * 16.0f) / 16.0f, floorf(p.y * 4.0f) / 4.0f, floorf(p.z * 64.0f) / 64.0f);
    case 1:
        return lum_v3_mul(p, 3.0f);
    case 2:
        return lum_v3_mul(p, bits(m) % 16 ? 1.0f : 1000.0f);
    default:
        return p;
    }
}

static float any_radius(struct model *m)
{
    static const float special[] = {1e-7f, 0x1p-9f, 0.25f, 0.5f, 1.0f, 2.0f, 2.5f, 4.0f, 1e4f};
    if (bits(m) % 64 == 0)
        return special[bits(m) % LUM_ARRAY_LEN(special)];
    if (bits(m) % 4 == 0) /* the largest for the cells that it lies in, or nearly so: where the margins count */
        return ldexpf(1.0f - (bits(m) & 1u ? 0x1p-20f : 0x1p-19f), -3 - (int)(bits(m) % 7));
    return 0.002f * exp2f(uniform(m, 0.0f, 6.0f));
}

static struct lum_cache_record *add(struct model *m, uint32_t worker, struct lum_vec3 p, float radius)
{
    struct lum_cache_record *r = lum_store_new(m->store, worker);
    assert_non_null(r);
    assert_true(r->radius == 0.0f && r->epoch == 0 && r->born == 0);
    r->p = p;
    r->n = lum_v3(0.0f, 1.0f, 0.0f);
    r->radius = radius;
    ((struct note *)r)->value = ~(uint64_t)r->index;
    assert_true(lum_store_insert(m->store, worker, r));
    if (m->n < N_MODEL)
        m->records[m->n++] = r;
    return r;
}

/* The same operations on floats as store.h's "nearer than its radius" needs: what a search returns must agree bit for
 * bit. */
static bool meets(const struct lum_cache_record *r, struct lum_vec3 lo, struct lum_vec3 hi)
{
    float dx = lum_max(lum_max(lo.x - r->p.x, r->p.x - hi.x), 0.0f);
    float dy = lum_max(lum_max(lo.y - r->p.y, r->p.y - hi.y), 0.0f);
    float dz = lum_max(lum_max(lo.z - r->p.z, r->p.z - hi.z), 0.0f);
    return dx * dx + dy * dy + dz * dz < r->radius * r->radius;
}

static void check_found(const struct model *m, uint32_t n, struct lum_vec3 lo, struct lum_vec3 hi)
{
    static bool seen[N_MODEL];
    memset(seen, 0, sizeof seen);
    for (uint32_t i = 0; i < n; i++) {
        assert_true(((struct note *)found[i])->value == ~(uint64_t)found[i]->index);
        assert_true(found[i]->index < N_MODEL);
        assert_false(seen[found[i]->index]);
        seen[found[i]->index] = true;
    }
    uint32_t expected = 0;
    for (uint32_t i = 0; i < m->n; i++)
        if (m->records[i] && meets(m->records[i], lo, hi)) {
            expected++;
            if (!seen[m->records[i]->index])
                fail_msg("seed %u: record %u at (%a %a %a) radius %a is not found from (%a %a %a) .. (%a %a %a)",
                         m->seed, m->records[i]->index, (double)m->records[i]->p.x, (double)m->records[i]->p.y,
                         (double)m->records[i]->p.z, (double)m->records[i]->radius, (double)lo.x, (double)lo.y,
                         (double)lo.z, (double)hi.x, (double)hi.y, (double)hi.z);
        }
    assert_int_equal(n, expected);
}

/* Just within and just beyond the reach of a record, along an axis: where the roundings of the descent would show. */
static struct lum_vec3 at_the_rim(struct model *m, const struct lum_cache_record *r)
{
    float reach = r->radius, sign = bits(m) & 1u ? 1.0f : -1.0f;
    for (uint32_t i = bits(m) % 4; i > 0; i--)
        reach = nextafterf(reach, bits(m) & 1u ? 0.0f : INFINITY);
    struct lum_vec3 p = r->p;
    float *axis[] = {&p.x, &p.y, &p.z};
    *axis[bits(m) % 3] += sign * reach;
    return p;
}

static void check_queries(struct model *m, uint32_t worker, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        struct lum_vec3 p = any_point(m);
        const struct lum_cache_record *r = m->n ? m->records[bits(m) % m->n] : NULL;
        if (r && i % 2)
            p = at_the_rim(m, r);
        check_found(m, lum_store_find(m->store, worker, p, found, N_FOUND), p, p);
        float size = uniform(m, 0.0f, bits(m) % 8 ? 0.1f : 3.0f);
        struct lum_vec3 hi = {p.x + size, p.y + size * uniform(m, 0.0f, 1.0f), p.z + size};
        check_found(m, lum_store_overlap(m->store, worker, p, hi, found, N_FOUND), p, hi);
    }
}

static void end_frame(struct model *m)
{
    struct lum_error err = {0};
    if (lum_store_end_frame(m->store, &err) != LUM_OK)
        fail_msg("lum_store_end_frame: %s", err.text);
}

static uint32_t alive(const struct model *m)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < m->n; i++)
        n += m->records[i] != NULL;
    return n;
}

static void each_storage_finds_what_a_list_finds(void **state)
{
    (void)state;
    static struct model m;
    for (int storage = 0; storage < LUM_STORAGE_COUNT; storage++) {
        m = (struct model){.store = store_new((enum lum_storage)storage, N_MODEL), .seed = 7u + (uint32_t)storage};
        check_queries(&m, 0, 10);
        for (uint32_t turn = 0; turn < 6; turn++) {
            for (uint32_t i = 0; i < 400; i++)
                add(&m, 0, any_point(&m), any_radius(&m));
            check_queries(&m, 0, 600);
            for (uint32_t i = 0; i < 150; i++) {
                uint32_t k = bits(&m) % m.n;
                if (m.records[k])
                    assert_true(lum_store_remove(m.store, 0, m.records[k]));
                m.records[k] = NULL;
            }
            check_queries(&m, 0, 50);
            end_frame(&m);
            check_queries(&m, 0, 50);
            assert_int_equal(lum_store_count(m.store), alive(&m));
        }
        lum_store_clear(m.store);
        m.n = 0;
        assert_int_equal(lum_store_count(m.store), 0);
        check_queries(&m, 0, 20);
        add(&m, 0, lum_v3(0.0f, 0.0f, 0.0f), 0.1f);
        check_queries(&m, 0, 20);
        lum_store_destroy(m.store);
    }
}

static void going_over_all_is_in_order(void **state)
{
    (void)state;
    static struct model m;
    m = (struct model){.store = store_new(LUM_STORAGE_WAITFREE, N_MODEL), .seed = 3};
    for (uint32_t i = 0; i < 300; i++)
        add(&m, i % WORKERS, any_point(&m), any_radius(&m));
    struct lum_cache_record *alone = lum_store_new(m.store, 0); /* not inserted: not there */
    uint32_t n = 0;
    for (uint32_t i = 0; i < lum_store_limit(m.store); i++) {
        struct lum_cache_record *r = lum_store_at(m.store, i);
        assert_true(!r || (r->index == i && r != alone));
        n += r != NULL;
    }
    assert_int_equal(n, 300);
    assert_true(lum_store_limit(m.store) <= N_MODEL);
    assert_null(lum_store_at(m.store, N_MODEL));
    assert_null(lum_store_at(m.store, UINT32_MAX));
    lum_store_drop(m.store, 0, alone);
    assert_int_equal(lum_store_count(m.store), 300);
    lum_store_destroy(m.store);
}

/* Two stores that get the same calls hand out the same indices, also after records were removed; and no index twice. */
static void indices_depend_on_the_calls_alone(void **state)
{
    (void)state;
    static struct model m[2];
    for (int k = 0; k < 2; k++)
        m[k] = (struct model){.store = store_new(LUM_STORAGE_WAITFREE, 2000), .seed = 11};
    for (uint32_t turn = 0; turn < 40; turn++) {
        for (int k = 0; k < 2; k++)
            for (uint32_t i = 0; i < 70; i++) {
                add(&m[k], 0, any_point(&m[k]), 0.01f);
                lum_store_drop(m[k].store, 0, lum_store_new(m[k].store, 0));
            }
        for (int k = 0; k < 2; k++) {
            for (uint32_t i = 0; i < 40; i++) {
                uint32_t victim = bits(&m[k]) % m[k].n;
                if (m[k].records[victim])
                    lum_store_remove(m[k].store, 0, m[k].records[victim]);
                m[k].records[victim] = NULL;
            }
            end_frame(&m[k]);
        }
        for (uint32_t i = 0; i < m[0].n; i++) {
            assert_int_equal(m[0].records[i] == NULL, m[1].records[i] == NULL);
            if (m[0].records[i])
                assert_int_equal(m[0].records[i]->index, m[1].records[i]->index);
        }
    }
    for (int k = 0; k < 2; k++)
        lum_store_destroy(m[k].store);
}

static void removed_twice_is_removed_once(void **state)
{
    (void)state;
    static struct model m;
    for (int storage = 0; storage < LUM_STORAGE_COUNT; storage++) {
        m = (struct model){.store = store_new((enum lum_storage)storage, 100)};
        struct lum_cache_record *r = add(&m, 0, lum_v3(0.0f, 0.0f, 0.0f), 0.5f);
        assert_int_equal(lum_store_find(m.store, 0, r->p, found, 8), 1);
        assert_true(lum_store_remove(m.store, 0, r));
        assert_false(lum_store_remove(m.store, 0, r));
        assert_int_equal(lum_store_find(m.store, 0, r->p, found, 8), 0);
        assert_true(r->radius == 0.5f); /* who found it before may still read it */
        struct lum_cache_record *other = add(&m, 0, lum_v3(0.0f, 0.0f, 0.0f), 0.5f);
        assert_ptr_not_equal(other, r);
        end_frame(&m);
        assert_int_equal(lum_store_count(m.store), 1);
        struct lum_store_stats stats;
        lum_store_stats(m.store, &stats);
        assert_int_equal(stats.inserted, 2);
        assert_int_equal(stats.removed, 1);
        lum_store_destroy(m.store);
    }
}

/* local: a worker sees its own records and the common ones; the end of the frame makes all common. */
static void local_shares_at_the_end_of_the_frame(void **state)
{
    (void)state;
    static struct model m;
    m = (struct model){.store = store_new(LUM_STORAGE_LOCAL, N_MODEL), .seed = 5};
    const struct lum_vec3 p = {0.1f, 0.2f, 0.3f};
    for (uint32_t w = 0; w < WORKERS; w++)
        for (uint32_t i = 0; i <= w; i++)
            add(&m, w, p, 0.01f);
    for (uint32_t w = 0; w < WORKERS; w++)
        assert_int_equal(lum_store_find(m.store, w, p, found, N_FOUND), w + 1);
    lum_store_remove(m.store, 0, m.records[0]);
    m.records[0] = NULL;
    end_frame(&m);
    for (uint32_t w = 0; w < WORKERS; w++)
        check_found(&m, lum_store_find(m.store, w, p, found, N_FOUND), p, p);
    assert_int_equal(lum_store_count(m.store), 5);
    lum_store_destroy(m.store);
}

/* A full store refuses, whoever asks; what is removed can be had again after the end of the frame, what is dropped at
 * once. */
static void capacity_is_met_exactly(void **state)
{
    (void)state;
    static const uint32_t capacities[] = {1, 63, 64, 65, 130, 1000};
    static struct model m;
    for (size_t c = 0; c < LUM_ARRAY_LEN(capacities); c++) {
        m = (struct model){.store = store_new(LUM_STORAGE_WAITFREE, capacities[c]), .seed = 1};
        for (uint32_t turn = 0; turn < 3; turn++) {
            for (uint32_t i = alive(&m); i < capacities[c]; i++)
                add(&m, i % WORKERS, any_point(&m), 0.1f);
            for (uint32_t w = 0; w < WORKERS; w++)
                assert_null(lum_store_new(m.store, w));
            assert_int_equal(lum_store_count(m.store), capacities[c]);
            assert_int_equal(lum_store_limit(m.store), capacities[c]);
            struct lum_cache_record **last = &m.records[m.n - 1];
            lum_store_remove(m.store, 1, *last);
            *last = NULL;
            assert_null(lum_store_new(m.store, 0));
            end_frame(&m);
            struct lum_cache_record *r = lum_store_new(m.store, 2);
            assert_non_null(r);
            assert_null(lum_store_new(m.store, 1));
            lum_store_drop(m.store, 2, r);
            r = lum_store_new(m.store, 1);
            assert_non_null(r);
            lum_store_drop(m.store, 1, r);
        }
        lum_store_destroy(m.store);
    }
}

static void what_has_no_room_is_counted(void **state)
{
    (void)state;
    static struct model m;
    m = (struct model){.store = store_new(LUM_STORAGE_SERIAL, 100)};
    for (uint32_t i = 0; i < 50; i++)
        add(&m, 0, lum_v3(0.0f, 0.0f, 0.0f), 0.5f);
    assert_int_equal(lum_store_find(m.store, 0, lum_v3(0.0f, 0.0f, 0.0f), found, 20), 20);
    assert_int_equal(lum_store_find(m.store, 0, lum_v3(0.0f, 0.0f, 0.0f), NULL, 0), 0);
    struct lum_store_stats stats;
    lum_store_stats(m.store, &stats);
    assert_int_equal(stats.overflowed, 30 + 50);
    assert_true(stats.bytes > 50 * sizeof(struct note));
    lum_store_destroy(m.store);
}

/* Records that wander through the scene leave empty nodes behind: memory stays within what the live ones and
 * BUILD_SLACK removals need. 256 bytes a node and at most 16 nodes for a record, twice while the tree is built anew. */
static void wandering_records_do_not_pile_up(void **state)
{
    (void)state;
    static struct model m;
    for (int storage = LUM_STORAGE_LOCAL; storage <= LUM_STORAGE_WAITFREE; storage++) {
        m = (struct model){.store = store_new((enum lum_storage)storage, N_MODEL), .seed = 23};
        size_t bytes[2] = {0};
        for (uint32_t turn = 0; turn < 400; turn++) {
            m.n = 0;
            for (uint32_t i = 0; i < 100; i++)
                add(&m, i % WORKERS, any_point(&m), 0x1p-14f);
            end_frame(&m);
            if (turn % 100 == 99)
                check_queries(&m, 1, 20);
            for (uint32_t i = 0; i < m.n; i++)
                lum_store_remove(m.store, i % WORKERS, m.records[i]);
            end_frame(&m);
            struct lum_store_stats stats;
            lum_store_stats(m.store, &stats);
            bytes[turn >= 200] = stats.bytes;
        }
        assert_true(bytes[1] <= bytes[0] + 2 * (4096 + 200) * 16 * 256);
        assert_true(bytes[1] < 48u << 20); /* 40 000 records with 12 nodes each would be 120 MB */
        lum_store_destroy(m.store);
    }
}

/* Allocation k fails, for every k that is reached: nothing is lost, nothing leaks, and it works again afterwards. */
static void short_memory_does_no_harm(void **state)
{
    (void)state;
    static struct model m;
    for (int storage = 0; storage < LUM_STORAGE_COUNT; storage++)
        for (uint64_t k = 1;; k++) {
            const struct lum_store_config config = {.storage = (enum lum_storage)storage,
                                                    .hi = {1.0f, 1.0f, 1.0f},
                                                    .n_workers = 2,
                                                    .record_bytes = sizeof(struct note),
                                                    .capacity = N_MODEL};
            m = (struct model){.seed = 31};
            uint32_t failures = 0;
            lum_alloc_fail_after(k);
            if (lum_store_create(&config, &m.store, NULL) != LUM_OK) {
                assert_null(m.store);
                lum_alloc_fail_after(0);
                continue;
            }
            for (uint32_t i = 0; i < 600; i++) {
                struct lum_cache_record *r = lum_store_new(m.store, 0);
                failures += r == NULL;
                if (!r)
                    continue;
                r->p = any_point(&m);
                r->radius = any_radius(&m);
                ((struct note *)r)->value = ~(uint64_t)r->index;
                if (lum_store_insert(m.store, 0, r)) {
                    m.records[m.n++] = r;
                } else {
                    failures++;
                    lum_store_drop(m.store, 0, r);
                }
                if (i % 200 == 150)
                    failures += lum_store_end_frame(m.store, NULL) != LUM_OK;
            }
            bool reached = failures > 0;
            lum_alloc_fail_after(0);
            check_queries(&m, 0, 10);
            end_frame(&m);
            check_queries(&m, 1, 10);
            assert_int_equal(lum_store_count(m.store), m.n);
            assert_true(m.n + failures >= 600 && failures <= 1);
            lum_store_destroy(m.store);
            if (!reached)
                break;
        }
}

static void wrong_configurations_are_refused(void **state)
{
    (void)state;
    const struct lum_store_config good = {
        .hi = {1.0f, 1.0f, 1.0f}, .n_workers = 1, .record_bytes = sizeof(struct lum_cache_record), .capacity = 1};
    struct {
        const char *field;
        struct lum_store_config config;
    } wrong[] = {
        {"storage", good},  {"box", good},      {"box", good},          {"n_workers", good},    {"n_workers", good},
        {"capacity", good}, {"capacity", good}, {"record_bytes", good}, {"record_bytes", good},
    };
    wrong[0].config.storage = LUM_STORAGE_COUNT;
    wrong[1].config.lo.y = 2.0f;
    wrong[2].config.hi.z = NAN;
    wrong[3].config.n_workers = 0;
    wrong[4].config.n_workers = LUM_STORE_WORKERS_MAX + 1;
    wrong[5].config.capacity = 0;
    wrong[6].config.capacity = LUM_STORE_MAX + 1;
    wrong[7].config.record_bytes = sizeof(struct lum_cache_record) - 8;
    wrong[8].config.record_bytes = sizeof(struct lum_cache_record) + 4;
    for (size_t i = 0; i < LUM_ARRAY_LEN(wrong); i++) {
        struct lum_store *store = NULL;
        struct lum_error err = {0};
        assert_int_equal(lum_store_create(&wrong[i].config, &store, &err), LUM_ERR_INVALID);
        assert_string_equal(err.field, wrong[i].field);
        assert_null(store);
    }
    struct lum_store *store = NULL;
    assert_int_equal(lum_store_create(&good, &store, NULL), LUM_OK);
    lum_store_destroy(store);
    lum_store_destroy(NULL);
    enum lum_storage storage;
    assert_true(lum_storage_find("local", &storage) && storage == LUM_STORAGE_LOCAL);
    assert_false(lum_storage_find("locally", &storage));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_storage_finds_what_a_list_finds),
        cmocka_unit_test(going_over_all_is_in_order),
        cmocka_unit_test(indices_depend_on_the_calls_alone),
        cmocka_unit_test(removed_twice_is_removed_once),
        cmocka_unit_test(local_shares_at_the_end_of_the_frame),
        cmocka_unit_test(capacity_is_met_exactly),
        cmocka_unit_test(what_has_no_room_is_counted),
        cmocka_unit_test(wandering_records_do_not_pile_up),
        cmocka_unit_test(short_memory_does_no_harm),
        cmocka_unit_test(wrong_configurations_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
