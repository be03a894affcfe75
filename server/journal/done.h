/* Which edits of each user were done, by their op_id: so that one who was cut off can send again what nobody answered,
 * and nothing is done twice. Journal and snapshots keep it. Thread: whoever has it.
 *
 * Known are the last LUM_LIMIT_REPEATS of each user, of the LUM_LIMIT_REPEAT_USERS that edited last. NULL: of nobody.
 */
#ifndef LUM_SERVER_JOURNAL_DONE_H
#define LUM_SERVER_JOURNAL_DONE_H

#include "core/base/base.h"
#include "protocol/base/limits.h"

struct cJSON;

struct lum_done {
    char op_id[LUM_LIMIT_ID_BYTES + 1]; /* "": none */
    uint64_t scene_rev;                 /* 0: it was refused */
    uint64_t seq;                       /* of its entry; 0: none, or it was read from disk */
};
struct lum_done_user {
    struct lum_done_user *next; /* who edited longer ago */
    char user[LUM_LIMIT_ID_BYTES + 1];
    uint32_t n_next; /* the place that the next one takes: that of the oldest */
    struct lum_done done[LUM_LIMIT_REPEATS];
};

/* The user comes first, so that an edit can be noted. False: memory is short. */
bool lum_done_reserve(struct lum_done_user **all, const char *user);
/* Does nothing without an op_id, or of a user who is not there. */
void lum_done_note(struct lum_done_user *all, const char *user, const struct lum_done *done);
/* The newest of that name, as a client may use one again. NULL: it is not known. */
const struct lum_done *lum_done_find(const struct lum_done_user *all, const char *user, const char *op_id);
/* Edits of entries after this one were not done. */
void lum_done_lose(struct lum_done_user *all, uint64_t durable);
bool lum_done_forget(struct lum_done_user **all, const char *user);                   /* true: the user was there */
bool lum_done_copy(const struct lum_done_user *all, struct lum_done_user **ret_copy); /* false: memory is short */
void lum_done_destroy(struct lum_done_user *all);

/* {"user":"ann.3-1","op_ids":["a1","a2"],"revs":[7,0]}, oldest first. NULL: memory is short. */
struct cJSON *lum_done_to_json(const struct lum_done_user *u);
/* Comes last. LUM_ERR_INVALID: it is none, and nothing is taken. */
LUM_MUST_USE enum lum_status lum_done_read(struct lum_done_user **all, const struct cJSON *json);

#endif
