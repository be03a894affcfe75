#include "server/world/world.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/base/log.h"
#include "server/world/apply.h"
#include "server/world/restore.h"

enum lum_status lum_world_init(struct lum_world *w, uint32_t threads, const char *isa, const struct lum_log *log,
                               struct lum_error *err)
{
    memset(w, 0, sizeof *w);
    if (log)
        w->log = *log;
    w->limits = lum_totals_limits();
    w->past_bytes.most = LUM_LIMIT_MOMENT_BYTES;
    lum_thread_init_fp(); /* of whoever works between the workers, as in theirs: pictures do not hang on how many there
                             are */
    enum lum_status st = lum_pool_create(threads, &w->pool, err);
    if (!st)
        st = lum_device_create(lum_pool_size(w->pool), isa ? isa : getenv("LUMEND_ISA"), &w->device, err);
    if (!st)
        st = lum_caches_create(lum_pool_size(w->pool), &w->caches, err);
    if (!st)
        lum_caches_set_limit(w->caches, LUM_LIMIT_CACHES_BYTES);
    if (!st)
        st = lum_scene_create(w->device, &w->scene, err);
    if (!st && !(w->doc = lum_document_create()))
        st = lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the scene");
    if (st)
        lum_world_finish(w);
    return st;
}

void lum_world_finish(struct lum_world *w)
{
    lum_trees_stop(w->trees);
    lum_caustics_finish(&w->caustics);
    lum_caches_destroy(w->caches);
    lum_world_forget_past(w);
    lum_snapshot_unref(w->lit);
    lum_snapshot_unref(w->snapshot);
    lum_patches_finish(&w->patches);
    lum_fade_finish(&w->fade);
    lum_document_destroy(w->doc);
    lum_scene_destroy(w->scene);
    lum_device_destroy(w->device);
    lum_pool_destroy(w->pool);
    memset(w, 0, sizeof *w);
}

/* ---- keeping the renderer in step ---- */

/* Makes the renderer's scene anew from the document: the way out when an edit could neither be finished nor taken back.
 */
static void rebuild_scene(struct lum_world *w)
{
    struct lum_scene *scene = NULL;
    struct lum_totals totals;
    enum lum_status st = lum_scene_create(w->device, &scene, NULL);
    if (!st) {
        lum_scene_hurry(scene, w->hurry);
        st = lum_scene_of_document(scene, w->pool, w->doc, &totals, NULL);
    }
    if (st) {
        lum_log(&w->log, LUM_LOG_ERROR, "world",
                "the scene could not be rebuilt after a failed edit (%s); it shows its last good state",
                lum_status_text(st));
        lum_scene_destroy(scene);
        return;
    }
    lum_scene_succeed(scene, w->scene); /* views compare versions: none may stand for two scenes */
    lum_scene_destroy(w->scene);
    w->scene = scene;
}

enum lum_status lum_world_restore(struct lum_world *w, struct lum_document *doc, struct lum_error *err)
{
    lum_document_destroy(w->doc);
    w->doc = doc;
    w->repatched = true;
    /* the totals are taken whatever they are: it was accepted once */
    enum lum_status st = lum_scene_of_document(w->scene, w->pool, doc, &w->totals, err);
    return st ? st : lum_world_commit(w, err);
}

void lum_world_hurry(struct lum_world *w, const struct lum_trees_ready *ready)
{
    w->hurry = true;
    w->trees_ready = *ready;
    lum_scene_hurry(w->scene, true);
}

void lum_world_turn_trees(struct lum_world *w)
{
    struct lum_error e;
    if (w->hurry && lum_trees_turn(&w->trees, w->device, w->scene, &w->trees_ready) && lum_world_commit(w, &e))
        lum_log(&w->log, LUM_LOG_WARNING, "world", "better trees wait for the next edit: %s", e.text);
}

/* Where in the ops the record that was refused comes from: "ops/3", or "" when it is not from there (undo). */
static void find_op(const struct lum_ops *ops, const struct lum_change *c, char ret_path[32])
{
    const struct lum_record *r = c->after ? c->after : c->before;
    ret_path[0] = 0;
    for (size_t i = ops ? ops->n : 0; i-- > 0;)
        if (strcmp(ops->ops[i].id, r->id) == 0 || (r->origin[0] && strcmp(ops->ops[i].id, r->origin) == 0)) {
            snprintf(ret_path, 32, "ops/%zu", i);
            return;
        }
}

static void note_patches(struct lum_world *w, const struct lum_changes *c)
{
    for (size_t i = 0; i < c->n && !w->repatched; i++)
        w->repatched = (c->changes[i].after ? c->changes[i].after : c->changes[i].before)->type == LUM_RECORD_PATCH;
}

