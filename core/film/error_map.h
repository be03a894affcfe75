/* Where a picture is off: root mean square error of luminance around each place, from what is known of single pixels.
 */
#ifndef LUM_CORE_FILM_ERROR_MAP_H
#define LUM_CORE_FILM_ERROR_MAP_H

#include "core/film/film.h"

#define LUM_ERROR_CELL 8u /* side of a cell, pixels */

/* Sums over pixels. */
struct lum_error_sums {
    double square, square2; /* of squared errors, each times its weight; and of the squares of these products */
    double weight, n;       /* pixels that they stand for, and pixels */
    double light;           /* of the picture's luminance, all pixels */
    double pixels;
};

struct lum_error_map {
    uint32_t w, h, nx, ny;
    struct lum_error_sums *sums; /* (nx + 1) * (ny + 1): of the cells, each at its lower right corner; settled: of all
                                    cells above and to the left */
    float *rms;                  /* settled: nx * ny, cd/m2; NAN: nothing is known */
    float *rel;                  /* over the light around, of which no place has less than LUM_ERROR_DARK of the mean */
};
/* Larger: errors in the dark count less; smaller: black corners, where nobody looks, are all that the map shows. */
#define LUM_ERROR_DARK 0.1

/* Makes a map of the picture in which nothing is known. */
LUM_MUST_USE enum lum_status lum_error_map_init(struct lum_error_map *map, const struct lum_film *film,
                                                struct lum_error *err);
void lum_error_map_finish(struct lum_error_map *map); /* accepts a zeroed one */

/* A pixel's squared error, (cd/m2)^2: an estimate that is right in the mean, and may be below 0. weight: pixels that it
 * stands for. One that is not finite says nothing. */
void lum_error_map_add(struct lum_error_map *map, uint32_t x, uint32_t y, double square, double weight);
/* The noise of the film's halves: lum_film_error, pixel by pixel. */
void lum_error_map_add_halves(struct lum_error_map *map, const struct lum_film *film);
/* Once all pixels are in: fills rms and rel. */
void lum_error_map_settle(struct lum_error_map *map);

/* Of a settled map's rms or rel at a pixel: between the middles of cells. */
float lum_error_map_at(const struct lum_error_map *map, const float *of, uint32_t x, uint32_t y);

#endif
