/* Objects that shine, over the protocol: their light is told in scene.get and scene.changed, edited, undone, grouped.
 */
#include <math.h>
#include <string.h>

#include "tests/support/director_client.h"

/* A panel of 2 x 1 m that shines with 100 cd/m2 from its front: pi * 100 * 2 lm. */
static const char panel[] =
    "[{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"sheet\",\"shape\":\"quad\",\"size\":[2,0,1]},"
    "{\"op\":\"add\",\"type\":\"material\",\"id\":\"glow\",\"emission_cd_m2\":100,\"emission_sides\":\"front\"},"
    "{\"op\":\"add\",\"type\":\"object\",\"id\":\"panel\",\"mesh\":\"sheet\",\"material\":\"glow\","
    "\"transform\":{\"translate\":[0,3,0]}},"
    "{\"op\":\"add\",\"type\":\"object\",\"id\":\"twin\",\"mesh\":\"sheet\",\"material\":\"glow\","
    "\"transform\":{\"translate\":[0,4,0]}}]";
#define FULL_LM (3.14159265358979 * 200)

static double number(const cJSON *o, const char *key)
{
    const cJSON *n = cJSON_GetObjectItem(o, key);
    if (!cJSON_IsNumber(n))
        fail_msg("there is no number %s", key);
    return n->valuedouble;
}

/* Floats of a few operations. */
static void assert_near(double got, double want)
{
    if (!(fabs(got - want) <= 1e-5 * fabs(want)))
        fail_msg("%.9g, expected %.9g", got, want);
}

/* "emits" of the object, as scene.get tells it now; delete the reply. */
static const cJSON *emits_now(struct client *c, const char *id, cJSON **ret_reply)
{
    struct lum_request *get = client_request(c, &lum_request_scene_get);
    get->expand = true;
    *ret_reply = client_ask(c, get);
    const cJSON *op;
    cJSON_ArrayForEach(op, cJSON_GetObjectItem(cJSON_GetObjectItem(*ret_reply, "result"),
                                               "ops")) if (strcmp(cJSON_GetObjectItem(op, "id")->valuestring, id) ==
                                                           0) return cJSON_GetObjectItem(op, "emits");
    fail_msg("there is no %s", id);
    return NULL;
}

static void assert_flux(struct client *c, const char *id, double want_lm)
{
    cJSON *reply;
    assert_near(number(emits_now(c, id, &reply), "flux_lm"), want_lm);
    cJSON_Delete(reply);
}

/* "emits" of the scene.changed of this revision, detached; NULL: it has none. */
static cJSON *emits_of_change(struct client *c, uint64_t rev)
{
    for (;;) {
        client_listen(c);
        for (size_t i = 0; i < c->n_texts; i++) {
            cJSON *json = cJSON_Parse(c->texts[i]), *params = cJSON_GetObjectItem(json, "params");
            const cJSON *method = cJSON_GetObjectItem(json, "method");
            bool found = method && strcmp(method->valuestring, "scene.changed") == 0 &&
                         number(params, "scene_rev") == (double)rev;
            cJSON *emits = found ? cJSON_DetachItemFromObject(params, "emits") : NULL;
            cJSON_Delete(json);
            if (found)
                return emits;
        }
        client_wait(c);
    }
}

static void their_light_is_told(void **state)
{
    struct client *c = *state;
    cJSON *told = emits_of_change(c, client_apply(c, panel));
    const cJSON *mine = cJSON_GetObjectItem(told, "panel");
    assert_near(number(mine, "flux_lm"), FULL_LM);
    assert_near(number(mine, "material_flux_lm"), FULL_LM);
    assert_near(number(mine, "luminance_cd_m2"), 100);
    assert_near(number(mine, "area_m2"), 2);
    assert_near(cJSON_GetArrayItem(cJSON_GetObjectItem(mine, "centre"), 1)->valuedouble, 3);
    assert_string_equal(cJSON_GetObjectItem(mine, "sides")->valuestring, "front");
    cJSON_Delete(told);
    assert_flux(c, "panel", FULL_LM);
    cJSON *reply;
    assert_null(emits_now(c, "floor", &reply));
    cJSON_Delete(reply);
}

