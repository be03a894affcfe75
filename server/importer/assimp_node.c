/* Meshes and the node hierarchy of an Assimp scene. */
#include <math.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/importer/assimp.h"

/* ---- meshes ---- */

static uint32_t *copy_indices(const struct aiMesh *m, uint32_t *ret_n)
{
    uint32_t n = 0;
    uint32_t *to = lum_calloc((size_t)m->mNumFaces * 3 + 1, sizeof *to);
    for (unsigned i = 0; to && i < m->mNumFaces; i++) {
        const struct aiFace *f = &m->mFaces[i];
        if (f->mNumIndices != 3 || f->mIndices[0] >= m->mNumVertices || f->mIndices[1] >= m->mNumVertices ||
            f->mIndices[2] >= m->mNumVertices)
            continue; /* lines and points that triangulation left */
        memcpy(to + 3 * (size_t)n++, f->mIndices, 3 * sizeof *to);
    }
    *ret_n = n;
    return to;
}

/* n components of each 3- or 4-float element; NULL when memory is short. Values that are not finite become 0. */
static float *copy_floats(const float *from, uint32_t stride, uint32_t n_components, uint32_t n)
{
    float *to = lum_calloc((size_t)n * n_components, sizeof *to);
    for (size_t i = 0; to && i < (size_t)n * n_components; i++) {
        float v = from[i / n_components * stride + i % n_components];
        to[i] = isfinite(v) ? v : 0.0f;
    }
    return to;
}

static bool copy_arrays(const struct aiMesh *m, struct lum_mesh_arrays *a)
{
    uint32_t n = a->n_vertices = m->mNumVertices;
    a->indices = copy_indices(m, &a->n_triangles);
    a->positions = copy_floats(&m->mVertices[0].x, 3, 3, n);
    bool ok = a->indices && a->positions;
    if (ok && m->mNormals)
        ok = (a->normals = copy_floats(&m->mNormals[0].x, 3, 3, n)) != NULL;
    if (ok && m->mTextureCoords[0])
        ok = (a->uvs = copy_floats(&m->mTextureCoords[0][0].x, 3, 2, n)) != NULL;
    if (ok && m->mColors[0])
        ok = (a->colors = copy_floats(&m->mColors[0][0].r, 4, 3, n)) != NULL;
    for (size_t i = 0; ok && a->colors && i < 3 * (size_t)n; i++)
        a->colors[i] = fminf(fmaxf(a->colors[i], 0.0f), 1.0f);
    return ok;
}

static void free_arrays(struct lum_mesh_arrays *a)
{
    lum_free(a->indices);
    lum_free(a->positions);
    lum_free(a->normals);
    lum_free(a->uvs);
    lum_free(a->colors);
}

/* After its material: which says whether it shines. */
static enum lum_status send_mesh(struct lum_assimp *a, uint32_t i, struct lum_error *err)
{
    const struct aiMesh *m = a->scene->mMeshes[i];
    struct lum_mesh_arrays arrays = {0};
    const struct lum_assimp_material *material = &a->materials[m->mMaterialIndex];
    if (m->mNumVertices == 0 || !m->mVertices || m->mNumFaces == 0)
        return LUM_OK;
    if (m->mNumVertices > LUM_LIMIT_VERTICES || m->mNumFaces > LUM_LIMIT_TRIANGLES)
        return lum_fail(err, LUM_ERR_LIMIT, "", "a mesh has more than %u vertices or triangles", LUM_LIMIT_VERTICES);
    struct lum_id_request name = {"mesh/", m->mName.data, "mesh", i};
    enum lum_status status = LUM_OK;
    uint32_t n_lamps = material->shines && material->evenly ? a->n_shown[i] : 0;
    if (copy_arrays(m, &arrays))
        status = lum_mesh_send(a->im, &name, &arrays, n_lamps, &a->meshes[i], err);
    else
        status = lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a mesh of %u vertices", m->mNumVertices);
    free_arrays(&arrays);
    return status;
}

/* ---- nodes ---- */

static struct lum_affined from_matrix(const struct aiMatrix4x4 *m)
{
    return (struct lum_affined){{
        {(double)m->a1, (double)m->a2, (double)m->a3, (double)m->a4},
        {(double)m->b1, (double)m->b2, (double)m->b3, (double)m->b4},
        {(double)m->c1, (double)m->c2, (double)m->c3, (double)m->c4},
    }};
}

