/* Records to renderer: units and colours. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "core/material/material.h"
#include "core/light/emitter.h"
#include "core/scene/light_kind.h"
#include "core/scene/snapshot.h"
#include "protocol/json/json.h"
#include "protocol/op/op.h"
#include "protocol/record/field.h"
#include "server/base/web_desc.h"
#include "server/world/apply.h"
#include "server/world/light_kinds.h"

#define PI 3.14159265358979323846

static void assert_near(double value, double expected, double relative)
{
    if (!(fabs(value - expected) <= relative * fabs(expected)))
        fail_msg("%.17g is not %.17g within a relative %g", value, expected, relative);
}

/* The op of a JSON text; the caller finishes it. */
static struct lum_op parse(const char *text)
{
    struct lum_proto_error err = {0};
    struct lum_op op;
    cJSON *json = lum_json_parse(text, strlen(text), &err);
    if (!json || !lum_op_from_json(json, NULL, &op, &err))
        fail_msg("%s: %s: %s", text, err.path, err.text);
    cJSON_Delete(json);
    return op;
}

static struct lum_light_desc light(const char *text)
{
    struct lum_op op = parse(text);
    struct lum_light_desc d;
    struct lum_error err = {0};
    struct lum_web *web = NULL;
    if (op.record->light.web) {
        struct lum_web_desc desc = lum_web_desc_of(op.record->light.web);
        if (lum_web_create(&desc, &web, &err))
            fail_msg("%s: %s", text, err.text);
    }
    if (lum_apply_light(op.record, web, &d, &err))
        fail_msg("%s: %s", text, err.text);
    lum_op_finish(&op);
    lum_web_unref(web);
    d.image = d.group = NULL; /* they were borrowed */
    d.web = NULL;
    return d;
}

/* Doubles all along: a few ulps. */
#define EXACT 1e-14

static void flux_becomes_the_unit_of_the_kind(void **state)
{
    (void)state;
    struct lum_light_desc d =
        light("{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"point\",\"flux_lm\":1000}");
    assert_near(d.intensity, 1000.0 / (4.0 * PI), EXACT);
    d = light("{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"quad\",\"u\":[2,0,0],\"v\":[0,0,3],\"flux_"
              "lm\":1000}");
    assert_near(d.intensity, 1000.0 / (PI * 6.0), EXACT);
    d = light("{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"disc\",\"direction\":[0,-1,0],\"radius\":0.5,"
              "\"flux_lm\":1000}");
    assert_near(d.intensity, 1000.0 / (PI * PI * 0.25), EXACT);
    d = light("{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"sphere\",\"radius\":0.5,\"flux_lm\":1000}");
    assert_near(d.intensity, 1000.0 / (PI * 4.0 * PI * 0.25), EXACT);
}

/* A cone whose falloff has no width sends I through the solid angle 2 pi (1 - cos). The record wants inner < outer, so
 * the outer is a thousandth of a degree more: 2 pi sin(30) 1.7e-5 rad more of partly lit cone, over 0.84 sr: 1e-4. */
static void spot_flux_fills_its_cone(void **state)
{
    (void)state;
    struct lum_light_desc d =
        light("{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"spot\",\"direction\":[0,-1,0],"
              "\"inner_cone_deg\":30,\"outer_cone_deg\":30.001,\"flux_lm\":500}");
    assert_near(d.intensity, 500.0 / (2.0 * PI * (1.0 - cos(PI / 6.0))), 1e-4);
    assert_near(d.inner_cone_rad, PI / 6.0, EXACT);
}

static void natural_units_pass_through(void **state)
{
    (void)state;
    for (size_t k = 0; k < LUM_LIGHT_KIND_COUNT; k++) {
        const struct lum_light_kind_row *row = lum_light_kinds[k].row;
        enum lum_power_unit unit = row->emitter->unit;
        char text[160];
        if (row == &lum_light_kind_ies) /* has a web instead: below */
            continue;
        snprintf(text, sizeof text, "{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"%s\",%s\"%s\":80}",
                 lum_light_kinds[k].name, row == &lum_light_kind_sun ? "\"azimuth_deg\":180,\"elevation_deg\":40," : "",
                 unit == LUM_POWER_INTENSITY     ? "intensity_cd"
                 : unit == LUM_POWER_ILLUMINANCE ? "illuminance_lx"
                                                 : "luminance_cd_m2");
        struct lum_light_desc d = light(text);
        assert_ptr_equal(d.kind, row);
        assert_near(d.intensity, 80.0, 0.0);
    }
}

