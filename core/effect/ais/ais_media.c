/* Single scattering in homogeneous media (thesis 5.3.4, listing 5.4), by interleaved ray marching.
 *
 * A ray's stay in a medium is cut into STEPS steps. A step is divided among the subsets of the pattern, and each of
 * these parts among the iterations, so that all pixels of a tile in all iterations march at offsets of their own,
 * evenly spaced. The middle part comes first: then the first iteration alone is a midpoint rule, and in the order of
 * the others no few of them lie to one side. */
#include "core/effect/ais/ais.h"
#include "core/light/sample.h"
#include "core/math/sampler.h"
#include "core/math/sampler_pairs.h"

#include <string.h>

#define STEPS 8u /* with a pattern of 3 x 3: 72 points along the ray within a tile */
/* A ray is followed to where 2^-10 of the light is left; and where the medium has no end, to twice the scene's radius.
 */
#define DEPTH_MAX 6.93f
#define REACH_RADII 2.0f
/* Listing 5.4, line 9: the distance in metres below which the divisor of the geometry term is below one (5.4). It
 * subtracts the attenuation coefficient, in 1 / m, as if that were a distance; taken literally, in metres. */
#define HALO_M 1.0f

/* About 100 KiB: lives on a worker's stack. */
struct march {
    struct lum_ais_cell cell;
    const struct lum_pass *pass;
    struct lum_counters *counters;
    const struct lum_medium *medium; /* the one at hand */
    uint32_t salt;
    struct lum_rgb sum[LUM_AIS_PIXELS];                       /* of all iterations */
    uint16_t missed[LUM_AIS_PIXELS], in_halo[LUM_AIS_PIXELS]; /* in the initial pass */
    /* rays under way */
    struct lum_rays rays;
    struct lum_rgb value[LUM_RAY_BATCH];
    uint16_t pixel[LUM_RAY_BATCH];
    uint32_t iteration;
};

static void trace_rays(struct march *m)
{
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH];
    if (m->rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of_light(m->pass->snapshot, m->counters, lum_pass_panes(m->pass));
    lum_trace_light(&trace, &m->rays, occluded, left);
    m->counters->rays[LUM_RAY_MEDIA] += m->rays.n;
    for (uint32_t r = 0; r < m->rays.n; r++) {
        uint32_t i = m->pixel[r];
        if (!occluded[r])
            m->sum[i] = lum_rgb_add(m->sum[i], trace.panes ? lum_rgb_mul(m->value[r], left[r]) : m->value[r]);
        else if (m->iteration == 0) /* listing 5.4, lines 6 and 7 */
            m->missed[i]++;
    }
    m->rays.n = 0;
}

/* The part of the eye ray that lies in the medium. */
struct stay {
    struct lum_vec3 d;
    float t0, step;
};

/* Where the ray leaves the sphere of REACH_RADII around the scene, or at least has come nearest to its centre. */
static float reach(const struct lum_pass *pass, struct lum_vec3 d)
{
    const struct lum_snapshot *s = pass->snapshot;
    bool empty = !(s->bounds_lo.x <= s->bounds_hi.x);
    struct lum_vec3 centre =
        empty ? lum_v3(0.0f, 0.0f, 0.0f) : lum_v3_mul(lum_v3_add(s->bounds_lo, s->bounds_hi), 0.5f);
    return lum_dot(lum_v3_sub(centre, pass->eye.o), d) + REACH_RADII * s->lights.scene_radius;
}

static bool find_stay(const struct march *m, size_t at, struct stay *ret_stay)
{
    const struct lum_pass *pass = m->pass;
    uint32_t x = (uint32_t)(at % pass->tiling.w), y = (uint32_t)(at / pass->tiling.w);
    struct stay s = {.d = lum_eye_direction(&pass->eye, (float)x + 0.5f, (float)y + 0.5f)};
    float t1;
    if (!lum_medium_clip(m->medium, pass->eye.o, s.d, pass->surfaces->depth[at], &s.t0, &t1))
        return false;
    float length = (isinf(t1) ? reach(pass, s.d) : t1) - s.t0,
          sigma = INFINITY; /* the least that dims what is scattered */
    const struct lum_rgb *scattered = &m->medium->sigma_s, *dimmed = &m->medium->sigma_t;
    if (scattered->r > 0.0f)
        sigma = dimmed->r;
    if (scattered->g > 0.0f)
        sigma = lum_min(sigma, dimmed->g);
    if (scattered->b > 0.0f)
        sigma = lum_min(sigma, dimmed->b);
    s.step = lum_min(length, DEPTH_MAX / sigma) / STEPS;
    *ret_stay = s;
    return s.step > 0.0f && isfinite(s.step);
}

