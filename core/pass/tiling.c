#include "core/pass/tiling.h"

#include "core/base/base.h"

struct lum_tiling lum_tiling_make(uint32_t w, uint32_t h, uint32_t side)
{
    uint32_t nx = (w + side - 1) / side, ny = (h + side - 1) / side;
    return (struct lum_tiling){w, h, side, nx, ny, nx * ny};
}

struct lum_tile_rect lum_tile_at(const struct lum_tiling *t, uint32_t tile)
{
    uint32_t x = tile % t->nx * t->side, y = tile / t->nx * t->side;
    return (struct lum_tile_rect){x, y, lum_min_u32(t->side, t->w - x), lum_min_u32(t->side, t->h - y)};
}
