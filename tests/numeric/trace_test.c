/* Hard cases of tracing: scale, place, broken input, closed rooms. Those in brackets are rows of the table of
 * hard cases in core/NOTES.md. */
#include "tests/support/scene_fixture.h"

#include <stdio.h>
#include <string.h>

#include "core/accel/trace.h"
#include "core/scene/scene.h"
#include "core/scene/surface.h"

static struct lum_rays rays;
static struct lum_hits hits;

/* The shading code's way to leave a surface: barycentric point, moved off to the side of the ray. */
static struct lum_vec3 leave(const struct lum_surface *s, struct lum_vec3 d)
{
    return lum_ray_offset(s->p, lum_dot(s->ng, d) >= 0.0f ? s->ng : lum_v3_neg(s->ng));
}

static struct lum_affined random_placement(struct random_stream *r, double scale, double offset)
{
    struct lum_vec3 axis = random_direction(r);
    double a = 6.28 * random_double(r), c = cos(a), s = sin(a);
    double x = (double)axis.x, y = (double)axis.y, z = (double)axis.z;
    double m[3][3] = {{c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s},
                      {y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s},
                      {z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)}};
    struct lum_affined t;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            t.m[i][j] = scale * m[i][j];
        t.m[i][3] = offset + scale * 8.0 * (random_double(r) - 0.5);
    }
    return t;
}

/* [H1] Convex objects: a ray that leaves the outside away from the normal can only come back by hitting its own
 * surface.
 */
static void count_self_hits(const struct lum_snapshot *s, struct random_stream *r, uint32_t *n_tested, uint32_t *n_self)
{
    struct lum_vec3 centre = lum_v3_mul(lum_v3_add(s->bounds_lo, s->bounds_hi), 0.5f);
    float radius = 0.5f * lum_length(lum_v3_sub(s->bounds_hi, s->bounds_lo));
    rays.n = LUM_RAY_BATCH;
    for (uint32_t i = 0; i < rays.n; i++) {
        struct lum_vec3 o = lum_v3_mad(centre, random_direction(r), 2.0f * radius);
        struct lum_vec3 to = lum_v3_mad(centre, random_direction(r), radius * (float)random_double(r));
        set_ray(&rays, i, o, lum_normalize(lum_v3_sub(to, o)));
    }
    trace(s, &rays, &hits);
    uint32_t n = 0;
    static uint32_t from[LUM_RAY_BATCH];
    static struct lum_rays next;
    for (uint32_t i = 0; i < rays.n; i++) {
        if (hits.object[i] == LUM_NO_OBJECT)
            continue;
        struct lum_surface surface;
        struct lum_vec3 d = lum_v3(rays.dx[i], rays.dy[i], rays.dz[i]);
        lum_snapshot_surface(s, &hits, i, d, &surface);
        if (surface.backface)
            continue; /* slipped past an edge to the inside of the face beyond: from there its own object is all around
                       */
        struct lum_vec3 out = random_direction(r);
        if (lum_dot(out, surface.ng) < 0.0f)
            out = lum_v3_neg(out);
        set_ray(&next, n, leave(&surface, out), out);
        from[n++] = hits.object[i];
    }
    next.n = n;
    trace(s, &next, &hits);
    for (uint32_t i = 0; i < n; i++)
        *n_self += hits.object[i] == from[i];
    *n_tested += n;
}

