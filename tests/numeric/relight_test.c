/* Lights of `live` that are dimmed, recoloured and switched trace no ray: not on matte surfaces, not by way of glossy
 * ones, not in fog. Surfaces that are repainted keep of their soft shadows what rays found out, and no more; of glossy
 * paths and reflections those are made anew that something which moved has met. What happened while a light was off, or
 * there was no memory, is not forgotten. */
#include "core/cache/caches.h"
#include "core/math/sampler.h"
#include "core/scene/motion.h"
#include "core/scene/shapes.h"
#include "tests/numeric/relight_room.h"

static void pass_without_a_ray(struct rig *r, const char *what)
{
    rig_commit(r);
    struct lum_pass_stats s = rig_pass(r);
    if (rig_all_rays(&s) != 0)
        fail_msg("%s: %llu rays", what, (unsigned long long)rig_all_rays(&s));
}

/* Whatever happened to the lights in between, the same power gives the same bits. */
static void there_and_back(void **state)
{
    (void)state;
    for (int fog = 0; fog < 2; fog++) {
        struct rig r;
        room(&r, fog);
        rig_commit(&r);
        rig_pass(&r);
        struct lum_rgb *first = rig_picture(&r);
        put_lamp(&r, 0.1, true);
        pass_without_a_ray(&r, "lamp dimmed");
        put_bulb(&r, 1, false);
        pass_without_a_ray(&r, "bulb off");
        put_lamp(&r, 7, true);
        put_bulb(&r, 3, true);
        pass_without_a_ray(&r, "both brighter");
        put_lamp(&r, 7, false);
        pass_without_a_ray(&r, "the only soft light off");
        put_bulb(&r, 1, false);
        pass_without_a_ray(&r, "all off");
        assert_true(rig_mean(&r).g == 0.0f);
        put_lamp(&r, 1, true);
        put_bulb(&r, 1, true);
        pass_without_a_ray(&r, "all on");
        rig_assert_picture(&r, first, fog ? "fog, there and back" : "there and back");
        lum_free(first);
        rig_end(&r);
    }
}

/* Half the power of everything is no other decision anywhere, and halves every float: a new view makes the same bits.
 */
static void half_the_power_is_a_new_picture(void **state)
{
    (void)state;
    for (int fog = 0; fog < 2; fog++) {
        struct rig r;
        room(&r, fog);
        rig_commit(&r);
        rig_pass(&r);
        put_lamp(&r, 0.5, true);
        put_bulb(&r, 0.5, true);
        pass_without_a_ray(&r, "half");
        rig_assert_as_fresh(&r, "half");
        rig_end(&r);
    }
}

/* Nobody looked for a light that was dark: paths are traced anew, and find what a new view's find. */
static void first_light_is_looked_for(void **state)
{
    (void)state;
    struct rig r;
    room(&r, false);
    put_bulb(&r, 1, false);
    rig_commit(&r);
    rig_pass(&r);
    put_bulb(&r, 1, true);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_true(s.rays[LUM_RAY_DIRECT] > 0 && s.rays[LUM_RAY_GLOSSY] > 0);
    assert_int_equal(s.rays[LUM_RAY_PRIMARY], 0);
    rig_assert_as_fresh(&r, "first light");
    rig_end(&r);
}

/* More lamps in fog than have a buffer: those that share one are traced anew, and the counters say so. */
static void many_lights_in_fog_are_traced_anew(void **state)
{
    (void)state;
    struct rig r;
    room(&r, true);
    for (int i = 0; i < 20; i++) {
        char id[8];
        snprintf(id, sizeof id, "p%02d", i);
        struct lum_light_desc d = rig_point(rig_v(-1 + 0.1 * i, 2.5, -0.5), 5);
        rig_light(&r, id, &d);
    }
    rig_commit(&r);
    rig_pass(&r);
    put_lamp(&r, 0.5, true);
    rig_commit(&r);
    struct lum_pass_stats s = rig_pass(&r);
    assert_true(s.rays[LUM_RAY_MEDIA] > 0);
    assert_int_equal(rig_all_rays(&s), s.rays[LUM_RAY_MEDIA]);
    rig_end(&r);
}

