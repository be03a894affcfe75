#include "tests/support/built_in.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>

#include "server/world/scene_source.h"

struct built_in {
    struct lum_world world;
    struct lum_ops ops;
    size_t n_done;
};

struct built_in *built_in_open(const char *scene, unsigned threads)
{
    char replay[64];
    struct lum_error err = {0};
    struct lum_proto_error perr;
    struct built_in *b = calloc(1, sizeof *b);
    assert_non_null(b);
    if (lum_world_init(&b->world, threads, NULL, NULL, &err) != LUM_OK)
        fail_msg("%s: %s", scene, err.text);
    if (!lum_scene_load(&b->world, scene, &(struct lum_import_config){0}, &perr))
        fail_msg("%s: %s", scene, perr.text);
    snprintf(replay, sizeof replay, "%s-moves", scene);
    if (lum_replay_builtin(replay) && !lum_edits_load(replay, &b->ops, &perr))
        fail_msg("%s: %s", replay, perr.text);
    return b;
}

void built_in_close(struct built_in *b)
{
    lum_ops_finish(&b->ops);
    lum_world_finish(&b->world);
    free(b);
}

bool built_in_next_pose(struct built_in *b)
{
    size_t from = b->n_done, n = 0;
    while (from + n < b->ops.n && b->ops.t_ms[from + n] == b->ops.t_ms[from])
        n++;
    if (n == 0)
        return false;
    struct lum_ops ops = {.ops = b->ops.ops + from, .n = n};
    struct lum_changes changes;
    struct lum_proto_error err;
    if (!lum_world_apply(&b->world, &(struct lum_edit){.user = "test", .ops = &ops}, &changes, &err))
        fail_msg("at %g ms: %s: %s", b->ops.t_ms[from], err.path, err.text);
    lum_changes_finish(&changes);
    b->n_done += n;
    assert_int_equal(lum_world_commit(&b->world, NULL), LUM_OK);
    return true;
}

const struct lum_snapshot *built_in_snapshot(const struct built_in *b)
{
    return b->world.snapshot;
}

struct lum_pool *built_in_pool(const struct built_in *b)
{
    return b->world.pool;
}
