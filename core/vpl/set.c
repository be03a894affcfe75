/* The set of VPLs, and how it is brought up to date. */
#include <string.h>

#include "core/light/light.h"
#include "core/math/lanes.h"
#include "core/scene/motion.h"
#include "core/trace/stale.h"
#include "core/vpl/portals.h"
#include "core/vpl/share.h"

/* Rays that are kept for the next update, at most, in 18 MB: sets of `live` ask 20 to 75 thousand. With twice as many
 * as that all find room, whoever comes first. */
#define KNOWN_RAYS (1u << 18)

static uint32_t padded(uint32_t n)
{
    return (n + LUM_LANES - 1) / LUM_LANES * LUM_LANES;
}

static enum lum_status alloc_arrays(struct lum_vpl_set *set, struct lum_error *err)
{
    float **floats[] = {&set->px,      &set->py,           &set->pz,           &set->nx,           &set->ny,
                        &set->nz,      &set->flux_unit[0], &set->flux_unit[1], &set->flux_unit[2], &set->flux[0],
                        &set->flux[1], &set->flux[2],      &set->importance,   &set->radius,       &set->lobe,
                        &set->wx,      &set->wy,           &set->wz,           &set->alpha,        &set->f0,
                        &set->f90,     &set->lost,         &set->beside,       &set->gain};
    uint32_t **indices[] = {&set->light, &set->object, &set->prim};
    size_t n = padded(set->n), n_floats = LUM_ARRAY_LEN(floats), n_indices = LUM_ARRAY_LEN(indices);
    char *memory = lum_calloc(1, n * (n_floats * sizeof(float) + n_indices * sizeof(uint32_t)) +
                                     lum_vpl_words(set->n) * sizeof *set->moved);
    if (!memory)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u virtual point lights", set->n);
    set->memory = memory;
    for (size_t i = 0; i < n_floats; i++, memory += n * sizeof(float))
        *floats[i] = (float *)(void *)memory;
    for (size_t i = 0; i < n_indices; i++, memory += n * sizeof(uint32_t)) {
        *indices[i] = (uint32_t *)(void *)memory;
        memset(memory, 0xff, n * sizeof(uint32_t)); /* LUM_NO_OBJECT */
    }
    set->moved = (uint64_t *)(void *)memory;
    return LUM_OK;
}

void lum_vpl_finish(struct lum_vpl_set *set)
{
    lum_known_rays_destroy(set->known);
    lum_free(set->memory);
    lum_free(set->shares);
    *set = (struct lum_vpl_set){0};
}

void lum_vpl_forget_rays(struct lum_vpl_set *set)
{
    lum_known_rays_destroy(set->known);
    set->known = NULL;
}

/* Multiplies by the powers of the snapshot's lights. */
static void apply_power(struct lum_vpl_set *set, const struct lum_snapshot *s)
{
    set->n_lit = 0;
    for (uint32_t i = 0; i < set->n; i++) {
        if (set->light[i] == LUM_NO_OBJECT)
            continue;
        struct lum_rgb power = lum_light_present_power(&s->lights, set->light[i]);
        set->flux[0][i] = set->flux_unit[0][i] * power.r;
        set->flux[1][i] = set->flux_unit[1][i] * power.g;
        set->flux[2][i] = set->flux_unit[2][i] * power.b;
        bool lit = set->flux[0][i] > 0.0f || set->flux[1][i] > 0.0f || set->flux[2][i] > 0.0f;
        set->n_lit += lit && i < set->n_bounced;
    }
    set->versions.light_power = s->versions.light_power;
}

/* Paths that meet the same things as before end at the very same place, bit by bit. */
static bool same_place(const struct lum_vpl_set *a, const struct lum_vpl_set *b, uint32_t i)
{
    if ((a->light[i] == LUM_NO_OBJECT) != (b->light[i] == LUM_NO_OBJECT))
        return false;
    return a->px[i] == b->px[i] && a->py[i] == b->py[i] && a->pz[i] == b->pz[i] && a->nx[i] == b->nx[i] &&
           a->ny[i] == b->ny[i] && a->nz[i] == b->nz[i] && a->importance[i] == b->importance[i];
}

uint64_t lum_vpl_hash_places(const struct lum_vpl_set *set)
{
    const float *arrays[] = {set->px, set->py, set->pz, set->nx, set->ny, set->nz};
    uint64_t h = set->n_bounced;
    for (size_t k = 0; k < LUM_ARRAY_LEN(arrays); k++)
        for (uint32_t i = 0; i < set->n_bounced; i++) {
            uint32_t bits;
            memcpy(&bits, &arrays[k][i], sizeof bits);
            h = (h ^ bits) * 0x9e3779b97f4a7c15u;
            h ^= h >> 32;
        }
    return h | 1;
}

/* Fills in n_moved and moved. */
static void find_moved(struct lum_vpl_set *now, const struct lum_vpl_set *before)
{
    uint32_t common = before->n < now->n ? before->n : now->n;
    for (uint32_t i = 0; i < now->n; i++) {
        bool moved = i < common ? !same_place(before, now, i) : now->light[i] != LUM_NO_OBJECT;
        now->moved[i / 64] |= (uint64_t)moved << (i % 64);
        now->n_moved += moved;
    }
    for (uint32_t i = common; i < before->n; i++)
        now->n_moved += before->light[i] != LUM_NO_OBJECT;
}

static void forget_moved(struct lum_vpl_set *set)
{
    if (set->n_moved > 0)
        memset(set->moved, 0, lum_vpl_words(set->n) * sizeof *set->moved);
    set->n_moved = 0;
}

static uint32_t tries_of(const struct lum_vpl_request *rq)
{
    uint32_t fit = LUM_VPL_MAX / rq->n, tries = rq->tries > 0 ? rq->tries : 1;
    return tries < fit ? tries : fit;
}

