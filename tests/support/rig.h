/* A small renderer for tests: device, pool, scene and view, and words to furnish the scene with. Failures end the test.
 */
#ifndef LUM_TESTS_SUPPORT_RIG_H
#define LUM_TESTS_SUPPORT_RIG_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "core/render/view.h"
#include "core/scene/desc.h"
#include "core/scene/scene.h"
#include "core/scene/snapshot.h"
#include "tests/support/default_material.h"
#include "tests/support/isa.h"

struct rig {
    struct lum_device *device;
    struct lum_pool *pool;
    struct lum_scene *scene;
    const struct lum_snapshot *snapshot;
    struct lum_view *view;
    uint64_t rev;
    struct lum_view_settings settings;
};

#define RIG_OK(call)                                                                                                   \
    do {                                                                                                               \
        struct lum_error err = {0};                                                                                    \
        enum lum_status rig_status = (call);                                                                           \
        if (rig_status != LUM_OK)                                                                                      \
            fail_msg("%s: %s (%s)", #call, err.text, err.field);                                                       \
    } while (0)

/* isa: of the ray tracing kernels, as lum_device_create takes it. */
static inline void rig_begin_on(struct rig *r, uint32_t threads, const char *isa)
{
    *r = (struct rig){0};
    lum_thread_init_fp();
    RIG_OK(lum_device_create(1, isa, &r->device, &err));
    RIG_OK(lum_pool_create(threads, &r->pool, &err));
    RIG_OK(lum_scene_create(r->device, &r->scene, &err));
    RIG_OK(lum_view_create(r->pool, &r->view, &err));
    r->settings = lum_view_settings_default();
    r->settings.deterministic = true; /* tests compare bits */
    r->settings.w = 48;
    r->settings.h = 32;
}

static inline void rig_begin(struct rig *r, uint32_t threads)
{
    rig_begin_on(r, threads, test_isa());
}

static inline void rig_end(struct rig *r)
{
    lum_view_destroy(r->view);
    lum_snapshot_unref(r->snapshot);
    lum_scene_destroy(r->scene);
    lum_pool_destroy(r->pool);
    lum_device_destroy(r->device);
}

static inline void rig_commit(struct rig *r)
{
    const struct lum_snapshot *next = NULL;
    RIG_OK(lum_scene_commit(r->scene, ++r->rev, &next, &err));
    lum_snapshot_unref(r->snapshot);
    r->snapshot = next;
}

static inline struct lum_pass_stats rig_pass(struct rig *r)
{
    struct lum_pass_stats stats;
    RIG_OK(lum_view_pass(r->view, r->snapshot, &r->settings, NULL, &stats, &err));
    assert_int_equal(stats.nonfinite, 0);
    assert_int_equal(stats.bad_rays, 0);
    return stats;
}

/* A new view on the same scene, so that nothing is memoised. */
static inline void rig_fresh_view(struct rig *r)
{
    lum_view_destroy(r->view);
    r->view = NULL;
    RIG_OK(lum_view_create(r->pool, &r->view, &err));
}

static inline uint64_t rig_all_rays(const struct lum_pass_stats *s)
{
    uint64_t n = 0;
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        n += s->rays[k];
    return n;
}

static inline struct lum_vec3d rig_v(double x, double y, double z)
{
    return (struct lum_vec3d){x, y, z};
}

/* World to scene. */
static inline struct lum_vec3 rig_to_scene(const struct rig *r, double x, double y, double z)
{
    return lum_world_to_scene(&r->snapshot->norm, rig_v(x, y, z));
}

static inline void rig_camera(struct rig *r, struct lum_vec3d position, struct lum_vec3d target, double vfov_deg)
{
    r->settings.camera = (struct lum_camera){position, target, {0, 1, 0}, vfov_deg};
    if (position.x == target.x && position.z == target.z)
        r->settings.camera.up = rig_v(0, 0, -1);
}

/* Purely diffuse. */
static inline struct lum_material_desc rig_diffuse(float albedo)
{
    struct lum_material_desc m = lum_material_default();
    m.base_color = lum_grey(albedo);
    m.specular = 0.0f;
    return m;
}

static inline void rig_material(struct rig *r, const char *id, const struct lum_material_desc *m)
{
    RIG_OK(lum_scene_put_material(r->scene, id, m, &err));
}

static inline void rig_mesh(struct rig *r, const char *id, const double *positions, uint32_t n_vertices,
                            const uint32_t *indices, uint32_t n_triangles)
{
    struct lum_mesh_desc d = {
        .positions = positions, .indices = indices, .n_vertices = n_vertices, .n_triangles = n_triangles};
    RIG_OK(lum_scene_put_mesh(r->scene, id, &d, &err));
}

static inline void rig_object(struct rig *r, const char *id, const char *mesh, const char *material,
                              struct lum_vec3d at)
{
    struct lum_object_desc d = {
        .mesh = mesh, .material = material, .local_to_world = lum_affined_identity(), .visible = true};
    d.local_to_world.m[0][3] = at.x;
    d.local_to_world.m[1][3] = at.y;
    d.local_to_world.m[2][3] = at.z;
    RIG_OK(lum_scene_put_object(r->scene, id, &d, &err));
}

/* With a material of its own, purely diffuse. The object has the mesh's name. */
static inline void rig_diffuse_object(struct rig *r, const char *mesh, const char *material, float albedo,
                                      struct lum_vec3d at)
{
    struct lum_material_desc m = rig_diffuse(albedo);
    rig_material(r, material, &m);
    rig_object(r, mesh, mesh, material, at);
}

/* A square in the plane y = 0, normal +Y, as mesh `id`. */
static inline void rig_square(struct rig *r, const char *id, double half)
{
    const double p[] = {-half, 0, -half, -half, 0, half, half, 0, half, half, 0, -half};
    const uint32_t i[] = {0, 1, 2, 0, 2, 3};
    rig_mesh(r, id, p, 4, i, 2);
}

/* A closed box, normals outward. */
static inline void rig_box(struct rig *r, const char *id, double hx, double hy, double hz)
{
    double p[24];
    for (int k = 0; k < 8; k++) {
        p[3 * k] = k & 1 ? hx : -hx;
        p[3 * k + 1] = k & 2 ? hy : -hy;
        p[3 * k + 2] = k & 4 ? hz : -hz;
    }
    const uint32_t i[] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                          2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    rig_mesh(r, id, p, 8, i, 12);
}

static inline struct lum_light_desc rig_point(struct lum_vec3d at, double cd)
{
    return (struct lum_light_desc){
        .kind = LUM_LIGHT_POINT, .position = at, .color = lum_grey(1), .intensity = cd, .on = true};
}

static inline struct lum_light_desc rig_quad(struct lum_vec3d at, struct lum_vec3d u, struct lum_vec3d v, double cd_m2)
{
    return (struct lum_light_desc){.kind = LUM_LIGHT_QUAD,
                                   .position = at,
                                   .u = u,
                                   .v = v,
                                   .color = lum_grey(1),
                                   .intensity = cd_m2,
                                   .on = true,
                                   .camera_visible = true};
}

static inline void rig_light(struct rig *r, const char *id, const struct lum_light_desc *l)
{
    RIG_OK(lum_scene_put_light(r->scene, id, l, &err));
}

static inline void rig_bulb(struct rig *r, const char *id, struct lum_vec3d at, double cd)
{
    struct lum_light_desc l = rig_point(at, cd);
    rig_light(r, id, &l);
}

/* A room of 4 x 3 x 4 m with a box in it, diffuse; no light yet. */
static inline void rig_room(struct rig *r)
{
    struct lum_material_desc white = rig_diffuse(0.75f), red = rig_diffuse(0.5f);
    red.base_color = lum_rgb(0.6f, 0.05f, 0.05f);
    rig_material(r, "white", &white);
    rig_material(r, "red", &red);
    rig_box(r, "room", 2, 1.5, 2);
    rig_box(r, "crate", 0.4, 0.5, 0.4);
    rig_object(r, "room", "room", "white", rig_v(0, 1.5, 0));
    rig_object(r, "crate", "crate", "red", rig_v(0.5, 0.5, -0.4));
    rig_camera(r, rig_v(-0.3, 1.4, 1.8), rig_v(0.2, 0.9, -0.5), 60);
}

/* Mean radiance over the film. */
static inline struct lum_rgb rig_mean(const struct rig *r)
{
    const struct lum_film *f = lum_view_film(r->view);
    double sum[3] = {0};
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 0; x < f->w; x++) {
            struct lum_rgb c = lum_film_mean(f, x, y);
            sum[0] += (double)c.r;
            sum[1] += (double)c.g;
            sum[2] += (double)c.b;
        }
    double n = (double)f->w * f->h;
    return lum_rgb((float)(sum[0] / n), (float)(sum[1] / n), (float)(sum[2] / n));
}

