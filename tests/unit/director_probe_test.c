/* Probes over the protocol: in the order asked for, beside the frames, and no burden to others. What has to happen at a
 * certain moment happens on the director's thread, just after the first answer. */
#include <string.h>

#include "tests/support/director_client.h"

enum { BURST = 32, SAMPLES = 65536 };

static const struct lum_session_ref other = {5, 1};

static struct lum_request *probe_by(struct client *c, struct lum_session_ref session, uint32_t n_samples)
{
    struct lum_request *q = client_request(c, &lum_request_probe);
    q->session = session;
    q->has_point = true;
    q->point[1] = 0.5;
    q->normal[1] = 1.0;
    q->samples = n_samples;
    return q;
}

static void post_many(struct client *c, uint32_t n, uint32_t n_samples, void (*then)(struct client *c))
{
    client_hold(c);
    for (uint32_t i = 0; i < n; i++)
        assert_true(lum_director_post(c->director, probe_by(c, c->session, n_samples)));
    client_release(c, then);
}

static void post_burst(struct client *c, void (*then)(struct client *c))
{
    post_many(c, BURST, SAMPLES, then);
}

static bool is_answer(const char *text, uint64_t *ret_id)
{
    cJSON *json = cJSON_Parse(text);
    const cJSON *id = cJSON_GetObjectItem(json, "id"), *result = cJSON_GetObjectItem(json, "result");
    bool is = result && cJSON_GetObjectItem(result, "illuminance_lx");
    *ret_id = is ? (uint64_t)id->valuedouble : 0;
    cJSON_Delete(json);
    return is;
}

static size_t n_answers(const struct client *c)
{
    size_t n = 0;
    uint64_t id;
    for (size_t i = 0; i < c->n_texts; i++)
        n += is_answer(c->texts[i], &id);
    return n;
}

static void wait_for_answers(struct client *c, size_t n)
{
    for (client_listen(c); n_answers(c) < n; client_listen(c))
        client_wait(c);
}

static void answers_come_in_order(void **state)
{
    struct client *c = *state;
    uint64_t first = c->next_id + 1, want = first, id;
    for (uint32_t i = 0; i < 8; i++)
        assert_true(lum_director_post(c->director, probe_by(c, c->session, i % 2 ? 64 : 4096)));
    wait_for_answers(c, 8);
    for (size_t i = 0; i < c->n_texts; i++)
        if (is_answer(c->texts[i], &id))
            assert_int_equal(id, want++);
    assert_int_equal(want, first + 8);
}

static void edit_now(struct client *c)
{
    struct lum_request *q = client_edit(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":7}]");
    q->session = other;
    assert_true(lum_director_post(c->director, q));
}

/* Place of the first message about a frame of this revision or a later one. */
static size_t place_of_frame(const struct client *c, uint64_t rev)
{
    for (size_t i = 0; i < c->n_texts; i++) {
        cJSON *json = cJSON_Parse(c->texts[i]);
        const cJSON *method = cJSON_GetObjectItem(json, "method"),
                    *at = cJSON_GetObjectItem(cJSON_GetObjectItem(json, "params"), "scene_rev");
        bool is = method && strcmp(method->valuestring, "frame.stats") == 0 && at && at->valuedouble >= (double)rev;
        cJSON_Delete(json);
        if (is)
            return i;
    }
    return c->n_texts;
}

static size_t place_of_last_answer(const struct client *c)
{
    size_t place = 0;
    uint64_t id;
    for (size_t i = 0; i < c->n_texts; i++)
        if (is_answer(c->texts[i], &id))
            place = i;
    return place;
}

/* Another's edit, made while a burst waits, is on her screen before the burst is over. */
static void an_edit_shows_during_a_burst(void **state)
{
    struct client *c = *state;
    struct lum_request *open = client_request(c, &lum_request_view_open);
    open->session = other;
    open->view = (struct lum_view_params){.given = LUM_VIEW_BIT(SIZE) | LUM_VIEW_BIT(STATS), .size = {W, H}};
    open->view.stats = true;
    cJSON_Delete(client_ask(c, open));
    client_converged_frame(c, 0, NULL);
    uint64_t rev = lum_director_scene_rev(c->director) + 1;
    post_burst(c, edit_now);
    wait_for_answers(c, BURST);
    size_t frame = place_of_frame(c, rev);
    assert_true(frame < place_of_last_answer(c));
}

static void leave_now(struct client *c)
{
    struct lum_request *q = lum_request_create(&lum_request_session_closed);
    q->session = c->session;
    assert_true(lum_director_post(c->director, q));
    assert_true(lum_director_post(c->director, probe_by(c, other, 2 * SAMPLES)));
}

/* The other's probe takes as long as two of the burst, in turn with them if there were any. */
static void who_leaves_takes_her_probes_along(void **state)
{
    struct client *c = *state;
    post_burst(c, leave_now);
    wait_for_answers(c, 2);
    for (uint64_t id, n = 0; n < c->n_texts; n++)
        assert_true(!is_answer(c->texts[n], &id) || id == c->next_id || id == c->next_id - BURST);
    assert_int_equal(n_answers(c), 2);
}

static void stop_now(struct client *c)
{
    pthread_mutex_lock(&c->director->lock);
    c->director->stop = true;
    pthread_mutex_unlock(&c->director->lock);
}

static void the_end_waits_for_no_probe(void **state)
{
    struct client *c = *state;
    post_burst(c, stop_now);
    pthread_join(c->director->thread, NULL);
    c->director->has_thread = false;
    client_listen(c);
    assert_int_equal(n_answers(c), 1);
}

static int64_t ticks[BURST]; /* written by the director's thread, read when it has said all */
static uint32_t n_ticks;

static void note_tick(struct client *c)
{
    c->on_said = note_tick;
    ticks[n_ticks++ % BURST] = atomic_load(&c->director->tick_ns);
}

/* Who asks whether the director is alive looks at its ticks. */
static void the_director_ticks_between_probes(void **state)
{
    struct client *c = *state;
    n_ticks = 0;
    post_burst(c, note_tick);
    wait_for_answers(c, BURST);
    assert_int_equal(n_ticks, BURST);
    for (uint32_t i = 1; i < BURST; i++)
        assert_true(ticks[i] > ticks[i - 1]);
}

/* One more than may wait: refused at once, and the others are answered. */
static void waiting_probes_are_limited(void **state)
{
    struct client *c = *state;
    post_many(c, LUM_LIMIT_PROBES_WAITING + 1, 64, NULL);
    wait_for_answers(c, LUM_LIMIT_PROBES_WAITING);
    assert_refused(client_reply(c, c->next_id), "busy", NULL);
    cJSON *reply = client_ask(c, probe_by(c, c->session, 64));
    assert_non_null(cJSON_GetObjectItem(reply, "result"));
    cJSON_Delete(reply);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(answers_come_in_order, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(an_edit_shows_during_a_burst, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(who_leaves_takes_her_probes_along, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(the_end_waits_for_no_probe, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(the_director_ticks_between_probes, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(waiting_probes_are_limited, client_setup, client_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
