/* What a ray found, ready to shade. */
#ifndef LUM_CORE_SCENE_SURFACE_H
#define LUM_CORE_SCENE_SURFACE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/base.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_hits;
struct lum_snapshot;

struct lum_surface {
    struct lum_vec3 p;      /* barycentric hit point, scene space */
    struct lum_vec3 ng, ns; /* unit, both on the side the ray came from; ns: interpolated vertex normals */
    struct lum_vec2 uv;
    uint32_t instance; /* LUM_NO_OBJECT for an emitter shape */
    uint32_t material;
    uint32_t light; /* emitter hit, or LUM_NO_OBJECT */
    uint32_t prim;
    bool backface;               /* hit from behind the winding (entering or leaving a solid) */
    bool white;                  /* as of struct lum_hits: lum_bsdf_init makes it lum_bsdf_white, without emission */
    struct lum_rgb vertex_color; /* white when the mesh has none */
    struct lum_rgb emission; /* of a surface that is a light: towards where the ray came from, but for its texture */
    /* Change of position with uv over the triangle, scene space, not unit; where the mesh has tangents of its own, the
     * directions that these say. 0 without uvs and where the material has no normal map. lum_bsdf_init applies those:
     * ns here is the interpolated vertex normal. */
    struct lum_vec3 dpdu, dpdv;
    struct lum_vec3 tangent, bitangent; /* where the material is brushed: along growing u, and falling v,
                                         * or as tangents of the mesh say;
                                         * without uv about the object's y axis, and up it. Not unit */
};

/* Fills *ret_surface for hit i of a batch whose ray had direction d. The caller checked object != LUM_NO_OBJECT. */
void lum_snapshot_surface(const struct lum_snapshot *, const struct lum_hits *hits, uint32_t i, struct lum_vec3 d,
                          struct lum_surface *ret_surface);

/* Asks memory for what lum_snapshot_surface and lum_bsdf_init will read of hits first to first + n - 1: nothing but
 * time changes by it. */
void lum_snapshot_ask(const struct lum_snapshot *, const struct lum_hits *hits, uint32_t first, uint32_t n);

/* At hit i of n, which are shaded in turn. 32 at a time have some 300 lines of vertices and texels, which are still in
 * the 768 of a first-level cache of 48 KiB when their turn comes. */
#define LUM_ASK_HITS 32u
static inline void lum_snapshot_ask_ahead(const struct lum_snapshot *s, const struct lum_hits *hits, uint32_t i,
                                          uint32_t n)
{
    if (i % LUM_ASK_HITS == 0)
        lum_snapshot_ask(s, hits, i, lum_min_u32(n - i, LUM_ASK_HITS));
}

#endif
