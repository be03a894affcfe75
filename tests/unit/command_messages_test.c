/* What lumend render says: what is wrong, and where; what it leaves out; how far it is. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/method/method.h"
#include "core/trace/effect.h"
#include "protocol/json/json.h"
#include "server/base/suggest.h"
#include "server/cli/commands.h"
#include "server/cli/progress.h"
#include "tests/unit/cli_kit.h"

static void expect_message(const char *line, const char *message)
{
    int status;
    char *text = cli_said(line, &status);
    if (status == LUM_EXIT_OK || !strstr(text, message))
        fail_msg("\"%s\" ended with status %d and said \"%s\", not \"%s\"", line, status, text, message);
    free(text);
}

static void refusals_name_their_place(void **state)
{
    (void)state;
    static const struct {
        const char *op, *message;
    } cases[] = {
        {"\"op\":\"set\",\"id\":\"globe\",\"path\":\"/flux_lm\",\"value\":-1", "flux_lm must be a number from 0"},
        {"\"op\":\"set\",\"id\":\"globe\",\"path\":\"/flux_ln\",\"value\":1", "did you mean \"flux_lm\"?"},
        {"\"op\":\"set\",\"id\":\"glob\",\"path\":\"/on\",\"value\":true",
         "there is no \"glob\": did you mean \"globe\"?"},
        {"\"op\":\"add\",\"type\":\"object\",\"id\":\"q\",\"mesh\":\"none\",\"material\":\"white\"",
         "\"q\": there is no mesh \"none\""},
        {"\"op\":\"add\",\"type\":\"light\",\"id\":\"q\",\"kind\":\"sphere\",\"radius\":1e-4,\"flux_lm\":1e12",
         "flux_lm must be from 0 to 394784 "}, /* 4 pi^2 radius^2 times the limit of luminance, 1e12 cd/m2 */
        {"\"op\":\"import\",\"id\":\"q\",\"asset\":\"none.glb\"", "imports need a folder of model files"},
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++) {
        char text[512], message[128];
        snprintf(text, sizeof text,
                 "{\"lumend\":1,\"kind\":\"replay\"}\n# the second line\n"
                 "{\"t_ms\":0,\"op\":\"set\",\"id\":\"globe\",\"path\":\"/on\",\"value\":false}\n{\"t_ms\":1,%s}\n",
                 cases[i].op);
        cli_write_text(cli_in_dir("refused.jsonl"), text);
        snprintf(message, sizeof message, "/refused.jsonl: line 4: %s", i == 1 ? "unknown field" : cases[i].message);
        const char *line = "render --scene cornell --method whitted --size 8x8 --edits @refused.jsonl --out @x.png";
        expect_message(line, message);
        expect_message(line, cases[i].message);
    }
    expect_message("render --scene cornell --method whitted --size 8x8 --edits desk-moves --out @x.png",
                   "desk-moves: line ");
    expect_message("render --scene cornell --edits dask-moves --out @x.png", "dask-moves: no such file or built-in");
    /* before anything is read, let alone rendered */
    expect_message("render --scene nothing --out @nowhere/x.png", "cannot write to ");
    expect_message("render --scene nothing --out @x.png --stats @nowhere/s.json", "cannot write to ");
    expect_message("render --scene cornell --cache-accuracy 0 --out @x.png",
                   "--cache-accuracy must be a number from 0.01 to 1");
    expect_message("render --scene cornell --effects-off direct,media --effects-on media --out @x.png",
                   "both name media");
}

