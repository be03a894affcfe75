/* Sheets: paper, cloth, opal, which pass light on to their far side evenly. Closed forms, by every method. */
#include "core/cache/kind.h"
#include "core/method/method.h"
#include "core/scene/shapes.h"
#include "tests/numeric/reading.h"

static struct lum_material_desc sheet(float reflects, float transmits)
{
    struct lum_material_desc m = rig_diffuse(reflects);
    m.diffuse_transmittance = lum_grey(transmits);
    return m;
}

static void put_sphere(struct rig *r, const char *id, double diameter)
{
    const struct lum_shape_params params = {.size = {diameter, diameter, diameter}, .segments = {64, 32}};
    struct lum_shape_mesh m;
    RIG_OK(lum_shape_make("sphere", &params, &m, &err));
    struct lum_mesh_desc d = {
        .positions_f = m.positions, .indices = m.indices, .n_vertices = m.n_vertices, .n_triangles = m.n_triangles};
    RIG_OK(lum_scene_put_mesh(r->scene, id, &d, &err));
    lum_shape_finish(&m);
}

/* What reflects one half and transmits the other does not show where light is the same from everywhere. */
static void white_sheet_in_a_furnace(void **state)
{
    (void)state;
    struct lum_material_desc half = sheet(0.5f, 0.5f);
    check_in_furnace("furnace", &half, rig_v(0.1, 0.7, 0.2), 4, 1e-3);
}

/* Nor under an even sky, whose diffuse light records bring in `live`. A second sheet, so small and far that what it
 * hides is 1e-3, is there for the first to send light to. */
static void white_sheet_under_an_even_sky(void **state)
{
    (void)state;
    struct rig r;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    rig_begin(&r, 0);
    struct lum_material_desc half = sheet(0.5f, 0.5f);
    struct lum_light_desc sky = {.kind = &lum_light_kind_environment,
                                 .color = lum_grey(1),
                                 .intensity = 0.5,
                                 .on = true,
                                 .camera_visible = true};
    rig_material(&r, "sheet", &half);
    rig_square(&r, "square", 0.5);
    rig_square(&r, "small", 0.1);
    rig_object(&r, "square", "square", "sheet", rig_v(0, -0.2, 0));
    rig_object(&r, "small", "small", "sheet", rig_v(0, 4, 0));
    rig_light(&r, "sky", &sky);
    rig_camera(&r, rig_v(0.1, 0.7, 0.2), rig_v(0, -0.2, 0), 30);
    r.settings.w = r.settings.h = 12;
    rig_commit(&r);
    for (size_t m = 0; m < n; m++)
        check("sky", &methods[m], read_picture(&r, &methods[m], 4), 0.5, 2e-3);
    rig_end(&r);
}

/* A point lamp on each side of a large sheet: R E on this side, and T E on the other, over pi. With the effect
 * transmission off, and where a luxmeter lies on this side, what is behind does not count. */
static void lamps_on_both_sides(void **state)
{
    (void)state;
    struct rig r;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    rig_begin(&r, 0);
    struct lum_material_desc curtain = sheet(0.3f, 0.6f);
    rig_material(&r, "sheet", &curtain);
    rig_square(&r, "square", 4);
    rig_object(&r, "square", "square", "sheet", rig_v(0, 0, 0));
    rig_camera(&r, rig_v(0, 0.5, 0), rig_v(0, 0, 0), 1);
    rig_bulb(&r, "behind", rig_v(0.75, -1, 0), 100);
    rig_bulb(&r, "before", rig_v(0, 1, 0), 30);
    r.settings.w = r.settings.h = 6;
    rig_commit(&r);
    double before = 30, behind = 100 * 0.8 / 1.5625; /* at a distance of 1.25, under a cosine of 4 / 5 */
    for (size_t m = 0; m < n; m++) {
        check("both", &methods[m], read_picture(&r, &methods[m], 16), (0.3 * before + 0.6 * behind) / PI, 1e-3);
        r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION);
        check("opaque", &methods[m], read_picture(&r, &methods[m], 16), 0.3 * before / PI, 1e-3);
        r.settings.effects_off = 0;
        r.settings.illuminance = true;
        check("illuminance", &methods[m], read_picture(&r, &methods[m], 16), before / PI, 1e-3);
        r.settings.illuminance = false;
    }
    rig_end(&r);
}

/* Form factor of a rectangle of half edges a and b towards a point at a distance of 1 before its middle. */
static double seen_from_the_middle(double a, double b)
{
    double ra = sqrt(1.0 + a * a), rb = sqrt(1.0 + b * b);
    return 4.0 / (2.0 * PI) * (a / ra * atan(b / ra) + b / rb * atan(a / rb));
}

