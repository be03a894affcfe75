/* The document: the scene as records, with revisions, undo and redo. Pure data: no renderer, no socket.
 *
 * A transaction applies a list of ops all or nothing and yields the list of ids that changed, with the record before
 * and after; the server turns that list into renderer calls. The same list, reversed, is the undo. References are kept
 * whole: an object names an existing mesh and material, what is referred to cannot be removed.
 *
 * Thread: one (the director). */
#ifndef LUM_PROTOCOL_DOCUMENT_DOCUMENT_H
#define LUM_PROTOCOL_DOCUMENT_DOCUMENT_H

#include "protocol/op/op.h"

struct lum_document;

struct lum_change {
    struct lum_record *before, *after; /* NULL before: added; NULL after: removed; owned references */
};
/* In an order that can be applied one by one: what is referred to comes before what refers, removals the other way. */
struct lum_changes {
    struct lum_change *changes;
    size_t n;
};
void lum_changes_finish(struct lum_changes *c);

struct lum_document *lum_document_create(void); /* holds the "render" record; NULL when memory is short */
void lum_document_destroy(struct lum_document *doc);

uint64_t lum_document_rev(const struct lum_document *doc);
const struct lum_record *lum_document_find(const struct lum_document *doc, const char *id);
/* Records of that type; LUM_RECORD_TYPE_COUNT: of all. */
size_t lum_document_count(const struct lum_document *doc, enum lum_record_type type);
/* There is no such record of that type (LUM_RECORD_TYPE_COUNT: of any): which are near, ": did you mean \"a\" or
 * \"b\"?", or else which there are, as far as that fits. Empty when there are none, or many types. */
void lum_document_nearest(const struct lum_document *doc, enum lum_record_type type, const char *id, char *ret_text,
                          size_t size);
/* What this patch names is there: a light, an object or a mixing group. */
bool lum_document_has_target(const struct lum_document *doc, const struct lum_record *patch);
/* Calls fn for each record, what is referred to before what refers, then by id. False: memory is short, nothing called.
 */
bool lum_document_each(const struct lum_document *doc, void (*fn)(void *user, const struct lum_record *r), void *user);

/* Applies ops as one transaction by `user`, who may undo it; "(...)" is the server itself, who does not. Import ops
 * must come expanded: children carries the records that an import op of this transaction made, in op order; setting an
 * import's transform later moves what is left of them. On success the revision grows by 1 and *ret_changes is filled
 * (the caller applies it, then frees it). On failure nothing changed; err->path names "ops/N/...". */
struct lum_import_children {
    lum_id import_id;
    struct lum_record **records; /* as the file has them. Borrowed: the document sets their origin and places copies */
    size_t n;
};
bool lum_document_apply(struct lum_document *doc, const char *user, const struct lum_ops *ops,
                        const struct lum_import_children *children, size_t n_children, struct lum_changes *ret_changes,
                        struct lum_proto_error *err);
/* Takes back what the last apply, undo or redo did, without a trace: for when the renderer refused the changes. */
void lum_document_rollback(struct lum_document *doc, const struct lum_changes *changes);

/* The user's own last transaction that is not undone yet. Fields that it did not touch keep later edits; where others
 * edited what it touched it fails with "conflict" and is forgotten, so that the next undo takes the one before. Each
 * undo or redo is a new revision. "not_found" when there is nothing to undo. */
bool lum_document_undo(struct lum_document *doc, const char *user, struct lum_changes *ret_changes,
                       struct lum_proto_error *err);
bool lum_document_redo(struct lum_document *doc, const char *user, struct lum_changes *ret_changes,
                       struct lum_proto_error *err);

/* The revision that the user's next undo would take back, or her next redo bring again; 0: there is none. */
uint64_t lum_document_next_undo(struct lum_document *doc, const char *user, bool redo);

/* The user will not come back: nothing of hers can be undone any more. Not between an edit and its rollback. */
void lum_document_forget_user(struct lum_document *doc, const char *user);

/* Ops that rebuild this document from nothing: {"ops":[...]} as scene.get gives them. Imported records appear as their
 * import op and, where they were edited since, as set or remove ops; expand: as add ops with bulk data elided. */
/* {"ops":[...]}; NULL when memory is short. */
struct cJSON *lum_document_to_json(const struct lum_document *doc, bool expand);

/* The same in parts, so that a caller can write it in slices: each gives at most one op, and the same one for as long
 * as it names the same records. */
enum lum_document_part_kind {
    LUM_PART_RECORD,   /* as it was added */
    LUM_PART_EXPANDED, /* as it is, for display */
    LUM_PART_EDIT,     /* of what an import made */
    LUM_PART_REMOVAL,  /* likewise */
    LUM_PART_SETTINGS,
};
struct lum_document_part {
    enum lum_document_part_kind kind;
    const struct lum_record *record;
    const struct lum_record *other;  /* EDIT: as it was made; SETTINGS: the camera, or NULL; else NULL */
    const struct lum_record *import; /* EDIT */
};
/* In their order; the records are borrowed from the document as it is now, the array is the caller's to free. False:
 * memory is short. */
bool lum_document_parts(const struct lum_document *doc, bool expand, struct lum_document_part **ret_parts,
                        size_t *ret_n);
/* Adds its op, if there is one, to an array. False: memory is short. */
bool lum_document_part_write(const struct lum_document_part *part, struct cJSON *ops);

/* The ops that lead from before to after, for scene.changed notifications: bulk data is elided, and what an import
 * brings or takes, and the objects that it moves, are left to the import's own op. An array. */
struct cJSON *lum_changes_to_json(const struct lum_changes *c);

#endif
