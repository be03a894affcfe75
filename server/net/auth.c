#define _GNU_SOURCE
#include "server/net/auth.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

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
    enum lum_status status;
    struct stat st;
    char line[LUM_TOKEN_MAX_BYTES + 3];
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return lum_fail(err, LUM_ERR_IO, "token-file",
                        "cannot read the token file %s: %s (without --token-file a token is made)", path,
                        strerror(errno));
    if (fstat(fd, &st)) {
        status = lum_fail(err, LUM_ERR_IO, "token-file", "%s: %s", path, strerror(errno));
        goto done;
    }
    if (st.st_mode & (S_IRWXG | S_IRWXO)) {
        status = lum_fail(err, LUM_ERR_INVALID, "token-file",
                          "%s: its mode is %03o, so others than its owner may use it: chmod 600 %s", path,
                          (unsigned)st.st_mode & 0777u, path);
        goto done;
    }
    ssize_t n = read(fd, line, sizeof line - 1);
    if (n < 0) {
        status = lum_fail(err, LUM_ERR_IO, "token-file", "%s: %s", path, strerror(errno));
        goto done;
    }
    line[n] = '\0';
    line[strcspn(line, "\n")] = '\0';
    status = token_from_line(path, line, ret_auth, err);
done:
    close(fd);
    return status;
}

bool lum_auth_check(const struct lum_auth *auth, const char *token)
{
    if (!auth->required)
        return true;
    size_t n = token ? strlen(token) : 0, expected = strlen(auth->token);
    if (n != expected)
        return false;
    volatile unsigned char differs = 0; /* volatile: no early exit by the optimiser */
    for (size_t i = 0; i < n; i++)
        differs = (unsigned char)(differs | (token[i] ^ auth->token[i]));
    return differs == 0;
}

bool lum_auth_check_header(const struct lum_auth *auth, const char *authorization)
{
    static const char scheme[] = "Bearer ";
    bool bearer = authorization && strncasecmp(authorization, scheme, sizeof scheme - 1) == 0;
    return lum_auth_check(auth, bearer ? authorization + sizeof scheme - 1 : NULL);
}
