#define _GNU_SOURCE /* pthread_setname_np */
#include "server/net/projects.h"

#include <malloc.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "server/base/log.h"
#include "server/net/projects_internal.h"

/* One that was opened for somebody who waits is not closed for another before she is in; if she still waits. */
#define FRESH_NS 5000000000ll

/* ---- threads ---- */

bool lum_project_thread_begin(struct lum_project_thread *t, void *(*run)(void *), void *arg)
{
    atomic_store(&t->done, false);
    t->runs = pthread_create(&t->thread, NULL, run, arg) == 0;
    return t->runs;
}

void lum_project_thread_end(struct lum_project_thread *t)
{
    if (t->runs)
        pthread_join(t->thread, NULL);
    t->runs = false;
}

static void is_done(struct lum_projects *all, struct lum_project_thread *t)
{
    const struct lum_director_config *c = &all->config.director;
    atomic_store(&t->done, true);
    c->wake_net(c->wake_user);
}

/* ---- opening: the thread ---- */

static void tell_alive(void *project)
{
    atomic_store_explicit(&((struct lum_project *)project)->alive, true, memory_order_relaxed);
}

/* As the log of the daemon, with the project before the text. */
static void write_log(void *project, int level, const char *component, const char *text)
{
    const struct lum_project *p = project;
    const struct lum_log *log = &p->all->config.director.log;
    char named[600];
    snprintf(named, sizeof named, "[%s] %s", p->info.id, text);
    if (log->write)
        log->write(log->user, level, component, named);
}

static void make_uploads(struct lum_project *p)
{
    struct lum_error err;
    struct lum_uploads_config config = p->all->config.uploads;
    config.root = p->path;
    config.log = (struct lum_log){write_log, p};
    if (config.max_bytes && lum_uploads_create(&config, &p->uploads, &err))
        lum_log(&config.log, LUM_LOG_WARNING, "main", "no file can be sent: %s", err.text);
}

static void *open_main(void *arg)
{
    struct lum_project *p = arg;
    struct lum_director_config config = p->all->config.director;
    pthread_setname_np(pthread_self(), "lum-opening");
    config.scene = p->info.scene[0] ? p->info.scene : NULL;
    config.state_dir = p->path;
    config.uploads_dir = p->all->config.uploads.max_bytes ? p->path : NULL;
    config.log = (struct lum_log){write_log, p};
    config.alive = config.alive ? tell_alive : NULL;
    config.alive_user = p;
    p->status = lum_project_check(&p->all->store, p->info.id, &p->err);
    if (!p->status)
        p->status = lum_director_create(&config, &p->director, &p->err);
    if (!p->status)
        make_uploads(p);
    is_done(p->all, &p->thread);
    return NULL;
}

/* ---- closing ---- */

/* What was freed goes back to the system, and not to the next that is opened. Sanitizers have an allocator of their
 * own; with them glibc's has never begun, and two threads that are its first callers at once crash in it. */
static void give_memory_back(void)
{
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    malloc_trim(0);
#endif
}

static void *close_main(void *arg)
{
    struct lum_project *p = arg;
    pthread_setname_np(pthread_self(), "lum-closing");
    lum_uploads_destroy(p->uploads);
    lum_director_destroy(p->director);
    give_memory_back();
    is_done(p->all, &p->thread);
    return NULL;
}

static void add_counters(struct lum_director_metrics *to, const struct lum_director_metrics *m)
{
    uint64_t *const sums[] = {&to->passes,
                              &to->frames_published,
                              &to->tiles_encoded,
                              &to->tile_bytes,
                              &to->rays,
                              &to->edits,
                              &to->edits_refused,
                              &to->imports,
                              &to->nonfinite,
                              &to->imports_failed,
                              &to->journal.n_entries,
                              &to->journal.n_syncs,
                              &to->journal.n_snapshots,
                              &to->journal.n_failures};
    const uint64_t more[] = {m->passes,
                             m->frames_published,
                             m->tiles_encoded,
                             m->tile_bytes,
                             m->rays,
                             m->edits,
                             m->edits_refused,
                             m->imports,
                             m->nonfinite,
                             m->imports_failed,
                             m->journal.n_entries,
                             m->journal.n_syncs,
                             m->journal.n_snapshots,
                             m->journal.n_failures};
    for (size_t i = 0; i < LUM_ARRAY_LEN(sums); i++)
        *sums[i] += more[i];
}

bool lum_project_is_idle(const struct lum_project *p)
{
    bool idle = p->stage == LUM_STAGE_OPEN && p->n_sessions == 0;
    for (unsigned i = 0; i < LUM_LIMIT_UPLOADS_AT_ONCE && idle; i++)
        idle = !lum_uploads_at(p->uploads, i);
    return idle;
}

