/* The fuzz of cloth: its table against its distribution, and what methods show of it. */
#include "core/material/sheen.h"
#include "core/method/method.h"
#include "tests/numeric/reading.h"

static struct lum_bsdf fuzz_alone(float roughness, struct lum_vec3 wo)
{
    struct lum_bsdf b = lum_bsdf_white(lum_v3(0, 0, 1), lum_v3(0, 0, 1));
    b.diffuse = lum_grey(0.0f);
    b.diffuse_prob = b.lobes = 0.0f;
    lum_sheen_init(&b, lum_grey(1.0f), roughness, wo);
    return b;
}

/* Integral of f cos by the midpoint rule, dense at grazing: steps of the root of the cosine. */
static double albedo_of(const struct lum_bsdf *b, struct lum_vec3 wo)
{
    enum { N = 200 };
    double sum = 0.0;
    for (int k = 0; k < N; k++)
        for (int j = 0; j < N; j++) {
            double t = (k + 0.5) / N, c = t * t, s = sqrt(1.0 - c * c), phi = (j + 0.5) / N * PI;
            struct lum_vec3 wi = {(float)(s * cos(phi)), (float)(s * sin(phi)), (float)c};
            float pdf;
            sum += (double)lum_bsdf_eval(b, wo, wi, &pdf).g * 2.0 * t / N * 2.0 * PI / N;
        }
    return sum;
}

static void the_table_is_the_albedo(void **state)
{
    (void)state;
    double worst = 0.0;
    for (float roughness = 0.1f; roughness <= 1.0f; roughness += 0.09f)
        for (double c = 0.01; c <= 1.0; c += 0.033) {
            struct lum_vec3 wo = {(float)sqrt(1.0 - c * c), 0.0f, (float)c};
            struct lum_bsdf b = fuzz_alone(roughness, wo);
            double off = albedo_of(&b, wo) - (double)lum_bsdf_sheen_albedo(&b, wo).g;
            worst = fmax(worst, fabs(off));
        }
    print_message("farthest from the table: %.4f\n", worst);
    assert_true(worst < 0.01);
}

static struct lum_material_desc velvet(float base)
{
    struct lum_material_desc m = rig_diffuse(base);
    m.sheen_color = lum_grey(1.0f);
    m.sheen_roughness = 0.5f;
    return m;
}

/* White cloth with white fuzz does not show where light is the same from everywhere: the table is known to 0.01. */
static void white_velvet_in_a_furnace(void **state)
{
    (void)state;
    struct lum_material_desc white = velvet(1.0f);
    check_in_furnace("furnace", &white, rig_v(0.1, 0.3, 0.6), 64, 0.015);
}

/* A point lamp: every method shows what the BSDF says of its direction. */
static void a_lamp_at_grazing(void **state)
{
    (void)state;
    struct rig r;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    rig_begin(&r, 0);
    struct lum_material_desc black = velvet(0.0f);
    rig_material(&r, "black", &black);
    rig_square(&r, "square", 4);
    rig_object(&r, "square", "square", "black", rig_v(0, 0, 0));
    rig_bulb(&r, "lamp", rig_v(1.44, 0.7, 1.92), 100);
    rig_camera(&r, rig_v(0, 0.7, 2.4), rig_v(0, 0, 0), 1);
    r.settings.w = r.settings.h = 6;
    rig_commit(&r);
    struct lum_vec3 wo = {0.96f, 0.0f, 0.28f}, wi = {0.768f, 0.576f, 0.28f};
    struct lum_bsdf b = fuzz_alone(0.5f, wo);
    float pdf;
    double want = (double)lum_bsdf_eval(&b, wo, wi, &pdf).g * 100.0 / (2.5 * 2.5);
    assert_true(want > 1.0);
    for (size_t m = 0; m < n; m++)
        check("lamp", &methods[m], read_picture(&r, &methods[m], 4), want, 0.01);
    rig_end(&r);
}

/* A velvet crate in a room: by first frames of `live` as by `path`. */
static void live_shows_velvet_as_path_does(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    rig_room(&r);
    struct lum_material_desc red = velvet(0.3f);
    rig_material(&r, "red", &red);
    struct lum_light_desc panel = rig_quad(rig_v(0, 2.9, 0), rig_v(1, 0, 0), rig_v(0, 0, 1), 100);
    rig_light(&r, "panel", &panel);
    rig_camera(&r, rig_v(0.0, 2.0, 1.2), rig_v(0.5, 0.9, -0.4), 30);
    r.settings.w = r.settings.h = 32;
    rig_commit(&r);
    struct reading path = read_picture(&r, lum_method_find("path"), 64);
    struct reading live = read_picture(&r, lum_method_find("live"), 1);
    print_message("path %.5g +- %.3g, live %.5g +- %.3g\n", path.mean, path.error, live.mean, live.error);
    assert_true(path.mean > 0.0);
    check("room", lum_method_find("live"), live, path.mean, 0.03); /* README: first frames */
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_table_is_the_albedo),
        cmocka_unit_test(white_velvet_in_a_furnace),
        cmocka_unit_test(a_lamp_at_grazing),
        cmocka_unit_test(live_shows_velvet_as_path_does),
    };
    return cmocka_run_group_tests_name("numeric.sheen", tests, NULL, NULL);
}
