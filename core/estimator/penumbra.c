/* The rays of soft shadows. */
#include "core/estimator/penumbra.h"

#include <string.h>

#include "core/estimator/components.h"
#include "core/interleave/interleave.h"
#include "core/light/irradiance.h"

#define GLOSS_ALBEDO 0.1f /* guidance only: what a surface reflects otherwise than diffusely */

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

static const struct lum_estimator penumbra_fill;

/* Shadow rays of one layer that wait to be traced together. */
struct batch {
    const struct lum_pass *pass;
    struct lum_layer *layer;
    struct lum_counters *counters;
    struct lum_rays rays;
    size_t pixel[LUM_RAY_BATCH];
    uint16_t bit[LUM_RAY_BATCH];
    uint32_t n_asked; /* samples, of the layer */
};

static void begin_layer(struct batch *b, struct lum_layer *layer)
{
    b->layer = layer;
    b->rays.n = 0;
    b->n_asked = 0;
}

static void flush(struct batch *b)
{
    if (b->rays.n == 0)
        return;
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_trace trace = lum_trace_of(b->pass->snapshot, b->counters);
    lum_trace_any(&trace, &b->rays, occluded);
    b->counters->rays[lum_light_ray_kind(&b->layer->light)] += b->rays.n;
    for (uint32_t i = 0; i < b->rays.n; i++) {
        struct lum_seen *seen = &b->layer->soft.seen[b->pixel[i]];
        seen->traced |= b->bit[i];
        if (!occluded[i])
            seen->visible |= b->bit[i];
    }
    b->rays.n = 0;
}

/* Finds out whether the pixel sees sample k, which it does not know. */
static void ask(struct batch *b, const struct lum_penumbra_view *view, uint32_t k)
{
    size_t pixel = view->pixel;
    struct lum_seen *seen = &b->layer->soft.seen[pixel];
    uint16_t bit = (uint16_t)(1u << k);
    struct lum_light_sample ls;
    enum lum_penumbra_side side = lum_penumbra_sample(view, k, &ls);
    b->n_asked++;
    if (side == LUM_PENUMBRA_OPEN) {
        uint32_t i = b->rays.n;
        if (lum_shadow_ray(&b->rays, b->pass->surfaces->p[pixel], b->pass->surfaces->ng[pixel], ls.wi, ls.distance)) {
            b->pixel[i] = pixel;
            b->bit[i] = bit;
            if (b->rays.n == LUM_RAY_BATCH)
                flush(b);
            return;
        }
    }
    if (side != LUM_PENUMBRA_NEEDLESS)
        seen->traced |= bit;
    if (side != LUM_PENUMBRA_HIDDEN)
        seen->visible |= bit;
}

/* ---- what is known from before the eye moved ---- */

#define NOWHERE UINT32_MAX

/* The pixel that saw the same spot when the eye was elsewhere: it lies within a pixel's size of the plane there. */
static uint32_t former_pixel(const struct lum_pass *pass, size_t pixel)
{
    const struct lum_surfaces *s = pass->surfaces;
    uint32_t x, y;
    if (!(s->kind[pixel] & (LUM_PIXEL_DIFFUSE | LUM_PIXEL_GLOSS)) ||
        !lum_eye_pixel(&pass->layers->former_eye, s->p[pixel], &x, &y))
        return NOWHERE;
    uint32_t from = y * pass->tiling.w + x;
    float off = lum_dot(s->n[pixel], lum_v3_sub(s->former_p[from], s->p[pixel]));
    bool same =
        lum_dot(s->n[pixel], s->former_n[from]) > LUM_SAME_COS && fabsf(off) <= pass->eye.per_pixel * s->depth[pixel];
    return same ? from : NOWHERE;
}

