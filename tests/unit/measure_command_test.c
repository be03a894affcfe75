/* lumend measure: closed forms of illuminance on a grid, targets, files, and what it refuses. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "protocol/json/json.h"
#include "server/cli/commands.h"
#include "tests/unit/cli_kit.h"

#define PI 3.14159265358979323846

/* A black floor of 5 x 4 m, 20 cm thick, below a bulb of 1000 cd in every direction: all light is direct. */
#define BULB_HEIGHT 3.0
static const char room[] =
    "{\"lumend\":1,\"kind\":\"scene\"}\n"
    "{\"op\":\"add\",\"type\":\"material\",\"id\":\"black\",\"base_color\":[0,0,0],\"specular\":0}\n"
    "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"slab\",\"shape\":\"box\",\"size\":[5,0.2,4]}\n"
    "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"sheet\",\"shape\":\"quad\",\"size\":[5,0,4]}\n"
    "{\"op\":\"add\",\"type\":\"object\",\"id\":\"floor\",\"mesh\":\"slab\",\"material\":\"black\",\"transform\":{"
    "\"translate\":[0,"
    "-0.1,0]}}\n"
    "{\"op\":\"add\",\"type\":\"object\",\"id\":\"roof\",\"mesh\":\"sheet\",\"material\":\"black\",\"transform\":{"
    "\"translate\":[0,4,0]"
    "}}\n"
    "{\"op\":\"add\",\"type\":\"light\",\"id\":\"bulb\",\"kind\":\"point\",\"position\":[0,3,0],\"intensity_cd\":1000}"
    "\n"
    "{\"op\":\"add\",\"type\":\"camera\",\"id\":\"main\",\"position\":[0,1,3],\"target\":[0,0,0],\"up\":[0,1,0],\"vfov_"
    "deg\":50}\n";

static cJSON *measure(const char *options, int wanted)
{
    char line[512];
    cli_write_text(cli_in_dir("room.jsonl"), room);
    snprintf(line, sizeof line, "measure --scene @room.jsonl --json @m.json %s", options);
    assert_int_equal(cli_run(lum_cmd_measure, line), wanted);
    char *text = cli_read_text(cli_in_dir("m.json"));
    cJSON *o = lum_json_parse(text, strlen(text), NULL);
    assert_non_null(o);
    free(text);
    return o;
}

/* I cos / r^2 on the plane, I sin / (pi r^2) on a cylinder; angles from the vertical. */
static double expected(double x, double y, double z, bool cylindrical)
{
    double h = BULB_HEIGHT - y, side2 = x * x + z * z, r2 = h * h + side2, r = sqrt(r2);
    return 1000.0 / r2 * (cylindrical ? sqrt(side2) / r / PI : h / r);
}

/* Every point: of a plane exactly but for floats, as all samples of a point light are alike; of a cylinder within 4.5
 * standard errors, which of 24 points one in 6,000 runs would miss, were the draw another. The ground is the slab's
 * top, and the points are the middles of equal cells. */
static void a_bulb_has_its_closed_form(void **state)
{
    (void)state;
    static const struct {
        const char *options;
        double y, x0, z0, dx, dz;
        bool cylindrical;
    } cases[] = {
        {"--spacing 1", 0.75, -2.0, -1.5, 4.0 / 4, 3.0 / 3, false},
        {"--area -1,-1,2,1 --height 0.5 --spacing 0.5", 0.5, -1.0, -1.0, 0.5, 0.5, false},
        {"--cylindrical --spacing 1", 1.2, -2.0, -1.5, 1.0, 1.0, true},
        {"--on floor --spacing 1", 0.001, -2.5, -2.0, 1.0, 1.0, false},
    };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        cJSON *o = measure(cases[k].options, LUM_EXIT_OK);
        int nx = cli_member(o, "nu")->valueint, i = 0;
        double sum = 0.0, least = (double)INFINITY;
        const cJSON *p;
        cJSON_ArrayForEach(p, cli_member(o, "points"))
        {
            const cJSON *at = cli_member(p, "point");
            double x = cJSON_GetArrayItem(at, 0)->valuedouble, y = cJSON_GetArrayItem(at, 1)->valuedouble,
                   z = cJSON_GetArrayItem(at, 2)->valuedouble;
            assert_true(fabs(x - (cases[k].x0 + (i % nx + 0.5) * cases[k].dx)) < 1e-5);
            assert_true(fabs(y - cases[k].y) < 1e-5);
            assert_true(fabs(z - (cases[k].z0 + ((double)(i / nx) + 0.5) * cases[k].dz)) < 1e-5);
            double lx = cli_member(p, "lx")->valuedouble, is = expected(x, y, z, cases[k].cylindrical);
            double room_for = 1e-5 * is + 4.5 * cli_member(p, "stderr_lx")->valuedouble;
            if (!(fabs(lx - is) <= room_for))
                fail_msg("%s: at %g %g %g: %g lx, not %g", cases[k].options, x, y, z, lx, is);
            sum += lx;
            least = fmin(least, lx);
            i++;
        }
        assert_true(fabs(cli_member(o, "em_lx")->valuedouble / (sum / i) - 1.0) < 1e-9);
        assert_true(fabs(cli_member(o, "emin_lx")->valuedouble / least - 1.0) < 1e-9);
        assert_true(fabs(cli_member(o, "uo")->valuedouble / (least / (sum / i)) - 1.0) < 1e-9);
        cJSON_Delete(o);
    }
}

