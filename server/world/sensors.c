#include "server/world/sensors.h"

#include <math.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

const char *const lum_sensor_kind_names[] = {
    [LUM_SENSOR_POINT] = "point",
    [LUM_SENSOR_LINE] = "line",
    [LUM_SENSOR_GRID] = "grid",
    [LUM_SENSOR_OBSERVER] = "observer",
};

const char *const lum_sensor_quantity_names[] = {
    [LUM_METER_PLANE] = "plane",
    [LUM_METER_CYLINDER] = "cylindrical",
    [LUM_METER_HALF_CYLINDER] = "semicylindrical",
    [LUM_METER_EYE] = "ugr",
};

#define MODELLING "modelling" /* a plane, and cylinders too */

const char *lum_sensor_quantity_name(const struct lum_sensor_desc *d)
{
    return d->modelling ? MODELLING : d->kind == LUM_SENSOR_OBSERVER ? NULL : lum_sensor_quantity_names[d->quantity];
}

bool lum_modelling_in_range(const struct lum_sensor_result *r)
{
    return r->modelling.value >= LUM_MODELLING_LEAST && r->modelling.value <= LUM_MODELLING_MOST;
}

const char *const lum_dgp_band_names[] = {
    [LUM_DGP_IMPERCEPTIBLE] = "imperceptible",
    [LUM_DGP_PERCEPTIBLE] = "perceptible",
    [LUM_DGP_DISTURBING] = "disturbing",
    [LUM_DGP_INTOLERABLE] = "intolerable",
};

const char *lum_sensor_quantity_of(const struct lum_sensor_desc *d)
{
    if (d->quantity != LUM_METER_PLANE)
        return lum_sensor_quantity_names[d->quantity];
    float up = lum_normalize(d->normal).y;
    return up > 0.9999f ? "horizontal" : fabsf(up) < 1e-4f ? "vertical" : "plane";
}

const char *lum_sensor_left_out(enum lum_clearance clearance)
{
    switch (clearance) {
    case LUM_CLEARANCE_INSIDE:
        return "inside";
    case LUM_CLEARANCE_COVERED:
        return "covered";
    case LUM_CLEARANCE_FAR:
        return "far";
    case LUM_CLEARANCE_UNKNOWN:
    case LUM_CLEARANCE_FREE:
        break;
    }
    return NULL;
}

/* ---- records ---- */

static struct lum_vec3d vec3d(const double v[3])
{
    return (struct lum_vec3d){v[0], v[1], v[2]};
}

/* Scaled first: a direction may be of any length. */
static struct lum_vec3 direction(const double v[3])
{
    double m = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
    return lum_normalize(lum_v3((float)(v[0] / m), (float)(v[1] / m), (float)(v[2] / m)));
}

struct lum_sensor_desc lum_sensor_desc_of(const struct lum_record *r)
{
    const struct lum_record_sensor *s = &r->sensor;
    struct lum_sensor_desc d = {.position = vec3d(s->position),
                                .u = vec3d(s->u),
                                .v = vec3d(s->v),
                                .normal = direction(s->normal),
                                .facing = direction(s->direction),
                                .spacing_m = s->spacing_m.set ? s->spacing_m.value : 0.0,
                                .floor_m2 = s->floor_m2.set ? s->floor_m2.value : 0.0,
                                .n_directions = (uint32_t)s->directions};
    for (int k = LUM_SENSOR_POINT; k <= LUM_SENSOR_OBSERVER; k++)
        if (strcmp(s->kind, lum_sensor_kind_names[k]) == 0)
            d.kind = (enum lum_sensor_kind)k;
    for (int q = LUM_METER_PLANE; q <= LUM_METER_EYE; q++)
        if (strcmp(s->quantity, lum_sensor_quantity_names[q]) == 0)
            d.quantity = (enum lum_meter_kind)q;
    d.modelling = d.kind != LUM_SENSOR_OBSERVER && strcmp(s->quantity, MODELLING) == 0;
    return d;
}

struct lum_sensor_targets lum_sensor_targets_of(const struct lum_record *r)
{
    const struct lum_record_sensor *s = &r->sensor;
    return (struct lum_sensor_targets){
        s->target_lx.set ? s->target_lx.value : 0.0, s->target_uo.set ? s->target_uo.value : 0.0,
        s->target_ugr.set ? s->target_ugr.value : 0.0, s->target_dgp.set ? s->target_dgp.value : 0.0};
}

