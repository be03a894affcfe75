/* Hard cases of surfaces and light, by every method. Every picture is finite (rig_pass asserts that no sample was
 * dropped and no ray refused). */
#include "tests/support/rig.h"

#include "core/cache/kind.h"
#include "core/cache/weight.h"
#include "tests/support/closed_kind.h"
#include "tests/support/effort.h"

#define LE 0.5
#define PI 3.14159265358979323846

struct hard {
    struct rig r;
    const struct lum_method *method;
};

static void begin(struct hard *h, const struct lum_method *method)
{
    rig_begin(&h->r, 2);
    h->method = h->r.settings.method = method;
    h->r.settings.max_spp = 4;
    h->r.settings.w = h->r.settings.h = 24;
    h->r.settings.antialias = false;
}

/* All passes of a picture in a new view; its mean. */
static double render(struct hard *h)
{
    rig_fresh_view(&h->r);
    while (!rig_pass(&h->r).complete)
        continue;
    return (double)rig_mean(&h->r).g;
}

static double brightest(const struct rig *r)
{
    const struct lum_film *f = lum_view_film(r->view);
    double most = 0.0;
    for (uint32_t i = 0; i < f->w * f->h; i++)
        most = fmax(most, (double)lum_rgb_max(lum_film_mean(f, i % f->w, i / f->w)));
    return most;
}

static void assert_black(struct hard *h, const char *what)
{
    render(h);
    double most = brightest(&h->r);
    if (!(most == 0.0))
        fail_msg("%s, %s: a pixel shows %g", h->method->name, what, most);
}

static struct lum_vec3d point_of(const struct rig *r, uint32_t pixel)
{
    struct lum_pick pick;
    uint32_t w = r->settings.w, h = r->settings.h;
    lum_pick_at(r->snapshot, &r->settings.camera, w, h, pixel % w + 0.5, pixel / w + 0.5, &pick);
    assert_true(pick.hit);
    return pick.point_world;
}

/* ---- thin walls ---- */

/* Two rooms with one wall between them, or a sheet without thickness; the lamp is in one, at x > 0. */
static void put_wall(struct rig *r, double thick)
{
    const double p[] = {0, -1.5, -2, 0, -1.5, 2, 0, 1.5, 2, 0, 1.5, -2};
    const uint32_t i[] = {0, 1, 2, 0, 2, 3};
    if (thick > 0)
        rig_box(r, "wall", thick / 2, 1.5, 2);
    else
        rig_mesh(r, "wall", p, 4, i, 2);
    rig_object(r, "wall", "wall", "white", rig_v(0, 1.5, 0));
    rig_commit(r);
}

static void look(struct rig *r, double side)
{
    rig_camera(r, rig_v(side * 0.2, 1.4, 1.8), rig_v(side * 0.6, 0.2, -1.0), 80);
}

/* How far from the wall anything of the dark room shows light. */
static double farthest_light(const struct rig *r)
{
    const struct lum_film *f = lum_view_film(r->view);
    double far = 0.0;
    for (uint32_t i = 0; i < f->w * f->h; i++)
        if (!lum_rgb_black(lum_film_mean(f, i % f->w, i / f->w)))
            far = fmax(far, fabs(point_of(r, i).x));
    return far;
}

/* Records do not ask who is behind a wall: those of the lit side that are nearer to it than they reach count in what
 * lies beyond, on the floor and the ceiling (as in Ward 1988). So the dark room is black until somebody has looked at
 * the lit one; then as far from the wall as records count. That is the accuracy times a metre (thesis, 6.2.5), or 1.5
 * times what is around them, at most a tenth of the scene of 6.4 m; but at least 8 pixels, of up to 4 m / 96 here, and
 * two more where a quarter of the pixels stand for all. Those of `live` serve as far, but 4 pixels at least, and count
 * twice as far, where the dark room's own serve (weight.h). What gets there is of a strip of that width on one side of
 * the wall. */
