/* How much light of lamps without extent goes by way of mirrors and solid glass: closed forms, and what costs no ray.
 *
 * Tolerances: a path of n focuses with a chance p that is the closed form, so that the share has the standard deviation
 * sqrt(p (1 - p) / n), less for numbers of low discrepancy; four of them are never met in these few cases. */
#include "core/vpl/caustic.h"

#include <math.h>

#include "tests/support/probe_at.h"
#include "tests/support/rig.h"

struct bench {
    struct rig r;
    struct lum_caustics caustics;
};

static void begin(struct bench *b, uint32_t threads)
{
    *b = (struct bench){0};
    rig_begin(&b->r, threads);
    struct lum_material_desc matte = rig_diffuse(0.5f);
    rig_material(&b->r, "matte", &matte);
    rig_square(&b->r, "wide", 50.0);
    rig_square(&b->r, "small", 0.5);
}

static void end(struct bench *b)
{
    lum_caustics_finish(&b->caustics);
    rig_end(&b->r);
}

static const struct lum_caustic_report *measure(struct bench *b)
{
    rig_commit(&b->r);
    bool serves = lum_caustics_serve(&b->caustics, b->r.snapshot);
    RIG_OK(lum_caustics_update(&b->caustics, b->r.snapshot, b->r.pool, &err));
    assert_int_equal(b->caustics.bad_rays, 0);
    assert_int_equal(b->caustics.nonfinite, 0);
    assert_int_equal(serves, b->caustics.report.n_rays == 0);
    return &b->caustics.report;
}

static void put_mirror(struct bench *b, const char *mesh, double y, float reflectance)
{
    struct lum_material_desc m = lum_material_default();
    m.base_color = lum_grey(reflectance);
    m.metallic = 1.0f;
    m.roughness = 0.0f;
    rig_material(&b->r, "silver", &m);
    rig_object(&b->r, "mirror", mesh, "silver", rig_v(0, y, 0));
}

/* half: angle of the cone, whose light is even. */
static void put_spot(struct bench *b, const char *id, double y, double half, double cd)
{
    struct lum_light_desc l = {.kind = &lum_light_kind_spot,
                               .position = rig_v(0, y, 0),
                               .direction = rig_v(0, -1, 0),
                               .inner_cone_rad = half,
                               .outer_cone_rad = half,
                               .color = lum_grey(1),
                               .intensity = cd,
                               .on = true};
    rig_light(&b->r, id, &l);
}

static void assert_share(const struct lum_caustic_report *r, double want, double n_paths, const char *what)
{
    double got = lum_caustic_share(&r->all), deviation = sqrt(want * (1.0 - want) / n_paths);
    if (!(fabs(got - want) <= 4.0 * deviation))
        fail_msg("%s: share %.5f, expected %.5f +- %.5f", what, got, want, deviation);
    /* it is less where glass takes some of the light on every path; a fifth: four deviations of a deviation, 4 / sqrt(2
     * n) */
    double told = lum_caustic_share_stderr(&r->all);
    if (!(told > 0.0 && told < 1.2 * deviation))
        fail_msg("%s: standard error %.5f, expected %.5f", what, told, deviation);
}

/* ---- mirrors ---- */

/* Solid angle of a square of half edge a, seen from a height h above its centre. */
static double square_sr(double a, double h)
{
    return 4.0 * asin(a * a / (a * a + h * h));
}

