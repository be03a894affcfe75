/* Instant caching: records are direct sums of their VPLs; each of the five cases, alone; any edits against building
 * anew. */
#include "tests/support/rig.h"

#include "core/cache/instant.h"
#include "core/math/sampler.h"
#include "core/render/frame.h"
#include "core/scene/shapes.h"
#include "tests/support/built_in.h"

#define MAX_RECORDS 256u

struct bench {
    struct rig rig;
    struct lum_caches *caches;
    struct lum_cache *cache;
    struct lum_cache_record *records[MAX_RECORDS]; /* in the cache; NULL: was removed */
    uint32_t n;
    uint64_t rays; /* of the last update and the last refresh */
};

static struct lum_cache_key key_of(const struct lum_cache_kind *kind, uint32_t n_vpls, uint32_t max_bounces)
{
    return (struct lum_cache_key){
        .kind = kind, .storage = LUM_STORAGE_WAITFREE, .n_vpls = n_vpls, .max_bounces = max_bounces, .accuracy = 0.25f};
}

static void bench_begin(struct bench *b, const struct lum_cache_key *key)
{
    memset(b, 0, sizeof *b);
    rig_begin(&b->rig, 3);
    RIG_OK(lum_caches_create(3, &b->caches, &err));
    RIG_OK(lum_cache_acquire(b->caches, key, &b->cache, &err));
}

static void bench_end(struct bench *b)
{
    lum_cache_release(b->caches, b->cache);
    lum_caches_destroy(b->caches);
    rig_end(&b->rig);
}

static void tell_cache(struct bench *b)
{
    struct lum_counters counters = {0};
    struct lum_cache_update update = {b->rig.snapshot, b->rig.pool, &counters};
    RIG_OK(lum_cache_update(b->cache, &update, &err));
    assert_int_equal(counters.bad_rays, 0);
    b->rays = counters.rays[LUM_RAY_INDIRECT_DIFFUSE];
}

/* Publishes the edits and tells the cache. */
static void publish(struct bench *b)
{
    rig_commit(&b->rig);
    tell_cache(b);
}

static struct lum_cache_job job_of(struct bench *b, struct lum_cache_record *const *records, uint32_t n,
                                   struct lum_counters *counters)
{
    return (struct lum_cache_job){
        .cache = b->cache, .snapshot = b->rig.snapshot, .records = records, .n = n, .counters = counters};
}

static void build(struct bench *b, struct lum_cache_record *const *records, uint32_t n)
{
    struct lum_counters counters = {0};
    struct lum_cache_job job = job_of(b, records, n, &counters);
    b->cache->key.kind->build(&job);
    assert_int_equal(counters.bad_rays, 0);
    b->rays = counters.rays[LUM_RAY_INDIRECT_DIFFUSE];
}

static struct lum_vec3 place(const struct bench *b, double x, double y, double z)
{
    const struct lum_normalisation *n = &b->rig.snapshot->norm;
    return lum_v3((float)((x - n->centre.x) * n->scale), (float)((y - n->centre.y) * n->scale),
                  (float)((z - n->centre.z) * n->scale));
}

/* A new record, not built. */
static struct lum_cache_record *new_record(struct bench *b, struct lum_vec3 p, struct lum_vec3 n)
{
    struct lum_cache_record *r = lum_store_new(b->cache->store, 0);
    assert_non_null(r);
    r->p = p;
    r->n = r->ng = n;
    return r;
}

/* Shares those from `first` on. */
static void build_and_insert(struct bench *b, uint32_t first)
{
    build(b, b->records + first, b->n - first);
    for (uint32_t i = first; i < b->n; i++)
        assert_true(lum_store_insert(b->cache->store, 0, b->records[i]));
}

static void add_record(struct bench *b, struct lum_vec3 p, struct lum_vec3 n)
{
    assert_true(b->n < MAX_RECORDS);
    b->records[b->n++] = new_record(b, p, n);
}

