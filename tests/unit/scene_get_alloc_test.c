/* scene.get where memory is short: each allocation fails in turn. Whoever waits is refused, or answered in full; and
 * who asks next, for the same text, is answered in full. No thread runs: the director is a struct alone. */
#define _GNU_SOURCE /* strdup */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
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

static void who_asks_next_is_answered_in_full(void **state)
{
    struct lum_proto_error err;
    struct lum_director d = {
        .config = {.wake_net = wake_nobody}, .outbox_tail = &d.outbox, .world = {.doc = lum_document_create()}};
    (void)state;
    pthread_mutex_init(&d.lock, NULL);
    assert_true(apply_text(d.world.doc, "ann",
                           "[{'op':'add','type':'light','id':'l','kind':'point','flux_lm':800},"
                           "{'op':'add','type':'material','id':'w'},{'op':'add','type':'mesh','id':'m','shape':'box'}]",
                           &err));
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
    assert_int_equal(lum_director_scene_gets_need(&d), LUM_NEED_NOTHING);
    free(whole);
    lum_document_destroy(d.world.doc);
    pthread_mutex_destroy(&d.lock);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(who_asks_next_is_answered_in_full),
    };
    failing_alloc_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
