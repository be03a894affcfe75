/* Built-in scenes, and their animations pose by pose, for tests that include core's headers and not the server's.
 * Failures end the test. */
#ifndef LUM_TESTS_SUPPORT_BUILT_IN_H
#define LUM_TESTS_SUPPORT_BUILT_IN_H

#include <stdbool.h>

struct lum_pool;
struct lum_snapshot;

struct built_in;
struct built_in *built_in_open(const char *scene, unsigned threads);
void built_in_close(struct built_in *b);
/* Applies the next instant of the scene's replay, and publishes; false: it has ended, or there is none. */
bool built_in_next_pose(struct built_in *b);
const struct lum_snapshot *built_in_snapshot(const struct built_in *b); /* valid until the next pose */
struct lum_pool *built_in_pool(const struct built_in *b);

#endif
