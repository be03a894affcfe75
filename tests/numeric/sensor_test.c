/* What sensors say against closed forms: illuminance of planes and cylinders by a glance and by paths, the stated error
 * of a glance, the position index, UGR of one lamp; and that no thread changes a bit. */
#include "core/measure/position_index.h"
#include "core/measure/sensor.h"
#include "tests/support/rig.h"

#define PI 3.14159265358979323846

static const struct lum_meter_goal one_percent = {0.01, 0.1, 1u << 20};

static struct lum_sensor *sensor_in(const struct rig *r, const struct lum_sensor_desc *d)
{
    struct lum_sensor *s = NULL;
    RIG_OK(lum_sensor_create(d, 4096, &s, &err));
    lum_sensor_aim(s, r->snapshot);
    return s;
}

static struct lum_sensor_result glance(const struct rig *r, struct lum_sensor *s)
{
    struct lum_sensor_result result;
    while (lum_sensor_look(s, r->pool, 7, true))
        continue;
    while (lum_sensor_glance_at_lamps(s, r->pool, 256))
        continue;
    assert_true(lum_sensor_result(s, &result));
    return result;
}

static struct lum_sensor_result settle(const struct rig *r, struct lum_sensor *s, const struct lum_meter_goal *goal)
{
    struct lum_sensor_result result;
    bool more = true;
    while (more)
        RIG_OK(lum_sensor_refine(s, r->pool, goal, 4096, &more, &err));
    assert_true(lum_sensor_result(s, &result));
    return result;
}

/* Four standard errors (one value in 16,000 beyond), and what floats round. */
static void expect(const char *what, const struct lum_amount *is, double want)
{
    if (!(fabs(is->value - want) <= 4.0 * is->stderr_of + 1e-5 * want))
        fail_msg("%s: %g +/- %g, closed form %g", what, is->value, is->stderr_of, want);
}

/* A bulb at (1, 2, 0.5) above the origin, nothing else but a crumb far below. Plane: I cos / r^2; cylinder:
 * I sin e / (pi r^2), e from the axis; half cylinder: times 1 + cos a, a between its direction and the bulb's. */
static void quantities_have_their_closed_form(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_square(&r, "crumb", 0.01);
    rig_diffuse_object(&r, "crumb", "grey", 0.5f, rig_v(0, -20, 0));
    rig_bulb(&r, "bulb", rig_v(1, 2, 0.5), 1000);
    rig_commit(&r);
    double r2 = 1 + 4 + 0.25, flat = hypot(1, 0.5), sin_e = flat / sqrt(r2);
    const struct {
        enum lum_meter_kind quantity;
        double want;
    } cases[] = {
        {LUM_METER_PLANE, 1000 / r2 * 2 / sqrt(r2)},
        {LUM_METER_CYLINDER, 1000 / r2 * sin_e / PI},
        {LUM_METER_HALF_CYLINDER, 1000 / r2 * sin_e * (1 + 1 / flat) / PI}, /* it faces +X: cos a = 1 / flat */
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct lum_sensor *s = sensor_in(
            &r, &(struct lum_sensor_desc){
                    .kind = LUM_SENSOR_POINT, .quantity = cases[i].quantity, .normal = {0, 3, 0}, .facing = {1, 0, 0}});
        struct lum_sensor_result at_once = glance(&r, s), at_rest = settle(&r, s, &one_percent);
        assert_true(at_once.mean.stderr_of == 0.0);
        expect("glance", &at_once.mean, cases[i].want);
        expect("paths", &at_rest.mean, cases[i].want);
        assert_true(at_rest.mean.stderr_of <= 0.01 * cases[i].want);
        lum_sensor_destroy(s);
    }
    rig_end(&r);
}

/* CIE 171, 5.3: 1 x 1 m of 1000 cd/m2 in a ceiling 3 m high, on a wall 2 m from its middle: E by the polygon's closed
 * form. Indirect light: a box that shines with 10 cd/m2 and reflects half of it holds E = pi 20 lx everywhere. */
