#include "clients/replay/player.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "clients/replay/ws.h"
#include "protocol/json/json.h"
#include "protocol/message/rpc.h"

#define EDIT_IDS 1000000u /* request ids of edits start here; below: calls that are waited for */

struct player {
    const struct player_options *options;
    struct player_report *report;
    struct ws *ws;
    struct canvas canvas;
    uint64_t next_call, next_edit;
    uint64_t n_opening;  /* times that the server told that it is opening the project */
    uint64_t reply_to;   /* the call whose reply came last */
    struct cJSON *reply; /* its result, owned; NULL: it was refused */
    uint32_t view_id, camera_seq;
    uint32_t frame_server_us; /* largest of the frame's tiles so far */
    int64_t first_frame_ns;
    bool open, failed;
    char reason[256];
};

__attribute__((format(printf, 2, 3))) static bool fail(struct player *p, const char *fmt, ...)
{
    if (!p->failed) {
        va_list args;
        va_start(args, fmt);
        vsnprintf(p->reason, sizeof p->reason, fmt, args);
        va_end(args);
    }
    p->failed = true;
    return false;
}

static bool send_text(struct player *p, char *text)
{
    return ws_send(p->ws, text) || fail(p, "out of memory");
}

/* ---- what comes in ---- */

static const char *error_message(const struct lum_rpc_incoming *in)
{
    const cJSON *message = cJSON_GetObjectItemCaseSensitive(in->error, "message");
    return cJSON_IsString(message) ? message->valuestring : "refused without a message";
}

static void on_edit_reply(struct player *p, const struct lum_rpc_incoming *in)
{
    const cJSON *rev = cJSON_GetObjectItemCaseSensitive(in->result, "scene_rev");
    if (cJSON_IsNumber(rev) && rev->valuedouble > 0) {
        latency_marked(&p->report->edit, in->id, (uint64_t)rev->valuedouble);
        return;
    }
    latency_refused(&p->report->edit, in->id);
    if (p->report->refused++ == 0)
        snprintf(p->report->first_refusal, sizeof p->report->first_refusal, "%s", error_message(in));
}

static void on_text(struct player *p, const struct ws_event *e)
{
    struct lum_rpc_incoming in;
    struct lum_proto_error err;
    if (!lum_rpc_parse_incoming((const char *)e->bytes, e->n_bytes, &in, &err)) {
        /* a notification may tell of an edit larger than a message may be; nothing here depends on those */
        return;
    }
    if (in.id >= EDIT_IDS)
        on_edit_reply(p, &in);
    else if (in.id) {
        cJSON_Delete(p->reply);
        p->reply = in.result ? cJSON_DetachItemViaPointer(in.root, (cJSON *)(uintptr_t)in.result) : NULL;
        p->reply_to = in.id;
        if (!p->reply)
            fail(p, "%s", error_message(&in));
    } else if (in.method && strcmp(in.method, "session.closing") == 0)
        fail(p, "the server is closing");
    else if (in.method && strcmp(in.method, "project.opening") == 0)
        p->n_opening++;
    lum_rpc_incoming_finish(&in);
}

static void acknowledge(struct player *p, uint64_t frame_seq)
{
    cJSON *params = cJSON_CreateObject();
    if (lum_json_add_number(params, "view_id", p->view_id) &&
        lum_json_add_number(params, "frame_seq", (double)frame_seq))
        send_text(p, lum_rpc_notification("frame.ack", params));
    else
        cJSON_Delete(params);
}

static void on_frame(struct player *p, const struct lum_frame_header *h, int64_t t_ns)
{
    struct player_report *r = p->report;
    size_t shown = r->edit.samples.n + r->camera.samples.n;
    latency_frame(&r->edit, h->scene_rev, t_ns);
    latency_frame(&r->camera, h->camera_seq, t_ns);
    if (r->edit.samples.n + r->camera.samples.n > shown)
        samples_add(&r->server, p->frame_server_us);
    if (r->frames++ == 0)
        p->first_frame_ns = t_ns;
    r->seconds = (double)(t_ns - p->first_frame_ns) * 1e-9;
    p->frame_server_us = 0;
    acknowledge(p, h->frame_seq);
    if (!p->options->record_dir)
        return;
    char path[4096];
    snprintf(path, sizeof path, "%s/frame-%06llu.png", p->options->record_dir, (unsigned long long)r->frames - 1);
    if (!canvas_write_png(&p->canvas, path))
        fail(p, "cannot write %.200s", path);
}

