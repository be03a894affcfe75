/* Effect by effect buffers of a deferred view: the component pipeline of the thesis (5.2).
 *
 * Estimators write `raw`, pixel by pixel or at a quarter of the resolution, from interleaved samples; the method's filter
 * makes `smooth` of it; the composite multiplies albedo in:
 *   L = sum of layers + albedo (shadow + indirect) + gloss, dimmed by media on its way to the eye, + media.
 * Buffers exist only for effects that are on. They hold the sum over the lights at their present power: any change of what
 * the eye or the lights see makes all of them anew. What a change of power alone leaves as it was is kept apart: airlight. */
#ifndef LUM_CORE_ESTIMATOR_COMPONENTS_H
#define LUM_CORE_ESTIMATOR_COMPONENTS_H

#include "core/estimator/echo.h"
#include "core/interleave/interleave.h"
#include "core/pass/pass.h"

enum lum_component {
    LUM_COMPONENT_SHADOW,   /* direct light of emitters that are sampled: radiance of a white surface (irradiance / pi) */
    LUM_COMPONENT_INDIRECT, /* indirect light: the same */
    LUM_COMPONENT_GLOSS,    /* radiance reflected otherwise than by the diffuse base */
    LUM_COMPONENT_MEDIA,    /* radiance scattered towards the eye */
    LUM_COMPONENT_COUNT
};
#define LUM_COMPONENT_BIT(c) (1u << (c))

struct lum_component_buffer {
    /* w * h, row by row; NULL: nothing calls for it. raw has room for (w + 1) * (h + 1): it may be used for up to two pictures
     * of a quarter of the resolution instead, rounded up. */
    struct lum_rgb *raw, *smooth;
    uint8_t *iterations;          /* w * h: how often the pixel's tile of the pattern was refined, for the guidance map */
};

/* What a medium scatters of one light's light towards the eye, per unit of its power, by points on the pixel's ray: their mean, and
 * its luminance were nothing in the way. */
struct lum_airlight {
    struct lum_rgb seen;
    float open;
    struct lum_rgb resolved; /* from the points around, too: what the eye gets */
};
#define LUM_AIRLIGHTS_MAX 16u /* pairs of medium and light that are kept apart; all further ones share the last */
#define LUM_AIRLIGHTS_BYTES ((size_t)256 << 20) /* of all pairs: in pictures above half a million pixels fewer are kept apart */

/* What the glossy paths of a ray batch tile bring home, and where they went for it. */
struct lum_gain;
struct lum_path_segment;
enum lum_gloss_state {
    LUM_GLOSS_NONE,  /* to be traced */
    LUM_GLOSS_KEPT,  /* gains are of the present scene, and all of them */
    LUM_GLOSS_MOVED, /* but for what moved since the pass before: those whose segments that met are to be traced */
};
struct lum_gloss_tile {
    struct lum_gain *gains;
    struct lum_path_segment *segments;
    uint32_t n, capacity, n_segments, segment_capacity;
    enum lum_gloss_state state;
    bool followed; /* the segments are all of them */
    float kept, cut; /* sums of luminance: what the pixels got, and what of too bright paths they did not */
};
/* Of the gains of all tiles, and as much again of segments; beyond, a tile is traced anew when a light is dimmed, or anything
 * moves. */
#define LUM_GLOSS_BYTES ((size_t)128 << 20)

struct lum_components {
    struct lum_component_buffer buffer[LUM_COMPONENT_COUNT];
    struct lum_airlight *airlight; /* by pair and pixel; NULL: estimator `airlight` is not called for */
    uint8_t *airlight_traced;      /* by pair and packet: it holds points of the present scene, and what they say is resolved */
    uint32_t n_airlights;
    bool airlights_shared;         /* there are more pairs: the last buffer holds their sum, at their present power */
    struct lum_gloss_tile *gloss; /* by ray batch tile; NULL: estimator `glossy` is not called for */
    uint8_t *gloss_lit;           /* by light: it shone whenever they were traced, so that paths looked for it */
    uint32_t n_gloss_lit;
    struct lum_echo *echoes;      /* by tile: indirect light behind mirrors and glass; NULL: there is none, or fog,
                                   * which terms leave out; or no memory */
    _Atomic uint64_t vpl_print;   /* lum_echo_print of the pass's VPLs; 0: nobody asked yet */
    struct lum_rgb *radiance; /* w * h: the composite's, before anti-aliasing; NULL: that is off */
    uint32_t *lenders;        /* w * h, with radiance: at edges, which neighbours lend theirs (edges.c) */
    uint8_t *lenders_known;   /* by tile */
    struct lum_square_sites *sites; /* by tile: which of its pixels interpolate records (sites.h) */
    uint8_t *sites_known;
    uint8_t *taps;                  /* w * h: from which samples of a quarter of the resolution a pixel takes (lum_upsample_taps);
                                     * found with the sites */
    uint32_t w, h;
    uint8_t *done[LUM_STAGE_COUNT]; /* by stage, and packet or tile: nothing left to do there */
    uint32_t n_tiles;
    /* what they show */
    struct lum_basis basis;
    uint64_t surfaces; /* version of the surfaces */
};

void lum_components_finish(struct lum_components *c);

/* Of what paths of gloss brought home, and was too bright: the pixels of a rectangle of whole tiles get what the tiles around cut,
 * in proportion to what they have. smooth: w * h. Once all tiles are traced. */
void lum_gloss_give_back(const struct lum_pass *pass, const struct lum_tile_rect *r, struct lum_rgb *smooth);

/* Makes the buffers that the pass calls for, frees the others, and marks everything as undone if anything that they depend on
 * has changed. On failure there are none. */
LUM_MUST_USE enum lum_status lum_components_update(struct lum_components *c, const struct lum_pass *pass, struct lum_error *err);

/* For an estimator: true when the packet or tile is done already; else says so for the next time. */
bool lum_components_enter(const struct lum_pass *pass, enum lum_stage stage, uint32_t tile);

/* Adds radiance to a pixel of a raw buffer; nothing if the buffer does not exist. */
static inline void lum_component_add(struct lum_components *c, enum lum_component which, size_t pixel, struct lum_rgb value)
{
    struct lum_rgb *raw = c->buffer[which].raw;
    if (raw)
        raw[pixel] = lum_rgb_add(raw[pixel], value);
}

/* What guides filters: the surfaces of the pass. */
struct lum_guide lum_components_guide(const struct lum_pass *pass);

/* Adds what the components of a pixel contribute to its radiance: called by the composite. */
struct lum_rgb lum_components_radiance(const struct lum_pass *pass, size_t pixel, struct lum_rgb layers);

#endif
