/* Every method against closed forms (NOTES H17, H21, H39, H40), and those with virtual point lights against path
 * tracing, which they converge to. rig_pass asserts that no sample was dropped and no ray refused. */
#include "core/cache/kind.h"
#include "core/scene/shapes.h"
#include "tests/support/effort.h"
#include "tests/support/rig.h"

#define PI 3.14159265358979323846

/* A fast frame, or `spp` samples of a method that only samples; its mean. */
static double render(struct rig *r, const struct lum_method *method, uint32_t spp)
{
    rig_fresh_view(r);
    r->settings.method = method;
    r->settings.max_spp = spp;
    for (uint32_t i = 0; i < (method->progressive ? spp : 1); i++)
        rig_pass(r);
    return (double)rig_mean(r).g;
}

/* ---- furnace: everything shines with LE and reflects rho, L = LE (1 + rho + .. + rho^bounces); by default the whole
 * of it, LE / (1 - rho) ---- */

#define LE 0.5

static void furnace_material(struct rig *r, float rho)
{
    struct lum_material_desc m = rig_diffuse(rho);
    m.emission_cd_m2 = LE;
    rig_material(r, "wall", &m);
}

/* Of radius 1. Between any two points of a sphere the geometry term is 1 / 4: no bound of it is ever reached, and every
 * sampling of area has the same value. Of its facets, 0.1 across, that is true but for the nearest ones: the one that
 * the point lies on does not light it, and the bound takes from those around it. Both are 1e-3 of the sphere's area. */
static void furnace_sphere(struct rig *r)
{
    const struct lum_shape_params params = {.size = {2, 2, 2}, .segments = {64, 32}};
    struct lum_shape_mesh m;
    RIG_OK(lum_shape_make("sphere", &params, &m, &err));
    struct lum_mesh_desc d = {
        .positions_f = m.positions, .indices = m.indices, .n_vertices = m.n_vertices, .n_triangles = m.n_triangles};
    RIG_OK(lum_scene_put_mesh(r->scene, "room", &d, &err));
    lum_shape_finish(&m);
    rig_camera(r, rig_v(0.2, 0.1, 0.3), rig_v(-0.5, -0.4, -1), 60);
}

/* Of half edge 1, seen in the middle of a wall, 0.9 from the nearest other: the geometry term is at most
 * 3 sqrt(3) / 16 / 0.9^2 = 0.4, and its bounds begin at 1 / (2 r_v)^2 = 8 with 256 virtual point lights. */
static void furnace_cube(struct rig *r)
{
    rig_box(r, "room", 1, 1, 1);
    rig_camera(r, rig_v(0, 0, 0), rig_v(0, 0, -1), 10);
}

/* Bounces that a method simulates of those that it may. */
static uint32_t bounces_of(const struct lum_method *method, uint32_t max_depth)
{
    return max_depth > 1 && !lum_method_serves(method, LUM_EFFECT_INDIRECT_DIFFUSE) ? 1 : max_depth;
}

/* Virtual point lights nearer than min_d = r_v count for nothing in equation 6.2.2 (NOTES R1): in a sphere of
 * radius 1 those on a cap of min_d^2 / 4 of its area. Each of the at most five levels of 256 covers the sphere once,
 * so that r_v^2 = 5 * 4 pi / (256 pi). */
static double lost_nearby(const struct lum_method *method)
{
    return method->cache == &lum_cache_instant || method->cache == &lum_cache_temporal ? 5.0 / 256 : 0.0;
}

/* Lifted virtual point lights (vpl_sum.h) give all the light of flat walls, but only nearly that of hollows. What they
 * give in a sphere of radius 1, where every geometry term is 1 / 4, with m^2 = 1.25^2 r_v^2 and r_v as above: the
 * integral over its surface, which is even in s = r^2. Returns the share that it is off by, of one level to five,
 * whichever is most; a fifth more, for the spacing is measured. A cube's flat walls are no worse. */
