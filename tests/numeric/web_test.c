/* Photometric webs: their integral, the directions drawn from them, the three types of photometry; and lamps that have
 * one, against lamps that are the same without. */
#include "tests/support/rig.h"

#include "core/light/emit.h"
#include "core/light/web_facts.h"
#include "core/scene/light_kind.h"
#include "tests/numeric/stats.h"
#include "tests/support/webs.h"

#define DEG 0.017453292519943295

/* Smooth and rough ones, all around and of a part; the last two begin and end where others have no value. */
static const struct {
    struct web_grid grid;
    web_fn fn;
} webs[] = {
    {{LUM_WEB_C, 0, 0, 0, 180, 1, 2}, web_even},         {{LUM_WEB_C, 0, 0, 0, 90, 1, 19}, web_cosine},
    {{LUM_WEB_C, 0, 360, 0, 180, 25, 37}, web_lopsided}, {{LUM_WEB_C, 0, 360, 0, 180, 5, 4}, web_lopsided},
    {{LUM_WEB_C, -90, 270, 85, 170, 9, 12}, web_even},   {{LUM_WEB_B, -90, 90, 20, 160, 13, 9}, web_lopsided},
};

/* By midpoints in gamma and in c; the finer, the better. */
static double integral_between(const struct lum_web *w, double c0, double c1, double gamma0, double gamma1, int n)
{
    double sum = 0.0, dc = (c1 - c0) / n, dg = (gamma1 - gamma0) / n;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++) {
            double c = c0 + (i + 0.5) * dc, gamma = gamma0 + (k + 0.5) * dg;
            sum += (double)lum_web_share(w, (float)c, (float)gamma) * sin(gamma);
        }
    return sum * dc * dg;
}

/* Midpoints have an error of a few 1e-4 where cells end between them: steps of 0.3 degrees in c, of 0.15 in gamma. */
static void the_integral_is_that_of_the_interpolant(void **state)
{
    (void)state;
    for (size_t i = 0; i < LUM_ARRAY_LEN(webs); i++) {
        struct lum_web *w = web_of(&webs[i].grid, webs[i].fn);
        double want = integral_between(w, -LUM_PI_D, LUM_PI_D, 0.0, LUM_PI_D, 1200);
        if (!(fabs(w->flux_sr / want - 1.0) < 1e-3))
            fail_msg("web %zu: %.7g sr, by midpoints %.7g", i, w->flux_sr, want);
        lum_web_unref(w);
    }
}

/* Even light: 4 pi in closed form, at any step. Lambert's: pi, and chords of a cosine at steps of h lie below it by
 * h^2 / 12 of itself in the mean. */
static void closed_forms(void **state)
{
    (void)state;
    static const double steps[] = {1, 5, 10, 22.5};
    for (size_t i = 0; i < LUM_ARRAY_LEN(steps); i++) {
        double h = steps[i] * DEG;
        struct web_grid even = {LUM_WEB_C, 0, 360, 0, 180, 5, (uint32_t)(180 / steps[i]) + 1};
        struct web_grid down = {LUM_WEB_C, 0, 0, 0, 90, 1, (uint32_t)(90 / steps[i]) + 1};
        struct lum_web *a = web_of(&even, web_even), *b = web_of(&down, web_cosine);
        assert_true(fabs(a->flux_sr / (4.0 * LUM_PI_D) - 1.0) < 1e-6);
        assert_true(fabs(a->peak_cd / 100.0 - 1.0) < 1e-6);
        double short_by = 1.0 - b->flux_sr / LUM_PI_D;
        if (!(fabs(short_by - h * h / 12.0) < 0.05 * h * h / 12.0 + 1e-6))
            fail_msg("steps of %g degrees: %.6g short, expected %.6g", steps[i], short_by, h * h / 12.0);
        lum_web_unref(a);
        lum_web_unref(b);
    }
}

