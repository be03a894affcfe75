#define _GNU_SOURCE /* pthread_setname_np */
#include "server/journal/journal.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "server/base/log.h"
#include "server/journal/recover.h"

#define SYNC_EVERY_NS 1000000000ll  /* LUM_DURABILITY_INTERVAL */
#define RETRY_AFTER_NS 1000000000ll /* is there room again? */
#define FOREVER INT64_MAX

const char *const lum_durability_names[2] = {"commit", "interval"};

struct lum_journal {
    /* immutable */
    struct lum_journal_config config;
    struct lum_dir dir, content;
    int lock_fd;
    bool recovered;
    uint64_t starts;
    pthread_t thread;
    bool has_thread;

    pthread_mutex_t lock;
    pthread_cond_t bell; /* an entry, a state, stop; monotonic clock */
    /* guarded by lock */
    struct lum_entry *queue, **queue_tail;
    size_t n_queue, queue_bytes;
    uint64_t seq; /* of the newest entry */
    bool stop, read_only, failed, wants_state;
    bool has_state;                  /* given, and not begun */
    bool busy;                       /* given, and not on disk: no other is taken */
    struct lum_document_state state; /* after entry state_seq */
    uint64_t state_seq, snapshot_bytes;
    int64_t retry_due_ns;       /* no snapshot before */
    struct lum_kept_list fresh; /* content that was stored since the last snapshot began */
    struct lum_journal_status status;

    _Atomic uint64_t acknowledged;

    /* the journal's thread; before it starts, and after it ends, whoever calls */
    struct lum_frame_writer file;
    uint64_t file_seq, file_rev; /* of the newest entry in it */
    uint64_t synced_bytes;       /* of it */
    int64_t sync_due_ns;
    struct lum_snapshot_writer *snapshot; /* being written; NULL: none */
    uint64_t snapshot_seq;
    struct lum_kept_list kept;   /* content that the last snapshot and the edits since need */
    struct lum_kept_list recent; /* of it, what was stored between the last two snapshots */
    struct lum_recovery recovery;
};

/* ---- files ---- */

/* A new journal for the entries after seq. The old one is closed. */
static enum lum_status new_file(struct lum_journal *j, uint64_t seq, struct lum_error *err)
{
    struct lum_frame_writer file;
    char name[LUM_JOURNAL_NAME_BYTES];
    lum_state_name(name, "journal", seq);
    enum lum_status st = lum_frame_create(&file, &j->dir, "journal.part", LUM_FILE_JOURNAL, seq, err);
    if (st)
        return st;
    st = lum_frame_sync(&file, err);
    if (!st)
        st = lum_dir_rename(&j->dir, "journal.part", name, err);
    if (st) {
        lum_frame_close(&file);
        return st;
    }
    lum_frame_close(&j->file);
    j->file = file;
    snprintf(j->file.name, sizeof j->file.name, "%s", name);
    j->file_seq = seq;
    j->synced_bytes = j->file.n_bytes;
    return LUM_OK;
}

struct cleaning {
    struct lum_journal *j;
    const struct lum_kept_list *lists[3];
};

static void remove_unused_content(void *user, const char *name)
{
    struct cleaning *c = user;
    for (size_t i = 0; i < LUM_ARRAY_LEN(c->lists); i++)
        for (size_t k = 0; k < c->lists[i]->n; k++)
            if (strcmp(c->lists[i]->kept[k].sha, name) == 0)
                return;
    if (lum_sha_is(name))
        lum_dir_remove(&c->j->content, name);
}

/* Files before the second newest snapshot. */
static void remove_old_files(struct lum_journal *j, const char *prefix, uint64_t before)
{
    struct lum_numbers_found list;
    struct lum_error err;
    if (lum_state_list(&j->dir, prefix, &list, &err))
        return;
    for (size_t i = 0; i < list.n && list.numbers[i] < before; i++) {
        char name[LUM_JOURNAL_NAME_BYTES];
        lum_state_name(name, prefix, list.numbers[i]);
        lum_dir_remove(&j->dir, name);
    }
    free(list.numbers);
}

