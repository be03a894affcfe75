/* Temporal instant caching: what a change of the scene does to records (thesis 6.2.2, algorithm 1).
 *
 * A change is noted (since.h), and a record is brought up to date when somebody looks at it: it pays once for an object
 * that moved ten times.
 *
 * Algorithm 1, for the records of a group, each ray of visibility tracing no more than is printed:
 *   line 3   case 5: records within a former box are removed
 *   line 7   cases 1, 2: rays to VPLs that moved are traced against the scene
 *   line 11  case 3: all others against what moved, where it is now; what is hit is in shadow
 *   line 15  case 4: those that were in shadow, and are not hit, against the former boxes, and where they meet one,
 * against the scene Rays to VPLs that the record faces away from do not exist. */
#include "core/cache/instant.h"

#include <string.h>

#include "core/base/pool.h"
#include "core/cache/since.h"
#include "core/math/color.h"
#include "core/trace/rays.h"
#include "core/vpl/gather.h"

struct state {
    struct lum_since_ring *ring;
    uint32_t n_vpls;
    float *flux; /* of the VPLs as of the last change, three channels */
    uint64_t medium;
    uint64_t relit; /* epoch in which VPLs last began to give another light from where they are */
    /* By epoch % LUM_SINCE_EPOCHS: what moved since, where it is now. Made by the first worker that needs it (release),
     * and read by all (acquire). */
    _Atomic(struct lum_accel_top *) movers[LUM_SINCE_EPOCHS];
    _Atomic uint64_t vpl_rays, mover_rays, box_tests, scene_rays, removed, aged;
};

static void add(_Atomic uint64_t *counter, uint64_t n)
{
    atomic_fetch_add_explicit(counter, n, memory_order_relaxed);
}

static bool bit(const uint64_t *mask, uint32_t i)
{
    return (mask[i / 64] >> i % 64 & 1u) != 0;
}

static bool shines(const struct lum_vpl_set *set, uint32_t k)
{
    return set->flux[0][k] > 0.0f || set->flux[1][k] > 0.0f || set->flux[2][k] > 0.0f;
}

/* ---- the state ---- */

static void state_destroy(struct state *state)
{
    lum_free(state->ring);
    lum_free(state->flux);
    lum_free(state);
}

static struct state *state_create(uint32_t n_vpls)
{
    struct state *state = lum_calloc(1, sizeof *state);
    if (!state)
        return NULL;
    state->n_vpls = n_vpls;
    state->ring = lum_since_create(n_vpls);
    state->flux = lum_calloc((size_t)3 * n_vpls, sizeof *state->flux);
    if (!state->ring || !state->flux) {
        state_destroy(state);
        return NULL;
    }
    return state;
}

static struct state *state_of(struct lum_cache *cache)
{
    if (!cache->kind_state)
        cache->kind_state = state_create(cache->key.n_vpls);
    return cache->kind_state;
}

/* Thread: the director; no worker is inside. */
static void forget_movers(struct state *state)
{
    for (uint32_t i = 0; i < LUM_SINCE_EPOCHS; i++) {
        lum_accel_top_unref(atomic_load_explicit(&state->movers[i], memory_order_relaxed));
        atomic_store_explicit(&state->movers[i], NULL, memory_order_relaxed);
    }
}

void lum_instant_finish(struct lum_cache *cache)
{
    struct state *state = cache->kind_state;
    if (!state)
        return;
    forget_movers(state);
    state_destroy(state);
    cache->kind_state = NULL;
}

struct lum_instant_counts lum_cache_temporal_counts(const struct lum_cache *cache)
{
    const struct state *s = cache->kind_state;
    if (!s)
        return (struct lum_instant_counts){0};
    return (struct lum_instant_counts){
        .vpl_rays = atomic_load_explicit(&s->vpl_rays, memory_order_relaxed),
        .mover_rays = atomic_load_explicit(&s->mover_rays, memory_order_relaxed),
        .box_tests = atomic_load_explicit(&s->box_tests, memory_order_relaxed),
        .scene_rays = atomic_load_explicit(&s->scene_rays, memory_order_relaxed),
        .removed = atomic_load_explicit(&s->removed, memory_order_relaxed),
        .aged = atomic_load_explicit(&s->aged, memory_order_relaxed),
    };
}

/* ---- one record, or a group of them ---- */

/* A group on its way through algorithm 1. About 30 KiB: lives on a worker's stack. */
struct update {
    const struct lum_cache_job *job; /* its records: those that stay */
    struct state *state;
    const struct lum_since *since;
    const struct lum_accel_top *movers; /* NULL: nothing that moved is there any more */
    bool changed[LUM_INSTANT_GROUP];
    struct batch {
        struct lum_rays rays;
        float *term[LUM_RAY_BATCH];
        uint8_t record[LUM_RAY_BATCH];
    } near, far; /* case 3; last step of case 4 */
    uint64_t n_boxes, n_near, n_far;
};

