/* Lamps and cameras. What glTF has no word for (areas that shine, the sun's disc) has its nearest word, and extras say
 * what it is. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "core/light/emitter.h"
#include "core/scene/light_kind.h"
#include "protocol/json/json.h"
#include "protocol/record/aim.h"
#include "protocol/record/light_kinds.h"
#include "server/base/web_desc.h"
#include "server/export/internal.h"
#include "server/world/apply.h"

#define PI 3.14159265358979323846
#define Z_NEAR_M 0.01 /* glTF wants one; nothing here is cut off */

/* ---- places ---- */

static double length_of(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void cross(const double a[3], const double b[3], double ret[3])
{
    ret[0] = a[1] * b[2] - a[2] * b[1];
    ret[1] = a[2] * b[0] - a[0] * b[2];
    ret[2] = a[0] * b[1] - a[1] * b[0];
}

/* -Z looks along that, and +X lies as near to the other as it can. */
static struct lum_affined look(const double position[3], const double along[3], const double near_x[3])
{
    struct lum_affined a = lum_affined_identity();
    double n = length_of(along), z[3] = {-along[0] / n, -along[1] / n, -along[2] / n}, x[3], y[3];
    cross(z, near_x, y);
    double ny = length_of(y);
    if (!(ny > 1e-9 * length_of(near_x))) { /* along it: any other will do */
        const double other[3] = {fabs(z[0]) < 0.9, fabs(z[0]) >= 0.9, 0.0};
        cross(z, other, y);
        ny = length_of(y);
    }
    for (int i = 0; i < 3; i++)
        y[i] /= ny;
    cross(y, z, x);
    for (int i = 0; i < 3; i++) {
        a.m[i][0] = x[i], a.m[i][1] = y[i], a.m[i][2] = z[i];
        a.m[i][3] = position[i];
    }
    return a;
}

/* It shines along one direction from everywhere. */
static bool is_far(const struct lum_light_desc *d)
{
    return d->kind->emitter->unit == LUM_POWER_ILLUMINANCE;
}

static struct lum_affined place_of(const struct lum_record_light *l, const struct lum_light_desc *d)
{
    static const double origin[3], right[3] = {1.0, 0.0, 0.0};
    double c0[3], n[3], along[3] = {d->direction.x, d->direction.y, d->direction.z};
    struct lum_affined at = lum_affined_identity();
    if (is_far(d))
        return look(origin, along, right);
    if (lum_light_kind_has(l->kind) & LUM_HAS_EDGES) {
        cross(l->u, l->v, n);
        return look(l->position, n, l->u);
    }
    if (d->web) {
        lum_aim_c0(l->direction, l->roll_deg, c0);
        return look(l->position, l->direction, c0);
    }
    if (d->kind->aimed)
        return look(l->position, l->direction, right);
    for (int i = 0; i < 3; i++)
        at.m[i][3] = l->position[i];
    return at;
}

/* ---- KHR_lights_punctual ---- */

/* cd of its brightest direction, or lx; of areas that of all their light, shining as even as they do. */
static double punctual_intensity(const struct lum_light_desc *d)
{
    if (d->web)
        return d->intensity / d->web->peak_cd * d->web->peak_cd * d->web->flux_sr / (4.0 * PI);
    if (d->kind->emitter->unit != LUM_POWER_LUMINANCE)
        return d->intensity;
    return d->intensity * d->kind->flux(d) / (d->kind->emitter->flat ? PI : 4.0 * PI);
}

static bool add_spot(cJSON *o, const struct lum_light_desc *d)
{
    double outer = d->kind == &lum_light_kind_spot ? d->outer_cone_rad : PI / 2.0,
           inner = d->kind == &lum_light_kind_spot ? d->inner_cone_rad : 0.0;
    cJSON *spot = cJSON_CreateObject();
    bool ok = lum_json_add_number(spot, "innerConeAngle", fmin(inner, 0.999999 * outer)) && /* below: glTF says so */
              lum_json_add_number(spot, "outerConeAngle", outer);
    return lum_json_add(o, "spot", spot) && ok;
}

/* Its colour at most 1, as glTF wants it: color * intensity is what shines. */
static double hue(const struct lum_light_desc *d, double ret_color[3])
{
    double c[3] = {(double)d->color.r, (double)d->color.g, (double)d->color.b}, most = fmax(c[0], fmax(c[1], c[2]));
    for (int i = 0; i < 3; i++)
        ret_color[i] = fmax(c[i], 0.0) / most;
    return most;
}

static bool add_punctual(struct lum_exporting *x, cJSON *node, const struct lum_record *r,
                         const struct lum_light_desc *d)
{
    bool spot = d->kind == &lum_light_kind_spot || d->kind->emitter->flat, far = is_far(d);
    double color[3], most = hue(d, color);
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "name", r->id) &&
              lum_json_add_string(o, "type",
                                  spot  ? "spot"
                                  : far ? "directional"
                                        : "point") &&
              lum_json_add_number(o, "intensity", d->on ? most * punctual_intensity(d) : 0.0) &&
              lum_json_add(o, "color", cJSON_CreateDoubleArray(color, 3)) && (!spot || add_spot(o, d));
    uint32_t light = lum_glb_add(x->glb, LUM_GLB_LIGHTS, o);
    return ok && lum_json_add_number(lum_glb_extension(x->glb, node, "KHR_lights_punctual"), "light", light);
}

