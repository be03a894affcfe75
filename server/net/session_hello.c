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
        if (t->slots[i].open && t->slots[i].greeted && strcmp(t->slots[i].user, user) == 0)
            return false;
    return true;
}

/* resume: a name from before, which who was cut off may take again. */
static void set_user(struct lum_session *s, const char *client, const char *resume)
{
    if (resume[0] && name_is_free(s->table, resume)) {
        memcpy(s->user, resume, sizeof s->user);
        return;
    }
    lum_user_name(client, s->ref, s->table->config.starts, s->user);
    while (!name_is_free(s->table, s->user) && strlen(s->user) + 1 < sizeof s->user)
        strcat(s->user, "_");
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
    set_user(s, s->person.name[0] ? s->person.name : hello.client, hello.resume);
    s->greeted = true;
    s->table->n_greeted++;
    lum_log(&s->table->config.log, s->table->config.audit ? LUM_LOG_AUDIT : LUM_LOG_INFO, "session",
            "%s came from %s, role %s", s->user, s->peer, lum_role_name(s->person.role));
    if (rpc->id)
        lum_session_say(s, lum_rpc_result(rpc->id, lum_hello_result(&s->table->config, s->user, s->person.role)));
}
