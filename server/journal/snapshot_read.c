/* Reading is total: whatever the file holds, what can be read is kept, and the rest is told. */
#include "server/journal/snapshot.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

#define MAX_RECORDS (1u << 22) /* with those that only histories hold on to */

struct loader {
    const char *name;
    const struct lum_dir *content;
    const struct lum_damage_sink *damage;
    struct lum_record_list all; /* by number; NULL: lost */
    bool *stands;
    size_t n_lost;
    bool started, ended;
    struct lum_snapshot_read out;
};

static void lost(struct loader *l, const struct lum_block *f, const char *why)
{
    l->n_lost++;
    lum_damage(l->damage, "%s: record %llu at offset %llu is lost: %s", l->name, (unsigned long long)f->seq,
               (unsigned long long)f->offset, why);
}

/* A whole number from 0 to max of a member; max + 1: it is none. */
static size_t whole(const cJSON *json, const char *name, size_t max)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(json, name);
    double d = cJSON_IsNumber(v) ? v->valuedouble : -1.0;
    return d >= 0 && d <= (double)max && d == (double)(size_t)d ? (size_t)d : max + 1;
}

static void take_start(struct loader *l, const struct lum_block *f, const cJSON *o)
{
    size_t n = whole(o, "records", MAX_RECORDS), starts = whole(o, "starts", UINT32_MAX);
    if (l->started || n > MAX_RECORDS || starts > UINT32_MAX) {
        lost(l, f, "not the start of a snapshot");
        return;
    }
    l->all.records = calloc(n ? n : 1, sizeof(*l->all.records));
    l->stands = calloc(n ? n : 1, sizeof *l->stands);
    if (!l->all.records || !l->stands) {
        lum_damage_no_memory(l->damage);
        return;
    }
    l->all.n = n;
    l->out.starts = starts;
    l->started = true;
}

static void take_pack(struct loader *l, const struct lum_block *f, const cJSON *o)
{
    const char *sha = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(o, "sha"));
    size_t first = whole(o, "first", l->all.n), n = whole(o, "n", l->all.n);
    const cJSON *stand = cJSON_GetObjectItemCaseSensitive(o, "stand");
    struct lum_record_list list = {0};
    struct lum_error err;
    if (!sha || !lum_sha_is(sha) || n == 0 || first > l->all.n || n > l->all.n - first) {
        lost(l, f, "no list of content");
        return;
    }
    size_t n_before = l->n_lost;
    if (lum_content_read(l->content, sha, l->damage, &list, &err)) {
        if (err.status == LUM_ERR_NOMEM)
            lum_damage_no_memory(l->damage);
        lost(l, f, err.text);
        return;
    }
    bool all = list.n == n;
    for (size_t i = 0; i < n && i < list.n; i++) {
        all = all && list.records[i];
        if (list.records[i] && !l->all.records[first + i])
            l->all.records[first + i] = lum_record_ref(list.records[i]);
    }
    for (const cJSON *c = stand ? stand->child : NULL; c; c = c->next)
        if (cJSON_IsNumber(c) && c->valuedouble >= 0 && c->valuedouble < (double)n)
            l->stands[first + (size_t)c->valuedouble] = true;
    if (all)
        lum_kept_add(&l->out.kept, list.records[0], n, sha);
    else if (l->n_lost == n_before)
        lost(l, f, "some of its content is damaged");
    lum_record_list_finish(&list);
}

/* What an import made is a run of numbers; what is lost of it is left out. */
static bool take_made(const struct loader *l, const cJSON *json, struct lum_record *import)
{
    const cJSON *made = cJSON_GetObjectItemCaseSensitive(json, "made");
    double run[2];
    if (!made)
        return true;
    const struct lum_json_range range = {"made", 0, (double)l->all.n, true};
    if (import->type != LUM_RECORD_IMPORT || !lum_json_to_numbers(made, &range, 2, run, NULL) ||
        run[0] + run[1] > (double)l->all.n)
        return false;
    size_t first = (size_t)run[0], n = (size_t)run[1];
    import->import.made = lum_bulk_create(n * sizeof(*import->import.made));
    if (!import->import.made) {
        lum_damage_no_memory(l->damage);
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        struct lum_record *r = l->all.records[first + i];
        if (r && r->type != LUM_RECORD_IMPORT && r->type != LUM_RECORD_RENDER)
            import->import.made[import->import.n_made++] = lum_record_ref(r);
    }
    return true;
}