static struct lum_instant_record *record_of(const struct update *u, uint32_t i)
{
    return (struct lum_instant_record *)u->job->records[i];
}

static void push(struct batch *b, uint32_t record, float *term, struct lum_vec3 from, struct lum_vec3 target)
{
    b->term[b->rays.n] = term;
    b->record[b->rays.n] = (uint8_t)record;
    lum_vpl_push_ray(&b->rays, from, target);
}

static void trace(struct update *u, struct batch *b, const struct lum_accel_top *top, uint8_t *occluded,
                  struct lum_rgb *left)
{
    struct lum_trace trace = lum_trace_of_light(u->job->snapshot, u->job->counters, u->job->cache->key.panes);
    trace.top = top;
    lum_trace_light(&trace, &b->rays, occluded, left);
    u->job->counters->rays[LUM_RAY_INDIRECT_DIFFUSE] += b->rays.n;
}

/* Algorithm 1, line 18. */
static void trace_far(struct update *u)
{
    struct batch *b = &u->far;
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH];
    bool panes = u->job->cache->key.panes;
    if (b->rays.n == 0)
        return;
    trace(u, b, u->job->snapshot->top, occluded, left);
    for (uint32_t r = 0; r < b->rays.n; r++) {
        float *term = b->term[r];
        if (!panes && occluded[r])
            continue;
        *term = occluded[r] ? -fabsf(*term) : fabsf(*term);
        u->changed[b->record[r]] = true;
        if (panes)
            lum_cache_left(u->job->cache, u->job->records[b->record[r]])[term - record_of(u, b->record[r])->term] =
                occluded[r] ? 0 : lum_transmittance_pack(left[r]);
    }
    u->n_far += b->rays.n;
    b->rays.n = 0;
}

/* Algorithm 1, lines 16 and 17: a ray that was in shadow, and that nothing hits which moved. With panes who sees a VPL
 * is not all: what may cross something that moved, or crossed it, is traced anew. */
static void test_boxes(struct update *u, uint32_t record, float *term, struct lum_vec3 from, struct lum_vec3 target)
{
    const struct lum_motion *motion = &u->since->motion;
    u->n_boxes++;
    if (!(u->job->cache->key.panes ? lum_motion_meets : lum_motion_met)(motion, from, target))
        return;
    if (u->far.rays.n == LUM_RAY_BATCH)
        trace_far(u);
    push(&u->far, record, term, from, target);
}

/* Algorithm 1, lines 11 to 15. */
static void trace_near(struct update *u)
{
    struct batch *b = &u->near;
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH]; /* nobody asks: with panes there are no such rays */
    if (b->rays.n == 0)
        return;
    trace(u, b, u->movers, occluded, left);
    for (uint32_t r = 0; r < b->rays.n; r++) {
        struct lum_vec3 from = {b->rays.ox[r], b->rays.oy[r], b->rays.oz[r]};
        if (!occluded[r] && *b->term[r] < 0.0f) {
            test_boxes(u, b->record[r], b->term[r], from, lum_v3_add(from, lum_rays_direction(&b->rays, r)));
        } else if (occluded[r] && *b->term[r] > 0.0f) {
            *b->term[r] = -*b->term[r];
            u->changed[b->record[r]] = true;
        }
    }
    u->n_near += b->rays.n;
    b->rays.n = 0;
}

/* The rays of all records to one VPL that did not move. */
static void test_vpl(struct update *u, uint32_t k)
{
    const struct lum_vpl_set *set = &u->job->cache->vpls;
    struct lum_vec3 p = {set->px[k], set->py[k], set->pz[k]}, n = {set->nx[k], set->ny[k], set->nz[k]};
    struct lum_vec3 target = lum_ray_offset(p, n);
    for (uint32_t i = 0; i < u->job->n; i++) {
        const struct lum_cache_record *r = u->job->records[i];
        float *term = &record_of(u, i)->term[k];
        struct lum_vec3 d = lum_v3_sub(p, r->p), from = lum_ray_offset(r->p, r->ng);
        if (*term == 0.0f || lum_dot(d, d) < LUM_VPL_TOUCHING * LUM_VPL_TOUCHING)
            continue;
        if (u->job->cache->key.panes) {
            test_boxes(u, i, term, from, target);
            continue;
        }
        if (!u->movers) {
            if (*term < 0.0f)
                test_boxes(u, i, term, from, target);
            continue;
        }
        if (u->near.rays.n == LUM_RAY_BATCH)
            trace_near(u);
        push(&u->near, i, term, from, target);
    }
}