/* Light of one light that is scattered at a point of the ray towards the eye. weight: transmittance to the eye times
 * the length that the point stands for. */
struct point {
    struct lum_vec3 p, d;
    struct lum_rgb weight;
    struct lum_sampler sampler;
    uint32_t pixel, step;
};

/* False: the light does not shine there, were it visible or not. */
static bool arriving_light(const struct march *m, const struct point *pt, uint32_t index,
                           struct lum_light_sample *ret_sample, struct lum_rgb *ret_value)
{
    const struct lum_snapshot *s = m->pass->snapshot;
    const struct lum_light *light = &s->lights.lights[index];
    struct lum_vec2 u = {0.5f, 0.5f};
    if (!light->delta)
        u = lum_sampler_2d(&pt->sampler, LUM_PAIRS_MARCH | (lum_hash_text(light->id) + m->salt + pt->step));
    if (!lum_light_sample_at(s, index, pt->p, u, ret_sample))
        return false;
    struct lum_vec3 wi = ret_sample->wi;
    struct lum_rgb arriving =
        lum_rgb_mul(ret_sample->radiance, lum_media_transmittance(s, pt->p, wi, ret_sample->distance));
    float phase = lum_phase_hg(m->medium->g, lum_dot(wi, pt->d)) / (light->delta ? 1.0f : ret_sample->pdf_sa);
    *ret_value = lum_rgb_mul(lum_rgb_mul(pt->weight, m->medium->sigma_s), lum_rgb_scale(arriving, phase));
    return !lum_rgb_black(*ret_value);
}

static void sample_light(struct march *m, const struct point *pt, uint32_t index)
{
    struct lum_light_sample ls;
    struct lum_rgb value;
    if (!arriving_light(m, pt, index, &ls, &value)) {
        if (m->iteration ==
            0) /* beside a cone of light or behind a lamp is as dark as in a shadow, and has the same edge */
            m->missed[pt->pixel]++;
        return;
    }
    /* Line 9; sigma_t per metre is that per scene unit times the scale. */
    float scale = (float)m->pass->snapshot->norm.scale, sigma_t_m = lum_rgb_max(m->medium->sigma_t) * scale;
    if (m->iteration == 0 && ls.distance < (HALO_M - sigma_t_m) * scale)
        m->in_halo[pt->pixel]++;
    if (m->rays.n == LUM_RAY_BATCH)
        trace_rays(m);
    uint32_t r = m->rays.n;
    lum_rays_push(&m->rays, pt->p, ls.wi, ls.distance * (1.0f - 0x1p-12f));
    m->value[r] = value;
    m->pixel[r] = (uint16_t)pt->pixel;
}

/* contrib(getSample(pixel)) of listing 5.1: one march, at the offset that belongs to the subset and the iteration. */
static void march_pixel(struct march *m, uint32_t pixel, uint32_t subset)
{
    const struct lum_pass *pass = m->pass;
    uint32_t max = lum_ais_of(pass)->max, part = (max / 2 + m->iteration * (max / 2 + 1)) % max;
    float offset = ((float)subset + ((float)part + 0.5f) / (float)max) / LUM_AIS_SUBSETS;
    struct stay stay;
    if (!find_stay(m, lum_ais_pixel(&m->cell, pixel), &stay))
        return;
    struct point pt = {.d = stay.d, .pixel = pixel};
    pt.sampler = (struct lum_sampler){lum_sampler_at(0, 0, 0, pass->settings->seed).pixel_seed,
                                      LUM_AIS_SUBSETS * m->iteration + subset};
    const struct lum_light_table *lights = &pass->snapshot->lights;
    for (pt.step = 0; pt.step < STEPS; pt.step++) {
        float t = stay.t0 + ((float)pt.step + offset) * stay.step;
        pt.p = lum_v3_mad(pass->eye.o, stay.d, t);
        pt.weight = lum_rgb_scale(lum_media_transmittance(pass->snapshot, pass->eye.o, stay.d, t), stay.step);
        for (uint32_t a = 0; a < lights->n_active; a++)
            sample_light(m, &pt, lights->active[a]);
    }
}