/* Directions fall into bins of c and gamma in proportion to the light there. */
static void directions_follow_the_web(void **state)
{
    (void)state;
    enum { N_C = 12, N_GAMMA = 10, DRAWS = 200000 };
    static struct chi2_cell cell[N_C * N_GAMMA];
    const double level = sidak(0.01, LUM_ARRAY_LEN(webs));
    for (size_t i = 0; i < LUM_ARRAY_LEN(webs); i++) {
        struct lum_web *w = web_of(&webs[i].grid, webs[i].fn);
        double dc = 2.0 * LUM_PI_D / N_C, dg = LUM_PI_D / N_GAMMA;
        for (int a = 0; a < N_C; a++)
            for (int b = 0; b < N_GAMMA; b++) {
                double flux =
                    integral_between(w, a * dc - LUM_PI_D, (a + 1) * dc - LUM_PI_D, b * dg, (b + 1) * dg, 200);
                cell[a * N_GAMMA + b] = (struct chi2_cell){flux / w->flux_sr * DRAWS, 0.0};
            }
        struct rng random = {i + 1};
        for (int k = 0; k < DRAWS; k++) {
            struct lum_vec2 u = {(float)(rng_u64(&random) >> 40) * 0x1p-24f,
                                 (float)(rng_u64(&random) >> 40) * 0x1p-24f};
            struct lum_vec3 d = lum_web_draw(w, u);
            assert_true(fabsf(lum_length(d) - 1.0f) < 1e-5f);
            double c = atan2((double)d.y, (double)d.x) + LUM_PI_D, gamma = acos(fmin(fmax((double)d.z, -1.0), 1.0));
            int a = (int)fmin(c / dc, N_C - 1), b = (int)fmin(gamma / dg, N_GAMMA - 1);
            cell[a * N_GAMMA + b].observed += 1.0;
        }
        double p = chi2_p_value(cell, N_C * N_GAMMA);
        if (p < level)
            fail_msg("web %zu: p = %g", i, p);
        lum_web_unref(w);
    }
}

/* ---- types of photometry ---- */

/* The lamp aims down -y, its length lies along +x: c90 is -z. */
static struct lum_light lamp_with(const struct lum_web *web)
{
    struct lum_light l = {.kind = &lum_emitter_point, .falloff = &lum_falloff_web, .web = web, .n = {0, -1, 0}};
    l.frame = lum_web_frame(web->type, l.n, lum_v3(1, 0, 0));
    return l;
}

/* Where type C, B and A say that light goes, from LM-63's own words: the beam is d, up for B and A is c0, and positive
 * horizontal angles go to the right of who looks along the beam. */
static struct lum_vec3 way(enum lum_web_type type, double h, double v)
{
    double sh = sin(h * DEG), ch = cos(h * DEG), sv = sin(v * DEG), cv = cos(v * DEG);
    double beam, up, right; /* along -y, +x, +z */
    if (type == LUM_WEB_C) {
        beam = cv, up = sv * ch, right = -sv * sh;
    } else if (type == LUM_WEB_B) { /* turned about the horizontal axis by v, then by h towards it */
        beam = ch * cv, up = ch * sv, right = sh;
    } else { /* turned about the vertical axis by h, then by v towards it */
        beam = cv * ch, up = sv, right = cv * sh;
    }
    return lum_v3((float)up, (float)-beam, (float)right);
}

static double one_bright(double c, double gamma)
{
    return fabs(c - 30.0) < 1e-3 && fabs(gamma - 70.0) < 1e-3 ? 1000.0 : 1.0;
}

static void types_point_where_they_say(void **state)
{
    (void)state;
    static const struct {
        struct web_grid grid;
        double h, v;
    } rows[] = {
        {{LUM_WEB_C, 0, 360, 0, 180, 37, 19}, 30, 70},  /* c is H, gamma V */
        {{LUM_WEB_B, -90, 90, 0, 180, 19, 19}, 20, 30}, /* c is V, gamma 90 - H */
        {{LUM_WEB_A, -90, 90, 0, 180, 19, 19}, 30, 20}, /* c is H, gamma 90 - V */
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        struct lum_web *w = web_of(&rows[i].grid, one_bright);
        struct lum_light l = lamp_with(w);
        struct lum_vec3 wi = lum_v3_neg(way(rows[i].grid.type, rows[i].h, rows[i].v));
        float share = lum_falloff_web.share(&l, wi);
        if (!(fabsf(share - 1.0f) < 1e-4f))
            fail_msg("type %d: %g at its bright point", rows[i].grid.type, (double)share);
        lum_web_unref(w);
    }
}

/* A lobe of the cosine of the angle from an axis that lies along no axis of the three types. */
static double lobe(struct lum_vec3 d)
{
    double c = (double)(0.48f * d.x - 0.8f * d.y + 0.36f * d.z);
    return 1.0 + fmax(c, 0.0);
}

static double lobe_c(double c, double gamma)
{
    return lobe(way(LUM_WEB_C, c, gamma));
}

