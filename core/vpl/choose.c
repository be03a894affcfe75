/* Which light paths become VPLs. In many scenes most of them are of no use to anybody: a sun's paths miss the windows
 * and end on the roof, or on nothing at all. So there are several tries for each slot, and of all tries that a light
 * has for a level those are chosen that are likely to light something: a try's weight w is the share of rays from it,
 * and from others of this light around it, that meet anything; where there are portals half of it is what the try is
 * likely to bring inside, by its flux.
 *
 * This is priority sampling (Duffield, Lund and Thorup 2007): each try has a number u of its own in (0, 1), and the n
 * with the largest w / u fill the slots. Given the step, which is the largest w / u of those that are left out, a try
 * is chosen with probability min(1, w / step), and what it would bring is divided by that. Then all are scaled so that
 * the weights of those chosen, divided likewise, add up to those of all tries. The expectation is that of all; only of
 * a light that has few slots, what tries of little weight among others of much would bring is up to a sixth less.
 *
 * Bounces further on have no smaller step than those before them: where few paths go on, their VPLs are few.
 *
 * Numbers go by tries: all first tries have theirs in one part of (0, 1), all second ones in another. So where all
 * weights are alike one try of each slot is chosen, the same of all of them, which is as well distributed as paths
 * without a choice.
 *
 * A try's number never changes, and it stays in its slot as long as it is the first one chosen there; others go to free
 * ones. So what moves elsewhere moves few VPLs, scales the flux of others by a little, and does neither to those of
 * lights that do not reach it. The choice depends on geometry alone: light that changes moves nothing, and no
 * colours but those of sheets, which share their light out between their sides; it serves all views and all records. */
#include "core/vpl/share.h"

#include <stdlib.h>

#include "core/math/sampler.h"
#include "core/math/warp.h"
#include "core/trace/rays.h"

/* Rays that ask whether there is anything to shine on. What none of them meets may be there all the same. */
enum { PROBES = 2 };
#define LEAST 0.03f /* so a try of which no ray meets anything is still taken, once for 33 of those that light much */
_Static_assert(LUM_VPL_TRIES_MAX *PROBES <= LUM_RAY_BATCH, "the tries of a slot are one batch");

/* Tries around: of the same light, in the same cell of the scene, of which there are so many along its longest side,
 * and facing the same way, as the largest component of the normal goes. Theirs count as so many rays of a try's own. */
#define CELLS 16u
#define RAYS_AROUND 4.0f

struct cell {
    uint32_t light, at;           /* LUM_NO_OBJECT: free */
    float n, n_met, n_met_inside; /* rays */
};

struct choice {
    const struct lum_vpl_set *candidates;
    const struct lum_vpl_plan *plan;
    const struct lum_snapshot *snapshot;
    const struct lum_known *known;
    float *w;     /* by candidate; 0: there is no VPL */
    float *worth; /* by candidate: first of its rays those that end inside; then of its flux what may get there. 0 where
                   * there are no portals */
    float *priority;               /* by candidate */
    float *sorted;                 /* room for those of a run */
    struct lum_vpl_kept *kept;     /* by candidate: sums over its rays */
    struct lum_vpl_kept *around;   /* by place_of: of all lights */
    struct lum_vpl_kept *ret_kept; /* by slot */
    struct cell *cells;
    uint32_t n_cells; /* a power of 2, at least twice as many as candidates */
};

static bool has_portals(const struct choice *choice)
{
    return choice->candidates->portals.n > 0;
}

static struct lum_vec3 normal_of(const struct choice *choice, uint32_t i)
{
    const struct lum_vpl_set *c = choice->candidates;
    return lum_v3(c->nx[i], c->ny[i], c->nz[i]);
}

/* Ray r of candidate i came back. What lamps' shapes would take of its light is as if they were not there. */
static void note(const struct choice *choice, uint32_t i, const struct lum_rays *rays, const struct lum_hits *hits,
                 uint32_t r)
{
    const uint32_t object = hits->object[r];
    choice->w[i] += object != LUM_NO_OBJECT ? 1.0f : 0.0f;
    if (object >= choice->snapshot->n_instances) {
        lum_vpl_kept_add_miss(&choice->kept[i]);
        return;
    }
    struct lum_vec3 o = {rays->ox[r], rays->oy[r], rays->oz[r]};
    if (has_portals(choice) &&
        lum_portals_inside(&choice->candidates->portals, lum_v3_mad(o, lum_rays_direction(rays, r), hits->t[r])))
        choice->worth[i] += 1.0f;
    struct lum_vec3 n =
        lum_instance_normal(&choice->snapshot->instances[object], lum_v3(hits->ngx[r], hits->ngy[r], hits->ngz[r]));
    lum_vpl_kept_add(&choice->kept[i], choice->snapshot->lights.scene_radius, normal_of(choice, i),
                     lum_rays_direction(rays, r), hits->t[r], n);
}

