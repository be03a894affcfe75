#define _GNU_SOURCE
#include "server/project/internal.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "protocol/base/utf8.h"
#include "protocol/json/json.h"
#include "server/base/log.h"
#include "server/journal/block.h"

#define META "project"
#define META_PART "project.part"
#define META_BYTES 4096u
#define TRASH "trash."

/* ---- ids and names ---- */

static const char id_alphabet[] = "abcdefghijkmnpqrstuvwxyz23456789"; /* 32: no l, o, 0, 1, which look alike */

bool lum_project_id_is(const char *text)
{
    return strspn(text, id_alphabet) == LUM_PROJECT_ID_BYTES && text[LUM_PROJECT_ID_BYTES] == '\0';
}

bool lum_project_is_part(const char *folder)
{
    const size_t n = sizeof LUM_PROJECT_PART - 1;
    return strncmp(folder, LUM_PROJECT_PART, n) == 0 && lum_project_id_is(folder + n);
}

enum lum_status lum_project_make_id(lum_project_id ret_id, struct lum_error *err)
{
    unsigned char bytes[LUM_PROJECT_ID_BYTES];
    if (getrandom(bytes, sizeof bytes, 0) != (ssize_t)sizeof bytes) /* so few are never cut short */
        return lum_fail(err, LUM_ERR_INTERNAL, "id", "getrandom: %s", strerror(errno));
    for (size_t i = 0; i < sizeof bytes; i++)
        ret_id[i] = id_alphabet[bytes[i] & 31];
    ret_id[LUM_PROJECT_ID_BYTES] = '\0';
    return LUM_OK;
}

/* Control characters, also those beyond ASCII; ends of lines; what turns the direction of text that follows. */
static bool is_hidden(const uint8_t *p)
{
    bool control = p[0] < 0x20 || p[0] == 0x7f || (p[0] == 0xc2 && p[1] < 0xa0);
    bool turns = p[0] == 0xe2 && ((p[1] == 0x80 && p[2] >= 0xa8 && p[2] <= 0xae) || /* U+2028 to U+202E */
                                  (p[1] == 0x81 && p[2] >= 0xa6 && p[2] <= 0xa9));  /* U+2066 to U+2069 */
    return control || turns;
}

bool lum_project_name_is(const char *name)
{
    size_t n = strlen(name), n_char;
    if (n == 0 || n > LUM_LIMIT_PROJECT_NAME_BYTES || name[0] == ' ' || name[n - 1] == ' ')
        return false;
    for (const uint8_t *p = (const uint8_t *)name, *end = p + n; p < end; p += n_char) {
        n_char = lum_utf8_length(p, end);
        if (n_char == 0 || is_hidden(p))
            return false;
    }
    return true;
}

static uint32_t code_of(const uint8_t *p, size_t n)
{
    uint32_t code = n == 1 ? p[0] : p[0] & (0x7fu >> n);
    for (size_t i = 1; i < n; i++)
        code = code << 6 | (p[i] & 0x3fu);
    return code;
}

/* Leaves no mark on the screen by itself: spaces, fillers, joiners, marks of direction, selectors of variants, tags. */
static bool is_invisible(uint32_t code)
{
    static const uint32_t ranges[][2] = {
        {0x20, 0x20},     {0xa0, 0xa0},     {0xad, 0xad},     {0x34f, 0x34f},     {0x61c, 0x61c},
        {0x115f, 0x1160}, {0x1680, 0x1680}, {0x17b4, 0x17b5}, {0x180b, 0x180f},   {0x2000, 0x200f},
        {0x2028, 0x202f}, {0x205f, 0x206f}, {0x2800, 0x2800}, {0x3000, 0x3000},   {0x3164, 0x3164},
        {0xfe00, 0xfe0f}, {0xfeff, 0xfeff}, {0xffa0, 0xffa0}, {0x1d173, 0x1d17a}, {0xe0000, 0xe0fff},
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(ranges); i++)
        if (code >= ranges[i][0] && code <= ranges[i][1])
            return true;
    return false;
}

bool lum_project_name_shows(const char *name)
{
    bool shows = false;
    const uint8_t *p = (const uint8_t *)name, *end = p + strlen(name);
    for (size_t n = 0; lum_project_name_is(name) && p < end; p += n) {
        n = lum_utf8_length(p, end);
        shows = shows || !is_invisible(code_of(p, n));
    }
    return shows;
}

