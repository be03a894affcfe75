#define _GNU_SOURCE
#include "server/net/tls.h"

#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <openssl/crypto.h>
#include <openssl/err.h>
#include <openssl/x509v3.h>

#include "protocol/base/limits.h"
#include "server/net/tls_pair.h"

#define DAY_S 86400
#define SOON_S (14 * DAY_S) /* what renews certificates does so 30 days before */

struct lum_tls {
    struct lum_tls_config config;
    _Atomic(struct lum_tls_pair *) offered; /* a newer one, which the net thread takes; NULL: none */
    struct lum_tls_pair *pair;              /* net thread: that of new connections */
    bool (*may_begin)(void *user, int fd);  /* net thread */
    void *may_begin_user;
};

/* Of TLS 1.2: with keys that are thrown away, and encryption that is also a checksum. TLS 1.3 has no others. */
#define CIPHERS_1_2                                                                                                    \
    "ECDHE-ECDSA-AES128-GCM-SHA256:ECDHE-RSA-AES128-GCM-SHA256:ECDHE-ECDSA-AES256-GCM-SHA384:"                         \
    "ECDHE-RSA-AES256-GCM-SHA384:ECDHE-ECDSA-CHACHA20-POLY1305:ECDHE-RSA-CHACHA20-POLY1305"

/* No session is taken up again: a handshake is cheap beside a session of hours, and keys of tickets would have to be
 * kept and changed. A client cannot ask for a new handshake inside a connection, which costs it less than us. */
static bool set_rules(SSL_CTX *ctx)
{
    SSL_CTX_set_options(ctx, SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_TICKET |
                                 SSL_OP_CIPHER_SERVER_PREFERENCE | SSL_OP_PRIORITIZE_CHACHA);
    SSL_CTX_set_session_cache_mode(ctx, SSL_SESS_CACHE_OFF);
    SSL_CTX_set_mode(ctx, SSL_MODE_RELEASE_BUFFERS); /* 34 KB less for each connection at rest */
    /* One message of TLS at a time: who sends nothing but new keys, or hellos, would not let SSL_read return. */
    SSL_CTX_clear_mode(ctx, SSL_MODE_AUTO_RETRY);
    return SSL_CTX_set_min_proto_version(ctx, TLS1_2_VERSION) == 1 && SSL_CTX_set_num_tickets(ctx, 0) == 1 &&
           SSL_CTX_set_cipher_list(ctx, CIPHERS_1_2) == 1;
}

static bool use(SSL_CTX *ctx, const struct lum_tls_pair *p)
{
    return SSL_CTX_use_cert_and_key(ctx, p->leaf, p->key, p->chain, 1) == 1;
}

/* For one connection, as its handshake begins. The context has a place for each kind of key, which nobody can empty:
 * there a key of another kind would leave the certificate before it in use. */
static int choose(SSL *ssl, void *user)
{
    const struct lum_tls_pair *const *pair = user;
    SSL_certs_clear(ssl);
    return SSL_use_cert_and_key(ssl, (*pair)->leaf, (*pair)->key, (*pair)->chain, 1);
}

/* On a context of its own: what connections would refuse later is refused now, while somebody looks. */
static enum lum_status try_out(const struct lum_tls_config *c, const struct lum_tls_pair *p, struct lum_error *err)
{
    SSL_CTX *ctx = SSL_CTX_new(TLS_server_method());
    bool ok = ctx && set_rules(ctx) && use(ctx, p);
    enum lum_status status = ok ? LUM_OK
                                : lum_fail(err, LUM_ERR_INVALID, "tls-cert", "%s, %s: no connection could use them: %s",
                                           c->cert_path, c->key_path, lum_tls_why());
    SSL_CTX_free(ctx);
    return status;
}

static bool is_for(const struct lum_tls_pair *p, const char *name)
{
    bool yes = X509_check_ip_asc(p->leaf, name, 0) == 1 || X509_check_host(p->leaf, name, strlen(name), 0, NULL) == 1;
    ERR_clear_error(); /* what is left there would be taken for an error of the next connection */
    return yes;
}

/* The next of "a.example,b.example"; false: there is none. *list is moved on. */
static bool next_host(const char **list, char *out, size_t size)
{
    while (*list && **list) {
        size_t n = strcspn(*list, ",");
        bool fits = n > 0 && (size_t)snprintf(out, size, "%.*s", (int)n, *list) < size;
        *list += n + ((*list)[n] == ',');
        if (fits)
            return true;
    }
    return false;
}

static void warn_of_names(const struct lum_tls_config *c, const struct lum_tls_pair *p)
{
    char name[256];
    for (const char *list = c->hosts; next_host(&list, name, sizeof name);)
        if (!is_for(p, name))
            lum_log(&c->log, LUM_LOG_WARNING, "tls", "%s is not for %s, by which people may come", c->cert_path, name);
}

