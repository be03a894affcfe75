/* A session: each line of the input is one command of one of two users.
 *   u, U  undo of ann, bob      r, R  redo      x  rollback of the last      otherwise: the ops of a transaction
 * After each, the document is whole, and a refused command changed nothing; an undo that worked is taken back exactly
 * by the redo; at the end the document's own ops rebuild it. */
#include "tests/fuzz/fuzz.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "tests/unit/protocol_util.h"

#define COMMANDS_MAX 64 /* keeps one input below a few milliseconds */

struct session {
    struct lum_document *doc;
    struct lum_changes last; /* of the last command that worked; can be rolled back once */
    bool can_roll_back;
};

static bool transact(struct session *s, const char *line, size_t n, const char *user, struct lum_changes *ret_changes)
{
    cJSON *json = lum_json_parse(line, n, NULL);
    struct lum_ops ops;
    bool ok = json && lum_ops_from_json(json, &ops, NULL);
    if (ok) {
        snprintf(ops.undo_group, sizeof ops.undo_group, "%s", n % 3 ? "" : "drag");
        ok = lum_document_apply(s->doc, user, &ops, NULL, 0, ret_changes, NULL);
        lum_ops_finish(&ops);
    }
    cJSON_Delete(json);
    return ok;
}

static void check_redo(struct session *s, const char *user, const char *before)
{
    struct lum_changes c;
    FUZZ_REQUIRE(lum_document_redo(s->doc, user, &c, NULL));
    lum_changes_finish(&c);
    char *again = document_text(s->doc);
    FUZZ_REQUIRE(strcmp(before, again) == 0);
    free(again);
    FUZZ_REQUIRE(lum_document_undo(s->doc, user, &c, NULL));
    lum_changes_finish(&s->last);
    s->last = c;
}

static void command(struct session *s, const char *line, size_t n)
{
    char c = line[0];
    const char *user = c == 'U' || c == 'R' || n % 2 ? "bob" : "ann";
    char *before = document_text(s->doc), *after;
    uint64_t rev = lum_document_rev(s->doc);
    struct lum_changes changes = {0};
    if (c == 'x') {
        if (s->can_roll_back)
            lum_document_rollback(s->doc, &s->last);
        s->can_roll_back = false;
    } else {
        bool undo = c == 'u' || c == 'U', redo = c == 'r' || c == 'R';
        bool ok = undo   ? lum_document_undo(s->doc, user, &changes, NULL)
                  : redo ? lum_document_redo(s->doc, user, &changes, NULL)
                         : transact(s, line, n, user, &changes);
        FUZZ_REQUIRE(lum_document_rev(s->doc) == rev + ok);
        if (ok) {
            lum_changes_finish(&s->last);
            s->last = changes;
            s->can_roll_back = true;
        } else {
            after = document_text(s->doc);
            FUZZ_REQUIRE(strcmp(before, after) == 0);
            free(after);
            if (undo || redo || c == '[')
                s->can_roll_back = false; /* a new action settles the last one */
        }
        if (ok && undo)
            check_redo(s, user, before);
    }
    FUZZ_REQUIRE(document_whole(s->doc));
    free(before);
}

static void check_rebuild(const struct lum_document *doc)
{
    char *text = document_text(doc);
    cJSON *json = lum_json_parse(text, strlen(text), NULL);
    struct lum_ops ops;
    struct lum_changes c;
    struct lum_document *copy = lum_document_create();
    FUZZ_REQUIRE(json && lum_ops_from_json(cJSON_GetObjectItem(json, "ops"), &ops, NULL));
    FUZZ_REQUIRE(lum_document_apply(copy, "x", &ops, NULL, 0, &c, NULL));
    char *again = document_text(copy);
    FUZZ_REQUIRE(strcmp(text, again) == 0);
    lum_changes_finish(&c);
    lum_ops_finish(&ops);
    lum_document_destroy(copy);
    cJSON_Delete(json);
    free(text);
    free(again);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    struct session s = {.doc = lum_document_create()};
    size_t at = 0;
    for (int k = 0; k < COMMANDS_MAX && at < n; k++) {
        const uint8_t *end = memchr(data + at, '\n', n - at);
        size_t length = end ? (size_t)(end - (data + at)) : n - at;
        if (length)
            command(&s, (const char *)data + at, length);
        at += length + 1;
    }
    check_rebuild(s.doc);
    lum_changes_finish(&s.last);
    lum_document_destroy(s.doc);
    return 0;
}
