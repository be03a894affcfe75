/* Virtual point lights in fog: what it scatters to surfaces is in the first frame of `live`. A cloud between a bulb and
 * a grey floor, seen from below the cloud, so that all light of the picture comes from the floor; path is right.
 *
 * Means over seeds, to four standard errors of both and 3 %, which is what a first frame may be off by. */
#include "tests/numeric/fog.h"
#include "tests/support/effort.h"
#include "tests/support/vpls.h"

#define SEEDS TEST_EFFORT(16)
#define PATH_PASSES TEST_EFFORT(256)

struct estimate {
    double mean, stderr;
};

static struct estimate estimate_of(double sum, double square, uint32_t n)
{
    double mean = sum / n;
    return (struct estimate){mean, sqrt(fmax(0.0, square / n - mean * mean) / (n - 1))};
}

/* A bulb, or the sun. */
static void begin_cloud(struct rig *r, float sigma_s, float g, bool sun)
{
    rig_begin(r, 0);
    rig_box(r, "floor", 6, 0.5, 6);
    rig_diffuse_object(r, "floor", "grey", 0.5f, rig_v(0, -0.5, 0));
    /* Black: a shell, whatever is in it lights something, and is chosen (vpl/choose.c). The sun would not come in: a
     * pole, light from afar enters by the box around all objects. */
    const char *id = sun ? "pole" : "shell";
    rig_box(r, id, sun ? 0.01 : 8, 8, sun ? 0.01 : 8);
    rig_diffuse_object(r, id, "black", 0.0f, rig_v(sun ? 5.5 : 0, 0, sun ? 5.5 : 0));
    struct lum_medium_desc cloud = fog_box(sigma_s, 0.05f, rig_v(-2, 1, -2), rig_v(2, 2, 2));
    cloud.g = g;
    struct lum_light_desc bulb = rig_point(rig_v(0.3, 3, 0.2), 1000);
    put_fog(r, "cloud", &cloud);
    struct lum_light_desc sunlight = {.kind = &lum_light_kind_directional,
                                      .direction = {0.6, -0.8, 0},
                                      .color = lum_grey(1),
                                      .intensity = 100,
                                      .on = true};
    rig_light(r, "bulb", sun ? &sunlight : &bulb);
    rig_commit(r);
    rig_camera(r, rig_v(0, 0.9, 0.01), rig_v(0, 0, 0), 1);
    r->settings.antialias = false;
    r->settings.w = r->settings.h = 4;
}

/* Irradiance of the middle of the floor by bounced light, lx. */
static struct estimate by_vpls(const struct rig *r, uint32_t tries)
{
    struct vpls v = {
        .n = TEST_EFFORT(16384), .max_bounces = 63, .media = true, .scatters = true, .gloss = true, .tries = tries};
    struct lum_gather_points pts = {0};
    vpls_add_point(&pts, rig_to_scene(r, 0, 0, 0), lum_v3(0, 1, 0));
    double sum = 0.0, square = 0.0;
    for (v.seed = 0; v.seed < SEEDS; v.seed++) {
        struct lum_rgb e;
        vpls_update(&v, r);
        vpls_gather(r, &v.set, no_bound, &pts, &e);
        sum += (double)e.g;
        square += (double)e.g * (double)e.g;
    }
    lum_vpl_finish(&v.set);
    return estimate_of(sum, square, SEEDS);
}

/* Likewise, of all light. */
static struct estimate by_paths(struct rig *r)
{
    double before = 0.0, sum = 0.0, square = 0.0;
    r->settings.method = lum_method_find("path");
    r->settings.max_spp = PATH_PASSES;
    for (uint32_t i = 1; i <= PATH_PASSES; i++) {
        rig_pass(r);
        double total = (double)rig_mean(r).g * i * PI / 0.5, pass = total - before;
        before = total;
        sum += pass;
        square += pass * pass;
    }
    return estimate_of(sum, square, PATH_PASSES);
}

/* Of a lamp that is sharp: no noise in it. */
static double direct(float sigma_s, bool sun)
{
    if (sun)
        return 100.0 * 0.8 * exp(-((double)sigma_s + 0.05) / 0.8);
    const struct lum_vec3d at = {0.3, 3, 0.2};
    double d2 = at.x * at.x + at.y * at.y + at.z * at.z, d = sqrt(d2), in_cloud = d / at.y; /* it is a metre thick */
    return 1000.0 * at.y / (d2 * d) * exp(-((double)sigma_s + 0.05) * in_cloud);
}

static void floor_below_a_cloud(void **state)
{
    (void)state;
    const struct {
        float sigma_s, g;
        uint32_t tries;
        bool sun; /* without the shell, and without a choice of tries, which needs it */
    } cases[] = {{0.1f, 0.0f, 8, false},
                 {0.5f, 0.0f, 0, false},
                 {2.0f, 0.0f, 8, false},
                 {1.0f, -0.4f, 8, false},
                 {1.0f, 0.3f, 0, true}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++) {
        struct rig r;
        begin_cloud(&r, cases[i].sigma_s, cases[i].g, cases[i].sun);
        struct estimate vpls = by_vpls(&r, cases[i].tries), path = by_paths(&r);
        double want = path.mean - direct(cases[i].sigma_s, cases[i].sun), error = hypot(vpls.stderr, path.stderr);
        print_message("sigma_s %g, g %g: %.2f +- %.2f lx, by paths %.2f +- %.2f\n", (double)cases[i].sigma_s,
                      (double)cases[i].g, vpls.mean, vpls.stderr, want, path.stderr);
        if (TEST_TELLS && !(fabs(vpls.mean - want) <= 4.0 * error))
            fail_msg("%.3f lx, by paths %.3f, standard error %.3f", vpls.mean, want, error);
        assert_true(!TEST_TELLS || error < 0.05 * want); /* or it says nothing */
        rig_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(floor_below_a_cloud),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
