/* Summing VPLs at points.
 *
 * VPL by VPL: geometry terms of all points in one vector loop, then the rays of those points that get light from it.
 * Rays are traced when a batch is full, whichever VPLs they belong to; what comes back is added in the order of `slots`
 * for each point, however batches fell. */
#include "core/vpl/gather.h"

#include <string.h>

#include "core/math/color.h"
#include "core/trace/rays.h"
#include "core/vpl/lobe.h"
#include "core/vpl/vpl.h"

/* The points as the loop reads them, and the rays under way. About 35 KiB: lives on a worker's stack. */
struct gathering {
    const struct lum_gather *job;
    bool media; /* there are some, and they count */
    _Alignas(64) float px[LUM_RAY_BATCH];
    float py[LUM_RAY_BATCH], pz[LUM_RAY_BATCH], nx[LUM_RAY_BATCH], ny[LUM_RAY_BATCH], nz[LUM_RAY_BATCH];
    float gx[LUM_RAY_BATCH], gy[LUM_RAY_BATCH], gz[LUM_RAY_BATCH]; /* geometric normals */
    float ox[LUM_RAY_BATCH], oy[LUM_RAY_BATCH], oz[LUM_RAY_BATCH]; /* where rays begin */
    float term[LUM_RAY_BATCH], r2[LUM_RAY_BATCH];                  /* of the VPL at hand */
    uint32_t n_padded;
    struct lum_rays rays;
    uint8_t occluded[LUM_RAY_BATCH], point[LUM_RAY_BATCH]; /* by ray */
    struct lum_rgb value[LUM_RAY_BATCH];                   /* by ray */
    struct lum_rgb left[LUM_RAY_BATCH];                    /* by ray: what panes leave */
    size_t kept[LUM_RAY_BATCH];                            /* by ray: its place in job->terms and job->left */
    float *row;                                            /* of job->terms, of the VPL at hand; NULL: not wanted */
    double sum[LUM_RAY_BATCH][3];
};

/* A VPL that has light to give. */
struct source {
    struct lum_vec3 p, n;
    struct lum_rgb radiance; /* flux / pi, in the mean over directions */
    struct lum_vec3 w;       /* its lobe, as in struct lum_vpl_set */
    float lobe, alpha, f0, f90, radius;
};

static struct source source_of(const struct lum_vpl_set *set, uint32_t i)
{
    struct source s = {
        .p = {set->px[i], set->py[i], set->pz[i]},
        .n = {set->nx[i], set->ny[i], set->nz[i]},
        .radiance = lum_rgb_scale(lum_rgb(set->flux[0][i], set->flux[1][i], set->flux[2][i]), LUM_INV_PI),
    };
    if (!set->gloss)
        return s;
    s.w = lum_v3(set->wx[i], set->wy[i], set->wz[i]);
    s.lobe = set->lobe[i], s.alpha = set->alpha[i], s.f0 = set->f0[i], s.f90 = set->f90[i], s.radius = set->radius[i];
    return s;
}

static void load_points(struct gathering *g)
{
    const struct lum_gather_points *pts = g->job->points;
    uint32_t n = pts->n_points;
    g->n_padded = (n + 15u) & ~15u;
    for (uint32_t i = 0; i < g->n_padded; i++) {
        bool there = i < n; /* points beyond the last face nothing */
        struct lum_vec3 zero = {0.0f, 0.0f, 0.0f};
        struct lum_vec3 p = there ? pts->p[i] : zero, sn = there ? pts->n[i] : zero, gn = there ? pts->ng[i] : zero;
        g->px[i] = p.x, g->py[i] = p.y, g->pz[i] = p.z;
        g->nx[i] = sn.x, g->ny[i] = sn.y, g->nz[i] = sn.z;
        g->gx[i] = gn.x, g->gy[i] = gn.y, g->gz[i] = gn.z;
        p = lum_ray_offset(p, gn);
        g->ox[i] = p.x, g->oy[i] = p.y, g->oz[i] = p.z;
        g->sum[i][0] = g->sum[i][1] = g->sum[i][2] = 0.0;
    }
}