static void no_self_hits_at_any_scale_and_offset(void **state)
{
    struct fixture *f = *state;
    put_shape(f->scene, "ball", "sphere", 32, 16);
    put_shape(f->scene, "box", "box", 1, 1);
    put_material(f->scene, "white");
    struct random_stream r = {1};
    const double scales[] = {1e-6, 1e-3, 1.0, 1e3, 1e6}, offsets[] = {0.0, 10.0, 1e4};
    for (size_t k = 0; k < LUM_ARRAY_LEN(scales); k++)
        for (size_t o = 0; o < LUM_ARRAY_LEN(offsets); o++) {
            for (int i = 0; i < 8; i++) {
                char id[16];
                snprintf(id, sizeof id, "o%d", i);
                put_object(f->scene, id, i & 1 ? "box" : "ball", "white",
                           random_placement(&r, scales[k], offsets[o] * scales[k]));
            }
            const struct lum_snapshot *s = commit(f);
            uint32_t n_tested = 0, n_self = 0;
            while (n_tested < 20000)
                count_self_hits(s, &r, &n_tested, &n_self);
            if (n_self)
                fail_msg("%u of %u rays hit their own surface at scale %g, offset %g scales", n_self, n_tested,
                         scales[k], offsets[o]);
            lum_snapshot_unref(s);
        }
}

/* [H1] A sheet 1e-3 m above another, in a room of 10 m: every ray that leaves the lower one upwards must meet it. */
static void sheets_a_millimetre_apart_are_not_missed(void **state)
{
    struct fixture *f = *state;
    put_shape(f->scene, "quad", "quad", 1, 1);
    put_material(f->scene, "white");
    put_object(f->scene, "lower", "quad", "white", scaled_at(10, 0, 0, 0));
    put_object(f->scene, "upper", "quad", "white", scaled_at(10, 0, 1e-3, 0));
    put_object(f->scene, "wall", "quad", "white", scaled_at(1, 0, 10, 0));
    const struct lum_snapshot *s = commit(f);
    struct random_stream r = {2};
    uint32_t missed = 0;
    for (int round = 0; round < 40; round++) {
        rays.n = LUM_RAY_BATCH;
        for (uint32_t i = 0; i < rays.n; i++) {
            double x = 9.0 * (random_double(&r) - 0.5), z = 9.0 * (random_double(&r) - 0.5);
            set_ray(&rays, i, to_scene(s, x, -1.0, z), lum_v3(0.0f, 1.0f, 0.0f));
        }
        trace(s, &rays, &hits);
        static struct lum_rays up;
        up.n = rays.n;
        for (uint32_t i = 0; i < rays.n; i++) {
            struct lum_surface surface;
            lum_snapshot_surface(s, &hits, i, lum_v3(0.0f, 1.0f, 0.0f), &surface);
            assert_string_equal(s->instances[surface.instance].id, "lower");
            struct lum_vec3 d = random_direction(&r);
            d = lum_normalize(lum_v3(d.x, fabsf(d.y) + 0.02f, d.z)); /* reaches the upper sheet within 5 cm */
            set_ray(&up, i, leave(&surface, d), d);
        }
        trace(s, &up, &hits);
        for (uint32_t i = 0; i < up.n; i++)
            missed += hits.object[i] == LUM_NO_OBJECT || strcmp(s->instances[hits.object[i]].id, "upper") != 0;
    }
    assert_int_equal(missed, 0);
    lum_snapshot_unref(s);
}

/* A few objects, all coordinates multiplied by scale and then moved. */
static const struct lum_snapshot *placed_scene(struct fixture *f, double scale, double x, double y, double z)
{
    lum_scene_destroy(f->scene);
    f->scene = NULL;
    CHECK_OK(lum_scene_create(f->device, &f->scene, err));
    put_shape(f->scene, "ball", "sphere", 32, 16);
    put_shape(f->scene, "knot", "knot", 64, 12);
    put_material(f->scene, "white");
    for (int i = 0; i < 4; i++) {
        char id[16];
        snprintf(id, sizeof id, "o%d", i);
        put_object(f->scene, id, i & 1 ? "knot" : "ball", "white",
                   scaled_at(scale * (1.0 + i), x + scale * 3.0 * i, y + scale * 0.5 * i, z - scale * 2.0 * i));
    }
    return commit(f);
}

