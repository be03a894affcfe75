/* The cache of `live`: after any edits, what a record holds is what it would hold if it were built now; and what an
 * edit costs.
 *
 * Records lie where rays from the middle of the room meet something. Pictures are not looked at here. */
#include "tests/support/rig.h"

#include "core/cache/cache.h"
#include "core/cache/kind.h"
#include "core/cache/proximity.h"
#include "core/cache/weight.h"
#include "core/math/sampler.h"
#include "core/pass/pass.h"
#include "core/scene/surface.h"

#define N_VPLS 100u /* not a multiple of 16, nor of 64 */
#define N_RECORDS 96u

struct bed {
    struct rig r;
    struct lum_caches *caches;
    struct lum_cache *cache;
    struct lum_counters counters;
    struct lum_cache_record *records[N_RECORDS]; /* NULL: to be placed */
    uint32_t seed;                               /* of the next random number */
};

static uint32_t random_below(struct bed *b, uint32_t n)
{
    return (uint32_t)((uint64_t)lum_hash_u32(b->seed++) * n >> 32);
}

static double random_between(struct bed *b, double lo, double hi)
{
    return lo + (hi - lo) * lum_hash_u32(b->seed++) * 0x1p-32;
}

static void bed_begin(struct bed *b, uint32_t seed)
{
    *b = (struct bed){.seed = seed * 1000003u};
    rig_begin(&b->r, 2);
    struct lum_cache_key key = {.kind = &lum_cache_live,
                                .storage = LUM_STORAGE_WAITFREE,
                                .n_vpls = N_VPLS,
                                .max_bounces = 4,
                                .accuracy = 0.5f,
                                .media = true};
    RIG_OK(lum_caches_create(2, &b->caches, &err));
    RIG_OK(lum_cache_acquire(b->caches, &key, &b->cache, &err));
}

static void bed_end(struct bed *b)
{
    assert_int_equal(b->counters.bad_rays, 0);
    assert_int_equal(b->counters.nonfinite, 0);
    lum_cache_release(b->caches, b->cache);
    lum_caches_destroy(b->caches);
    rig_end(&b->r);
}

/* What was removed is free to be placed again. */
static void forget_removed(struct bed *b)
{
    for (uint32_t i = 0; i < N_RECORDS; i++) {
        bool there = false;
        for (uint32_t k = 0; k < lum_store_limit(b->cache->store) && b->records[i]; k++)
            there = there || lum_store_at(b->cache->store, k) == b->records[i];
        b->records[i] = there ? b->records[i] : NULL;
    }
}

/* Publishes the edits; the cache learns of them. */
static void bed_commit(struct bed *b)
{
    rig_commit(&b->r);
    struct lum_cache_update u = {b->r.snapshot, b->r.pool, &b->counters};
    RIG_OK(lum_cache_update(b->cache, &u, &err));
    forget_removed(b);
    RIG_OK(lum_store_end_frame(b->cache->store, &err));
}

static struct lum_cache_job job_of(struct bed *b, struct lum_cache_record *const *records, uint32_t n)
{
    return (struct lum_cache_job){.cache = b->cache,
                                  .snapshot = b->r.snapshot,
                                  .records = records,
                                  .n = n,
                                  .pixel = 0.002f,
                                  .counters = &b->counters};
}

/* A ray from the middle of the scene. False: it meets nothing that scatters. */
static bool find_surface(struct bed *b, struct lum_surface *ret_surface)
{
    struct lum_rays rays;
    struct lum_hits hits;
    rays.n = 0;
    float z = (float)random_between(b, -1, 1), angle = (float)random_between(b, 0, 6.283), rim = sqrtf(1.0f - z * z);
    struct lum_vec3 o = {random_below(b, 2) ? 1.0f : -1.0f, (float)random_between(b, -0.1, 0.1), 0.0f};
    lum_rays_push(&rays, o, lum_v3(rim * cosf(angle), rim * sinf(angle), z), INFINITY);
    struct lum_trace trace = lum_trace_of(b->r.snapshot, &b->counters);
    lum_trace_closest(&trace, &rays, &hits);
    if (hits.object[0] == LUM_NO_OBJECT)
        return false;
    lum_snapshot_surface(b->r.snapshot, &hits, 0, lum_rays_direction(&rays, 0), ret_surface);
    return ret_surface->instance != LUM_NO_OBJECT;
}