static void lamps_with_an_area_and_indirect_light(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_square(&r, "crumb", 0.01);
    rig_diffuse_object(&r, "crumb", "grey", 0.0f, rig_v(0, -20, 0));
    struct lum_light_desc lamp = rig_quad(rig_v(0, 3, 0), rig_v(1, 0, 0), rig_v(0, 0, 1), 1000);
    rig_light(&r, "lamp", &lamp);
    rig_commit(&r);
    static const double height[] = {2.25, 1.25, 0.25}, lx[] = {75.19, 69.06, 40.00};
    for (int i = 0; i < 3; i++) {
        struct lum_sensor *s = sensor_in(
            &r, &(struct lum_sensor_desc){.position = {0, height[i], 2}, .normal = {0, 0, -1}, .facing = {1, 0, 0}});
        struct lum_sensor_result at_once = glance(&r, s), at_rest = settle(&r, s, &one_percent);
        at_once.mean.stderr_of += 2e-4 * lx[i]; /* the digits of the table */
        expect("glance at a lamp", &at_once.mean, lx[i]);
        expect("paths at a lamp", &at_rest.mean, lx[i]);
        assert_true(at_once.mean.stderr_of < 0.03 * lx[i]);
        lum_sensor_destroy(s);
    }
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "lamp", &err));
    rig_furnace(&r, 1, 0.5f, 10);
    rig_commit(&r);
    struct lum_sensor *s = sensor_in(
        &r, &(struct lum_sensor_desc){
                .kind = LUM_SENSOR_GRID, .u = {1, 0, 0}, .v = {0, 0, 1}, .normal = {0, 1, 0}, .facing = {1, 0, 0}});
    struct lum_sensor_result at_once = glance(&r, s), at_rest = settle(&r, s, &one_percent);
    assert_int_equal(at_once.n, 25);
    expect("glance in a furnace", &at_once.mean, PI * 20);
    expect("paths in a furnace", &at_rest.mean, PI * 20);
    lum_sensor_destroy(s);
    rig_end(&r);
}

/* A room of 4 x 4 m with a crate under a panel: at 64 places the glances differ from paths known several times better
 * by their stated errors. z^2 has the mean 1 and a standard deviation of sqrt(2) / 8 = 0.18; what is stated errs to the
 * safe side, since samples are stratified: down to a tenth. Above 1.7 errors would be stated too small. */
static void a_glance_knows_its_error(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    rig_room(&r);
    struct lum_light_desc lamp = rig_quad(rig_v(-0.6, 2.9, 0.3), rig_v(0.8, 0, 0), rig_v(0, 0, 0.8), 3000);
    rig_light(&r, "lamp", &lamp);
    rig_commit(&r);
    const struct lum_sensor_desc d = {.kind = LUM_SENSOR_GRID,
                                      .position = {0, 0.2, 0},
                                      .u = {3.8, 0, 0},
                                      .v = {0, 0, 3.8},
                                      .normal = {0, 1, 0},
                                      .facing = {1, 0, 0},
                                      .spacing_m = 0.475};
    struct lum_sensor *s = sensor_in(&r, &d), *reference = sensor_in(&r, &d);
    glance(&r, s);
    assert_false(lum_sensor_look(reference, r.pool, 64, false));
    settle(&r, reference, &(struct lum_meter_goal){0.01, 0.1, 1u << 20});
    double z2 = 0.0, n = 0.0, error = 0.0;
    for (uint32_t i = 0; i < 64; i++) {
        struct lum_meter_reading a = lum_sensor_reading(s, i), b = lum_sensor_reading(reference, i);
        assert_int_equal(a.clearance, b.clearance);
        if (a.clearance != LUM_CLEARANCE_FREE)
            continue;
        double z = (a.lx - b.lx) / hypot(a.stderr_lx, b.stderr_lx);
        z2 += z * z;
        error += a.stderr_lx / a.lx;
        n++;
    }
    if (!(n >= 60 && z2 / n > 0.1 && z2 / n < 1.7 && error / n < 0.15))
        fail_msg("%g places, mean z^2 %g, mean stated error %g", n, z2 / n, error / n);
    lum_sensor_destroy(s);
    lum_sensor_destroy(reference);
    rig_end(&r);
}

/* Two points of the crate's inside are left out whatever else; no thread and no slice changes what is read, and an edit
 * of a lamp keeps what is known of clearance. */