void lum_project_close(struct lum_project *p)
{
    struct lum_projects *all = p->all;
    struct lum_director_metrics m;
    lum_director_metrics(p->director, &m);
    struct lum_project_item *item = lum_projects_item(all, p->info.id);
    if (item && lum_director_scene_rev(p->director) != p->opened_rev)
        lum_projects_write_item(all, item);
    lum_changes_kept_drop(&p->changes);
    p->opening = 0;
    p->stage = LUM_STAGE_CLOSING;
    if (!lum_project_thread_begin(&p->thread, close_main, p))
        close_main(p); /* here, then: others wait for it */
    add_counters(&all->gone.sum, &m);
    all->gone.closed++;
    lum_log(&all->config.director.log, LUM_LOG_INFO, "projects", "%s is closed", p->info.id);
}

/* ---- memory ---- */

static uint64_t resident_bytes(void)
{
    unsigned long long all, resident = 0;
    FILE *f = fopen("/proc/self/statm", "re");
    if (f && fscanf(f, "%llu %llu", &all, &resident) != 2)
        resident = 0;
    if (f)
        fclose(f);
    return resident * (uint64_t)sysconf(_SC_PAGESIZE);
}

static bool memory_is_short(const struct lum_projects *all)
{
    uint64_t (*now)(void) = all->config.memory_now ? all->config.memory_now : resident_bytes;
    return all->config.max_bytes && now() > all->config.max_bytes;
}

/* of those that may be closed now */
static struct lum_project *longest_unused(struct lum_projects *all, int64_t now_ns)
{
    struct lum_project *found = NULL;
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++) {
        struct lum_project *p = &all->list[i];
        bool fresh = !p->entered && now_ns - p->unused_ns < FRESH_NS;
        if (lum_project_is_idle(p) && !fresh && (!found || p->unused_ns < found->unused_ns))
            found = p;
    }
    return found;
}

static unsigned n_idle(const struct lum_projects *all)
{
    unsigned n = 0;
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++)
        n += lum_project_is_idle(&all->list[i]);
    return n;
}

static unsigned count_in(const struct lum_projects *all, enum lum_project_stage stage)
{
    unsigned n = 0;
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++)
        n += all->list[i].stage == stage;
    return n;
}

/* ---- the door ---- */

static enum lum_project_door refuse(struct lum_projects *all, struct lum_proto_error *err, const char *what)
{
    all->gone.refused++;
    lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "project", "%s", what);
    return LUM_PROJECT_NO;
}

/* Is there room for one more? Closes the longest unused for it. */
static enum lum_project_door make_room(struct lum_projects *all, int64_t now_ns, struct lum_proto_error *err)
{
    unsigned n_open = count_in(all, LUM_STAGE_OPEN),
             n_under_way =
                 count_in(all, LUM_STAGE_OPENING) + count_in(all, LUM_STAGE_FAILED) + count_in(all, LUM_STAGE_CLOSING);
    bool full = n_open + n_under_way >= all->config.max_open, short_of_memory = memory_is_short(all);
    if (!full && !short_of_memory)
        return LUM_PROJECT_IN;
    struct lum_project *unused = longest_unused(all, now_ns);
    if (unused) {
        lum_project_close(unused);
        return LUM_PROJECT_SOON;
    }
    if (n_under_way || n_idle(all) > 0)
        return LUM_PROJECT_SOON;
    if (full)
        return refuse(all, err,
                      "as many projects are open as this server may have, with somebody in each: try again when one "
                      "of them is left, or have --open-projects raised");
    return n_open == 0 ? LUM_PROJECT_IN
                       : refuse(all, err,
                                "the open projects take all memory that this server may have: try again when one of "
                                "them is left, or have --projects-mib raised");
}

static enum lum_project_door begin_opening(struct lum_projects *all, const struct lum_project_info *info,
                                           int64_t now_ns, struct lum_proto_error *err)
{
    enum lum_project_door door = make_room(all, now_ns, err);
    if (door != LUM_PROJECT_IN)
        return door;
    struct lum_project *p = all->list;
    while (p->stage != LUM_STAGE_FREE) /* there is one: config.max_open */
        p++;
    *p = (struct lum_project){.all = all, .stage = LUM_STAGE_OPENING, .info = *info};
    all->list_rev++;
    if (!lum_project_path(&all->store, info->id, p->path) || !lum_project_thread_begin(&p->thread, open_main, p)) {
        p->stage = LUM_STAGE_FREE; /* nobody has seen it */
        return refuse(all, err, "there is no memory to open the project");
    }
    return LUM_PROJECT_SOON;
}

static enum lum_project_door refuse_failed(const struct lum_project *p, struct lum_proto_error *err)
{
    lum_proto_fail(err, LUM_PROTO_APPLICATION, p->status == LUM_ERR_CONFLICT ? "conflict" : "io", "project",
                   "the project cannot be opened: %.200s", p->err.text);
    return LUM_PROJECT_NO;
}