/* A copy of all pixels; free with lum_free. */
static inline struct lum_rgb *rig_picture(const struct rig *r)
{
    const struct lum_film *f = lum_view_film(r->view);
    struct lum_rgb *p = lum_calloc((size_t)f->w * f->h, sizeof *p);
    assert_non_null(p);
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 0; x < f->w; x++)
            p[(size_t)y * f->w + x] = lum_film_mean(f, x, y);
    return p;
}

/* Fails unless the film is bit for bit this picture. */
static inline void rig_assert_picture(const struct rig *r, const struct lum_rgb *expected, const char *what)
{
    const struct lum_film *f = lum_view_film(r->view);
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 0; x < f->w; x++) {
            struct lum_rgb got = lum_film_mean(f, x, y), want = expected[(size_t)y * f->w + x];
            if (memcmp(&got, &want, sizeof got) != 0)
                fail_msg("%s: pixel %u,%u is %g %g %g, expected %g %g %g", what, x, y, (double)got.r, (double)got.g,
                         (double)got.b, (double)want.r, (double)want.g, (double)want.b);
        }
}

/* The film is bit for bit what a new view makes, which is the rig's from now on. */
static inline void rig_assert_as_fresh(struct rig *r, const char *what)
{
    struct lum_rgb *picture = rig_picture(r);
    rig_fresh_view(r);
    rig_pass(r);
    rig_assert_picture(r, picture, what);
    lum_free(picture);
}

#endif
