/* What an edit makes stale: the one place that says so.
 *
 * An edit is of a kind: a class of changes of the scene (the counters of struct lum_versions), of the camera, or of a
 * setting. A product is what a stage makes and keeps. The table in stale.c has a row for each kind of edit, with the
 * products that have to be made anew after it; whatever keeps a product remembers what it was made of, and asks here.
 * Exposure, tone map and false colour are no edits: the core makes radiance (or illuminance, a setting), and knows
 * nothing of them.
 *
 * Finer than the table, each within its product: of surfaces none by lights that move, unless objects begin or end to
 * shine (surfaces.c); of lights' own layers only those of lights that moved (layers.c); of VPLs the mask of those that
 * did (vpl.h), and of their rays those that may meet what moved (known_rays.h); of records what their kind finds that
 * motion met (core/cache/kind.h). */
#ifndef LUM_CORE_TRACE_STALE_H
#define LUM_CORE_TRACE_STALE_H

#include "core/scene/snapshot.h"

enum lum_edit_kind {
    LUM_EDIT_GEOMETRY,
    LUM_EDIT_MATERIAL,
    LUM_EDIT_LIGHT_SHAPE,
    LUM_EDIT_LIGHT_POWER,
    LUM_EDIT_MEDIUM,
    LUM_EDIT_CAMERA, /* or the size of the picture */
    LUM_EDIT_METHOD, /* what estimates what, with which random numbers: method, effects, seed */
    LUM_EDIT_DEPTH,
    LUM_EDIT_SHADOW_SAMPLES,
    LUM_EDIT_VPLS,     /* how many */
    LUM_EDIT_CACHE,    /* accuracy, storage, deterministic */
    LUM_EDIT_QUANTITY, /* the picture is of luminance, or of illuminance: of surfaces that are all white */
    LUM_EDIT_COUNT
};
#define LUM_EDIT_BIT(e) (1u << (e))
static inline uint32_t lum_edit_if(bool changed, enum lum_edit_kind edit)
{
    return changed ? LUM_EDIT_BIT(edit) : 0;
}
#define LUM_EDITS_ALL (LUM_EDIT_BIT(LUM_EDIT_COUNT) - 1u)
#define LUM_EDITS_OF_SCENE (LUM_EDIT_BIT(LUM_EDIT_MEDIUM + 1) - 1u) /* the first five */

enum lum_product {
    LUM_PRODUCT_GBUFFER,    /* first hits */
    LUM_PRODUCT_SURFACES,   /* what is there, ready to shade */
    LUM_PRODUCT_LAYERS,     /* which buffers there are, light by light, and their samples; all of the following four */
    LUM_PRODUCT_VISIBILITY, /* who sees which light */
    LUM_PRODUCT_OWN_LAYER,  /* both, of lights that moved */
    LUM_PRODUCT_PLACES,     /* where samples of discs and meshes lie on them, and how these shine there */
    LUM_PRODUCT_RESPONSE,   /* what surfaces make of a light of power 1 */
    LUM_PRODUCT_SHARED,     /* summed light of those that have no layer of their own */
    LUM_PRODUCT_COMPONENTS, /* buffers by effect */
    LUM_PRODUCT_UNIT_LIGHT, /* of these, what is kept light by light at power 1 */
    LUM_PRODUCT_EDGES,      /* which pixels share an edge, and in which parts */
    LUM_PRODUCT_VPL_PATHS,
    LUM_PRODUCT_VPL_FLUX, /* their paths times the powers of lights */
    LUM_PRODUCT_RECORDS,  /* irradiance of a cache's records */
    LUM_PRODUCT_AOVS,
    LUM_PRODUCT_CAUSTICS, /* what mirrors and glass focus of lamps at power 1 */
    LUM_PRODUCT_COUNT
};

/* True when one of the edits (bits) makes the product stale. */
bool lum_is_stale(uint32_t edits, enum lum_product product);

/* Bits of the edits between two versions of a scene. */
uint32_t lum_edits_of_versions(const struct lum_versions *was, const struct lum_versions *now);
/* The versions as something sees them for which media count, or not: without any that do, none of their edits does. */
struct lum_versions lum_versions_seen(const struct lum_snapshot *s, bool media);

#endif
