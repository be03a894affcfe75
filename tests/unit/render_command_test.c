/* lumend render, compare, scenes and methods as a user calls them, in process. */
#define _GNU_SOURCE /* mkdtemp, mkstemps */
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

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "core/image/exr.h"
#include "core/method/method.h"
#include "protocol/json.h"
#include "server/commands.h"
#include "server/names.h"
#include "server/progress.h"
#include "server/render_options.h"

enum { MAX_ARGS = 24 };

static char dir[64]; /* the test's own folder */

static int make_dir(void **state)
{
    (void)state;
    snprintf(dir, sizeof dir, "/tmp/lumend-test-XXXXXX");
    return mkdtemp(dir) ? 0 : -1;
}

static int remove_dir(void **state)
{
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -r '%s'", dir);
    return system(command);
}

/* A path in the folder; four of them live at a time. */
static char *in_dir(const char *name)
{
    static char paths[4][128];
    static int next;
    char *p = paths[next++ % 4];
    snprintf(p, sizeof paths[0], "%s/%s", dir, name);
    return p;
}

/* The words of line become argv; a word that starts with @ is a file in the folder. */
static int run(int (*command)(int, char **), const char *line)
{
    char text[512], *argv[MAX_ARGS + 1], owned[MAX_ARGS][128];
    int argc = 0;
    snprintf(text, sizeof text, "%s", line);
    for (char *word = strtok(text, " "); word && argc < MAX_ARGS; word = strtok(NULL, " ")) {
        snprintf(owned[argc], sizeof owned[0], "%s", word[0] == '@' ? in_dir(word + 1) : word);
        argv[argc] = owned[argc];
        argc++;
    }
    argv[argc] = NULL;
    return command(argc, argv);
}

static char *read_text(const char *path)
{
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    char *text = calloc(1, 1 << 20);
    assert_non_null(text);
    assert_true(fread(text, 1, (1 << 20) - 1, f) > 0);
    fclose(f);
    return text;
}

static void write_text(const char *path, const char *text)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_true(fputs(text, f) >= 0);
    assert_int_equal(fclose(f), 0);
}

static const float *channel(const struct lum_exr_image *im, const char *name)
{
    for (uint32_t i = 0; i < im->n_channels; i++)
        if (strcmp(im->names[i], name) == 0)
            return im->pixels + (size_t)i * im->w * im->h;
    fail_msg("no channel %s", name);
    return NULL;
}

static struct lum_exr_image read_exr(const char *name)
{
    struct lum_exr_image im;
    struct lum_error err;
    if (lum_exr_read(in_dir(name), 4096, 4096, &im, &err))
        fail_msg("%s", err.text);
    return im;
}

/* Emission 1 and albedo 1/2 everywhere: L = 1 / (1 - 1/2) = 2 in every pixel. Next-event estimation and Russian
 * roulette make a sample noisy; the tolerance is five standard errors of the mean, which the samples themselves give.
 */
static void furnace_has_its_closed_form(void **state)
{
    (void)state;
    assert_int_equal(run(lum_cmd_render, "render --scene furnace --method path --size 48x32 --spp 64 --out @f.exr"),
                     LUM_EXIT_OK);
    struct lum_exr_image im = read_exr("f.exr");
    size_t n = (size_t)im.w * im.h;
    const float *r = channel(&im, "R"), *g = channel(&im, "G");
    double sum = 0.0, square = 0.0;
    for (size_t i = 0; i < n; i++) {
        sum += (double)r[i];
        square += (double)r[i] * (double)r[i];
        assert_true(fabsf(r[i] - g[i]) <= 1e-5f * r[i]); /* grey */
    }
    double mean = sum / (double)n, error = sqrt((square / (double)n - mean * mean) / (double)n);
    if (!(fabs(mean - 2.0) <= 5.0 * error + 1e-6))
        fail_msg("mean %.6f, standard error %.6f", mean, error);
    const float *z = channel(&im, "Z"), *id = channel(&im, "id"), *nx = channel(&im, "N.X"), *ny = channel(&im, "N.Y"),
                *nz = channel(&im, "N.Z"), *albedo = channel(&im, "albedo.R");
    for (size_t i = 0; i < n; i++) {
        double length =
            sqrt((double)nx[i] * (double)nx[i] + (double)ny[i] * (double)ny[i] + (double)nz[i] * (double)nz[i]);
        assert_true(z[i] > 0.0f && z[i] < 3.4642f); /* inside the cube of side 2: at most its diagonal */
        assert_true(id[i] >= 1.0f && id[i] <= 7.0f);
        assert_true(fabs(length - 1.0) < 1e-5);
        assert_true(fabsf(albedo[i] - 0.5f) < 1e-6f);
    }
    lum_exr_finish(&im);
}

