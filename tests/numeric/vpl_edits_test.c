/* What an edit may move of virtual point lights, and what it costs. */
#include "core/light/emit.h"
#include "core/math/sampler.h"
#include "core/scene/motion.h"
#include "tests/support/vpls.h"

static void dimming_traces_nothing(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_room(&r);
    struct lum_light_desc a = rig_point(rig_v(0, 2.5, 0), 100), b = rig_point(rig_v(1, 2, 0), 50),
                          c = rig_point(rig_v(-1, 2, 0), 20);
    c.on = false;
    rig_light(&r, "a", &a);
    rig_light(&r, "b", &b);
    rig_light(&r, "c", &c);
    rig_commit(&r);
    struct vpls v = {.n = 64, .max_bounces = 4};
    vpls_update(&v, &r);
    float flux[64], x[64];
    memcpy(flux, v.set.flux[0], sizeof flux);
    memcpy(x, v.set.px, sizeof x);
    const double factors[] = {2.0, 0.5, 0.0, 1.0};
    for (int k = 0; k < 8; k++) {
        a.intensity = 100 * factors[k % 4];
        b.on = k < 4;
        rig_light(&r, "a", &a);
        rig_light(&r, "b", &b);
        rig_commit(&r);
        vpls_update(&v, &r);
        assert_int_equal(v.counters.rays[LUM_RAY_VPL], 0);
        assert_int_equal(v.set.n_moved, 0);
        assert_memory_equal(x, v.set.px, sizeof x);
        uint32_t n_lit = 0;
        for (uint32_t i = 0; i < 64; i++) {
            float want = v.set.light[i] == 0 ? flux[i] * (float)factors[k % 4] : k < 4 ? flux[i] : 0.0f;
            assert_true(v.set.flux[0][i] == want);
            n_lit += want > 0.0f;
        }
        assert_int_equal(v.set.n_lit, n_lit);
        vpls_update(&v, &r); /* nothing new */
        assert_int_equal(v.counters.rays[LUM_RAY_VPL], 0);
    }
    /* b is off and keeps its slots: moving a moves none of b's */
    a.position.x = 0.3;
    rig_light(&r, "a", &a);
    rig_commit(&r);
    uint32_t light[64];
    memcpy(light, v.set.light, sizeof light);
    vpls_update(&v, &r);
    for (uint32_t i = 0; i < 64; i++) {
        assert_int_equal(v.set.light[i], light[i]);
        assert_true((v.set.px[i] != x[i]) == (light[i] == 0) || light[i] == 0);
        assert_true(light[i] == 0 || v.set.px[i] == x[i]);
    }
    assert_true(v.set.n_moved > 16 && v.set.n_moved < 48);
    c.on = true; /* never shone before: needs paths */
    rig_light(&r, "c", &c);
    rig_commit(&r);
    vpls_update(&v, &r);
    uint32_t of_c = 0;
    for (uint32_t i = 0; i < 64; i++)
        of_c += v.set.light[i] == 2;
    assert_true(of_c >= 10 && v.counters.rays[LUM_RAY_VPL] >= 64);
    lum_vpl_finish(&v.set);
    rig_end(&r);
}

/* Records draw by importance. What hardly shone beside another is all that is left when that goes out, so it is not to
 * hang on how bright it was: of two lights in the same places each has half of the slots that do not go by flux, a
 * quarter of all, and as large a part of the importance, but for its rounding to powers of 2, by up to sqrt(2) for each
 * of the two. */
static void dim_lights_are_important(void **state)
{
    (void)state;
    for (int ratio = 1; ratio <= 1000000; ratio *= 100) {
        struct rig r;
        rig_begin(&r, 1);
        rig_room(&r);
        struct lum_light_desc a = rig_point(rig_v(0, 2.5, 0), 100), b = rig_point(rig_v(0, 2.5, 0), 100.0 / ratio);
        rig_light(&r, "a", &a);
        rig_light(&r, "b", &b);
        rig_commit(&r);
        struct vpls v = {.n = 512, .max_bounces = 4};
        vpls_update(&v, &r);
        double of[2] = {0.0, 0.0};
        for (uint32_t i = 0; i < v.n; i++)
            if (v.set.light[i] < 2)
                of[v.set.light[i]] += (double)v.set.importance[i];
        if (!(of[1] / (of[0] + of[1]) > 0.25 / 2.0))
            fail_msg("1 : %d: the dim one has %g of the importance", ratio, of[1] / (of[0] + of[1]));
        lum_vpl_finish(&v.set);
        rig_end(&r);
    }
}

