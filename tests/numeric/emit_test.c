/* Light that leaves lights: flux, and that it goes where lum_light_sample_at says it comes from. */
#include "tests/support/rig.h"

#include "core/light/emit.h"
#include "core/light/emitter.h"
#include "core/light/light.h"
#include "core/light/portals.h"
#include "core/light/sample.h"
#include "core/math/warp.h"
#include "core/pass/pass.h"
#include "core/scene/light_kind.h"
#include "tests/numeric/stats.h"
#include "tests/support/webs.h"
#include "server/world/light_kinds.h"

/* All kinds of light (server/world/light_kinds.h), and five more. */
enum { IMAGE = LUM_LIGHT_KIND_COUNT, MESH, RECTANGLE, ROUND, FAR_DISC, N_KINDS };

static const char *name_of(int kind)
{
    static const char *const more[] = {"image", "mesh", "rectangular opening", "round opening", "far disc"};
    return kind < IMAGE ? lum_light_kinds[kind].name : more[kind - IMAGE];
}

static struct lum_web *web; /* of the ies kind; made once by main */

static struct lum_light_desc lamp_of(int kind)
{
    bool opening = kind == RECTANGLE || kind == ROUND;
    return (struct lum_light_desc){.kind = kind < IMAGE       ? lum_light_kinds[kind].row
                                           : opening          ? &lum_light_kind_ies
                                           : kind == FAR_DISC ? &lum_light_kind_directional
                                                              : &lum_light_kind_environment,
                                   .opening = kind == RECTANGLE ? LUM_OPENING_RECTANGLE
                                              : kind == ROUND   ? LUM_OPENING_DISC
                                                                : LUM_OPENING_POINT,
                                   .opening_m = {0.6, 0.3},
                                   .position = {-0.3, 0.2, 0.1},
                                   .direction = {0.3, -1, 0.4},
                                   .u = {0.5, 0.2, 0},
                                   .v = {0, 0.1, 0.7},
                                   .radius_m = 0.3,
                                   .diameter_rad = kind == FAR_DISC ? 0.2 : 0.0,
                                   .inner_cone_rad = 0.4,
                                   .outer_cone_rad = 1.1,
                                   .color = lum_grey(1),
                                   .intensity = 1,
                                   .image = kind == IMAGE ? "sky" : NULL,
                                   .rotation_rad = 0.7,
                                   .cie_type = 12,
                                   .ground_albedo = 0.2,
                                   .web = web,
                                   .on = true};
}

