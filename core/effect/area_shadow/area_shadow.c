#include "core/effect/area_shadow/area_shadow.h"
#include "core/math/sampler.h"

struct lum_layer *lum_area_next(const struct lum_pass *pass, uint32_t *inout_a)
{
    struct lum_layers *l = pass->layers;
    const struct lum_light_table *lights = &pass->snapshot->lights;
    while (*inout_a < lights->n_active) {
        uint32_t k = l->layer_of[lights->active[(*inout_a)++]];
        if (k != LUM_NO_OBJECT && l->layers[k].area.visibility)
            return &l->layers[k];
    }
    return NULL;
}

bool lum_area_wants(const struct lum_pass *pass, const struct lum_layer *layer, size_t pixel)
{
    uint32_t gloss = LUM_PIXEL_GLOSS, either = LUM_PIXEL_DIFFUSE | LUM_PIXEL_GLOSS;
    return pass->surfaces->kind[pixel] & (layer->index == pass->cached_sky ? gloss : either);
}

void lum_area_look(const struct lum_pass *pass, const struct lum_layer *layer, size_t pixel, struct lum_area_view *ret)
{
    ret->pass = pass;
    ret->layer = layer;
    ret->pixel = pixel;
    ret->wanted = lum_area_wants(pass, layer, pixel);
    if (!ret->wanted)
        return;
    ret->scramble = lum_hash_combine(layer->salt, (uint32_t)pixel);
    lum_light_look(&pass->layers->unit, layer->index, pass->surfaces->p[pixel], &ret->light);
}

/* Pixels share the strata, of 1/4 x 1/4, and not the place in them, or penumbras would have 16 steps. But not of the
 * environment: through a window few of them see the sky, and what would be grain of single bright pixels is better seen
 * as the shadows of 16 lamps. */
static struct lum_vec2 point_of(const struct lum_area_view *v, uint32_t k)
{
    struct lum_vec2 point = v->layer->area.point[k];
    if (v->layer->light.kind == &lum_emitter_environment)
        return point;
    return lum_area_scramble(point, v->scramble, v->scramble >> 12);
}

/* Places on discs and meshes are the same for all who look, but those who are near one without a closed form: they are
 * found once, and each pixel takes one of a stratum. Finding one on a textured mesh for every pixel took a sixteenth of
 * a first frame of sibenik. */
static bool sample(const struct lum_area_view *v, uint32_t k, struct lum_light_sample *ret_sample)
{
    const struct lum_area_visibility *area = &v->layer->area;
    if (!area->place || v->light.kind == LUM_VIEW_FACETS)
        return lum_light_view_sample(&v->light, point_of(v, k), ret_sample);
    return lum_light_sample_place(&v->pass->layers->unit.lights.lights[v->layer->index], v->pass->surfaces->p[v->pixel],
                                  &area->place[k * LUM_AREA_STRATUM_POINTS + v->scramble % LUM_AREA_STRATUM_POINTS],
                                  ret_sample);
}

void lum_area_weights(const struct lum_area_view *v, uint32_t asked, float ret_weight[LUM_AREA_POINTS])
{
    struct lum_vec3 n = v->pass->surfaces->n[v->pixel];
    struct lum_vec2 point[LUM_AREA_POINTS];
    struct lum_light_sample ls;
    if (!v->layer->area.place || v->light.kind == LUM_VIEW_FACETS) {
        for (uint32_t k = 0; k < LUM_AREA_POINTS; k++)
            point[k] = point_of(v, k);
        lum_light_view_weights(&v->light, n, point, asked, ret_weight);
        return;
    }
    for (uint32_t left = asked; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left);
        ret_weight[k] = sample(v, k, &ls) ? lum_dot(ls.wi, n) / ls.pdf_sa : 0.0f;
    }
}
_Static_assert(LUM_AREA_POINTS == LUM_LIGHT_WEIGHTS, "all strata of a pixel are weighed at once");

enum lum_area_side lum_area_sample(const struct lum_area_view *v, uint32_t k, struct lum_light_sample *ret_sample)
{
    const struct lum_surfaces *s = v->pass->surfaces;
    if (!v->wanted || !sample(v, k, ret_sample))
        return LUM_AREA_NEEDLESS;
    uint8_t kind = s->kind[v->pixel];
    float shading = lum_dot(ret_sample->wi, s->n[v->pixel]), side = lum_dot(ret_sample->wi, s->ng[v->pixel]);
    bool through = (kind & LUM_PIXEL_GLOSS) && (kind & LUM_PIXEL_SPECULAR); /* rough glass */
    if (!(shading > 0.0f) && !(through && shading < 0.0f))
        return LUM_AREA_NEEDLESS;
    return shading > 0.0f ? (side > 0.0f ? LUM_AREA_OPEN : LUM_AREA_HIDDEN)
                          : (side < 0.0f ? LUM_AREA_OPEN : LUM_AREA_NEEDLESS);
}

const struct lum_effect_row lum_effect_soft_shadow = {.demand = lum_demand_by_light,
                                                      .why = "shines from an area",
                                                      .why_not = "no light with an area is on",
                                                      .adds = LUM_ADDS_WHITE,
                                                      .guided = true};
const struct lum_effect_row lum_effect_environment = {
    .demand = lum_demand_by_light, .why = "shines from all around", .why_not = "no environment light is on"};
