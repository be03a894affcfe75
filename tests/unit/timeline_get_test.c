/* timeline.get: what is kept of earlier answers says the same as what is made anew, and where memory is short (each
 * allocation fails in turn) whoever asks is refused, or answered in full. No thread runs: the director is a struct
 * alone. */
#define _GNU_SOURCE /* strdup */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "server/director/internal.h"
#include "tests/unit/failing_alloc.h"
#include "tests/unit/protocol_util.h"

#define ALL_AT_ONCE 1e18 /* ns of a slice */

static void wake_nobody(void *user)
{
    (void)user;
}

static void begin(struct lum_director *d)
{
    struct lum_proto_error err;
    *d = (struct lum_director){.config = {.wake_net = wake_nobody}, .world = {.doc = lum_document_create()}};
    d->outbox_tail = &d->outbox;
    pthread_mutex_init(&d->lock, NULL);
    assert_true(apply_text(d->world.doc, "ann",
                           "[{'op':'add','type':'light','id':'l','kind':'point','flux_lm':800},"
                           "{'op':'add','type':'material','id':'w'}]",
                           &err));
    lum_document_begin_past(d->world.doc);
}

static void end(struct lum_director *d)
{
    lum_director_drop_all_timeline_gets(d);
    assert_int_equal(lum_director_timeline_gets_need(d), LUM_NEED_NOTHING);
    lum_document_destroy(d->world.doc);
    pthread_mutex_destroy(&d->lock);
}

static struct lum_request *request(uint64_t since_rev, uint32_t slot)
{
    struct lum_request *q = lum_request_create(&lum_request_timeline_get);
    assert_non_null(q);
    q->rpc_id = strdup("1");
    q->rev = since_rev;
    q->session.slot = slot;
    return q;
}

static void ask(struct lum_director *d, uint64_t since_rev)
{
    struct lum_proto_error err;
    assert_true(lum_request_timeline_get.enqueue(d, request(since_rev, 0), &err));
}

/* What was said; the caller frees it. NULL: nothing. */
static char *take_said(struct lum_director *d)
{
    struct lum_out *o = d->outbox;
    if (!o)
        return NULL;
    char *text = o->text;
    o->text = NULL;
    assert_null(o->next);
    lum_out_destroy(o);
    d->outbox = NULL;
    d->outbox_tail = &d->outbox;
    return text;
}

static char *answer_of(struct lum_director *d, uint64_t since_rev)
{
    ask(d, since_rev);
    lum_director_write_timeline(d, ALL_AT_ONCE);
    char *text = take_said(d);
    assert_non_null(text);
    return text;
}

/* By the same document, of one who has told nothing yet. */
static char *answer_anew(struct lum_director *d, uint64_t since_rev)
{
    struct lum_director_timeline_gets kept = d->timeline_gets;
    d->timeline_gets = (struct lum_director_timeline_gets){0};
    char *text = answer_of(d, since_rev);
    lum_director_drop_all_timeline_gets(d);
    d->timeline_gets = kept;
    return text;
}

/* An edit; some are steps of a drag, which become one moment. taken_back: it is as if it had not been. */
static void edit_so(struct lum_director *d, uint32_t number, bool taken_back)
{
    char text[120];
    snprintf(text, sizeof text, "[{'op':'set','id':'%s','path':'/%s','value':%u}]", number % 3 ? "l" : "w",
             number % 3 ? "flux_lm" : "roughness", number % 3 ? number : number % 2);
    struct cJSON *json = json_of(text);
    struct lum_ops ops;
    struct lum_changes changes;
    struct lum_proto_error err;
    assert_true(lum_ops_from_json(json, &ops, &err));
    snprintf(ops.undo_group, sizeof ops.undo_group, "%s", number % 20 < 8 ? "drag" : "");
    assert_true(lum_document_apply(d->world.doc, number % 5 ? "ann" : "bob", &ops, NULL, 0, &changes, &err));
    if (taken_back)
        lum_document_rollback(d->world.doc, &changes);
    lum_changes_finish(&changes);
    lum_ops_finish(&ops);
    cJSON_Delete(json);
}

static void edit(struct lum_director *d, uint32_t number)
{
    edit_so(d, number, false);
}

static void undo(struct lum_director *d, bool redo)
{
    struct lum_proto_error err;
    struct lum_changes changes;
    bool ok = redo ? lum_document_redo(d->world.doc, "ann", &changes, &err)
                   : lum_document_undo(d->world.doc, "ann", &changes, &err);
    if (ok)
        lum_changes_finish(&changes);
}

static void name_one(struct lum_director *d, uint32_t number)
{
    struct lum_proto_error err;
    size_t n = lum_document_n_moments(d->world.doc);
    const struct lum_moment *m = lum_document_moment(d->world.doc, number * 7 % n);
    char name[20];
    snprintf(name, sizeof name, "%.*s%u", number % 4 ? 1 : 0, "n", number);
    assert_true(lum_document_name_moment(d->world.doc, "bob", m->rev, number % 4 ? name : "", NULL, &err));
}

