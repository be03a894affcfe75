#include "tests/support/scene_fixture.h"

#include <stdlib.h>

#include "core/accel/trace.h"
#include "core/base/pool.h"
#include "core/scene/scene.h"
#include "tests/support/isa.h"

static int setup(void **state, const char *isa)
{
    struct fixture *f = calloc(1, sizeof *f);
    if (!f || lum_device_create(2, isa, &f->device, NULL) != LUM_OK)
        return 1;
    lum_thread_init_fp();
    *state = f;
    return lum_scene_create(f->device, &f->scene, NULL) == LUM_OK ? 0 : 1;
}

int fixture_setup(void **state)
{
    return setup(state, test_isa());
}

int fixture_setup_narrow(void **state)
{
    return setup(state, "avx2");
}

int fixture_teardown(void **state)
{
    struct fixture *f = *state;
    lum_alloc_fail_after(0);
    lum_scene_destroy(f->scene);
    lum_device_destroy(f->device);
    free(f);
    return 0;
}

void put_shape(struct lum_scene *scene, const char *id, const char *shape, uint32_t around, uint32_t along)
{
    struct lum_shape_params params = {.size = {1, 1, 1}, .segments = {around, along}};
    struct lum_shape_mesh m;
    CHECK_OK(lum_shape_make(shape, &params, &m, err));
    struct lum_mesh_desc desc = {.positions_f = m.positions,
                                 .normals = m.normals,
                                 .uvs = m.uvs,
                                 .indices = m.indices,
                                 .n_vertices = m.n_vertices,
                                 .n_triangles = m.n_triangles};
    CHECK_OK(lum_scene_put_mesh(scene, id, &desc, err));
    lum_shape_finish(&m);
}

void put_material(struct lum_scene *scene, const char *id)
{
    struct lum_material_desc desc = lum_material_default();
    CHECK_OK(lum_scene_put_material(scene, id, &desc, err));
}

void put_emissive(struct lum_scene *scene, const char *id, double cd_m2)
{
    struct lum_material_desc desc = lum_material_default();
    desc.emission_cd_m2 = cd_m2;
    CHECK_OK(lum_scene_put_material(scene, id, &desc, err));
}

void put_object(struct lum_scene *scene, const char *id, const char *mesh, const char *material, struct lum_affined m)
{
    struct lum_object_desc desc = {.mesh = mesh, .material = material, .local_to_world = m, .visible = true};
    CHECK_OK(lum_scene_put_object(scene, id, &desc, err));
}

struct lum_light_desc light_desc(const struct lum_light_kind_row *kind)
{
    return (struct lum_light_desc){
        .kind = kind,
        .position = {0, 2, 0},
        .direction = {0, -1, 0},
        .u = {1, 0, 0},
        .v = {0, 0, 1},
        .radius_m = 0.25,
        .inner_cone_rad = 0.3,
        .outer_cone_rad = 0.5,
        .cie_type = 12,
        .ground_albedo = 0.2,
        .color = lum_grey(1.0f),
        .intensity = 100.0,
        .on = true,
        .camera_visible = true,
    };
}

void put_light(struct lum_scene *scene, const char *id, const struct lum_light_desc *light)
{
    CHECK_OK(lum_scene_put_light(scene, id, light, err));
}

void put_fog(struct lum_scene *scene, const char *id, float sigma_s)
{
    struct lum_medium_desc m = {.sigma_s = lum_grey(sigma_s), .g = 0.5f, .lo = {-1, -1, -1}, .hi = {1, 1, 1}};
    CHECK_OK(lum_scene_put_medium(scene, id, &m, err));
}

void furnish(struct lum_scene *scene)
{
    put_shape(scene, "ball", "sphere", 16, 8);
    put_shape(scene, "box", "box", 1, 1);
    put_material(scene, "white");
    put_emissive(scene, "glow", 50.0);
    put_object(scene, "a", "ball", "white", at(0, 0, 0));
    put_object(scene, "b", "box", "white", at(3, 0, 0));
    put_object(scene, "lamp", "ball", "glow", scaled_at(0.5, 0, 3, 0));
    struct lum_light_desc l = light_desc(&lum_light_kind_quad);
    put_light(scene, "key", &l);
    l = light_desc(&lum_light_kind_point);
    put_light(scene, "fill", &l);
    struct lum_camera camera = {{0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 45, false};
    CHECK_OK(lum_scene_put_camera(scene, "main", &camera, err));
    put_fog(scene, "fog", 0.25f);
}

const struct lum_snapshot *commit(struct fixture *f)
{
    const struct lum_snapshot *s = NULL;
    CHECK_OK(lum_scene_commit(f->scene, ++f->rev, &s, err));
    return s;
}

struct lum_affined at(double x, double y, double z)
{
    return scaled_at(1.0, x, y, z);
}

struct lum_affined scaled_at(double s, double x, double y, double z)
{
    return (struct lum_affined){{{s, 0, 0, x}, {0, s, 0, y}, {0, 0, s, z}}};
}

struct lum_vec3 to_scene(const struct lum_snapshot *s, double x, double y, double z)
{
    return lum_world_to_scene(&s->norm, (struct lum_vec3d){x, y, z});
}

void set_ray(struct lum_rays *rays, uint32_t i, struct lum_vec3 o, struct lum_vec3 d)
{
    rays->ox[i] = o.x;
    rays->oy[i] = o.y;
    rays->oz[i] = o.z;
    rays->dx[i] = d.x;
    rays->dy[i] = d.y;
    rays->dz[i] = d.z;
    rays->tnear[i] = 0.0f;
    rays->tfar[i] = INFINITY;
}

void trace(const struct lum_snapshot *s, const struct lum_rays *rays, struct lum_hits *hits)
{
    uint64_t bad = 0;
    const struct lum_trace t = {.top = s->top, .alpha = s->has_alpha ? &s->alpha : NULL, .bad_rays = &bad};
    lum_trace_closest(&t, rays, hits);
    assert_int_equal(bad, 0);
}

/* splitmix64 (Steele, Lea & Flood 2014). */
static uint64_t random_u64(struct random_stream *r)
{
    uint64_t z = r->state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

double random_double(struct random_stream *r)
{
    return (double)(random_u64(r) >> 11) * 0x1p-53;
}

uint32_t random_bits(struct random_stream *r)
{
    return (uint32_t)(random_u64(r) >> 32);
}

struct lum_vec3 random_direction(struct random_stream *r)
{
    double z = 2.0 * random_double(r) - 1.0, phi = 6.283185307179586 * random_double(r), s = sqrt(1.0 - z * z);
    return lum_v3((float)(s * cos(phi)), (float)(s * sin(phi)), (float)z);
}
