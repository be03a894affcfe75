#include "server/director/director.h"

#include <stdlib.h>

#include "core/base/base.h"

struct lum_command *lum_command_create(enum lum_command_kind kind)
{
    struct lum_command *c = lum_calloc(1, sizeof *c);
    if (c)
        c->kind = kind;
    return c;
}

void lum_command_destroy(struct lum_command *c)
{
    if (!c)
        return;
    lum_ops_finish(&c->ops);
    free(c->rpc_id);
    lum_free(c);
}

void lum_out_destroy(struct lum_out *o)
{
    if (!o)
        return;
    lum_stream_unref(o->stream);
    free(o->text);
    lum_free(o);
}
