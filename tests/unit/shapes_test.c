/* Built-in shapes: closed where they should be, outward, of the size that was asked for. */
#include "tests/support/scene_fixture.h"

#include <stdlib.h>
#include <string.h>

static const char *const closed[] = {"box", "sphere", "cylinder", "cone", "torus", "knot", "figure", "bunny", "wobble"};

/* ---- closedness: every directed edge, by position, has its reverse exactly once ---- */

struct edge {
    float from[3], to[3];
};

static int compare_edges(const void *a, const void *b)
{
    return memcmp(a, b, sizeof(struct edge));
}

static void set_point(float *to, const float *from)
{
    for (int k = 0; k < 3; k++)
        to[k] = from[k] + 0.0f; /* -0 and 0 are one place */
}

static void assert_closed(const char *name, const struct lum_shape_mesh *m)
{
    bool may_touch = strcmp(name, "bunny") == 0; /* its paws, in one cell of the lattice: an edge for either sheet */
    size_t n = 3 * (size_t)m->n_triangles;
    struct edge *there = calloc(n, sizeof *there), *back = calloc(n, sizeof *back);
    assert_non_null(there);
    assert_non_null(back);
    for (size_t i = 0; i < n; i++) {
        const float *a = m->positions + 3 * (size_t)m->indices[i];
        const float *b = m->positions + 3 * (size_t)m->indices[i % 3 == 2 ? i - 2 : i + 1];
        set_point(there[i].from, a);
        set_point(there[i].to, b);
        set_point(back[i].from, b);
        set_point(back[i].to, a);
    }
    qsort(there, n, sizeof *there, compare_edges);
    qsort(back, n, sizeof *back, compare_edges);
    for (size_t i = 0; i < n; i++) {
        if (memcmp(&there[i], &back[i], sizeof *there) != 0)
            fail_msg("%s: an edge near (%g, %g, %g) is open", name, (double)there[i].from[0], (double)there[i].from[1],
                     (double)there[i].from[2]);
        if (i && !may_touch && memcmp(&there[i], &there[i - 1], sizeof *there) == 0)
            fail_msg("%s: an edge near (%g, %g, %g) is there twice", name, (double)there[i].from[0],
                     (double)there[i].from[1], (double)there[i].from[2]);
    }
    free(there);
    free(back);
}

/* Volume by the divergence theorem; positive when the winding is outward. */
static double volume(const struct lum_shape_mesh *m)
{
    double sum = 0.0;
    for (size_t i = 0; i < m->n_triangles; i++) {
        double p[3][3];
        for (size_t k = 0; k < 9; k++)
            p[k / 3][k % 3] = (double)m->positions[3 * (size_t)m->indices[3 * i + k / 3] + k % 3];
        sum += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) + p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
               p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    }
    return sum / 6.0;
}

static void make(const char *name, uint32_t around, uint32_t along, struct lum_shape_mesh *m)
{
    struct lum_shape_params params = {.size = {2, 3, 4}, .segments = {around, along}};
    CHECK_OK(lum_shape_make(name, &params, m, err));
}

static void closed_shapes_are_closed_and_outward(void **state)
{
    (void)state;
    for (size_t i = 0; i < LUM_ARRAY_LEN(closed); i++) {
        const uint32_t segments[][2] = {{0, 0}, {16, 16}, {37, 23}};
        for (size_t k = 0; k < LUM_ARRAY_LEN(segments); k++) {
            struct lum_shape_mesh m;
            make(closed[i], segments[k][0], segments[k][1], &m);
            assert_closed(closed[i], &m);
            if (!(volume(&m) > 0.0))
                fail_msg("%s is inside out", closed[i]);
            lum_shape_finish(&m);
        }
    }
}

static void volumes_are_those_of_the_solids(void **state)
{
    (void)state;
    const double pi = 3.14159265358979;
    /* size 2 x 3 x 4: box 24, ellipsoid pi/6 of it, cylinder pi/4, cone pi/12. An n-gon has (n / 2 pi) sin(2 pi / n) of
     * the circle's area: 4e-5 less at n = 400. */
    const struct {
        const char *name;
        double volume;
    } solids[] = {
        {"box", 24.0}, {"sphere", 24.0 * pi / 6.0}, {"cylinder", 24.0 * pi / 4.0}, {"cone", 24.0 * pi / 12.0}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(solids); i++) {
        struct lum_shape_mesh m;
        make(solids[i].name, 400, 400, &m);
        assert_true(fabs(volume(&m) / solids[i].volume - 1.0) < 1.5e-4); /* the sphere: both directions, 1e-4 */
        lum_shape_finish(&m);
    }
}

