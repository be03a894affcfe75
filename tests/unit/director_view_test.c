/* What a view may be asked for: white balance, cameras, budgets, effects, overlays. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/message/rpc.h"
#include "server/director/read_request.h"
#include "tests/support/director_client.h"

static void balance(struct client *c, uint32_t view_id, struct lum_opt kelvin)
{
    struct lum_request *request = client_request(c, &lum_request_view_update);
    request->view_id = view_id;
    request->view = (struct lum_view_params){.given = LUM_VIEW_BIT(WHITE_BALANCE_K), .white_balance_k = kelvin};
    cJSON_Delete(client_ask(c, request));
}

static void white_balance_costs_no_ray(void **state)
{
    struct client *c = *state;
    static uint8_t plain[W * H * 4], cool[W * H * 4], again[W * H * 4];
    struct lum_director_metrics before, after;
    uint32_t id = client_open_view(c, LUM_CODEC_RGBA8);
    client_converged_frame(c, 0, plain);
    lum_director_metrics(c->director, &before);
    memcpy(cool, plain, sizeof cool);
    balance(c, id, (struct lum_opt){true, 3000.0});
    client_converged_frame(c, 0, cool);
    long red = 0, blue = 0;
    for (size_t i = 0; i < sizeof plain; i += 4) {
        red += cool[i] - plain[i];
        blue += cool[i + 2] - plain[i + 2];
    }
    assert_true(red < 0 && blue > 0);
    memcpy(again, cool, sizeof again);
    balance(c, id, (struct lum_opt){0});
    client_converged_frame(c, 0, again);
    assert_memory_equal(plain, again, sizeof plain);
    lum_director_metrics(c->director, &after);
    assert_true(after.passes == before.passes && after.rays == before.rays);
}

static void the_latest_camera_wins(void **state)
{
    struct client *c = *state;
    uint32_t id = client_open_view(c, LUM_CODEC_JPEG);
    enum { MOVES = 200 };
    for (uint32_t i = 1; i <= MOVES; i++) {
        struct lum_request *request = lum_request_create(&lum_request_view_update);
        assert_non_null(request);
        request->session = c->session;
        request->received_ns = lum_clock_ns();
        request->view_id = id;
        request->view = (struct lum_view_params){
            .given = LUM_VIEW_BIT(CAMERA) | LUM_VIEW_BIT(CAMERA_SEQ),
            .camera = {.position = {0.01 * i, 2, 4}, .up = {0, 1, 0}, .vfov_deg = 40},
            .camera_seq = i,
        };
        assert_true(lum_director_post(c->director, request));
    }
    uint32_t seq = 0;
    struct lum_frame_header h;
    do {
        h = client_next_frame(c, NULL);
        assert_true(h.camera_seq >= seq);
        seq = h.camera_seq;
    } while (!(h.flags & LUM_FRAME_CONVERGED));
    assert_int_equal(seq, MOVES);
}

/* A picture that its budget ended goes on when the budget grows. */
static void a_larger_budget_resumes(void **state)
{
    struct client *c = *state;
    struct lum_request *request = client_request(c, &lum_request_view_open);
    request->view = (struct lum_view_params){
        .given = LUM_VIEW_BIT(SIZE) | LUM_VIEW_BIT(BUDGET), .size = {W, H}, .budget = {.error = {true, 10.0}}};
    cJSON_Delete(client_ask(c, request));
    struct lum_frame_header h = client_converged_frame(c, 0, NULL);
    request = client_request(c, &lum_request_view_update);
    request->view_id = h.view_id;
    request->view.given = LUM_VIEW_BIT(BUDGET); /* of nothing: the scene's 16 samples count again */
    cJSON_Delete(client_ask(c, request));
    assert_true(h.spp < 16);
    while (h.spp < 16)
        h = client_next_frame(c, NULL);
    assert_int_equal(h.spp, 16);
}

static cJSON *update_view(struct client *c, const char *params)
{
    return client_ask_text(c, "view.update", params);
}