/* A file from before. */
static void fields_that_are_gone_are_told(void **state)
{
    (void)state;
    cli_write_text(cli_in_dir("old.jsonl"),
                   "{\"lumend\":1,\"kind\":\"scene\"}\n"
                   "{\"op\":\"set\",\"id\":\"render\",\"path\":\"/storage\",\"value\":\"lock\"}\n");
    expect_message("render --scene @old.jsonl --out @x.png", "line 2: storage is no field of a scene any more");
    cli_write_text(cli_in_dir("old.jsonl"),
                   "{\"lumend\":1,\"kind\":\"scene\"}\n"
                   "{\"op\":\"set\",\"id\":\"render\",\"path\":\"\",\"value\":{\"seed\":1,\"storage\":\"lock\"}}\n");
    expect_message("render --scene @old.jsonl --out @x.png", "an option of lumend render now");
}

/* A bulb of which a mirror sends a fifth elsewhere: told once, with what to do, and in the statistics of each frame. */
static void light_that_is_in_no_picture_is_told(void **state)
{
    (void)state;
    cli_write_text(
        cli_in_dir("mirror.jsonl"),
        "{\"lumend\":1,\"kind\":\"scene\"}\n"
        "{\"op\":\"add\",\"type\":\"material\",\"id\":\"silver\",\"metallic\":1,\"roughness\":0}\n"
        "{\"op\":\"add\",\"type\":\"material\",\"id\":\"grey\",\"base_color\":[0.5,0.5,0.5]}\n"
        "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"plane\",\"shape\":\"quad\",\"size\":[4,0,4]}\n"
        "{\"op\":\"add\",\"type\":\"object\",\"id\":\"mirror\",\"mesh\":\"plane\",\"material\":\"silver\"}\n"
        "{\"op\":\"add\",\"type\":\"object\",\"id\":\"ceiling\",\"mesh\":\"plane\",\"material\":\"grey\","
        "\"transform\":{\"translate\":[0,3,0]}}\n"
        "{\"op\":\"add\",\"type\":\"light\",\"id\":\"bulb\",\"kind\":\"point\",\"position\":[0,2,0],\"flux_lm\":"
        "1000}\n");
    cli_write_text(cli_in_dir("dim.jsonl"),
                   "{\"lumend\":1,\"kind\":\"replay\"}\n"
                   "{\"t_ms\":10,\"op\":\"set\",\"id\":\"bulb\",\"path\":\"/flux_lm\",\"value\":50}\n");
    int status;
    char *text =
        cli_said("render --scene @mirror.jsonl --edits @dim.jsonl --method whitted --size 8x8 --frames 2 --fps 50 "
                 "--out @m%04d.png --stats @m.json",
                 &status);
    const char *told = strstr(text, " % of the light of bulb is in no picture: it goes by way of mirrors");
    if (status != LUM_EXIT_OK || !told || strstr(strstr(told, "picture") + 1, "picture") ||
        !strstr(told, "above all mirror") || !strstr(told, "Give the lamp an extent") || strstr(told, "architectural"))
        fail_msg("said: %s", text);
    free(text);
    text = cli_read_text(cli_in_dir("m.json"));
    struct lum_proto_error err;
    cJSON *o = lum_json_parse(text, strlen(text), &err);
    const cJSON *first = cli_member(cJSON_GetArrayItem(cli_member(o, "frames"), 0), "caustics");
    const cJSON *second = cli_member(cJSON_GetArrayItem(cli_member(o, "frames"), 1), "caustics");
    double share = cli_member(first, "share")->valuedouble;
    assert_true(share > 0.05 && share < 0.5);
    assert_true(cli_member(first, "rays")->valuedouble > 0.0);
    assert_true(cli_member(second, "rays")->valuedouble == 0.0); /* it was dimmed */
    assert_true(fabs(cli_member(second, "share")->valuedouble - share) < 1e-6 * share);
    assert_true(cli_member(second, "focused_lm")->valuedouble < 0.1 * cli_member(first, "focused_lm")->valuedouble);
    const cJSON *light = cJSON_GetArrayItem(cli_member(first, "lights"), 0);
    assert_string_equal(cli_member(light, "id")->valuestring, "bulb");
    assert_string_equal(cli_member(light, "object")->valuestring, "mirror");
    cJSON_Delete(o);
    free(text);
}

