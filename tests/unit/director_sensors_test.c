/* Sensors over the protocol: values follow edits, settle, are undone; nothing is measured unless somebody watches. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/report/shot.h"
#include "tests/support/director_client.h"

/* Pictures of reports in small: what is shown here is when they are made. */
enum lum_status __real_lum_shot_create(const struct lum_world *w, const struct lum_shot_desc *desc,
                                       struct lum_shot **ret_shot, struct lum_error *err);
enum lum_status __wrap_lum_shot_create(const struct lum_world *w, const struct lum_shot_desc *desc,
                                       struct lum_shot **ret_shot, struct lum_error *err);
enum lum_status __wrap_lum_shot_create(const struct lum_world *w, const struct lum_shot_desc *desc,
                                       struct lum_shot **ret_shot, struct lum_error *err)
{
    struct lum_shot_desc small = *desc;
    small.w /= 6;
    small.h /= 6;
    return __real_lum_shot_create(w, &small, ret_shot, err);
}

/* A bulb of 100 cd, 2 m above a black floor: 25 lx below it. */
static const char lit[] =
    "[{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"sheet\",\"shape\":\"quad\",\"size\":[8,0,8]},"
    "{\"op\":\"add\",\"type\":\"material\",\"id\":\"black\",\"base_color\":[0,0,0],\"specular\":0},"
    "{\"op\":\"add\",\"type\":\"object\",\"id\":\"ground\",\"mesh\":\"sheet\",\"material\":\"black\","
    "\"transform\":{\"translate\":[50,0,50]}},"
    "{\"op\":\"add\",\"type\":\"light\",\"id\":\"bulb\",\"kind\":\"point\",\"position\":[50,3,50],\"intensity_cd\":100}"
    ","
    "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"spot\",\"kind\":\"point\",\"position\":[50,1,50],\"target_lx\":20},"
    "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"row\",\"kind\":\"line\",\"position\":[50,1,50],\"u\":[1,0,0],"
    "\"spacing_m\":0.5}]";

static cJSON *watch(struct client *c, bool on)
{
    struct lum_request *q = client_request(c, &lum_request_sensor_watch);
    q->on = on;
    q->points = true;
    return client_ask(c, q);
}

/* The newest that was said of the sensor, detached; NULL: nothing. */
static cJSON *said_of(struct client *c, const char *id)
{
    cJSON *found = NULL;
    for (size_t i = 0; i < c->n_texts; i++) {
        cJSON *json = cJSON_Parse(c->texts[i]), *one;
        const cJSON *method = cJSON_GetObjectItem(json, "method"),
                    *list = cJSON_GetObjectItem(cJSON_GetObjectItem(json, "params"), "sensors");
        if (method && strcmp(method->valuestring, "sensors") == 0)
            for (one = list->child; one; one = one ? one->next : NULL)
                if (strcmp(cJSON_GetObjectItem(one, "id")->valuestring, id) == 0) {
                    cJSON_Delete(found);
                    found = cJSON_Duplicate(one, true);
                }
        cJSON_Delete(json);
    }
    return found;
}

/* Waits until the sensor is settled in this revision or a later one; its mean. */
static double settled(struct client *c, const char *id, uint64_t rev)
{
    for (;; client_wait(c)) {
        client_listen(c);
        cJSON *is = said_of(c, id);
        bool ready = is && cJSON_IsTrue(cJSON_GetObjectItem(is, "settled")) &&
                     cJSON_GetObjectItem(is, "scene_rev")->valuedouble >= (double)rev;
        double lx = ready ? cJSON_GetObjectItem(is, "em_lx")->valuedouble : 0.0;
        cJSON_Delete(is);
        if (ready)
            return lx;
    }
}

static void assert_near(double got, double want)
{
    if (!(fabs(got - want) <= 1e-4 * want))
        fail_msg("%.9g lx, expected %.9g", got, want);
}

/* What was told of a report, in order: stages and counts, that rise to what they are of. */
static void check_progress(const struct client *c)
{
    static const char *const stages[] = {"sensors", "picture", "illuminance"};
    size_t stage = 0, n[3] = {0};
    double last = -1.0;
    for (size_t i = 0; i < c->n_texts; i++) {
        if (!strstr(c->texts[i], "\"report.progress\""))
            continue;
        cJSON *text = cJSON_Parse(c->texts[i]);
        const cJSON *params = cJSON_GetObjectItem(text, "params");
        double done = cJSON_GetObjectItem(params, "done")->valuedouble,
               of = cJSON_GetObjectItem(params, "of")->valuedouble;
        while (stage < 2 && strcmp(cJSON_GetObjectItem(params, "stage")->valuestring, stages[stage]) != 0)
            stage++, last = -1.0;
        assert_string_equal(cJSON_GetObjectItem(params, "stage")->valuestring, stages[stage]);
        assert_true(done > last && done <= of);
        last = done;
        n[stage]++;
        cJSON_Delete(text);
    }
    assert_true(n[0] > 0 && n[1] > 0 && n[2] > 0);
}

