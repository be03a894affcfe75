#define _GNU_SOURCE
#include "server/net/http.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/base/embed.h"
#include "server/director/director.h"

const char *const lum_http_headers[][2] = {
    /* The client's own scripts and styles only. Pictures are decoded from blobs, the stream is a WebSocket. */
    {"content-security-policy:",
     "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
     "connect-src 'self' ws: wss:; worker-src 'self' blob:; font-src 'self'; manifest-src 'self'; "
     "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
    {"x-content-type-options:", "nosniff"},
    /* the token is in the fragment, which is not sent; the path need not be either */
    {"referrer-policy:", "no-referrer"},
    {"cross-origin-opener-policy:", "same-origin"},
    {"cross-origin-resource-policy:", "same-origin"},
    {NULL, NULL},
};

static const char *content_type(const char *path)
{
    static const char *const types[][2] = {
        {".html", "text/html; charset=utf-8"},
        {".js", "text/javascript; charset=utf-8"},
        {".css", "text/css; charset=utf-8"},
        {".svg", "image/svg+xml"},
        {".png", "image/png"},
        {".json", "application/json"},
        {".woff2", "font/woff2"},
        {".wasm", "application/wasm"},
        {".ico", "image/x-icon"},
    };
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < LUM_ARRAY_LEN(types); i++)
        if (strcmp(dot, types[i][0]) == 0)
            return types[i][1];
    return "application/octet-stream";
}

static void set_text(struct lum_http_response *r, int status, const char *text)
{
    *r = (struct lum_http_response){.status = status,
                                    .type = "text/plain; charset=utf-8",
                                    .cache = "no-store",
                                    .body = text,
                                    .n_bytes = strlen(text)};
}

void lum_http_error(int status, struct lum_http_response *ret_response)
{
    static const struct {
        int status;
        const char *text;
    } texts[] = {
        {400, "400 bad request\n"},
        {403, "403 forbidden: this Host or Origin is not allowed (see --allow-host, --allow-origin)\n"},
        {404, "404 not found\n"},
        {405, "405 method not allowed: GET only\n"},
        {503, "503 service unavailable\n"},
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(texts); i++) {
        if (texts[i].status == status) {
            set_text(ret_response, status, texts[i].text);
            return;
        }
    }
    set_text(ret_response, 500, "500 internal error\n");
}

/* FNV-1a: an embedded file's version. Not a security matter. */
static uint64_t hash_bytes(const unsigned char *bytes, size_t n)
{
    uint64_t h = 0xcbf29ce484222325u;
    for (size_t i = 0; i < n; i++)
        h = (h ^ bytes[i]) * 0x100000001b3u;
    return h;
}

static bool get_file(const char *path, struct lum_http_response *r)
{
    if (path[0] != '/')
        return false;
    const char *key = path[1] ? path + 1 : "index.html";
    const struct lum_embedded *file = lum_embedded_web;
    while (file->key && strcmp(file->key, key) != 0)
        file++;
    if (!file->key)
        return false;
    /* Names below assets/ carry a hash of their content; the others must be asked for again. */
    bool hashed = strncmp(key, "assets/", 7) == 0;
    *r = (struct lum_http_response){.status = 200,
                                    .type = content_type(key),
                                    .cache = hashed ? "public, max-age=31536000, immutable" : "no-cache",
                                    .body = file->bytes,
                                    .n_bytes = file->n};
    snprintf(r->etag, sizeof r->etag, "\"%016llx\"", (unsigned long long)hash_bytes(file->bytes, file->n));
    return true;
}

struct metric {
    const char *name, *type, *help;
    double value;
};

static void print_metrics(FILE *out, const struct metric *metrics, size_t n)
{
    for (size_t i = 0; i < n; i++)
        fprintf(out, "# HELP lumend_%s %s\n# TYPE lumend_%s %s\nlumend_%s %.17g\n", metrics[i].name, metrics[i].help,
                metrics[i].name, metrics[i].type, metrics[i].name, metrics[i].value);
}

