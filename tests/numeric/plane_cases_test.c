/* Hard cases that tests of parts hold, in whole pictures and by every method (NOTES H1, H5, H9, H10, H16, H18, H23).
 * What is lit is one plane, which cannot light itself, so that every pixel has a closed form: nothing but what the case
 * is about may change it. rig_pass asserts that no sample was dropped and no ray refused. */
#include "tests/support/effort.h"
#include "tests/support/rig.h"

#define PI 3.14159265358979323846
#define ALBEDO 0.6
#define CANDELA 100.0

struct plane {
    struct rig r;
    const struct lum_method *method;
};

static void begin(struct plane *p, const struct lum_method *method)
{
    rig_begin(&p->r, 2);
    p->method = p->r.settings.method = method;
    p->r.settings.max_spp = 1;
    p->r.settings.antialias = false;
}

static void render(struct plane *p)
{
    rig_fresh_view(&p->r);
    while (!rig_pass(&p->r).complete)
        continue;
}

/* A floor of 16 x 16 m, seen from 3 m above one side of it, in units of `scale` m, with its middle there. */
static void lay_floor(struct plane *p, double scale, struct lum_vec3d at)
{
    struct rig *r = &p->r;
    rig_square(r, "floor", 8 * scale);
    rig_diffuse_object(r, "floor", "matt", (float)ALBEDO, at);
    rig_camera(r, rig_v(at.x + scale, at.y + 3 * scale, at.z + 7 * scale), rig_v(at.x, at.y, at.z - scale), 50);
}

static double pixel(const struct plane *p, uint32_t i)
{
    const struct lum_film *f = lum_view_film(p->r.view);
    return (double)lum_film_mean(f, i % f->w, i / f->w).g;
}

/* Where the middle of a pixel meets the floor. False: nowhere. */
static bool point_of(const struct plane *p, uint32_t i, struct lum_vec3d *ret_point)
{
    struct lum_pick pick;
    const struct lum_view_settings *s = &p->r.settings;
    lum_pick_at(p->r.snapshot, &s->camera, s->w, s->h, i % s->w + 0.5, i / s->w + 0.5, &pick);
    *ret_point = pick.point_world;
    return pick.hit;
}

/* Luminance of a matt floor under a lamp of CANDELA that shines by the power-th power of the cosine, seen through fog
 * that absorbs `absorbs` a metre. */
static double lit(const struct plane *p, struct lum_vec3d at, struct lum_vec3d lamp, int power, double absorbs)
{
    const struct lum_vec3d eye = p->r.settings.camera.position;
    const double x = lamp.x - at.x, y = lamp.y - at.y, z = lamp.z - at.z, d2 = x * x + y * y + z * z;
    const double seen =
        sqrt((eye.x - at.x) * (eye.x - at.x) + (eye.y - at.y) * (eye.y - at.y) + (eye.z - at.z) * (eye.z - at.z));
    const double cosine = y / sqrt(d2);
    return ALBEDO / PI * CANDELA * cosine * (power ? cosine : 1.0) / d2 * exp(-absorbs * (seen + sqrt(d2)));
}

/* Every pixel, within this share of what it should be; what is as dark as the least float may be black. Soft light of
 * methods with a pattern is shared out over the pattern, half a pattern to each side, or twice that where a quarter of
 * the pixels stand for all: it is between the least and the most that pixels around should have. */