static void take_samples(struct march *m, uint32_t iteration)
{
    m->iteration = iteration;
    for (uint32_t place = 0; place < LUM_AIS_SUBSETS; place++) {
        struct lum_ais_list list;
        lum_ais_list_pixels(&m->cell, place, iteration, &list);
        for (uint32_t k = 0; k < list.n; k++)
            march_pixel(m, list.pixel[k], lum_ais_subset(place, iteration));
    }
    trace_rays(m);
}

/* Listing 5.4 for one tile. A ray that misses the medium has the value of one that is lit all along: 0. */
static uint32_t guide_tile(const struct march *m, uint32_t tile_x, uint32_t tile_y, uint32_t max)
{
    const struct lum_ais_cell *p = &m->cell;
    uint32_t n = 0, n_points = STEPS * m->pass->snapshot->lights.n_active;
    float value[LUM_AIS_SUBSETS];
    for (uint32_t y = tile_y * LUM_AIS_SIDE; y < (tile_y + 1) * LUM_AIS_SIDE && y < p->h; y++)
        for (uint32_t x = tile_x * LUM_AIS_SIDE; x < (tile_x + 1) * LUM_AIS_SIDE && x < p->w; x++) {
            uint32_t i = y * LUM_CELL_SIDE + x;
            value[n++] = lum_guidance_media_value(m->missed[i], m->in_halo[i], n_points);
        }
    return lum_guidance_media(value, n, STEPS, max);
}

static void guide(struct march *m)
{
    const struct lum_ais *ais = lum_ais_of(m->pass);
    for (uint32_t y = 0; y < m->cell.tiles_y; y++)
        for (uint32_t x = 0; x < m->cell.tiles_x; x++)
            m->cell.further[y * m->cell.tiles_x + x] =
                (uint8_t)(ais->adaptive ? guide_tile(m, x, y, ais->max) : ais->max - 1);
}

static void add_to_component(const struct march *m)
{
    const struct lum_ais_cell *p = &m->cell;
    for (uint32_t y = 0; y < p->h; y++)
        for (uint32_t x = 0; x < p->w; x++) {
            uint32_t i = y * LUM_CELL_SIDE + x;
            float weight = 1.0f / (float)(1 + p->further[lum_ais_tile(p, i)]);
            lum_component_add(m->pass->components, LUM_EFFECT_MEDIA, lum_ais_pixel(p, i),
                              lum_rgb_scale(m->sum[i], weight));
        }
}

/* Listing 5.1 for one medium. */
static void march_medium(struct march *m)
{
    memset(m->cell.further, 0, sizeof m->cell.further);
    memset(m->sum, 0, sizeof m->sum);
    memset(m->missed, 0, sizeof m->missed);
    memset(m->in_halo, 0, sizeof m->in_halo);
    take_samples(m, 0);
    guide(m);
    uint32_t last = lum_ais_last_iteration(&m->cell);
    for (uint32_t iteration = 1; iteration <= last; iteration++)
        take_samples(m, iteration);
    add_to_component(m);
    lum_ais_note(&m->cell, LUM_EFFECT_MEDIA);
}

static void media_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    if (pass->settings->max_depth == 0 || lum_components_enter(pass, LUM_EFFECT_MEDIA, cell))
        return;
    struct march m;
    m.pass = pass;
    m.counters = counters;
    m.rays.n = 0;
    lum_ais_cell_init(&m.cell, pass, cell, 1);
    lum_ais_cell_want(&m.cell, 0);
    for (uint32_t k = 0; k < pass->snapshot->n_media; k++) {
        m.medium = &pass->snapshot->media[k];
        m.salt = lum_hash_text(m.medium->id);
        if (!lum_rgb_black(m.medium->sigma_s))
            march_medium(&m);
    }
}

const struct lum_estimator lum_estimator_ais_media = {
    .name = "ais_media",
    .stage = LUM_STAGE_MEDIA,
    .tile = media_cell,
    .cells = true,
    .components = LUM_EFFECT_BIT(LUM_EFFECT_MEDIA),
    .smoothed_by = &lum_filter_ais,
};
