#include "core/effect/direct/soft.h"

#include <assert.h>
#include <string.h>

#include "core/interleave/interleave.h"
#include "core/math/sampler.h"

#define PAIR_SOFT 0x40000000u

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
        lum_pattern_place(LUM_SOFT_SIDE, k[i], &x, &y);
        columns |= 1u << x;
        rows |= 1u << y;
    }
    return (uint32_t)(__builtin_popcount(columns) + __builtin_popcount(rows));
}

/* Four points, one of each 2 x 2 block of the pattern (numbers of a block agree in their lower two bits): of all such
 * choices the net whose pixels are spread best. There is one: of Sobol's points in blocks of four in a row, take of
 * block a = a0 + 2 a1 the one at (a0 + a1 mod 2) + 2 a0; and scrambling leaves a net a net. */
static void choose_first(struct lum_soft *s)
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

static void draw_points(struct lum_soft *s, const struct lum_pass *pass)
{
    for (uint32_t k = 0; k < LUM_SOFT_POINTS; k++) {
        struct lum_sampler sampler = {lum_hash_combine(s->salt, pass->settings->seed), reversed4(k)};
        s->point[k] = lum_sampler_2d(&sampler, PAIR_SOFT);
    }
    choose_first(s);
    s->placed = false;
}

bool lum_soft_find_places(struct lum_soft *s, const struct lum_snapshot *snapshot, uint32_t index)
{
    const struct lum_light *light = &snapshot->lights.lights[index];
    if (s->placed)
        return true;
    if (light->kind != LUM_EMIT_DISC && light->kind != LUM_EMIT_MESH) {
        lum_free(s->place); /* it was of such a kind before */
        s->place = NULL;
        return s->placed = true;
    }
    if (!s->place && !(s->place = lum_calloc(LUM_SOFT_POINTS * LUM_SOFT_PLACES, sizeof *s->place)))
        return false;
    for (uint32_t i = 0; i < LUM_SOFT_POINTS * LUM_SOFT_PLACES; i++) {
        uint32_t in_stratum = i % LUM_SOFT_PLACES;
        struct lum_vec2 u = lum_soft_scramble(s->point[i / LUM_SOFT_PLACES], in_stratum % 8 << 9, in_stratum / 8 << 9);
        if (!lum_light_place(snapshot, light, u, &s->place[i]))
            s->place[i] = (struct lum_light_place){0};
    }
    return s->placed = true;
}
_Static_assert(LUM_SOFT_PLACES == 8 * 8, "the upper three of 12 bits of each coordinate");

static void redo(struct lum_soft *s, const struct lum_pass *pass)
{
    memset(s->open, 1, lum_soft_tiling(pass).n);
    memset(s->begun, 0, pass->packets.n);
    memset(s->settled, 0, pass->tiling.n * sizeof *s->settled);
    memset(s->shared, 0, lum_soft_tiling(pass).n * sizeof *s->shared);
    memset(s->resolved, 0, lum_soft_tiling(pass).n * sizeof *s->resolved);
    for (uint32_t i = 0; i < lum_soft_tiling(pass).n; i++)
        s->unshadowed[i] = LUM_SOFT_UNKNOWN;
}

