#include "server/director/repeats.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

struct done {
    char op_id[LUM_LIMIT_ID_BYTES + 1]; /* "": none */
    uint64_t scene_rev;                 /* 0: it was refused */
    uint64_t seq;
};

struct lum_repeats {
    struct lum_repeats *next;
    char user[LUM_LIMIT_ID_BYTES + 1];
    uint32_t n_next; /* the place that the next one takes: that of the oldest */
    struct done done[LUM_LIMIT_REPEATS];
};

static struct lum_repeats **find(struct lum_director *d, const char *user)
{
    struct lum_repeats **at = &d->repeats;
    while (*at && strcmp((*at)->user, user) != 0)
        at = &(*at)->next;
    return at;
}

bool lum_repeats_reserve(struct lum_director *d, const struct lum_request *q)
{
    struct lum_repeats **at = find(d, q->user);
    if (!q->op_id[0] || *at)
        return true;
    struct lum_repeats *r = lum_calloc(1, sizeof *r);
    if (!r)
        return false;
    strcpy(r->user, q->user);
    *at = r;
    return true;
}

static void note(struct lum_director *d, const struct lum_request *q, uint64_t scene_rev, uint64_t seq)
{
    struct lum_repeats *r = q->op_id[0] ? *find(d, q->user) : NULL;
    if (!r)
        return;
    struct done *done = &r->done[r->n_next];
    r->n_next = (r->n_next + 1) % LUM_LIMIT_REPEATS;
    *done = (struct done){.scene_rev = scene_rev, .seq = seq};
    strcpy(done->op_id, q->op_id);
}

void lum_repeats_note(struct lum_director *d, const struct lum_request *q, uint64_t scene_rev, uint64_t seq)
{
    note(d, q, scene_rev, seq);
}

void lum_repeats_note_refused(struct lum_director *d, const struct lum_request *q)
{
    if (q->type != &lum_request_scene_apply)
        note(d, q, 0, 0);
}

/* The newest: a client may use a name again. */
static const struct done *find_done(struct lum_director *d, const struct lum_request *q)
{
    const struct lum_repeats *r = *find(d, q->user);
    for (uint32_t i = 1; r && i <= LUM_LIMIT_REPEATS; i++) {
        const struct done *done = &r->done[(r->n_next + LUM_LIMIT_REPEATS - i) % LUM_LIMIT_REPEATS];
        if (strcmp(done->op_id, q->op_id) == 0)
            return done;
    }
    return NULL;
}

bool lum_repeats_answer(struct lum_director *d, const struct lum_request *q)
{
    const struct done *done = find_done(d, q);
    if (!done)
        return false;
    if (done->scene_rev == 0) {
        struct lum_proto_error err;
        lum_proto_fail(&err, LUM_PROTO_APPLICATION, "conflict", "op_id", "\"%s\" was refused when it came first",
                       q->op_id);
        lum_director_refuse(d, q, &err);
        return true;
    }
    cJSON *result = cJSON_CreateObject();
    lum_json_add_number(result, "scene_rev", (double)done->scene_rev);
    lum_json_add_bool(result, "repeated", true);
    lum_director_reply_edit(d, q, result, done->seq);
    return true;
}

void lum_repeats_lose(struct lum_director *d, uint64_t durable)
{
    for (struct lum_repeats *r = d->repeats; r; r = r->next)
        for (uint32_t i = 0; i < LUM_LIMIT_REPEATS; i++)
            if (r->done[i].seq > durable)
                r->done[i] = (struct done){0};
}

void lum_repeats_forget(struct lum_director *d, const char *user)
{
    struct lum_repeats **at = find(d, user), *r = *at;
    for (struct lum_import_job *job = d->jobs; job; job = job->next)
        if (strcmp(job->request->user, user) == 0)
            job->request->op_id[0] = '\0'; /* or its end would remember a user whom nobody forgets any more */
    if (!r)
        return;
    *at = r->next;
    lum_free(r);
}

void lum_repeats_destroy(struct lum_repeats *all)
{
    for (struct lum_repeats *next; all; all = next) {
        next = all->next;
        lum_free(all);
    }
}
