/* What mirrors and glass show of indirect light, kept so that a dimmed lamp is another sum and no ray: for each vertex
 * behind a pixel and each VPL that it gathers from, the bounded geometry term and whether it is hidden
 * (lum_gather.terms). */
#ifndef LUM_CORE_EFFECT_SPECULAR_ECHO_H
#define LUM_CORE_EFFECT_SPECULAR_ECHO_H

#include "core/vpl/vpl.h"

/* Of a view, and as much again to grow: 1440 x 900 with two mirror vertices behind every pixel, or one with panes.
 * Tiles that show more are traced again. */
#define LUM_ECHO_BYTES ((size_t)256 << 20)

struct lum_echo_point {
    uint32_t pixel;
    struct lum_rgb weight; /* of its irradiance, in the pixel */
};
/* Points that gather from the same slots: every step-th, from `first`. */
struct lum_echo_job {
    uint32_t first, step, n_slots, n_points, first_point;
    bool far;          /* far sides of sheets that the eye sees: what they weigh comes after the filter */
    size_t first_term; /* n_slots rows of n_points */
};
/* Of a ray batch tile. */
struct lum_echo {
    struct lum_echo_point *points;
    struct lum_echo_job *jobs;
    float *terms;
    uint32_t *left; /* by term: what panes leave (lum_transmittance_pack); NULL: there are none */
    uint32_t n_points, n_jobs;
    size_t n_terms, points_cap, jobs_cap, terms_cap, left_cap;
    uint64_t hash; /* of the VPLs' places */
    bool panes;
    bool whole; /* nothing was left out, and it belongs to what the tile shows but for the powers of lights */
};
/* Of all tiles. */
void lum_echo_destroy(struct lum_echo *tiles, uint32_t n);

/* Hash of where the VPLs are and how their terms are bounded; never 0. */
uint64_t lum_echo_hash(const struct lum_vpl_set *set, float spacing);

/* The tile is traced anew, in a scene with panes or without. Thread, of these three: the worker that has it. */
void lum_echo_begin(struct lum_echo *e, uint64_t hash, bool panes);
/* Room for a job, whose terms, and with panes left, are to be filled in: those of the last job in e->jobs. False: there
 * is none, and the tile is not whole. max_bytes: of a tile. */
bool lum_echo_add(struct lum_echo *e, const struct lum_echo_job *job, const struct lum_echo_point *points,
                  size_t max_bytes);
/* False: a VPL shines now of which nobody knows who sees it. */
bool lum_echo_known(const struct lum_echo *e, const struct lum_vpl_set *set);
/* Irradiance of the points of a job, by the VPLs' present flux; what is not known counts as hidden. */
void lum_echo_sum(const struct lum_echo *e, uint32_t job, const struct lum_vpl_set *set,
                  struct lum_rgb *ret_irradiance);

#endif
