/* Pictures of illuminance against closed forms, by every method: whatever surfaces are made of, whatever is before the
 * eye, and through edits. */
#include "core/method/method.h"
#include "core/film/false_color.h"
#include "core/pass/eye.h"
#include "core/render/isolines.h"
#include "tests/support/effort.h"
#include "tests/support/probe_at.h"
#include "tests/support/rig.h"

#define PI 3.14159265358979323846

/* A floor under a bulb, seen from above and aside. */
enum { CD = 500 };
static const struct lum_vec3d lamp = {0.5, 3, -0.5}, eye = {0, 2, 3};

static void floor_of(struct rig *r, const struct lum_material_desc *m)
{
    rig_material(r, "made of", m);
    rig_square(r, "floor", 6);
    rig_object(r, "floor", "floor", "made of", rig_v(0, 0, 0));
    rig_bulb(r, "lamp", lamp, CD);
    rig_camera(r, eye, rig_v(0, 0, -0.5), 60);
    r->settings.illuminance = true;
    rig_commit(r);
}

/* Where the ray through the middle of a pixel meets the floor. */
static struct lum_vec3d floor_at(const struct rig *r, uint32_t x, uint32_t y)
{
    struct lum_eye e;
    RIG_OK(lum_eye_init(&e, &r->settings.camera, &r->snapshot->norm, r->settings.w, r->settings.h, &err));
    struct lum_vec3 d = lum_eye_direction(&e, (float)x + 0.5f, (float)y + 0.5f);
    double t = eye.y / -(double)d.y;
    return rig_v(eye.x + t * (double)d.x, 0, eye.z + t * (double)d.z);
}

static double lux_at(const struct rig *r, uint32_t x, uint32_t y)
{
    return PI * (double)lum_luminance(lum_film_mean(lum_view_film(r->view), x, y));
}

/* E = I cos / d^2. */
static double closed_form(struct lum_vec3d p)
{
    double x = p.x - lamp.x, z = p.z - lamp.z, d2 = x * x + z * z + lamp.y * lamp.y;
    return CD * lamp.y / (d2 * sqrt(d2));
}

/* Hits, directions and irradiance are floats: places on the floor are off by 6e-8 times some 10 m and the lamp's
 * distance is 3 m, of which E has the third power. Half floats keep 2^-11 of what some methods interpolate. */
#define OFF 1e-3

static void check_floor(const struct rig *r, const char *what, double left_by_fog)
{
    double worst = 0.0;
    for (uint32_t y = 0; y < r->settings.h; y++)
        for (uint32_t x = 0; x < r->settings.w; x++) {
            struct lum_vec3d p = floor_at(r, x, y);
            if (fabs(p.x) > 5.9 || fabs(p.z) > 5.9)
                continue; /* beside the floor */
            double want = closed_form(p), got = lux_at(r, x, y);
            if (left_by_fog > 0.0) {
                double dx = p.x - lamp.x, dz = p.z - lamp.z;
                want *= exp(-left_by_fog * sqrt(dx * dx + dz * dz + lamp.y * lamp.y));
            }
            worst = fmax(worst, fabs(got / want - 1.0));
            if (fabs(got - want) > OFF * want)
                fail_msg("%s, pixel %u,%u: %g lx, closed form %g", what, x, y, got, want);
        }
    print_message("%s: off by %.2g at most\n", what, worst);
}

static void until_complete(struct rig *r)
{
    while (!rig_pass(r).complete)
        continue;
}

enum { SHINES = 8 };

static struct lum_material_desc made_of(int k, const char **ret_what)
{
    static const char *const names[] = {"matt",   "black", "mirror", "brushed metal",  "clear glass",
                                        "a pane", "coat",  "unlit",  "that shines too"};
    struct lum_material_desc m = rig_diffuse(0.5f);
    if (k == 1)
        m.base_color = lum_grey(0.0f);
    m.metallic = k == 2 || k == 3 ? 1.0f : 0.0f;
    m.roughness = k == 2 || k == 4 || k == 5 ? 0.0f : 0.3f;
    m.transmission = k == 4 || k == 5 ? 1.0f : 0.0f;
    m.thin = k == 5;
    m.specular = k >= 2 && k <= 6 ? 1.0f : 0.0f;
    m.unlit = k == 7;
    m.emission_cd_m2 = k == SHINES ? 1000.0 : 0.0;
    *ret_what = k < (int)LUM_ARRAY_LEN(names) ? names[k] : NULL;
    return m;
}

/* Of a lone plane no light comes back: each method has the closed form in every pixel. But where the floor is a lamp,
 * too, paths choose between the two: then without them. */
