/* A drag is one undo step: successive transactions of one user with one undo_group are taken back together. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "protocol/document/table.h"
#include "tests/unit/document_util.h"

/* The linker sends comparisons of undo.c and transaction.c here (-Wl,--wrap). */
int __real_lum_record_order(const struct lum_record *a, const struct lum_record *b);
int __wrap_lum_record_order(const struct lum_record *a, const struct lum_record *b);

static size_t n_compared;

int __wrap_lum_record_order(const struct lum_record *a, const struct lum_record *b)
{
    n_compared++;
    return __real_lum_record_order(a, b);
}

static void read_op(const char *json, const char *group, struct lum_ops *ret_ops)
{
    struct lum_proto_error err;
    char text[256];
    int n = snprintf(text, sizeof text, "{\"lumend\":1,\"kind\":\"scene\"}\n%s\n", json);
    if (!lum_ops_from_jsonl(text, (size_t)n, ret_ops, &err))
        fail_msg("%s: %s: %s", json, err.path, err.text);
    snprintf(ret_ops->undo_group, sizeof ret_ops->undo_group, "%s", group);
}

static void apply(struct lum_document *doc, const char *user, const char *group, const char *json)
{
    struct lum_proto_error err;
    struct lum_ops ops;
    struct lum_changes changes;
    read_op(json, group, &ops);
    if (!lum_document_apply(doc, user, &ops, NULL, 0, &changes, &err))
        fail_msg("%s: %s: %s", json, err.path, err.text);
    lum_changes_finish(&changes);
    lum_ops_finish(&ops);
}

static void set_flux(struct lum_document *doc, const char *user, const char *group, int flux)
{
    char json[128];
    snprintf(json, sizeof json, "{\"op\":\"set\",\"id\":\"key\",\"path\":\"/flux_lm\",\"value\":%d}", flux);
    apply(doc, user, group, json);
}

static void expect_flux(const struct lum_document *doc, double flux)
{
    const struct lum_record *key = lum_document_find(doc, "key");
    assert_non_null(key);
    assert_float_equal(key->light.flux_lm.value, flux, 0.0);
}

static struct lum_document *create(void)
{
    struct lum_document *doc = lum_document_create();
    assert_non_null(doc);
    apply(doc, "ann", "", "{\"op\":\"add\",\"type\":\"light\",\"id\":\"key\",\"kind\":\"point\",\"flux_lm\":800}");
    return doc;
}

static void drag_is_one_step(void **state)
{
    (void)state;
    struct lum_document *doc = create();
    for (int flux = 700; flux >= 100; flux -= 100)
        set_flux(doc, "ann", "drag-1", flux);
    set_flux(doc, "ann", "drag-2", 50);
    assert_true(undo(doc, "ann", NULL));
    expect_flux(doc, 100);
    assert_true(undo(doc, "ann", NULL));
    expect_flux(doc, 800);
    assert_true(redo(doc, "ann", NULL));
    expect_flux(doc, 100);
    assert_true(redo(doc, "ann", NULL));
    expect_flux(doc, 50);
    lum_document_destroy(doc);
}

static void without_a_group_each_is_a_step(void **state)
{
    (void)state;
    struct lum_document *doc = create();
    set_flux(doc, "ann", "", 700);
    set_flux(doc, "ann", "", 600);
    assert_true(undo(doc, "ann", NULL));
    expect_flux(doc, 700);
    lum_document_destroy(doc);
}

/* What somebody else did in between must not be taken back with the drag: the drag is cut there. */
static void another_hand_cuts_the_drag(void **state)
{
    (void)state;
    struct lum_document *doc = create();
    set_flux(doc, "ann", "drag", 700);
    apply(doc, "bob", "", "{\"op\":\"set\",\"id\":\"key\",\"path\":\"/on\",\"value\":false}");
    set_flux(doc, "ann", "drag", 600);
    assert_true(undo(doc, "ann", NULL));
    expect_flux(doc, 700);
    assert_true(undo(doc, "ann", NULL));
    expect_flux(doc, 800);
    assert_false(lum_document_find(doc, "key")->light.on);
    lum_document_destroy(doc);
}

