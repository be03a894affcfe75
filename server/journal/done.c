#include "server/journal/done.h"

#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

static struct lum_done_user **find_user(struct lum_done_user **at, const char *user)
{
    while (*at && strcmp((*at)->user, user) != 0)
        at = &(*at)->next;
    return at;
}

bool lum_done_reserve(struct lum_done_user **all, const char *user)
{
    struct lum_done_user **at = find_user(all, user), *u = *at;
    if (u) {
        *at = u->next;
    } else {
        u = lum_calloc(1, sizeof *u);
        if (!u)
            return false;
        snprintf(u->user, sizeof u->user, "%s", user);
    }
    u->next = *all;
    *all = u;
    for (unsigned i = 0; u && i < LUM_LIMIT_REPEAT_USERS; i++)
        at = &u->next, u = u->next;
    if (u) {
        *at = NULL;
        lum_done_destroy(u);
    }
    return true;
}

void lum_done_note(struct lum_done_user *all, const char *user, const struct lum_done *done)
{
    struct lum_done_user *u = done->op_id[0] ? *find_user(&all, user) : NULL;
    if (!u)
        return;
    u->done[u->n_next] = *done;
    u->n_next = (u->n_next + 1) % LUM_LIMIT_REPEATS;
}

const struct lum_done *lum_done_find(const struct lum_done_user *all, const char *user, const char *op_id)
{
    while (all && strcmp(all->user, user) != 0)
        all = all->next;
    for (uint32_t i = 1; all && i <= LUM_LIMIT_REPEATS; i++) {
        const struct lum_done *done = &all->done[(all->n_next + LUM_LIMIT_REPEATS - i) % LUM_LIMIT_REPEATS];
        if (strcmp(done->op_id, op_id) == 0)
            return done;
    }
    return NULL;
}

void lum_done_lose(struct lum_done_user *all, uint64_t durable)
{
    for (; all; all = all->next)
        for (uint32_t i = 0; i < LUM_LIMIT_REPEATS; i++)
            if (all->done[i].seq > durable)
                all->done[i] = (struct lum_done){0};
}

bool lum_done_forget(struct lum_done_user **all, const char *user)
{
    struct lum_done_user **at = find_user(all, user), *u = *at;
    if (!u)
        return false;
    *at = u->next;
    lum_free(u);
    return true;
}

bool lum_done_copy(const struct lum_done_user *all, struct lum_done_user **ret_copy)
{
    struct lum_done_user **last = ret_copy;
    for (*ret_copy = NULL; all; all = all->next) {
        struct lum_done_user *u = lum_calloc(1, sizeof *u);
        if (!u) {
            lum_done_destroy(*ret_copy);
            *ret_copy = NULL;
            return false;
        }
        *u = *all;
        u->next = NULL;
        *last = u;
        last = &u->next;
    }
    return true;
}

void lum_done_destroy(struct lum_done_user *all)
{
    for (struct lum_done_user *next; all; all = next) {
        next = all->next;
        lum_free(all);
    }
}

/* ---- on disk ---- */

struct cJSON *lum_done_to_json(const struct lum_done_user *u)
{
    cJSON *json = cJSON_CreateObject(), *op_ids = cJSON_CreateArray(), *revs = cJSON_CreateArray();
    bool ok = op_ids && revs;
    for (uint32_t i = 0; i < LUM_LIMIT_REPEATS && ok; i++) {
        const struct lum_done *done = &u->done[(u->n_next + i) % LUM_LIMIT_REPEATS];
        if (done->op_id[0])
            ok = lum_json_add(op_ids, NULL, cJSON_CreateString(done->op_id)) &&
                 lum_json_add(revs, NULL, cJSON_CreateNumber((double)done->scene_rev));
    }
    ok = lum_json_add_string(json, "user", u->user) && ok;
    ok = lum_json_add(json, "op_ids", op_ids) && ok;
    ok = lum_json_add(json, "revs", revs) && ok;
    if (ok)
        return json;
    cJSON_Delete(json);
    return NULL;
}

static bool read_one(const cJSON *op_id, const cJSON *rev, struct lum_done *ret)
{
    lum_id id;
    if (!lum_json_to_id(op_id, "op_id", id, NULL) || !id[0] || !cJSON_IsNumber(rev) || !(rev->valuedouble >= 0) ||
        rev->valuedouble > 0x1p53)
        return false;
    *ret = (struct lum_done){.scene_rev = (uint64_t)rev->valuedouble};
    strcpy(ret->op_id, id);
    return true;
}

enum lum_status lum_done_read(struct lum_done_user **all, const struct cJSON *json)
{
    const cJSON *op_ids = cJSON_GetObjectItemCaseSensitive(json, "op_ids");
    const cJSON *revs = cJSON_GetObjectItemCaseSensitive(json, "revs");
    lum_id user;
    int n = cJSON_GetArraySize(op_ids);
    if (!lum_json_to_id(cJSON_GetObjectItemCaseSensitive(json, "user"), "user", user, NULL) || !cJSON_IsArray(op_ids) ||
        !cJSON_IsArray(revs) || n > (int)LUM_LIMIT_REPEATS || cJSON_GetArraySize(revs) != n)
        return LUM_ERR_INVALID;
    struct lum_done_user *u = lum_calloc(1, sizeof *u);
    if (!u)
        return LUM_ERR_NOMEM;
    strcpy(u->user, user);
    const cJSON *rev = revs->child;
    bool ok = true;
    for (const cJSON *o = op_ids->child; o && ok; o = o->next, rev = rev->next)
        ok = read_one(o, rev, &u->done[u->n_next++]);
    u->n_next %= LUM_LIMIT_REPEATS;
    unsigned n_users = 0;
    for (; *all; all = &(*all)->next, n_users++)
        ok = ok && strcmp((*all)->user, user) != 0;
    if (!ok || n_users >= LUM_LIMIT_REPEAT_USERS) {
        lum_free(u);
        return LUM_ERR_INVALID;
    }
    *all = u;
    return LUM_OK;
}
