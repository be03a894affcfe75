/* Large meshes are shown with trees that were made in a hurry, and get better ones: no ray, and no view, sees which. Of
 * triangles that coincide it would: meshes with such keep what they have. */
#include <errno.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>
#include <semaphore.h>
#include <time.h>

#include "core/scene/scene.h"
#include "core/trace/rays.h"
#include "server/world/world.h"
#include "tests/support/scene_fixture.h"

int __real_pthread_create(pthread_t *thread, const pthread_attr_t *attr, void *(*run)(void *), void *arg);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attr, void *(*run)(void *), void *arg);

static bool no_thread;
static unsigned n_tries;

/* Of our libraries, not of Embree. */
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attr, void *(*run)(void *), void *arg)
{
    n_tries++;
    return no_thread ? EAGAIN : __real_pthread_create(thread, attr, run, arg);
}

struct bed {
    struct lum_world world;
    sem_t ready;
};

static void tell(void *user)
{
    sem_post(&((struct bed *)user)->ready);
}

static struct bed *bed_create(bool hurry)
{
    struct bed *b = calloc(1, sizeof *b);
    assert_non_null(b);
    assert_int_equal(sem_init(&b->ready, 0, 0), 0);
    assert_int_equal(lum_world_init(&b->world, 2, NULL, NULL, NULL), LUM_OK);
    if (hurry)
        lum_world_hurry(&b->world, &(struct lum_trees_ready){tell, b});
    return b;
}

static void bed_destroy(struct bed *b)
{
    lum_world_finish(&b->world);
    sem_destroy(&b->ready);
    free(b);
}

static void edit(struct bed *b, const char *text)
{
    struct lum_ops ops;
    struct lum_changes changes;
    struct lum_proto_error err;
    struct lum_error e;
    cJSON *json = cJSON_Parse(text);
    if (!json || !lum_ops_from_json(json, &ops, &err) ||
        !lum_world_apply(&b->world, &(struct lum_edit){"ann", &ops, NULL, 0}, &changes, &err))
        fail_msg("%s: %s", text, err.text);
    assert_int_equal(lum_world_commit(&b->world, &e), LUM_OK);
    lum_changes_finish(&changes);
    lum_ops_finish(&ops);
    cJSON_Delete(json);
}

/* 2 * 300 * (120 - 1) triangles, more than are called many; and a few. */
static void fill(struct bed *b)
{
    edit(b, "[{\"op\":\"add\",\"type\":\"material\",\"id\":\"white\"},"
            "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"large\",\"shape\":\"sphere\",\"segments\":[300,120]},"
            "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"small\",\"shape\":\"sphere\",\"segments\":[30,12]},"
            "{\"op\":\"add\",\"type\":\"object\",\"id\":\"o\",\"mesh\":\"large\",\"material\":\"white\"},"
            "{\"op\":\"add\",\"type\":\"object\",\"id\":\"p\",\"mesh\":\"small\",\"material\":\"white\","
            "\"transform\":{\"translate\":[3,0,0]}}]");
    assert_in_range(b->world.snapshot->n_triangles, LUM_SCENE_QUICK_TRIANGLES, UINT32_MAX);
}

static bool is_quick(const struct bed *b)
{
    assert_false(b->world.snapshot->instances[1].mesh->quick);
    return b->world.snapshot->instances[0].mesh->quick;
}

/* A grid across all of it, off the edges of triangles: along one, which of the two is hit hangs on the tree. */
static void look(const struct lum_snapshot *s, struct lum_hits *ret_hits)
{
    static struct lum_rays rays;
    struct lum_counters counters = {0};
    struct lum_trace trace = lum_trace_of(s, &counters);
    struct lum_vec3 lo = s->bounds_lo, hi = s->bounds_hi;
    rays.n = 0;
    for (uint32_t i = 0; i < LUM_RAY_BATCH; i++) {
        float x = ((float)(i % 16) + 0.31f) / 16.0f, y = ((float)(i / 16) + 0.31f) / 16.0f;
        struct lum_vec3 o = lum_v3(lo.x + x * (hi.x - lo.x), lo.y + y * (hi.y - lo.y), hi.z + 1.0f);
        lum_rays_push(&rays, o, lum_v3(0.0f, 0.0f, -1.0f), INFINITY);
    }
    memset(ret_hits, 0, sizeof *ret_hits);
    lum_trace_closest(&trace, &rays, ret_hits);
    for (uint32_t i = 0; i < rays.n; i++)
        if (ret_hits->object[i] == LUM_NO_OBJECT) /* the rest of a miss is undefined */
            ret_hits->t[i] = ret_hits->u[i] = ret_hits->v[i] = ret_hits->ngx[i] = ret_hits->ngy[i] = ret_hits->ngz[i] =
                0.0f,
            ret_hits->prim[i] = 0;
}

