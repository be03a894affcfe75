/* Anti-aliasing of edges, after Chajdas, McGuire & Luebke 2011 (Subpixel reconstruction antialiasing): where a pixel's
 * neighbour shows another surface, a few more eye rays find out how much of the pixel each surface covers, and each
 * takes the radiance of the neighbouring pixel that shows its surface. Visibility is sampled finely, shading is not
 * done again. Which neighbour a ray takes its radiance from is kept: another light on the same surfaces costs no ray.
 */
#include "core/effect/antialias/antialias.h"
#include "core/math/sampler.h"
#include "core/pass/components.h"

#include <string.h>

#define EDGE_BATCH (LUM_RAY_BATCH / LUM_EDGE_RAYS)

/* Which neighbours they take it from. */
struct neighbours {
    uint32_t *of;   /* by pixel; beyond edges LUM_NEIGHBOURS_SELF */
    uint8_t *known; /* by tile */
    uint32_t n_tiles;
};

/* Pixels at an edge whose rays are traced together. */
struct edge_batch {
    struct neighbours *neighbours;
    uint32_t n;
    uint32_t x[EDGE_BATCH], y[EDGE_BATCH];
    struct lum_rays rays;
    struct lum_vec2 film[LUM_RAY_BATCH]; /* by ray: where it goes through the picture */
    struct lum_hits hits;
};

static bool same_surface(const struct lum_pass *pass, const struct lum_guide *guide, size_t a, size_t b)
{
    const struct lum_surfaces *s = pass->surfaces;
    return s->object[a] == s->object[b] && (s->object[a] == LUM_NO_OBJECT || lum_guide_same_surface(guide, a, b));
}

/* Pixels of a tile that have a neighbour which shows another surface: each pair of neighbours is tested once. */
static void find_edges(const struct lum_pass *pass, const struct lum_guide *guide, const struct lum_tile_rect *r,
                       uint8_t ret_edge[LUM_TILE_PIXELS])
{
    memset(ret_edge, 0, LUM_TILE_PIXELS);
    uint32_t x0 = r->x > 0 ? r->x - 1 : 0, y0 = r->y > 0 ? r->y - 1 : 0;
    for (uint32_t y = y0; y < r->y + r->h; y++)
        for (uint32_t x = x0; x < r->x + r->w; x++) {
            size_t at = (size_t)y * guide->w + x;
            bool right = y >= r->y && x + 1 < guide->w && !same_surface(pass, guide, at, at + 1);
            bool below = x >= r->x && y + 1 < guide->h && !same_surface(pass, guide, at, at + guide->w);
            uint32_t i = (y - r->y) * r->w + x - r->x;
            if ((right || below) && x >= r->x && y >= r->y)
                ret_edge[i] = 1;
            if (right && x + 1 < r->x + r->w)
                ret_edge[i + 1] = 1;
            if (below && y + 1 < r->y + r->h)
                ret_edge[i + r->w] = 1;
        }
}

/* A hit belongs to the surface that a pixel shows when it lies near the plane there: at most two pixels off, since a
 * neighbour on a curved surface lies up to a pixel and a half away. Of several the likeliest is taken: distance from
 * the plane counts four times as much as distance in the picture, or beside a box's edge the wrong face would win. */
#define PLANE_PIXELS_MAX 2.0f
#define PLANE_WEIGHT 4.0f

/* How badly pixel `at` stands for hit i, at p; INFINITY: not at all. */
static float mismatch(const struct lum_pass *pass, const struct edge_batch *batch, uint32_t i, struct lum_vec3 p,
                      size_t at)
{
    const struct lum_surfaces *s = pass->surfaces;
    if (s->object[at] != batch->hits.object[i])
        return INFINITY;
    if (s->object[at] == LUM_NO_OBJECT)
        return 0.0f;
    float pixel = pass->eye.per_pixel * s->depth[at];
    float off = PLANE_WEIGHT * lum_dot(lum_v3_sub(p, s->p[at]), s->n[at]) / pixel;
    return fabsf(off) <= PLANE_WEIGHT * PLANE_PIXELS_MAX ? off * off : INFINITY;
}

/* The neighbour whose radiance ray i takes, of pixel (x, y): of the nine pixels around, row by row, the one which shows
 * its surface best; its own pixel where none does. */
#define LENDERS 9u

static uint32_t find_neighbour(const struct lum_pass *pass, const struct edge_batch *batch, uint32_t i, uint32_t x,
                               uint32_t y)
{
    struct lum_vec2 film = batch->film[i];
    uint32_t w = pass->tiling.w, h = pass->tiling.h, best = LUM_NEIGHBOUR_SELF;
    struct lum_vec3 p = lum_v3_mad(pass->eye.o, lum_rays_direction(&batch->rays, i), batch->hits.t[i]);
    float least = INFINITY;
    for (uint32_t k = 0; k < LENDERS; k++) {
        uint32_t nx = x + k % 3 - 1, ny = y + k / 3 - 1;
        if (nx >= w || ny >= h) /* below 0, too: it wraps round */
            continue;
        float dx = (float)nx + 0.5f - film.x, dy = (float)ny + 0.5f - film.y;
        float worse = mismatch(pass, batch, i, p, (size_t)ny * w + nx) + dx * dx + dy * dy;
        if (worse < least) {
            least = worse;
            best = k;
        }
    }
    return best;
}

static struct lum_vec2 film_at(const struct lum_pass *pass, uint32_t x, uint32_t y, uint32_t k)
{
    struct lum_sampler sampler = lum_sampler_at(x, y, k, pass->settings->seed);
    struct lum_vec2 u = lum_sampler_2d(&sampler, 0);
    return (struct lum_vec2){(float)x + u.x, (float)y + u.y};
}

