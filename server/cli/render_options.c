#include "server/cli/render_options.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/trace/effect.h"
#include "core/vpl/vpl.h"
#include "protocol/base/limits.h"
#include "server/base/suggest.h"
#include "server/cli/help.h"
#include "server/cli/option.h"
#include "server/farm/farm.h"
#include "server/stream/overlay.h"
#include "server/world/apply.h"

#define READ(name)                                                                                                     \
    static enum lum_status name(const struct lum_option_row *row, const char *given, const char *text, void *options,  \
                                struct lum_error *err)

READ(read_size)
{
    struct lum_render_options *o = options;
    char w[16], h[16], rest;
    const struct lum_option_row side = {
        .name = row->name, .kind = LUM_OPTION_WHOLE, .min = LUM_LIMIT_VIEW_MIN, .max = LUM_LIMIT_VIEW_SIDE};
    if (sscanf(text, "%15[0-9]x%15[0-9]%c", w, h, &rest) != 2)
        return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be WIDTHxHEIGHT, not '%.40s'", given, text);
    enum lum_status st = lum_option_read(&side, given, w, &o->w, err);
    if (!st)
        st = lum_option_read(&side, given, h, &o->h, err);
    if (!st && o->w * o->h > LUM_LIMIT_VIEW_PIXELS)
        st = lum_fail(err, LUM_ERR_LIMIT, row->name, "%s must be at most %u pixels", given, LUM_LIMIT_VIEW_PIXELS);
    return st;
}

READ(read_seed)
{
    const struct lum_option_row number = {
        .name = row->name, .kind = LUM_OPTION_WHOLE, .offset = row->offset, .max = UINT32_MAX};
    ((struct lum_render_options *)options)->has_seed = true;
    return lum_option_read(&number, given, text, options, err);
}

READ(read_exposure)
{
    struct lum_render_options *o = options;
    char *end;
    double ev = strtod(text, &end);
    bool automatic = strcmp(text, "auto") == 0;
    if (!automatic && (end == text || *end || !(fabs(ev) <= LUM_LIMIT_VIEW_EV)))
        return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be auto or a number from %g to %g, not '%.40s'",
                        given, -LUM_LIMIT_VIEW_EV, LUM_LIMIT_VIEW_EV, text);
    o->has_exposure = true;
    o->exposure_ev = (struct lum_opt){.set = !automatic, .value = automatic ? 0.0 : ev};
    return LUM_OK;
}

READ(read_tone_map)
{
    struct lum_render_options *o = options;
    enum lum_tone_map tone;
    o->tone_map = text;
    if (!lum_apply_tone_map(text, &tone, NULL))
        return LUM_OK;
    return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be agx, aces, reinhard or none, not '%.40s'", given,
                    text);
}

READ(read_overlay)
{
    struct lum_render_options *o = options;
    o->overlay = text;
    if (lum_overlay_is_kind(text))
        return LUM_OK;
    return lum_fail(err, LUM_ERR_INVALID, row->name,
                    "%s must be luminance, illuminance, error, guidance_EFFECT or none, not '%.40s'", given, text);
}

/* Where a name is in a list that ends with NULL; else as many as it has. */
static uint32_t place_of(const char *text, const char *const *names)
{
    uint32_t i = 0;
    while (names[i] && strcmp(names[i], text) != 0)
        i++;
    return i;
}

READ(read_scale)
{
    struct lum_render_options *o = options;
    uint32_t i = place_of(text, lum_scale_kind_names);
    if (!lum_scale_kind_names[i])
        return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be log or linear, not '%.40s'", given, text);
    o->false_color.scale = (enum lum_scale_kind)i;
    o->has_false_color = true;
    return LUM_OK;
}

READ(read_palette)
{
    struct lum_render_options *o = options;
    uint32_t i = place_of(text, lum_palette_names);
    if (!lum_palette_names[i])
        return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be even or spectrum, not '%.40s'", given, text);
    o->false_color.palette = (enum lum_palette)i;
    o->has_false_color = true;
    return LUM_OK;
}

READ(read_isolines)
{
    static const char *const names[] = {"off", "on", "only", NULL};
    struct lum_render_options *o = options;
    uint32_t i = place_of(text, names);
    if (!names[i])
        return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be off, on or only, not '%.40s'", given, text);
    o->lines = i > 0;
    o->only_lines = i == 2;
    o->has_false_color = true;
    return LUM_OK;
}

READ(read_tev)
{
    struct lum_render_options *o = options;
    char here[32];
    snprintf(here, sizeof here, "127.0.0.1:%.16s", text);
    enum lum_status st = lum_address_parse(given, strchr(text, ':') ? text : here, &o->tev, err);
    if (!st && o->tev.port == 0)
        st = lum_fail(err, LUM_ERR_INVALID, row->name, "%s needs a port, such as tev's own, 14158", given);
    return st;
}

