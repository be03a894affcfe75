#include "core/effect/ais/ais.h"

#include <string.h>

const struct lum_ais lum_ais_igi = {.max = 1, .step = 1, .joined = true};
const struct lum_ais lum_ais_adaptive = {.max = LUM_AIS_SUBSETS, .adaptive = true, .step = 4};
const struct lum_ais lum_ais_full = {.max = LUM_AIS_SUBSETS, .step = 4};

struct lum_filter lum_ais_upsampling(const struct lum_pass *pass, const struct lum_guide *guide)
{
    return (struct lum_filter){.guide = guide,
                               .need = LUM_PIXEL_DIFFUSE,
                               .side = LUM_AIS_SIDE,
                               .apart = 1,
                               .step = lum_ais_of(pass)->step,
                               .in = pass->components->buffer[LUM_EFFECT_INDIRECT_DIFFUSE].raw,
                               .lenient = true};
}

/* Every second bit of a number of 8 bits. */
static uint32_t every_second_bit(uint32_t k)
{
    k = (k & 0x11u) | (k & 0x44u) >> 1;
    return (k & 0x3u) | (k & 0x30u) >> 2;
}

static void list_tiles(uint32_t tiles_x, uint32_t tiles_y, uint8_t *ret_x, uint8_t *ret_y)
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < LUM_AIS_TILES; k++) {
        uint32_t x = every_second_bit(k), y = every_second_bit(k >> 1);
        if (x >= tiles_x || y >= tiles_y)
            continue;
        ret_x[n] = (uint8_t)x;
        ret_y[n++] = (uint8_t)y;
    }
}

void lum_ais_cell_init(struct lum_ais_cell *p, const struct lum_pass *pass, uint32_t cell, uint32_t step)
{
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    p->pass = pass;
    p->step = step;
    p->x0 = r.x / step;
    p->y0 = r.y / step;
    p->w = lum_filter_size(r.w, step);
    p->h = lum_filter_size(r.h, step);
    p->tiles_x = (p->w + LUM_AIS_SIDE - 1) / LUM_AIS_SIDE;
    p->tiles_y = (p->h + LUM_AIS_SIDE - 1) / LUM_AIS_SIDE;
    list_tiles(p->tiles_x, p->tiles_y, p->tile_x, p->tile_y);
    memset(p->wanted, 0, sizeof p->wanted);
    memset(p->further, 0, sizeof p->further);
}

bool lum_ais_cell_want(struct lum_ais_cell *p, uint8_t kinds)
{
    bool any = false;
    for (uint32_t y = 0; y < p->h; y++)
        for (uint32_t x = 0; x < p->w; x++) {
            uint32_t i = y * LUM_CELL_SIDE + x;
            p->wanted[i] = kinds == 0 || (p->pass->surfaces->kind[lum_ais_pixel(p, i)] & kinds);
            any = any || p->wanted[i];
        }
    return any;
}

uint32_t lum_ais_at(const struct lum_ais_cell *p, uint32_t k, uint32_t place)
{
    uint32_t x = p->tile_x[k] * LUM_AIS_SIDE + place % LUM_AIS_SIDE;
    uint32_t y = p->tile_y[k] * LUM_AIS_SIDE + place / LUM_AIS_SIDE;
    uint32_t i = y * LUM_CELL_SIDE + x;
    return x < p->w && y < p->h && p->wanted[i] ? i : LUM_AIS_PIXELS;
}

void lum_ais_list_pixels(const struct lum_ais_cell *p, uint32_t place, uint32_t iteration, struct lum_ais_list *list)
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < p->tiles_x * p->tiles_y; k++) {
        uint32_t i = lum_ais_at(p, k, place);
        if (i < LUM_AIS_PIXELS && p->further[lum_ais_tile(p, i)] >= iteration)
            list->pixel[n++] = (uint16_t)i;
    }
    list->n = n;
}

uint32_t lum_ais_last_iteration(const struct lum_ais_cell *p)
{
    uint32_t last = 0;
    for (uint32_t t = 0; t < p->tiles_x * p->tiles_y; t++)
        last = p->further[t] > last ? p->further[t] : last;
    return last;
}

void lum_ais_note(const struct lum_ais_cell *p, enum lum_effect component)
{
    if (lum_ais_last_iteration(p) == 0)
        return;
    uint8_t *map = p->pass->components->buffer[component].iterations;
    uint32_t w = p->pass->tiling.w, h = p->pass->tiling.h;
    for (uint32_t y = 0; y < p->h * p->step && p->y0 * p->step + y < h; y++)
        for (uint32_t x = 0; x < p->w * p->step && p->x0 * p->step + x < w; x++) {
            uint8_t *noted = &map[(size_t)(p->y0 * p->step + y) * w + p->x0 * p->step + x];
            uint8_t n = p->further[lum_ais_tile(p, y / p->step * LUM_CELL_SIDE + x / p->step)];
            if (n > *noted)
                *noted = n;
        }
}
