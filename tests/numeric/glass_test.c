/* Light through panes: what arrives behind one, two or three, clear or tinted, at any angle, from every kind of lamp,
 * is what the panes leave of it, in every method, and neither a lamp that is dimmed nor one that is seen again costs a
 * ray.
 *
 * A pane has two faces, each of which reflects R: of clear glass it lets (1 - R) / (1 + R) through, for n = 1.5 and
 * light along the normal 0.923. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/material/bsdf.h"
#include "core/pass/pass.h"
#include "core/scene/surface.h"
#include "tests/numeric/panes.h"
#include "tests/support/effort.h"

/* Within 1 % of what is right. Both pictures are made with the same numbers, so that what is left of chance is that of
 * the pane (path: 2^14 samples, each of which is 0, or 1 / 0.92 of its mean: 0.25 %); of a lamp, that it is 4 cm wide
 * and 2 m away (0.5 degrees, over which three panes at 56 degrees change by 0.7 %, and all of it but by its middle by
 * far less); and of the sky, in methods that see it from a few directions, these: so it is seen from SEEDS times as
 * many. (igi takes 9; what they leave deviates by 0.15 of its mean: 0.3 %.) */
#define SEEDS TEST_EFFORT(256u)
static uint32_t check_lamp(enum lamp kind, double x, uint32_t n_panes, double ior, const double tint[3])
{
    struct rig bare, glazed;
    struct lum_material_desc m = glass(ior, tint[0], tint[1], tint[2]);
    uint32_t n_wrong = 0;
    begin(&bare);
    begin(&glazed);
    put_lamp(&bare, kind, x, 1.0);
    put_lamp(&glazed, kind, x, 1.0);
    put_panes(&glazed, n_panes, &m);
    rig_commit(&bare);
    rig_commit(&glazed);
    for (size_t i = 0; i < LUM_ARRAY_LEN(methods); i++) {
        uint32_t mirrored = i >= 2 && ior > 1.0 ? LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE) : 0;
        bare.settings.effects_off = glazed.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_REFLECTION) | mirrored;
        uint32_t n_seeds = kind == SKY && i >= 2 ? SEEDS : 1; /* neither of path nor of live */
        struct lum_rgb a = render(&bare, methods[i], n_seeds), b = render(&glazed, methods[i], n_seeds);
        const float got[3] = {b.r / a.r, b.g / a.g, b.b / a.b};
        for (int c = 0; c < 3; c++) {
            double one = left_by_pane(HIGH / sqrt(HIGH * HIGH + x * x), ior, tint[c]);
            double right = kind == SKY ? left_of_sky(n_panes, ior, tint[c]) : pow(one, (double)n_panes);
            if (!TEST_TELLS || is_near((double)got[c], right, 0.01))
                continue;
            print_error("%s, %s at %g m, %u panes of tint %g: %.4f arrives, expected %.4f\n", methods[i],
                        lamp_names[kind], x, n_panes, tint[c], (double)got[c], right);
            n_wrong++;
        }
    }
    rig_end(&bare);
    rig_end(&glazed);
    return n_wrong;
}

static void panes_leave_what_they_do_of_every_lamp(void **state)
{
    (void)state;
    const double clear[3] = {1, 1, 1}, tinted[3] = {0.9, 0.5, 0.2};
    const struct {
        double x;
        uint32_t n_panes;
        double ior;
        const double *tint;
    } cases[] = {
        {2.0, 2, 1.5, tinted}, {0.0, 1, 1.5, clear}, {0.0, 0, 1.5, clear}, {3.0, 3, 1.5, clear}, {1.0, 2, 1.0, tinted}};
    uint32_t n_wrong = 0;
    for (uint32_t kind = 0; kind < N_LAMPS; kind++)
        for (size_t k = 0; k < TEST_EFFORT(LUM_ARRAY_LEN(cases)); k++)
            n_wrong += check_lamp((enum lamp)kind, cases[k].x, cases[k].n_panes, cases[k].ior, cases[k].tint);
    assert_int_equal(n_wrong, 0);
}

/* ---- a pane by itself ---- */

/* What is not absorbed is reflected or passes, the same from either side and at any angle, and it is the closed form.
 * 1e-5: the Fresnel terms are differences of floats near 1. */
