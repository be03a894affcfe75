/* The director without sockets: commands in, texts and frames out. Nothing sleeps: waiting ends when the director wakes
 * the "net thread", or with ctest's own time limit. */
#define _GNU_SOURCE /* mkdtemp, mkstemps */
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "protocol/json.h"
#include "protocol/op.h"
#include "protocol/rpc.h"
#include "server/director_internal.h"
#include "server/methods.h"

enum { W = 40, H = 30, MAX_STREAMS = 4, MAX_TEXTS = 4096 };

static const char scene_text[] =
    "{\"lumend\":1,\"kind\":\"scene\"}\n"
    "{\"op\":\"add\",\"type\":\"material\",\"id\":\"grey\",\"base_color\":[0.5,0.5,0.5]}\n"
    "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"plane\",\"shape\":\"quad\",\"size\":[4,0,4]}\n"
    "{\"op\":\"add\",\"type\":\"object\",\"id\":\"floor\",\"mesh\":\"plane\",\"material\":\"grey\"}\n"
    "{\"op\":\"add\",\"type\":\"light\",\"id\":\"lamp\",\"kind\":\"point\",\"position\":[0,2,0],\"intensity_cd\":100}\n"
    "{\"op\":\"add\",\"type\":\"camera\",\"id\":\"main\",\"position\":[0,2,4],\"target\":[0,0,0]}\n"
    "{\"op\":\"set\",\"id\":\"render\",\"path\":\"/exposure_ev\",\"value\":5}\n"
    "{\"op\":\"set\",\"id\":\"render\",\"path\":\"/spp\",\"value\":16}\n";

struct client {
    struct lum_director *director;
    struct lum_session_ref session;
    pthread_mutex_t lock;
    pthread_cond_t bell;
    bool rung; /* guarded by lock */
    struct lum_stream *streams[MAX_STREAMS];
    uint32_t n_streams;
    char *texts[MAX_TEXTS]; /* everything said, in order */
    size_t n_texts;
    uint64_t next_id;
    char path[64], importer[64]; /* files to remove */
};

static void wake(void *user)
{
    struct client *c = user;
    pthread_mutex_lock(&c->lock);
    c->rung = true;
    pthread_cond_signal(&c->bell);
    pthread_mutex_unlock(&c->lock);
}

/* Takes what the director said. */
static void listen(struct client *c)
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

static void wait_for_bell(struct client *c)
{
    pthread_mutex_lock(&c->lock);
    while (!c->rung)
        pthread_cond_wait(&c->bell, &c->lock);
    c->rung = false;
    pthread_mutex_unlock(&c->lock);
}

