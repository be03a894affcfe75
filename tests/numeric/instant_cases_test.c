/* Temporal instant caching: each of the five cases, alone; any edits against building anew; ageing; short memory. */
#include "tests/support/instant_bed.h"

static uint32_t n_left(const struct instant_bed *b)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < b->n; i++)
        n += b->records[i] != NULL;
    return n;
}

/* ---- the five cases ---- */

/* A room lit by one spot light, which makes all its VPLs on the wall at x = -2, around the height of 2 m; a pillar that
 * keeps some light from the floor for good; and a board that may stand outside, in the corner before the other wall, or
 * in the beam. Only one bounce: nothing else moves VPLs. */
static void stage(struct instant_bed *b)
{
    rig_room(&b->rig);
    rig_box(&b->rig, "board", 0.2, 0.2, 0.2);
    rig_box(&b->rig, "pillar", 0.1, 0.8, 0.1);
    rig_box(&b->rig, "peg", 0.1, 0.1, 0.1);
    rig_object(&b->rig, "pillar", "pillar", "white", rig_v(-1.0, 0.8, 1.0));
    rig_object(&b->rig, "peg", "peg", "white", rig_v(5, 5, 5)); /* so that the bounds of the scene stay as they are */
    rig_object(&b->rig, "peg2", "peg", "white", rig_v(-5, -5, -5));
    struct lum_light_desc spot = rig_point(rig_v(1.5, 2.5, -1.0), 200);
    spot.kind = &lum_light_kind_spot;
    spot.direction = rig_v(-3.5, -0.5, 0.5);
    spot.inner_cone_rad = 0.17;
    spot.outer_cone_rad = 0.25;
    rig_light(&b->rig, "spot", &spot);
}

static const double outside[3] = {4, 4, 0}, corner[3] = {1.2, 0.45, 1.2}, beam[3] = {-0.25, 2.25, -0.75};

static void put_board(struct instant_bed *b, const double at[3])
{
    rig_object(&b->rig, "board", "board", "red", rig_v(at[0], at[1], at[2]));
}

static void begin_stage(struct instant_bed *b, const double at[3], bool immediate)
{
    struct lum_cache_key key = instant_key(&lum_cache_temporal, 64, 1);
    bed_begin(b, &key);
    stage(b);
    put_board(b, at);
    bed_publish(b);
    b->cache->immediate = immediate;
    assert_true(b->cache->vpls.n_lit > 32);
    for (int i = 0; i < 8; i++)
        for (int j = 0; j < 8; j++)
            bed_add(b, rig_to_scene(&b->rig, -1.7 + 0.45 * i, 0.0, -1.6 + 0.43 * j), lum_v3(0, 1, 0));
    bed_insert(b, 0);
}

struct tally {
    uint64_t facing, dark; /* rays of visibility, and those of them that are in shadow */
};

static struct tally count_rays(const struct instant_bed *b)
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
static struct lum_instant_counts move_board(struct instant_bed *b, const double at[3])
{
    struct lum_instant_counts was = lum_cache_temporal_counts(b->cache), is;
    uint64_t rays;
    if (at)
        put_board(b, at);
    else
        RIG_OK(lum_scene_remove(b->rig.scene, LUM_ENTITY_OBJECT, "board", &err));
    bed_publish(b);
    rays = b->rays;
    bed_refresh(b, 0, b->n);
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
        struct instant_bed b;
        begin_stage(&b, outside, immediate);
        struct tally before = count_rays(&b);
        double sum = bed_total(&b);
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
        assert_true(bed_total(&b) < sum);
        bed_assert_as_built(&b, "occluded");

        c = move_board(&b, outside); /* case 4; and case 5: records under the board are in its box */
        assert_int_equal(c.vpl_rays, 0);
        assert_true(c.box_tests > 0 && c.scene_rays > 0 && c.scene_rays < c.box_tests);
        assert_int_equal(c.removed, 0); /* it stood 5 cm above the floor */
        assert_int_equal(count_rays(&b).dark, before.dark);
        assert_true(bed_total(&b) == sum);
        bed_assert_as_built(&b, "deoccluded");
        bed_end(&b);
    }
}

