#include "core/effect/direct/area_visibility.h"

#include <assert.h>
#include <string.h>

#include "core/interleave/interleave.h"
#include "core/math/sampler.h"
#include "core/math/sampler_pairs.h"

/* Numbers of the pattern that lie in one 2 x 2 block differ in their upper two bits. Reversed, they are neighbours in
 * the sequence: then every such block holds a (0,2,2)-net, one of the four that make up the whole. */
static uint32_t reversed4(uint32_t k)
{
    return (k & 1u) << 3 | (k & 2u) << 1 | (k & 4u) >> 1 | (k & 8u) >> 3;
}

/* True when each of the 4 x 1, 2 x 2 and 1 x 4 parts of the square holds one of the points: a (0,2,2)-net. */
static bool are_net(const struct lum_vec2 *point, const uint32_t k[4])
{
    uint32_t columns = 0, rows = 0, quarters = 0;
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t x = (uint32_t)(point[k[i]].x * 4.0f), y = (uint32_t)(point[k[i]].y * 4.0f);
        columns |= 1u << x;
        rows |= 1u << y;
        quarters |= 1u << (y / 2 * 2 + x / 2);
    }
    return columns == 15 && rows == 15 && quarters == 15;
}

/* In how many rows and columns of the pattern the pixels lie that begin with these. */
static uint32_t spread(const uint32_t k[4])
{
    uint32_t columns = 0, rows = 0;
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t x, y;
        lum_pattern_pixel(LUM_AREA_SIDE, k[i], &x, &y);
        columns |= 1u << x;
        rows |= 1u << y;
    }
    return (uint32_t)(__builtin_popcount(columns) + __builtin_popcount(rows));
}

/* Four points, one of each 2 x 2 block of the pattern (numbers of a block agree in their lower two bits): of all such
 * choices the net whose pixels are spread best. There is one: of Sobol's points in blocks of four in a row, take of
 * block a = a0 + 2 a1 the one at (a0 + a1 mod 2) + 2 a0; and scrambling leaves a net a net. */
static void choose_first(struct lum_area_visibility *s)
{
    uint32_t most = 0;
    for (uint32_t choice = 0; choice < 256; choice++) {
        uint32_t k[4];
        for (uint32_t i = 0; i < 4; i++)
            k[i] = (choice >> 2 * i & 3u) << 2 | i;
        if (spread(k) <= most || !are_net(s->point, k))
            continue;
        most = spread(k);
        s->first_points = (uint16_t)(1u << k[0] | 1u << k[1] | 1u << k[2] | 1u << k[3]);
    }
    assert(most > 0);
}

static void draw_points(struct lum_area_visibility *s, const struct lum_pass *pass)
{
    for (uint32_t k = 0; k < LUM_AREA_POINTS; k++) {
        struct lum_sampler sampler = {lum_hash_combine(s->salt, pass->settings->seed), reversed4(k)};
        s->point[k] = lum_sampler_2d(&sampler, LUM_PAIRS_AREA_POINTS);
    }
    choose_first(s);
    s->placed = false;
}

bool lum_area_find_stratum_points(struct lum_area_visibility *s, const struct lum_snapshot *snapshot, uint32_t index)
{
    const struct lum_light *light = &snapshot->lights.lights[index];
    if (s->placed)
        return true;
    if (light->kind != &lum_emitter_disc && light->kind != &lum_emitter_mesh) {
        lum_free(s->place); /* it was of such a kind before */
        s->place = NULL;
        return s->placed = true;
    }
    if (!s->place && !(s->place = lum_calloc(LUM_AREA_POINTS * LUM_AREA_STRATUM_POINTS, sizeof *s->place)))
        return false;
    for (uint32_t i = 0; i < LUM_AREA_POINTS * LUM_AREA_STRATUM_POINTS; i++) {
        uint32_t in_stratum = i % LUM_AREA_STRATUM_POINTS;
        struct lum_vec2 u =
            lum_area_scramble(s->point[i / LUM_AREA_STRATUM_POINTS], in_stratum % 8 << 9, in_stratum / 8 << 9);
        if (!lum_light_place(snapshot, light, u, &s->place[i]))
            s->place[i] = (struct lum_light_place){0};
    }
    return s->placed = true;
}
_Static_assert(LUM_AREA_STRATUM_POINTS == 8 * 8, "the upper three of 12 bits of each coordinate");

void lum_area_visibility_reshade(struct lum_area_visibility *s, const struct lum_pass *pass)
{
    for (uint32_t i = 0; i < pass->cells.n; i++) /* a doubt that no pass has settled yet stays */
        if (s->begun[i] == LUM_AREA_BEGUN)
            s->begun[i] = LUM_AREA_TO_BEGIN;
    memset(s->settled, 0, pass->tiling.n * sizeof *s->settled);
    memset(s->shared, 0, lum_area_tiling(pass).n * sizeof *s->shared);
    memset(s->resolved, 0, lum_area_tiling(pass).n * sizeof *s->resolved);
    for (uint32_t i = 0; i < lum_area_tiling(pass).n; i++)
        s->unshadowed[i] = LUM_AREA_UNKNOWN;
}