/* Next frame that shows camera number seq and is final. */
static long sum_of_numbered(struct client *c, uint32_t seq, uint8_t pixels[W * H * 4])
{
    struct lum_frame_header h;
    do
        h = client_next_frame(c, pixels);
    while (h.camera_seq != seq || !(h.flags & LUM_FRAME_CONVERGED));
    long sum = 0;
    for (size_t i = 0; i < W * H; i++)
        sum += pixels[4 * i] + pixels[4 * i + 1] + pixels[4 * i + 2];
    return sum;
}

/* The only light is a point: without `direct` the picture is black. Requests merge: what one does not name stays. */
static void effects_are_forced_and_given_back(void **state)
{
    struct client *c = *state;
    uint8_t first[W * H * 4], pixels[W * H * 4];
    client_open_view(c, LUM_CODEC_RGBA8);
    assert_taken(update_view(c, "{\"view_id\":1,\"method\":\"whitted\",\"camera_seq\":1}"));
    assert_true(sum_of_numbered(c, 1, first) > 0);
    assert_taken(update_view(c, "{\"view_id\":1,\"effects\":{\"direct\":\"off\"},\"camera_seq\":2}"));
    assert_int_equal(sum_of_numbered(c, 2, pixels), 0);
    assert_taken(update_view(c, "{\"view_id\":1,\"effects\":{\"media\":\"on\"},\"camera_seq\":3}"));
    assert_int_equal(sum_of_numbered(c, 3, pixels), 0);
    assert_taken(update_view(c, "{\"view_id\":1,\"effects\":{\"direct\":\"auto\"},\"camera_seq\":4}"));
    sum_of_numbered(c, 4, pixels);
    assert_memory_equal(pixels, first, sizeof first);
}

/* The shortest time ends a picture after its first whole pass, and not with the rough one before it. */
static void a_spent_time_leaves_a_whole_picture(void **state)
{
    struct client *c = *state;
    struct lum_request *request = client_request(c, &lum_request_view_open);
    request->view = (struct lum_view_params){
        .given = LUM_VIEW_BIT(SIZE) | LUM_VIEW_BIT(BUDGET), .size = {W, H}, .budget = {.time_ms = {true, 1e-6}}};
    cJSON_Delete(client_ask(c, request));
    struct lum_frame_header h = client_converged_frame(c, 0, NULL);
    assert_int_equal(h.spp, 1);
}

/* What is new is shown in the time of a budget, be it by a rough picture: before anything is known of the method's time
 * by that. Methods without samples show none unasked. */
static void a_time_holds_for_what_is_new(void **state)
{
    struct client *c = *state;
    static const char *const updates[] = {
        "{\"view_id\":1,\"method\":\"whitted\",\"camera_seq\":1}",
        "{\"view_id\":1,\"method\":\"igi\",\"budget\":{\"time_ms\":1000},\"camera_seq\":2}",
    };
    client_open_view(c, LUM_CODEC_RGBA8);
    for (uint32_t i = 0; i < 2; i++) {
        struct lum_frame_header h;
        assert_taken(update_view(c, updates[i]));
        do
            h = client_next_frame(c, NULL);
        while (h.camera_seq != i + 1);
        assert_int_equal(h.spp, i == 0 ? 1 : 0);
        while (!(h.flags & LUM_FRAME_CONVERGED))
            h = client_next_frame(c, NULL);
        assert_int_equal(h.spp, 1);
    }
}

/* A view's own number of samples holds beside a budget, which else may take as many as there are. */
static void samples_end_what_a_budget_does_not(void **state)
{
    struct client *c = *state;
    struct lum_request *request = client_request(c, &lum_request_view_open);
    request->view = (struct lum_view_params){.given = LUM_VIEW_BIT(SIZE) | LUM_VIEW_BIT(BUDGET) | LUM_VIEW_BIT(SPP),
                                             .size = {W, H},
                                             .spp = 3,
                                             .budget = {.error = {true, 1e-4}}};
    cJSON_Delete(client_ask(c, request));
    struct lum_frame_header h = client_converged_frame(c, 0, NULL);
    assert_int_equal(h.spp, 3);
}