static void a_mirror_under_a_lamp(void **state)
{
    (void)state;
    const double high = 2.0, half = 0.6, reflectance = 0.8;
    double cone = 2.0 * LUM_PI_D * (1.0 - cos(half));
    for (int kind = 0; kind < 2; kind++) {
        struct bench b;
        begin(&b, 2);
        rig_object(&b.r, "floor", "wide", "matte", rig_v(0, 0, 0));
        rig_object(&b.r, "ceiling", "wide", "matte", rig_v(0, 3, 0));
        put_mirror(&b, "small", 0.01, (float)reflectance);
        if (kind == 0)
            put_spot(&b, "lamp", high + 0.01, half, 100.0);
        else
            rig_bulb(&b.r, "lamp", rig_v(0, high + 0.01, 0), 100.0);
        const struct lum_caustic_report *r = measure(&b);
        /* of the bulb's light all but what goes between floor and ceiling to the sides, 1 / 50 of it, meets something
         */
        double met = kind == 0 ? cone : 4.0 * LUM_PI_D * (1.0 - 0.5 * (3.0 / 50.0) / 2.0);
        double share = square_sr(0.5, high) / met * reflectance;
        assert_share(r, share, LUM_CAUSTIC_PATHS, kind == 0 ? "spot" : "bulb");
        assert_int_equal(r->n_lights, 1);
        assert_string_equal(r->lights[0].id, "lamp");
        assert_string_equal(r->lights[0].object, "mirror");
        assert_false(r->lights[0].glass);
        if (kind == 0) /* all of it meets the floor, whatever the scene is scaled by; floats have 24 bits */
            assert_true(fabs(r->all.arriving_lm / (100.0 * cone) - 1.0) < 1e-5);
        assert_true(r->n_rays > LUM_CAUSTIC_PATHS);
        end(&b);
    }
}

/* The sun at 45 degrees on a floor of 4 m by 4 m with a mirror of 3 m by 3 m in it, which lights a wall as large as the
 * floor, as far away as it is high. All see the sun at the same angle. */
static void a_mirror_in_the_sun(void **state)
{
    (void)state;
    const double wall[] = {5, 3, -2, 5, 7, -2, 5, 7, 2, 5, 3, 2};
    const uint32_t two[] = {0, 1, 2, 0, 2, 3};
    struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                 .direction = {1, -1, 0},
                                 .color = lum_grey(1),
                                 .intensity = 1000.0,
                                 .on = true};
    struct bench b;
    begin(&b, 2);
    rig_square(&b.r, "floor", 2.0);
    rig_mesh(&b.r, "wall", wall, 4, two, 2);
    rig_object(&b.r, "floor", "floor", "matte", rig_v(0, 0, 0));
    rig_object(&b.r, "wall", "wall", "matte", rig_v(0, 0, 0));
    rig_square(&b.r, "large", 1.5);
    put_mirror(&b, "large", 0.001, 0.9f);
    rig_light(&b.r, "sun", &sun);
    const struct lum_caustic_report *r = measure(&b);
    double lm = 32.0 * sqrt(0.5) * 1000.0;
    /* the sun shines on the box around all this: 7 x 4 m from above, 7 x 4 m from the side */
    double lit = 32.0 / (7.0 * 4.0 + 7.0 * 4.0), spread = sqrt((1.0 - lit) / (lit * LUM_CAUSTIC_PATHS));
    assert_true(fabs(r->all.arriving_lm / lm - 1.0) < 4.0 * spread);
    assert_share(r, 0.9 * 9.0 / 32.0, lit * LUM_CAUSTIC_PATHS, "sun");
    end(&b);
}

/* Between the mirrors light comes and goes; the rays are bounded. */
static void a_hall_of_mirrors_has_an_end(void **state)
{
    (void)state;
    struct bench b;
    begin(&b, 2);
    rig_box(&b.r, "box", 1, 1, 1);
    put_mirror(&b, "box", 0, 1.0f);
    rig_bulb(&b.r, "lamp", rig_v(0.1, 0.2, 0.3), 100.0);
    const struct lum_caustic_report *r = measure(&b);
    assert_int_equal(r->n_rays, LUM_CAUSTIC_PATHS * LUM_CAUSTIC_SEGMENTS);
    assert_true(r->all.focused_lm == 0.0); /* nothing spreads it */
    assert_int_equal(r->n_lights, 0);
    end(&b);
}

