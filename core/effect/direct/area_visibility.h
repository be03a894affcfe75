/* What a layer keeps of a light whose shadows are soft, for the estimators of effect/area_shadow.
 *
 * A light has 16 points, a (0,4,2)-net on it, in the same strata for every pixel: pixel (x, y) begins with number
 * lum_pattern_subset(4, x, y), so that any 4 x 4 window in which all are asked holds all of them (interleaved
 * sampling), and neighbours can lend each other what they know. Of each point a pixel knows one of four things; see
 * struct lum_visibility. */
#ifndef LUM_CORE_EFFECT_DIRECT_AREA_VISIBILITY_H
#define LUM_CORE_EFFECT_DIRECT_AREA_VISIBILITY_H

#include "core/base/arena.h"
#include "core/light/sample.h"
#include "core/pass/pass.h"

#define LUM_AREA_POINTS 16u /* samples of a lamp in a pixel: a bit each */
#define LUM_AREA_SIDE 4u    /* of the pattern: points = side * side */
/* In a stratum of a disc or a mesh: 8 x 8. With 16 what a pixel can know is half as noisy again (area_shadow_test). */
#define LUM_AREA_STRATUM_POINTS 64u

/* Shadow samples of a pixel: bit k is sample k.
 *   traced, visible  what it says
 *   neither          not known
 *   visible alone    known not to contribute: the point lies below the pixel's horizon. Soft layers only */
struct lum_visibility {
    uint16_t traced, visible;
};

/* Sums over the pixels of a tile of the pattern. */
struct lum_visibility_tally {
    uint16_t known, traced, visible;
};

/* What the samples of a tile of the pattern, or of several, say of a light. */
enum {
    LUM_AREA_LIT = 1,
    LUM_AREA_DARK = 2,
};

enum lum_area_begun {
    LUM_AREA_TO_BEGIN,
    LUM_AREA_DOUBTED, /* the same; and materials changed since: of what is known, only what rays found out is true */
    LUM_AREA_BEGUN,   /* every pixel that is asked first has its stratum */
};

#define LUM_AREA_UNKNOWN (-1.0f) /* in the place of light, which is never below 0 */

/* A stamp is lum_layers.n_passes at the time; 0: never. */
struct lum_area_visibility {
    uint32_t salt; /* with the seed: of the points */
    struct lum_vec2 point[LUM_AREA_POINTS];
    /* bits of four points that are a net of their own: pixels that begin with one of these, one in each 2 x 2 block,
     * are asked first, the others only where these do not agree */
    uint16_t first_points;
    /* LUM_AREA_STRATUM_POINTS in the stratum of each point; NULL: the light is no disc or mesh */
    struct lum_light_place *place;
    bool placed; /* these are the scene's, and of these points */

    struct lum_arena arena; /* of all that follows but what panes leave */

    /* by pixel, row by row of the picture */
    struct lum_visibility *visibility; /* NULL: the layer is not one of an area light */
    struct lum_visibility *history;    /* before the eye last moved; NULL: settings->reproject_shadows is off */
    /* what panes leave (lum_transmittance_pack) of the stratum that the pixel begins with, or where that is not visible
     * of the first that is; else 0. NULL: there are none */
    uint32_t *left, *history_left;
    float *ratio;           /* of the light that the window around the pixel gets; lights with a closed form */
    struct lum_rgb *direct; /* the light's response but for emission and mirrors; tile by tile, as lum_layer.response */

    /* by tile of the pattern, row by row */
    struct lum_visibility_tally *tally;
    uint64_t *hashes;       /* of what its pixels know */
    uint64_t *ratio_hashes; /* of ratio and of what its pixels know, where there is a ratio */
    uint64_t *shared;       /* of the hashes around when ratio was made; 0: it is stale */
    uint64_t *resolved;     /* of the ratio_hashes around when direct was made; 0: it is stale */
    float *unshadowed;      /* luminance that the light brings at power 1, with nothing in the way, or
                             * LUM_AREA_UNKNOWN until its surfaces have been looked at */
    uint8_t *first;         /* LUM_AREA_ bits of the pixels that are asked first, by that stratum alone */
    uint8_t *all_asked;     /* 1: these do not agree with those around, so that every pixel has its first stratum */
    uint8_t *goal;          /* strata that its pixels shall know after this pass; 0: no more than they do */
    /* 1: something was forgotten, or who is asked changed, since it was last refined; others learn no more until the
     * scene rests, so that nothing flickers where an edit changes nothing */
    uint8_t *open;
    uint8_t *dimmed; /* 1: `left` of any of its pixels is not 0; NULL as that */