/* Without --spacing the points lie as EN 12464-1 has them: 4 x 3 m are 0.2 * 5^(log10 4) = 0.527 m apart at most. */
static void points_are_as_dense_as_the_standard_asks(void **state)
{
    (void)state;
    cJSON *o = measure("", LUM_EXIT_OK);
    assert_int_equal(cli_member(o, "nu")->valueint, 8);
    assert_int_equal(cli_member(o, "nv")->valueint, 6);
    cJSON_Delete(o);
}

static void a_target_that_is_missed_fails(void **state)
{
    (void)state;
    cJSON_Delete(measure("--spacing 1 --target 100 --uniformity 0.2", LUM_EXIT_OK));
    cJSON_Delete(measure("--spacing 1 --target 1000", LUM_EXIT_FAILED));
    cJSON_Delete(measure("--spacing 1 --uniformity 0.99", LUM_EXIT_FAILED));
}

static void a_table_has_each_point(void **state)
{
    (void)state;
    cJSON_Delete(measure("--spacing 1 --csv @m.csv", LUM_EXIT_OK));
    char *text = cli_read_text(cli_in_dir("m.csv"));
    int lines = 0;
    for (const char *p = text; *p; p++)
        lines += *p == '\n';
    assert_int_equal(lines, 1 + 4 * 3);
    double x, y, z, lx;
    assert_int_equal(sscanf(text, "x_m,y_m,z_m,lx,stderr_lx\n%lf,%lf,%lf,%lf,", &x, &y, &z, &lx), 4);
    assert_true(fabs(x + 1.5) < 1e-5 && fabs(y - 0.75) < 1e-5 && fabs(z + 1.0) < 1e-5);
    assert_true(fabs(lx / expected(x, y, z, false) - 1.0) < 1e-4); /* six digits of each */
    free(text);
}

/* A floor of 6 x 6 m, wound however, with a table (a slab 6 cm thick whose middle is at 0.75 m), a chest whose
 * triangles are wound inwards, so that no winding tells, a shelf 8 cm above the plane, and a low box that is under it.
 * Of points 1 m apart those in the first three are left out, and no other. */
