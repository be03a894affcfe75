/* Meshes: each primitive becomes one mesh record, or one for each fixture of what shines, shared by all nodes that show
 * it undeformed. */
#include <math.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/importer/gltf.h"
#include "server/importer/gltf_json.h"
#include "server/importer/gltf_ours.h"

enum mode { POINTS, LINES, LINE_LOOP, LINE_STRIP, TRIANGLES, STRIP, FAN };

struct triangles {
    uint32_t *indices; /* 3 n */
    uint32_t n;
};

static bool read_attribute(struct lum_gltf *g, const cJSON *attributes, const char *key, uint32_t n_components,
                           const struct lum_gltf_vertices *v, float **ret_values)
{
    uint32_t accessor = lum_gltf_index(g, attributes, key, LUM_GLTF_ACCESSORS), n = 0;
    *ret_values = NULL;
    if (accessor == LUM_GLTF_NONE)
        return lum_gltf_ok(g);
    if (!lum_gltf_floats(g, accessor, n_components, ret_values, &n))
        return false;
    if (n != v->n)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "%s has %u elements, POSITION %u", key, n, v->n);
    return true;
}

static void free_vertices(struct lum_gltf_vertices *v)
{
    lum_free(v->positions);
    lum_free(v->normals);
    lum_free(v->uvs);
    lum_free(v->tangents);
    lum_free(v->colors);
    memset(v, 0, sizeof *v);
}

/* Where the material asks for them, or all are to be kept; without normals a file's are to be ignored
 * (glTF 2.0, 3.7.2.1). uvs do instead of those that are not as they should be. */
static bool read_tangents(struct lum_gltf *g, const cJSON *attributes, const struct lum_gltf_material *material,
                          bool all, struct lum_gltf_vertices *v)
{
    enum lum_gltf_kind kind = g->at_kind;
    uint32_t at = g->at_index;
    if (!(all || (material->turns && v->normals)) || read_attribute(g, attributes, "TANGENT", 4, v, &v->tangents))
        return true;
    lum_free(v->tangents);
    v->tangents = NULL;
    return lum_gltf_go_on_without(g, "tangents", kind, at);
}

static bool read_vertices(struct lum_gltf *g, const cJSON *primitive, const struct lum_gltf_material *material,
                          bool all, struct lum_gltf_vertices *v)
{
    static const char *const uv_keys[16] = {
        "TEXCOORD_0",  "TEXCOORD_1",  "TEXCOORD_2",  "TEXCOORD_3",  "TEXCOORD_4",  "TEXCOORD_5",
        "TEXCOORD_6",  "TEXCOORD_7",  "TEXCOORD_8",  "TEXCOORD_9",  "TEXCOORD_10", "TEXCOORD_11",
        "TEXCOORD_12", "TEXCOORD_13", "TEXCOORD_14", "TEXCOORD_15",
    };
    const cJSON *attributes = lum_gltf_object(g, primitive, "attributes");
    uint32_t position = lum_gltf_index(g, attributes, "POSITION", LUM_GLTF_ACCESSORS);
    if (!lum_gltf_ok(g))
        return false;
    if (position == LUM_GLTF_NONE)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "a primitive has no POSITION");
    if (!lum_gltf_floats(g, position, 3, &v->positions, &v->n))
        return false;
    if (v->n > LUM_LIMIT_VERTICES)
        return lum_gltf_fail(g, LUM_ERR_LIMIT, "has %u vertices, over the limit of %u", v->n, LUM_LIMIT_VERTICES);
    return read_attribute(g, attributes, "NORMAL", 3, v, &v->normals) &&
           read_attribute(g, attributes, uv_keys[material->uv_set], 2, v, &v->uvs) &&
           read_tangents(g, attributes, material, all, v) && read_attribute(g, attributes, "COLOR_0", 3, v, &v->colors);
}

/* ---- indices ---- */