/* Golden, Colorado, as Reda and Andreas have it (tests/numeric/daylight_test.c): seen at 39.888, 194.340 degrees. */
static void sun_stands_where_place_and_time_say(void **state)
{
    (void)state;
#define SUN                                                                                                            \
    "{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"sun\",\"date\":\"2003-10-17\","                        \
    "\"time_h\":12.508333,\"utc_offset_h\":-7,\"latitude_deg\":39.742476,\"longitude_deg\":-105.1786"
    const double degree = PI / 180.0;
    struct lum_light_desc d = light(SUN "}");
    assert_near(-d.direction.y, sin(39.888 * degree), 5e-4);
    assert_near(atan2(-d.direction.x, d.direction.z) / degree + 360.0, 194.340, 1e-4);
    assert_near(d.intensity, 127500 * (1 + 0.034 * cos(2 * PI * 288 / 365)) * exp(-0.21 * 1.556), 2e-3);
    d = light(SUN ",\"north_deg\":90}"); /* north lies along +X */
    assert_near(-d.direction.x, cos(39.888 * degree) * sin((194.34 + 90) * degree), 1e-3);
    assert_near(light(SUN ",\"illuminance_lx\":500}").intensity, 500.0, 0.0);
    d = light(SUN ",\"azimuth_deg\":90,\"elevation_deg\":30}");
    assert_near(-d.direction.y, 0.5, 1e-9);
    assert_near(-d.direction.x, cos(30 * degree), 1e-9);
    d = light(SUN ",\"azimuth_deg\":90,\"elevation_deg\":-1,\"illuminance_lx\":500}");
    assert_near(d.intensity, 0.0, 0.0); /* night */
}

/* An even web over the lower half: 2 pi sr. Floats hold the angle of 90 degrees within 1e-7 of it. */
static void webs_have_their_own_amount(void **state)
{
    (void)state;
#define EVEN                                                                                                           \
    "{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"ies\",\"web\":{\"c_deg\":[0],\"gamma_deg\":[0,90],"    \
    "\"candela\":[50,50]}"
    assert_near(light(EVEN "}").intensity, 50.0, EXACT);
    assert_near(light(EVEN ",\"flux_lm\":null}").intensity, 50.0, EXACT);
    assert_near(light(EVEN ",\"multiplier\":0.5}").intensity, 25.0, EXACT);
    assert_near(light(EVEN ",\"flux_lm\":600}").intensity, 600.0 / (2.0 * PI), 1e-6);
    struct lum_light_desc d = light(EVEN ",\"direction\":[0,-2,0]}");
    assert_near(d.u.x, 1.0, EXACT);
    d = light(EVEN ",\"direction\":[0,-2,0],\"roll_deg\":90}"); /* c 90 of one that aims down */
    assert_near(d.u.z, -1.0, EXACT);
    d = light(EVEN ",\"direction\":[1,0,0]}"); /* carried along: what lay along +X now lies along +Y */
    assert_near(d.u.y, 1.0, EXACT);
    d = light(EVEN ",\"direction\":[0,1,0]}");
    assert_near(d.u.x, 1.0, EXACT);
}

/* Three floats rounded: 3 * 2^-24 of their sum. */
#define FLOAT_SUM 2e-7

static void colours_have_luminance_one(void **state)
{
    (void)state;
    static const char *const lights[] = {
        "{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"point\",\"intensity_cd\":1,\"color\":[1,0,0]}",
        "{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"point\",\"intensity_cd\":1,\"color\":[0.2,0.5,0.9]"
        "}",
        "{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"point\",\"intensity_cd\":1,\"cct_k\":1700}",
        "{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"point\",\"intensity_cd\":1,\"cct_k\":2700}",
        "{\"op\":\"add\",\"type\":\"light\",\"id\":\"a\",\"kind\":\"point\",\"intensity_cd\":1,\"cct_k\":20000}",
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(lights); i++)
        assert_near((double)lum_luminance(light(lights[i]).color), 1.0, FLOAT_SUM);
    struct lum_rgb warm = light(lights[3]).color, cold = light(lights[4]).color;
    assert_true(warm.r > warm.g && warm.g > warm.b);
    assert_true(cold.r < cold.g && cold.g < cold.b);
}

static void black_emission_needs_no_colour(void **state)
{
    (void)state;
    struct lum_op op = parse("{\"op\":\"add\",\"type\":\"material\",\"id\":\"m\",\"base_color\":[0.1,0.2,0.3],"
                             "\"emission_color\":[0,0,0],\"attenuation_distance\":null}");
    struct lum_material_desc m;
    assert_int_equal(lum_apply_material(op.record, &m, NULL), LUM_OK);
    assert_true(isinf(m.attenuation_distance_m));
    assert_null(m.base_color_texture.image);
    op.record->material.emission_cd_m2 = 5.0;
    struct lum_error err;
    assert_int_equal(lum_apply_material(op.record, &m, &err), LUM_ERR_INVALID);
    assert_string_equal(err.field, "emission_color");
    lum_op_finish(&op);
}

