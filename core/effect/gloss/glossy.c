/* Light by way of glossy surfaces: from each pixel that shows one, a path is sent off by its glossy lobe and traced on
 * as the path tracer does. What it meets that shines is weighted against the light sampling of the other estimators.
 *
 * What paths bring home is kept light by light, per unit of power: another colour, intensity or switch of a light is
 * another sum, without a ray. A light that was dark when the paths were traced was not looked for: its first light
 * traces them anew. Where something moved, the paths are traced anew that its boxes, before or now, met.
 */
#include "core/effect/gloss/gloss.h"
#include "core/effect/direct/layers.h"
#include "core/math/sampler.h"
#include "core/path/wave.h"
#include "core/scene/surface.h"

#include <string.h>

/* Many a coat reflects a twentieth of what the surface below it does: a path starts with so many times the chance that
 * its gloss has of what its pixel reflects; not by throughput alone, on a black screen nothing else is seen. Those that
 * start end as others do. With 1 and 2 the few that are left stand out as spots; a first frame of crytek_sponza,
 * conference_mcguire and desk (600 x 400) has a SMAPE of 34.3, 16.6 and 17.3 %, where all start one of 34.2, 16.4
 * and 17.2 %. */
#define GLOSS_SURVIVAL 4.0f

static void begin(const struct lum_pass *pass, const struct lum_snapshot *snapshot, struct lum_counters *counters,
                  struct lum_wave *ret_wave)
{
    /* In fog a path may go on for hundreds of segments, which are not kept. */
    uint32_t off = lum_pass_effects_off(pass) | LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING);
    lum_wave_begin(ret_wave, snapshot, counters, pass->settings->max_depth, off);
    ret_wave->roulette_depth = 0;
    ret_wave->gloss_survival = GLOSS_SURVIVAL;
}

static struct lum_gloss *state_of(const struct lum_pass *pass)
{
    return lum_pass_state(pass, &lum_gloss_kind);
}

static size_t pixel_of(const struct lum_pass *pass, const struct lum_tile_rect *r, uint32_t slot)
{
    return (size_t)(r->y + slot / r->w) * pass->tiling.w + r->x + slot % r->w;
}

/* What a pixel's path brings home is in proportion to, about: not where its surface is also one that is looked through.
 */
static struct lum_rgb albedo_of(const struct lum_bsdf *b, struct lum_vec3 wo)
{
    return b->glass > 0.0f ? lum_grey(1.0f) : lum_rgb_add(lum_bsdf_gloss_albedo(b, wo), lum_bsdf_sheen_albedo(b, wo));
}

/* Paths start at the glossy pixels of a ray batch tile; stale: of those that have it set. */
static void add_paths(const struct lum_pass *pass, uint32_t tile, const bool *stale, struct lum_wave *w)
{
    const struct lum_gloss_pixels *pixels = &state_of(pass)->pixels;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct lum_rays eye;
    lum_tile_center_rays(pass, tile, &eye);
    for (uint32_t i = 0; i < eye.n; i++) {
        uint32_t x = r.x + i % r.w, y = r.y + i / r.w;
        size_t pixel = pixel_of(pass, &r, i);
        lum_snapshot_ask_ahead(w->snapshot, &pass->gbuffer->tiles[tile], i, eye.n);
        if (!stale[i] || !(pass->surfaces->kind[pixel] & LUM_PIXEL_GLOSS))
            continue;
        struct lum_vec3 d = lum_rays_direction(&eye, i), wo = lum_v3_neg(d);
        struct lum_surface s;
        struct lum_bsdf b;
        lum_snapshot_surface(w->snapshot, &pass->gbuffer->tiles[tile], i, d, &s);
        lum_bsdf_init(&b, &w->snapshot->materials[s.material], &s, wo);
        pixels->albedo[pixel] = albedo_of(&b, wo);
        pixels->hit[pixel] = lum_rgb(0.0f, 0.0f, lum_bsdf_gloss_lobe(&b, wo).alpha);
        lum_wave_add_gloss(w, i, lum_sampler_at(x, y, 0, pass->settings->seed), s.p, &b, wo);
    }
}

