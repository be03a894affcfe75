/* The access token: who knows it may edit. */
#ifndef LUM_SERVER_NET_AUTH_H
#define LUM_SERVER_NET_AUTH_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/base.h"

#define LUM_TOKEN_MIN_BYTES 16 /* 16 characters of base64url hold 96 bits: not guessable at any rate we answer */
#define LUM_TOKEN_MAX_BYTES 256

struct lum_auth {
    bool required;
    char token[LUM_TOKEN_MAX_BYTES + 1]; /* [A-Za-z0-9_.~-]: it goes into a URL fragment as it is */
};

/* 192 bits from the kernel, as 32 characters. */
LUM_MUST_USE enum lum_status lum_auth_random(struct lum_auth *ret_auth, struct lum_error *err);
/* The first line of the file. Refuses a file that others than its owner may read or write, and a token that is short or
 * does not fit a URL. */
LUM_MUST_USE enum lum_status lum_auth_from_file(const char *path, struct lum_auth *ret_auth, struct lum_error *err);
/* token may be NULL. Takes the same time for every wrong token of one length. */
bool lum_auth_check(const struct lum_auth *auth, const char *token);
/* The same of an Authorization header, which says "Bearer TOKEN"; NULL: there was none. */
bool lum_auth_check_header(const struct lum_auth *auth, const char *authorization);

#endif
