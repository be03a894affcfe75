/* Clear coats (lacquer, varnish): what they reflect, and what they leave to what lies below. Closed forms, by every
 * method that has the effects. */
#include "core/method/method.h"
#include "tests/numeric/reading.h"

static struct lum_material_desc lacquered(float base, float roughness)
{
    struct lum_material_desc m = rig_diffuse(base);
    m.clearcoat = 1.0f;
    m.clearcoat_roughness = roughness;
    return m;
}

/* Schlick's, of index 1.5. */
static double fresnel(double cos)
{
    return 0.04 + 0.96 * pow(1.0 - cos, 5.0);
}

/* A white base under a clear coat does not show where light is the same from everywhere: the table of albedos is known
 * to 0.01. With a gloss of two bounces between coat and walls nothing is added: walls are black. */
static void white_under_a_clear_coat_in_a_furnace(void **state)
{
    (void)state;
    for (int rough = 0; rough < 3; rough++) {
        struct lum_material_desc white = lacquered(1.0f, 0.4f * (float)rough);
        check_in_furnace(rough ? "rough" : "mirror", &white, rig_v(0.1, 0.3, 0.6), 16, 0.01);
    }
}

/* Of a point lamp a mirror shows nothing: what is seen is the base, dimmed on the way in and out, and brightened by
 * what was sent back down. Mean of Schlick's over the hemisphere: 0.04 + 0.96 / 21. */
static void the_base_is_dimmed_both_ways(void **state)
{
    (void)state;
    struct rig r;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    rig_begin(&r, 0);
    struct lum_material_desc paint = lacquered(0.6f, 0.0f);
    rig_material(&r, "paint", &paint);
    rig_square(&r, "square", 4);
    rig_object(&r, "square", "square", "paint", rig_v(0, 0, 0));
    r.settings.w = r.settings.h = 6;
    const double cos_o = 0.28; /* 24 : 7 : 25 */
    rig_bulb(&r, "lamp", rig_v(0.75, 1, 0), 100);
    rig_camera(&r, rig_v(0, 0.7, 2.4), rig_v(0, 0, 0), 1);
    rig_commit(&r);
    double arriving = 100 * 0.8 / 1.5625, mean = 1.0 - 0.04 - 0.96 / 21.0;
    double want = 0.6 / PI * arriving * (1.0 - fresnel(0.8)) * (1.0 - fresnel(cos_o)) / mean;
    for (size_t m = 0; m < n; m++)
        check("base", &methods[m], read_picture(&r, &methods[m], 4), want, 0.01);
    rig_end(&r);
}

static void put_bumps(struct rig *r, struct lum_material_desc *inout_material)
{
    static const float tilted[3] = {0.9f, 0.6f, 0.8f};
    struct lum_image_desc image = {LUM_TEXEL_RGB32F, 1, 1, tilted};
    RIG_OK(lum_scene_put_image(r->scene, "bumps", &image, &err));
    inout_material->normal_texture.image = "bumps";
}

/* ---- textures ---- */

/* A square of so many metres either way, with uv. */
static void put_square(struct rig *r, double half)
{
    const double p[] = {-half, 0, -half, -half, 0, half, half, 0, half, half, 0, -half};
    const float uvs[] = {0, 0, 0, 1, 1, 1, 1, 0};
    const uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
    struct lum_mesh_desc d = {.positions = p, .uvs = uvs, .indices = triangles, .n_vertices = 4, .n_triangles = 2};
    RIG_OK(lum_scene_put_mesh(r->scene, "square", &d, &err));
}

static void put_texels(struct rig *r, const char *id, uint32_t width, const float *rgb)
{
    struct lum_image_desc image = {LUM_TEXEL_RGB32F, width, 1, rgb};
    RIG_OK(lum_scene_put_image(r->scene, id, &image, &err));
}

/* One texel says half of each: to the last bit it is the coat of half the numbers, by every method. What the other
 * channels say does not count. */
