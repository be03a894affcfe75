/* Brushed surfaces: their facets against closed forms, their table against quadrature, tangents of meshes, and what
 * methods show of them. */
#include <string.h>

#include "core/material/brushed.h"
#include "core/scene/parts.h"
#include "core/scene/surface.h"
#include "core/accel/trace.h"
#include "tests/numeric/reading.h"

static struct lum_vec3 direction(double cos_theta, double phi)
{
    double s = sqrt(fmax(0.0, 1.0 - cos_theta * cos_theta));
    return lum_v3((float)(s * cos(phi)), (float)(s * sin(phi)), (float)cos_theta);
}

/* ---- facets ---- */

/* Alike both ways they are those of ggx.h; and a quarter turn swaps the two. */
static void alike_both_ways_is_isotropic(void **state)
{
    (void)state;
    static const float alphas[] = {LUM_ALPHA_MIN, 0.03f, 0.3f, 1.0f};
    for (size_t k = 0; k < LUM_ARRAY_LEN(alphas); k++)
        for (double c = 0.01; c < 1.0; c += 0.07)
            for (double phi = 0.1; phi < 6.0; phi += 0.7) {
                float a = alphas[k], tiny = 1e-5f;
                struct lum_vec2 both = {a, a}, wide = {0.8f, a}, high = {a, 0.8f};
                struct lum_vec3 w = direction(c, phi), i = direction(0.6, 2.0), turned = lum_v3(-w.y, w.x, w.z);
                assert_true(fabsf(lum_brushed_d(w, both) / lum_ggx_d(w, a) - 1.0f) < tiny);
                float g1 = lum_ggx_g1_over_cos(w.z, a), g2 = lum_ggx_g2_over_cos(w.z, i.z, a);
                assert_true(fabsf(lum_brushed_g1_over_cos(w, both) / g1 - 1.0f) < tiny);
                assert_true(fabsf(lum_brushed_g2_over_cos(w, i, both) / g2 - 1.0f) < tiny);
                assert_true(fabsf(lum_brushed_d(w, wide) / lum_brushed_d(turned, high) - 1.0f) < tiny);
                assert_true(fabsf(lum_brushed_s(w, wide) / lum_brushed_s(turned, high) - 1.0f) < tiny);
            }
}

/* Integral over the hemisphere of D cos = 1. With slopes tan(h) = r (ax cos p, ay sin p) and x = r^2 / (1 + r^2) it is
 * dx dp / 2 pi: what is summed is D over that. */
static void facets_cover_the_surface(void **state)
{
    (void)state;
    static const struct lum_vec2 alphas[] = {{1.0f, LUM_ALPHA_MIN}, {0.7f, 0.1f}, {0.3f, 0.25f}};
    enum { N = 200 };
    for (size_t k = 0; k < LUM_ARRAY_LEN(alphas); k++) {
        double ax = (double)alphas[k].x, ay = (double)alphas[k].y, sum = 0.0;
        for (int i = 0; i < N * N; i++) {
            double x = (i / N + 0.5) / N, p = (i % N + 0.5) / N * 2.0 * PI, r = sqrt(x / (1.0 - x));
            double sx = r * ax * cos(p), sy = r * ay * sin(p), c = 1.0 / sqrt(1.0 + sx * sx + sy * sy);
            struct lum_vec3 h = lum_v3((float)(sx * c), (float)(sy * c), (float)c);
            /* dw = cos^3 dsx dsy, dsx dsy = ax ay r dr dp, r dr = dx / 2 (1 - x)^2 */
            double dw = c * c * c * ax * ay / (2.0 * (1.0 - x) * (1.0 - x));
            sum += (double)lum_brushed_d(h, alphas[k]) * c * dw * 2.0 * PI / (N * N);
        }
        assert_true(fabs(sum - 1.0) < 1e-4);
    }
}

