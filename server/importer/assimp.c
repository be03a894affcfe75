#include "server/importer/importer.h"

enum lum_status lum_assimp_import(struct lum_importer *im, const struct lum_bytes *file, struct lum_error *err)
{
    (void)file;
    return lum_fail(err, LUM_ERR_UNSUPPORTED, "", "%s: unknown format", im->asset);
}
