/* Anti-aliasing of edges, after Chajdas, McGuire & Luebke 2011 (Subpixel reconstruction antialiasing): where a pixel's
 * neighbour shows another surface, a few more eye rays find out how much of the pixel each surface covers, and each
 * takes the radiance of the neighbouring pixel that shows its surface. Visibility is sampled finely, shading is not
 * done again. */
#include "core/estimator/components.h"

#define EDGE_RAYS                                                                                                      \
    8u /* per pixel at an edge; the fewest with which a slanted edge shows no steps at 8 bits of contrast 1:20 */
#define EDGE_BATCH (LUM_RAY_BATCH / EDGE_RAYS)

/* Pixels at an edge whose rays are traced together. */
struct edge_batch {
    uint32_t n;
    uint32_t x[EDGE_BATCH], y[EDGE_BATCH];
    struct lum_rays rays;
    struct lum_hits hits;
};

static bool same_surface(const struct lum_pass *pass, const struct lum_guide *guide, size_t a, size_t b)
{
    const struct lum_surfaces *s = pass->surfaces;
    return s->object[a] == s->object[b] && (s->object[a] == LUM_NO_OBJECT || lum_guide_same_surface(guide, a, b));
}

static bool at_edge(const struct lum_pass *pass, const struct lum_guide *guide, uint32_t x, uint32_t y)
{
    size_t at = (size_t)y * guide->w + x;
    return (x > 0 && !same_surface(pass, guide, at, at - 1)) ||
           (x + 1 < guide->w && !same_surface(pass, guide, at, at + 1)) ||
           (y > 0 && !same_surface(pass, guide, at, at - guide->w)) ||
           (y + 1 < guide->h && !same_surface(pass, guide, at, at + guide->w));
}

/* Cosine between normals of one smooth surface, at least; and the distance of a point from a pixel's plane, in pixels
 * there, at most: two, for a neighbour's point lies up to a pixel and a half away on a curved surface. */
#define NORMAL_COS_MIN 0.9f
#define PLANE_PIXELS_MAX 2.0f

/* Whether pixel `at` shows the surface that hit i of the batch is on. */
static bool shows(const struct lum_pass *pass, const struct edge_batch *batch, uint32_t i,
                  const struct lum_surface *hit, size_t at)
{
    const struct lum_surfaces *s = pass->surfaces;
    if (s->object[at] != batch->hits.object[i])
        return false;
    if (s->object[at] == LUM_NO_OBJECT)
        return true;
    float pixel = pass->eye.per_pixel * s->depth[at];
    return lum_dot(s->n[at], hit->ns) > NORMAL_COS_MIN &&
           fabsf(lum_dot(lum_v3_sub(hit->p, s->p[at]), s->n[at])) <= PLANE_PIXELS_MAX * pixel;
}

/* Radiance of ray i, which went through the film at (fx, fy) in pixel (x, y): that of the pixel nearest to it, of the
 * nine around, which shows its surface; of its own pixel where none does. */
static struct lum_rgb borrow(const struct lum_pass *pass, const struct edge_batch *batch, uint32_t i, uint32_t x,
                             uint32_t y, struct lum_vec2 film)
{
    uint32_t w = pass->tiling.w, h = pass->tiling.h;
    struct lum_surface hit;
    if (batch->hits.object[i] != LUM_NO_OBJECT)
        lum_snapshot_surface(pass->snapshot, &batch->hits, i, lum_rays_direction(&batch->rays, i), &hit);
    size_t best = (size_t)y * w + x;
    float nearest = INFINITY;
    for (uint32_t ny = y > 0 ? y - 1 : 0; ny <= y + 1 && ny < h; ny++)
        for (uint32_t nx = x > 0 ? x - 1 : 0; nx <= x + 1 && nx < w; nx++) {
            float dx = (float)nx + 0.5f - film.x, dy = (float)ny + 0.5f - film.y, d2 = dx * dx + dy * dy;
            size_t at = (size_t)ny * w + nx;
            if (d2 < nearest && shows(pass, batch, i, &hit, at)) {
                nearest = d2;
                best = at;
            }
        }
    return pass->components->radiance[best];
}

static struct lum_vec2 film_at(const struct lum_pass *pass, uint32_t x, uint32_t y, uint32_t k)
{
    struct lum_sampler sampler = lum_sampler_at(x, y, k, pass->settings->seed);
    struct lum_vec2 u = lum_sampler_2d(&sampler, 0);
    return (struct lum_vec2){(float)x + u.x, (float)y + u.y};
}

static void finish_batch(const struct lum_pass *pass, struct edge_batch *batch, struct lum_counters *counters)
{
    if (batch->n == 0)
        return;
    batch->rays.n = 0;
    for (uint32_t i = 0; i < batch->n; i++)
        for (uint32_t k = 0; k < EDGE_RAYS; k++) {
            struct lum_vec2 film = film_at(pass, batch->x[i], batch->y[i], k);
            lum_rays_push(&batch->rays, pass->eye.o, lum_eye_direction(&pass->eye, film.x, film.y), INFINITY);
        }
    struct lum_trace trace = lum_trace_of_eye(pass->snapshot, counters);
    lum_trace_closest(&trace, &batch->rays, &batch->hits);
    counters->rays[LUM_RAY_ANTIALIAS] += batch->rays.n;
    for (uint32_t i = 0; i < batch->n; i++) {
        uint32_t x = batch->x[i], y = batch->y[i];
        struct lum_rgb sum = lum_grey(0.0f);
        for (uint32_t k = 0; k < EDGE_RAYS; k++)
            sum = lum_rgb_add(sum, borrow(pass, batch, i * EDGE_RAYS + k, x, y, film_at(pass, x, y, k)));
        lum_film_reset_pixel(pass->film, x, y);
        lum_film_add(pass->film, x, y, 0, lum_rgb_scale(sum, 1.0f / EDGE_RAYS), &counters->nonfinite);
    }
    batch->n = 0;
}

static void edges_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    if (pass->tile_spp[tile] >= pass->target_spp)
        return;
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct edge_batch batch = {.n = 0};
    for (uint32_t y = r.y; y < r.y + r.h; y++)
        for (uint32_t x = r.x; x < r.x + r.w; x++) {
            if (at_edge(pass, &guide, x, y)) {
                batch.x[batch.n] = x;
                batch.y[batch.n++] = y;
                if (batch.n == EDGE_BATCH)
                    finish_batch(pass, &batch, counters);
                continue;
            }
            lum_film_reset_pixel(pass->film, x, y);
            lum_film_add(pass->film, x, y, 0, pass->components->radiance[(size_t)y * pass->tiling.w + x],
                         &counters->nonfinite);
        }
    finish_batch(pass, &batch, counters);
    pass->tile_spp[tile] = pass->target_spp;
}

const struct lum_estimator lum_estimator_edges = {.name = "edges", .stage = LUM_STAGE_ANTIALIAS, .tile = edges_tile};
