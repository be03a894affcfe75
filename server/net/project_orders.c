/* The list of projects, and what people do with it: on disk, one order after the other, each on a thread. */
#define _GNU_SOURCE /* pthread_setname_np */
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "server/base/log.h"
#include "server/net/projects_internal.h"

#define TRASH_LOOK_NS (3600ll * 1000000000) /* it holds for a month: an hour more is none */

int64_t lum_projects_now_s(const struct lum_projects *all)
{
    return all->config.time_now ? all->config.time_now() : (int64_t)time(NULL);
}

/* ---- the list ---- */

static bool add_item(struct lum_projects *all, const struct lum_project_info *info)
{
    if (all->n_items == LUM_LIMIT_PROJECTS)
        return false;
    all->items[all->n_items++] = (struct lum_project_item){.info = *info};
    all->list_rev++;
    return true;
}

static void remove_item(struct lum_projects *all, struct lum_project_item *item)
{
    size_t i = (size_t)(item - all->items);
    memmove(item, item + 1, (--all->n_items - i) * sizeof *item);
    all->list_rev++;
}

static bool list_one(void *user, const struct lum_project_info *info)
{
    struct lum_projects *all = user;
    const struct lum_log *log = &all->config.director.log;
    if (lum_projects_item(all, info->id)) { /* somebody put it back by hand */
        lum_log(log, LUM_LOG_ERROR, "projects", "%s is there twice: one of them is left out", info->id);
        return true;
    }
    if (add_item(all, info))
        return true;
    lum_log(log, LUM_LOG_ERROR, "projects", "there are more than %u projects: some are left out", LUM_LIMIT_PROJECTS);
    return false;
}

enum lum_status lum_projects_read_list(struct lum_projects *all, struct lum_error *err)
{
    all->items = lum_calloc(LUM_LIMIT_PROJECTS, sizeof *all->items);
    if (!all->items)
        return lum_fail(err, LUM_ERR_NOMEM, "projects", "no memory for the list of projects");
    return lum_project_store_each(&all->store, &all->config.director.log, list_one, all, err);
}

struct lum_project_item *lum_projects_item(const struct lum_projects *all, const char *id)
{
    for (size_t i = 0; i < all->n_items; i++)
        if (strcmp(all->items[i].info.id, id) == 0)
            return &all->items[i];
    return NULL;
}

size_t lum_projects_count(const struct lum_projects *all)
{
    return all->n_items;
}

uint64_t lum_projects_list_rev(const struct lum_projects *all)
{
    return all->list_rev;
}

const struct lum_project_info *lum_projects_nth(const struct lum_projects *all, size_t i)
{
    return &all->items[i].info;
}

/* ---- orders ---- */

static bool push(struct lum_projects *all, const struct lum_project_order *order, bool quiet,
                 struct lum_proto_error *err)
{
    struct lum_project_work *w = lum_calloc(1, sizeof *w);
    if (!w)
        return lum_proto_fail_memory(err);
    w->all = all;
    w->number = ++all->n_ordered;
    w->order = *order;
    w->quiet = quiet;
    *all->works_tail = w;
    all->works_tail = &w->next;
    all->n_works++;
    return true;
}

/* Who must not be in a project that is deleted. */
static bool may_be_deleted(const struct lum_projects *all, const char *id, struct lum_proto_error *err)
{
    const struct lum_project *p = lum_projects_find_open(all, id);
    bool used = p && (p->stage == LUM_STAGE_OPENING || (p->stage == LUM_STAGE_OPEN && !lum_project_is_idle(p)));
    return !used || lum_proto_fail(err, LUM_PROTO_APPLICATION, "in_use", "project",
                                   "somebody is in this project: it can be deleted when everybody has left it");
}

/* Only one that is in the trash goes for ever. */
static bool refuse_to_erase(const struct lum_projects *all, const char *id, struct lum_proto_error *err)
{
    static const char first[] = "project.delete puts it into the trash first";
    const struct lum_project *p = lum_projects_find_open(all, id);
    if (p && p->n_sessions)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "in_use", "project",
                              "somebody is in this project: when everybody has left it, %s", first);
    return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "project", "this project is not in the trash: %s",
                          first);
}

static bool is_there(const struct lum_projects *all, const char *id)
{
    const struct lum_project_item *item = lum_projects_item(all, id);
    return item && !item->info.deleted_s && !item->going;
}

