#define _GNU_SOURCE
#include "server/net/auth.h"

#include <errno.h>
#include <stdatomic.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>

#include "server/net/secret_file.h"

static const char token_alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_.~";

enum lum_status lum_auth_random(struct lum_auth *ret_auth, struct lum_error *err)
{
    unsigned char bytes[32];
    for (size_t got = 0; got < sizeof bytes;) {
        ssize_t n = getrandom(bytes + got, sizeof bytes - got, 0);
        if (n < 0 && errno != EINTR)
            return lum_fail(err, LUM_ERR_INTERNAL, "token", "getrandom: %s", strerror(errno));
        got += n > 0 ? (size_t)n : 0;
    }
    memset(ret_auth, 0, sizeof *ret_auth);
    ret_auth->required = true;
    for (size_t i = 0; i < sizeof bytes; i++)
        ret_auth->token[i] = token_alphabet[bytes[i] & 63]; /* 6 bits a character, uniform */
    return LUM_OK;
}

static enum lum_status token_from_line(const char *path, const char *line, struct lum_auth *ret_auth,
                                       struct lum_error *err)
{
    size_t n = strspn(line, token_alphabet);
    if (line[n + strspn(line + n, " \t\r")] != '\0')
        return lum_fail(err, LUM_ERR_INVALID, "token-file", "%s: a token is made of A-Z a-z 0-9 - _ . ~", path);
    if (n < LUM_TOKEN_MIN_BYTES || n > LUM_TOKEN_MAX_BYTES)
        return lum_fail(err, LUM_ERR_INVALID, "token-file", "%s: a token has %d to %d characters, this one %zu", path,
                        LUM_TOKEN_MIN_BYTES, LUM_TOKEN_MAX_BYTES, n);
    memset(ret_auth, 0, sizeof *ret_auth);
    ret_auth->required = true;
    memcpy(ret_auth->token, line, n);
    return LUM_OK;
}

enum lum_status lum_auth_from_file(const char *path, struct lum_auth *ret_auth, struct lum_error *err)
{
    char line[LUM_TOKEN_MAX_BYTES + 3];
    size_t n;
    enum lum_status status = lum_secret_file_read(LUM_FILE_OF_OWNER, "token-file", path, line, sizeof line, &n, err);
    if (status)
        return status;
    line[strcspn(line, "\n")] = '\0';
    return token_from_line(path, line, ret_auth, err);
}

void lum_auth_finish(struct lum_auth *auth)
{
    lum_free(auth->people);
    lum_free(atomic_exchange(&auth->offered, NULL));
    auth->people = NULL;
}

static bool is_the_one(const struct lum_auth *auth, const char *token)
{
    size_t n = strlen(token), expected = strlen(auth->token);
    if (n != expected || expected == 0)
        return false;
    volatile unsigned char differs = 0; /* volatile: no early exit by the optimiser */
    for (size_t i = 0; i < n; i++)
        differs = (unsigned char)(differs | (token[i] ^ auth->token[i]));
    return differs == 0;
}

/* Both are asked, whatever the first says. */
static const struct lum_person *find(const struct lum_auth *auth, const char *token, const struct lum_person *one)
{
    uint8_t sha[LUM_TOKEN_SHA_BYTES];
    const struct lum_person *named = NULL;
    bool is_one = is_the_one(auth, token);
    if (auth->people && token[0] && lum_token_sha(token, sha))
        named = lum_people_find(auth->people, sha);
    return named ? named : is_one ? one : NULL;
}

bool lum_auth_check(const struct lum_auth *auth, const char *token, int64_t now_s, struct lum_person *ret_person,
                    struct lum_error *err)
{
    const struct lum_person all = {.role = LUM_ROLE_EDIT, .ends_s = LUM_NEVER_S};
    token = token ? token : "";
    const struct lum_person *p = auth->required ? find(auth, token, &all) : &all;
    if (p && now_s < p->ends_s) {
        *ret_person = *p;
        return true;
    }
    if (p)
        lum_fail(err, LUM_ERR_INVALID, "token", "the time of this token, of %s, is over", p->name);
    else if (token[0])
        lum_fail(err, LUM_ERR_INVALID, "token", "this is not %s token of this server", auth->people ? "a" : "the");
    else
        lum_fail(err, LUM_ERR_INVALID, "token", "a token is needed: %s",
                 auth->people ? "yours is known to who runs this server" : "it is in the URL that the server printed");
    return false;
}

bool lum_auth_check_header(const struct lum_auth *auth, const char *authorization, int64_t now_s)
{
    static const char scheme[] = "Bearer ";
    struct lum_person person;
    bool bearer = authorization && strncasecmp(authorization, scheme, sizeof scheme - 1) == 0;
    return lum_auth_check(auth, bearer ? authorization + sizeof scheme - 1 : NULL, now_s, &person, NULL);
}

bool lum_auth_still(const struct lum_auth *auth, const struct lum_person *person, int64_t now_s)
{
    return now_s < person->ends_s && (person->name[0] == '\0' || lum_people_have(auth->people, person));
}

void lum_auth_offer(struct lum_auth *auth, struct lum_people *people)
{
    lum_free(atomic_exchange(&auth->offered, people));
}

bool lum_auth_take_offered(struct lum_auth *auth)
{
    struct lum_people *people = atomic_exchange(&auth->offered, NULL);
    if (!people)
        return false;
    lum_free(auth->people);
    auth->people = people;
    return true;
}