static void walls_keep_light_out(struct hard *h)
{
    struct rig *r = &h->r;
    const struct lum_cache_kind *cache = h->method->cache;
    bool in_metres = cache == &lum_cache_instant || cache == &lum_cache_temporal;
    const double accuracy = (double)r->settings.cache_accuracy, pixels = 10.0 * 4.0 * 2.0 * tan(40.0 * PI / 180) / 96;
    const double per_serving = cache == &lum_cache_live ? 1.0 / (double)LUM_TENT_SERVES : 1.0;
    const double reach = !cache ? 0.0 : in_metres ? accuracy : fmax(per_serving * 1.5 * accuracy * 0.64, pixels);
    static const double thick[] = {0.02, 1e-3, 0};
    r->settings.w = r->settings.h = 96;
    r->settings.max_spp = 1;
    rig_room(r);
    RIG_OK(lum_scene_remove(r->scene, LUM_ENTITY_OBJECT, "crate", &err));
    rig_bulb(r, "bulb", rig_v(0.5, 2, 0.3), 100);
    for (size_t k = 0; k < LUM_ARRAY_LEN(thick); k++) {
        put_wall(r, thick[k]);
        look(r, -1);
        assert_black(h, "a room beside a lit one");
        look(r, 1);
        double lit = render(h);
        assert_true(lit > 0.0);
        look(r, -1);
        rig_pass(r);
        double far = farthest_light(r), share = (double)rig_mean(r).g / lit;
        if (!(far <= reach && share <= 0.5 * reach))
            fail_msg("%s: %.4f of the light is behind the wall, up to %.3f m", h->method->name, share, far);
    }
}

/* ---- shading normals (hard case 11) ---- */

/* A floor whose normals lean far over, and a lamp below it, on the side that they lean to: nothing gets through. */
static void leaning_normals(struct hard *h)
{
    struct rig *r = &h->r;
    static const struct lum_light_kind_row *const kinds[] = {&lum_light_kind_point, &lum_light_kind_directional,
                                                             &lum_light_kind_quad, &lum_light_kind_sphere};
    const double p[] = {-2, 0, -2, -2, 0, 2, 2, 0, 2, 2, 0, -2};
    const float n[] = {0.99f, 0.1f, 0, 0.99f, 0.1f, 0, 0.9f, 0.1f, 0.3f, 0.99f, 0.1f, 0};
    const uint32_t i[] = {0, 1, 2, 0, 2, 3};
    struct lum_mesh_desc d = {.positions = p, .normals = n, .indices = i, .n_vertices = 4, .n_triangles = 2};
    struct lum_material_desc coated = lum_material_default();
    coated.roughness = 0.4f;
    RIG_OK(lum_scene_put_mesh(r->scene, "floor", &d, &err));
    rig_material(r, "floor", &coated);
    rig_object(r, "floor", "floor", "floor", rig_v(0, 0, 0));
    rig_camera(r, rig_v(0.5, 1.0, 0.3), rig_v(0, 0, 0), 50);
    for (size_t k = 0; k < LUM_ARRAY_LEN(kinds); k++) {
        struct lum_light_desc l = {.kind = kinds[k],
                                   .position = {3, -0.5, 0},
                                   .direction = {-1, 0.2, 0},
                                   .u = {0, 0.2, 0},
                                   .v = {0, 0, 0.2},
                                   .radius_m = 0.2,
                                   .color = lum_grey(1),
                                   .intensity = 1000,
                                   .on = true};
        rig_light(r, "lamp", &l);
        rig_commit(r);
        assert_black(h, "a lamp behind a floor whose normals lean to it");
    }
}

/* ---- glass in glass, and an eye in it ---- */

static void glass_block(struct rig *r, const char *id, double half, float ior, struct lum_vec3d at)
{
    struct lum_material_desc glass = lum_material_default();
    glass.transmission = 1.0f;
    glass.roughness = 0.0f;
    glass.ior = ior;
    rig_material(r, id, &glass);
    rig_box(r, id, half, half, half);
    rig_object(r, id, id, id, at);
}

/* In a furnace glass does not show. An eye in glass of index n sees n^2 times the light, as far as it gets out at all.
 * Cores lie within the block, across its face, against its face, outside: each face is one between its own glass and
 * air. Lost are branches that carry less than 1 / 512: of those that leave the eye, some dozen at most. */
