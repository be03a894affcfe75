/* Tangents that meshes bring, and textures that say how a surface is brushed: against the same surface turned. */
#include <string.h>

#include "core/accel/trace.h"
#include "core/material/bsdf.h"
#include "core/scene/surface.h"
#include "tests/numeric/reading.h"

/* A square in the plane y = 0 that faces up. u grows along +x and v along +z, so that falling v runs along -z.
 * turn_deg: of its tangents from +x towards -z; sign 0: it has none. */
static void put_square(struct rig *r, double turn_deg, float sign)
{
    const float p[] = {-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1}, uvs[] = {0, 0, 0, 1, 1, 1, 1, 0};
    const float n[] = {0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0};
    const uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
    float tangents[16];
    for (int k = 0; k < 4; k++) {
        const float t[4] = {(float)cos(turn_deg * PI / 180.0), 0.0f, (float)-sin(turn_deg * PI / 180.0), sign};
        memcpy(tangents + 4 * k, t, sizeof t);
    }
    struct lum_mesh_desc d = {.positions_f = p,
                              .normals = n,
                              .uvs = uvs,
                              .tangents = sign == 0.0f ? NULL : tangents,
                              .indices = triangles,
                              .n_vertices = 4,
                              .n_triangles = 2};
    RIG_OK(lum_scene_put_mesh(r->scene, "square", &d, &err));
}

static void put_texel(struct rig *r, const char *id, const float rgb[3])
{
    struct lum_image_desc image = {LUM_TEXEL_RGB32F, 1, 1, rgb};
    RIG_OK(lum_scene_put_image(r->scene, id, &image, &err));
}

static void put_object(struct rig *r, const double scale[3])
{
    struct lum_object_desc d = {
        .mesh = "square", .material = "steel", .local_to_world = lum_affined_identity(), .visible = true};
    for (int k = 0; k < 3; k++)
        d.local_to_world.m[k][k] = scale[k];
    RIG_OK(lum_scene_put_object(r->scene, "square", &d, &err));
}

static const double as_it_is[3] = {1, 1, 1};

/* What is under a lamp at one side, seen from another. */
static void begin_under_a_lamp(struct rig *r, double lamp_x, double eye_x)
{
    rig_begin(r, 0);
    rig_bulb(r, "lamp", rig_v(lamp_x, 1.5, -1.2), 100);
    rig_camera(r, rig_v(eye_x, 0.8, 1.0), rig_v(0, 0, 0), 20);
    r->settings.w = r->settings.h = 12;
}

static struct reading read_square(struct rig *r, const struct lum_method *method, const struct lum_material_desc *m)
{
    rig_material(r, "steel", m);
    put_object(r, as_it_is);
    rig_commit(r);
    struct reading got = read_picture(r, method, 16);
    rig_end(r);
    return got;
}

static struct reading by_angle(const struct lum_method *method, double turn_deg)
{
    struct rig r;
    struct lum_material_desc m = lum_material_steel(0.4f, 0.8f, turn_deg);
    begin_under_a_lamp(&r, 0.5, 0.3);
    put_square(&r, 0.0, 0.0f);
    return read_square(&r, method, &m);
}

/* By its mesh, by a texture, by a texture and the material, and by all three. A texel's strength multiplies. */
static struct reading by_another(const struct lum_method *method, double turn_deg, int way)
{
    struct rig r;
    double of_mesh = way == 0 ? turn_deg : way == 3 ? -80.0 : 0.0, of_material = way >= 2 ? 35.0 : 0.0;
    double of_texel = (turn_deg - of_mesh - of_material) * PI / 180.0;
    const float texel[3] = {(float)(0.5 + 0.4 * cos(of_texel)), (float)(0.5 + 0.4 * sin(of_texel)), 0.8f};
    struct lum_material_desc m = lum_material_steel(0.4f, way == 0 ? 0.8f : 1.0f, of_material);
    begin_under_a_lamp(&r, 0.5, 0.3);
    put_square(&r, of_mesh, of_mesh == 0.0 ? 0.0f : 1.0f);
    if (way > 0) {
        put_texel(&r, "lines", texel);
        m.anisotropy_texture = (struct lum_texture_desc){.image = "lines", .scale = {1, 1}};
    }
    return read_square(&r, method, &m);
}

static void turned_by_mesh_or_texture_is_turned(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t k = 0; k < n; k++) {
        double along = by_angle(&methods[k], 0.0).mean;
        for (double turn = 30.0; turn < 180.0; turn += 60.0) {
            struct reading want = by_angle(&methods[k], turn);
            assert_true(fabs(want.mean / along - 1.0) > 0.05); /* it can be told from one that is not turned */
            for (int way = 0; way < 4; way++)
                check("turned", &methods[k], by_another(&methods[k], turn, way), want.mean, way == 0 ? 1e-3 : 4e-3);
        }
    }
}

