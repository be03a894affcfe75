/* Instant caching: records are direct sums of their VPLs, and light that changes traces no ray. */
#include "core/vpl/gather.h"
#include "tests/support/built_in.h"
#include "tests/support/instant_bed.h"

/* ---- a record is a direct sum ---- */

static void compare_with_gather(struct instant_bed *b, const char *what)
{
    struct lum_gather_points points = {.n_points = b->n};
    struct lum_rgb sums[BED_RECORDS] = {{0}};
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

static void a_record_is_the_sum_of_its_vpls(void **state)
{
    (void)state;
    const uint32_t counts[] = {1, 15, 16, 17, 256, 600};
    for (size_t i = 0; i < 2 * LUM_ARRAY_LEN(counts); i++) {
        struct instant_bed b;
        struct lum_cache_key key = instant_key(i % 2 ? &lum_cache_instant : &lum_cache_temporal, counts[i / 2], 4);
        key.media = i % 2;
        bed_begin(&b, &key);
        rig_room(&b.rig);
        bed_lamp(&b, "lamp", 1.0, 2.2, 0.7, 100);
        bed_lamp(&b, "off", -1.0, 2.2, 0.7, 0);
        if (key.media) {
            struct lum_medium_desc fog = {.sigma_s = lum_rgb(0.05f, 0.1f, 0.2f), .everywhere = true};
            RIG_OK(lum_scene_put_medium(b.rig.scene, "fog", &fog, &err));
        }
        bed_publish(&b);
        bed_add_seen(&b, rig_to_scene(&b.rig, -0.5, 1.5, 0.5), 200, 7);
        bed_insert(&b, 0);
        char what[64];
        snprintf(what, sizeof what, "%s, %u VPLs", key.kind->name, key.n_vpls);
        compare_with_gather(&b, what);
        for (uint32_t k = 0; k < b.n; k++) /* 6.2.5: a is in metres */
            assert_true(b.records[k]->radius == 0.25f * (float)b.rig.snapshot->norm.scale);
        bed_end(&b);
    }
}

/* ---- built-in scenes ---- */

/* A bench whose scene is a built-in one, in its first pose. */
static struct built_in *begin_built_in(struct instant_bed *b, const char *scene, const struct lum_cache_kind *kind)
{
    struct built_in *source = built_in_open(scene, 2);
    struct lum_cache_key key = instant_key(kind, 256, 7);
    struct lum_camera camera;
    memset(b, 0, sizeof *b);
    built_in_next_pose(source);
    b->rig.snapshot = built_in_snapshot(source);
    b->rig.pool = built_in_pool(source);
    key.media = b->rig.snapshot->n_media > 0;
    RIG_OK(lum_caches_create(2, &b->caches, &err));
    RIG_OK(lum_cache_acquire(b->caches, &key, &b->cache, &err));
    bed_tell_cache(b);
    RIG_OK(lum_snapshot_camera(b->rig.snapshot, NULL, &camera, &err));
    struct lum_vec3d p = camera.position, q = camera.target; /* cameras may stand outside of what they look into */
    bed_add_seen(b, rig_to_scene(&b->rig, 0.2 * p.x + 0.8 * q.x, 0.2 * p.y + 0.8 * q.y, 0.2 * p.z + 0.8 * q.z),
                 BED_RECORDS, 21);
    bed_insert(b, 0);
    return source;
}

static void end_built_in(struct instant_bed *b, struct built_in *source)
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
        struct instant_bed b;
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
        struct instant_bed b;
        struct built_in *source = begin_built_in(&b, scenes[i], &lum_cache_temporal);
        uint64_t rays = b.rays, updates = 0;
        for (int pose = 0; pose < 6 && built_in_next_pose(source); pose++) {
            b.rig.snapshot = built_in_snapshot(source);
            bed_tell_cache(&b);
            bed_refresh(&b, 0, b.n);
            updates += b.rays;
            assert_true(b.rays > 0);
            bed_assert_as_built(&b, scenes[i]);
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

/* ---- what traces no ray ---- */

static void light_that_changes_traces_no_ray(void **state)
{
    (void)state;
    struct instant_bed b;
    struct lum_cache_key key = instant_key(&lum_cache_temporal, 256, 3);
    bed_begin(&b, &key);
    rig_room(&b.rig);
    bed_lamp(&b, "a", 1.0, 2.2, 0.7, 100);
    bed_lamp(&b, "b", -1.0, 2.0, 0.9, 50);
    bed_publish(&b);
    bed_add_seen(&b, rig_to_scene(&b.rig, -0.5, 1.5, 0.5), 200, 3);
    bed_insert(&b, 0);
    double sum = bed_total(&b), half;

    bed_publish(&b); /* at rest */
    assert_int_equal(b.rays, 0);
    bed_refresh(&b, 0, b.n);
    assert_int_equal(b.rays, 0);
    assert_true(bed_total(&b) == sum);

    bed_lamp(&b, "a", 1.0, 2.2, 0.7, 50); /* dimmed: a power of two, so that every product is exact */
    bed_lamp(&b, "b", -1.0, 2.0, 0.9, 25);
    bed_publish(&b);
    assert_int_equal(b.rays, 0);
    bed_refresh(&b, 0, b.n);
    assert_int_equal(b.rays, 0);
    half = bed_total(&b);
    assert_true(half == 0.5 * sum);
    bed_assert_as_built(&b, "dimmed");

    struct lum_light_desc off = rig_point(rig_v(1.0, 2.2, 0.7), 50);
    off.on = false;
    rig_light(&b.rig, "a", &off); /* switched off, and on again */
    bed_publish(&b);
    bed_refresh(&b, 0, b.n);
    assert_int_equal(b.rays, 0);
    assert_true(bed_total(&b) < half);
    bed_assert_as_built(&b, "off");
    bed_lamp(&b, "a", 1.0, 2.2, 0.7, 50);
    bed_publish(&b);
    bed_refresh(&b, 0, b.n);
    assert_int_equal(b.rays, 0);
    assert_true(bed_total(&b) == half);
    bed_assert_as_built(&b, "on");

    struct lum_material_desc white = rig_diffuse(0.4f); /* VPLs stay where they are, and give less */
    rig_material(&b.rig, "white", &white);
    bed_publish(&b);
    bed_refresh(&b, 0, b.n);
    assert_int_equal(b.cache->vpls.n_moved, 0);
    assert_int_equal(b.rays, 0);
    assert_true(bed_total(&b) < half);
    bed_assert_as_built(&b, "painted");
    bed_end(&b);
}

/* What was never asked of a lamp that was off is asked when it shines; what moved meanwhile is known then. */
static void a_lamp_that_was_off_is_asked_when_it_shines(void **state)
{
    (void)state;
    struct instant_bed b;
    struct lum_cache_key key = instant_key(&lum_cache_temporal, 128, 2);
    bed_begin(&b, &key);
    rig_room(&b.rig);
    bed_lamp(&b, "a", 1.0, 2.2, 0.7, 100);
    bed_lamp(&b, "b", -1.0, 2.0, 0.9, 50);
    bed_publish(&b);
    struct lum_light_desc off = rig_point(rig_v(-1.0, 2.0, 0.9), 50);
    off.on = false;
    rig_light(&b.rig, "b", &off);
    bed_publish(&b);
    bed_add_seen(&b, rig_to_scene(&b.rig, -0.5, 1.5, 0.5), 100, 5);
    bed_insert(&b, 0);
    for (int i = 0; i < 3; i++) {
        if (i == 1)
            rig_object(&b.rig, "crate", "crate", "red", rig_v(0.4, 0.5, -0.4));
        off.on = i != 1;
        rig_light(&b.rig, "b", &off);
        bed_publish(&b);
        bed_refresh(&b, 0, b.n);
        assert_true(b.rays > 0);
        bed_assert_as_built(&b, "shines again");
    }
    bed_end(&b);
}

/* Nor is the bound of the geometry term known before the first VPL is. */
static void the_first_light_may_come_after_the_records(void **state)
{
    (void)state;
    struct instant_bed b;
    struct lum_cache_key key = instant_key(&lum_cache_temporal, 128, 2);
    bed_begin(&b, &key);
    rig_room(&b.rig);
    bed_publish(&b);
    bed_add_seen(&b, rig_to_scene(&b.rig, -0.5, 1.5, 0.5), 100, 5);
    bed_insert(&b, 0);
    assert_true(bed_total(&b) == 0.0 && b.rays == 0);
    bed_lamp(&b, "a", 1.0, 2.2, 0.7, 100);
    bed_publish(&b);
    bed_refresh(&b, 0, b.n);
    assert_true(b.cache->spacing == b.cache->vpls.spacing && b.cache->spacing > 0.0f);
    assert_true(bed_total(&b) > 0.0);
    bed_assert_as_built(&b, "the first light");
    bed_end(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_record_is_the_sum_of_its_vpls),
        cmocka_unit_test(built_in_scenes_are_sums_too),
        cmocka_unit_test(animations_leave_records_as_built),
        cmocka_unit_test(light_that_changes_traces_no_ray),
        cmocka_unit_test(a_lamp_that_was_off_is_asked_when_it_shines),
        cmocka_unit_test(the_first_light_may_come_after_the_records),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
