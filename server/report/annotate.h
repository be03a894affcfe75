/* Values written into pictures of false colour: those of lines at their places, and a scale beside the picture. */
#ifndef LUM_SERVER_REPORT_ANNOTATE_H
#define LUM_SERVER_REPORT_ANNOTATE_H

#include "server/stream/overlay.h"

struct lum_canvas {
    uint8_t *rgb; /* 3 * w * h, first row on top */
    uint32_t w, h;
};

/* The values of the map's lines. */
void lum_annotate_lines(const struct lum_overlay *overlay, const struct lum_canvas *canvas);

/* Columns that the scale takes beside a picture of this height. 0: it is too low for it. */
uint32_t lum_annotate_legend_width(const struct lum_overlay *overlay, uint32_t h);
/* Fills the last columns of the canvas, as many as that. */
void lum_annotate_legend(const struct lum_overlay *overlay, const struct lum_canvas *canvas);

#endif
