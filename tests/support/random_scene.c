#include "tests/support/random_scene.h"

#include <stdlib.h>

#include "core/scene/shapes.h"
#include "server/world/light_kinds.h"
#include "tests/support/effort.h"
#include "tests/support/webs.h"

/* ---- picks ---- */

/* Of n possibilities the one that pick k of an item takes. */
static uint32_t pick(const struct random_item *item, uint32_t k, uint32_t n)
{
    if (item->plain >> k & 1u)
        return 0;
    uint64_t z = item->seed + 0x9e3779b97f4a7c15u * (k + 1);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (uint32_t)((z ^ (z >> 31)) % n);
}

#define PICK(item, k, table) ((table)[pick(item, k, LUM_ARRAY_LEN(table))])
enum { PICKS = 30 }; /* more than any item has, and bits of plain */

/* ---- meshes: all are there in every scene ---- */

static void put_shape(struct rig *r, const char *shape, uint32_t around, uint32_t along)
{
    struct lum_shape_params params = {.size = {1, 1, 1}, .segments = {around, along}};
    struct lum_shape_mesh m;
    RIG_OK(lum_shape_make(shape, &params, &m, &err));
    struct lum_mesh_desc d = {.positions_f = m.positions,
                              .normals = m.normals,
                              .uvs = m.uvs,
                              .indices = m.indices,
                              .n_vertices = m.n_vertices,
                              .n_triangles = m.n_triangles};
    RIG_OK(lum_scene_put_mesh(r->scene, shape, &d, &err));
    lum_shape_finish(&m);
}

/* A fan of triangles a metre long and from 1e-2 down to 1e-8 m wide. */
static void put_slivers(struct rig *r)
{
    enum { N = 8 };
    double p[3 * 3 * N];
    uint32_t indices[3 * N];
    for (uint32_t k = 0; k < N; k++) {
        double *q = p + 9 * k, y = 0.1 * k - 0.4, wide = pow(0.1, k + 1);
        const double corners[9] = {-0.5, y, 0.01 * k, 0.5, y + wide, 0.02 * k, 0.5, y, 0.02 * k};
        memcpy(q, corners, sizeof corners);
        for (uint32_t i = 0; i < 3; i++)
            indices[3 * k + i] = 3 * k + i;
    }
    rig_mesh(r, "slivers", p, 3 * N, indices, N);
}

/* A square whose uvs are a point in one half and a line in the other, and whose normals are none, backwards, level. */
static void put_twisted(struct rig *r)
{
    const double p[] = {-0.5, 0, -0.5, -0.5, 0, 0.5, 0.5, 0, 0.5, -0.5, 0, -0.5, 0.5, 0, 0.5, 0.5, 0, -0.5};
    const float uvs[] = {0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0, 0, 0.5f, 0.5f, 1, 1};
    const float normals[] = {0, 0, 0, 0, -1, 0, 1, 0, 0, 1e-20f, 1, 0, NAN, 1, 0, 0, 1, 0.1f};
    const uint32_t indices[] = {0, 1, 2, 3, 4, 5};
    struct lum_mesh_desc d = {
        .positions = p, .uvs = uvs, .normals = normals, .indices = indices, .n_vertices = 6, .n_triangles = 2};
    RIG_OK(lum_scene_put_mesh(r->scene, "twisted", &d, &err));
}

static void put_meshes(struct rig *r)
{
    put_shape(r, "box", 0, 0);
    put_shape(r, "sphere", 8, 4);
    put_shape(r, "quad", 0, 0);
    put_shape(r, "torus", 8, 5);
    put_slivers(r);
    put_twisted(r);
}

static void put_images(struct rig *r)
{
    float floats[4 * 4 * 3];
    uint8_t bytes[4 * 4 * 4];
    const float odd[] = {0.5f, NAN, INFINITY, -1.0f, 1e12f, 1e-30f, 0.0f, 2.0f};
    for (uint32_t i = 0; i < LUM_ARRAY_LEN(floats); i++)
        floats[i] = odd[i % LUM_ARRAY_LEN(odd)];
    for (uint32_t i = 0; i < LUM_ARRAY_LEN(bytes); i++)
        bytes[i] = (uint8_t)(i * 97 % 256);
    bytes[0] = bytes[1] = bytes[2] = 0; /* as a normal: backwards */
    struct lum_image_desc weave = {LUM_TEXEL_LINEAR8, 4, 4, bytes}, wild = {LUM_TEXEL_RGB32F, 4, 4, floats};
    RIG_OK(lum_scene_put_image(r->scene, "weave", &weave, &err));
    RIG_OK(lum_scene_put_image(r->scene, "wild", &wild, &err));
}

