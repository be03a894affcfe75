/* Memory that runs short while a certificate is read, or while hands are shaken: allocations of OpenSSL's failed in
 * turn, and ours. It is refused, nothing leaks, and the next works. They are 15000, nearly all to find out which
 * decoder reads a key: one of some is tried; all of them (a minute) with an argument. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

#include "server/net/tls.h"
#include "tests/unit/failing_alloc.h"
#include "tests/unit/failing_openssl.h"

static unsigned step_of_reading = 127, step_of_shaking = 5;

/* ---- a certificate ---- */

struct fixture {
    char folder[32], cert[64], key[64];
    struct lum_tls_config config;
};

static bool write_key(const char *path, EVP_PKEY *key)
{
    FILE *f = fdopen(open(path, O_WRONLY | O_CREAT | O_EXCL, 0600), "w");
    bool ok = f && PEM_write_PrivateKey(f, key, NULL, NULL, 0, NULL, NULL) == 1;
    return f && fclose(f) == 0 && ok;
}

static bool write_certificate(const char *path, EVP_PKEY *key)
{
    X509 *x = X509_new();
    FILE *f = fopen(path, "w");
    bool ok = x && f && X509_set_version(x, 2) && ASN1_INTEGER_set(X509_get_serialNumber(x), 1) &&
              X509_gmtime_adj(X509_getm_notBefore(x), -60) && X509_gmtime_adj(X509_getm_notAfter(x), 90 * 86400) &&
              X509_NAME_add_entry_by_txt(X509_get_subject_name(x), "CN", MBSTRING_ASC, (const unsigned char *)"lumend",
                                         -1, -1, 0) &&
              X509_set_issuer_name(x, X509_get_subject_name(x)) && X509_set_pubkey(x, key) &&
              X509_sign(x, key, EVP_sha256()) && PEM_write_X509(f, x) && PEM_write_X509(f, x); /* with a chain */
    X509_free(x);
    return f && fclose(f) == 0 && ok;
}

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    EVP_PKEY *key = EVP_EC_gen("P-256");
    if (!f || !key)
        return -1;
    strcpy(f->folder, "/tmp/lumend-tls-XXXXXX");
    if (!mkdtemp(f->folder))
        return -1;
    snprintf(f->cert, sizeof f->cert, "%s/cert.pem", f->folder);
    snprintf(f->key, sizeof f->key, "%s/key.pem", f->folder);
    bool ok = write_key(f->key, key) && write_certificate(f->cert, key);
    EVP_PKEY_free(key);
    f->config = (struct lum_tls_config){.cert_path = f->cert, .key_path = f->key, .hosts = "a.example,b.example"};
    *state = f;
    return ok ? 0 : -1;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    unlink(f->cert);
    unlink(f->key);
    rmdir(f->folder);
    free(f);
    return 0;
}

/* ---- reading ---- */

static void no_memory_for_a_certificate(void **state)
{
    struct fixture *f = *state;
    struct lum_tls *tls;
    struct lum_error err;
    assert_int_equal(lum_tls_create(&f->config, &tls, &err), LUM_OK); /* what the library keeps for good is there */
    unsigned k = 1, n_refused = 0;
    for (bool failed = true; failed; k += step_of_reading) {
        struct lum_tls *other = NULL;
        failing_alloc_arm(k);
        enum lum_status status = lum_tls_create(&f->config, &other, &err), again = lum_tls_read_again(tls, &err);
        failed = failing_alloc_disarm();
        assert_int_equal(ERR_peek_error(), 0); /* it would be taken for one of the next connection */
        if (!status)
            lum_tls_destroy(other);
        n_refused += status || again;
        assert_true(failed || (!status && !again));
        lum_tls_take_offered(tls); /* whatever was read is whole */
        assert_true(lum_tls_ends_s(tls) > 0);
    }
    print_message("of %u allocations one of %u failed in turn, by %u it was refused\n", k, step_of_reading, n_refused);
    assert_true(n_refused > 5);
    lum_tls_destroy(tls);
}

/* ---- shaking hands ---- */

static bool may_begin(void *user, int fd)
{
    (void)fd;
    ++*(unsigned *)user;
    return true;
}

/* The two ends of a connection that is in memory. */
static bool join(SSL *server, SSL *client)
{
    BIO *a, *b;
    if (!server || !client || BIO_new_bio_pair(&a, 0, &b, 0) != 1)
        return false;
    SSL_set_bio(server, a, a);
    SSL_set_bio(client, b, b);
    SSL_set_accept_state(server);
    SSL_set_connect_state(client);
    return true;
}

/* The server's part of what is said runs short of memory. False: the handshake failed. */
static bool shake(SSL *server, SSL *client)
{
    for (int i = 0; i < 20; i++) {
        int c = SSL_do_handshake(client), s = SSL_do_handshake(server);
        if (c == 1 && s == 1)
            return true;
        ERR_clear_error();
    }
    return false;
}

