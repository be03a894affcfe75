/* After any edits, the records that a view looked at say what they would say if they were built now, bit for bit. */
#include <stdlib.h>

#include "core/cache/cache.h"
#include "core/cache/kind.h"
#include "core/pass/pass.h"
#include "tests/support/effort.h"
#include "tests/support/rig.h"

#define N_EDITS 60
#define N_OBJECTS 4u

/* Of the method's cache, as views have it. */
static uint32_t n_vpls_of(const struct lum_view_settings *set)
{
    return set->method->cache->spare > 0 ? set->n_vpls * set->method->cache->spare : set->n_vpls;
}

struct fuzz {
    struct rig rig;
    struct lum_caches *caches;
    uint64_t seed;
    char what[256]; /* the edits since the last check */
};

static uint32_t pick(struct fuzz *f, uint32_t n)
{
    f->seed = f->seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(f->seed >> 33) % n;
}

static double within(struct fuzz *f, double lo, double hi)
{
    return lo + (hi - lo) * pick(f, 1000) / 1000.0;
}

static struct lum_vec3d place(struct fuzz *f)
{
    return rig_v(within(f, -1.5, 1.5), within(f, 0.3, 2.5), within(f, -1.5, 1.0));
}

static void note(struct fuzz *f, const char *what)
{
    size_t n = strlen(f->what);
    snprintf(f->what + n, sizeof f->what - n, "%s ", what);
}

static void put_object(struct fuzz *f, bool visible)
{
    static const char *const meshes[] = {"crate", "plate"}, *const materials[] = {"red", "white", "cut", "glass"};
    char id[] = "thing0";
    id[5] = (char)('0' + pick(f, N_OBJECTS));
    struct lum_object_desc d = {.mesh = meshes[pick(f, 2)],
                                .material = materials[pick(f, 4)],
                                .local_to_world = lum_affined_identity(),
                                .visible = visible};
    struct lum_vec3d at = place(f);
    d.local_to_world.m[0][3] = at.x;
    d.local_to_world.m[1][3] = at.y;
    d.local_to_world.m[2][3] = at.z;
    RIG_OK(lum_scene_put_object(f->rig.scene, id, &d, &err));
    note(f, visible ? "put" : "hide");
}

static void remove_object(struct fuzz *f)
{
    char id[] = "thing0";
    id[5] = (char)('0' + pick(f, N_OBJECTS));
    if (lum_scene_remove(f->rig.scene, LUM_ENTITY_OBJECT, id, NULL) == LUM_OK)
        note(f, "remove");
}

static void change_mesh(struct fuzz *f)
{
    rig_box(&f->rig, "crate", within(f, 0.1, 0.5), within(f, 0.1, 0.5), within(f, 0.1, 0.5));
    note(f, "mesh");
}

static void change_material(struct fuzz *f)
{
    struct lum_material_desc m = rig_diffuse((float)within(f, 0.1, 0.9));
    m.unlit = pick(f, 6) == 0;
    rig_material(&f->rig, pick(f, 2) ? "red" : "white", &m);
    note(f, m.unlit ? "unlit" : "colour");
}

static void change_alpha(struct fuzz *f)
{
    struct lum_material_desc m = rig_diffuse(0.6f);
    m.alpha_mode = pick(f, 4) ? LUM_ALPHA_MASK : LUM_ALPHA_OPAQUE;
    m.alpha = (float)within(f, 0.2, 0.9);
    m.alpha_cutoff = 0.5f;
    rig_material(&f->rig, "cut", &m);
    note(f, "alpha");
}

static void change_light(struct fuzz *f)
{
    static const char *const ids[] = {"lamp", "panel", "spare"};
    uint32_t which = pick(f, 3);
    struct lum_light_desc l = rig_point(place(f), within(f, 10, 100));
    if (which == 1)
        l = rig_quad(place(f), rig_v(0.5, 0, 0), rig_v(0, 0, 0.5), within(f, 10, 100));
    l.on = pick(f, 4) != 0;
    rig_light(&f->rig, ids[which], &l);
    note(f, ids[which]);
}

static void remove_light(struct fuzz *f)
{
    if (lum_scene_remove(f->rig.scene, LUM_ENTITY_LIGHT, "spare", NULL) == LUM_OK)
        note(f, "no-spare");
}

static void change_medium(struct fuzz *f)
{
    struct lum_medium_desc m = {.sigma_s = lum_grey((float)within(f, 0, 0.2)), .sigma_a = lum_grey(0.05f)};
    m.everywhere = pick(f, 2);
    m.lo = rig_v(-1, 0, -1);
    m.hi = place(f);
    m.hi.x += 3.0;
    m.hi.z += 3.0;
    if (pick(f, 3)) {
        RIG_OK(lum_scene_put_medium(f->rig.scene, "fog", &m, &err));
        note(f, "fog");
    } else if (lum_scene_remove(f->rig.scene, LUM_ENTITY_MEDIUM, "fog", NULL) == LUM_OK) {
        note(f, "no-fog");
    }
}