#define SIDE 200u
#define N_ONCE (2 * SIDE * SIDE)

/* Waves over a grid; `twice` of its triangles are there again, with corners of their own, turned: as seen from behind.
 */
static struct lum_triangles *relief(uint32_t twice)
{
    static const uint32_t corners[6][2] = {{0, 0}, {1, 0}, {0, 1}, {1, 0}, {1, 1}, {0, 1}};
    struct lum_triangles *t = lum_triangles_create(3 * (N_ONCE + twice), N_ONCE + twice);
    assert_non_null(t);
    for (uint32_t v = 0; v < 3 * N_ONCE; v++) {
        uint32_t cell = v / 6, x = cell % SIDE + corners[v % 6][0], y = cell / SIDE + corners[v % 6][1];
        t->positions[3 * v] = 0.01f * (float)x;
        t->positions[3 * v + 1] = 0.01f * (float)y;
        t->positions[3 * v + 2] = 0.05f * sinf(0.1f * (float)x) * cosf(0.13f * (float)y);
        t->indices[v] = v;
    }
    for (uint32_t i = 0; i < twice; i++)
        for (uint32_t k = 0; k < 3; k++) {
            uint32_t from = 3 * (N_ONCE - 1 - i) + (i + 2 - k) % 3, to = 3 * (N_ONCE + i) + k;
            memcpy(t->positions + 3 * to, t->positions + 3 * from, 3 * sizeof *t->positions);
            t->indices[to] = to;
        }
    return t;
}

/* Who builds aside is alone with it, so that it can be nice: in the meantime the process works no more than this thread
 * does. What else a process does by itself, as under a sanitizer, is little: less than an eighth. */
static void nobody_else_builds(void **state)
{
    _Atomic bool stop = false;
    struct lum_device *device;
    struct lum_accel_mesh *mesh;
    (void)state;
    assert_int_equal(lum_device_create(4, NULL, &device, NULL), LUM_OK);
    struct lum_triangles *t = relief(0);
    int64_t own_ns = lum_cpu_clock_ns();
    clock_t all = clock();
    for (int round = 0; round < 4; round++) {
        assert_int_equal(lum_accel_mesh_create(device, t, LUM_TREE_FAST, &stop, &mesh, NULL), LUM_OK);
        lum_accel_mesh_unref(mesh);
    }
    double own_s = 1e-9 * (double)(lum_cpu_clock_ns() - own_ns), all_s = (double)(clock() - all) / CLOCKS_PER_SEC;
    print_message("%.3f s, of them %.3f s by this thread\n", all_s, own_s);
    assert_true(all_s <= 1.125 * own_s);
    lum_triangles_unref(t);
    lum_device_destroy(device);
}

