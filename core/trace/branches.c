#include "core/trace/branches.h"

#include <math.h>
#include <string.h>

void lum_branches_destroy(struct lum_branches *tiles, uint32_t n)
{
    for (uint32_t t = 0; tiles && t < n; t++)
        lum_free(tiles[t].branches);
    lum_free(tiles);
}

void lum_branches_begin(struct lum_branches *tile)
{
    tile->n = 0;
    tile->whole = true;
    tile->ends = LUM_BOUNDS_EMPTY;
}

static bool grow(struct lum_branches *tile, uint32_t max)
{
    uint32_t capacity = tile->capacity ? 2 * tile->capacity : 64;
    capacity = capacity < max ? capacity : max;
    struct lum_branch *branches = capacity > tile->n ? lum_calloc(capacity, sizeof *branches) : NULL;
    if (!branches)
        return false;
    if (tile->n)
        memcpy(branches, tile->branches, tile->n * sizeof *branches);
    lum_free(tile->branches);
    tile->branches = branches;
    tile->capacity = capacity;
    return true;
}

void lum_branches_add(struct lum_branches *tile, const struct lum_branch *branch, uint32_t max)
{
    tile->whole = tile->whole && (tile->n < tile->capacity || grow(tile, max));
    if (!tile->whole)
        return;
    tile->branches[tile->n++] = *branch;
    if (branch->lit)
        lum_bounds_grow(&tile->ends, branch->to);
    if (branch->lit && branch->box)
        lum_bounds_grow(&tile->ends, branch->from);
}

bool lum_branches_met(const struct lum_branches *tile, const struct lum_motion *motion)
{
    for (uint32_t i = 0; i < tile->n; i++)
        if (!tile->branches[i].box && lum_motion_meets(motion, tile->branches[i].from, tile->branches[i].to))
            return true;
    return !tile->whole;
}

bool lum_branches_light_met(const struct lum_branches *tile, const struct lum_motion *motion,
                            const struct lum_bounds *light)
{
    if (!(tile->ends.lo.x <= tile->ends.hi.x) || !lum_motion_meets_between(motion, &tile->ends, light))
        return false;
    for (uint32_t i = 0; i < tile->n; i++) {
        const struct lum_branch *b = &tile->branches[i];
        struct lum_bounds end = {b->box ? b->from : b->to, b->to};
        if (b->lit && lum_motion_meets_between(motion, &end, light))
            return true;
    }
    return false;
}
