/* Inside of struct lum_journal, shared by journal.c (life, what others call) and journal_writer.c (its thread). */
#ifndef LUM_SERVER_JOURNAL_INTERNAL_H
#define LUM_SERVER_JOURNAL_INTERNAL_H

#include <pthread.h>

#include "server/journal/journal.h"
#include "server/journal/recover.h"

#define LUM_JOURNAL_NEVER_NS INT64_MAX

struct lum_journal {
    /* immutable */
    struct lum_journal_config config;
    struct lum_dir dir, content;
    int lock_fd;
    bool recovered;
    uint64_t starts, first_seq; /* of this start: a number that is of no edit, where state was recovered */
    pthread_t thread;
    bool has_thread;

    /* Held while it is found out whether content is there, and while what is unused is removed: nobody else waits for
     * that, as the disk may hang. Before lock. */
    pthread_mutex_t content_lock;

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
    struct lum_done_user *done;      /* of the state */
    uint64_t state_seq, snapshot_bytes;
    int64_t retry_due_ns;       /* no snapshot before */
    struct lum_kept_list fresh; /* content that was stored since the last snapshot began; added to under both locks */
    uint64_t fresh_bytes;       /* of it, on disk */
    struct lum_journal_status status;

    _Atomic uint64_t acknowledged;

    /* the journal's thread; before it starts, and after it ends, whoever calls */
    struct lum_block_writer file;
    uint64_t file_seq, file_rev; /* of the newest entry in it */
    uint64_t synced_bytes;       /* of it */
    int64_t sync_due_ns;
    struct lum_snapshot_writer *snapshot; /* being written; NULL: none */
    uint64_t snapshot_seq, snapshot_rev;
    struct lum_kept_list kept;   /* content that the last snapshot and the edits since need */
    struct lum_kept_list recent; /* of it, what was stored between the last two snapshots */
    struct lum_recovery recovery;
};

/* ---- journal_writer.c ---- */
void *lum_journal_main(void *journal); /* the thread */
/* Before it starts: writes the state, which passes over, and begins the first file. On failure the journal is
 * read-only. */
LUM_MUST_USE enum lum_status lum_journal_first_snapshot(struct lum_journal *j, struct lum_document_state *state,
                                                        struct lum_error *err);

#endif
