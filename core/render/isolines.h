/* Lines of equal value over a picture, such as isolux lines: where what surfaces show crosses a level.
 *
 * Values are first averaged over the 5 x 5 pixels around that lie on the same surface; so lines are smooth, and none
 * follows the edge between two surfaces. A line is left out where noise might move it to the next level, or where it
 * is a speck. */
#ifndef LUM_CORE_RENDER_ISOLINES_H
#define LUM_CORE_RENDER_ISOLINES_H

#include "core/film/error_map.h"
#include "core/render/view.h"

struct lum_isolines {
    uint32_t w, h;
    const float *values;         /* w * h; NAN: there is none, and no line */
    const struct lum_aovs *seen; /* all of it but the albedo; of this camera */
    const struct lum_camera *camera;
    const struct lum_error_map *errors; /* of the picture, times per_error as values; NULL: not known */
    double per_error;
    const double *levels; /* rising */
    uint32_t n_levels;    /* at most 254 */
};

/* ret_lines[pixel], w * h: 1 + the level that is crossed between this pixel and the one right of it or below; 0: none.
 * Thread: any. */
LUM_MUST_USE enum lum_status lum_isolines_find(const struct lum_isolines *of, uint8_t *ret_lines,
                                               struct lum_error *err);

/* Where a line's value is written: around its middle there is room for LUM_LABEL_W x LUM_LABEL_H pixels. */
struct lum_isoline_label {
    uint16_t x, y;
    uint8_t level;
};
#define LUM_ISOLINE_LABELS 48u /* more cover the picture that they are of; fewer leave lines without a value */
#define LUM_LABEL_W 56u
#define LUM_LABEL_H 24u
/* A few for each level, at places that stay when lines move a little. Returns how many. */
uint32_t lum_isolines_label(const uint8_t *lines, uint32_t w, uint32_t h,
                            struct lum_isoline_label ret_labels[LUM_ISOLINE_LABELS]);

#endif
