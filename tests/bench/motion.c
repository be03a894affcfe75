#include "tests/bench/motion.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "server/world/apply.h"
#include "tests/bench/bench.h"

#define RADIUS 0.15 /* of the ball, over half the height of the picture where it flies */
#define LAMP_RADIUS 0.03
#define STEP 0.05    /* a frame, the same */
#define ADVANCE 0.01 /* of the eye, a frame, over the distance of the middle */
#define TURN_DEG 1.0 /* a frame */
#define FROM_EYE 0.6 /* where the ball is, over the distance of the middle */

/* ---- where things are ---- */

static struct lum_vec3d along(struct lum_vec3d p, struct lum_vec3d d, double t)
{
    return (struct lum_vec3d){p.x + t * d.x, p.y + t * d.y, p.z + t * d.z};
}

static struct lum_vec3d minus(struct lum_vec3d a, struct lum_vec3d b)
{
    return along(a, b, -1.0);
}

static struct lum_vec3d cross(struct lum_vec3d a, struct lum_vec3d b)
{
    return (struct lum_vec3d){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static double length(struct lum_vec3d v)
{
    return sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
}

static struct lum_vec3d unit(struct lum_vec3d v)
{
    double l = length(v);
    return (struct lum_vec3d){v.x / l, v.y / l, v.z / l};
}

/* v turned about the unit axis (Rodrigues). */
static struct lum_vec3d turn(struct lum_vec3d v, struct lum_vec3d axis, double angle)
{
    double c = cos(angle), dot = axis.x * v.x + axis.y * v.y + axis.z * v.z;
    struct lum_vec3d turned = {c * v.x, c * v.y, c * v.z};
    return along(along(turned, cross(axis, v), sin(angle)), axis, (1.0 - c) * dot);
}

struct lum_bench_motion lum_bench_motion_plan(const struct lum_world *world, const struct lum_view_settings *settings)
{
    const double pi = 3.14159265358979323846;
    struct lum_bench_motion m = {.camera = settings->camera};
    struct lum_vec3d forward = unit(minus(m.camera.target, m.camera.position));
    struct lum_pick pick;
    lum_pick_at(world->snapshot, &m.camera, settings->w, settings->h, 0.5 * settings->w, 0.5 * settings->h, &pick);
    double distance = pick.hit ? pick.distance_m : length(minus(m.camera.target, m.camera.position));
    m.middle = along(m.camera.position, forward, distance);
    m.ball = along(m.camera.position, forward, FROM_EYE * distance);
    m.right = unit(cross(forward, m.camera.up));
    m.half_height_m = FROM_EYE * distance * tan(0.5 * m.camera.vfov_deg * pi / 180.0);
    return m;
}

/* ---- poses ---- */

static bool apply(struct lum_world *world, const char *text)
{
    struct lum_ops ops = {0};
    struct lum_changes changes;
    struct lum_proto_error perr = {0};
    struct lum_error err = {0};
    if (!lum_ops_from_jsonl(text, strlen(text), &ops, &perr))
        return lum_bench_failed(perr.text);
    bool ok = lum_world_apply(world, &(struct lum_edit){.user = "bench", .ops = &ops}, &changes, &perr);
    lum_ops_finish(&ops);
    if (!ok)
        return lum_bench_failed(perr.text);
    lum_changes_finish(&changes);
    return lum_world_commit(world, &err) == LUM_OK || lum_bench_failed(err.text);
}

bool lum_bench_motion_begin(const struct lum_bench_motion *m, struct lum_world *world)
{
    char text[1024];
    double d = 2.0 * RADIUS * m->half_height_m;
    snprintf(
        text, sizeof text,
        "{\"lumend\":1,\"kind\":\"scene\"}\n"
        "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"truth-ball\",\"shape\":\"sphere\",\"size\":[%.9g,%.9g,%.9g]}\n"
        "{\"op\":\"add\",\"type\":\"material\",\"id\":\"truth-white\",\"base_color\":[0.8,0.8,0.8],\"specular\":0}\n"
        "{\"op\":\"add\",\"type\":\"object\",\"id\":\"truth-ball-1\",\"mesh\":\"truth-ball\","
        "\"material\":\"truth-white\",\"transform\":{\"translate\":[%.9g,%.9g,%.9g]}}\n",
        d, d, d, m->ball.x, m->ball.y, m->ball.z);
    return apply(world, text);
}

bool lum_bench_motion_end(struct lum_world *world)
{
    return apply(world, "{\"lumend\":1,\"kind\":\"scene\"}\n{\"op\":\"remove\",\"id\":\"truth-ball-1\"}\n");
}

bool lum_bench_lamp_begin(const struct lum_bench_motion *m, struct lum_world *world)
{
    char text[512];
    snprintf(text, sizeof text,
             "{\"lumend\":1,\"kind\":\"scene\"}\n"
             "{\"op\":\"add\",\"type\":\"light\",\"id\":\"bench-lamp\",\"kind\":\"sphere\",\"flux_lm\":1,"
             "\"radius\":%.9g,\"position\":[%.9g,%.9g,%.9g]}\n",
             LAMP_RADIUS * m->half_height_m, m->ball.x, m->ball.y, m->ball.z);
    return apply(world, text);
}

bool lum_bench_lamp_set_lm(struct lum_world *world, double flux_lm)
{
    char text[256];
    snprintf(text, sizeof text,
             "{\"lumend\":1,\"kind\":\"scene\"}\n"
             "{\"op\":\"set\",\"id\":\"bench-lamp\",\"path\":\"/flux_lm\",\"value\":%.9g}\n",
             flux_lm);
    return apply(world, text);
}

bool lum_bench_lamp_pose(const struct lum_bench_motion *m, uint32_t pose, struct lum_world *world)
{
    char text[256];
    struct lum_vec3d at = along(m->ball, m->right, STEP * m->half_height_m * pose);
    snprintf(text, sizeof text,
             "{\"lumend\":1,\"kind\":\"scene\"}\n"
             "{\"op\":\"set\",\"id\":\"bench-lamp\",\"path\":\"/position\",\"value\":[%.9g,%.9g,%.9g]}\n",
             at.x, at.y, at.z);
    return apply(world, text);
}

bool lum_bench_motion_pose(const struct lum_bench_motion *m, uint32_t pose, struct lum_world *world,
                           struct lum_camera *ret_camera)
{
    const double pi = 3.14159265358979323846;
    char text[512];
    struct lum_vec3d at = along(m->ball, m->right, STEP * m->half_height_m * pose);
    struct lum_vec3d ahead = minus(m->middle, m->camera.position);
    struct lum_camera *c = ret_camera;
    *c = m->camera;
    c->position = along(m->camera.position, ahead, ADVANCE * pose);
    c->target = along(c->position, turn(ahead, unit(m->camera.up), TURN_DEG * pose * pi / 180.0), 1.0);
    snprintf(text, sizeof text,
             "{\"lumend\":1,\"kind\":\"scene\"}\n"
             "{\"op\":\"set\",\"id\":\"truth-ball-1\",\"path\":\"/transform/translate\",\"value\":[%.9g,%.9g,%.9g]}\n",
             at.x, at.y, at.z);
    return apply(world, text);
}
