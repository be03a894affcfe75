/* A view: one camera's picture of the scene, rendered pass by pass.
 *
 * data flow of a pass: snapshot + settings -> demand -> stale stages (G-buffer, estimators) -> film. Every stage is
 * memoised: it stores the snapshot versions and settings that it depends on, and runs only when one changed. A
 * progressive method adds one sample a pixel per pass, until max_spp. */
#ifndef LUM_CORE_RENDER_VIEW_H
#define LUM_CORE_RENDER_VIEW_H

#include "core/base/pool.h"
#include "core/film/error_map.h"
#include "core/method/method.h"
#include "core/pass/settings.h"
#include "core/pass/stats.h"

/* 600x400, live, seed 0, depth LUM_DEPTH_DEFAULT, 16 shadow samples, antialias, 256 VPLs, wait-free storage */
struct lum_view_settings lum_view_settings_default(void);

struct lum_view;
struct lum_team;

/* pool is borrowed and must outlive the view. */
LUM_MUST_USE enum lum_status lum_view_create(struct lum_pool *pool, struct lum_view **ret_view, struct lum_error *err);
void lum_view_destroy(struct lum_view *view); /* accepts NULL */
/* Views that share caches find each other's records. Before the first pass; caches are borrowed, made for at least as
 * many workers as the view's pool has, and must outlive the view. A view that shares none makes its own. */
void lum_view_share(struct lum_view *view, struct lum_caches *caches);

/* The view's passes are shared by a team (core/base/team.h), each of whose members has such a view and runs the same
 * passes, deterministic and without cancel. Before the first pass; borrowed. */
void lum_view_join(struct lum_view *view, struct lum_team *team);

/* Runs one pass. *cancel (may be NULL) is read per tile: on true the pass ends early with LUM_ERR_CANCELLED, and the
 * film keeps the tiles that were done. Restarts by itself when snapshot or settings differ from the last pass in a way
 * that matters. Thread: one at a time per pool (the director). */
enum lum_status lum_view_pass(struct lum_view *view, const struct lum_snapshot *snapshot,
                              const struct lum_view_settings *settings, const _Atomic bool *cancel,
                              struct lum_pass_stats *ret_stats, struct lum_error *err);

/* Of a frame that is whole: makes what rough pictures (settings->preview > 1) after the next edit are compared with, so
 * that what it does not change stays as sharp as it is (rough_base.h). Not needed; does nothing where that is there.
 * *ret_stats: what it cost. Thread, cancel, errors: as lum_view_pass. */
enum lum_status lum_view_prepare(struct lum_view *view, const struct lum_snapshot *snapshot,
                                 const struct lum_view_settings *settings, const _Atomic bool *cancel,
                                 struct lum_pass_stats *ret_stats, struct lum_error *err);

/* Forgets every memoised stage, but keeps the memory, so that the next pass does all its work and allocates nothing:
 * for timing. The records of a cache are not the view's, and stay. */
void lum_view_forget(struct lum_view *view);

/* The picture so far; valid until the next pass. */
const struct lum_film *lum_view_film(const struct lum_view *view);

/* Where the picture is off, as far as that is known now; of one that no pass measured, nowhere. On success the map is
 * settled, and the caller's to finish. Thread: as lum_view_pass. */
LUM_MUST_USE enum lum_status lum_view_error_map(const struct lum_view *view, struct lum_error_map *ret_map,
                                                struct lum_error *err);

/* Where the last pass refined its samples of an effect: how often the pixel's tile of the sampling pattern was, w * h,
 * row by row. NULL: the method made no such map. Valid until the next pass. */
const uint8_t *lum_view_guidance(const struct lum_view *view, enum lum_effect effect);

/* First-hit buffers of the last pass, through pixel centres; each may be NULL when not made yet. Arrays are w * h. */
struct lum_aovs {
    const struct lum_rgb *albedo;
    const struct lum_vec3 *normal_world; /* shading normal */
    const float *depth_m;                /* distance along the ray; +inf: background */
    const uint32_t *instance;            /* LUM_NO_OBJECT: background */
};
/* Renders the G-buffer if it is stale, then returns it. Thread: as lum_view_pass. */
enum lum_status lum_view_aovs(struct lum_view *view, const struct lum_snapshot *snapshot,
                              const struct lum_view_settings *settings, struct lum_aovs *ret_aovs,
                              struct lum_error *err);

/* The object under a pixel. Thread: any (traces one ray). */
struct lum_pick {
    bool hit;
    const char *id;               /* object's or light's id, borrowed from the snapshot */
    struct lum_vec3d point_world; /* metres */
    struct lum_vec3 normal;       /* world, unit, geometric */
    double distance_m;
};
void lum_pick_at(const struct lum_snapshot *snapshot, const struct lum_camera *camera, uint32_t w, uint32_t h, double x,
                 double y, struct lum_pick *ret_pick);

/* What is around the eye of a camera: is it in a room? Thread: any (traces one batch of rays). */
struct lum_surroundings {
    double enclosed; /* 0..1: of all directions those in which something is met */
    double reach_m;  /* the median of how far that is; 0: nothing is */
};
void lum_surroundings_at(const struct lum_snapshot *snapshot, const struct lum_camera *camera,
                         struct lum_surroundings *ret_around);

/* Illuminance at a point by path tracing n_samples, split over the pool: direct and indirect, with standard error. In
 * slices that a caller fits between other work: what comes out does not depend on how they are cut. */
struct lum_probe {
    double illuminance_lx, stderr_lx;
    struct lum_rgb irradiance;
};
struct lum_probing;
/* Holds the snapshot. The point is to be finite and near the scene, the normal finite and not zero. */
LUM_MUST_USE enum lum_status lum_probing_create(const struct lum_snapshot *snapshot, struct lum_vec3d point_world,
                                                struct lum_vec3 normal, uint32_t n_samples, uint32_t seed,
                                                struct lum_probing **ret_probing, struct lum_error *err);
void lum_probing_destroy(struct lum_probing *probing); /* accepts NULL */
/* So many samples more, rounded up to whole batches of rays. Thread: as lum_view_pass. */
LUM_MUST_USE enum lum_status lum_probing_go_on(struct lum_probing *probing, struct lum_pool *pool, uint32_t n_samples,
                                               bool *ret_more, struct lum_error *err);
uint64_t lum_probing_scene_rev(const struct lum_probing *probing);
/* Of the samples so far, one at least. */
void lum_probing_result(const struct lum_probing *probing, struct lum_probe *ret_probe, uint64_t *ret_rays);

#endif
