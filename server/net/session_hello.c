/* Who a session is: its token, its name, its role. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/log.h"
#include "server/net/hello.h"
#include "server/net/metrics.h"
#include "server/net/session_internal.h"
#include "server/net/user_name.h"

static bool name_is_free(const struct lum_sessions *t, const char *user)
{
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++)
        if (t->slots[i].open && t->slots[i].greeted && !t->slots[i].superseded && strcmp(t->slots[i].user, user) == 0)
            return false;
    return !lum_sessions_have_parked(t, user);
}

/* True: the session goes on with one from before. */
static bool set_user(struct lum_session *s, const struct lum_hello *hello, int64_t now_ns)
{
    if (hello->resume[0] && s->project && lum_session_resume(s, hello->resume, hello->key, now_ns))
        return true;
    if (s->project)
        lum_session_make_key(s);
    if (hello->resume[0] && s->project && name_is_free(s->table, hello->resume) &&
        lum_session_may_be(s, hello->resume)) {
        memcpy(s->user, hello->resume, sizeof s->user);
        return false;
    }
    const char *client = s->person.name[0] ? s->person.name : hello->client;
    uint64_t starts = s->project ? lum_project_starts(s->project) : 0;
    lum_user_name(client, s->ref, starts, s->user);
    if (!lum_session_may_be(s, s->user)) /* a program that calls itself as somebody is called */
        lum_user_name("guest", s->ref, starts, s->user);
    while (!name_is_free(s->table, s->user) && strlen(s->user) + 1 < sizeof s->user)
        strcat(s->user, "_");
    return false;
}

static void refuse_hello(struct lum_session *s, const char *id, const struct lum_proto_error *err, enum lum_close code)
{
    s->table->config.counters->sessions_refused++;
    lum_session_refuse(s, id, err);
    lum_session_abort_after_text(s, code);
}

/* One line a second at most: who tries tokens in a loop shall not push other lines out of the log. Never the token. */
static void log_refusal(const struct lum_session *s, bool has_token, int64_t now_ns)
{
    struct lum_sessions *t = s->table;
    if (t->refusal_told_ns && now_ns - t->refusal_told_ns < 1000000000) {
        t->n_untold++;
        return;
    }
    char more[40] = "";
    if (t->n_untold)
        snprintf(more, sizeof more, ", after %u others", t->n_untold);
    lum_log(&t->config.log, LUM_LOG_INFO, "session", "%s turned away: %s token%s", s->peer, has_token ? "wrong" : "no",
            more);
    t->refusal_told_ns = now_ns;
    t->n_untold = 0;
}

static bool is_full(struct lum_session *s, const char *id)
{
    struct lum_proto_error err;
    if (s->table->n_greeted < LUM_LIMIT_SESSIONS)
        return false;
    lum_proto_fail(&err, LUM_PROTO_APPLICATION, "limit_exceeded", "", "this server has its %u sessions already",
                   LUM_LIMIT_SESSIONS);
    refuse_hello(s, id, &err, LUM_CLOSE_BUSY);
    return true;
}

static void greet(struct lum_session *s, const struct lum_hello *hello, const char *id, int64_t now_ns)
{
    const struct lum_project_info *info = s->project ? lum_project_info(s->project) : NULL;
    bool resumed = set_user(s, hello, now_ns);
    s->greeted = true;
    s->table->n_greeted++;
    s->table->people_rev++;
    lum_session_stir(s);
    lum_log(&s->table->config.log, s->table->config.audit ? LUM_LOG_AUDIT : LUM_LOG_INFO, "session",
            "%s came%s from %s, role %s%s%s", s->user, resumed ? " back" : "", s->peer, lum_role_name(s->person.role),
            info && info->id[0] ? ", to " : "", info ? info->id : "");
    int missed = resumed && hello->has_scene_rev
                     ? lum_changes_kept_missed(lum_project_changes(s->project), hello->scene_rev)
                     : -1;
    const struct lum_hello_answer answer = {.project = s->project,
                                            .user = s->user,
                                            .role = s->person.role,
                                            .key = s->key,
                                            .resumed = resumed,
                                            .missed = missed};
    if (id)
        lum_session_say(s, lum_rpc_result(id, lum_hello_result(&s->table->config, &answer)));
    lum_session_say_missed(s, missed);
}

