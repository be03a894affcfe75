/* What a document holds while a transaction runs and for those that can be undone: by bytes allocated, under ceilings
 * that do not grow with the number of ops. */
#include <malloc.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/document/state.h"
#include "tests/unit/document_util.h"

/* The linker sends the calls of protocol/ here (-Wl,--wrap); cJSON gets the same functions by its hooks. */
void *__real_malloc(size_t n);
void *__real_calloc(size_t n, size_t size);
void *__real_realloc(void *p, size_t n);
void __real_free(void *p);
void *__wrap_malloc(size_t n);
void *__wrap_calloc(size_t n, size_t size);
void *__wrap_realloc(void *p, size_t n);
void __wrap_free(void *p);

#define SLACK (64u << 20) /* a wrong document fails instead of taking the machine's memory */

static size_t now, peak, ceiling = SIZE_MAX;

static bool over(size_t n)
{
    return n > ceiling || now > ceiling - n;
}

static void *counted(void *p)
{
    now += p ? malloc_usable_size(p) : 0;
    peak = now > peak ? now : peak;
    return p;
}

void *__wrap_malloc(size_t n)
{
    return over(n) ? NULL : counted(__real_malloc(n));
}

void *__wrap_calloc(size_t n, size_t size)
{
    return over(n * size) ? NULL : counted(__real_calloc(n, size));
}

void *__wrap_realloc(void *p, size_t n)
{
    if (over(n))
        return NULL;
    now -= p ? malloc_usable_size(p) : 0;
    void *q = __real_realloc(p, n);
    return counted(q ? q : p) ? q : NULL;
}

void __wrap_free(void *p)
{
    now -= p ? malloc_usable_size(p) : 0;
    __real_free(p);
}

/* Applies the ops as ann; returns by how much the peak was above what was there before. */
static size_t peak_of(struct lum_document *doc, const struct lum_ops *ops, const struct lum_import_children *children)
{
    struct lum_changes changes;
    struct lum_proto_error err;
    size_t before = now;
    peak = now;
    ceiling = now + SLACK;
    bool ok = lum_document_apply(doc, "ann", ops, children, children ? 1 : 0, &changes, &err);
    ceiling = SIZE_MAX;
    if (!ok)
        fail_msg("%s at %s, with %zu bytes more than before", err.text, err.path, peak - before);
    lum_changes_finish(&changes);
    return peak - before;
}

static struct lum_op op_of(const char *text, const struct lum_blobs *blobs)
{
    struct lum_op op;
    struct lum_proto_error err;
    cJSON *json = json_of(text);
    if (!lum_op_from_json(json, blobs, &op, &err))
        fail_msg("%s: %s", text, err.text);
    cJSON_Delete(json);
    return op;
}

static void finish_ops(struct lum_op *ops, size_t n)
{
    for (size_t i = 0; i < n; i++)
        lum_op_finish(&ops[i]);
}

#define SIDE 1254u /* as a message of 8 MiB can bring it */
#define PIXELS (4u * SIDE * SIDE)

static struct lum_document *document_with_image(void)
{
    struct lum_document *doc = lum_document_create();
    struct lum_blob blob = {calloc(1, PIXELS), PIXELS, NULL};
    assert_non_null(blob.bytes);
    struct lum_op add = op_of("{'op':'add','type':'image','id':'i','width':1254,'height':1254,'texel':'linear8',"
                              "'pixels':{'blob':0}}",
                              &(struct lum_blobs){&blob, 1});
    free((uint8_t *)(uintptr_t)blob.bytes);
    peak_of(doc, &(struct lum_ops){.ops = &add, .n = 1}, NULL);
    lum_op_finish(&add);
    return doc;
}

/* Pixels are in memory once, however many versions of their image there are. */
static void sets_of_one_image_share_its_pixels(void **state)
{
    (void)state;
    static struct lum_op ops[LUM_LIMIT_OPS_PER_MESSAGE];
    struct lum_document *doc = document_with_image();
    for (size_t i = 0; i < LUM_LIMIT_OPS_PER_MESSAGE; i++)
        ops[i] = op_of(i % 2 ? SET("i", "/texel", "'linear8'") : SET("i", "/texel", "'srgb8'"), NULL);
    size_t all = peak_of(doc, &(struct lum_ops){.ops = ops, .n = LUM_LIMIT_OPS_PER_MESSAGE}, NULL);
    print_message("%u sets of an image of %u bytes: %zu bytes at their peak\n", LUM_LIMIT_OPS_PER_MESSAGE, PIXELS, all);
    assert_true(all < 64u << 10);
    size_t one_by_one = now;
    for (size_t i = 0; i < LUM_LIMIT_UNDO; i++)
        peak_of(doc, &(struct lum_ops){.ops = &ops[i], .n = 1}, NULL);
    print_message("of %u that can be undone: %zu bytes\n", LUM_LIMIT_UNDO, now - one_by_one);
    assert_true(now - one_by_one < PIXELS / 4);
    assert_true(undo(doc, "ann", NULL) && redo(doc, "ann", NULL));
    finish_ops(ops, LUM_LIMIT_OPS_PER_MESSAGE);
    lum_document_destroy(doc);
}

