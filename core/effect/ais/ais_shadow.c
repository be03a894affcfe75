/* Soft shadows (thesis 5.3.3, listing 5.3): lights that have an area, and the environment.
 *
 * A light's samples are the first LUM_AIS_SUBSETS * max points of one low-discrepancy sequence, the same for all pixels
 * and frames: iteration j takes points LUM_AIS_SUBSETS j and following, one for each place of the pattern. So the
 * subsets of the iterations are disjoint, each of them is spread over the light by itself, and any number of iterations
 * together are the beginning of the sequence. Lights take turns, with a guidance of their own (lum_guidance_shadow says
 * why).
 *
 * All pixels of a list use one point of the light: it is found once, and what it brings to them in vector loops.
 *
 * What the diffuse base reflects is kept as if the surface were white, for its neighbours may be of another colour; the
 * lobes of coats and metals go to the gloss component, where it is wanted. */
#include "core/effect/ais/ais.h"
#include "core/light/sample.h"
#include "core/material/bsdf.h"
#include "core/math/sampler.h"
#include "core/math/sampler_pairs.h"
#include "core/scene/surface.h"

#include <string.h>

/* Light reflected by a pixel. */
struct reflected {
    struct lum_rgb white, gloss;
};

/* What reflects with a gloss, of a pixel that does. */
struct lobes {
    struct lum_bsdf bsdf;
    struct lum_vec3 wo;
};

/* A list's pixels and their samples of the light, as vector loops read them. */
struct fan {
    uint32_t n, n_padded;
    _Alignas(64) float px[LUM_RAY_BATCH];
    float py[LUM_RAY_BATCH], pz[LUM_RAY_BATCH], nx[LUM_RAY_BATCH], ny[LUM_RAY_BATCH], nz[LUM_RAY_BATCH];
    float gx[LUM_RAY_BATCH], gy[LUM_RAY_BATCH], gz[LUM_RAY_BATCH]; /* geometric normals */
    /* the samples */
    float wx[LUM_RAY_BATCH], wy[LUM_RAY_BATCH], wz[LUM_RAY_BATCH], distance[LUM_RAY_BATCH];
    float weight[LUM_RAY_BATCH]; /* 1 / pdf; 0: there is none */
    float near[LUM_RAY_BATCH];   /* > 0: has a sample of its own */
    float white[LUM_RAY_BATCH];  /* cos / pi, 0 below the horizon */
    struct lum_rgb radiance[LUM_RAY_BATCH];
};

/* About 530 KiB: lives on a worker's stack. */
struct shadow {
    struct lum_ais_cell cell;
    const struct lum_pass *pass;
    struct lum_counters *counters;
    bool gloss;
    struct lobes lobes[LUM_AIS_PIXELS]; /* of pixels with gloss, if it is wanted */
    /* the light at hand */
    uint32_t light, salt;
    struct reflected sum[LUM_AIS_PIXELS];                   /* of all iterations */
    uint16_t sampled[LUM_AIS_TILES], missed[LUM_AIS_TILES]; /* in the initial pass */
    struct fan fan;
    /* rays under way */
    struct lum_rays rays;
    struct reflected value[LUM_RAY_BATCH];
    uint16_t pixel[LUM_RAY_BATCH];
};

/* ---- the samples of a list ---- */

static void load_points(struct shadow *s, const struct lum_ais_list *list)
{
    const struct lum_surfaces *surfaces = s->pass->surfaces;
    struct fan *f = &s->fan;
    f->n = list->n;
    f->n_padded = (list->n + 15u) & ~15u;
    for (uint32_t k = 0; k < f->n_padded; k++) {
        size_t at = lum_ais_pixel(&s->cell, list->pixel[k < list->n ? k : 0]);
        struct lum_vec3 p = surfaces->p[at], n = surfaces->n[at], ng = surfaces->ng[at];
        f->px[k] = p.x, f->py[k] = p.y, f->pz[k] = p.z;
        f->nx[k] = n.x, f->ny[k] = n.y, f->nz[k] = n.z;
        f->gx[k] = ng.x, f->gy[k] = ng.y, f->gz[k] = ng.z;
    }
}

