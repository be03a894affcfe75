#include "protocol/record/aim.h"

#include <math.h>

#define RAD_PER_DEG (3.14159265358979323846 / 180.0)

/* c0 at roll 0 and c90 = c0 x d. The turn from -Y to d, by Rodrigues with the cosine -d.y, applied to +X. */
static void straight(const double direction[3], double c0[3], double c90[3])
{
    double n = hypot(hypot(direction[0], direction[1]), direction[2]);
    double x = direction[0] / n, y = direction[1] / n, z = direction[2] / n, s = 1.0 - y;
    c0[0] = 1.0, c0[1] = x, c0[2] = 0.0;
    if (s > 1e-12) {
        c0[0] = 1.0 - x * x / s;
        c0[2] = -x * z / s;
    }
    c90[0] = c0[1] * z - c0[2] * y;
    c90[1] = c0[2] * x - c0[0] * z;
    c90[2] = c0[0] * y - c0[1] * x;
}

void lum_aim_c0(const double direction[3], double roll_deg, double ret_c0[3])
{
    double c0[3], c90[3], c = cos(roll_deg * RAD_PER_DEG), s = sin(roll_deg * RAD_PER_DEG);
    straight(direction, c0, c90);
    for (int i = 0; i < 3; i++)
        ret_c0[i] = c * c0[i] + s * c90[i];
}

double lum_aim_roll_deg(const double direction[3], const double c0[3])
{
    double at0[3], at90[3], along0 = 0.0, along90 = 0.0;
    straight(direction, at0, at90);
    for (int i = 0; i < 3; i++) {
        along0 += c0[i] * at0[i];
        along90 += c0[i] * at90[i];
    }
    return along0 == 0.0 && along90 == 0.0 ? 0.0 : atan2(along90, along0) / RAD_PER_DEG;
}
