/* What moved between two snapshots: which light paths an edit may have changed.
 *
 * A segment of a light path can only have changed if it meets the box that a changed object had before, or has now. */
#ifndef LUM_CORE_SCENE_MOTION_H
#define LUM_CORE_SCENE_MOTION_H

#include "core/scene/snapshot.h"

/* Movers that are told apart. Of more, those whose boxes grow least by it are merged: each still lies within the boxes
 * of one, which meet more than they would alone. */
#define LUM_MOTION_MAX 64u

struct lum_mover {
    uint32_t n_objects; /* 1; more: they were merged, and the boxes are around all of them. Then the following three say
                         * nothing */
    uint64_t object;    /* lum_hash64_text of its id */
    uint32_t before, now; /* index of its instance (or n_instances + index of its shape) in either snapshot;
                           * LUM_NO_OBJECT: not there */
    struct lum_bounds old_box, new_box; /* empty: it was, or is, not there */
};

struct lum_motion {
    bool everything; /* cannot be told apart: another scene, or placed anew */
    bool renumbers;  /* objects came or went: what stays may have another number */
    uint32_t n;
    struct lum_bounds around; /* all boxes of the movers; empty: there are none */
    struct lum_mover movers[LUM_MOTION_MAX];
};

/* Objects and emitter shapes that were moved, deformed, added or removed, or whose surface lets other rays through
 * (alpha). What the camera alone sees does not count. Boxes are padded by 2 LUM_RAY_OFFSET: one for where shadow rays
 * start, one for the rounding of corners, points and slab tests. So a shadow ray between two surface points can only
 * have changed if lum_motion_meets says so of the segment between the points. O(objects). Thread: any. */
void lum_motion_between(const struct lum_snapshot *before, const struct lum_snapshot *now,
                        struct lum_motion *ret_motion);

/* Adds one more, of `n_objects`, merging where there are too many. */
void lum_motion_add(struct lum_motion *motion, const struct lum_mover *mover);
bool lum_motion_is_merged(const struct lum_motion *motion); /* any of its movers is */

/* True when the object of this hash is among the movers that were not merged. */
bool lum_motion_has(const struct lum_motion *motion, uint64_t object);
/* True when the object of this number and box, now, is among the movers; perhaps also where it lies within merged ones.
 */
bool lum_motion_moves(const struct lum_motion *motion, uint32_t object, const struct lum_bounds *box);
/* True when what lay on that object, at p, was carried along; perhaps also where p was within the box of merged movers.
 */
bool lum_motion_carries(const struct lum_motion *motion, uint64_t object, struct lum_vec3 p);

/* The box around all movers anew, after one of them was altered. */
void lum_motion_enclose(struct lum_motion *motion);

/* True when the segment from a to b meets a box where something was, or is. Never false where it does meet one. */
bool lum_motion_meets(const struct lum_motion *motion, struct lum_vec3 a, struct lum_vec3 b);
/* The same of all segments that begin in one box and end in another. Neither is empty. */
bool lum_motion_meets_between(const struct lum_motion *motion, const struct lum_bounds *a, const struct lum_bounds *b);
/* The same, of the boxes where something was alone. */
bool lum_motion_met(const struct lum_motion *motion, struct lum_vec3 a, struct lum_vec3 b);
/* Objects that are in both snapshots have the same numbers in both, and there are no others. */
bool lum_motion_keeps_numbers(const struct lum_motion *motion);

/* The box that a light shines from; of one from afar, around all points that shadow rays to it go to. False: it has
 * none: an environment. */
bool lum_light_bounds(const struct lum_snapshot *s, const struct lum_light *light, struct lum_bounds *ret_bounds);

#endif