static void a_pane_loses_nothing(void **state)
{
    (void)state;
    for (int k = 1; k <= 100; k++) {
        double cosine = 0.01 * k, sine = sqrt(1.0 - cosine * cosine);
        const struct lum_material m = {.base_color = {1.0f, 0.6f, 0.0f},
                                       .specular_color = {1, 1, 1},
                                       .ior = 1.5f,
                                       .specular = 1.0f,
                                       .transmission = 1.0f,
                                       .thin = true};
        assert_true(lum_material_is_pane(&m));
        for (int side = -1; side < 2; side += 2) {
            struct lum_vec3 n = {0, 0, (float)side}, wo = {(float)sine, 0, (float)(side * cosine)};
            struct lum_surface s = {.ng = n, .ns = n, .backface = side < 0, .vertex_color = {1, 1, 1}};
            struct lum_bsdf b;
            struct lum_bsdf_sample lobes[2];
            lum_bsdf_init(&b, &m, &s, wo);
            struct lum_rgb left = lum_bsdf_straight(&b, wo), tint = m.base_color;
            assert_int_equal(lum_bsdf_delta_lobes(&b, wo, lobes), 2);
            assert_true(lobes[1].lobe == LUM_LOBE_TRANSMIT && memcmp(&lobes[1].weight, &left, sizeof left) == 0);
            const float up[3] = {lobes[0].weight.r, lobes[0].weight.g, lobes[0].weight.b};
            const float down[3] = {left.r, left.g, left.b}, color[3] = {tint.r, tint.g, tint.b};
            assert_float_equal(up[0] + down[0], 1.0f, 1e-5f);
            for (int c = 0; c < 3; c++) {
                double right = left_by_pane(cosine, 1.5, (double)color[c]);
                assert_true(fabs((double)down[c] - right) <= 1e-5 && up[c] + down[c] <= 1.00001f && up[c] >= 0.0f);
            }
        }
    }
}

/* ---- single rays ---- */

/* A square of cells x cells, each two triangles, at heights 0, 0.01, ... in one mesh. */
static void put_grid(struct rig *r, uint32_t cells, uint32_t n_sheets)
{
    uint32_t n = cells + 1, n_vertices = 0, n_triangles = 0;
    double *p = lum_calloc((size_t)n * n * n_sheets * 3, sizeof *p);
    uint32_t *index = lum_calloc((size_t)cells * cells * n_sheets * 6, sizeof *index);
    assert_true(p && index);
    for (uint32_t k = 0; k < n_sheets; k++) {
        uint32_t first = n_vertices;
        for (uint32_t i = 0; i < n * n; i++, n_vertices++) {
            p[3 * n_vertices] = (double)(i % n) / cells - 0.5;
            p[3 * n_vertices + 1] = 0.01 * k;
            p[3 * n_vertices + 2] = (double)(i / n) / cells - 0.5;
        }
        for (uint32_t i = 0; i < cells * cells; i++, n_triangles += 2) {
            uint32_t a = first + i / cells * n + i % cells, *t = &index[3 * n_triangles];
            t[0] = a, t[1] = a + n, t[2] = a + 1;
            t[3] = a + 1, t[4] = a + n, t[5] = a + n + 1;
        }
    }
    rig_mesh(r, "grid", p, n_vertices, index, n_triangles);
    lum_free(p);
    lum_free(index);
}

/* From anywhere to anywhere, through random places and exactly through corners and edges of triangles: each sheet
 * counts once. 1e-4: the cosine, at least 0.2, is off by a few roundings of coordinates of up to 2^7, 2^-15 at most,
 * and a sheet of light at that angle by less than three times as much. */
