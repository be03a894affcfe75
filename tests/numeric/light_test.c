/* Light sampling: distributions, closed forms of irradiance, flux, continuity, hostile input. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/light/light.h"
#include "core/light/rect.h"
#include "core/math/sampler.h"
#include "core/scene/snapshot.h"
#include "tests/numeric/stats.h"

static struct lum_vec3 direction(double cos_theta, double phi)
{
    double s = sqrt(fmax(0.0, 1.0 - cos_theta * cos_theta));
    return lum_v3((float)(s * cos(phi)), (float)(s * sin(phi)), (float)cos_theta);
}

/* One light in an otherwise empty snapshot. */
static struct lum_snapshot snapshot_of(const struct lum_light *l)
{
    return (struct lum_snapshot){.lights = {.lights = l, .n_lights = 1, .environment = LUM_NO_OBJECT}};
}

static struct lum_light light(enum lum_emitter kind)
{
    return (struct lum_light){.kind = kind, .power = {1.0f, 1.0f, 1.0f}, .on = true, .n = {0.0f, 0.0f, -1.0f}};
}

static struct lum_light quad(struct lum_vec3 centre, struct lum_vec3 u, struct lum_vec3 v)
{
    struct lum_light l = light(LUM_EMIT_QUAD);
    struct lum_vec3 n = lum_cross(u, v);
    l.p = centre, l.u = u, l.v = v, l.n = lum_normalize(n), l.area = 4.0f * lum_length(n);
    return l;
}

static struct lum_light disc(struct lum_vec3 centre, struct lum_vec3 n, float radius)
{
    struct lum_light l = light(LUM_EMIT_DISC);
    l.p = centre, l.n = n, l.radius = radius, l.area = LUM_PI * radius * radius;
    return l;
}

static struct lum_light sphere(struct lum_vec3 centre, float radius)
{
    struct lum_light l = light(LUM_EMIT_SPHERE);
    l.p = centre, l.radius = radius, l.area = 4.0f * LUM_PI * radius * radius;
    return l;
}

/* A crumpled mesh of three triangles, one of them without area, behind a transform that scales unevenly. */
struct mesh_light {
    float positions[15], tri_cdf[3];
    uint32_t indices[9];
    struct lum_mesh mesh;
    struct lum_instance instance;
    struct lum_material material;
    struct lum_light light;
    struct lum_snapshot snapshot;
};

static struct lum_vec3 mesh_vertex(const struct mesh_light *m, uint32_t tri, uint32_t k)
{
    const float *q = m->positions + 3 * (size_t)m->indices[3 * tri + k];
    return lum_affine_point(&m->instance.local_to_scene, lum_v3(q[0], q[1], q[2]));
}

static struct lum_vec3 mesh_normal(const struct mesh_light *m, uint32_t tri) /* length: twice the area */
{
    struct lum_vec3 a = mesh_vertex(m, tri, 0);
    return lum_cross(lum_v3_sub(mesh_vertex(m, tri, 1), a), lum_v3_sub(mesh_vertex(m, tri, 2), a));
}

static void mesh_light_init(struct mesh_light *m)
{
    static const float positions[15] = {0, 0, 0, 1, 0, 0.2f, 0, 1, 0, 1.5f, 1, 0.5f, 2, 0, 0.4f};
    static const uint32_t indices[9] = {0, 1, 2, 0, 1, 4, 1, 3, 2}; /* 0, 1 and 4 are in line */
    memset(m, 0, sizeof *m);
    memcpy(m->positions, positions, sizeof positions);
    memcpy(m->indices, indices, sizeof indices);
    m->mesh.positions = m->positions, m->mesh.indices = m->indices, m->mesh.n_vertices = 5, m->mesh.n_triangles = 3;
    m->instance =
        (struct lum_instance){.mesh = &m->mesh, .local_to_scene = {{{2, 0, 0, 1}, {0, 1, 0, 0}, {0, 0, 1, 3}}}};
    m->light = light(LUM_EMIT_MESH);
    for (uint32_t t = 0; t < 3; t++)
        m->tri_cdf[t] = m->light.area += t == 1 ? 0.0f : 0.5f * lum_length(mesh_normal(m, t));
    m->light.tri_cdf = m->tri_cdf;
    m->snapshot = snapshot_of(&m->light);
    m->snapshot.instances = &m->instance, m->snapshot.n_instances = 1;
    m->snapshot.materials = &m->material, m->snapshot.n_materials = 1;
}

/* Irradiance at p on a plane facing n, by n_samples of the light. */
static double irradiance(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n, uint32_t n_samples)
{
    struct lum_snapshot s = snapshot_of(l);
    double sum = 0.0;
    for (uint32_t i = 0; i < n_samples; i++) {
        struct lum_sampler q = lum_sampler_at(5, 6, i, 7);
        struct lum_light_sample ls;
        if (!lum_light_sample_at(&s, 0, p, lum_sampler_2d(&q, 0), &ls))
            continue;
        double cos_p = fmax(0.0, (double)lum_dot(ls.wi, n));
        sum += (double)ls.radiance.g * cos_p / (l->delta ? 1.0 : (double)ls.pdf_sa);
    }
    return sum / n_samples;
}

/* ---- distributions ---- */

enum { SIDE = 16, SAMPLES = 100000 };

/* Where on the light samples fall, in cells of a parametrisation of its surface, against the integral of lum_light_pdf
 * over them. On the light there are no silhouettes: the integrand is smooth. */
