/* Ray tracing: the only folder that sees Embree.
 *
 * Two levels. A struct lum_accel_mesh holds one mesh's triangles in its own Embree scene; a struct lum_accel_top holds
 * instances of meshes plus emitter shapes, and is built anew for every snapshot whose geometry changed (0.05 ms an
 * instance). Nothing is modified while it can be traced: a committed object is immutable, except a mesh whose only
 * owner refits it. All Embree scenes are ROBUST (algorithms 0).
 *
 * Every ray passes one gate first: origin and direction finite and inside Embree's limits, direction not zero,
 * 0 <= tnear <= tfar, no NaN. Debian's Embree abort()s on such rays, so a ray that fails is not traced, reads as a miss
 * (or as unoccluded) and is counted. A count above 0 is a bug in the caller. */
#ifndef LUM_CORE_ACCEL_ACCEL_H
#define LUM_CORE_ACCEL_ACCEL_H

#include "core/base/base.h"
#include "core/math/affine.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_device;     /* one Embree device */
struct lum_accel_mesh; /* refcounted */
struct lum_accel_top;  /* refcounted */

/* isa: the instruction set of Embree's kernels, by name: sse2, sse4.2, avx, avx2 or avx512. Refused are others, and
 * those that this processor lacks; what: the beginning of the message ("--isa"). Kernels of different sets round
 * differently: a hit's last bits, and what a ray finds along an edge. */
LUM_MUST_USE enum lum_status lum_isa_check(const char *what, const char *isa, struct lum_error *err);
/* n_threads: build threads. isa: NULL, the widest, or one by name: for replays that must be bit-identical across
 * machines. */
LUM_MUST_USE enum lum_status lum_device_create(uint32_t n_threads, const char *isa, struct lum_device **ret_device,
                                               struct lum_error *err);
void lum_device_destroy(struct lum_device *device); /* accepts NULL; every accel must be gone */
const char *
lum_device_isa(const struct lum_device *device); /* "avx512", "avx2", ...: what was asked for, else the widest */
/* From now on rays are traced one by one, or 16 at a time again: for studies of what packets gain. The same hits, bit
 * for bit, except that t on spheres may differ by rounding. Not while rays are traced. */
void lum_device_trace_singly(struct lum_device *device, bool singly);
bool lum_device_traces_singly(const struct lum_device *device);
const char *lum_accel_library(void); /* "Embree 3.13.5": the one compiled against, for lumend --version */
const char *lum_device_version(const struct lum_device *device); /* "Embree 3.13.5" */

/* positions: 3 * n_vertices floats, indices: 3 * n_triangles (all < n_vertices, finite: the scene checked). Copied. */
LUM_MUST_USE enum lum_status lum_accel_mesh_create(struct lum_device *device, const float *positions,
                                                   uint32_t n_vertices, const uint32_t *indices, uint32_t n_triangles,
                                                   bool deforming, struct lum_accel_mesh **ret_mesh,
                                                   struct lum_error *err);
/* Same topology, new positions: refits in place. The caller must hold the only reference. */
LUM_MUST_USE enum lum_status lum_accel_mesh_refit(struct lum_accel_mesh *mesh, const float *positions,
                                                  struct lum_error *err);
struct lum_accel_mesh *lum_accel_mesh_ref(struct lum_accel_mesh *mesh);
void lum_accel_mesh_unref(struct lum_accel_mesh *mesh);
bool lum_accel_mesh_unique(const struct lum_accel_mesh *mesh);

struct lum_accel_instance {
    struct lum_accel_mesh *mesh;
    struct lum_affine local_to_scene; /* invertible: the scene checked */
};

enum lum_accel_shape_kind { LUM_SHAPE_QUAD, LUM_SHAPE_DISC, LUM_SHAPE_SPHERE, LUM_SHAPE_KIND_COUNT };
/* An emitter's surface, in scene space. quad: centre p, half edges u and v, unit normal n along cross(u, v). disc:
 * centre, unit normal n, radius. sphere: centre, radius. Radii and the quad's heights are at least 2^-28. */
struct lum_accel_shape {
    enum lum_accel_shape_kind kind;
    struct lum_vec3 p, u, v, n;
    float radius;
    bool hidden; /* camera rays pass it (light.camera_visible = false) */
};

/* Alpha test of a candidate hit; called from many threads, must be pure. True: the surface is there. */
struct lum_accel_alpha {
    bool (*opaque)(const void *user, uint32_t object, uint32_t prim, float u, float v);
    const void *user;
};

/* What a see-through surface leaves of light that goes straight on. */
struct lum_accel_pane {
    struct lum_rgb left;  /* 0..1 */
    struct lum_rgb depth; /* of what lies behind the surface, per unit of length: optical depth that the light has had
                           * before it got out here, or has from now on, where it goes in: negative. Thin: black */
    float steep;          /* |d.n| with the geometric normal */
};
/* Asks what a candidate hit of light along d leaves of it; called from many threads, must be pure. False: the surface
 * lets nothing pass straight on. */
struct lum_accel_panes {
    bool (*passes)(const void *user, uint32_t object, uint32_t prim, float u, float v, struct lum_vec3 d,
                   struct lum_accel_pane *ret_pane);
    const void *user;
};

LUM_MUST_USE enum lum_status lum_accel_top_create(struct lum_device *device, const struct lum_accel_instance *instances,
                                                  uint32_t n_instances, const struct lum_accel_shape *shapes,
                                                  uint32_t n_shapes, struct lum_accel_top **ret_top,
                                                  struct lum_error *err);
