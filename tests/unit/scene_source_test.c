/* Where scenes come from: built in, ops in a file, a model file. */
#define _GNU_SOURCE /* mkdtemp */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/world/scene_source.h"

/* Triangles, nothing else; their buffer is 36 bytes: (0,0,0) (1,0,0) (0,1,0). */
#define MESH(primitive) "{\"primitives\":[{\"attributes\":{\"POSITION\":0}" primitive "}]}"
#define TRIANGLES_GLTF(roots, nodes, meshes, top)                                                                      \
    "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[" roots "]}],\"nodes\":[" nodes "],"         \
    "\"meshes\":[" meshes "],"                                                                                         \
    "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/octet-stream;base64,"                                  \
    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}],"                                                            \
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}]," top                                                          \
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"min\":[0,0,0],"           \
    "\"max\":[1,1,0]}]}"
#define TRIANGLE_GLTF(primitive, top) TRIANGLES_GLTF("0", "{\"mesh\":0}", MESH(primitive), top)
#define EMISSIVE(cd_m2)                                                                                                \
    "\"materials\":[{\"emissiveFactor\":[1,1,1],\"extensions\":{"                                                      \
    "\"KHR_materials_emissive_strength\":{\"emissiveStrength\":" cd_m2 "}}}],"
#define EMISSIVE_GLTF(cd_m2) TRIANGLE_GLTF(",\"material\":0", EMISSIVE(cd_m2))
/* A spark in a landscape a thousand times as large. */
#define SPARK_GLTF                                                                                                     \
    TRIANGLES_GLTF("0,1", "{\"mesh\":0},{\"mesh\":1,\"scale\":[1000,1000,1000]}",                                      \
                   MESH(",\"material\":0") "," MESH(""), EMISSIVE("200"))

static const char triangle_gltf[] = TRIANGLE_GLTF("", "");

/* Its cameras: z-first looks from (0, 0, 3), a-second from (0, 0, 5). */
static const char cameras_gltf[] =
    "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1,2]}],\"nodes\":["
    "{\"name\":\"empty\"},{\"name\":\"z-first\",\"camera\":1,\"translation\":[0,0,3]},"
    "{\"name\":\"a-second\",\"camera\":0,\"translation\":[0,0,5]}],"
    "\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":0.5,\"znear\":0.1}},"
    "{\"type\":\"perspective\",\"perspective\":{\"yfov\":0.5,\"znear\":0.1}}]}";

struct fixture {
    struct lum_world world;
    char dir[64], path[128];
};

static int setup(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    assert_non_null(f);
    snprintf(f->dir, sizeof f->dir, "/tmp/lumend-scene-XXXXXX");
    assert_non_null(mkdtemp(f->dir));
    assert_int_equal(lum_world_init(&f->world, 2, NULL, NULL, NULL), LUM_OK);
    *state = f;
    return 0;
}

static int teardown(void **state)
{
    struct fixture *f = *state;
    lum_world_finish(&f->world);
    if (f->path[0])
        remove(f->path);
    remove(f->dir);
    free(f);
    return 0;
}

static void write_file(struct fixture *f, const char *name, const char *text)
{
    snprintf(f->path, sizeof f->path, "%s/%s", f->dir, name);
    FILE *out = fopen(f->path, "wb");
    assert_non_null(out);
    assert_true(fputs(text, out) >= 0);
    assert_int_equal(fclose(out), 0);
}

static bool load(struct fixture *f, const char *scene, struct lum_proto_error *err)
{
    return lum_scene_load(&f->world, scene, &(struct lum_import_config){.importer = LUMEND_IMPORT}, err);
}

static void a_built_in_scene_has_a_name(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    assert_non_null(lum_scene_builtin("cornell"));
    assert_null(lum_scene_builtin("cornell.jsonl"));
    assert_null(lum_scene_builtin("corn"));
    assert_false(load(f, "corn", &err));
    assert_string_equal(err.app, "not_found");
}

static void a_file_of_ops_names_its_bad_line(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    write_file(f, "bad.jsonl",
               "{\"lumend\":1,\"kind\":\"scene\"}\n\n"
               "{\"op\":\"add\",\"type\":\"material\",\"id\":\"m\",\"metallic\":2}\n");
    assert_false(load(f, f->path, &err));
    assert_non_null(strstr(err.text, "line 3"));
    write_file(f, "bad.jsonl",
               "{\"lumend\":1,\"kind\":\"scene\"}\n\n# no such mesh\n"
               "{\"op\":\"add\",\"type\":\"material\",\"id\":\"m\"}\n"
               "{\"op\":\"add\",\"type\":\"object\",\"id\":\"o\",\"mesh\":\"none\",\"material\":\"m\"}\n");
    assert_false(load(f, f->path, &err));
    assert_non_null(strstr(err.text, "line 5: "));
    assert_string_equal(err.path, "mesh");
}

