/* The sky as VPLs: points of a dome around everything, which shine inwards with the radiance of the environment behind
 * them. Everybody sees them in the same direction (lum_vpl_seen_from). Of the sky's direct light a surface gets what it
 * gets from them, so that what is true of VPLs holds: a dimmed sky is another factor, and what moves costs the rays
 * that it meets.
 *
 * Points are drawn by the environment's own distribution, from a lattice: for a constant sky a spiral of equal areas.
 */
#include "core/vpl/share.h"

#include "core/light/light.h"
#include "core/light/sample.h"
#include "core/math/sampler.h"
#include "core/scene/snapshot.h"

/* Scene units: beyond everything, as coordinates are at most 2^7. Segments to a wider one would be tested against boxes
 * less exactly (cache/since.c). */
#define DOME 0x1p11f

#define GOLDEN 0.61803398874989485 /* (sqrt 5 - 1) / 2 */

/* Point i of a rank-1 lattice, rotated by the seed. */
static struct lum_vec2 lattice_point(uint32_t i, uint32_t n, uint32_t seed)
{
    uint32_t h = lum_hash_u32(seed), g = lum_hash_u32(h);
    double x = (i + 0.5) * GOLDEN + h * 0x1p-32, y = (i + g * 0x1p-32) / n;
    return (struct lum_vec2){fminf((float)y, 0x1.fffffep-1f), fminf((float)(x - floor(x)), 0x1.fffffep-1f)};
}

static void place(struct lum_vpl_set *set, uint32_t slot, const struct lum_light_sample *sample)
{
    struct lum_rgb flux = lum_rgb_scale(sample->radiance, LUM_PI * DOME * DOME / ((float)set->n_sky * sample->pdf_sa));
    if (lum_rgb_black(flux) || !lum_rgb_finite(flux))
        return;
    struct lum_vec3 p = lum_v3_mul(sample->wi, DOME), n = lum_v3_neg(sample->wi);
    set->px[slot] = p.x, set->py[slot] = p.y, set->pz[slot] = p.z;
    set->nx[slot] = n.x, set->ny[slot] = n.y, set->nz[slot] = n.z;
    set->flux_unit[0][slot] = flux.r, set->flux_unit[1][slot] = flux.g, set->flux_unit[2][slot] = flux.b;
    set->light[slot] = set->sky;
}

/* LUM_NO_OBJECT: none shines, or it is not even. */
static uint32_t shining_sky(const struct lum_snapshot *s)
{
    uint32_t sky = s->lights.environment;
    bool shines = sky != LUM_NO_OBJECT && !lum_rgb_black(lum_light_present_power(&s->lights, sky));
    return shines && lum_light_is_even_sky(&s->lights.lights[sky]) ? sky : LUM_NO_OBJECT;
}

void lum_vpl_place_sky(struct lum_vpl_set *set, const struct lum_snapshot *s)
{
    set->sky = set->n_sky > 0 ? shining_sky(s) : LUM_NO_OBJECT;
    if (set->sky == LUM_NO_OBJECT)
        return;
    struct lum_light unit = s->lights.lights[set->sky];
    unit.power = lum_grey(1.0f);
    for (uint32_t i = 0; i < set->n_sky; i++) {
        struct lum_light_sample sample;
        if (lum_environment_sample(&unit, lattice_point(i, set->n_sky, set->seed), &sample))
            place(set, lum_vpl_first_sky(set) + i, &sample);
    }
}

bool lum_vpl_sky_serves(const struct lum_vpl_set *set, const struct lum_snapshot *s)
{
    uint32_t sky = shining_sky(s);
    return set->n_sky == 0 || sky == LUM_NO_OBJECT || sky == set->sky;
}
