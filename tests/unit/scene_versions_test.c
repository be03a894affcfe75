/* What a commit counts as changed, and what it shares with the one before. */
#include <string.h>

#include "core/scene/scene.h"
#include "tests/support/scene_fixture.h"

static void dim_key(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(&lum_light_kind_quad);
    l.intensity = 7.0;
    put_light(scene, "key", &l);
}
static void switch_key_off(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(&lum_light_kind_quad);
    l.on = false;
    put_light(scene, "key", &l);
}
static void regroup_key(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(&lum_light_kind_quad);
    l.group = "warm";
    put_light(scene, "key", &l);
}
static void move_key(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(&lum_light_kind_quad);
    l.position.x = 0.5;
    put_light(scene, "key", &l);
}
static void move_fill(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(&lum_light_kind_point);
    l.position.x = 0.5;
    put_light(scene, "fill", &l);
}
static void add_point(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(&lum_light_kind_point);
    put_light(scene, "third", &l);
}
static void grow_lamp(struct lum_scene *scene)
{
    put_object(scene, "lamp", "ball", "glow", scaled_at(0.625, 0, 3, 0));
}
static void move_a(struct lum_scene *scene)
{
    put_object(scene, "a", "ball", "white", at(0.25, 0, 0));
}
static void move_lamp(struct lum_scene *scene)
{
    put_object(scene, "lamp", "ball", "glow", scaled_at(0.5, 0.25, 3, 0));
}
static void dim_lamp(struct lum_scene *scene)
{
    put_emissive(scene, "glow", 20.0);
}
static void kill_lamp(struct lum_scene *scene)
{
    put_emissive(scene, "glow", 0.0);
}
static void shine(struct lum_scene *scene, const struct lum_shine *shine)
{
    struct lum_object_desc o = {.mesh = "ball",
                                .material = "glow",
                                .local_to_world = scaled_at(0.5, 0, 3, 0),
                                .visible = true,
                                .shine = *shine};
    CHECK_OK(lum_scene_put_object(scene, "lamp", &o, err));
}
static void set_flux_of_lamp(struct lum_scene *scene)
{
    shine(scene, &(struct lum_shine){.unit = LUM_SHINE_FLUX, .amount = 12});
}
static void colour_lamp(struct lum_scene *scene)
{
    shine(scene, &(struct lum_shine){.has_color = true, .color = {2, 0.5f, 3}});
}
static void switch_lamp_off(struct lum_scene *scene)
{
    shine(scene, &(struct lum_shine){.off = true});
}
static void regroup_lamp(struct lum_scene *scene)
{
    shine(scene, &(struct lum_shine){.group = "house"});
}
static void paint(struct lum_scene *scene)
{
    struct lum_material_desc m = lum_material_default();
    m.base_color = lum_rgb(0.5f, 0.1f, 0.1f);
    CHECK_OK(lum_scene_put_material(scene, "white", &m, err));
}
static void move_camera(struct lum_scene *scene)
{
    struct lum_camera camera = {{1, 1, 5}, {0, 0, 0}, {0, 1, 0}, 45, false};
    CHECK_OK(lum_scene_put_camera(scene, "main", &camera, err));
}
static void hide_b(struct lum_scene *scene)
{
    struct lum_object_desc o = {.mesh = "box", .material = "white", .local_to_world = at(3, 0, 0), .visible = false};
    CHECK_OK(lum_scene_put_object(scene, "b", &o, err));
}
static void make_see_through(struct lum_scene *scene)
{
    struct lum_material_desc m = lum_material_default();
    m.alpha_mode = LUM_ALPHA_BLEND;
    m.alpha = 0.5f;
    CHECK_OK(lum_scene_put_material(scene, "white", &m, err));
}
static void replace_a(struct lum_scene *scene)
{
    CHECK_OK(lum_scene_remove(scene, LUM_ENTITY_OBJECT, "a", err));
    put_object(scene, "aa", "ball", "white", at(0, 0, 0));
}
static void project_slide(struct lum_scene *scene)
{
    const float texel[3] = {1, 2, 3};
    struct lum_image_desc image = {LUM_TEXEL_RGB32F, 1, 1, texel};
    CHECK_OK(lum_scene_put_image(scene, "slide", &image, err));
    struct lum_material_desc m = lum_material_default();
    m.emission_cd_m2 = 50.0;
    m.emission_texture.image = "slide";
    CHECK_OK(lum_scene_put_material(scene, "glow", &m, err));
}
static void thicken_fog(struct lum_scene *scene)
{
    put_fog(scene, "fog", 0.5f);
}
static void remove_fog(struct lum_scene *scene)
{
    CHECK_OK(lum_scene_remove(scene, LUM_ENTITY_MEDIUM, "fog", err));
}
static void add_clear_air(struct lum_scene *scene)
{
    put_fog(scene, "air", 0.0f);
}
static void put_the_same(struct lum_scene *scene)
{
    put_fog(scene, "fog", 0.25f);
    put_material(scene, "white");
    put_object(scene, "a", "ball", "white", at(0, 0, 0));
    struct lum_light_desc l = light_desc(&lum_light_kind_quad);
    put_light(scene, "key", &l);
}