static uint32_t waiting_of(const struct lum_projects *all, struct lum_session_ref by)
{
    uint32_t n = 0;
    for (const struct lum_project_work *w = all->works; w; w = w->next)
        n += !w->quiet && lum_session_same(w->order.by, by);
    return n;
}

static bool check_order(const struct lum_projects *all, const struct lum_project_order *o,
                        struct lum_project_item **ret_item, struct lum_proto_error *err)
{
    if (!all->many)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "unsupported", "method",
                              "this server has one scene, and no projects");
    if (all->n_works >= LUM_LIMIT_PROJECT_REQUESTS)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "",
                              "too much is being done with projects; try again");
    if (waiting_of(all, o->by) >= LUM_LIMIT_PROJECT_REQUESTS_OF)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "",
                              "%u requests of this session that change or read projects are waiting, which is the "
                              "limit; try again when one of them is answered",
                              LUM_LIMIT_PROJECT_REQUESTS_OF);
    if (o->verb == LUM_PROJECT_CREATE && all->n_items + all->n_works >= LUM_LIMIT_PROJECTS)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "",
                              "a server has at most %u projects, those in the trash, too", LUM_LIMIT_PROJECTS);
    if (o->verb == LUM_TRASH_EMPTY || (o->verb == LUM_PROJECT_CREATE && !o->from[0]))
        return true;
    if (o->verb == LUM_PROJECT_CREATE)
        return is_there(all, o->from) ||
               lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "from", "there is no such project");
    struct lum_project_item *item = *ret_item = lum_projects_item(all, o->info.id);
    bool wanted = o->verb == LUM_PROJECT_RESTORE || o->verb == LUM_PROJECT_ERASE;
    if (item && !item->going && (item->info.deleted_s != 0) == wanted)
        return o->verb != LUM_PROJECT_DELETE || may_be_deleted(all, o->info.id, err);
    if (o->verb == LUM_PROJECT_ERASE && item && !item->going)
        return refuse_to_erase(all, o->info.id, err);
    return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "project", "there is no such project%s",
                          wanted ? " in the trash" : "");
}

/* Deleted before then, and nobody does anything with it. */
static bool lies_since(const struct lum_project_item *item, int64_t before_s)
{
    return item->info.deleted_s && item->info.deleted_s < before_s && !item->going;
}

/* It goes with the newest order, which empties the trash. What goes already is left to whom it goes with. */
static void mark_trash(struct lum_projects *all, int64_t before_s)
{
    for (size_t i = 0; i < all->n_items; i++) {
        struct lum_project_item *item = &all->items[i];
        if (!lies_since(item, before_s))
            continue;
        item->going = true;
        item->emptied_by = all->n_ordered;
    }
}

void lum_projects_age_trash(struct lum_projects *all, int64_t now_ns)
{
    struct lum_proto_error err;
    const struct lum_project_order o = {.verb = LUM_TRASH_EMPTY};
    int64_t before_s = lum_projects_now_s(all) - LUM_LIMIT_TRASH_S;
    bool any = false;
    if (now_ns < all->trash_look_ns)
        return;
    all->trash_look_ns = now_ns + TRASH_LOOK_NS;
    for (size_t i = 0; i < all->n_items && !any; i++)
        any = lies_since(&all->items[i], before_s);
    if (any && push(all, &o, true, &err))
        mark_trash(all, before_s);
}

bool lum_projects_order(struct lum_projects *all, const struct lum_project_order *order, struct lum_proto_error *err)
{
    struct lum_project_order o = *order;
    struct lum_project_item *item = NULL;
    if (!check_order(all, order, &item, err))
        return false;
    if (item) {
        o.info = item->info;
        if (o.verb == LUM_PROJECT_RENAME)
            memcpy(o.info.name, order->info.name, sizeof o.info.name);
    } else {
        o.info.changed_s = lum_projects_now_s(all);
    }
    if (!push(all, &o, false, err))
        return false;
    if (o.verb == LUM_PROJECT_DELETE || o.verb == LUM_PROJECT_RESTORE || o.verb == LUM_PROJECT_ERASE)
        item->going = true;
    if (o.verb == LUM_TRASH_EMPTY)
        mark_trash(all, INT64_MAX);
    lum_projects_turn_orders(all);
    return true;
}