/* MIN..MAX, either of which may be left out. */
READ(read_range)
{
    struct lum_render_options *o = options;
    const char *dots = strstr(text, "..");
    char *end;
    double min = (double)NAN, max = (double)NAN;
    bool ok = dots != NULL;
    if (ok && dots > text) {
        min = strtod(text, &end);
        ok = end == dots || (end == dots + 1 && *dots == '.'); /* 100. is a number, too */
    }
    if (ok && dots[2]) {
        max = strtod(dots + 2, &end);
        ok = end > dots + 2 && !*end;
    }
    if (!ok || min < 0.0 || max <= 0.0 || max <= min || min > LUM_LIMIT_FALSE_COLOR || max > LUM_LIMIT_FALSE_COLOR ||
        (dots == text && !dots[2]))
        return lum_fail(err, LUM_ERR_INVALID, row->name,
                        "%s must be MIN..MAX, MIN.. or ..MAX with 0 <= MIN < MAX <= %g, not '%.40s'", given,
                        LUM_LIMIT_FALSE_COLOR, text);
    o->false_color.min = min;
    o->false_color.max = max;
    o->has_false_color = true;
    return LUM_OK;
}

READ(read_storage)
{
    struct lum_render_options *o = options;
    o->has_storage = true;
    if (lum_storage_find(text, &o->storage))
        return LUM_OK;
    return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be serial, lock, local or waitfree, not '%.40s'", given,
                    text);
}

/* Names with commas between them; added to the bits. */
READ(read_effects)
{
    uint32_t *bits = (uint32_t *)((char *)options + row->offset);
    for (const char *name = text;; name++) {
        size_t n = strcspn(name, ",");
        enum lum_effect e;
        if (!lum_effect_find(name, n, &e)) {
            char unknown[41], near[LUM_SUGGEST_BYTES];
            snprintf(unknown, sizeof unknown, "%.*s", (int)n, name);
            lum_suggest_effect(unknown, near);
            return lum_fail(err, LUM_ERR_INVALID, row->name, "%s: there is no effect \"%s\"%s", given, unknown, near);
        }
        *bits |= LUM_EFFECT_BIT(e);
        name += n;
        if (!*name)
            return LUM_OK;
    }
}

#define AT(m) .offset = offsetof(struct lum_render_options, m)
#define TEXT(m) .kind = LUM_OPTION_TEXT, AT(m)
#define SWITCH(m) .kind = LUM_OPTION_SWITCH, AT(m)
#define WHOLE(m, lo, hi) .kind = LUM_OPTION_WHOLE, AT(m), .min = lo, .max = hi
#define POSITIVE(m) .kind = LUM_OPTION_POSITIVE, AT(m)
#define OTHER(f, m) .kind = LUM_OPTION_OTHER, .read = f, AT(m)