/* Which counters each edit raises; everything else is shared. The extent stays the same, so that nothing is replaced.
 */
static void edits_raise_only_their_counters(void **state)
{
    struct fixture *f = *state;
    const struct {
        const char *name;
        void (*edit)(struct lum_scene *scene);
        unsigned geometry, material, light_shape, light_power, medium;
    } rows[] = {
        {"dim_key", dim_key, 0, 0, 0, 1, 0},
        {"switch_key_off", switch_key_off, 0, 0, 0, 1, 0},
        {"regroup_key", regroup_key, 0, 0, 0, 1, 0},
        {"move_key", move_key, 1, 0, 1, 0, 0}, /* its emitter is a surface */
        {"move_fill", move_fill, 0, 0, 1, 0, 0},
        {"add_point", add_point, 0, 0, 1, 1, 0},
        {"move_a", move_a, 1, 0, 0, 0, 0},
        {"move_lamp", move_lamp, 1, 0, 1, 0, 0},
        {"grow_lamp", grow_lamp, 1, 0, 1, 0, 0},
        {"dim_lamp", dim_lamp, 0, 0, 0, 1, 0},
        {"kill_lamp", kill_lamp, 0, 0, 1, 1, 0},
        {"set_flux_of_lamp", set_flux_of_lamp, 0, 0, 0, 1, 0},
        {"colour_lamp", colour_lamp, 0, 0, 0, 1, 0},
        {"switch_lamp_off", switch_lamp_off, 0, 0, 0, 1, 0},
        {"regroup_lamp", regroup_lamp, 0, 0, 0, 1, 0},
        {"paint", paint, 0, 1, 0, 0, 0},
        {"move_camera", move_camera, 0, 0, 0, 0, 0},
        {"hide_b", hide_b, 1, 0, 0, 0, 0},
        {"make_see_through", make_see_through, 1, 1, 0, 0, 0},
        {"replace_a", replace_a, 1, 0, 0, 0, 0},         /* it may have another material */
        {"project_slide", project_slide, 0, 1, 0, 0, 0}, /* the response to the emitter, not its power */
        {"thicken_fog", thicken_fog, 0, 0, 0, 0, 1},
        {"remove_fog", remove_fog, 0, 0, 0, 0, 1},
        {"add_clear_air", add_clear_air, 0, 0, 0, 0, 0},
        {"put_the_same", put_the_same, 0, 0, 0, 0, 0},
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        lum_scene_destroy(f->scene);
        f->scene = NULL;
        CHECK_OK(lum_scene_create(f->device, &f->scene, err));
        furnish(f->scene);
        const struct lum_snapshot *before = commit(f);
        rows[i].edit(f->scene);
        const struct lum_snapshot *after = commit(f);
        const struct lum_versions *v = &before->versions, *w = &after->versions;
        if (w->geometry - v->geometry != rows[i].geometry || w->material - v->material != rows[i].material ||
            w->light_shape - v->light_shape != rows[i].light_shape ||
            w->light_power - v->light_power != rows[i].light_power || w->medium - v->medium != rows[i].medium)
            fail_msg("%s: geometry +%u, material +%u, light shape +%u, light power +%u, medium +%u", rows[i].name,
                     (unsigned)(w->geometry - v->geometry), (unsigned)(w->material - v->material),
                     (unsigned)(w->light_shape - v->light_shape), (unsigned)(w->light_power - v->light_power),
                     (unsigned)(w->medium - v->medium));
        assert_memory_equal(&before->norm, &after->norm, sizeof after->norm);
        assert_int_equal(after->scene_rev, before->scene_rev + 1);
        if (!rows[i].geometry)
            assert_ptr_equal(before->top, after->top);
        if (!rows[i].material && !rows[i].light_power)
            assert_ptr_equal(before->materials, after->materials);
        if (!rows[i].geometry && !rows[i].light_shape && !rows[i].light_power && rows[i].edit != project_slide)
            assert_ptr_equal(before->lights.lights, after->lights.lights);
        assert_ptr_equal(before->instances[0].mesh, after->instances[0].mesh);
        lum_snapshot_unref(before);
        lum_snapshot_unref(after);
    }
}

