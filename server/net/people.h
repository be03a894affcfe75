/* The file of --tokens: who may connect, as what, and until when. One line a person:
 *
 *   ann edit sha256:9f86d081884c7d65... 2027-01-31
 *
 * It holds no token, but the SHA-256 of each: who reads it can let nobody in. A salt and a slow hash, as passwords need
 * them, would add nothing: tokens are 192 random bits (lumend token), which nobody finds by trying. */
#ifndef LUM_SERVER_NET_PEOPLE_H
#define LUM_SERVER_NET_PEOPLE_H

#include <stdint.h>

#include "core/base/base.h"
#include "server/base/role.h"

#define LUM_PEOPLE_MAX 1024u     /* of one server, which has 64 sessions; all are looked at for each hello */
#define LUM_PERSON_NAME_BYTES 32 /* with a session's number behind it it is a user's, of LUM_LIMIT_ID_BYTES */
#define LUM_TOKEN_SHA_BYTES 32   /* SHA-256 */
#define LUM_TOKEN_SHA_PREFIX "sha256:"
#define LUM_NEVER_S INT64_MAX

struct lum_person {
    char name[LUM_PERSON_NAME_BYTES + 1]; /* [A-Za-z0-9_.-]; "": whoever knows the one token of all */
    enum lum_role role;
    int64_t ends_s; /* seconds of the Unix epoch from which on the token is none; LUM_NEVER_S: never */
    uint8_t sha[LUM_TOKEN_SHA_BYTES];
};
struct lum_people {
    size_t n;
    struct lum_person list[];
};

/* False: libcrypto has no memory. */
LUM_MUST_USE bool lum_token_sha(const char *token, uint8_t ret_sha[LUM_TOKEN_SHA_BYTES]);
/* [A-Za-z0-9_.-], 1 to LUM_PERSON_NAME_BYTES of them. */
bool lum_person_name_is(const char *name);
/* "2027-01-31": the token is good until the end of that day, of UTC. */
bool lum_person_date_parse(const char *text, int64_t *ret_ends_s);

/* All lines or none: err names the first that is wrong. path: for messages. lum_people_read gives a block that
 * lum_free frees. */
LUM_MUST_USE enum lum_status lum_people_parse(const char *path, char *text, struct lum_people **ret_people,
                                              struct lum_error *err);
LUM_MUST_USE enum lum_status lum_people_read(const char *path, struct lum_people **ret_people, struct lum_error *err);

/* Whose token it is; NULL: nobody's. Takes the same time whoever it is, and whether it is anybody's: every line is
 * compared to its end. */
const struct lum_person *lum_people_find(const struct lum_people *people, const uint8_t sha[LUM_TOKEN_SHA_BYTES]);
/* Is this one still there, with the same token, role and end? */
bool lum_people_have(const struct lum_people *people, const struct lum_person *person);

#endif
