/* What there is below the asset root, for who chooses from it: plain files, by their names. Symbolic links are not
 * followed, and names that begin with a dot, or that no asset can have, are left out. */
#ifndef LUM_SERVER_IMPORT_ASSET_LIST_H
#define LUM_SERVER_IMPORT_ASSET_LIST_H

#include <stdatomic.h>

#include "core/base/base.h"
#include "protocol/base/limits.h"

struct lum_asset_entry {
    char name[LUM_LIMIT_ASSET_BYTES + 1]; /* below the root, '/' separated */
    uint64_t n_bytes;
};
struct lum_asset_list {
    struct lum_asset_entry *entries; /* by name */
    size_t n;
    bool whole; /* false: a limit was met, and there may be more */
};
void lum_asset_list_finish(struct lum_asset_list *list);

/* Files whose name is `wanted`, and has `match` in its path in whatever case ("": any). uploads: the root of what
 * people sent. Either may be NULL. *cancel (may be NULL) true: what was found until then. Blocking: a disk may be slow.
 * LUM_ERR_NOMEM, LUM_ERR_IO: the root cannot be read. */
LUM_MUST_USE enum lum_status lum_asset_list(const char *root, const char *uploads, bool (*wanted)(const char *name),
                                            const char *match, const _Atomic bool *cancel,
                                            struct lum_asset_list *ret_list);

#endif