static void threads_change_nothing(void **state)
{
    (void)state;
    double lx[2] = {0};
    for (uint32_t threads = 1; threads <= 2; threads++) {
        struct rig r;
        rig_begin(&r, threads);
        rig_room(&r);
        rig_bulb(&r, "bulb", rig_v(-0.6, 2.5, 0.3), 500);
        rig_commit(&r);
        struct lum_sensor *s = sensor_in(&r, &(struct lum_sensor_desc){.kind = LUM_SENSOR_GRID,
                                                                       .position = {0, 0.75, 0},
                                                                       .u = {3.6, 0, 0},
                                                                       .v = {0, 0, 3.6},
                                                                       .normal = {0, 1, 0},
                                                                       .facing = {1, 0, 0}});
        struct lum_sensor_result at_once = glance(&r, s), at_rest = settle(&r, s, &one_percent);
        assert_true(at_once.n_inside > 0 && at_once.n_inside < 10);
        assert_true(fabs(at_once.mean.value / at_rest.mean.value - 1.0) < 0.05);
        lx[threads - 1] = at_rest.mean.value;
        rig_bulb(&r, "bulb", rig_v(-0.6, 2.5, 0.3), 1000);
        rig_commit(&r);
        lum_sensor_aim(s, r.snapshot);
        assert_int_equal(lum_sensor_reading(s, 0).clearance, LUM_CLEARANCE_FREE);
        assert_true(lum_sensor_reading(s, 0).stderr_lx < 0.0);
        struct lum_sensor_result brighter = glance(&r, s);
        assert_true(fabs(brighter.mean.value / (2.0 * at_once.mean.value) - 1.0) < 1e-5);
        lum_sensor_destroy(s);
        rig_end(&r);
    }
    assert_true(lx[0] == lx[1]);
}

/* What a hand drags changes nobody's clearance but at rest: then the point is inside of the chest that was put there,
 * and free when that is gone. */
static void clearance_is_found_anew_at_rest(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    rig_room(&r);
    rig_bulb(&r, "bulb", rig_v(-0.6, 2.5, 0.3), 500);
    rig_box(&r, "chest", 0.4, 0.4, 0.4);
    rig_object(&r, "chest", "chest", "red", rig_v(1.4, 0.5, 1.4));
    rig_commit(&r);
    struct lum_sensor *s = sensor_in(
        &r, &(struct lum_sensor_desc){
                .kind = LUM_SENSOR_POINT, .position = {-1.4, 0.5, 1.4}, .normal = {0, 1, 0}, .facing = {1, 0, 0}});
    glance(&r, s);
    for (int i = 0; i < 2; i++) {
        enum lum_clearance was = i == 0 ? LUM_CLEARANCE_FREE : LUM_CLEARANCE_INSIDE;
        bool more = true;
        rig_object(&r, "chest", "chest", "red", rig_v(i == 0 ? -1.4 : 1.4, 0.5, 1.4));
        rig_commit(&r);
        lum_sensor_aim(s, r.snapshot);
        assert_false(lum_sensor_look(s, r.pool, 7, true));
        assert_int_equal(lum_sensor_reading(s, 0).clearance, was);
        for (more = true; more;)
            RIG_OK(lum_sensor_refine(s, r.pool, &one_percent, 4096, &more, &err));
        assert_int_equal(lum_sensor_reading(s, 0).clearance, i == 0 ? LUM_CLEARANCE_INSIDE : LUM_CLEARANCE_FREE);
    }
    assert_true(lum_sensor_reading(s, 0).stderr_lx > 0.0);
    lum_sensor_destroy(s);
    rig_end(&r);
}

/* Under a bulb right above, light falls on no cylinder, and beside it on both: two points at 1 m to either side of the
 * foot, 2 m below: I cos / r^2 and I sin / (pi r^2), whose ratio is tan / pi = 0.5 / pi. Points left out have neither.
 */
