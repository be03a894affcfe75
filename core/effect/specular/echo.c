#include "core/effect/specular/echo.h"

#include <string.h>

#include "core/accel/trace.h"
#include "core/math/color.h"
#include "core/vpl/gather.h"

void lum_echo_destroy(struct lum_echo *tiles, uint32_t n)
{
    for (uint32_t t = 0; tiles && t < n; t++) {
        lum_free(tiles[t].points);
        lum_free(tiles[t].jobs);
        lum_free(tiles[t].terms);
        lum_free(tiles[t].left);
    }
    lum_free(tiles);
}

uint64_t lum_echo_hash(const struct lum_vpl_set *set, float spacing)
{
    uint32_t bits;
    memcpy(&bits, &spacing, sizeof bits);
    return (lum_vpl_hash_places(set) ^ (uint64_t)bits << 32) | 1;
}

void lum_echo_begin(struct lum_echo *e, uint64_t hash, bool panes)
{
    e->n_points = e->n_jobs = 0;
    e->n_terms = 0;
    e->hash = hash;
    e->panes = panes;
    e->whole = true;
}

/* The array with room for n more elements after `used`, maybe elsewhere; NULL: memory is short, and it is as it was. */
static void *grown(void *array, size_t used, size_t n, size_t size, size_t *inout_cap)
{
    if (used + n <= *inout_cap)
        return array;
    size_t cap = 2 * *inout_cap > used + n ? 2 * *inout_cap : used + n;
    void *wider = lum_calloc(cap, size);
    if (!wider)
        return NULL;
    if (used)
        memcpy(wider, array, used * size);
    lum_free(array);
    *inout_cap = cap;
    return wider;
}

static bool reserve(struct lum_echo *e, const struct lum_echo_job *job, size_t n_terms)
{
    void *points = grown(e->points, e->n_points, job->n_points, sizeof *e->points, &e->points_cap);
    e->points = points ? points : e->points;
    void *jobs = grown(e->jobs, e->n_jobs, 1, sizeof *e->jobs, &e->jobs_cap);
    e->jobs = jobs ? jobs : e->jobs;
    void *terms = grown(e->terms, e->n_terms, n_terms, sizeof *e->terms, &e->terms_cap);
    e->terms = terms ? terms : e->terms;
    if (!e->panes)
        return points && jobs && terms;
    void *left = grown(e->left, e->n_terms, n_terms, sizeof *e->left, &e->left_cap);
    e->left = left ? left : e->left;
    return points && jobs && terms && left;
}

bool lum_echo_add(struct lum_echo *e, const struct lum_echo_job *job, const struct lum_echo_point *points,
                  size_t max_bytes)
{
    size_t n = (size_t)job->n_slots * job->n_points, of_term = sizeof *e->terms + (e->panes ? sizeof *e->left : 0);
    size_t bytes = (e->n_terms + n) * of_term + (e->n_points + job->n_points) * sizeof *e->points;
    e->whole = e->whole && bytes <= max_bytes && reserve(e, job, n);
    if (!e->whole)
        return false;
    struct lum_echo_job *own = &e->jobs[e->n_jobs++];
    *own = *job;
    own->first_point = e->n_points;
    own->first_term = e->n_terms;
    memcpy(e->points + e->n_points, points, job->n_points * sizeof *points);
    e->n_points += job->n_points;
    e->n_terms += n;
    return true;
}

static struct lum_rgb radiance_of(const struct lum_vpl_set *set, uint32_t slot)
{
    return lum_rgb_scale(lum_rgb(set->flux[0][slot], set->flux[1][slot], set->flux[2][slot]), LUM_INV_PI);
}

static const float *row_of(const struct lum_echo *e, const struct lum_echo_job *job, uint32_t j)
{
    return e->terms + job->first_term + (size_t)j * job->n_points;
}

/* A VPL that was black is unknown to all points of a job, since no ray was asked for it. */
bool lum_echo_known(const struct lum_echo *e, const struct lum_vpl_set *set)
{
    for (uint32_t k = 0; k < e->n_jobs; k++) {
        const struct lum_echo_job *job = &e->jobs[k];
        for (uint32_t j = 0; j < job->n_slots; j++)
            if (row_of(e, job, j)[0] == LUM_VPL_UNKNOWN && !lum_rgb_black(radiance_of(set, job->first + j * job->step)))
                return false;
    }
    return true;
}

void lum_echo_sum(const struct lum_echo *e, uint32_t k, const struct lum_vpl_set *set, struct lum_rgb *ret)
{
    const struct lum_echo_job *job = &e->jobs[k];
    double sum[LUM_RAY_BATCH][3] = {{0}};
    for (uint32_t j = 0; j < job->n_slots; j++) {
        uint32_t slot = job->first + j * job->step;
        const float *row = row_of(e, job, j);
        struct lum_rgb radiance = radiance_of(set, slot);
        if (lum_rgb_black(radiance))
            continue;
        for (uint32_t i = 0; i < job->n_points; i++) {
            struct lum_rgb value = lum_rgb_scale(radiance, lum_max(row[i], 0.0f));
            if (e->panes)
                value = lum_rgb_mul(value,
                                    lum_transmittance_unpack(e->left[job->first_term + (size_t)j * job->n_points + i]));
            sum[i][0] += (double)value.r;
            sum[i][1] += (double)value.g;
            sum[i][2] += (double)value.b;
        }
    }
    for (uint32_t i = 0; i < job->n_points; i++)
        ret[i] = lum_rgb((float)sum[i][0], (float)sum[i][1], (float)sum[i][2]);
}
