/* Loops whose jobs a team shares (core/base/team.h). */
#ifndef LUM_CORE_PASS_SHARE_H
#define LUM_CORE_PASS_SHARE_H

#include "core/base/pool.h"
#include "core/base/team.h"
#include "core/pass/pass.h"

struct lum_shared_loop {
    uint32_t n;
    size_t bytes; /* that a job leaves at most */
    /* Does a job, and leaves in `left` what others need to have it, too: returns how many bytes. NULL: there are none.
     * Thread: a worker. */
    size_t (*make)(void *ctx, uint32_t job, void *left, struct lum_counters *counters);
    /* Of a job that another did. Thread: a worker, which it is told. */
    void (*take_over)(void *ctx, uint32_t job, const void *left, uint32_t worker);
    void *ctx;
};
/* As lum_stage_loop. Afterwards each member has what all jobs made, and has counted their rays. */
enum lum_status lum_stage_share(const struct lum_stage_runner *runner, const struct lum_shared_loop *loop);

/* The same of the tiles of a stage. */
struct lum_tile_share {
    size_t (*bytes)(const struct lum_pass *pass);
    void (*make)(const struct lum_pass *pass, uint32_t tile, void *left, struct lum_counters *counters);
    void (*take_over)(const struct lum_pass *pass, uint32_t tile, const void *left);
};

/* For share.c: a loop of which only the time is counted; and one job of it, which counts its tile. */
enum lum_status lum_stage_timed(const struct lum_stage_runner *runner, uint32_t n, lum_job_fn fn, void *ctx);
void lum_stage_job(lum_stage_fn fn, void *ctx, uint32_t job, struct lum_counters *counters);

#endif
