/* Textures of shares: of how much reflects at its face, passes, or passes evenly, and of the colour of the first.
 * Closed forms, by every method. */
#include "core/material/bsdf.h"
#include "core/material/material.h"
#include "core/scene/surface.h"
#include "tests/numeric/reading.h"

#include "tests/numeric/panes.h" /* last: its methods are a name of the other's */

/* ---- scenes ---- */

/* A square of so many metres either way, with uv: u grows along +x. */
static void put_square(struct rig *r, const char *id, double half)
{
    const double p[] = {-half, 0, -half, -half, 0, half, half, 0, half, half, 0, -half};
    const float uvs[] = {0, 0, 0, 1, 1, 1, 1, 0};
    const uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
    struct lum_mesh_desc d = {.positions = p, .uvs = uvs, .indices = triangles, .n_vertices = 4, .n_triangles = 2};
    RIG_OK(lum_scene_put_mesh(r->scene, id, &d, &err));
}

static void put_bytes(struct rig *r, const char *id, uint32_t width, const uint8_t *rgba)
{
    struct lum_image_desc image = {LUM_TEXEL_LINEAR8, width, 1, rgba};
    RIG_OK(lum_scene_put_image(r->scene, id, &image, &err));
}

/* Of bytes that say so many parts of 255 in each channel and the alpha. */
static const uint8_t some[4] = {51, 153, 204, 102};
#define SOME_R 0.2
#define SOME_ALPHA 0.4

/* ---- the same numbers ---- */

static void assert_same_rgb(struct lum_rgb a, struct lum_rgb b)
{
    assert_float_equal(a.r, b.r, 1e-6f);
    assert_float_equal(a.g, b.g, 1e-6f);
    assert_float_equal(a.b, b.b, 1e-6f);
}

/* A texel of it says what a number says, and what its other channels say does not count. 1e-6: rounding of shares. */
static void texels_are_numbers(void **state)
{
    (void)state;
    const struct lum_image image = {.texel = LUM_TEXEL_LINEAR8, .width = 1, .height = 1, .pixels = some};
    const struct lum_surface s = {.ng = {0, 0, 1}, .ns = {0, 0, 1}, .vertex_color = {1, 1, 1}};
    const struct lum_vec3 wo = {0.6f, 0.0f, 0.8f};
    const struct lum_material plain = {.base_color = {0.2f, 0.3f, 0.25f},
                                       .diffuse_transmittance = {0.5f, 0.4f, 0.1f},
                                       .specular_color = {1.0f, 0.5f, 0.25f},
                                       .roughness = 0.4f,
                                       .ior = 1.5f,
                                       .specular = 0.5f,
                                       .transmission = 0.5f,
                                       .alpha = 1.0f,
                                       .thin = true};
    for (int which = 0; which < 4; which++) {
        struct lum_material told = plain, textured = plain;
        struct lum_bsdf a, b;
        if (which == 0)
            textured.specular_tex.image = &image, told.specular *= (float)SOME_ALPHA;
        if (which == 1)
            textured.specular_color_tex.image = &image, told.specular_color = lum_rgb(0.2f, 0.3f, 0.2f);
        if (which == 2)
            textured.transmission_tex.image = &image, told.transmission *= (float)SOME_R;
        if (which == 3) { /* at 0.6 of 1 - 0.6 the base is 0.76 of it */
            textured.diffuse_transmission_share = 0.6f;
            textured.diffuse_transmission_tex.image = &image;
            told.diffuse_transmittance = lum_rgb_scale(plain.diffuse_transmittance, (float)SOME_ALPHA);
        }
        lum_bsdf_init(&a, &told, &s, wo);
        lum_bsdf_init(&b, &textured, &s, wo);
        assert_same_rgb(a.f0, b.f0);
        assert_same_rgb(a.glass_f0, b.glass_f0);
        assert_same_rgb(a.through, b.through);
        assert_same_rgb(lum_rgb_scale(a.diffuse, which == 3 ? 0.76f / 0.4f : 1.0f), b.diffuse);
        assert_same_rgb(a.multi, b.multi);
        assert_same_rgb(a.transmit, b.transmit);
        assert_float_equal(a.f90, b.f90, 1e-6f);
        assert_float_equal(a.glass, b.glass, 1e-6f);
    }
}

