#define _GNU_SOURCE
#include "tests/support/journal_keeper.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

static void require(bool ok, const char *what)
{
    if (ok)
        return;
    fprintf(stderr, "the test is wrong: %s\n", what);
    abort();
}

static void ring(void *user)
{
    struct keeper *k = user;
    pthread_mutex_lock(&k->lock);
    k->rung = true;
    pthread_cond_signal(&k->bell);
    pthread_mutex_unlock(&k->lock);
}

static void note(void *user, int level, const char *component, const char *text)
{
    struct keeper *k = user;
    (void)level;
    (void)component;
    pthread_mutex_lock(&k->lock);
    size_t n = strlen(k->log);
    snprintf(k->log + n, sizeof k->log - n, "%s\n", text);
    pthread_mutex_unlock(&k->lock);
}

bool keeper_said(struct keeper *k, const char *what)
{
    pthread_mutex_lock(&k->lock);
    bool said = strstr(k->log, what) != NULL;
    pthread_mutex_unlock(&k->lock);
    return said;
}

void keeper_forget_log(struct keeper *k)
{
    pthread_mutex_lock(&k->lock);
    k->log[0] = '\0';
    pthread_mutex_unlock(&k->lock);
}

void keeper_init(struct keeper *k)
{
    memset(k, 0, sizeof *k);
    snprintf(k->dir, sizeof k->dir, "/tmp/lumend-state-XXXXXX");
    require(mkdtemp(k->dir), "no folder in /tmp");
    pthread_mutex_init(&k->lock, NULL);
    pthread_cond_init(&k->bell, NULL);
    k->config = (struct lum_journal_config){.dir = k->dir,
                                            .retry_ns = 1000000,
                                            .log = {.write = note, .user = k},
                                            .saved = ring,
                                            .attention = ring,
                                            .user = k};
}

static void remove_folder(const char *path)
{
    DIR *list = opendir(path);
    for (struct dirent *e = list ? readdir(list) : NULL; e; e = readdir(list)) {
        char below[600];
        snprintf(below, sizeof below, "%s/%s", path, e->d_name);
        if (strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0 && unlink(below) != 0)
            remove_folder(below);
    }
    if (list)
        closedir(list);
    rmdir(path);
}

void keeper_finish(struct keeper *k)
{
    keeper_close(k);
    remove_folder(k->dir);
    pthread_cond_destroy(&k->bell);
    pthread_mutex_destroy(&k->lock);
}

/* "'" stands for '"'. */
static cJSON *json_text(const char *text)
{
    char *copy = strdup(text);
    for (char *c = copy; *c; c++)
        *c = *c == '\'' ? '"' : *c;
    cJSON *json = lum_json_parse(copy, strlen(copy), NULL);
    free(copy);
    require(json != NULL, text);
    return json;
}

static bool apply(struct lum_document *doc, const char *user, const cJSON *json, struct lum_changes *ret)
{
    struct lum_ops ops;
    if (!lum_ops_from_json(json, &ops, NULL))
        return false;
    bool ok = lum_document_apply(doc, user, &ops, NULL, 0, ret, NULL);
    lum_ops_finish(&ops);
    return ok;
}

bool keeper_open(struct keeper *k, const char *ops, struct lum_error *err)
{
    struct lum_document_state state;
    if (lum_journal_open(&k->config, &k->journal, &k->doc, err))
        return false;
    if (!k->doc) {
        struct lum_changes changes;
        cJSON *json = json_text(ops);
        k->doc = lum_document_create();
        require(k->doc && apply(k->doc, "(scene)", json, &changes), ops);
        lum_changes_finish(&changes);
        cJSON_Delete(json);
        lum_document_begin_past(k->doc);
    }
    require(lum_document_take_state(k->doc, &state), "no memory");
    if (!lum_journal_start(k->journal, &state, err))
        return true;
    keeper_close(k);
    return false;
}

