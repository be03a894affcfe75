/* The records of a document by id, with a count of who refers to each. Private to protocol/.
 *
 * The hash is keyed, because ids are chosen by clients. Insertion after lum_table_reserve, replacement and removal
 * allocate nothing, so that a transaction can always be taken back. */
#ifndef LUM_PROTOCOL_DOCUMENT_TABLE_H
#define LUM_PROTOCOL_DOCUMENT_TABLE_H

#include "protocol/base/hash.h"
#include "protocol/record/record.h"

struct lum_table {
    struct lum_hash records; /* owned; value: references by other records */
    size_t n_of_type[LUM_RECORD_TYPE_COUNT];
    uint64_t key[2];
};

void lum_table_init(struct lum_table *t);
void lum_table_finish(struct lum_table *t);
bool lum_table_reserve(struct lum_table *t, size_t n_more); /* false: memory is short */

uint64_t lum_table_hash(const struct lum_table *t, const char *id);
struct lum_record *lum_table_find(const struct lum_table *t, const char *id); /* NULL: none */
bool lum_table_is_used(const struct lum_table *t, const char *id);            /* by another record. The id is there */
/* In no order, of places below records.capacity. NULL: none is there. */
static inline struct lum_record *lum_table_at(const struct lum_table *t, size_t place)
{
    return t->records.slots[place].item;
}

/* Puts after in place of before: NULL before inserts (reserve first), NULL after removes. What after refers to exists.
 * The table takes its own reference. */
void lum_table_change(struct lum_table *t, const struct lum_record *before, struct lum_record *after);

/* Dependencies first, then by id: an order that does not depend on history. The records are borrowed; the caller frees
 * the array. False: memory is short. */
bool lum_table_sorted(const struct lum_table *t, const struct lum_record ***ret_records);
/* Place of a type in that order, and whether a comes before b (below 0) or after it. */
int lum_record_rank(enum lum_record_type type);
int lum_record_order(const struct lum_record *a, const struct lum_record *b);

#endif
