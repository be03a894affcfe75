#define _GNU_SOURCE /* getopt_long */
#include "server/cli/render_options.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/accel/accel.h"
#include "core/method/method.h"
#include "core/vpl/vpl.h"
#include "protocol/base/limits.h"
#include "server/base/suggest.h"
#include "server/cli/option_errors.h"
#include "server/world/apply.h"

#define MAX_FRAMES 1000000u
#define MAX_THREADS 1024u

const char lum_render_help[] =
    "usage: lumend render --scene NAME|FILE --out FILE.exr|.png [options]\n"
    "  --scene NAME|FILE    a built-in one (see: lumend scenes), a model, or a text file of edits, one JSON object a "
    "line\n"
    "                       (lumend scenes cornell prints one; protocol/PROTOCOL.md has every field)\n"
    "  --edits REPLAY       ops applied to the scene, of a .jsonl file or built in (see: lumend scenes); with "
    "--frames\n"
    "                       frame n, from 0, shows those with a t_ms of up to 1000 n / fps\n"
    "  --method M           see: lumend methods\n"
    "  --camera ID          a camera of the scene (default: that of its settings, which is the first in a model's "
    "file; else\n"
    "                       main, else the first by name)\n"
    "  --size WxH           default 600x400\n"
    "  --frames N           a sequence; --out then holds %04d\n"
    "  --fps F              frames per second of the sequence (default 30)\n"
    "  --spp N              samples a pixel (default 64, or as many as --time or --error take); of live the first is\n"
    "                       its fast frame, which path traced ones then refine\n"
    "  --time S             stop each frame after S seconds\n"
    "  --error E            stop each frame at this relative error\n"
    "  --effects-off A,B    effects to leave out, of: direct, soft_shadow, environment, indirect_diffuse, reflection,\n"
    "                       transmission, glossy, media, antialias\n"
    "  --effects-on A,B     effects to compute although nothing in the scene calls for them\n"
    "  --vpls N             virtual point lights, of methods that use them (default: the scene's)\n"
    "  --cache-accuracy A   error that records of a cache may have, 0.01 to 1: less is finer (default: the scene's)\n"
    "  --storage S          how threads share the records of a cache: serial, lock, local, waitfree (default: the "
    "scene's)\n"
    "  --exposure EV        of a PNG: EV100 from -40 to 40, higher is darker, or auto (default: the scene's)\n"
    "  --tone-map T         of a PNG: agx, aces, reinhard or none (default: the scene's)\n"
    "  --light-groups       a layer for each light group (EXR)\n"
    "  --threads N          default: all processors\n"
    "  --isa NAME           instruction set of the ray tracing: sse2, sse4.2, avx, avx2 or avx512 (default: that of\n"
    "                       $LUMEND_ISA, else the widest that this processor has); others round differently\n"
    "  --seed N             another draw of random numbers\n"
    "  --deterministic      the same pixels, bit for bit, for any number of threads\n"
    "  --assets DIR         where imported files are looked for (default: beside the scene)\n"
    "  --stats FILE.json    what each frame cost\n";

enum option_code {
    OPT_SCENE = 256,
    OPT_EDITS,
    OPT_OUT,
    OPT_METHOD,
    OPT_CAMERA,
    OPT_SIZE,
    OPT_FRAMES,
    OPT_FPS,
    OPT_SPP,
    OPT_TIME,
    OPT_ERROR,
    OPT_EFFECTS_OFF,
    OPT_EFFECTS_ON,
    OPT_VPLS,
    OPT_CACHE_ACCURACY,
    OPT_STORAGE,
    OPT_EXPOSURE,
    OPT_TONE_MAP,
    OPT_LIGHT_GROUPS,
    OPT_THREADS,
    OPT_ISA,
    OPT_SEED,
    OPT_DETERMINISTIC,
    OPT_ASSETS,
    OPT_STATS,
    OPT_HELP,
};