static bool read_index_list(struct lum_gltf *g, const cJSON *primitive, uint32_t n_vertices, uint32_t **ret_list,
                            uint32_t *ret_n)
{
    uint32_t accessor = lum_gltf_index(g, primitive, "indices", LUM_GLTF_ACCESSORS);
    if (!lum_gltf_ok(g))
        return false;
    if (accessor == LUM_GLTF_NONE) {
        uint32_t *list = lum_calloc(n_vertices, sizeof *list);
        if (!list)
            return lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory for %u indices", n_vertices);
        for (uint32_t i = 0; i < n_vertices; i++)
            list[i] = i;
        *ret_list = list;
        *ret_n = n_vertices;
        return true;
    }
    if (!lum_gltf_uints(g, accessor, 1, ret_list, ret_n))
        return false;
    for (uint32_t i = 0; i < *ret_n; i++)
        if ((*ret_list)[i] >= n_vertices) {
            uint32_t bad = (*ret_list)[i];
            lum_free(*ret_list);
            return lum_gltf_fail(g, LUM_ERR_INVALID, "index %u of %u vertices", bad, n_vertices);
        }
    return true;
}

/* Strips and fans to lists (glTF 2.0, 3.7.2.1): triangle i of a strip is (i, i+1, i+2) turned every other time, of a
 * fan (i+1, i+2, 0). */
static bool unroll(struct lum_gltf *g, enum mode mode, const uint32_t *list, uint32_t n,
                   struct triangles *ret_triangles)
{
    uint32_t n_triangles = mode == TRIANGLES ? n / 3 : n < 3 ? 0 : n - 2;
    uint32_t *to = lum_calloc((size_t)n_triangles * 3 + 1, sizeof *to);
    if (!to)
        return lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory for %u triangles", n_triangles);
    for (uint32_t i = 0; i < n_triangles; i++) {
        uint32_t a = mode == TRIANGLES ? 3 * i : mode == STRIP ? i : i + 1;
        uint32_t b = mode == STRIP ? a + 1 + i % 2 : a + 1;
        uint32_t c = mode == FAN ? 0 : mode == STRIP ? a + 2 - i % 2 : a + 2;
        to[3 * (size_t)i] = list[a];
        to[3 * (size_t)i + 1] = list[b];
        to[3 * (size_t)i + 2] = list[c];
    }
    *ret_triangles = (struct triangles){to, n_triangles};
    return true;
}

static bool read_triangles(struct lum_gltf *g, const cJSON *primitive, enum mode mode, uint32_t n_vertices,
                           struct triangles *ret_triangles)
{
    uint32_t *list = NULL, n = 0;
    if (!read_index_list(g, primitive, n_vertices, &list, &n))
        return false;
    bool ok = unroll(g, mode, list, n, ret_triangles);
    lum_free(list);
    if (ok && ret_triangles->n > LUM_LIMIT_TRIANGLES) {
        lum_free(ret_triangles->indices);
        ret_triangles->indices = NULL;
        return lum_gltf_fail(g, LUM_ERR_LIMIT, "has %u triangles, over the limit of %u", ret_triangles->n,
                             LUM_LIMIT_TRIANGLES);
    }
    return ok;
}

/* ---- sending ---- */

static bool deform(struct lum_gltf *g, const cJSON *mesh, const cJSON *primitive, const struct lum_gltf_pose *pose,
                   struct lum_gltf_vertices *v)
{
    const cJSON *weights = pose->weights ? pose->weights : lum_gltf_list(g, mesh, "weights");
    return lum_gltf_morph(g, primitive, weights, v) &&
           (pose->skin == LUM_GLTF_NONE || lum_gltf_skin(g, primitive, pose->skin, v));
}

/* What is no direction that a mesh may have becomes none. */
static void clamp_tangents(struct lum_gltf_vertices *v)
{
    for (size_t i = 0; v->tangents && i < v->n; i++) {
        float *t = v->tangents + 4 * i;
        if (!(fabsf(t[0]) <= 1e6f) || !(fabsf(t[1]) <= 1e6f) || !(fabsf(t[2]) <= 1e6f))
            t[0] = t[1] = t[2] = 0.0f;
        t[3] = t[3] < 0.0f ? -1.0f : 1.0f;
    }
}

static void clamp_colors(struct lum_gltf_vertices *v)
{
    for (size_t i = 0; v->colors && i < 3 * (size_t)v->n; i++)
        v->colors[i] = v->colors[i] < 0.0f ? 0.0f : v->colors[i] > 1.0f ? 1.0f : v->colors[i];
}

