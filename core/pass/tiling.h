/* How pictures are cut into tiles. */
#ifndef LUM_CORE_PASS_TILING_H
#define LUM_CORE_PASS_TILING_H

#include "core/accel/trace.h"

/* A tile is one ray batch: up to 16 x 16 pixels, row by row. Tiles at the right and lower edge are smaller. */
#define LUM_TILE_SIDE 16u
#define LUM_TILE_PIXELS (LUM_TILE_SIDE * LUM_TILE_SIDE)
_Static_assert(LUM_TILE_PIXELS == LUM_RAY_BATCH, "a tile is a ray batch");

/* Where tiles lie in a picture. */
struct lum_tiling {
    uint32_t w, h, side, nx, ny, n;
};
struct lum_tile_rect {
    uint32_t x, y, w, h;
};
struct lum_tiling lum_tiling_make(uint32_t w, uint32_t h, uint32_t side);
struct lum_tile_rect lum_tile_at(const struct lum_tiling *tiling, uint32_t tile);

#endif
