/* Imports through the director: they join the scene whole, fail alone, and wait in a short line. */
#define _GNU_SOURCE /* mkstemp */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/director_client.h"

static int setup_script(void **state, const char *script)
{
    char path[] = "/tmp/lumend-importer-XXXXXX";
    int fd = mkstemp(path);
    ssize_t n = (ssize_t)strlen(script);
    assert_true(fd >= 0 && write(fd, script, (size_t)n) == n && fchmod(fd, 0700) == 0);
    close(fd);
    int failed = client_setup_with(state, path);
    snprintf(((struct client *)*state)->importer, sizeof((struct client *)*state)->importer, "%s", path);
    return failed;
}

/* With an importer that never ends by itself. */
static int setup_stuck_importer(void **state)
{
    return setup_script(state, "#!/bin/sh\nexec sleep 1000\n");
}

/* With one that brings a box of 12 triangles as "a/m", and is done; as anything else one of 48, and goes on. */
static int setup_boxes_importer(void **state)
{
    return setup_script(
        state, "#!/bin/sh\n"
               "case $3 in a) n=1;; *) n=2;; esac\n"
               "printf '\\001\\0\\0\\0\\104\\0\\0\\0'\n"
               "printf '{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"'$3'/m\",\"shape\":\"box\",\"segments\":['$n',0]}'\n"
               "[ $3 = a ] || exec sleep 10\n"
               "printf '\\005\\0\\0\\0\\0\\0\\0\\0'\n");
}

static int setup_importer(void **state)
{
    return client_setup_with(state, LUMEND_IMPORT);
}

/* The importer is /bin/false: it dies at once. */
static void a_failed_import_changes_nothing(void **state)
{
    struct client *c = *state;
    uint64_t before = lum_director_scene_rev(c->director);
    char op[160];
    snprintf(op, sizeof op, "[{\"op\":\"import\",\"id\":\"room\",\"asset\":\"%s\"}]", strrchr(c->path, '/') + 1);
    struct lum_request *q = client_edit(c, op);
    q->n_bytes = LUM_REQUESTS_MAX_BYTES / 4 * 3;
    assert_refused(client_ask(c, q), "import_failed", NULL);
    assert_int_equal(lum_director_scene_rev(c->director), before);
    assert_int_equal(scene_rev_of(client_ask(c, client_edit(c, "[{\"op\":\"remove\",\"id\":\"lamp\"}]"))), before + 1);
    struct lum_director_metrics m;
    lum_director_metrics(c->director, &m);
    assert_int_equal(m.imports_failed, 1);
    q = client_request(c, &lum_request_stats_get);
    q->n_bytes = LUM_REQUESTS_MAX_BYTES / 2; /* the import is not charged any more */
    cJSON_Delete(client_ask(c, q));
}

static void waiting_imports_are_limited(void **state)
{
    struct client *c = *state;
    char op[160];
    snprintf(op, sizeof op, "[{\"op\":\"import\",\"id\":\"room\",\"asset\":\"%s\"}]", strrchr(c->path, '/') + 1);
    for (uint32_t i = 0; i < LUM_LIMIT_IMPORTS_WAITING; i++)
        assert_true(lum_director_post(c->director, client_edit(c, op)));
    assert_refused(client_ask(c, client_edit(c, op)), "busy", "ops");
    /* none of those before was refused, and other edits go on */
    for (size_t i = 0; i < c->n_texts; i++)
        assert_true(!strstr(c->texts[i], "\"error\"") || strstr(c->texts[i], "\"busy\""));
    scene_rev_of(client_ask(c, client_edit(c, "[{\"op\":\"remove\",\"id\":\"lamp\"}]")));
}

/* What an import keeps in memory while it waits, and while it runs, is not to be had by others. */
static void waiting_imports_are_charged(void **state)
{
    struct client *c = *state;
    char op[160];
    snprintf(op, sizeof op, "[{\"op\":\"import\",\"id\":\"room\",\"asset\":\"%s\"}]", strrchr(c->path, '/') + 1);
    const size_t third = LUM_REQUESTS_MAX_BYTES / 3;
    struct lum_request *q;
    for (int i = 0; i < 2; i++) {
        q = client_edit(c, op);
        q->n_bytes = third;
        assert_true(lum_director_post(c->director, q));
        cJSON_Delete(client_ask(c, client_request(c, &lum_request_stats_get))); /* the inbox is empty */
    }
    q = client_edit(c, "[{\"op\":\"remove\",\"id\":\"lamp\"}]");
    q->n_bytes = third + 2;
    assert_false(lum_director_post(c->director, q));
    q->n_bytes = third / 2;
    scene_rev_of(client_ask(c, q));
}

