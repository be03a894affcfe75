/* Edits on their way into the scene, and imports that turn their assets into records first (internal.h). */
#ifndef LUM_SERVER_DIRECTOR_EDITS_H
#define LUM_SERVER_DIRECTOR_EDITS_H

#include <pthread.h>

#include "protocol/document/past.h"
#include "server/director/request.h"
#include "server/import/expand.h"
#include "server/world/world.h"

struct lum_director;
struct lum_entry;

/* An edit that is applied and not committed yet; or a name of a moment that waits for the journal. */
struct lum_staged_edit {
    struct lum_staged_edit *next; /* the one before it: taken back first to last */
    struct lum_request *request;
    struct lum_changes changes;
    uint64_t scene_rev;
    struct lum_expansion expansion; /* warnings for the reply */
    struct lum_entry *entry;        /* for the journal; NULL: nothing is kept */
    uint64_t seq;                   /* of the entry, once it is submitted */
    bool is_name;                   /* it has nothing but seq and this: */
    struct lum_moment_name was;     /* the one before */
};

struct lum_import_job {
    struct lum_import_job *next;
    struct lum_director *director;
    struct lum_request *request;
    struct lum_totals_guard guard; /* set before the thread starts, then its own */
    /* written by the import thread, read after done */
    struct lum_expansion expansion;
    struct lum_entry *entry; /* names what was stored; NULL: nothing is kept */
    struct lum_proto_error error;
    bool ok;
    int64_t told_ns; /* when progress was last sent */
    char told_stage[32];
    /* director thread */
    struct lum_request *again; /* the same edit, from one who was cut off meanwhile: it gets the answer. NULL: nobody */
    pthread_t thread;
    bool started;
    _Atomic bool done; /* set last by the import thread (release), read by the director (acquire) */
};

/* Takes in finished imports, starts waiting ones. */
void lum_director_turn_imports(struct lum_director *d);
/* Takes an edit over whose ops are there, and the warnings of its reply. */
void lum_director_edit(struct lum_director *d, struct lum_request *q, struct lum_expansion *warnings);
void lum_director_refuse_edit(struct lum_director *d, struct lum_request *q, const struct lum_proto_error *err);
/* op_id and repeat, of a request that edits. */
void lum_director_read_op_id(struct lum_json_reader *r, struct lum_request *q);
/* Publishes pending edits, answers them, and refreshes the views. */
void lum_director_commit(struct lum_director *d);
/* Ends all imports and drops what waits. */
void lum_director_drop_imports(struct lum_director *d);
void lum_director_free_edit(struct lum_staged_edit *p);
/* Numbers of the published scene, for /metrics. */
void lum_director_count_scene(struct lum_director *d);

#endif
