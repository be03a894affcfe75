/* From samples to the response of a light: the ratio estimator (Heitz, Hill & McGuire 2018).
 *
 * What the light would give without occluders is known in closed form; the samples only say which share of it arrives:
 *   share = sum of f visible / sum of f traced,   f = cosine / pdf: what the sample brings, were it visible
 * over the 4 x 4 window (5 wide with half weights at its ends, which holds each stratum once) of pixels on the same
 * surface, or over the pixel alone where it knows all strata. Where all samples around agree the share is 1 or 0,
 * exactly, and no window is looked at. Lights without a closed form take the plain sum of their samples instead.
 *
 * The lobes that are not cosine-shaped are summed over the pixel's own view of some strata, untraced ones with the
 * share as their visibility. */
#include "core/estimator/penumbra_window.h"

#include <string.h>

#include "core/light/irradiance.h"
#include "core/math/warp.h"

#define BORDER LUM_WINDOW_BORDER
#define BLOCK LUM_WINDOW_BLOCK
#define SETS (LUM_TILE_SIDE / LUM_SOFT_SIDE) /* tiles of the pattern along a side of a tile */
#define GLOSS_POINTS 4u

/* Which tile of the pattern a pixel of a tile is in. */
static uint32_t set_at(uint32_t x, uint32_t y)
{
    return y / LUM_SOFT_SIDE * SETS + x / LUM_SOFT_SIDE;
}

/* A pixel that light can be summed at. */
struct vertex {
    size_t pixel;      /* index into the picture */
    uint8_t x, y, set; /* in the tile: where it lies, and in which tile of the pattern */
};

/* One tile, one layer at a time. About 90 KiB: lives on a worker's stack. */
struct resolve {
    const struct lum_pass *pass;
    const struct lum_layer *layer;
    struct lum_tile_rect r;
    struct lum_tiling sets;
    uint32_t n_vertices;
    struct vertex vertex[LUM_TILE_PIXELS];
    struct lum_bsdf bsdf[LUM_TILE_PIXELS]; /* by vertex, but for those that are matte */
    struct lum_vec3 wo[LUM_TILE_PIXELS];   /* same */
    bool exact;                            /* the present layer's light has a closed form */
    uint32_t stale;                        /* of the present layer: bit y * SETS + x, by tile of the pattern */
    uint8_t around[SETS * SETS];           /* lum_soft_around */
    uint8_t says[LUM_TILE_PIXELS];         /* LUM_SOFT_ bits of all samples in the window of each pixel, of its
                                            * surface or not */
    struct lum_penumbra_window window;
};

/* ---- what needs no window ---- */

static uint8_t bits_of(struct lum_seen seen)
{
    return (uint8_t)((seen.traced & seen.visible ? LUM_SOFT_LIT : 0) |
                     (seen.traced & ~seen.visible ? LUM_SOFT_DARK : 0));
}

/* Where all samples of a window agree, nobody needs to know which of them are of the pixel's own surface: first by
 * tiles of the pattern, then by windows, a row and a column at a time. */
static void look_around(struct resolve *v)
{
    uint8_t row[BLOCK * BLOCK], mixed = 0;
    uint32_t w = v->pass->tiling.w, h = v->pass->tiling.h, x0 = v->r.x / LUM_SOFT_SIDE, y0 = v->r.y / LUM_SOFT_SIDE;
    for (uint32_t left = v->stale; left; left &= left - 1) {
        uint32_t set = (uint32_t)__builtin_ctz(left);
        uint8_t bits = (uint8_t)lum_soft_around(&v->layer->soft, &v->sets, x0 + set % SETS, y0 + set / SETS);
        v->around[set] = bits;
        mixed |= bits == (LUM_SOFT_LIT | LUM_SOFT_DARK);
    }
    memset(v->says, LUM_SOFT_LIT | LUM_SOFT_DARK, sizeof v->says);
    if (!mixed || v->r.x < BORDER || v->r.y < BORDER || v->r.x + v->r.w + BORDER > w || v->r.y + v->r.h + BORDER > h)
        return; /* beyond an edge of the picture others stand in */
    for (uint32_t y = 0; y < v->r.h + 2 * BORDER; y++) {
        const struct lum_seen *seen = v->layer->soft.seen + (size_t)(v->r.y + y - BORDER) * w + v->r.x - BORDER;
        uint8_t bits[BLOCK];
        for (uint32_t x = 0; x < v->r.w + 2 * BORDER; x++)
            bits[x] = bits_of(seen[x]);
        for (uint32_t x = 0; x < v->r.w; x++)
            row[y * BLOCK + x] = bits[x] | bits[x + 1] | bits[x + 2] | bits[x + 3] | bits[x + 4];
    }
    for (uint32_t y = 0; y < v->r.h; y++)
        for (uint32_t x = 0; x < v->r.w; x++) {
            const uint8_t *at = &row[y * BLOCK + x];
            v->says[y * LUM_TILE_SIDE + x] = at[0] | at[BLOCK] | at[2 * BLOCK] | at[3 * BLOCK] | at[4 * BLOCK];
        }
}
_Static_assert(LUM_WINDOW_SIDE == 5, "look_around joins five");