/* n records on the surfaces that rays from a point meet. */
static void add_seen_records(struct bench *b, struct lum_vec3 eye, uint32_t n, uint32_t seed)
{
    struct lum_rays rays = {.n = 0};
    struct lum_hits hits;
    uint64_t bad = 0;
    struct lum_trace trace = {.top = b->rig.snapshot->top, .bad_rays = &bad};
    for (uint32_t i = 0; i < n; i++) {
        struct lum_sampler sampler = lum_sampler_at(i, 0, 0, seed);
        struct lum_vec2 u = lum_sampler_2d(&sampler, 0);
        float z = 1.0f - 2.0f * u.x, r = sqrtf(lum_max(0.0f, 1.0f - z * z)), phi = 2.0f * LUM_PI * u.y;
        lum_rays_push(&rays, eye, lum_v3(r * cosf(phi), r * sinf(phi), z), INFINITY);
    }
    lum_trace_closest(&trace, &rays, &hits);
    for (uint32_t i = 0; i < n; i++) {
        struct lum_surface s;
        if (hits.object[i] == LUM_NO_OBJECT)
            continue;
        lum_snapshot_surface(b->rig.snapshot, &hits, i, lum_rays_direction(&rays, i), &s);
        if (s.instance == LUM_NO_OBJECT)
            continue;
        add_record(b, s.p, s.ns);
        b->records[b->n - 1]->ng = s.ng;
        b->records[b->n - 1]->object = b->rig.snapshot->instances[s.instance].hash;
    }
}

/* Brings records first .. first + n - 1 up to date, as a view would; those that were removed are forgotten. */
static void refresh(struct bench *b, uint32_t first, uint32_t n)
{
    struct lum_cache_record *stale[MAX_RECORDS];
    struct lum_counters counters = {0};
    uint32_t n_stale = 0;
    for (uint32_t i = first; i < first + n; i++)
        if (b->records[i] && lum_cache_is_stale(b->cache, b->records[i]))
            stale[n_stale++] = b->records[i];
    struct lum_cache_job job = job_of(b, stale, n_stale, &counters);
    if (n_stale)
        b->cache->key.kind->refresh(&job);
    assert_int_equal(counters.bad_rays, 0);
    b->rays = counters.rays[LUM_RAY_INDIRECT_DIFFUSE];
    for (uint32_t i = 0; i < b->n; i++)
        if (b->records[i] && !lum_store_at(b->cache->store, b->records[i]->index))
            b->records[i] = NULL;
}

static uint32_t n_left(const struct bench *b)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < b->n; i++)
        n += b->records[i] != NULL;
    return n;
}

/* Every record that is up to date is bit for bit what it would be if it were built now: its terms are what was traced,
 * with the same arithmetic, and their sum is taken in the same order, so that there is nothing to tolerate. */
static void assert_as_built(struct bench *b, const char *what)
{
    for (uint32_t i = 0; i < b->n; i++) {
        struct lum_cache_record *r = b->records[i];
        if (!r || lum_cache_is_stale(b->cache, r))
            continue;
        struct lum_cache_record *fresh = new_record(b, r->p, r->n);
        fresh->ng = r->ng;
        build(b, &fresh, 1);
        if (memcmp(&fresh->irradiance, &r->irradiance, sizeof r->irradiance) != 0)
            fail_msg("%s: record %u has %.9g %.9g %.9g, built anew %.9g %.9g %.9g", what, i, (double)r->irradiance.r,
                     (double)r->irradiance.g, (double)r->irradiance.b, (double)fresh->irradiance.r,
                     (double)fresh->irradiance.g, (double)fresh->irradiance.b);
        lum_store_drop(b->cache->store, 0, fresh);
    }
}

static double total(const struct bench *b)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < b->n; i++)
        sum += b->records[i] ? (double)b->records[i]->irradiance.g : 0.0;
    return sum;
}

/* ---- a record is a direct sum ---- */

static void compare_with_gather(struct bench *b, const char *what)
{
    struct lum_gather_points points = {.n_points = b->n};
    struct lum_rgb sums[MAX_RECORDS] = {{0}};
    uint32_t slots[1024];
    struct lum_counters counters = {0};
    for (uint32_t i = 0; i < b->n; i++) {
        points.p[i] = b->records[i]->p;
        points.n[i] = b->records[i]->n;
        points.ng[i] = b->records[i]->ng;
    }
    for (uint32_t k = 0; k < b->cache->vpls.n; k++)
        slots[k] = k;
    struct lum_gather gather = {.snapshot = b->rig.snapshot,
                                .set = &b->cache->vpls,
                                .slots = slots,
                                .n_slots = b->cache->vpls.n,
                                .bound = lum_instant_bound(b->cache),
                                .media = b->cache->key.media,
                                .points = &points,
                                .irradiance = sums,
                                .counters = &counters};
    lum_vpl_gather(&gather);
    assert_int_equal(counters.rays[LUM_RAY_INDIRECT_DIFFUSE], b->rays);
    double lit = 0.0;
    for (uint32_t i = 0; i < b->n; i++) {
        /* flux, pi and term are multiplied in another order where there are media: 3 products, 2^-24 each; sums of
         * doubles */
        double got = (double)b->records[i]->irradiance.g, want = (double)sums[i].g;
        if (!(fabs(got - want) <= 4 * 0x1p-24 * want))
            fail_msg("%s: record %u is %.9g, the sum of its VPLs %.9g", what, i, got, want);
        lit += want;
    }
    assert_true(lit > 0.0);
}