bool lum_soft_init(struct lum_soft *ret_soft, const struct lum_pass *pass, uint32_t salt)
{
    size_t n = (size_t)pass->tiling.w * pass->tiling.h, n_slots = (size_t)pass->tiling.n * LUM_TILE_PIXELS;
    size_t n_sets = lum_soft_tiling(pass).n;
    struct lum_soft s = {
        .salt = salt,
        .seen = lum_calloc(n, sizeof *s.seen),
        .former = pass->settings->carry_shadows ? lum_calloc(n, sizeof *s.former) : NULL,
        .direct = lum_calloc(n_slots, sizeof *s.direct),
        .tally = lum_calloc(n_sets, sizeof *s.tally),
        .prints = lum_calloc(n_sets, sizeof *s.prints),
        .unshadowed = lum_calloc(n_sets, sizeof *s.unshadowed),
        .first = lum_calloc(n_sets, 1),
        .all_asked = lum_calloc(n_sets, 1),
        .goal = lum_calloc(n_sets, 1),
        .open = lum_calloc(n_sets, 1),
        .begun = lum_calloc(pass->packets.n, 1),
        .asked = lum_calloc(pass->packets.n, sizeof *s.asked),
        .changed = lum_calloc(pass->packets.n, sizeof *s.changed),
        .filled = lum_calloc(pass->packets.n, sizeof *s.filled),
        .told = lum_calloc(pass->tiling.n, sizeof *s.told),
        .settled = lum_calloc(pass->tiling.n, sizeof *s.settled),
        .share = lum_calloc(n, sizeof *s.share),
        .share_prints = lum_calloc(n_sets, sizeof *s.share_prints),
        .shared = lum_calloc(n_sets, sizeof *s.shared),
        .resolved = lum_calloc(n_sets, sizeof *s.resolved),
    };
    draw_points(&s, pass);
    *ret_soft = s;
    if (s.seen && (s.former || !pass->settings->carry_shadows) && s.direct && s.tally && s.prints && s.unshadowed &&
        s.first && s.all_asked && s.goal && s.open && s.begun && s.asked && s.changed && s.filled && s.told &&
        s.settled && s.share && s.share_prints && s.shared && s.resolved) {
        redo(ret_soft, pass);
        return true;
    }
    lum_soft_finish(ret_soft);
    return false;
}

void lum_soft_finish(struct lum_soft *s)
{
    lum_free(s->seen);
    lum_free(s->former);
    lum_free(s->left);
    lum_free(s->former_left);
    lum_free(s->dimmed);
    lum_free(s->place);
    lum_free(s->direct);
    lum_free(s->tally);
    lum_free(s->prints);
    lum_free(s->unshadowed);
    lum_free(s->first);
    lum_free(s->all_asked);
    lum_free(s->goal);
    lum_free(s->open);
    lum_free(s->begun);
    lum_free(s->asked);
    lum_free(s->changed);
    lum_free(s->filled);
    lum_free(s->told);
    lum_free(s->settled);
    lum_free(s->share);
    lum_free(s->share_prints);
    lum_free(s->shared);
    lum_free(s->resolved);
    *s = (struct lum_soft){0};
}

bool lum_soft_fit_panes(struct lum_soft *s, const struct lum_pass *pass, bool panes)
{
    size_t n = (size_t)pass->tiling.w * pass->tiling.h;
    if (panes == (s->left != NULL))
        return true;
    if (panes) {
        s->left = lum_calloc(n, sizeof *s->left);
        s->dimmed = lum_calloc(lum_soft_tiling(pass).n, 1);
        s->former_left = s->former ? lum_calloc(n, sizeof *s->former_left) : NULL;
        if (s->left && s->dimmed && (s->former_left || !s->former))
            return true;
    }
    lum_free(s->left);
    lum_free(s->former_left);
    lum_free(s->dimmed);
    s->left = s->former_left = NULL;
    s->dimmed = NULL;
    return !panes;
}

/* Nothing is known of what panes leave. */
static void clear_left(uint32_t *left, const struct lum_pass *pass)
{
    if (left)
        memset(left, 0, (size_t)pass->tiling.w * pass->tiling.h * sizeof *left);
}

void lum_soft_forget(struct lum_soft *s, const struct lum_pass *pass)
{
    draw_points(s, pass); /* the seed may be another */
    size_t bytes = (size_t)pass->tiling.w * pass->tiling.h * sizeof *s->seen;
    memset(s->seen, 0, bytes);
    memset(s->all_asked, 0, lum_soft_tiling(pass).n);
    if (s->former)
        memset(s->former, 0, bytes);
    clear_left(s->left, pass);
    clear_left(s->former_left, pass);
    redo(s, pass);
}

