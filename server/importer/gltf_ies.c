/* Photometric lamps of a glTF file: EXT_lights_ies, and nodes that name a file in extras.ies. Both aim along -Z of
 * their node, C 0 along its +X. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "protocol/record/aim.h"
#include "server/importer/gltf.h"
#include "server/importer/gltf_json.h"

void lum_gltf_profiles_finish(struct lum_gltf *g)
{
    for (uint32_t i = 0; i < LUM_GLTF_PROFILES; i++)
        lum_photometry_finish(&g->profiles[i].photometry);
}

/* ---- profiles ---- */

/* One read before, or a place for a new one: in place of the oldest. */
static struct lum_gltf_profile *find_profile(struct lum_gltf *g, const char *key)
{
    for (uint32_t i = 0; i < LUM_GLTF_PROFILES; i++)
        if (strcmp(g->profiles[i].key, key) == 0)
            return &g->profiles[i];
    struct lum_gltf_profile *p = &g->profiles[g->n_profiles++ % LUM_GLTF_PROFILES];
    lum_photometry_finish(&p->photometry);
    *p = (struct lum_gltf_profile){.status = LUM_ERR_INTERNAL};
    snprintf(p->key, sizeof p->key, "%s", key);
    return p;
}

static void read_profile(struct lum_gltf *g, struct lum_gltf_profile *p, const struct lum_bytes *bytes,
                         const char *name)
{
    struct lum_error err = {0};
    p->status = lum_photometry_read(bytes, name, &p->photometry, &err);
    if (p->status)
        lum_gltf_warn(g, "%.60s is not used: %s", p->key, err.text);
    else
        lum_photometry_warn(&g->im->emit, p->key, &p->photometry);
}

/* By EXT_lights_ies: by uri, or in a buffer view. NULL: it cannot be used, and a warning has said why. */
static const struct lum_photometry *profile_of_light(struct lum_gltf *g, uint32_t light)
{
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_IES_LIGHTS, light);
    char key[64];
    snprintf(key, sizeof key, "IES light %u", light);
    struct lum_gltf_profile *p = find_profile(g, key);
    if (p->status == LUM_ERR_INTERNAL) {
        struct lum_bytes bytes = {0};
        struct lum_error err = {0};
        bool owned = false;
        p->status = LUM_ERR_INVALID;
        if (lum_gltf_bytes(g, o, &bytes, &owned, &err))
            read_profile(g, p, &bytes, "a.ies");
        else if (lum_gltf_ok(g))
            lum_gltf_warn(g, "%.60s is not used: %s", key, err.text);
        if (owned)
            lum_free(bytes.data);
    }
    return p->status ? NULL : &p->photometry;
}

/* By a file name: as it is, or beside the model, or in a folder "ies" there: names in extras come from elsewhere. */
static const struct lum_photometry *profile_of_file(struct lum_gltf *g, const char *name)
{
    const char *slash = strrchr(name, '/'), *base = slash ? slash + 1 : name;
    char in_folder[LUM_FILE_NAME_BYTES + 1];
    const char *const tries[] = {name, base, in_folder};
    snprintf(in_folder, sizeof in_folder, "ies/%.500s", base);
    if (strlen(name) >= sizeof g->profiles[0].key)
        return NULL;
    struct lum_gltf_profile *p = find_profile(g, name);
    if (p->status == LUM_ERR_INTERNAL) {
        struct lum_bytes bytes = {0};
        struct lum_error err = {0};
        enum lum_status status = LUM_ERR_NOT_FOUND;
        for (size_t i = 0; status && i < LUM_ARRAY_LEN(tries); i++)
            status = lum_files_read(&g->im->files, tries[i], LUM_FILE_ANY_CASE, &bytes, &err);
        p->status = LUM_ERR_INVALID;
        if (!status)
            read_profile(g, p, &bytes, base);
        else
            lum_gltf_warn(g, "%.60s is not used: no such file beside the model", name);
        lum_free(bytes.data);
    }
    return p->status ? NULL : &p->photometry;
}

/* ---- lamps ---- */

struct lamp {
    const struct lum_photometry *photometry;
    double multiplier, color[3];
    bool as_point;
};

