/* What lumend has written into a glTF file (server/export): records in `extras`, which say what glTF has no word for,
 * and numbers to their last bit. They are read like all else of a file, as what may be hostile: the daemon checks them
 * as it checks what a client says. Where another program has written the file again, nodes may have moved, which moves
 * their records, and numbers of buffer views mean nothing any more. */
#include "server/importer/gltf_ours.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json/json.h"
#include "protocol/record/aim.h"
#include "server/importer/gltf_json.h"

/* Places that differ less are the same: programs keep floats, of 6e-8, and turn them into quaternions and back. */
#define SAME_PLACE 1e-6

/* ---- reading ---- */

const cJSON *lum_gltf_ours(const cJSON *o)
{
    const cJSON *extras = cJSON_GetObjectItemCaseSensitive(o, "extras"),
                *ours = cJSON_GetObjectItemCaseSensitive(extras, "lumend");
    return cJSON_IsObject(ours) ? ours : NULL;
}

const char *lum_gltf_ours_text(const cJSON *ours, const char *key)
{
    return cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(ours, key));
}

bool lum_gltf_ours_id(struct lum_gltf *g, const cJSON *ours, lum_id ret_id)
{
    const char *id = lum_gltf_ours_text(ours, "id");
    return id && lum_ids_again(&g->im->ids, id, ret_id);
}

static bool read_numbers(const cJSON *o, const char *key, double *ret, int n)
{
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(o, key), *v;
    if (!cJSON_IsArray(list) || cJSON_GetArraySize(list) != n)
        return false;
    int i = 0;
    cJSON_ArrayForEach(v, list)
    {
        if (!cJSON_IsNumber(v) || !isfinite(v->valuedouble))
            return false;
        ret[i++] = v->valuedouble;
    }
    return true;
}

static bool take_bytes(struct lum_gltf *g, const cJSON *in, struct lum_gltf_view *ret_view, bool *ret_doubles)
{
    const cJSON *single = cJSON_GetObjectItemCaseSensitive(in, "bufferView"),
                *both = cJSON_GetObjectItemCaseSensitive(in, "bufferView64");
    uint32_t view = LUM_GLTF_NONE;
    *ret_doubles = !single;
    return g->is_ours && (single || both) &&
           lum_gltf_index_value(g, single ? single : both, "extras.bufferView", LUM_GLTF_BUFFER_VIEWS, &view) &&
           lum_gltf_view(g, view, ret_view);
}

bool lum_gltf_ours_bytes(struct lum_gltf *g, const cJSON *o, const char *key, struct lum_gltf_view *ret_view,
                         bool *ret_doubles)
{
    return take_bytes(g, cJSON_GetObjectItemCaseSensitive(o, key), ret_view, ret_doubles);
}

/* ---- references ---- */

static bool replace(cJSON *o, const char *key, cJSON *item)
{
    if (item && cJSON_ReplaceItemInObjectCaseSensitive(o, key, item))
        return true;
    cJSON_Delete(item);
    return false;
}

/* An id of the scene that was written, as it is here. *ret_known: somebody has it. */
static bool rename_id(struct lum_gltf *g, cJSON *o, const char *key, bool *ret_known)
{
    const char *text = lum_gltf_ours_text(o, key);
    lum_id id;
    *ret_known = true;
    if (!text)
        return true;
    if (!lum_ids_again(&g->im->ids, text, id))
        return lum_gltf_fail(g, LUM_ERR_INVALID, "extras.lumend: %s is no id", key);
    *ret_known = lum_ids_find(&g->im->ids, id, NULL);
    return replace(o, key, cJSON_CreateString(id)) || lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory");
}

