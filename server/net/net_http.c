/* Pages, health, metrics, and files that are sent, by HTTP. See the rules at the top of net.c. */
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include <cjson/cJSON.h>

#include "server/net/downloads.h"
#include "server/net/net_internal.h"
#include "server/net/uploads.h"

/* ---- headers ---- */

/* The header's text; false when it is absent, empty, or longer than any that we accept. */
static bool copy_header(struct lws *wsi, enum lws_token_indexes token, char *out, size_t size)
{
    int n = lws_hdr_total_length(wsi, token);
    return n > 0 && (size_t)n < size && lws_hdr_copy(wsi, out, (int)size, token) > 0;
}

/* c: NULL for an upgrade. */
static bool access_ok(const struct lum_net *net, struct lws *wsi, struct conn *c)
{
    char host[300], origin[300];
    bool has_origin = lws_hdr_total_length(wsi, WSI_TOKEN_ORIGIN) > 0;
    if (!copy_header(wsi, WSI_TOKEN_HOST, host, sizeof host) || !lum_access_host(&net->config.access, host))
        return false;
    if (c)
        c->tls_for_good = net->config.tls && lum_access_owns_name(host);
    if (!has_origin)
        return true;
    return copy_header(wsi, WSI_TOKEN_ORIGIN, origin, sizeof origin) &&
           lum_access_origin(&net->config.access, origin, host);
}

/* See the top of net.c. Never looks at `in`. */
int lum_net_confirm_upgrade(const struct lum_net *net, struct lws *wsi)
{
    char upgrade[16];
    if (!copy_header(wsi, WSI_TOKEN_UPGRADE, upgrade, sizeof upgrade) || strcasecmp(upgrade, "websocket") != 0)
        return -1;
    bool open = net->sessions && !atomic_load(&net->stop), ok = access_ok(net, wsi, NULL);
    if (ok && open)
        return 0;
    lws_return_http_status(wsi, ok ? HTTP_STATUS_SERVICE_UNAVAILABLE : HTTP_STATUS_FORBIDDEN, NULL);
    return 1;
}

/* ---- HTTP ---- */

static void finish_response(struct lum_net *net, struct conn *c)
{
    net->file_bytes -= c->n_file;
    c->n_file = 0;
    free(c->response.owned);
    memset(&c->response, 0, sizeof c->response);
    c->response_sent = 0;
}

/* NULL: none comes by this connection any more. Who sends files had a ticket for that: she makes no room for others. */
static void set_upload(struct conn *c, struct lum_upload *u)
{
    struct lum_peer *peer = lws_get_opaque_user_data(c->wsi);
    if (peer)
        peer->greeted = u != NULL;
    c->upload = u;
}

void lum_net_http_finish(struct lum_net *net, struct conn *c)
{
    finish_response(net, c);
    if (!c->upload)
        return;
    lum_upload_release(c->upload);
    set_upload(c, NULL);
}

/* -1: there is none, or it is none. */
static int64_t content_length(struct lws *wsi)
{
    char text[24], *end;
    if (!copy_header(wsi, WSI_TOKEN_HTTP_CONTENT_LENGTH, text, sizeof text) || text[0] < '0' || text[0] > '9')
        return -1;
    long long n = strtoll(text, &end, 10); /* as the library reads it, to whose bytes this is compared */
    return *end ? -1 : n;
}

/* A file that a session has asked for. Those that are read slowly stay in memory until then, so that there is a limit.
 */
static bool give_file(struct lum_net *net, struct conn *c, const char *name)
{
    static const char folder[] = "/" LUM_DOWNLOAD_FOLDER "/";
    size_t n = 0;
    bool asked = strncmp(name, folder, sizeof folder - 1) == 0 && net->sessions && !c->head_only;
    uint8_t *bytes = asked ? lum_sessions_take_file(net->sessions, name + sizeof folder - 1, &n) : NULL;
    if (!bytes)
        return false;
    if (net->file_bytes + n > LUM_LIMIT_EXPORT_BYTES) {
        free(bytes);
        lum_http_error(503, &c->response);
        return true;
    }
    net->file_bytes += n;
    c->n_file = n;
    lum_http_file(bytes, n, &c->response);
    return true;
}

/* Of requests that come with a name. True: files come now, and the response later. */
static bool answer(struct lum_net *net, struct conn *c, const char *name)
{
    char authorization[sizeof "Bearer " + LUM_TOKEN_MAX_BYTES + 1];
    if (lws_hdr_total_length(c->wsi, WSI_TOKEN_PUT_URI) > 0) {
        set_upload(c, lum_http_put(&net->site, name, content_length(c->wsi), c, &c->response));
        return c->upload != NULL;
    }
    if (!c->head_only && lws_hdr_total_length(c->wsi, WSI_TOKEN_GET_URI) <= 0) {
        lum_http_error(405, &c->response);
        return false;
    }
    if (give_file(net, c, name))
        return false;
    bool has = copy_header(c->wsi, WSI_TOKEN_HTTP_AUTHORIZATION, authorization, sizeof authorization);
    lum_http_get(&net->site, name, has ? authorization : NULL, &c->response);
    return false;
}

/* True: files come now, and the response later. */
static bool fill_response(struct lum_net *net, struct conn *c, const char *path, size_t n_path)
{
    char name[256];
    c->head_only = lws_hdr_total_length(c->wsi, WSI_TOKEN_HEAD_URI) > 0;
    net->counters.http_requests++;
    c->tls_for_good = false;
    if (!access_ok(net, c->wsi, c)) {
        lum_http_error(403, &c->response);
    } else if (n_path >= sizeof name) {
        lum_http_error(404, &c->response);
    } else {
        memcpy(name, path, n_path);
        name[n_path] = '\0';
        if (answer(net, c, name))
            return true;
    }
    if (copy_header(c->wsi, WSI_TOKEN_HTTP_IF_NONE_MATCH, name, sizeof name) && lum_http_matches(&c->response, name)) {
        c->response.status = HTTP_STATUS_NOT_MODIFIED;
        c->head_only = true;
    }
    return false;
}

