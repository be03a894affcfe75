/* While something moves (motion.h). The last frame is compared. */

#include "tests/bench/motion.h"
#include "tests/bench/truth.h"

#define POSES 6u
#define QUICK_POSES 2u

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
    struct lum_bench_motion m = lum_bench_motion_plan(&rig->world, &rig->settings);
    bool ok = lum_bench_motion_begin(&m, &rig->world);
    for (size_t i = 0; i < rig->n_methods && ok; i++)
        ok = truth_view_open(rig, rig->methods[i], &movers[i].view);
    for (uint32_t pose = 0; pose <= n_poses && ok; pose++) {
        ok = pose == 0 || lum_bench_motion_pose(&m, pose, &rig->world, &rig->settings.camera);
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
