/* Virtual point lights (Keller 1997): light paths are emitted by the lights, and where they meet a surface that
 * reflects diffusely, a point light is left that sends on what the surface reflects. The sum of those that a point sees
 * is its indirect diffuse light.
 *
 * Which path of which light fills which slot never changes (share.h): a VPL moves only when something on its own path
 * does.
 *
 * What fog scatters to surfaces is in the set, too, where that is asked for: VPLs stand in it. With gloss, what mirrors
 * and glass send on leaves VPLs as well, with lobes; each counts as a bounce of its path.
 *
 * The mean over seeds is exact up to max_bounces, but for two things: a VPL sends out evenly what a coated surface
 * reflects a little less at grazing angles, and interpolated normals bend how light goes on, not how much arrives.
 *
 * Flux is per unit of its light's power (light.h), so that a dimmed light is another factor and no ray. In scene units:
 * a VPL of flux F (already reflected, colour of the surface included) gives a point at distance r the irradiance
 *   E = F * power / pi * cos_vpl * cos_point / r^2 * V,
 * its geometry term bounded as struct lum_bound (gather.h) says.
 *
 * On request there are several paths for each slot to choose from, so that few are spent on what nobody sees
 * (choose.c), and light from afar is aimed at portals (portals.c) and at what these see (walk.h); and the direct light
 * of an even sky is in the set too, as n_sky VPLs behind the others (sky.c). */
#ifndef LUM_CORE_VPL_VPL_H
#define LUM_CORE_VPL_VPL_H

#include "core/light/portals.h"
#include "core/math/vec.h"
#include "core/scene/snapshot.h"
#include "core/trace/effect.h"
#include "core/trace/known_rays.h"

struct lum_counters;
struct lum_pool;
struct lum_vpl_share;

#define LUM_VPL_MAX 65536u   /* lists of all of them lie on workers' stacks, 256 KiB each */
#define LUM_VPL_DEFAULT 256u /* the thesis' number (5.4) */
#define LUM_VPL_TRIES_MAX 8u /* TRIES of core/cache/live.c, which has the figures */
#define LUM_VPL_DOME 256u    /* slots for a sky all around: half of them lie above a horizon; */
#define LUM_VPL_PORTALS 64u  /* and in portals by which it is seen from inside */
#define LUM_VPL_SKY (LUM_VPL_DOME + LUM_VPL_PORTALS)
_Static_assert(LUM_VPL_PORTALS == 64u && LUM_VPL_DOME % 64u == 0, "points in portals are one word of bits");
#define LUM_VPL_SLOTS_MAX (LUM_VPL_MAX + LUM_VPL_SKY)

/* Structure of arrays, by slot; every array is padded to a multiple of 16 with black VPLs. Zeroed: empty. */
struct lum_vpl_set {
    uint32_t n;                         /* slots; those without a VPL have flux 0 */
    uint32_t n_bounced;                 /* the first of them: light that surfaces send on */
    uint32_t n_sky;                     /* the last of them: points of the sky, from lum_vpl_first_sky */
    uint32_t n_lit;                     /* slots with flux > 0, but for the sky's */
    float *px, *py, *pz, *nx, *ny, *nz; /* scene space, on the surface; n: unit geometric normal on the side that the
                                         * light leaves from */
    float *flux_unit[3];                /* per unit of the light's power */
    float *flux[3];                     /* times the power: what gathering uses */
    float *importance;           /* about its part of all flux, by what its own path and light were when first seen: no
                                  * colour of a surface and no dimmed light changes it. 0: empty slot */
    float *radius;               /* of the area that it stands for, which is more where it is more important than those
                                  * around it; scene units; 0: of the sky */
    float *lost, *beside, *gain; /* of what it loses as it is lifted: lifted.h; 0 without tries, and in fog */
    float *lobe;         /* share of its flux that goes by a glossy lobe (lum_vpl_lobe); 0 unless that was asked for */
    float *wx, *wy, *wz; /* unit, to where the light came from */
    float *alpha, *f0, *f90; /* of the lobe; reflectances over its albedo for w */
    uint32_t *light;         /* index in the light table; LUM_NO_OBJECT: empty slot */
    uint32_t *object, *prim; /* what it lies on, as in struct lum_hits; LUM_NO_OBJECT: it is in fog */
    uint32_t n_moved;        /* slots that the last lum_vpl_update filled, emptied, or put elsewhere */
    uint64_t *moved;         /* a bit for each of them, lum_vpl_words(n) words; NULL: empty */
    float spacing;           /* r_v: the radius of the area that one VPL stands for, scene units: the median,
                              * so that lone ones do not make it wider; 0 without VPLs */
    /* what it was made for */
    uint32_t max_bounces, seed, tries;
    uint32_t lobes_off;
    bool gloss, scatters;
    struct lum_portals portals; /* n 0: none, or nobody asked for tries */
    float per_portal; /* points in each cell of them, in the last LUM_VPL_PORTALS slots; less than 1: in some */
    uint32_t sky;     /* the environment of the last n_sky slots; LUM_NO_OBJECT: they are empty */
    struct lum_versions versions; /* as lum_versions_seen has them */
    bool valid;
    /* private */
    struct lum_vpl_share *shares; /* of the paths, by light */
    uint32_t n_shares;
    double scale;                 /* of the scene, which powers in candela are in units of */
    void *memory;                 /* of the arrays */
    struct lum_known_rays *known; /* of the last update; NULL: none */
};