/* After a snapshot: new_kept is what it needs, j->kept what the one before and the edits since need. */
static void clean(struct lum_journal *j, const struct lum_kept_list *new_kept)
{
    struct lum_numbers_found list;
    struct lum_error err;
    if (!lum_state_list(&j->dir, "snapshot", &list, &err)) {
        uint64_t before = list.n >= 2 ? list.numbers[list.n - 2] : 0;
        free(list.numbers);
        remove_old_files(j, "snapshot", before);
        remove_old_files(j, "journal", before);
    }
    struct cleaning c = {j, {new_kept, &j->kept, &j->fresh}};
    pthread_mutex_lock(&j->lock); /* nobody stores meanwhile what is being removed */
    (void)!lum_dir_each(&j->content, remove_unused_content, &c, &err);
    pthread_mutex_unlock(&j->lock);
}

/* ---- snapshots ---- */

/* Entries up to state_seq are in files already. While edits are accepted those after it go into a new journal from now
 * on, whether this snapshot comes to be or not. */
static enum lum_status begin_snapshot(struct lum_journal *j, struct lum_error *err)
{
    pthread_mutex_lock(&j->lock);
    struct lum_document_state state = j->state;
    bool read_only = j->read_only;
    j->state = (struct lum_document_state){0};
    j->has_state = false;
    j->snapshot_seq = j->state_seq;
    for (size_t i = 0; i < j->fresh.n; i++)
        lum_kept_add(&j->kept, j->fresh.kept[i].first, j->fresh.kept[i].n, j->fresh.kept[i].sha);
    lum_kept_finish(&j->recent);
    j->recent = j->fresh;
    j->fresh = (struct lum_kept_list){0};
    pthread_mutex_unlock(&j->lock);
    enum lum_status st = read_only ? LUM_OK : new_file(j, j->snapshot_seq, err);
    if (st) {
        lum_document_state_finish(&state);
        return st;
    }
    const struct lum_snapshot_config config = {&j->dir,         &j->content, "snapshot.part",
                                               j->snapshot_seq, j->starts,   &j->kept};
    return lum_snapshot_begin(&config, &state, &j->snapshot, err);
}

/* The file is whole: it gets its name. */
static enum lum_status finish_snapshot(struct lum_journal *j, struct lum_error *err)
{
    char name[LUM_JOURNAL_NAME_BYTES];
    lum_state_name(name, "snapshot", j->snapshot_seq);
    pthread_mutex_lock(&j->lock);
    bool read_only = j->read_only;
    pthread_mutex_unlock(&j->lock);
    enum lum_status st = lum_dir_rename(&j->dir, "snapshot.part", name, err);
    if (!st && read_only)
        st = new_file(j, j->snapshot_seq, err);
    if (st)
        return st;
    lum_recovery_put_aside(&j->recovery, &j->dir);
    j->recovery.n_damaged = 0;
    struct lum_kept_list kept = lum_snapshot_take_kept(j->snapshot);
    uint64_t n_bytes = lum_snapshot_bytes(j->snapshot);
    lum_snapshot_end(j->snapshot);
    j->snapshot = NULL;
    clean(j, &kept);
    for (size_t i = 0; i < j->recent.n; i++)
        lum_kept_add(&kept, j->recent.kept[i].first, j->recent.kept[i].n, j->recent.kept[i].sha);
    lum_kept_finish(&j->kept);
    j->kept = kept;
    pthread_mutex_lock(&j->lock);
    if (j->read_only && j->has_thread)
        lum_log(&j->config.log, LUM_LOG_WARNING, "journal", "the scene is saved again, edits are accepted");
    j->read_only = j->busy = false;
    j->snapshot_bytes = n_bytes;
    j->status.n_snapshots++;
    j->status.journal_bytes = j->file.n_bytes;
    pthread_mutex_unlock(&j->lock);
    return LUM_OK;
}

/* A snapshot that cannot be written costs nothing while edits can: the older one stands. It is tried again. */
static void drop_snapshot(struct lum_journal *j, const struct lum_error *err)
{
    lum_snapshot_end(j->snapshot);
    j->snapshot = NULL;
    lum_dir_remove(&j->dir, "snapshot.part");
    pthread_mutex_lock(&j->lock);
    j->retry_due_ns = lum_clock_ns() + RETRY_AFTER_NS;
    j->busy = false;
    bool told = j->read_only && strcmp(j->status.why, err->text) == 0;
    if (j->read_only)
        snprintf(j->status.why, sizeof j->status.why, "%s", err->text);
    pthread_mutex_unlock(&j->lock);
    if (!told)
        lum_log(&j->config.log, LUM_LOG_ERROR, "journal", "no snapshot: %s; it is tried again", err->text);
}