static void effects_that_do_not_exist_are_refused(void **state)
{
    struct client *c = *state;
    client_open_view(c, LUM_CODEC_RGBA8);
    cJSON *reply = update_view(c, "{\"view_id\":1,\"effects\":{\"caustics\":\"on\"}}");
    const char *message = cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "error"), "message")->valuestring;
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (!strstr(message, lum_effect_names[e]))
            fail_msg("%s is not in: %s", lum_effect_names[e], message);
    assert_refused(reply, "unknown_field", "effects/caustics");
    assert_refused(update_view(c, "{\"view_id\":1,\"effects\":{\"direct\":\"maybe\"}}"), "invalid_value",
                   "effects/direct");
    assert_refused(update_view(c, "{\"view_id\":1,\"effects\":[]}"), "invalid_value", "effects");
    assert_refused(update_view(c, "{\"view_id\":1,\"overlay\":\"guidance\"}"), "invalid_value", "overlay");
}

/* ais makes a map of indirect light, and its colours lie over the picture; path makes none, and its picture stays; of
 * both it is known how bright they are and where they are off. Either way no pass runs for it. */
static void an_overlay_is_display_only(void **state)
{
    static const struct {
        const char *choice, *overlay;
        bool map;
    } cases[] = {
        {"\"effects\":{\"indirect_diffuse\":\"on\"},\"method\":\"ais\"", "guidance_indirect_diffuse", true},
        {"\"method\":\"ais\"", "error", true},
        {"\"method\":\"path\"", "guidance_indirect_diffuse", false},
        {"\"method\":\"path\"", "error", true},
        {"\"method\":\"path\"", "luminance", true},
    };
    struct client *c = *state;
    uint8_t plain[W * H * 4], shown[W * H * 4];
    char params[160];
    client_open_view(c, LUM_CODEC_RGBA8);
    for (uint32_t i = 0, seq = 1; i < LUM_ARRAY_LEN(cases); i++, seq += 2) {
        struct lum_director_metrics before, after;
        snprintf(params, sizeof params, "{\"view_id\":1,%s,\"overlay\":\"none\",\"camera_seq\":%u}", cases[i].choice,
                 seq);
        assert_taken(update_view(c, params));
        sum_of_numbered(c, seq, plain);
        memcpy(shown, plain, sizeof plain);
        lum_director_metrics(c->director, &before);
        snprintf(params, sizeof params, "{\"view_id\":1,\"overlay\":\"%s\",\"camera_seq\":%u}", cases[i].overlay,
                 seq + 1);
        assert_taken(update_view(c, params));
        sum_of_numbered(c, seq + 1, shown);
        assert_int_equal(memcmp(shown, plain, sizeof plain) != 0, cases[i].map);
        lum_director_metrics(c->director, &after);
        assert_int_equal(after.passes, before.passes);
        assert_int_equal(after.rays, before.rays);
    }
}

/* The final frame.stats for camera number seq, once its frame has come. */
static const char *final_stats(struct client *c, uint32_t seq)
{
    uint8_t pixels[W * H * 4];
    char numbered[32];
    snprintf(numbered, sizeof numbered, "\"camera_seq\":%u,", seq);
    sum_of_numbered(c, seq, pixels);
    for (size_t i = 0;; i = c->n_texts) {
        client_listen(c);
        for (; i < c->n_texts; i++)
            if (strstr(c->texts[i], numbered) && strstr(c->texts[i], "\"converged\":true"))
                return c->texts[i];
        client_wait(c);
    }
}

/* A method whose one pass is the whole answer is measured, and says whether that is within a budget's error. Under a
 * ceiling `whitted` leaves out light. */
static void a_method_without_samples_is_judged(void **state)
{
    struct client *c = *state;
    client_apply(c, "[{\"op\":\"add\",\"type\":\"object\",\"id\":\"ceiling\",\"mesh\":\"plane\",\"material\":\"grey\","
                    "\"transform\":{\"translate\":[0,3,0],\"rotate_deg\":[180,0,0]}}]");
    client_open_view(c, LUM_CODEC_RGBA8);
    assert_taken(update_view(c, "{\"view_id\":1,\"method\":\"whitted\",\"budget\":{\"error\":10},\"camera_seq\":1}"));
    assert_non_null(strstr(final_stats(c, 1), "\"stopped_by\":\"error\",\"budget_verdict\":\"met\""));
    assert_taken(update_view(c, "{\"view_id\":1,\"budget\":{\"error\":0.0001},\"camera_seq\":2}"));
    assert_non_null(strstr(final_stats(c, 2), "\"stopped_by\":\"whole\",\"budget_verdict\":\"missed\""));
}

