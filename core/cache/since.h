/* What happened since an epoch of a cache, for the last LUM_SINCE_EPOCHS of them: which light paths may have changed
 * for a record that was true then.
 *
 * An object that moved several times counts once, from where it was then to where it is now: what lies in between
 * changed nothing that is still seen. */
#ifndef LUM_CORE_CACHE_SINCE_H
#define LUM_CORE_CACHE_SINCE_H

#include "core/scene/motion.h"
#include "core/vpl/vpl.h"

/* Records that nobody looked at for longer are built anew in place. */
#define LUM_SINCE_EPOCHS 64u

struct lum_since {
    struct lum_motion motion; /* from then to now; everything: too much to tell */
    const uint64_t *vpls;     /* bit by slot: VPLs that moved, appeared or went */
};

struct lum_since_ring;
/* n_vpls: slots. NULL: out of memory. Freed by lum_free. */
struct lum_since_ring *lum_since_create(uint32_t n_vpls);
/* Begins an epoch: from the one before it to this one `motion` happened, and the VPLs in `moved` did. */
void lum_since_add(struct lum_since_ring *ring, uint64_t epoch, const struct lum_motion *motion, const uint64_t *moved);
/* What happened after `epoch`; NULL: it is too long ago, or never was. */
const struct lum_since *lum_since(const struct lum_since_ring *ring, uint64_t epoch);

/* Takes those bits out of inout_bits whose segments, from `from` to the VPL, meet a box of what moved. */
void lum_since_cross_out(const struct lum_since *since, const struct lum_vpl_set *set, struct lum_vec3 from,
                         uint64_t *inout_bits);
/* True when one of n segments from a point on, these ways, meets something that moved, where it was or is. */
bool lum_since_meets_segments(const struct lum_since *since, struct lum_vec3 from, const struct lum_vec3 *ways,
                              uint32_t n);
/* True when a ball meets a box of what moved. */
bool lum_since_meets_ball(const struct lum_since *since, struct lum_vec3 middle, float radius);

#endif
