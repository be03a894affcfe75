/* Glare by day against closed forms: the formula and its correction for little light; a sky that is the same
 * everywhere; the sun, a lamp, and a bright square of the sky, which are seen by lamps' samples or by the fisheye; a
 * pane before a lamp; and what noise makes of bright cells. */
#include "core/measure/position_index.h"
#include "core/measure/sensor.h"
#include "tests/support/rig.h"

#define PI 3.14159265358979323846

static double by_hand(double lx, double sum)
{
    double dgp = 5.87e-5 * lx + 0.092 * log10(1.0 + sum / pow(lx, 1.87)) + 0.159;
    if (lx < 1000.0)
        dgp *= exp(0.024 * lx - 4.0) / (1.0 + exp(0.024 * lx - 4.0));
    return fmin(dgp, 1.0);
}

/* At 3000 lx with a source of 1e6 cd/m2, 1e-3 sr, p = 2: 0.1761 + 0.092 log10(1 + 2.5e8 / 3000^1.87) + 0.159 =
 * 0.1761 + 0.1773 + 0.159. At 300 lx the correction is e^3.2 / (1 + e^3.2) = 0.9608. */
static void the_formula(void **state)
{
    (void)state;
    struct lum_bright source = {1e12 * 1e-3 / 4.0, 0.0, 1}, none = {0};
    assert_true(fabs(lum_dgp_of(&source, 3000, 0).dgp - by_hand(3000, 2.5e8)) < 1e-12);
    assert_true(fabs(lum_dgp_of(&none, 300, 0).dgp - 0.9608342772 * (5.87e-5 * 300 + 0.159)) < 1e-9);
    assert_true(lum_dgp_of(&none, 1e5, 0).dgp == 1.0);
    assert_true(lum_dgp_of(&none, 0, 0).dgp == 0.0 && isnan(lum_dgp_of(&none, NAN, 0).dgp));
    assert_int_equal(lum_dgp_band_of(0.35), LUM_DGP_IMPERCEPTIBLE);
    assert_int_equal(lum_dgp_band_of(0.3501), LUM_DGP_PERCEPTIBLE);
    assert_int_equal(lum_dgp_band_of(0.44), LUM_DGP_DISTURBING);
    assert_int_equal(lum_dgp_band_of(0.46), LUM_DGP_INTOLERABLE);
}

/* The stated error is that of a small change of either: by differences, within what the curve bends. */
static void errors_are_slopes(void **state)
{
    (void)state;
    static const double lx[] = {200, 900, 5000}, step = 1e-4;
    for (size_t i = 0; i < LUM_ARRAY_LEN(lx); i++) {
        struct lum_bright at = {4e7, 0, 1}, noisy = {4e7, 4e7 * step, 1}, more = {4e7 * (1 + step), 0, 1};
        double is = lum_dgp_of(&at, lx[i], 0).dgp, by_sum = fabs(lum_dgp_of(&more, lx[i], 0).dgp - is),
               by_lx = fabs(lum_dgp_of(&at, lx[i] * (1 + step), 0).dgp - is);
        assert_true(fabs(lum_dgp_of(&noisy, lx[i], 0).stderr_of / by_sum - 1) < 1e-3);
        assert_true(fabs(lum_dgp_of(&at, lx[i], lx[i] * step).stderr_of / by_lx - 1) < 2e-2);
    }
}

/* ---- what an observer sees ---- */

static void begin(struct rig *r, double sky_cd_m2)
{
    rig_begin(r, 2);
    rig_square(r, "crumb", 0.01);
    rig_diffuse_object(r, "crumb", "grey", 0.0f, rig_v(0, -20, 0));
    rig_object(r, "another", "crumb", "grey",
               rig_v(0, 20, 20)); /* the eye is in the scene, from which the sun is far */
    struct lum_light_desc sky = {
        .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = sky_cd_m2, .on = true};
    rig_light(r, "sky", &sky);
}

