/* The instruction set of the ray tracing kernels that the tests run with: $LUMEND_ISA, as lumend reads it
 * (server/world/world.h). */
#ifndef LUM_TESTS_SUPPORT_ISA_H
#define LUM_TESTS_SUPPORT_ISA_H

#include <stdlib.h>

/* NULL: the widest. */
static inline const char *test_isa(void)
{
    return getenv("LUMEND_ISA");
}

#endif