/* A report and an edit at once: the edit does not wait, and the page is of one of both revisions alone. A second report
 * of the session is refused; one of a session that ends is dropped. */
static void a_report_is_of_one_revision(void **state)
{
    struct client *c = *state;
    uint64_t rev = client_apply(c, lit);
    cJSON_Delete(watch(c, true));
    (void)settled(c, "spot", rev);
    struct lum_request *q = client_request(c, &lum_request_report_get);
    uint64_t id = c->next_id;
    assert_true(lum_director_post(c->director, q));
    assert_refused(client_ask(c, client_request(c, &lum_request_report_get)), "busy", NULL);
    rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"bulb\",\"path\":\"/intensity_cd\",\"value\":200}]");
    cJSON *reply = client_reply(c, id);
    const cJSON *result = cJSON_GetObjectItem(reply, "result");
    const char *html = cJSON_GetObjectItem(result, "html")->valuestring;
    bool after = cJSON_GetObjectItem(result, "scene_rev")->valuedouble == (double)rev;
    assert_non_null(strstr(html, after ? "<td>spot<td>horizontal<td class=\"n\">50 &plusmn;"
                                       : "<td>spot<td>horizontal<td class=\"n\">25 &plusmn;"));
    assert_non_null(strstr(html, after ? "<td class=\"n\">2513<" : "<td class=\"n\">1257<")); /* 4 pi lm for each cd */
    assert_non_null(strstr(html, "data:image/png"));
    cJSON_Delete(reply);
    check_progress(c);
    q = client_request(c, &lum_request_report_get);
    q->view_id = 7;
    assert_refused(client_ask(c, q), "not_found", "view_id");
    assert_true(lum_director_post(c->director, client_request(c, &lum_request_report_get)));
    assert_true(lum_director_post(c->director, client_request(c, &lum_request_session_closed)));
}

static void values_follow_edits(void **state)
{
    struct client *c = *state;
    uint64_t rev = client_apply(c, lit);
    cJSON_Delete(watch(c, true));
    assert_near(settled(c, "spot", rev), 25.0);
    cJSON *spot = said_of(c, "spot"), *row = said_of(c, "row");
    const cJSON *target = cJSON_GetObjectItem(cJSON_GetObjectItem(spot, "targets"), "em");
    assert_true(cJSON_IsTrue(cJSON_GetObjectItem(target, "passes")));
    assert_true(cJSON_IsTrue(cJSON_GetObjectItem(target, "sure")));
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(row, "lx")), 2);
    double r2 = 4 + 0.0625;
    assert_true(fabs(cJSON_GetArrayItem(cJSON_GetObjectItem(row, "lx"), 0)->valuedouble - 200 / (r2 * sqrt(r2))) <
                0.01);
    cJSON_Delete(spot);
    cJSON_Delete(row);
    rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"bulb\",\"path\":\"/intensity_cd\",\"value\":40}]");
    assert_near(settled(c, "spot", rev), 10.0);
    rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"spot\",\"path\":\"/position\",\"value\":[50,2,50]}]");
    assert_near(settled(c, "spot", rev), 40.0);
    rev = scene_rev_of(client_ask(c, client_request(c, &lum_request_scene_undo)));
    assert_near(settled(c, "spot", rev), 10.0);
}

/* An edit that changes no light measures nothing anew; values are told to be those of the new revision. */
static void values_of_an_older_revision_hold_where_light_is_the_same(void **state)
{
    struct client *c = *state;
    uint64_t rev = client_apply(c, lit);
    cJSON_Delete(watch(c, true));
    assert_near(settled(c, "spot", rev), 25.0);
    rev = client_apply(c, "[{\"op\":\"add\",\"type\":\"camera\",\"id\":\"aside\",\"position\":[40,2,50],\"target\":[50,"
                          "1,50],\"up\":[0,1,0],\"vfov_deg\":50}]");
    assert_near(settled(c, "spot", rev), 25.0);
}

