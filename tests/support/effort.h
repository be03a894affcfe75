/* How much of a random test is run. */
#ifndef LUM_TESTS_SUPPORT_EFFORT_H
#define LUM_TESTS_SUPPORT_EFFORT_H

/* Of n seeds, rounds or cases, those that differ most first, so many: the thread sanitizer takes thirty times as long,
 * and races do not hang on the seed; the address sanitizer takes eight times as long, and numbers do not hang on it. */
#if defined(__SANITIZE_THREAD__)
#define TEST_EFFORT(n) (((n) + 7) / 8)
#elif defined(__SANITIZE_ADDRESS__)
#define TEST_EFFORT(n) (((n) + 1) / 2)
#else
#define TEST_EFFORT(n) (n)
#endif

#endif