static void points_inside_furniture_are_left_out(void **state)
{
    (void)state;
    static const char furnished[] =
        "{'lumend':1,'kind':'scene'}\n"
        "{'op':'add','type':'material','id':'grey','base_color':[0.5,0.5,0.5],'specular':0}\n"
        "{'op':'add','type':'mesh','id':'box','shape':'box'}\n"
        "{'op':'add','type':'mesh','id':'quad','shape':'quad','size':[6,0,6]}\n"
        "{'op':'add','type':'object','id':'floor','mesh':'quad','material':'grey'}\n"
        "{'op':'add','type':'object','id':'roof','mesh':'quad','material':'grey','transform':{'translate':[0,4,0]}}\n"
        "{'op':'add','type':'object','id':'table','mesh':'box','material':'grey',"
        "'transform':{'translate':[-2,0.75,-2],'scale':[1.6,0.06,1.6]}}\n"
        "{'op':'add','type':'object','id':'chest','mesh':'box','material':'grey',"
        "'transform':{'translate':[1,0.5,1],'scale':[-0.6,1,0.6]}}\n"
        "{'op':'add','type':'object','id':'shelf','mesh':'quad','material':'grey',"
        "'transform':{'translate':[-2,0.83,2],'scale':[0.1,1,0.1]}}\n"
        "{'op':'add','type':'object','id':'stool','mesh':'box','material':'grey',"
        "'transform':{'translate':[2,0.2,-2],'scale':[0.5,0.4,0.5]}}\n"
        "{'op':'add','type':'light','id':'bulb','kind':'point','position':[0,3.9,0],'intensity_cd':1000}\n";
    char text[sizeof furnished];
    for (size_t i = 0; i < sizeof furnished; i++)
        text[i] = furnished[i] == '\'' ? '"' : furnished[i];
    cli_write_text(cli_in_dir("furnished.jsonl"), text);
    assert_int_equal(
        cli_run(lum_cmd_measure, "measure --scene @furnished.jsonl --spacing 1 --error 0.1 --json @f.json"),
        LUM_EXIT_OK);
    char *json = cli_read_text(cli_in_dir("f.json"));
    cJSON *o = lum_json_parse(json, strlen(json), NULL);
    const cJSON *p;
    free(json);
    assert_int_equal(cli_member(o, "left_out")->valueint, 3);
    assert_true(cli_member(o, "emin_lx")->valuedouble > 1.0);
    cJSON_ArrayForEach(p, cli_member(o, "points"))
    {
        const cJSON *at = cli_member(p, "point"), *why = cJSON_GetObjectItem(p, "left_out");
        double x = cJSON_GetArrayItem(at, 0)->valuedouble, z = cJSON_GetArrayItem(at, 2)->valuedouble;
        const char *wanted = x < -1.5 && z < -1.5                         ? "inside"
                             : fabs(x - 1.0) < 0.1 && fabs(z - 1.0) < 0.1 ? "inside"
                             : x < -1.5 && z > 1.5                        ? "covered"
                                                                          : "";
        if (strcmp(why ? why->valuestring : "", wanted) != 0)
            fail_msg("the point at %g, %g: '%s', not '%s'", x, z, why ? why->valuestring : "", wanted);
    }
    cJSON_Delete(o);
}

/* The scene's own sensors are measured, each with its target; an option that names a place asks for a grid instead. */
static void sensors_of_the_scene_are_measured(void **state)
{
    (void)state;
    char text[sizeof room + 512];
    snprintf(
        text, sizeof text,
        "%s{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"a\",\"kind\":\"grid\",\"position\":[0,0.75,0],\"u\":[4,0,0],"
        "\"v\":[0,0,3],\"spacing_m\":1,\"target_lx\":100}\n"
        "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"b\",\"kind\":\"observer\",\"position\":[1,1.2,1]}\n",
        room);
    cli_write_text(cli_in_dir("sensors.jsonl"), text);
    assert_int_equal(cli_run(lum_cmd_measure, "measure --scene @sensors.jsonl --json @s.json --csv @s.csv"),
                     LUM_EXIT_OK);
    char *json = cli_read_text(cli_in_dir("s.json")), *csv = cli_read_text(cli_in_dir("s.csv"));
    cJSON *o = lum_json_parse(json, strlen(json), NULL), *alike = measure("--spacing 1", LUM_EXIT_OK);
    const cJSON *sensors = cli_member(o, "sensors"), *a = cJSON_GetArrayItem(sensors, 0),
                *b = cJSON_GetArrayItem(sensors, 1);
    assert_string_equal(cli_member(a, "id")->valuestring, "a");
    assert_true(fabs(cli_member(a, "em_lx")->valuedouble / cli_member(alike, "em_lx")->valuedouble - 1.0) < 1e-6);
    assert_true(cJSON_IsTrue(cli_member(cli_member(cli_member(a, "targets"), "em"), "passes")));
    assert_int_equal(cli_member(b, "lamps_without_extent")->valueint, 1);
    assert_true(cJSON_IsNull(cli_member(b, "ugr"))); /* nothing glares */
    assert_true(strncmp(csv, "sensor,quantity,x_m,y_m,z_m,value,stderr\na,plane,-1.5,0.75,-1,", 62) == 0);
    assert_non_null(strstr(csv, "\nb,ugr,1,1.2,1,,\nb,dgp,1,1.2,1,0."));
    assert_string_equal(cli_member(b, "dgp_band")->valuestring, "imperceptible");
    assert_true(cJSON_IsFalse(cli_member(b, "dgp_in_range")));
    assert_int_equal(cli_run(lum_cmd_measure, "measure --scene @sensors.jsonl --spacing 1 --target 1000"),
                     LUM_EXIT_FAILED);
    cJSON_Delete(alike);
    cJSON_Delete(o);
    free(json);
    free(csv);
}