/* Rays between random points of the scene's bounds; result in hits. */
static void trace_everywhere(const struct lum_snapshot *s, uint64_t seed)
{
    struct random_stream r = {seed};
    rays.n = LUM_RAY_BATCH;
    for (uint32_t i = 0; i < rays.n; i++) {
        struct lum_vec3 p[2];
        for (int k = 0; k < 2; k++)
            p[k] = lum_v3(s->bounds_lo.x + (s->bounds_hi.x - s->bounds_lo.x) * (float)random_double(&r),
                          s->bounds_lo.y + (s->bounds_hi.y - s->bounds_lo.y) * (float)random_double(&r),
                          s->bounds_lo.z + (s->bounds_hi.z - s->bounds_lo.z) * (float)random_double(&r));
        set_ray(&rays, i, p[0], lum_v3_sub(p[1], p[0]));
    }
    memset(&hits, 0, sizeof hits);
    trace(s, &rays, &hits);
    for (uint32_t i = 0; i < rays.n; i++)
        if (hits.object[i] == LUM_NO_OBJECT) /* the other fields of a miss are undefined */
            hits.t[i] = hits.u[i] = hits.v[i] = hits.ngx[i] = hits.ngy[i] = hits.ngz[i] = 0.0f, hits.prim[i] = 0;
}

/* [H2], [H3] Everything moved by a multiple of the grid, or scaled by a power of two, gets the same bits. */
static void powers_of_two_change_no_bit(void **state)
{
    struct fixture *f = *state;
    static struct lum_hits reference;
    const struct lum_snapshot *s = placed_scene(f, 1.0, 0, 0, 0);
    trace_everywhere(s, 3);
    reference = hits;
    uint32_t n_hit = 0;
    for (uint32_t i = 0; i < rays.n; i++)
        n_hit += hits.object[i] != LUM_NO_OBJECT;
    assert_true(n_hit > rays.n / 4);
    lum_snapshot_unref(s);
    const double places[][4] = {{0x1p20, 0, 0, 0},       {0x1p-20, 0, 0, 0},       {1, 0x1p20, 0, 0},
                                {1, -0x1p20, 0x1p16, 5}, {0x1p-10, 0x1p3, 0, -64}, {0x1p10, 0x1p30, 0x1p30, 0x1p30}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(places); k++) {
        s = placed_scene(f, places[k][0], places[k][1], places[k][2], places[k][3]);
        trace_everywhere(s, 3);
        if (memcmp(&hits, &reference, sizeof hits) != 0)
            fail_msg("hits differ at scale %g, place (%g, %g, %g)", places[k][0], places[k][1], places[k][2],
                     places[k][3]);
        lum_snapshot_unref(s);
    }
}

/* [H2] Anywhere else positions round to 2^-53 of the offset, so distances agree to that over the scene's size, far
 * below the precision of float: (1e9 / 1e1) * 2^-53 < 2^-24. */
static void far_from_the_origin_nothing_is_lost(void **state)
{
    struct fixture *f = *state;
    static struct lum_hits reference;
    const struct lum_snapshot *s = placed_scene(f, 1.0, 0, 0, 0);
    trace_everywhere(s, 4);
    reference = hits;
    lum_snapshot_unref(s);
    s = placed_scene(f, 1.0, 1234567.891, -7654321.123, 1e9 / 3.0);
    trace_everywhere(s, 4);
    uint32_t n_differ = 0;
    for (uint32_t i = 0; i < rays.n; i++) {
        if (hits.object[i] != reference.object[i])
            n_differ++; /* at a silhouette */
        else if (hits.object[i] != LUM_NO_OBJECT)
            assert_true(fabsf(hits.t[i] - reference.t[i]) <= 1e-3f);
    }
    assert_true(n_differ <= 2);
    lum_snapshot_unref(s);
}

/* [H9] From inside a closed room every ray hits, also those aimed at edges. Embree's robust edge tests give
 * neighbouring triangles the same answer about their common edge, but nothing binds the answers of all edges around one
 * vertex: of rays aimed exactly at a corner 6 in a million pass (measured with every instruction set), so those may be
 * 1e-4. */