static void on_binary(struct player *p, const struct ws_event *e)
{
    struct lum_frame_header h;
    size_t offset;
    const char *reason;
    if (!lum_frame_header_unpack(e->bytes, e->n_bytes, &h, &offset)) {
        fail(p, "a binary message without a valid header");
        return;
    }
    if (h.kind != LUM_FRAME_TILE)
        return;
    p->report->tiles++;
    p->report->bytes += e->n_bytes;
    p->view_id = h.view_id; /* there is one view, and a frame may come before the reply to view.open */
    if (h.server_us > p->frame_server_us)
        p->frame_server_us = h.server_us;
    if (!canvas_draw(&p->canvas, &h, e->bytes + offset, &reason))
        fail(p, "%s", reason);
    else if (h.flags & LUM_FRAME_LAST_TILE)
        on_frame(p, &h, e->t_ns);
}

/* Handles one event, at most until the deadline. False: nothing came, or all is over. */
static bool step(struct player *p, int64_t deadline_ns)
{
    struct ws_event e = ws_next(p->ws, deadline_ns);
    switch (e.kind) {
    case WS_TEXT:
        on_text(p, &e);
        break;
    case WS_BINARY:
        on_binary(p, &e);
        break;
    case WS_CLOSED:
        if (!p->open)
            return fail(p, "cannot connect to %s (%.*s): start lumend, or name its address by --url ws://HOST:PORT%s",
                        p->options->url, (int)e.n_bytes, (const char *)e.bytes,
                        strncmp(p->options->url, "wss:", 4) == 0
                            ? "; its certificate must be for that name, and signed by one whom --ca names"
                            : "");
        return fail(p, "%.*s", (int)e.n_bytes, (const char *)e.bytes);
    case WS_TIMEOUT:
        return false;
    case WS_OPEN:
        p->open = true;
        break;
    }
    return !p->failed;
}

static int64_t timeout_at(const struct player *p)
{
    return ws_clock_ns() + (int64_t)(p->options->timeout_s * 1e9);
}

/* ---- calls ---- */

/* Sends a request and waits for its reply; the result is in p->reply. */
static bool call(struct player *p, const char *method, cJSON *params)
{
    uint64_t id = ++p->next_call, n_opening = p->n_opening;
    int64_t deadline = timeout_at(p);
    if (!send_text(p, lum_rpc_request(id, method, params)))
        return false;
    while (p->reply_to != id) {
        if (p->n_opening != n_opening)
            deadline = timeout_at(p);
        n_opening = p->n_opening;
        if (!step(p, deadline)) {
            if (p->failed) { /* name the call that the refusal belongs to */
                char why[sizeof p->reason];
                memcpy(why, p->reason, sizeof why);
                snprintf(p->reason, sizeof p->reason, "%s: %.200s", method, why);
            }
            return fail(p, "no reply to %s", method);
        }
    }
    return p->reply != NULL;
}

static bool wait_until_open(struct player *p)
{
    int64_t deadline = timeout_at(p);
    while (!p->open)
        if (!step(p, deadline))
            return fail(p, "%s does not answer", p->options->url);
    return true;
}

static bool hello(struct player *p)
{
    cJSON *params = cJSON_CreateObject();
    if (p->options->token)
        lum_json_add_string(params, "token", p->options->token);
    if (p->options->project)
        lum_json_add_string(params, "project", p->options->project);
    lum_json_add_string(params, "client", "lumend-replay");
    return call(p, "session.hello", params);
}

static bool open_view(struct player *p)
{
    const struct player_options *o = p->options;
    cJSON *params = cJSON_CreateObject();
    const double size[2] = {o->w, o->h};
    lum_json_add(params, "size", cJSON_CreateDoubleArray(size, 2));
    lum_json_add_string(params, "codec", o->codec);
    lum_json_add_number(params, "quality", o->quality);
    if (o->method)
        lum_json_add_string(params, "method", o->method);
    if (!call(p, "view.open", params))
        return false;
    const cJSON *id = cJSON_GetObjectItemCaseSensitive(p->reply, "view_id");
    if (!cJSON_IsNumber(id))
        return fail(p, "view.open: no view_id in the reply");
    p->view_id = (uint32_t)id->valuedouble;
    int64_t deadline = timeout_at(p);
    while (p->report->frames == 0)
        if (!step(p, deadline))
            return fail(p, "no first frame within %g s", o->timeout_s);
    return true;
}

