#define _GNU_SOURCE
#include "tests/bench/bench.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/math/sampler.h"
#include "server/world/scene_source.h"
#include "tests/bench/plot.h"
#include "tests/bench/variants.h"

static const struct lum_bench benches[] = {
    {"rays", "rays per second against raw Embree traversal on the same scene", "cornell", lum_bench_rays},
    {"stream", "edit to first frame, as percentiles, through a real daemon and client", "cornell", lum_bench_stream},
    {"stride", "what a pixel costs when only every n-th is rendered, by packets and by single rays", NULL,
     lum_bench_stride},
    {"accuracy", "what accuracy costs in time: error over time of every method and setting; when path is as good", NULL,
     lum_bench_accuracy},
    {"ais", "adaptive interleaved sampling against its maximum, IGI and live: frame rates, errors, rays", NULL,
     lum_bench_ais},
    {"instant", "instant caching, and temporal, against IGI and live: first frames, animations, errors, rays", NULL,
     lum_bench_instant},
    {"growth", "the same as VPLs, records, moving objects, triangles and pixels become more", NULL, lum_bench_growth},
    {"budgets", "are --error and --time kept, and was it foreseen; every scene, several seeds", NULL,
     lum_bench_budgets},
    {"codecs", "bytes, time and error of tiles as JPEG, WebP and PNG; first frames of every scene", NULL,
     lum_bench_codecs},
    {"drag", "does a view whose eye is dragged keep its time, by CPU time; what was foreseen beside what came", NULL,
     lum_bench_drag},
    {"video", "bytes, time and error of pictures of a drag as VP9, for lines of several widths", NULL, lum_bench_video},
    {"effects", "what each effect costs, in every subset that a scene calls for; what methods leave out", NULL,
     lum_bench_effects},
    {"errors", "does the error that pictures state cover the one that they have; every scene, method, 30 seeds", NULL,
     lum_bench_errors},
    {"irrcache", "storages of the shared irradiance cache by threads: frames, turns of the camera, lookups", NULL,
     lum_bench_irrcache},
    {"rest", "errors of a view at rest after 0 to 32 samples, over several draws: does any of them rise with time",
     NULL, lum_bench_rest},
    {"settings", "what each setting gives in time while something moves, for what error, beside rough passes", NULL,
     lum_bench_settings},
    {"truth", "how right the light is: first frames, moving, at rest, each effect; by blocks, against path", NULL,
     lum_bench_truth_study},
    {"viewers", "what the k-th viewer of a room pays on one cache, against a daemon for each; memory", NULL,
     lum_bench_viewers},
    {"vision", "what of each method's error somebody sees: HDR-VDP and HDR-FLIP, antialiased and not", NULL,
     lum_bench_vision},
    {"export", "the scene's geometry as OBJ, for comparison with other renderers", "cornell", lum_bench_export},
};

static int usage(FILE *to, int status)
{
    fprintf(
        to,
        "usage: lumend-bench STUDY --out DIR [--quick] [--scene NAME|FILE] [--references DIR] "
        "[--reference-spp N] [--single-rays]\n"
        "                    [--camera ID] [--methods LIST] [--seconds MAX] [--models DIR] [--seeds N] [--size WxH]\n"
        "                    [--rounds N]\n\n"
        "studies:\n");
    for (size_t i = 0; i < LUM_ARRAY_LEN(benches); i++)
        fprintf(to, "  %-10s %s\n", benches[i].name, benches[i].summary);
    fprintf(
        to,
        "\n--quick shows that a study works; its figures are not for quoting.\n"
        "--references keeps the path-traced pictures that errors are measured against, for the next time: they take\n"
        "most of the time of ais and instant. One that no longer fits the scene or the program is made anew.\n"
        "--reference-spp: samples a pixel that they have at most, a power of two from 2 to 65536 (default 128, 16\n"
        "with --quick). With few the noise of dark pixels counts in relMSE, whose weights are those of the reference.\n"
        "truth takes a kept one with more samples than that, too.\n"
        "--camera, --methods, --seconds and --models are for truth: through which camera of --scene (an id, or its\n"
        "end); which methods (default live,path); how long a scene rests at most, in seconds of a machine of its own\n"
        "(default 30); where third-party models are looked for (default ../shared/scenes), which are skipped where\n"
        "absent.\n"
        "--methods (default all of them; of budgets live,path; of drag live), --models and --seeds (1 to 30) are for\n"
        "errors, budgets, settings, rest and accuracy, too; the first two also for drag and vision; so is --seconds\n"
        "for accuracy: how long samples are added; and for budgets: how long a run is waited for.\n"
        "--size: of the pictures of accuracy, ais, budgets, drag, errors, instant, irrcache, rest, settings, stride\n"
        "and vision, 16 to 4096 a side, as 300x200; of stride the second number, which is to be a power of two, alone\n"
        "counts.\n"
        "--rounds: how often ais, instant, irrcache and stride repeat themselves at most, 1 to 15; animations are of\n"
        "20 frames a round.\n"
        "--scene may also be one of these variants of built-in scenes:\n");
    lum_bench_print_variants(to);
    fprintf(to,
            "--single-rays has ais and instant trace rays one by one, as the thesis does, and not in packets of 16.\n");
    return status;
}