/* ---- targets ---- */

static struct lum_verdict judge(const struct lum_amount *is, double target, bool at_most)
{
    if (!(target > 0.0))
        return (struct lum_verdict){0};
    return (struct lum_verdict){.asked = true,
                                .passes = at_most ? is->value <= target : is->value >= target,
                                .sure = !isnan(is->value) && !(fabs(is->value - target) < 2.0 * is->stderr_of)};
}

struct lum_sensor_verdicts lum_sensor_judge(const struct lum_sensor_result *r, const struct lum_sensor_targets *t)
{
    return (struct lum_sensor_verdicts){judge(&r->mean, t->lx, false), judge(&r->uniformity, t->uo, false),
                                        judge(&(struct lum_amount){r->ugr.ugr, r->ugr.stderr_of}, t->ugr, true),
                                        judge(&(struct lum_amount){r->dgp.dgp, r->dgp.stderr_of}, t->dgp, true)};
}

/* ---- JSON ---- */

static bool add_amount(cJSON *o, const char *name, const char *error_name, const struct lum_amount *amount)
{
    return lum_json_add_number(o, name, amount->value) && lum_json_add_number(o, error_name, amount->stderr_of);
}

static bool add_verdict(cJSON *to, const char *name, const struct lum_verdict *v, double target)
{
    if (!v->asked)
        return true;
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_number(o, "target", target) && lum_json_add_bool(o, "passes", v->passes) &&
              lum_json_add_bool(o, "sure", v->sure);
    return lum_json_add(to, name, o) && ok;
}

static bool add_verdicts(cJSON *to, const struct lum_sensor_result *r, const struct lum_sensor_targets *t, bool glare)
{
    struct lum_sensor_verdicts v = lum_sensor_judge(r, t);
    cJSON *o = cJSON_CreateObject();
    bool ok = glare ? add_verdict(o, "ugr", &v.ugr, t->ugr) && add_verdict(o, "dgp", &v.dgp, t->dgp)
                    : add_verdict(o, "em", &v.lx, t->lx) && add_verdict(o, "uo", &v.uo, t->uo);
    return lum_json_add(to, "targets", o) && ok;
}

static bool add_glare(cJSON *o, const struct lum_sensor_result *r)
{
    return lum_json_add_number(o, "ugr", r->ugr.ugr) && lum_json_add_number(o, "ugr_stderr", r->ugr.stderr_of) &&
           add_amount(o, "background_cd_m2", "background_stderr_cd_m2", &r->mean) &&
           lum_json_add_number(o, "sources", r->glare.n_sources) &&
           lum_json_add_number(o, "sources_out_of_range", r->glare.n_small + r->glare.n_large) &&
           lum_json_add_number(o, "lamps_without_extent", r->glare.n_points);
}

static bool add_glare_by_day(cJSON *o, const struct lum_sensor_result *r)
{
    bool known = !isnan(r->dgp.dgp);
    return lum_json_add_number(o, "dgp", r->dgp.dgp) && lum_json_add_number(o, "dgp_stderr", r->dgp.stderr_of) &&
           add_amount(o, "eye_lx", "eye_stderr_lx", &r->eye) &&
           (!known || (lum_json_add_string(o, "dgp_band", lum_dgp_band_names[lum_dgp_band_of(r->dgp.dgp)]) &&
                       lum_json_add_number(o, "dgp_sources", r->n_bright) &&
                       lum_json_add_bool(o, "dgp_in_range", r->eye.value > LUM_DGP_MIN_LX)));
}

static bool add_vector(cJSON *o, const char *name, double x, double y, double z)
{
    const double v[3] = {x, y, z};
    return lum_json_add(o, name, cJSON_CreateDoubleArray(v, 3));
}

static bool add_direction(cJSON *o, const char *name, const struct lum_sensor *sensor, uint32_t direction)
{
    struct lum_vec3 d = lum_sensor_direction(sensor, direction);
    return add_vector(o, name, (double)d.x, (double)d.y, (double)d.z);
}

