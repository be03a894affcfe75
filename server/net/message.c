#include "server/net/message.h"

#include <string.h>

bool lum_close_is_for_good(enum lum_close code)
{
    return code == LUM_CLOSE_REVOKED || code == LUM_CLOSE_ENDED;
}

const char *lum_close_reason(enum lum_close code)
{
    switch (code) {
    case LUM_CLOSE_UNSUPPORTED:
        return "binary messages are not understood";
    case LUM_CLOSE_TOO_BIG:
        return "the message is too big";
    case LUM_CLOSE_INTERNAL:
        return "out of memory";
    case LUM_CLOSE_RESTART:
        return "the server is stopping";
    case LUM_CLOSE_BUSY:
        return "too many sessions";
    case LUM_CLOSE_AUTH:
        return "no session.hello with the right token";
    case LUM_CLOSE_REVOKED:
        return "this token was changed or taken away";
    case LUM_CLOSE_ENDED:
        return "an administrator ended the session";
    case LUM_CLOSE_RESUMED:
        return "the session goes on by another connection";
    case LUM_CLOSE_SLOW:
        return "too much text waits to be read";
    default:
        return "";
    }
}

size_t lum_message_copy(const struct lum_message *m, size_t at, uint8_t *out, size_t n)
{
    size_t n_head = at < m->n_head ? m->n_head - at : 0;
    n_head = n_head < n ? n_head : n;
    if (n_head)
        memcpy(out, m->head + at, n_head);
    size_t left = m->n_head + m->n_body - at - n_head, room = n - n_head, n_body = left < room ? left : room;
    if (n_body)
        memcpy(out + n_head, m->body + (at + n_head - m->n_head), n_body);
    return n_head + n_body;
}
