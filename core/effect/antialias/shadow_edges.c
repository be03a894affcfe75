/* Anti-aliasing of hard shadows: where a light that shines from a point or a direction reaches a pixel and not the one
 * beside it, on the same surface, a few more shadow rays from within the pixel find out how much of it is lit. Sunlight
 * through blinds, in stripes thinner than a pixel, is dashes then and not dots.
 *
 * What the light would bring with nothing in the way is taken at the middle of the pixel. Who is lit where is kept, so
 * that another colour of the surface costs no ray. Edges are looked for where the middles of pixels differ, and
 * followed from there within a tile, whose points no other tile looks at: of others only the middles are read
 * (lum_layer.seen). */
#include "core/pass/components.h"
#include "core/effect/direct/direct.h"

#include <string.h>

#include "core/effect/antialias/antialias.h"
#include "core/math/color.h"
#include "core/scene/surface.h"

#define POINTS LUM_LAYER_INNER_POINTS

/* One tile, one layer at a time. */
struct edges {
    const struct lum_pass *pass;
    struct lum_layer *layer;
    struct lum_guide guide;
    struct lum_tile_rect r;
    uint8_t *inner;                                       /* of the layer, by slot */
    uint32_t *left;                                       /* same; NULL: there are no panes */
    uint8_t middle[LUM_TILE_SIDE + 2][LUM_TILE_SIDE + 2]; /* enum middle: of the tile and the pixels around it */
    uint32_t n;
    uint8_t slot[LUM_TILE_PIXELS]; /* of pixels at an edge */
    bool in[LUM_TILE_PIXELS];      /* these, by slot */
};

static size_t pixel_at(const struct edges *e, uint32_t slot)
{
    return (size_t)(e->r.y + slot / e->r.w) * e->pass->tiling.w + e->r.x + slot % e->r.w;
}

/* ---- where edges are ---- */

enum middle { UNKNOWN, DARK, LIT };

/* A pixel that reflects nothing was asked by chance, if at all: by another material before. */
static enum middle find_middle(const struct edges *e, uint32_t x, uint32_t y)
{
    const struct lum_tiling *t = &e->pass->tiling;
    uint32_t tile = y / LUM_TILE_SIDE * t->nx + x / LUM_TILE_SIDE;
    struct lum_tile_rect r = lum_tile_at(t, tile);
    struct lum_visibility visibility =
        e->layer->visibility[(size_t)tile * LUM_TILE_PIXELS + (y - r.y) * r.w + (x - r.x)];
    uint8_t kind = e->pass->surfaces->kind[(size_t)y * t->w + x];
    if (!(visibility.traced & 1u) || !(kind & (LUM_PIXEL_DIFFUSE | LUM_PIXEL_GLOSS)))
        return UNKNOWN;
    return visibility.visible & 1u ? LIT : DARK;
}

/* False: all that is known is alike. */
static bool find_middles(struct edges *e)
{
    uint32_t w = e->pass->tiling.w, h = e->pass->tiling.h;
    bool any[3] = {false};
    for (uint32_t j = 0; j < e->r.h + 2; j++)
        for (uint32_t i = 0; i < e->r.w + 2; i++) {
            uint32_t x = e->r.x + i - 1, y = e->r.y + j - 1;
            bool there = x < w && y < h; /* below 0 it wraps round */
            e->middle[j][i] = (uint8_t)(there ? find_middle(e, x, y) : UNKNOWN);
            any[e->middle[j][i]] = true;
        }
    return any[DARK] && any[LIT];
}

/* Pixel k of the nine around a slot: false where it shows another surface, or nothing is known of it. */
static bool is_beside(const struct edges *e, uint32_t slot, uint32_t k)
{
    uint32_t i = slot % e->r.w + k % 3, j = slot / e->r.w + k / 3;
    size_t own = pixel_at(e, slot), other = own + (size_t)(k / 3) * e->pass->tiling.w + k % 3 - e->pass->tiling.w - 1;
    return k != 4 && e->middle[j][i] != UNKNOWN && lum_guide_same_surface(&e->guide, own, other);
}

static bool is_at_edge(const struct edges *e, uint32_t slot)
{
    uint32_t x = slot % e->r.w, y = slot / e->r.w, own = e->middle[y + 1][x + 1];
    bool edge = false;
    for (uint32_t k = 0; k < 9 && own != UNKNOWN && !edge; k++)
        edge = e->middle[y + k / 3][x + k % 3] != own && is_beside(e, slot, k);
    return edge;
}

static void add_pixel(struct edges *e, uint32_t slot)
{
    if (!e->in[slot])
        e->slot[e->n++] = (uint8_t)slot;
    e->in[slot] = true;
}
_Static_assert(LUM_TILE_PIXELS <= 256, "a slot is a byte");