static void mistakes_are_told_apart(void **state)
{
    (void)state;
    static const struct {
        const char *line;
        int status;
    } cases[] = {
        {"render", LUM_EXIT_USAGE},
        {"render --scene cornell", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.jpg", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --size 10", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --size 0x10", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --spp 0", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --spp 1e3", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --frames 2", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --wat", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --sp 3", LUM_EXIT_USAGE}, /* no abbreviations */
        {"render --scene cornell --out @x.png --sp=3", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --spp", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png surplus", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --effects-off caustics", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --effects-off direct,", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --effects-on", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --vpls 0", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --vpls 65537", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --storage disk", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --cache-accuracy 0.009", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --cache-accuracy 1.01", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --cache-accuracy nan", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --exposure bright", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --exposure 40.5", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --exposure nan", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.png --tone-map film", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.exr --exposure 7", LUM_EXIT_USAGE},
        {"render --scene cornell --out @x.exr --tone-map agx", LUM_EXIT_USAGE},
        {"render --scene no-such-scene --out @x.png", LUM_EXIT_FAILED},
        {"render --scene cornell --edits cornell --out @x.png", LUM_EXIT_FAILED},
        {"render --scene cornell-moves --out @x.png", LUM_EXIT_FAILED},
        {"render --scene @no-such.jsonl --out @x.png", LUM_EXIT_FAILED},
        {"render --scene cornell --method radiosity --out @x.png", LUM_EXIT_USAGE},
        {"render --scene cornell --camera nobody --out @x.png", LUM_EXIT_FAILED},
        {"render --scene cornell --size 4x4 --spp 1 --out @no/such/folder.png", LUM_EXIT_FAILED},
        {"render --scene cornell --size 4x4 --spp 1 --edits @bad.jsonl --out @x.png", LUM_EXIT_FAILED},
    };
    cli_write_text(cli_in_dir("bad.jsonl"),
                   "{\"lumend\":1,\"kind\":\"replay\"}\n"
                   "{\"t_ms\":0,\"op\":\"set\",\"id\":\"nobody\",\"path\":\"/on\",\"value\":false}\n");
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++)
        if (cli_run(lum_cmd_render, cases[i].line) != cases[i].status)
            fail_msg("\"%s\" did not end with status %d", cases[i].line, cases[i].status);
}

/* Every method keeps what --error says, or says that it does not, and makes the picture all the same. It makes no
 * difference who chose the method: the option, or the scene. The furnace, 16 x 16, is within a fifth in every method
 * but the one that leaves out indirect light. */
static void an_error_is_kept_or_missed(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = 0; m < n; m++)
        for (int by_scene = 0; by_scene < 2; by_scene++) {
            char line[256], edit[160];
            int status = LUM_EXIT_OK;
            bool keeps = methods[m].serves[LUM_EFFECT_INDIRECT_DIFFUSE] != NULL;
            snprintf(edit, sizeof edit,
                     "{\"lumend\":1,\"kind\":\"replay\"}\n"
                     "{\"t_ms\":0,\"op\":\"set\",\"id\":\"render\",\"path\":\"/method\",\"value\":\"%s\"}\n",
                     methods[m].name);
            cli_write_text(cli_in_dir("m.jsonl"), edit);
            snprintf(line, sizeof line, "render --scene furnace --size 16x16 --error 0.2 --out @kept.png %s%s",
                     by_scene ? "--edits @m.jsonl" : "--method ", by_scene ? "" : methods[m].name);
            if (keeps) {
                assert_int_equal(cli_run(lum_cmd_render, line), LUM_EXIT_OK);
                assert_int_equal(remove(cli_in_dir("kept.png")), 0);
                continue;
            }
            char *said = cli_said(line, &status);
            bool made = remove(cli_in_dir("kept.png")) == 0;
            if (status != LUM_EXIT_MISSED || !made || !strstr(said, "not expected") || !strstr(said, "adds no samples"))
                fail_msg("%s: status %d, %s; it said: %s", line, status, made ? "a picture" : "no picture", said);
            free(said);
        }
}

