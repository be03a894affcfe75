#include "server/report/paint.h"

#include <string.h>

/* The picture in the first columns of a canvas that may be wider. */
static enum lum_status paint_picture(const struct lum_png_output *o, const struct lum_canvas *canvas,
                                     struct lum_error *err)
{
    const struct lum_film *film = o->film;
    uint8_t *rgba = lum_calloc((size_t)film->w * film->h, 4);
    if (!rgba)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a picture of %u x %u", film->w, film->h);
    lum_film_resolve(film, 0, 0, film->w, film->h, &o->display, rgba, (size_t)film->w * 4);
    lum_overlay_paint(o->overlay, &(struct lum_frame_header){.w = (uint16_t)film->w, .h = (uint16_t)film->h}, rgba);
    for (uint32_t y = 0; y < film->h; y++)
        for (uint32_t x = 0; x < film->w; x++)
            memcpy(canvas->rgb + 3 * ((size_t)y * canvas->w + x), rgba + 4 * ((size_t)y * film->w + x), 3);
    lum_free(rgba);
    return LUM_OK;
}

enum lum_status lum_paint_png(const struct lum_png_output *o, struct lum_canvas *ret_canvas, struct lum_error *err)
{
    struct lum_canvas canvas = {.w = o->film->w, .h = o->film->h};
    canvas.w += o->legend ? lum_annotate_legend_width(o->overlay, canvas.h) : 0;
    canvas.rgb = lum_calloc((size_t)canvas.w * canvas.h, 3);
    if (!canvas.rgb)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a picture of %u x %u", canvas.w, canvas.h);
    enum lum_status st = paint_picture(o, &canvas, err);
    if (st) {
        lum_free(canvas.rgb);
        return st;
    }
    lum_annotate_lines(o->overlay, &canvas);
    if (o->legend)
        lum_annotate_legend(o->overlay, &canvas);
    *ret_canvas = canvas;
    return LUM_OK;
}