static void a_pane_counts_once(void **state)
{
    (void)state;
    enum { CELLS = 32, SHEETS = 3, ROUNDS = TEST_EFFORT(40) };
    struct rig r;
    uint64_t bad = 0, state64 = 1;
    rig_begin(&r, 1);
    struct lum_material_desc m = glass(1.5, 1, 1, 1);
    rig_material(&r, "glass", &m);
    put_grid(&r, CELLS, SHEETS);
    rig_object(&r, "grid", "grid", "glass", rig_v(0.3, 0.7, -0.2));
    rig_square(&r, "far", 40); /* so that the scene is not small */
    rig_diffuse_object(&r, "far", "matte", 0.5f, rig_v(0, -30, 0));
    rig_commit(&r);
    const struct lum_snapshot *s = r.snapshot;
    for (int singly = 0; singly < 2; singly++)
        for (uint32_t round = 0; round < ROUNDS; round++) {
            struct lum_trace t = {.top = s->top, .panes = &s->panes, .bad_rays = &bad};
            struct lum_rays rays = {.n = 0};
            uint8_t occluded[LUM_RAY_BATCH];
            struct lum_rgb left[LUM_RAY_BATCH];
            lum_device_trace_singly(r.device, singly);
            for (uint32_t i = 0; i < LUM_RAY_BATCH; i++) {
                double u[5];
                for (int k = 0; k < 5; k++) {
                    state64 = state64 * 6364136223846793005u + 1442695040888963407u;
                    u[k] = (double)(state64 >> 40) * 0x1p-24;
                }
                if (i % 4 > 0) /* an edge */
                    u[0] = 0.5 + (floor(u[0] * (CELLS - 4)) - (CELLS - 4) / 2) / (0.9 * CELLS);
                if (i % 4 > 1) /* or a corner */
                    u[1] = 0.5 + (floor(u[1] * (CELLS - 4)) - (CELLS - 4) / 2) / (0.9 * CELLS);
                struct lum_vec3d at = {0.3 + 0.9 * (u[0] - 0.5), 0.7, -0.2 + 0.9 * (u[1] - 0.5)};
                double dx = 2 * (u[2] - 0.5), dz = 2 * (u[3] - 0.5), reach = 0.004; /* within the sheets */
                struct lum_vec3 o = rig_to_scene(&r, at.x - dx * reach, at.y - reach, at.z - dz * reach);
                struct lum_vec3 e = rig_to_scene(&r, at.x + dx * reach, at.y + reach, at.z + dz * reach);
                if (u[4] < 0.5) { /* through all of them */
                    o = rig_to_scene(&r, at.x - dx * 0.02, at.y - 0.02, at.z - dz * 0.02);
                    e = rig_to_scene(&r, at.x + dx * 0.06, at.y + 0.06, at.z + dz * 0.06);
                }
                lum_rays_push(&rays, o, lum_v3_sub(e, o), 1.0f);
            }
            lum_trace_light(&t, &rays, occluded, left);
            for (uint32_t i = 0; i < LUM_RAY_BATCH; i++) {
                struct lum_vec3 d = lum_normalize(lum_rays_direction(&rays, i));
                double n = (double)(rays.dy[i] / (float)s->norm.scale) > 0.04 ? SHEETS : 1;
                double right = pow(left_by_pane((double)fabsf(d.y), 1.5, 1.0), n);
                if (occluded[i] || !is_near((double)left[i].g, right, 1e-4))
                    fail_msg("ray %u of round %u (%s): %s, %.6f is left, expected %.6f", i, round,
                             singly ? "one by one" : "packets", occluded[i] ? "occluded" : "free", (double)left[i].g,
                             right);
            }
        }
    assert_int_equal(bad, 0);
    lum_device_trace_singly(r.device, false);
    rig_end(&r);
}

/* ---- what is kept ---- */

/* Without transmission panes stop light as they stop the eye: what lies behind is black, in every method. */
static void without_transmission_panes_are_opaque(void **state)
{
    (void)state;
    struct lum_material_desc m = glass(1.5, 1, 1, 1);
    for (uint32_t kind = 0; kind < N_LAMPS; kind++) {
        struct rig r;
        begin(&r);
        put_lamp(&r, (enum lamp)kind, 0.0, 1.0);
        put_panes(&r, 1, &m);
        rig_commit(&r);
        r.settings.effects_off |= LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION);
        for (size_t i = 0; i < LUM_ARRAY_LEN(methods); i++) {
            r.settings.effects_off |= i >= 2 ? LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE) : 0;
            struct lum_rgb mean = render(&r, methods[i], kind == SKY ? TEST_EFFORT(64u) : 1);
            /* of the sky's 500 cd/m2 some (1 / 60)^2 come in beside the pane, from below 1 degree */
            if (!(mean.g <= (kind == SKY ? 0.2f : 0.0f)))
                fail_msg("%s: %s sends %g through an opaque pane", methods[i], lamp_names[kind], (double)mean.g);
        }
        rig_end(&r);
    }
}

