/* Portals: where light from afar comes in, by windows, skylights, doors (Bitterli et al. 2015 have them drawn by hand;
 * here they are found).
 *
 * A box around what is inside, its faces cut into cells. A line of sight from inside leaves the box through one cell,
 * and the open cells are those through which such lines get out (core/vpl/portals.c finds them). They say where to
 * look for light, not what is there: all that samples by them also samples without, and weighs by both, so that cells
 * which are shut, or openings that nobody found, cost time and no truth. */
#ifndef LUM_CORE_LIGHT_PORTALS_H
#define LUM_CORE_LIGHT_PORTALS_H

#include <stdbool.h>
#include <stdint.h>

#include "core/math/vec.h"

#define LUM_PORTALS_SIDE 64u  /* cells along an edge of a face, at most */
#define LUM_PORTALS_MAX 1024u /* open ones: where there are more, cells are larger */

/* Zeroed: none. */
struct lum_portals {
    struct lum_vec3 lo, hi; /* the box, scene space */
    uint32_t side;          /* cells along the longest edge: a power of 2; cells are numbered as if all had as many */
    uint32_t along[3];      /* and along those of each axis, so that they are about square */
    uint32_t n;             /* open ones */
    uint32_t cell[LUM_PORTALS_MAX];
    float centre[3][LUM_PORTALS_MAX];                              /* of each of these */
    uint32_t first[7];                                             /* of each face in cell[], and the end of the last */
    uint64_t open[6u * LUM_PORTALS_SIDE * LUM_PORTALS_SIDE / 64u]; /* a bit for each cell, in the order of cell[] */
};

/* Where a line meets the box. */
struct lum_portal_hit {
    float distance; /* along it */
    float cosine;   /* between it and the face's normal */
    float area;     /* of the cell, scene units */
    uint32_t cell;
};
/* Where the ray p + t d, d of any length but 0, from a p inside the box leaves it. False: p is not inside. */
bool lum_portals_leave(const struct lum_portals *o, struct lum_vec3 p, struct lum_vec3 d,
                       struct lum_portal_hit *ret_hit);
/* Where the line enters the box, whichever of its points p is. False: it misses the box. */
bool lum_portals_enter(const struct lum_portals *o, struct lum_vec3 p, struct lum_vec3 d,
                       struct lum_portal_hit *ret_hit);

/* Cuts the box that lo and hi say into shut cells. */
void lum_portals_cut(struct lum_portals *o, struct lum_vec3 lo, struct lum_vec3 hi, uint32_t side);

/* Numbers of cells on a face. */
static inline uint32_t lum_portals_per_face(const struct lum_portals *o)
{
    return o->side * o->side;
}

static inline bool lum_portals_is_open(const struct lum_portals *o, uint32_t cell)
{
    return o->open[cell / 64u] >> cell % 64u & 1u;
}

/* Point u in [0, 1)^2 of a cell, and the face's unit normal, which points inwards. */
struct lum_vec3 lum_portals_point(const struct lum_portals *o, uint32_t cell, struct lum_vec2 u,
                                  struct lum_vec3 *ret_n);
/* Of a cell of a face across this axis. */
float lum_portals_cell_area(const struct lum_portals *o, uint32_t axis);
/* The unit normal of a face, 0 to 5, inwards. */
struct lum_vec3 lum_portals_normal(uint32_t face);
/* The cell of the same face, dx and dy cells from it. False: there is none. */
bool lum_portals_beside(const struct lum_portals *o, uint32_t cell, int dx, int dy, uint32_t *ret_beside);
/* What a point outside sees of the open cells that face it: of each about its form factor with a surface there. */
struct lum_portals_seen {
    float part[LUM_PORTALS_MAX]; /* in the order of cell[] */
    float all;                   /* 0: it faces none */
};
void lum_portals_see(const struct lum_portals *o, struct lum_vec3 p, struct lum_vec3 n, struct lum_portals_seen *ret);
/* Draws a point of a cell in proportion to that, evenly over the cell: a unit direction from p to it, and where it goes
 * in. False: none. */
bool lum_portals_aim(const struct lum_portals *o, const struct lum_portals_seen *seen, struct lum_vec3 p,
                     struct lum_vec2 u, struct lum_vec3 *ret_d, struct lum_portal_hit *ret_hit);
/* The chance of a cell; and over solid angle the density of direction d, unit: 0 where it goes in by no open cell. */
float lum_portals_chance(const struct lum_portals *o, const struct lum_portals_seen *seen, uint32_t cell);
float lum_portals_aim_pdf(const struct lum_portals *o, const struct lum_portals_seen *seen, struct lum_vec3 p,
                          struct lum_vec3 d);
bool lum_portals_inside(const struct lum_portals *o, struct lum_vec3 p);
/* Opens a cell, if it is shut. False: there is no more room. lum_portals_sort ends it. */
bool lum_portals_open(struct lum_portals *o, uint32_t cell);
void lum_portals_sort(struct lum_portals *o);

#endif