static int setup_with(void **state, const char *importer)
{
    struct client *c = calloc(1, sizeof *c);
    assert_non_null(c);
    pthread_mutex_init(&c->lock, NULL);
    pthread_cond_init(&c->bell, NULL);
    c->session = (struct lum_session_ref){3, 1};
    snprintf(c->path, sizeof c->path, "/tmp/lumend-director-XXXXXX.jsonl");
    int fd = mkstemps(c->path, 6);
    assert_true(fd >= 0 && write(fd, scene_text, sizeof scene_text - 1) == sizeof scene_text - 1);
    close(fd);
    struct lum_director_config config = {.scene = c->path,
                                         .assets_dir = "/tmp",
                                         .importer = importer,
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

static int setup(void **state)
{
    return setup_with(state, "/bin/false");
}

/* With an importer that never ends by itself. */
static int setup_stuck_importer(void **state)
{
    static const char script[] = "#!/bin/sh\nexec sleep 1000\n";
    char path[] = "/tmp/lumend-importer-XXXXXX";
    int fd = mkstemp(path);
    assert_true(fd >= 0 && write(fd, script, sizeof script - 1) == sizeof script - 1 && fchmod(fd, 0700) == 0);
    close(fd);
    int failed = setup_with(state, path);
    snprintf(((struct client *)*state)->importer, sizeof((struct client *)*state)->importer, "%s", path);
    return failed;
}

static int setup_importer(void **state)
{
    return setup_with(state, LUMEND_IMPORT);
}

static int teardown(void **state)
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
    free(c);
    return 0;
}

/* ---- talking ---- */

static struct lum_command *command(struct client *c, enum lum_command_kind kind)
{
    struct lum_command *cmd = lum_command_create(kind);
    assert_non_null(cmd);
    cmd->session = c->session;
    strcpy(cmd->user, "tester");
    cmd->received_ns = lum_clock_ns();
    char id[24];
    snprintf(id, sizeof id, "%llu", (unsigned long long)++c->next_id);
    cmd->rpc_id = strdup(id);
    return cmd;
}

/* Waits for the reply to request id; the whole message. */
static cJSON *wait_for_reply(struct client *c, uint64_t id)
{
    for (size_t i = 0;;) {
        listen(c);
        for (; i < c->n_texts; i++) {
            cJSON *json = cJSON_Parse(c->texts[i]);
            const cJSON *got = cJSON_GetObjectItem(json, "id");
            if (cJSON_IsNumber(got) && got->valuedouble == (double)id)
                return json;
            cJSON_Delete(json);
        }
        wait_for_bell(c);
    }
}

static cJSON *ask(struct client *c, struct lum_command *cmd)
{
    uint64_t id = c->next_id;
    assert_true(lum_director_post(c->director, cmd));
    return wait_for_reply(c, id);
}

static struct lum_command *apply_command(struct client *c, const char *ops)
{
    struct lum_command *cmd = command(c, LUM_CMD_SCENE_APPLY);
    struct lum_proto_error err;
    cJSON *json = cJSON_Parse(ops);
    if (!json || !lum_ops_from_json(json, &cmd->ops, &err))
        fail_msg("%s: %s", ops, err.text);
    cJSON_Delete(json);
    return cmd;
}

static uint64_t scene_rev_of(cJSON *reply)
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

/* Checks that the reply is this error, and drops it. */
static void assert_refused(cJSON *reply, const char *app, const char *path)
{
    const cJSON *data = cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "error"), "data");
    if (!data)
        fail_msg("not refused");
    assert_string_equal(cJSON_GetObjectItem(data, "code")->valuestring, app);
    if (path)
        assert_string_equal(cJSON_GetObjectItem(data, "path")->valuestring, path);
    cJSON_Delete(reply);
}

static uint32_t open_view(struct client *c, uint8_t codec)
{
    struct lum_command *cmd = command(c, LUM_CMD_VIEW_OPEN);
    cmd->view.has_size = cmd->view.has_codec = true;
    cmd->view.w = W;
    cmd->view.h = H;
    cmd->view.codec = codec;
    uint32_t before = c->n_streams;
    cJSON *reply = ask(c, cmd);
    assert_int_equal(c->n_streams, before + 1); /* the stream comes before the reply that names it */
    const cJSON *id = cJSON_GetObjectItem(cJSON_GetObjectItem(reply, "result"), "view_id");
    assert_non_null(id);
    uint32_t view_id = (uint32_t)id->valuedouble;
    assert_int_equal(lum_stream_view_id(c->streams[before]), view_id);
    cJSON_Delete(reply);
    return view_id;
}

/* The next whole frame of the first stream, acknowledged; its last header. pixels (may be NULL) gets RGBA8 tiles
 * of full size: a rough first pass comes downscaled. */