static void assert_lit(const struct plane *p, struct lum_vec3d lamp, int power, double absorbs, double tolerance,
                       const char *what)
{
    const int w = (int)p->r.settings.w, h = (int)p->r.settings.h, side = power ? (int)p->method->pattern : 0;
    double *want = lum_calloc((size_t)w * (size_t)h, sizeof *want);
    assert_non_null(want);
    for (int i = 0; i < w * h; i++) {
        struct lum_vec3d at;
        want[i] = point_of(p, (uint32_t)i, &at) ? lit(p, at, lamp, power, absorbs) : 0.0;
    }
    for (int i = 0; i < w * h; i++) {
        double least = want[i], most = want[i], got = pixel(p, (uint32_t)i);
        for (int y = i / w - side; y <= i / w + side; y++)
            for (int x = i % w - side; x <= i % w + side; x++)
                if (x >= 0 && x < w && y >= 0 && y < h) {
                    least = fmin(least, want[y * w + x]);
                    most = fmax(most, want[y * w + x]);
                }
        if (!(got >= (1.0 - tolerance) * least - 0x1p-120 && got <= (1.0 + tolerance) * most + 0x1p-120))
            fail_msg("%s, %s: pixel %d shows %.9g, expected %.9g to %.9g", p->method->name, what, i, got, least, most);
    }
    lum_free(want);
}

/* ---- near, far and grazing light (H1, H10) ---- */

/* A ray that met the floor that it leaves would leave a dark speck; light that is divided by a cosine would leave a
 * bright one. The lowest lamp is seen by the far side of the floor at 89.9 degrees. Positions are floats of a scene of
 * 1 to 128 units: of a lamp 1 / 64 of a unit above the floor its height is known to 2^-24 * 128 / 2^-6 = 5e-4, and the
 * light goes with that; of one 1 above to 8e-6, to which shading adds some 1e-6. */
static void floors_have_no_specks(struct plane *p)
{
    static const double scales[] = {1, 1e-4, 3e4}, offsets[] = {0, 1e5}, heights[] = {1, 0x1p-6};
    for (size_t s = 0; s < LUM_ARRAY_LEN(scales); s++)
        for (size_t o = 0; o < LUM_ARRAY_LEN(offsets); o++)
            for (size_t k = 0; k < LUM_ARRAY_LEN(heights); k++) {
                const double scale = scales[s], at = scale * offsets[o];
                const struct lum_vec3d lamp = {at - 0.5 * scale, at + heights[k] * scale, at + 0.25 * scale};
                char what[80];
                lay_floor(p, scale, rig_v(at, at, at));
                rig_bulb(&p->r, "lamp", lamp, CANDELA);
                rig_commit(&p->r);
                render(p);
                snprintf(what, sizeof what, "a floor of %g m at %g m, a lamp %g m above", 16 * scale, at,
                         heights[k] * scale);
                assert_lit(p, lamp, 0, 0.0, heights[k] < 1 ? 1e-3 : 1e-4, what);
            }
}

/* ---- lamps that are seen as next to nothing (H16) ---- */

/* A square lamp of side s with the strength of a point: of its points none is farther than s / sqrt 2 from its middle,
 * and light goes by the fourth power of height over distance, so that no sample is off by more than 4 s / (sqrt 2 h),
 * nor is any mean of samples. */
static void small_lamps_are_points(struct plane *p)
{
    struct rig *r = &p->r;
    lay_floor(p, 1, rig_v(0, 0, 0));
    for (double side = 0.1; side > 1e-5 / 2; side *= 0.1) {
        const struct lum_vec3d at = {-0.5, 1, 0.25};
        struct lum_light_desc lamp = rig_quad(rig_v(at.x - side / 2, at.y, at.z - side / 2), rig_v(side, 0, 0),
                                              rig_v(0, 0, side), CANDELA / (side * side));
        char what[48];
        lamp.camera_visible = false;
        rig_light(r, "lamp", &lamp);
        rig_commit(r);
        render(p);
        snprintf(what, sizeof what, "a lamp of %g m", side);
        assert_lit(p, at, 1, 0.0, 4.0 * side / sqrt(2.0) + 2e-4, what);
    }
}

/* ---- closed rooms (H9) ---- */

