/* Nothing that carries light is left out: on every built-in scene, path tracing with every effect
 * forced on and with only those that the scene calls for gives the same picture, bit for bit: the energy left out is 0.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "core/render/view.h"
#include "server/world/scene_source.h"
#include "tests/support/effort.h"

enum { W = 72, H = 48, SPP = 4 };

static void render(struct lum_world *world, uint32_t effects_on, struct lum_rgb ret_pixels[W * H])
{
    struct lum_view *view;
    struct lum_error err = {0};
    struct lum_pass_stats stats;
    struct lum_view_settings s = lum_view_settings_default();
    s.w = W;
    s.h = H;
    s.effects_on = effects_on;
    assert_int_equal(lum_snapshot_camera(world->snapshot, NULL, &s.camera, &err), LUM_OK);
    assert_int_equal(lum_view_create(world->pool, &view, &err), LUM_OK);
    for (int i = 0; i < SPP; i++)
        if (lum_view_pass(view, world->snapshot, &s, NULL, &stats, &err) != LUM_OK)
            fail_msg("%s", err.text);
    for (uint32_t i = 0; i < W * H; i++)
        ret_pixels[i] = lum_film_mean(lum_view_film(view), i % W, i / W);
    lum_view_destroy(view);
}

static uint32_t check_scene(const char *name)
{
    struct lum_world world;
    struct lum_error err = {0};
    struct lum_proto_error perr = {0};
    struct lum_import_config import = {0};
    struct lum_rgb called_for[W * H], all[W * H];
    const uint32_t everything = (LUM_EFFECT_BIT(LUM_EFFECT_COUNT) - 1u) & ~LUM_EFFECT_BIT(LUM_EFFECT_ANTIALIAS);
    assert_int_equal(lum_world_init(&world, 2, NULL, &import.log, &err), LUM_OK);
    if (!lum_scene_load(&world, name, &import, &perr))
        fail_msg("%s: %s", name, perr.text);
    render(&world, 0, called_for);
    render(&world, everything, all);
    lum_world_finish(&world);
    for (uint32_t i = 0; i < W * H; i++)
        if (memcmp(&called_for[i], &all[i], sizeof all[i]) != 0) {
            print_error("%s: pixel %u,%u is %.9g, with every effect %.9g\n", name, i % W, i / W,
                        (double)called_for[i].g, (double)all[i].g);
            return 1;
        }
    return 0;
}

static void what_is_called_for_is_all_there_is(void **state)
{
    (void)state;
    uint32_t n_failures = 0, n_scenes = 0;
    for (const struct lum_embedded *e = lum_embedded_scenes; e->key; e++) {
        char name[64];
        snprintf(name, sizeof name, "%.*s", (int)strcspn(e->key, "."), e->key);
        n_failures += TEST_TAKES(n_scenes, 0) ? check_scene(name) : 0;
        n_scenes++;
    }
    assert_true(n_scenes > 5 && n_failures == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_called_for_is_all_there_is)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
