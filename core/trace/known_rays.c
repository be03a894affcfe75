/* Lock-free. Entries that were there when asking began are read by all, and of them only the stamp is written, by
 * whoever asks: the same number. New ones are claimed by a counter, written by who claimed them, and read by nobody
 * until the workers have been joined, which orders that; slots of the table are claimed by swapping an entry's number
 * in for a 0. Two who ask the same new ray at once may both keep it, alike. */
#include "core/trace/known_rays.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "core/base/base.h"
#include "core/math/sampler.h"
#include "core/scene/motion.h"
#include "core/trace/rays.h"

#define RAYS_MAX (1u << 24)
/* Scene units, of which a scene has about 128. Of a segment as long as that up to the disc of a sun (LUM_FAR) floats do
 * not tell what boxes it meets: of 4000 of width 0.4, 153 not. Below 2^15 they told all. */
#define REACH_MAX 4096.0f

struct ray {
    float o[3], d[3];
};

struct entry {
    struct ray ray;
    float t, u, v, ng[3];
    uint32_t object, prim;
    _Atomic uint32_t asked; /* the time it was asked last */
};

struct lum_known_rays {
    uint32_t n_max, mask;
    uint32_t time;          /* of this asking; 0: none yet */
    uint32_t n_before;      /* entries that were there when it began */
    _Atomic uint32_t n;     /* claimed: may be more than n_max */
    struct entry *entries;  /* n_max */
    _Atomic uint32_t *slot; /* 1 + number of an entry, 0: none; mask + 1 of them, at least twice as many as entries */
};

enum lum_status lum_known_rays_create(uint32_t n, struct lum_known_rays **ret, struct lum_error *err)
{
    *ret = NULL;
    if (n < 1 || n > RAYS_MAX)
        return lum_fail(err, LUM_ERR_LIMIT, "", "1 to %u rays are kept, not %u", RAYS_MAX, n);
    uint32_t n_slots = 2;
    while (n_slots < 2 * n)
        n_slots *= 2;
    struct lum_known_rays *known = lum_calloc(1, sizeof *known);
    if (!known)
        goto fail;
    known->n_max = n;
    known->mask = n_slots - 1;
    known->entries = lum_calloc(n, sizeof *known->entries);
    known->slot = lum_calloc(n_slots, sizeof *known->slot);
    if (!known->entries || !known->slot)
        goto fail;
    *ret = known;
    return LUM_OK;
fail:
    lum_known_rays_destroy(known);
    return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory to keep %u rays", n);
}

void lum_known_rays_destroy(struct lum_known_rays *known)
{
    if (!known)
        return;
    lum_free(known->entries);
    lum_free((void *)known->slot);
    lum_free(known);
}

static struct ray ray_at(const struct lum_rays *rays, uint32_t i)
{
    return (struct ray){{rays->ox[i], rays->oy[i], rays->oz[i]}, {rays->dx[i], rays->dy[i], rays->dz[i]}};
}

static uint32_t hash_of(const struct ray *ray)
{
    uint32_t bits[6], h = 0;
    memcpy(bits, ray, sizeof bits);
    for (int i = 0; i < 6; i++)
        h = lum_hash_u32(h ^ bits[i]);
    return h;
}

/* Whether it was asked now, or the time before. */
static bool is_fresh(const struct lum_known_rays *known, const struct entry *e)
{
    uint32_t asked = atomic_load_explicit(&e->asked, memory_order_relaxed);
    return asked == known->time || asked + 1 == known->time;
}

static struct entry *find(const struct lum_known_rays *known, const struct ray *ray, uint32_t hash)
{
    for (uint32_t at = hash & known->mask;; at = (at + 1) & known->mask) { /* half of the slots are empty */
        uint32_t number = atomic_load_explicit(&known->slot[at], memory_order_relaxed);
        if (number == 0)
            return NULL;
        if (number > known->n_before)
            continue;
        struct entry *e = &known->entries[number - 1];
        if (memcmp(&e->ray, ray, sizeof *ray) == 0 && is_fresh(known, e))
            return e;
    }
}

static void put_in_slot(struct lum_known_rays *known, uint32_t number, uint32_t hash)
{
    for (uint32_t at = hash & known->mask;; at = (at + 1) & known->mask) {
        uint32_t empty = 0;
        if (atomic_compare_exchange_strong_explicit(&known->slot[at], &empty, number + 1, memory_order_relaxed,
                                                    memory_order_relaxed))
            return;
    }
}

static void keep(struct lum_known_rays *known, const struct ray *ray, const struct lum_hits *hits, uint32_t i,
                 uint32_t hash)
{
    bool bad = !isfinite(ray->o[0] + ray->o[1] + ray->o[2] + ray->d[0] + ray->d[1] + ray->d[2]);
    if (bad || atomic_load_explicit(&known->n, memory_order_relaxed) >= known->n_max)
        return; /* bad ones are counted each time that they are asked */
    uint32_t number = atomic_fetch_add_explicit(&known->n, 1, memory_order_relaxed);
    if (number >= known->n_max)
        return;
    struct entry *e = &known->entries[number];
    e->ray = *ray;
    e->object = hits->object[i];
    if (e->object != LUM_NO_OBJECT) {
        e->t = hits->t[i], e->u = hits->u[i], e->v = hits->v[i], e->prim = hits->prim[i];
        e->ng[0] = hits->ngx[i], e->ng[1] = hits->ngy[i], e->ng[2] = hits->ngz[i];
    }
    atomic_store_explicit(&e->asked, known->time, memory_order_relaxed);
    put_in_slot(known, number, hash);
}

