/* A certificate with its chain and key, out of two files. Internal to tls*.c. */
#ifndef LUM_SERVER_NET_TLS_PAIR_H
#define LUM_SERVER_NET_TLS_PAIR_H

#include <openssl/ssl.h>

#include "server/net/tls.h"

struct lum_tls_pair {
    X509 *leaf;
    STACK_OF(X509) * chain; /* what a browser needs between it and a root that it knows */
    EVP_PKEY *key;
    int64_t begins_s, ends_s; /* of the Unix epoch */
};

LUM_MUST_USE enum lum_status lum_tls_pair_read(const struct lum_tls_config *config, struct lum_tls_pair **ret_pair,
                                               struct lum_error *err);
void lum_tls_pair_free(struct lum_tls_pair *pair); /* accepts NULL */
/* Why OpenSSL refused last: a static text. Forgets it. */
const char *lum_tls_why(void);

#endif