static void edit(struct fuzz *f)
{
    switch (pick(f, 10)) {
    case 0:
    case 1:
    case 2:
        put_object(f, true);
        break;
    case 3:
        put_object(f, false);
        break;
    case 4:
        remove_object(f);
        break;
    case 5:
        change_mesh(f);
        break;
    case 6:
        change_material(f);
        break;
    case 7:
        change_alpha(f);
        break;
    case 8:
        change_light(f);
        break;
    default:
        pick(f, 2) ? change_medium(f) : remove_light(f);
        break;
    }
}

static void build(struct fuzz *f, struct lum_cache *cache, float pixel, struct lum_vec3 eye,
                  struct lum_cache_record *record)
{
    struct lum_counters counters = {0};
    cache->key.kind->build(&(struct lum_cache_job){.cache = cache,
                                                   .snapshot = f->rig.snapshot,
                                                   .records = &record,
                                                   .n = 1,
                                                   .pixel = pixel,
                                                   .eye = eye,
                                                   .counters = &counters});
}

/* The record as it would be, seen from as far away: one of as many pixels looks at as many virtual point lights. */
static void rebuild(struct fuzz *f, struct lum_cache *cache, const struct lum_cache_record *r,
                    struct lum_cache_record *ret)
{
    struct lum_vec3 eye = lum_v3_add(r->p, lum_v3(1.0f, 0.0f, 0.0f)); /* a pixel's size here is that at distance 1 */
    ret->p = r->p;
    ret->n = r->n;
    ret->ng = r->ng;
    ret->object = r->object;
    build(f, cache, 0.0f, eye, ret);
    if (r->footprint > 0.0f)
        build(f, cache, r->footprint * (ret->radius / r->radius), eye, ret);
}

static uint32_t check_cache(struct fuzz *f, struct lum_cache *cache)
{
    uint32_t n = 0, limit = lum_store_limit(cache->store);
    struct lum_cache_record *fresh = calloc(1, lum_cache_record_bytes(cache));
    assert_non_null(fresh);
    for (uint32_t i = 0; i < limit; i++) {
        const struct lum_cache_record *r = lum_store_at(cache->store, i);
        if (!r || lum_cache_is_stale(cache, r))
            continue;
        rebuild(f, cache, r, fresh);
        n++;
        if (memcmp(&r->irradiance, &fresh->irradiance, sizeof r->irradiance) != 0)
            fail_msg("%s, after %s: record %u at %g %g %g says %.9g %.9g %.9g, and built now %.9g %.9g %.9g",
                     cache->key.kind->name, f->what, i, (double)r->p.x, (double)r->p.y, (double)r->p.z,
                     (double)r->irradiance.r, (double)r->irradiance.g, (double)r->irradiance.b,
                     (double)fresh->irradiance.r, (double)fresh->irradiance.g, (double)fresh->irradiance.b);
    }
    free(fresh);
    return n;
}

static void furnish(struct fuzz *f)
{
    struct rig *r = &f->rig;
    rig_room(r);
    RIG_OK(lum_scene_remove(r->scene, LUM_ENTITY_OBJECT, "crate", &err));
    rig_square(r, "plate", 0.5);
    struct lum_material_desc cut = rig_diffuse(0.6f), glass = lum_material_default();
    glass.transmission = 1.0f;
    glass.roughness = 0.0f;
    rig_material(r, "cut", &cut);
    rig_material(r, "glass", &glass);
    rig_bulb(r, "lamp", rig_v(0.5, 2.5, 0), 100.0);
    rig_commit(r);
}