/* A polished floor sends 4 % on, by Schlick's formula, which along the normal is exact. */
static void a_polished_floor_counts(void **state)
{
    (void)state;
    struct lum_material_desc m = lum_material_default();
    m.base_color = lum_grey(0.5f);
    m.roughness = 0.0f;
    struct bench b;
    begin(&b, 1);
    rig_material(&b.r, "polished", &m);
    rig_object(&b.r, "floor", "wide", "polished", rig_v(0, 0, 0));
    rig_object(&b.r, "ceiling", "wide", "matte", rig_v(0, 3, 0));
    put_spot(&b, "lamp", 2.0, 0.1, 100.0);
    assert_share(measure(&b), 0.04, LUM_CAUSTIC_PATHS, "polished floor");
    m.roughness = 0.2f; /* what it sends on now has spread, and shadow rays at it find the lamp */
    rig_material(&b.r, "polished", &m);
    assert_int_equal(measure(&b)->n_rays, 0);
    assert_true(b.caustics.report.all.focused_lm == 0.0);
    end(&b);
}

/* ---- glass ---- */

static struct lum_material_desc glass(double ior)
{
    struct lum_material_desc m = lum_material_default();
    m.transmission = 1.0f;
    m.ior = (float)ior;
    m.roughness = 0.0f;
    return m;
}

/* A slab with faces that reflect R, whose inside leaves t: (1 - R)^2 t / (1 - R^2 t^2) goes through, and what comes
 * back, with a ceiling to meet, is R + R (1 - R)^2 t^2 / (1 - R^2 t^2). */
static void a_slab_of_glass(void **state)
{
    (void)state;
    static const double iors[] = {1.5, 3.0}, inside[] = {1.0, 0.6};
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++)
            for (int ceiling = 0; ceiling < 2; ceiling++) {
                double ior = iors[i], t = inside[k], face = (ior - 1.0) * (ior - 1.0) / ((ior + 1.0) * (ior + 1.0));
                double loop = (1.0 - face) * (1.0 - face) * t / (1.0 - face * face * t * t);
                struct lum_material_desc m = glass(ior);
                m.attenuation_color = lum_grey((float)t);
                m.attenuation_distance_m = 0.2;
                struct bench b;
                begin(&b, 2);
                rig_box(&b.r, "slab", 0.5, 0.1, 0.5);
                rig_material(&b.r, "glass", &m);
                rig_object(&b.r, "slab", "slab", "glass", rig_v(0, 1, 0));
                rig_object(&b.r, "floor", "wide", "matte", rig_v(0, 0, 0));
                if (ceiling)
                    rig_object(&b.r, "ceiling", "wide", "matte", rig_v(0, 3, 0));
                put_spot(&b, "lamp", 2.0, 0.02, 100.0);
                const struct lum_caustic_report *r = measure(&b);
                char what[64];
                snprintf(what, sizeof what, "ior %g, %g left%s", ior, t, ceiling ? ", ceiling" : "");
                double share = ceiling ? loop + face + face * t * loop : loop;
                if (share < 0.999) /* where it is all there is no deviation */
                    assert_share(r, share, LUM_CAUSTIC_PATHS, what);
                else
                    assert_true(fabs(lum_caustic_share(&r->all) - 1.0) < 1e-5);
                assert_true(r->lights[0].glass);
                end(&b);
            }
}