static void modelling_is_the_ratio_of_means(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_square(&r, "crumb", 0.01);
    rig_diffuse_object(&r, "crumb", "grey", 0.5f, rig_v(0, -20, 0));
    rig_bulb(&r, "bulb", rig_v(0, 2, 0), 1000);
    rig_commit(&r);
    struct lum_sensor *s = sensor_in(&r, &(struct lum_sensor_desc){.kind = LUM_SENSOR_LINE,
                                                                   .modelling = true,
                                                                   .u = {4, 0, 0},
                                                                   .normal = {0, 1, 0},
                                                                   .facing = {1, 0, 0},
                                                                   .spacing_m = 2});
    struct lum_sensor_result none, at_once = glance(&r, s), at_rest = settle(&r, s, &one_percent);
    double r2 = 5, plane = 1000 / r2 * 2 / sqrt(r2), cylinder = 1000 / r2 * 1 / sqrt(r2) / PI;
    assert_int_equal(at_rest.n, 2);
    expect("horizontal", &at_rest.mean, plane);
    expect("cylindrical", &at_rest.cylindrical, cylinder);
    expect("modelling", &at_rest.modelling, 0.5 / PI);
    expect("modelling at a glance", &at_once.modelling, 0.5 / PI);
    assert_true(fabs(lum_sensor_cylindrical(s, 1).lx / cylinder - 1) < 0.05);
    lum_sensor_aim(s, r.snapshot);
    assert_false(lum_sensor_result(s, &none));
    assert_true(isnan(none.modelling.value) && isnan(none.cylindrical.value));
    lum_sensor_destroy(s);
    rig_end(&r);
}

static void expect_points(const struct lum_sensor_desc *d, uint32_t want_u, uint32_t want_v)
{
    uint32_t nu, nv;
    struct lum_sensor *s = NULL;
    RIG_OK(lum_sensor_create(d, 4096, &s, &err));
    lum_sensor_size(s, &nu, &nv);
    lum_sensor_destroy(s);
    if (nu != want_u || nv != want_v)
        fail_msg("%g x %g m: %u x %u points, not %u x %u", d->u.x, d->v.z, nu, nv, want_u, want_v);
}

/* EN 12464-1, table A.1: points along 1, 2, 5, 10 and 100 m. 2.21 m take 6, and 2.1 m as many (as DIALux has it); of
 * 10 x 2 m, and of 8 x 4 m, the shorter side counts. A centimetre has its point, too. */
static void points_lie_by_the_standard(void **state)
{
    (void)state;
    static const double sides[][4] = {{1, 1, 5, 5},     {2, 2, 6, 6},       {5, 5, 8, 8},
                                      {10, 10, 10, 10}, {100, 100, 20, 20}, {2.1, 2.21, 6, 6},
                                      {10, 2, 30, 6},   {8, 4, 16, 8},      {0.01, 0.01, 1, 1}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(sides); i++) {
        const double *at = sides[i];
        struct lum_sensor_desc d = {
            .kind = LUM_SENSOR_GRID, .u = {at[0], 0, 0}, .v = {0, 0, at[1]}, .normal = {0, 1, 0}};
        expect_points(&d, (uint32_t)at[2], (uint32_t)at[3]);
        d.kind = LUM_SENSOR_LINE;
        if (at[0] == at[1])
            expect_points(&d, (uint32_t)at[2], 1);
    }
    struct lum_sensor *s = NULL;
    struct lum_sensor_desc line = {
        .kind = LUM_SENSOR_LINE, .position = {1, 2, 3}, .u = {0, 0, 4}, .normal = {0, 1, 0}, .spacing_m = 1};
    RIG_OK(lum_sensor_create(&line, 4, &s, &err));
    uint32_t nu, nv;
    lum_sensor_size(s, &nu, &nv);
    assert_int_equal(nu, 4);
    assert_int_equal(nv, 1);
    struct lum_vec3d first = lum_sensor_point(s, 0), last = lum_sensor_point(s, 3);
    assert_true(fabs(first.z - 1.5) < 1e-12 && fabs(last.z - 4.5) < 1e-12 && fabs(first.x - 1.0) < 1e-12);
    lum_sensor_destroy(s);
    struct lum_error err = {0};
    assert_int_equal(lum_sensor_check(&line, 3, &err), LUM_ERR_LIMIT);
    assert_string_equal(err.field, "spacing_m");
}

static struct lum_vec3 towards(double aside_deg, double up_deg)
{
    double a = aside_deg * PI / 180, u = up_deg * PI / 180;
    return lum_v3((float)(sin(a) * cos(u)), (float)sin(u), (float)(-cos(a) * cos(u)));
}