static bool check_id(const struct lum_projects *all, const char *id, const struct lum_project_item **ret_item,
                     struct lum_proto_error *err)
{
    if (!all->many)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "unsupported", "project",
                              "this server has one scene, and no projects");
    const struct lum_project_item *item = lum_projects_item(all, id);
    if (!item || item->info.deleted_s || item->going)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "project", "%s",
                              item ? "this project is in the trash: project.restore brings it back"
                                   : "there is no such project: project.list tells which there are");
    *ret_item = item;
    return true;
}

enum lum_project_door lum_projects_enter(struct lum_projects *all, const char *id, int64_t now_ns,
                                         struct lum_project **ret_project, struct lum_proto_error *err)
{
    const struct lum_project_item *item = NULL;
    struct lum_project *p = all->list;
    if (all->many || id[0]) {
        if (!check_id(all, id, &item, err))
            return LUM_PROJECT_NO;
        p = lum_projects_find_open(all, id);
    }
    if (!p)
        return lum_projects_is_read(all, id) ? LUM_PROJECT_SOON : begin_opening(all, &item->info, now_ns, err);
    if (p->stage == LUM_STAGE_FAILED)
        return refuse_failed(p, err);
    if (p->stage != LUM_STAGE_OPEN)
        return LUM_PROJECT_SOON;
    p->n_sessions++;
    p->entered = true;
    *ret_project = p;
    return LUM_PROJECT_IN;
}

const char *lum_projects_stage(const struct lum_projects *all, const char *id)
{
    const struct lum_project *p = lum_projects_find_open(all, id);
    return p && p->stage == LUM_STAGE_OPENING ? "opening" : "waiting";
}

void lum_project_leave(struct lum_project *p, int64_t now_ns)
{
    if (p && --p->n_sessions == 0)
        p->unused_ns = now_ns;
}

/* ---- turning ---- */

static void is_open(struct lum_project *p, int64_t now_ns)
{
    p->stage = p->status ? LUM_STAGE_FAILED : LUM_STAGE_OPEN;
    if (p->status) {
        lum_log(&p->all->config.director.log, LUM_LOG_ERROR, "projects", "%s cannot be opened: %s", p->info.id,
                p->err.text);
        return;
    }
    p->unused_ns = now_ns;
    p->opening = ++p->all->gone.opened;
    p->opened_rev = p->changes.before = lum_director_scene_rev(p->director);
    lum_log(&p->all->config.director.log, LUM_LOG_INFO, "projects", "%s is open", p->info.id);
}

static void is_gone(struct lum_project *p)
{
    p->stage = LUM_STAGE_FREE;
    p->all->list_rev++;
}

static void turn_one(struct lum_project *p, int64_t now_ns)
{
    bool done = p->thread.runs && atomic_load(&p->thread.done);
    if (p->stage == LUM_STAGE_FAILED) /* those who wait have been told in between */
        is_gone(p);
    else if (p->stage == LUM_STAGE_OPENING && done) {
        lum_project_thread_end(&p->thread);
        is_open(p, now_ns);
    } else if (p->stage == LUM_STAGE_CLOSING && (done || !p->thread.runs)) {
        lum_project_thread_end(&p->thread);
        is_gone(p);
    } else if (lum_project_is_idle(p) && now_ns - p->unused_ns >= p->all->config.unused_ns) {
        lum_project_close(p);
    }
}

void lum_projects_turn(struct lum_projects *all, int64_t now_ns)
{
    if (!all->many)
        return;
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++)
        turn_one(&all->list[i], now_ns);
    struct lum_project *unused = longest_unused(all, now_ns);
    if (unused && memory_is_short(all) && !count_in(all, LUM_STAGE_CLOSING))
        lum_project_close(unused);
    lum_projects_age_trash(all, now_ns);
    lum_projects_turn_orders(all);
}

bool lum_projects_alive(const struct lum_projects *all)
{
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++) {
        const struct lum_project *p = lum_projects_at(all, i);
        if (p && !lum_director_alive(p->director))
            return false;
    }
    return true;
}

bool lum_projects_take_alive(struct lum_projects *all)
{
    bool alive = true;
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++)
        alive = (!lum_projects_at(all, i) || atomic_load(&all->list[i].alive)) && alive;
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN && alive; i++)
        atomic_store(&all->list[i].alive, false);
    return alive;
}

/* ---- life ---- */

