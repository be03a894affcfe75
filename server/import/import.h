/* Running lumend-import: the sandboxed program that reads model and image files, so that a hostile file can kill that
 * process and never the daemon. The child opens nothing: it asks this side for files, which opens them below the
 * asset's own directory only (asset.h) and passes descriptors over a socket. This side reads the child's stream under
 * limits, checks it like anything a client sends, and turns it into records. What the two say to each other is in
 * wire.h. */
#ifndef LUM_SERVER_IMPORT_IMPORT_H
#define LUM_SERVER_IMPORT_IMPORT_H

#include <stdatomic.h>

#include "core/base/base.h"
#include "protocol/base/error.h"
#include "protocol/record/record.h"

struct cJSON;

struct lum_import_config {
    const char *importer;    /* path of lumend-import; NULL: beside the running program */
    const char *assets_dir;  /* asset names are resolved below this directory, never above; NULL: there is none */
    const char *uploads_dir; /* those of uploads (asset.h) below this one; NULL: like others */
    uint32_t cpu_s;          /* CPU time that one import may take; 0: LUM_LIMIT_IMPORT_CPU_S */
    struct lum_log log;
    /* NULL, or asked of each record that comes, on the calling thread. False: no more is read, and err says why. */
    bool (*admit)(void *user, const struct lum_record *r, struct lum_proto_error *err);
    void *admit_user;
};

struct lum_import_result {
    struct lum_record **records; /* owned references, in an order that can be added one by one; ids are "IMPORT/..." */
    size_t n_records;
    char (*warnings)[256];
    size_t n_warnings;
    struct cJSON *settings; /* of the record "render", as the file's scene had them: not checked. NULL: none. Owned */
};
void lum_import_result_finish(struct lum_import_result *r);

/* Blocking; run it on a thread of its own. Reads the model `asset` into records as the file has them, whose ids begin
 * with the import's id and "/"; placing them by the import's transform is the document's matter. progress (may be NULL)
 * is called on this thread. *cancel (may be NULL) true: the child is killed. On failure err says what: the child's own
 * error, "timed out after 120 s of CPU", "crashed (signal 11)", "needed more than 4 GiB", with app "import_failed" (or
 * "not_found", "unsupported"). */
bool lum_import_model(const struct lum_import_config *config, const struct lum_record *import,
                      void (*progress)(void *user, const char *stage, double fraction), void *user,
                      const _Atomic bool *cancel, struct lum_import_result *ret_result, struct lum_proto_error *err);

/* Decodes an image asset (PNG, JPEG, HDR, EXR) into a copy of the image record with pixels. */
bool lum_import_image(const struct lum_import_config *config, const struct lum_record *image,
                      const _Atomic bool *cancel, struct lum_record **ret_image, struct lum_proto_error *err);

/* Reads a photometric asset (IES LM-63, EULUMDAT) into a copy of the light record with a web. What was odd in it is
 * told in the result's warnings; it has no records. */
bool lum_import_web(const struct lum_import_config *config, const struct lum_record *light, const _Atomic bool *cancel,
                    struct lum_record **ret_light, struct lum_import_result *ret_result, struct lum_proto_error *err);

#endif