static void find_former(const struct lum_pass *pass, struct lum_tile_rect r, uint32_t *ret_from)
{
    for (uint32_t i = 0; i < r.w * r.h; i++)
        ret_from[i] = former_pixel(pass, (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w);
}

/* Takes over what that pixel knew of every other stratum, in turn. So nothing is older than two moves, each of which is
 * off by up to half a pixel. Measured in a pan of cornell by 2.5 pixels a frame, before shares were joined (relMSE,
 * rays): nothing carried on 1.4e-3, 475 thousand; all but one stratum 2.6e-3, 114; all but four 9e-4, 339; half 7e-4,
 * 394. What the pixel knows by itself, after an edit of materials, stays. */
static void carry(const struct lum_pass *pass, struct lum_soft *soft, struct lum_tile_rect r, const uint32_t *from)
{
    uint16_t keep = pass->layers->n_moves % 2 ? 0xaaaau : 0x5555u;
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        if (from[i] == NOWHERE)
            continue;
        struct lum_seen was = soft->former[from[i]];
        struct lum_seen *seen = &soft->seen[(size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w];
        uint16_t traced = was.traced & keep & (uint16_t) ~(seen->traced | seen->visible);
        seen->traced |= traced;
        seen->visible |= was.visible & traced;
    }
}

/* ---- first stratum ---- */

#define SETS_ACROSS (LUM_PACKET_SIDE / LUM_SOFT_SIDE)

/* Some of the tiles of the pattern in a packet. */
struct sets {
    bool in[SETS_ACROSS * SETS_ACROSS];
};

/* The one that pixel (x, y) of the packet is in. */
static uint32_t set_at(uint32_t x, uint32_t y)
{
    return y / LUM_SOFT_SIDE * SETS_ACROSS + x / LUM_SOFT_SIDE;
}

static void ask_first(struct batch *b, size_t pixel, uint32_t k)
{
    struct lum_seen seen = b->layer->soft.seen[pixel];
    struct lum_penumbra_view view;
    if ((seen.traced | seen.visible) >> k & 1)
        return;
    lum_penumbra_look(b->pass, b->layer, pixel, &view);
    ask(b, &view, k);
}

/* All pixels of the packet that begin with stratum k: their rays end near one point of the light. sets: only those in
 * such tiles of the pattern. */
static void trace_stratum(struct batch *b, struct lum_tile_rect r, uint32_t k, const struct sets *sets)
{
    uint32_t dx, dy;
    lum_pattern_place(LUM_SOFT_SIDE, k, &dx, &dy);
    for (uint32_t y = dy; y < r.h; y += LUM_SOFT_SIDE)
        for (uint32_t x = dx; x < r.w; x += LUM_SOFT_SIDE)
            if (sets->in[set_at(x, y)])
                ask_first(b, (size_t)(r.y + y) * b->pass->tiling.w + r.x + x, k);
}

static void trace_strata(struct batch *b, struct lum_tile_rect r, uint16_t strata, const struct sets *sets)
{
    for (uint32_t left = strata; left; left &= left - 1)
        trace_stratum(b, r, (uint32_t)__builtin_ctz(left), sets);
    flush(b);
}
_Static_assert(LUM_PACKET_SIDE % LUM_SOFT_SIDE == 0 && LUM_PACKET_SIDE % LUM_TILE_SIDE == 0,
               "packets are made of whole tiles of the pattern, and of the picture");

/* Drops of what the pixels know what no ray in front of the surface has found out: where a sample lies to the shading
 * normal, and whether the surface lets light through, decided the rest, and may be otherwise now. */
static void reconsider(const struct lum_pass *pass, const struct lum_layer *layer, struct lum_tile_rect r)
{
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        size_t pixel = (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w;
        struct lum_seen *seen = &layer->soft.seen[pixel];
        uint32_t true_still = 0;
        struct lum_penumbra_view view;
        lum_penumbra_look(pass, layer, pixel, &view);
        for (uint32_t left = seen->traced; left; left &= left - 1) {
            uint32_t k = (uint32_t)__builtin_ctz(left);
            struct lum_light_sample ls;
            if (lum_penumbra_sample(&view, k, &ls) == LUM_PENUMBRA_OPEN &&
                lum_dot(ls.wi, pass->surfaces->ng[pixel]) > 0.0f)
                true_still |= 1u << k;
        }
        seen->traced &= (uint16_t)true_still;
        seen->visible &= (uint16_t)true_still;
    }
}

/* Counts the samples of the packet's tiles of the pattern. */
static void count(const struct lum_pass *pass, struct lum_soft *s, struct lum_tile_rect r)
{
    struct lum_tiling sets = lum_soft_tiling(pass);
    for (uint32_t y = r.y / LUM_TILE_SIDE; y * LUM_TILE_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_TILE_SIDE; x * LUM_TILE_SIDE < r.x + r.w; x++)
            s->told[y * pass->tiling.nx + x] = pass->layers->n_passes;
    for (uint32_t y = r.y / LUM_SOFT_SIDE; y * LUM_SOFT_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_SOFT_SIDE; x * LUM_SOFT_SIDE < r.x + r.w; x++) {
            struct lum_tile_rect t = lum_tile_at(&sets, y * sets.nx + x);
            struct lum_soft_tally sum = {0};
            uint64_t print = 0;
            for (uint32_t i = 0; i < t.w * t.h; i++) {
                struct lum_seen seen = s->seen[(size_t)(t.y + i / t.w) * pass->tiling.w + t.x + i % t.w];
                print = lum_soft_print(print, seen);
                sum.known += (uint16_t)__builtin_popcount(seen.traced | seen.visible);
                sum.traced += (uint16_t)__builtin_popcount(seen.traced);
                sum.visible += (uint16_t)__builtin_popcount(seen.traced & seen.visible);
            }
            s->tally[y * sets.nx + x] = sum;
            s->prints[y * sets.nx + x] = print;
        }
}

/* ---- what the light would bring, were nothing in the way ---- */

/* Pixels that stand for their tile of the pattern. */
struct probes {
    uint32_t n;
    size_t pixel[2 * SETS_ACROSS * SETS_ACROSS];
    uint32_t set[2 * SETS_ACROSS * SETS_ACROSS];
    float share[2 * SETS_ACROSS * SETS_ACROSS]; /* of the mean */
};

static void add_probes(struct probes *p, const struct lum_pass *pass, const struct lum_layer *layer,
                       struct lum_tile_rect t, uint32_t set)
{
    uint32_t n = t.w > 2 && t.h > 2 ? 2 : 1;
    for (uint32_t i = 0; i < n; i++) {
        size_t pixel = (size_t)(t.y + 2 * i) * pass->tiling.w + t.x + 2 * i;
        if (!lum_penumbra_wants(pass, layer, pixel))
            continue;
        p->pixel[p->n] = pixel;
        p->set[p->n] = set;
        p->share[p->n++] = 1.0f / (float)n;
    }
}

/* By the pixel's own stratum, where there is no closed form. */
static float sample_unshadowed(const struct lum_pass *pass, const struct lum_layer *layer, size_t pixel)
{
    uint32_t k = lum_pattern_set(LUM_SOFT_SIDE, (uint32_t)(pixel % pass->tiling.w), (uint32_t)(pixel / pass->tiling.w));
    struct lum_light_sample ls;
    struct lum_penumbra_view view;
    lum_penumbra_look(pass, layer, pixel, &view);
    if (lum_penumbra_sample(&view, k, &ls) == LUM_PENUMBRA_NEEDLESS)
        return 0.0f;
    return lum_luminance(ls.radiance) * fabsf(lum_dot(ls.wi, pass->surfaces->n[pixel])) / ls.pdf_sa;
}

/* The irradiance of each at power 1, or its luminance. */
static void find_irradiance(const struct lum_pass *pass, const struct lum_layer *layer, const struct probes *p,
                            float *ret)
{
    const struct lum_light *light = &pass->layers->unit.lights.lights[layer->index];
    struct lum_vec3 at[LUM_ARRAY_LEN(p->pixel)], n[LUM_ARRAY_LEN(p->pixel)];
    struct lum_irradiance all[LUM_ARRAY_LEN(p->pixel)];
    if (!lum_light_has_irradiance(light)) {
        for (uint32_t i = 0; i < p->n; i++)
            ret[i] = sample_unshadowed(pass, layer, p->pixel[i]);
        return;
    }
    for (uint32_t i = 0; i < p->n; i++)
        at[i] = pass->surfaces->p[p->pixel[i]], n[i] = pass->surfaces->n[p->pixel[i]];
    lum_light_irradiance(light, p->n, at, n, all);
    for (uint32_t i = 0; i < p->n; i++)
        ret[i] = all[i].cosine_integral;
}

/* The mean over two pixels of each tile of the pattern of which it is not known. */
static void estimate_unshadowed(const struct lum_pass *pass, struct lum_layer *layer, struct lum_tile_rect r)
{
    const struct lum_surfaces *s = pass->surfaces;
    struct lum_tiling sets = lum_soft_tiling(pass);
    float *unshadowed = layer->soft.unshadowed, white[LUM_ARRAY_LEN(((struct probes *)0)->pixel)];
    struct probes p = {.n = 0};
    for (uint32_t y = r.y / LUM_SOFT_SIDE; y * LUM_SOFT_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_SOFT_SIDE; x * LUM_SOFT_SIDE < r.x + r.w; x++) {
            uint32_t set = y * sets.nx + x;
            if (unshadowed[set] != LUM_SOFT_UNKNOWN)
                continue;
            unshadowed[set] = 0.0f;
            add_probes(&p, pass, layer, lum_tile_at(&sets, set), set);
        }
    find_irradiance(pass, layer, &p, white);
    for (uint32_t i = 0; i < p.n; i++) {
        float gloss = s->kind[p.pixel[i]] & LUM_PIXEL_GLOSS ? GLOSS_ALBEDO : 0.0f;
        float diffuse = layer->index == pass->cached_sky ? 0.0f : lum_luminance(s->albedo[p.pixel[i]]);
        unshadowed[p.set[i]] += white[i] * LUM_INV_PI * (gloss + diffuse) * p.share[i];
    }
}

/* ---- the first stratum of every fourth pixel ---- */

/* Which strata are asked for first: of lights without a closed form, whose light is the sum of the samples, all. */
static uint16_t first_points(const struct lum_pass *pass, const struct lum_layer *layer)
{
    bool exact = lum_light_has_irradiance(&pass->layers->unit.lights.lights[layer->index]);
    return exact ? layer->soft.first_points : UINT16_MAX;
}

/* Those in which not all is one surface of one kind, where pixels may see other parts of the light than their
 * neighbours do; and those that the border of the picture cuts, which may hold no pixel that is asked first. */
static void find_edges(const struct lum_pass *pass, struct lum_tile_rect r, struct sets *ret_edges)
{
    const uint8_t *kind = pass->surfaces->kind, lit = LUM_PIXEL_DIFFUSE | LUM_PIXEL_GLOSS,
                  kinds = lit | LUM_PIXEL_SPECULAR;
    struct lum_guide guide = lum_components_guide(pass);
    *ret_edges = (struct sets){0};
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        uint32_t x = i % r.w, y = i / r.w, x0 = x - x % LUM_SOFT_SIDE, y0 = y - y % LUM_SOFT_SIDE;
        size_t pixel = (size_t)(r.y + y) * pass->tiling.w + r.x + x,
               corner = (size_t)(r.y + y0) * pass->tiling.w + r.x + x0;
        bool cut = x0 + LUM_SOFT_SIDE > r.w || y0 + LUM_SOFT_SIDE > r.h;
        bool alike = pixel == corner || !(kind[pixel] & lit) || lum_guide_same_surface(&guide, pixel, corner);
        ret_edges->in[set_at(x, y)] |= cut || !alike || (kind[pixel] & kinds) != (kind[corner] & kinds);
    }
}

