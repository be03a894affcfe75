#include "server/cli/compare_options.h"

#include <string.h>

#include "protocol/base/nearest.h"
#include "server/cli/help.h"
#include "server/cli/option.h"

#define MULTIPLIER_MAX 1e9 /* either way: beyond any two units, and far from the ends of a float */

static const char usage[] = "usage: lumend compare A B [options]\n"
                            "How far A is from B, the reference; JSON on stdout. EXR files hold light, in cd/m2; PNG "
                            "files what a display shows.\n";

static const char metrics_help[] =
    "metrics:\n"
    "  relmse    mean((a - b)^2 / (b^2 + 0.01)) over R, G and B: noise where B is black makes it huge\n"
    "  rmse      root of mean((a - b)^2)\n"
    "  smape     mean(|a - b| / (|a| + |b| + 0.01)), 0 to 1\n"
    "  flip      how different they look when one flips between them, 0 to 1: mean over pixels, median weighted by "
    "error,\n"
    "            largest. EXR files are first exposed to fit B (ev100), tone mapped (AgX) and rounded to 8 bits\n"
    "  hdrflip   the largest flip of each pixel over exposures from the one that shows the brightest pixel of B to "
    "the\n"
    "            one that shows its median; EXR files only\n"
    "  hdrvdp    the probability that one who looks at such luminances sees a difference: percentages of pixels where "
    "it\n"
    "            is at least 75 and 95 % (p75_percent, p95_percent), and its mean; EXR files only\n"
    "  blocks    A over B by mean luminance of squares of 1/24 of the width (25 x 25 pixels at 600 x 400): bias shows\n"
    "            there, noise does not. mean is that of the whole pictures; median, percentiles, lowest and highest "
    "are\n"
    "            those of the squares; dark counts squares left out, below 1/512 of the mean of B. stderr is the "
    "relative\n"
    "            standard error that B itself has, of its mean and of its squares (median, 95 %): at most, from\n"
    "            differences of neighbours, or with --second as it is\n"
    "Values that are not finite are counted (nonfinite) and left out of relmse, rmse, smape and blocks. flip, hdrflip "
    "and\n"
    "hdrvdp, in which a pixel counts for its neighbours too, refuse them.\n";

static enum lum_status want_metric(struct lum_compare_options *o, const char *name, size_t n, bool is_first,
                                   struct lum_error *err)
{
    for (int i = 0; i < LUM_COMPARE_METRICS; i++)
        if (strlen(lum_compare_names[i]) == n && memcmp(name, lum_compare_names[i], n) == 0) {
            o->wanted[i] = true;
            if (is_first)
                o->first = (enum lum_compare_metric)i;
            return LUM_OK;
        }
    char given[41], near[128];
    snprintf(given, sizeof given, "%.*s", (int)n, name);
    lum_nearest_among(given, lum_compare_names, LUM_COMPARE_METRICS, near, sizeof near);
    return lum_fail(err, LUM_ERR_INVALID, "metric", "there is no metric \"%s\"%s", given, near);
}

static enum lum_status read_metrics(const struct lum_option_row *row, const char *given, const char *text,
                                    void *options, struct lum_error *err)
{
    struct lum_compare_options *o = options;
    (void)row;
    (void)given;
    memset(o->wanted, 0, sizeof o->wanted);
    for (const char *list = text;;) {
        size_t n = strcspn(list, ",");
        enum lum_status st = want_metric(o, list, n, list == text, err);
        if (st || !list[n])
            return st;
        list += n + 1;
    }
}

#define AT(m) .offset = offsetof(struct lum_compare_options, m)
#define TEXT(m) .kind = LUM_OPTION_TEXT, AT(m)
#define NUMBER(m, lo, hi) .kind = LUM_OPTION_NUMBER, AT(m), .min = lo, .max = hi

/* clang-format off */
static const struct lum_option_row rows[] = {
    {"metric", "LIST", .kind = LUM_OPTION_OTHER, .read = read_metrics, .help =
        "comma separated, of those below (default relmse,rmse,smape)"},
    {"heatmap", "F.png", TEXT(heatmap), .help =
        "where they differ: a map of the first metric of LIST if it is flip, hdrflip or hdrvdp,\n"
        "from 0, black, to 1, nearly white; else of relative squared error, black 0.0001 and less,\n"
        "white 1 and more. Cyan: not finite"},
    {"html", "F.html", TEXT(html), .help =
        "a page with both pictures, a wipe between them, maps of all metrics of LIST and the figures;\n"
        "it needs no other file"},
    {"second", "C.exr", TEXT(paths[LUM_COMPARE_SECOND]), .help =
        "the same picture as B, independent of it (another seed, as many samples): the reference is\n"
        "the mean of both, and what they differ by says how much noise it has"},
    {"pixels-per-degree", "N", NUMBER(pixels_per_degree, 1, LUM_FLIP_PIXELS_PER_DEGREE_MAX), .help =
        "from how far off one looks (default: of flip and hdrflip 67.02, 0.7 m from a display of\n"
        "3840 pixels on 0.7 m; of hdrvdp 29.79, 0.5 m from 1280 pixels on 0.375 m)"},
    {"multiplier", "N", NUMBER(multiplier, 1 / MULTIPLIER_MAX, MULTIPLIER_MAX), .help =
        "hdrvdp takes values times N for cd/m2 (default 1: pictures of lumend are in cd/m2)"},
    {"help", NULL, .kind = LUM_OPTION_SWITCH, AT(help), .help = "this"},
};
/* clang-format on */

enum lum_status lum_compare_options_parse(int argc, char **argv, struct lum_compare_options *ret_options,
                                          struct lum_error *err)
{
    struct lum_compare_options o = {
        .wanted = {[LUM_COMPARE_RELMSE] = true, [LUM_COMPARE_RMSE] = true, [LUM_COMPARE_SMAPE] = true},
        .multiplier = 1.0};
    struct lum_option_words words = {0};
    enum lum_status st = lum_option_parse(argc, argv, rows, LUM_ARRAY_LEN(rows), &words, NULL, &o, err);
    if (st)
        return st;
    if (!o.help && words.n != 2)
        return lum_fail(err, LUM_ERR_INVALID, "", "two pictures are needed, %zu given (see: lumend compare --help)",
                        words.n);
    o.paths[LUM_COMPARE_A] = words.list[0];
    o.paths[LUM_COMPARE_B] = words.list[1];
    *ret_options = o;
    return LUM_OK;
}

void lum_help_compare(const struct lum_help *h)
{
    lum_help_text(h, usage);
    lum_help_options(h, rows, LUM_ARRAY_LEN(rows));
    lum_help_text(h, metrics_help);
}
