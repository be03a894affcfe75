/* The document is told as the snapshot that a journal makes of it, in files of a folder that lives as long as that
 * takes: whatever a scene may be made of, it is whole in there. */
#define _GNU_SOURCE
#include "server/cli/team_scene.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/journal/snapshot.h"
#include "server/world/scene_source.h"

#define SNAPSHOT "scene"
#define NAME_BYTES 128 /* of a file: a SHA-256, or SNAPSHOT */

struct folder {
    char path[256];
    struct lum_disk disk;
    struct lum_dir dir;
};

/* Nothing in it has to outlive a power cut. */
static int no_sync(void *user, int fd)
{
    (void)user;
    (void)fd;
    return 0;
}

static enum lum_status open_folder(struct folder *f, struct lum_error *err)
{
    const char *tmp = getenv("TMPDIR");
    tmp = tmp && tmp[0] ? tmp : "/tmp";
    int n = snprintf(f->path, sizeof f->path, "%s/lumend-scene-XXXXXX", tmp);
    f->disk = lum_disk_real;
    f->disk.sync = no_sync;
    if (n < 0 || (size_t)n >= sizeof f->path || !mkdtemp(f->path))
        return lum_fail(err, LUM_ERR_IO, "scene", "cannot make a folder in %.100s: %s", tmp, strerror(errno));
    enum lum_status st = lum_dir_open(AT_FDCWD, f->path, false, &f->disk, &f->dir, err);
    if (st)
        (void)rmdir(f->path);
    return st;
}

static void remove_folder(struct folder *f)
{
    lum_dir_close(&f->dir);
    lum_dir_remove_tree(AT_FDCWD, f->path);
}

/* ---- rank 0 ---- */

static enum lum_status write_snapshot(const struct folder *f, struct lum_document *doc, struct lum_error *err)
{
    const struct lum_kept_list none = {0};
    const struct lum_snapshot_config config = {.dir = &f->dir, .content = &f->dir, .name = SNAPSHOT, .kept = &none};
    struct lum_document_state state;
    struct lum_snapshot_writer *writer = NULL;
    bool done = false;
    if (!lum_document_take_state(doc, &state))
        return lum_fail(err, LUM_ERR_NOMEM, "scene", "no memory to tell the scene");
    lum_document_state_drop_histories(&state);
    enum lum_status st = lum_snapshot_begin(&config, &state, &writer, err);
    while (!st && !done)
        st = lum_snapshot_step(writer, &done, err);
    lum_snapshot_end(writer);
    return st;
}

/* What comes before the bytes of a file. No name: that was the last. */
struct heading {
    char name[NAME_BYTES];
    uint64_t n_bytes;
};

struct telling {
    struct lum_team *team;
    const struct lum_dir *dir;
    uint64_t told_bytes;
    enum lum_status status;
    struct lum_error err;
};

static void tell_file(void *user, const char *name)
{
    struct telling *t = user;
    struct heading h = {.n_bytes = 0};
    int fd = -1;
    if (t->status || name[0] == '.')
        return;
    snprintf(h.name, sizeof h.name, "%s", name);
    t->status = lum_dir_read(t->dir, name, &fd, &h.n_bytes, &t->err);
    if (t->status)
        return;
    unsigned char *bytes = lum_team_room(t->team, LUM_TEAM_ALL, h.n_bytes);
    ssize_t n = 1;
    for (uint64_t at = 0; at < h.n_bytes && n > 0; at += (uint64_t)n)
        n = pread(fd, bytes + at, h.n_bytes - at, (off_t)at);
    close(fd);
    if (n <= 0) {
        t->status = lum_fail(&t->err, LUM_ERR_IO, "scene", "what is to be told of the scene cannot be read");
        return;
    }
    lum_team_broadcast(t->team, &h, sizeof h);
    lum_team_broadcast(t->team, bytes, h.n_bytes);
    t->told_bytes += sizeof h + h.n_bytes;
}