static struct lum_frame_header next_frame(struct client *c, uint8_t *pixels)
{
    struct lum_stream *s = c->streams[0];
    for (;;) {
        struct lum_stream_tile t;
        while (!lum_stream_next(s, &t)) {
            wait_for_bell(c);
            listen(c);
        }
        if (pixels && t.header.codec == LUM_CODEC_RGBA8 && t.header.downscale == 0)
            for (uint32_t y = 0; y < t.header.h; y++)
                memcpy(pixels + ((size_t)(t.header.y + y) * W + t.header.x) * 4,
                       t.blob->bytes + (size_t)y * t.header.w * 4, (size_t)t.header.w * 4);
        lum_blob_tile_unref(t.blob);
        if (t.header.flags & LUM_FRAME_LAST_TILE) {
            lum_stream_ack(s, t.header.frame_seq);
            assert_true(lum_director_post(c->director, lum_command_create(LUM_CMD_WAKE)));
            return t.header;
        }
    }
}

static struct lum_frame_header converged_frame(struct client *c, uint64_t scene_rev, uint8_t *pixels)
{
    for (;;) {
        struct lum_frame_header h = next_frame(c, pixels);
        if (h.scene_rev >= scene_rev && (h.flags & LUM_FRAME_CONVERGED))
            return h;
    }
}

/* ---- tests ---- */

static void a_view_gets_frames_until_it_converged(void **state)
{
    struct client *c = *state;
    uint32_t id = open_view(c, LUM_CODEC_JPEG);
    uint64_t seq = 0;
    uint16_t spp = 0;
    struct lum_frame_header h;
    do {
        h = next_frame(c, NULL);
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

static uint64_t apply(struct client *c, const char *ops)
{
    return scene_rev_of(ask(c, apply_command(c, ops)));
}

static long sum_of_converged(struct client *c, uint64_t scene_rev)
{
    uint8_t pixels[W * H * 4];
    long sum = 0;
    converged_frame(c, scene_rev, pixels);
    for (size_t i = 0; i < sizeof pixels; i++)
        sum += pixels[i];
    return sum;
}

static void an_edit_shows_under_its_revision(void **state)
{
    struct client *c = *state;
    open_view(c, LUM_CODEC_RGBA8);
    uint64_t before = lum_director_scene_rev(c->director);
    long bright = sum_of_converged(c, before);
    uint64_t rev = apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":10}]");
    assert_int_equal(rev, before + 1);
    assert_int_equal(lum_director_scene_rev(c->director), rev);
    assert_true(sum_of_converged(c, rev) < bright);
}

/* Automatic exposure follows the camera, not the lamps: dimming must show. */
static void a_dimmed_lamp_is_darker_under_automatic_exposure(void **state)
{
    struct client *c = *state;
    uint64_t rev = apply(c, "[{\"op\":\"set\",\"id\":\"render\",\"path\":\"/exposure_ev\",\"value\":null}]");
    open_view(c, LUM_CODEC_RGBA8);
    long bright = sum_of_converged(c, rev);
    rev = apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":10}]");
    assert_true(sum_of_converged(c, rev) < bright);
}

static void balance(struct client *c, uint32_t view_id, struct lum_opt kelvin)
{
    struct lum_command *cmd = command(c, LUM_CMD_VIEW_UPDATE);
    cmd->view = (struct lum_view_request){.view_id = view_id, .has_white_balance = true, .white_balance_k = kelvin};
    cJSON_Delete(ask(c, cmd));
}

static void white_balance_costs_no_ray(void **state)
{
    struct client *c = *state;
    static uint8_t plain[W * H * 4], cool[W * H * 4], again[W * H * 4];
    struct lum_director_metrics before, after;
    uint32_t id = open_view(c, LUM_CODEC_RGBA8);
    converged_frame(c, 0, plain);
    lum_director_metrics(c->director, &before);
    memcpy(cool, plain, sizeof cool);
    balance(c, id, (struct lum_opt){true, 3000.0});
    converged_frame(c, 0, cool);
    long red = 0, blue = 0;
    for (size_t i = 0; i < sizeof plain; i += 4) {
        red += cool[i] - plain[i];
        blue += cool[i + 2] - plain[i + 2];
    }
    assert_true(red < 0 && blue > 0);
    memcpy(again, cool, sizeof again);
    balance(c, id, (struct lum_opt){0});
    converged_frame(c, 0, again);
    assert_memory_equal(plain, again, sizeof plain);
    lum_director_metrics(c->director, &after);
    assert_true(after.passes == before.passes && after.rays == before.rays);
}

