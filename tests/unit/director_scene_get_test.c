/* scene.get of a large scene, over the protocol: written while edits go on, and as the scene is when it is sent. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/director_client.h"

enum { OBJECTS = 4000, PER_EDIT = 2000, EDITS = 20 };

static const struct lum_session_ref other = {5, 1};

/* Objects in one place far away: little work for the renderer. */
static uint64_t fill_scene(struct client *c)
{
    static char ops[PER_EDIT * 120];
    uint64_t rev = 0;
    for (int first = 0; first < OBJECTS; first += PER_EDIT) {
        size_t n = 0;
        for (int i = first; i < first + PER_EDIT; i++)
            n += (size_t)snprintf(
                ops + n, sizeof ops - n,
                "%s{\"op\":\"add\",\"type\":\"object\",\"id\":\"o%05d\",\"mesh\":\"plane\",\"material\":\"grey\"}",
                i == first ? "[" : ",", i);
        snprintf(ops + n, sizeof ops - n, "]");
        rev = client_apply(c, ops);
    }
    return rev;
}

static struct lum_request *dim(struct client *c, int intensity_cd)
{
    char ops[96];
    snprintf(ops, sizeof ops, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":%d}]",
             intensity_cd);
    return client_edit(c, ops);
}

static struct lum_request *get(struct client *c, bool expand)
{
    struct lum_request *q = client_request(c, &lum_request_scene_get);
    q->expand = expand;
    return q;
}

static double lamp_of(const cJSON *ops)
{
    const cJSON *op;
    cJSON_ArrayForEach(op, ops)
    {
        if (strcmp(cJSON_GetObjectItem(op, "id")->valuestring, "lamp") == 0)
            return cJSON_GetObjectItem(op, "intensity_cd")->valuedouble;
    }
    fail_msg("no lamp");
    return 0.0;
}

/* Place of the reply in what was said. */
static size_t place_of(const struct client *c, uint64_t id)
{
    char end[40];
    snprintf(end, sizeof end, "\"id\":%llu}", (unsigned long long)id);
    for (size_t i = 0; i < c->n_texts; i++)
        if (strlen(c->texts[i]) > strlen(end) && strcmp(c->texts[i] + strlen(c->texts[i]) - strlen(end), end) == 0)
            return i;
    fail_msg("nothing with %s", end);
    return 0;
}

/* News of edits up to the answer's revision are told before it, the others after it. */
static void check_order(const struct client *c, size_t answer, double rev)
{
    for (size_t i = 0; i < c->n_texts; i++) {
        cJSON *json = i == answer ? NULL : cJSON_Parse(c->texts[i]);
        const cJSON *method = cJSON_GetObjectItem(json, "method"),
                    *at = cJSON_GetObjectItem(cJSON_GetObjectItem(json, "params"), "scene_rev");
        if (method && strcmp(method->valuestring, "scene.changed") == 0)
            assert_true((at->valuedouble <= rev) == (i < answer));
        cJSON_Delete(json);
    }
}

static cJSON *ops_of(cJSON *reply)
{
    return cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "result"), "ops");
}

/* Whatever edits come while it is written, the answer is of one revision: nothing differs from another but the lamp. */
static void an_answer_is_of_one_revision(void **state)
{
    struct client *c = *state;
    uint64_t before = fill_scene(c);
    for (int expand = 0; expand <= 1; expand++, before += EDITS) {
        assert_true(lum_director_post(c->director, get(c, expand)));
        uint64_t id = c->next_id;
        for (int i = 1; i <= EDITS; i++)
            scene_rev_of(client_ask(c, dim(c, 100 + i)));
        cJSON *reply = client_reply(c, id), *at_rest = client_ask(c, get(c, expand));
        double rev = cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "result"), "scene_rev")->valuedouble;
        assert_true(rev == (double)before || lamp_of(ops_of(reply)) == 100.0 + rev - (double)before);
        check_order(c, place_of(c, id), rev);
        size_t n_other = 0, n = 0;
        const cJSON *a = ops_of(reply)->child, *b = ops_of(at_rest)->child;
        for (; a && b; a = a->next, b = b->next, n++)
            n_other += !cJSON_Compare(a, b, true);
        assert_true(!a && !b && n > OBJECTS && n_other <= 1);
        cJSON_Delete(reply);
        cJSON_Delete(at_rest);
    }
}

/* A number comes back with all its digits: 17 of them here. */
static void numbers_are_whole(void **state)
{
    struct client *c = *state;
    client_apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":92.392408876870323}]");
    for (int expand = 0; expand <= 1; expand++) {
        cJSON *reply = client_ask(c, get(c, expand));
        assert_true(lamp_of(ops_of(reply)) == 92.392408876870323);
        cJSON_Delete(reply);
    }
}

/* Who asks for it keeps nobody waiting: what came after is answered first. */
static void an_edit_does_not_wait_for_it(void **state)
{
    struct client *c = *state;
    client_hold(c);
    assert_true(lum_director_post(c->director, get(c, true)));
    uint64_t of_get = c->next_id;
    struct lum_request *q = dim(c, 7);
    q->session = other;
    assert_true(lum_director_post(c->director, q));
    client_release(c, NULL);
    cJSON *reply = client_reply(c, of_get);
    assert_true(lamp_of(ops_of(reply)) == 7.0);
    assert_true(place_of(c, of_get + 1) < place_of(c, of_get));
    cJSON_Delete(reply);
}

static void waiting_ones_are_limited_and_dropped(void **state)
{
    struct client *c = *state;
    client_hold(c);
    for (uint32_t i = 0; i <= LUM_LIMIT_SCENE_GETS_WAITING; i++)
        assert_true(lum_director_post(c->director, get(c, i % 2)));
    uint64_t last = c->next_id;
    struct lum_request *gone = client_request(c, &lum_request_session_closed), *mine = get(c, true);
    mine->session = other;
    assert_true(lum_director_post(c->director, gone));
    assert_true(lum_director_post(c->director, mine));
    client_release(c, NULL);
    cJSON_Delete(client_reply(c, c->next_id));
    assert_refused(client_reply(c, last), "busy", NULL);
    size_t n = 0;
    for (size_t i = 0; i < c->n_texts; i++)
        n += strstr(c->texts[i], "\"ops\":") != NULL;
    assert_int_equal(n, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(an_answer_is_of_one_revision, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(numbers_are_whole, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(an_edit_does_not_wait_for_it, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(waiting_ones_are_limited_and_dropped, client_setup, client_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
