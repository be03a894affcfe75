/* Records are numbered first: those of content in one go, then all others; a record that stands in several places (the
 * scene, histories, what an import made) is written once, and is one record again when it is read. */
#include "server/journal/snapshot.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/base/hash.h"
#include "protocol/json/json.h"

#define INLINE_BYTES 65536u /* bulk data beyond is content: it is not written anew with every snapshot */
#define RECORDS_A_STEP 256u /* small ones: some hundred microseconds */

/* ---- the plan ---- */

struct pack {
    struct lum_record *const *records;
    size_t n, first;
};

struct lum_snapshot_writer {
    struct lum_snapshot_config config;
    struct lum_document_state state;
    struct lum_hash numbers; /* of records; value: 1 + the number */
    bool *stands;            /* in the scene, by number */
    struct pack *packs;
    const struct lum_record **singles; /* written in the file itself */
    size_t n_packs, n_singles;
    struct lum_kept_list kept;
    struct lum_block_writer file;
    uint64_t n_blocks;
    size_t next_pack, next_single, next_history, next_step, next_moment;
    const struct lum_done_user *next_done;
};

/* True when it got its number now. */
static bool give_number(struct lum_snapshot_writer *w, const struct lum_record *r)
{
    struct lum_hash_slot *slot = lum_hash_put_pointer(&w->numbers, r);
    if (slot->value)
        return false;
    slot->value = w->numbers.n;
    return true;
}

static size_t number_of(const struct lum_snapshot_writer *w, const struct lum_record *r)
{
    return lum_hash_find_pointer(&w->numbers, r)->value - 1;
}

static void each_changed(const struct lum_changes *changes, void (*fn)(void *user, struct lum_record *const *r),
                         void *user)
{
    for (size_t i = 0; i < changes->n; i++) {
        const struct lum_change *change = &changes->changes[i];
        if (change->before)
            fn(user, &change->before);
        if (change->after)
            fn(user, &change->after);
    }
}

/* Calls fn for each record of the state, in the scene, in histories and in what was, some more than once. */
static void each_record(const struct lum_document_state *s, void (*fn)(void *user, struct lum_record *const *r),
                        void *user)
{
    for (size_t i = 0; i < s->n_records; i++)
        fn(user, &s->records[i]);
    for (size_t i = 0; i < s->n_histories; i++) {
        const struct lum_history_state *h = &s->histories[i];
        for (size_t k = 0; k < h->n_undo + h->n_redo; k++)
            each_changed(&h->steps[k].changes, fn, user);
    }
    for (size_t i = 0; i < s->past.n; i++)
        each_changed(&s->past.moments[i].changes, fn, user);
}

static void count_one(void *user, struct lum_record *const *r)
{
    size_t *n = user;
    *n += 1 + ((*r)->type == LUM_RECORD_IMPORT ? (*r)->import.n_made : 0);
}

static size_t bulk_bytes(const struct lum_record *r)
{
    struct lum_blobs_out blobs;
    size_t n = 0;
    if (r->type != LUM_RECORD_MESH && r->type != LUM_RECORD_IMAGE && !(r->type == LUM_RECORD_LIGHT && r->light.web))
        return 0;
    cJSON_Delete(lum_record_to_blobs(r, &blobs));
    for (size_t i = 0; i < blobs.n; i++)
        n += blobs.blobs[i].n_bytes;
    return n;
}

static void add_pack(struct lum_snapshot_writer *w, struct lum_record *const *records, size_t n)
{
    if (n == 0 || lum_hash_find_pointer(&w->numbers, records[0]))
        return;
    w->packs[w->n_packs++] = (struct pack){records, n, w->numbers.n};
    for (size_t i = 0; i < n; i++)
        give_number(w, records[i]);
}

static void plan_import(void *user, struct lum_record *const *r)
{
    if ((*r)->type == LUM_RECORD_IMPORT)
        add_pack(user, (*r)->import.made, (*r)->import.n_made);
}

static void plan_bulk(void *user, struct lum_record *const *r)
{
    struct lum_snapshot_writer *w = user;
    if (!lum_hash_find_pointer(&w->numbers, *r) && bulk_bytes(*r) > INLINE_BYTES)
        add_pack(w, r, 1);
}

static void plan_single(void *user, struct lum_record *const *r)
{
    struct lum_snapshot_writer *w = user;
    if (give_number(w, *r))
        w->singles[w->n_singles++] = *r;
}

static bool plan(struct lum_snapshot_writer *w)
{
    size_t n = 0;
    each_record(&w->state, count_one, &n);
    w->packs = calloc(n ? n : 1, sizeof *w->packs);
    w->singles = calloc(n ? n : 1, sizeof(*w->singles));
    w->stands = calloc(n ? n : 1, sizeof *w->stands);
    if (!w->packs || !w->singles || !w->stands || !lum_hash_reserve(&w->numbers, n))
        return false;
    each_record(&w->state, plan_import, w);
    each_record(&w->state, plan_bulk, w);
    each_record(&w->state, plan_single, w);
    for (size_t i = 0; i < w->state.n_records; i++)
        w->stands[number_of(w, w->state.records[i])] = true;
    return true;
}

