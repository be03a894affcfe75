/* Guided paths: the histogram is a density and samples follow it, what is guided has the mean of what is not and less
 * noise, and pictures do not depend on the number of threads, on cut passes, or on memory that is short. */
#include "core/path/guide.h"
#include "core/scene/surface.h"
#include "tests/numeric/stats.h"
#include "tests/support/cut_short.h"
#include "tests/support/effort.h"

enum { SEEDS = TEST_TELLS ? 6 : 2, SPP = 16, WIDTH = 96, HEIGHT = 72 };

/* ---- a cell ---- */

/* A few bright bins, many dim ones, and none at all on one face. */
static struct lum_path_guide_cell some_cell(void)
{
    struct lum_path_guide_cell c = {.share = 0.5f};
    double mass[LUM_PATH_GUIDE_BINS], all = 0.0, below = 0.0;
    for (uint32_t b = 0; b < LUM_PATH_GUIDE_BINS; b++)
        all += mass[b] = b / 64 == 3 ? 0.0 : b % 37 == 5 ? 60.0 : 1.0 + b % 7;
    for (uint32_t b = 0; b < LUM_PATH_GUIDE_BINS; b++) {
        below += mass[b];
        c.bins[b] = c.rows[b / LUM_PATH_GUIDE_SIDE] = (uint16_t)(below / all * 65535.0 + 0.5);
    }
    return c;
}

static double mass_of(const struct lum_path_guide_cell *c, uint32_t bin)
{
    return (c->bins[bin] - (bin > 0 ? c->bins[bin - 1] : 0)) / 65535.0;
}

static struct lum_vec2 even(struct rng *rng)
{
    return (struct lum_vec2){(float)(rng_u64(rng) >> 40) * 0x1p-24f, (float)(rng_u64(rng) >> 40) * 0x1p-24f};
}

static struct lum_vec3 even_direction(struct rng *rng)
{
    double z = 2.0 * rng_unit(rng) - 1.0, phi = 2.0 * LUM_PI_D * rng_unit(rng), r = sqrt(1.0 - z * z);
    return lum_v3((float)(r * cos(phi)), (float)(r * sin(phi)), (float)z);
}

/* Over even directions the mean of a density is 1 / (4 pi), and that of its part in a bin the bin's mass of it. */
static void density_is_one(void **state)
{
    (void)state;
    struct lum_path_guide_cell c = some_cell();
    struct rng rng = {1};
    struct mean one = {0};
    static double part[LUM_PATH_GUIDE_BINS], square[LUM_PATH_GUIDE_BINS];
    const int n = 2000000;
    for (int i = 0; i < n; i++) {
        uint32_t bin;
        double pdf = 4.0 * LUM_PI_D * (double)lum_path_guide_pdf(&c, even_direction(&rng), &bin);
        mean_add(&one, pdf);
        part[bin] += pdf / n;
        square[bin] += pdf * pdf / n;
    }
    if (!(fabs(one.mean - 1.0) < 5.0 * mean_stderr(&one)))
        fail_msg("the density integrates to %.5f +- %.5f", one.mean, mean_stderr(&one));
    for (uint32_t b = 0; b < LUM_PATH_GUIDE_BINS; b++) {
        double error = sqrt(square[b] / n);
        if (!(fabs(part[b] - mass_of(&c, b)) <= 5.0 * error))
            fail_msg("bin %u: %g instead of %g +- %g", b, part[b], mass_of(&c, b), error);
    }
}

static void samples_follow(void **state)
{
    (void)state;
    struct lum_path_guide_cell c = some_cell();
    struct rng rng = {2};
    struct chi2_cell cells[LUM_PATH_GUIDE_BINS];
    const int n = 500000;
    int elsewhere = 0;
    for (uint32_t b = 0; b < LUM_PATH_GUIDE_BINS; b++)
        cells[b] = (struct chi2_cell){.expected = n * mass_of(&c, b)};
    for (int i = 0; i < n; i++) {
        uint32_t bin, again;
        float pdf;
        struct lum_vec3 d = lum_path_guide_sample(&c, even(&rng), &bin, &pdf);
        float same = lum_path_guide_pdf(&c, d, &again);
        cells[bin].observed += 1.0;
        assert_true(fabsf(lum_length(d) - 1.0f) < 1e-6f);
        if (again != bin) /* rounded over an edge */
            elsewhere++;
        else if (!(fabsf(same - pdf) <= 1e-5f * pdf))
            fail_msg("density %g when sampled, %g when asked for", (double)pdf, (double)same);
    }
    /* An edge has a width of some 2^-23, bins one of 2^-2. */
    assert_true(elsewhere < n / 10000);
    for (uint32_t b = 3 * 64; b < 4 * 64; b++)
        assert_true(cells[b].observed == 0.0);
    double p = chi2_p_value(cells, LUM_PATH_GUIDE_BINS);
    if (!(p > 1e-6))
        fail_msg("samples do not follow the density: p = %g", p);
    const struct lum_vec2 ends[] = {{0, 0}, {0x1.fffffep-1f, 0x1.fffffep-1f}, {0, 0x1.fffffep-1f}, {0x1.fffffep-1f, 0}};
    for (int i = 0; i < 4; i++) {
        uint32_t bin;
        float pdf;
        struct lum_vec3 d = lum_path_guide_sample(&c, ends[i], &bin, &pdf);
        assert_true(bin < LUM_PATH_GUIDE_BINS && pdf > 0.0f && isfinite(pdf) && lum_v3_finite(d));
    }
}