/* ---- entries ---- */

static void drop_entries(struct lum_entry *e)
{
    for (struct lum_entry *next; e; e = next) {
        next = e->next;
        lum_entry_destroy(e);
    }
}

/* What was not synced is cut off as far as that can be done: it was never acknowledged. */
static void fail_file(struct lum_journal *j, const struct lum_error *err)
{
    if (j->file.fd >= 0 && j->config.durability == LUM_DURABILITY_COMMIT)
        (void)!ftruncate(j->file.fd, (off_t)j->synced_bytes);
    lum_frame_close(&j->file);
    lum_log(&j->config.log, LUM_LOG_ERROR, "journal",
            "%s: the scene is read-only until it can be saved again; it is tried every second", err->text);
    pthread_mutex_lock(&j->lock);
    struct lum_entry *queue = j->queue;
    j->queue = NULL;
    j->queue_tail = &j->queue;
    j->n_queue = j->queue_bytes = 0;
    j->read_only = j->failed = true;
    if (j->has_state)
        lum_document_state_finish(&j->state); /* it has edits that are taken back */
    j->wants_state = j->has_state = j->busy = false;
    j->retry_due_ns = lum_clock_ns();
    snprintf(j->status.why, sizeof j->status.why, "%s", err->text);
    j->status.n_failures++;
    pthread_mutex_unlock(&j->lock);
    drop_entries(queue);
    lum_snapshot_end(j->snapshot); /* the same */
    j->snapshot = NULL;
    j->sync_due_ns = FOREVER;
    j->config.attention(j->config.user);
}

static void note_synced(struct lum_journal *j)
{
    j->synced_bytes = j->file.n_bytes;
    j->sync_due_ns = FOREVER;
    pthread_mutex_lock(&j->lock);
    j->status.n_syncs++;
    j->status.saved_rev = j->file_rev;
    j->status.journal_bytes = j->file.n_bytes;
    pthread_mutex_unlock(&j->lock);
    if (j->config.durability == LUM_DURABILITY_COMMIT) {
        atomic_store(&j->acknowledged, j->file_seq);
        j->config.saved(j->config.user);
    }
}

/* Writes the entries, which are the caller's still. */
static enum lum_status write_entries(struct lum_journal *j, struct lum_entry *first, struct lum_error *err)
{
    enum lum_status st = LUM_OK;
    for (struct lum_entry *e = first; e && !st; e = e->next) {
        st = lum_frame_put(&j->file, e->seq, e->rev, lum_entry_to_json(e), NULL, err);
        j->file_seq = e->seq;
        j->file_rev = e->rev;
    }
    return st ? st : lum_frame_flush(&j->file, err);
}

static void commit(struct lum_journal *j, struct lum_entry *entries)
{
    struct lum_error err;
    enum lum_status st = write_entries(j, entries, &err);
    drop_entries(entries);
    bool sync = j->config.durability == LUM_DURABILITY_COMMIT;
    if (!st && sync)
        st = lum_frame_sync(&j->file, &err);
    if (st)
        fail_file(j, &err);
    else if (sync)
        note_synced(j);
    else if (j->sync_due_ns == FOREVER)
        j->sync_due_ns = lum_clock_ns() + SYNC_EVERY_NS;
}

static void sync_now(struct lum_journal *j)
{
    struct lum_error err;
    if (lum_frame_sync(&j->file, &err))
        fail_file(j, &err);
    else
        note_synced(j);
}

/* ---- the thread ---- */

static void turn_snapshot(struct lum_journal *j)
{
    struct lum_error err;
    bool done = false;
    if (!j->snapshot && j->sync_due_ns != FOREVER) { /* the file that is left behind is whole first */
        sync_now(j);
        return;
    }
    enum lum_status st = j->snapshot ? lum_snapshot_step(j->snapshot, &done, &err) : begin_snapshot(j, &err);
    if (!st && done)
        st = finish_snapshot(j, &err);
    if (st)
        drop_snapshot(j, &err);
}

static bool state_ready_locked(const struct lum_journal *j)
{
    return j->has_state && (!j->queue || j->queue->seq > j->state_seq);
}

