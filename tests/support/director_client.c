#define _GNU_SOURCE /* mkstemps */
#include "tests/support/director_client.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "protocol/op/op.h"
#include "server/director/read_request.h"

static const char scene_text[] =
    "{\"lumend\":1,\"kind\":\"scene\"}\n"
    "{\"op\":\"add\",\"type\":\"material\",\"id\":\"grey\",\"base_color\":[0.5,0.5,0.5]}\n"
    "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"plane\",\"shape\":\"quad\",\"size\":[4,0,4]}\n"
    "{\"op\":\"add\",\"type\":\"object\",\"id\":\"floor\",\"mesh\":\"plane\",\"material\":\"grey\"}\n"
    "{\"op\":\"add\",\"type\":\"light\",\"id\":\"lamp\",\"kind\":\"point\",\"position\":[0,2,0],\"intensity_cd\":100}\n"
    "{\"op\":\"add\",\"type\":\"camera\",\"id\":\"main\",\"position\":[0,2,4],\"target\":[0,0,0]}\n"
    "{\"op\":\"set\",\"id\":\"render\",\"path\":\"/exposure_ev\",\"value\":5}\n"
    "{\"op\":\"set\",\"id\":\"render\",\"path\":\"/spp\",\"value\":16}\n";

static void wake(void *user)
{
    struct client *c = user;
    if (c->on_said)
        c->on_said(c);
    pthread_mutex_lock(&c->lock);
    c->rung = true;
    pthread_cond_signal(&c->bell);
    pthread_mutex_unlock(&c->lock);
}

void client_listen(struct client *c)
{
    struct lum_out *out = lum_director_take_outbox(c->director);
    while (out) {
        struct lum_out *next = out->next;
        if (out->kind == LUM_OUT_VIEW_OPENED) {
            assert_true(c->n_streams < MAX_STREAMS);
            c->streams[c->n_streams++] = out->stream;
            out->stream = NULL;
        } else if (out->text) {
            assert_true(c->n_texts < MAX_TEXTS);
            c->texts[c->n_texts++] = out->text;
            out->text = NULL;
        }
        lum_out_destroy(out);
        out = next;
    }
}

void client_wait(struct client *c)
{
    pthread_mutex_lock(&c->lock);
    while (!c->rung)
        pthread_cond_wait(&c->bell, &c->lock);
    c->rung = false;
    pthread_mutex_unlock(&c->lock);
}

static void call_then(struct client *c)
{
    c->on_said = NULL;
    c->then(c);
}

static void hold(struct client *c)
{
    sem_post(&c->held);
    sem_wait(&c->released);
    c->on_said = c->then ? call_then : NULL;
}

void client_hold(struct client *c)
{
    cJSON_Delete(client_ask(c, client_request(c, &lum_request_stats_get))); /* nothing of before is said any more */
    c->on_said = hold;
    assert_true(lum_director_post(c->director, client_request(c, &lum_request_stats_get)));
    sem_wait(&c->held);
}

void client_release(struct client *c, void (*then)(struct client *c))
{
    c->then = then;
    sem_post(&c->released);
}

static int set_up(void **state, const char *importer, const char *state_dir, const struct lum_disk *disk)
{
    struct client *c = calloc(1, sizeof *c);
    assert_non_null(c);
    pthread_mutex_init(&c->lock, NULL);
    pthread_cond_init(&c->bell, NULL);
    sem_init(&c->held, 0, 0);
    sem_init(&c->released, 0, 0);
    c->session = (struct lum_session_ref){3, 1};
    snprintf(c->path, sizeof c->path, "/tmp/lumend-director-XXXXXX.jsonl");
    int fd = mkstemps(c->path, 6);
    assert_true(fd >= 0 && write(fd, scene_text, sizeof scene_text - 1) == sizeof scene_text - 1);
    close(fd);
    struct lum_director_config config = {.scene = c->path,
                                         .assets_dir = "/tmp",
                                         .importer = importer,
                                         .state_dir = state_dir,
                                         .state_disk = disk,
                                         .method = "path",
                                         .threads = 2,
                                         .wake_net = wake,
                                         .wake_user = c};
    struct lum_error err;
    if (lum_director_create(&config, &c->director, &err))
        fail_msg("%s", err.text);
    *state = c;
    return 0;
}

int client_setup_with(void **state, const char *importer)
{
    return set_up(state, importer, NULL, NULL);
}

int client_setup_saved(void **state, const char *state_dir, const struct lum_disk *disk)
{
    return set_up(state, "/bin/false", state_dir, disk);
}

int client_setup(void **state)
{
    return client_setup_with(state, "/bin/false");
}

int client_teardown(void **state)
{
    struct client *c = *state;
    lum_director_destroy(c->director);
    for (uint32_t i = 0; i < c->n_streams; i++)
        lum_stream_unref(c->streams[i]);
    for (size_t i = 0; i < c->n_texts; i++)
        free(c->texts[i]);
    unlink(c->path);
    if (c->importer[0])
        unlink(c->importer);
    pthread_cond_destroy(&c->bell);
    pthread_mutex_destroy(&c->lock);
    sem_destroy(&c->held);
    sem_destroy(&c->released);
    free(c);
    return 0;
}

struct lum_request *client_request(struct client *c, const struct lum_request_type *type)
{
    struct lum_request *request = lum_request_create(type);
    assert_non_null(request);
    request->session = c->session;
    strcpy(request->user, "tester");
    request->received_ns = lum_clock_ns();
    char id[24];
    snprintf(id, sizeof id, "%llu", (unsigned long long)++c->next_id);
    request->rpc_id = strdup(id);
    return request;
}

