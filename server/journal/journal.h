/* The journal: keeps every edit in a folder, so that a daemon that ends in any way starts again with all that it
 * acknowledged. Its files: recover.h; their form: block.h.
 *
 * Invariants
 * - An edit is applied in memory, submitted here, and acknowledged only once lum_journal_acknowledged has reached its
 *   number: its bytes are synced. Edits become durable in their order.
 * - One thread writes. It takes all edits that wait, writes them, and syncs once: a drag costs a sync per turn of the
 *   disk and not per edit, and nobody else waits for it.
 * - After a write or a sync that failed nothing is believed of that file any more (a page that could not be
 *   written may count as clean): it is closed for good, the journal is read-only, and `attention` is called. The
 *   director takes back the edits that are not durable, and from then on gives the whole state each time it is
 *   wanted, until a snapshot of it is on disk. That one begins anew, with new files.
 * - A file is never appended to after a restart: each start begins with a snapshot.
 * - Snapshots are written by the same thread bit by bit, edits in between. Removed is only what the two newest
 *   snapshots and the edits since the older one do not need.
 * - LUM_DURABILITY_INTERVAL: edits are acknowledged at once, written at once, and synced once a second. The end of the
 *   process loses none of them that was written; a power cut at most the last second. */
#ifndef LUM_SERVER_JOURNAL_JOURNAL_H
#define LUM_SERVER_JOURNAL_JOURNAL_H

#include "server/journal/entry.h"

enum lum_durability { LUM_DURABILITY_COMMIT, LUM_DURABILITY_INTERVAL };
extern const char *const lum_durability_names[2]; /* "commit", "interval" */

struct lum_journal_config {
    const char *dir; /* made if it is not there */
    enum lum_durability durability;
    uint64_t compact_bytes;         /* of edits, after which a snapshot is due; 0: LUM_JOURNAL_COMPACT_BYTES */
    uint64_t compact_content_bytes; /* of content; 0: LUM_JOURNAL_CONTENT_BYTES */
    int64_t retry_ns;               /* after a failure; 0: LUM_JOURNAL_RETRY_NS */
    const struct lum_disk *disk;    /* NULL: the real one */
    struct lum_log log;
    /* Called on the journal's thread; must only wake somebody. saved: lum_journal_acknowledged grew. attention: ask
     * lum_journal_failed and lum_journal_wants_state. */
    void (*saved)(void *user);
    void (*attention)(void *user);
    void *user;
};
#define LUM_JOURNAL_COMPACT_BYTES (8u << 20) /* a second to do again */
/* Content of which nothing is used any more is held on disk, and in part in memory, until two snapshots later. */
#define LUM_JOURNAL_CONTENT_BYTES (256u << 20)
#define LUM_JOURNAL_RETRY_NS 1000000000ll    /* between tries of a disk that is full: soon after there is room */
#define LUM_JOURNAL_QUEUE_BYTES (256u << 20) /* of edits that wait for a disk that hangs */
#define LUM_JOURNAL_QUEUE_ENTRIES 65536u

struct lum_journal;

/* Locks the folder and recovers what is there; what is damaged goes to the log. *ret_doc is NULL where nothing was. */
LUM_MUST_USE enum lum_status lum_journal_open(const struct lum_journal_config *config, struct lum_journal **ret_journal,
                                              struct lum_document **ret_doc, struct lum_error *err);
/* Writes the first snapshot, blocking, and starts the thread. The state passes over. Where state was recovered a disk
 * that is full is no error: the journal begins read-only. */
LUM_MUST_USE enum lum_status lum_journal_start(struct lum_journal *j, struct lum_document_state *state,
                                               struct lum_error *err);
/* Writes and syncs what waits; then all is freed and the folder unlocked. Accepts NULL. */
void lum_journal_close(struct lum_journal *j);
/* What was recovered; passes over. */
struct lum_done_user *lum_journal_take_done(struct lum_journal *j);
/* How often a daemon has begun on this folder: what may not be the same again begins with it. */
uint64_t lum_journal_starts(const struct lum_journal *j);

/* ---- import threads ---- */
/* Keeps what an importer made: an entry that names it may be submitted. */
LUM_MUST_USE enum lum_status lum_journal_store(struct lum_journal *j, struct lum_record *const *records, size_t n,
                                               lum_sha ret_sha, struct lum_error *err);

/* ---- the director's thread ---- */
/* May an edit be made? LUM_ERR_IO: not until the state can be saved; LUM_ERR_LIMIT: too many wait. */
LUM_MUST_USE enum lum_status lum_journal_accepts(struct lum_journal *j, struct lum_error *err);
/* Takes the entry over, and gives it the next number, which is returned. Never fails and never waits. */
uint64_t lum_journal_submit(struct lum_journal *j, struct lum_entry *e, uint64_t rev);
/* True once after a failure: edits above the durable one are lost. Their numbers are given again. */
bool lum_journal_failed(struct lum_journal *j, uint64_t *ret_durable, char ret_why[256]);
/* True when lum_journal_give_state is to be called, with the state after all edits that were submitted. */
bool lum_journal_wants_state(struct lum_journal *j);
/* What is known of edits then; passes over. Before lum_journal_give_state, and lum_journal_start. */
void lum_journal_give_done(struct lum_journal *j, struct lum_done_user *done);
void lum_journal_give_state(struct lum_journal *j, struct lum_document_state *state); /* passes over */
/* A snapshot is due now, whatever the size. */
void lum_journal_want_state(struct lum_journal *j);

/* ---- any thread ---- */
/* The number up to which edits may be acknowledged. */
uint64_t lum_journal_acknowledged(const struct lum_journal *j);
struct lum_journal_status {
    enum lum_durability durability;
    bool read_only;
    char why[256];
    uint64_t saved_rev; /* synced */
    uint64_t n_entries, n_syncs, n_snapshots, n_failures;
    uint64_t journal_bytes; /* since the last snapshot */
};
void lum_journal_status(struct lum_journal *j, struct lum_journal_status *ret_status);

#endif