static void take_record(struct loader *l, const struct lum_block *f)
{
    struct lum_proto_error why = {.text = "its number is out of place"};
    size_t i = whole(f->json, "index", l->all.n);
    struct lum_record *r = i < l->all.n && !l->all.records[i] ? lum_stored_record_read(f, &why) : NULL;
    if (r && take_made(l, f->json, r)) {
        l->all.records[i] = r;
        l->stands[i] = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(f->json, "stands"));
        return;
    }
    lum_record_unref(r);
    lum_damage_note(l->damage, &why);
    lost(l, f, why.text);
}

/* ---- histories ---- */

static struct lum_history_state *last_history(struct loader *l)
{
    return l->out.state.n_histories ? &l->out.state.histories[l->out.state.n_histories - 1] : NULL;
}

static void take_user(struct loader *l, const struct lum_block *f, const cJSON *json)
{
    struct lum_document_state *s = &l->out.state;
    lum_id user;
    if (s->n_histories == LUM_LIMIT_UNDO_USERS || !lum_json_to_id(json, "user", user, NULL)) {
        lost(l, f, "no name of a user");
        return;
    }
    if (!s->histories)
        s->histories = calloc(LUM_LIMIT_UNDO_USERS, sizeof *s->histories);
    struct lum_step_state *steps = calloc(2 * LUM_LIMIT_UNDO, sizeof *steps);
    if (!s->histories || !steps) {
        free(steps);
        lum_damage_no_memory(l->damage);
        return;
    }
    struct lum_history_state *h = &s->histories[s->n_histories++];
    memcpy(h->user, user, sizeof h->user);
    h->steps = steps;
}

/* The record of a number; *ret NULL: -1. False: it is lost. */
static bool find_record(const struct loader *l, const cJSON *json, struct lum_record **ret)
{
    double d = cJSON_IsNumber(json) ? json->valuedouble : -2.0;
    *ret = NULL;
    if (d == -1.0)
        return true;
    if (d >= 0 && d < (double)l->all.n)
        *ret = l->all.records[(size_t)d];
    return *ret != NULL;
}

/* A change is of one record, and the settings always exist: undo relies on it. */
static bool is_change(const struct lum_record *before, const struct lum_record *after)
{
    if (!before || !after)
        return (before || after) && (before ? before : after)->type != LUM_RECORD_RENDER;
    return before->type == after->type && strcmp(before->id, after->id) == 0 &&
           strcmp(before->origin, after->origin) == 0;
}

static bool take_changes(const struct loader *l, const cJSON *json, struct lum_changes *ret)
{
    size_t n = (size_t)cJSON_GetArraySize(json) / 2;
    struct lum_changes c = {.changes = calloc(n ? n : 1, sizeof *c.changes)};
    bool ok = c.changes != NULL;
    if (!ok)
        lum_damage_no_memory(l->damage);
    for (const cJSON *p = json ? json->child : NULL; p && p->next && ok; p = p->next->next) {
        struct lum_record *before, *after;
        ok = find_record(l, p, &before) && find_record(l, p->next, &after) && is_change(before, after);
        if (ok)
            c.changes[c.n++] =
                (struct lum_change){before ? lum_record_ref(before) : NULL, after ? lum_record_ref(after) : NULL};
    }
    if (ok)
        *ret = c;
    else
        lum_changes_finish(&c);
    return ok;
}

