/* lumend-replay: plays a .jsonl replay against a running lumend and measures how long edits take to reach the screen.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <cjson/cJSON.h>

#include "clients/replay/player.h"
#include "protocol/json/json.h"

static const char usage_text[] =
    "usage: lumend-replay [options] [FILE.jsonl|-]\n"
    "Plays a replay against a running lumend, and measures how long edits take to reach the screen. A built-in one:\n"
    "lumend scenes NAME | lumend-replay -\n"
    "\n"
    "  --url URL            ws://127.0.0.1:9460, or wss://\n"
    "  --ca FILE            of wss: who signed the server's certificate (PEM); default: whom this machine trusts\n"
    "  --token T            of the server's URL; default: $LUMEND_TOKEN\n"
    "  --project ID         of a server with many scenes (--projects): in which\n"
    "  --speed X            1: as recorded; 2: twice as fast; 0: each edit when the one before is shown\n"
    "  --camera-orbit N     then turn the camera around its target in N steps, each when the one before is shown\n"
    "  --view-size WxH      600x400\n"
    "  --method M           of the view; default: the scene's\n"
    "  --codec C            jpeg, png or rgba8\n"
    "  --quality Q          1..100, of jpeg; default 80\n"
    "  --record DIR         write every complete frame as DIR/frame-000000.png\n"
    "  --timeout S          longest wait for a reply or a frame; default 30\n"
    "  --json               the report as JSON on stdout\n"
    "  --version            of this program\n";

struct arguments {
    struct player_options player;
    const char *file;
    bool json, help, version;
};

static bool parse_number(const char *s, double min, double max, double *ret)
{
    char *end;
    double v = strtod(s, &end);
    if (end == s || *end || !(v >= min && v <= max))
        return false;
    *ret = v;
    return true;
}

static bool parse_count(const char *s, uint32_t max, uint32_t *ret)
{
    double v;
    if (!parse_number(s, 0, max, &v) || v != (double)(uint32_t)v)
        return false;
    *ret = (uint32_t)v;
    return true;
}

static bool parse_size(const char *s, uint32_t *ret_w, uint32_t *ret_h)
{
    char w[16];
    size_t n = strcspn(s, "x");
    if (n == 0 || n >= sizeof w || s[n] != 'x')
        return false;
    memcpy(w, s, n);
    w[n] = '\0';
    return parse_count(w, LUM_LIMIT_VIEW_SIDE, ret_w) && parse_count(s + n + 1, LUM_LIMIT_VIEW_SIDE, ret_h) && *ret_w &&
           *ret_h;
}

static bool parse_option(struct arguments *a, int option, const char *value)
{
    struct player_options *p = &a->player;
    switch (option) {
    case 'u':
        p->url = value;
        return true;
    case 'a':
        p->ca = value;
        return true;
    case 't':
        p->token = value;
        return true;
    case 'p':
        p->project = value;
        return true;
    case 's':
        return parse_number(value, 0, 1e6, &p->speed);
    case 'o':
        return parse_count(value, 100000, &p->orbit);
    case 'v':
        return parse_size(value, &p->w, &p->h);
    case 'm':
        p->method = value;
        return true;
    case 'c':
        p->codec = value;
        return strcmp(value, "jpeg") == 0 || strcmp(value, "png") == 0 || strcmp(value, "rgba8") == 0;
    case 'q':
        return parse_count(value, 100, &p->quality) && p->quality > 0;
    case 'r':
        p->record_dir = value;
        return true;
    case 'w':
        return parse_number(value, 0.001, 86400, &p->timeout_s);
    case 'j':
        a->json = true;
        return true;
    case 'h':
        a->help = true;
        return true;
    case 'V':
        a->version = true;
        return true;
    default:
        return false;
    }
}

static bool parse_arguments(int argc, char **argv, struct arguments *a)
{
    static const struct option options[] = {
        {"url", 1, NULL, 'u'},       {"token", 1, NULL, 't'},   {"speed", 1, NULL, 's'}, {"camera-orbit", 1, NULL, 'o'},
        {"view-size", 1, NULL, 'v'}, {"method", 1, NULL, 'm'},  {"codec", 1, NULL, 'c'}, {"quality", 1, NULL, 'q'},
        {"record", 1, NULL, 'r'},    {"timeout", 1, NULL, 'w'}, {"json", 0, NULL, 'j'},  {"help", 0, NULL, 'h'},
        {"version", 0, NULL, 'V'},   {"project", 1, NULL, 'p'}, {"ca", 1, NULL, 'a'},    {NULL, 0, NULL, 0},
    };
    *a = (struct arguments){.player = {.url = "ws://127.0.0.1:9460",
                                       .token = getenv("LUMEND_TOKEN"),
                                       .codec = "jpeg",
                                       .w = 600,
                                       .h = 400,
                                       .quality = 80,
                                       .speed = 1.0,
                                       .timeout_s = 30.0}};
    int option, which = 0;
    while ((option = getopt_long(argc, argv, "", options, &which)) != -1) {
        if (option == '?')
            return false;
        const char *given = argv[optind - 1] == optarg ? argv[optind - 2] : argv[optind - 1];
        if (strcspn(given + 2, "=") != strlen(options[which].name)) { /* getopt_long takes the beginning of a name */
            fprintf(stderr, "lumend-replay: an option is abbreviated: write --%s\n", options[which].name);
            return false;
        }
        if (!parse_option(a, option, optarg)) {
            fprintf(stderr, "lumend-replay: --%s cannot be \"%s\"\n", options[which].name, optarg);
            return false;
        }
    }
    a->file = optind < argc ? argv[optind] : NULL;
    return a->help || a->version || (optind >= argc - 1 && (a->file || a->player.orbit > 0));
}

