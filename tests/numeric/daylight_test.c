/* CIE skies and the sun: closed forms, published values, what pictures show of them, what edits of them cost. */
#include "tests/numeric/reading.h"

#include "core/light/cie_sky.h"
#include "core/light/environment.h"
#include "core/light/solar.h"

static const double degree = LUM_PI_D / 180.0;

static void assert_within(double got, double want, double tolerance, const char *what)
{
    if (!(fabs(got - want) <= tolerance))
        fail_msg("%s: %.8g, not %.8g within %g", what, got, want, tolerance);
}

/* ---- the sky in closed form ---- */

/* The five numbers of each type, written out as the standard's table has them: the product makes them of two. */
static const double standard[15][5] = {
    {4, -0.7, 0, -1, 0},        {4, -0.7, 2, -1.5, 0.15},  {1.1, -0.8, 0, -1, 0},      {1.1, -0.8, 2, -1.5, 0.15},
    {0, -1, 0, -1, 0},          {0, -1, 2, -1.5, 0.15},    {0, -1, 5, -2.5, 0.3},      {0, -1, 10, -3, 0.45},
    {-1, -0.55, 2, -1.5, 0.15}, {-1, -0.55, 5, -2.5, 0.3}, {-1, -0.55, 10, -3, 0.45},  {-1, -0.32, 10, -3, 0.45},
    {-1, -0.32, 16, -3, 0.3},   {-1, -0.15, 16, -3, 0.3},  {-1, -0.15, 24, -2.8, 0.15}};

static double phi_of(const double *k, double cos_z)
{
    return cos_z > 0.0 ? 1.0 + k[0] * exp(k[1] / cos_z) : 1.0;
}
static double f_of(const double *k, double chi)
{
    return 1.0 + k[2] * (exp(k[3] * chi) - exp(k[3] * 0.5 * LUM_PI_D)) + k[4] * cos(chi) * cos(chi);
}

/* In double, from the table; sun over +X. */
static double luminance(int type, double elevation, double cos_z, double azimuth)
{
    if (type == 16)
        return (1.0 + 2.0 * cos_z) / 3.0;
    const double *k = standard[type - 1];
    double sin_z = sqrt(fmax(0.0, 1.0 - cos_z * cos_z));
    double c = sin_z * cos(azimuth) * cos(elevation) + cos_z * sin(elevation), zs = 0.5 * LUM_PI_D - elevation;
    return f_of(k, acos(fmin(fmax(c, -1.0), 1.0))) * phi_of(k, cos_z) / (f_of(k, zs) * phi_of(k, 1.0));
}

static struct lum_vec3 towards(double cos_z, double azimuth)
{
    double s = sqrt(fmax(0.0, 1.0 - cos_z * cos_z));
    return lum_v3((float)(s * cos(azimuth)), (float)cos_z, (float)(s * sin(azimuth)));
}

/* Float: acosf near the sun is off by sqrt(2^-23) = 3.5e-4 rad, where the steepest sky changes by 3 of itself a rad;
 * exp(b / cos Z) by its argument's rounding. */
static void skies_are_those_of_the_standard(void **state)
{
    (void)state;
    static const double elevations[] = {0, 12, 35, 60, 90};
    for (int type = 1; type <= LUM_CIE_SKY_TYPES; type++)
        for (size_t i = 0; i < LUM_ARRAY_LEN(elevations); i++) {
            struct lum_cie_sky sky = lum_cie_sky_make(type, elevations[i] * degree, 0.2);
            char what[64];
            snprintf(what, sizeof what, "type %d, sun at %g degrees", type, elevations[i]);
            assert_within((double)lum_cie_sky_luminance(&sky, lum_v3(0, 1, 0)), 1.0, 1e-5, what);
            for (int k = 0; k < 200; k++) {
                double cos_z = (k + 0.5) / 200.0, azimuth = 2.399963 * k;
                double want = luminance(type, elevations[i] * degree, cos_z, azimuth);
                assert_within((double)lum_cie_sky_luminance(&sky, towards(cos_z, azimuth)), want, 2e-3 * want, what);
            }
        }
}

/* Means over N x 2 N cells of equal solid angle, by the midpoint: error of order N^-2, with a cusp at the sun. */
static void integrate(int type, double elevation, double *ret_horizontal, double *ret_mean)
{
    enum { N = 400 };
    double horizontal = 0.0, all = 0.0;
    for (int i = 0; i < N; i++)
        for (int k = 0; k < N; k++) {
            double cos_z = (i + 0.5) / N, l = luminance(type, elevation, cos_z, LUM_PI_D * (k + 0.5) / N);
            horizontal += l * cos_z;
            all += l;
        }
    *ret_horizontal = 2.0 * LUM_PI_D * horizontal / (N * N);
    *ret_mean = all / (N * N);
}