static void lamp(struct bench *b, const char *id, double x, double y, double z, double cd)
{
    struct lum_light_desc l = rig_point(rig_v(x, y, z), cd);
    rig_light(&b->rig, id, &l);
}

static void a_record_is_the_sum_of_its_vpls(void **state)
{
    (void)state;
    const uint32_t counts[] = {1, 15, 16, 17, 256, 600};
    for (size_t i = 0; i < 2 * LUM_ARRAY_LEN(counts); i++) {
        struct bench b;
        struct lum_cache_key key = key_of(i % 2 ? &lum_cache_instant : &lum_cache_temporal, counts[i / 2], 4);
        key.media = i % 2;
        bench_begin(&b, &key);
        rig_room(&b.rig);
        lamp(&b, "lamp", 1.0, 2.2, 0.7, 100);
        lamp(&b, "off", -1.0, 2.2, 0.7, 0);
        if (key.media) {
            struct lum_medium_desc fog = {.sigma_s = lum_rgb(0.05f, 0.1f, 0.2f), .everywhere = true};
            RIG_OK(lum_scene_put_medium(b.rig.scene, "fog", &fog, &err));
        }
        publish(&b);
        add_seen_records(&b, place(&b, -0.5, 1.5, 0.5), 200, 7);
        build_and_insert(&b, 0);
        char what[64];
        snprintf(what, sizeof what, "%s, %u VPLs", key.kind->name, key.n_vpls);
        compare_with_gather(&b, what);
        for (uint32_t k = 0; k < b.n; k++) /* 6.2.5: a is in metres */
            assert_true(b.records[k]->radius == 0.25f * (float)b.rig.snapshot->norm.scale);
        bench_end(&b);
    }
}

/* ---- built-in scenes ---- */

/* A bench whose scene is a built-in one, in its first pose. */
static struct built_in *begin_built_in(struct bench *b, const char *scene, const struct lum_cache_kind *kind)
{
    struct built_in *source = built_in_open(scene, 2);
    struct lum_cache_key key = key_of(kind, 256, 7);
    struct lum_camera camera;
    memset(b, 0, sizeof *b);
    built_in_next_pose(source);
    b->rig.snapshot = built_in_snapshot(source);
    b->rig.pool = built_in_pool(source);
    key.media = b->rig.snapshot->n_media > 0;
    RIG_OK(lum_caches_create(2, &b->caches, &err));
    RIG_OK(lum_cache_acquire(b->caches, &key, &b->cache, &err));
    tell_cache(b);
    RIG_OK(lum_snapshot_camera(b->rig.snapshot, NULL, &camera, &err));
    struct lum_vec3d p = camera.position, q = camera.target; /* cameras may stand outside of what they look into */
    add_seen_records(b, place(b, 0.2 * p.x + 0.8 * q.x, 0.2 * p.y + 0.8 * q.y, 0.2 * p.z + 0.8 * q.z), MAX_RECORDS, 21);
    build_and_insert(b, 0);
    return source;
}

static void end_built_in(struct bench *b, struct built_in *source)
{
    lum_cache_release(b->caches, b->cache);
    lum_caches_destroy(b->caches);
    built_in_close(source);
}

static void built_in_scenes_are_sums_too(void **state)
{
    (void)state;
    static const char *const scenes[] = {"cornell", "office", "sibenik", "office-media", "many-lights"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(scenes); i++) {
        struct bench b;
        struct built_in *source = begin_built_in(&b, scenes[i], &lum_cache_instant);
        assert_true(b.n > 100);
        compare_with_gather(&b, scenes[i]);
        end_built_in(&b, source);
    }
}

/* The animations of 6.3.2: dense meshes, several movers, one that deforms. */
static void animations_leave_records_as_built(void **state)
{
    (void)state;
    static const char *const scenes[] = {"cornell", "wobble", "desk", "bunnies-9", "conference"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(scenes); i++) {
        struct bench b;
        struct built_in *source = begin_built_in(&b, scenes[i], &lum_cache_temporal);
        uint64_t rays = b.rays, updates = 0;
        for (int pose = 0; pose < 6 && built_in_next_pose(source); pose++) {
            b.rig.snapshot = built_in_snapshot(source);
            tell_cache(&b);
            refresh(&b, 0, b.n);
            updates += b.rays;
            assert_true(b.rays > 0);
            assert_as_built(&b, scenes[i]);
        }
        struct lum_instant_counts c = lum_cache_temporal_counts(b.cache);
        print_message(
            "%s: %llu rays to build %u records; in 5 to 6 poses %llu to VPLs, %llu to movers, %llu to the scene\n",
            scenes[i], (unsigned long long)rays, b.n, (unsigned long long)c.vpl_rays, (unsigned long long)c.mover_rays,
            (unsigned long long)c.scene_rays);
        assert_int_equal(updates, c.vpl_rays + c.mover_rays + c.scene_rays);
        end_built_in(&b, source);
    }
}

