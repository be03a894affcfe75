/* How much of a test is run. */
#ifndef LUM_TESTS_SUPPORT_EFFORT_H
#define LUM_TESTS_SUPPORT_EFFORT_H

#include <stdbool.h>

/* Of n seeds, rounds or cases, those that differ most first, so many: the thread sanitizer takes thirty times as long,
 * and races do not hang on the seed; the address sanitizer takes eight times as long, and what memory is touched hardly
 * hangs on it, nor do numbers.
 *
 * TEST_STRIDE: of rows or columns of a table of cases, each so manieth, where all of them are too many.
 * TEST_TAKES: of a table of cases by methods, where each pair is a test of its own, that many of each row and of each
 * column: what memory a method touches, and what a case makes it touch, is then touched by both, but not each by each.
 *
 * TEST_TELLS: means of so many tell something. Of a few nobody knows the error: sanitizers leave their bounds to
 * optimised builds, whose numbers are the same. */
#if defined(__SANITIZE_THREAD__)
#define TEST_EFFORT(n) (((n) + 7) / 8)
#define TEST_STRIDE 8
#define TEST_TELLS false
#elif defined(__SANITIZE_ADDRESS__)
#define TEST_EFFORT(n) (((n) + 7) / 8)
#define TEST_STRIDE 4
#define TEST_TELLS false
#else
#define TEST_EFFORT(n) (n)
#define TEST_STRIDE 1
#define TEST_TELLS true
#endif
#define TEST_TAKES(row, column) (((row) + (column)) % TEST_STRIDE == 0)

#endif
