/* What the truth study measures, and how it is told: how right the light of each method's pictures is. */
#ifndef LUM_TESTS_BENCH_TRUTH_H
#define LUM_TESTS_BENCH_TRUTH_H

#include "core/metric/blocks.h"
#include "tests/bench/places.h"
#include "tests/bench/reference.h"

enum { TRUTH_TIMES = 6 };
extern const double truth_times_s[TRUTH_TIMES]; /* at rest: 0.1, 0.3, 1, 3, 10, 30 */

/* Reference pictures as blocks need them, too. */
struct truth_reference {
    struct lum_bench_reference r;
    float *luminance, *halves[2]; /* w * h */
};

/* A picture and what was seen of it. */
struct truth_row {
    char scene[64];
    const char *method;
    char when[16];        /* "rough", "first", "moving", "1 s" */
    double own_s, wall_s; /* from nothing to this picture; of moving ones the median of a frame */
    uint32_t spp;
    struct lum_blocks_result blocks;
    struct lum_bench_error error;
    double error_rms;  /* of luminance, over its mean; without the noise of the reference. NAN: below that */
    double error_said; /* the bound of it by the method itself; NAN: unknown */
    uint64_t rays[LUM_RAY_KIND_COUNT]; /* to this picture; of moving ones the mean of a frame */
    uint32_t reference_spp;
};

/* A method's first frame beside one sample of `path`. */
struct truth_cost {
    char scene[64];
    const char *method;
    double first_ms, sample_ms;        /* own time, medians */
    struct lum_bench_median own, wall; /* ratios */
    double share;                      /* of the machine that `path` got */
};

/* One effect's light in a method's first frame over that in `path`. */
struct truth_effect {
    char scene[64];
    const char *method, *effect;
    double share; /* of all light of `path` */
    struct lum_blocks_result blocks;
    uint64_t rays;
    uint32_t reference_spp;
};

struct truth_study {
    struct truth_row *rows;
    size_t n_rows, max_rows;
    struct truth_cost *costs;
    size_t n_costs, max_costs;
    struct truth_effect *effects;
    size_t n_effects, max_effects;
    char machine[160];
    FILE *page; /* truth.html, open */
};

/* A scene at work. */
struct truth_rig {
    const struct lum_bench_options *options;
    struct truth_study *study;
    char scene[64]; /* its name */
    struct lum_world world;
    struct lum_view_settings settings;
    const struct lum_method *methods[LUM_BENCH_METHODS];
    size_t n_methods;
    struct truth_reference reference;
    double white; /* luminance that the page's pictures show as white */
};

/* ---- truth_frames.c: all are false after a message on stderr ---- */

/* Of the rig's settings, with at most spp samples. Finish it in any case. */
bool truth_reference_make(const struct truth_rig *rig, const struct lum_view_settings *settings, uint32_t spp,
                          struct truth_reference *ret_reference);
void truth_reference_finish(struct truth_reference *reference); /* accepts a zeroed one */
bool truth_measure_rest(struct truth_rig *rig);
bool truth_measure_costs(struct truth_rig *rig);
bool truth_measure_effects(struct truth_rig *rig); /* truth_effects.c */
/* truth_moving.c. Changes the scene: the last one. */
bool truth_measure_moving(struct truth_rig *rig);

/* A view with caches of its own. */
struct truth_view {
    struct lum_view *view;
    struct lum_caches *caches;
    struct lum_view_settings settings;
};
bool truth_view_open(const struct truth_rig *rig, const struct lum_method *method, struct truth_view *ret_view);
void truth_view_close(struct truth_view *view); /* accepts a zeroed one */
/* own_s: as on a machine of its own, that is CPU time of the workers by their number, and that of the thread which runs
 * between them; what others on the machine take does not count. */
struct truth_time {
    double own_s, wall_s;
};
bool truth_pass(const struct truth_rig *rig, const struct truth_view *view, struct lum_pass_stats *ret_stats,
                struct truth_time *inout_time);
/* Judges a picture, 3 * w * h, keeps the row, and where show is set puts it on the page. */
bool truth_tell_picture(struct truth_rig *rig, const struct truth_reference *reference, struct truth_row *row,
                        const float *picture, bool show);

/* ---- truth_page.c ---- */

bool truth_page_open(struct truth_study *study, const struct lum_bench_options *options);
bool truth_page_close(struct truth_study *study);
/* Its own exposure; begins the scene's section with the picture of the reference. */
bool truth_page_scene(struct truth_rig *rig);
void truth_page_text(const struct truth_rig *rig, const char *text);
/* A picture, 3 * w * h, and the map of its blocks' ratios (NULL: none); file: the end of its name. */
bool truth_page_picture(const struct truth_rig *rig, const char *title, const char *file, const float *picture,
                        const double *ratios);

/* ---- truth_report.c ---- */

/* Tables on stdout, files in OUT. */
bool truth_report(const struct truth_study *study, const struct lum_bench_options *options);

#endif