/* What a patch controls may be a group, whose name stays; a preset may name lamps that are gone. */
static bool rename_refs(struct lum_gltf *g, cJSON *record, bool *ret_known)
{
    static const char *const keys[] = {"mesh", "material", "image", "camera"};
    const char *target = lum_gltf_ours_text(record, "target");
    lum_id id;
    bool known, ok = true;
    *ret_known = true;
    for (size_t i = 0; i < LUM_ARRAY_LEN(keys) && ok; i++) {
        ok = rename_id(g, record, keys[i], &known);
        *ret_known = *ret_known && known;
    }
    if (ok && target && lum_ids_again(&g->im->ids, target, id) && lum_ids_find(&g->im->ids, id, NULL))
        ok = rename_id(g, record, "target", &known);
    cJSON *lamp, *lamps = cJSON_GetObjectItemCaseSensitive(record, "lamps");
    cJSON_ArrayForEach(lamp, lamps) ok = ok && rename_id(g, lamp, "id", &known);
    return ok;
}

/* ---- places ---- */

static bool same_place(const struct lum_affined *a, const struct lum_affined *b)
{
    double size = 0.0, far = 0.0;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            size = fmax(size, fabs(b->m[i][k]));
        far = fmax(far, fabs(b->m[i][3]));
    }
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 4; k++)
            if (!(fabs(a->m[i][k] - b->m[i][k]) <= SAME_PLACE * (k < 3 ? size : size + far)))
                return false;
    return true;
}

static void map_vector(const struct lum_affined *a, double v[3])
{
    double r[3];
    for (int i = 0; i < 3; i++)
        r[i] = a->m[i][0] * v[0] + a->m[i][1] * v[1] + a->m[i][2] * v[2];
    memcpy(v, r, sizeof r);
}

