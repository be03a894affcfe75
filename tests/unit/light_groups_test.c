/* The light of each group in a layer of its own: lumend render --light-groups. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/json/json.h"
#include "server/cli/commands.h"
#include "tests/unit/cli_kit.h"

/* Whitted takes the same shadow samples whatever the other lights do, so that the sum of the groups is the whole up to
 * the rounding of a sum of floats: some ulps. */
static void light_groups_sum_to_the_whole(void **state)
{
    (void)state;
    assert_int_equal(cli_run(lum_cmd_render, "render --scene cornell --method whitted --size 40x30 --out @whole.exr"),
                     LUM_EXIT_OK);
    assert_int_equal(
        cli_run(lum_cmd_render, "render --scene cornell --method whitted --size 40x30 --light-groups --out @sum.exr"),
        LUM_EXIT_OK);
    struct lum_exr_image whole = cli_read_exr("whole.exr"), sum = cli_read_exr("sum.exr");
    const float *w = cli_channel(&whole, "G"), *s = cli_channel(&sum, "G"), *ceiling = cli_channel(&sum, "ceiling.G"),
                *globe = cli_channel(&sum, "globe.G");
    bool lit[2] = {false, false};
    for (size_t i = 0; i < 40 * 30; i++) {
        if (!(fabsf(w[i] - s[i]) <= 1e-5f * w[i]))
            fail_msg("pixel %zu: %.9g whole, %.9g summed", i, (double)w[i], (double)s[i]);
        assert_true(fabsf(ceiling[i] + globe[i] - s[i]) <= 1e-6f * s[i]);
        lit[0] = lit[0] || ceiling[i] > 0.0f;
        lit[1] = lit[1] || globe[i] > 0.0f;
    }
    assert_true(lit[0] && lit[1]);
    lum_exr_finish(&whole);
    lum_exr_finish(&sum);
}

/* Objects that shine are in the groups that they name, or their own; the dark one has a layer, too. */
static void surfaces_that_shine_have_groups(void **state)
{
    (void)state;
    cli_write_text(cli_in_dir("panels.jsonl"),
                   "{\"lumend\":1,\"kind\":\"scene\"}\n"
                   "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"sheet\",\"shape\":\"quad\",\"size\":[1,0,1]}\n"
                   "{\"op\":\"add\",\"type\":\"material\",\"id\":\"white\"}\n"
                   "{\"op\":\"add\",\"type\":\"material\",\"id\":\"glow\",\"emission_cd_m2\":100}\n"
                   "{\"op\":\"add\",\"type\":\"object\",\"id\":\"floor\",\"mesh\":\"sheet\",\"material\":\"white\"}\n"
                   "{\"op\":\"add\",\"type\":\"object\",\"id\":\"a\",\"mesh\":\"sheet\",\"material\":\"glow\","
                   "\"transform\":{\"translate\":[-1,1,0]}}\n"
                   "{\"op\":\"add\",\"type\":\"object\",\"id\":\"b\",\"mesh\":\"sheet\",\"material\":\"glow\","
                   "\"transform\":{\"translate\":[1,1,0]},\"group\":\"side\"}\n"
                   "{\"op\":\"add\",\"type\":\"object\",\"id\":\"c\",\"mesh\":\"sheet\",\"material\":\"white\","
                   "\"transform\":{\"translate\":[0,1,-1]},\"flux_lm\":100,\"group\":\"side\"}\n"
                   "{\"op\":\"add\",\"type\":\"object\",\"id\":\"d\",\"mesh\":\"sheet\",\"material\":\"glow\","
                   "\"transform\":{\"translate\":[0,1,1]},\"on\":false}\n"
                   "{\"op\":\"add\",\"type\":\"camera\",\"id\":\"main\",\"position\":[0,0.7,2],\"target\":[0,0,0]}\n");
    assert_int_equal(cli_run(lum_cmd_render,
                             "render --scene @panels.jsonl --method whitted --size 40x30 --light-groups --out @p.exr"),
                     LUM_EXIT_OK);
    struct lum_exr_image sum = cli_read_exr("p.exr");
    const float *s = cli_channel(&sum, "G"), *a = cli_channel(&sum, "a.G"), *side = cli_channel(&sum, "side.G"),
                *d = cli_channel(&sum, "d.G");
    bool lit[2] = {false, false};
    for (size_t i = 0; i < 40 * 30; i++) {
        assert_true(d[i] == 0.0f && fabsf(a[i] + side[i] - s[i]) <= 1e-6f * s[i]);
        lit[0] = lit[0] || a[i] > 0.0f;
        lit[1] = lit[1] || side[i] > 0.0f;
    }
    assert_true(lit[0] && lit[1]);
    lum_exr_finish(&sum);
}

