/* What a rough picture need not guess: light that did not change while another one did, as sharp as the last frame has
 * it in its layers (core/effect/direct/layers.h). Internal to core/render. Thread: that of the pass, but for the sum.
 */
#ifndef LUM_CORE_RENDER_ROUGH_KNOWN_H
#define LUM_CORE_RENDER_ROUGH_KNOWN_H

#include "core/effect/direct/layers.h"

struct lum_rough_known {
    const struct lum_layers *layers; /* borrowed: those of the full picture */
    bool *chosen;                    /* by layer; NULL: none is */
    uint8_t *whole;                  /* by tile of the full picture, 1: every layer that is chosen is known there */
};
/* A frame has been made with the layers: all of them is whole until an edit says otherwise. */
void lum_rough_known_all(struct lum_layers *layers);
/* Chooses layers that are whole in most of the tiles, but none that `coarse`, those of the rough picture, lacks. The
 * lights of both are those of the snapshot. Without memory none is chosen. */
void lum_rough_known_init(struct lum_rough_known *ret_known, const struct lum_layers *layers,
                          const struct lum_layers *coarse, const struct lum_light_table *lights);
void lum_rough_known_finish(struct lum_rough_known *known); /* accepts a zeroed one */
/* light: of the snapshot; LUM_NO_OBJECT: none. */
bool lum_rough_knows(const struct lum_rough_known *known, uint32_t light);
/* Radiance of the pixels of a tile: the sum over lights that are known, by the layers of the pass, which are those of
 * the full picture or of the rough one. Thread: the worker that has the tile. */
void lum_rough_known_sum(const struct lum_rough_known *known, const struct lum_pass *pass, uint32_t tile,
                         uint32_t n_pixels, struct lum_rgb *ret_radiance);

#endif