static double lobe_b(double c, double gamma)
{
    return lobe(way(LUM_WEB_B, 90 - gamma, c));
}

static double lobe_a(double c, double gamma)
{
    return lobe(way(LUM_WEB_A, c, 90 - gamma));
}

/* At steps of 5 degrees chords lie below a cosine by h^2 / 8 = 0.1 % at most in each of both angles, and next to its
 * edge, where it has a corner, by another h / 4 of the slope there. */
static void one_beam_in_all_types(void **state)
{
    (void)state;
    static const struct web_grid grids[] = {{LUM_WEB_C, 0, 360, 0, 180, 73, 37},
                                            {LUM_WEB_B, -90, 90, 0, 180, 37, 37},
                                            {LUM_WEB_A, -90, 90, 0, 180, 37, 37}};
    static const web_fn fns[] = {lobe_c, lobe_b, lobe_a};
    struct rng random = {5};
    for (size_t i = 0; i < 3; i++) {
        struct lum_web *w = web_of(&grids[i], fns[i]);
        struct lum_light l = lamp_with(w);
        for (int k = 0; k < 2000; k++) {
            struct lum_vec3 d =
                lum_normalize(lum_v3((float)(rng_unit(&random) - 0.5), (float)(-0.01 - rng_unit(&random)),
                                     (float)(rng_unit(&random) - 0.5)));
            double got = (double)lum_falloff_web.share(&l, lum_v3_neg(d)) * w->peak_cd;
            if (!(fabs(got - lobe(d)) < 0.004 + 0.25 * 5 * DEG * (fabs(lobe(d) - 1.0) < 0.1)))
                fail_msg("type %zu, towards %g %g %g: %g, expected %g", i, (double)d.x, (double)d.y, (double)d.z, got,
                         lobe(d));
        }
        lum_web_unref(w);
    }
}

/* ---- lamps in a room ---- */

static struct lum_light_desc lamp(const struct lum_web *web)
{
    return (struct lum_light_desc){.kind = &lum_light_kind_ies,
                                   .position = {0.2, 2.2, 0.1},
                                   .direction = {0, -1, 0},
                                   .u = {1, 0, 0},
                                   .web = web,
                                   .color = lum_grey(1),
                                   .intensity = web->peak_cd,
                                   .on = true};
}

static void begin_room(struct rig *r, const char *method, uint32_t spp)
{
    rig_begin(r, 1);
    rig_room(r);
    r->settings.method = lum_method_find(method);
    r->settings.max_spp = spp;
    rig_camera(r, rig_v(-1.2, 1.6, 1.7), rig_v(0.3, 1.1, -0.4), 70);
}

enum { SEEDS = 12 };

/* Mean of SEEDS pictures: where light is random, of other random numbers. */
static struct mean render(struct rig *r, const struct lum_light_desc *l)
{
    struct mean mean = {0};
    rig_light(r, "lamp", l);
    rig_commit(r);
    for (r->settings.seed = 0; r->settings.seed < SEEDS; r->settings.seed++) {
        rig_fresh_view(r);
        while (!rig_pass(r).complete)
            continue;
        mean_add(&mean, (double)rig_mean(r).g);
    }
    return mean;
}

/* Where light comes by chance, four standard errors; else, rounding. `path` and `whitted` draw no direction from a
 * lamp. */
static void check_same(const char *method, struct mean a, struct mean b)
{
    bool exact = strcmp(method, "path") == 0 || strcmp(method, "whitted") == 0;
    double error = hypot(mean_stderr(&a), mean_stderr(&b));
    if (!(fabs(b.mean - a.mean) <= 1e-4 * a.mean + (exact ? 0.0 : 4.0 * error)))
        fail_msg("%s: %.6g and %.6g, +- %.2g", method, a.mean, b.mean, error);
}

/* Even all around, a lamp with a web is a point, in every method, and in fog. */
static void an_even_web_is_a_point(void **state)
{
    (void)state;
    static const char *const methods[] = {"path", "live", "tic", "igi", "ais", "ic", "irrcache", "whitted"};
    static const struct web_grid grid = {LUM_WEB_C, 0, 360, 0, 180, 5, 19};
    struct lum_medium_desc fog = {.sigma_s = lum_grey(0.2f), .g = 0.3f, .everywhere = true};
    struct lum_web *w = web_of(&grid, web_even);
    for (size_t m = 0; m < 2 * LUM_ARRAY_LEN(methods); m++) {
        struct rig r;
        begin_room(&r, methods[m / 2], 1);
        if (m % 2)
            RIG_OK(lum_scene_put_medium(r.scene, "fog", &fog, &err));
        struct lum_light_desc with = lamp(w), point = with;
        point.kind = &lum_light_kind_point;
        struct mean a = render(&r, &point), b = render(&r, &with);
        check_same(methods[m / 2], a, b);
        rig_end(&r);
    }
    lum_web_unref(w);
}

