/* Files on their way from people to the upload store: announced by a session, which gets a ticket for one PUT of just
 * so many bytes. Bounds how much, how many at once, and for how long. No socket here.
 *
 * What comes is written by a thread of its own for each upload, so that a slow disk stops nobody but who sends: net.c
 * stops reading where lum_upload_add says so. Thread: the net thread, for everything here. */
#ifndef LUM_SERVER_NET_UPLOADS_H
#define LUM_SERVER_NET_UPLOADS_H

#include "protocol/base/error.h"
#include "server/director/request.h"
#include "server/journal/upload_store.h"

struct cJSON;
struct lum_upload;
struct lum_uploads;

#define LUM_UPLOAD_TICKET_BYTES 32 /* characters of 6 random bits: not to be guessed */

struct lum_uploads_config {
    const char *root;
    uint64_t max_bytes; /* that are kept */
    const struct lum_disk *disk;
    bool audit;
    struct lum_log log;
    void (*wake)(void *user); /* thread: any. lum_uploads_at has something new */
    void *wake_user;
};
LUM_MUST_USE enum lum_status lum_uploads_create(const struct lum_uploads_config *config,
                                                struct lum_uploads **ret_uploads, struct lum_error *err);
void lum_uploads_destroy(
    struct lum_uploads *all); /* waits for the disk; no connection has one any more. Accepts NULL */

/* ---- the session ---- */

/* files pass over, if it is announced; user: for the log. */
bool lum_uploads_announce(struct lum_uploads *all, struct lum_session_ref by, const char *user,
                          struct lum_upload_file *files, size_t n_files, char ret_ticket[LUM_UPLOAD_TICKET_BYTES + 1],
                          struct lum_proto_error *err);
/* The session is gone, and what it sends with it. Accepts NULL. */
void lum_uploads_drop(struct lum_uploads *all, struct lum_session_ref by);

/* ---- its PUT ---- */

/* n_bytes: Content-Length; -1: there was none. NULL: *ret_status says why. */
struct lum_upload *lum_uploads_begin(struct lum_uploads *all, const char *ticket, int64_t n_bytes, void *connection,
                                     int *ret_status);
enum lum_upload_go { LUM_UPLOAD_GO_ON, LUM_UPLOAD_WAIT /* read no more for now */, LUM_UPLOAD_HANG_UP };
enum lum_upload_go lum_upload_add(struct lum_upload *u, const void *bytes, size_t n);
void lum_upload_end(struct lum_upload *u); /* all came */
/* The answer, an object that the caller frees (NULL: memory is short), and its HTTP status; u is gone. Once
 * lum_upload_is_done. */
int lum_upload_answer(struct lum_upload *u, struct cJSON **ret_json);
/* The connection is gone. Accepts NULL. */
void lum_upload_release(struct lum_upload *u);

/* After wake: 0 .. LUM_LIMIT_UPLOADS_AT_ONCE - 1. NULL: no connection has one there. Accepts all == NULL. */
struct lum_upload *lum_uploads_at(struct lum_uploads *all, unsigned i);
void *lum_upload_connection(const struct lum_upload *u);
bool lum_upload_is_done(const struct lum_upload *u); /* and all was said of it */
bool lum_upload_may_go_on(struct lum_upload *u);

#endif
