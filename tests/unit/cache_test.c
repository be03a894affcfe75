/* The registry of caches, and what edits make of a cache: which of them reach its kind, what is forgotten, what is
 * traced.
 */
#include "core/cache/cache.h"

#include "core/cache/kind.h"
#include "core/math/sampler.h"
#include "core/pass/pass.h"
#include "tests/support/rig.h"

/* ---- a kind that writes down what it is told ---- */

static struct {
    uint32_t n_changes, n_movers;
    bool moved[LUM_VPL_DEFAULT];
    uint64_t epoch, rev_before, rev_now;
} told;

static size_t record_bytes(uint32_t n_vpls)
{
    (void)n_vpls;
    return sizeof(struct lum_cache_record);
}

static void note_change(struct lum_cache *cache, const struct lum_cache_update *update, const struct lum_motion *motion)
{
    told.n_changes++;
    told.n_movers = motion->n;
    told.epoch = cache->epoch;
    told.rev_before = cache->snapshot->scene_rev;
    told.rev_now = update->snapshot->scene_rev;
    for (uint32_t i = 0; i < cache->vpls.n; i++)
        told.moved[i] = cache->moved[i / 64] >> (i % 64) & 1;
    if (!cache->kind_state)
        cache->kind_state = lum_calloc(1, 8);
}

static const struct lum_cache_kind lasting = {
    .name = "lasting", .vpls = true, .lasting = true, .record_bytes = record_bytes, .change = note_change};
static const struct lum_cache_kind fleeting = {.name = "fleeting", .vpls = true, .record_bytes = record_bytes};
static const struct lum_cache_kind sampled = {.name = "sampled", .record_bytes = record_bytes};

/* ---- a scene with a cache ---- */

struct scene {
    struct rig rig;
    struct lum_caches *caches;
    struct lum_cache *cache;
    uint64_t vpl_rays; /* of the last update */
};

static struct lum_cache_key key_of(const struct lum_cache_kind *kind)
{
    return (struct lum_cache_key){.kind = kind,
                                  .storage = LUM_STORAGE_WAITFREE,
                                  .n_vpls = LUM_VPL_DEFAULT,
                                  .max_bounces = 3,
                                  .accuracy = 0.2f,
                                  .media = true};
}

static void put_fog(struct scene *s, float sigma_s)
{
    struct lum_medium_desc fog = {.sigma_s = lum_grey(sigma_s), .everywhere = true};
    RIG_OK(lum_scene_put_medium(s->rig.scene, "fog", &fog, &err));
}

static void begin(struct scene *s, const struct lum_cache_kind *kind)
{
    *s = (struct scene){0};
    memset(&told, 0, sizeof told);
    rig_begin(&s->rig, 2);
    rig_room(&s->rig);
    struct lum_light_desc lamp = rig_point(rig_v(0, 2.5, 0), 100.0), second = rig_point(rig_v(1, 2, 1), 50.0);
    rig_light(&s->rig, "lamp", &lamp);
    rig_light(&s->rig, "second", &second);
    rig_commit(&s->rig);
    struct lum_cache_key key = key_of(kind);
    RIG_OK(lum_caches_create(2, &s->caches, &err));
    RIG_OK(lum_cache_acquire(s->caches, &key, &s->cache, &err));
}

static void end(struct scene *s)
{
    lum_cache_release(s->caches, s->cache);
    lum_caches_destroy(s->caches);
    rig_end(&s->rig);
}

static enum lum_status try_update(struct scene *s, struct lum_error *err)
{
    struct lum_counters counters;
    memset(&counters, 0, sizeof counters);
    struct lum_cache_update u = {s->rig.snapshot, s->rig.pool, &counters};
    enum lum_status status = lum_cache_update(s->cache, &u, err);
    s->vpl_rays = counters.rays[LUM_RAY_VPL];
    return status;
}

static void update(struct scene *s)
{
    RIG_OK(try_update(s, &err));
    assert_ptr_equal(s->cache->snapshot, s->rig.snapshot);
}

static void commit_and_update(struct scene *s)
{
    rig_commit(&s->rig);
    update(s);
}