/* Albedo for F = 1 by a grid of directions in double, apart from how facets are sampled: dense about the mirror's. */
static double albedo_by_quadrature(struct lum_vec3 o, struct lum_vec2 alpha)
{
    enum { N = 400 };
    double sum = 0.0, ax = (double)alpha.x, ay = (double)alpha.y;
    for (int k = 0; k < N * N; k++) { /* over facets, by slopes as above */
        double x = (k / N + 0.5) / N, p = (k % N + 0.5) / N * 2.0 * PI, r = sqrt(x / (1.0 - x));
        double sx = r * ax * cos(p), sy = r * ay * sin(p), c = 1.0 / sqrt(1.0 + sx * sx + sy * sy);
        struct lum_vec3 h = lum_v3((float)(sx * c), (float)(sy * c), (float)c);
        float oh = lum_dot(o, h);
        struct lum_vec3 i = lum_v3_sub(lum_v3_mul(h, 2.0f * oh), o);
        if (!(oh > 0.0f && i.z > 0.0f))
            continue;
        /* f cos_i dwi, dwi = 4 o.h dwh, D cos_h dwh = 1 / N^2 */
        sum += (double)(lum_brushed_g2_over_cos(o, i, alpha) * i.z * oh) / c / (N * N);
    }
    return sum;
}

static void the_table_is_the_albedo(void **state)
{
    (void)state;
    double worst = 0.0, total = 0.0;
    uint32_t n = 0;
    for (float strength = 0.2f; strength <= 1.0f; strength += 0.4f)
        for (int textured = 0; textured < 4; textured++) /* what is left to textures */
            for (float alpha = 0.02f; alpha < 1.0f; alpha *= TEST_TELLS ? 3.1f : 10.0f) {
                float of = textured & 2 ? -1.0f : strength, across = textured & 1 ? -1.0f : alpha;
                struct lum_brushed_table *t = lum_brushed_table_create(of, across);
                assert_non_null(t);
                assert_true(lum_brushed_table_serves(t, of, across) && !lum_brushed_table_serves(t, 0.9f, across));
                struct lum_vec2 spread = {lum_brushed_along(alpha, strength), alpha};
                struct lum_brushed_row row = lum_brushed_row(t, strength, alpha);
                for (double c = 0.06; c <= 1.0; c += 0.234)
                    for (double phi = 0.05; phi < 1.6; phi += 0.3) {
                        struct lum_vec3 o = direction(c, phi);
                        struct lum_ggx_albedo e = lum_brushed_albedo(t, &row, o);
                        double off = fabs((double)(e.scale + e.bias) - albedo_by_quadrature(o, spread));
                        worst = fmax(worst, off), total += off, n++;
                    }
                lum_brushed_table_unref(t);
            }
    print_message("the table is off by up to %.4f, on average %.4f\n", worst, total / n);
    assert_true(worst < 0.02);
    assert_true(!TEST_TELLS || total / n < 0.004);
}

/* Smooth across, it is no mirror; unless the stretch is below what counts as rough. */
static void what_is_brushed_is_no_mirror(void **state)
{
    (void)state;
    struct lum_brushed_table *t = lum_brushed_table_create(0.5f, 0.0f);
    assert_non_null(t);
    struct lum_material m = {.base_color = {1, 1, 1}, .metallic = 1.0f, .ior = 1.5f, .specular = 1.0f, .brushed = t};
    m.anisotropy = 0.5f;
    assert_false(lum_material_is_specular(&m));
    assert_true(lum_material_scatter(&m) == LUM_SCATTER_GLOSS);
    m.anisotropy = 0.02f;
    assert_true(lum_material_is_specular(&m));
    assert_true(lum_material_scatter(&m) == LUM_SCATTER_MIRROR);
    lum_brushed_table_unref(t);
}

/* ---- tangents ---- */

enum { AROUND = 12 };