/* The same where indirect light comes from virtual point lights and caches, which a group alone shares out otherwise:
 * the beauty is the sum of the layers all the same. Their mean is that of the whole up to the error of 256 point
 * lights, 1 / sqrt(256) of the light they bring, which is less than half. */
static void light_groups_of_caches_sum_up(void **state)
{
    (void)state;
    static const char *const methods[] = {"live", "ic", "tic", "irrcache"};
    for (size_t m = 0; m < LUM_ARRAY_LEN(methods); m++) {
        char line[160];
        snprintf(line, sizeof line, "render --scene cornell --method %s --spp 1 --size 40x30 --out @whole.exr",
                 methods[m]);
        assert_int_equal(cli_run(lum_cmd_render, line), LUM_EXIT_OK);
        snprintf(line, sizeof line,
                 "render --scene cornell --method %s --spp 1 --size 40x30 --light-groups --out @sum.exr", methods[m]);
        assert_int_equal(cli_run(lum_cmd_render, line), LUM_EXIT_OK);
        struct lum_exr_image whole = cli_read_exr("whole.exr"), sum = cli_read_exr("sum.exr");
        const float *w = cli_channel(&whole, "G"), *s = cli_channel(&sum, "G"),
                    *ceiling = cli_channel(&sum, "ceiling.G"), *globe = cli_channel(&sum, "globe.G");
        double of_whole = 0.0, of_sum = 0.0;
        for (size_t i = 0; i < 40 * 30; i++) {
            if (!(fabsf(ceiling[i] + globe[i] - s[i]) <= 1e-6f * s[i]))
                fail_msg("%s, pixel %zu: %.9g and %.9g, summed %.9g", methods[m], i, (double)ceiling[i],
                         (double)globe[i], (double)s[i]);
            of_whole += (double)w[i];
            of_sum += (double)s[i];
        }
        if (!(fabs(of_sum - of_whole) <= 0.03 * of_whole))
            fail_msg("%s: mean %g whole, %g summed", methods[m], of_whole / 1200, of_sum / 1200);
        lum_exr_finish(&whole);
        lum_exr_finish(&sum);
    }
}

struct said {
    double rel, bound, mean; /* luminance */
    bool known;              /* rel and bound are */
    int spp;
    char stopped_by[8];
    int status;
};

/* What a frame says of its error, and how bright it is. */
static struct said render(const char *options)
{
    char line[200];
    struct said said = {0};
    struct lum_proto_error err;
    snprintf(line, sizeof line, "render --scene cornell --size 40x30 --out @e.exr --stats @e.json %s", options);
    said.status = cli_run(lum_cmd_render, line);
    struct lum_exr_image im = cli_read_exr("e.exr");
    const float *r = cli_channel(&im, "R"), *g = cli_channel(&im, "G"), *b = cli_channel(&im, "B");
    for (size_t i = 0; i < 40 * 30; i++)
        said.mean += (0.2126 * (double)r[i] + 0.7152 * (double)g[i] + 0.0722 * (double)b[i]) / (40 * 30);
    lum_exr_finish(&im);
    char *text = cli_read_text(cli_in_dir("e.json"));
    cJSON *o = lum_json_parse(text, strlen(text), &err);
    const cJSON *frame = cJSON_GetArrayItem(cli_member(o, "frames"), 0), *error = cli_member(frame, "error");
    said.spp = cli_member(frame, "spp")->valueint;
    said.known = cJSON_IsObject(error);
    said.rel = said.known ? cli_member(error, "rel")->valuedouble : (double)NAN;
    said.bound = said.known ? cli_member(error, "bound")->valuedouble : (double)NAN;
    snprintf(said.stopped_by, sizeof said.stopped_by, "%s", cli_member(frame, "stopped_by")->valuestring);
    cJSON_Delete(o);
    free(text);
    return said;
}

/* The error of the sum is that of the groups, each rendered by itself, added up. Single floats round the light of 1200
 * pixels, of which the mean is made: some 1e-7 of it. */
