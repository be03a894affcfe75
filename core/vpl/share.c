/* Each level of bounces is shared out by systematic sampling: slot k of n belongs to the light whose part of [0, 1]
 * holds (k + offset) / n. So a light with part p gets n p slots, rounded down or up, and n p in expectation over the
 * offset. Level b is bounce b, but for the last level, which is all further bounces: each of its slots is one of them,
 * drawn from TAILS. */
#include "core/vpl/share.h"
#include "core/light/emitter.h"

#include <string.h>

#include "core/light/emit.h"
#include "core/math/lanes.h"
#include "core/math/sampler.h"
#include "core/scene/snapshot.h"

struct lum_rgb lum_light_present_power(const struct lum_light_table *t, uint32_t i)
{
    const struct lum_light *l = &t->lights[i];
    if (!l->on || (l->kind == &lum_emitter_environment && i != t->environment))
        return lum_grey(0.0f);
    return l->power;
}

static double present_luminance(const struct lum_snapshot *s, uint32_t i)
{
    double y = (double)lum_luminance(lum_light_present_power(&s->lights, i));
    return y > 0.0 && isfinite(y) ? y : 0.0;
}

/* ---- shares ---- */

static int order_of(const struct lum_vpl_share *share, const struct lum_light *l)
{
    int later = (share->kind == &lum_emitter_mesh) - (l->kind == &lum_emitter_mesh);
    return later != 0 ? later : strcmp(share->id, l->id);
}

/* The previous share of a light, or NULL. Both tables are in the order of ids, lights before objects that shine: they
 * are walked along together, from *inout_at. */
static const struct lum_vpl_share *find_share(const struct lum_vpl_set *previous, const struct lum_light *l,
                                              uint32_t *inout_at)
{
    uint32_t at = *inout_at;
    while (at < previous->n_shares && order_of(&previous->shares[at], l) < 0)
        at++;
    *inout_at = at;
    if (at == previous->n_shares || order_of(&previous->shares[at], l) != 0 || previous->shares[at].kind != l->kind)
        return NULL;
    return &previous->shares[at];
}

static double flux_of(const struct lum_vpl_set *set, uint32_t i, const struct lum_snapshot *s)
{
    return set->shares[i].luminance * lum_light_flux_unit(&s->lights.lights[i], s->bounds_lo, s->bounds_hi);
}

/* Half of the paths go by flux, half to all lights alike, as in the pick table of lights (scene/lights.c): a sun that
 * is blocked everywhere must not starve a desk lamp. */
static void divide(struct lum_vpl_set *set, const struct lum_snapshot *s)
{
    double total = 0.0, n_shining = 0.0, sum = 0.0;
    for (uint32_t i = 0; i < set->n_shares; i++) {
        double weight = flux_of(set, i, s);
        total += weight;
        n_shining += weight > 0.0 ? 1.0 : 0.0;
    }
    struct lum_vpl_share *last = NULL;
    for (uint32_t i = 0; i < set->n_shares; i++) {
        struct lum_vpl_share *share = &set->shares[i];
        double weight = flux_of(set, i, s);
        share->below = sum;
        if (weight > 0.0) {
            sum += 0.5 * weight / total + 0.5 / n_shining;
            last = share;
        }
        share->upto = sum;
    }
    for (; last && last < set->shares + set->n_shares; last++) { /* rounding may leave the sum a little off 1 */
        last->upto = 1.0;
        if (last + 1 < set->shares + set->n_shares)
            last[1].below = 1.0;
    }
}

enum lum_status lum_vpl_share_paths(struct lum_vpl_set *set, const struct lum_vpl_set *previous,
                                    const struct lum_snapshot *s, struct lum_error *err)
{
    uint32_t n = s->lights.n_lights, at = 0;
    struct lum_vpl_share *shares = lum_calloc(n, sizeof *shares);
    if (!shares)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the shares of %u lights", n);
    for (uint32_t i = 0; i < n; i++) {
        const struct lum_light *l = &s->lights.lights[i];
        const struct lum_vpl_share *before = previous->scale == s->norm.scale ? find_share(previous, l, &at) : NULL;
        memcpy(shares[i].id, l->id, sizeof shares[i].id);
        shares[i].kind = l->kind;
        shares[i].luminance = before && before->luminance > 0.0 ? before->luminance : present_luminance(s, i);
    }
    set->shares = shares;
    set->n_shares = n;
    set->scale = s->norm.scale;
    divide(set, s);
    return LUM_OK;
}