/* Traces them, and notes how far each went first. */
static void trace(const struct lum_pass *pass, uint32_t tile, struct lum_wave *w)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    uint32_t n = w->rays.n;
    size_t pixel[LUM_RAY_BATCH];
    for (uint32_t i = 0; i < n; i++)
        pixel[i] = pixel_of(pass, &r, w->path[i].slot);
    lum_wave_step(w, 1);
    for (uint32_t i = 0; i < n; i++) {
        struct lum_rgb *hit = &state_of(pass)->pixels.hit[pixel[i]];
        hit->r = w->hits.object[i] == LUM_NO_OBJECT ? 0.0f : 1.0f / lum_max(w->hits.t[i], LUM_RAY_OFFSET);
        hit->g = 1.0f;
    }
    lum_wave_run(w, 2);
}

/* ---- bright paths ---- */

/* A path that found a small bright thing by a rare way would stand out as a dot for as long as the frame shows, so that
 * no path is let be brighter than this many times the mean of the others in its tile that found anything; or, where few
 * did, of all its glossy pixels. (Among five paths none is six times as bright as the mean with it.) What that takes
 * away, the pixels around get: lum_gloss_give_back. */
#define BRIGHTEST 6.0f

static float sum_of(const struct lum_rgb *radiance, uint32_t n)
{
    float sum = 0.0f;
    for (uint32_t i = 0; i < n; i++)
        sum += lum_luminance(radiance[i]);
    return sum;
}

void lum_gloss_tame(struct lum_gloss_tile *tile, struct lum_rgb *radiance, uint32_t n, uint32_t n_gloss)
{
    float whole = sum_of(radiance, n);
    for (int round = 0; round < 2; round++) { /* the first mean is still that of other outliers, too */
        float lit = 0.0f, sum = sum_of(radiance, n);
        for (uint32_t i = 0; i < n; i++)
            lit += lum_luminance(radiance[i]) > 0.0f ? 1.0f : 0.0f;
        for (uint32_t i = 0; i < n; i++) {
            float y = lum_luminance(radiance[i]);
            float most = BRIGHTEST * lum_max((sum - y) / lum_max(lit - 1.0f, 1.0f), sum / (float)n_gloss);
            if (y > most)
                radiance[i] = lum_rgb_scale(radiance[i], most / y);
        }
    }
    tile->kept = sum_of(radiance, n);
    tile->cut = lum_max(whole - tile->kept, 0.0f);
}

/* Tiles each way over which it is given back, and how much more a pixel gets at most, over what it has: as far as that,
 * no light is lost. In conference_mcguire 3 % of the picture's light, without it. */
#define GIVE_TILES 4
#define GIVE_MOST 1.0f

/* What the tiles around one cut, over what they kept: two numbers, so that they can be interpolated. */
struct gift {
    float kept, cut;
};

static struct gift gift_around(const struct lum_gloss *gloss, const struct lum_tiling *t, int32_t tx, int32_t ty)
{
    static const float weight[2 * GIVE_TILES + 1] = {1, 8, 28, 56, 70, 56, 28, 8, 1};
    struct gift sum = {0};
    for (int32_t y = -GIVE_TILES; y <= GIVE_TILES; y++)
        for (int32_t x = -GIVE_TILES; x <= GIVE_TILES; x++) {
            if (tx + x < 0 || tx + x >= (int32_t)t->nx || ty + y < 0 || ty + y >= (int32_t)t->ny)
                continue;
            const struct lum_gloss_tile *tile = &gloss->tiles[(uint32_t)(ty + y) * t->nx + (uint32_t)(tx + x)];
            float w = weight[x + GIVE_TILES] * weight[y + GIVE_TILES];
            sum.kept += w * tile->kept;
            sum.cut += w * tile->cut;
        }
    return sum;
}

