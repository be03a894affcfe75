/* Virtual point lights against closed forms and against path tracing. */
#include "core/scene/light_kind.h"
#include "core/scene/shapes.h"
#include "tests/numeric/stats.h"
#include "tests/support/probe_at.h"
#include "tests/support/vpls.h"
#include "tests/support/webs.h"
#include "server/world/light_kinds.h"

/* Green flux of slots first .. first + n - 1. */
static double flux_of_slots(const struct vpls *v, uint32_t first, uint32_t n)
{
    double sum = 0.0;
    for (uint32_t i = first; i < first + n; i++)
        sum += (double)v->set.flux[1][i];
    return sum;
}

/* ---- flux ---- */

/* A closed box with albedo rho and a light inside: bounce k's VPLs carry Phi rho^k, exactly: nothing escapes. */
static void flux_falls_by_albedo(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    rig_box(&r, "box", 1, 1.5, 2);
    rig_diffuse_object(&r, "box", "wall", 0.5f, rig_v(0, 0, 0));
    rig_bulb(&r, "bulb", rig_v(0.3, 0.2, 0.1), 100);
    rig_commit(&r);
    const uint32_t ns[] = {16, 17, 255, 256, 65536};
    for (size_t i = 0; i < LUM_ARRAY_LEN(ns); i++) {
        struct vpls v = {.n = ns[i], .max_bounces = 5}; /* as many as there are levels */
        vpls_update(&v, &r);
        double phi = 400.0 * LUM_PI_D * r.snapshot->norm.scale * r.snapshot->norm.scale;
        uint32_t first = 0, n_bounces = 0;
        for (uint32_t n; first < ns[i]; first += n, n_bounces++) {
            n = n_bounces == 4 ? ns[i] - first : (ns[i] - first + 1) / 2;
            double got = flux_of_slots(&v, first, n), want = phi * pow(0.5, n_bounces + 1.0);
            if (!(fabs(got / want - 1.0) < 1e-5)) /* 2^-24 for each product of the path and of the weight */
                fail_msg("%u slots, bounce %u: %g, expected %g", ns[i], n_bounces + 1, got, want);
        }
        assert_int_equal(v.set.n_lit, ns[i]);
        assert_int_equal(v.set.n_moved, ns[i]);
        /* a path takes a segment for each of its bounces, and a slot is one bounce of one path */
        assert_int_equal(v.counters.rays[LUM_RAY_VPL], ns[i]);
        /* The area of the box, shared out. Low discrepancy puts neighbours further away than chance does, and near
         * edges there are fewer: a quarter covers both (measured 14 %). */
        double radius = sqrt(52.0 / (LUM_PI_D * ns[i])) * r.snapshot->norm.scale;
        if (ns[i] >= 256 && !(fabs((double)v.set.spacing / radius - 1.0) < 0.25))
            fail_msg("%u slots: spacing %g, expected %g", ns[i], (double)v.set.spacing, radius);
        lum_vpl_finish(&v.set);
    }
    for (uint32_t n = 1; n <= 16; n++) { /* fewer bounces: the last level takes all that is left */
        struct vpls v = {.n = n, .max_bounces = 1};
        vpls_update(&v, &r);
        assert_int_equal(v.set.n_lit, n);
        assert_int_equal(v.counters.rays[LUM_RAY_VPL], n);
        lum_vpl_finish(&v.set);
    }
    struct vpls v = {.n = 0, .max_bounces = 1};
    struct lum_vpl_request rq = vpls_request(&v, &r);
    assert_int_equal(lum_vpl_update(&v.set, &rq, NULL), LUM_ERR_LIMIT);
    rq.n = LUM_VPL_MAX + 1;
    assert_int_equal(lum_vpl_update(&v.set, &rq, NULL), LUM_ERR_LIMIT);
    rq.n = 4, rq.max_bounces = 0;
    assert_int_equal(lum_vpl_update(&v.set, &rq, NULL), LUM_OK);
    assert_int_equal(v.set.n_lit, 0);
    lum_vpl_finish(&v.set);
    rig_end(&r);
}