/* Fills the free places with new records. */
static void bed_place(struct bed *b)
{
    struct lum_cache_record *fresh[N_RECORDS];
    uint32_t n = 0;
    for (uint32_t i = 0; i < N_RECORDS; i++) {
        struct lum_surface s;
        if (b->records[i] || !find_surface(b, &s))
            continue;
        struct lum_cache_record *record = lum_store_new(b->cache->store, 0);
        assert_non_null(record);
        record->p = s.p, record->n = s.ns, record->ng = s.ng;
        record->object = lum_hash64_text(b->r.snapshot->instances[s.instance].id);
        b->records[i] = fresh[n++] = record;
    }
    struct lum_cache_job job = job_of(b, fresh, n);
    b->cache->key.kind->build(&job);
    for (uint32_t i = 0; i < n; i++)
        assert_true(lum_store_insert(b->cache->store, 0, fresh[i]));
}

/* Refreshes stale records, each with a chance of 1 in `of`. Returns the rays. */
static uint64_t bed_refresh(struct bed *b, uint32_t of)
{
    struct lum_cache_record *stale[N_RECORDS];
    uint32_t n = 0;
    for (uint32_t i = 0; i < N_RECORDS; i++)
        if (b->records[i] && lum_cache_is_stale(b->cache, b->records[i]) && random_below(b, of) == 0)
            stale[n++] = b->records[i];
    uint64_t before = b->counters.rays[LUM_RAY_INDIRECT_DIFFUSE];
    struct lum_cache_job job = job_of(b, stale, n);
    if (n > 0)
        b->cache->key.kind->refresh(&job);
    for (uint32_t i = 0; i < n; i++)
        assert_false(lum_cache_is_stale(b->cache, stale[i]));
    forget_removed(b);
    return b->counters.rays[LUM_RAY_INDIRECT_DIFFUSE] - before;
}

/* Every record that is up to date, against one that is built now at the same place. */
static void bed_check(struct bed *b, const char *when)
{
    struct lum_cache_record *scratch = lum_calloc(1, lum_cache_record_bytes(b->cache));
    assert_non_null(scratch);
    for (uint32_t i = 0; i < N_RECORDS; i++) {
        const struct lum_cache_record *got = b->records[i];
        if (!got || lum_cache_is_stale(b->cache, got))
            continue;
        scratch->p = got->p, scratch->n = got->n, scratch->ng = got->ng, scratch->object = got->object;
        struct lum_cache_job job = job_of(b, &scratch, 1);
        b->cache->key.kind->build(&job);
        if (memcmp(&got->irradiance, &scratch->irradiance, sizeof got->irradiance) != 0)
            fail_msg("%s: record %u at %g %g %g has %.9g %.9g %.9g, built anew %.9g %.9g %.9g", when, i,
                     (double)got->p.x, (double)got->p.y, (double)got->p.z, (double)got->irradiance.r,
                     (double)got->irradiance.g, (double)got->irradiance.b, (double)scratch->irradiance.r,
                     (double)scratch->irradiance.g, (double)scratch->irradiance.b);
    }
    lum_free(scratch);
}

/* ---- scenes ---- */

static void put_crate(struct bed *b, const char *id, struct lum_vec3d at)
{
    rig_object(&b->r, id, "crate", "red", at);
}

/* The room of the rig, with a slab in the air, a lamp that has a shape, and a bulb. */
static void furnish(struct bed *b)
{
    struct rig *r = &b->r;
    rig_room(r);
    rig_box(r, "slab", 0.6, 0.05, 0.6);
    rig_object(r, "slab", "slab", "white", rig_v(-0.8, 1.2, 0.4));
    struct lum_light_desc lamp = rig_quad(rig_v(0, 2.9, 0), rig_v(0.3, 0, 0), rig_v(0, 0, 0.3), 300);
    struct lum_light_desc bulb = rig_point(rig_v(-1.2, 0.5, 1.2), 40);
    rig_light(r, "lamp", &lamp);
    rig_light(r, "bulb", &bulb);
}

/* ---- the master test ---- */