struct patch {
    struct lum_vec3 x, n;
    double area; /* of the cell around x */
};

static struct patch quad_patch(const struct lum_light *l, double a, double b, double cells)
{
    struct lum_vec3 x = lum_v3_mad(lum_v3_mad(l->p, l->u, (float)(2.0 * a - 1.0)), l->v, (float)(2.0 * b - 1.0));
    return (struct patch){x, l->n, (double)l->area / cells};
}

/* a: squared relative radius, b: angle. */
static struct patch disc_patch(const struct lum_light *l, double a, double b, double cells)
{
    struct lum_frame f = lum_frame_from_normal(l->n);
    struct lum_vec3 d = direction(0.0, 2.0 * LUM_PI_D * b);
    float r = l->radius * (float)sqrt(a);
    return (struct patch){lum_v3_mad(lum_v3_mad(l->p, f.t, r * d.x), f.b, r * d.y), l->n, (double)l->area / cells};
}

static double wrap01(double x)
{
    return x - floor(x);
}

static void area_lights_follow_their_pdf(void **state)
{
    (void)state;
    struct lum_light lights[] = {
        quad(lum_v3(0, 0, 2), lum_v3(0, 1, 0), lum_v3(0.5f, 0, 0)),    /* solid angle */
        quad(lum_v3(0, 0, 2), lum_v3(0.3f, 1, 0), lum_v3(0.5f, 0, 0)), /* a parallelogram: area */
        disc(lum_v3(0, 0, 2), lum_v3(0, 0, -1), 1.0f),
    };
    static const struct lum_vec3 points[] = {{0, 0, 0}, {2, 1, 0}, {0.4f, 0, 1.7f}, {5, 0, 1.5f}, {20, 20, 0}};
    struct rng r = {1};
    for (size_t k = 0; k < LUM_ARRAY_LEN(lights); k++)
        for (size_t c = 0; c < LUM_ARRAY_LEN(points); c++) {
            const struct lum_light *l = &lights[k];
            struct lum_snapshot s = snapshot_of(l);
            static struct chi2_cell cell[SIDE * SIDE];
            double total = 0.0;
            if (lum_dot(l->n, lum_v3_sub(points[c], l->p)) <= 0.0f)
                fail_msg("point %zu does not see light %zu", c, k);
            for (int i = 0; i < SIDE * SIDE; i++) {
                double sum = 0.0;
                enum { sub = 16 };
                for (int j = 0; j < sub * sub; j++) {
                    double a = (i / SIDE + (j / sub + 0.5) / sub) / SIDE, b = (i % SIDE + (j % sub + 0.5) / sub) / SIDE;
                    double cells = (double)SIDE * SIDE * sub * sub;
                    struct patch at =
                        l->kind == LUM_EMIT_QUAD ? quad_patch(l, a, b, cells) : disc_patch(l, a, b, cells);
                    struct lum_vec3 d = lum_v3_sub(at.x, points[c]), wi = lum_normalize(d);
                    double pdf = (double)lum_light_pdf(&s, 0, points[c], wi, at.x, at.n);
                    sum += pdf * (double)(-lum_dot(wi, at.n) / lum_dot(d, d)) * at.area;
                }
                cell[i] = (struct chi2_cell){sum * SAMPLES, 0.0};
                total += sum;
            }
            if (fabs(total - 1.0) > 2e-3) /* midpoint rule on 256 x 256 cells, 1 / r^2 over a distance of 0.3 */
                fail_msg("light %zu point %zu: pdf integrates to %g", k, c, total);
            for (int i = 0; i < SAMPLES; i++) {
                struct lum_light_sample ls;
                struct lum_vec2 u = {(float)(rng_u64(&r) >> 40) * 0x1p-24f, (float)(rng_u64(&r) >> 40) * 0x1p-24f};
                assert_true(lum_light_sample_at(&s, 0, points[c], u, &ls));
                struct lum_vec3 x = lum_v3_mad(points[c], ls.wi, ls.distance), d = lum_v3_sub(x, l->p);
                float pdf = lum_light_pdf(&s, 0, points[c], ls.wi, x, l->n);
                assert_true(fabsf(pdf - ls.pdf_sa) <
                            1e-3f * pdf); /* x is rounded: 2^-22 of a distance, over its cosine */
                double a, b;
                if (l->kind == LUM_EMIT_QUAD) { /* coordinates of d in the basis u, v */
                    double uu = (double)lum_dot(l->u, l->u), uv = (double)lum_dot(l->u, l->v),
                           vv = (double)lum_dot(l->v, l->v);
                    double du = (double)lum_dot(d, l->u), dv = (double)lum_dot(d, l->v), det = uu * vv - uv * uv;
                    a = 0.5 + 0.5 * (du * vv - dv * uv) / det, b = 0.5 + 0.5 * (dv * uu - du * uv) / det;
                } else {
                    struct lum_frame f = lum_frame_from_normal(l->n);
                    double x1 = (double)lum_dot(d, f.t), y1 = (double)lum_dot(d, f.b);
                    a = (x1 * x1 + y1 * y1) / (double)(l->radius * l->radius);
                    b = wrap01(atan2(y1, x1) / (2.0 * LUM_PI_D));
                }
                int ia = (int)fmin(fmax(a, 0.0) * SIDE, SIDE - 1), ib = (int)fmin(fmax(b, 0.0) * SIDE, SIDE - 1);
                cell[ia * SIDE + ib].observed += 1.0;
            }
            double p = chi2_p_value(cell, SIDE * SIDE);
            if (p < sidak(0.01, 15))
                fail_msg("light %zu point %zu: p = %g", k, c, p);
        }
}