static void points_are_read(void **state)
{
    struct client *c = *state;
    client_apply(c, lit);
    struct lum_request *q = client_request(c, &lum_request_sensor_read);
    strcpy(q->id, "row");
    cJSON *reply = client_ask(c, q); /* nobody watches: no values */
    const cJSON *points = cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "result"), "points");
    assert_int_equal(cJSON_GetArraySize(points), 2);
    assert_null(cJSON_GetObjectItem(points->child, "lx"));
    cJSON_Delete(reply);
    q = client_request(c, &lum_request_sensor_read);
    strcpy(q->id, "rov");
    assert_refused(client_ask(c, q), "not_found", "id");
    q = client_request(c, &lum_request_sensor_place);
    q->has_point = true;
    strcpy(q->id, "ground");
    q->height_m = 0.75;
    reply = client_ask(c, q);
    const cJSON *plane = cJSON_GetObjectItem(reply, "result");
    assert_near(cJSON_GetArrayItem(cJSON_GetObjectItem(plane, "position"), 1)->valuedouble, 0.75);
    assert_near(cJSON_GetArrayItem(cJSON_GetObjectItem(plane, "u"), 0)->valuedouble, 8.0);
    cJSON_Delete(reply);
}

/* Waits until what is said of the sensor, settled and of this revision, has the member; the whole, detached. */
static cJSON *settled_with(struct client *c, const char *id, const char *member, uint64_t rev)
{
    for (;; client_wait(c)) {
        client_listen(c);
        cJSON *is = said_of(c, id);
        if (is && cJSON_IsTrue(cJSON_GetObjectItem(is, "settled")) && cJSON_GetObjectItem(is, member) &&
            cJSON_GetObjectItem(is, "scene_rev")->valuedouble >= (double)rev)
            return is;
        cJSON_Delete(is);
    }
}

/* The bulb says nothing of its power; a ball of 100 cd does: 64 W over a floor of 64 m2, and both give 25 lx there at
 * most. An eye has no bright source, and its DGP is that of so little light. */
static void power_and_glare_by_day_are_told(void **state)
{
    struct client *c = *state;
    client_apply(c, lit);
    struct lum_request *q = client_request(c, &lum_request_sensor_place);
    q->height_m = 0.75;
    q->border_m = 0.5;
    cJSON *reply = client_ask(c, q), *placed = cJSON_GetObjectItem(reply, "result");
    double u = cJSON_GetArrayItem(cJSON_GetObjectItem(placed, "u"), 0)->valuedouble,
           v = cJSON_GetArrayItem(cJSON_GetObjectItem(placed, "v"), 2)->valuedouble;
    assert_near(cJSON_GetObjectItem(placed, "floor_m2")->valuedouble, (u + 1.0) * (v + 1.0));
    cJSON_Delete(reply);
    uint64_t rev = client_apply(
        c,
        "[{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"room\",\"kind\":\"grid\",\"position\":[50,1,50],\"u\":[1,0,0],"
        "\"v\":[0,0,1],\"spacing_m\":1,\"floor_m2\":64,\"quantity\":\"modelling\"},"
        "{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"eye\",\"kind\":\"observer\",\"position\":[50,1,50],"
        "\"direction\":[0,1,-1],\"target_dgp\":0.35},"
        "{\"op\":\"add\",\"type\":\"light\",\"id\":\"ball\",\"kind\":\"ies\",\"position\":[50,3,50],"
        "\"web\":{\"c_deg\":[0],\"gamma_deg\":[0,180],\"candela\":[100,100],\"watts\":64}}]");
    cJSON_Delete(watch(c, true));
    cJSON *is = settled_with(c, "room", "power", rev);
    const cJSON *power = cJSON_GetObjectItem(is, "power");
    assert_near(cJSON_GetObjectItem(power, "w_per_m2")->valuedouble, 1.0);
    assert_near(cJSON_GetObjectItem(power, "w_per_m2_100_lx")->valuedouble, 2.0);     /* of 50 lx */
    assert_int_equal(cJSON_GetObjectItem(power, "lamps_without_watts")->valueint, 2); /* the client's scene has one */
    assert_near(cJSON_GetObjectItem(is, "em_lx")->valuedouble, 50.0);
    assert_true(cJSON_GetObjectItem(is, "modelling")->valuedouble < 0.01); /* right above; the other lamp is far */
    assert_true(cJSON_IsFalse(cJSON_GetObjectItem(is, "modelling_in_range")));
    cJSON_Delete(is);
    is = settled_with(c, "eye", "dgp_band", rev);
    double lx = cJSON_GetObjectItem(is, "eye_lx")->valuedouble, little = exp(0.024 * lx - 4.0);
    assert_true(fabs(lx - 50.0 * sqrt(0.5)) < 0.5);
    assert_near(cJSON_GetObjectItem(is, "dgp")->valuedouble, (5.87e-5 * lx + 0.159) * little / (1.0 + little));
    assert_string_equal(cJSON_GetObjectItem(is, "dgp_band")->valuestring, "imperceptible");
    assert_true(cJSON_IsFalse(cJSON_GetObjectItem(is, "dgp_in_range")));
    assert_true(
        cJSON_IsTrue(cJSON_GetObjectItem(cJSON_GetObjectItem(cJSON_GetObjectItem(is, "targets"), "dgp"), "passes")));
    cJSON_Delete(is);
    rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"room\",\"path\":\"/floor_m2\",\"value\":32}]");
    is = settled_with(c, "room", "power", rev); /* nothing is measured anew */
    assert_near(cJSON_GetObjectItem(cJSON_GetObjectItem(is, "power"), "w_per_m2")->valuedouble, 2.0);
    cJSON_Delete(is);
}

