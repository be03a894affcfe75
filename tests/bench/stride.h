/* Shared by the halves of the stride study: what was measured (stride.c) and how it is shown (stride_report.c). */
#ifndef LUM_TESTS_BENCH_STRIDE_H
#define LUM_TESTS_BENCH_STRIDE_H

#include "core/pass/pass.h"
#include "tests/bench/bench.h"

enum { STRIDE_SCENES = 4, STRIDE_STRIDES = 13, STRIDE_ROUNDS = 15 };

/* What of a pixel is timed; whether its rays travel in packets of 16 or alone; who works. */
enum stride_part { STRIDE_PRIMARY, STRIDE_BOTH, STRIDE_SECONDARY, STRIDE_PARTS };
enum stride_rays { STRIDE_PACKETS, STRIDE_SINGLES, STRIDE_RAYS };
enum stride_crew { STRIDE_ONE, STRIDE_ALL, STRIDE_CREWS };

struct stride_scene {
    const char *name;
    struct lum_world world;
    struct lum_eye eye;
};

/* A square picture of side * side pixels; pixels at multiples of each stride. */
struct stride_study {
    uint32_t side, n_scenes, n_strides, n_rounds;
    uint32_t strides[STRIDE_STRIDES];
    struct stride_scene scenes[STRIDE_SCENES];
    /* seconds of one sweep */
    double seconds[STRIDE_SCENES][STRIDE_PARTS][STRIDE_RAYS][STRIDE_CREWS][STRIDE_STRIDES][STRIDE_ROUNDS];
    uint32_t n_samples[STRIDE_STRIDES];
    uint64_t n_secondary[STRIDE_SCENES][STRIDE_STRIDES]; /* reflected rays of a sweep */
};

static inline uint32_t stride_pixels(const struct stride_study *st, uint32_t stride_index)
{
    uint32_t n = st->side / st->strides[stride_index];
    return n * n;
}

/* Table and four figures. False after a message on stderr. */
bool stride_report(struct stride_study *study, const struct lum_bench_options *options);

#endif