static void a_lambert_floor_under_a_lamp(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    const char *what;
    for (size_t i = 0; i < n; i++)
        for (int k = 0; made_of(k, &what), what; k++) {
            if ((i + (size_t)k) % TEST_STRIDE != 0) /* each method and each material, but not each by each */
                continue;
            struct lum_material_desc m = made_of(k, &what);
            char where[96];
            struct rig r;
            snprintf(where, sizeof where, "%s, floor: %s", methods[i].name, what);
            rig_begin(&r, 1);
            r.settings.method = &methods[i];
            r.settings.max_spp = k == SHINES ? 1 : 4;
            floor_of(&r, &m);
            until_complete(&r);
            if (!(k == SHINES && methods[i].progressive))
                check_floor(&r, where, 0.0);
            rig_end(&r);
        }
}

/* Between lamp and floor it takes light, between floor and eye it does not: nothing is seen of it. */
static void fog_before_the_eye_is_not_in_it(void **state)
{
    (void)state;
    static const char *const names[] = {"path", "live", "ais"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(names); i++) {
        const char *what;
        struct lum_material_desc matt = made_of(0, &what);
        struct lum_medium_desc fog = {.sigma_s = lum_grey(0.04f), .sigma_a = lum_grey(0.06f), .everywhere = true};
        struct rig r;
        rig_begin(&r, 1);
        r.settings.method = lum_method_find(names[i]);
        r.settings.max_spp = 4;
        RIG_OK(lum_scene_put_medium(r.scene, "fog", &fog, &err));
        r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING); /* which lights the floor, too */
        floor_of(&r, &matt);
        until_complete(&r);
        check_floor(&r, names[i], 0.1);
        rig_end(&r);
    }
}

/* Under an even sky of 100 cd/m2 a ball has pi times that where it faces up; the sky itself has none, and a lamp before
 * it that the eye sees has none. Sky and lamp shape would show their luminance, were they in it. */
static void what_is_no_surface_is_black(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t i = 0; i < n; i++) {
        struct rig r;
        struct lum_light_desc sky = {.kind = &lum_light_kind_environment,
                                     .color = lum_grey(1),
                                     .intensity = 100,
                                     .on = true,
                                     .camera_visible = true};
        struct lum_light_desc panel = rig_quad(rig_v(0, 1, 0), rig_v(0.5, 0, 0), rig_v(0, 0.5, 0), 300);
        rig_begin(&r, 1);
        r.settings.method = &methods[i];
        r.settings.max_spp = 2;
        r.settings.illuminance = true;
        rig_light(&r, "sky", &sky);
        rig_light(&r, "panel", &panel);
        rig_camera(&r, rig_v(0, 1, 3), rig_v(0, 1, 0), 40);
        rig_commit(&r);
        until_complete(&r);
        assert_true(lum_luminance(rig_mean(&r)) == 0.0f);
        rig_end(&r);
    }
}

/* A closed room in which all is lit by way of others: pictures at rest say what the light meter says. */
static void a_room_as_the_light_meter_has_it(void **state)
{
    (void)state;
    static const char *const names[] = {"path", "live"};
    struct lum_material_desc mirror = lum_material_default();
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    for (size_t i = 0; i < LUM_ARRAY_LEN(names); i++) {
        struct rig r;
        rig_begin(&r, 2);
        rig_room(&r);
        rig_material(&r, "red", &mirror); /* the crate's sides */
        struct lum_light_desc panel = rig_quad(rig_v(0, 2.9, 0), rig_v(0.4, 0, 0), rig_v(0, 0, 0.4), 2000);
        rig_light(&r, "panel", &panel);
        r.settings.method = lum_method_find(names[i]);
        r.settings.illuminance = true;
        r.settings.w = 24;
        r.settings.h = 16;
        r.settings.max_spp = TEST_EFFORT(512);
        rig_commit(&r);
        struct lum_pass_stats last;
        do
            last = rig_pass(&r);
        while (!last.complete);
        double sum = 0.0, known = 0.0, square = 0.0;
        uint32_t n = 0;
        for (uint32_t y = 1; y < r.settings.h; y += 2)
            for (uint32_t x = 1; x < r.settings.w; x += 2) {
                struct lum_pick pick;
                struct lum_probe probe;
                uint64_t rays;
                lum_pick_at(r.snapshot, &r.settings.camera, r.settings.w, r.settings.h, (double)x + 0.5,
                            (double)y + 0.5, &pick);
                if (!pick.hit || strcmp(pick.id, "panel") == 0)
                    continue;
                RIG_OK(probe_at(r.pool, r.snapshot, pick.point_world, pick.normal, 4096, 7, &probe, &rays, &err));
                sum += lux_at(&r, x, y);
                known += probe.illuminance_lx;
                square += probe.stderr_lx * probe.stderr_lx;
                n++;
            }
        /* Four deviations of both: the picture's own error is of pixels, whose noise is independent in `path`. */
        double tolerance = 4.0 * sqrt(square + pow(last.error.bound * sum, 2.0) / n);
        print_message("%s: %.4g lx in the mean, light meter %.4g +- %.2g\n", names[i], sum / n, known / n,
                      sqrt(square) / n);
        assert_true(n > 80);
        if (!(fabs(sum - known) <= tolerance))
            fail_msg("%s: %g lx in the mean, light meter %g, tolerance %g", names[i], sum / n, known / n,
                     tolerance / n);
        rig_end(&r);
    }
}

