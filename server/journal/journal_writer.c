/* The journal's thread: the only one that writes the files of edits and snapshots. */
#define _GNU_SOURCE /* pthread_setname_np */
#include "server/journal/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "server/base/log.h"

#define SYNC_EVERY_NS 1000000000ll /* LUM_DURABILITY_INTERVAL */

/* ---- files ---- */

/* What was not synced is cut off as far as that can be done: it was never acknowledged. */
static void fail_file(struct lum_journal *j, const struct lum_error *err)
{
    if (j->file.fd >= 0 && j->config.durability == LUM_DURABILITY_COMMIT)
        (void)!ftruncate(j->file.fd, (off_t)j->synced_bytes);
    lum_block_close(&j->file);
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
    lum_entries_destroy(queue);
    lum_snapshot_end(j->snapshot); /* the same */
    j->snapshot = NULL;
    j->sync_due_ns = LUM_JOURNAL_NEVER_NS;
    j->config.attention(j->config.user);
}

/* A new journal for the entries after seq. The old one is closed. Where it is not known which of the two a start would
 * find, neither is used any more. */
static enum lum_status new_file(struct lum_journal *j, uint64_t seq, struct lum_error *err)
{
    struct lum_block_writer file;
    char name[LUM_JOURNAL_NAME_BYTES];
    lum_state_name(name, "journal", seq);
    uint32_t gap = j->recovered && seq == j->first_seq;
    enum lum_status st = lum_block_create(&file, &j->dir, "journal.part", LUM_FILE_JOURNAL, seq, gap, err);
    if (st)
        return st;
    st = lum_block_sync(&file, err);
    bool named = !st;
    if (!st)
        st = lum_dir_rename(&j->dir, "journal.part", name, err);
    if (st) {
        lum_block_close(&file);
        if (named && j->file.fd >= 0)
            fail_file(j, err);
        return st;
    }
    lum_block_close(&j->file);
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
    pthread_mutex_lock(&j->content_lock); /* nobody stores meanwhile what is being removed */
    (void)!lum_dir_each(&j->content, remove_unused_content, &c, &err);
    pthread_mutex_unlock(&j->content_lock);
}

/* ---- snapshots ---- */

/* Entries up to state_seq are in files already. While edits are accepted those after it go into a new journal from now
 * on, whether this snapshot comes to be or not. */
static enum lum_status begin_snapshot(struct lum_journal *j, struct lum_error *err)
{
    pthread_mutex_lock(&j->lock);
    struct lum_document_state state = j->state;
    struct lum_done_user *done = j->done;
    bool read_only = j->read_only;
    j->done = NULL;
    j->state = (struct lum_document_state){0};
    j->has_state = false;
    j->snapshot_seq = j->state_seq;
    j->snapshot_rev = state.rev;
    for (size_t i = 0; i < j->fresh.n; i++)
        lum_kept_add(&j->kept, j->fresh.kept[i].first, j->fresh.kept[i].n, j->fresh.kept[i].sha);
    lum_kept_finish(&j->recent);
    j->recent = j->fresh;
    j->fresh = (struct lum_kept_list){0};
    j->fresh_bytes = 0;
    pthread_mutex_unlock(&j->lock);
    enum lum_status st = read_only ? LUM_OK : new_file(j, j->snapshot_seq, err);
    if (st) {
        lum_document_state_finish(&state);
        lum_done_destroy(done);
        return st;
    }
    const struct lum_snapshot_config config = {&j->dir,  &j->content, "snapshot.part", j->snapshot_seq, j->starts,
                                               &j->kept, done};
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
    if (j->read_only)
        j->status.saved_rev = j->file_rev = j->snapshot_rev;
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
    j->retry_due_ns = lum_clock_ns() + j->config.retry_ns;
    j->busy = false;
    bool told = j->read_only && strcmp(j->status.why, err->text) == 0;
    if (j->read_only)
        snprintf(j->status.why, sizeof j->status.why, "%s", err->text);
    pthread_mutex_unlock(&j->lock);
    if (!told)
        lum_log(&j->config.log, LUM_LOG_ERROR, "journal", "no snapshot: %s; it is tried again", err->text);
}

/* ---- entries ---- */

static void note_synced(struct lum_journal *j)
{
    j->synced_bytes = j->file.n_bytes;
    j->sync_due_ns = LUM_JOURNAL_NEVER_NS;
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
        st = lum_block_put(&j->file, e->seq, e->rev, lum_entry_to_json(e), NULL, err);
        j->file_seq = e->seq;
        j->file_rev = e->rev;
    }
    return st ? st : lum_block_flush(&j->file, err);
}

static void commit(struct lum_journal *j, struct lum_entry *entries)
{
    struct lum_error err;
    enum lum_status st = write_entries(j, entries, &err);
    lum_entries_destroy(entries);
    bool sync = j->config.durability == LUM_DURABILITY_COMMIT;
    if (!st && sync)
        st = lum_block_sync(&j->file, &err);
    if (st)
        fail_file(j, &err);
    else if (sync)
        note_synced(j);
    else if (j->sync_due_ns == LUM_JOURNAL_NEVER_NS)
        j->sync_due_ns = lum_clock_ns() + SYNC_EVERY_NS;
}

static void sync_now(struct lum_journal *j)
{
    struct lum_error err;
    if (lum_block_sync(&j->file, &err))
        fail_file(j, &err);
    else
        note_synced(j);
}

/* ---- the thread ---- */

static void turn_snapshot(struct lum_journal *j)
{
    struct lum_error err;
    bool done = false;
    if (!j->snapshot && j->sync_due_ns != LUM_JOURNAL_NEVER_NS) { /* the file that is left behind is whole first */
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
        if (j->stop && j->has_state) { /* no snapshot is begun any more: what waits goes into the file that there is */
            lum_document_state_finish(&j->state);
            j->has_state = j->busy = false;
        }
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
        if (due_ns == LUM_JOURNAL_NEVER_NS)
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

void *lum_journal_main(void *arg)
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
    if (j->sync_due_ns != LUM_JOURNAL_NEVER_NS)
        sync_now(j);
    return NULL;
}

enum lum_status lum_journal_first_snapshot(struct lum_journal *j, struct lum_document_state *state,
                                           struct lum_error *err)
{
    j->file_rev = j->status.saved_rev = state->rev; /* of a recovered one: it is on disk */
    lum_journal_give_state(j, state);
    enum lum_status st = begin_snapshot(j, err);
    for (bool done = false; !st && !done;)
        st = lum_snapshot_step(j->snapshot, &done, err);
    if (!st)
        st = finish_snapshot(j, err);
    if (st)
        drop_snapshot(j, err);
    return st;
}