/* Light goes straight through a pane, and through solid glass that is told not to bend it: shadow rays carry that. */
static void panes_do_not_count(void **state)
{
    (void)state;
    struct lum_material_desc thin = glass(1.5), solid = glass(1.5);
    thin.thin = true;
    struct bench b;
    begin(&b, 2);
    rig_box(&b.r, "slab", 0.5, 0.1, 0.5);
    rig_material(&b.r, "thin", &thin);
    rig_material(&b.r, "solid", &solid);
    rig_object(&b.r, "floor", "wide", "matte", rig_v(0, 0, 0));
    rig_object(&b.r, "pane", "small", "thin", rig_v(0, 1.5, 0));
    put_spot(&b, "lamp", 2.0, 0.02, 100.0);
    assert_int_equal(measure(&b)->n_rays, 0);
    rig_object(&b.r, "slab", "slab", "solid", rig_v(0, 0.8, 0));
    assert_true(measure(&b)->n_rays > 0);
    lum_scene_straighten_glass(b.r.scene, true);
    assert_int_equal(measure(&b)->n_rays, 0);
    /* a mirror that the lamp does not meet: paths are traced, and nothing is found but what the panes leave */
    put_mirror(&b, "small", 2.5, 0.9f);
    const struct lum_caustic_report *r = measure(&b);
    assert_true(r->n_rays > 0);
    assert_true(r->all.focused_lm == 0.0);
    double arrives = 100.0 * 2.0 * LUM_PI_D * (1.0 - cos(0.02)) * 0.96 * 0.96 * (0.96 / 1.04);
    assert_true(fabs(r->all.arriving_lm / arrives - 1.0) < 2e-3); /* the Fresnel terms at up to 0.02 rad */
    end(&b);
}

/* ---- what costs nothing ---- */

static void nothing_to_find_is_no_ray(void **state)
{
    (void)state;
    struct lum_light_desc panel = rig_quad(rig_v(0, 2, 0), rig_v(1, 0, 0), rig_v(0, 0, 1), 100.0);
    struct bench b;
    begin(&b, 2);
    rig_object(&b.r, "floor", "wide", "matte", rig_v(0, 0, 0));
    rig_object(&b.r, "ceiling", "wide", "matte", rig_v(0, 3, 0));
    assert_int_equal(measure(&b)->n_rays, 0); /* no light at all */
    rig_light(&b.r, "panel", &panel);
    put_mirror(&b, "small", 0.01, 0.9f);
    assert_int_equal(measure(&b)->n_rays, 0); /* a mirror, but only a lamp that has an extent */
    RIG_OK(lum_scene_remove(b.r.scene, LUM_ENTITY_OBJECT, "mirror", &err));
    put_spot(&b, "lamp", 2.0, 0.3, 100.0);
    assert_int_equal(measure(&b)->n_rays, 0); /* the lamp, but no mirror */
    assert_true(b.caustics.report.known);
    assert_true(lum_caustic_share(&b.caustics.report.all) == 0.0);
    put_mirror(&b, "small", 0.01, 0.9f);
    assert_true(measure(&b)->n_rays > 0); /* both, so that the zeros mean something */
    end(&b);
}

static void a_dimmed_lamp_is_no_ray(void **state)
{
    (void)state;
    struct bench b;
    begin(&b, 2);
    rig_object(&b.r, "floor", "wide", "matte", rig_v(0, 0, 0));
    rig_object(&b.r, "ceiling", "wide", "matte", rig_v(0, 3, 0));
    put_mirror(&b, "small", 0.01, 0.9f);
    put_spot(&b, "lamp", 2.0, 0.3, 100.0);
    struct lum_caustic_amount before = measure(&b)->all;
    assert_true(before.focused_lm > 0.0);
    put_spot(&b, "lamp", 2.0, 0.3, 25.0); /* a quarter: exact in floats */
    const struct lum_caustic_report *r = measure(&b);
    assert_int_equal(r->n_rays, 0);
    assert_true(r->all.focused_lm == 0.25 * before.focused_lm && r->all.arriving_lm == 0.25 * before.arriving_lm);
    put_spot(&b, "lamp", 2.0, 0.3, 0.0);
    assert_int_equal(measure(&b)->n_rays, 0);
    assert_true(b.caustics.report.all.arriving_lm == 0.0 && b.caustics.report.n_lights == 0);
    put_spot(&b, "lamp", 2.0, 0.3, 100.0);
    r = measure(&b);
    assert_int_equal(r->n_rays, 0);
    assert_true(r->all.focused_lm == before.focused_lm);
    put_spot(&b, "other", 2.5, 0.3, 100.0); /* never seen before */
    assert_true(measure(&b)->n_rays > 0);
    put_spot(&b, "lamp", 1.9, 0.3, 100.0);
    assert_true(measure(&b)->n_rays > 0);
    rig_object(&b.r, "mirror", "small", "silver", rig_v(0, 0.1, 0));
    assert_true(measure(&b)->n_rays > 0);
    put_mirror(&b, "small", 0.1, 0.5f);
    assert_true(measure(&b)->n_rays > 0);
    end(&b);
}

