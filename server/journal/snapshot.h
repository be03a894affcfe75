/* A snapshot: a file that holds a document whole: records, the revision, who may undo what. Each block can be lost
 * alone.
 *
 * - {"snapshot":{"records":N,"starts":n,"moments":m}}: how many numbers records have; how often the daemon began
 * - {"pack":{"sha":"..","first":i,"n":k,"stand":[..]}}: content: k records from number i on, and which of them stand
 * - {"index":i,"stands":true,"made":[i,k],"op":{..},"origin":".."}: one record, and what it made (imports)
 * - {"user":"ann.3-1"}: a history; used last comes first
 * - {"step":{"user":"..","redo":false,"undo_group":"..","rev":7,"changes":[before,after,..]}}: numbers; -1: none
 * - {"moment":{"i":0,"rev":7,"at":ms,"user":"..",..,"changes":[..]}}: what was (protocol/document/past.h), oldest first
 * - {"done":{"user":"..","op_ids":["a1",..],"revs":[7,..]}}: edits that may be sent again (done.h)
 * - {"end":true} */
#ifndef LUM_SERVER_JOURNAL_SNAPSHOT_H
#define LUM_SERVER_JOURNAL_SNAPSHOT_H

#include "protocol/document/state.h"
#include "server/journal/content.h"
#include "server/journal/done.h"

/* Content that is known to be on disk: lists of records by their first. Guarded by the journal's lock. */
struct lum_kept {
    struct lum_record *first; /* a reference */
    size_t n;
    lum_sha sha;
};
struct lum_kept_list {
    struct lum_kept *kept;
    size_t n, capacity;
};
void lum_kept_finish(struct lum_kept_list *l);
/* Memory that is short is no harm: the content is written again then. */
void lum_kept_add(struct lum_kept_list *l, struct lum_record *first, size_t n, const char *sha);
const char *lum_kept_find(const struct lum_kept_list *l, const struct lum_record *first, size_t n);

/* Writes a snapshot bit by bit, so that the thread can do other things in between. */
struct lum_snapshot_writer;
struct lum_snapshot_config {
    const struct lum_dir *dir, *content;
    const char *name;                 /* of the file: it is synced, and the caller renames it */
    uint64_t seq, starts;             /* the last edit that is in it */
    const struct lum_kept_list *kept; /* not changed while the writer lives */
    struct lum_done_user *done;       /* passes over */
};
/* Takes the state, and what was done, over in every case. */
LUM_MUST_USE enum lum_status lum_snapshot_begin(const struct lum_snapshot_config *config,
                                                struct lum_document_state *state,
                                                struct lum_snapshot_writer **ret_writer, struct lum_error *err);
/* One bit more. *ret_done: the file is whole and synced. */
LUM_MUST_USE enum lum_status lum_snapshot_step(struct lum_snapshot_writer *w, bool *ret_done, struct lum_error *err);
/* What it refers to; passes over. */
struct lum_kept_list lum_snapshot_take_kept(struct lum_snapshot_writer *w);
uint64_t lum_snapshot_bytes(const struct lum_snapshot_writer *w);
void lum_snapshot_end(struct lum_snapshot_writer *w); /* accepts NULL */

struct lum_snapshot_read {
    struct lum_document_state state;
    uint64_t seq, starts;
    struct lum_kept_list kept;
    struct lum_done_user *done;
    bool whole; /* nothing was lost */
};
void lum_snapshot_read_finish(struct lum_snapshot_read *s);
/* Reads as much as there is; what is lost is told, and `whole` is false. An error only where nothing can be read. */
LUM_MUST_USE enum lum_status lum_snapshot_load(const struct lum_dir *dir, const struct lum_dir *content,
                                               const char *name, const struct lum_damage_sink *damage,
                                               struct lum_snapshot_read *ret, struct lum_error *err);

#endif
