/* The hash table against a plain list of what should be in it. */
#include "protocol/base/hash.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { N = 257 };

static bool is_equal(const void *item, const void *key)
{
    return *(const int *)item == *(const int *)key;
}

/* Hashes that collide, wrap around the end of the slots, or are all the same: what is in the table is found, with its
 * value, and nothing else is, whatever was erased before. */
static void what_is_there_is_found(void **state)
{
    (void)state;
    static int items[N];
    for (uint64_t spread = 0; spread < 4; spread++) {
        struct lum_hash h = {0};
        bool in[N] = {false};
        for (int i = 0; i < N; i++)
            items[i] = i;
        assert_null(lum_hash_find(&h, 0, is_equal, &items[0]));
        for (unsigned step = 0; step < 20 * N; step++) {
            int k = (int)(step * 7919u % 65537u % N);
            uint64_t hash = spread == 3 ? UINT64_MAX - (uint64_t)k % 5 : (uint64_t)k * spread;
            struct lum_hash_slot *slot = lum_hash_find(&h, hash, is_equal, &items[k]);
            assert_int_equal(slot != NULL, in[k]);
            if (slot) {
                assert_int_equal(slot->value, 3 * k + 1);
                lum_hash_erase(&h, slot);
            } else {
                assert_true(lum_hash_reserve(&h, 1));
                lum_hash_insert(&h, hash, &items[k])->value = (size_t)(3 * k + 1);
            }
            in[k] = !in[k];
        }
        size_t n = 0;
        for (int k = 0; k < N; k++)
            n += in[k];
        assert_int_equal(h.n, n);
        assert_true(2 * h.n <= h.capacity);
        lum_hash_finish(&h);
    }
}

static void pointers_are_there_once(void **state)
{
    (void)state;
    static long items[N];
    struct lum_hash h = {0};
    assert_null(lum_hash_find_pointer(&h, &items[0]));
    assert_true(lum_hash_reserve(&h, N));
    for (int i = 0; i < 2 * N; i++)
        lum_hash_put_pointer(&h, &items[i % N])->value++;
    assert_int_equal(h.n, N);
    for (int i = 0; i < N; i++)
        assert_int_equal(lum_hash_find_pointer(&h, &items[i])->value, 2);
    lum_hash_finish(&h);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_there_is_found),
                                       cmocka_unit_test(pointers_are_there_once)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
