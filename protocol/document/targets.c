/* What patches name: a light, an object, or the mixing group of some. */
#include "protocol/document/internal.h"

#include <stdlib.h>
#include <string.h>

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct lum_target *)a)->patch->patch.target,
                  ((const struct lum_target *)b)->patch->patch.target);
}

static int name_of(const void *name, const void *target)
{
    return strcmp(name, ((const struct lum_target *)target)->patch->patch.target);
}

static const char *group_of(const struct lum_record *r)
{
    return r->type == LUM_RECORD_LIGHT ? r->light.group : r->type == LUM_RECORD_OBJECT ? r->object.group : "";
}

void lum_targets_find(const struct lum_document *doc, struct lum_target *targets, size_t n)
{
    if (n == 0)
        return;
    qsort(targets, n, sizeof *targets, by_name);
    for (size_t i = 0; i < n; i++) {
        const struct lum_record *r = lum_document_find(doc, targets[i].patch->patch.target);
        targets[i].there = r && (r->type == LUM_RECORD_LIGHT || r->type == LUM_RECORD_OBJECT);
    }
    for (size_t i = 0; i < doc->table.records.capacity; i++) {
        const struct lum_record *r = lum_table_at(&doc->table, i);
        const char *group = r ? group_of(r) : "";
        struct lum_target *t = group[0] ? bsearch(group, targets, n, sizeof *targets, name_of) : NULL;
        if (t)
            t->there = true;
    }
    for (size_t i = 1; i < n; i++) /* one of those that name the same was found, whichever */
        if (by_name(&targets[i - 1], &targets[i]) == 0)
            targets[i].there = targets[i].there || targets[i - 1].there;
    for (size_t i = n - 1; i > 0; i--)
        if (by_name(&targets[i - 1], &targets[i]) == 0)
            targets[i - 1].there = targets[i].there;
}

/* A patch that the transaction set to another target; NULL: the step is none. */
static const struct lum_record *retargeted(const struct lum_step *s)
{
    const struct lum_record *before = s->change.before, *after = s->change.after;
    if (!after || after->type != LUM_RECORD_PATCH)
        return NULL;
    bool same = before && before->type == LUM_RECORD_PATCH && strcmp(before->patch.target, after->patch.target) == 0;
    return same ? NULL : after;
}

bool lum_targets_check(const struct lum_txn *t, const struct lum_record **ret_patch)
{
    size_t n = 0;
    *ret_patch = NULL;
    for (size_t i = 0; i < t->n; i++)
        n += retargeted(&t->log[i]) != NULL;
    struct lum_target *targets = n ? calloc(n, sizeof *targets) : NULL;
    if (n && !targets)
        return lum_proto_fail_memory(t->err);
    n = 0;
    for (size_t i = 0; i < t->n; i++)
        if (retargeted(&t->log[i]))
            targets[n++].patch = retargeted(&t->log[i]);
    lum_targets_find(t->doc, targets, n);
    for (size_t i = 0; i < n && !*ret_patch; i++)
        if (!targets[i].there)
            *ret_patch = targets[i].patch;
    free(targets);
    if (!*ret_patch)
        return true;
    char near[sizeof t->err->text / 3];
    const char *name = (*ret_patch)->patch.target;
    lum_document_nearest(t->doc, LUM_RECORD_LIGHT, name, near, sizeof near);
    return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "not_found", "target",
                          "\"%s\": there is no light, object or group \"%s\"%s", (*ret_patch)->id, name, near);
}

bool lum_document_has_target(const struct lum_document *doc, const struct lum_record *patch)
{
    struct lum_target target = {.patch = patch};
    lum_targets_find(doc, &target, 1);
    return target.there;
}