/* The same content in a scene made anew: no version of the old one stands for it. */
static void a_successor_changes_every_version(void **state)
{
    struct fixture *f = *state;
    struct lum_scene *next;
    furnish(f->scene);
    const struct lum_snapshot *before = commit(f);
    assert_int_equal(lum_scene_create(f->device, &next, NULL), LUM_OK);
    lum_scene_succeed(next, f->scene);
    lum_scene_destroy(f->scene);
    f->scene = next;
    furnish(f->scene);
    const struct lum_snapshot *after = commit(f);
    const struct lum_versions *v = &before->versions, *w = &after->versions;
    assert_true(w->geometry > v->geometry && w->material > v->material && w->light_shape > v->light_shape &&
                w->light_power > v->light_power && w->medium > v->medium);
    lum_snapshot_unref(before);
    lum_snapshot_unref(after);
}

static void snapshots_outlive_the_scene(void **state)
{
    struct fixture *f = *state;
    furnish(f->scene);
    const struct lum_snapshot *s = commit(f), *same = lum_snapshot_ref(s);
    lum_scene_destroy(f->scene);
    f->scene = NULL;
    lum_snapshot_unref(same);
    struct lum_rays rays = {.n = 1};
    struct lum_hits hits;
    set_ray(&rays, 0, to_scene(s, 0, 0, 5), lum_v3(0.0f, 0.0f, -1.0f));
    trace(s, &rays, &hits);
    assert_string_equal(s->instances[hits.object[0]].id, "a");
    lum_snapshot_unref(s);
}

/* ---- order ---- */