static struct lum_sensor_result observe(const struct rig *r, struct lum_sensor_result *ret_glance)
{
    const struct lum_sensor_desc eye = {.kind = LUM_SENSOR_OBSERVER, .normal = {0, 1, 0}, .facing = {0, 0, -2}};
    const struct lum_meter_goal goal = {0.004, 0.1, 1u << 22};
    struct lum_sensor_result result;
    struct lum_sensor *s = NULL;
    RIG_OK(lum_sensor_create(&eye, 1, &s, &err));
    lum_sensor_aim(s, r->snapshot);
    assert_true(isnan((lum_sensor_result(s, &result), result.dgp.dgp)));
    while (lum_sensor_look(s, r->pool, 7, true))
        continue;
    (void)lum_sensor_result(s, ret_glance);
    for (bool more = true; more;)
        RIG_OK(lum_sensor_refine(s, r->pool, &goal, 1u << 16, &more, &err));
    assert_true(lum_sensor_result(s, &result));
    lum_sensor_destroy(s);
    return result;
}

/* Four standard errors, and `slack`: what cells at edges are wrong by. */
static void expect(const char *what, const struct lum_sensor_result *is, double lx, double sum, double slack)
{
    double want = by_hand(lx, sum);
    if (!(fabs(is->eye.value - lx) <= 4 * is->eye.stderr_of + 1e-4 * lx))
        fail_msg("%s: %g lx +/- %g at the eye, by hand %g", what, is->eye.value, is->eye.stderr_of, lx);
    if (!(fabs(is->dgp.dgp - want) <= 4 * is->dgp.stderr_of + slack))
        fail_msg("%s: DGP %g +/- %g, by hand %g", what, is->dgp.dgp, is->dgp.stderr_of, want);
}

/* Integral of dw / p^2 over what lies before the eye: midpoints, exact to 1e-4. */
static double weight_of_hemisphere(void)
{
    enum { RINGS = 400, TURNS = 800 };
    double sum = 0.0;
    for (int i = 0; i < RINGS; i++)
        for (int k = 0; k < TURNS; k++) {
            double c = (i + 0.5) / RINGS, s = sqrt(1 - c * c), phi = 2 * PI * (k + 0.5) / TURNS;
            double p = lum_position_index(lum_v3(0, 0, -1), lum_v3(0, 1, 0),
                                          lum_v3((float)(s * cos(phi)), (float)(s * sin(phi)), (float)-c));
            sum += 1.0 / (p * p) * 2 * PI / (RINGS * TURNS);
        }
    return sum;
}

/* A sky of the same luminance everywhere: Ev = pi L; below 2000 cd/m2 nothing glares. Above, all does: p is that of the
 * middle of each source of up to 0.2 rad. ln p grows by up to 0.04 a degree, so that 1 / p^2 changes by e^0.9 from the
 * middle to the rim, and its mean over the disc is 0.9^2 / 8 = 10 % above that of the middle: of a sum that adds 0.0123
 * to DGP (log10(1 + 0.36)), less than 0.001. */
static void an_even_sky(void **state)
{
    (void)state;
    static const double sky[] = {1000, 1990, 5000};
    for (size_t i = 0; i < LUM_ARRAY_LEN(sky); i++) {
        struct rig r;
        struct lum_sensor_result glance;
        begin(&r, sky[i]);
        rig_commit(&r);
        struct lum_sensor_result is = observe(&r, &glance);
        double sum = sky[i] > 2000 ? sky[i] * sky[i] * weight_of_hemisphere() : 0.0;
        expect("sky", &is, PI * sky[i], sum, 0.001);
        expect("sky at a glance", &glance, PI * sky[i], sum, 0.001);
        assert_true((is.n_bright > 0) == (sky[i] > 2000));
        assert_true(isinf(is.ugr.ugr) && is.glare.n_sources == 0);
        rig_end(&r);
    }
}

static struct lum_vec3d at_distance(double d, double aside_deg, double up_deg)
{
    double a = aside_deg * PI / 180, u = up_deg * PI / 180;
    return rig_v(d * sin(a) * cos(u), d * sin(u), -d * cos(a) * cos(u));
}

/* The sun, 0.53 degrees across, with 80 klx on a plane that faces it, 30 degrees above the line of sight (p = 3.348):
 * it is smaller than a cell, and is no source of UGR. */
