/* What rays are traced through. core/accel is the only folder that sees Embree.
 *
 * Two levels. A struct lum_accel_mesh holds one mesh's triangles in its own Embree scene; a struct lum_accel_top holds
 * instances of meshes plus emitter shapes, and is built anew for every snapshot whose geometry changed (0.05 ms an
 * instance). Nothing is modified while it can be traced: a committed object is immutable, except a mesh whose only
 * owner refits it. All Embree scenes are ROBUST: no ray leaks through an edge (NOTES H9). */
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
void lum_device_destroy(struct lum_device *device);          /* accepts NULL; every accel must be gone */
const char *lum_device_isa(const struct lum_device *device); /* "avx512", ...: as asked for, else the widest */
/* From now on rays are traced one by one, or 16 at a time again: for studies of what packets gain. The same hits, bit
 * for bit, except that t on spheres may differ by rounding. Not while rays are traced. */
void lum_device_trace_singly(struct lum_device *device, bool singly);
bool lum_device_traces_singly(const struct lum_device *device);
const char *lum_accel_library(void); /* "Embree 3.13.5": the one compiled against, for lumend --version */
const char *lum_device_version(const struct lum_device *device); /* "Embree 3.13.5" */

/* Triangles as whoever made them and the ray tracer share them: nobody writes them once something is built of them. */
struct lum_triangles {
    struct lum_refs refs;
    float *positions;  /* 3 per vertex, finite */
    uint32_t *indices; /* 3 per triangle, all < n_vertices */
    uint32_t n_vertices, n_triangles;
};
struct lum_triangles *lum_triangles_create(uint32_t n_vertices, uint32_t n_triangles); /* zeros; NULL: no memory */
struct lum_triangles *lum_triangles_ref(struct lum_triangles *triangles);
void lum_triangles_unref(struct lum_triangles *triangles); /* accepts NULL */

/* Where surfaces are does not hang on it. It chooses which triangle is hit where there are several at the same
 * distance: exactly along an edge one of its two, and among triangles that coincide. */
enum lum_tree {
    LUM_TREE_FAST,  /* to trace */
    LUM_TREE_QUICK, /* to make: a fifth of the time, and half the memory */
    LUM_TREE_REFIT, /* again and again: of a copy of the positions */
};
/* Of at least one triangle. stop: NULL, or this thread builds alone, and once it reads true the call gives up,
 * LUM_ERR_CANCELLED. Thread: any. */
LUM_MUST_USE enum lum_status lum_accel_mesh_create(struct lum_device *device, struct lum_triangles *triangles,
                                                   enum lum_tree tree, const _Atomic bool *stop,
                                                   struct lum_accel_mesh **ret_mesh, struct lum_error *err);
/* Have triangles the same three positions, in any order? stop: as above, or NULL. Thread: any. */
LUM_MUST_USE enum lum_status lum_triangles_coincide(const struct lum_triangles *triangles, const _Atomic bool *stop,
                                                    bool *ret_any, struct lum_error *err);
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

/* Unit shapes around the origin, 1 to each side: a square and a disc in the x-y plane, with the normal along +z. */
enum lum_accel_unit { LUM_UNIT_SQUARE, LUM_UNIT_DISC, LUM_UNIT_SPHERE, LUM_UNIT_COUNT };
struct lum_accel_shape;
/* What tells the shapes of emitters apart: how a unit shape becomes it. */
struct lum_accel_shape_row {
    enum lum_accel_unit unit;
    /* What becomes of its axes in the scene. That of a flat shape which is free gets the length that keeps the map well
     * conditioned. */
    void (*place)(const struct lum_accel_shape *s, struct lum_vec3 *ret_x, struct lum_vec3 *ret_y,
                  struct lum_vec3 *ret_z);
    struct lum_vec3 (*half)(const struct lum_accel_shape *s); /* half the box that it fills around p */
    /* The normal of a hit, of any length, q away from p; and its coordinates, where the ray tracer has none: but for
     * squares, from 0 to 1 along each edge. */
    struct lum_vec3 (*on)(const struct lum_accel_shape *s, struct lum_vec3 q, float *inout_u, float *inout_v);
};
extern const struct lum_accel_shape_row lum_shape_quad, lum_shape_disc, lum_shape_sphere;
/* An emitter's surface, in scene space. quad: centre p, half edges u and v, unit normal n along cross(u, v). disc:
 * centre, unit normal n, radius. sphere: centre, radius. Radii and the quad's heights are at least 2^-28. */
struct lum_accel_shape {
    const struct lum_accel_shape_row *row;
    struct lum_vec3 p, u, v, n;
    float radius;
    bool hidden; /* camera rays pass it (light.camera_visible = false) */
};
struct lum_vec3 lum_accel_shape_half(const struct lum_accel_shape *shape); /* half the box that it fills around p */

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

/* Number of an object: index of the instance, or n_instances + index of the shape. */
#define LUM_NO_OBJECT UINT32_MAX /* what Embree writes for a miss */

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

#endif
