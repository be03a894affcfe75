#include "core/render/rough_known.h"

#include <string.h>

void lum_rough_known_all(struct lum_layers *l)
{
    for (uint32_t k = 0; k < l->n_layers; k++)
        if (l->layers[k].whole)
            memset(l->layers[k].whole, 1, l->n_tiles);
}

/* Of a picture: what is whole in fewer tiles is left to the rough picture, as every tile that any of them lacks is. */
#define MOST_TILES 0.75f

static bool is_mostly_whole(const struct lum_layers *l, const struct lum_layer *layer)
{
    uint32_t n = 0;
    for (uint32_t t = 0; layer->whole && t < l->n_tiles; t++)
        n += layer->whole[t];
    return n > 0 && (float)n >= MOST_TILES * (float)l->n_tiles;
}

void lum_rough_known_init(struct lum_rough_known *ret_known, const struct lum_layers *l,
                          const struct lum_layers *coarse, const struct lum_light_table *lights)
{
    bool *chosen = l->n_layers ? lum_calloc(l->n_layers, sizeof *chosen) : NULL, any = false;
    uint8_t *whole = lum_calloc(l->n_tiles, 1);
    if (whole)
        memset(whole, 1, l->n_tiles);
    for (uint32_t a = 0; chosen && whole && a < lights->n_active; a++) {
        uint32_t k = l->layer_of[lights->active[a]], j = coarse->layer_of[lights->active[a]];
        if (k == LUM_NO_OBJECT || j == LUM_NO_OBJECT || coarse->layers[j].tiles || !is_mostly_whole(l, &l->layers[k]))
            continue;
        chosen[k] = any = true;
        for (uint32_t t = 0; t < l->n_tiles; t++)
            whole[t] &= l->layers[k].whole[t];
    }
    *ret_known = (struct lum_rough_known){.layers = l, .chosen = chosen, .whole = whole};
    if (!any)
        lum_rough_known_finish(ret_known);
}

void lum_rough_known_finish(struct lum_rough_known *known)
{
    lum_free(known->chosen);
    lum_free(known->whole);
    *known = (struct lum_rough_known){0};
}

bool lum_rough_knows(const struct lum_rough_known *known, uint32_t light)
{
    uint32_t k = known->chosen && light != LUM_NO_OBJECT ? known->layers->layer_of[light] : LUM_NO_OBJECT;
    return k != LUM_NO_OBJECT && known->chosen[k];
}

void lum_rough_known_sum(const struct lum_rough_known *known, const struct lum_pass *pass, uint32_t tile,
                         uint32_t n_pixels, struct lum_rgb *ret_radiance)
{
    const struct lum_layers *l = pass->layers;
    const struct lum_light_table *lights = &pass->snapshot->lights;
    for (uint32_t i = 0; i < n_pixels; i++)
        ret_radiance[i] = lum_grey(0.0f);
    for (uint32_t a = 0; a < lights->n_active; a++) {
        uint32_t light = lights->active[a];
        if (lum_rough_knows(known, light))
            lum_layer_add(&l->layers[l->layer_of[light]], tile, n_pixels, lights->lights[light].power, ret_radiance);
    }
}
