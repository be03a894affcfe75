/* The director: views get frames, edits show, are undone and refused; limits. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/director_client.h"

static void a_view_gets_frames_until_it_converged(void **state)
{
    struct client *c = *state;
    uint32_t id = client_open_view(c, LUM_CODEC_JPEG);
    uint64_t seq = 0;
    uint16_t spp = 0;
    struct lum_frame_header h;
    do {
        h = client_next_frame(c, NULL);
        assert_int_equal(h.view_id, id);
        assert_int_equal(h.full_w, W);
        assert_int_equal(h.full_h, H);
        assert_true(h.frame_seq > seq && h.spp >= spp);
        assert_int_equal(h.scene_rev, lum_director_scene_rev(c->director));
        seq = h.frame_seq;
        spp = h.spp;
    } while (!(h.flags & LUM_FRAME_CONVERGED));
    assert_int_equal(h.spp, 16);
    assert_true(h.flags & LUM_FRAME_LOSSLESS);
    assert_int_equal(h.codec, LUM_CODEC_PNG);
}

static long sum_of_converged(struct client *c, uint64_t scene_rev)
{
    uint8_t pixels[W * H * 4];
    long sum = 0;
    client_converged_frame(c, scene_rev, pixels);
    for (size_t i = 0; i < sizeof pixels; i++)
        sum += pixels[i];
    return sum;
}

static void an_edit_shows_under_its_revision(void **state)
{
    struct client *c = *state;
    client_open_view(c, LUM_CODEC_RGBA8);
    uint64_t before = lum_director_scene_rev(c->director);
    long bright = sum_of_converged(c, before);
    uint64_t rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":10}]");
    assert_int_equal(rev, before + 1);
    assert_int_equal(lum_director_scene_rev(c->director), rev);
    assert_true(sum_of_converged(c, rev) < bright);
}

/* Automatic exposure follows the camera, not the lamps: dimming must show. */
static void a_dimmed_lamp_is_darker_under_automatic_exposure(void **state)
{
    struct client *c = *state;
    uint64_t rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"render\",\"path\":\"/exposure_ev\",\"value\":null}]");
    client_open_view(c, LUM_CODEC_RGBA8);
    long bright = sum_of_converged(c, rev);
    rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":10}]");
    assert_true(sum_of_converged(c, rev) < bright);
}

static long sum_of_next(struct client *c, uint64_t scene_rev)
{
    static uint8_t pixels[W * H * 4];
    long sum = 0;
    struct lum_frame_header h;
    do
        h = client_next_frame(c, pixels);
    while (h.scene_rev != scene_rev || h.spp == 0);
    for (size_t i = 0; i < sizeof pixels; i++)
        sum += pixels[i];
    return sum;
}

/* So it does in a picture that did not rest at all. */
static void exposure_is_kept_from_the_first_frame_on(void **state)
{
    struct client *c = *state;
    uint64_t rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"render\",\"path\":\"/exposure_ev\",\"value\":null},"
                                   "{\"op\":\"set\",\"id\":\"render\",\"path\":\"/spp\",\"value\":0},"
                                   "{\"op\":\"set\",\"id\":\"render\",\"path\":\"/method\",\"value\":\"live\"}]");
    client_open_view(c, LUM_CODEC_RGBA8);
    long bright = sum_of_next(c, rev);
    rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":10}]");
    assert_true(sum_of_next(c, rev) < bright);
}

static void everybody_hears_of_an_edit(void **state)
{
    struct client *c = *state;
    struct lum_request *request = client_edit(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/on\",\"value\":false}]");
    strcpy(request->op_id, "op-1");
    scene_rev_of(client_ask(c, request));
    for (;;) {
        client_listen(c);
        for (size_t i = 0; i < c->n_texts; i++) {
            cJSON *json = cJSON_Parse(c->texts[i]);
            const cJSON *method = cJSON_GetObjectItem(json, "method"), *params = cJSON_GetObjectItem(json, "params");
            if (method && strcmp(method->valuestring, "scene.changed") == 0) {
                assert_string_equal(cJSON_GetObjectItem(params, "op_id")->valuestring, "op-1");
                assert_string_equal(cJSON_GetObjectItem(params, "user")->valuestring, "tester");
                assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(params, "ops")), 1);
                cJSON_Delete(json);
                return;
            }
            cJSON_Delete(json);
        }
        client_wait(c);
    }
}

