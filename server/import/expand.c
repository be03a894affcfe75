#include "server/import/expand.h"

#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

void lum_expansion_finish(struct lum_expansion *e)
{
    for (size_t i = 0; i < e->n; i++) {
        for (size_t j = 0; j < e->children[i].n; j++)
            lum_record_unref(e->children[i].records[j]);
        lum_free(e->children[i].records);
    }
    lum_free(e->children);
    lum_free(e->warnings);
    cJSON_Delete(e->settings);
    memset(e, 0, sizeof *e);
}

static bool is_encoded_image(const struct lum_op *op)
{
    return op->kind == LUM_OP_ADD && op->record->type == LUM_RECORD_IMAGE && !op->record->image.pixels &&
           op->record->image.asset[0];
}

/* A light that is to get the web of a file. */
static bool is_measured_light(const struct lum_op *op)
{
    return lum_op_web_file(op) && (op->kind == LUM_OP_SET || !op->record->light.web);
}

bool lum_ops_need_import(const struct lum_ops *ops)
{
    for (size_t i = 0; i < ops->n; i++)
        if (ops->ops[i].kind == LUM_OP_IMPORT || is_encoded_image(&ops->ops[i]) || is_measured_light(&ops->ops[i]))
            return true;
    return false;
}

static bool add_warnings(struct lum_expansion *e, const struct lum_import_result *r)
{
    if (r->n_warnings == 0)
        return true;
    char(*all)[256] = lum_calloc(e->n_warnings + r->n_warnings, sizeof *all);
    if (!all)
        return false;
    if (e->n_warnings)
        memcpy(all, e->warnings, e->n_warnings * sizeof *all);
    memcpy(all + e->n_warnings, r->warnings, r->n_warnings * sizeof *all);
    lum_free(e->warnings);
    e->warnings = all;
    e->n_warnings += r->n_warnings;
    return true;
}

struct op_progress {
    const struct lum_expand_context *context;
    const char *id;
};

static void forward_progress(void *user, const char *stage, double fraction)
{
    const struct op_progress *p = user;
    if (p->context->progress)
        p->context->progress(p->context->user, p->id, stage, fraction);
}

static bool expand_import(const struct lum_expand_context *context, const struct lum_op *op, struct lum_expansion *e,
                          struct lum_proto_error *err)
{
    struct lum_import_result result = {0};
    struct op_progress progress = {context, op->id};
    if (!lum_import_model(context->config, op->record, forward_progress, &progress, context->cancel, &result, err))
        return false;
    struct lum_import_children *c = &e->children[e->n];
    memcpy(c->import_id, op->id, sizeof c->import_id);
    c->records = lum_calloc(result.n_records, sizeof *c->records);
    bool ok = c->records && add_warnings(e, &result);
    if (ok) {
        for (size_t i = 0; i < result.n_records; i++)
            c->records[i] = lum_record_ref(result.records[i]);
        c->n = result.n_records;
        e->n++;
        cJSON_Delete(e->settings);
        e->settings = result.settings;
        result.settings = NULL;
    } else {
        lum_free(c->records);
        lum_proto_fail(err, LUM_PROTO_INTERNAL, "limit_exceeded", "", "no memory for the %zu records of %s",
                       result.n_records, op->record->import.asset);
    }
    lum_import_result_finish(&result);
    return ok;
}

static bool expand_image(const struct lum_expand_context *context, struct lum_op *op, struct lum_proto_error *err)
{
    struct lum_record *decoded;
    forward_progress(&(struct op_progress){context, op->id}, "decode", 0.0);
    if (!lum_import_image(context->config, op->record, context->cancel, &decoded, err))
        return false;
    lum_record_unref(op->record);
    op->record = decoded;
    return true;
}

/* The web of a file that an op before number i has read: a room has many lamps of one kind. */
static struct lum_record_web *web_read_before(const struct lum_ops *ops, size_t i, const char *asset)
{
    while (i-- > 0) {
        const struct lum_record *r = ops->ops[i].record;
        if (r && r->type == LUM_RECORD_LIGHT && r->light.web && strcmp(r->light.asset, asset) == 0)
            return r->light.web;
    }
    return NULL;
}

/* A set gets a light of its own, for what the file says. */
static bool give_record(struct lum_op *op, struct lum_proto_error *err)
{
    const char *file = lum_op_web_file(op);
    if (op->kind != LUM_OP_SET)
        return true;
    lum_record_unref(op->record);
    op->record = lum_record_create(LUM_RECORD_LIGHT, op->id);
    if (!op->record)
        return lum_proto_fail_memory(err);
    memcpy(op->record->light.kind, "ies", 4);
    memcpy(op->record->light.asset, file, strlen(file) + 1);
    return true;
}

static bool expand_light(const struct lum_expand_context *context, struct lum_ops *ops, size_t i,
                         struct lum_expansion *e, struct lum_proto_error *err)
{
    struct lum_op *op = &ops->ops[i];
    if (!give_record(op, err))
        return false;
    struct lum_record_web *known = web_read_before(ops, i, op->record->light.asset);
    struct lum_record *read = NULL;
    struct lum_import_result result = {0};
    if (known) {
        read = lum_record_clone(op->record);
        if (!read)
            return lum_proto_fail_memory(err);
        read->light.web = lum_record_web_ref(known);
    } else {
        forward_progress(&(struct op_progress){context, op->id}, "decode", 0.0);
        if (!lum_import_web(context->config, op->record, context->cancel, &read, &result, err))
            return false;
    }
    bool ok = add_warnings(e, &result);
    lum_import_result_finish(&result);
    lum_record_unref(op->record);
    op->record = read;
    return ok || lum_proto_fail_memory(err);
}

bool lum_ops_expand(const struct lum_expand_context *context, struct lum_ops *ops, struct lum_expansion *ret_expansion,
                    struct lum_proto_error *err)
{
    struct lum_expansion e = {.children = lum_calloc(ops->n, sizeof *e.children)};
    if (!e.children)
        return lum_proto_fail(err, LUM_PROTO_INTERNAL, "limit_exceeded", "", "no memory for %zu ops", ops->n);
    for (size_t i = 0; i < ops->n; i++) {
        struct lum_op *op = &ops->ops[i];
        bool ok = op->kind == LUM_OP_IMPORT ? expand_import(context, op, &e, err)
                  : is_encoded_image(op)    ? expand_image(context, op, err)
                  : is_measured_light(op)   ? expand_light(context, ops, i, &e, err)
                                            : true;
        if (!ok) {
            char path[32];
            snprintf(path, sizeof path, "ops/%zu", i);
            lum_proto_prefix(err, path);
            lum_expansion_finish(&e);
            return false;
        }
    }
    *ret_expansion = e;
    return true;
}
