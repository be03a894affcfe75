/* The scenes of this daemon. Either one, which is there from the start to the end; or projects of a folder
 * (--projects), each with a director of its own while somebody works in it.
 *
 * Life of a project: closed (all of it is on disk), opening (a thread loads it), open, closing (a thread ends its
 * director, whose journal writes what waits). One without sessions is closed after a while, and earlier where its place
 * or its memory is wanted: longest unused first. So the least used give their memory back.
 *
 * Thread: the net thread, for everything. What blocks runs on threads of its own, which wake the net thread. */
#ifndef LUM_SERVER_NET_PROJECTS_H
#define LUM_SERVER_NET_PROJECTS_H

#include "protocol/base/error.h"
#include "server/director/director.h"
#include "server/net/uploads.h"
#include "server/project/copy.h"

struct lum_changes_kept;
struct lum_project;
struct lum_projects;
struct lum_text;

struct lum_projects_config {
    const char *path;                    /* of the folder */
    struct lum_director_config director; /* of each; scene, state_dir, uploads_dir and log are its own */
    struct lum_uploads_config uploads;   /* likewise; max_bytes 0: nobody may send files */
    uint32_t max_open;                   /* 1 .. LUM_LIMIT_PROJECTS_OPEN */
    uint64_t max_bytes;                  /* of this process, beyond which unused ones are closed; 0: no end */
    int64_t unused_ns;                   /* so long one without sessions stays open */
    uint64_t (*memory_now)(void);        /* NULL: what the system says; tests say otherwise */
    int64_t (*time_now)(void);           /* likewise: seconds of the Unix epoch */
    const struct lum_disk *disk;         /* likewise: for what is done with the folders of projects */
};
LUM_MUST_USE enum lum_status lum_projects_create(const struct lum_projects_config *config,
                                                 struct lum_projects **ret_projects, struct lum_error *err);
/* One scene. director and uploads (NULL: nobody may send files) outlive it. */
LUM_MUST_USE enum lum_status lum_projects_of_one(struct lum_director *director, struct lum_uploads *uploads,
                                                 struct lum_projects **ret_projects, struct lum_error *err);
/* Closes all; no session is in any. False: one is still being loaded, and the process has to end without it. Accepts
 * NULL. */
bool lum_projects_destroy(struct lum_projects *all);

bool lum_projects_are_many(const struct lum_projects *all); /* false: there is one scene, without a name */
/* Goes on with what waits and closes what is unused: after each wake, and once a second where there are many. */
void lum_projects_turn(struct lum_projects *all, int64_t now_ns);
/* Do the directors of all that are open turn? */
bool lum_projects_alive(const struct lum_projects *all);
/* Has each of them told since the last call that it does? (lum_director_config.alive) */
bool lum_projects_take_alive(struct lum_projects *all);

/* ---- sessions in them ---- */

enum lum_project_door {
    LUM_PROJECT_IN,   /* until lum_project_leave */
    LUM_PROJECT_SOON, /* ask again after the next turn */
    LUM_PROJECT_NO,   /* err says why */
};
/* id "": the one scene. */
enum lum_project_door lum_projects_enter(struct lum_projects *all, const char *id, int64_t now_ns,
                                         struct lum_project **ret_project, struct lum_proto_error *err);
/* Told who waits: "opening", its scene is being read; "waiting", something else has to end first. */
const char *lum_projects_stage(const struct lum_projects *all, const char *id);
void lum_project_leave(struct lum_project *p, int64_t now_ns); /* accepts NULL */

/* Those that are open: 0 .. LUM_LIMIT_PROJECTS_OPEN - 1; NULL: none is there. */
struct lum_project *lum_projects_at(const struct lum_projects *all, unsigned i);
const struct lum_project_info *lum_project_info(const struct lum_project *p); /* id "": the one scene */
struct lum_director *lum_project_director(const struct lum_project *p);
struct lum_uploads *lum_project_uploads(const struct lum_project *p); /* NULL: nobody may send files */
uint64_t lum_project_starts(const struct lum_project *p); /* of its state: names of users are not given again */
struct lum_changes_kept *lum_project_changes(struct lum_project *p);
/* Somebody changed its scene. text: NULL where memory was short. */
void lum_project_note_change(struct lum_project *p, uint64_t scene_rev, struct lum_text *text);
/* Another one with each opening, 0 while it is not open: who was cut off from it finds nothing of the last time. */
uint64_t lum_project_opening(const struct lum_project *p);

/* ---- the list, and what people do with it ---- */

size_t lum_projects_count(const struct lum_projects *all);
const struct lum_project_info *lum_projects_nth(const struct lum_projects *all, size_t i);
/* Another one whenever something of the list is otherwise, or one was opened or closed. */
uint64_t lum_projects_list_rev(const struct lum_projects *all);
struct lum_project *lum_projects_find_open(const struct lum_projects *all, const char *id); /* NULL: it is not open */

enum lum_project_verb {
    LUM_PROJECT_CREATE,
    LUM_PROJECT_RENAME,
    LUM_PROJECT_DELETE,
    LUM_PROJECT_RESTORE,
    LUM_PROJECT_ERASE,
    LUM_TRASH_EMPTY,
    LUM_VERSION_KEEP,
    LUM_VERSION_LIST,
    LUM_VERSION_REMOVE,
};
struct lum_project_order {
    struct lum_session_ref by;
    char user[LUM_LIMIT_ID_BYTES + 1];
    char *rpc_id; /* passes over with a true answer. NULL: nobody wants to know */
    enum lum_project_verb verb;
    struct lum_project_info info; /* create: name, scene; others: id, and rename: name */
    lum_project_id from, version; /* create: what it begins with, "": info.scene. version.remove: which; made by keep */
    char version_name[LUM_LIMIT_PROJECT_NAME_BYTES + 1]; /* keep */
    struct lum_version_list *versions;                   /* the answer of version.list, from lum_calloc; the caller's */
    uint32_t n_erased;                                   /* the answer of trash.empty */
};
/* False: err says why not. */
bool lum_projects_order(struct lum_projects *all, const struct lum_project_order *order, struct lum_proto_error *err);
/* The next that is done; the caller frees rpc_id with free(), and versions with lum_free(). *ret_status, *err: how it
 * ended; order->info is what came of it. False: none. */
bool lum_projects_next_done(struct lum_projects *all, struct lum_project_order *ret_order, enum lum_status *ret_status,
                            struct lum_error *err);

/* ---- counters ---- */
struct lum_projects_metrics {
    struct lum_director_metrics sum; /* of all that are and were open; of the journal, too */
    uint64_t opened, closed, refused;
    uint32_t n_open;
};
void lum_projects_metrics(const struct lum_projects *all, struct lum_projects_metrics *ret_metrics);

#endif
