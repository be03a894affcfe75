/* A scene as a binary glTF 2.0 file, from its records: meshes, materials, pictures and lamps in the words that glTF
 * has, and in `extras` what it has no word for, so that lumend-import makes the same records of it again. Reads records
 * and touches nothing else. Thread: any. */
#ifndef LUM_SERVER_EXPORT_EXPORT_H
#define LUM_SERVER_EXPORT_EXPORT_H

#include "protocol/document/state.h"
#include "server/export/glb.h"

struct lum_export_source {
    struct lum_record *const *records; /* of a whole document, in any order; they outlive the file */
    size_t n;
    uint64_t max_bytes;         /* of the file */
    const _Atomic bool *cancel; /* NULL: nobody stops it */
};

/* Finished; the caller destroys it. */
LUM_MUST_USE enum lum_status lum_export_scene(const struct lum_export_source *source, struct lum_glb **ret_glb,
                                              struct lum_error *err);

#endif