/* ---- the file "project" ---- */

enum lum_status lum_project_write_meta(const struct lum_dir *dir, const struct lum_project_info *info,
                                       struct lum_error *err)
{
    size_t n = 0;
    int fd = -1;
    cJSON *json = cJSON_CreateObject();
    bool ok = lum_json_add_number(json, "lumend", 1) && lum_json_add_string(json, "kind", "project") &&
              lum_json_add_string(json, "name", info->name) && lum_json_add_string(json, "scene", info->scene) &&
              lum_json_add_number(json, "changed_s", (double)info->changed_s);
    char *text = ok ? lum_json_print(json, &n) : NULL;
    cJSON_Delete(json);
    if (!text)
        return lum_fail(err, LUM_ERR_NOMEM, "project", "no memory to write a project");
    enum lum_status st = lum_dir_create(dir, META_PART, &fd, err);
    if (!st)
        st = lum_dir_write(dir, META_PART, fd, text, n, err);
    if (!st)
        st = lum_dir_sync_file(dir, META_PART, fd, err);
    if (fd >= 0)
        close(fd);
    free(text);
    return st ? st : lum_dir_rename(dir, META_PART, META, err);
}

static bool read_members(const cJSON *json, struct lum_project_info *info)
{
    struct lum_json_reader r;
    struct lum_proto_error err;
    uint32_t version;
    uint64_t changed_s = 0;
    char kind[16];
    lum_json_begin(&r, json, "", &err);
    bool ok = lum_json_u32(&r, "lumend", 1, 1, &version) && lum_json_string(&r, "kind", kind, sizeof kind) &&
              strcmp(kind, "project") == 0 && lum_json_string(&r, "name", info->name, sizeof info->name) &&
              lum_json_string(&r, "scene", info->scene, sizeof info->scene) &&
              lum_json_u64(&r, "changed_s", &changed_s) && lum_project_name_is(info->name);
    info->changed_s = (int64_t)changed_s;
    return ok && lum_json_end(&r);
}

static enum lum_status read_meta(const struct lum_dir *dir, struct lum_project_info *info, struct lum_error *err)
{
    char text[META_BYTES];
    int fd;
    uint64_t n;
    struct lum_proto_error why;
    enum lum_status st = lum_dir_read(dir, META, &fd, &n, err);
    if (st)
        return st;
    ssize_t got = n <= sizeof text ? read(fd, text, (size_t)n) : -1;
    close(fd);
    cJSON *json = got > 0 ? lum_json_parse(text, (size_t)got, &why) : NULL;
    bool ok = cJSON_IsObject(json) && read_members(json, info);
    cJSON_Delete(json);
    return ok ? LUM_OK
              : lum_fail(err, LUM_ERR_INVALID, "project", "its file \"%s\" is damaged, or memory is short", META);
}

/* ---- the time of the last edit ---- */

struct newest {
    const struct lum_dir *dir;
    int64_t s;
};

/* Each start begins a journal: one without an edit says nothing. */
static void look_at_journal(void *user, const char *name)
{
    struct newest *n = user;
    struct stat st;
    if (strncmp(name, "journal-", 8) == 0 && fstatat(n->dir->fd, name, &st, AT_SYMLINK_NOFOLLOW) == 0 &&
        S_ISREG(st.st_mode) && st.st_size > (off_t)(2 * LUM_BLOCK_BYTES) && st.st_mtim.tv_sec > n->s)
        n->s = st.st_mtim.tv_sec;
}

enum lum_status lum_project_read(const struct lum_dir *above, const char *folder, struct lum_project_info *info,
                                 struct lum_error *err)
{
    struct lum_dir dir;
    enum lum_status st = lum_dir_open(above->fd, folder, false, above->disk, &dir, err);
    if (st)
        return st;
    st = read_meta(&dir, info, err);
    struct newest newest = {&dir, info->changed_s};
    if (!st)
        st = lum_dir_each(&dir, look_at_journal, &newest, err);
    info->changed_s = newest.s;
    lum_dir_close(&dir);
    return st;
}

/* ---- names of folders ---- */