/* Metal of little roughness sends on what Fresnel says: from the middle of a room, whose walls light meets at cosines c
 * of 0.51 and more, f0 + (1 - f0) (1 - c)^5, that is between f0 and f0 + 0.2 * 0.49^5; the table of albedos is within
 * 0.01. So much of the lamp's flux is in the VPLs of the first bounce, or none of it. */
static void gloss_is_sent_on(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    struct lum_material_desc metal = rig_diffuse(0.8f);
    metal.metallic = 1.0f;
    metal.roughness = 0.1f;
    rig_material(&r, "metal", &metal);
    rig_box(&r, "room", 2, 2, 2);
    rig_object(&r, "room", "room", "metal", rig_v(0, 2, 0));
    struct lum_light_desc lamp = rig_point(rig_v(0, 2, 0), 1);
    rig_light(&r, "lamp", &lamp);
    rig_commit(&r);
    const struct lum_light_table *lights = &r.snapshot->lights;
    for (int gloss = 0; gloss < 2; gloss++) {
        struct vpls v = {.n = 512, .max_bounces = 4, .gloss = gloss};
        vpls_update(&v, &r);
        double flux = 0.0, emitted = lum_light_flux_unit(lights->lights, r.snapshot->bounds_lo, r.snapshot->bounds_hi);
        for (uint32_t i = 0; i < v.n / 2; i++) /* the first half are first bounces */
            flux += (double)v.set.flux_unit[0][i];
        if (gloss ? !(flux / emitted > 0.79 && flux / emitted < 0.8 + 0.2 * pow(0.43, 5.0) + 0.01) : flux != 0.0)
            fail_msg("with%s gloss %g of the flux is sent on", gloss ? "" : "out", flux / emitted);
        lum_vpl_finish(&v.set);
    }
    rig_end(&r);
}

/* One light: bounce b of path j is slot first(b) + j. A slot moves only if its path met the crate before or after. */
static void moving_an_object_moves_what_met_it(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_room(&r);
    rig_bulb(&r, "bulb", rig_v(0, 2.5, 0), 100);
    rig_commit(&r);
    struct vpls v = {.n = 512, .max_bounces = 5}; /* as many as there are levels */
    vpls_update(&v, &r);
    for (int step = 0; step < 4; step++) {
        struct vpls previous = {.n = v.n, .max_bounces = v.max_bounces};
        vpls_update(&previous, &r);
        rig_object(&r, "crate", "crate", "red", rig_v(0.5 - 0.2 * step, 0.5, -0.4));
        if (step == 3) /* another object, before the others in the table */
            rig_object(&r, "a", "crate", "red", rig_v(-1.2, 0.5, 1.2));
        rig_commit(&r);
        vpls_update(&v, &r);
        uint32_t first = 0, n_moved = 0;
        for (uint32_t b = 0; first < v.n; b++) {
            uint32_t n = b == 4 ? v.n - first : (v.n - first + 1) / 2;
            for (uint32_t j = 0; j < n; j++) {
                bool met = false;
                for (uint32_t before = 0, at = 0; before <= b; before++) { /* the path up to here */
                    const struct vpls *sets[] = {&previous, &v};
                    for (int k = 0; k < 2; k++) {
                        bool new_table = step == 3 && k == 1;
                        uint32_t object = sets[k]->set.object[at + j];
                        met = met || (new_table ? object < 2 : object == 0); /* crate (and a) come before room */
                    }
                    at += (v.n - at + 1) / 2;
                }
                uint32_t i = first + j;
                bool moved = v.set.px[i] != previous.set.px[i] || v.set.py[i] != previous.set.py[i] ||
                             v.set.pz[i] != previous.set.pz[i];
                n_moved += moved;
                if (moved && !met)
                    fail_msg("step %d: slot %u (bounce %u of path %u) moved, but its path never met the crate", step, i,
                             b + 1, j);
            }
            first += n;
        }
        assert_int_equal(v.set.n_moved, n_moved);
        assert_true(step == 0 ? n_moved == 0 : n_moved > 0 && n_moved < 256);
        lum_vpl_finish(&previous.set);
    }
    lum_vpl_finish(&v.set);
    rig_end(&r);
}

