/* Reading is total: whatever the file holds, what can be read is kept, and the rest is told. */
#include "server/journal/read_ahead.h"
#include "server/journal/snapshot.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

#define MAX_NUMBER ((size_t)1 << 53)
#define MOST_AHEAD 1024u                       /* imports; more are small */
#define LEAST_AHEAD_BYTES ((uint64_t)16 << 20) /* one thread reads them in 40 ms */

struct numbered {
    size_t number;
    struct lum_record *record; /* a reference */
    bool stands;
};

struct loader {
    const char *name;
    const struct lum_dir *content;
    const struct lum_damage_sink *damage;
    struct lum_read_ahead *ahead; /* NULL: content is read when it is needed */
    size_t n_numbers;             /* as the start says; histories hold on to records, too: it has no limit */
    struct numbered *all;         /* by number, as they come in the file; those that are lost are left out */
    size_t n_all, capacity;
    size_t n_lost;
    size_t n_moments, next_moment; /* as the start says; the number of the one that follows */
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

/* Where it is, or would be. */
static size_t place_of(const struct loader *l, size_t number)
{
    size_t low = 0, high = l->n_all;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (l->all[middle].number < number)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static struct lum_record *record_of(const struct loader *l, size_t number)
{
    size_t i = place_of(l, number);
    return i < l->n_all && l->all[i].number == number ? l->all[i].record : NULL;
}

/* Is it above all that were taken? */
static bool is_next(const struct loader *l, size_t number)
{
    return number < l->n_numbers && (l->n_all == 0 || number > l->all[l->n_all - 1].number);
}

/* Takes a reference. False: memory is short. */
static bool take_numbered(struct loader *l, size_t number, struct lum_record *r)
{
    if (l->n_all == l->capacity) {
        size_t capacity = l->capacity ? 2 * l->capacity : 256;
        struct numbered *grown = realloc(l->all, capacity * sizeof *grown);
        if (!grown) {
            lum_damage_no_memory(l->damage);
            return false;
        }
        l->all = grown;
        l->capacity = capacity;
    }
    l->all[l->n_all++] = (struct numbered){.number = number, .record = lum_record_ref(r)};
    return true;
}

static void take_start(struct loader *l, const struct lum_block *f, const cJSON *o)
{
    size_t n = whole(o, "records", MAX_NUMBER), starts = whole(o, "starts", UINT32_MAX);
    size_t moments = whole(o, "moments", LUM_LIMIT_PAST_STEPS + 1);
    if (l->started || n > MAX_NUMBER || starts > UINT32_MAX) {
        lost(l, f, "not the start of a snapshot");
        return;
    }
    l->n_numbers = n;
    l->out.starts = starts;
    l->n_moments = moments <= LUM_LIMIT_PAST_STEPS + 1 ? moments : 0;
    l->started = true;
}

static void let_stand(struct loader *l, size_t number)
{
    size_t i = place_of(l, number);
    if (i < l->n_all && l->all[i].number == number)
        l->all[i].stands = true;
}

static void take_pack(struct loader *l, const struct lum_block *f, const cJSON *o)
{
    const char *sha = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(o, "sha"));
    size_t first = whole(o, "first", l->n_numbers), n = whole(o, "n", l->n_numbers);
    const cJSON *stand = cJSON_GetObjectItemCaseSensitive(o, "stand");
    struct lum_record_list list = {0};
    struct lum_error err;
    if (!sha || !lum_sha_is(sha) || n == 0 || !is_next(l, first) || n > l->n_numbers - first) {
        lost(l, f, "no list of content");
        return;
    }
    size_t n_before = l->n_lost;
    if (!lum_read_ahead_take(l->ahead, sha, &list) && lum_content_read(l->content, sha, l->damage, &list, &err)) {
        lum_damage_unread(l->damage, &err);
        lost(l, f, err.text);
        return;
    }
    bool all = list.n == n;
    for (size_t i = 0; i < n && i < list.n; i++) {
        all = all && list.records[i];
        if (list.records[i] && !take_numbered(l, first + i, list.records[i]))
            break;
    }
    for (const cJSON *c = stand ? stand->child : NULL; c; c = c->next)
        if (cJSON_IsNumber(c) && c->valuedouble >= 0 && c->valuedouble < (double)n)
            let_stand(l, first + (size_t)c->valuedouble);
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
    const struct lum_json_range range = {"made", 0, (double)l->n_numbers, true};
    if (import->type != LUM_RECORD_IMPORT || !lum_json_to_numbers(made, &range, 2, run, NULL) ||
        run[0] + run[1] > (double)l->n_numbers)
        return false;
    size_t first = place_of(l, (size_t)run[0]), n = place_of(l, (size_t)(run[0] + run[1])) - first;
    import->import.made = lum_bulk_create((n ? n : 1) * sizeof(*import->import.made));
    if (!import->import.made) {
        lum_damage_no_memory(l->damage);
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        struct lum_record *r = l->all[first + i].record;
        if (r->type != LUM_RECORD_IMPORT && r->type != LUM_RECORD_RENDER)
            import->import.made[import->import.n_made++] = lum_record_ref(r);
    }
    return true;
}

static void take_record(struct loader *l, const struct lum_block *f)
{
    struct lum_proto_error why = {.text = "its number is out of place"};
    size_t i = whole(f->json, "index", l->n_numbers);
    struct lum_record *r = is_next(l, i) ? lum_stored_record_read(f, &why) : NULL;
    bool taken = r && take_made(l, f->json, r) && take_numbered(l, i, r);
    lum_record_unref(r);
    if (taken) {
        l->all[l->n_all - 1].stands = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(f->json, "stands"));
        return;
    }
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
    if (d >= 0 && d < (double)l->n_numbers)
        *ret = record_of(l, (size_t)d);
    return *ret != NULL;
}