/* ---- items ---- */

static struct lum_vec3d times(struct lum_vec3d v, double s)
{
    return rig_v(v.x * s, v.y * s, v.z * s);
}

static void put_camera(struct rig *r, const struct random_item *item, double scale)
{
    static const struct lum_vec3d from[] = {{0.2, 1.2, 3.2}, {0.25, 0.5, 0.25},  {-0.25, 0.25, 0.3}, {0, 5, 0.0},
                                            {0.5, 0.0, 0.5}, {-1.9, 0.05, -1.9}, {0.1, 1e-7, 0.05},  {300, 200, 100}};
    static const double vfov[] = {50, 1, 100, 170};
    rig_camera(r, times(PICK(item, 0, from), scale), rig_v(0, 0.4 * scale, 0), PICK(item, 1, vfov));
}

static void put_material(struct rig *r, const char *id, const struct random_item *item, const struct random_scene *s)
{
    static const float colors[] = {0.7f, 0.0f, 1.0f, 1e-6f};
    static const float rough[] = {1.0f, 0.0f, 0.3f, 0.01f, 1e-4f};
    static const float iors[] = {1.5f, 1.0f, 1.0001f, 4.0f};
    static const double distances[] = {(double)INFINITY, 0.3, 1e-9};
    static const double emissions[] = {0, 0, 0, 10, 1e6, 1e-3};
    static const char *const pictures[] = {NULL, NULL, "weave", "wild"};
    static const float alphas[] = {1.0f, 0.5f, 0.0f};
    struct lum_material_desc m = lum_material_default();
    static const float sheets[] = {0.0f, 0.0f, 0.3f, 0.5f}, coats[] = {0.0f, 0.0f, 1.0f, 0.5f};
    m.base_color = lum_rgb(PICK(item, 4, colors), 0.5f, 0.6f);
    m.diffuse_transmittance = lum_rgb(0.0f, PICK(item, 15, sheets), 0.0f);
    m.roughness = PICK(item, 5, rough);
    uint32_t kind = pick(item, 6, 6); /* diffuse, coated, metal, glass, pane, unlit */
    m.specular = kind == 0 ? 0.0f : 1.0f;
    m.metallic = kind == 2 ? 1.0f : 0.0f;
    m.transmission = kind == 3 || kind == 4 ? 1.0f : 0.0f;
    m.thin = kind == 4;
    m.unlit = kind == 5 && !s->all_lit;
    m.ior = PICK(item, 7, iors);
    m.attenuation_color = lum_rgb(0.5f, 0.9f, 0.0f);
    m.attenuation_distance_m = PICK(item, 8, distances) * s->scale;
    m.emission_cd_m2 = PICK(item, 9, emissions) * s->light;
    m.base_color_texture.image = PICK(item, 10, pictures);
    m.normal_texture.image = PICK(item, 11, pictures);
    m.normal_scale = pick(item, 12, 2) ? 100.0f : 1.0f;
    m.alpha_mode = (enum lum_alpha_mode)pick(item, 13, 3);
    m.alpha = PICK(item, 14, alphas);
    m.clearcoat = PICK(item, 16, coats);
    m.clearcoat_roughness = PICK(item, 17, rough);
    m.clearcoat_texture.image = PICK(item, 23, pictures);
    m.clearcoat_roughness_texture.image = PICK(item, 24, pictures);
    m.clearcoat_normal_texture.image = PICK(item, 25, pictures);
    m.specular_texture.image = PICK(item, 26, pictures);
    m.specular_color_texture.image = PICK(item, 27, pictures);
    m.transmission_texture.image = PICK(item, 28, pictures);
    m.diffuse_transmission_texture.image = PICK(item, 29, pictures);
    m.sheen_color = lum_rgb(0.0f, PICK(item, 18, coats), 0.0f);
    m.sheen_roughness = PICK(item, 19, rough);
    m.anisotropy = PICK(item, 20, coats);
    m.anisotropy_rotation_deg = (double)PICK(item, 21, rough) * 90.0;
    m.anisotropy_texture.image = PICK(item, 22, pictures);
    rig_material(r, id, &m);
}