static void everybody_hears_of_an_edit(void **state)
{
    struct client *c = *state;
    struct lum_command *cmd = apply_command(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/on\",\"value\":false}]");
    strcpy(cmd->op_id, "op-1");
    scene_rev_of(ask(c, cmd));
    for (;;) {
        listen(c);
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
        wait_for_bell(c);
    }
}

static void the_latest_camera_wins(void **state)
{
    struct client *c = *state;
    uint32_t id = open_view(c, LUM_CODEC_JPEG);
    enum { MOVES = 200 };
    for (uint32_t i = 1; i <= MOVES; i++) {
        struct lum_command *cmd = lum_command_create(LUM_CMD_VIEW_UPDATE);
        assert_non_null(cmd);
        cmd->session = c->session;
        cmd->received_ns = lum_clock_ns();
        cmd->view = (struct lum_view_request){.view_id = id,
                                              .has_camera = true,
                                              .has_camera_seq = true,
                                              .camera_seq = i,
                                              .position = {0.01 * i, 2, 4},
                                              .up = {0, 1, 0},
                                              .vfov_deg = 40};
        assert_true(lum_director_post(c->director, cmd));
    }
    uint32_t seq = 0;
    struct lum_frame_header h;
    do {
        h = next_frame(c, NULL);
        assert_true(h.camera_seq >= seq);
        seq = h.camera_seq;
    } while (!(h.flags & LUM_FRAME_CONVERGED));
    assert_int_equal(seq, MOVES);
}

static void undo_and_redo_bring_the_picture_back(void **state)
{
    struct client *c = *state;
    static uint8_t first[W * H * 4], moved[W * H * 4], undone[W * H * 4], redone[W * H * 4];
    static const char *const edits[] = {
        "[{\"op\":\"set\",\"id\":\"floor\",\"path\":\"/transform/translate\",\"value\":[0,0.5,0]}]",
        "[{\"op\":\"add\",\"type\":\"medium\",\"id\":\"fog\",\"sigma_s\":[0.1,0.2,0.3]}]",
        "[{\"op\":\"set\",\"id\":\"fog\",\"path\":\"/g\",\"value\":0.9}]",
        "[{\"op\":\"remove\",\"id\":\"fog\"}]",
    };
    open_view(c, LUM_CODEC_RGBA8);
    converged_frame(c, 0, first);
    for (size_t i = 0; i < sizeof edits / sizeof *edits; i++) {
        uint64_t rev = scene_rev_of(ask(c, apply_command(c, edits[i])));
        memcpy(moved, first, sizeof moved); /* tiles that do not change are not sent */
        converged_frame(c, rev, moved);
        assert_memory_not_equal(first, moved, sizeof first);
        memcpy(undone, moved, sizeof undone);
        converged_frame(c, scene_rev_of(ask(c, command(c, LUM_CMD_SCENE_UNDO))), undone);
        assert_memory_equal(first, undone, sizeof first);
        memcpy(redone, undone, sizeof redone);
        converged_frame(c, scene_rev_of(ask(c, command(c, LUM_CMD_SCENE_REDO))), redone);
        assert_memory_equal(moved, redone, sizeof moved);
        assert_refused(ask(c, command(c, LUM_CMD_SCENE_REDO)), "not_found", NULL);
        memcpy(first, moved, sizeof first);
    }
}

