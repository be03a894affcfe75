/* The director and a disk that is slow or fails: pictures go on, nobody hears of an edit before it is on disk, and an
 * edit that cannot be saved is refused and taken back. */
#define _GNU_SOURCE /* strdup */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/director_client.h"
#include "tests/support/journal_keeper.h"

/* A disk whose syncs wait at a gate, or fail. */
struct gate {
    pthread_mutex_t lock;
    pthread_cond_t bell;
    bool closed, fails, arrived; /* guarded by lock; arrived: somebody waits at the closed gate */
    unsigned n_syncs;
};

static int gated_sync(void *user, int fd)
{
    struct gate *g = user;
    pthread_mutex_lock(&g->lock);
    while (g->closed) {
        g->arrived = true;
        pthread_cond_broadcast(&g->bell);
        pthread_cond_wait(&g->bell, &g->lock);
    }
    g->n_syncs++;
    bool fails = g->fails;
    pthread_mutex_unlock(&g->lock);
    if (!fails)
        return lum_disk_real.sync(NULL, fd);
    errno = ENOSPC;
    return -1;
}

static unsigned set_gate(struct gate *g, bool closed, bool fails)
{
    pthread_mutex_lock(&g->lock);
    g->closed = closed;
    g->fails = fails;
    g->arrived = false;
    unsigned n_syncs = g->n_syncs;
    pthread_cond_broadcast(&g->bell);
    pthread_mutex_unlock(&g->lock);
    return n_syncs;
}

static void wait_arrived(struct gate *g)
{
    pthread_mutex_lock(&g->lock);
    while (!g->arrived)
        pthread_cond_wait(&g->bell, &g->lock);
    pthread_mutex_unlock(&g->lock);
}

struct stage {
    struct keeper folder;
    struct gate gate;
    struct lum_disk disk;
    struct client *client;
};

static int setup(void **state)
{
    struct stage *s = calloc(1, sizeof *s);
    keeper_init(&s->folder);
    pthread_mutex_init(&s->gate.lock, NULL);
    pthread_cond_init(&s->gate.bell, NULL);
    s->disk = lum_disk_real;
    s->disk.sync = gated_sync;
    s->disk.user = &s->gate;
    *state = s;
    return client_setup_saved((void **)&s->client, s->folder.dir, &s->disk);
}

static int teardown(void **state)
{
    struct stage *s = *state;
    set_gate(&s->gate, false, false);
    client_teardown((void **)&s->client);
    pthread_cond_destroy(&s->gate.bell);
    pthread_mutex_destroy(&s->gate.lock);
    keeper_finish(&s->folder);
    free(s);
    return 0;
}

/* Where the first text that has this stands among all that was said; SIZE_MAX: nowhere. */
static size_t said(struct client *c, const char *what, size_t from)
{
    client_listen(c);
    for (size_t i = from; i < c->n_texts; i++)
        if (strstr(c->texts[i], what))
            return i;
    return SIZE_MAX;
}

static size_t wait_said(struct client *c, const char *what, size_t from)
{
    size_t i;
    while ((i = said(c, what, from)) == SIZE_MAX)
        client_wait(c);
    return i;
}

static void wait_frame(struct client *c, uint64_t rev)
{
    while (client_next_frame(c, NULL).scene_rev < rev)
        ;
}

static const char dim[] = "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":50}]";

static void pictures_go_on_and_words_wait(void **state)
{
    struct stage *s = *state;
    struct client *c = s->client;
    uint64_t rev = lum_director_scene_rev(c->director);
    client_open_view(c, LUM_CODEC_RGBA8);
    unsigned n_syncs = set_gate(&s->gate, true, false);
    size_t from = c->n_texts;
    char edit[32], get[32];
    assert_true(lum_director_post(c->director, client_edit(c, dim)));
    snprintf(edit, sizeof edit, "\"id\":%llu}", (unsigned long long)c->next_id);
    wait_arrived(&s->gate);
    wait_frame(c, rev + 1); /* the picture of the edit, while its sync hangs */
    for (int i = 0; i < 20; i++)
        assert_true(lum_director_post(c->director, client_edit(c, dim)));
    wait_frame(c, rev + 21);
    assert_true(lum_director_post(c->director, client_request(c, &lum_request_scene_get)));
    snprintf(get, sizeof get, "\"id\":%llu}", (unsigned long long)c->next_id);
    /* the director has answered it when it answers what comes after it: a frame of another edit */
    assert_true(lum_director_post(c->director, client_edit(c, dim)));
    wait_frame(c, rev + 22);
    assert_true(said(c, edit, from) == SIZE_MAX && said(c, "scene.changed", from) == SIZE_MAX &&
                said(c, get, from) == SIZE_MAX);
    set_gate(&s->gate, false, false);
    size_t at_get = wait_said(c, get, from), at_edit = said(c, edit, from), at_changed = said(c, "scene.changed", from);
    assert_true(at_edit < at_changed && at_changed < at_get); /* in the order in which they were made */
    scene_rev_of(client_ask(c, client_edit(c, dim)));
    /* one sync for the first edit, one for the 21 that came meanwhile, one for the last */
    assert_int_equal(set_gate(&s->gate, false, false) - n_syncs, 3);
}