/* Edits up to the state that is to be a snapshot, if there is one: those after it belong into another file. */
static struct lum_entry *take_entries_locked(struct lum_journal *j)
{
    struct lum_entry *first = j->queue, **end = &j->queue;
    while (*end && !(j->has_state && (*end)->seq > j->state_seq)) {
        j->n_queue--;
        j->queue_bytes -= (*end)->n_bytes;
        end = &(*end)->next;
    }
    j->queue = *end;
    if (end == &j->queue)
        return NULL;
    *end = NULL;
    if (!j->queue)
        j->queue_tail = &j->queue;
    return first;
}

static struct timespec at_ns(int64_t ns)
{
    return (struct timespec){.tv_sec = ns / 1000000000, .tv_nsec = ns % 1000000000};
}

/* Sleeps until there is something to do. False: it is to stop, and nothing waits to be written. */
static bool next_turn(struct lum_journal *j, struct lum_entry **ret_entries, bool *ret_snapshot)
{
    bool attention = false;
    pthread_mutex_lock(&j->lock);
    for (;;) {
        int64_t now_ns = lum_clock_ns(), due_ns = j->sync_due_ns;
        *ret_entries = take_entries_locked(j);
        *ret_snapshot = j->snapshot || state_ready_locked(j);
        bool retry = j->read_only && !j->busy && !j->wants_state;
        if (retry && now_ns >= j->retry_due_ns)
            attention = j->wants_state = true;
        else if (retry && j->retry_due_ns < due_ns)
            due_ns = j->retry_due_ns;
        if (*ret_entries || *ret_snapshot || j->stop || attention || now_ns >= due_ns)
            break;
        struct timespec until = at_ns(due_ns);
        if (due_ns == FOREVER)
            pthread_cond_wait(&j->bell, &j->lock);
        else
            pthread_cond_timedwait(&j->bell, &j->lock, &until);
    }
    bool on = !j->stop || *ret_entries;
    pthread_mutex_unlock(&j->lock);
    if (attention)
        j->config.attention(j->config.user);
    return on;
}

static void *journal_main(void *arg)
{
    struct lum_journal *j = arg;
    struct lum_entry *entries;
    bool snapshot;
    pthread_setname_np(pthread_self(), "lum-journal");
    while (next_turn(j, &entries, &snapshot)) {
        if (entries)
            commit(j, entries);
        else if (snapshot)
            turn_snapshot(j);
        if (lum_clock_ns() >= j->sync_due_ns)
            sync_now(j);
    }
    if (j->sync_due_ns != FOREVER)
        sync_now(j);
    return NULL;
}

/* ---- life ---- */

static void tell_damage(void *user, const char *text)
{
    struct lum_journal *j = user;
    lum_log(&j->config.log, LUM_LOG_ERROR, "journal", "%s", text);
}

static enum lum_status init_lock(struct lum_journal *j, struct lum_error *err)
{
    pthread_condattr_t attr;
    if (pthread_condattr_init(&attr))
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a lock");
    pthread_condattr_setclock(&attr, CLOCK_MONOTONIC);
    int failed = pthread_cond_init(&j->bell, &attr);
    pthread_condattr_destroy(&attr);
    if (!failed && pthread_mutex_init(&j->lock, NULL) == 0)
        return LUM_OK;
    if (!failed)
        pthread_cond_destroy(&j->bell);
    return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a lock");
}

static void remove_part(void *user, const char *name)
{
    if (strncmp(name, "part-", 5) == 0)
        lum_dir_remove(user, name);
}

static enum lum_status open_folders(struct lum_journal *j, struct lum_error *err)
{
    const struct lum_disk *disk = j->config.disk ? j->config.disk : &lum_disk_real;
    enum lum_status st = lum_dir_open(AT_FDCWD, j->config.dir, true, disk, &j->dir, err);
    if (!st)
        st = lum_dir_lock(&j->dir, j->config.dir, &j->lock_fd, err);
    if (!st)
        st = lum_dir_open(j->dir.fd, "content", true, disk, &j->content, err);
    if (!st)
        st = lum_dir_each(&j->content, remove_part, &j->content, err);
    return st;
}

