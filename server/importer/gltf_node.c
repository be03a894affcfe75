/* The node hierarchy: every node's place in the world, and the records of what the nodes show.
 *
 * glTF nodes are strict trees. A node with two parents, or in a cycle, is refused, so the work is linear in the file's
 * size; nothing here recurses, so depth does not matter. */
#include <stdio.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/importer/gltf.h"
#include "server/importer/gltf_json.h"
#include "server/importer/gltf_ours.h"

/* ---- places ---- */

static struct lum_affined from_trs(const double t[3], const double q[4], const double s[3])
{
    double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    double f = n > 0.0 ? 2.0 / n : 0.0; /* normalises; the zero quaternion is the identity */
    double x = q[0], y = q[1], z = q[2], w = q[3];
    double r[3][3] = {
        {1.0 - f * (y * y + z * z), f * (x * y - w * z), f * (x * z + w * y)},
        {f * (x * y + w * z), 1.0 - f * (x * x + z * z), f * (y * z - w * x)},
        {f * (x * z - w * y), f * (y * z + w * x), 1.0 - f * (x * x + y * y)},
    };
    struct lum_affined a;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            a.m[i][j] = r[i][j] * s[j];
        a.m[i][3] = t[i];
    }
    return a;
}

static struct lum_affined read_local(struct lum_gltf *g, const cJSON *o)
{
    double m[16], t[3] = {0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    if (lum_gltf_numbers(g, o, "matrix", m, 16)) {
        struct lum_affined a;
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 4; c++)
                a.m[r][c] = m[4 * c + r];
        return a;
    }
    lum_gltf_numbers(g, o, "translation", t, 3);
    lum_gltf_numbers(g, o, "rotation", q, 4);
    lum_gltf_numbers(g, o, "scale", s, 3);
    return from_trs(t, q, s);
}

static bool link_children(struct lum_gltf *g, uint32_t node)
{
    const cJSON *children = lum_gltf_list(g, lum_gltf_item(g, LUM_GLTF_NODES, node), "children");
    for (const cJSON *c = children ? children->child : NULL; c; c = c->next) {
        uint32_t child = 0;
        if (!lum_gltf_index_value(g, c, "children", LUM_GLTF_NODES, &child))
            return false;
        if (g->nodes[child].parent != LUM_GLTF_NONE || child == node)
            return lum_gltf_fail(g, LUM_ERR_INVALID, "node %u has more than one parent", child);
        g->nodes[child].parent = node;
    }
    return lum_gltf_ok(g);
}

/* Breadth first from the roots; what is not reached lies on a cycle. */
static bool place_from_roots(struct lum_gltf *g, uint32_t *queue)
{
    uint32_t n = g->arrays[LUM_GLTF_NODES].n, head = 0, tail = 0;
    for (uint32_t i = 0; i < n; i++)
        if (g->nodes[i].parent == LUM_GLTF_NONE)
            queue[tail++] = i;
    while (head < tail) {
        uint32_t i = queue[head++];
        const cJSON *o = lum_gltf_item(g, LUM_GLTF_NODES, i);
        struct lum_gltf_node *node = &g->nodes[i];
        lum_gltf_at(g, LUM_GLTF_NODES, i);
        struct lum_affined local = read_local(g, o);
        const cJSON *visibility = lum_gltf_extension(g, o, "KHR_node_visibility");
        node->hidden = !lum_gltf_bool(g, visibility, "visible", true);
        node->to_world = local;
        if (node->parent != LUM_GLTF_NONE) {
            node->to_world = lum_affined_mul(&g->nodes[node->parent].to_world, &local);
            node->hidden |= g->nodes[node->parent].hidden;
        }
        const cJSON *children = lum_gltf_list(g, o, "children");
        for (const cJSON *c = children ? children->child : NULL; c; c = c->next)
            queue[tail++] = (uint32_t)c->valuedouble; /* checked by link_children */
        if (!lum_gltf_ok(g))
            return false;
    }
    if (tail < n)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "the nodes form a cycle");
    return true;
}

/* The scene shown: "scene", else the first; a file without scenes shows all its nodes. Parents come before children in
 * queue, so one pass over it spreads in_scene from the scene's roots. */