/* Beyond the levels nothing is cut off: the last one carries the sum of all further bounces, in the mean over seeds. */
static void no_bounce_is_left_out(void **state)
{
    (void)state;
    const double albedos[] = {0.5, 0.9};
    const uint32_t ns[] = {1, 2, 5, 16, 256};
    const uint32_t n_bounces = LUM_DEPTH_DEFAULT - 1;
    for (size_t k = 0; k < 2; k++) {
        struct rig r;
        rig_begin(&r, 1);
        rig_box(&r, "box", 1, 1.5, 2);
        rig_diffuse_object(&r, "box", "wall", (float)albedos[k], rig_v(0, 0, 0));
        rig_bulb(&r, "bulb", rig_v(0.3, 0.2, 0.1), 100);
        rig_commit(&r);
        double phi = 400.0 * LUM_PI_D * r.snapshot->norm.scale * r.snapshot->norm.scale;
        double want = albedos[k] * (1.0 - pow(albedos[k], n_bounces)) / (1.0 - albedos[k]);
        for (size_t i = 0; i < LUM_ARRAY_LEN(ns); i++) {
            struct mean mean = {0};
            for (uint32_t seed = 0; seed < 256; seed++) {
                struct vpls v = {.n = ns[i], .max_bounces = n_bounces, .seed = seed};
                vpls_update(&v, &r);
                mean_add(&mean, flux_of_slots(&v, 0, v.n) / phi);
                assert_int_equal(v.set.n_lit, ns[i]);
                lum_vpl_finish(&v.set);
            }
            print_message("albedo %g, %u slots: %.4f +- %.4f, expected %.4f\n", albedos[k], ns[i], mean.mean,
                          mean_stderr(&mean), want);
            if (!(fabs(mean.mean - want) < 4.0 * mean_stderr(&mean) + 1e-5 * want))
                fail_msg("albedo %g, %u slots: %g +- %g, expected %g", albedos[k], ns[i], mean.mean, mean_stderr(&mean),
                         want);
        }
        rig_end(&r);
    }
}

/* A perfect mirror and clear glass in the box take no flux and have no VPL: the first bounces still carry Phi rho, but
 * for paths that are caught inside for more segments than are followed. */
static void mirrors_and_glass_keep_the_flux(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_box(&r, "box", 1, 1, 1);
    rig_diffuse_object(&r, "box", "wall", 0.5f, rig_v(0, 0, 0));
    struct lum_material_desc mirror = rig_diffuse(1.0f), glass = lum_material_default();
    mirror.metallic = 1.0f, mirror.roughness = 0.0f;
    glass.transmission = 1.0f, glass.roughness = 0.0f;
    rig_material(&r, "mirror", &mirror);
    rig_material(&r, "glass", &glass);
    rig_box(&r, "cube", 0.3, 0.2, 0.25);
    rig_object(&r, "m", "cube", "mirror", rig_v(-0.5, -0.3, 0.1));
    rig_object(&r, "g", "cube", "glass", rig_v(0.5, 0.4, -0.2));
    rig_bulb(&r, "bulb", rig_v(0.1, 0.2, 0.5), 100);
    rig_commit(&r);
    struct vpls v = {.n = 4096, .max_bounces = 1};
    vpls_update(&v, &r);
    double phi = 400.0 * LUM_PI_D * r.snapshot->norm.scale * r.snapshot->norm.scale;
    double got = flux_of_slots(&v, 0, v.n) / (0.5 * phi);
    /* Without eta^2 left out a pass through the glass would be off by 2.25. Caught: total reflection in a box can go on
     * for ever for light that entered by another face; such light leaks 4 % per face met, and about a quarter of the
     * paths meet the cube. */
    if (!(got <= 1.0 + 1e-5 && got > 0.97))
        fail_msg("flux %g of what was sent", got);
    for (uint32_t i = 0; i < v.n; i++)
        if (v.set.light[i] != LUM_NO_OBJECT)
            assert_string_equal(r.snapshot->instances[v.set.object[i]].id, "box");
    assert_true(v.counters.rays[LUM_RAY_VPL] > v.n);
    print_message("%.4f of the flux is kept\n", got);
    lum_vpl_finish(&v.set);
    rig_end(&r);
}