static void redo(struct lum_area_visibility *s, const struct lum_pass *pass)
{
    memset(s->open, 1, lum_area_tiling(pass).n);
    lum_area_visibility_reshade(s, pass);
}

static void lay_out(struct lum_area_visibility *s, const struct lum_pass *pass)
{
    struct lum_arena *a = &s->arena;
    size_t n = (size_t)pass->tiling.w * pass->tiling.h, n_slots = (size_t)pass->tiling.n * LUM_TILE_PIXELS;
    size_t n_subsets = lum_area_tiling(pass).n, n_cells = pass->cells.n, n_tiles = pass->tiling.n;
    s->visibility = lum_arena_take(a, n, sizeof *s->visibility);
    s->history = pass->settings->reproject_shadows ? lum_arena_take(a, n, sizeof *s->history) : NULL;
    s->ratio = lum_arena_take(a, n, sizeof *s->ratio);
    s->direct = lum_arena_take(a, n_slots, sizeof *s->direct);
    s->tally = lum_arena_take(a, n_subsets, sizeof *s->tally);
    s->hashes = lum_arena_take(a, n_subsets, sizeof *s->hashes);
    s->ratio_hashes = lum_arena_take(a, n_subsets, sizeof *s->ratio_hashes);
    s->shared = lum_arena_take(a, n_subsets, sizeof *s->shared);
    s->resolved = lum_arena_take(a, n_subsets, sizeof *s->resolved);
    s->unshadowed = lum_arena_take(a, n_subsets, sizeof *s->unshadowed);
    s->first = lum_arena_take(a, n_subsets, 1);
    s->all_asked = lum_arena_take(a, n_subsets, 1);
    s->goal = lum_arena_take(a, n_subsets, 1);
    s->open = lum_arena_take(a, n_subsets, 1);
    s->begun = lum_arena_take(a, n_cells, 1);
    s->asked = lum_arena_take(a, n_cells, sizeof *s->asked);
    s->changed = lum_arena_take(a, n_cells, sizeof *s->changed);
    s->filled = lum_arena_take(a, n_cells, sizeof *s->filled);
    s->told = lum_arena_take(a, n_tiles, sizeof *s->told);
    s->settled = lum_arena_take(a, n_tiles, sizeof *s->settled);
}

bool lum_area_visibility_init(struct lum_area_visibility *ret_visibility, const struct lum_pass *pass, uint32_t salt)
{
    *ret_visibility = (struct lum_area_visibility){.salt = salt};
    lay_out(ret_visibility, pass);
    if (!lum_arena_reserve(&ret_visibility->arena)) {
        lum_area_visibility_finish(ret_visibility);
        return false;
    }
    lay_out(ret_visibility, pass);
    draw_points(ret_visibility, pass);
    redo(ret_visibility, pass);
    return true;
}

void lum_area_visibility_finish(struct lum_area_visibility *s)
{
    lum_arena_finish(&s->arena);
    lum_free(s->left);
    lum_free(s->history_left);
    lum_free(s->dimmed);
    lum_free(s->place);
    *s = (struct lum_area_visibility){0};
}

bool lum_area_visibility_fit_panes(struct lum_area_visibility *s, const struct lum_pass *pass, bool panes)
{
    size_t n = (size_t)pass->tiling.w * pass->tiling.h;
    if (panes == (s->left != NULL))
        return true;
    if (panes) {
        s->left = lum_calloc(n, sizeof *s->left);
        s->dimmed = lum_calloc(lum_area_tiling(pass).n, 1);
        s->history_left = s->history ? lum_calloc(n, sizeof *s->history_left) : NULL;
        if (s->left && s->dimmed && (s->history_left || !s->history))
            return true;
    }
    lum_free(s->left);
    lum_free(s->history_left);
    lum_free(s->dimmed);
    s->left = s->history_left = NULL;
    s->dimmed = NULL;
    return !panes;
}

/* Nothing is known of what panes leave. */
static void clear_left(uint32_t *left, const struct lum_pass *pass)
{
    if (left)
        memset(left, 0, (size_t)pass->tiling.w * pass->tiling.h * sizeof *left);
}

void lum_area_visibility_forget(struct lum_area_visibility *s, const struct lum_pass *pass)
{
    draw_points(s, pass); /* the seed may be another */
    size_t bytes = (size_t)pass->tiling.w * pass->tiling.h * sizeof *s->visibility;
    memset(s->visibility, 0, bytes);
    memset(s->all_asked, 0, lum_area_tiling(pass).n);
    if (s->history)
        memset(s->history, 0, bytes);
    clear_left(s->left, pass);
    clear_left(s->history_left, pass);
    redo(s, pass);
}