static void after_any_edits(const char *method, uint64_t seed)
{
    struct fuzz f = {.seed = seed};
    struct rig *r = &f.rig;
    rig_begin(r, 2);
    furnish(&f);
    r->settings.method = lum_method_find(method);
    r->settings.n_vpls = 64;
    r->settings.max_spp = 1;
    RIG_OK(lum_caches_create(2, &f.caches, &err));
    lum_view_share(r->view, f.caches);
    uint64_t n_checked = 0;
    for (int k = 0; k < N_EDITS; k++) {
        uint32_t n = 1 + pick(&f, 3);
        for (uint32_t i = 0; i < n; i++)
            edit(&f);
        rig_commit(r);
        if (pick(&f, 3) == 0)
            continue; /* nobody looks */
        rig_camera(r, rig_v(-1.7 + pick(&f, 3), 1.4, 1.8), rig_v(0.2, 0.9, -0.5), 60);
        const _Atomic bool cancel = pick(&f, 4) == 0;
        struct lum_pass_stats stats;
        if (lum_view_pass(r->view, r->snapshot, &r->settings, &cancel, &stats, NULL) != LUM_OK)
            continue;
        bool media = stats.demand.on[LUM_EFFECT_MEDIA] && lum_method_serves(r->settings.method, LUM_EFFECT_MEDIA);
        struct lum_cache_key key = {.kind = r->settings.method->cache,
                                    .storage = r->settings.storage,
                                    .n_vpls = n_vpls_of(&r->settings),
                                    .max_bounces = r->settings.max_depth - 1,
                                    .seed = r->settings.seed,
                                    .accuracy = r->settings.cache_accuracy,
                                    .media = media,
                                    .gloss = r->settings.method->cache->gloss};
        struct lum_cache *cache = NULL;
        RIG_OK(lum_cache_acquire(f.caches, &key, &cache, &err));
        if (cache->store && cache->snapshot == r->snapshot)
            n_checked += check_cache(&f, cache);
        lum_cache_release(f.caches, cache);
        f.what[0] = '\0';
    }
    print_message("%s, seed %llu: %llu records checked\n", method, (unsigned long long)seed,
                  (unsigned long long)n_checked);
    assert_true(n_checked > 1000); /* else this tests little */
    lum_view_destroy(r->view);
    r->view = NULL;
    lum_caches_destroy(f.caches);
    rig_end(r);
}

/* ---- more objects move than are told apart ---- */

#define N_CROWD (LUM_MOTION_MAX + 30)

static void put_crowd(struct rig *r, uint32_t step)
{
    for (uint32_t i = 0; i < N_CROWD; i++) {
        char id[20];
        snprintf(id, sizeof id, "crowd-%u", i);
        uint32_t k = (i * 37 + step * 11) % 100;
        rig_object(r, id, "grain", "red", rig_v(-1.5 + 0.1 * (k % 10), 0.03, -1.5 + 0.1 * (k / 10.0)));
    }
}

static struct lum_cache *acquire_cache(const struct fuzz *f)
{
    const struct lum_view_settings *set = &f->rig.settings;
    struct lum_cache_key key = {.kind = set->method->cache,
                                .storage = set->storage,
                                .n_vpls = n_vpls_of(set),
                                .max_bounces = set->max_depth - 1,
                                .seed = set->seed,
                                .accuracy = set->cache_accuracy,
                                .gloss = set->method->cache->gloss};
    struct lum_cache *cache = NULL;
    RIG_OK(lum_cache_acquire(f->caches, &key, &cache, &err));
    return cache;
}

/* What the view keeps is where nothing moved. */
static void assert_not_stale(struct rig *r, const char *what)
{
    struct lum_rgb *kept = rig_picture(r);
    lum_view_forget(r->view);
    rig_pass(r);
    rig_assert_picture(r, kept, what);
    lum_free(kept);
}

/* Records away from them outlast it, and say what they would if they were built now. */
static void a_crowd_moves(void **state)
{
    (void)state;
    static const char *const methods[] = {"live", "tic"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(methods); i++) {
        struct fuzz f = {.seed = 1};
        struct rig *r = &f.rig;
        rig_begin(r, 2);
        furnish(&f);
        rig_box(r, "grain", 0.03, 0.03, 0.03);
        put_crowd(r, 0);
        r->settings.method = lum_method_find(methods[i]);
        r->settings.n_vpls = 64;
        r->settings.max_spp = 1;
        r->settings.shadow_budget = 0; /* or shadows learn more from frame to frame */
        RIG_OK(lum_caches_create(2, &f.caches, &err));
        lum_view_share(r->view, f.caches);
        rig_commit(r);
        rig_pass(r);
        for (uint32_t step = 1; step <= 4; step++) {
            put_crowd(r, step);
            snprintf(f.what, sizeof f.what, "step %u of a crowd", step);
            rig_commit(r);
            struct lum_pass_stats s = rig_pass(r);
            struct lum_cache *cache = acquire_cache(&f);
            assert_true(check_cache(&f, cache) > 100);
            lum_cache_release(f.caches, cache);
            if (2 * s.cache.removed > s.cache.records)
                fail_msg("%s, %s: %llu records were removed, %llu are there", methods[i], f.what,
                         (unsigned long long)s.cache.removed, (unsigned long long)s.cache.records);
            assert_not_stale(r, f.what);
        }
        lum_view_destroy(r->view);
        r->view = NULL;
        lum_caches_destroy(f.caches);
        rig_end(r);
    }
}

static void live_records_are_as_built_now(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= TEST_EFFORT(3); seed++)
        after_any_edits("live", seed);
}

static void tic_records_are_as_built_now(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= TEST_EFFORT(3); seed++)
        after_any_edits("tic", seed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_crowd_moves),
        cmocka_unit_test(live_records_are_as_built_now),
        cmocka_unit_test(tic_records_are_as_built_now),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