/* Of the rays of a slot's tries: how many meet something, and how near. */
static void probe(void *ctx, uint32_t slot, struct lum_counters *counters)
{
    const struct choice *choice = ctx;
    const struct lum_vpl_set *c = choice->candidates;
    const struct lum_vpl_plan *plan = choice->plan;
    struct lum_trace trace = lum_trace_of(choice->snapshot, counters);
    struct lum_rays rays;
    struct lum_hits hits;
    uint32_t of[LUM_RAY_BATCH];
    rays.n = 0;
    for (uint32_t i = slot; i < c->n; i += plan->n) {
        if (c->light[i] == LUM_NO_OBJECT)
            continue;
        struct lum_vec3 n = normal_of(choice, i);
        struct lum_vec3 o = lum_ray_offset(lum_v3(c->px[i], c->py[i], c->pz[i]), n);
        struct lum_frame frame = lum_frame_from_normal(n);
        for (uint32_t k = 0; k < PROBES; k++) {
            struct lum_sampler sampler = lum_sampler_at(i, 0, k, plan->seed);
            of[rays.n] = i;
            lum_rays_push(&rays, o, lum_frame_to_scene(&frame, lum_warp_cosine(lum_sampler_2d(&sampler, 0))), INFINITY);
        }
    }
    counters->rays[LUM_RAY_VPL] += lum_known_closest(choice->known, &trace, &rays, &hits);
    for (uint32_t r = 0; r < rays.n; r++)
        note(choice, of[r], &rays, &hits, r);
}

static uint32_t index_in(float x, float lo, float side)
{
    return (uint32_t)lum_clamp((x - lo) / side, 0.0f, CELLS - 1);
}

/* Twice: of the portals' box, and of all that is outside. Where a house stands on acres the scene's own cells are as
 * high as a room, and what few rays meet on a roof would be taken to be what they meet on the floors below. */
#define PLACES (2u * 6u * CELLS * CELLS * CELLS)

static uint32_t place_of(const struct choice *choice, uint32_t i)
{
    const struct lum_vpl_set *c = choice->candidates;
    const struct lum_vec3 p = {c->px[i], c->py[i], c->pz[i]};
    const bool inside = has_portals(choice) && lum_portals_inside(&c->portals, p);
    const struct lum_vec3 lo = inside ? c->portals.lo : choice->snapshot->bounds_lo;
    const struct lum_vec3 size = lum_v3_sub(inside ? c->portals.hi : choice->snapshot->bounds_hi, lo);
    float side = lum_max(lum_v3_largest(size) / CELLS, LUM_RAY_OFFSET);
    float x = fabsf(c->nx[i]), y = fabsf(c->ny[i]), z = fabsf(c->nz[i]);
    uint32_t face = x >= y && x >= z ? c->nx[i] < 0.0f : y >= z ? 2u + (c->ny[i] < 0.0f) : 4u + (c->nz[i] < 0.0f);
    uint32_t at = (inside ? 6u + face : face) * CELLS + index_in(p.z, lo.z, side);
    return (at * CELLS + index_in(p.y, lo.y, side)) * CELLS + index_in(p.x, lo.x, side);
}

static struct cell *cell_of(const struct choice *choice, uint32_t i)
{
    const struct lum_vpl_set *c = choice->candidates;
    uint32_t at = place_of(choice, i);
    uint32_t k = lum_hash_combine(lum_hash_u32(at), c->light[i]) & (choice->n_cells - 1);
    while (choice->cells[k].light != LUM_NO_OBJECT &&
           (choice->cells[k].light != c->light[i] || choice->cells[k].at != at))
        k = (k + 1) & (choice->n_cells - 1);
    choice->cells[k].light = c->light[i];
    choice->cells[k].at = at;
    return &choice->cells[k];
}

static float with_those_around(float n_met, float n, float own)
{
    return (RAYS_AROUND * n_met / n + own) / (RAYS_AROUND + PROBES);
}

/* Of what a VPL outside sends out, the part that goes in by the portals, were nothing in the way: its form factor with
 * them. */
static float part_by_portals(const struct choice *choice, struct lum_vec3 p, struct lum_vec3 n)
{
    struct lum_portals_seen seen;
    lum_portals_see(&choice->candidates->portals, p, n, &seen);
    return lum_min(seen.all * LUM_INV_PI, 1.0f);
}

