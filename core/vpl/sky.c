/* The sky as VPLs: points of a dome around everything, which shine inwards with the radiance of the environment behind
 * them. Everybody sees them in the same direction (lum_vpl_seen_from). Of the sky's direct light a surface gets what it
 * gets from them, so that what is true of VPLs holds: a dimmed sky is another factor, and what moves costs the rays
 * that it meets.
 *
 * Points are drawn by the environment's own distribution, from a lattice: for a constant sky a spiral of equal areas.
 *
 * From inside a room few of them, or none, are seen by its window. So there are points in the portals as well
 * (portals.c): each shines with the radiance of the environment in the direction that it is seen in, and is asked for
 * by a ray that goes on through it into the open. What both kinds find is weighed by how densely both look there, the
 * balance heuristic (Veach 1997) for what a point sees in direction d:
 *   E = sum over all that it sees of L(d) cos / (D(d) + W(p, d)),
 * with D the dome's points per solid angle and W those in portals, r^2 / (A cos) for each cell of area A that d leaves
 * by, times its number of points. */
#include "core/vpl/sky.h"

#include <string.h>

#include "core/light/emitter.h"
#include "core/light/environment.h"
#include "core/light/sample.h"
#include "core/math/sampler.h"
#include "core/scene/snapshot.h"
#include "core/vpl/share.h"

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
    struct lum_rgb flux =
        lum_rgb_scale(sample->radiance, LUM_PI * LUM_VPL_FAR * LUM_VPL_FAR / ((float)LUM_VPL_DOME * sample->pdf_sa));
    if (lum_rgb_black(flux) || !lum_rgb_finite(flux))
        return;
    struct lum_vec3 p = lum_v3_mul(sample->wi, LUM_VPL_FAR), n = lum_v3_neg(sample->wi);
    set->px[slot] = p.x, set->py[slot] = p.y, set->pz[slot] = p.z;
    set->nx[slot] = n.x, set->ny[slot] = n.y, set->nz[slot] = n.z;
    set->flux_unit[0][slot] = flux.r, set->flux_unit[1][slot] = flux.g, set->flux_unit[2][slot] = flux.b;
    set->light[slot] = set->sky;
}

/* How cells are dealt out, so that any of a number of shares is spread evenly: rows are shifted against each other. */
static uint32_t turn_of(const struct lum_vpl_set *set, uint32_t cell, uint32_t of)
{
    uint32_t side = set->portals.side, shift = of > 4 ? 3 : of > 2 ? 2 : 1;
    return (cell % side + shift * (cell / side) + lum_hash_u32(set->seed)) % of;
}

/* Slots that are the same modulo 4 serve records which ask one point in 4 (vpl_sum.c). */
enum { SHARES = 4, OF_SHARE = LUM_VPL_PORTALS / SHARES };

/* Point j of a cell lies where it lies whatever other cells are open, and in the first free slot of its share from one
 * that its number says: cells that open and shut move few others. */
static void place_in_portal(struct lum_vpl_set *set, uint32_t cell, uint32_t j, uint32_t in_each, uint32_t every)
{
    uint32_t h = lum_hash_combine(lum_hash_u32(cell), set->seed), first = lum_vpl_first_portal(set);
    uint32_t share = (turn_of(set, cell, SHARES * every) / every + j) % SHARES;
    uint32_t at = lum_hash_combine(h, j) % OF_SHARE;
    for (uint32_t k = 1; set->light[first + at * SHARES + share] != LUM_NO_OBJECT; k++) {
        at = (at + 1) % OF_SHARE;
        share = k % OF_SHARE ? share : (share + 1) % SHARES;
    }
    struct lum_vec3 n, p = lum_portals_point(&set->portals, cell, lattice_point(j, in_each, h), &n);
    uint32_t slot = first + at * SHARES + share;
    set->px[slot] = p.x, set->py[slot] = p.y, set->pz[slot] = p.z;
    set->nx[slot] = n.x, set->ny[slot] = n.y, set->nz[slot] = n.z;
    set->light[slot] = set->sky;
}

/* Of cells one in `every`, a power of 2. */
static bool takes(const struct lum_vpl_set *set, uint32_t cell, uint32_t every)
{
    return turn_of(set, cell, every) == 0;
}

static uint32_t count_taken(const struct lum_vpl_set *set, uint32_t every)
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < set->portals.n; k++)
        n += takes(set, set->portals.cell[k], every);
    return n;
}

