#define _GNU_SOURCE
#include "server/project/copy.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/base/log.h"
#include "server/import/asset.h"
#include "server/journal/journal.h"
#include "server/project/internal.h"

/* ---- the state ---- */

static void wake_nobody(void *user)
{
    (void)user;
}

static struct lum_journal_config journal_config(const char *path, const struct lum_log *log)
{
    return (struct lum_journal_config){.dir = path, .log = *log, .saved = wake_nobody, .attention = wake_nobody};
}

/* *ret_there: the folder has one. */
static enum lum_status recover(const char *path, const struct lum_log *log, struct lum_document_state *ret_state,
                               bool *ret_there, struct lum_error *err)
{
    const struct lum_journal_config config = journal_config(path, log);
    struct lum_journal *journal = NULL;
    struct lum_document *doc = NULL;
    enum lum_status st = lum_journal_open(&config, &journal, &doc, err);
    *ret_there = doc != NULL;
    if (!st && doc && !lum_document_take_state(doc, ret_state))
        st = lum_fail(err, LUM_ERR_NOMEM, "state", "no memory for the scene");
    lum_document_destroy(doc);
    if (journal)
        lum_journal_close(journal);
    return st;
}

/* The state passes over. */
static enum lum_status write_state(const char *path, struct lum_document_state *state, const struct lum_log *log,
                                   struct lum_error *err)
{
    const struct lum_journal_config config = journal_config(path, log);
    struct lum_journal *journal = NULL;
    struct lum_document *doc = NULL;
    enum lum_status st = lum_journal_open(&config, &journal, &doc, err);
    if (st) {
        lum_document_state_finish(state);
        return st;
    }
    lum_document_state_drop_histories(state);
    st = lum_journal_start(journal, state, err);
    lum_journal_close(journal);
    return st;
}

/* ---- folders below folders ---- */

static enum lum_status open_project(const struct lum_project_store *store, const char *id, struct lum_dir *ret_dir,
                                    struct lum_error *err)
{
    enum lum_status st = lum_dir_open(store->dir.fd, id, false, store->dir.disk, ret_dir, err);
    return st == LUM_ERR_NOT_FOUND ? lum_fail(err, st, "project", "there is no such project") : st;
}

static bool path_below(const struct lum_project_store *store, const char *a, const char *b,
                       char ret_path[LUM_PROJECT_PATH_BYTES])
{
    int n = snprintf(ret_path, LUM_PROJECT_PATH_BYTES, "%s/%s%s%s", store->path, a, b[0] ? "/" : "", b);
    return n > 0 && n < LUM_PROJECT_PATH_BYTES;
}

static void version_name(const char *version, char ret_name[LUM_PROJECT_FOLDER_BYTES])
{
    snprintf(ret_name, LUM_PROJECT_FOLDER_BYTES, LUM_PROJECT_VERSION "%s", version);
}

/* The state of the source, and the scene it began with. */
static enum lum_status read_source(struct lum_project_store *store, const struct lum_project_source *source,
                                   struct lum_project_info *info, const struct lum_log *log,
                                   struct lum_document_state *ret_state, bool *ret_there, struct lum_error *err)
{
    struct lum_dir dir;
    struct lum_project_info was = {0};
    char folder[LUM_PROJECT_FOLDER_BYTES] = ".", path[LUM_PROJECT_PATH_BYTES];
    if (source->version[0])
        version_name(source->version, folder);
    enum lum_status st = open_project(store, source->id, &dir, err);
    if (st)
        return st;
    st = lum_project_read(&dir, folder, &was, err);
    lum_dir_close(&dir);
    if (st == LUM_ERR_NOT_FOUND)
        return lum_fail(err, st, "version", "there is no such version");
    if (!st && !path_below(store, source->id, source->version[0] ? folder : "", path))
        st = lum_fail(err, LUM_ERR_LIMIT, "project", "the path of the project is too long");
    if (st)
        return st;
    strcpy(info->scene, was.scene);
    *ret_there = source->state != NULL;
    if (!source->state)
        return recover(path, log, ret_state, ret_there, err);
    *ret_state = *source->state;
    *source->state = (struct lum_document_state){0};
    return LUM_OK;
}

/* ---- files that people sent ---- */

struct linking {
    int to_fd;
    const struct lum_disk *disk;
    unsigned depth;
    struct lum_error *err;
    enum lum_status st;
    const struct lum_dir *from;
};