/* All slots of a set: those of the sky begin at a multiple of 64, so that no block of slots holds both kinds. */
static inline uint32_t lum_vpl_slots(uint32_t n_bounced, uint32_t n_sky)
{
    return n_sky > 0 ? ((n_bounced + 63u) & ~63u) + n_sky : n_bounced;
}
static inline uint32_t lum_vpl_first_sky(const struct lum_vpl_set *set)
{
    return set->n - set->n_sky;
}

static inline uint32_t lum_vpl_first_portal(const struct lum_vpl_set *set)
{
    return set->n_sky > 0 ? set->n - LUM_VPL_PORTALS : set->n;
}

/* What the place of a VPL is to be seen from at p: the dome of the sky looks the same from everywhere. */
static inline struct lum_vec3 lum_vpl_seen_from(const struct lum_vpl_set *set, uint32_t slot, struct lum_vec3 p)
{
    bool dome = slot >= lum_vpl_first_sky(set) && slot < lum_vpl_first_portal(set);
    return dome ? lum_v3(0.0f, 0.0f, 0.0f) : p;
}

static inline uint32_t lum_vpl_words(uint32_t n) /* of a mask with a bit for each slot */
{
    return (n + 63u) / 64u;
}

uint64_t lum_vpl_hash_places(const struct lum_vpl_set *set); /* of those of bounced light; never 0 */
void lum_vpl_finish(struct lum_vpl_set *set);                /* accepts a zeroed one */
void lum_vpl_forget_rays(struct lum_vpl_set *set);           /* gives back what is kept for the next update */

#define LUM_VPL_LOBES                                                                                                  \
    (LUM_EFFECT_BIT(LUM_EFFECT_REFLECTION) | LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION) |                                 \
     LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY))

struct lum_vpl_request {
    const struct lum_snapshot *snapshot;
    uint32_t n;           /* slots, 1 .. LUM_VPL_MAX */
    uint32_t max_bounces; /* diffuse bounces of a path; 0: no VPLs. A path of lum_view_settings.max_depth d has d - 1 */
    uint32_t seed;
    bool media;            /* paths are dimmed by the snapshot's media */
    bool scatters;         /* and scattered: VPLs are in fog, too */
    uint32_t lobes_off;    /* of LUM_VPL_LOBES, effects that are left out: paths end where they would go on by them */
    bool gloss;            /* VPLs send on what glossy reflection does, too, by its lobe. The thesis leaves it out */
    struct lum_pool *pool; /* may be NULL */
    struct lum_counters *counters; /* rays are added as LUM_RAY_VPL */
    uint32_t n_sky;                /* further slots, for the sky: 0 or LUM_VPL_SKY */
    uint32_t tries; /* paths for each slot of light from afar, and half as many for others, of which as many as there
                     * are slots are chosen (choose.c): 1 .. LUM_VPL_TRIES_MAX; 0 is 1. Less where n times as many would
                     * be more than LUM_VPL_MAX */
    /* What moved since the snapshot with this geometry, which was that of the last update: rays that meet nothing of it
     * are not traced again. NULL: all are */
    const struct lum_motion *since;
    uint64_t since_geometry;
    struct lum_known known; /* private */
};

/* Brings the set up to date with the snapshot: traces all paths again when geometry, materials or lights' shapes
 * changed; only multiplies by the new powers when nothing but those did. Lights share the paths by the flux they emit
 * when they are first seen to shine, so that dimming one moves no VPL. On failure the set is as before. Thread: the
 * director; splits its work over the pool. */
LUM_MUST_USE enum lum_status lum_vpl_update(struct lum_vpl_set *set, const struct lum_vpl_request *request,
                                            struct lum_error *err);

#endif
