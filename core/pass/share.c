/* Loops whose jobs a team shares. */
#include <string.h>

#include "core/pass/share.h"

/* What a member says after a loop, before what its jobs left. */
struct account {
    uint64_t n_jobs, bytes;   /* of the loop: all must say the same */
    uint64_t n_done, n_words; /* by this one, that it left; and counted by it: */
    uint64_t rays[LUM_RAY_KIND_COUNT], tiles[LUM_EFFECT_COUNT];
    int64_t ns[LUM_EFFECT_COUNT];
    uint64_t nonfinite, bad_rays;
    double culled_bound;
};

/* What a job left, in whole words. They lie one after the other, in the order in which they were done. */
struct part {
    uint32_t job, n_words; /* n_words: with this line */
    unsigned char left[];
};
#define WORD sizeof(struct part)

struct sharing {
    const struct lum_stage_runner *runner;
    const struct lum_shared_loop *loop;
    unsigned char *parts;
    uint32_t words_each; /* while they are made: what is between two of them */
    _Atomic uint32_t n_done;
    /* of all: */
    uint32_t *at; /* by number of a part, its first word */
    uint32_t first_mine, n_mine;
};

static struct part *part_at(const struct sharing *s, uint32_t word)
{
    return (struct part *)(void *)(s->parts + word * WORD);
}

/* Of both signs: what was counted until now is taken off, what was counted since remains. */
static void add_counters(const struct lum_stage_runner *runner, bool off, struct account *a)
{
    const uint64_t sign = off ? UINT64_MAX : 1; /* modulo 2^64 that is -1 */
    for (uint32_t w = 0; w < lum_pool_size(runner->pool); w++) {
        const struct lum_counters *c = &runner->counters[w];
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
            a->rays[k] += sign * c->rays[k];
        for (int e = 0; e < LUM_EFFECT_COUNT; e++) {
            a->tiles[e] += sign * c->tiles[e];
            a->ns[e] += off ? -c->ns[e] : c->ns[e];
        }
        a->nonfinite += sign * c->nonfinite;
        a->bad_rays += sign * c->bad_rays;
        a->culled_bound = fmax(a->culled_bound, c->culled_bound);
    }
}

static void count_also(struct lum_counters *c, const struct account *a)
{
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        c->rays[k] += a->rays[k];
    for (int e = 0; e < LUM_EFFECT_COUNT; e++) {
        c->tiles[e] += a->tiles[e];
        c->ns[e] += a->ns[e];
    }
    c->nonfinite += a->nonfinite;
    c->bad_rays += a->bad_rays;
    c->culled_bound = fmax(c->culled_bound, a->culled_bound);
}

/* ---- making ---- */

static void make_alone(void *ctx, uint32_t job, struct lum_counters *counters)
{
    const struct lum_shared_loop *loop = ctx;
    (void)loop->make(loop->ctx, job, NULL, counters);
}

static void make_part(void *ctx, uint32_t job, struct lum_counters *counters)
{
    struct sharing *s = ctx;
    uint32_t i = atomic_fetch_add_explicit(&s->n_done, 1u, memory_order_relaxed);
    struct part *p = part_at(s, i * s->words_each);
    size_t bytes = s->loop->make(s->loop->ctx, job, p->left, counters);
    *p = (struct part){job, 1 + (uint32_t)((bytes + WORD - 1) / WORD)};
}

/* Moves them together. Returns their words. */
static uint32_t close_up(const struct sharing *s, uint32_t n_done)
{
    uint32_t end = 0;
    for (uint32_t i = 0; i < n_done; i++) {
        const struct part *p = part_at(s, i * s->words_each);
        uint32_t n_words = p->n_words;
        if (end < i * s->words_each)
            memmove(part_at(s, end), p, n_words * WORD);
        end += n_words;
    }
    return end;
}

#define AT_ONCE_MAX 64u

/* Fewer jobs where fewer are left, so that all members end at about the same time. */
static uint32_t at_once(const struct sharing *s, uint64_t begun)
{
    uint64_t left = begun < s->loop->n ? s->loop->n - begun : 0;
    uint64_t n = left / ((uint64_t)8 * s->runner->team->size * lum_pool_size(s->runner->pool));
    return n < 1 ? 1 : n > AT_ONCE_MAX ? AT_ONCE_MAX : (uint32_t)n;
}