static void put_object(struct rig *r, const char *id, const struct random_item *item, const struct random_scene *s)
{
    static const char *const meshes[] = {"box", "sphere", "quad", "torus", "slivers", "twisted"};
    static const struct lum_vec3d sizes[] = {{0.6, 0.6, 0.6}, {4, 3, 4},     {0.5, 1e-6, 0.5},   {-0.5, 0.5, 0.5},
                                             {1, 1, 0.01},    {40, 0.1, 40}, {1e-4, 1e-4, 1e-4}, {0.3, 0.3, 0.3}};
    static const struct lum_vec3d places[] = {{0, 0.4, 0},       {0.25, 0.5, 0.25}, {-0.5, 0.3, 0.4}, {0, 0, 0},
                                              {0.25, 0.5, -0.6}, {0, 1.5, 0},       {20, 3, -9}};
    struct lum_vec3d size = times(PICK(item, 1, sizes), s->scale), at = times(PICK(item, 2, places), s->scale);
    double angle = pick(item, 3, 3) * 0.7, cosine = cos(angle), sine = sin(angle);
    struct lum_object_desc d = {.mesh = PICK(item, 0, meshes), .material = id, .visible = true};
    d.local_to_world = (struct lum_affined){
        {{cosine * size.x, 0, sine * size.z, at.x}, {0, size.y, 0, at.y}, {-sine * size.x, 0, cosine * size.z, at.z}}};
    put_material(r, id, item, s);
    RIG_OK(lum_scene_put_object(r->scene, id, &d, &err));
}

static void put_lamp(struct rig *r, const char *id, const struct random_item *item, double light, double scale)
{
    static const struct lum_vec3d places[] = {{-0.4, 2, 0.5}, {0.25, 0.5, 0.25}, {0, 0.7, 0},
                                              {0, 0, 0},      {0.5, 1e-6, 0.5},  {1000, 2000, 500}};
    static const double amounts[] = {100, 1e9, 1e-3, 1e5, 0};
    static const double sizes[] = {0.2, 1e-5, 3};
    double size = PICK(item, 3, sizes) * scale;
    struct lum_light_desc d = {.kind = lum_light_kinds[pick(item, 0, LUM_LIGHT_KIND_COUNT)].row,
                               .position = times(PICK(item, 1, places), scale),
                               .direction = {0.1, -1, 0.2},
                               .u = {size, 0, 0},
                               .v = {0, 0, size},
                               .radius_m = size,
                               .diameter_rad = pick(item, 9, 2)    ? 0.0
                                               : pick(item, 10, 2) ? 0.01
                                                                   : 1.0,
                               .inner_cone_rad = 0.0,
                               .cie_type = 1 + (int)pick(item, 8, 16),
                               .ground_albedo = 0.2,
                               .outer_cone_rad = pick(item, 4, 2) ? 1e-3 : 0.7,
                               .color = pick(item, 5, 2) ? lum_rgb(4.0f, 0.05f, 1.0f) : lum_grey(1.0f),
                               .intensity = PICK(item, 2, amounts),
                               .on = true,
                               .camera_visible = pick(item, 6, 2) == 0};
    if (d.kind == &lum_light_kind_environment && pick(item, 7, 2))
        d.image = "wild";
    if (d.kind == &lum_light_kind_environment || d.kind == &lum_light_kind_sky)
        d.intensity = fmin(d.intensity, 1e6);
    d.intensity *= light;
    if (d.kind == &lum_light_kind_point || d.kind == &lum_light_kind_spot || d.kind == &lum_light_kind_ies)
        d.intensity *= scale * scale;
    struct lum_web *web = d.kind == &lum_light_kind_ies ? web_of_a_lamp() : NULL;
    d.web = web;
    rig_light(r, id, &d);
    lum_web_unref(web);
}

static void put_fog(struct rig *r, const char *id, const struct random_item *item, const struct random_scene *s)
{
    static const float sigmas[] = {0.2f, 1e-6f, 0.0f, 3.0f, 1e6f};
    static const float gs[] = {0.0f, 0.99f, -0.99f};
    static const struct lum_vec3d corners[][2] = {
        {{-1, 0, -1}, {1, 1, 1}}, {{-0.5, 0.2, -0.5}, {0.5, 0.5, 3.2}}, {{0, 0, 0}, {1e-5, 1, 1}}};
    uint32_t k = pick(item, 3, LUM_ARRAY_LEN(corners)), n = LUM_ARRAY_LEN(sigmas) - s->clear;
    struct lum_medium_desc d = {
        .sigma_s = lum_rgb_scale(lum_rgb(sigmas[pick(item, 0, n)], 0.1f, 0.0f), (float)(1.0 / s->scale)),
        .sigma_a = lum_grey(sigmas[pick(item, 1, n)] * (float)(1.0 / s->scale)),
        .g = PICK(item, 2, gs),
        .everywhere = pick(item, 4, 4) == 3 && !s->clear,
        .lo = times(corners[k][0], s->scale),
        .hi = times(corners[k][1], s->scale)};
    RIG_OK(lum_scene_put_medium(r->scene, id, &d, &err));
}

/* ---- scenes ---- */