/* From luminance to illuminance and back: no eye ray, no shadow ray of surfaces whose visibility is known; and the same
 * picture as before. */
static void to_and_fro_by_what_is_known(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_room(&r);
    rig_bulb(&r, "lamp", rig_v(0.5, 2.5, 0.5), CD);
    r.settings.max_spp = 1;
    rig_commit(&r);
    rig_pass(&r);
    struct lum_rgb *before = rig_picture(&r);
    for (int there = 1; there >= 0; there--) {
        r.settings.illuminance = there;
        struct lum_pass_stats stats = rig_pass(&r);
        assert_true(stats.changed);
        assert_int_equal(stats.rays[LUM_RAY_PRIMARY], 0);
        assert_int_equal(stats.rays[LUM_RAY_DIRECT], 0);
    }
    rig_assert_picture(&r, before, "luminance again");
    lum_free(before);
    rig_end(&r);
}

/* ---- lines ---- */

static float *lux_of_picture(const struct rig *r)
{
    float *lux = lum_calloc((size_t)r->settings.w * r->settings.h, sizeof *lux);
    assert_non_null(lux);
    for (uint32_t y = 0; y < r->settings.h; y++)
        for (uint32_t x = 0; x < r->settings.w; x++)
            lux[(size_t)y * r->settings.w + x] = (float)lux_at(r, x, y);
    return lux;
}

static void find_lines(struct rig *r, const float *lux, const double *levels, uint32_t n, uint8_t *ret_lines)
{
    struct lum_aovs seen;
    RIG_OK(lum_view_aovs(r->view, r->snapshot, &r->settings, &seen, &err));
    const struct lum_isolines of = {.w = r->settings.w,
                                    .h = r->settings.h,
                                    .values = lux,
                                    .seen = &seen,
                                    .camera = &r->settings.camera,
                                    .levels = levels,
                                    .n_levels = n};
    RIG_OK(lum_isolines_find(&of, ret_lines, &err));
}

/* A line lies between pixels on either side of the level in closed form, or one pixel beside that: the mean over 5 x 5
 * pixels is off by (h^2 / 24) (d2E/dx2 + d2E/dy2), h the 5 pixels, which moves the line by less than a pixel where E is
 * no narrower than 10 of them. And wherever the closed form crosses a level there is such a line. */
static void isolux_lines_lie_where_the_closed_form_has_them(void **state)
{
    (void)state;
    static const char *const names[] = {"live", "path", "ic"};
    static const double levels[] = {5, 10, 20, 30, 50};
    enum { N = LUM_ARRAY_LEN(levels) };
    for (size_t i = 0; i < LUM_ARRAY_LEN(names); i++) {
        const char *what;
        struct lum_material_desc matt = made_of(0, &what);
        struct rig r;
        rig_begin(&r, 1);
        r.settings.method = lum_method_find(names[i]);
        r.settings.max_spp = 2;
        r.settings.w = 160;
        r.settings.h = 120;
        floor_of(&r, &matt);
        until_complete(&r);
        float *lux = lux_of_picture(&r);
        uint8_t *lines = lum_calloc((size_t)r.settings.w * r.settings.h, 1);
        assert_non_null(lines);
        find_lines(&r, lux, levels, N, lines);
        uint32_t n[N] = {0};
        for (uint32_t y = 1; y + 2 < r.settings.h; y++)
            for (uint32_t x = 1; x + 2 < r.settings.w; x++) {
                uint8_t line = lines[(size_t)y * r.settings.w + x];
                double lo = INFINITY, hi = 0.0; /* of what is within a pixel of the line */
                bool beside = false, found = false;
                for (uint32_t k = y - 1; k <= y + 2; k++)
                    for (uint32_t l = x - 1; l <= x + 2; l++) {
                        struct lum_vec3d p = floor_at(&r, l, k);
                        beside = beside || fabs(p.x) > 5.9 || fabs(p.z) > 5.9;
                        lo = fmin(lo, closed_form(p));
                        hi = fmax(hi, closed_form(p));
                    }
                if (beside)
                    continue;
                if (line && !(lo <= levels[line - 1] && hi >= levels[line - 1]))
                    fail_msg("%s, pixel %u,%u: line of %g lx, closed form %g to %g", names[i], x, y, levels[line - 1],
                             lo, hi);
                n[line ? line - 1 : 0] += line > 0;
                double here = closed_form(floor_at(&r, x, y)), right = closed_form(floor_at(&r, x + 1, y));
                for (uint32_t k = 0; k < N; k++) {
                    if ((here < levels[k]) == (right < levels[k]))
                        continue;
                    for (uint32_t dy = y - 1; dy <= y + 1; dy++)
                        for (uint32_t dx = x - 1; dx <= x + 1; dx++)
                            found = found || lines[(size_t)dy * r.settings.w + dx] == k + 1;
                    if (!found)
                        fail_msg("%s, pixel %u,%u: no line of %g lx between %g and %g", names[i], x, y, levels[k], here,
                                 right);
                }
            }
        for (uint32_t k = 0; k < N; k++)
            assert_true(n[k] > 20);
        struct lum_isoline_label labels[LUM_ISOLINE_LABELS];
        uint32_t n_labels = lum_isolines_label(lines, r.settings.w, r.settings.h, labels);
        assert_true(n_labels > 0);
        for (uint32_t k = 0; k < n_labels; k++)
            assert_int_equal(lines[(size_t)labels[k].y * r.settings.w + labels[k].x], labels[k].level + 1);
        lum_free(lines);
        lum_free(lux);
        rig_end(&r);
    }
}

