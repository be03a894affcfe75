#define _GNU_SOURCE /* pthread_setname_np */
#include "server/net/uploads.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/base/log.h"
#include "server/net/auth.h"

#define ROOM_BYTES (1u << 20)       /* for what the disk has not taken yet */
#define STOP_BYTES (ROOM_BYTES / 2) /* then nothing more is read; what the library holds already still fits */
#define S_NS 1000000000ll

enum state {
    FREE,
    ANNOUNCED,
    COMING, /* it has a thread */
};

struct lum_upload {
    struct lum_uploads *all;
    enum state state;
    struct lum_session_ref by;
    char user[LUM_LIMIT_ID_BYTES + 1];
    char ticket[LUM_UPLOAD_TICKET_BYTES + 1];
    int64_t until_ns; /* to begin, then to end */
    struct lum_upload_file *files;
    size_t n_files;
    uint64_t n_bytes;
    void *connection; /* NULL: none, or gone */
    bool ended;       /* all came; of the connection */
    bool waits;       /* it is not read from */
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t news;
    /* under the lock */
    uint8_t *room[2]; /* one is filled, one is written */
    size_t n_room;    /* bytes in room[0] */
    bool whole, aborted;
    /* of its thread, until done */
    _Atomic bool done;
    enum lum_status status;
    struct lum_error error;
    lum_upload_id id;
    bool known;
};

struct lum_uploads {
    struct lum_uploads_config config;
    struct lum_upload_store store;
    uint64_t n_bytes; /* kept, and announced */
    struct lum_upload list[LUM_LIMIT_UPLOADS_AT_ONCE];
};

enum lum_status lum_uploads_create(const struct lum_uploads_config *config, struct lum_uploads **ret_uploads,
                                   struct lum_error *err)
{
    struct lum_uploads *all = lum_calloc(1, sizeof *all);
    if (!all)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for uploads");
    all->config = *config;
    enum lum_status st = lum_upload_store_open(config->root, config->disk, &all->store, err);
    if (st) {
        lum_free(all);
        return st;
    }
    all->n_bytes = all->store.n_bytes;
    for (unsigned i = 0; i < LUM_LIMIT_UPLOADS_AT_ONCE; i++) {
        all->list[i].all = all;
        pthread_mutex_init(&all->list[i].lock, NULL); /* on Linux neither can fail without attributes */
        pthread_cond_init(&all->list[i].news, NULL);
    }
    *ret_uploads = all;
    return LUM_OK;
}

/* ---- the thread of one ---- */

/* The next bytes, or how it ends. 0 bytes: it does. */
static size_t take(struct lum_upload *u, const uint8_t **ret_bytes, bool *ret_aborted)
{
    pthread_mutex_lock(&u->lock);
    while (u->n_room == 0 && !u->whole && !u->aborted)
        pthread_cond_wait(&u->news, &u->lock);
    size_t n = u->aborted ? 0 : u->n_room;
    uint8_t *filled = u->room[0];
    u->room[0] = u->room[1];
    u->room[1] = filled;
    u->n_room = 0;
    *ret_bytes = filled;
    *ret_aborted = u->aborted;
    pthread_mutex_unlock(&u->lock);
    if (n >= STOP_BYTES)
        u->all->config.wake(u->all->config.wake_user);
    return n;
}

static enum lum_status write_all(struct lum_upload *u, struct lum_error *err)
{
    struct lum_upload_writer *w = NULL;
    const uint8_t *bytes;
    bool aborted = false;
    enum lum_status st = lum_upload_writer_create(&u->all->store, u->files, u->n_files, &w, err);
    for (size_t n; (n = take(u, &bytes, &aborted)) > 0;) /* to its end, also where it failed: then comes the answer */
        if (!st)
            st = lum_upload_write(w, bytes, n, err);
    if (!st && aborted)
        st = lum_fail(err, LUM_ERR_INVALID, "", "it was cut off");
    if (!st)
        st = lum_upload_finish(w, u->id, &u->known, err);
    lum_upload_writer_destroy(w);
    return st;
}

static void *upload_main(void *arg)
{
    struct lum_upload *u = arg;
    pthread_setname_np(pthread_self(), "lum-upload");
    u->status = write_all(u, &u->error);
    atomic_store_explicit(&u->done, true, memory_order_release);
    u->all->config.wake(u->all->config.wake_user);
    return NULL;
}

/* ---- the table ---- */

static void make_free(struct lum_upload *u)
{
    bool kept = u->state == COMING && !u->status && !u->known;
    u->all->n_bytes -= kept ? 0 : u->n_bytes;
    for (int i = 0; i < 2; i++) {
        free(u->room[i]);
        u->room[i] = NULL;
    }
    free(u->files);
    u->files = NULL;
    u->state = FREE;
}

