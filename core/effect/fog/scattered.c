#include "core/effect/fog/scattered.h"

#include "core/math/color.h"
#include "core/math/sampler.h"
#include "core/math/sampler_pairs.h"
#include "core/medium/stretches.h"
#include "core/vpl/gather.h"

#define NODES LUM_SCATTERED_NODES
#define DRAWS LUM_SCATTERED_DRAWS

/* ---- what is kept ---- */

static void finish(void *state)
{
    struct lum_scattered *s = state;
    lum_free(s->tiles);
    lum_memo_finish(&s->made);
    *s = (struct lum_scattered){0};
}

static bool reserve(void *state, const struct lum_pass *pass)
{
    struct lum_scattered *s = state;
    if (!s->tiles)
        s->tiles = lum_calloc(pass->tiling.n, sizeof *s->tiles);
    return s->tiles && lum_memo_reserve(&s->made, pass->tiling.n);
}

static void invalidate(void *state, const struct lum_pass *pass, const struct lum_outcome *outcome)
{
    (void)pass;
    struct lum_scattered *s = state;
    if (outcome->light > LUM_FATE_DIMMED && s->made.n > 0)
        lum_memo_forget(&s->made);
}

static const struct lum_state_kind scattered_kind = {sizeof(struct lum_scattered), reserve, invalidate, finish};

static struct lum_scattered *scattered_of(const struct lum_pass *pass)
{
    return lum_pass_state(pass, &scattered_kind);
}

/* A light that shines for the first time moves VPLs, though nothing but powers changed. Of one that is where it was
 * what is kept stays true: it is weighed by its importance as it was drawn, whatever that is now. */
static void begin(const struct lum_pass *pass)
{
    struct lum_scattered *s = scattered_of(pass);
    uint64_t places = pass->fog_vpls ? lum_vpl_hash_places(pass->fog_vpls) : 0;
    if (places != s->places)
        lum_memo_forget(&s->made);
    s->places = places;
}

/* ---- trace ---- */

/* The ray through the middle of a pixel, cut where media begin and end, up to tmax. */
struct sight {
    struct lum_vec3 o, d;
    struct lum_stretches on;
    float all; /* luminance of what all of its fog scatters to the eye of light that is one everywhere */
};

static struct sight sight_of(const struct lum_pass *pass, uint32_t x, uint32_t y, float tmax)
{
    struct sight s = {.o = pass->eye.o, .d = lum_center_direction(pass, x, y)};
    lum_stretches_find(&s.on, pass->snapshot, s.o, s.d, lum_min(tmax, LUM_RAY_LIMIT));
    s.all = lum_luminance(lum_stretches_scatter(&s.on, INFINITY));
    return s;
}

/* Distance up to which a share f of what the ray can get is scattered. In a stretch by its mean colour, which is exact
 * for grey fog. */
static float distance_of(const struct sight *s, float f)
{
    float before = 0.0f, wanted = f * s->all, t = s->on.t[0];
    for (uint32_t i = 0; i < s->on.n; i++) {
        float upto = lum_luminance(lum_stretches_scatter(&s->on, s->on.t[i + 1])), length = s->on.t[i + 1] - s->on.t[i];
        if (!(upto > before))
            continue;
        float inside = lum_clamp((wanted - before) / (upto - before), 0.0f, 1.0f);
        t = s->on.t[i] + lum_exponential_sample(lum_luminance(s->on.sigma_t[i]), length, inside);
        if (upto >= wanted)
            break;
        before = upto;
    }
    return t;
}

/* A tile on its way. About 25 KiB: lives on a worker's stack. */
struct tracing {
    const struct lum_pass *pass;
    struct lum_scattered_tile *tile;
    struct lum_tile_rect r;
    uint32_t number;
    uint32_t deepest; /* pixel of the tile, row by row, of those that see fog the one that sees farthest; */
    float tmax;       /* so far */
    struct lum_rays rays;
    struct lum_scattered_node *node[LUM_RAY_BATCH]; /* by ray */
    struct lum_scattered_term term[LUM_RAY_BATCH];
};

static float depth_at(const struct tracing *t, uint32_t pixel)
{
    const struct lum_tile_rect *r = &t->r;
    return t->pass->surfaces->depth[(size_t)(r->y + pixel / r->w) * t->pass->tiling.w + r->x + pixel % r->w];
}

