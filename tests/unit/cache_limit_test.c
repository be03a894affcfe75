/* A limit for the records of all caches together: who gives way, and that every picture is what it would be without. */
#include "core/cache/slab.h"
#include "core/pass/pass.h"
#include "tests/support/effort.h"
#include "tests/support/rig.h"

/* ---- one store ---- */

#define RECORD_BYTES (sizeof(struct lum_cache_record))
#define CHUNK_BYTES (sizeof(struct lum_slab_chunk) + LUM_SLAB_CHUNK * RECORD_BYTES)

static uint32_t n_that_fit(size_t limit)
{
    struct lum_budget budget = {.limit = limit};
    struct lum_store_config config = {.storage = LUM_STORAGE_WAITFREE,
                                      .hi = {1, 1, 1},
                                      .n_workers = 1,
                                      .record_bytes = RECORD_BYTES,
                                      .capacity = 1000,
                                      .budget = &budget};
    struct lum_store *store;
    RIG_OK(lum_store_create(&config, &store, &err));
    uint32_t n = 0;
    while (lum_store_new(store, 0))
        n++;
    assert_true(budget.used <= limit);
    assert_int_equal(budget.refused, n < config.capacity);
    lum_store_destroy(store);
    assert_int_equal(budget.used, 0);
    return n;
}

static void a_store_keeps_to_its_budget(void **state)
{
    (void)state;
    assert_int_equal(n_that_fit(0), 0);
    assert_int_equal(n_that_fit(3 * CHUNK_BYTES - 1), 2 * LUM_SLAB_CHUNK);
    assert_int_equal(n_that_fit(3 * CHUNK_BYTES), 3 * LUM_SLAB_CHUNK);
    assert_int_equal(n_that_fit(3 * CHUNK_BYTES + 1), 3 * LUM_SLAB_CHUNK);
    assert_int_equal(n_that_fit(SIZE_MAX), 1000);
}

/* ---- views ---- */

#define N_VIEWS 3u

/* Three views of a room, each with a cache of its own: their virtual point lights differ. */
struct house {
    struct rig rig; /* its view is the first */
    struct lum_view *views[N_VIEWS];
    struct lum_caches *caches;
};

static void begin(struct house *h, const char *method, size_t limit)
{
    struct rig *r = &h->rig;
    rig_begin(r, 2);
    rig_room(r);
    struct lum_light_desc lamp = rig_point(rig_v(0.5, 2.5, 0), 100.0);
    rig_light(r, "lamp", &lamp);
    rig_commit(r);
    r->settings.method = lum_method_find(method);
    r->settings.n_vpls = 64;
    r->settings.max_spp = 1;
    RIG_OK(lum_caches_create(2, &h->caches, &err));
    lum_caches_set_limit(h->caches, limit);
    h->views[0] = r->view;
    for (uint32_t i = 1; i < N_VIEWS; i++)
        RIG_OK(lum_view_create(r->pool, &h->views[i], &err));
    for (uint32_t i = 0; i < N_VIEWS; i++)
        lum_view_share(h->views[i], h->caches);
}

static void end(struct house *h)
{
    for (uint32_t i = 0; i < N_VIEWS; i++)
        lum_view_destroy(h->views[i]);
    h->rig.view = NULL;
    lum_caches_destroy(h->caches);
    rig_end(&h->rig);
}

static size_t used(const struct house *h)
{
    struct lum_caches_size size;
    lum_caches_measure(h->caches, &size);
    return size.record_bytes;
}

/* The frame of a view, with the seed; free with lum_free. */
static struct lum_rgb *frame(struct house *h, uint32_t view, uint32_t seed)
{
    h->rig.view = h->views[view];
    h->rig.settings.seed = seed;
    rig_pass(&h->rig);
    return rig_picture(&h->rig);
}

static void assert_frame(struct house *h, uint32_t view, uint32_t seed, const struct lum_rgb *expected,
                         const char *what)
{
    struct lum_rgb *got = frame(h, view, seed);
    rig_assert_picture(&h->rig, expected, what);
    lum_free(got);
}