/* What shines below the floor lights nothing that is seen: no error is waited for. When it comes up, it is. */
static void a_black_picture_says_why_it_ends(void **state)
{
    struct client *c = *state;
    client_apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/position\",\"value\":[0,-2,0]}]");
    client_open_view(c, LUM_CODEC_RGBA8);
    assert_taken(update_view(c, "{\"view_id\":1,\"method\":\"path\",\"budget\":{\"error\":0.5},\"camera_seq\":1}"));
    const char *stats = final_stats(c, 1);
    assert_non_null(strstr(stats, "\"stopped_by\":\"black\",\"budget_verdict\":\"missed\""));
    assert_non_null(strstr(stats, "\"spp\":64,"));
    client_apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/position\",\"value\":[0,2,0]}]");
    assert_taken(update_view(c, "{\"view_id\":1,\"camera_seq\":2}"));
    assert_non_null(strstr(final_stats(c, 2), "\"stopped_by\":\"error\",\"budget_verdict\":\"met\""));
}

/* Of illuminance the picture is another one: passes run for it, and it is grey where there is no surface. Back, it is
 * the one that it was. */
static void illuminance_is_a_picture_of_its_own(void **state)
{
    struct client *c = *state;
    uint8_t plain[W * H * 4], shown[W * H * 4], again[W * H * 4];
    client_open_view(c, LUM_CODEC_RGBA8);
    assert_taken(update_view(c, "{\"view_id\":1,\"method\":\"whitted\",\"camera_seq\":1}"));
    sum_of_numbered(c, 1, plain);
    assert_taken(update_view(c, "{\"view_id\":1,\"overlay\":\"illuminance\",\"camera_seq\":2}"));
    memcpy(shown, plain, sizeof plain);
    sum_of_numbered(c, 2, shown);
    assert_memory_not_equal(shown, plain, sizeof plain);
    assert_taken(update_view(c, "{\"view_id\":1,\"overlay\":\"none\",\"camera_seq\":3}"));
    memcpy(again, shown, sizeof again);
    sum_of_numbered(c, 3, again);
    assert_memory_equal(again, plain, sizeof plain);
    assert_taken(update_view(c, "{\"view_id\":1,\"overlay\":\"illuminance\",\"camera_seq\":4}"));
    const char *stats = final_stats(c, 4);
    assert_non_null(strstr(stats, "\"overlay_map\":true"));
    assert_non_null(strstr(stats, "\"unit\":\"lx\""));
}

/* What a view's picture has in the middle; NAN: nothing. */
static double read_middle(struct client *c, const char *unit)
{
    cJSON *reply = client_ask_text(c, "view.read", "{\"view_id\":1,\"x\":20,\"y\":15}"),
          *result = cJSON_GetObjectItem(reply, "result");
    const cJSON *value = cJSON_GetObjectItem(result, "value");
    assert_string_equal(cJSON_GetObjectItem(result, "unit")->valuestring, unit);
    double number = cJSON_IsNumber(value) ? value->valuedouble : (double)NAN;
    cJSON_Delete(reply);
    return number;
}

/* The picture's value is told at any pixel without a ray: of a surface that reflects less than all, luminance is less
 * than illuminance / pi; of what is no surface there is no illuminance. */
static void values_are_read_off_the_picture(void **state)
{
    struct client *c = *state;
    struct lum_director_metrics before, after;
    client_open_view(c, LUM_CODEC_RGBA8);
    assert_taken(update_view(c, "{\"view_id\":1,\"method\":\"whitted\",\"camera_seq\":1}"));
    final_stats(c, 1);
    lum_director_metrics(c->director, &before);
    double luminance = read_middle(c, "cd/m2");
    lum_director_metrics(c->director, &after);
    assert_int_equal(after.rays, before.rays);
    assert_taken(update_view(c, "{\"view_id\":1,\"overlay\":\"illuminance\",\"camera_seq\":2}"));
    final_stats(c, 2);
    double illuminance = read_middle(c, "lx");
    assert_true(luminance > 0.0 && luminance < illuminance / 3.14159265358979);
    assert_taken(
        update_view(c, "{\"view_id\":1,\"camera\":{\"position\":[0,50,0],\"target\":[0,60,1]},\"camera_seq\":3}"));
    final_stats(c, 3);
    assert_true(isnan(read_middle(c, "lx")));
    assert_refused(client_ask_text(c, "view.read", "{\"view_id\":1,\"x\":1,\"y\":4000}"), "invalid_value", "y");
    assert_refused(client_ask_text(c, "view.read", "{\"view_id\":9,\"x\":1,\"y\":1}"), "not_found", "view_id");
}

