/* Who may connect, and as what: whoever knows the one token of all, which is made for edits, and the people of a file
 * (people.h), each by a token of her own. */
#ifndef LUM_SERVER_NET_AUTH_H
#define LUM_SERVER_NET_AUTH_H

#include <stdbool.h>
#include <stddef.h>

#include <stdint.h>

#include "core/base/base.h"
#include "server/net/people.h"

#define LUM_TOKEN_MIN_BYTES 16 /* 16 characters of base64url hold 96 bits: not guessable at any rate we answer */
#define LUM_TOKEN_MAX_BYTES 256

struct lum_auth {
    bool required;
    char token[LUM_TOKEN_MAX_BYTES + 1];  /* [A-Za-z0-9_.~-]: it goes into a URL fragment as it is; "": there is none */
    struct lum_people *people;            /* NULL: none by name. Owned; of the net thread */
    _Atomic(struct lum_people *) offered; /* a newer list, which the net thread takes; NULL: none */
};

/* 192 bits from the kernel, as 32 characters. */
LUM_MUST_USE enum lum_status lum_auth_random(struct lum_auth *ret_auth, struct lum_error *err);
/* The first line of the file. Refuses a file that others than its owner may read or write, and a token that is short or
 * does not fit a URL. */
LUM_MUST_USE enum lum_status lum_auth_from_file(const char *path, struct lum_auth *ret_auth, struct lum_error *err);
void lum_auth_finish(struct lum_auth *auth);

/* Whose token is it? token may be NULL. Takes the same time for every wrong token of one length. False: err says why
 * it opens nothing. now_s: of the Unix epoch. */
bool lum_auth_check(const struct lum_auth *auth, const char *token, int64_t now_s, struct lum_person *ret_person,
                    struct lum_error *err);
/* The same of an Authorization header, which says "Bearer TOKEN"; NULL: there was none. */
bool lum_auth_check_header(const struct lum_auth *auth, const char *authorization, int64_t now_s);
/* May who came as this person still be here? */
bool lum_auth_still(const struct lum_auth *auth, const struct lum_person *person, int64_t now_s);

/* Another list of people, taken over: thread: any. */
void lum_auth_offer(struct lum_auth *auth, struct lum_people *people);
/* Net thread. True: there was one, and it is that of auth from here on. */
bool lum_auth_take_offered(struct lum_auth *auth);

#endif