/* What one picture takes, and all three of them; the pictures. */
static size_t measure(const char *method, struct lum_rgb *ret_pictures[N_VIEWS], size_t *ret_all)
{
    struct house h;
    size_t most = 0, before = 0;
    begin(&h, method, SIZE_MAX);
    for (uint32_t i = 0; i < N_VIEWS; i++) {
        ret_pictures[i] = frame(&h, i, i + 1);
        size_t now = used(&h);
        most = now - before > most ? now - before : most;
        before = now;
    }
    *ret_all = before;
    end(&h);
    return most;
}

static void every_picture_is_complete(void **state)
{
    (void)state;
    static const char *const methods[] = {"live", "irrcache", "tic", "ic"};
    for (size_t m = 0; m < 1 + TEST_EFFORT(LUM_ARRAY_LEN(methods) - 1); m++) {
        struct lum_rgb *pictures[N_VIEWS];
        size_t all, one = measure(methods[m], pictures, &all);
        const size_t limits[] = {one, all - 1, all, all + 1};
        for (size_t l = 0; l < LUM_ARRAY_LEN(limits); l++) {
            struct house h;
            char what[96];
            begin(&h, methods[m], limits[l]);
            for (uint32_t turn = 0; turn < 2 * N_VIEWS; turn++) {
                uint32_t view = turn % N_VIEWS;
                snprintf(what, sizeof what, "%s, limit %zu, view %u, turn %u", methods[m], limits[l], view, turn);
                if (turn >= N_VIEWS) /* or what it has is shown as it is */
                    lum_view_forget(h.views[view]);
                assert_frame(&h, view, view + 1, pictures[view], what);
                assert_true(used(&h) <= limits[l]);
            }
            if (limits[l] >= all)
                assert_int_equal(used(&h), all); /* nobody gave way */
            end(&h);
        }
        for (uint32_t i = 0; i < N_VIEWS; i++)
            lum_free(pictures[i]);
    }
}

/* Caches that no view holds go first: those of others last. */
static void idle_caches_give_way_first(void **state)
{
    (void)state;
    struct lum_rgb *pictures[N_VIEWS];
    size_t all, one = measure("live", pictures, &all);
    struct house h;
    begin(&h, "live", 2 * one);
    lum_free(frame(&h, 0, 1));
    lum_free(frame(&h, 1, 2));
    lum_free(frame(&h, 1, 1)); /* that of seed 2 is nobody's now */
    struct lum_rgb *third = frame(&h, 2, 3);
    rig_assert_picture(&h.rig, pictures[2], "third");
    lum_free(third);
    lum_view_forget(h.views[0]);
    h.rig.view = h.views[0];
    h.rig.settings.seed = 1;
    assert_int_equal(rig_pass(&h.rig).cache.created, 0); /* its records are there */
    end(&h);
    for (uint32_t i = 0; i < N_VIEWS; i++)
        lum_free(pictures[i]);
}

/* Less than one picture needs is refused, and said; with more it goes on. */
static void less_than_one_picture_is_refused(void **state)
{
    (void)state;
    struct lum_rgb *pictures[N_VIEWS];
    size_t all, one = measure("live", pictures, &all);
    struct house h;
    struct lum_pass_stats unused;
    struct lum_error err = {0};
    begin(&h, "live", one / 2);
    h.rig.settings.seed = 1;
    assert_int_equal(lum_view_pass(h.views[0], h.rig.snapshot, &h.rig.settings, NULL, &unused, &err), LUM_ERR_LIMIT);
    assert_true(strlen(err.text) > 0 && used(&h) <= one / 2);
    lum_caches_set_limit(h.caches, one);
    assert_frame(&h, 0, 1, pictures[0], "with room");
    end(&h);
    for (uint32_t i = 0; i < N_VIEWS; i++)
        lum_free(pictures[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_store_keeps_to_its_budget),
        cmocka_unit_test(every_picture_is_complete),
        cmocka_unit_test(idle_caches_give_way_first),
        cmocka_unit_test(less_than_one_picture_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