static void threads_do_not_change_a_bit(void **state)
{
    (void)state;
    assert_int_equal(run(lum_cmd_render, "render --scene cornell --size 61x37 --spp 2 --threads 1 --out @t1.exr"),
                     LUM_EXIT_OK);
    assert_int_equal(run(lum_cmd_render, "render --scene cornell --size 61x37 --spp 2 --threads 3 --out @t3.exr"),
                     LUM_EXIT_OK);
    struct lum_exr_image a = read_exr("t1.exr"), b = read_exr("t3.exr");
    assert_int_equal(a.n_channels, b.n_channels);
    assert_memory_equal(a.pixels, b.pixels, (size_t)a.w * a.h * a.n_channels * sizeof *a.pixels);
    assert_int_equal(run(lum_cmd_render, "render --scene cornell --size 61x37 --spp 2 --seed 7 --out @t3.exr"),
                     LUM_EXIT_OK);
    lum_exr_finish(&b);
    b = read_exr("t3.exr");
    assert_true(memcmp(channel(&a, "R"), channel(&b, "R"), (size_t)a.w * a.h * sizeof(float)) != 0);
    lum_exr_finish(&a);
    lum_exr_finish(&b);
}

static const cJSON *member(const cJSON *o, const char *key)
{
    const cJSON *m = cJSON_GetObjectItemCaseSensitive(o, key);
    if (!m)
        fail_msg("no member %s", key);
    return m;
}

static void stats_hold_what_the_design_names(void **state)
{
    (void)state;
    assert_int_equal(run(lum_cmd_render, "render --scene cornell --method whitted --size 40x30 --threads 2 --isa "
                                         "sse4.2 --seed 5 --out @s.png --stats @s.json"),
                     LUM_EXIT_OK);
    char *text = read_text(in_dir("s.json"));
    struct lum_proto_error err;
    cJSON *o = lum_json_parse(text, strlen(text), &err);
    assert_non_null(o);
    assert_string_equal(member(o, "scene")->valuestring, "cornell");
    assert_string_equal(member(o, "method")->valuestring, "whitted");
    assert_int_equal(cJSON_GetArrayItem(member(o, "size"), 0)->valueint, 40);
    assert_int_equal(member(o, "threads")->valueint, 2);
    assert_int_equal(member(o, "seed")->valueint, 5);
    assert_true(member(o, "peak_rss_kb")->valuedouble > 0.0);
    member(o, "version");
    assert_string_equal(member(o, "isa")->valuestring, "sse4.2");
    member(o, "setup_ms");
    const cJSON *frame = cJSON_GetArrayItem(member(o, "frames"), 0);
    static const char *const members[] = {"frame", "scene_rev", "ms",       "cpu_ms", "stage_ms",
                                          "cache", "vpls",      "caustics", "error"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(members); i++)
        member(frame, members[i]);
    assert_int_equal(member(frame, "nonfinite")->valueint, 0);
    assert_int_equal(member(frame, "bad_rays")->valueint, 0);
    const cJSON *rays = member(frame, "rays"), *effects = member(frame, "effects");
    for (int i = 0; i < LUM_RAY_KIND_COUNT; i++)
        member(rays, lum_ray_kind_names[i]);
    assert_int_equal(member(rays, "primary")->valueint, 40 * 30); /* one a pixel */
    assert_true(member(rays, "soft_shadow")->valuedouble > 0.0);
    for (int i = 0; i < LUM_EFFECT_COUNT; i++) {
        const cJSON *e = member(effects, lum_effect_names[i]);
        assert_true(strlen(member(e, "why")->valuestring) > 0);
        if (!cJSON_IsTrue(member(e, "on")))
            assert_true(member(e, "rays")->valuedouble == 0.0 && member(e, "ns")->valuedouble == 0.0);
    }
    cJSON_Delete(o);
    free(text);
}

