#include "core/effect/direct/layers.h"

#include <string.h>

#include "core/effect/direct/direct.h"
#include "core/math/sampler.h"

/* Layer that light i adds to. */
static struct lum_layer *layer_for(struct lum_layers *l, uint32_t light)
{
    return l->layer_of[light] == LUM_NO_OBJECT ? &l->shared : &l->layers[l->layer_of[light]];
}

/* Where the layer's response in a tile is; NULL: memory is short, and the pass fails. */
static struct lum_rgb *response_in(struct lum_layers *l, struct lum_layer *layer, uint32_t tile)
{
    if (!layer->tiles)
        return layer->response + (size_t)tile * LUM_TILE_PIXELS;
    if (!layer->tiles[tile])
        layer->tiles[tile] = lum_calloc(LUM_TILE_PIXELS, sizeof **layer->tiles);
    if (!layer->tiles[tile])
        l->starved = true;
    return layer->tiles[tile];
}

/* Iterates over the layers that show, with *inout_a from 0; NULL ends. The shared one comes last. */
static struct lum_layer *next_layer(const struct lum_pass *pass, uint32_t *inout_a)
{
    struct lum_layers *l = pass->layers;
    const struct lum_light_table *lights = &pass->snapshot->lights;
    while (*inout_a < lights->n_active) {
        uint32_t k = l->layer_of[lights->active[(*inout_a)++]];
        if (k != LUM_NO_OBJECT)
            return &l->layers[k];
    }
    return (*inout_a)++ == lights->n_active && l->shared_on ? &l->shared : NULL;
}

bool lum_layers_reached(const struct lum_pass *pass, uint32_t tile, enum lum_layer_state state)
{
    uint32_t a = 0;
    for (struct lum_layer *layer; (layer = next_layer(pass, &a));)
        if (layer->state[tile] < state)
            return false;
    return true;
}

void lum_layers_reach(const struct lum_pass *pass, uint32_t tile, enum lum_layer_state state)
{
    uint32_t a = 0;
    for (struct lum_layer *layer; (layer = next_layer(pass, &a));)
        if (layer->state[tile] < state)
            layer->state[tile] = (uint8_t)state;
}

void lum_layers_blacken(const struct lum_pass *pass, uint32_t tile, enum lum_layer_state state)
{
    size_t first = (size_t)tile * LUM_TILE_PIXELS;
    uint32_t a = 0;
    for (struct lum_layer *layer; (layer = next_layer(pass, &a));) {
        if (layer->state[tile] >= state)
            continue;
        if (!layer->tiles)
            memset(layer->response + first, 0, LUM_TILE_PIXELS * sizeof *layer->response);
        else if (layer->tiles[tile])
            memset(layer->tiles[tile], 0, LUM_TILE_PIXELS * sizeof *layer->response);
        if (layer->state[tile] == LUM_LAYER_EMPTY && layer->visibility)
            memset(layer->visibility + first, 0, LUM_TILE_PIXELS * sizeof *layer->visibility);
        if (layer->state[tile] == LUM_LAYER_EMPTY && layer->left)
            memset(layer->left + first, 0, LUM_TILE_PIXELS * sizeof *layer->left);
        if (layer->state[tile] == LUM_LAYER_EMPTY && layer->inner)
            memset(layer->inner + first, 0, LUM_TILE_PIXELS);
    }
}

void lum_layers_add(const struct lum_pass *pass, uint32_t tile, const struct lum_emission *e,
                    enum lum_layer_state state)
{
    struct lum_layers *l = pass->layers;
    struct lum_layer *layer = e->light == LUM_NO_OBJECT ? &l->shared : layer_for(l, e->light);
    if (!layer->state || layer->state[tile] >= state)
        return;
    struct lum_rgb radiance = e->per_power;
    if (layer == &l->shared && e->light != LUM_NO_OBJECT) {
        const struct lum_light *light = &pass->snapshot->lights.lights[e->light];
        if (!light->on) /* in the unit snapshot every light is */
            return;
        radiance = lum_rgb_mul(radiance, light->power);
    }
    struct lum_rgb *response = response_in(l, layer, tile);
    if (response)
        response[e->slot] = lum_rgb_add(response[e->slot], radiance);
}

