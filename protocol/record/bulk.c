#include "protocol/record/bulk.h"

#include <stdalign.h>
#include <stdatomic.h>
#include <stdlib.h>

/* In front of the bytes. */
struct head {
    alignas(max_align_t) _Atomic uint32_t refs;
    size_t n_bytes;
};

static struct head *head_of(const void *bytes)
{
    return (struct head *)(uintptr_t)bytes - 1;
}

void *lum_bulk_create(size_t n_bytes)
{
    struct head *h = n_bytes <= SIZE_MAX - sizeof *h ? calloc(1, sizeof *h + n_bytes) : NULL;
    if (!h)
        return NULL;
    atomic_init(&h->refs, 1u);
    h->n_bytes = n_bytes;
    return h + 1;
}

void *lum_bulk_ref(void *bytes)
{
    if (bytes)
        atomic_fetch_add_explicit(&head_of(bytes)->refs, 1u, memory_order_relaxed);
    return bytes;
}

bool lum_bulk_leave(void *bytes)
{
    return bytes && atomic_fetch_sub_explicit(&head_of(bytes)->refs, 1u, memory_order_acq_rel) == 1u;
}

void lum_bulk_free(void *bytes)
{
    free(head_of(bytes));
}

void lum_bulk_unref(void *bytes)
{
    if (lum_bulk_leave(bytes))
        lum_bulk_free(bytes);
}

size_t lum_bulk_bytes(const void *bytes)
{
    return bytes ? head_of(bytes)->n_bytes : 0;
}
