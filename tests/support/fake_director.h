/* A director that only records: for tests of what stands before it, without a renderer. It defines the functions of
 * server/director/director.h that sessions and projects call, so a program links this library instead of the real one's
 * objects. */
#ifndef LUM_TESTS_SUPPORT_FAKE_DIRECTOR_H
#define LUM_TESTS_SUPPORT_FAKE_DIRECTOR_H

#include "server/director/director.h"

#define FAKE_DIRECTOR_FAILS "fails" /* scene with which lum_director_create gives an error */

struct lum_director {
    struct lum_request *posted[64]; /* owned */
    unsigned n_posted, capacity;    /* capacity: how many posts are taken before the inbox is full */
    struct lum_out *first, **last;  /* what the next take_outbox gives */
};

void fake_director_init(struct lum_director *d);
void fake_director_finish(struct lum_director *d);
void fake_director_forget(struct lum_director *d); /* frees what was posted */

#endif