/* A texture may leave of anything: who asks for what a material may do is told of all that some point of it does. */
static void a_texture_leaves_what_it_covers(void **state)
{
    (void)state;
    const struct lum_image image = {.texel = LUM_TEXEL_LINEAR8, .width = 1, .height = 1, .pixels = some};
    struct lum_material m = {.base_color = {0.5f, 0.5f, 0.5f},
                             .diffuse_transmittance = {0.5f, 0.5f, 0.5f},
                             .ior = 1.5f,
                             .specular = 1.0f,
                             .transmission = 1.0f,
                             .thin = true};
    assert_false(lum_material_is_sheet(&m));
    assert_false(lum_material_scatter(&m) & LUM_SCATTER_DIFFUSE);
    m.transmission_tex.image = &image;
    assert_true(lum_material_is_pane(&m) && lum_material_is_sheet(&m));
    assert_true(lum_material_scatter(&m) & LUM_SCATTER_DIFFUSE && lum_material_scatter(&m) & LUM_SCATTER_THROUGH);
}

/* ---- specular ---- */

/* White under a coat that is there in patches, smooth or rough, does not show. */
static void white_under_patches_of_gloss(void **state)
{
    (void)state;
    static const uint8_t patches[16] = {255, 255, 255, 255, 0, 80, 255, 0, 0, 0, 0, 128, 255, 128, 0, 255};
    size_t n;
    const struct lum_method *rows = lum_methods(&n);
    for (int rough = 0; rough < 2; rough++) {
        struct rig r;
        rig_begin(&r, 0);
        rig_furnace(&r, 1, 0.0f, 0.5);
        put_square(&r, "square", 0.5);
        put_bytes(&r, "patches", 4, patches);
        struct lum_material_desc white = rig_diffuse(1.0f);
        white.specular = 1.0f;
        white.roughness = rough ? 0.5f : 0.0f;
        white.specular_texture.image = "patches";
        rig_material(&r, "white", &white);
        rig_object(&r, "square", "square", "white", rig_v(0, -0.2, 0));
        rig_camera(&r, rig_v(0.1, 0.3, 0.6), rig_v(0, -0.2, 0), 30);
        r.settings.w = r.settings.h = 12;
        rig_commit(&r);
        for (size_t m = 0; m < n; m++)
            check("patches", &rows[m], read_picture(&r, &rows[m], 16), 0.5, 0.01);
        rig_end(&r);
    }
}

/* A luminous panel above a black mirror of glass, seen from half a degree beside the normal: Fresnel's share there is
 * ((n - 1) / (n + 1))^2, times both textures. (1 - cos)^5 is nothing there. */
static void a_panel_is_mirrored_by_what_textures_leave(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *rows = lum_methods(&n);
    struct rig r;
    rig_begin(&r, 0);
    put_square(&r, "square", 0.02);
    put_bytes(&r, "some", 1, some);
    struct lum_material_desc black = rig_diffuse(0.0f);
    black.roughness = 0.0f;
    black.specular = 0.8f;
    black.specular_texture.image = black.specular_color_texture.image = "some";
    rig_material(&r, "black", &black);
    rig_object(&r, "square", "square", "black", rig_v(0, 0, 0));
    rig_camera(&r, rig_v(0, 1, 0.02), rig_v(0, 0, 0), 1);
    struct lum_light_desc panel = rig_quad(rig_v(0, 2, 0), rig_v(1, 0, 0), rig_v(0, 0, 1), 100); /* faces down */
    rig_light(&r, "panel", &panel);
    r.settings.w = r.settings.h = 6;
    rig_commit(&r);
    for (size_t m = 0; m < n; m++) /* green of the colour */
        check("mirrored", &rows[m], read_picture(&r, &rows[m], 16), 100 * 0.04 * 0.6 * 0.8 * SOME_ALPHA, 1e-3);
    rig_end(&r);
}

/* ---- transmission ---- */

/* What shadow rays leave of light that goes straight through is what paths find there by chance: of samples that pass,
 * the mean, and all of it is the delta lobe. */
