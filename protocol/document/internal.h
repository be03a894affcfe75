/* Inside of struct lum_document, shared by document.c, transaction.c, history.c, undo.c, state.c, targets.c
 * and document_json.c. */
#ifndef LUM_PROTOCOL_DOCUMENT_INTERNAL_H
#define LUM_PROTOCOL_DOCUMENT_INTERNAL_H

#include "protocol/base/hash.h"
#include "protocol/document/document.h"
#include "protocol/document/held.h"
#include "protocol/document/past.h"
#include "protocol/document/state.h"
#include "protocol/document/table.h"

/* ---- a transaction while it runs (transaction.c) ---- */

/* Each step is applied to the table at once. The log keeps what stood before the first step of an id and what stands
 * after its last: a transaction holds two records of each, however many steps it takes. On failure it is taken back. */
struct lum_step {
    struct lum_change change; /* owned references; both the same, or NULL: nothing came of it */
    lum_id id;
};
struct lum_txn {
    struct lum_document *doc;
    struct lum_step *log; /* in the order of their first steps */
    size_t n, capacity;
    struct lum_hash by_id;     /* of steps in log */
    struct lum_record *moving; /* an import as it stood before the run of sets that has come to here, or NULL; owned */
    size_t n_moved;            /* records that imports have moved */
    struct lum_proto_error *err;
};
/* One step: checks references, limits and use, then changes the table. before is the record that stands there now, or
 * NULL; after passes no reference. */
bool lum_txn_step(struct lum_txn *t, struct lum_record *before, struct lum_record *after);
void lum_txn_rollback(struct lum_txn *t); /* undoes all steps and frees what the transaction holds */
/* The net effect of all steps, sorted; frees the log. On failure everything is taken back. */
bool lum_txn_end(struct lum_txn *t, struct lum_changes *ret_changes);
void lum_changes_sort(struct lum_changes *c); /* to an order that can be walked, or gone back */

/* ---- targets of patches (targets.c) ---- */

struct lum_target {
    const struct lum_record *patch;
    bool there; /* what it names */
};
/* Sorts them, and finds out for each. */
void lum_targets_find(const struct lum_document *doc, struct lum_target *targets, size_t n);
/* Patches may come before what they name, or outlive it; one that is set to what is not there at the end is a slip:
 * *ret_patch. */
bool lum_targets_check(const struct lum_txn *t, const struct lum_record **ret_patch);

/* ---- history (history.c) ---- */

struct lum_history_entry {
    struct lum_history_entry *next; /* older */
    struct lum_changes changes;
    lum_id group; /* lum_ops.undo_group */
    uint64_t rev; /* that it made; of a drag, the last of them */
};
struct lum_history {
    struct lum_history *next; /* used less recently */
    char user[LUM_LIMIT_ID_BYTES + 1];
    struct lum_history_entry *undo, *redo; /* newest first */
    struct lum_held held;                  /* by all of them, and by the entry of the last action */
};
enum lum_action { LUM_ACTION_NONE, LUM_ACTION_APPLY, LUM_ACTION_UNDO, LUM_ACTION_REDO };

/* The last action reaches the history only when the next one begins: until then rollback can forget it without a trace,
 * and settling cannot fail because it only moves list entries. */
struct lum_last_action {
    enum lum_action action;
    struct lum_history *history;     /* NULL: of the server itself, who undoes nothing */
    struct lum_history_entry *entry; /* apply: owned; else the head of a list of history. NULL: history is */
};

/* ---- what was ---- */

struct lum_past {
    bool kept;
    struct lum_moment first;   /* has no changes */
    struct lum_moment **steps; /* owned; that follow it, the newest last */
    size_t n, capacity;
    struct lum_held held; /* by all of them */
    int64_t now_ms;
};
struct lum_past_edit {
    const char *user, *group;
    enum lum_past_did did;
    uint64_t to; /* revert */
};
void lum_past_finish(struct lum_past *p);
/* Takes note of what made this revision. Without memory all moments but now are forgotten: an edit never fails for it.
 */
void lum_past_note(struct lum_document *doc, const struct lum_past_edit *edit, const struct lum_changes *changes);
/* The revision above this one was taken back. */
void lum_past_take_back(struct lum_document *doc, const struct lum_changes *changes);
bool lum_past_take_state(const struct lum_document *doc, struct lum_past_state *ret); /* both false: memory is short */
bool lum_past_put_state(struct lum_document *doc, const struct lum_past_state *s);

struct lum_document {
    struct lum_table table;
    uint64_t rev;
    bool replays;                  /* lum_document_replay */
    struct lum_history *histories; /* most recently used first */
    struct lum_last_action last;
    struct lum_past past;
};

void lum_history_settle(struct lum_document *doc);
/* Takes note of an applied transaction; it becomes pending. False: memory is short. */
bool lum_history_note(struct lum_document *doc, const char *user, const char *group, const struct lum_changes *changes);
void lum_history_finish(struct lum_document *doc);
struct lum_history *lum_history_find(struct lum_document *doc, const char *user); /* moved to the front; NULL: none */
/* A step along the changes, in no list yet. NULL: memory is short. */
struct lum_history_entry *lum_history_entry_create(struct lum_history *h, const struct lum_changes *changes,
                                                   const char *group, uint64_t rev);
void lum_history_push(struct lum_history_entry **list, struct lum_history_entry *e); /* of the same history */
void lum_history_drop(struct lum_history *h, struct lum_history_entry **link);
bool lum_changes_copy(const struct lum_changes *from, struct lum_changes *ret); /* false: memory is short */

#endif