static uint32_t count(const char *text, const char *what)
{
    uint32_t n = 0;
    for (const char *at = text; (at = strstr(at, what)); at += strlen(what))
        n++;
    return n;
}

/* The page has each sensor by its name, as text; each of its points; a lamp of 100 cd everywhere by what its light and
 * power come to, 400 pi lm and 10 W, with the like of it in one row; and pictures if they are wanted. */
static void a_page_has_it_all(void **state)
{
    (void)state;
    char text[sizeof room + 1536];
    int n = snprintf(
        text, sizeof text,
        "%s{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"a\",\"kind\":\"grid\",\"position\":[0,0.75,0],\"u\":[4,0,0],"
        "\"v\":[0,0,3],\"spacing_m\":1,\"target_lx\":100000,\"name\":\"<script>&\"}\n",
        room);
    for (int i = 0; i < 2; i++)
        n += snprintf(text + n, sizeof text - (size_t)n,
                      "{\"op\":\"add\",\"type\":\"light\",\"id\":\"ball-%d\",\"kind\":\"ies\",\"position\":[%d,2,0],"
                      "\"on\":%s,\"web\":{\"name\":\"Ball\",\"c_deg\":[0],\"gamma_deg\":[0,180],"
                      "\"candela\":[100,100],\"watts\":10}}\n",
                      i, i, i ? "false" : "true");
    cli_write_text(cli_in_dir("page.jsonl"), text);
    assert_int_equal(cli_run(lum_cmd_measure, "measure --scene @page.jsonl --html @p.html --pictures 0"),
                     LUM_EXIT_FAILED); /* the target is missed */
    char *page = cli_read_text(cli_in_dir("p.html"));
    assert_non_null(strstr(page, "<td>&lt;script&gt;&amp;<td>horizontal<td"));
    assert_null(strstr(page, "<script"));
    assert_int_equal(count(page, "<rect "), 4 * 3);
    assert_non_null(strstr(page, "class=\"misses\">E<sub>m</sub> &ge; 100000: missed<"));
    assert_non_null(strstr(page,
                           "<td>Ball<td>ball-0 and others<td class=\"n\">2<td class=\"n\">1<td class=\"n\">1257<td "
                           "class=\"n\">10<td class=\"n\">126</tr>"));
    assert_non_null(strstr(page, "<td class=\"n\">2<td class=\"n\">13823 lm<td class=\"n\">10 W*<")); /* 4400 pi */
    assert_non_null(strstr(page, "<p>* Without 1 whose power is not known: point (bulb)</p>"));
    assert_non_null(strstr(page, ", 12 m<sup>2</sup>: 0.833 W/m<sup>2</sup>*, or "));
    assert_int_equal(count(page, "data:image/png"), 0);
    free(page);
    (void)cli_run(lum_cmd_measure, "measure --scene @page.jsonl --html @p.html --pictures 1 --error 0.5");
    page = cli_read_text(cli_in_dir("p.html"));
    assert_int_equal(count(page, "data:image/png"), 2);
    free(page);
}

