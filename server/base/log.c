#define _GNU_SOURCE
#include "server/base/log.h"

#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define LINES_PER_S 50.0 /* a person cannot read more; 4 MB an hour */
#define LINES_BURST 200.0

static const char *const level_names[] = {"error", "warning", "info", "debug"};

bool lum_log_level_parse(const char *name, enum lum_log_level *ret_level)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(level_names); i++) {
        if (strcmp(name, level_names[i]) == 0) {
            *ret_level = (enum lum_log_level)i;
            return true;
        }
    }
    return false;
}

/* Quotes, backslashes and everything outside printable ASCII become \xNN; cut with "..." when it does not fit. */
static void escape(const char *text, char *out, size_t size)
{
    size_t n = 0;
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        if (n + 8 > size) {
            memcpy(out + n, "...", 3);
            n += 3;
            break;
        }
        if (c < 0x20 || c > 0x7e || c == '"' || c == '\\')
            n += (size_t)snprintf(out + n, size - n, "\\x%02x", c);
        else
            out[n++] = (char)c;
    }
    out[n] = '\0';
}

/* Takes a token of the bucket. *ret_dropped: lines dropped since the last one that was written. */
static bool may_write_locked(struct lum_stderr_log *log, uint64_t *ret_dropped)
{
    int64_t now_ns = lum_clock_ns();
    log->tokens += (double)(now_ns - log->refilled_ns) * 1e-9 * LINES_PER_S;
    if (log->tokens > LINES_BURST)
        log->tokens = LINES_BURST;
    log->refilled_ns = now_ns;
    if (log->tokens < 1.0) {
        log->dropped++;
        return false;
    }
    log->tokens -= 1.0;
    *ret_dropped = log->dropped;
    log->dropped = 0;
    return true;
}

static void write_line(void *user, int level, const char *component, const char *text)
{
    struct lum_stderr_log *log = user;
    uint64_t dropped = 0;
    if (level < LUM_LOG_AUDIT || level > (int)log->level)
        return;
    pthread_mutex_lock(&log->lock);
    bool ok = level == LUM_LOG_AUDIT || may_write_locked(log, &dropped);
    pthread_mutex_unlock(&log->lock);
    if (!ok)
        return;

    char escaped[1024], line[1280], stamp[32], note[48] = "";
    struct timespec now;
    struct tm utc;
    clock_gettime(CLOCK_REALTIME, &now);
    gmtime_r(&now.tv_sec, &utc);
    strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &utc);
    escape(text, escaped, sizeof escaped);
    if (dropped)
        snprintf(note, sizeof note, " dropped=%llu", (unsigned long long)dropped);
    int n = snprintf(line, sizeof line, "ts=%s.%03ldZ level=%s at=%s text=\"%s\"%s\n", stamp, now.tv_nsec / 1000000,
                     level == LUM_LOG_AUDIT ? "audit" : level_names[level], component, escaped, note);
    /* One write a line, so that lines of several threads do not mix. A full pipe or disk is not our caller's problem.
     */
    if (n > 0 && write(log->fd, line, (size_t)n < sizeof line ? (size_t)n : sizeof line - 1) < 0)
        return;
}

void lum_stderr_log_init(struct lum_stderr_log *log, int fd, enum lum_log_level level)
{
    memset(log, 0, sizeof *log);
    log->fd = fd;
    log->level = level;
    log->tokens = LINES_BURST;
    log->refilled_ns = lum_clock_ns();
    pthread_mutex_init(&log->lock, NULL);
}

void lum_stderr_log_finish(struct lum_stderr_log *log)
{
    pthread_mutex_destroy(&log->lock);
}

struct lum_log lum_stderr_log_sink(struct lum_stderr_log *log)
{
    return (struct lum_log){.write = write_line, .user = log};
}