bool lum_vpl_shares_serve(const struct lum_vpl_set *set, const struct lum_snapshot *s)
{
    for (uint32_t i = 0; i < set->n_shares; i++)
        if (!(set->shares[i].luminance > 0.0) && present_luminance(s, i) > 0.0)
            return false;
    return true;
}

/* ---- the plan ---- */

/* How far beyond the last level's first bounce a slot's bounce is: as often one as the other of two geometric
 * distributions, which suit grey rooms and white ones. Flux over probability, which is what VPLs carry, would all be
 * the same if the surfaces' albedo were the ratio; for albedos up to 0.95 the largest is 5 times the mean. One ratio
 * cannot do that, and the true albedos may not decide: paint must move no VPL. */
static const double TAILS[2] = {0.6, 0.93};

/* Probability of being further than n bounces beyond, were there no end. */
static double tail_beyond(uint32_t n)
{
    return 0.5 * pow(TAILS[0], n + 1.0) + 0.5 * pow(TAILS[1], n + 1.0);
}

/* Path `number` of a light: which bounce the last level's slot is, and with what probability. Numbers that are rotated
 * by the golden ratio fill [0, 1) evenly however many there are. */
static uint32_t tail_bounce(const struct lum_vpl_plan *plan, uint32_t salt, uint32_t number, double *ret_prob)
{
    uint32_t first = plan->n_levels - 1, most = plan->max_bounces - 1 - first, n = 0;
    double all = 1.0 - tail_beyond(most), before = 0.0, upto = (1.0 - tail_beyond(0)) / all;
    uint32_t turn = lum_hash_combine(salt, lum_hash_u32(plan->seed)) + number * 0x9e3779b9u;
    for (double u = turn * 0x1p-32; n < most && u >= upto; n++) {
        before = upto;
        upto = (1.0 - tail_beyond(n + 1)) / all;
    }
    *ret_prob = upto - before;
    return first + n;
}

static void make_levels(struct lum_vpl_plan *plan, uint32_t n)
{
    uint32_t first = 0, most = plan->max_bounces < LUM_VPL_LEVELS ? plan->max_bounces : LUM_VPL_LEVELS;
    for (uint32_t b = 0; b < most && first < n; b++) {
        uint32_t left = n - first, take = b + 1 == most ? left : (left + 1) / 2;
        plan->level_first[b] = first;
        plan->level_n[b] = take;
        plan->offset[b] = lum_hash_combine(lum_hash_u32(plan->seed), b) * 0x1p-32;
        plan->n_levels++;
        first += take;
    }
}

/* First slot of the level, counted in it, that belongs at or above x of [0, 1]. */
static uint32_t slots_below(const struct lum_vpl_plan *plan, uint32_t level, double x)
{
    double k = ceil(plan->level_n[level] * x - plan->offset[level]);
    return k > 0.0 ? (uint32_t)fmin(k, plan->level_n[level]) : 0;
}

bool lum_vpl_comes_from_afar(const struct lum_vpl_set *set)
{
    for (uint32_t i = 0; i < set->n_shares; i++)
        if (set->shares[i].luminance > 0.0 && set->shares[i].kind->from_afar)
            return true;
    return false;
}

static uint32_t slots_of(const struct lum_vpl_plan *plan, uint32_t level, const struct lum_vpl_share *share)
{
    return slots_below(plan, level, share->upto) - slots_below(plan, level, share->below);
}

void lum_vpl_plan_init(struct lum_vpl_plan *ret_plan, struct lum_vpl_set *set)
{
    struct lum_vpl_plan plan = {.shares = set->shares,
                                .n_shares = set->n_shares,
                                .seed = set->seed,
                                .max_bounces = set->max_bounces,
                                .tries = set->tries,
                                .n = set->n_bounced};
    make_levels(&plan, set->n_bounced);
    for (uint32_t i = 0; i < set->n_shares; i++) {
        uint32_t most = 0;
        for (uint32_t b = 0; b < plan.n_levels; b++) {
            uint32_t n = slots_of(&plan, b, &set->shares[i]);
            most = n > most ? n : most;
        }
        const struct lum_emitter_row *kind = set->shares[i].kind;
        bool from_afar = kind->from_afar;
        set->shares[i].tries = from_afar ? plan.tries : (plan.tries + 1) / 2;
        set->shares[i].first_path = plan.n_paths;
        plan.n_paths += most * set->shares[i].tries;
    }
    *ret_plan = plan;
}

/* FNV-1a. */
static uint32_t hash_share(const struct lum_vpl_share *share)
{
    uint32_t h = 2166136261u + (share->kind == &lum_emitter_mesh);
    for (const char *c = share->id; *c; c++)
        h = (h ^ (uint8_t)*c) * 16777619u;
    return h;
}