static char *scene_text_of(struct client *c)
{
    cJSON *reply = ask(c, command(c, LUM_CMD_SCENE_GET));
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
    assert_refused(ask(c, apply_command(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/intensity_cd\",\"value\":7},"
                                           "{\"op\":\"remove\",\"id\":\"nobody\"}]")),
                   "not_found", NULL);
    assert_refused(
        ask(c, apply_command(c, "[{\"op\":\"remove\",\"id\":\"floor\"},"
                                "{\"op\":\"set\",\"id\":\"render\",\"path\":\"/method\",\"value\":\"magic\"}]")),
        "unsupported", "ops/1/method");
    char *after = scene_text_of(c);
    assert_string_equal(before, after);
    free(before);
    free(after);
    /* and the renderer still has the floor: a view shows it */
    uint32_t id = open_view(c, LUM_CODEC_JPEG);
    struct lum_command *pick = command(c, LUM_CMD_PICK);
    pick->view_id = id;
    pick->x = W / 2;
    pick->y = H / 2;
    cJSON *reply = ask(c, pick);
    const cJSON *result = cJSON_GetObjectItem(reply, "result");
    assert_string_equal(cJSON_GetObjectItem(result, "id")->valuestring, "floor");
    cJSON_Delete(reply);
}

static void a_stale_base_revision_is_refused(void **state)
{
    struct client *c = *state;
    struct lum_command *cmd = apply_command(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/on\",\"value\":false}]");
    cmd->has_base_rev = true;
    cmd->base_rev = lum_director_scene_rev(c->director) + 1;
    assert_refused(ask(c, cmd), "rev_conflict", "base_rev");
}

/* The importer is /bin/false: it dies at once. */
static void a_failed_import_changes_nothing(void **state)
{
    struct client *c = *state;
    uint64_t before = lum_director_scene_rev(c->director);
    char op[160];
    snprintf(op, sizeof op, "[{\"op\":\"import\",\"id\":\"room\",\"asset\":\"%s\"}]", strrchr(c->path, '/') + 1);
    assert_refused(ask(c, apply_command(c, op)), "import_failed", NULL);
    assert_int_equal(lum_director_scene_rev(c->director), before);
    assert_int_equal(scene_rev_of(ask(c, apply_command(c, "[{\"op\":\"remove\",\"id\":\"lamp\"}]"))), before + 1);
    struct lum_director_metrics m;
    lum_director_metrics(c->director, &m);
    assert_int_equal(m.imports_failed, 1);
}

static void waiting_imports_are_limited(void **state)
{
    struct client *c = *state;
    char op[160];
    snprintf(op, sizeof op, "[{\"op\":\"import\",\"id\":\"room\",\"asset\":\"%s\"}]", strrchr(c->path, '/') + 1);
    for (uint32_t i = 0; i < LUM_LIMIT_IMPORTS_WAITING; i++)
        assert_true(lum_director_post(c->director, apply_command(c, op)));
    assert_refused(ask(c, apply_command(c, op)), "busy", "ops");
    /* none of those before was refused, and other edits go on */
    for (size_t i = 0; i < c->n_texts; i++)
        assert_true(!strstr(c->texts[i], "\"error\"") || strstr(c->texts[i], "\"busy\""));
    scene_rev_of(ask(c, apply_command(c, "[{\"op\":\"remove\",\"id\":\"lamp\"}]")));
}

/* A picture that its budget ended goes on when the budget grows. */
static void a_larger_budget_resumes(void **state)
{
    struct client *c = *state;
    struct lum_command *cmd = command(c, LUM_CMD_VIEW_OPEN);
    cmd->view =
        (struct lum_view_request){.has_size = true, .w = W, .h = H, .has_budget = true, .budget_error = {true, 10.0}};
    cJSON_Delete(ask(c, cmd));
    struct lum_frame_header h = converged_frame(c, 0, NULL);
    cmd = command(c, LUM_CMD_VIEW_UPDATE);
    cmd->view.view_id = h.view_id;
    cmd->view.has_budget = true; /* of nothing: the scene's 16 samples count again */
    cJSON_Delete(ask(c, cmd));
    assert_true(h.spp < 16);
    while (h.spp < 16)
        h = next_frame(c, NULL);
    assert_int_equal(h.spp, 16);
}