static void assert_same_set(const struct lum_vpl_set *a, const struct lum_vpl_set *b)
{
    const float *const x[] = {a->px, a->py, a->pz, a->nx, a->ny, a->nz, a->flux[0], a->flux[1], a->flux[2]};
    const float *const y[] = {b->px, b->py, b->pz, b->nx, b->ny, b->nz, b->flux[0], b->flux[1], b->flux[2]};
    assert_int_equal(a->n, b->n);
    assert_int_equal(a->n_lit, b->n_lit);
    assert_true(a->spacing == b->spacing);
    for (size_t k = 0; k < LUM_ARRAY_LEN(x); k++)
        assert_memory_equal(x[k], y[k], a->n * sizeof(float));
}

/* Whatever the number of threads, and the order of objects in the table. */
static void threads_and_order_do_not_matter(void **state)
{
    (void)state;
    const uint32_t threads[] = {1, 2, 3, 7};
    struct vpls first = {.n = 3000, .max_bounces = 6};
    for (size_t k = 0; k < 2 * LUM_ARRAY_LEN(threads); k++) {
        struct rig r;
        rig_begin(&r, threads[k / 2]);
        rig_room(&r);
        if (k % 2) { /* the same crate under a name that comes last */
            RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_OBJECT, "crate", &err));
            rig_object(&r, "z", "crate", "red", rig_v(0.5, 0.5, -0.4));
        }
        struct lum_light_desc a = rig_point(rig_v(0, 2.5, 0), 100),
                              b = rig_quad(rig_v(1, 2, 0), rig_v(0.3, 0, 0), rig_v(0, 0.2, 0.1), 50);
        rig_light(&r, "a", &a);
        rig_light(&r, "b", &b);
        rig_commit(&r);
        if (k == 0) {
            vpls_update(&first, &r);
        } else {
            struct vpls v = {.n = first.n, .max_bounces = first.max_bounces};
            vpls_update(&v, &r);
            assert_same_set(&v.set, &first.set);
            lum_vpl_finish(&v.set);
        }
        rig_end(&r);
    }
    lum_vpl_finish(&first.set);
}

/* ---- what is known from before ---- */

static void put(struct rig *r, const char *id, const char *mesh, float albedo, struct lum_vec3d at)
{
    struct lum_material_desc m = rig_diffuse(albedo);
    rig_material(r, id, &m);
    rig_object(r, id, mesh, id, at);
}

/* A room with an open front, crates in it, lit by a lamp, the sky, a sun that has a disc, a panel and a spot that
 * shines in from far outside, whose position is no part of the scene's extent. */
static void open_room(struct rig *r)
{
    rig_begin(r, 2);
    rig_box(r, "slab", 2, 0.1, 2);
    rig_box(r, "side", 0.1, 1.5, 2);
    rig_box(r, "back", 2, 1.5, 0.1);
    rig_box(r, "front", 2, 0.4, 0.1);
    rig_box(r, "crate", 0.2, 0.2, 0.2);
    put(r, "floor", "slab", 0.5f, rig_v(0, -0.1, 0));
    put(r, "roof", "slab", 0.7f, rig_v(0, 3.1, 0));
    put(r, "left", "side", 0.6f, rig_v(-2.1, 1.5, 0));
    put(r, "right", "side", 0.6f, rig_v(2.1, 1.5, 0));
    put(r, "back", "back", 0.6f, rig_v(0, 1.5, -2.1));
    put(r, "front", "front", 0.6f, rig_v(0, 0.4, 2.1));
    struct lum_light_desc lamp = rig_point(rig_v(0, 2.5, 0), 100), sky = light_of_kind(&lum_light_kind_environment);
    rig_light(r, "lamp", &lamp);
    rig_light(r, "sky", &sky);
    struct lum_light_desc sun = light_of_kind(&lum_light_kind_directional), spot = light_of_kind(&lum_light_kind_spot),
                          panel = rig_quad(rig_v(1, 2.8, 0), rig_v(0.3, 0, 0), rig_v(0, 0, 0.2), 50);
    sun.diameter_rad = 0.2;
    spot.position = (struct lum_vec3d){0, 6, 40}, spot.direction = (struct lum_vec3d){0, -0.1, -1};
    rig_light(r, "panel", &panel);
    rig_light(r, "spot", &spot);
    rig_light(r, "sun", &sun);
}