/* ---- the five cases ---- */

/* A room lit by one spot light, which makes all its VPLs on the wall at x = -2, around the height of 2 m; a pillar that
 * keeps some light from the floor for good; and a board that may stand outside, in the corner before the other wall, or
 * in the beam. Only one bounce: nothing else moves VPLs. */
static void stage(struct bench *b)
{
    rig_room(&b->rig);
    rig_box(&b->rig, "board", 0.2, 0.2, 0.2);
    rig_box(&b->rig, "pillar", 0.1, 0.8, 0.1);
    rig_box(&b->rig, "peg", 0.1, 0.1, 0.1);
    rig_object(&b->rig, "pillar", "pillar", "white", rig_v(-1.0, 0.8, 1.0));
    rig_object(&b->rig, "peg", "peg", "white", rig_v(5, 5, 5)); /* so that the bounds of the scene stay as they are */
    rig_object(&b->rig, "peg2", "peg", "white", rig_v(-5, -5, -5));
    struct lum_light_desc spot = rig_point(rig_v(1.5, 2.5, -1.0), 200);
    spot.kind = LUM_LIGHT_SPOT;
    spot.direction = rig_v(-3.5, -0.5, 0.5);
    spot.inner_cone_rad = 0.17;
    spot.outer_cone_rad = 0.25;
    rig_light(&b->rig, "spot", &spot);
}

static const double outside[3] = {4, 4, 0}, corner[3] = {1.2, 0.45, 1.2}, beam[3] = {-0.25, 2.25, -0.75};

static void put_board(struct bench *b, const double at[3])
{
    rig_object(&b->rig, "board", "board", "red", rig_v(at[0], at[1], at[2]));
}

static void begin_stage(struct bench *b, const double at[3], bool immediate)
{
    struct lum_cache_key key = key_of(&lum_cache_temporal, 64, 1);
    bench_begin(b, &key);
    stage(b);
    put_board(b, at);
    publish(b);
    b->cache->immediate = immediate;
    assert_true(b->cache->vpls.n_lit > 32);
    for (int i = 0; i < 8; i++)
        for (int j = 0; j < 8; j++)
            add_record(b, place(b, -1.7 + 0.45 * i, 0.0, -1.6 + 0.43 * j), lum_v3(0, 1, 0));
    build_and_insert(b, 0);
}

struct tally {
    uint64_t facing, dark; /* rays of visibility, and those of them that are in shadow */
};

static struct tally count_rays(const struct bench *b)
{
    struct tally t = {0, 0};
    for (uint32_t i = 0; i < b->n; i++)
        for (uint32_t k = 0; b->records[i] && k < b->cache->vpls.n; k++) {
            float term = ((const struct lum_instant_record *)(const void *)b->records[i])->term[k];
            t.facing += term != 0.0f && isfinite(term);
            t.dark += term < 0.0f && isfinite(term);
        }
    return t;
}

/* Moves the board (or NULL: takes it away) and brings all records up to date; returns what that took, which is checked
 * against the rays that were counted. */
static struct lum_instant_counts move_board(struct bench *b, const double at[3])
{
    struct lum_instant_counts was = lum_cache_temporal_counts(b->cache), is;
    uint64_t rays;
    if (at)
        put_board(b, at);
    else
        RIG_OK(lum_scene_remove(b->rig.scene, LUM_ENTITY_OBJECT, "board", &err));
    publish(b);
    rays = b->rays;
    refresh(b, 0, b->n);
    rays += b->rays;
    is = lum_cache_temporal_counts(b->cache);
    is.vpl_rays -= was.vpl_rays;
    is.mover_rays -= was.mover_rays;
    is.box_tests -= was.box_tests;
    is.scene_rays -= was.scene_rays;
    is.removed -= was.removed;
    assert_int_equal(rays, is.vpl_rays + is.mover_rays + is.scene_rays);
    assert_int_equal(is.aged, 0);
    return is;
}