static void integrals_are_those_of_quadrature(void **state)
{
    (void)state;
    assert_within(lum_cie_sky_make(5, 0.5, 0.2).horizontal, LUM_PI_D, 1e-5, "uniform: E = pi L");
    assert_within(lum_cie_sky_make(16, 0.5, 0.2).horizontal, 7.0 / 9.0 * LUM_PI_D, 1e-5, "overcast: E = 7/9 pi Lz");
    static const double elevations[] = {0, 5, 30, 62, 90};
    for (int type = 1; type <= LUM_CIE_SKY_TYPES; type++)
        for (size_t i = 0; i < LUM_ARRAY_LEN(elevations); i++) {
            double e = elevations[i] * degree, horizontal, mean;
            char what[64];
            snprintf(what, sizeof what, "type %d, sun at %g degrees", type, elevations[i]);
            integrate(type, e, &horizontal, &mean);
            struct lum_cie_sky sky = lum_cie_sky_make(type, e, 0.25);
            assert_within(sky.horizontal, horizontal, 1e-3 * horizontal, what);
            assert_within((double)sky.ground, 0.25 * sky.horizontal / LUM_PI_D, 1e-6 * horizontal, what);
            /* the table's texels are means by six points */
            struct lum_env_map *map = lum_env_map_create_sky(&sky);
            assert_non_null(map);
            double want = 0.5 * (mean + (double)sky.ground), pdf = 0.0;
            assert_within(lum_env_map_mean_luminance(map), want, 2e-3 * want, what);
            for (int y = 0; y < 64; y++) /* the density is that of texels of 2.8 degrees: once each */
                for (int x = 0; x < 128; x++) {
                    double top = cos(LUM_PI_D * y / 64.0), bottom = cos(LUM_PI_D * (y + 1) / 64.0);
                    pdf += (double)lum_env_map_pdf(
                               map, towards(0.5 * (top + bottom), 2 * LUM_PI_D * ((x + 0.5) / 128.0 - 0.5))) *
                           2.0 * LUM_PI_D / 128.0 * (top - bottom);
                }
            assert_within(pdf, 1.0, 1e-4, what);
            lum_env_map_destroy(map);
        }
}

/* ---- where the sun stands ---- */

/* Noon altitude 90 - |latitude - declination|, with the sun in the south or the north; sunrise where the hour angle is
 * acos(-tan latitude tan declination). The declinations are of the moments of solstice and equinox of 2026, 23.44 and
 * 0; within half a day of them they change by less than 0.003 and 0.2 degrees. */
static void days_are_as_long_and_high_as_geometry_says(void **state)
{
    (void)state;
    static const double latitudes[] = {-66, -33.9, 0, 10, 40, 51.5, 66};
    static const struct {
        int month, day;
        double declination, tolerance;
    } days[] = {{6, 21, 23.435, 0.01}, {12, 21, -23.435, 0.01}, {3, 20, 0, 0.2}, {9, 23, 0, 0.2}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(days); i++)
        for (size_t k = 0; k < LUM_ARRAY_LEN(latitudes); k++) {
            double day = lum_julian_day(2026, days[i].month, days[i].day, 12.0), phi = latitudes[k];
            double noon = day - lum_solar_position(day, phi, 0).equation_of_time_min / 1440.0;
            struct lum_solar_position at = lum_solar_position(noon, phi, 0);
            assert_within(at.declination_deg, days[i].declination, days[i].tolerance, "declination");
            assert_within(at.elevation_deg, 90.0 - fabs(phi - at.declination_deg), 0.005, "altitude at noon");
            if (fabs(phi - at.declination_deg) > 1.0)
                assert_within(fabs(at.azimuth_deg - 180.0), phi > at.declination_deg ? 0.0 : 180.0, 0.2, "at noon");
            double hour = -tan(phi * degree) * tan(at.declination_deg * degree);
            if (fabs(hour) > 0.98) /* the sun hardly sets */
                continue;
            double rise = noon - acos(hour) / LUM_PI_D / 2.0;
            at = lum_solar_position(rise, phi, 0);
            assert_within(at.elevation_deg, 0.0, 0.12, "elevation at sunrise"); /* at equinox it moves by 0.4 a day */
            assert_true(at.azimuth_deg < 180.0);
        }
}

