#include "server/director/request.h"

#include <stdlib.h>

#include <cjson/cJSON.h>

#include "core/base/base.h"
#include "protocol/json/json.h"

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
    if (q->charged)
        atomic_fetch_sub(q->charged, q->n_bytes);
    lum_free(q);
}

size_t lum_request_bytes(const struct lum_request *q)
{
    size_t n = sizeof *q + q->ops.n * sizeof *q->ops.ops + lum_json_bytes(q->ops_json);
    for (size_t i = 0; i < q->ops.n; i++) {
        const struct lum_op *op = &q->ops.ops[i];
        n += lum_json_bytes(op->value) + (op->record ? lum_record_bytes(op->record) : 0);
    }
    return n;
}

void lum_request_charge(struct lum_request *q, _Atomic size_t *account)
{
    atomic_fetch_add(account, q->n_bytes);
    q->charged = account;
}

void lum_out_destroy(struct lum_out *o)
{
    if (!o)
        return;
    free(o->file);
    lum_stream_unref(o->stream);
    free(o->text);
    free(o->rpc_id);
    lum_free(o);
}
