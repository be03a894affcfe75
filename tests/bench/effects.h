/* What the effects study measures, and how it is told. */
#ifndef LUM_TESTS_BENCH_EFFECTS_H
#define LUM_TESTS_BENCH_EFFECTS_H

#include "core/render/view.h"
#include "tests/bench/bench.h"

/* A fresh frame with some of the effects. */
struct effects_frame {
    uint32_t on; /* bits LUM_EFFECT_BIT */
    double cpu_ms;
    uint64_t primary_rays;
    struct lum_effect_stats effects[LUM_EFFECT_COUNT];
};

/* One method on one scene. */
struct effects_case {
    const char *scene;
    const struct lum_method *method;
    struct lum_demand demand;
    uint32_t demanded, varied;    /* effects that the scene calls for; those of them that the method serves */
    struct effects_frame *frames; /* by subset of varied: 2^k, the last one has all */
    uint32_t n_frames;
    double left_out; /* share of the picture's energy that the method does not serve, by path tracing */
};

struct effects_study {
    struct effects_case *cases;
    size_t n_cases;
    char machine[160];
};

/* The frame of a case with exactly these effects; NULL: none. */
const struct effects_frame *effects_frame_with(const struct effects_case *c, uint32_t on);

/* Tables on stdout, files in OUT. False after a message on stderr. */
bool effects_report(const struct effects_study *study, const struct lum_bench_options *options);

#endif