static double turned(double c, double gamma)
{
    return web_lopsided(c - 90.0, gamma);
}

/* A web turned by 90 degrees is a lamp turned by 90 degrees: from c0 to c90. */
static void a_turned_web_is_a_turned_lamp(void **state)
{
    (void)state;
    static const char *const methods[] = {"path", "live", "tic"};
    static const struct web_grid grid = {LUM_WEB_C, 0, 360, 0, 180, 25, 37};
    struct lum_web *w = web_of(&grid, web_lopsided), *w90 = web_of(&grid, turned);
    for (size_t m = 0; m < LUM_ARRAY_LEN(methods); m++) {
        struct rig r;
        begin_room(&r, methods[m], 1);
        struct lum_light_desc straight = lamp(w), lamp90 = straight, web90 = lamp(w90);
        lamp90.u = rig_v(0, 0, -1); /* c90 of a lamp that aims down */
        struct mean a = render(&r, &lamp90), b = render(&r, &web90), c = render(&r, &straight);
        check_same(methods[m], a, b);
        if (!(fabs(c.mean / a.mean - 1.0) > 0.05)) /* and it matters which way */
            fail_msg("%s: %.6g whichever way it is turned", methods[m], c.mean);
        rig_end(&r);
    }
    lum_web_unref(w);
    lum_web_unref(w90);
}

/* Dimmed, coloured, or told by flux, it sends no ray; given another web, it does. */
static void a_dimmed_web_traces_no_ray(void **state)
{
    (void)state;
    struct lum_web *w = web_of_a_lamp();
    static const struct web_grid grid = {LUM_WEB_C, 0, 0, 0, 90, 1, 19};
    struct lum_web *other = web_of(&grid, web_cosine);
    struct rig r;
    begin_room(&r, "live", 1);
    struct lum_light_desc l = lamp(w);
    rig_light(&r, "lamp", &l);
    rig_commit(&r);
    while (!rig_pass(&r).complete)
        continue;
    double bright = (double)rig_mean(&r).g;
    l.intensity *= 0.5;
    rig_light(&r, "lamp", &l);
    rig_commit(&r);
    struct lum_pass_stats stats = rig_pass(&r);
    if (rig_all_rays(&stats) != stats.rays[LUM_RAY_PROBE])
        fail_msg("%llu rays for a dimmed lamp", (unsigned long long)rig_all_rays(&stats));
    assert_true(fabs((double)rig_mean(&r).g / bright - 0.5) < 1e-4);
    l.web = other;
    rig_light(&r, "lamp", &l);
    rig_commit(&r);
    stats = rig_pass(&r);
    assert_true(rig_all_rays(&stats) > stats.rays[LUM_RAY_PROBE]);
    lum_web_unref(w);
    lum_web_unref(other);
    rig_end(&r);
}

/* ---- openings ---- */

/* Lambert's web over an opening is a Lambertian lamp of that shape: of luminance I / A, seen and as light, in every
 * method. Chords lie 0.1 % below the cosine at most, as in the web of 5 degrees; four standard errors. */