/* Lamp, eye and square mirrored show the same; the square alone another highlight. */
static void what_is_mirrored_is_brushed_the_other_way(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    const double mirror[3] = {-1, 1, 1};
    for (size_t k = 0; k < n; k++)
        for (float sign = -1.0f; sign < 2.0f; sign += 2.0f) {
            double mean[3];
            for (int way = 0; way < 3; way++) { /* as it is; all mirrored; the square alone */
                struct rig r;
                struct lum_material_desc m = lum_material_steel(0.4f, 0.8f, 50.0);
                double side = way == 1 ? -1.0 : 1.0;
                begin_under_a_lamp(&r, side * 0.5, side * 0.3);
                put_square(&r, 20.0, sign);
                rig_material(&r, "steel", &m);
                put_object(&r, way ? mirror : as_it_is);
                rig_commit(&r);
                mean[way] = read_picture(&r, &methods[k], 16).mean;
                rig_end(&r);
            }
            assert_true(mean[0] > 0.0 && (!TEST_TELLS || fabs(mean[1] / mean[0] - 1.0) < 2e-3));
            assert_true(fabs(mean[2] / mean[0] - 1.0) > 0.05);
        }
}

/* ---- where a ray meets it ---- */

static struct lum_surface surface_of(const struct rig *r, const struct lum_vec3 d)
{
    struct lum_hits hits;
    struct lum_surface s;
    hits.object[0] = 0, hits.prim[0] = 0, hits.u[0] = hits.v[0] = 0.3f, hits.white = false;
    lum_snapshot_surface(r->snapshot, &hits, 0, d, &s);
    return s;
}

static void assert_along(struct lum_vec3 got, float x, float y, float z)
{
    assert_true(lum_dot(lum_normalize(got), lum_normalize(lum_v3(x, y, z))) > 0.9999f);
}

/* Tangents of the mesh serve relief, too: stretched and mirrored with it, on the side that the sign says, seen from
 * either face. Without uv there is no relief, but brushing. */
static void relief_has_the_same_tangents(void **state)
{
    (void)state;
    static const float red[3] = {0.8f, 0.5f, 0.9f}, green[3] = {0.5f, 0.8f, 0.9f};
    for (int i = 0; i < 16; i++) {
        struct rig r;
        float sign = i & 1 ? -1.0f : 1.0f, sx = i & 2 ? -2.0f : 1.0f;
        struct lum_material_desc m = lum_material_steel(0.4f, i & 4 ? 0.8f : 0.0f, 0.0);
        rig_begin(&r, 0);
        put_texel(&r, "red", red);
        put_texel(&r, "green", green);
        m.normal_texture = (struct lum_texture_desc){.image = i & 8 ? "green" : "red", .scale = {1, 1}};
        rig_material(&r, "steel", &m);
        put_square(&r, 90.0, sign); /* tangent -z, bitangent n x t = -x */
        put_object(&r, (double[]){(double)sx, 1, 1});
        rig_commit(&r);
        struct lum_vec3 down = lum_v3(0, -1, 0), up = lum_v3(0, 1, 0);
        struct lum_surface s = surface_of(&r, down);
        float across = -sign * copysignf(1.0f, sx);
        assert_along(s.dpdu, 0, 0, -1);
        assert_along(lum_v3_neg(s.dpdv), across, 0, 0);
        if (i & 4) {
            assert_along(s.tangent, 0, 0, -1);
            assert_along(s.bitangent, across, 0, 0);
        }
        struct lum_bsdf b;
        lum_bsdf_init(&b, &r.snapshot->materials[0], &s, up);
        assert_along(b.frame.n, i & 8 ? 0.6f * across : 0.0f, 0.8f, i & 8 ? 0.0f : -0.6f);
        s = surface_of(&r, up); /* its back: the front's bump is a hollow */
        lum_bsdf_init(&b, &r.snapshot->materials[0], &s, down);
        assert_along(b.frame.n, i & 8 ? -0.6f * across : 0.0f, -0.8f, i & 8 ? 0.0f : 0.6f);
        rig_end(&r);
    }
}