/* Item 0 is the camera; then lamps, media, and objects. */
enum { FIRST_LAMP = 1, FIRST_FOG = 5, FIRST_OBJECT = 7 };
_Static_assert(FIRST_OBJECT < RANDOM_ITEMS, "there are objects");

struct random_scene random_scene_make(uint64_t seed)
{
    struct random_scene s = {.seed = seed, .light = 1.0, .scale = 1.0};
    const struct random_item of_scene = {.seed = seed * 0xd1342543de82ef95u + 1};
    for (uint32_t i = 0; i < RANDOM_ITEMS; i++) {
        s.items[i].seed = (seed + 1) * 1000003u + i;
        /* some lamps and objects are missing, and fog mostly is */
        s.items[i].gone = i > 0 && pick(&of_scene, i, i >= FIRST_FOG && i < FIRST_OBJECT ? 3 : 2) > 0;
    }
    return s;
}

void random_scene_put_item(struct rig *r, const struct random_scene *s, uint32_t i)
{
    const struct random_item *item = &s->items[i];
    const char id[] = {(char)('a' + i), 0};
    const enum lum_entity kind = i >= FIRST_OBJECT ? LUM_ENTITY_OBJECT
                                 : i >= FIRST_FOG  ? LUM_ENTITY_MEDIUM
                                                   : LUM_ENTITY_LIGHT;
    if (i == 0) {
        put_camera(r, item, s->scale);
    } else if (item->gone) {
        enum lum_status status = lum_scene_remove(r->scene, kind, id, NULL);
        assert_true(status == LUM_OK || status == LUM_ERR_NOT_FOUND);
    } else if (kind == LUM_ENTITY_LIGHT) {
        put_lamp(r, id, item, s->light, s->scale);
    } else if (kind == LUM_ENTITY_MEDIUM) {
        put_fog(r, id, item, s);
    } else {
        put_object(r, id, item, s);
    }
}

void random_scene_put(struct rig *r, const struct random_scene *s)
{
    put_images(r);
    put_meshes(r);
    for (uint32_t i = 0; i < RANDOM_ITEMS; i++)
        random_scene_put_item(r, s, i);
    rig_commit(r);
}

/* ---- finding the smallest ---- */

/* True if it fails without this, too. */
static bool fails(const struct random_scene *s, const struct lum_method *method, random_property *property,
                  char ret_what[256])
{
    char what[256];
    if (property(s, method, what))
        return false;
    memcpy(ret_what, what, sizeof what);
    return true;
}

static bool shrink_once(struct random_scene *s, const struct lum_method *method, random_property *property,
                        char ret_what[256])
{
    bool smaller = false;
    for (uint32_t i = 1; i < RANDOM_ITEMS; i++) {
        struct random_scene t = *s;
        t.items[i].gone = true;
        if (!s->items[i].gone && fails(&t, method, property, ret_what)) {
            *s = t;
            smaller = true;
        }
    }
    for (uint32_t i = 0; i < RANDOM_ITEMS; i++)
        for (uint32_t k = 0; k < PICKS && !s->items[i].gone; k++) {
            struct random_scene t = *s;
            t.items[i].plain |= 1u << k;
            if (!(s->items[i].plain >> k & 1u) && fails(&t, method, property, ret_what)) {
                *s = t;
                smaller = true;
            }
        }
    return smaller;
}

static void report(const struct random_scene *s, const char *name, const char *method, const char *what)
{
    char items[512] = "";
    for (uint32_t i = 0; i < RANDOM_ITEMS; i++) {
        size_t n = strlen(items);
        if (!s->items[i].gone && n < sizeof items)
            snprintf(items + n, sizeof items - n, " %c (not plain:%08x)", (char)('a' + i),
                     ~s->items[i].plain & ((1u << PICKS) - 1u));
    }
    print_error("%s, %s, scene %llu with%s: %s\n", name, method, (unsigned long long)s->seed, items, what);
}

void random_scenes_hold(const char *name, uint64_t from, uint32_t n, random_property *property)
{
    const char *more = getenv("LUMEND_RANDOM_SCENES");
    size_t n_methods, n_failed = 0;
    const struct lum_method *methods = lum_methods(&n_methods);
    n = more ? (uint32_t)strtoul(more, NULL, 10) : n;
    for (size_t m = 0; m < n_methods; m++)
        for (uint32_t k = 0; k < n; k++) {
            struct random_scene s = random_scene_make(from + k);
            char what[256];
            if (!TEST_TAKES(m, k) || !fails(&s, &methods[m], property, what))
                continue;
            while (shrink_once(&s, &methods[m], property, what))
                continue;
            report(&s, name, methods[m].name, what);
            n_failed++;
            break;
        }
    assert_int_equal(n_failed, 0);
}