static void the_sun(void **state)
{
    (void)state;
    struct rig r;
    struct lum_sensor_result glance;
    begin(&r, 1500);
    struct lum_vec3d to = at_distance(1, 0, 30);
    const double facing_lx = 20000, across = 0.53 * PI / 180;
    struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                 .direction = rig_v(-to.x, -to.y, -to.z),
                                 .diameter_rad = across,
                                 .color = lum_grey(1),
                                 .intensity = facing_lx,
                                 .on = true};
    rig_light(&r, "sun", &sun);
    rig_commit(&r);
    struct lum_sensor_result is = observe(&r, &glance);
    double w = 2 * PI * (1 - cos(across / 2)), l = facing_lx / w;
    double lx = PI * 1500 + facing_lx * cos(30 * PI / 180), sum = l * l * w / (3.348 * 3.348);
    is.eye.stderr_of += 1e-4 * lx; /* 2e-4 of p is 4e-4 of the sum: below 2e-5 of DGP */
    expect("sun", &is, lx, sum, 1e-4);
    expect("sun at a glance", &glance, lx, sum, 1e-4);
    assert_int_equal(is.n_bright, 1);
    assert_int_equal(is.glare.n_sources, 0);
    rig_end(&r);
}

/* Integral of L^2 dw / p^2 over a square of the sky around (0, up), of what is above 50 000 cd/m2. */
static double painted_sum(const struct rig *r, double up_deg, double half_deg)
{
    enum { STEPS = 800 };
    double sum = 0.0, step = 2 * half_deg / STEPS;
    for (int i = 0; i < STEPS * STEPS; i++) {
        double up = up_deg - half_deg + (i / STEPS + 0.5) * step;
        struct lum_vec3d at = at_distance(1, -half_deg + (i % STEPS + 0.5) * step, up);
        struct lum_vec3 d = lum_v3((float)at.x, (float)at.y, (float)at.z);
        double l = (double)lum_luminance(lum_lights_background(&r->snapshot->lights, d, false));
        double p = lum_position_index(lum_v3(0, 0, -1), lum_v3(0, 1, 0), d);
        if (l > LUM_DGP_PEAK_CD_M2)
            sum += l * l / (p * p) * step * step * (PI / 180) * (PI / 180) * cos(up * PI / 180);
    }
    return sum;
}

/* A sun that a picture of the sky shows, of one texel that is 2.8, 0.7 or 0.18 degrees across, with as much light: the
 * last is a tenth of a cell of the fisheye. All are as the picture has them, bilinear between texels. */
static void a_painted_sun(void **state)
{
    (void)state;
    static const uint32_t widths[] = {128, 512, 2048};
    for (size_t k = 0; k < LUM_ARRAY_LEN(widths); k++) {
        uint32_t w = widths[k], h = w / 2, y = h / 3, x = w / 4; /* beside -Z */
        double across = 2 * PI / w, up_deg = 90 - (y + 0.5) * 180 / h;
        float *pixels = lum_calloc((size_t)w * h * 3, sizeof *pixels);
        assert_non_null(pixels);
        for (size_t i = 0; i < (size_t)w * h * 3; i++)
            pixels[i] = 1.0f;
        for (int c = 0; c < 3; c++)
            pixels[((size_t)y * w + x) * 3 + c] = (float)(2000 / (600 * across * across * cos(up_deg * PI / 180)));
        struct rig r;
        struct lum_sensor_result glance;
        begin(&r, 600);
        const struct lum_image_desc image = {LUM_TEXEL_RGB32F, w, h, pixels};
        RIG_OK(lum_scene_put_image(r.scene, "sky", &image, &err));
        struct lum_light_desc sky = {
            .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 600, .image = "sky", .on = true};
        rig_light(&r, "sky", &sky);
        rig_commit(&r);
        lum_free(pixels);
        struct lum_sensor_result is = observe(&r, &glance);
        double half_deg = 1.6 * across * 180 / PI, sum = painted_sum(&r, up_deg, 3 * half_deg);
        char what[40];
        snprintf(what, sizeof what, "a sun in %u texels", w);
        assert_true(sum > 0.0);
        expect(what, &is, is.eye.value, sum, 1e-3);
        expect(what, &glance, glance.eye.value, sum, 1e-3);
        assert_true(fabs(is.eye.value / (PI * 600 + 2000 * cos(up_deg * PI / 180)) - 1) < 0.03);
        assert_true(is.n_bright >= 1 && is.dgp.stderr_of < 0.006); /* a wide sun has a rim that is a source, too */
        rig_end(&r);
    }
}

