/* The parent's side of one run of lumend-import: starting it, handing it files, reading its stream under limits, and
 * saying how it ended. */
#ifndef LUM_SERVER_IMPORT_CHILD_H
#define LUM_SERVER_IMPORT_CHILD_H

#include "server/import/import.h"
#include "server/import/wire.h"

struct lum_import_run {
    const char *importer; /* path of lumend-import */
    const char *assets_dir;
    const char *kind; /* "model", "image" or "web" */
    const char *asset, *id;
    uint32_t cpu_s;
    const _Atomic bool *cancel; /* may be NULL */
    const struct lum_log *log;
    /* Called for each op, blob, progress and warning chunk. Of LUM_CHUNK_BLOB bytes are an array as in bulk.h, the
     * callee's when it returns true. False stops the run; the callee has filled err. */
    bool (*chunk)(void *user, enum lum_import_chunk kind, uint8_t *bytes, size_t n_bytes, struct lum_proto_error *err);
    void *user;
};
/* Blocking. True when the child sent `done` and ended well. */
bool lum_import_run(const struct lum_import_run *run, struct lum_proto_error *err);

#endif