/* ---- edits ---- */

static bool send_edits(struct player *p, const struct lum_op *ops, size_t n)
{
    cJSON *params = cJSON_CreateObject(), *list = cJSON_CreateArray();
    bool ok = list != NULL;
    for (size_t i = 0; i < n && ok; i++)
        ok = lum_json_add(list, NULL, lum_op_to_json(&ops[i]));
    if (!lum_json_add(params, "ops", list) || !ok) {
        cJSON_Delete(params);
        return fail(p, "out of memory");
    }
    uint64_t id = p->next_edit++;
    p->report->edits++;
    if (!latency_sent(&p->report->edit, id, 0, ws_clock_ns()))
        return fail(p, "%d edits wait for their frame: the server does not keep up", LATENCY_WAITING_MAX);
    return send_text(p, lum_rpc_request(id, "scene.apply", params));
}

static bool wait_until_shown(struct player *p, const struct latency *l)
{
    int64_t deadline = timeout_at(p);
    while (l->n_waiting > 0)
        if (!step(p, deadline))
            return fail(p, "no frame within %g s shows what was sent", p->options->timeout_s);
    return true;
}

/* Ops of one time are one transaction, within the limit of a message. */
static bool play(struct player *p, const struct lum_ops *ops)
{
    int64_t start = ws_clock_ns();
    for (size_t i = 0, end; i < ops->n; i = end) {
        for (end = i + 1; end < ops->n && end - i < LUM_LIMIT_OPS_PER_MESSAGE;)
            if (!ops->t_ms || ops->t_ms[end] == ops->t_ms[i])
                end++;
            else
                break;
        int64_t due = start;
        if (ops->t_ms && p->options->speed > 0.0)
            due += (int64_t)(ops->t_ms[i] * 1e6 / p->options->speed);
        while (ws_clock_ns() < due)
            if (!step(p, due) && p->failed)
                return false;
        if (!send_edits(p, ops->ops + i, end - i))
            return false;
        if (p->options->speed == 0.0 && !wait_until_shown(p, &p->report->edit))
            return false;
    }
    return wait_until_shown(p, &p->report->edit);
}

/* ---- camera ---- */

struct orbit {
    double position[3], target[3], up[3], vfov_deg;
};

static bool read_camera(struct player *p, struct orbit *ret)
{
    if (!call(p, "scene.get", cJSON_Parse("{\"expand\":true}")))
        return false;
    const cJSON *op, *ops = cJSON_GetObjectItemCaseSensitive(p->reply, "ops");
    cJSON_ArrayForEach(op, ops)
    {
        struct lum_json_reader r;
        char type[LUM_LIMIT_ID_BYTES + 1] = "", id[LUM_LIMIT_ID_BYTES + 1] = "";
        const double far = LUM_LIMIT_COORD_M;
        lum_json_begin(&r, op, "", NULL);
        lum_json_string(&r, "type", type, sizeof type);
        lum_json_string(&r, "id", id, sizeof id);
        if (strcmp(type, "camera") == 0 && strcmp(id, "main") == 0 &&
            lum_json_numbers(&r, "position", 3, -far, far, ret->position) &&
            lum_json_numbers(&r, "target", 3, -far, far, ret->target) &&
            lum_json_numbers(&r, "up", 3, -far, far, ret->up) &&
            lum_json_number(&r, "vfov_deg", 1, 179, &ret->vfov_deg))
            return true;
    }
    return fail(p, "the scene has no camera main");
}

/* Rodrigues' rotation of v about the unit axis k. */
static void rotate(const double v[3], const double k[3], double angle, double ret[3])
{
    double c = cos(angle), s = sin(angle), d = k[0] * v[0] + k[1] * v[1] + k[2] * v[2];
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, l = (i + 2) % 3;
        ret[i] = v[i] * c + (k[j] * v[l] - k[l] * v[j]) * s + k[i] * d * (1.0 - c);
    }
}

