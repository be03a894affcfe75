#include "core/effect/area_shadow/area_around.h"

#include <string.h>

#include "core/light/irradiance.h"

#define BORDER LUM_WINDOW_BORDER
#define BLOCK LUM_WINDOW_BLOCK
#define SIDE LUM_AROUND_SIDE

void lum_area_around_init(struct lum_area_around *a, const struct lum_pass *pass, uint32_t tile)
{
    a->pass = pass;
    a->r = lum_tile_at(&pass->tiling, tile);
    a->subsets = lum_area_tiling(pass);
    lum_area_window_init(&a->window, pass, tile);
}

static uint8_t bits_of(struct lum_visibility visibility)
{
    return (uint8_t)((visibility.traced & visibility.visible ? LUM_AREA_LIT : 0) |
                     (visibility.traced & ~visibility.visible ? LUM_AREA_DARK : 0));
}

/* Where all samples of a window agree, nobody needs to know which of them are of the pixel's own surface: first by
 * tiles of the pattern, then by windows, a row and a column at a time. */
static void look_around(struct lum_area_around *a)
{
    uint8_t row[BLOCK * BLOCK], mixed = 0;
    uint32_t w = a->pass->tiling.w, h = a->pass->tiling.h, x0 = a->r.x / LUM_AREA_SIDE, y0 = a->r.y / LUM_AREA_SIDE;
    for (uint32_t left = a->stale; left; left &= left - 1) {
        uint32_t subset = (uint32_t)__builtin_ctz(left);
        uint8_t bits = (uint8_t)lum_area_around(&a->layer->area, &a->subsets, x0 + subset % SIDE, y0 + subset / SIDE);
        a->around[subset] = bits;
        mixed |= bits == (LUM_AREA_LIT | LUM_AREA_DARK);
    }
    memset(a->says, LUM_AREA_LIT | LUM_AREA_DARK, sizeof a->says);
    if (!mixed || a->r.x < BORDER || a->r.y < BORDER || a->r.x + a->r.w + BORDER > w || a->r.y + a->r.h + BORDER > h)
        return; /* beyond an edge of the picture others stand in */
    for (uint32_t y = 0; y < a->r.h + 2 * BORDER; y++) {
        const struct lum_visibility *visibility =
            a->layer->area.visibility + (size_t)(a->r.y + y - BORDER) * w + a->r.x - BORDER;
        uint8_t bits[BLOCK];
        for (uint32_t x = 0; x < a->r.w + 2 * BORDER; x++)
            bits[x] = bits_of(visibility[x]);
        for (uint32_t x = 0; x < a->r.w; x++)
            row[y * BLOCK + x] = bits[x] | bits[x + 1] | bits[x + 2] | bits[x + 3] | bits[x + 4];
    }
    for (uint32_t y = 0; y < a->r.h; y++)
        for (uint32_t x = 0; x < a->r.w; x++) {
            const uint8_t *at = &row[y * BLOCK + x];
            a->says[y * LUM_TILE_SIDE + x] = at[0] | at[BLOCK] | at[2 * BLOCK] | at[3 * BLOCK] | at[4 * BLOCK];
        }
}
_Static_assert(LUM_WINDOW_SIDE == 5, "look_around joins five");

/* LUM_AREA_ bits: both, when the window has to be looked at. A pixel that asked nobody itself takes its neighbours'
 * word. */
static uint32_t says_at(const struct lum_area_around *a, uint32_t x, uint32_t y)
{
    uint32_t around = a->around[lum_around_subset(x, y)], says = a->says[y * LUM_TILE_SIDE + x];
    bool own = a->layer->area.visibility[(size_t)(a->r.y + y) * a->pass->tiling.w + a->r.x + x].traced;
    return around == (LUM_AREA_LIT | LUM_AREA_DARK) && says != 0 && own ? says : around;
}

/* True where only the window can tell which share of the light arrives. */
static bool needs_window(const struct lum_area_around *a, uint32_t says)
{
    return (says & LUM_AREA_LIT) && (!a->exact || says != LUM_AREA_LIT);
}

