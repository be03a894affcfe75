/* Views that show the scene as it was. */
#include <stdio.h>

#include "server/director/internal.h"
#include "tests/support/director_client.h"

/* A step of a drag. */
static uint64_t drag(struct client *c, int intensity_cd)
{
    char params[160];
    snprintf(
        params, sizeof params,
        "{\"ops\":[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":%d}],\"undo_group\":\"g\"}",
        intensity_cd);
    return scene_rev_of(client_ask_text(c, "scene.apply", params));
}

/* Of a small picture; id: of one that is there, or 0. */
static cJSON *show_moment(struct client *c, uint32_t id, uint64_t rev)
{
    char params[120];
    if (id)
        snprintf(params, sizeof params, "{\"view_id\":%u,\"moment\":%llu}", id, (unsigned long long)rev);
    else
        snprintf(params, sizeof params, "{\"size\":[8,8],\"spp\":1,\"moment\":%llu}", (unsigned long long)rev);
    return client_ask_text(c, id ? "view.update" : "view.open", params);
}

static uint32_t view_id_of(cJSON *reply)
{
    const cJSON *id = cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "result"), "view_id");
    assert_non_null(id);
    uint32_t view_id = (uint32_t)id->valuedouble;
    cJSON_Delete(reply);
    return view_id;
}

static void close_view(struct client *c, uint32_t id)
{
    char params[40];
    snprintf(params, sizeof params, "{\"view_id\":%u}", id);
    assert_taken(client_ask_text(c, "view.close", params));
}

/* Whatever becomes of the moment: the drag goes on, and it is none any more. */
static void a_moment_that_is_shown_may_be_said_again(void **state)
{
    struct client *c = *state;
    uint64_t rev = drag(c, 11);
    uint32_t id = view_id_of(show_moment(c, 0, rev));
    drag(c, 12);
    uint64_t n_made = c->director->world.n_moments;
    const struct lum_snapshot *shown = c->director->views->moment;
    assert_taken(show_moment(c, id, rev));
    assert_ptr_equal(c->director->views->moment, shown);
    assert_int_equal(c->director->world.n_moments, n_made); /* nor was it made anew */
    assert_refused(show_moment(c, 0, rev), "not_found", "moment");
    assert_refused(show_moment(c, id, rev + 100), "not_found", "moment");
    assert_ptr_equal(c->director->views->moment, shown);
}

static void views_of_moments_have_room_together(void **state)
{
    struct client *c = *state;
    uint64_t rev = drag(c, 11), now;
    client_apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":12}]");
    uint32_t id = view_id_of(show_moment(c, 0, rev));
    uint64_t n_bytes = c->director->views->moment_bytes;
    assert_true(n_bytes > 0);
    c->director->world.past_bytes.most = n_bytes + n_bytes / 2;
    assert_refused(show_moment(c, 0, rev), "limit_exceeded", "moment");
    now = lum_director_scene_rev(c->director);
    assert_taken(show_moment(c, id, now)); /* in place of its own, and nothing is otherwise */
    assert_taken(show_moment(c, id, rev));
    close_view(c, id);
    close_view(c, view_id_of(show_moment(c, 0, rev)));
}

/* What surfaces had there is of nobody's use then. */
static void the_last_view_of_a_moment_leaves_nothing(void **state)
{
    struct client *c = *state;
    uint64_t rev = drag(c, 11);
    uint32_t ids[2];
    for (int i = 0; i < 2; i++)
        ids[i] = view_id_of(show_moment(c, 0, rev));
    assert_non_null(c->director->world.past);
    close_view(c, ids[0]);
    assert_non_null(c->director->world.past);
    char now[60];
    snprintf(now, sizeof now, "{\"view_id\":%u,\"moment\":null}", ids[1]);
    assert_taken(client_ask_text(c, "view.update", now));
    assert_null(c->director->world.past);
    assert_refused(show_moment(c, 0, rev + 100), "not_found", "moment");
    assert_null(c->director->world.past);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_moment_that_is_shown_may_be_said_again, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(views_of_moments_have_room_together, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(the_last_view_of_a_moment_leaves_nothing, client_setup, client_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