static void every_shape_is_well_formed(void **state)
{
    (void)state;
    for (const char *const *name = lum_shape_names(); *name; name++) {
        struct lum_shape_mesh m;
        make(*name, 0, 0, &m);
        float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
        for (size_t i = 0; i < m.n_vertices; i++) {
            for (size_t k = 0; k < 3; k++) {
                lo[k] = fminf(lo[k], m.positions[3 * i + k]);
                hi[k] = fmaxf(hi[k], m.positions[3 * i + k]);
            }
            struct lum_vec3 n = lum_v3(m.normals[3 * i], m.normals[3 * i + 1], m.normals[3 * i + 2]);
            assert_true(fabsf(lum_length(n) - 1.0f) < 1e-6f);
            assert_true(m.uvs[2 * i] >= 0.0f && m.uvs[2 * i] <= 1.0f && m.uvs[2 * i + 1] >= 0.0f &&
                        m.uvs[2 * i + 1] <= 1.0f);
        }
        const float size[3] = {2.0f, 3.0f, 4.0f};
        for (int k = 0; k < 3; k++) {
            bool flat = k == 1 && (strcmp(*name, "quad") == 0 || strcmp(*name, "disc") == 0);
            bool sways = k == 0 && strcmp(*name, "wobble") == 0; /* its size is that of all poses */
            assert_true(fabsf(hi[k] - lo[k] - (flat ? 0.0f : size[k])) < (sways ? 2e-2f : 2e-6f));
            assert_true(fabsf(hi[k] + lo[k]) < (sways ? 2e-2f : 2e-6f));
        }
        uint32_t against = 0; /* corners whose normal points away from their face's */
        for (size_t i = 0; i < m.n_triangles; i++) {
            struct lum_vec3 p[3], n[3];
            for (size_t k = 0; k < 3; k++) {
                assert_true(m.indices[3 * i + k] < m.n_vertices);
                memcpy(&p[k], m.positions + 3 * (size_t)m.indices[3 * i + k], sizeof p[k]);
                memcpy(&n[k], m.normals + 3 * (size_t)m.indices[3 * i + k], sizeof n[k]);
            }
            struct lum_vec3 face = lum_cross(lum_v3_sub(p[1], p[0]), lum_v3_sub(p[2], p[0]));
            assert_true(lum_length(face) > 0.0f);
            for (int k = 0; k < 3; k++)
                against += lum_dot(face, n[k]) < 0.0f;
        }
        /* sharp valleys of the statue's folds, and where the bunny's paws meet, may turn a few vertex normals over a
         * coarse face's edge */
        bool has_valleys = strcmp(*name, "figure") == 0 || strcmp(*name, "bunny") == 0;
        assert_true(against <= (has_valleys ? 3 * m.n_triangles / 100 : 0));
        lum_shape_finish(&m);
    }
}

static void dense_ones_are_dense(void **state)
{
    (void)state;
    struct lum_shape_mesh m;
    make("figure", 0, 0, &m);
    assert_in_range(m.n_triangles, 23000, 25000);
    lum_shape_finish(&m);
    make("bunny", 0, 0, &m);
    assert_in_range(m.n_triangles, 15000, 17000);
    lum_shape_finish(&m);
}

/* A pose is a shear, slice by slice: it keeps the volume and the triangles, and stays in the box of all poses. */
static void a_wobble_bends_and_nothing_else(void **state)
{
    (void)state;
    const double amplitude = 0.35, around = 48;
    /* an n-gon's area times the height, with half axes 1 - amplitude of half the width, and half the depth */
    const double slice = 0.5 * around * sin(2.0 * 3.14159265358979 / around) * (1.0 - amplitude) * 1.0 * 2.0;
    struct lum_shape_params params = {.size = {2, 3, 4}, .segments = {48, 64}, .param = {amplitude, 1.5}};
    struct lum_shape_mesh first;
    CHECK_OK(lum_shape_make("wobble", &params, &first, err));
    for (int pose = -3; pose <= 12; pose++) {
        struct lum_shape_mesh m;
        params.param[2] = pose / 8.0;
        CHECK_OK(lum_shape_make("wobble", &params, &m, err));
        assert_int_equal(m.n_triangles, first.n_triangles);
        assert_memory_equal(m.indices, first.indices, 12 * (size_t)m.n_triangles);
        double v = volume(&m);
        if (!(fabs(v / (3.0 * slice) - 1.0) < 1e-5)) /* rounding of positions to float: 1e-7 each */
            fail_msg("pose %d: a volume of %.9g, not %.9g", pose, v, 3.0 * slice);
        float moved = 0.0f;
        for (size_t i = 0; i < 3 * (size_t)m.n_vertices; i += 3) {
            assert_true(fabsf(m.positions[i]) <= 1.0f + 1e-6f && fabsf(m.positions[i + 2]) <= 2.0f + 1e-6f);
            assert_true(m.positions[i + 1] == first.positions[i + 1] && m.positions[i + 2] == first.positions[i + 2]);
            moved = fmaxf(moved, fabsf(m.positions[i] - first.positions[i]));
        }
        assert_true(pose % 8 == 0 ? moved < 1e-6f : moved > 0.2f); /* a phase of 1 is a phase of 0 */
        lum_shape_finish(&m);
    }
    lum_shape_finish(&first);
}