/* clang-format off */
static const struct lum_option_row rows[] = {
    {"scene", "NAME|FILE", TEXT(scene), .help =
        "a built-in one (see: lumend scenes), a model, or a text file of edits, one JSON object a line\n"
        "(lumend scenes cornell prints one; protocol/PROTOCOL.md has every field)"},
    {"edits", "REPLAY", TEXT(edits), .help =
        "ops applied to the scene, of a .jsonl file or built in (see: lumend scenes); with --frames\n"
        "frame n, from 0, shows those with a t_ms of up to 1000 n / fps"},
    {"out", "FILE.exr|.png", TEXT(out), .help = "where the picture goes"},
    {"method", "M", OTHER(lum_option_read_method, method), .help = "see: lumend methods"},
    {"camera", "ID", TEXT(camera), .help =
        "a camera of the scene (default: that of its settings, which is the first in a model's\n"
        "file; else main, else the first by name)"},
    {"panorama", SWITCH(panorama), .help =
        "all around from where the camera is, in equal angles (equirectangular): its target is in the\n"
        "middle, seen level; its up is the upper edge. Twice as wide as high"},
    {"size", "WxH", OTHER(read_size, w), .help = "default 600x400; of a panorama 1200x600"},
    {"frames", "N", WHOLE(n_frames, 1, 1000000), .help = "a sequence; --out then holds %04d"},
    {"fps", "F", POSITIVE(fps), .help = "frames per second of the sequence (default 30)"},
    {"spp", "N", WHOLE(spp, 1, LUM_LIMIT_SPP), .help =
        "samples a pixel, of path and live (default 64, or as many as --time or --error take); of\n"
        "live the first is its fast frame, which path traced ones then refine. Other methods make a\n"
        "frame in one pass: --spp and --time have no effect on them"},
    {"time", "S", POSITIVE(time_s), .help =
        "of path and live: end each frame as near to S seconds as whole samples allow; the first is\n"
        "always made"},
    {"error", "E", POSITIVE(error), .help =
        "stop each frame once its relative error is below E with 95 % confidence; a frame that takes\n"
        "seconds says when that is expected. Exit status 3: the picture is there, but not within E,\n"
        "because --spp or --time ended it first, 64 samples found no light, or its method, other than\n"
        "path and live, adds no samples"},
    {"effects-off", "A,B", OTHER(read_effects, effects_off), .help =
        "effects to leave out, of those named below"},
    {"effects-on", "A,B", OTHER(read_effects, effects_on), .help =
        "effects to compute although nothing in the scene calls for them"},
    {"vpls", "N", WHOLE(vpls, 1, LUM_VPL_MAX), .help =
        "virtual point lights, of methods that use them (default: the scene's)"},
    {"cache-accuracy", "A", .kind = LUM_OPTION_NUMBER, AT(cache_accuracy), .min = 0.01, .max = 1, .help =
        "error that records of a cache may have, 0.01 to 1: less is finer (default: the scene's)"},
    {"storage", "S", OTHER(read_storage, storage), .help =
        "for study, how threads share the records of a cache: serial, lock, local or waitfree (the\n"
        "default)"},
    {"exposure", "EV", OTHER(read_exposure, exposure_ev), .help =
        "of a PNG: EV100 from -40 to 40, higher is darker, or auto (default: the scene's)"},
    {"tone-map", "T", OTHER(read_tone_map, tone_map), .help =
        "of a PNG: agx, aces, reinhard or none (default: the scene's)"},
    {"overlay", "MAP", OTHER(read_overlay, overlay), .help =
        "of a PNG: luminance, or illuminance of all surfaces, in false colour; or over the grey picture\n"
        "error (how far it is off, over the light around) or guidance_EFFECT (of ais: how often samples\n"
        "were refined). What its colours stand for is printed. (An .exr has the values: R G B, error.Y\n"
        "and guidance.EFFECT; with --illuminance that, too)"},
    {"scale", "S", OTHER(read_scale, false_color), .help =
        "of false colour: log (the default) or linear"},
    {"range", "MIN..MAX", OTHER(read_range, false_color), .help =
        "of false colour: ends of the scale in lx or cd/m2, either of which may be left out (default:\n"
        "as the picture has it)"},
    {"smooth", SWITCH(false_color.smooth), .help = "of false colour: without steps"},
    {"palette", "P", OTHER(read_palette, false_color), .help =
        "of false colour: even (the default: lighter is more, for all eyes) or spectrum"},
    {"isolines", "L", OTHER(read_isolines, lines), .help =
        "lines at the round values of the scale: off (the default), on, or only, over a grey picture.\n"
        "Left out where noise may move them to the next"},
    {"legend", SWITCH(legend), .help = "the scale of false colour is drawn at the right of the picture"},
    {"illuminance", SWITCH(illuminance), .help =
        "of an EXR: layers illuminance.Y, what falls on each surface in lx (0: none is there), and\n"
        "illuminance.error. A second picture, as exact, that --stats does not count"},
    {"light-groups", SWITCH(light_groups), .help = "a layer for each light group (EXR)"},
    {"threads", "N", WHOLE(threads, 1, 1024), .help = "default: all processors"},
    {"isa", "NAME", OTHER(lum_option_read_isa, isa), .help =
        "instruction set of the ray tracing: sse2, sse4.2, avx, avx2 or avx512 (default: that of\n"
        "$LUMEND_ISA, else the widest that this processor has); others round differently"},
    {"seed", "N", OTHER(read_seed, seed), .help = "another draw of random numbers (default: the scene's)"},
    {"deterministic", SWITCH(deterministic), .help = "the same pixels, bit for bit, for any number of threads"},
    {"assets", "DIR", TEXT(assets), .help = "where imported files are looked for (default: beside the scene)"},
    {"stats", "FILE.json", TEXT(stats), .help = "what each frame cost"},
    {"tev", "[HOST:]PORT", OTHER(read_tev, tev), .help =
        "shows pictures while they are made in tev, a viewer of HDR images that listens there (it does so\n"
        "at 14158 of this machine): in cd/m2, with all channels of an .exr. With --light-groups each frame is\n"
        "shown when it is done"},
    {"help", SWITCH(help), .help = "prints this"},
};
/* clang-format on */

/* The directive for the frame number in out: "%d" or "%04d". NULL: none. */
static const char *find_directive(const char *out, const char **ret_end)
{
    const char *p = strchr(out, '%');
    if (!p)
        return NULL;
    const char *q = p + 1;
    while (*q >= '0' && *q <= '9' && q - p <= 2)
        q++;
    if (*q != 'd')
        return NULL;
    *ret_end = q + 1;
    return p;
}