static void leak_test(const struct lum_snapshot *s, struct random_stream *r, uint32_t n_rays)
{
    uint32_t n_corner = 0;
    struct lum_vec3 centre = lum_v3_mul(lum_v3_add(s->bounds_lo, s->bounds_hi), 0.5f);
    struct lum_vec3 half = lum_v3_mul(lum_v3_sub(s->bounds_hi, s->bounds_lo), 0.5f);
    for (uint32_t done = 0; done < n_rays; done += LUM_RAY_BATCH) {
        rays.n = LUM_RAY_BATCH;
        for (uint32_t i = 0; i < rays.n; i++) {
            float c[3];
            for (int k = 0; k < 3; k++)
                c[k] = (float)(2.0 * random_double(r) - 1.0);
            uint32_t aim = i % 4; /* 1: at an edge, 2: at a corner, else anywhere */
            for (uint32_t k = 0; aim && aim < 3 && k < 1 + aim; k++)
                c[(k + i / 4) % 3] = c[k] < 0.0f ? -1.0f : 1.0f;
            struct lum_vec3 to = lum_v3(centre.x + half.x * c[0], centre.y + half.y * c[1], centre.z + half.z * c[2]);
            struct lum_vec3 o = lum_v3(centre.x + 0.9f * half.x * (float)(2.0 * random_double(r) - 1.0),
                                       centre.y + 0.9f * half.y * (float)(2.0 * random_double(r) - 1.0),
                                       centre.z + 0.9f * half.z * (float)(2.0 * random_double(r) - 1.0));
            set_ray(&rays, i, o, lum_normalize(lum_v3_sub(to, o)));
        }
        trace(s, &rays, &hits);
        for (uint32_t i = 0; i < rays.n; i++)
            if (hits.object[i] == LUM_NO_OBJECT && i % 4 == 2)
                n_corner++;
            else if (hits.object[i] == LUM_NO_OBJECT)
                fail_msg("ray from (%a, %a, %a) along (%a, %a, %a) left a closed room", (double)rays.ox[i],
                         (double)rays.oy[i], (double)rays.oz[i], (double)rays.dx[i], (double)rays.dy[i],
                         (double)rays.dz[i]);
    }
    assert_true(n_corner <= n_rays / 40000 + 1);
}

static void closed_rooms_do_not_leak(void **state)
{
    struct fixture *f = *state;
    put_shape(f->scene, "room", "box", 4, 0);
    put_material(f->scene, "white");
    struct random_stream r = {5};
    put_object(f->scene, "room", "room", "white", scaled_at(8, 1, 2, 3));
    const struct lum_snapshot *s = commit(f);
    leak_test(s, &r, 1000000);
    lum_snapshot_unref(s);
    put_object(f->scene, "room", "room", "white", (struct lum_affined){{{40, 0, 0, 7}, {0, 3, 0, 1}, {0, 0, 0.2, -5}}});
    s = commit(f);
    leak_test(s, &r, 200000);
    lum_snapshot_unref(s);
}

