/* What an estimator gets to work on: one pass of one view, cut into tiles. Internal to core. */
#ifndef LUM_CORE_RENDER_FRAME_H
#define LUM_CORE_RENDER_FRAME_H

#include "core/math/sampler.h"
#include "core/render/stale.h"
#include "core/render/view.h"
#include "core/scene/motion.h"

/* A tile is one ray batch: up to 16 x 16 pixels, row by row. Tiles at the right and lower edge are smaller. */
#define LUM_TILE_SIDE 16u
#define LUM_TILE_PIXELS (LUM_TILE_SIDE * LUM_TILE_SIDE)
_Static_assert(LUM_TILE_PIXELS == LUM_RAY_BATCH, "a tile is a ray batch");

/* Counters of one worker; summed after the pass, so that no worker touches another's cache line. */
struct lum_counters {
    _Alignas(LUM_CACHE_LINE) uint64_t rays[LUM_RAY_KIND_COUNT];
    uint64_t tiles[LUM_EFFECT_COUNT];
    int64_t ns[LUM_EFFECT_COUNT];
    uint64_t nonfinite, bad_rays;
    double culled_bound; /* the largest, and not the sum */
    uint32_t worker;     /* whose they are */
};

/* The camera in scene space. */
struct lum_eye {
    struct lum_vec3 o;
    struct lum_frame frame; /* t right, b up, n forward */
    float per_pixel;        /* size of a pixel on the plane at distance 1 */
    float w, h;
};
/* LUM_ERR_INVALID when the camera is not finite, looks nowhere, or its angle is out of 1..179 degrees. */
LUM_MUST_USE enum lum_status lum_eye_init(struct lum_eye *ret_eye, const struct lum_camera *camera,
                                          const struct lum_normalisation *norm, uint32_t w, uint32_t h,
                                          struct lum_error *err);
/* Direction through film position (x, y), of length 1 along the axis, and of unit length; pixel (i, j) covers
 * [i, i + 1) x [j, j + 1). The arithmetic is such that pictures of different width (or height, at equal per_pixel) see
 * the very same rays where they overlap. */
static inline struct lum_vec3 lum_eye_on_plane(const struct lum_eye *eye, float x, float y)
{
    float sx = (2.0f * x - eye->w) * 0.5f * eye->per_pixel, sy = (eye->h - 2.0f * y) * 0.5f * eye->per_pixel;
    return lum_v3_mad(lum_v3_mad(eye->frame.n, eye->frame.t, sx), eye->frame.b, sy);
}
static inline struct lum_vec3 lum_eye_direction(const struct lum_eye *eye, float x, float y)
{
    return lum_normalize(lum_eye_on_plane(eye, x, y));
}

/* The pixel through which the eye sees p, were nothing before it. False: p is behind the eye or beside the picture. */
bool lum_eye_pixel(const struct lum_eye *eye, struct lum_vec3 p, uint32_t *ret_x, uint32_t *ret_y);

/* Where tiles lie in a picture. */
struct lum_tiling {
    uint32_t w, h, side, nx, ny, n;
};
struct lum_tile_rect {
    uint32_t x, y, w, h;
};
struct lum_tiling lum_tiling_make(uint32_t w, uint32_t h, uint32_t side);
struct lum_tile_rect lum_tile_at(const struct lum_tiling *tiling, uint32_t tile);

/* First hits through pixel centres, one batch per tile. */
struct lum_gbuffer {
    struct lum_hits *tiles;
    uint8_t *done;  /* per tile */
    uint64_t stamp; /* changes with what the buffer shows, but for what lum_swept.changed says */
    struct lum_basis basis;
};

/* What the eye sees, ready to shade and to guide filters: one entry per pixel, row by row of the picture. Made from the
 * G-buffer without a ray, for methods that ask for it. */
