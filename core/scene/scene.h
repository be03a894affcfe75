/* The scene: what a client can edit, and the immutable snapshots that rendering reads.
 *
 * struct lum_scene is written by one thread (the director). Each put or remove names a stable string id;
 * lum_scene_commit publishes everything since the last commit as a new reference-counted const struct lum_snapshot that
 * shares all that did not change. Values are checked here a last time: a refused call changes nothing.
 *
 * Descriptions are in world space (desc.h). The snapshot is in scene space: p_scene = (p_world - centre) * scale with
 * scale a power of two such that the extent is about 1..128 (snapshot.h). */
#ifndef LUM_CORE_SCENE_SCENE_H
#define LUM_CORE_SCENE_SCENE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"
#include "core/scene/desc.h"

struct lum_accel_mesh;
struct lum_device;
struct lum_mesh;
struct lum_scene;
struct lum_snapshot;
struct lum_triangles;
struct lum_web;
struct lum_web_desc;

/* device must outlive the scene and all its snapshots. */
LUM_MUST_USE enum lum_status lum_scene_create(struct lum_device *device, struct lum_scene **ret_scene,
                                              struct lum_error *err);
/* For a scene that takes the place of previous and was never committed: its versions begin above previous's, so that
 * who watched previous sees everything change. */
void lum_scene_succeed(struct lum_scene *scene, const struct lum_scene *previous);
/* Another scene with the same content, committed as this one is by now: it goes its own way from there, and shares what
 * is heavy. Its snapshots count what differs from the last common one in version_step, so that none stands for one of
 * this scene, nor of a fork with another step. */
LUM_MUST_USE enum lum_status lum_scene_fork(const struct lum_scene *scene, uint64_t version_step,
                                            struct lum_scene **ret_scene, struct lum_error *err);
void lum_scene_destroy(struct lum_scene *scene); /* accepts NULL; snapshots live on */

/* Smooth solid glass bends light (false, as scenes are made), or lets it straight through at each face, dimmed by what
 * the face reflects and by what is inside: rays of light pass it then, which no method can follow where it is bent.
 * From the next commit on. */
void lum_scene_straighten_glass(struct lum_scene *, bool straight);

/* In a hurry, meshes of LUM_SCENE_QUICK_TRIANGLES or more get a tree that is quickly made, until they are given a
 * better one. Pictures are the same, but for rays that run exactly along an edge, which may hit its other triangle.
 * (Of triangles that coincide the tree chooses which is seen, too: who gives trees lets meshes that have such keep the
 * quick one, and without a hurry they get it to begin with.) */
#define LUM_SCENE_QUICK_TRIANGLES 65536u /* a good tree of fewer takes less than 40 ms */
void lum_scene_hurry(struct lum_scene *, bool hurry);
/* What to make better trees of: at most `most`, of each a reference. Returns how many: 0, if since the last call no
 * mesh was put that is to have one, and none was given. So whoever cannot make them asks in vain until there is
 * another. */
uint32_t lum_scene_quick_meshes(struct lum_scene *, struct lum_triangles **ret_triangles, uint32_t most);
/* Takes a reference, for the next commit, if a mesh of these triangles is still there with a quick one. NULL: it keeps
 * that. */
void lum_scene_give_tree(struct lum_scene *, const struct lum_triangles *of, struct lum_accel_mesh *tree);

/* A mesh that is made, and in no scene yet: that is what takes long. */
struct lum_made_mesh {
    struct lum_mesh *mesh;
    uint64_t dropped; /* triangles */
};
/* Of one that does not deform. Thread: any, while nobody writes the scene. */
LUM_MUST_USE enum lum_status lum_scene_make_mesh(const struct lum_scene *, const struct lum_mesh_desc *,
                                                 struct lum_made_mesh *ret_made, struct lum_error *);
void lum_made_mesh_finish(struct lum_made_mesh *made); /* accepts a zeroed one */
/* As lum_scene_put_mesh. `made` is zeroed then. */
LUM_MUST_USE enum lum_status lum_scene_put_made_mesh(struct lum_scene *, const char *id, struct lum_made_mesh *made,
                                                     struct lum_error *);

/* Add, or replace what has this id. An object may be put only after its mesh and material. Replacing a mesh, image or
 * material reaches everything that refers to it. */
LUM_MUST_USE enum lum_status lum_scene_put_mesh(struct lum_scene *, const char *id, const struct lum_mesh_desc *,
                                                struct lum_error *);
LUM_MUST_USE enum lum_status lum_scene_put_image(struct lum_scene *, const char *id, const struct lum_image_desc *,
                                                 struct lum_error *);
/* The same, of pixels that whoever made them shares: release(owner) is called when the last snapshot has let go of
 * them, by any thread; not on failure. Not of RGB32F, which are mended in a copy. */
LUM_MUST_USE enum lum_status lum_scene_share_image(struct lum_scene *, const char *id, const struct lum_image_desc *,
                                                   void (*release)(void *owner), void *owner, struct lum_error *);
LUM_MUST_USE enum lum_status lum_scene_put_material(struct lum_scene *, const char *id,
                                                    const struct lum_material_desc *, struct lum_error *);
LUM_MUST_USE enum lum_status lum_scene_put_object(struct lum_scene *, const char *id, const struct lum_object_desc *,
                                                  struct lum_error *);
LUM_MUST_USE enum lum_status lum_scene_put_light(struct lum_scene *, const char *id, const struct lum_light_desc *,
                                                 struct lum_error *);
/* The web of a light to put: that of another light of the scene where it is the same, else a new one. One reference is
 * the caller's. */
LUM_MUST_USE enum lum_status lum_scene_take_web(const struct lum_scene *, const struct lum_web_desc *,
                                                struct lum_web **ret_web, struct lum_error *);
LUM_MUST_USE enum lum_status lum_scene_put_camera(struct lum_scene *, const char *id, const struct lum_camera *,
                                                  struct lum_error *);
LUM_MUST_USE enum lum_status lum_scene_put_medium(struct lum_scene *, const char *id, const struct lum_medium_desc *,
                                                  struct lum_error *);

enum lum_entity {
    LUM_ENTITY_MESH,
    LUM_ENTITY_IMAGE,
    LUM_ENTITY_MATERIAL,
    LUM_ENTITY_OBJECT,
    LUM_ENTITY_LIGHT,
    LUM_ENTITY_CAMERA,
    LUM_ENTITY_MEDIUM,
};
/* LUM_ERR_CONFLICT when something still refers to it, LUM_ERR_NOT_FOUND when there is no such id. */
LUM_MUST_USE enum lum_status lum_scene_remove(struct lum_scene *, enum lum_entity, const char *id, struct lum_error *);

/* Publishes the state as scene revision scene_rev. The caller owns one reference (lum_snapshot_unref). On failure the
 * former snapshot stays the newest and the pending edits stay pending. LUM_ERR_LIMIT: more than LUM_MEDIA_MAX media;
 * only here, because an edit that replaces all of them puts the new ones before it removes the old. */
LUM_MUST_USE enum lum_status lum_scene_commit(struct lum_scene *, uint64_t scene_rev,
                                              const struct lum_snapshot **ret_snapshot, struct lum_error *);

/* Triangles dropped at put (degenerate, non-finite or out-of-range index), over the scene's life. */
uint64_t lum_scene_dropped_triangles(const struct lum_scene *);
/* Channels of RGB32F texels that were not finite and became 0 at put, over the scene's life. */
uint64_t lum_scene_dropped_texels(const struct lum_scene *);

#endif