static void an_occluder_enters_and_leaves(void **state)
{
    for (int immediate = 0; immediate < 2; immediate++) {
        (void)state;
        struct bench b;
        begin_stage(&b, outside, immediate);
        struct tally before = count_rays(&b);
        double sum = total(&b);
        assert_true(before.dark > 0 && before.dark < before.facing);

        struct lum_instant_counts c = move_board(&b, corner); /* case 3 */
        assert_int_equal(b.cache->vpls.n_moved, 0);
        assert_int_equal(c.vpl_rays, 0);
        assert_int_equal(c.mover_rays, before.facing); /* line 11 asks for every ray; */
        assert_true(c.box_tests <= before.dark);       /* line 15 for those in shadow that it did not hit, */
        assert_int_equal(c.scene_rays, 0);             /* and the box was outside the room */
        assert_int_equal(c.removed, 0);
        struct tally within = count_rays(&b);
        assert_int_equal(within.facing, before.facing);
        assert_true(within.dark > before.dark);
        assert_true(total(&b) < sum);
        assert_as_built(&b, "occluded");

        c = move_board(&b, outside); /* case 4; and case 5: records under the board are in its box */
        assert_int_equal(c.vpl_rays, 0);
        assert_true(c.box_tests > 0 && c.scene_rays > 0 && c.scene_rays < c.box_tests);
        assert_int_equal(c.removed, 0); /* it stood 5 cm above the floor */
        assert_int_equal(count_rays(&b).dark, before.dark);
        assert_true(total(&b) == sum);
        assert_as_built(&b, "deoccluded");
        bench_end(&b);
    }
}

static void what_is_taken_away_is_not_traced(void **state)
{
    (void)state;
    struct bench b;
    begin_stage(&b, corner, false);
    double sum = total(&b);
    struct tally before = count_rays(&b);
    struct lum_instant_counts c = move_board(&b, NULL);
    assert_int_equal(c.mover_rays, 0);
    assert_int_equal(c.box_tests, before.dark);
    assert_true(c.scene_rays > 0 && total(&b) > sum);
    assert_as_built(&b, "taken away");
    before = count_rays(&b);
    c = move_board(&b, corner);
    assert_int_equal(c.mover_rays, before.facing);
    assert_int_equal(c.scene_rays, 0); /* it was nowhere */
    assert_true(total(&b) == sum);
    assert_as_built(&b, "put back");
    bench_end(&b);
}

static void paths_of_vpls_are_blocked_and_freed(void **state)
{
    for (int immediate = 0; immediate < 2; immediate++) {
        (void)state;
        struct bench b;
        begin_stage(&b, outside, immediate);
        double sum = total(&b);
        struct lum_instant_counts c = move_board(&b, beam); /* case 1 */
        uint32_t n_moved = b.cache->vpls.n_moved;
        assert_true(n_moved > 0 && n_moved < 64);
        assert_true(c.vpl_rays > 0 && c.vpl_rays <= (uint64_t)n_moved * b.n);
        assert_as_built(&b, "blocked");
        assert_true(total(&b) != sum);
        c = move_board(&b, outside); /* case 2 */
        assert_int_equal(b.cache->vpls.n_moved, n_moved);
        assert_true(c.vpl_rays > 0 && c.vpl_rays <= (uint64_t)n_moved * b.n);
        assert_as_built(&b, "freed");
        assert_true(total(&b) == sum);
        bench_end(&b);
    }
}

static void records_on_what_moves_are_removed(void **state)
{
    for (int immediate = 0; immediate < 2; immediate++) {
        (void)state;
        struct bench b;
        begin_stage(&b, corner, immediate);
        add_record(&b, place(&b, corner[0], corner[1] + 0.2, corner[2]), lum_v3(0, 1, 0));  /* on it */
        add_record(&b, place(&b, corner[0], corner[1] + 0.25, corner[2]), lum_v3(0, 1, 0)); /* above it */
        build_and_insert(&b, b.n - 2);
        uint32_t n = b.n, count = lum_store_count(b.cache->store);
        struct lum_instant_counts c = move_board(&b, outside);
        assert_int_equal(c.removed, 1);
        assert_null(b.records[n - 2]);
        assert_int_equal(n_left(&b), n - 1);
        assert_int_equal(lum_store_count(b.cache->store), count - 1);
        assert_as_built(&b, "left behind");
        bench_end(&b);
    }
}