/* ---- blocks ---- */

static enum lum_status put(struct lum_snapshot_writer *w, cJSON *json, const struct lum_blobs_out *blobs,
                           struct lum_error *err)
{
    return lum_block_put(&w->file, ++w->n_blocks, w->state.rev, json, blobs, err);
}

static enum lum_status put_member(struct lum_snapshot_writer *w, const char *name, cJSON *value, bool ok,
                                  struct lum_error *err)
{
    cJSON *json = cJSON_CreateObject();
    if (!ok) {
        cJSON_Delete(value);
        value = NULL;
    }
    if (!lum_json_add(json, name, value)) {
        cJSON_Delete(json);
        json = NULL;
    }
    return put(w, json, NULL, err);
}

static enum lum_status put_start(struct lum_snapshot_writer *w, struct lum_error *err)
{
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_number(o, "records", (double)w->numbers.n) &&
              lum_json_add_number(o, "starts", (double)w->config.starts) &&
              lum_json_add_number(o, "moments", (double)w->state.past.n);
    return put_member(w, "snapshot", o, ok, err);
}

/* Those of the pack that stand, counted from its first. */
static cJSON *standing(const struct lum_snapshot_writer *w, const struct pack *p)
{
    cJSON *list = cJSON_CreateArray();
    bool ok = list != NULL;
    for (size_t i = 0; i < p->n && ok; i++)
        if (w->stands[p->first + i])
            ok = lum_json_add(list, NULL, cJSON_CreateNumber((double)i));
    if (ok)
        return list;
    cJSON_Delete(list);
    return NULL;
}

static enum lum_status put_pack(struct lum_snapshot_writer *w, const struct pack *p, struct lum_error *err)
{
    const char *known = lum_kept_find(w->config.kept, p->records[0], p->n);
    lum_sha sha;
    if (known)
        memcpy(sha, known, sizeof sha);
    enum lum_status st = known ? LUM_OK : lum_content_write(w->config.content, p->records, p->n, sha, err);
    if (st)
        return st;
    lum_kept_add(&w->kept, p->records[0], p->n, sha);
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "sha", sha) && lum_json_add_number(o, "first", (double)p->first) &&
              lum_json_add_number(o, "n", (double)p->n) && lum_json_add(o, "stand", standing(w, p));
    return put_member(w, "pack", o, ok, err);
}

static enum lum_status put_record(struct lum_snapshot_writer *w, const struct lum_record *r, struct lum_error *err)
{
    struct lum_blobs_out blobs;
    size_t number = number_of(w, r);
    cJSON *json = lum_stored_record(r, &blobs);
    bool ok =
        lum_json_add_number(json, "index", (double)number) && lum_json_add_bool(json, "stands", w->stands[number]);
    if (ok && r->type == LUM_RECORD_IMPORT && r->import.n_made) {
        const double made[2] = {(double)number_of(w, r->import.made[0]), (double)r->import.n_made};
        ok = lum_json_add(json, "made", cJSON_CreateDoubleArray(made, 2));
    }
    if (!ok) {
        cJSON_Delete(json);
        json = NULL;
    }
    return put(w, json, &blobs, err);
}

static cJSON *number_json(const struct lum_snapshot_writer *w, const struct lum_record *r)
{
    return cJSON_CreateNumber(r ? (double)number_of(w, r) : -1.0);
}

/* NULL: memory is short. */
static cJSON *changes_json(const struct lum_snapshot_writer *w, const struct lum_changes *c)
{
    cJSON *changes = cJSON_CreateArray();
    bool ok = changes != NULL;
    for (size_t i = 0; i < c->n && ok; i++)
        ok = lum_json_add(changes, NULL, number_json(w, c->changes[i].before)) &&
             lum_json_add(changes, NULL, number_json(w, c->changes[i].after));
    if (ok)
        return changes;
    cJSON_Delete(changes);
    return NULL;
}

static enum lum_status put_moment(struct lum_snapshot_writer *w, size_t i, struct lum_error *err)
{
    const struct lum_moment *m = &w->state.past.moments[i];
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_number(o, "i", (double)i) && lum_json_add_number(o, "rev", (double)m->rev) &&
              lum_json_add_number(o, "at", (double)m->at_ms) && lum_json_add_number(o, "to", (double)m->to) &&
              lum_json_add_number(o, "edits", m->n_edits) && lum_json_add_number(o, "joined", m->n_joined) &&
              lum_json_add_number(o, "did", m->did) && lum_json_add_string(o, "user", m->user) &&
              lum_json_add_string(o, "undo_group", m->group) && lum_json_add_string(o, "name", m->name) &&
              lum_json_add_string(o, "named_by", m->named_by) &&
              lum_json_add(o, "changes", changes_json(w, &m->changes));
    return put_member(w, "moment", o, ok, err);
}