/* p = 1 straight ahead, 3.348 at 30 degrees above, 1.468 at 30 degrees aside; below, at 30 degrees, b = 34.0 degrees:
 * exp(6.49e-3 b + 21e-5 b^2) = 1.589; at most 16; nothing behind glares. */
static void position_index(void **state)
{
    (void)state;
    static const struct {
        double aside, up, p;
    } cases[] = {{0, 0, 1.0}, {0, 30, 3.348}, {30, 0, 1.468}, {-30, 0, 1.468}, {0, 85, 16.0}};
    struct lum_vec3 sight = {0, 0, -1}, up = {0, 1, 0};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        double p = lum_position_index(sight, up, towards(cases[i].aside, cases[i].up));
        if (!(fabs(p - cases[i].p) < 6e-4))
            fail_msg("%g aside, %g up: %g, not %g", cases[i].aside, cases[i].up, p, cases[i].p);
    }
    double b = atan(tan(30 * PI / 180) * sqrt(1.3225)) * 180 / PI;
    assert_true(fabs(lum_position_index(sight, up, towards(0, -30)) - exp(6.49e-3 * b + 21e-5 * b * b)) < 1e-5);
    assert_true(isinf(lum_position_index(sight, up, lum_v3(0, 0, 1))));
}

/* A square of 0.4 m and 5000 cd/m2 that faces the eye from 3 m, 20 degrees up, before a sky of 30 cd/m2, which it hides
 * in part. Solid angle of a square of half side a at distance d: 4 atan(a^2 / (d sqrt(2 a^2 + d^2))). */
static void one_lamp_glares_as_the_formula_says(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_square(&r, "crumb", 0.01);
    rig_diffuse_object(&r, "crumb", "grey", 0.0f, rig_v(0, -20, 0));
    const double a = 0.2, d = 3.0, up = 20 * PI / 180, l = 5000, sky = 30;
    struct lum_light_desc lamp = rig_quad(rig_v(0, d * sin(up), -d * cos(up)), rig_v(2 * a, 0, 0),
                                          rig_v(0, 2 * a * cos(up), 2 * a * sin(up)), l);
    struct lum_light_desc env = {
        .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = sky, .on = true};
    struct lum_light_desc bulb = rig_point(rig_v(1, 1, -3), 50);
    rig_light(&r, "lamp", &lamp);
    rig_light(&r, "sky", &env);
    rig_light(&r, "bulb", &bulb);
    rig_commit(&r);
    const struct lum_sensor_desc eye = {.kind = LUM_SENSOR_OBSERVER, .normal = {0, 1, 0}, .facing = {0, 0, -2}};
    struct lum_sensor *s = sensor_in(&r, &eye);
    glance(&r, s);
    struct lum_sensor_result is = settle(&r, s, &(struct lum_meter_goal){0.004, 0.1, 1u << 20});
    double w = 4 * atan(a * a / (d * sqrt(2 * a * a + d * d))),
           p = lum_position_index_ugr(lum_v3(0, 0, -1), lum_v3(0, 1, 0), towards(0, 20));
    double background = sky * (1 - w * cos(up) / PI);
    double want = 8 * log10(0.25 / background * l * l * w / (p * p));
    expect("background", &is.mean, background);
    assert_int_equal(is.glare.n_sources, 1);
    assert_int_equal(is.glare.n_points, 1);
    assert_int_equal(is.glare.n_small + is.glare.n_large, 0);
    if (!(fabs(is.ugr.ugr - want) < 0.02 + 4 * is.ugr.stderr_of) || !(is.ugr.stderr_of < 0.02))
        fail_msg("UGR %g +/- %g, by hand %g", is.ugr.ugr, is.ugr.stderr_of, want);
    lum_sensor_destroy(s);
    rig_end(&r);
}

/* Eyes in a row before that lamp: each place has the UGR of the line of sight that is glared most, and each line the
 * UGR of an observer who looks so. The worst of all is where the lamp is nearest and looked at. */
