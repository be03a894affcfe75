/* Light of lamps without extent that mirrors and solid glass send on: how much of it no method shows.
 *
 * Paths and shadow rays end at the light that surfaces get from a point, a spot or a direction straight, or through
 * panes. What comes by way of a smooth mirror or of glass that bends it (L S+ D in Heckbert's notation) they miss: no
 * ray that a surface sends meets such a lamp. Of lamps with an extent `path` finds it.
 *
 * The estimate emits LUM_CAUSTIC_PATHS paths from the lamps that are on, half of them by flux and half alike, and
 * follows each as long as surfaces send light on without spread. It sums two fluxes:
 *   - arriving: of a lamp, what meets surfaces at all, behind panes
 *   - focused: of that, what meets a surface which spreads light, after one or more mirrors or bends
 *
 * Where a surface does both, its delta lobes send their part on, and it gets the rest. What panes let straight through
 * is not focused, and what they mirror (8 % of what meets clear glass head on) is not followed. Fog is left out: it
 * dims both.
 *
 * Without such a lamp, or without a smooth mirror or solid glass, there is no path. A lamp that is dimmed is another
 * sum. */
#ifndef LUM_CORE_VPL_CAUSTIC_H
#define LUM_CORE_VPL_CAUSTIC_H

#include "core/base/pool.h"
#include "core/scene/snapshot.h"

#define LUM_CAUSTIC_PATHS 4096u  /* whole batches; a share of a half is known to sqrt(1/4 / 4096) = 0.8 % */
#define LUM_CAUSTIC_SEGMENTS 16u /* of a path, at most: light that goes on between mirrors is then left out */

struct lum_caustic_amount {
    double arriving_lm, focused_lm;
    double stderr_lm; /* of focused_lm, as if paths were independent: they are better than that */
};
/* Of what arrives; 0 where nothing does. */
double lum_caustic_share(const struct lum_caustic_amount *amount);
double lum_caustic_share_stderr(const struct lum_caustic_amount *amount);

#define LUM_CAUSTIC_LIGHTS 8u /* told by name: those that are focused most */
struct lum_caustic_report {
    bool known;                    /* false: never made */
    uint64_t scene_rev;            /* that it is of */
    uint64_t n_rays;               /* that it took the last time: 0 where it was a sum */
    struct lum_caustic_amount all; /* of lamps without extent that are on */
    uint32_t n_lights;             /* of those, the ones with most focused light, in that order; none that has none */
    struct lum_caustic_of_light {
        char id[LUM_ID_MAX + 1];
        char object[LUM_ID_MAX + 1]; /* that is the first to mirror or bend most of it */
        bool glass;                  /* it lets light through */
        bool from_afar;              /* the light is directional */
        struct lum_caustic_amount amount;
    } lights[LUM_CAUSTIC_LIGHTS];
};

struct lum_caustic_light;
struct lum_caustics {
    struct lum_caustic_report report;
    uint64_t bad_rays, nonfinite; /* of the last update; must be 0 */
    /* private */
    struct lum_caustic_light *lights;
    uint32_t n_lights;
    struct lum_versions versions;
    bool focusing; /* some object mirrors, or bends light */
};

/* True when lum_caustics_update would trace no ray. */
bool lum_caustics_serve(const struct lum_caustics *caustics, const struct lum_snapshot *snapshot);
/* Makes the report that of the snapshot; the same for any number of threads. On failure it is as before. Thread: the
 * director; splits its work over the pool. */
LUM_MUST_USE enum lum_status lum_caustics_update(struct lum_caustics *caustics, const struct lum_snapshot *snapshot,
                                                 struct lum_pool *pool, struct lum_error *err);
void lum_caustics_finish(struct lum_caustics *caustics); /* accepts a zeroed one */

#endif