/* A change is of one id, and the settings always exist: undo relies on it. */
static bool is_change(const struct lum_record *before, const struct lum_record *after)
{
    if (!before || !after)
        return (before || after) && (before ? before : after)->type != LUM_RECORD_RENDER;
    return strcmp(before->id, after->id) == 0 &&
           (before->type == LUM_RECORD_RENDER) == (after->type == LUM_RECORD_RENDER);
}

/* A step of undo is of one transaction, in which an id keeps its type; what was of an import may become one's own. In a
 * moment one may have removed it and another have made something else of its name. */
static bool keeps_types(const struct lum_changes *c)
{
    for (size_t i = 0; i < c->n; i++) {
        const struct lum_record *before = c->changes[i].before, *after = c->changes[i].after;
        if (before && after && before->type != after->type)
            return false;
    }
    return true;
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
        !take_changes(l, cJSON_GetObjectItemCaseSensitive(o, "changes"), &s.changes) || !keeps_types(&s.changes)) {
        lum_changes_finish(&s.changes);
        lost(l, f, "a step of undo that cannot be read");
        return;
    }
    strcpy(s.group, group);
    s.rev = (uint64_t)rev->valuedouble;
    h->steps[h->n_undo + h->n_redo] = s;
    *(redo ? &h->n_redo : &h->n_undo) += 1;
}

static bool take_text(const cJSON *o, const char *name, char *ret, size_t size)
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(o, name));
    if (!text || strlen(text) >= size)
        return false;
    strcpy(ret, text);
    return true;
}

static bool read_moment(const struct loader *l, const cJSON *o, size_t *ret_i, struct lum_moment *ret)
{
    struct lum_moment m = {0};
    size_t i = whole(o, "i", LUM_LIMIT_PAST_STEPS), did = whole(o, "did", LUM_PAST_REVERT);
    size_t rev = whole(o, "rev", MAX_NUMBER), at = whole(o, "at", MAX_NUMBER), to = whole(o, "to", MAX_NUMBER);
    size_t edits = whole(o, "edits", UINT32_MAX), joined = whole(o, "joined", UINT32_MAX);
    if (i > LUM_LIMIT_PAST_STEPS || did > LUM_PAST_REVERT || rev > MAX_NUMBER || at > MAX_NUMBER || to > MAX_NUMBER ||
        edits - 1 >= UINT32_MAX || joined - 1 >= UINT32_MAX || !take_text(o, "user", m.user, sizeof m.user) ||
        !take_text(o, "undo_group", m.group, sizeof m.group) || !take_text(o, "name", m.name, sizeof m.name) ||
        !take_text(o, "named_by", m.named_by, sizeof m.named_by) ||
        !take_changes(l, cJSON_GetObjectItemCaseSensitive(o, "changes"), &m.changes))
        return false;
    m.rev = rev;
    m.at_ms = (int64_t)at;
    m.to = to;
    m.n_edits = (uint32_t)edits;
    m.n_joined = (uint32_t)joined;
    m.did = (enum lum_past_did)did;
    *ret_i = i;
    *ret = m;
    return true;
}

/* From one that is lost nobody comes to those before it: the next one is the first. */
static void take_moment(struct loader *l, const struct lum_block *f, const cJSON *o)
{
    struct lum_past_state *past = &l->out.state.past;
    struct lum_moment m;
    size_t i;
    if (!read_moment(l, o, &i, &m)) {
        lost(l, f, "a moment that cannot be read");
        return;
    }
    if (i != l->next_moment)
        lum_past_state_finish(past);
    l->next_moment = i + 1;
    if (past->n == 0)
        lum_changes_finish(&m.changes);
    if (!past->moments)
        past->moments = calloc(LUM_LIMIT_PAST_STEPS + 1, sizeof *past->moments);
    if (past->moments && past->n <= LUM_LIMIT_PAST_STEPS) {
        past->moments[past->n++] = m;
        return;
    }
    lum_changes_finish(&m.changes);
    if (!past->moments)
        lum_damage_no_memory(l->damage);
}

