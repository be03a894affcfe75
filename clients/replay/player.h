/* One run: says hello, opens a view, sends the edits of a replay in their time, turns the camera, and measures when
 * each of them is on the screen. */
#ifndef LUM_CLIENTS_REPLAY_PLAYER_H
#define LUM_CLIENTS_REPLAY_PLAYER_H

#include "clients/replay/canvas.h"
#include "clients/replay/latency.h"
#include "protocol/op/op.h"

struct player_options {
    const char *url, *ca, *token, *project;
    const char *method;     /* NULL: the scene's */
    const char *codec;      /* "jpeg" "png" "rgba8" */
    const char *record_dir; /* NULL: frames are not kept */
    uint32_t w, h, quality;
    uint32_t orbit;   /* camera steps after the edits */
    double speed;     /* 1: as recorded; 0: each edit as soon as the one before is shown */
    double timeout_s; /* longest wait for any reply or frame */
};

struct player_report {
    uint64_t edits, refused, frames, tiles, bytes;
    double seconds; /* from the first complete frame to the last */
    struct latency edit, camera;
    struct samples server; /* server_us of frames that showed something sent for the first time */
    char first_refusal[256];
};
void player_report_finish(struct player_report *r);
struct cJSON *player_report_to_json(struct player_report *r);

/* False: ret_reason says what went wrong; the report holds what was measured until then. */
bool player_run(const struct player_options *options, const struct lum_ops *ops, struct player_report *ret_report,
                char ret_reason[256]);

#endif
