/* Meshes of few triangles that shine, as a point sees them: lamps of imported rooms are boxes and panels as a rule.
 *
 * By area a triangle that is near has samples of any weight: a ceiling one centimetre above a lamp of half a metre was
 * lit by single samples 40 times as bright as the lamp. So what is near is drawn over the solid angle of the triangles
 * that face the point, each as likely as it is large there, and a point of it evenly (Peters 2021): all samples have
 * one pdf, that of the whole.
 *
 * A convex body, or one flat sheet, hides no part of what faces a point, so that what it sends there has a closed form:
 * the integral along its outline (Lambert 1760), the edges between a triangle that faces the point and one that does
 * not. What lies within LUM_RAY_OFFSET of a triangle's plane, as its own points do, gets nothing of that triangle. In
 * double, as rectangles are (rect.h, irradiance.c). */
#ifndef LUM_CORE_LIGHT_FACETS_H
#define LUM_CORE_LIGHT_FACETS_H

#include "core/light/irradiance.h"
#include "core/math/vec.h"

#define LUM_FACETS_MAX 32u /* triangles; a box has 12. Of a lamp of more than that few points are near enough */

struct lum_facet {
    struct lum_vec3d normal; /* unit, to the side that shines if only one does; 0: it has no area */
    uint8_t corner[3];       /* indices of points */
};

/* From point a to b counter-clockwise around facet `of`, as seen from its normal's side. */
struct lum_facet_edge {
    uint8_t a, b;
    uint8_t of, beyond; /* beyond: the facet on the other side; LUM_FACETS_MAX: there is none */
};

struct lum_facets {
    uint32_t n, n_points, n_edges;
    bool outlined; /* a convex body that is closed, its normals outwards, or a flat convex sheet: edges are set, each of
                    * two facets once */
    bool closed;   /* it is such a body, whose far side nobody sees from outside */
    struct lum_vec3 centre; /* of the ball around them */
    float near2;            /* squared distance from there within which they are drawn over solid angle */
    struct lum_facet facet[LUM_FACETS_MAX];
    struct lum_vec3 point[3 * LUM_FACETS_MAX];
    struct lum_facet_edge edge[3 * LUM_FACETS_MAX];
};

/* n triangles, three corners each; mirrored: their winding was turned by a transform. n: 1 to LUM_FACETS_MAX. */
void lum_facets_init(struct lum_facets *ret_facets, uint32_t n, const struct lum_vec3 (*corner)[3], bool mirrored);

/* True for a point outside of a closed body: it sees what faces it alone. */
bool lum_facets_hide_backs(const struct lum_facets *facets, struct lum_vec3 p);

/* From a point. */
struct lum_facets_view {
    double solid_angle;           /* of those that face it */
    double below[LUM_FACETS_MAX]; /* of these, the sum up to each, without it */
};
/* p: as the facets. False: it is not near, or on a body or sheet itself, or they subtend less than LUM_RECT_MIN_SR:
 * callers sample by area. */
bool lum_facets_look(const struct lum_facets *facets, bool both_sides, struct lum_vec3 p,
                     struct lum_facets_view *ret_view);
/* Vector from p to the sampled point. pdf_sa = 1 / solid_angle. */
struct lum_vec3 lum_facets_sample(const struct lum_facets *facets, const struct lum_facets_view *view,
                                  struct lum_vec3 p, struct lum_vec2 xi);

/* lum_light_irradiance at one point; outlined. */
struct lum_irradiance lum_facets_irradiance(const struct lum_facets *facets, bool both_sides, struct lum_vec3 p,
                                            struct lum_vec3 n);

#endif