static void what_was_told_says_what_is_true(void **state)
{
    struct lum_director d;
    (void)state;
    begin(&d);
    for (uint32_t i = 1; i <= 400; i++) {
        lum_document_set_time(d.world.doc, 1000 + i / 10);
        if (i % 11 == 0)
            undo(&d, i % 2);
        else if (i % 7 == 0)
            name_one(&d, i);
        else if (i % 13 == 0)
            edit_so(&d, i, true);
        else if (i % 90 == 0)
            lum_document_thin_past(d.world.doc);
        else
            edit(&d, i);
        uint64_t since_rev = i % 3 ? 0 : lum_document_rev(d.world.doc) / 2;
        char *told = answer_of(&d, since_rev), *anew = answer_anew(&d, since_rev);
        if (strcmp(told, anew) != 0)
            fail_msg("after step %u: %s\nanew: %s", i, told, anew);
        free(told);
        free(anew);
    }
    end(&d);
}

/* What is as it was is not written again: an edit costs the moments that it makes another of. */
static void a_moment_is_written_once(void **state)
{
    struct lum_director d;
    (void)state;
    begin(&d);
    for (uint32_t i = 1; i <= 50; i++)
        edit(&d, i);
    free(answer_of(&d, 0));
    size_t n = d.timeline_gets.n;
    assert_true(n > 20);
    char *texts[60] = {0};
    assert_true(n < LUM_ARRAY_LEN(texts));
    for (size_t i = 0; i < n; i++)
        texts[i] = d.timeline_gets.moments[i].text;
    edit(&d, 51); /* no step of a drag */
    free(answer_of(&d, 0));
    assert_int_equal(d.timeline_gets.n, n + 1);
    for (size_t i = 0; i < n; i++)
        assert_ptr_equal(d.timeline_gets.moments[i].text, texts[i]);
    end(&d);
}

static void without_memory_it_says_so(void **state)
{
    struct lum_director d;
    (void)state;
    begin(&d);
    for (uint32_t i = 1; i <= 6; i++)
        edit(&d, i);
    name_one(&d, 1);
    char *whole = answer_anew(&d, 0);
    unsigned k = 1, n_refused = 0;
    for (bool failed = true; failed; k++) {
        lum_director_drop_all_timeline_gets(&d); /* all is written anew */
        ask(&d, 0);
        failing_alloc_arm(k);
        lum_director_write_timeline(&d, ALL_AT_ONCE);
        failed = failing_alloc_disarm();
        char *first = take_said(&d), *next = answer_of(&d, 0); /* first may be NULL: no memory to say anything */
        if (first && strcmp(first, whole) != 0) {
            if (!strstr(first, "\"error\""))
                fail_msg("after allocation %u failed the answer was %s", k, first);
            n_refused++;
        }
        assert_string_equal(next, whole);
        free(first);
        free(next);
    }
    assert_true(n_refused > 20);
    free(whole);
    end(&d);
}

/* No slice, however short, ends where nothing goes on. */
static void it_is_written_in_slices(void **state)
{
    struct lum_director d;
    (void)state;
    begin(&d);
    for (uint32_t i = 1; i <= 50; i++)
        edit(&d, i);
    char *whole = answer_anew(&d, 0), *said = NULL;
    ask(&d, 0);
    for (int n = 0; n < 1000000 && !said; n++) {
        lum_director_write_timeline(&d, 1.0);
        said = take_said(&d);
    }
    assert_non_null(said);
    assert_string_equal(said, whole);
    free(said);
    free(whole);
    end(&d);
}

static void waiting_ones_are_limited_and_dropped(void **state)
{
    struct lum_director d;
    struct lum_proto_error err;
    (void)state;
    begin(&d);
    for (uint32_t i = 0; i < LUM_LIMIT_TIMELINE_GETS_WAITING; i++)
        ask(&d, 0);
    struct lum_request *more = request(0, 0);
    assert_false(lum_request_timeline_get.enqueue(&d, more, &err));
    assert_string_equal(err.app, "busy");
    lum_request_destroy(more);
    assert_true(lum_request_timeline_get.enqueue(&d, request(0, 1), &err));
    lum_director_drop_timeline_gets(&d, (struct lum_session_ref){0});
    lum_director_write_timeline(&d, ALL_AT_ONCE);
    char *said = take_said(&d);
    assert_non_null(said);
    free(said);
    assert_int_equal(lum_director_timeline_gets_need(&d), LUM_NEED_NOTHING);
    end(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_was_told_says_what_is_true),
        cmocka_unit_test(a_moment_is_written_once),
        cmocka_unit_test(without_memory_it_says_so),
        cmocka_unit_test(it_is_written_in_slices),
        cmocka_unit_test(waiting_ones_are_limited_and_dropped),
    };
    failing_alloc_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
