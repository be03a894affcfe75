/* What a scene calls for, and why. The rule that indirect light takes two surfaces that see each other is conservative:
 * every doubtful case here must say that they do. */
#include "core/method/method.h"
#include "core/scene/shapes.h"
#include "core/trace/facing.h"
#include "tests/support/rig.h"

static struct lum_demand demand_of(struct rig *r)
{
    struct lum_demand d;
    rig_commit(r);
    lum_demand_derive(r->snapshot, &d);
    lum_demand_choose(&d, r->settings.antialias, r->settings.effects_off, r->settings.effects_on);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        assert_true(d.why[e][0] != '\0');
    return d;
}

static void begin(struct rig *r)
{
    rig_begin(r, 1);
    struct lum_material_desc white = rig_diffuse(0.7f), black = rig_diffuse(0.0f);
    rig_material(r, "white", &white);
    rig_material(r, "black", &black);
    rig_square(r, "square", 1.0);
    rig_box(r, "box", 0.5, 0.5, 0.5);
    rig_bulb(r, "bulb", rig_v(0, 3, 0), 60);
}

static void put_shape(struct rig *r, const char *shape)
{
    struct lum_shape_params p = {.size = {1, 1, 1}};
    struct lum_shape_mesh m;
    RIG_OK(lum_shape_make(shape, &p, &m, &err));
    struct lum_mesh_desc d = {.positions_f = m.positions,
                              .normals = m.normals,
                              .indices = m.indices,
                              .n_vertices = m.n_vertices,
                              .n_triangles = m.n_triangles};
    RIG_OK(lum_scene_put_mesh(r->scene, shape, &d, &err));
    lum_shape_finish(&m);
}

/* A copy of an object, turned about X, so that its coordinates are not exact. */
static void put_turned(struct rig *r, const char *id, const char *mesh, double angle, struct lum_vec3d at)
{
    struct lum_object_desc d = {
        .mesh = mesh, .material = "white", .local_to_world = lum_affined_identity(), .visible = true};
    d.local_to_world.m[1][1] = d.local_to_world.m[2][2] = cos(angle);
    d.local_to_world.m[1][2] = -sin(angle);
    d.local_to_world.m[2][1] = sin(angle);
    d.local_to_world.m[0][3] = at.x;
    d.local_to_world.m[1][3] = at.y;
    d.local_to_world.m[2][3] = at.z;
    RIG_OK(lum_scene_put_object(r->scene, id, &d, &err));
}

static void assert_facing(struct rig *r, enum lum_facing expected, const char *what)
{
    struct lum_demand d = demand_of(r);
    enum lum_facing got = lum_surfaces_facing(r->snapshot);
    if (got != expected)
        fail_msg("%s: %d, not %d (%s)", what, (int)got, (int)expected, d.why[LUM_EFFECT_INDIRECT_DIFFUSE]);
    assert_int_equal(d.on[LUM_EFFECT_INDIRECT_DIFFUSE], expected == LUM_FACING_EACH_OTHER);
}

static void surfaces_in_one_plane_face_nothing(void **state)
{
    (void)state;
    struct rig r;
    begin(&r);
    assert_facing(&r, LUM_FACING_NOTHING, "no object");
    rig_object(&r, "floor", "square", "black", rig_v(0, 0, 0));
    assert_facing(&r, LUM_FACING_NOTHING, "black floor");
    rig_object(&r, "floor", "square", "white", rig_v(0, 0, 0));
    assert_facing(&r, LUM_FACING_FLAT, "floor");
    rig_object(&r, "wall", "box", "black", rig_v(0, 0, -1));
    assert_facing(&r, LUM_FACING_FLAT, "floor and black box");
    rig_object(&r, "tile", "square", "white", rig_v(3, 0, 1));
    assert_facing(&r, LUM_FACING_FLAT, "two in one plane");
    rig_object(&r, "tile", "square", "white", rig_v(3, 0.001, 1));
    assert_facing(&r, LUM_FACING_EACH_OTHER, "a step of a millimetre");
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_OBJECT, "tile", &err));
    put_turned(&r, "floor", "square", 0.7, rig_v(1, 1, 1));
    assert_facing(&r, LUM_FACING_FLAT, "a turned floor");
    put_turned(&r, "tile", "square", 0.7, rig_v(-4, 1, 1));
    assert_facing(&r, LUM_FACING_FLAT, "two turned alike");
    rig_end(&r);
}