static void trash_name(const struct lum_project_info *info, char ret_name[LUM_PROJECT_FOLDER_BYTES])
{
    snprintf(ret_name, LUM_PROJECT_FOLDER_BYTES, TRASH "%s.%lld", info->id, (long long)info->deleted_s);
}

/* "trash.ID.SECONDS" */
static bool is_in_trash(const char *name, struct lum_project_info *ret_info)
{
    char same[LUM_PROJECT_FOLDER_BYTES];
    const char *id = name + sizeof TRASH - 1;
    if (strncmp(name, TRASH, sizeof TRASH - 1) != 0 || strlen(id) <= LUM_PROJECT_ID_BYTES + 1)
        return false;
    memcpy(ret_info->id, id, LUM_PROJECT_ID_BYTES);
    ret_info->id[LUM_PROJECT_ID_BYTES] = '\0';
    ret_info->deleted_s = strtoll(id + LUM_PROJECT_ID_BYTES + 1, NULL, 10);
    trash_name(ret_info, same);
    return lum_project_id_is(ret_info->id) && ret_info->deleted_s > 0 && strcmp(same, name) == 0;
}

bool lum_project_path(const struct lum_project_store *store, const char *id, char ret_path[LUM_PROJECT_PATH_BYTES])
{
    int n = snprintf(ret_path, LUM_PROJECT_PATH_BYTES, "%s/%s", store->path, id);
    return n > 0 && n < LUM_PROJECT_PATH_BYTES;
}

enum lum_status lum_project_check(const struct lum_project_store *store, const char *id, struct lum_error *err)
{
    struct lum_dir dir;
    enum lum_status st = lum_dir_open(store->dir.fd, id, false, store->dir.disk, &dir, err);
    if (!st)
        lum_dir_close(&dir);
    return st;
}

/* ---- the store ---- */

struct sweep {
    struct lum_project_store *store;
    int64_t now_s;
};

static void sweep_one(void *user, const char *name)
{
    struct sweep *s = user;
    struct lum_project_info info;
    struct lum_error err;
    if (lum_project_is_part(name))
        lum_dir_remove_tree(s->store->dir.fd, name);
    else if (is_in_trash(name, &info) && info.deleted_s < s->now_s - LUM_LIMIT_TRASH_S)
        (void)!lum_project_erase(s->store, &info, &err); /* or it is in the trash, and tried again */
}

enum lum_status lum_project_store_open(const char *path, const struct lum_disk *disk, int64_t now_s,
                                       struct lum_project_store *ret_store, struct lum_error *err)
{
    struct lum_project_store *s = ret_store;
    struct sweep sweep = {s, now_s};
    *s = (struct lum_project_store){.dir.fd = -1, .lock_fd = -1};
    if (strlen(path) + LUM_PROJECT_FOLDER_BYTES >= sizeof s->path)
        return lum_fail(err, LUM_ERR_LIMIT, "projects", "the path of the projects is too long");
    strcpy(s->path, path);
    enum lum_status st = lum_dir_open(AT_FDCWD, path, true, disk, &s->dir, err);
    if (!st)
        st = lum_dir_lock(&s->dir, path, &s->lock_fd, err);
    if (!st)
        st = lum_dir_each(&s->dir, sweep_one, &sweep, err);
    if (st)
        lum_project_store_close(s);
    return st;
}

void lum_project_store_close(struct lum_project_store *store)
{
    lum_dir_close(&store->dir);
    if (store->lock_fd >= 0)
        close(store->lock_fd);
    store->lock_fd = -1;
}

struct listing {
    struct lum_project_store *store;
    const struct lum_log *log;
    bool (*fn)(void *user, const struct lum_project_info *info);
    void *user;
    bool ended;
};

static void list_one(void *user, const char *name)
{
    struct listing *l = user;
    struct lum_error err;
    struct lum_project_info info = {0};
    bool is_id = lum_project_id_is(name);
    if (l->ended || (!is_id && !is_in_trash(name, &info)))
        return;
    if (is_id)
        strcpy(info.id, name);
    if (lum_project_read(&l->store->dir, name, &info, &err))
        lum_log(l->log, LUM_LOG_ERROR, "projects", "%s is left out: %s", name, err.text);
    else
        l->ended = !l->fn(l->user, &info);
}