static double lift_error(const struct lum_method *method)
{
    double most = 0.0;
    for (int n = 1; n <= 5 && method->cache == &lum_cache_live; n++) {
        double m2 = 1.25 * 1.25 * n * 4 / 256, sum = 0.0;
        for (int i = 0; i < 4096; i++) {
            double s = 4.0 * (i + 0.5) / 4096, h = s / 2, rise = m2 * m2 / (h * h + m2), b = sqrt(h * h + rise);
            double a = h - (b - h) * fmin(1.0 - s / 2, 0.0); /* n.n_vpl = 1 - r^2 / 2 */
            sum += a * b / ((s + rise) * (s + rise)) * 4.0 / 4096;
        }
        most = fmax(most, fabs(sum - 1.0));
    }
    return 1.2 * most;
}

/* whole: the sum of all bounces is wanted, of which those beyond 64 may be missing. */
static void check_furnace(struct rig *r, const struct lum_method *method, float rho, bool whole, const char *shape)
{
    enum { SEEDS = TEST_TELLS ? 32 : 2 };
    double want = 0.0, from_vpls = 0.0, sum = 0.0, square = 0.0;
    for (uint32_t k = 0; k <= bounces_of(method, r->settings.max_depth); k++) {
        bool off = k == 1 && (r->settings.effects_off & LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW));
        want += off ? 0.0 : LE * pow((double)rho, k);
        from_vpls += k > 1 ? LE * pow((double)rho, k) : 0.0;
    }
    double cut = 0.0;
    if (whole && bounces_of(method, 64) == 64) {
        bool off = r->settings.effects_off & LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW);
        cut = LE * pow((double)rho, 65) / (1.0 - (double)rho);
        want = LE / (1.0 - (double)rho) - (off ? LE * (double)rho : 0.0);
    }
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        r->settings.seed = seed;
        double got = render(r, method, 4);
        sum += got;
        square += got * got;
    }
    double mean = sum / SEEDS, error = sqrt(fmax(0.0, square / SEEDS - mean * mean) / (SEEDS - 1));
    /* four standard errors; the facets */
    if (!TEST_TELLS)
        return;
    if (!(fabs(mean - want) <=
          4.0 * error + (1e-3 + lost_nearby(method)) * want + lift_error(method) * from_vpls + cut) ||
        !(error <= 0.04 * want))
        fail_msg("%s, %s, albedo %g, depth %u: %.6f +- %.6f, closed form %.6f", shape, method->name, (double)rho,
                 r->settings.max_depth, mean, error, want);
}

static void furnace(void (*furnish)(struct rig *r), const char *shape, uint32_t effects_off)
{
    struct rig r;
    rig_begin(&r, 0);
    const struct {
        float rho;
        uint32_t max_depth;
        bool whole;
    } rows[] = {{0.9f, r.settings.max_depth, true},
                {0.0f, 4, false},
                {0.5f, 1, false},
                {0.5f, 0, false},
                {0.5f, 2, false},
                {0.999f, 4, false}};
    furnace_material(&r, 0.0f);
    furnish(&r);
    rig_object(&r, "room", "room", "wall", rig_v(0, 0, 0));
    r.settings.w = r.settings.h = 12;
    r.settings.effects_off = effects_off;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t k = 0; k < LUM_ARRAY_LEN(rows); k++) {
        furnace_material(&r, rows[k].rho);
        rig_commit(&r);
        r.settings.max_depth = rows[k].max_depth;
        for (size_t m = k % TEST_STRIDE; m < n; m += TEST_STRIDE)
            check_furnace(&r, &methods[m], rows[k].rho, rows[k].whole, shape);
    }
    rig_end(&r);
}

static void furnace_in_a_sphere(void **state)
{
    (void)state;
    furnace(furnace_sphere, "sphere", 0);
}

static void furnace_in_a_cube(void **state)
{
    (void)state;
    furnace(furnace_cube, "cube", 0);
}