static void undo_and_redo_bring_the_picture_back(void **state)
{
    struct client *c = *state;
    static uint8_t first[W * H * 4], moved[W * H * 4], undone[W * H * 4], redone[W * H * 4];
    static const char *const edits[] = {
        "[{\"op\":\"set\",\"id\":\"floor\",\"path\":\"/transform/translate\",\"value\":[0,0.5,0]}]",
        /* in a box: through fog everywhere each path goes on for all of its segments */
        "[{\"op\":\"add\",\"type\":\"medium\",\"id\":\"fog\",\"sigma_s\":[0.1,0.2,0.3],"
        "\"box\":{\"min\":[-1,0,-1],\"max\":[1,1,1]}}]",
        "[{\"op\":\"set\",\"id\":\"fog\",\"path\":\"/g\",\"value\":0.9}]",
        "[{\"op\":\"remove\",\"id\":\"fog\"}]",
    };
    client_open_view(c, LUM_CODEC_RGBA8);
    client_converged_frame(c, 0, first);
    for (size_t i = 0; i < sizeof edits / sizeof *edits; i++) {
        uint64_t rev = scene_rev_of(client_ask(c, client_edit(c, edits[i])));
        memcpy(moved, first, sizeof moved); /* tiles that do not change are not sent */
        client_converged_frame(c, rev, moved);
        assert_memory_not_equal(first, moved, sizeof first);
        memcpy(undone, moved, sizeof undone);
        client_converged_frame(c, scene_rev_of(client_ask(c, client_request(c, &lum_request_scene_undo))), undone);
        assert_memory_equal(first, undone, sizeof first);
        memcpy(redone, undone, sizeof redone);
        client_converged_frame(c, scene_rev_of(client_ask(c, client_request(c, &lum_request_scene_redo))), redone);
        assert_memory_equal(moved, redone, sizeof moved);
        assert_refused(client_ask(c, client_request(c, &lum_request_scene_redo)), "not_found", NULL);
        memcpy(first, moved, sizeof first);
    }
}

static char *scene_text_of(struct client *c)
{
    cJSON *reply = client_ask(c, client_request(c, &lum_request_scene_get));
    char *text = cJSON_PrintUnformatted(cJSON_GetObjectItem(reply, "result"));
    cJSON_Delete(reply);
    assert_non_null(text);
    return text;
}

/* The second op of each is refused: by the document (no such id), and by the renderer (no such method). */
static void edits_are_all_or_nothing(void **state)
{
    struct client *c = *state;
    char *before = scene_text_of(c);
    assert_refused(
        client_ask(c, client_edit(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":7},"
                                     "{\"op\":\"remove\",\"id\":\"nobody\"}]")),
        "not_found", NULL);
    assert_refused(
        client_ask(c, client_edit(c, "[{\"op\":\"remove\",\"id\":\"floor\"},"
                                     "{\"op\":\"set\",\"id\":\"render\",\"path\":\"/method\",\"value\":\"magic\"}]")),
        "unsupported", "ops/1/method");
    char *after = scene_text_of(c);
    assert_string_equal(before, after);
    free(before);
    free(after);
    /* and the renderer still has the floor: a view shows it */
    uint32_t id = client_open_view(c, LUM_CODEC_JPEG);
    struct lum_request *pick = client_request(c, &lum_request_pick);
    pick->view_id = id;
    pick->x = W / 2;
    pick->y = H / 2;
    cJSON *reply = client_ask(c, pick);
    const cJSON *result = cJSON_GetObjectItem(reply, "result");
    assert_string_equal(cJSON_GetObjectItem(result, "id")->valuestring, "floor");
    cJSON_Delete(reply);
}