/* A wrong clock is more likely than a certificate that nobody wants: it is used all the same. */
static void warn(const struct lum_tls_config *c, const struct lum_tls_pair *p)
{
    int64_t now_s = time(NULL), left_s = p->ends_s - now_s;
    if (left_s <= 0)
        lum_log(&c->log, LUM_LOG_WARNING, "tls", "%s: its time is over, since %lld days: no browser will trust it",
                c->cert_path, (long long)(-left_s / DAY_S));
    else if (p->begins_s > now_s)
        lum_log(&c->log, LUM_LOG_WARNING, "tls", "%s: its time begins in %lld s: no browser trusts it before",
                c->cert_path, (long long)(p->begins_s - now_s));
    else if (left_s < SOON_S)
        lum_log(&c->log, LUM_LOG_WARNING, "tls", "%s: its time ends in %lld days", c->cert_path,
                (long long)(left_s / DAY_S));
    warn_of_names(c, p);
}

static enum lum_status read_both(const struct lum_tls_config *c, struct lum_tls_pair **ret_pair, struct lum_error *err)
{
    struct lum_tls_pair *p = NULL;
    enum lum_status status = lum_tls_pair_read(c, &p, err);
    if (!status)
        status = try_out(c, p, err);
    if (status) {
        lum_tls_pair_free(p);
        return status;
    }
    warn(c, p);
    *ret_pair = p;
    return LUM_OK;
}

enum lum_status lum_tls_create(const struct lum_tls_config *config, struct lum_tls **ret_tls, struct lum_error *err)
{
    struct lum_tls *tls = lum_calloc(1, sizeof *tls);
    if (!tls)
        return lum_fail(err, LUM_ERR_NOMEM, "tls-cert", "no memory for TLS");
    tls->config = *config;
    enum lum_status status = read_both(config, &tls->pair, err);
    if (status)
        lum_tls_destroy(tls);
    else
        *ret_tls = tls;
    return status;
}

void lum_tls_destroy(struct lum_tls *tls)
{
    if (!tls)
        return;
    lum_tls_pair_free(atomic_exchange(&tls->offered, NULL));
    lum_tls_pair_free(tls->pair);
    lum_free(tls);
}

enum lum_status lum_tls_read_again(struct lum_tls *tls, struct lum_error *err)
{
    struct lum_tls_pair *p;
    enum lum_status status = read_both(&tls->config, &p, err);
    if (!status)
        lum_tls_pair_free(atomic_exchange(&tls->offered, p));
    return status;
}

/* With each connection a number is kept: 0 until it may begin, from then on 1, and 1 more for each change of keys. */
static uintptr_t noted(const SSL *ssl)
{
    return (uintptr_t)SSL_get_app_data(ssl);
}

static bool note(SSL *ssl, uintptr_t n)
{
    return SSL_set_app_data(ssl, (void *)n) == 1;
}

/* OpenSSL comes here with each hello: with two of a client that is asked for another curve, which pays once. */
static int may_begin(SSL *ssl, int *ret_alert, void *user)
{
    const struct lum_tls *tls = user;
    if (noted(ssl) || (tls->may_begin(tls->may_begin_user, SSL_get_fd(ssl)) && note(ssl, 1)))
        return SSL_CLIENT_HELLO_SUCCESS;
    *ret_alert = SSL_AD_INTERNAL_ERROR; /* TLS has no word for "too many" */
    return SSL_CLIENT_HELLO_ERROR;
}

/* New keys cost the server some 20 us, and who sends them a few bytes that nobody is charged for. */
static void count_key_changes(int written, int version, int type, const void *message, size_t n, SSL *ssl, void *user)
{
    (void)version, (void)user;
    if (written || type != SSL3_RT_HANDSHAKE || n == 0 || *(const unsigned char *)message != SSL3_MT_KEY_UPDATE)
        return;
    uintptr_t n_changes = noted(ssl); /* with this one */
    if (n_changes > LUM_LIMIT_KEY_CHANGES || !note(ssl, n_changes + 1))
        SSL_set_shutdown(ssl, SSL_RECEIVED_SHUTDOWN); /* nothing more is read, as if it had ended */
}

bool lum_tls_setup(struct lum_tls *tls, void *ssl_ctx, bool (*may)(void *user, int fd), void *user)
{
    tls->may_begin = may;
    tls->may_begin_user = user;
    SSL_CTX_set_msg_callback(ssl_ctx, count_key_changes);
    SSL_CTX_set_client_hello_cb(ssl_ctx, may_begin, tls);
    SSL_CTX_set_cert_cb(ssl_ctx, choose, &tls->pair);
    return set_rules(ssl_ctx) && use(ssl_ctx, tls->pair); /* libwebsockets looks at its age once a day */
}

void lum_tls_take_offered(struct lum_tls *tls)
{
    struct lum_tls_pair *p = atomic_exchange(&tls->offered, NULL);
    if (!p)
        return;
    lum_tls_pair_free(tls->pair); /* connections that are open count it, and keep it */
    tls->pair = p;
}

int64_t lum_tls_ends_s(const struct lum_tls *tls)
{
    return tls->pair->ends_s;
}

const char *lum_tls_name(const struct lum_tls *tls, const char *address, bool local, char *out, size_t size)
{
    const char *list = tls->config.hosts;
    if (is_for(tls->pair, address))
        return address;
    while (next_host(&list, out, size))
        if (is_for(tls->pair, out))
            return out;
    return local && is_for(tls->pair, "localhost") ? "localhost" : address;
}

const char *lum_tls_library(void)
{
    return OpenSSL_version(OPENSSL_VERSION_STRING);
}
