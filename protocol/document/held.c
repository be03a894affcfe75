#include "protocol/document/held.h"

void lum_held_finish(struct lum_held *h)
{
    lum_hash_finish(&h->records);
    h->n_bytes = 0;
}

static size_t n_made(const struct lum_record *r)
{
    return r && r->type == LUM_RECORD_IMPORT ? r->import.n_made : 0;
}

static void add(struct lum_held *h, const struct lum_record *r)
{
    if (!r)
        return;
    if (lum_hash_put_pointer(&h->records, r)->value++ > 0)
        return;
    h->n_bytes += lum_record_bytes(r);
    for (size_t i = 0; i < n_made(r); i++)
        add(h, r->import.made[i]); /* one level: an import never makes imports */
}

static void drop(struct lum_held *h, const struct lum_record *r)
{
    if (!r)
        return;
    struct lum_hash_slot *slot = lum_hash_find_pointer(&h->records, r);
    if (--slot->value > 0)
        return;
    lum_hash_erase(&h->records, slot);
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
    if (!lum_hash_reserve(&h->records, n))
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
