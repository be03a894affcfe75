/* Records that are gone are made again: a view that was told that all of its records are there is told when they are
 * not. */
#include "core/cache/cache.h"
#include "core/cache/kind.h"
#include "core/cache/weight.h"
#include "core/effect/indirect/records.h"
#include "tests/support/house.h"

/* ---- a kind that cancels the pass when it has made so many records ---- */

static _Atomic bool stop;
static _Atomic uint32_t n_built, stop_after;

static void build(const struct lum_cache_job *job)
{
    for (uint32_t i = 0; i < job->n; i++) {
        job->records[i]->radius = 1e-3f; /* serves its own pixel alone */
        job->records[i]->irradiance = lum_grey(1.0f);
        if (atomic_fetch_add(&n_built, 1) + 1 == atomic_load(&stop_after))
            atomic_store(&stop, true);
    }
}

static size_t record_bytes(uint32_t n_vpls)
{
    (void)n_vpls;
    return sizeof(struct lum_cache_record);
}

static const struct lum_cache_kind stopping = {
    .name = "stopping", .metric = LUM_METRIC_TENTS, .record_bytes = record_bytes, .build = build};
static const struct lum_method free_method = {
    .name = "free", .cache = &stopping, .serves = {[LUM_EFFECT_INDIRECT_DIFFUSE] = &lum_estimator_cached_free}};

/* ---- */

/* The view shows what a new one on new caches does. */
static void expect_whole_picture(struct house *h, const char *what)
{
    struct rig *r = &h->rig;
    struct lum_view *first = r->view;
    struct lum_rgb *got = rig_picture(r);
    r->view = NULL;
    RIG_OK(lum_view_create(r->pool, &r->view, &err));
    rig_pass(r);
    double lost = 0.0, sum = 0.0;
    const struct lum_film *f = lum_view_film(r->view);
    for (uint32_t i = 0; i < f->w * f->h; i++) {
        double want = (double)lum_luminance(lum_film_mean(f, i % f->w, i / f->w));
        lost += fabs(want - (double)lum_luminance(got[i]));
        sum += want;
    }
    lum_free(got);
    lum_view_destroy(r->view);
    r->view = first;
    if (!(lost <= 0.02 * sum)) /* where records lie depends on the past, by what is let pass in interpolation */
        fail_msg("%s: pictures differ by %g of their light", what, lost / sum);
}

static void all_are_forgotten(void **state)
{
    (void)state;
    struct house h;
    house_begin(&h, lum_method_find("tic"));
    rig_pass(&h.rig);
    lum_caches_forget(h.caches);
    h.rig.settings.shadow_samples = 4; /* asks for the picture again, of the same scene */
    rig_pass(&h.rig);
    expect_whole_picture(&h, "caches forgotten");
    house_end(&h);
}

/* Passes that were cancelled held other caches meanwhile, and the first one was dropped. */
static void the_cache_was_dropped(void **state)
{
    (void)state;
    struct house h;
    house_begin(&h, lum_method_find("tic"));
    struct rig *r = &h.rig;
    const _Atomic bool cancel = true;
    rig_pass(r);
    for (uint32_t k = 1; k <= LUM_CACHES_IDLE + 2; k++) {
        struct lum_view_settings other = r->settings;
        struct lum_pass_stats stats;
        other.n_vpls += k;
        assert_int_equal(lum_view_pass(r->view, r->snapshot, &other, &cancel, &stats, NULL), LUM_ERR_CANCELLED);
    }
    rig_pass(r);
    expect_whole_picture(&h, "cache dropped");
    house_end(&h);
}

/* Its memory is that of others when there are too many. */
static void a_method_without_cache_holds_none(void **state)
{
    (void)state;
    struct house h;
    house_begin(&h, lum_method_find("tic"));
    struct rig *r = &h.rig;
    struct lum_view_settings cached = r->settings;
    assert_true(rig_pass(r).cache.created > 0);
    r->settings.method = lum_method_find("path");
    r->settings.max_spp = 1;
    rig_pass(r);
    struct lum_view *other = NULL;
    RIG_OK(lum_view_create(r->pool, &other, &err));
    lum_view_share(other, h.caches);
    for (uint32_t k = 1; k <= LUM_CACHES_IDLE + 2; k++) {
        struct lum_pass_stats stats;
        cached.n_vpls += 1;
        RIG_OK(lum_view_pass(other, r->snapshot, &cached, NULL, &stats, &err));
    }
    cached.n_vpls -= LUM_CACHES_IDLE + 2;
    r->settings = cached;
    assert_true(rig_pass(r).cache.created > 0);
    lum_view_destroy(other);
    house_end(&h);
}

/* A method without a cache came between two caches that have been told of as many records: what the view knows of the
 * first says nothing of the second. */