/* Several points in each cell, or one in some of them. */
static void place_in_portals(struct lum_vpl_set *set)
{
    const uint32_t n = set->portals.n;
    uint32_t in_each = 1, every = 1;
    if (n == 0)
        return;
    while (2 * in_each * n <= LUM_VPL_PORTALS)
        in_each *= 2;
    while (count_taken(set, every) > LUM_VPL_PORTALS)
        every *= 2;
    set->per_portal = (float)in_each / (float)every;
    for (uint32_t k = 0; k < n; k++)
        for (uint32_t j = 0; j < in_each && takes(set, set->portals.cell[k], every); j++)
            place_in_portal(set, set->portals.cell[k], j, in_each, every);
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
    for (uint32_t i = 0; i < LUM_VPL_DOME; i++) {
        struct lum_light_sample sample;
        if (lum_environment_sample(&unit, lattice_point(i, LUM_VPL_DOME, set->seed), &sample))
            place(set, lum_vpl_first_sky(set) + i, &sample);
    }
    place_in_portals(set);
}

bool lum_vpl_sky_serves(const struct lum_vpl_set *set, const struct lum_snapshot *s)
{
    uint32_t sky = shining_sky(s);
    return set->n_sky == 0 || sky == LUM_NO_OBJECT || sky == set->sky;
}

/* ---- weights ---- */

static float dome_density(const struct lum_light *sky, struct lum_vec3 d)
{
    float pdf = sky->env ? lum_env_map_pdf(sky->env, lum_frame_to_local(&sky->frame, d)) : 0.25f * LUM_INV_PI;
    return (float)LUM_VPL_DOME * pdf;
}

bool lum_vpl_sees_portals(const struct lum_vpl_set *set, struct lum_vec3 p)
{
    const struct lum_vec3 lo = set->portals.lo, hi = set->portals.hi;
    return set->per_portal > 0.0f && p.x >= lo.x && p.x <= hi.x && p.y >= lo.y && p.y <= hi.y && p.z >= lo.z &&
           p.z <= hi.z;
}

float lum_vpl_dome_weight(const struct lum_vpl_set *set, const struct lum_light *sky, uint32_t slot, struct lum_vec3 p)
{
    struct lum_vec3 d = lum_v3_neg(lum_v3(set->nx[slot], set->ny[slot], set->nz[slot]));
    struct lum_portal_hit hit;
    if (!(set->per_portal > 0.0f) || !lum_portals_leave(&set->portals, p, d, &hit) ||
        !lum_portals_is_open(&set->portals, hit.cell))
        return 1.0f;
    float dome = dome_density(sky, d), r2 = hit.distance * hit.distance;
    return dome * hit.cosine / (dome * hit.cosine + set->per_portal * r2 / hit.area);
}

/* With d = v - p, r its length, a = d.n, h = -d.n_v and K points per area, the term is
 *   f = L a / (D r + K r^4 / h) = L a / g,
 * and df/dp = -df/dd = -L (n / g - a / g^2 (D d / r + 4 K r^2 d / h + K r^4 n_v / h^2)). How L and D change with d is
 * left out, as a sky is even, and how the weights of the dome do. */
bool lum_vpl_portal_term(const struct lum_vpl_set *set, const struct lum_light *sky, uint32_t slot, struct lum_vec3 p,
                         struct lum_vec3 n, struct lum_portal_term *ret)
{
    struct lum_vec3 v = {set->px[slot], set->py[slot], set->pz[slot]},
                    nv = {set->nx[slot], set->ny[slot], set->nz[slot]};
    struct lum_vec3 d = lum_v3_sub(v, p);
    float r2 = lum_dot(d, d), r = sqrtf(r2), a = lum_dot(d, n), h = -lum_dot(d, nv);
    if (!(a > 0.0f && h > 0.0f))
        return false;
    uint32_t axis = nv.x != 0.0f ? 0 : nv.y != 0.0f ? 1 : 2;
    float k = set->per_portal / lum_portals_cell_area(&set->portals, axis);
    struct lum_vec3 unit = lum_v3_mul(d, 1.0f / r);
    float dome = dome_density(sky, unit), g = dome * r + k * r2 * r2 / h;
    float per_g = 1.0f / g, along = a * per_g * per_g * (dome / r + 4.0f * k * r2 / h);
    float across = a * per_g * per_g * k * r2 * r2 / (h * h);
    ret->radiance = lum_sky_radiance(sky, unit);
    ret->g = a * per_g;
    ret->gradient = lum_v3_mad(lum_v3_mad(lum_v3_mul(n, -per_g), d, along), nv, across);
    return isfinite(ret->g) && lum_v3_finite(ret->gradient);
}
