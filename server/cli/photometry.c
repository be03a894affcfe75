/* lumend photometry: what a photometric file says, read as a scene would read it. */
#include "server/world/photometry.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/cli/help.h"
#include "server/import/import.h"

static const char help[] =
    "usage: lumend photometry FILE... [--ugr] [--json]\n"
    "Reads IES LM-63 files (1986 to 2019) and EULUMDAT files (.ldt) as a light of kind ies does, and tells what they "
    "say:\n"
    "light, power, the brightest direction, beam and field angles, symmetry and opening. A file that is refused is "
    "named\n"
    "with its line, and the exit status is 1.\n"
    "\n"
    "  --ugr     glare, too, as catalogues print it: UGR of 19 rooms that are full of this luminaire, a quarter of H "
    "apart,\n"
    "            where H is its height above the eye (CIE 117 and 190, 'corrected': for the light that the file says)\n"
    "  --json    one JSON object a line instead: \"file\", the members of `photometry` in protocol/PROTOCOL.md, "
    "warnings; or\n"
    "            \"file\" and \"error\"\n"
    "\n"
    "  light     the integral of the intensities: what the lamp gives in a scene. That it differs from what its lamps "
    "are\n"
    "            rated for is no fault: fittings absorb light. That it is more, is odd\n"
    "  beam      angle between the outermost directions with half of the largest intensity, along c 0 - c 180 and "
    "across;\n"
    "            field: with a tenth\n"
    "  glare     UGR of the room by which luminaires are compared, 4H by 8H that reflects 70, 50 and 20 %: crosswise, "
    "with\n"
    "            the luminaire's length across the line of sight, and endwise\n";

static double number_of(const cJSON *o, const char *name)
{
    const cJSON *n = cJSON_GetObjectItemCaseSensitive(o, name);
    return cJSON_IsNumber(n) ? n->valuedouble : 0.0;
}

static double item_of(const cJSON *o, const char *name, int i)
{
    const cJSON *n = cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(o, name), i);
    return cJSON_IsNumber(n) ? n->valuedouble : 0.0;
}

static const char *text_of(const cJSON *o, const char *name)
{
    const char *s = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(o, name));
    return s ? s : "";
}

static void print_facts(const char *file, const cJSON *o)
{
    double flux = number_of(o, "flux_lm"), rated = number_of(o, "rated_lm"), watts = number_of(o, "watts");
    const char *opening = text_of(o, "opening");
    printf("%s%s%s\n", file, text_of(o, "name")[0] ? ": " : "", text_of(o, "name"));
    printf("  light     %.1f lm", flux);
    if (rated > 0.0)
        printf(", of lamps rated for %.1f lm (%.1f %%)", rated, 100.0 * flux / rated);
    printf("; %.1f %% upwards\n", 100.0 * number_of(o, "up"));
    if (watts > 0.0)
        printf("  power     %.1f W, %.1f lm/W\n", watts, number_of(o, "lm_per_w"));
    printf("  peak      %.1f cd at c %.1f, gamma %.1f degrees\n", number_of(o, "peak_cd"), number_of(o, "peak_c_deg"),
           number_of(o, "peak_gamma_deg"));
    printf("  beam      %.1f x %.1f degrees, field %.1f x %.1f\n", item_of(o, "beam_deg", 0), item_of(o, "beam_deg", 1),
           item_of(o, "field_deg", 0), item_of(o, "field_deg", 1));
    printf("  symmetry  %s\n", text_of(o, "symmetry"));
    if (strcmp(opening, "point") == 0)
        printf("  opening   a point\n");
    else
        printf("  opening   %s, %.3f x %.3f x %.3f m\n", opening, item_of(o, "size", 0), item_of(o, "size", 1),
               item_of(o, "size", 2));
    if (cJSON_HasObjectItem(o, "ugr"))
        printf("  glare     UGR %.1f crosswise, %.1f endwise, in a room of 4H by 8H, 70/50/20\n", item_of(o, "ugr", 0),
               item_of(o, "ugr", 1));
    printf("  measured  type %s, %.0f x %.0f intensities\n", text_of(o, "type"), number_of(o, "planes"),
           number_of(o, "angles"));
}

static void print_cells(const cJSON *room, const char *view)
{
    const cJSON *cell;
    cJSON_ArrayForEach(cell, cJSON_GetObjectItemCaseSensitive(room, view))
    {
        if (cJSON_IsNumber(cell))
            printf("%7.1f", cell->valuedouble);
        else
            printf("%7s", "-");
    }
}