/* Left out is what walls light that the eye sees; what they light by way of others stays, in every method. */
static void furnace_without_direct_light(void **state)
{
    (void)state;
    furnace(furnace_sphere, "sphere without soft shadows", LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW));
}

/* A solid of glass in a furnace of black walls does not show: what is reflected and refracted shines alike (NOTES H21).
 */
static void glass_in_a_furnace(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    furnace_material(&r, 0.0f);
    furnace_cube(&r);
    rig_object(&r, "room", "room", "wall", rig_v(0, 0, 0));
    struct lum_material_desc glass = lum_material_default();
    glass.transmission = 1.0f;
    glass.roughness = 0.0f;
    rig_material(&r, "glass", &glass);
    rig_box(&r, "slab", 0.3, 0.4, 0.1);
    rig_object(&r, "slab", "slab", "glass", rig_v(0, 0, -0.5));
    rig_camera(&r, rig_v(0.1, 0.2, 0.3), rig_v(0, 0, -0.5), 40);
    r.settings.max_depth = 24;
    rig_commit(&r);
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = 0; m < n; m++) {
        double got = render(&r, &methods[m], 64);
        /* Branches that carry less than 1 / 512 are dropped; of the light that runs back and forth in the slab, a
         * twenty-fifth each time, that is the rest of one series inside and of what leaves it to either side. */
        if (!(fabs(got / LE - 1.0) <= (methods[m].progressive ? 1e-4 : 3.0 / 512)))
            fail_msg("%s: %.6f of what surrounds it", methods[m].name, got / LE);
    }
    rig_end(&r);
}

/* A room of mirrors that shine: all reflections of reflections, as `path` has them. */
static void furnace_of_mirrors(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    struct lum_material_desc mirror = rig_diffuse(0.8f);
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    mirror.emission_cd_m2 = LE;
    rig_material(&r, "wall", &mirror);
    furnace_cube(&r);
    rig_object(&r, "room", "room", "wall", rig_v(0, 0, 0));
    rig_camera(&r, rig_v(0.1, 0.2, 0.3), rig_v(-0.3, -0.2, -0.5), 40);
    rig_commit(&r);
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    double want = render(&r, lum_method_find("path"), 256);
    for (size_t m = 0; m < n; m++) {
        if (methods[m].progressive)
            continue;
        double got = render(&r, &methods[m], 1);
        /* A branch that carries less than 1 / 512 is dropped, with the 5 times as much that comes of it, a fifth of
         * which is its own. Roulette ends a path after about 5 vertices, give or take as many: four deviations of their
         * mean. */
        double tolerance = 1.0 / 512 + 4.0 / sqrt(256.0 * r.settings.w * r.settings.h);
        if (!(fabs(got / want - 1.0) <= tolerance))
            fail_msg("%s: %.6f, path traced %.6f", methods[m].name, got, want);
    }
    rig_end(&r);
}

/* ---- convergence ---- */

enum { REGIONS = 4, SIDE = 96, N_REGIONS = REGIONS * REGIONS };

static void add_region_means(const struct rig *r, double scale, double sums[N_REGIONS])
{
    const struct lum_film *f = lum_view_film(r->view);
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 0; x < f->w; x++)
            sums[y * REGIONS / f->h * REGIONS + x * REGIONS / f->w] +=
                (double)lum_film_mean(f, x, y).g * scale * N_REGIONS / (f->w * f->h);
}

/* Root of the mean squared relative difference of regions. */
static double regional_error(const double got[N_REGIONS], const double want[N_REGIONS])
{
    double sum = 0.0;
    for (int i = 0; i < N_REGIONS; i++)
        sum += pow(got[i] / want[i] - 1.0, 2.0);
    return sqrt(sum / N_REGIONS);
}