/* Bits of the frame that a fresh view makes. */
static void assert_as_fresh(struct rig *r, const char *what)
{
    struct lum_rgb *kept = rig_picture(r);
    rig_fresh_view(r);
    rig_pass(r);
    rig_assert_picture(r, kept, what);
    lum_free(kept);
}

/* ---- repainted ---- */

static void put_bumps(struct rig *r, int tilt)
{
    uint8_t texels[4 * 4 * 4];
    for (int i = 0; i < 16; i++) {
        int sign = (i + i / 4) % 2 ? 1 : -1; /* chequered: up to 60 degrees this way and that */
        texels[4 * i] = (uint8_t)(128 + sign * tilt);
        texels[4 * i + 1] = (uint8_t)(128 - sign * tilt / 2);
        texels[4 * i + 2] = (uint8_t)(255 - tilt);
        texels[4 * i + 3] = 255;
    }
    struct lum_image_desc d = {LUM_TEXEL_LINEAR8, 4, 4, texels};
    RIG_OK(lum_scene_put_image(r->scene, "bumps", &d, &err));
}

/* With a normal map that sends its light below its own horizon, and above it again. */
static void put_pane(struct rig *r, bool glass)
{
    struct lum_material_desc m = lum_material_default();
    m.roughness = 0.5f;
    m.transmission = glass ? 1.0f : 0.0f;
    m.thin = true;
    m.normal_texture.image = "bumps";
    rig_material(r, "pane", &m);
}

/* What of a surface lies below its own horizon is not known from rays, and another normal map or material decides it
 * anew: glass lets through what a wall hides. */
static void surfaces_repainted_are_as_new(void **state)
{
    (void)state;
    struct rig r;
    room(&r, false);
    struct lum_shape_params size = {.size = {3, 1.6, 0.1}, .segments = {1, 1}};
    struct lum_shape_mesh box;
    RIG_OK(lum_shape_make("box", &size, &box, &err));
    struct lum_mesh_desc mesh = {.positions_f = box.positions,
                                 .normals = box.normals,
                                 .uvs = box.uvs,
                                 .indices = box.indices,
                                 .n_vertices = box.n_vertices,
                                 .n_triangles = box.n_triangles};
    RIG_OK(lum_scene_put_mesh(r.scene, "pane", &mesh, &err));
    lum_shape_finish(&box);
    rig_object(&r, "pane", "pane", "white", rig_v(0, 1.2, -0.2));
    put_bumps(&r, 0);
    put_pane(&r, true);
    rig_object(&r, "pane", "pane", "pane", rig_v(0, 1.2, -0.2));
    rig_commit(&r);
    rig_pass(&r);
    static const struct {
        int tilt;
        bool glass;
    } steps[] = {{100, true}, {-100, true}, {100, false}, {-60, true}, {0, true}, {60, false}, {100, true}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(steps); i++) {
        char what[64];
        snprintf(what, sizeof what, "step %zu: normals tilted by %d, %s", i, steps[i].tilt,
                 steps[i].glass ? "glass" : "a wall");
        put_bumps(&r, steps[i].tilt);
        put_pane(&r, steps[i].glass);
        rig_commit(&r);
        rig_pass(&r);
        assert_as_fresh(&r, what);
    }
    rig_end(&r);
}

/* ---- refined as it was lit ---- */

/* Windows of airlight reach 2 pixels, and 6 more where they are joined; beyond an edge of the picture pixels stand in
 * that lie a period of either further in: at most 4 and 12 away. */
#define FOG_REACH 16