static void straight_light_is_what_paths_find(void **state)
{
    (void)state;
    enum { SAMPLES = 20000 };
    const struct lum_image image = {.texel = LUM_TEXEL_LINEAR8, .width = 1, .height = 1, .pixels = some};
    for (int k = 1; k <= 10; k++) {
        double cosine = 0.1 * k;
        const struct lum_surface s = {.ng = {0, 0, 1}, .ns = {0, 0, 1}, .vertex_color = {1, 1, 1}};
        const struct lum_vec3 wo = {(float)sqrt(1.0 - cosine * cosine), 0.0f, (float)cosine};
        struct lum_material m = {.base_color = {0.3f, 0.6f, 0.1f},
                                 .specular_color = {1, 1, 1},
                                 .diffuse_transmittance = {0.2f, 0.3f, 0.1f},
                                 .ior = 1.5f,
                                 .specular = 1.0f,
                                 .transmission = 1.0f,
                                 .thin = true};
        m.transmission_tex.image = &image;
        struct lum_bsdf b;
        struct lum_bsdf_sample lobes[2], one;
        lum_bsdf_init(&b, &m, &s, wo);
        double left = (double)lum_bsdf_straight(&b, wo).g, sum = 0.0, squares = 0.0;
        assert_true(fabs(left - SOME_R * left_by_pane(cosine, 1.5, 0.6)) <= 1e-5);
        assert_int_equal(lum_bsdf_delta_lobes(&b, wo, lobes), 2);
        assert_true(lobes[1].lobe == LUM_LOBE_TRANSMIT && (double)lobes[1].weight.g == left);
        lum_bsdf_add_far_side(&b);
        for (int i = 0; i < SAMPLES; i++) { /* u_lobe alone says which */
            bool passes = lum_bsdf_sample(&b, wo, (struct lum_vec2){0.5f, 0.5f}, (float)((i + 0.5) / SAMPLES), &one) &&
                          one.lobe == LUM_LOBE_TRANSMIT;
            double weight = passes ? (double)one.weight.g : 0.0;
            sum += weight / SAMPLES;
            squares += weight * weight / SAMPLES;
        }
        /* even steps, of which one at either end of the lobe may be off; and rounding */
        assert_true(fabs(sum - left) <= 2.0 * squares / fmax(sum, 1e-9) / SAMPLES + 1e-5);
    }
}

/* A pane of two halves, of which the one towards -x lets pass SOME_R of what glass does and the other nothing. Between
 * them the texture changes within half a metre. */
static void put_halves(struct rig *r)
{
    static const uint8_t halves[8] = {51, 255, 255, 255, 0, 255, 255, 255};
    struct lum_material_desc m = glass(1.5, 1, 0.9, 1);
    put_square(r, "pane", 60.0);
    put_bytes(r, "halves", 2, halves);
    m.transmission_texture =
        (struct lum_texture_desc){.image = "halves", .scale = {64, 1}, .offset = {-31.5f, 0}, .wrap_u = LUM_WRAP_CLAMP};
    put_panes(r, 1, &m);
}

/* Lamps 2 m high and 2 m to one side, whose light crosses the pane at 1 m. As in numeric.glass: both pictures are made
 * with the same numbers; of the sky, which comes through both halves, path sees enough for 1 %. */
static void a_pane_passes_what_its_texture_does(void **state)
{
    (void)state;
    uint32_t n_wrong = 0;
    for (int side = -1; side < 2; side += 2)
        for (uint32_t kind = 0; kind < N_LAMPS; kind++) {
            struct rig bare, glazed;
            begin(&bare);
            begin(&glazed);
            bare.settings.effects_off = glazed.settings.effects_off |= LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
            put_lamp(&bare, (enum lamp)kind, 2.0 * side, 1.0);
            put_lamp(&glazed, (enum lamp)kind, 2.0 * side, 1.0);
            put_halves(&glazed);
            rig_commit(&bare);
            rig_commit(&glazed);
            double right = side < 0 ? SOME_R * left_by_pane(sqrt(0.5), 1.5, 0.9) : 0.0;
            if (kind == SKY)
                right = 0.5 * SOME_R * left_of_sky(1, 1.5, 0.9);
            for (size_t i = 0; i < (kind == SKY ? 1 : LUM_ARRAY_LEN(methods)); i++) {
                uint32_t n_seeds = kind == SKY ? TEST_EFFORT(8u) : 1;
                double before = (double)render(&bare, methods[i], n_seeds).g;
                double got = (double)render(&glazed, methods[i], n_seeds).g / before;
                if (!TEST_TELLS || fabs(got - right) <= 0.01 * right)
                    continue;
                print_error("%s, %s, side %d: %.5f arrives, expected %.5f\n", methods[i], lamp_names[kind], side, got,
                            right);
                n_wrong++;
            }
            rig_end(&bare);
            rig_end(&glazed);
        }
    assert_int_equal(n_wrong, 0);
}

