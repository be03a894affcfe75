/* What an estimator gets to work on: one pass of one view, cut into tiles. Internal to core. */
#ifndef LUM_CORE_PASS_PASS_H
#define LUM_CORE_PASS_PASS_H

#include "core/film/film.h"
#include "core/pass/eye.h"
#include "core/pass/gbuffer.h"
#include "core/pass/method.h"
#include "core/pass/settings.h"
#include "core/pass/state.h"
#include "core/pass/stats.h"
#include "core/pass/motion_mask.h"
#include "core/trace/rays.h"

struct lum_layers;
struct lum_components;
struct lum_vpl_set;
struct lum_records;
struct lum_path_guide;
struct lum_portals;
struct lum_effect_noise;
struct lum_team;
struct lum_tile_share;

/* One pass. Estimators read it, and write only what belongs to their tile and their worker. */
struct lum_pass {
    const struct lum_snapshot *snapshot;
    const struct lum_view_settings *settings;
    struct lum_eye eye;
    float footprint; /* size at distance 1 of a pixel of the picture that this is for: of a rough pass, of the
                      * frame that follows. What outlives the pass is made for that one */
    struct lum_tiling tiling, cells; /* of ray batches; of cells, LUM_CELL_SIDE a side */
    bool on[LUM_EFFECT_COUNT];       /* called for, and served by the method: anything else costs nothing */
    /* deferred methods */
    struct lum_gbuffer *gbuffer;
    struct lum_surfaces *surfaces;       /* methods with components */
    struct lum_motion_mask *motion_mask; /* NULL: as if not known */
    struct lum_layers *layers;           /* light by light buffers (effect/direct/layers.h) */
    struct lum_components *components;   /* effect by effect buffers (pass/components.h); NULL: the method has none */
    const struct lum_states *states;     /* what estimators keep for themselves (lum_pass_state) */
    uint32_t cached_sky; /* environment whose diffuse light the records bring; LUM_NO_OBJECT: there is none */
    const struct lum_vpl_set *vpls;        /* NULL: the method has none, or indirect_diffuse is off */
    const struct lum_vpl_set *fog_vpls;    /* likewise of what lights fog, whether surfaces get any of it or not */
    struct lum_vpl_set *kept_vpls;         /* where lum_stage_vpls makes them */
    struct lum_records *records;           /* methods with a cache (effect/indirect/records.h); NULL: likewise */
    struct lum_records *kept_records;      /* for lum_stage_cache */
    struct lum_caches *caches;             /* where methods with a cache find theirs */
    const struct lum_portals *portals;     /* for path traced samples; NULL: none */
    struct lum_path_guide *guide;          /* of path traced samples (path/guide.h); NULL: there is none */
    struct lum_effect_noise *effect_noise; /* likewise (path/effect_noise.h); NULL: nobody asks */
    struct lum_film *film;
    uint32_t *tile_spp;  /* samples that each tile of the film has of the present picture; 0: it shows an older one */
    uint32_t target_spp; /* tiles that have as many are left alone */
    uint32_t block;      /* pixels a side that share one sample: 1, or more in a rough pass, which leaves tile_spp 0 */
};

/* Bits LUM_EFFECT_BIT of what the pass leaves out. */
static inline uint32_t lum_pass_effects_off(const struct lum_pass *pass)
{
    uint32_t off = 0;
    for (uint32_t e = 0; e < LUM_EFFECT_COUNT; e++)
        off |= pass->on[e] ? 0 : LUM_EFFECT_BIT(e);
    return off;
}

/* Rays go through all of a pixel. Of illuminance a mean over an edge would be that of no surface. */
static inline bool lum_pass_antialiased(const struct lum_pass *pass)
{
    return pass->on[LUM_EFFECT_ANTIALIAS] && !pass->settings->illuminance;
}

/* Light goes through panes. Without the effect transmission they are opaque, to it and to the eye. */
static inline bool lum_pass_panes(const struct lum_pass *pass)
{
    return pass->snapshot->has_panes && pass->on[LUM_EFFECT_TRANSMISSION];
}

/* How stages run: over whose threads, with whose counters, into which statistics. */
struct lum_stage_runner {
    struct lum_pool *pool;
    struct lum_counters *counters; /* by worker */
    const _Atomic bool *cancel;
    struct lum_pass_stats *stats;
    struct lum_team *team; /* NULL: there are no others. With one what is shared is not cancelled */
};

/* How direct light on what the eye sees is kept, light by light (effect/direct/layers.h). */
enum lum_layering {
    LUM_LAYERING_NONE, /* it is not: the estimator fills a component instead */
    LUM_LAYERING_HARD, /* who sees which sample of the light, and its response */
    LUM_LAYERING_AREA, /* what the pixels around know of the light, too */
};

/* A stage of a pass: what is stale in a tile is made anew. Thread: one worker per tile; the counters are its own. */
struct lum_estimator {
    const char *name;
    enum lum_stage stage;
    void (*prepare)(struct lum_pass *pass);     /* before all stages: what others have to know of it. NULL: nothing */
    void (*begin)(const struct lum_pass *pass); /* once before its tiles, on the calling thread; NULL: nothing to do */
    void (*tile)(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters);
    const struct lum_tile_share *share; /* share.h. NULL: each member of a team makes all tiles */
    /* In place of begin and tile: all of it, on the calling thread; may fill in members of the pass for later stages.
     */
    enum lum_status (*run)(struct lum_pass *pass, const struct lum_stage_runner *runner, struct lum_error *err);
    bool cells;                         /* tile numbers a cell of pass->cells, not of pass->tiling */
    enum lum_layering layering;         /* of lights whose direct light it is to find */
    const struct lum_state_kind *state; /* what it keeps from pass to pass; NULL: nothing */
    uint32_t components;                /* bits LUM_EFFECT_BIT of the buffers that it fills */
    uint32_t joins;                     /* likewise, of those that it fills where the method has any */
    uint32_t lasting; /* of these, those whose `iterations` stay true when lights are dimmed: their samples are kept */
    const struct lum_estimator *smoothed_by; /* filter that its buffers wait for, if one tells them apart */
    bool surfaces;                           /* reads pass->surfaces */
    bool vpls;                               /* reads pass->fog_vpls, of the cache that the method has */
    const struct lum_estimator *then;        /* goes with it, at another stage or after it; NULL: nothing */
};

enum lum_status lum_stage_run(const struct lum_stage_runner *runner, const struct lum_pass *pass,
                              const struct lum_estimator *stage);

/* A parallel loop within a stage that has a `run` of its own. Rays and time are counted by effect. */
typedef void (*lum_stage_fn)(void *ctx, uint32_t job, struct lum_counters *counters);
enum lum_status lum_stage_loop(const struct lum_stage_runner *runner, uint32_t n, lum_stage_fn fn, void *ctx);

/* Of the ray through the centre of pixel (x, y). */
static inline struct lum_vec3 lum_center_direction(const struct lum_pass *pass, uint32_t x, uint32_t y)
{
    return lum_eye_direction(&pass->eye, (float)x + 0.5f, (float)y + 0.5f);
}

/* Fills the rays of a tile through pixel centres: ray i goes through pixel (i % rect.w, i / rect.w) of the tile. */
void lum_tile_center_rays(const struct lum_pass *pass, uint32_t tile, struct lum_rays *ret_rays);

#endif
