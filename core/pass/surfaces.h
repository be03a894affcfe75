/* What the eye sees, ready to shade and to guide filters. */
#ifndef LUM_CORE_PASS_SURFACES_H
#define LUM_CORE_PASS_SURFACES_H

#include "core/base/arena.h"
#include "core/pass/basis.h"
#include "core/pass/memo.h"

/* What the eye sees, ready to shade and to guide filters: one entry per pixel, row by row of the picture. Made from the
 * G-buffer without a ray, for methods that ask for it. */
enum {
    LUM_PIXEL_SURFACE = 1,  /* an object's surface that scatters; else background, emitter shape, unlit */
    LUM_PIXEL_DIFFUSE = 2,  /* its albedo is not black */
    LUM_PIXEL_GLOSS = 4,    /* it reflects with a gloss */
    LUM_PIXEL_SPECULAR = 8, /* it mirrors, or lets light through */
    LUM_PIXEL_SHINES = 16,  /* by itself: or may when switched on: emitters, unlit and emissive materials; the
                               background, whether there is a sky or not */
    LUM_PIXEL_SHEET = 32,   /* it lets light through evenly */
};
struct lum_surfaces {
    struct lum_vec3 *p, *n, *ng; /* scene space; n: unit shading normal, with normal map; 0 on the background */
    struct lum_rgb *albedo;      /* lum_bsdf_diffuse_albedo: what the components are multiplied by */
    float *depth;                /* distance from the eye, scene units; INFINITY: background */
    uint8_t *kind;               /* LUM_PIXEL_ bits */
    uint32_t *object;            /* as in struct lum_hits */
    struct lum_vec3 *history_p, *history_n; /* p and n before the eye last moved; settings->reproject_shadows */
    struct lum_arena arena;                 /* of all of the above */
    struct lum_memo made;                   /* by tile */
    uint64_t stamp;                         /* of the G-buffer that they show */
    struct lum_basis basis;
    uint64_t shining; /* which objects are lamps: a hash */
    uint64_t version; /* changes with what they show */
};

struct lum_pass;
struct lum_gbuffer;
struct lum_tiling;
struct lum_eye;
struct lum_snapshot;
void lum_surfaces_finish(struct lum_surfaces *s);
LUM_MUST_USE enum lum_status lum_surfaces_update(struct lum_surfaces *s, const struct lum_pass *pass,
                                                 struct lum_error *err);

/* What media leave of the light that comes from there to the eye. */
struct lum_rgb lum_pass_transmittance(const struct lum_pass *pass, size_t pixel);
/* What shines by itself in the middle of a pixel, before what fog takes. Black: nothing, or it is off.
 * *ret_light: the light of the snapshot that it is of; LUM_NO_OBJECT: none. */
struct lum_rgb lum_surfaces_shine(const struct lum_snapshot *snapshot, const struct lum_gbuffer *gbuffer,
                                  const struct lum_tiling *tiling, const struct lum_eye *eye, uint32_t x, uint32_t y,
                                  uint32_t *ret_light);
/* Albedo for light on the far side of the sheet that pixel (x, y) shows. Not kept: few pixels show one. */
struct lum_rgb lum_surfaces_far_albedo(const struct lum_pass *pass, uint32_t x, uint32_t y);

struct lum_estimator;
extern const struct lum_estimator lum_stage_surfaces;

#endif