static void tell_recovery(const struct lum_journal *j)
{
    const struct lum_recovery *r = &j->recovery;
    char cut[96] = "";
    if (r->n_cut)
        snprintf(cut, sizeof cut, "; %llu bytes of an edit that was never acknowledged are cut off",
                 (unsigned long long)r->n_cut);
    lum_log(&j->config.log, r->n_cut ? LUM_LOG_WARNING : LUM_LOG_INFO, "journal",
            "%.200s: revision %llu, %llu edits done again since the snapshot%s", j->config.dir,
            (unsigned long long)lum_document_rev(r->doc), (unsigned long long)r->n_done, cut);
    if (r->n_lost)
        lum_log(&j->config.log, LUM_LOG_ERROR, "journal",
                "%llu edits are lost; the damaged files are kept as *.damaged", (unsigned long long)r->n_lost);
}

enum lum_status lum_journal_open(const struct lum_journal_config *config, struct lum_journal **ret_journal,
                                 struct lum_document **ret_doc, struct lum_error *err)
{
    struct lum_journal *j = lum_calloc(1, sizeof *j);
    if (!j)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the journal");
    j->config = *config;
    if (!config->compact_bytes)
        j->config.compact_bytes = LUM_JOURNAL_COMPACT_BYTES;
    j->lock_fd = j->dir.fd = j->content.fd = j->file.fd = -1;
    j->queue_tail = &j->queue;
    j->sync_due_ns = FOREVER;
    j->read_only = true; /* until there is a snapshot */
    j->status.durability = config->durability;
    enum lum_status st = init_lock(j, err);
    if (st) {
        lum_free(j);
        return st;
    }
    const struct lum_damage_sink damage = {tell_damage, j};
    st = open_folders(j, err);
    if (!st)
        st = lum_recover(&j->dir, &j->content, &damage, &j->recovery, err);
    if (st) {
        lum_journal_close(j);
        return st;
    }
    j->recovered = j->recovery.doc != NULL;
    if (j->recovered)
        tell_recovery(j);
    j->starts = j->recovery.starts + 1;
    /* a number of its own where files are damaged: the new snapshot takes the place of none of them */
    j->seq = j->recovery.seq + (j->recovery.n_damaged > 0);
    atomic_store(&j->acknowledged, config->durability == LUM_DURABILITY_COMMIT ? j->seq : UINT64_MAX);
    j->kept = j->recovery.kept;
    j->recovery.kept = (struct lum_kept_list){0};
    *ret_doc = j->recovery.doc;
    j->recovery.doc = NULL;
    *ret_journal = j;
    return LUM_OK;
}

static enum lum_status first_snapshot(struct lum_journal *j, struct lum_document_state *state, struct lum_error *err)
{
    j->file_rev = j->status.saved_rev = state->rev; /* of a recovered one: it is on disk */
    lum_journal_give_state(j, state);
    enum lum_status st = begin_snapshot(j, err);
    for (bool done = false; !st && !done;)
        st = lum_snapshot_step(j->snapshot, &done, err);
    return st ? st : finish_snapshot(j, err);
}

enum lum_status lum_journal_start(struct lum_journal *j, struct lum_document_state *state, struct lum_error *err)
{
    struct lum_error why;
    if (first_snapshot(j, state, &why)) {
        drop_snapshot(j, &why);
        if (!j->recovered)
            return lum_fail(err, LUM_ERR_IO, "state", "%s", why.text);
        lum_log(&j->config.log, LUM_LOG_ERROR, "journal", "the scene is read-only until it can be saved");
    }
    if (pthread_create(&j->thread, NULL, journal_main, j))
        return lum_fail(err, LUM_ERR_NOMEM, "", "the journal's thread cannot be started");
    j->has_thread = true;
    return LUM_OK;
}

void lum_journal_close(struct lum_journal *j)
{
    if (!j)
        return;
    pthread_mutex_lock(&j->lock);
    j->stop = true;
    pthread_cond_signal(&j->bell);
    pthread_mutex_unlock(&j->lock);
    if (j->has_thread)
        pthread_join(j->thread, NULL);
    drop_entries(j->queue);
    lum_document_state_finish(&j->state);
    lum_snapshot_end(j->snapshot);
    lum_frame_close(&j->file);
    lum_kept_finish(&j->kept);
    lum_kept_finish(&j->fresh);
    lum_kept_finish(&j->recent);
    lum_recovery_finish(&j->recovery);
    lum_dir_close(&j->content);
    lum_dir_close(&j->dir);
    if (j->lock_fd >= 0)
        close(j->lock_fd);
    pthread_cond_destroy(&j->bell);
    pthread_mutex_destroy(&j->lock);
    lum_free(j);
}