void lum_area_visibility_to_history(struct lum_area_visibility *s, const struct lum_pass *pass)
{
    struct lum_visibility *visibility = s->visibility;
    uint32_t *left = s->left;
    s->visibility = s->history;
    s->history = visibility;
    s->left = s->history_left;
    s->history_left = left;
    clear_left(s->left, pass);
    memset(s->visibility, 0, (size_t)pass->tiling.w * pass->tiling.h * sizeof *s->visibility);
    memset(s->all_asked, 0, lum_area_tiling(pass).n);
    redo(s, pass);
}

_Static_assert(LUM_MOTION_BLOCK_SIDE == LUM_AREA_SIDE, "motion is found by tiles of the pattern");
_Static_assert(LUM_TILE_SIDE % LUM_AREA_SIDE == 0 && LUM_CELL_SIDE % LUM_AREA_SIDE == 0, "which lie within others");

/* Forgets tile (x, y) of the pattern; and what those around made of it, unless its surfaces are what they were: then
 * that holds as long as who sees the light turns out the same. */
static void forget_subset(struct lum_area_visibility *s, const struct lum_pass *pass, uint32_t x, uint32_t y)
{
    const struct lum_tiling *subsets = &pass->motion_mask->blocks;
    struct lum_tile_rect r = lum_tile_at(subsets, y * subsets->nx + x);
    for (uint32_t j = r.y; j < r.y + r.h; j++) {
        memset(s->visibility + (size_t)j * pass->tiling.w + r.x, 0, r.w * sizeof *s->visibility);
        if (s->left)
            memset(s->left + (size_t)j * pass->tiling.w + r.x, 0, r.w * sizeof *s->left);
    }
    s->open[y * subsets->nx + x] = 1;
    uint8_t *begun = &s->begun[r.y / LUM_CELL_SIDE * pass->cells.nx + r.x / LUM_CELL_SIDE];
    if (*begun == LUM_AREA_BEGUN)
        *begun = LUM_AREA_TO_BEGIN;
    if (!pass->motion_mask->changed[y * subsets->nx + x])
        return;
    s->unshadowed[y * subsets->nx + x] = LUM_AREA_UNKNOWN;
    for (uint32_t j = y > 0 ? y - 1 : 0; j <= y + 1 && j < subsets->ny; j++)
        for (uint32_t i = x > 0 ? x - 1 : 0; i <= x + 1 && i < subsets->nx; i++)
            s->shared[j * subsets->nx + i] = s->resolved[j * subsets->nx + i] = 0;
}

uint32_t lum_area_visibility_follow_motion(struct lum_area_visibility *s, const struct lum_pass *pass,
                                           const struct lum_bounds *bounds, uint8_t *inout_whole)
{
    const struct lum_motion_mask *motion_mask = pass->motion_mask;
    uint32_t n = 0;
    for (uint32_t i = 0; i < motion_mask->blocks.n; i++) {
        const struct lum_bounds *visibility = &motion_mask->seen[i];
        bool lit = visibility->lo.x <= visibility->hi.x;
        if (!motion_mask->changed[i] && !(lit && lum_motion_meets_between(&motion_mask->motion, visibility, bounds)))
            continue;
        uint32_t x = i % motion_mask->blocks.nx, y = i / motion_mask->blocks.nx;
        forget_subset(s, pass, x, y);
        inout_whole[y * LUM_MOTION_BLOCK_SIDE / LUM_TILE_SIDE * pass->tiling.nx +
                    x * LUM_MOTION_BLOCK_SIDE / LUM_TILE_SIDE] = 0;
        n++;
    }
    return n;
}

void lum_area_visibility_reconsider(struct lum_area_visibility *s, const struct lum_pass *pass)
{
    if (s->history) /* what it says of surfaces is in doubt, too */
        memset(s->history, 0, (size_t)pass->tiling.w * pass->tiling.h * sizeof *s->history);
    redo(s, pass);
    memset(s->begun, LUM_AREA_DOUBTED, pass->cells.n);
}

size_t lum_area_visibility_bytes(void)
{
    return 2 * sizeof(struct lum_visibility) + sizeof(struct lum_rgb) + sizeof(float) + 3;
}

uint32_t lum_area_around(const struct lum_area_visibility *s, const struct lum_tiling *subsets, uint32_t x, uint32_t y)
{
    uint32_t bits = 0;
    for (uint32_t j = y > 0 ? y - 1 : 0; j <= y + 1 && j < subsets->ny; j++)
        for (uint32_t i = x > 0 ? x - 1 : 0; i <= x + 1 && i < subsets->nx; i++) {
            struct lum_visibility_tally t = s->tally[j * subsets->nx + i];
            bits |= (t.visible > 0 ? LUM_AREA_LIT : 0) | (t.visible < t.traced ? LUM_AREA_DARK : 0);
        }
    return bits;
}