/* Mixed with a surface: what it reflects in all is what it reflects unguided, and the density that light sampling is
 * told is that of the sample. */
static void surface_reflects_the_same(const struct lum_material_desc *desc)
{
    struct rig r;
    rig_begin(&r, 1);
    rig_square(&r, "floor", 1.0);
    rig_material(&r, "floor", desc);
    rig_object(&r, "floor", "floor", "floor", rig_v(0, 0, 0));
    rig_commit(&r);
    struct lum_vec3 n = {0, 1, 0}, wo = lum_normalize(lum_v3(0.5f, 0.6f, -0.2f));
    struct lum_surface s = {.ng = n, .ns = n, .light = LUM_NO_OBJECT, .vertex_color = lum_grey(1)};
    struct lum_bsdf b;
    lum_bsdf_init(&b, &r.snapshot->materials[0], &s, wo);
    struct lum_path_guide_cell c = some_cell();
    const struct lum_path_guide_locate none = {0}, place = {&c, 0, c.share * b.diffuse_prob};
    struct mean guided = {0}, unguided = {0};
    struct rng rng = {3};
    for (int i = 0; i < TEST_EFFORT(400000); i++) {
        struct lum_path_guide_step step;
        struct lum_vec2 u = even(&rng);
        float u_lobe = even(&rng).x, pdf;
        bool goes_on = lum_path_guide_bsdf_sample(&none, &b, wo, u, u_lobe, &step);
        mean_add(&unguided, goes_on ? (double)step.s.weight.g : 0.0);
        goes_on = lum_path_guide_bsdf_sample(&place, &b, wo, u, u_lobe, &step);
        mean_add(&guided, goes_on ? (double)step.s.weight.g : 0.0);
        if (!goes_on || !(step.s.pdf_sa > 0.0f))
            continue;
        struct lum_rgb f = lum_bsdf_eval(&b, wo, step.s.wi, &pdf);
        float mixed = lum_path_guide_bsdf_pdf(&place, &b, step.s.wi, pdf);
        uint32_t bin;
        lum_path_guide_pdf(&c, step.s.wi, &bin);
        if (step.cosine > 0.0f && bin == step.bin && !(fabsf(mixed - step.s.pdf_sa) <= 1e-4f * mixed))
            fail_msg("density %g when sampled, %g when asked for", (double)step.s.pdf_sa, (double)mixed);
        if (!(fabsf(step.s.weight.g * step.s.pdf_sa - f.g) <= 1e-4f * f.g))
            fail_msg("weight %g times density %g is not %g", (double)step.s.weight.g, (double)step.s.pdf_sa,
                     (double)f.g);
    }
    double error = hypot(mean_stderr(&guided), mean_stderr(&unguided));
    if (!(fabs(guided.mean - unguided.mean) <= 5.0 * error))
        fail_msg("reflects %.5f guided, %.5f unguided, +- %.5f", guided.mean, unguided.mean, error);
    rig_end(&r);
}

static void surfaces_reflect_the_same(void **state)
{
    (void)state;
    struct lum_material_desc matte = rig_diffuse(0.8f), coated = lum_material_default(), polished = coated;
    coated.roughness = 0.4f;
    polished.roughness = 0.0f;
    surface_reflects_the_same(&matte);
    surface_reflects_the_same(&coated);
    surface_reflects_the_same(&polished);
}

/* ---- pictures ---- */

static void spot_light(struct rig *r, const char *id, struct lum_vec3d at, struct lum_vec3d to, double cd)
{
    struct lum_light_desc l = {.kind = &lum_light_kind_spot,
                               .position = at,
                               .direction = rig_v(to.x - at.x, to.y - at.y, to.z - at.z),
                               .color = lum_grey(1),
                               .intensity = cd,
                               .inner_cone_rad = 0.08,
                               .outer_cone_rad = 0.14,
                               .on = true};
    rig_light(r, id, &l);
}

