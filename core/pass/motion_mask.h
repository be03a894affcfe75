/* Where in a picture it may show that something moved. */
#ifndef LUM_CORE_PASS_MOTION_MASK_H
#define LUM_CORE_PASS_MOTION_MASK_H

#include "core/pass/surfaces.h"
#include "core/pass/tiling.h"
#include "core/scene/motion.h"

/* What moved since the pass before, and where in the picture that may show: what buffers hold stays elsewhere. Found by
 * blocks of LUM_MOTION_BLOCK_SIDE pixels, from the surfaces that the eye saw before. */
#define LUM_MOTION_BLOCK_SIDE 4u
enum {
    LUM_MOTION_SAME = 0, /* so that any other counts as changed */
    LUM_MOTION_MAYBE, /* it is behind the boxes of what moved: until new first hits have been compared with those before
                       */
    LUM_MOTION_CHANGED,
};
struct lum_motion_mask {
    const struct lum_snapshot *snapshot; /* of the pass before; held */
    uint64_t stamp;                      /* of the G-buffer after it */
    bool known; /* false: nothing moved, or what did may show anywhere; the rest is not made then */
    struct lum_motion motion;
    struct lum_tiling blocks;
    struct lum_bounds *seen; /* by block: box around the surface points there, before; empty: there were none */
    uint8_t *background;     /* by block: some of its pixels showed no surface */
    uint64_t seen_stamp;     /* of the surfaces in these two, but for blocks that `changed` then */
    uint8_t *changed;  /* by block, LUM_MOTION_: the eye sees something else there, through the middle of a pixel */
    uint8_t *in_sight; /* by tile of the picture: something that moved may be behind it, or a pixel beside it */
};
static inline bool lum_motion_mask_is_known(const struct lum_motion_mask *motion_mask)
{
    return motion_mask && motion_mask->known;
}
/* Any block of a tile of the picture has changed, or may have; or one that touches it. */
bool lum_motion_mask_tile(const struct lum_motion_mask *motion_mask, const struct lum_tiling *tiling, uint32_t tile);
bool lum_motion_mask_around_tile(const struct lum_motion_mask *motion_mask, const struct lum_tiling *tiling,
                                 uint32_t tile);

/* What moved may be between a light and what the eye sees in a tile, or in the pixels beside it. */
bool lum_motion_mask_between(const struct lum_motion_mask *motion_mask, const struct lum_tiling *tiling, uint32_t tile,
                             const struct lum_bounds *light);
/* What moved was or is before the tile or beside it, or as near to what the eye sees there as it is large: it may have
 * left a shadow. */
bool lum_motion_mask_near_tile(const struct lum_motion_mask *motion_mask, const struct lum_tiling *tiling,
                               uint32_t tile);
/* The box of a light that stayed where it was. False: it moved, or has none. What a mesh shines on gets other light
 * when it moves, even where it is seen as before. */
bool lum_motion_mask_light(const struct lum_motion_mask *motion_mask, const struct lum_light *light,
                           struct lum_bounds *ret_bounds);

struct lum_pass;
void lum_motion_mask_finish(struct lum_motion_mask *motion_mask);
/* Finds out what moved since the last call, whose picture the surfaces show; NULL: the method has none. Out of memory,
 * it is not known. */
void lum_motion_mask_update(struct lum_motion_mask *motion_mask, const struct lum_pass *pass,
                            const struct lum_surfaces *surfaces);
/* Decides of the blocks of a tile that may have changed, by its first hits before and now; others have changed where a
 * ray found another of two surfaces in the same place. Thread: any; one a tile. */
void lum_motion_mask_compare(struct lum_motion_mask *motion_mask, const struct lum_tiling *tiling, uint32_t tile,
                             const struct lum_hits *before, const struct lum_hits *now);

#endif
