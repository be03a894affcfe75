#include "server/cli/measure_report.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "core/math/vec3d.h"
#include "protocol/json/json.h"

enum { COLUMNS = 16 /* that fit a terminal */, LEFT_OUT_TOLD = 8 };

/* ---- stdout ---- */

static bool is_level(const struct lum_sensor_desc *d)
{
    return d->kind == LUM_SENSOR_GRID && d->u.y == 0.0 && d->u.z == 0.0 && d->v.x == 0.0 && d->v.y == 0.0;
}

static void print_ugr(double ugr)
{
    if (isfinite(ugr))
        printf(" %8.1f", ugr);
    else
        printf(" %8s", isnan(ugr) ? "?" : ugr > 0.0 ? "dark" : "none");
}

static void print_value(const struct lum_measured *m, uint32_t i)
{
    struct lum_meter_reading r = lum_sensor_reading(m->sensor, i);
    const char *why = lum_sensor_left_out(r.clearance);
    if (why)
        printf(" %8s", "-");
    else if (lum_sensor_has_eyes(&m->desc))
        print_ugr(lum_sensor_gaze(m->sensor, i).ugr.ugr);
    else
        printf(" %8.4g", r.lx);
}

static void print_table(const struct lum_measured *m, uint32_t nu, uint32_t nv)
{
    bool level = is_level(&m->desc);
    if (nu > COLUMNS) {
        printf("(more columns than fit a line: --csv has them)\n");
        return;
    }
    if (level)
        printf("%8s", "z \\ x");
    for (uint32_t x = 0; level && x < nu; x++)
        printf(" %8.2f", lum_sensor_point(m->sensor, x).x);
    for (uint32_t z = 0; z < nv; z++) {
        if (level)
            printf("\n%8.2f", lum_sensor_point(m->sensor, z * nu).z);
        else
            printf("%s%8s", z ? "\n" : "", "");
        for (uint32_t x = 0; x < nu; x++)
            print_value(m, z * nu + x);
    }
    putchar('\n');
}

static void print_left_out(const struct lum_measured *m, uint32_t n)
{
    const struct lum_sensor_result *r = &m->result;
    uint32_t told = 0, far = 0, left_out = r->n_covered + r->n_inside;
    if (left_out == 0)
        return;
    for (uint32_t i = 0; i < n; i++)
        far += lum_sensor_reading(m->sensor, i).clearance == LUM_CLEARANCE_FAR;
    printf("%u of %u points are left out, %u inside furniture or walls, %u right below something", left_out, n,
           r->n_inside, r->n_covered - far);
    if (far > 0)
        printf(", %u too far from the scene", far);
    putchar(':');
    for (uint32_t i = 0; i < n && told < LEFT_OUT_TOLD; i++) {
        if (!lum_sensor_left_out(lum_sensor_reading(m->sensor, i).clearance))
            continue;
        struct lum_vec3d p = lum_sensor_point(m->sensor, i);
        printf("%s (%.2f, %.2f, %.2f)", told++ ? "," : "", p.x, p.y, p.z);
    }
    printf("%s\n", told < left_out ? ", ..." : "");
}

static bool tell_target(const char *name, const struct lum_verdict *v, double target)
{
    if (v->asked)
        printf("%-5s %s %g%s\n", name, v->passes ? "reaches" : "misses", target,
               v->sure ? "" : ", within what noise leaves open: a smaller --error tells");
    return !v->asked || v->passes;
}

static void print_glare_by_day(const struct lum_sensor_result *r)
{
    if (isnan(r->dgp.dgp))
        return;
    printf("DGP   %.3f +/- %.2g, %s, of %u sources above %g cd/m2; %.4g lx +/- %.2g at the eye\n", r->dgp.dgp,
           r->dgp.stderr_of, lum_dgp_band_names[lum_dgp_band_of(r->dgp.dgp)], r->n_bright, LUM_DGP_SOURCE_CD_M2,
           r->eye.value, r->eye.stderr_of);
    if (!(r->eye.value > LUM_DGP_MIN_LX))
        printf("DGP is made for more than %g lx at the eye\n", LUM_DGP_MIN_LX);
}

static void print_lamps(const struct lum_glare *glare)
{
    if (glare->n_points > 0)
        printf("%u lamps without an extent are left out: they have no luminance\n", glare->n_points);
    if (glare->n_small + glare->n_large > 0)
        printf("%u lamps look smaller than 0.0003 sr and %u larger than 0.1 sr: the formula is not made for them\n",
               glare->n_small, glare->n_large);
}

