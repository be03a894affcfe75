/* What moved between two snapshots: each kind of edit, and that a shadow ray which meets no box has not changed. */
#include "core/scene/motion.h"

#include <stdio.h>
#include <string.h>

#include "core/accel/trace.h"
#include "core/math/sampler.h"
#include "core/scene/parts.h"
#include "core/scene/surface.h"
#include "core/scene/tables.h"
#include "tests/support/scene_fixture.h"

static void put_pose(struct lum_scene *scene, const char *id, double height)
{
    const double p[] = {-1, 0, -1, 1, 0, -1, 0, height, 0, 0, 0, 1};
    const uint32_t index[] = {0, 1, 2, 1, 3, 2, 3, 0, 2, 0, 3, 1};
    struct lum_mesh_desc d = {.positions = p, .indices = index, .n_vertices = 4, .n_triangles = 4, .deforming = true};
    CHECK_OK(lum_scene_put_mesh(scene, id, &d, err));
}

/* A wide floor, so that nothing that happens on it moves the placement of the scene. */
static void fill(struct lum_scene *scene)
{
    put_shape(scene, "ball", "sphere", 16, 8);
    put_shape(scene, "box", "box", 1, 1);
    put_pose(scene, "tent", 1.0);
    put_material(scene, "white");
    put_material(scene, "leaf");
    put_object(scene, "floor", "box", "white", scaled_at(20, 0, -20, 0));
    put_object(scene, "ball", "ball", "white", at(0, 1, 0));
    put_object(scene, "leaf", "box", "leaf", at(4, 1, 0));
    put_object(scene, "tent", "tent", "white", at(-4, 0, 0));
    struct lum_light_desc l = light_desc(&lum_light_kind_quad);
    put_light(scene, "panel", &l);
    l = light_desc(&lum_light_kind_point);
    put_light(scene, "bulb", &l);
}

static struct lum_motion between(const struct lum_snapshot *a, const struct lum_snapshot *b)
{
    struct lum_motion m;
    lum_motion_between(a, b, &m);
    return m;
}

/* Commits, and says what moved since *s, which becomes the new one. */
static struct lum_motion step(struct fixture *f, const struct lum_snapshot **s)
{
    const struct lum_snapshot *next = commit(f);
    struct lum_motion m = between(*s, next);
    lum_snapshot_unref(*s);
    *s = next;
    return m;
}

static void assert_holds(struct lum_vec3 lo, struct lum_vec3 hi, struct lum_vec3 p)
{
    assert_true(p.x > lo.x && p.x < hi.x && p.y > lo.y && p.y < hi.y && p.z > lo.z && p.z < hi.z);
}

static void a_moved_object_was_there_and_is_here(void **state)
{
    struct fixture *f = *state;
    fill(f->scene);
    const struct lum_snapshot *s = commit(f);
    put_object(f->scene, "ball", "ball", "white", at(2, 3, 1));
    struct lum_motion m = step(f, &s);
    assert_false(m.everything);
    assert_int_equal(m.n, 1);
    assert_true(m.movers[0].object == lum_hash64_text("ball"));
    assert_true(lum_motion_has(&m, lum_hash64_text("ball")));
    assert_false(lum_motion_has(&m, lum_hash64_text("tent")));
    assert_holds(m.movers[0].old_box.lo, m.movers[0].old_box.hi, to_scene(s, 0, 1, 0));
    assert_holds(m.movers[0].new_box.lo, m.movers[0].new_box.hi, to_scene(s, 2, 3, 1));
    assert_int_equal(m.movers[0].before, m.movers[0].now);
    assert_true(lum_motion_meets(&m, to_scene(s, -5, 1, 0), to_scene(s, 5, 1, 0)));
    assert_true(lum_motion_meets(&m, to_scene(s, 2, 3, 1), to_scene(s, 2, 3, 1)));
    assert_false(lum_motion_meets(&m, to_scene(s, -5, 1, 2), to_scene(s, 5, 1, 2)));
    assert_false(lum_motion_meets(&m, to_scene(s, -5, 1, 0), to_scene(s, -2, 1, 0))); /* ends before it */
    lum_snapshot_unref(s);
}