static struct gift mix(struct gift a, struct gift b, float t)
{
    return (struct gift){a.kept + (b.kept - a.kept) * t, a.cut + (b.cut - a.cut) * t};
}

enum { GIFTS = LUM_CELL_SIDE / LUM_TILE_SIDE + 2 }; /* tiles of a cell each way, and one on either side */

void lum_gloss_give_back(const struct lum_gloss *gloss, const struct lum_pass *pass, const struct lum_tile_rect *r,
                         struct lum_rgb *light)
{
    struct gift gift[GIFTS][GIFTS]; /* of the cell's tiles, and those around */
    for (int32_t y = 0; y < GIFTS; y++)
        for (int32_t x = 0; x < GIFTS; x++)
            gift[y][x] = gift_around(gloss, &pass->tiling, (int32_t)(r->x / LUM_TILE_SIDE) + x - 1,
                                     (int32_t)(r->y / LUM_TILE_SIDE) + y - 1);
    for (uint32_t y = 0; y < r->h; y++)
        for (uint32_t x = 0; x < r->w; x++) {
            float fx = ((float)x + 0.5f) / LUM_TILE_SIDE + 0.5f, fy = ((float)y + 0.5f) / LUM_TILE_SIDE + 0.5f;
            uint32_t ix = (uint32_t)fx, iy = (uint32_t)fy;
            float u = fx - (float)ix, v = fy - (float)iy;
            struct gift g =
                mix(mix(gift[iy][ix], gift[iy][ix + 1], u), mix(gift[iy + 1][ix], gift[iy + 1][ix + 1], u), v);
            if (g.cut > 0.0f && g.kept > 0.0f)
                light[y * r->w + x] = lum_rgb_scale(light[y * r->w + x], 1.0f + lum_min(g.cut / g.kept, GIVE_MOST));
        }
}

/* ---- at any power ---- */

/* Room of a tile on a worker's stack, 25 and 84 KiB. Where there are more gains the tile is traced at the present
 * power, where there are more segments its paths are traced anew after a move: pictures stay the same. */
#define GAINS_MAX (5u * LUM_TILE_PIXELS)
#define SEGMENTS_MAX (12u * LUM_TILE_PIXELS)

/* Of each tile, by size of the picture alone. */
static uint32_t most_within_budget(const struct lum_pass *pass, size_t bytes, uint32_t max)
{
    size_t most = LUM_GLOSS_BYTES / (pass->tiling.n * bytes);
    return most < max ? (uint32_t)most : max;
}

static void sum_gains(const struct lum_pass *pass, const struct lum_gain *gains, uint32_t n,
                      struct lum_rgb ret_radiance[LUM_TILE_PIXELS])
{
    const struct lum_light *lights = pass->snapshot->lights.lights;
    memset(ret_radiance, 0, LUM_TILE_PIXELS * sizeof *ret_radiance);
    for (uint32_t i = 0; i < n; i++) {
        struct lum_rgb power = lum_grey(1.0f);
        if (gains[i].light != LUM_NO_OBJECT)
            power = lights[gains[i].light].on ? lights[gains[i].light].power : lum_grey(0.0f);
        struct lum_rgb *sum = &ret_radiance[gains[i].slot];
        *sum = lum_rgb_add(*sum, lum_rgb_mul(gains[i].value, power));
    }
}

/* Without memory for them the tile is traced anew next time. */
static void keep_gains(struct lum_gloss_tile *kept, const struct lum_gains *gains)
{
    if (kept->capacity < gains->n) {
        lum_free(kept->gains);
        kept->gains = lum_calloc(gains->n, sizeof *kept->gains);
        kept->capacity = kept->gains ? gains->n : 0;
    }
    bool whole = gains->n_lost == 0 && kept->capacity >= gains->n;
    kept->state = whole ? LUM_GLOSS_KEPT : LUM_GLOSS_NONE;
    kept->n = whole ? gains->n : 0;
    if (kept->n)
        memcpy(kept->gains, gains->gains, gains->n * sizeof *gains->gains);
}