static const struct option long_options[] = {
    {"scene", required_argument, NULL, OPT_SCENE},
    {"edits", required_argument, NULL, OPT_EDITS},
    {"out", required_argument, NULL, OPT_OUT},
    {"method", required_argument, NULL, OPT_METHOD},
    {"camera", required_argument, NULL, OPT_CAMERA},
    {"size", required_argument, NULL, OPT_SIZE},
    {"frames", required_argument, NULL, OPT_FRAMES},
    {"fps", required_argument, NULL, OPT_FPS},
    {"spp", required_argument, NULL, OPT_SPP},
    {"time", required_argument, NULL, OPT_TIME},
    {"error", required_argument, NULL, OPT_ERROR},
    {"effects-off", required_argument, NULL, OPT_EFFECTS_OFF},
    {"effects-on", required_argument, NULL, OPT_EFFECTS_ON},
    {"vpls", required_argument, NULL, OPT_VPLS},
    {"cache-accuracy", required_argument, NULL, OPT_CACHE_ACCURACY},
    {"storage", required_argument, NULL, OPT_STORAGE},
    {"exposure", required_argument, NULL, OPT_EXPOSURE},
    {"tone-map", required_argument, NULL, OPT_TONE_MAP},
    {"light-groups", no_argument, NULL, OPT_LIGHT_GROUPS},
    {"threads", required_argument, NULL, OPT_THREADS},
    {"isa", required_argument, NULL, OPT_ISA},
    {"seed", required_argument, NULL, OPT_SEED},
    {"deterministic", no_argument, NULL, OPT_DETERMINISTIC},
    {"assets", required_argument, NULL, OPT_ASSETS},
    {"stats", required_argument, NULL, OPT_STATS},
    {"help", no_argument, NULL, OPT_HELP},
    {0},
};

static enum lum_status read_u32(const char *option, const char *text, uint32_t min, uint32_t max, uint32_t *ret,
                                struct lum_error *err)
{
    char *end;
    errno = 0;
    unsigned long v = strtoul(text, &end, 10);
    if (text[0] < '0' || text[0] > '9' || *end || errno || v < min || v > max)
        return lum_fail(err, LUM_ERR_INVALID, option, "--%s takes a whole number from %u to %u, not \"%.40s\"", option,
                        min, max, text);
    *ret = (uint32_t)v;
    return LUM_OK;
}

static enum lum_status read_positive(const char *option, const char *text, double *ret, struct lum_error *err)
{
    char *end;
    double v = strtod(text, &end);
    if (end == text || *end || !(v > 0.0) || !isfinite(v))
        return lum_fail(err, LUM_ERR_INVALID, option, "--%s takes a number above 0, not \"%.40s\"", option, text);
    *ret = v;
    return LUM_OK;
}

static enum lum_status read_size(const char *text, struct lum_render_options *o, struct lum_error *err)
{
    char w[16], h[16], rest;
    uint32_t rw = 0, rh = 0;
    if (sscanf(text, "%15[0-9]x%15[0-9]%c", w, h, &rest) != 2)
        return lum_fail(err, LUM_ERR_INVALID, "size", "--size takes WIDTHxHEIGHT, not \"%.40s\"", text);
    enum lum_status st = read_u32("size", w, LUM_LIMIT_VIEW_MIN, LUM_LIMIT_VIEW_SIDE, &rw, err);
    if (!st)
        st = read_u32("size", h, LUM_LIMIT_VIEW_MIN, LUM_LIMIT_VIEW_SIDE, &rh, err);
    if (!st && rw * rh > LUM_LIMIT_VIEW_PIXELS)
        st = lum_fail(err, LUM_ERR_LIMIT, "size", "--size takes at most %u pixels", LUM_LIMIT_VIEW_PIXELS);
    if (!st) {
        o->w = rw;
        o->h = rh;
    }
    return st;
}

