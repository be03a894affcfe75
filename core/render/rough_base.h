/* The last whole picture, to which a rough one after it adds only what has changed since. Of the light that comes from
 * the coarse frame, what that has now less what it had then; where it had more, both in the same proportion, so that no
 * detail is left of light that is gone. So what an edit does not reach stays as it was to the last bit of noise, edges
 * and all, and what it does is as rough as before. Light that is kept light by light (rough_known.h) is in neither: a
 * lamp that moved would leave its old shadow behind. Internal to core/render. Thread: that of the pass. */
#ifndef LUM_CORE_RENDER_ROUGH_BASE_H
#define LUM_CORE_RENDER_ROUGH_BASE_H

#include "core/effect/direct/layers.h"

struct lum_rough_base {
    struct lum_rgb *fine, *coarse; /* by pixel of either picture: what no layer of a light has; NULL: there is none */
    uint8_t *kept;                 /* by tile of the full picture, 1: nothing has moved there or near since */
    uint32_t coarse_w, coarse_h;
    struct lum_view_settings settings;
    struct lum_versions versions;
};
void lum_rough_base_finish(struct lum_rough_base *base); /* accepts a zeroed one */

/* Takes two pictures of one snapshot, the latter with a part of the pixels. Of a pass these are read: snapshot,
 * settings, eye, tiling, on, surfaces, layers, film; the layers are those that the film was made with. Without memory
 * there is none. */
void lum_rough_base_take(struct lum_rough_base *base, const struct lum_pass *fine, const struct lum_pass *coarse);
/* Forgets what has moved since, and all of it where something else is another: whether there is one now. */
bool lum_rough_base_follow(struct lum_rough_base *base, const struct lum_pass *fine, const struct lum_pass *coarse);
/* Of the pixels of a tile, what no layer of a light has. */
void lum_rough_rest(const struct lum_pass *pass, uint32_t tile, struct lum_rgb *ret_radiance);

#endif
