/* Linked into tests that the thread sanitizer leaves out, as they are on one thread: whoever makes another ends the
 * test. Calls of pthread_create come here (--wrap). */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *), void *context);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *), void *context)
{
    (void)thread, (void)attributes, (void)run, (void)context;
    fputs("a thread: this test is none of `one_thread` in tests/unit/CMakeLists.txt\n", stderr);
    abort();
}
