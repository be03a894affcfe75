/* Large messages are read beside the net thread, one at a time: whoever waits for a small one does not wait for those
 * of somebody else. Reading is parsing, and making a request of it; nothing of a session is touched. */
#ifndef LUM_SERVER_NET_READER_H
#define LUM_SERVER_NET_READER_H

#include "core/base/status.h"
#include "protocol/message/rpc.h"
#include "server/base/role.h"
#include "server/director/request.h"

struct lum_reader;

struct lum_reading {
    struct lum_reading *next;
    struct lum_session_ref from;
    enum lum_role role;
    int64_t received_ns;
    char *text; /* from malloc; NULL once it is read */
    size_t n_bytes;
    bool parsed; /* else err says why not */
    bool asked;  /* request was read, or err says why there is none */
    struct lum_rpc rpc;
    struct lum_request *request; /* owned; has the id of rpc */
    struct lum_proto_error err;
};
void lum_reading_finish(struct lum_reading *m);  /* what is in it */
void lum_reading_destroy(struct lum_reading *m); /* accepts NULL */

/* ready: called on its thread whenever lum_reader_next has something. */
LUM_MUST_USE enum lum_status lum_reader_create(void (*ready)(void *user), void *user, struct lum_reader **ret_reader,
                                               struct lum_error *err);
void lum_reader_destroy(struct lum_reader *reader); /* accepts NULL; what it has not read is forgotten */
/* From lum_calloc; passes over. In order. */
void lum_reader_take(struct lum_reader *reader, struct lum_reading *m);
/* The next that was read; passes over. NULL: none. The one after it is read only then: memory is held for one. */
struct lum_reading *lum_reader_next(struct lum_reader *reader);

#endif
