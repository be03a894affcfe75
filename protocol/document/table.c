#include "protocol/document/table.h"

#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "protocol/record/field.h"

/* ---- SipHash-1-3 (Aumasson and Bernstein 2012): unpredictable to who does not know the key ---- */

static uint64_t rotate(uint64_t v, unsigned k)
{
    return v << k | v >> (64 - k);
}

static void sip_round(uint64_t v[4])
{
    v[0] += v[1];
    v[1] = rotate(v[1], 13) ^ v[0];
    v[0] = rotate(v[0], 32);
    v[2] += v[3];
    v[3] = rotate(v[3], 16) ^ v[2];
    v[0] += v[3];
    v[3] = rotate(v[3], 21) ^ v[0];
    v[2] += v[1];
    v[1] = rotate(v[1], 17) ^ v[2];
    v[2] = rotate(v[2], 32);
}

static uint64_t hash_id(const uint64_t key[2], const char *id)
{
    uint64_t v[4] = {key[0] ^ 0x736f6d6570736575u, key[1] ^ 0x646f72616e646f6du, key[0] ^ 0x6c7967656e657261u,
                     key[1] ^ 0x7465646279746573u};
    size_t n = strlen(id);
    for (size_t at = 0; at <= n; at += 8) {
        uint64_t m = 0;
        size_t left = n - at;
        memcpy(&m, id + at, left < 8 ? left : 8);
        if (left < 8)
            m |= (uint64_t)n << 56;
        v[3] ^= m;
        sip_round(v);
        v[0] ^= m;
    }
    v[2] ^= 0xff;
    for (int i = 0; i < 3; i++)
        sip_round(v);
    return v[0] ^ v[1] ^ v[2] ^ v[3];
}

/* ---- records ---- */

void lum_table_init(struct lum_table *t)
{
    memset(t, 0, sizeof *t);
    /* without entropy the key stays 0: correct, only open to crafted ids */
    if (getrandom(t->key, sizeof t->key, GRND_NONBLOCK) != (ssize_t)sizeof t->key)
        memset(t->key, 0, sizeof t->key);
}

void lum_table_finish(struct lum_table *t)
{
    for (size_t i = 0; i < t->records.capacity; i++)
        lum_record_unref(lum_table_at(t, i));
    lum_hash_finish(&t->records);
    memset(t, 0, sizeof *t);
}

bool lum_table_reserve(struct lum_table *t, size_t n_more)
{
    return lum_hash_reserve(&t->records, n_more);
}

uint64_t lum_table_hash(const struct lum_table *t, const char *id)
{
    return hash_id(t->key, id);
}

static bool has_id(const void *record, const void *id)
{
    return strcmp(((const struct lum_record *)record)->id, id) == 0;
}

static struct lum_hash_slot *find(const struct lum_table *t, const char *id)
{
    return lum_hash_find(&t->records, hash_id(t->key, id), has_id, id);
}

struct lum_record *lum_table_find(const struct lum_table *t, const char *id)
{
    const struct lum_hash_slot *slot = find(t, id);
    return slot ? slot->item : NULL;
}

bool lum_table_is_used(const struct lum_table *t, const char *id)
{
    return find(t, id)->value > 0;
}

/* ---- references ---- */

static bool add_user(void *user, enum lum_record_type type, const char *id, const char *path)
{
    (void)type;
    (void)path;
    find(user, id)->value++;
    return true;
}

static bool drop_user(void *user, enum lum_record_type type, const char *id, const char *path)
{
    (void)type;
    (void)path;
    find(user, id)->value--;
    return true;
}

void lum_table_change(struct lum_table *t, const struct lum_record *before, struct lum_record *after)
{
    if (before)
        lum_record_each_ref(before, drop_user, t);
    struct lum_hash_slot *slot = before ? find(t, before->id) : NULL;
    struct lum_record *former = slot ? slot->item : NULL;
    if (after)
        t->n_of_type[lum_record_ref(after)->type]++;
    if (former)
        t->n_of_type[former->type]--;
    if (slot && after)
        slot->item = after;
    else if (slot)
        lum_hash_erase(&t->records, slot);
    else
        lum_hash_insert(&t->records, lum_table_hash(t, after->id), after);
    lum_record_unref(former);
    if (after)
        lum_record_each_ref(after, add_user, t);
}

/* ---- order ---- */

int lum_record_rank(enum lum_record_type type)
{
    static const int ranks[LUM_RECORD_TYPE_COUNT] = {
        [LUM_RECORD_RENDER] = 0,   [LUM_RECORD_IMPORT] = 1, [LUM_RECORD_IMAGE] = 2,  [LUM_RECORD_MESH] = 3,
        [LUM_RECORD_MATERIAL] = 4, [LUM_RECORD_OBJECT] = 5, [LUM_RECORD_LIGHT] = 6,  [LUM_RECORD_MEDIUM] = 7,
        [LUM_RECORD_CAMERA] = 8,   [LUM_RECORD_SENSOR] = 9, [LUM_RECORD_PATCH] = 10, [LUM_RECORD_PRESET] = 11,
    };
    return ranks[type];
}

int lum_record_order(const struct lum_record *a, const struct lum_record *b)
{
    int d = lum_record_rank(a->type) - lum_record_rank(b->type);
    return d ? d : strcmp(a->id, b->id);
}

static int by_order(const void *a, const void *b)
{
    return lum_record_order(*(const struct lum_record *const *)a, *(const struct lum_record *const *)b);
}

bool lum_table_sorted(const struct lum_table *t, const struct lum_record ***ret_records)
{
    const struct lum_record **records = calloc(t->records.n ? t->records.n : 1, sizeof(*records));
    size_t n = 0;
    if (!records)
        return false;
    for (size_t i = 0; i < t->records.capacity; i++)
        if (lum_table_at(t, i))
            records[n++] = lum_table_at(t, i);
    qsort(records, n, sizeof(*records), by_order);
    *ret_records = records;
    return true;
}