/* A wide panel close behind a curtain, a window: also where shadows are hard, the light of all of it counts. */
static void a_panel_close_behind(void **state)
{
    (void)state;
    struct rig r;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    rig_begin(&r, 0);
    struct lum_material_desc curtain = sheet(0.3f, 0.6f);
    rig_material(&r, "sheet", &curtain);
    rig_square(&r, "square", 4);
    rig_object(&r, "square", "square", "sheet", rig_v(0, 0, 0));
    struct lum_light_desc panel = rig_quad(rig_v(0, -0.25, 0), rig_v(1.6, 0, 0), rig_v(0, 0, -1.2), 100);
    rig_light(&r, "panel", &panel);
    rig_camera(&r, rig_v(0, 0.5, 0), rig_v(0, 0, 0), 1);
    r.settings.w = r.settings.h = 6;
    rig_commit(&r);
    double want = 0.6 * 100 * seen_from_the_middle(0.8 / 0.25, 0.6 / 0.25);
    for (size_t m = 0; m < n; m++)
        check("panel", &methods[m], read_picture(&r, &methods[m], 64), want, 2e-3);
    rig_end(&r);
}

/* Part rough glass, part sheet, before a luminous panel: all that is seen is light of the panel, so that the effect of
 * diffuse light, which nothing calls for, changes nothing. */
static void rough_glass_and_sheet_in_one(void **state)
{
    (void)state;
    struct rig r;
    const struct lum_method *path = lum_method_find("path");
    rig_begin(&r, 0);
    struct lum_material_desc frosted = sheet(0.3f, 0.3f);
    frosted.transmission = 0.5f;
    frosted.roughness = 0.5f;
    frosted.specular = 1.0f;
    frosted.thin = true;
    rig_material(&r, "frosted", &frosted);
    rig_square(&r, "square", 4);
    rig_object(&r, "square", "square", "frosted", rig_v(0, 0, 0));
    rig_camera(&r, rig_v(0, 0.5, 0), rig_v(0, 0, 0), 1);
    rig_light(&r, "panel",
              &(struct lum_light_desc){.kind = &lum_light_kind_quad,
                                       .position = {0.3, -0.7, 0},
                                       .u = {1, 0, 0},
                                       .v = {0, 0, -1},
                                       .intensity = 100,
                                       .color = lum_grey(1.0f),
                                       .on = true});
    r.settings.w = r.settings.h = 16;
    rig_commit(&r);
    r.settings.effects_on = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    struct reading whole = read_picture(&r, path, 64);
    r.settings.effects_on = 0;
    struct reading apart = read_picture(&r, path, 64);
    print_message("%g +- %g, by parts %g +- %g\n", whole.mean, whole.error, apart.mean, apart.error);
    assert_true(whole.mean > 1.0);
    double error = fmax(whole.error, apart.error), off = fabs(whole.mean - apart.mean);
    assert_true(!TEST_TELLS || error < 0.01 * whole.mean);
    assert_true(!TEST_TELLS || off <= 4.0 * hypot(whole.error, apart.error));
    rig_end(&r);
}

/* A ball of opal around a lamp, in the middle of a spherical room. Light that is reflected within a sphere is the same
 * everywhere, so that all is known: what leaves the ball into a black room is T / (1 - R) of the flux. In a room that
 * reflects RHO, of what leaves its wall a share comes back to the ball, the square of the ratio of their radii. Facets
 * have less area than spheres, by 3e-3. */