static bool add_node(struct lum_assimp *a, const struct aiNode *node, const struct lum_affined *parent)
{
    if (a->n_nodes == a->nodes_cap) {
        size_t cap = a->nodes_cap ? 2 * a->nodes_cap : 64;
        struct lum_assimp_node *grown = lum_calloc(cap, sizeof *grown);
        if (!grown)
            return false;
        if (a->n_nodes)
            memcpy(grown, a->nodes, a->n_nodes * sizeof *grown);
        lum_free(a->nodes);
        a->nodes = grown;
        a->nodes_cap = cap;
    }
    struct lum_affined local = from_matrix(&node->mTransformation);
    a->nodes[a->n_nodes++] = (struct lum_assimp_node){node, lum_affined_mul(parent, &local)};
    return true;
}

enum lum_status lum_assimp_flatten_nodes(struct lum_assimp *a, struct lum_error *err)
{
    struct lum_affined world = lum_affined_identity();
    bool ok = !a->scene->mRootNode || add_node(a, a->scene->mRootNode, &world);
    for (size_t i = 0; ok && i < a->n_nodes; i++) {
        const struct lum_assimp_node parent = a->nodes[i];
        for (unsigned k = 0; ok && k < parent.node->mNumChildren; k++)
            ok = add_node(a, parent.node->mChildren[k], &parent.to_world);
    }
    return ok ? LUM_OK : lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for nodes");
}

static enum lum_status send_object(struct lum_assimp *a, const struct lum_assimp_node *v, uint32_t mesh, uint32_t part,
                                   struct lum_error *err)
{
    const struct aiMesh *m = a->scene->mMeshes[mesh];
    const struct lum_assimp_material *material = &a->materials[m->mMaterialIndex];
    lum_id id;
    struct lum_op_text op;
    double matrix[16] = {[15] = 1.0};
    memcpy(matrix, v->to_world.m, sizeof v->to_world.m);
    /* Formats without nodes give all meshes to one that is named after the file; their own names say more. */
    const char *label = v->node->mNumMeshes > 1 && m->mName.length ? m->mName.data : v->node->mName.data;
    struct lum_id_request name = {"", label, "object", mesh};
    enum lum_status status = lum_ids_make(&a->im->ids, &name, id, err);
    if (status)
        return status;
    lum_op_begin(&op, "object", id);
    lum_op_string(&op, "mesh", a->meshes[mesh].ids[part]);
    lum_op_string(&op, "material", material->id);
    lum_op_numbers(&op, "transform", matrix, 16);
    if (material->shines)
        lum_op_string(&op, "group", material->id);
    return lum_emit_op(&a->im->emit, &op, err);
}

static enum lum_status show_mesh(struct lum_assimp *a, const struct lum_assimp_node *v, uint32_t mesh,
                                 struct lum_error *err)
{
    if (mesh >= a->scene->mNumMeshes || a->scene->mMeshes[mesh]->mMaterialIndex >= a->scene->mNumMaterials)
        return lum_fail(err, LUM_ERR_INVALID, "", "a node names a mesh or material that is not there");
    if (!lum_op_transform_fits(&v->to_world)) {
        lum_emit_warning(&a->im->emit, "%.60s is left out: its transform is not invertible or out of range",
                         v->node->mName.data);
        return LUM_OK;
    }
    enum lum_status status = lum_assimp_material(a, a->scene->mMeshes[mesh]->mMaterialIndex, err);
    if (!status && !a->meshes[mesh].n)
        status = send_mesh(a, mesh, err);
    for (uint32_t part = 0; part < a->meshes[mesh].n && !status; part++)
        status = send_object(a, v, mesh, part, err);
    return status;
}

static void count_shown(struct lum_assimp *a)
{
    for (size_t i = 0; i < a->n_nodes; i++)
        for (unsigned k = 0; k < a->nodes[i].node->mNumMeshes; k++)
            if (a->nodes[i].node->mMeshes[k] < a->scene->mNumMeshes)
                a->n_shown[a->nodes[i].node->mMeshes[k]]++;
}

enum lum_status lum_assimp_nodes(struct lum_assimp *a, struct lum_error *err)
{
    enum lum_status status = LUM_OK;
    count_shown(a);
    for (size_t i = 0; i < a->n_nodes && !status; i++) {
        const struct lum_assimp_node *v = &a->nodes[i];
        for (unsigned k = 0; k < v->node->mNumMeshes && !status; k++)
            status = show_mesh(a, v, v->node->mMeshes[k], err);
    }
    return status;
}