static void nested_glass(struct hard *h)
{
    struct rig *r = &h->r;
    static const struct lum_vec3d outside = {0.3, 0.4, 1.6},
                                  inside[] = {{0.4, 0.1, 0.4}, {0.1, 0.05, 0.02}, {0, 0, 0.25}};
    static const struct lum_vec3d cores[] = {{0, 0, 0}, {0.4, 0, 0}, {0.25, 0, 0}, {0.75, 0, 0}};
    const double most = 1.5 * 1.5 * 2.0 * 2.0 * 1.01;
    rig_furnace(r, 2, 0.0f, LE);
    glass_block(r, "block", 0.5, 1.5f, rig_v(0, 0, 0));
    r->settings.max_depth = 40;
    r->settings.max_spp = 16;
    r->settings.w = r->settings.h = 12;
    for (size_t c = 0; c < LUM_ARRAY_LEN(cores); c++) {
        glass_block(r, "core", 0.25, 2.0f, cores[c]);
        rig_camera(r, outside, rig_v(-0.1, -0.05, -1), 60);
        rig_commit(r);
        double got = render(h) / LE;
        if (!(fabs(got - 1.0) < 12.0 / 512))
            fail_msg("%s, core %zu: %.6f of what surrounds it", h->method->name, c, got);
        for (size_t k = 0; k < LUM_ARRAY_LEN(inside); k++) {
            rig_camera(r, inside[k], rig_v(-0.1, -0.05, -1), 60);
            render(h);
            if (!(brightest(r) <= most * LE))
                fail_msg("%s, core %zu, eye %zu: %g of what surrounds it", h->method->name, c, k, brightest(r) / LE);
        }
    }
}

/* ---- surfaces that are hard to read ---- */

#define CUT 1e-7 /* m: width of a sliver */
#define N_CUTS 16

/* A square of 4 m, cut at x = 0.1 by slivers. */
static void put_slivers(struct rig *r)
{
    enum { N = N_CUTS + 2 };
    double p[3 * 2 * N];
    uint32_t n = 0, indices[6 * (N - 1)];
    for (uint32_t k = 0; k < N; k++)
        for (uint32_t side = 0; side < 2; side++) {
            const double x = k == 0 ? -2 : k == N - 1 ? 2 : 0.1 + CUT * (k - 1);
            const double at[] = {x, 0, side ? 2 : -2};
            memcpy(p + 3 * (2 * k + side), at, sizeof at);
        }
    for (uint32_t k = 0; k < N - 1; k++) {
        const uint32_t two[] = {2 * k, 2 * k + 1, 2 * k + 3, 2 * k, 2 * k + 3, 2 * k + 2};
        memcpy(indices + n, two, sizeof two);
        n += 6;
    }
    rig_mesh(r, "floor", p, 2 * N, indices, n / 3);
}

/* What a floor is cut into does not show: no ray falls through a crack, none is lost on a sliver, and light has its
 * normal there. The middle column of pixels looks at slivers alone. Points on them are known to within a rounding of
 * 2 m: light that falls off over 1 m differs by 1e-6. Direct light: virtual lights and records begin at other bits, and
 * are others. */
static void slivers(struct hard *h)
{
    struct rig *r = &h->r;
    const double x = 0.1 + 0.5 * CUT * N_CUTS;
    struct lum_material_desc m = rig_diffuse(0.7f);
    rig_material(r, "floor", &m);
    rig_square(r, "floor", 2);
    rig_object(r, "floor", "floor", "floor", rig_v(0, 0, 0));
    rig_bulb(r, "bulb", rig_v(-1, 1, 0.5), 100);
    rig_camera(r, rig_v(x, 2, 0), rig_v(x, 0, 0), 60);
    r->settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    r->settings.w = r->settings.h = 25;
    rig_commit(r);
    assert_true(render(h) > 0.0);
    struct lum_rgb *whole = rig_picture(r);
    put_slivers(r);
    rig_commit(r);
    render(h);
    for (uint32_t y = 0; y < 25; y++) {
        double want = (double)whole[y * 25 + 12].g, got = (double)lum_film_mean(lum_view_film(r->view), 12, y).g;
        if (!(fabs(got - want) <= 1e-5 * want))
            fail_msg("%s: row %u is %.9g on slivers, %.9g without", h->method->name, y, got, want);
    }
    lum_free(whole);
}

