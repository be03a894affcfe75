/* TLS of the port: certificate, key, and what is spoken. The only files that know OpenSSL's libssl are tls.c,
 * tls_pair.c and tls_ask.c; where libwebsockets has no TLS by OpenSSL, tls_none.c stands in for all three.
 *
 * The files are read by the thread that starts the daemon, and again, at SIGHUP, by the thread of signals: a disk that
 * is slow keeps no client waiting. What they say is checked there, to the last detail, and then offered to the net
 * thread, whose connections begin with them from then on. Those that are open keep what they began
 * with. */
#ifndef LUM_SERVER_NET_TLS_H
#define LUM_SERVER_NET_TLS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/base.h"
#include "server/base/log.h"

struct lum_tls;

struct lum_tls_config {
    const char *cert_path, *key_path; /* PEM: the certificate and those between it and its root; its key */
    const char *hosts;                /* "a.example,b.example": by which people come, or NULL */
    struct lum_log log;
};

/* Reads both files. err names the file that is wrong. What only may be wrong (its time is over, it is for other names)
 * goes to the log. The paths outlive it. */
LUM_MUST_USE enum lum_status lum_tls_create(const struct lum_tls_config *config, struct lum_tls **ret_tls,
                                            struct lum_error *err);
void lum_tls_destroy(struct lum_tls *tls); /* accepts NULL */

/* Reads both again, for lum_tls_take_offered. Where they are wrong nothing changes. Of one thread. */
LUM_MUST_USE enum lum_status lum_tls_read_again(struct lum_tls *tls, struct lum_error *err);

/* Net thread. ssl_ctx: SSL_CTX of the listening socket, which asks tls at each handshake. False: it refuses.
 * may_begin: asked for each handshake before it costs anything; fd: the socket. */
bool lum_tls_setup(struct lum_tls *tls, void *ssl_ctx, bool (*may_begin)(void *user, int fd), void *user);
/* Net thread. What was read again is that of new connections from here on. */
void lum_tls_take_offered(struct lum_tls *tls);
/* Net thread. Of the Unix epoch: when the certificate's time ends. */
int64_t lum_tls_ends_s(const struct lum_tls *tls);

/* By which name to come, so that a browser finds no fault with the certificate: address, one of the hosts or, on this
 * machine, localhost; address where it is for none of them. out: for the name. Net thread. */
const char *lum_tls_name(const struct lum_tls *tls, const char *address, bool local, char *out, size_t size);

/* Asks a server of this machine by TLS over the socket, and reads the answer as far as there is room. 0: there is none.
 * The certificate is not looked at: no secret is sent, and it is of other names than the address that is asked. */
size_t lum_tls_ask(int fd, const char *request, size_t n_request, char *answer, size_t size);

const char *lum_tls_library(void); /* of OpenSSL: "3.0.19". NULL: there is no TLS */

#endif