/* What the pixels that are asked first say. Nobody takes their word at edges, nor where none of them sees the light in
 * front of it, though it brings something. True: they say something new. */
static bool sum_first(const struct lum_pass *pass, struct lum_soft *s, struct lum_tile_rect r, const struct sets *edges)
{
    struct lum_tiling sets = lum_soft_tiling(pass);
    uint32_t nx = (r.w + LUM_SOFT_SIDE - 1) / LUM_SOFT_SIDE, ny = (r.h + LUM_SOFT_SIDE - 1) / LUM_SOFT_SIDE;
    uint8_t first[SETS_ACROSS * SETS_ACROSS];
    bool changed = false;
    for (uint32_t i = 0; i < SETS_ACROSS * SETS_ACROSS; i++)
        first[i] = edges->in[i] ? LUM_SOFT_LIT | LUM_SOFT_DARK : 0;
    for (uint32_t left = s->first_points; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left), dx, dy;
        lum_pattern_place(LUM_SOFT_SIDE, k, &dx, &dy);
        for (uint32_t y = dy; y < r.h; y += LUM_SOFT_SIDE)
            for (uint32_t x = dx; x < r.w; x += LUM_SOFT_SIDE) {
                struct lum_seen seen = s->seen[(size_t)(r.y + y) * pass->tiling.w + r.x + x];
                if (seen.traced >> k & 1)
                    first[set_at(x, y)] |= seen.visible >> k & 1 ? LUM_SOFT_LIT : LUM_SOFT_DARK;
            }
    }
    for (uint32_t y = 0; y < ny; y++) {
        size_t at = (size_t)(r.y / LUM_SOFT_SIDE + y) * sets.nx + r.x / LUM_SOFT_SIDE;
        for (uint32_t x = 0; x < nx; x++) {
            uint8_t bits = first[y * SETS_ACROSS + x];
            if (bits == 0 && s->unshadowed[at + x] > 0.0f)
                bits = LUM_SOFT_LIT | LUM_SOFT_DARK;
            changed |= s->first[at + x] != bits;
            s->first[at + x] = bits;
        }
    }
    return changed;
}