/* Values of points of eyes have a name of their own; where the worst is, is told; their points are told with the
 * direction. */
static void eyes_are_watched(void **state)
{
    struct client *c = *state;
    uint64_t rev = client_apply(
        c, "[{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"eyes\",\"kind\":\"line\",\"quantity\":\"ugr\",\"position\":["
           "50,1,50],"
           "\"u\":[2,0,0],\"spacing_m\":1,\"directions\":4,\"target_ugr\":19},"
           "{\"op\":\"add\",\"type\":\"light\",\"id\":\"panel\",\"kind\":\"quad\",\"position\":[50,2,47],\"u\":[1,0,0],"
           "\"v\":[0,0.5,0.5],\"luminance_cd_m2\":3000},"
           "{\"op\":\"add\",\"type\":\"light\",\"id\":\"sky\",\"kind\":\"environment\",\"luminance_cd_m2\":30}]");
    cJSON_Delete(watch(c, true));
    cJSON *is = settled_with(c, "eyes", "worst_point", rev);
    const cJSON *points = cJSON_GetObjectItem(is, "point_ugr");
    assert_int_equal(cJSON_GetArraySize(points), 2);
    double most = fmax(cJSON_GetArrayItem(points, 0)->valuedouble, cJSON_GetArrayItem(points, 1)->valuedouble);
    assert_true(fabs(most - cJSON_GetObjectItem(is, "ugr")->valuedouble) < 0.01);
    assert_true(fabs(cJSON_GetArrayItem(cJSON_GetObjectItem(is, "worst_direction"), 2)->valuedouble + 1.0) < 1e-6);
    assert_null(cJSON_GetObjectItem(is, "em_lx"));
    assert_null(cJSON_GetObjectItem(is, "lx"));
    assert_non_null(cJSON_GetObjectItem(cJSON_GetObjectItem(is, "targets"), "ugr"));
    cJSON_Delete(is);
}

/* A ground of 3 km by 2 km, and one of 1 km by 1 m, have more points by the standard than a sensor may: what is placed
 * there says how far apart as many lie as it may have, and is accepted. */
static void a_plane_over_a_town_is_placed(void **state)
{
    struct client *c = *state;
    static const char *const grounds[] = {"3000,0,2000", "1000,0,1"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(grounds); i++) {
        char ops[512];
        snprintf(ops, sizeof ops,
                 "[{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"land%zu\",\"shape\":\"quad\",\"size\":[%s]},"
                 "{\"op\":\"add\",\"type\":\"object\",\"id\":\"town%zu\",\"mesh\":\"land%zu\",\"material\":\"black\"}]",
                 i, grounds[i], i, i);
        if (i == 0)
            client_apply(c, lit);
        client_apply(c, ops);
        struct lum_request *q = client_request(c, &lum_request_sensor_place);
        q->has_point = true;
        snprintf(q->id, sizeof q->id, "town%zu", i);
        cJSON *reply = client_ask(c, q), *sensor = cJSON_DetachItemFromObject(reply, "result"),
              *list = cJSON_CreateArray();
        assert_true(cJSON_GetObjectItem(sensor, "spacing_m")->valuedouble < 45.0);
        cJSON_AddStringToObject(sensor, "op", "add");
        cJSON_AddStringToObject(sensor, "type", "sensor");
        cJSON_AddStringToObject(sensor, "id", i ? "lane" : "land");
        cJSON_AddItemToArray(list, sensor);
        char *text = cJSON_PrintUnformatted(list);
        client_apply(c, text);
        free(text);
        cJSON_Delete(list);
        cJSON_Delete(reply);
    }
}