static void lamberts_web_is_a_lambertian_area(void **state)
{
    (void)state;
    static const char *const methods[] = {"path", "live", "tic", "igi", "ais", "ic", "irrcache"};
    static const struct web_grid grid = {LUM_WEB_C, 0, 0, 0, 90, 1, 19};
    struct lum_web *w = web_of(&grid, web_cosine);
    for (size_t m = 0; m < 2 * LUM_ARRAY_LEN(methods); m++) {
        struct rig r;
        bool disc = m % 2;
        double area = disc ? LUM_PI_D * 0.15 * 0.15 : 0.5 * 0.3;
        begin_room(&r, methods[m / 2], 2);
        rig_camera(&r, rig_v(-1.2, 1.2, 1.7), rig_v(0.2, 2.2, 0.1), 80);
        struct lum_light_desc with = lamp(w), plain = with;
        with.opening = disc ? LUM_OPENING_DISC : LUM_OPENING_RECTANGLE;
        with.opening_m[0] = disc ? 0.3 : 0.5;
        with.opening_m[1] = 0.3;
        with.camera_visible = plain.camera_visible = true;
        plain.kind = disc ? &lum_light_kind_disc : &lum_light_kind_quad;
        plain.u = rig_v(0.5, 0, 0); /* u x v points down */
        plain.v = rig_v(0, 0, 0.3);
        plain.radius_m = 0.15;
        plain.intensity = with.intensity / area;
        struct mean a = render(&r, &plain), b = render(&r, &with);
        double error = hypot(mean_stderr(&a), mean_stderr(&b));
        if (!(fabs(b.mean - a.mean) <= 2e-3 * a.mean + 4.0 * error))
            fail_msg("%s, %s: %.6g, Lambertian %.6g +- %.2g", methods[m / 2], disc ? "disc" : "rectangle", b.mean,
                     a.mean, error);
        rig_end(&r);
    }
    lum_web_unref(w);
}

/* From afar an opening of any web is the point: at 2 m one of 2 cm is, but for (0.01 / 2)^2 and what lies behind. */
static void a_small_opening_is_a_point(void **state)
{
    (void)state;
    static const char *const methods[] = {"path", "live", "tic"};
    struct lum_web *w = web_of_a_lamp();
    for (size_t m = 0; m < 2 * LUM_ARRAY_LEN(methods); m++) {
        struct rig r;
        begin_room(&r, methods[m / 2], 2);
        struct lum_light_desc point = lamp(w), with = point;
        with.opening = m % 2 ? LUM_OPENING_DISC : LUM_OPENING_RECTANGLE;
        with.opening_m[0] = with.opening_m[1] = 0.02;
        struct mean a = render(&r, &point), b = render(&r, &with);
        double error = hypot(mean_stderr(&a), mean_stderr(&b));
        if (!(fabs(b.mean - a.mean) <= 2e-3 * a.mean + 4.0 * error))
            fail_msg("%s: %.6g, a point %.6g +- %.2g", methods[m / 2], b.mean, a.mean, error);
        rig_end(&r);
    }
    lum_web_unref(w);
}

/* What is seen of an opening is I / (A cos) at every angle, and nothing where the web is dark. */
static void an_opening_is_as_bright_as_its_web(void **state)
{
    (void)state;
    static const double angles[] = {10, 20, 40, 60, 80, 95, 110, 150};
    static const struct web_grid grid = {LUM_WEB_C, 0, 360, 0, 180, 25, 37};
    struct lum_web *w = web_of(&grid, web_lopsided);
    for (size_t k = 0; k < LUM_ARRAY_LEN(angles); k++) {
        struct rig r;
        begin_room(&r, "path", 1);
        struct lum_light_desc l = lamp(w);
        l.position = rig_v(0, 1.5, 1);
        l.opening = LUM_OPENING_RECTANGLE;
        l.opening_m[0] = 0.4, l.opening_m[1] = 0.2;
        l.camera_visible = true;
        double a = angles[k] * DEG; /* in the plane of c0 */
        rig_camera(&r, rig_v(sin(a), 1.5 - cos(a), 1), l.position, 1);
        r.settings.w = r.settings.h = 1; /* one ray, to its middle */
        r.settings.antialias = false;
        r.settings.camera.up = rig_v(0, 0, 1);
        rig_light(&r, "lamp", &l);
        rig_commit(&r);
        rig_fresh_view(&r);
        while (!rig_pass(&r).complete)
            continue;
        double want = lum_web_polar_cd(w, 0, angles[k]) / (0.08 * fabs(cos(a))), got = (double)rig_mean(&r).g;
        if (!(fabs(got - want) <= 2e-3 * want + 1e-6))
            fail_msg("at %g degrees: %.6g cd/m2, expected %.6g", angles[k], got, want);
        rig_end(&r);
    }
    lum_web_unref(w);
}

/* ---- what is refused, and what is shared ---- */

