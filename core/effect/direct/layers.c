#include "core/effect/direct/layers.h"

#include <string.h>

#include "core/math/sampler.h"

static void finish_layer(struct lum_layer *l)
{
    for (uint32_t t = 0; l->tiles && t < l->n_tiles; t++)
        lum_free(l->tiles[t]);
    lum_free(l->tiles);
    lum_free(l->visibility);
    lum_free(l->inner);
    lum_free(l->left);
    lum_free(l->response);
    lum_free(l->state);
    lum_free(l->whole);
    lum_area_visibility_finish(&l->area);
    *l = (struct lum_layer){0};
}

void lum_layers_finish(struct lum_layers *l)
{
    for (uint32_t i = 0; i < l->n_layers; i++)
        finish_layer(&l->layers[i]);
    finish_layer(&l->shared);
    lum_free(l->layers);
    lum_many_lights_finish(&l->many_lights);
    lum_branches_destroy(l->branches, l->n_tiles);
    lum_free(l->brightness);
    lum_free(l->layer_of);
    lum_free(l->unit_lights);
    *l = (struct lum_layers){0};
}

/* What is seen through panes is known only on average over samples: it is asked anew. */
static void forget_behind_panes(struct lum_layer *l, const struct lum_pass *pass)
{
    size_t n = (size_t)pass->tiling.n * LUM_TILE_PIXELS;
    for (size_t i = 0; l->left && i < n; i++) {
        if (l->left[i] == 0)
            continue;
        l->visibility[i] = (struct lum_visibility){0};
        l->left[i] = 0;
        if (l->inner)
            l->inner[i] = 0;
    }
}

/* What the eye sees is lit anew by what is known of a soft light. */
static void reshade(struct lum_layer *l, const struct lum_pass *pass, bool doubted)
{
    if (doubted)
        lum_area_visibility_reconsider(&l->area, pass);
    else
        lum_area_visibility_reshade(&l->area, pass);
}

/* Lowers every tile to at most this state: LUM_LAYER_EMPTY or LUM_LAYER_VISIBILITY. */
static void lower(struct lum_layer *l, const struct lum_pass *pass, enum lum_layer_state state, bool doubted)
{
    if (l->whole)
        memset(l->whole, 0, pass->tiling.n);
    for (uint32_t t = 0; l->state && t < pass->tiling.n; t++)
        if (l->state[t] > state)
            l->state[t] = (uint8_t)state;
    if (l->area.visibility && state == LUM_LAYER_EMPTY)
        lum_area_visibility_forget(&l->area, pass);
    else if (l->area.visibility)
        reshade(l, pass, doubted);
    else if (state == LUM_LAYER_VISIBILITY)
        forget_behind_panes(l, pass);
}

/* The shared layer has no bits to fall back on; the many lights have. */
static void lower_all(struct lum_layers *l, const struct lum_pass *pass, enum lum_layer_state state)
{
    for (uint32_t i = 0; i < l->n_layers; i++)
        lower(&l->layers[i], pass, state, l->doubted);
    lower(&l->shared, pass, LUM_LAYER_EMPTY, l->doubted);
    if (state == LUM_LAYER_EMPTY)
        lum_many_lights_forget(&l->many_lights, pass);
    else
        lum_many_lights_reshade(&l->many_lights, pass);
}

/* Whether or not the effect is on. */
static enum lum_layering layering_by_method(const struct lum_pass *pass, const struct lum_light *light)
{
    const struct lum_estimator *by = lum_method_serves(pass->settings->method, lum_light_effect(light));
    return by ? by->layering : LUM_LAYERING_NONE;
}

static enum lum_layering layering_of(const struct lum_pass *pass, const struct lum_light *light)
{
    return pass->on[lum_light_effect(light)] ? layering_by_method(pass, light) : LUM_LAYERING_NONE;
}

static bool is_soft(const struct lum_pass *pass, const struct lum_light *light)
{
    return layering_of(pass, light) == LUM_LAYERING_AREA;
}

bool lum_layers_hold(const struct lum_pass *pass, const struct lum_light *light)
{
    return layering_of(pass, light) != LUM_LAYERING_NONE;
}

