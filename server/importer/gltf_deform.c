/* Morph targets at their default weights, and skins at the pose the nodes are in. */
#include <math.h>
#include <string.h>

#include "server/importer/gltf.h"
#include "server/importer/gltf_json.h"

/* ---- morph targets ---- */

/* stride: floats from one vertex of `to` to the next. */
static bool add_scaled(struct lum_gltf *g, uint32_t accessor, double weight, const struct lum_gltf_vertices *v,
                       float *to, size_t stride)
{
    float *delta = NULL;
    uint32_t n = 0;
    if (!lum_gltf_floats(g, accessor, 3, &delta, &n))
        return false;
    bool ok = n == v->n || lum_gltf_fail(g, LUM_ERR_INVALID, "a morph target has %u elements, POSITION %u", n, v->n);
    for (size_t i = 0; ok && i < 3 * (size_t)n; i++)
        to[i / 3 * stride + i % 3] += (float)weight * delta[i];
    lum_free(delta);
    return ok;
}

bool lum_gltf_morph(struct lum_gltf *g, const cJSON *primitive, const cJSON *weights, struct lum_gltf_vertices *v)
{
    const cJSON *targets = lum_gltf_list(g, primitive, "targets");
    enum lum_gltf_kind kind = g->at_kind;
    uint32_t at = g->at_index;
    const cJSON *target = targets ? targets->child : NULL, *weight = weights ? weights->child : NULL;
    for (; target && weight; target = target->next, weight = weight->next) {
        if (!cJSON_IsNumber(weight) || !isfinite(weight->valuedouble))
            return lum_gltf_fail(g, LUM_ERR_INVALID, "weights must be finite numbers");
        if (weight->valuedouble == 0.0)
            continue;
        uint32_t position = lum_gltf_index(g, target, "POSITION", LUM_GLTF_ACCESSORS);
        uint32_t normal = lum_gltf_index(g, target, "NORMAL", LUM_GLTF_ACCESSORS);
        uint32_t tangent = lum_gltf_index(g, target, "TANGENT", LUM_GLTF_ACCESSORS);
        if (!lum_gltf_ok(g))
            return false;
        if (position != LUM_GLTF_NONE && !add_scaled(g, position, weight->valuedouble, v, v->positions, 3))
            return false;
        if (normal != LUM_GLTF_NONE && v->normals && !add_scaled(g, normal, weight->valuedouble, v, v->normals, 3))
            return false;
        if (tangent != LUM_GLTF_NONE && v->tangents &&
            !add_scaled(g, tangent, weight->valuedouble, v, v->tangents, 4) &&
            !lum_gltf_go_on_without(g, "tangents of a morph target", kind, at))
            return false;
    }
    return lum_gltf_ok(g);
}

/* ---- skins ---- */

struct skin {
    struct lum_affined *joint_to_world; /* joint's place after its inverse bind matrix */
    uint32_t n;
};

/* Column-major 4x4 of a file to an affine map. */
static struct lum_affined from_columns(const float *m)
{
    struct lum_affined a;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 4; c++)
            a.m[r][c] = (double)m[4 * c + r];
    return a;
}

static bool read_skin(struct lum_gltf *g, uint32_t index, struct skin *ret_skin)
{
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_SKINS, index);
    const cJSON *joints = lum_gltf_list(g, o, "joints");
    uint32_t accessor = lum_gltf_index(g, o, "inverseBindMatrices", LUM_GLTF_ACCESSORS);
    float *inverse = NULL;
    uint32_t n_inverse = 0, n = joints ? (uint32_t)cJSON_GetArraySize(joints) : 0;
    if (!lum_gltf_ok(g))
        return false;
    if (n == 0)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "a skin has no joints");
    if (accessor != LUM_GLTF_NONE && !lum_gltf_floats(g, accessor, 16, &inverse, &n_inverse))
        return false;
    struct skin skin = {lum_calloc(n, sizeof *skin.joint_to_world), n};
    if (!skin.joint_to_world)
        lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory for %u joints", n);
    else if (inverse && n_inverse < n)
        lum_gltf_fail(g, LUM_ERR_INVALID, "a skin has %u joints but %u inverse bind matrices", n, n_inverse);
    const cJSON *joint = joints->child;
    for (uint32_t i = 0; lum_gltf_ok(g) && i < n; i++, joint = joint->next) {
        uint32_t node = 0;
        if (!lum_gltf_index_value(g, joint, "joints", LUM_GLTF_NODES, &node))
            break;
        struct lum_affined bind = inverse ? from_columns(inverse + 16 * (size_t)i) : lum_affined_identity();
        skin.joint_to_world[i] = lum_affined_mul(&g->nodes[node].to_world, &bind);
    }
    lum_free(inverse);
    if (!lum_gltf_ok(g)) {
        lum_free(skin.joint_to_world);
        return false;
    }
    *ret_skin = skin;
    return true;
}

/* The weighted sum of the maps of a vertex's joints. */
struct blend {
    struct lum_affined sum;
    double weight;
};

static void add_map(struct blend *b, const struct lum_affined *map, double weight)
{
    b->weight += weight;
    for (int k = 0; k < 12; k++)
        b->sum.m[k / 4][k % 4] += weight * map->m[k / 4][k % 4];
}