static void a_convex_solid_does_not_face_itself(void **state)
{
    (void)state;
    struct rig r;
    begin(&r);
    rig_object(&r, "it", "box", "white", rig_v(0, 0, 0));
    assert_facing(&r, LUM_FACING_CONVEX, "box");
    put_turned(&r, "it", "box", 0.7, rig_v(1, 0, 0));
    assert_facing(&r, LUM_FACING_CONVEX, "turned box");
    struct lum_light_desc inside = rig_point(rig_v(1, 0.1, 0), 60);
    rig_light(&r, "inside", &inside);
    assert_facing(&r, LUM_FACING_EACH_OTHER, "lit from inside");
    inside = rig_quad(rig_v(1, 1.0, 0), rig_v(0, 1.5, 0), rig_v(1, 0, 0), 60);
    rig_light(&r, "inside", &inside);
    assert_facing(&r, LUM_FACING_EACH_OTHER, "a panel through its side");
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "inside", &err));
    rig_object(&r, "other", "box", "white", rig_v(0, 0, 4));
    assert_facing(&r, LUM_FACING_EACH_OTHER, "two boxes");
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_OBJECT, "other", &err));
    struct lum_material_desc glass = rig_diffuse(0.7f);
    glass.transmission = 0.5f;
    rig_material(&r, "white", &glass);
    assert_facing(&r, LUM_FACING_EACH_OTHER, "light comes in");
    struct lum_material_desc lamp = rig_diffuse(0.7f);
    lamp.emission_cd_m2 = 5.0;
    rig_material(&r, "white", &lamp);
    assert_facing(&r, LUM_FACING_EACH_OTHER, "it shines, inwards too");
    rig_end(&r);
}

static void shapes_are_examined(void **state)
{
    (void)state;
    static const struct {
        const char *shape;
        bool certain;
    } rows[] = {{"box", true}, {"disc", true}, {"quad", true}, {"torus", false}, {"knot", false}, {"figure", false}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        struct rig r;
        begin(&r);
        put_shape(&r, rows[i].shape);
        rig_object(&r, "it", rows[i].shape, "white", rig_v(0, 0, 0));
        bool faces = demand_of(&r).on[LUM_EFFECT_INDIRECT_DIFFUSE];
        if (faces == rows[i].certain)
            fail_msg("%s", rows[i].shape);
        rig_end(&r);
    }
}

/* A box without its lid: convex, but light falls in. */
static void an_open_box_faces_itself(void **state)
{
    (void)state;
    static const uint32_t indices[] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5,
                                       0, 5, 4, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    struct rig r;
    begin(&r);
    double p[24];
    for (int k = 0; k < 8; k++) {
        p[3 * k] = k & 1 ? 1 : -1;
        p[3 * k + 1] = k & 2 ? 1 : -1;
        p[3 * k + 2] = k & 4 ? 1 : -1;
    }
    rig_mesh(&r, "open", p, 8, indices, LUM_ARRAY_LEN(indices) / 3);
    rig_object(&r, "it", "open", "white", rig_v(0, 0, 0));
    assert_facing(&r, LUM_FACING_EACH_OTHER, "open box");
    rig_end(&r);
}