static void eyes_are_glared_as_observers_are(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    rig_square(&r, "crumb", 0.01);
    rig_diffuse_object(&r, "crumb", "grey", 0.0f, rig_v(0, -20, 0));
    struct lum_light_desc lamp = rig_quad(rig_v(0, 1, -3), rig_v(0.4, 0, 0), rig_v(0, 0.4, 0), 5000);
    struct lum_light_desc env = {
        .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 30, .on = true};
    rig_light(&r, "lamp", &lamp);
    rig_light(&r, "sky", &env);
    rig_commit(&r);
    const struct lum_sensor_desc row = {.kind = LUM_SENSOR_LINE,
                                        .quantity = LUM_METER_EYE,
                                        .n_directions = 4,
                                        .u = {3, 0, 0},
                                        .spacing_m = 1,
                                        .facing = {0, 0, 1}}; /* away, +x, towards, -x */
    struct lum_sensor *s = sensor_in(&r, &row);
    glance(&r, s);
    struct lum_sensor_result all = settle(&r, s, &one_percent);
    assert_int_equal(all.n, 3);
    assert_int_equal(all.n_known, 3);
    for (uint32_t i = 0; i < 3; i++) {
        double worst = -(double)INFINITY;
        for (uint32_t k = 0; k < 4; k++) {
            const struct lum_sensor_desc eye = {.kind = LUM_SENSOR_OBSERVER,
                                                .normal = {0, 1, 0},
                                                .position = lum_sensor_point(s, i),
                                                .facing = lum_sensor_direction(s, k)};
            struct lum_sensor *one = sensor_in(&r, &eye);
            glance(&r, one);
            worst = fmax(worst, settle(&r, one, &one_percent).ugr.ugr);
            lum_sensor_destroy(one);
        }
        struct lum_gaze is = lum_sensor_gaze(s, i);
        assert_true(is.known && is.direction == 2);
        if (!(fabs(is.ugr.ugr - worst) < 0.1 + 4 * is.ugr.stderr_of))
            fail_msg("place %u: UGR %g +/- %g, of observers %g", i, is.ugr.ugr, is.ugr.stderr_of, worst);
    }
    assert_int_equal(all.worst_at, 1);
    assert_int_equal(all.worst_direction, 2);
    assert_int_equal(all.glare.n_sources, 1);
    assert_true(all.ugr.ugr == lum_sensor_gaze(s, 1).ugr.ugr);
    assert_true(isnan(all.mean.value) == 0 && isnan(all.uniformity.value) && isnan(all.dgp.dgp));
    struct lum_sensor *copy;
    RIG_OK(lum_sensor_copy(s, &copy, &err));
    struct lum_sensor_result again;
    assert_true(lum_sensor_result(copy, &again));
    assert_true(again.ugr.ugr == all.ugr.ugr && again.worst_at == all.worst_at);
    lum_sensor_destroy(copy);
    lum_sensor_destroy(s);
    rig_end(&r);
}

/* Nobody has eyes inside a cupboard, and nothing glares where no lamp is. */
static void eyes_have_room(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_box(&r, "cupboard", 0.4, 0.9, 0.4);
    rig_diffuse_object(&r, "cupboard", "grey", 0.5f, rig_v(0, 0, 0));
    rig_square(&r, "crumb", 0.01); /* a body is smaller than the scene */
    rig_diffuse_object(&r, "crumb", "black", 0.0f, rig_v(9, -9, 9));
    struct lum_light_desc env = {
        .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 30, .on = true};
    rig_light(&r, "sky", &env);
    rig_commit(&r);
    const struct lum_sensor_desc row = {.kind = LUM_SENSOR_LINE,
                                        .quantity = LUM_METER_EYE,
                                        .n_directions = 2,
                                        .u = {3, 0, 0},
                                        .spacing_m = 1,
                                        .facing = {0, 0, 1}};
    struct lum_sensor *s = sensor_in(&r, &row);
    glance(&r, s);
    struct lum_sensor_result is = settle(&r, s, &one_percent);
    assert_int_equal(is.n_inside, 1);
    assert_int_equal(is.n_known, 2);
    assert_int_equal(lum_sensor_reading(s, 1).clearance, LUM_CLEARANCE_INSIDE);
    assert_false(lum_sensor_gaze(s, 1).known);
    assert_true(is.ugr.ugr == -(double)INFINITY && is.glare.n_sources == 0);
    lum_sensor_destroy(s);
    struct lum_error err;
    assert_int_equal(lum_sensor_check(&row, 6, &err), LUM_OK);
    assert_int_equal(lum_sensor_check(&row, 5, &err), LUM_ERR_LIMIT); /* two lines of sight each */
    rig_end(&r);
}