/* A lit scene whose floor is yet to come. */
static void around_a_floor(struct rig *r)
{
    rig_box(r, "crate", 0.4, 0.5, 0.4);
    rig_diffuse_object(r, "crate", "red", 0.4f, rig_v(0.5, 0.5, -0.4));
    rig_bulb(r, "bulb", rig_v(-1, 2.2, 0.5), 100);
    rig_camera(r, rig_v(-0.3, 1.4, 2.8), rig_v(0.1, 0.2, -0.2), 50);
}

static void put_floor(struct rig *r, const float uvs[8])
{
    const double p[] = {-2, 0, -2, -2, 0, 2, 2, 0, 2, 2, 0, -2};
    const uint32_t i[] = {0, 1, 2, 0, 2, 3};
    struct lum_mesh_desc d = {.positions = p, .uvs = uvs, .indices = i, .n_vertices = 4, .n_triangles = 2};
    RIG_OK(lum_scene_put_mesh(r->scene, "floor", &d, &err));
    rig_object(r, "floor", "floor", "floor", rig_v(0, 0, 0));
}

static void put_image(struct rig *r, const char *id, const float texels[12])
{
    struct lum_image_desc image = {LUM_TEXEL_RGB32F, 2, 2, texels};
    RIG_OK(lum_scene_put_image(r->scene, id, &image, &err));
}

/* Where uvs span no area a normal map has no direction, and changes no bit: a point, a line, numbers that are none. */
static void degenerate_uvs(struct hard *h)
{
    struct rig *r = &h->r;
    static const float uvs[][8] = {{0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f},
                                   {0, 0, 0.5f, 0.5f, 1, 1, 0.25f, 0.25f},
                                   {NAN, 0, INFINITY, 1, 0, NAN, -INFINITY, 0},
                                   {0, 0, 1e-30f, 0, 1e-30f, 1e-30f, 0, 1e-30f}};
    const float texels[12] = {1, 0.5f, 0.5f, 0, 0, 0, 0.5f, 1, 0.7f, 0.2f, 0.9f, 1};
    put_image(r, "bumps", texels);
    around_a_floor(r);
    for (size_t k = 0; k < LUM_ARRAY_LEN(uvs); k++) {
        struct lum_material_desc m = rig_diffuse(0.7f);
        rig_material(r, "floor", &m);
        put_floor(r, uvs[k]);
        rig_commit(r);
        assert_true(render(h) > 0.0);
        struct lum_rgb *flat = rig_picture(r);
        m.normal_texture.image = "bumps";
        m.normal_scale = 100.0f;
        rig_material(r, "floor", &m);
        rig_commit(r);
        render(h);
        rig_assert_picture(r, flat, h->method->name);
        lum_free(flat);
    }
}

/* Texels that are no numbers are 0, in every kind of texture: the picture is that of texels which say so. */
static void broken_texels(struct hard *h)
{
    struct rig *r = &h->r;
    const float uvs[8] = {0, 0, 0, 2, 2, 2, 2, 0};
    const float broken[12] = {NAN, 1, INFINITY, 0.5f, -INFINITY, 0.25f, 1, NAN, NAN, -1, 0.5f, 1};
    const float mended[12] = {0, 1, 0, 0.5f, 0, 0.25f, 1, 0, 0, 0, 0.5f, 1};
    struct lum_rgb *want = NULL;
    around_a_floor(r);
    for (int k = 0; k < 2; k++) {
        put_image(r, "texels", k == 0 ? mended : broken);
        struct lum_material_desc m = lum_material_default();
        m.base_color_texture.image = m.metallic_roughness_texture.image = m.emission_texture.image =
            m.normal_texture.image = "texels";
        m.emission_cd_m2 = 3;
        rig_material(r, "floor", &m);
        put_floor(r, uvs);
        struct lum_light_desc sky = {.kind = &lum_light_kind_environment,
                                     .color = lum_grey(1),
                                     .intensity = 3,
                                     .image = "texels",
                                     .on = true,
                                     .camera_visible = true};
        rig_light(r, "sky", &sky);
        rig_commit(r);
        assert_true(render(h) > 0.0);
        if (k == 0)
            want = rig_picture(r);
        else
            rig_assert_picture(r, want, h->method->name);
    }
    assert_int_equal(lum_scene_dropped_texels(r->scene), 5);
    lum_free(want);
}

