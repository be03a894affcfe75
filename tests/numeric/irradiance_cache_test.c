/* Records of Ward's irradiance cache against closed forms and against the path tracer. */
#include "tests/support/rig.h"

#include "core/cache/cache.h"
#include "core/cache/kind.h"
#include "core/pass/pass.h"
#include "core/path/wave.h"
#include "core/scene/shapes.h"
#include "tests/numeric/stats.h"
#include "tests/support/effort.h"

struct bench {
    struct lum_cache cache;
    struct lum_cache_record records[256], *list[256];
    uint32_t n;
    struct lum_vec3 eye;
    float pixel;
    struct lum_counters counters;
};

static struct bench bench_of(uint32_t n_rays, uint32_t max_bounces)
{
    struct bench b = {
        .cache.key = {.kind = &lum_cache_irradiance, .n_vpls = n_rays, .max_bounces = max_bounces, .accuracy = 0.25f}};
    return b;
}

static void add_record(struct bench *b, struct lum_vec3 p, struct lum_vec3 n)
{
    assert_true(b->n < LUM_ARRAY_LEN(b->records));
    n = lum_normalize(n);
    b->records[b->n++] = (struct lum_cache_record){.p = p, .n = n, .ng = n};
}

static void build_some(struct bench *b, const struct rig *r, uint32_t first, uint32_t n)
{
    for (uint32_t i = 0; i < b->n; i++)
        b->list[i] = &b->records[i];
    struct lum_cache_job job = {&b->cache, r->snapshot, b->list + first, n, b->pixel, b->eye, 0, &b->counters};
    lum_cache_irradiance.build(&job);
    assert_int_equal(b->counters.nonfinite, 0);
    assert_int_equal(b->counters.bad_rays, 0);
}

static uint64_t build_all(struct bench *b, const struct rig *r)
{
    b->counters = (struct lum_counters){0};
    build_some(b, r, 0, b->n);
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        assert_true(k == LUM_RAY_INDIRECT_DIFFUSE || b->counters.rays[k] == 0);
    return b->counters.rays[LUM_RAY_INDIRECT_DIFFUSE];
}

enum { SPHERE_AROUND = 256, SPHERE_DOWN = 128 };

/* Hollow sphere of radius 1, as mesh and object "ball". */
static void add_sphere(struct rig *r, float albedo)
{
    struct lum_shape_mesh shape;
    struct lum_shape_params params = {.size = {2, 2, 2}, .segments = {SPHERE_AROUND, SPHERE_DOWN}};
    RIG_OK(lum_shape_make("sphere", &params, &shape, &err));
    struct lum_mesh_desc desc = {.positions_f = shape.positions,
                                 .indices = shape.indices,
                                 .n_vertices = shape.n_vertices,
                                 .n_triangles = shape.n_triangles};
    RIG_OK(lum_scene_put_mesh(r->scene, "ball", &desc, &err));
    lum_shape_finish(&shape);
    rig_diffuse_object(r, "ball", "white", albedo, rig_v(0, 0, 0));
}

/* Records on the inside of the sphere of radius 1: just inside its facets. */
static void add_sphere_records(struct bench *b, const struct rig *r, uint32_t n)
{
    struct rng random = {7};
    double inside = cos(LUM_PI_D / SPHERE_AROUND) * cos(0.5 * LUM_PI_D / SPHERE_DOWN);
    for (uint32_t i = 0; i < n; i++) {
        double z = 2.0 * rng_unit(&random) - 1.0, phi = 2.0 * LUM_PI_D * rng_unit(&random), s = sqrt(1.0 - z * z);
        struct lum_vec3 d = lum_v3((float)(s * cos(phi)), (float)(s * sin(phi)), (float)z);
        add_record(b, rig_to_scene(r, inside * (double)d.x, inside * (double)d.y, inside * (double)d.z), lum_v3_neg(d));
    }
}

/* ---- closed forms ---- */

/* A light at the centre lights the wall evenly, E = I / R^2, and so does every bounce: all paths bring the same. Two
 * bounces end before roulette begins, so that there is no chance in it at all. */
