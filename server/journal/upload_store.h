/* Files that people send: ROOT/upload/ID/NAME, where ID is made of names and bytes of all that came together, so that
 * who sends the same again gets the same. A folder appears under its ID only when all of it is on disk; nothing in it
 * is changed later. Below ROOT they have the names that assets have (asset.h). */
#ifndef LUM_SERVER_JOURNAL_UPLOAD_STORE_H
#define LUM_SERVER_JOURNAL_UPLOAD_STORE_H

#include "protocol/base/limits.h"
#include "server/import/asset.h"
#include "server/journal/disk.h"

typedef char lum_upload_id[LUM_UPLOAD_ID_BYTES + 1];

struct lum_upload_file {
    char name[LUM_LIMIT_UPLOAD_NAME_BYTES + 1]; /* below the folder of its upload, '/' separated */
    uint64_t n_bytes;
};
/* UTF-8 without control characters and backslashes; no part empty, or with a dot before it. */
bool lum_upload_name_is(const char *name);

struct evp_md_st;

struct lum_upload_store {
    struct lum_dir dir;
    struct evp_md_st *sha; /* fetched when it is opened: where memory is short then, OpenSSL never tries again */
    uint64_t n_bytes;      /* that lay there when it was opened */
    _Atomic uint64_t n_made;
};
/* Removes what was cut off. */
LUM_MUST_USE enum lum_status lum_upload_store_open(const char *root, const struct lum_disk *disk,
                                                   struct lum_upload_store *ret_store, struct lum_error *err);
void lum_upload_store_close(struct lum_upload_store *store);

/* A root of its own, for as long as the daemon runs; in $TMPDIR, or /tmp. Making one removes those that daemons of this
 * user left when they were killed. */
struct lum_upload_root {
    char path[4096];
    int fd; /* private: holds it */
};
LUM_MUST_USE enum lum_status lum_upload_root_make(struct lum_upload_root *ret_root, struct lum_error *err);
void lum_upload_root_remove(struct lum_upload_root *root);

/* One upload on its way to disk. Blocking; several at once, each on one thread. files are borrowed, no two of them have
 * one name. */
struct lum_upload_writer;
LUM_MUST_USE enum lum_status lum_upload_writer_create(struct lum_upload_store *store,
                                                      const struct lum_upload_file *files, size_t n_files,
                                                      struct lum_upload_writer **ret_writer, struct lum_error *err);
/* The next bytes, of all files one after the other. LUM_ERR_INVALID: there are more than was said. */
LUM_MUST_USE enum lum_status lum_upload_write(struct lum_upload_writer *w, const void *bytes, size_t n,
                                              struct lum_error *err);
/* All is there, and on disk. *ret_known: it was before. LUM_ERR_INVALID: bytes are missing. */
LUM_MUST_USE enum lum_status lum_upload_finish(struct lum_upload_writer *w, lum_upload_id ret_id, bool *ret_known,
                                               struct lum_error *err);
void lum_upload_writer_destroy(struct lum_upload_writer *w); /* removes what was not finished; accepts NULL */

#endif