/* ---- sheets ---- */

static struct lum_material_desc sheet(double reflects, double passes, double share)
{
    struct lum_material_desc m = rig_diffuse((float)reflects);
    m.diffuse_transmittance = lum_grey((float)passes);
    m.diffuse_transmission_share = (float)share;
    m.diffuse_transmission_texture.image = "alpha";
    return m;
}

/* Half and half of white, where the texture lets it; elsewhere more is reflected. It does not show where light is the
 * same from everywhere. 1e-3: as of white sheets. */
static void white_sheet_in_patches(void **state)
{
    (void)state;
    static const uint8_t patches[16] = {0, 0, 0, 255, 0, 0, 0, 0, 0, 0, 0, 100, 0, 0, 0, 200};
    size_t n;
    const struct lum_method *rows = lum_methods(&n);
    struct rig r;
    rig_begin(&r, 0);
    rig_furnace(&r, 1, 0.0f, 0.5);
    put_square(&r, "square", 0.5);
    put_bytes(&r, "alpha", 4, patches);
    struct lum_material_desc white = sheet(0.5, 0.5, 0.5);
    rig_material(&r, "white", &white);
    rig_object(&r, "square", "square", "white", rig_v(0, -0.2, 0));
    rig_camera(&r, rig_v(0.1, 0.7, 0.2), rig_v(0, -0.2, 0), 30);
    r.settings.w = r.settings.h = 12;
    rig_commit(&r);
    for (size_t m = 0; m < n; m++)
        check("patches", &rows[m], read_picture(&r, &rows[m], 4), 0.5, 1e-3);
    rig_end(&r);
}

/* A point lamp on each side: at SOME_ALPHA so much of 0.6 passes, and of the base, which is 0.2 where 0.6 of it passes,
 * 0.76 of 0.5 is left. */
static void lamps_on_both_sides(void **state)
{
    (void)state;
    struct rig r;
    size_t n;
    const struct lum_method *rows = lum_methods(&n);
    rig_begin(&r, 0);
    put_bytes(&r, "alpha", 1, some);
    struct lum_material_desc curtain = sheet(0.2, 0.6, 0.6);
    rig_material(&r, "sheet", &curtain);
    put_square(&r, "square", 4);
    rig_object(&r, "square", "square", "sheet", rig_v(0, 0, 0));
    rig_camera(&r, rig_v(0, 0.5, 0), rig_v(0, 0, 0), 1);
    rig_bulb(&r, "behind", rig_v(0.75, -1, 0), 100);
    rig_bulb(&r, "before", rig_v(0, 1, 0), 30);
    r.settings.w = r.settings.h = 6;
    rig_commit(&r);
    double before = 30, behind = 100 * 0.8 / 1.5625; /* at a distance of 1.25, under a cosine of 4 / 5 */
    double want = (0.5 * (1 - 0.6 * SOME_ALPHA) * before + 0.6 * SOME_ALPHA * behind) / PI;
    for (size_t m = 0; m < n; m++)
        check("both", &rows[m], read_picture(&r, &rows[m], 16), want, 1e-3);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texels_are_numbers),
        cmocka_unit_test(a_texture_leaves_what_it_covers),
        cmocka_unit_test(white_under_patches_of_gloss),
        cmocka_unit_test(a_panel_is_mirrored_by_what_textures_leave),
        cmocka_unit_test(straight_light_is_what_paths_find),
        cmocka_unit_test(a_pane_passes_what_its_texture_does),
        cmocka_unit_test(white_sheet_in_patches),
        cmocka_unit_test(lamps_on_both_sides),
    };
    return cmocka_run_group_tests_name("numeric.share_textures", tests, NULL, NULL);
}