/* Who waits knows that the server is there, at once and again: silence is that of a server that is gone. */
static void tell_opening(struct lum_session *s, int64_t now_ns)
{
    const char *stage = lum_projects_stage(s->table->config.projects, s->waiting->project);
    bool same = s->told_stage && strcmp(stage, s->told_stage) == 0;
    if (same && now_ns - s->told_ns < LUM_LIMIT_OPENING_TOLD_S * 1000000000ll)
        return;
    cJSON *params = cJSON_CreateObject();
    bool ok = lum_json_add_string(params, "project", s->waiting->project) &&
              lum_json_add_string(params, "stage", stage) &&
              lum_json_add_number(params, "waited_s", (double)((now_ns - s->waiting_ns) / 1000000000));
    s->told_ns = now_ns;
    s->told_stage = stage;
    if (!ok)
        cJSON_Delete(params);
    lum_session_say(s, ok ? lum_rpc_notification("project.opening", params) : NULL);
}

/* Its project has to be opened first. */
static void wait_for_project(struct lum_session *s, const struct lum_hello *hello, struct lum_rpc *rpc, int64_t now_ns)
{
    struct lum_proto_error err;
    s->waiting = lum_calloc(1, sizeof *s->waiting);
    if (!s->waiting) {
        lum_proto_fail_memory(&err);
        lum_session_refuse(s, rpc->id, &err);
        return;
    }
    *s->waiting = *hello;
    s->waiting_id = rpc->id;
    rpc->id = NULL;
    s->waiting_ns = now_ns;
    tell_opening(s, now_ns);
}

void lum_session_stop_waiting(struct lum_session *s)
{
    lum_free(s->waiting);
    free(s->waiting_id);
    s->waiting = NULL;
    s->waiting_id = NULL;
    s->told_stage = NULL;
}

/* A session that is refused a project has not said hello: it may name another one, within the time for that. */
static enum lum_project_door enter(struct lum_session *s, const struct lum_hello *hello, const char *id, int64_t now_ns)
{
    struct lum_proto_error err;
    struct lum_projects *projects = s->table->config.projects;
    if (lum_projects_are_many(projects) && !hello->project[0])
        return LUM_PROJECT_IN; /* none: it sees the list */
    enum lum_project_door door = lum_projects_enter(projects, hello->project, now_ns, &s->project, &err);
    if (door == LUM_PROJECT_NO)
        lum_session_refuse(s, id, &err);
    return door;
}

void lum_session_go_on_waiting(struct lum_session *s, int64_t now_ns)
{
    const struct lum_hello hello = *s->waiting;
    char *id = s->waiting_id;
    if (!lum_auth_still(s->table->config.auth, &s->person, time(NULL))) {
        lum_session_abort(s, LUM_CLOSE_REVOKED);
        return;
    }
    enum lum_project_door door = is_full(s, id) ? LUM_PROJECT_NO : enter(s, &hello, id, now_ns);
    if (door == LUM_PROJECT_SOON) {
        tell_opening(s, now_ns);
        return;
    }
    s->waiting_id = NULL;
    lum_session_stop_waiting(s);
    if (door == LUM_PROJECT_IN)
        greet(s, &hello, id, now_ns);
    free(id);
}

void lum_session_receive_hello(struct lum_session *s, struct lum_rpc *rpc, int64_t now_ns)
{
    struct lum_proto_error err;
    struct lum_hello hello;
    if (s->greeted) {
        lum_proto_fail(&err, LUM_PROTO_BAD_REQUEST, "conflict", "method", "hello was said already");
        lum_session_refuse(s, rpc->id, &err);
        return;
    }
    if (!lum_hello_read(rpc, &hello, &err)) {
        lum_session_refuse(s, rpc->id, &err);
        return;
    }
    struct lum_error why;
    if (!lum_auth_check(s->table->config.auth, hello.token, time(NULL), &s->person, &why)) {
        lum_proto_fail(&err, LUM_PROTO_APPLICATION, "not_authorised", "token", "%.200s", why.text);
        refuse_hello(s, rpc->id, &err, LUM_CLOSE_AUTH);
        log_refusal(s, hello.token[0], now_ns);
        return;
    }
    if (is_full(s, rpc->id))
        return;
    enum lum_project_door door = enter(s, &hello, rpc->id, now_ns);
    if (door == LUM_PROJECT_IN)
        greet(s, &hello, rpc->id, now_ns);
    else if (door == LUM_PROJECT_SOON)
        wait_for_project(s, &hello, rpc, now_ns);
}
