/* What somebody would see of the difference between two pictures. */
#ifndef LUM_TESTS_BENCH_SEEN_H
#define LUM_TESTS_BENCH_SEEN_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

struct lum_bench_seen {
    double p75, p95;     /* HDR-VDP: % of pixels whose difference is seen with at least this probability. NAN: not
                            compared */
    double dim75, dim95; /* the same of the same pictures as dark as LUM_BENCH_DIM on average */
    double flip;         /* HDR-FLIP, mean */
};
/* cd/m2. An eye in a lit room sees a difference of 1 %, one in the dark none of 10 %. The thesis' pictures have no
 * units, its lights no lumens: as a program that expects cd/m2 reads values between 0 and 1, they are of moonlight. */
#define LUM_BENCH_DIM 0.2
#define LUM_BENCH_NOT_SEEN ((struct lum_bench_seen){(double)NAN, (double)NAN, (double)NAN, (double)NAN, (double)NAN})

/* x against r, 3 * w * h each. False after a message on stderr. */
bool lum_bench_look(uint32_t w, uint32_t h, const float *x, const float *r, struct lum_bench_seen *ret_seen);

#endif
