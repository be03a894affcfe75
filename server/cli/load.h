/* The scene of a subcommand that renders none: loaded, with edits applied. */
#ifndef LUM_SERVER_CLI_LOAD_H
#define LUM_SERVER_CLI_LOAD_H

#include "server/world/world.h"

struct lum_cli_scene {
    const char *scene, *edits, *assets; /* as of lum_render_options */
    const char *isa;
    uint32_t threads;
};
/* Into a zeroed world, which the caller finishes, also on failure. *ret_reading: the file that an error is about, or
 * NULL. */
bool lum_cli_load(struct lum_world *world, const struct lum_cli_scene *what, const char **ret_reading,
                  struct lum_proto_error *err);

#endif