static enum lum_status put_step(struct lum_snapshot_writer *w, const struct lum_history_state *h, size_t i,
                                struct lum_error *err)
{
    const struct lum_step_state *s = &h->steps[i];
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add(o, "changes", changes_json(w, &s->changes)) && lum_json_add_string(o, "user", h->user) &&
              lum_json_add_bool(o, "redo", i >= h->n_undo) && lum_json_add_string(o, "undo_group", s->group) &&
              lum_json_add_number(o, "rev", (double)s->rev);
    return put_member(w, "step", o, ok, err);
}

/* ---- life ---- */

enum lum_status lum_snapshot_begin(const struct lum_snapshot_config *config, struct lum_document_state *state,
                                   struct lum_snapshot_writer **ret_writer, struct lum_error *err)
{
    struct lum_snapshot_writer *w = lum_calloc(1, sizeof *w);
    if (!w) {
        lum_document_state_finish(state);
        lum_done_destroy(config->done);
        return lum_fail(err, LUM_ERR_NOMEM, "state", "no memory for a snapshot");
    }
    w->config = *config;
    w->next_done = config->done;
    w->state = *state;
    w->file.fd = -1;
    *state = (struct lum_document_state){0};
    enum lum_status st =
        plan(w) ? lum_block_create(&w->file, config->dir, config->name, LUM_FILE_SNAPSHOT, config->seq, 0, err)
                : lum_fail(err, LUM_ERR_NOMEM, "state", "no memory for a snapshot");
    if (!st)
        st = put_start(w, err);
    if (st)
        lum_snapshot_end(w);
    else
        *ret_writer = w;
    return st;
}

enum lum_status lum_snapshot_step(struct lum_snapshot_writer *w, bool *ret_done, struct lum_error *err)
{
    enum lum_status st = LUM_OK;
    const struct lum_history_state *h = &w->state.histories[w->next_history];
    *ret_done = false;
    if (w->next_pack < w->n_packs)
        return put_pack(w, &w->packs[w->next_pack++], err);
    if (w->next_single < w->n_singles) {
        for (unsigned i = 0; i < RECORDS_A_STEP && w->next_single < w->n_singles && !st; i++)
            st = put_record(w, w->singles[w->next_single++], err);
        return st;
    }
    if (w->next_history < w->state.n_histories) {
        if (w->next_step == 0)
            st = put_member(w, "user", cJSON_CreateString(h->user), true, err);
        if (w->next_step < h->n_undo + h->n_redo)
            return st ? st : put_step(w, h, w->next_step++, err);
        w->next_history++;
        w->next_step = 0;
        return st;
    }
    if (w->next_moment < w->state.past.n)
        return put_moment(w, w->next_moment++, err);
    if (w->next_done) {
        cJSON *done = lum_done_to_json(w->next_done);
        w->next_done = w->next_done->next;
        return put_member(w, "done", done, done != NULL, err);
    }
    st = put_member(w, "end", cJSON_CreateTrue(), true, err);
    *ret_done = !st;
    return st ? st : lum_block_sync(&w->file, err);
}

struct lum_kept_list lum_snapshot_take_kept(struct lum_snapshot_writer *w)
{
    struct lum_kept_list kept = w->kept;
    w->kept = (struct lum_kept_list){0};
    return kept;
}

uint64_t lum_snapshot_bytes(const struct lum_snapshot_writer *w)
{
    return w->file.n_bytes;
}

void lum_snapshot_end(struct lum_snapshot_writer *w)
{
    if (!w)
        return;
    lum_block_close(&w->file);
    lum_kept_finish(&w->kept);
    lum_document_state_finish(&w->state);
    lum_done_destroy(w->config.done);
    lum_hash_finish(&w->numbers);
    free(w->stands);
    free(w->packs);
    free(w->singles);
    lum_free(w);
}

/* ---- content that is known ---- */

void lum_kept_finish(struct lum_kept_list *l)
{
    for (size_t i = 0; i < l->n; i++)
        lum_record_unref(l->kept[i].first);
    free(l->kept);
    *l = (struct lum_kept_list){0};
}

void lum_kept_add(struct lum_kept_list *l, struct lum_record *first, size_t n, const char *sha)
{
    if (l->n == l->capacity) {
        size_t capacity = l->capacity ? 2 * l->capacity : 16;
        struct lum_kept *grown = realloc(l->kept, capacity * sizeof *grown);
        if (!grown)
            return;
        l->kept = grown;
        l->capacity = capacity;
    }
    struct lum_kept *k = &l->kept[l->n++];
    *k = (struct lum_kept){.first = lum_record_ref(first), .n = n};
    snprintf(k->sha, sizeof k->sha, "%s", sha);
}

const char *lum_kept_find(const struct lum_kept_list *l, const struct lum_record *first, size_t n)
{
    for (size_t i = 0; i < l->n; i++)
        if (l->kept[i].first == first && l->kept[i].n == n)
            return l->kept[i].sha;
    return NULL;
}
