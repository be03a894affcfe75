/* What a journal keeps of one edit, and doing it again.
 *
 * - {"do":"apply","user":"ann.3-1","op_id":"a1","undo_group":"","ops":[...],"content":{"room":"SHA-256"}}
 * - {"do":"undo","user":"ann.3-1","op_id":"a2","of":7}: the step that it took back made revision 7; "redo": that it
 * brought again
 * - {"do":"drop","user":"ann.3-1","op_id":"a3","of":7}: that undo found a conflict, and forgot the step; "redrop": a
 * redo did. "of":0: there was no step, and all that is kept is that op_id was refused
 * - {"do":"revert","user":"ann.3-1","op_id":"a4","of":7}: back to what was at revision 7
 * - {"do":"name","user":"ann.3-1","of":7,"name":"before lunch"}: that moment has this name; "": none
 * - {"do":"forget","user":"ann.3-1"}: she left
 *
 * "at", of each: when, in ms of the Unix epoch. "ops" are those of scene files and replays. A document is a function of
 * the entries in their order, histories included, so that doing them again from a snapshot on gives the same document.
 */
#ifndef LUM_SERVER_JOURNAL_ENTRY_H
#define LUM_SERVER_JOURNAL_ENTRY_H

#include "server/journal/snapshot.h"

enum lum_entry_kind {
    LUM_ENTRY_APPLY,
    LUM_ENTRY_UNDO,
    LUM_ENTRY_REDO,
    LUM_ENTRY_DROP,
    LUM_ENTRY_REDROP,
    LUM_ENTRY_FORGET,
    LUM_ENTRY_REVERT,
    LUM_ENTRY_NAME,
};

struct lum_entry_content {
    lum_id id; /* of the op */
    lum_sha sha;
};
struct lum_entry {
    struct lum_entry *next;
    uint64_t seq, rev; /* rev: of the document after it */
    enum lum_entry_kind kind;
    char user[LUM_LIMIT_ID_BYTES + 1], op_id[LUM_LIMIT_ID_BYTES + 1];
    lum_id undo_group;
    int64_t at_ms; /* of the Unix epoch; 0: not known */
    uint64_t of;   /* undo, redo, drop, redrop, revert, name */
    char name[LUM_LIMIT_MOMENT_NAME_BYTES + 1];
    struct cJSON *ops;                 /* apply: an array, owned */
    size_t n_bytes;                    /* of the ops' text, about */
    struct lum_entry_content *content; /* owned: of import ops, and of image ops with an asset */
    size_t n_content;
};
struct lum_entry *lum_entry_create(enum lum_entry_kind kind, const char *user); /* NULL: memory is short */
void lum_entry_destroy(struct lum_entry *e);                                    /* accepts NULL */

void lum_entries_destroy(struct lum_entry *first); /* and all that follow it */

/* Consumes the ops of the entry. */
struct cJSON *lum_entry_to_json(struct lum_entry *e);

/* Does the entry of this block again. False: it cannot be done, the document is as it was but for its revision, and why
 * says why. */
struct lum_replay {
    struct lum_document *doc;
    const struct lum_dir *content;
    const struct lum_damage_sink *damage; /* of content */
    struct lum_kept_list *kept;           /* content that it reads is added */
    struct lum_done_user **done;          /* what it did is noted */
};
bool lum_entry_replay(const struct lum_replay *replay, const struct lum_block *f, char ret_why[256]);

#endif