static bool any_unknown(const struct update *u, uint32_t k)
{
    for (uint32_t i = 0; i < u->job->n; i++)
        if (record_of(u, i)->term[k] == LUM_VPL_UNKNOWN)
            return true;
    return false;
}

/* A VPL that is black asks no ray: what is not known of it any more is asked when it shines again. */
static void forget_vpl(struct update *u, uint32_t k)
{
    for (uint32_t i = 0; i < u->job->n; i++)
        record_of(u, i)->term[k] = LUM_VPL_UNKNOWN;
}

static void retrace(struct update *u, const uint32_t *slots, uint32_t n)
{
    if (n == 0)
        return;
    add(&u->state->vpl_rays, lum_instant_trace(u->job, slots, n));
    memset(u->changed, true, sizeof u->changed);
}

static void update_terms(struct update *u)
{
    const struct lum_vpl_set *set = &u->job->cache->vpls;
    bool moving = u->since->motion.n > 0;
    uint32_t slots[LUM_RAY_BATCH], n = 0;
    for (uint32_t k = 0; k < set->n; k++) {
        bool moved = bit(u->since->vpls, k);
        if (!shines(set, k)) {
            if (moved || moving)
                forget_vpl(u, k);
        } else if (moved || any_unknown(u, k)) {
            if (n == LUM_RAY_BATCH) {
                retrace(u, slots, n);
                n = 0;
            }
            slots[n++] = k;
        } else if (moving) {
            test_vpl(u, k);
        }
    }
    retrace(u, slots, n);
    trace_near(u);
    trace_far(u);
}

/* ---- which change a record is behind with ---- */

/* What moved since an epoch, where it is now; the whole scene, which gives the same answer, when nobody knows which
 * objects these are, or memory is short. NULL: it is all gone. */
static const struct lum_accel_top *movers_of(const struct lum_snapshot *s, const struct lum_motion *motion,
                                             _Atomic(struct lum_accel_top *) *movers)
{
    struct lum_accel_top *top = atomic_load_explicit(movers, memory_order_acquire), *none = NULL;
    uint32_t objects[LUM_MOTION_MAX], n = 0;
    if (lum_motion_is_merged(motion))
        return s->top;
    for (uint32_t i = 0; i < motion->n; i++)
        if (motion->movers[i].now != LUM_NO_OBJECT)
            objects[n++] = motion->movers[i].now;
    if (top || n == 0)
        return top;
    if (lum_accel_top_create_part(s->top, objects, n, &top, NULL) != LUM_OK)
        return s->top;
    if (atomic_compare_exchange_strong_explicit(movers, &none, top, memory_order_acq_rel, memory_order_acquire))
        return top;
    lum_accel_top_unref(top); /* another worker was first */
    return none;
}

static bool where_something_was(const struct lum_motion *motion, struct lum_vec3 p)
{
    for (uint32_t i = 0; i < motion->n; i++) {
        const struct lum_mover *m = &motion->movers[i];
        if (lum_bounds_hold(&m->old_box, p))
            return true;
    }
    return false;
}

static void remove_record(const struct lum_cache_job *job, struct lum_cache_record *record, _Atomic uint64_t *why)
{
    if (!lum_store_remove(job->cache->store, job->worker, record))
        return;
    add(&job->cache->removed, 1);
    add(why, 1);
}

/* Algorithm 1, line 3. Returns how many stay. */
static uint32_t remove_invalid(const struct lum_cache_job *job, const struct lum_since *since,
                               struct lum_cache_record **stay)
{
    struct state *state = job->cache->kind_state;
    uint32_t n = 0;
    for (uint32_t i = 0; i < job->n; i++)
        if (!since || since->motion.everything)
            remove_record(job, job->records[i], &state->aged);
        else if (where_something_was(&since->motion, job->records[i]->p))
            remove_record(job, job->records[i], &state->removed);
        else
            stay[n++] = job->records[i];
    return n;
}

/* All records of the job are of one epoch. */
static void update_group(const struct lum_cache_job *job, uint64_t epoch)
{
    struct state *state = job->cache->kind_state;
    const struct lum_since *since = lum_since(state->ring, epoch);
    struct lum_cache_record *stay[LUM_INSTANT_GROUP];
    struct lum_cache_job rest = *job;
    rest.records = stay;
    rest.n = remove_invalid(job, since, stay);
    if (rest.n == 0)
        return;
    struct update u = {.job = &rest, .state = state, .since = since};
    u.movers = movers_of(job->snapshot, &since->motion, &state->movers[epoch % LUM_SINCE_EPOCHS]);
    update_terms(&u);
    for (uint32_t i = 0; i < rest.n; i++)
        if (u.changed[i] || epoch < state->relit)
            lum_instant_sum(&rest, record_of(&u, i));
    add(&state->mover_rays, u.n_near);
    add(&state->box_tests, u.n_boxes);
    add(&state->scene_rays, u.n_far);
}

