/* Guth's position index: how much less a source glares away from the line of sight than on it. */
#ifndef LUM_CORE_MEASURE_POSITION_INDEX_H
#define LUM_CORE_MEASURE_POSITION_INDEX_H

#include "core/math/vec.h"

#define LUM_POSITION_INDEX_MAX 16.0 /* where tables of it end */

/* Of what lies at unit direction wi, for a line of sight and an upright that are unit vectors at right angles; at most
 * 16. INFINITY: behind the eye. The closed form of Guth's data above the line of sight (as in evalglare), below it that
 * of Iwata & Tokura (1997). DGP was made with it; from the table of CIE 117 it differs by up to a tenth: 0.7 of UGR for
 * one lamp. */
double lum_position_index(struct lum_vec3 sight, struct lum_vec3 up, struct lum_vec3 wi);

/* The same for UGR: above the line of sight the table of CIE 117:1995. INFINITY where it ends, at 62 degrees above and
 * 71.6 degrees aside: lamps are no sources there. Below the line of sight, where it has no values, the closed form. */
double lum_position_index_ugr(struct lum_vec3 sight, struct lum_vec3 up, struct lum_vec3 wi);
/* That table, between its values linear in both; INFINITY where it has none. t_r: how far aside, over how far ahead;
 * h_r: how far above, likewise. Neither is negative. */
double lum_position_index_table(double t_r, double h_r);

#endif