/* ---- geometry terms ---- */

/* cos cos / r^2, 0 where either side faces away, and r^2. The loops have no branch, so that they become vector code. A
 * VPL nearer than LUM_POINT_LIGHT_NEAR counts as that far. */
static void plain_terms(struct gathering *g, const struct source *s)
{
    const float nearest2 = LUM_POINT_LIGHT_NEAR * LUM_POINT_LIGHT_NEAR;
    for (uint32_t i = 0; i < g->n_padded; i++) {
        float dx = s->p.x - g->px[i], dy = s->p.y - g->py[i], dz = s->p.z - g->pz[i];
        float r2 = lum_max(dx * dx + dy * dy + dz * dz, nearest2);
        float at_point = dx * g->nx[i] + dy * g->ny[i] + dz * g->nz[i]; /* r cos */
        float side = dx * g->gx[i] + dy * g->gy[i] + dz * g->gz[i];
        float at_vpl = -(dx * s->n.x + dy * s->n.y + dz * s->n.z);
        float least = lum_min(lum_min(at_point, side), at_vpl);
        float cosines = at_point * at_vpl / (r2 * r2);
        g->r2[i] = r2;
        g->term[i] = least > 0.0f ? cosines : 0.0f;
    }
}

/* Smoothing function f(0.8 d, 1.2 d, r) of equation 6.2.3. */
static void bound_as_thesis(struct gathering *g, float d)
{
    float a = 0.8f * d, width = 1.2f * d - a, per_width = width > 0.0f ? 1.0f / width : 0.0f;
    for (uint32_t i = 0; i < g->n_padded; i++) {
        float x = lum_clamp((sqrtf(g->r2[i]) - a) * per_width, 0.0f, 1.0f);
        g->term[i] *= x * x * (3.0f - 2.0f * x);
    }
}

static void bound_by_clamp(struct gathering *g, float d)
{
    float most = 1.0f / (d * d);
    for (uint32_t i = 0; i < g->n_padded; i++)
        g->term[i] = lum_min(g->term[i], most);
}

static void bound_smoothly(struct gathering *g, float d)
{
    for (uint32_t i = 0; i < g->n_padded; i++)
        g->term[i] *= g->r2[i] / (g->r2[i] + d * d);
}

static void geometry_terms(struct gathering *g, const struct source *s)
{
    const struct lum_bound *bound = &g->job->bound;
    plain_terms(g, s);
    if (!(bound->min_distance > 0.0f))
        return;
    switch (bound->kind) {
    case LUM_BOUND_NONE:
        break;
    case LUM_BOUND_THESIS:
        bound_as_thesis(g, bound->min_distance);
        break;
    case LUM_BOUND_CLAMP:
        bound_by_clamp(g, bound->min_distance);
        break;
    case LUM_BOUND_SMOOTH:
        bound_smoothly(g, bound->min_distance);
        break;
    }
}

static void add_lobes(struct gathering *g, const struct source *s)
{
    for (uint32_t i = 0; i < g->n_padded; i++) {
        float x = g->px[i] - s->p.x, y = g->py[i] - s->p.y, z = g->pz[i] - s->p.z;
        float r2 = g->r2[i], per_r = 1.0f / sqrtf(r2), near = LUM_LOBE_NEAR * s->radius;
        g->term[i] *= lum_vpl_lobe(s->n, s->w, lum_v3(x * per_r, y * per_r, z * per_r),
                                   s->lobe * r2 / (r2 + near * near), s->alpha, s->f0, s->f90);
    }
}

/* ---- rays ---- */

static void add(struct gathering *g, uint32_t point, struct lum_rgb value)
{
    g->sum[point][0] += (double)value.r;
    g->sum[point][1] += (double)value.g;
    g->sum[point][2] += (double)value.b;
}

