/* Writing a whole file at once. */
#ifndef LUM_SERVER_BASE_WRITE_FILE_H
#define LUM_SERVER_BASE_WRITE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "core/base/base.h"

/* Writes beside the target and renames, so that a reader never sees half a file. */
LUM_MUST_USE enum lum_status lum_write_file(const char *path, const void *bytes, size_t n, struct lum_error *err);

/* The same in pieces. What is no plain file (a pipe, /dev/stdout) is written itself. Whatever becomes of `out` is told
 * by lum_part_close. */
struct lum_part_file {
    FILE *out;
    const char *path; /* of the caller */
    char *part;       /* beside it; NULL: path itself is written */
};
LUM_MUST_USE enum lum_status lum_part_open(const char *path, struct lum_part_file *ret_file, struct lum_error *err);
/* Puts it in place, synced; or, where keep is false or that fails, leaves everything as it was. */
LUM_MUST_USE enum lum_status lum_part_close(struct lum_part_file *file, bool keep, struct lum_error *err);

/* Can a file be made there? Asked before work whose result it is to get. */
LUM_MUST_USE enum lum_status lum_may_write_file(const char *path, struct lum_error *err);

#endif
