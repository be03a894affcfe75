#include "core/estimator/penumbra.h"

struct lum_layer *lum_penumbra_next(const struct lum_pass *pass, uint32_t *inout_a)
{
    struct lum_layers *l = pass->layers;
    const struct lum_light_table *lights = &pass->snapshot->lights;
    while (*inout_a < lights->n_active) {
        uint32_t k = l->layer_of[lights->active[(*inout_a)++]];
        if (k != LUM_NO_OBJECT && l->layers[k].soft.seen)
            return &l->layers[k];
    }
    return NULL;
}

bool lum_penumbra_wants(const struct lum_pass *pass, const struct lum_layer *layer, size_t pixel)
{
    uint32_t gloss = LUM_PIXEL_GLOSS, either = LUM_PIXEL_DIFFUSE | LUM_PIXEL_GLOSS;
    return pass->surfaces->kind[pixel] & (layer->index == pass->cached_sky ? gloss : either);
}

void lum_penumbra_look(const struct lum_pass *pass, const struct lum_layer *layer, size_t pixel,
                       struct lum_penumbra_view *ret)
{
    ret->pass = pass;
    ret->layer = layer;
    ret->pixel = pixel;
    ret->wanted = lum_penumbra_wants(pass, layer, pixel);
    if (!ret->wanted)
        return;
    ret->scramble = lum_hash_combine(layer->salt, (uint32_t)pixel);
    lum_light_look(&pass->layers->unit, layer->index, pass->surfaces->p[pixel], &ret->light);
}

/* Pixels share the strata, of 1/4 x 1/4, and not the place in them, or penumbras would have 16 steps: the digits below
 * are exclusive-ored with a pixel's own, which leaves its 16 points a (0,4,2)-net. But not of the environment: through
 * a window few of them see the sky, and what would be grain of single bright pixels is better seen as the shadows of 16
 * lamps. */
struct lum_vec2 lum_penumbra_point(const struct lum_penumbra_view *v, uint32_t k)
{
    struct lum_vec2 point = v->layer->soft.point[k];
    if (v->layer->light.kind == LUM_EMIT_ENVIRONMENT)
        return point;
    int32_t x = (int32_t)(point.x * 0x1p24f) ^ (int32_t)(v->scramble & 0xfff) << 10;
    int32_t y = (int32_t)(point.y * 0x1p24f) ^ (int32_t)(v->scramble >> 12 & 0xfff) << 10;
    return (struct lum_vec2){(float)x * 0x1p-24f, (float)y * 0x1p-24f};
}

void lum_penumbra_points(const struct lum_penumbra_view *v, struct lum_vec2 ret_point[LUM_SOFT_POINTS])
{
    for (uint32_t k = 0; k < LUM_SOFT_POINTS; k++)
        ret_point[k] = lum_penumbra_point(v, k);
}

enum lum_penumbra_side lum_penumbra_sample(const struct lum_penumbra_view *v, uint32_t k,
                                           struct lum_light_sample *ret_sample)
{
    const struct lum_surfaces *s = v->pass->surfaces;
    if (!v->wanted || !lum_light_view_sample(&v->light, lum_penumbra_point(v, k), ret_sample))
        return LUM_PENUMBRA_NEEDLESS;
    uint8_t kind = s->kind[v->pixel];
    float shading = lum_dot(ret_sample->wi, s->n[v->pixel]), side = lum_dot(ret_sample->wi, s->ng[v->pixel]);
    bool through = (kind & LUM_PIXEL_GLOSS) && (kind & LUM_PIXEL_SPECULAR); /* rough glass */
    if (!(shading > 0.0f) && !(through && shading < 0.0f))
        return LUM_PENUMBRA_NEEDLESS;
    return shading > 0.0f ? (side > 0.0f ? LUM_PENUMBRA_OPEN : LUM_PENUMBRA_HIDDEN)
                          : (side < 0.0f ? LUM_PENUMBRA_OPEN : LUM_PENUMBRA_NEEDLESS);
}