static void trace_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    if (pass->settings->max_depth == 0)
        return;
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    struct batch b;
    b.pass = pass;
    b.counters = counters;
    uint32_t a = 0, from[LUM_PACKET_SIDE * LUM_PACKET_SIDE];
    struct sets all, edges;
    bool looked = false;
    memset(all.in, true, sizeof all.in);
    for (struct lum_layer *layer; (layer = lum_penumbra_next(pass, &a));) {
        if (layer->soft.begun[packet] == LUM_SOFT_BEGUN)
            continue;
        begin_layer(&b, layer);
        if (!looked)
            find_edges(pass, r, &edges);
        if (pass->layers->carried && !looked)
            find_former(pass, r, from);
        looked = true;
        if (layer->soft.begun[packet] == LUM_SOFT_DOUBTED)
            reconsider(pass, layer, r);
        if (pass->layers->carried)
            carry(pass, &layer->soft, r, from);
        trace_strata(&b, r, first_points(pass, layer), &all);
        estimate_unshadowed(pass, layer, r);
        layer->soft.begun[packet] = LUM_SOFT_BEGUN;
        layer->soft.asked[packet] = pass->layers->n_passes;
        if (sum_first(pass, &layer->soft, r, &edges))
            layer->soft.changed[packet] = pass->layers->n_passes;
    }
}