/* ---- numbers that are none (hard case 42) ---- */

/* All samples that are there. */
static void fill_film(struct rig *r, double value)
{
    const struct lum_film *f = lum_view_film(r->view);
    for (uint32_t half = 0; half < 2; half++)
        for (uint32_t i = 0; i < 3 * f->w * f->h; i++)
            if (f->n[half][i / 3] > 0)
                f->half[half][i] = value;
}

static void dim(struct hard *h, double cd)
{
    rig_bulb(&h->r, "bulb", rig_v(-1, 2.2, 0.5), cd);
    rig_commit(&h->r);
    while (!rig_pass(&h->r).complete)
        continue;
}

/* Whatever was in a frame that is no number, none of it is in the next, bit for bit, and nothing is dropped there: of
 * records, which are counted and black; and of all samples of the picture. */
static void broken_history(struct hard *h)
{
    struct rig *r = &h->r;
    struct lum_pass_stats stats;
    rig_room(r);
    rig_bulb(r, "bulb", rig_v(-1, 2.2, 0.5), 100);
    rig_commit(r);
    assert_true(render(h) > 0.0);
    struct lum_rgb *want = rig_picture(r);
    rig_fresh_view(r);
    r->settings.method = &closed_methods[CLOSED_BROKEN];
    RIG_OK(lum_view_pass(r->view, r->snapshot, &r->settings, NULL, &stats, &err));
    assert_true(stats.nonfinite > 0);
    r->settings.method = h->method;
    while (!rig_pass(r).complete)
        continue;
    rig_assert_picture(r, want, h->method->name);
    fill_film(r, NAN);
    dim(h, 50);
    fill_film(r, INFINITY);
    dim(h, 100);
    rig_assert_picture(r, want, h->method->name);
    lum_free(want);
}

/* ---- lights 1e9 apart ---- */

/* Two closed rooms, a lamp in each, that of the other room up to 1e9 times as bright: this one looks as before. Half of
 * all choices are among all lights alike (core/scene/lights.c), so that half as many samples are as noisy as
 * sqrt 2 says: means of SEEDS pictures differ by four standard errors at most. */
static void lights_far_apart(struct hard *h)
{
    enum { SEEDS = 8 };
    struct rig *r = &h->r;
    struct lum_material_desc white = rig_diffuse(0.7f);
    static const double bright[] = {0, 100, 1e5, 1e11};
    double mean[LUM_ARRAY_LEN(bright)] = {0}, square[LUM_ARRAY_LEN(bright)] = {0};
    rig_material(r, "white", &white);
    rig_box(r, "room", 2, 1.5, 2);
    rig_object(r, "one", "room", "white", rig_v(0, 1.5, 0));
    rig_object(r, "two", "room", "white", rig_v(4.1, 1.5, 0));
    rig_bulb(r, "dim", rig_v(0, 2, 0), 100);
    rig_camera(r, rig_v(-0.3, 1.4, 1.8), rig_v(0.2, 0.9, -0.5), 60);
    for (size_t k = 0; k < LUM_ARRAY_LEN(bright); k++) {
        if (bright[k] > 0)
            rig_bulb(r, "bright", rig_v(4.1, 2, 0), bright[k]);
        rig_commit(r);
        for (r->settings.seed = 0; r->settings.seed < SEEDS; r->settings.seed++) {
            double got = render(h);
            mean[k] += got / SEEDS;
            square[k] += got * got / SEEDS;
        }
        double variance = (square[k] - mean[k] * mean[k] + square[0] - mean[0] * mean[0]) / (SEEDS - 1);
        if (!(fabs(mean[k] - mean[0]) <= 4.0 * sqrt(fmax(variance, 0.0)) + 1e-6 * mean[0]))
            fail_msg("%s: %g beside a lamp of %g cd, %g alone", h->method->name, mean[k], bright[k], mean[0]);
    }
}

/* ---- denormals (hard case 35) ---- */

/* Sum of a denormal float and its double: 0 where denormals are zero, at the way in and at the way out. */
static void note_denormals(void *ctx, uint32_t job, uint32_t worker)
{
    volatile float least = 0x1p-126f, half = 0.5f, denormal = 0x1p-130f, big = 0x1p100f;
    float *sum = ctx;
    (void)worker;
    sum[job] = least * half + denormal * big;
}