static void forget(struct keeper *k, size_t n)
{
    for (size_t i = 0; i < n; i++)
        lum_changes_finish(&k->unsaved[i].changes);
    memmove(k->unsaved, k->unsaved + n, (k->n_unsaved - n) * sizeof k->unsaved[0]);
    k->n_unsaved -= n;
}

void keeper_stop(struct keeper *k)
{
    lum_journal_close(k->journal);
    k->journal = NULL;
}

void keeper_close(struct keeper *k)
{
    keeper_stop(k);
    lum_document_destroy(k->doc);
    forget(k, k->n_unsaved);
    k->doc = NULL;
}

static void submit(struct keeper *k, struct lum_entry *e, struct lum_changes *changes)
{
    require(k->n_unsaved < KEEPER_UNSAVED, "too many edits wait");
    k->unsaved[k->n_unsaved].seq = lum_journal_submit(k->journal, e, lum_document_rev(k->doc));
    k->unsaved[k->n_unsaved++].changes = *changes;
}

static bool accepts(struct keeper *k)
{
    struct lum_error err;
    keeper_turn(k);
    return !lum_journal_accepts(k->journal, &err);
}

bool keeper_edit(struct keeper *k, const char *user, const char *ops)
{
    struct lum_changes changes;
    cJSON *json = json_text(ops);
    struct lum_entry *e = accepts(k) ? lum_entry_create(LUM_ENTRY_APPLY, user) : NULL;
    if (!e || !apply(k->doc, user, json, &changes)) {
        lum_entry_destroy(e);
        cJSON_Delete(json);
        return false;
    }
    e->ops = json;
    submit(k, e, &changes);
    return true;
}

bool keeper_walk(struct keeper *k, const char *user, bool redo)
{
    struct lum_changes changes = {0};
    if (!accepts(k))
        return false;
    uint64_t of = lum_document_next_undo(k->doc, user, redo);
    bool ok = redo ? lum_document_redo(k->doc, user, &changes, NULL) : lum_document_undo(k->doc, user, &changes, NULL);
    if (of == 0)
        return false;
    struct lum_entry *e = lum_entry_create(ok     ? redo ? LUM_ENTRY_REDO : LUM_ENTRY_UNDO
                                           : redo ? LUM_ENTRY_REDROP
                                                  : LUM_ENTRY_DROP,
                                           user);
    e->of = of;
    submit(k, e, &changes);
    return ok;
}

bool keeper_revert(struct keeper *k, const char *user, uint64_t rev)
{
    struct lum_changes changes = {0};
    struct lum_proto_error err;
    if (!accepts(k) || !lum_document_revert(k->doc, user, rev, &changes, &err))
        return false;
    struct lum_entry *e = lum_entry_create(LUM_ENTRY_REVERT, user);
    e->of = rev;
    submit(k, e, &changes);
    return true;
}

bool keeper_name(struct keeper *k, const char *user, uint64_t rev, const char *name)
{
    struct lum_changes none = {0};
    struct lum_proto_error err;
    if (!accepts(k) || !lum_document_name_moment(k->doc, user, rev, name, NULL, &err))
        return false;
    struct lum_entry *e = lum_entry_create(LUM_ENTRY_NAME, user);
    e->of = rev;
    snprintf(e->name, sizeof e->name, "%s", name);
    submit(k, e, &none);
    return true;
}

static void take_back(struct keeper *k, uint64_t durable)
{
    uint64_t rev = lum_document_rev(k->doc);
    while (k->n_unsaved && k->unsaved[k->n_unsaved - 1].seq > durable) {
        struct lum_changes *c = &k->unsaved[--k->n_unsaved].changes;
        if (c->changes)
            lum_document_rollback(k->doc, c);
        lum_changes_finish(c);
        k->n_taken_back++;
        rev++;
    }
    lum_document_raise_rev(k->doc, rev);
}