static bool refined_alike(const struct rig *r, const uint8_t *a, const uint8_t *b, int x, int y)
{
    int w = (int)r->settings.w, h = (int)r->settings.h;
    for (int j = y - FOG_REACH; j <= y + FOG_REACH; j++)
        for (int i = x - FOG_REACH; i <= x + FOG_REACH; i++)
            if (i >= 0 && j >= 0 && i < w && j < h && a[j * w + i] != b[j * w + i])
                return false;
    return true;
}

/* How many points each part of the fog gets is decided by what all lights give when it is traced. A lamp that is
 * dimmed traces nothing, so that the fog keeps the points that it has; a fresh view may take others there. All else is
 * the same, bit for bit. */
static void dimmed_fog_keeps_its_points(void **state)
{
    (void)state;
    static const double powers[] = {2, 0.5, 0.1};
    for (size_t k = 0; k < LUM_ARRAY_LEN(powers); k++) {
        struct rig r;
        room(&r, true);
        r.settings.w = 150;
        /* Light paths in fog and to gloss follow the powers, too. */
        r.settings.effects_off |= LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY) | LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING);
        rig_object(&r, "crate", "crate", "red", rig_v(0, 1.9, -0.4));
        rig_commit(&r);
        rig_pass(&r);
        put_lamp(&r, powers[k], true);
        pass_without_a_ray(&r, "dimmed");
        uint32_t n = r.settings.w * r.settings.h, n_compared = 0, n_refined = 0;
        struct lum_rgb *kept = rig_picture(&r);
        uint8_t *points = lum_calloc(n, 1);
        assert_non_null(points);
        memcpy(points, lum_view_guidance(r.view, LUM_EFFECT_MEDIA), n);
        rig_fresh_view(&r);
        rig_pass(&r);
        struct lum_rgb *fresh = rig_picture(&r);
        const uint8_t *now = lum_view_guidance(r.view, LUM_EFFECT_MEDIA);
        for (uint32_t i = 0; i < n; i++) {
            uint32_t x = i % r.settings.w, y = i / r.settings.w;
            n_refined += now[i] > 0 || points[i] > 0;
            if (!refined_alike(&r, points, now, (int)x, (int)y))
                continue;
            n_compared++;
            if (memcmp(&kept[i], &fresh[i], sizeof *kept) != 0)
                fail_msg("lamp times %g: pixel %u,%u is %.9g, fresh %.9g", powers[k], x, y, (double)kept[i].g,
                         (double)fresh[i].g);
        }
        if (n_compared < n / 10 || n_refined == 0)
            fail_msg("lamp times %g: %u of %u pixels compared, %u refined: this says little", powers[k], n_compared, n,
                     n_refined);
        lum_free(kept);
        lum_free(points);
        lum_free(fresh);
        rig_end(&r);
    }
}

/* A pebble flies past the crate: most of the crate's paths do not meet it, and light changes only where its own shadow
 * falls. */
static void a_move_leaves_other_paths_alone(void **state)
{
    (void)state;
    for (int fog = 0; fog < 2; fog++) {
        struct rig r;
        room(&r, fog);
        rig_box(&r, "pebble", 0.1, 0.1, 0.1);
        rig_object(&r, "pebble", "pebble", "brushed", rig_v(-0.6, 1, 0));
        rig_commit(&r);
        uint64_t all = rig_pass(&r).rays[LUM_RAY_GLOSSY];
        for (int k = 1; k < 5; k++) {
            rig_object(&r, "pebble", "pebble", "brushed", rig_v(-0.6 + 0.1 * k, 1, 0));
            rig_commit(&r);
            uint64_t n = rig_pass(&r).rays[LUM_RAY_GLOSSY];
            if (n == 0 || n > all / 2)
                fail_msg("%d steps: %llu of %llu paths", k, (unsigned long long)n, (unsigned long long)all);
            rig_assert_as_fresh(&r, "a step");
        }
        rig_end(&r);
    }
}

static void put_pebble(struct rig *r, double x)
{
    rig_object(r, "pebble", "pebble", "brushed", rig_v(x, 1, 0));
}