static void hits_are_the_same(void **state)
{
    static struct lum_hits quick, better;
    struct bed *b = bed_create(true);
    (void)state;
    fill(b);
    assert_true(is_quick(b));
    look(b->world.snapshot, &quick);
    const struct lum_snapshot *was = lum_snapshot_ref(b->world.snapshot);
    lum_world_turn_trees(&b->world);
    assert_ptr_equal(b->world.snapshot, was); /* it has only begun */
    sem_wait(&b->ready);
    lum_world_turn_trees(&b->world);
    assert_false(is_quick(b));
    assert_ptr_not_equal(b->world.snapshot->top, was->top);
    assert_true(lum_versions_equal(&b->world.snapshot->versions, &was->versions));
    assert_int_equal(b->world.snapshot->scene_rev, was->scene_rev);
    look(b->world.snapshot, &better);
    assert_memory_equal(&quick, &better, sizeof quick);
    uint32_t n_hit = 0;
    for (uint32_t i = 0; i < LUM_RAY_BATCH; i++)
        n_hit += better.object[i] != LUM_NO_OBJECT;
    assert_in_range(n_hit, LUM_RAY_BATCH / 4, LUM_RAY_BATCH);
    look(was, &better); /* who renders still has the old ones */
    assert_memory_equal(&quick, &better, sizeof quick);
    lum_snapshot_unref(was);
    was = b->world.snapshot;
    lum_world_turn_trees(&b->world);
    assert_ptr_equal(b->world.snapshot, was); /* nothing is left to be done */
    bed_destroy(b);
}

static bool coincide(const struct lum_triangles *t)
{
    bool any;
    assert_int_equal(lum_triangles_coincide(t, NULL, &any, NULL), LUM_OK);
    return any;
}

static void triangles_that_coincide_are_found(void **state)
{
    (void)state;
    for (uint32_t twice = 0; twice < 4; twice++) { /* one pair, too, and each order of corners */
        struct lum_triangles *t = relief(twice);
        assert_int_equal(coincide(t), twice > 0);
        lum_triangles_unref(t);
    }
    struct lum_triangles *t = relief(1); /* one corner is elsewhere; then as far as 0 is from -0 */
    float *x = t->positions + 3 * (3 * (size_t)N_ONCE), *y = x - 9;
    for (uint32_t k = 0; k < 3; k++)
        x[3 * k + 2] = 0.0f, y[3 * k + 2] = -0.0f;
    assert_true(coincide(t));
    x[2] = 1e-30f;
    assert_false(coincide(t));
    _Atomic bool stop = true;
    bool any;
    assert_int_equal(lum_triangles_coincide(t, &stop, &any, NULL), LUM_ERR_CANCELLED);
    lum_alloc_fail_after(1);
    assert_int_equal(lum_triangles_coincide(t, NULL, &any, NULL), LUM_ERR_NOMEM);
    lum_alloc_fail_after(0);
    lum_triangles_unref(t);
}

static void put_relief(struct bed *b, const struct lum_triangles *t, int number)
{
    char mesh[16], object[16];
    snprintf(mesh, sizeof mesh, "relief %d", number);
    snprintf(object, sizeof object, "o %d", number);
    struct lum_mesh_desc desc = {
        .positions_f = t->positions, .indices = t->indices, .n_vertices = t->n_vertices, .n_triangles = t->n_triangles};
    struct lum_error e;
    put_material(b->world.scene, "white");
    assert_int_equal(lum_scene_put_mesh(b->world.scene, mesh, &desc, &e), LUM_OK);
    put_object(b->world.scene, object, mesh, "white", at(0, 0, 0));
    assert_int_equal(lum_world_commit(&b->world, &e), LUM_OK);
}

/* Of triangles that coincide it is the tree's choice which is hit. So with some the tree stays, and is the same where
 * there is no hurry. */
static void what_coincides_is_seen_the_same(void **state)
{
    static const uint32_t twice[] = {0, 1, N_ONCE};
    static struct lum_hits first, then;
    (void)state;
    for (size_t i = 0; i < LUM_ARRAY_LEN(twice); i++) {
        struct bed *b = bed_create(true), *slow = bed_create(false);
        struct lum_triangles *t = relief(twice[i]);
        put_relief(b, t, 0);
        put_relief(slow, t, 0);
        look(b->world.snapshot, &first);
        look(slow->world.snapshot, &then);
        assert_memory_equal(&first, &then, sizeof first);
        struct lum_accel_mesh *was = b->world.snapshot->instances[0].mesh->accel;
        lum_world_turn_trees(&b->world);
        sem_wait(&b->ready);
        lum_world_turn_trees(&b->world);
        look(b->world.snapshot, &then);
        assert_memory_equal(&first, &then, sizeof first);
        assert_int_equal(b->world.snapshot->instances[0].mesh->accel == was, twice[i] > 0);
        lum_triangles_unref(t);
        bed_destroy(slow);
        bed_destroy(b);
    }
}

