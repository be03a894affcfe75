/* What the table of sessions answers by itself: to administrators who is here, and that somebody goes; and that files
 * may be sent. */
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/log.h"
#include "server/director/read_request.h"
#include "server/net/session_internal.h"

static struct cJSON *describe(const struct lum_session *s)
{
    cJSON *o = cJSON_CreateObject();
    if (lum_json_add_string(o, "session", s->user) && lum_json_add_string(o, "person", s->person.name) &&
        lum_json_add_string(o, "role", lum_role_name(s->person.role)) && lum_json_add_string(o, "address", s->peer))
        return o;
    cJSON_Delete(o);
    return NULL;
}

static bool is_here(const struct lum_session *s)
{
    return s->open && s->greeted && !s->close;
}

static struct cJSON *list(struct lum_session *asking, const struct lum_rpc *rpc, struct lum_proto_error *err)
{
    struct lum_json_reader r;
    struct lum_sessions *t = asking->table;
    lum_json_begin(&r, rpc->params, "", err);
    if (!lum_json_end(&r))
        return NULL;
    cJSON *result = cJSON_CreateObject(), *sessions = cJSON_CreateArray();
    bool ok = sessions != NULL;
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS && ok; i++)
        if (is_here(&t->slots[i]))
            ok = lum_json_add(sessions, NULL, describe(&t->slots[i]));
    if (lum_json_add(result, "sessions", sessions) && ok)
        return result;
    cJSON_Delete(result);
    lum_proto_fail_memory(err);
    return NULL;
}

static struct cJSON *end(struct lum_session *asking, const struct lum_rpc *rpc, struct lum_proto_error *err)
{
    struct lum_json_reader r;
    struct lum_sessions *t = asking->table;
    lum_id user = "";
    lum_json_begin(&r, rpc->params, "", err);
    if (lum_json_require(&r, "session"))
        lum_json_id(&r, "session", user);
    if (!lum_json_end(&r))
        return NULL;
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++) {
        struct lum_session *s = &t->slots[i];
        if (!is_here(s) || strcmp(s->user, user) != 0)
            continue;
        lum_log(&t->config.log, t->config.audit ? LUM_LOG_AUDIT : LUM_LOG_INFO, "session", "%s is sent away by %s",
                user, asking->user);
        lum_session_abort(s, LUM_CLOSE_ENDED);
        t->ended = true;
        return cJSON_CreateObject();
    }
    lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "session", "there is no session \"%s\"", user);
    return NULL;
}

static const struct {
    const char *method;
    enum lum_role least;
    struct cJSON *(*answer)(struct lum_session *asking, const struct lum_rpc *rpc, struct lum_proto_error *err);
} methods[] = {{"session.list", LUM_ROLE_ADMIN, list},
               {"session.end", LUM_ROLE_ADMIN, end},
               {"asset.upload", LUM_ROLE_EDIT, lum_session_announce}};

bool lum_session_administer(struct lum_session *s, const struct lum_rpc *rpc)
{
    struct lum_proto_error err;
    for (size_t i = 0; i < LUM_ARRAY_LEN(methods); i++) {
        if (strcmp(methods[i].method, rpc->method) != 0)
            continue;
        bool may = lum_request_allowed(rpc->method, methods[i].least, s->person.role, &err);
        struct cJSON *result = may ? methods[i].answer(s, rpc, &err) : NULL;
        if (!result)
            lum_session_refuse(s, rpc->id, &err);
        else if (rpc->id)
            lum_session_say(s, lum_rpc_result(rpc->id, result));
        else
            cJSON_Delete(result);
        return true;
    }
    return false;
}
