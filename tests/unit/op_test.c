/* Ops as clients write them: rules that span fields, set by path, .jsonl. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "protocol/json/json.h"
#include "tests/unit/protocol_util.h"

/* ---- rules that span fields ---- */

static void expect(const char *text, const char *app, const char *path)
{
    struct lum_proto_error err = {0};
    cJSON *op = json_of(text);
    struct lum_record *r = record_of(op, &err);
    if ((r != NULL) != (app == NULL))
        fail_msg("%s: %s", text, r ? "accepted" : err.text);
    if (app && (strcmp(err.app, app) != 0 || strcmp(err.path, path) != 0))
        fail_msg("%s: %s at \"%s\": %s", text, err.app, err.path, err.text);
    lum_record_unref(r);
    cJSON_Delete(op);
}

static void photometric_quantities(void **state)
{
    static const struct {
        const char *kind, *natural;
    } kinds[] = {{"point", " flux_lm intensity_cd "},   {"spot", " flux_lm intensity_cd "},
                 {"directional", " illuminance_lx "},   {"quad", " flux_lm luminance_cd_m2 "},
                 {"disc", " flux_lm luminance_cd_m2 "}, {"sphere", " flux_lm luminance_cd_m2 "},
                 {"environment", " luminance_cd_m2 "}};
    static const char *const names[] = {"flux_lm", "intensity_cd", "luminance_cd_m2", "illuminance_lx"};
    (void)state;
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        char text[200], path[40];
        snprintf(text, sizeof text, "{'op':'add','type':'light','id':'x','kind':'%s'}", kinds[k].kind);
        sscanf(kinds[k].natural, "%39s", path);
        expect(text, "missing_field", path);
        for (int i = 0; i < 4; i++) {
            snprintf(path, sizeof path, " %s ", names[i]);
            bool natural = strstr(kinds[k].natural, path);
            snprintf(text, sizeof text, "{'op':'add','type':'light','id':'x','kind':'%s','%s':5}", kinds[k].kind,
                     names[i]);
            expect(text, natural ? NULL : "invalid_value", names[i]);
            for (int j = 0; j < 4; j++)
                if (i != j) {
                    snprintf(text, sizeof text, "{'op':'add','type':'light','id':'x','kind':'%s','%s':5,'%s':5}",
                             kinds[k].kind, names[i], names[j]);
                    expect(text, "invalid_value", names[i]);
                }
        }
    }
}

