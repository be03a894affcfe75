/* A client's life without a socket: each line of the input is a text message. The first byte says how it begins: '+'
 * has said hello already. Replies are read as they come, so the queue's bound is not what is tested here. */
#include <stdint.h>
#include <string.h>

#include "server/net/metrics.h"
#include "server/net/session.h"
#include "tests/fuzz/fuzz.h"
#include "tests/support/fake_director.h"

static const char hello[] =
    "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"session.hello\",\"params\":{\"token\":\"0123456789abcdef\"}}";

static void read_replies(struct lum_session *s)
{
    struct lum_message m;
    while (lum_session_next(s, &m))
        lum_session_sent(s);
}

static void talk(struct lum_session *s, struct lum_director *d, const char *text, size_t n)
{
    while (n) {
        const char *end = memchr(text, '\n', n);
        size_t n_line = end ? (size_t)(end - text) : n;
        if (n_line <= lum_session_max_bytes(s))
            lum_session_receive(s, text, n_line);
        read_replies(s);
        fake_director_forget(d);
        n_line += end != NULL;
        text += n_line;
        n -= n_line;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    struct lum_director director;
    struct lum_net_counters counters = {0};
    const struct lum_auth auth = {.required = true, .token = "0123456789abcdef"};
    struct lum_projects *projects;
    struct lum_sessions *sessions;
    fake_director_init(&director);
    if (lum_projects_of_one(&director, NULL, &projects, NULL))
        return 0;
    const struct lum_sessions_config config = {.projects = projects, .auth = &auth, .counters = &counters};
    if (lum_sessions_create(&config, &sessions, NULL)) {
        (void)lum_projects_destroy(projects);
        return 0;
    }
    struct lum_session *s = lum_session_open(sessions, "192.0.2.7");
    if (n && data[0] == '+')
        lum_session_receive(s, hello, sizeof hello - 1);
    read_replies(s);
    talk(s, &director, (const char *)data + (n > 0), n - (n > 0));
    lum_sessions_destroy(sessions);
    (void)lum_projects_destroy(projects);
    fake_director_finish(&director);
    return 0;
}