static void the_inbox_is_limited_in_bytes(void **state)
{
    struct client *c = *state;
    struct lum_command *cmd = command(c, LUM_CMD_SCENE_GET);
    cmd->n_bytes = LUM_INBOX_MAX_BYTES + 1;
    assert_false(lum_director_post(c->director, cmd));
    cmd->n_bytes = LUM_INBOX_MAX_BYTES;
    cJSON_Delete(ask(c, cmd));
}

/* Names of users are not used again: what only they could undo would be kept for nobody. */
static void a_session_takes_its_history_along(void **state)
{
    struct client *c = *state;
    scene_rev_of(ask(c, apply_command(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/on\",\"value\":false}]")));
    struct lum_command *gone = command(c, LUM_CMD_SESSION_CLOSED);
    assert_true(lum_director_post(c->director, gone));
    assert_refused(ask(c, command(c, LUM_CMD_SCENE_UNDO)), "not_found", NULL);
}

/* A triangle in a file beside the scene becomes the children of the import; its progress is told, and undo takes all
 * away. */
static void an_import_joins_the_scene(void **state)
{
    struct client *c = *state;
    static const char gltf[] =
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
        "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/octet-stream;base64,"
        "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}]}";
    char path[80], op[200];
    snprintf(path, sizeof path, "%s.gltf", c->path);
    FILE *f = fopen(path, "wb");
    assert_true(f && fputs(gltf, f) >= 0 && fclose(f) == 0);
    snprintf(op, sizeof op, "[{\"op\":\"import\",\"id\":\"tri\",\"asset\":\"%s\"}]", strrchr(path, '/') + 1);
    uint64_t before = lum_director_scene_rev(c->director);
    assert_int_equal(scene_rev_of(ask(c, apply_command(c, op))), before + 1);
    remove(path);
    struct lum_director_metrics m;
    lum_director_metrics(c->director, &m);
    assert_int_equal(m.triangles, 3);
    assert_int_equal(m.imports, 1);
    bool told = false;
    for (size_t i = 0; i < c->n_texts; i++)
        told = told || strstr(c->texts[i], "\"import.progress\"");
    assert_true(told);
    scene_rev_of(ask(c, command(c, LUM_CMD_SCENE_UNDO)));
    lum_director_metrics(c->director, &m);
    assert_int_equal(m.triangles, 2);
}

/* view.update as its JSON text; the reply. A text that is refused when it is read gives its error, as the session does.
 */
static cJSON *update_view(struct client *c, const char *params)
{
    char text[512];
    struct lum_rpc rpc;
    struct lum_proto_error err;
    snprintf(text, sizeof text, "{\"jsonrpc\":\"2.0\",\"id\":%llu,\"method\":\"view.update\",\"params\":%s}",
             (unsigned long long)++c->next_id, params);
    assert_true(lum_rpc_parse(text, strlen(text), &rpc, &err));
    struct lum_command *cmd = lum_method_command(&rpc, &err);
    cJSON *reply = NULL;
    if (cmd) {
        cmd->session = c->session;
        cmd->received_ns = lum_clock_ns();
        reply = ask(c, cmd);
    } else {
        char *error = lum_rpc_error(rpc.id, &err);
        reply = cJSON_Parse(error);
        free(error);
    }
    lum_rpc_finish(&rpc);
    return reply;
}

static void assert_taken(cJSON *reply)
{
    if (!cJSON_GetObjectItem(reply, "result")) {
        char *text = cJSON_PrintUnformatted(reply);
        fail_msg("%s", text);
    }
    cJSON_Delete(reply);
}

