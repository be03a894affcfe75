/* Automatic exposure of a view: settled with the first samples of a camera, then kept, so that a dimmed lamp looks
 * dimmer; but where light changes by more than its latitude it follows slowly, as a camera's does. Internal to the
 * director. */
#ifndef LUM_SERVER_DIRECTOR_EXPOSURE_H
#define LUM_SERVER_DIRECTOR_EXPOSURE_H

#include <stdbool.h>
#include <stdint.h>

/* So many stops too bright or too dark it may be: the rest is followed. A lamp dimmed to a quarter is no change of the
 * light, a room that gets a dozen lamps is one. */
#define LUM_EXPOSURE_LATITUDE 1.5
#define LUM_EXPOSURE_FOLLOWS_S 1.0       /* after which 1 / e of what is to be followed is left */
#define LUM_EXPOSURE_STEP_NS 100000000ll /* between pictures that differ by nothing else */

struct lum_auto_exposure {
    double ev;
    bool settled;
    bool follows;     /* the next picture is to be another */
    int64_t moved_ns; /* when it last followed */
};

/* The picture that is shown now would be exposed to `goal` by itself; 0: it is black, which says nothing. fit: it is as
 * bright as what becomes of it. */
void lum_auto_exposure_see(struct lum_auto_exposure *a, double goal, bool fit, int64_t now_ns);

#endif
