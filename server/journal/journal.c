#define _GNU_SOURCE
#include "server/journal/internal.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "server/base/log.h"

const char *const lum_durability_names[2] = {"commit", "interval"};

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
    if (!failed && pthread_mutex_init(&j->lock, NULL) == 0) {
        if (pthread_mutex_init(&j->content_lock, NULL) == 0)
            return LUM_OK;
        pthread_mutex_destroy(&j->lock);
    }
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
    if (!config->compact_content_bytes)
        j->config.compact_content_bytes = LUM_JOURNAL_CONTENT_BYTES;
    if (!config->retry_ns)
        j->config.retry_ns = LUM_JOURNAL_RETRY_NS;
    j->lock_fd = j->dir.fd = j->content.fd = j->file.fd = -1;
    j->queue_tail = &j->queue;
    j->sync_due_ns = LUM_JOURNAL_NEVER_NS;
    j->read_only = true; /* until there is a snapshot */
    j->status.durability = config->durability;
    enum lum_status st = init_lock(j, err);
    if (st) {
        lum_free(j);
        return st;
    }
    const struct lum_damage_sink damage = {.tell = tell_damage, .user = j};
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
    /* a number of its own: the new snapshot takes the place of no other file */
    j->seq = j->first_seq = j->recovery.seq + j->recovered;
    atomic_store(&j->acknowledged, config->durability == LUM_DURABILITY_COMMIT ? j->seq : UINT64_MAX);
    j->kept = j->recovery.kept;
    j->recovery.kept = (struct lum_kept_list){0};
    j->done = j->recovery.done;
    j->recovery.done = NULL;
    *ret_doc = j->recovery.doc;
    j->recovery.doc = NULL;
    *ret_journal = j;
    return LUM_OK;
}

enum lum_status lum_journal_start(struct lum_journal *j, struct lum_document_state *state, struct lum_error *err)
{
    struct lum_error why;
    if (lum_journal_first_snapshot(j, state, &why)) {
        if (!j->recovered)
            return lum_fail(err, LUM_ERR_IO, "state", "%s", why.text);
        lum_log(&j->config.log, LUM_LOG_ERROR, "journal", "the scene is read-only until it can be saved");
    }
    if (pthread_create(&j->thread, NULL, lum_journal_main, j))
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
    lum_entries_destroy(j->queue);
    lum_document_state_finish(&j->state);
    lum_done_destroy(j->done);
    lum_snapshot_end(j->snapshot);
    lum_block_close(&j->file);
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
    pthread_mutex_destroy(&j->content_lock);
    lum_free(j);
}

struct lum_done_user *lum_journal_take_done(struct lum_journal *j)
{
    struct lum_done_user *done = j->done;
    j->done = NULL;
    return done;
}

uint64_t lum_journal_starts(const struct lum_journal *j)
{
    return j->starts;
}

/* ---- what others call ---- */

enum lum_status lum_journal_store(struct lum_journal *j, struct lum_record *const *records, size_t n, lum_sha ret_sha,
                                  struct lum_error *err)
{
    enum lum_status st, found = LUM_ERR_NOT_FOUND;
    do {
        uint64_t n_bytes = 0;
        st = lum_content_write(&j->content, records, n, ret_sha, err);
        pthread_mutex_lock(&j->content_lock);
        if (!st) /* it may just have been removed, as unused till now */
            found = lum_dir_size(&j->content, ret_sha, &n_bytes, err);
        pthread_mutex_lock(&j->lock);
        if (!st && !found && n > 0)
            lum_kept_add(&j->fresh, records[0], n, ret_sha);
        j->fresh_bytes += n_bytes;
        pthread_mutex_unlock(&j->lock);
        pthread_mutex_unlock(&j->content_lock);
    } while (!st && found == LUM_ERR_NOT_FOUND);
    return st ? st : found;
}

enum lum_status lum_journal_accepts(struct lum_journal *j, struct lum_error *err)
{
    enum lum_status st = LUM_OK;
    pthread_mutex_lock(&j->lock);
    if (j->read_only)
        st = lum_fail(err, LUM_ERR_IO, "state", "the scene cannot be edited until it can be saved: %.180s",
                      j->status.why);
    else if (j->n_queue >= LUM_JOURNAL_QUEUE_ENTRIES || j->queue_bytes >= LUM_JOURNAL_QUEUE_BYTES)
        st = lum_fail(err, LUM_ERR_LIMIT, "state", "the disk is slow, and too many edits wait to be saved; try again");
    pthread_mutex_unlock(&j->lock);
    return st;
}

uint64_t lum_journal_submit(struct lum_journal *j, struct lum_entry *e, uint64_t rev)
{
    pthread_mutex_lock(&j->lock);
    bool lost = j->read_only; /* lum_journal_failed will say so, or the next state that is given has it */
    bool counted = !lost || j->failed;
    uint64_t seq = e->seq = j->seq += counted;
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
    bool much = j->fresh_bytes > j->config.compact_content_bytes ||
                (j->status.journal_bytes > j->config.compact_bytes && j->status.journal_bytes > j->snapshot_bytes);
    bool due = much && !j->read_only && lum_clock_ns() >= j->retry_due_ns;
    bool wants = (j->wants_state || due) && !j->failed && !j->busy;
    pthread_mutex_unlock(&j->lock);
    return wants;
}

void lum_journal_give_done(struct lum_journal *j, struct lum_done_user *done)
{
    pthread_mutex_lock(&j->lock);
    struct lum_done_user *before = j->done;
    j->done = done;
    pthread_mutex_unlock(&j->lock);
    lum_done_destroy(before);
}

void lum_journal_give_state(struct lum_journal *j, struct lum_document_state *state)
{
    pthread_mutex_lock(&j->lock);
    bool stale = j->failed; /* since it was asked for: it has edits that will be taken back. It is asked for again */
    if (!stale) {
        j->state = *state;
        j->state_seq = j->seq;
        j->has_state = j->busy = true;
        j->wants_state = false;
        pthread_cond_signal(&j->bell);
    }
    pthread_mutex_unlock(&j->lock);
    if (stale)
        lum_document_state_finish(state);
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