/* Adds set 0 or 1 ("JOINTS_0", "WEIGHTS_0") of each vertex. */
static bool add_influences(struct lum_gltf *g, const cJSON *attributes, const struct skin *skin, int set,
                           uint32_t n_vertices, struct blend *blends)
{
    uint32_t joints_at = lum_gltf_index(g, attributes, set ? "JOINTS_1" : "JOINTS_0", LUM_GLTF_ACCESSORS);
    uint32_t weights_at = lum_gltf_index(g, attributes, set ? "WEIGHTS_1" : "WEIGHTS_0", LUM_GLTF_ACCESSORS);
    if (joints_at == LUM_GLTF_NONE || weights_at == LUM_GLTF_NONE)
        return lum_gltf_ok(g);
    uint32_t *joints = NULL, n_joints = 0, n_weights = 0;
    float *weights = NULL;
    bool ok =
        lum_gltf_uints(g, joints_at, 4, &joints, &n_joints) && lum_gltf_floats(g, weights_at, 4, &weights, &n_weights);
    if (ok && (n_joints != n_vertices || n_weights != n_vertices))
        ok = lum_gltf_fail(g, LUM_ERR_INVALID, "JOINTS and WEIGHTS must have as many elements as POSITION");
    for (size_t i = 0; ok && i < 4 * (size_t)n_vertices; i++) {
        if (weights[i] == 0.0f)
            continue;
        if (joints[i] >= skin->n)
            ok = lum_gltf_fail(g, LUM_ERR_INVALID, "joint %u of %u", joints[i], skin->n);
        else
            add_map(&blends[i / 4], &skin->joint_to_world[joints[i]], (double)weights[i]);
    }
    lum_free(joints);
    lum_free(weights);
    return ok;
}

/* Normals go by the cofactor matrix: right for any scale, and defined where the inverse is not. */
static struct lum_vec3 turn_normal(const struct lum_affined *a, const float *n)
{
    const double(*m)[4] = a->m;
    double r[3];
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        r[i] = (m[j][1] * m[k][2] - m[j][2] * m[k][1]) * (double)n[0] +
               (m[j][2] * m[k][0] - m[j][0] * m[k][2]) * (double)n[1] +
               (m[j][0] * m[k][1] - m[j][1] * m[k][0]) * (double)n[2];
    }
    return lum_normalize(lum_v3((float)r[0], (float)r[1], (float)r[2]));
}

/* Tangents go as the surface does, and stay unit, however it is scaled. Bitangents keep their sign: where the surface
 * is mirrored, the cofactors turn its normals round. */
static void move_tangent(const struct lum_affined *a, float *t)
{
    double d[3];
    for (int i = 0; i < 3; i++)
        d[i] = a->m[i][0] * (double)t[0] + a->m[i][1] * (double)t[1] + a->m[i][2] * (double)t[2];
    double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int i = 0; i < 3; i++)
        t[i] = length > 0.0 ? (float)(d[i] / length) : 0.0f;
}

static void move_vertex(const struct lum_affined *a, struct lum_gltf_vertices *v, uint32_t i)
{
    float *p = v->positions + 3 * (size_t)i;
    struct lum_vec3d q = lum_affined_point(a, (struct lum_vec3d){(double)p[0], (double)p[1], (double)p[2]});
    p[0] = (float)q.x;
    p[1] = (float)q.y;
    p[2] = (float)q.z;
    if (v->tangents)
        move_tangent(a, v->tangents + 4 * (size_t)i);
    if (!v->normals)
        return;
    float *n = v->normals + 3 * (size_t)i;
    struct lum_vec3 turned = turn_normal(a, n);
    n[0] = turned.x;
    n[1] = turned.y;
    n[2] = turned.z;
}

/* Weights stored in bytes do not sum to 1 exactly, so they are normalised; a vertex that no joint holds stays where it
 * is. */
static bool move_vertices(struct lum_gltf *g, struct blend *blends, struct lum_gltf_vertices *v)
{
    for (uint32_t i = 0; i < v->n; i++) {
        struct blend *b = &blends[i];
        if (!(b->weight > 0.0))
            continue;
        for (int k = 0; k < 12; k++)
            b->sum.m[k / 4][k % 4] /= b->weight;
        move_vertex(&b->sum, v, i);
        const float *p = v->positions + 3 * (size_t)i;
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2]))
            return lum_gltf_fail(g, LUM_ERR_INVALID, "skinning moves vertex %u out of range", i);
    }
    return true;
}

/* After this the vertices are in the world: the node's own transform does not apply (glTF 2.0, 3.7.3.3). */
bool lum_gltf_skin(struct lum_gltf *g, const cJSON *primitive, uint32_t index, struct lum_gltf_vertices *v)
{
    const cJSON *attributes = lum_gltf_object(g, primitive, "attributes");
    struct skin skin = {0};
    if (!read_skin(g, index, &skin))
        return false;
    struct blend *blends = lum_calloc(v->n, sizeof *blends);
    bool ok = blends != NULL;
    if (!ok)
        lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory to skin %u vertices", v->n);
    ok = ok && add_influences(g, attributes, &skin, 0, v->n, blends) &&
         add_influences(g, attributes, &skin, 1, v->n, blends) && move_vertices(g, blends, v);
    lum_free(blends);
    lum_free(skin.joint_to_world);
    return ok;
}