static bool mark_scene(struct lum_gltf *g, const uint32_t *queue)
{
    lum_gltf_at(g, LUM_GLTF_KIND_COUNT, 0);
    uint32_t scene = lum_gltf_index(g, g->root, "scene", LUM_GLTF_SCENES);
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_SCENES, scene == LUM_GLTF_NONE ? 0 : scene);
    const cJSON *roots = lum_gltf_list(g, o, "nodes");
    for (const cJSON *r = roots ? roots->child : NULL; r; r = r->next) {
        uint32_t node = 0;
        if (!lum_gltf_index_value(g, r, "scene.nodes", LUM_GLTF_NODES, &node))
            return false;
        g->nodes[node].in_scene = true;
    }
    for (uint32_t i = 0; i < g->arrays[LUM_GLTF_NODES].n; i++) {
        struct lum_gltf_node *node = &g->nodes[queue[i]];
        node->in_scene |= !o || (node->parent != LUM_GLTF_NONE && g->nodes[node->parent].in_scene);
    }
    return lum_gltf_ok(g);
}

bool lum_gltf_flatten_nodes(struct lum_gltf *g)
{
    uint32_t n = g->arrays[LUM_GLTF_NODES].n;
    for (uint32_t i = 0; i < n; i++)
        g->nodes[i].parent = LUM_GLTF_NONE;
    for (uint32_t i = 0; i < n; i++) {
        lum_gltf_at(g, LUM_GLTF_NODES, i);
        if (!link_children(g, i))
            return false;
    }
    lum_gltf_at(g, LUM_GLTF_KIND_COUNT, 0);
    uint32_t *queue = lum_calloc(n ? n : 1, sizeof *queue);
    if (!queue)
        return lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory for %u nodes", n);
    bool ok = place_from_roots(g, queue) && mark_scene(g, queue);
    lum_free(queue);
    return ok;
}

/* ---- records ---- */

struct shown {
    const char *mesh;
    const struct lum_gltf_material *material;
    bool hidden;
};

static bool send_object(struct lum_gltf *g, const struct lum_id_request *name, const struct shown *what,
                        const struct lum_affined *place)
{
    lum_id id;
    struct lum_error err;
    struct lum_op_text op;
    double m[16] = {[15] = 1.0};
    memcpy(m, place->m, sizeof place->m);
    enum lum_status status = lum_ids_make(&g->im->ids, name, id, &err);
    if (!status) {
        lum_op_begin(&op, "object", id);
        lum_op_string(&op, "mesh", what->mesh);
        lum_op_string(&op, "material", what->material->id);
        lum_op_numbers(&op, "transform", m, 16);
        lum_op_bool(&op, "visible", !what->hidden);
        if (what->material->shines)
            lum_op_string(&op, "group", what->material->id);
        status = lum_emit_op(&g->im->emit, &op, &err);
    }
    return !status || lum_gltf_fail(g, status, "%s", err.text);
}

struct primitive_place {
    const struct lum_id_request *name; /* of its node */
    uint32_t node, mesh, primitive;
    bool alone; /* the only one of its mesh */
    const struct lum_affined *place;
};

/* What shines is named after its material, too, where its mesh has several ("lamp.bulb" says more than "lamp-2"), and
 * where nothing else has a name. */
static bool emit_primitive(struct lum_gltf *g, const struct primitive_place *p, const struct lum_mesh_parts *parts)
{
    uint32_t index = lum_gltf_mesh_material(g, p->mesh, p->primitive);
    const struct lum_gltf_material *material = parts->n ? lum_gltf_material(g, index) : NULL;
    struct lum_id_request name = *p->name;
    char of_material[LUM_LIMIT_ID_BYTES + 1];
    const char *its = lum_gltf_string(g, lum_gltf_item(g, LUM_GLTF_MATERIALS, index), "name");
    bool named = name.name && name.name[0], shines = material && material->shines;
    if (shines && named && its && g->meshes[p->mesh].n_primitives != 1) {
        snprintf(of_material, sizeof of_material, "%.24s.%s", name.name, its);
        name.name = of_material;
    } else if (shines && !named) {
        name.name = its;
        name.fallback = "luminaire";
    }
    bool ok = material || !parts->n, sent = false;
    if (ok && parts->n == 1 && p->alone)
        ok = lum_gltf_emit_ours(g, p->node, parts->ids[0], material->id, &sent);
    for (uint32_t k = 0; ok && !sent && k < parts->n; k++)
        ok = send_object(g, &name, &(struct shown){parts->ids[k], material, g->nodes[p->node].hidden}, p->place);
    return ok;
}

