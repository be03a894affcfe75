/* What projects.c (those that are open) and project_orders.c (the list, and what is done with it) share. */
#ifndef LUM_SERVER_NET_PROJECTS_INTERNAL_H
#define LUM_SERVER_NET_PROJECTS_INTERNAL_H

#include <pthread.h>

#include "server/net/changes.h"
#include "server/net/projects.h"

enum lum_project_stage { LUM_STAGE_FREE, LUM_STAGE_OPENING, LUM_STAGE_OPEN, LUM_STAGE_FAILED, LUM_STAGE_CLOSING };

/* Work that blocks, on a thread of its own. */
struct lum_project_thread {
    pthread_t thread;
    bool runs;
    _Atomic bool done; /* all that it wrote is to be seen */
};

struct lum_project {
    struct lum_projects *all;
    enum lum_project_stage stage;
    struct lum_project_info info; /* as it was when it was opened; id "": the one scene */
    uint64_t opening;
    uint32_t n_sessions;
    bool entered;      /* since it was opened */
    int64_t unused_ns; /* since when nobody is in it; while it is OPEN */
    uint64_t opened_rev;
    struct lum_changes_kept changes;
    struct lum_project_thread thread;
    char path[LUM_PROJECT_PATH_BYTES];
    _Atomic bool alive; /* told since it was last asked; its director */
    /* of the thread while that runs */
    struct lum_director *director;
    struct lum_uploads *uploads;
    enum lum_status status;
    struct lum_error err;
};

struct lum_project_item {
    struct lum_project_info info;
    bool going;          /* into the trash, out of it, or for ever: nobody gets in, nothing else is done with it */
    uint64_t emptied_by; /* the work that empties the trash of it; 0: none does */
};

struct lum_project_work {
    struct lum_project_work *next;
    struct lum_projects *all;
    uint64_t number; /* from 1, in the order of coming */
    struct lum_project_order order;
    int64_t now_s;
    bool quiet;        /* ours: nobody is answered */
    uint32_t n_failed; /* of what was to be erased */
    /* The scene of one that is open, from its director. */
    struct lum_project *held; /* it is not closed meanwhile */
    struct lum_document_state state;
    bool has_state;
    _Atomic bool given; /* state and has_state are to be seen */
    struct lum_project_thread thread;
    enum lum_status status;
    struct lum_error err;
    /* After a failure: what is there now. */
    enum lum_status found_status;
    struct lum_project_info found;
};

struct lum_projects {
    struct lum_projects_config config; /* borrowed strings outlive it */
    bool many;
    struct lum_project_store store;
    struct lum_project_item *items;
    size_t n_items;
    uint64_t list_rev;
    struct lum_project_work *works, **works_tail; /* oldest first; the first may run */
    unsigned n_works;
    uint64_t n_ordered;
    struct lum_project_work *done, **done_tail;
    int64_t trash_look_ns;            /* when it is looked at again */
    struct lum_projects_metrics gone; /* counters of those that were closed */
    struct lum_project list[LUM_LIMIT_PROJECTS_OPEN];
};

/* False: there is no thread. */
bool lum_project_thread_begin(struct lum_project_thread *t, void *(*run)(void *), void *arg);
void lum_project_thread_end(struct lum_project_thread *t); /* waits for it */

/* ---- projects.c ---- */
/* Its director ends. Nobody is in it. */
void lum_project_close(struct lum_project *p);
bool lum_project_is_idle(const struct lum_project *p); /* open, and nobody is in it or sends files to it */

/* ---- project_orders.c ---- */
int64_t lum_projects_now_s(const struct lum_projects *all);
LUM_MUST_USE enum lum_status lum_projects_read_list(struct lum_projects *all, struct lum_error *err);
struct lum_project_item *lum_projects_item(const struct lum_projects *all, const char *id); /* NULL: there is none */
void lum_projects_turn_orders(struct lum_projects *all);
/* What is known of its changes goes to disk. */
void lum_projects_write_item(struct lum_projects *all, const struct lum_project_item *item);
/* What is in the trash for too long goes for ever. */
void lum_projects_age_trash(struct lum_projects *all, int64_t now_ns);
/* An order reads the project's folder, which its director must not open meanwhile. */
bool lum_projects_is_read(const struct lum_projects *all, const char *id);
void lum_projects_drop_orders(struct lum_projects *all); /* the one that runs is waited for */

#endif
