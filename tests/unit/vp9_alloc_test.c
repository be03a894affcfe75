/* Memory that runs short while VP9 is encoded, ours and libvpx's own: it is an answer, and nothing leaks. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/stream/vp9.h"
#include "tests/unit/failing_alloc.h"

enum { FRAMES = 3, MOST_PIXELS = 640 * 200 };

/* Where an allocation fails while libvpx 1.12 sets its second thread up it loses what it had of that picture: 20 MB in
 * all of these failures. It frees all with one thread, which holds us to closing what we opened. */
__attribute__((visibility("default"))) const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void)
{
    return "leak:vpx_memalign\n";
}

/* The second has two columns of blocks, so that two threads have work. */
static const struct size {
    uint32_t w, h, n_threads;
} small = {70, 50, 1}, wide = {640, 200, 2};

static uint8_t pixels[4 * MOST_PIXELS];

/* How many frames came. */
static int run(const struct size *s)
{
    struct lum_vp9 *v = lum_vp9_create(s->w, s->h, s->n_threads);
    int n = 0;
    for (int k = 0; v && k < FRAMES; k++) {
        for (uint32_t i = 0; i < 4 * s->w * s->h; i++)
            pixels[i] = (uint8_t)(i * (uint32_t)(k + 3) / 7);
        lum_vp9_put(v, &(struct lum_vp9_part){pixels, 0, 0, s->w, s->h});
        struct lum_vp9_frame f = lum_vp9_encode(v, 2000, k == 2);
        assert_true(f.n == 0 || k == n); /* after one that failed there is none */
        n += f.n > 0;
        if (f.n == 0)
            assert_int_equal(lum_vp9_encode(v, 2000, true).n, 0);
    }
    lum_vp9_destroy(v);
    return n;
}

/* The library allocates some ten thousand times: each of the first sixteen, and ever fewer of those after. */
static void allocations_may_fail(const struct size *s, void (*arm)(unsigned k))
{
    unsigned n_failed = 0;
    for (unsigned k = 1;; k += 1 + k / 16) {
        arm(k);
        int n = run(s);
        bool failed = failing_alloc_disarm();
        if (!failed) {
            assert_int_equal(n, FRAMES);
            break;
        }
        n_failed++;
    }
    assert_true(n_failed > 50);
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    allocations_may_fail(&small, failing_alloc_arm);
}

static void of_two_threads_too(void **state)
{
    (void)state;
    allocations_may_fail(&wide, failing_alloc_arm_all);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_allocation_may_fail),
                                       cmocka_unit_test(of_two_threads_too)};
    failing_alloc_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