void keeper_turn(struct keeper *k)
{
    uint64_t durable = lum_journal_acknowledged(k->journal);
    size_t n = 0;
    while (n < k->n_unsaved && k->unsaved[n].seq <= durable)
        n++;
    k->n_acknowledged += n;
    forget(k, n);
    char why[256];
    if (lum_journal_failed(k->journal, &durable, why))
        take_back(k, durable);
    struct lum_document_state state;
    if (lum_journal_wants_state(k->journal) && lum_document_take_state(k->doc, &state))
        lum_journal_give_state(k->journal, &state);
}

static void wait_ring(struct keeper *k)
{
    pthread_mutex_lock(&k->lock);
    while (!k->rung)
        pthread_cond_wait(&k->bell, &k->lock);
    k->rung = false;
    pthread_mutex_unlock(&k->lock);
}

bool keeper_settle(struct keeper *k)
{
    uint64_t taken_back = k->n_taken_back;
    for (keeper_turn(k); k->n_unsaved; keeper_turn(k))
        wait_ring(k);
    return taken_back == k->n_taken_back;
}

void keeper_wait_writable(struct keeper *k)
{
    while (!accepts(k))
        (void)0; /* the thread goes on beside us: it writes a snapshot, or waits a second for the next try */
}

void keeper_wait_snapshots(struct keeper *k, uint64_t n)
{
    struct lum_journal_status s;
    do {
        keeper_turn(k);
        lum_journal_status(k->journal, &s);
    } while (s.n_snapshots < n);
}

/* ---- files ---- */

static void tell(void *user, const char *text)
{
    note(user, 0, "", text);
}

enum lum_status keeper_recover(struct keeper *k, struct lum_recovery *ret, struct lum_error *err)
{
    struct lum_dir dir = {.fd = -1}, content = {.fd = -1};
    const struct lum_damage_sink damage = {.tell = tell, .user = k};
    keeper_forget_log(k);
    enum lum_status st = lum_dir_open(AT_FDCWD, k->dir, false, &lum_disk_real, &dir, err);
    if (!st)
        st = lum_dir_open(dir.fd, "content", false, &lum_disk_real, &content, err);
    if (!st)
        st = lum_recover(&dir, &content, &damage, ret, err);
    lum_dir_close(&content);
    lum_dir_close(&dir);
    return st;
}

uint8_t *keeper_read(struct keeper *k, const char *prefix, char ret_path[96], size_t *ret_n)
{
    struct lum_dir dir;
    struct lum_numbers_found list;
    char name[LUM_JOURNAL_NAME_BYTES];
    require(!lum_dir_open(AT_FDCWD, k->dir, false, &lum_disk_real, &dir, NULL), k->dir);
    require(!lum_state_list(&dir, prefix, &list, NULL) && list.n > 0, prefix);
    lum_state_name(name, prefix, list.numbers[list.n - 1]);
    free(list.numbers);
    lum_dir_close(&dir);
    snprintf(ret_path, 96, "%s/%s", k->dir, name);
    FILE *f = fopen(ret_path, "rb");
    require(f && fseek(f, 0, SEEK_END) == 0, ret_path);
    *ret_n = (size_t)ftell(f);
    uint8_t *bytes = malloc(*ret_n + 1);
    rewind(f);
    require(bytes && fread(bytes, 1, *ret_n, f) == *ret_n, ret_path);
    fclose(f);
    return bytes;
}

void keeper_write(const char *path, const uint8_t *bytes, size_t n)
{
    FILE *f = fopen(path, "wb");
    require(f && fwrite(bytes, 1, n, f) == n && fclose(f) == 0, path);
}

unsigned keeper_count(struct keeper *k, const char *folder, const char *prefix)
{
    char path[120];
    unsigned n = 0;
    snprintf(path, sizeof path, "%s/%s", k->dir, folder);
    DIR *list = opendir(path);
    for (struct dirent *e = list ? readdir(list) : NULL; e; e = readdir(list))
        n += e->d_name[0] != '.' && strncmp(e->d_name, prefix, strlen(prefix)) == 0;
    if (list)
        closedir(list);
    return n;
}
