/* Nodes, and where they stand. */
#include <math.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "core/math/color.h"
#include "protocol/json/json.h"
#include "server/export/internal.h"

/* Columns of a turn and a stretch are at right angles to within rounding: of what was multiplied a few times. */
#define RIGHT_ANGLE 1e-9
#define SWEEPS 32 /* of Jacobi's method on 3 x 3: it is done after about 6 */
#define PI 3.14159265358979323846

/* ---- turning and stretching ---- */

static double dot(const double m[3][3], int i, int k)
{
    return m[0][i] * m[0][k] + m[1][i] * m[1][k] + m[2][i] * m[2][k];
}

/* One-sided Jacobi: m becomes m * v, whose columns are at right angles; v is a rotation. */
static void make_orthogonal(double m[3][3], double v[3][3])
{
    for (int sweep = 0; sweep < SWEEPS; sweep++)
        for (int i = 0; i < 2; i++)
            for (int k = i + 1; k < 3; k++) {
                double ik = dot(m, i, k), ii = dot(m, i, i), kk = dot(m, k, k);
                if (fabs(ik) <= 1e-16 * sqrt(ii * kk))
                    continue;
                double zeta = (kk - ii) / (2.0 * ik), t = copysign(1.0, zeta) / (fabs(zeta) + hypot(1.0, zeta)),
                       c = 1.0 / hypot(1.0, t), s = c * t;
                for (int r = 0; r < 3; r++) {
                    double a = m[r][i], b = m[r][k], p = v[r][i], q = v[r][k];
                    m[r][i] = c * a - s * b, m[r][k] = s * a + c * b;
                    v[r][i] = c * p - s * q, v[r][k] = s * p + c * q;
                }
            }
}

