/* Soft shadows (thesis 5.3.3, listing 5.3): lights that have an area, and the environment.
 *
 * A light's samples are the first LUM_AIS_SETS * max points of one low-discrepancy sequence, the same for all pixels
 * and frames: iteration j takes points LUM_AIS_SETS j and following, one for each place of the pattern. So the sets of
 * the iterations are disjoint, each of them is spread over the light by itself, and any number of iterations together
 * are the beginning of the sequence. Lights take turns, with a guidance of their own (lum_guidance_shadow says why).
 *
 * What the diffuse base reflects is kept as if the surface were white; everything else goes to the gloss component,
 * where it is wanted: the lobes of coats and metals, and what a coat lets through differently from its mean. */
#include "core/estimator/ais.h"

#include <string.h>

/* Sampler pairs of lights, as in estimator/direct.c. */
#define PAIR_LIGHTS 0x80000000u

/* Light reflected by a pixel. */
struct reflected {
    struct lum_rgb white, gloss;
};

/* About 90 KiB: lives on a worker's stack. */
struct shadow {
    struct lum_ais_packet packet;
    const struct lum_pass *pass;
    struct lum_counters *counters;
    bool gloss;
    /* the light at hand */
    uint32_t light, salt;
    struct reflected sum[LUM_AIS_PIXELS];                   /* of all iterations */
    uint16_t sampled[LUM_AIS_TILES], missed[LUM_AIS_TILES]; /* in the initial pass */
    /* rays under way */
    struct lum_rays rays;
    struct reflected value[LUM_RAY_BATCH];
    uint16_t pixel[LUM_RAY_BATCH];
};

/* What the surface of a pixel makes of light from wi, besides white cos / pi. */
static struct lum_rgb reflect_gloss(const struct shadow *s, size_t at, struct lum_vec3 wi, float white)
{
    const struct lum_pass *pass = s->pass;
    uint32_t x = (uint32_t)(at % pass->tiling.w), y = (uint32_t)(at / pass->tiling.w);
    uint32_t tile = y / LUM_TILE_SIDE * pass->tiling.nx + x / LUM_TILE_SIDE;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct lum_vec3 d = lum_eye_direction(&pass->eye, (float)x + 0.5f, (float)y + 0.5f), wo = lum_v3_neg(d);
    struct lum_surface surface;
    struct lum_bsdf b;
    lum_snapshot_surface(pass->snapshot, &pass->gbuffer->tiles[tile], (y - r.y) * r.w + x - r.x, d, &surface);
    lum_bsdf_init(&b, &pass->snapshot->materials[surface.material], &surface, wo);
    struct lum_bsdf_value v = lum_bsdf_eval_parts(&b, wo, wi);
    return lum_rgb_add(v.gloss, lum_rgb_mad(v.diffuse, pass->surfaces->albedo[at], -white));
}

/* False: nothing is reflected. */
static bool reflect(const struct shadow *s, size_t at, const struct lum_light_sample *ls, struct reflected *ret_value)
{
    const struct lum_surfaces *surfaces = s->pass->surfaces;
    float cosine = lum_dot(surfaces->n[at], ls->wi), side = lum_dot(surfaces->ng[at], ls->wi);
    float white = cosine > 0.0f && side > 0.0f ? cosine * LUM_INV_PI : 0.0f;
    struct lum_rgb arriving = lum_rgb_scale(ls->radiance, 1.0f / ls->pdf_sa), gloss = lum_grey(0.0f);
    if (s->gloss && (surfaces->kind[at] & LUM_PIXEL_GLOSS))
        gloss = reflect_gloss(s, at, ls->wi, white);
    if (!(white > 0.0f) && gloss.r == 0.0f && gloss.g == 0.0f && gloss.b == 0.0f)
        return false;
    if (s->pass->on[LUM_EFFECT_MEDIA])
        arriving =
            lum_rgb_mul(arriving, lum_media_transmittance(s->pass->snapshot, surfaces->p[at], ls->wi, ls->distance));
    *ret_value = (struct reflected){lum_rgb_scale(arriving, white), lum_rgb_mul(arriving, gloss)};
    return true;
}

static void add(struct shadow *s, uint32_t pixel, const struct reflected *value)
{
    struct reflected *sum = &s->sum[pixel];
    sum->white = lum_rgb_add(sum->white, value->white);
    sum->gloss = lum_rgb_add(sum->gloss, value->gloss);
}

