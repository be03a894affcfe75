/* The log: one logfmt line per event on stderr.
 *
 *   ts=2024-05-01T12:00:00.123Z level=info at=net text="listening on 127.0.0.1:9460"
 *
 * Text is escaped, so nothing that a client sends can forge a line, and lines are limited to a rate, so nothing that a
 * client does can fill a disk: what was dropped is counted and said. */
#ifndef LUM_SERVER_BASE_LOG_H
#define LUM_SERVER_BASE_LOG_H

#include <pthread.h>

#include "core/base/base.h"

/* Lines of LUM_LOG_AUDIT were asked for: they are written whatever the level of the log is, and none is dropped. */
enum lum_log_level { LUM_LOG_AUDIT = -1, LUM_LOG_ERROR, LUM_LOG_WARNING, LUM_LOG_INFO, LUM_LOG_DEBUG };

struct lum_stderr_log {
    int fd; /* 2; tests give their own */
    enum lum_log_level level;
    pthread_mutex_t lock;
    /* guarded by lock */
    double tokens; /* lines that may be written now */
    int64_t refilled_ns;
    uint64_t dropped;
};
void lum_stderr_log_init(struct lum_stderr_log *log, int fd, enum lum_log_level level);
void lum_stderr_log_finish(struct lum_stderr_log *log);
/* The sink that core and the rest of the server write to. Thread: any. log must outlive it. */
struct lum_log lum_stderr_log_sink(struct lum_stderr_log *log);

/* "error" "warning" "info" "debug". */
bool lum_log_level_parse(const char *name, enum lum_log_level *ret_level);

#endif
