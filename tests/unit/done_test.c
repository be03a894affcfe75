/* What was done, by user and op_id: the last of each user, of the last users; on disk and back; what is none is refused
 * whole; memory that runs short costs nothing that was there. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "server/journal/done.h"
#include "tests/unit/failing_alloc.h"

static void add(struct lum_done_user **all, const char *user, const char *op_id, uint64_t rev)
{
    struct lum_done done = {.scene_rev = rev, .seq = rev};
    snprintf(done.op_id, sizeof done.op_id, "%s", op_id);
    assert_true(lum_done_reserve(all, user));
    lum_done_note(*all, user, &done);
}

static uint64_t rev_of(const struct lum_done_user *all, const char *user, const char *op_id)
{
    const struct lum_done *done = lum_done_find(all, user, op_id);
    return done ? done->scene_rev : UINT64_MAX;
}

static void the_last_are_known(void **state)
{
    (void)state;
    struct lum_done_user *all = NULL;
    char name[16];
    for (unsigned i = 0; i <= LUM_LIMIT_REPEATS; i++) {
        snprintf(name, sizeof name, "e%u", i);
        add(&all, "ann", name, i + 1);
    }
    assert_int_equal(rev_of(all, "ann", "e0"), UINT64_MAX);
    assert_int_equal(rev_of(all, "ann", "e1"), 2);
    for (unsigned i = 0; i < LUM_LIMIT_REPEAT_USERS - 1; i++) {
        snprintf(name, sizeof name, "u%u", i);
        add(&all, name, "e1", 7);
    }
    assert_int_equal(rev_of(all, "ann", "e1"), 2);
    add(&all, "bob", "e1", 8);
    assert_int_equal(rev_of(all, "ann", "e1"), UINT64_MAX);
    assert_int_equal(rev_of(all, "u0", "e1"), 7);
    lum_done_lose(all, 7);
    assert_int_equal(rev_of(all, "bob", "e1"), UINT64_MAX);
    assert_true(lum_done_forget(&all, "u0"));
    assert_false(lum_done_forget(&all, "u0"));
    lum_done_destroy(all);
}

static void it_is_the_same_after_disk(void **state)
{
    (void)state;
    struct lum_done_user *all = NULL, *read = NULL;
    char name[16];
    for (unsigned i = 0; i < LUM_LIMIT_REPEATS + 3; i++) {
        snprintf(name, sizeof name, "e%u", i);
        add(&all, "ann", name, i);
    }
    add(&all, "bob", "e3", 0); /* refused */
    for (const struct lum_done_user *u = all; u; u = u->next) {
        cJSON *json = lum_done_to_json(u);
        assert_non_null(json);
        assert_int_equal(lum_done_read(&read, json), LUM_OK);
        assert_int_equal(lum_done_read(&read, json), LUM_ERR_INVALID); /* a user twice */
        cJSON_Delete(json);
    }
    assert_string_equal(read->user, "bob");
    assert_int_equal(rev_of(read, "bob", "e3"), 0);
    assert_int_equal(rev_of(read, "ann", "e2"), UINT64_MAX);
    assert_int_equal(rev_of(read, "ann", "e3"), 3);
    add(&read, "ann", "new", 999); /* in place of the oldest */
    assert_int_equal(rev_of(read, "ann", "e3"), UINT64_MAX);
    assert_int_equal(rev_of(read, "ann", "e4"), 4);
    lum_done_destroy(all);
    lum_done_destroy(read);
}

static void what_is_none_is_refused(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "7",
        "{}",
        "{\"user\":\"a\",\"op_ids\":[\"x\"],\"revs\":[]}",
        "{\"user\":\"a\",\"op_ids\":[\"x\"],\"revs\":[-1]}",
        "{\"user\":\"a\",\"op_ids\":[\"x\"],\"revs\":[1e300]}",
        "{\"user\":\"a\",\"op_ids\":[\"x\"],\"revs\":[\"1\"]}",
        "{\"user\":\"a\",\"op_ids\":[\"\"],\"revs\":[1]}",
        "{\"user\":\"a\",\"op_ids\":[5],\"revs\":[1]}",
        "{\"user\":\"a\",\"op_ids\":{\"x\":1},\"revs\":[1]}",
        "{\"user\":5,\"op_ids\":[],\"revs\":[]}",
    };
    struct lum_done_user *all = NULL;
    for (size_t i = 0; i < LUM_ARRAY_LEN(texts); i++) {
        cJSON *json = cJSON_Parse(texts[i]);
        assert_non_null(json);
        if (lum_done_read(&all, json) != LUM_ERR_INVALID)
            fail_msg("%s was taken", texts[i]);
        cJSON_Delete(json);
    }
    cJSON *json = cJSON_Parse("{\"user\":\"a\",\"op_ids\":[],\"revs\":[]}");
    for (unsigned i = 0; i <= LUM_LIMIT_REPEATS; i++) {
        cJSON_AddItemToArray(cJSON_GetObjectItem(json, "op_ids"), cJSON_CreateString("x"));
        cJSON_AddItemToArray(cJSON_GetObjectItem(json, "revs"), cJSON_CreateNumber(1));
    }
    assert_int_equal(lum_done_read(&all, json), LUM_ERR_INVALID);
    assert_null(all);
    cJSON_Delete(json);
}

static void short_memory_costs_nothing(void **state)
{
    (void)state;
    struct lum_done_user *all = NULL, *copy = NULL;
    add(&all, "ann", "e", 1);
    add(&all, "bob", "e", 2);
    cJSON *json = lum_done_to_json(all);
    bool failed = true;
    for (unsigned k = 1; failed; k++) {
        failing_alloc_arm(k);
        cJSON *text = lum_done_to_json(all);
        bool copied = lum_done_copy(all, &copy), reserved = lum_done_reserve(&all, "cid");
        failed = failing_alloc_disarm();
        assert_true(failed != (text && copied && reserved));
        assert_int_equal(rev_of(all, "ann", "e") + rev_of(all, "bob", "e"), 3);
        cJSON_Delete(text);
        lum_done_destroy(copy);
        lum_done_forget(&all, "cid");
    }
    struct lum_done_user *read = NULL;
    failing_alloc_arm(1);
    enum lum_status st = lum_done_read(&read, json);
    failing_alloc_disarm();
    assert_int_equal(st, LUM_ERR_NOMEM);
    assert_null(read);
    cJSON_Delete(json);
    lum_done_destroy(all);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_last_are_known),
        cmocka_unit_test(it_is_the_same_after_disk),
        cmocka_unit_test(what_is_none_is_refused),
        cmocka_unit_test(short_memory_costs_nothing),
    };
    failing_alloc_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