static void find_edges(struct edges *e)
{
    e->n = 0;
    if (!find_middles(e))
        return;
    memset(e->in, 0, sizeof e->in);
    for (uint32_t i = 0; i < e->r.w * e->r.h; i++)
        if (is_at_edge(e, i))
            add_pixel(e, i);
}

/* Beside pixels `from` to `to` of the list, where an edge runs through them, it goes on: as far as this tile. */
static void follow_edges(struct edges *e, uint32_t from, uint32_t to)
{
    for (uint32_t i = from; i < to; i++) {
        uint32_t slot = e->slot[i], x = slot % e->r.w, y = slot / e->r.w, lit = e->inner[slot] >> POINTS;
        bool middle = e->middle[y + 1][x + 1] == LIT, through = lit != (middle ? (1u << POINTS) - 1 : 0);
        for (uint32_t k = 0; k < 9 && through; k++) {
            uint32_t nx = x + k % 3 - 1, ny = y + k / 3 - 1;
            if (nx < e->r.w && ny < e->r.h && is_beside(e, slot, k))
                add_pixel(e, ny * e->r.w + nx);
        }
    }
}

/* ---- how much of a pixel is lit ---- */

/* How far above the tangent plane the neighbour on this side along one axis lies, times the way there; nothing beyond
 * the picture. False: it shows another surface. */
static bool rise(const struct edges *e, size_t pixel, uint32_t at, uint32_t size, size_t stride, float way,
                 float *inout_rise)
{
    const struct lum_surfaces *s = e->pass->surfaces;
    if (way > 0.0f ? at + 1 >= size : at == 0)
        return true;
    size_t other = way > 0.0f ? pixel + stride : pixel - stride;
    if (!lum_guide_same_surface(&e->guide, pixel, other))
        return false;
    *inout_rise += fabsf(way) * lum_max(lum_dot(lum_v3_sub(s->p[other], s->p[pixel]), s->ng[pixel]), 0.0f);
    return true;
}

/* The surface where the eye looks through point k of the pixel: in the tangent plane, and in a hollow as high as the
 * chord to the pixel beside. False where that is not known to be the surface, at its edge, or seen too flatly: beyond
 * the foot of a wall all is dark. */
#define FLATTEST 8.0f /* lengths of a pixel across the view */
static bool inner_point(const struct edges *e, uint32_t slot, uint32_t k, struct lum_vec3 *ret_p)
{
    /* four queens: each row and column of the pixel once, so that edges along the axes have five steps, too */
    static const struct lum_vec2 at[POINTS] = {{0.125f, 0.625f}, {0.375f, 0.125f}, {0.625f, 0.875f}, {0.875f, 0.375f}};
    const struct lum_pass *pass = e->pass;
    const struct lum_surfaces *s = pass->surfaces;
    uint32_t x = e->r.x + slot % e->r.w, y = e->r.y + slot / e->r.w, w = pass->tiling.w, h = pass->tiling.h;
    size_t pixel = pixel_at(e, slot);
    float up = 0.0f;
    if (!rise(e, pixel, x, w, 1, at[k].x - 0.5f, &up) || !rise(e, pixel, y, h, w, at[k].y - 0.5f, &up))
        return false;
    struct lum_vec3 d = lum_eye_direction(&pass->eye, (float)x + at[k].x, (float)y + at[k].y);
    struct lum_vec3 p = s->p[pixel], ng = s->ng[pixel];
    float t = lum_dot(lum_v3_sub(p, pass->eye.o), ng) / lum_dot(d, ng);
    struct lum_vec3 q = lum_v3_mad(pass->eye.o, d, t), off = lum_v3_sub(q, p);
    float most = FLATTEST * pass->eye.per_pixel * s->depth[pixel];
    *ret_p = lum_v3_mad(q, ng, up);
    return t > 0.0f && lum_dot(off, off) <= most * most;
}

/* Point k of the pixels from `from` on that do not know it, as in the middle where it cannot be told: bits 0 to 3 of
 * inner: it is known, bits 4 to 7: it is lit. */
