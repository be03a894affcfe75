/* What of a view's picture is sent, when, and what is read off it.
 *
 * Thread: the director. */
#ifndef LUM_SERVER_DIRECTOR_VIEW_FRAMES_H
#define LUM_SERVER_DIRECTOR_VIEW_FRAMES_H

#include "server/director/view.h"

enum lum_frame_due { LUM_DUE_NONE, LUM_DUE_FRAME, LUM_DUE_FINAL };
/* Which frame to send now, if the stream wants one. *ret_wait_ns (may be NULL): after how long to ask again; INT64_MAX:
 * not before something changes. */
enum lum_frame_due lum_server_view_due(const struct lum_server_view *v, int64_t now_ns, int64_t *ret_wait_ns);
/* Does the client read, or has it just been sent something? The pictures of who has not read for so long may not keep
 * the edits of others waiting. */
#define LUM_VIEW_UNREAD_NS 250000000ll /* four times what a drag has for a picture */
bool lum_server_view_is_awaited(const struct lum_server_view *v, int64_t now_ns);

/* What there is to see, so that an empty picture can be explained. */
enum lum_in_view {
    LUM_IN_VIEW_SCENE,
    LUM_IN_VIEW_DARK,   /* something is there, and no light comes from it */
    LUM_IN_VIEW_NOTHING /* background alone */
};
extern const char *const lum_in_view_names[];

struct lum_published {
    uint32_t n_tiles;
    uint64_t n_bytes;
    uint64_t line_bytes_s; /* as far as it is known; 0: not at all */
    struct lum_coding coding;
    double encode_ms, exposure_ev;
    uint32_t server_us;
    enum lum_in_view in_view;
};
/* scene: of the last pass, or the same picture under a newer revision. */
enum lum_status lum_server_view_publish(struct lum_server_view *v, const struct lum_snapshot *scene,
                                        struct lum_encoder *encoder, enum lum_frame_due due,
                                        struct lum_published *ret_published, struct lum_error *err);

/* What the picture has at a pixel. */
struct lum_reading {
    const char *unit; /* "cd/m2" or "lx" */
    double value;     /* NAN: none. Of illuminance where there is no surface; of any while a pass is due that shows what
                         has changed */
    double error;     /* root mean square around there; NAN: not known */
};
/* x, y: pixels of settings.w and .h, whatever is shown. scene: as of lum_server_view_publish. */
LUM_MUST_USE enum lum_status lum_server_view_read(struct lum_server_view *v, const struct lum_snapshot *scene,
                                                  uint32_t x, uint32_t y, struct lum_reading *ret_reading,
                                                  struct lum_error *err);

#endif
