/* The scene's tables, what a commit shares, what it counts as changed, and what it refuses. */
#include "tests/support/scene_fixture.h"

#include <stdio.h>
#include <string.h>

static void put_fog(struct lum_scene *scene, const char *id, float sigma_s);

/* A room with one of everything. */
static void fill(struct lum_scene *scene)
{
    put_shape(scene, "ball", "sphere", 16, 8);
    put_shape(scene, "box", "box", 1, 1);
    put_material(scene, "white");
    put_emissive(scene, "glow", 50.0);
    put_object(scene, "a", "ball", "white", at(0, 0, 0));
    put_object(scene, "b", "box", "white", at(3, 0, 0));
    put_object(scene, "lamp", "ball", "glow", scaled_at(0.5, 0, 3, 0));
    struct lum_light_desc l = light_desc(LUM_LIGHT_QUAD);
    put_light(scene, "key", &l);
    l = light_desc(LUM_LIGHT_POINT);
    put_light(scene, "fill", &l);
    struct lum_camera camera = {{0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 45};
    CHECK_OK(lum_scene_put_camera(scene, "main", &camera, err));
    put_fog(scene, "fog", 0.25f);
}

static uint32_t light_index(const struct lum_snapshot *s, const char *id)
{
    for (uint32_t i = 0; i < s->lights.n_lights; i++)
        if (strcmp(s->lights.lights[i].id, id) == 0)
            return i;
    fail_msg("there is no light \"%s\"", id);
    return 0;
}

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
    fill(f->scene);
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
    struct lum_light_desc env = light_desc(LUM_LIGHT_ENVIRONMENT);
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

/* [D5] And the object stays as it was. */
static void singular_transforms_are_refused(void **state)
{
    struct fixture *f = *state;
    fill(f->scene);
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
    REFUSE_LIGHT(LUM_LIGHT_POINT, position.x, (double)NAN, "position");
    REFUSE_LIGHT(LUM_LIGHT_POINT, intensity, (double)INFINITY, "intensity");
    REFUSE_LIGHT(LUM_LIGHT_POINT, color.r, -1.0f, "color");
    REFUSE_LIGHT(LUM_LIGHT_SPOT, direction, ((struct lum_vec3d){0, 0, 0}), "direction");
    REFUSE_LIGHT(LUM_LIGHT_SPOT, outer_cone_rad, 1.6, "outer_cone_rad");
    REFUSE_LIGHT(LUM_LIGHT_SPOT, inner_cone_rad, 0.6, "inner_cone_rad");
    REFUSE_LIGHT(LUM_LIGHT_SPHERE, radius_m, 0.0, "radius_m");
    REFUSE_LIGHT(LUM_LIGHT_DISC, radius_m, -1.0, "radius_m");
    REFUSE_LIGHT(LUM_LIGHT_QUAD, v, ((struct lum_vec3d){2, 0, 0}), "u");
    REFUSE_LIGHT(LUM_LIGHT_ENVIRONMENT, rotation_rad, (double)NAN, "rotation_rad");
    struct lum_camera camera = {{0, 1, 5}, {0, 1, 5}, {0, 1, 0}, 45};
    assert_int_equal(lum_scene_put_camera(f->scene, "c", &camera, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "target");
    camera = (struct lum_camera){{0, 1, 5}, {0, 0, 5}, {0, 1, 0}, 45};
    assert_int_equal(lum_scene_put_camera(f->scene, "c", &camera, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "up");
    camera = (struct lum_camera){{0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 180};
    assert_int_equal(lum_scene_put_camera(f->scene, "c", &camera, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "vfov_deg");
    const struct lum_snapshot *s = commit(f);
    assert_int_equal(s->n_materials + s->lights.n_lights, 0);
    lum_snapshot_unref(s);
}

/* ---- versions and sharing ---- */

static void dim_key(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(LUM_LIGHT_QUAD);
    l.intensity = 7.0;
    put_light(scene, "key", &l);
}
static void switch_key_off(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(LUM_LIGHT_QUAD);
    l.on = false;
    put_light(scene, "key", &l);
}
static void regroup_key(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(LUM_LIGHT_QUAD);
    l.group = "warm";
    put_light(scene, "key", &l);
}
static void move_key(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(LUM_LIGHT_QUAD);
    l.position.x = 0.5;
    put_light(scene, "key", &l);
}
static void move_fill(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(LUM_LIGHT_POINT);
    l.position.x = 0.5;
    put_light(scene, "fill", &l);
}
static void add_point(struct lum_scene *scene)
{
    struct lum_light_desc l = light_desc(LUM_LIGHT_POINT);
    put_light(scene, "third", &l);
}
static void move_a(struct lum_scene *scene)
{
    put_object(scene, "a", "ball", "white", at(0.25, 0, 0));
}
static void move_lamp(struct lum_scene *scene)
{
    put_object(scene, "lamp", "ball", "glow", scaled_at(0.5, 0.25, 3, 0));
}
static void grow_lamp(struct lum_scene *scene)
{
    put_object(scene, "lamp", "ball", "glow", scaled_at(0.625, 0, 3, 0));
}
static void dim_lamp(struct lum_scene *scene)
{
    put_emissive(scene, "glow", 20.0);
}
static void kill_lamp(struct lum_scene *scene)
{
    put_emissive(scene, "glow", 0.0);
}
static void paint(struct lum_scene *scene)
{
    struct lum_material_desc m = lum_material_default();
    m.base_color = lum_rgb(0.5f, 0.1f, 0.1f);
    CHECK_OK(lum_scene_put_material(scene, "white", &m, err));
}
static void move_camera(struct lum_scene *scene)
{
    struct lum_camera camera = {{1, 1, 5}, {0, 0, 0}, {0, 1, 0}, 45};
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
static void put_fog(struct lum_scene *scene, const char *id, float sigma_s)
{
    struct lum_medium_desc m = {.sigma_s = lum_grey(sigma_s), .g = 0.5f, .lo = {-1, -1, -1}, .hi = {1, 1, 1}};
    CHECK_OK(lum_scene_put_medium(scene, id, &m, err));
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
    struct lum_light_desc l = light_desc(LUM_LIGHT_QUAD);
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
        fill(f->scene);
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
        if (!rows[i].geometry && !rows[i].light_shape && !rows[i].light_power)
            assert_ptr_equal(before->lights.lights, after->lights.lights);
        assert_ptr_equal(before->instances[0].mesh, after->instances[0].mesh);
        lum_snapshot_unref(before);
        lum_snapshot_unref(after);
    }
}

/* What a renderer reads of media: those with coefficients, by id, per scene unit. */
static void media_reach_the_snapshot(void **state)
{
    struct fixture *f = *state;
    fill(f->scene); /* 5 m: a scene unit is not a metre */
    struct lum_medium_desc m = {
        .sigma_s = {1, 2, 3}, .sigma_a = {0.5f, 0, 0}, .g = -0.25f, .lo = {-1, 0, 0}, .hi = {3, 4, 5}};
    CHECK_OK(lum_scene_put_medium(f->scene, "b", &m, err));
    m.everywhere = true;
    CHECK_OK(lum_scene_put_medium(f->scene, "a", &m, err));
    put_fog(f->scene, "clear", 0.0f);
    const struct lum_snapshot *s = commit(f);
    float scale = (float)s->norm.scale;
    assert_true(scale > 1.0f);
    assert_int_equal(s->n_media, 3);
    const struct lum_medium *a = &s->media[0], *b = &s->media[1];
    assert_string_equal(a->id, "a");
    assert_string_equal(b->id, "b");
    assert_string_equal(s->media[2].id, "fog");
    assert_true(a->lo.x == -INFINITY && a->hi.z == INFINITY);
    struct lum_vec3 lo = to_scene(s, -1, 0, 0), hi = to_scene(s, 3, 4, 5);
    assert_memory_equal(&b->lo, &lo, sizeof lo);
    assert_memory_equal(&b->hi, &hi, sizeof hi);
    assert_true(b->sigma_s.g * scale == 2.0f && b->sigma_t.r * scale == 1.5f && b->g == -0.25f);
    lum_snapshot_unref(s);
}

static void bad_media_are_refused(void **state)
{
    struct fixture *f = *state;
    struct lum_error refusal;
    const struct lum_medium_desc good = {.sigma_s = {1, 1, 1}, .hi = {1, 1, 1}};
    struct lum_medium_desc m = good;
    m.sigma_s.g = -1.0f;
    assert_int_equal(lum_scene_put_medium(f->scene, "m", &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "sigma_s");
    m = good;
    m.sigma_a.b = NAN;
    assert_int_equal(lum_scene_put_medium(f->scene, "m", &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "sigma_a");
    m = good;
    m.g = 1.0f;
    assert_int_equal(lum_scene_put_medium(f->scene, "m", &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "g");
    m = good;
    m.hi.y = 0.0;
    assert_int_equal(lum_scene_put_medium(f->scene, "m", &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "box");
    m.hi.y = (double)NAN;
    assert_int_equal(lum_scene_put_medium(f->scene, "m", &m, &refusal), LUM_ERR_INVALID);
    m.everywhere = true; /* the box is not looked at */
    m.g = 0.99f;
    CHECK_OK(lum_scene_put_medium(f->scene, "m", &m, err));
    CHECK_OK(lum_scene_remove(f->scene, LUM_ENTITY_MEDIUM, "m", err));
    assert_int_equal(lum_scene_remove(f->scene, LUM_ENTITY_MEDIUM, "m", &refusal), LUM_ERR_NOT_FOUND);
}

/* An edit may put new media before it removes the old ones: only what is published is limited. */
static void too_many_media_are_not_published(void **state)
{
    struct fixture *f = *state;
    char id[] = "fog0";
    for (uint32_t i = 0; i <= LUM_MEDIA_MAX; i++) {
        id[3] = (char)('0' + i);
        put_fog(f->scene, id, 1.0f);
    }
    const struct lum_snapshot *s = NULL;
    struct lum_error refusal;
    assert_int_equal(lum_scene_commit(f->scene, 1, &s, &refusal), LUM_ERR_LIMIT);
    assert_string_equal(refusal.field, "medium");
    assert_null(s);
    CHECK_OK(lum_scene_remove(f->scene, LUM_ENTITY_MEDIUM, "fog0", err));
    s = commit(f);
    assert_int_equal(s->n_media, LUM_MEDIA_MAX);
    lum_snapshot_unref(s);
}

/* The same content in a scene made anew: no version of the old one stands for it. */
static void a_successor_changes_every_version(void **state)
{
    struct fixture *f = *state;
    struct lum_scene *next;
    fill(f->scene);
    const struct lum_snapshot *before = commit(f);
    assert_int_equal(lum_scene_create(f->device, &next, NULL), LUM_OK);
    lum_scene_succeed(next, f->scene);
    lum_scene_destroy(f->scene);
    f->scene = next;
    fill(f->scene);
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
    fill(f->scene);
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

/* [D38] Ids in any order give the same snapshot, byte for byte. */
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
            struct lum_light_desc l = light_desc((enum lum_light_kind)(k % 6));
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

/* ---- units, lights ---- */

static void lengths_and_powers_are_in_scene_units(void **state)
{
    struct fixture *f = *state;
    fill(f->scene);
    struct lum_material_desc glass = lum_material_default();
    glass.attenuation_color = lum_grey(0.25f);
    glass.attenuation_distance_m = 0.5;
    CHECK_OK(lum_scene_put_material(f->scene, "glass", &glass, err));
    const struct lum_snapshot *s = commit(f);
    double scale = s->norm.scale;
    const struct lum_light *fill_light = &s->lights.lights[light_index(s, "fill")];
    assert_true(fabs((double)fill_light->power.g / (100.0 * scale * scale) - 1.0) < 1e-6);
    const struct lum_light *key = &s->lights.lights[light_index(s, "key")];
    assert_true(fabs((double)key->area / (scale * scale) - 1.0) < 1e-6);
    assert_true(fabs((double)key->power.g - 100.0) < 1e-4);
    assert_true(key->n.y == -1.0f || fabsf(key->n.y + 1.0f) < 1e-6f);
    assert_string_equal(s->materials[0].id, "glass"); /* exp(-sigma * 0.5 m) = 0.25 */
    assert_true(fabs((double)s->materials[0].sigma_a.r * scale * 0.5 - 1.3862943611198906) < 1e-5);
    lum_snapshot_unref(s);
}

static void emissive_objects_are_lights(void **state)
{
    struct fixture *f = *state;
    fill(f->scene);
    const struct lum_snapshot *s = commit(f);
    const struct lum_light *lamp = &s->lights.lights[light_index(s, "lamp")];
    assert_int_equal(lamp->kind, LUM_EMIT_MESH);
    assert_string_equal(s->instances[lamp->instance].id, "lamp");
    assert_int_equal(s->instances[lamp->instance].light, light_index(s, "lamp"));
    const struct lum_mesh *mesh = s->instances[lamp->instance].mesh;
    double area = 0.0;
    for (uint32_t i = 0; i < mesh->n_triangles; i++) {
        struct lum_vec3 p[3];
        for (uint32_t k = 0; k < 3; k++) {
            const float *v = mesh->positions + 3 * (size_t)mesh->indices[3 * i + k];
            p[k] = lum_affine_point(&s->instances[lamp->instance].local_to_scene, lum_v3(v[0], v[1], v[2]));
        }
        area += 0.5 * (double)lum_length(lum_cross(lum_v3_sub(p[1], p[0]), lum_v3_sub(p[2], p[0])));
        assert_true(fabs((double)lamp->tri_cdf[i] / area - 1.0) < 1e-5);
    }
    assert_true(lamp->tri_cdf[mesh->n_triangles - 1] == lamp->area);
    assert_true(fabsf(lamp->power.g - 50.0f) < 1e-4f);
    lum_snapshot_unref(s);
}

/* Where the alpha test cuts a hole, nothing shines. */
static void emitters_shine_where_they_are(void **state)
{
    struct fixture *f = *state;
    put_shape(f->scene, "sheet", "quad", 1, 1);
    const struct {
        enum lum_alpha_mode mode;
        float alpha;
        double share;
    } rows[] = {{LUM_ALPHA_MASK, 0.4f, 0.0}, {LUM_ALPHA_MASK, 0.6f, 1.0}, {LUM_ALPHA_BLEND, 0.25f, 0.25}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        struct lum_material_desc m = lum_material_default();
        m.emission_cd_m2 = 50.0;
        m.alpha_mode = rows[i].mode;
        m.alpha = rows[i].alpha;
        CHECK_OK(lum_scene_put_material(f->scene, "neon", &m, err));
        put_object(f->scene, "sign", "sheet", "neon", at(0, 0, 0));
        const struct lum_snapshot *s = commit(f);
        struct random_stream random = {1};
        enum { n = 4096 };
        int lit = 0;
        for (int k = 0; k < n; k++) {
            struct lum_vec2 u = {(float)random_double(&random), (float)random_double(&random)};
            struct lum_light_sample sample;
            lit += lum_light_sample_at(s, 0, to_scene(s, 0, 1, 0), u, &sample);
        }
        /* five standard deviations of the count of n coins */
        double tolerance = 5.0 * sqrt(n * rows[i].share * (1.0 - rows[i].share));
        if (!(fabs(lit - n * rows[i].share) <= tolerance))
            fail_msg("row %zu: %d of %d samples are lit, expected %g", i, lit, n, n * rows[i].share);
        lum_snapshot_unref(s);
    }
}

/* The brightest light in the smallest scene: 1 / r^2 stays finite, with room for sharp lobes and rare picks. */
static void no_power_overflows(void **state)
{
    struct fixture *f = *state;
    put_shape(f->scene, "box", "box", 1, 1);
    put_material(f->scene, "white");
    put_object(f->scene, "mote", "box", "white", scaled_at(1e-10, 0, 0, 0));
    struct lum_light_desc l = light_desc(LUM_LIGHT_POINT);
    l.position = (struct lum_vec3d){0, 0, 0};
    l.intensity = 1e12;
    l.color = lum_grey(100.0f);
    put_light(f->scene, "nova", &l);
    const struct lum_snapshot *s = commit(f);
    assert_int_equal(s->lights.n_active, 1);
    struct lum_light_sample sample;
    assert_true(lum_light_sample_at(s, 0, lum_v3(1e-6f, 0, 0), (struct lum_vec2){0.5f, 0.5f}, &sample));
    assert_true(isfinite(sample.radiance.r * 0x1p30f));
    lum_snapshot_unref(s);
}

static void lights_are_picked_half_by_flux(void **state)
{
    struct fixture *f = *state;
    struct lum_error refusal;
    const enum lum_light_kind kinds[] = {LUM_LIGHT_POINT, LUM_LIGHT_SPOT, LUM_LIGHT_QUAD, LUM_LIGHT_DISC,
                                         LUM_LIGHT_SPHERE};
    for (uint32_t i = 0; i < LUM_ARRAY_LEN(kinds); i++) {
        char id[8];
        snprintf(id, sizeof id, "l%u", i);
        struct lum_light_desc l = light_desc(kinds[i]);
        l.position.x = i;
        CHECK_OK(lum_light_from_flux(&l, 100.0 * (i + 1), &l.intensity, err));
        put_light(f->scene, id, &l);
    }
    struct lum_light_desc off = light_desc(LUM_LIGHT_POINT);
    off.on = false;
    put_light(f->scene, "off", &off);
    const struct lum_snapshot *s = commit(f);
    assert_int_equal(s->lights.n_lights, 6);
    assert_int_equal(s->lights.n_active, 5);
    float before = 0.0f;
    for (uint32_t i = 0; i < 5; i++) { /* fluxes 1 : 2 : 3 : 4 : 5 */
        assert_true(fabs((double)s->lights.pick_pdf[i] - (0.5 * (i + 1) / 15.0 + 0.5 / 5.0)) < 1e-6);
        assert_true(s->lights.active_cdf[i] - before == s->lights.pick_pdf[i]);
        before = s->lights.active_cdf[i];
    }
    assert_true(before == 1.0f);
    assert_true(s->lights.pick_pdf[5] == 0.0f);
    struct lum_light_desc sun = light_desc(LUM_LIGHT_DIRECTIONAL);
    double intensity = 0.0;
    assert_int_equal(lum_light_from_flux(&sun, 1.0, &intensity, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "flux_lm");
    struct lum_light_desc spark = light_desc(LUM_LIGHT_SPHERE);
    spark.radius_m = 1e-9; /* 1 lm from here is 2.5e16 cd/m2 */
    assert_int_equal(lum_light_from_flux(&spark, 1.0, &intensity, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "flux_lm");
    lum_snapshot_unref(s);
}

/* ---- cameras ---- */

static void main_is_the_default_camera(void **state)
{
    struct fixture *f = *state;
    struct lum_camera camera = {{0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 45}, found;
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
    fill(f->scene);
    put_object(f->scene, "far", "box", "white", scaled_at(100, 1e5, -2e4, 300));
    const struct lum_snapshot *s = commit(f);
    struct lum_camera c = lum_snapshot_framing_camera(s);
    struct lum_vec3 eye = to_scene(s, c.position.x, c.position.y, c.position.z);
    struct lum_vec3 gaze = lum_normalize(lum_v3_sub(to_scene(s, c.target.x, c.target.y, c.target.z), eye));
    float least = cosf(0.5f * (float)c.vfov_deg * LUM_PI / 180.0f);
    for (int k = 0; k < 8; k++) {
        struct lum_vec3 p = lum_v3(k & 1 ? s->bounds_hi.x : s->bounds_lo.x, k & 2 ? s->bounds_hi.y : s->bounds_lo.y,
                                   k & 4 ? s->bounds_hi.z : s->bounds_lo.z);
        assert_true(lum_dot(lum_normalize(lum_v3_sub(p, eye)), gaze) > least);
    }
    lum_snapshot_unref(s);
}

static void bounds_are_of_one_object_or_of_all_below(void **state)
{
    struct fixture *f = *state;
    struct lum_box b;
    fill(f->scene);
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
    fill(f->scene);
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
    fill(f->scene);
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

/* ---- allocation faults ---- */

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
    const uint32_t t[] = {0, 2, 1};
    struct lum_mesh_desc d = {
        .positions_f = p, .normals = n, .uvs = uv, .colors = n, .indices = t, .n_vertices = 3, .n_triangles = 1};
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
    struct lum_light_desc d = light_desc(LUM_LIGHT_ENVIRONMENT);
    d.image = "new";
    return lum_scene_put_light(f->scene, "new", &d, NULL);
}
static enum lum_status act_camera(struct fixture *f)
{
    struct lum_camera c = {{0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 45};
    return lum_scene_put_camera(f->scene, "new", &c, NULL);
}

static void failing_allocations_change_nothing(void **state)
{
    struct fixture *f = *state;
    fill(f->scene);
    sweep(f, "mesh", act_mesh);
    sweep(f, "image", act_image);
    sweep(f, "material", act_material);
    sweep(f, "object", act_object);
    sweep(f, "light", act_light);
    sweep(f, "camera", act_camera);
}

/* A commit that fails leaves its edits pending; the first that succeeds publishes them. */
static void failing_commits_keep_the_edits(void **state)
{
    struct fixture *f = *state;
    fill(f->scene);
    const struct lum_snapshot *before = commit(f), *s = NULL;
    assert_int_equal(act_image(f), LUM_OK);
    assert_int_equal(act_light(f), LUM_OK); /* its distribution is made by the commit */
    move_a(f->scene);
    grow_lamp(f->scene);
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
        TEST(ids_have_1_to_64_bytes),
        TEST(what_is_referred_to_stays),
        TEST(images_are_held_by_materials_and_environments),
        TEST(broken_texels_are_zeroed_and_counted),
        TEST(singular_transforms_are_refused),
        TEST(values_out_of_range_name_their_field),
        TEST(edits_raise_only_their_counters),
        TEST(media_reach_the_snapshot),
        TEST(bad_media_are_refused),
        TEST(too_many_media_are_not_published),
        TEST(a_successor_changes_every_version),
        TEST(snapshots_outlive_the_scene),
        TEST(order_of_arrival_does_not_matter),
        TEST(lengths_and_powers_are_in_scene_units),
        TEST(emissive_objects_are_lights),
        TEST(emitters_shine_where_they_are),
        TEST(no_power_overflows),
        TEST(lights_are_picked_half_by_flux),
        TEST(main_is_the_default_camera),
        TEST(the_framing_camera_sees_everything),
        TEST(bounds_are_of_one_object_or_of_all_below),
        TEST(placement_has_hysteresis),
        TEST(an_empty_scene_is_a_scene),
        TEST(what_is_below_precision_is_left_out),
        TEST(deforming_meshes_refit_in_turn),
        TEST(failing_allocations_change_nothing),
        TEST(failing_commits_keep_the_edits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
