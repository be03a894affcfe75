#define _GNU_SOURCE /* timegm */
#include "server/net/people.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <openssl/evp.h>

#include "server/net/secret_file.h"

#define LINE_BYTES_MAX 256u /* of a person: with the longest name it takes 130 */
#define FILE_BYTES_MAX (LUM_PEOPLE_MAX * LINE_BYTES_MAX)
#define DAY_S 86400 /* dates are days of UTC, without leap seconds */

bool lum_token_sha(const char *token, uint8_t ret_sha[LUM_TOKEN_SHA_BYTES])
{
    unsigned n = 0;
    return EVP_Digest(token, strlen(token), ret_sha, &n, EVP_sha256(), NULL) == 1 && n == LUM_TOKEN_SHA_BYTES;
}

bool lum_person_name_is(const char *name)
{
    size_t n = 0;
    while (isalnum((unsigned char)name[n]) || (name[n] && strchr("_.-", name[n])))
        n++;
    return n > 0 && n <= LUM_PERSON_NAME_BYTES && name[n] == '\0';
}

bool lum_person_date_parse(const char *text, int64_t *ret_ends_s)
{
    static const char form[] = "dddd-dd-dd";
    struct tm day = {0};
    if (strlen(text) != sizeof form - 1)
        return false;
    for (size_t i = 0; i < sizeof form - 1; i++)
        if (form[i] == 'd' ? !isdigit((unsigned char)text[i]) : text[i] != form[i])
            return false;
    sscanf(text, "%d-%d-%d", &day.tm_year, &day.tm_mon, &day.tm_mday);
    day.tm_year -= 1900;
    day.tm_mon -= 1;
    const struct tm given = day;
    int64_t begin_s = timegm(&day);
    if (day.tm_year != given.tm_year || day.tm_mon != given.tm_mon || day.tm_mday != given.tm_mday)
        return false; /* there is no such day: it was made another */
    *ret_ends_s = begin_s + DAY_S;
    return true;
}