static void print_director_metrics(FILE *out, const struct lum_director *director)
{
    struct lum_director_metrics m;
    lum_director_metrics(director, &m);
    const struct metric metrics[] = {
        {"scene_rev", "gauge", "Revision of the scene", (double)lum_director_scene_rev(director)},
        {"views", "gauge", "Open views", (double)m.views},
        {"triangles", "gauge", "Triangles in the scene, instances counted", (double)m.triangles},
        {"lights", "gauge", "Lights in the scene", (double)m.lights},
        {"passes_total", "counter", "Rendering passes", (double)m.passes},
        {"last_pass_seconds", "gauge", "Time of the newest pass", m.last_pass_ms * 1e-3},
        {"rays_total", "counter", "Rays traced", (double)m.rays},
        {"frames_published_total", "counter", "Frames given to streams", (double)m.frames_published},
        {"tiles_encoded_total", "counter", "Tiles encoded", (double)m.tiles_encoded},
        {"tile_bytes_total", "counter", "Bytes of encoded tiles", (double)m.tile_bytes},
        {"edits_total", "counter", "Edits accepted", (double)m.edits},
        {"edits_refused_total", "counter", "Edits refused", (double)m.edits_refused},
        {"imports_total", "counter", "Imports read", (double)m.imports},
        {"imports_failed_total", "counter", "Imports failed", (double)m.imports_failed},
        {"nonfinite_total", "counter", "Radiance values that were not finite: 0 unless there is a bug",
         (double)m.nonfinite},
    };
    print_metrics(out, metrics, LUM_ARRAY_LEN(metrics));
}

static void print_net_metrics(FILE *out, const struct lum_http_site *site)
{
    const struct lum_net_counters *c = site->counters;
    const struct metric metrics[] = {
        {"uptime_seconds", "gauge", "Since the start", (double)(lum_clock_ns() - site->started_ns) * 1e-9},
        {"connections_total", "counter", "TCP connections accepted", (double)c->connections},
        {"connections_refused_total", "counter", "TCP connections over a limit", (double)c->connections_refused},
        {"http_requests_total", "counter", "HTTP requests", (double)c->http_requests},
        {"sessions", "gauge", "Open WebSocket sessions", (double)c->sessions_open},
        {"sessions_total", "counter", "WebSocket sessions opened", (double)c->sessions},
        {"sessions_refused_total", "counter", "WebSocket sessions refused: wrong token, no hello, limits",
         (double)c->sessions_refused},
        {"messages_total", "counter", "Text messages received", (double)c->messages},
        {"messages_refused_total", "counter", "Text messages answered with an error here", (double)c->messages_refused},
        {"tiles_sent_total", "counter", "Tiles sent", (double)c->tiles_sent},
        {"frames_acked_total", "counter", "Frame acknowledgements", (double)c->frames_acked},
        {"ws_tx_bytes_total", "counter", "Bytes sent in WebSocket messages", (double)c->tx_bytes},
        {"ws_rx_bytes_total", "counter", "Bytes received in WebSocket messages", (double)c->rx_bytes},
    };
    print_metrics(out, metrics, LUM_ARRAY_LEN(metrics));
    fprintf(out,
            "# HELP lumend_build_info Version\n# TYPE lumend_build_info gauge\nlumend_build_info{version=\"%s\"} 1\n",
            LUMEND_VERSION);
}

static bool get_metrics(const struct lum_http_site *site, struct lum_http_response *r)
{
    char *text = NULL;
    size_t n = 0;
    FILE *out = open_memstream(&text, &n);
    if (!out)
        return false;
    print_net_metrics(out, site);
    print_director_metrics(out, site->director);
    if (fclose(out)) {
        free(text);
        return false;
    }
    *r = (struct lum_http_response){.status = 200,
                                    .type = "text/plain; version=0.0.4; charset=utf-8",
                                    .cache = "no-store",
                                    .body = text,
                                    .n_bytes = n,
                                    .owned = text};
    return true;
}

void lum_http_get(const struct lum_http_site *site, const char *path, struct lum_http_response *ret_response)
{
    bool alive = lum_director_alive(site->director);
    if (strcmp(path, "/healthz") == 0)
        set_text(ret_response, alive ? 200 : 503, alive ? "ok\n" : "the renderer does not answer\n");
    else if (strcmp(path, "/readyz") == 0 && site->draining)
        set_text(ret_response, 503, "shutting down\n");
    else if (strcmp(path, "/readyz") == 0)
        set_text(ret_response, alive ? 200 : 503, alive ? "ready\n" : "the renderer does not answer\n");
    else if (strcmp(path, "/metrics") != 0 && !get_file(path, ret_response))
        lum_http_error(404, ret_response);
    else if (strcmp(path, "/metrics") == 0 && !get_metrics(site, ret_response))
        lum_http_error(503, ret_response);
}

bool lum_http_matches(const struct lum_http_response *response, const char *if_none_match)
{
    return if_none_match && response->etag[0] && strstr(if_none_match, response->etag);
}
