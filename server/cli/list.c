/* lumend scenes, lumend methods. */
#include "server/cli/commands.h"

#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "core/method/method.h"
#include "protocol/json/json.h"
#include "server/base/suggest.h"
#include "server/cli/help.h"
#include "server/world/scene_source.h"

static const char scenes_help[] =
    "usage: lumend scenes [NAME]\n"
    "Lists the built-in scenes, and the replays that move something in them: 100 poses, 30 a second. With NAME, prints "
    "that\n"
    "scene or replay as the .jsonl file that it is.\n"
    "\n"
    "  lumend --scene office\n"
    "  lumend scenes office > mine.jsonl; lumend --scene mine.jsonl\n"
    "  lumend render --scene cornell --edits cornell-moves --frames 100 --out frame%04d.png\n"
    "  lumend scenes cornell-moves | lumend-replay --token T -\n";

static const char methods_help[] =
    "usage: lumend methods\n"
    "Lists the rendering methods: a view, `lumend render --method` and the scene's setting\n"
    "render /method take their names.\n";

static int usage_error(const char *command, const char *argument)
{
    fprintf(stderr, "lumend %s: unexpected argument '%.60s' (see: lumend %s --help)\n", command, argument, command);
    return LUM_EXIT_USAGE;
}

static bool asks_for_help(int argc, char **argv)
{
    return argc == 2 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0);
}

/* The title in the header line. */
static void print_titles(const struct lum_embedded *e)
{
    for (; e->key; e++) {
        cJSON *header = lum_json_parse((const char *)e->bytes, strcspn((const char *)e->bytes, "\n"), NULL);
        const char *title = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(header, "title"));
        printf("%-16.*s %s\n", (int)strcspn(e->key, "."), e->key, title ? title : "");
        cJSON_Delete(header);
    }
}

static int print_file(const char *name)
{
    const struct lum_embedded *e = lum_scene_builtin(name);
    if (!e)
        e = lum_replay_builtin(name);
    if (!e) {
        char near[LUM_SUGGEST_BYTES];
        lum_suggest_scene(name, near);
        fprintf(stderr, "lumend scenes: there is no scene or replay '%.60s'%s\n", name, near);
        return LUM_EXIT_USAGE;
    }
    bool ok = fwrite(e->bytes, 1, e->n, stdout) == e->n && fflush(stdout) == 0;
    return ok ? LUM_EXIT_OK : LUM_EXIT_FAILED;
}

void lum_help_scenes(const struct lum_help *h)
{
    lum_help_text(h, scenes_help);
}

int lum_cmd_scenes(int argc, char **argv)
{
    if (asks_for_help(argc, argv))
        lum_help_scenes(&(struct lum_help){stdout, false});
    else if (argc > 2)
        return usage_error("scenes", argv[2]);
    else if (argc == 2)
        return print_file(argv[1]);
    else {
        print_titles(lum_embedded_scenes);
        print_titles(lum_embedded_replays);
    }
    return LUM_EXIT_OK;
}

void lum_help_methods(const struct lum_help *h)
{
    lum_help_text(h, methods_help);
}

int lum_cmd_methods(int argc, char **argv)
{
    if (asks_for_help(argc, argv)) {
        lum_help_methods(&(struct lum_help){stdout, false});
        return LUM_EXIT_OK;
    }
    if (argc > 1)
        return usage_error("methods", argv[1]);
    size_t n;
    const struct lum_method *m = lum_methods(&n);
    for (size_t i = 0; i < n; i++)
        printf("%-10s %s\n", m[i].name, m[i].summary);
    return LUM_EXIT_OK;
}