/* Ez over E of the same grid, each as it is measured alone; a row of CSV for each, which says of what; on the page. */
static void modelling_is_told(void **state)
{
    (void)state;
    cJSON *o = measure("--spacing 2 --modelling --csv @c.csv --html @c.html --pictures 0", LUM_EXIT_OK),
          *alone = measure("--spacing 2 --height 0.75 --cylindrical", LUM_EXIT_OK);
    char *csv = cli_read_text(cli_in_dir("c.csv")), *page = cli_read_text(cli_in_dir("c.html"));
    double ez = cli_member(o, "ez_lx")->valuedouble, em = cli_member(o, "em_lx")->valuedouble;
    assert_string_equal(cli_member(o, "quantity")->valuestring, "modelling");
    assert_true(fabs(ez - cli_member(alone, "em_lx")->valuedouble) <
                5.0 *
                    hypot(cli_member(o, "ez_stderr_lx")->valuedouble, cli_member(alone, "em_stderr_lx")->valuedouble));
    assert_true(fabs(cli_member(o, "modelling")->valuedouble / (ez / em) - 1.0) < 1e-9);
    assert_true(cJSON_IsFalse(cli_member(o, "modelling_in_range"))); /* one bulb: faces are dark */
    assert_true(cli_member(cJSON_GetArrayItem(cli_member(o, "points"), 0), "ez_lx")->valuedouble > 0.0);
    assert_true(strncmp(csv, "quantity,x_m,y_m,z_m,lx,stderr_lx\nplane,", 40) == 0);
    assert_int_equal(count(csv, "\ncylindrical,"), 2 * 2);
    assert_non_null(strstr(page, "modelling E<sub>z</sub> / E<sub>m</sub> = 0."));
    cJSON_Delete(o);
    cJSON_Delete(alone);
    free(csv);
    free(page);
}

/* A black floor and a window's worth of sky: 1 x 1 m that shine with 8000 cd/m2, 2 m before the eye. DGP of the page,
 * of JSON and of CSV is that of Ev and of L^2 w / p^2 by hand: w = 4 atan(0.25 / (2 sqrt(4.5))) = 0.2356, p within 1 of
 * 1 to 1.7 over its 14 degrees to either side: the sum lies between those. */
static void glare_by_day_is_told(void **state)
{
    (void)state;
    cli_write_text(cli_in_dir("day.jsonl"),
                   "{\"lumend\":1,\"kind\":\"scene\"}\n"
                   "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"sheet\",\"shape\":\"quad\",\"size\":[8,0,8]}\n"
                   "{\"op\":\"add\",\"type\":\"material\",\"id\":\"black\",\"base_color\":[0,0,0],\"specular\":0}\n"
                   "{\"op\":\"add\",\"type\":\"object\",\"id\":\"ground\",\"mesh\":\"sheet\",\"material\":\"black\"}\n"
                   "{\"op\":\"add\",\"type\":\"light\",\"id\":\"window\",\"kind\":\"quad\",\"position\":[0,1.2,-2],"
                   "\"u\":[1,0,0],\"v\":[0,1,0],\"luminance_cd_m2\":8000}\n"
                   "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"eye\",\"kind\":\"observer\",\"position\":[0,1.2,0],"
                   "\"target_dgp\":0.3}\n"
                   "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"side\",\"kind\":\"observer\",\"position\":[0,1.2,0],"
                   "\"direction\":[1,0,0.5]}\n");
    assert_int_equal(cli_run(lum_cmd_measure, "measure --scene @day.jsonl --json @d.json --csv @d.csv --html @d.html "
                                              "--pictures 0"),
                     LUM_EXIT_FAILED); /* the target is missed */
    char *json = cli_read_text(cli_in_dir("d.json")), *csv = cli_read_text(cli_in_dir("d.csv")),
         *page = cli_read_text(cli_in_dir("d.html"));
    cJSON *o = lum_json_parse(json, strlen(json), NULL);
    const cJSON *eye = cJSON_GetArrayItem(cli_member(o, "sensors"), 0),
                *target = cli_member(cli_member(eye, "targets"), "dgp");
    double lx = cli_member(eye, "eye_lx")->valuedouble, dgp = cli_member(eye, "dgp")->valuedouble,
           most = 8000.0 * 8000.0 * 0.2356, per = pow(lx, -1.87), least = most / (1.7 * 1.7);
    assert_true(dgp < 5.87e-5 * lx + 0.159 + 0.092 * log10(1.0 + most * per) + 1e-3);
    assert_true(dgp > 5.87e-5 * lx + 0.159 + 0.092 * log10(1.0 + least * per) - 1e-3);
    assert_string_equal(cli_member(eye, "dgp_band")->valuestring, "perceptible");
    assert_int_equal(cli_member(eye, "dgp_sources")->valueint, 1);
    assert_true(cJSON_IsTrue(cli_member(eye, "dgp_in_range")));
    assert_true(cJSON_IsFalse(cli_member(target, "passes")) && cJSON_IsTrue(cli_member(target, "sure")));
    assert_non_null(strstr(csv, "\neye,dgp,0,1.2,0,0.3"));
    assert_string_equal(cli_member(o, "worst_dgp")->valuestring, "eye"); /* the other turns its back to the window */
    assert_null(cJSON_GetObjectItem(o, "worst_ugr"));                    /* there is no background: none is known */
    assert_non_null(strstr(page, "<p>Worst DGP of 2 observers: 0.3"));
    assert_non_null(strstr(page, "<br>perceptible<td>"));
    assert_non_null(strstr(page, "DGP &le; 0.3: missed<"));
    cJSON_Delete(o);
    free(json);
    free(csv);
    free(page);
}