static void link_one(void *user, const char *name);

static void link_folder(struct linking *l, const char *name)
{
    struct lum_dir from, to;
    l->st = l->depth == 0 ? lum_fail(l->err, LUM_ERR_LIMIT, "upload", "the folders of uploads are too deep") : LUM_OK;
    if (!l->st)
        l->st = lum_dir_open(l->from->fd, name, false, l->disk, &from, l->err);
    if (l->st)
        return;
    l->st = lum_dir_open(l->to_fd, name, true, l->disk, &to, l->err);
    if (!l->st) {
        struct linking below = {to.fd, l->disk, l->depth - 1, l->err, LUM_OK, &from};
        l->st = lum_dir_each(&from, link_one, &below, l->err);
        l->st = l->st ? l->st : below.st ? below.st : lum_dir_sync(&to, l->err);
        lum_dir_close(&to);
    }
    lum_dir_close(&from);
}

/* They are never changed: both projects can have the same file. */
static void link_one(void *user, const char *name)
{
    struct linking *l = user;
    struct stat st;
    if (l->st || fstatat(l->from->fd, name, &st, AT_SYMLINK_NOFOLLOW))
        return; /* it went meanwhile */
    if (S_ISDIR(st.st_mode))
        link_folder(l, name);
    else if (S_ISREG(st.st_mode) && linkat(l->from->fd, name, l->to_fd, name, 0))
        l->st = lum_fail(l->err, LUM_ERR_IO, "upload", "cannot copy %.100s: %s", name, strerror(errno));
}

/* One that is on its way has another name than that of its content. */
static void link_upload(void *user, const char *name)
{
    if (strspn(name, "0123456789abcdef") == LUM_UPLOAD_ID_BYTES && name[LUM_UPLOAD_ID_BYTES] == '\0')
        link_one(user, name);
}

static enum lum_status link_uploads(const struct lum_project_store *store, const char *from, const char *to,
                                    struct lum_error *err)
{
    struct lum_dir source, target, uploads, made;
    struct stat there;
    enum lum_status st = open_project(store, from, &source, err);
    if (st)
        return st;
    if (fstatat(source.fd, LUM_UPLOAD_FOLDER, &there, AT_SYMLINK_NOFOLLOW)) {
        lum_dir_close(&source);
        return LUM_OK; /* nobody sent anything */
    }
    st = lum_dir_open(source.fd, LUM_UPLOAD_FOLDER, false, store->dir.disk, &uploads, err);
    lum_dir_close(&source);
    if (st)
        return st;
    st = lum_dir_open(store->dir.fd, to, false, store->dir.disk, &target, err);
    if (!st) {
        st = lum_dir_open(target.fd, LUM_UPLOAD_FOLDER, true, store->dir.disk, &made, err);
        lum_dir_close(&target);
    }
    if (!st) {
        struct linking l = {made.fd, store->dir.disk, LUM_LIMIT_UPLOAD_NAME_BYTES / 2, err, LUM_OK, &uploads};
        st = lum_dir_each(&uploads, link_upload, &l, err);
        st = st ? st : l.st ? l.st : lum_dir_sync(&made, err);
        lum_dir_close(&made);
    }
    lum_dir_close(&uploads);
    return st;
}

/* ---- making one ---- */

struct making {
    struct lum_project_store *store;
    const struct lum_project_source *source;
    struct lum_project_info *info;
    const struct lum_log *log;
    const char *above; /* the project whose version it is; "": a project */
};

static enum lum_status fill(const struct making *m, const struct lum_dir *above, const char *part,
                            struct lum_error *err)
{
    char path[LUM_PROJECT_PATH_BYTES];
    bool there = false;
    struct lum_document_state state = {0};
    struct lum_dir dir;
    enum lum_status st = read_source(m->store, m->source, m->info, m->log, &state, &there, err);
    if (!st && !path_below(m->store, m->above[0] ? m->above : part, m->above[0] ? part : "", path))
        st = lum_fail(err, LUM_ERR_LIMIT, "project", "the path of the project is too long");
    if (!st)
        st = lum_dir_open(above->fd, part, true, m->store->dir.disk, &dir, err);
    if (st) {
        lum_document_state_finish(&state);
        return st;
    }
    st = lum_project_write_meta(&dir, m->info, err);
    lum_dir_close(&dir);
    if (!st && there)
        st = write_state(path, &state, m->log, err);
    else
        lum_document_state_finish(&state);
    return st || m->above[0] ? st : link_uploads(m->store, m->source->id, part, err);
}

