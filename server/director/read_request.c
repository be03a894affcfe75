#include "server/director/read_request.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "core/base/base.h"
#include "core/math/vec.h"
#include "protocol/base/nearest.h"
#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/suggest.h"

#define SAMPLES_MAX 65536u /* of one probe: about a second of tracing */
#define SAMPLES_DEFAULT 256u

static bool read_nothing(struct lum_json_reader *r, struct lum_request *q)
{
    (void)q;
    return lum_json_end(r);
}

static bool read_scene_get(struct lum_json_reader *r, struct lum_request *q)
{
    lum_json_bool(r, "expand", &q->expand);
    return lum_json_end(r);
}

static bool read_scene_apply(struct lum_json_reader *r, struct lum_request *q)
{
    lum_id undo_group = "";
    lum_json_id(r, "op_id", q->op_id);
    lum_json_id(r, "undo_group", undo_group);
    q->has_base_rev = lum_json_u64(r, "base_rev", &q->base_rev);
    bool has_ops = lum_json_require(r, "ops");
    const struct cJSON *ops = lum_json_member(r, "ops");
    if (!lum_json_end(r) || !has_ops || !lum_ops_from_json(ops, &q->ops, r->err))
        return false;
    memcpy(q->ops.undo_group, undo_group, sizeof undo_group);
    return true;
}

static bool read_view_id(struct lum_json_reader *r, uint32_t *ret_view_id)
{
    return lum_json_require(r, "view_id") && lum_json_u32(r, "view_id", 0, UINT32_MAX, ret_view_id);
}

static bool read_view_open(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_json_require(r, "size") && lum_view_params_read(r, &q->view) && lum_json_end(r);
}

static bool read_view_update(struct lum_json_reader *r, struct lum_request *q)
{
    return read_view_id(r, &q->view_id) && lum_view_params_read(r, &q->view) && lum_json_end(r);
}

static bool read_view_close(struct lum_json_reader *r, struct lum_request *q)
{
    return read_view_id(r, &q->view_id) && lum_json_end(r);
}

static bool read_pixel(struct lum_json_reader *r, struct lum_request *q)
{
    return read_view_id(r, &q->view_id) && lum_json_require(r, "x") && lum_json_require(r, "y") &&
           lum_json_number(r, "x", 0.0, LUM_LIMIT_VIEW_SIDE, &q->x) &&
           lum_json_number(r, "y", 0.0, LUM_LIMIT_VIEW_SIDE, &q->y);
}

static bool read_pick(struct lum_json_reader *r, struct lum_request *q)
{
    return read_pixel(r, q) && lum_json_end(r);
}

static bool read_bounds(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_json_require(r, "id") && lum_json_id(r, "id", q->id) && lum_json_end(r);
}

/* {view_id, x, y} or {point, normal}, and samples. */
static bool read_probe(struct lum_json_reader *r, struct lum_request *q)
{
    q->samples = SAMPLES_DEFAULT;
    lum_json_u32(r, "samples", 1, SAMPLES_MAX, &q->samples);
    q->has_point = lum_json_numbers(r, "point", 3, -LUM_LIMIT_COORD_M, LUM_LIMIT_COORD_M, q->point);
    if (!q->has_point)
        return read_pixel(r, q) && lum_json_end(r);
    if (!lum_json_require(r, "normal") || !lum_json_numbers(r, "normal", 3, -1.0, 1.0, q->normal) || !lum_json_end(r))
        return false;
    if (lum_length(lum_v3((float)q->normal[0], (float)q->normal[1], (float)q->normal[2])) > 0.0f)
        return true;
    return lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "normal", "normal must not be zero");
}

static const struct method_row {
    const char *name;
    enum lum_request_kind kind;
    bool (*read)(struct lum_json_reader *r, struct lum_request *q);
} rows[] = {
    {"scene.get", LUM_REQUEST_SCENE_GET, read_scene_get},
    {"scene.apply", LUM_REQUEST_SCENE_APPLY, read_scene_apply},
    {"scene.undo", LUM_REQUEST_SCENE_UNDO, read_nothing},
    {"scene.redo", LUM_REQUEST_SCENE_REDO, read_nothing},
    {"view.open", LUM_REQUEST_VIEW_OPEN, read_view_open},
    {"view.update", LUM_REQUEST_VIEW_UPDATE, read_view_update},
    {"view.close", LUM_REQUEST_VIEW_CLOSE, read_view_close},
    {"pick", LUM_REQUEST_PICK, read_pick},
    {"bounds", LUM_REQUEST_BOUNDS, read_bounds},
    {"probe", LUM_REQUEST_PROBE, read_probe},
    {"stats.get", LUM_REQUEST_STATS_GET, read_nothing},
};

static void fail_unknown(const char *method, struct lum_proto_error *err)
{
    const char *names[LUM_ARRAY_LEN(rows) + 2] = {"session.hello", "frame.ack"}; /* the session's own */
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++)
        names[i + 2] = rows[i].name;
    char near[LUM_SUGGEST_BYTES];
    lum_nearest_among(method, names, LUM_ARRAY_LEN(names), near, sizeof near);
    lum_proto_fail(err, LUM_PROTO_NO_METHOD, "unsupported", "method", "there is no method \"%.64s\"%s", method, near);
}

struct lum_request *lum_request_read(struct lum_rpc *rpc, struct lum_proto_error *err)
{
    const struct method_row *row = NULL;
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows) && !row; i++)
        if (strcmp(rows[i].name, rpc->method) == 0)
            row = &rows[i];
    if (!row) {
        fail_unknown(rpc->method, err);
        return NULL;
    }
    struct lum_request *q = lum_request_create(row->kind);
    if (!q) {
        lum_proto_fail_memory(err);
        return NULL;
    }
    struct lum_json_reader r;
    lum_json_begin(&r, rpc->params, "", err);
    if (!row->read(&r, q)) {
        lum_request_destroy(q);
        return NULL;
    }
    q->rpc_id = rpc->id;
    rpc->id = NULL;
    return q;
}