/* Coefficients per metre pass through; no box is everywhere. */
static void media_pass_through(void **state)
{
    (void)state;
    struct lum_op op =
        parse("{\"op\":\"add\",\"type\":\"medium\",\"id\":\"fog\",\"sigma_s\":[1,2,3],\"sigma_a\":[0,0,4],"
              "\"g\":-0.5,\"box\":{\"min\":[-1,0,1],\"max\":[1,2,3]}}");
    struct lum_medium_desc m = lum_apply_medium(op.record);
    assert_true(m.sigma_s.g == 2.0f && m.sigma_a.b == 4.0f && m.g == -0.5f && !m.everywhere);
    assert_true(m.lo.x == -1.0 && m.lo.z == 1.0 && m.hi.y == 2.0);
    lum_op_finish(&op);
    op = parse("{\"op\":\"add\",\"type\":\"medium\",\"id\":\"fog\",\"g\":0.99}");
    m = lum_apply_medium(op.record);
    assert_true(m.everywhere && lum_rgb_black(m.sigma_s) && m.g == 0.99f);
    lum_op_finish(&op);
}

static void errors_name_their_op(void **state)
{
    (void)state;
    struct lum_error e;
    struct lum_proto_error err;
    lum_fail(&e, LUM_ERR_INVALID, "radius", "radius must be above 0");
    assert_false(lum_apply_error(&e, "ops/3", &err));
    assert_string_equal(err.path, "ops/3/radius");
    assert_string_equal(err.app, "invalid_value");
    assert_int_equal(err.code, LUM_PROTO_BAD_PARAMS);
}

static void settings_check_the_method(void **state)
{
    (void)state;
    struct lum_record *r = lum_record_create(LUM_RECORD_RENDER, "render");
    assert_non_null(r);
    struct lum_view_settings s = lum_view_settings_default();
    struct lum_error err;
    strcpy(r->render.method, "whitted");
    r->render.max_depth = 5;
    assert_int_equal(lum_apply_settings(r, &s, &err), LUM_OK);
    assert_string_equal(s.method->name, "whitted");
    assert_int_equal(s.max_depth, 5);
    strcpy(r->render.method, "radiosity");
    assert_int_equal(lum_apply_settings(r, &s, &err), LUM_ERR_UNSUPPORTED);
    assert_string_equal(err.field, "method");
    lum_record_unref(r);
}

/* From the next commit on, and back. */
static void solid_glass_is_straightened(void **state)
{
    (void)state;
    struct lum_record *render = lum_record_create(LUM_RECORD_RENDER, "render");
    struct lum_record *glass = lum_record_create(LUM_RECORD_MATERIAL, "glass");
    struct lum_device *device;
    struct lum_scene *scene;
    assert_true(render && glass);
    assert_string_equal(render->render.glass, "physical");
    glass->material.transmission = 1.0;
    glass->material.roughness = 0.0;
    assert_int_equal(lum_device_create(1, NULL, &device, NULL), LUM_OK);
    assert_int_equal(lum_scene_create(device, &scene, NULL), LUM_OK);
    assert_int_equal(lum_apply_put(scene, glass, NULL), LUM_OK);
    for (int architectural = 1; architectural >= 0; architectural--) {
        const struct lum_snapshot *s;
        strcpy(render->render.glass, architectural ? "architectural" : "physical");
        assert_int_equal(lum_apply_put(scene, render, NULL), LUM_OK);
        assert_int_equal(lum_scene_commit(scene, 1, &s, NULL), LUM_OK);
        assert_int_equal(lum_material_is_pane(&s->materials[0]), architectural);
        lum_snapshot_unref(s);
    }
    lum_scene_destroy(scene);
    lum_device_destroy(device);
    lum_record_unref(render);
    lum_record_unref(glass);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(solid_glass_is_straightened),
        cmocka_unit_test(flux_becomes_the_unit_of_the_kind),
        cmocka_unit_test(spot_flux_fills_its_cone),
        cmocka_unit_test(natural_units_pass_through),
        cmocka_unit_test(sun_stands_where_place_and_time_say),
        cmocka_unit_test(colours_have_luminance_one),
        cmocka_unit_test(black_emission_needs_no_colour),
        cmocka_unit_test(errors_name_their_op),
        cmocka_unit_test(settings_check_the_method),
        cmocka_unit_test(media_pass_through),
        cmocka_unit_test(webs_have_their_own_amount),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