static bool print_eyes(const struct lum_measured *m)
{
    const struct lum_sensor_result *r = &m->result;
    struct lum_vec3d at = lum_sensor_point(m->sensor, r->worst_at);
    struct lum_vec3 d = lum_sensor_direction(m->sensor, r->worst_direction);
    if (r->n_known == 0) {
        printf("no point is left to measure at\n");
        return false;
    }
    if (r->ugr.ugr == -(double)INFINITY)
        printf("UGR   none: no lamp is in sight\n");
    else if (isfinite(r->ugr.ugr))
        printf("UGR   %.1f +/- %.2g at most, by formula (CIE 117), of %u lamps; background %.3g cd/m2 +/- %.2g;"
               " at x %.2f, y %.2f, z %.2f, looking along %.2f, %.2f, %.2f\n",
               r->ugr.ugr, r->ugr.stderr_of, r->glare.n_sources, r->mean.value, r->mean.stderr_of, at.x, at.y, at.z,
               (double)d.x, (double)d.y, (double)d.z);
    if (r->n_dark > 0)
        printf("%u points see a lamp, and all else is dark: UGR has no bound there\n", r->n_dark);
    print_lamps(&r->glare);
    struct lum_sensor_verdicts v = lum_sensor_judge(r, &m->targets);
    return tell_target("UGR", &v.ugr, m->targets.ugr);
}

static bool print_observer(const struct lum_measured *m)
{
    const struct lum_sensor_result *r = &m->result;
    if (isnan(r->ugr.ugr))
        printf("UGR   none: too far from the scene\n");
    else if (r->ugr.ugr == -(double)INFINITY)
        printf("UGR   none: no lamp is in sight\n");
    else if (r->ugr.ugr == (double)INFINITY)
        printf("UGR   none: all is dark but the lamps\n");
    else
        printf("UGR   %.1f +/- %.2g, by formula (CIE 117), of %u lamps; background %.3g cd/m2 +/- %.2g\n", r->ugr.ugr,
               r->ugr.stderr_of, r->glare.n_sources, r->mean.value, r->mean.stderr_of);
    print_lamps(&r->glare);
    print_glare_by_day(r);
    struct lum_sensor_verdicts v = lum_sensor_judge(r, &m->targets);
    bool ugr = tell_target("UGR", &v.ugr, m->targets.ugr);
    bool dgp = tell_target("DGP", &v.dgp, m->targets.dgp);
    return ugr && dgp;
}

static bool print_amounts(const struct lum_measured *m)
{
    const struct lum_sensor_result *r = &m->result;
    struct lum_vec3d at = lum_sensor_point(m->sensor, r->least_at);
    if (r->n_known == 0) {
        printf("no point is left to measure at\n");
        return false;
    }
    printf("Em    %.4g lx +/- %.2g\n", r->mean.value, r->mean.stderr_of);
    if (m->desc.kind != LUM_SENSOR_POINT) {
        printf("Emin  %.4g lx +/- %.2g, at x %.2f, z %.2f\n", r->least.value, r->least.stderr_of, at.x, at.z);
        printf("Emax  %.4g lx +/- %.2g\n", r->most.value, r->most.stderr_of);
        printf("Uo    %.3f +/- %.2g (Emin / Em)\n", r->uniformity.value, r->uniformity.stderr_of);
    }
    if (m->desc.modelling && !isnan(r->modelling.value))
        printf("Ez    %.4g lx +/- %.2g\nEz/E  %.3f +/- %.2g, modelling: %s %.2f to %.2f, which EN 12464-1 recommends\n",
               r->cylindrical.value, r->cylindrical.stderr_of, r->modelling.value, r->modelling.stderr_of,
               lum_modelling_in_range(r) ? "within" : "not within", LUM_MODELLING_LEAST, LUM_MODELLING_MOST);
    struct lum_sensor_verdicts v = lum_sensor_judge(r, &m->targets);
    bool lx = tell_target("Em", &v.lx, m->targets.lx);
    bool uo = tell_target("Uo", &v.uo, m->targets.uo);
    return lx && uo;
}

