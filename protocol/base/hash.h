/* A hash table of what the caller owns: open addressing with linear probing, at most half full. Inserting after
 * lum_hash_reserve, and erasing, allocate nothing, so that what is half done can always be taken back. */
#ifndef LUM_PROTOCOL_BASE_HASH_H
#define LUM_PROTOCOL_BASE_HASH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct lum_hash_slot {
    void *item; /* borrowed; NULL: free */
    uint64_t hash;
    size_t value; /* the caller's; 0 when inserted */
};

struct lum_hash {
    struct lum_hash_slot *slots;
    size_t capacity, n; /* capacity: 0 or a power of two, at least twice n */
};
void lum_hash_finish(struct lum_hash *h);
bool lum_hash_reserve(struct lum_hash *h, size_t n_more); /* false: memory is short, and nothing is changed */

/* True: the item is what the key stands for. */
typedef bool (*lum_hash_is)(const void *item, const void *key);
/* NULL: none. The slot is valid until something is inserted, erased or reserved. */
struct lum_hash_slot *lum_hash_find(const struct lum_hash *h, uint64_t hash, lum_hash_is is, const void *key);
/* There is room, and no such item yet. */
struct lum_hash_slot *lum_hash_insert(struct lum_hash *h, uint64_t hash, void *item);
void lum_hash_erase(struct lum_hash *h, struct lum_hash_slot *slot);

/* ---- items that are their own keys, by their address ---- */

uint64_t lum_hash_of_pointer(const void *item);
struct lum_hash_slot *lum_hash_find_pointer(const struct lum_hash *h, const void *item);
/* The slot that it has, or gets now. There is room. */
struct lum_hash_slot *lum_hash_put_pointer(struct lum_hash *h, const void *item);

#endif
