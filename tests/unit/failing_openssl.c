#include "tests/unit/failing_openssl.h"

#include <stdlib.h>

#include <openssl/crypto.h>

#include "tests/unit/failing_alloc.h"

static void *from_malloc(size_t n, const char *file, int line)
{
    (void)file, (void)line;
    return failing_malloc(n);
}

static void *from_realloc(void *p, size_t n, const char *file, int line)
{
    (void)file, (void)line;
    return failing_realloc(p, n);
}

static void to_free(void *p, const char *file, int line)
{
    (void)file, (void)line;
    free(p);
}

bool failing_openssl_begin(void)
{
    return CRYPTO_set_mem_functions(from_malloc, from_realloc, to_free) == 1;
}
