/* The transform of an import, applied to what it brought: objects, lights and cameras; all else is where it is used.
 * Private to protocol/. */
#ifndef LUM_PROTOCOL_DOCUMENT_IMPORT_TRANSFORM_H
#define LUM_PROTOCOL_DOCUMENT_IMPORT_TRANSFORM_H

#include "protocol/base/error.h"
#include "protocol/record/record.h"

/* `local` as the model file has it, transformed: a copy, or another reference to local when the transform does not
 * concern it. NULL: refused (it would lie outside the limits, or memory is short), and err says why. */
struct lum_record *lum_import_apply_transform(const struct lum_record_transform *to, struct lum_record *local,
                                              struct lum_proto_error *err);

struct lum_import_move {
    const struct lum_record_transform *from, *to;
};
/* `now` is what became of `local` since move->from was applied. What was not edited is transformed from `local` anew,
 * so that moving to and fro ends on the same bits; what was edited moves along with the rest. */
struct lum_record *lum_import_reapply_transform(const struct lum_import_move *move, struct lum_record *local,
                                                struct lum_record *now, struct lum_proto_error *err);

#endif