void lum_projects_write_item(struct lum_projects *all, const struct lum_project_item *item)
{
    struct lum_proto_error err;
    const struct lum_project_order o = {.verb = LUM_PROJECT_RENAME, .info = item->info};
    if (!push(all, &o, true, &err))
        lum_log(&all->config.director.log, LUM_LOG_WARNING, "projects", "%s: no memory to note when it was changed",
                item->info.id);
}

/* ---- the thread ---- */

/* Whose scene is read; "": nobody's. */
static const char *source_of(const struct lum_project_work *w)
{
    return w->order.verb == LUM_PROJECT_CREATE ? w->order.from
           : w->order.verb == LUM_VERSION_KEEP ? w->order.info.id
                                               : "";
}

bool lum_projects_is_read(const struct lum_projects *all, const char *id)
{
    const struct lum_project_work *w = all->works;
    bool of_version = w && w->order.verb == LUM_PROJECT_CREATE && w->order.version[0];
    return w && w->thread.runs && !w->has_state && !of_version && strcmp(source_of(w), id) == 0;
}

static enum lum_status keep_version(struct lum_project_work *w, const struct lum_project_source *source,
                                    const struct lum_log *log)
{
    struct lum_project_info version = {.changed_s = w->now_s};
    memcpy(version.name, w->order.version_name, sizeof version.name);
    enum lum_status st = lum_version_keep(&w->all->store, source, &version, log, &w->err);
    memcpy(w->order.version, version.id, sizeof version.id);
    return st;
}

static enum lum_status list_versions(struct lum_project_work *w, const struct lum_log *log)
{
    w->order.versions = lum_calloc(1, sizeof *w->order.versions);
    if (!w->order.versions)
        return lum_fail(&w->err, LUM_ERR_NOMEM, "", "no memory for the list of versions");
    return lum_version_list(&w->all->store, w->order.info.id, w->order.versions, log, &w->err);
}

static enum lum_status carry_out(struct lum_project_work *w)
{
    struct lum_project_store *store = &w->all->store;
    struct lum_project_info *info = &w->order.info;
    const struct lum_log *log = &w->all->config.director.log;
    struct lum_project_source source = {.state = w->has_state ? &w->state : NULL};
    strcpy(source.id, source_of(w));
    switch (w->order.verb) {
    case LUM_PROJECT_CREATE:
        memcpy(source.version, w->order.version, sizeof source.version);
        return source.id[0] ? lum_project_copy(store, &source, info, log, &w->err)
                            : lum_project_make(store, info, &w->err);
    case LUM_VERSION_KEEP:
        return keep_version(w, &source, log);
    case LUM_VERSION_LIST:
        return list_versions(w, log);
    case LUM_VERSION_REMOVE:
        return lum_version_remove(store, info->id, w->order.version, &w->err);
    case LUM_PROJECT_RENAME:
        return lum_project_write(store, info, &w->err);
    case LUM_PROJECT_DELETE:
        return lum_project_delete(store, info, w->now_s, &w->err);
    case LUM_PROJECT_RESTORE:
        return lum_project_restore(store, info, &w->err);
    case LUM_PROJECT_ERASE:
    case LUM_TRASH_EMPTY:
        return lum_project_erase(store, info, &w->err);
    }
    return LUM_ERR_INTERNAL;
}

/* A rename that was done, and whose folder the disk then did not take, is done: the list has to say so. */
static void look_again(struct lum_project_work *w)
{
    struct lum_error err;
    w->found = w->order.info;
    w->found_status =
        w->found.id[0] ? lum_project_find(&w->all->store, &w->found, &err) : LUM_ERR_INTERNAL; /* none was made */
}

static void *work_main(void *arg)
{
    struct lum_project_work *w = arg;
    const struct lum_director_config *c = &w->all->config.director;
    pthread_setname_np(pthread_self(), "lum-projects");
    w->status = carry_out(w);
    if (w->status)
        look_again(w);
    atomic_store(&w->thread.done, true);
    c->wake_net(c->wake_user);
    return NULL;
}

/* ---- turning ---- */