/* A material and objects below "room". */
static void make_room(struct lum_record **records, size_t n)
{
    records[0] = lum_record_create(LUM_RECORD_MESH, "room/m");
    memcpy(records[0]->mesh.shape, "box", 4);
    records[1] = lum_record_create(LUM_RECORD_MATERIAL, "room/w");
    for (size_t i = 2; i < n; i++) {
        lum_id id;
        snprintf(id, sizeof id, "room/o%zu", i);
        records[i] = lum_record_create(LUM_RECORD_OBJECT, id);
        memcpy(records[i]->object.mesh, "room/m", 7);
        memcpy(records[i]->object.material, "room/w", 7);
    }
}

static struct lum_document *document_with_room(size_t n)
{
    struct lum_document *doc = lum_document_create();
    struct lum_record **records = calloc(n, sizeof(*records));
    assert_non_null(records);
    make_room(records, n);
    struct lum_import_children children = {"room", records, n};
    struct lum_op import = op_of("{'op':'import','id':'room','asset':'room.glb'}", NULL);
    peak_of(doc, &(struct lum_ops){.ops = &import, .n = 1}, &children);
    lum_op_finish(&import);
    for (size_t i = 0; i < n; i++)
        lum_record_unref(records[i]);
    free(records);
    return doc;
}

/* What an import made moves once for all sets that follow each other, and is held twice: before and after. */
static void sets_of_one_import_move_it_once(void **state)
{
    (void)state;
    enum { N = 1000 };
    static struct lum_op ops[LUM_LIMIT_OPS_PER_MESSAGE];
    struct lum_document *doc = document_with_room(N);
    char text[120];
    for (size_t i = 0; i < LUM_LIMIT_OPS_PER_MESSAGE; i++) {
        snprintf(text, sizeof text, SET("room", "/transform/translate", "[%zu,0,0]"), i + 1);
        ops[i] = op_of(text, NULL);
    }
    size_t first = peak_of(doc, &(struct lum_ops){.ops = ops, .n = 1}, NULL);
    size_t all = peak_of(doc, &(struct lum_ops){.ops = ops, .n = LUM_LIMIT_OPS_PER_MESSAGE}, NULL);
    print_message("an import of %d records, set once: %zu bytes at the peak; %u times: %zu\n", N, first,
                  LUM_LIMIT_OPS_PER_MESSAGE, all);
    assert_true(all < first + (64u << 10));
    const struct lum_record *moved = lum_document_find(doc, "room/o999");
    assert_true(moved->object.transform.matrix[3] == LUM_LIMIT_OPS_PER_MESSAGE);
    assert_true(document_whole(doc));
    finish_ops(ops, LUM_LIMIT_OPS_PER_MESSAGE);
    lum_document_destroy(doc);
}

/* Sets that cannot be joined, because something between them looks at what was moved, are limited. */
static void moves_of_one_transaction_are_limited(void **state)
{
    (void)state;
    enum { N = 20000, MOVES = LUM_LIMIT_MOVED / N };
    static struct lum_op ops[2 * MOVES + 2];
    struct lum_document *doc = document_with_room(N);
    struct lum_changes changes;
    struct lum_proto_error err = {0};
    char text[120];
    for (size_t i = 0; i < 2 * MOVES + 2; i++) {
        snprintf(text, sizeof text, SET("room", "/transform/translate", "[%zu,0,0]"), i + 1);
        ops[i] = op_of(i % 2 ? SET("room/o7", "/visible", "false") : text, NULL);
    }
    struct lum_ops list = {.ops = ops, .n = 2 * MOVES + 1};
    char *before = document_text(doc);
    assert_false(lum_document_apply(doc, "ann", &list, NULL, 0, &changes, &err));
    assert_string_equal(err.app, "limit_exceeded");
    snprintf(text, sizeof text, "ops/%d/id", 2 * MOVES);
    assert_string_equal(err.path, text);
    assert_non_null(strstr(err.text, "420000") ? err.text : NULL);
    char *after = document_text(doc);
    assert_string_equal(before, after);
    list.n = 2 * MOVES;
    assert_true(lum_document_apply(doc, "ann", &list, NULL, 0, &changes, &err));
    lum_changes_finish(&changes);
    list.n = 2 * MOVES + 1;
    lum_document_replay(doc, true); /* a journal of a time with another limit has such a one */
    assert_true(lum_document_apply(doc, "ann", &list, NULL, 0, &changes, &err));
    lum_changes_finish(&changes);
    lum_document_replay(doc, false);
    assert_false(lum_document_apply(doc, "ann", &list, NULL, 0, &changes, &err));
    free(before);
    free(after);
    finish_ops(ops, 2 * MOVES + 2);
    lum_document_destroy(doc);
}