static enum lum_status tell_document(struct lum_team *team, const struct folder *f, struct lum_document *doc,
                                     uint64_t *ret_told_bytes, struct lum_error *err)
{
    struct telling t = {.team = team, .dir = &f->dir};
    struct heading end = {.n_bytes = 0};
    enum lum_status st = write_snapshot(f, doc, err);
    if (!st)
        st = lum_dir_each(&f->dir, tell_file, &t, err);
    if (!st && t.status) {
        *err = t.err;
        st = t.status;
    }
    if (!st)
        lum_team_broadcast(team, &end, sizeof end);
    *ret_told_bytes = t.told_bytes + sizeof end;
    return st;
}

/* ---- the others ---- */

static enum lum_status hear_files(struct lum_team *team, const struct folder *f, struct lum_error *err)
{
    struct heading h;
    for (;;) {
        int fd;
        lum_team_broadcast(team, &h, sizeof h);
        h.name[NAME_BYTES - 1] = '\0';
        if (!h.name[0])
            return LUM_OK;
        void *bytes = lum_team_room(team, LUM_TEAM_ALL, h.n_bytes);
        lum_team_broadcast(team, bytes, h.n_bytes);
        enum lum_status st = lum_dir_create(&f->dir, h.name, &fd, err);
        if (st)
            return st;
        st = lum_dir_write(&f->dir, h.name, fd, bytes, h.n_bytes, err);
        close(fd);
        if (st)
            return st;
    }
}

static void nothing_is_damaged(void *user, const char *text)
{
    (void)user;
    (void)text;
}

static void nothing_is_left_out(void *user, const char *id, const char *why)
{
    (void)id;
    (void)why;
    *(bool *)user = true;
}

static enum lum_status hear_document(struct lum_team *team, const struct folder *f, struct lum_world *world,
                                     struct lum_error *err)
{
    const struct lum_damage_sink damage = {.tell = nothing_is_damaged};
    struct lum_snapshot_read read;
    bool left_out = false;
    enum lum_status st = hear_files(team, f, err);
    if (!st)
        st = lum_snapshot_load(&f->dir, &f->dir, SNAPSHOT, &damage, &read, err);
    if (st)
        return st;
    struct lum_document *doc = lum_document_from_state(&read.state, nothing_is_left_out, &left_out);
    bool whole = read.whole && !left_out;
    lum_snapshot_read_finish(&read);
    if (doc && whole)
        return lum_world_restore(world, doc, err);
    lum_document_destroy(doc);
    return doc ? lum_fail(err, LUM_ERR_INTERNAL, "scene", "the scene did not arrive whole")
               : lum_fail(err, LUM_ERR_NOMEM, "scene", "no memory for the scene");
}

/* ---- both ---- */

bool lum_team_scene_load(struct lum_team *team, struct lum_world *world, const char *scene,
                         const struct lum_import_config *import, uint64_t *ret_told_bytes, struct lum_proto_error *err)
{
    struct folder f;
    struct lum_error e;
    *ret_told_bytes = 0;
    bool reads = !team || team->rank == 0;
    if (reads && !lum_scene_load(world, scene, import, err))
        return false;
    if (!team || team->size == 1)
        return true;
    (void)lum_team_agree(team, 0.0); /* rank 0 has it: where it fails the job ends, and nobody has a folder yet */
    enum lum_status st = open_folder(&f, &e);
    if (st)
        return lum_apply_error(&e, "", err);
    st = team->rank == 0 ? tell_document(team, &f, world->doc, ret_told_bytes, &e) : hear_document(team, &f, world, &e);
    remove_folder(&f);
    return !st || lum_apply_error(&e, "", err);
}

bool lum_team_edits_load(struct lum_team *team, const char *replay, struct lum_ops *ret_ops, uint64_t *ret_told_bytes,
                         struct lum_proto_error *err)
{
    bool reads = !team || team->rank == 0;
    size_t n_bytes = 0;
    char *text = reads ? lum_edits_text(replay, &n_bytes, err) : NULL;
    *ret_told_bytes = 0;
    if (reads && !text)
        return false;
    if (team) {
        lum_team_broadcast(team, &n_bytes, sizeof n_bytes);
        if (!reads && !(text = malloc(n_bytes + 1)))
            return lum_proto_fail_memory(err);
        lum_team_broadcast(team, text, n_bytes);
        *ret_told_bytes = team->size > 1 ? sizeof n_bytes + n_bytes : 0;
    }
    bool ok = lum_ops_from_jsonl(text, n_bytes, ret_ops, err);
    free(text);
    return ok;
}