/* Next frame that shows camera number seq and is final. */
static long sum_of_numbered(struct client *c, uint32_t seq, uint8_t pixels[W * H * 4])
{
    struct lum_frame_header h;
    do
        h = next_frame(c, pixels);
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
    open_view(c, LUM_CODEC_RGBA8);
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

static void effects_that_do_not_exist_are_refused(void **state)
{
    struct client *c = *state;
    open_view(c, LUM_CODEC_RGBA8);
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

/* path makes no guidance map: the picture in grey, from the same film: no pass runs for it. */
static void an_overlay_is_display_only(void **state)
{
    struct client *c = *state;
    uint8_t pixels[W * H * 4];
    open_view(c, LUM_CODEC_RGBA8);
    assert_taken(update_view(c, "{\"view_id\":1,\"camera_seq\":1}"));
    sum_of_numbered(c, 1, pixels);
    struct lum_director_metrics before, after;
    lum_director_metrics(c->director, &before);
    assert_taken(update_view(c, "{\"view_id\":1,\"overlay\":\"guidance_soft_shadow\",\"camera_seq\":2}"));
    assert_true(sum_of_numbered(c, 2, pixels) > 0);
    for (size_t i = 0; i < W * H; i++)
        assert_true(pixels[4 * i] == pixels[4 * i + 1] && pixels[4 * i] == pixels[4 * i + 2]);
    lum_director_metrics(c->director, &after);
    assert_int_equal(after.passes, before.passes);
    assert_int_equal(after.rays, before.rays);
}

/* in_view of the final frame.stats for camera number seq, once its frame has come. */
static void assert_in_view(struct client *c, uint32_t seq, const char *wanted)
{
    uint8_t pixels[W * H * 4];
    char numbered[32], told[32];
    snprintf(numbered, sizeof numbered, "\"camera_seq\":%u,", seq);
    snprintf(told, sizeof told, "\"in_view\":\"%s\"", wanted);
    sum_of_numbered(c, seq, pixels);
    for (size_t i = 0;; i = c->n_texts) {
        listen(c);
        for (; i < c->n_texts; i++)
            if (strstr(c->texts[i], numbered) && strstr(c->texts[i], "\"converged\":true")) {
                if (!strstr(c->texts[i], told))
                    fail_msg("camera %u: not %s in %s", seq, told, c->texts[i]);
                return;
            }
        wait_for_bell(c);
    }
}

static void an_empty_picture_is_explained(void **state)
{
    struct client *c = *state;
    open_view(c, LUM_CODEC_RGBA8);
    assert_taken(update_view(c, "{\"view_id\":1,\"method\":\"whitted\",\"camera_seq\":1}"));
    assert_in_view(c, 1, "scene");
    assert_taken(
        update_view(c, "{\"view_id\":1,\"camera\":{\"position\":[0,50,0],\"target\":[0,60,1]},\"camera_seq\":2}"));
    assert_in_view(c, 2, "nothing");
    assert_taken(update_view(c, "{\"view_id\":1,\"camera_id\":\"main\",\"camera_seq\":3}"));
    assert_in_view(c, 3, "scene");
    apply(c, "[{\"op\":\"set\",\"id\":\"lamp\",\"path\":\"/on\",\"value\":false}]");
    assert_taken(update_view(c, "{\"view_id\":1,\"camera_seq\":4}"));
    assert_in_view(c, 4, "dark");
}

static void requests_that_name_nothing_are_refused(void **state)
{
    struct client *c = *state;
    struct lum_command *cmd = command(c, LUM_CMD_VIEW_UPDATE);
    cmd->view.view_id = 99;
    assert_refused(ask(c, cmd), "not_found", "view_id");
    cmd = command(c, LUM_CMD_VIEW_OPEN);
    cmd->view = (struct lum_view_request){.has_size = true, .w = 8, .h = 8, .has_method = true, .method = "magic"};
    assert_refused(ask(c, cmd), "invalid_value", "method");
    cmd = command(c, LUM_CMD_VIEW_OPEN);
    cmd->view =
        (struct lum_view_request){.has_size = true, .w = 8, .h = 8, .has_camera_id = true, .camera_id = "nobody"};
    assert_refused(ask(c, cmd), "not_found", "camera_id");
    uint32_t id = open_view(c, LUM_CODEC_JPEG);
    cmd = command(c, LUM_CMD_VIEW_CLOSE);
    cmd->view.view_id = id;
    cmd->session.generation++; /* somebody else's view */
    assert_refused(ask(c, cmd), "not_found", "view_id");
}

static void a_session_takes_its_views_along(void **state)
{
    struct client *c = *state;
    open_view(c, LUM_CODEC_JPEG);
    open_view(c, LUM_CODEC_JPEG);
    struct lum_command *cmd = lum_command_create(LUM_CMD_SESSION_CLOSED);
    cmd->session = c->session;
    assert_true(lum_director_post(c->director, cmd));
    cJSON *reply = ask(c, command(c, LUM_CMD_STATS_GET));
    const cJSON *result = cJSON_GetObjectItem(reply, "result");
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(result, "views")), 0);
    assert_int_equal(cJSON_GetObjectItem(cJSON_GetObjectItem(result, "scene"), "light")->valueint, 1);
    cJSON_Delete(reply);
}