static void sphere_fills_its_cone_evenly(void **state)
{
    (void)state;
    static const double distances[] = {1.0001, 1.5, 10.0, 1000.0};
    struct rng r = {2};
    for (size_t c = 0; c < LUM_ARRAY_LEN(distances); c++) {
        struct lum_light l = sphere(lum_v3(0, 0, (float)distances[c]), 1.0f);
        struct lum_snapshot s = snapshot_of(&l);
        double sin2 = pow((double)l.radius / (double)l.p.z, 2.0), omc = sin2 / (1.0 + sqrt(1.0 - sin2));
        static struct chi2_cell cell[SIDE * SIDE];
        for (int i = 0; i < SIDE * SIDE; i++)
            cell[i] = (struct chi2_cell){(double)SAMPLES / (SIDE * SIDE), 0.0};
        for (int i = 0; i < SAMPLES; i++) {
            struct lum_light_sample ls;
            struct lum_vec2 u = {(float)rng_unit(&r), (float)rng_unit(&r)};
            struct lum_vec3 o = {0, 0, 0};
            assert_true(lum_light_sample_at(&s, 0, o, u, &ls));
            double s2 = (double)ls.wi.x * (double)ls.wi.x + (double)ls.wi.y * (double)ls.wi.y;
            double one_minus_cos = ls.wi.z > 0.0f ? s2 / (1.0 + sqrt(1.0 - s2)) : 1.0 - (double)ls.wi.z;
            int ia = (int)fmin(one_minus_cos / omc * SIDE, SIDE - 1);
            int ib = (int)fmin(wrap01(atan2((double)ls.wi.y, (double)ls.wi.x) / (2.0 * LUM_PI_D)) * SIDE, SIDE - 1);
            cell[ia * SIDE + ib].observed += 1.0;
            assert_true(fabs((double)ls.pdf_sa * 2.0 * LUM_PI_D * omc - 1.0) < 1e-4);
            struct lum_vec3 x = lum_v3_mul(ls.wi, ls.distance), n = lum_v3_sub(x, l.p);
            /* on the surface: at the rim the distance is a root of what cancels to 2^-23 of its square */
            assert_true(fabs((double)lum_length(n) - 1.0) < 1e-3 * (distances[c] > 100.0 ? 100.0 : 1.0));
            assert_true(lum_light_pdf(&s, 0, o, ls.wi, x, lum_normalize(n)) == ls.pdf_sa);
        }
        double p = chi2_p_value(cell, SIDE * SIDE);
        if (p < sidak(0.01, 4))
            fail_msg("distance %g: p = %g", distances[c], p);
    }
}

static void mesh_is_sampled_evenly_over_area(void **state)
{
    (void)state;
    struct mesh_light m;
    mesh_light_init(&m);
    enum { cells = 16 }; /* per triangle: 4 x 4 in (sum of weights)^2 and their ratio, which is even */
    struct chi2_cell cell[2 * cells];
    for (int t = 0; t < 2; t++)
        for (int i = 0; i < cells; i++)
            cell[t * cells + i] = (struct chi2_cell){
                0.5 * (double)lum_length(mesh_normal(&m, t ? 2 : 0)) / (double)m.light.area / cells * SAMPLES, 0.0};
    struct rng r = {3};
    struct lum_vec3 p = {1.0f, 0.5f, 0.0f};
    for (int i = 0; i < SAMPLES; i++) {
        struct lum_light_sample ls;
        struct lum_vec2 u = {(float)(rng_u64(&r) >> 40) * 0x1p-24f, (float)(rng_u64(&r) >> 40) * 0x1p-24f};
        assert_true(lum_light_sample_at(&m.snapshot, 0, p, u, &ls));
        struct lum_vec3 x = lum_v3_mad(p, ls.wi, ls.distance);
        int found = -1;
        double w[2] = {0, 0};
        for (int t = 0; t < 3 && found < 0; t += 2) { /* barycentric coordinates, and off the plane by less than 1e-4 */
            struct lum_vec3 a = mesh_vertex(&m, (uint32_t)t, 0), n = mesh_normal(&m, (uint32_t)t), d = lum_v3_sub(x, a);
            struct lum_vec3 e1 = lum_v3_sub(mesh_vertex(&m, (uint32_t)t, 1), a);
            struct lum_vec3 e2 = lum_v3_sub(mesh_vertex(&m, (uint32_t)t, 2), a);
            w[0] = (double)(lum_dot(lum_cross(d, e2), n) / lum_dot(n, n));
            w[1] = (double)(lum_dot(lum_cross(e1, d), n) / lum_dot(n, n));
            bool inside = w[0] > -1e-4 && w[1] > -1e-4 && w[0] + w[1] < 1.0001;
            if (inside && fabsf(lum_dot(d, lum_normalize(n))) < 1e-4f)
                found = t / 2;
        }
        assert_true(found >= 0);
        float pdf = lum_light_pdf(&m.snapshot, 0, p, ls.wi, x, lum_normalize(mesh_normal(&m, found ? 2 : 0)));
        bool on_an_edge = fmin(fmin(w[0], w[1]), 1.0 - w[0] - w[1]) < 1e-3; /* may belong to the neighbour */
        assert_true(on_an_edge || fabsf(pdf - ls.pdf_sa) < 1e-3f * pdf);
        double sum = fmin(fmax(w[0] + w[1], 1e-9), 1.0);
        int ia = (int)fmin(sum * sum * 4, 3), ib = (int)fmin(fmax(w[1] / sum, 0.0) * 4, 3);
        cell[found * cells + ia * 4 + ib].observed += 1.0;
    }
    double p_value = chi2_p_value(cell, 2 * cells);
    if (p_value < 0.01)
        fail_msg("p = %g", p_value);
}

