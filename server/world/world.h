/* A scene as the server keeps it: the document, and the renderer's copy of it, always in step. The daemon and the batch
 * renderer edit through this alone.
 *
 * Edits do not show until lum_world_commit publishes them as a snapshot: a drag's many edits cost one commit. Until
 * then they can be taken back, last first.
 *
 * Thread: one (the director). Snapshots taken from it may be read by any. */
#ifndef LUM_SERVER_WORLD_WORLD_H
#define LUM_SERVER_WORLD_WORLD_H

#include "core/base/pool.h"
#include "core/cache/caches.h"
#include "core/scene/desc.h"
#include "core/scene/snapshot.h"
#include "core/vpl/caustic.h"
#include "protocol/document/past.h"
#include "server/world/apply.h"
#include "server/world/fade.h"
#include "server/world/patches.h"
#include "server/world/totals.h"
#include "server/world/trees.h"

struct lum_world {
    struct lum_pool *pool;
    struct lum_device *device;
    struct lum_caches *caches; /* what all views of the scene share */
    struct lum_caches *past;   /* what all views of moments share; NULL: there is none */
    uint64_t n_moments;        /* that were made */
    struct {
        uint64_t shown, most; /* what moments that are shown have apart from the scene, told by the owner; and may */
    } past_bytes;
    struct lum_scene *scene;
    struct lum_document *doc;
    struct lum_go_on go_on;           /* set by the owner; once it says no, the world may only be finished */
    struct lum_totals totals, limits; /* limits: set by lum_world_init; the owner may lower them */
    bool deterministic; /* a picture depends neither on what was shown before it nor on the number of threads; set by
                           the owner */
    const struct lum_snapshot *snapshot; /* newest published; NULL before the first commit */
    const struct lum_snapshot *lit;      /* the same while lamps fade, and in the light of the desk; NULL: as the
                                            document says */
    struct lum_patches patches;          /* as published */
    bool repatched;                      /* an edit since touched one of them */
    struct lum_fade fade;                /* its owner turns it, and relights */
    struct lum_caustics caustics;        /* lum_world_caustics */
    bool hurry;                          /* lum_world_hurry */
    struct lum_trees *trees;
    struct lum_trees_ready trees_ready;
    struct lum_log log;
};

/* isa: of the ray tracing kernels (accel.h). NULL: what $LUMEND_ISA says, else the widest of this processor. */
LUM_MUST_USE enum lum_status lum_world_init(struct lum_world *world, uint32_t threads, const char *isa,
                                            const struct lum_log *log, struct lum_error *err);
void lum_world_finish(struct lum_world *world); /* accepts a zeroed or half-built one */

struct lum_edit {
    const char *user; /* who may undo it */
    const struct lum_ops *ops;
    const struct lum_import_children *children; /* of its import ops; borrowed */
    size_t n_children;
};
/* All or nothing: the document's revision grows by one, or nothing changed and err says which op was refused. */
bool lum_world_apply(struct lum_world *world, const struct lum_edit *edit, struct lum_changes *ret_changes,
                     struct lum_proto_error *err);
bool lum_world_undo(struct lum_world *world, const char *user, struct lum_changes *ret_changes,
                    struct lum_proto_error *err);
bool lum_world_redo(struct lum_world *world, const char *user, struct lum_changes *ret_changes,
                    struct lum_proto_error *err);
/* Back to what was at that revision: an edit like any other. */
bool lum_world_revert(struct lum_world *world, const char *user, uint64_t rev, struct lum_changes *ret_changes,
                      struct lum_proto_error *err);

/* The scene as it was at that revision, while all goes on as it is. No edit may wait to be committed. A reference is
 * the caller's. ret_bytes: what it has apart from the scene. */
bool lum_world_moment(struct lum_world *world, uint64_t rev, const struct lum_snapshot **ret_snapshot,
                      uint64_t *ret_bytes, struct lum_proto_error *err);
void lum_world_forget_past(struct lum_world *world); /* no view shows a moment any more */

/* Takes the document over in place of the empty one, makes the renderer's scene of it, and commits. Into an empty
 * world.
 */
LUM_MUST_USE enum lum_status lum_world_restore(struct lum_world *world, struct lum_document *doc,
                                               struct lum_error *err);

/* From now on large meshes are soon shown, and better to trace later: then ready is told, and whoever edits the scene
 * turns. */
void lum_world_hurry(struct lum_world *world, const struct lum_trees_ready *ready);
void lum_world_turn_trees(struct lum_world *world); /* while no edit is pending: it commits */

/* Takes the last edit back, as if it had not been. Called for several, last first: the users' histories forget only the
 * newest, and an undo of one of the others answers "conflict". */
void lum_world_rollback(struct lum_world *world, const struct lum_changes *changes);

/* Publishes. On failure the former snapshot stays, and the edits since are still pending. */
LUM_MUST_USE enum lum_status lum_world_commit(struct lum_world *world, struct lum_error *err);

/* After the values of patches, or the fade, have changed. Without memory the scene is as the document says. */
void lum_world_relight(struct lum_world *world);
/* The published scene as it is shown. */
static inline const struct lum_snapshot *lum_world_lit(const struct lum_world *world)
{
    return world->lit ? world->lit : world->snapshot;
}

/* A camera of the published scene: `id`, or NULL for the one that a picture starts with: what the settings name, else
 * `main`, else the first by id, else one that frames everything. Always fills *ret_camera; an error (the id is not
 * there) says which are near. */
LUM_MUST_USE bool lum_world_camera(const struct lum_world *world, const char *id, struct lum_camera *ret_camera,
                                   struct lum_proto_error *err);

/* What mirrors and glass focus in the published scene. At rest it is made if it has to be, which takes rays; else it
 * may be that of an earlier revision, or not known. n_rays: that this call took. */
struct lum_caustic_report lum_world_caustics(struct lum_world *world, bool at_rest);

/* The settings record; never NULL. */
const struct lum_record *lum_world_render(const struct lum_world *world);

#endif
