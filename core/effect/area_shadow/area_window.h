/* The visible share of a light around each pixel of a tile, over windows of the same surface: what
 * area_around.h is made of. Works row by row on structures of arrays that the compiler vectorises, as lum_filter_box
 * does. */
#ifndef LUM_CORE_EFFECT_AREA_SHADOW_AREA_WINDOW_H
#define LUM_CORE_EFFECT_AREA_SHADOW_AREA_WINDOW_H

#include "core/effect/area_shadow/area_shadow.h"
#include "core/interleave/interleave.h"

#define LUM_WINDOW_BORDER 2u /* pixels to each side: the pattern, 4 wide, fits in whole */
#define LUM_WINDOW_SIDE (2 * LUM_WINDOW_BORDER + 1)
#define LUM_WINDOW_BLOCK (LUM_TILE_SIDE + 2 * LUM_WINDOW_BORDER)

/* Sums over samples that are known; f: what the sample brings to a matte surface, were it visible. */
struct lum_moments {
    float traced, visibility; /* f */
    /* lights without a closed form */
    float n;              /* how many */
    float cosine;         /* f cosine of those that are visible */
    struct lum_rgb light; /* f radiance of those that are visible */
};
#define LUM_MOMENTS (sizeof(struct lum_moments) / sizeof(float))

/* One tile, one layer at a time. About 40 KiB. */
struct lum_area_window {
    const struct lum_pass *pass;
    const struct lum_layer *layer;
    struct lum_guide guide;
    struct lum_tile_rect r;
    uint32_t from_x[LUM_WINDOW_BLOCK], from_y[LUM_WINDOW_BLOCK]; /* where columns and rows of the tile and its border
                                                                  * lie in the picture; or LUM_NOWHERE */
    uint32_t n_moments;                                          /* of the layer's light: those that count */
    bool surfaces_known;                                         /* of the tile: the next 7 are filled */
    /* of the tile and its border, what stands for places beyond the edge of the picture included */
    float px[LUM_WINDOW_BLOCK * LUM_WINDOW_BLOCK], py[LUM_WINDOW_BLOCK * LUM_WINDOW_BLOCK],
        pz[LUM_WINDOW_BLOCK * LUM_WINDOW_BLOCK], nx[LUM_WINDOW_BLOCK * LUM_WINDOW_BLOCK],
        ny[LUM_WINDOW_BLOCK * LUM_WINDOW_BLOCK], nz[LUM_WINDOW_BLOCK * LUM_WINDOW_BLOCK],
        limit[LUM_WINDOW_BLOCK * LUM_WINDOW_BLOCK];
    float moments[LUM_MOMENTS][LUM_WINDOW_BLOCK * LUM_WINDOW_BLOCK];
    float whole_ratio[LUM_WINDOW_BLOCK *
                      LUM_WINDOW_BLOCK]; /* of those that know all strata; far from any share: of others */
    /* of the tile, LUM_TILE_SIDE a row */
    uint32_t same[LUM_TILE_PIXELS];          /* bit j: neighbour j of the window is on the same surface */
    bool same_known[LUM_TILE_SIDE];          /* by row */
    float sum[LUM_MOMENTS][LUM_TILE_PIXELS]; /* over the window */
    float alike[LUM_MOMENTS]
               [LUM_TILE_PIXELS]; /* of those that know all strata: over those in it that say about the same */
};

/* tile: of pass->tiling. */
void lum_area_window_init(struct lum_area_window *ret_window, const struct lum_pass *pass, uint32_t tile);
/* Sums up the windows of some pixels of the tile: bit x of row y. */
void lum_area_window_gather(struct lum_area_window *w, const struct lum_layer *layer,
                            const uint32_t pixels[LUM_TILE_SIDE]);
/* Of one of these pixels: the window, or where it knows all strata, what is like it there. */
struct lum_moments lum_area_window_at(const struct lum_area_window *w, uint32_t x, uint32_t y);

/* Radiance of a sample at pixel, less what media take of it. */
struct lum_rgb lum_area_arriving(const struct lum_pass *pass, size_t pixel, const struct lum_light_sample *ls);

static inline bool lum_visibility_whole(struct lum_visibility visibility)
{
    return (uint16_t)(visibility.traced | visibility.visible) == UINT16_MAX;
}

static inline float lum_moments_share(const struct lum_moments *m)
{
    return m->traced > 0.0f ? m->visibility / m->traced : 0.0f;
}

#endif