static void polar_sun_goes_round(void **state)
{
    (void)state;
    for (int hour = 0; hour < 24; hour++) {
        assert_true(lum_solar_position(lum_julian_day(2026, 6, 21, hour), 70, 0).elevation_deg > 0.0);
        assert_true(lum_solar_position(lum_julian_day(2026, 12, 21, hour), 70, 0).elevation_deg < 0.0);
        assert_within(lum_solar_position(lum_julian_day(2026, 12, 21, hour), -90, 0).elevation_deg, 23.435, 0.01,
                      "pole");
    }
}

/* Published: Meeus, examples 7.a, 25.a and 28.b; Reda and Andreas, Solar Position Algorithm (NREL/TP-560-34302), A.5.
 */
static void published_examples(void **state)
{
    (void)state;
    assert_within(lum_julian_day(1957, 10, 4, 0.81 * 24.0), 2436116.31, 1e-8, "Sputnik");
    struct lum_solar_position p = lum_solar_position(lum_julian_day(1992, 10, 13, 0.0), 0, 0);
    assert_within(p.declination_deg, -7.78507, 0.001, "declination");
    assert_within(p.equation_of_time_min, 13.7118, 0.02, "equation of time");
    p = lum_solar_position(lum_julian_day(2003, 10, 17, 12.0 + 30.0 / 60.0 + 30.0 / 3600.0 + 7.0), 39.742476,
                           -105.1786);
    assert_within(p.azimuth_deg, 194.34024, 0.01, "azimuth");
    assert_within(p.elevation_deg, 39.872046, 0.01, "elevation, with the parallax of 0.0018 degrees");
    assert_within(p.apparent_deg, 90.0 - 50.11162, 0.01, "elevation, refracted");
    assert_int_equal(lum_day_of_year(2024, 12, 31), 366);
    struct lum_vec3d east = lum_solar_direction(0, 90, 0), turned = lum_solar_direction(0, 0, 90);
    assert_true(east.x > 0.999 && turned.x > 0.999 && lum_solar_direction(0, 0, 0).z < -0.999);
}

static void light_of_the_day(void **state)
{
    (void)state;
    /* the sun in the zenith: air mass 1, exp(-0.21) */
    assert_within(lum_sun_illuminance(90, 0.21, 0), 127500.0 * exp(-0.21), 20, "sun in the zenith");
    assert_true(lum_sun_illuminance(-0.1, 0.21, 0) == 0.0 && lum_sun_illuminance(0.5, 0.21, 0) < 5000.0);
    assert_within(lum_sun_illuminance(40, 0.21, 2) / lum_sun_illuminance(40, 0.21, 0), 1.034, 1e-9, "perihelion");
    assert_within(lum_sky_illuminance(12, 30 * degree), 800 + 15500 * sqrt(0.5), 1e-6, "clear");
    assert_within(lum_sky_illuminance(8, 30 * degree), 300 + 22500, 1e-6, "partly cloudy");
    assert_within(lum_sky_illuminance(1, 30 * degree), 300 + 10500, 1e-6, "overcast");
    for (double h = -20; h < 20; h += 0.25) /* no step at sunset */
        for (int type = 1; type <= 16; type++)
            assert_true(lum_sky_illuminance(type, (h + 0.25) * degree) >= lum_sky_illuminance(type, h * degree));
}

/* ---- pictures ---- */

#define ALBEDO 0.5

static struct lum_light_desc sky_of(int type, double lux)
{
    return (struct lum_light_desc){.kind = &lum_light_kind_sky,
                                   .color = lum_grey(1),
                                   .intensity = lux,
                                   .sky_amount = LUM_SKY_HORIZONTAL,
                                   .cie_type = type,
                                   .ground_albedo = 0.2,
                                   .on = true};
}

static struct lum_light_desc sun_of(double elevation, double azimuth, double lux)
{
    struct lum_vec3d to = lum_solar_direction(elevation, azimuth, 0);
    return (struct lum_light_desc){.kind = &lum_light_kind_sun,
                                   .direction = {-to.x, -to.y, -to.z},
                                   .color = lum_grey(1),
                                   .intensity = lux,
                                   .on = true};
}

static void plain(struct rig *r, const char *method, uint32_t spp)
{
    rig_begin(r, 2);
    struct lum_material_desc grey = rig_diffuse((float)ALBEDO);
    rig_material(r, "grey", &grey);
    rig_square(r, "floor", 4);
    rig_object(r, "floor", "floor", "grey", rig_v(0, 0, 0));
    rig_camera(r, rig_v(0, 3, 0), rig_v(0, 0, 0), 40);
    r->settings.method = lum_method_find(method);
    r->settings.w = r->settings.h = 24;
    r->settings.max_spp = spp;
}

