/* Memory that runs short on purpose: the k-th allocation fails. The linker sends the calls of our libraries here
 * (-Wl,--wrap, which whoever links the library failing_alloc gets); cJSON gets the same functions by its hooks, and so
 * may OpenSSL. Only this thread's allocations count, unless all threads' are asked for. */
#ifndef LUM_TESTS_UNIT_FAILING_ALLOC_H
#define LUM_TESTS_UNIT_FAILING_ALLOC_H

#include <stdbool.h>
#include <stddef.h>

void failing_alloc_begin(void);         /* once, before cJSON is used */
void failing_alloc_arm(unsigned k);     /* from 1 */
void failing_alloc_arm_all(unsigned k); /* likewise, of all threads together */
bool failing_alloc_disarm(void);        /* true: it came to that, and it failed */

/* For the memory functions of others. */
void *failing_malloc(size_t n);
void *failing_realloc(void *p, size_t n);

#endif