/* Mirrors, gloss and glass call for rays only where these could find something. */
static void mirrors_need_something_to_show(void **state)
{
    (void)state;
    struct rig r;
    begin(&r);
    struct lum_material_desc mirror = rig_diffuse(0.7f);
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    rig_material(&r, "white", &mirror);
    rig_object(&r, "it", "box", "white", rig_v(0, 0, 0));
    assert_false(demand_of(&r).on[LUM_EFFECT_REFLECTION]); /* a bulb has no body */
    struct lum_material_desc screen = rig_diffuse(0.7f);
    screen.unlit = true;
    rig_material(&r, "black", &screen);
    rig_object(&r, "screen", "square", "black", rig_v(0, 0, -1));
    assert_true(demand_of(&r).on[LUM_EFFECT_REFLECTION]);
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "bulb", &err));
    assert_true(demand_of(&r).on[LUM_EFFECT_REFLECTION]); /* the screen needs no light */
    mirror.roughness = 0.5f;
    rig_material(&r, "white", &mirror);
    struct lum_demand d = demand_of(&r);
    assert_true(!d.on[LUM_EFFECT_REFLECTION] && !d.on[LUM_EFFECT_GLOSSY]);
    struct lum_light_desc panel = rig_quad(rig_v(0, 3, 0), rig_v(1, 0, 0), rig_v(0, 0, 1), 60);
    rig_light(&r, "panel", &panel);
    assert_true(demand_of(&r).on[LUM_EFFECT_GLOSSY]);
    rig_end(&r);
}

static void lamps_without_power_call_for_nothing(void **state)
{
    (void)state;
    struct rig r;
    begin(&r);
    rig_object(&r, "floor", "square", "white", rig_v(0, 0, 0));
    rig_bulb(&r, "bulb", rig_v(0, 3, 0), 0);
    struct lum_light_desc panel = rig_quad(rig_v(0, 3, 0), rig_v(1, 0, 0), rig_v(0, 0, 1), 0);
    rig_light(&r, "panel", &panel);
    struct lum_light_desc sky = {.kind = &lum_light_kind_environment, .color = lum_grey(1), .on = true};
    rig_light(&r, "sky", &sky);
    struct lum_medium_desc fog = {.sigma_s = lum_grey(0.1f), .everywhere = true};
    RIG_OK(lum_scene_put_medium(r.scene, "fog", &fog, &err));
    struct lum_demand d = demand_of(&r);
    for (int e = 0; e < LUM_EFFECT_ANTIALIAS; e++)
        if (d.on[e])
            fail_msg("%s: %s", lum_effect_names[e], d.why[e]);
    rig_end(&r);
}

/* Matched, clear, white: it is not there, for any ray. With a tint it is. */
static void clear_matched_glass_is_air(void **state)
{
    (void)state;
    struct rig r;
    begin(&r);
    struct lum_material_desc air = rig_diffuse(1.0f);
    air.transmission = 1.0f;
    air.specular = 1.0f;
    air.ior = 1.0f;
    rig_material(&r, "white", &air);
    rig_object(&r, "it", "box", "white", rig_v(0, 0, 0));
    struct lum_demand d = demand_of(&r);
    assert_true(r.snapshot->n_instances == 0 && !d.on[LUM_EFFECT_TRANSMISSION]);
    air.attenuation_color = lum_grey(0.5f);
    air.attenuation_distance_m = 1.0;
    rig_material(&r, "white", &air);
    demand_of(&r);
    assert_int_equal(r.snapshot->n_instances, 1);
    air.thin = true; /* a surface without volume absorbs nothing inside */
    rig_material(&r, "white", &air);
    demand_of(&r);
    assert_int_equal(r.snapshot->n_instances, 0);
    air.ior = 1.5f;
    rig_material(&r, "white", &air);
    demand_of(&r);
    assert_int_equal(r.snapshot->n_instances, 1);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(surfaces_in_one_plane_face_nothing),
        cmocka_unit_test(a_convex_solid_does_not_face_itself),
        cmocka_unit_test(shapes_are_examined),
        cmocka_unit_test(an_open_box_faces_itself),
        cmocka_unit_test(mirrors_need_something_to_show),
        cmocka_unit_test(lamps_without_power_call_for_nothing),
        cmocka_unit_test(clear_matched_glass_is_air),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
