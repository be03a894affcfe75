/* A scene as another project begins with it, and as it was at a moment that people named: a version.
 *
 *   DIR/ID/version.ID/      project, snapshot-N, journal-N, content/: as a project, of which nobody is in
 *
 * Both are written from a state that is whole - the one that a director gives, or the one that is recovered from disk -
 * and never from files that are being written. Who may undo what does not go with it: names of users are given anew.
 *
 * Thread: as store.h. */
#ifndef LUM_SERVER_PROJECT_COPY_H
#define LUM_SERVER_PROJECT_COPY_H

#include "protocol/document/state.h"
#include "server/project/store.h"

struct lum_project_source {
    lum_project_id id, version;       /* version "": as it is now */
    struct lum_document_state *state; /* of an open one, as it is now; NULL: from disk, nobody has it open */
};
/* As lum_project_make, with the scene of the source, and the files that people sent to it. */
LUM_MUST_USE enum lum_status lum_project_copy(struct lum_project_store *store, const struct lum_project_source *source,
                                              struct lum_project_info *info, const struct lum_log *log,
                                              struct lum_error *err);

/* Keeps the source, which has no version, as one of its versions. info: the name; its id and time are written there. */
LUM_MUST_USE enum lum_status lum_version_keep(struct lum_project_store *store, const struct lum_project_source *source,
                                              struct lum_project_info *info, const struct lum_log *log,
                                              struct lum_error *err);
struct lum_version_list { /* as they come */
    struct lum_project_info versions[LUM_LIMIT_VERSIONS];
    size_t n;
};
/* One that cannot be read is told, and left out. */
LUM_MUST_USE enum lum_status lum_version_list(struct lum_project_store *store, const char *id,
                                              struct lum_version_list *ret_list, const struct lum_log *log,
                                              struct lum_error *err);
LUM_MUST_USE enum lum_status lum_version_remove(struct lum_project_store *store, const char *id, const char *version,
                                                struct lum_error *err);

#endif
