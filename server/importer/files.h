/* The importer's only way to a file: it asks its parent, over a socket, for one below the asset's directory and gets an
 * open descriptor back. So the sandbox forbids opening altogether, and even code injected into this process reaches
 * nothing else. What is said on it: server/import/wire.h. */
#ifndef LUM_SERVER_IMPORTER_FILES_H
#define LUM_SERVER_IMPORTER_FILES_H

#include "core/base/base.h"
#include "server/import/wire.h"
#include "server/importer/bytes.h"

struct lum_files {
    int socket; /* -1: every file is not found */
};

/* Reads the whole file; lum_free(ret_bytes->data). A 0 byte follows the data. */
LUM_MUST_USE enum lum_status lum_files_read(const struct lum_files *files, const char *name, unsigned flags,
                                            struct lum_bytes *ret_bytes, struct lum_error *err);

#endif