static struct sight sight_of_pixel(const struct tracing *t, uint32_t pixel, float tmax)
{
    return sight_of(t->pass, t->r.x + pixel % t->r.w, t->r.y + pixel / t->r.w, tmax);
}

/* False: none sees fog. In most tiles the first that is tried does. */
static bool find_deepest(struct tracing *t)
{
    const uint32_t n = t->r.w * t->r.h;
    uint32_t at = 0;
    for (uint32_t i = 1; i < n; i++)
        if (depth_at(t, i) > depth_at(t, at))
            at = i;
    bool found = sight_of_pixel(t, at, depth_at(t, at)).all > 0.0f;
    for (uint32_t i = 0; i < n && !found; at = i, i++)
        found = sight_of_pixel(t, i, depth_at(t, i)).all > 0.0f;
    for (uint32_t i = at + 1; i < n && found; i++)
        if (depth_at(t, i) > depth_at(t, at) && sight_of_pixel(t, i, depth_at(t, i)).all > 0.0f)
            at = i;
    t->deepest = at;
    t->tmax = depth_at(t, at);
    return found;
}

static struct lum_vec2 numbers_for(const struct tracing *t, uint32_t node, uint32_t pair)
{
    struct lum_sampler s = lum_sampler_at(t->number, node, 0, t->pass->settings->seed);
    return lum_sampler_2d(&s, LUM_PAIRS_OF_EFFECT(LUM_EFFECT_SCATTERING) + pair);
}

struct place {
    struct sight sight;
    float t;
};

/* Where point k is looked for before another pixel is tried: most pixels of most tiles see about as far as the
 * deepest, which is the last. */
#define TRIES 4u

/* On the ray of a pixel drawn among those that see as far. */
static struct place place_node(const struct tracing *t, uint32_t k, float f)
{
    struct place place;
    for (uint32_t i = 0; i < TRIES; i++) {
        uint32_t pixel = (uint32_t)(numbers_for(t, k, 1 + i).x * (float)(t->r.w * t->r.h));
        place.sight = sight_of_pixel(t, pixel, t->tmax);
        if (!(place.sight.all > 0.0f))
            continue;
        place.t = distance_of(&place.sight, f);
        if (place.t < depth_at(t, pixel))
            return place;
    }
    place.sight = sight_of_pixel(t, t->deepest, t->tmax);
    place.t = distance_of(&place.sight, f);
    return place;
}

/* All points, by distance: rays enter and leave a medium elsewhere. */
static void place_nodes(const struct tracing *t, struct place places[NODES])
{
    struct lum_scattered_tile *tile = t->tile;
    for (uint32_t k = 0; k < NODES; k++) {
        tile->node[k].f = ((float)k + numbers_for(t, k, 0).x) / (float)NODES;
        struct place place = place_node(t, k, tile->node[k].f);
        tile->from = lum_min(tile->from, place.sight.on.t[0]);
        tile->to = lum_max(tile->to, place.sight.on.t[place.sight.on.n]);
        uint32_t i = k;
        for (; i > 0 && places[i - 1].t > place.t; i--)
            places[i] = places[i - 1];
        places[i] = place;
    }
    for (uint32_t k = 0; k < NODES; k++)
        tile->node[k].t = places[k].t;
}

/* Of the media at p one, drawn by how much they scatter: its phase function; and what all of them take. */
static void know_fog(const struct lum_snapshot *s, float u, struct lum_vpl_air *inout)
{
    const struct lum_vec3 p = inout->p;
    float sum = 0.0f, below = 0.0f;
    bool in[LUM_MEDIA_MAX];
    for (uint32_t m = 0; m < s->n_media; m++) {
        const struct lum_medium *of = &s->media[m];
        in[m] = p.x >= of->lo.x && p.x <= of->hi.x && p.y >= of->lo.y && p.y <= of->hi.y && p.z >= of->lo.z &&
                p.z <= of->hi.z;
        sum += in[m] ? lum_luminance(of->sigma_s) : 0.0f;
        inout->sigma_t += in[m] ? lum_luminance(of->sigma_t) : 0.0f;
    }
    for (uint32_t m = 0; m < s->n_media; m++) {
        if (!in[m] || !(lum_luminance(s->media[m].sigma_s) > 0.0f))
            continue;
        inout->g = s->media[m].g;
        below += lum_luminance(s->media[m].sigma_s);
        if (u * sum < below)
            break;
    }
}