static bool emit_mesh(struct lum_gltf *g, uint32_t node, uint32_t mesh_index)
{
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_NODES, node);
    struct lum_gltf_pose pose = {lum_gltf_index(g, o, "skin", LUM_GLTF_SKINS), lum_gltf_list(g, o, "weights")};
    struct lum_affined place = pose.skin == LUM_GLTF_NONE ? g->nodes[node].to_world : lum_affined_identity();
    struct lum_gltf_mesh mesh = {0};
    bool owned = false;
    if (!lum_gltf_ok(g))
        return false;
    if (!lum_op_transform_fits(&place)) {
        lum_gltf_warn(g, "its mesh is left out: the transform is not invertible or out of range");
        return true;
    }
    if (!lum_gltf_mesh(g, mesh_index, &pose, &mesh, &owned))
        return false;
    struct lum_id_request name = {"", lum_gltf_string(g, o, "name"), "node", node};
    if (!name.name || !name.name[0])
        name.name = lum_gltf_string(g, lum_gltf_item(g, LUM_GLTF_MESHES, mesh_index), "name");
    bool ok = true;
    for (uint32_t i = 0; ok && i < mesh.n_primitives; i++)
        ok = emit_primitive(g, &(struct primitive_place){&name, node, mesh_index, i, mesh.n_primitives == 1, &place},
                            &mesh.parts[i]);
    if (owned)
        lum_gltf_mesh_finish(&mesh);
    return ok;
}

static void count_shown(struct lum_gltf *g)
{
    for (uint32_t i = 0; i < g->arrays[LUM_GLTF_NODES].n; i++) {
        lum_gltf_at(g, LUM_GLTF_NODES, i);
        uint32_t mesh = lum_gltf_index(g, lum_gltf_item(g, LUM_GLTF_NODES, i), "mesh", LUM_GLTF_MESHES);
        if (lum_gltf_ok(g) && mesh != LUM_GLTF_NONE)
            g->n_shown[mesh] += g->nodes[i].in_scene;
    }
}

bool lum_gltf_emit_nodes(struct lum_gltf *g)
{
    uint32_t n = g->arrays[LUM_GLTF_NODES].n, last_percent = 0;
    count_shown(g);
    for (uint32_t i = 0; i < n; i++) {
        const cJSON *o = lum_gltf_item(g, LUM_GLTF_NODES, i);
        lum_gltf_at(g, LUM_GLTF_NODES, i);
        if (!g->nodes[i].in_scene)
            continue;
        uint32_t mesh = lum_gltf_index(g, o, "mesh", LUM_GLTF_MESHES);
        uint32_t camera = lum_gltf_index(g, o, "camera", LUM_GLTF_CAMERAS);
        uint32_t light = lum_gltf_index(g, lum_gltf_extension(g, o, "KHR_lights_punctual"), "light", LUM_GLTF_LIGHTS);
        const cJSON *ies = lum_gltf_extension(g, o, "EXT_lights_ies");
        bool ours = false, sent = false;
        if (!lum_gltf_ok(g) || (mesh != LUM_GLTF_NONE && !emit_mesh(g, i, mesh)) ||
            (mesh == LUM_GLTF_NONE && !lum_gltf_emit_ours(g, i, NULL, NULL, &ours)))
            return false;
        if (!ours && (!lum_gltf_emit_ies_extras(g, i, light, &sent) ||
                      (camera != LUM_GLTF_NONE && !lum_gltf_emit_camera(g, camera, i)) ||
                      (ies && !lum_gltf_emit_ies_light(g, ies, i, &sent)) ||
                      (light != LUM_GLTF_NONE && !sent && !lum_gltf_emit_light(g, light, i))))
            return false;
        uint32_t percent = (uint32_t)((uint64_t)(i + 1) * 100 / n);
        if (percent != last_percent)
            lum_emit_progress(&g->im->emit, "build", percent / 100.0);
        last_percent = percent;
    }
    return true;
}
