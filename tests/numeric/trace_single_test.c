/* Packets are a matter of speed alone: rays traced one by one find the same hits. */
#include "tests/support/scene_fixture.h"

#include <string.h>

#include "core/accel/trace.h"
#include "core/scene/scene.h"

enum { SPHERE = 5 }; /* the object's index: three meshes, then the emitters by id */

static struct lum_rays rays;
static struct lum_hits cells, singles;

static void put_leaf_material(struct lum_scene *scene, const char *id)
{
    const uint8_t texels[] = {255, 255, 255, 255, 255, 255, 255, 0};
    struct lum_image_desc image = {.texel = LUM_TEXEL_SRGB8, .width = 2, .height = 1, .pixels = texels};
    CHECK_OK(lum_scene_put_image(scene, "mask", &image, err));
    struct lum_material_desc m = lum_material_default();
    m.base_color_texture.image = "mask";
    m.alpha_mode = LUM_ALPHA_MASK;
    CHECK_OK(lum_scene_put_material(scene, id, &m, err));
}

/* Meshes, an alpha mask, and one emitter of each shape, one of them hidden from the camera. */
static const struct lum_snapshot *make_scene(struct fixture *f)
{
    put_shape(f->scene, "ball", "sphere", 32, 16);
    put_shape(f->scene, "knot", "knot", 64, 12);
    put_material(f->scene, "white");
    put_leaf_material(f->scene, "leaf");
    put_object(f->scene, "knot", "knot", "white", scaled_at(2.0, 1, 1, 0));
    put_object(f->scene, "ball", "ball", "white", scaled_at(1.0, -1, 0.5, 1));
    put_object(f->scene, "leaf", "ball", "leaf", scaled_at(1.5, 0, 1.5, -1));
    const struct lum_light_kind_row *const kinds[] = {&lum_light_kind_quad, &lum_light_kind_disc,
                                                      &lum_light_kind_sphere};
    const char *const ids[] = {"a-quad", "b-disc", "c-sphere"};
    for (int i = 0; i < 3; i++) {
        struct lum_light_desc l = light_desc(kinds[i]);
        l.position.x = i - 1;
        l.camera_visible = i != 1;
        put_light(f->scene, ids[i], &l);
    }
    return commit(f);
}

static void trace_everywhere(const struct lum_snapshot *s, struct random_stream *r)
{
    rays.n = 1 + random_bits(r) % LUM_RAY_BATCH;
    for (uint32_t i = 0; i < rays.n; i++) {
        struct lum_vec3 p[2];
        for (int k = 0; k < 2; k++)
            p[k] = lum_v3(s->bounds_lo.x + (s->bounds_hi.x - s->bounds_lo.x) * (float)random_double(r),
                          s->bounds_lo.y + (s->bounds_hi.y - s->bounds_lo.y) * (float)random_double(r),
                          s->bounds_lo.z + (s->bounds_hi.z - s->bounds_lo.z) * (float)random_double(r));
        set_ray(&rays, i, p[0], lum_v3_sub(p[1], p[0]));
        if (random_bits(r) % 8 == 0)
            rays.tfar[i] = (float)random_double(r);
        if (random_bits(r) % 32 == 0)
            rays.dx[i] = NAN; /* the gate refuses it */
    }
}

/* The fields of a miss are undefined. */
static void clear_misses(struct lum_hits *h, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        if (h->object[i] == LUM_NO_OBJECT) {
            h->t[i] = h->u[i] = h->v[i] = h->ngx[i] = h->ngy[i] = h->ngz[i] = 0.0f;
            h->prim[i] = 0;
        }
}

/* Scene units that ray i travels per unit of t. */
static float speed(uint32_t i)
{
    return lum_length(lum_v3(rays.dx[i], rays.dy[i], rays.dz[i]));
}

static bool same_bits(uint32_t i)
{
    const float *const a[] = {cells.t, cells.u, cells.v, cells.ngx, cells.ngy, cells.ngz};
    const float *const b[] = {singles.t, singles.u, singles.v, singles.ngx, singles.ngy, singles.ngz};
    bool same = cells.object[i] == singles.object[i] && cells.prim[i] == singles.prim[i];
    for (size_t k = 0; k < LUM_ARRAY_LEN(a); k++)
        same = same && memcmp(&a[k][i], &b[k][i], sizeof(float)) == 0;
    return same;
}

/* Embree divides by |d|^2 through an approximation that differs between its sphere kernels, by an ulp or two.
 * Coordinates are at most 2^7, with ulps of 2^-17; 8 of them, and more at grazing rays by 1 / cos, where the root
 * amplifies. */
static bool same_to_rounding(uint32_t i)
{
    struct lum_vec3 d = lum_normalize(lum_v3(rays.dx[i], rays.dy[i], rays.dz[i]));
    struct lum_vec3 n = lum_normalize(lum_v3(cells.ngx[i], cells.ngy[i], cells.ngz[i]));
    float cosine = fabsf(lum_dot(n, d));
    return cells.object[i] == singles.object[i] &&
           fabsf(cells.t[i] - singles.t[i]) * speed(i) * cosine <= 8.0f * 0x1p-17f;
}

static void single_rays_find_what_packets_find(void **state)
{
    struct fixture *f = *state;
    const struct lum_snapshot *s = make_scene(f);
    struct random_stream r = {21};
    uint64_t bad[2] = {0, 0}, seen[7] = {0};
    uint8_t shadowed[2][LUM_RAY_BATCH];
    for (uint32_t round = 0; round < 400; round++) {
        struct lum_trace t = {.top = s->top, .alpha = &s->alpha, .camera = round & 1, .coherent = round & 2};
        trace_everywhere(s, &r);
        t.bad_rays = &bad[0];
        lum_trace_closest(&t, &rays, &cells);
        lum_trace_any(&t, &rays, shadowed[0]);
        t.bad_rays = &bad[1];
        lum_device_trace_singly(f->device, true);
        lum_trace_closest(&t, &rays, &singles);
        lum_trace_any(&t, &rays, shadowed[1]);
        lum_device_trace_singly(f->device, false);
        clear_misses(&cells, rays.n);
        clear_misses(&singles, rays.n);
        for (uint32_t i = 0; i < rays.n; i++) {
            uint32_t object = cells.object[i] < 6 ? cells.object[i] : 6;
            seen[object]++;
            if (!(object == SPHERE ? same_to_rounding(i) : same_bits(i)))
                fail_msg("round %u, ray %u of %u: object %u prim %u t %a; alone: %u, %u, %a", round, i, rays.n,
                         cells.object[i], cells.prim[i], (double)cells.t[i], singles.object[i], singles.prim[i],
                         (double)singles.t[i]);
            assert_int_equal(shadowed[0][i], shadowed[1][i]);
        }
    }
    assert_true(bad[0] > 100);
    assert_int_equal(bad[0], bad[1]);
    for (size_t k = 0; k < LUM_ARRAY_LEN(seen); k++)
        if (seen[k] < 100)
            fail_msg("object %zu was met %llu times: the test shows little", k, (unsigned long long)seen[k]);
    lum_snapshot_unref(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(single_rays_find_what_packets_find, fixture_setup, fixture_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
