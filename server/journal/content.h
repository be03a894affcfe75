/* Content: what importers made of model and image files, in files named by the SHA-256 of their bytes. Neither the
 * importer nor the model file is needed again. Written once, never changed; what nothing refers to any more is removed
 * by the journal (journal.c). And the form of one record in a block, which snapshots share. */
#ifndef LUM_SERVER_JOURNAL_CONTENT_H
#define LUM_SERVER_JOURNAL_CONTENT_H

#include "protocol/base/error.h"
#include "protocol/record/record.h"
#include "server/journal/block.h"

#define LUM_SHA_BYTES 64 /* of its hexadecimal text */
typedef char lum_sha[LUM_SHA_BYTES + 1];
bool lum_sha_is(const char *text);

struct lum_record_list { /* a list of owned references; a lost one is NULL */
    struct lum_record **records;
    size_t n;
};
void lum_record_list_finish(struct lum_record_list *r);

/* Told of what is damaged: one line without a full stop. Where memory is short, or the disk does not give what it has,
 * nothing is damaged, and what was read is no good: `unread` (may be NULL) is set, if it is not yet. */
struct lum_damage_sink {
    void (*tell)(void *user, const char *text);
    void *user;
    struct lum_error *unread;
};
void lum_damage_no_memory(const struct lum_damage_sink *sink);
/* Set it where this error is of memory or the disk. */
void lum_damage_unread(const struct lum_damage_sink *sink, const struct lum_error *err);
void lum_damage_note(const struct lum_damage_sink *sink, const struct lum_proto_error *err);
void lum_damage(const struct lum_damage_sink *sink, const char *fmt, ...) LUM_PRINTF(2, 3);

/* Writes the records into the folder, synced, in place of what has the name already: it may be damaged. Thread: any,
 * several at once. */
LUM_MUST_USE enum lum_status lum_content_write(const struct lum_dir *content, struct lum_record *const *records,
                                               size_t n, lum_sha ret_sha, struct lum_error *err);
/* Damaged records are told, and NULL in the list; an error only where nothing can be read. */
LUM_MUST_USE enum lum_status lum_content_read(const struct lum_dir *content, const char *sha,
                                              const struct lum_damage_sink *damage, struct lum_record_list *ret_records,
                                              struct lum_error *err);
/* Do the bytes of the file give its name? */
LUM_MUST_USE enum lum_status lum_content_check(const struct lum_dir *content, const char *sha, struct lum_error *err);

/* {"op":..., "origin"?, "asset"?}: the record but for its blobs, which are borrowed from it. NULL: memory is short. */
struct cJSON *lum_stored_record(const struct lum_record *r, struct lum_blobs_out *ret_blobs);
/* Checked like what a client sends. NULL: it is none, and err says why. */
struct lum_record *lum_stored_record_read(const struct lum_block *f, struct lum_proto_error *err);

#endif
