/* Maps over the picture: where a method refined its samples, where the picture is off, how bright it is. Each is made
 * of few classes, which have a colour. */
#ifndef LUM_SERVER_STREAM_OVERLAY_H
#define LUM_SERVER_STREAM_OVERLAY_H

#include "core/render/view.h"
#include "protocol/message/frame.h"

enum { LUM_OVERLAY_CLASSES = 12, LUM_OVERLAY_NONE = 255 };

struct lum_overlay {
    uint32_t w, h;
    uint8_t *classes; /* of each pixel; LUM_OVERLAY_NONE: of no class, grey. NULL: there is no map */
    bool opaque;      /* colours alone; else half of what is shown is the grey picture, which keeps shapes readable */
    uint32_t n;
    uint8_t colors[LUM_OVERLAY_CLASSES][3]; /* sRGB */
    double limits[LUM_OVERLAY_CLASSES - 1]; /* between classes; of unit */
    const char *unit;                       /* "times refined", "relative", "cd/m2" or "lx" */
};

/* "none", "luminance", "illuminance", "error", or "guidance_EFFECT". */
bool lum_overlay_is_kind(const char *name);
/* True when the view is to show illuminance (lum_view_settings) for it. */
bool lum_overlay_is_illuminance(const char *name);

/* What the last pass of a view was made from. */
struct lum_overlay_source {
    struct lum_view *view;
    const struct lum_snapshot *snapshot;
    const struct lum_view_settings *settings;
};

/* Makes the map that the wire calls by this name, of what the view shows. There is none for "none", if the method makes
 * no such map, and while nothing is known of it. Keeps its memory from call to call (zeroed at first); freed by
 * lum_overlay_finish. Thread: as lum_view_pass. */
LUM_MUST_USE enum lum_status lum_overlay_make(struct lum_overlay *overlay, const char *name,
                                              const struct lum_overlay_source *source, struct lum_error *err);
void lum_overlay_finish(struct lum_overlay *overlay); /* accepts a zeroed one */

/* The map's colours over the pixels of a tile (w * h of RGBA8, display-referred). Nothing without a map, or for NULL.
 */
void lum_overlay_paint(const struct lum_overlay *overlay, const struct lum_frame_header *tile, uint8_t *inout_rgba);

#endif
