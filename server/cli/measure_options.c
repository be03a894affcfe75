#include "server/cli/measure_options.h"

#include <math.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/cli/help.h"
#include "server/cli/option.h"

#define READ(name)                                                                                                     \
    static enum lum_status name(const struct lum_option_row *row, const char *given, const char *text, void *options,  \
                                struct lum_error *err)

READ(read_area)
{
    struct lum_measure_options *o = options;
    double *a = o->area;
    char rest;
    if (sscanf(text, "%lf,%lf,%lf,%lf%c", &a[0], &a[1], &a[2], &a[3], &rest) != 4 ||
        !(isfinite(a[0]) && isfinite(a[1]) && a[2] > a[0] && a[3] > a[1] && isfinite(a[2]) && isfinite(a[3])))
        return lum_fail(err, LUM_ERR_INVALID, row->name,
                        "%s must be X0,Z0,X1,Z1 in metres with X0 < X1 and Z0 < Z1, not '%.60s'", given, text);
    o->has_area = true;
    return LUM_OK;
}

READ(read_height)
{
    const struct lum_option_row number = {
        .name = row->name, .kind = LUM_OPTION_NUMBER, .offset = row->offset, .min = row->min, .max = row->max};
    ((struct lum_measure_options *)options)->has_height = true;
    return lum_option_read(&number, given, text, options, err);
}

READ(read_border)
{
    const struct lum_option_row number = {
        .name = row->name, .kind = LUM_OPTION_NUMBER, .offset = row->offset, .min = row->min, .max = row->max};
    ((struct lum_measure_options *)options)->has_border = true;
    return lum_option_read(&number, given, text, options, err);
}

#define AT(m) .offset = offsetof(struct lum_measure_options, m)
#define TEXT(m) .kind = LUM_OPTION_TEXT, AT(m)
#define SWITCH(m) .kind = LUM_OPTION_SWITCH, AT(m)
#define POSITIVE(m) .kind = LUM_OPTION_POSITIVE, AT(m)
#define NUMBER(m, lo, hi) .kind = LUM_OPTION_NUMBER, AT(m), .min = lo, .max = hi
#define OTHER(f, m) .kind = LUM_OPTION_OTHER, .read = f, AT(m)

/* clang-format off */
static const struct lum_option_row rows[] = {
    {"scene", "NAME|FILE", TEXT(scene), .help =
        "a built-in one (see: lumend scenes), a model, or a .jsonl file of edits"},
    {"edits", "REPLAY", TEXT(edits), .help = "ops applied to the scene before it is measured"},
    {"area", "X0,Z0,X1,Z1", OTHER(read_area, area), .help =
        "what is measured, in metres (default: the floor of the whole scene, without the border)"},
    {"on", "ID", TEXT(on), .help = "the top of this object, such as a table, in place of an area"},
    {"height", "M", OTHER(read_height, height_m), .min = -1e6, .max = 1e6, .help =
        "above the floor, which is looked for downwards from the middle of the scene's height: the lowest\n"
        "that is met counts (default 0.75: a work plane; with --cylindrical\n"
        "and --ugr 1.2); with --on above the\n"
        "object's top (default 0.001)"},
    {"border", "M", OTHER(read_border, border_m), .min = 0, .max = 1e6, .help =
        "left out along the sides of the whole scene (default 0.5; with --on 0)"},
    {"spacing", "M", POSITIVE(spacing_m), .help =
        "between points, at most (default: by EN 12464-1, about 0.2 * 5^(log10 of the longer side))"},
    {"cylindrical", SWITCH(cylindrical), .help =
        "cylindrical illuminance, as light falls on faces, in place of that of a horizontal plane"},
    {"modelling", SWITCH(modelling), .help =
        "cylindrical illuminance, too, and its mean over that of the plane: 0.30 to 0.60 by EN 12464-1"},
    {"ugr", SWITCH(ugr), .help =
        "glare of eyes at the points, each looking all around: UGR of the line of sight that is glared most"},
    {"directions", "N", .kind = LUM_OPTION_WHOLE, AT(directions), .min = 1, .max = LUM_LIMIT_DIRECTIONS,
     .help = "with --ugr: lines of sight of each eye, evenly around, the first along -z (default 8)"},
    {"error", "E", .fallback = "0.01", NUMBER(error, 1e-5, 1), .help =
        "standard error over the value to which each point is measured (of dark ones over a tenth of\n"
        "the mean); of UGR that of its background, which it goes by the logarithm of: 0.04 at least"},
    {"target", "LX", POSITIVE(target_lx), .help =
        "the mean that is wanted, such as 500 for writing: said whether it is reached"},
    {"uniformity", "U", .kind = LUM_OPTION_NUMBER, AT(uniformity), .min = 1e-6, .max = 1, .help =
        "the least over the mean that is wanted, such as 0.6"},
    {"most-ugr", "U", .kind = LUM_OPTION_NUMBER, AT(most_ugr), .min = 1e-6, .max = 100, .help =
        "with --ugr: the most that is wanted, such as 19 for offices"},
    {"csv", "FILE", TEXT(csv), .help = "the points: x_m,y_m,z_m,lx,stderr_lx; empty where one is left out.\n"
        "Of sensors: sensor,quantity,x_m,y_m,z_m,value,stderr; with --modelling, --ugr: quantity,x_m, ..."},
    {"json", "FILE", TEXT(json), .help = "points and results"},
    {"html", "FILE", TEXT(html), .help = "a page to print: results, pictures, plans of the points, luminaires; one file"},
    {"pictures", "N", .fallback = "32", .kind = LUM_OPTION_WHOLE, AT(pictures_spp), .min = 0, .max = 4096, .help =
        "samples a pixel of the page's pictures; 0: none"},
    {"threads", "N", .kind = LUM_OPTION_WHOLE, AT(threads), .min = 1, .max = 1024, .help = "default: all processors"},
    {"isa", "NAME", OTHER(lum_option_read_isa, isa), .help = "instruction set of the ray tracing"},
    {"seed", "N", .kind = LUM_OPTION_WHOLE, AT(seed), .max = UINT32_MAX, .help = "another draw of random numbers"},
    {"assets", "DIR", TEXT(assets), .help = "where imported files are looked for (default: beside the scene)"},
    {"help", SWITCH(help), .help = "prints this"},
};
/* clang-format on */