/* A ring in the plane y = 0 whose u runs about its middle. */
static void put_ring(struct rig *r, const char *id)
{
    float p[6 * (AROUND + 1)], n[6 * (AROUND + 1)], uv[4 * (AROUND + 1)];
    uint32_t index[6 * AROUND];
    for (int k = 0; k <= AROUND; k++)
        for (int j = 0; j < 2; j++) {
            double a = 2.0 * PI * k / AROUND, radius = j ? 0.5 : 0.2;
            float *q = p + 6 * k + 3 * j;
            q[0] = (float)(radius * cos(a)), q[1] = 0.0f, q[2] = (float)(radius * sin(a));
            memcpy(n + 6 * k + 3 * j, (float[]){0.0f, 1.0f, 0.0f}, 3 * sizeof *n);
            uv[4 * k + 2 * j] = (float)k / AROUND, uv[4 * k + 2 * j + 1] = (float)j;
        }
    for (uint32_t k = 0; k < AROUND; k++) {
        const uint32_t a = 2 * k, quad[6] = {a, a + 2, a + 1, a + 1, a + 2, a + 3};
        memcpy(index + 6 * k, quad, sizeof quad);
    }
    struct lum_mesh_desc d = {.positions_f = p,
                              .normals = n,
                              .uvs = uv,
                              .indices = index,
                              .n_vertices = 2 * (AROUND + 1),
                              .n_triangles = 2 * AROUND};
    RIG_OK(lum_scene_put_mesh(r->scene, id, &d, &err));
}

static struct lum_surface surface_at(const struct rig *r, uint32_t prim, float u, float v)
{
    struct lum_hits hits;
    struct lum_surface s;
    hits.object[0] = 0, hits.prim[0] = prim, hits.u[0] = u, hits.v[0] = v, hits.white = false;
    lum_snapshot_surface(r->snapshot, &hits, 0, lum_v3(0, -1, 0), &s);
    return s;
}

/* A point of an edge, as either triangle has it. */
static void assert_along_u(const struct rig *r, uint32_t prim, float u, float v, uint32_t other, float other_u,
                           float other_v)
{
    struct lum_surface a = surface_at(r, prim, u, v), b = surface_at(r, other, other_u, other_v);
    struct lum_vec3 x = lum_normalize(a.tangent), y = lum_normalize(b.tangent), gap = lum_v3_sub(a.p, b.p);
    struct lum_vec3 about = lum_normalize(lum_v3(-a.p.z, 0.0f, a.p.x));
    assert_true(lum_length(gap) < 1e-4f * lum_length(a.p));
    assert_true(lum_dot(x, y) > 0.99999f);
    assert_true(lum_dot(x, about) > 0.97f); /* the diagonal of a quad of 30 degrees */
}

/* On both sides of an edge the tangent is the same; and along growing u. */
static void lines_do_not_break_at_edges(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    put_ring(&r, "ring");
    struct lum_material_desc m = lum_material_steel(0.3f, 0.8f, 0.0);
    rig_material(&r, "steel", &m);
    rig_object(&r, "ring", "ring", "steel", rig_v(0, 0, 0));
    rig_commit(&r);
    for (uint32_t k = 0; k < AROUND; k++)
        for (float t = 0.1f; t < 1.0f; t += 0.2f) {
            assert_along_u(&r, 2 * k, 1.0f - t, t, 2 * k + 1, 1.0f - t, 0.0f);
            assert_along_u(&r, 2 * k + 1, 1.0f - t, t, (2 * k + 2) % (2 * AROUND), 0.0f, t); /* also where uv ends */
        }
    rig_end(&r);
}

/* Without uv about the y axis; on what faces along it, along x. */
static void without_uv_lines_are_those_of_a_turned_part(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_box(&r, "box", 0.5, 0.5, 0.5);
    struct lum_material_desc m = lum_material_steel(0.3f, 0.8f, 0.0);
    rig_material(&r, "steel", &m);
    rig_object(&r, "box", "box", "steel", rig_v(0, 0, 0));
    rig_commit(&r);
    for (uint32_t prim = 0; prim < 12; prim++) {
        struct lum_surface s = surface_at(&r, prim, 0.3f, 0.3f);
        struct lum_vec3 t = lum_normalize(s.tangent);
        assert_true(fabsf(lum_dot(t, s.ng)) < 1e-6f && fabsf(t.y) < 1e-6f);
        if (fabsf(s.ng.y) > 0.5f)
            assert_true(t.x > 0.999f);
    }
    rig_end(&r);
}

/* Its table is kept while it serves, so that a material that is put again as it was changes nothing; one that is
 * brushed later finds tangents. */
