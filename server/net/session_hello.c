/* Who a session is: its token, its name, its role. */
#include <stdio.h>
#include <string.h>
#include <time.h>

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
    if (hello->resume[0] && lum_session_resume(s, hello->resume, hello->key, now_ns))
        return true;
    lum_session_make_key(s);
    if (hello->resume[0] && name_is_free(s->table, hello->resume) && lum_session_may_be(s, hello->resume)) {
        memcpy(s->user, hello->resume, sizeof s->user);
        return false;
    }
    const char *client = s->person.name[0] ? s->person.name : hello->client;
    lum_user_name(client, s->ref, s->table->config.starts, s->user);
    if (!lum_session_may_be(s, s->user)) /* a program that calls itself as somebody is called */
        lum_user_name("guest", s->ref, s->table->config.starts, s->user);
    while (!name_is_free(s->table, s->user) && strlen(s->user) + 1 < sizeof s->user)
        strcat(s->user, "_");
    return false;
}

static void refuse_hello(struct lum_session *s, const struct lum_rpc *rpc, const struct lum_proto_error *err,
                         enum lum_close code)
{
    s->table->config.counters->sessions_refused++;
    lum_session_refuse(s, rpc->id, err);
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

void lum_session_receive_hello(struct lum_session *s, const struct lum_rpc *rpc, int64_t now_ns)
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
        refuse_hello(s, rpc, &err, LUM_CLOSE_AUTH);
        log_refusal(s, hello.token[0], now_ns);
        return;
    }
    if (s->table->n_greeted == LUM_LIMIT_SESSIONS) {
        lum_proto_fail(&err, LUM_PROTO_APPLICATION, "limit_exceeded", "", "this server has its %u sessions already",
                       LUM_LIMIT_SESSIONS);
        refuse_hello(s, rpc, &err, LUM_CLOSE_BUSY);
        return;
    }
    bool resumed = set_user(s, &hello, now_ns);
    s->greeted = true;
    s->table->n_greeted++;
    lum_log(&s->table->config.log, s->table->config.audit ? LUM_LOG_AUDIT : LUM_LOG_INFO, "session",
            "%s came%s from %s, role %s", s->user, resumed ? " back" : "", s->peer, lum_role_name(s->person.role));
    int missed = resumed && hello.has_scene_rev ? lum_sessions_missed(s->table, hello.scene_rev) : -1;
    const struct lum_hello_answer answer = {
        .user = s->user, .role = s->person.role, .key = s->key, .resumed = resumed, .missed = missed};
    if (rpc->id)
        lum_session_say(s, lum_rpc_result(rpc->id, lum_hello_result(&s->table->config, &answer)));
    lum_session_say_missed(s, missed);
}