/* ---- what can be undone ---- */

#define BIG (64u << 20) /* of pixels that nobody writes to: they cost addresses, not memory */

static void apply_as(struct lum_document *doc, const char *user, struct lum_op *ops, size_t n)
{
    struct lum_changes changes;
    struct lum_proto_error err;
    if (!lum_document_apply(doc, user, &(struct lum_ops){.ops = ops, .n = n}, NULL, 0, &changes, &err))
        fail_msg("%s", err.text);
    lum_changes_finish(&changes);
}

/* The user brings a big image and takes it away again. */
static void hold_big(struct lum_document *doc, unsigned user)
{
    char name[20];
    struct lum_op add = {.kind = LUM_OP_ADD, .id = "big", .record = lum_record_create(LUM_RECORD_IMAGE, "big")};
    struct lum_op remove = {.kind = LUM_OP_REMOVE, .id = "big"};
    snprintf(name, sizeof name, "user%02u", user);
    add.record->image.pixels = lum_bulk_create(BIG);
    add.record->image.n_bytes = BIG;
    assert_non_null(add.record->image.pixels);
    apply_as(doc, name, &add, 1);
    apply_as(doc, name, &remove, 1);
    lum_op_finish(&add);
}

static unsigned count_undone(struct lum_document *doc, const char *user)
{
    unsigned n = 0;
    while (undo(doc, user, NULL))
        n++;
    return n;
}

/* All users together hold on to no more than the limit and the newest step, and who holds little loses nothing. */
static void histories_of_all_users_share_a_limit(void **state)
{
    (void)state;
    enum { USERS = 64 };
    struct lum_document *doc = lum_document_create();
    struct lum_op light = op_of(LIGHT("l"), NULL), dim = op_of(SET("l", "/flux_lm", "7"), NULL);
    apply_as(doc, "modest", &light, 1);
    apply_as(doc, "modest", &dim, 1);
    size_t before = now;
    for (unsigned i = 0; i < USERS; i++) {
        hold_big(doc, i);
        if (now - before > LUM_LIMIT_UNDO_BYTES + BIG)
            fail_msg("%zu bytes after %u users", now - before, i + 1);
    }
    lum_document_next_undo(doc, "modest", false); /* the last step counts, too */
    print_message("%u users with %u bytes each: %zu bytes\n", USERS, BIG, now - before);
    assert_true(now - before <= LUM_LIMIT_UNDO_BYTES);
    assert_int_equal(count_undone(doc, "modest"), 2);
    assert_int_equal(count_undone(doc, "user63"), 2);
    assert_int_equal(count_undone(doc, "user00"), 0);
    lum_op_finish(&light);
    lum_op_finish(&dim);
    lum_document_destroy(doc);
}

/* Records count where they hold no arrays, too: an import of many objects that is moved and moved. */
static void histories_count_what_has_no_arrays(void **state)
{
    (void)state;
    enum { N = 20000, STEPS = 40, FIT = LUM_LIMIT_UNDO_BYTES / LUM_RECORD_BYTES / N };
    struct lum_document *doc = document_with_room(N);
    size_t before = now;
    for (int i = 0; i < STEPS; i++) {
        char text[120];
        snprintf(text, sizeof text, SET("room", "/transform/translate", "[%d,0,0]"), i + 1);
        struct lum_op op = op_of(text, NULL);
        apply_as(doc, "bob", &op, 1);
        lum_op_finish(&op);
    }
    lum_document_next_undo(doc, "bob", false);
    unsigned undone = count_undone(doc, "bob");
    print_message("%u of %d moves of %d records can be undone, %zu bytes\n", undone, STEPS, N, now - before);
    assert_in_range(undone, FIT - 6, FIT); /* what ann holds, and what each step does beside its records */
    assert_true(now - before <= LUM_LIMIT_UNDO_BYTES);
    lum_document_destroy(doc);
}

int main(void)
{
    cJSON_Hooks hooks = {__wrap_malloc, __wrap_free};
    cJSON_InitHooks(&hooks);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sets_of_one_image_share_its_pixels),   cmocka_unit_test(sets_of_one_import_move_it_once),
        cmocka_unit_test(moves_of_one_transaction_are_limited), cmocka_unit_test(histories_of_all_users_share_a_limit),
        cmocka_unit_test(histories_count_what_has_no_arrays),
    };
    return cmocka_run_group_tests_name("document_memory", tests, NULL, NULL);
}