static void add_record(struct scene *s)
{
    struct lum_cache_record *r = lum_store_new(s->cache->store, 0);
    assert_non_null(r);
    r->n = r->ng = lum_v3(0, 1, 0);
    r->radius = 0.5f;
    r->object = lum_hash64_text("room");
    r->epoch = s->cache->epoch;
    assert_true(lum_store_insert(s->cache->store, 0, r));
    RIG_OK(lum_store_end_frame(s->cache->store, &err));
}

/* ---- what edits do ---- */

static void powers_trace_nothing(void **state)
{
    (void)state;
    struct scene s;
    begin(&s, &lasting);
    update(&s);
    assert_true(s.vpl_rays > 0);
    assert_int_equal(told.n_changes, 0); /* there was nothing to change */
    add_record(&s);
    uint64_t epoch = s.cache->epoch;
    rig_bulb(&s.rig, "lamp", rig_v(0, 2.5, 0), 20.0);
    commit_and_update(&s);
    assert_int_equal(s.vpl_rays, 0);
    assert_int_equal(told.n_changes, 1);
    assert_int_equal(told.n_movers, 0);
    assert_int_equal(told.epoch, epoch + 1);
    assert_int_equal(told.rev_before + 1, told.rev_now);
    for (uint32_t i = 0; i < LUM_VPL_DEFAULT; i++)
        assert_false(told.moved[i]);
    assert_int_equal(lum_store_count(s.cache->store), 1);
    end(&s);
}

static void nothing_new_is_no_change(void **state)
{
    (void)state;
    struct scene s;
    begin(&s, &lasting);
    update(&s);
    uint64_t epoch = s.cache->epoch;
    update(&s); /* a second view of the same scene */
    struct lum_camera camera = s.rig.settings.camera;
    RIG_OK(lum_scene_put_camera(s.rig.scene, "main", &camera, &err));
    commit_and_update(&s); /* a camera is none of its business */
    assert_int_equal(s.cache->epoch, epoch);
    assert_int_equal(told.n_changes, 0);
    assert_int_equal(s.vpl_rays, 0);
    end(&s);
}

/* The mask says exactly which VPLs lie elsewhere: those of others are where they were, bit by bit. */
static void a_moved_object_moves_some_vpls(void **state)
{
    (void)state;
    struct scene s;
    begin(&s, &lasting);
    update(&s);
    float x[LUM_VPL_DEFAULT], y[LUM_VPL_DEFAULT], z[LUM_VPL_DEFAULT];
    const struct lum_vpl_set *v = &s.cache->vpls;
    memcpy(x, v->px, sizeof x);
    memcpy(y, v->py, sizeof y);
    memcpy(z, v->pz, sizeof z);
    rig_object(&s.rig, "crate", "crate", "red", rig_v(-0.5, 0.5, -0.4));
    commit_and_update(&s);
    assert_true(s.vpl_rays > 0);
    assert_int_equal(told.n_changes, 1);
    assert_int_equal(told.n_movers, 1);
    uint32_t n_moved = 0;
    for (uint32_t i = 0; i < v->n; i++) {
        n_moved += told.moved[i];
        if (!told.moved[i] && v->light[i] != LUM_NO_OBJECT)
            assert_true(v->px[i] == x[i] && v->py[i] == y[i] && v->pz[i] == z[i]);
    }
    assert_int_equal(n_moved, v->n_moved);
    assert_true(n_moved > 0 && n_moved < v->n / 2);
    update(&s); /* the mask is of the last update alone */
    for (uint32_t w = 0; w < lum_vpl_words(v->n); w++)
        assert_true(s.cache->moved[w] == 0);
    end(&s);
}

static void fog_counts_where_light_is_dimmed(void **state)
{
    (void)state;
    for (int media = 0; media < 2; media++) {
        struct scene s;
        begin(&s, &lasting);
        struct lum_cache_key key = key_of(&lasting);
        key.media = media;
        struct lum_cache *cache;
        RIG_OK(lum_cache_acquire(s.caches, &key, &cache, &err));
        lum_cache_release(s.caches, s.cache);
        s.cache = cache;
        update(&s);
        put_fog(&s, 0.2f);
        commit_and_update(&s);
        assert_int_equal(told.n_changes, media);
        assert_int_equal(s.vpl_rays > 0, media);
        end(&s);
    }
}