/* One that has the same arrays, and was sent with the id that this one has. */
static bool is_same_mesh(struct lum_gltf *g, uint32_t other, uint32_t mesh)
{
    const cJSON *lists[2] = {lum_gltf_list(g, lum_gltf_item(g, LUM_GLTF_MESHES, other), "primitives"),
                             lum_gltf_list(g, lum_gltf_item(g, LUM_GLTF_MESHES, mesh), "primitives")};
    static const char *const keys[] = {"attributes", "indices", "mode"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(keys); i++) {
        const cJSON *a = cJSON_GetObjectItemCaseSensitive(lists[0] ? lists[0]->child : NULL, keys[i]),
                    *b = cJSON_GetObjectItemCaseSensitive(lists[1] ? lists[1]->child : NULL, keys[i]);
        if ((a || b) && !cJSON_Compare(a, b, true))
            return false;
    }
    return true;
}

static void take_exact(struct lum_gltf *g, const cJSON *ours, const char *key, size_t n, struct lum_mesh_exact *ret)
{
    struct lum_gltf_view view;
    bool doubles;
    const cJSON *exact = cJSON_GetObjectItemCaseSensitive(ours, "exact");
    if (lum_gltf_ours_bytes(g, exact, key, &view, &doubles) && view.n == n * (doubles ? sizeof(double) : sizeof(float)))
        *ret = (struct lum_mesh_exact){view.data, doubles};
}

/* As lumend has written it: with its id, whole, and arrays as they were. */
static enum lum_status send_known(struct lum_gltf *g, uint32_t mesh, const char *id, const struct lum_mesh_arrays *m,
                                  struct lum_error *err)
{
    const cJSON *ours = lum_gltf_ours(lum_gltf_item(g, LUM_GLTF_MESHES, mesh));
    struct lum_mesh_known known = {.id = id};
    enum lum_status status = lum_ids_take(&g->im->ids, id, mesh, err);
    size_t n = m->n_vertices;
    take_exact(g, ours, "positions", 3 * n, &known.positions);
    take_exact(g, ours, "normals", 3 * n, &known.normals);
    take_exact(g, ours, "uvs", 2 * n, &known.uvs);
    take_exact(g, ours, "tangents", 4 * n, &known.tangents);
    take_exact(g, ours, "colors", 3 * n, &known.colors);
    known.deforming = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(ours, "deforming"));
    const cJSON *shape = g->is_ours ? cJSON_GetObjectItemCaseSensitive(ours, "record") : NULL;
    if (!status && shape)
        return lum_gltf_send_shape(g, shape, id, err);
    return status ? status : lum_mesh_send_known(g->im, &known, m, err);
}

static enum lum_status one_part(const char *id, struct lum_mesh_parts *ret_parts, struct lum_error *err)
{
    ret_parts->ids = lum_calloc(1, sizeof(lum_id));
    if (!ret_parts->ids)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a mesh");
    ret_parts->n = 1;
    memcpy(ret_parts->ids[0], id, strlen(id) + 1);
    return LUM_OK;
}