/* The sample of pixel k is at d from it, on a light whose normal there is n. */
static inline void put_sample(struct fan *f, uint32_t k, struct lum_vec3 d, struct lum_vec3 n, float area)
{
    float r2 = d.x * d.x + d.y * d.y + d.z * d.z, r = sqrtf(r2), inv = 1.0f / r;
    float cos_light = -(d.x * n.x + d.y * n.y + d.z * n.z) * inv;
    float weight = cos_light * area * (inv * inv);
    f->wx[k] = d.x * inv, f->wy[k] = d.y * inv, f->wz[k] = d.z * inv;
    f->distance[k] = r;
    f->weight[k] = (weight > 0.0f) & (weight < INFINITY) ? weight : 0.0f;
}

static void aim_at_point(struct fan *f, const struct lum_light_target *t)
{
    for (uint32_t k = 0; k < f->n_padded; k++) {
        struct lum_vec3 d = {t->p.x - f->px[k], t->p.y - f->py[k], t->p.z - f->pz[k]};
        float front = d.x * t->n.x + d.y * t->n.y + d.z * t->n.z;
        float turn = t->both_sides & (front > 0.0f) ? -1.0f : 1.0f;
        struct lum_vec3 c = {t->centre.x - f->px[k], t->centre.y - f->py[k], t->centre.z - f->pz[k]};
        put_sample(f, k, d, lum_v3_mul(t->n, turn), t->area);
        f->near[k] = t->near2 - lum_dot(c, c);
    }
}

/* x in [0, 1] with a density that runs linearly from a to b, both above 0. */
static inline float warp_linear(float u, float a, float b)
{
    return u * (a + b) / (a + sqrtf(a * a + u * (b * b - a * a)));
}

static inline float corner(struct lum_vec3 c, struct lum_vec3 u, struct lum_vec3 v)
{
    struct lum_vec3 d = lum_v3_add(lum_v3_add(c, u), v);
    float r2 = lum_dot(d, d);
    return 1.0f / (r2 * sqrtf(r2));
}

/* The solid angle of a piece of a quad is as 1 / r^3, its distance from the quad's plane being the same everywhere. The
 * samples' density is bilinear between its values at the corners, so that their weights hardly differ. */
static void aim_at_quad(struct fan *f, const struct lum_light_target *t, struct lum_vec2 xi)
{
    struct lum_vec3 minus_u = lum_v3_neg(t->u), minus_v = lum_v3_neg(t->v);
    for (uint32_t k = 0; k < f->n_padded; k++) {
        struct lum_vec3 c = {t->p.x - f->px[k], t->p.y - f->py[k], t->p.z - f->pz[k]};
        float w00 = corner(c, minus_u, minus_v), w10 = corner(c, t->u, minus_v);
        float w01 = corner(c, minus_u, t->v), w11 = corner(c, t->u, t->v);
        float y = warp_linear(xi.y, w00 + w10, w01 + w11);
        float left = w00 + y * (w01 - w00), right = w10 + y * (w11 - w10);
        float x = warp_linear(xi.x, left, right);
        float density = 4.0f * (left + x * (right - left)) / (w00 + w10 + w01 + w11);
        struct lum_vec3 d = lum_v3_mad(lum_v3_mad(c, t->u, 2.0f * x - 1.0f), t->v, 2.0f * y - 1.0f);
        put_sample(f, k, d, t->n, t->area / density);
        f->near[k] = t->near2 - lum_dot(c, c);
    }
}

static void aim_along(struct fan *f, const struct lum_light_target *t)
{
    for (uint32_t k = 0; k < f->n_padded; k++) {
        f->wx[k] = t->wi.x, f->wy[k] = t->wi.y, f->wz[k] = t->wi.z;
        f->distance[k] = INFINITY;
        f->weight[k] = 1.0f / t->pdf_sa;
        f->near[k] = 0.0f;
    }
}

