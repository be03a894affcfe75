/* Soft shadows by interleaved samples, guided refinement and the ratio estimator: the stages of
 * lum_estimator_area_shadow.
 *
 *   first    one shadow ray per light for every fourth pixel, each of four another stratum of the light
 *   fill     the same for the other pixels, where those do not agree or a tile of the pattern is not all one surface.
 *            A shadow that falls between those that were asked, a pixel or two wide, is missed, until path samples
 *            correct the picture
 *   refine   further strata where shadow borders are, most useful first, within a budget; while a picture rests, more
 *            of them
 *   ratio    of the light that arrives: measured over a window of the same surface, or over what is alike in it
 *   resolve  response = unshadowed light in closed form * ratio, joined with those around */
#ifndef LUM_CORE_EFFECT_AREA_SHADOW_AREA_SHADOW_H
#define LUM_CORE_EFFECT_AREA_SHADOW_AREA_SHADOW_H

#include "core/effect/direct/layers.h"

/* The next soft layer of a light that shines, with *inout_a from 0; NULL ends. */
struct lum_layer *lum_area_next(const struct lum_pass *pass, uint32_t *inout_a);

/* True when the pixel gets light of the layer here: of a sky whose diffuse light the records bring, only the rest. */
bool lum_area_wants(const struct lum_pass *pass, const struct lum_layer *layer, size_t pixel);

/* A layer as a pixel sees it: what its samples have in common. */
struct lum_area_view {
    const struct lum_pass *pass;
    const struct lum_layer *layer;
    size_t pixel;      /* index into the picture */
    bool wanted;       /* lum_area_wants; else nothing below is set */
    uint32_t scramble; /* of the pixel's points */
    struct lum_light_view light;
};
void lum_area_look(const struct lum_pass *pass, const struct lum_layer *layer, size_t pixel,
                   struct lum_area_view *ret_view);

/* Of the samples that are asked for, one by bit, what lum_light_view_weights says; others are undefined. */
void lum_area_weights(const struct lum_area_view *view, uint32_t asked, float ret_weight[LUM_AREA_POINTS]);

enum lum_area_side {
    LUM_AREA_NEEDLESS, /* no light can come that way, were nothing in between */
    LUM_AREA_HIDDEN,   /* the surface itself is in between: normal and shading normal disagree */
    LUM_AREA_OPEN,
};
enum lum_area_side lum_area_sample(const struct lum_area_view *view, uint32_t k, struct lum_light_sample *ret_sample);

/* Sets the goal of each tile of the pattern. Reads what fill counted. */
void lum_area_plan(const struct lum_pass *pass);

extern const struct lum_estimator lum_area_fill, lum_area_refine, lum_area_ratio, lum_area_resolve;

extern const struct lum_estimator lum_estimator_area_shadow;

#endif
