/* When a batch command says how far it is: often on a terminal, where a line replaces the one before; seldom in a log.
 */
#ifndef LUM_SERVER_CLI_PROGRESS_H
#define LUM_SERVER_CLI_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

struct lum_progress {
    bool tty;
    int64_t start_ns; /* of the command; any clock */
    int64_t after_ns; /* since then: nothing is said before. 0: as lum_progress_due has it */
};

/* True: say it now. On a terminal after 1 s and then four times a second; else after 2 s, 4 s, 8 s and so on. */
bool lum_progress_due(struct lum_progress *p, int64_t now_ns);

#endif