static void trace_rays(struct shadow *s, uint32_t iteration)
{
    uint8_t occluded[LUM_RAY_BATCH];
    if (s->rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of(s->pass->snapshot, s->counters);
    lum_trace_any(&trace, &s->rays, occluded);
    s->counters->rays[lum_light_ray_kind(&s->pass->snapshot->lights.lights[s->light])] += s->rays.n;
    for (uint32_t r = 0; r < s->rays.n; r++) {
        if (!occluded[r])
            add(s, s->pixel[r], &s->value[r]);
        else if (iteration == 0) /* listing 5.3, lines 3 and 4 */
            s->missed[lum_ais_tile(&s->packet, s->pixel[r])]++;
    }
    s->rays.n = 0;
}

/* contrib(getSample(pixel)) of listing 5.1. A sample that the surface does not see for its own orientation is neither
 * lit nor occluded: no ray, and not counted. */
static void sample_pixel(struct shadow *s, uint32_t pixel, struct lum_vec2 u, uint32_t iteration)
{
    size_t at = lum_ais_pixel(&s->packet, pixel);
    const struct lum_surfaces *surfaces = s->pass->surfaces;
    struct lum_light_sample ls;
    struct reflected value;
    if (!lum_light_sample_at(s->pass->snapshot, s->light, surfaces->p[at], u, &ls) || !(ls.pdf_sa > 0.0f) ||
        !reflect(s, at, &ls, &value))
        return;
    if (iteration == 0)
        s->sampled[lum_ais_tile(&s->packet, pixel)]++;
    if (s->rays.n == LUM_RAY_BATCH)
        trace_rays(s, iteration);
    uint32_t r = s->rays.n;
    if (!lum_shadow_ray(&s->rays, surfaces->p[at], surfaces->ng[at], ls.wi, ls.distance)) {
        add(s, pixel, &value);
        return;
    }
    s->value[r] = value;
    s->pixel[r] = (uint16_t)pixel;
}

static void take_samples(struct shadow *s, uint32_t iteration)
{
    uint32_t seed = lum_sampler_at(0, 0, 0, s->pass->settings->seed).pixel_seed;
    for (uint32_t place = 0; place < LUM_AIS_SETS; place++) {
        struct lum_ais_list list;
        lum_ais_list_pixels(&s->packet, place, iteration, &list);
        struct lum_sampler sampler = {seed, LUM_AIS_SETS * iteration + lum_ais_set(place, iteration)};
        struct lum_vec2 u = lum_sampler_2d(&sampler, PAIR_LIGHTS | s->salt);
        for (uint32_t k = 0; k < list.n; k++)
            sample_pixel(s, list.pixel[k], u, iteration);
    }
    trace_rays(s, iteration);
}

/* Listing 5.3, lines 9 to 20. */
static void guide(struct shadow *s)
{
    const struct lum_ais *ais = lum_ais_of(s->pass);
    for (uint32_t t = 0; t < s->packet.tiles_x * s->packet.tiles_y; t++)
        s->packet.further[t] =
            (uint8_t)(ais->adaptive ? lum_guidance_shadow(s->sampled[t], s->missed[t], ais->max) : ais->max - 1);
}

static void add_to_components(const struct shadow *s)
{
    const struct lum_ais_packet *p = &s->packet;
    for (uint32_t y = 0; y < p->h; y++)
        for (uint32_t x = 0; x < p->w; x++) {
            uint32_t i = y * LUM_PACKET_SIDE + x;
            if (!p->wanted[i])
                continue;
            size_t at = lum_ais_pixel(p, i);
            float weight = 1.0f / (float)(1 + p->further[lum_ais_tile(p, i)]);
            lum_component_add(s->pass->components, LUM_COMPONENT_SHADOW, at, lum_rgb_scale(s->sum[i].white, weight));
            lum_component_add(s->pass->components, LUM_COMPONENT_GLOSS, at, lum_rgb_scale(s->sum[i].gloss, weight));
        }
}

/* Listing 5.1 for one light. */
static void shadow_of_light(struct shadow *s)
{
    memset(s->packet.further, 0, sizeof s->packet.further);
    memset(s->sum, 0, sizeof s->sum);
    memset(s->sampled, 0, sizeof s->sampled);
    memset(s->missed, 0, sizeof s->missed);
    take_samples(s, 0);
    guide(s);
    uint32_t last = lum_ais_last_iteration(&s->packet);
    for (uint32_t iteration = 1; iteration <= last; iteration++)
        take_samples(s, iteration);
    add_to_components(s);
    lum_ais_note(&s->packet, LUM_COMPONENT_SHADOW);
}

static void shadow_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    if (pass->settings->max_depth == 0 || lum_components_enter(pass, LUM_STAGE_SHADOW, packet))
        return;
    struct shadow s;
    s.pass = pass;
    s.counters = counters;
    s.gloss = pass->on[LUM_EFFECT_GLOSSY];
    s.rays.n = 0;
    lum_ais_packet_init(&s.packet, pass, packet, 1);
    if (!lum_ais_packet_want(&s.packet, LUM_PIXEL_DIFFUSE | (s.gloss ? LUM_PIXEL_GLOSS : 0)))
        return;
    const struct lum_light_table *lights = &pass->snapshot->lights;
    for (uint32_t a = 0; a < lights->n_active; a++) {
        const struct lum_light *light = &lights->lights[lights->active[a]];
        enum lum_effect effect = lum_light_effect(light);
        if (!pass->on[effect] || pass->settings->method->serves[effect] != &lum_estimator_ais_shadow)
            continue;
        s.light = lights->active[a];
        s.salt = lum_hash_text(light->id);
        shadow_of_light(&s);
    }
}

const struct lum_estimator lum_estimator_ais_shadow = {
    .name = "ais_shadow",
    .stage = LUM_STAGE_SHADOW,
    .tile = shadow_packet,
    .packets = true,
    .components = LUM_COMPONENT_BIT(LUM_COMPONENT_SHADOW),
};

/* Calls for the buffer; what goes there is found by the shadow rays. */
static void gloss_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    (void)pass;
    (void)packet;
    (void)counters;
}

const struct lum_estimator lum_estimator_ais_gloss = {
    .name = "ais_gloss",
    .stage = LUM_STAGE_SHADOW,
    .tile = gloss_packet,
    .packets = true,
    .components = LUM_COMPONENT_BIT(LUM_COMPONENT_GLOSS),
};
