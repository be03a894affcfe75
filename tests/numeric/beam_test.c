/* Light that mirrors and glass send on to surfaces (vpl/trace.c, leave_beam). */
#include "tests/support/effort.h"
#include "tests/support/lit_room.h"
#include "tests/support/vpls.h"

static struct lum_material_desc mirror(void)
{
    struct lum_material_desc m = rig_diffuse(1.0f);
    m.roughness = 0.0f;
    m.metallic = 1.0f;
    return m;
}

static struct lum_material_desc glass(float roughness, bool thin)
{
    struct lum_material_desc m = lum_material_default();
    m.roughness = roughness;
    m.transmission = 1.0f;
    m.thin = thin;
    return m;
}

/* Everything shines with LE and reflects RHO, but for a slab before a wall, which is a mirror, or glass: the light is
 * LE / (1 - RHO) everywhere, whatever way it takes. The wall gets most of it by way of the slab; without that the
 * mirror left it .73 of its light. */
#define LE 0.5
#define RHO 0.5

static double wall_by_a_slab(const struct lum_material_desc *slab, uint32_t seed)
{
    struct rig r;
    rig_begin(&r, 0);
    rig_furnace(&r, 1, (float)RHO, LE);
    rig_material(&r, "slab", slab);
    rig_box(&r, "slab", 0.7, 0.7, 0.1);
    rig_object(&r, "slab", "slab", "slab", rig_v(0, 0, -0.2));
    rig_camera(&r, rig_v(0, 0, -0.32), rig_v(0, 0, -1), 40);
    rig_commit(&r);
    use_method(&r, "live");
    r.settings.w = r.settings.h = 24;
    r.settings.seed = seed;
    r.settings.max_spp = 1;
    while (!rig_pass(&r).complete)
        continue;
    double mean = (double)rig_mean(&r).g;
    rig_end(&r);
    return mean;
}

static void a_slab_in_a_furnace(void **state)
{
    (void)state;
    enum { SEEDS = TEST_EFFORT(24) };
    const struct {
        const char *what;
        struct lum_material_desc material;
    } slabs[] = {{"mirror", mirror()},
                 {"glass", glass(0.0f, false)},
                 {"rough glass", glass(0.3f, false)},
                 {"clear panes", glass(0.0f, true)},
                 {"rough panes", glass(0.3f, true)}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(slabs); k++) {
        double want = LE / (1.0 - RHO), sum = 0.0, square = 0.0;
        for (uint32_t seed = 0; seed < SEEDS; seed++) {
            double got = wall_by_a_slab(&slabs[k].material, seed) / want;
            sum += got;
            square += got * got;
        }
        double mean = sum / SEEDS, error = sqrt(fmax(square / SEEDS - mean * mean, 0.0) / (SEEDS - 1));
        print_message("wall by a slab of %s: %.4f +- %.4f of its light\n", slabs[k].what, mean, error);
        /* 4 standard errors; 4 % for lobes that are wider than mirrors, and lifts (vpl_sum.h) */
        assert_true(!TEST_TELLS || (fabs(mean - 1.0) <= 4.0 * error + 0.04 && error < 0.015));
    }
}

/* In a room of mirrors all light of a lamp with a radius is sent on; of a point none is that a path of `path` finds. */
static void a_lamp_among_mirrors(void **state)
{
    (void)state;
    for (int point = 0; point < 2; point++) {
        struct rig r;
        rig_begin(&r, 1);
        struct lum_material_desc m = mirror();
        rig_material(&r, "mirror", &m);
        rig_box(&r, "room", 1, 1, 1);
        rig_object(&r, "room", "room", "mirror", rig_v(0, 0, 0));
        struct lum_light_desc ball = {.kind = &lum_light_kind_sphere,
                                      .position = rig_v(0.1, 0.2, 0.3),
                                      .radius_m = 0.1,
                                      .color = lum_grey(1),
                                      .intensity = 100,
                                      .on = true};
        if (point)
            rig_bulb(&r, "lamp", ball.position, 100);
        else
            rig_light(&r, "lamp", &ball);
        rig_commit(&r);
        struct vpls v = {.n = 1024, .max_bounces = 1, .gloss = true};
        vpls_update(&v, &r);
        double flux = 0.0;
        for (uint32_t i = 0; i < v.n; i++)
            flux += (double)v.set.flux[1][i];
        /* pi L times the ball's surface, in scene units, whose powers are in candela */
        double scale = r.snapshot->norm.scale, all = 100.0 * LUM_PI_D * 4.0 * LUM_PI_D * 0.01 * scale * scale;
        double want = point ? 0.0 : all;
        if (!(fabs(flux - want) <= 1e-4 * all))
            fail_msg("%s: flux %g, expected %g", point ? "point" : "ball", flux, want);
        lum_vpl_finish(&v.set);
        rig_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_slab_in_a_furnace),
        cmocka_unit_test(a_lamp_among_mirrors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
