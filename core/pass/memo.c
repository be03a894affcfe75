#include "core/pass/memo.h"

#include <string.h>

bool lum_memo_reserve(struct lum_memo *m, uint32_t n)
{
    if (m->stamp && m->n == n)
        return true;
    lum_memo_finish(m);
    m->stamp = lum_calloc(n, sizeof *m->stamp);
    m->n = n;
    m->version = 1; /* beyond the stamps, which are 0 */
    return m->stamp;
}

void lum_memo_finish(struct lum_memo *m)
{
    lum_free(m->stamp);
    *m = (struct lum_memo){0};
}

void lum_memo_forget(struct lum_memo *m)
{
    if (++m->version < UINT32_MAX / LUM_MEMO_STEPS)
        return;
    memset(m->stamp, 0, m->n * sizeof *m->stamp);
    m->version = 1;
}

bool lum_memo_is_whole(const struct lum_memo *m)
{
    for (uint32_t i = 0; i < m->n; i++)
        if (lum_memo_step(m, i) == 0)
            return false;
    return true;
}

uint32_t lum_latest_around(const uint32_t *stamps, const struct lum_tiling *t, uint32_t tile)
{
    uint32_t x0 = tile % t->nx, y0 = tile / t->nx, latest = 0;
    for (uint32_t y = y0 > 0 ? y0 - 1 : 0; y <= y0 + 1 && y < t->ny; y++)
        for (uint32_t x = x0 > 0 ? x0 - 1 : 0; x <= x0 + 1 && x < t->nx; x++) {
            uint32_t stamp = stamps[y * t->nx + x];
            latest = stamp > latest ? stamp : latest;
        }
    return latest;
}
