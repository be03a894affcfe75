/* OpenSSL's memory from failing_alloc.h. */
#ifndef LUM_TESTS_UNIT_FAILING_OPENSSL_H
#define LUM_TESTS_UNIT_FAILING_OPENSSL_H

#include <stdbool.h>

/* Before anything of OpenSSL is used. False: it was. */
bool failing_openssl_begin(void);

#endif