/* Bulbs just outside of every corner and edge, and a bright sky: nothing comes in. */
static void closed_rooms_are_black(struct plane *p)
{
    struct rig *r = &p->r;
    struct lum_light_desc sky = {.kind = &lum_light_kind_environment,
                                 .color = lum_grey(1),
                                 .intensity = 1e6,
                                 .on = true,
                                 .camera_visible = true};
    rig_room(r);
    rig_light(r, "sky", &sky);
    for (int k = 0; k < 27; k++) {
        const int x = k % 3 - 1, y = k / 3 % 3 - 1, z = k / 9 - 1;
        char id[16];
        snprintf(id, sizeof id, "bulb-%d", k);
        if (x || y || z)
            rig_bulb(r, id, rig_v(2.001 * x, 1.5 + 1.501 * y, 2.001 * z), 1e4);
    }
    for (int k = 0; k < 3; k++) { /* into a corner, along an edge, at the crate on the floor */
        static const struct lum_vec3d targets[] = {{2, 3, -2}, {-2, 0, 0}, {0.5, 0, -0.4}};
        rig_camera(r, rig_v(-0.3, 1.4, 1.8), targets[k], 60);
        rig_commit(r);
        render(p);
        for (uint32_t i = 0; i < r->settings.w * r->settings.h; i++)
            if (!(pixel(p, i) == 0.0))
                fail_msg("%s: pixel %u of a closed room shows %g", p->method->name, i, pixel(p, i));
    }
}

/* ---- gloss that becomes a mirror (H18) ---- */

/* Mean of a picture of a floor of white metal, and its standard error by SEEDS of them: methods that ask the sky in a
 * few directions, the same for many pixels, are noisy. */
static double metal_floor(struct plane *p, double roughness, double *ret_error)
{
    enum { SEEDS = 8 };
    struct lum_material_desc metal = lum_material_default();
    double mean = 0.0, square = 0.0;
    const uint32_t n = p->r.settings.w * p->r.settings.h;
    metal.base_color = lum_grey(1);
    metal.metallic = 1.0f;
    metal.roughness = (float)roughness;
    rig_material(&p->r, "matt", &metal);
    rig_commit(&p->r);
    for (p->r.settings.seed = 0; p->r.settings.seed < SEEDS; p->r.settings.seed++) {
        double sum = 0.0;
        render(p);
        for (uint32_t i = 0; i < n; i++)
            sum += pixel(p, i) / n;
        mean += sum / SEEDS;
        square += sum * sum / SEEDS;
    }
    *ret_error = sqrt(fmax(square - mean * mean, 0.0) / (SEEDS - 1));
    return mean;
}

/* White metal under a sky of 1 all around shines with 1, however sharp its lobe: with the most that pbrt allows, 1.01,
 * in the mean, and four standard errors. What shows mirrors shows all of it below alpha = 0.001, and what shows gloss
 * on both sides of that; methods that have no gloss have less of it, never more. */
static void sharp_gloss_gains_nothing(struct plane *p)
{
    static const double alphas[] = {0, 1e-8, 1e-6, 1e-4, 0.000999, 0.001001, 0.01, 0.1, 1};
    struct lum_light_desc sky = {
        .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 1, .on = true, .camera_visible = true};
    const bool paths = strcmp(p->method->name, "path") == 0 || strcmp(p->method->name, "live") == 0;
    lay_floor(p, 1, rig_v(0, 0, 0));
    rig_light(&p->r, "sky", &sky);
    for (size_t k = 0; k < LUM_ARRAY_LEN(alphas); k++) {
        double error, mean = metal_floor(p, sqrt(alphas[k]), &error);
        bool all = alphas[k] < 0.001 || (paths && alphas[k] < 0.1);
        if (!(mean <= 1.01 + 4.0 * error) || (all && !(mean >= 0.99 - 4.0 * error)))
            fail_msg("%s: a floor of white metal, alpha %g, under a sky of 1 shows %.6f +- %.6f", p->method->name,
                     alphas[k], mean, error);
    }
}

/* ---- fog of every strength (H23) ---- */