static void sphere_with_its_light_at_the_centre(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    add_sphere(&r, 0.6f);
    rig_bulb(&r, "bulb", rig_v(0, 0, 0), 100);
    rig_commit(&r);
    struct bench b = bench_of(256, 2);
    add_sphere_records(&b, &r, 64);
    build_all(&b, &r);
    double want = 100.0 * (0.6 + 0.36);
    /* facets lie between 1 and cos(pi / 256)^2 from the centre, and are tilted by as much: 1.5e-4, squared for
     * distances */
    for (uint32_t i = 0; i < b.n; i++)
        if (!(fabs((double)b.records[i].irradiance.g / want - 1.0) < 6e-4))
            fail_msg("record %u: %g, expected %g", i, (double)b.records[i].irradiance.g, want);
    /* An interpolated normal that leans by 40 degrees: rays into the surface bring nothing, the others are (1 + cos) /
     * 2 of all. 4096 rays: a deviation of 0.32 / 64, 4.5 sigma for 64 records: 2.3 %. */
    b.cache.key.n_vpls = 4096;
    for (uint32_t i = 0; i < b.n; i++) {
        struct lum_frame frame = lum_frame_from_normal(b.records[i].ng);
        b.records[i].n = lum_v3_mad(lum_v3_mul(frame.n, cosf(0.7f)), frame.t, sinf(0.7f));
    }
    build_all(&b, &r);
    want *= 0.5 + 0.5 * cos(0.7);
    for (uint32_t i = 0; i < b.n; i++)
        if (!(fabs((double)b.records[i].irradiance.g / want - 1.0) < 0.023 + 6e-4))
            fail_msg("leaning record %u: %g, expected %g", i, (double)b.records[i].irradiance.g, want);
    rig_end(&r);
}

/* Wherever the light is, the wall's light arrives evenly: E = Phi rho / (4 pi R^2) and so on. */
static void sphere_with_its_light_anywhere(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    add_sphere(&r, 0.5f);
    rig_bulb(&r, "bulb", rig_v(0.3, 0.2, -0.1), 100);
    rig_commit(&r);
    struct bench b = bench_of(4096, 20);
    add_sphere_records(&b, &r, 32);
    for (uint32_t i = 0; i < b.n; i++) { /* numbers of their own, so that errors are independent */
        b.cache.key.seed = i;
        build_some(&b, &r, i, 1);
    }
    struct mean mean = {0};
    double worst = 0.0;
    for (uint32_t i = 0; i < b.n; i++) {
        double x = (double)b.records[i].irradiance.g / 100.0; /* I / R^2 (1/2 + 1/4 + ...) = 100 */
        mean_add(&mean, x);
        worst = fmax(worst, fabs(x - 1.0));
    }
    print_message("sphere: mean %.5f +- %.5f, worst record off by %.4f\n", mean.mean, mean_stderr(&mean), worst);
    /* Direct light on the wall is from 53 to 255 (light 0.374 off the centre), so that one path's light has a relative
     * deviation below 0.6 with roulette; 4096 paths, 4.5 sigma for 32 records: 4.2 %. */
    assert_true(worst < 0.042);
    assert_true(fabs(mean.mean - 1.0) < 4.0 * mean_stderr(&mean) + 6e-4);
    rig_end(&r);
}

/* All walls shine with Le and have albedo rho: what arrives by way of walls is pi Le (rho + rho^2 + ...), and what they
 * send by themselves is not counted. */
static void furnace(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_furnace(&r, 1, 0.5f, 10);
    rig_commit(&r);
    for (uint32_t bounces = 0; bounces <= 3; bounces++) {
        struct mean mean = {0};
        for (uint32_t seed = 0; seed < TEST_EFFORT(16); seed++) {
            struct bench b = bench_of(256, bounces);
            b.cache.key.seed = seed;
            for (int i = 0; i < 16; i++)
                add_record(&b, rig_to_scene(&r, -0.9 + 0.12 * i, -1, 0.1 * i - 0.8), lum_v3(0, 1, 0));
            uint64_t rays = build_all(&b, &r);
            assert_true(bounces > 0 || rays == 0);
            double sum = 0.0;
            for (int i = 0; i < 16; i++)
                sum += (double)b.records[i].irradiance.g / 16.0;
            mean_add(&mean, sum / (10.0 * LUM_PI_D));
        }
        double want = 1.0 - pow(0.5, bounces);
        print_message("furnace, %u bounces: %.5f +- %.5f, closed form %.5f\n", bounces, mean.mean, mean_stderr(&mean),
                      want);
        if (TEST_TELLS &&
            (!(fabs(mean.mean - want) <= 4.0 * mean_stderr(&mean) + 1e-6) || !(mean_stderr(&mean) < 0.01)))
            fail_msg("furnace: %g +- %g, expected %g", mean.mean, mean_stderr(&mean), want);
    }
    rig_end(&r);
}

