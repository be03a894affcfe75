/* Meshes: each primitive becomes one mesh record, or one for each fixture of what shines, shared by all nodes that show
 * it undeformed. */
#include <math.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/importer/gltf.h"
#include "server/importer/gltf_json.h"

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

/* Where the material asks for them; without normals a file's are to be ignored (glTF 2.0, 3.7.2.1). uvs do instead of
 * those that are not as they should be. */
static bool read_tangents(struct lum_gltf *g, const cJSON *attributes, const struct lum_gltf_material *material,
                          struct lum_gltf_vertices *v)
{
    enum lum_gltf_kind kind = g->at_kind;
    uint32_t at = g->at_index;
    if (!material->turns || !v->normals || read_attribute(g, attributes, "TANGENT", 4, v, &v->tangents))
        return true;
    lum_free(v->tangents);
    v->tangents = NULL;
    return lum_gltf_go_on_without(g, "tangents", kind, at);
}

static bool read_vertices(struct lum_gltf *g, const cJSON *primitive, const struct lum_gltf_material *material,
                          struct lum_gltf_vertices *v)
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
           read_tangents(g, attributes, material, v) && read_attribute(g, attributes, "COLOR_0", 3, v, &v->colors);
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
    struct lum_id_request name = {"mesh/", lum_gltf_string(g, o, "name"), "mesh", mesh};
    bool ok = read_vertices(g, primitive, material, &v) && read_triangles(g, primitive, (enum mode)mode, v.n, &t) &&
              deform(g, o, primitive, pose, &v);
    if (ok) {
        clamp_colors(&v);
        clamp_tangents(&v);
        struct lum_mesh_arrays m = {v.positions, v.normals, v.uvs, v.tangents, v.colors, t.indices, v.n, t.n};
        uint32_t n_lamps = material->shines && material->evenly ? g->n_shown[mesh] : 0;
        enum lum_status status = lum_mesh_send(g->im, &name, &m, n_lamps, ret_parts, &err);
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