/* LUM_SOFT_ bits: both, when the window has to be looked at. A pixel that asked nobody itself takes its neighbours'
 * word. */
static uint32_t says_at(const struct resolve *v, const struct vertex *at)
{
    uint32_t around = v->around[at->set], says = v->says[at->y * LUM_TILE_SIDE + at->x];
    bool own = v->layer->soft.seen[at->pixel].traced;
    return around == (LUM_SOFT_LIT | LUM_SOFT_DARK) && says != 0 && own ? says : around;
}

/* The pdf that the estimator which finds the light by the lobe weighs against: of lum_light_sample_at, whatever this
 * one was sampled with. */
static float light_pdf(const struct resolve *v, struct lum_vec3 p, const struct lum_light_sample *ls)
{
    const struct lum_snapshot *unit = &v->pass->layers->unit;
    const struct lum_light *l = &unit->lights.lights[v->layer->index];
    if (l->kind != LUM_EMIT_QUAD)
        return ls->pdf_sa;
    return lum_light_pdf(unit, v->layer->index, p, ls->wi, lum_v3_mad(p, ls->wi, ls->distance), l->n);
}

/* Per unit of power, without what is in the way of it. */
static struct lum_rgb gloss(const struct resolve *v, uint32_t i, size_t pixel, float share)
{
    struct lum_seen own = v->layer->soft.seen[pixel];
    struct lum_vec3 p = v->pass->surfaces->p[pixel], wo = v->wo[i];
    struct lum_bsdf lobe = lum_bsdf_gloss(&v->bsdf[i]);
    bool whole = lum_seen_whole(own),
         shared = v->pass->on[LUM_EFFECT_GLOSSY]; /* another estimator finds the light, too */
    float even_pdf = shared ? lum_light_even_pdf(&v->pass->layers->unit, v->layer->index, p) : 0.0f;
    uint32_t set =
        lum_pattern_set(LUM_SOFT_SIDE, (uint32_t)(pixel % v->pass->tiling.w), (uint32_t)(pixel / v->pass->tiling.w));
    /* Numbers that agree in their lower two bits are a (0,2,2)-net; the pixels of a 2 x 2 block take one each. */
    uint32_t first = whole ? 0 : (set ^ set >> 2) & 3u, step = whole ? 1 : LUM_SOFT_POINTS / GLOSS_POINTS;
    struct lum_rgb sum = lum_grey(0.0f);
    struct lum_penumbra_view view;
    lum_penumbra_look(v->pass, v->layer, pixel, &view);
    for (uint32_t k = first; k < LUM_SOFT_POINTS; k += step) {
        struct lum_light_sample ls;
        float visible = own.traced >> k & 1 ? (float)(own.visible >> k & 1) : share;
        if (!(visible > 0.0f) || lum_penumbra_sample(&view, k, &ls) != LUM_PENUMBRA_OPEN)
            continue;
        struct lum_bsdf_value f = lum_bsdf_eval_parts(&lobe, wo, ls.wi);
        float weight = visible / ls.pdf_sa;
        if (shared)
            weight *= lum_power_heuristic(even_pdf > 0.0f ? even_pdf : light_pdf(v, p, &ls), f.gloss_pdf_sa);
        sum = lum_rgb_add(sum, lum_rgb_mul(f.gloss, lum_rgb_scale(lum_penumbra_arriving(v->pass, pixel, &ls), weight)));
    }
    return lum_rgb_scale(sum, (float)step / (float)LUM_SOFT_POINTS);
}

/* What media leave of the light as a whole. It changes little over a light, so that a few strata tell, the same for
 * every pixel: no noise. Summed up as what they take, so that nothing taken leaves exactly 1. */
static struct lum_rgb left_of_light(const struct resolve *v, size_t pixel)
{
    const struct lum_pass *pass = v->pass;
    struct lum_rgb taken = lum_grey(0.0f);
    float weight = 0.0f;
    struct lum_penumbra_view view;
    lum_penumbra_look(pass, v->layer, pixel, &view);
    for (uint32_t k = 0; k < LUM_SOFT_POINTS; k += LUM_SOFT_POINTS / GLOSS_POINTS) {
        struct lum_light_sample ls;
        if (lum_penumbra_sample(&view, k, &ls) == LUM_PENUMBRA_NEEDLESS)
            continue;
        float f = fabsf(lum_dot(ls.wi, pass->surfaces->n[pixel])) / ls.pdf_sa;
        struct lum_rgb left = lum_media_transmittance(pass->snapshot, pass->surfaces->p[pixel], ls.wi, ls.distance);
        taken = lum_rgb_mad(taken, lum_rgb_mad(lum_grey(1.0f), left, -1.0f), f);
        weight += f;
    }
    return weight > 0.0f ? lum_rgb_mad(lum_grey(1.0f), taken, -1.0f / weight) : lum_grey(1.0f);
}

