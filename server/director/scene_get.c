#include "server/director/scene_get.h"

#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/base/hash.h"
#include "protocol/json/json.h"
#include "server/director/internal.h"
#include "server/world/luminaires.h"
#include "server/world/photometry.h"

#define ROUNDS_MAX 3u /* that edits may undo what was written; then the rest is written at once */

/* What a part of the document says; its records are held, so that their addresses stand for them. */
struct piece {
    struct lum_document_part part;
    char *text; /* "" where it says nothing; NULL: not written yet */
};

struct lum_scene_text {
    bool expand;
    struct lum_hash pieces;          /* by their parts */
    struct lum_document_part *parts; /* of the document at rev, in order; each has its piece, which holds its records */
    size_t n_parts, n_written;       /* of those, the first are written */
    uint64_t rev;
    uint32_t n_rounds;                /* that parts were listed */
    const struct lum_record_web *web; /* described last: lamps of one file often follow each other. Held by its piece */
    cJSON *photometry;                /* of that */
};

/* ---- pieces ---- */

static void free_piece(struct piece *p)
{
    lum_record_unref((struct lum_record *)(uintptr_t)p->part.record);
    lum_record_unref((struct lum_record *)(uintptr_t)p->part.other);
    lum_record_unref((struct lum_record *)(uintptr_t)p->part.import);
    free(p->text);
    lum_free(p);
}

static void hold(const struct lum_record *r)
{
    if (r)
        lum_record_ref((struct lum_record *)(uintptr_t)r);
}

static void free_text(struct lum_scene_text *t)
{
    if (!t)
        return;
    for (size_t i = 0; i < t->pieces.capacity; i++)
        if (t->pieces.slots[i].item)
            free_piece(t->pieces.slots[i].item);
    cJSON_Delete(t->photometry);
    free(t->parts);
    lum_hash_finish(&t->pieces);
    lum_free(t);
}

static uint64_t hash_of(const struct lum_document_part *part)
{
    return lum_hash_of_pointer(part->record) ^ lum_hash_of_pointer(part->other) << 1;
}

static bool is_of(const void *piece, const void *part)
{
    const struct lum_document_part *a = &((const struct piece *)piece)->part, *b = part;
    return a->kind == b->kind && a->record == b->record && a->other == b->other && a->import == b->import;
}

/* NULL: none yet. */
static struct piece *piece_of(const struct lum_scene_text *t, const struct lum_document_part *part)
{
    const struct lum_hash_slot *slot = lum_hash_find(&t->pieces, hash_of(part), is_of, part);
    return slot ? slot->item : NULL;
}

/* There is room. False: memory is short. */
static bool insert(struct lum_scene_text *t, const struct lum_document_part *part)
{
    if (piece_of(t, part))
        return true;
    struct piece *p = lum_calloc(1, sizeof *p);
    if (!p)
        return false;
    p->part = *part;
    hold(part->record);
    hold(part->other);
    hold(part->import);
    lum_hash_insert(&t->pieces, hash_of(part), p);
    return true;
}

/* What is said of a record that it does not have itself. */
static bool describe(struct lum_scene_text *t, const struct lum_record *r, cJSON *op)
{
    if (!t->expand || r->type != LUM_RECORD_LIGHT || !r->light.web)
        return true;
    if (t->web != r->light.web) {
        cJSON_Delete(t->photometry);
        t->photometry = lum_photometry_describe(r->light.web, false, false);
        t->web = t->photometry ? r->light.web : NULL;
    }
    return t->photometry && lum_json_add(op, "photometry", cJSON_Duplicate(t->photometry, true));
}

static bool write_part(struct lum_scene_text *t, const struct lum_document_part *part)
{
    struct piece *p = piece_of(t, part);
    if (p->text)
        return true;
    cJSON *list = cJSON_CreateArray();
    bool ok = list && lum_document_part_write(part, list);
    cJSON *op = ok ? list->child : NULL;
    ok = ok && (!op || describe(t, part->record, op));
    p->text = !ok ? NULL : op ? lum_json_print(op, NULL) : calloc(1, 1);
    cJSON_Delete(list);
    return p->text != NULL;
}

/* ---- the text ---- */

/* Is all written of the scene as it is now? */
static bool is_whole(const struct lum_director *d, const struct lum_scene_text *t)
{
    return t->parts && t->n_written == t->n_parts && t->rev == lum_document_rev(d->world.doc);
}

static void forget_parts(struct lum_scene_text *t)
{
    free(t->parts);
    t->parts = NULL;
    t->n_parts = t->n_written = 0;
}

/* What there is to write in the scene as it is now, once that of before is written: little is new then. */
static bool list_parts(const struct lum_director *d, struct lum_scene_text *t)
{
    if ((t->parts && t->n_written < t->n_parts) || is_whole(d, t))
        return true;
    forget_parts(t);
    t->n_rounds++;
    t->rev = lum_document_rev(d->world.doc);
    bool ok =
        lum_document_parts(d->world.doc, t->expand, &t->parts, &t->n_parts) && lum_hash_reserve(&t->pieces, t->n_parts);
    for (size_t i = 0; ok && i < t->n_parts; i++)
        ok = insert(t, &t->parts[i]);
    if (!ok)
        forget_parts(t); /* some have no piece; whoever asks next begins anew */
    return ok;
}