static void put_again_it_is_the_same(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    put_ring(&r, "ring");
    struct lum_material_desc even = lum_material_steel(0.3f, 0.0f, 0.0), m = lum_material_steel(0.3f, 0.8f, 0.0);
    rig_material(&r, "steel", &even);
    rig_object(&r, "ring", "ring", "steel", rig_v(0, 0, 0));
    rig_commit(&r);
    assert_null(r.snapshot->instances[0].mesh->tangents);
    rig_material(&r, "steel", &m);
    rig_commit(&r);
    struct lum_versions before = r.snapshot->versions;
    assert_non_null(r.snapshot->instances[0].mesh->tangents);
    rig_material(&r, "steel", &m);
    rig_commit(&r);
    assert_int_equal(r.snapshot->versions.material, before.material);
    m.roughness = 0.4f;
    rig_material(&r, "steel", &m);
    rig_commit(&r);
    assert_true(r.snapshot->versions.material > before.material);
    rig_end(&r);
}

/* ---- pictures ---- */

static void render_with(struct rig *r, const struct lum_material_desc *red, const char *method)
{
    rig_begin(r, 2);
    rig_room(r);
    rig_material(r, "red", red);
    rig_bulb(r, "lamp", rig_v(0.7, 2.6, 0.6), 100);
    rig_camera(r, rig_v(0.0, 2.0, 1.2), rig_v(0.5, 0.9, -0.4), 30);
    r->settings.method = lum_method_find(method);
    r->settings.w = r->settings.h = 24;
    r->settings.max_spp = 2;
    rig_commit(r);
    rig_pass(r);
}

/* Without a strength a direction says nothing, to the last bit. */
static void no_strength_changes_nothing(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t k = 0; k < n; k++) {
        struct rig r;
        struct lum_material_desc even = lum_material_steel(0.4f, 0.0f, 0.0),
                                 turned = lum_material_steel(0.4f, 0.0f, 30.0);
        render_with(&r, &even, methods[k].name);
        struct lum_rgb *picture = rig_picture(&r);
        rig_end(&r);
        render_with(&r, &turned, methods[k].name);
        rig_assert_picture(&r, picture, methods[k].name);
        lum_free(picture);
        rig_end(&r);
    }
}

/* The mean of a square under a lamp, with all of it turned by quarters about the vertical but for its stretch. */
static struct reading under_a_lamp(const struct lum_method *method, double stretch_deg, bool turned)
{
    struct rig r;
    rig_begin(&r, 0);
    rig_square(&r, "square", 0.5);
    struct lum_material_desc m = lum_material_steel(0.4f, 0.8f, stretch_deg);
    rig_material(&r, "square", &m);
    rig_object(&r, "square", "square", "square", rig_v(0, 0, 0));
    struct lum_vec3d eye = {0.3, 0.8, 1.0}, lamp = {0.5, 1.5, -1.2};
    rig_bulb(&r, "lamp", turned ? rig_v(lamp.z, lamp.y, -lamp.x) : lamp, 100);
    rig_camera(&r, turned ? rig_v(eye.z, eye.y, -eye.x) : eye, rig_v(0, 0, 0), 20);
    r.settings.w = r.settings.h = 12;
    rig_commit(&r);
    struct reading got = read_picture(&r, method, 16);
    rig_end(&r);
    return got;
}

/* Light and eye turned by 90 degrees, and the stretch with them, from x to -z: the same highlight, in every method.
 * Turned alone, another one. */
static void a_highlight_turns_with_its_stretch(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t k = 0; k < n; k++) {
        struct reading along = under_a_lamp(&methods[k], 0.0, false), same = under_a_lamp(&methods[k], 90.0, true);
        struct reading across = under_a_lamp(&methods[k], 90.0, false);
        print_message("%s: %.5g, turned %.5g, across %.5g\n", methods[k].name, along.mean, same.mean, across.mean);
        check("turned", &methods[k], same, along.mean, 0.001);
        assert_true(along.mean > 0.0 && fabs(across.mean / along.mean - 1.0) > 0.2);
    }
}

static void white_brushed_metal_in_a_furnace(void **state)
{
    (void)state;
    struct lum_material_desc m = lum_material_steel(0.4f, 0.7f, 20.0);
    m.base_color = lum_grey(1.0f);
    check_in_furnace("brushed", &m, rig_v(0.3, 0.4, 0.5), 64, 0.03);
}

