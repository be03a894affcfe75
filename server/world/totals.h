/* What a scene takes as a whole. Each mesh and each image has its limit; these are for all of them together, and are
 * looked at before the renderer makes anything of an edit. */
#ifndef LUM_SERVER_WORLD_TOTALS_H
#define LUM_SERVER_WORLD_TOTALS_H

#include "core/base/base.h"
#include "protocol/document/document.h"

struct lum_totals {
    uint64_t triangles, texels;
    uint64_t bytes; /* of records with their arrays, and about what the renderer makes of them */
};
struct lum_totals lum_totals_of(const struct lum_record *r); /* zeros of NULL */
struct lum_totals lum_totals_sum(struct lum_totals a, struct lum_totals b);
struct lum_totals lum_totals_limits(void); /* of limits.h, as far as the machine has the memory */

/* inout_totals after the changes. Refused where one grows over its limit: *ret_failed is the change that leads over it,
 * err names its field, the total and the limit, and inout_totals stays. */
LUM_MUST_USE enum lum_status lum_totals_change(struct lum_totals *inout_totals, const struct lum_totals *limits,
                                               const struct lum_changes *changes, size_t *ret_failed,
                                               struct lum_error *err);
/* Of records that come one after the other, before anything is made of them. */
struct lum_totals_guard {
    struct lum_totals totals, limits;
};
/* For what comes with ops: beside what is there less all that they may take away. */
struct lum_totals_guard lum_totals_guard_of(const struct lum_totals *totals, const struct lum_totals *limits,
                                            const struct lum_document *doc, const struct lum_ops *ops);
/* As lum_import_config.admit, of a guard: adds the record, or refuses it. */
bool lum_totals_admit(void *guard, const struct lum_record *r, struct lum_proto_error *err);

void lum_totals_take_back(struct lum_totals *totals, const struct lum_changes *changes);

#endif
