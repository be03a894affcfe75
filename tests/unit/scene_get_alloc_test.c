/* scene.get where memory is short: each allocation fails in turn. Whoever waits is refused, or answered in full; and
 * who asks next, for the same text, is answered in full. And it holds no more than it needs. No thread runs: the
 * director is a struct alone. */
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

static void ask(struct lum_director *d)
{
    struct lum_proto_error err;
    struct lum_request *q = lum_request_create(&lum_request_scene_get);
    assert_non_null(q);
    q->rpc_id = strdup("1");
    assert_true(q->type->enqueue(d, q, &err));
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

static char *answer_of(struct lum_director *d)
{
    lum_director_write_scene(d, ALL_AT_ONCE);
    return take_said(d);
}

static void begin(struct lum_director *d)
{
    struct lum_proto_error err;
    *d = (struct lum_director){.config = {.wake_net = wake_nobody}, .world = {.doc = lum_document_create()}};
    d->outbox_tail = &d->outbox;
    pthread_mutex_init(&d->lock, NULL);
    assert_true(apply_text(d->world.doc, "ann",
                           "[{'op':'add','type':'light','id':'l','kind':'point','flux_lm':800},"
                           "{'op':'add','type':'material','id':'w'},{'op':'add','type':'mesh','id':'m','shape':'box'}]",
                           &err));
}

static void end(struct lum_director *d)
{
    assert_int_equal(lum_director_scene_gets_need(d), LUM_NEED_NOTHING);
    lum_document_destroy(d->world.doc);
    pthread_mutex_destroy(&d->lock);
}

static void who_asks_next_is_answered_in_full(void **state)
{
    struct lum_director d;
    (void)state;
    begin(&d);
    ask(&d);
    char *whole = answer_of(&d);
    assert_non_null(strstr(whole, "\"flux_lm\":800"));
    unsigned k = 1, n_refused = 0;
    for (bool failed = true; failed; k++) {
        ask(&d);
        ask(&d);
        failing_alloc_arm(k);
        lum_director_write_scene(&d, ALL_AT_ONCE);
        failed = failing_alloc_disarm();
        char *first = take_said(&d), *next = answer_of(&d); /* first may be NULL: no memory to say anything */
        if (first && strcmp(first, whole) != 0) {
            assert_non_null(strstr(first, "\"error\""));
            assert_true(failed);
            n_refused++;
        }
        if (!next || strcmp(next, whole) != 0)
            fail_msg("after allocation %u failed the next answer was %s", k, next ? next : "none");
        free(first);
        free(next);
    }
    assert_true(n_refused > 20);
    free(whole);
    end(&d);
}

/* Somebody always waits, and others edit: what the scene was long ago is not held for ever. */
static void what_was_is_let_go(void **state)
{
    struct lum_proto_error err;
    struct lum_director d;
    (void)state;
    begin(&d);
    struct lum_record *first = lum_record_ref((struct lum_record *)(uintptr_t)lum_document_find(d.world.doc, "l"));
    ask(&d);
    for (int i = 0; i < 100; i++) {
        char ops[96];
        ask(&d);
        free(answer_of(&d));
        snprintf(ops, sizeof ops, "[{'op':'set','id':'l','path':'/flux_lm','value':%d}]", i + 1);
        assert_true(apply_text(d.world.doc, "ann", ops, &err));
    }
    assert_int_equal(lum_director_scene_gets_need(&d), LUM_NEED_AWAITED);
    uint32_t held = first->refs;
    free(answer_of(&d));
    assert_int_equal(held, first->refs);
    lum_record_unref(first);
    end(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(who_asks_next_is_answered_in_full),
        cmocka_unit_test(what_was_is_let_go),
    };
    failing_alloc_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