static void denormals_are_zero_on_every_thread(void **state)
{
    (void)state;
    struct rig r;
    float sum[64];
    rig_begin(&r, 5);
    for (uint32_t i = 0; i < LUM_ARRAY_LEN(sum); i++)
        sum[i] = 1.0f;
    assert_int_equal(lum_pool_run(r.pool, LUM_ARRAY_LEN(sum), note_denormals, sum, NULL), LUM_OK);
    for (uint32_t i = 0; i < LUM_ARRAY_LEN(sum); i++)
        assert_true(sum[i] == 0.0f);
    rig_end(&r);
}

/* A room of 4 m times `scale`. */
static double tiny_room(struct hard *h, double scale)
{
    struct rig *r = &h->r;
    struct lum_material_desc white = rig_diffuse(0.75f);
    struct lum_light_desc lamp =
        rig_quad(rig_v(0, 2.9 * scale, 0), rig_v(0.5 * scale, 0, 0), rig_v(0, 0, 0.5 * scale), 100);
    rig_material(r, "white", &white);
    rig_box(r, "room", 2 * scale, 1.5 * scale, 2 * scale);
    rig_box(r, "crate", 0.4 * scale, 0.5 * scale, 0.4 * scale);
    rig_object(r, "room", "room", "white", rig_v(0, 1.5 * scale, 0));
    rig_object(r, "crate", "crate", "white", rig_v(0.5 * scale, 0.5 * scale, -0.4 * scale));
    rig_light(r, "lamp", &lamp);
    rig_camera(r, rig_v(-0.3 * scale, 1.4 * scale, 1.8 * scale), rig_v(0.2 * scale, 0.9 * scale, -0.5 * scale), 60);
    rig_commit(r);
    return render(h);
}

/* Down to 2^-36 m a scene is enlarged by a power of two: no bit changes (methods that count in metres: NOTES R2, R3). A
 * millionth of that and less is finite; of lengths that float cannot square it may be black. */
static void tiny_rooms(struct hard *h)
{
    const struct lum_cache_kind *cache = h->method->cache;
    double want = tiny_room(h, 1), got = tiny_room(h, 0x1p-32);
    if (cache != &lum_cache_instant && cache != &lum_cache_temporal && want != got)
        fail_msg("%s: %.9g in a room of 4 m, %.9g in one of 1 nm", h->method->name, want, got);
    for (double scale = 1e-12; scale > 1e-31; scale *= 1e-3)
        assert_true(tiny_room(h, scale) <= 2.0 * want);
}

/* ---- all of them, with every method ---- */

static struct hard_case {
    const char *name;
    void (*check)(struct hard *);
} cases[] = {
    {"thin_walls_keep_light_out", walls_keep_light_out},
    {"no_light_from_behind_leaning_normals", leaning_normals},
    {"glass_in_glass_and_eyes_in_it", nested_glass},
    {"slivers_do_not_show", slivers},
    {"normal_maps_on_degenerate_uvs", degenerate_uvs},
    {"texels_that_are_no_numbers", broken_texels},
    {"frames_that_are_no_numbers_leave_no_trace", broken_history},
    {"lights_1e9_apart", lights_far_apart},
    {"rooms_of_a_nanometre_and_less", tiny_rooms},
};

static void with_every_method(void **state)
{
    const struct hard_case *c = *state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = 0; m < n; m++) {
        if (!TEST_TAKES(m, (size_t)(c - cases)))
            continue;
        struct hard h = {0};
        begin(&h, &methods[m]);
        c->check(&h);
        rig_end(&h.r);
    }
}

int main(void)
{
    struct CMUnitTest tests[LUM_ARRAY_LEN(cases) + 1] = {[LUM_ARRAY_LEN(cases)] =
                                                             cmocka_unit_test(denormals_are_zero_on_every_thread)};
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++)
        tests[i] = (struct CMUnitTest){cases[i].name, with_every_method, NULL, NULL, &cases[i]};
    return cmocka_run_group_tests_name("numeric.hard_cases", tests, NULL, NULL);
}