void lum_bench_size(const struct lum_bench_options *options, const uint32_t whole[2], const uint32_t quick[2],
                    struct lum_view_settings *inout_settings)
{
    const uint32_t *size = options->quick ? quick : whole;
    inout_settings->w = options->w ? options->w : size[0];
    inout_settings->h = options->h ? options->h : size[1];
}

uint32_t lum_bench_rounds(const struct lum_bench_options *options, uint32_t whole, uint32_t quick)
{
    uint32_t n = options->quick ? quick : whole;
    return options->rounds && options->rounds < n ? options->rounds : n;
}

void lum_bench_progress(const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    vfprintf(stderr, fmt, args);
    va_end(args);
    fputc('\n', stderr);
}

bool lum_bench_failed(const char *text)
{
    fprintf(stderr, "lumend-bench: %s\n", text);
    return false;
}

bool lum_bench_open_view(struct lum_pool *pool, struct lum_view **ret_view, struct lum_caches **ret_caches)
{
    struct lum_error err = {0};
    if (lum_view_create(pool, ret_view, &err) != LUM_OK ||
        lum_caches_create(lum_pool_size(pool), ret_caches, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    lum_view_share(*ret_view, *ret_caches);
    return true;
}

FILE *lum_bench_open(const struct lum_bench_options *options, const char *name)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", options->out, name);
    FILE *f = fopen(path, "w");
    if (!f)
        fprintf(stderr, "lumend-bench: cannot write %s: %s\n", path, strerror(errno));
    return f;
}

bool lum_bench_close(FILE *f, const char *name)
{
    bool ok = !ferror(f);
    ok = fclose(f) == 0 && ok;
    if (!ok)
        fprintf(stderr, "lumend-bench: cannot write %s: %s\n", name, strerror(errno));
    return ok;
}

bool lum_bench_plot(const struct lum_bench_options *options, const char *name, const struct lum_plot *plot,
                    const char *machine)
{
    char subtitle[768];
    struct lum_plot made = *plot;
    snprintf(subtitle, sizeof subtitle, "%s. %s%s", plot->subtitle, machine, options->quick ? LUM_BENCH_QUICK : "");
    made.subtitle = subtitle;
    FILE *f = lum_bench_open(options, name);
    if (!f)
        return false;
    lum_plot_write(f, &made);
    return lum_bench_close(f, name);
}

bool lum_bench_world(const char *scene, uint32_t threads, struct lum_world *ret_world)
{
    struct lum_error err = {0};
    struct lum_proto_error perr = {0};
    struct lum_import_config import = {0};
    memset(ret_world, 0, sizeof *ret_world);
    if (lum_world_init(ret_world, threads, NULL, NULL, &err) != LUM_OK) {
        fprintf(stderr, "lumend-bench: %s\n", err.text);
        return false;
    }
    if (lum_scene_load(ret_world, lum_bench_variant_base(scene), &import, &perr) &&
        lum_bench_vary(ret_world, scene, &perr))
        return true;
    fprintf(stderr, "lumend-bench: %s: %s\n", scene, perr.text);
    lum_world_finish(ret_world);
    return false;
}

const char *lum_bench_scene_name(const char *scene)
{
    const char *slash = strrchr(scene, '/');
    return slash ? slash + 1 : scene;
}

void lum_bench_machine(const struct lum_world *world, char *ret_text, size_t size)
{
    char line[256], name[128] = "unknown processor";
    FILE *f = fopen("/proc/cpuinfo", "r");
    while (f && fgets(line, sizeof line, f))
        if (sscanf(line, "model name : %127[^\n]", name) == 1)
            break;
    if (f)
        fclose(f);
    uint32_t n = lum_pool_size(world->pool);
    snprintf(ret_text, size, "%s, %u thread%s, %s%s", name, n, n == 1 ? "" : "s", lum_device_isa(world->device),
             lum_device_traces_singly(world->device) ? ", rays one by one" : "");
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double lum_bench_quantile(double *values, size_t n, double q)
{
    if (n == 0)
        return 0.0;
    qsort(values, n, sizeof *values, compare_doubles);
    double at = q * (double)(n - 1);
    size_t i = (size_t)at;
    return i + 1 < n ? values[i] + (at - (double)i) * (values[i + 1] - values[i]) : values[n - 1];
}

double lum_bench_median_of(const double *values, size_t n)
{
    double copy[LUM_BENCH_SAMPLES];
    n = n < LUM_BENCH_SAMPLES ? n : LUM_BENCH_SAMPLES;
    for (size_t i = 0; i < n; i++)
        copy[i] = values[i];
    return n ? lum_bench_quantile(copy, n, 0.5) : (double)NAN;
}

struct lum_bench_median lum_bench_bootstrap(double *values, size_t n)
{
    enum { RESAMPLES = 2000 };
    static double medians[RESAMPLES];
    double draw[LUM_BENCH_SAMPLES];
    uint32_t seed = 1;
    n = n < LUM_BENCH_SAMPLES ? n : LUM_BENCH_SAMPLES;
    if (n == 0)
        return (struct lum_bench_median){(double)NAN, (double)NAN, (double)NAN};
    for (size_t r = 0; r < RESAMPLES; r++) {
        for (size_t i = 0; i < n; i++)
            draw[i] = values[(seed = lum_hash_u32(seed + (uint32_t)i)) % n];
        medians[r] = lum_bench_quantile(draw, n, 0.5);
    }
    return (struct lum_bench_median){
        .median = lum_bench_quantile(values, n, 0.5),
        .lo = lum_bench_quantile(medians, RESAMPLES, 0.025),
        .hi = lum_bench_quantile(medians, RESAMPLES, 0.975),
    };
}

struct lum_bench_median lum_bench_ratio(const double *numerator, const double *denominator, size_t n)
{
    double ratios[LUM_BENCH_SAMPLES];
    n = n < LUM_BENCH_SAMPLES ? n : LUM_BENCH_SAMPLES;
    for (size_t i = 0; i < n; i++)
        ratios[i] = numerator[i] / denominator[i];
    return lum_bench_bootstrap(ratios, n);
}

/* The directory of the running program, where the others are too. */
static bool own_directory(char *ret_dir, size_t size)
{
    ssize_t n = readlink("/proc/self/exe", ret_dir, size - 1);
    if (n <= 0)
        return false;
    ret_dir[n] = 0;
    char *slash = strrchr(ret_dir, '/');
    if (slash)
        *slash = 0;
    return slash != NULL;
}

static bool make_directory(const char *path)
{
    if (mkdir(path, 0777) == 0 || errno == EEXIST)
        return true;
    fprintf(stderr, "lumend-bench: cannot make %s: %s\n", path, strerror(errno));
    return false;
}

static bool read_spp(const char *text, uint32_t *ret_spp)
{
    char *end;
    unsigned long n = strtoul(text, &end, 10);
    *ret_spp = (uint32_t)n;
    return *text >= '0' && *text <= '9' && *end == 0 && n >= 2 && n <= 65536 && (n & (n - 1)) == 0;
}

static bool read_seconds(const char *text, double *ret_seconds)
{
    char *end;
    *ret_seconds = strtod(text, &end);
    return end != text && *end == 0 && *ret_seconds > 0.0 && *ret_seconds <= 3600.0;
}

static bool read_count(const char *text, uint32_t most, uint32_t *ret_n)
{
    char *end;
    unsigned long n = strtoul(text, &end, 10);
    *ret_n = (uint32_t)n;
    return end != text && *end == 0 && n >= 1 && n <= most;
}

static bool read_size(const char *text, struct lum_bench_options *o)
{
    int end = 0;
    return sscanf(text, "%4ux%4u%n", &o->w, &o->h, &end) == 2 && text[end] == 0 && o->w >= 16 && o->w <= 4096 &&
           o->h >= 16 && o->h <= 4096;
}

/* Exit status; 0: go on. */
static int read_value(struct lum_bench_options *o, const char *option, const char *value)
{
    const struct {
        const char *option, **text;
    } texts[] = {{"--out", &o->out},       {"--scene", &o->scene},     {"--references", &o->references},
                 {"--camera", &o->camera}, {"--methods", &o->methods}, {"--models", &o->models}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(texts); i++)
        if (strcmp(option, texts[i].option) == 0) {
            *texts[i].text = value;
            return 0;
        }
    if (strcmp(option, "--reference-spp") == 0) {
        if (read_spp(value, &o->reference_spp))
            return 0;
        fprintf(stderr, "lumend-bench: --reference-spp must be a power of two from 2 to 65536, not '%s'\n", value);
        return 2;
    }
    if (strcmp(option, "--seeds") == 0) {
        if (read_count(value, 30, &o->seeds))
            return 0;
        fprintf(stderr, "lumend-bench: --seeds must be 1 to 30, not '%s'\n", value);
        return 2;
    }
    if (strcmp(option, "--rounds") == 0) {
        if (read_count(value, 15, &o->rounds))
            return 0;
        fprintf(stderr, "lumend-bench: --rounds must be 1 to 15, not '%s'\n", value);
        return 2;
    }
    if (strcmp(option, "--size") == 0) {
        if (read_size(value, o))
            return 0;
        fprintf(stderr, "lumend-bench: --size must be WxH, of 16 to 4096 each, not '%s'\n", value);
        return 2;
    }
    if (strcmp(option, "--seconds") == 0) {
        if (read_seconds(value, &o->seconds))
            return 0;
        fprintf(stderr, "lumend-bench: --seconds must be above 0 and at most 3600, not '%s'\n", value);
        return 2;
    }
    fprintf(stderr, "lumend-bench: unexpected argument '%s'\n", option);
    return usage(stderr, 2);
}

/* Exit status; 0: go on. *ret_help: it was asked for. */
static int read_options(int argc, char **argv, struct lum_bench_options *o, bool *ret_help)
{
    for (int i = 2; i < argc; i++) {
        if (strcmp(argv[i], "--help") == 0) {
            *ret_help = true;
        } else if (strcmp(argv[i], "--quick") == 0) {
            o->quick = true;
        } else if (strcmp(argv[i], "--single-rays") == 0) {
            o->single_rays = true;
        } else if (i + 1 < argc) {
            int status = read_value(o, argv[i], argv[i + 1]);
            if (status)
                return status;
            i++;
        } else {
            fprintf(stderr, "lumend-bench: unexpected argument '%s'\n", argv[i]);
            return usage(stderr, 2);
        }
    }
    return 0;
}

int main(int argc, char **argv)
{
    char bin[4096];
    bool help = false;
    struct lum_bench_options options = {
        .bin = bin, .reference_spp = 128, .models = "../shared/scenes", .seeds = 30, .seconds = 30.0};
    if (argc < 2 || strcmp(argv[1], "--help") == 0)
        return usage(argc < 2 ? stderr : stdout, argc < 2 ? 2 : 0);
    if (strcmp(argv[1], "--version") == 0)
        return puts("lumend-bench " LUMEND_VERSION) < 0;
    int wrong = read_options(argc, argv, &options, &help);
    if (wrong || help)
        return help ? usage(stdout, 0) : wrong;
    if (!options.out)
        return fprintf(stderr, "lumend-bench: --out DIR is missing\n"), 2;
    if (!own_directory(bin, sizeof bin) || !make_directory(options.out) ||
        (options.references && !make_directory(options.references)))
        return 1;
    for (size_t i = 0; i < LUM_ARRAY_LEN(benches); i++)
        if (strcmp(argv[1], benches[i].name) == 0) {
            options.scene = options.scene ? options.scene : benches[i].scene;
            int status = benches[i].run(&options);
            if (options.quick)
                puts("\nMade with --quick: not for quoting");
            return status;
        }
    fprintf(stderr, "lumend-bench: no study '%s'\n", argv[1]);
    return usage(stderr, 2);
}