enum {
    LUM_PIXEL_SURFACE = 1,  /* an object's surface that scatters; else background, emitter shape, unlit */
    LUM_PIXEL_DIFFUSE = 2,  /* its albedo is not black */
    LUM_PIXEL_GLOSS = 4,    /* it reflects with a gloss */
    LUM_PIXEL_SPECULAR = 8, /* it mirrors, or lets light through */
    LUM_PIXEL_SHINES = 16,  /* by itself: or may when switched on: emitters, unlit and emissive materials; the background, whether there is a sky or not */
};
struct lum_surfaces {
    struct lum_vec3 *p, *n, *ng; /* scene space; n: unit shading normal, with normal map; 0 on the background */
    struct lum_rgb *albedo;      /* lum_bsdf_diffuse_albedo: what the components are multiplied by */
    float *depth;                /* distance from the eye, scene units; INFINITY: background */
    uint8_t *kind;               /* LUM_PIXEL_ bits */
    uint32_t *object;            /* as in struct lum_hits */
    struct lum_vec3 *former_p, *former_n; /* p and n before the eye last moved; NULL: settings->carry_shadows is off */
    uint8_t *done;               /* per tile */
    uint64_t stamp; /* of the G-buffer that they show */
    struct lum_basis basis;
    uint64_t version;            /* changes with what they show */
};

/* What moved since the pass before, and where in the picture that may show: what buffers hold stays elsewhere. Found by
 * squares of LUM_SWEPT_SIDE pixels, from the surfaces that the eye saw before. */
#define LUM_SWEPT_SIDE 4u
enum {
    LUM_SWEPT_SAME = 0, /* so that any other counts as changed */
    LUM_SWEPT_MAYBE,    /* it is behind the boxes of what moved: until new first hits have been compared with those before */
    LUM_SWEPT_CHANGED,
};
struct lum_swept {
    const struct lum_snapshot *snapshot; /* of the pass before; held */
    uint64_t stamp;                      /* of the G-buffer after it */
    bool known;                          /* false: nothing moved, or what did may show anywhere; the rest is not made then */
    struct lum_motion motion;
    struct lum_tiling squares;
    struct lum_bounds *seen; /* by square: box around the surface points there, before; empty: there were none */
    uint8_t *background;     /* by square: some of its pixels showed no surface */
    uint64_t seen_stamp;     /* of the surfaces in these two, but for squares that `changed` then */
    uint8_t *changed;        /* by square, LUM_SWEPT_: the eye sees something else there, through the middle of a pixel */
    uint8_t *in_sight;       /* by tile of the picture: something that moved may be behind it, or a pixel beside it */
};
static inline bool lum_swept_is_known(const struct lum_swept *swept)
{
    return swept && swept->known;
}
/* Any square of a tile of the picture has changed, or may have; or one that touches it. */
bool lum_swept_tile(const struct lum_swept *swept, const struct lum_tiling *tiling, uint32_t tile);
bool lum_swept_around_tile(const struct lum_swept *swept, const struct lum_tiling *tiling, uint32_t tile);

struct lum_layers;
struct lum_components;
struct lum_vpl_set;
struct lum_records;
struct lum_guide;
struct lum_stage_runner;