static void see(struct lum_scattered_node *node, struct lum_scattered_term term, struct lum_rgb left)
{
    term.weight = lum_rgb_mul(term.weight, left);
    node->seen[node->n++] = term;
}

static void look_from(struct tracing *t, const struct sight *sight, uint32_t k)
{
    struct lum_scattered_node *node = &t->tile->node[k];
    const struct lum_vpl_set *set = t->pass->fog_vpls;
    struct lum_vec2 u = numbers_for(t, k, 0), of_vpls = numbers_for(t, k, 2 + TRIES);
    struct lum_vpl_air at = {.p = lum_v3_mad(sight->o, sight->d, node->t), .to = lum_v3_neg(sight->d)};
    know_fog(t->pass->snapshot, u.y, &at);
    struct lum_vpl_air_draw draws[DRAWS];
    uint32_t n = lum_vpl_air_draw(set, &at, DRAWS, of_vpls.x, draws);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t slot = draws[i].slot;
        struct lum_vec3 q = {set->px[slot], set->py[slot], set->pz[slot]}, d = lum_v3_sub(q, at.p);
        float length = lum_length(d);
        struct lum_scattered_term term = {slot, lum_grey(draws[i].weight)};
        term.weight =
            lum_rgb_mul(term.weight, length > 0.0f ? lum_media_transmittance(t->pass->snapshot, at.p,
                                                                             lum_v3_mul(d, 1.0f / length), length)
                                                   : lum_grey(1.0f));
        if (length < LUM_VPL_TOUCHING) {
            see(node, term, lum_grey(1.0f));
            continue;
        }
        t->node[t->rays.n] = node;
        t->term[t->rays.n] = term;
        lum_vpl_push_ray(&t->rays, at.p, lum_ray_offset(q, lum_v3(set->nx[slot], set->ny[slot], set->nz[slot])));
    }
}

static void trace_rays(struct tracing *t, struct lum_counters *counters)
{
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH];
    if (t->rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of_light(t->pass->snapshot, counters, lum_pass_panes(t->pass));
    lum_trace_light(&trace, &t->rays, occluded, left);
    counters->rays[LUM_RAY_SCATTERING] += t->rays.n;
    for (uint32_t i = 0; i < t->rays.n; i++)
        if (!occluded[i])
            see(t->node[i], t->term[i], trace.panes ? left[i] : lum_grey(1.0f));
}

static void make_points(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    struct tracing t;
    struct place places[NODES];
    t.pass = pass;
    t.tile = &scattered_of(pass)->tiles[tile];
    t.r = lum_tile_at(&pass->tiling, tile);
    t.number = tile;
    t.rays.n = 0;
    *t.tile = (struct lum_scattered_tile){.from = INFINITY};
    if (!find_deepest(&t))
        return;
    place_nodes(&t, places);
    for (uint32_t k = 0; k < NODES; k++)
        look_from(&t, &places[k].sight, k);
    trace_rays(&t, counters);
}

static void sum_light(const struct lum_vpl_set *set, struct lum_scattered_node *node)
{
    node->light = lum_grey(0.0f);
    for (uint32_t i = 0; i < node->n; i++) {
        uint32_t k = node->seen[i].slot;
        struct lum_rgb flux = {set->flux[0][k], set->flux[1][k], set->flux[2][k]};
        node->light = lum_rgb_add(node->light, lum_rgb_mul(flux, node->seen[i].weight));
    }
}

static void trace_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    struct lum_scattered *s = scattered_of(pass);
    if (!pass->fog_vpls || lum_components_enter(pass, LUM_EFFECT_SCATTERING, tile))
        return;
    if (lum_memo_advance(&s->made, tile, 0))
        make_points(pass, tile, counters);
    for (uint32_t k = 0; k < NODES; k++)
        sum_light(pass->fog_vpls, &s->tiles[tile].node[k]);
}

/* ---- spread ---- */