static int add_header(struct lws *wsi, const char *name, const char *value, unsigned char **p, unsigned char *end)
{
    return lws_add_http_header_by_name(wsi, (const unsigned char *)name, (const unsigned char *)value,
                                       (int)strlen(value), p, end);
}

static int send_head(struct lum_net *net, struct conn *c)
{
    struct lws *wsi = c->wsi;
    const struct lum_http_response *r = &c->response;
    unsigned char *start = net->tx + LWS_PRE, *p = start, *end = start + 2048;
    bool closing = r->status >= 400; /* an odd client has to come again; what it sent after the request is not read */
    if (lws_add_http_header_status(wsi, (unsigned)r->status, &p, end) ||
        add_header(wsi, "content-type:", r->type, &p, end) || add_header(wsi, "cache-control:", r->cache, &p, end) ||
        (r->etag[0] && add_header(wsi, "etag:", r->etag, &p, end)) ||
        (r->status == HTTP_STATUS_UNAUTHORIZED && add_header(wsi, "www-authenticate:", "Bearer", &p, end)) ||
        (closing && add_header(wsi, "connection:", "close", &p, end)) ||
        (c->tls_for_good && add_header(wsi, "strict-transport-security:", LUM_HTTP_TLS_FOR, &p, end)))
        return -1;
    for (size_t i = 0; lum_http_headers[i][0]; i++)
        if (add_header(wsi, lum_http_headers[i][0], lum_http_headers[i][1], &p, end))
            return -1;
    if (r->status != HTTP_STATUS_NOT_MODIFIED && lws_add_http_header_content_length(wsi, r->n_bytes, &p, end))
        return -1;
    if (lws_finalize_http_header(wsi, &p, end) ||
        lws_write(wsi, start, (size_t)(p - start), LWS_WRITE_HTTP_HEADERS) < 0)
        return -1;
    return 0;
}

static int end_transaction(struct lum_net *net, struct conn *c)
{
    bool close = c->response.status >= 400;
    finish_response(net, c);
    return close || lws_http_transaction_completed(c->wsi) ? -1 : 0;
}

int lum_net_http_request(struct lum_net *net, struct lws *wsi, struct conn *c, const char *path, size_t n_path)
{
    lum_net_http_finish(net, c); /* with a request before that was cut off */
    c->wsi = wsi;
    if (fill_response(net, c, path, n_path))
        return 0;
    if (send_head(net, c))
        return -1;
    if (c->head_only || c->response.n_bytes == 0)
        return end_transaction(net, c);
    lws_callback_on_writable(wsi);
    return 0;
}

int lum_net_http_writeable(struct lum_net *net, struct conn *c)
{
    if (c->upload && lum_upload_is_done(c->upload)) {
        cJSON *json;
        int status = lum_upload_answer(c->upload, &json);
        set_upload(c, NULL);
        lum_http_json(status, json, &c->response);
        cJSON_Delete(json);
        if (send_head(net, c))
            return -1;
        lws_callback_on_writable(c->wsi);
        return 0;
    }
    if (!c->response.body)
        return 0;
    size_t left = c->response.n_bytes - c->response_sent, n = left < LUM_NET_CHUNK_BYTES ? left : LUM_NET_CHUNK_BYTES;
    memcpy(net->tx + LWS_PRE, (const unsigned char *)c->response.body + c->response_sent, n);
    if (lws_write(c->wsi, net->tx + LWS_PRE, n, n == left ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < (int)n)
        return -1;
    c->response_sent += n;
    if (n == left)
        return end_transaction(net, c);
    lws_callback_on_writable(c->wsi);
    return 0;
}

/* ---- files that are sent ---- */

int lum_net_http_body(struct conn *c, const void *bytes, size_t n)
{
    if (!c->upload) /* nobody asked for it: read and dropped */
        return 0;
    enum lum_upload_go go = lum_upload_add(c->upload, bytes, n);
    if (go == LUM_UPLOAD_WAIT)
        lws_rx_flow_control(c->wsi, 0);
    return go == LUM_UPLOAD_HANG_UP ? -1 : 0;
}

int lum_net_http_body_end(struct conn *c)
{
    if (c->upload)
        lum_upload_end(c->upload);
    return 0;
}

static void look_at(struct lum_net *net, struct lum_upload *u)
{
    (void)net;
    const struct conn *c = lum_upload_connection(u);
    if (lum_upload_may_go_on(u))
        lws_rx_flow_control(c->wsi, 1);
    if (lum_upload_is_done(u))
        lws_callback_on_writable(c->wsi);
}

static void drop(struct lum_net *net, struct lum_upload *u)
{
    lum_net_http_finish(net, lum_upload_connection(u));
}

static void each_upload(struct lum_net *net, void (*fn)(struct lum_net *net, struct lum_upload *u))
{
    for (unsigned k = 0; k < LUM_LIMIT_PROJECTS_OPEN; k++) {
        const struct lum_project *p = lum_projects_at(net->site.projects, k);
        for (unsigned i = 0; p && i < LUM_LIMIT_UPLOADS_AT_ONCE; i++) {
            struct lum_upload *u = lum_uploads_at(lum_project_uploads(p), i);
            if (u)
                fn(net, u);
        }
    }
}

void lum_net_http_look(struct lum_net *net)
{
    each_upload(net, look_at);
}

void lum_net_http_drop(struct lum_net *net)
{
    each_upload(net, drop);
    net->site.projects = NULL;
}