/* One pass. Estimators read it, and write only what belongs to their tile and their worker. */
struct lum_pass {
    const struct lum_snapshot *snapshot;
    const struct lum_view_settings *settings;
    struct lum_eye eye;
    float footprint;                   /* size at distance 1 of a pixel of the picture that this is for: of a rough pass, of the
                                        * frame that follows. What outlives the pass is made for that one */
    struct lum_tiling tiling, packets; /* of ray batches; of LUM_PACKET_SIDE squares */
    bool on[LUM_EFFECT_COUNT];         /* called for, and served by the method: anything else costs nothing */
    /* deferred methods */
    struct lum_gbuffer *gbuffer;
    struct lum_surfaces *surfaces;     /* methods with components */
    struct lum_swept *swept;           /* NULL: as if not known */
    struct lum_layers *layers;         /* light by light buffers (estimator/layers.h) */
    struct lum_components *components; /* effect by effect buffers (estimator/components.h); NULL: the method has none */
    uint32_t cached_sky;               /* environment whose diffuse light the records bring; LUM_NO_OBJECT: there is none */
    const struct lum_vpl_set *vpls;    /* NULL: the method has none, or indirect_diffuse is off */
    struct lum_records *records;       /* methods with a cache (estimator/records.h); NULL: likewise */
    struct lum_guide *guide;           /* of path traced samples (estimator/guide.h); NULL: there is none */
    struct lum_film *film;
    uint32_t *tile_spp;          /* samples that each tile of the film has of the present picture; 0: it shows an older one */
    uint32_t target_spp;         /* tiles that have as many are left alone */
    uint32_t block;              /* pixels a side that share one sample: 1, or more in a rough pass, which leaves tile_spp 0 */
};

/* Bits LUM_EFFECT_BIT of what the pass leaves out. */
static inline uint32_t lum_pass_effects_off(const struct lum_pass *pass)
{
    uint32_t off = 0;
    for (uint32_t e = 0; e < LUM_EFFECT_COUNT; e++)
        off |= pass->on[e] ? 0 : LUM_EFFECT_BIT(e);
    return off;
}

/* Light goes through panes. Without the effect transmission they are opaque, to it and to the eye. */
static inline bool lum_pass_panes(const struct lum_pass *pass)
{
    return pass->snapshot->has_panes && pass->on[LUM_EFFECT_TRANSMISSION];
}

/* The arrays behind struct lum_aovs; made on demand. */
struct lum_aov_buffers {
    struct lum_rgb *albedo;
    struct lum_vec3 *normal_world;
    float *depth_m;
    uint32_t *instance;
    uint64_t stamp; /* of the G-buffer that they show */
    struct lum_basis basis;
};
void lum_aov_finish(struct lum_aov_buffers *aov);
/* The G-buffer is complete. */
LUM_MUST_USE enum lum_status lum_aov_update(struct lum_aov_buffers *aov, const struct lum_pass *pass, struct lum_pool *pool,
                                            struct lum_error *err);

/* A stage of a pass: what is stale in a tile is made anew. Thread: one worker per tile; the counters are its own. */
struct lum_estimator {
    const char *name;
    enum lum_stage stage;
    void (*begin)(const struct lum_pass *pass); /* once before its tiles, on the calling thread; NULL: nothing to do */
    void (*tile)(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters);
    /* In place of begin and tile: all of it. */
    enum lum_status (*run)(const struct lum_pass *pass, const struct lum_stage_runner *runner, struct lum_error *err);
    bool packets;        /* tile numbers a square of pass->packets, not of pass->tiling */
    uint32_t components; /* bits 1 << enum lum_component of the buffers that it fills */
    bool vpls;           /* gathers from virtual point lights */
    bool cache;          /* uses the records of the method's cache */
    bool surfaces;       /* reads pass->surfaces */
    const struct lum_estimator *then; /* goes with it, at another stage or after it; NULL: nothing */
};

extern const struct lum_estimator lum_stage_gbuffer;      /* deferred: first hits */
extern const struct lum_estimator lum_stage_surfaces;     /* deferred: what is there, for components and filters */
extern const struct lum_estimator lum_stage_composite;    /* deferred: layers to film */
extern const struct lum_estimator lum_estimator_shadow;   /* deferred: direct light with shadows */
extern const struct lum_estimator lum_estimator_penumbra; /* deferred: direct light with soft shadows, refined pass by pass */
extern const struct lum_estimator lum_estimator_specular; /* deferred: mirror and glass */
extern const struct lum_estimator lum_stage_gloss;        /* filters: what glossy surfaces, mirrors and glass show, */
extern const struct lum_estimator lum_stage_upsample;     /* indirect light to full resolution */
extern const struct lum_estimator lum_estimator_airlight; /* components: single scattering in media, for `live` */
extern const struct lum_estimator lum_estimator_glossy;   /* components: light by way of glossy surfaces */
extern const struct lum_estimator lum_estimator_edges;    /* components: anti-aliasing of edges */
extern const struct lum_estimator lum_shadow_edges;       /* deferred: of those of hard shadows */
extern const struct lum_estimator lum_estimator_path;     /* progressive: everything, unbiased */