/* Of an eye in a white box that looks in four directions UGR is that of an observer who looks at the lamp: in words,
 * CSV, JSON and on the page, as a sensor and by options. */
static void eyes_are_told(void **state)
{
    (void)state;
    cli_write_text(
        cli_in_dir("eyes.jsonl"),
        "{\"lumend\":1,\"kind\":\"scene\"}\n"
        "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"sheet\",\"shape\":\"quad\",\"size\":[8,0,8]}\n"
        "{\"op\":\"add\",\"type\":\"material\",\"id\":\"white\",\"base_color\":[0.8,0.8,0.8],\"specular\":0}\n"
        "{\"op\":\"add\",\"type\":\"object\",\"id\":\"ground\",\"mesh\":\"sheet\",\"material\":\"white\"}\n"
        "{\"op\":\"add\",\"type\":\"light\",\"id\":\"panel\",\"kind\":\"quad\",\"position\":[0,2,-3],"
        "\"u\":[1,0,0],\"v\":[0,0.5,0.5],\"luminance_cd_m2\":3000}\n"
        "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"all\",\"kind\":\"grid\",\"quantity\":\"ugr\",\"position\":"
        "[0,1.2,0],\"u\":[2,0,0],\"v\":[0,0,2],\"spacing_m\":1,\"directions\":4,\"target_ugr\":5}\n"
        "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"eye\",\"kind\":\"observer\",\"position\":[0.5,1.2,0.5]}\n"
        "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"row\",\"kind\":\"line\",\"quantity\":\"ugr\",\"position\":"
        "[0,1.2,0],\"u\":[0,0,2],\"spacing_m\":1,\"direction\":[0,0,-1]}\n");
    assert_int_equal(cli_run(lum_cmd_measure, "measure --scene @eyes.jsonl --json @e.json --csv @e.csv --html @e.html "
                                              "--pictures 0"),
                     LUM_EXIT_FAILED); /* the target is missed */
    char *json = cli_read_text(cli_in_dir("e.json")), *csv = cli_read_text(cli_in_dir("e.csv")),
         *page = cli_read_text(cli_in_dir("e.html"));
    cJSON *o = lum_json_parse(json, strlen(json), NULL);
    const cJSON *all = cJSON_GetArrayItem(cli_member(o, "sensors"), 0),
                *eye = cJSON_GetArrayItem(cli_member(o, "sensors"), 1);
    double want = cli_member(eye, "ugr")->valuedouble, worst = -1e9;
    for (int i = 0; i < 4; i++) { /* x -.5 and .5, z -.5, then .5 */
        const cJSON *p = cJSON_GetArrayItem(cli_member(all, "points"), i);
        double ugr = cli_member(p, "ugr")->valuedouble;
        worst = fmax(worst, ugr);
        if (i == 3 && !(fabs(ugr - want) < 0.7)) /* four standard errors of .14, and of the observer's */
            fail_msg("UGR %g of the grid, %g of an observer there", ugr, want);
    }
    assert_true(cli_member(all, "ugr")->valuedouble == worst);
    assert_int_equal(cli_member(all, "directions")->valueint, 4);
    assert_true(fabs(cJSON_GetArrayItem(cli_member(all, "worst_direction"), 2)->valuedouble + 1.0) < 1e-6);
    assert_true(cJSON_IsFalse(cli_member(cli_member(cli_member(all, "targets"), "ugr"), "passes")));
    assert_null(cJSON_GetObjectItem(all, "em_lx"));
    assert_int_equal(count(csv, "all,ugr,"), 4);
    assert_int_equal(count(csv, "eye,ugr,"), 1);
    assert_int_equal(count(page, "</title></rect>"), 6);
    assert_non_null(strstr(page, "aria-label=\"UGR of each point\""));
    assert_non_null(strstr(page, "below 19</span>"));
    assert_non_null(strstr(page, "Worst UGR of 3 observers"));
    assert_non_null(strstr(page, "<path d=\"M1.2 30.0L")); /* of a row along z, in cells of 60: back along it */
    cJSON_Delete(o);
    free(json);
    free(csv);
    free(page);
    assert_int_equal(cli_run(lum_cmd_measure,
                             "measure --scene @eyes.jsonl --ugr --directions 2 --area -1,-1,1,1 --spacing 2 "
                             "--most-ugr 40 --csv @f.csv"),
                     LUM_EXIT_OK);
    csv = cli_read_text(cli_in_dir("f.csv"));
    assert_true(strncmp(csv, "quantity,x_m,y_m,z_m,value,stderr\nugr,", 38) == 0);
    assert_int_equal(count(csv, "\n"), 2);
    free(csv);
}

