/* Where people are in a scene: the camera that each looks from, and the place that she points at. It is state, not
 * news: whoever reads slowly hears of the newest alone. Thread: net. */
#ifndef LUM_SERVER_NET_PRESENCE_H
#define LUM_SERVER_NET_PRESENCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/record/types.h"

struct cJSON;
struct lum_proto_error;
struct lum_rpc;
struct lum_session;
struct lum_sessions;

struct lum_presence {
    struct lum_record_camera camera;
    double point[3]; /* m */
    bool has_camera, has_point;
    bool listens;      /* it has said where it is, and hears of the others */
    bool stale;        /* there is something that it has not heard */
    int64_t told_tick; /* of the clock by which all are told: that in which its turn was last */
    /* The news that it was told last, and of tiles what was sent since then. */
    size_t text_bytes, tile_bytes;
};

/* presence.set. NULL: err says why. */
struct cJSON *lum_session_be_present(struct lum_session *s, const struct lum_rpc *rpc, struct lum_proto_error *err);
/* Something of s is otherwise, or it came or goes: its project is told, s itself too. */
void lum_session_stir(const struct lum_session *s);
/* Somebody has not heard the newest. */
bool lum_sessions_presence_waits(const struct lum_sessions *t);
/* Queues what is due for each that listens. Returns in how many nanoseconds to come back; INT64_MAX: nobody waits. */
int64_t lum_sessions_tell_presence(struct lum_sessions *t, int64_t now_ns);

#endif
