/* The scene's tables and what they refuse; cameras, bounds, placement, meshes that deform. */
#include <string.h>

#include "core/accel/trace.h"
#include "core/scene/scene.h"
#include "core/scene/surface.h"
#include "tests/support/scene_fixture.h"

/* ---- ids and references ---- */

static void ids_have_1_to_64_bytes(void **state)
{
    struct fixture *f = *state;
    struct lum_material_desc m = lum_material_default();
    struct lum_error refusal;
    char id[LUM_ID_MAX + 2];
    memset(id, 'x', sizeof id);
    id[LUM_ID_MAX + 1] = 0;
    assert_int_equal(lum_scene_put_material(f->scene, id, &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "id");
    id[LUM_ID_MAX] = 0;
    CHECK_OK(lum_scene_put_material(f->scene, id, &m, err));
    CHECK_OK(lum_scene_remove(f->scene, LUM_ENTITY_MATERIAL, id, err));
    id[1] = 0;
    CHECK_OK(lum_scene_put_material(f->scene, id, &m, err));
    assert_int_equal(lum_scene_put_material(f->scene, "", &m, &refusal), LUM_ERR_INVALID);
    assert_int_equal(lum_scene_put_material(f->scene, NULL, &m, &refusal), LUM_ERR_INVALID);
    assert_int_equal(lum_scene_put_material(f->scene, "a\nb", &m, &refusal), LUM_ERR_INVALID);
}

static void what_is_referred_to_stays(void **state)
{
    struct fixture *f = *state;
    struct lum_error refusal;
    furnish(f->scene);
    assert_int_equal(lum_scene_remove(f->scene, LUM_ENTITY_MESH, "ball", &refusal), LUM_ERR_CONFLICT);
    assert_int_equal(lum_scene_remove(f->scene, LUM_ENTITY_MATERIAL, "white", &refusal), LUM_ERR_CONFLICT);
    assert_int_equal(lum_scene_remove(f->scene, LUM_ENTITY_OBJECT, "nobody", &refusal), LUM_ERR_NOT_FOUND);
    put_object(f->scene, "a", "box", "white", at(0, 0, 0)); /* now only the lamp is a ball */
    assert_int_equal(lum_scene_remove(f->scene, LUM_ENTITY_MESH, "ball", &refusal), LUM_ERR_CONFLICT);
    CHECK_OK(lum_scene_remove(f->scene, LUM_ENTITY_OBJECT, "lamp", err));
    CHECK_OK(lum_scene_remove(f->scene, LUM_ENTITY_MESH, "ball", err));
    CHECK_OK(lum_scene_remove(f->scene, LUM_ENTITY_MATERIAL, "glow", err));
    struct lum_object_desc o = {.mesh = "ball", .material = "white", .local_to_world = at(0, 0, 0), .visible = true};
    assert_int_equal(lum_scene_put_object(f->scene, "c", &o, &refusal), LUM_ERR_NOT_FOUND);
    assert_string_equal(refusal.field, "mesh");
    o.mesh = "box";
    o.material = NULL;
    assert_int_equal(lum_scene_put_object(f->scene, "c", &o, &refusal), LUM_ERR_NOT_FOUND);
    assert_string_equal(refusal.field, "material");
}

static void images_are_held_by_materials_and_environments(void **state)
{
    struct fixture *f = *state;
    struct lum_error refusal;
    const float texels[6] = {1, 2, 3, 4, 5, 6};
    struct lum_image_desc image = {LUM_TEXEL_RGB32F, 2, 1, texels};
    CHECK_OK(lum_scene_put_image(f->scene, "sky", &image, err));
    struct lum_light_desc env = light_desc(&lum_light_kind_environment);
    env.image = "sky";
    put_light(f->scene, "env", &env);
    assert_int_equal(lum_scene_remove(f->scene, LUM_ENTITY_IMAGE, "sky", &refusal), LUM_ERR_CONFLICT);
    const struct lum_snapshot *s = commit(f);
    assert_non_null(s->lights.lights[0].env);
    assert_int_equal(s->lights.environment, 0);
    env.image = NULL;
    put_light(f->scene, "env", &env);
    struct lum_material_desc m = lum_material_default();
    m.base_color_texture.image = "sky";
    CHECK_OK(lum_scene_put_material(f->scene, "painted", &m, err));
    assert_int_equal(lum_scene_remove(f->scene, LUM_ENTITY_IMAGE, "sky", &refusal), LUM_ERR_CONFLICT);
    m.base_color_texture.image = "";
    CHECK_OK(lum_scene_put_material(f->scene, "painted", &m, err));
    CHECK_OK(lum_scene_remove(f->scene, LUM_ENTITY_IMAGE, "sky", err));
    assert_non_null(s->lights.lights[0].env); /* the snapshot keeps it */
    lum_snapshot_unref(s);
    image.width = 0;
    assert_int_equal(lum_scene_put_image(f->scene, "sky", &image, &refusal), LUM_ERR_LIMIT);
    image.width = 16385;
    assert_int_equal(lum_scene_put_image(f->scene, "sky", &image, &refusal), LUM_ERR_LIMIT);
}

static void broken_texels_are_zeroed_and_counted(void **state)
{
    struct fixture *f = *state;
    const float texels[12] = {1, 2, 3, NAN, 5, 6, 7, INFINITY, -INFINITY, -1, 0, 1e30f};
    struct lum_image_desc image = {LUM_TEXEL_RGB32F, 4, 1, texels};
    CHECK_OK(lum_scene_put_image(f->scene, "sky", &image, err));
    assert_int_equal(lum_scene_dropped_texels(f->scene), 3);
    struct lum_material_desc m = lum_material_default();
    m.base_color_texture.image = "sky";
    CHECK_OK(lum_scene_put_material(f->scene, "painted", &m, err));
    const struct lum_snapshot *s = commit(f);
    const float *got = s->materials[0].base_color_tex.image->pixels;
    const float want[12] = {1, 2, 3, 0, 5, 6, 7, 0, 0, 0, 0, 1e12f};
    assert_memory_equal(got, want, sizeof want);
    lum_snapshot_unref(s);
}

/* ---- refusals ---- */

static void refuse_object(struct lum_scene *scene, struct lum_affined m)
{
    struct lum_error refusal;
    struct lum_object_desc o = {.mesh = "box", .material = "white", .local_to_world = m, .visible = true};
    assert_int_equal(lum_scene_put_object(scene, "b", &o, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "transform");
}

/* [H5] And the object stays as it was. */
static void singular_transforms_are_refused(void **state)
{
    struct fixture *f = *state;
    furnish(f->scene);
    const struct lum_snapshot *before = commit(f);
    refuse_object(f->scene, (struct lum_affined){{{0}}});
    refuse_object(f->scene, (struct lum_affined){{{1, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 1, 0}}});
    refuse_object(f->scene, (struct lum_affined){{{1, 2, 3, 0}, {2, 4, 6, 0}, {0, 0, 1, 0}}});
    refuse_object(f->scene, (struct lum_affined){{{1, 0, 0, (double)NAN}, {0, 1, 0, 0}, {0, 0, 1, 0}}});
    refuse_object(f->scene, (struct lum_affined){{{(double)INFINITY, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}});
    refuse_object(f->scene, scaled_at(1, 1e16, 0, 0));
    const struct lum_snapshot *after = commit(f);
    assert_ptr_equal(before->top, after->top);
    assert_memory_equal(&before->versions, &after->versions, sizeof after->versions);
    lum_snapshot_unref(before);
    lum_snapshot_unref(after);
}

static void values_out_of_range_name_their_field(void **state)
{
    struct fixture *f = *state;
    struct lum_error refusal;
    const float nan = NAN;
#define REFUSE_MATERIAL(member, value, name)                                                                           \
    do {                                                                                                               \
        struct lum_material_desc m = lum_material_default();                                                           \
        m.member = value;                                                                                              \
        assert_int_equal(lum_scene_put_material(f->scene, "m", &m, &refusal), LUM_ERR_INVALID);                        \
        assert_string_equal(refusal.field, name);                                                                      \
    } while (0)
    REFUSE_MATERIAL(roughness, 1.1f, "roughness");
    REFUSE_MATERIAL(roughness, nan, "roughness");
    REFUSE_MATERIAL(metallic, -0.1f, "metallic");
    REFUSE_MATERIAL(ior, 0.9f, "ior");
    REFUSE_MATERIAL(base_color.g, 1.5f, "base_color");
    REFUSE_MATERIAL(base_color.b, nan, "base_color");
    REFUSE_MATERIAL(emission_cd_m2, -1.0, "emission_cd_m2");
    REFUSE_MATERIAL(attenuation_distance_m, 0.0, "attenuation_distance_m");
    REFUSE_MATERIAL(alpha, nan, "alpha");
    REFUSE_MATERIAL(alpha_mode, (enum lum_alpha_mode)3, "alpha_mode");
#define REFUSE_LIGHT(light_kind, member, value, name)                                                                  \
    do {                                                                                                               \
        struct lum_light_desc l = light_desc(light_kind);                                                              \
        l.member = value;                                                                                              \
        assert_int_equal(lum_scene_put_light(f->scene, "l", &l, &refusal), LUM_ERR_INVALID);                           \
        assert_string_equal(refusal.field, name);                                                                      \
    } while (0)
    REFUSE_LIGHT(&lum_light_kind_point, position.x, (double)NAN, "position");
    REFUSE_LIGHT(&lum_light_kind_point, intensity, (double)INFINITY, "intensity");
    REFUSE_LIGHT(&lum_light_kind_point, color.r, -1.0f, "color");
    REFUSE_LIGHT(&lum_light_kind_spot, direction, ((struct lum_vec3d){0, 0, 0}), "direction");
    REFUSE_LIGHT(&lum_light_kind_spot, outer_cone_rad, 1.6, "outer_cone_rad");
    REFUSE_LIGHT(&lum_light_kind_spot, inner_cone_rad, 0.6, "inner_cone_rad");
    REFUSE_LIGHT(&lum_light_kind_sphere, radius_m, 0.0, "radius_m");
    REFUSE_LIGHT(&lum_light_kind_disc, radius_m, -1.0, "radius_m");
    REFUSE_LIGHT(&lum_light_kind_quad, v, ((struct lum_vec3d){2, 0, 0}), "u");
    REFUSE_LIGHT(&lum_light_kind_environment, rotation_rad, (double)NAN, "rotation_rad");
    struct lum_camera camera = {{0, 1, 5}, {0, 1, 5}, {0, 1, 0}, 45, false};
    assert_int_equal(lum_scene_put_camera(f->scene, "c", &camera, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "target");
    camera = (struct lum_camera){{0, 1, 5}, {0, 0, 5}, {0, 1, 0}, 45, false};
    assert_int_equal(lum_scene_put_camera(f->scene, "c", &camera, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "up");
    camera = (struct lum_camera){{0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 180, false};
    assert_int_equal(lum_scene_put_camera(f->scene, "c", &camera, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "vfov_deg");
    const struct lum_snapshot *s = commit(f);
    assert_int_equal(s->n_materials + s->lights.n_lights, 0);
    lum_snapshot_unref(s);
}

/* ---- cameras ---- */

static void main_is_the_default_camera(void **state)
{
    struct fixture *f = *state;
    struct lum_camera camera = {{0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 45, false}, found;
    CHECK_OK(lum_scene_put_camera(f->scene, "alpha", &camera, err));
    const struct lum_snapshot *s = commit(f);
    CHECK_OK(lum_snapshot_camera(s, NULL, &found, err));
    assert_int_equal(lum_snapshot_camera(s, "main", &found, NULL), LUM_ERR_NOT_FOUND);
    lum_snapshot_unref(s);
    camera.vfov_deg = 30;
    CHECK_OK(lum_scene_put_camera(f->scene, "main", &camera, err));
    s = commit(f);
    CHECK_OK(lum_snapshot_camera(s, NULL, &found, err));
    assert_true(found.vfov_deg == 30.0);
    CHECK_OK(lum_snapshot_camera(s, "alpha", &found, err));
    assert_true(found.vfov_deg == 45.0);
    lum_snapshot_unref(s);
}

/* All of the bounds lies inside the picture's cone, wherever the scene is. */
static void the_framing_camera_sees_everything(void **state)
{
    struct fixture *f = *state;
    furnish(f->scene);
    put_object(f->scene, "far", "box", "white", scaled_at(100, 1e5, -2e4, 300));
    const struct lum_snapshot *s = commit(f);
    struct lum_camera c = lum_snapshot_framing_camera(s);
    struct lum_vec3 eye = to_scene(s, c.position.x, c.position.y, c.position.z);
    struct lum_vec3 gaze = lum_normalize(lum_v3_sub(to_scene(s, c.target.x, c.target.y, c.target.z), eye));
    struct lum_vec3 right = lum_normalize(lum_cross(gaze, lum_v3(0, 1, 0))), up = lum_cross(right, gaze);
    float slope = tanf(0.5f * (float)c.vfov_deg * LUM_PI / 180.0f), most = 0.0f;
    for (int k = 0; k < 8; k++) {
        struct lum_vec3 p = lum_v3(k & 1 ? s->bounds_hi.x : s->bounds_lo.x, k & 2 ? s->bounds_hi.y : s->bounds_lo.y,
                                   k & 4 ? s->bounds_hi.z : s->bounds_lo.z);
        struct lum_vec3 d = lum_v3_sub(p, eye);
        float ahead = lum_dot(d, gaze) * slope;
        assert_true(ahead > 0.0f);
        most = fmaxf(most, fmaxf(fabsf(lum_dot(d, up)), fabsf(lum_dot(d, right)) / 1.25f) / ahead);
    }
    assert_true(most > 0.89f && most < 0.93f); /* of a picture 5 : 4; 1 / 1.1 */
    lum_snapshot_unref(s);
}

static void bounds_are_of_one_object_or_of_all_below(void **state)
{
    struct fixture *f = *state;
    struct lum_box b;
    furnish(f->scene);
    put_object(f->scene, "room/a", "box", "white", scaled_at(2, 10, 0, 0));
    put_object(f->scene, "room/b", "box", "white", scaled_at(1, 20, 5, 0));
    put_object(f->scene, "roomy", "box", "white", scaled_at(1, -500, 0, 0));
    const struct lum_snapshot *s = commit(f);
    /* Float coordinates in a scene of 520 m: 2^-24 of that is 3e-5. */
    const double eps = 1e-4;
    assert_true(lum_snapshot_bounds(s, "room", &b));
    assert_true(fabs(b.lo.x - 9) < eps && fabs(b.hi.x - 20.5) < eps && fabs(b.lo.y + 1) < eps &&
                fabs(b.hi.y - 5.5) < eps);
    assert_true(lum_snapshot_bounds(s, "room/b", &b));
    assert_true(fabs(b.lo.x - 19.5) < eps && fabs(b.hi.x - 20.5) < eps && fabs(b.lo.z + 0.5) < eps);
    assert_false(lum_snapshot_bounds(s, "roo", &b));
    lum_snapshot_unref(s);
}

/* ---- normalisation ---- */

static void placement_has_hysteresis(void **state)
{
    struct fixture *f = *state;
    furnish(f->scene);
    const struct lum_snapshot *s = commit(f);
    struct lum_normalisation first = s->norm;
    float extent = fmaxf(s->bounds_hi.x - s->bounds_lo.x, s->bounds_hi.y - s->bounds_lo.y);
    assert_true(extent >= 32.0f && extent <= 64.0f);
    lum_snapshot_unref(s);
    put_object(f->scene, "b", "box", "white", at(4, 0, 0)); /* a little larger: nothing else moves */
    s = commit(f);
    assert_memory_equal(&s->norm, &first, sizeof first);
    lum_snapshot_unref(s);
    put_object(f->scene, "b", "box", "white", at(400, 0, 0));
    s = commit(f);
    assert_true(s->norm.scale < first.scale);
    assert_true(s->bounds_hi.x <= 64.0f && s->bounds_lo.x >= -64.0f);
    struct lum_versions v = s->versions;
    lum_snapshot_unref(s);
    put_object(f->scene, "b", "box", "white",
               at(3, 0, 0)); /* back: the extent is below 8 units, so it is placed anew */
    s = commit(f);
    assert_memory_equal(&s->norm, &first, sizeof first);
    assert_int_equal(s->versions.geometry, v.geometry + 1);
    lum_snapshot_unref(s);
}

static void an_empty_scene_is_a_scene(void **state)
{
    struct fixture *f = *state;
    const struct lum_snapshot *s = commit(f);
    assert_int_equal(s->n_instances + s->n_materials + s->lights.n_lights, 0);
    assert_int_equal(s->lights.environment, LUM_NO_OBJECT);
    assert_true(s->bounds_lo.x > s->bounds_hi.x);
    struct lum_rays rays = {.n = 1};
    struct lum_hits hits;
    set_ray(&rays, 0, lum_v3(0.0f, 0.0f, 0.0f), lum_v3(1.0f, 0.0f, 0.0f));
    trace(s, &rays, &hits);
    assert_int_equal(hits.object[0], LUM_NO_OBJECT);
    lum_snapshot_framing_camera(s);
    lum_snapshot_unref(s);
}

/* Too small against the rest to be seen: left out, not handed to Embree, which would stop the process. */
static void what_is_below_precision_is_left_out(void **state)
{
    struct fixture *f = *state;
    furnish(f->scene);
    put_object(f->scene, "speck", "box", "white", scaled_at(1e-13, 1, 0, 0));
    const struct lum_snapshot *s = commit(f);
    for (uint32_t i = 0; i < s->n_instances; i++)
        assert_string_not_equal(s->instances[i].id, "speck");
    lum_snapshot_unref(s);
}

/* ---- deforming meshes ---- */

static void put_pose(struct fixture *f, float height)
{
    const float p[] = {0, 0, 0, 1, 0, 0, 0, 0, 1, 1, height, 1};
    const uint32_t t[] = {0, 2, 1, 1, 2, 3};
    struct lum_mesh_desc d = {.positions_f = p, .indices = t, .n_vertices = 4, .n_triangles = 2, .deforming = true};
    CHECK_OK(lum_scene_put_mesh(f->scene, "cloth", &d, err));
    put_object(f->scene, "cloth", "cloth", "white", at(0, 0, 0));
}

/* Two structures in turn; a third only while a reader holds both. */
static void deforming_meshes_refit_in_turn(void **state)
{
    struct fixture *f = *state;
    put_material(f->scene, "white");
    const struct lum_snapshot *s[4];
    const struct lum_accel_mesh *accel[6];
    for (int i = 0; i < 6; i++) {
        put_pose(f, 0.125f * (float)i);
        const struct lum_snapshot *snapshot = commit(f);
        accel[i] = snapshot->instances[0].mesh->accel;
        lum_snapshot_unref(snapshot);
    }
    for (int i = 2; i < 6; i++)
        assert_ptr_equal(accel[i], accel[i - 2]);
    assert_ptr_not_equal(accel[0], accel[1]);
    for (int i = 0; i < 4; i++) { /* readers hold on to every pose */
        put_pose(f, 0.25f * (float)i);
        s[i] = commit(f);
        for (int k = 0; k < i; k++)
            assert_ptr_not_equal(s[i]->instances[0].mesh->accel, s[k]->instances[0].mesh->accel);
    }
    for (int i = 0; i < 4; i++) { /* each still sees its own pose */
        struct lum_rays rays = {.n = 1};
        struct lum_hits hits;
        struct lum_surface surface;
        set_ray(&rays, 0, to_scene(s[i], 0.75, 5, 0.75), lum_v3(0.0f, -1.0f, 0.0f));
        trace(s[i], &rays, &hits);
        lum_snapshot_surface(s[i], &hits, 0, lum_v3(0.0f, -1.0f, 0.0f), &surface);
        double y = (double)surface.p.y / s[i]->norm.scale + s[i]->norm.centre.y;
        assert_true(fabs(y - 0.125 * i) < 1e-5); /* half way between 0 and the raised corner */
        lum_snapshot_unref(s[i]);
    }
}

int main(void)
{
#define TEST(function) cmocka_unit_test_setup_teardown(function, fixture_setup, fixture_teardown)
    const struct CMUnitTest tests[] = {
        TEST(ids_have_1_to_64_bytes),
        TEST(what_is_referred_to_stays),
        TEST(images_are_held_by_materials_and_environments),
        TEST(broken_texels_are_zeroed_and_counted),
        TEST(singular_transforms_are_refused),
        TEST(values_out_of_range_name_their_field),
        TEST(main_is_the_default_camera),
        TEST(the_framing_camera_sees_everything),
        TEST(bounds_are_of_one_object_or_of_all_below),
        TEST(placement_has_hysteresis),
        TEST(an_empty_scene_is_a_scene),
        TEST(what_is_below_precision_is_left_out),
        TEST(deforming_meshes_refit_in_turn),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