void lum_soft_step_back(struct lum_soft *s, const struct lum_pass *pass)
{
    struct lum_seen *seen = s->seen;
    uint32_t *left = s->left;
    s->seen = s->former;
    s->former = seen;
    s->left = s->former_left;
    s->former_left = left;
    clear_left(s->left, pass);
    memset(s->seen, 0, (size_t)pass->tiling.w * pass->tiling.h * sizeof *s->seen);
    memset(s->all_asked, 0, lum_soft_tiling(pass).n);
    redo(s, pass);
}

_Static_assert(LUM_SWEPT_SIDE == LUM_SOFT_SIDE, "motion is found by tiles of the pattern");
_Static_assert(LUM_TILE_SIDE % LUM_SOFT_SIDE == 0 && LUM_PACKET_SIDE % LUM_SOFT_SIDE == 0, "which lie within others");

/* Forgets tile (x, y) of the pattern; and what those around made of it, unless its surfaces are what they were: then
 * that holds as long as who sees the light turns out the same. */
static void forget_set(struct lum_soft *s, const struct lum_pass *pass, uint32_t x, uint32_t y)
{
    const struct lum_tiling *sets = &pass->swept->squares;
    struct lum_tile_rect r = lum_tile_at(sets, y * sets->nx + x);
    for (uint32_t j = r.y; j < r.y + r.h; j++) {
        memset(s->seen + (size_t)j * pass->tiling.w + r.x, 0, r.w * sizeof *s->seen);
        if (s->left)
            memset(s->left + (size_t)j * pass->tiling.w + r.x, 0, r.w * sizeof *s->left);
    }
    s->open[y * sets->nx + x] = 1;
    uint8_t *begun = &s->begun[r.y / LUM_PACKET_SIDE * pass->packets.nx + r.x / LUM_PACKET_SIDE];
    if (*begun == LUM_SOFT_BEGUN)
        *begun = LUM_SOFT_TO_BEGIN;
    if (!pass->swept->changed[y * sets->nx + x])
        return;
    s->unshadowed[y * sets->nx + x] = LUM_SOFT_UNKNOWN;
    for (uint32_t j = y > 0 ? y - 1 : 0; j <= y + 1 && j < sets->ny; j++)
        for (uint32_t i = x > 0 ? x - 1 : 0; i <= x + 1 && i < sets->nx; i++)
            s->shared[j * sets->nx + i] = s->resolved[j * sets->nx + i] = 0;
}

uint32_t lum_soft_follow_motion(struct lum_soft *s, const struct lum_pass *pass, const struct lum_bounds *bounds)
{
    const struct lum_swept *swept = pass->swept;
    uint32_t n = 0;
    for (uint32_t i = 0; i < swept->squares.n; i++) {
        const struct lum_bounds *seen = &swept->seen[i];
        bool lit = seen->lo.x <= seen->hi.x;
        if (!swept->changed[i] && !(lit && lum_motion_meets_between(&swept->motion, seen, bounds)))
            continue;
        forget_set(s, pass, i % swept->squares.nx, i / swept->squares.nx);
        n++;
    }
    return n;
}

void lum_soft_reconsider(struct lum_soft *s, const struct lum_pass *pass)
{
    if (s->former) /* what it says of surfaces is in doubt, too */
        memset(s->former, 0, (size_t)pass->tiling.w * pass->tiling.h * sizeof *s->former);
    redo(s, pass);
    memset(s->begun, LUM_SOFT_DOUBTED, pass->packets.n);
}

size_t lum_soft_bytes(void)
{
    return 2 * sizeof(struct lum_seen) + sizeof(struct lum_rgb) + sizeof(float) + 3;
}

uint32_t lum_soft_around(const struct lum_soft *s, const struct lum_tiling *sets, uint32_t x, uint32_t y)
{
    uint32_t bits = 0;
    for (uint32_t j = y > 0 ? y - 1 : 0; j <= y + 1 && j < sets->ny; j++)
        for (uint32_t i = x > 0 ? x - 1 : 0; i <= x + 1 && i < sets->nx; i++) {
            struct lum_soft_tally t = s->tally[j * sets->nx + i];
            bits |= (t.visible > 0 ? LUM_SOFT_LIT : 0) | (t.visible < t.traced ? LUM_SOFT_DARK : 0);
        }
    return bits;
}
