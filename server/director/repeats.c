#include "server/director/repeats.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

bool lum_repeats_reserve(struct lum_director *d, const struct lum_request *q)
{
    return !q->op_id[0] || lum_done_reserve(&d->repeats, q->user);
}

void lum_repeats_note(struct lum_director *d, const struct lum_request *q, uint64_t scene_rev, uint64_t seq)
{
    struct lum_done done = {.scene_rev = scene_rev, .seq = seq};
    memcpy(done.op_id, q->op_id, sizeof done.op_id);
    lum_done_note(d->repeats, q->user, &done);
}

void lum_repeats_note_refused(struct lum_director *d, const struct lum_request *q)
{
    lum_repeats_note(d, q, 0, 0);
}

bool lum_repeats_answer(struct lum_director *d, const struct lum_request *q)
{
    const struct lum_done *done = lum_done_find(d->repeats, q->user, q->op_id);
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

bool lum_repeats_forget(struct lum_director *d, const char *user)
{
    for (struct lum_import_job *job = d->jobs; job; job = job->next)
        if (strcmp(job->request->user, user) == 0)
            job->request->op_id[0] = '\0'; /* or its end would remember a user whom nobody forgets any more */
    return lum_done_forget(&d->repeats, user);
}
