/* Words for the tests of documents: ops as text, edits that must or must not succeed, undo. */
#ifndef LUM_TESTS_UNIT_DOCUMENT_UTIL_H
#define LUM_TESTS_UNIT_DOCUMENT_UTIL_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/unit/protocol_util.h"

#define MESH(id) "{'op':'add','type':'mesh','id':'" id "','shape':'box'}"
#define MATERIAL(id) "{'op':'add','type':'material','id':'" id "'}"
#define OBJECT(id, mesh, material)                                                                                     \
    "{'op':'add','type':'object','id':'" id "','mesh':'" mesh "','material':'" material "'}"
#define LIGHT(id) "{'op':'add','type':'light','id':'" id "','kind':'point','flux_lm':800}"
#define SET(id, path, value) "{'op':'set','id':'" id "','path':'" path "','value':" value "}"
#define REMOVE(id) "{'op':'remove','id':'" id "'}"

/* As a user: done, and the document is whole. */
void must(struct lum_document *doc, const char *user, const char *ops);
/* As ann: done; lum_changes_finish. */
struct lum_changes changes_of(struct lum_document *doc, const char *ops);
/* Refused, and nothing changed. */
void must_not(struct lum_document *doc, const char *ops, const char *app, const char *path);
bool undo(struct lum_document *doc, const char *user, struct lum_proto_error *err);
bool redo(struct lum_document *doc, const char *user, struct lum_proto_error *err);
double flux(const struct lum_document *doc, const char *id);

#endif