static void aim_each(struct shadow *s, uint32_t k, struct lum_vec2 u)
{
    struct fan *f = &s->fan;
    struct lum_light_sample ls;
    f->weight[k] = 0.0f;
    if (!lum_light_sample_at(s->pass->snapshot, s->light, lum_v3(f->px[k], f->py[k], f->pz[k]), u, &ls) ||
        !(ls.pdf_sa > 0.0f))
        return;
    f->wx[k] = ls.wi.x, f->wy[k] = ls.wi.y, f->wz[k] = ls.wi.z;
    f->distance[k] = ls.distance;
    f->weight[k] = 1.0f / ls.pdf_sa;
    f->radiance[k] = ls.radiance;
}

static void weigh(struct fan *f)
{
    for (uint32_t k = 0; k < f->n_padded; k++) {
        float cosine = f->wx[k] * f->nx[k] + f->wy[k] * f->ny[k] + f->wz[k] * f->nz[k];
        float side = f->wx[k] * f->gx[k] + f->wy[k] * f->gy[k] + f->wz[k] * f->gz[k];
        f->white[k] = (cosine > 0.0f) & (side > 0.0f) ? cosine * LUM_INV_PI : 0.0f;
    }
}

/* False: there is no sample. */
static bool aim(struct shadow *s, struct lum_vec2 u)
{
    struct fan *f = &s->fan;
    struct lum_light_target t;
    lum_light_aim(s->pass->snapshot, s->light, u, &t);
    if (t.kind == LUM_TARGET_NONE || (t.kind == LUM_TARGET_DIRECTION && !(t.pdf_sa > 0.0f)))
        return false;
    for (uint32_t k = 0; k < f->n; k++)
        f->radiance[k] = t.radiance;
    if (t.kind == LUM_TARGET_POINT)
        aim_at_point(f, &t);
    else if (t.kind == LUM_TARGET_QUAD)
        aim_at_quad(f, &t, u);
    else if (t.kind == LUM_TARGET_DIRECTION)
        aim_along(f, &t);
    for (uint32_t k = 0; k < f->n; k++)
        if (t.kind == LUM_TARGET_EACH || f->near[k] > 0.0f)
            aim_each(s, k, u);
    weigh(f);
    return true;
}

/* ---- what they bring ---- */

static void find_lobes(struct shadow *s)
{
    const struct lum_pass *pass = s->pass;
    for (uint32_t i = 0; i < LUM_AIS_PIXELS; i++) {
        if (!s->cell.wanted[i])
            continue;
        size_t at = lum_ais_pixel(&s->cell, i);
        if (!(pass->surfaces->kind[at] & LUM_PIXEL_GLOSS))
            continue;
        uint32_t x = (uint32_t)(at % pass->tiling.w), y = (uint32_t)(at / pass->tiling.w);
        uint32_t tile = y / LUM_TILE_SIDE * pass->tiling.nx + x / LUM_TILE_SIDE;
        struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
        struct lum_vec3 d = lum_eye_direction(&pass->eye, (float)x + 0.5f, (float)y + 0.5f);
        struct lum_surface surface;
        lum_snapshot_surface(pass->snapshot, &pass->gbuffer->tiles[tile], (y - r.y) * r.w + x - r.x, d, &surface);
        s->lobes[i].wo = lum_v3_neg(d);
        lum_bsdf_init(&s->lobes[i].bsdf, &pass->snapshot->materials[surface.material], &surface, s->lobes[i].wo);
    }
}

/* What a surface with a gloss makes of light from wi. A coat lets through less of light that grazes: that is told as a
 * share of the albedo, which is the mean. */
static struct reflected reflect_gloss(const struct shadow *s, uint32_t pixel, struct lum_vec3 wi)
{
    const struct lobes *l = &s->lobes[pixel];
    const struct lum_rgb albedo = s->pass->surfaces->albedo[lum_ais_pixel(&s->cell, pixel)];
    struct lum_bsdf_value v = lum_bsdf_eval_parts(&l->bsdf, l->wo, wi);
    return (struct reflected){lum_rgb_share(v.diffuse, albedo), v.gloss};
}