enum { SIDE = 32, ACROSS = 4, BLOCKS = ACROSS * ACROSS };

/* Means of blocks of 8 x 8 pixels, over SEEDS pictures. */
static void read_blocks(struct rig *r, const char *method, uint32_t spp, double ret_mean[BLOCKS])
{
    memset(ret_mean, 0, BLOCKS * sizeof *ret_mean);
    r->settings.method = lum_method_find(method);
    r->settings.max_spp = spp;
    for (r->settings.seed = 0; r->settings.seed < SEEDS; r->settings.seed++) {
        rig_fresh_view(r);
        while (!rig_pass(r).complete && !r->settings.method->refines)
            continue;
        struct lum_rgb *picture = rig_picture(r);
        for (uint32_t i = 0; i < SIDE * SIDE; i++)
            ret_mean[i / SIDE * ACROSS / SIDE * ACROSS + i % SIDE * ACROSS / SIDE] +=
                (double)picture[i].g * BLOCKS / (SIDE * SIDE * SEEDS);
        lum_free(picture);
    }
    r->settings.seed = 0;
}

/* A brushed crate in a room, under a panel and a bulb: by first frames of `live` as by `path`, as a whole and block by
 * block: within what metal that is rough alike all ways (kind 0) is off by. */
static void live_shows_brushed_metal_as_path_does(void **state)
{
    (void)state;
    for (int kind = 0; kind < 3; kind++) {
        struct rig r;
        rig_begin(&r, 2);
        rig_room(&r);
        struct lum_material_desc red =
            lum_material_steel(kind ? 0.4f : 0.7f, kind ? 0.7f : 0.0f, kind == 2 ? 90.0 : 0.0);
        rig_material(&r, "red", &red);
        struct lum_light_desc panel = rig_quad(rig_v(0, 2.9, 0), rig_v(1, 0, 0), rig_v(0, 0, 1), 100);
        rig_light(&r, "panel", &panel);
        rig_bulb(&r, "bulb", rig_v(-0.8, 2.0, 1.0), 40);
        rig_camera(&r, rig_v(0.0, 2.0, 1.2), rig_v(0.5, 0.9, -0.4), 30);
        r.settings.w = r.settings.h = SIDE;
        rig_commit(&r);
        double path[BLOCKS], live[BLOCKS], sum[2] = {0}, lowest = 1.0, highest = 1.0;
        read_blocks(&r, "path", 64, path);
        read_blocks(&r, "live", 1, live);
        for (int k = 0; k < BLOCKS; k++) {
            sum[0] += path[k] / BLOCKS, sum[1] += live[k] / BLOCKS;
            lowest = fmin(lowest, live[k] / path[k]), highest = fmax(highest, live[k] / path[k]);
        }
        print_message("kind %d: path %.5g, live over path %.4f, blocks %.3f to %.3f\n", kind, sum[0], sum[1] / sum[0],
                      lowest, highest);
        assert_true(sum[0] > 0.0);
        assert_true(!TEST_TELLS || fabs(sum[1] / sum[0] - 1.0) < 0.03); /* README: first frames */
        assert_true(!TEST_TELLS || (lowest > 0.9 && highest < 1.1));
        rig_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(alike_both_ways_is_isotropic),
        cmocka_unit_test(facets_cover_the_surface),
        cmocka_unit_test(the_table_is_the_albedo),
        cmocka_unit_test(what_is_brushed_is_no_mirror),
        cmocka_unit_test(lines_do_not_break_at_edges),
        cmocka_unit_test(without_uv_lines_are_those_of_a_turned_part),
        cmocka_unit_test(put_again_it_is_the_same),
        cmocka_unit_test(no_strength_changes_nothing),
        cmocka_unit_test(a_highlight_turns_with_its_stretch),
        cmocka_unit_test(white_brushed_metal_in_a_furnace),
        cmocka_unit_test(live_shows_brushed_metal_as_path_does),
    };
    return cmocka_run_group_tests_name("numeric.brushed", tests, NULL, NULL);
}
