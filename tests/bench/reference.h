/* The truth that studies measure errors against: `path` through the same pixels, sample by sample until its own noise
 * is far below what is to be told.
 *
 * Its even and odd samples A and B are independent, so the mean of (x - A)(x - B) / (r^2 + epsilon) with r = (A + B) /
 * 2 is the relative squared error of x against the limit and not against the noise of the reference, but for that
 * noise's second-order part in r. SMAPE knows no such way and includes the noise.
 *
 * With --references DIR it is kept there, under a fingerprint of its own first two samples: whatever changes them, the
 * scene, the camera, the size, the effects or the renderer, makes another one, and none is taken for what it is not. */
#ifndef LUM_TESTS_BENCH_REFERENCE_H
#define LUM_TESTS_BENCH_REFERENCE_H

#include "core/render/view.h"
#include "tests/bench/bench.h"

struct lum_bench_reference {
    uint32_t w, h, spp;
    float *half[2];         /* 3 * w * h: means of the even and of the odd samples */
    float *truth, *picture; /* 3 * w * h, for lum_metric_compare */
    double mean;            /* luminance of the truth */
    double relmse;          /* noise that is left */
    struct lum_demand demand;
};

struct lum_bench_error {
    double relmse, smape; /* NAN: there is none */
};
/* What a table says of its errors; with LUM_METRIC_EPSILON. */
#define LUM_BENCH_RELMSE                                                                                               \
    "relMSE: mean of (x - r)^2 / (r^2 + %g mean^2), r: the reference, mean: its luminance; lumend compare adds %g "    \
    "alone"

/* Samples are looked at whenever they have doubled, so that their number is even and the halves are equal: at least
 * least_spp, at most most_spp, and until the noise is a tenth of the least error that is to be told. */
struct lum_bench_truth {
    const struct lum_world *world;
    const struct lum_view_settings *settings; /* its method does not count */
    uint32_t least_spp, most_spp;             /* powers of two, at least 2 */
    const char *keep;                         /* directory; NULL: none */
    bool or_more;                             /* a kept one that was made with a larger most_spp will do, too */
};
/* As the options ask for. */
struct lum_bench_truth lum_bench_truth_of(const struct lum_bench_options *options, const struct lum_world *world,
                                          const struct lum_view_settings *settings);
/* False after a message on stderr. Finish it in both cases. */
bool lum_bench_reference_make(struct lum_bench_reference *r, const struct lum_bench_truth *truth);
void lum_bench_reference_finish(struct lum_bench_reference *r); /* accepts a zeroed one */

/* What a view of the same size shows, 3 * w * h. */
void lum_bench_picture_of(const struct lum_view *view, float *ret_picture);
struct lum_bench_error lum_bench_error_of_picture(const struct lum_bench_reference *r, const float *picture);
/* Root mean square error of luminance over the picture's mean, without the noise of the reference: what pictures say of
 * theirs (lum_film_error). */
double lum_bench_rms_of_picture(const struct lum_bench_reference *r, const float *picture);
/* Both. */
struct lum_bench_error lum_bench_error_of(struct lum_bench_reference *r, const struct lum_view *view);

#endif
