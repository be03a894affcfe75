/* Files that sessions have asked for, until they are fetched: one GET with a ticket that is not to be guessed. One of a
 * session, for a minute. No socket here. Thread: the net thread, for everything. */
#ifndef LUM_SERVER_NET_DOWNLOADS_H
#define LUM_SERVER_NET_DOWNLOADS_H

#include "protocol/base/error.h"
#include "server/director/request.h"

#define LUM_DOWNLOAD_FOLDER "download"
#define LUM_DOWNLOAD_TICKET_BYTES 32 /* characters of 6 random bits */

struct lum_download {
    struct lum_session_ref by;
    char ticket[LUM_DOWNLOAD_TICKET_BYTES + 1];
    uint8_t *bytes; /* malloc; NULL: the place is free */
    size_t n;
    int64_t until_ns;
};
/* All zero: none. */
struct lum_downloads {
    struct lum_download list[LUM_LIMIT_DOWNLOADS];
};

/* bytes pass over, also where it is refused. What the session had before is gone. */
bool lum_downloads_keep(struct lum_downloads *all, struct lum_session_ref by, uint8_t *bytes, size_t n,
                        char ret_ticket[LUM_DOWNLOAD_TICKET_BYTES + 1], struct lum_proto_error *err);
/* The file of the ticket, which works once: the caller frees it with free(). NULL: there is none (any more). */
uint8_t *lum_downloads_take(struct lum_downloads *all, const char *ticket, size_t *ret_n);
/* Those that nobody has fetched in time. */
void lum_downloads_forget(struct lum_downloads *all, int64_t now_ns);
void lum_downloads_drop(struct lum_downloads *all, struct lum_session_ref by); /* the session is gone */
void lum_downloads_finish(struct lum_downloads *all);

#endif
