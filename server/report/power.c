#include "server/report/power.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

double lum_power_floor(const struct lum_sensor_desc *d)
{
    if (d->kind != LUM_SENSOR_GRID || strcmp(lum_sensor_quantity_of(d), "horizontal") != 0)
        return 0.0;
    const struct lum_vec3d u = d->u, v = d->v;
    double level = fabs(u.z * v.x - u.x * v.z); /* of the floor below it */
    return d->floor_m2 > 0.0 ? d->floor_m2 : level;
}

struct lum_power lum_power_of(const struct lum_load *load, const struct lum_sensor_desc *d,
                              const struct lum_sensor_result *r)
{
    const double none = (double)NAN;
    struct lum_power p = {*load, lum_power_floor(d), none, {none, none}};
    if (load->n_unknown == load->n_on && load->n_on > 0)
        return p;
    p.w_per_m2 = load->watts / p.floor_m2;
    if (r->mean.value > 0.0) {
        p.w_per_m2_100_lx.value = p.w_per_m2 / (r->mean.value / 100.0);
        p.w_per_m2_100_lx.stderr_of = p.w_per_m2_100_lx.value * r->mean.stderr_of / r->mean.value;
    }
    return p;
}

static cJSON *names_of(const struct lum_load *load)
{
    cJSON *list = cJSON_CreateArray();
    bool ok = list != NULL;
    for (uint32_t i = 0; ok && i < load->n_names; i++) {
        cJSON *o = cJSON_CreateObject();
        ok = lum_json_add_string(o, "what", load->names[i].what) &&
             lum_json_add_string(o, "id", load->names[i].first) && lum_json_add_number(o, "n", load->names[i].n);
        ok = lum_json_add(list, NULL, o) && ok;
    }
    if (ok)
        return list;
    cJSON_Delete(list);
    return NULL;
}

bool lum_power_add(cJSON *to, const struct lum_power *p)
{
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_number(o, "watts", p->load.watts) && lum_json_add_number(o, "floor_m2", p->floor_m2) &&
              lum_json_add_number(o, "w_per_m2", p->w_per_m2) &&
              lum_json_add_number(o, "w_per_m2_100_lx", p->w_per_m2_100_lx.value) &&
              lum_json_add_number(o, "w_per_m2_100_lx_stderr", p->w_per_m2_100_lx.stderr_of) &&
              lum_json_add_number(o, "lamps", p->load.n_on) &&
              lum_json_add_number(o, "lamps_without_watts", p->load.n_unknown) &&
              lum_json_add(o, "without_watts", names_of(&p->load));
    return lum_json_add(to, "power", o) && ok;
}

void lum_power_unknown(const struct lum_load *load, char text[LUM_POWER_TEXT])
{
    uint32_t named = 0;
    int n = 0;
    text[0] = '\0';
    for (uint32_t i = 0; i < load->n_names && (size_t)n < LUM_POWER_TEXT; i++) {
        n += snprintf(text + n, LUM_POWER_TEXT - (size_t)n, "%s%.80s (%.40s%s)", i ? "; " : "", load->names[i].what,
                      load->names[i].first, load->names[i].n > 1 ? " and others" : "");
        named += load->names[i].n;
    }
    if (named < load->n_unknown && (size_t)n < LUM_POWER_TEXT)
        snprintf(text + n, LUM_POWER_TEXT - (size_t)n, "; ...");
}
