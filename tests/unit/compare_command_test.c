/* lumend compare as a user calls it, in process. */
#include <fcntl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/cli/commands.h"
#include "server/stream/png.h"
#include "tests/unit/cli_kit.h"
#include "tests/unit/metric_golden.h"

static void write_exr(const char *name, float value)
{
    float pixels[4 * 4 * 3];
    for (size_t i = 0; i < LUM_ARRAY_LEN(pixels); i++)
        pixels[i] = value;
    struct lum_exr_channel c[3] = {{"R", pixels, 3, false}, {"G", pixels + 1, 3, false}, {"B", pixels + 2, 3, false}};
    assert_int_equal(lum_exr_write(cli_in_dir(name), 4, 4, c, 3, NULL, 0, NULL), LUM_OK);
}

/* Runs compare with stdout in a file. */
static cJSON *compare(const char *line, int *ret_status)
{
    fflush(stdout);
    int saved = dup(STDOUT_FILENO), out = open(cli_in_dir("stdout"), O_CREAT | O_TRUNC | O_RDWR, 0600);
    dup2(out, STDOUT_FILENO);
    *ret_status = cli_run(lum_cmd_compare, line);
    fflush(stdout);
    dup2(saved, STDOUT_FILENO);
    close(out);
    close(saved);
    if (*ret_status)
        return NULL;
    char *text = cli_read_text(cli_in_dir("stdout"));
    cJSON *o = cJSON_Parse(text);
    free(text);
    return o;
}

/* x = 1.125 r with r = 1024, both exact: relMSE = 128^2 / (1024^2 + 0.01) = 1/64 to 1e-8. */
static void compare_gives_closed_forms(void **state)
{
    (void)state;
    int status;
    write_exr("r.exr", 1024.0f);
    write_exr("x.exr", 1152.0f);
    cJSON *o = compare("compare @x.exr @r.exr --heatmap @heat.png", &status);
    assert_int_equal(status, LUM_EXIT_OK);
    assert_true(fabs(cli_member(o, "relmse")->valuedouble - 1.0 / 64.0) < 1e-8);
    assert_true(fabs(cli_member(o, "rmse")->valuedouble - 128.0) < 1e-9);
    assert_true(fabs(cli_member(o, "smape")->valuedouble - 128.0 / (2176.0 + 0.01)) < 1e-12);
    assert_int_equal(access(cli_in_dir("heat.png"), R_OK), 0);
    cJSON_Delete(o);
    o = compare("compare @x.exr @r.exr --metric rmse", &status);
    assert_null(cJSON_GetObjectItem(o, "relmse"));
    cli_member(o, "rmse");
    cJSON_Delete(o);
    compare("compare @x.exr", &status);
    assert_int_equal(status, LUM_EXIT_USAGE);
    compare("compare @x.exr @r.exr --metric flap", &status);
    assert_int_equal(status, LUM_EXIT_USAGE);
    compare("compare @x.exr @r.exr --multiplier 0", &status);
    assert_int_equal(status, LUM_EXIT_USAGE);
    compare("compare @x.exr @none.exr", &status);
    assert_int_equal(status, LUM_EXIT_FAILED);
}

static double number(const cJSON *o, const char *metric, const char *member)
{
    return cli_member(cli_member(o, metric), member)->valuedouble;
}

static void assert_near(const char *what, double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s: %.9g is not %.9g within %g", what, value, expected, tolerance);
}

/* a and b: golden pictures. */
static cJSON *compare_golden(const char *a, const char *b, const char *options, int *ret_status)
{
    char line[2048];
    snprintf(line, sizeof line, "compare %s/%s %s/%s %s", METRIC_GOLDEN, a, METRIC_GOLDEN, b, options);
    return compare(line, ret_status);
}

