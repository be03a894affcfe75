/* Maps over the picture: where a method refined its samples, where the picture is off, how bright it is, how much light
 * falls where. Each is made of colours that stand for values, and may have lines of equal value. */
#ifndef LUM_SERVER_STREAM_OVERLAY_H
#define LUM_SERVER_STREAM_OVERLAY_H

#include "core/film/false_color.h"
#include "core/render/isolines.h"
#include "core/render/view.h"
#include "protocol/message/frame.h"

enum { LUM_OVERLAY_NONE = 255 }; /* in the place of a colour, of which there are LUM_SCALE_COLORS */

struct lum_overlay {
    uint32_t w, h;
    uint8_t *classes; /* of each pixel, a colour of the scale; LUM_OVERLAY_NONE: of none, grey. NULL: there is no map */
    uint8_t *lines;   /* 1 + the limit whose line goes through the pixel; 0: none */
    bool opaque;      /* colours alone; else half of what is shown is the grey picture, which keeps shapes readable */
    bool plain;       /* what has no colour is all the same grey; else the grey picture */
    bool false_color; /* of light: made as somebody wants it (struct lum_false_color) */
    struct lum_scale scale;
    const char *unit; /* "times refined", "relative", "cd/m2" or "lx"; NULL: colours stand for no value */
    uint32_t n_labels;
    struct lum_isoline_label labels[LUM_ISOLINE_LABELS]; /* of lines: level is one of scale.limits */
};

/* What a view asks for. */
struct lum_overlay_want {
    const char *name; /* as the wire calls it */
    /* Of luminance and illuminance: */
    struct lum_false_color colors;
    bool fill;  /* false: the grey picture, for lines */
    bool lines; /* at the scale's limits */
};

/* "none", "luminance", "illuminance", "error", "shapes", or "guidance_EFFECT". */
bool lum_overlay_is_kind(const char *name);
/* True when the view is to show illuminance (lum_view_settings) for it. */
bool lum_overlay_is_illuminance(const char *name);

/* What the last pass of a view was made from. */
struct lum_overlay_source {
    struct lum_view *view;
    const struct lum_snapshot *snapshot;
    const struct lum_view_settings *settings;
};

/* Makes a map of what the view shows. There is none for "none", if the method makes
 * no such map, and while nothing is known of it. Keeps its memory from call to call (zeroed at first); freed by
 * lum_overlay_finish. Thread: as lum_view_pass. */
LUM_MUST_USE enum lum_status lum_overlay_make(struct lum_overlay *overlay, const struct lum_overlay_want *want,
                                              const struct lum_overlay_source *source, struct lum_error *err);
void lum_overlay_finish(struct lum_overlay *overlay); /* accepts a zeroed one */

/* The map's colours over the pixels of a tile (w * h of RGBA8, display-referred). Nothing without a map, or for NULL.
 */
void lum_overlay_paint(const struct lum_overlay *overlay, const struct lum_frame_header *tile, uint8_t *inout_rgba);

#endif
