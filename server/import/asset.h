/* Opening files below a directory, whatever name a client or a hostile file gives: no "..", no absolute path, no
 * symbolic link in any component, plain files only. The walk goes component by component with O_NOFOLLOW relative to an
 * open directory, so nothing that changes on disk meanwhile leads outside. */
#ifndef LUM_SERVER_IMPORT_ASSET_H
#define LUM_SERVER_IMPORT_ASSET_H

#include "core/base/base.h"

/* Files that people sent lie below another root: "upload/0123456789abcdef0123456789abcdef/chair.glb". */
#define LUM_UPLOAD_FOLDER "upload"
#define LUM_UPLOAD_ID_BYTES 32 /* hexadecimal digits of 128 random bits */
bool lum_asset_is_upload(const char *name);

/* Opens the directory that holds `name` below root_fd. */
LUM_MUST_USE enum lum_status lum_asset_open_dir(int root_fd, const char *name, int *ret_dir_fd);
/* Opens the plain file `name` below root_fd for reading. any_case: a component that does not exist matches one that
 * differs in letter case. LUM_ERR_NOT_FOUND, LUM_ERR_INVALID (leads outside, or no plain file), LUM_ERR_IO. */
LUM_MUST_USE enum lum_status lum_asset_open(int root_fd, const char *name, bool any_case, int *ret_fd,
                                            uint64_t *ret_n_bytes);

#endif