/* True when the edges of its shadows are smoothed (LUM_LAYER_SMOOTH). */
static bool has_edges(const struct lum_pass *pass, const struct lum_light *light)
{
    return light->delta && layering_of(pass, light) == LUM_LAYERING_HARD && pass->on[LUM_EFFECT_ANTIALIAS];
}

/* Lights with soft shadows that shine, or did: what is decided by their number must not hang on who is off. */
static uint32_t count_soft(const struct lum_layers *l, const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    uint32_t n = 0;
    for (uint32_t a = 0; a < lights->n_active; a++)
        n += layering_by_method(pass, &lights->lights[lights->active[a]]) == LUM_LAYERING_AREA;
    for (uint32_t k = 0; k < l->n_layers; k++) {
        const struct lum_layer *layer = &l->layers[k];
        bool dark = layer->index != LUM_NO_OBJECT && !(lights->pick_pdf[layer->index] > 0.0f);
        n += (layer->area.visibility || layer->tiles) && dark;
    }
    return n;
}

/* Samples of each light behind mirrors and glass: all lights together have as many as one would. */
static uint32_t samples_behind(const struct lum_pass *pass, uint32_t n_soft)
{
    uint32_t all = pass->settings->shadow_samples;
    return n_soft <= 1 ? all : all > n_soft ? all / n_soft : 1;
}

/* True when the layer has the buffers that this light asks for. */
static bool is_laid_out_for(const struct lum_layer *layer, const struct lum_pass *pass, const struct lum_light *light)
{
    return lum_layers_hold(pass, light) && is_soft(pass, light) == (layer->area.visibility != NULL) &&
           has_edges(pass, light) == (layer->inner != NULL);
}

static void find_lights(struct lum_layers *l, const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    for (uint32_t k = 0; k < l->n_layers; k++) {
        struct lum_layer *layer = &l->layers[k];
        layer->index = LUM_NO_OBJECT;
        for (uint32_t i = 0; i < lights->n_lights && layer->index == LUM_NO_OBJECT; i++)
            if (strcmp(lights->lights[i].id, layer->light.id) == 0)
                layer->index = i;
    }
}

/* Forgets layers whose light is gone, became one of another kind or emits along other paths, and all lean ones, for
 * which there may be room by now. */
static void match_lights(struct lum_layers *l, const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    uint32_t kept = 0;
    for (uint32_t k = 0; k < l->n_layers; k++) {
        struct lum_layer *layer = &l->layers[k];
        if (layer->tiles || layer->index == LUM_NO_OBJECT || (l->has_many_lights && layer->area.visibility) ||
            !is_laid_out_for(layer, pass, &lights->lights[layer->index])) {
            finish_layer(layer);
            continue;
        }
        if (!lum_light_same_shape(&layer->light, &lights->lights[layer->index]))
            lower(layer, pass, LUM_LAYER_EMPTY, l->doubted);
        layer->light = lights->lights[layer->index];
        l->layers[kept++] = *layer;
    }
    for (uint32_t k = kept; k < l->n_layers; k++)
        l->layers[k] = (struct lum_layer){0}; /* moved down */
    l->n_layers = kept;
    l->n_lean = 0;
}

/* What the number of lights decides; and which layer is whose. */
static void count_lights(struct lum_layers *l, const struct lum_pass *pass, bool others)
{
    if (others)
        find_lights(l, pass);
    uint32_t n_soft = count_soft(l, pass), samples = samples_behind(pass, n_soft);
    bool has_many_lights = n_soft > LUM_AREA_LAYERS;
    if (samples != l->samples_behind)
        lower_all(l, pass, LUM_LAYER_VISIBILITY);
    others = others || has_many_lights != l->has_many_lights;
    l->samples_behind = samples;
    l->has_many_lights = has_many_lights;
    if (others)
        match_lights(l, pass);
}

