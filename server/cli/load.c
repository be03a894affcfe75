#include "server/cli/load.h"

#include <stdio.h>

#include "server/import/expand.h"
#include "server/world/apply.h"
#include "server/world/scene_source.h"

static void log_to_stderr(void *user, int level, const char *component, const char *text)
{
    (void)user;
    if (level > 0 && level <= 2) /* errors are told once, at the end */
        fprintf(stderr, "lumend: %s: %s\n", component, text);
}

static bool apply_edits(struct lum_world *world, struct lum_ops *edits, const struct lum_import_config *import,
                        struct lum_proto_error *err)
{
    struct lum_expansion expansion = {0};
    struct lum_changes changes;
    struct lum_error e;
    if (lum_ops_need_import(edits) &&
        !lum_ops_expand(&(struct lum_expand_context){.config = import}, edits, &expansion, err))
        return false;
    struct lum_edit edit = {"(edits)", edits, expansion.children, expansion.n};
    bool ok = lum_world_apply(world, &edit, &changes, err);
    if (ok)
        lum_changes_finish(&changes);
    lum_expansion_finish(&expansion);
    return ok && (!lum_world_commit(world, &e) || lum_apply_error(&e, "", err));
}

bool lum_cli_load(struct lum_world *world, const struct lum_cli_scene *what, const char **ret_reading,
                  struct lum_proto_error *err)
{
    struct lum_log log = {log_to_stderr, NULL};
    struct lum_import_config import = {.assets_dir = what->assets, .log = log};
    struct lum_ops edits = {0};
    struct lum_error e;
    *ret_reading = NULL;
    if (lum_world_init(world, what->threads, what->isa, &log, &e))
        return lum_apply_error(&e, "", err);
    *ret_reading = what->scene;
    if (!lum_scene_load(world, what->scene, &import, err))
        return false;
    *ret_reading = what->edits;
    bool ok = !what->edits || (lum_edits_load(what->edits, &edits, err) && apply_edits(world, &edits, &import, err));
    lum_ops_finish(&edits);
    if (ok)
        *ret_reading = NULL;
    return ok;
}
