#include "server/director/exposure.h"

#include <math.h>

#define ALIKE 0.02 /* stops: a change of 1.4 %, which nobody sees */

static void follow(struct lum_auto_exposure *a, double goal, int64_t now_ns)
{
    double to = fmin(fmax(a->ev, goal - LUM_EXPOSURE_LATITUDE), goal + LUM_EXPOSURE_LATITUDE);
    bool far = fabs(to - a->ev) > ALIKE;
    if (far && a->follows)
        a->ev += (to - a->ev) * -expm1((double)(now_ns - a->moved_ns) * -1e-9 / LUM_EXPOSURE_FOLLOWS_S);
    a->follows = far; /* it begins with the next picture: this one is the first that shows the change */
    a->moved_ns = now_ns;
}

void lum_auto_exposure_see(struct lum_auto_exposure *a, double goal, bool fit, int64_t now_ns)
{
    if (!a->settled) {
        a->ev = goal;
        a->settled = fit && goal != 0.0;
        a->follows = false;
    } else if (goal == 0.0) {
        a->follows = false;
    } else if (fit) {
        follow(a, goal, now_ns);
    }
}
