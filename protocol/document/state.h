/* All that a document is, taken out of it and put back: what stands, the revision, and who may undo what. Records are
 * immutable and shared, so that taking it costs a reference a record; another thread may write it down meanwhile. */
#ifndef LUM_PROTOCOL_DOCUMENT_STATE_H
#define LUM_PROTOCOL_DOCUMENT_STATE_H

#include "protocol/document/past.h"

struct lum_step_state { /* a transaction that can be undone or redone */
    struct lum_changes changes;
    lum_id group;
    uint64_t rev;
};
struct lum_history_state {
    char user[LUM_LIMIT_ID_BYTES + 1];
    struct lum_step_state *steps; /* owned: n_undo that can be undone, then n_redo; each newest first */
    size_t n_undo, n_redo;
};
struct lum_past_state {         /* moments; none: they are not kept */
    struct lum_moment *moments; /* owned, oldest first; each has changes of its own */
    size_t n;
};
void lum_past_state_finish(struct lum_past_state *s);
struct lum_document_state {
    uint64_t rev;
    struct lum_record **records; /* owned references, in no order */
    size_t n_records;
    struct lum_history_state *histories; /* owned; used last comes first */
    size_t n_histories;
    struct lum_past_state past;
};
void lum_document_state_finish(struct lum_document_state *s); /* accepts a zeroed or half-filled one */

/* Nobody can undo what is in it, nor go back to what was. */
void lum_document_state_drop_histories(struct lum_document_state *s);

/* False: memory is short. Thread: the document's. */
bool lum_document_take_state(struct lum_document *doc, struct lum_document_state *ret_state);

/* A document in that state; a record may have been lost from it. What refers to a lost one, or stands there twice, is
 * left out, and told by its id. NULL: memory is short. */
struct lum_document *lum_document_from_state(const struct lum_document_state *s,
                                             void (*left_out)(void *user, const char *id, const char *why), void *user);

/* The next edit's revision follows this one. It never falls: revisions that others saw are not given twice. */
void lum_document_raise_rev(struct lum_document *doc, uint64_t rev);
/* From now on (or no more) edits are those of a journal, which were accepted once: they are held to what a scene may
 * be, and not to what one transaction may do. */
void lum_document_replay(struct lum_document *doc, bool on);

#endif