/* A sampled point of a textured emitter shines as its own texel. */
static void mesh_emission_is_textured(void **state)
{
    (void)state;
    static const float ramp[3 * 2] = {0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 1.0f};
    struct lum_image image = {.texel = LUM_TEXEL_RGB32F, .width = 2, .height = 1, .pixels = ramp};
    struct mesh_light m;
    mesh_light_init(&m);
    float uvs[10];
    for (int i = 0; i < 5; i++) { /* u from a quarter to three quarters, where the ramp is linear, over x from 0 to 2 */
        uvs[2 * i] = 0.25f + 0.25f * m.positions[3 * i];
        uvs[2 * i + 1] = 0.5f;
    }
    m.mesh.uvs = uvs;
    m.light.power = m.material.emission = lum_rgb(30.0f, 20.0f, 10.0f);
    m.material.emission_tex =
        (struct lum_texture){.image = &image, .m = {{1, 0, 0}, {0, 1, 0}}, .wrap_u = LUM_WRAP_CLAMP};
    struct rng r = {11};
    struct lum_vec3 p = {1.0f, 0.5f, 0.0f};
    for (int i = 0; i < 10000; i++) {
        struct lum_light_sample ls;
        struct lum_vec2 u = {(float)(rng_u64(&r) >> 40) * 0x1p-24f, (float)(rng_u64(&r) >> 40) * 0x1p-24f};
        assert_true(lum_light_sample_at(&m.snapshot, 0, p, u, &ls));
        float x = lum_v3_mad(p, ls.wi, ls.distance).x; /* scene: 2 x + 1 */
        struct lum_vec2 uv = {0.25f + 0.125f * (x - 1.0f), 0.5f};
        struct lum_rgb want = lum_material_emission(&m.material, uv, lum_grey(1.0f));
        assert_true(fabsf(ls.radiance.r - want.r) < 1e-3f && fabsf(ls.radiance.b - want.b) < 1e-3f);
    }
}

static void lights_are_picked_as_the_table_says(void **state)
{
    (void)state;
    static const uint32_t active[] = {4, 0, 2};
    static const float cdf[] = {0.125f, 0.5f, 1.0f}, pdf[] = {0.375f, 0, 0.5f, 0, 0.125f};
    struct lum_light_table t = {.active = active, .active_cdf = cdf, .pick_pdf = pdf, .n_active = 3};
    double count[5] = {0}, moment[5] = {0};
    enum { n = 1 << 16 };
    for (int i = 0; i < n; i++) {
        float u = (float)i / n, prob;
        uint32_t k = lum_lights_pick(&t, &u, &prob);
        assert_true(k < 5 && prob == pdf[k] && u >= 0.0f && u < 1.0f);
        count[k] += 1.0 / n;
        moment[k] += (double)u / n;
    }
    for (int k = 0; k < 5; k++) {
        assert_true(count[k] == (double)pdf[k]);
        assert_true(fabs(moment[k] - 0.5 * (double)pdf[k]) < 1e-4); /* u is fresh: even again */
    }
    float u = 0x1.fffffep-1f, prob;
    assert_int_equal(lum_lights_pick(&t, &u, &prob), 2);
    assert_true(u < 1.0f);
    t.n_active = 0;
    assert_int_equal(lum_lights_pick(&t, &u, &prob), LUM_NO_OBJECT);
}

/* ---- closed forms ---- */

/* Lambert 1760: irradiance of a polygon of radiance 1: half the sum over edges of angle times the z of the edge plane's
 * normal; the polygon is cut at the horizon of n first. In double. */
static double polygon_irradiance(const struct lum_vec3 *v, int n_v, struct lum_vec3 p, struct lum_vec3 n)
{
    struct lum_vec3d q[16];
    int m = 0;
    for (int i = 0; i < n_v; i++) {
        struct lum_vec3 a = lum_v3_sub(v[i], p), b = lum_v3_sub(v[(i + 1) % n_v], p);
        double ha = (double)a.x * (double)n.x + (double)a.y * (double)n.y + (double)a.z * (double)n.z;
        double hb = (double)b.x * (double)n.x + (double)b.y * (double)n.y + (double)b.z * (double)n.z;
        if (ha > 0.0)
            q[m++] = (struct lum_vec3d){(double)a.x, (double)a.y, (double)a.z};
        if ((ha > 0.0) != (hb > 0.0)) {
            double t = ha / (ha - hb);
            q[m++] = (struct lum_vec3d){(double)a.x + t * (double)(b.x - a.x), (double)a.y + t * (double)(b.y - a.y),
                                        (double)a.z + t * (double)(b.z - a.z)};
        }
    }
    double sum = 0.0;
    for (int i = 0; i < m; i++) {
        struct lum_vec3d a = q[i], b = q[(i + 1) % m];
        struct lum_vec3d c = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
        double s = sqrt(c.x * c.x + c.y * c.y + c.z * c.z), cosine = a.x * b.x + a.y * b.y + a.z * b.z;
        if (s > 0.0)
            sum += atan2(s, cosine) * (c.x * (double)n.x + c.y * (double)n.y + c.z * (double)n.z) / s;
    }
    return 0.5 * fabs(sum);
}