cJSON *client_reply(struct client *c, uint64_t id)
{
    for (size_t i = 0;;) {
        client_listen(c);
        for (; i < c->n_texts; i++) {
            cJSON *json = cJSON_Parse(c->texts[i]);
            const cJSON *got = cJSON_GetObjectItem(json, "id");
            if (cJSON_IsNumber(got) && got->valuedouble == (double)id)
                return json;
            cJSON_Delete(json);
        }
        client_wait(c);
    }
}

cJSON *client_ask(struct client *c, struct lum_request *request)
{
    uint64_t id = c->next_id;
    assert_true(lum_director_post(c->director, request));
    return client_reply(c, id);
}

struct lum_request *client_edit(struct client *c, const char *ops)
{
    struct lum_request *request = client_request(c, &lum_request_scene_apply);
    struct lum_proto_error err;
    cJSON *json = cJSON_Parse(ops);
    if (!json || !lum_ops_from_json(json, &request->ops, &err))
        fail_msg("%s: %s", ops, err.text);
    cJSON_Delete(json);
    return request;
}

uint64_t scene_rev_of(cJSON *reply)
{
    const cJSON *rev = cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "result"), "scene_rev");
    if (!rev) {
        char *text = cJSON_PrintUnformatted(reply);
        fail_msg("no scene_rev in %s", text);
    }
    uint64_t value = (uint64_t)rev->valuedouble;
    cJSON_Delete(reply);
    return value;
}

void assert_refused(cJSON *reply, const char *app, const char *path)
{
    const cJSON *data = cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "error"), "data");
    if (!data)
        fail_msg("not refused");
    assert_string_equal(cJSON_GetObjectItem(data, "code")->valuestring, app);
    if (path)
        assert_string_equal(cJSON_GetObjectItem(data, "path")->valuestring, path);
    cJSON_Delete(reply);
}

uint32_t client_open_view(struct client *c, enum lum_codec codec)
{
    struct lum_request *request = client_request(c, &lum_request_view_open);
    request->view = (struct lum_view_params){.given = LUM_VIEW_BIT(SIZE) | LUM_VIEW_BIT(CODEC), .size = {W, H}};
    strcpy(request->view.codec, lum_codec_name(codec));
    uint32_t before = c->n_streams;
    cJSON *reply = client_ask(c, request);
    assert_int_equal(c->n_streams, before + 1); /* the stream comes before the reply that names it */
    const cJSON *id = cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "result"), "view_id");
    assert_non_null(id);
    uint32_t view_id = (uint32_t)id->valuedouble;
    assert_int_equal(lum_stream_view_id(c->streams[before]), view_id);
    cJSON_Delete(reply);
    return view_id;
}

struct lum_frame_header client_next_frame(struct client *c, uint8_t *pixels)
{
    struct lum_stream *s = c->streams[0];
    for (;;) {
        struct lum_stream_tile t;
        while (!lum_stream_next(s, &t)) {
            client_wait(c);
            client_listen(c);
        }
        if (pixels && t.header.codec == LUM_CODEC_RGBA8 && t.header.downscale == 0)
            for (uint32_t y = 0; y < t.header.h; y++)
                memcpy(pixels + ((size_t)(t.header.y + y) * W + t.header.x) * 4,
                       t.blob->bytes + (size_t)y * t.header.w * 4, (size_t)t.header.w * 4);
        lum_encoded_tile_unref(t.blob);
        if (t.header.flags & LUM_FRAME_LAST_TILE) {
            lum_stream_ack(s, t.header.frame_seq, 0);
            assert_true(lum_director_post(c->director, lum_request_create(&lum_request_wake)));
            return t.header;
        }
    }
}

struct lum_frame_header client_converged_frame(struct client *c, uint64_t scene_rev, uint8_t *pixels)
{
    for (;;) {
        struct lum_frame_header h = client_next_frame(c, pixels);
        if (h.scene_rev >= scene_rev && (h.flags & LUM_FRAME_CONVERGED))
            return h;
    }
}

uint64_t client_apply(struct client *c, const char *ops)
{
    return scene_rev_of(client_ask(c, client_edit(c, ops)));
}

cJSON *client_ask_text(struct client *c, const char *method, const char *params)
{
    char text[512];
    struct lum_rpc rpc;
    struct lum_proto_error err;
    snprintf(text, sizeof text, "{\"jsonrpc\":\"2.0\",\"id\":%llu,\"method\":\"%s\",\"params\":%s}",
             (unsigned long long)++c->next_id, method, params);
    assert_true(lum_rpc_parse(text, strlen(text), &rpc, &err));
    struct lum_request *request = lum_request_read(&rpc, LUM_ROLE_ADMIN, &err);
    cJSON *reply = NULL;
    if (request) {
        request->session = c->session;
        request->received_ns = lum_clock_ns();
        reply = client_ask(c, request);
    } else {
        char *error = lum_rpc_error(rpc.id, &err);
        reply = cJSON_Parse(error);
        free(error);
    }
    lum_rpc_finish(&rpc);
    return reply;
}

void assert_taken(cJSON *reply)
{
    if (!cJSON_GetObjectItem(reply, "result")) {
        char *text = cJSON_PrintUnformatted(reply);
        fail_msg("%s", text);
    }
    cJSON_Delete(reply);
}