/* Lit by a patch on the wall behind the eye alone. */
static void patch_room(struct rig *r, uint32_t threads)
{
    rig_begin(r, threads);
    rig_room(r);
    spot_light(r, "sun", rig_v(-1.5, 2.8, -1.5), rig_v(-1.9, 0.8, 1.5), 3000);
    rig_commit(r);
    r->settings.method = lum_method_find("path");
    r->settings.max_spp = 0;
}

/* The same behind a pane of glass, and with a lamp that shines at the ceiling. */
static void pane_room(struct rig *r, uint32_t threads)
{
    patch_room(r, threads);
    struct lum_material_desc glass = lum_material_default();
    glass.transmission = 1.0f;
    glass.roughness = 0.0f;
    glass.thin = true;
    rig_material(r, "glass", &glass);
    rig_box(r, "pane", 1.9, 1.4, 0.01);
    rig_object(r, "pane", "pane", "glass", rig_v(0, 1.5, 1.2));
    rig_camera(r, rig_v(-0.3, 1.4, 1.0), rig_v(0.2, 0.9, -0.5), 60);
    struct lum_light_desc up = rig_quad(rig_v(1.2, 2.2, 1.5), rig_v(0, 0, 0.3), rig_v(0.3, 0, 0), 2000);
    rig_light(r, "uplight", &up);
    rig_commit(r);
}

/* The same room, all of it glossy, and a lamp that every surface can find by itself. */
static void gloss_room(struct rig *r, uint32_t threads)
{
    patch_room(r, threads);
    struct lum_material_desc coated = lum_material_default(), crate = lum_material_default();
    coated.base_color = lum_grey(0.7f);
    coated.roughness = 0.45f;
    crate.metallic = 1.0f;
    crate.roughness = 0.3f;
    rig_material(r, "white", &coated);
    rig_material(r, "red", &crate);
    struct lum_light_desc lamp = rig_quad(rig_v(0.5, 2.7, -1), rig_v(0.8, 0, 0), rig_v(0, 0, 0.8), 60);
    rig_light(r, "lamp", &lamp);
    rig_commit(r);
}

/* Gloss over all of it, and no direct light: which lobe a path goes on by decides which lights it may find. */
static void coated_room(struct rig *r, uint32_t threads)
{
    patch_room(r, threads);
    struct lum_material_desc coated = lum_material_default();
    coated.base_color = lum_grey(0.4f);
    coated.roughness = 0.5f;
    coated.specular = 1.0f;
    coated.ior = 2.0f;
    rig_material(r, "white", &coated);
    rig_material(r, "red", &coated);
    rig_commit(r);
    r->settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_DIRECT);
}

/* A new view's samples. Without memory when the second begins it stays unguided. */
static void take(struct rig *r, uint32_t seed, bool guided)
{
    r->settings.seed = seed;
    rig_fresh_view(r);
    for (uint32_t i = 0; i < SPP; i++) {
        lum_alloc_fail_after(i == 1 && !guided ? 1 : 0);
        rig_pass(r);
        lum_alloc_fail_after(0);
    }
}

struct noise {
    struct mean means; /* of pictures */
    double deviation;  /* of pixels over their mean, mean: of squares single outliers would decide */
};

static struct noise noise_of(struct rig *r, bool guided)
{
    uint32_t w = r->settings.w, n = w * r->settings.h;
    struct mean *pixel = lum_calloc(n, sizeof *pixel);
    assert_non_null(pixel);
    struct noise noise = {0};
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        take(r, 2 * seed + guided, guided);
        mean_add(&noise.means, (double)lum_luminance(rig_mean(r)));
        for (uint32_t i = 0; i < n; i++)
            mean_add(&pixel[i], (double)lum_luminance(lum_film_mean(lum_view_film(r->view), i % w, i / w)));
    }
    for (uint32_t i = 0; i < n; i++)
        noise.deviation += sqrt(pixel[i].m2 / (SEEDS - 1)) / (pixel[i].mean + 1e-2) / n;
    lum_free(pixel);
    return noise;
}

/* Independent pictures of both kinds: their means differ by less than 4 standard errors, which these pictures
 * themselves tell: of SEEDS each, by Student's t with 10 degrees of freedom, once in 400 draws, and these are fixed.
 * most: what guiding leaves of the deviation. */
static void compare(const char *name, void (*room)(struct rig *, uint32_t), double most)
{
    struct rig r;
    room(&r, 2);
    r.settings.w = WIDTH;
    r.settings.h = HEIGHT;
    struct noise with = noise_of(&r, true), without = noise_of(&r, false);
    double error = hypot(mean_stderr(&with.means), mean_stderr(&without.means));
    print_message("%s: guided %.4f, unguided %.4f +- %.4f cd/m2; deviation %.3f, %.3f\n", name, with.means.mean,
                  without.means.mean, error, with.deviation, without.deviation);
    if (TEST_TELLS && !(fabs(with.means.mean - without.means.mean) < 4.0 * error))
        fail_msg("%s: guiding changes the mean", name);
    if (TEST_TELLS && !(with.deviation < most * without.deviation))
        fail_msg("%s: guiding leaves more than %g of the noise", name, most);
    rig_end(&r);
}