enum lum_status lum_measure_options_parse(int argc, char **argv, struct lum_measure_options *ret_options,
                                          struct lum_error *err)
{
    struct lum_measure_options o = {.error = 0.01, .pictures_spp = 32};
    enum lum_status st = lum_option_parse(argc, argv, rows, LUM_ARRAY_LEN(rows), NULL, NULL, &o, err);
    if (!st && !o.help && !o.scene)
        st = lum_fail(err, LUM_ERR_INVALID, "scene", "--scene NAME|FILE is missing (see: lumend measure --help)");
    if (!st && o.on && o.has_area)
        st = lum_fail(err, LUM_ERR_INVALID, "on", "--on and --area both say what is measured");
    if (!st && o.cylindrical && o.modelling)
        st = lum_fail(err, LUM_ERR_INVALID, "modelling",
                      "--modelling measures cylinders already: leave --cylindrical out");
    if (!st && o.ugr && (o.cylindrical || o.modelling || o.target_lx > 0.0 || o.uniformity > 0.0))
        st = lum_fail(err, LUM_ERR_INVALID, "ugr",
                      "--ugr measures glare: leave --cylindrical, --modelling, --target and --uniformity out");
    if (!st && !o.ugr && o.most_ugr > 0.0)
        st = lum_fail(err, LUM_ERR_INVALID, "most-ugr", "--most-ugr is for --ugr");
    if (!st && !o.ugr && o.directions > 0)
        st = lum_fail(err, LUM_ERR_INVALID, "directions", "--directions is for --ugr");
    if (o.directions == 0)
        o.directions = 8;
    o.has_grid = o.ugr || o.on || o.has_area || o.has_height || o.has_border || o.spacing_m > 0.0 || o.cylindrical ||
                 o.modelling || o.target_lx > 0.0 || o.uniformity > 0.0;
    if (!o.has_height)
        o.height_m = o.on ? 0.001 : o.cylindrical || o.ugr ? 1.2 : 0.75;
    if (!o.has_border)
        o.border_m = o.on ? 0.0 : 0.5;
    if (!st)
        *ret_options = o;
    return st;
}

void lum_help_measure(const struct lum_help *h)
{
    /* clang-format off */
    lum_help_text(h,
        "usage: lumend measure --scene NAME|FILE [options]\n"
        "Prints what the sensors of the scene show (records of type sensor): illuminance, with its mean Em, least Emin\n"
        "and uniformity Uo = Emin / Em, or UGR and DGP, each +/- its standard error. Where the scene has none, or an option says\n"
        "where or what to measure, it is a grid of points over the floor. The power of the lamps that are on follows, in W,\n"
        "W/m2 and W/m2 for each 100 lx, with the lamps whose files do not say theirs. Light is path traced. Points inside furniture\n"
        "and walls, or with something less than 10 cm above, are left out, and said. Ends with 1 where a target is missed.\n");
    /* clang-format on */
    lum_help_options(h, rows, LUM_ARRAY_LEN(rows));
}