static void light_by(struct rig *r, const char *kind)
{
    if (strcmp(kind, "point") == 0) {
        struct lum_light_desc l = rig_point(rig_v(-1, 2.2, 0.5), 100);
        rig_light(r, kind, &l);
    } else if (strcmp(kind, "quad") == 0) {
        struct lum_light_desc l = rig_quad(rig_v(0, 2.9, 0), rig_v(1, 0, 0), rig_v(0, 0, 1), 100);
        l.camera_visible = false;
        rig_light(r, kind, &l);
    } else {
        struct lum_light_desc l = {
            .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 10, .on = true};
        rig_light(r, kind, &l);
    }
}

/* The room; where the sky is to light it, three of its sides, apart. */
static void build_room(struct rig *r, bool open)
{
    rig_room(r);
    if (!open)
        return;
    RIG_OK(lum_scene_remove(r->scene, LUM_ENTITY_OBJECT, "room", &err));
    rig_box(r, "side", 2, 1.5, 0.1);
    rig_box(r, "slab", 2, 0.1, 2);
    rig_object(r, "back", "side", "white", rig_v(0, 1.5, -2.1));
    rig_object(r, "floor", "slab", "white", rig_v(0, -0.1, 0));
    rig_object(r, "top", "slab", "white", rig_v(0, 3.1, 0));
}

/* Over SEEDS frames; ret_noise: the standard error of that, as a root of mean squares as well. */
static double error_of(struct rig *r, const char *method, const double want[N_REGIONS], double *ret_noise)
{
    enum { SEEDS = 4 };
    double one[SEEDS][N_REGIONS] = {{0}}, got[N_REGIONS] = {0}, square = 0.0;
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        r->settings.seed = seed;
        render(r, lum_method_find(method), 1);
        add_region_means(r, 1.0, one[seed]);
        add_region_means(r, 1.0 / SEEDS, got);
    }
    for (uint32_t seed = 0; seed < SEEDS; seed++)
        square += pow(regional_error(one[seed], got), 2.0);
    *ret_noise = sqrt(square / (SEEDS * (SEEDS - 1)));
    return regional_error(got, want);
}

/* Few and many virtual point lights. Beyond the noise of the frames there remain, of 2048: the noise of path tracing,
 * 9216 samples a region, 1 %; and what the bound takes, a fourth of what arrives from the other wall within 2 r_v of an
 * edge (NOTES R1), r_v = sqrt(56 m2 / (pi 2048)) = 9 cm, of a region that shows a metre, where half of what arrives
 * comes from there: 2.3 %. */
static void check_convergence(const char *kind, uint32_t max_depth)
{
    const char *names[] = {"ais-max", "live"};
    struct rig r;
    rig_begin(&r, 0);
    build_room(&r, strcmp(kind, "environment") == 0);
    light_by(&r, kind);
    rig_commit(&r);
    r.settings.max_depth = max_depth;
    double want[N_REGIONS] = {0}, noise;
    r.settings.w = r.settings.h = SIDE / 2;
    render(&r, lum_method_find("path"), 64);
    add_region_means(&r, 1.0, want);
    r.settings.antialias = false;
    r.settings.w = r.settings.h = SIDE;
    for (size_t m = 0; m < LUM_ARRAY_LEN(names); m++) {
        r.settings.n_vpls = 32;
        double few = error_of(&r, names[m], want, &noise);
        r.settings.n_vpls = 2048;
        double many = error_of(&r, names[m], want, &noise);
        if (!(many < few) || !(many <= 2.0 * noise + 0.033))
            fail_msg("%s, %u segments, %s: off by %.4f with 32, %.4f with 2048, noise %.4f", kind, max_depth, names[m],
                     few, many, noise);
    }
    rig_end(&r);
}

static void virtual_lights_converge_to_path(void **state)
{
    (void)state;
    const struct {
        const char *kind;
        uint32_t max_depth;
    } cases[] = {{"environment", 5}, {"point", 2}, {"quad", 5}, {"point", 5}};
    for (size_t k = 0; k < TEST_EFFORT(LUM_ARRAY_LEN(cases)); k++)
        check_convergence(cases[k].kind, cases[k].max_depth);
}

/* ---- what adds up, and what stands alone ---- */

