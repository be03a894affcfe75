/* What a document was: each edit since it began to be kept, so that what stood at an earlier moment can be told, and
 * can come back. A moment is what stood after an edit; a drag is one. Coming back to one is an edit like any other, of
 * one step of undo: nothing that came after it is lost, and whoever goes on from there has made a branch.
 *
 * Records are immutable and shared: a moment costs the records that are no more, and a few bytes. Where there are too
 * many the oldest are joined, but for those that have names; where they hold on to too much, the oldest are forgotten.
 */
#ifndef LUM_PROTOCOL_DOCUMENT_PAST_H
#define LUM_PROTOCOL_DOCUMENT_PAST_H

#include "protocol/document/document.h"

enum lum_past_did { LUM_PAST_APPLY, LUM_PAST_UNDO, LUM_PAST_REDO, LUM_PAST_REVERT };
#define LUM_PAST_DID_NAMES "apply|undo|redo|revert"

struct lum_moment {
    uint64_t rev;               /* of the document then */
    int64_t at_ms;              /* of the Unix epoch; 0: nobody knows */
    uint64_t to;                /* revert: the revision that it came back to */
    uint32_t n_edits, n_joined; /* messages that led to it; steps that were joined for room, 1: none */
    enum lum_past_did did;
    char user[LUM_LIMIT_ID_BYTES + 1];                                            /* "": several */
    lum_id group;                                                                 /* lum_ops.undo_group */
    char name[LUM_LIMIT_MOMENT_NAME_BYTES + 1], named_by[LUM_LIMIT_ID_BYTES + 1]; /* "": it has none */
    struct lum_changes changes; /* since the moment before; of the first: none. In any order */
    bool by_id;                 /* they are sorted by id */
};

/* From now on moments are kept, and this is the first. What was kept before is forgotten. */
void lum_document_begin_past(struct lum_document *doc);
/* Of the edits that follow. A document has no clock: edits of a journal were made when it says. */
void lum_document_set_time(struct lum_document *doc, int64_t at_ms);

/* For who needs room: moments without names are joined with the next. */
void lum_document_thin_past(struct lum_document *doc);

/* How many are kept, oldest first; 0: they are not. The last one is now. */
size_t lum_document_n_moments(const struct lum_document *doc);
const struct lum_moment *lum_document_moment(const struct lum_document *doc, size_t i);

/* The changes that lead from now to the moment of that revision, in an order that can be applied one by one. Fails with
 * "not_found" where no such moment is kept. */
bool lum_document_changes_to(const struct lum_document *doc, uint64_t rev, struct lum_changes *ret_changes,
                             struct lum_proto_error *err);
/* Makes the document what it was then, as an edit by `user`. "conflict": it is that already, or cannot be led there. */
bool lum_document_revert(struct lum_document *doc, const char *user, uint64_t rev, struct lum_changes *ret_changes,
                         struct lum_proto_error *err);

struct lum_moment_name {
    uint64_t rev; /* the moment's own: that of an edit that was taken back stands for the one before it */
    char name[LUM_LIMIT_MOMENT_NAME_BYTES + 1], by[LUM_LIMIT_ID_BYTES + 1];
};
/* Gives the moment a name, in place of the one that it had (*ret_was, which may be NULL); "": takes it away. No edit:
 * there is no revision of it. */
bool lum_document_name_moment(struct lum_document *doc, const char *user, uint64_t rev, const char *name,
                              struct lum_moment_name *ret_was, struct lum_proto_error *err);
/* It has that name again. False: there is no such moment any more. */
bool lum_document_name_back(struct lum_document *doc, const struct lum_moment_name *was);

#endif