/* Many lights: each gets paths by its flux, and none is lost. */
static void lights_share_the_paths(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_box(&r, "box", 1, 1, 1);
    rig_diffuse_object(&r, "box", "wall", 0.5f, rig_v(0, 0, 0));
    enum { n_lights = 40 };
    double total = 0.0;
    for (int i = 0; i < n_lights; i++) {
        char id[8];
        snprintf(id, sizeof id, "l%02d", i);
        struct lum_light_desc l = rig_point(rig_v(-0.9 + 0.04 * i, 0.5, 0.02 * i), i % 10 ? 10 : 1000);
        l.on = i != 7;
        rig_light(&r, id, &l);
        total += i == 7 ? 0.0 : i % 10 ? 10.0 : 1000.0;
    }
    rig_commit(&r);
    double scale2 = r.snapshot->norm.scale * r.snapshot->norm.scale;
    struct vpls v = {.n = 256, .max_bounces = 1};
    vpls_update(&v, &r);
    double flux[n_lights] = {0};
    uint32_t n[n_lights] = {0};
    for (uint32_t i = 0; i < v.n; i++)
        flux[v.set.light[i]] += (double)v.set.flux[1][i], n[v.set.light[i]]++;
    for (int i = 0; i < n_lights; i++) {
        double want = 0.5 * 4.0 * LUM_PI_D * scale2 * (i == 7 ? 0.0 : i % 10 ? 10.0 : 1000.0);
        double part = 0.5 * (i % 10 ? 10.0 : 1000.0) / total + 0.5 / (n_lights - 1);
        assert_true(fabs(flux[i] - want) <= 1e-5 * want);
        assert_true(i == 7 ? n[i] == 0 : fabs(n[i] - part * v.n) < 1.0);
    }
    lum_vpl_finish(&v.set);
    /* too few slots for all: right in the mean over seeds. 16 slots, 39 lights: a slot carries up to 39/16 * 2 of a
     * light */
    struct mean mean = {0};
    for (uint32_t seed = 0; seed < 256; seed++) {
        struct vpls few = {.n = 16, .max_bounces = 1, .seed = seed};
        vpls_update(&few, &r);
        mean_add(&mean, flux_of_slots(&few, 0, 16) / (0.5 * 4.0 * LUM_PI_D * scale2 * total));
        lum_vpl_finish(&few.set);
    }
    if (!(fabs(mean.mean - 1.0) < 4.0 * mean_stderr(&mean)))
        fail_msg("mean flux of 16 slots: %g +- %g", mean.mean, mean_stderr(&mean));
    rig_end(&r);
}

/* ---- form factors ---- */

/* The unit square y = 0 lit by the unit square y = 1: what arrives is the form factor of opposite faces of a cube. And
 * on to a wall: adjacent and opposite faces again, by the VPLs on it. */
