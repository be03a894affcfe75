/* lumend scenes, lumend methods. */
#include "server/commands.h"

#include <stdio.h>
#include <string.h>

#include "core/method/method.h"
#include "server/embed.h"

static bool has_arguments(int argc, char **argv)
{
    if (argc > 1)
        fprintf(stderr, "lumend %s: takes no arguments\n", argv[0]);
    return argc > 1;
}

int lum_cmd_scenes(int argc, char **argv)
{
    if (has_arguments(argc, argv))
        return LUM_EXIT_USAGE;
    for (const struct lum_embedded *e = lum_embedded_scenes; e->key; e++)
        printf("%.*s\n", (int)strcspn(e->key, "."), e->key);
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