/* Of sample k of the fan, in this pixel. False: nothing is reflected. */
static bool reflect(const struct shadow *s, uint32_t k, uint32_t pixel, struct reflected *ret_value)
{
    const struct fan *f = &s->fan;
    struct lum_vec3 wi = {f->wx[k], f->wy[k], f->wz[k]};
    struct lum_rgb arriving = lum_rgb_scale(f->radiance[k], f->weight[k]);
    struct reflected part = {lum_grey(f->white[k]), lum_grey(0.0f)};
    if (!(f->weight[k] > 0.0f))
        return false;
    if (s->gloss && (s->pass->surfaces->kind[lum_ais_pixel(&s->cell, pixel)] & LUM_PIXEL_GLOSS))
        part = reflect_gloss(s, pixel, wi);
    if (lum_rgb_black(part.white) && lum_rgb_black(part.gloss))
        return false;
    if (s->pass->on[LUM_EFFECT_MEDIA])
        arriving =
            lum_rgb_mul(arriving, lum_media_transmittance(s->pass->snapshot, lum_v3(f->px[k], f->py[k], f->pz[k]), wi,
                                                          f->distance[k]));
    *ret_value = (struct reflected){lum_rgb_mul(arriving, part.white), lum_rgb_mul(arriving, part.gloss)};
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
    struct lum_rgb left[LUM_RAY_BATCH];
    if (s->rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of_light(s->pass->snapshot, s->counters, lum_pass_panes(s->pass));
    lum_trace_light(&trace, &s->rays, occluded, left);
    s->counters->rays[lum_light_ray_kind(&s->pass->snapshot->lights.lights[s->light])] += s->rays.n;
    for (uint32_t r = 0; r < s->rays.n; r++) {
        if (!occluded[r] && trace.panes)
            s->value[r] =
                (struct reflected){lum_rgb_mul(s->value[r].white, left[r]), lum_rgb_mul(s->value[r].gloss, left[r])};
        if (!occluded[r])
            add(s, s->pixel[r], &s->value[r]);
        else if (iteration == 0) /* listing 5.3, lines 3 and 4 */
            s->missed[lum_ais_tile(&s->cell, s->pixel[r])]++;
    }
    s->rays.n = 0;
}

/* contrib(getSample(pixel)) of listing 5.1, of sample k of the fan. A sample that the surface does not see for its own
 * orientation is neither lit nor occluded: no ray, and not counted. */
static void sample_pixel(struct shadow *s, uint32_t k, uint32_t pixel, uint32_t iteration)
{
    const struct fan *f = &s->fan;
    struct reflected value;
    if (!reflect(s, k, pixel, &value))
        return;
    if (iteration == 0)
        s->sampled[lum_ais_tile(&s->cell, pixel)]++;
    if (s->rays.n == LUM_RAY_BATCH)
        trace_rays(s, iteration);
    uint32_t r = s->rays.n;
    if (!lum_shadow_ray(&s->rays, lum_v3(f->px[k], f->py[k], f->pz[k]), lum_v3(f->gx[k], f->gy[k], f->gz[k]),
                        lum_v3(f->wx[k], f->wy[k], f->wz[k]), f->distance[k])) {
        add(s, pixel, &value);
        return;
    }
    s->value[r] = value;
    s->pixel[r] = (uint16_t)pixel;
}

static void take_samples(struct shadow *s, uint32_t iteration)
{
    uint32_t seed = lum_sampler_at(0, 0, 0, s->pass->settings->seed).pixel_seed;
    for (uint32_t place = 0; place < LUM_AIS_SUBSETS; place++) {
        struct lum_ais_list list;
        lum_ais_list_pixels(&s->cell, place, iteration, &list);
        struct lum_sampler sampler = {seed, LUM_AIS_SUBSETS * iteration + lum_ais_subset(place, iteration)};
        if (list.n == 0)
            continue;
        load_points(s, &list);
        if (!aim(s, lum_sampler_2d(&sampler, LUM_PAIRS_LIGHTS | s->salt)))
            continue;
        for (uint32_t k = 0; k < list.n; k++)
            sample_pixel(s, k, list.pixel[k], iteration);
    }
    trace_rays(s, iteration);
}

/* Listing 5.3, lines 9 to 20. */
static void guide(struct shadow *s)
{
    const struct lum_ais *ais = lum_ais_of(s->pass);
    for (uint32_t t = 0; t < s->cell.tiles_x * s->cell.tiles_y; t++)
        s->cell.further[t] =
            (uint8_t)(ais->adaptive ? lum_guidance_shadow(s->sampled[t], s->missed[t], ais->max) : ais->max - 1);
}

static void add_to_components(const struct shadow *s)
{
    const struct lum_ais_cell *p = &s->cell;
    for (uint32_t y = 0; y < p->h; y++)
        for (uint32_t x = 0; x < p->w; x++) {
            uint32_t i = y * LUM_CELL_SIDE + x;
            if (!p->wanted[i])
                continue;
            size_t at = lum_ais_pixel(p, i);
            float weight = 1.0f / (float)(1 + p->further[lum_ais_tile(p, i)]);
            lum_component_add(s->pass->components, LUM_EFFECT_SOFT_SHADOW, at, lum_rgb_scale(s->sum[i].white, weight));
            lum_component_add(s->pass->components, LUM_EFFECT_GLOSSY, at, lum_rgb_scale(s->sum[i].gloss, weight));
        }
}

/* Listing 5.1 for one light. */
static void shadow_of_light(struct shadow *s)
{
    memset(s->cell.further, 0, sizeof s->cell.further);
    memset(s->sum, 0, sizeof s->sum);
    memset(s->sampled, 0, sizeof s->sampled);
    memset(s->missed, 0, sizeof s->missed);
    take_samples(s, 0);
    guide(s);
    uint32_t last = lum_ais_last_iteration(&s->cell);
    for (uint32_t iteration = 1; iteration <= last; iteration++)
        take_samples(s, iteration);
    add_to_components(s);
    lum_ais_note(&s->cell, LUM_EFFECT_SOFT_SHADOW);
}

static void shadow_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    if (pass->settings->max_depth == 0 || lum_components_enter(pass, LUM_EFFECT_SOFT_SHADOW, cell))
        return;
    struct shadow s;
    s.pass = pass;
    s.counters = counters;
    s.gloss = pass->on[LUM_EFFECT_GLOSSY];
    s.rays.n = 0;
    lum_ais_cell_init(&s.cell, pass, cell, 1);
    if (!lum_ais_cell_want(&s.cell, LUM_PIXEL_DIFFUSE | (s.gloss ? LUM_PIXEL_GLOSS : 0)))
        return;
    if (s.gloss)
        find_lobes(&s);
    const struct lum_light_table *lights = &pass->snapshot->lights;
    for (uint32_t a = 0; a < lights->n_active; a++) {
        const struct lum_light *light = &lights->lights[lights->active[a]];
        enum lum_effect effect = lum_light_effect(light);
        if (!pass->on[effect] || lum_method_serves(pass->settings->method, effect) != &lum_estimator_ais_shadow)
            continue;
        s.light = lights->active[a];
        s.salt = lum_hash_text(light->id);
        shadow_of_light(&s);
    }
}

const struct lum_estimator lum_estimator_ais_shadow = {
    .name = "ais_shadow",
    .stage = LUM_STAGE_SHADOW,
    .tile = shadow_cell,
    .cells = true,
    .components = LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW),
    .smoothed_by = &lum_filter_ais,
};

/* Calls for the buffer; what goes there is found by the shadow rays. */
static void gloss_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)pass;
    (void)cell;
    (void)counters;
}

const struct lum_estimator lum_estimator_ais_gloss = {
    .name = "ais_gloss",
    .stage = LUM_STAGE_SHADOW,
    .tile = gloss_cell,
    .cells = true,
    .components = LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY),
    .smoothed_by = &lum_filter_ais,
};
