/* Meshes of few triangles that shine: their closed form against that of the quads that they are made of, and samples
 * drawn over their solid angle against both. */
#include "core/light/facets.h"

#include <math.h>

#include "core/accel/trace.h"
#include "core/light/emitter.h"
#include "core/light/rect.h"
#include "tests/support/scene_fixture.h"

/* A box around the origin, half as wide as `half`, of 12 triangles wound outwards; by faces, two each. */
static const int8_t box_faces[6][4][3] = {
    {{1, -1, -1}, {1, 1, -1}, {1, 1, 1}, {1, -1, 1}}, {{-1, -1, -1}, {-1, -1, 1}, {-1, 1, 1}, {-1, 1, -1}},
    {{-1, 1, -1}, {-1, 1, 1}, {1, 1, 1}, {1, 1, -1}}, {{-1, -1, -1}, {1, -1, -1}, {1, -1, 1}, {-1, -1, 1}},
    {{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}, {{-1, -1, -1}, {-1, 1, -1}, {1, 1, -1}, {1, -1, -1}},
};

static struct lum_vec3 box_corner(struct lum_vec3 half, uint32_t face, uint32_t k)
{
    const int8_t *c = box_faces[face][k];
    return lum_v3((float)c[0] * half.x, (float)c[1] * half.y, (float)c[2] * half.z);
}

static uint32_t add_face(struct lum_vec3 half, uint32_t face, struct lum_vec3 (*to)[3])
{
    static const uint32_t corners[2][3] = {{0, 1, 2}, {0, 2, 3}};
    for (uint32_t t = 0; t < 2; t++)
        for (uint32_t k = 0; k < 3; k++)
            to[t][k] = box_corner(half, face, corners[t][k]);
    return 2;
}

static void make(struct lum_facets *f, struct lum_vec3 half, uint32_t first_face, uint32_t n_faces)
{
    struct lum_vec3 corner[LUM_FACETS_MAX][3];
    uint32_t n = 0;
    for (uint32_t face = first_face; face < first_face + n_faces; face++)
        n += add_face(half, face, corner + n);
    lum_facets_init(f, n, (const struct lum_vec3(*)[3])corner, false);
}

static struct lum_light quad_of(struct lum_vec3 half, uint32_t face)
{
    struct lum_vec3 c[4];
    for (uint32_t k = 0; k < 4; k++)
        c[k] = box_corner(half, face, k);
    struct lum_light l = {.kind = &lum_emitter_quad, .p = lum_v3_mul(lum_v3_add(c[0], c[2]), 0.5f)};
    l.u = lum_v3_mul(lum_v3_sub(c[1], c[0]), 0.5f);
    l.v = lum_v3_mul(lum_v3_sub(c[2], c[1]), 0.5f);
    l.n = lum_normalize(lum_cross(l.u, l.v));
    l.area = 4.0f * lum_length(l.u) * lum_length(l.v);
    return l;
}

/* What of faces in front of p it sees, by quads. */
static double by_quads(struct lum_vec3 half, uint32_t first, uint32_t n_faces, struct lum_vec3 p, struct lum_vec3 n)
{
    double sum = 0.0;
    for (uint32_t face = first; face < first + n_faces; face++) {
        struct lum_light l = quad_of(half, face);
        struct lum_irradiance e;
        lum_light_irradiance(&l, 1, &p, &n, &e);
        sum += (double)e.cosine_integral;
    }
    return sum;
}

static struct lum_vec3 any_point(struct random_stream *random, float reach)
{
    return lum_v3_mul(random_direction(random), reach * (float)random_double(random));
}

static bool is_inside(struct lum_vec3 half, struct lum_vec3 p)
{
    return fabsf(p.x) < half.x && fabsf(p.y) < half.y && fabsf(p.z) < half.z;
}

static const struct lum_vec3 half = {0.5f, 0.1f, 0.3f};

/* What is level with a face gets nothing of it, as what is on it (facets.h). */
static bool is_level(struct lum_vec3 p)
{
    float x = fabsf(fabsf(p.x) - half.x), y = fabsf(fabsf(p.y) - half.y), z = fabsf(fabsf(p.z) - half.z);
    return lum_min(x, lum_min(y, z)) < 2.0f * LUM_RAY_OFFSET;
}

/* Quads are right to 2e-4 where they are far (irradiance.c); with floats for coordinates, 1e-6 of pi elsewhere. */
static void outlines_are_their_faces(void **state)
{
    (void)state;
    struct random_stream random = {1};
    struct lum_facets box, sheet;
    make(&box, half, 0, 6);
    make(&sheet, half, 3, 1);
    assert_true(box.outlined && box.closed && sheet.outlined && !sheet.closed);
    for (uint32_t k = 0; k < 20000; k++) {
        struct lum_vec3 p = any_point(&random, k % 2 ? 0.7f : 5.0f), n = random_direction(&random);
        if (is_inside(half, p) || is_level(p))
            continue;
        double want = by_quads(half, 0, 6, p, n), one = by_quads(half, 3, 1, p, n);
        double is = (double)lum_facets_irradiance(&box, false, p, n).cosine_integral;
        double both = (double)lum_facets_irradiance(&box, true, p, n).cosine_integral;
        double flat = (double)lum_facets_irradiance(&sheet, false, p, n).cosine_integral;
        if (fabs(is - want) > 2e-4 * want + 3e-6 || is != both || fabs(flat - one) > 2e-4 * one + 3e-6)
            fail_msg("point %u: box %g, of both sides %g, by quads %g; sheet %g, %g", k, is, both, want, flat, one);
    }
}

/* A sheet that shines from both sides, and a body that does, from within: pi, whichever way one looks. */
static void both_sides_shine(void **state)
{
    (void)state;
    struct random_stream random = {2};
    struct lum_facets box, sheet;
    make(&box, half, 0, 6);
    make(&sheet, half, 3, 1);
    for (uint32_t k = 0; k < 1000; k++) {
        struct lum_vec3 p = any_point(&random, 2.0f), n = random_direction(&random);
        struct lum_vec3 over = {p.x, -2.0f * half.y - p.y, p.z}, turned = {n.x, -n.y, n.z};
        float a = lum_facets_irradiance(&sheet, true, p, n).cosine_integral;
        float b = lum_facets_irradiance(&sheet, true, over, turned).cosine_integral;
        if (fabsf(a - b) > 1e-5f)
            fail_msg("point %u: %g, seen in a mirror %g", k, (double)a, (double)b);
        if (!is_inside(half, p))
            continue;
        float within = lum_facets_irradiance(&box, true, p, n).cosine_integral;
        if (lum_facets_irradiance(&box, false, p, n).cosine_integral > 0.0f || fabsf(within - LUM_PI) > 1e-6f)
            fail_msg("point %u, within: %g, and not pi; or light of the outer side", k, (double)within);
    }
}

/* No point of a lamp is lit by the facet that it lies on, whatever its coordinates round to; of a body the inner side
 * sees nothing else, and the outer one nothing. */
static void lamps_do_not_light_themselves(void **state)
{
    (void)state;
    struct random_stream random = {5};
    struct lum_facets box, sheet;
    struct lum_facets_view view;
    make(&box, half, 0, 6);
    make(&sheet, half, 3, 1);
    for (uint32_t k = 0; k < 3000; k++) {
        struct lum_light q = quad_of(half, k % 6);
        struct lum_vec3 p = lum_v3_mad(lum_v3_mad(q.p, q.u, (float)(1.8 * random_double(&random) - 0.9)), q.v,
                                       (float)(1.8 * random_double(&random) - 0.9));
        p = lum_v3_mad(p, q.n, (float)(2.0 * random_double(&random) - 1.0) * 1e-6f);
        float outside = lum_facets_irradiance(&box, true, p, q.n).cosine_integral;
        float inside = lum_facets_irradiance(&box, true, p, lum_v3_neg(q.n)).cosine_integral;
        if (outside != 0.0f || fabsf(inside - LUM_PI) > 1e-6f || lum_facets_look(&box, true, p, &view))
            fail_msg("point %u: outside %g, inside %g", k, (double)outside, (double)inside);
        if (k % 6 == 3 && (lum_facets_irradiance(&sheet, true, p, q.n).cosine_integral != 0.0f ||
                           lum_facets_irradiance(&sheet, true, p, lum_v3_neg(q.n)).cosine_integral != 0.0f))
            fail_msg("point %u: a sheet lights itself", k);
    }
}

/* A box flush with a turned ceiling, some of its corners at the horizon: by facets and by quads, as elsewhere. */
static void corners_at_the_horizon(void **state)
{
    (void)state;
    struct random_stream random = {6};
    struct lum_facets box;
    make(&box, half, 0, 6);
    const struct lum_vec3 up = {0, 1, 0};
    for (uint32_t k = 0; k < 20000; k++) {
        struct lum_vec3 p = {(float)(4.0 * random_double(&random) - 2.0), half.y + 1e-6f * (float)(k % 3),
                             (float)(4.0 * random_double(&random) - 2.0)};
        struct lum_vec3 n = lum_normalize(lum_v3(1e-7f * (float)(k % 5), -1.0f, 1e-7f * (float)(k % 7)));
        struct lum_vec3 beside = {p.x, 0.0f, p.z};
        if ((fabsf(p.x) <= half.x && fabsf(p.z) <= half.z) || is_level(beside))
            continue;
        double is = (double)lum_facets_irradiance(&box, false, p, n).cosine_integral, want = by_quads(half, 0, 6, p, n);
        double above = (double)lum_facets_irradiance(&box, false, p, up).cosine_integral;
        if (fabs(is - want) > 2e-4 * want + 3e-6 || above > 1e-4)
            fail_msg("point %u (%.9g %.9g %.9g): %g, by quads %g; above the horizon %g", k, (double)p.x, (double)p.y,
                     (double)p.z, is, want, above);
    }
}

static void what_hides_itself_has_no_outline(void **state)
{
    (void)state;
    struct lum_vec3 corner[LUM_FACETS_MAX][3];
    struct lum_facets f;
    uint32_t n = add_face(half, 0, corner);
    n += add_face(half, 2, corner + n); /* a corner of two walls: convex, but open */
    lum_facets_init(&f, n, (const struct lum_vec3(*)[3])corner, false);
    assert_false(f.outlined);
    lum_facets_init(&f, n, (const struct lum_vec3(*)[3])corner, true); /* seen from within */
    assert_false(f.outlined);

    n = add_face(half, 3, corner); /* an L: a third triangle beside */
    corner[n][0] = corner[0][0], corner[n][1] = corner[1][2], corner[n][2] = lum_v3(-1.0f, -half.y, 2.0f);
    lum_facets_init(&f, n + 1, (const struct lum_vec3(*)[3])corner, false);
    assert_false(f.outlined);

    struct lum_facets box;
    make(&box, half, 0, 6);
    for (uint32_t i = 0; i < 6; i++)
        add_face(half, i, corner + 2 * i);
    for (uint32_t i = 0; i < 2; i++) /* a sheet beside the box */
        for (uint32_t k = 0; k < 3; k++)
            corner[12 + i][k] = lum_v3_add(corner[i][k], lum_v3(3.0f, 0.0f, 0.0f));
    lum_facets_init(&f, 14, (const struct lum_vec3(*)[3])corner, false);
    assert_true(box.outlined && !f.outlined);
}

/* A transform that mirrors turns the winding round, and not which side shines. */
static void mirrored_ones_are_the_same(void **state)
{
    (void)state;
    struct lum_vec3 corner[LUM_FACETS_MAX][3];
    struct lum_facets box, mirrored;
    make(&box, half, 0, 6);
    for (uint32_t i = 0; i < 6; i++)
        add_face(half, i, corner + 2 * i);
    for (uint32_t i = 0; i < 12; i++)
        for (uint32_t k = 0; k < 3; k++)
            corner[i][k].x = -corner[i][k].x;
    lum_facets_init(&mirrored, 12, (const struct lum_vec3(*)[3])corner, true);
    assert_true(mirrored.outlined && mirrored.closed);
    struct random_stream random = {3};
    for (uint32_t k = 0; k < 1000; k++) {
        struct lum_vec3 p = any_point(&random, 2.0f), n = random_direction(&random);
        float a = lum_facets_irradiance(&box, false, p, n).cosine_integral;
        float b =
            lum_facets_irradiance(&mirrored, false, lum_v3(-p.x, p.y, p.z), lum_v3(-n.x, n.y, n.z)).cosine_integral;
        if (fabsf(a - b) > 1e-5f)
            fail_msg("point %u: %g, mirrored %g", k, (double)a, (double)b);
    }
}

/* The mean of cosines over N x N strata, of which a column may lie across two facets: with up to six in sight there are
 * five of these, each off by at most half its share, 1 / 2 N; where cosines bend at the horizon a column is off by less
 * than 4 / N of its share. */
#define N 128
static void samples_add_up(void **state)
{
    (void)state;
    struct random_stream random = {4};
    struct lum_facets box;
    make(&box, half, 0, 6);
    uint32_t near = 0;
    for (uint32_t k = 0; k < 120; k++) {
        struct lum_vec3 p = any_point(&random, 3.0f), n = random_direction(&random);
        struct lum_facets_view view;
        if (is_inside(half, p) || !lum_facets_look(&box, false, p, &view))
            continue;
        near++;
        double sum = 0.0, off = 0.0;
        for (uint32_t j = 0; j < N * N; j++) {
            struct lum_vec2 xi = {((float)(j % N) + 0.5f) / N, ((float)(j / N) + 0.5f) / N};
            struct lum_vec3 to = lum_facets_sample(&box, &view, p, xi), x = lum_v3_add(p, to);
            double beyond = fmax(fmax(fabs((double)x.x) - (double)half.x, fabs((double)x.y) - (double)half.y),
                                 fabs((double)x.z) - (double)half.z);
            off = fmax(off, fabs(beyond)); /* 0 on the box */
            sum += fmax((double)lum_dot(lum_normalize(to), n), 0.0);
        }
        double is = sum / (N * N) * view.solid_angle;
        double want = (double)lum_facets_irradiance(&box, false, p, n).cosine_integral;
        if (fabs(is - want) > (2.5 / N + 4.0 / N / N) * view.solid_angle + 1e-5 || off > 1e-4)
            fail_msg("point %u: %g by samples, %g is right; %g off the box", k, is, want, off);
    }
    assert_true(near > 30);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(outlines_are_their_faces),
        cmocka_unit_test(both_sides_shine),
        cmocka_unit_test(what_hides_itself_has_no_outline),
        cmocka_unit_test(mirrored_ones_are_the_same),
        cmocka_unit_test(samples_add_up),
        cmocka_unit_test(lamps_do_not_light_themselves),
        cmocka_unit_test(corners_at_the_horizon),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