static double mean_of(struct rig *r, uint32_t passes)
{
    for (uint32_t i = 0; i < passes; i++)
        rig_pass(r);
    struct lum_rgb *picture = rig_picture(r);
    double sum = 0.0;
    uint32_t n = r->settings.w * r->settings.h;
    for (uint32_t i = 0; i < n; i++)
        sum += (double)picture[i].g / n;
    lum_free(picture);
    return sum;
}

/* An open plane of albedo a under E lx shines with a E / pi. path: 576 pixels of 64 samples, whose weights have a
 * deviation of about 1, 0.5 %; the first frame of live, and tic, ask 256 points of the sky and 16 a pixel. */
static void open_plane_gets_what_the_sky_says(void **state)
{
    (void)state;
    static const struct {
        const char *method;
        uint32_t passes;
        double tolerance;
    } ways[] = {{"path", 64, 0.005}, {"live", 1, 0.03}, {"tic", 1, 0.03}};
    static const struct {
        int type;
        double elevation;
    } skies[] = {{1, 30}, {5, 30}, {16, 50}, {8, 40}, {12, 15}, {12, 60}, {15, 45}};
    for (size_t w = 0; w < LUM_ARRAY_LEN(ways); w++)
        for (size_t i = 0; i < LUM_ARRAY_LEN(skies); i++) {
            struct rig r;
            plain(&r, ways[w].method, ways[w].passes);
            struct lum_light_desc sky = sky_of(skies[i].type, 10000), sun = sun_of(skies[i].elevation, 140, 0);
            rig_light(&r, "sky", &sky);
            rig_light(&r, "sun", &sun);
            rig_commit(&r);
            double want = ALBEDO * 10000 / LUM_PI_D, got = mean_of(&r, ways[w].passes);
            print_message("%s, type %d, sun at %g: %.3f %% off\n", ways[w].method, skies[i].type, skies[i].elevation,
                          100.0 * (got / want - 1.0));
            assert_within(got, want, ways[w].tolerance * want, ways[w].method);
            /* and the sun adds E sin(elevation) */
            sky.on = false;
            sun.intensity = 50000;
            rig_light(&r, "sky", &sky);
            rig_light(&r, "sun", &sun);
            rig_commit(&r);
            want = ALBEDO * 50000 * sin(skies[i].elevation * degree) / LUM_PI_D;
            assert_within(mean_of(&r, 1), want, 1e-4 * want, "sun");
            rig_end(&r);
        }
}

/* ---- edits ---- */

/* The edge of a roof 1 m over the floor, under a sun 10 degrees across in the zenith: where t of its radius lie between
 * the sun's middle and the edge, (acos t - t sqrt(1 - t^2)) / pi of it is seen. Its luminance over the cosines to the
 * floor is within 0.8 % of even. Wholly seen it gives the floor what the record says, whatever its diameter. */
static void edge_of_a_roof(void **state)
{
    (void)state;
    static const double lit[] = {-2, -0.6, 0, 0.5, 2};
    const double lx = 1000, radius = tan(5 * degree);
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t k = 0; k < LUM_ARRAY_LEN(lit); k++) {
        struct rig r;
        rig_begin(&r, 0);
        struct lum_material_desc grey = rig_diffuse((float)ALBEDO), black = rig_diffuse(0.0f);
        struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                     .direction = {0, -1, 0},
                                     .diameter_rad = 10 * degree,
                                     .color = lum_grey(1),
                                     .intensity = lx,
                                     .on = true};
        rig_material(&r, "grey", &grey);
        rig_material(&r, "black", &black);
        rig_square(&r, "square", 4);
        rig_object(&r, "floor", "square", "grey", rig_v(0, 0, 0));
        rig_object(&r, "roof", "square", "black", rig_v(4, 1, 0)); /* from x = 0 on */
        rig_light(&r, "sun", &sun);
        double x = lit[k] * radius, t = fmax(-1, fmin(1, lit[k]));
        rig_camera(&r, rig_v(x, 0.2, 0), rig_v(x, 0, 0), 1); /* 3 mm of the floor */
        r.settings.w = r.settings.h = 8;
        r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
        rig_commit(&r);
        double want = ALBEDO * lx / LUM_PI_D * (acos(t) - t * sqrt(1 - t * t)) / LUM_PI_D;
        for (size_t m = 0; m < n; m++)
            if (methods[m].serves[LUM_EFFECT_SOFT_SHADOW]) {
                struct reading got = read_picture(&r, &methods[m], 64);
                print_message("%g, %s: %g +- %g, closed form %g\n", lit[k], methods[m].name, got.mean, got.error, want);
                check("edge of a roof", &methods[m], got, want, 0.01);
            }
        rig_end(&r);
    }
}