static bool send_camera(struct player *p, const struct orbit *o, double angle)
{
    double axis[3], arm[3], position[3], length = hypot(hypot(o->up[0], o->up[1]), o->up[2]);
    for (int i = 0; i < 3; i++) {
        axis[i] = o->up[i] / length;
        arm[i] = o->position[i] - o->target[i];
    }
    rotate(arm, axis, angle, position);
    for (int i = 0; i < 3; i++)
        position[i] += o->target[i];
    cJSON *params = cJSON_CreateObject(), *camera = cJSON_CreateObject();
    bool ok = lum_json_add(camera, "position", cJSON_CreateDoubleArray(position, 3)) &&
              lum_json_add(camera, "target", cJSON_CreateDoubleArray(o->target, 3)) &&
              lum_json_add(camera, "up", cJSON_CreateDoubleArray(o->up, 3)) &&
              lum_json_add_number(camera, "vfov_deg", o->vfov_deg);
    p->camera_seq++;
    ok = lum_json_add(params, "camera", camera) && ok && lum_json_add_number(params, "view_id", p->view_id) &&
         lum_json_add_number(params, "camera_seq", p->camera_seq);
    if (!ok) {
        cJSON_Delete(params);
        return fail(p, "out of memory");
    }
    latency_sent(&p->report->camera, 0, p->camera_seq, ws_clock_ns());
    return send_text(p, lum_rpc_notification("view.update", params));
}

/* Turns once around the target; each step is sent when the one before is on the screen, as an input event waits for the
 * next display refresh. */
static bool turn(struct player *p, const struct orbit *orbit)
{
    for (uint32_t i = 1; i <= p->options->orbit; i++)
        if (!send_camera(p, orbit, 6.283185307179586 * i / p->options->orbit) ||
            !wait_until_shown(p, &p->report->camera))
            return false;
    return true;
}

/* ---- the run ---- */

bool player_run(const struct player_options *options, const struct lum_ops *ops, struct player_report *ret_report,
                char ret_reason[256])
{
    struct player p = {.options = options, .report = ret_report, .next_edit = EDIT_IDS};
    struct orbit orbit;
    const char *reason = "out of memory";
    memset(ret_report, 0, sizeof *ret_report);
    bool ok = canvas_init(&p.canvas, options->w, options->h, options->record_dir != NULL) &&
              (p.ws = ws_connect(options->url, options->ca, "lumend.v1", &reason)) != NULL;
    if (!ok)
        fail(&p, "%s", reason);
    ok = ok && wait_until_open(&p) && hello(&p) && (options->orbit == 0 || read_camera(&p, &orbit)) && open_view(&p) &&
         play(&p, ops) && (options->orbit == 0 || turn(&p, &orbit));
    snprintf(ret_reason, 256, "%s", p.reason);
    cJSON_Delete(p.reply);
    ws_destroy(p.ws);
    canvas_finish(&p.canvas);
    return ok;
}

void player_report_finish(struct player_report *r)
{
    samples_finish(&r->edit.samples);
    samples_finish(&r->camera.samples);
    samples_finish(&r->server);
}

struct cJSON *player_report_to_json(struct player_report *r)
{
    cJSON *json = cJSON_CreateObject();
    double intervals = r->frames > 1 ? (double)(r->frames - 1) : 0.0;
    bool ok = lum_json_add_number(json, "edits", (double)r->edits) &&
              lum_json_add_number(json, "refused", (double)r->refused) &&
              lum_json_add_number(json, "frames", (double)r->frames) &&
              lum_json_add_number(json, "tiles", (double)r->tiles) &&
              lum_json_add_number(json, "bytes", (double)r->bytes) &&
              lum_json_add_number(json, "seconds", r->seconds) &&
              lum_json_add_number(json, "fps", r->seconds > 0.0 ? intervals / r->seconds : 0.0) &&
              lum_json_add(json, "edit_to_frame_us", samples_to_json(&r->edit.samples)) &&
              lum_json_add(json, "camera_to_frame_us", samples_to_json(&r->camera.samples)) &&
              lum_json_add(json, "server_us", samples_to_json(&r->server));
    if (ok)
        return json;
    cJSON_Delete(json);
    return NULL;
}
