/* Which light paths become VPLs. In many scenes most of them are of no use to anybody: a sun's paths miss the windows
 * and end on the roof, or on nothing at all. So each slot has several tries, and is filled by the first that is
 * accepted: a path that finds no surface never is, another with a probability w, the share of its rays that meet
 * anything at all.
 *
 * This is rejection sampling: divided by w, and multiplied by the mean of w over all tries of the light's slots for
 * this level, the flux of those accepted has the expectation of all, but for the rare case that none of the slots is
 * filled. Where w = 1 everywhere they are filled by the first tries, which are as well distributed as without any
 * others.
 *
 * The random number that a try is accepted by never changes: it fills its slot until it, or one before it, changes. So
 * what moves elsewhere moves no VPL, and only scales the flux of all by a little. The choice depends on geometry alone:
 * light and colours that change move nothing, and it serves all views and all records. */
#include "core/vpl/share.h"

#include "core/math/sampler.h"
#include "core/math/warp.h"
#include "core/render/frame.h"

/* Rays that ask whether there is anything to shine on. What none of them meets may be there all the same. */
enum { PROBES = 4 };
#define LEAST (0.5f / PROBES)
_Static_assert(LUM_VPL_TRIES_MAX *PROBES <= LUM_RAY_BATCH, "the tries of a slot are one batch");

struct choice {
    const struct lum_vpl_set *candidates;
    const struct lum_vpl_plan *plan;
    const struct lum_snapshot *snapshot;
    float *w; /* of try t of slot k, at k * plan->tries + t; 0: there is no VPL */
};

static void weigh(void *ctx, uint32_t slot, struct lum_counters *counters)
{
    const struct choice *choice = ctx;
    const struct lum_vpl_set *c = choice->candidates;
    const struct lum_vpl_plan *plan = choice->plan;
    float *w = choice->w + (size_t)slot * plan->tries;
    struct lum_trace trace = lum_trace_of(choice->snapshot, counters);
    struct lum_rays rays;
    uint8_t meets[LUM_RAY_BATCH], of[LUM_RAY_BATCH];
    rays.n = 0;
    for (uint32_t t = 0; t < plan->tries; t++) {
        uint32_t i = t * plan->n + slot;
        w[t] = c->light[i] != LUM_NO_OBJECT ? LEAST : 0.0f;
        if (c->light[i] == LUM_NO_OBJECT)
            continue;
        struct lum_vec3 n = {c->nx[i], c->ny[i], c->nz[i]};
        struct lum_vec3 o = lum_ray_offset(lum_v3(c->px[i], c->py[i], c->pz[i]), n);
        struct lum_frame frame = lum_frame_from_normal(n);
        for (uint32_t k = 0; k < PROBES; k++) {
            struct lum_sampler sampler = lum_sampler_at(i, 0, k, plan->seed);
            of[rays.n] = (uint8_t)t;
            lum_rays_push(&rays, o, lum_frame_to_scene(&frame, lum_warp_cosine(lum_sampler_2d(&sampler, 0))), INFINITY);
        }
    }
    lum_trace_any(&trace, &rays, meets);
    counters->rays[LUM_RAY_VPL] += rays.n;
    for (uint32_t r = 0; r < rays.n; r++)
        w[of[r]] += meets[r] ? (1.0f - LEAST) / PROBES : 0.0f;
}

/* The try that fills the slot; LUM_NO_OBJECT: none is accepted. */
static uint32_t draw(const struct lum_vpl_plan *plan, uint32_t slot, const float *w)
{
    for (uint32_t t = 0; t < plan->tries; t++) {
        float u = (float)(lum_hash_combine(lum_hash_u32(t * plan->n + slot), plan->seed) >> 8) * 0x1p-24f;
        if (u < w[t])
            return t;
    }
    return LUM_NO_OBJECT;
}

static void copy(struct lum_vpl_set *set, uint32_t to, const struct lum_vpl_set *c, uint32_t from, float factor)
{
    set->px[to] = c->px[from], set->py[to] = c->py[from], set->pz[to] = c->pz[from];
    set->nx[to] = c->nx[from], set->ny[to] = c->ny[from], set->nz[to] = c->nz[from];
    for (uint32_t k = 0; k < 3; k++)
        set->flux_unit[k][to] = c->flux_unit[k][from] * factor;
    set->importance[to] = c->importance[from];
    set->lobe[to] = c->lobe[from];
    set->wx[to] = c->wx[from], set->wy[to] = c->wy[from], set->wz[to] = c->wz[from];
    set->alpha[to] = c->alpha[from], set->f0[to] = c->f0[from], set->f90[to] = c->f90[from];
    set->light[to] = c->light[from], set->object[to] = c->object[from], set->prim[to] = c->prim[from];
}

static void fill_run(struct lum_vpl_set *set, const struct choice *choice, uint32_t first, uint32_t n)
{
    const struct lum_vpl_plan *plan = choice->plan;
    double sum = 0.0, n_filled = 0.0;
    for (uint32_t slot = first; slot < first + n; slot++) {
        const float *w = choice->w + (size_t)slot * plan->tries;
        for (uint32_t t = 0; t < plan->tries; t++)
            sum += (double)w[t] / plan->tries;
        uint32_t best = draw(plan, slot, w);
        if (best == LUM_NO_OBJECT)
            continue;
        copy(set, slot, choice->candidates, best * plan->n + slot, 1.0f / w[best]);
        n_filled += 1.0;
    }
    for (uint32_t slot = first; slot < first + n && n_filled > 0.0; slot++)
        for (uint32_t k = 0; k < 3; k++)
            set->flux_unit[k][slot] *= (float)(sum / n_filled);
}

enum lum_status lum_vpl_choose(struct lum_vpl_set *set, const struct lum_vpl_set *candidates,
                               const struct lum_vpl_plan *plan, const struct lum_vpl_request *rq, struct lum_error *err)
{
    struct choice choice = {candidates, plan, rq->snapshot,
                            lum_calloc((size_t)plan->n * plan->tries, sizeof *choice.w)};
    if (!choice.w)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the choice of %u virtual point lights", plan->n);
    enum lum_status status = lum_vpl_run(rq, plan->n, weigh, &choice, err);
    for (uint32_t share = 0; share < plan->n_shares && status == LUM_OK; share++)
        for (uint32_t level = 0; level < plan->n_levels; level++) {
            uint32_t first, n = lum_vpl_plan_run(plan, share, level, &first);
            fill_run(set, &choice, first, n);
        }
    lum_free(choice.w);
    return status;
}
