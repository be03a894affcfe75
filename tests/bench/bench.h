/* lumend-bench: one program, one row per study. Results go to --out as JSON and CSV, a summary to stdout. */
#ifndef LUM_TESTS_BENCH_BENCH_H
#define LUM_TESTS_BENCH_BENCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "core/render/view.h"
#include "server/world/world.h"

struct lum_bench_options {
    const char *out;        /* directory, exists */
    const char *scene;      /* name or file; NULL: the study's own choice of several */
    const char *bin;        /* directory of lumend and lumend-replay */
    const char *references; /* directory where what errors are measured against is kept (reference.h); NULL: none */
    uint32_t reference_spp; /* which these have at most: a power of two */
    const char *models;     /* truth: folder of third-party models */
    const char *camera;     /* truth: id, or its end; NULL: the scene's own */
    const char *methods;    /* truth, errors, budgets, vision: comma separated; NULL: the study's own choice */
    uint32_t seeds;         /* errors, budgets, settings, rest, accuracy: 1 to 30 */
    uint32_t w, h;          /* of pictures; 0: the study's own */
    uint32_t rounds;        /* ais, instant, irrcache, stride: at most; 0: the study's own */
    double seconds;         /* truth: how long a scene rests; budgets: how long a run is waited for */
    bool single_rays;       /* traced one by one, as the thesis' tracer does */
    bool quick;             /* fewer repetitions: shows that it works, not a figure to quote */
};

/* Ends the subtitle of a figure that --quick made. */
#define LUM_BENCH_QUICK ". Made with --quick: not for quoting"

struct lum_bench {
    const char *name, *summary;
    const char *scene;                                   /* where none is given */
    int (*run)(const struct lum_bench_options *options); /* exit status */
};

int lum_bench_accuracy(const struct lum_bench_options *options);
int lum_bench_ais(const struct lum_bench_options *options);
int lum_bench_budgets(const struct lum_bench_options *options);
int lum_bench_codecs(const struct lum_bench_options *options);
int lum_bench_drag(const struct lum_bench_options *options);
int lum_bench_video(const struct lum_bench_options *options);
int lum_bench_effects(const struct lum_bench_options *options);
int lum_bench_errors(const struct lum_bench_options *options);
int lum_bench_export(const struct lum_bench_options *options);
int lum_bench_growth(const struct lum_bench_options *options);
int lum_bench_instant(const struct lum_bench_options *options);
int lum_bench_irrcache(const struct lum_bench_options *options);
int lum_bench_rays(const struct lum_bench_options *options);
int lum_bench_rest(const struct lum_bench_options *options);
int lum_bench_settings(const struct lum_bench_options *options);
int lum_bench_stream(const struct lum_bench_options *options);
int lum_bench_stride(const struct lum_bench_options *options);
int lum_bench_truth_study(const struct lum_bench_options *options);
int lum_bench_viewers(const struct lum_bench_options *options);
int lum_bench_vision(const struct lum_bench_options *options);

/* The size of pictures: that of --size, else with --quick the second. */
void lum_bench_size(const struct lum_bench_options *options, const uint32_t whole[2], const uint32_t quick[2],
                    struct lum_view_settings *inout_settings);

/* How often a study repeats itself: at most as often as --rounds says. */
uint32_t lum_bench_rounds(const struct lum_bench_options *options, uint32_t whole, uint32_t quick);

/* A line on stderr, of what is being done now; for each step that may take more than a second. */
__attribute__((format(printf, 1, 2))) void lum_bench_progress(const char *fmt, ...);

/* False, after a message on stderr. */
bool lum_bench_failed(const char *text);

/* A view with caches of its own. False after a message on stderr: what there is has to be destroyed then, too. */
bool lum_bench_open_view(struct lum_pool *pool, struct lum_view **ret_view, struct lum_caches **ret_caches);

/* Opens OUT/name for writing; NULL after a message on stderr. */
FILE *lum_bench_open(const struct lum_bench_options *options, const char *name);
/* False after a message on stderr when something was not written. */
bool lum_bench_close(FILE *f, const char *name);
/* A world with the scene loaded and committed; false after a message on stderr. Variants of built-in scenes count as
 * scenes here (variants.h). */
bool lum_bench_world(const char *scene, uint32_t threads, struct lum_world *ret_world);
/* What figures call a scene: a file without its folder. */
const char *lum_bench_scene_name(const char *scene);
/* "AMD EPYC, 2 threads": what figures were measured on. */
void lum_bench_machine(const struct lum_world *world, char *ret_text, size_t size);

struct lum_plot;
/* Draws OUT/name. The plot's subtitle, a sentence without its point, is followed by the machine. False after a message
 * on stderr. */
bool lum_bench_plot(const struct lum_bench_options *options, const char *name, const struct lum_plot *plot,
                    const char *machine);

/* ---- statistics ---- */

/* Sorts values; q in [0,1], linear interpolation between ranks. */
double lum_bench_quantile(double *values, size_t n, double q);

/* Of at most LUM_BENCH_SAMPLES; NAN of none. */
#define LUM_BENCH_SAMPLES 128u
double lum_bench_median_of(const double *values, size_t n);

/* The median and its 95 % interval by 2 000 resamples with a fixed seed. Sorts values; at most LUM_BENCH_SAMPLES; NAN
 * of none. */
struct lum_bench_median {
    double median, lo, hi;
};
struct lum_bench_median lum_bench_bootstrap(double *values, size_t n);
/* Of n ratios numerator / denominator. */
struct lum_bench_median lum_bench_ratio(const double *numerator, const double *denominator, size_t n);

#endif