static double determinant(const double m[3][3])
{
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/* Of a rotation. x, y, z, w by the largest of the four. */
static void quaternion(const double r[3][3], double ret[4])
{
    double four[4] = {1 + r[0][0] - r[1][1] - r[2][2], 1 - r[0][0] + r[1][1] - r[2][2], 1 - r[0][0] - r[1][1] + r[2][2],
                      1 + r[0][0] + r[1][1] + r[2][2]};
    int largest = 0;
    for (int i = 1; i < 4; i++)
        if (four[i] > four[largest])
            largest = i;
    double s = sqrt(four[largest]) * 2.0;
    const double all[4][4] = {
        {s / 4, (r[0][1] + r[1][0]) / s, (r[0][2] + r[2][0]) / s, (r[2][1] - r[1][2]) / s},
        {(r[0][1] + r[1][0]) / s, s / 4, (r[1][2] + r[2][1]) / s, (r[0][2] - r[2][0]) / s},
        {(r[0][2] + r[2][0]) / s, (r[1][2] + r[2][1]) / s, s / 4, (r[1][0] - r[0][1]) / s},
        {(r[2][1] - r[1][2]) / s, (r[0][2] - r[2][0]) / s, (r[1][0] - r[0][1]) / s, s / 4},
    };
    double length = 0.0;
    for (int i = 0; i < 4; i++)
        length += all[largest][i] * all[largest][i];
    for (int i = 0; i < 4; i++)
        ret[i] = all[largest][i] / sqrt(length);
}

/* m, whose columns are at right angles, as members of a node. */
static bool add_turn_and_scale(cJSON *node, const double m[3][3])
{
    double r[3][3], scale[3], q[4];
    bool mirrors = determinant(m) < 0.0, ok = true;
    for (int k = 0; k < 3; k++) {
        scale[k] = sqrt(dot(m, k, k)) * (mirrors && k == 0 ? -1.0 : 1.0);
        for (int i = 0; i < 3; i++)
            r[i][k] = m[i][k] / scale[k];
    }
    quaternion((const double(*)[3])r, q);
    if (fabs(q[3]) < 1.0)
        ok = lum_json_add(node, "rotation", cJSON_CreateDoubleArray(q, 4));
    if (scale[0] != 1.0 || scale[1] != 1.0 || scale[2] != 1.0)
        ok = ok && lum_json_add(node, "scale", cJSON_CreateDoubleArray(scale, 3));
    return ok;
}

static bool add_translation(cJSON *node, const struct lum_affined *a)
{
    const double t[3] = {a->m[0][3], a->m[1][3], a->m[2][3]};
    return (t[0] == 0.0 && t[1] == 0.0 && t[2] == 0.0) ||
           lum_json_add(node, "translation", cJSON_CreateDoubleArray(t, 3));
}

/* A turn, then a stretch, then another turn: the last two are of a parent. */
static bool add_parent(struct lum_exporting *x, const char *id, const struct lum_affined *a, double m[3][3],
                       cJSON *node)
{
    double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, back[3][3];
    make_orthogonal(m, v);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            back[i][k] = v[k][i];
    cJSON *parent = cJSON_CreateObject(), *children = cJSON_CreateArray();
    bool ok = lum_json_add_string(parent, "name", id) && add_translation(parent, a) &&
              add_turn_and_scale(parent, (const double(*)[3])m) && add_turn_and_scale(node, (const double(*)[3])back);
    ok = lum_json_add(parent, "children", children) && ok;
    uint32_t at = lum_glb_add(x->glb, LUM_GLB_NODES, parent);
    return ok && lum_glb_ok(x->glb) && lum_json_add(children, NULL, cJSON_CreateNumber((double)at + 1));
}

/* Objects a millionth of a metre thin are at right angles, too: by the cosine. */
static bool is_orthogonal(const double m[3][3])
{
    for (int i = 0; i < 2; i++)
        for (int k = i + 1; k < 3; k++)
            if (fabs(dot(m, i, k)) > RIGHT_ANGLE * sqrt(dot(m, i, i) * dot(m, k, k)))
                return false;
    return true;
}

void lum_export_node(struct lum_exporting *x, const struct lum_record *r, const struct lum_affined *place, bool placed,
                     struct cJSON *content)
{
    double m[3][3];
    for (int i = 0; i < 3; i++)
        memcpy(m[i], place->m[i], sizeof m[i]);
    cJSON *ours = lum_export_extras(x, content, r);
    bool ok = ours && lum_json_add_string(content, "name", r->id);
    if (placed)
        ok = ok && lum_json_add(ours, "place", cJSON_CreateDoubleArray(&place->m[0][0], 12));
    if (is_orthogonal((const double(*)[3])m))
        ok = ok && add_translation(content, place) && add_turn_and_scale(content, (const double(*)[3])m);
    else
        ok = ok && add_parent(x, r->id, place, m, content);
    if (!ok)
        lum_glb_fail_memory(x->glb);
    (void)lum_glb_add(x->glb, LUM_GLB_NODES, content);
}

/* ---- objects ---- */

/* What its surface emits, by its own fields where it has some, in cd/m2 by channel. Of a flux it is the mean of its
 * area: pictures of light, and holes, are left out of account. */
static void emission_of(const struct lum_record_object *o, const struct lum_record *material,
                        const struct lum_record *mesh, const struct lum_affined *place, double ret_emission[3])
{
    const struct lum_record_material *m = &material->material;
    double own[3], y, luminance;
    lum_export_emission(m, ret_emission);
    memcpy(own, ret_emission, sizeof own);
    luminance = m->emission_cd_m2;
    if (o->luminance_cd_m2.set)
        luminance = o->luminance_cd_m2.value;
    if (o->flux_lm.set) {
        double sides = strcmp(m->emission_sides, "front") == 0 ? 1.0 : 2.0;
        double area_m2 = lum_export_area(&mesh->mesh, place);
        luminance = area_m2 > 0.0 ? o->flux_lm.value / (PI * area_m2 * sides) : 0.0;
    }
    if (o->cct_k.set) {
        struct lum_rgb c = lum_cct_to_rgb(o->cct_k.value);
        own[0] = (double)c.r, own[1] = (double)c.g, own[2] = (double)c.b;
    } else if (o->color[0] + o->color[1] + o->color[2] > 0.0) {
        memcpy(own, o->color, sizeof own);
    } else if (!(own[0] + own[1] + own[2] > 0.0)) {
        memcpy(own, m->emission_color, sizeof own);
    } else if (!o->flux_lm.set && !o->luminance_cd_m2.set && o->on) {
        return; /* the material's own, to the last bit */
    }
    y = 0.2126 * own[0] + 0.7152 * own[1] + 0.0722 * own[2];
    for (int i = 0; i < 3; i++)
        ret_emission[i] = o->on && y > 0.0 ? luminance * own[i] / y : 0.0;
}

void lum_export_object(struct lum_exporting *x, const struct lum_record *r)
{
    struct lum_export_entry *mesh = lum_export_find(x, LUM_RECORD_MESH, r->object.mesh),
                            *material = lum_export_find(x, LUM_RECORD_MATERIAL, r->object.material);
    struct lum_affined place;
    double emission[3];
    if (!mesh || !material)
        return;
    lum_record_transform_affine(&r->object.transform, place.m);
    emission_of(&r->object, material->record, mesh->record, &place, emission);
    uint32_t index = lum_export_mesh(x, mesh, lum_export_variant(x, material, emission));
    cJSON *o = cJSON_CreateObject();
    if (index == LUM_EXPORT_NONE || !o) {
        cJSON_Delete(o);
        if (index != LUM_EXPORT_NONE)
            lum_glb_fail_memory(x->glb);
        return;
    }
    bool ok = lum_json_add_number(o, "mesh", index);
    if (!r->object.visible)
        ok = ok && lum_json_add_bool(lum_glb_extension(x->glb, o, "KHR_node_visibility"), "visible", false);
    if (!ok)
        lum_glb_fail_memory(x->glb);
    lum_export_node(x, r, &place, true, o);
}
