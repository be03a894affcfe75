/* A view: one camera's picture of the scene, rendered pass by pass.
 *
 * data flow of a pass: snapshot + settings -> demand -> stale stages (G-buffer, estimators) -> film. Every stage is
 * memoised: it stores the snapshot versions and settings that it depends on, and runs only when one changed. A progressive
 * method adds one sample a pixel per pass, until max_spp. */
#ifndef LUM_CORE_RENDER_VIEW_H
#define LUM_CORE_RENDER_VIEW_H

#include "core/base/pool.h"
#include "core/cache/caches.h"
#include "core/film/film.h"
#include "core/method/method.h"
#include "core/scene/snapshot.h"

#define LUM_LAYERS_BYTES ((size_t)256 << 20) /* 600 x 400: 64 lights with hard shadows */

struct lum_view_settings {
    struct lum_camera camera;
    uint32_t w, h;
    const struct lum_method *method;
    uint32_t seed;
    uint32_t max_spp;        /* progressive methods stop here; 0: never */
    uint32_t max_depth;      /* path segments after the first hit, of every method; roulette ends nearly all paths before */
    uint32_t shadow_samples; /* per area light and pixel in deferred methods: 1, 4, 9 or 16 */
    uint32_t shadow_budget;  /* rays that a frame of `live` may add where shadows are soft; 0: none */
    size_t layers_bytes;     /* of buffers light by light (estimator/layers.h) */
    bool carry_shadows;      /* `live`: what was seen of lights stays known where the eye moves on. False: a picture does not
                                depend on where the eye was before */
    bool antialias;          /* smooth edges, of hard shadows too; false: rays through pixel centres */
    uint32_t preview;        /* methods that are progressive or refine: after a change, first one rough pass with one sample per
                                block of this many pixels a side, so that an edit shows early; those that refine show it by the
                                surfaces of the full picture. 0 and 1: none. At most 16 */
    uint32_t n_vpls;         /* virtual point lights of methods that use them, 1 to LUM_VPL_MAX */
    /* methods with a cache */
    enum lum_storage storage;
    float cache_accuracy;    /* a of Ward: LUM_CACHE_ACCURACY_MIN to _MAX; less is finer */
    bool deterministic;      /* the same picture for any number of threads: for those that else let threads share records as soon
                                as they are made */
    /* For study: effects switched off, and run although nothing calls for them. Bits 1 << enum lum_effect; off wins. */
    uint32_t effects_off, effects_on;
};
#define LUM_DEPTH_DEFAULT 64u /* what is cut off where all reflect 0.7: 1e-10 of the light; 0.9: 0.1 %; 0.95: 3.6 % */
#define LUM_CACHE_ACCURACY 0.2f /* what Radiance, the oldest user of such caches, has as its default (rpict -aa) */
#define LUM_CACHE_ACCURACY_MIN 0.01f /* records get 400 times as many */
#define LUM_CACHE_ACCURACY_MAX 1.0f  /* Ward's metric: as far as where the error is as large as what is estimated */
/* 600x400, live, seed 0, depth 8, 16 shadow samples, antialias, 256 VPLs, wait-free storage */
struct lum_view_settings lum_view_settings_default(void);

/* True when both make the same picture of a scene, sample for sample: all but how many samples, and how early it shows. */
bool lum_view_same_picture(const struct lum_view_settings *a, const struct lum_view_settings *b);
bool lum_camera_equal(const struct lum_camera *a, const struct lum_camera *b);

/* In the order in which they run. */
enum lum_stage {
    LUM_STAGE_GBUFFER,
    LUM_STAGE_SURFACES,
    LUM_STAGE_VPLS,
    LUM_STAGE_CACHE,
    LUM_STAGE_RECORDS,
    LUM_STAGE_DIRECT,
    LUM_STAGE_SHADOW,
    LUM_STAGE_REFINE,
    LUM_STAGE_INDIRECT,
    LUM_STAGE_SPECULAR,
    LUM_STAGE_GLOSSY,
    LUM_STAGE_MEDIA,
    LUM_STAGE_FILTER,
    LUM_STAGE_UPSAMPLE,
    LUM_STAGE_PATH,
    LUM_STAGE_COMPOSITE,
    LUM_STAGE_ANTIALIAS,
    LUM_STAGE_COUNT
};
extern const char *const lum_stage_names[LUM_STAGE_COUNT];

struct lum_effect_stats {
    uint64_t rays, tiles;
    int64_t ns; /* CPU */
};