    /* by cell */
    uint8_t *begun;    /* enum lum_area_begun */
    uint32_t *asked;   /* stamp: its first pixels were last asked */
    uint32_t *changed; /* stamp: something in `first` last changed */
    uint32_t *filled;  /* stamp: the others were last looked at, and asked where all_asked says so */

    /* by tile of the picture */
    uint32_t *told;    /* stamp: what its pixels know last changed */
    uint32_t *settled; /* stamp: direct was last up to date */
};

/* salt: names the light. False: memory is short, and *ret_visibility is as if finished. */
bool lum_area_visibility_init(struct lum_area_visibility *ret_visibility, const struct lum_pass *pass, uint32_t salt);
void lum_area_visibility_finish(struct lum_area_visibility *s);
/* Makes or drops what is kept of panes: those of which pixels know something came or went. False: memory is short. */
bool lum_area_visibility_fit_panes(struct lum_area_visibility *s, const struct lum_pass *pass, bool panes);
/* Finds the places of the light, number `index` of the snapshot, unless they are known. False: memory is short. */
bool lum_area_find_stratum_points(struct lum_area_visibility *s, const struct lum_snapshot *snapshot, uint32_t index);
/* Nothing is known any more. */
void lum_area_visibility_forget(struct lum_area_visibility *s, const struct lum_pass *pass);
/* The eye moved: what is known belongs to the picture before. */
void lum_area_visibility_to_history(struct lum_area_visibility *s, const struct lum_pass *pass);
/* Something moved, as pass->motion_mask says; bounds: of the light, which did not. What cannot have changed stays
 * known. inout_whole: tiles of the picture where something was forgotten become 0. Returns in how many tiles of the
 * pattern something was known and is not any more. */
uint32_t lum_area_visibility_follow_motion(struct lum_area_visibility *s, const struct lum_pass *pass,
                                           const struct lum_bounds *bounds, uint8_t *inout_whole);
/* Materials changed: what rays found out stays, what surfaces themselves hid, or what was not worth a ray, is decided
 * anew. */
void lum_area_visibility_reconsider(struct lum_area_visibility *s, const struct lum_pass *pass);
/* What surfaces make of the light changed, and nothing of who sees it: fog, say. All that is known stays. */
void lum_area_visibility_reshade(struct lum_area_visibility *s, const struct lum_pass *pass);
size_t lum_area_visibility_bytes(void); /* per pixel, about */

/* A point of the same stratum: the digits below the stratum's are exclusive-ored with these 12 bits of each coordinate,
 * which leaves the 16 points a (0,4,2)-net. */
static inline struct lum_vec2 lum_area_scramble(struct lum_vec2 point, uint32_t x_bits, uint32_t y_bits)
{
    int32_t x = (int32_t)(point.x * 0x1p24f) ^ (int32_t)(x_bits & 0xfff) << 10;
    int32_t y = (int32_t)(point.y * 0x1p24f) ^ (int32_t)(y_bits & 0xfff) << 10;
    return (struct lum_vec2){(float)x * 0x1p-24f, (float)y * 0x1p-24f};
}

/* Hash of one pixel more. */
static inline uint64_t lum_area_visibility_hash(uint64_t hash, struct lum_visibility visibility)
{
    hash = (hash ^ ((uint32_t)visibility.traced << 16 | visibility.visible)) * 0x9e3779b97f4a7c15u;
    return hash ^ hash >> 32;
}

/* LUM_AREA_ bits of tile (x, y) of the pattern and of its neighbours. 0: no sample could contribute. */
uint32_t lum_area_around(const struct lum_area_visibility *s, const struct lum_tiling *subsets, uint32_t x, uint32_t y);

/* The tiles of the pattern in a picture. */
static inline struct lum_tiling lum_area_tiling(const struct lum_pass *pass)
{
    return lum_tiling_make(pass->tiling.w, pass->tiling.h, LUM_AREA_SIDE);
}

#endif
