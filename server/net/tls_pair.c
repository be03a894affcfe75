#define _GNU_SOURCE
#include "server/net/tls_pair.h"

#include <string.h>
#include <time.h>

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include "server/net/secret_file.h"

#define FILE_BYTES_MAX (256u << 10) /* a chain of ten certificates has some 20 KiB */
#define CHAIN_MAX 16

const char *lum_tls_why(void)
{
    unsigned long code = ERR_peek_last_error();
    const char *why = code ? ERR_reason_error_string(code) : NULL;
    ERR_clear_error();
    return why ? why : "OpenSSL refuses it";
}

struct pem {
    BIO *bio;
    char *text;
    size_t n;
};

/* cleared: it may have been a key. */
static void pem_close(struct pem *pem)
{
    BIO_free(pem->bio);
    if (pem->text)
        OPENSSL_cleanse(pem->text, pem->n);
    lum_free(pem->text);
}

static enum lum_status pem_open(enum lum_file_readers readers, const char *option, const char *path,
                                struct pem *ret_pem, struct lum_error *err)
{
    *ret_pem = (struct pem){.text = lum_calloc(1, FILE_BYTES_MAX)};
    if (!ret_pem->text)
        return lum_fail(err, LUM_ERR_NOMEM, option, "no memory for the file of --%s", option);
    enum lum_status status =
        lum_secret_file_read(readers, option, path, ret_pem->text, FILE_BYTES_MAX, &ret_pem->n, err);
    if (!status && ret_pem->n == FILE_BYTES_MAX - 1)
        status = lum_fail(err, LUM_ERR_INVALID, option, "%s: of --%s at most %u KiB are read", path, option,
                          FILE_BYTES_MAX >> 10);
    if (!status && !(ret_pem->bio = BIO_new_mem_buf(ret_pem->text, (int)ret_pem->n)))
        status = lum_fail(err, LUM_ERR_NOMEM, option, "no memory for the file of --%s", option);
    if (status)
        pem_close(ret_pem);
    return status;
}

/* True: the text ends here, as it should. */
static bool ends_well(void)
{
    bool end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
    if (end)
        ERR_clear_error();
    return end;
}

static enum lum_status read_chain(const char *path, BIO *bio, struct lum_tls_pair *p, struct lum_error *err)
{
    X509 *next;
    p->leaf = PEM_read_bio_X509_AUX(bio, NULL, NULL, NULL);
    p->chain = sk_X509_new_null();
    if (!p->leaf || !p->chain)
        return lum_fail(err, LUM_ERR_INVALID, "tls-cert",
                        ends_well() ? "%s has no certificate in PEM (-----BEGIN CERTIFICATE-----)"
                                    : "%s: its certificate cannot be read",
                        path);
    while ((next = PEM_read_bio_X509(bio, NULL, NULL, NULL))) {
        if (sk_X509_num(p->chain) == CHAIN_MAX || !sk_X509_push(p->chain, next)) {
            X509_free(next);
            return lum_fail(err, LUM_ERR_INVALID, "tls-cert", "%s has more than %d certificates after the first", path,
                            CHAIN_MAX);
        }
    }
    if (!ends_well())
        return lum_fail(err, LUM_ERR_INVALID, "tls-cert", "%s: certificate %d cannot be read: %s", path,
                        sk_X509_num(p->chain) + 2, lum_tls_why());
    return LUM_OK;
}

/* Nobody is at a terminal to be asked. */
static int no_passphrase(char *out, int size, int writing, void *asked)
{
    (void)out, (void)size, (void)writing;
    *(bool *)asked = true;
    return -1;
}

static enum lum_status read_key(const char *path, const struct pem *pem, struct lum_tls_pair *p, struct lum_error *err)
{
    bool asked = false;
    p->key = PEM_read_bio_PrivateKey(pem->bio, NULL, no_passphrase, &asked);
    if (p->key)
        return LUM_OK;
    if (asked)
        return lum_fail(err, LUM_ERR_INVALID, "tls-key",
                        "%s has a passphrase, which nobody can be asked for: openssl pkey -in %s -out KEY", path, path);
    return lum_fail(err, LUM_ERR_INVALID, "tls-key",
                    strstr(pem->text, "PRIVATE KEY-----")
                        ? "%s: its private key cannot be read"
                        : "%s has no private key in PEM (-----BEGIN PRIVATE KEY-----)",
                    path);
}

static bool to_unix(const ASN1_TIME *t, int64_t *ret_s)
{
    struct tm tm;
    if (!t || !ASN1_TIME_to_tm(t, &tm))
        return false;
    *ret_s = (int64_t)timegm(&tm);
    return true;
}

static enum lum_status check(const struct lum_tls_config *c, struct lum_tls_pair *p, struct lum_error *err)
{
    if (!X509_check_private_key(p->leaf, p->key)) {
        ERR_clear_error();
        return lum_fail(err, LUM_ERR_INVALID, "tls-key", "the key in %s is not that of the certificate in %s",
                        c->key_path, c->cert_path);
    }
    if (!to_unix(X509_get0_notBefore(p->leaf), &p->begins_s) || !to_unix(X509_get0_notAfter(p->leaf), &p->ends_s))
        return lum_fail(err, LUM_ERR_INVALID, "tls-cert", "%s: its time cannot be read", c->cert_path);
    return LUM_OK;
}

static enum lum_status read_into(const struct lum_tls_config *c, struct lum_tls_pair *p, struct lum_error *err)
{
    struct pem pem;
    enum lum_status status = pem_open(LUM_FILE_OF_ALL, "tls-cert", c->cert_path, &pem, err);
    if (status)
        return status;
    status = read_chain(c->cert_path, pem.bio, p, err);
    pem_close(&pem);
    if (!status)
        status = pem_open(LUM_FILE_OF_OWNER_OR_ROOTS_GROUP, "tls-key", c->key_path, &pem, err);
    if (status)
        return status;
    status = read_key(c->key_path, &pem, p, err);
    pem_close(&pem);
    return status ? status : check(c, p, err);
}

enum lum_status lum_tls_pair_read(const struct lum_tls_config *config, struct lum_tls_pair **ret_pair,
                                  struct lum_error *err)
{
    struct lum_tls_pair *p = lum_calloc(1, sizeof *p);
    if (!p)
        return lum_fail(err, LUM_ERR_NOMEM, "tls-cert", "no memory for the certificate");
    ERR_clear_error();
    enum lum_status status = read_into(config, p, err);
    ERR_clear_error();
    if (status)
        lum_tls_pair_free(p);
    else
        *ret_pair = p;
    return status;
}

void lum_tls_pair_free(struct lum_tls_pair *pair)
{
    if (!pair)
        return;
    X509_free(pair->leaf);
    sk_X509_pop_free(pair->chain, X509_free);
    EVP_PKEY_free(pair->key);
    lum_free(pair);
}