/* A pebble flies about a polished crate: where it meets no reflection, nor the way from one to the lamp, that is not
 * shaded anew. */
static void a_move_leaves_other_reflections_alone(void **state)
{
    (void)state;
    static const struct lum_vec3d places[] = {{-1.8, 2.6, 1.8}, {-1.6, 2.6, 1.8}, {-0.5, 0.4, 0.6}, {-0.3, 0.4, 0.6},
                                              {0.6, 2.2, 1},    {0.4, 2.2, 1},    {1.8, 2.6, 1.8},  {1.6, 2.6, 1.8}};
    struct rig r;
    room(&r, false);
    struct lum_material_desc polished = rig_diffuse(0.8f);
    polished.metallic = 1.0f;
    polished.roughness = 0.0f;
    rig_material(&r, "brushed", &polished);
    put_bulb(&r, 1, false);
    rig_box(&r, "pebble", 0.1, 0.1, 0.1);
    rig_object(&r, "pebble", "pebble", "white", places[0]);
    rig_commit(&r);
    uint64_t all = rig_pass(&r).rays[LUM_RAY_SOFT_SHADOW];
    uint32_t n_kept = 0, n_shaded = 0;
    for (size_t k = 1; k < LUM_ARRAY_LEN(places); k++) {
        rig_object(&r, "pebble", "pebble", "white", places[k]);
        rig_commit(&r);
        uint64_t n = rig_pass(&r).rays[LUM_RAY_SOFT_SHADOW];
        n_kept += n < all / 10;
        n_shaded += n > all / 10;
        rig_assert_as_fresh(&r, "a step past a mirror");
    }
    if (n_kept == 0 || n_shaded == 0)
        fail_msg("%u steps kept, %u did not: this says little", n_kept, n_shaded);
    rig_end(&r);
}

/* Two leaves far from each other, of one mesh. */
static void put_leaves(struct rig *r, double y)
{
    static const double p[] = {-0.5, -0.4, 0, -0.45, -0.4, 0, -0.5, -0.35, 0, 0.5, 0.4, 0, 0.45, 0.4, 0, 0.5, 0.35, 0};
    static const uint32_t index[] = {0, 1, 2, 3, 4, 5};
    rig_mesh(r, "leaves", p, 6, index, 2);
    rig_object(r, "leaves", "leaves", "white", rig_v(0.3, 1.3 + y, 1.3));
}

/* Leaves fall right before the eye: the box around them hides most of the picture, they themselves little, and only
 * there anything is made anew: each leaf is smaller than a square of 4 x 4 pixels, so that before and now it lies in
 * four of them at most, and both in 16 of the picture's 195. */
static void what_shows_beside_a_mover_is_left_alone(void **state)
{
    (void)state;
    struct rig r;
    room(&r, false);
    put_leaves(&r, 0);
    rig_commit(&r);
    struct lum_pass_stats all = rig_pass(&r);
    for (int k = 1; k < 5; k++) {
        put_leaves(&r, -0.04 * k);
        rig_commit(&r);
        struct lum_pass_stats now = rig_pass(&r);
        if (now.rays[LUM_RAY_PRIMARY] < all.rays[LUM_RAY_PRIMARY] / 2)
            fail_msg("step %d: %llu of %llu first hits: this says little", k,
                     (unsigned long long)now.rays[LUM_RAY_PRIMARY], (unsigned long long)all.rays[LUM_RAY_PRIMARY]);
        if (now.rays[LUM_RAY_SOFT_SHADOW] == 0 || now.rays[LUM_RAY_SOFT_SHADOW] > all.rays[LUM_RAY_SOFT_SHADOW] / 5 ||
            now.rays[LUM_RAY_GLOSSY] > all.rays[LUM_RAY_GLOSSY] / 5)
            fail_msg("step %d: %llu of %llu shadow rays, %llu of %llu glossy ones", k,
                     (unsigned long long)now.rays[LUM_RAY_SOFT_SHADOW],
                     (unsigned long long)all.rays[LUM_RAY_SOFT_SHADOW], (unsigned long long)now.rays[LUM_RAY_GLOSSY],
                     (unsigned long long)all.rays[LUM_RAY_GLOSSY]);
        rig_assert_as_fresh(&r, "falling leaves");
    }
    rig_end(&r);
}

