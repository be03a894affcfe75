#include "server/director/read_request.h"

#include <string.h>

#include "core/base/base.h"
#include "protocol/base/nearest.h"
#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/suggest.h"

#define ADDRESS(name, role) &lum_request_##name,
#define LEAST(name, role) LUM_ROLE_##role,
static const struct lum_request_type *const types[] = {LUM_REQUESTS(ADDRESS)};
static const enum lum_role least[] = {LUM_REQUESTS(LEAST)}; /* of the same */

bool lum_request_read_nothing(struct lum_json_reader *r, struct lum_request *q)
{
    (void)q;
    return lum_json_end(r);
}

bool lum_request_read_id(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_json_require(r, "id") && lum_json_id(r, "id", q->id) && lum_json_end(r);
}

bool lum_request_read_view_id(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_json_require(r, "view_id") && lum_json_u32(r, "view_id", 0, UINT32_MAX, &q->view_id);
}

static void fail_unknown(const char *method, struct lum_proto_error *err)
{
    static const char *const own[] = {
        "session.hello", "session.list",   "session.end",    "presence.set",   "asset.upload",    "frame.ack",
        "project.list",  "project.create", "project.rename", "project.delete", "project.restore", "project.erase",
        "trash.empty",   "version.keep",   "version.list",   "version.remove"}; /* the session's */
    const char *names[LUM_ARRAY_LEN(types) + LUM_ARRAY_LEN(own)];
    memcpy(names, own, sizeof own);
    for (size_t i = 0; i < LUM_ARRAY_LEN(types); i++)
        names[i + LUM_ARRAY_LEN(own)] = types[i]->name;
    char near[LUM_SUGGEST_BYTES];
    lum_nearest_among(method, names, LUM_ARRAY_LEN(names), near, sizeof near);
    lum_proto_fail(err, LUM_PROTO_NO_METHOD, "unsupported", "method", "there is no method \"%.64s\"%s", method, near);
}

bool lum_request_allowed(const char *method, enum lum_role needs, enum lum_role role, struct lum_proto_error *err)
{
    return role >= needs ||
           lum_proto_fail(err, LUM_PROTO_APPLICATION, "forbidden", "method", "%s needs the role %s, and yours is %s",
                          method, lum_role_name(needs), lum_role_name(role));
}

/* NULL: there is none of that name, or it is not for that role. */
static const struct lum_request_type *find_type(const char *method, enum lum_role role, struct lum_proto_error *err)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(types); i++)
        if (strcmp(types[i]->name, method) == 0)
            return lum_request_allowed(method, least[i], role, err) ? types[i] : NULL;
    fail_unknown(method, err);
    return NULL;
}

struct lum_request *lum_request_read(struct lum_rpc *rpc, enum lum_role role, struct lum_proto_error *err)
{
    const struct lum_request_type *type = find_type(rpc->method, role, err);
    if (!type)
        return NULL;
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