/* What one pass did. Counters are of this pass only; exactly 0 where nothing ran. */
struct lum_pass_stats {
    uint64_t scene_rev;
    double ms, cpu_ms;
    double stage_ms[LUM_STAGE_COUNT];
    uint64_t rays[LUM_RAY_KIND_COUNT];
    struct lum_demand demand;
    struct lum_effect_stats effects[LUM_EFFECT_COUNT];
    bool served[LUM_EFFECT_COUNT]; /* by the method: one that is called for and not served is missing in the picture */
    uint32_t n_vpls, n_vpls_moved; /* virtual point lights that shine, and those of them that lie elsewhere than in the pass before */
    struct lum_cache_counts cache;
    uint64_t nonfinite, bad_rays;  /* must be 0 */
    double culled_bound;          /* light that was left out of any tile, at most, over the tile's own; below 1/512 */
    uint32_t spp;                 /* least samples of any pixel so far */
    double error_rel;             /* NAN: unknown */
    uint32_t preview;             /* > 1: this was the rough pass, of blocks of this side; spp is still 0 */
    bool changed;                 /* the film differs from before the pass */
    bool complete;                /* nothing left to do for this snapshot and these settings */
};

/* preview for these settings so that the rough pass takes LUM_PREVIEW_MS at most where a whole frame (a sample of progressive
 * methods) takes frame_ms; 0: not known yet. Beside it, a new eye has first hits to find: 20 to 90 ms in a picture of 600 x 400. */
uint32_t lum_view_preview_for(const struct lum_view_settings *settings, double frame_ms);
#define LUM_PREVIEW_MS 60.0

struct lum_view;

/* pool is borrowed and must outlive the view. */
LUM_MUST_USE enum lum_status lum_view_create(struct lum_pool *pool, struct lum_view **ret_view, struct lum_error *err);
void lum_view_destroy(struct lum_view *view); /* accepts NULL */
/* Views that share caches find each other's records. Before the first pass; caches are borrowed, made for at least as many
 * workers as the view's pool has, and must outlive the view. A view that shares none makes its own. */
void lum_view_share(struct lum_view *view, struct lum_caches *caches);

/* Runs one pass. *cancel (may be NULL) is read per tile: on true the pass ends early with LUM_ERR_CANCELLED, and the film
 * keeps the tiles that were done. Restarts by itself when snapshot or settings differ from the last pass in a way that
 * matters. Thread: one at a time per pool (the director). */
enum lum_status lum_view_pass(struct lum_view *view, const struct lum_snapshot *snapshot,
                              const struct lum_view_settings *settings, const _Atomic bool *cancel,
                              struct lum_pass_stats *ret_stats, struct lum_error *err);

/* Forgets every memoised stage, but keeps the memory, so that the next pass does all its work and allocates nothing: for
 * timing. The records of a cache are not the view's, and stay. */
void lum_view_forget(struct lum_view *view);

/* The picture so far; valid until the next pass. */
const struct lum_film *lum_view_film(const struct lum_view *view);

/* Where the last pass refined its samples of an effect: how often the pixel's tile of the sampling pattern was, w * h, row by
 * row. NULL: the method made no such map. Valid until the next pass. */
const uint8_t *lum_view_guidance(const struct lum_view *view, enum lum_effect effect);
#define LUM_GUIDANCE_MAX 9u /* iterations of the thesis' pattern, the first one included: all its sample sets */
/* Colours of such a map, linear: blue where a tile of the pattern was not refined, red the more often it was (5.3). */
struct lum_rgb lum_guidance_color(uint32_t iterations, uint32_t max);

/* First-hit buffers of the last pass, through pixel centres; each may be NULL when not made yet. Arrays are w * h. */
struct lum_aovs {
    const struct lum_rgb *albedo;
    const struct lum_vec3 *normal_world; /* shading normal */
    const float *depth_m;                /* distance along the ray; +inf: background */
    const uint32_t *instance;            /* LUM_NO_OBJECT: background */
};
/* Renders the G-buffer if it is stale, then returns it. Thread: as lum_view_pass. */
enum lum_status lum_view_aovs(struct lum_view *view, const struct lum_snapshot *snapshot,
                              const struct lum_view_settings *settings, struct lum_aovs *ret_aovs, struct lum_error *err);

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

/* Illuminance at a point by path tracing n_samples, split over the pool: direct and indirect, with standard error. */
struct lum_probe {
    double illuminance_lx, stderr_lx;
    struct lum_rgb irradiance;
};
enum lum_status lum_probe_at(struct lum_pool *pool, const struct lum_snapshot *snapshot, struct lum_vec3d point_world,
                             struct lum_vec3 normal, uint32_t n_samples, uint32_t seed, struct lum_probe *ret_probe,
                             uint64_t *ret_rays, struct lum_error *err);

#endif