/* A worker takes jobs until there are none. */
static void take_jobs(void *ctx, uint32_t unused, uint32_t worker)
{
    (void)unused;
    const struct sharing *s = ctx;
    struct lum_counters *counters = &s->runner->counters[worker];
    struct lum_team *team = s->runner->team;
    uint32_t n = at_once(s, 0);
    for (uint64_t first = team->kind->take(team, n); first < s->loop->n; first = team->kind->take(team, n)) {
        for (uint64_t job = first; job < first + n && job < s->loop->n; job++)
            lum_stage_job(make_part, ctx, (uint32_t)job, counters);
        n = at_once(s, first + n);
    }
}

/* ---- hearing ---- */

static void take_over(void *ctx, uint32_t i, uint32_t worker)
{
    const struct sharing *s = ctx;
    const struct part *p = part_at(s, s->at[i]);
    if (i - s->first_mine >= s->n_mine)
        s->loop->take_over(s->loop->ctx, p->job, p->left, worker);
}

/* All parts, by rank. */
static void hear_parts(struct sharing *s, const struct account *of_all)
{
    struct lum_team *team = s->runner->team;
    uint32_t n_words[LUM_TEAM_MAX];
    uint64_t n_all = 0, n_parts = 0;
    for (uint32_t r = 0; r < team->size; r++) {
        n_words[r] = (uint32_t)of_all[r].n_words;
        n_all += of_all[r].n_words;
        n_parts += of_all[r].n_done;
        s->first_mine += r < team->rank ? (uint32_t)of_all[r].n_done : 0;
        if (of_all[r].n_jobs != of_all[0].n_jobs || of_all[r].bytes != of_all[0].bytes)
            team->kind->give_up(team, "ranks are not at the same work");
    }
    if (n_parts != s->loop->n || n_all > INT32_MAX)
        team->kind->give_up(team, n_all > INT32_MAX ? "a loop leaves more than 16 GiB" : "jobs of a loop were lost");
    s->n_mine = (uint32_t)of_all[team->rank].n_done;
    const unsigned char *mine = s->parts;
    s->parts = lum_team_room(team, LUM_TEAM_ALL, n_all * WORD);
    lum_team_gather_parts(team, mine, WORD, n_words, s->parts);
    s->at = lum_team_room(team, LUM_TEAM_INDEX, n_parts * sizeof *s->at);
    for (uint32_t i = 0, word = 0; i < s->loop->n; word += part_at(s, word)->n_words, i++)
        s->at[i] = word;
    lum_pool_run(s->runner->pool, s->loop->n, take_over, s, NULL);
}

enum lum_status lum_stage_share(const struct lum_stage_runner *runner, const struct lum_shared_loop *loop)
{
    struct lum_team *team = runner->team;
    if (!team || loop->n == 0)
        return lum_stage_loop(runner, loop->n, make_alone, (void *)loop);
    struct sharing s = {.runner = runner, .loop = loop, .words_each = 1 + (uint32_t)((loop->bytes + WORD - 1) / WORD)};
    struct account *of_all = lum_team_room(team, LUM_TEAM_ACCOUNTS, team->size * sizeof *of_all);
    struct account mine = {.n_jobs = loop->n, .bytes = loop->bytes};
    struct lum_stage_runner whole = *runner;
    whole.cancel = NULL;
    s.parts = lum_team_room(team, LUM_TEAM_MINE, (size_t)loop->n * s.words_each * WORD);
    add_counters(runner, true, &mine);
    team->kind->begin(team);
    (void)lum_stage_timed(&whole, lum_pool_size(runner->pool), take_jobs, &s);
    add_counters(runner, false, &mine);
    mine.n_done = atomic_load(&s.n_done);
    mine.n_words = close_up(&s, (uint32_t)mine.n_done);
    lum_team_gather(team, &mine, sizeof mine, of_all);
    hear_parts(&s, of_all);
    for (uint32_t r = 0; r < team->size; r++)
        if (r != team->rank)
            count_also(&runner->counters[0], &of_all[r]);
    return LUM_OK;
}