/* 10 W over the floor of 5 x 4 m, which is more than the grid within its border covers; the bulb of the room does not
 * say what it takes, and where it is alone nothing is known. A table's grid is no room beside a larger one. */
static void power_is_that_of_the_floor(void **state)
{
    (void)state;
    char text[sizeof room + 1024];
    cJSON *o = measure("--spacing 2", LUM_EXIT_OK);
    const cJSON *power = cli_member(o, "power");
    assert_true(cJSON_IsNull(cli_member(power, "w_per_m2")));
    assert_int_equal(cli_member(power, "lamps_without_watts")->valueint, 1);
    cJSON_Delete(o);
    snprintf(text, sizeof text,
             "%s{\"op\":\"add\",\"type\":\"light\",\"id\":\"ball\",\"kind\":\"ies\",\"position\":[0,2,0],"
             "\"web\":{\"c_deg\":[0],\"gamma_deg\":[0,180],\"candela\":[100,100],\"watts\":10}}\n"
             "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"room\",\"kind\":\"grid\",\"position\":[0,0.75,0],"
             "\"u\":[4,0,0],\"v\":[0,0,3],\"spacing_m\":2,\"floor_m2\":20}\n"
             "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"table\",\"kind\":\"grid\",\"position\":[0,0.75,0],"
             "\"u\":[1,0,0],\"v\":[0,0,1],\"spacing_m\":1}\n",
             room);
    cli_write_text(cli_in_dir("power.jsonl"), text);
    assert_int_equal(cli_run(lum_cmd_measure, "measure --scene @power.jsonl --json @w.json"), LUM_EXIT_OK);
    char *json = cli_read_text(cli_in_dir("w.json"));
    o = lum_json_parse(json, strlen(json), NULL);
    const cJSON *a = cJSON_GetArrayItem(cli_member(o, "sensors"), 0), *b = a->next;
    const cJSON *whole = cJSON_GetObjectItem(a, "power") ? a : b;
    assert_string_equal(cli_member(whole, "id")->valuestring, "room");
    assert_null(cJSON_GetObjectItem(whole == a ? b : a, "power"));
    power = cli_member(whole, "power");
    assert_true(fabs(cli_member(power, "w_per_m2")->valuedouble - 0.5) < 1e-12);
    assert_true(fabs(cli_member(power, "w_per_m2_100_lx")->valuedouble * cli_member(whole, "em_lx")->valuedouble -
                     50.0) < 1e-9);
    assert_int_equal(cli_member(power, "lamps")->valueint, 2);
    const cJSON *unknown = cJSON_GetArrayItem(cli_member(power, "without_watts"), 0);
    assert_string_equal(cli_member(unknown, "id")->valuestring, "bulb");
    assert_string_equal(cli_member(unknown, "what")->valuestring, "point");
    cJSON_Delete(o);
    free(json);
}

/* Sensors inside the floor and far away have no value, and say so; their neighbour is measured all the same. What is
 * not known is missed, and not for sure. */