static void even_textures_are_their_numbers(void **state)
{
    (void)state;
    static const float weight[3] = {0.5f, 0.1f, 0.9f}, rough[3] = {0.3f, 0.5f, 0.8f}, flat[3] = {0.5f, 0.5f, 1.0f};
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t k = 0; k < n; k++) {
        struct lum_rgb *plain = NULL;
        for (int textured = 0; textured < 2; textured++) {
            struct rig r;
            rig_begin(&r, 0);
            put_square(&r, 4);
            put_texels(&r, "weight", 1, weight);
            put_texels(&r, "rough", 1, rough);
            put_texels(&r, "flat", 1, flat);
            struct lum_material_desc m = lacquered(0.6f, textured ? 0.8f : 0.4f);
            m.clearcoat = textured ? 0.9f : 0.45f;
            m.clearcoat_texture.image = textured ? "weight" : NULL;
            m.clearcoat_roughness_texture.image = textured ? "rough" : NULL;
            m.clearcoat_normal_texture.image = "flat"; /* of both: rounding bends it */
            rig_material(&r, "paint", &m);
            rig_object(&r, "square", "square", "paint", rig_v(0, 0, 0));
            struct lum_light_desc panel = rig_quad(rig_v(0, 0.7, -2.4), rig_v(0.5, 0, 0), rig_v(0, 0.48, 0.14), 100);
            rig_light(&r, "panel", &panel);
            rig_camera(&r, rig_v(0, 0.7, 2.4), rig_v(0, 0, 0), 20);
            r.settings.w = r.settings.h = 8;
            r.settings.method = &methods[k];
            rig_commit(&r);
            (void)rig_pass(&r);
            if (textured)
                rig_assert_picture(&r, plain, methods[k].name);
            else
                plain = rig_picture(&r);
            rig_end(&r);
        }
        lum_free(plain);
    }
}

/* Half of it is coated, and that from smooth to rough: white does not show in a furnace. */
static void white_under_a_coat_in_patches(void **state)
{
    (void)state;
    static const float patches[12] = {0, 0.1f, 0, 1, 0.1f, 0, 0, 1, 0, 1, 1, 0};
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    struct rig r;
    rig_begin(&r, 0);
    rig_furnace(&r, 1, 0.0f, 0.5);
    put_square(&r, 0.5);
    put_texels(&r, "patches", 4, patches);
    struct lum_material_desc white = lacquered(1.0f, 1.0f);
    white.clearcoat_texture.image = white.clearcoat_roughness_texture.image = "patches";
    rig_material(&r, "white", &white);
    rig_object(&r, "square", "square", "white", rig_v(0, -0.2, 0));
    rig_camera(&r, rig_v(0.1, 0.3, 0.6), rig_v(0, -0.2, 0), 30);
    r.settings.w = r.settings.h = 12;
    rig_commit(&r);
    for (size_t m = 0; m < n; m++)
        check("patches", &methods[m], read_picture(&r, &methods[m], 16), 0.5, 0.01);
    rig_end(&r);
}

/* A coat whose own map leans it by atan(1/4) mirrors what lies there, over a base without relief: as the same coat on a
 * surface that is turned so. v grows along +z, and falling v is green: it leans towards -z. */
static void the_coat_leans_by_its_own_map(void **state)
{
    (void)state;
    /* of length 1 as they are: 0, 8, 15 over 17. Green 8/17, blue 15/17 */
    static const float leaning[3] = {0.5f, 0.5f + 4.0f / 17.0f, 0.5f + 7.5f / 17.0f};
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    struct rig r;
    rig_begin(&r, 0);
    put_square(&r, 0.02);
    put_texels(&r, "leaning", 1, leaning);
    struct lum_material_desc black = lacquered(0.0f, 0.0f);
    black.roughness = 0.5f;
    black.specular = 0.0f;
    black.clearcoat_normal_texture.image = "leaning";
    rig_material(&r, "black", &black);
    rig_object(&r, "square", "square", "black", rig_v(0, 0, 0));
    /* half a degree from straight above, where Fresnel's share has no slope that counts, the eye looks down at a normal
     * of 8 : 15 : 17 towards -z: mirrored to about (0, 161, -240) / 289 */
    rig_camera(&r, rig_v(0, 2, 0.02), rig_v(0, 0, 0), 1);
    /* faces the square: u x v along (0, -161, 240) */
    struct lum_light_desc panel = rig_quad(rig_v(0, 2 * 161.0 / 289, -2 * 240.0 / 289), rig_v(0.5, 0, 0),
                                           rig_v(0, 240.0 / 578, 161.0 / 578), 100);
    rig_light(&r, "panel", &panel);
    r.settings.w = r.settings.h = 6;
    rig_commit(&r);
    for (size_t m = 0; m < n; m++)
        check("leaning", &methods[m], read_picture(&r, &methods[m], 16), 100 * fresnel(15.0 / 17), 2e-3);
    rig_end(&r);
}

/* ---- other lamps ---- */

/* A luminous panel is mirrored by its luminance times Fresnel's share, whatever bumps lie below. Over a view of half a
 * degree either way the share has a slope of a twelfth, and by its curvature a mean of 1e-3 more. */
