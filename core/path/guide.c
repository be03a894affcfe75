#include "core/path/guide.h"

#include <string.h>

#include "core/base/team.h"

#define FACES 6u   /* which way a surface looks, by the largest component of its normal: a tree for each */
#define BLOCK 128u /* cells that are allocated together */

/* An outlier must not own a cell: what is heard at once counts at most LOUDEST / PARTS means, in integers of 1 / PARTS:
 * four million of the loudest fit. */
#define PARTS 64.0f
#define LOUDEST (16.0f * PARTS)

#define FEW 16.0f     /* heard less often than this, a cell does not guide; and up to a few times as often, less */
#define ENOUGH 500.0f /* more often: it is halved */
#define AT_FIRST 300u /* notes that the first sample to learn from brings each cell, on average */
#define SHARE 0.5f    /* each direction is still sampled half as often as without: no weight more than doubles */

/* The first samples are a trial, in one of TRIAL tiles: where nothing comes of it, little was spent. Samples after
 * ALL_LEARN are learned from in one of LATER tiles, those after LEARN_ENDS in none: more would hardly change what is
 * known. */
#define TRIAL_ENDS 3u
#define TRIAL 4u
#define ALL_LEARN 8u
#define LATER 4u
#define LEARN_ENDS 96u

/* Variance without guiding over that with it, from which on it is kept: guided samples take 1.05 times as long as
 * others (crytek_sponza) to 1.5 times and more (in a box of a few triangles, where a path is little work). */
#define PAYS 1.45
#define PAYS_AFTER_TRIAL 1.4 /* with more to go by it will be more */

/* What was heard in a cell. */
struct memory {
    float sum[LUM_PATH_GUIDE_BINS];                       /* up to the last lum_path_guide_begin, */
    _Atomic uint32_t heard[LUM_PATH_GUIDE_BINS], n_heard; /* and since */
    float n;                                              /* how often, up to then */
    float unit;                                           /* mean: of this the integers are parts */
    struct lum_bounds box;
};
struct block {
    struct lum_path_guide_cell cell[BLOCK];
    struct memory memory[BLOCK];
};
#define MAX_BLOCKS (LUM_PATH_GUIDE_BYTES / sizeof(struct block))

struct node {
    float split;
    uint32_t axis : 2;   /* 3: a leaf */
    uint32_t child : 30; /* of a leaf: its cell; else the lower of two nodes */
};

struct lum_path_guide {
    struct block *block[MAX_BLOCKS];
    struct node *nodes; /* the first FACES are roots */
    uint32_t n_blocks, n_cells, n_nodes;
    uint32_t sample; /* that the pass takes */
    bool usable;
    bool short_of_memory;          /* there would be more cells */
    float typical;                 /* luminance of a pixel */
    _Atomic int64_t spread, saved; /* since densities were made: variance of pixels, and what more it would have been */
};

struct lum_path_guide *lum_path_guide_create(void)
{
    return lum_calloc(1, sizeof(struct lum_path_guide));
}

/* Nothing guides any more, and nothing is kept. */
static void drop(struct lum_path_guide *g)
{
    for (uint32_t i = 0; i < g->n_blocks; i++)
        lum_free(g->block[i]);
    lum_free(g->nodes);
    g->nodes = NULL;
    g->n_blocks = g->n_cells = g->n_nodes = 0;
    g->usable = g->short_of_memory = false;
}

void lum_path_guide_destroy(struct lum_path_guide *g)
{
    if (!g)
        return;
    drop(g);
    lum_free(g);
}

/* ---- cells ---- */

static struct lum_path_guide_cell *cell_at(const struct lum_path_guide *g, uint32_t i)
{
    return &g->block[i / BLOCK]->cell[i % BLOCK];
}

static struct memory *memory_at(const struct lum_path_guide *g, uint32_t i)
{
    return &g->block[i / BLOCK]->memory[i % BLOCK];
}

