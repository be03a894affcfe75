/* lumend export: a scene as a glTF file, without network. */
#include "server/cli/commands.h"
#include "server/cli/help.h"

#include <stdio.h>
#include <string.h>

#include "protocol/document/state.h"
#include "server/base/write_file.h"
#include "server/cli/load.h"
#include "server/cli/option.h"
#include "server/export/export.h"

struct options {
    const char *scene, *edits, *out, *assets;
    bool help;
};

#define TEXT(m) .kind = LUM_OPTION_TEXT, .offset = offsetof(struct options, m)

static const struct lum_option_row rows[] = {
    {"scene", "NAME|FILE", TEXT(scene),
     .help = "a built-in one (see: lumend scenes), a model, or a .jsonl file of edits"},
    {"edits", "REPLAY", TEXT(edits), .help = "ops applied to the scene before it is written"},
    {"out", "FILE.glb", TEXT(out), .help = "the file that is written"},
    {"assets", "DIR", TEXT(assets), .help = "where imported files are looked for (default: beside the scene)"},
    {"help", .kind = LUM_OPTION_SWITCH, .offset = offsetof(struct options, help), .help = "prints this"},
};

static bool ends_with_glb(const char *name)
{
    size_t n = strlen(name);
    return n > 4 && strcmp(name + n - 4, ".glb") == 0;
}

static enum lum_status parse(int argc, char **argv, struct options *ret_options, struct lum_error *err)
{
    struct options o = {0};
    enum lum_status st = lum_option_parse(argc, argv, rows, LUM_ARRAY_LEN(rows), NULL, NULL, &o, err);
    if (!st && !o.help && !o.scene)
        st = lum_fail(err, LUM_ERR_INVALID, "scene", "--scene NAME|FILE is missing (see: lumend export --help)");
    if (!st && !o.help && !o.out)
        st = lum_fail(err, LUM_ERR_INVALID, "out", "--out FILE.glb is missing (see: lumend export --help)");
    if (!st && o.out && !ends_with_glb(o.out))
        st = lum_fail(err, LUM_ERR_INVALID, "out", "--out must end in .glb, not '%.60s'", o.out);
    *ret_options = o;
    return st;
}

static enum lum_status write_scene(const struct lum_world *world, const char *path, struct lum_error *err)
{
    struct lum_document_state state = {0};
    struct lum_part_file file;
    struct lum_glb *glb = NULL;
    if (!lum_document_take_state(world->doc, &state))
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the scene's records");
    const struct lum_export_source source = {state.records, state.n_records, LUM_LIMIT_EXPORT_BYTES, NULL};
    enum lum_status st = lum_export_scene(&source, &glb, err);
    if (!st)
        st = lum_part_open(path, &file, err);
    if (!st) {
        st = lum_glb_write(glb, file.out, err);
        enum lum_status closed = lum_part_close(&file, !st, st ? NULL : err);
        st = st ? st : closed;
    }
    lum_glb_destroy(glb);
    lum_document_state_finish(&state);
    return st;
}

void lum_help_export(const struct lum_help *h)
{
    /* clang-format off */
    lum_help_text(h,
        "usage: lumend export --scene NAME|FILE --out FILE.glb [options]\n"
        "Writes the scene, with all edits, as a binary glTF 2.0 file: meshes, materials with their KHR extensions, textures,\n"
        "cameras, lamps, and webs of photometric lamps as IES files in it (EXT_lights_ies). Other programs show what glTF has\n"
        "words for; lamps with an area are points and spots to them. What it has none for (areas of lamps, fluxes, groups,\n"
        "sensors, fog, sky, presets, settings) is in `extras`, and lumend reads all of it back: the scene is then the same.\n"
        "Shapes become meshes, and meshes that no object shows are left out.\n");
    /* clang-format on */
    lum_help_options(h, rows, LUM_ARRAY_LEN(rows));
}

int lum_cmd_export(int argc, char **argv)
{
    struct options o;
    struct lum_error e;
    if (parse(argc, argv, &o, &e)) {
        fprintf(stderr, "lumend export: %s\n", e.text);
        return LUM_EXIT_USAGE;
    }
    if (o.help) {
        lum_help_export(&(struct lum_help){stdout, false});
        return LUM_EXIT_OK;
    }
    const struct lum_cli_scene what = {.scene = o.scene, .edits = o.edits, .assets = o.assets};
    struct lum_world world = {0};
    struct lum_proto_error err;
    const char *reading = NULL;
    int status = LUM_EXIT_FAILED;
    if (lum_may_write_file(o.out, &e))
        fprintf(stderr, "lumend export: %s\n", e.text);
    else if (!lum_cli_load(&world, &what, &reading, &err))
        fprintf(stderr, "lumend export: %s%s%s\n", reading ? reading : "", reading ? ": " : "", err.text);
    else if (write_scene(&world, o.out, &e))
        fprintf(stderr, "lumend export: %s: %s\n", o.out, e.text);
    else
        status = LUM_EXIT_OK;
    lum_world_finish(&world);
    return status;
}