bool lum_measure_print(const struct lum_measured *m)
{
    uint32_t nu, nv;
    lum_sensor_size(m->sensor, &nu, &nv);
    if (m->id)
        printf("%s%s%s%s: ", m->id, m->name && m->name[0] ? " (" : "", m->name ? m->name : "",
               m->name && m->name[0] ? ")" : "");
    struct lum_vec3d at = m->desc.position;
    if (m->desc.kind == LUM_SENSOR_OBSERVER) {
        printf("observer at %.2f, %.2f, %.2f\n", at.x, at.y, at.z);
        return print_observer(m);
    }
    if (lum_sensor_has_eyes(&m->desc))
        printf("UGR of the worst of %u lines of sight", m->desc.n_directions);
    else
        printf("%s illuminance in lx", lum_sensor_quantity_of(&m->desc));
    if (is_level(&m->desc))
        printf(", at y = %.3f m", at.y);
    if (m->desc.kind != LUM_SENSOR_POINT)
        printf(", %u x %u points, %.3f x %.3f m apart", nu, nv, lum_v3d_length(m->desc.u) / nu,
               lum_v3d_length(m->desc.v) / nv);
    putchar('\n');
    if (m->desc.kind != LUM_SENSOR_POINT)
        print_table(m, nu, nv);
    print_left_out(m, nu * nv);
    return lum_sensor_has_eyes(&m->desc) ? print_eyes(m) : print_amounts(m);
}

void lum_measure_print_worst(const struct lum_measured *measured, size_t n)
{
    size_t n_observers;
    const struct lum_measured *worst = lum_report_worst(measured, n, false, &n_observers);
    if (worst)
        printf("Worst UGR of %zu observers: %.1f +/- %.2g, of %s\n", n_observers, worst->result.ugr.ugr,
               worst->result.ugr.stderr_of, worst->id);
    worst = lum_report_worst(measured, n, true, &n_observers);
    if (worst)
        printf("Worst DGP of %zu observers: %.3f +/- %.2g, of %s\n", n_observers, worst->result.dgp.dgp,
               worst->result.dgp.stderr_of, worst->id);
}

void lum_measure_print_power(const struct lum_measured *measured, size_t n, const struct lum_load *load)
{
    const struct lum_measured *room = lum_report_room(measured, n);
    char unknown[LUM_POWER_TEXT];
    if (!room || load->n_on == 0)
        return;
    struct lum_power p = lum_power_of(load, &room->desc, &room->result);
    lum_power_unknown(load, unknown);
    if (isnan(p.w_per_m2)) {
        printf("Power not known: no lamp's file says it, of %s\n", unknown);
        return;
    }
    printf("Power %.4g W, %.3g W/m2 over %.4g m2", load->watts, p.w_per_m2, p.floor_m2);
    if (isfinite(p.w_per_m2_100_lx.value))
        printf(", %.3g W/m2 +/- %.2g for each 100 lx", p.w_per_m2_100_lx.value, p.w_per_m2_100_lx.stderr_of);
    if (load->n_unknown > 0)
        printf("; without %u of %u lamps, whose power is not known: %s", load->n_unknown, load->n_on, unknown);
    putchar('\n');
}

/* ---- files ---- */

static bool close_file(FILE *f, const char *path, bool ok, struct lum_proto_error *err)
{
    if (f && fclose(f) != 0)
        ok = false;
    return ok || lum_proto_fail(err, LUM_PROTO_APPLICATION, "io", "", "cannot write %.150s: %s", path, strerror(errno));
}

static bool write_value(FILE *f, double value, double error)
{
    return (isfinite(value) ? fprintf(f, "%.6g,%.3g\n", value, error) : fputs(",\n", f)) >= 0;
}

static bool write_place(FILE *f, const struct lum_measured *m, const char *quantity, uint32_t i)
{
    struct lum_vec3d p = lum_sensor_point(m->sensor, i);
    return (!m->id || fprintf(f, "%s,", m->id) > 0) &&
           (!(m->id || m->desc.modelling || lum_sensor_has_eyes(&m->desc)) || fprintf(f, "%s,", quantity) > 0) &&
           fprintf(f, "%.6g,%.6g,%.6g,", p.x, p.y, p.z) > 0;
}

/* An observer has a row of UGR and one of DGP. */
static bool write_glare(FILE *f, const struct lum_measured *m)
{
    return write_place(f, m, "ugr", 0) && write_value(f, m->result.ugr.ugr, m->result.ugr.stderr_of) &&
           write_place(f, m, "dgp", 0) && write_value(f, m->result.dgp.dgp, m->result.dgp.stderr_of);
}

/* Of the line of sight that is glared most. */
static bool write_gaze(FILE *f, const struct lum_measured *m, uint32_t i)
{
    struct lum_gaze is = lum_sensor_gaze(m->sensor, i);
    return write_place(f, m, "ugr", i) && write_value(f, is.known ? is.ugr.ugr : (double)NAN, is.ugr.stderr_of);
}