/* Too many points for one sensor are refused, and the scene is as before. */
static void too_many_points_are_refused(void **state)
{
    struct client *c = *state;
    struct lum_request *edit =
        client_edit(c, "[{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"s\",\"kind\":\"grid\",\"position\":[0,0,0],"
                       "\"u\":[65,0,0],\"v\":[0,0,64],\"spacing_m\":1}]");
    assert_refused(client_ask(c, edit), "limit_exceeded", "ops/0/spacing_m");
    client_apply(c, "[{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"s\",\"kind\":\"grid\",\"position\":[0,0,0],"
                    "\"u\":[64,0,0],\"v\":[0,0,64],\"spacing_m\":1}]");
}

/* Raises *inout_rev to what texts from number `from` on say of the sensor; without a parser, so that no hand rests. */
static void raise_rev(const struct client *c, size_t from, const char *id, uint64_t *inout_rev)
{
    char member[64];
    snprintf(member, sizeof member, "\"id\":\"%s\",\"scene_rev\":", id);
    for (; from < c->n_texts; from++) {
        const char *at = strstr(c->texts[from], member);
        if (at)
            *inout_rev = strtoull(at + strlen(member), NULL, 10);
    }
}

/* While a lamp is dragged and dragged, a grid that takes longer than the next edit keeps no other sensor from its turn:
 * once it has had its second, each has had its first. */
static void every_sensor_follows_a_hand_that_does_not_rest(void **state)
{
    struct client *c = *state;
    client_apply(c, lit);
    uint64_t rev = client_apply(
        c, "[{\"op\":\"add\",\"type\":\"sensor\",\"id\":\"field\",\"kind\":\"grid\",\"position\":[50,1,50],"
           "\"u\":[6,0,0],\"v\":[0,0,6],\"spacing_m\":0.1}]");
    struct lum_request *q = client_request(c, &lum_request_sensor_watch);
    q->on = true;
    cJSON_Delete(client_ask(c, q));
    uint64_t field = 0, spot = 0;
    for (size_t read = 0, i = 0; field <= rev; i++) {
        client_apply(c, i % 2 ? "[{\"op\":\"set\",\"id\":\"bulb\",\"path\":\"/intensity_cd\",\"value\":40}]"
                              : "[{\"op\":\"set\",\"id\":\"bulb\",\"path\":\"/intensity_cd\",\"value\":50}]");
        raise_rev(c, read, "field", &field);
        raise_rev(c, read, "spot", &spot);
        read = c->n_texts;
    }
    assert_true(spot > 0);
}

/* Whoever leaves, or says so, hears no more; what is said after that to others is not to them. */
static void who_stops_watching_hears_no_more(void **state)
{
    struct client *c = *state;
    uint64_t rev = client_apply(c, lit);
    cJSON_Delete(watch(c, true));
    settled(c, "row", rev);
    cJSON_Delete(watch(c, false));
    client_apply(c, "[{\"op\":\"set\",\"id\":\"bulb\",\"path\":\"/intensity_cd\",\"value\":40}]");
    client_listen(c);
    cJSON *is = said_of(c, "row");
    assert_true(cJSON_GetObjectItem(is, "scene_rev")->valuedouble <= (double)rev);
    cJSON_Delete(is);
}

/* What was measured is forgotten once nobody watches, and with it the scene that it was measured in: it would be read
 * as what is known now. */
static void nothing_is_known_once_nobody_watches(void **state)
{
    struct client *c = *state;
    uint64_t rev = client_apply(c, lit);
    cJSON_Delete(watch(c, true));
    settled(c, "spot", rev);
    cJSON_Delete(watch(c, true)); /* again: it is kept */
    struct lum_request *q = client_request(c, &lum_request_sensor_read);
    strcpy(q->id, "spot");
    cJSON *reply = client_ask(c, q);
    assert_non_null(cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "result"), "em_lx"));
    cJSON_Delete(reply);
    cJSON_Delete(watch(c, false));
    rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"bulb\",\"path\":\"/intensity_cd\",\"value\":40}]");
    q = client_request(c, &lum_request_sensor_read);
    strcpy(q->id, "spot");
    reply = client_ask(c, q);
    assert_null(cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "result"), "em_lx"));
    cJSON_Delete(reply);
    cJSON_Delete(watch(c, true));
    assert_near(settled(c, "spot", rev), 10.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(power_and_glare_by_day_are_told, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(values_follow_edits, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(a_report_is_of_one_revision, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(values_of_an_older_revision_hold_where_light_is_the_same, client_setup,
                                        client_teardown),
        cmocka_unit_test_setup_teardown(points_are_read, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(eyes_are_watched, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(a_plane_over_a_town_is_placed, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(too_many_points_are_refused, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(every_sensor_follows_a_hand_that_does_not_rest, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(who_stops_watching_hears_no_more, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(nothing_is_known_once_nobody_watches, client_setup, client_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