/* Tangents that are none, or cancel out, leave the word to uv; a mesh without uv has them all the same. */
static void tangents_that_are_none(void **state)
{
    (void)state;
    const float p[] = {-1, 0, -1, -1, 0, 1, 1, 0, 1}, n[] = {0, 1, 0, 0, 1, 0, 0, 1, 0}, uvs[] = {0, 0, 0, 1, 1, 1};
    const float bad[][12] = {{0}, {0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1}, {NAN, 0, 0, 1, 0, INFINITY, 0, 1, 0, 0, 0, 1}};
    const float good[12] = {0, 0, 3, 1, 0, 0, 3, 1, 0, 0, 3, 1};
    const uint32_t triangle[] = {0, 1, 2};
    for (size_t k = 0; k < 4; k++) {
        struct rig r;
        struct lum_material_desc m = lum_material_steel(0.4f, 0.8f, 0.0);
        struct lum_mesh_desc d = {.positions_f = p,
                                  .normals = n,
                                  .uvs = k < 3 ? uvs : NULL,
                                  .tangents = k < 3 ? bad[k] : good,
                                  .indices = triangle,
                                  .n_vertices = 3,
                                  .n_triangles = 1};
        rig_begin(&r, 0);
        RIG_OK(lum_scene_put_mesh(r.scene, "square", &d, &err));
        rig_material(&r, "steel", &m);
        put_object(&r, as_it_is);
        rig_commit(&r);
        struct lum_surface s = surface_of(&r, lum_v3(0, -1, 0));
        assert_along(s.tangent, k < 3 ? 1 : 0, 0, k < 3 ? 0 : 1);
        assert_along(s.bitangent, k < 3 ? 0 : 1, 0, k < 3 ? -1 : 0);
        rig_end(&r);
    }
}

/* ---- light ---- */

/* Four strengths and directions side by side, smooth in between. */
static void a_texture_of_lines_in_a_furnace(void **state)
{
    (void)state;
    static const float texels[12] = {1, 0.5f, 1, 0.5f, 1, 0.6f, 0.2f, 0.3f, 0.3f, 0.5f, 0.5f, 0};
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    struct lum_material_desc m = lum_material_steel(0.4f, 0.9f, 20.0);
    struct lum_image_desc image = {LUM_TEXEL_RGB32F, 2, 2, texels};
    struct rig r;
    rig_begin(&r, 0);
    rig_furnace(&r, 2, 0.0f, 0.5);
    RIG_OK(lum_scene_put_image(r.scene, "lines", &image, &err));
    m.base_color = lum_grey(1.0f);
    m.anisotropy_texture = (struct lum_texture_desc){.image = "lines", .scale = {1, 1}};
    rig_material(&r, "steel", &m);
    put_square(&r, 40.0, -1.0f);
    put_object(&r, as_it_is);
    rig_camera(&r, rig_v(0.3, 0.4, 0.5), rig_v(0, 0, 0), 30);
    r.settings.w = r.settings.h = 12;
    rig_commit(&r);
    for (size_t k = 0; k < n; k++)
        check("lines", &methods[k], read_picture(&r, &methods[k], 64), 0.5, 0.03);
    rig_end(&r);
}

/* A texture whose strength may be anything makes no mirror of what is smooth, but as sharp a gloss as there is. */
static void no_strength_is_no_mirror(void **state)
{
    (void)state;
    static const float none[3] = {1, 0.5f, 0};
    struct rig r;
    struct lum_material_desc m = lum_material_steel(0.0f, 0.8f, 0.0);
    rig_begin(&r, 0);
    put_texel(&r, "lines", none);
    m.anisotropy_texture = (struct lum_texture_desc){.image = "lines", .scale = {1, 1}};
    rig_material(&r, "steel", &m);
    put_square(&r, 0.0, 1.0f);
    put_object(&r, as_it_is);
    rig_commit(&r);
    const struct lum_material *steel_material = &r.snapshot->materials[0];
    struct lum_surface s = surface_of(&r, lum_v3(0, -1, 0));
    struct lum_bsdf b;
    lum_bsdf_init(&b, steel_material, &s, lum_v3(0, 1, 0));
    assert_false(lum_material_is_specular(steel_material));
    assert_int_equal(lum_material_scatter(steel_material), LUM_SCATTER_GLOSS);
    assert_true(b.alpha == LUM_ALPHA_MIN && !b.brushed);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(turned_by_mesh_or_texture_is_turned),
        cmocka_unit_test(what_is_mirrored_is_brushed_the_other_way),
        cmocka_unit_test(relief_has_the_same_tangents),
        cmocka_unit_test(tangents_that_are_none),
        cmocka_unit_test(a_texture_of_lines_in_a_furnace),
        cmocka_unit_test(no_strength_is_no_mirror),
    };
    return cmocka_run_group_tests_name("numeric.tangent", tests, NULL, NULL);
}