static void take_step(struct loader *l, const struct lum_block *f, const cJSON *o)
{
    struct lum_history_state *h = last_history(l);
    const char *user = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(o, "user"));
    const char *group = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(o, "undo_group"));
    const cJSON *rev = cJSON_GetObjectItemCaseSensitive(o, "rev");
    bool redo = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(o, "redo"));
    struct lum_step_state s = {0};
    if (!h || !user || strcmp(h->user, user) != 0 || (!redo && h->n_redo) || !group ||
        strlen(group) > LUM_LIMIT_ID_BYTES || !cJSON_IsNumber(rev) || !(rev->valuedouble >= 0) ||
        rev->valuedouble > 0x1p53 || h->n_undo + h->n_redo == 2 * LUM_LIMIT_UNDO ||
        !take_changes(l, cJSON_GetObjectItemCaseSensitive(o, "changes"), &s.changes)) {
        lost(l, f, "a step of undo that cannot be read");
        return;
    }
    strcpy(s.group, group);
    s.rev = (uint64_t)rev->valuedouble;
    h->steps[h->n_undo + h->n_redo] = s;
    *(redo ? &h->n_redo : &h->n_undo) += 1;
}

/* ---- the file ---- */

static void take_block(struct loader *l, const struct lum_block *f)
{
    const cJSON *first = f->json->child;
    const char *name = first && first->string ? first->string : "";
    if (strcmp(name, "snapshot") == 0)
        take_start(l, f, first);
    else if (!l->started)
        lost(l, f, "the start of the snapshot is lost");
    else if (strcmp(name, "pack") == 0)
        take_pack(l, f, first);
    else if (strcmp(name, "user") == 0)
        take_user(l, f, first);
    else if (strcmp(name, "step") == 0)
        take_step(l, f, first);
    else if (strcmp(name, "end") == 0)
        l->ended = true;
    else
        take_record(l, f);
    l->out.state.rev = f->rev > l->out.state.rev ? f->rev : l->out.state.rev;
}

static void read_blocks(struct loader *l, struct lum_block_reader *r)
{
    for (bool more = true; more && !l->ended;) {
        struct lum_block f;
        struct lum_error err = {.text = "its bytes are not what was written"};
        enum lum_block_found found = lum_block_next(r, &f, &err);
        if (err.status == LUM_ERR_NOMEM)
            lum_damage_no_memory(l->damage);
        more = found == LUM_BLOCK_WHOLE || found == LUM_BLOCK_DAMAGED;
        if (found == LUM_BLOCK_WHOLE)
            take_block(l, &f);
        else
            lost(l, &f, found == LUM_BLOCK_DAMAGED ? err.text : "the file ends here");
        lum_block_finish(&f);
    }
}

static bool collect(struct loader *l)
{
    struct lum_document_state *s = &l->out.state;
    s->records = calloc(l->all.n ? l->all.n : 1, sizeof(*s->records));
    if (!s->records)
        return false;
    for (size_t i = 0; i < l->all.n && s->n_records < LUM_LIMIT_RECORDS; i++)
        if (l->stands[i] && l->all.records[i])
            s->records[s->n_records++] = lum_record_ref(l->all.records[i]);
    return true;
}

void lum_snapshot_read_finish(struct lum_snapshot_read *s)
{
    lum_document_state_finish(&s->state);
    lum_kept_finish(&s->kept);
}

enum lum_status lum_snapshot_load(const struct lum_dir *dir, const struct lum_dir *content, const char *name,
                                  const struct lum_damage_sink *damage, struct lum_snapshot_read *ret,
                                  struct lum_error *err)
{
    struct lum_block_reader r;
    struct loader l = {.name = name, .content = content, .damage = damage};
    enum lum_status st = lum_block_open(&r, dir, name, LUM_FILE_SNAPSHOT, err);
    if (st)
        return st;
    read_blocks(&l, &r);
    l.out.seq = r.seq;
    lum_block_close_reader(&r);
    if (!l.started)
        st = lum_fail(err, LUM_ERR_INVALID, "state", "%.80s is damaged: its first record cannot be read", name);
    else if (!collect(&l))
        st = lum_fail(err, LUM_ERR_NOMEM, "state", "no memory for the state");
    l.out.whole = l.n_lost == 0 && l.ended;
    lum_record_list_finish(&l.all);
    free(l.stands);
    if (st)
        lum_snapshot_read_finish(&l.out);
    else
        *ret = l.out;
    return st;
}