/* Roofs and outer walls may be in the box, but little goes on from there to what is inside. */
static float part_inside(const struct choice *choice, const struct cell *cell, uint32_t i)
{
    const struct lum_vpl_set *c = choice->candidates;
    struct lum_vec3 p = {c->px[i], c->py[i], c->pz[i]};
    return lum_portals_inside(&c->portals, p) ? with_those_around(cell->n_met_inside, cell->n, choice->worth[i])
                                              : part_by_portals(choice, p, normal_of(choice, i));
}

/* From rays that meet something to weights. */
static void weigh(const struct choice *choice)
{
    const struct lum_vpl_set *c = choice->candidates;
    for (uint32_t i = 0; i < c->n; i++)
        if (c->light[i] != LUM_NO_OBJECT) {
            struct cell *cell = cell_of(choice, i);
            cell->n += PROBES;
            cell->n_met += choice->w[i];
            cell->n_met_inside += choice->worth[i];
            lum_vpl_kept_add_all(&choice->around[place_of(choice, i)], &choice->kept[i]);
        }
    for (uint32_t i = 0; i < c->n; i++)
        if (c->light[i] != LUM_NO_OBJECT) {
            const struct cell *cell = cell_of(choice, i);
            choice->w[i] = LEAST + (1.0f - LEAST) * with_those_around(cell->n_met, cell->n, choice->w[i]);
            if (has_portals(choice))
                choice->worth[i] = c->importance[i] * part_inside(choice, cell, i);
        }
}

/* Slots of a light, and the tries for them. */
struct run {
    uint32_t first, n, tries;
};

/* w / u, where u is the candidate's number. */
static float priority_of(const struct choice *choice, const struct run *run, uint32_t i)
{
    const struct lum_vpl_plan *plan = choice->plan;
    uint32_t turn = (i / plan->n + lum_hash_u32(plan->seed)) % run->tries;
    float u = ((float)(lum_hash_combine(lum_hash_u32(i), plan->seed) >> 8) + 0.5f) * 0x1p-24f;
    return choice->w[i] * (float)run->tries / ((float)turn + u);
}

static int by_size(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x < y) - (x > y);
}

/* Fills in the run's priorities, and returns what those of the chosen are above, so that there are no more than slots.
 */
static float find_step(const struct choice *choice, const struct run *run)
{
    uint32_t m = 0;
    for (uint32_t t = 0; t < run->tries; t++)
        for (uint32_t slot = run->first; slot < run->first + run->n; slot++) {
            uint32_t i = t * choice->plan->n + slot;
            choice->priority[i] = choice->sorted[m++] = priority_of(choice, run, i);
        }
    qsort(choice->sorted, m, sizeof *choice->sorted, by_size);
    return m > run->n ? choice->sorted[run->n] : 0.0f;
}

static void copy(struct lum_vpl_set *set, uint32_t to, const struct lum_vpl_set *c, uint32_t from, float factor)
{
    set->px[to] = c->px[from], set->py[to] = c->py[from], set->pz[to] = c->pz[from];
    set->nx[to] = c->nx[from], set->ny[to] = c->ny[from], set->nz[to] = c->nz[from];
    for (uint32_t k = 0; k < 3; k++)
        set->flux_unit[k][to] = c->flux_unit[k][from] * factor;
    set->importance[to] = c->importance[from]; /* the less it counts, the fewer see it */
    set->lobe[to] = c->lobe[from];
    set->wx[to] = c->wx[from], set->wy[to] = c->wy[from], set->wz[to] = c->wz[from];
    set->alpha[to] = c->alpha[from], set->f0[to] = c->f0[from], set->f90[to] = c->f90[from];
    set->light[to] = c->light[from], set->object[to] = c->object[from], set->prim[to] = c->prim[from];
}

/* A free slot of a run that has one: by chance, so that what comes or goes elsewhere seldom moves it. */
static uint32_t find_free(const struct lum_vpl_set *set, const struct run *run, uint32_t i)
{
    uint32_t at = lum_hash_u32(i) % run->n;
    for (uint32_t k = 0; set->light[run->first + at] != LUM_NO_OBJECT; k++)
        at = k < run->n ? lum_hash_combine(lum_hash_u32(i), k) % run->n : (at + 1) % run->n;
    return run->first + at;
}

/* Where there are portals half of the choice goes by what tries bring inside: those of the ground before a window have
 * hundreds of times the flux of those that were aimed at it, and few of them are as near. */
