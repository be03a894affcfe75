/* What the table of sessions answers by itself: to administrators who is here, and that somebody goes; that files may
 * be sent; and what there is to do with projects. */
#include <string.h>
#include <time.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/log.h"
#include "server/director/read_request.h"
#include "server/net/session_internal.h"

static struct cJSON *describe(const struct lum_session *s)
{
    cJSON *o = cJSON_CreateObject();
    const char *project = s->project ? lum_project_info(s->project)->id : "";
    if (lum_json_add_string(o, "session", s->user) && lum_json_add_string(o, "person", s->person.name) &&
        lum_json_add_string(o, "role", lum_role_name(s->person.role)) && lum_json_add_string(o, "address", s->peer) &&
        lum_json_add(o, "project", project[0] ? cJSON_CreateString(project) : cJSON_CreateNull()))
        return o;
    cJSON_Delete(o);
    return NULL;
}

bool lum_session_is_here(const struct lum_session *s)
{
    return s->open && s->greeted && !s->close;
}

bool lum_session_outstayed(struct lum_session *s)
{
    bool over = s->greeted && time(NULL) >= s->person.ends_s;
    if (over)
        lum_session_abort(s, LUM_CLOSE_REVOKED);
    return over;
}

/* Of one who was silent since: whoever has the connections closes hers. */
static bool has_ended(struct lum_session *s)
{
    bool over = lum_session_outstayed(s);
    s->table->ended |= over;
    return over;
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
        if (lum_session_is_here(&t->slots[i]) && !has_ended(&t->slots[i]))
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
        if (!lum_session_is_here(s) || strcmp(s->user, user) != 0)
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

#define NO_ORDER (-1)
static const struct {
    const char *method;
    enum lum_role least;
    struct cJSON *(*answer)(struct lum_session *asking, const struct lum_rpc *rpc, struct lum_proto_error *err);
    int order; /* an enum lum_project_verb, which is answered when it is done; or NO_ORDER */
} methods[] = {{"session.list", LUM_ROLE_ADMIN, list, NO_ORDER},
               {"session.end", LUM_ROLE_ADMIN, end, NO_ORDER},
               {"presence.set", LUM_ROLE_VIEW, lum_session_be_present, NO_ORDER},
               {"asset.upload", LUM_ROLE_EDIT, lum_session_announce, NO_ORDER},
               {"project.list", LUM_ROLE_VIEW, lum_session_list_projects, NO_ORDER},
               {"project.create", LUM_ROLE_EDIT, NULL, LUM_PROJECT_CREATE},
               {"project.rename", LUM_ROLE_EDIT, NULL, LUM_PROJECT_RENAME},
               {"project.delete", LUM_ROLE_EDIT, NULL, LUM_PROJECT_DELETE},
               {"project.restore", LUM_ROLE_EDIT, NULL, LUM_PROJECT_RESTORE},
               {"project.erase", LUM_ROLE_EDIT, NULL, LUM_PROJECT_ERASE},
               {"trash.empty", LUM_ROLE_EDIT, NULL, LUM_TRASH_EMPTY},
               {"version.keep", LUM_ROLE_EDIT, NULL, LUM_VERSION_KEEP},
               {"version.list", LUM_ROLE_VIEW, NULL, LUM_VERSION_LIST},
               {"version.remove", LUM_ROLE_EDIT, NULL, LUM_VERSION_REMOVE}};

bool lum_session_administer(struct lum_session *s, struct lum_rpc *rpc)
{
    struct lum_proto_error err;
    (void)lum_proto_fail_memory(&err); /* of an answer that cannot be made; what is refused says why */
    for (size_t i = 0; i < LUM_ARRAY_LEN(methods); i++) {
        if (strcmp(methods[i].method, rpc->method) != 0)
            continue;
        bool may = lum_request_allowed(rpc->method, methods[i].least, s->person.role, &err);
        bool orders = methods[i].order != NO_ORDER;
        struct cJSON *result = may && !orders ? methods[i].answer(s, rpc, &err) : NULL;
        if (may && orders && lum_session_order_project(s, rpc, (enum lum_project_verb)methods[i].order, &err))
            return true;
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