/* [H4] Triangles without area, with NaN or with an index that is out of range: as if they were not there. */
static void broken_triangles_are_dropped_and_counted(void **state)
{
    struct fixture *f = *state;
    const double p[] = {0, 0, 0, 1, 0, 0, 0, 0, 1, (double)NAN, 0, 0, 2, 0, 0, (double)INFINITY, 1, 1, 1e300, 0, 0};
    const uint32_t good[] = {0, 2, 1};
    const uint32_t mixed[] = {0, 0, 1, 0, 2, 1, 0, 1, 4, 0, 1, 3, 0, 5, 1, 0, 1, 99, 0, 6, 2};
    put_material(f->scene, "white");
    struct lum_mesh_desc desc = {.positions = p, .indices = good, .n_vertices = 7, .n_triangles = 1};
    CHECK_OK(lum_scene_put_mesh(f->scene, "m", &desc, err));
    put_object(f->scene, "o", "m", "white", at(0, 0, 0));
    const struct lum_snapshot *s = commit(f);
    assert_int_equal(lum_scene_dropped_triangles(f->scene), 0);
    static struct lum_hits reference;
    trace_everywhere(s, 6);
    reference = hits;
    lum_snapshot_unref(s);
    desc.indices = mixed;
    desc.n_triangles = 7;
    CHECK_OK(lum_scene_put_mesh(f->scene, "m", &desc, err));
    s = commit(f);
    assert_int_equal(lum_scene_dropped_triangles(f->scene), 6);
    assert_int_equal(s->n_triangles, 1);
    trace_everywhere(s, 6);
    assert_memory_equal(&hits, &reference, sizeof hits);
    lum_snapshot_unref(s);
    desc.n_triangles = 1; /* nothing is left: the object is there, but no ray meets it */
    CHECK_OK(lum_scene_put_mesh(f->scene, "m", &desc, err));
    s = commit(f);
    assert_int_equal(s->n_instances, 0);
    lum_snapshot_unref(s);
}

/* [H7] Turning every triangle over changes nothing that a two-sided material sees. */
static void winding_changes_only_the_side(void **state)
{
    struct fixture *f = *state;
    struct lum_shape_params params = {.size = {1, 1, 1}};
    struct lum_shape_mesh m;
    CHECK_OK(lum_shape_make("knot", &params, &m, err));
    struct lum_mesh_desc desc = {
        .positions_f = m.positions, .indices = m.indices, .n_vertices = m.n_vertices, .n_triangles = m.n_triangles};
    put_material(f->scene, "white");
    static struct lum_surface surface[2][LUM_RAY_BATCH];
    static struct lum_hits found[2];
    for (int k = 0; k < 2; k++) {
        for (uint32_t i = 0; k == 1 && i < m.n_triangles; i++) {
            uint32_t swap = m.indices[3 * i + 1];
            m.indices[3 * i + 1] = m.indices[3 * i + 2];
            m.indices[3 * i + 2] = swap;
        }
        CHECK_OK(lum_scene_put_mesh(f->scene, "m", &desc, err));
        put_object(f->scene, "o", "m", "white", at(0, 0, 0));
        const struct lum_snapshot *s = commit(f);
        trace_everywhere(s, 8);
        found[k] = hits;
        for (uint32_t i = 0; i < rays.n; i++)
            if (hits.object[i] != LUM_NO_OBJECT)
                lum_snapshot_surface(s, &hits, i, lum_v3(rays.dx[i], rays.dy[i], rays.dz[i]), &surface[k][i]);
        lum_snapshot_unref(s);
    }
    for (uint32_t i = 0; i < rays.n; i++) {
        assert_int_equal(found[0].object[i], found[1].object[i]);
        if (found[0].object[i] == LUM_NO_OBJECT)
            continue;
        assert_true(surface[0][i].backface != surface[1][i].backface);
        struct lum_vec3 dp = lum_v3_sub(surface[0][i].p, surface[1][i].p);
        struct lum_vec3 dn = lum_v3_sub(surface[0][i].ng, surface[1][i].ng);
        assert_true(lum_length(dp) < 1e-4f); /* a few ulps of 32 */
        assert_true(lum_length(dn) < 1e-5f);
    }
    lum_shape_finish(&m);
}

/* Positions of a waving sheet at a time. */
static void wave(float *positions, uint32_t side, double time)
{
    for (uint32_t j = 0; j <= side; j++)
        for (uint32_t i = 0; i <= side; i++) {
            float *p = positions + 3 * (size_t)(j * (side + 1) + i);
            p[0] = (float)i / (float)side - 0.5f;
            p[2] = (float)j / (float)side - 0.5f;
            p[1] = (float)(0.2 * sin(time + 6.0 * i / side) * cos(0.7 * time + 5.0 * j / side));
        }
}