/* A chest that is put over eyes, and away again: what they see is told once it is of the room as it is, and never of
 * where they could not be. */
static void eyes_know_where_they_were(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_room(&r);
    rig_box(&r, "chest", 0.4, 0.4, 0.4);
    rig_object(&r, "chest", "chest", "red", rig_v(-1.4, 0.5, 1.4));
    struct lum_light_desc lamp = rig_quad(rig_v(0, 2, -1), rig_v(0.4, 0, 0), rig_v(0, 0.4, 0), 5000);
    rig_light(&r, "lamp", &lamp);
    rig_commit(&r);
    struct lum_sensor *s = sensor_in(&r, &(struct lum_sensor_desc){.kind = LUM_SENSOR_POINT,
                                                                   .quantity = LUM_METER_EYE,
                                                                   .n_directions = 1,
                                                                   .position = {-1.4, 0.5, 1.4},
                                                                   .facing = {1, 0, -1}});
    struct lum_sensor_result is;
    bool more = true;
    assert_false(lum_sensor_look(s, r.pool, 7, true));
    assert_int_equal(lum_sensor_reading(s, 0).clearance, LUM_CLEARANCE_INSIDE);
    rig_object(&r, "chest", "chest", "red", rig_v(1.4, 0.5, 1.4));
    rig_commit(&r);
    lum_sensor_aim(s, r.snapshot);
    assert_false(lum_sensor_look(s, r.pool, 7, true));
    assert_false(lum_sensor_glance_at_lamps(s, r.pool, 256));
    for (int slices = 0; more; slices++) {
        RIG_OK(lum_sensor_refine(s, r.pool, &one_percent, 4096, &more, &err));
        struct lum_gaze gaze = lum_sensor_gaze(s, 0);
        assert_true(gaze.known ? isfinite(gaze.ugr.ugr) : isnan(gaze.ugr.ugr));
        assert_true(slices > 0 || lum_sensor_reading(s, 0).clearance == LUM_CLEARANCE_FREE);
    }
    assert_true(lum_sensor_result(s, &is) && isfinite(is.ugr.ugr));
    lum_sensor_destroy(s);
    rig_end(&r);
}

/* However many lamps there are, a slice of looking at them is as long as was asked for, or one eye's for each worker,
 * and says how long it was: at a glance, and closely. */
static void looks_at_many_lamps_are_short(void **state)
{
    (void)state;
    enum { LAMPS = 600, EYES = 400, LOOK = LAMPS * 16 / 8 /* samples, at most, of one */ };
    struct rig r;
    rig_begin(&r, 2);
    rig_square(&r, "crumb", 0.01);
    rig_diffuse_object(&r, "crumb", "grey", 0.5f, rig_v(0, -20, 0));
    for (int i = 0; i < LAMPS; i++) {
        char id[16];
        struct lum_light_desc lamp = rig_quad(rig_v(i % 30, 3, i / 30), rig_v(0.1, 0, 0), rig_v(0, 0, 0.1), 100);
        snprintf(id, sizeof id, "lamp%d", i);
        rig_light(&r, id, &lamp);
    }
    rig_commit(&r);
    struct lum_sensor *s = sensor_in(&r, &(struct lum_sensor_desc){.kind = LUM_SENSOR_LINE,
                                                                   .quantity = LUM_METER_EYE,
                                                                   .n_directions = 1,
                                                                   .u = {10, 0, 0},
                                                                   .spacing_m = 10.0 / EYES,
                                                                   .facing = {0, 0, 1}});
    while (lum_sensor_look(s, r.pool, EYES, true))
        continue;
    assert_int_equal(lum_sensor_samples(s), 0);
    for (bool more = true; more;) {
        uint64_t before = lum_sensor_samples(s);
        more = lum_sensor_glance_at_lamps(s, r.pool, 256);
        uint64_t done = lum_sensor_samples(s) - before;
        assert_true(done > 0 && done <= 2 * LOOK);
    }
    const struct lum_meter_goal loose = {0.5, 0.1, 4096};
    for (bool more = true; more;) {
        uint64_t before = lum_sensor_samples(s);
        RIG_OK(lum_sensor_refine(s, r.pool, &loose, 65536, &more, &err));
        uint64_t done = lum_sensor_samples(s) - before;
        assert_true(done > 0 || !more || before == 0);
        assert_true(done <= 65536 + 2 * LOOK);
    }
    lum_sensor_destroy(s);
    rig_end(&r);
}

