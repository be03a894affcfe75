/* Sessions: what a connected client may say and what waits to be sent to it. Knows messages, no socket: the network
 * layer feeds it whole text messages and asks it what to send next, so a test or a fuzzer can do the same.
 *
 * Life of a session: open; session.hello with the token, within LUM_LIMIT_HELLO_S; then requests. Where there are
 * projects hello says which, and is answered when that one is open; a session of none can ask for the list of them. A
 * request goes to the project's director, whose answer comes back through its outbox; nothing here blocks. Outgoing
 * text is one queue in the order of events, bounded by LUM_LIMIT_CONTROL_QUEUE_BYTES, and goes before tiles; tiles are
 * state (stream.h).
 *
 * Thread: the net thread, for everything. */
#ifndef LUM_SERVER_NET_SESSION_H
#define LUM_SERVER_NET_SESSION_H

#include "server/net/auth.h"
#include "server/net/message.h"
#include "server/net/projects.h"

struct lum_net_counters;
struct lum_reader;
struct lum_reading;
struct lum_session;
struct lum_sessions; /* the table of all */

struct lum_sessions_config {
    struct lum_projects *projects;
    const struct lum_auth *auth;
    struct lum_net_counters *counters;
    bool imports;      /* there is a folder of assets */
    const char *saved; /* when an edit is on disk: "commit", "interval"; NULL: never */
    bool audit;        /* who comes and goes is logged whatever the level of the log, and its rate */
    struct lum_log log;
};
LUM_MUST_USE enum lum_status lum_sessions_create(const struct lum_sessions_config *config,
                                                 struct lum_sessions **ret_sessions, struct lum_error *err);
void lum_sessions_destroy(struct lum_sessions *sessions); /* accepts NULL */

/* Hands the outboxes of directors to the sessions they are for, and lets in who waits for a project. */
void lum_sessions_deliver(struct lum_sessions *sessions);
/* The file that a session was told to fetch by this ticket: once, freed with free(). NULL: none. */
uint8_t *lum_sessions_take_file(struct lum_sessions *sessions, const char *ticket, size_t *ret_n);
/* Tells every session that the server stops; each closes with LUM_CLOSE_RESTART once its text is out. */
void lum_sessions_begin_drain(struct lum_sessions *sessions);

/* Ends the sessions of people whose token is no more what it was when they came: taken away, made anew, of another
 * role, or over. now_s: of the Unix epoch. */
void lum_sessions_review(struct lum_sessions *sessions, int64_t now_s);

/* Has a message of one session ended another since the last call? Whoever has the connections must look at all of them.
 */
bool lum_sessions_take_ended(struct lum_sessions *sessions);

/* peer: its address, for the log. NULL when there are LUM_LIMIT_CONNECTIONS already. */
struct lum_session *lum_session_open(struct lum_sessions *sessions, const char *peer);
/* The connection is gone: the client may come back by another, for LUM_LIMIT_RESUME_S. Accepts NULL. */
void lum_session_close(struct lum_session *s);
void lum_session_leave(struct lum_session *s); /* it says that it will not: when its connection is gone, all is */
uint32_t lum_session_slot(const struct lum_session *s); /* 0 .. LUM_LIMIT_CONNECTIONS - 1 */
bool lum_session_greeted(const struct lum_session *s);  /* it has shown its token: hello was said */
/* The longest message accepted now: small before hello, LUM_LIMIT_MESSAGE_BYTES after. */
size_t lum_session_max_bytes(const struct lum_session *s);

/* Pays for bytes that came, before anybody looks at them; whole_frame: a frame ends with them. Returns for how many
 * nanoseconds nothing more may be read from this client; 0: go on. */
int64_t lum_session_charge(struct lum_session *s, const char *bytes, size_t n, bool whole_frame);
/* Likewise for bytes that were of no message. */
int64_t lum_session_charge_rest(struct lum_session *s, uint64_t n_bytes);
/* One whole text message. */
void lum_session_receive(struct lum_session *s, const char *text, size_t n_bytes);
/* The same of a large one, which the reader reads first. */
enum lum_read_beside {
    LUM_READ_NOT,    /* this session's are read at once, or memory is short: nothing has happened */
    LUM_READ_LATER,  /* text, from malloc, passed over */
    LUM_READ_REFUSED /* likewise: too much waits, as the session was told, or nothing is heard of it any more */
};
enum lum_read_beside lum_session_read_beside(struct lum_session *s, struct lum_reader *reader, char *text,
                                             size_t n_bytes);
void lum_session_forget_beside(const struct lum_session *s, struct lum_reader *reader); /* what is not read yet */
/* When it has been read. NULL: its session is gone. */
struct lum_session *lum_sessions_receive_read(struct lum_sessions *sessions, struct lum_reading *reading);
/* The session must end: with this code, at once or when its text is out. The first call counts. */
void lum_session_abort(struct lum_session *s, enum lum_close code);
void lum_session_abort_after_text(struct lum_session *s, enum lum_close code);

/* ---- sending ---- */
bool lum_session_pending(const struct lum_session *s); /* there is a message to send, or a close */
/* Why to close now, or LUM_CLOSE_NONE. Not asked for in the middle of a message. */
enum lum_close lum_session_close_now(const struct lum_session *s);
/* Begins the next message. False: nothing to send. One at a time. */
bool lum_session_next(struct lum_session *s, struct lum_message *ret_message);
/* The message is in the network layer's hands. */
void lum_session_sent(struct lum_session *s);

#endif
