/* Light paths on their way, a batch at a time. Internal to core/vpl.
 *
 * What lies before a window is little of a site of acres: few light paths end there, and they light all ceilings. So
 * where there are portals a part of the paths of light from afar begin with a look out: from a point x of an open cell
 * by the cosine to what is there first, y, where light is drawn that arrives from afar, and sent. Others may end at y,
 * too, and all weigh by both ways (balance heuristic). Since y may be seen from many x, those that came otherwise draw
 * one, of the cells that face them: both are ways to make a light path and a point x, and whatever x is, weights add up
 * to 1. */
#ifndef LUM_CORE_VPL_WALK_H
#define LUM_CORE_VPL_WALK_H

#include "core/math/sampler.h"
#include "core/trace/rays.h"
#include "core/vpl/share.h"

struct lum_light_ray;
struct lum_surface;

/* What is met within this of what was seen is that. */
#define LUM_VPL_SAME_PLACE (8.0f * LUM_RAY_OFFSET)

/* Sampler pairs: the light's two, then two for each segment. */
enum { PAIR_POSITION = 0, PAIR_DIRECTION = 1, PAIR_BSDF = 2, PAIR_LOBE = 3, PAIRS_PER_SEGMENT = 2 };
/* And further ones, of what portals see. */
enum { PAIR_SKY = 1000, PAIR_PORTAL = 1001 };
/* And of segments in fog. */
enum { PAIR_FOG = 2000, PAIRS_PER_FOG = 4 };

struct lum_vpl_path {
    struct lum_rgb flux;    /* as if the light had this one path only; per unit of power */
    float importance;       /* of its first VPL: its part of the flux of all, about; it depends on no colour */
    float left;             /* of that, as if all surfaces were alike */
    uint32_t share, number; /* whose, and which of its paths */
    uint32_t bounce, last;  /* VPLs left so far; bounce after which nobody needs the path */
    uint32_t n_segments;
    bool looks_out;           /* it is a look */
    float reaches;            /* it is light that was sent, on its way, of this length; else 0 */
    float density;            /* of light from afar: lum_light_ray.density */
    struct lum_portal_hit by; /* of a look: the cell, and how it looks */
    bool found; /* by paths from the eye, too: it began at a lamp with an extent, or met what spreads light */
    /* Of a walk in fog: the sum of what is scattered at each of its points, and one of these, drawn in proportion to
     * that, which the VPL of all of them is at. Not yet left: fog.n_points > 0 */
    struct {
        uint32_t n_points, n_rays; /* rays: of all walks, each has numbers of its own */
        struct lum_rgb flux;
        struct lum_vec3 p, n, wo; /* n: side that it faces to */
    } fog;
    struct lum_sampler sampler;
};

/* A batch of paths, densely packed: path i has ray i. Lives on a worker's stack. */
struct lum_vpl_walk {
    const struct lum_snapshot *snapshot;
    const struct lum_known *known;
    const struct lum_vpl_plan *plan;
    struct lum_vpl_set *set;
    struct lum_counters *counters;
    bool media;    /* there are some, and they count */
    bool scatters; /* and what they scatter goes on */
    struct lum_rays rays;
    struct lum_hits hits;
    struct lum_vpl_path path[LUM_RAY_BATCH];
};

/* The path gets the flux and the importance of a ray that leaves its light. */
void lum_vpl_set_off(const struct lum_vpl_walk *w, struct lum_vpl_path *inout_path, const struct lum_light_ray *shot);
/* True: the path, which is new, is one that looks out; its ray is appended to the batch. u: of where its light starts;
 * without a look it becomes a fresh number. */
bool lum_vpl_look_out(struct lum_vpl_walk *w, struct lum_vpl_path *inout_path, struct lum_vec2 *inout_u);
/* It saw something with ray i of the batch, of direction d: light is sent there, appended to the batch. */
void lum_vpl_send_light(struct lum_vpl_walk *w, struct lum_vpl_path path, uint32_t i, struct lum_vec3 d);
/* Light from afar that came to s in direction d, and was not sent. */
void lum_vpl_weigh_by_looks(struct lum_vpl_walk *w, struct lum_vpl_path *inout_path, const struct lum_surface *s,
                            struct lum_vec3 d);

#endif
