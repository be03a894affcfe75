/* Which pixels of a picture are worth a probe (error_probes.h): drawn at random with chances that are known, more where
 * it is bright, and at edges, as it is off most there. Internal to core/render. */
#ifndef LUM_CORE_RENDER_ERROR_PLACES_H
#define LUM_CORE_RENDER_ERROR_PLACES_H

#include "core/film/film.h"

#define LUM_ERROR_PLACES 64u /* that are drawn together */
#define LUM_ERROR_NEAR 8u    /* of these, how many are near each other */

struct lum_error_place {
    uint32_t x, y;
    uint32_t near; /* number of the LUM_ERROR_NEAR that it is one of */
    float weight;  /* 1 / (chance * number of pixels), of one of them: 1 where all pixels are drawn alike */
};

/* What a draw looks at; zeroed: nothing yet. */
struct lum_error_looks {
    float *light, *detail, *chance; /* of pixels: luminance, contrast, and what they come to */
    uint32_t max;
};
void lum_error_looks_finish(struct lum_error_looks *l); /* accepts a zeroed one */

/* LUM_ERROR_PLACES pixels, in random order: so many of the first of them as may be are drawn as all are. draw: number
 * of the draw. Those of one picture and seed complement each other. Fails when out of memory. */
enum lum_status lum_error_places_draw(struct lum_error_looks *l, const struct lum_film *film, uint32_t seed,
                                      uint32_t draw, struct lum_error_place ret_places[LUM_ERROR_PLACES]);

#endif
