/* UGR of rooms that are full of one luminaire, as makers print it in their catalogues: CIE 117:1995 and CIE 190:2010.
 *
 * Rooms of X by Y, in multiples of the height H of luminaires above the eye, which looks along Y from the middle of a
 * wall. Luminaires aim down, and form a grid of one spacing whose outer rows are half of it from the walls. The room
 * ends at the luminaires above and at the eye below, and its surfaces are evenly lit:
 *
 *   UGR = 8 log10( 0.25 / Lb * sum of I^2 / (A r^2 p^2) ),  Lb = mean indirect illuminance of the walls / pi
 *
 * I: intensity towards the eye, A: the shining area as it is seen from there, r: how far it is, p: Guth's position
 * index by the table; luminaires where it ends are no sources. H cancels. */
#ifndef LUM_CORE_MEASURE_UGR_TABLE_H
#define LUM_CORE_MEASURE_UGR_TABLE_H

#include "core/light/web.h"

#define LUM_UGR_ROOMS 19u
#define LUM_UGR_PAINTS 5u
/* Catalogues have spacings of a quarter of H; the table that CIE 190 prints has one of H. Even numbers of columns: X is
 * even, and 1 / spacing is whole. */
#define LUM_UGR_SPACING_H 0.25

struct lum_ugr_room {
    uint32_t x_h, y_h; /* across the line of sight, and along it */
};
extern const struct lum_ugr_room lum_ugr_rooms[LUM_UGR_ROOMS];
#define LUM_UGR_4H_8H 10u /* the room that luminaires are compared by */

struct lum_ugr_paint {
    double ceiling, walls, floor; /* reflectances */
};
extern const struct lum_ugr_paint lum_ugr_paints[LUM_UGR_PAINTS]; /* 70/50/20 first */

/* The luminaire's length lies across the line of sight, or along it. */
enum lum_ugr_view { LUM_UGR_CROSSWISE, LUM_UGR_ENDWISE, LUM_UGR_VIEWS };

struct lum_ugr_luminaire {
    const struct lum_web *web;
    bool round;       /* its opening is a disc, or a sphere, of which height is none of size_m */
    bool sphere;      /* the same from all sides */
    double size_m[3]; /* of the opening: along c0, along c90, height */
};

/* In a room of lum_ugr_rooms. spacing_h: over H. NAN: nothing glares, or there is no opening. */
struct lum_ugr_cells {
    double ugr[LUM_UGR_VIEWS][LUM_UGR_PAINTS];
    double walls_lx_h2[LUM_UGR_PAINTS]; /* mean indirect illuminance of the walls, times H^2 */
    double floor_share;                 /* of the luminaires' light that reaches the floor at once */
};
void lum_ugr_room_of(const struct lum_ugr_luminaire *luminaire, uint32_t room, double spacing_h,
                     struct lum_ugr_cells *ret_cells);

/* Lumens that walls get by reflection alone, for each that falls on the floor, the walls and the ceiling at once: the
 * transfer factors of CIE 190 (its table 5), of evenly lit surfaces in closed form. */
struct lum_ugr_transfer {
    double from_floor, from_walls, from_ceiling;
};
struct lum_ugr_transfer lum_ugr_transfer_of(const struct lum_ugr_room *room, const struct lum_ugr_paint *paint);

#endif