/* A record that was away for several changes pays for what became of them, and no more. */
static void what_went_and_came_back_costs_nothing_twice(void **state)
{
    (void)state;
    struct bench b;
    begin_stage(&b, outside, false);
    struct tally before = count_rays(&b);
    double sum = total(&b);
    for (int i = 0; i < 5; i++) {
        put_board(&b, i % 2 ? beam : corner);
        publish(&b);
        assert_int_equal(b.rays, 0);
        refresh(&b, 0, b.n / 2);
        assert_as_built(&b, "half of them");
    }
    put_board(&b, outside);
    publish(&b);
    struct lum_instant_counts was = lum_cache_temporal_counts(b.cache);
    refresh(&b, b.n / 2, b.n - b.n / 2);
    struct lum_instant_counts is = lum_cache_temporal_counts(b.cache);
    assert_true(is.mover_rays - was.mover_rays < before.facing);
    assert_int_equal(is.scene_rays - was.scene_rays,
                     0); /* where it was when they were last true, nothing was in its shadow */
    refresh(&b, 0, b.n);
    assert_true(total(&b) == sum);
    assert_as_built(&b, "all of them");
    bench_end(&b);
}

/* ---- what traces no ray ---- */

static void light_that_changes_traces_no_ray(void **state)
{
    (void)state;
    struct bench b;
    struct lum_cache_key key = key_of(&lum_cache_temporal, 256, 3);
    bench_begin(&b, &key);
    rig_room(&b.rig);
    lamp(&b, "a", 1.0, 2.2, 0.7, 100);
    lamp(&b, "b", -1.0, 2.0, 0.9, 50);
    publish(&b);
    add_seen_records(&b, place(&b, -0.5, 1.5, 0.5), 200, 3);
    build_and_insert(&b, 0);
    double sum = total(&b), half;

    publish(&b); /* at rest */
    assert_int_equal(b.rays, 0);
    refresh(&b, 0, b.n);
    assert_int_equal(b.rays, 0);
    assert_true(total(&b) == sum);

    lamp(&b, "a", 1.0, 2.2, 0.7, 50); /* dimmed: a power of two, so that every product is exact */
    lamp(&b, "b", -1.0, 2.0, 0.9, 25);
    publish(&b);
    assert_int_equal(b.rays, 0);
    refresh(&b, 0, b.n);
    assert_int_equal(b.rays, 0);
    half = total(&b);
    assert_true(half == 0.5 * sum);
    assert_as_built(&b, "dimmed");

    struct lum_light_desc off = rig_point(rig_v(1.0, 2.2, 0.7), 50);
    off.on = false;
    rig_light(&b.rig, "a", &off); /* switched off, and on again */
    publish(&b);
    refresh(&b, 0, b.n);
    assert_int_equal(b.rays, 0);
    assert_true(total(&b) < half);
    assert_as_built(&b, "off");
    lamp(&b, "a", 1.0, 2.2, 0.7, 50);
    publish(&b);
    refresh(&b, 0, b.n);
    assert_int_equal(b.rays, 0);
    assert_true(total(&b) == half);
    assert_as_built(&b, "on");

    struct lum_material_desc white = rig_diffuse(0.4f); /* VPLs stay where they are, and give less */
    rig_material(&b.rig, "white", &white);
    publish(&b);
    refresh(&b, 0, b.n);
    assert_int_equal(b.cache->vpls.n_moved, 0);
    assert_int_equal(b.rays, 0);
    assert_true(total(&b) < half);
    assert_as_built(&b, "painted");
    bench_end(&b);
}

/* What was never asked of a lamp that was off is asked when it shines; what moved meanwhile is known then. */
static void a_lamp_that_was_off_is_asked_when_it_shines(void **state)
{
    (void)state;
    struct bench b;
    struct lum_cache_key key = key_of(&lum_cache_temporal, 128, 2);
    bench_begin(&b, &key);
    rig_room(&b.rig);
    lamp(&b, "a", 1.0, 2.2, 0.7, 100);
    lamp(&b, "b", -1.0, 2.0, 0.9, 50);
    publish(&b);
    struct lum_light_desc off = rig_point(rig_v(-1.0, 2.0, 0.9), 50);
    off.on = false;
    rig_light(&b.rig, "b", &off);
    publish(&b);
    add_seen_records(&b, place(&b, -0.5, 1.5, 0.5), 100, 5);
    build_and_insert(&b, 0);
    for (int i = 0; i < 3; i++) {
        if (i == 1)
            rig_object(&b.rig, "crate", "crate", "red", rig_v(0.4, 0.5, -0.4));
        off.on = i != 1;
        rig_light(&b.rig, "b", &off);
        publish(&b);
        refresh(&b, 0, b.n);
        assert_true(b.rays > 0);
        assert_as_built(&b, "shines again");
    }
    bench_end(&b);
}