/* A lamp of 0.4 x 0.4 m and 20 000 cd/m2 from 3 m, 30 degrees to the side (p = 1.468), facing the eye; a bulb, which
 * has no luminance, adds to the light at the eye alone. Then a clear pane stands before both: 4 % are lost at either
 * face. */
static void a_lamp_and_a_pane(void **state)
{
    (void)state;
    const double l = 20000, d = 3, half = 0.2, sky = 500, side = 30 * PI / 180;
    double w = 4 * atan(half * half / (d * sqrt(2 * half * half + d * d)));
    struct rig r;
    struct lum_sensor_result glance;
    begin(&r, sky);
    struct lum_light_desc lamp =
        rig_quad(at_distance(d, 30, 0), rig_v(2 * half * cos(side), 0, 2 * half * sin(side)), rig_v(0, 2 * half, 0), l);
    rig_light(&r, "lamp", &lamp);
    rig_bulb(&r, "bulb", rig_v(0, 0, -2), 1000);
    rig_commit(&r);
    struct lum_sensor_result is = observe(&r, &glance);
    double lx = PI * sky + (l - sky) * w * cos(side) + 1000 / 4.0, sum = l * l * w / (1.468 * 1.468);
    /* a quarter of the lamp's 8 degrees across is no point: 1 / p^2 bends by less than 1 %, which is 5e-4 of DGP */
    expect("lamp", &is, lx, sum, 5e-4);
    assert_int_equal(is.n_bright, 1);
    assert_int_equal(is.glare.n_points, 1);

    struct lum_material_desc glass = rig_diffuse(1.0f);
    glass.specular = 1.0f;
    glass.roughness = 0.0f;
    glass.transmission = 1.0f;
    glass.thin = true;
    rig_material(&r, "glass", &glass);
    rig_box(&r, "pane", 10, 10, 0.001);
    rig_object(&r, "pane", "pane", "glass", rig_v(0, 0, -1));
    rig_commit(&r);
    struct lum_sensor_result behind = observe(&r, &glance);
    assert_int_equal(behind.n_bright, 1); /* and not once more by the fisheye */
    assert_true(behind.glare.bright.sum < 0.9 * is.glare.bright.sum && behind.glare.bright.sum > 0.5 * sum);
    rig_end(&r);
}

/* A white wall of 1000 cd/m2 in a furnace that is noisy: no cell is a source, whatever single paths say. */
static void noise_is_no_source(void **state)
{
    (void)state;
    struct rig r;
    struct lum_sensor_result glance;
    rig_begin(&r, 2);
    rig_room(&r);
    struct lum_light_desc lamp = rig_quad(rig_v(1.2, 0.4, 1.9), rig_v(0.1, 0, 0), rig_v(0, -0.1, 0), 200000);
    rig_light(&r, "lamp", &lamp); /* behind the eye; a tenth of the room's light comes by two bounces and more */
    rig_commit(&r);
    struct lum_sensor_result is = observe(&r, &glance);
    double without = by_hand(is.eye.value, 0.0);
    if (!(fabs(is.dgp.dgp - without) < 0.003))
        fail_msg("DGP %g of %u sources, without any %g, at %g lx", is.dgp.dgp, is.n_bright, without, is.eye.value);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_formula),        cmocka_unit_test(errors_are_slopes),
        cmocka_unit_test(an_even_sky),        cmocka_unit_test(the_sun),
        cmocka_unit_test(a_painted_sun),      cmocka_unit_test(a_lamp_and_a_pane),
        cmocka_unit_test(noise_is_no_source),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