/* Finds the neighbours for all rays of the batch's pixels. */
static void look(const struct lum_pass *pass, struct edge_batch *batch, struct lum_counters *counters)
{
    if (batch->n == 0)
        return;
    batch->rays.n = 0;
    for (uint32_t i = 0; i < batch->n; i++)
        for (uint32_t k = 0; k < LUM_EDGE_RAYS; k++) {
            struct lum_vec2 film = film_at(pass, batch->x[i], batch->y[i], k);
            batch->film[batch->rays.n] = film;
            lum_rays_push(&batch->rays, pass->eye.o, lum_eye_direction(&pass->eye, film.x, film.y), INFINITY);
        }
    struct lum_trace trace = lum_trace_of_eye(pass->snapshot, counters);
    lum_trace_closest(&trace, &batch->rays, &batch->hits);
    counters->rays[LUM_RAY_ANTIALIAS] += batch->rays.n;
    for (uint32_t i = 0; i < batch->n; i++) {
        uint32_t x = batch->x[i], y = batch->y[i], neighbours = 0;
        for (uint32_t k = 0; k < LUM_EDGE_RAYS; k++)
            neighbours |= find_neighbour(pass, batch, i * LUM_EDGE_RAYS + k, x, y) << LUM_NEIGHBOUR_BITS * k;
        batch->neighbours->of[(size_t)y * pass->tiling.w + x] = neighbours;
    }
    batch->n = 0;
}

static struct lum_rgb lent(const struct lum_pass *pass, const struct neighbours *neighbours, size_t at)
{
    struct lum_rgb sum = lum_grey(0.0f);
    for (uint32_t k = 0; k < LUM_EDGE_RAYS; k++)
        sum =
            lum_rgb_add(sum, pass->components->radiance[lum_edge_neighbour(neighbours->of[at], k, at, pass->tiling.w)]);
    return lum_rgb_scale(sum, 1.0f / LUM_EDGE_RAYS);
}

static void find_neighbours(struct neighbours *neighbours, const struct lum_pass *pass, const struct lum_tile_rect *r,
                            struct lum_counters *counters)
{
    struct lum_guide guide = lum_components_guide(pass);
    struct edge_batch batch;
    uint8_t edge[LUM_TILE_PIXELS];
    find_edges(pass, &guide, r, edge);
    batch.neighbours = neighbours;
    batch.n = 0;
    for (uint32_t i = 0; i < r->w * r->h; i++) {
        neighbours->of[(size_t)(r->y + i / r->w) * pass->tiling.w + r->x + i % r->w] = LUM_NEIGHBOURS_SELF;
        if (!edge[i])
            continue;
        batch.x[batch.n] = r->x + i % r->w;
        batch.y[batch.n++] = r->y + i / r->w;
        if (batch.n == EDGE_BATCH)
            look(pass, &batch, counters);
    }
    look(pass, &batch, counters);
}

static void finish(void *state)
{
    struct neighbours *l = state;
    lum_free(l->of);
    lum_free(l->known);
    *l = (struct neighbours){0};
}

static bool reserve(void *state, const struct lum_pass *pass)
{
    struct neighbours *l = state;
    if (!l->of)
        l->of = lum_calloc((size_t)pass->tiling.w * pass->tiling.h, sizeof *l->of);
    if (!l->known)
        l->known = lum_calloc(pass->tiling.n, 1);
    l->n_tiles = pass->tiling.n;
    return l->of && l->known;
}

/* Where something moved and nothing else happened, they stay wherever that does not show. */
static void invalidate(void *state, const struct lum_pass *pass, const struct lum_outcome *outcome)
{
    struct neighbours *l = state;
    if (outcome->neighbours == LUM_FATE_STALE)
        memset(l->known, 0, l->n_tiles);
    for (uint32_t t = 0; outcome->neighbours == LUM_FATE_MOVED && t < l->n_tiles; t++)
        if (pass->motion_mask->in_sight[t])
            l->known[t] = 0;
}

static const struct lum_state_kind neighbours_kind = {sizeof(struct neighbours), reserve, invalidate, finish};

const uint32_t *lum_edge_neighbours(const struct lum_states *states)
{
    const struct neighbours *neighbours = lum_state(states, &neighbours_kind);
    return neighbours ? neighbours->of : NULL;
}

static void edges_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    if (pass->tile_spp[tile] >= pass->target_spp)
        return;
    const struct lum_rgb *radiance = pass->components->radiance;
    struct neighbours *neighbours = lum_pass_state(pass, &neighbours_kind);
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    if (!neighbours->known[tile])
        find_neighbours(neighbours, pass, &r, counters);
    neighbours->known[tile] = 1;
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        uint32_t x = r.x + i % r.w, y = r.y + i / r.w;
        size_t at = (size_t)y * pass->tiling.w + x;
        lum_film_set(pass->film, x, y,
                     neighbours->of[at] == LUM_NEIGHBOURS_SELF ? radiance[at] : lent(pass, neighbours, at),
                     &counters->nonfinite);
    }
    pass->tile_spp[tile] = pass->target_spp;
}

const struct lum_estimator lum_estimator_edges = {.name = "edges",
                                                  .stage = LUM_STAGE_ANTIALIAS,
                                                  .tile = edges_tile,
                                                  .state = &neighbours_kind,
                                                  .then = &lum_shadow_edges};

const struct lum_effect_row lum_effect_antialias = {.adds = LUM_ADDS_NOTHING};