static void added_and_removed_objects(void **state)
{
    struct fixture *f = *state;
    fill(f->scene);
    const struct lum_snapshot *s = commit(f);
    put_object(f->scene, "cup", "ball", "white", at(1, 1, 5));
    struct lum_motion m = step(f, &s);
    assert_int_equal(m.n, 1);
    assert_int_equal(m.movers[0].before, LUM_NO_OBJECT);
    assert_string_equal(s->instances[m.movers[0].now].id, "cup");
    assert_true(m.movers[0].old_box.lo.x > m.movers[0].old_box.hi.x);
    struct lum_object_desc hidden = {
        .mesh = "ball", .material = "white", .local_to_world = at(1, 1, 5), .visible = false};
    CHECK_OK(lum_scene_put_object(f->scene, "cup", &hidden, err));
    m = step(f, &s);
    assert_int_equal(m.n, 1);
    assert_int_equal(m.movers[0].now, LUM_NO_OBJECT);
    CHECK_OK(lum_scene_remove(f->scene, LUM_ENTITY_OBJECT, "cup", err));
    m = step(f, &s);
    assert_int_equal(m.n, 0);
    lum_snapshot_unref(s);
}

/* Poses are put one after the other while their snapshots go, so that Embree's part of an old pose is used again. */
static void a_mesh_deforms(void **state)
{
    struct fixture *f = *state;
    fill(f->scene);
    const struct lum_snapshot *s = commit(f);
    for (int i = 0; i < 6; i++) {
        double before = i % 2 ? 3.0 : 1.0, now = i % 2 ? 1.0 : 3.0;
        put_pose(f->scene, "tent", now);
        struct lum_motion m = step(f, &s);
        assert_int_equal(m.n, 1);
        assert_holds(m.movers[0].old_box.lo, m.movers[0].old_box.hi, to_scene(s, -4, before, 0));
        assert_holds(m.movers[0].new_box.lo, m.movers[0].new_box.hi, to_scene(s, -4, now, 0));
        bool tall_now = m.movers[0].new_box.hi.y > to_scene(s, 0, 2, 0).y;
        assert_int_equal(tall_now, now > 2.0);
        assert_int_not_equal(tall_now, m.movers[0].old_box.hi.y > to_scene(s, 0, 2, 0).y);
    }
    lum_snapshot_unref(s);
}

static void put_leaf(struct lum_scene *scene, enum lum_alpha_mode mode, float alpha, float red)
{
    struct lum_material_desc m = lum_material_default();
    m.alpha_mode = mode;
    m.alpha = alpha;
    m.base_color = lum_rgb(red, 0.5f, 0.5f);
    CHECK_OK(lum_scene_put_material(scene, "leaf", &m, err));
}

static void a_material_counts_when_other_rays_pass(void **state)
{
    struct fixture *f = *state;
    fill(f->scene);
    const struct lum_snapshot *s = commit(f);
    put_leaf(f->scene, LUM_ALPHA_OPAQUE, 0.5f, 0.9f);
    assert_int_equal(step(f, &s).n, 0);
    put_leaf(f->scene, LUM_ALPHA_BLEND, 0.5f, 0.9f);
    struct lum_motion m = step(f, &s);
    assert_int_equal(m.n, 1);
    assert_true(m.movers[0].object == lum_hash64_text("leaf"));
    put_leaf(f->scene, LUM_ALPHA_BLEND, 0.5f, 0.2f);
    assert_int_equal(step(f, &s).n, 0);
    put_object(f->scene, "leaf", "box", "white", at(4, 1, 0));
    assert_int_equal(step(f, &s).n, 1);
    lum_snapshot_unref(s);
}

static void lights_count_by_their_shapes(void **state)
{
    struct fixture *f = *state;
    fill(f->scene);
    const struct lum_snapshot *s = commit(f);
    struct lum_light_desc panel = light_desc(&lum_light_kind_quad), bulb = light_desc(&lum_light_kind_point);
    panel.intensity *= 0.5;
    panel.camera_visible = !panel.camera_visible;
    put_light(f->scene, "panel", &panel);
    bulb.position.x += 1.0;
    put_light(f->scene, "bulb", &bulb);
    assert_int_equal(step(f, &s).n, 0);
    panel.position.x += 0.5;
    put_light(f->scene, "panel", &panel);
    struct lum_motion m = step(f, &s);
    assert_int_equal(m.n, 1);
    assert_true(m.movers[0].object == lum_hash64_text("panel"));
    assert_int_equal(m.movers[0].now, s->n_instances);
    CHECK_OK(lum_scene_remove(f->scene, LUM_ENTITY_LIGHT, "panel", err));
    m = step(f, &s);
    assert_int_equal(m.n, 1);
    assert_int_equal(m.movers[0].now, LUM_NO_OBJECT);
    lum_snapshot_unref(s);
}