static void what_is_taken_away_is_not_traced(void **state)
{
    (void)state;
    struct instant_bed b;
    begin_stage(&b, corner, false);
    double sum = bed_total(&b);
    struct tally before = count_rays(&b);
    struct lum_instant_counts c = move_board(&b, NULL);
    assert_int_equal(c.mover_rays, 0);
    assert_int_equal(c.box_tests, before.dark);
    assert_true(c.scene_rays > 0 && bed_total(&b) > sum);
    bed_assert_as_built(&b, "taken away");
    before = count_rays(&b);
    c = move_board(&b, corner);
    assert_int_equal(c.mover_rays, before.facing);
    assert_int_equal(c.scene_rays, 0); /* it was nowhere */
    assert_true(bed_total(&b) == sum);
    bed_assert_as_built(&b, "put back");
    bed_end(&b);
}

static void paths_of_vpls_are_blocked_and_freed(void **state)
{
    for (int immediate = 0; immediate < 2; immediate++) {
        (void)state;
        struct instant_bed b;
        begin_stage(&b, outside, immediate);
        double sum = bed_total(&b);
        struct lum_instant_counts c = move_board(&b, beam); /* case 1 */
        uint32_t n_moved = b.cache->vpls.n_moved;
        assert_true(n_moved > 0 && n_moved < 64);
        assert_true(c.vpl_rays > 0 && c.vpl_rays <= (uint64_t)n_moved * b.n);
        bed_assert_as_built(&b, "blocked");
        assert_true(bed_total(&b) != sum);
        c = move_board(&b, outside); /* case 2 */
        assert_int_equal(b.cache->vpls.n_moved, n_moved);
        assert_true(c.vpl_rays > 0 && c.vpl_rays <= (uint64_t)n_moved * b.n);
        bed_assert_as_built(&b, "freed");
        assert_true(bed_total(&b) == sum);
        bed_end(&b);
    }
}

static void records_on_what_moves_are_removed(void **state)
{
    for (int immediate = 0; immediate < 2; immediate++) {
        (void)state;
        struct instant_bed b;
        begin_stage(&b, corner, immediate);
        bed_add(&b, rig_to_scene(&b.rig, corner[0], corner[1] + 0.2, corner[2]), lum_v3(0, 1, 0));  /* on it */
        bed_add(&b, rig_to_scene(&b.rig, corner[0], corner[1] + 0.25, corner[2]), lum_v3(0, 1, 0)); /* above it */
        bed_insert(&b, b.n - 2);
        uint32_t n = b.n, count = lum_store_count(b.cache->store);
        struct lum_instant_counts c = move_board(&b, outside);
        assert_int_equal(c.removed, 1);
        assert_null(b.records[n - 2]);
        assert_int_equal(n_left(&b), n - 1);
        assert_int_equal(lum_store_count(b.cache->store), count - 1);
        bed_assert_as_built(&b, "left behind");
        bed_end(&b);
    }
}

