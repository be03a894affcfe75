/* What a view shows as pixels for a file or a page: tone mapped, with the map over it and its scale beside it. */
#ifndef LUM_SERVER_REPORT_PAINT_H
#define LUM_SERVER_REPORT_PAINT_H

#include "server/report/annotate.h"

struct lum_png_output {
    const struct lum_film *film;
    struct lum_display display;
    const struct lum_overlay *overlay; /* over it */
    bool legend;                       /* and its scale at the right: the file is wider than the picture */
};
/* Tone mapped, 8 bit. ret_canvas->rgb is released with lum_free. */
LUM_MUST_USE enum lum_status lum_paint_png(const struct lum_png_output *output, struct lum_canvas *ret_canvas,
                                           struct lum_error *err);

#endif
