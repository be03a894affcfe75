#include "server/director/read_request.h"

#include <string.h>

#include "core/base/base.h"
#include "protocol/base/nearest.h"
#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/suggest.h"

#define ADDRESS(name) &lum_request_##name,
static const struct lum_request_type *const types[] = {LUM_REQUESTS(ADDRESS)};

bool lum_request_read_nothing(struct lum_json_reader *r, struct lum_request *q)
{
    (void)q;
    return lum_json_end(r);
}

bool lum_request_read_view_id(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_json_require(r, "view_id") && lum_json_u32(r, "view_id", 0, UINT32_MAX, &q->view_id);
}

static void fail_unknown(const char *method, struct lum_proto_error *err)
{
    const char *names[LUM_ARRAY_LEN(types) + 2] = {"session.hello", "frame.ack"}; /* the session's own */
    for (size_t i = 0; i < LUM_ARRAY_LEN(types); i++)
        names[i + 2] = types[i]->name;
    char near[LUM_SUGGEST_BYTES];
    lum_nearest_among(method, names, LUM_ARRAY_LEN(names), near, sizeof near);
    lum_proto_fail(err, LUM_PROTO_NO_METHOD, "unsupported", "method", "there is no method \"%.64s\"%s", method, near);
}

struct lum_request *lum_request_read(struct lum_rpc *rpc, struct lum_proto_error *err)
{
    const struct lum_request_type *type = NULL;
    for (size_t i = 0; i < LUM_ARRAY_LEN(types) && !type; i++)
        if (strcmp(types[i]->name, rpc->method) == 0)
            type = types[i];
    if (!type) {
        fail_unknown(rpc->method, err);
        return NULL;
    }
    struct lum_request *q = lum_request_create(type);
    if (!q) {
        lum_proto_fail_memory(err);
        return NULL;
    }
    struct lum_json_reader r;
    lum_json_begin(&r, rpc->params, "", err);
    if (!type->read(&r, q)) {
        lum_request_destroy(q);
        return NULL;
    }
    q->rpc_id = rpc->id;
    rpc->id = NULL;
    return q;
}
