/* Files that only their owner may read: of tokens. */
#ifndef LUM_SERVER_NET_SECRET_FILE_H
#define LUM_SERVER_NET_SECRET_FILE_H

#include <stddef.h>

#include "core/base/base.h"

/* Reads at most size - 1 bytes of the file, and ends them with a zero. Refuses one that others than its owner may use.
 * option: of the command line, for messages. *ret_n: how many bytes were read; size - 1: there may be more. */
LUM_MUST_USE enum lum_status lum_secret_file_read(const char *option, const char *path, char *out, size_t size,
                                                  size_t *ret_n, struct lum_error *err);

#endif