/* Only some objects of `whole`, under their numbers there: for rays that ask about what moved. Thread: any. */
LUM_MUST_USE enum lum_status lum_accel_top_create_part(const struct lum_accel_top *whole, const uint32_t *objects,
                                                       uint32_t n_objects, struct lum_accel_top **ret_part,
                                                       struct lum_error *err);
struct lum_accel_top *lum_accel_top_ref(struct lum_accel_top *top);
void lum_accel_top_unref(struct lum_accel_top *top);

/* Components of a ray's origin and direction are at most this. Scene coordinates are about 128 and directions about
 * unit, and instances shrink by at most 2^30 (the scene checked), so object-space rays stay below Embree's own limit
 * of 1.8e18. */
#define LUM_RAY_LIMIT 1e8f

/* A batch of rays, structure of arrays, at most LUM_RAY_BATCH. Direction need not be unit: t is in units of |d|. */
#define LUM_RAY_BATCH 256
struct lum_rays {
    _Alignas(64) float ox[LUM_RAY_BATCH];
    float oy[LUM_RAY_BATCH], oz[LUM_RAY_BATCH], dx[LUM_RAY_BATCH], dy[LUM_RAY_BATCH], dz[LUM_RAY_BATCH];
    float tnear[LUM_RAY_BATCH], tfar[LUM_RAY_BATCH];
    uint32_t n;
};

#define LUM_NO_OBJECT UINT32_MAX /* what Embree writes for a miss */
/* object: index of the instance, or n_instances + index of the shape, or LUM_NO_OBJECT for a miss. u, v: barycentric
 * for triangles; 0..1 over the whole quad; disc: offset from the centre in radii along the axes of
 * lum_frame_from_normal(n); sphere: unused. ng: geometric normal by winding, in the object's local space for instances,
 * scene space for shapes (sphere: outward); not unit. Only t < tfar hits are reported; the fields of a miss other than
 * object are undefined. */
struct lum_hits {
    _Alignas(64) float t[LUM_RAY_BATCH];
    float u[LUM_RAY_BATCH], v[LUM_RAY_BATCH];
    float ngx[LUM_RAY_BATCH], ngy[LUM_RAY_BATCH], ngz[LUM_RAY_BATCH];
    uint32_t object[LUM_RAY_BATCH], prim[LUM_RAY_BATCH];
};

struct lum_trace {
    const struct lum_accel_top *top;
    const struct lum_accel_alpha *alpha; /* NULL: no alpha-mapped material in the scene */
    const struct lum_accel_panes *panes; /* of lum_trace_light; NULL: there are none, or nothing gets through them */
    bool camera;                         /* a ray from the eye: passes hidden shapes */
    /* Closest hits of primary rays: neighbours together. Elsewhere the flag hurts (algorithms 0), and any-hit queries
     * ignore it: Embree 3.13.5 as Debian builds it never returns from rtcOccluded16 with it on well-formed packets,
     * when there are instances and AVX-512. */
    bool coherent;
    uint64_t *bad_rays; /* incremented for each ray that the gate refused; the caller's own counter */
};

/* 16-wide inside; any n. Thread: any, concurrently. */
void lum_trace_closest(const struct lum_trace *trace, const struct lum_rays *rays, struct lum_hits *ret_hits);
/* occluded[i] = 1 when something lies in (tnear, tfar). */
void lum_trace_any(const struct lum_trace *trace, const struct lum_rays *rays, uint8_t ret_occluded[LUM_RAY_BATCH]);
/* The same of light: panes do not occlude, and ret_left[i] is what those in (tnear, tfar) leave of it; 1, exactly,
 * where there is none. Undefined where something else occludes, and wherever trace->panes is NULL: then this is
 * lum_trace_any.
 *
 * A pane is counted once however many of its triangles a ray meets: of one instance hits count as one that are no
 * further apart than LUM_RAY_OFFSET across the surface, as a path that goes on from the first would leave the others
 * behind. So a ray through an edge that triangles share (which both may report) is dimmed as one beside it. This looks
 * back on the last LUM_PANES_KEPT panes of a ray, in whatever order they are met. */
#define LUM_PANES_KEPT 8u
void lum_trace_light(const struct lum_trace *trace, const struct lum_rays *rays, uint8_t ret_occluded[LUM_RAY_BATCH],
                     struct lum_rgb ret_left[LUM_RAY_BATCH]);

/* Moves p off the surface along unit normal n (towards the side of the ray to be shot), so that tnear = 0 finds no
 * self-hit.
 *
 * What has to be outrun is the rounding of local -> scene -> local, which grows with the scene's coordinates and not
 * with those of p: a wall's corner may lie at 0. Scene coordinates are at most 2^7, where neighbouring floats are 2^-17
 * apart; the offset is 16 of these. Measured over 1.4 million hits on rotated and stretched instances: 2^-16 is the
 * least that leaves no self-hit (numeric.trace), where Waechter & Binder's 256 ulps of each component leave some near
 * the axes and reach eight times as far elsewhere. In a room of 10 m it is 0.02 mm. */
#define LUM_RAY_OFFSET 0x1p-13f
static inline struct lum_vec3 lum_ray_offset(struct lum_vec3 p_scene, struct lum_vec3 n)
{
    return lum_v3_mad(p_scene, n, LUM_RAY_OFFSET);
}

#endif
