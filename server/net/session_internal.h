/* What the files of sessions share: session.c (life, and what comes in and goes out), session_hello.c (who it is),
 * session_resume.c (who comes back), session_admin.c (who is here), session_presence.c (where they look),
 * session_project.c (projects) and session_upload.c (who sends files). Everything belongs to the net thread. */
#ifndef LUM_SERVER_NET_SESSION_INTERNAL_H
#define LUM_SERVER_NET_SESSION_INTERNAL_H

#include <netinet/in.h>

#include "server/net/bucket.h"
#include "server/net/changes.h"
#include "server/net/downloads.h"
#include "server/net/presence.h"
#include "server/net/session.h"
#include "server/net/text_queue.h"

struct lum_hello;
struct lum_rpc;

#define LUM_RESUME_KEY_BYTES 32 /* characters of 6 random bits: not to be guessed */

struct lum_session {
    struct lum_sessions *table; /* immutable */
    struct lum_session_ref ref; /* generation changes with each use of the slot */
    bool open, greeted, close_after_text;
    struct lum_project *project; /* whose scene it sees, until the director knows that it left; NULL: none */
    struct lum_hello *waiting;   /* what it said: its project is not open yet. NULL: it does not wait */
    char *waiting_id;            /* of that request; NULL: it wants no reply */
    int64_t waiting_ns, told_ns; /* since when it waits; when it was told so last */
    const char *told_stage;
    bool leaving; /* closed, but the director's inbox was full: it has not been told yet, and the slot is not free */
    const struct lum_request_type *farewell; /* what it is told */
    bool done;                               /* the client will not come back */
    bool superseded; /* another connection has the name, the undo and all else that outlives this one */
    enum lum_close close;
    char user[LUM_LIMIT_ID_BYTES + 1];
    struct lum_person person;           /* who it is, once greeted */
    char key[LUM_RESUME_KEY_BYTES + 1]; /* who knows it may go on with this session; "": nobody */
    char peer[INET6_ADDRSTRLEN];
    struct lum_bucket bytes;    /* paid before anybody looks at what came */
    struct lum_bucket messages; /* paid for what the director is asked */
    struct lum_text_queue text;
    struct lum_presence presence;
    struct lum_stream *streams[LUM_LIMIT_VIEWS_PER_SESSION];
    uint64_t n_announced;            /* bytes of files */
    uint32_t n_streams, next_stream; /* round robin, so that no view of a client starves another */
    /* The message being sent: one of the two. */
    struct lum_text *sending_text;
    struct lum_encoded_tile *sending_tile;
};

/* One who was cut off, and may come back, while the project is open: later she comes as after a start. */
struct lum_parked {
    const struct lum_project *project;
    uint64_t opening;                  /* of it */
    char user[LUM_LIMIT_ID_BYTES + 1]; /* "": the place is free */
    char key[LUM_RESUME_KEY_BYTES + 1];
    struct lum_person person;
    int64_t until_ns;
};

struct lum_sessions {
    struct lum_sessions_config config;
    bool draining;
    bool ended; /* lum_sessions_take_ended */
    uint32_t n_greeted;
    uint64_t people_rev; /* another one whenever somebody came or went */
    char *list_text;     /* the answer to project.list, as it is written; NULL: nobody has asked */
    uint64_t list_rev, list_people_rev;
    int64_t refusal_told_ns; /* when the log last heard of a wrong token; 0: never */
    uint32_t n_untold;       /* wrong tokens since then */
    struct lum_downloads downloads;
    struct lum_parked parked[LUM_LIMIT_PARKED];
    struct lum_session slots[LUM_LIMIT_CONNECTIONS];
};

/* ---- session.c ---- */
/* Queues a text, which passes over; NULL (memory is short) ends the session. */
void lum_session_say(struct lum_session *s, char *text);
/* The error reply; without an id (a notification) the client cannot be told. */
void lum_session_refuse(struct lum_session *s, const char *id, const struct lum_proto_error *err);

void lum_session_queue_text(struct lum_session *s, struct lum_text *t);
/* False: it is in no project; err says so. */
bool lum_session_has_scene(const struct lum_session *s, struct lum_proto_error *err);
/* Tells the director; false when that has to be tried again. */
bool lum_session_post(struct lum_session *s, const struct lum_request_type *type);

struct lum_session *lum_session_find(struct lum_sessions *sessions, struct lum_session_ref ref); /* NULL: it is gone */

/* ---- session_receive.c ---- */
/* A stream may be hungry: the director is to look. */
void lum_session_wake_director(struct lum_session *s, struct lum_stream *stream);

/* ---- session_hello.c ---- */
void lum_session_receive_hello(struct lum_session *s, struct lum_rpc *rpc, int64_t now_ns);
/* Is its project open now? */
void lum_session_go_on_waiting(struct lum_session *s, int64_t now_ns);
void lum_session_stop_waiting(struct lum_session *s);

/* ---- session_resume.c ---- */
/* The new session s, whose person is known, goes on with the one of that name, open or cut off, if the key is its own:
 * it then has its name and its key, and that one ends. False: there is none, or it is not for this one. */
bool lum_session_resume(struct lum_session *s, const char *name, const char *key, int64_t now_ns);
/* May the person have a name that nobody has now, of before the server was started? */
bool lum_session_may_be(const struct lum_session *s, const char *name);
/* A key of its own. */
void lum_session_make_key(struct lum_session *s);
bool lum_sessions_have_parked(const struct lum_sessions *t, const char *user);
/* The connection of s is gone: keeps its place, for LUM_LIMIT_RESUME_S. */
void lum_session_park(struct lum_session *s, int64_t now_ns);
/* Forgets those who did not come back. */
void lum_sessions_forget_parked(struct lum_sessions *t, int64_t now_ns);
/* Says the last n changes of its scene. */
void lum_session_say_missed(struct lum_session *s, int n);

/* ---- session_admin.c ---- */
/* Answers what needs no director. False: the message is something else. */
bool lum_session_administer(struct lum_session *s, struct lum_rpc *rpc);
bool lum_session_is_here(const struct lum_session *s);
/* Its token has ended, and so does it: asked before anything is taken from a session, or news are sent to it. */
bool lum_session_outstayed(struct lum_session *s);

/* ---- session_project.c: NULL: err says why ---- */
struct cJSON *lum_session_list_projects(struct lum_session *s, const struct lum_rpc *rpc, struct lum_proto_error *err);
/* What takes its time on disk. False: err says why; true: the answer comes later, and takes rpc->id. */
bool lum_session_order_project(struct lum_session *s, struct lum_rpc *rpc, enum lum_project_verb verb,
                               struct lum_proto_error *err);
/* Answers what is done. */
void lum_sessions_answer_orders(struct lum_sessions *t);

/* ---- session_upload.c ---- */
/* asset.upload. NULL: err says why. */
struct cJSON *lum_session_announce(struct lum_session *s, const struct lum_rpc *rpc, struct lum_proto_error *err);

#endif