/* What has no effect is told, and not refused: a script may go through all methods with the same options. */
static void what_has_no_effect_is_told(void **state)
{
    (void)state;
    static const char *const options[] = {"--spp 4", "--time 1"};
    for (size_t i = 0; i < sizeof options / sizeof *options; i++) {
        char line[160];
        int status;
        snprintf(line, sizeof line, "render --scene cornell --method whitted --size 16x16 --out @x.png %s", options[i]);
        char *said = cli_said(line, &status);
        assert_int_equal(status, LUM_EXIT_OK);
        if (!strstr(said, "--spp and --time have no effect"))
            fail_msg("%s: it said: %s", line, said);
        free(said);
    }
}

static void names_that_do_not_exist_are_answered_with_those_near(void **state)
{
    (void)state;
    static const struct {
        void (*names)(const char *name, char ret_text[LUM_SUGGEST_BYTES]);
        const char *given, *want;
    } rows[] = {
        {lum_suggest_method, "pth", ": did you mean \"path\"?"},
        {lum_suggest_method, "ais_max", ": did you mean \"ais-max\"?"},
        {lum_suggest_effect, "soft_shadows", ": did you mean \"soft_shadow\"?"},
        {lum_suggest_scene, "officee", ": did you mean \"office\"?"},
        {lum_suggest_scene, "desk-movs", ": did you mean \"desk-moves\"?"},
        {lum_suggest_scene, "qqqqqqqq", " (see: lumend scenes)"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[LUM_SUGGEST_BYTES];
        rows[i].names(rows[i].given, text);
        if (strcmp(text, rows[i].want) != 0)
            fail_msg("\"%s\"%s, expected %s", rows[i].given, text, rows[i].want);
    }
    char all[LUM_SUGGEST_BYTES];
    lum_suggest_effect("q", all);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (!strstr(all, lum_effect_names[e]))
            fail_msg("%s is not in %s", lum_effect_names[e], all);
}

/* A log gets as many lines as the run time has doublings, whatever time a pass takes; a terminal four a second. */
static void progress_is_told_seldom_in_a_log(void **state)
{
    (void)state;
    const int64_t ms = 1000000, start = 77 * ms;
    struct lum_progress log = {.start_ns = start}, tty = {.tty = true, .start_ns = start};
    unsigned n = 0, n_tty = 0;
    for (int64_t t = 0; t < 100000; t += 10) {
        if (lum_progress_due(&log, start + t * ms))
            assert_int_equal(t, 2000 << n++);
        n_tty += lum_progress_due(&tty, start + t * ms);
    }
    assert_int_equal(n, 6);                         /* 2, 4, 8, 16, 32 and 64 s */
    assert_int_equal(n_tty, 396);                   /* from 1 s on */
    struct lum_progress slow = {.start_ns = start}; /* passes of 7 s: at the first after each of those */
    static const int due[] = {7, 14, 21, 35, 70};
    n = 0;
    for (int64_t t = 7; t < 100; t += 7)
        if (lum_progress_due(&slow, start + t * 1000 * ms))
            assert_int_equal(t, due[n++]);
    assert_int_equal(n, 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(refusals_name_their_place),
        cmocka_unit_test(mistakes_are_told_apart),
        cmocka_unit_test(an_error_is_kept_or_missed),
        cmocka_unit_test(what_has_no_effect_is_told),
        cmocka_unit_test(names_that_do_not_exist_are_answered_with_those_near),
        cmocka_unit_test(fields_that_are_gone_are_told),
        cmocka_unit_test(light_that_is_in_no_picture_is_told),
        cmocka_unit_test(progress_is_told_seldom_in_a_log),
    };
    return cmocka_run_group_tests(tests, cli_make_dir, cli_remove_dir);
}
