/* lumend scenes, lumend methods. */
#include "server/commands.h"

#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "core/method/method.h"
#include "protocol/json.h"
#include "server/embed.h"

static bool has_arguments(int argc, char **argv)
{
    if (argc > 1)
        fprintf(stderr, "lumend %s: takes no arguments\n", argv[0]);
    return argc > 1;
}

/* The title in the header line. */
static void print_scene(const struct lum_embedded *e)
{
    cJSON *header = lum_json_parse((const char *)e->bytes, strcspn((const char *)e->bytes, "\n"), NULL);
    const char *title = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(header, "title"));
    printf("%-16.*s %s\n", (int)strcspn(e->key, "."), e->key, title ? title : "");
    cJSON_Delete(header);
}

int lum_cmd_scenes(int argc, char **argv)
{
    if (has_arguments(argc, argv))
        return LUM_EXIT_USAGE;
    for (const struct lum_embedded *e = lum_embedded_scenes; e->key; e++)
        print_scene(e);
    return LUM_EXIT_OK;
}

int lum_cmd_methods(int argc, char **argv)
{
    if (has_arguments(argc, argv))
        return LUM_EXIT_USAGE;
    size_t n;
    const struct lum_method *m = lum_methods(&n);
    for (size_t i = 0; i < n; i++)
        printf("%-10s %s\n", m[i].name, m[i].summary);
    return LUM_EXIT_OK;
}