/* What is forced off has no rays and says why; --help lists the names that the options take. */
static void effects_are_forced(void **state)
{
    (void)state;
    assert_int_equal(run(lum_cmd_render,
                         "render --scene cornell --method whitted --size 20x20 --effects-off "
                         "soft_shadow,reflection --effects-on media --vpls 8 --out @e.png --stats @e.json"),
                     LUM_EXIT_OK);
    char *text = read_text(in_dir("e.json"));
    struct lum_proto_error err;
    cJSON *o = lum_json_parse(text, strlen(text), &err);
    const cJSON *effects = member(cJSON_GetArrayItem(member(o, "frames"), 0), "effects");
    const cJSON *off = member(effects, "soft_shadow"), *on = member(effects, "media");
    assert_true(cJSON_IsFalse(member(off, "on")) && member(off, "rays")->valuedouble == 0.0);
    assert_string_equal(member(off, "why")->valuestring, "the view switched it off");
    assert_true(cJSON_IsTrue(member(off, "served")) && cJSON_IsTrue(member(on, "on")));
    cJSON_Delete(o);
    free(text);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (!strstr(lum_render_help, lum_effect_names[e]))
            fail_msg("--help does not name %s", lum_effect_names[e]);
}

static bool same_file(const char *a, const char *b)
{
    char command[300];
    snprintf(command, sizeof command, "cmp -s '%s' '%s'", in_dir(a), in_dir(b));
    return system(command) == 0;
}

/* cornell is exposed for 7.6, by AgX: saying so changes nothing, saying anything else does. */
static void a_png_is_exposed_as_asked(void **state)
{
    (void)state;
    static const struct {
        const char *options;
        bool same;
    } rows[] = {{"--exposure 7.6", true},
                {"--tone-map agx", true},
                {"--exposure 9", false},
                {"--exposure auto", false},
                {"--tone-map none", false}};
    const char *plain = "render --scene cornell --method whitted --size 20x20 --out";
    char line[256];
    snprintf(line, sizeof line, "%s @plain.png", plain);
    assert_int_equal(run(lum_cmd_render, line), LUM_EXIT_OK);
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        snprintf(line, sizeof line, "%s @asked.png %s", plain, rows[i].options);
        assert_int_equal(run(lum_cmd_render, line), LUM_EXIT_OK);
        if (same_file("plain.png", "asked.png") != rows[i].same)
            fail_msg("%s: the picture is %s", rows[i].options, rows[i].same ? "another" : "the same");
    }
}

/* A replay by its name: the frames follow it. */
static void a_built_in_replay_is_rendered(void **state)
{
    (void)state;
    assert_int_equal(run(lum_cmd_render,
                         "render --scene wobble --edits wobble-moves --frames 3 --fps 3 --method whitted "
                         "--size 60x40 --out @w%d.png"),
                     LUM_EXIT_OK);
    assert_false(same_file("w0.png", "w1.png") || same_file("w1.png", "w2.png"));
}

/* Ten frames a second: edits at 0, 100 and 150 ms show in frames 0, 1 and 2. */
static void edits_follow_the_timeline(void **state)
{
    (void)state;
    write_text(in_dir("e.jsonl"),
               "{\"lumend\":1,\"kind\":\"replay\"}\n"
               "{\"t_ms\":100,\"op\":\"set\",\"id\":\"globe\",\"path\":\"/on\",\"value\":false}\n"
               "{\"t_ms\":100,\"op\":\"set\",\"id\":\"ceiling-panel\",\"path\":\"/flux_lm\",\"value\":1}\n"
               "{\"t_ms\":150,\"op\":\"set\",\"id\":\"ceiling-panel\",\"path\":\"/on\",\"value\":false}\n");
    assert_int_equal(run(lum_cmd_render,
                         "render --scene cornell --edits @e.jsonl --method whitted --size 32x32 --frames 3 --fps 10 "
                         "--out @seq%04d.exr --stats @seq.json"),
                     LUM_EXIT_OK);
    double mean[3];
    for (int f = 0; f < 3; f++) {
        char name[32];
        snprintf(name, sizeof name, "seq%04d.exr", f);
        struct lum_exr_image im = read_exr(name);
        mean[f] = 0.0;
        for (size_t i = 0; i < 32 * 32; i++)
            mean[f] += (double)channel(&im, "G")[i] / 1024.0;
        lum_exr_finish(&im);
    }
    assert_true(mean[0] > 100.0 * mean[1] && mean[1] > 0.0 && mean[2] == 0.0);
    char *text = read_text(in_dir("seq.json"));
    struct lum_proto_error err;
    cJSON *o = lum_json_parse(text, strlen(text), &err);
    const cJSON *frames = member(o, "frames");
    assert_int_equal(cJSON_GetArraySize(frames), 3);
    double rev0 = member(cJSON_GetArrayItem(frames, 0), "scene_rev")->valuedouble;
    /* the two edits of one instant are one transaction */
    assert_true(member(cJSON_GetArrayItem(frames, 1), "scene_rev")->valuedouble == rev0 + 1.0);
    assert_true(member(cJSON_GetArrayItem(frames, 2), "scene_rev")->valuedouble == rev0 + 2.0);
    cJSON_Delete(o);
    free(text);
}

