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
        cmocka_unit_test(live_shows_lacquer_as_path_does),
    };
    return cmocka_run_group_tests_name("numeric.clearcoat", tests, NULL, NULL);
}