/* One of a few edits: crates are put where they may be, or taken away; a wall is painted; the lamp moves. */
static void edit_something(struct rig *r, uint32_t step)
{
    uint32_t h = lum_hash_u32(step);
    const char *crate = h & 1 ? "a crate" : "crate z"; /* before all others in the table, and after some */
    double x = (h >> 8) % 16 / 8.0 - 1.0, z = (h >> 16) % 16 / 2.0 - 1.0; /* inside, and before the open front */
    if (h % 7 == 0)
        assert_true(lum_scene_remove(r->scene, LUM_ENTITY_OBJECT, crate, NULL) != LUM_ERR_NOMEM); /* it may be gone */
    else if (h % 7 == 1)
        put(r, "back", "back", (float)(0.3 + 0.02 * (step % 20)), rig_v(0, 1.5, -2.1));
    else if (h % 7 == 2) {
        struct lum_light_desc lamp = rig_point(rig_v(0.5 * x, 2.5, 0), 100);
        rig_light(r, "lamp", &lamp);
    } else if (h % 7 == 3) {
        struct lum_light_desc sun = light_of_kind(&lum_light_kind_directional);
        sun.diameter_rad = 0.2;
        sun.direction.x += 0.1 * x;
        rig_light(r, "sun", &sun);
    } else
        put(r, crate, "crate", 0.5f, rig_v(x, 0.2 + (h >> 24) % 8 / 4.0, z));
}

/* Sets that are brought up to date by what is known are, bit by bit, those that nobody knew anything of. */
static void known_rays_change_nothing(void **state)
{
    (void)state;
    struct rig r;
    open_room(&r);
    rig_commit(&r);
    struct vpls v = {.n = 256, .max_bounces = 3, .tries = 4}, fresh = v;
    const struct lum_snapshot *before = NULL;
    uint64_t traced = 0, of = 0;
    uint32_t n_portals = 0;
    for (uint32_t step = 0; step < 60; step++) {
        struct lum_motion motion = {.everything = true};
        if (before)
            lum_motion_between(before, r.snapshot, &motion);
        struct lum_vpl_request rq = vpls_request(&v, &r);
        rq.since = &motion;
        rq.since_geometry = before ? before->versions.geometry : 0;
        memset(&v.counters, 0, sizeof v.counters);
        RIG_OK(lum_vpl_update(&v.set, &rq, &err));
        lum_vpl_finish(&fresh.set);
        vpls_update(&fresh, &r);
        assert_same_set(&v.set, &fresh.set);
        assert_memory_equal(&v.set.portals, &fresh.set.portals, sizeof v.set.portals);
        n_portals += v.set.portals.n > 0;
        if (step > 0 && fresh.counters.rays[LUM_RAY_VPL] > 0 && v.counters.rays[LUM_RAY_VPL] > 0)
            traced += v.counters.rays[LUM_RAY_VPL], of += fresh.counters.rays[LUM_RAY_VPL];
        if (step % 5 == 4) /* it did not hear of everything */
            put(&r, "a crate", "crate", 0.5f, rig_v(0.1 * (step % 10), 0.2, 0)), rig_commit(&r);
        lum_snapshot_unref(before);
        before = lum_snapshot_ref(r.snapshot);
        edit_something(&r, step);
        rig_commit(&r);
    }
    print_message("%.1f %% of the rays were traced, portals in %u of 60 steps\n", 100.0 * (double)traced / (double)of,
                  n_portals);
    assert_true(n_portals > 30 && traced < of / 10 * 7);
    lum_snapshot_unref(before);
    lum_vpl_finish(&v.set);
    lum_vpl_finish(&fresh.set);
    rig_end(&r);
}