/* Whitted takes the same shadow samples whatever the other lights do, so that the sum of the groups is the whole up to
 * the rounding of a sum of floats: some ulps. */
static void light_groups_sum_to_the_whole(void **state)
{
    (void)state;
    assert_int_equal(run(lum_cmd_render, "render --scene cornell --method whitted --size 40x30 --out @whole.exr"),
                     LUM_EXIT_OK);
    assert_int_equal(
        run(lum_cmd_render, "render --scene cornell --method whitted --size 40x30 --light-groups --out @sum.exr"),
        LUM_EXIT_OK);
    struct lum_exr_image whole = read_exr("whole.exr"), sum = read_exr("sum.exr");
    const float *w = channel(&whole, "G"), *s = channel(&sum, "G"), *ceiling = channel(&sum, "ceiling.G"),
                *globe = channel(&sum, "globe.G");
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
    write_text(in_dir("panels.jsonl"),
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
    assert_int_equal(
        run(lum_cmd_render, "render --scene @panels.jsonl --method whitted --size 40x30 --light-groups --out @p.exr"),
        LUM_EXIT_OK);
    struct lum_exr_image sum = read_exr("p.exr");
    const float *s = channel(&sum, "G"), *a = channel(&sum, "a.G"), *side = channel(&sum, "side.G"),
                *d = channel(&sum, "d.G");
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
        assert_int_equal(run(lum_cmd_render, line), LUM_EXIT_OK);
        snprintf(line, sizeof line,
                 "render --scene cornell --method %s --spp 1 --size 40x30 --light-groups --out @sum.exr", methods[m]);
        assert_int_equal(run(lum_cmd_render, line), LUM_EXIT_OK);
        struct lum_exr_image whole = read_exr("whole.exr"), sum = read_exr("sum.exr");
        const float *w = channel(&whole, "G"), *s = channel(&sum, "G"), *ceiling = channel(&sum, "ceiling.G"),
                    *globe = channel(&sum, "globe.G");
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

/* Mean of G. */
static double mean_light(const char *command)
{
    assert_int_equal(run(lum_cmd_render, command), LUM_EXIT_OK);
    struct lum_exr_image im = read_exr("mean.exr");
    size_t n = (size_t)im.w * im.h;
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += (double)channel(&im, "G")[i];
    lum_exr_finish(&im);
    return sum / (double)n;
}

/* The lamp of this scene stands under its rod, radius 0.015 m. Methods with hard shadows aim at a point 0.06 m off the
 * rod's axis, from where the rod hides 2 asin(0.015 / 0.06) of 2 pi, 8 %. The rest of the tolerance is for one sample
 * in place of a disc of radius 0.38 m that is 1.1 m from what it lights. Aimed at the middle, nothing was left. */
static void one_shadow_ray_passes_a_rod(void **state)
{
    (void)state;
    static const char *const methods[] = {"irrcache", "ic", "tic"};
    double soft = mean_light("render --scene cornell-indirect --method whitted --size 60x40 --out @mean.exr");
    for (size_t m = 0; m < LUM_ARRAY_LEN(methods); m++) {
        char line[256];
        snprintf(line, sizeof line,
                 "render --scene cornell-indirect --method %s --effects-off indirect_diffuse --size 60x40 "
                 "--out @mean.exr",
                 methods[m]);
        double hard = mean_light(line);
        if (!(fabs(hard / soft - 1.0) <= 0.2))
            fail_msg("%s: mean %.3f, of soft shadows %.3f", methods[m], hard, soft);
    }
}

/* Runs a command that fails, and looks for what it says on stderr. */
/* What the command wrote to stderr; free it. */
static char *said(const char *line, int *ret_status)
{
    char path[128];
    snprintf(path, sizeof path, "%s/stderr.txt", dir);
    fflush(stderr);
    int saved = dup(STDERR_FILENO), file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    assert_true(saved >= 0 && file >= 0 && dup2(file, STDERR_FILENO) >= 0);
    *ret_status = run(lum_cmd_render, line);
    fflush(stderr);
    assert_true(dup2(saved, STDERR_FILENO) >= 0);
    close(saved);
    close(file);
    return read_text(path);
}

static void expect_message(const char *line, const char *message)
{
    int status;
    char *text = said(line, &status);
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
        write_text(in_dir("refused.jsonl"), text);
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
                   "--cache-accuracy takes a number from 0.01 to 1");
    expect_message("render --scene cornell --effects-off direct,media --effects-on media --out @x.png",
                   "both name media");
}

/* A bulb of which a mirror sends a fifth elsewhere: told once, with what to do, and in the statistics of each frame. */
static void light_that_is_in_no_picture_is_told(void **state)
{
    (void)state;
    write_text(in_dir("mirror.jsonl"),
               "{\"lumend\":1,\"kind\":\"scene\"}\n"
               "{\"op\":\"add\",\"type\":\"material\",\"id\":\"silver\",\"metallic\":1,\"roughness\":0}\n"
               "{\"op\":\"add\",\"type\":\"material\",\"id\":\"grey\",\"base_color\":[0.5,0.5,0.5]}\n"
               "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"plane\",\"shape\":\"quad\",\"size\":[4,0,4]}\n"
               "{\"op\":\"add\",\"type\":\"object\",\"id\":\"mirror\",\"mesh\":\"plane\",\"material\":\"silver\"}\n"
               "{\"op\":\"add\",\"type\":\"object\",\"id\":\"ceiling\",\"mesh\":\"plane\",\"material\":\"grey\","
               "\"transform\":{\"translate\":[0,3,0]}}\n"
               "{\"op\":\"add\",\"type\":\"light\",\"id\":\"bulb\",\"kind\":\"point\",\"position\":[0,2,0],\"flux_lm\":"
               "1000}\n");
    write_text(in_dir("dim.jsonl"),
               "{\"lumend\":1,\"kind\":\"replay\"}\n"
               "{\"t_ms\":10,\"op\":\"set\",\"id\":\"bulb\",\"path\":\"/flux_lm\",\"value\":50}\n");
    int status;
    char *text = said("render --scene @mirror.jsonl --edits @dim.jsonl --method whitted --size 8x8 --frames 2 --fps 50 "
                      "--out @m%04d.png --stats @m.json",
                      &status);
    const char *told = strstr(text, " % of the light of bulb is in no picture: it goes by way of mirrors");
    if (status != LUM_EXIT_OK || !told || strstr(strstr(told, "picture") + 1, "picture") ||
        !strstr(told, "above all mirror") || !strstr(told, "Give the lamp an extent") || strstr(told, "architectural"))
        fail_msg("said: %s", text);
    free(text);
    text = read_text(in_dir("m.json"));
    struct lum_proto_error err;
    cJSON *o = lum_json_parse(text, strlen(text), &err);
    const cJSON *first = member(cJSON_GetArrayItem(member(o, "frames"), 0), "caustics");
    const cJSON *second = member(cJSON_GetArrayItem(member(o, "frames"), 1), "caustics");
    double share = member(first, "share")->valuedouble;
    assert_true(share > 0.05 && share < 0.5);
    assert_true(member(first, "rays")->valuedouble > 0.0);
    assert_true(member(second, "rays")->valuedouble == 0.0); /* it was dimmed */
    assert_true(fabs(member(second, "share")->valuedouble - share) < 1e-6 * share);
    assert_true(member(second, "focused_lm")->valuedouble < 0.1 * member(first, "focused_lm")->valuedouble);
    const cJSON *light = cJSON_GetArrayItem(member(first, "lights"), 0);
    assert_string_equal(member(light, "id")->valuestring, "bulb");
    assert_string_equal(member(light, "object")->valuestring, "mirror");
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
    write_text(in_dir("bad.jsonl"), "{\"lumend\":1,\"kind\":\"replay\"}\n"
                                    "{\"t_ms\":0,\"op\":\"set\",\"id\":\"nobody\",\"path\":\"/on\",\"value\":false}\n");
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++)
        if (run(lum_cmd_render, cases[i].line) != cases[i].status)
            fail_msg("\"%s\" did not end with status %d", cases[i].line, cases[i].status);
}