static void same_mean_less_noise(void **state)
{
    (void)state;
    compare("sunlit patch", patch_room, 0.95);
    compare("behind a pane", pane_room, 1.05); /* lamps are picked by place as well as guiding finds them */
    compare("gloss", gloss_room, 1.05);
}

/* Guided, it was 4.5 % too bright. */
static void unguided_where_lights_are_left_out(void **state)
{
    (void)state;
    struct rig r;
    coated_room(&r, 2);
    take(&r, 5, false);
    struct lum_rgb *unguided = rig_picture(&r);
    take(&r, 5, true);
    rig_assert_picture(&r, unguided, "without direct light");
    lum_free(unguided);
    rig_end(&r);
}

/* Also: guiding is not something that never happens. */
static void any_number_of_threads(void **state)
{
    (void)state;
    struct lum_rgb *one = NULL;
    for (uint32_t threads = 1; threads <= 3; threads++) {
        struct rig r;
        gloss_room(&r, threads);
        take(&r, 5, true);
        if (one)
            rig_assert_picture(&r, one, threads == 2 ? "2 threads" : "3 threads");
        else
            one = rig_picture(&r);
        rig_end(&r);
    }
    struct rig r;
    gloss_room(&r, 2);
    take(&r, 5, false);
    struct lum_rgb *unguided = rig_picture(&r);
    assert_true(memcmp(one, unguided, (size_t)r.settings.w * r.settings.h * sizeof *one) != 0);
    lum_free(unguided);
    lum_free(one);
    rig_end(&r);
}

/* Wherever a pass is cut, the picture is the same. */
static void cuts(void **state)
{
    (void)state;
    struct rig r;
    patch_room(&r, 2);
    take(&r, 7, true);
    struct lum_rgb *guided = rig_picture(&r);
    for (uint32_t pass = 1; pass < 5; pass++)
        for (uint32_t jobs = 1; jobs < 6; jobs += 2) {
            rig_fresh_view(&r);
            struct lum_pass_stats stats;
            uint32_t left;
            for (uint32_t i = 0; i < pass; i++)
                rig_pass(&r);
            for (uint32_t loop = 1; loop < 4; loop++)
                pass_is_cut_short(&r, loop, jobs, &stats, &left);
            while (stats.spp < SPP)
                stats = rig_pass(&r);
            rig_assert_picture(&r, guided, "after a pass that was cut short");
        }
    lum_free(guided);
    rig_end(&r);
}

/* Where the guide, its nodes, or its first cells find no memory, paths go unguided; where later cells do not, there are
 * fewer. */
static void short_memory(void **state)
{
    (void)state;
    struct rig r;
    patch_room(&r, 2);
    take(&r, 7, false);
    struct lum_rgb *unguided = rig_picture(&r);
    double mean = (double)lum_luminance(rig_mean(&r));
    for (uint32_t pass = 1; pass < SPP; pass = pass < 3 ? pass + 1 : 2 * pass - 1)
        for (uint64_t k = 1; k < 4; k++) {
            rig_fresh_view(&r);
            for (uint32_t i = 0; i < SPP; i++) {
                lum_alloc_fail_after(i == pass ? k : 0);
                rig_pass(&r);
                lum_alloc_fail_after(0);
            }
            if (pass == 1)
                rig_assert_picture(&r, unguided, "without memory");
            /* 10 %: five times what pictures of these samples differ by (same_mean_less_noise) */
            assert_true(fabs((double)lum_luminance(rig_mean(&r)) / mean - 1.0) < 0.1);
        }
    lum_free(unguided);
    rig_end(&r);
}

/* What was learned of a scene is forgotten with it. */
static void edits_forget(void **state)
{
    (void)state;
    struct rig r;
    patch_room(&r, 2);
    take(&r, 9, true);
    spot_light(&r, "sun", rig_v(1.5, 2.8, -1.5), rig_v(1.9, 0.8, 1.5), 2000);
    rig_commit(&r);
    for (uint32_t i = 0; i < SPP; i++)
        rig_pass(&r);
    struct lum_rgb *edited = rig_picture(&r);
    take(&r, 9, true);
    rig_assert_picture(&r, edited, "by a new view");
    lum_free(edited);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(density_is_one),
        cmocka_unit_test(samples_follow),
        cmocka_unit_test(surfaces_reflect_the_same),
        cmocka_unit_test(same_mean_less_noise),
        cmocka_unit_test(unguided_where_lights_are_left_out),
        cmocka_unit_test(any_number_of_threads),
        cmocka_unit_test(cuts),
        cmocka_unit_test(short_memory),
        cmocka_unit_test(edits_forget),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