static void print_ugr(const cJSON *ugr)
{
    const cJSON *room, *paint, *paints = cJSON_GetObjectItemCaseSensitive(ugr, "reflectances");
    if (!paints) {
        puts("  UGR       not known: the file names no opening that shines");
        return;
    }
    printf("\n  UGR, luminaires %.2f H apart   crosswise                             endwise\n",
           number_of(ugr, "spacing_h"));
    static const char *const surfaces[3] = {"ceiling", "walls", "floor"};
    for (int k = 0; k < 3; k++) {
        printf("  %-12s", surfaces[k]);
        for (int view = 0; view < 2; view++) {
            printf("%s", view ? "   " : "");
            cJSON_ArrayForEach(paint, paints) printf("%6.0f%%", 100.0 * cJSON_GetArrayItem(paint, k)->valuedouble);
        }
        puts("");
    }
    cJSON_ArrayForEach(room, cJSON_GetObjectItemCaseSensitive(ugr, "rooms"))
    {
        printf("  %2.0fH x %2.0fH   ", item_of(room, "size_h", 0), item_of(room, "size_h", 1));
        print_cells(room, "crosswise");
        printf("   ");
        print_cells(room, "endwise");
        puts("");
    }
    puts("");
}

/* Takes o over. */
static bool print_json(const char *file, cJSON *o, const struct lum_import_result *result, const char *error)
{
    cJSON *line = cJSON_CreateObject(), *warnings = cJSON_CreateArray();
    bool ok = lum_json_add_string(line, "file", file);
    if (error)
        ok = ok && lum_json_add_string(line, "error", error);
    while (o && o->child) {
        cJSON *member = cJSON_DetachItemViaPointer(o, o->child);
        ok = lum_json_add(line, member->string, member) && ok;
    }
    for (size_t i = 0; i < result->n_warnings; i++)
        lum_json_add(warnings, NULL, cJSON_CreateString(result->warnings[i]));
    if (!error)
        ok = lum_json_add(line, "warnings", warnings) && ok;
    else
        cJSON_Delete(warnings);
    char *text = ok ? lum_json_print(line, NULL) : NULL;
    ok = text && puts(text) >= 0;
    free(text);
    cJSON_Delete(line);
    cJSON_Delete(o);
    return ok;
}

/* The folder of the file is its asset folder. */
static bool read_file(const char *file, struct lum_record **ret_light, struct lum_import_result *ret_result,
                      struct lum_proto_error *err)
{
    const char *slash = strrchr(file, '/'), *name = slash ? slash + 1 : file;
    char dir[4096];
    struct lum_record *light = lum_record_create(LUM_RECORD_LIGHT, "lamp");
    if (!light)
        return lum_proto_fail_memory(err);
    bool fits = strlen(name) < sizeof light->light.asset && strlen(file) < sizeof dir;
    if (fits) {
        snprintf(dir, sizeof dir, "%.*s", slash ? (int)(slash - file) + 1 : 1, slash ? file : ".");
        memcpy(light->light.asset, name, strlen(name) + 1);
    }
    struct lum_import_config config = {.assets_dir = dir};
    bool ok =
        fits ? lum_import_web(&config, light, NULL, ret_light, ret_result, err)
             : lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "asset", "%.60s: the name is too long", file);
    lum_record_unref(light);
    return ok;
}

struct how {
    bool json, ugr;
};

static bool tell(const char *file, const struct how *how)
{
    struct lum_record *light = NULL;
    struct lum_import_result result = {0};
    struct lum_proto_error err = {0};
    cJSON *o = NULL, *ugr = NULL;
    bool read = read_file(file, &light, &result, &err);
    if (read)
        o = lum_photometry_describe(light->light.web, false, true);
    if (o && how->ugr && ((ugr = lum_photometry_ugr(light->light.web)) == NULL || !lum_json_add(o, "ugr_table", ugr))) {
        cJSON_Delete(o);
        o = NULL;
    }
    bool ok = o != NULL;
    if (read && !o)
        lum_proto_fail_memory(&err);
    if (!ok)
        fprintf(stderr, "lumend photometry: %s\n", err.text);
    if (how->json) {
        ok = print_json(file, o, &result, ok ? NULL : err.text) && ok;
    } else if (ok) {
        print_facts(file, o);
        if (ugr)
            print_ugr(ugr);
        for (size_t i = 0; i < result.n_warnings; i++)
            printf("  note      %s\n", result.warnings[i]);
        cJSON_Delete(o);
    }
    lum_record_unref(light);
    lum_import_result_finish(&result);
    return ok && fflush(stdout) == 0;
}

void lum_help_photometry(const struct lum_help *h)
{
    lum_help_text(h, help);
}

int lum_cmd_photometry(int argc, char **argv)
{
    struct how how = {0};
    bool ok = true;
    int n_files = 0;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            lum_help_photometry(&(struct lum_help){stdout, false});
            return LUM_EXIT_OK;
        }
        if (strcmp(argv[i], "--json") == 0) {
            how.json = true;
        } else if (strcmp(argv[i], "--ugr") == 0) {
            how.ugr = true;
        } else if (argv[i][0] == '-') {
            fprintf(stderr, "lumend photometry: no option '%.60s' (see: lumend photometry --help)\n", argv[i]);
            return LUM_EXIT_USAGE;
        } else {
            n_files++;
        }
    }
    if (n_files == 0) {
        fprintf(stderr, "lumend photometry: needs a file (see: lumend photometry --help)\n");
        return LUM_EXIT_USAGE;
    }
    for (int i = 1; i < argc; i++)
        if (argv[i][0] != '-')
            ok = tell(argv[i], &how) && ok;
    return ok ? LUM_EXIT_OK : LUM_EXIT_FAILED;
}