/* Fog that absorbs, and nothing else: Beer and Lambert. Depths are sums of floats, of up to 128 here: exp of them is
 * off by 128 * 2^-23. */
static void fog_absorbs_by_its_depth(struct plane *p)
{
    static const float strengths[] = {0, 1e-30f, 1e-9f, 1e-3f, 0.25f, 4, 1e6f};
    struct rig *r = &p->r;
    const struct lum_vec3d lamp = {-0.5, 1, 0.25};
    struct lum_rgb *clear = NULL;
    if (!p->method->serves[LUM_EFFECT_MEDIA])
        return;
    lay_floor(p, 1, rig_v(0, 0, 0));
    rig_bulb(r, "lamp", lamp, CANDELA);
    for (size_t k = 0; k < LUM_ARRAY_LEN(strengths); k++) {
        struct lum_medium_desc fog = {.sigma_a = lum_grey(strengths[k]), .everywhere = true};
        char what[48];
        RIG_OK(lum_scene_put_medium(r->scene, "fog", &fog, &err));
        rig_commit(r);
        render(p);
        snprintf(what, sizeof what, "fog of %g a metre", (double)strengths[k]);
        assert_lit(p, lamp, 0, (double)strengths[k], 1e-4 + 128 * 0x1p-23, what);
        if (k == 0)
            clear = rig_picture(r);
        else if (k == 1)
            rig_assert_picture(r, clear, what);
    }
    lum_free(clear);
}

/* ---- maps that cannot be inverted (H5) ---- */

/* They are refused, and the picture is the one before, bit for bit. */
static void refused_maps_leave_no_trace(struct plane *p)
{
    struct rig *r = &p->r;
    struct lum_object_desc d = {.mesh = "floor", .material = "matt", .visible = true};
    struct lum_error refusal;
    lay_floor(p, 1, rig_v(0, 0, 0));
    rig_bulb(r, "lamp", rig_v(-0.5, 1, 0.25), CANDELA);
    rig_commit(r);
    render(p);
    struct lum_rgb *before = rig_picture(r);
    static const double diagonals[][3] = {{0, 0, 0}, {1, 0, 1}, {(double)NAN, 1, 1}, {1, (double)INFINITY, 1}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(diagonals); k++) {
        d.local_to_world = lum_affined_identity();
        for (int i = 0; i < 3; i++)
            d.local_to_world.m[i][i] = diagonals[k][i];
        assert_int_equal(lum_scene_put_object(r->scene, "floor", &d, &refusal), LUM_ERR_INVALID);
        rig_commit(r);
        render(p);
        rig_assert_picture(r, before, p->method->name);
    }
    lum_free(before);
}

/* ---- all of them, with every method ---- */

static struct plane_case {
    const char *name;
    void (*check)(struct plane *);
} cases[] = {
    {"floors_have_no_specks", floors_have_no_specks},
    {"small_lamps_are_points", small_lamps_are_points},
    {"closed_rooms_are_black", closed_rooms_are_black},
    {"sharp_gloss_gains_nothing", sharp_gloss_gains_nothing},
    {"fog_absorbs_by_its_depth", fog_absorbs_by_its_depth},
    {"refused_maps_leave_no_trace", refused_maps_leave_no_trace},
};

static void with_every_method(void **state)
{
    const struct plane_case *c = *state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = 0; m < n; m++) {
        if (!TEST_TAKES(m, (size_t)(c - cases)))
            continue;
        struct plane p = {0};
        begin(&p, &methods[m]);
        c->check(&p);
        rig_end(&p.r);
    }
}

int main(void)
{
    struct CMUnitTest tests[LUM_ARRAY_LEN(cases)];
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++)
        tests[i] = (struct CMUnitTest){cases[i].name, with_every_method, NULL, NULL, &cases[i]};
    return cmocka_run_group_tests_name("numeric.plane_cases", tests, NULL, NULL);
}
