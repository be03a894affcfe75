/* How slots are shared out: which path of which light, and which of its bounces, fills which slot. Internal to
 * core/vpl.
 *
 * Quasi-Monte Carlo with stable indices. The first half of the slots are first bounces, half of the rest second
 * bounces, and so on for four levels: not chance but the slots end half of the paths at each bounce, and those that go
 * on weigh twice. What is left is all further bounces, each slot one of them, drawn with known probability. Within a
 * level the slots belong to the lights in turn, as many to each as its share of the flux; slot j of a light's run is
 * always the same bounce of the light's path number j, drawn with numbers that depend on the light's id, j and the seed
 * alone. So a VPL only moves when something on its own path does, and no edit of one light moves another's as long as
 * the shares stay. Neighbouring slots come from neighbouring numbers of a low-discrepancy sequence: subsets that take
 * every m-th slot cover all lights and bounces. */
#ifndef LUM_CORE_VPL_SHARE_H
#define LUM_CORE_VPL_SHARE_H

#include "core/base/base.h"
#include "core/light/light.h"
#include "core/vpl/lifted.h"
#include "core/vpl/vpl.h"

/* A light's share of the paths. By index in the light table. */
struct lum_vpl_share {
    char id[LUM_ID_MAX + 1];
    const struct lum_emitter_row *kind;
    double luminance; /* of its power when it was first seen to shine as this kind; 0: it never did, and has no path */
    double below, upto;  /* its part of [0, 1] */
    uint32_t first_path; /* number of its first path among all */
    uint32_t tries; /* paths for each of its slots: of light from afar, which may miss all windows, as many as are asked
                     * for, else half of them */
};

/* Power that a light has now: black when it is off. */
struct lum_rgb lum_light_present_power(const struct lum_light_table *t, uint32_t i);

/* Fills set->shares for the snapshot's lights; those that are in previous keep the luminance they had, if its unit is
 * the same. */
LUM_MUST_USE enum lum_status lum_vpl_share_paths(struct lum_vpl_set *set, const struct lum_vpl_set *previous,
                                                 const struct lum_snapshot *s, struct lum_error *err);
/* True when every light that shines has paths. The light table has the same shape as when the shares were made. */
bool lum_vpl_shares_serve(const struct lum_vpl_set *set, const struct lum_snapshot *s);

/* True when light from afar has paths. */
bool lum_vpl_comes_from_afar(const struct lum_vpl_set *set);

/* Fills the sky's slots (sky.c). */
void lum_vpl_place_sky(struct lum_vpl_set *set, const struct lum_snapshot *s);
/* True when the sky that shines, if one does, is the one that has the slots. */
bool lum_vpl_sky_serves(const struct lum_vpl_set *set, const struct lum_snapshot *s);

/* Four bounces by halves; a sixteenth of the slots is left for all further ones. */
#define LUM_VPL_LEVELS 5u

struct lum_vpl_plan {
    const struct lum_vpl_share *shares;
    uint32_t n_shares, n_paths, seed, n_levels;
    uint32_t max_bounces;
    uint32_t tries;                                                /* at most, of a share */
    uint32_t n;                                                    /* slots */
    uint32_t level_first[LUM_VPL_LEVELS], level_n[LUM_VPL_LEVELS]; /* slots of each level */
    double offset[LUM_VPL_LEVELS];                                 /* in [0, 1), by seed */
};
/* Numbers the paths: sets first_path and tries of the set's shares, which the plan borrows. */
void lum_vpl_plan_init(struct lum_vpl_plan *ret_plan, struct lum_vpl_set *set);

/* Path `index` of plan->n_paths: its light, its number among the light's, the last bounce that it has a slot for, and a
 * number that tells the light from others by its id. */
void lum_vpl_plan_path(const struct lum_vpl_plan *plan, uint32_t index, uint32_t *ret_share, uint32_t *ret_number,
                       uint32_t *ret_last, uint32_t *ret_salt);
/* Slots of a level that belong to a share: so many, from *ret_first. */
uint32_t lum_vpl_plan_run(const struct lum_vpl_plan *plan, uint32_t share, uint32_t level, uint32_t *ret_first);
/* Slot of a bounce (0: the first) of a path, and what its flux is multiplied by; LUM_NO_OBJECT when it has none. Try t
 * of slot k is t * plan->n + k. */
uint32_t lum_vpl_plan_slot(const struct lum_vpl_plan *plan, uint32_t share, uint32_t number, uint32_t bounce,
                           float *ret_weight);

/* lum_vpl_set.spacing; at most limit. */
float lum_vpl_measure_spacing(const struct lum_vpl_set *set, float limit);

/* Fills in lum_vpl_set.radius, and lost, beside and gain by what is kept of each slot (NULL: they stay 0); at most a
 * tenth of scene_radius, and of what is more important than what is around it at most four times that. */
LUM_MUST_USE enum lum_status lum_vpl_measure_radii(struct lum_vpl_set *set, const struct lum_vpl_kept *kept,
                                                   const struct lum_vpl_request *rq, struct lum_error *err);

/* Fills the slots of set for bounced light from the tries in candidates (choose.c), and ret_kept, of as many, with
 * means. Rays are added as LUM_RAY_VPL. */
LUM_MUST_USE enum lum_status lum_vpl_choose(struct lum_vpl_set *set, const struct lum_vpl_set *candidates,
                                            const struct lum_vpl_plan *plan, const struct lum_vpl_request *rq,
                                            struct lum_vpl_kept *ret_kept, struct lum_error *err);

/* The plan's paths, traced into the set's slots. */
LUM_MUST_USE enum lum_status lum_vpl_emit(const struct lum_vpl_request *rq, const struct lum_vpl_plan *plan,
                                          struct lum_vpl_set *set, struct lum_error *err);

/* Runs jobs over the request's pool, if there is one, and adds up in its counters what they count. */
LUM_MUST_USE enum lum_status lum_vpl_run(const struct lum_vpl_request *rq, uint32_t n_jobs,
                                         void (*run)(void *ctx, uint32_t job, struct lum_counters *counters), void *ctx,
                                         struct lum_error *err);

#endif