/* Lights in the face of a glossy wall: rays find the one or the other, which may change when something else moves.
 * Whatever they find, all stages work on the same: a path that starts at a light's shape would have no material. */
static void surfaces_in_one_place_are_taken_as_found(void **state)
{
    (void)state;
    static const double wall[] = {-2, 0, 0, 2, 0, 0, 2, 3, 0, -2, 3, 0};
    static const double seeds[] = {-0.5, -0.4, 0, -0.49, -0.4, 0, -0.5, -0.39, 0,
                                   0.5,  0.4,  0, 0.49,  0.4,  0, 0.5,  0.39,  0};
    static const uint32_t square[] = {0, 1, 2, 0, 2, 3}, both[] = {0, 1, 2, 3, 4, 5};
    struct rig r;
    room(&r, false);
    r.settings.w = 96;
    r.settings.h = 64;
    rig_camera(&r, rig_v(-0.3, 1.4, 1.8), rig_v(0.2, 0.9, -0.5), 60);
    rig_mesh(&r, "wall", wall, 4, square, 2);
    rig_mesh(&r, "seeds", seeds, 6, both, 2);
    rig_object(&r, "wall", "wall", "brushed", rig_v(0, 0, -1));
    for (int k = 0; k < 4; k++) {
        const char id[] = {'l', (char)('a' + k), 0};
        struct lum_light_desc l = rig_quad(rig_v(k % 2 - 0.5, k / 2 + 0.5, -1), rig_v(0.9, 0, 0), rig_v(0, 0.9, 0), 10);
        rig_light(&r, id, &l);
    }
    for (int k = 0; k < 100; k++) {
        const char id[] = {'m', (char)('a' + k % 3), 0};
        struct lum_sampler sampler = {7, (uint32_t)k};
        struct lum_vec2 u = lum_sampler_2d(&sampler, 0);
        double z = (double)lum_sampler_1d(&sampler, 1);
        rig_object(&r, id, "seeds", "red", rig_v((double)u.x / 2, (double)u.y / 2 + 1, z * 1.25));
        rig_commit(&r);
        rig_pass(&r);
    }
    rig_end(&r);
}

/* Who is lit by all of it before and after is lit otherwise all the same; also where too much moves to be told apart.
 */
static void a_light_that_moves_shines_from_elsewhere(void **state)
{
    (void)state;
    struct rig r;
    room(&r, false);
    struct lum_material_desc glow = rig_diffuse(0.5f);
    glow.emission = lum_grey(1);
    glow.emission_cd_m2 = 500;
    rig_material(&r, "glow", &glow);
    rig_box(&r, "ember", 0.1, 0.1, 0.1);
    rig_box(&r, "grain", 0.01, 0.01, 0.01);
    for (int k = 0; k < 6; k++) {
        for (uint32_t i = 0; i < (k < 3 ? 0u : LUM_MOTION_MAX + 20u); i++) {
            char id[8];
            snprintf(id, sizeof id, "a%02u", i);
            rig_object(&r, id, "grain", "white", rig_v(-0.8 + 0.02 * i, 0.5 + 0.1 * k, 0.5));
        }
        rig_object(&r, "ember", "ember", "glow", rig_v(-0.6 + 0.2 * k, 1.5, 0));
        rig_commit(&r);
        rig_pass(&r);
        rig_assert_as_fresh(&r, k < 3 ? "a step" : "a step among many");
    }
    rig_end(&r);
}