/* A record that was away for several changes pays for what became of them, and no more. */
static void what_went_and_came_back_costs_nothing_twice(void **state)
{
    (void)state;
    struct instant_bed b;
    begin_stage(&b, outside, false);
    struct tally before = count_rays(&b);
    double sum = bed_total(&b);
    for (int i = 0; i < 5; i++) {
        put_board(&b, i % 2 ? beam : corner);
        bed_publish(&b);
        assert_int_equal(b.rays, 0);
        bed_refresh(&b, 0, b.n / 2);
        bed_assert_as_built(&b, "half of them");
    }
    put_board(&b, outside);
    bed_publish(&b);
    struct lum_instant_counts was = lum_cache_temporal_counts(b.cache);
    bed_refresh(&b, b.n / 2, b.n - b.n / 2);
    struct lum_instant_counts is = lum_cache_temporal_counts(b.cache);
    assert_true(is.mover_rays - was.mover_rays < before.facing);
    assert_int_equal(is.scene_rays - was.scene_rays,
                     0); /* where it was when they were last true, nothing was in its shadow */
    bed_refresh(&b, 0, b.n);
    assert_true(bed_total(&b) == sum);
    bed_assert_as_built(&b, "all of them");
    bed_end(&b);
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
    struct instant_bed b;
    struct dice d = {seed};
    bool there[4] = {false};
    struct lum_cache_key key = instant_key(&lum_cache_temporal, 64, 3);
    uint64_t removed = 0;
    bed_begin(&b, &key);
    stage(&b);
    put_tent(&b.rig, 0.5);
    put_board(&b, corner);
    bed_lamp(&b, "l0", 0.5, 2.2, 0.7, 80);
    bed_publish(&b);
    b.cache->immediate = immediate;
    bed_add_seen(&b, rig_to_scene(&b.rig, -0.5, 1.5, 0.5), 100, 11);
    bed_insert(&b, 0);
    for (uint32_t i = 0; i < n_edits; i++) {
        char what[96];
        uint32_t before = n_left(&b), n_together = 1 + (uint32_t)(roll(&d) * 3.0);
        const char *name = "";
        for (uint32_t k = 0; k < n_together; k++)
            name = edit(&b.rig, &d, there);
        bed_publish(&b);
        snprintf(what, sizeof what, "seed %llu, edit %u (%s)", (unsigned long long)seed, i, name);
        uint32_t first = (uint32_t)(roll(&d) * b.n), n = (uint32_t)(roll(&d) * 40.0);
        bed_refresh(&b, first, first + n > b.n ? b.n - first : n);
        if (i % 8 == 7)
            bed_refresh(&b, 0, b.n);
        bed_assert_as_built(&b, what);
        removed += before - n_left(&b);
        if (b.n < BED_RECORDS - 8 && i % 8 == 0) {
            uint32_t old = b.n;
            bed_add_seen(&b, rig_to_scene(&b.rig, -0.5, 1.5, 0.5), 4, 100 + i);
            bed_insert(&b, old);
        }
        RIG_OK(lum_store_end_frame(b.cache->store, &err));
    }
    struct lum_instant_counts c = lum_cache_temporal_counts(b.cache);
    assert_true(c.vpl_rays > 0 && c.mover_rays > 0 && c.box_tests > c.scene_rays && c.scene_rays > 0);
    assert_true(c.removed > 0 && removed > 0 && n_left(&b) > 20);
    bed_end(&b);
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
    struct instant_bed b;
    begin_stage(&b, corner, false);
    uint32_t n = b.n;
    for (uint32_t i = 0; i < 200; i++) {
        put_board(&b, i % 2 ? corner : outside);
        bed_publish(&b);
        bed_refresh(&b, 0, n / 2); /* the view */
    }
    assert_true(n_left(&b) >= n / 2 && lum_store_count(b.cache->store) == n_left(&b));
    for (uint32_t i = n / 2; i < n; i++)
        assert_null(b.records[i]);
    assert_int_equal(lum_cache_temporal_counts(b.cache).aged, n - n / 2);
    bed_assert_as_built(&b, "those that somebody looks at");
    bed_end(&b);
}

/* ---- memory ---- */

/* Whatever allocation fails while a change is noted: the cache stays usable, and what is in it is true. */
static void memory_may_be_short(void **state)
{
    (void)state;
    for (uint64_t k = 1; k < 40; k++) {
        struct instant_bed b;
        struct lum_counters counters = {0};
        begin_stage(&b, outside, k % 2 == 0);
        put_board(&b, corner);
        rig_commit(&b.rig);
        struct lum_cache_update update = {b.rig.snapshot, NULL, &counters};
        struct lum_cache_record *stale[BED_RECORDS];
        uint32_t n = 0;
        lum_alloc_fail_after(k);
        enum lum_status status = lum_cache_update(b.cache, &update, NULL);
        for (uint32_t i = 0; i < b.n; i++)
            if (!b.cache->store || !lum_store_at(b.cache->store, b.records[i]->index))
                b.records[i] = NULL;
            else if (lum_cache_is_stale(b.cache, b.records[i]))
                stale[n++] = b.records[i];
        struct lum_cache_job job = bed_job(&b, stale, n, &counters);
        if (n)
            b.cache->key.kind->refresh(&job);
        lum_alloc_fail_after(0);
        assert_true(status == LUM_OK || n_left(&b) == 0);
        if (status == LUM_OK)
            bed_assert_as_built(&b, "short of memory");
        RIG_OK(lum_cache_update(b.cache, &update, &err));
        bed_end(&b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_occluder_enters_and_leaves),
        cmocka_unit_test(what_is_taken_away_is_not_traced),
        cmocka_unit_test(paths_of_vpls_are_blocked_and_freed),
        cmocka_unit_test(records_on_what_moves_are_removed),
        cmocka_unit_test(what_went_and_came_back_costs_nothing_twice),
        cmocka_unit_test(after_any_edits_records_are_as_built),
        cmocka_unit_test(records_that_nobody_looks_at_are_dropped),
        cmocka_unit_test(memory_may_be_short),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
