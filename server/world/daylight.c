#include "server/world/daylight.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "core/light/cie_sky.h"
#include "core/light/environment.h"
#include "core/scene/snapshot.h"
#include "protocol/json/json.h"
#include "protocol/record/date.h"

struct lum_daylight_sun lum_daylight_sun(const struct lum_record_light *l)
{
    struct lum_daylight_sun sun = {.elevation_deg = l->elevation_deg.value, .azimuth_deg = l->azimuth_deg.value};
    int ymd[3], day = 0;
    bool dated = lum_date_read(l->date, ymd);
    if (dated)
        day = lum_day_of_year(ymd[0], ymd[1], ymd[2]);
    if (dated && !l->elevation_deg.set) {
        double julian_day = lum_julian_day(ymd[0], ymd[1], ymd[2], l->time_h - l->utc_offset_h);
        struct lum_solar_position at = lum_solar_position(julian_day, l->latitude_deg, l->longitude_deg);
        sun.elevation_deg = at.apparent_deg;
        sun.azimuth_deg = at.azimuth_deg;
    }
    sun.illuminance_lx =
        l->illuminance_lx.set ? l->illuminance_lx.value : lum_sun_illuminance(sun.elevation_deg, l->extinction, day);
    if (!(sun.elevation_deg > 0.0))
        sun.illuminance_lx = 0.0;
    return sun;
}

static void apply_sun(const struct lum_record_light *l, struct lum_light_desc *d)
{
    struct lum_daylight_sun sun = lum_daylight_sun(l);
    struct lum_vec3d to = lum_solar_direction(sun.elevation_deg, sun.azimuth_deg, l->north_deg);
    d->direction = (struct lum_vec3d){-to.x, -to.y, -to.z};
    d->intensity = sun.illuminance_lx;
}

static void apply_sky(const struct lum_record_light *l, struct lum_light_desc *d)
{
    d->cie_type = (int)l->cie_type;
    d->ground_albedo = l->ground_albedo;
    d->sky_amount = l->luminance_cd_m2.set  ? LUM_SKY_ZENITH
                    : l->illuminance_lx.set ? LUM_SKY_HORIZONTAL
                                            : LUM_SKY_BY_SUN;
    d->intensity = l->luminance_cd_m2.set ? l->luminance_cd_m2.value : l->illuminance_lx.value;
    if (d->sky_amount == LUM_SKY_BY_SUN)
        d->intensity = 0.0;
}

void lum_daylight_apply(const struct lum_record_light *l, struct lum_light_desc *d)
{
    if (d->kind == &lum_light_kind_sun)
        apply_sun(l, d);
    if (d->kind == &lum_light_kind_sky)
        apply_sky(l, d);
}

/* ---- what is told of them ---- */

static cJSON *describe_sun(const struct lum_record *r)
{
    struct lum_daylight_sun sun = lum_daylight_sun(&r->light);
    double up = fmax(sin(sun.elevation_deg * (LUM_PI_D / 180.0)), 0.0);
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "id", r->id) && lum_json_add_number(o, "elevation_deg", sun.elevation_deg) &&
              lum_json_add_number(o, "azimuth_deg", sun.azimuth_deg) &&
              lum_json_add_number(o, "illuminance_lx", sun.illuminance_lx) &&
              lum_json_add_number(o, "horizontal_lx", sun.illuminance_lx * up);
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

static cJSON *describe_sky(const struct lum_light *l)
{
    double zenith = (double)lum_luminance(l->power);
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "id", l->id) && lum_json_add_number(o, "luminance_cd_m2", zenith) &&
              lum_json_add_number(o, "horizontal_lx", zenith * lum_env_map_sky(l->env)->horizontal);
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

static cJSON *or_null(cJSON *o)
{
    return o ? o : cJSON_CreateNull();
}

/* The first of each by id, on or off: the sun that skies have, and the sky that shines. */
struct cJSON *lum_daylight_describe(const struct lum_world *world)
{
    const struct lum_light_table *lights = &world->snapshot->lights;
    cJSON *o = cJSON_CreateObject(), *sun = NULL, *sky = NULL;
    for (uint32_t i = 0; i < lights->n_lights; i++) {
        const struct lum_light *l = &lights->lights[i];
        const struct lum_record *r = lum_document_find(world->doc, l->id);
        if (!sun && r && r->type == LUM_RECORD_LIGHT && strcmp(r->light.kind, "sun") == 0)
            sun = describe_sun(r);
        if (!sky && l->env && lum_env_map_sky(l->env))
            sky = describe_sky(l);
    }
    if (lum_json_add(o, "sun", or_null(sun)) && lum_json_add(o, "sky", or_null(sky)))
        return o;
    cJSON_Delete(o);
    return NULL;
}