/* That the figures are right is for the tests of the metrics; here, that they reach the user. */
static void golden_values_by_command(void **state)
{
    (void)state;
    int status;
    for (size_t i = 0; i < LUM_ARRAY_LEN(golden_flip); i++) {
        cJSON *o = compare_golden(golden_flip[i].x, golden_flip[i].r, "--metric flip", &status);
        assert_int_equal(status, LUM_EXIT_OK);
        assert_near("flip", number(o, "flip", "mean"), golden_flip[i].mean, 0.0005);
        assert_null(cJSON_GetObjectItem(o, "hdrflip"));
        cJSON_Delete(o);
    }
    cJSON *o = compare_golden("box_16.exr", "box_400.exr", "--metric hdrvdp,flip,hdrflip", &status);
    assert_int_equal(status, LUM_EXIT_OK);
    assert_near("hdrflip", number(o, "hdrflip", "mean"), 0.093032, 0.0005);
    assert_near("exposures", number(o, "hdrflip", "exposures"), 3, 0);
    assert_near("hdrvdp 75", number(o, "hdrvdp", "p75_percent"), 5.385, 1.0);
    assert_near("hdrvdp 95", number(o, "hdrvdp", "p95_percent"), 1.484, 1.0);
    assert_true(number(o, "flip", "mean") > 0.0);
    cJSON_Delete(o);
}

/* A hundred times brighter, the eye sees more. */
static void options_of_the_eye(void **state)
{
    (void)state;
    int status;
    cJSON *dim = compare_golden("box_16.exr", "box_400.exr", "--metric hdrvdp,hdrflip", &status);
    cJSON *bright = compare_golden("box_16.exr", "box_400.exr", "--metric hdrvdp --multiplier 100", &status);
    cJSON *near = compare_golden("box_16.exr", "box_400.exr", "--metric hdrflip --pixels-per-degree 20", &status);
    assert_true(number(bright, "hdrvdp", "mean_p") > 2.0 * number(dim, "hdrvdp", "mean_p"));
    assert_near("mean", number(bright, "hdrvdp", "mean_cd_m2"), 100.0 * number(dim, "hdrvdp", "mean_cd_m2"), 1e-3);
    assert_near("near", number(near, "hdrflip", "pixels_per_degree"), 20.0, 0.0);
    assert_true(number(near, "hdrflip", "mean") > number(dim, "hdrflip", "mean")); /* noise is seen larger */
    cJSON_Delete(dim);
    cJSON_Delete(bright);
    cJSON_Delete(near);
}

static void what_is_no_light_is_refused(void **state)
{
    (void)state;
    int status;
    compare_golden("box_16.png", "box_400.exr", "", &status);
    assert_int_equal(status, LUM_EXIT_FAILED);
    compare_golden("box_16.png", "box_400.png", "--metric hdrvdp", &status);
    assert_int_equal(status, LUM_EXIT_FAILED);
    cli_write_text(cli_in_dir("none.png"), "\x89PNG and no more");
    compare("compare @none.png @none.png --metric flip", &status);
    assert_int_equal(status, LUM_EXIT_FAILED);
}

/* Counted where a value stands for itself, refused where a pixel counts for its neighbours. */
static void not_finite(void **state)
{
    (void)state;
    int status;
    write_exr("r.exr", 2.0f);
    write_exr("nan.exr", NAN);
    cJSON *o = compare("compare @nan.exr @r.exr --heatmap @heat.png", &status);
    assert_int_equal(status, LUM_EXIT_OK);
    assert_int_equal(cli_member(o, "nonfinite")->valuedouble, 4 * 4 * 3);
    cJSON_Delete(o);
    struct lum_png_image map;
    assert_int_equal(lum_png_read(cli_in_dir("heat.png"), 4, &map, NULL), LUM_OK);
    for (int i = 0; i < 4 * 4; i++)
        assert_memory_equal(map.rgb + 3 * i, ((uint8_t[]){0, 255, 255}), 3);
    lum_free(map.rgb);
    for (int i = 0; i < 3; i++) {
        char line[128];
        snprintf(line, sizeof line, "compare @nan.exr @r.exr --metric %s",
                 (const char *[]){"flip", "hdrflip", "hdrvdp"}[i]);
        compare(line, &status);
        assert_int_equal(status, LUM_EXIT_FAILED);
    }
}

