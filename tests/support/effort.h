/* How much of a random test is run. */
#ifndef LUM_TESTS_SUPPORT_EFFORT_H
#define LUM_TESTS_SUPPORT_EFFORT_H

/* Of n seeds or rounds so many: the thread sanitizer takes thirty times as long, and races do not hang on the seed. */
#if defined(__SANITIZE_THREAD__)
#define TEST_EFFORT(n) (((n) + 7) / 8)
#else
#define TEST_EFFORT(n) (n)
#endif

#endif