static bool is_done(const struct lum_upload *u)
{
    return atomic_load_explicit(&u->done, memory_order_acquire);
}

/* Frees what nobody waits for any more. */
static void tidy(struct lum_uploads *all)
{
    int64_t now_ns = lum_clock_ns();
    for (unsigned i = 0; i < LUM_LIMIT_UPLOADS_AT_ONCE; i++) {
        struct lum_upload *u = &all->list[i];
        bool over = u->state == COMING && !u->connection && is_done(u);
        if (over)
            pthread_join(u->thread, NULL);
        if (over || (u->state == ANNOUNCED && now_ns >= u->until_ns))
            make_free(u);
    }
}

static void tell(struct lum_upload *u, bool whole, bool aborted)
{
    pthread_mutex_lock(&u->lock);
    u->whole = u->whole || whole;
    u->aborted = u->aborted || aborted;
    pthread_cond_signal(&u->news);
    pthread_mutex_unlock(&u->lock);
}

void lum_uploads_destroy(struct lum_uploads *all)
{
    if (!all)
        return;
    for (unsigned i = 0; i < LUM_LIMIT_UPLOADS_AT_ONCE; i++) {
        struct lum_upload *u = &all->list[i];
        if (u->state == COMING) {
            tell(u, false, true);
            pthread_join(u->thread, NULL);
        }
        if (u->state != FREE)
            make_free(u);
        pthread_cond_destroy(&u->news);
        pthread_mutex_destroy(&u->lock);
    }
    lum_upload_store_close(&all->store);
    lum_free(all);
}

/* ---- the session ---- */

static struct lum_upload *find_place(struct lum_uploads *all, struct lum_session_ref by, struct lum_proto_error *err)
{
    struct lum_upload *found = NULL;
    for (unsigned i = 0; i < LUM_LIMIT_UPLOADS_AT_ONCE; i++) {
        struct lum_upload *u = &all->list[i];
        if (u->state == FREE) {
            found = u;
        } else if (lum_session_same(u->by, by)) {
            lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "", "files of this session are on their way already");
            return NULL;
        }
    }
    if (!found)
        lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "", "%u uploads are on their way; try again",
                       LUM_LIMIT_UPLOADS_AT_ONCE);
    return found;
}

bool lum_uploads_announce(struct lum_uploads *all, struct lum_session_ref by, const char *user,
                          struct lum_upload_file *files, size_t n_files, char ret_ticket[LUM_UPLOAD_TICKET_BYTES + 1],
                          struct lum_proto_error *err)
{
    struct lum_auth random; /* a ticket is as hard to guess as a token */
    uint64_t n_bytes = 0;
    tidy(all);
    for (size_t i = 0; i < n_files; i++)
        n_bytes += files[i].n_bytes;
    struct lum_upload *u = find_place(all, by, err);
    if (!u)
        return false;
    if (all->n_bytes + n_bytes > all->config.max_bytes)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "files",
                              "this server keeps %llu MiB of uploads, and has %.1f MiB already or on their way",
                              (unsigned long long)(all->config.max_bytes >> 20), (double)all->n_bytes / 1048576.0);
    if (lum_auth_random(&random, NULL))
        return lum_proto_fail(err, LUM_PROTO_INTERNAL, "internal", "", "no random numbers for a ticket");
    u->state = ANNOUNCED;
    u->by = by;
    snprintf(u->user, sizeof u->user, "%s", user);
    snprintf(u->ticket, sizeof u->ticket, "%.*s", LUM_UPLOAD_TICKET_BYTES, random.token);
    u->until_ns = lum_clock_ns() + LUM_LIMIT_UPLOAD_BEGIN_S * S_NS;
    u->files = files;
    u->n_files = n_files;
    u->n_bytes = n_bytes;
    u->connection = NULL;
    u->ended = u->waits = u->whole = u->aborted = u->known = false;
    u->n_room = 0;
    u->status = LUM_OK;
    atomic_store(&u->done, false);
    all->n_bytes += n_bytes;
    memcpy(ret_ticket, u->ticket, sizeof u->ticket);
    return true;
}

void lum_uploads_drop(struct lum_uploads *all, struct lum_session_ref by)
{
    for (unsigned i = 0; all && i < LUM_LIMIT_UPLOADS_AT_ONCE; i++) {
        struct lum_upload *u = &all->list[i];
        if (u->state == FREE || !lum_session_same(u->by, by))
            continue;
        if (u->state == ANNOUNCED)
            make_free(u);
        else
            tell(u, false, true);
    }
}

/* ---- the PUT ---- */

