/* False colour: which colour stands for which value, and at which round values it changes.
 *
 * The colours are even: as different to the eye between any two values as between any others as far apart, and lighter
 * for more, so that order shows to those who confuse hues, and in print. Those of a spectrum are what many
 * are used to. */
#ifndef LUM_CORE_FILM_FALSE_COLOR_H
#define LUM_CORE_FILM_FALSE_COLOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum lum_scale_kind { LUM_SCALE_LOG, LUM_SCALE_LINEAR };
enum lum_palette { LUM_PALETTE_EVEN, LUM_PALETTE_SPECTRUM };
extern const char *const lum_scale_kind_names[]; /* "log", "linear"; NULL-terminated */
extern const char *const lum_palette_names[];    /* "even", "spectrum" */

/* What somebody wants to see. Zeroed but for min and max: in steps, even, logarithmic. */
struct lum_false_color {
    enum lum_scale_kind scale;
    enum lum_palette palette;
    bool smooth;     /* colours change evenly; else at round values */
    double min, max; /* ends of the scale; NAN: as the picture has it. min of a logarithmic one is above 0 */
};

#define LUM_SCALE_LIMITS 24u  /* room for them: few legends have more than 14, and one that would keeps the lowest */
#define LUM_SCALE_COLORS 128u /* of a smooth one: more are hardly told apart, fewer show as steps */
struct lum_scale {
    enum lum_scale_kind kind;
    bool smooth;
    double min, max; /* values beyond have the colours of the ends */
    uint32_t n_limits;
    double limits[LUM_SCALE_LIMITS];     /* round values, rising: where steps change, and what a legend names */
    uint32_t n_colors;                   /* n_limits + 1, or LUM_SCALE_COLORS */
    uint8_t colors[LUM_SCALE_COLORS][3]; /* sRGB, from the least value */
};

/* For these values, of which NAN and what is not above 0 say nothing. The ends are their 2nd and 99th percentile, made
 * rounder: lamps are above. False: there is nothing to show. */
bool lum_scale_make(const struct lum_false_color *want, const float *values, size_t n_values,
                    struct lum_scale *ret_scale);

/* The colour of a value. */
uint32_t lum_scale_color(const struct lum_scale *scale, double value);

/* sRGB of a place on a palette, 0 to 1. */
void lum_palette_color(enum lum_palette palette, double at, uint8_t ret_rgb[3]);

#endif