/* Without memory for it all paths of the tile are traced anew once anything moves. */
static void keep_segments(struct lum_gloss_tile *kept, const struct lum_path_segments *segments_met)
{
    if (kept->segment_capacity < segments_met->n) {
        lum_free(kept->segments);
        kept->segments = lum_calloc(segments_met->n, sizeof *kept->segments);
        kept->segment_capacity = kept->segments ? segments_met->n : 0;
    }
    kept->followed = segments_met->n_lost == 0 && kept->segment_capacity >= segments_met->n;
    kept->n_segments = kept->followed ? segments_met->n : 0;
    if (kept->n_segments)
        memcpy(kept->segments, segments_met->segments, segments_met->n * sizeof *segments_met->segments);
}

static struct lum_gloss_tile *kept_of(const struct lum_pass *pass, uint32_t tile)
{
    return &state_of(pass)->tiles[tile];
}

/* Whose path what moved may have changed: the eye may see something else there, or it met a segment. */
static void find_stale(const struct lum_pass *pass, uint32_t tile, bool stale[LUM_TILE_PIXELS])
{
    const struct lum_motion_mask *motion_mask = pass->motion_mask;
    const struct lum_gloss_tile *kept = kept_of(pass, tile);
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        uint32_t x = (r.x + i % r.w) / LUM_MOTION_BLOCK_SIDE, y = (r.y + i / r.w) / LUM_MOTION_BLOCK_SIDE;
        stale[i] = motion_mask->changed[y * motion_mask->blocks.nx + x];
    }
    for (uint32_t k = 0; k < kept->n_segments; k++) {
        const struct lum_path_segment *s = &kept->segments[k];
        stale[s->slot] = stale[s->slot] || lum_motion_meets(&motion_mask->motion, s->from, s->to);
    }
}

/* What is kept of paths that nothing met. The order of a slot's gains is that in which its path brought them home,
 * whatever other slots do: so is their sum. */
static void take_over(const struct lum_pass *pass, uint32_t tile, bool stale[LUM_TILE_PIXELS], struct lum_gains *gains,
                      struct lum_path_segments *segments_met)
{
    const struct lum_gloss_tile *kept = kept_of(pass, tile);
    memset(stale, true, LUM_TILE_PIXELS * sizeof *stale);
    if (kept->state != LUM_GLOSS_MOVED || !kept->followed || !lum_motion_mask_is_known(pass->motion_mask))
        return;
    find_stale(pass, tile, stale);
    for (uint32_t k = 0; k < kept->n; k++)
        if (!stale[kept->gains[k].slot])
            gains->gains[gains->n++] = kept->gains[k];
    for (uint32_t k = 0; k < kept->n_segments; k++)
        if (!stale[kept->segments[k].slot])
            segments_met->segments[segments_met->n++] = kept->segments[k];
}

/* False: there are more gains than have room, and the tile is to be traced at the present power. */
static bool trace_at_any_power(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters,
                               struct lum_rgb ret_radiance[LUM_TILE_PIXELS])
{
    struct lum_gain room[GAINS_MAX];
    struct lum_path_segment segments[SEGMENTS_MAX];
    struct lum_gains gains = {.gains = room, .max = most_within_budget(pass, sizeof *room, GAINS_MAX)};
    struct lum_path_segments segments_met = {.segments = segments,
                                             .max = most_within_budget(pass, sizeof *segments, SEGMENTS_MAX)};
    bool stale[LUM_TILE_PIXELS];
    struct lum_wave w;
    take_over(pass, tile, stale, &gains, &segments_met);
    begin(pass, &pass->layers->unit, counters, &w);
    w.gains = &gains;
    w.segments_met = &segments_met;
    add_paths(pass, tile, stale, &w);
    trace(pass, tile, &w);
    keep_gains(kept_of(pass, tile), &gains);
    keep_segments(kept_of(pass, tile), &segments_met);
    sum_gains(pass, room, gains.n, ret_radiance);
    return gains.n_lost == 0;
}