/* Brings the scene after the document. On refusal the document goes back, and the changes are released. */
static bool follow_document(struct lum_world *w, const struct lum_ops *ops, struct lum_changes *changes,
                            struct lum_proto_error *err)
{
    struct lum_error e = {0};
    size_t failed = 0;
    enum lum_status st = lum_totals_change(&w->totals, &w->limits, changes, &failed, &e);
    if (!st) {
        st = lum_apply_changes(w->scene, changes, &w->go_on, &failed, &e);
        if (!st) {
            note_patches(w, changes);
            return true;
        }
        lum_totals_take_back(&w->totals, changes);
    }
    char path[32];
    find_op(ops, &changes->changes[failed], path);
    lum_apply_error(&e, path, err);
    lum_document_rollback(w->doc, changes);
    if (st == LUM_ERR_INTERNAL)
        rebuild_scene(w);
    lum_changes_finish(changes);
    return false;
}

bool lum_world_apply(struct lum_world *w, const struct lum_edit *edit, struct lum_changes *ret_changes,
                     struct lum_proto_error *err)
{
    struct lum_changes changes;
    if (!lum_document_apply(w->doc, edit->user, edit->ops, edit->children, edit->n_children, &changes, err) ||
        !follow_document(w, edit->ops, &changes, err))
        return false;
    *ret_changes = changes;
    return true;
}

bool lum_world_undo(struct lum_world *w, const char *user, struct lum_changes *ret_changes, struct lum_proto_error *err)
{
    struct lum_changes changes;
    if (!lum_document_undo(w->doc, user, &changes, err) || !follow_document(w, NULL, &changes, err))
        return false;
    *ret_changes = changes;
    return true;
}

bool lum_world_redo(struct lum_world *w, const char *user, struct lum_changes *ret_changes, struct lum_proto_error *err)
{
    struct lum_changes changes;
    if (!lum_document_redo(w->doc, user, &changes, err) || !follow_document(w, NULL, &changes, err))
        return false;
    *ret_changes = changes;
    return true;
}

bool lum_world_revert(struct lum_world *w, const char *user, uint64_t rev, struct lum_changes *ret_changes,
                      struct lum_proto_error *err)
{
    struct lum_changes changes;
    if (!lum_document_revert(w->doc, user, rev, &changes, err) || !follow_document(w, NULL, &changes, err))
        return false;
    *ret_changes = changes;
    return true;
}

void lum_world_rollback(struct lum_world *w, const struct lum_changes *changes)
{
    lum_document_rollback(w->doc, changes);
    lum_totals_take_back(&w->totals, changes);
    note_patches(w, changes);
    if (lum_apply_reverse(w->scene, changes, NULL))
        rebuild_scene(w);
}

enum lum_status lum_world_commit(struct lum_world *w, struct lum_error *err)
{
    const struct lum_snapshot *snapshot;
    enum lum_status st = lum_scene_commit(w->scene, lum_document_rev(w->doc), &snapshot, err);
    if (st)
        return st;
    lum_snapshot_unref(w->snapshot);
    w->snapshot = snapshot;
    if (w->repatched && lum_patches_collect(&w->patches, w->doc))
        w->repatched = false;
    lum_fade_follow(&w->fade, &w->snapshot->lights);
    lum_world_relight(w);
    return LUM_OK;
}

static void shine(void *user, struct lum_light *light)
{
    struct lum_world *w = user;
    lum_fade_shine(&w->fade, light);
    lum_patches_shine(&w->patches, light);
}

void lum_world_relight(struct lum_world *w)
{
    struct lum_error e;
    lum_snapshot_unref(w->lit);
    w->lit = NULL;
    if ((w->fade.n == 0 && !lum_patches_known(&w->patches)) || !lum_snapshot_relit(w->snapshot, shine, w, &w->lit, &e))
        return;
    w->lit = NULL;
    lum_log(&w->log, LUM_LOG_WARNING, "world", "the light of a desk or a fade is not shown: %s", e.text);
}

bool lum_world_camera(const struct lum_world *w, const char *id, struct lum_camera *ret_camera,
                      struct lum_proto_error *err)
{
    const char *home = lum_world_render(w)->render.camera;
    struct lum_error e;
    if (id && !lum_snapshot_camera(w->snapshot, id, ret_camera, &e))
        return true;
    if (lum_snapshot_camera(w->snapshot, home, ret_camera, &e) &&
        lum_snapshot_camera(w->snapshot, NULL, ret_camera, &e))
        *ret_camera = lum_snapshot_framing_camera(w->snapshot);
    if (!id)
        return true;
    char near[sizeof err->text / 2];
    lum_document_nearest(w->doc, LUM_RECORD_CAMERA, id, near, sizeof near);
    return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "camera_id", "there is no camera \"%.64s\"%s", id,
                          near);
}

struct lum_caustic_report lum_world_caustics(struct lum_world *w, bool at_rest)
{
    struct lum_error err;
    bool made = at_rest || lum_caustics_serve(&w->caustics, lum_world_lit(w));
    if (made && lum_caustics_update(&w->caustics, lum_world_lit(w), w->pool, &err)) {
        lum_log(&w->log, LUM_LOG_WARNING, "world", "what mirrors and glass focus is not known: %s", err.text);
        made = false;
    }
    struct lum_caustic_report report = w->caustics.report;
    if (!made)
        report.n_rays = 0;
    return report;
}

const struct lum_record *lum_world_render(const struct lum_world *w)
{
    return lum_document_find(w->doc, "render");
}