static void ask(const struct edges *e, uint32_t from, uint32_t k, struct lum_counters *counters)
{
    const struct lum_pass *pass = e->pass;
    const struct lum_snapshot *unit = &pass->layers->unit;
    struct lum_rays rays;
    struct lum_rgb left[LUM_RAY_BATCH];
    uint8_t slot[LUM_RAY_BATCH], occluded[LUM_RAY_BATCH];
    rays.n = 0;
    for (uint32_t i = from; i < e->n; i++) {
        uint8_t *inner = &e->inner[e->slot[i]];
        struct lum_light_sample ls;
        if (*inner >> k & 1)
            continue;
        struct lum_vec3 p;
        if (!inner_point(e, e->slot[i], k, &p)) {
            *inner |=
                (uint8_t)((e->middle[e->slot[i] / e->r.w + 1][e->slot[i] % e->r.w + 1] == LIT ? 0x11u : 0x01u) << k);
            continue;
        }
        *inner |= (uint8_t)(0x11u << k);
        if (lum_light_sample_plainly(unit, e->layer->index, p, (struct lum_vec2){0.5f, 0.5f}, &ls) &&
            lum_shadow_ray(&rays, p, pass->surfaces->ng[pixel_at(e, e->slot[i])], ls.wi, ls.distance))
            slot[rays.n - 1] = e->slot[i];
    }
    if (rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of_light(pass->snapshot, counters, lum_pass_panes(pass));
    lum_trace_light(&trace, &rays, occluded, left);
    counters->rays[LUM_RAY_ANTIALIAS] += rays.n;
    for (uint32_t i = 0; i < rays.n; i++)
        if (occluded[i])
            e->inner[slot[i]] &= (uint8_t) ~(0x10u << k);
        else if (e->left && e->middle[slot[i] / e->r.w + 1][slot[i] % e->r.w + 1] == DARK)
            e->left[slot[i]] = lum_transmittance_pack(left[i]); /* of the last point that is lit */
}
_Static_assert(LUM_TILE_PIXELS <= LUM_RAY_BATCH && POINTS == 4, "a tile's rays of a point are a batch; and nibbles");

static void look_at(const struct edges *e, struct lum_vertices *ret_vertices)
{
    const struct lum_snapshot *unit = &e->pass->layers->unit;
    uint32_t tile = e->r.y / LUM_TILE_SIDE * e->pass->tiling.nx + e->r.x / LUM_TILE_SIDE;
    ret_vertices->n = 0;
    for (uint32_t i = 0; i < e->n; i++) {
        uint32_t slot = e->slot[i], x = e->r.x + slot % e->r.w, y = e->r.y + slot / e->r.w;
        struct lum_vec3 d = lum_center_direction(e->pass, x, y), wo = lum_v3_neg(d);
        struct lum_surface s;
        lum_snapshot_surface(unit, &e->pass->gbuffer->tiles[tile], slot, d, &s);
        lum_bsdf_init(&ret_vertices->bsdf[i], &unit->materials[s.material], &s, wo);
        lum_vertices_push(ret_vertices, slot, s.p, wo, 0); /* a light without extent: its one sample is no draw */
    }
}

static void smooth(const struct edges *e, const struct lum_visibility *visibility, struct lum_rgb *inout_response)
{
    struct lum_vertices vertices;
    look_at(e, &vertices);
    const struct lum_direct job = {
        .snapshot = &e->pass->layers->unit,
        .light = e->layer->index,
        .salt = e->layer->salt,
        .media = e->pass->on[LUM_EFFECT_MEDIA],
        .vertices = &vertices,
    };
    for (uint32_t i = 0; i < e->n; i++) {
        uint32_t slot = e->slot[i],
                 lit = (uint32_t)__builtin_popcount(e->inner[slot] >> POINTS) + (visibility[slot].visible & 1u);
        struct lum_rgb all = lum_grey(0.0f);
        if (!lum_direct_unoccluded(&job, i, &all))
            continue;
        all = lum_rgb_scale(all, (float)lit / (POINTS + 1));
        inout_response[slot] = e->left ? lum_rgb_mul(all, lum_transmittance_unpack(e->left[slot])) : all;
    }
}

static void smooth_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    struct lum_layers *l = pass->layers;
    struct edges e = {.pass = pass, .guide = lum_components_guide(pass), .r = lum_tile_at(&pass->tiling, tile)};
    size_t first = (size_t)tile * LUM_TILE_PIXELS;
    if (pass->settings->max_depth == 0 || lum_layers_reached(pass, tile, LUM_LAYER_SMOOTH))
        return;
    for (uint32_t a = 0; a < pass->snapshot->lights.n_active; a++) {
        uint32_t k = l->layer_of[pass->snapshot->lights.active[a]];
        if (k == LUM_NO_OBJECT || !l->layers[k].inner || l->layers[k].state[tile] >= LUM_LAYER_SMOOTH)
            continue;
        e.layer = &l->layers[k];
        e.inner = e.layer->inner + first;
        e.left = e.layer->left ? e.layer->left + first : NULL;
        find_edges(&e);
        for (uint32_t from = 0, to = e.n; from < to; from = to, to = e.n) {
            for (uint32_t point = 0; point < POINTS; point++)
                ask(&e, from, point, counters);
            follow_edges(&e, from, to);
        }
        if (e.n > 0)
            smooth(&e, e.layer->visibility + first, e.layer->response + first);
    }
    lum_layers_reach(pass, tile, LUM_LAYER_SMOOTH);
}

const struct lum_estimator lum_shadow_edges = {
    .name = "shadow edges", .stage = LUM_STAGE_REFINE, .tile = smooth_tile, .surfaces = true};