/* Of the ray through the centre of pixel (x, y). */
static inline struct lum_vec3 lum_center_direction(const struct lum_pass *pass, uint32_t x, uint32_t y)
{
    return lum_eye_direction(&pass->eye, (float)x + 0.5f, (float)y + 0.5f);
}

/* Fills the rays of a tile through pixel centres: ray i goes through pixel (i % rect.w, i / rect.w) of the tile. */
void lum_tile_center_rays(const struct lum_pass *pass, uint32_t tile, struct lum_rays *ret_rays);

/* A shadow ray from p on a surface (normal ng; 0 0 0: p is in the air) to a light at distance along wi; false when there is no room for an
 * occluder between the two. */
bool lum_shadow_ray(struct lum_rays *rays, struct lum_vec3 p, struct lum_vec3 ng, struct lum_vec3 wi, float distance);

static inline struct lum_trace lum_trace_of(const struct lum_snapshot *s, struct lum_counters *counters)
{
    return (struct lum_trace){.top = s->top, .alpha = s->has_alpha ? &s->alpha : NULL, .bad_rays = &counters->bad_rays};
}
/* Of rays that ask what of a light arrives, for lum_trace_light. panes: some of it may go through glass. */
static inline struct lum_trace lum_trace_of_light(const struct lum_snapshot *s, struct lum_counters *counters, bool panes)
{
    struct lum_trace trace = lum_trace_of(s, counters);
    trace.panes = panes && s->has_panes ? &s->panes : NULL;
    return trace;
}
/* Of rays that start at the eye, neighbours together. */
static inline struct lum_trace lum_trace_of_eye(const struct lum_snapshot *s, struct lum_counters *counters)
{
    struct lum_trace trace = lum_trace_of(s, counters);
    trace.camera = trace.coherent = true;
    return trace;
}

static inline void lum_rays_push(struct lum_rays *r, struct lum_vec3 o, struct lum_vec3 d, float tfar)
{
    uint32_t i = r->n++;
    r->ox[i] = o.x;
    r->oy[i] = o.y;
    r->oz[i] = o.z;
    r->dx[i] = d.x;
    r->dy[i] = d.y;
    r->dz[i] = d.z;
    r->tnear[i] = 0.0f;
    r->tfar[i] = tfar;
}

static inline struct lum_vec3 lum_rays_direction(const struct lum_rays *r, uint32_t i)
{
    return lum_v3(r->dx[i], r->dy[i], r->dz[i]);
}

/* The effect that the light of an emitter belongs to. */
static inline enum lum_effect lum_light_effect(const struct lum_light *l)
{
    if (l->kind == LUM_EMIT_ENVIRONMENT)
        return LUM_EFFECT_ENVIRONMENT;
    return l->delta ? LUM_EFFECT_DIRECT : LUM_EFFECT_SOFT_SHADOW;
}

/* The kind of ray that serves an effect: both enumerations are in the same order but for primary rays. */
static inline enum lum_ray_kind lum_effect_ray_kind(enum lum_effect e)
{
    return (enum lum_ray_kind)((int)e + LUM_RAY_DIRECT);
}
_Static_assert((int)LUM_RAY_ANTIALIAS - LUM_RAY_DIRECT == (int)LUM_EFFECT_ANTIALIAS, "effects and ray kinds in step");

/* The kind of shadow ray that a light asks for. */
static inline enum lum_ray_kind lum_light_ray_kind(const struct lum_light *l)
{
    return lum_effect_ray_kind(lum_light_effect(l));
}

#endif
