#include "server/director/methods.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "core/math/vec.h"
#include "protocol/base/nearest.h"
#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/suggest.h"

#define SAMPLES_MAX 65536u /* of one probe: about a second of tracing */
#define SAMPLES_DEFAULT 256u

static bool read_nothing(struct lum_json_reader *r, struct lum_command *c)
{
    (void)c;
    return lum_json_end(r);
}

static bool read_scene_get(struct lum_json_reader *r, struct lum_command *c)
{
    lum_json_bool(r, "expand", &c->expand);
    return lum_json_end(r);
}

static bool read_scene_apply(struct lum_json_reader *r, struct lum_command *c)
{
    lum_id undo_group = "";
    lum_json_id(r, "op_id", c->op_id);
    lum_json_id(r, "undo_group", undo_group);
    c->has_base_rev = lum_json_u64(r, "base_rev", &c->base_rev);
    bool has_ops = lum_json_require(r, "ops");
    const struct cJSON *ops = lum_json_member(r, "ops");
    if (!lum_json_end(r) || !has_ops || !lum_ops_from_json(ops, &c->ops, r->err))
        return false;
    memcpy(c->ops.undo_group, undo_group, sizeof undo_group);
    return true;
}

/* {"op":"add","type":"camera","id":"view", and the members of camera}: a view's camera has the fields, the defaults and
 * the checks of a camera in the scene. NULL when memory is short. */
static struct cJSON *camera_op(const struct cJSON *camera)
{
    struct cJSON *op = cJSON_CreateObject();
    bool ok = lum_json_add_string(op, "op", "add") && lum_json_add_string(op, "type", "camera") &&
              lum_json_add_string(op, "id", "view");
    for (const struct cJSON *m = camera->child; m && ok; m = m->next)
        ok = lum_json_add(op, m->string, cJSON_Duplicate(m, true));
    if (ok)
        return op;
    cJSON_Delete(op);
    return NULL;
}

static bool parse_camera(const struct cJSON *camera, struct lum_view_request *v, struct lum_proto_error *err)
{
    struct lum_op op;
    if (!cJSON_IsObject(camera))
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "camera", "camera must be an object");
    struct cJSON *json = camera_op(camera);
    bool ok =
        json ? lum_op_from_json(json, NULL, &op, err) || lum_proto_prefix(err, "camera") : lum_proto_fail_memory(err);
    cJSON_Delete(json);
    if (!ok)
        return false;
    const struct lum_record_camera *c = &op.record->camera;
    memcpy(v->position, c->position, sizeof v->position);
    memcpy(v->target, c->target, sizeof v->target);
    memcpy(v->up, c->up, sizeof v->up);
    v->vfov_deg = c->vfov_deg;
    lum_op_finish(&op);
    return true;
}

static bool read_camera(struct lum_json_reader *r, struct lum_view_request *v)
{
    const struct cJSON *camera = lum_json_member(r, "camera");
    if (!camera || r->failed)
        return false;
    r->failed = !parse_camera(camera, v, r->err);
    return !r->failed;
}

static void read_budget(struct lum_json_reader *r, struct lum_view_request *v)
{
    struct lum_json_reader budget;
    v->has_budget = lum_json_object(r, "budget", &budget);
    if (!v->has_budget)
        return;
    lum_json_opt(&budget, "time_ms", 1.0, 60000.0, &v->budget_time_ms);
    lum_json_opt(&budget, "error", 1e-4, 10.0, &v->budget_error);
    if (!lum_json_end(&budget))
        r->failed = true;
}

static void read_coding(struct lum_json_reader *r, struct lum_view_request *v)
{
    static const uint8_t codecs[] = {LUM_CODEC_RGBA8, LUM_CODEC_JPEG, LUM_CODEC_PNG, LUM_CODEC_HALF_DEFLATE};
    unsigned codec = 0;
    uint32_t number = 0;
    v->has_codec = lum_json_choice(r, "codec", "rgba8|jpeg|png|half_deflate", &codec);
    if (v->has_codec)
        v->codec = codecs[codec];
    v->has_quality = lum_json_u32(r, "quality", 1, 100, &number);
    if (v->has_quality)
        v->quality = (uint8_t)number;
    v->has_downscale = lum_json_u32(r, "downscale", 0, 2, &number);
    if (v->has_downscale)
        v->downscale = (uint8_t)number;
}

