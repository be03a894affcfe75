/* Where an import puts what it brought: objects, lights and cameras are mapped by the import's transform, all else has no
 * place. Private to protocol/. */
#ifndef LUM_PROTOCOL_DOCUMENT_IMPORT_TRANSFORM_H
#define LUM_PROTOCOL_DOCUMENT_IMPORT_TRANSFORM_H

#include "protocol/base/error.h"
#include "protocol/record/record.h"

/* `local` as the model file has it, placed: a copy, or another reference to local when it has no place. NULL: refused
 * (it would lie outside the limits, or memory is short), and err says why. */
struct lum_record *lum_place(const struct lum_record_transform *to, struct lum_record *local, struct lum_proto_error *err);

struct lum_move {
    const struct lum_record_transform *from, *to;
};
/* `now` is what became of `local` since it was placed by move->from. What was not edited is placed from `local` anew, so
 * that moving to and fro ends on the same bits; what was edited moves along with the rest. */
struct lum_record *lum_place_again(const struct lum_move *move, struct lum_record *local, struct lum_record *now,
                                   struct lum_proto_error *err);

#endif