/* Share of a corner's rectangle a x b in the view of a small plane at distance c above that corner, facing it. */
static double factor_above_corner(double a, double b, double c)
{
    double x = a / c, y = b / c, sx = sqrt(1.0 + x * x), sy = sqrt(1.0 + y * y);
    return (x / sx * atan(y / sx) + y / sy * atan(x / sy)) / (2.0 * LUM_PI_D);
}

/* The same where the small plane stands upright over the side b of the rectangle, facing along a. */
static double factor_beside_corner(double a, double b, double c)
{
    return (atan(b / c) - c / hypot(a, c) * atan(b / hypot(a, c))) / (2.0 * LUM_PI_D);
}

/* Shapes on the floor under a sun straight above, which gives all of them the same radiance: a record gets the share of
 * its hemisphere that they fill. */
static void form_factors(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    const struct {
        const char *what, *shape;
        struct lum_vec3d at;
        struct lum_vec3 n;
        double want, margin;
    } cases[] = {
        {"above a square", "quad", {0, 0.5, 0}, {0, -1, 0}, 4.0 * factor_above_corner(0.5, 0.5, 0.5), 0.0},
        {"above its corner", "quad", {0.5, 0.7, 0.5}, {0, -1, 0}, factor_above_corner(1, 1, 0.7), 0.0},
        {"beside a square", "quad", {-0.5, 0.4, 0}, {1, 0, 0}, 2.0 * factor_beside_corner(1, 0.5, 0.4), 0.0},
        /* of a polygon with 256 corners the area is 1 - (2 pi / 256)^2 / 6 of the disc's */
        {"above a disc", "disc", {0, 0.6, 0}, {0, -1, 0}, 0.25 / (0.25 + 0.36), 1e-4},
        {"behind a square", "quad", {0, 0.5, 0}, {0, 1, 0}, 0.0, 0.0},
    };
    struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                 .direction = {0, -1, 0},
                                 .color = lum_grey(1),
                                 .intensity = 100,
                                 .on = true};
    rig_light(&r, "sun", &sun);
    for (size_t k = 0; k < LUM_ARRAY_LEN(cases); k++) {
        struct lum_shape_mesh shape;
        struct lum_shape_params params = {.size = {1, 1, 1}, .segments = {256, 1}};
        if (strcmp(cases[k].shape, "quad") == 0) {
            rig_square(&r, "plate", 0.5);
        } else {
            RIG_OK(lum_shape_make(cases[k].shape, &params, &shape, &err));
            struct lum_mesh_desc desc = {.positions_f = shape.positions,
                                         .indices = shape.indices,
                                         .n_vertices = shape.n_vertices,
                                         .n_triangles = shape.n_triangles};
            RIG_OK(lum_scene_put_mesh(r.scene, "plate", &desc, &err));
            lum_shape_finish(&shape);
        }
        rig_diffuse_object(&r, "plate", "white", 0.8f, rig_v(0, 0, 0));
        rig_commit(&r);
        struct mean mean = {0};
        for (uint32_t seed = 0; seed < TEST_EFFORT(16); seed++) {
            struct bench b = bench_of(4096, 1);
            b.cache.key.seed = seed;
            add_record(&b, rig_to_scene(&r, cases[k].at.x, cases[k].at.y, cases[k].at.z), cases[k].n);
            build_all(&b, &r);
            mean_add(&mean, (double)b.records[0].irradiance.g / 80.0);
        }
        double want = cases[k].want, deviation = sqrt(want * (1.0 - want) / 4096.0);
        print_message("%s: %.6f +- %.6f, closed form %.6f\n", cases[k].what, mean.mean, mean_stderr(&mean), want);
        /* no worse than 16 times 4096 independent rays; 1e-6 for float's sum */
        if (TEST_TELLS && !(fabs(mean.mean - want) <= 4.0 * deviation / 4.0 + cases[k].margin + 1e-6))
            fail_msg("%s: %g, expected %g", cases[k].what, mean.mean, want);
    }
    rig_end(&r);
}