/* ---- many lamps ---- */

/* Each lamp has its own share, whatever the others have; and the sum is theirs. */
static void lamps_are_told_apart(void **state)
{
    (void)state;
    struct bench b;
    begin(&b, 2);
    rig_object(&b.r, "floor", "wide", "matte", rig_v(0, 0, 0));
    rig_object(&b.r, "ceiling", "wide", "matte", rig_v(0, 3, 0));
    put_mirror(&b, "small", 0.01, 0.9f);
    put_spot(&b, "narrow", 2.0, 0.1, 10.0); /* all of it on the mirror */
    put_spot(&b, "wide", 2.0, 0.6, 10.0);
    struct lum_light_desc aside = {.kind = &lum_light_kind_spot,
                                   .position = rig_v(5, 2, 0),
                                   .direction = rig_v(0, -1, 0),
                                   .inner_cone_rad = 0.3,
                                   .outer_cone_rad = 0.3,
                                   .color = lum_grey(1),
                                   .intensity = 1e5,
                                   .on = true};
    rig_light(&b.r, "aside", &aside);
    const struct lum_caustic_report *r = measure(&b);
    assert_int_equal(r->n_lights, 2);
    double sum = r->lights[0].amount.focused_lm + r->lights[1].amount.focused_lm;
    assert_true(fabs(r->all.focused_lm / sum - 1.0) < 1e-12);
    for (uint32_t i = 0; i < 2; i++) {
        double half = strcmp(r->lights[i].id, "narrow") == 0 ? 0.1 : 0.6, cone = 2.0 * LUM_PI_D * (1.0 - cos(half));
        double want = 0.9 * fmin(square_sr(0.5, 1.99) / cone, 1.0);
        double got = lum_caustic_share(&r->lights[i].amount), error = lum_caustic_share_stderr(&r->lights[i].amount);
        if (!(fabs(got - want) < 4.0 * error && error < 0.03)) /* a sixth of the paths at least: sqrt(.25 / 680) */
            fail_msg("%s: share %.4f +- %.4f, expected %.4f", r->lights[i].id, got, error, want);
    }
    assert_true(r->lights[0].amount.focused_lm >= r->lights[1].amount.focused_lm);
    assert_true(lum_caustic_share(&r->all) < 0.001);
    end(&b);
}

/* More lamps than paths, and more than are told. All of a lamp's light is on the mirror: what it has is the closed
 * form, whether it has a path or not; lamps with one stand for as many as they have chances, and of the sum of a
 * stratified choice among lamps that are alike nothing but the last stratum is left to chance. */
