#include "server/cli/render_tev.h"

#include <stdio.h>
#include <string.h>

#define EVERY_NS 250000000 /* four times a second: often enough to watch, a small part of the time */

static void name_frame(struct lum_render_tev *tev, uint32_t frame, const struct lum_render_options *o)
{
    tev->frame = frame;
    if (o->n_frames > 1)
        snprintf(tev->name, sizeof tev->name, "lumend %.200s, frame %u", o->scene, frame);
    else
        snprintf(tev->name, sizeof tev->name, "lumend %.200s", o->scene);
}

enum lum_status lum_render_tev_begin(struct lum_render_tev *tev, const struct lum_render_options *o,
                                     struct lum_error *err)
{
    *tev = (struct lum_render_tev){.line = NULL};
    name_frame(tev, 0, o);
    return o->tev.host[0] ? lum_tev_connect(&o->tev, &tev->line, err) : LUM_OK;
}

bool lum_render_tev_due(struct lum_render_tev *tev, uint32_t frame, const struct lum_render_options *o)
{
    if (!tev->line)
        return false;
    if (frame != tev->frame) {
        tev->begun = false;
        name_frame(tev, frame, o);
    }
    return !o->light_groups && (!tev->begun || lum_clock_ns() - tev->shown_ns >= EVERY_NS);
}

/* Somebody closed the window: the files are made all the same. */
static enum lum_status shown(struct lum_render_tev *tev, enum lum_status status, struct lum_error *err)
{
    tev->begun = true;
    tev->shown_ns = lum_clock_ns();
    if (status != LUM_ERR_IO)
        return status;
    fprintf(stderr, "lumend render: %s\n", err->text);
    lum_tev_close(tev->line);
    tev->line = NULL;
    return LUM_OK;
}

enum lum_status lum_render_tev_film(struct lum_render_tev *tev, const struct lum_film *film, struct lum_error *err)
{
    struct lum_rgb *pixels = lum_film_pixels(film);
    if (!pixels)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a picture to tev");
    const struct lum_exr_channel rgb[3] = {
        {"R", &pixels->r, 3, false}, {"G", &pixels->g, 3, false}, {"B", &pixels->b, 3, false}};
    const struct lum_tev_image image = {tev->name, false, film->w, film->h, rgb, 3};
    enum lum_status st = shown(tev, lum_tev_show(tev->line, &image, err), err);
    lum_free(pixels);
    return st;
}

enum lum_status lum_render_tev_put(struct lum_render_tev *tev, const struct lum_exr_output *output,
                                   struct lum_error *err)
{
    return shown(tev, lum_show_exr(tev->line, tev->name, !tev->begun, output, err), err);
}