static void broken_webs_are_refused(void **state)
{
    (void)state;
    const float c[] = {0, 180, 360}, down[] = {0, 45, 30}, gamma[] = {0, 45, 90}, wide[] = {0, 90, 190};
    const float cd[9] = {1, 2, 3, 4, 5, 6, 7, 8, 9}, dark[9] = {0}, bad[9] = {1, -2, 3}, nan[9] = {1, NAN, 2};
    const float pole[2] = {0, 1e-6f}, spin[] = {0, 180, 361};
    const struct {
        struct lum_web_desc d;
        const char *field;
    } rows[] = {
        {{LUM_WEB_C, 0, 3, c, gamma, cd}, "candela"},
        {{LUM_WEB_C, 3, 1, c, gamma, cd}, "candela"},
        {{LUM_WEB_C, 3, 3, c, down, cd}, "gamma_deg"},
        {{LUM_WEB_C, 3, 3, c, wide, cd}, "gamma_deg"},
        {{LUM_WEB_C, 3, 3, down, gamma, cd}, "c_deg"},
        {{LUM_WEB_C, 3, 3, spin, gamma, cd}, "c_deg"},
        {{LUM_WEB_C, 3, 3, c, gamma, dark}, "candela"},
        {{LUM_WEB_C, 3, 3, c, gamma, bad}, "candela"},
        {{LUM_WEB_C, 3, 3, c, gamma, nan}, "candela"},
        {{(enum lum_web_type)7, 3, 3, c, gamma, cd}, "type"},
        {{LUM_WEB_C, 1 << 10, 1 << 10, c, gamma, cd}, "candela"},
        {{LUM_WEB_C, 0x10000, 0x10000, c, gamma, cd}, "candela"},
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        struct lum_web *w = NULL;
        struct lum_error err = {0};
        assert_true(lum_web_create(&rows[i].d, &w, &err) != LUM_OK && !w);
        assert_string_equal(err.field, rows[i].field);
    }
    struct lum_web *w = NULL; /* next to no solid angle is some */
    assert_int_equal(lum_web_create(&(struct lum_web_desc){LUM_WEB_C, 1, 2, c, pole, cd}, &w, NULL), LUM_OK);
    assert_true(w->flux_sr > 0.0 && lum_v3_finite(lum_web_draw(w, (struct lum_vec2){0.3f, 0.9f})));
    lum_web_unref(w);
    struct rig r;
    rig_begin(&r, 1);
    struct lum_error err = {0};
    struct lum_light_desc l = {
        .kind = &lum_light_kind_ies, .direction = {0, -1, 0}, .u = {1, 0, 0}, .color = lum_grey(1)};
    assert_int_equal(lum_scene_put_light(r.scene, "lamp", &l, &err), LUM_ERR_INVALID);
    assert_string_equal(err.field, "web");
    rig_end(&r);
}

/* Three hundred lamps of one file have one web, and snapshots keep it when the lamps are gone. */
static void equal_webs_are_one(void **state)
{
    (void)state;
    static const float c[] = {0}, gamma[] = {0, 45, 90}, cd[3] = {3, 2, 0}, less[3] = {3, 1, 0};
    const struct lum_web_desc d = {LUM_WEB_C, 1, 3, c, gamma, cd}, other = {LUM_WEB_C, 1, 3, c, gamma, less};
    struct lum_web *w[3] = {NULL};
    struct rig r;
    rig_begin(&r, 1);
    RIG_OK(lum_scene_take_web(r.scene, &d, &w[0], &err));
    struct lum_light_desc l = lamp(w[0]);
    rig_light(&r, "a", &l);
    RIG_OK(lum_scene_take_web(r.scene, &d, &w[1], &err));
    RIG_OK(lum_scene_take_web(r.scene, &other, &w[2], &err));
    assert_true(w[0] == w[1] && w[0] != w[2]);
    l.web = w[1];
    rig_light(&r, "b", &l);
    rig_commit(&r);
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "a", &err));
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "b", &err));
    for (int k = 0; k < 3; k++)
        lum_web_unref(w[k]);
    assert_true(r.snapshot->lights.lights[1].web->peak_cd == 3.0);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_integral_is_that_of_the_interpolant),
        cmocka_unit_test(closed_forms),
        cmocka_unit_test(directions_follow_the_web),
        cmocka_unit_test(types_point_where_they_say),
        cmocka_unit_test(one_beam_in_all_types),
        cmocka_unit_test(an_even_web_is_a_point),
        cmocka_unit_test(a_turned_web_is_a_turned_lamp),
        cmocka_unit_test(a_dimmed_web_traces_no_ray),
        cmocka_unit_test(lamberts_web_is_a_lambertian_area),
        cmocka_unit_test(a_small_opening_is_a_point),
        cmocka_unit_test(an_opening_is_as_bright_as_its_web),
        cmocka_unit_test(broken_webs_are_refused),
        cmocka_unit_test(equal_webs_are_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