static double determinant(const struct lum_affined *a)
{
    const double(*m)[4] = a->m;
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

static bool put_numbers(cJSON *record, const char *key, const double *v, int n)
{
    cJSON_DeleteItemFromObjectCaseSensitive(record, key);
    return lum_json_add(record, key, cJSON_CreateDoubleArray(v, n));
}

static bool map_roll(const struct lum_affined *a, cJSON *record)
{
    double direction[3] = {0, -1, 0}, c0[3];
    const cJSON *roll = cJSON_GetObjectItemCaseSensitive(record, "roll_deg");
    (void)read_numbers(record, "direction", direction, 3);
    lum_aim_c0(direction, cJSON_IsNumber(roll) ? roll->valuedouble : 0.0, c0);
    map_vector(a, c0);
    map_vector(a, direction);
    double turned = lum_aim_roll_deg(direction, c0);
    cJSON_DeleteItemFromObjectCaseSensitive(record, "roll_deg");
    return lum_json_add_number(record, "roll_deg", isfinite(turned) ? turned : 0.0);
}

/* As an import that is moved moves what it has brought (protocol/document/import_transform.c). */
static bool map_record(const struct lum_affined *a, cJSON *record)
{
    static const char *const vectors[] = {"direction", "u", "v", "up"}, *const points[] = {"position", "target"};
    const char *kind = lum_gltf_ours_text(record, "kind");
    const cJSON *radius = cJSON_GetObjectItemCaseSensitive(record, "radius");
    bool ok = !kind || strcmp(kind, "ies") != 0 || map_roll(a, record);
    double v[3];
    for (size_t i = 0; i < LUM_ARRAY_LEN(vectors) && ok; i++)
        if (read_numbers(record, vectors[i], v, 3)) {
            map_vector(a, v);
            ok = put_numbers(record, vectors[i], v, 3);
        }
    for (size_t i = 0; i < LUM_ARRAY_LEN(points) && ok; i++)
        if (read_numbers(record, points[i], v, 3)) {
            struct lum_vec3d p = lum_affined_point(a, (struct lum_vec3d){v[0], v[1], v[2]});
            ok = put_numbers(record, points[i], (const double[3]){p.x, p.y, p.z}, 3);
        }
    if (ok && cJSON_IsNumber(radius)) {
        double scaled = radius->valuedouble * cbrt(fabs(determinant(a)));
        cJSON_DeleteItemFromObjectCaseSensitive(record, "radius");
        ok = lum_json_add_number(record, "radius", scaled);
    }
    return ok;
}

/* False: memory is short. */
static bool follow_node(const cJSON *ours, const struct lum_affined *world, cJSON *record)
{
    struct lum_affined place, back, step;
    double m[16] = {[15] = 1.0};
    if (!read_numbers(ours, "place", &place.m[0][0], 12) || same_place(world, &place))
        return true;
    memcpy(m, world->m, sizeof world->m);
    if (strcmp(lum_gltf_ours_text(record, "type"), "object") == 0)
        return put_numbers(record, "transform", m, 16);
    if (!lum_affined_invert(&place, &back))
        return true;
    step = lum_affined_mul(world, &back);
    return map_record(&step, record);
}

/* ---- sending ---- */

/* {"bufferView":i} becomes the bytes that it stands for, down to the members of members: a light's web has them. False:
 * there are none, or refused. */
static bool send_bulk(struct lum_gltf *g, cJSON *o, int depth)
{
    for (cJSON *in = o->child, *next; in; in = next) {
        struct lum_gltf_view view;
        bool doubles = false;
        next = in->next;
        if (!cJSON_IsObject(in))
            continue;
        if (!cJSON_HasObjectItem(in, "bufferView") && !cJSON_HasObjectItem(in, "bufferView64")) {
            if (depth > 0 && !send_bulk(g, in, depth - 1))
                return false;
            continue;
        }
        if (!take_bytes(g, in, &view, &doubles))
            return false;
        uint32_t number = lum_emit_bulk(&g->im->emit, view.data, view.n);
        cJSON_DeleteItemFromObjectCaseSensitive(in, doubles ? "bufferView64" : "bufferView");
        if (!lum_json_add_number(in, doubles ? "blob64" : "blob", number))
            return lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory");
    }
    return true;
}

/* Arrays of a file that another program has written are not where the record says. */
static bool has_lost_bulk(const struct lum_gltf *g, const cJSON *o, int depth)
{
    for (const cJSON *in = o->child; in && !g->is_ours; in = in->next)
        if (cJSON_IsObject(in) && (cJSON_HasObjectItem(in, "bufferView") || cJSON_HasObjectItem(in, "bufferView64") ||
                                   (depth > 0 && has_lost_bulk(g, in, depth - 1))))
            return true;
    return false;
}

static bool send_text(struct lum_gltf *g, cJSON *record)
{
    size_t n;
    struct lum_error err;
    if (!send_bulk(g, record, 1) || !lum_json_add_string(record, "op", "add"))
        return lum_gltf_ok(g) && lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory");
    char *text = lum_json_print(record, &n);
    if (!text)
        return lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory");
    enum lum_status status = lum_emit_text(&g->im->emit, text, n, &err);
    free(text);
    return !status || lum_gltf_fail(g, status, "%s", err.text);
}

/* A copy of the record that may be changed, if its id is free and its type is one of those. NULL, *ret_ok true: there
 * is none to send. */
static cJSON *open_record(struct lum_gltf *g, const cJSON *given, const char *const *types, lum_id ret_id, bool *ret_ok)
{
    const char *type = lum_gltf_ours_text(given, "type");
    bool fits = type && lum_gltf_ours_id(g, given, ret_id) && !lum_ids_find(&g->im->ids, ret_id, NULL) &&
                !has_lost_bulk(g, given, 1);
    *ret_ok = true;
    while (fits && *types && strcmp(*types, type) != 0)
        types++;
    if (!fits || !*types)
        return NULL;
    cJSON *record = cJSON_Duplicate(given, true);
    *ret_ok = record || lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory");
    return record;
}

/* The mesh and material of an object are those of the node, whose ids are new already. */
static bool name_it(cJSON *record, const char *id, const char *mesh, const char *material)
{
    return replace(record, "id", cJSON_CreateString(id)) &&
           (!mesh || (replace(record, "mesh", cJSON_CreateString(mesh)) &&
                      replace(record, "material", cJSON_CreateString(material))));
}

static bool send_record(struct lum_gltf *g, cJSON *record, const char *id, const char *mesh, const char *material,
                        bool *ret_sent)
{
    struct lum_error err;
    bool known;
    *ret_sent = false;
    if (!rename_refs(g, record, &known))
        return false;
    if (!known && !mesh) {
        lum_gltf_warn(g, "%s is left out: what it refers to is not in the file", id);
        return true;
    }
    enum lum_status status = lum_ids_take(&g->im->ids, id, 0, &err);
    if (status)
        return lum_gltf_fail(g, status, "%s", err.text);
    *ret_sent = true;
    return (name_it(record, id, mesh, material) || lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory")) &&
           send_text(g, record);
}

bool lum_gltf_emit_ours(struct lum_gltf *g, uint32_t node, const char *mesh, const char *material, bool *ret_sent)
{
    static const char *const lamps[] = {"light", "camera", NULL}, *const objects[] = {"object", NULL};
    const cJSON *ours = lum_gltf_ours(lum_gltf_item(g, LUM_GLTF_NODES, node));
    lum_id id;
    bool ok;
    *ret_sent = false;
    cJSON *record = open_record(g, cJSON_GetObjectItemCaseSensitive(ours, "record"), mesh ? objects : lamps, id, &ok);
    if (!record)
        return ok;
    ok = follow_node(ours, &g->nodes[node].to_world, record);
    if (!ok)
        lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory");
    if (ok)
        ok = send_record(g, record, id, mesh, material, ret_sent);
    cJSON_Delete(record);
    return ok;
}

enum lum_status lum_gltf_send_shape(struct lum_gltf *g, const cJSON *shape, const char *id, struct lum_error *err)
{
    cJSON *record = cJSON_Duplicate(shape, true);
    bool ok = record && name_it(record, id, NULL, NULL) && send_text(g, record);
    cJSON_Delete(record);
    if (ok || g->error.status)
        return ok ? LUM_OK : lum_fail(err, g->error.status, "", "%s", g->error.text);
    return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory");
}

/* ---- the scene ---- */

static const cJSON *scene_ours(struct lum_gltf *g)
{
    uint32_t scene = lum_gltf_index(g, g->root, "scene", LUM_GLTF_SCENES);
    return lum_gltf_ours(lum_gltf_item(g, LUM_GLTF_SCENES, scene == LUM_GLTF_NONE ? 0 : scene));
}

bool lum_gltf_emit_loose(struct lum_gltf *g, bool images)
{
    static const char *const first[] = {"image", NULL}, *const later[] = {"light", "medium", "sensor",
                                                                          "patch", "preset", NULL};
    lum_gltf_at(g, LUM_GLTF_KIND_COUNT, 0);
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(scene_ours(g), "records"), *given;
    bool ok = lum_gltf_ok(g), sent;
    cJSON_ArrayForEach(given, list)
    {
        lum_id id;
        cJSON *record = ok ? open_record(g, given, images ? first : later, id, &ok) : NULL;
        if (record)
            ok = send_record(g, record, id, NULL, NULL, &sent);
        cJSON_Delete(record);
        if (!ok)
            return false;
    }
    for (uint32_t i = 0; ok && images && g->is_ours && i < g->arrays[LUM_GLTF_IMAGES].n; i++)
        if (lum_gltf_ours(lum_gltf_item(g, LUM_GLTF_IMAGES, i))) {
            (void)lum_gltf_image(g, i, false); /* of the sky, too, which no texture shows */
            ok = lum_gltf_ok(g);
        }
    for (uint32_t i = 0; ok && images && g->is_ours && i < g->arrays[LUM_GLTF_MATERIALS].n; i++)
        ok = lum_gltf_material(g, i) != NULL;
    return ok;
}

bool lum_gltf_emit_settings(struct lum_gltf *g)
{
    const cJSON *given = cJSON_GetObjectItemCaseSensitive(scene_ours(g), "settings");
    if (!cJSON_IsObject(given))
        return lum_gltf_ok(g);
    cJSON *settings = cJSON_Duplicate(given, true);
    bool known = true, ok = settings && rename_id(g, settings, "camera", &known);
    if (ok && !known)
        cJSON_DeleteItemFromObjectCaseSensitive(settings, "camera");
    size_t n = 0;
    char *text = ok ? lum_json_print(settings, &n) : NULL;
    if (text)
        lum_emit_settings(&g->im->emit, text, n);
    free(text);
    cJSON_Delete(settings);
    return text || (lum_gltf_ok(g) && lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory"));
}