static void trace_at_present_power(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters,
                                   struct lum_rgb ret_radiance[LUM_TILE_PIXELS])
{
    bool all[LUM_TILE_PIXELS];
    struct lum_wave w;
    memset(all, true, sizeof all);
    begin(pass, pass->snapshot, counters, &w);
    add_paths(pass, tile, all, &w);
    trace(pass, tile, &w);
    memcpy(ret_radiance, w.radiance, sizeof w.radiance);
}

static uint32_t count_gloss(const struct lum_pass *pass, const struct lum_tile_rect *r)
{
    uint32_t n = 0;
    for (uint32_t y = r->y; y < r->y + r->h; y++)
        for (uint32_t x = r->x; x < r->x + r->w; x++)
            n += pass->surfaces->kind[(size_t)y * pass->tiling.w + x] & LUM_PIXEL_GLOSS ? 1 : 0;
    return n;
}

static void keep_nothing(struct lum_gloss_tile *kept)
{
    kept->n = kept->n_segments = 0;
    kept->kept = kept->cut = 0.0f;
    kept->followed = true;
    kept->state = LUM_GLOSS_KEPT;
}

/* What reflects less of a colour shows none: there is no more of it to be divided out. */
#define ALBEDO_MIN 0x1p-20f

/* Tamed radiance of a tile's pixels, for the filters. */
static void show(const struct lum_pass *pass, const struct lum_tile_rect *r, const struct lum_rgb *radiance)
{
    const struct lum_gloss_pixels *pixels = &state_of(pass)->pixels;
    for (uint32_t i = 0; i < r->w * r->h; i++) {
        size_t pixel = pixel_of(pass, r, i);
        if (!(pass->surfaces->kind[pixel] & LUM_PIXEL_GLOSS))
            continue;
        struct lum_rgb albedo = pixels->albedo[pixel];
        pixels->light[pixel] =
            lum_rgb(radiance[i].r / lum_max(albedo.r, ALBEDO_MIN), radiance[i].g / lum_max(albedo.g, ALBEDO_MIN),
                    radiance[i].b / lum_max(albedo.b, ALBEDO_MIN));
    }
}

static void glossy_batch(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct lum_gloss_tile *kept = kept_of(pass, tile);
    struct lum_rgb radiance[LUM_TILE_PIXELS];
    uint32_t n_gloss = count_gloss(pass, &r);
    if (n_gloss == 0) {
        keep_nothing(kept);
        return;
    }
    if (kept->state == LUM_GLOSS_KEPT)
        sum_gains(pass, kept->gains, kept->n, radiance);
    else if (!trace_at_any_power(pass, tile, counters, radiance))
        trace_at_present_power(pass, tile, counters, radiance);
    lum_gloss_tame(kept, radiance, r.w * r.h, n_gloss);
    show(pass, &r, radiance);
}

static void glossy_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    if (pass->settings->max_depth == 0 || lum_components_enter(pass, LUM_EFFECT_GLOSSY, cell))
        return;
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    for (uint32_t y = r.y / LUM_TILE_SIDE; y * LUM_TILE_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_TILE_SIDE; x * LUM_TILE_SIDE < r.x + r.w; x++)
            glossy_batch(pass, y * pass->tiling.nx + x, counters);
}
_Static_assert(LUM_CELL_SIDE % LUM_TILE_SIDE == 0, "a packet is made of ray batch tiles");

const struct lum_estimator lum_estimator_glossy = {
    .name = "glossy",
    .stage = LUM_STAGE_GLOSSY,
    .tile = glossy_cell,
    .cells = true,
    .state = &lum_gloss_kind,
    .components = LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY),
};

const struct lum_effect_row lum_effect_glossy = {.demand = lum_demand_by_surface,
                                                 .scatter = LUM_SCATTER_GLOSS,
                                                 .lamps_count = true,
                                                 .why = "reflects with a gloss",
                                                 .why_not = "no object reflects with a gloss",
                                                 .adds = LUM_ADDS_SURFACE};