static void heat_map_of_the_first_metric(void **state)
{
    (void)state;
    int status;
    struct lum_png_image maps[2];
    char options[256];
    for (int i = 0; i < 2; i++) {
        snprintf(options, sizeof options, "--metric %s --heatmap %s", (const char *[]){"rmse,flip", "flip,rmse"}[i],
                 cli_in_dir("heat.png"));
        cJSON_Delete(compare_golden("box_16.png", "box_400.png", options, &status));
        assert_int_equal(status, LUM_EXIT_OK);
        assert_int_equal(lum_png_read(cli_in_dir("heat.png"), 240, &maps[i], NULL), LUM_OK);
        assert_true(maps[i].w == GOLDEN_W && maps[i].h == GOLDEN_H);
    }
    assert_memory_not_equal(maps[0].rgb, maps[1].rgb, (size_t)3 * GOLDEN_N);
    lum_free(maps[0].rgb);
    lum_free(maps[1].rgb);
}

static int count(const char *text, const char *word)
{
    int n = 0;
    while ((text = strstr(text, word))) {
        n++;
        text += strlen(word);
    }
    return n;
}

/* One file: nothing in it is fetched, and a file's name is no markup. */
static void page_is_whole(void **state)
{
    (void)state;
    int status;
    write_exr("r.exr", 2.0f);
    write_exr("<b>&.exr", 2.5f);
    cJSON_Delete(
        compare("compare @<b>&.exr @r.exr --metric relmse,flip,hdrflip,hdrvdp,blocks --html @page.html", &status));
    assert_int_equal(status, LUM_EXIT_OK);
    char *page = cli_read_text(cli_in_dir("page.html"));
    assert_int_equal(count(page, "src=\"data:image/png;base64,"), 2 + 4);
    assert_int_equal(count(page, "http"), 0);
    assert_int_equal(count(page, "<b>"), 0);
    assert_true(count(page, "/&lt;b&gt;&amp;.exr") >= 2);
    assert_int_equal(count(page, "<tr>"), 1 + 4 + 1 + 3); /* the head; hdrvdp has two rows and blocks three */
    assert_non_null(strstr(page, "</script>\n"));
    free(page);
    compare("compare @r.exr @r.exr --html @none/page.html", &status);
    assert_int_equal(status, LUM_EXIT_FAILED);
}

/* Memory that is short anywhere ends the command with a message and no more, until there is enough. */
static void short_of_memory(void **state)
{
    (void)state;
    int status = LUM_EXIT_FAILED;
    uint64_t n = 0;
    write_exr("r.exr", 2.0f);
    write_exr("x.exr", 2.5f);
    while (status != LUM_EXIT_OK) {
        lum_alloc_fail_after(++n);
        cJSON_Delete(
            compare("compare @x.exr @r.exr --metric flip,hdrflip,hdrvdp --heatmap @h.png --html @p.html", &status));
        assert_true(status == LUM_EXIT_OK || status == LUM_EXIT_FAILED);
    }
    lum_alloc_fail_after(0);
    assert_true(n > 10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(compare_gives_closed_forms),
        cmocka_unit_test(golden_values_by_command),
        cmocka_unit_test(options_of_the_eye),
        cmocka_unit_test(what_is_no_light_is_refused),
        cmocka_unit_test(not_finite),
        cmocka_unit_test(heat_map_of_the_first_metric),
        cmocka_unit_test(page_is_whole),
        cmocka_unit_test(short_of_memory),
    };
    return cmocka_run_group_tests(tests, cli_make_dir, cli_remove_dir);
}