/* [H38] Ids in any order give the same snapshot, byte for byte. */
static void order_of_arrival_does_not_matter(void **state)
{
    struct fixture *f = *state;
    const char *const ids[] = {"m", "b", "zz", "a", "k9", "c", "Q", "0", "k10", "y"};
    enum { N = LUM_ARRAY_LEN(ids) };
    const struct lum_snapshot *first = NULL;
    struct random_stream r = {12};
    for (int round = 0; round < 5; round++) {
        lum_scene_destroy(f->scene);
        f->scene = NULL;
        CHECK_OK(lum_scene_create(f->device, &f->scene, err));
        put_shape(f->scene, "box", "box", 1, 1);
        uint32_t order[N];
        for (uint32_t i = 0; i < N; i++)
            order[i] = i;
        for (uint32_t i = N; round && i-- > 1;) {
            uint32_t j = random_bits(&r) % (i + 1), k = order[i];
            order[i] = order[j];
            order[j] = k;
        }
        for (uint32_t i = 0; i < N; i++) {
            uint32_t k = order[i];
            put_emissive(f->scene, ids[k], k % 3 ? 0.0 : 10.0 * k + 1.0);
            put_object(f->scene, ids[k], "box", ids[k], at(2.0 * k, k % 3, k % 5));
            static const struct lum_light_kind_row *const kinds[] = {&lum_light_kind_point,       &lum_light_kind_spot,
                                                                     &lum_light_kind_directional, &lum_light_kind_quad,
                                                                     &lum_light_kind_sphere,      &lum_light_kind_disc};
            struct lum_light_desc l = light_desc(kinds[k % LUM_ARRAY_LEN(kinds)]);
            l.position.x = k;
            put_light(f->scene, ids[k], &l);
        }
        const struct lum_snapshot *s = commit(f);
        for (uint32_t i = 0; i + 1 < s->n_instances; i++)
            assert_true(strcmp(s->instances[i].id, s->instances[i + 1].id) < 0);
        if (first) {
            assert_int_equal(s->lights.n_lights, first->lights.n_lights);
            for (uint32_t i = 0; i < N; i++) {
                assert_string_equal(s->instances[i].id, first->instances[i].id);
                assert_memory_equal(&s->instances[i].local_to_scene, &first->instances[i].local_to_scene,
                                    sizeof(struct lum_affine));
                assert_int_equal(s->instances[i].material, first->instances[i].material);
                assert_int_equal(s->instances[i].light, first->instances[i].light);
            }
            assert_memory_equal(s->lights.pick_pdf, first->lights.pick_pdf, s->lights.n_lights * sizeof(float));
            lum_snapshot_unref(s);
        } else {
            first = s;
        }
    }
    lum_snapshot_unref(first);
}

/* A fork goes its own way: what it has in common is shared, what differs has versions that the scene never comes to,
 * and neither sees edits of the other. */
static void a_fork_goes_its_own_way(void **state)
{
    struct fixture *f = *state;
    const uint64_t step = (uint64_t)1 << 40;
    struct lum_scene *fork, *other;
    furnish(f->scene);
    const struct lum_snapshot *s = commit(f), *same, *dimmed, *moved, *after;
    CHECK_OK(lum_scene_fork(f->scene, step, &fork, err));
    CHECK_OK(lum_scene_commit(fork, 1, &same, err));
    assert_memory_equal(&same->versions, &s->versions, sizeof s->versions);
    assert_true(same->top == s->top && same->instances == s->instances && same->lights.lights == s->lights.lights);
    dim_key(fork);
    CHECK_OK(lum_scene_commit(fork, 2, &dimmed, err));
    assert_int_equal(dimmed->versions.light_power, s->versions.light_power + step);
    assert_int_equal(dimmed->versions.geometry, s->versions.geometry);
    assert_ptr_equal(dimmed->top, s->top);
    CHECK_OK(lum_scene_fork(f->scene, 2 * step, &other, err));
    move_a(other);
    CHECK_OK(lum_scene_commit(other, 3, &moved, err));
    assert_int_equal(moved->versions.geometry, s->versions.geometry + 2 * step);
    assert_ptr_equal(moved->instances[0].mesh, s->instances[0].mesh);
    CHECK_OK(lum_scene_remove(other, LUM_ENTITY_LIGHT, "key", err)); /* users are counted anew in each */
    CHECK_OK(lum_scene_remove(other, LUM_ENTITY_OBJECT, "a", err));
    lum_scene_destroy(fork);
    lum_scene_destroy(other);
    after = commit(f);
    assert_memory_equal(&after->versions, &s->versions, sizeof s->versions);
    const struct lum_snapshot *const all[] = {s, same, dimmed, moved, after};
    for (size_t i = 0; i < LUM_ARRAY_LEN(all); i++)
        lum_snapshot_unref(all[i]);
}

int main(void)
{
#define TEST(function) cmocka_unit_test_setup_teardown(function, fixture_setup, fixture_teardown)
    const struct CMUnitTest tests[] = {
        TEST(edits_raise_only_their_counters), TEST(a_successor_changes_every_version), TEST(a_fork_goes_its_own_way),
        TEST(snapshots_outlive_the_scene),     TEST(order_of_arrival_does_not_matter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
