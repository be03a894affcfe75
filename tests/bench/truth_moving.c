/* While something moves, in a way that any scene allows: a white ball flies across the picture, three fifths of the way
 * to what lies in its middle, while the eye goes there by a hundredth of the way a frame and turns by a degree. (To go
 * around that point could lead through a wall.) The last frame is compared. */
#include <math.h>
#include <string.h>

#include "server/world/apply.h"
#include "tests/bench/truth.h"

#define POSES 6u
#define QUICK_POSES 2u
#define RADIUS 0.15  /* of the ball, over half the height of the picture where it flies */
#define STEP 0.05    /* a frame, the same */
#define ADVANCE 0.01 /* of the eye, a frame, over the distance of the middle */
#define TURN_DEG 1.0 /* a frame */
#define FROM_EYE 0.6 /* where the ball is, over the distance of the middle */

static bool failed(const char *text)
{
    fprintf(stderr, "lumend-bench: %s\n", text);
    return false;
}

/* ---- where things are ---- */

struct motion {
    struct lum_camera camera;             /* before */
    struct lum_vec3d middle, ball, right; /* world; right: unit, in the picture */
    double half_height_m;
};

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

static struct motion plan(const struct truth_rig *rig)
{
    const double pi = 3.14159265358979323846;
    struct motion m = {.camera = rig->settings.camera};
    struct lum_vec3d forward = unit(minus(m.camera.target, m.camera.position));
    struct lum_pick pick;
    lum_pick_at(rig->world.snapshot, &m.camera, rig->settings.w, rig->settings.h, 0.5 * rig->settings.w,
                0.5 * rig->settings.h, &pick);
    double distance = pick.hit ? pick.distance_m : length(minus(m.camera.target, m.camera.position));
    m.middle = along(m.camera.position, forward, distance);
    m.ball = along(m.camera.position, forward, FROM_EYE * distance);
    m.right = unit(cross(forward, m.camera.up));
    m.half_height_m = FROM_EYE * distance * tan(0.5 * m.camera.vfov_deg * pi / 180.0);
    return m;
}

/* ---- poses ---- */

static bool apply(struct truth_rig *rig, const char *text)
{
    struct lum_ops ops = {0};
    struct lum_changes changes;
    struct lum_proto_error perr = {0};
    struct lum_error err = {0};
    if (!lum_ops_from_jsonl(text, strlen(text), &ops, &perr))
        return failed(perr.text);
    bool ok = lum_world_apply(&rig->world, &(struct lum_edit){.user = "bench", .ops = &ops}, &changes, &perr);
    lum_ops_finish(&ops);
    if (!ok)
        return failed(perr.text);
    lum_changes_finish(&changes);
    return lum_world_commit(&rig->world, &err) == LUM_OK || failed(err.text);
}

static bool add_ball(struct truth_rig *rig, const struct motion *m)
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
    return apply(rig, text);
}

static bool set_pose(struct truth_rig *rig, const struct motion *m, uint32_t pose)
{
    const double pi = 3.14159265358979323846;
    char text[512];
    struct lum_vec3d at = along(m->ball, m->right, STEP * m->half_height_m * pose);
    struct lum_vec3d ahead = minus(m->middle, m->camera.position);
    struct lum_camera *c = &rig->settings.camera;
    c->position = along(m->camera.position, ahead, ADVANCE * pose);
    c->target = along(c->position, turn(ahead, unit(m->camera.up), TURN_DEG * pose * pi / 180.0), 1.0);
    snprintf(text, sizeof text,
             "{\"lumend\":1,\"kind\":\"scene\"}\n"
             "{\"op\":\"set\",\"id\":\"truth-ball-1\",\"path\":\"/transform/translate\",\"value\":[%.9g,%.9g,%.9g]}\n",
             at.x, at.y, at.z);
    return apply(rig, text);
}

/* ---- frames ---- */

struct mover {
    struct truth_view view;
    struct lum_pass_stats stats; /* of the last frame */
    double own_s[POSES], wall_s[POSES];
    double rays[LUM_RAY_KIND_COUNT]; /* mean of the frames */
};

/* The first pose builds all and does not count. */
static bool run_frame(const struct truth_rig *rig, struct mover *mover, uint32_t pose, uint32_t n_poses)
{
    struct truth_time time = {0};
    mover->view.settings.camera = rig->settings.camera;
    if (!truth_pass(rig, &mover->view, &mover->stats, &time))
        return false;
    if (pose == 0)
        return true;
    mover->own_s[pose - 1] = time.own_s;
    mover->wall_s[pose - 1] = time.wall_s;
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        mover->rays[k] += (double)mover->stats.rays[k] / n_poses;
    return true;
}

static bool move(struct truth_rig *rig, struct mover *movers, uint32_t n_poses)
{
    struct motion m = plan(rig);
    bool ok = add_ball(rig, &m);
    for (size_t i = 0; i < rig->n_methods && ok; i++)
        ok = truth_view_open(rig, rig->methods[i], &movers[i].view);
    for (uint32_t pose = 0; pose <= n_poses && ok; pose++) {
        ok = pose == 0 || set_pose(rig, &m, pose);
        for (size_t i = 0; i < rig->n_methods && ok; i++)
            ok = run_frame(rig, &movers[i], pose, n_poses);
    }
    return ok;
}

static bool tell(struct truth_rig *rig, struct mover *mover, const struct lum_method *method, uint32_t n_poses,
                 struct truth_reference *truth)
{
    struct truth_row row = {.method = method->name, .when = "moving", .error_said = mover->stats.error.bound};
    snprintf(row.scene, sizeof row.scene, "%s", rig->scene);
    row.own_s = lum_bench_median_of(mover->own_s, n_poses);
    row.wall_s = lum_bench_median_of(mover->wall_s, n_poses);
    row.spp = mover->stats.spp;
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        row.rays[k] = (uint64_t)(mover->rays[k] + 0.5);
    lum_bench_picture_of(mover->view.view, truth->r.picture);
    return truth_tell_picture(rig, truth, &row, truth->r.picture, !method->progressive);
}

bool truth_measure_moving(struct truth_rig *rig)
{
    struct mover movers[LUM_BENCH_METHODS] = {0};
    struct truth_reference truth = {0};
    uint32_t n_poses = rig->options->quick ? QUICK_POSES : POSES;
    uint32_t spp = rig->options->quick || rig->options->reference_spp < 8 ? 4 : rig->options->reference_spp / 2;
    bool ok = move(rig, movers, n_poses) && truth_reference_make(rig, &rig->settings, spp, &truth) &&
              truth_page_picture(rig, "path, moving: reference", "moving", truth.r.truth, NULL);
    for (size_t i = 0; i < rig->n_methods && ok; i++)
        ok = tell(rig, &movers[i], rig->methods[i], n_poses, &truth);
    for (size_t i = 0; i < rig->n_methods; i++)
        truth_view_close(&movers[i].view);
    truth_reference_finish(&truth);
    return ok;
}
