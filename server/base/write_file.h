/* Writing a whole file at once. */
#ifndef LUM_SERVER_BASE_WRITE_FILE_H
#define LUM_SERVER_BASE_WRITE_FILE_H

#include <stddef.h>

#include "core/base/base.h"

/* Writes beside the target and renames, so that a reader never sees half a file. */
LUM_MUST_USE enum lum_status lum_write_file(const char *path, const void *bytes, size_t n, struct lum_error *err);

/* Can a file be made there? Asked before work whose result it is to get. */
LUM_MUST_USE enum lum_status lum_may_write_file(const char *path, struct lum_error *err);

#endif
