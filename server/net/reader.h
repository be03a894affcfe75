/* Large messages are read beside the net thread, one at a time: whoever waits for a small one does not wait for those
 * of somebody else. Reading is parsing, and making a request of it; nothing of a session is touched. */
#ifndef LUM_SERVER_NET_READER_H
#define LUM_SERVER_NET_READER_H

#include "core/base/status.h"
#include "protocol/message/rpc.h"
#include "server/base/role.h"
#include "server/director/request.h"

struct lum_reader;

/* Of text that waits, as for requests that are read: 32 of the longest messages. A small one behind a large one of the
 * same session waits in any case: of such there are no more than came with one read from its socket. */
#define LUM_READER_MAX_BYTES (256u << 20)
#define LUM_READER_SMALL_BYTES (16u << 10) /* shorter ones are read in less than a millisecond */

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
/* From lum_calloc; passes over. Those of a session are read in order, and sessions take turns: whoever sends many lets
 * others wait for one of them. False: too much text waits already, and nothing passed over. */
LUM_MUST_USE bool lum_reader_take(struct lum_reader *reader, struct lum_reading *m);
/* The session is gone: what waits of it is forgotten. */
void lum_reader_forget(struct lum_reader *reader, struct lum_session_ref session);
size_t lum_reader_waiting_bytes(struct lum_reader *reader); /* of text that waits */
/* The next that was read; passes over. NULL: none. The one after it is read only then: memory is held for one. */
struct lum_reading *lum_reader_next(struct lum_reader *reader);

#endif