/* Until the time is over; a scene that changes all over, again and again, is written at once in the end. */
static bool write_slice(struct lum_scene_text *t, double slice_ns)
{
    int64_t from = lum_clock_ns();
    while (t->n_written < t->n_parts && (t->n_rounds > ROUNDS_MAX || (double)(lum_clock_ns() - from) < slice_ns)) {
        if (!write_part(t, &t->parts[t->n_written]))
            return false;
        t->n_written++;
    }
    return true;
}

struct joined {
    char *text;
    size_t n, capacity;
};

static bool append(struct joined *j, const char *text, size_t n)
{
    if (j->n + n + 1 > j->capacity) {
        size_t capacity = j->capacity ? 2 * j->capacity : 1u << 16;
        while (capacity < j->n + n + 1)
            capacity *= 2;
        char *more = realloc(j->text, capacity);
        if (!more)
            return false;
        j->text = more;
        j->capacity = capacity;
    }
    memcpy(j->text + j->n, text, n);
    j->n += n;
    j->text[j->n] = '\0';
    return true;
}

/* The op of an object that shines, with its light: that depends on more than its record. */
static bool append_emits(struct joined *j, const struct lum_snapshot *s, const struct piece *p)
{
    cJSON *emits;
    if (p->part.record->type != LUM_RECORD_OBJECT)
        return true;
    if (!lum_luminaire_describe(s, p->part.record->id, &emits))
        return false;
    char *text = emits ? lum_json_print(emits, NULL) : NULL;
    bool ok = !emits || text;
    if (text) {
        j->n--; /* the brace that closes it */
        ok = append(j, ",\"emits\":", 9) && append(j, text, strlen(text)) && append(j, "}", 1);
    }
    free(text);
    cJSON_Delete(emits);
    return ok;
}

/* {"ops":[...],"scene_rev":N}; NULL: memory is short. */
static cJSON *join(struct lum_director *d, const struct lum_scene_text *t)
{
    struct joined j = {0};
    bool ok = append(&j, "[", 1);
    for (size_t i = 0; i < t->n_parts && ok; i++) {
        const struct piece *p = piece_of(t, &t->parts[i]);
        if (!p->text[0])
            continue;
        ok = (j.n == 1 || append(&j, ",", 1)) && append(&j, p->text, strlen(p->text)) &&
             (!t->expand || append_emits(&j, d->world.snapshot, p));
    }
    ok = ok && append(&j, "]", 1);
    cJSON *o = cJSON_CreateObject();
    ok = ok && lum_json_add(o, "ops", cJSON_CreateRaw(j.text)) &&
         lum_json_add_number(o, "scene_rev", (double)lum_document_rev(d->world.doc));
    free(j.text);
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

/* ---- requests ---- */

enum lum_need lum_director_scene_gets_need(const struct lum_director *d)
{
    return d->scene_gets.waiting ? LUM_NEED_AWAITED : LUM_NEED_NOTHING;
}

/* Pieces of before are dropped with the text, or whoever always waits while others edit would fill the memory. */
static bool is_mostly_old(const struct lum_scene_text *t)
{
    return t && t->pieces.n > 2 * t->n_parts;
}

static void pop(struct lum_director_scene_gets *g)
{
    struct lum_request *q = g->waiting;
    g->waiting = q->next;
    if (!g->waiting || g->waiting->expand != q->expand || is_mostly_old(g->text)) {
        free_text(g->text);
        g->text = NULL;
    }
    lum_request_destroy(q);
}

void lum_director_write_scene(struct lum_director *d, double slice_ns)
{
    struct lum_director_scene_gets *g = &d->scene_gets;
    struct lum_request *q = g->waiting;
    if (!g->text && (g->text = lum_calloc(1, sizeof *g->text)))
        g->text->expand = q->expand;
    struct lum_scene_text *t = g->text;
    bool ok = t && list_parts(d, t) && write_slice(t, slice_ns);
    if (ok && !is_whole(d, t))
        return;
    cJSON *result = ok ? join(d, t) : NULL;
    if (result) {
        lum_director_reply(d, q, result);
        t->n_rounds = 1; /* for the next */
    } else {
        struct lum_proto_error err;
        lum_proto_fail_memory(&err);
        lum_director_refuse(d, q, &err);
    }
    pop(g);
}

void lum_director_drop_scene_gets(struct lum_director *d, struct lum_session_ref session)
{
    struct lum_director_scene_gets *g = &d->scene_gets;
    while (g->waiting && lum_session_same(g->waiting->session, session))
        pop(g);
    for (struct lum_request **at = g->waiting ? &g->waiting->next : &g->waiting, *q; (q = *at);) {
        if (!lum_session_same(q->session, session)) {
            at = &q->next;
            continue;
        }
        *at = q->next;
        lum_request_destroy(q);
    }
}

void lum_director_drop_all_scene_gets(struct lum_director *d)
{
    while (d->scene_gets.waiting)
        pop(&d->scene_gets);
}

static bool read_scene_get(struct lum_json_reader *r, struct lum_request *q)
{
    lum_json_bool(r, "expand", &q->expand);
    return lum_json_end(r);
}

static bool enqueue(struct lum_director *d, struct lum_request *q, struct lum_proto_error *err)
{
    struct lum_request **end = &d->scene_gets.waiting;
    uint32_t n = 0;
    for (; *end; end = &(*end)->next)
        n += lum_session_same((*end)->session, q->session);
    if (n >= LUM_LIMIT_SCENE_GETS_WAITING)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "",
                              "%u requests of this session for the scene wait already; ask again when one is answered",
                              n);
    q->next = NULL;
    *end = q;
    return true;
}

const struct lum_request_type lum_request_scene_get = {.name = "scene.get", .read = read_scene_get, .enqueue = enqueue};
