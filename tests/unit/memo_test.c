/* What stages remember of their tiles, and many arrays in one allocation. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/base/arena.h"
#include "core/pass/memo.h"

static void steps_are_taken_once(void **state)
{
    (void)state;
    struct lum_memo m = {0};
    assert_true(lum_memo_reserve(&m, 3));
    assert_int_equal(lum_memo_step(&m, 1), 0);
    assert_false(lum_memo_advance(&m, 1, 1)); /* it is not there yet */
    assert_true(lum_memo_advance(&m, 1, 0));
    assert_false(lum_memo_advance(&m, 1, 0));
    assert_true(lum_memo_advance(&m, 1, 1));
    assert_int_equal(lum_memo_step(&m, 1), 2);
    assert_int_equal(lum_memo_step(&m, 0), 0);
    assert_false(lum_memo_is_whole(&m));
    lum_memo_set(&m, 0, 1);
    lum_memo_set(&m, 2, LUM_MEMO_STEPS - 1);
    assert_true(lum_memo_is_whole(&m));
    lum_memo_set(&m, 2, 0);
    assert_false(lum_memo_is_whole(&m));
    lum_memo_finish(&m);
}

/* Whatever was reached at whatever version, also where versions have run out and begin anew. */
static void nothing_is_left_of_what_is_forgotten(void **state)
{
    (void)state;
    struct lum_memo m = {0};
    assert_true(lum_memo_reserve(&m, LUM_MEMO_STEPS));
    for (int round = 0; round < 6; round++) {
        for (uint32_t i = 0; i < m.n; i++)
            lum_memo_set(&m, i, i);
        for (uint32_t i = 0; i < m.n; i++)
            assert_int_equal(lum_memo_step(&m, i), i);
        lum_memo_forget(&m);
        for (uint32_t i = 0; i < m.n; i++)
            assert_int_equal(lum_memo_step(&m, i), 0);
        if (round == 2)
            m.version =
                UINT32_MAX / LUM_MEMO_STEPS - 2; /* the last but one; stamps of the first ones are there still */
    }
    assert_true(m.version < 4);
    lum_memo_finish(&m);
}

static void another_number_of_items_knows_nothing(void **state)
{
    (void)state;
    struct lum_memo m = {0};
    assert_true(lum_memo_reserve(&m, 2));
    lum_memo_set(&m, 0, 1);
    assert_true(lum_memo_reserve(&m, 2));
    assert_int_equal(lum_memo_step(&m, 0), 1);
    assert_true(lum_memo_reserve(&m, 5));
    assert_int_equal(lum_memo_step(&m, 0), 0);
    lum_alloc_fail_after(1);
    assert_false(lum_memo_reserve(&m, 6));
    lum_memo_finish(&m);
}

static void the_latest_around_is_found(void **state)
{
    (void)state;
    struct lum_tiling t = lum_tiling_make(40, 30, 10); /* 4 x 3 */
    uint32_t stamps[12] = {0};
    stamps[1 * t.nx + 2] = 7;
    for (uint32_t i = 0; i < t.n; i++) {
        uint32_t x = i % t.nx;
        assert_int_equal(lum_latest_around(stamps, &t, i), x >= 1 ? 7 : 0); /* all rows touch the middle one */
    }
    stamps[0] = 9;
    assert_int_equal(lum_latest_around(stamps, &t, 1 * t.nx + 1), 9);
    assert_int_equal(lum_latest_around(stamps, &t, 2 * t.nx + 1), 7);
}

struct arrays {
    struct lum_arena arena;
    uint8_t *a;
    double *b;
    uint32_t *c;
};

static void lay_out(struct arrays *s, size_t n)
{
    s->a = lum_arena_take(&s->arena, 3, 1);
    s->b = lum_arena_take(&s->arena, n, sizeof *s->b);
    s->c = lum_arena_take(&s->arena, 5, sizeof *s->c);
}

static void arrays_lie_side_by_side(void **state)
{
    (void)state;
    struct arrays s = {0};
    lay_out(&s, 9);
    assert_null(s.a);
    assert_true(lum_arena_reserve(&s.arena));
    lay_out(&s, 9);
    assert_int_equal((uintptr_t)s.a % LUM_CACHE_LINE | (uintptr_t)s.b % LUM_CACHE_LINE, 0);
    assert_ptr_equal(s.b, s.arena.memory + LUM_CACHE_LINE);
    assert_ptr_equal(s.c, s.arena.memory + 3 * LUM_CACHE_LINE); /* 9 doubles take two lines */
    for (size_t i = 0; i < 5; i++)
        assert_int_equal(s.c[i], 0);
    lum_arena_finish(&s.arena);
    assert_null(s.arena.memory);
}

static void more_than_there_can_be_is_refused(void **state)
{
    (void)state;
    const size_t most = SIZE_MAX / sizeof(double);
    for (size_t n = most - 20; n != most + 20; n++) { /* SIZE_MAX bytes, and around */
        struct arrays s = {0};
        lay_out(&s, n);
        assert_false(lum_arena_reserve(&s.arena));
        lum_arena_finish(&s.arena);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(steps_are_taken_once),
        cmocka_unit_test(nothing_is_left_of_what_is_forgotten),
        cmocka_unit_test(another_number_of_items_knows_nothing),
        cmocka_unit_test(the_latest_around_is_found),
        cmocka_unit_test(arrays_lie_side_by_side),
        cmocka_unit_test(more_than_there_can_be_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