static void views_are_limited(void **state)
{
    struct client *c = *state;
    struct lum_command *cmd;
    for (uint32_t i = 0; i < MAX_STREAMS; i++)
        open_view(c, LUM_CODEC_JPEG);
    for (uint32_t i = MAX_STREAMS; i < LUM_LIMIT_VIEWS_PER_SESSION; i++) {
        c->n_streams = MAX_STREAMS - 1; /* the test keeps no more than these */
        lum_stream_unref(c->streams[c->n_streams]);
        open_view(c, LUM_CODEC_JPEG);
    }
    cmd = command(c, LUM_CMD_VIEW_OPEN);
    cmd->view = (struct lum_view_request){.has_size = true, .w = 8, .h = 8};
    assert_refused(ask(c, cmd), "limit_exceeded", NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_view_gets_frames_until_it_converged, setup, teardown),
        cmocka_unit_test_setup_teardown(an_edit_shows_under_its_revision, setup, teardown),
        cmocka_unit_test_setup_teardown(a_dimmed_lamp_is_darker_under_automatic_exposure, setup, teardown),
        cmocka_unit_test_setup_teardown(white_balance_costs_no_ray, setup, teardown),
        cmocka_unit_test_setup_teardown(everybody_hears_of_an_edit, setup, teardown),
        cmocka_unit_test_setup_teardown(the_latest_camera_wins, setup, teardown),
        cmocka_unit_test_setup_teardown(undo_and_redo_bring_the_picture_back, setup, teardown),
        cmocka_unit_test_setup_teardown(edits_are_all_or_nothing, setup, teardown),
        cmocka_unit_test_setup_teardown(a_stale_base_revision_is_refused, setup, teardown),
        cmocka_unit_test_setup_teardown(a_failed_import_changes_nothing, setup, teardown),
        cmocka_unit_test_setup_teardown(waiting_imports_are_limited, setup_stuck_importer, teardown),
        cmocka_unit_test_setup_teardown(an_import_joins_the_scene, setup_importer, teardown),
        cmocka_unit_test_setup_teardown(a_larger_budget_resumes, setup, teardown),
        cmocka_unit_test_setup_teardown(the_inbox_is_limited_in_bytes, setup, teardown),
        cmocka_unit_test_setup_teardown(a_session_takes_its_history_along, setup, teardown),
        cmocka_unit_test_setup_teardown(effects_are_forced_and_given_back, setup, teardown),
        cmocka_unit_test_setup_teardown(effects_that_do_not_exist_are_refused, setup, teardown),
        cmocka_unit_test_setup_teardown(an_overlay_is_display_only, setup, teardown),
        cmocka_unit_test_setup_teardown(an_empty_picture_is_explained, setup, teardown),
        cmocka_unit_test_setup_teardown(requests_that_name_nothing_are_refused, setup, teardown),
        cmocka_unit_test_setup_teardown(a_session_takes_its_views_along, setup, teardown),
        cmocka_unit_test_setup_teardown(views_are_limited, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