static double quad_irradiance(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n)
{
    struct lum_vec3 v[4];
    for (int i = 0; i < 4; i++)
        v[i] = lum_v3_mad(lum_v3_mad(l->p, l->u, i == 0 || i == 3 ? -1.0f : 1.0f), l->v, i < 2 ? -1.0f : 1.0f);
    return polygon_irradiance(v, 4, p, n);
}

/* 2^14 points of a net; the error of a smooth integrand is far below 0.1 %, and the horizon's edge costs about N^-3/4.
 */
static void quad_irradiance_is_lamberts(void **state)
{
    (void)state;
    struct rng r = {4};
    double worst = 0.0;
    for (int i = 0; i < 300; i++) {
        struct lum_frame f = lum_frame_from_normal(direction(2.0 * rng_unit(&r) - 1.0, 6.3 * rng_unit(&r)));
        float w = (float)pow(10.0, 2.0 * rng_unit(&r) - 1.5), h = (float)pow(10.0, 2.0 * rng_unit(&r) - 1.5);
        struct lum_light l = quad(lum_v3(0.3f, -0.2f, 1.0f), lum_v3_mul(f.t, w), lum_v3_mul(f.b, h));
        struct lum_vec3 offset = direction(2.0 * rng_unit(&r) - 1.0, 6.3 * rng_unit(&r));
        if (lum_dot(offset, l.n) < 0.0f)
            offset = lum_v3_neg(offset);
        struct lum_vec3 p = lum_v3_mad(l.p, offset, (float)pow(10.0, 2.5 * rng_unit(&r) - 0.5));
        struct lum_vec3 n =
            lum_normalize(lum_v3_add(lum_normalize(lum_v3_sub(l.p, p)),
                                     lum_v3_mul(direction(2.0 * rng_unit(&r) - 1.0, 6.3 * rng_unit(&r)), 0.7f)));
        double want = quad_irradiance(&l, p, n), got = irradiance(&l, p, n, 1 << 14);
        worst = fmax(worst, fabs(got / want - 1.0));
        if (fabs(got - want) > 0.005 * want)
            fail_msg("case %d: %g, Lambert %g (half edges %g x %g, distance %g)", i, got, want, (double)w, (double)h,
                     (double)lum_length(lum_v3_sub(p, l.p)));
    }
    print_message("worst relative error over 300 quads: %.5f\n", worst);
}

/* The panel is seen, or faces, at 89.9 degrees. */
static void quad_irradiance_holds_at_grazing(void **state)
{
    (void)state;
    float c = (float)cos(89.9 * LUM_PI_D / 180.0), s = (float)sin(89.9 * LUM_PI_D / 180.0);
    struct lum_light l = quad(lum_v3(0, 0, 0), lum_v3(0, 0.5f, 0), lum_v3(0.5f, 0, 0)); /* emits towards -z */
    static const float distances[] = {0.6f, 1.0f, 3.0f, 30.0f};
    for (size_t i = 0; i < LUM_ARRAY_LEN(distances); i++) {
        struct lum_vec3 edge_on = {distances[i] * s, 0.0f, -distances[i] * c},
                        to = lum_v3_mul(edge_on, -1.0f / distances[i]);
        struct lum_vec3 below = {0.0f, 0.0f, -distances[i]}, tilted = {s, 0.0f, c};
        struct {
            struct lum_vec3 p, n;
        } cases[] = {{edge_on, to}, {below, tilted}};
        for (size_t k = 0; k < 2; k++) {
            double want = quad_irradiance(&l, cases[k].p, cases[k].n);
            double got = irradiance(&l, cases[k].p, cases[k].n, 1 << 16);
            if (fabs(got - want) > 0.005 * want)
                fail_msg("distance %g, case %zu: %g, Lambert %g", (double)distances[i], k, got, want);
        }
    }
}

/* On the axis E = pi L sin^2. Area sampling: cos^2 / r^2 varies by (1 + (R/d)^2)^2 over the disc. */
static void disc_on_its_axis(void **state)
{
    (void)state;
    static const double distances[] = {0.1, 0.5, 1.0, 2.0, 100.0};
    for (size_t i = 0; i < LUM_ARRAY_LEN(distances); i++) {
        double d = distances[i], want = LUM_PI_D / (1.0 + d * d);
        struct lum_light l = disc(lum_v3(0, 0, (float)d), lum_v3(0, 0, -1), 1.0f);
        double got = irradiance(&l, lum_v3(0, 0, 0), lum_v3(0, 0, 1), 1 << 16);
        if (fabs(got - want) > 0.002 * want)
            fail_msg("distance %g: %g, closed form %g", d, got, want);
    }
}

