/* Where light is measured when nobody says more: a grid over the floor of the whole scene, or on top of an object. */
#ifndef LUM_SERVER_WORLD_WORK_PLANE_H
#define LUM_SERVER_WORLD_WORK_PLANE_H

#include "core/measure/sensor.h"
#include "server/world/world.h"

struct lum_work_plane {
    const char *on;     /* an object, whose top it is; NULL: the whole scene */
    const double *area; /* x0, z0, x1, z1; metres. NULL: all of it */
    double height_m;    /* above the ground, or the top of the object */
    double border_m;    /* left out along the sides; of an area nothing is */
};

/* Fills kind, position, u, v, normal, and of the whole scene floor_m2, the border with it. The ground is looked for
 * downwards from the middle of the scene's height: the lowest that is met, so that the thickness of a floor is not in
 * it, nor furniture. False: err names what is wrong. */
bool lum_work_plane_place(const struct lum_world *world, const struct lum_work_plane *plane,
                          struct lum_sensor_desc *ret_desc, struct lum_proto_error *err);

/* Where the standard asks for more points than that, spacing_m becomes what leaves as many, about. */
void lum_work_plane_fit(struct lum_sensor_desc *inout_desc, uint32_t max_points);

#endif