enum lum_status lum_project_store_each(struct lum_project_store *store, const struct lum_log *log,
                                       bool (*fn)(void *user, const struct lum_project_info *info), void *user,
                                       struct lum_error *err)
{
    struct listing l = {store, log, fn, user, false};
    return lum_dir_each(&store->dir, list_one, &l, err);
}

/* ---- one project ---- */

enum lum_status lum_project_make(struct lum_project_store *store, struct lum_project_info *info, struct lum_error *err)
{
    char part[LUM_PROJECT_FOLDER_BYTES];
    struct lum_dir dir;
    enum lum_status st = lum_project_make_id(info->id, err);
    if (st)
        return st;
    snprintf(part, sizeof part, LUM_PROJECT_PART "%s", info->id);
    st = lum_dir_open(store->dir.fd, part, true, store->dir.disk, &dir, err);
    if (st)
        return st;
    st = lum_project_write_meta(&dir, info, err);
    lum_dir_close(&dir);
    if (!st)
        st = lum_dir_rename(&store->dir, part, info->id, err);
    if (st)
        lum_dir_remove_tree(store->dir.fd, part);
    return st;
}

enum lum_status lum_project_write(struct lum_project_store *store, const struct lum_project_info *info,
                                  struct lum_error *err)
{
    struct lum_dir dir;
    enum lum_status st = lum_dir_open(store->dir.fd, info->id, false, store->dir.disk, &dir, err);
    if (st)
        return st;
    st = lum_project_write_meta(&dir, info, err);
    lum_dir_close(&dir);
    return st;
}

enum lum_status lum_project_delete(struct lum_project_store *store, struct lum_project_info *info, int64_t now_s,
                                   struct lum_error *err)
{
    char name[LUM_PROJECT_FOLDER_BYTES];
    struct lum_project_info gone = *info;
    gone.deleted_s = now_s;
    trash_name(&gone, name);
    enum lum_status st = lum_dir_rename(&store->dir, info->id, name, err);
    if (!st)
        *info = gone;
    return st;
}

enum lum_status lum_project_restore(struct lum_project_store *store, struct lum_project_info *info,
                                    struct lum_error *err)
{
    char name[LUM_PROJECT_FOLDER_BYTES];
    trash_name(info, name);
    enum lum_status st = lum_dir_rename(&store->dir, name, info->id, err);
    if (!st)
        info->deleted_s = 0;
    return st;
}

/* Under another name first: what is half removed is no project, whatever happens. While that name is not sure to
 * outlive a power cut nothing is removed: a project with half of its files would come back. */
enum lum_status lum_project_erase(struct lum_project_store *store, const struct lum_project_info *info,
                                  struct lum_error *err)
{
    char name[LUM_PROJECT_FOLDER_BYTES], part[LUM_PROJECT_FOLDER_BYTES];
    trash_name(info, name);
    snprintf(part, sizeof part, LUM_PROJECT_PART "%s", info->id);
    enum lum_status st = lum_dir_rename(&store->dir, name, part, err);
    if (!st)
        lum_dir_remove_tree(store->dir.fd, part);
    return st;
}

/* ---- what is there of one ---- */

struct finding {
    const char *id;
    char name[LUM_PROJECT_FOLDER_BYTES]; /* "": it is not in the trash */
    int64_t deleted_s;
};

static void look_in_trash(void *user, const char *name)
{
    struct finding *f = user;
    struct lum_project_info info;
    if (!is_in_trash(name, &info) || strcmp(info.id, f->id) != 0)
        return;
    trash_name(&info, f->name);
    f->deleted_s = info.deleted_s;
}

enum lum_status lum_project_find(struct lum_project_store *store, struct lum_project_info *info, struct lum_error *err)
{
    struct finding f = {.id = info->id};
    enum lum_status st = lum_project_read(&store->dir, info->id, info, err);
    if (st != LUM_ERR_NOT_FOUND) {
        info->deleted_s = 0;
        return st;
    }
    st = lum_dir_each(&store->dir, look_in_trash, &f, err);
    if (st)
        return st;
    if (!f.name[0])
        return lum_fail(err, LUM_ERR_NOT_FOUND, "project", "there is no such project");
    info->deleted_s = f.deleted_s;
    return lum_project_read(&store->dir, f.name, info, err);
}
