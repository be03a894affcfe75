/* Meshes as they are sent: one record, or one for each fixture of what shines. */
#ifndef LUM_SERVER_IMPORTER_MESH_H
#define LUM_SERVER_IMPORTER_MESH_H

#include "server/importer/importer.h"

struct lum_mesh_arrays {
    float *positions, *normals, *uvs, *tangents,
        *colors;       /* 3, 3, 2, 4, 3 per vertex; all but positions NULL when absent */
    uint32_t *indices; /* 3 * n_triangles */
    uint32_t n_vertices, n_triangles;
};
/* An array in place of one of those. */
struct lum_mesh_exact {
    const void *bytes; /* NULL: none */
    bool doubles;
};
/* A mesh that lumend has written: with the id that it had. */
struct lum_mesh_known {
    const char *id;
    struct lum_mesh_exact positions, normals, uvs, tangents, colors;
    bool deforming;
};
LUM_MUST_USE enum lum_status lum_mesh_send_known(struct lum_importer *im, const struct lum_mesh_known *known,
                                                 const struct lum_mesh_arrays *m, struct lum_error *err);

/* Ids of the records of one mesh, owned; none when it shows no triangle. */
struct lum_mesh_parts {
    lum_id *ids;
    uint32_t n;
};
void lum_mesh_parts_finish(struct lum_mesh_parts *parts);

/* n_lamps: objects that show it, if it shines evenly, so that its fixtures are sent apart; else 0. On failure ret_parts
 * is empty. */
LUM_MUST_USE enum lum_status lum_mesh_send(struct lum_importer *im, const struct lum_id_request *name,
                                           const struct lum_mesh_arrays *m, uint32_t n_lamps,
                                           struct lum_mesh_parts *ret_parts, struct lum_error *err);

#endif