static void a_stale_base_revision_is_refused(void **state)
{
    struct client *c = *state;
    struct lum_request *request = client_edit(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/on\",\"value\":false}]");
    request->has_base_rev = true;
    request->base_rev = lum_director_scene_rev(c->director) + 1;
    assert_refused(client_ask(c, request), "rev_conflict", "base_rev");
}

static void the_inbox_is_limited_in_bytes(void **state)
{
    struct client *c = *state;
    struct lum_request *request = client_request(c, &lum_request_scene_get);
    request->n_bytes = LUM_REQUESTS_MAX_BYTES + 1;
    assert_false(lum_director_post(c->director, request));
    request->n_bytes = LUM_REQUESTS_MAX_BYTES;
    cJSON_Delete(client_ask(c, request));
}

/* A message is small beside what it is read to, and that is what waits. */
static void the_inbox_is_charged_for_what_was_read(void **state)
{
    enum { N_VALUES = 200000, VALUE_BYTES = sizeof(cJSON) };
    struct client *c = *state;
    char *ops = malloc(100 + 2 * N_VALUES), *at = ops;
    assert_non_null(ops);
    at += sprintf(at, "[{\"op\":\"set\",\"id\":\"plane\",\"path\":\"/positions\",\"value\":[");
    for (int i = 0; i < N_VALUES; i++)
        at += sprintf(at, "%s", i ? ",0" : "0");
    strcpy(at, "]}]");
    client_hold(c);
    uint64_t first = c->next_id + 1, n = 0;
    struct lum_request *q = client_edit(c, ops);
    q->n_bytes = strlen(ops);
    for (; lum_director_post(c->director, q); n++) {
        assert_true((n + 1) * N_VALUES * VALUE_BYTES <= LUM_REQUESTS_MAX_BYTES);
        q = client_edit(c, ops);
        q->n_bytes = strlen(ops);
    }
    assert_true(n > 4);
    lum_request_destroy(q);
    client_release(c, NULL);
    for (uint64_t i = 0; i < n; i++)
        assert_refused(client_reply(c, first + i), "invalid_value", "ops/0/shape");
    /* all of it is given back, if not before the last reply then before the next: */
    cJSON_Delete(client_ask(c, client_request(c, &lum_request_stats_get)));
    q = client_request(c, &lum_request_stats_get);
    q->n_bytes = LUM_REQUESTS_MAX_BYTES / 16 * 15;
    cJSON_Delete(client_ask(c, q));
    free(ops);
}

/* As many values as a message may have, all in the value of a set, of which a copy is made, and the text for the
 * journal. */
static void the_costliest_message_is_admitted_alone(void **state)
{
    enum { N_VALUES = LUM_LIMIT_JSON_TOKENS - 20 };
    struct client *c = *state;
    char *ops = malloc(LUM_LIMIT_MESSAGE_BYTES), *at = ops;
    assert_non_null(ops);
    at += sprintf(at, "[{\"op\":\"set\",\"id\":\"plane\",\"path\":\"/positions\",\"value\":[");
    for (int i = 0; i < N_VALUES; i++) /* as long as fits */
        at += sprintf(at, "%s", i == 0 ? "0" : i % 5 ? ",\"abc\"" : ",\"abcdef\"");
    strcpy(at, "]}]");
    assert_true(strlen(ops) > LUM_LIMIT_MESSAGE_BYTES / 16 * 15 && strlen(ops) < LUM_LIMIT_MESSAGE_BYTES - 100);
    struct lum_request *q = client_edit(c, ops);
    q->n_bytes = strlen(ops);
    q->ops_json = cJSON_Parse(ops);
    assert_refused(client_ask(c, q), "invalid_value", "ops/0/positions/1");
    free(ops);
}

/* Names of users are not used again: what only they could undo would be kept for nobody. */
static void a_session_takes_its_history_along(void **state)
{
    struct client *c = *state;
    scene_rev_of(client_ask(c, client_edit(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/on\",\"value\":false}]")));
    struct lum_request *gone = client_request(c, &lum_request_session_closed);
    assert_true(lum_director_post(c->director, gone));
    assert_refused(client_ask(c, client_request(c, &lum_request_scene_undo)), "not_found", NULL);
}