static void a_panel_is_mirrored_by_the_coat(void **state)
{
    (void)state;
    struct rig r;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    const double p[] = {-4, 0, -4, -4, 0, 4, 4, 0, 4, 4, 0, -4};
    const float uvs[] = {0, 0, 0, 1, 1, 1, 1, 0};
    const uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
    rig_begin(&r, 0);
    struct lum_mesh_desc d = {.positions = p, .uvs = uvs, .indices = triangles, .n_vertices = 4, .n_triangles = 2};
    RIG_OK(lum_scene_put_mesh(r.scene, "square", &d, &err));
    struct lum_light_desc panel = rig_quad(rig_v(0, 0.7, -2.4), rig_v(0.5, 0, 0), rig_v(0, 0.48, 0.14), 100);
    rig_light(&r, "panel", &panel);
    r.settings.w = r.settings.h = 6;
    rig_camera(&r, rig_v(0, 0.7, 2.4), rig_v(0, 0, 0), 1);
    for (int bumps = 0; bumps < 2; bumps++) {
        struct lum_material_desc black = lacquered(0.0f, 0.0f);
        if (bumps)
            put_bumps(&r, &black);
        rig_material(&r, "black", &black);
        rig_object(&r, "square", "square", "black", rig_v(0, 0, 0));
        rig_commit(&r);
        for (size_t m = 0; m < n; m++)
            check(bumps ? "bumps" : "even", &methods[m], read_picture(&r, &methods[m], 16), 100 * fresnel(0.28), 2e-3);
    }
    rig_end(&r);
}

/* Who dims a lamp traces no ray, and comes back to the same bits. */
static void dimmed_over_lacquer(void **state)
{
    (void)state;
    for (int rough = 0; rough < 2; rough++) {
        struct rig r;
        rig_begin(&r, 2);
        rig_room(&r);
        struct lum_material_desc red = lacquered(0.3f, rough ? 0.3f : 0.0f);
        rig_material(&r, "red", &red);
        rig_bulb(&r, "lamp", rig_v(0, 2.6, 0.6), 100);
        r.settings.method = lum_method_find("live");
        r.settings.antialias = false; /* eye rays at edges are traced for every picture */
        r.settings.max_spp = 1;
        rig_commit(&r);
        rig_pass(&r);
        struct lum_rgb *first = rig_picture(&r);
        for (int bright = 0; bright < 2; bright++) {
            rig_bulb(&r, "lamp", rig_v(0, 2.6, 0.6), bright ? 100 : 7);
            rig_commit(&r);
            struct lum_pass_stats s = rig_pass(&r);
            assert_int_equal(rig_all_rays(&s), 0);
        }
        rig_assert_picture(&r, first, "dimmed, and bright again");
        lum_free(first);
        rig_end(&r);
    }
}

/* A lacquered crate in a room: by first frames of `live` as by `path`. */
static void live_shows_lacquer_as_path_does(void **state)
{
    (void)state;
    for (int rough = 0; rough < 2; rough++) {
        struct rig r;
        rig_begin(&r, 2);
        rig_room(&r);
        struct lum_material_desc red = lacquered(0.5f, rough ? 0.5f : 0.0f);
        rig_material(&r, "red", &red);
        struct lum_light_desc panel = rig_quad(rig_v(0, 2.9, 0), rig_v(1, 0, 0), rig_v(0, 0, 1), 100);
        rig_light(&r, "panel", &panel);
        rig_camera(&r, rig_v(0.0, 2.0, 1.2), rig_v(0.5, 0.9, -0.4), 30);
        r.settings.w = r.settings.h = 32;
        rig_commit(&r);
        struct reading path = read_picture(&r, lum_method_find("path"), 64);
        struct reading live = read_picture(&r, lum_method_find("live"), 1);
        print_message("roughness %g: path %.5g +- %.3g, live %.5g +- %.3g\n", (double)red.clearcoat_roughness,
                      path.mean, path.error, live.mean, live.error);
        assert_true(path.mean > 0.0);
        check("room", lum_method_find("live"), live, path.mean, 0.03); /* README: first frames */
        rig_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(white_under_a_clear_coat_in_a_furnace), cmocka_unit_test(the_base_is_dimmed_both_ways),
        cmocka_unit_test(a_panel_is_mirrored_by_the_coat),       cmocka_unit_test(dimmed_over_lacquer),
        cmocka_unit_test(live_shows_lacquer_as_path_does),       cmocka_unit_test(even_textures_are_their_numbers),
        cmocka_unit_test(white_under_a_coat_in_patches),         cmocka_unit_test(the_coat_leans_by_its_own_map),
    };
    return cmocka_run_group_tests_name("numeric.clearcoat", tests, NULL, NULL);
}
