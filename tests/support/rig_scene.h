/* Words to furnish the scene of a rig with. */
#ifndef LUM_TESTS_SUPPORT_RIG_SCENE_H
#define LUM_TESTS_SUPPORT_RIG_SCENE_H

#include "tests/support/default_material.h"
#include "tests/support/rig_life.h"

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
    r->settings.camera = (struct lum_camera){position, target, {0, 1, 0}, vfov_deg, false};
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
        .kind = &lum_light_kind_point, .position = at, .color = lum_grey(1), .intensity = cd, .on = true};
}

static inline struct lum_light_desc rig_quad(struct lum_vec3d at, struct lum_vec3d u, struct lum_vec3d v, double cd_m2)
{
    return (struct lum_light_desc){.kind = &lum_light_kind_quad,
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

/* A cube in which light is the same from everywhere: its walls shine with so much, in cd/m2, and reflect this share. */
static inline void rig_furnace(struct rig *r, double half, float reflects, double cd_m2)
{
    struct lum_material_desc wall = rig_diffuse(reflects);
    wall.emission_cd_m2 = cd_m2;
    rig_material(r, "wall", &wall);
    rig_box(r, "room", half, half, half);
    rig_object(r, "room", "room", "wall", rig_v(0, 0, 0));
}

#endif