static void rollback_leaves_the_group_as_it_was(void **state)
{
    (void)state;
    struct lum_document *doc = create();
    struct lum_proto_error err;
    struct lum_changes changes;
    set_flux(doc, "ann", "drag", 700);
    struct lum_ops ops;
    read_op("{\"op\":\"set\",\"id\":\"key\",\"path\":\"/flux_lm\",\"value\":600}", "drag", &ops);
    assert_true(lum_document_apply(doc, "ann", &ops, NULL, 0, &changes, &err));
    lum_document_rollback(doc, &changes);
    lum_changes_finish(&changes);
    lum_ops_finish(&ops);
    expect_flux(doc, 700);
    assert_true(undo(doc, "ann", NULL));
    expect_flux(doc, 800);
    lum_document_destroy(doc);
}

/* Also when the last edit has not been settled into the history yet; what others did stays undoable. */
static void a_user_is_forgotten(void **state)
{
    (void)state;
    struct lum_document *doc = create();
    set_flux(doc, "bob", "", 700);
    set_flux(doc, "ann", "", 600);
    lum_document_forget_user(doc, "ann");
    lum_document_forget_user(doc, "nobody");
    assert_false(undo(doc, "ann", NULL));
    expect_flux(doc, 600);
    set_flux(doc, "bob", "", 500);
    assert_true(undo(doc, "bob", NULL));
    expect_flux(doc, 600);
    lum_document_destroy(doc);
}

/* ---- a large import is dragged ---- */

enum { N_OBJECTS = 50000 };

static void import_house(struct lum_document *doc)
{
    static struct lum_record *records[N_OBJECTS + 2];
    struct lum_proto_error err;
    struct lum_ops ops;
    struct lum_changes changes;
    records[0] = lum_record_create(LUM_RECORD_MESH, "house/m");
    records[1] = lum_record_create(LUM_RECORD_MATERIAL, "house/w");
    memcpy(records[0]->mesh.shape, "box", 4);
    for (size_t i = 2; i < N_OBJECTS + 2; i++) {
        lum_id id;
        snprintf(id, sizeof id, "house/o%zu", i);
        records[i] = lum_record_create(LUM_RECORD_OBJECT, id);
        memcpy(records[i]->object.mesh, "house/m", 8);
        memcpy(records[i]->object.material, "house/w", 8);
    }
    struct lum_import_children children = {"house", records, N_OBJECTS + 2};
    read_op("{\"op\":\"import\",\"id\":\"house\",\"asset\":\"house.glb\"}", "", &ops);
    assert_true(lum_document_apply(doc, "ann", &ops, &children, 1, &changes, &err));
    lum_changes_finish(&changes);
    lum_ops_finish(&ops);
    for (size_t i = 0; i < N_OBJECTS + 2; i++)
        lum_record_unref(records[i]);
}

/* Comparisons that putting what the step before changed into the history takes. */
static size_t settle_cost(struct lum_document *doc)
{
    n_compared = 0;
    lum_document_next_undo(doc, "ann", false);
    return n_compared;
}

static void a_step_of_a_large_drag_is_one_walk(void **state)
{
    (void)state;
    struct lum_document *doc = create();
    char json[128];
    import_house(doc);
    for (int step = 1; step <= 4; step++) {
        snprintf(json, sizeof json,
                 "{\"op\":\"set\",\"id\":\"house\",\"path\":\"/transform/translate\",\"value\":[%d,0,0]}", step);
        apply(doc, "ann", "drag", json);
        size_t n = settle_cost(doc);
        assert_true(n <= 2 * (N_OBJECTS + 1)); /* once to find that it goes on, once to join it */
        assert_true(step == 1 || n >= N_OBJECTS);
    }
    snprintf(json, sizeof json, "{\"op\":\"set\",\"id\":\"house/o49999\",\"path\":\"/visible\",\"value\":false}");
    apply(doc, "ann", "drag", json);
    assert_true(settle_cost(doc) <= 2 * (N_OBJECTS + 1));
    assert_true(undo(doc, "ann", NULL));
    const struct lum_record *last = lum_document_find(doc, "house/o49999");
    assert_true(last->object.visible && last->object.transform.matrix[3] == 0.0);
    assert_true(redo(doc, "ann", NULL));
    last = lum_document_find(doc, "house/o49999");
    assert_true(!last->object.visible && last->object.transform.matrix[3] == 4.0);
    lum_document_destroy(doc);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(drag_is_one_step),           cmocka_unit_test(without_a_group_each_is_a_step),
        cmocka_unit_test(another_hand_cuts_the_drag), cmocka_unit_test(rollback_leaves_the_group_as_it_was),
        cmocka_unit_test(a_user_is_forgotten),        cmocka_unit_test(a_step_of_a_large_drag_is_one_walk),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
