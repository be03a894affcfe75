/* A text message of a client while its fragments come. Thread: the net thread, for everything. */
#ifndef LUM_SERVER_NET_FRAGMENTS_H
#define LUM_SERVER_NET_FRAGMENTS_H

#include <stdbool.h>
#include <stddef.h>

/* In caller memory, all zero: empty. */
struct lum_fragments {
    char *bytes;
    size_t n, capacity;
};
/* max: of the whole message, which the caller keeps to. False: memory is short. */
bool lum_fragments_add(struct lum_fragments *rx, const char *bytes, size_t n, size_t max);
void lum_fragments_clear(struct lum_fragments *rx); /* for the next message */
void lum_fragments_finish(struct lum_fragments *rx);

#endif
