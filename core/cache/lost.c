#include "core/cache/lost.h"

#include "core/math/lanes.h"
#include "core/scene/snapshot.h"

#define LANES LUM_LANES

/* c at most: how bright what is near is, beside what the point sees in the mean. As bright in a room of even light, and
 * as a rule a little darker, since it lies as deep. */
#define AS_BRIGHT 0.8f
/* By this much brighter than its albedo says: of what it reflects some comes back to it. */
#define AND_BACK 1.1f

/* A VPL counts by (1 - d^2 / (WIDE r)^2)^2, r being the radius of the area that it stands for: WIDE^2 / 1.8 of them in
 * effect, with a hundred rays and more; and nothing further away. What lies that near behind a wall counts, too: an
 * edit there changes a record by a few percent at most (tests/numeric/flicker_test.c). */
#define WIDE 8.0f
#define FACES 0.5f /* a VPL faces as the point does within 60 degrees, as in share.c */

/* So much of what is near is taken to be there, too: no division by 0. */
#define BESIDE_LEAST 1e-3f
/* Records whose own rays tell of less, at any lift, lack nothing: most, which need not look at all VPLs. */
#define LEAST 0.01f
#define TOO_MUCH 0.3f
#define LACKING_MAX 0.7f

/* Sums over VPLs around: of lost and beside of each, its radius, and what it counts. */
struct around {
    _Alignas(64) float lost[LANES], beside[LANES], radius[LANES], weight[LANES];
};

static void add_lanes(const struct lum_vpl_set *set, uint32_t k, const struct lum_receiver *at,
                      struct around *restrict inout)
{
    const float *px = set->px + k, *py = set->py + k, *pz = set->pz + k, *radius = set->radius + k;
    const float *nx = set->nx + k, *ny = set->ny + k, *nz = set->nz + k;
    const float *lost = set->lost + k, *beside = set->beside + k;
    for (uint32_t i = 0; i < LANES; i++) { /* empty slots have no normal */
        float x = px[i] - at->p.x, y = py[i] - at->p.y, z = pz[i] - at->p.z;
        float facing = nx[i] * at->n.x + ny[i] * at->n.y + nz[i] * at->n.z - FACES;
        float near = 1.0f - (x * x + y * y + z * z) / (WIDE * WIDE * radius[i] * radius[i] + 1e-20f);
        near = near > 0.0f ? near : 0.0f;
        float weight = (facing > 0.0f ? facing : 0.0f) * near * near;
        inout->lost[i] += weight * lost[i];
        inout->beside[i] += weight * beside[i];
        inout->radius[i] += weight * radius[i];
        inout->weight[i] += weight;
    }
}

static float sum_of(const float lanes[LANES])
{
    double sum = 0.0;
    for (uint32_t i = 0; i < LANES; i++)
        sum += (double)lanes[i];
    return (float)sum;
}

static bool lacks_nothing(const struct lum_vpl_kept *kept)
{
    float most = 0.0f;
    for (uint32_t k = 0; k < LUM_VPL_LIFTS; k++)
        most = lum_max(most, fabsf(kept->n - kept->light[k]));
    return !(most > LEAST * kept->n);
}

/* The nearer to 0; 0 where they are of different signs. */
static float agreed(float a, float b)
{
    return a * b > 0.0f ? (fabsf(a) < fabsf(b) ? a : b) : 0.0f;
}

/* c of what is m or nearer, for a record of this ray. The sky is as bright as it is; without one, what is beyond the
 * reach of rays is taken to be as what is within it. */
static float brightness(const struct lum_around *around, const struct lum_snapshot *s, bool sky, float m)
{
    float near = 0.0f, far = 0.0f, of_near = 1e-6f, of_far = 1e-6f;
    for (uint32_t i = 0; i < LUM_PROXIMITY_RAYS; i++) {
        bool met = around->met[i] != LUM_NO_OBJECT;
        if (!met && !sky)
            continue;
        float reflects = met ? s->materials[s->instances[around->met[i]].material].reflects : 1.0f;
        float cosine = (float)i + 0.5f, by = m * m / (around->t[i] * around->t[i] + m * m); /* cosines of a spiral */
        near += met ? cosine * by * reflects : 0.0f;
        of_near += met ? cosine * by : 0.0f;
        far += cosine * (1.0f - by) * reflects;
        of_far += cosine * (1.0f - by);
    }
    return lum_min(AND_BACK * near * of_far / (of_near * far + 1e-12f), AS_BRIGHT);
}

float lum_vpl_lacking(const struct lum_vpl_set *set, const struct lum_receiver *at, const struct lum_around *around,
                      const struct lum_snapshot *snapshot, float lift)
{
    struct around sums = {{0}, {0}, {0}, {0}};
    if (lacks_nothing(&around->kept))
        return 0.0f;
    for (uint32_t k = 0; k < set->n_bounced; k += LANES)
        add_lanes(set, k, at, &sums);
    float weight = sum_of(sums.weight), radius = sum_of(sums.radius);
    if (!(radius > 0.0f))
        return 0.0f;
    float m = lift * radius / weight;
    struct lum_vpl_lost own = lum_vpl_lost_of(&around->kept, snapshot->lights.scene_radius, m);
    float by_others = sum_of(sums.lost) / (sum_of(sums.beside) + BESIDE_LEAST * weight) * own.beside;
    return lum_clamp(brightness(around, snapshot, set->sky != LUM_NO_OBJECT, m) * agreed(own.lost, by_others),
                     -TOO_MUCH, LACKING_MAX);
}