/* A refitted structure finds the same hits as one built for the pose, in a hurry or not. */
static void refit_equals_rebuild(void **state)
{
    struct fixture *f = *state;
    enum { SIDE = 24 };
    static float positions[(SIDE + 1) * (SIDE + 1) * 3];
    static uint32_t indices[SIDE * SIDE * 6];
    uint32_t n = 0;
    for (uint32_t j = 0; j < SIDE; j++)
        for (uint32_t i = 0; i < SIDE; i++) {
            uint32_t a = j * (SIDE + 1) + i, b = a + SIDE + 1, quad[6] = {a, b, a + 1, b, b + 1, a + 1};
            memcpy(indices + n, quad, sizeof quad);
            n += 6;
        }
    put_material(f->scene, "white");
    struct lum_mesh_desc desc = {.positions_f = positions,
                                 .indices = indices,
                                 .n_vertices = (SIDE + 1) * (SIDE + 1),
                                 .n_triangles = SIDE * SIDE * 2,
                                 .deforming = true};
    for (int pose = 0; pose < 6; pose++) {
        wave(positions, SIDE, 0.9 * pose);
        CHECK_OK(lum_scene_put_mesh(f->scene, "sheet", &desc, err));
        put_object(f->scene, "o", "sheet", "white", at(0, 0, 0));
        const struct lum_snapshot *s = commit(f);
        trace_everywhere(s, 9);
        static struct lum_hits refitted;
        refitted = hits;
        const struct lum_mesh *mesh = s->instances[0].mesh;
        for (int quick = 0; quick < 2; quick++) {
            struct lum_accel_mesh *fresh = NULL;
            CHECK_OK(lum_accel_mesh_create(f->device, mesh->triangles, quick ? LUM_TREE_QUICK : LUM_TREE_FAST, NULL,
                                           &fresh, err));
            struct lum_accel_instance instance = {fresh, s->instances[0].local_to_scene};
            struct lum_accel_top *top = NULL;
            CHECK_OK(lum_accel_top_create(f->device, &instance, 1, NULL, 0, &top, err));
            struct lum_snapshot copy = {.top = top, .bounds_lo = s->bounds_lo, .bounds_hi = s->bounds_hi};
            trace_everywhere(&copy, 9);
            assert_memory_equal(&hits, &refitted, sizeof hits);
            lum_accel_top_unref(top);
            lum_accel_mesh_unref(fresh);
        }
        lum_snapshot_unref(s);
    }
}