static size_t layer_bytes(const struct lum_pass *pass, bool area)
{
    size_t n = (size_t)pass->tiling.n * LUM_TILE_PIXELS;
    size_t places =
        area ? LUM_AREA_POINTS * LUM_AREA_STRATUM_POINTS * sizeof(struct lum_light_place) : 0; /* if it has any */
    return n * (sizeof(struct lum_rgb) + (area ? lum_area_visibility_bytes() : sizeof(struct lum_visibility) + 1)) +
           places;
}

static bool init_buffers(struct lum_layer *layer, const struct lum_pass *pass)
{
    layer->response = lum_calloc((size_t)pass->tiling.n * LUM_TILE_PIXELS, sizeof *layer->response);
    layer->state = lum_calloc(pass->tiling.n, 1);
    if (layer->response && layer->state)
        return true;
    finish_layer(layer);
    return false;
}

/* A layer of light i's own. */
static bool init_layer(struct lum_layer *layer, const struct lum_pass *pass, uint32_t i)
{
    const struct lum_light *light = &pass->snapshot->lights.lights[i];
    *layer = (struct lum_layer){.light = *light, .salt = lum_hash_text(light->id), .index = i};
    layer->whole = lum_calloc(pass->tiling.n, 1);
    if (!layer->whole || !init_buffers(layer, pass))
        return finish_layer(layer), false;
    if (is_soft(pass, light))
        return lum_area_visibility_init(&layer->area, pass, layer->salt) || (finish_layer(layer), false);
    size_t n = (size_t)pass->tiling.n * LUM_TILE_PIXELS;
    layer->visibility = lum_calloc(n, sizeof *layer->visibility);
    layer->inner = has_edges(pass, light) ? lum_calloc(n, sizeof *layer->inner) : NULL;
    if (layer->visibility && (layer->inner || !has_edges(pass, light)))
        return true;
    finish_layer(layer);
    return false;
}

/* Layers keep what panes leave as long as there are any. Where one is there no more, all that was seen through it is
 * forgotten already, and where one is new, so is all that is seen through it. False: memory is short. */
static bool fit_panes(struct lum_layers *l, const struct lum_pass *pass)
{
    size_t n = (size_t)pass->tiling.n * LUM_TILE_PIXELS;
    bool panes = lum_pass_panes(pass), ok = true;
    for (uint32_t k = 0; k < l->n_layers; k++) {
        struct lum_layer *layer = &l->layers[k];
        if (layer->tiles)
            continue;
        if (layer->area.visibility) {
            ok = ok && lum_area_visibility_fit_panes(&layer->area, pass, panes);
        } else if (!panes) {
            lum_free(layer->left);
            layer->left = NULL;
        } else if (!layer->left) {
            layer->left = lum_calloc(n, sizeof *layer->left);
            ok = ok && layer->left;
        }
    }
    return ok;
}

static bool init_lean(struct lum_layer *layer, const struct lum_pass *pass, uint32_t i)
{
    const struct lum_light *light = &pass->snapshot->lights.lights[i];
    *layer = (struct lum_layer){.light = *light, .salt = lum_hash_text(light->id), .index = i};
    layer->n_tiles = pass->tiling.n;
    layer->tiles = lum_calloc(pass->tiling.n, sizeof *layer->tiles);
    layer->state = lum_calloc(pass->tiling.n, 1);
    return (layer->tiles && layer->state) || (finish_layer(layer), false);
}

bool lum_layers_in_many_lights(const struct lum_layers *l, uint32_t light)
{
    return l->layer_of[light] == LUM_NO_OBJECT || l->layers[l->layer_of[light]].tiles;
}

/* A layer for each shining light that has none, within the budget; lean ones for soft lights beyond it. False: memory
 * is short. */