/* Traces the paths, and fills the slots for bounced light; where there are tries to choose from, ret_kept, too. */
static enum lum_status fill(struct lum_vpl_set *set, const struct lum_vpl_request *rq, struct lum_vpl_kept *ret_kept,
                            struct lum_error *err)
{
    enum lum_status status = LUM_OK;
    if (set->tries > 1 && lum_vpl_comes_from_afar(set))
        status = lum_vpl_find_portals(&set->portals, rq, err);
    if (status != LUM_OK)
        return status;
    struct lum_vpl_plan plan;
    lum_vpl_plan_init(&plan, set);
    if (set->tries == 1)
        return lum_vpl_emit(rq, &plan, set, err);
    struct lum_vpl_set candidates = {.n = set->n_bounced * set->tries,
                                     .lobes_off = set->lobes_off,
                                     .gloss = set->gloss,
                                     .scatters = set->scatters,
                                     .versions = set->versions,
                                     .portals = set->portals};
    status = alloc_arrays(&candidates, err);
    if (status == LUM_OK)
        status = lum_vpl_emit(rq, &plan, &candidates, err);
    if (status == LUM_OK)
        status = lum_vpl_choose(set, &candidates, &plan, rq, ret_kept, err);
    lum_vpl_finish(&candidates);
    return status;
}

static enum lum_status trace_set(struct lum_vpl_set *ret_set, const struct lum_vpl_set *previous,
                                 const struct lum_vpl_request *rq, struct lum_error *err)
{
    const struct lum_snapshot *s = rq->snapshot;
    struct lum_vpl_set set = {.n = lum_vpl_slots(rq->n, rq->n_sky),
                              .n_bounced = rq->n,
                              .n_sky = rq->n_sky,
                              .max_bounces = rq->max_bounces,
                              .seed = rq->seed,
                              .tries = tries_of(rq),
                              .lobes_off = rq->lobes_off,
                              .gloss = rq->gloss,
                              .scatters = rq->scatters,
                              .versions = lum_versions_seen(s, rq->media),
                              .valid = true};
    struct lum_vpl_kept *kept = set.tries > 1 ? lum_calloc(rq->n, sizeof *kept) : NULL;
    enum lum_status status = LUM_OK;
    if (set.tries > 1 && !kept)
        status = lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u slots", rq->n);
    if (status == LUM_OK)
        status = alloc_arrays(&set, err);
    if (status == LUM_OK)
        status = lum_vpl_share_paths(&set, previous, s, err);
    if (status == LUM_OK)
        status = fill(&set, rq, kept, err);
    if (status != LUM_OK)
        goto out;
    lum_vpl_place_sky(&set, s);
    apply_power(&set, s);
    set.spacing = lum_vpl_measure_spacing(&set, s->lights.scene_radius);
    status = lum_vpl_measure_radii(&set, kept, rq, err);
    if (status != LUM_OK)
        goto out;
    find_moved(&set, previous);
    *ret_set = set;
out:
    lum_free(kept);
    if (status != LUM_OK)
        lum_vpl_finish(&set);
    return status;
}

/* Where there are tries to choose from, and somebody tells what moves, rays are kept from update to update: of a table
 * that is dragged through a room few meet its box. Without memory for it they are not. */
static void know_rays(struct lum_vpl_request *rq, struct lum_vpl_set *set)
{
    bool sure = rq->since && !rq->since->everything && lum_motion_keeps_numbers(rq->since) && set->valid &&
                set->versions.geometry == rq->since_geometry;
    struct lum_error unused;
    if (!sure)
        lum_known_rays_forget(set->known);
    if (!rq->since || tries_of(rq) == 1)
        return;
    if (!set->known && lum_known_rays_create(KNOWN_RAYS, &set->known, &unused) != LUM_OK)
        return;
    lum_known_rays_begin(set->known);
    rq->known = (struct lum_known){set->known, rq->since};
}

enum lum_status lum_vpl_update(struct lum_vpl_set *set, const struct lum_vpl_request *rq, struct lum_error *err)
{
    const struct lum_snapshot *s = rq->snapshot;
    if (rq->n < 1 || rq->n > LUM_VPL_MAX)
        return lum_fail(err, LUM_ERR_LIMIT, "vpls", "1 to %u virtual point lights, not %u", LUM_VPL_MAX, rq->n);
    struct lum_versions now = lum_versions_seen(s, rq->media);
    uint32_t edits = lum_edits_of_versions(&set->versions, &now);
    bool same = set->valid && set->n_bounced == rq->n && set->n_sky == rq->n_sky &&
                set->max_bounces == rq->max_bounces && set->seed == rq->seed && set->tries == tries_of(rq) &&
                set->lobes_off == rq->lobes_off && set->gloss == rq->gloss && set->scatters == rq->scatters &&
                !lum_is_stale(edits, LUM_PRODUCT_VPL_PATHS);
    bool same_power = !lum_is_stale(edits, LUM_PRODUCT_VPL_FLUX);
    if (same && (same_power || (lum_vpl_shares_serve(set, s) && lum_vpl_sky_serves(set, s)))) {
        if (!same_power)
            apply_power(set, s);
        forget_moved(set);
        return LUM_OK;
    }
    struct lum_vpl_set next;
    struct lum_vpl_request with_known = *rq;
    know_rays(&with_known, set);
    enum lum_status status = trace_set(&next, set, &with_known, err);
    if (status != LUM_OK) { /* they may have been asked of this snapshot */
        lum_known_rays_forget(set->known);
        return status;
    }
    next.known = set->known;
    set->known = NULL;
    lum_vpl_finish(set);
    *set = next;
    return LUM_OK;
}