static void form_factors_of_a_cube(void **state)
{
    (void)state;
    const double opposite = 0.1998249, adjacent = 0.2000438;
    struct rig r;
    rig_begin(&r, 0);
    rig_square(&r, "floor", 0.5);
    rig_diffuse_object(&r, "floor", "white", 1.0f, rig_v(0, 0, 0));
    struct lum_light_desc lamp = rig_quad(rig_v(0, 1, 0), rig_v(1, 0, 0), rig_v(0, 0, 1), 100);
    rig_light(&r, "lamp", &lamp);
    rig_commit(&r);
    struct mean arrived = {0}, to_top = {0}, to_wall = {0};
    double scale2 = r.snapshot->norm.scale * r.snapshot->norm.scale, phi = 100.0 * LUM_PI_D * scale2;
    for (uint32_t seed = 0; seed < 16; seed++) {
        struct vpls v = {.n = 16384, .max_bounces = 1, .seed = seed};
        vpls_update(&v, &r);
        mean_add(&arrived, flux_of_slots(&v, 0, v.n) / phi);
        lum_vpl_finish(&v.set);
    }
    /* The sun straight above lights the floor evenly. The room around it need not be there to be lit. */
    struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                 .direction = {0, -1, 0},
                                 .color = lum_grey(1),
                                 .intensity = 100,
                                 .on = true};
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "lamp", &err)); /* its shape would keep the sun off */
    rig_light(&r, "sun", &sun);
    rig_commit(&r);
    struct rng random = {1};
    for (uint32_t seed = 0; seed < 16; seed++) {
        struct vpls v = {.n = 4096, .max_bounces = 1, .seed = seed};
        vpls_update(&v, &r);
        struct lum_gather_points top = {0}, wall = {0};
        for (int i = 0; i < 256; i++) { /* jittered on a grid of 16 x 16 */
            double a = (i % 16 + rng_unit(&random)) / 16, b = (i / 16 + rng_unit(&random)) / 16;
            vpls_add_point(&top, rig_to_scene(&r, a - 0.5, 1, b - 0.5), lum_v3(0, -1, 0));
            vpls_add_point(&wall, rig_to_scene(&r, 0.5, a, b - 0.5), lum_v3(-1, 0, 0));
        }
        struct lum_rgb e[LUM_RAY_BATCH];
        const struct {
            struct lum_gather_points *points;
            struct mean *mean;
        } cases[] = {{&top, &to_top}, {&wall, &to_wall}};
        for (int k = 0; k < 2; k++) {
            vpls_gather(&r, &v.set, no_bound, cases[k].points, e);
            double sum = 0.0;
            for (int i = 0; i < 256; i++)
                sum += (double)e[i].g / 256.0;
            mean_add(cases[k].mean, sum / 100.0);
        }
        lum_vpl_finish(&v.set);
    }
    const struct {
        const char *what;
        struct mean *mean;
        double want;
    } results[] = {{"lamp to floor", &arrived, opposite},
                   {"floor to top", &to_top, opposite},
                   {"floor to wall", &to_wall, adjacent}};
    for (int k = 0; k < 3; k++) {
        double got = results[k].mean->mean, err = mean_stderr(results[k].mean), want = results[k].want;
        print_message("%s: %.6f +- %.6f, closed form %.6f\n", results[k].what, got, err, want);
        /* four standard errors of 16 seeds; and the margin of the box that the sun is shot from, 2^-12 of some 10 units
         */
        if (!(fabs(got - want) < 4.0 * err + 1e-4 * want) || !(err < 0.01 * want))
            fail_msg("%s: %g +- %g, closed form %g", results[k].what, got, err, want);
    }
    rig_end(&r);
}