const struct lum_estimator lum_estimator_penumbra = {
    .name = "penumbra",
    .stage = LUM_STAGE_SHADOW,
    .tile = trace_packet,
    .packets = true,
    .surfaces = true,
    .then = &penumbra_fill,
};

/* ---- the first stratum of the others ---- */

/* Those that do not agree with those around. */
static void find_mixed(const struct lum_pass *pass, const struct lum_soft *s, struct lum_tile_rect r,
                       struct sets *ret_mixed)
{
    struct lum_tiling sets = lum_soft_tiling(pass);
    uint8_t first[SETS_ACROSS + 2][SETS_ACROSS + 2] = {0}, row[SETS_ACROSS + 2][SETS_ACROSS];
    uint32_t x0 = r.x / LUM_SOFT_SIDE, y0 = r.y / LUM_SOFT_SIDE;
    for (uint32_t y = y0 > 0 ? y0 - 1 : 0; y < y0 + SETS_ACROSS + 1 && y < sets.ny; y++)
        for (uint32_t x = x0 > 0 ? x0 - 1 : 0; x < x0 + SETS_ACROSS + 1 && x < sets.nx; x++)
            first[y + 1 - y0][x + 1 - x0] = s->first[y * sets.nx + x];
    for (uint32_t y = 0; y < SETS_ACROSS + 2; y++)
        for (uint32_t x = 0; x < SETS_ACROSS; x++)
            row[y][x] = first[y][x] | first[y][x + 1] | first[y][x + 2];
    for (uint32_t y = 0; y < SETS_ACROSS; y++)
        for (uint32_t x = 0; x < SETS_ACROSS; x++)
            ret_mixed->in[y * SETS_ACROSS + x] =
                (row[y][x] | row[y + 1][x] | row[y + 2][x]) == (LUM_SOFT_LIT | LUM_SOFT_DARK);
}