static bool send_primitive(struct lum_gltf *g, uint32_t mesh, const cJSON *primitive, const struct lum_gltf_pose *pose,
                           struct lum_mesh_parts *ret_parts)
{
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_MESHES, mesh);
    uint64_t mode = lum_gltf_uint(g, primitive, "mode", TRIANGLES, FAN);
    const struct lum_gltf_material *material =
        lum_gltf_material(g, lum_gltf_index(g, primitive, "material", LUM_GLTF_MATERIALS));
    if (!lum_gltf_ok(g) || !material)
        return false;
    if (mode < TRIANGLES) {
        lum_gltf_warn(g, "points and lines are left out");
        return true;
    }
    struct lum_gltf_vertices v = {0};
    struct triangles t = {0};
    struct lum_error err = {0};
    lum_id id;
    uint32_t other;
    bool plain = pose->skin == LUM_GLTF_NONE && !pose->weights && !primitive->next && !primitive->prev->next &&
                 !lum_gltf_list(g, primitive, "targets");
    bool known = plain && lum_gltf_ours_id(g, lum_gltf_ours(o), id);
    if (known && lum_ids_find(&g->im->ids, id, &other)) {
        known = other < g->arrays[LUM_GLTF_MESHES].n && is_same_mesh(g, other, mesh);
        if (known)
            return !one_part(id, ret_parts, &err) || lum_gltf_fail(g, err.status, "%s", err.text);
    }
    struct lum_id_request name = {"mesh/", lum_gltf_string(g, o, "name"), "mesh", mesh};
    bool ok = read_vertices(g, primitive, material, known, &v) &&
              read_triangles(g, primitive, (enum mode)mode, v.n, &t) && deform(g, o, primitive, pose, &v);
    if (ok) {
        if (!known)
            clamp_colors(&v);
        clamp_tangents(&v);
        struct lum_mesh_arrays m = {v.positions, v.normals, v.uvs, v.tangents, v.colors, t.indices, v.n, t.n};
        uint32_t n_lamps = material->shines && material->evenly ? g->n_shown[mesh] : 0;
        enum lum_status status =
            known ? one_part(id, ret_parts, &err) : lum_mesh_send(g->im, &name, &m, n_lamps, ret_parts, &err);
        if (!status && known)
            status = send_known(g, mesh, id, &m, &err);
        if (status && known)
            lum_mesh_parts_finish(ret_parts);
        ok = !status || lum_gltf_fail(g, status, "%s", err.text);
    }
    free_vertices(&v);
    lum_free(t.indices);
    return ok;
}

void lum_gltf_mesh_finish(struct lum_gltf_mesh *mesh)
{
    for (uint32_t i = 0; mesh->parts && i < mesh->n_primitives; i++)
        lum_mesh_parts_finish(&mesh->parts[i]);
    lum_free(mesh->parts);
    *mesh = (struct lum_gltf_mesh){0};
}

static bool send_primitives(struct lum_gltf *g, uint32_t index, const struct lum_gltf_pose *pose,
                            struct lum_gltf_mesh *ret_mesh)
{
    const cJSON *list = lum_gltf_list(g, lum_gltf_item(g, LUM_GLTF_MESHES, index), "primitives");
    if (!lum_gltf_ok(g))
        return false;
    int n = cJSON_GetArraySize(list);
    if (n < 1)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "has no primitives");
    struct lum_gltf_mesh mesh = {lum_calloc((size_t)n, sizeof *mesh.parts), (uint32_t)n};
    if (!mesh.parts)
        return lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory for %d primitives", n);
    const cJSON *primitive = list->child;
    for (int i = 0; i < n; i++, primitive = primitive->next)
        if (!send_primitive(g, index, primitive, pose, &mesh.parts[i])) {
            lum_gltf_mesh_finish(&mesh);
            return false;
        }
    *ret_mesh = mesh;
    return true;
}

bool lum_gltf_mesh(struct lum_gltf *g, uint32_t index, const struct lum_gltf_pose *pose, struct lum_gltf_mesh *ret_mesh,
                   bool *ret_owned)
{
    bool posed = pose->skin != LUM_GLTF_NONE || pose->weights;
    struct lum_gltf_mesh *shared = &g->meshes[index];
    *ret_owned = posed;
    if (!posed && shared->parts) {
        *ret_mesh = *shared;
        return true;
    }
    enum lum_gltf_kind kind = g->at_kind;
    uint32_t at = g->at_index;
    lum_gltf_at(g, LUM_GLTF_MESHES, index);
    if (!send_primitives(g, index, pose, ret_mesh))
        return false;
    if (!posed)
        *shared = *ret_mesh;
    lum_gltf_at(g, kind, at);
    return true;
}

uint32_t lum_gltf_mesh_material(struct lum_gltf *g, uint32_t mesh, uint32_t primitive)
{
    const cJSON *p = lum_gltf_list(g, lum_gltf_item(g, LUM_GLTF_MESHES, mesh), "primitives");
    p = p ? p->child : NULL;
    for (uint32_t i = 0; p && i < primitive; i++)
        p = p->next;
    return lum_gltf_index(g, p, "material", LUM_GLTF_MATERIALS);
}