void lum_instant_refresh(const struct lum_cache_job *job)
{
    struct lum_cache_job group = *job;
    for (uint32_t first = 0; first < job->n; first += group.n) {
        uint64_t epoch = job->records[first]->epoch;
        group.records = job->records + first;
        for (group.n = 1; group.n < LUM_INSTANT_GROUP && first + group.n < job->n; group.n++)
            if (group.records[group.n]->epoch != epoch)
                break;
        if (epoch != job->cache->epoch)
            update_group(&group, epoch);
        for (uint32_t i = 0; i < group.n; i++)
            group.records[i]->epoch = job->cache->epoch;
    }
}

/* ---- noting a change ---- */

/* True when the same VPLs give another light than at the last change. Remembers what they give now. */
static bool note_light(struct state *state, const struct lum_cache *cache, const struct lum_snapshot *s)
{
    bool relit = cache->key.media && state->medium != s->versions.medium;
    size_t bytes = state->n_vpls * sizeof(float);
    for (int c = 0; c < 3; c++) {
        float *before = state->flux + (size_t)c * state->n_vpls;
        relit |= memcmp(before, cache->vpls.flux[c], bytes) != 0;
        memcpy(before, cache->vpls.flux[c], bytes);
    }
    state->medium = s->versions.medium;
    return relit;
}

/* ---- going over all records ---- */

struct sweep {
    struct lum_cache *cache;
    const struct lum_snapshot *snapshot;
    struct lum_counters *counters; /* by worker */
};

static void update_job(void *ctx, uint32_t job, uint32_t worker)
{
    const struct sweep *sweep = ctx;
    struct lum_cache_record *records[LUM_INSTANT_GROUP], *record;
    struct lum_cache_job group = {.cache = sweep->cache,
                                  .snapshot = sweep->snapshot,
                                  .records = records,
                                  .worker = worker,
                                  .counters = &sweep->counters[worker]};
    for (uint32_t i = 0; i < LUM_INSTANT_GROUP; i++)
        if ((record = lum_store_at(sweep->cache->store, job * LUM_INSTANT_GROUP + i)) != NULL)
            records[group.n++] = record;
    lum_instant_refresh(&group);
}

/* Algorithm 1 as it is printed: line 2, for each record. */
static bool update_all(struct lum_cache *cache, const struct lum_cache_update *update)
{
    uint32_t n_jobs = (lum_store_limit(cache->store) + LUM_INSTANT_GROUP - 1) / LUM_INSTANT_GROUP;
    uint32_t n_workers = update->pool ? lum_pool_size(update->pool) : 1;
    struct sweep sweep = {cache, update->snapshot, lum_calloc(n_workers, sizeof *sweep.counters)};
    if (!sweep.counters)
        return false;
    if (update->pool)
        lum_pool_run(update->pool, n_jobs, update_job, &sweep, NULL);
    else
        for (uint32_t i = 0; i < n_jobs; i++)
            update_job(&sweep, i, 0);
    for (uint32_t i = 0; i < n_workers && update->counters; i++) {
        update->counters->rays[LUM_RAY_INDIRECT_DIFFUSE] += sweep.counters[i].rays[LUM_RAY_INDIRECT_DIFFUSE];
        update->counters->bad_rays += sweep.counters[i].bad_rays;
    }
    lum_free(sweep.counters);
    add(&cache->updated, lum_store_count(cache->store));
    return true;
}

/* Records that nobody has looked at for too long make room. */
static void drop_old(struct lum_cache *cache, struct state *state)
{
    struct lum_cache_job job = {.cache = cache};
    uint32_t limit = lum_store_limit(cache->store);
    for (uint32_t i = 0; i < limit; i++) {
        struct lum_cache_record *record = lum_store_at(cache->store, i);
        if (record && cache->epoch - record->epoch > LUM_SINCE_EPOCHS)
            remove_record(&job, record, &state->aged);
    }
}

void lum_instant_change(struct lum_cache *cache, const struct lum_cache_update *update, const struct lum_motion *motion)
{
    struct state *state = state_of(cache);
    if (!state || motion->everything) {
        lum_cache_clear(cache);
        return;
    }
    if (note_light(state, cache, update->snapshot))
        state->relit = cache->epoch;
    forget_movers(state);
    lum_since_add(state->ring, cache->epoch, motion, cache->moved);
    if (cache->immediate && !update_all(cache, update))
        lum_cache_clear(cache);
    else if (cache->epoch % LUM_SINCE_EPOCHS == 0)
        drop_old(cache, state);
}