/* A box of 4 x 3 x 4 m around nothing but a light. */
static void scene_with(struct rig *r, int kind)
{
    static const float pixels[3 * 8] = {0, 0, 0, 4, 4, 4, 1, 1, 1, 0, 0, 0, 2, 2, 2, 1, 1, 1, 0, 0, 0, 9, 9, 9};
    rig_begin(r, 1);
    struct lum_material_desc white = rig_diffuse(0.5f), glow = rig_diffuse(0.5f);
    rig_material(r, "white", &white);
    rig_box(r, "room", 2, 1.5, 2);
    rig_object(r, "room", "room", "white", rig_v(0, 0, 0));
    if (kind == MESH) { /* a tetrahedron of unlike faces */
        const double p[] = {0, 0, 0, 0.5, 0, 0.1, 0, 0.3, 0, 0.1, 0.1, 0.6};
        const uint32_t i[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
        glow.emission = lum_grey(1.0f), glow.emission_cd_m2 = 1;
        rig_material(r, "glow", &glow);
        rig_mesh(r, "bulb", p, 4, i, 4);
        rig_object(r, "bulb", "bulb", "glow", rig_v(-0.3, 0.2, 0.1));
    } else {
        struct lum_light_desc l = lamp_of(kind);
        struct lum_image_desc sky = {LUM_TEXEL_RGB32F, 4, 2, pixels};
        RIG_OK(lum_scene_put_image(r->scene, "sky", &sky, &err));
        rig_light(r, "lamp", &l);
    }
    rig_commit(r);
    assert_int_equal(r->snapshot->lights.n_lights, 1);
}

static double flux_unit(const struct rig *r)
{
    return lum_light_flux_unit(&r->snapshot->lights.lights[0], r->snapshot->bounds_lo, r->snapshot->bounds_hi);
}

static struct lum_vec2 random_pair(struct rng *r)
{
    return (struct lum_vec2){(float)(rng_u64(r) >> 40) * 0x1p-24f, (float)(rng_u64(r) >> 40) * 0x1p-24f};
}

/* Brighter from here than from there, or of a box that is not as large from here as from there. */
static bool is_uneven(int kind)
{
    bool sky = kind < IMAGE && lum_light_kinds[kind].row == &lum_light_kind_sky;
    return sky || kind == IMAGE || kind == FAR_DISC;
}

/* Every shot carries the light's flux; the texels of an image or a sky carry it in the mean. */
static void flux_is_the_lights(void **state)
{
    (void)state;
    for (int kind = 0; kind < N_KINDS; kind++) {
        struct rig r;
        scene_with(&r, kind);
        double want = flux_unit(&r);
        struct mean mean = {0};
        struct rng random = {(uint64_t)kind};
        for (int i = 0; i < 20000; i++) {
            struct lum_vec2 u_position = random_pair(&random), u_direction = random_pair(&random);
            struct lum_light_ray shot;
            bool shone = lum_light_emit(r.snapshot, 0, NULL, u_position, u_direction, &shot);
            mean_add(&mean, shone ? (double)shot.flux_unit.g : 0.0);
            if (shone && !is_uneven(kind) && !(fabs((double)shot.flux_unit.g / want - 1.0) < 1e-5))
                fail_msg("%s: %g, expected %g", name_of(kind), (double)shot.flux_unit.g, want);
            if (shone && !(lum_v3_finite(shot.o) && fabsf(lum_length(shot.d) - 1.0f) < 1e-5f))
                fail_msg("%s: shot %d leaves its range", name_of(kind), i);
        }
        if (is_uneven(
                kind)) /* lum_light_flux_unit takes the box as equally large from all sides: 4 x 3 x 4 is, to a tenth */
            assert_true(fabs(mean.mean / want - 1.0) < 0.1);
        else
            assert_true(fabs(mean.mean / want - 1.0) < 1e-5);
        rig_end(&r);
    }
}

/* The scene says the same of a kind, in its own units, as its light at render time. */
static void flux_is_as_the_scene_says(void **state)
{
    (void)state;
    for (int kind = 0; kind < IMAGE; kind++) {
        const struct lum_light_kind_row *row = lum_light_kinds[kind].row;
        if (!row->flux)
            continue;
        struct rig r;
        scene_with(&r, kind);
        struct lum_light_desc d = lamp_of(kind);
        double s =
            row->emitter->unit == LUM_POWER_INTENSITY ? 1.0 : r.snapshot->norm.scale; /* areas are in scene units */
        double want = row->flux(&d) * s * s, got = flux_unit(&r);
        if (!(fabs(got / want - 1.0) < 1e-6)) /* a few roundings to float */
            fail_msg("%s: %g lm, expected %g", lum_light_kinds[kind].name, got, want);
        rig_end(&r);
    }
}

struct target {
    struct lum_vec3 centre, n;
    float radius;
};

/* Some cells of three faces of a box in the room. */
static struct lum_portals some_portals(const struct rig *r)
{
    struct lum_portals o;
    lum_portals_cut(&o, rig_to_scene(r, -1.7, -1.2, -1.6), rig_to_scene(r, 1.6, 1.3, 1.8), 4);
    const uint32_t cells[] = {3 * 16 + 5,  3 * 16 + 6, 3 * 16 + 9, 3 * 16 + 10,
                              3 * 16 + 11, 1 * 16 + 6, 1 * 16 + 4, 5 * 16 + 8};
    for (size_t i = 0; i < LUM_ARRAY_LEN(cells); i++)
        assert_true(lum_portals_open(&o, cells[i]));
    lum_portals_sort(&o);
    return o;
}

/* Flux through the front of the target, by shots. */
static void through_by_shots(const struct rig *r, const struct lum_portals *portals, const struct target *t,
                             struct rng *random, struct mean *ret)
{
    struct lum_vec2 u_position = random_pair(random), u_direction = random_pair(random);
    struct lum_light_ray shot;
    double flux = 0.0;
    /* a mesh, which is closed here, shines into itself, too: that ends there */
    bool inwards = r->snapshot->lights.lights[0].kind == &lum_emitter_mesh && u_direction.x >= 0.5f;
    if (lum_light_emit(r->snapshot, 0, portals, u_position, u_direction, &shot) && !inwards) {
        float down = -lum_dot(shot.d, t->n), above = lum_dot(lum_v3_sub(shot.o, t->centre), t->n);
        struct lum_vec3 x = lum_v3_mad(shot.o, shot.d, above / down);
        if (down > 0.0f && above > 0.0f && lum_length(lum_v3_sub(x, t->centre)) < t->radius)
            flux = (double)shot.flux_unit.g;
    }
    mean_add(ret, flux);
}

/* The same by what its points receive. */
static void through_by_sampling(const struct rig *r, const struct target *t, struct rng *random, struct mean *ret)
{
    struct lum_frame f = lum_frame_from_normal(t->n);
    struct lum_vec2 at = lum_warp_disc(random_pair(random)), u = random_pair(random);
    struct lum_vec3 p = lum_v3_mad(lum_v3_mad(t->centre, f.t, t->radius * at.x), f.b, t->radius * at.y);
    struct lum_light_sample s;
    double flux = 0.0;
    if (lum_light_sample_at(r->snapshot, 0, p, u, &s) && lum_dot(s.wi, t->n) > 0.0f) {
        double pdf = r->snapshot->lights.lights[0].delta ? 1.0 : (double)s.pdf_sa;
        double power = (double)r->snapshot->lights.lights[0].power.g;
        flux = (double)(s.radiance.g * lum_dot(s.wi, t->n)) / pdf / power * LUM_PI_D * (double)(t->radius * t->radius);
    }
    mean_add(ret, flux);
}

/* aimed: half of what comes from afar is sent through portals. */
static void compare_with_received(bool aimed)
{
    enum { n_targets = 4 };
    const double level = sidak(0.01, N_KINDS * n_targets);
    for (int kind = 0; kind < N_KINDS; kind++) {
        struct rig r;
        scene_with(&r, kind);
        if (aimed && !lum_light_is_from_afar(&r.snapshot->lights.lights[0])) {
            rig_end(&r);
            continue;
        }
        const struct lum_portals portals = some_portals(&r);
        double s = r.snapshot->norm.scale;
        /* below, beside, behind, above: all inside the box, none in the light */
        const struct target targets[n_targets] = {
            {lum_v3(0, (float)(-1.2 * s), (float)(0.3 * s)), lum_v3(0, 1, 0), (float)(0.6 * s)},
            {lum_v3((float)(1.3 * s), 0, (float)(0.5 * s)), lum_normalize(lum_v3(-1, 0.2f, -0.4f)), (float)(0.5 * s)},
            {lum_v3((float)(-0.9 * s), (float)(-0.8 * s), (float)(-1.1 * s)), lum_normalize(lum_v3(0.3f, 1, 0.8f)),
             (float)(0.5 * s)},
            {lum_v3((float)(0.2 * s), (float)(1.0 * s), 0), lum_normalize(lum_v3(0.2f, -1, 0.1f)), (float)(0.4 * s)},
        };
        uint32_t n_lit = 0;
        for (int k = 0; k < n_targets; k++) {
            struct mean shots = {0}, sampled = {0};
            struct rng random = {(uint64_t)(kind * n_targets + k)};
            for (int i = 0; i < 100000; i++) {
                through_by_shots(&r, aimed ? &portals : NULL, &targets[k], &random, &shots);
                through_by_sampling(&r, &targets[k], &random, &sampled);
            }
            double e1 = mean_stderr(&shots), e2 = mean_stderr(&sampled);
            /* at least that of counting as many shots as are expected: where they are few, there may be none */
            double counting = sampled.mean * flux_unit(&r) / 100000;
            double err = sqrt(fmax(e1 * e1, counting) + e2 * e2);
            double z = fabs(shots.mean - sampled.mean) / err;
            n_lit += shots.mean > 0.0;
            /* both means of 1e5: normal */
            if (err > 0.0 ? erfc(z / sqrt(2.0)) < level : shots.mean != sampled.mean)
                fail_msg("%s%s, target %d: %g +- %g, received %g +- %g", name_of(kind), aimed ? " by portals" : "", k,
                         shots.mean, e1, sampled.mean, e2);
        }
        assert_true(n_lit > 0);
        rig_end(&r);
    }
}

static void shots_go_where_light_is_received(void **state)
{
    (void)state;
    compare_with_received(false);
}

static void as_many_go_there_through_portals(void **state)
{
    (void)state;
    compare_with_received(true);
}

/* An environment is as bright by portals as without, from inside their box and from outside, and each sample has the
 * pdf that its direction is said to have. */
static void environments_are_as_bright_by_portals(void **state)
{
    (void)state;
    const double level = sidak(0.01, 3 * 4);
    for (int kind = 0; kind <= IMAGE; kind++) {
        const struct lum_light_kind_row *row = kind < IMAGE ? lum_light_kinds[kind].row : &lum_light_kind_environment;
        if (row->emitter != &lum_emitter_environment)
            continue;
        struct rig r;
        scene_with(&r, kind);
        const struct lum_light *l = &r.snapshot->lights.lights[0];
        const struct lum_portals portals = some_portals(&r);
        for (int place = 0; place < 4; place++) {
            struct rng random = {(uint64_t)(kind * 4 + (size_t)place)};
            struct lum_vec3 p = rig_to_scene(&r, place == 3 ? 1.9 : 0.4 * place - 0.5, 0.3, -0.6);
            struct lum_vec3 n = lum_normalize(lum_v3(0.3f, 0.8f, -0.5f));
            struct mean by_portals = {0}, all_around = {0};
            int n_off = 0;
            for (int i = 0; i < 50000; i++) {
                struct lum_light_sample a = {0}, b = {0};
                struct lum_vec2 u = random_pair(&random);
                bool found = lum_environment_sample_by_portals(l, &portals, p, u, &a);
                double cosine = (double)lum_max(lum_dot(a.wi, n), 0.0f);
                mean_add(&by_portals, found ? (double)a.radiance.g * cosine / (double)a.pdf_sa : 0.0);
                float told = found ? lum_environment_pdf_by_portals(l, &portals, p, a.wi) : 0.0f;
                /* but at the edges of cells, where rounding may put it next door */
                if (found && !(fabsf(told / a.pdf_sa - 1.0f) < 1e-3f))
                    n_off++;
                found = lum_environment_sample(l, u, &b);
                cosine = (double)lum_max(lum_dot(b.wi, n), 0.0f);
                mean_add(&all_around, found ? (double)b.radiance.g * cosine / (double)b.pdf_sa : 0.0);
            }
            assert_true(n_off < 50);
            double err = hypot(mean_stderr(&by_portals), mean_stderr(&all_around));
            double z = fabs(by_portals.mean - all_around.mean) / err;
            if (err > 0.0 && erfc(z / sqrt(2.0)) < level)
                fail_msg("%s, place %d: %g by portals, %g without, +- %g", name_of(kind), place, by_portals.mean,
                         all_around.mean, err);
        }
        rig_end(&r);
    }
}

/* A line from a point in the box leaves it by the cell that has the point on it, and enters there when it comes back.
 */
static void lines_cross_the_cells_they_meet(void **state)
{
    (void)state;
    struct lum_portals o;
    lum_portals_cut(&o, lum_v3(-1, -2, 3), lum_v3(2, 0.5f, 4), 8);
    assert_int_equal(o.along[0], 8);
    assert_int_equal(o.along[1], 7);
    assert_int_equal(o.along[2], 3);
    struct rng random = {7};
    for (int i = 0; i < 20000; i++) {
        struct lum_vec2 u = random_pair(&random), v = random_pair(&random);
        struct lum_vec3 p = {-1 + 3 * u.x, -2 + 2.5f * u.y, 3 + v.x}, n;
        uint32_t cell = (uint32_t)(random_pair(&random).x * 6 * 64);
        if (!lum_portals_beside(&o, cell, 0, 0, &cell)) /* a number that no cell has */
            continue;
        /* off the edges of the cell, where rounding may put it next door */
        struct lum_vec2 at = random_pair(&random);
        struct lum_vec3 x =
            lum_portals_point(&o, cell, (struct lum_vec2){0.01f + 0.98f * at.x, 0.01f + 0.98f * at.y}, &n);
        struct lum_vec3 d = lum_v3_sub(x, p);
        if (lum_length(d) < 1e-3f)
            continue;
        struct lum_portal_hit out, in;
        assert_true(lum_portals_leave(&o, p, d, &out));
        assert_true(lum_portals_enter(&o, p, lum_v3_neg(d), &in));
        assert_int_equal(out.cell, cell);
        assert_int_equal(in.cell, cell);
        assert_true(fabsf(out.distance / lum_length(d) - 1.0f) < 1e-4f);
        assert_true(fabsf(out.cosine + lum_dot(lum_normalize(d), n)) < 1e-5f);
    }
    struct lum_portal_hit hit;
    assert_false(lum_portals_leave(&o, lum_v3(2.1f, 0, 3.5f), lum_v3(1, 0, 0), &hit));
    assert_false(lum_portals_enter(&o, lum_v3(0, 1, 3.5f), lum_v3(1, 0, 0), &hit));
}

/* Intensity of a spot over the cosine, and that it is even around the axis. */
static void spot_follows_its_ramp(void **state)
{
    (void)state;
    struct rig r;
    scene_with(&r, 1);
    const struct lum_light *l = &r.snapshot->lights.lights[0];
    enum { rings = 16, sectors = 16, n = 200000 };
    static struct chi2_cell cell[rings * sectors];
    double total = flux_unit(&r) / (2.0 * LUM_PI_D);
    for (int i = 0; i < rings; i++) { /* integral of the falloff over the ring, by midpoints */
        double sum = 0.0, width = (double)l->omc_outer / rings;
        for (int k = 0; k < 1000; k++)
            sum += (double)lum_spot_share(l, (float)((i + (k + 0.5) / 1000) * width)) * width / 1000;
        for (int k = 0; k < sectors; k++)
            cell[i * sectors + k] = (struct chi2_cell){sum / total / sectors * n, 0.0};
    }
    struct rng random = {3};
    struct lum_frame f = lum_frame_from_normal(l->n);
    for (int i = 0; i < n; i++) {
        struct lum_vec2 u_position = random_pair(&random), u_direction = random_pair(&random);
        struct lum_light_ray shot;
        assert_true(lum_light_emit(r.snapshot, 0, NULL, u_position, u_direction, &shot));
        struct lum_vec3 d = lum_frame_to_local(&f, shot.d);
        double turn = atan2((double)d.y, (double)d.x) / (2.0 * LUM_PI_D) + 0.5;
        int ring = (int)fmin((1.0 - (double)d.z) / (double)l->omc_outer * rings, rings - 1);
        int sector = (int)fmin(turn * sectors, sectors - 1);
        cell[(ring < 0 ? 0 : ring) * sectors + sector].observed += 1.0;
    }
    double p = chi2_p_value(cell, rings * sectors);
    if (p < 0.01)
        fail_msg("p = %g", p);
    rig_end(&r);
}

/* A ray from a convex emitter does not meet the emitter, and one from afar meets the room. */
static void shots_leave_their_light(void **state)
{
    (void)state;
    for (int kind = 0; kind < N_KINDS; kind++) {
        struct rig r;
        scene_with(&r, kind);
        struct rng random = {(uint64_t)kind};
        uint32_t n_inside = 0, n_shots = 0, n_missed = 0;
        for (int batch = 0; batch < 40; batch++) {
            struct lum_rays rays;
            struct lum_hits hits;
            struct lum_counters counters = {0};
            bool outward[LUM_RAY_BATCH];
            rays.n = 0;
            for (int i = 0; i < LUM_RAY_BATCH; i++) {
                struct lum_vec2 u_position = random_pair(&random), u_direction = random_pair(&random);
                struct lum_light_ray shot;
                if (!lum_light_emit(r.snapshot, 0, NULL, u_position, u_direction, &shot))
                    continue;
                outward[rays.n] = kind != MESH || u_direction.x < 0.5f; /* a mesh shines into itself, too */
                lum_rays_push(&rays, shot.o, shot.d, INFINITY);
            }
            struct lum_trace trace = lum_trace_of(r.snapshot, &counters);
            lum_trace_closest(&trace, &rays, &hits);
            assert_int_equal(counters.bad_rays, 0);
            for (uint32_t i = 0; i < rays.n; i++) {
                n_shots++;
                if (hits.object[i] == LUM_NO_OBJECT) {
                    n_missed++;
                    continue;
                }
                bool room = hits.object[i] < r.snapshot->n_instances &&
                            strcmp(r.snapshot->instances[hits.object[i]].id, "room") == 0;
                if (!room && outward[i])
                    fail_msg("%s: shot %u hits its own light at %g", name_of(kind), i, (double)hits.t[i]);
                n_inside += !room;
            }
        }
        assert_true(kind == MESH ? n_inside > n_shots / 3 : n_inside == 0);
        /* from afar: those that start on the margin around the box, 2^-12 of some 30 units, may pass by */
        assert_true(n_missed <= n_shots / 1000);
        rig_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flux_is_the_lights),
        cmocka_unit_test(flux_is_as_the_scene_says),
        cmocka_unit_test(shots_go_where_light_is_received),
        cmocka_unit_test(as_many_go_there_through_portals),
        cmocka_unit_test(lines_cross_the_cells_they_meet),
        cmocka_unit_test(environments_are_as_bright_by_portals),
        cmocka_unit_test(spot_follows_its_ramp),
        cmocka_unit_test(shots_leave_their_light),
    };
    web = web_of_a_lamp();
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    lum_web_unref(web);
    return failed;
}