/* What was asked for cannot be had: no fault of the server. */
static void tell_failure(const struct lum_projects *all, const struct lum_project_work *w)
{
    bool asked = w->status == LUM_ERR_NOT_FOUND || w->status == LUM_ERR_CONFLICT || w->status == LUM_ERR_LIMIT;
    lum_log(&all->config.director.log, asked ? LUM_LOG_INFO : LUM_LOG_ERROR, "projects", "%s", w->err.text);
}

/* there: as info says; else it is nowhere. */
static void set_item(struct lum_projects *all, const struct lum_project_info *info, bool there)
{
    struct lum_project_item *item = lum_projects_item(all, info->id);
    if (there && !item) {
        (void)add_item(all, info); /* there is room: check_order */
    } else if (there) {
        memcpy(item->info.name, info->name, sizeof item->info.name);
        item->info.deleted_s = info->deleted_s;
        all->list_rev++;
    } else if (item) {
        remove_item(all, item);
    }
}

/* Disk and list agree again. */
static void settle(struct lum_projects *all, struct lum_project_work *w)
{
    enum lum_project_verb verb = w->order.verb;
    bool erases = verb == LUM_PROJECT_ERASE || verb == LUM_TRASH_EMPTY;
    struct lum_project_item *item = lum_projects_item(all, w->order.info.id);
    if (item && (erases || verb == LUM_PROJECT_DELETE || verb == LUM_PROJECT_RESTORE)) {
        item->going = false;
        item->emptied_by = 0;
    }
    if (w->status)
        tell_failure(all, w);
    if (verb >= LUM_VERSION_KEEP) /* of which there is no list */
        return;
    if (!w->status)
        set_item(all, &w->order.info, !erases);
    else if (!w->found_status || w->found_status == LUM_ERR_NOT_FOUND)
        set_item(all, &w->found, !w->found_status);
    w->order.n_erased += erases && !w->status;
    w->n_failed += erases && w->status;
    if (erases && !w->status)
        lum_log(&all->config.director.log, all->config.director.audit ? LUM_LOG_AUDIT : LUM_LOG_INFO, "projects",
                "%s is removed for ever", w->order.info.id);
}

static void take_first(struct lum_projects *all, struct lum_project_work *w)
{
    all->works = w->next;
    if (!all->works)
        all->works_tail = &all->works;
    w->next = NULL;
}

/* One of the trash is gone. Others' orders come before the next. */
static void let_others_before(struct lum_projects *all, struct lum_project_work *w)
{
    w->status = LUM_OK;
    take_first(all, w);
    *all->works_tail = w;
    all->works_tail = &w->next;
}

static void put_to_done(struct lum_projects *all, struct lum_project_work *w)
{
    lum_document_state_finish(&w->state);
    if (w->held)
        lum_project_leave(w->held, lum_clock_ns());
    take_first(all, w);
    all->n_works--;
    if (w->quiet) {
        lum_free(w);
        return;
    }
    *all->done_tail = w;
    all->done_tail = &w->next;
}

/* Another empties the trash since before, and is not done: who wants it empty hears of it when all is gone. */
static bool waits_for_another(const struct lum_project_work *w)
{
    const struct lum_project_work *other = w->order.verb == LUM_TRASH_EMPTY ? w->next : NULL;
    while (other && (other->order.verb != LUM_TRASH_EMPTY || other->number > w->number))
        other = other->next;
    return other != NULL;
}

/* The next that goes with this order. False: none, and the order is done. */
static bool next_of_trash(const struct lum_projects *all, struct lum_project_work *w)
{
    for (size_t i = 0; i < all->n_items; i++) {
        if (all->items[i].emptied_by != w->number)
            continue;
        w->order.info = all->items[i].info;
        return true;
    }
    const struct lum_error why = w->err;
    if (w->n_failed)
        w->status = lum_fail(&w->err, LUM_ERR_IO, "", "%u in the trash cannot be removed; of the last: %.150s",
                             w->n_failed, why.text);
    return false;
}

/* As the list is now: orders before it may have changed that. False: there is nothing to do any more. */
static bool bring_up_to_date(const struct lum_projects *all, struct lum_project_work *w)
{
    if (w->order.verb == LUM_TRASH_EMPTY)
        return next_of_trash(all, w);
    const struct lum_project_item *item = lum_projects_item(all, w->order.info.id);
    if (item)
        w->order.info.changed_s = item->info.changed_s;
    if (item && (w->quiet || w->order.verb != LUM_PROJECT_RENAME)) /* whose name is the order */
        w->order.info = item->info;
    return !w->quiet || (item && !item->info.deleted_s);
}