/* "-" is standard input. */
static bool read_ops(const char *path, struct lum_ops *ret_ops, struct lum_proto_error *err)
{
    FILE *f = strcmp(path, "-") == 0 ? stdin : fopen(path, "rb");
    char *text = NULL, *grown;
    size_t n = 0, capacity = 0, got = 1;
    bool ok = f != NULL;
    while (ok && got > 0) {
        if (n == capacity) {
            capacity = capacity ? 2 * capacity : 1u << 16;
            ok = capacity <= 2 * (size_t)LUM_LIMIT_SCENE_BYTES && (grown = realloc(text, capacity)) != NULL;
            text = ok ? grown : text;
        }
        got = ok ? fread(text + n, 1, capacity - n, f) : 0;
        n += got;
    }
    ok = ok && !ferror(f);
    if (f && f != stdin)
        fclose(f);
    if (!ok)
        lum_proto_fail(err, LUM_PROTO_APPLICATION, "io", "", "cannot be read: %s", strerror(errno));
    ok = ok && lum_ops_from_jsonl(text, n, ret_ops, err);
    free(text);
    return ok;
}

static void print_row(const char *name, struct samples *s)
{
    if (s->n)
        printf("%-18s %6zu  p50 %8.1f  p95 %8.1f  p99 %8.1f  max %8.1f ms\n", name, s->n,
               samples_percentile(s, 50) * 1e-3, samples_percentile(s, 95) * 1e-3, samples_percentile(s, 99) * 1e-3,
               samples_percentile(s, 100) * 1e-3);
}

static bool print_report(struct player_report *r, bool as_json)
{
    if (!as_json) {
        printf("%llu edits (%llu refused), %llu frames in %.2f s, %llu tiles, %.1f kB\n", (unsigned long long)r->edits,
               (unsigned long long)r->refused, (unsigned long long)r->frames, r->seconds, (unsigned long long)r->tiles,
               (double)r->bytes * 1e-3);
        print_row("edit to frame", &r->edit.samples);
        print_row("camera to frame", &r->camera.samples);
        print_row("server", &r->server);
        return true;
    }
    cJSON *json = player_report_to_json(r);
    char *text = json ? lum_json_print(json, NULL) : NULL;
    if (text)
        puts(text);
    free(text);
    cJSON_Delete(json);
    return text != NULL;
}

int main(int argc, char **argv)
{
    static struct player_report report; /* too large for the stack */
    struct arguments a;
    struct lum_ops ops = {0};
    struct lum_proto_error err = {0};
    char reason[256];
    if (!parse_arguments(argc, argv, &a) || a.help) {
        fputs(usage_text, a.help ? stdout : stderr);
        return a.help ? 0 : 2;
    }
    if (a.version) {
        puts("lumend-replay " LUMEND_VERSION " (protocol 1)");
        return 0;
    }
    if (a.file && !read_ops(a.file, &ops, &err)) {
        fprintf(stderr, "lumend-replay: %s: %s\n", a.file, err.text);
        return 1;
    }
    if (a.player.record_dir && mkdir(a.player.record_dir, 0777) != 0 && errno != EEXIST) {
        fprintf(stderr, "lumend-replay: %s: %s\n", a.player.record_dir, strerror(errno));
        lum_ops_finish(&ops);
        return 1;
    }
    bool ok = player_run(&a.player, &ops, &report, reason);
    if (!ok)
        fprintf(stderr, "lumend-replay: %s\n", reason);
    else if (report.refused)
        fprintf(stderr, "lumend-replay: %llu edits were refused, the first: %s%s\n", (unsigned long long)report.refused,
                report.first_refusal, report.refused == report.edits ? " (is the replay for another scene?)" : "");
    ok = ok && report.refused == 0;
    if (report.frames > 0 && !print_report(&report, a.json))
        ok = false;
    player_report_finish(&report);
    lum_ops_finish(&ops);
    return ok ? 0 : 1;
}