/* Drops what a tile of the pattern knows beyond what is asked first, so that a picture does not depend on what was
 * there before. (What refinement found out where all had agreed from the start stays.) */
static void drop_others(const struct lum_pass *pass, struct lum_soft *s, struct lum_tile_rect t)
{
    for (uint32_t y = 0; y < t.h; y++)
        for (uint32_t x = 0; x < t.w; x++) {
            struct lum_seen *seen = &s->seen[(size_t)(t.y + y) * pass->tiling.w + t.x + x];
            uint32_t k = lum_pattern_set(LUM_SOFT_SIDE, x, y);
            uint16_t keep = (uint16_t)(s->first_points & 1u << k);
            seen->traced &= keep;
            seen->visible &= keep;
        }
}

/* Drops what others know where they are not asked any more. True: any did. */
static bool drop_where_agreed(const struct lum_pass *pass, struct lum_soft *s, struct lum_tile_rect r,
                              const struct sets *mixed)
{
    struct lum_tiling sets = lum_soft_tiling(pass);
    bool dropped = false;
    for (uint32_t y = r.y / LUM_SOFT_SIDE; y * LUM_SOFT_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_SOFT_SIDE; x * LUM_SOFT_SIDE < r.x + r.w; x++) {
            uint32_t set = y * sets.nx + x;
            bool all = mixed->in[set_at(x * LUM_SOFT_SIDE - r.x, y * LUM_SOFT_SIDE - r.y)];
            if (s->all_asked[set] == all)
                continue;
            if (!all)
                drop_others(pass, s, lum_tile_at(&sets, set));
            dropped |= !all;
            s->all_asked[set] = all;
            s->open[set] = 1;
        }
    return dropped;
}

/* True when the packet was filled since it was last asked, and since one that touches it last said something new. */
static bool is_filled(const struct lum_pass *pass, const struct lum_soft *s, uint32_t packet)
{
    uint32_t x0 = packet % pass->packets.nx, y0 = packet / pass->packets.nx, news = s->asked[packet];
    for (uint32_t y = y0 > 0 ? y0 - 1 : 0; y <= y0 + 1 && y < pass->packets.ny; y++)
        for (uint32_t x = x0 > 0 ? x0 - 1 : 0; x <= x0 + 1 && x < pass->packets.nx; x++) {
            uint32_t at = y * pass->packets.nx + x;
            news = s->changed[at] > news ? s->changed[at] : news;
        }
    return s->filled[packet] >= news;
}

