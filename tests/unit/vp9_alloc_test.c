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

enum { W = 70, H = 50, FRAMES = 3 };

static uint8_t pixels[4 * W * H];

/* How many frames came. */
static int run(void)
{
    struct lum_vp9 *v = lum_vp9_create(W, H, 1);
    int n = 0;
    for (int k = 0; v && k < FRAMES; k++) {
        for (int i = 0; i < 4 * W * H; i++)
            pixels[i] = (uint8_t)(i * (k + 3) / 7);
        lum_vp9_put(v, &(struct lum_vp9_part){pixels, 0, 0, W, H});
        struct lum_vp9_frame f = lum_vp9_encode(v, 2000, k == 2);
        assert_true(f.n > 0 || k == n); /* after one that failed there is none */
        n += f.n > 0;
        if (f.n == 0)
            assert_int_equal(lum_vp9_encode(v, 2000, true).n, 0);
    }
    lum_vp9_destroy(v);
    return n;
}

/* The library allocates some ten thousand times: each of the first sixteen, and ever fewer of those after. */
static void every_allocation_may_fail(void **state)
{
    (void)state;
    unsigned n_failed = 0;
    for (unsigned k = 1;; k += 1 + k / 16) {
        failing_alloc_arm(k);
        int n = run();
        bool failed = failing_alloc_disarm();
        if (!failed) {
            assert_int_equal(n, FRAMES);
            break;
        }
        n_failed++;
    }
    assert_true(n_failed > 50);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_allocation_may_fail)};
    failing_alloc_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