static void a_bare_model_gets_camera_sky_and_sun(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    write_file(f, "a bare triangle.gltf", triangle_gltf);
    if (!load(f, f->path, &err))
        fail_msg("%s: %s", err.path, err.text);
    assert_int_equal(f->world.snapshot->n_triangles, 1);
    const struct lum_record *camera = lum_document_find(f->world.doc, "main");
    const struct lum_record *sky = lum_document_find(f->world.doc, "default-sky");
    assert_true(camera && camera->type == LUM_RECORD_CAMERA);
    assert_true(sky && sky->type == LUM_RECORD_LIGHT);
    assert_string_equal(sky->light.kind, "environment");
    const struct lum_record *sun = lum_document_find(f->world.doc, "default-sun");
    assert_true(sun && sun->type == LUM_RECORD_LIGHT);
    /* from behind who looks, and from her left: along its light one looks ahead, and to the right */
    const double *d = sun->light.direction, *from = camera->camera.position, *to = camera->camera.target;
    double x = to[0] - from[0], z = to[2] - from[2];
    assert_true(d[1] < 0.0 && d[0] * x + d[2] * z > 0.0 && -d[0] * z + d[2] * x > 0.0);
    assert_non_null(lum_document_find(f->world.doc, "a-bare-triangle")); /* an id made from the file's name */
}

static void a_model_is_seen_by_its_own_camera(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    struct lum_camera c;
    write_file(f, "hall.gltf", cameras_gltf);
    if (!load(f, f->path, &err))
        fail_msg("%s: %s", err.path, err.text);
    assert_null(lum_document_find(f->world.doc, "main"));
    assert_string_equal(lum_world_render(&f->world)->render.camera,
                        "hall/z-first"); /* first in the file, not by name */
    assert_true(lum_world_camera(&f->world, NULL, &c, &err));
    assert_true(c.position.z == 3.0);
    assert_true(lum_world_camera(&f->world, "hall/a-second", &c, &err));
    assert_true(c.position.z == 5.0);
    assert_false(lum_world_camera(&f->world, "second", &c, &err));
    assert_string_equal(err.text, "there is no camera \"second\": did you mean \"hall/a-second\"?");
    assert_true(c.position.z == 3.0);
    assert_false(lum_world_camera(&f->world, "main", &c, &err));
    assert_string_equal(err.text, "there is no camera \"main\"; there are hall/a-second, hall/z-first");
    /* A camera that is gone: the first by id. */
    static const char gone[] = "{\"lumend\":1,\"kind\":\"scene\"}\n{\"op\":\"remove\",\"id\":\"hall/z-first\"}\n";
    struct lum_ops ops;
    struct lum_changes changes;
    assert_true(lum_ops_from_jsonl(gone, sizeof gone - 1, &ops, &err));
    assert_true(lum_world_apply(&f->world, &(struct lum_edit){.user = "ann", .ops = &ops}, &changes, &err));
    assert_int_equal(lum_world_commit(&f->world, NULL), LUM_OK);
    assert_true(lum_world_camera(&f->world, NULL, &c, &err));
    assert_true(c.position.z == 5.0);
    lum_changes_finish(&changes);
    lum_ops_finish(&ops);
}

static void a_faint_glow_is_no_light_but_a_panel_is(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    static const char *const texts[] = {EMISSIVE_GLTF("1"), SPARK_GLTF, EMISSIVE_GLTF("200")};
    for (int k = 0; k < 3; k++) {
        struct fixture one = {0};
        assert_int_equal(lum_world_init(&one.world, 2, NULL, NULL, NULL), LUM_OK);
        write_file(f, "glow.gltf", texts[k]);
        if (!load(&one, f->path, &err))
            fail_msg("%s: %s", err.path, err.text);
        assert_true((lum_document_find(one.world.doc, "default-sky") == NULL) == (k == 2));
        lum_world_finish(&one.world);
    }
}

/* The file's name becomes the import's id, unless the scene needs that id itself. */
static void a_model_may_have_any_name(void **state)
{
    struct fixture *f = *state;
    static const char *const names[] = {"render.gltf", "main.gltf", "default-sky.gltf", "default-sun.gltf", ".gltf"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        struct lum_proto_error err;
        write_file(f, names[i], triangle_gltf);
        if (!load(f, f->path, &err))
            fail_msg("%s: %s: %s", names[i], err.path, err.text);
        assert_int_equal(lum_document_find(f->world.doc, "model")->type, LUM_RECORD_IMPORT);
        remove(f->path);
        lum_world_finish(&f->world);
        assert_int_equal(lum_world_init(&f->world, 2, NULL, NULL, NULL), LUM_OK);
    }
}

static void a_missing_or_broken_model_fails(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    assert_false(load(f, "/nonexistent/room.glb", &err));
    write_file(f, "broken.glb", "glTF but not really");
    assert_false(load(f, f->path, &err));
    write_file(f, "broken.glb", "Not found\n"); /* what a failed download leaves */
    assert_false(load(f, f->path, &err));
    assert_non_null(strstr(err.text, "not a GLB file"));
    assert_int_equal(lum_document_rev(f->world.doc), 0); /* nothing happened */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_built_in_scene_has_a_name, setup, teardown),
        cmocka_unit_test_setup_teardown(a_file_of_ops_names_its_bad_line, setup, teardown),
        cmocka_unit_test_setup_teardown(a_bare_model_gets_camera_sky_and_sun, setup, teardown),
        cmocka_unit_test_setup_teardown(a_model_is_seen_by_its_own_camera, setup, teardown),
        cmocka_unit_test_setup_teardown(a_faint_glow_is_no_light_but_a_panel_is, setup, teardown),
        cmocka_unit_test_setup_teardown(a_model_may_have_any_name, setup, teardown),
        cmocka_unit_test_setup_teardown(a_missing_or_broken_model_fails, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