/* While the disk hangs, what waits to be said is bounded: requests are turned away, news dropped. */
static void what_waits_is_bounded(void **state)
{
    struct stage *s = *state;
    struct client *c = s->client;
    struct lum_director *d = c->director;
    set_gate(&s->gate, true, false);
    assert_true(lum_director_post(d, client_edit(c, dim)));
    pthread_mutex_lock(&d->lock);
    d->outbox_bytes += LUM_OUTBOX_MAX_BYTES;
    pthread_mutex_unlock(&d->lock);
    size_t n_bytes;
    do { /* until the edit's own reply is there, and makes it too much */
        pthread_mutex_lock(&d->lock);
        n_bytes = d->outbox_bytes;
        pthread_mutex_unlock(&d->lock);
    } while (n_bytes <= LUM_OUTBOX_MAX_BYTES);
    struct lum_request *q = client_request(c, &lum_request_scene_get);
    assert_false(lum_director_post(d, q));
    lum_request_destroy(q);
    lum_director_send_news(d, c->session, strdup("news"));
    pthread_mutex_lock(&d->lock);
    d->outbox_bytes -= LUM_OUTBOX_MAX_BYTES;
    pthread_mutex_unlock(&d->lock);
    set_gate(&s->gate, false, false);
    scene_rev_of(client_ask(c, client_request(c, &lum_request_scene_get)));
    assert_true(said(c, "news", 0) == SIZE_MAX);
    pthread_mutex_lock(&d->lock);
    n_bytes = d->outbox_bytes;
    pthread_mutex_unlock(&d->lock);
    assert_int_equal(n_bytes, 0);
}

static void what_cannot_be_saved_is_taken_back(void **state)
{
    struct stage *s = *state;
    struct client *c = s->client;
    uint64_t rev = client_apply(c, dim);
    size_t from = c->n_texts;
    set_gate(&s->gate, false, true);
    static const char out[] = "[{\"op\":\"remove\",\"id\":\"lamp\"}]";
    cJSON *reply = client_ask(c, client_edit(c, out));
    assert_non_null(strstr(cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "error"), "message")->valuestring,
                           "could not be saved, and is taken back: cannot write journal-0: No space left on device"));
    assert_refused(reply, "io", NULL);
    /* who saw it sees it go: its change, and the change back, as the next revision */
    size_t at = wait_said(c, "scene.changed", from);
    assert_non_null(strstr(c->texts[at], "\"op\":\"remove\""));
    at = wait_said(c, "\"user\":\"(server)\"", at);
    char next[40];
    snprintf(next, sizeof next, "\"scene_rev\":%llu,", (unsigned long long)rev + 2);
    assert_non_null(strstr(c->texts[at], next));
    assert_non_null(strstr(c->texts[at], "\"op\":\"add\",\"type\":\"light\",\"id\":\"lamp\""));
    assert_int_equal(lum_director_scene_rev(c->director), rev + 2);
    assert_refused(client_ask(c, client_edit(c, dim)), "io", NULL);
    struct lum_director_metrics m;
    lum_director_metrics(c->director, &m);
    assert_true(m.journal.read_only && m.lights == 1);
    set_gate(&s->gate, false, false);
    do {
        lum_director_metrics(c->director, &m);
    } while (m.journal.read_only); /* it tries every second */
    /* undo goes on with what is left: the dimming */
    assert_int_equal(scene_rev_of(client_ask(c, client_request(c, &lum_request_scene_undo))), rev + 3);
    client_teardown((void **)&s->client);
    client_setup_saved((void **)&s->client, s->folder.dir, NULL);
    assert_int_equal(lum_director_scene_rev(s->client->director), rev + 3);
    assert_int_equal(scene_rev_of(client_ask(s->client, client_request(s->client, &lum_request_scene_redo))), rev + 4);
}

static struct lum_request *again(struct client *c, const char *ops, bool repeat)
{
    struct lum_request *q = client_edit(c, ops);
    strcpy(q->op_id, "e1");
    q->repeat = repeat;
    return q;
}

static struct lum_request *name(struct client *c, uint64_t rev, const char *text)
{
    struct lum_request *q = client_request(c, &lum_request_timeline_name);
    q->rev = rev;
    strcpy(q->name, text);
    return q;
}

static void assert_named(struct client *c, uint64_t rev, const char *text, const char *by)
{
    cJSON *reply = client_ask(c, client_request(c, &lum_request_timeline_get));
    const cJSON *m, *found = NULL;
    cJSON_ArrayForEach(m, cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "result"), "moments")) found =
        cJSON_GetObjectItem(m, "scene_rev")->valuedouble == (double)rev ? m : found;
    assert_non_null(found);
    assert_string_equal(cJSON_GetStringValue(cJSON_GetObjectItem(found, "name")), text);
    assert_string_equal(cJSON_GetStringValue(cJSON_GetObjectItem(found, "named_by")), by);
    cJSON_Delete(reply);
}