/* The first effect that is both left out and computed. */
static enum lum_status check_effects(const struct lum_render_options *o, struct lum_error *err)
{
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (o->effects_off & o->effects_on & LUM_EFFECT_BIT(e))
            return lum_fail(err, LUM_ERR_INVALID, "effects-on", "--effects-off and --effects-on both name %s",
                            lum_effect_names[e]);
    return LUM_OK;
}

static enum lum_status check(struct lum_render_options *o, struct lum_error *err)
{
    if (!o->scene)
        return lum_fail(err, LUM_ERR_INVALID, "scene", "--scene NAME|FILE is missing (see: lumend render --help)");
    if (!o->out)
        return lum_fail(err, LUM_ERR_INVALID, "out", "--out FILE.exr|.png is missing (see: lumend render --help)");
    const char *dot = strrchr(o->out, '.'), *end;
    o->exr = dot && strcmp(dot, ".exr") == 0;
    if (!o->exr && !(dot && strcmp(dot, ".png") == 0))
        return lum_fail(err, LUM_ERR_INVALID, "out", "--out must end in .exr or .png");
    if (o->n_frames > 1 && !find_directive(o->out, &end))
        return lum_fail(err, LUM_ERR_INVALID, "out", "--out must hold %%04d when --frames is above 1");
    if (o->light_groups && !o->exr)
        return lum_fail(err, LUM_ERR_INVALID, "light-groups", "--light-groups needs an .exr as --out");
    if (o->illuminance && !o->exr)
        return lum_fail(err, LUM_ERR_INVALID, "illuminance",
                        "--illuminance needs an .exr as --out: of a .png it is --overlay illuminance");
    if (o->exr && (o->has_exposure || o->tone_map || o->overlay))
        return lum_fail(err, LUM_ERR_INVALID, "out", "--%s needs a .png as --out: an .exr holds light itself",
                        o->tone_map  ? "tone-map"
                        : o->overlay ? "overlay"
                                     : "exposure");
    bool of_light = o->overlay && (strcmp(o->overlay, "luminance") == 0 || lum_overlay_is_illuminance(o->overlay));
    if ((o->has_false_color || o->false_color.smooth || o->legend) && !of_light)
        return lum_fail(err, LUM_ERR_INVALID, "overlay",
                        "--scale, --range, --smooth, --palette, --isolines and --legend need --overlay luminance or "
                        "illuminance");
    if (o->false_color.scale == LUM_SCALE_LOG && o->false_color.min == 0.0)
        return lum_fail(err, LUM_ERR_INVALID, "range",
                        "--range of a logarithmic scale must begin above 0, or needs --scale linear");
    return check_effects(o, err);
}

enum lum_status lum_render_options_parse(int argc, char **argv, struct lum_render_options *ret_options,
                                         struct lum_error *err)
{
    struct lum_render_options o = {.fps = 30.0, .false_color = {.min = (double)NAN, .max = (double)NAN}};
    enum lum_status st = lum_option_parse(argc, argv, rows, LUM_ARRAY_LEN(rows), NULL, NULL, &o, err);
    if (!st && !o.help)
        st = check(&o, err);
    if (!st)
        *ret_options = o;
    return st;
}

static void put_ranks(const struct lum_help *h)
{
    char mpi[LUM_FARM_VERSION_BYTES], text[sizeof mpi + 128];
    lum_farm_version(mpi);
    if (!mpi[0])
        return; /* built without */
    lum_help_text(
        h, "Ranks that one mpirun starts make the pictures together, the same that --deterministic makes: the\n");
    snprintf(text, sizeof text, "first reads the scene and writes the files. With %s, one for each machine:\n", mpi);
    lum_help_text(h, text);
    lum_help_text(h, "mpirun --map-by ppr:1:node --bind-to none lumend render --scene office --out office.exr\n");
}

void lum_help_render(const struct lum_help *h)
{
    char effects[512] = "effects:";
    size_t n = strlen(effects);
    lum_help_text(h, "usage: lumend render --scene NAME|FILE --out FILE.exr|.png [options]\n");
    lum_help_options(h, rows, LUM_ARRAY_LEN(rows));
    for (int e = 0; e < LUM_EFFECT_COUNT && n < sizeof effects; e++)
        n += (size_t)snprintf(effects + n, sizeof effects - n, " %s%s", lum_effect_names[e],
                              e + 1 < LUM_EFFECT_COUNT ? "," : "\n");
    lum_help_text(h, effects);
    put_ranks(h);
}

bool lum_render_frame_path(const char *out, uint32_t frame, char *ret_path, size_t n_path)
{
    const char *end, *p = find_directive(out, &end);
    int width = p ? (int)strtol(p + 1, NULL, 10) : 0;
    int n = p ? snprintf(ret_path, n_path, "%.*s%0*u%s", (int)(p - out), out, width, frame, end)
              : snprintf(ret_path, n_path, "%s", out);
    return n >= 0 && (size_t)n < n_path;
}
