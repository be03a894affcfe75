/* lumend token: lets somebody in by a token of her own. */
#define _GNU_SOURCE
#include "server/cli/commands.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/cli/help.h"
#include "server/cli/option.h"
#include "server/net/auth.h"

static const char usage[] =
    "usage: lumend token NAME [options]\n"
    "Makes a token for NAME: 192 random bits, printed once, on standard output. What --tokens FILE needs of it is a "
    "line:\n"
    "\n"
    "  NAME ROLE sha256:HASH [LAST DAY]\n"
    "\n"
    "The line has no secret in it: who reads the file can let nobody in. It is added to FILE, or, without --tokens,\n"
    "printed on standard error. A daemon reads FILE when it starts, and at SIGHUP. Whoever has no line any more, or\n"
    "another role, token or day, is sent away then. Lines that begin with # are comments.\n"
    "\n"
    "view     may see the scene, from views of one's own, and pick and read what is in the picture\n"
    "measure  may also ask how much light falls where: points, sensors\n"
    "edit     may also change the scene, and look into the folder of models\n"
    "admin    may also see who is here, and end sessions\n"
    "\n"
    "Each opens /metrics, too: give Prometheus a token of its own, with the role view.\n"
    "Give people the address http://SERVER/#t=TOKEN: what is behind # is not sent to anybody.\n"
    "\n"
    "Options:\n";

struct options {
    const char *role, *until, *tokens;
};

#define AT(m) .offset = offsetof(struct options, m)
static const struct lum_option_row rows[] = {
    {"role", "ROLE", .kind = LUM_OPTION_TEXT, AT(role), .help = "view, measure, edit or admin; default: edit"},
    {"until", "DATE", .kind = LUM_OPTION_TEXT, AT(until),
     .help = "the last day, of UTC, like 2027-01-31; default: for ever"},
    {"tokens", "FILE", .kind = LUM_OPTION_TEXT, AT(tokens),
     .help = "adds the line to FILE, which is made where there is none, readable by its owner alone"},
};

static void line_of(const char *name, const struct options *o, const uint8_t sha[LUM_TOKEN_SHA_BYTES], char *out,
                    size_t size)
{
    char hex[2 * LUM_TOKEN_SHA_BYTES + 1];
    for (int i = 0; i < LUM_TOKEN_SHA_BYTES; i++)
        snprintf(hex + 2 * i, 3, "%02x", sha[i]);
    snprintf(out, size, "%s %s " LUM_TOKEN_SHA_PREFIX "%s%s%s\n", name, o->role ? o->role : "edit", hex,
             o->until ? " " : "", o->until ? o->until : "");
}

/* In one write: a daemon that reads the file meanwhile sees all of the line or nothing. */
static enum lum_status append(int fd, const char *path, const char *line, struct lum_error *err)
{
    struct stat st;
    char last = '\n', text[260];
    if (fstat(fd, &st) || (st.st_size > 0 && pread(fd, &last, 1, st.st_size - 1) != 1))
        return lum_fail(err, LUM_ERR_IO, "tokens", "%s: %s", path, strerror(errno));
    int n = snprintf(text, sizeof text, "%s%s", last == '\n' ? "" : "\n", line);
    errno = ENOSPC; /* of a write that takes a part */
    if (write(fd, text, (size_t)n) != n || fsync(fd))
        return lum_fail(err, LUM_ERR_IO, "tokens", "%s: %s", path, strerror(errno));
    return LUM_OK;
}

static enum lum_status add_line(const char *path, const char *name, const char *line, struct lum_error *err)
{
    struct lum_people *people = NULL;
    int fd = open(path, O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0)
        return lum_fail(err, LUM_ERR_IO, "tokens", "%s cannot be written: %s", path, strerror(errno));
    enum lum_status status = lum_people_read(path, &people, err); /* nothing is added to what is wrong already */
    for (size_t i = 0; !status && i < people->n; i++)
        if (strcmp(people->list[i].name, name) == 0)
            status =
                lum_fail(err, LUM_ERR_INVALID, "tokens", "%s has a line in %s already: take it out first", name, path);
    if (!status && people->n == LUM_PEOPLE_MAX)
        status = lum_fail(err, LUM_ERR_LIMIT, "tokens", "%s has its %u people already", path, LUM_PEOPLE_MAX);
    if (!status)
        status = append(fd, path, line, err);
    lum_free(people);
    close(fd);
    return status;
}

static enum lum_status check(const char *name, const struct options *o, struct lum_error *err)
{
    enum lum_role role;
    int64_t ends_s;
    if (!lum_person_name_is(name))
        return lum_fail(err, LUM_ERR_INVALID, "name", "a name has 1 to %d characters of A-Z a-z 0-9 _ . -",
                        LUM_PERSON_NAME_BYTES);
    if (o->role && !lum_role_parse(o->role, &role))
        return lum_fail(err, LUM_ERR_INVALID, "role", "--role must be " LUM_ROLE_NAMES ", not '%.60s'", o->role);
    if (o->until && !lum_person_date_parse(o->until, &ends_s))
        return lum_fail(err, LUM_ERR_INVALID, "until", "--until must be a date like 2027-01-31, not '%.60s'", o->until);
    return LUM_OK;
}

static enum lum_status make(const char *name, const struct options *o, struct lum_error *err)
{
    struct lum_auth auth;
    uint8_t sha[LUM_TOKEN_SHA_BYTES];
    char line[256];
    enum lum_status status = lum_auth_random(&auth, err);
    if (!status && !lum_token_sha(auth.token, sha))
        status = lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a token");
    if (status)
        return status;
    line_of(name, o, sha, line, sizeof line);
    if (o->tokens)
        status = add_line(o->tokens, name, line, err);
    else
        fputs(line, stderr);
    if (!status && (printf("%s\n", auth.token) < 0 || fflush(stdout)))
        status = lum_fail(err, LUM_ERR_IO, "", "the token cannot be printed");
    return status;
}

static int fail(int status, const struct lum_error *err)
{
    fprintf(stderr, "lumend token: %s\n", err->text);
    return status;
}

void lum_help_token(const struct lum_help *h)
{
    lum_help_text(h, usage);
    lum_help_options(h, rows, LUM_ARRAY_LEN(rows));
}

int lum_cmd_token(int argc, char **argv)
{
    struct options o = {0};
    struct lum_option_words words = {0};
    struct lum_error err = {0};
    if (argc == 2 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0)) {
        lum_help_token(&(struct lum_help){stdout, false});
        return LUM_EXIT_OK;
    }
    if (lum_option_parse(argc, argv, rows, LUM_ARRAY_LEN(rows), &words, NULL, &o, &err))
        return fail(LUM_EXIT_USAGE, &err);
    if (words.n != 1) {
        lum_fail(&err, LUM_ERR_INVALID, "", "needs a name (see: lumend token --help)");
        return fail(LUM_EXIT_USAGE, &err);
    }
    if (check(words.list[0], &o, &err))
        return fail(LUM_EXIT_USAGE, &err);
    return make(words.list[0], &o, &err) ? fail(LUM_EXIT_FAILED, &err) : LUM_EXIT_OK;
}