/* Share of what the tile can get that is nearer than z. */
static float share_before(const struct lum_scattered_tile *tile, float z)
{
    float t = tile->from, f = 0.0f;
    for (uint32_t k = 0; k <= NODES; k++) {
        float next_t = k < NODES ? tile->node[k].t : tile->to, next_f = k < NODES ? tile->node[k].f : 1.0f;
        if (z < next_t)
            return f + (next_f - f) * lum_clamp((z - t) / (next_t - t), 0.0f, 1.0f);
        t = next_t, f = next_f;
    }
    return 1.0f;
}

/* Mean light of the points before z: point k stands for the k-th part of all. */
static struct lum_rgb mean_before(const struct lum_scattered_tile *tile, float z)
{
    float parts =
        lum_max(share_before(tile, z) * (float)NODES, 0x1p-10f); /* before the first point light is as there */
    struct lum_rgb sum = lum_grey(0.0f);
    for (uint32_t k = 0; k < NODES && (float)k < parts; k++)
        sum = lum_rgb_mad(sum, tile->node[k].light, lum_min(parts - (float)k, 1.0f));
    return lum_rgb_scale(sum, 1.0f / parts);
}

/* Quadratic spline of width 3 around 0; x: from -1.5 to 1.5. */
static float spline(float x)
{
    float a = fabsf(x);
    return a < 0.5f ? 0.75f - a * a : 0.5f * (1.5f - a) * (1.5f - a);
}

static struct lum_rgb mean_around(const struct lum_pass *pass, uint32_t x, uint32_t y, float z)
{
    const struct lum_tiling *tiling = &pass->tiling;
    const struct lum_scattered_tile *tiles = scattered_of(pass)->tiles;
    const float fx = ((float)x + 0.5f) / LUM_TILE_SIDE, fy = ((float)y + 0.5f) / LUM_TILE_SIDE;
    const uint32_t tx = x / LUM_TILE_SIDE, ty = y / LUM_TILE_SIDE;
    struct lum_rgb sum = lum_grey(0.0f);
    float weights = 0.0f;
    for (uint32_t j = ty > 0 ? ty - 1 : 0; j <= ty + 1 && j < tiling->ny; j++)
        for (uint32_t i = tx > 0 ? tx - 1 : 0; i <= tx + 1 && i < tiling->nx; i++) {
            const struct lum_scattered_tile *tile = &tiles[j * tiling->nx + i];
            if (!(tile->from < z))
                continue;
            /* What a tile does not see it knows little of. */
            float sees = lum_min(tile->to / z, 1.0f);
            float weight = spline(fx - ((float)i + 0.5f)) * spline(fy - ((float)j + 0.5f)) * sees * sees;
            sum = lum_rgb_mad(sum, mean_before(tile, z), weight);
            weights += weight;
        }
    return weights > 0.0f ? lum_rgb_scale(sum, 1.0f / weights) : sum;
}

static void spread_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    (void)counters;
    if (!pass->fog_vpls || lum_components_enter_filter(pass, LUM_EFFECT_SCATTERING, tile))
        return;
    struct lum_rgb *smooth = pass->components->buffer[LUM_EFFECT_SCATTERING].smooth;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    for (uint32_t y = r.y; y < r.y + r.h; y++)
        for (uint32_t x = r.x; x < r.x + r.w; x++) {
            size_t pixel = (size_t)y * pass->tiling.w + x;
            struct sight sight = sight_of(pass, x, y, pass->surfaces->depth[pixel]);
            struct lum_rgb of_one = lum_stretches_scatter(&sight.on, INFINITY);
            smooth[pixel] = lum_grey(0.0f);
            if (sight.on.n > 0 && !lum_rgb_black(of_one))
                smooth[pixel] = lum_rgb_mul(of_one, mean_around(pass, x, y, sight.on.t[sight.on.n]));
        }
}

static const struct lum_estimator spread = {
    .name = "scattered, spread", .stage = LUM_STAGE_FILTER, .tile = spread_tile, .surfaces = true};

const struct lum_estimator lum_estimator_scattered = {
    .name = "scattered",
    .stage = LUM_STAGE_MEDIA,
    .begin = begin,
    .tile = trace_tile,
    .state = &scattered_kind,
    .components = LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING),
    .surfaces = true,
    .vpls = true,
    .then = &spread,
};