/* Small balls, here and there on a grid of 10 by 10; step: how often they moved. */
static void put_crowd(struct lum_scene *scene, uint32_t n, uint32_t step)
{
    for (uint32_t i = 0; i < n; i++) {
        char id[20];
        snprintf(id, sizeof id, "crowd-%u", i);
        uint32_t k = (i * 37 + step * 11) % 100;
        put_object(scene, id, "ball", "white", scaled_at(0.05, 5 + 0.2 * (k % 10), 0.1, 5 + 0.2 * (k / 10.0)));
    }
}

static uint32_t n_objects(const struct lum_motion *m)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < m->n; i++)
        n += m->movers[i].n_objects;
    return n;
}

/* True when a box of the movers holds that of instance i of the snapshot. */
static bool any_holds(const struct lum_motion *m, const struct lum_snapshot *s, uint32_t i, bool before)
{
    struct lum_bounds b = lum_instance_bounds(&s->instances[i]);
    bool any = false;
    for (uint32_t k = 0; k < m->n; k++) {
        struct lum_vec3 lo = before ? m->movers[k].old_box.lo : m->movers[k].new_box.lo;
        struct lum_vec3 hi = before ? m->movers[k].old_box.hi : m->movers[k].new_box.hi;
        any =
            any || (b.lo.x > lo.x && b.lo.y > lo.y && b.lo.z > lo.z && b.hi.x < hi.x && b.hi.y < hi.y && b.hi.z < hi.z);
    }
    return any;
}

/* None is lost: each is within a box, of its own or around several. */
static void too_many_are_merged(void **state)
{
    static const uint32_t counts[] = {LUM_MOTION_MAX - 1, LUM_MOTION_MAX, LUM_MOTION_MAX + 1, 100};
    struct fixture *f = *state;
    fill(f->scene);
    const struct lum_snapshot *s = commit(f);
    for (uint32_t step_no = 0; step_no < LUM_ARRAY_LEN(counts); step_no++) {
        uint32_t n = counts[step_no];
        put_crowd(f->scene, n, step_no);
        const struct lum_snapshot *next = commit(f);
        struct lum_motion m = between(s, next);
        assert_false(m.everything);
        assert_int_equal(n_objects(&m), n);
        assert_int_equal(lum_motion_is_merged(&m), n > LUM_MOTION_MAX);
        assert_false(lum_motion_keeps_numbers(&m)); /* some came */
        for (uint32_t i = 0; i < next->n_instances; i++)
            if (strncmp(next->instances[i].id, "crowd", 5) == 0)
                assert_true(any_holds(&m, next, i, false));
        for (uint32_t i = 0; i < s->n_instances; i++)
            if (strncmp(s->instances[i].id, "crowd", 5) == 0) {
                assert_true(any_holds(&m, s, i, true));
                struct lum_bounds b = lum_instance_bounds(&s->instances[i]);
                assert_true(lum_motion_carries(&m, lum_hash64_text(s->instances[i].id), b.lo));
            }
        assert_false(lum_motion_carries(&m, lum_hash64_text("tent"), to_scene(s, -4, 0.5, 0)));
        assert_false(lum_motion_meets(&m, to_scene(s, -4, 0.5, 0), to_scene(s, 0, 1, 0)));
        lum_snapshot_unref(s);
        s = next;
    }
    put_crowd(f->scene, 100, 5);
    struct lum_motion m = step(f, &s);
    assert_true(lum_motion_is_merged(&m) && lum_motion_keeps_numbers(&m));
    put_object(f->scene, "far", "ball", "white", at(1e4, 0, 0));
    m = step(f, &s);
    assert_true(m.everything); /* placed anew: nothing is where it was */
    assert_true(lum_motion_has(&m, 1) && lum_motion_meets(&m, s->bounds_lo, s->bounds_lo));
    lum_snapshot_unref(s);
}

