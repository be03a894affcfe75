/* Built-in shapes: tessellated meshes with normals and uvs, centred at the origin, for scenes written by hand. */
#ifndef LUM_CORE_SCENE_SHAPES_H
#define LUM_CORE_SCENE_SHAPES_H

#include "core/base/base.h"

/* Owned arrays; release with lum_shape_finish. */
struct lum_shape_mesh {
    float *positions, *normals, *uvs; /* 3, 3, 2 per vertex */
    uint32_t *indices;                /* 3 per triangle */
    uint32_t n_vertices, n_triangles;
};

struct lum_shape_params {
    double size[3];       /* box: edges; quad: x and z edges, normal +Y; others: bounding box edges */
    uint32_t segments[2]; /* around, along; 0 = the shape's default */
    double param[4];      /* the shape's own knobs, documented in the table of shapes.c; 0 = default */
};

/* name: box sphere quad disc cylinder cone torus knot figure (a robed statue) bunny wobble (a cylinder whose axis is a
 * sine wave; its size is the box of all poses). See lum_shape_names. */
LUM_MUST_USE enum lum_status lum_shape_make(const char *name, const struct lum_shape_params *params,
                                            struct lum_shape_mesh *ret_mesh, struct lum_error *err);
/* How many triangles that would make, without making it: exact, but for a bunny, which has no more. */
LUM_MUST_USE enum lum_status lum_shape_count(const char *name, const struct lum_shape_params *params,
                                             uint32_t *ret_triangles, struct lum_error *err);
void lum_shape_finish(struct lum_shape_mesh *mesh);
/* NULL-terminated list. */
const char *const *lum_shape_names(void);

#endif