/* One that is left out has no value. */
static bool write_point(FILE *f, const struct lum_measured *m, enum lum_meter_kind quantity, uint32_t i,
                        struct lum_meter_reading r)
{
    return write_place(f, m, lum_sensor_quantity_names[quantity], i) &&
           write_value(f, lum_sensor_left_out(r.clearance) ? (double)NAN : r.lx, r.stderr_lx);
}

/* With modelling the points come twice: a row of a plane each, then of a cylinder each. */
static bool write_rows(FILE *f, const struct lum_measured *m)
{
    uint32_t nu, nv;
    bool ok = true;
    if (m->desc.kind == LUM_SENSOR_OBSERVER)
        return write_glare(f, m);
    lum_sensor_size(m->sensor, &nu, &nv);
    for (uint32_t i = 0; ok && i < nu * nv; i++)
        ok = lum_sensor_has_eyes(&m->desc) ? write_gaze(f, m, i)
                                           : write_point(f, m, m->desc.quantity, i, lum_sensor_reading(m->sensor, i));
    for (uint32_t i = 0; ok && m->desc.modelling && i < nu * nv; i++)
        ok = write_point(f, m, LUM_METER_CYLINDER, i, lum_sensor_cylindrical(m->sensor, i));
    return ok;
}

bool lum_measure_write_csv(const char *path, const struct lum_measured *measured, size_t n, struct lum_proto_error *err)
{
    FILE *f = fopen(path, "wb");
    const char *head = n > 0 && measured[0].id                           ? "sensor,quantity,x_m,y_m,z_m,value,stderr\n"
                       : n > 0 && lum_sensor_has_eyes(&measured[0].desc) ? "quantity,x_m,y_m,z_m,value,stderr\n"
                       : n > 0 && measured[0].desc.modelling             ? "quantity,x_m,y_m,z_m,lx,stderr_lx\n"
                                                                         : "x_m,y_m,z_m,lx,stderr_lx\n";
    bool ok = f && fputs(head, f) >= 0;
    for (size_t i = 0; ok && i < n; i++)
        ok = write_rows(f, &measured[i]);
    return close_file(f, path, ok, err);
}

/* load: NULL but of the one over whose floor it is told. */
static bool add_measured(cJSON *o, const struct lum_measured *m, const struct lum_load *load)
{
    bool ok = !m->id || lum_json_add_string(o, "id", m->id);
    ok = ok && lum_sensor_add_result(o, &m->desc, m->sensor, &m->result, &m->targets);
    if (ok && load) {
        struct lum_power power = lum_power_of(load, &m->desc, &m->result);
        ok = lum_power_add(o, &power);
    }
    if (ok && m->desc.kind != LUM_SENSOR_OBSERVER)
        ok = lum_json_add(o, "points", lum_sensor_points_json(&m->desc, m->sensor));
    return ok;
}

/* Their ids. */
static bool add_worst(cJSON *to, const struct lum_measured *measured, size_t n)
{
    size_t n_observers;
    const struct lum_measured *ugr = lum_report_worst(measured, n, false, &n_observers),
                              *dgp = lum_report_worst(measured, n, true, &n_observers);
    return (!ugr || lum_json_add_string(to, "worst_ugr", ugr->id)) &&
           (!dgp || lum_json_add_string(to, "worst_dgp", dgp->id));
}

bool lum_measure_write_json(const char *path, const char *scene, const struct lum_measured *measured, size_t n,
                            const struct lum_load *load, struct lum_proto_error *err)
{
    const struct lum_measured *room = lum_report_room(measured, n);
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "scene", scene);
    if (n == 1 && !measured[0].id) {
        ok = ok && add_measured(o, &measured[0], room ? load : NULL);
    } else {
        cJSON *list = cJSON_CreateArray();
        for (size_t i = 0; ok && i < n; i++) {
            cJSON *one = cJSON_CreateObject();
            ok = add_measured(one, &measured[i], room == &measured[i] ? load : NULL);
            ok = lum_json_add(list, NULL, one) && ok;
        }
        ok = lum_json_add(o, "sensors", list) && add_worst(o, measured, n) && ok;
    }
    char *text = ok ? lum_json_print(o, NULL) : NULL;
    cJSON_Delete(o);
    if (!text)
        return lum_proto_fail_memory(err);
    FILE *f = fopen(path, "wb");
    ok = f && fputs(text, f) >= 0 && fputc('\n', f) != EOF;
    free(text);
    return close_file(f, path, ok, err);
}