/* ---- EXT_lights_ies ---- */

static uint32_t ies_light(struct lum_exporting *x, const struct lum_record_web *web)
{
    size_t n;
    char *text = lum_export_ies(web, &n);
    if (!text) {
        lum_glb_fail_memory(x->glb);
        return 0;
    }
    uint32_t view = lum_glb_bytes(x->glb, text, n, free);
    for (size_t i = 0; i < x->n_ies; i++)
        if (x->ies[i] == view)
            return (uint32_t)i;
    uint32_t *grown = realloc(x->ies, (x->n_ies + 1) * sizeof *grown);
    cJSON *o = cJSON_CreateObject();
    bool ok = (!web->name[0] || lum_json_add_string(o, "name", web->name)) &&
              lum_json_add_number(o, "bufferView", view) &&
              lum_json_add_string(o, "mimeType", "application/x-ies-lm-63");
    if (grown) {
        x->ies = grown;
        x->ies[x->n_ies++] = view;
    }
    if (!grown || !ok)
        lum_glb_fail_memory(x->glb);
    return lum_glb_add(x->glb, LUM_GLB_IES_LIGHTS, o);
}

static bool add_measured(struct lum_exporting *x, cJSON *node, const struct lum_record *r,
                         const struct lum_light_desc *d)
{
    double color[3], most = hue(d, color);
    cJSON *ext = lum_glb_extension(x->glb, node, "EXT_lights_ies");
    return lum_json_add_number(ext, "light", ies_light(x, r->light.web)) &&
           lum_json_add_number(ext, "multiplier", d->on ? most * d->intensity / d->web->peak_cd : 0.0) &&
           lum_json_add(ext, "color", cJSON_CreateDoubleArray(color, 3));
}

/* Of lamps of one file, one after the other, once. */
static struct lum_web *web_of(struct lum_exporting *x, const struct lum_record_web *file)
{
    struct lum_error err;
    if (x->web && x->web_file == file)
        return x->web;
    struct lum_web_desc desc = lum_web_desc_of(file);
    lum_web_unref(x->web);
    x->web = NULL;
    x->web_file = file;
    if (lum_web_create(&desc, &x->web, &err))
        lum_glb_fail(x->glb, &err);
    return x->web;
}

/* ---- records ---- */

static void keep_record(struct lum_exporting *x, const struct lum_record *r)
{
    cJSON *o = cJSON_CreateObject(), *ours = lum_export_extras(x, o, r);
    cJSON *record = ours ? cJSON_DetachItemFromObjectCaseSensitive(ours, "record") : NULL;
    cJSON_Delete(o);
    if (!lum_json_add(x->records, NULL, record))
        lum_glb_fail_memory(x->glb);
}

void lum_export_light(struct lum_exporting *x, const struct lum_record *r)
{
    const struct lum_record_light *l = &r->light;
    struct lum_light_desc d;
    struct lum_error err;
    bool measured = strcmp(l->kind, "ies") == 0;
    struct lum_web *web = measured && l->web ? web_of(x, l->web) : NULL;
    if (l->image[0]) {
        struct lum_export_entry *image = lum_export_find(x, LUM_RECORD_IMAGE, l->image);
        if (image)
            (void)lum_export_image(x, image);
    }
    if (!lum_glb_ok(x->glb))
        return;
    if (lum_apply_light(r, web, &d, &err)) {
        lum_glb_fail(x->glb, &err);
        return;
    }
    bool no_flux = d.kind->emitter->unit == LUM_POWER_LUMINANCE && !d.kind->flux; /* glTF would have to be told one */
    if (d.kind == &lum_light_kind_environment || d.kind == &lum_light_kind_sky || no_flux) {
        keep_record(x, r);
        return;
    }
    cJSON *node = cJSON_CreateObject();
    bool ok = add_punctual(x, node, r, &d) && (!measured || add_measured(x, node, r, &d));
    if (!ok)
        lum_glb_fail_memory(x->glb);
    struct lum_affined at = place_of(l, &d);
    lum_export_node(x, r, &at, d.kind != &lum_light_kind_sun, node);
}

void lum_export_camera(struct lum_exporting *x, const struct lum_record *r)
{
    const struct lum_record_camera *c = &r->camera;
    double along[3], right[3];
    for (int i = 0; i < 3; i++)
        along[i] = c->target[i] - c->position[i];
    cross(along, c->up, right);
    cJSON *o = cJSON_CreateObject(), *perspective = cJSON_CreateObject(), *node = cJSON_CreateObject();
    bool panorama = strcmp(c->projection, "panorama") == 0;
    bool ok = lum_json_add_number(perspective, "yfov", (panorama ? 90.0 : c->vfov_deg) * PI / 180.0) &&
              lum_json_add_number(perspective, "znear", Z_NEAR_M) && lum_json_add_string(o, "name", r->id) &&
              lum_json_add_string(o, "type", "perspective");
    ok = lum_json_add(o, "perspective", perspective) && ok;
    ok = lum_json_add_number(node, "camera", lum_glb_add(x->glb, LUM_GLB_CAMERAS, o)) && ok;
    if (!ok)
        lum_glb_fail_memory(x->glb);
    struct lum_affined at = look(c->position, along, right);
    lum_export_node(x, r, &at, true, node);
}

void lum_export_loose(struct lum_exporting *x, const struct lum_record *r)
{
    keep_record(x, r);
}
