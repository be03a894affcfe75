/* The records that a history holds on to, each counted once however many steps have it, and what an import made with
 * it. Private to protocol/.
 *
 * What is forgotten hangs on the sum, and journals do edits again: it depends on which records are one record, which
 * journals and snapshots keep, and on nothing else. So arrays that records share are counted with each of them. */
#ifndef LUM_PROTOCOL_DOCUMENT_HELD_H
#define LUM_PROTOCOL_DOCUMENT_HELD_H

#include "protocol/base/hash.h"
#include "protocol/document/document.h"

#define LUM_HELD_STEP_BYTES 256u /* of a step, beside its records */

struct lum_held {
    struct lum_hash records; /* value: how often */
    unsigned long long n_bytes;
};
void lum_held_finish(struct lum_held *h);

/* The records before and after. False: memory is short, and nothing was added. */
bool lum_held_add(struct lum_held *h, const struct lum_changes *c);
void lum_held_drop(struct lum_held *h, const struct lum_changes *c); /* what was added; its records still exist */

#endif