/* Ward's R above a wide plane is 1.5 h: the mean of 1 / d = cos / h over the cosine-weighted hemisphere is 2 / (3 h).
 */
static void radius_is_the_harmonic_mean(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_square(&r, "floor", 50);
    rig_diffuse_object(&r, "floor", "white", 0.5f, rig_v(0, 0, 0));
    rig_bulb(&r, "bulb", rig_v(0, 2, 0), 100);
    rig_commit(&r);
    double scale = r.snapshot->norm.scale, diagonal = 100.0 * sqrt(2.0) * scale;
    struct bench b = bench_of(4096, 1);
    const double heights[] = {0.1, 1.0, 3.0, 1e-9, 30.0};
    for (size_t i = 0; i < LUM_ARRAY_LEN(heights); i++)
        add_record(&b, rig_to_scene(&r, 0.3, heights[i], 0.2), lum_v3(0, -1, 0));
    add_record(&b, rig_to_scene(&r, 0.3, 0.5, 0.2), lum_v3(0, 1, 0)); /* meets nothing */
    build_all(&b, &r);
    double reach = (double)b.records[1].radius / (0.25 * 1.5 * heights[1] * scale);
    for (int i = 0; i < 3; i++) {
        double want = 0.25 * reach * 1.5 * heights[i] * scale;
        /* cos has a deviation of sqrt(1/2 - 4/9) = 0.24 about 2/3: 4 sigma of 4096 are 2.3 %, also of the one that the
         * factor is from. Rays start LUM_RAY_OFFSET nearer. */
        double slack = 0.046 * want + 0.25 * reach * 1.5 * (double)LUM_RAY_OFFSET;
        if (!(fabs((double)b.records[i].radius - want) < slack))
            fail_msg("height %g: radius %g, expected %g", heights[i], (double)b.records[i].radius, want);
    }
    for (int i = 3; i < 6; i++) /* too near; and too far, or nothing there */
        if (!(b.records[i].radius > 0.0f && (double)b.records[i].radius <= 0.25 * reach * diagonal))
            fail_msg("record %d: radius %g", i, (double)b.records[i].radius);
    assert_true(b.records[4].radius == b.records[5].radius);
    /* no finer than pixels: 1 unit from the eye at a pixel of 0.01 */
    b.eye = lum_v3_add(b.records[0].p, lum_v3(0, 1, 0)), b.pixel = 0.01f;
    float before = b.records[0].radius;
    build_all(&b, &r);
    assert_true(b.records[0].radius >= 0.01f && b.records[0].radius > before);
    rig_end(&r);
}

/* ---- the path tracer ---- */

/* Mean irradiance by paths of up to depth segments from a white surface at p, over n samples. */
static struct mean irradiance_by_paths(const struct rig *r, struct lum_vec3 p, struct lum_vec3 n, uint32_t depth)
{
    struct lum_bsdf white = lum_bsdf_white(n, n);
    struct lum_counters counters = {0};
    struct mean mean = {0};
    for (uint32_t seed = 0; seed < TEST_EFFORT(64); seed++) {
        struct lum_wave w;
        /* what fog scatters to surfaces is in no record of a hemisphere */
        lum_wave_begin(&w, r->snapshot, &counters, depth, LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING));
        for (uint32_t i = 0; i < LUM_RAY_BATCH; i++)
            lum_wave_add_vertex(&w, i, lum_sampler_at(1, 2, i, seed), p, &white, n);
        lum_wave_run(&w, 1);
        double sum = 0.0;
        for (uint32_t i = 0; i < LUM_RAY_BATCH; i++)
            sum += LUM_PI_D * (double)w.radiance[i].g / LUM_RAY_BATCH;
        mean_add(&mean, sum);
    }
    return mean;
}