static bool add_layers(struct lum_layers *l, const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    for (uint32_t i = 0; i < lights->n_lights; i++)
        l->layer_of[i] = LUM_NO_OBJECT;
    for (uint32_t k = 0; k < l->n_layers; k++)
        l->layer_of[l->layers[k].index] = k;
    size_t used = 0;
    bool exhausted = false;
    for (uint32_t k = 0; k < l->n_layers; k++)
        used += l->layers[k].tiles ? 0 : layer_bytes(pass, l->layers[k].area.visibility);
    for (uint32_t a = 0; a < lights->n_active && l->n_layers < l->capacity; a++) {
        uint32_t i = lights->active[a];
        bool area = is_soft(pass, &lights->lights[i]);
        size_t bytes = layer_bytes(pass, area);
        if (l->layer_of[i] != LUM_NO_OBJECT || !lum_layers_hold(pass, &lights->lights[i]))
            continue;
        exhausted = exhausted || (!(l->has_many_lights && area) && used + bytes > pass->settings->layers_bytes);
        bool lean = exhausted || (l->has_many_lights && area);
        if (lean && !(area && l->n_lean < LUM_LEAN_LAYERS))
            continue;
        if (!(lean ? init_lean : init_layer)(&l->layers[l->n_layers], pass, i))
            return false;
        l->layer_of[i] = l->n_layers++;
        l->n_lean += lean;
        used += lean ? 0 : bytes;
    }
    return true;
}

static bool update_shared(struct lum_layers *l, const struct lum_pass *pass)
{
    const struct lum_snapshot *s = pass->snapshot;
    l->shared_on = s->has_unlit;
    for (uint32_t a = 0; a < s->lights.n_active; a++)
        l->shared_on = l->shared_on || l->layer_of[s->lights.active[a]] == LUM_NO_OBJECT;
    if (l->shared_on && !l->shared.response)
        return init_buffers(&l->shared, pass);
    return true;
}

/* Arrays by light, grown when the table grew. */
static bool reserve(struct lum_layers *l, uint32_t n_lights)
{
    if (n_lights <= l->capacity)
        return true;
    struct lum_layer *layers = lum_calloc(n_lights, sizeof *layers);
    uint32_t *layer_of = lum_calloc(n_lights, sizeof *layer_of);
    struct lum_light *unit = lum_calloc(n_lights, sizeof *unit);
    if (!layers || !layer_of || !unit) {
        lum_free(layers);
        lum_free(layer_of);
        lum_free(unit);
        return false;
    }
    if (l->n_layers)
        memcpy(layers, l->layers, l->n_layers * sizeof *layers);
    lum_free(l->layers);
    lum_free(l->layer_of);
    lum_free(l->unit_lights);
    l->layers = layers;
    l->layer_of = layer_of;
    l->unit_lights = unit;
    l->capacity = n_lights;
    return true;
}

/* For the guidance of soft shadows. */
static bool reserve_brightness(struct lum_layers *l, const struct lum_pass *pass)
{
    bool area = false;
    for (uint32_t k = 0; k < l->n_layers; k++)
        area = area || l->layers[k].area.visibility;
    if (area && !l->brightness)
        l->brightness = lum_calloc(lum_area_tiling(pass).n, sizeof *l->brightness);
    return !area || l->brightness;
}

/* The lights that have no layer, when a soft one is among them. */
static bool update_many_lights(struct lum_layers *l, const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    l->many_lights.on = false;
    for (uint32_t a = 0; a < lights->n_active; a++)
        l->many_lights.on = l->many_lights.on || (lum_layers_in_many_lights(l, lights->active[a]) &&
                                                  is_soft(pass, &lights->lights[lights->active[a]]));
    return !l->many_lights.on || lum_many_lights_reserve(&l->many_lights, pass);
}

static bool find_places(struct lum_layers *l)
{
    bool ok = true;
    for (uint32_t k = 0; ok && k < l->n_layers; k++)
        if (l->layers[k].area.visibility)
            ok = lum_area_find_stratum_points(&l->layers[k].area, &l->unit, l->layers[k].index);
    return ok;
}

static void make_unit(struct lum_layers *l, const struct lum_snapshot *s)
{
    for (uint32_t i = 0; i < s->lights.n_lights; i++) {
        l->unit_lights[i] = s->lights.lights[i];
        l->unit_lights[i].power = lum_grey(1.0f);
        l->unit_lights[i].on = true;
    }
    memcpy(&l->unit, s, sizeof l->unit);
    l->unit.lights.lights = l->unit_lights;
}