/* In a sphere E = F / (4 pi R^2) from each VPL to each point. */
static void sphere_is_lit_evenly(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    struct lum_shape_mesh shape;
    struct lum_shape_params params = {.size = {2, 2, 2}, .segments = {128, 64}};
    RIG_OK(lum_shape_make("sphere", &params, &shape, &err));
    struct lum_mesh_desc desc = {.positions_f = shape.positions,
                                 .indices = shape.indices,
                                 .n_vertices = shape.n_vertices,
                                 .n_triangles = shape.n_triangles};
    RIG_OK(lum_scene_put_mesh(r.scene, "ball", &desc, &err));
    lum_shape_finish(&shape);
    rig_diffuse_object(&r, "ball", "white", 0.5f, rig_v(0, 0, 0));
    rig_bulb(&r, "bulb", rig_v(0.2, 0.1, -0.3), 100);
    rig_commit(&r);
    struct vpls v = {.n = 1024, .max_bounces = 10};
    vpls_update(&v, &r);
    struct lum_gather_points pts = {0};
    for (uint32_t i = 0; i < 256; i++) { /* VPLs are points on the sphere: where they lie themselves included */
        struct lum_vec3 n = {v.set.nx[i], v.set.ny[i], v.set.nz[i]};
        vpls_add_point(&pts, lum_v3(v.set.px[i], v.set.py[i], v.set.pz[i]), n);
    }
    struct lum_rgb e[LUM_RAY_BATCH];
    vpls_gather(&r, &v.set, no_bound, &pts, e);
    double scale2 = r.snapshot->norm.scale * r.snapshot->norm.scale;
    double want = flux_of_slots(&v, 0, v.n) / (4.0 * LUM_PI_D * scale2); /* of radius 1 */
    struct mean mean = {0};
    double worst = 0.0;
    for (uint32_t i = 0; i < 256; i++) {
        mean_add(&mean, (double)e[i].g / want);
        worst = fmax(worst, fabs((double)e[i].g / want - 1.0));
    }
    print_message("sphere: mean %.5f, worst point off by %.4f\n", mean.mean, worst);
    /* Chords of 128 segments are tilted by up to pi / 128 = 0.025 against the sphere, at both ends; first order cancels
     * over VPLs all around, but for their spread. Those on the point's own facet (1 in 16000) give nothing. */
    assert_true(fabs(mean.mean - 1.0) < 0.01 && worst < 0.05);
    lum_vpl_finish(&v.set);
    rig_end(&r);
}

/* ---- against path tracing ---- */