static void a_sensor_in_a_wall_keeps_no_other_from_its_value(void **state)
{
    (void)state;
    char text[sizeof room + 512];
    snprintf(text, sizeof text,
             "%s{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"a\",\"kind\":\"point\",\"position\":[0,-0.1,0],"
             "\"target_lx\":100}\n"
             "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"b\",\"kind\":\"point\",\"position\":[0,1,0]}\n"
             "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"eye\",\"kind\":\"observer\",\"position\":[1e9,0,0],\"target_"
             "ugr\":19}\n",
             room);
    cli_write_text(cli_in_dir("walled.jsonl"), text);
    assert_int_equal(cli_run(lum_cmd_measure, "measure --scene @walled.jsonl --json @w.json"), LUM_EXIT_FAILED);
    char *json = cli_read_text(cli_in_dir("w.json"));
    cJSON *o = lum_json_parse(json, strlen(json), NULL);
    const cJSON *a = cJSON_GetArrayItem(cli_member(o, "sensors"), 0), *b = a->next, *eye = b->next,
                *em = cli_member(cli_member(a, "targets"), "em");
    assert_true(cJSON_IsNull(cli_member(a, "em_lx")));
    assert_int_equal(cli_member(a, "left_out")->valueint, 1);
    assert_true(cJSON_IsFalse(cli_member(em, "passes")) && cJSON_IsFalse(cli_member(em, "sure")));
    assert_true(fabs(cli_member(b, "em_lx")->valuedouble - 250.0) < 0.01);
    assert_true(cJSON_IsNull(cli_member(eye, "ugr")));
    em = cli_member(cli_member(eye, "targets"), "ugr");
    assert_true(cJSON_IsFalse(cli_member(em, "passes")) && cJSON_IsFalse(cli_member(em, "sure")));
    cJSON_Delete(o);
    free(json);
}

static void what_cannot_be_measured_is_refused(void **state)
{
    (void)state;
    static const struct {
        const char *options;
        int status;
    } cases[] = {
        {"--on nothing", LUM_EXIT_FAILED},
        {"--cylindrical --modelling", LUM_EXIT_USAGE},
        {"--border 3", LUM_EXIT_FAILED},
        {"--spacing 1e-9", LUM_EXIT_FAILED},
        {"--area 1,1,0,2", LUM_EXIT_USAGE},
        {"--area 0,0,1", LUM_EXIT_USAGE},
        {"--area 0,0,nan,1", LUM_EXIT_USAGE},
        {"--on floor --area 0,0,1,1", LUM_EXIT_USAGE},
        {"--error 0", LUM_EXIT_USAGE},
        {"--area 1e9,0,1e9,1", LUM_EXIT_USAGE},
        {"--area 1e9,0,2e9,1e9 --spacing 1e9", LUM_EXIT_FAILED},
        {"--area 3,0,4,1", LUM_EXIT_FAILED},
        {"--csv @no/such.csv", LUM_EXIT_FAILED},
        {"--ugr --target 500", LUM_EXIT_USAGE},
        {"--most-ugr 19", LUM_EXIT_USAGE},
        {"--directions 4", LUM_EXIT_USAGE},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char line[256];
        cli_write_text(cli_in_dir("room.jsonl"), room);
        snprintf(line, sizeof line, "measure --scene @room.jsonl %s", cases[i].options);
        if (cli_run(lum_cmd_measure, line) != cases[i].status)
            fail_msg("%s was not refused with %d", cases[i].options, cases[i].status);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bulb_has_its_closed_form),
        cmocka_unit_test(points_are_as_dense_as_the_standard_asks),
        cmocka_unit_test(a_target_that_is_missed_fails),
        cmocka_unit_test(a_table_has_each_point),
        cmocka_unit_test(points_inside_furniture_are_left_out),
        cmocka_unit_test(sensors_of_the_scene_are_measured),
        cmocka_unit_test(modelling_is_told),
        cmocka_unit_test(power_is_that_of_the_floor),
        cmocka_unit_test(glare_by_day_is_told),
        cmocka_unit_test(eyes_are_told),
        cmocka_unit_test(a_page_has_it_all),
        cmocka_unit_test(a_sensor_in_a_wall_keeps_no_other_from_its_value),
        cmocka_unit_test(what_cannot_be_measured_is_refused),
    };
    return cmocka_run_group_tests(tests, cli_make_dir, cli_remove_dir);
}
