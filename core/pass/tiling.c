#include "core/pass/tiling.h"

struct lum_tiling lum_tiling_make(uint32_t w, uint32_t h, uint32_t side)
{
    uint32_t nx = (w + side - 1) / side, ny = (h + side - 1) / side;
    return (struct lum_tiling){w, h, side, nx, ny, nx * ny};
}

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

struct lum_tile_rect lum_tile_at(const struct lum_tiling *t, uint32_t tile)
{
    uint32_t x = tile % t->nx * t->side, y = tile / t->nx * t->side;
    return (struct lum_tile_rect){x, y, least(t->side, t->w - x), least(t->side, t->h - y)};
}