static void drop_layers(struct lum_layers *l)
{
    for (uint32_t i = 0; i < l->n_layers; i++)
        finish_layer(&l->layers[i]);
    finish_layer(&l->shared);
    lum_many_lights_finish(&l->many_lights);
    l->n_layers = l->n_lean = 0;
}

/* The eye moved: who sees which light stays as true as it was, of other pixels. */
static void step_back(struct lum_layers *l, const struct lum_pass *pass)
{
    l->history_eye = l->eye;
    l->n_moves++;
    for (uint32_t i = 0; i < l->n_layers; i++) {
        struct lum_layer *layer = &l->layers[i];
        memset(layer->state, LUM_LAYER_EMPTY, pass->tiling.n);
        if (layer->whole)
            memset(layer->whole, 0, pass->tiling.n);
        if (layer->area.visibility)
            lum_area_visibility_to_history(&layer->area, pass);
    }
    lower(&l->shared, pass, LUM_LAYER_EMPTY, l->doubted);
    lum_many_lights_forget(&l->many_lights, pass);
}

/* Of the edits that change who sees which light, objects moved, and no more. */
static bool is_geometry_alone(uint32_t edits)
{
    return edits & LUM_EDIT_BIT(LUM_EDIT_GEOMETRY) &&
           !lum_is_stale(edits & ~LUM_EDIT_BIT(LUM_EDIT_GEOMETRY), LUM_PRODUCT_VISIBILITY);
}

/* Which tiles may show something else by way of mirrors and glass, whatever light it is lit by. */
static void follow_branches(struct lum_layers *l, const struct lum_pass *pass)
{
    for (uint32_t t = 0; l->branches && t < pass->tiling.n; t++)
        l->branches[t].stale = lum_motion_mask_tile(pass->motion_mask, &pass->tiling, t) ||
                               lum_branches_met(&l->branches[t], &pass->motion_mask->motion);
}

/* What mirrors and glass show of it may be something else. */
static bool is_met_behind(const struct lum_layers *l, const struct lum_pass *pass, uint32_t tile,
                          const struct lum_bounds *light)
{
    return !l->branches || l->branches[tile].stale ||
           lum_branches_light_met(&l->branches[tile], &pass->motion_mask->motion, light);
}

/* What a layer keeps of what mirrors and glass show, and of hard shadows. light: where it shines from; NULL: that is
 * not known, and nothing stays. */
static void keep_tiles(struct lum_layers *l, const struct lum_pass *pass, struct lum_layer *layer,
                       const struct lum_bounds *light)
{
    for (uint32_t t = 0; t < pass->tiling.n; t++) {
        bool lost = !light || lum_motion_mask_tile(pass->motion_mask, &pass->tiling, t) ||
                    (layer->state[t] == LUM_LAYER_COMPLETE && is_met_behind(l, pass, t, light)) ||
                    (layer->visibility && lum_motion_mask_between(pass->motion_mask, &pass->tiling, t, light));
        if (!lost)
            continue;
        layer->state[t] = LUM_LAYER_EMPTY;
        if (layer->whole)
            layer->whole[t] = 0;
    }
}

/* Something moved: layers keep what cannot have changed. */
static void follow_motion(struct lum_layers *l, const struct lum_pass *pass, uint32_t edits)
{
    bool shade = lum_is_stale(edits & ~LUM_EDIT_BIT(LUM_EDIT_GEOMETRY), LUM_PRODUCT_RESPONSE);
    uint32_t n_lost = 0, n_soft = 0;
    follow_branches(l, pass);
    for (uint32_t i = 0; i < l->n_layers; i++) {
        struct lum_layer *layer = &l->layers[i];
        struct lum_bounds bounds;
        bool still = lum_motion_mask_light(pass->motion_mask, &layer->light, &bounds);
        keep_tiles(l, pass, layer, still && !shade && !layer->tiles ? &bounds : NULL);
        if (!layer->area.visibility)
            continue;
        n_soft++;
        if (still) {
            n_lost += lum_area_visibility_follow_motion(&layer->area, pass, &bounds, layer->whole);
            if (shade)
                reshade(layer, pass, l->doubted);
        } else {
            n_lost += pass->motion_mask->blocks.n;
            lum_area_visibility_forget(&layer->area, pass);
        }
    }
    lower(&l->shared, pass, LUM_LAYER_EMPTY, l->doubted);
    lum_many_lights_follow_motion(&l->many_lights, pass);
    if (n_soft > 0 && !lum_is_stale(edits, LUM_PRODUCT_OWN_LAYER)) /* or those of the lights that moved are lost, too */
        l->refined_share = (float)n_lost / (float)n_soft / (float)pass->motion_mask->blocks.n;
}

