/* Ops that need the importer made ready to apply: an import op gets its children, an image op with an asset gets its
 * pixels, a light op with one its web, and so does a set of one. Blocking, up to minutes: the daemon does it on an
 * import thread. */
#ifndef LUM_SERVER_IMPORT_EXPAND_H
#define LUM_SERVER_IMPORT_EXPAND_H

#include "protocol/document/document.h"
#include "server/import/import.h"

struct lum_expansion {
    struct lum_import_children *children; /* of the import ops, in op order */
    size_t n;
    char (*warnings)[256];
    size_t n_warnings;
    struct cJSON *settings; /* of the last import, for a scene of nothing else; NULL: none. Owned */
};
void lum_expansion_finish(struct lum_expansion *e);

bool lum_ops_need_import(const struct lum_ops *ops);

struct lum_expand_context {
    const struct lum_import_config *config;
    void (*progress)(void *user, const char *id, const char *stage,
                     double fraction); /* may be NULL; the calling thread */
    void *user;
    const _Atomic bool *cancel; /* may be NULL */
};
/* Replaces image and light records of ops by ones that are read. On failure err->path names the op. */
bool lum_ops_expand(const struct lum_expand_context *context, struct lum_ops *ops, struct lum_expansion *ret_expansion,
                    struct lum_proto_error *err);

#endif