/* A sphere wholly above the horizon: E = pi L (R / d)^2 cos. */
static void sphere_is_as_if_a_point(void **state)
{
    (void)state;
    static const double distances[] = {1.05, 2.0, 10.0, 1e4};
    for (size_t i = 0; i < LUM_ARRAY_LEN(distances); i++)
        for (double cosine = 1.0; cosine > 1.02 / distances[i]; cosine *= 0.7) {
            double d = distances[i], want = LUM_PI_D / (d * d) * cosine;
            struct lum_light l = sphere(lum_v3_mul(direction(cosine, 0.5), (float)d), 1.0f);
            double got = irradiance(&l, lum_v3(0, 0, 0), lum_v3(0, 0, 1), 1 << 14);
            if (fabs(got - want) > 0.001 * want)
                fail_msg("distance %g, cos %g: %g, closed form %g", d, cosine, got, want);
        }
}

static void constant_environment_gives_pi(void **state)
{
    (void)state;
    struct lum_light l = light(LUM_EMIT_ENVIRONMENT);
    l.env_frame = lum_frame_from_normal(lum_v3(0, 0, 1));
    for (int i = 0; i < 10; i++) {
        double got = irradiance(&l, lum_v3(0, 0, 0), direction(i / 5.0 - 1.0, i), 1 << 16);
        assert_true(fabs(got / LUM_PI_D - 1.0) < 0.001);
    }
    struct lum_light_table t = {.lights = &l, .n_lights = 1, .environment = 0};
    assert_true(lum_lights_background(&t, lum_v3(0, 1, 0), false).g == 1.0f);
    assert_true(lum_lights_background(&t, lum_v3(0, 1, 0), true).g == 0.0f); /* not visible to the camera */
    l.camera_visible = true;
    assert_true(lum_lights_background(&t, lum_v3(0, 1, 0), true).g == 1.0f);
    l.on = false;
    assert_true(lum_lights_background(&t, lum_v3(0, 1, 0), false).g == 0.0f);
    t.environment = LUM_NO_OBJECT;
    assert_true(lum_lights_background(&t, lum_v3(0, 1, 0), false).g == 0.0f);
}

static void spot_ramps_as_in_gltf(void **state)
{
    (void)state;
    struct lum_light l = light(LUM_EMIT_SPOT);
    l.omc_inner = 0.125f, l.omc_outer = 0.5f;
    assert_true(lum_spot_falloff(&l, 0.0625f) == 1.0f && lum_spot_falloff(&l, 0.125f) == 1.0f);
    assert_true(fabsf(lum_spot_falloff(&l, 0.3125f) - 0.25f) < 1e-6f);
    assert_true(lum_spot_falloff(&l, 0.5f) == 0.0f && lum_spot_falloff(&l, 2.0f) == 0.0f);
    l.omc_inner = l.omc_outer = 0.5f; /* a hard edge */
    assert_true(lum_spot_falloff(&l, 0.5f) == 1.0f && lum_spot_falloff(&l, 0.5001f) == 0.0f);
    assert_true(lum_spot_falloff(&l, NAN) == 0.0f);
}

/* Half way to the edge of a cone that has no inner one, the falloff is (1 - 1/4)^2: 1 - cos goes with the square of a
 * small angle. Directions are good to 2^-23, so half the narrowest angle to 3e-4, its square to twice that and the
 * falloff by as much again; plus angle^2 / 16 of the series, 2.5e-5 at 0.02. */
static void narrow_spots_keep_their_edge(void **state)
{
    (void)state;
    const double angles[] = {1e-3, 2e-3, 5e-3, 2e-2};
    for (size_t i = 0; i < LUM_ARRAY_LEN(angles); i++) {
        struct lum_light l = light(LUM_EMIT_SPOT);
        l.n = lum_normalize(lum_v3(0.3f, -1.0f, 0.2f));
        l.power = lum_grey(64.0f);
        l.omc_outer = (float)(2.0 * sin(0.5 * angles[i]) * sin(0.5 * angles[i]));
        struct lum_frame f = lum_frame_from_normal(l.n);
        struct lum_snapshot s = snapshot_of(&l);
        for (int k = 0; k < 8; k++) {
            struct lum_vec3 d = direction(cos(0.5 * angles[i]), 0.7 * k);
            struct lum_light_sample ls;
            assert_true(lum_light_sample_at(&s, 0, lum_v3_mul(lum_frame_to_scene(&f, d), 8.0f),
                                            (struct lum_vec2){0.5f, 0.5f}, &ls));
            if (fabs((double)ls.radiance.g - 0.5625) > 1.5e-3 * 0.5625)
                fail_msg("cone of %g rad: %g, expected 0.5625", angles[i], (double)ls.radiance.g);
        }
    }
}

/* ---- flux ---- */

/* Light through a large sphere around the light: the mean irradiance on it times its area. */
static double flux_of(const struct lum_light *l, double radius)
{
    enum { n = 1 << 16 };
    struct lum_snapshot s = snapshot_of(l);
    double sum = 0.0;
    for (uint32_t i = 0; i < n; i++) {
        struct lum_sampler q = lum_sampler_at(0, 0, i, 1);
        struct lum_vec2 u = lum_sampler_2d(&q, 0);
        struct lum_vec3 out = direction(1.0 - 2.0 * (double)u.x, 2.0 * LUM_PI_D * (double)u.y);
        struct lum_light_sample ls;
        if (lum_light_sample_at(&s, 0, lum_v3_mul(out, (float)radius), lum_sampler_2d(&q, 1), &ls))
            sum +=
                fmax(0.0, -(double)lum_dot(ls.wi, out)) * (double)ls.radiance.g / (l->delta ? 1.0 : (double)ls.pdf_sa);
    }
    return sum / n * 4.0 * LUM_PI_D * radius * radius;
}

