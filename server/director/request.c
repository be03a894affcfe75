#include "server/director/request.h"

#include <stdlib.h>

#include <cjson/cJSON.h>

#include "core/base/base.h"

const struct lum_request_type lum_request_wake = {0};

struct lum_request *lum_request_create(const struct lum_request_type *type)
{
    struct lum_request *q = lum_calloc(1, sizeof *q);
    if (q)
        q->type = type;
    return q;
}

void lum_request_destroy(struct lum_request *q)
{
    if (!q)
        return;
    lum_ops_finish(&q->ops);
    cJSON_Delete(q->ops_json);
    free(q->rpc_id);
    lum_free(q);
}

void lum_out_destroy(struct lum_out *o)
{
    if (!o)
        return;
    lum_stream_unref(o->stream);
    free(o->text);
    free(o->rpc_id);
    lum_free(o);
}