static void assert_in_view(struct client *c, uint32_t seq, const char *wanted)
{
    char told[32];
    snprintf(told, sizeof told, "\"in_view\":\"%s\"", wanted);
    const char *stats = final_stats(c, seq);
    if (!strstr(stats, told))
        fail_msg("camera %u: not %s in %s", seq, told, stats);
}

static void an_empty_picture_is_explained(void **state)
{
    struct client *c = *state;
    client_open_view(c, LUM_CODEC_RGBA8);
    assert_taken(update_view(c, "{\"view_id\":1,\"method\":\"whitted\",\"camera_seq\":1}"));
    assert_in_view(c, 1, "scene");
    assert_taken(
        update_view(c, "{\"view_id\":1,\"camera\":{\"position\":[0,50,0],\"target\":[0,60,1]},\"camera_seq\":2}"));
    assert_in_view(c, 2, "nothing");
    assert_taken(update_view(c, "{\"view_id\":1,\"camera_id\":\"main\",\"camera_seq\":3}"));
    assert_in_view(c, 3, "scene");
    client_apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/on\",\"value\":false}]");
    assert_taken(update_view(c, "{\"view_id\":1,\"camera_seq\":4}"));
    assert_in_view(c, 4, "dark");
}

/* caustics of the final frame.stats for camera number seq; delete it. */
static cJSON *caustics(struct client *c, uint32_t seq)
{
    char params[48];
    snprintf(params, sizeof params, "{\"view_id\":1,\"camera_seq\":%u}", seq);
    assert_taken(update_view(c, params));
    cJSON *json = cJSON_Parse(final_stats(c, seq));
    cJSON *caustics = cJSON_DetachItemFromObject(cJSON_GetObjectItem(json, "params"), "caustics");
    cJSON_Delete(json);
    assert_true(cJSON_IsObject(caustics));
    return caustics;
}

static double number(const cJSON *o, const char *key)
{
    return cJSON_GetObjectItem(o, key)->valuedouble;
}

/* It is there when the picture rests, for the scene that the picture shows; and is no part of the picture's rays. */
static void light_that_mirrors_send_on_is_told_at_rest(void **state)
{
    struct client *c = *state;
    client_open_view(c, LUM_CODEC_RGBA8);
    cJSON *told = caustics(c, 1);
    assert_true(number(told, "share") == 0.0 && number(told, "rays") == 0.0); /* no mirror */
    assert_string_equal(cJSON_GetObjectItem(told, "why")->valuestring, "");
    cJSON_Delete(told);
    uint64_t rev = client_apply(
        c, "[{\"op\":\"add\",\"type\":\"material\",\"id\":\"silver\",\"metallic\":1,\"roughness\":0},"
           "{\"op\":\"add\",\"type\":\"object\",\"id\":\"ceiling\",\"mesh\":\"plane\",\"material\":\"silver\","
           "\"transform\":{\"translate\":[0,3,0]}}]");
    told = caustics(c, 2);
    double share = number(told, "share"), focused_lm = number(told, "focused_lm");
    assert_true(share > 0.1 && share < 0.5);
    assert_true(number(told, "scene_rev") == (double)rev);
    assert_non_null(strstr(cJSON_GetObjectItem(told, "why")->valuestring, "of the light of lamp is in no picture"));
    cJSON_Delete(told);
    rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":50}]");
    told = caustics(c, 3);
    assert_true(number(told, "rays") == 0.0 && number(told, "scene_rev") == (double)rev);
    assert_true(fabs(number(told, "focused_lm") / focused_lm - 0.5) < 1e-6);
    cJSON_Delete(told);
    client_apply(c, "[{\"op\":\"set\",\"id\":\"silver\",\"path\":\"/roughness\",\"value\":0.5}]");
    told = caustics(c, 4);
    assert_true(number(told, "share") == 0.0);
    cJSON_Delete(told);
}