static void dimming_traces_no_ray_and_moving_the_sun_does(void **state)
{
    (void)state;
    struct rig r;
    plain(&r, "live", 1);
    struct lum_light_desc sky = sky_of(12, 10000), sun = sun_of(40, 180, 60000);
    rig_box(&r, "wall", 0.5, 0.5, 0.05);
    rig_object(&r, "wall", "wall", "grey", rig_v(0, 0.5, 0));
    rig_light(&r, "sky", &sky);
    rig_light(&r, "sun", &sun);
    rig_commit(&r);
    double before = mean_of(&r, 1);
    sky.intensity = 2500;
    sun.intensity = 15000;
    rig_light(&r, "sky", &sky);
    rig_light(&r, "sun", &sun);
    rig_commit(&r);
    struct lum_pass_stats dimmed = rig_pass(&r);
    assert_int_equal(rig_all_rays(&dimmed), 0);
    assert_within(mean_of(&r, 0) / before, 0.25, 1e-3, "a quarter");
    sun = sun_of(20, 200, 15000);
    rig_light(&r, "sun", &sun);
    rig_commit(&r);
    struct lum_pass_stats moved = rig_pass(&r);
    assert_true(moved.rays[LUM_RAY_DIRECT] > 0 && rig_all_rays(&moved) > moved.rays[LUM_RAY_DIRECT]);
    rig_end(&r);
}

/* Skies follow the first sun by id, be it off; without one it stands over +Z, 45 degrees high. */
static void sky_has_the_scenes_sun(void **state)
{
    (void)state;
    struct rig r;
    plain(&r, "path", 1);
    struct lum_light_desc sky = sky_of(15, 10000), sun = sun_of(25, 90, 0);
    rig_light(&r, "sky", &sky);
    rig_commit(&r);
    struct lum_rgb south = lum_lights_background(&r.snapshot->lights, lum_v3(0, 0.70710678f, 0.70710678f), false);
    struct lum_rgb north = lum_lights_background(&r.snapshot->lights, lum_v3(0, 0.70710678f, -0.70710678f), false);
    assert_true(south.g > 5.0f * north.g);
    sun.on = false;
    rig_light(&r, "sun", &sun);
    rig_commit(&r);
    struct lum_vec3d to = lum_solar_direction(25, 90, 0);
    struct lum_rgb at =
        lum_lights_background(&r.snapshot->lights, lum_v3((float)to.x, (float)to.y, (float)to.z), false);
    for (int k = 0; k < 100; k++) {
        double azimuth = 2.4 * k, cos_z = (k + 0.5) / 100;
        struct lum_vec3 d = towards(cos_z, azimuth);
        assert_true(lum_lights_background(&r.snapshot->lights, d, false).g <= 1.001f * at.g ||
                    cos_z < 0.2); /* type 15 is brighter towards the horizon */
    }
    rig_end(&r);
}

/* While a sky is on it shines in place of environments, whatever their ids; switched, the picture is that of a view
 * which never saw the other. */
static void sky_takes_the_place_of_an_environment(void **state)
{
    (void)state;
    struct lum_light_desc even = {.kind = &lum_light_kind_environment,
                                  .color = lum_grey(1),
                                  .intensity = 500,
                                  .on = true},
                          sky = sky_of(12, 10000);
    double lux[] = {10000, 500 * LUM_PI_D, 10000};
    struct rig r;
    plain(&r, "live", 1);
    rig_light(&r, "another", &even);
    rig_light(&r, "sky", &sky);
    for (size_t i = 0; i < LUM_ARRAY_LEN(lux); i++) {
        sky.on = i != 1;
        rig_light(&r, "sky", &sky);
        rig_commit(&r);
        double want = ALBEDO * lux[i] / LUM_PI_D;
        assert_within(mean_of(&r, 1), want, 0.03 * want, sky.on ? "sky" : "environment"); /* as above */
    }
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(skies_are_those_of_the_standard),
        cmocka_unit_test(integrals_are_those_of_quadrature),
        cmocka_unit_test(days_are_as_long_and_high_as_geometry_says),
        cmocka_unit_test(polar_sun_goes_round),
        cmocka_unit_test(published_examples),
        cmocka_unit_test(light_of_the_day),
        cmocka_unit_test(open_plane_gets_what_the_sky_says),
        cmocka_unit_test(edge_of_a_roof),
        cmocka_unit_test(dimming_traces_no_ray_and_moving_the_sun_does),
        cmocka_unit_test(sky_has_the_scenes_sun),
        cmocka_unit_test(sky_takes_the_place_of_an_environment),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