static bool send_lamp(struct lum_gltf *g, uint32_t node, struct lamp *l)
{
    const struct lum_affined *a = &g->nodes[node].to_world;
    const cJSON *owner = lum_gltf_item(g, LUM_GLTF_NODES, node);
    double position[3], direction[3], c0[3] = {a->m[0][0], a->m[1][0], a->m[2][0]};
    if (!lum_gltf_axis(a, position, direction)) {
        lum_gltf_warn(g, "its lamp is left out: the transform is not finite or out of range");
        return true;
    }
    double roll = lum_aim_roll_deg(direction, c0),
           y = 0.2126 * l->color[0] + 0.7152 * l->color[1] + 0.0722 * l->color[2];
    for (int i = 0; i < 3; i++)
        l->color[i] = y > 0.0 ? l->color[i] / y : 1.0;
    l->multiplier = fmin(l->multiplier * y, 1e6);
    struct lum_id_request name = {"", lum_gltf_string(g, owner, "name"), "luminaire", node};
    lum_id id;
    struct lum_error err;
    struct lum_op_text op;
    enum lum_status status = lum_ids_make(&g->im->ids, &name, id, &err);
    if (!status) {
        lum_op_begin(&op, "light", id);
        lum_op_string(&op, "kind", "ies");
        lum_op_numbers(&op, "position", position, 3);
        lum_op_numbers(&op, "direction", direction, 3);
        lum_op_number(&op, "roll_deg", isfinite(roll) ? roll : 0.0);
        if (l->multiplier != 1.0)
            lum_op_number(&op, "multiplier", l->multiplier);
        lum_op_numbers(&op, "color", l->color, 3);
        if (l->as_point)
            lum_op_bool(&op, "as_point", true);
        if (g->nodes[node].hidden)
            lum_op_bool(&op, "on", false);
        lum_photometry_put(&g->im->emit, &op, l->photometry);
        status = lum_emit_op(&g->im->emit, &op, &err);
    }
    return !status || lum_gltf_fail(g, status, "%s", err.text);
}

bool lum_gltf_emit_ies_light(struct lum_gltf *g, const cJSON *extension, uint32_t node, bool *ret_sent)
{
    static const double multiplier_range[2] = {0.0, 1e6}, color_range[2] = {0.0, 1.0};
    struct lamp l = {.color = {1.0, 1.0, 1.0}, .as_point = true}; /* the extension has no extents */
    uint32_t light = lum_gltf_index(g, extension, "light", LUM_GLTF_IES_LIGHTS);
    l.multiplier = lum_gltf_clamped(g, extension, "multiplier", 1.0, multiplier_range);
    lum_gltf_clamped_numbers(g, extension, "color", l.color, 3, color_range);
    if (!lum_gltf_ok(g) || light == LUM_GLTF_NONE)
        return lum_gltf_ok(g);
    l.photometry = profile_of_light(g, light);
    *ret_sent = l.photometry != NULL;
    return l.photometry ? send_lamp(g, node, &l) : lum_gltf_ok(g);
}

bool lum_gltf_emit_ies_extras(struct lum_gltf *g, uint32_t node, uint32_t punctual, bool *ret_sent)
{
    static const double color_range[2] = {0.0, 1e9};
    const cJSON *extras = cJSON_GetObjectItemCaseSensitive(lum_gltf_item(g, LUM_GLTF_NODES, node), "extras");
    const char *file =
        cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(extras, "ies")); /* of any other type: not ours */
    struct lamp l = {.multiplier = 1.0, .color = {1.0, 1.0, 1.0}};
    *ret_sent = false;
    if (!file || !file[0])
        return true;
    l.photometry = profile_of_file(g, file);
    if (!l.photometry)
        return lum_gltf_ok(g);
    *ret_sent = true;
    const cJSON *fallback = lum_gltf_item(g, LUM_GLTF_LIGHTS, punctual); /* says how it is coloured */
    lum_gltf_clamped_numbers(g, fallback, "color", l.color, 3, color_range);
    double y = 0.2126 * l.color[0] + 0.7152 * l.color[1] + 0.0722 * l.color[2];
    l.multiplier = y > 0.0 ? 1.0 / y : 1.0; /* a hue alone */
    return lum_gltf_ok(g) && send_lamp(g, node, &l);
}