static bool is_ticket(const struct lum_upload *u, const char *given)
{
    volatile unsigned char differs = 0; /* volatile: no early exit by the optimiser */
    if (u->state != ANNOUNCED || strlen(given) != LUM_UPLOAD_TICKET_BYTES)
        return false;
    for (size_t i = 0; i < LUM_UPLOAD_TICKET_BYTES; i++)
        differs = (unsigned char)(differs | (u->ticket[i] ^ given[i]));
    return differs == 0;
}

/* False: memory or threads are short. */
static bool start(struct lum_upload *u)
{
    for (int i = 0; i < 2; i++)
        u->room[i] = malloc(ROOM_BYTES);
    return u->room[0] && u->room[1] && pthread_create(&u->thread, NULL, upload_main, u) == 0;
}

struct lum_upload *lum_uploads_begin(struct lum_uploads *all, const char *ticket, int64_t n_bytes, void *connection,
                                     int *ret_status)
{
    struct lum_upload *u = NULL;
    tidy(all);
    for (unsigned i = 0; i < LUM_LIMIT_UPLOADS_AT_ONCE; i++)
        u = is_ticket(&all->list[i], ticket) ? &all->list[i] : u;
    *ret_status = !u ? 404 : n_bytes < 0 ? 411 : (uint64_t)n_bytes != u->n_bytes ? 400 : 503;
    if (*ret_status != 503)
        return NULL;
    if (!start(u)) {
        make_free(u);
        return NULL;
    }
    u->state = COMING;
    u->connection = connection;
    u->until_ns = lum_clock_ns() + LUM_LIMIT_UPLOAD_END_S * S_NS;
    return u;
}

enum lum_upload_go lum_upload_add(struct lum_upload *u, const void *bytes, size_t n)
{
    pthread_mutex_lock(&u->lock);
    bool fits = n <= ROOM_BYTES - u->n_room && lum_clock_ns() < u->until_ns && !u->aborted;
    if (fits) {
        memcpy(u->room[0] + u->n_room, bytes, n);
        u->n_room += n;
        u->waits = u->waits || u->n_room >= STOP_BYTES;
        pthread_cond_signal(&u->news);
    }
    pthread_mutex_unlock(&u->lock);
    return !fits ? LUM_UPLOAD_HANG_UP : u->waits ? LUM_UPLOAD_WAIT : LUM_UPLOAD_GO_ON;
}

void lum_upload_end(struct lum_upload *u)
{
    u->ended = true;
    tell(u, true, false);
}

static void log_end(const struct lum_upload *u)
{
    const struct lum_uploads_config *config = &u->all->config;
    if (u->status)
        lum_log(&config->log, LUM_LOG_INFO, "upload", "%s: %zu files, %llu bytes: %s", u->user, u->n_files,
                (unsigned long long)u->n_bytes, u->error.text);
    else
        lum_log(&config->log, config->audit ? LUM_LOG_AUDIT : LUM_LOG_INFO, "upload",
                "%s sent %zu files, %llu bytes: " LUM_UPLOAD_FOLDER "/%s%s, %.100s", u->user, u->n_files,
                (unsigned long long)u->n_bytes, u->id, u->known ? " (known)" : "", u->files[0].name);
}

int lum_upload_answer(struct lum_upload *u, struct cJSON **ret_json)
{
    char folder[sizeof LUM_UPLOAD_FOLDER + 1 + LUM_UPLOAD_ID_BYTES];
    int status = u->status == LUM_OK ? 200 : u->status == LUM_ERR_IO ? 507 : 500;
    snprintf(folder, sizeof folder, LUM_UPLOAD_FOLDER "/%s", u->id);
    cJSON *o = cJSON_CreateObject();
    if (!lum_json_add_string(o, u->status ? "error" : "folder", u->status ? u->error.text : folder)) {
        cJSON_Delete(o);
        o = NULL;
    }
    *ret_json = o;
    log_end(u);
    u->connection = NULL;
    tidy(u->all);
    return status;
}

void lum_upload_release(struct lum_upload *u)
{
    if (!u)
        return;
    u->connection = NULL;
    tell(u, false, true);
    tidy(u->all);
}

struct lum_upload *lum_uploads_at(struct lum_uploads *all, unsigned i)
{
    if (all && i == 0)
        tidy(all);
    return all && all->list[i].state == COMING && all->list[i].connection ? &all->list[i] : NULL;
}

void *lum_upload_connection(const struct lum_upload *u)
{
    return u->connection;
}

bool lum_upload_is_done(const struct lum_upload *u)
{
    return u->ended && is_done(u);
}

bool lum_upload_may_go_on(struct lum_upload *u)
{
    pthread_mutex_lock(&u->lock);
    bool may = u->waits && u->n_room < STOP_BYTES;
    pthread_mutex_unlock(&u->lock);
    u->waits = u->waits && !may;
    return may;
}