/* Thread: the director's. */
static void take_state(void *user, struct lum_document_state *state, bool ok)
{
    struct lum_project_work *w = user;
    const struct lum_director_config *c = &w->all->config.director;
    w->state = *state;
    w->has_state = ok;
    atomic_store(&w->given, true);
    c->wake_net(c->wake_user);
}

/* Asks the director. False: memory is short. */
static bool ask_for_state(struct lum_project_work *w, struct lum_project *p)
{
    struct lum_request *q = lum_request_create(&lum_request_copy_state);
    if (!q)
        return false;
    q->give = take_state;
    q->give_user = w;
    w->held = p;
    p->n_sessions++;
    (void)lum_director_post(p->director, q); /* never refused: no client can ask for it */
    return true;
}

/* What is deleted must be closed before, and what is copied must not come or go. */
static bool may_begin(struct lum_projects *all, struct lum_project_work *w)
{
    bool deletes = w->order.verb == LUM_PROJECT_DELETE;
    struct lum_project *p = lum_projects_find_open(all, deletes ? w->order.info.id : source_of(w));
    if (deletes && p && lum_project_is_idle(p))
        lum_project_close(p);
    if (deletes || !p || (w->order.verb == LUM_PROJECT_CREATE && w->order.version[0]))
        return !deletes || !p;
    if (p->stage == LUM_STAGE_OPEN && !w->held && !ask_for_state(w, p)) {
        w->status = lum_fail(&w->err, LUM_ERR_NOMEM, "", "no memory to copy the scene");
        return true;
    }
    if (!w->held || !atomic_load(&w->given))
        return false;
    if (!w->has_state)
        w->status = lum_fail(&w->err, LUM_ERR_NOMEM, "", "no memory to copy the scene");
    return true;
}

static void end_work(struct lum_projects *all, struct lum_project_work *w)
{
    lum_project_thread_end(&w->thread);
    settle(all, w);
    (w->order.verb == LUM_TRASH_EMPTY ? let_others_before : put_to_done)(all, w);
}

void lum_projects_turn_orders(struct lum_projects *all)
{
    struct lum_project_work *w;
    while ((w = all->works) != NULL) {
        if (w->thread.runs) {
            if (!atomic_load(&w->thread.done))
                return;
            end_work(all, w);
            continue;
        }
        if (waits_for_another(w)) { /* which is in the line, so this comes to an end */
            let_others_before(all, w);
            continue;
        }
        if (!bring_up_to_date(all, w)) {
            put_to_done(all, w);
            continue;
        }
        if (!may_begin(all, w))
            return;
        w->now_s = lum_projects_now_s(all);
        bool runs = !w->status && lum_project_thread_begin(&w->thread, work_main, w);
        if (runs)
            return;
        if (!w->status)
            w->status = lum_fail(&w->err, LUM_ERR_NOMEM, "", "a thread cannot be started");
        w->found_status = LUM_ERR_INTERNAL; /* nobody looked: nothing was done */
        end_work(all, w);
    }
}

bool lum_projects_next_done(struct lum_projects *all, struct lum_project_order *ret_order, enum lum_status *ret_status,
                            struct lum_error *err)
{
    struct lum_project_work *w = all->done;
    if (!w)
        return false;
    all->done = w->next;
    if (!all->done)
        all->done_tail = &all->done;
    *ret_order = w->order;
    *ret_status = w->status;
    *err = w->err;
    lum_free(w);
    return true;
}

/* At the end: what nobody has begun is left, but for what is ours, which is quick. */
void lum_projects_drop_orders(struct lum_projects *all)
{
    struct lum_project_order o;
    struct lum_error err;
    enum lum_status st;
    for (struct lum_project_work *w; (w = all->works) != NULL;) {
        if (w->thread.runs)
            lum_project_thread_end(&w->thread);
        else if (w->quiet && w->order.verb == LUM_PROJECT_RENAME && bring_up_to_date(all, w))
            (void)carry_out(w);
        put_to_done(all, w);
    }
    while (lum_projects_next_done(all, &o, &st, &err)) {
        free(o.rpc_id);
        lum_free(o.versions);
    }
}