uint64_t lum_journal_starts(const struct lum_journal *j)
{
    return j->starts;
}

/* ---- what others call ---- */

enum lum_status lum_journal_store(struct lum_journal *j, struct lum_record *const *records, size_t n, lum_sha ret_sha,
                                  struct lum_error *err)
{
    enum lum_status st = LUM_OK;
    for (bool there = false; !st && !there;) {
        st = lum_content_write(&j->content, records, n, ret_sha, err);
        pthread_mutex_lock(&j->lock);
        there = !st && lum_dir_has(&j->content, ret_sha); /* else it was just removed, as unused till now */
        if (there && n > 0)
            lum_kept_add(&j->fresh, records[0], n, ret_sha);
        pthread_mutex_unlock(&j->lock);
    }
    return st;
}

bool lum_journal_accepts(struct lum_journal *j, char ret_why[256])
{
    pthread_mutex_lock(&j->lock);
    bool full = j->n_queue >= LUM_JOURNAL_QUEUE_ENTRIES || j->queue_bytes >= LUM_JOURNAL_QUEUE_BYTES;
    if (j->read_only)
        snprintf(ret_why, 256, "the scene cannot be edited until it can be saved: %.180s", j->status.why);
    else if (full)
        snprintf(ret_why, 256, "the disk is slow, and too many edits wait to be saved; try again");
    bool ok = !j->read_only && !full;
    pthread_mutex_unlock(&j->lock);
    return ok;
}

uint64_t lum_journal_submit(struct lum_journal *j, struct lum_entry *e, uint64_t rev)
{
    pthread_mutex_lock(&j->lock);
    uint64_t seq = e->seq = ++j->seq;
    bool lost = j->read_only; /* lum_journal_failed will say so */
    e->rev = rev;
    e->next = NULL;
    if (!lost) {
        *j->queue_tail = e;
        j->queue_tail = &e->next;
        j->n_queue++;
        j->queue_bytes += e->n_bytes;
        j->status.n_entries++;
        pthread_cond_signal(&j->bell);
    }
    pthread_mutex_unlock(&j->lock);
    if (lost)
        lum_entry_destroy(e);
    return seq;
}

bool lum_journal_failed(struct lum_journal *j, uint64_t *ret_durable, char ret_why[256])
{
    pthread_mutex_lock(&j->lock);
    bool failed = j->failed;
    j->failed = false;
    if (failed) {
        if (j->config.durability == LUM_DURABILITY_COMMIT)
            j->seq = atomic_load(&j->acknowledged);
        *ret_durable = j->seq;
        snprintf(ret_why, 256, "%s", j->status.why);
    }
    pthread_mutex_unlock(&j->lock);
    return failed;
}

bool lum_journal_wants_state(struct lum_journal *j)
{
    pthread_mutex_lock(&j->lock);
    bool due = !j->read_only && j->status.journal_bytes > j->config.compact_bytes &&
               j->status.journal_bytes > j->snapshot_bytes && lum_clock_ns() >= j->retry_due_ns;
    bool wants = (j->wants_state || due) && !j->failed && !j->busy;
    pthread_mutex_unlock(&j->lock);
    return wants;
}

void lum_journal_give_state(struct lum_journal *j, struct lum_document_state *state)
{
    pthread_mutex_lock(&j->lock);
    j->state = *state;
    j->state_seq = j->seq;
    j->has_state = j->busy = true;
    j->wants_state = false;
    pthread_cond_signal(&j->bell);
    pthread_mutex_unlock(&j->lock);
    *state = (struct lum_document_state){0};
}

void lum_journal_want_state(struct lum_journal *j)
{
    pthread_mutex_lock(&j->lock);
    j->wants_state = true;
    pthread_mutex_unlock(&j->lock);
}

uint64_t lum_journal_acknowledged(const struct lum_journal *j)
{
    return atomic_load(&j->acknowledged);
}

void lum_journal_status(struct lum_journal *j, struct lum_journal_status *ret_status)
{
    pthread_mutex_lock(&j->lock);
    *ret_status = j->status;
    ret_status->read_only = j->read_only;
    pthread_mutex_unlock(&j->lock);
}