enum lum_status lum_projects_create(const struct lum_projects_config *config, struct lum_projects **ret_projects,
                                    struct lum_error *err)
{
    struct lum_projects *all = lum_calloc(1, sizeof *all);
    if (!all)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the projects");
    all->config = *config;
    all->many = true;
    all->works_tail = &all->works;
    all->done_tail = &all->done;
    enum lum_status st = lum_project_store_open(config->path, config->disk ? config->disk : &lum_disk_real,
                                                lum_projects_now_s(all), &all->store, err);
    if (!st)
        st = lum_projects_read_list(all, err);
    if (st)
        (void)!lum_projects_destroy(all);
    else
        *ret_projects = all;
    return st;
}

enum lum_status lum_projects_of_one(struct lum_director *director, struct lum_uploads *uploads,
                                    struct lum_projects **ret_projects, struct lum_error *err)
{
    struct lum_projects *all = lum_calloc(1, sizeof *all);
    if (!all)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the scene");
    struct lum_project *p = all->list;
    all->store = (struct lum_project_store){.dir.fd = -1, .lock_fd = -1};
    p->all = all;
    p->stage = LUM_STAGE_OPEN;
    p->director = director;
    p->uploads = uploads;
    p->opening = 1;
    p->changes.before = lum_director_scene_rev(director);
    *ret_projects = all;
    return LUM_OK;
}

/* All at once: each writes what waits in its journal. */
static bool close_all(struct lum_projects *all)
{
    bool ended = true;
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++)
        if (all->list[i].stage == LUM_STAGE_OPEN)
            lum_project_close(&all->list[i]);
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++) {
        struct lum_project *p = &all->list[i];
        bool loads = p->stage == LUM_STAGE_OPENING && !atomic_load(&p->thread.done);
        ended = ended && !loads;
        if (loads)
            continue;
        lum_project_thread_end(&p->thread);
        if (p->stage == LUM_STAGE_OPENING && !p->status)
            close_main(p);
    }
    return ended;
}

bool lum_projects_destroy(struct lum_projects *all)
{
    bool ended = true;
    if (!all)
        return true;
    if (all->many) {
        ended = close_all(all);
        lum_projects_drop_orders(all);
        lum_project_store_close(&all->store);
    }
    if (!ended)
        return false;
    lum_changes_kept_drop(&all->list[0].changes);
    lum_free(all->items);
    lum_free(all);
    return true;
}

/* ---- what is open ---- */

bool lum_projects_are_many(const struct lum_projects *all)
{
    return all->many;
}

struct lum_project *lum_projects_at(const struct lum_projects *all, unsigned i)
{
    const struct lum_project *p = &all->list[i];
    return p->stage == LUM_STAGE_OPEN ? (struct lum_project *)p : NULL;
}

struct lum_project *lum_projects_find_open(const struct lum_projects *all, const char *id)
{
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++)
        if (all->list[i].stage != LUM_STAGE_FREE && strcmp(all->list[i].info.id, id) == 0)
            return (struct lum_project *)&all->list[i];
    return NULL;
}

const struct lum_project_info *lum_project_info(const struct lum_project *p)
{
    const struct lum_project_item *item = p->all->many ? lum_projects_item(p->all, p->info.id) : NULL;
    return item ? &item->info : &p->info;
}

struct lum_director *lum_project_director(const struct lum_project *p)
{
    return p->director;
}

struct lum_uploads *lum_project_uploads(const struct lum_project *p)
{
    return p->uploads;
}

uint64_t lum_project_starts(const struct lum_project *p)
{
    return lum_director_starts(p->director);
}

struct lum_changes_kept *lum_project_changes(struct lum_project *p)
{
    return &p->changes;
}

void lum_project_note_change(struct lum_project *p, uint64_t scene_rev, struct lum_text *text)
{
    struct lum_project_item *item = p->all->many ? lum_projects_item(p->all, p->info.id) : NULL;
    lum_changes_kept_add(&p->changes, scene_rev, text);
    int64_t now_s = item ? lum_projects_now_s(p->all) : 0;
    if (!item || item->info.changed_s == now_s)
        return;
    item->info.changed_s = now_s;
    p->all->list_rev++;
}

uint64_t lum_project_opening(const struct lum_project *p)
{
    return p->opening;
}

void lum_projects_metrics(const struct lum_projects *all, struct lum_projects_metrics *ret_metrics)
{
    *ret_metrics = all->gone;
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++) {
        struct lum_director_metrics m;
        const struct lum_project *p = lum_projects_at(all, i);
        if (!p)
            continue;
        struct lum_director_metrics *sum = &ret_metrics->sum;
        lum_director_metrics(p->director, &m);
        add_counters(sum, &m);
        sum->views += m.views;
        sum->triangles += m.triangles;
        sum->lights += m.lights;
        sum->last_pass_ms = m.last_pass_ms > sum->last_pass_ms ? m.last_pass_ms : sum->last_pass_ms;
        sum->journal.read_only |= m.journal.read_only;
        sum->journal.saved_rev = m.journal.saved_rev; /* of one scene; of several each has its own line */
        ret_metrics->n_open++;
    }
}
