/* The built-in scenes: all load, have what a first view needs, and their closed rooms are closed. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/render/view.h"
#include "core/scene/scene.h"
#include "server/world/scene_source.h"
#include "tests/support/probe_at.h"

static void load(struct lum_world *world, const char *scene)
{
    struct lum_proto_error err;
    memset(world, 0, sizeof *world);
    assert_int_equal(lum_world_init(world, 2, NULL, NULL, NULL), LUM_OK);
    if (!lum_scene_load(world, scene, &(struct lum_import_config){0}, &err))
        fail_msg("%s: %s: %s", scene, err.path, err.text);
}

/* Triangles of the scenes that the thesis names, kept to a tenth: its times are compared with ours (7.2.1,
 * figure 5.3.5). */
static uint64_t thesis_triangles(const char *scene)
{
    static const struct {
        const char *scene;
        uint64_t n;
    } rows[] = {{"conference", 190000}, {"cornell", 48000}, {"desk", 12000},  {"office", 20000},
                {"shirley6", 800},      {"sibenik", 75000}, {"sponza", 66000}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (strcmp(rows[i].scene, scene) == 0)
            return rows[i].n;
    return 0;
}

static void every_scene_loads(void **state)
{
    (void)state;
    for (const struct lum_embedded *e = lum_embedded_scenes; e->key; e++) {
        char name[64];
        snprintf(name, sizeof name, "%.*s", (int)strcspn(e->key, "."), e->key);
        assert_ptr_equal(lum_scene_builtin(name), e);
        struct lum_world world;
        load(&world, name);
        const struct lum_record *camera = lum_document_find(world.doc, "main");
        assert_true(camera && camera->type == LUM_RECORD_CAMERA);
        assert_true(world.snapshot->lights.n_active > 0);
        assert_int_equal(lum_scene_dropped_triangles(world.scene), 0);
        uint64_t wanted = thesis_triangles(name), n = world.snapshot->n_triangles;
        if (n == 0 || (wanted && (n * 10 < wanted * 9 || n * 10 > wanted * 11)))
            fail_msg("%s has %llu triangles, not about %llu", name, (unsigned long long)n, (unsigned long long)wanted);
        lum_world_finish(&world);
    }
}

/* Ops that put everything out that shines, and make the sky blaze. The caller frees. */
static char *ops_for_a_blazing_sky(const struct lum_world *world)
{
    const struct lum_light_table *lights = &world->snapshot->lights;
    size_t size = 512 + 256 * (size_t)lights->n_lights, at = 0;
    char *text = malloc(size);
    assert_non_null(text);
    at += (size_t)snprintf(text, size, "{\"lumend\":1,\"kind\":\"scene\"}\n");
    for (uint32_t i = 0; i < lights->n_lights; i++) {
        const char *id = lights->lights[i].id, *path = "on", *off = "false";
        if (lights->lights[i].kind == &lum_emitter_mesh) {
            id = lum_document_find(world->doc, id)->object.material;
            path = "emission_cd_m2";
            off = "0";
        }
        at += (size_t)snprintf(text + at, size - at, "{\"op\":\"set\",\"id\":\"%s\",\"path\":\"/%s\",\"value\":%s}\n",
                               id, path, off);
    }
    snprintf(text + at, size - at,
             "{\"op\":\"add\",\"type\":\"light\",\"id\":\"blaze\",\"kind\":\"environment\",\"luminance_cd_m2\":1e6}\n");
    return text;
}

static void let_the_sky_blaze(struct lum_world *world)
{
    char *text = ops_for_a_blazing_sky(world);
    struct lum_ops ops;
    struct lum_changes changes;
    struct lum_proto_error err;
    if (!lum_ops_from_jsonl(text, strlen(text), &ops, &err) ||
        !lum_world_apply(world, &(struct lum_edit){.user = "test", .ops = &ops}, &changes, &err))
        fail_msg("%s: %s", err.path, err.text);
    free(text);
    lum_changes_finish(&changes);
    lum_ops_finish(&ops);
    assert_int_equal(lum_world_commit(world, NULL), LUM_OK);
}

/* Illuminance where the camera stands, from above and below, by paths that search the whole room for a way out. */
static double light_at_the_camera(const struct lum_world *world)
{
    const double *p = lum_document_find(world->doc, "main")->camera.position;
    double sum = 0.0;
    for (int side = -1; side <= 1; side += 2) {
        struct lum_probe probe;
        uint64_t rays;
        assert_int_equal(probe_at(world->pool, world->snapshot, (struct lum_vec3d){p[0], p[1], p[2]},
                                  lum_v3(0.0f, (float)side, 0.0f), 4096, 1, &probe, &rays, NULL),
                         LUM_OK);
        sum += probe.illuminance_lx;
    }
    return sum;
}

/* With its own lights out, a closed room under a sky of 1e6 cd/m2 is black: exactly, since no path gets out. */
static void closed_rooms_are_closed(void **state)
{
    (void)state;
    static const struct {
        const char *scene;
        bool closed;
    } rows[] = {{"conference", true}, {"desk", true},    {"furnace", true},
                {"shirley6", true},   {"sibenik", true}, {"sponza", false}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct lum_world world;
        load(&world, rows[i].scene);
        let_the_sky_blaze(&world);
        double lx = light_at_the_camera(&world);
        if ((lx == 0.0) != rows[i].closed)
            fail_msg("%s: %g lx of a sky of 1e6 cd/m2 get to the camera", rows[i].scene, lx);
        lum_world_finish(&world);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_scene_loads),
        cmocka_unit_test(closed_rooms_are_closed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
