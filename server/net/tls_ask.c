#include <openssl/err.h>
#include <openssl/ssl.h>

#include "server/net/tls.h"

/* Reads until there is no more. */
static size_t exchange(SSL *ssl, const char *request, size_t n_request, char *answer, size_t size)
{
    size_t n = 0, got = 0;
    if (SSL_connect(ssl) != 1 || SSL_write_ex(ssl, request, n_request, &got) != 1)
        return 0;
    while (n + 1 < size && SSL_read_ex(ssl, answer + n, size - 1 - n, &got) == 1)
        n += got;
    answer[n] = '\0';
    return n;
}

size_t lum_tls_ask(int fd, const char *request, size_t n_request, char *answer, size_t size)
{
    size_t n = 0;
    SSL_CTX *ctx = SSL_CTX_new(TLS_client_method());
    SSL *ssl = ctx ? SSL_new(ctx) : NULL; /* as made, it looks at no certificate */
    if (ssl && SSL_set_fd(ssl, fd) == 1)
        n = exchange(ssl, request, n_request, answer, size);
    SSL_free(ssl);
    SSL_CTX_free(ctx);
    ERR_clear_error();
    return n;
}
