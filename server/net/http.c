#define _GNU_SOURCE
#include "server/net/http.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "protocol/json/json.h"
#include "server/base/embed.h"
#include "server/net/auth.h"
#include "server/net/metrics.h"
#include "server/net/projects.h"

const char *const lum_http_headers[][2] = {
    /* The client's own scripts and styles only. Pictures are decoded from blobs, the stream is a WebSocket of this
       server. */
    {"content-security-policy:", "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
                                 "connect-src 'self'; worker-src 'self' blob:; font-src 'self'; manifest-src 'self'; "
                                 "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
    {"x-content-type-options:", "nosniff"},
    /* the token is in the fragment, which is not sent; the path need not be either */
    {"referrer-policy:", "no-referrer"},
    {"cross-origin-opener-policy:", "same-origin"},
    {"cross-origin-resource-policy:", "same-origin"},
    {"permissions-policy:", "camera=(), microphone=(), geolocation=(), payment=(), usb=()"},
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
        {401, "401 unauthorized: send the header Authorization: Bearer TOKEN, with the token of the server's URL\n"},
        {403, "403 forbidden: this Host or Origin is not allowed (see --allow-host, --allow-origin)\n"},
        {404, "404 not found\n"},
        {405, "405 method not allowed: GET, HEAD, and PUT of files that were announced\n"},
        {411, "411 length required\n"},
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

void lum_http_json(int status, const struct cJSON *json, struct lum_http_response *ret_response)
{
    size_t n;
    char *text = json ? lum_json_print(json, &n) : NULL;
    if (text)
        *ret_response = (struct lum_http_response){.status = status,
                                                   .type = "application/json",
                                                   .cache = "no-store",
                                                   .body = text,
                                                   .n_bytes = n,
                                                   .owned = text};
    else
        lum_http_error(500, ret_response);
}

void lum_http_file(uint8_t *bytes, size_t n, struct lum_http_response *ret_response)
{
    *ret_response = (struct lum_http_response){.status = 200,
                                               .type = "model/gltf-binary",
                                               .cache = "no-store",
                                               .body = bytes,
                                               .n_bytes = n,
                                               .owned = (char *)bytes};
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

static void get_metrics(const struct lum_http_site *site, struct lum_http_response *r)
{
    char *text = NULL;
    size_t n = 0;
    FILE *out = site->projects ? open_memstream(&text, &n) : NULL;
    if (out)
        lum_metrics_print(out, site->counters, site->projects, site->started_ns);
    if (!out || fclose(out)) {
        free(text);
        lum_http_error(503, r);
        return;
    }
    *r = (struct lum_http_response){.status = 200,
                                    .type = "text/plain; version=0.0.4; charset=utf-8",
                                    .cache = "no-store",
                                    .body = text,
                                    .n_bytes = n,
                                    .owned = text};
}

/* Why nobody is served; NULL: everybody is. */
static const char *unready(const struct lum_http_site *site)
{
    if (site->draining)
        return "shutting down\n";
    if (!site->projects)
        return "loading the scene\n";
    return lum_projects_alive(site->projects) ? NULL : "the renderer does not answer\n";
}

void lum_http_get(const struct lum_http_site *site, const char *path, const char *authorization,
                  struct lum_http_response *ret_response)
{
    const char *why = unready(site);
    bool alive = !site->projects || lum_projects_alive(site->projects); /* no need to start it anew */
    if (strcmp(path, "/healthz") == 0)
        set_text(ret_response, alive ? 200 : 503, alive ? "ok\n" : why);
    else if (strcmp(path, "/readyz") == 0)
        set_text(ret_response, why ? 503 : 200, why ? why : "ready\n");
    else if (strcmp(path, "/metrics") == 0 && !lum_auth_check_header(site->auth, authorization, time(NULL)))
        lum_http_error(401, ret_response);
    else if (strcmp(path, "/metrics") == 0)
        get_metrics(site, ret_response);
    else if (!get_file(path, ret_response))
        lum_http_error(404, ret_response);
}

struct lum_upload *lum_http_put(const struct lum_http_site *site, const char *path, int64_t n_bytes, void *connection,
                                struct lum_http_response *ret_response)
{
    static const char folder[] = "/" LUM_UPLOAD_FOLDER "/";
    int status = 405;
    struct lum_upload *u = NULL;
    bool here = site->projects && !site->draining && strncmp(path, folder, sizeof folder - 1) == 0;
    for (unsigned i = 0; here && i < LUM_LIMIT_PROJECTS_OPEN && !u; i++) { /* a ticket is of one of them */
        const struct lum_project *p = lum_projects_at(site->projects, i);
        struct lum_uploads *uploads = p ? lum_project_uploads(p) : NULL;
        if (uploads)
            u = lum_uploads_begin(uploads, path + sizeof folder - 1, n_bytes, connection, &status);
        here = u || !uploads || status == 404;
    }
    if (!u)
        lum_http_error(status, ret_response);
    return u;
}

bool lum_http_matches(const struct lum_http_response *response, const char *if_none_match)
{
    return if_none_match && response->etag[0] && strstr(if_none_match, response->etag);
}