static void a_kind_that_does_not_last_forgets(void **state)
{
    (void)state;
    const struct lum_cache_kind *kinds[] = {&fleeting, &sampled};
    for (int k = 0; k < 2; k++) {
        struct scene s;
        begin(&s, kinds[k]);
        update(&s);
        add_record(&s);
        update(&s);
        assert_int_equal(lum_store_count(s.cache->store), 1);
        rig_bulb(&s.rig, "lamp", rig_v(0, 2.5, 0), 20.0);
        commit_and_update(&s);
        assert_int_equal(s.vpl_rays, 0);
        assert_int_equal(lum_store_count(s.cache->store), 0);
        assert_int_equal(s.cache->removed, 1);
        assert_int_equal(told.n_changes, 0);
        assert_int_equal(s.cache->vpls.n > 0, kinds[k]->vpls);
        end(&s);
    }
}

static void a_scene_placed_anew_is_forgotten(void **state)
{
    (void)state;
    struct scene s;
    begin(&s, &lasting);
    update(&s);
    rig_object(&s.rig, "crate", "crate", "red", rig_v(0, 0.5, 0));
    commit_and_update(&s);
    add_record(&s);
    assert_non_null(s.cache->kind_state);
    rig_object(&s.rig, "far", "crate", "red", rig_v(5e3, 0, 0));
    commit_and_update(&s);
    assert_int_equal(told.n_changes, 1);
    assert_null(s.cache->kind_state);
    assert_int_equal(lum_store_count(s.cache->store), 0);
    assert_int_equal(s.cache->removed, 1);
    add_record(&s); /* it works */
    end(&s);
}

static void bounds_follow_the_spacing_of_an_empty_cache(void **state)
{
    (void)state;
    struct scene s;
    begin(&s, &lasting);
    update(&s);
    float first = s.cache->spacing;
    assert_true(first > 0.0f && first == s.cache->vpls.spacing);
    add_record(&s);
    rig_object(&s.rig, "crate", "crate", "red", rig_v(-0.5, 1.5, -0.4));
    commit_and_update(&s);
    assert_true(s.cache->vpls.spacing != first && s.cache->spacing == first);
    lum_store_clear(s.cache->store);
    rig_object(&s.rig, "crate", "crate", "red", rig_v(-0.5, 1.0, 0.4));
    commit_and_update(&s);
    assert_true(s.cache->spacing == s.cache->vpls.spacing);
    end(&s);
}

/* ---- the registry ---- */

static void equal_settings_share_a_cache(void **state)
{
    (void)state;
    struct scene s;
    begin(&s, &lasting);
    struct lum_cache_key key = key_of(&lasting);
    struct lum_cache *same, *other;
    RIG_OK(lum_cache_acquire(s.caches, &key, &same, &err));
    assert_ptr_equal(same, s.cache);
    struct lum_cache_key keys[8];
    for (int i = 0; i < 8; i++)
        keys[i] = key;
    keys[0].kind = &fleeting;
    keys[1].storage = LUM_STORAGE_LOCK;
    keys[2].n_vpls++;
    keys[3].max_bounces++;
    keys[4].seed++;
    keys[5].accuracy *= 2.0f;
    keys[6].media = !keys[6].media;
    keys[7].gloss = !keys[7].gloss;
    for (int i = 0; i < 8; i++) {
        RIG_OK(lum_cache_acquire(s.caches, &keys[i], &other, &err));
        assert_ptr_not_equal(other, s.cache);
        lum_cache_release(s.caches, other);
    }
    lum_cache_release(s.caches, same);
    end(&s);
}