static void edit_object(struct bed *b)
{
    char id[16];
    snprintf(id, sizeof id, "extra%u", random_below(b, 4));
    struct lum_vec3d at =
        rig_v(random_between(b, -1.5, 1.5), random_between(b, 0.5, 2.4), random_between(b, -1.5, 1.5));
    struct lum_error err = {0};
    switch (random_below(b, 4)) {
    case 0:
        put_crate(b, id, at); /* added, or moved */
        break;
    case 1:
        if (lum_scene_remove(b->r.scene, LUM_ENTITY_OBJECT, id, &err) != LUM_OK)
            put_crate(b, id, at); /* it was not there */
        break;
    case 2:
        rig_object(&b->r, "slab", "slab", "white", at);
        break;
    default: /* a step, as in a drag */
        rig_object(&b->r, "crate", "crate", "red", rig_v(0.5 + random_between(b, -0.1, 0.1), 0.5, -0.4));
    }
}

static void edit_light(struct bed *b)
{
    struct lum_light_desc bulb = rig_point(rig_v(-1.2, 0.5, 1.2), random_between(b, 1, 80));
    struct lum_light_desc lamp =
        rig_quad(rig_v(0, 2.9, 0), rig_v(0.3, 0, 0), rig_v(0, 0, 0.3), random_between(b, 1, 600));
    bulb.on = random_below(b, 3) > 0;
    bulb.color = lum_rgb(1, (float)random_between(b, 0.2, 1), (float)random_between(b, 0.1, 1));
    if (random_below(b, 3) == 0)
        bulb.position = rig_v(random_between(b, -1.5, 1.5), 0.7, 1.2);
    if (random_below(b, 4) == 0)
        lamp.position.x = random_between(b, -1, 1);
    rig_light(&b->r, random_below(b, 2) ? "bulb" : "lamp", random_below(b, 2) ? &bulb : &lamp);
}

static void edit_once(struct bed *b)
{
    switch (random_below(b, 8)) {
    case 0:
    case 1:
    case 2:
        edit_object(b);
        break;
    case 3:
    case 4:
    case 5:
        edit_light(b);
        break;
    case 6: { /* recoloured */
        struct lum_material_desc m = rig_diffuse((float)random_between(b, 0.2, 0.9));
        m.base_color.g *= 0.5f;
        rig_material(&b->r, random_below(b, 2) ? "red" : "white", &m);
        break;
    }
    default: /* deformed */
        rig_box(&b->r, "crate", 0.4, random_between(b, 0.2, 0.7), random_between(b, 0.2, 0.5));
    }
}

static void after_any_edits_as_if_built_now(void **state)
{
    (void)state;
    for (uint32_t seed = 1; seed <= 4; seed++) {
        struct bed b;
        bed_begin(&b, seed);
        furnish(&b);
        bed_commit(&b);
        uint64_t n_kept = 0;
        for (uint32_t edit = 0; edit < 250; edit++) {
            char when[64];
            snprintf(when, sizeof when, "seed %u, after edit %u", seed, edit);
            bed_place(&b);
            edit_once(&b);
            bed_commit(&b);
            for (uint32_t i = 0; i < N_RECORDS; i++)
                n_kept += b.records[i] != NULL;
            bed_refresh(&b, 1 + edit % 5); /* some fall behind, by up to many epochs */
            if (edit % 10 == 9)
                bed_check(&b, when);
        }
        /* or the test would have looked at new records only */
        assert_true(n_kept > 250u * N_RECORDS / 4);
        bed_end(&b);
    }
}

/* ---- what edits cost ---- */

static void bed_settle(struct bed *b)
{
    furnish(b);
    bed_commit(b);
    for (int k = 0; k < 4; k++)
        bed_place(b);
}