static uint32_t longest(struct lum_vec3 v)
{
    float x = fabsf(v.x), y = fabsf(v.y), z = fabsf(v.z);
    return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

struct lum_path_guide_locate lum_path_guide_find(const struct lum_path_guide *g, struct lum_vec3 p,
                                                 const struct lum_bsdf *b)
{
    uint32_t axis = longest(b->frame.n);
    const struct node *node = &g->nodes[2 * axis + (lum_v3_part(b->frame.n, axis) < 0.0f)];
    const float at[3] = {p.x, p.y, p.z};
    while (node->axis < 3)
        node = &g->nodes[node->child + !(at[node->axis] < node->split)];
    const struct lum_path_guide_cell *cell = cell_at(g, node->child);
    return (struct lum_path_guide_locate){cell, node->child, cell->share * b->diffuse_prob};
}

/* Room for one more cell. */
static bool reserve(struct lum_path_guide *g)
{
    if (g->n_cells < g->n_blocks * BLOCK)
        return true;
    if (g->n_blocks == MAX_BLOCKS)
        return false;
    g->block[g->n_blocks] = lum_calloc(1, sizeof(struct block));
    g->short_of_memory = !g->block[g->n_blocks];
    g->n_blocks += !g->short_of_memory;
    return !g->short_of_memory;
}

/* Halves a leaf's cell across the longest side of its box; each half starts with half of what was heard. */
static bool halve(struct lum_path_guide *g, uint32_t leaf)
{
    if (!reserve(g))
        return false;
    struct memory *lower = memory_at(g, g->nodes[leaf].child), *upper = memory_at(g, g->n_cells);
    lower->n *= 0.5f;
    for (uint32_t b = 0; b < LUM_PATH_GUIDE_BINS; b++)
        lower->sum[b] *= 0.5f;
    *upper = *lower; /* nothing is heard meanwhile */
    uint32_t axis = longest(lum_v3_sub(lower->box.hi, lower->box.lo));
    float split = 0.5f * (lum_v3_part(lower->box.lo, axis) + lum_v3_part(lower->box.hi, axis));
    float *hi[3] = {&lower->box.hi.x, &lower->box.hi.y, &lower->box.hi.z};
    float *lo[3] = {&upper->box.lo.x, &upper->box.lo.y, &upper->box.lo.z};
    *hi[axis] = *lo[axis] = split;
    cell_at(g, g->n_cells)->share = 0.0f;
    g->nodes[g->n_nodes] = (struct node){.axis = 3, .child = g->nodes[leaf].child};
    g->nodes[g->n_nodes + 1] = (struct node){.axis = 3, .child = g->n_cells++};
    g->nodes[leaf] = (struct node){split, axis, g->n_nodes};
    g->n_nodes += 2;
    return true;
}

/* Roots, cut evenly into as many cells as the picture's size allows, but for most of the memory, which is for places
 * where more is heard. */
static bool start(struct lum_path_guide *g, const struct lum_guided_pass *pass)
{
    g->nodes = lum_calloc(2 * MAX_BLOCKS * BLOCK + FACES, sizeof *g->nodes);
    g->short_of_memory = !g->nodes;
    if (!g->nodes)
        return false;
    for (; g->n_nodes < FACES; g->n_nodes++) {
        if (!reserve(g))
            return false;
        struct memory *m = memory_at(g, g->n_cells);
        m->unit = g->typical * LUM_PI;
        m->box = (struct lum_bounds){pass->snapshot->bounds_lo, pass->snapshot->bounds_hi};
        g->nodes[g->n_nodes] = (struct node){.axis = 3, .child = g->n_cells++};
    }
    uint64_t notes = (uint64_t)pass->film->w * pass->film->h * LUM_PATH_GUIDE_NOTES / TRIAL;
    for (uint32_t i = 0; (uint64_t)g->n_cells * AT_FIRST < notes && g->n_cells < MAX_BLOCKS * BLOCK / 4; i++)
        if (!halve(g, i))
            break;
    return true;
}

/* ---- a team ---- */

/* All get what all have heard. */
static void join_heard(struct lum_path_guide *g, struct lum_team *team)
{
    const size_t n = LUM_PATH_GUIDE_BINS + 1;
    uint32_t *numbers = lum_team_room(team, LUM_TEAM_ALL, g->n_cells * n * sizeof *numbers);
    for (uint32_t i = 0; i < g->n_cells; i++) {
        struct memory *m = memory_at(g, i);
        for (uint32_t b = 0; b < LUM_PATH_GUIDE_BINS; b++)
            numbers[i * n + b] = atomic_load_explicit(&m->heard[b], memory_order_relaxed);
        numbers[i * n + LUM_PATH_GUIDE_BINS] = atomic_load_explicit(&m->n_heard, memory_order_relaxed);
    }
    lum_team_sum(team, numbers, g->n_cells * n);
    for (uint32_t i = 0; i < g->n_cells; i++) {
        struct memory *m = memory_at(g, i);
        for (uint32_t b = 0; b < LUM_PATH_GUIDE_BINS; b++)
            atomic_store_explicit(&m->heard[b], numbers[i * n + b], memory_order_relaxed);
        atomic_store_explicit(&m->n_heard, numbers[i * n + LUM_PATH_GUIDE_BINS], memory_order_relaxed);
    }
}

/* Likewise of what was saved. */
static void join_savings(struct lum_team *team, int64_t *inout_spread, int64_t *inout_saved)
{
    int64_t mine[2] = {*inout_spread, *inout_saved};
    int64_t(*all)[2] = lum_team_room(team, LUM_TEAM_ACCOUNTS, team->size * sizeof *all);
    lum_team_gather(team, mine, sizeof mine, all);
    *inout_spread = *inout_saved = 0;
    for (uint32_t r = 0; r < team->size; r++) {
        *inout_spread += all[r][0];
        *inout_saved += all[r][1];
    }
}

/* ---- from what was heard to densities ---- */

/* Half of a bin, and half of the square of four that it is in: what few have told is uncertain. */
static double smooth(const float *sum, uint32_t bin)
{
    const float *q = sum + (bin & ~(LUM_PATH_GUIDE_SIDE | 1u));
    return 0.5 * (double)sum[bin] + 0.125 * (double)(q[0] + q[1] + q[LUM_PATH_GUIDE_SIDE] + q[LUM_PATH_GUIDE_SIDE + 1]);
}

static void hear(void *ctx, uint32_t i, uint32_t worker)
{
    (void)worker;
    struct memory *m = memory_at(ctx, i);
    uint32_t n = atomic_load_explicit(&m->n_heard, memory_order_relaxed); /* nobody else writes meanwhile */
    atomic_store_explicit(&m->n_heard, 0, memory_order_relaxed);
    double all = 0.0;
    for (uint32_t b = 0; n > 0 && b < LUM_PATH_GUIDE_BINS; b++) {
        uint32_t parts = atomic_load_explicit(&m->heard[b], memory_order_relaxed);
        atomic_store_explicit(&m->heard[b], 0, memory_order_relaxed);
        m->sum[b] += (float)parts * (m->unit / PARTS);
        all += (double)m->sum[b];
    }
    m->n += (float)n;
    if (all > 0.0)
        m->unit = (float)(all / (double)m->n);
}

static void make_density(void *ctx, uint32_t i, uint32_t worker)
{
    (void)worker;
    const struct memory *m = memory_at(ctx, i);
    struct lum_path_guide_cell *c = cell_at(ctx, i);
    double all = 0.0, below = 0.0;
    for (uint32_t b = 0; b < LUM_PATH_GUIDE_BINS; b++)
        all += smooth(m->sum, b);
    c->share = m->n >= FEW && all > 0.0 ? SHARE * m->n / (m->n + FEW) : 0.0f;
    for (uint32_t b = 0; c->share > 0.0f && b < LUM_PATH_GUIDE_BINS; b++) {
        below += smooth(m->sum, b);
        c->bins[b] = (uint16_t)lum_min((float)(below / all) * LUM_PATH_GUIDE_WHOLE + 0.5f, LUM_PATH_GUIDE_WHOLE);
        c->rows[b / LUM_PATH_GUIDE_SIDE] = c->bins[b];
    }
}

static void make_densities(struct lum_path_guide *g, struct lum_pool *pool)
{
    lum_pool_run(pool, g->n_cells, hear, g, NULL);
    for (uint32_t i = 0; i < g->n_nodes; i++) /* also those that are added on the way */
        if (g->nodes[i].axis == 3 && memory_at(g, g->nodes[i].child)->n > ENOUGH && !halve(g, i))
            break;
    lum_pool_run(pool, g->n_cells, make_density, g, NULL);
}

/* Geometric mean of the luminance of pixels that are not black; 0: all are. */
static float typical(const struct lum_film *film)
{
    double sum = 0.0;
    uint64_t n = 0;
    for (uint32_t y = 0; y < film->h; y++)
        for (uint32_t x = 0; x < film->w; x++) {
            float luminance = lum_luminance(lum_film_mean(film, x, y));
            if (luminance > 0.0f) {
                sum += log((double)luminance);
                n++;
            }
        }
    return n > 0 ? (float)exp(sum / (double)n) : 0.0f;
}

/* Densities are made before samples 2, 3, 4, 6, 8, 12, 16, 24 ... as long as anything is learned. */
static bool is_due(uint32_t sample)
{
    if (sample > LEARN_ENDS)
        return false;
    while (sample > 3 && sample % 2 == 0)
        sample /= 2;
    return sample == 2 || sample == 3;
}

static bool pays(struct lum_path_guide *g, uint32_t sample, struct lum_team *team)
{
    int64_t spread = atomic_exchange_explicit(&g->spread, 0, memory_order_relaxed);
    int64_t saved = atomic_exchange_explicit(&g->saved, 0, memory_order_relaxed);
    if (team)
        join_savings(team, &spread, &saved);
    return sample < TRIAL_ENDS ||
           (double)(spread + saved) >= (sample == TRIAL_ENDS ? PAYS_AFTER_TRIAL : PAYS) * (double)spread;
}

/* One alone does with what it has; with a team all have to guide by the same cells. */
static void need_memory(const struct lum_path_guide *g, struct lum_team *team)
{
    if (team && g->short_of_memory)
        team->kind->give_up(team, "out of memory for what guides paths");
}

bool lum_path_guide_begin(struct lum_path_guide *g, const struct lum_guided_pass *pass, struct lum_pool *pool)
{
    uint32_t sample = pass->sample;
    if (sample <= 1 && sample != g->sample)
        drop(g); /* it is a new picture */
    if (sample == 1 && sample != g->sample) {
        g->typical = typical(pass->film);
        g->usable = pass->allowed && g->typical > 0.0f && isfinite(g->typical * LUM_PI) && start(g, pass);
        need_memory(g, pass->team);
        if (!g->usable)
            drop(g);
        atomic_store(&g->spread, 0);
        atomic_store(&g->saved, 0);
    } else if (sample != g->sample && g->usable && is_due(sample)) {
        bool kept = pays(g, sample, pass->team);
        if (kept && pass->team)
            join_heard(g, pass->team);
        if (kept)
            make_densities(g, pool);
        else
            drop(g);
        need_memory(g, pass->team);
    }
    g->sample = sample;
    return g->usable;
}

/* ---- learning ---- */

bool lum_path_guide_serves(const struct lum_path_guide *g, uint32_t column, uint32_t row)
{
    return g->sample >= TRIAL_ENDS || (column + 2 * row) % TRIAL == 0;
}

bool lum_path_guide_learns(const struct lum_path_guide *g, uint32_t tile)
{
    return g->sample < ALL_LEARN || (g->sample < LEARN_ENDS && (tile + g->sample) % LATER == 0);
}

static void tell(struct lum_path_guide *g, const struct lum_path_guide_note *note, float luminance)
{
    struct memory *m = memory_at(g, note->cell);
    float value = (luminance - note->before) * note->scale * (PARTS / m->unit);
    if (!(note->before >= 0.0f && value >= 0.5f))
        return;
    uint32_t parts = (uint32_t)(lum_min(value, LOUDEST) + 0.5f);
    atomic_fetch_add_explicit(&m->heard[note->bin], parts, memory_order_relaxed);
    atomic_fetch_add_explicit(&m->n_heard, 1, memory_order_relaxed);
}

/* Adds squares relative to that of the pixel's brightness so far, those of outliers in part: of how far a sample is
 * from that, and of what it would have been more without guiding. With density p instead of q a contribution x, sampled
 * with q, has the second moment x^2 q / p. What shines at the end of the segment is left out: its weight would be
 * another. */
static void judge(const struct lum_path_guide *g, const struct lum_path_guide_notes *notes, uint32_t slot, float mean,
                  float luminance, int64_t *inout_spread, int64_t *inout_saved)
{
    const struct lum_path_guide_note *first = notes->note[slot];
    if (notes->n[slot] == 0 || !(first->before >= 0.0f) || !(first->pdf_ratio < 1.0f || first->pdf_ratio > 1.0f))
        return; /* it was not guided */
    float m2 = mean * mean + 0.0625f * g->typical * g->typical, spread = (luminance - mean) * (luminance - mean) / m2;
    float part = 4096.0f * (spread > 4.0f ? 4.0f / spread : 1.0f);
    float x = lum_max(luminance - first->before - notes->emitted[slot], 0.0f);
    float saved = x * x / m2 * (first->pdf_ratio - 1.0f);
    if (!isfinite(saved * part))
        return;
    *inout_spread += (int64_t)lum_clamp(spread * part, 0.0f, 0x1p20f);
    *inout_saved += (int64_t)lum_clamp(saved * part, -0x1p20f, 0x1p20f);
}

void lum_path_guide_learn(struct lum_path_guide *g, uint32_t n_slots, const struct lum_path_guide_notes *notes,
                          const float *means, const struct lum_rgb *radiance)
{
    int64_t spread = 0, saved = 0;
    for (uint32_t slot = 0; slot < n_slots; slot++) {
        float luminance = lum_luminance(radiance[slot]);
        judge(g, notes, slot, means[slot], luminance, &spread, &saved);
        for (uint32_t k = 0; k < notes->n[slot]; k++)
            tell(g, &notes->note[slot][k], luminance);
    }
    atomic_fetch_add_explicit(&g->spread, spread, memory_order_relaxed);
    atomic_fetch_add_explicit(&g->saved, saved, memory_order_relaxed);
}
