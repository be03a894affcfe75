/* Shared by the halves of the study of many viewers: what was measured (viewers.c) and how it is shown
 * (viewers_report.c). */
#ifndef LUM_TESTS_BENCH_VIEWERS_H
#define LUM_TESTS_BENCH_VIEWERS_H

#include "core/render/view.h"
#include "tests/bench/bench.h"

enum { VIEWERS = 8, VIEWERS_ROUNDS = 5, VIEWERS_SCENES = 3 };

enum viewers_method { VIEWERS_IRRCACHE, VIEWERS_TIC, VIEWERS_LIVE, VIEWERS_METHODS };
extern const char *const viewers_methods[VIEWERS_METHODS]; /* as lum_method_find knows them */

/* Eight views on one cache, or each with its own, as in a daemon for each. */
enum viewers_way { VIEWERS_SHARED, VIEWERS_OWN, VIEWERS_WAYS };

/* The turn of the k-th viewer around what the scene's own camera looks at. */
extern const double viewers_degrees[VIEWERS];

/* What the k-th viewer's first frame cost, by round. */
struct viewers_frame {
    double rays[VIEWERS_ROUNDS];        /* of indirect light */
    double created[VIEWERS_ROUNDS];     /* records */
    double indirect_ms[VIEWERS_ROUNDS]; /* CPU time of the stages of indirect light */
    double cpu_ms[VIEWERS_ROUNDS];      /* of the frame */
};

/* One scene and method. */
struct viewers_cell {
    struct viewers_frame frames[VIEWERS_WAYS][VIEWERS];
    struct lum_caches_size cache; /* the one that eight share */
    double one_kb, eight_kb;      /* peak memory of a process with one view, and with eight on one cache */
};

struct viewers_study {
    const char *scenes[VIEWERS_SCENES];
    struct viewers_cell cells[VIEWERS_SCENES][VIEWERS_METHODS];
    size_t n_scenes, n_rounds;
    uint32_t w, h;
    char machine[256];
};

/* Tables and figures. False after a message on stderr. */
bool viewers_report(const struct viewers_study *study, const struct lum_bench_options *options);

#endif
