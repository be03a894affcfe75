#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/importer/assimp.h"

struct memory_file {
    struct lum_bytes bytes;
    size_t at;
    bool owned;
};

static size_t file_read(struct aiFile *f, char *to, size_t size, size_t count)
{
    struct memory_file *m = (struct memory_file *)(void *)f->UserData;
    size_t left = size ? (m->bytes.n - m->at) / size : 0;
    count = count < left ? count : left;
    memcpy(to, m->bytes.data + m->at, count * size);
    m->at += count * size;
    return count;
}

static size_t file_write(struct aiFile *f, const char *from, size_t size, size_t count)
{
    (void)f, (void)from, (void)size, (void)count;
    return 0;
}

static size_t file_tell(struct aiFile *f)
{
    return ((const struct memory_file *)(void *)f->UserData)->at;
}

static size_t file_size(struct aiFile *f)
{
    return ((const struct memory_file *)(void *)f->UserData)->bytes.n;
}

/* Assimp passes negative offsets as huge unsigned ones: the sum wraps to the right place or is out of range. */
static enum aiReturn file_seek(struct aiFile *f, size_t offset, enum aiOrigin origin)
{
    struct memory_file *m = (struct memory_file *)(void *)f->UserData;
    size_t base = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? m->at : m->bytes.n;
    size_t at = base + offset;
    if (at > m->bytes.n)
        return aiReturn_FAILURE;
    m->at = at;
    return aiReturn_SUCCESS;
}

static void file_flush(struct aiFile *f)
{
    (void)f;
}

/* '\' to '/', without "./" in front. False: too long. */
static bool normalize(const char *path, char *ret_name, size_t cap)
{
    while (path[0] == '.' && (path[1] == '/' || path[1] == '\\'))
        path += 2;
    size_t n = strlen(path);
    if (n == 0 || n >= cap)
        return false;
    for (size_t i = 0; i <= n; i++)
        ret_name[i] = path[i] == '\\' ? '/' : path[i];
    return true;
}

enum lum_status lum_assimp_read(struct lum_assimp *a, const char *path, struct lum_bytes *ret_bytes,
                                struct lum_error *err)
{
    char name[LUM_FILE_NAME_BYTES + 1];
    if (!normalize(path, name, sizeof name))
        return lum_fail(err, LUM_ERR_INVALID, "", "a file name is empty or too long");
    enum lum_status status = lum_files_read(&a->im->files, name, LUM_FILE_ANY_CASE, ret_bytes, err);
    const char *slash = strrchr(name, '/');
    if (status && slash && slash[1])
        status = lum_files_read(&a->im->files, slash + 1, LUM_FILE_ANY_CASE, ret_bytes, err);
    return status;
}

static bool open_bytes(struct lum_assimp *a, const char *path, struct memory_file *m)
{
    char name[LUM_FILE_NAME_BYTES + 1];
    if (!normalize(path, name, sizeof name))
        return false;
    if (strcmp(name, a->im->asset) == 0) {
        m->bytes = *a->file;
        return true;
    }
    struct lum_error ignored;
    m->owned = true;
    return lum_files_read(&a->im->files, name, LUM_FILE_ANY_CASE, &m->bytes, &ignored) == LUM_OK;
}

static struct aiFile *io_open(struct aiFileIO *io, const char *path, const char *mode)
{
    if (!mode || mode[0] != 'r' || strchr(mode, '+') || strchr(mode, 'w'))
        return NULL;
    struct aiFile *f = lum_calloc(1, sizeof *f);
    struct memory_file *m = lum_calloc(1, sizeof *m);
    if (!f || !m || !open_bytes((struct lum_assimp *)(void *)io->UserData, path, m)) {
        lum_free(f);
        lum_free(m);
        return NULL;
    }
    *f = (struct aiFile){.ReadProc = file_read,
                         .WriteProc = file_write,
                         .TellProc = file_tell,
                         .FileSizeProc = file_size,
                         .SeekProc = file_seek,
                         .FlushProc = file_flush,
                         .UserData = (aiUserData)(void *)m};
    return f;
}

static void io_close(struct aiFileIO *io, struct aiFile *f)
{
    (void)io;
    if (!f)
        return;
    struct memory_file *m = (struct memory_file *)(void *)f->UserData;
    if (m->owned)
        lum_free(m->bytes.data);
    lum_free(m);
    lum_free(f);
}

struct aiFileIO lum_assimp_io(struct lum_assimp *a)
{
    return (struct aiFileIO){.OpenProc = io_open, .CloseProc = io_close, .UserData = (aiUserData)(void *)a};
}