static void a_crowd_of_lamps(void **state)
{
    (void)state;
    struct bench b;
    const uint32_t n = 2 * LUM_CAUSTIC_PATHS + 100;
    begin(&b, 2);
    rig_object(&b.r, "floor", "wide", "matte", rig_v(0, 0, 0));
    rig_object(&b.r, "ceiling", "wide", "matte", rig_v(0, 3, 0));
    put_mirror(&b, "small", 0.01, 0.9f);
    for (uint32_t i = 0; i < n; i++) {
        char id[16];
        snprintf(id, sizeof id, "lamp%u", i);
        put_spot(&b, id, 1.0 + 1e-4 * i, 0.1, 10.0);
    }
    const struct lum_caustic_report *r = measure(&b);
    const double lm = 10.0 * 2.0 * LUM_PI_D * (1.0 - cos(0.1));
    assert_int_equal(r->n_lights, LUM_CAUSTIC_LIGHTS);
    assert_share(r, 0.9, LUM_CAUSTIC_PATHS, "crowd");
    if (!(fabs(r->all.arriving_lm / (n * lm) - 1.0) < 2.0 / LUM_CAUSTIC_PATHS))
        fail_msg("%g lm of %g lm arrive", r->all.arriving_lm, n * lm);
    for (uint32_t i = 0; i < r->n_lights; i++)
        assert_true(fabs(r->lights[i].amount.arriving_lm / lm - 1.0) < 1e-5);
    end(&b);
}

/* ---- against the path tracer ---- */

/* Flux on a square around the y axis, by light that path traces: 576 places, each with its own numbers. */
static double flux_on(struct bench *b, double y, float up, double half)
{
    enum { SIDE = 24, SAMPLES = 4096 };
    double sum = 0.0;
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        double x = half * (2.0 * (i % SIDE + 0.5) / SIDE - 1.0), z = half * (2.0 * (i / SIDE + 0.5) / SIDE - 1.0);
        struct lum_probe probe;
        uint64_t rays;
        RIG_OK(probe_at(b->r.pool, b->r.snapshot, rig_v(x, y, z), lum_v3(0, up, 0), SAMPLES, i, &probe, &rays, &err));
        sum += probe.illuminance_lx;
    }
    return sum * 4.0 * half * half / (SIDE * SIDE);
}

/* Of a lamp with a radius `path` finds the light that it misses of a point, and that is what is told: a ball's light is
 * where it is seen in whole that of a point in its middle. Walls are almost black, so that they pass nothing on.
 * Tolerance: of the mirror's light 4096 rays a place find the lamp 0.0036 times each, in 0.7 of 576 places: 6000 hits,
 * of which four standard deviations are 5 %. */
static void path_finds_it_of_a_lamp_with_a_radius(void **state)
{
    (void)state;
    for (int with_glass = 0; with_glass < 2; with_glass++) {
        struct lum_material_desc black = rig_diffuse(0.01f), m = glass(1.5);
        struct lum_light_desc ball = {.kind = &lum_light_kind_sphere,
                                      .position = rig_v(0, with_glass ? 2.2 : 1, 0),
                                      .radius_m = 0.15,
                                      .color = lum_grey(1),
                                      .on = true};
        double half = with_glass ? 0.6 : 1.5, y = with_glass ? 0.0 : 1.5;
        struct bench b;
        begin(&b, 2);
        rig_material(&b.r, "black", &black);
        if (with_glass) { /* a block that bends what comes at its sides, and casts it on the floor */
            rig_square(&b.r, "floor", half);
            rig_box(&b.r, "block", 0.3, 0.2, 0.3);
            rig_material(&b.r, "glass", &m);
            rig_object(&b.r, "block", "block", "glass", rig_v(0, 0.5, 0));
            rig_object(&b.r, "floor", "floor", "black", rig_v(0, y, 0));
        } else {
            rig_square(&b.r, "ceiling", half);
            rig_object(&b.r, "ceiling", "ceiling", "black", rig_v(0, y, 0));
            put_mirror(&b, "small", 0.0, 0.9f);
        }
        put_spot(&b, "lamp", ball.position.y, with_glass ? 0.3 : 0.65, 100.0); /* all that meets mirror or glass */
        double told = measure(&b)->all.focused_lm, error = b.caustics.report.all.stderr_lm;
        float up = with_glass ? 1.0f : -1.0f;
        rig_bulb(&b.r, "lamp", ball.position, 100.0);
        rig_commit(&b.r);
        double by_point = flux_on(&b, y + (double)up * 1e-3, up, half);
        ball.intensity = 100.0 / (LUM_PI_D * 0.15 * 0.15); /* cd/m2 of a disc as large as it looks: 100 cd */
        rig_light(&b.r, "lamp", &ball);
        rig_commit(&b.r);
        double found = flux_on(&b, y + (double)up * 1e-3, up, half) - by_point;
        if (!(fabs(found - told) < 0.05 * told + 4.0 * error))
            fail_msg("%s: %.3f lm by paths, %.3f +- %.3f lm told", with_glass ? "glass" : "mirror", found, told, error);
        end(&b);
    }
}