/* What changed, of whom it changed, and no more. */
static void edits_are_the_objects_own_and_undone(void **state)
{
    struct client *c = *state;
    client_apply(c, panel);
    uint64_t rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"panel\",\"path\":\"/flux_lm\",\"value\":50}]");
    cJSON *told = emits_of_change(c, rev);
    assert_int_equal(cJSON_GetArraySize(told), 1);
    const cJSON *mine = cJSON_GetObjectItem(told, "panel");
    assert_int_equal(cJSON_GetArraySize(mine), 2);
    assert_near(number(mine, "flux_lm"), 50);
    assert_near(number(mine, "luminance_cd_m2"), 50 / FULL_LM * 100);
    cJSON_Delete(told);
    assert_flux(c, "twin", FULL_LM);
    rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"panel\",\"path\":\"/luminance_cd_m2\",\"value\":10}]");
    assert_flux(c, "panel", FULL_LM / 10); /* it replaces the flux */
    scene_rev_of(client_ask(c, client_request(c, &lum_request_scene_undo)));
    assert_flux(c, "panel", 50);
    scene_rev_of(client_ask(c, client_request(c, &lum_request_scene_undo)));
    assert_flux(c, "panel", FULL_LM);
    scene_rev_of(client_ask(c, client_request(c, &lum_request_scene_redo)));
    assert_flux(c, "panel", 50);
    rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"glow\",\"path\":\"/emission_cd_m2\",\"value\":30}]");
    told = emits_of_change(c, rev); /* of its own flux it keeps that */
    assert_int_equal(cJSON_GetArraySize(told), 2);
    assert_near(number(cJSON_GetObjectItem(told, "twin"), "flux_lm"), FULL_LM * 0.3);
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(told, "panel")), 1);
    assert_near(number(cJSON_GetObjectItem(told, "panel"), "material_flux_lm"), FULL_LM * 0.3);
    cJSON_Delete(told);
    rev = client_apply(c, "[{\"op\":\"remove\",\"id\":\"panel\"}]");
    told = emits_of_change(c, rev);
    assert_true(cJSON_IsNull(cJSON_GetObjectItem(told, "panel")));
    cJSON_Delete(told);
    rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"twin\",\"path\":\"/on\",\"value\":false}]");
    assert_null(emits_of_change(c, rev)); /* as if it were on */
}

static void what_excludes_each_other_is_refused(void **state)
{
    struct client *c = *state;
    client_apply(c, panel);
    static const char *const wrong[][2] = {
        {"[{\"op\":\"set\",\"id\":\"panel\",\"path\":\"\",\"value\":{\"flux_lm\":1,\"luminance_cd_m2\":1}}]",
         "invalid_value"},
        {"[{\"op\":\"set\",\"id\":\"panel\",\"path\":\"/color\",\"value\":[0,0,0]}]", "invalid_value"},
        {"[{\"op\":\"set\",\"id\":\"panel\",\"path\":\"/color/0\",\"value\":1}]", "not_found"},
        {"[{\"op\":\"set\",\"id\":\"panel\",\"path\":\"/flux_lm\",\"value\":-1}]", "invalid_value"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_refused(client_ask(c, client_edit(c, wrong[i][0])), wrong[i][1], NULL);
    client_apply(c, "[{\"op\":\"set\",\"id\":\"panel\",\"path\":\"/color\",\"value\":[1,0,0]},"
                    "{\"op\":\"set\",\"id\":\"panel\",\"path\":\"/cct_k\",\"value\":3000},"
                    "{\"op\":\"set\",\"id\":\"panel\",\"path\":\"/color\",\"value\":null}]");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(their_light_is_told, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(edits_are_the_objects_own_and_undone, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(what_excludes_each_other_is_refused, client_setup, client_teardown),
    };
    return cmocka_run_group_tests_name("director_luminaire", tests, NULL, NULL);
}
