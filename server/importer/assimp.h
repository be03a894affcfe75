/* The reader of every format but glTF, inside. Assimp parses; these files turn its scene into records.
 *
 * Such files rarely say what their light units are. One rule, and a warning: 1 is one watt (per steradian and square
 * metre, as the quantity has it), at 179 lm/W, Radiance's efficacy of white light. */
#ifndef LUM_SERVER_IMPORTER_ASSIMP_H
#define LUM_SERVER_IMPORTER_ASSIMP_H

#include <assimp/cfileio.h>
#include <assimp/scene.h>

#include "core/math/affine.h"
#include "server/importer/mesh.h"

/* Of white light, as Radiance has it: lamps of formats without units are of watts. */
#define LUM_LUMENS_PER_WATT 179.0

struct lum_assimp_image {
    char path[1024]; /* of the base colour, then '|', then of the opacity map */
    lum_id id;       /* "": could not be read */
};

struct lum_assimp_material {
    lum_id id;           /* "": not sent yet */
    bool shines, evenly; /* it is a light; without a texture that says where */
};

struct lum_assimp_node {
    const struct aiNode *node;
    struct lum_affined to_world;
};

struct lum_assimp {
    struct lum_importer *im;
    const struct lum_bytes *file; /* the asset itself */
    const struct aiScene *scene;
    struct lum_mesh_parts *meshes; /* none: not sent yet */
    uint32_t *n_shown;             /* by mesh: objects that show it */
    struct lum_assimp_material *materials;
    struct lum_assimp_image *images;
    uint32_t n_images, images_cap;
    struct lum_assimp_node *nodes; /* of all nodes, parents before children */
    size_t n_nodes, nodes_cap;
    bool warned_units;
};

/* ---- assimp_io.c ---- */
/* Assimp's way to files: through the parent, read only. user: struct lum_assimp. */
struct aiFileIO lum_assimp_io(struct lum_assimp *a);
/* "textures\Wood.JPG" or "C:\x\Wood.JPG" to bytes: as named, else the last part beside the asset; letter case does not
 * matter. */
LUM_MUST_USE enum lum_status lum_assimp_read(struct lum_assimp *a, const char *path, struct lum_bytes *ret_bytes,
                                             struct lum_error *err);

/* ---- assimp_material.c, assimp_image.c ---- */
/* Sends material i at its first use. */
LUM_MUST_USE enum lum_status lum_assimp_material(struct lum_assimp *a, uint32_t i, struct lum_error *err);
/* Sends the picture of a base colour, its alpha from the opacity map (may be ""). ret_id "": left out, with a warning.
 */
LUM_MUST_USE enum lum_status lum_assimp_image(struct lum_assimp *a, const char *color_path, const char *opacity_path,
                                              bool linear, lum_id ret_id, struct lum_error *err);

/* ---- assimp_node.c, assimp_light.c ---- */
LUM_MUST_USE enum lum_status lum_assimp_flatten_nodes(struct lum_assimp *a, struct lum_error *err); /* fills nodes */
LUM_MUST_USE enum lum_status lum_assimp_nodes(struct lum_assimp *a, struct lum_error *err);
LUM_MUST_USE enum lum_status lum_assimp_lights(struct lum_assimp *a, struct lum_error *err);
LUM_MUST_USE enum lum_status lum_assimp_cameras(struct lum_assimp *a, struct lum_error *err);
void lum_assimp_warn_units(struct lum_assimp *a);

#endif