void lum_vpl_plan_path(const struct lum_vpl_plan *plan, uint32_t index, uint32_t *ret_share, uint32_t *ret_number,
                       uint32_t *ret_last, uint32_t *ret_salt)
{
    uint32_t lo = 0, hi = plan->n_shares - 1; /* the last share with first_path <= index: it has paths */
    while (lo < hi) {
        uint32_t mid = hi - (hi - lo) / 2;
        if (plan->shares[mid].first_path <= index)
            lo = mid;
        else
            hi = mid - 1;
    }
    const struct lum_vpl_share *share = &plan->shares[lo];
    uint32_t last = 0, number = index - share->first_path;
    double prob;
    for (uint32_t b = 0; b < plan->n_levels; b++)
        if (number < slots_of(plan, b, share) * share->tries)
            last = b;
    *ret_share = lo;
    *ret_number = number;
    *ret_salt = hash_share(share);
    *ret_last = last + 1 == plan->n_levels ? tail_bounce(plan, *ret_salt, number, &prob) : last;
}

uint32_t lum_vpl_plan_run(const struct lum_vpl_plan *plan, uint32_t share, uint32_t level, uint32_t *ret_first)
{
    *ret_first = plan->level_first[level] + slots_below(plan, level, plan->shares[share].below);
    return slots_of(plan, level, &plan->shares[share]);
}

/* A light that is sure to have slots is divided by how many it has, so that none of its flux is a matter of chance;
 * others by how many they have in expectation. */
uint32_t lum_vpl_plan_slot(const struct lum_vpl_plan *plan, uint32_t share, uint32_t number, uint32_t bounce,
                           float *ret_weight)
{
    const struct lum_vpl_share *s = &plan->shares[share];
    uint32_t level = bounce + 1 < plan->n_levels ? bounce : plan->n_levels - 1;
    uint32_t n = slots_of(plan, level, s);
    if (number >= n * s->tries)
        return LUM_NO_OBJECT;
    double expected = plan->level_n[level] * (s->upto - s->below), prob = 1.0;
    if (level + 1 == plan->n_levels && bounce != tail_bounce(plan, hash_share(s), number, &prob))
        return LUM_NO_OBJECT;
    *ret_weight = (float)(1.0 / (prob * (expected >= 1.0 ? (double)n : expected)));
    return number / n * plan->n + plan->level_first[level] + slots_below(plan, level, s->below) + number % n;
}

/* ---- spacing ---- */

/* The k-th nearest tells an area to 1 / sqrt(k) of it: 35 %. The median of at most QUERIES of them, to 3 %. */
enum { NEIGHBOURS = 8, QUERIES = 256 };

#define LANES LUM_LANES /* arrays of a set are padded to them */

/* Of LANES VPLs from k on those that are nearer to VPL i and face as it does, to 60 degrees: round a bend, not round a
 * corner. Empty slots have no normal. Vector code. */
static uint32_t find_near(const struct lum_vpl_set *set, uint32_t i, uint32_t k, float limit2, float ret_d2[LANES])
{
    const float *px = set->px + k, *py = set->py + k, *pz = set->pz + k;
    const float *nx = set->nx + k, *ny = set->ny + k, *nz = set->nz + k;
    const struct lum_vec3 p = {set->px[i], set->py[i], set->pz[i]}, n = {set->nx[i], set->ny[i], set->nz[i]};
    uint32_t all = 0;
    for (uint32_t l = 0; l < LANES; l++) {
        float x = p.x - px[l], y = p.y - py[l], z = p.z - pz[l], d2 = x * x + y * y + z * z;
        float facing = n.x * nx[l] + n.y * ny[l] + n.z * nz[l];
        all |= (d2 < limit2) & (facing > 0.5f) ? lum_lane_bit[l] : 0u;
        ret_d2[l] = d2;
    }
    return all;
}

/* Lanes from k on that are every step-th. */
static uint32_t every(uint32_t k, uint32_t step)
{
    uint32_t bits = 0;
    for (uint32_t l = (step - k % step) % step; l < LANES; l += step)
        bits |= lum_lane_bit[l];
    return bits;
}

/* Those that are nearest, in increasing order. */
struct nearest {
    float d2[NEIGHBOURS], importance[NEIGHBOURS];
};

static void insert(struct nearest *inout, float d2, float importance)
{
    int at = NEIGHBOURS - 1;
    if (!(d2 < inout->d2[at]))
        return;
    for (; at > 0 && inout->d2[at - 1] > d2; at--) {
        inout->d2[at] = inout->d2[at - 1];
        inout->importance[at] = inout->importance[at - 1];
    }
    inout->d2[at] = d2;
    inout->importance[at] = importance;
}