/* {"soft_shadow":"off", "media":"auto", ...} */
static void read_effects(struct lum_json_reader *r, struct lum_view_request *v)
{
    struct lum_json_reader effects;
    if (!lum_json_object(r, "effects", &effects))
        return;
    for (const struct cJSON *m = effects.object->child; m; m = m->next) {
        enum lum_effect e;
        unsigned choice = 0;
        if (!lum_effect_find(m->string, strlen(m->string), &e)) {
            char near[LUM_NAMES_BYTES];
            lum_names_of_effect(m->string, near);
            lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "unknown_field", m->string, "unknown effect \"%.64s\"%s",
                           m->string, near);
            r->failed = !lum_proto_prefix(r->err, "effects"); /* which gives false */
            return;
        }
        if (!lum_json_choice(&effects, m->string, "auto|off|on", &choice))
            continue; /* null, or refused: then so are all that follow */
        v->effects_named |= LUM_EFFECT_BIT(e);
        v->effects_off |= choice == 1 ? LUM_EFFECT_BIT(e) : 0;
        v->effects_on |= choice == 2 ? LUM_EFFECT_BIT(e) : 0;
    }
    if (!lum_json_end(&effects))
        r->failed = true;
}

static bool read_view(struct lum_json_reader *r, struct lum_view_request *v)
{
    static const char *const tone_maps[] = {"agx", "aces", "reinhard", "none"};
    double size[2];
    unsigned tone_map = 0, overlay = 0;
    v->stats = true;
    v->has_camera = read_camera(r, v);
    v->has_camera_id = lum_json_id(r, "camera_id", v->camera_id);
    v->has_size = lum_json_numbers(r, "size", 2, LUM_LIMIT_VIEW_MIN, LUM_LIMIT_VIEW_SIDE, size);
    read_coding(r, v);
    v->has_method = lum_json_string(r, "method", v->method, sizeof v->method);
    v->has_camera_seq = lum_json_u32(r, "camera_seq", 0, UINT32_MAX, &v->camera_seq);
    v->has_exposure = lum_json_opt(r, "exposure_ev", -LUM_LIMIT_VIEW_EV, LUM_LIMIT_VIEW_EV, &v->exposure_ev);
    v->has_tone_map = lum_json_choice(r, "tone_map", "agx|aces|reinhard|none", &tone_map);
    if (v->has_tone_map)
        strcpy(v->tone_map, tone_maps[tone_map]);
    v->has_white_balance = lum_json_opt(r, "white_balance_k", 1667.0, 25000.0, &v->white_balance_k);
    v->has_spp = lum_json_u32(r, "spp", 1, LUM_LIMIT_SPP, &v->spp);
    v->has_stats = lum_json_bool(r, "stats", &v->stats);
    v->has_overlay = lum_json_choice(r, "overlay", LUM_OVERLAY_NAMES, &overlay);
    v->overlay = (enum lum_overlay)overlay;
    read_effects(r, v);
    read_budget(r, v);
    if (!lum_json_end(r))
        return false;
    if (v->has_camera && v->has_camera_id)
        return lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "camera_id",
                              "camera and camera_id exclude each other");
    if (!v->has_size)
        return true;
    if (size[0] != (double)(uint32_t)size[0] || size[1] != (double)(uint32_t)size[1])
        return lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "size", "size must be two integers");
    if (size[0] * size[1] > LUM_LIMIT_VIEW_PIXELS)
        return lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "limit_exceeded", "size", "a view has at most %u pixels",
                              LUM_LIMIT_VIEW_PIXELS);
    v->w = (uint32_t)size[0];
    v->h = (uint32_t)size[1];
    return true;
}

static bool read_view_open(struct lum_json_reader *r, struct lum_command *c)
{
    lum_json_require(r, "size");
    return read_view(r, &c->view);
}

static bool read_view_id(struct lum_json_reader *r, uint32_t *ret_view_id)
{
    return lum_json_require(r, "view_id") && lum_json_u32(r, "view_id", 0, UINT32_MAX, ret_view_id);
}

static bool read_view_update(struct lum_json_reader *r, struct lum_command *c)
{
    return read_view_id(r, &c->view.view_id) && read_view(r, &c->view);
}

