#include "server/stream/vp9.h"

bool lum_vp9_available(void)
{
    return false;
}

struct lum_vp9 *lum_vp9_create(uint32_t w, uint32_t h, uint32_t n_threads)
{
    (void)w;
    (void)h;
    (void)n_threads;
    return NULL;
}

void lum_vp9_destroy(struct lum_vp9 *v)
{
    (void)v;
}

void lum_vp9_put(struct lum_vp9 *v, const struct lum_vp9_part *part)
{
    (void)v;
    (void)part;
}

struct lum_vp9_frame lum_vp9_encode(struct lum_vp9 *v, uint32_t wanted_bytes, bool key)
{
    (void)v;
    (void)wanted_bytes;
    (void)key;
    return (struct lum_vp9_frame){0};
}
