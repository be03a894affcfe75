#include "server/cli/progress.h"

#define TTY_AFTER_NS INT64_C(1000000000)
#define TTY_EVERY_NS INT64_C(250000000)
#define LOG_AFTER_NS INT64_C(2000000000)

bool lum_progress_due(struct lum_progress *p, int64_t now_ns)
{
    int64_t t = now_ns - p->start_ns;
    if (p->after_ns == 0)
        p->after_ns = p->tty ? TTY_AFTER_NS : LOG_AFTER_NS;
    if (t < p->after_ns)
        return false;
    if (p->tty)
        p->after_ns = t + TTY_EVERY_NS;
    while (!p->tty && p->after_ns <= t)
        p->after_ns *= 2;
    return true;
}