static void lampshade(void **state)
{
    (void)state;
    struct rig r;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    const double radius = 0.5, room = 2, flux = 1000, R = 0.4, T = 0.5, RHO = 0.5, share = 0.25 * 0.25;
    double back = share * (R + T * T / (1 - R)) + 1 - share; /* of what leaves the wall, what comes to it again */
    double on_wall = flux * T / (1 - R) / (1 - RHO * back);
    double within = (flux + T * share * RHO * on_wall) / (1 - R); /* lm on the ball's inside */
    double outside = share * RHO * on_wall;
    rig_begin(&r, 0);
    struct lum_material_desc opal = sheet((float)R, (float)T), wall = rig_diffuse((float)RHO);
    rig_material(&r, "opal", &opal);
    rig_material(&r, "wall", &wall);
    put_sphere(&r, "ball", 2 * radius);
    put_sphere(&r, "room", 2 * room);
    rig_object(&r, "ball", "ball", "opal", rig_v(0, 0, 0));
    rig_object(&r, "room", "room", "wall", rig_v(0, 0, 0));
    rig_bulb(&r, "lamp", rig_v(0, 0, 0), flux / (4 * PI));
    r.settings.w = r.settings.h = 12;
    rig_commit(&r);
    for (size_t m = 0; m < n; m++) {
        if (!methods[m].serves[LUM_EFFECT_INDIRECT_DIFFUSE])
            continue;
        double on_ball = (T * within + R * outside) / (4 * PI * radius * radius);
        rig_camera(&r, rig_v(0, 0.3, 1.4), rig_v(0, 0, 0), 20);
        check("ball", &methods[m], read_picture(&r, &methods[m], 32), on_ball / PI, 0.01);
        if (methods[m].cache == &lum_cache_irradiance) { /* as published, too */
            r.settings.deterministic = false;
            check("ball, freely", &methods[m], read_picture(&r, &methods[m], 1), on_ball / PI, 0.01);
            r.settings.deterministic = true;
        }
        rig_camera(&r, rig_v(0, 0, 0.6), rig_v(0, 0, 2), 100);
        check("wall", &methods[m], read_picture(&r, &methods[m], 32), RHO * on_wall / (4 * PI * room * room) / PI,
              0.01);
    }
    rig_end(&r);
}

/* The same of frosted glass that keeps nothing: all light gets out, however rough it is, and the ball does not show. Of
 * what no lamp reaches but through it, methods without lobes find none. 0.01: of the table of GGX's albedo. */
static void frosted_ball(void **state)
{
    (void)state;
    static const char *const methods[] = {"path", "live", "irrcache"};
    const double room = 2, flux = 1000, RHO = 0.5;
    for (float roughness = 0.6f; roughness <= 1.0f; roughness += 0.2f) {
        struct rig r;
        rig_begin(&r, 0);
        struct lum_material_desc frosted = rig_diffuse(1.0f), wall = rig_diffuse((float)RHO);
        frosted.transmission = 1.0f;
        frosted.roughness = roughness;
        frosted.thin = true;
        rig_material(&r, "frosted", &frosted);
        rig_material(&r, "wall", &wall);
        put_sphere(&r, "ball", 1);
        put_sphere(&r, "room", 2 * room);
        rig_object(&r, "ball", "ball", "frosted", rig_v(0, 0, 0));
        rig_object(&r, "room", "room", "wall", rig_v(0, 0, 0));
        rig_bulb(&r, "lamp", rig_v(0, 0, 0), flux / (4 * PI));
        rig_camera(&r, rig_v(0, 0, 0.6), rig_v(0, 0, 2), 100);
        r.settings.w = r.settings.h = 12;
        rig_commit(&r);
        double want = RHO / PI * flux / (4 * PI * room * room) / (1 - RHO);
        for (size_t m = 0; m < LUM_ARRAY_LEN(methods); m++) {
            struct reading got = read_picture(&r, lum_method_find(methods[m]), 32);
            print_message("roughness %g, %s: %.4f of the light, +- %.4f\n", (double)roughness, methods[m],
                          got.mean / want, got.error / want);
            check("frosted ball", lum_method_find(methods[m]), got, want, 0.015);
        }
        rig_end(&r);
    }
}

enum { STRIPES = 8, STRIPE_PIXELS = 4, STRIPE_TEXELS = 8 };

/* A square that is all sheet, and three quarters metal, by turns, stripe by stripe along x. */
static void put_striped(struct rig *r)
{
    const double p[] = {-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1};
    const float uvs[] = {0, 0, 0, 1, 1, 1, 1, 0};
    const uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
    float texels[STRIPES * STRIPE_TEXELS][3];
    for (int i = 0; i < STRIPES * STRIPE_TEXELS; i++)
        texels[i][0] = texels[i][1] = 1.0f, texels[i][2] = i / STRIPE_TEXELS % 2 ? 0.75f : 0.0f;
    struct lum_image_desc image = {LUM_TEXEL_RGB32F, STRIPES * STRIPE_TEXELS, 1, texels};
    struct lum_mesh_desc d = {.positions = p, .uvs = uvs, .indices = triangles, .n_vertices = 4, .n_triangles = 2};
    struct lum_material_desc striped = sheet(0.0f, 0.8f);
    striped.metallic = 1.0f;
    striped.metallic_roughness_texture.image = "stripes";
    RIG_OK(lum_scene_put_image(r->scene, "stripes", &image, &err));
    RIG_OK(lum_scene_put_mesh(r->scene, "curtain", &d, &err));
    rig_material(r, "striped", &striped);
    rig_object(r, "curtain", "curtain", "striped", rig_v(0, 0, 0));
}