static int hex_value(char c)
{
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static bool parse_sha(const char *text, uint8_t ret_sha[LUM_TOKEN_SHA_BYTES])
{
    static const size_t n_prefix = sizeof LUM_TOKEN_SHA_PREFIX - 1;
    if (strncmp(text, LUM_TOKEN_SHA_PREFIX, n_prefix) != 0 || strlen(text) != n_prefix + 2 * LUM_TOKEN_SHA_BYTES)
        return false;
    for (size_t i = 0; i < LUM_TOKEN_SHA_BYTES; i++) {
        int high = hex_value(text[n_prefix + 2 * i]), low = hex_value(text[n_prefix + 2 * i + 1]);
        if (high < 0 || low < 0)
            return false;
        ret_sha[i] = (uint8_t)(high << 4 | low);
    }
    return true;
}

/* path:line, for messages. */
struct place {
    const char *path;
    unsigned line;
};

/* Words are never repeated in messages: one may be a token. */
static enum lum_status parse_person(const struct place *at, char *line, struct lum_person *ret_person,
                                    struct lum_error *err)
{
    char *words[5] = {0}, *save = NULL;
    size_t n = 0;
    for (char *w = strtok_r(line, " \t\r", &save); w && n < LUM_ARRAY_LEN(words); w = strtok_r(NULL, " \t\r", &save))
        words[n++] = w;
    *ret_person = (struct lum_person){.ends_s = LUM_NEVER_S};
    if (n < 3 || n > 4)
        return lum_fail(err, LUM_ERR_INVALID, "tokens",
                        "%s:%u: a line is NAME ROLE sha256:HASH and, if the token is to end, a date", at->path,
                        at->line);
    if (!lum_person_name_is(words[0]))
        return lum_fail(err, LUM_ERR_INVALID, "tokens", "%s:%u: a name has 1 to %d characters of A-Z a-z 0-9 _ . -",
                        at->path, at->line, LUM_PERSON_NAME_BYTES);
    if (!lum_role_parse(words[1], &ret_person->role))
        return lum_fail(err, LUM_ERR_INVALID, "tokens", "%s:%u: the role of %s must be " LUM_ROLE_NAMES, at->path,
                        at->line, words[0]);
    if (!parse_sha(words[2], ret_person->sha))
        return lum_fail(err, LUM_ERR_INVALID, "tokens",
                        "%s:%u: third comes sha256: and the 64 hexadecimal digits of the token's SHA-256, never the "
                        "token itself: lumend token %s makes both",
                        at->path, at->line, words[0]);
    if (n == 4 && !lum_person_date_parse(words[3], &ret_person->ends_s))
        return lum_fail(err, LUM_ERR_INVALID, "tokens", "%s:%u: the last day of %s must be a date like 2027-01-31",
                        at->path, at->line, words[0]);
    strcpy(ret_person->name, words[0]);
    return LUM_OK;
}

static enum lum_status add_person(const struct place *at, const struct lum_person *p, struct lum_people *people,
                                  struct lum_error *err)
{
    for (size_t i = 0; i < people->n; i++) {
        bool same_name = strcmp(people->list[i].name, p->name) == 0;
        if (same_name || memcmp(people->list[i].sha, p->sha, sizeof p->sha) == 0)
            return lum_fail(err, LUM_ERR_INVALID, "tokens",
                            same_name ? "%s:%u: %s has a line already" : "%s:%u: the token of %s is that of another",
                            at->path, at->line, p->name);
    }
    if (people->n == LUM_PEOPLE_MAX)
        return lum_fail(err, LUM_ERR_LIMIT, "tokens", "%s:%u: more than %u people", at->path, at->line, LUM_PEOPLE_MAX);
    people->list[people->n++] = *p;
    return LUM_OK;
}

enum lum_status lum_people_parse(const char *path, char *text, struct lum_people **ret_people, struct lum_error *err)
{
    enum lum_status status = LUM_OK;
    struct place at = {.path = path};
    struct lum_people *people = lum_calloc(1, sizeof *people + LUM_PEOPLE_MAX * sizeof *people->list);
    if (!people)
        return lum_fail(err, LUM_ERR_NOMEM, "tokens", "no memory for the people of %s", path);
    for (char *line = text, *next; line && !status; line = next) {
        struct lum_person person;
        next = strchr(line, '\n');
        if (next)
            *next++ = '\0';
        at.line++;
        line += strspn(line, " \t\r");
        if (line[0] == '\0' || line[0] == '#')
            continue;
        status = parse_person(&at, line, &person, err);
        if (!status)
            status = add_person(&at, &person, people, err);
    }
    if (status) {
        lum_free(people);
        return status;
    }
    *ret_people = people;
    return LUM_OK;
}

enum lum_status lum_people_read(const char *path, struct lum_people **ret_people, struct lum_error *err)
{
    size_t n;
    char *text = lum_calloc(1, FILE_BYTES_MAX + 2);
    if (!text)
        return lum_fail(err, LUM_ERR_NOMEM, "tokens", "no memory to read %s", path);
    enum lum_status status = lum_secret_file_read(LUM_FILE_OF_OWNER, "tokens", path, text, FILE_BYTES_MAX + 2, &n, err);
    if (!status && n > FILE_BYTES_MAX)
        status = lum_fail(err, LUM_ERR_LIMIT, "tokens", "%s has more than %u bytes", path, FILE_BYTES_MAX);
    if (!status && strlen(text) != n)
        status = lum_fail(err, LUM_ERR_INVALID, "tokens", "%s has a zero byte", path);
    if (!status)
        status = lum_people_parse(path, text, ret_people, err);
    lum_free(text);
    return status;
}

/* 1 or 0, without a branch on what the bytes are. */
static size_t same_sha(const uint8_t *a, const uint8_t *b)
{
    volatile uint32_t differs = 0; /* volatile: no early exit by the optimiser */
    for (size_t i = 0; i < LUM_TOKEN_SHA_BYTES; i++)
        differs = differs | (uint32_t)(a[i] ^ b[i]);
    return (differs - 1u) >> 31;
}

const struct lum_person *lum_people_find(const struct lum_people *people, const uint8_t sha[LUM_TOKEN_SHA_BYTES])
{
    size_t found = 0; /* number of the line, from 1 on */
    for (size_t i = 0; i < people->n; i++)
        found |= (i + 1) * same_sha(people->list[i].sha, sha); /* no two lines have the same */
    return found ? &people->list[found - 1] : NULL;
}

bool lum_people_have(const struct lum_people *people, const struct lum_person *person)
{
    for (size_t i = 0; people && i < people->n; i++) {
        const struct lum_person *p = &people->list[i];
        if (strcmp(p->name, person->name) == 0)
            return p->role == person->role && p->ends_s == person->ends_s && same_sha(p->sha, person->sha);
    }
    return false;
}