/* Square of the distance from VPL i to its NEIGHBOURS-th nearest on the same side, of every step-th, or limit2; and how
 * important it is beside them, over their mean; neighbours that are not there count as of no importance: what is lone
 * is lifted the more (NOTES, tried and rejected). */
static float reach2(const struct lum_vpl_set *set, uint32_t i, uint32_t step, float limit2, float *ret_beside)
{
    struct nearest nearest = {{0}, {0}};
    float sum = 0.0f;
    for (int k = 0; k < NEIGHBOURS; k++)
        nearest.d2[k] = limit2;
    for (uint32_t k = 0; k < set->n_bounced; k += LANES) {
        float d2[LANES];
        uint32_t near = find_near(set, i, k, nearest.d2[NEIGHBOURS - 1], d2);
        for (near &= step > 1 ? every(k, step) : near; near; near &= near - 1) {
            uint32_t l = (uint32_t)__builtin_ctz(near);
            if (k + l != i)
                insert(&nearest, d2[l], set->importance[k + l]);
        }
    }
    for (int k = 0; k < NEIGHBOURS; k++)
        sum += nearest.importance[k];
    *ret_beside = sum > 0.0f ? NEIGHBOURS * set->importance[i] / sum : 1.0f;
    return nearest.d2[NEIGHBOURS - 1];
}

/* Of points spread at random with density q, the circle up to the k-th nearest holds k on average: pi d^2 q = k. So the
 * area that a VPL stands for is pi d^2 / k. Queries are spread over the set, which makes the cost linear in n. */
float lum_vpl_measure_spacing(const struct lum_vpl_set *set, float limit)
{
    float areas[QUERIES];
    uint32_t n = 0, step = (set->n_bounced + QUERIES - 1) / QUERIES;
    for (uint32_t i = 0; i < set->n_bounced; i += step)
        if (set->light[i] != LUM_NO_OBJECT) {
            float beside, area = reach2(set, i, 1, limit * limit, &beside) / NEIGHBOURS;
            uint32_t at = n++;
            for (; at > 0 && areas[at - 1] > area; at--)
                areas[at] = areas[at - 1];
            areas[at] = area;
        }
    return n > 0 ? sqrtf(areas[n / 2]) : 0.0f;
}

/* Of lone VPLs, at most, over the scene's radius. */
#define RADIUS_MAX 0.1f

/* What is more important than those around it stands for as much more area, but for at most so much: */
#define AREA_MAX 16.0f

/* Of more VPLs only some are looked for around each, and as many more taken to be there: the cost is linear in n. */
enum { RADII_OF_JOB = 64, LOOKED_AT = 4096 };

struct radii {
    struct lum_vpl_set *set;
    const struct lum_vpl_kept *kept; /* by slot; may be NULL */
    float scene_radius;
};

static void measure_radii(void *ctx, uint32_t job, struct lum_counters *counters)
{
    const struct radii *radii = ctx;
    struct lum_vpl_set *set = radii->set;
    uint32_t step = (set->n_bounced + LOOKED_AT - 1) / LOOKED_AT;
    float per = 1.0f / (float)(NEIGHBOURS * step), limit = RADIUS_MAX * radii->scene_radius;
    (void)counters;
    for (uint32_t i = job * RADII_OF_JOB; i < set->n_bounced && i < (job + 1) * RADII_OF_JOB; i++)
        if (set->light[i] != LUM_NO_OBJECT) {
            float beside, area = reach2(set, i, step, limit * limit / per, &beside) * per;
            set->radius[i] = sqrtf(area * fminf(fmaxf(beside, 1.0f), AREA_MAX));
            if (!radii->kept || set->object[i] == LUM_NO_OBJECT) /* fog has no surface that is near */
                continue;
            float m = LUM_VPL_LIFT * set->radius[i];
            struct lum_vpl_lost lost = lum_vpl_lost_of(&radii->kept[i], radii->scene_radius, m);
            set->lost[i] = lost.lost, set->beside[i] = lost.beside;
            set->gain[i] = lum_vpl_gain(&radii->kept[i], radii->scene_radius, m);
        }
}

enum lum_status lum_vpl_measure_radii(struct lum_vpl_set *set, const struct lum_vpl_kept *kept,
                                      const struct lum_vpl_request *rq, struct lum_error *err)
{
    struct radii radii = {set, kept, rq->snapshot->lights.scene_radius};
    return lum_vpl_run(rq, (set->n_bounced + RADII_OF_JOB - 1) / RADII_OF_JOB, measure_radii, &radii, err);
}
