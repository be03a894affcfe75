/* Content that several threads read before it is asked for is what one reads that asks. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/journal/read_ahead.h"

enum { FILES = 12, PIXELS = 64 * 64 };

struct fixture {
    char path[64];
    struct lum_dir content;
    lum_sha shas[FILES];
};

static struct lum_record *picture(int k)
{
    char id[16];
    snprintf(id, sizeof id, "p%d", k);
    struct lum_record *r = lum_record_create(LUM_RECORD_IMAGE, id);
    assert_non_null(r);
    r->image.width = r->image.height = 64;
    strcpy(r->image.texel, "srgb8");
    r->image.n_bytes = 4 * PIXELS;
    r->image.pixels = lum_bulk_create(r->image.n_bytes);
    assert_non_null(r->image.pixels);
    memset(r->image.pixels, k + 1, r->image.n_bytes);
    return r;
}

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    assert_non_null(f);
    strcpy(f->path, "/tmp/lumend-ahead-XXXXXX");
    assert_non_null(mkdtemp(f->path));
    assert_int_equal(lum_dir_open(AT_FDCWD, f->path, true, &lum_disk_real, &f->content, NULL), LUM_OK);
    for (int k = 0; k < FILES; k++) {
        struct lum_record *r = picture(k);
        assert_int_equal(lum_content_write(&f->content, &r, 1, f->shas[k], NULL), LUM_OK);
        lum_record_unref(r);
    }
    *state = f;
    return 0;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    for (int k = 0; k < FILES; k++)
        lum_dir_remove(&f->content, f->shas[k]);
    lum_dir_close(&f->content);
    rmdir(f->path);
    free(f);
    return 0;
}

static void assert_picture(const struct lum_record_list *list, int k)
{
    char id[16];
    snprintf(id, sizeof id, "p%d", k);
    assert_int_equal(list->n, 1);
    assert_string_equal(list->records[0]->id, id);
    assert_int_equal(list->records[0]->image.n_bytes, 4 * PIXELS);
    for (size_t i = 0; i < 4 * PIXELS; i++)
        assert_int_equal(((const uint8_t *)list->records[0]->image.pixels)[i], k + 1);
}

static void take(struct lum_read_ahead *a, const struct fixture *f, int k)
{
    struct lum_record_list list;
    assert_true(lum_read_ahead_take(a, f->shas[k], &list));
    assert_picture(&list, k);
    lum_record_list_finish(&list);
}

static void it_is_what_was_written_in_any_order(void **state)
{
    struct fixture *f = *state;
    struct lum_record_list list;
    struct lum_read_ahead *a = lum_read_ahead_begin(&f->content, (const lum_sha *)f->shas, FILES);
    assert_non_null(a);
    for (int k = 0; k < FILES; k++)
        take(a, f, (5 * k + 3) % FILES);
    assert_false(lum_read_ahead_take(a, f->shas[0], &list)); /* it was given away */
    lum_read_ahead_end(a);
}

/* Two imports of one file have records of their own. */
static void what_is_named_twice_is_there_twice(void **state)
{
    struct fixture *f = *state;
    struct lum_record_list lists[2], none;
    lum_sha shas[2];
    memcpy(shas[0], f->shas[4], sizeof shas[0]);
    memcpy(shas[1], f->shas[4], sizeof shas[1]);
    struct lum_read_ahead *a = lum_read_ahead_begin(&f->content, (const lum_sha *)shas, 2);
    for (int i = 0; i < 2; i++) {
        assert_true(lum_read_ahead_take(a, f->shas[4], &lists[i]));
        assert_picture(&lists[i], 4);
    }
    assert_ptr_not_equal(lists[0].records[0], lists[1].records[0]);
    assert_false(lum_read_ahead_take(a, f->shas[4], &none));
    assert_false(lum_read_ahead_take(a, f->shas[5], &none)); /* not among them */
    assert_false(lum_read_ahead_take(NULL, f->shas[5], &none));
    lum_read_ahead_end(a);
    lum_record_list_finish(&lists[0]);
    lum_record_list_finish(&lists[1]);
}

/* One byte is another, one file is gone: whoever asks has to look, and tells it. */
static void what_is_damaged_is_left_to_who_asks(void **state)
{
    struct fixture *f = *state;
    struct lum_record_list list;
    int fd = openat(f->content.fd, f->shas[2], O_WRONLY);
    assert_true(fd >= 0);
    assert_int_equal(pwrite(fd, "?", 1, 3000), 1);
    close(fd);
    lum_dir_remove(&f->content, f->shas[7]);
    struct lum_read_ahead *a = lum_read_ahead_begin(&f->content, (const lum_sha *)f->shas, FILES);
    for (int k = 0; k < FILES; k++) {
        if (k == 2 || k == 7)
            assert_false(lum_read_ahead_take(a, f->shas[k], &list));
        else
            take(a, f, k);
    }
    lum_read_ahead_end(a);
}

/* Nobody asks for the rest, nor for anything: it is freed (which the address sanitizer sees). */
static void the_end_comes_at_any_time(void **state)
{
    struct fixture *f = *state;
    for (int n = 0; n < 3; n++) {
        struct lum_read_ahead *a = lum_read_ahead_begin(&f->content, (const lum_sha *)f->shas, FILES);
        for (int k = 0; k < n; k++)
            take(a, f, k);
        lum_read_ahead_end(a);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(it_is_what_was_written_in_any_order, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_is_named_twice_is_there_twice, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_is_damaged_is_left_to_who_asks, set_up, tear_down),
        cmocka_unit_test_setup_teardown(the_end_comes_at_any_time, set_up, tear_down),
    };
    return cmocka_run_group_tests_name("read_ahead", tests, NULL, NULL);
}