static void without_hurry_there_is_nothing_to_better(void **state)
{
    struct bed *b = bed_create(false);
    (void)state;
    fill(b);
    assert_false(is_quick(b));
    const struct lum_snapshot *was = b->world.snapshot;
    lum_world_turn_trees(&b->world);
    assert_ptr_equal(b->world.snapshot, was);
    bed_destroy(b);
}

static void what_is_gone_needs_none(void **state)
{
    struct bed *b = bed_create(true);
    (void)state;
    fill(b);
    lum_world_turn_trees(&b->world);
    edit(b, "[{\"op\":\"remove\",\"id\":\"o\"},{\"op\":\"remove\",\"id\":\"large\"}]");
    sem_wait(&b->ready);
    const struct lum_snapshot *was = lum_snapshot_ref(b->world.snapshot); /* it may be committed */
    lum_world_turn_trees(&b->world);
    assert_int_equal(b->world.snapshot->n_instances, 1);
    assert_ptr_equal(b->world.snapshot->top, was->top);
    lum_snapshot_unref(was);
    bed_destroy(b);
}

/* The end does not wait for trees, and nothing is left behind (which the address sanitizer sees). */
static void the_end_comes_at_any_time(void **state)
{
    (void)state;
    for (int turns = 0; turns < 3; turns++) {
        struct bed *b = bed_create(true);
        fill(b);
        for (int i = 0; i < turns; i++)
            lum_world_turn_trees(&b->world);
        bed_destroy(b);
    }
}

/* Neither is tried again on each turn, of which there are hundreds a second: only when there is another mesh. Then
 * those that waited get theirs, too. */
static void what_cannot_begin_waits_for_another(void **state)
{
    (void)state;
    for (int without_memory = 0; without_memory < 2; without_memory++) {
        struct bed *b = bed_create(true);
        fill(b);
        no_thread = !without_memory;
        n_tries = 0;
        for (int turn = 0; turn < 3; turn++) {
            lum_alloc_fail_after(without_memory);
            lum_world_turn_trees(&b->world);
            lum_alloc_fail_after(0);
        }
        assert_int_equal(n_tries, !without_memory);
        no_thread = false;
        lum_world_turn_trees(&b->world);
        assert_int_equal(n_tries, !without_memory);
        assert_true(is_quick(b));
        edit(b, "[{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"next\",\"shape\":\"sphere\",\"segments\":[300,120]}]");
        lum_world_turn_trees(&b->world);
        assert_int_equal(n_tries, !without_memory + 1);
        sem_wait(&b->ready);
        sem_wait(&b->ready);
        lum_world_turn_trees(&b->world);
        assert_false(is_quick(b));
        bed_destroy(b);
    }
}

/* More than one round takes: all get one. */
static void rounds_follow_until_all_are_better(void **state)
{
    enum { MANY = 66 }; /* a round takes 64 */
    (void)state;
    struct bed *b = bed_create(true);
    struct lum_triangles *t = relief(0);
    for (int i = 0; i < MANY; i++)
        put_relief(b, t, i);
    for (int i = 0; i < MANY; i++) {
        lum_world_turn_trees(&b->world);
        sem_wait(&b->ready);
    }
    lum_world_turn_trees(&b->world);
    assert_int_equal(b->world.snapshot->n_instances, MANY);
    for (int i = 0; i < MANY; i++)
        assert_false(b->world.snapshot->instances[i].mesh->quick);
    lum_triangles_unref(t);
    bed_destroy(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nobody_else_builds),
        cmocka_unit_test(hits_are_the_same),
        cmocka_unit_test(triangles_that_coincide_are_found),
        cmocka_unit_test(what_coincides_is_seen_the_same),
        cmocka_unit_test(without_hurry_there_is_nothing_to_better),
        cmocka_unit_test(what_is_gone_needs_none),
        cmocka_unit_test(what_cannot_begin_waits_for_another),
        cmocka_unit_test(rounds_follow_until_all_are_better),
        cmocka_unit_test(the_end_comes_at_any_time),
    };
    return cmocka_run_group_tests_name("trees", tests, NULL, NULL);
}
