/* The angle of a vector (c, s) of any length with s >= 0, in [0, pi], for closed forms that need it by the million: a
 * third of the cost of atan2. (0, 0): NaN.
 *
 * Turned to within pi / 8 of the x axis; there atan t = t + t^3 q(t^2), q: Chebyshev's expansion on [0, tan(pi / 8)^2].
 * The relative error is at most 1.2e-13, and vanishes with the angle. */
#ifndef LUM_CORE_MATH_ANGLE_H
#define LUM_CORE_MATH_ANGLE_H

#include <math.h>

#include "core/math/vec.h"

static inline double lum_angle(double s, double c)
{
    const double tan_1_8 = 0.41421356237309503, tan_3_8 = 2.4142135623730951;
    double a = fabs(c), top = s, bottom = a, turn = 0.0;
    if (s > tan_3_8 * a)
        top = -a, bottom = s, turn = 0.5 * LUM_PI_D;
    else if (s > tan_1_8 * a)
        top = s - a, bottom = s + a, turn = 0.25 * LUM_PI_D;
    double t = top / bottom, z = t * t;
    double q = 0.032998506119222212;
    q = q * z - 0.060298227269421065;
    q = q * z + 0.076053967670758435;
    q = q * z - 0.090841722648619894;
    q = q * z + 0.11110823997319579;
    q = q * z - 0.1428570823585604;
    q = q * z + 0.19999999951296193;
    q = q * z - 0.33333333333270027;
    double angle = turn + (t + t * z * q);
    return c < 0.0 ? LUM_PI_D - angle : angle;
}

#endif