static void at_rest_and_in_other_light_no_ray(void **state)
{
    (void)state;
    struct bed b;
    bed_begin(&b, 11);
    bed_settle(&b);
    struct lum_counters before = b.counters;
    bed_commit(&b); /* nothing */
    assert_int_equal(bed_refresh(&b, 1), 0);
    struct lum_light_desc bulb = rig_point(rig_v(-1.2, 0.5, 1.2), 4);
    rig_light(&b.r, "bulb", &bulb); /* dimmed */
    bed_commit(&b);
    assert_int_equal(bed_refresh(&b, 1), 0);
    bed_check(&b, "dimmed");
    b.counters = before;
    bulb.on = false;
    rig_light(&b.r, "bulb", &bulb);
    bed_commit(&b);
    assert_int_equal(bed_refresh(&b, 1), 0);
    bulb.on = true;
    bulb.color = lum_rgb(1, 0.5f, 0.25f);
    rig_light(&b.r, "bulb", &bulb);
    bed_commit(&b);
    assert_int_equal(bed_refresh(&b, 1), 0);
    assert_int_equal(b.counters.rays[LUM_RAY_VPL], before.rays[LUM_RAY_VPL]);
    struct lum_material_desc m = rig_diffuse(0.3f);
    rig_material(&b.r, "red", &m); /* recoloured: the VPLs are traced again, and lie where they were */
    bed_commit(&b);
    assert_int_equal(bed_refresh(&b, 1), 0);
    bed_check(&b, "recoloured");
    bed_end(&b);
}

/* Puts the box around where a mover was and is in place of both. */
static void sweep(struct lum_motion *motion)
{
    for (uint32_t m = 0; m < motion->n; m++) {
        struct lum_mover *v = &motion->movers[m];
        v->old_box = v->new_box = lum_bounds_join(&v->old_box, &v->new_box);
    }
}

/* Segments that may have changed by what moved, and rays that look around records near it. */
static uint64_t most_rays(struct bed *b, const struct lum_motion *motion)
{
    uint64_t n = 0;
    const struct lum_vpl_set *set = &b->cache->vpls;
    for (uint32_t i = 0; i < N_RECORDS; i++) {
        const struct lum_cache_record *r = b->records[i];
        if (!r)
            continue;
        struct lum_vec3 from = lum_ray_offset(r->p, r->ng);
        for (uint32_t k = 0; k < set->n; k++) {
            struct lum_vec3 p = {set->px[k], set->py[k], set->pz[k]}, d = lum_v3_sub(p, r->p);
            struct lum_vec3 v = {set->nx[k], set->ny[k], set->nz[k]};
            bool faces = lum_dot(d, r->n) > 0.0f && lum_dot(d, r->ng) > 0.0f && lum_dot(d, v) < 0.0f;
            n += faces && ((b->cache->moved[k / 64] >> k % 64 & 1u) || lum_motion_meets(motion, from, p));
        }
        for (uint32_t m = 0; m < motion->n; m++) { /* balls that meet a box: by the box around the ball */
            struct lum_vec3 lo = motion->movers[m].new_box.lo, hi = motion->movers[m].new_box.hi;
            n += r->p.x + r->radius >= lo.x && r->p.x - r->radius <= hi.x && r->p.y + r->radius >= lo.y &&
                         r->p.y - r->radius <= hi.y && r->p.z + r->radius >= lo.z && r->p.z - r->radius <= hi.z
                     ? 16
                     : 0;
        }
    }
    return n;
}

static void mover_traces_what_it_crosses(void **state)
{
    (void)state;
    struct bed b;
    bed_begin(&b, 12);
    bed_settle(&b);
    uint64_t sum = 0, whole = 0;
    for (uint32_t step = 1; step <= 20; step++) {
        const struct lum_snapshot *before = lum_snapshot_ref(b.r.snapshot);
        put_crate(&b, "crate", rig_v(0.5 - 0.02 * step, 0.5, -0.4));
        bed_commit(&b);
        struct lum_motion motion;
        lum_motion_between(before, b.r.snapshot, &motion);
        sweep(&motion);
        uint64_t most = most_rays(&b, &motion), got = bed_refresh(&b, 1);
        if (got > most)
            fail_msg("step %u: %llu rays, of %llu that may be needed", step, (unsigned long long)got,
                     (unsigned long long)most);
        sum += got;
        for (uint32_t i = 0; i < N_RECORDS; i++)
            whole += b.records[i] ? N_VPLS : 0;
        bed_check(&b, "moved");
        lum_snapshot_unref(before);
        bed_place(&b);
    }
    print_message("a small mover traced %.1f %% of all segments\n", 100.0 * (double)sum / (double)whole);
    assert_true(sum > 0);
    bed_end(&b);
}

static float distance_to(const struct lum_bounds *box, struct lum_vec3 p)
{
    struct lum_vec3 out = lum_v3_max(lum_v3_sub(box->lo, p), lum_v3_sub(p, box->hi));
    return lum_length(lum_v3_max(out, lum_v3(0.0f, 0.0f, 0.0f)));
}

