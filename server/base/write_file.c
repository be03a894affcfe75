#include "server/base/write_file.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* part: the file beside path, which is the name for the message. */
static enum lum_status write_part(const char *part, const char *path, const void *bytes, size_t n,
                                  struct lum_error *err)
{
    FILE *f = fopen(part, "wb");
    if (!f)
        return lum_fail(err, LUM_ERR_IO, "", "cannot write %s: %s", path, strerror(errno));
    bool ok = fwrite(bytes, 1, n, f) == n;
    int saved_errno = errno;
    if (fclose(f) != 0 && ok) {
        ok = false;
        saved_errno = errno;
    }
    return ok ? LUM_OK : lum_fail(err, LUM_ERR_IO, "", "cannot write %s: %s", path, strerror(saved_errno));
}

enum lum_status lum_write_file(const char *path, const void *bytes, size_t n, struct lum_error *err)
{
    size_t path_size = strlen(path) + sizeof ".part";
    char *part = lum_calloc(path_size, 1);
    if (!part)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory to write %s", path);
    snprintf(part, path_size, "%s.part", path);
    enum lum_status st = write_part(part, path, bytes, n, err);
    if (!st && rename(part, path) != 0)
        st = lum_fail(err, LUM_ERR_IO, "", "cannot write %s: %s", path, strerror(errno));
    if (st)
        remove(part);
    lum_free(part);
    return st;
}

enum lum_status lum_may_write_file(const char *path, struct lum_error *err)
{
    char folder[4096];
    const char *slash = strrchr(path, '/');
    size_t n = slash ? (size_t)(slash - path) : 0;
    if (n >= sizeof folder)
        return lum_fail(err, LUM_ERR_LIMIT, "", "the path %.100s... is too long", path);
    memcpy(folder, path, n);
    folder[n] = '\0';
    const char *name = slash == path ? "/" : slash ? folder : ".";
    return access(name, W_OK | X_OK) == 0
               ? LUM_OK
               : lum_fail(err, LUM_ERR_IO, "", "cannot write to %.150s: %s", name, strerror(errno));
}
