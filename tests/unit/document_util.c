#include "tests/unit/document_util.h"

#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

void must(struct lum_document *doc, const char *user, const char *ops)
{
    struct lum_proto_error err = {0};
    if (!apply_text(doc, user, ops, &err))
        fail_msg("%s: %s at %s", ops, err.text, err.path);
    assert_true(document_whole(doc));
}

void must_not(struct lum_document *doc, const char *ops, const char *app, const char *path)
{
    struct lum_proto_error err = {0};
    char *before = document_text(doc);
    uint64_t rev = lum_document_rev(doc);
    if (apply_text(doc, "ann", ops, &err))
        fail_msg("accepted %s", ops);
    if (strcmp(err.app, app) != 0 || strcmp(err.path, path) != 0)
        fail_msg("%s: %s at \"%s\": %s", ops, err.app, err.path, err.text);
    char *after = document_text(doc);
    assert_string_equal(before, after);
    assert_int_equal(rev, lum_document_rev(doc));
    assert_true(document_whole(doc));
    free(before);
    free(after);
}

bool undo(struct lum_document *doc, const char *user, struct lum_proto_error *err)
{
    struct lum_changes changes = {0};
    bool ok = lum_document_undo(doc, user, &changes, err);
    lum_changes_finish(&changes);
    return ok;
}

bool redo(struct lum_document *doc, const char *user, struct lum_proto_error *err)
{
    struct lum_changes changes = {0};
    bool ok = lum_document_redo(doc, user, &changes, err);
    lum_changes_finish(&changes);
    return ok;
}

double flux(const struct lum_document *doc, const char *id)
{
    return lum_document_find(doc, id)->light.flux_lm.value;
}

struct lum_changes changes_of(struct lum_document *doc, const char *ops_text)
{
    cJSON *json = json_of(ops_text);
    struct lum_ops ops;
    struct lum_changes changes = {0};
    struct lum_proto_error err = {0};
    if (!lum_ops_from_json(json, &ops, &err) || !lum_document_apply(doc, "ann", &ops, NULL, 0, &changes, &err))
        fail_msg("%s: %s at %s", ops_text, err.text, err.path);
    lum_ops_finish(&ops);
    cJSON_Delete(json);
    return changes;
}