/* A court without a roof, with a crate; walls red and white. */
static void court(struct rig *r, float albedo)
{
    struct lum_material_desc white = rig_diffuse(albedo), red = rig_diffuse(0.8f * albedo);
    red.base_color.g *= 0.2f;
    rig_material(r, "white", &white);
    rig_material(r, "red", &red);
    const double p[] = {-1, 0, -1, 1, 0, -1, 1, 0, 1, -1, 0, 1, -1, 2, -1, 1, 2, -1, 1, 2, 1, -1, 2, 1};
    const uint32_t i[] = {0, 2, 1, 0, 3, 2, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
    rig_mesh(r, "court", p, 8, i, 10);
    rig_box(r, "crate", 0.25, 0.3, 0.25);
    rig_object(r, "court", "court", "white", rig_v(0, 0, 0));
    rig_object(r, "crate", "crate", "red", rig_v(0.3, 0.31, -0.2));
}

/* All kinds of light (server/world/light_kinds.h), an image of a sky, a mesh, and three of the kinds in fog. */
enum { IMAGE = LUM_LIGHT_KIND_COUNT, MESH, IN_FOG, N_LIGHTS = IN_FOG + 3 };
static const struct lum_light_kind_row *const in_fog[] = {&lum_light_kind_point, &lum_light_kind_directional,
                                                          &lum_light_kind_environment};

static const char *name_of(size_t kind)
{
    if (kind < IMAGE)
        return lum_light_kinds[kind].name;
    return kind == IMAGE ? "image" : kind == MESH ? "mesh" : "in fog";
}

static void court_with_light(struct rig *r, size_t kind, bool white)
{
    static const float sky_pixels[3 * 4] = {0, 0, 0, 4, 4, 1, 0.5f, 0.5f, 2, 1, 0, 0};
    const struct lum_light_kind_row *row = kind < IMAGE ? lum_light_kinds[kind].row : &lum_light_kind_environment;
    rig_begin(r, 2);
    court(r, white ? 0.6f : 0.0f);
    if (kind >= IN_FOG) { /* a haze that absorbs, box and all around */
        struct lum_medium_desc fog = {.sigma_a = {0.5f, 1.0f, 2.0f}, .lo = {-2, 0.5, -2}, .hi = {2, 2.5, 2}};
        RIG_OK(lum_scene_put_medium(r->scene, "fog", &fog, &err));
        row = in_fog[kind - IN_FOG];
    }
    if (kind != MESH) {
        struct lum_light_desc l = light_of_kind(row);
        struct lum_image_desc sky = {LUM_TEXEL_RGB32F, 2, 2, sky_pixels};
        RIG_OK(lum_scene_put_image(r->scene, "sky", &sky, &err));
        struct lum_web *web = web_of_a_lamp();
        l.image = kind == IMAGE ? "sky" : NULL;
        l.web = web;
        rig_light(r, "lamp", &l);
        lum_web_unref(web);
    } else {
        struct lum_material_desc glow = rig_diffuse(white ? 0.3f : 0.0f);
        glow.emission = lum_grey(1.0f), glow.emission_cd_m2 = 100;
        rig_material(r, "glow", &glow);
        rig_box(r, "bar", 0.3, 0.05, 0.05);
        rig_object(r, "bar", "bar", "glow", rig_v(-0.4, 1.5, 0.3));
    }
    rig_commit(r);
}

struct estimate {
    double value, err;
};

static struct estimate path_traced(const struct rig *r, struct lum_vec3d at, struct lum_vec3 n)
{
    struct lum_probe probe;
    uint64_t rays;
    RIG_OK(probe_at(r->pool, r->snapshot, at, n, 1 << 15, 1, &probe, &rays, &err));
    return (struct estimate){probe.illuminance_lx, probe.stderr_lx};
}

static struct estimate gathered(const struct rig *r, struct lum_vec3d at, struct lum_vec3 n, uint32_t tries)
{
    struct mean mean = {0};
    struct lum_gather_points pts = {0};
    vpls_add_point(&pts, rig_to_scene(r, at.x, at.y, at.z), n);
    for (uint32_t seed = 0; seed < 16; seed++) { /* fewer VPLs, more draws */
        struct vpls v = {.n = tries > 1 ? 2048 : 4096,
                         .max_bounces = LUM_DEPTH_DEFAULT - 1,
                         .seed = seed,
                         .media = true,
                         .tries = tries};
        struct lum_rgb e;
        vpls_update(&v, r);
        vpls_gather(r, &v.set, no_bound, &pts, &e);
        mean_add(&mean, (double)lum_luminance(e));
        lum_vpl_finish(&v.set);
    }
    return (struct estimate){mean.mean, mean_stderr(&mean)};
}

/* Path traced irradiance with black walls is direct light; the rest is indirect, and must be what VPLs give, for every
 * kind of light. Both have standard errors. */
static void all_lights_as_the_path_tracer(void **state)
{
    (void)state;
    const struct lum_vec3d at = {-0.1, 0.9,
                                 0.1}; /* in the air, looking down: most of what it sees is lit by light itself */
    const struct lum_vec3 down = {0.48f, -0.8f, 0.36f};
    for (size_t k = 0; k < N_LIGHTS; k++) {
        struct rig r;
        court_with_light(&r, k, false);
        struct estimate direct = path_traced(&r, at, down);
        rig_end(&r);
        court_with_light(&r, k, true);
        struct estimate all = path_traced(&r, at, down);
        double want = all.value - direct.value;
        for (uint32_t tries = 1; tries <= 8; tries += 7) { /* choosing among paths changes no expectation */
            struct estimate vpls = gathered(&r, at, down, tries);
            double tolerance = 4.0 * sqrt(direct.err * direct.err + all.err * all.err + vpls.err * vpls.err);
            print_message("%-16s indirect %8.4f +- %.4f, path traced %8.4f +- %.4f; direct %8.4f\n", name_of(k),
                          vpls.value, vpls.err, want, all.err, direct.value);
            if (!(fabs(vpls.value - want) < tolerance) || !(tolerance < 0.15 * want))
                fail_msg("%s, %u tries: %g, path traced %g, tolerance %g", name_of(k), tries, vpls.value, want,
                         tolerance);
        }
        rig_end(&r);
    }
}

/* A hall whose roof has a hole, 0.5 m wide: a sun that stands upright lights 1 part in 64 of its floor, and the roof.
 */
static void sunny_hall(struct rig *r)
{
    rig_begin(r, 1);
    struct lum_material_desc white = rig_diffuse(0.6f);
    rig_material(r, "white", &white);
    rig_box(r, "floor", 2.1, 0.1, 2.1);
    rig_box(r, "long", 0.1, 1.5, 2.1);
    rig_box(r, "wide", 2.1, 1.5, 0.1);
    rig_box(r, "side", 0.875, 0.1, 2.0);
    rig_box(r, "rest", 0.25, 0.1, 0.875);
    rig_object(r, "floor", "floor", "white", rig_v(0, -0.1, 0));
    for (int k = -1; k <= 1; k += 2) {
        rig_object(r, k < 0 ? "left" : "right", "long", "white", rig_v(2.0 * k, 1.5, 0));
        rig_object(r, k < 0 ? "back" : "front", "wide", "white", rig_v(0, 1.5, 2.0 * k));
        rig_object(r, k < 0 ? "roof left" : "roof right", "side", "white", rig_v(1.125 * k, 3.0, 0));
        rig_object(r, k < 0 ? "roof back" : "roof front", "rest", "white", rig_v(0, 3.0, 1.125 * k));
    }
    struct lum_light_desc sun = light_of_kind(&lum_light_kind_directional);
    sun.direction = rig_v(0, -1, 0);
    rig_light(r, "sun", &sun);
    rig_commit(r);
}

/* VPLs below the roof and their flux, mean of some seeds: of eight tries, which are as many times dearer and have a
 * tenth of the error, a quarter. */
static void count_inside(const struct rig *r, uint32_t n_vpls, uint32_t tries, struct mean *ret_n,
                         struct mean *ret_flux)
{
    *ret_n = *ret_flux = (struct mean){0};
    for (uint32_t seed = 0; seed < (tries > 1 ? 4096 : 16384) / n_vpls; seed++) {
        struct vpls v = {.n = n_vpls, .max_bounces = 4, .seed = seed, .tries = tries};
        double n = 0.0, flux = 0.0;
        vpls_update(&v, r);
        float roof = rig_to_scene(r, 0, 2.8, 0).y;
        for (uint32_t i = 0; i < v.set.n; i++)
            if (v.set.light[i] != LUM_NO_OBJECT && v.set.py[i] < roof) {
                n += 1.0;
                flux += (double)v.set.flux[1][i];
            }
        mean_add(ret_n, n);
        mean_add(ret_flux, flux);
        lum_vpl_finish(&v.set);
    }
}

/* Of eight tries for each slot those that lie on the roof, and light nothing, give way to those that come in: of these
 * there are eight times as many, and nearly all are chosen. Their flux is what it was, also of a set of four. */
static void tries_go_where_there_is_something_to_light(void **state)
{
    (void)state;
    struct rig r;
    sunny_hall(&r);
    for (uint32_t n = 4; n <= 256; n *= 64) {
        struct mean n_one, n_eight, one, eight;
        count_inside(&r, n, 1, &n_one, &one);
        count_inside(&r, n, 8, &n_eight, &eight);
        double tolerance = 4.0 * hypot(mean_stderr(&one), mean_stderr(&eight));
        print_message("%u: inside %.3f of one try, %.3f of eight; flux %.4g +- %.2g, %.4g +- %.2g\n", n, n_one.mean,
                      n_eight.mean, one.mean, mean_stderr(&one), eight.mean, mean_stderr(&eight));
        assert_true(n_one.mean > 0.0 && n_eight.mean > 4.0 * n_one.mean);
        assert_true(fabs(one.mean - eight.mean) < tolerance);
        /* 8 times as many: 0.35 of the error of as many seeds */
        assert_true(0.5 * mean_stderr(&eight) < 0.6 * mean_stderr(&one));
    }
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_bounce_is_left_out),           cmocka_unit_test(flux_falls_by_albedo),
        cmocka_unit_test(mirrors_and_glass_keep_the_flux), cmocka_unit_test(lights_share_the_paths),
        cmocka_unit_test(form_factors_of_a_cube),          cmocka_unit_test(sphere_is_lit_evenly),
        cmocka_unit_test(all_lights_as_the_path_tracer),   cmocka_unit_test(tries_go_where_there_is_something_to_light),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
