/* The statistics of frames as JSON: the same members in the file of --stats, in frame.stats, and in the EXR attribute.
 */
#ifndef LUM_SERVER_DIRECTOR_STATS_JSON_H
#define LUM_SERVER_DIRECTOR_STATS_JSON_H

#include "core/render/view.h"
#include "core/vpl/caustic.h"
#include "server/director/budget.h"

struct cJSON;

/* A frame: all passes since the frame before it. */
struct lum_frame_stats {
    uint64_t frame;
    uint32_t w, h;
    uint32_t n_passes;
    struct lum_pass_stats sum; /* counters and times added up; the rest is of the last pass */
    /* set before they are told */
    const char *stopped_by; /* why the picture is refined no further (budget.h); NULL: it goes on */
    struct lum_budget_news budget;
    struct lum_caustic_report caustics;
};
void lum_frame_stats_begin(struct lum_frame_stats *s, uint64_t frame);
/* What is of the picture stays, should no pass come before the next frame; counters and times begin at 0. */
void lum_frame_stats_next(struct lum_frame_stats *s, uint64_t frame);
void lum_frame_stats_add(struct lum_frame_stats *s, const struct lum_pass_stats *pass);
/* NULL when memory is short. */
struct cJSON *lum_frame_stats_json(const struct lum_frame_stats *s);

/* What stands around the frames. */
struct lum_run_stats {
    const char *scene, *method, *isa;
    uint32_t w, h, threads, seed;
    double setup_ms;
};
/* An object without "frames", which the caller adds. */
struct cJSON *lum_run_stats_json(const struct lum_run_stats *s);

#endif
