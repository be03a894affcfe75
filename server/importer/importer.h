/* What every reader gets: where ops go, where files come from, and the ids given out so far. */
#ifndef LUM_SERVER_IMPORTER_IMPORTER_H
#define LUM_SERVER_IMPORTER_IMPORTER_H

#include "server/importer/bytes.h"
#include "server/importer/emit.h"
#include "server/importer/files.h"
#include "server/importer/ids.h"

struct lum_importer {
    struct lum_emit emit;
    struct lum_files files;
    struct lum_ids ids;
    const char *asset;   /* file name: its ending says the format */
    uint32_t n_fixtures; /* of meshes that were sent fixture by fixture */
};

/* glTF 2.0, .gltf or .glb by content. */
LUM_MUST_USE enum lum_status lum_gltf_import(struct lum_importer *im, const struct lum_bytes *file,
                                             struct lum_error *err);
/* Every other model format, by Assimp. */
LUM_MUST_USE enum lum_status lum_assimp_import(struct lum_importer *im, const struct lum_bytes *file,
                                               struct lum_error *err);

#endif