/* Nor is the bound of the geometry term known before the first VPL is. */
static void the_first_light_may_come_after_the_records(void **state)
{
    (void)state;
    struct bench b;
    struct lum_cache_key key = key_of(&lum_cache_temporal, 128, 2);
    bench_begin(&b, &key);
    rig_room(&b.rig);
    publish(&b);
    add_seen_records(&b, place(&b, -0.5, 1.5, 0.5), 100, 5);
    build_and_insert(&b, 0);
    assert_true(total(&b) == 0.0 && b.rays == 0);
    lamp(&b, "a", 1.0, 2.2, 0.7, 100);
    publish(&b);
    refresh(&b, 0, b.n);
    assert_true(b.cache->spacing == b.cache->vpls.spacing && b.cache->spacing > 0.0f);
    assert_true(total(&b) > 0.0);
    assert_as_built(&b, "the first light");
    bench_end(&b);
}

/* ---- any edits ---- */

struct dice {
    uint64_t state;
};

static double roll(struct dice *d)
{
    d->state = d->state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(d->state >> 40) * 0x1p-24;
}

static struct lum_vec3d in_room(struct dice *d)
{
    double x = roll(d), y = roll(d), z = roll(d);
    return rig_v(-1.4 + 2.8 * x, 0.5 + 2.0 * y, -1.4 + 2.8 * z);
}

static void put_tent(struct rig *r, double height)
{
    const double p[] = {-0.4, 0, -0.4, 0.4, 0, -0.4, 0, height, 0, 0, 0, 0.4};
    const uint32_t index[] = {0, 1, 2, 1, 3, 2, 3, 0, 2, 0, 3, 1};
    struct lum_mesh_desc m = {.positions = p, .indices = index, .n_vertices = 4, .n_triangles = 4, .deforming = true};
    RIG_OK(lum_scene_put_mesh(r->scene, "tent", &m, &err));
}

static const char *edit(struct rig *r, struct dice *d, bool there[4])
{
    static const char *const things[] = {"t0", "t1", "t2", "t3"}, *const lamps[] = {"l0", "l1"};
    uint32_t which = (uint32_t)(roll(d) * 4.0), what = (uint32_t)(roll(d) * 8.0);
    struct lum_vec3d at = in_room(d);
    struct lum_material_desc paint = rig_diffuse((float)(0.2 + 0.6 * roll(d)));
    struct lum_light_desc l;
    switch (what) {
    case 0:
    case 1:
        rig_object(r, things[which], which % 2 ? "tent" : "crate", "red", at);
        return there[which] ? (there[which] = true, "move") : (there[which] = true, "add");
    case 2:
        if (there[which])
            RIG_OK(lum_scene_remove(r->scene, LUM_ENTITY_OBJECT, things[which], &err));
        there[which] = false;
        return "remove";
    case 3:
        put_tent(r, 0.3 + roll(d));
        return "deform";
    case 4:
        rig_material(r, "red", &paint);
        return "recolour";
    case 5:
        l = rig_point(at, 100.0 * roll(d));
        rig_light(r, lamps[which % 2], &l);
        return "move a lamp";
    case 6:
        l = rig_quad(rig_v(0, 2.9, 0), rig_v(0.3, 0, 0), rig_v(0, 0, 0.3), 1000.0 * roll(d));
        l.on = roll(d) > 0.3;
        rig_light(r, "panel", &l);
        return "relight";
    default:
        rig_object(r, "crate", "crate", "red", rig_v(at.x, 0.5, at.z));
        return "move the crate";
    }
}

