/* What lumend compare measures of two pictures: figures, and for each pixel by how much they differ. */
#ifndef LUM_SERVER_CLI_COMPARE_MEASURE_H
#define LUM_SERVER_CLI_COMPARE_MEASURE_H

#include "core/metric/blocks.h"
#include "core/metric/flip.h"
#include "core/metric/hdrvdp.h"
#include "core/metric/metric.h"
#include "server/cli/compare_picture.h"

enum lum_compare_metric {
    LUM_COMPARE_RELMSE,
    LUM_COMPARE_RMSE,
    LUM_COMPARE_SMAPE,
    LUM_COMPARE_FLIP,
    LUM_COMPARE_HDRFLIP,
    LUM_COMPARE_HDRVDP,
    LUM_COMPARE_BLOCKS,
    LUM_COMPARE_METRICS
};
extern const char *const lum_compare_names[LUM_COMPARE_METRICS];

/* Which of the maps there is of a metric: its own, or that of relMSE. */
enum lum_compare_metric lum_compare_map_of(enum lum_compare_metric metric);

enum { LUM_COMPARE_A, LUM_COMPARE_B, LUM_COMPARE_SECOND, LUM_COMPARE_PICTURES };

struct lum_comparison {
    /* what is asked for */
    struct lum_compared pictures[LUM_COMPARE_PICTURES]; /* owned; B becomes the mean of B and SECOND, if there is one */
    bool wanted[LUM_COMPARE_METRICS];
    bool maps_wanted, shown_wanted;
    double pixels_per_degree; /* 0: what is usual for each metric */
    double multiplier;        /* values times this are cd/m2, for HDR-VDP */
    /* what is found, for what is wanted; relative always */
    double ev100; /* at which EXR files are shown: it fits B */
    struct lum_metric_result relative;
    struct lum_blocks_result blocks;
    struct lum_flip_result flip, hdrflip;
    struct lum_hdrflip_exposures exposures;
    struct lum_hdrvdp_result hdrvdp;
    double mean_cd_m2, peak_cd_m2;    /* of B, as HDR-VDP saw it */
    float *maps[LUM_COMPARE_METRICS]; /* 0 the same to 1; NULL where a metric has none of its own, or none is wanted */
};

/* Pictures are read already. Thread: any. */
LUM_MUST_USE enum lum_status lum_compare_measure(struct lum_comparison *comparison, struct lum_error *err);
void lum_comparison_finish(struct lum_comparison *comparison);

/* A map in colours, 3 * w * h; lum_free. NULL when memory is short. */
uint8_t *lum_compare_paint(const struct lum_comparison *comparison, enum lum_compare_metric map);

#endif