static void rules(void **state)
{
    (void)state;
#define LIGHT "{'op':'add','type':'light','id':'x',"
#define MESH "{'op':'add','type':'mesh','id':'x',"
#define OBJECT "{'op':'add','type':'object','id':'x','mesh':'m','material':'w','transform':"
#define CAMERA "{'op':'add','type':'camera','id':'x','position':[0,0,0],"
#define WEB "'web':{'c_deg':[0,180,360],'gamma_deg':[0,90],'candela':[1,1,1,1,2,0]}"
    expect(LIGHT "'kind':'ies','asset':'a.ies'}", NULL, NULL);
    expect(LIGHT "'kind':'ies','asset':'a.ies','flux_lm':5}", NULL, NULL);
    expect(LIGHT "'kind':'ies','asset':'a.ies','flux_lm':null,'multiplier':5}", NULL, NULL);
    expect(LIGHT "'kind':'ies','asset':'a.ies','flux_lm':5,'multiplier':5}", "invalid_value", "flux_lm");
    expect(LIGHT "'kind':'ies','asset':'a.ies','intensity_cd':5}", "invalid_value", "intensity_cd");
    expect(LIGHT "'kind':'ies','asset':'../a.ies'}", "invalid_value", "asset");
    expect(LIGHT "'kind':'ies'}", "missing_field", "asset");
    expect(LIGHT "'kind':'point','flux_lm':5,'multiplier':5}", "invalid_value", "flux_lm");
    expect(LIGHT "'kind':'point','flux_lm':5,'asset':'a.ies'}", "invalid_value", "asset");
    expect(LIGHT "'kind':'point','flux_lm':5," WEB "}", "invalid_value", "web");
    expect(LIGHT "'kind':'ies','direction':[0,0,0]," WEB "}", "invalid_value", "direction");
    expect(LIGHT "'kind':'ies'," WEB "}", NULL, NULL);
    expect(LIGHT "'kind':'ies','asset':'a.ies'," WEB "}", "invalid_value", "asset");
#define WITH(web) LIGHT "'kind':'ies','web':{" web "}}"
    expect(WITH(""), "missing_field", "web/c_deg");
    expect(WITH("'c_deg':[0],'gamma_deg':[0,90],'candela':[1,1],'lumens':3"), "unknown_field", "web/lumens");
    expect(WITH("'c_deg':[0],'gamma_deg':[0,90],'candela':[1,1],'type':'d'"), "invalid_value", "web/type");
    expect(WITH("'c_deg':[],'gamma_deg':[0,90],'candela':[]"), "invalid_value", "web/c_deg");
    expect(WITH("'c_deg':[0],'gamma_deg':[0],'candela':[1]"), "invalid_value", "web/gamma_deg");
    expect(WITH("'c_deg':[0],'gamma_deg':[0,90],'candela':[1,1,1]"), "invalid_value", "web/candela");
    expect(WITH("'c_deg':[0],'gamma_deg':[0,181],'candela':[1,1]"), "invalid_value", "web/gamma_deg/1");
    expect(WITH("'c_deg':[0],'gamma_deg':[90,90],'candela':[1,1]"), "invalid_value", "web/gamma_deg");
    expect(WITH("'c_deg':[-1,360],'gamma_deg':[0,90],'candela':[1,1,1,1]"), "invalid_value", "web/c_deg");
    expect(WITH("'c_deg':[0],'gamma_deg':[0,90],'candela':[1,-1]"), "invalid_value", "web/candela/1");
    expect(WITH("'c_deg':[0],'gamma_deg':[0,90],'candela':[0,0]"), "invalid_value", "web/candela");
#define SUN LIGHT "'kind':'sun','date':"
    expect(SUN "'2026-06-21'}", NULL, NULL);
    expect(SUN "'2024-02-29','illuminance_lx':5}", NULL, NULL);
    expect(SUN "'2000-02-29','latitude_deg':-90,'longitude_deg':180,'time_h':24,'utc_offset_h':-14}", NULL, NULL);
    expect(SUN "'2026-02-29'}", "invalid_value", "date");
    expect(SUN "'2100-02-29'}", "invalid_value", "date");
    expect(SUN "'2026-04-31'}", "invalid_value", "date");
    expect(SUN "'2026-13-01'}", "invalid_value", "date");
    expect(SUN "'2026-00-01'}", "invalid_value", "date");
    expect(SUN "'2026-01-00'}", "invalid_value", "date");
    expect(SUN "'1899-12-31'}", "invalid_value", "date");
    expect(SUN "'21-06-2026'}", "invalid_value", "date");
    expect(SUN "'2026-6-21'}", "invalid_value", "date");
    expect(SUN "'2026-06-21T12'}", "invalid_value", "date");
    expect(SUN "'2026-06-21','latitude_deg':90.1}", "invalid_value", "latitude_deg");
    expect(SUN "'2026-06-21','longitude_deg':-181}", "invalid_value", "longitude_deg");
    expect(SUN "'2026-06-21','time_h':24.1}", "invalid_value", "time_h");
    expect(SUN "'2026-06-21','luminance_cd_m2':5}", "invalid_value", "luminance_cd_m2");
    expect(SUN "'2026-06-21','azimuth_deg':5}", "missing_field", "elevation_deg");
    expect(SUN "'2026-06-21','azimuth_deg':5,'elevation_deg':91}", "invalid_value", "elevation_deg");
    expect(LIGHT "'kind':'sun'}", "missing_field", "date");
    expect(LIGHT "'kind':'sun','azimuth_deg':180,'elevation_deg':-5}", NULL, NULL);
    expect(LIGHT "'kind':'sky'}", NULL, NULL);
    expect(LIGHT "'kind':'sky','cie_type':16,'illuminance_lx':10000}", NULL, NULL);
    expect(LIGHT "'kind':'sky','cie_type':0}", "invalid_value", "cie_type");
    expect(LIGHT "'kind':'sky','cie_type':17}", "invalid_value", "cie_type");
    expect(LIGHT "'kind':'sky','cie_type':2.5}", "invalid_value", "cie_type");
    expect(LIGHT "'kind':'sky','ground_albedo':1.5}", "invalid_value", "ground_albedo");
    expect(LIGHT "'kind':'sky','flux_lm':1}", "invalid_value", "flux_lm");
    expect(LIGHT "'kind':'sky','illuminance_lx':1,'luminance_cd_m2':1}", "invalid_value", "illuminance_lx");
    expect(LIGHT "'kind':'quad','flux_lm':1,'u':[1,0,0],'v':[2,0,0]}", "invalid_value", "u");
    expect(LIGHT "'kind':'disc','flux_lm':1,'radius':0}", "invalid_value", "radius");
    expect(LIGHT "'kind':'point','flux_lm':1,'radius':0}", NULL, NULL);
    expect(LIGHT "'kind':'spot','flux_lm':1,'direction':[0,0,0]}", "invalid_value", "direction");
    expect(LIGHT "'kind':'spot','flux_lm':1,'inner_cone_deg':50,'outer_cone_deg':49}", "invalid_value",
           "inner_cone_deg");
    expect(LIGHT "'kind':'spot','flux_lm':1,'inner_cone_deg':49,'outer_cone_deg':49}", NULL, NULL);
    expect(LIGHT "'kind':'point','flux_lm':1,'color':[0,0,0]}", "invalid_value", "color");
    expect(LIGHT "'kind':'point','flux_lm':1,'color':[1,0,0],'cct_k':3000}", "invalid_value", "color");
    expect(LIGHT "'kind':'point','flux_lm':1,'image':'sky'}", "invalid_value", "image");
    expect(MESH "'shape':'box','positions':[0,0,0],'indices':[0,0,0]}", "invalid_value", "shape");
    expect(MESH "'deforming':true}", "invalid_value", "shape");
    expect(MESH "'positions':[0,0,0,1],'indices':[0,0,0]}", "invalid_value", "positions");
    expect(MESH "'positions':[0,0,0],'indices':[0,0,1]}", "invalid_value", "indices");
    expect(MESH "'positions':[0,0,0],'indices':[0,0]}", "invalid_value", "indices");
    expect(MESH "'positions':[0,0,0]}", "invalid_value", "indices");
    expect(MESH "'positions':[0,0,0],'indices':[0,0,0],'uvs':[1]}", "invalid_value", "uvs");
    expect(MESH "'positions':[0,0,0],'indices':[0,0,0],'normals':[1]}", "invalid_value", "normals");
    expect(MESH "'positions':[0,0,0],'indices':[0,0,0],'tangents':[1,0,0]}", "invalid_value", "tangents");
    expect(MESH "'positions':[0,0,0],'indices':[0,0,0],'colors':[1]}", "invalid_value", "colors");
    expect(OBJECT "{'scale':[1,0,1]}}", "invalid_value", "transform");
    expect(OBJECT "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}", NULL, NULL);
    expect(OBJECT "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1]}", "invalid_value", "transform");
    expect(OBJECT "[1,0,0,0,0,1,0,0,0,0,0,0,0,0,0,1]}", "invalid_value", "transform");
    expect(OBJECT "{'translate':[1,2,1e10]}}", "invalid_value", "transform/translate/2");
    expect(OBJECT "{'rotate':[1,2,3]}}", "unknown_field", "transform/rotate");
    expect(CAMERA "'target':[0,0,0]}", "invalid_value", "target");
    expect(CAMERA "'target':[0,5,0]}", "invalid_value", "up");
    expect(CAMERA "'target':[0,5,0],'up':[0,0,0]}", "invalid_value", "up");
    expect("{'op':'add','type':'medium','id':'x','box':{'min':[0,0,0],'max':[1,0,1]}}", "invalid_value", "box");
    expect("{'op':'add','type':'medium','id':'x','box':{'min':[0,0,0],'max':[1,1,1]}}", NULL, NULL);
#define SENSOR(kind) "{'op':'add','type':'sensor','id':'x','position':[0,1,0],'kind':'" kind "'"
    expect(SENSOR("grid") ",'target_uo':0.6}", NULL, NULL);
    expect(SENSOR("grid") ",'target_ugr':19}", "invalid_value", "target_ugr");
    expect(SENSOR("grid") ",'u':[0,0,2]}", "invalid_value", "u");
    expect(SENSOR("line") ",'u':[0,0,0]}", "invalid_value", "u");
    expect(SENSOR("point") ",'spacing_m':1}", "invalid_value", "spacing_m");
    expect(SENSOR("point") ",'normal':[0,0,0]}", "invalid_value", "normal");
    expect(SENSOR("point") ",'quantity':'semicylindrical','direction':[0,2,0]}", "invalid_value", "direction");
    expect(SENSOR("observer") ",'direction':[0,0,0]}", "invalid_value", "direction");
    expect(SENSOR("observer") ",'target_lx':500}", "invalid_value", "target_lx");
    expect(SENSOR("observer") ",'target_ugr':19,'target_dgp':0.35}", NULL, NULL);
    expect(SENSOR("observer") ",'target_dgp':1.5}", "invalid_value", "target_dgp");
    expect(SENSOR("point") ",'target_dgp':0.35}", "invalid_value", "target_dgp");
#define EYES(kind) SENSOR(kind) ",'quantity':'ugr'"
    expect(EYES("grid") ",'target_ugr':19,'directions':12}", NULL, NULL);
    expect(EYES("point") ",'target_lx':500}", "invalid_value", "target_lx");
    expect(EYES("line") ",'target_uo':0.5}", "invalid_value", "target_uo");
    expect(EYES("grid") ",'directions':0}", "invalid_value", "directions");
    expect(EYES("grid") ",'directions':65}", "invalid_value", "directions");
    expect(EYES("grid") ",'direction':[0,-1,0]}", "invalid_value", "direction");
    expect(EYES("grid") ",'direction':[0,-1,0],'directions':1}", NULL, NULL);
#undef EYES
#undef SENSOR
#define SHEET(reflects, transmits)                                                                                     \
    "{'op':'add','type':'material','id':'x','base_color':" reflects ",'diffuse_transmittance':" transmits "}"
    expect(SHEET("[0.4,0.3,0.2]", "[0.6,0.7,0.8]"), NULL, NULL);
    expect(SHEET("[0.4,0.3,0.2]", "[0.6,0.71,0.8]"), "invalid_value", "diffuse_transmittance");
    expect(SHEET("[1,1,1]", "[0,0,0]"), NULL, NULL);
    expect(SHEET("[0,0,0]", "[0,0,1.1]"), "invalid_value", "diffuse_transmittance/2");
    expect("{'op':'add','type':'material','id':'x','diffuse_transmittance':[0.5,0.5,0.5]}", "invalid_value",
           "diffuse_transmittance"); /* base_color is white if nothing is said of it */
#undef SHEET
    expect("{'op':'add','type':'material','id':'x','clearcoat':1,'clearcoat_roughness':0.3}", NULL, NULL);
    expect("{'op':'add','type':'material','id':'x','sheen_color':[1,0.5,0],'sheen_roughness':0.3}", NULL, NULL);
    expect("{'op':'add','type':'material','id':'x','sheen_color':[0,0,1.1]}", "invalid_value", "sheen_color/2");
    expect("{'op':'add','type':'material','id':'x','anisotropy':1,'anisotropy_rotation_deg':-90}", NULL, NULL);
    expect("{'op':'add','type':'material','id':'x','anisotropy':-0.1}", "invalid_value", "anisotropy");
    expect("{'op':'add','type':'material','id':'x','anisotropy_rotation_deg':1e5}", "invalid_value",
           "anisotropy_rotation_deg");
    expect("{'op':'add','type':'material','id':'x','clearcoat':1.1}", "invalid_value", "clearcoat");
    expect("{'op':'add','type':'material','id':'x','clearcoat_roughness':-0.1}", "invalid_value",
           "clearcoat_roughness");
    expect("{'op':'add','type':'image','id':'x'}", "invalid_value", "asset");
    expect("{'op':'add','type':'image','id':'x','width':2,'height':2,'pixels':'AQIDBA=='}", "invalid_value", "pixels");
    expect("{'op':'add','type':'image','id':'x','width':1,'height':1,'pixels':'AQIDB'}", "invalid_value", "pixels");
    expect("{'op':'add','type':'image','id':'x','width':1,'height':1,'texel':'rgb32f','pixels':'AADAfwAAAEAAAEBA'}",
           "invalid_value", "pixels"); /* a NaN */
    for (int n = 1; n <= 16; n++) {
        char text[120];
        bool square = n == 1 || n == 4 || n == 9 || n == 16;
        snprintf(text, sizeof text, "{'op':'set','id':'render','path':'','value':{'shadow_samples':%d}}", n);
        expect(text, square ? NULL : "invalid_value", "shadow_samples");
    }
}