/* ---- the promise: what meets no box is as it was ---- */

static void edit(struct fixture *f, struct random_stream *r)
{
    static const char *const ids[] = {"ball", "leaf", "tent", "x", "y", "z"};
    static const char *const meshes[] = {"ball", "box", "tent"};
    uint32_t n = 1 + random_bits(r) % 3;
    for (uint32_t i = 0; i < n; i++) {
        const char *id = ids[random_bits(r) % 6];
        double x = 6 * random_double(r) - 3, y = 3 * random_double(r), z = 6 * random_double(r) - 3;
        struct lum_object_desc d = {.mesh = meshes[random_bits(r) % 3],
                                    .material = random_bits(r) % 2 ? "leaf" : "white",
                                    .local_to_world = scaled_at(0.3 + random_double(r), x, y, z),
                                    .visible = random_bits(r) % 5 != 0};
        CHECK_OK(lum_scene_put_object(f->scene, id, &d, err));
        if (random_bits(r) % 4 == 0)
            put_pose(f->scene, "tent", 0.5 + 2 * random_double(r));
        if (random_bits(r) % 8 == 0)
            put_leaf(f->scene, LUM_ALPHA_BLEND, 0.5f, 0.5f);
        struct lum_light_desc panel = light_desc(&lum_light_kind_quad);
        panel.position = (struct lum_vec3d){x, y + 1, z};
        if (random_bits(r) % 4 == 0)
            put_light(f->scene, "panel", &panel);
    }
}

struct shadow_rays {
    struct lum_rays rays;
    struct lum_vec3 from[LUM_RAY_BATCH], to[LUM_RAY_BATCH]; /* on the surfaces; the rays run between offset ones */
};

/* Between points of surfaces that were found by chance, as those of records and virtual point lights. */
static void find_rays(const struct lum_snapshot *s, struct random_stream *r, struct shadow_rays *out)
{
    struct lum_rays rays = {.n = LUM_RAY_BATCH};
    struct lum_hits hits;
    for (uint32_t i = 0; i < LUM_RAY_BATCH; i++) {
        struct lum_vec3 d = random_direction(r);
        d.y = -fabsf(d.y);
        set_ray(&rays, i, to_scene(s, 8 * random_double(r) - 4, 5, 8 * random_double(r) - 4), d);
    }
    trace(s, &rays, &hits);
    struct lum_vec3 p[LUM_RAY_BATCH], n[LUM_RAY_BATCH];
    for (uint32_t i = 0; i < LUM_RAY_BATCH; i++) {
        p[i] = to_scene(s, 0, 5 + 0.01 * i, 0), n[i] = lum_v3(0, 1, 0);
        struct lum_surface surface;
        if (hits.object[i] == LUM_NO_OBJECT)
            continue;
        lum_snapshot_surface(s, &hits, i, (struct lum_vec3){rays.dx[i], rays.dy[i], rays.dz[i]}, &surface);
        p[i] = surface.p, n[i] = surface.ng;
    }
    out->rays.n = LUM_RAY_BATCH;
    for (uint32_t i = 0; i < LUM_RAY_BATCH; i++) {
        uint32_t j = (i + 1) % LUM_RAY_BATCH;
        struct lum_vec3 a = lum_ray_offset(p[i], n[i]), b = lum_ray_offset(p[j], n[j]);
        set_ray(&out->rays, i, a, lum_v3_sub(b, a));
        out->rays.tfar[i] = 1.0f;
        out->from[i] = p[i];
        out->to[i] = p[j];
    }
}

static void occlusion(const struct lum_snapshot *s, const struct lum_rays *rays, uint8_t ret_occluded[LUM_RAY_BATCH])
{
    uint64_t bad = 0;
    struct lum_trace t = {.top = s->top, .alpha = s->has_alpha ? &s->alpha : NULL, .bad_rays = &bad};
    lum_trace_any(&t, rays, ret_occluded);
    assert_int_equal(bad, 0);
}

static float least(float a, float b)
{
    return a < b ? a : b;
}