void lum_area_around_read(struct lum_area_around *a, const struct lum_layer *layer, uint32_t stale)
{
    uint32_t mixed[LUM_TILE_SIDE] = {0};
    a->layer = layer;
    a->exact = lum_light_has_irradiance(&a->pass->layers->unit.lights.lights[layer->index]);
    a->stale = stale;
    look_around(a);
    for (uint32_t left = stale; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left), x0 = k % SIDE * LUM_AREA_SIDE, y0 = k / SIDE * LUM_AREA_SIDE;
        if (!needs_window(a, a->around[k]))
            continue;
        for (uint32_t y = y0; y < y0 + LUM_AREA_SIDE && y < a->r.h; y++)
            for (uint32_t x = x0; x < x0 + LUM_AREA_SIDE && x < a->r.w; x++) {
                size_t pixel = (size_t)(a->r.y + y) * a->pass->tiling.w + a->r.x + x;
                if (lum_area_wants(a->pass, layer, pixel) && needs_window(a, says_at(a, x, y)))
                    mixed[y] |= 1u << x;
            }
    }
    lum_area_window_gather(&a->window, layer, mixed);
}

float lum_area_around_ratio(const struct lum_area_around *a, uint32_t x, uint32_t y, struct lum_moments *ret_moments)
{
    uint32_t says = says_at(a, x, y);
    if (!needs_window(a, says))
        return says & LUM_AREA_LIT ? 1.0f : 0.0f;
    *ret_moments = lum_area_window_at(&a->window, x, y);
    if (a->exact && !(ret_moments->traced > 0.0f)) { /* nobody on its surface was asked */
        const struct lum_visibility_tally *t =
            &a->layer->area.tally[(a->r.y + y) / LUM_AREA_SIDE * a->subsets.nx + (a->r.x + x) / LUM_AREA_SIDE];
        return t->traced > 0 ? (float)t->visible / (float)t->traced : 0.0f;
    }
    return lum_moments_share(ret_moments);
}

/* ---- what is stale ---- */

bool lum_around_settled(const struct lum_pass *pass, const struct lum_area_visibility *area, uint32_t tile)
{
    return area->settled[tile] > 0 && area->settled[tile] >= lum_latest_around(area->told, &pass->tiling, tile);
}
_Static_assert(2 * LUM_AREA_SIDE <= LUM_TILE_SIDE, "within the tiles that touch it");

/* Hash of what a row of three tiles of the pattern knows, or three rows. Many tiles know the same: a row must not be
 * linear, or rows and columns could change places. */
static uint64_t join(uint64_t a, uint64_t b, uint64_t c)
{
    uint64_t h = a * 0xd6e8feb86659fd93u + b * 0xa0761d6478bd642fu + c * 0xe7037ed1a0b428dbu;
    return (h ^ h >> 32) * 0x9e3779b97f4a7c15u;
}

uint32_t lum_around_find_stale(const struct lum_pass *pass, struct lum_tile_rect r, const uint64_t *hashes,
                               const uint64_t *made, uint64_t ret_known[LUM_AROUND_SUBSETS])
{
    struct lum_tiling subsets = lum_area_tiling(pass);
    uint32_t x0 = r.x / LUM_AREA_SIDE, y0 = r.y / LUM_AREA_SIDE, stale = 0;
    uint64_t hash[SIDE + 2][SIDE + 2] = {0}, row[SIDE + 2][SIDE];
    for (uint32_t y = y0 > 0 ? y0 - 1 : 0; y <= y0 + SIDE && y < subsets.ny; y++)
        for (uint32_t x = x0 > 0 ? x0 - 1 : 0; x <= x0 + SIDE && x < subsets.nx; x++)
            hash[y + 1 - y0][x + 1 - x0] = hashes[y * subsets.nx + x];
    for (uint32_t j = 0; j < SIDE + 2; j++)
        for (uint32_t i = 0; i < SIDE; i++)
            row[j][i] = join(hash[j][i], hash[j][i + 1], hash[j][i + 2]);
    for (uint32_t j = 0; j < SIDE && y0 + j < subsets.ny; j++)
        for (uint32_t i = 0; i < SIDE && x0 + i < subsets.nx; i++) {
            uint64_t known = join(row[j][i], row[j + 1][i], row[j + 2][i]) | 1u; /* never 0 */
            ret_known[j * SIDE + i] = known;
            stale |= (uint32_t)(made[(y0 + j) * subsets.nx + x0 + i] != known) << (j * SIDE + i);
        }
    return stale;
}

void lum_around_made(const struct lum_pass *pass, struct lum_tile_rect r, uint32_t stale,
                     const uint64_t known[LUM_AROUND_SUBSETS], uint64_t *inout_made)
{
    uint32_t nx = lum_area_tiling(pass).nx;
    for (uint32_t left = stale; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left);
        inout_made[(r.y / LUM_AREA_SIDE + k / SIDE) * nx + r.x / LUM_AREA_SIDE + k % SIDE] = known[k];
    }
}