static void take_done(struct loader *l, const struct lum_block *f, const cJSON *json)
{
    enum lum_status st = lum_done_read(&l->out.done, json);
    if (st == LUM_ERR_NOMEM)
        lum_damage_no_memory(l->damage);
    else if (st)
        lost(l, f, "no list of edits that were done");
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
    else if (strcmp(name, "moment") == 0)
        take_moment(l, f, first);
    else if (strcmp(name, "done") == 0)
        take_done(l, f, first);
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
        lum_damage_unread(l->damage, &err);
        more = found == LUM_BLOCK_WHOLE || found == LUM_BLOCK_DAMAGED;
        if (found == LUM_BLOCK_WHOLE)
            take_block(l, &f);
        else
            lost(l, &f, found == LUM_BLOCK_DAMAGED ? err.text : "the file ends here");
        lum_block_finish(&f);
    }
}

/* ---- content that is read ahead ---- */

/* A block of a snapshot that says what content there is: those come first, behind its start. */
static const char *pack_of(const struct lum_block *f)
{
    const cJSON *pack = cJSON_GetObjectItemCaseSensitive(f->json, "pack");
    const char *sha = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(pack, "sha"));
    return sha && lum_sha_is(sha) ? sha : NULL;
}

/* The content of all packs, at most MOST_AHEAD, in order; and its bytes. */
static size_t list_packs(struct lum_block_reader *r, const struct lum_dir *content, lum_sha *ret_shas,
                         uint64_t *ret_n_bytes)
{
    size_t n = 0;
    for (bool more = true; more && n < MOST_AHEAD;) {
        struct lum_block f;
        struct lum_error ignored;
        uint64_t n_bytes = 0;
        more = lum_block_next(r, &f, &ignored) == LUM_BLOCK_WHOLE;
        const char *sha = more ? pack_of(&f) : NULL;
        if (sha && !lum_dir_size(content, sha, &n_bytes, &ignored))
            memcpy(ret_shas[n++], sha, sizeof *ret_shas);
        *ret_n_bytes += n_bytes;
        more = more && (sha || cJSON_GetObjectItemCaseSensitive(f.json, "snapshot"));
        lum_block_finish(&f);
    }
    return n;
}

/* NULL where it would gain nothing, or fails: nothing hangs on it. */
static struct lum_read_ahead *begin_ahead(const struct lum_dir *dir, const struct lum_dir *content, const char *name)
{
    struct lum_block_reader r;
    struct lum_error ignored;
    struct lum_read_ahead *ahead = NULL;
    uint64_t n_bytes = 0;
    lum_sha *shas = calloc(MOST_AHEAD, sizeof *shas);
    if (shas && !lum_block_open(&r, dir, name, LUM_FILE_SNAPSHOT, &ignored)) {
        size_t n = list_packs(&r, content, shas, &n_bytes);
        lum_block_close_reader(&r);
        if (n > 1 && n_bytes >= LEAST_AHEAD_BYTES)
            ahead = lum_read_ahead_begin(content, shas, n);
    }
    free(shas);
    return ahead;
}

static bool collect(struct loader *l)
{
    struct lum_document_state *s = &l->out.state;
    s->records = calloc(l->n_all ? l->n_all : 1, sizeof(*s->records));
    if (!s->records)
        return false;
    for (size_t i = 0; i < l->n_all && s->n_records < LUM_LIMIT_RECORDS; i++)
        if (l->all[i].stands)
            s->records[s->n_records++] = lum_record_ref(l->all[i].record);
    return true;
}

void lum_snapshot_read_finish(struct lum_snapshot_read *s)
{
    lum_document_state_finish(&s->state);
    lum_kept_finish(&s->kept);
    lum_done_destroy(s->done);
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
    l.ahead = begin_ahead(dir, content, name);
    read_blocks(&l, &r);
    lum_read_ahead_end(l.ahead);
    l.out.seq = r.seq;
    lum_block_close_reader(&r);
    if (l.next_moment != l.n_moments) /* what came after the last one is lost */
        lum_past_state_finish(&l.out.state.past);
    if (!l.started)
        st = lum_fail(err, LUM_ERR_INVALID, "state", "%.80s is damaged: its first record cannot be read", name);
    else if (!collect(&l))
        st = lum_fail(err, LUM_ERR_NOMEM, "state", "no memory for the state");
    l.out.whole = l.n_lost == 0 && l.ended;
    for (size_t i = 0; i < l.n_all; i++)
        lum_record_unref(l.all[i].record);
    free(l.all);
    if (st)
        lum_snapshot_read_finish(&l.out);
    else
        *ret = l.out;
    return st;
}