/* Of two names and edits nothing is left when they are lost: the name of before is there again, and is
 * told. A revision that was taken back stands for the moment before it, and its name is told of that. */
static void a_name_that_cannot_be_saved_is_taken_back(void **state)
{
    struct stage *s = *state;
    struct client *c = s->client;
    struct lum_director_metrics m;
    uint64_t rev = client_apply(c, dim);
    cJSON_Delete(client_ask(c, name(c, rev, "one")));
    assert_int_not_equal(wait_said(c, "\"name\":\"one\"", 0), SIZE_MAX);
    size_t from = c->n_texts;
    set_gate(&s->gate, true, false);
    assert_true(lum_director_post(c->director, name(c, rev, "two")));
    uint64_t first = c->next_id;
    wait_arrived(&s->gate);
    assert_true(lum_director_post(c->director, client_edit(c, dim)));
    uint64_t edit = c->next_id;
    assert_true(lum_director_post(c->director, name(c, rev, "three")));
    uint64_t last = c->next_id;
    assert_true(lum_director_post(c->director, client_edit(c, dim)));
    while (lum_director_scene_rev(c->director) < rev + 2)
        (void)0; /* all of them wait for the disk */
    assert_true(said(c, "timeline.named", from) == SIZE_MAX);
    set_gate(&s->gate, false, true);
    assert_refused(client_reply(c, first), "io", NULL);
    assert_refused(client_reply(c, edit), "io", NULL);
    assert_refused(client_reply(c, last), "io", NULL);
    char back[120];
    snprintf(back, sizeof back, "{\"scene_rev\":%llu,\"name\":\"one\",\"user\":\"(server)\"}", (unsigned long long)rev);
    wait_said(c, back, from);
    assert_named(c, rev, "one", "tester");
    assert_int_equal(lum_director_scene_rev(c->director), rev + 4);
    set_gate(&s->gate, false, false);
    do {
        lum_director_metrics(c->director, &m);
    } while (m.journal.read_only); /* it tries every second */
    from = c->n_texts;
    cJSON_Delete(client_ask(c, name(c, rev + 4, "four")));
    snprintf(back, sizeof back, "{\"scene_rev\":%llu,\"name\":\"four\"", (unsigned long long)rev);
    wait_said(c, back, from);
    client_teardown((void **)&s->client);
    client_setup_saved((void **)&s->client, s->folder.dir, NULL);
    assert_named(s->client, rev, "four", "tester");
}

/* Who asks again whether an edit was done is answered when it is safe, and not before. */
static void an_edit_that_waits_for_the_disk_is_known(void **state)
{
    struct stage *s = *state;
    struct client *c = s->client;
    uint64_t rev = lum_director_scene_rev(c->director);
    set_gate(&s->gate, true, false);
    struct lum_request *first = again(c, dim, false), *second = again(c, dim, true);
    assert_true(lum_director_post(c->director, first));
    wait_arrived(&s->gate);
    uint64_t id = c->next_id;
    assert_true(lum_director_post(c->director, second));
    assert_int_equal(said(c, "\"repeated\":true", 0), SIZE_MAX);
    set_gate(&s->gate, false, false);
    assert_int_equal(scene_rev_of(client_reply(c, id)), rev + 1);
    assert_int_not_equal(wait_said(c, "\"repeated\":true", 0), SIZE_MAX);
    assert_int_equal(lum_director_scene_rev(c->director), rev + 1);
}

/* One that was taken back was not done. */
static void an_edit_that_was_lost_is_done_when_it_is_sent_again(void **state)
{
    struct stage *s = *state;
    struct client *c = s->client;
    uint64_t rev = lum_director_scene_rev(c->director);
    set_gate(&s->gate, false, true);
    assert_refused(client_ask(c, again(c, dim, false)), "io", NULL);
    set_gate(&s->gate, false, false);
    struct lum_director_metrics m;
    do {
        lum_director_metrics(c->director, &m);
    } while (m.journal.read_only); /* it tries every second */
    assert_int_equal(scene_rev_of(client_ask(c, again(c, dim, true))), rev + 3);
    assert_int_equal(said(c, "\"repeated\":true", 0), SIZE_MAX);
    assert_int_equal(scene_rev_of(client_ask(c, again(c, dim, true))), rev + 3); /* by now it was */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(pictures_go_on_and_words_wait, setup, teardown),
        cmocka_unit_test_setup_teardown(what_waits_is_bounded, setup, teardown),
        cmocka_unit_test_setup_teardown(what_cannot_be_saved_is_taken_back, setup, teardown),
        cmocka_unit_test_setup_teardown(a_name_that_cannot_be_saved_is_taken_back, setup, teardown),
        cmocka_unit_test_setup_teardown(an_edit_that_waits_for_the_disk_is_known, setup, teardown),
        cmocka_unit_test_setup_teardown(an_edit_that_was_lost_is_done_when_it_is_sent_again, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