/* Seen by what a cache remembers: a new one has no snapshot. */
static bool remembers(struct scene *s, uint32_t seed)
{
    struct lum_cache_key key = key_of(&lasting);
    key.seed = seed;
    struct lum_cache *cache, *mine = s->cache;
    RIG_OK(lum_cache_acquire(s->caches, &key, &cache, &err));
    bool old = cache->snapshot != NULL;
    s->cache = cache;
    update(s);
    s->cache = mine;
    lum_cache_release(s->caches, cache);
    return old;
}

static void the_last_idle_caches_are_kept(void **state)
{
    (void)state;
    struct scene s;
    begin(&s, &lasting);
    for (uint32_t seed = 1; seed <= LUM_CACHES_IDLE + 1; seed++)
        assert_false(remembers(&s, seed));
    for (uint32_t seed = 2; seed <= LUM_CACHES_IDLE + 1; seed++)
        assert_true(remembers(&s, seed));
    assert_false(remembers(&s, 1));         /* of all the one that was put down first */
    assert_true(s.cache->snapshot == NULL); /* held all the time, and never updated */
    lum_cache_release(s.caches, NULL);
    lum_caches_destroy(NULL);
    end(&s);
}

/* ---- memory ---- */

/* Each allocation of an update fails in turn. full: there are records, and an object moved; else the cache is new. */
static uint32_t sweep(struct scene *s, bool full)
{
    for (uint32_t k = 1;; k++) {
        struct lum_cache_key key = key_of(&lasting);
        key.seed = 2 * k + full;
        lum_cache_release(s->caches, s->cache);
        RIG_OK(lum_cache_acquire(s->caches, &key, &s->cache, &err));
        if (full) {
            update(s);
            add_record(s);
            rig_object(&s->rig, "crate", "crate", "red", rig_v(k % 2 ? -0.5 : 0.5, 0.5, -0.4));
            rig_commit(&s->rig);
        }
        struct lum_error failure;
        lum_alloc_fail_after(k);
        enum lum_status status = try_update(s, &failure);
        lum_alloc_fail_after(0);
        if (status == LUM_OK)
            return k - 1;
        assert_int_equal(status, LUM_ERR_NOMEM);
        assert_null(s->cache->snapshot);
        assert_true(!s->cache->store || lum_store_count(s->cache->store) == 0);
        update(s);
        add_record(s);
    }
}

static void short_memory_leaves_an_empty_cache(void **state)
{
    (void)state;
    struct scene s;
    begin(&s, &lasting);
    uint32_t fresh = sweep(&s, false), full = sweep(&s, true);
    print_message("allocations that failed in turn: %u of a new cache, %u of an old one\n", fresh, full);
    assert_true(fresh >= 3 && full >= 2);
    end(&s);
}

static void short_memory_for_the_registry(void **state)
{
    (void)state;
    struct lum_caches *caches = NULL;
    struct lum_cache *cache = NULL;
    struct lum_error failure;
    struct lum_cache_key key = key_of(&lasting);
    lum_alloc_fail_after(1);
    assert_int_equal(lum_caches_create(1, &caches, &failure), LUM_ERR_NOMEM);
    assert_null(caches);
    RIG_OK(lum_caches_create(1, &caches, &err));
    lum_alloc_fail_after(1);
    assert_int_equal(lum_cache_acquire(caches, &key, &cache, &failure), LUM_ERR_NOMEM);
    assert_null(cache);
    RIG_OK(lum_cache_acquire(caches, &key, &cache, &err));
    lum_cache_release(caches, cache);
    lum_caches_destroy(caches);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(powers_trace_nothing),
        cmocka_unit_test(nothing_new_is_no_change),
        cmocka_unit_test(a_moved_object_moves_some_vpls),
        cmocka_unit_test(fog_counts_where_light_is_dimmed),
        cmocka_unit_test(a_kind_that_does_not_last_forgets),
        cmocka_unit_test(a_scene_placed_anew_is_forgotten),
        cmocka_unit_test(bounds_follow_the_spacing_of_an_empty_cache),
        cmocka_unit_test(equal_settings_share_a_cache),
        cmocka_unit_test(the_last_idle_caches_are_kept),
        cmocka_unit_test(short_memory_leaves_an_empty_cache),
        cmocka_unit_test(short_memory_for_the_registry),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
