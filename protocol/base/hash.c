#include "protocol/base/hash.h"

#include <stdlib.h>

void lum_hash_finish(struct lum_hash *h)
{
    free(h->slots);
    *h = (struct lum_hash){0};
}

struct lum_hash_slot *lum_hash_insert(struct lum_hash *h, uint64_t hash, void *item)
{
    size_t i = hash & (h->capacity - 1);
    while (h->slots[i].item)
        i = (i + 1) & (h->capacity - 1);
    h->slots[i] = (struct lum_hash_slot){.item = item, .hash = hash};
    h->n++;
    return &h->slots[i];
}

bool lum_hash_reserve(struct lum_hash *h, size_t n_more)
{
    struct lum_hash grown = {.capacity = h->capacity ? h->capacity : 16};
    while (grown.capacity < 2 * (h->n + n_more))
        grown.capacity *= 2;
    if (grown.capacity == h->capacity)
        return true;
    grown.slots = calloc(grown.capacity, sizeof *grown.slots);
    if (!grown.slots)
        return false;
    for (size_t i = 0; i < h->capacity; i++)
        if (h->slots[i].item)
            lum_hash_insert(&grown, h->slots[i].hash, h->slots[i].item)->value = h->slots[i].value;
    free(h->slots);
    *h = grown;
    return true;
}

struct lum_hash_slot *lum_hash_find(const struct lum_hash *h, uint64_t hash, lum_hash_is is, const void *key)
{
    size_t mask = h->capacity - 1;
    for (size_t i = hash & mask; h->n > 0 && h->slots[i].item; i = (i + 1) & mask)
        if (h->slots[i].hash == hash && is(h->slots[i].item, key))
            return &h->slots[i];
    return NULL;
}

/* Closes the gap, so that no probe ends early (Knuth vol. 3, 6.4 R). */
void lum_hash_erase(struct lum_hash *h, struct lum_hash_slot *slot)
{
    size_t mask = h->capacity - 1, gap = (size_t)(slot - h->slots);
    h->n--;
    for (size_t i = (gap + 1) & mask; h->slots[i].item; i = (i + 1) & mask)
        if (((i - h->slots[i].hash) & mask) >= ((i - gap) & mask)) {
            h->slots[gap] = h->slots[i];
            gap = i;
        }
    h->slots[gap] = (struct lum_hash_slot){0};
}

/* Fibonacci hashing (Knuth vol. 3, 6.4): all bits of an address, whose last ones are 0, reach the last ones here. */
uint64_t lum_hash_of_pointer(const void *item)
{
    uint64_t h = (uint64_t)(uintptr_t)item * 0x9e3779b97f4a7c15u;
    return h ^ h >> 32;
}

static bool is_itself(const void *item, const void *key)
{
    return item == key;
}

struct lum_hash_slot *lum_hash_find_pointer(const struct lum_hash *h, const void *item)
{
    return lum_hash_find(h, lum_hash_of_pointer(item), is_itself, item);
}

struct lum_hash_slot *lum_hash_put_pointer(struct lum_hash *h, const void *item)
{
    struct lum_hash_slot *slot = lum_hash_find_pointer(h, item);
    return slot ? slot : lum_hash_insert(h, lum_hash_of_pointer(item), (void *)(uintptr_t)item);
}