static void what_it_knew_of_another_cache_is_void(void **state)
{
    (void)state;
    struct house h;
    house_begin(&h, lum_method_find("ic")); /* its radii, and so its places, do not depend on the VPLs */
    struct rig *r = &h.rig;
    struct lum_view_settings few = r->settings, many = r->settings;
    few.n_vpls = 1;
    many.n_vpls = 256;
    struct lum_view *other = NULL;
    struct lum_pass_stats stats;
    RIG_OK(lum_view_create(r->pool, &other, &err));
    lum_view_share(other, h.caches);
    RIG_OK(lum_view_pass(other, r->snapshot, &many, NULL, &stats, &err));
    r->settings = few;
    assert_int_equal(rig_pass(r).cache.records, stats.cache.records);
    r->settings.method = lum_method_find("path");
    r->settings.max_spp = 1;
    rig_pass(r);
    r->settings = many;
    assert_int_equal(rig_pass(r).cache.created, 0);
    expect_whole_picture(&h, "another cache");
    lum_view_destroy(other);
    house_end(&h);
}

static void updated_records_count_once(void **state)
{
    (void)state;
    struct house h;
    house_begin(&h, lum_method_find("tic"));
    struct rig *r = &h.rig;
    struct lum_pass_stats first = rig_pass(r);
    rig_object(r, "crate", "crate", "red", rig_v(0.45, 0.5, -0.4));
    rig_commit(r);
    struct lum_pass_stats moved = rig_pass(r);
    print_message("%llu records; of the move: %llu updated, %llu removed, %llu created, %llu reused\n",
                  (unsigned long long)first.cache.records, (unsigned long long)moved.cache.updated,
                  (unsigned long long)moved.cache.removed, (unsigned long long)moved.cache.created,
                  (unsigned long long)moved.cache.reused);
    assert_true(moved.cache.updated + moved.cache.removed + moved.cache.reused <= first.cache.records);
    house_end(&h);
}

/* At the next record, and not at the next tile: one can take as long as 65 536 rays. */
static void cancelled_whatever_the_storage(void **state)
{
    (void)state;
    for (int storage = 0; storage < LUM_STORAGE_COUNT; storage++) {
        struct house h;
        house_begin(&h, &free_method);
        struct rig *r = &h.rig;
        struct lum_pass_stats stats;
        r->settings.deterministic = false;
        r->settings.storage = (enum lum_storage)storage;
        atomic_store(&n_built, 0);
        atomic_store(&stop, false);
        atomic_store(&stop_after, 1);
        enum lum_status status = lum_view_pass(r->view, r->snapshot, &r->settings, &stop, &stats, NULL);
        print_message("%s: %u records made\n", lum_storage_names[storage], atomic_load(&n_built));
        assert_int_equal(status, LUM_ERR_CANCELLED);
        assert_true(atomic_load(&n_built) <= 2); /* the other worker's may be under way */
        atomic_store(&stop_after, UINT32_MAX);
        rig_pass(r);
        expect_whole_picture(&h, lum_storage_names[storage]);
        house_end(&h);
    }
}

/* The first edit of a view, with every allocation of it failing in turn, and then the next picture. */
static void whatever_allocation_fails(void **state)
{
    (void)state;
    static const char *const methods[] = {"tic", "live", "irrcache"};
    for (uint32_t k = 0; k < 2 * LUM_ARRAY_LEN(methods); k++) {
        enum lum_status status = LUM_ERR_NOMEM;
        uint64_t n = 1;
        for (; status != LUM_OK; n++) {
            struct house h;
            struct lum_pass_stats stats;
            house_begin(&h, lum_method_find(methods[k / 2]));
            struct rig *r = &h.rig;
            r->settings.max_spp = 1;
            r->settings.w = 24;
            r->settings.h = 16;
            if (k % 2)
                rig_pass(r);
            rig_bulb(r, "another", rig_v(-1, 2, 1), 30.0);
            rig_object(r, "crate", "crate", "red", rig_v(-0.9, 0.5, -0.4));
            rig_commit(r);
            lum_alloc_fail_after(n);
            status = lum_view_pass(r->view, r->snapshot, &r->settings, NULL, &stats, NULL);
            lum_alloc_fail_after(0);
            if (status != LUM_OK)
                assert_int_equal(status, LUM_ERR_NOMEM);
            rig_object(r, "crate", "crate", "red", rig_v(-0.9, 0.5, -0.5)); /* what else it did must not be lost */
            rig_commit(r);
            rig_pass(r);
            expect_whole_picture(&h, methods[k / 2]);
            r->settings.shadow_samples = 4;
            rig_pass(r);
            expect_whole_picture(&h, methods[k / 2]);
            house_end(&h);
        }
        print_message("%s%s: %llu allocations\n", methods[k / 2], k % 2 ? ", an edit" : "", (unsigned long long)n - 2);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_are_forgotten),
        cmocka_unit_test(the_cache_was_dropped),
        cmocka_unit_test(a_method_without_cache_holds_none),
        cmocka_unit_test(what_it_knew_of_another_cache_is_void),
        cmocka_unit_test(updated_records_count_once),
        cmocka_unit_test(cancelled_whatever_the_storage),
        cmocka_unit_test(whatever_allocation_fails),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
