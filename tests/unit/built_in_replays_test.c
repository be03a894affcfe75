/* The built-in replays: each plays on its scene, keeps its time and moves what it is there to move; the mesh that
 * deforms is refitted. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/world/scene_source.h"

enum { POSES = 100, MOVERS_MAX = 32 };
static const double frame_ms = 1000.0 / 30.0;

struct player {
    struct lum_world world;
    struct lum_ops ops;
    size_t n_done;
};

static void open_player(struct player *p, const char *replay)
{
    char scene[64];
    struct lum_proto_error err;
    const char *suffix = strstr(replay, "-moves");
    assert_non_null(suffix);
    snprintf(scene, sizeof scene, "%.*s", (int)(suffix - replay), replay);
    memset(p, 0, sizeof *p);
    assert_int_equal(lum_world_init(&p->world, 2, NULL, NULL, NULL), LUM_OK);
    if (!lum_scene_load(&p->world, scene, &(struct lum_import_config){0}, &err) ||
        !lum_edits_load(replay, &p->ops, &err))
        fail_msg("%s: %s: %s", replay, err.path, err.text);
    assert_non_null(p->ops.t_ms);
}

static void close_player(struct player *p)
{
    lum_ops_finish(&p->ops);
    lum_world_finish(&p->world);
}

/* Applies the edits of the next instant, as `lumend render` and lumend-replay do; returns how many. */
static size_t next_pose(struct player *p)
{
    size_t from = p->n_done, n = 1;
    while (from + n < p->ops.n && p->ops.t_ms[from + n] == p->ops.t_ms[from])
        n++;
    struct lum_ops ops = {.ops = p->ops.ops + from, .n = n};
    struct lum_changes changes;
    struct lum_proto_error err;
    if (!lum_world_apply(&p->world, &(struct lum_edit){.user = "test", .ops = &ops}, &changes, &err))
        fail_msg("at %g ms: %s: %s", p->ops.t_ms[from], err.path, err.text);
    lum_changes_finish(&changes);
    p->n_done += n;
    return n;
}

static void commit(struct player *p)
{
    assert_int_equal(lum_world_commit(&p->world, NULL), LUM_OK);
}

static double centre_distance(const struct lum_box *a, const struct lum_box *b)
{
    double x = (a->lo.x + a->hi.x - b->lo.x - b->hi.x) / 2, y = (a->lo.y + a->hi.y - b->lo.y - b->hi.y) / 2,
           z = (a->lo.z + a->hi.z - b->lo.z - b->hi.z) / 2;
    return sqrt(x * x + y * y + z * z);
}

/* From the first pose to a third of the way: every object that the replay sets is elsewhere. */
static void assert_movers_move(struct player *p, const char *replay)
{
    struct lum_box before[MOVERS_MAX], now;
    next_pose(p);
    commit(p);
    size_t n = next_pose(p);
    const struct lum_op *movers = p->ops.ops + p->n_done - n; /* the second pose: the first may add what moves */
    assert_in_range(n, 1, MOVERS_MAX);
    for (size_t i = 0; i < n; i++)
        if (!lum_snapshot_bounds(p->world.snapshot, movers[i].id, &before[i]))
            fail_msg("%s: there is no %s to move", replay, movers[i].id);
    for (int pose = 2; pose < POSES / 3; pose++)
        next_pose(p);
    commit(p);
    for (size_t i = 0; i < n; i++) {
        assert_true(lum_snapshot_bounds(p->world.snapshot, movers[i].id, &now));
        if (!(centre_distance(&before[i], &now) > 0.05))
            fail_msg("%s: %s stays where it is", replay, movers[i].id);
    }
}

/* A pose for every frame of 30 a second, due when the frame is and not a rounding later. */
static void assert_times(const struct lum_ops *ops, const char *replay)
{
    size_t at = 0;
    for (int pose = 0; pose < POSES; pose++) {
        if (at == ops->n || !(ops->t_ms[at] <= pose * frame_ms && ops->t_ms[at] > pose * frame_ms - 0.01))
            fail_msg("%s: pose %d is not due at %g ms", replay, pose, pose * frame_ms);
        for (double t = ops->t_ms[at]; at < ops->n && ops->t_ms[at] == t; at++)
            ;
    }
    assert_int_equal(at, ops->n);
}

static void every_replay_plays_on_its_scene(void **state)
{
    (void)state;
    size_t n_replays = 0;
    for (const struct lum_embedded *e = lum_embedded_replays; e->key; e++, n_replays++) {
        char name[64];
        snprintf(name, sizeof name, "%.*s", (int)strcspn(e->key, "."), e->key);
        assert_ptr_equal(lum_replay_builtin(name), e);
        struct player p;
        open_player(&p, name);
        assert_times(&p.ops, name);
        if (strcmp(name, "wobble-moves") != 0)
            assert_movers_move(&p, name);
        while (p.n_done < p.ops.n)
            next_pose(&p);
        commit(&p);
        close_player(&p);
    }
    assert_int_equal(n_replays, 9);
}

/* Nobody reads the older snapshots here, so two structures serve all poses: one is refitted while the other is shown.
 */
static void the_wobble_is_refitted(void **state)
{
    (void)state;
    struct player p;
    open_player(&p, "wobble-moves");
    const struct lum_accel_mesh *used[2] = {NULL, NULL};
    float sum_before = 0.0f;
    for (int pose = 0; p.n_done < p.ops.n; pose++) {
        next_pose(&p);
        commit(&p);
        const struct lum_snapshot *s = p.world.snapshot;
        const struct lum_mesh *mesh = NULL;
        for (uint32_t i = 0; i < s->n_instances; i++)
            if (strcmp(s->instances[i].id, "column") == 0)
                mesh = s->instances[i].mesh;
        assert_non_null(mesh);
        assert_true(mesh->deforming);
        if (pose < 2)
            used[pose] = mesh->accel;
        else
            assert_ptr_equal(mesh->accel, used[pose % 2]);
        float sum = 0.0f;
        for (uint32_t i = 0; i < mesh->n_vertices / 2; i++)
            sum += mesh->positions[3 * (size_t)i];
        assert_true(pose == 0 || sum != sum_before); /* it bends */
        sum_before = sum;
    }
    assert_ptr_not_equal(used[0], used[1]);
    close_player(&p);
}

static void names_are_told_apart(void **state)
{
    (void)state;
    struct lum_ops ops = {0};
    struct lum_proto_error err;
    assert_null(lum_replay_builtin("cornell"));
    assert_null(lum_replay_builtin("cornell-moves.jsonl"));
    assert_null(lum_scene_builtin("cornell-moves"));
    assert_false(lum_edits_load("cornell", &ops, &err));
    assert_non_null(strstr(err.text, "is a scene"));
    assert_false(lum_edits_load("no-such-replay", &ops, &err));
    assert_null(strstr(err.text, "no-such-replay")); /* the caller names it */
    struct lum_world world = {0};
    assert_int_equal(lum_world_init(&world, 1, NULL, NULL, NULL), LUM_OK);
    assert_false(lum_scene_load(&world, "cornell-moves", &(struct lum_import_config){0}, &err));
    assert_non_null(strstr(err.text, "is a replay"));
    lum_world_finish(&world);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_replay_plays_on_its_scene),
        cmocka_unit_test(the_wobble_is_refitted),
        cmocka_unit_test(names_are_told_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
