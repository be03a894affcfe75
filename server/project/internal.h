/* What store.c (projects as folders) and copy.c (what is in them, for others) share. */
#ifndef LUM_SERVER_PROJECT_INTERNAL_H
#define LUM_SERVER_PROJECT_INTERNAL_H

#include "server/project/store.h"

#define LUM_PROJECT_PART "part."
#define LUM_PROJECT_VERSION "version."
#define LUM_PROJECT_FOLDER_BYTES 64 /* of a name: the longest is one in the trash */

/* What is being made, and if nobody makes it, is of a crash. Others' files are not looked at, whatever they begin with.
 */
bool lum_project_is_part(const char *folder);
LUM_MUST_USE enum lum_status lum_project_make_id(lum_project_id ret_id, struct lum_error *err);
LUM_MUST_USE enum lum_status lum_project_write_meta(const struct lum_dir *dir, const struct lum_project_info *info,
                                                    struct lum_error *err);
/* And when it was changed last. folder: below that. */
LUM_MUST_USE enum lum_status lum_project_read(const struct lum_dir *above, const char *folder,
                                              struct lum_project_info *info, struct lum_error *err);

#endif