/* (bright - dark) / (bright + dark) of the stripes in the picture. */
static double contrast_of(struct rig *r)
{
    struct lum_rgb *picture = rig_picture(r);
    double sum[2] = {0};
    for (uint32_t i = 0; i < r->settings.w * r->settings.h; i++)
        sum[i % r->settings.w / STRIPE_PIXELS % 2] += (double)picture[i].g;
    lum_free(picture);
    return fabs(sum[0] - sum[1]) / (sum[0] + sum[1]);
}

/* What comes through a textured curtain is filtered, its texture is not. A stripe transmits 0.8, or of a
 * quarter, 0.2, of the same irradiance from below, where only a floor shines, and one side of the picture is lit as the
 * other: 0.6 as contrast. Noise of 1024 pixels of 64 paths, and of methods that share VPLs within a pattern: 0.01. */
static void texture_of_a_curtain_stays_sharp(void **state)
{
    (void)state;
    struct rig r;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    rig_begin(&r, 0);
    struct lum_material_desc floor = rig_diffuse(0.9f);
    rig_material(&r, "floor", &floor);
    rig_square(&r, "square", 3);
    rig_object(&r, "floor", "square", "floor", rig_v(0, -1, 0));
    put_striped(&r);
    rig_light(&r, "spot",
              &(struct lum_light_desc){.kind = &lum_light_kind_spot,
                                       .position = {0, -0.1, 0},
                                       .direction = {0, -1, 0},
                                       .inner_cone_rad = 1.0,
                                       .outer_cone_rad = 1.4,
                                       .intensity = 100,
                                       .color = lum_grey(1.0f),
                                       .on = true});
    rig_camera(&r, rig_v(0, 2.5, 0), rig_v(0, 0, 0), 2.0 * atan(1.0 / 2.5) * 180.0 / PI);
    r.settings.antialias = false;
    r.settings.w = r.settings.h = STRIPES * STRIPE_PIXELS;
    rig_commit(&r);
    for (size_t m = 0; m < n; m++) {
        if (!methods[m].serves[LUM_EFFECT_INDIRECT_DIFFUSE])
            continue;
        read_picture(&r, &methods[m], 64);
        double contrast = contrast_of(&r);
        print_message("%s: contrast %.3f\n", methods[m].name, contrast);
        if (!(fabs(contrast - 0.6) < 0.01))
            fail_msg("%s: contrast of stripes %.3f", methods[m].name, contrast);
    }
    rig_end(&r);
}

/* Who dims a lamp behind a sheet traces no ray, and comes back to the same bits. */
static void dimmed_behind_a_sheet(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    rig_room(&r);
    struct lum_material_desc curtain = sheet(0.3f, 0.6f);
    rig_material(&r, "sheet", &curtain);
    rig_square(&r, "square", 0.8);
    rig_object(&r, "square", "square", "sheet", rig_v(0, 1.2, -0.5));
    rig_bulb(&r, "lamp", rig_v(0, 0.6, -0.6), 100);
    r.settings.method = lum_method_find("live");
    r.settings.antialias = false; /* eye rays at edges are traced for every picture */
    r.settings.max_spp = 1;
    rig_commit(&r);
    rig_pass(&r);
    struct lum_rgb *first = rig_picture(&r);
    for (int bright = 0; bright < 2; bright++) {
        rig_bulb(&r, "lamp", rig_v(0, 0.6, -0.6), bright ? 100 : 7);
        rig_commit(&r);
        struct lum_pass_stats s = rig_pass(&r);
        assert_int_equal(rig_all_rays(&s), 0);
    }
    rig_assert_picture(&r, first, "dimmed, and bright again");
    lum_free(first);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(white_sheet_in_a_furnace),
        cmocka_unit_test(white_sheet_under_an_even_sky),
        cmocka_unit_test(lamps_on_both_sides),
        cmocka_unit_test(lampshade),
        cmocka_unit_test(frosted_ball),
        cmocka_unit_test(texture_of_a_curtain_stays_sharp),
        cmocka_unit_test(rough_glass_and_sheet_in_one),
        cmocka_unit_test(dimmed_behind_a_sheet),
        cmocka_unit_test(a_panel_close_behind),
    };
    return cmocka_run_group_tests_name("numeric.sheet", tests, NULL, NULL);
}