/* ---- the same again ---- */

static void threads_do_not_matter(void **state)
{
    (void)state;
    struct lum_caustic_report reports[2];
    for (uint32_t i = 0; i < 2; i++) {
        struct lum_material_desc m = glass(1.5);
        struct bench b;
        begin(&b, i == 0 ? 1 : 3);
        rig_box(&b.r, "block", 0.4, 0.4, 0.4);
        rig_material(&b.r, "glass", &m);
        rig_object(&b.r, "block", "block", "glass", rig_v(0, 1, 0));
        rig_object(&b.r, "floor", "wide", "matte", rig_v(0, 0, 0));
        rig_bulb(&b.r, "lamp", rig_v(0.3, 2, 0.1), 100.0);
        put_spot(&b, "spot", 2.0, 0.3, 50.0);
        reports[i] = *measure(&b);
        end(&b);
    }
    assert_true(reports[0].all.focused_lm > 0.0);
    assert_memory_equal(&reports[0].all, &reports[1].all, sizeof reports[0].all);
    assert_int_equal(reports[0].n_rays, reports[1].n_rays);
    for (uint32_t k = 0; k < 2; k++)
        assert_memory_equal(&reports[0].lights[k].amount, &reports[1].lights[k].amount,
                            sizeof(struct lum_caustic_amount));
}

static void failure_leaves_it_as_it_was(void **state)
{
    (void)state;
    struct bench b;
    begin(&b, 2);
    rig_object(&b.r, "floor", "wide", "matte", rig_v(0, 0, 0));
    rig_object(&b.r, "ceiling", "wide", "matte", rig_v(0, 3, 0));
    put_mirror(&b, "small", 0.01, 0.9f);
    put_spot(&b, "lamp", 2.0, 0.3, 100.0);
    struct lum_caustic_amount before = measure(&b)->all;
    put_spot(&b, "lamp", 1.0, 0.3, 100.0);
    rig_commit(&b.r);
    for (uint64_t k = 1; k <= 3; k++) { /* its three allocations */
        struct lum_error err;
        lum_alloc_fail_after(k);
        enum lum_status status = lum_caustics_update(&b.caustics, b.r.snapshot, b.r.pool, &err);
        lum_alloc_fail_after(0);
        assert_int_equal(status, LUM_ERR_NOMEM);
        assert_memory_equal(&b.caustics.report.all, &before, sizeof before);
    }
    assert_true(measure(&b)->all.focused_lm != before.focused_lm);
    end(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_mirror_under_a_lamp),
        cmocka_unit_test(a_mirror_in_the_sun),
        cmocka_unit_test(a_hall_of_mirrors_has_an_end),
        cmocka_unit_test(a_polished_floor_counts),
        cmocka_unit_test(a_slab_of_glass),
        cmocka_unit_test(panes_do_not_count),
        cmocka_unit_test(nothing_to_find_is_no_ray),
        cmocka_unit_test(a_dimmed_lamp_is_no_ray),
        cmocka_unit_test(lamps_are_told_apart),
        cmocka_unit_test(a_crowd_of_lamps),
        cmocka_unit_test(path_finds_it_of_a_lamp_with_a_radius),
        cmocka_unit_test(threads_do_not_matter),
        cmocka_unit_test(failure_leaves_it_as_it_was),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
