/* How a lamp with a web hangs: where it aims, and how it is turned about that. No other kind has a roll. */
#ifndef LUM_PROTOCOL_RECORD_AIM_H
#define LUM_PROTOCOL_RECORD_AIM_H

/* Unit vector along which C = 0 lies. At roll 0 it is +X of a lamp that aims down, -Y, and is carried along the
 * shortest way to the direction (not 0; need not be unit); straight up it is +X again. A positive roll turns it to
 * where C = 90 was. */
void lum_aim_c0(const double direction[3], double roll_deg, double ret_c0[3]);
/* The roll, -180 to 180 degrees, of which that is c0 (need not be unit, nor at right angles). 0 where c0 is along the
 * direction. */
double lum_aim_roll_deg(const double direction[3], const double c0[3]);

#endif
