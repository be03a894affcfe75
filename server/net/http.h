/* What the daemon answers to plain HTTP: the web client out of the binary, health, readiness, metrics. No socket here.
 */
#ifndef LUM_SERVER_NET_HTTP_H
#define LUM_SERVER_NET_HTTP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct cJSON;
struct lum_auth;
struct lum_projects;
struct lum_net_counters;
struct lum_upload;

struct lum_http_site {
    struct lum_projects *projects; /* NULL: the scene is being loaded */
    const struct lum_net_counters *counters;
    const struct lum_auth *auth; /* who may read /metrics */
    int64_t started_ns;
    bool draining;
};

struct lum_http_response {
    int status;
    const char *type;  /* Content-Type */
    const char *cache; /* Cache-Control */
    const void *body;
    size_t n_bytes;
    char etag[24]; /* quoted; "": none */
    char *owned;   /* body, where it was made for this response; the caller frees it with free() */
};

/* path: as in the request line, without query. authorization: that header, or NULL. Always fills the response. */
void lum_http_get(const struct lum_http_site *site, const char *path, const char *authorization,
                  struct lum_http_response *ret_response);
/* The text of an object, which stays the caller's; NULL: memory was short. */
void lum_http_json(int status, const struct cJSON *json, struct lum_http_response *ret_response);
/* A file that was made for who asked; bytes pass over. */
void lum_http_file(uint8_t *bytes, size_t n, struct lum_http_response *ret_response);
/* A short text for people. */
void lum_http_error(int status, struct lum_http_response *ret_response);
/* A PUT. n_bytes: Content-Length; -1: none. NULL: the response says why. connection: see uploads.h. */
struct lum_upload *lum_http_put(const struct lum_http_site *site, const char *path, int64_t n_bytes, void *connection,
                                struct lum_http_response *ret_response);
/* True when the If-None-Match header (may be NULL) names this version: 304, no body. */
bool lum_http_matches(const struct lum_http_response *response, const char *if_none_match);

/* Of strict-transport-security: a year, and no other name. A browser that was here once takes this name by TLS alone
 * from then on, on all its ports: see lum_access_owns_name. */
#define LUM_HTTP_TLS_FOR "max-age=31536000"

/* Headers that every response carries: {name, value} pairs, ended by NULL. Names are lower case with a colon. */
extern const char *const lum_http_headers[][2];

#endif
