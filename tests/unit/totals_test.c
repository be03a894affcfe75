/* What a scene may be as a whole: looked at before the renderer makes anything of an edit, which may be cut off then.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "core/scene/scene.h"
#include "server/world/world.h"

static int setup(void **state)
{
    struct lum_world *w = calloc(1, sizeof *w);
    assert_non_null(w);
    assert_int_equal(lum_world_init(w, 2, NULL, NULL, NULL), LUM_OK);
    *state = w;
    return 0;
}

static int teardown(void **state)
{
    lum_world_finish(*state);
    free(*state);
    return 0;
}

static bool edit(struct lum_world *w, const char *text, struct lum_proto_error *err)
{
    struct lum_ops ops;
    struct lum_changes changes;
    cJSON *json = cJSON_Parse(text);
    assert_non_null(json);
    if (!lum_ops_from_json(json, &ops, err))
        fail_msg("%s: %s", text, err->text);
    bool ok = lum_world_apply(w, &(struct lum_edit){"ann", &ops, NULL, 0}, &changes, err);
    if (ok)
        lum_changes_finish(&changes);
    lum_ops_finish(&ops);
    cJSON_Delete(json);
    return ok;
}

static void must(struct lum_world *w, const char *text)
{
    struct lum_proto_error err;
    if (!edit(w, text, &err))
        fail_msg("%s: %s at %s", text, err.text, err.path);
}

static void must_not(struct lum_world *w, const char *text, const char *path, const char *says)
{
    struct lum_proto_error err = {0};
    struct lum_totals before = w->totals;
    uint64_t rev = lum_document_rev(w->doc);
    assert_false(edit(w, text, &err));
    if (strcmp(err.app, "limit_exceeded") != 0 || strcmp(err.path, path) != 0 || !strstr(err.text, says))
        fail_msg("%s: %s at \"%s\": %s", text, err.app, err.path, err.text);
    assert_memory_equal(&before, &w->totals, sizeof before);
    assert_int_equal(lum_document_rev(w->doc), rev);
}

#define BOX(id, segments)                                                                                              \
    "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"" id "\",\"shape\":\"box\",\"segments\":[" segments ",0]}"
#define SET(id, path, value) "{\"op\":\"set\",\"id\":\"" id "\",\"path\":\"" path "\",\"value\":" value "}"
#define REMOVE(id) "{\"op\":\"remove\",\"id\":\"" id "\"}"
#define IMAGE(id) /* 1 x 1 */                                                                                          \
    "{\"op\":\"add\",\"type\":\"image\",\"id\":\"" id "\",\"width\":1,\"height\":1,\"pixels\":\"AQIDBA==\"}"

/* One below, at, and one above; what goes makes room, and what is taken back counts no more. */
static void triangles_of_all_meshes_are_limited(void **state)
{
    struct lum_world *w = *state;
    struct lum_changes c;
    struct lum_proto_error err;
    w->limits.triangles = 12 * (4 + 1);
    must(w, "[" BOX("a", "2") "]");
    assert_int_equal(w->totals.triangles, 48);
    must_not(w, "[" BOX("b", "1") "," BOX("c", "1") "]", "ops/1/segments",
             "would have 72 triangles in all, and may have 60");
    must(w, "[" BOX("b", "1") "]");
    must_not(w, "[" BOX("c", "1") "]", "ops/0/segments", "72");
    must_not(w, "[" SET("b", "/segments/0", "2") "]", "ops/0/segments", "96");
    must(w, "[" REMOVE("a") "," SET("b", "/segments/0", "2") "," BOX("c", "1") "]");
    assert_int_equal(w->totals.triangles, 60);
    assert_true(lum_world_undo(w, "ann", &c, &err));
    lum_changes_finish(&c);
    assert_int_equal(w->totals.triangles, 60);
    assert_true(lum_world_undo(w, "ann", &c, &err));
    lum_world_rollback(w, &c);
    lum_changes_finish(&c);
    assert_int_equal(w->totals.triangles, 60);
}

static void texels_and_bytes_of_all_are_limited(void **state)
{
    struct lum_world *w = *state;
    w->limits.texels = 2;
    must(w, "[" IMAGE("i") "," IMAGE("j") "]");
    must_not(w, "[" IMAGE("k") "]", "ops/0/pixels", "would have 3 texels in all, and may have 2");
    must(w, "[" REMOVE("i") "," IMAGE("k") "]");
    w->limits.bytes = w->totals.bytes + LUM_RECORD_BYTES;
    must(w, "[{\"op\":\"add\",\"type\":\"material\",\"id\":\"a\"}]");
    must_not(w, "[{\"op\":\"add\",\"type\":\"material\",\"id\":\"b\"}]", "ops/0/id", "bytes");
    w->limits.bytes = 1; /* what is there stays, and may shrink */
    must(w, "[" REMOVE("k") "]");
    must(w, "[" SET("a", "/roughness", "0.5") "]");
}