static enum lum_status read_exposure(const char *text, struct lum_render_options *o, struct lum_error *err)
{
    char *end;
    double ev = strtod(text, &end);
    bool automatic = strcmp(text, "auto") == 0;
    if (!automatic && (end == text || *end || !(fabs(ev) <= LUM_LIMIT_VIEW_EV)))
        return lum_fail(err, LUM_ERR_INVALID, "exposure",
                        "--exposure takes auto or a number from %g to %g, not \"%.40s\"", -LUM_LIMIT_VIEW_EV,
                        LUM_LIMIT_VIEW_EV, text);
    o->has_exposure = true;
    o->exposure_ev = (struct lum_opt){.set = !automatic, .value = automatic ? 0.0 : ev};
    return LUM_OK;
}

static enum lum_status read_tone_map(const char *text, struct lum_render_options *o, struct lum_error *err)
{
    enum lum_tone_map tone;
    if (lum_apply_tone_map(text, &tone, NULL))
        return lum_fail(err, LUM_ERR_INVALID, "tone-map", "--tone-map takes agx, aces, reinhard or none, not \"%.40s\"",
                        text);
    o->tone_map = text;
    return LUM_OK;
}

/* Names with commas between them; added to *inout_bits. */
static enum lum_status read_effects(const char *option, const char *text, uint32_t *inout_bits, struct lum_error *err)
{
    uint32_t bits = 0;
    for (const char *name = text;; name++) {
        size_t n = strcspn(name, ",");
        enum lum_effect e;
        if (!lum_effect_find(name, n, &e)) {
            char given[41], near[LUM_NAMES_BYTES];
            snprintf(given, sizeof given, "%.*s", (int)n, name);
            lum_names_of_effect(given, near);
            return lum_fail(err, LUM_ERR_INVALID, option, "--%s: there is no effect \"%s\"%s", option, given, near);
        }
        bits |= LUM_EFFECT_BIT(e);
        name += n;
        if (!*name)
            break;
    }
    *inout_bits |= bits;
    return LUM_OK;
}

static enum lum_status read_accuracy(const char *text, double *ret, struct lum_error *err)
{
    char *end;
    const double min = 0.01, max = 1.0; /* as for scenes: protocol/record/fields.c */
    double a = strtod(text, &end);
    if (end == text || *end || !(a >= min && a <= max))
        return lum_fail(err, LUM_ERR_INVALID, "cache-accuracy",
                        "--cache-accuracy takes a number from %g to %g, not \"%.40s\"", min, max, text);
    *ret = a;
    return LUM_OK;
}

static enum lum_status read_storage(const char *text, struct lum_render_options *o, struct lum_error *err)
{
    if (!lum_storage_find(text, &o->storage))
        return lum_fail(err, LUM_ERR_INVALID, "storage",
                        "--storage takes serial, lock, local or waitfree, not \"%.40s\"", text);
    o->has_storage = true;
    return LUM_OK;
}