/* Ahead (+z) there is nothing but a lamp: UGR has no bound. Behind, where a lamp lights a floor, it has: that is what
 * is told, with the number of points that are dark elsewhere. */
static void darkness_hides_no_glare(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_square(&r, "floor", 1);
    rig_diffuse_object(&r, "floor", "grey", 0.5f, rig_v(0, -1, -2));
    struct lum_light_desc behind = rig_quad(rig_v(0, 1, -3), rig_v(0.4, 0, 0), rig_v(0, 0.4, 0), 5000),
                          ahead = rig_quad(rig_v(0, 1, 3), rig_v(-0.4, 0, 0), rig_v(0, 0.4, 0), 5000);
    rig_light(&r, "behind", &behind);
    rig_light(&r, "ahead", &ahead);
    rig_commit(&r);
    struct lum_sensor_desc d = {.kind = LUM_SENSOR_POINT, .quantity = LUM_METER_EYE, .facing = {0, 0, 1}};
    for (d.n_directions = 1; d.n_directions <= 2; d.n_directions++) {
        struct lum_sensor *s = sensor_in(&r, &d);
        glance(&r, s);
        struct lum_sensor_result is = settle(&r, s, &one_percent);
        assert_int_equal(is.n_dark, 1);
        assert_int_equal(is.worst_direction, d.n_directions - 1);
        assert_true(d.n_directions == 1 ? is.ugr.ugr == (double)INFINITY : isfinite(is.ugr.ugr));
        lum_sensor_destroy(s);
    }
    rig_end(&r);
}

/* Fog that absorbs, in a box of 2 m whose one side the eye looks at from 1 m, dims the sky of the background as it dims
 * that of a plane that is held there: by a glance and by paths. */
static void fog_dims_the_background(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_square(&r, "crumb", 0.01);
    rig_diffuse_object(&r, "crumb", "grey", 0.0f, rig_v(0, -20, 0));
    struct lum_light_desc env = {
        .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 100, .on = true};
    rig_light(&r, "sky", &env);
    const struct lum_medium_desc fog = {.sigma_a = lum_grey(1), .lo = {-1, -1, -1}, .hi = {1, 1, 1}};
    RIG_OK(lum_scene_put_medium(r.scene, "fog", &fog, &err));
    rig_commit(&r);
    struct lum_sensor *s = sensor_in(&r, &(struct lum_sensor_desc){.normal = {0, 0, -1}, .facing = {1, 0, 0}});
    glance(&r, s);
    struct lum_sensor_result plane = settle(&r, s, &one_percent);
    lum_sensor_destroy(s);
    s = sensor_in(&r,
                  &(struct lum_sensor_desc){.kind = LUM_SENSOR_OBSERVER, .normal = {0, 1, 0}, .facing = {0, 0, -1}});
    struct lum_sensor_result at_once = glance(&r, s), at_rest = settle(&r, s, &one_percent);
    at_once.mean.stderr_of += plane.mean.stderr_of / PI;
    at_rest.mean.stderr_of += plane.mean.stderr_of / PI;
    expect("glance in fog", &at_once.mean, plane.mean.value / PI);
    expect("paths in fog", &at_rest.mean, plane.mean.value / PI);
    lum_sensor_destroy(s);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quantities_have_their_closed_form),
        cmocka_unit_test(lamps_with_an_area_and_indirect_light),
        cmocka_unit_test(a_glance_knows_its_error),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(clearance_is_found_anew_at_rest),
        cmocka_unit_test(modelling_is_the_ratio_of_means),
        cmocka_unit_test(points_lie_by_the_standard),
        cmocka_unit_test(position_index),
        cmocka_unit_test(one_lamp_glares_as_the_formula_says),
        cmocka_unit_test(eyes_are_glared_as_observers_are),
        cmocka_unit_test(eyes_have_room),
        cmocka_unit_test(eyes_know_where_they_were),
        cmocka_unit_test(looks_at_many_lamps_are_short),
        cmocka_unit_test(darkness_hides_no_glare),
        cmocka_unit_test(fog_dims_the_background),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