/* All that paths find from a point, less what is direct: with every kind of light, mirrors, glass, gloss and fog. */
static void records_as_the_path_tracer(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_room(&r);
    struct lum_material_desc mirror = rig_diffuse(0.9f), glass = lum_material_default(), gloss = lum_material_default();
    mirror.metallic = 1.0f, mirror.roughness = 0.0f;
    glass.transmission = 1.0f, glass.roughness = 0.0f;
    gloss.roughness = 0.4f;
    rig_material(&r, "mirror", &mirror);
    rig_material(&r, "glass", &glass);
    rig_material(&r, "gloss", &gloss);
    rig_box(&r, "cube", 0.3, 0.3, 0.3);
    rig_object(&r, "m", "cube", "mirror", rig_v(-1.2, 0.4, -0.9));
    rig_object(&r, "g", "cube", "glass", rig_v(-0.8, 0.4, 0.9));
    rig_object(&r, "h", "cube", "gloss", rig_v(1.2, 0.4, 1.1));
    struct lum_light_desc point = rig_point(rig_v(1, 2.5, 1), 60),
                          quad = rig_quad(rig_v(-0.5, 2.6, 0), rig_v(0.4, 0, 0), rig_v(0, 0, 0.3), 200);
    struct lum_light_desc ball = point;
    ball.kind = &lum_light_kind_sphere, ball.radius_m = 0.2, ball.position = rig_v(0, 0.3, 1.2), ball.intensity = 100;
    ball.camera_visible = true;
    rig_light(&r, "point", &point);
    rig_light(&r, "quad", &quad);
    rig_light(&r, "ball", &ball);
    struct lum_medium_desc fog = {.sigma_s = lum_grey(0.1f), .sigma_a = lum_grey(0.1f), .everywhere = true};
    RIG_OK(lum_scene_put_medium(r.scene, "fog", &fog, &err));
    rig_commit(&r);
    const struct lum_vec3d at[] = {{0, 0, 0.3}, {-1.4, 0, 0.2}, {0.4, 1.0, -0.3}, {1.9, 0, -1.9}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(at); k++) {
        struct lum_vec3 p = rig_to_scene(&r, at[k].x, at[k].y, at[k].z), n = lum_v3(0, 1, 0);
        struct mean all = irradiance_by_paths(&r, p, n, 4), direct = irradiance_by_paths(&r, p, n, 1), got = {0};
        for (uint32_t seed = 0; seed < TEST_EFFORT(64); seed++) {
            struct bench b = bench_of(256, 3);
            b.cache.key.seed = seed, b.cache.key.media = true;
            add_record(&b, p, n);
            build_all(&b, &r);
            mean_add(&got, (double)b.records[0].irradiance.g);
        }
        double want = all.mean - direct.mean;
        double sigma = sqrt(pow(mean_stderr(&all), 2) + pow(mean_stderr(&direct), 2) + pow(mean_stderr(&got), 2));
        print_message("point %zu: %.4f +- %.4f, by paths %.4f; together +- %.4f\n", k, got.mean, mean_stderr(&got),
                      want, sigma);
        if (TEST_TELLS && (!(fabs(got.mean - want) < 4.0 * sigma) || !(sigma < 0.1 * want)))
            fail_msg("point %zu: %g, expected %g +- %g", k, got.mean, want, sigma);
    }
    rig_end(&r);
}

/* ---- what a record depends on ---- */

static void lit_room(struct rig *r, uint32_t threads)
{
    rig_begin(r, threads);
    rig_room(r);
    struct lum_light_desc quad = rig_quad(rig_v(-0.5, 2.6, 0), rig_v(0.4, 0, 0), rig_v(0, 0, 0.3), 200),
                          point = rig_point(rig_v(1, 2.5, 1), 60);
    rig_light(r, "quad", &quad);
    rig_light(r, "point", &point);
    rig_commit(r);
}

static void add_floor_records(struct bench *b, const struct rig *r)
{
    for (int i = 0; i < 60; i++)
        add_record(b, rig_to_scene(r, -1.9 + 0.063 * i, 0, 1.9 - 0.06 * i), lum_v3(0, 1, 0));
}

struct parallel {
    struct bench *b;
    const struct rig *r;
    struct lum_counters counters[8];
};