static bool is_matte(uint8_t kind)
{
    return !(kind & (LUM_PIXEL_GLOSS | LUM_PIXEL_SPECULAR));
}

/* Of light that comes on average at this cosine. */
static struct lum_rgb diffuse_of(const struct resolve *v, uint32_t i, size_t pixel, float mean_cos)
{
    const struct lum_surfaces *s = v->pass->surfaces;
    return is_matte(s->kind[pixel]) ? s->albedo[pixel] : lum_bsdf_diffuse_at(&v->bsdf[i], mean_cos);
}

/* True where only the window can tell which share of the light arrives. */
static bool is_mixed(const struct resolve *v, uint32_t around, size_t pixel)
{
    return (around & LUM_SOFT_LIT) && (!v->exact || around != LUM_SOFT_LIT) &&
           lum_penumbra_wants(v->pass, v->layer, pixel);
}

static struct lum_rgb response(const struct resolve *v, uint32_t i)
{
    const struct vertex *at = &v->vertex[i];
    const struct lum_surfaces *s = v->pass->surfaces;
    const struct lum_light *light = &v->pass->layers->unit.lights.lights[v->layer->index];
    size_t pixel = at->pixel;
    uint32_t around = says_at(v, at);
    if (!(around & LUM_SOFT_LIT) || !lum_penumbra_wants(v->pass, v->layer, pixel))
        return lum_grey(0.0f);
    struct lum_moments m = {0};
    float share = 1.0f;
    if (is_mixed(v, around, pixel)) {
        m = lum_penumbra_window_at(&v->window, at->x, at->y);
        share = lum_moments_share(&m);
        if (!(share > 0.0f))
            return lum_grey(0.0f);
    }
    if (v->layer->index == v->pass->cached_sky)
        return gloss(v, i, pixel, share);
    struct lum_rgb diffuse;
    struct lum_irradiance all;
    if (!v->exact) {
        diffuse = lum_rgb_mul(diffuse_of(v, i, pixel, m.cosine / m.seen), lum_rgb_scale(m.light, LUM_INV_PI / m.n));
    } else {
        lum_light_irradiance(light, s->p[pixel], s->n[pixel], &all);
        diffuse = lum_rgb_scale(diffuse_of(v, i, pixel, all.mean_cos), all.cosine_integral * LUM_INV_PI * share);
        if (v->pass->on[LUM_EFFECT_MEDIA])
            diffuse = lum_rgb_mul(diffuse, left_of_light(v, pixel));
    }
    if (!(s->kind[pixel] & LUM_PIXEL_GLOSS))
        return diffuse;
    return lum_rgb_add(diffuse, gloss(v, i, pixel, share));
}

/* What the eye sees in some tiles of the pattern: the pixels that light can be summed at. */
static void fill_vertices(struct resolve *v, uint32_t tile, uint32_t sets)
{
    const struct lum_pass *pass = v->pass;
    const struct lum_snapshot *unit = &pass->layers->unit;
    v->n_vertices = 0;
    for (uint32_t i = 0, y = 0; y < v->r.h; y++)
        for (uint32_t x = 0; x < v->r.w; x++, i++) {
            size_t pixel = (size_t)(v->r.y + y) * pass->tiling.w + v->r.x + x;
            uint32_t set = set_at(x, y), k = v->n_vertices;
            uint8_t kind = pass->surfaces->kind[pixel];
            if (!(sets >> set & 1) || !(kind & (LUM_PIXEL_DIFFUSE | LUM_PIXEL_GLOSS)))
                continue;
            v->vertex[v->n_vertices++] = (struct vertex){pixel, (uint8_t)x, (uint8_t)y, (uint8_t)set};
            if (is_matte(kind)) /* its albedo is all */
                continue;
            struct lum_vec3 d = lum_center_direction(pass, v->r.x + x, v->r.y + y);
            struct lum_surface s;
            v->wo[k] = lum_v3_neg(d);
            lum_snapshot_surface(unit, &pass->gbuffer->tiles[tile], i, d, &s);
            lum_bsdf_init(&v->bsdf[k], &unit->materials[s.material], &s, v->wo[k]);
        }
}

/* Hash of what a row of three tiles of the pattern knows, or three rows. Many tiles know the same: a row must not be
 * linear, or rows and columns could change places. */