static enum lum_status make(const struct making *m, const struct lum_dir *above, struct lum_error *err)
{
    char part[LUM_PROJECT_FOLDER_BYTES], name[LUM_PROJECT_FOLDER_BYTES];
    enum lum_status st = lum_project_make_id(m->info->id, err);
    if (st)
        return st;
    snprintf(part, sizeof part, LUM_PROJECT_PART "%s", m->info->id);
    if (m->above[0])
        version_name(m->info->id, name);
    else
        strcpy(name, m->info->id);
    st = fill(m, above, part, err);
    if (!st)
        st = lum_dir_rename(above, part, name, err);
    if (st)
        lum_dir_remove_tree(above->fd, part);
    return st;
}

enum lum_status lum_project_copy(struct lum_project_store *store, const struct lum_project_source *source,
                                 struct lum_project_info *info, const struct lum_log *log, struct lum_error *err)
{
    const struct making m = {store, source, info, log, ""};
    return make(&m, &store->dir, err);
}

/* ---- versions ---- */

static bool is_version(const char *name)
{
    size_t n = sizeof LUM_PROJECT_VERSION - 1;
    return strncmp(name, LUM_PROJECT_VERSION, n) == 0 && lum_project_id_is(name + n);
}

struct looking {
    const struct lum_dir *dir;
    struct lum_version_list *list;
    const struct lum_log *log;
    size_t n;
};

static void count_version(void *user, const char *name)
{
    struct looking *l = user;
    l->n += is_version(name);
    if (lum_project_is_part(name)) /* of a crash: only one is made at a time */
        lum_dir_remove_tree(l->dir->fd, name);
}

enum lum_status lum_version_keep(struct lum_project_store *store, const struct lum_project_source *source,
                                 struct lum_project_info *info, const struct lum_log *log, struct lum_error *err)
{
    struct lum_dir dir;
    const struct making m = {store, source, info, log, source->id};
    enum lum_status st = open_project(store, source->id, &dir, err);
    if (st)
        return st;
    struct looking l = {.dir = &dir};
    st = lum_dir_each(&dir, count_version, &l, err);
    if (!st && l.n >= LUM_LIMIT_VERSIONS)
        st = lum_fail(err, LUM_ERR_LIMIT, "project", "a project has at most %u versions: remove one that nobody needs",
                      LUM_LIMIT_VERSIONS);
    if (!st)
        st = make(&m, &dir, err);
    lum_dir_close(&dir);
    return st;
}

static void list_version(void *user, const char *name)
{
    struct looking *l = user;
    struct lum_error err;
    struct lum_project_info info = {0};
    if (!is_version(name) || l->list->n == LUM_LIMIT_VERSIONS)
        return;
    strcpy(info.id, name + sizeof LUM_PROJECT_VERSION - 1);
    if (lum_project_read(l->dir, name, &info, &err))
        lum_log(l->log, LUM_LOG_ERROR, "projects", "%s is left out: %s", name, err.text);
    else
        l->list->versions[l->list->n++] = info;
}

enum lum_status lum_version_list(struct lum_project_store *store, const char *id, struct lum_version_list *ret_list,
                                 const struct lum_log *log, struct lum_error *err)
{
    struct lum_dir dir;
    ret_list->n = 0;
    enum lum_status st = open_project(store, id, &dir, err);
    if (st)
        return st;
    struct looking l = {&dir, ret_list, log, 0};
    st = lum_dir_each(&dir, list_version, &l, err);
    lum_dir_close(&dir);
    return st;
}

/* Under another name first: a crash leaves no half of one. */
enum lum_status lum_version_remove(struct lum_project_store *store, const char *id, const char *version,
                                   struct lum_error *err)
{
    struct lum_dir dir;
    char name[LUM_PROJECT_FOLDER_BYTES], part[LUM_PROJECT_FOLDER_BYTES];
    version_name(version, name);
    snprintf(part, sizeof part, LUM_PROJECT_PART "%s", version);
    enum lum_status st = open_project(store, id, &dir, err);
    if (st)
        return st;
    st = lum_dir_rename(&dir, name, part, err);
    if (st == LUM_ERR_NOT_FOUND)
        st = lum_fail(err, st, "version", "there is no such version");
    if (!st)
        lum_dir_remove_tree(dir.fd, part);
    lum_dir_close(&dir);
    return st;
}
