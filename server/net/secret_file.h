/* Files of secrets, which others may not read: tokens, keys. */
#ifndef LUM_SERVER_NET_SECRET_FILE_H
#define LUM_SERVER_NET_SECRET_FILE_H

#include <stddef.h>

#include "core/base/base.h"

/* Who may use it, beside its owner; one that others may use is refused. A file of root may always be read by the group
 * of root: that is root; and it is how the copies show that systemd makes for one service (LoadCredential), which alone
 * has an entry in their access lists. */
enum lum_file_readers {
    LUM_FILE_OF_OWNER,
    LUM_FILE_OF_OWNER_OR_ROOTS_GROUP, /* a file of root may be read by its group: as Debian keeps keys, for ssl-cert */
    LUM_FILE_OF_ALL,                  /* it is no secret */
};

/* Reads at most size - 1 bytes of the file, and ends them with a zero.
 * option: of the command line, for messages. *ret_n: how many bytes were read; size - 1: there may be more. */
LUM_MUST_USE enum lum_status lum_secret_file_read(enum lum_file_readers readers, const char *option, const char *path,
                                                  char *out, size_t size, size_t *ret_n, struct lum_error *err);

#endif