static uint64_t join(uint64_t a, uint64_t b, uint64_t c)
{
    uint64_t h = a * 0xd6e8feb86659fd93u + b * 0xa0761d6478bd642fu + c * 0xe7037ed1a0b428dbu;
    return (h ^ h >> 32) * 0x9e3779b97f4a7c15u;
}

/* Hashes of what each tile of the pattern and the eight around it know: all that its windows reach. Returns those for
 * which that is not what it was. */
static uint32_t find_stale(const struct resolve *v, const struct lum_soft *soft, uint64_t ret_known[SETS * SETS])
{
    uint32_t x0 = v->r.x / LUM_SOFT_SIDE, y0 = v->r.y / LUM_SOFT_SIDE, stale = 0;
    uint32_t nx = v->sets.nx, ny = v->sets.ny;
    uint64_t print[SETS + 2][SETS + 2] = {0}, row[SETS + 2][SETS];
    for (uint32_t y = y0 > 0 ? y0 - 1 : 0; y <= y0 + SETS && y < ny; y++)
        for (uint32_t x = x0 > 0 ? x0 - 1 : 0; x <= x0 + SETS && x < nx; x++)
            print[y + 1 - y0][x + 1 - x0] = soft->tally[y * nx + x].print;
    for (uint32_t j = 0; j < SETS + 2; j++)
        for (uint32_t i = 0; i < SETS; i++)
            row[j][i] = join(print[j][i], print[j][i + 1], print[j][i + 2]);
    for (uint32_t j = 0; j < SETS && y0 + j < ny; j++)
        for (uint32_t i = 0; i < SETS && x0 + i < nx; i++) {
            uint64_t known = join(row[j][i], row[j + 1][i], row[j + 2][i]) | 1u; /* never 0 */
            ret_known[j * SETS + i] = known;
            stale |= (uint32_t)(soft->resolved[(y0 + j) * nx + x0 + i] != known) << (j * SETS + i);
        }
    return stale;
}

static uint32_t stale_in_any(const struct resolve *v)
{
    uint32_t stale = 0, a = 0;
    uint64_t known[SETS * SETS];
    for (struct lum_layer *layer; (layer = lum_penumbra_next(v->pass, &a));)
        stale |= find_stale(v, &layer->soft, known);
    return stale;
}

static void gather_windows(struct resolve *v)
{
    uint32_t mixed[LUM_TILE_SIDE] = {0};
    for (uint32_t i = 0; i < v->n_vertices; i++) {
        const struct vertex *at = &v->vertex[i];
        if ((v->stale >> at->set & 1) && is_mixed(v, says_at(v, at), at->pixel))
            mixed[at->y] |= 1u << at->x;
    }
    lum_penumbra_window_gather(&v->window, v->layer, mixed);
}

static void resolve_layer(struct resolve *v, struct lum_layer *layer, uint32_t tile)
{
    const struct lum_pass *pass = v->pass;
    uint64_t known[SETS * SETS];
    v->layer = layer;
    v->exact = lum_light_has_irradiance(&pass->layers->unit.lights.lights[layer->index]);
    v->stale = find_stale(v, &layer->soft, known);
    if (!v->stale)
        return;
    look_around(v);
    if (pass->settings->max_depth > 0)
        gather_windows(v);
    struct lum_rgb *direct = layer->soft.direct + (size_t)tile * LUM_TILE_PIXELS;
    for (uint32_t i = 0, y = 0; y < v->r.h; y++)
        for (uint32_t x = 0; x < v->r.w; x++, i++)
            if (v->stale >> set_at(x, y) & 1)
                direct[i] = lum_grey(0.0f);
    for (uint32_t i = 0; i < v->n_vertices && pass->settings->max_depth > 0; i++) {
        const struct vertex *at = &v->vertex[i];
        if (v->stale >> at->set & 1)
            direct[at->y * v->r.w + at->x] = response(v, i);
    }
    for (uint32_t left = v->stale; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left), x = v->r.x / LUM_SOFT_SIDE + k % SETS;
        layer->soft.resolved[(v->r.y / LUM_SOFT_SIDE + k / SETS) * v->sets.nx + x] = known[k];
    }
}

static void resolve_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    (void)counters;
    struct resolve v;
    v.pass = pass;
    v.r = lum_tile_at(&pass->tiling, tile);
    v.sets = lum_soft_tiling(pass);
    uint32_t stale = stale_in_any(&v), a = 0;
    if (!stale)
        return;
    fill_vertices(&v, tile, stale);
    lum_penumbra_window_init(&v.window, pass, tile);
    for (struct lum_layer *layer; (layer = lum_penumbra_next(pass, &a));)
        resolve_layer(&v, layer, tile);
}

const struct lum_estimator lum_penumbra_resolve = {.name = "penumbra, resolve",
                                                   .stage = LUM_STAGE_FILTER,
                                                   .tile = resolve_tile,
                                                   .surfaces = true,
                                                   .then = &lum_crowd_trace};
