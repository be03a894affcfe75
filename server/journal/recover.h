/* From the files of a folder to the document: the newest snapshot that is whole, and the edits since, done again.
 *
 *   DIR/lock  snapshot-N  journal-N  content/SHA-256
 *
 * N is the number of the last edit before; starts take a number, too. Two snapshots are kept, and all journals from the
 * older one on, so that one damaged snapshot costs nothing. What a damaged journal costs: the damaged records, each
 * named by number and offset, and later edits that need what they made, each named with the reason. All else is done.
 * An undo is done only where the step that it took back is the one that it names: none takes back something else
 * because of a loss.
 *
 * A file that the disk does not give is not damaged: then there is no recovery at all, and nothing is changed.
 *
 * Thread: one; nobody else uses the folder. */
#ifndef LUM_SERVER_JOURNAL_RECOVER_H
#define LUM_SERVER_JOURNAL_RECOVER_H

#include "server/journal/snapshot.h"

#define LUM_JOURNAL_NAME_BYTES 40 /* "snapshot-", 20 digits of a 64-bit number, and a suffix */

struct lum_numbers_found { /* ascending */
    uint64_t *numbers;
    size_t n;
};
/* The numbers of all files "PREFIX-N" in the folder; names that end otherwise do not count. Free numbers. */
LUM_MUST_USE enum lum_status lum_state_list(const struct lum_dir *dir, const char *prefix,
                                            struct lum_numbers_found *ret, struct lum_error *err);
void lum_state_name(char ret_name[LUM_JOURNAL_NAME_BYTES], const char *prefix, uint64_t number);

struct lum_recovery {
    struct lum_document *doc; /* owned; NULL: the folder holds no state */
    uint64_t seq, starts;
    struct lum_kept_list kept;
    struct lum_done_user *done;
    uint64_t n_done, n_lost; /* edits since the snapshot: done again; lost, or not to be done without what is lost */
    uint64_t n_cut;          /* bytes of an edit that was never acknowledged */
    uint64_t n_damages;      /* lines told */
    char (*damaged)[LUM_JOURNAL_NAME_BYTES]; /* files, owned */
    size_t n_damaged;
};
/* Nothing is changed on disk. LUM_ERR_UNSUPPORTED: another version wrote some of it. LUM_ERR_INVALID: there are files,
 * and no snapshot can be read. LUM_ERR_IO: the disk does not give one of them. */
LUM_MUST_USE enum lum_status lum_recover(const struct lum_dir *dir, const struct lum_dir *content,
                                         const struct lum_damage_sink *damage, struct lum_recovery *ret,
                                         struct lum_error *err);
/* Once what was recovered is safe in a new snapshot: renames them to NAME.damaged, so that none is removed unseen. */
void lum_recovery_put_aside(const struct lum_recovery *r, const struct lum_dir *dir);
void lum_recovery_finish(struct lum_recovery *r);

#endif
