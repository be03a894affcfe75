/* lumend-import: reads one model, picture or photometric file and writes it as ops (server/import/wire.h describes the
 * stream). It is run by lumend, with the stream on stdout and a socket that hands out files (files.h) as descriptor 3,
 * and reads nothing before it has shut itself in.
 *
 *   lumend-import model NAME ID CPU_S     records named ID/...
 *   lumend-import image NAME ID CPU_S     one image record named ID
 *   lumend-import web NAME ID CPU_S       one light record named ID, with the web of a photometric file
 *
 * For people: lumend-import --to-jsonl FILE prints what lumend would get, as a .jsonl scene. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "protocol/base/limits.h"
#include "server/importer/image.h"
#include "server/importer/importer.h"
#include "server/importer/photometry.h"
#include "server/importer/sandbox.h"
#include "server/importer/to_jsonl.h"

#define FILE_SOCKET 3 /* the first descriptor after the three that every program has; the parent puts it there */

static bool ends_with(const char *s, const char *end)
{
    size_t n = strlen(s), m = strlen(end);
    return n >= m && strcasecmp(s + n - m, end) == 0;
}

static enum lum_status import_model(struct lum_importer *im, const struct lum_bytes *file, struct lum_error *err)
{
    bool glb = file->n >= 4 && memcmp(file->data, "glTF", 4) == 0;
    if (!glb && ends_with(im->asset, ".glb"))
        return lum_fail(err, LUM_ERR_INVALID, "", "not a GLB file: it does not begin with glTF");
    if (glb || ends_with(im->asset, ".gltf"))
        return lum_gltf_import(im, file, err);
    return lum_assimp_import(im, file, err);
}

static enum lum_status import_image(struct lum_importer *im, const char *id, const struct lum_bytes *file,
                                    struct lum_error *err)
{
    struct lum_texels texels = {0};
    enum lum_status status = lum_image_decode(file, &texels, err);
    if (!status)
        status = lum_image_emit(im, id, &texels, false, err);
    lum_free(texels.pixels);
    return status;
}

static enum lum_status import_web(struct lum_importer *im, const char *id, const struct lum_bytes *file,
                                  struct lum_error *err)
{
    struct lum_photometry p;
    struct lum_op_text op;
    enum lum_status status = lum_photometry_read(file, im->asset, &p, err);
    if (!status) {
        lum_photometry_warn(&im->emit, im->asset, &p);
        lum_op_begin(&op, "light", id);
        lum_op_string(&op, "kind", "ies");
        lum_photometry_put(&im->emit, &op, &p);
        status = lum_emit_op(&im->emit, &op, err);
    }
    lum_photometry_finish(&p);
    return status;
}

/* The application code of the protocol's errors. */
static const char *error_code(enum lum_status status)
{
    switch (status) {
    case LUM_ERR_NOT_FOUND:
        return "not_found";
    case LUM_ERR_UNSUPPORTED:
        return "unsupported";
    case LUM_ERR_NOMEM:
    case LUM_ERR_LIMIT:
        return "limit_exceeded";
    default:
        return "import_failed";
    }
}

static enum lum_status run(struct lum_importer *im, const char *kind, const char *id, struct lum_error *err)
{
    struct lum_bytes file = {0};
    lum_emit_progress(&im->emit, "read", 0.0);
    enum lum_status status = lum_files_read(&im->files, im->asset, 0, &file, err);
    if (!status)
        status = strcmp(kind, "model") == 0 ? import_model(im, &file, err)
                 : strcmp(kind, "web") == 0 ? import_web(im, id, &file, err)
                                            : import_image(im, id, &file, err);
    lum_free(file.data);
    return status;
}

static int usage(FILE *out, int status)
{
    fputs(
        "usage: lumend-import --to-jsonl FILE\n"
        "       lumend-import model|image|web NAME ID CPU_S\n"
        "       lumend-import --help | --version\n"
        "Reads models and pictures for lumend, which runs it and hands out files on descriptor 3. It shuts\n"
        "itself in before it reads anything: no network, no files, memory and time with an end.\n"
        "\n"
        "  --to-jsonl FILE    prints a model (glTF, GLB, OBJ, FBX and others) as a .jsonl scene, which lumend --scene\n"
        "                     takes: to see what an import brings, or to edit it by hand\n",
        out);
    return status;
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--help") == 0)
        return usage(stdout, 0);
    if (argc == 2 && strcmp(argv[1], "--version") == 0)
        return puts("lumend-import " LUMEND_VERSION) < 0;
    if (argc == 3 && strcmp(argv[1], "--to-jsonl") == 0)
        return lum_to_jsonl(argv[2]);
    unsigned long cpu_s = argc == 5 ? strtoul(argv[4], NULL, 10) : 0;
    if (cpu_s < 1 || cpu_s > 86400 ||
        (strcmp(argv[1], "model") != 0 && strcmp(argv[1], "image") != 0 && strcmp(argv[1], "web") != 0))
        return usage(stderr, 2);
    struct lum_importer im = {.emit = {.fd = 1}, .files = {FILE_SOCKET}, .asset = argv[2]};
    struct lum_error err = {0};
    lum_ids_init(&im.ids, argv[3]);
    enum lum_status status = lum_sandbox_enter(FILE_SOCKET, (unsigned)cpu_s, &err);
    if (!status)
        status = run(&im, argv[1], argv[3], &err);
    if (status == LUM_ERR_NOMEM)
        snprintf(err.text, sizeof err.text, "needed more than %llu GiB", LUM_LIMIT_IMPORT_MEMORY_BYTES >> 30);
    if (status)
        lum_emit_error(&im.emit, error_code(status), err.text);
    else
        lum_emit_done(&im.emit);
    lum_ids_finish(&im.ids);
    return status ? 1 : 0;
}
