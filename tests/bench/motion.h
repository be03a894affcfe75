/* Something moves, in a way that any scene allows: a white ball flies across the picture, three fifths of the way to
 * what lies in its middle, while the eye goes there by a hundredth of the way a frame and turns by a degree. (To go
 * around that point could lead through a wall.) */
#ifndef LUM_TESTS_BENCH_MOTION_H
#define LUM_TESTS_BENCH_MOTION_H

#include "core/render/view.h"
#include "server/world/world.h"

struct lum_bench_motion {
    struct lum_camera camera;             /* before */
    struct lum_vec3d middle, ball, right; /* world; right: unit, in the picture */
    double half_height_m;
};

struct lum_bench_motion lum_bench_motion_plan(const struct lum_world *world, const struct lum_view_settings *settings);
/* Adds the ball. False after a message on stderr. */
bool lum_bench_motion_begin(const struct lum_bench_motion *m, struct lum_world *world);
bool lum_bench_motion_end(struct lum_world *world); /* takes it away */
/* Adds a lamp instead, of 1 lm: a small ball that flies the same way before an eye that rests. */
bool lum_bench_lamp_begin(const struct lum_bench_motion *m, struct lum_world *world);
bool lum_bench_lamp_set_lm(struct lum_world *world, double flux_lm);
bool lum_bench_lamp_pose(const struct lum_bench_motion *m, uint32_t pose, struct lum_world *world);
/* Moves the ball, and says where the eye is; pose 0 is the first. False after a message on stderr. */
bool lum_bench_motion_pose(const struct lum_bench_motion *m, uint32_t pose, struct lum_world *world,
                           struct lum_camera *ret_camera);

#endif
