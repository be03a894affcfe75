/* The luminance that an eye sees in every direction before it, by paths, and what of it glares by day (dgp.h): the sky,
 * through panes as well, what the sun shines on, its mirror images. Lamps and the sun, which a cell may be too large
 * for, also one that a picture of the sky shows, are left out: lum_glare_of has them exactly.
 *
 * Paths come in rounds, one for each cell of equal solid angle; even and odd rounds are two halves, independent of each
 * other. One half says which cells are bright, the other how bright: noise makes no source, nor its square a larger
 * one.
 */
#ifndef LUM_CORE_MEASURE_FISHEYE_H
#define LUM_CORE_MEASURE_FISHEYE_H

#include "core/base/pool.h"
#include "core/measure/dgp.h"
#include "core/measure/ugr.h"

/* Cells along a side of a square that is bent to the hemisphere. At most: 9.6e-5 sr, where the sun has 6.8e-5. At a
 * glance: four degrees across, for 2048 paths are 10 ms in an office. */
#define LUM_FISHEYE_SIDE 256u
#define LUM_FISHEYE_GLANCE_SIDE 32u

struct lum_fisheye;
LUM_MUST_USE enum lum_status lum_fisheye_create(struct lum_fisheye **ret_eye, struct lum_error *err);
void lum_fisheye_destroy(struct lum_fisheye *eye); /* accepts NULL */
LUM_MUST_USE enum lum_status lum_fisheye_copy(const struct lum_fisheye *eye, struct lum_fisheye **ret_eye,
                                              struct lum_error *err);

/* Forgets what it saw. side: at most LUM_FISHEYE_SIDE. */
void lum_fisheye_begin(struct lum_fisheye *eye, uint32_t side);
/* At most n paths, to the end of a round at most. Thread: as lum_pool_run. */
void lum_fisheye_trace(struct lum_fisheye *eye, const struct lum_snapshot *snapshot,
                       const struct lum_observer *observer, struct lum_pool *pool, uint32_t n, uint32_t seed);
uint64_t lum_fisheye_paths(const struct lum_fisheye *eye); /* since it began */
/* Rounds of either half; while one has more than the other, or runs, 0. */
uint32_t lum_fisheye_rounds(const struct lum_fisheye *eye);

/* Once there are rounds: bright cells within 0.2 rad of a source's middle are one source; those above 50 000 cd/m2 are
 * sources apart from others. sum_stderr: by the difference of the halves. */
struct lum_bright lum_fisheye_bright(const struct lum_fisheye *eye, const struct lum_observer *observer);

#endif