static enum lum_status take(int code, const char *text, struct lum_render_options *o, struct lum_error *err)
{
    switch (code) {
    case OPT_SCENE:
        o->scene = text;
        return LUM_OK;
    case OPT_EDITS:
        o->edits = text;
        return LUM_OK;
    case OPT_OUT:
        o->out = text;
        return LUM_OK;
    case OPT_METHOD:
        o->method = text;
        return lum_option_method("--method", text, err);
    case OPT_CAMERA:
        o->camera = text;
        return LUM_OK;
    case OPT_SIZE:
        return read_size(text, o, err);
    case OPT_FRAMES:
        return read_u32("frames", text, 1, MAX_FRAMES, &o->n_frames, err);
    case OPT_FPS:
        return read_positive("fps", text, &o->fps, err);
    case OPT_SPP:
        return read_u32("spp", text, 1, LUM_LIMIT_SPP, &o->spp, err);
    case OPT_TIME:
        return read_positive("time", text, &o->time_s, err);
    case OPT_ERROR:
        return read_positive("error", text, &o->error, err);
    case OPT_EFFECTS_OFF:
        return read_effects("effects-off", text, &o->effects_off, err);
    case OPT_EFFECTS_ON:
        return read_effects("effects-on", text, &o->effects_on, err);
    case OPT_VPLS:
        return read_u32("vpls", text, 1, LUM_VPL_MAX, &o->vpls, err);
    case OPT_CACHE_ACCURACY:
        return read_accuracy(text, &o->cache_accuracy, err);
    case OPT_STORAGE:
        return read_storage(text, o, err);
    case OPT_EXPOSURE:
        return read_exposure(text, o, err);
    case OPT_TONE_MAP:
        return read_tone_map(text, o, err);
    case OPT_LIGHT_GROUPS:
        o->light_groups = true;
        return LUM_OK;
    case OPT_THREADS:
        return read_u32("threads", text, 1, MAX_THREADS, &o->threads, err);
    case OPT_ISA:
        o->isa = text;
        return lum_isa_check("--isa", text, err);
    case OPT_SEED:
        o->has_seed = true;
        return read_u32("seed", text, 0, UINT32_MAX, &o->seed, err);
    case OPT_DETERMINISTIC:
        o->deterministic = true;
        return LUM_OK;
    case OPT_ASSETS:
        o->assets = text;
        return LUM_OK;
    case OPT_STATS:
        o->stats = text;
        return LUM_OK;
    default:
        o->help = true;
        return LUM_OK;
    }
}

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
        return lum_fail(err, LUM_ERR_INVALID, "scene", "--scene NAME|FILE is missing");
    if (!o->out)
        return lum_fail(err, LUM_ERR_INVALID, "out", "--out FILE.exr|.png is missing");
    const char *dot = strrchr(o->out, '.'), *end;
    o->exr = dot && strcmp(dot, ".exr") == 0;
    if (!o->exr && !(dot && strcmp(dot, ".png") == 0))
        return lum_fail(err, LUM_ERR_INVALID, "out", "--out must end in .exr or .png");
    if (o->n_frames > 1 && !find_directive(o->out, &end))
        return lum_fail(err, LUM_ERR_INVALID, "out", "--out must hold %%04d when --frames is above 1");
    if (o->light_groups && !o->exr)
        return lum_fail(err, LUM_ERR_INVALID, "light-groups", "--light-groups needs an .exr as --out");
    if (o->exr && (o->has_exposure || o->tone_map))
        return lum_fail(err, LUM_ERR_INVALID, "out", "--%s needs a .png as --out: an .exr holds light itself",
                        o->tone_map ? "tone-map" : "exposure");
    return check_effects(o, err);
}

enum lum_status lum_render_options_parse(int argc, char **argv, struct lum_render_options *ret_options,
                                         struct lum_error *err)
{
    struct lum_render_options o = {.fps = 30.0};
    optind = 0; /* GNU: start over, so that parsing twice in one process works */
    opterr = 0;
    for (int code, i = 0; (code = getopt_long(argc, argv, ":", long_options, &i)) != -1;) {
        if (code >= OPT_SCENE && !lum_option_is_whole(argv, long_options[i].name))
            return lum_fail(err, LUM_ERR_INVALID, "", "an option is abbreviated: write --%s", long_options[i].name);
        if (code == '?')
            return lum_option_unknown(argv[optind - 1], long_options, err);
        if (code == ':')
            return lum_fail(err, LUM_ERR_INVALID, "", "%.60s needs a value", argv[optind - 1]);
        enum lum_status st = take(code, optarg, &o, err);
        if (st)
            return st;
    }
    if (optind < argc)
        return lum_fail(err, LUM_ERR_INVALID, "", "unexpected argument %.60s (see: lumend render --help)",
                        argv[optind]);
    enum lum_status st = o.help ? LUM_OK : check(&o, err);
    if (!st)
        *ret_options = o;
    return st;
}

bool lum_render_frame_path(const char *out, uint32_t frame, char *ret_path, size_t n_path)
{
    const char *end, *p = find_directive(out, &end);
    int width = p ? (int)strtol(p + 1, NULL, 10) : 0;
    int n = p ? snprintf(ret_path, n_path, "%.*s%0*u%s", (int)(p - out), out, width, frame, end)
              : snprintf(ret_path, n_path, "%s", out);
    return n >= 0 && (size_t)n < n_path;
}