static bool read_view_close(struct lum_json_reader *r, struct lum_command *c)
{
    return read_view_id(r, &c->view.view_id) && lum_json_end(r);
}

static bool read_pixel(struct lum_json_reader *r, struct lum_command *c)
{
    return read_view_id(r, &c->view_id) && lum_json_require(r, "x") && lum_json_require(r, "y") &&
           lum_json_number(r, "x", 0.0, LUM_LIMIT_VIEW_SIDE, &c->x) &&
           lum_json_number(r, "y", 0.0, LUM_LIMIT_VIEW_SIDE, &c->y);
}

static bool read_pick(struct lum_json_reader *r, struct lum_command *c)
{
    return read_pixel(r, c) && lum_json_end(r);
}

static bool read_bounds(struct lum_json_reader *r, struct lum_command *c)
{
    return lum_json_require(r, "id") && lum_json_id(r, "id", c->id) && lum_json_end(r);
}

/* {view_id, x, y} or {point, normal}, and samples. */
static bool read_probe(struct lum_json_reader *r, struct lum_command *c)
{
    c->samples = SAMPLES_DEFAULT;
    lum_json_u32(r, "samples", 1, SAMPLES_MAX, &c->samples);
    c->has_point = lum_json_numbers(r, "point", 3, -LUM_LIMIT_COORD_M, LUM_LIMIT_COORD_M, c->point);
    if (!c->has_point)
        return read_pixel(r, c) && lum_json_end(r);
    if (!lum_json_require(r, "normal") || !lum_json_numbers(r, "normal", 3, -1.0, 1.0, c->normal) || !lum_json_end(r))
        return false;
    if (lum_length(lum_v3((float)c->normal[0], (float)c->normal[1], (float)c->normal[2])) > 0.0f)
        return true;
    return lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "normal", "normal must not be zero");
}

static const struct method_row {
    const char *name;
    enum lum_command_kind kind;
    bool (*read)(struct lum_json_reader *r, struct lum_command *c);
} rows[] = {
    {"scene.get", LUM_CMD_SCENE_GET, read_scene_get},
    {"scene.apply", LUM_CMD_SCENE_APPLY, read_scene_apply},
    {"scene.undo", LUM_CMD_SCENE_UNDO, read_nothing},
    {"scene.redo", LUM_CMD_SCENE_REDO, read_nothing},
    {"view.open", LUM_CMD_VIEW_OPEN, read_view_open},
    {"view.update", LUM_CMD_VIEW_UPDATE, read_view_update},
    {"view.close", LUM_CMD_VIEW_CLOSE, read_view_close},
    {"pick", LUM_CMD_PICK, read_pick},
    {"bounds", LUM_CMD_BOUNDS, read_bounds},
    {"probe", LUM_CMD_PROBE, read_probe},
    {"stats.get", LUM_CMD_STATS_GET, read_nothing},
};

static void fail_unknown(const char *method, struct lum_proto_error *err)
{
    const char *names[LUM_ARRAY_LEN(rows) + 2] = {"session.hello", "frame.ack"}; /* the session's own */
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++)
        names[i + 2] = rows[i].name;
    char near[LUM_NAMES_BYTES];
    lum_nearest_among(method, names, LUM_ARRAY_LEN(names), near, sizeof near);
    lum_proto_fail(err, LUM_PROTO_NO_METHOD, "unsupported", "method", "there is no method \"%.64s\"%s", method, near);
}

struct lum_command *lum_method_command(struct lum_rpc *rpc, struct lum_proto_error *err)
{
    const struct method_row *row = NULL;
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows) && !row; i++)
        if (strcmp(rows[i].name, rpc->method) == 0)
            row = &rows[i];
    if (!row) {
        fail_unknown(rpc->method, err);
        return NULL;
    }
    struct lum_command *c = lum_command_create(row->kind);
    if (!c) {
        lum_proto_fail_memory(err);
        return NULL;
    }
    struct lum_json_reader r;
    lum_json_begin(&r, rpc->params, "", err);
    if (!row->read(&r, c)) {
        lum_command_destroy(c);
        return NULL;
    }
    c->rpc_id = rpc->id;
    rpc->id = NULL;
    return c;
}
