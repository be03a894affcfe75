#include "server/director/audit.h"

#include <stdio.h>
#include <string.h>

#include "server/base/log.h"

/* What was done to the first of them; of a large edit the rest is a number. */
struct list {
    char text[300]; /* with names and numbers before it, a line of the log */
    size_t n_text, n_left;
};

static void name(struct list *l, const char *what, const char *id, const char *path)
{
    int n = 0;
    if (l->n_left == 0)
        n = snprintf(l->text + l->n_text, sizeof l->text - l->n_text, "%s%s %s%s", l->n_text ? ", " : "", what, id,
                     path);
    if (l->n_left > 0 || n < 0 || (size_t)n >= sizeof l->text - l->n_text) {
        l->text[l->n_text] = '\0';
        l->n_left++;
        return;
    }
    l->n_text += (size_t)n;
}

static void name_ops(struct list *l, const struct lum_ops *ops)
{
    for (size_t i = 0; i < ops->n; i++) {
        const struct lum_op *op = &ops->ops[i];
        static const char *const words[] = {
            [LUM_OP_ADD] = "add", [LUM_OP_SET] = "set", [LUM_OP_REMOVE] = "remove", [LUM_OP_IMPORT] = "import"};
        name(l, words[op->kind], op->id, op->kind == LUM_OP_SET ? op->path : "");
    }
}

static void name_changes(struct list *l, const struct lum_changes *c)
{
    for (size_t i = 0; i < c->n; i++) {
        const struct lum_record *before = c->changes[i].before, *after = c->changes[i].after;
        name(l, !before ? "add" : after ? "set" : "remove", (after ? after : before)->id, "");
    }
}

static void write_line(struct lum_director *d, const char *user, uint64_t rev, const char *did, const char *op_id,
                       const struct list *l)
{
    char more[40] = "";
    if (l->n_left)
        snprintf(more, sizeof more, ", and %zu more", l->n_left);
    lum_log(&d->config.log, LUM_LOG_AUDIT, "edit", "%s revision %llu %s%s%s: %s%s", user, (unsigned long long)rev, did,
            op_id[0] ? " " : "", op_id, l->text, more);
}

void lum_director_audit(struct lum_director *d, const struct lum_staged_edit *p)
{
    struct list l = {0};
    const struct lum_request *q = p->request;
    bool undo = q->type == &lum_request_scene_undo, redo = q->type == &lum_request_scene_redo;
    bool revert = q->type == &lum_request_scene_revert;
    char did[48];
    if (!d->config.audit)
        return;
    if (undo || redo || revert)
        name_changes(&l, &p->changes);
    else
        name_ops(&l, &q->ops);
    snprintf(did, sizeof did,
             revert ? "revert to %llu"
             : undo ? "undo"
             : redo ? "redo"
                    : "apply",
             (unsigned long long)q->rev);
    write_line(d, q->user, p->scene_rev, did, q->op_id, &l);
}

void lum_director_audit_lost(struct lum_director *d, const struct lum_staged_edit *p, uint64_t rev)
{
    struct list l = {0};
    char did[48];
    if (!d->config.audit)
        return;
    name_changes(&l, &p->changes);
    snprintf(did, sizeof did, "took back revision %llu", (unsigned long long)p->scene_rev);
    write_line(d, "(server)", rev, did, "", &l);
}