/* A crate on the floor is brighter than what is behind it: no line goes along its edge. And where noise may move a line
 * to the next level there is none. */
static void lines_keep_to_surfaces_and_to_what_is_certain(void **state)
{
    (void)state;
    enum { SIDE = 64 };
    float values[SIDE * SIDE], depth[SIDE * SIDE];
    struct lum_vec3 normal[SIDE * SIDE];
    uint32_t instance[SIDE * SIDE];
    uint8_t lines[SIDE * SIDE];
    const double levels[] = {10, 20};
    const struct lum_camera camera = {{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 40, false};
    struct lum_eye e;
    RIG_OK(lum_eye_init(&e, &camera, &(struct lum_normalisation){.scale = 1.0}, SIDE, SIDE, &err));
    for (uint32_t i = 0; i < SIDE * SIDE; i++) { /* two planes that face the eye, one behind the other */
        uint32_t x = i % SIDE;
        bool near = x < SIDE / 2;
        values[i] = near ? 5.0f : x < 3 * SIDE / 4 ? 15.0f : 25.0f;
        depth[i] = (near ? 1.0f : 3.0f) / -lum_eye_direction(&e, (float)x + 0.5f, (float)(i / SIDE) + 0.5f).z;
        normal[i] = lum_v3(0, 0, 1);
        instance[i] = 7;
    }
    const struct lum_aovs seen = {.normal_world = normal, .depth_m = depth, .instance = instance};
    struct lum_isolines of = {
        .w = SIDE, .h = SIDE, .values = values, .seen = &seen, .camera = &camera, .levels = levels, .n_levels = 2};
    RIG_OK(lum_isolines_find(&of, lines, &err));
    uint32_t n = 0;
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        if (!lines[i])
            continue;
        n++;
        assert_int_equal(lines[i], 2);
        assert_in_range(i % SIDE, 3 * SIDE / 4 - 3, 3 * SIDE / 4 + 2);
    }
    assert_int_equal(n, SIDE);
    struct lum_film film;
    struct lum_error_map errors;
    RIG_OK(lum_film_init(&film, SIDE, SIDE, &err));
    for (int noisy = 0; noisy < 2;
         noisy++) { /* 2 sigma are 10 where lines are 10 apart: as many as may be, then more */
        RIG_OK(lum_error_map_init(&errors, &film, &err));
        for (uint32_t i = 0; i < SIDE * SIDE; i++)
            lum_error_map_add(&errors, i % SIDE, i / SIDE, noisy ? 25.1 : 24.9, 1.0);
        lum_error_map_settle(&errors);
        of.errors = &errors;
        of.per_error = 1.0;
        RIG_OK(lum_isolines_find(&of, lines, &err));
        n = 0;
        for (uint32_t i = 0; i < SIDE * SIDE; i++)
            n += lines[i] > 0;
        assert_int_equal(n, noisy ? 0 : SIDE);
        lum_error_map_finish(&errors);
    }
    lum_film_finish(&film);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_lambert_floor_under_a_lamp),
        cmocka_unit_test(fog_before_the_eye_is_not_in_it),
        cmocka_unit_test(what_is_no_surface_is_black),
        cmocka_unit_test(a_room_as_the_light_meter_has_it),
        cmocka_unit_test(to_and_fro_by_what_is_known),
        cmocka_unit_test(isolux_lines_lie_where_the_closed_form_has_them),
        cmocka_unit_test(lines_keep_to_surfaces_and_to_what_is_certain),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