static void requests_that_name_nothing_are_refused(void **state)
{
    struct client *c = *state;
    struct lum_request *request = client_request(c, &lum_request_view_update);
    request->view_id = 99;
    assert_refused(client_ask(c, request), "not_found", "view_id");
    request = client_request(c, &lum_request_view_open);
    request->view =
        (struct lum_view_params){.given = LUM_VIEW_BIT(SIZE) | LUM_VIEW_BIT(METHOD), .size = {8, 8}, .method = "magic"};
    assert_refused(client_ask(c, request), "invalid_value", "method");
    request = client_request(c, &lum_request_view_open);
    request->view = (struct lum_view_params){
        .given = LUM_VIEW_BIT(SIZE) | LUM_VIEW_BIT(CAMERA_ID), .size = {8, 8}, .camera_id = "nobody"};
    assert_refused(client_ask(c, request), "not_found", "camera_id");
    uint32_t id = client_open_view(c, LUM_CODEC_JPEG);
    request = client_request(c, &lum_request_view_close);
    request->view_id = id;
    request->session.generation++; /* somebody else's view */
    assert_refused(client_ask(c, request), "not_found", "view_id");
}

/* A picture at rest grows to what is asked for, from as many samples on as it has, and ends so; pixels are read in the
 * size that moves. The next change is shown in that again. */
static void at_rest_the_picture_is_larger(void **state)
{
    struct client *c = *state;
    struct lum_request *request = client_request(c, &lum_request_view_open);
    request->view = (struct lum_view_params){
        .given = LUM_VIEW_BIT(SIZE) | LUM_VIEW_BIT(REST_SIZE), .size = {W, H}, .rest_size = {2 * W + 1, 2 * H + 1}};
    cJSON_Delete(client_ask(c, request));
    struct lum_frame_header h = client_next_frame(c, NULL);
    uint32_t spp = 0;
    assert_int_equal(h.full_w, W);
    for (; !(h.flags & LUM_FRAME_CONVERGED); h = client_next_frame(c, NULL)) {
        assert_true(h.spp >= spp);
        assert_true(h.full_w == W || h.full_w == 2 * W + 1);
        spp = h.spp;
    }
    assert_int_equal(h.full_w, 2 * W + 1);
    assert_int_equal(h.full_h, 2 * H + 1);
    cJSON *reply = client_ask_text(c, "view.read", "{\"view_id\":1,\"x\":39,\"y\":29}");
    assert_true(cJSON_IsNumber(cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "result"), "value")));
    cJSON_Delete(reply);
    assert_refused(client_ask_text(c, "view.read", "{\"view_id\":1,\"x\":40,\"y\":29}"), "invalid_value", "x");
    uint64_t rev = client_apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":10}]");
    do
        h = client_next_frame(c, NULL);
    while (h.scene_rev < rev);
    assert_int_equal(h.full_w, W);
    assert_int_equal(client_converged_frame(c, rev, NULL).full_w, 2 * W + 1);
    assert_taken(update_view(c, "{\"view_id\":1,\"rest_size\":[40,30],\"camera_seq\":9}"));
    do
        h = client_next_frame(c, NULL);
    while (h.camera_seq < 9 || !(h.flags & LUM_FRAME_CONVERGED));
    assert_int_equal(h.full_w, W);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(white_balance_costs_no_ray, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(the_latest_camera_wins, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(a_larger_budget_resumes, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(at_rest_the_picture_is_larger, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(effects_are_forced_and_given_back, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(a_method_without_samples_is_judged, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(a_black_picture_says_why_it_ends, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(a_spent_time_leaves_a_whole_picture, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(a_time_holds_for_what_is_new, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(samples_end_what_a_budget_does_not, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(effects_that_do_not_exist_are_refused, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(an_overlay_is_display_only, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(illuminance_is_a_picture_of_its_own, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(values_are_read_off_the_picture, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(an_empty_picture_is_explained, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(light_that_mirrors_send_on_is_told_at_rest, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(requests_that_name_nothing_are_refused, client_setup, client_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