/* The largest web, and ones of a plane less and more. */
static void webs_have_a_limit(void **state)
{
    (void)state;
    static float values[513 * 512], angles[513];
    for (size_t i = 0; i < sizeof values / sizeof *values; i++)
        values[i] = 1.0f;
    for (int i = 0; i < 513; i++)
        angles[i] = (float)i * 0.25f;
    for (int n = 511; n <= 513; n++) {
        struct lum_record_web *web = lum_record_web_create();
        struct lum_proto_error err = {0};
        web->c_deg = (struct lum_floats){.f32 = angles, .n = (size_t)n};
        web->gamma_deg = (struct lum_floats){.f32 = angles, .n = 512};
        web->candela = (struct lum_floats){.f32 = values, .n = (size_t)n * 512};
        bool ok = lum_record_web_validate(web, &err);
        assert_true(ok == (n * 512 <= (int)LUM_LIMIT_WEB_VALUES));
        if (!ok)
            assert_string_equal(err.app, "limit_exceeded");
        web->c_deg = web->gamma_deg = web->candela = (struct lum_floats){0};
        lum_record_web_unref(web);
    }
}

static void malformed_ops(void **state)
{
    static const struct {
        const char *text, *app, *path;
    } cases[] = {
        {"{}", "missing_field", "op"},
        {"{'op':'move','id':'x'}", "invalid_value", "op"},
        {"{'op':1,'id':'x'}", "invalid_value", "op"},
        {"{'op':'remove'}", "missing_field", "id"},
        {"{'op':'remove','id':'a b'}", "invalid_value", "id"},
        {"{'op':'remove','id':'x','path':'/y'}", "unknown_field", "path"},
        {"{'op':'add','id':'x'}", "missing_field", "type"},
        {"{'op':'add','type':'lamp','id':'x'}", "invalid_value", "type"},
        {"{'op':'add','type':'render','id':'x'}", "invalid_value", "type"},
        {"{'op':'add','type':'import','id':'x','asset':'a'}", "invalid_value", "type"},
        {"{'op':'add','type':'medium','id':'x','t_ms':5}", "unknown_field", "t_ms"},
        {"{'op':'set','id':'x','value':1}", "missing_field", "path"},
        {"{'op':'set','id':'x','path':'/y'}", "missing_field", "value"},
        {"{'op':'set','id':'x','path':7,'value':1}", "invalid_value", "path"},
        {"{'op':'set','id':'x','path':'/y','value':1,'type':'light'}", "unknown_field", "type"},
        {"{'op':'import','id':'x'}", "missing_field", "asset"},
        {"{'op':'import','id':'x','asset':'a','type':'mesh'}", "unknown_field", "type"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        expect(cases[i].text, cases[i].app, cases[i].path);
    char text[200], id[LUM_LIMIT_IMPORT_ID_BYTES + 2];
    for (int d = -1; d <= 1; d++) {
        memset(id, 'a', sizeof id);
        id[LUM_LIMIT_IMPORT_ID_BYTES + d] = '\0';
        snprintf(text, sizeof text, "{'op':'import','id':'%s','asset':'a.glb'}", id);
        expect(text, d <= 0 ? NULL : "limit_exceeded", "id");
    }
}

/* ---- set by path ---- */

static void sets(void **state)
{
    static const struct {
        enum lum_record_type type;
        const char *path, *value, *app, *err_path;
    } cases[] = {
        {LUM_RECORD_LIGHT, "/flux_lm", "900", NULL, NULL},
        {LUM_RECORD_LIGHT, "/flux_lm", "-1", "invalid_value", "flux_lm"},
        {LUM_RECORD_LIGHT, "/flux_lmm", "1", "unknown_field", "flux_lmm"},
        {LUM_RECORD_LIGHT, "/flux_lm", "null", "missing_field", "flux_lm"},
        {LUM_RECORD_LIGHT, "/intensity_cd", "5", NULL, NULL},
        {LUM_RECORD_LIGHT, "/illuminance_lx", "5", "invalid_value", "illuminance_lx"},
        {LUM_RECORD_LIGHT, "/position/1", "5", NULL, NULL},
        {LUM_RECORD_LIGHT, "/position/3", "5", "not_found", "path"},
        {LUM_RECORD_LIGHT, "/position/1", "2e9", "invalid_value", "position"},
        {LUM_RECORD_LIGHT, "", "{'kind':'quad','luminance_cd_m2':7,'u':[2,0,0]}", NULL, NULL},
        {LUM_RECORD_LIGHT, "", "{'kind':'quad'}", NULL, NULL}, /* flux suits a quad too */
        {LUM_RECORD_LIGHT, "", "{'kind':'environment'}", "invalid_value", "flux_lm"},
        {LUM_RECORD_LIGHT, "", "7", "invalid_value", "value"},
        {LUM_RECORD_LIGHT, "/", "7", "unknown_field", ""},
        {LUM_RECORD_LIGHT, "flux_lm", "7", "not_found", "path"},
        {LUM_RECORD_LIGHT, "/flux_lm/x", "7", "not_found", "path"},
        {LUM_RECORD_LIGHT, "/id", "'y'", "unknown_field", "id"},
        {LUM_RECORD_LIGHT, "/type", "'y'", "unknown_field", "type"},
        {LUM_RECORD_OBJECT, "/transform/translate", "[1,2,3]", NULL, NULL},
        {LUM_RECORD_OBJECT, "/transform/translate/2", "3", NULL, NULL},
        {LUM_RECORD_OBJECT, "/transform/translate/2/0", "3", "not_found", "transform/path"},
        {LUM_RECORD_OBJECT, "/transform/moved", "3", "unknown_field", "transform/moved"},
        {LUM_RECORD_OBJECT, "/transform/scale/0", "0", "invalid_value", "transform"},
        {LUM_RECORD_OBJECT, "/transform", "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]", NULL, NULL},
        {LUM_RECORD_MATERIAL, "/base_color_texture", "{'image':'i','scale':[2,2]}", NULL, NULL},
        {LUM_RECORD_MATERIAL, "/base_color_texture/scale", "[2,2]", "not_found", "path"},
        {LUM_RECORD_MESH, "/positions/0", "3", "not_found", "path"},
        {LUM_RECORD_MESH, "/positions", "[0,0,0,1,0,0,0,2,0]", NULL, NULL},
        {LUM_RECORD_MESH, "/positions", "[0,0,0]", "invalid_value", "indices"},
        {LUM_RECORD_MESH, "/positions", "{'blob':0}", "invalid_value", "positions"},
        {LUM_RECORD_RENDER, "/exposure_ev", "null", NULL, NULL},
        {LUM_RECORD_RENDER, "/exposure_ev", "31", "invalid_value", "exposure_ev"},
        {LUM_RECORD_MEDIUM, "/box/min", "[0,0,0]", "not_found", "path"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct lum_proto_error err = {0};
        cJSON *op = minimal_record(cases[i].type), *value = json_of(cases[i].value);
        struct lum_record *r = record_of(op, &err);
        bool ok = lum_record_set(r, cases[i].path, value, &err);
        if (ok != (cases[i].app == NULL))
            fail_msg("%s = %s: %s", cases[i].path, cases[i].value, ok ? "accepted" : err.text);
        if (!ok && (strcmp(err.app, cases[i].app) || strncmp(err.path, cases[i].err_path, strlen(cases[i].err_path))))
            fail_msg("%s = %s: %s at \"%s\": %s", cases[i].path, cases[i].value, err.app, err.path, err.text);
        lum_record_unref(r);
        cJSON_Delete(op);
        cJSON_Delete(value);
    }
}

static void one_photometric_quantity_replaces_another(void **state)
{
    (void)state;
    cJSON *op = minimal_record(LUM_RECORD_LIGHT), *five = cJSON_CreateNumber(5), *warm = cJSON_CreateNumber(2700);
    struct lum_record *r = record_of(op, NULL);
    assert_true(lum_record_set(r, "/intensity_cd", five, NULL));
    assert_true(r->light.intensity_cd.set && !r->light.flux_lm.set);
    assert_true(lum_record_set(r, "/cct_k", warm, NULL));
    cJSON *red = json_of("[1,0,0]");
    assert_true(lum_record_set(r, "/color", red, NULL));
    assert_true(!r->light.cct_k.set && r->light.color[1] == 0.0);
    cJSON_Delete(red);
    cJSON_Delete(warm);
    cJSON_Delete(five);
    cJSON_Delete(op);
    lum_record_unref(r);
}

/* Euler angles: about X first, then Y, then Z. */
static void rotation_order(void **state)
{
    (void)state;
    struct lum_record_transform t = {.rotate_deg = {90, 90, 0}, .scale = {1, 2, 1}, .translate = {1, 2, 3}};
    double m[3][4];
    lum_record_transform_affine(&t, m);
    /* the unit y axis: scaled to 2y, X turns it to 2z, Y turns 2z to 2x, then moved */
    const double want[3] = {2 + 1, 0 + 2, 0 + 3};
    for (int i = 0; i < 3; i++)
        assert_true(fabs(m[i][1] + m[i][3] - want[i]) < 1e-12); /* cos 90 deg is 6e-17, not 0 */
}

/* ---- .jsonl ---- */

static bool read_jsonl(const char *text, struct lum_ops *ops, struct lum_proto_error *err)
{
    memset(ops, 0, sizeof *ops);
    memset(err, 0, sizeof *err);
    return lum_ops_from_jsonl(text, strlen(text), ops, err);
}

static void jsonl(void **state)
{
    struct lum_ops ops;
    struct lum_proto_error err;
    (void)state;
    assert_true(read_jsonl("\n# a comment\n{\"lumend\":1,\"kind\":\"scene\",\"title\":\"t\"}\r\n  \n"
                           "{\"op\":\"remove\",\"id\":\"a\"}\n{\"op\":\"remove\",\"id\":\"b\"}",
                           &ops, &err));
    assert_int_equal(ops.n, 2);
    assert_null(ops.t_ms);
    lum_ops_finish(&ops);
    assert_true(read_jsonl("{\"lumend\":1,\"kind\":\"replay\"}\n{\"t_ms\":0,\"op\":\"remove\",\"id\":\"a\"}\n"
                           "{\"t_ms\":33.5,\"op\":\"set\",\"id\":\"b\",\"path\":\"/on\",\"value\":true}\n",
                           &ops, &err));
    assert_true(ops.n == 2 && ops.t_ms[1] == 33.5);
    lum_ops_finish(&ops);
    assert_true(read_jsonl("{\"lumend\":1,\"kind\":\"scene\"}", &ops, &err));
    lum_ops_finish(&ops);
    static const struct {
        const char *text, *line;
    } bad[] = {
        {"", "the first line"},
        {"{\"op\":\"remove\",\"id\":\"a\"}", "line 1:"},
        {"{\"lumend\":2,\"kind\":\"scene\"}", "line 1:"},
        {"{\"lumend\":1,\"kind\":\"film\"}", "line 1:"},
        {"{\"lumend\":1,\"kind\":\"scene\",\"tilte\":\"x\"}", "line 1:"},
        {"{\"lumend\":1,\"kind\":\"scene\"}\n\n{\"op\":\"remove\"}", "line 3:"},
        {"{\"lumend\":1,\"kind\":\"scene\"}\n{\"op\":\"remove\",\"id\":\"a\",\"t_ms\":1}", "line 2:"},
        {"{\"lumend\":1,\"kind\":\"replay\"}\n{\"op\":\"remove\",\"id\":\"a\"}", "line 2:"},
        {"{\"lumend\":1,\"kind\":\"replay\"}\n{\"op\":\"remove\",\"id\":\"a\",\"t_ms\":-1}", "line 2:"},
        {"{\"lumend\":1,\"kind\":\"replay\"}\n{\"op\":\"remove\",\"id\":\"a\",\"t_ms\":5}\n"
         "{\"op\":\"remove\",\"id\":\"a\",\"t_ms\":4}",
         "line 3:"},
        {"{\"lumend\":1,\"kind\":\"scene\"}\n{\"op\":\"remove\",\"id\":\"a\"", "line 2:"},
        {"{\"lumend\":1,\"kind\":\"scene\"}\n[]", "line 2:"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        if (read_jsonl(bad[i].text, &ops, &err))
            fail_msg("accepted %s", bad[i].text);
        if (!strstr(err.text, bad[i].line))
            fail_msg("%s: %s", bad[i].text, err.text);
    }
}

static void ops_per_message(void **state)
{
    (void)state;
    for (int d = -1; d <= 1; d++) {
        cJSON *array = cJSON_CreateArray();
        for (int i = 0; i < (int)LUM_LIMIT_OPS_PER_MESSAGE + d; i++)
            lum_json_add(array, NULL, json_of("{'op':'remove','id':'a'}"));
        struct lum_ops ops;
        struct lum_proto_error err;
        bool ok = lum_ops_from_json(array, &ops, &err);
        assert_int_equal(ok, d <= 0);
        if (ok)
            lum_ops_finish(&ops);
        cJSON_Delete(array);
    }
    struct lum_proto_error err;
    struct lum_ops ops;
    cJSON *array = json_of("[{'op':'remove','id':'a'},{'op':'remove','id':'b'},{'op':'add','type':'light','id':'c','"
                           "kind':'point','flux_lm':-1}]");
    assert_false(lum_ops_from_json(array, &ops, &err));
    assert_string_equal(err.path, "ops/2/flux_lm");
    assert_true(err.has_range && err.min == 0.0 && err.max == 1e12);
    cJSON_Delete(array);
    array = json_of("[]");
    assert_false(lum_ops_from_json(array, &ops, &err));
    cJSON_Delete(array);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(photometric_quantities),
        cmocka_unit_test(rules),
        cmocka_unit_test(webs_have_a_limit),
        cmocka_unit_test(malformed_ops),
        cmocka_unit_test(sets),
        cmocka_unit_test(one_photometric_quantity_replaces_another),
        cmocka_unit_test(rotation_order),
        cmocka_unit_test(jsonl),
        cmocka_unit_test(ops_per_message),
    };
    return cmocka_run_group_tests_name("op", tests, NULL, NULL);
}