static void weigh_by_worth(struct choice *choice, const struct run *run)
{
    double worth = 0.0, w = 0.0;
    const uint32_t end = run->first + run->n, n_tries = run->tries * choice->plan->n;
    for (uint32_t slot = run->first; slot < end; slot++)
        for (uint32_t i = slot; i < n_tries; i += choice->plan->n) {
            worth += (double)choice->worth[i];
            w += (double)choice->w[i];
        }
    if (!(worth > 0.0))
        return;
    for (uint32_t slot = run->first; slot < end; slot++)
        for (uint32_t i = slot; i < n_tries; i += choice->plan->n)
            choice->w[i] = (float)(0.5 * (double)choice->w[i] + 0.5 * (double)choice->worth[i] / worth * w);
}

/* inout_step: of the light's runs before, and then of this one. A VPL counts no less than those of runs before: else
 * many would be made of the few paths that go on, and asked as often as others, for little. */
static void fill(struct lum_vpl_set *set, const struct choice *choice, const struct run *run, float *inout_step)
{
    const uint32_t end = run->first + run->n, n = choice->plan->n, n_tries = run->tries * n;
    float own = find_step(choice, run), step = *inout_step = lum_max(*inout_step, own);
    if (!(choice->sorted[0] > step)) /* one at least: nothing would stand for what there is */
        step = own;
    double all = 0.0, chosen = 0.0;
    for (uint32_t slot = run->first; slot < end; slot++)
        for (uint32_t i = slot; i < n_tries; i += n) {
            all += (double)choice->w[i];
            if (choice->priority[i] > step)
                chosen += (double)lum_max(choice->w[i], step);
        }
    double scale = chosen > 0.0 ? all / (chosen * run->tries) : 0.0;
    for (int round = 0; round < 2; round++) /* the first one chosen stays in its slot; then the others */
        for (uint32_t slot = run->first; slot < end; slot++) {
            int earlier = 0;
            for (uint32_t i = slot; i < n_tries; i += n) {
                if (!(choice->priority[i] > step) || (earlier++ > 0) != round)
                    continue;
                float factor = (float)(scale * (double)lum_max(1.0f, step / choice->w[i]));
                uint32_t to = round == 0 ? slot : find_free(set, run, i);
                copy(set, to, choice->candidates, i, factor);
                choice->ret_kept[to] = choice->around[place_of(choice, i)];
            }
        }
}

static enum lum_status begin(struct choice *choice, struct lum_error *err)
{
    uint32_t n = choice->candidates->n;
    for (choice->n_cells = 1; choice->n_cells < 2 * n;)
        choice->n_cells *= 2;
    choice->w = lum_calloc(4 * (size_t)n, sizeof *choice->w);
    choice->cells = lum_calloc(choice->n_cells, sizeof *choice->cells);
    choice->kept = lum_calloc(n + PLACES, sizeof *choice->kept);
    if (!choice->w || !choice->cells || !choice->kept)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory to choose from %u virtual point lights", n);
    choice->around = choice->kept + n;
    choice->priority = choice->w + n;
    choice->sorted = choice->priority + n;
    choice->worth = choice->sorted + n;
    for (uint32_t i = 0; i < choice->n_cells; i++)
        choice->cells[i].light = LUM_NO_OBJECT;
    return LUM_OK;
}

enum lum_status lum_vpl_choose(struct lum_vpl_set *set, const struct lum_vpl_set *candidates,
                               const struct lum_vpl_plan *plan, const struct lum_vpl_request *rq,
                               struct lum_vpl_kept *ret_kept, struct lum_error *err)
{
    struct choice choice = {
        .candidates = candidates, .plan = plan, .snapshot = rq->snapshot, .known = &rq->known, .ret_kept = ret_kept};
    enum lum_status status = begin(&choice, err);
    if (status == LUM_OK)
        status = lum_vpl_run(rq, plan->n, probe, &choice, err);
    if (status == LUM_OK)
        weigh(&choice);
    for (uint32_t share = 0; share < plan->n_shares && status == LUM_OK; share++) {
        float step = 0.0f;
        for (uint32_t level = 0; level < plan->n_levels; level++) {
            struct run run = {.tries = plan->shares[share].tries};
            run.n = lum_vpl_plan_run(plan, share, level, &run.first);
            if (run.n > 0 && has_portals(&choice))
                weigh_by_worth(&choice, &run);
            if (run.n > 0)
                fill(set, &choice, &run, &step);
        }
    }
    lum_free(choice.kept);
    lum_free(choice.cells);
    lum_free(choice.w);
    return status;
}
