/* KHR_lights_punctual and cameras. Both look along -Z of their node. */
#include <math.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/importer/gltf.h"
#include "server/importer/gltf_json.h"

#define DEG_PER_RAD 57.295779513082320877

bool lum_gltf_axis(const struct lum_affined *a, double ret_position[3], double ret_direction[3])
{
    double length = sqrt(a->m[0][2] * a->m[0][2] + a->m[1][2] * a->m[1][2] + a->m[2][2] * a->m[2][2]);
    if (!(length > 0.0) || !isfinite(length))
        return false;
    for (int i = 0; i < 3; i++) {
        ret_position[i] = a->m[i][3];
        ret_direction[i] = -a->m[i][2] / length;
        if (!(fabs(ret_position[i]) <= LUM_LIMIT_COORD_M))
            return false;
    }
    return true;
}

struct lamp {
    const char *kind;
    double color[3], intensity; /* cd, or lx for a directional one, of luminance: colour has luminance 1 */
    double inner_deg, outer_deg;
    double position[3], direction[3];
};

/* The light's vector quantity color * intensity is kept: its luminance goes to the intensity, its chromaticity to the
 * colour. */
static bool read_lamp(struct lum_gltf *g, const cJSON *o, struct lamp *l)
{
    static const double color_range[2] = {0.0, 1e9}, intensity_range[2] = {0.0, 1e12},
                        angle_range[2] = {0.0, 1.5707963267948966};
    const char *type = lum_gltf_string(g, o, "type");
    if (!type || (strcmp(type, "point") != 0 && strcmp(type, "spot") != 0 && strcmp(type, "directional") != 0)) {
        lum_gltf_warn(g, "a light of type %.20s is left out", type ? type : "(none)");
        return false;
    }
    l->kind = type;
    l->color[0] = l->color[1] = l->color[2] = 1.0;
    lum_gltf_clamped_numbers(g, o, "color", l->color, 3, color_range);
    l->intensity = lum_gltf_clamped(g, o, "intensity", 1.0, intensity_range);
    const cJSON *spot = lum_gltf_object(g, o, "spot");
    l->outer_deg =
        fmin(fmax(lum_gltf_number(g, spot, "outerConeAngle", 0.78539816339744831) * DEG_PER_RAD, 0.01), 90.0);
    l->inner_deg = fmin(lum_gltf_clamped(g, spot, "innerConeAngle", 0.0, angle_range) * DEG_PER_RAD, l->outer_deg);
    if (!lum_gltf_ok(g))
        return false;
    double y = 0.2126 * l->color[0] + 0.7152 * l->color[1] + 0.0722 * l->color[2];
    l->intensity *= y;
    for (int i = 0; i < 3; i++)
        l->color[i] = y > 0.0 ? l->color[i] / y : 1.0;
    return true;
}

bool lum_gltf_emit_light(struct lum_gltf *g, uint32_t light, uint32_t node)
{
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_LIGHTS, light), *owner = lum_gltf_item(g, LUM_GLTF_NODES, node);
    struct lamp l = {0};
    if (!read_lamp(g, o, &l))
        return lum_gltf_ok(g);
    if (!lum_gltf_axis(&g->nodes[node].to_world, l.position, l.direction)) {
        lum_gltf_warn(g, "its light is left out: the transform is not finite or out of range");
        return true;
    }
    struct lum_id_request name = {"", lum_gltf_string(g, owner, "name"), "light", light};
    if (!name.name || !name.name[0])
        name.name = lum_gltf_string(g, o, "name");
    lum_id id;
    struct lum_error err;
    struct lum_op_text op;
    enum lum_status status = lum_ids_make(&g->im->ids, &name, id, &err);
    if (!status) {
        lum_op_begin(&op, "light", id);
        lum_op_string(&op, "kind", l.kind);
        if (strcmp(l.kind, "directional") != 0)
            lum_op_numbers(&op, "position", l.position, 3);
        if (strcmp(l.kind, "point") != 0)
            lum_op_numbers(&op, "direction", l.direction, 3);
        if (strcmp(l.kind, "spot") == 0) {
            lum_op_number(&op, "inner_cone_deg", l.inner_deg);
            lum_op_number(&op, "outer_cone_deg", l.outer_deg);
        }
        lum_op_number(&op, strcmp(l.kind, "directional") == 0 ? "illuminance_lx" : "intensity_cd", l.intensity);
        lum_op_numbers(&op, "color", l.color, 3);
        if (g->nodes[node].hidden)
            lum_op_bool(&op, "on", false);
        status = lum_emit_op(&g->im->emit, &op, &err);
    }
    return !status || lum_gltf_fail(g, status, "%s", err.text);
}

/* "up" of a camera: its node's +Y, or any vector that is not along the view when the node has none. */
static void read_up(const struct lum_affined *a, const double direction[3], double ret_up[3])
{
    double length = sqrt(a->m[0][1] * a->m[0][1] + a->m[1][1] * a->m[1][1] + a->m[2][1] * a->m[2][1]);
    bool ok = length > 0.0 && isfinite(length);
    for (int i = 0; i < 3; i++)
        ret_up[i] = ok ? a->m[i][1] / length : i == (fabs(direction[1]) < 0.9 ? 1 : 2);
}

bool lum_gltf_emit_camera(struct lum_gltf *g, uint32_t camera, uint32_t node)
{
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_CAMERAS, camera), *owner = lum_gltf_item(g, LUM_GLTF_NODES, node);
    const cJSON *perspective = lum_gltf_object(g, o, "perspective");
    double vfov_deg = lum_gltf_number(g, perspective, "yfov", 0.0) * DEG_PER_RAD;
    double position[3], direction[3], target[3], up[3];
    if (!lum_gltf_ok(g))
        return false;
    if (!perspective || !(vfov_deg > 0.0) || !lum_gltf_axis(&g->nodes[node].to_world, position, direction)) {
        lum_gltf_warn(g, "its camera is left out: it is orthographic, or its angle or transform is out of range");
        return true;
    }
    read_up(&g->nodes[node].to_world, direction, up);
    for (int i = 0; i < 3; i++)
        target[i] = position[i] + direction[i];
    struct lum_id_request name = {"", lum_gltf_string(g, owner, "name"), "camera", camera};
    if (!name.name || !name.name[0])
        name.name = lum_gltf_string(g, o, "name");
    lum_id id;
    struct lum_error err;
    struct lum_op_text op;
    enum lum_status status = lum_ids_make(&g->im->ids, &name, id, &err);
    if (!status) {
        lum_op_begin(&op, "camera", id);
        lum_op_numbers(&op, "position", position, 3);
        lum_op_numbers(&op, "target", target, 3);
        lum_op_numbers(&op, "up", up, 3);
        lum_op_number(&op, "vfov_deg", fmin(fmax(vfov_deg, 1.0), 179.0));
        status = lum_emit_op(&g->im->emit, &op, &err);
    }
    return !status || lum_gltf_fail(g, status, "%s", err.text);
}