/* 800 lm go in, 800 lm come out. */
static void flux_is_kept(void **state)
{
    (void)state;
    static const enum lum_light_kind kinds[] = {LUM_LIGHT_POINT, LUM_LIGHT_SPOT, LUM_LIGHT_QUAD, LUM_LIGHT_DISC,
                                                LUM_LIGHT_SPHERE};
    for (size_t i = 0; i < LUM_ARRAY_LEN(kinds); i++) {
        struct lum_light_desc d = {.kind = kinds[i],
                                   .direction = {0, 0, -1},
                                   .u = {0, 0.5, 0},
                                   .v = {0.25, 0, 0},
                                   .radius_m = 0.3,
                                   .inner_cone_rad = 0.3,
                                   .outer_cone_rad = 0.8,
                                   .color = {1, 1, 1}};
        double intensity = 0.0;
        assert_int_equal(lum_light_from_flux(&d, 800.0, &intensity, NULL), LUM_OK);
        struct lum_light lights[] = {light(LUM_EMIT_POINT), light(LUM_EMIT_SPOT),
                                     quad(lum_v3(0, 0, 0), lum_v3(0, 0.25f, 0), lum_v3(0.125f, 0, 0)),
                                     disc(lum_v3(0, 0, 0), lum_v3(0, 0, -1), 0.3f), sphere(lum_v3(0, 0, 0), 0.3f)};
        struct lum_light *l = &lights[i];
        l->delta = i < 2;
        l->omc_inner = 1.0f - cosf(0.3f), l->omc_outer = 1.0f - cosf(0.8f);
        l->power = lum_grey((float)intensity);
        double got = flux_of(l, 5.0);
        if (fabs(got / 800.0 - 1.0) > 0.002)
            fail_msg("kind %d: %g lm", (int)kinds[i], got);
    }
}

/* ---- hard cases ---- */

/* Solid angle against area sampling: both must give the same light on either side of the switch, and their pdfs at the
 * middle of the rectangle agree to its curvature, S / 4. */
static void quad_switches_without_a_step(void **state)
{
    (void)state;
    struct lum_light l = quad(lum_v3(0, 0, 0), lum_v3(0, 0.5f, 0), lum_v3(0.5f, 0, 0));
    static const struct lum_vec3 towards[] = {{0, 0, -1}, {0.6f, 0, -0.8f}, {0.99f, 0, -0.1410674f}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(towards); k++) {
        double lo = 1.0, hi = 1000.0; /* distance where the solid angle crosses the threshold */
        for (int i = 0; i < 60; i++) {
            double mid = 0.5 * (lo + hi);
            struct lum_rect_view v;
            assert_true(lum_rect_view_init(&v, lum_v3_mul(towards[k], (float)mid), l.p, l.u, l.v));
            *(v.solid_angle >= LUM_RECT_MIN_SR ? &lo : &hi) = mid;
        }
        double near = lo * (1.0 - 1e-5), far = hi * (1.0 + 1e-5);
        struct lum_vec3 n = lum_v3_neg(towards[k]);
        double a = irradiance(&l, lum_v3_mul(towards[k], (float)near), n, 1 << 16);
        double b = irradiance(&l, lum_v3_mul(towards[k], (float)far), n, 1 << 16);
        /* the light itself falls by 2 * 2e-5 between the two */
        if (fabs(a / b - 1.0) > 1e-3)
            fail_msg("direction %zu: %g at %g, %g at %g", k, a, near, b, far);
    }
}

static void tiny_lights_keep_their_light(void **state)
{
    (void)state;
    float half = 0.5e-3f; /* area 1e-6 */
    struct lum_vec3 o = {0, 0, 0}, up = {0, 0, 1};
    for (float d = 0.01f; d < 200.0f; d *= 3.0f) {
        struct lum_light q = quad(lum_v3(0, 0, d), lum_v3(0, half, 0), lum_v3(half, 0, 0));
        double want = quad_irradiance(&q, o, up);
        assert_true(fabs(irradiance(&q, o, up, 4096) / want - 1.0) < 0.001);
        struct lum_light s = sphere(lum_v3(0, 0, d), 1e-6f);
        want = LUM_PI_D * pow((double)s.radius / (double)d, 2.0);
        assert_true(fabs(irradiance(&s, o, up, 4096) / want - 1.0) < 0.001);
    }
}