/* Emitter shapes: hit where the closed form says, with the light's own normal, hidden from camera rays when asked. */
static void emitter_shapes_are_where_they_should_be(void **state)
{
    struct fixture *f = *state;
    struct lum_light_desc l = light_desc(&lum_light_kind_quad); /* 1 x 1 at (0, 2, 0), u x v = -y */
    put_light(f->scene, "a-quad", &l);
    l = light_desc(&lum_light_kind_disc);
    l.position.x = 3;
    put_light(f->scene, "b-disc", &l);
    l = light_desc(&lum_light_kind_sphere);
    l.position.x = -3;
    l.camera_visible = false;
    put_light(f->scene, "c-sphere", &l);
    const struct lum_snapshot *s = commit(f);
    struct random_stream r = {10};
    const double x[] = {0, 3, -3};
    for (int round = 0; round < 20; round++) {
        rays.n = 250; /* not a multiple of 16 */
        static bool inside[LUM_RAY_BATCH];
        for (uint32_t i = 0; i < rays.n; i++) {
            double dx = 1.2 * (random_double(&r) - 0.5), dz = 1.2 * (random_double(&r) - 0.5), rr = dx * dx + dz * dz;
            set_ray(&rays, i, to_scene(s, x[i % 3] + dx, 0, dz), lum_v3(0.0f, 1.0f, 0.0f));
            inside[i] = i % 3 == 0 ? fabs(dx) < 0.5 && fabs(dz) < 0.5 : rr < 0.0625;
        }
        trace(s, &rays, &hits);
        for (uint32_t i = 0; i < rays.n; i++) {
            assert_int_equal(hits.object[i], inside[i] ? i % 3 : LUM_NO_OBJECT);
            if (!inside[i])
                continue;
            struct lum_surface surface;
            lum_snapshot_surface(s, &hits, i, lum_v3(0.0f, 1.0f, 0.0f), &surface);
            assert_int_equal(surface.light, i % 3);
            assert_int_equal(surface.instance, LUM_NO_OBJECT);
            assert_false(surface.backface);
            assert_true(surface.ng.y < 0.0f);
            /* the point lies on the ray: a few ulps of the scene's 64 units, worse on the sphere's rim by 1 / cos */
            float slack = i % 3 == 2 ? 2e-5f / fmaxf(-surface.ng.y, 0.02f) : 2e-5f;
            assert_true(fabsf(surface.p.x - rays.ox[i]) < slack && fabsf(surface.p.z - rays.oz[i]) < slack);
            assert_true(fabsf(surface.p.y - (rays.oy[i] + hits.t[i])) < slack);
        }
    }
    uint64_t bad = 0;
    const struct lum_trace camera = {.top = s->top, .camera = true, .bad_rays = &bad};
    rays.n = 3;
    for (uint32_t i = 0; i < 3; i++)
        set_ray(&rays, i, to_scene(s, x[i], 0, 0), lum_v3(0.0f, 1.0f, 0.0f));
    lum_trace_closest(&camera, &rays, &hits);
    assert_int_equal(hits.object[0], 0);
    assert_int_equal(hits.object[1], 1);
    assert_int_equal(hits.object[2], LUM_NO_OBJECT);
    lum_snapshot_unref(s);
}

/* Hits do not depend on where in a batch a ray lies, and closest and any agree about tfar. */
static void batches_of_any_length_agree(void **state)
{
    struct fixture *f = *state;
    const struct lum_snapshot *s = placed_scene(f, 1.0, 0, 0, 0);
    trace_everywhere(s, 11);
    static struct lum_hits full;
    static struct lum_rays all;
    full = hits;
    all = rays;
    uint64_t bad = 0;
    const struct lum_trace t = {.top = s->top, .bad_rays = &bad},
                           coherent = {.top = s->top, .bad_rays = &bad, .coherent = true};
    for (uint32_t n = 1; n <= 33; n += 4) {
        for (uint32_t i = 0; i < n; i++)
            set_ray(&rays, i, lum_v3(all.ox[i + 7], all.oy[i + 7], all.oz[i + 7]),
                    lum_v3(all.dx[i + 7], all.dy[i + 7], all.dz[i + 7]));
        rays.n = n;
        static uint8_t occluded[LUM_RAY_BATCH];
        lum_trace_closest(n & 4 ? &coherent : &t, &rays, &hits);
        for (uint32_t i = 0; i < n; i++) {
            assert_int_equal(hits.object[i], full.object[i + 7]);
            if (hits.object[i] != LUM_NO_OBJECT)
                assert_memory_equal(&hits.t[i], &full.t[i + 7], sizeof(float));
            rays.tfar[i] = hits.object[i] != LUM_NO_OBJECT ? hits.t[i] * (i & 1 ? 0.99f : 1.01f) : INFINITY;
        }
        lum_trace_any(n & 4 ? &coherent : &t, &rays, occluded);
        for (uint32_t i = 0; i < n; i++)
            assert_int_equal(occluded[i], hits.object[i] != LUM_NO_OBJECT && !(i & 1));
    }
    assert_int_equal(bad, 0);
    lum_snapshot_unref(s);
}