/* A room under a roof of glass. */
static void put_glazed_room(struct rig *r, const struct lum_material_desc *m)
{
    const double p[] = {-2, 0, -2, 2, 0, -2, 2, 0, 2, -2, 0, 2, -2, 2, -2, 2, 2, -2, 2, 2, 2, -2, 2, 2};
    const uint32_t i[] = {0, 2, 1, 0, 3, 2, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 3, 7, 6, 3, 6, 2}; /* no ceiling */
    rig_mesh(r, "walls", p, 8, i, 8);
    rig_diffuse_object(r, "walls", "white", 0.7f, rig_v(0, 0, 0));
    rig_box(r, "crate", 0.3, 0.3, 0.3);
    rig_diffuse_object(r, "crate", "red", 0.4f, rig_v(0.4, 0.35, 0.3));
    rig_square(r, "pane", 1.99);
    rig_material(r, "glass", m);
    rig_object(r, "pane", "pane", "glass", rig_v(0, 1.9, 0));
    rig_camera(r, rig_v(-1.2, 1.5, 1.7), rig_v(0.3, 0.3, -0.3), 60);
}

static void put_sun(struct rig *r, double lx)
{
    struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                 .direction = rig_v(0.3, -1, 0.2),
                                 .color = lum_grey(1),
                                 .intensity = lx,
                                 .on = true};
    rig_light(r, "sun", &sun);
}

static void put_panel(struct rig *r, double cd_m2)
{
    struct lum_light_desc panel = rig_quad(rig_v(0, 3, 0), rig_v(1, 0, 0), rig_v(0, 0, 1), cd_m2);
    rig_light(r, "panel", &panel);
}

static void assert_dimmed(struct rig *r, const char *method, const char *lamp)
{
    rig_commit(r);
    struct lum_pass_stats stats = rig_pass(r);
    if (rig_all_rays(&stats) != 0)
        fail_msg("%s: the %s is dimmed by %llu rays", method, lamp, (unsigned long long)rig_all_rays(&stats));
}

/* What the view keeps besides records, which lie where earlier pictures wanted them, is what it would find anew. */
static void assert_as_found_anew(struct rig *r, const char *method)
{
    struct lum_rgb *picture = rig_picture(r);
    lum_view_forget(r->view);
    rig_pass(r);
    rig_assert_picture(r, picture, method);
    lum_free(picture);
}

/* Another power of a lamp is another sum; another tint of the glass is another scene. Either way the picture is the one
 * that is made when nothing is known, bit for bit. */
static void lamps_behind_glass_are_dimmed_without_a_ray(void **state)
{
    (void)state;
    static const char *const keep[] = {"live", "whitted", "tic"}; /* light by light, and records that last */
    for (size_t i = 0; i < LUM_ARRAY_LEN(keep); i++) {
        struct rig r;
        struct lum_material_desc m = glass(1.5, 1, 0.9, 0.8);
        rig_begin(&r, 2);
        put_glazed_room(&r, &m);
        put_sun(&r, 5000);
        put_panel(&r, 2000);
        rig_commit(&r);
        use(&r, keep[i]);
        r.settings.max_spp = 1;
        r.settings.n_vpls = 64;
        r.settings.shadow_budget = 0; /* what an older view knows beyond first samples a new one does not */
        r.settings.reproject_shadows = false;
        rig_pass(&r);
        put_sun(&r, 500);
        assert_dimmed(&r, keep[i], "sun");
        put_panel(&r, 7000);
        assert_dimmed(&r, keep[i], "panel");
        assert_as_found_anew(&r, keep[i]);
        m = glass(1.5, 0.3, 0.9, 0.8);
        rig_material(&r, "glass", &m);
        rig_commit(&r);
        struct lum_pass_stats stats = rig_pass(&r);
        assert_true(stats.rays[LUM_RAY_DIRECT] > 0);
        assert_as_found_anew(&r, keep[i]);
        rig_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(panes_leave_what_they_do_of_every_lamp),
        cmocka_unit_test(a_pane_loses_nothing),
        cmocka_unit_test(a_pane_counts_once),
        cmocka_unit_test(without_transmission_panes_are_opaque),
        cmocka_unit_test(lamps_behind_glass_are_dimmed_without_a_ray),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
