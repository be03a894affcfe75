/* The scene as it was. */
#include "server/world/world.h"

#include <stdio.h>
#include <string.h>

#include "protocol/base/limits.h"

/* Versions of each moment count in their own part of 64 bits: a scene that is edited a million times a second reaches
 * the first of them in twelve days. */
#define STEP_BITS 40

/* Views of moments leave each other's cache as it was rather than that of the scene. */
static bool make_caches(struct lum_world *w, struct lum_error *err)
{
    if (w->past)
        return true;
    if (lum_caches_create(lum_pool_size(w->pool), &w->past, err))
        return false;
    lum_caches_set_limit(w->past, LUM_LIMIT_CACHES_BYTES);
    return true;
}

void lum_world_forget_past(struct lum_world *w)
{
    lum_caches_destroy(w->past);
    w->past = NULL;
}

/* What is made anew for it alone. */
static bool check_room(const struct lum_world *w, const struct lum_changes *changes, uint64_t *ret_bytes,
                       struct lum_proto_error *err)
{
    struct lum_totals n = {0};
    for (size_t i = 0; i < changes->n; i++)
        n = lum_totals_sum(n, lum_totals_of(changes->changes[i].after));
    *ret_bytes = n.bytes;
    return w->past_bytes.shown + n.bytes <= w->past_bytes.most ||
           lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "moment",
                          "what was otherwise then takes %llu MiB, beside %llu of other views of moments, and all may "
                          "take %llu: go back to it, or keep a version",
                          (unsigned long long)(n.bytes >> 20), (unsigned long long)(w->past_bytes.shown >> 20),
                          (unsigned long long)(w->past_bytes.most >> 20));
}

bool lum_world_moment(struct lum_world *w, uint64_t rev, const struct lum_snapshot **ret_snapshot, uint64_t *ret_bytes,
                      struct lum_proto_error *err)
{
    struct lum_changes changes;
    struct lum_scene *then = NULL;
    struct lum_error e;
    size_t failed;
    if (!lum_document_changes_to(w->doc, rev, &changes, err)) {
        if (strcmp(err->path, "scene_rev") == 0)
            snprintf(err->path, sizeof err->path, "moment"); /* as views call it */
        return false;
    }
    bool ok = check_room(w, &changes, ret_bytes, err);
    bool made = ok && make_caches(w, &e) && !lum_scene_fork(w->scene, ++w->n_moments << STEP_BITS, &then, &e) &&
                !lum_apply_changes(then, &changes, &w->go_on, &failed, &e) &&
                !lum_scene_commit(then, rev, ret_snapshot, &e);
    lum_scene_destroy(then);
    lum_changes_finish(&changes);
    return made || (ok && lum_apply_error(&e, "moment", err));
}