/* True: the k-th allocation of the server failed. */
static bool connect_with_fault(SSL_CTX *server_ctx, SSL_CTX *client_ctx, unsigned k, unsigned *ret_n_ok)
{
    SSL *client = SSL_new(client_ctx), *server = SSL_new(server_ctx);
    bool failed = false, ok = false;
    assert_true(join(server, client));
    SSL_do_handshake(client); /* its hello */
    failing_alloc_arm(k);
    SSL_do_handshake(server); /* nearly all that the server does */
    failed = failing_alloc_disarm();
    ok = shake(server, client);
    *ret_n_ok += ok;
    assert_true(ok || failed);
    SSL_free(server);
    SSL_free(client);
    ERR_clear_error();
    return failed;
}

static void no_memory_to_shake_hands(void **state)
{
    struct fixture *f = *state;
    struct lum_tls *tls;
    struct lum_error err;
    unsigned n_asked = 0, n_ok = 0, n = 1, k = 1;
    SSL_CTX *server = SSL_CTX_new(TLS_server_method()), *client = SSL_CTX_new(TLS_client_method());
    assert_int_equal(lum_tls_create(&f->config, &tls, &err), LUM_OK);
    assert_true(lum_tls_setup(tls, server, may_begin, &n_asked));
    connect_with_fault(server, client, 0, &n_ok); /* what the library keeps for good is there */
    assert_int_equal(n_ok, 1);
    assert_int_equal(n_asked, 1); /* once, whatever was said */
    for (; connect_with_fault(server, client, k, &n_ok); k += step_of_shaking)
        n++;
    print_message("of %u allocations one of %u failed in turn; %u connections came about\n", k, step_of_shaking, n_ok);
    assert_true(n_ok >= 2 && n_ok < n); /* the first and the last; some that fail are of no importance */
    SSL_CTX_free(server);
    SSL_CTX_free(client);
    lum_tls_destroy(tls);
}

static void count_hellos(int written, int version, int type, const void *message, size_t n, SSL *ssl, void *user)
{
    (void)version, (void)ssl;
    if (written && type == SSL3_RT_HANDSHAKE && n > 0)
        *(unsigned *)user += *(const unsigned char *)message == SSL3_MT_CLIENT_HELLO;
}

/* The server has one curve, and the client first tries another: it has to say hello twice. */
static void who_says_hello_twice_begins_once(void **state)
{
    struct fixture *f = *state;
    struct lum_tls *tls;
    struct lum_error err;
    unsigned n_asked = 0;
    SSL_CTX *server_ctx = SSL_CTX_new(TLS_server_method()), *client_ctx = SSL_CTX_new(TLS_client_method());
    assert_int_equal(lum_tls_create(&f->config, &tls, &err), LUM_OK);
    assert_true(lum_tls_setup(tls, server_ctx, may_begin, &n_asked));
    assert_int_equal(SSL_CTX_set1_groups_list(server_ctx, "P-384"), 1);
    assert_int_equal(SSL_CTX_set1_groups_list(client_ctx, "X25519:P-384"), 1);
    SSL *server = SSL_new(server_ctx), *client = SSL_new(client_ctx);
    unsigned n_hellos = 0;
    SSL_set_msg_callback(client, count_hellos);
    SSL_set_msg_callback_arg(client, &n_hellos);
    assert_true(join(server, client));
    assert_true(shake(server, client));
    assert_int_equal(n_hellos, 2);
    assert_int_equal(n_asked, 1);
    SSL_free(server);
    SSL_free(client);
    SSL_CTX_free(server_ctx);
    SSL_CTX_free(client_ctx);
    lum_tls_destroy(tls);
}

static bool may_not_begin(void *user, int fd)
{
    (void)user, (void)fd;
    return false;
}

static void who_may_not_begin_gets_no_answer(void **state)
{
    struct fixture *f = *state;
    struct lum_tls *tls;
    struct lum_error err;
    SSL_CTX *server_ctx = SSL_CTX_new(TLS_server_method()), *client_ctx = SSL_CTX_new(TLS_client_method());
    assert_int_equal(lum_tls_create(&f->config, &tls, &err), LUM_OK);
    assert_true(lum_tls_setup(tls, server_ctx, may_not_begin, NULL));
    SSL *server = SSL_new(server_ctx), *client = SSL_new(client_ctx);
    assert_true(join(server, client));
    assert_false(shake(server, client));
    assert_null(SSL_get_peer_cert_chain(client)); /* not even that was sent */
    SSL_free(server);
    SSL_free(client);
    SSL_CTX_free(server_ctx);
    SSL_CTX_free(client_ctx);
    lum_tls_destroy(tls);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(no_memory_for_a_certificate, set_up, tear_down),
        cmocka_unit_test_setup_teardown(no_memory_to_shake_hands, set_up, tear_down),
        cmocka_unit_test_setup_teardown(who_says_hello_twice_begins_once, set_up, tear_down),
        cmocka_unit_test_setup_teardown(who_may_not_begin_gets_no_answer, set_up, tear_down),
    };
    (void)argv;
    if (argc > 1)
        step_of_reading = step_of_shaking = 1;
    if (!failing_openssl_begin())
        return 1;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
