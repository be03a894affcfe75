/* Memory that runs short on purpose: the k-th allocation fails. The linker sends the calls of our libraries here
 * (-Wl,--wrap, which whoever links the library failing_alloc gets); cJSON gets the same functions by its hooks. Only
 * this thread's allocations count. */
#ifndef LUM_TESTS_UNIT_FAILING_ALLOC_H
#define LUM_TESTS_UNIT_FAILING_ALLOC_H

#include <stdbool.h>

void failing_alloc_begin(void);     /* once, before cJSON is used */
void failing_alloc_arm(unsigned k); /* from 1 */
bool failing_alloc_disarm(void);    /* true: it came to that, and it failed */

#endif