static void a_session_takes_its_views_along(void **state)
{
    struct client *c = *state;
    client_open_view(c, LUM_CODEC_JPEG);
    client_open_view(c, LUM_CODEC_JPEG);
    struct lum_request *request = lum_request_create(&lum_request_session_closed);
    request->session = c->session;
    assert_true(lum_director_post(c->director, request));
    cJSON *reply = client_ask(c, client_request(c, &lum_request_stats_get));
    const cJSON *result = cJSON_GetObjectItem(reply, "result");
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(result, "views")), 0);
    assert_int_equal(cJSON_GetObjectItem(cJSON_GetObjectItem(result, "scene"), "light")->valueint, 1);
    cJSON_Delete(reply);
}

/* The second time it asks, somebody stops it. */
static struct {
    struct lum_director *director;
    struct lum_go_on was;
    int asked;
} stopper;

static bool stop_at_second(void *user)
{
    (void)user;
    if (++stopper.asked == 2) {
        pthread_mutex_lock(&stopper.director->lock);
        stopper.director->stop = true;
        pthread_mutex_unlock(&stopper.director->lock);
    }
    return stopper.was.ask(stopper.was.user);
}

/* However many large things an edit has, the end waits for one. */
static void an_end_waits_for_no_more_than_one_record(void **state)
{
    struct client *c = *state;
    client_hold(c); /* it is not looking */
    stopper.director = c->director;
    stopper.was = c->director->world.go_on;
    c->director->world.go_on = (struct lum_go_on){stop_at_second, NULL};
    uint64_t first = c->next_id + 1;
    assert_true(lum_director_post(c->director, client_edit(c, "[{\"op\":\"remove\",\"id\":\"lamp\"}]")));
    assert_true(lum_director_post(
        c->director, client_edit(c, "[{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"a\",\"shape\":\"box\"},"
                                    "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"b\",\"shape\":\"box\"}]")));
    client_release(c, NULL);
    assert_refused(client_reply(c, first + 1), "internal", NULL);
    pthread_join(c->director->thread, NULL);
    c->director->has_thread = false;
    assert_int_equal(stopper.asked, 2);
    assert_int_equal(lum_director_scene_rev(c->director), c->director->world.snapshot->scene_rev);
}

static void views_are_limited(void **state)
{
    struct client *c = *state;
    struct lum_request *request;
    for (uint32_t i = 0; i < MAX_STREAMS; i++)
        client_open_view(c, LUM_CODEC_JPEG);
    for (uint32_t i = MAX_STREAMS; i < LUM_LIMIT_VIEWS_PER_SESSION; i++) {
        c->n_streams = MAX_STREAMS - 1; /* the test keeps no more than these */
        lum_stream_unref(c->streams[c->n_streams]);
        client_open_view(c, LUM_CODEC_JPEG);
    }
    request = client_request(c, &lum_request_view_open);
    request->view = (struct lum_view_params){.given = LUM_VIEW_BIT(SIZE), .size = {8, 8}};
    assert_refused(client_ask(c, request), "limit_exceeded", NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_view_gets_frames_until_it_converged, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(an_edit_shows_under_its_revision, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(a_dimmed_lamp_is_darker_under_automatic_exposure, client_setup,
                                        client_teardown),
        cmocka_unit_test_setup_teardown(exposure_is_kept_from_the_first_frame_on, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(everybody_hears_of_an_edit, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(undo_and_redo_bring_the_picture_back, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(edits_are_all_or_nothing, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(a_stale_base_revision_is_refused, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(the_inbox_is_limited_in_bytes, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(the_inbox_is_charged_for_what_was_read, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(the_costliest_message_is_admitted_alone, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(a_session_takes_its_history_along, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(a_session_takes_its_views_along, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(an_end_waits_for_no_more_than_one_record, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(views_are_limited, client_setup, client_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