/* Direct light of lamps without area, also in a mirror: nothing is sampled. */
static void sharp_scene(struct rig *r, int n_bulbs)
{
    struct lum_material_desc mirror = lum_material_default();
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    rig_room(r);
    rig_material(r, "mirror", &mirror);
    rig_object(r, "mirror", "crate", "mirror", rig_v(-0.8, 0.5, -0.9));
    for (int k = 0; k < n_bulbs; k++) {
        char id[16];
        snprintf(id, sizeof id, "bulb%d", k);
        struct lum_light_desc bulb = rig_point(rig_v(-1, 2.2, 0.5), 90.0 / n_bulbs);
        rig_light(r, id, &bulb);
    }
    rig_commit(r);
    r->settings.antialias = false;
    r->settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    r->settings.max_depth = 3;
}

/* Light is linear (NOTES H39): the sum of nine floats rounds to within 9 * 2^-24. Path tracing picks one of them, and
 * goes on with what is left of the number that it picked with: its first bounce alone is the same for one and for nine.
 */
static void one_lamp_equals_nine(void **state)
{
    (void)state;
    struct rig one, nine;
    rig_begin(&one, 0);
    rig_begin(&nine, 0);
    sharp_scene(&one, 1);
    sharp_scene(&nine, 9);
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = 0; m < n; m++) {
        one.settings.max_depth = nine.settings.max_depth = methods[m].progressive ? 1 : 3;
        render(&one, &methods[m], 1);
        render(&nine, &methods[m], 1);
        const struct lum_film *f = lum_view_film(one.view), *g = lum_view_film(nine.view);
        for (uint32_t i = 0; i < f->w * f->h; i++) {
            double x = (double)lum_film_mean(f, i % f->w, i / f->w).g,
                   y = (double)lum_film_mean(g, i % f->w, i / f->w).g;
            if (!(fabs(x - y) <= 1e-5 * x))
                fail_msg("%s: pixel %u is %.9g with one lamp, %.9g with nine of a ninth", methods[m].name, i, x, y);
        }
    }
    rig_end(&one);
    rig_end(&nine);
}

/* Where nothing is interleaved a pixel does not know what picture it is in (NOTES H40): the middle of one of 97 x 65 is
 * that of 33 x 31 with a narrower lens, in tiles of other sizes. Its rays round otherwise, which shows at edges. */
static void a_crop_is_part_of_the_picture(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    sharp_scene(&r, 2);
    const double vfov = r.settings.camera.vfov_deg;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = 0; m < n; m++) {
        r.settings.max_depth = methods[m].progressive ? 1 : 3;
        r.settings.camera.vfov_deg = vfov;
        r.settings.w = 97;
        r.settings.h = 65;
        render(&r, &methods[m], 1);
        struct lum_rgb *whole = rig_picture(&r);
        r.settings.camera.vfov_deg = 360 / PI * atan(tan(vfov * PI / 360) * 31 / 65);
        r.settings.w = 33;
        r.settings.h = 31;
        render(&r, &methods[m], 1);
        uint32_t n_others = 0;
        for (uint32_t y = 0; y < 31; y++)
            for (uint32_t x = 0; x < 33; x++) {
                double want = (double)whole[(y + 17) * 97 + x + 32].g;
                n_others += !(fabs((double)lum_film_mean(lum_view_film(r.view), x, y).g - want) <= 1e-4 * want);
            }
        lum_free(whole);
        if (n_others > 10) /* of 1023, some 100 of them at edges */
            fail_msg("%s: %u pixels are others", methods[m].name, n_others);
    }
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(furnace_in_a_sphere),          cmocka_unit_test(furnace_in_a_cube),
        cmocka_unit_test(furnace_without_direct_light), cmocka_unit_test(glass_in_a_furnace),
        cmocka_unit_test(furnace_of_mirrors),           cmocka_unit_test(virtual_lights_converge_to_path),
        cmocka_unit_test(one_lamp_equals_nine),         cmocka_unit_test(a_crop_is_part_of_the_picture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