/* Records of which a ray meets what moves, out of reach of those that they serve. */
static uint32_t count_far(struct bed *b, const struct lum_motion *motion)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < N_RECORDS; i++) {
        const struct lum_cache_record *r = b->records[i];
        if (!r)
            continue;
        struct lum_receiver at = {r->p, r->n, r->ng};
        struct lum_around around;
        float reach = 0.25f * b->r.snapshot->lights.scene_radius, unused;
        bool near = false, meets = false;
        lum_proximity(b->r.snapshot, &at, 1, reach, &b->counters, &unused, &around);
        for (uint32_t m = 0; m < motion->n; m++) {
            near = near || distance_to(&motion->movers[m].new_box, r->p) <= LUM_TENT_SERVES * r->radius ||
                   distance_to(&motion->movers[m].old_box, r->p) <= LUM_TENT_SERVES * r->radius;
        }
        for (uint32_t k = 0; k < LUM_PROXIMITY_RAYS; k++)
            meets = meets ||
                    (around.met[k] != LUM_NO_OBJECT && strcmp(b->r.snapshot->instances[around.met[k]].id, "post") == 0);
        n += meets && !near;
    }
    return n;
}

/* Every ray that tells what is around a record tells of what is there now, also where a thing moves past that is out of
 * reach of who is served by it: a post that crosses the room, before records on its walls. */
static void rays_around_see_what_comes_far_away(void **state)
{
    (void)state;
    struct bed b;
    bed_begin(&b, 14);
    bed_settle(&b);
    rig_box(&b.r, "post", 0.15, 1.4, 0.15);
    uint32_t n_far = 0;
    for (uint32_t step = 0; step < 12; step++) {
        const struct lum_snapshot *before = lum_snapshot_ref(b.r.snapshot);
        rig_object(&b.r, "post", "post", "white", rig_v(-1.0 + 0.15 * step, 1.5, 0.9 - 0.1 * step));
        bed_commit(&b);
        struct lum_motion motion;
        lum_motion_between(before, b.r.snapshot, &motion);
        n_far += count_far(&b, &motion);
        bed_refresh(&b, 1);
        bed_check(&b, "post moved");
        lum_snapshot_unref(before);
    }
    assert_true(n_far > 0);
    bed_end(&b);
}

/* ---- walls ---- */

/* Two rooms with a wall of 2 cm between them; the lamp is in one. No record of the dark one sees anything, and none
 * serves the other side. */
static void no_light_through_a_thin_wall(void **state)
{
    (void)state;
    struct bed b;
    bed_begin(&b, 13);
    struct rig *r = &b.r;
    rig_room(r);
    rig_box(r, "wall", 0.01, 1.5, 2);
    rig_object(r, "wall", "wall", "white", rig_v(0, 1.5, 0));
    rig_object(r, "crate", "crate", "red", rig_v(1, 0.5, 0));
    rig_bulb(r, "bulb", rig_v(1.5, 2, 0.3), 40);
    bed_commit(&b);
    uint32_t n_dark = 0;
    const struct lum_weighting weighting = lum_weighting_of(0.5f);
    for (int k = 0; k < 3; k++)
        bed_place(&b);
    for (uint32_t i = 0; i < N_RECORDS; i++) {
        const struct lum_cache_record *record = b.records[i];
        if (!record || record->p.x >= 0.0f)
            continue;
        n_dark++;
        assert_true(lum_rgb_black(record->irradiance));
        for (uint32_t k = 0; k < N_RECORDS; k++)
            if (b.records[k] && b.records[k]->p.x > 0.0f)
                assert_true(lum_weight_of(&weighting, LUM_METRIC_TENTS, b.records[k], record->p, record->n) == 0.0f ||
                            lum_rgb_black(b.records[k]->irradiance) || fabsf(record->n.x) < 0.5f);
    }
    assert_true(n_dark > 0);
    bed_end(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(after_any_edits_as_if_built_now), cmocka_unit_test(at_rest_and_in_other_light_no_ray),
        cmocka_unit_test(mover_traces_what_it_crosses),    cmocka_unit_test(rays_around_see_what_comes_far_away),
        cmocka_unit_test(no_light_through_a_thin_wall),
    };
    return cmocka_run_group_tests_name("numeric.live_cache", tests, NULL, NULL);
}
