/* Readable, unique ids made from the names in a file. */
#ifndef LUM_SERVER_IMPORTER_IDS_H
#define LUM_SERVER_IMPORTER_IDS_H

#include "core/base/base.h"
#include "protocol/record/record.h"

struct lum_ids {
    char prefix[LUM_LIMIT_ID_BYTES + 1]; /* the import's id and "/" */
    struct lum_id_slot *slots;
    uint32_t n_slots, n_used;
};
void lum_ids_init(struct lum_ids *ids, const char *import_id);
void lum_ids_finish(struct lum_ids *ids);

/* prefix + group + name, with characters outside [A-Za-z0-9_.:-] replaced by '_', shortened to LUM_LIMIT_ID_BYTES, and
 * "-2", "-3" appended when taken. name NULL or without a usable character: fallback and number. group: "" or "mesh/".
 */
struct lum_id_request {
    const char *group, *name, *fallback;
    uint32_t number;
};
LUM_MUST_USE enum lum_status lum_ids_make(struct lum_ids *ids, const struct lum_id_request *r, char *ret_id,
                                          struct lum_error *err);

/* An id that a scene had when it was written to a file: prefix + id, shortened by a number of its own where it is too
 * long, so that whatever refers to it finds it. False: it is none. */
bool lum_ids_again(const struct lum_ids *ids, const char *id, char *ret_id);
/* Is one given out, and with which number? */
bool lum_ids_find(const struct lum_ids *ids, const char *id, uint32_t *ret_number);
/* Gives it out, if nobody has it. */
LUM_MUST_USE enum lum_status lum_ids_take(struct lum_ids *ids, const char *id, uint32_t number, struct lum_error *err);

#endif