/* What the edits since the last update make stale. */
static void mark_stale(struct lum_layers *l, const struct lum_pass *pass, uint64_t gbuffer_stamp)
{
    uint32_t edits = lum_basis_renew(&l->basis, pass);
    if (gbuffer_stamp != l->gbuffer_stamp)
        edits |= LUM_EDIT_BIT(LUM_EDIT_CAMERA);
    l->doubted = edits & (LUM_EDIT_BIT(LUM_EDIT_MATERIAL) | LUM_EDIT_BIT(LUM_EDIT_QUANTITY));
    bool same = !lum_is_stale(edits, LUM_PRODUCT_LAYERS), moved = lum_is_stale(edits, LUM_PRODUCT_GBUFFER);
    bool same_visibility = same && !lum_is_stale(edits, LUM_PRODUCT_VISIBILITY);
    bool elsewhere = same_visibility && !lum_is_stale(edits, LUM_PRODUCT_OWN_LAYER) && edits & LUM_EDITS_OF_SCENE;
    l->refined_share = elsewhere ? 0.0f : 1.0f;
    if (!same)
        drop_layers(l);
    if (moved || !same)
        l->reprojected = same && pass->settings->reproject_shadows && !(edits & LUM_EDIT_BIT(LUM_EDIT_GEOMETRY));
    if (l->reprojected && moved)
        step_back(l, pass);
    else if (same && lum_motion_mask_is_known(pass->motion_mask) && is_geometry_alone(edits))
        follow_motion(l, pass, edits);
    else if (!same_visibility)
        lower_all(l, pass, LUM_LAYER_EMPTY);
    else if (lum_is_stale(edits, LUM_PRODUCT_RESPONSE))
        lower_all(l, pass, LUM_LAYER_VISIBILITY);
    count_lights(l, pass, lum_is_stale(edits, LUM_PRODUCT_OWN_LAYER));
    if (lum_is_stale(edits, LUM_PRODUCT_SHARED)) {
        lower(&l->shared, pass, LUM_LAYER_EMPTY, l->doubted);
        lum_many_lights_relight(&l->many_lights);
        l->many_lights.moved = l->many_lights.moved || lum_is_stale(edits, LUM_PRODUCT_OWN_LAYER);
    }
    for (uint32_t k = 0; lum_is_stale(edits, LUM_PRODUCT_PLACES) && k < l->n_layers; k++)
        l->layers[k].area.placed = false;
    l->gbuffer_stamp = gbuffer_stamp;
    l->eye = pass->eye;
}

enum lum_status lum_layers_update(struct lum_layers *l, const struct lum_pass *pass, uint64_t gbuffer_stamp,
                                  struct lum_error *err)
{
    if (l->n_tiles != pass->tiling.n) {
        lum_layers_finish(l);
        l->n_tiles = pass->tiling.n;
    }
    l->n_passes++;
    l->starved = false;
    mark_stale(l, pass, gbuffer_stamp);
    const struct lum_snapshot *s = pass->snapshot;
    if (!l->branches) /* without them all is shaded anew when anything moves */
        l->branches = lum_calloc(pass->tiling.n, sizeof *l->branches);
    bool ok = reserve(l, s->lights.n_lights);
    if (ok)
        make_unit(l, s);
    if (ok && add_layers(l, pass) && fit_panes(l, pass) && update_shared(l, pass) && find_places(l) &&
        reserve_brightness(l, pass) && update_many_lights(l, pass))
        return LUM_OK;
    lum_layers_finish(l);
    return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the buffers of %u lights", s->lights.n_active);
}