/* A mask texture, half opaque: closest and any hit let exactly the clear half through. */
static void alpha_mask_lets_the_clear_half_through(void **state)
{
    struct fixture *f = *state;
    put_shape(f->scene, "quad", "quad", 1, 1);
    const uint8_t texels[] = {255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 0, 255, 255, 255, 0};
    struct lum_image_desc image = {.texel = LUM_TEXEL_SRGB8, .width = 4, .height = 1, .pixels = texels};
    CHECK_OK(lum_scene_put_image(f->scene, "mask", &image, err));
    struct lum_material_desc m = lum_material_default();
    m.base_color_texture.image = "mask";
    m.base_color_texture.wrap_u = LUM_WRAP_CLAMP;
    m.alpha_mode = LUM_ALPHA_MASK;
    CHECK_OK(lum_scene_put_material(f->scene, "leaf", &m, err));
    put_object(f->scene, "o", "quad", "leaf", at(0, 0, 0));
    const struct lum_snapshot *s = commit(f);
    assert_true(s->has_alpha);
    uint64_t bad = 0;
    const struct lum_trace t = {.top = s->top, .alpha = &s->alpha, .bad_rays = &bad};
    static uint8_t occluded[LUM_RAY_BATCH];
    rays.n = LUM_RAY_BATCH;
    for (uint32_t i = 0; i < rays.n; i++)
        set_ray(&rays, i, to_scene(s, (i + 0.5) / rays.n - 0.5, 1, 0.1), lum_v3(0.0f, -1.0f, 0.0f));
    lum_trace_closest(&t, &rays, &hits);
    lum_trace_any(&t, &rays, occluded);
    for (uint32_t i = 0; i < rays.n; i++) {
        bool there = i < rays.n / 2; /* bilinear alpha crosses 1/2 in the middle of the picture */
        assert_int_equal(hits.object[i], there ? 0 : LUM_NO_OBJECT);
        assert_int_equal(occluded[i], there);
    }
    lum_snapshot_unref(s);
}

/* Any set that the processor has can be asked for, and is told; nobody asked: the widest. */
static void instruction_sets_are_what_they_say(void **state)
{
    (void)state;
    static const char *const names[] = {"sse2", "sse4.2", "avx", "avx2", "avx512"};
    struct lum_device *device = NULL;
    struct lum_error refused = {0};
    const char *widest = NULL;
    for (size_t i = 0; i < LUM_ARRAY_LEN(names); i++) {
        if (lum_isa_check("it", names[i], &refused) != LUM_OK) {
            assert_int_equal(lum_device_create(1, names[i], &device, NULL), LUM_ERR_UNSUPPORTED);
            continue;
        }
        widest = names[i];
        CHECK_OK(lum_device_create(1, names[i], &device, err));
        assert_string_equal(lum_device_isa(device), names[i]);
        lum_device_destroy(device);
    }
    CHECK_OK(lum_device_create(1, NULL, &device, err));
    assert_string_equal(lum_device_isa(device), widest);
    lum_device_destroy(device);
    assert_int_equal(lum_device_create(1, "mmx", &device, &refused), LUM_ERR_INVALID);
    assert_string_equal(refused.field, "isa");
}

int main(void)
{
#define TEST(function) cmocka_unit_test_setup_teardown(function, fixture_setup, fixture_teardown)
    const struct CMUnitTest tests[] = {
        TEST(no_self_hits_at_any_scale_and_offset),
        TEST(sheets_a_millimetre_apart_are_not_missed),
        TEST(powers_of_two_change_no_bit),
        TEST(far_from_the_origin_nothing_is_lost),
        TEST(closed_rooms_do_not_leak),
        TEST(broken_triangles_are_dropped_and_counted),
        TEST(winding_changes_only_the_side),
        TEST(refit_equals_rebuild),
        TEST(emitter_shapes_are_where_they_should_be),
        TEST(batches_of_any_length_agree),
        TEST(alpha_mask_lets_the_clear_half_through),
        cmocka_unit_test(instruction_sets_are_what_they_say),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
