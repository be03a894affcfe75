#include "protocol/document/held.h"

#include <stdlib.h>
#include <string.h>

void lum_held_finish(struct lum_held *h)
{
    free(h->slots);
    *h = (struct lum_held){0};
}

/* ---- slots, as in table.c ---- */

static size_t home_of(const struct lum_held *h, const struct lum_record *r)
{
    uint64_t hash = (uint64_t)(uintptr_t)r * 0x9e3779b97f4a7c15u;
    return (size_t)(hash >> 32) & (h->capacity - 1);
}

/* The record's slot, or a free one where it belongs. */
static struct lum_held_slot *slot_of(const struct lum_held *h, const struct lum_record *r)
{
    size_t i = home_of(h, r);
    while (h->slots[i].record && h->slots[i].record != r)
        i = (i + 1) & (h->capacity - 1);
    return &h->slots[i];
}

static bool reserve(struct lum_held *h, size_t n_more)
{
    struct lum_held grown = {.capacity = h->capacity ? h->capacity : 16, .n = h->n, .n_bytes = h->n_bytes};
    while (grown.capacity < 2 * (h->n + n_more))
        grown.capacity *= 2;
    if (grown.capacity == h->capacity)
        return true;
    grown.slots = calloc(grown.capacity, sizeof *grown.slots);
    if (!grown.slots)
        return false;
    for (size_t i = 0; i < h->capacity; i++)
        if (h->slots[i].record)
            *slot_of(&grown, h->slots[i].record) = h->slots[i];
    free(h->slots);
    *h = grown;
    return true;
}

static void erase(struct lum_held *h, struct lum_held_slot *slot)
{
    size_t mask = h->capacity - 1, gap = (size_t)(slot - h->slots);
    h->n--;
    for (size_t i = (gap + 1) & mask; h->slots[i].record; i = (i + 1) & mask)
        if (((i - home_of(h, h->slots[i].record)) & mask) >= ((i - gap) & mask)) {
            h->slots[gap] = h->slots[i];
            gap = i;
        }
    memset(&h->slots[gap], 0, sizeof h->slots[gap]);
}

/* ---- records ---- */

static size_t n_made(const struct lum_record *r)
{
    return r && r->type == LUM_RECORD_IMPORT ? r->import.n_made : 0;
}

static void add(struct lum_held *h, const struct lum_record *r)
{
    if (!r)
        return;
    struct lum_held_slot *slot = slot_of(h, r);
    if (slot->n++ > 0)
        return;
    slot->record = r;
    h->n++;
    h->n_bytes += lum_record_bytes(r);
    for (size_t i = 0; i < n_made(r); i++)
        add(h, r->import.made[i]); /* one level: an import never makes imports */
}

static void drop(struct lum_held *h, const struct lum_record *r)
{
    if (!r)
        return;
    struct lum_held_slot *slot = slot_of(h, r);
    if (--slot->n > 0)
        return;
    erase(h, slot);
    h->n_bytes -= lum_record_bytes(r);
    for (size_t i = 0; i < n_made(r); i++)
        drop(h, r->import.made[i]);
}

static size_t step_bytes(const struct lum_changes *c)
{
    return LUM_HELD_STEP_BYTES + c->n * sizeof *c->changes;
}

bool lum_held_add(struct lum_held *h, const struct lum_changes *c)
{
    size_t n = 0;
    for (size_t i = 0; i < c->n; i++)
        n += 2 + n_made(c->changes[i].before) + n_made(c->changes[i].after);
    if (!reserve(h, n))
        return false;
    h->n_bytes += step_bytes(c);
    for (size_t i = 0; i < c->n; i++) {
        add(h, c->changes[i].before);
        add(h, c->changes[i].after);
    }
    return true;
}

void lum_held_drop(struct lum_held *h, const struct lum_changes *c)
{
    h->n_bytes -= step_bytes(c);
    for (size_t i = 0; i < c->n; i++) {
        drop(h, c->changes[i].before);
        drop(h, c->changes[i].after);
    }
}