static void write_exr(const char *name, float value)
{
    float pixels[4 * 4 * 3];
    for (size_t i = 0; i < LUM_ARRAY_LEN(pixels); i++)
        pixels[i] = value;
    struct lum_exr_channel c[3] = {{"R", pixels, 3, false}, {"G", pixels + 1, 3, false}, {"B", pixels + 2, 3, false}};
    assert_int_equal(lum_exr_write(in_dir(name), 4, 4, c, 3, NULL, 0, NULL), LUM_OK);
}

/* Runs compare with stdout in a file. */
static cJSON *compare(const char *line, int *ret_status)
{
    fflush(stdout);
    int saved = dup(STDOUT_FILENO), out = open(in_dir("stdout"), O_CREAT | O_TRUNC | O_RDWR, 0600);
    dup2(out, STDOUT_FILENO);
    *ret_status = run(lum_cmd_compare, line);
    fflush(stdout);
    dup2(saved, STDOUT_FILENO);
    close(out);
    close(saved);
    if (*ret_status)
        return NULL;
    char *text = read_text(in_dir("stdout"));
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
    assert_true(fabs(member(o, "relmse")->valuedouble - 1.0 / 64.0) < 1e-8);
    assert_true(fabs(member(o, "rmse")->valuedouble - 128.0) < 1e-9);
    assert_true(fabs(member(o, "smape")->valuedouble - 128.0 / (2176.0 + 0.01)) < 1e-12);
    assert_int_equal(access(in_dir("heat.png"), R_OK), 0);
    cJSON_Delete(o);
    o = compare("compare @x.exr @r.exr --metric rmse", &status);
    assert_null(cJSON_GetObjectItem(o, "relmse"));
    member(o, "rmse");
    cJSON_Delete(o);
    compare("compare @x.exr", &status);
    assert_int_equal(status, LUM_EXIT_USAGE);
    compare("compare @x.exr @r.exr --metric flip", &status);
    assert_int_equal(status, LUM_EXIT_USAGE);
    compare("compare @x.exr @none.exr", &status);
    assert_int_equal(status, LUM_EXIT_FAILED);
}