/* As soon as they are too much, and not when all are there: the second of three never ends. */
static void imports_are_added_up_while_they_come(void **state)
{
    struct client *c = *state;
    struct lum_world *w = &c->director->world;
    const char *file = strrchr(c->path, '/') + 1;
    char ops[400], again[200];
    snprintf(ops, sizeof ops,
             "[{\"op\":\"import\",\"id\":\"a\",\"asset\":\"%s\"},{\"op\":\"import\",\"id\":\"b\",\"asset\":\"%s\"},"
             "{\"op\":\"import\",\"id\":\"c\",\"asset\":\"%s\"}]",
             file, file, file);
    snprintf(again, sizeof again,
             "[{\"op\":\"remove\",\"id\":\"a\"},{\"op\":\"import\",\"id\":\"a\",\"asset\":\"%s\"}]", file);
    const char *import = strchr(again + 2, '{');
    uint64_t before = w->totals.triangles;
    w->limits.triangles = before + 12 + 47;
    assert_refused(client_ask(c, client_edit(c, ops)), "limit_exceeded", "ops/1/segments");
    assert_int_equal(w->totals.triangles, before);
    w->limits.triangles = before + 12;
    snprintf(ops, sizeof ops, "[%s", import);
    scene_rev_of(client_ask(c, client_edit(c, ops)));
    assert_int_equal(w->totals.triangles, before + 12);
    scene_rev_of(client_ask(c, client_edit(c, again))); /* what goes makes room */
    assert_int_equal(w->totals.triangles, before + 12);
    w->limits.triangles = before + 11;
    snprintf(ops, sizeof ops, "[{\"op\":\"remove\",\"id\":\"a\"}]");
    scene_rev_of(client_ask(c, client_edit(c, ops)));
    snprintf(ops, sizeof ops, "[%s", import);
    assert_refused(client_ask(c, client_edit(c, ops)), "limit_exceeded", "ops/0/segments");
}

/* A triangle in a file beside the scene becomes the children of the import; its progress is told, and undo takes all
 * away. */
static void an_import_joins_the_scene(void **state)
{
    struct client *c = *state;
    static const char gltf[] =
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
        "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/octet-stream;base64,"
        "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}]}";
    char path[80], op[200];
    snprintf(path, sizeof path, "%s.gltf", c->path);
    FILE *f = fopen(path, "wb");
    assert_true(f && fputs(gltf, f) >= 0 && fclose(f) == 0);
    snprintf(op, sizeof op, "[{\"op\":\"import\",\"id\":\"tri\",\"asset\":\"%s\"}]", strrchr(path, '/') + 1);
    uint64_t before = lum_director_scene_rev(c->director);
    assert_int_equal(scene_rev_of(client_ask(c, client_edit(c, op))), before + 1);
    remove(path);
    struct lum_director_metrics m;
    lum_director_metrics(c->director, &m);
    assert_int_equal(m.triangles, 3);
    assert_int_equal(m.imports, 1);
    bool told = false;
    for (size_t i = 0; i < c->n_texts; i++)
        told = told || strstr(c->texts[i], "\"import.progress\"");
    assert_true(told);
    scene_rev_of(client_ask(c, client_request(c, &lum_request_scene_undo)));
    lum_director_metrics(c->director, &m);
    assert_int_equal(m.triangles, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_failed_import_changes_nothing, client_setup, client_teardown),
        cmocka_unit_test_setup_teardown(waiting_imports_are_limited, setup_stuck_importer, client_teardown),
        cmocka_unit_test_setup_teardown(waiting_imports_are_charged, setup_stuck_importer, client_teardown),
        cmocka_unit_test_setup_teardown(imports_are_added_up_while_they_come, setup_boxes_importer, client_teardown),
        cmocka_unit_test_setup_teardown(an_import_joins_the_scene, setup_importer, client_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
