/* Projects on disk. DIR/ID is one: the folder of a state (journal.h), and the file "project" with what people call it.
 *
 *   DIR/lock                one daemon
 *   DIR/k3v9q2x7m4ab/       a project: project, lock, snapshot-N, journal-N, content/, upload/, version.ID/ (copy.h)
 *   DIR/trash.ID.SECONDS/   one that was deleted then; it is there for LUM_LIMIT_TRASH_S
 *   DIR/part.ID/            one that is being made or removed, or that a crash left: no project
 *
 * A project comes into being, goes, comes back, and ends by one rename. IDs are made here; no path is ever made of a
 * name that people gave, and what has another form than these is not looked at. Links are not followed.
 *
 * Thread: any, one at a time. Blocks on the disk. */
#ifndef LUM_SERVER_PROJECT_STORE_H
#define LUM_SERVER_PROJECT_STORE_H

#include "protocol/base/limits.h"
#include "server/journal/disk.h"

#define LUM_PROJECT_ID_BYTES 12 /* of 32 characters each: 60 random bits */
#define LUM_PROJECT_SCENE_BYTES 64
#define LUM_PROJECT_PATH_BYTES 4096
typedef char lum_project_id[LUM_PROJECT_ID_BYTES + 1];

bool lum_project_id_is(const char *text);
/* 1 to LUM_LIMIT_PROJECT_NAME_BYTES of UTF-8 that can be seen: no control characters, none that turn the direction of
 * what follows, no space at either end. */
bool lum_project_name_is(const char *name);
/* The same, and there is something to be seen of it: of names that are given. */
bool lum_project_name_shows(const char *name);

struct lum_project_info {
    lum_project_id id;
    char name[LUM_LIMIT_PROJECT_NAME_BYTES + 1];
    char scene[LUM_PROJECT_SCENE_BYTES + 1]; /* built in, which it begins with; "": nothing but a camera */
    int64_t changed_s;                       /* of the Unix epoch */
    int64_t deleted_s;                       /* 0: it is not in the trash */
};

struct lum_project_store {
    struct lum_dir dir;
    int lock_fd;
    char path[LUM_PROJECT_PATH_BYTES];
};
/* Makes DIR if it is not there. Removes what a crash left half made, and what was in the trash for too long.
 * LUM_ERR_CONFLICT: another daemon has it. */
LUM_MUST_USE enum lum_status lum_project_store_open(const char *path, const struct lum_disk *disk, int64_t now_s,
                                                    struct lum_project_store *ret_store, struct lum_error *err);
void lum_project_store_close(struct lum_project_store *store);
/* All that are there, those in the trash, too; one that cannot be read is told, and left out. fn: false ends it. */
LUM_MUST_USE enum lum_status lum_project_store_each(struct lum_project_store *store, const struct lum_log *log,
                                                    bool (*fn)(void *user, const struct lum_project_info *info),
                                                    void *user, struct lum_error *err);
/* The folder of its state. False: the path is too long. */
bool lum_project_path(const struct lum_project_store *store, const char *id, char ret_path[LUM_PROJECT_PATH_BYTES]);
/* What is there of info->id: the rest is written there, as lum_project_store_each tells it. After one of the calls
 * below failed: a rename may be done, and only not be sure to outlive a power cut. LUM_ERR_NOT_FOUND: there is none. */
LUM_MUST_USE enum lum_status lum_project_find(struct lum_project_store *store, struct lum_project_info *info,
                                              struct lum_error *err);
/* Is that folder there, and no link? */
LUM_MUST_USE enum lum_status lum_project_check(const struct lum_project_store *store, const char *id,
                                               struct lum_error *err);

/* A new one, of info's name and scene; its ID and times are written there. */
LUM_MUST_USE enum lum_status lum_project_make(struct lum_project_store *store, struct lum_project_info *info,
                                              struct lum_error *err);
/* Name and time as info has them. */
LUM_MUST_USE enum lum_status lum_project_write(struct lum_project_store *store, const struct lum_project_info *info,
                                               struct lum_error *err);
/* Into the trash and out of it. Nobody has it open. info->deleted_s is set. */
LUM_MUST_USE enum lum_status lum_project_delete(struct lum_project_store *store, struct lum_project_info *info,
                                                int64_t now_s, struct lum_error *err);
LUM_MUST_USE enum lum_status lum_project_restore(struct lum_project_store *store, struct lum_project_info *info,
                                                 struct lum_error *err);
/* One that is in the trash, for ever. A crash leaves it there whole, or what the next start removes. */
LUM_MUST_USE enum lum_status lum_project_erase(struct lum_project_store *store, const struct lum_project_info *info,
                                               struct lum_error *err);

#endif