static void nothing_reaches_from_behind_or_from_no_area(void **state)
{
    (void)state;
    struct lum_vec3 o = {0, 0, 0}, up = {0, 0, 1};
    struct lum_light lights[] = {
        quad(lum_v3(0, 0, 1), lum_v3(1, 0, 0), lum_v3(0, 1, 0)),       /* emits towards +z */
        quad(lum_v3(1, 0, 0), lum_v3(0.5f, 0, 0), lum_v3(0, 0.5f, 0)), /* the point lies in its plane */
        quad(lum_v3(0, 0, 1), lum_v3(0, 0, 0), lum_v3(1, 0, 0)),
        quad(lum_v3(0, 0, 1), lum_v3(1, 0, 0), lum_v3(1, 0, 0)),
        disc(lum_v3(0, 0, 1), lum_v3(0, 0, 1), 1.0f),
        disc(lum_v3(0, 0, 1), lum_v3(0, 0, -1), 0.0f),
        disc(o, up, 1.0f),
        sphere(lum_v3(0, 0, 1), 0.0f),
        sphere(lum_v3(0, 0, 0.5f), 1.0f), /* the point is inside */
        sphere(o, 1.0f),
        light(LUM_EMIT_POINT), /* at the point */
        light(LUM_EMIT_SPOT),
    };
    lights[10].delta = lights[11].delta = true;
    for (size_t i = 0; i < LUM_ARRAY_LEN(lights); i++) {
        double e = irradiance(&lights[i], o, up, 64);
        if (e != 0.0)
            fail_msg("light %zu: %g", i, e);
        struct lum_snapshot s = snapshot_of(&lights[i]);
        float pdf = lum_light_pdf(&s, 0, o, up, lum_v3(0, 0, 1), lum_v3(0, 0, -1));
        assert_true(isfinite(pdf));
    }
    struct lum_light q = quad(lum_v3(0, 0, 1), lum_v3(0, 1, 0), lum_v3(1, 0, 0));
    assert_true(lum_light_emitted(&q, false).g == 1.0f && lum_light_emitted(&q, true).g == 0.0f);
    q.on = false;
    assert_true(lum_light_emitted(&q, false).g == 0.0f);
}

static float hostile(struct rng *r)
{
    static const float values[] = {0.0f, 1e-30f, -1e-30f, 1e-6f, 1.0f, -1.0f, 100.0f, 1e-38f};
    return rng_unit(r) < 0.3 ? values[rng_u64(r) % LUM_ARRAY_LEN(values)] : (float)(2.0 * rng_unit(r) - 1.0);
}

static struct lum_vec3 hostile_vec(struct rng *r)
{
    return lum_v3(hostile(r), hostile(r), hostile(r));
}

static void nothing_is_ever_not_finite(void **state)
{
    (void)state;
    struct rng r = {9};
    struct mesh_light m;
    mesh_light_init(&m);
    for (int i = 0; i < 1000000; i++) {
        enum lum_emitter kind = (enum lum_emitter)(i % (LUM_EMIT_ENVIRONMENT + 1));
        struct lum_light l = light(kind);
        if (kind == LUM_EMIT_QUAD)
            l = quad(hostile_vec(&r), hostile_vec(&r), hostile_vec(&r));
        else if (kind == LUM_EMIT_DISC)
            l = disc(hostile_vec(&r), lum_normalize(hostile_vec(&r)), fabsf(hostile(&r)));
        else if (kind == LUM_EMIT_SPHERE)
            l = sphere(hostile_vec(&r), fabsf(hostile(&r)));
        else if (kind == LUM_EMIT_MESH)
            l = m.light;
        else
            l.p = hostile_vec(&r), l.omc_inner = hostile(&r), l.omc_outer = hostile(&r),
            l.n = direction(2.0 * rng_unit(&r) - 1.0, 1.0);
        l.env_frame = lum_frame_from_normal(lum_v3(0, 0, 1));
        m.snapshot.lights.lights = &l;
        struct lum_vec3 p = i % 5 == 0 ? l.p : hostile_vec(&r);
        struct lum_vec2 u = {(float)(rng_u64(&r) >> 40) * 0x1p-24f,
                             i % 7 ? (float)(rng_u64(&r) >> 40) * 0x1p-24f : 0.0f};
        struct lum_light_sample s = {0};
        bool got = lum_light_sample_at(&m.snapshot, 0, p, u, &s);
        struct lum_vec3 x = hostile_vec(&r);
        float pdf = lum_light_pdf(&m.snapshot, 0, p, lum_normalize(x), x, lum_normalize(hostile_vec(&r)));
        bool delta = kind <= LUM_EMIT_DIRECTIONAL;
        bool ok = isfinite(pdf) && pdf >= 0.0f;
        if (got)
            ok = ok && lum_v3_finite(s.wi) && fabsf(lum_length(s.wi) - 1.0f) < 1e-4f && lum_rgb_finite(s.radiance) &&
                 s.distance >= 0.0f && isfinite(s.pdf_sa) && (delta ? s.pdf_sa == 0.0f : s.pdf_sa > 0.0f);
        if (!ok)
            fail_msg("case %d, kind %d: pdf %g, sample %g %g %g distance %g pdf %g", i, (int)kind, (double)pdf,
                     (double)s.wi.x, (double)s.wi.y, (double)s.wi.z, (double)s.distance, (double)s.pdf_sa);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(area_lights_follow_their_pdf),
        cmocka_unit_test(sphere_fills_its_cone_evenly),
        cmocka_unit_test(mesh_is_sampled_evenly_over_area),
        cmocka_unit_test(mesh_emission_is_textured),
        cmocka_unit_test(lights_are_picked_as_the_table_says),
        cmocka_unit_test(quad_irradiance_is_lamberts),
        cmocka_unit_test(quad_irradiance_holds_at_grazing),
        cmocka_unit_test(disc_on_its_axis),
        cmocka_unit_test(sphere_is_as_if_a_point),
        cmocka_unit_test(constant_environment_gives_pi),
        cmocka_unit_test(spot_ramps_as_in_gltf),
        cmocka_unit_test(narrow_spots_keep_their_edge),
        cmocka_unit_test(flux_is_kept),
        cmocka_unit_test(quad_switches_without_a_step),
        cmocka_unit_test(tiny_lights_keep_their_light),
        cmocka_unit_test(nothing_reaches_from_behind_or_from_no_area),
        cmocka_unit_test(nothing_is_ever_not_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