/* A message of a few kilobytes that would make 34 thousand million triangles: none of them is made. */
static void a_message_of_large_shapes_is_refused_before_it_is_built(void **state)
{
    struct lum_world *w = *state;
    enum { N = 4096, ROW = 96 };
    static char text[N * ROW + 3] = "[";
    w->limits.bytes = UINT64_MAX; /* whatever the machine has */
    size_t at = 1;
    for (int i = 0; i < N; i++)
        at += (size_t)snprintf(
            text + at, sizeof text - at,
            "%s{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"m%04d\",\"shape\":\"torus\",\"segments\":[2048,2048]}",
            i ? "," : "", i);
    snprintf(text + at, sizeof text - at, "]");
    must_not(w, text, "ops/8/segments", "34359738368 triangles in all, and may have 67108864");
}

/* What is there counts beside what comes, but for what the same edit may take away, once. */
static void what_comes_is_added_to_what_stays(void **state)
{
    struct lum_world *w = *state;
    struct lum_op ops[] = {{.kind = LUM_OP_IMPORT, .id = "a"},
                           {.kind = LUM_OP_REMOVE, .id = "b"},
                           {.kind = LUM_OP_SET, .id = "b"},
                           {.kind = LUM_OP_REMOVE, .id = "none"}};
    must(w, "[" BOX("a", "2") "," BOX("b", "1") "," BOX("c", "1") "]");
    assert_int_equal(w->totals.triangles, 48 + 12 + 12);
    for (size_t n = 1; n <= LUM_ARRAY_LEN(ops); n++) {
        struct lum_totals_guard g =
            lum_totals_guard_of(&w->totals, &w->limits, w->doc, &(struct lum_ops){.ops = ops, .n = n});
        assert_int_equal(g.totals.triangles, n == 1 ? 72 : 60);
        struct lum_proto_error err = {0};
        const struct lum_record *a = lum_document_find(w->doc, "a");
        g.limits.triangles = g.totals.triangles + 48;
        assert_true(lum_totals_admit(&g, a, &err));
        assert_false(lum_totals_admit(&g, a, &err));
        assert_string_equal(err.path, "segments");
        assert_string_equal(err.app, "limit_exceeded");
    }
}

/* Three times yes. */
static bool ask_three(void *user)
{
    return ++*(int *)user <= 3;
}

/* No record more is made than the one at work; the document is as before. */
static void an_edit_is_cut_off_between_its_records(void **state)
{
    struct lum_world *w = *state;
    struct lum_proto_error err = {0};
    int asked = 0;
    must(w, "[" BOX("m", "1") "]");
    struct lum_totals before = w->totals;
    uint64_t rev = lum_document_rev(w->doc);
    w->go_on = (struct lum_go_on){ask_three, &asked};
    assert_false(
        edit(w, "[" BOX("a", "1") "," BOX("b", "1") "," BOX("c", "1") "," BOX("d", "1") "," BOX("e", "1") "]", &err));
    assert_string_equal(err.text, "the server stops");
    assert_int_equal(asked, 4);
    assert_int_equal(lum_scene_remove(w->scene, LUM_ENTITY_MESH, "c", NULL), LUM_OK);
    assert_int_equal(lum_scene_remove(w->scene, LUM_ENTITY_MESH, "d", NULL), LUM_ERR_NOT_FOUND);
    assert_memory_equal(&before, &w->totals, sizeof before);
    assert_int_equal(lum_document_rev(w->doc), rev);
    assert_null(lum_document_find(w->doc, "a"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(triangles_of_all_meshes_are_limited, setup, teardown),
        cmocka_unit_test_setup_teardown(texels_and_bytes_of_all_are_limited, setup, teardown),
        cmocka_unit_test_setup_teardown(a_message_of_large_shapes_is_refused_before_it_is_built, setup, teardown),
        cmocka_unit_test_setup_teardown(what_comes_is_added_to_what_stays, setup, teardown),
        cmocka_unit_test_setup_teardown(an_edit_is_cut_off_between_its_records, setup, teardown),
    };
    return cmocka_run_group_tests_name("totals", tests, NULL, NULL);
}