static void names_that_do_not_exist_are_answered_with_those_near(void **state)
{
    (void)state;
    static const struct {
        void (*names)(const char *name, char ret_text[LUM_NAMES_BYTES]);
        const char *given, *want;
    } rows[] = {
        {lum_names_of_method, "pth", ": did you mean \"path\"?"},
        {lum_names_of_method, "ais_max", ": did you mean \"ais-max\"?"},
        {lum_names_of_effect, "soft_shadows", ": did you mean \"soft_shadow\"?"},
        {lum_names_of_effect, "q",
         ": there are direct, soft_shadow, environment, indirect_diffuse, reflection, transmission, glossy, media, "
         "antialias"},
        {lum_names_of_source, "officee", ": did you mean \"office\"?"},
        {lum_names_of_source, "desk-movs", ": did you mean \"desk-moves\"?"},
        {lum_names_of_source, "qqqqqqqq", " (see: lumend scenes)"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[LUM_NAMES_BYTES];
        rows[i].names(rows[i].given, text);
        if (strcmp(text, rows[i].want) != 0)
            fail_msg("\"%s\"%s, expected %s", rows[i].given, text, rows[i].want);
    }
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
        cmocka_unit_test(names_that_do_not_exist_are_answered_with_those_near),
        cmocka_unit_test(progress_is_told_seldom_in_a_log),
        cmocka_unit_test(furnace_has_its_closed_form),
        cmocka_unit_test(threads_do_not_change_a_bit),
        cmocka_unit_test(light_that_is_in_no_picture_is_told),
        cmocka_unit_test(stats_hold_what_the_design_names),
        cmocka_unit_test(effects_are_forced),
        cmocka_unit_test(a_png_is_exposed_as_asked),
        cmocka_unit_test(a_built_in_replay_is_rendered),
        cmocka_unit_test(edits_follow_the_timeline),
        cmocka_unit_test(light_groups_sum_to_the_whole),
        cmocka_unit_test(surfaces_that_shine_have_groups),
        cmocka_unit_test(light_groups_of_caches_sum_up),
        cmocka_unit_test(mistakes_are_told_apart),
        cmocka_unit_test(refusals_name_their_place),
        cmocka_unit_test(one_shadow_ray_passes_a_rod),
        cmocka_unit_test(compare_gives_closed_forms),
    };
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