static void the_error_is_that_of_the_sum(void **state)
{
    (void)state;
    static const char *const off[] = {"globe", "ceiling-panel"};
    double rel = 0.0, bound = 0.0, mean = 0.0;
    for (size_t i = 0; i < 2; i++) {
        char edit[160];
        snprintf(edit, sizeof edit,
                 "{\"lumend\":1,\"kind\":\"scene\"}\n"
                 "{\"op\":\"set\",\"id\":\"%s\",\"path\":\"/on\",\"value\":false}\n",
                 off[i]);
        cli_write_text(cli_in_dir("off.jsonl"), edit);
        struct said one = render("--method path --spp 4 --edits @off.jsonl");
        rel += one.rel * one.mean;
        bound += one.bound * one.mean;
        mean += one.mean;
    }
    struct said sum = render("--method path --spp 4 --light-groups");
    if (!(fabs(sum.rel / (rel / mean) - 1.0) < 1e-5 && fabs(sum.bound / (bound / mean) - 1.0) < 1e-5))
        fail_msg("%g, at most %g; of the groups %g and %g", sum.rel, sum.bound, rel / mean, bound / mean);
}

/* Where each group keeps to an error, so does the sum; where one does not, it is not said. */
static void an_error_holds_for_the_sum(void **state)
{
    (void)state;
    static const char *const methods[] = {"path", "live"};
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        char line[128];
        snprintf(line, sizeof line, "--method %s --light-groups --error 1", methods[m]);
        struct said kept = render(line);
        assert_true(kept.rel < kept.bound && kept.bound <= 1.0);
        assert_string_equal(kept.stopped_by, "error");
        assert_int_equal(kept.status, LUM_EXIT_OK);
        snprintf(line, sizeof line, "--method %s --light-groups --error 1e-3 --spp 12", methods[m]);
        struct said missed = render(line);
        assert_string_equal(missed.stopped_by, "spp");
        assert_int_equal(missed.status, LUM_EXIT_MISSED);
    }
}

/* A lamp that is off, and one that shines in a box, have black layers. Nobody waits for their error, the sum has that
 * of the others, and where there are no others it is not known. */
static void black_layers_end_early(void **state)
{
    (void)state;
    static const char *const methods[] = {"path", "live"};
    static const char boxed[] =
        "{\"lumend\":1,\"kind\":\"scene\"}\n"
        "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"shell\",\"shape\":\"box\"}\n"
        "{\"op\":\"add\",\"type\":\"material\",\"id\":\"tin\"}\n"
        "{\"op\":\"add\",\"type\":\"object\",\"id\":\"case\",\"mesh\":\"shell\",\"material\":\"tin\","
        "\"transform\":{\"translate\":[0,-20,0]}}\n"
        "{\"op\":\"add\",\"type\":\"light\",\"id\":\"boxed\",\"kind\":\"point\",\"position\":[0,-20,0],"
        "\"flux_lm\":100}\n"
        "{\"op\":\"set\",\"id\":\"globe\",\"path\":\"/on\",\"value\":false}\n";
    for (size_t m = 0; m < LUM_ARRAY_LEN(methods); m++) {
        char line[128], edits[1200];
        snprintf(line, sizeof line, "--method %s --light-groups --error 1 --edits @boxed.jsonl", methods[m]);
        cli_write_text(cli_in_dir("boxed.jsonl"), boxed);
        struct said said = render(line);
        assert_true(said.mean > 0.0 && said.rel < said.bound && said.bound <= 1.0 && said.spp < 64);
        assert_string_equal(said.stopped_by, "error");
        assert_int_equal(said.status, LUM_EXIT_OK);
        snprintf(edits, sizeof edits, "%s%s", boxed,
                 "{\"op\":\"set\",\"id\":\"ceiling-panel\",\"path\":\"/on\",\"value\":false}\n");
        cli_write_text(cli_in_dir("boxed.jsonl"), edits);
        said = render(line);
        assert_true(said.mean == 0.0 && !said.known && said.spp == 64);
        assert_string_equal(said.stopped_by, "black");
        assert_int_equal(said.status, LUM_EXIT_MISSED);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_groups_sum_to_the_whole), cmocka_unit_test(surfaces_that_shine_have_groups),
        cmocka_unit_test(light_groups_of_caches_sum_up), cmocka_unit_test(the_error_is_that_of_the_sum),
        cmocka_unit_test(an_error_holds_for_the_sum),    cmocka_unit_test(black_layers_end_early),
    };
    return cmocka_run_group_tests(tests, cli_make_dir, cli_remove_dir);
}