static void trace_batch(struct gathering *g)
{
    uint32_t n = g->rays.n;
    if (n == 0)
        return;
    struct lum_trace trace = lum_trace_of_light(g->job->snapshot, g->job->counters, g->job->panes);
    lum_trace_light(&trace, &g->rays, g->occluded, g->left);
    g->job->counters->rays[LUM_RAY_INDIRECT_DIFFUSE] += n;
    for (uint32_t r = 0; r < n; r++)
        if (!g->occluded[r])
            add(g, g->point[r], trace.panes ? lum_rgb_mul(g->value[r], g->left[r]) : g->value[r]);
    if (g->job->missed)
        for (uint32_t r = 0; r < n; r++)
            g->job->missed[g->point[r]] += g->occluded[r];
    if (g->job->terms)
        for (uint32_t r = 0; r < n; r++)
            g->job->terms[g->kept[r]] *= g->occluded[r] ? -1.0f : 1.0f;
    if (g->job->left && trace.panes)
        for (uint32_t r = 0; r < n; r++)
            g->job->left[g->kept[r]] = g->occluded[r] ? 0 : lum_transmittance_pack(g->left[r]);
    g->rays.n = 0;
}

static void push_ray(struct gathering *g, uint32_t i, struct lum_vec3 target)
{
    g->point[g->rays.n] = (uint8_t)i;
    g->kept[g->rays.n] = g->row ? (size_t)(g->row - g->job->terms) + i : 0;
    lum_vpl_push_ray(&g->rays, lum_v3(g->ox[i], g->oy[i], g->oz[i]), target);
}

static struct lum_rgb transmittance(const struct gathering *g, const struct source *s, uint32_t i)
{
    struct lum_vec3 p = {g->px[i], g->py[i], g->pz[i]}, d = lum_v3_sub(s->p, p);
    return lum_media_transmittance(g->job->snapshot, p, lum_normalize(d), lum_length(d));
}

static void gather_source(struct gathering *g, const struct source *s)
{
    geometry_terms(g, s);
    if (s->lobe > 0.0f)
        add_lobes(g, s);
    struct lum_vec3 target = lum_ray_offset(s->p, s->n);
    if (g->row)
        memcpy(g->row, g->term, g->job->points->n_points * sizeof *g->row);
    if (g->row && g->job->left)
        memset(g->job->left + (g->row - g->job->terms), 0, g->job->points->n_points * sizeof *g->job->left);
    for (uint32_t i = 0; i < g->job->points->n_points; i++) {
        if (!(g->term[i] > 0.0f))
            continue;
        struct lum_rgb value = lum_rgb_scale(s->radiance, g->term[i]);
        if (g->media)
            value = lum_rgb_mul(value, transmittance(g, s, i));
        if (g->r2[i] < LUM_VPL_TOUCHING * LUM_VPL_TOUCHING) {
            add(g, i, value);
            continue;
        }
        if (g->rays.n == LUM_RAY_BATCH)
            trace_batch(g);
        g->value[g->rays.n] = value;
        push_ray(g, i, target);
    }
}

static void leave_unknown(struct gathering *g)
{
    for (uint32_t i = 0; i < g->job->points->n_points; i++)
        g->row[i] = LUM_VPL_UNKNOWN;
}

void lum_vpl_gather(const struct lum_gather *job)
{
    const struct lum_vpl_set *set = job->set;
    struct gathering g;
    g.job = job;
    g.media = job->media && job->snapshot->n_media > 0;
    g.rays.n = 0;
    load_points(&g);
    for (uint32_t k = 0; k < job->n_slots; k++) {
        uint32_t i = job->slots[k];
        struct source s = source_of(set, i);
        g.row = job->terms ? job->terms + (size_t)k * job->points->n_points : NULL;
        if (!lum_rgb_black(s.radiance))
            gather_source(&g, &s);
        else if (g.row)
            leave_unknown(&g);
    }
    trace_batch(&g);
    for (uint32_t i = 0; i < job->points->n_points; i++) {
        struct lum_rgb sum = {(float)g.sum[i][0], (float)g.sum[i][1], (float)g.sum[i][2]};
        job->irradiance[i] = lum_rgb_add(job->irradiance[i], sum);
    }
}
