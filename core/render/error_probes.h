/* How far a picture is off, whatever made it: some pixels are path traced, and compared.
 *
 * A probe is a pixel that is drawn at random, with a chance that is known, and path traced in two halves that know
 * nothing of each other: their means y1 and y2 are right but for noise. With b what the picture shows there, (b - y1)
 * (b - y2) has the mean (b - truth)^2, however noisy both are: the noise of one is none of the other's. So it is for
 * the picture of any method, biased or not, if that was not made of the same random numbers. What is drawn at random is
 * the pixel: pixels may be off as much alike as they like. Internal to core/render. */
#ifndef LUM_CORE_RENDER_ERROR_PROBES_H
#define LUM_CORE_RENDER_ERROR_PROBES_H

#include "core/film/error_map.h"
#include "core/pass/pass.h"

struct lum_error_probes;

LUM_MUST_USE enum lum_status lum_error_probes_create(uint32_t n_workers, struct lum_error_probes **ret_probes,
                                                     struct lum_error *err);
void lum_error_probes_destroy(struct lum_error_probes *p); /* accepts NULL */

/* Another picture follows. alike: it is made in the same way, of a scene or from a place that differs: what was noted
 * of those before counts on, less with every picture. Else it is forgotten. */
void lum_error_probes_begin(struct lum_error_probes *p, bool alike);
/* Remembers what lum_error_probes_error last said of this picture, for those after it: they are like what it was before
 * samples bettered it. */
void lum_error_probes_note(struct lum_error_probes *p);

/* Traces about so many rays more, none for 0, and counts them as those of LUM_RAY_PROBE. pass->on: what the truth has;
 * pass->film: the picture, which tells where probes are worth most. On failure what was measured before stays. */
enum lum_status lum_error_probes_trace(struct lum_error_probes *p, const struct lum_pass *pass, uint64_t max_rays,
                                       const struct lum_stage_runner *runner);

/* Paths that the present picture was compared with. */
uint64_t lum_error_probes_paths(const struct lum_error_probes *p);

/* Of the film as it is now. Unknown before there are enough, and of a black one. */
struct lum_film_error lum_error_probes_error(struct lum_error_probes *p, const struct lum_film *film);
/* How many probes that was said by, those of before as far as they count. */
double lum_error_probes_known(const struct lum_error_probes *p);
/* Where it is off, as far as those of this picture tell. */
void lum_error_probes_add_errors(const struct lum_error_probes *p, const struct lum_film *film,
                                 struct lum_error_map *map);

#endif