void lum_known_rays_forget(struct lum_known_rays *known)
{
    if (!known)
        return;
    memset((void *)known->slot, 0, ((size_t)known->mask + 1) * sizeof *known->slot);
    atomic_store_explicit(&known->n, 0, memory_order_relaxed);
    known->n_before = 0;
}

/* Leaves entries that were asked last time. */
static void clear_up(struct lum_known_rays *known, uint32_t n)
{
    uint32_t left = 0;
    lum_known_rays_forget(known);
    for (uint32_t i = 0; i < n; i++) {
        const struct entry *e = &known->entries[i];
        if (atomic_load_explicit(&e->asked, memory_order_relaxed) != known->time)
            continue;
        memmove(&known->entries[left], e, sizeof *e);
        put_in_slot(known, left, hash_of(&known->entries[left].ray));
        left++;
    }
    atomic_store_explicit(&known->n, left, memory_order_relaxed);
}

void lum_known_rays_begin(struct lum_known_rays *known)
{
    uint32_t n = atomic_load_explicit(&known->n, memory_order_relaxed);
    n = n < known->n_max ? n : known->n_max;
    if (n > known->n_max / 2) /* so that there is room for as many again: which ones find none is chance */
        clear_up(known, n);
    n = atomic_load_explicit(&known->n, memory_order_relaxed);
    known->n_before = n < known->n_max ? n : known->n_max;
    known->time++;
}

static void put_at(struct lum_hits *hits, uint32_t i, const struct entry *e)
{
    hits->object[i] = e->object, hits->prim[i] = e->prim;
    hits->t[i] = e->t, hits->u[i] = e->u, hits->v[i] = e->v;
    hits->ngx[i] = e->ng[0], hits->ngy[i] = e->ng[1], hits->ngz[i] = e->ng[2];
}

/* How far from o, of what moved, any of it can be; 0: nothing moved. */
static float reach_of_movers(const struct lum_motion *since, struct lum_vec3 o)
{
    if (since->n == 0)
        return 0.0f;
    struct lum_vec3 size = lum_v3_sub(since->around.hi, since->around.lo);
    struct lum_vec3 centre = lum_v3_mad(since->around.lo, size, 0.5f);
    return lum_length(lum_v3_sub(centre, o)) + 0.5f * lum_length(size);
}

/* Nothing that moved was or is on its way. Of one that met nothing the way ends behind all that moved. */
static bool still_ends_there(const struct lum_known *known, const struct entry *e)
{
    struct lum_vec3 o = lum_v3(e->ray.o[0], e->ray.o[1], e->ray.o[2]),
                    d = lum_v3(e->ray.d[0], e->ray.d[1], e->ray.d[2]);
    float length = lum_length(d), reach = e->t * length;
    if (e->object == LUM_NO_OBJECT)
        reach = reach_of_movers(known->since, o);
    return reach <= REACH_MAX && !lum_motion_meets(known->since, o, lum_v3_mad(o, d, reach / length));
}

/* Of rays that are known ret_hits; the numbers of others in ret_unknown: how many they are. */
static uint32_t recall(const struct lum_known *known, const struct lum_rays *rays, uint32_t *ret_hash,
                       struct lum_hits *ret_hits, uint32_t *ret_unknown)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < rays->n; i++) {
        struct ray ray = ray_at(rays, i);
        ret_hash[i] = hash_of(&ray);
        struct entry *e = known->rays->n_before > 0 ? find(known->rays, &ray, ret_hash[i]) : NULL;
        if (!e || !still_ends_there(known, e)) {
            ret_unknown[n++] = i;
            continue;
        }
        put_at(ret_hits, i, e);
        atomic_store_explicit(&e->asked, known->rays->time, memory_order_relaxed);
    }
    return n;
}

uint32_t lum_known_closest(const struct lum_known *known, const struct lum_trace *trace, const struct lum_rays *rays,
                           struct lum_hits *ret_hits)
{
    if (!known->rays) {
        lum_trace_closest(trace, rays, ret_hits);
        return rays->n;
    }
    uint32_t hash[LUM_RAY_BATCH], unknown[LUM_RAY_BATCH];
    uint32_t n = recall(known, rays, hash, ret_hits, unknown);
    struct lum_rays some;
    struct lum_hits hits;
    some.n = 0;
    ret_hits->white = false;
    for (uint32_t k = 0; k < n; k++) {
        uint32_t i = unknown[k];
        lum_rays_push(&some, lum_v3(rays->ox[i], rays->oy[i], rays->oz[i]), lum_rays_direction(rays, i), INFINITY);
    }
    if (n > 0)
        lum_trace_closest(trace, &some, &hits);
    for (uint32_t k = 0; k < n; k++) {
        uint32_t i = unknown[k];
        struct ray ray = ray_at(rays, i);
        keep(known->rays, &ray, &hits, k, hash[i]);
        ret_hits->object[i] = hits.object[k], ret_hits->prim[i] = hits.prim[k];
        ret_hits->t[i] = hits.t[k], ret_hits->u[i] = hits.u[k], ret_hits->v[i] = hits.v[k];
        ret_hits->ngx[i] = hits.ngx[k], ret_hits->ngy[i] = hits.ngy[k], ret_hits->ngz[i] = hits.ngz[k];
    }
    return n;
}
