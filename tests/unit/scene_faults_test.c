/* Allocations that fail: the scene stays what it was. */
#include "core/scene/scene.h"
#include "tests/support/scene_fixture.h"

/* Every allocation of the call fails in turn; after each failure the scene must commit to what it was before. */
static void sweep(struct fixture *f, const char *name, enum lum_status (*act)(struct fixture *f))
{
    const struct lum_snapshot *before = commit(f);
    for (uint64_t k = 1;; k++) {
        lum_alloc_fail_after(k);
        enum lum_status status = act(f);
        lum_alloc_fail_after(0);
        if (status == LUM_OK)
            break;
        if (status != LUM_ERR_NOMEM || k > 1000)
            fail_msg("%s: allocation %u: %s", name, (unsigned)k, lum_status_text(status));
        const struct lum_snapshot *after = commit(f);
        assert_ptr_equal(before->top, after->top);
        assert_memory_equal(&before->versions, &after->versions, sizeof after->versions);
        lum_snapshot_unref(after);
    }
    lum_snapshot_unref(before);
}
static enum lum_status act_mesh(struct fixture *f)
{
    const float p[] = {0, 0, 0, 1, 0, 0, 0, 0, 1}, n[] = {0, 1, 0, 0, 1, 0, 0, 1, 0}, uv[] = {0, 0, 1, 0, 0, 1};
    const float along[] = {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1};
    const uint32_t t[] = {0, 2, 1};
    struct lum_mesh_desc d = {.positions_f = p,
                              .normals = n,
                              .uvs = uv,
                              .tangents = along,
                              .colors = n,
                              .indices = t,
                              .n_vertices = 3,
                              .n_triangles = 1};
    return lum_scene_put_mesh(f->scene, "new", &d, NULL);
}
static enum lum_status act_image(struct fixture *f)
{
    const uint8_t texel[4] = {1, 2, 3, 4};
    struct lum_image_desc d = {LUM_TEXEL_SRGB8, 1, 1, texel};
    return lum_scene_put_image(f->scene, "new", &d, NULL);
}
static enum lum_status act_material(struct fixture *f)
{
    struct lum_material_desc d = lum_material_default();
    d.base_color_texture.image = "new";
    return lum_scene_put_material(f->scene, "new", &d, NULL);
}
static enum lum_status act_object(struct fixture *f)
{
    struct lum_object_desc d = {.mesh = "box", .material = "white", .local_to_world = at(1, 1, 1), .visible = true};
    return lum_scene_put_object(f->scene, "new", &d, NULL);
}
static enum lum_status act_light(struct fixture *f)
{
    struct lum_light_desc d = light_desc(&lum_light_kind_environment);
    d.image = "new";
    return lum_scene_put_light(f->scene, "new", &d, NULL);
}
static enum lum_status act_camera(struct fixture *f)
{
    struct lum_camera c = {{0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 45, false};
    return lum_scene_put_camera(f->scene, "new", &c, NULL);
}

static void switch_on(void *user, struct lum_light *light)
{
    light->on = user != NULL;
}
/* Other light makes a snapshot of its own, and the scene knows nothing of it. */
static void sweep_relit(struct fixture *f)
{
    const struct lum_snapshot *whole = commit(f), *relit = NULL;
    enum lum_status status = LUM_ERR_NOMEM;
    uint64_t k = 1;
    for (; status == LUM_ERR_NOMEM && k < 100; k++) {
        lum_alloc_fail_after(k);
        status = lum_snapshot_relit(whole, switch_on, f, &relit, NULL);
        lum_alloc_fail_after(0);
    }
    assert_int_equal(status, LUM_OK);
    assert_true(k > 3);        /* some did fail */
    lum_snapshot_unref(whole); /* the other one keeps what it needs */
    assert_int_equal(relit->lights.n_lights, relit->whole->lights.n_lights);
    lum_snapshot_unref(relit);
}

/* Another scene beside it leaves it alone, and can be made a snapshot of. */
static void sweep_fork(struct fixture *f)
{
    const struct lum_snapshot *before = commit(f), *s = NULL;
    struct lum_scene *fork = NULL;
    enum lum_status status = LUM_ERR_NOMEM;
    uint64_t k = 1;
    for (; status == LUM_ERR_NOMEM && k < 1000; k++) {
        lum_alloc_fail_after(k);
        status = lum_scene_fork(f->scene, 1u << 20, &fork, NULL);
        lum_alloc_fail_after(0);
    }
    assert_int_equal(status, LUM_OK);
    assert_true(k > 10);
    const struct lum_snapshot *after = commit(f);
    assert_memory_equal(&before->versions, &after->versions, sizeof after->versions);
    lum_snapshot_unref(before);
    lum_snapshot_unref(after);
    lum_scene_destroy(f->scene); /* it keeps what it needs */
    f->scene = fork;
    CHECK_OK(lum_scene_commit(fork, 9, &s, err));
    assert_true(s->n_instances > 0 && s->scene_rev == 9);
    lum_snapshot_unref(s);
}

static void failing_allocations_change_nothing(void **state)
{
    struct fixture *f = *state;
    furnish(f->scene);
    sweep(f, "mesh", act_mesh);
    sweep(f, "image", act_image);
    sweep(f, "material", act_material);
    sweep(f, "object", act_object);
    sweep(f, "light", act_light);
    sweep(f, "camera", act_camera);
    sweep_relit(f);
    sweep_fork(f);
}

/* A commit that fails leaves its edits pending; the first that succeeds publishes them. */
static void failing_commits_keep_the_edits(void **state)
{
    struct fixture *f = *state;
    furnish(f->scene);
    const struct lum_snapshot *before = commit(f), *s = NULL;
    assert_int_equal(act_image(f), LUM_OK);
    assert_int_equal(act_light(f), LUM_OK); /* its distribution is made by the commit */
    put_object(f->scene, "a", "ball", "white", at(0.25, 0, 0));
    put_object(f->scene, "lamp", "ball", "glow", scaled_at(0.625, 0, 3, 0));
    uint64_t failures = 0;
    for (;; failures++) {
        lum_alloc_fail_after(failures + 1);
        enum lum_status status = lum_scene_commit(f->scene, 77, &s, NULL);
        lum_alloc_fail_after(0);
        if (status == LUM_OK)
            break;
        assert_int_equal(status, LUM_ERR_NOMEM);
        assert_null(s);
        assert_true(failures < 1000);
    }
    assert_true(failures > 10);
    assert_int_equal(s->versions.geometry, before->versions.geometry + 1);
    assert_int_equal(s->lights.n_lights, before->lights.n_lights + 1);
    assert_int_equal(s->scene_rev, 77);
    lum_snapshot_unref(before);
    lum_snapshot_unref(s);
}

int main(void)
{
#define TEST(function) cmocka_unit_test_setup_teardown(function, fixture_setup, fixture_teardown)
    const struct CMUnitTest tests[] = {
        TEST(failing_allocations_change_nothing),
        TEST(failing_commits_keep_the_edits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