static void fill_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    struct batch b;
    b.pass = pass;
    b.counters = counters;
    uint32_t a = 0;
    for (struct lum_layer *layer; pass->settings->max_depth > 0 && (layer = lum_penumbra_next(pass, &a));) {
        struct lum_soft *s = &layer->soft;
        struct sets mixed;
        uint16_t others = (uint16_t)~first_points(pass, layer);
        bool dropped = false;
        if (is_filled(pass, s, packet))
            continue;
        begin_layer(&b, layer);
        if (others) {
            find_mixed(pass, s, r, &mixed);
            dropped = drop_where_agreed(pass, s, r, &mixed);
            trace_strata(&b, r, others, &mixed);
        }
        if (dropped || b.n_asked || s->asked[packet] > s->filled[packet])
            count(pass, s, r);
        s->filled[packet] = pass->layers->n_passes;
    }
}

static const struct lum_estimator penumbra_fill = {
    .name = "penumbra, fill",
    .stage = LUM_STAGE_SHADOW,
    .tile = fill_packet,
    .packets = true,
    .surfaces = true,
    .then = &lum_penumbra_refine,
};

/* ---- further strata ---- */

static void refine_pixel(struct batch *b, uint32_t x, uint32_t y, uint32_t goal)
{
    size_t pixel = (size_t)y * b->pass->tiling.w + x;
    struct lum_seen seen = b->layer->soft.seen[pixel];
    uint32_t known = seen.traced | seen.visible, n = (uint32_t)__builtin_popcount(known);
    uint32_t set = lum_pattern_set(LUM_SOFT_SIDE, x, y);
    struct lum_penumbra_view view;
    if (n >= goal)
        return;
    lum_penumbra_look(b->pass, b->layer, pixel, &view);
    for (uint32_t i = 0; i < LUM_SOFT_POINTS && n < goal; i++) {
        uint32_t k = lum_pattern_next(LUM_SOFT_SIDE, set, i);
        if (known >> k & 1)
            continue;
        ask(b, &view, k);
        n++;
    }
}

static bool refine_layer(struct batch *b, struct lum_tile_rect r)
{
    struct lum_tiling sets = lum_soft_tiling(b->pass);
    bool any = false;
    for (uint32_t y = r.y; y < r.y + r.h; y += LUM_SOFT_SIDE)
        for (uint32_t x = r.x; x < r.x + r.w; x += LUM_SOFT_SIDE) {
            uint32_t set = y / LUM_SOFT_SIDE * sets.nx + x / LUM_SOFT_SIDE, goal = b->layer->soft.goal[set];
            if (goal == 0)
                continue;
            struct lum_tile_rect t = lum_tile_at(&sets, set);
            for (uint32_t i = 0; i < t.w * t.h; i++)
                refine_pixel(b, t.x + i % t.w, t.y + i / t.w, goal);
            any = true;
        }
    flush(b);
    return any;
}

static void close_sets(const struct lum_pass *pass, struct lum_soft *s, struct lum_tile_rect r)
{
    struct lum_tiling sets = lum_soft_tiling(pass);
    for (uint32_t y = r.y / LUM_SOFT_SIDE; y * LUM_SOFT_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_SOFT_SIDE; x * LUM_SOFT_SIDE < r.x + r.w; x++)
            s->open[y * sets.nx + x] = 0;
}

static void refine_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    struct batch b;
    b.pass = pass;
    b.counters = counters;
    uint32_t a = 0;
    for (struct lum_layer *layer; pass->settings->max_depth > 0 && (layer = lum_penumbra_next(pass, &a));) {
        begin_layer(&b, layer);
        if (refine_layer(&b, r))
            count(pass, &layer->soft, r);
        if (pass->layers->refined_share > 0.0f)
            close_sets(pass, &layer->soft, r);
    }
}

const struct lum_estimator lum_penumbra_refine = {
    .name = "penumbra, refine",
    .stage = LUM_STAGE_REFINE,
    .begin = lum_penumbra_plan,
    .tile = refine_packet,
    .packets = true,
    .surfaces = true,
    .then = &lum_penumbra_share,
};