/* Boxes whose corners are ends of two rays each: what one of the segments meets, the shaft does. */
static void what_a_shaft_misses_its_segments_do(void **state)
{
    struct fixture *f = *state;
    fill(f->scene);
    const struct lum_snapshot *s = commit(f);
    struct random_stream r = {11};
    uint32_t missed = 0, met = 0, needless = 0;
    edit(f, &r);
    const struct lum_snapshot *next = commit(f);
    struct lum_motion m = between(s, next);
    for (int round = 0; round < 20000; round++) {
        struct lum_vec3 p[4];
        for (int k = 0; k < 2; k++) {
            double x = 12 * random_double(&r) - 6, y = 4 * random_double(&r), z = 12 * random_double(&r) - 6;
            p[k] = to_scene(s, x, y, z);
            p[k + 2] = to_scene(s, x + random_double(&r), y - random_double(&r), z + random_double(&r));
        }
        struct lum_bounds box[2];
        for (int k = 0; k < 2; k++) {
            const struct lum_vec3 a = p[k], b = p[k + 2];
            box[k] = (struct lum_bounds){
                lum_v3(least(a.x, b.x), least(a.y, b.y), least(a.z, b.z)),
                lum_v3(-least(-a.x, -b.x), -least(-a.y, -b.y), -least(-a.z, -b.z)),
            };
        }
        bool any = false;
        for (int k = 0; k < 4; k++)
            any = any || lum_motion_meets(&m, p[k % 2 * 2], p[k / 2 * 2 + 1]); /* p[0] or p[2] to p[1] or p[3] */
        bool shaft = lum_motion_meets_between(&m, &box[0], &box[1]);
        missed += any && !shaft;
        met += shaft;
        needless += shaft && !any;
    }
    print_message("%u of 20000 shafts meet something, %u none of whose segments does\n", met, needless);
    assert_int_equal(missed, 0);
    assert_true(met > 100 && met < 19000 && needless < met / 2);
    lum_snapshot_unref(s);
    lum_snapshot_unref(next);
}

/* n_crowd: small objects that move, too. */
static void nothing_is_missed(struct fixture *f, uint32_t n_crowd)
{
    fill(f->scene);
    put_crowd(f->scene, n_crowd, 0);
    const struct lum_snapshot *s = commit(f);
    struct random_stream r = {7};
    uint64_t kept = 0, changed = 0, missed = 0;
    for (uint32_t round = 0; round < 200; round++) {
        edit(f, &r);
        put_crowd(f->scene, n_crowd, round);
        const struct lum_snapshot *next = commit(f);
        struct lum_motion m = between(s, next);
        assert_false(m.everything);
        struct shadow_rays sr;
        uint8_t before[LUM_RAY_BATCH], now[LUM_RAY_BATCH];
        find_rays(s, &r, &sr);
        occlusion(s, &sr.rays, before);
        occlusion(next, &sr.rays, now);
        for (uint32_t i = 0; i < LUM_RAY_BATCH; i++) {
            bool meets = lum_motion_meets(&m, sr.from[i], sr.to[i]);
            kept += !meets;
            changed += before[i] != now[i];
            missed += before[i] != now[i] && !meets;
        }
        lum_snapshot_unref(s);
        s = next;
    }
    print_message("%llu rays met no box, %llu changed, %llu of these met none\n", (unsigned long long)kept,
                  (unsigned long long)changed, (unsigned long long)missed);
    assert_int_equal(missed, 0);
    assert_true(kept > 1000 && changed > 1000);
    lum_snapshot_unref(s);
}

static void what_meets_no_box_is_as_it_was(void **state)
{
    nothing_is_missed(*state, 0);
}

static void nor_what_meets_none_of_many(void **state)
{
    nothing_is_missed(*state, 90);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup, fixture_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_moved_object_was_there_and_is_here),
        TEST(added_and_removed_objects),
        TEST(a_mesh_deforms),
        TEST(a_material_counts_when_other_rays_pass),
        TEST(lights_count_by_their_shapes),
        TEST(too_many_are_merged),
        TEST(what_meets_no_box_is_as_it_was),
        TEST(nor_what_meets_none_of_many),
        TEST(what_a_shaft_misses_its_segments_do),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