static void build_one(void *ctx, uint32_t task, uint32_t worker)
{
    struct parallel *p = ctx;
    struct lum_cache_record *record = &p->b->records[p->b->n - 1 - task];
    struct lum_cache_job job = {&p->b->cache, p->r->snapshot, &record, 1,
                                p->b->pixel,  p->b->eye,      worker,  &p->counters[worker]};
    lum_cache_irradiance.build(&job);
}

/* Company, order and threads do not matter: bit for bit. Also where rays of several records share a packet. */
static void a_record_is_its_own(void **state)
{
    (void)state;
    const uint32_t n_rays[] = {1, 17, 100, 256, 300};
    for (size_t k = 0; k < LUM_ARRAY_LEN(n_rays); k++) {
        struct rig r;
        lit_room(&r, 4);
        struct bench together = bench_of(n_rays[k], 4);
        add_floor_records(&together, &r);
        struct bench split = together, parallel = together;
        uint64_t rays = build_all(&together, &r);
        for (uint32_t first = 0, n; first < split.n; first += n) {
            n = first % 5 + 1 < split.n - first ? first % 5 + 1 : split.n - first;
            build_some(&split, &r, first, n);
        }
        assert_int_equal(split.counters.rays[LUM_RAY_INDIRECT_DIFFUSE], rays);
        struct parallel p = {.b = &parallel, .r = &r};
        RIG_OK(lum_pool_run(r.pool, parallel.n, build_one, &p, NULL));
        for (uint32_t i = 0; i < together.n; i++) {
            const struct lum_cache_record *a = &together.records[i], *b = &split.records[i], *c = &parallel.records[i];
            if (memcmp(&a->irradiance, &b->irradiance, sizeof a->irradiance) || a->radius != b->radius)
                fail_msg("%u rays, record %u: %g in one go, %g in parts", n_rays[k], i, (double)a->irradiance.g,
                         (double)b->irradiance.g);
            if (memcmp(&a->irradiance, &c->irradiance, sizeof a->irradiance) || a->radius != c->radius)
                fail_msg("%u rays, record %u: %g, %g with threads", n_rays[k], i, (double)a->irradiance.g,
                         (double)c->irradiance.g);
            assert_true(a->radius > 0.0f && isfinite(a->radius));
        }
        rig_end(&r);
    }
}

/* Where no light can come from, no ray asks. */
static void darkness_costs_nothing(void **state)
{
    (void)state;
    struct lum_light_desc l = rig_point(rig_v(0, 0.5, 0), 100), dark = l;
    dark.intensity = 0;
    const struct {
        const char *what;
        const struct lum_light_desc *light;
        float albedo;
        uint32_t bounces;
        bool rays;
    } cases[] = {{"no light", NULL, 0.5f, 3, false},
                 {"light of no power", &dark, 0.5f, 3, false},
                 {"black walls", &l, 0.0f, 3, false},
                 {"no bounces", &l, 0.5f, 0, false},
                 {"lit walls", &l, 0.5f, 1, true}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(cases); k++) {
        struct rig r;
        rig_begin(&r, 0);
        rig_box(&r, "box", 1, 1, 1);
        rig_diffuse_object(&r, "box", "wall", cases[k].albedo, rig_v(0, 0, 0));
        if (cases[k].light)
            rig_light(&r, "lamp", cases[k].light);
        rig_commit(&r);
        struct bench b = bench_of(64, cases[k].bounces);
        add_record(&b, rig_to_scene(&r, 0.2, -1, 0.1), lum_v3(0, 1, 0));
        uint64_t rays = build_all(&b, &r);
        float e = b.records[0].irradiance.g;
        if ((rays > 0) != cases[k].rays || (e > 0.0f) != cases[k].rays || !(b.records[0].radius > 0.0f))
            fail_msg("%s: %llu rays, irradiance %g, radius %g", cases[k].what, (unsigned long long)rays, (double)e,
                     (double)b.records[0].radius);
        rig_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sphere_with_its_light_at_the_centre),
        cmocka_unit_test(sphere_with_its_light_anywhere),
        cmocka_unit_test(furnace),
        cmocka_unit_test(form_factors),
        cmocka_unit_test(radius_is_the_harmonic_mean),
        cmocka_unit_test(records_as_the_path_tracer),
        cmocka_unit_test(a_record_is_its_own),
        cmocka_unit_test(darkness_costs_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
