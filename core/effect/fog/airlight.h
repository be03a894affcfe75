/* Single scattering in media, for the method `live`: interleaved 4 x 4, each pixel of the pattern looks at one stratum
 * of the distance along its ray.
 *
 *   trace    per pixel and pair of medium and light one point, of many pairs fewer: where the light passes near the
 *            ray it is drawn by the angle under which the light sees the ray, which makes halos as even as the rest;
 *            else as the medium dims. Strata are in that variable, and only over the part of the ray that the light
 *            can reach (the cone of a spot, the front of a panel). Where in its stratum a point lies changes from tile
 *            to tile.
 *   refine   where the four interleaved quarters of a tile's strata disagree on what is hidden, or its neighbours' do,
 *            by more than is lost in what the tile gets in all, its pixels take further strata, shifted such that all
 *            points of the tile are evenly spaced
 *   resolve  light at one place, whose scattered light varies fast over the picture, is integrated as if nothing were
 *            in the way, pixel by pixel without a ray, and multiplied by the share that the points around it see
 *            (the ratio estimator of Heitz, Hill & McGuire 2018); all else is the mean of the points around
 *   join     and is smoothed once more
 * Neighbours lend what they know if their rays end at about the same depth: normals do not matter to fog.
 *
 * Points are kept per unit of power: another colour, intensity or switch of a light is another sum of them, without a
 * ray, but for the pairs that share a buffer. How many points a tile has was decided by the powers when it was traced:
 * a fresh view may take others there, and what it shows in their windows differs by what is let pass (TOLERANCE).
 *
 * airlight.c traces and refines, airlight_resolve.c resolves and joins, airlight_draw.c knows pairs and rays,
 * airlight_keep.c what is kept. */
#ifndef LUM_CORE_EFFECT_FOG_AIRLIGHT_H
#define LUM_CORE_EFFECT_FOG_AIRLIGHT_H

#include "core/effect/direct/layers.h"
#include "core/pass/components.h"

#define LUM_AIRLIGHT_SIDE 4u /* of the pattern, in pixels */

/* What is done in a cell; of a pair: up to LUM_AIRLIGHT_RESOLVED. */
enum { LUM_AIRLIGHT_UNTRACED, LUM_AIRLIGHT_TRACED, LUM_AIRLIGHT_RESOLVED };

/* What a medium scatters of one light's light towards the eye, per unit of its power, by points on the pixel's ray:
 * their mean, and its luminance were nothing in the way. */
struct lum_airlight {
    struct lum_rgb seen;
    float open;
    struct lum_rgb resolved; /* from the points around, too: what the eye gets */
};
#define LUM_AIRLIGHTS_MAX 16u /* pairs of medium and light that are kept apart; all further ones share the last */
#define LUM_AIRLIGHTS_BYTES                                                                                            \
    ((size_t)256 << 20) /* of all pairs: in pictures above half a million pixels fewer are kept apart */

/* What a view keeps of it. */
struct lum_airlights {
    struct lum_airlight *kept; /* by slot and pixel */
    struct lum_memo
        made;    /* by slot and cell, LUM_AIRLIGHT_: it holds points of the present scene; what they say is resolved */
    uint32_t n;  /* slots */
    bool shared; /* there are more pairs: the last slot holds their sum, at their present power */
    size_t n_pixels;
    uint32_t n_cells;
};
extern const struct lum_state_kind lum_airlights_kind;
static inline struct lum_airlights *lum_airlights_of(const struct lum_pass *pass)
{
    return lum_pass_state(pass, &lum_airlights_kind);
}
static inline uint32_t lum_airlight_item(const struct lum_airlights *lights, uint32_t slot, uint32_t cell)
{
    return slot * lights->n_cells + cell;
}
static inline struct lum_airlight *lum_airlight_at(const struct lum_airlights *lights, uint32_t slot, size_t pixel)
{
    return &lights->kept[slot * lights->n_pixels + pixel];
}

/* Of medium and light that shines. Those for which there is no buffer share the last, at their present power, and are
 * not refined. */
struct lum_airlight_pair {
    uint32_t medium, light, slot;
    bool alone;
};
/* Pair i, from 0; false: there are no more. Pairs that share a slot follow each other. */
bool lum_airlight_next(const struct lum_pass *pass, uint32_t i, struct lum_airlight_pair *ret_pair);
/* What its points are multiplied by. */
struct lum_rgb lum_airlight_power(const struct lum_pass *pass, const struct lum_airlight_pair *pair);

/* The ray through the middle of a pixel, up to its surface. */
struct lum_scatter_query lum_airlight_query(const struct lum_pass *pass, const struct lum_airlight_pair *pair,
                                            uint32_t x, uint32_t y);

/* Where on a ray the distance is drawn: by angle, or as light is dimmed. */
struct lum_airlight_draw {
    struct lum_segment segment;
    bool by_angle;
    struct lum_equiangular angle;
    float sigma;
};
/* False: the light reaches no part of the ray that is in the medium. */
bool lum_airlight_plan(const struct lum_scatter_query *q, struct lum_airlight_draw *ret_draw);
float lum_airlight_distance(const struct lum_airlight_draw *draw, float u, float *ret_pdf);

extern const struct lum_estimator lum_estimator_airlight;
extern const struct lum_estimator lum_airlight_resolve; /* goes with it; and, after it, join */

#endif
