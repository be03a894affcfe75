/* In the place of tls.c, tls_pair.c and tls_ask.c where this libwebsockets has no TLS by OpenSSL: none can be made, so
 * nothing else is ever called. */
#include "server/net/tls.h"

enum lum_status lum_tls_create(const struct lum_tls_config *config, struct lum_tls **ret_tls, struct lum_error *err)
{
    (void)config, (void)ret_tls;
    return lum_fail(err, LUM_ERR_UNSUPPORTED, "tls-cert",
                    "this lumend was built without TLS: put a proxy before it, or build it with a libwebsockets that "
                    "has TLS by OpenSSL");
}

void lum_tls_destroy(struct lum_tls *tls)
{
    (void)tls;
}

enum lum_status lum_tls_read_again(struct lum_tls *tls, struct lum_error *err)
{
    (void)tls, (void)err;
    return LUM_OK;
}

bool lum_tls_setup(struct lum_tls *tls, void *ssl_ctx, bool (*may_begin)(void *user, int fd), void *user)
{
    (void)tls, (void)ssl_ctx, (void)may_begin, (void)user;
    return false;
}

void lum_tls_take_offered(struct lum_tls *tls)
{
    (void)tls;
}

int64_t lum_tls_ends_s(const struct lum_tls *tls)
{
    (void)tls;
    return 0;
}

const char *lum_tls_name(const struct lum_tls *tls, const char *address, bool local, char *out, size_t size)
{
    (void)tls, (void)local, (void)out, (void)size;
    return address;
}

size_t lum_tls_ask(int fd, const char *request, size_t n_request, char *answer, size_t size)
{
    (void)fd, (void)request, (void)n_request, (void)answer, (void)size;
    return 0;
}

const char *lum_tls_library(void)
{
    return NULL;
}