static void light_all(const struct lum_pass *pass, uint32_t tile, const struct lum_vertices *vertices,
                      enum lum_layer_state state, bool matte, struct lum_counters *counters)
{
    struct lum_layers *l = pass->layers;
    const struct lum_light_table *lights = &pass->snapshot->lights;
    size_t first = (size_t)tile * LUM_TILE_PIXELS;
    for (uint32_t a = 0; a < lights->n_active; a++) {
        uint32_t light = lights->active[a];
        struct lum_layer *layer = layer_for(l, light);
        if ((matte && light == pass->cached_sky) || layer->state[tile] >= state ||
            !pass->on[lum_light_effect(&lights->lights[light])])
            continue;
        bool shared = layer == &l->shared;
        if (state == LUM_LAYER_DIRECT && (layer->area.visibility || layer->tiles || (shared && l->many_lights.on) ||
                                          !lum_layers_hold(pass, &lights->lights[light])))
            continue;
        struct lum_rgb *response = vertices->n > 0 ? response_in(l, layer, tile) : NULL;
        if (!response)
            continue;
        lum_direct_light(&(struct lum_direct){
            .snapshot = shared ? pass->snapshot : &l->unit,
            .light = light,
            .salt = shared ? lum_hash_text(lights->lights[light].id) : layer->salt,
            .media = pass->on[LUM_EFFECT_MEDIA],
            .panes = lum_pass_panes(pass),
            .n_samples = state == LUM_LAYER_COMPLETE ? l->samples_behind : pass->settings->shadow_samples,
            .by_share = matte,
            .hard = pass->settings->method->hard_shadows,
            .vertices = vertices,
            .visibility = state == LUM_LAYER_DIRECT && layer->visibility ? layer->visibility + first : NULL,
            .left = state == LUM_LAYER_DIRECT && layer->left ? layer->left + first : NULL,
            .response = response,
            .counters = counters,
        });
    }
}

void lum_layers_light(const struct lum_pass *pass, uint32_t tile, const struct lum_vertices *vertices,
                      enum lum_layer_state state, struct lum_counters *counters)
{
    light_all(pass, tile, vertices, state, false, counters);
}

void lum_layers_light_matte(const struct lum_pass *pass, uint32_t tile, const struct lum_vertices *vertices,
                            enum lum_layer_state state, struct lum_counters *counters)
{
    light_all(pass, tile, vertices, state, true, counters);
}

static void add_scaled(const struct lum_rgb *response, uint32_t n, struct lum_rgb power, struct lum_rgb *inout_sum)
{
    for (uint32_t i = 0; i < n; i++)
        inout_sum[i] = lum_rgb_add(inout_sum[i], lum_rgb_mul(response[i], power));
}

void lum_layer_add(const struct lum_layer *layer, uint32_t tile, uint32_t n_pixels, struct lum_rgb power,
                   struct lum_rgb *inout_sum)
{
    size_t first = (size_t)tile * LUM_TILE_PIXELS;
    const struct lum_rgb *lean = layer->tiles ? layer->tiles[tile] : NULL;
    if (!layer->tiles || lean)
        add_scaled(lean ? lean : layer->response + first, n_pixels, power, inout_sum);
    if (layer->area.visibility)
        add_scaled(layer->area.direct + first, n_pixels, power, inout_sum);
}

void lum_layers_sum(const struct lum_pass *pass, uint32_t tile, uint32_t n_pixels, struct lum_rgb *ret_radiance)
{
    const struct lum_layers *l = pass->layers;
    size_t first = (size_t)tile * LUM_TILE_PIXELS;
    for (uint32_t i = 0; i < n_pixels; i++)
        ret_radiance[i] = l->shared_on ? l->shared.response[first + i] : lum_grey(0.0f);
    const struct lum_light_table *lights = &pass->snapshot->lights;
    for (uint32_t a = 0; a < lights->n_active; a++) {
        uint32_t light = lights->active[a], k = l->layer_of[light];
        if (k != LUM_NO_OBJECT)
            lum_layer_add(&l->layers[k], tile, n_pixels, lights->lights[light].power, ret_radiance);
    }
    if (l->many_lights.on)
        lum_many_lights_add(pass, tile, n_pixels, ret_radiance);
}