/* What is switched on again shines on what there is now, and not on what there was when it last shone. */
static void changes_in_the_dark_are_seen_by_light(void **state)
{
    (void)state;
    for (int change = 0; change < 3; change++) {
        struct rig r;
        room(&r, false);
        rig_box(&r, "pebble", 0.1, 0.1, 0.1);
        put_pebble(&r, -0.6);
        rig_commit(&r);
        rig_pass(&r);
        put_lamp(&r, 1, false);
        put_bulb(&r, 1, false);
        rig_commit(&r);
        rig_pass(&r);
        struct lum_material_desc red = rig_diffuse(0.2f);
        if (change == 0)
            rig_camera(&r, rig_v(-0.3, 1.5, 1.9), rig_v(0, 1, -1), 70);
        else if (change == 1)
            rig_material(&r, "white", &red);
        else
            put_pebble(&r, -0.2);
        rig_commit(&r);
        rig_pass(&r);
        put_lamp(&r, 1, true);
        put_bulb(&r, 1, true);
        rig_commit(&r);
        rig_pass(&r);
        rig_assert_as_fresh(&r, change == 0 ? "camera" : change == 1 ? "material" : "object");
        rig_end(&r);
    }
}

/* Paths that were traced anew while a light was off did not look for it. */
static void moves_past_a_light_that_is_off(void **state)
{
    (void)state;
    struct rig r;
    room(&r, false);
    rig_box(&r, "pebble", 0.1, 0.1, 0.1);
    put_pebble(&r, -0.6);
    rig_commit(&r);
    rig_pass(&r);
    put_bulb(&r, 1, false);
    pass_without_a_ray(&r, "bulb off");
    put_pebble(&r, -0.2);
    rig_commit(&r);
    rig_pass(&r);
    put_bulb(&r, 1, true);
    rig_commit(&r);
    rig_pass(&r);
    rig_assert_as_fresh(&r, "bulb on again");
    rig_end(&r);
}

/* A lamp shines for the first time, which takes memory, while something moves. Without it that is not forgotten. */
static void moves_without_memory_are_seen_later(void **state)
{
    (void)state;
    uint32_t n_failed = 0;
    for (uint64_t k = 1; k < 30; k++) {
        struct rig r;
        room(&r, false);
        rig_box(&r, "pebble", 0.1, 0.1, 0.1);
        put_pebble(&r, -1.2);
        put_lamp(&r, 1, false);
        rig_commit(&r);
        rig_pass(&r);
        put_pebble(&r, 0.3);
        put_lamp(&r, 1, true);
        rig_commit(&r);
        struct lum_pass_stats stats;
        struct lum_error err = {0};
        lum_alloc_fail_after(k);
        n_failed += lum_view_pass(r.view, r.snapshot, &r.settings, NULL, &stats, &err) != LUM_OK;
        lum_alloc_fail_after(0);
        put_pebble(&r, 0.4);
        rig_commit(&r);
        rig_pass(&r);
        char what[64];
        snprintf(what, sizeof what, "allocation %llu fails", (unsigned long long)k);
        rig_assert_as_fresh(&r, what);
        rig_end(&r);
    }
    assert_true(n_failed > 1); /* of its own, and of the buffers of the lamp */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(there_and_back),
        cmocka_unit_test(half_the_power_is_a_new_picture),
        cmocka_unit_test(first_light_is_looked_for),
        cmocka_unit_test(many_lights_in_fog_are_traced_anew),
        cmocka_unit_test(surfaces_repainted_are_as_new),
        cmocka_unit_test(dimmed_fog_keeps_its_points),
        cmocka_unit_test(a_move_leaves_other_paths_alone),
        cmocka_unit_test(a_move_leaves_other_reflections_alone),
        cmocka_unit_test(what_shows_beside_a_mover_is_left_alone),
        cmocka_unit_test(surfaces_in_one_place_are_taken_as_found),
        cmocka_unit_test(a_light_that_moves_shines_from_elsewhere),
        cmocka_unit_test(changes_in_the_dark_are_seen_by_light),
        cmocka_unit_test(moves_past_a_light_that_is_off),
        cmocka_unit_test(moves_without_memory_are_seen_later),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
