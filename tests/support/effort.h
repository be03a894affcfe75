/* How much of a test is run. */
#ifndef LUM_TESTS_SUPPORT_EFFORT_H
#define LUM_TESTS_SUPPORT_EFFORT_H

#include <stdbool.h>

/* Of n seeds, rounds or cases, those that differ most first, so many: the thread sanitizer takes thirty times as long,
 * and races do not hang on the seed; the address sanitizer takes eight times as long, and numbers do not hang on it.
 *
 * TEST_STRIDE: of rows or columns of a table of cases, each so manieth, where all of them are too many.
 *
 * TEST_TELLS: means of so many tell something. Of a few nobody knows the error: sanitizers leave their bounds to
 * optimised builds, whose numbers are the same. */
#if defined(__SANITIZE_THREAD__)
#define TEST_EFFORT(n) (((n) + 7) / 8)
#define TEST_STRIDE 8
#define TEST_TELLS false
#elif defined(__SANITIZE_ADDRESS__)
#define TEST_EFFORT(n) (((n) + 3) / 4)
#define TEST_STRIDE 4
#define TEST_TELLS false
#else
#define TEST_EFFORT(n) (n)
#define TEST_STRIDE 1
#define TEST_TELLS true
#endif

#endif