static void limits_are_named(void **state)
{
    (void)state;
    struct lum_shape_mesh m = {.n_vertices = 7};
    struct lum_error refusal;
    struct lum_shape_params params = {.segments = {2, 0}};
    assert_int_equal(lum_shape_make("sphere", &params, &m, &refusal), LUM_ERR_LIMIT);
    assert_string_equal(refusal.field, "segments");
    params.segments[0] = 3;
    CHECK_OK(lum_shape_make("sphere", &params, &m, err));
    lum_shape_finish(&m);
    params.segments[0] = 2049;
    assert_int_equal(lum_shape_make("sphere", &params, &m, &refusal), LUM_ERR_LIMIT);
    params.segments[0] = 2048;
    params.segments[1] = 2;
    CHECK_OK(lum_shape_make("sphere", &params, &m, err));
    lum_shape_finish(&m);
    params = (struct lum_shape_params){.size = {1, -1, 1}};
    assert_int_equal(lum_shape_make("box", &params, &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "size");
    params = (struct lum_shape_params){.size = {(double)NAN, 1, 1}};
    assert_int_equal(lum_shape_make("box", &params, &m, &refusal), LUM_ERR_INVALID);
    params = (struct lum_shape_params){.param = {1.5}};
    assert_int_equal(lum_shape_make("torus", &params, &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "param");
    params = (struct lum_shape_params){.segments = {161, 0}};
    assert_int_equal(lum_shape_make("bunny", &params, &m, &refusal), LUM_ERR_LIMIT);
    assert_string_equal(refusal.field, "segments");
    params = (struct lum_shape_params){.param = {0.95}};
    assert_int_equal(lum_shape_make("wobble", &params, &m, &refusal), LUM_ERR_INVALID);
    params = (struct lum_shape_params){.param = {0, 0, (double)INFINITY}};
    assert_int_equal(lum_shape_make("wobble", &params, &m, &refusal), LUM_ERR_INVALID);
    assert_string_equal(refusal.field, "param");
    params = (struct lum_shape_params){.param = {(double)NAN}};
    assert_int_equal(lum_shape_make("wobble", &params, &m, &refusal), LUM_ERR_INVALID);
    assert_int_equal(lum_shape_make("knot", &params, &m, &refusal), LUM_ERR_INVALID);
    assert_int_equal(lum_shape_make("figure", &params, &m, &refusal), LUM_ERR_INVALID);
    assert_int_equal(lum_shape_make("teapot", &params, &m, &refusal), LUM_ERR_NOT_FOUND);
    assert_int_equal(lum_shape_make(NULL, &params, &m, &refusal), LUM_ERR_NOT_FOUND);
}

static void failing_allocations_leave_nothing(void **state)
{
    (void)state;
    struct lum_shape_params params = {.segments = {0, 0}};
    for (const char *const *name = lum_shape_names(); *name; name++)
        for (uint64_t k = 1; k <= (strcmp(*name, "bunny") == 0 ? 6u : 4u); k++) { /* its lattice comes first */
            struct lum_shape_mesh m = {.n_vertices = 7};
            lum_alloc_fail_after(k);
            enum lum_status status = lum_shape_make(*name, &params, &m, NULL);
            lum_alloc_fail_after(0);
            assert_int_equal(status, LUM_ERR_NOMEM);
            assert_int_equal(m.n_vertices, 7); /* untouched */
        }
}

/* What is counted is what is made, and a bunny has no more than was counted. */
static void triangles_are_counted_before_they_are_made(void **state)
{
    (void)state;
    static const uint32_t segments[][2] = {{0, 0}, {16, 16}, {37, 51}, {160, 20}};
    for (const char *const *name = lum_shape_names(); *name; name++)
        for (size_t k = 0; k < LUM_ARRAY_LEN(segments); k++) {
            struct lum_shape_params params = {.segments = {segments[k][0], segments[k][1]}};
            struct lum_shape_mesh m;
            uint32_t n;
            CHECK_OK(lum_shape_make(*name, &params, &m, err));
            CHECK_OK(lum_shape_count(*name, &params, &n, err));
            assert_true(strcmp(*name, "bunny") == 0 ? m.n_triangles <= n && n < 2 * m.n_triangles : n == m.n_triangles);
            lum_shape_finish(&m);
        }
    struct lum_shape_params params = {.segments = {2049, 0}};
    uint32_t n;
    assert_int_equal(lum_shape_count("box", &params, &n, NULL), LUM_ERR_LIMIT);
    assert_int_equal(lum_shape_count("cow", &params, &n, NULL), LUM_ERR_NOT_FOUND);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_shapes_are_closed_and_outward),
        cmocka_unit_test(volumes_are_those_of_the_solids),
        cmocka_unit_test(every_shape_is_well_formed),
        cmocka_unit_test(dense_ones_are_dense),
        cmocka_unit_test(a_wobble_bends_and_nothing_else),
        cmocka_unit_test(limits_are_named),
        cmocka_unit_test(failing_allocations_leave_nothing),
        cmocka_unit_test(triangles_are_counted_before_they_are_made),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