/* ---- nothing there ---- */

static void nothing_comes_of_nothing(void **state)
{
    (void)state;
    struct lum_light_desc l = rig_point(rig_v(0, 0.5, 0), 100), dark = l,
                          sky = light_of_kind(&lum_light_kind_environment),
                          sun = light_of_kind(&lum_light_kind_directional);
    dark.intensity = 0;
    const struct {
        const char *what;
        const struct lum_light_desc *light;
        float albedo; /* -1: no object */
        uint64_t rays;
    } cases[] = {{"empty scene", NULL, -1, 0}, {"no light", NULL, 0.5f, 0}, {"light of no power", &dark, 0.5f, 0},
                 {"no surface", &l, -1, 64},   {"black walls", &l, 0, 64},  {"sky alone", &sky, -1, 64},
                 {"sun alone", &sun, -1, 64}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(cases); k++) {
        struct rig r;
        rig_begin(&r, 1);
        rig_box(&r, "box", 1, 1, 1);
        if (cases[k].albedo >= 0)
            rig_diffuse_object(&r, "box", "wall", cases[k].albedo, rig_v(0, 0, 0));
        if (cases[k].light)
            rig_light(&r, "lamp", cases[k].light);
        rig_commit(&r);
        struct vpls v = {.n = 64, .max_bounces = 1};
        vpls_update(&v, &r);
        struct lum_gather_points pts = {0};
        vpls_add_point(&pts, lum_v3(0, 0, 0), lum_v3(0, 1, 0));
        struct lum_rgb e;
        uint64_t rays = vpls_gather(&r, &v.set, no_bound, &pts, &e);
        if (v.set.n_lit || v.set.n_moved || v.set.spacing != 0.0f || rays || e.g != 0.0f ||
            v.counters.rays[LUM_RAY_VPL] != cases[k].rays)
            fail_msg("%s: %u VPLs, %llu and %llu rays", cases[k].what, v.set.n_lit,
                     (unsigned long long)v.counters.rays[LUM_RAY_VPL], (unsigned long long)rays);
        lum_vpl_finish(&v.set);
        rig_end(&r);
    }
}

/* Each allocation fails in turn: the set stays as it was, and the next try succeeds. */
static void failed_updates_change_nothing(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    rig_room(&r);
    struct lum_light_desc l = rig_point(rig_v(0, 2.5, 0), 100);
    rig_light(&r, "bulb", &l);
    rig_commit(&r);
    struct vpls v = {.n = 1000, .max_bounces = 2}, other = {.n = 1000, .max_bounces = 2};
    for (uint64_t k = 1;; k++) {
        struct lum_vpl_request rq = vpls_request(&v, &r);
        lum_alloc_fail_after(k);
        enum lum_status status = lum_vpl_update(&v.set, &rq, NULL);
        lum_alloc_fail_after(0);
        if (status == LUM_OK) {
            assert_true(k > 2);
            break;
        }
        assert_int_equal(status, LUM_ERR_NOMEM);
        assert_true(!v.set.valid && !v.set.memory);
    }
    vpls_update(&other, &r);
    l.position.x = 1;
    rig_light(&r, "bulb", &l);
    rig_commit(&r);
    for (uint64_t k = 1;; k++) {
        struct lum_vpl_request rq = vpls_request(&v, &r);
        lum_alloc_fail_after(k);
        enum lum_status status = lum_vpl_update(&v.set, &rq, NULL);
        lum_alloc_fail_after(0);
        if (status == LUM_OK)
            break;
        assert_same_set(&v.set, &other.set);
    }
    assert_int_equal(v.set.n_moved, 1000);
    lum_vpl_finish(&v.set);
    lum_vpl_finish(&v.set); /* a zeroed one */
    lum_vpl_finish(&other.set);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(dimming_traces_nothing),
        cmocka_unit_test(dim_lights_are_important),
        cmocka_unit_test(gloss_is_sent_on),
        cmocka_unit_test(moving_an_object_moves_what_met_it),
        cmocka_unit_test(threads_and_order_do_not_matter),
        cmocka_unit_test(known_rays_change_nothing),
        cmocka_unit_test(nothing_comes_of_nothing),
        cmocka_unit_test(failed_updates_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