/* Of eyes: where, and looking which way, one is glared most. */
static bool add_eyes(cJSON *o, const struct lum_sensor_desc *desc, const struct lum_sensor *sensor,
                     const struct lum_sensor_result *r)
{
    struct lum_vec3d at = lum_sensor_point(sensor, r->worst_at);
    return lum_json_add_number(o, "directions", desc->n_directions) && add_glare(o, r) &&
           (r->n_known == 0 || (add_vector(o, "worst_point", at.x, at.y, at.z) &&
                                add_direction(o, "worst_direction", sensor, r->worst_direction)));
}

static bool add_modelling(cJSON *o, const struct lum_sensor_result *r)
{
    return add_amount(o, "ez_lx", "ez_stderr_lx", &r->cylindrical) &&
           add_amount(o, "modelling", "modelling_stderr", &r->modelling) &&
           (isnan(r->modelling.value) || lum_json_add_bool(o, "modelling_in_range", lum_modelling_in_range(r)));
}

bool lum_sensor_add_result(cJSON *o, const struct lum_sensor_desc *desc, const struct lum_sensor *sensor,
                           const struct lum_sensor_result *r, const struct lum_sensor_targets *targets)
{
    bool observer = desc->kind == LUM_SENSOR_OBSERVER;
    if (!lum_json_add_string(o, "kind", lum_sensor_kind_names[desc->kind]))
        return false;
    if (observer)
        return add_glare(o, r) && add_glare_by_day(o, r) && add_verdicts(o, r, targets, true);
    uint32_t nu, nv;
    lum_sensor_size(sensor, &nu, &nv);
    if (!(lum_json_add_string(o, "quantity", lum_sensor_quantity_name(desc)) && lum_json_add_number(o, "nu", nu) &&
          lum_json_add_number(o, "nv", nv) && lum_json_add_number(o, "left_out", r->n_covered + r->n_inside)))
        return false;
    if (lum_sensor_has_eyes(desc))
        return add_eyes(o, desc, sensor, r) && add_verdicts(o, r, targets, true);
    return add_amount(o, "em_lx", "em_stderr_lx", &r->mean) && add_amount(o, "emin_lx", "emin_stderr_lx", &r->least) &&
           add_amount(o, "emax_lx", "emax_stderr_lx", &r->most) && add_amount(o, "uo", "uo_stderr", &r->uniformity) &&
           (!desc->modelling || add_modelling(o, r)) && add_verdicts(o, r, targets, false);
}

static bool add_gaze(cJSON *o, const struct lum_sensor *sensor, uint32_t i)
{
    struct lum_gaze is = lum_sensor_gaze(sensor, i);
    return !is.known ||
           (lum_json_add_number(o, "ugr", is.ugr.ugr) && lum_json_add_number(o, "ugr_stderr", is.ugr.stderr_of) &&
            add_direction(o, "direction", sensor, is.direction));
}

static bool add_point(cJSON *o, const struct lum_sensor *sensor, uint32_t i, const struct lum_sensor_desc *desc)
{
    struct lum_vec3d p = lum_sensor_point(sensor, i);
    struct lum_meter_reading is = lum_sensor_reading(sensor, i);
    const char *why = lum_sensor_left_out(is.clearance);
    if (!add_vector(o, "point", p.x, p.y, p.z))
        return false;
    if (why)
        return lum_json_add_string(o, "left_out", why);
    if (lum_sensor_has_eyes(desc))
        return add_gaze(o, sensor, i);
    if (is.stderr_lx >= 0.0 &&
        !(lum_json_add_number(o, "lx", is.lx) && lum_json_add_number(o, "stderr_lx", is.stderr_lx)))
        return false;
    if (!desc->modelling)
        return true;
    is = lum_sensor_cylindrical(sensor, i);
    return is.stderr_lx < 0.0 ||
           (lum_json_add_number(o, "ez_lx", is.lx) && lum_json_add_number(o, "ez_stderr_lx", is.stderr_lx));
}

cJSON *lum_sensor_points_json(const struct lum_sensor_desc *desc, const struct lum_sensor *sensor)
{
    cJSON *list = cJSON_CreateArray();
    uint32_t nu, nv;
    bool ok = list != NULL;
    lum_sensor_size(sensor, &nu, &nv);
    for (uint32_t i = 0; ok && i < nu * nv; i++) {
        cJSON *o = cJSON_CreateObject();
        ok = add_point(o, sensor, i, desc);
        ok = lum_json_add(list, NULL, o) && ok;
    }
    if (ok)
        return list;
    cJSON_Delete(list);
    return NULL;
}