/* Records of all ages: each edit is followed by a look at some of them. */
static void edit_at_random(uint64_t seed, bool immediate, uint32_t n_edits)
{
    struct bench b;
    struct dice d = {seed};
    bool there[4] = {false};
    struct lum_cache_key key = key_of(&lum_cache_temporal, 64, 3);
    uint64_t removed = 0;
    bench_begin(&b, &key);
    stage(&b);
    put_tent(&b.rig, 0.5);
    put_board(&b, corner);
    lamp(&b, "l0", 0.5, 2.2, 0.7, 80);
    publish(&b);
    b.cache->immediate = immediate;
    add_seen_records(&b, place(&b, -0.5, 1.5, 0.5), 100, 11);
    build_and_insert(&b, 0);
    for (uint32_t i = 0; i < n_edits; i++) {
        char what[96];
        uint32_t before = n_left(&b), n_together = 1 + (uint32_t)(roll(&d) * 3.0);
        const char *name = "";
        for (uint32_t k = 0; k < n_together; k++)
            name = edit(&b.rig, &d, there);
        publish(&b);
        snprintf(what, sizeof what, "seed %llu, edit %u (%s)", (unsigned long long)seed, i, name);
        uint32_t first = (uint32_t)(roll(&d) * b.n), n = (uint32_t)(roll(&d) * 40.0);
        refresh(&b, first, first + n > b.n ? b.n - first : n);
        if (i % 8 == 7)
            refresh(&b, 0, b.n);
        assert_as_built(&b, what);
        removed += before - n_left(&b);
        if (b.n < MAX_RECORDS - 8 && i % 8 == 0) {
            uint32_t old = b.n;
            add_seen_records(&b, place(&b, -0.5, 1.5, 0.5), 4, 100 + i);
            build_and_insert(&b, old);
        }
        RIG_OK(lum_store_end_frame(b.cache->store, &err));
    }
    struct lum_instant_counts c = lum_cache_temporal_counts(b.cache);
    assert_true(c.vpl_rays > 0 && c.mover_rays > 0 && c.box_tests > c.scene_rays && c.scene_rays > 0);
    assert_true(c.removed > 0 && removed > 0 && n_left(&b) > 20);
    bench_end(&b);
}

static void after_any_edits_records_are_as_built(void **state)
{
    (void)state;
    edit_at_random(1, false, 300);
    edit_at_random(2, false, 200);
    edit_at_random(3, true, 100);
}

/* ---- ageing ---- */

static void records_that_nobody_looks_at_are_dropped(void **state)
{
    (void)state;
    struct bench b;
    begin_stage(&b, corner, false);
    uint32_t n = b.n;
    for (uint32_t i = 0; i < 200; i++) {
        put_board(&b, i % 2 ? corner : outside);
        publish(&b);
        refresh(&b, 0, n / 2); /* the view */
    }
    assert_true(n_left(&b) >= n / 2 && lum_store_count(b.cache->store) == n_left(&b));
    for (uint32_t i = n / 2; i < n; i++)
        assert_null(b.records[i]);
    assert_int_equal(lum_cache_temporal_counts(b.cache).aged, n - n / 2);
    assert_as_built(&b, "those that somebody looks at");
    bench_end(&b);
}

/* ---- memory ---- */

/* Whatever allocation fails while a change is noted: the cache stays usable, and what is in it is true. */
static void memory_may_be_short(void **state)
{
    (void)state;
    for (uint64_t k = 1; k < 40; k++) {
        struct bench b;
        struct lum_counters counters = {0};
        begin_stage(&b, outside, k % 2 == 0);
        put_board(&b, corner);
        rig_commit(&b.rig);
        struct lum_cache_update update = {b.rig.snapshot, NULL, &counters};
        struct lum_cache_record *stale[MAX_RECORDS];
        uint32_t n = 0;
        lum_alloc_fail_after(k);
        enum lum_status status = lum_cache_update(b.cache, &update, NULL);
        for (uint32_t i = 0; i < b.n; i++)
            if (!b.cache->store || !lum_store_at(b.cache->store, b.records[i]->index))
                b.records[i] = NULL;
            else if (lum_cache_is_stale(b.cache, b.records[i]))
                stale[n++] = b.records[i];
        struct lum_cache_job job = job_of(&b, stale, n, &counters);
        if (n)
            b.cache->key.kind->refresh(&job);
        lum_alloc_fail_after(0);
        assert_true(status == LUM_OK || n_left(&b) == 0);
        if (status == LUM_OK)
            assert_as_built(&b, "short of memory");
        RIG_OK(lum_cache_update(b.cache, &update, &err));
        bench_end(&b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_record_is_the_sum_of_its_vpls),
        cmocka_unit_test(built_in_scenes_are_sums_too),
        cmocka_unit_test(animations_leave_records_as_built),
        cmocka_unit_test(an_occluder_enters_and_leaves),
        cmocka_unit_test(what_is_taken_away_is_not_traced),
        cmocka_unit_test(paths_of_vpls_are_blocked_and_freed),
        cmocka_unit_test(records_on_what_moves_are_removed),
        cmocka_unit_test(what_went_and_came_back_costs_nothing_twice),
        cmocka_unit_test(light_that_changes_traces_no_ray),
        cmocka_unit_test(a_lamp_that_was_off_is_asked_when_it_shines),
        cmocka_unit_test(the_first_light_may_come_after_the_records),
        cmocka_unit_test(after_any_edits_records_are_as_built),
        cmocka_unit_test(records_that_nobody_looks_at_are_dropped),
        cmocka_unit_test(memory_may_be_short),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
