#include "core/scene/light_kind.h"
#include "core/light/cie_sky.h"
#include "core/light/emitter.h"
#include "core/light/web.h"

#include "core/math/vec3d.h"
#include "core/scene/tables.h"

/* ---- vectors ---- */

static struct lum_vec3 vector_to_scene(struct lum_vec3d v, double scale)
{
    return lum_v3((float)(v.x * scale), (float)(v.y * scale), (float)(v.z * scale));
}

static struct lum_vec3 unit(struct lum_vec3d v)
{
    double m = fmax(fabs(v.x), fmax(fabs(v.y), fabs(v.z)));
    struct lum_vec3d s = {v.x / m, v.y / m, v.z / m};
    double length = sqrt(s.x * s.x + s.y * s.y + s.z * s.z);
    return vector_to_scene(s, 1.0 / length);
}

/* ---- points ---- */

static double flux_of_point(const struct lum_light_desc *d)
{
    (void)d;
    return 4.0 * LUM_PI_D;
}

static enum lum_status check_cone(const struct lum_light_desc *d, struct lum_error *err)
{
    enum lum_status status = lum_check_range("outer_cone_rad", d->outer_cone_rad, 1e-3, 0.5 * LUM_PI_D, err);
    if (status == LUM_OK)
        status = lum_check_range("inner_cone_rad", d->inner_cone_rad, 0.0, d->outer_cone_rad, err);
    return status;
}

/* Integral of the glTF spot falloff over the sphere, per unit of axial intensity: with t = (c - co) / (ci - co), the
 * falloff is t^2 between the cones, so 2 pi ((1 - ci) + (ci - co) / 3) = 2 pi (2 (1 - ci) + (1 - co)) / 3. */
static double flux_of_spot(const struct lum_light_desc *d)
{
    double si = sin(0.5 * d->inner_cone_rad), so = sin(0.5 * d->outer_cone_rad); /* 1 - cos = 2 sin^2 of the half */
    return 4.0 * LUM_PI_D * (2.0 * si * si + so * so) / 3.0;
}

static float one_minus_cos(double angle)
{
    double s = sin(0.5 * angle);
    return (float)(2.0 * s * s);
}

static void resolve_spot(const struct lum_light_desc *d, double scale, struct lum_light *l)
{
    (void)scale;
    l->omc_inner = one_minus_cos(d->inner_cone_rad);
    l->omc_outer = one_minus_cos(d->outer_cone_rad);
}

const struct lum_light_kind_row lum_light_kind_point = {
    .emitter = &lum_emitter_point, .falloff = &lum_falloff_even, .flux = flux_of_point};
const struct lum_light_kind_row lum_light_kind_spot = {.emitter = &lum_emitter_point,
                                                       .falloff = &lum_falloff_spot,
                                                       .aimed = true,
                                                       .check = check_cone,
                                                       .resolve = resolve_spot,
                                                       .flux = flux_of_spot};

/* ---- a web ---- */

static enum lum_status check_web(const struct lum_light_desc *d, struct lum_error *err)
{
    if (!d->web)
        return lum_fail(err, LUM_ERR_INVALID, "web", "an ies light needs a web");
    enum lum_status status = lum_check_vec("u", d->u, err);
    if (status == LUM_OK && !(lum_v3d_length(lum_v3d_cross(d->u, d->direction)) >
                              1e-6 * lum_v3d_length(d->u) * lum_v3d_length(d->direction)))
        return lum_fail(err, LUM_ERR_INVALID, "u", "must not be along the direction");
    if (status == LUM_OK && (unsigned)d->opening > LUM_OPENING_DISC)
        return lum_fail(err, LUM_ERR_INVALID, "opening", "is not a kind of opening");
    for (int k = 0; k < 2 && status == LUM_OK; k++)
        status = lum_check_range("opening_m", d->opening_m[k], 0.0, LUM_LENGTH_MAX, err);
    return status;
}

static struct lum_vec3d half_opening(const struct lum_light_desc *d)
{
    double most = d->opening == LUM_OPENING_POINT ? 0.0 : 0.5 * hypot(d->opening_m[0], d->opening_m[1]);
    return (struct lum_vec3d){most, most, most};
}

/* frame.t and the like are not always c0: of a web that was measured about another axis. */
#define OPENING_MIN 1e-6 /* m: of less than its square the area may be no float any more; a point to any eye */

static void open_up(const struct lum_light_desc *d, double scale, struct lum_vec3 c0, struct lum_light *l)
{
    double a = 0.5 * scale * d->opening_m[0], b = 0.5 * scale * d->opening_m[1];
    if (d->opening == LUM_OPENING_POINT || !(d->opening_m[0] >= OPENING_MIN && d->opening_m[1] >= OPENING_MIN))
        return;
    bool disc = d->opening == LUM_OPENING_DISC;
    l->kind = disc ? &lum_emitter_opening_disc : &lum_emitter_opening_rectangle;
    l->falloff = NULL;
    l->delta = false;
    l->both_sides = true;
    l->radius = disc ? (float)sqrt(a * b) : 0.0f;
    l->u = disc ? lum_v3(0.0f, 0.0f, 0.0f) : lum_v3_mul(c0, (float)a);
    l->v = disc ? lum_v3(0.0f, 0.0f, 0.0f) : lum_v3_mul(lum_cross(c0, l->n), (float)b);
    l->area = (float)((disc ? LUM_PI_D : 4.0) * a * b);
}

static void resolve_web(const struct lum_light_desc *d, double scale, struct lum_light *l)
{
    struct lum_vec3d n = d->direction, u = d->u;
    l->web = d->web;
    l->web_hash = d->web->hash;
    struct lum_vec3 c0 = unit(lum_v3d_mad(u, n, -lum_v3d_dot(u, n) / lum_v3d_dot(n, n)));
    l->frame = lum_web_frame(d->web->type, l->n, c0);
    open_up(d, scale, c0, l);
}

static double flux_of_web(const struct lum_light_desc *d)
{
    return d->web->flux_sr;
}

const struct lum_light_kind_row lum_light_kind_ies = {.emitter = &lum_emitter_point,
                                                      .falloff = &lum_falloff_web,
                                                      .aimed = true,
                                                      .check = check_web,
                                                      .half = half_opening,
                                                      .resolve = resolve_web,
                                                      .flux = flux_of_web};

/* ---- areas: Lambertian, pi times area ---- */

static enum lum_status check_edges(const struct lum_light_desc *d, struct lum_error *err)
{
    enum lum_status status = lum_check_vec("u", d->u, err);
    if (status == LUM_OK)
        status = lum_check_vec("v", d->v, err);
    /* the sine of the angle between the edges: below, the area and the normal are mostly rounding */
    if (status == LUM_OK &&
        !(lum_v3d_length(lum_v3d_cross(d->u, d->v)) > 1e-6 * lum_v3d_length(d->u) * lum_v3d_length(d->v)))
        return lum_fail(err, LUM_ERR_INVALID, "u", "u and v must span an area");
    return status;
}

static double flux_of_quad(const struct lum_light_desc *d)
{
    return LUM_PI_D * lum_v3d_length(lum_v3d_cross(d->u, d->v));
}

static struct lum_vec3d half_quad(const struct lum_light_desc *d)
{
    return (struct lum_vec3d){0.5 * (fabs(d->u.x) + fabs(d->v.x)), 0.5 * (fabs(d->u.y) + fabs(d->v.y)),
                              0.5 * (fabs(d->u.z) + fabs(d->v.z))};
}

static void resolve_quad(const struct lum_light_desc *d, double scale, struct lum_light *l)
{
    l->n = unit(lum_v3d_cross(d->u, d->v));
    l->u = vector_to_scene(d->u, 0.5 * scale);
    l->v = vector_to_scene(d->v, 0.5 * scale);
    l->area = 4.0f * lum_length(lum_cross(l->u, l->v));
}

const struct lum_light_kind_row lum_light_kind_quad = {.emitter = &lum_emitter_quad,
                                                       .check = check_edges,
                                                       .half = half_quad,
                                                       .resolve = resolve_quad,
                                                       .flux = flux_of_quad};

static enum lum_status check_radius(const struct lum_light_desc *d, struct lum_error *err)
{
    return lum_check_range("radius_m", d->radius_m, 1e-12, LUM_LENGTH_MAX, err);
}

static struct lum_vec3d half_round(const struct lum_light_desc *d)
{
    return (struct lum_vec3d){d->radius_m, d->radius_m, d->radius_m};
}

static void resolve_round(const struct lum_light_desc *d, double scale, struct lum_light *l)
{
    l->radius = (float)(d->radius_m * scale);
    l->area = (d->kind == &lum_light_kind_sphere ? 4.0f : 1.0f) * LUM_PI * l->radius * l->radius;
}

static double flux_of_disc(const struct lum_light_desc *d)
{
    return LUM_PI_D * LUM_PI_D * (d->radius_m * d->radius_m);
}

const struct lum_light_kind_row lum_light_kind_disc = {.emitter = &lum_emitter_disc,
                                                       .aimed = true,
                                                       .check = check_radius,
                                                       .half = half_round,
                                                       .resolve = resolve_round,
                                                       .flux = flux_of_disc};

static double flux_of_sphere(const struct lum_light_desc *d)
{
    return 4.0 * LUM_PI_D * LUM_PI_D * (d->radius_m * d->radius_m);
}

const struct lum_light_kind_row lum_light_kind_sphere = {.emitter = &lum_emitter_sphere,
                                                         .check = check_radius,
                                                         .half = half_round,
                                                         .resolve = resolve_round,
                                                         .flux = flux_of_sphere};

/* ---- from afar ---- */

static enum lum_status check_diameter(const struct lum_light_desc *d, struct lum_error *err)
{
    return lum_check_range("diameter_rad", d->diameter_rad, 0.0, 0.5 * LUM_PI_D, err);
}

#define DIAMETER_MIN 1e-4 /* 20 arc seconds: the shadow of a tower has a sharp edge */

/* Its intensity is the illuminance on a facing plane: pi L sin^2 of half its diameter. */
static void resolve_far(const struct lum_light_desc *d, double scale, struct lum_light *l)
{
    (void)scale;
    if (!(d->diameter_rad >= DIAMETER_MIN))
        return;
    double sine = sin(0.5 * d->diameter_rad);
    l->kind = &lum_emitter_far_disc;
    l->delta = false;
    l->p = lum_v3_mul(l->n, -LUM_FAR);
    l->radius = LUM_FAR * (float)tan(0.5 * d->diameter_rad);
    l->area = LUM_PI * l->radius * l->radius;
    l->power = lum_rgb_scale(l->power, (float)(1.0 / (LUM_PI_D * sine * sine)));
}

const struct lum_light_kind_row lum_light_kind_directional = {
    .emitter = &lum_emitter_directional, .aimed = true, .check = check_diameter, .resolve = resolve_far};

static enum lum_status check_rotation(const struct lum_light_desc *d, struct lum_error *err)
{
    return lum_check_range("rotation_rad", d->rotation_rad, -1e3, 1e3, err);
}

/* Rotation about +Y, as the images of local +X, +Y, +Z (light/environment.h). */
static void resolve_environment(const struct lum_light_desc *d, double scale, struct lum_light *l)
{
    (void)scale;
    float c = (float)cos(d->rotation_rad), s = (float)sin(d->rotation_rad);
    l->frame = (struct lum_frame){{c, 0.0f, -s}, {0.0f, 1.0f, 0.0f}, {s, 0.0f, c}};
}

const struct lum_light_kind_row lum_light_kind_environment = {
    .emitter = &lum_emitter_environment, .check = check_rotation, .resolve = resolve_environment};

/* ---- daylight ---- */

static enum lum_status check_sky(const struct lum_light_desc *d, struct lum_error *err)
{
    enum lum_status status = lum_check_range("cie_type", d->cie_type, 1.0, LUM_CIE_SKY_TYPES, err);
    if (status == LUM_OK)
        status = lum_check_range("ground_albedo", d->ground_albedo, 0.0, 1.0, err);
    if (status == LUM_OK && (unsigned)d->sky_amount > LUM_SKY_BY_SUN)
        return lum_fail(err, LUM_ERR_INVALID, "sky_amount", "is not a kind of amount");
    return status;
}

/* Where it has its sun and how much light that makes, the other lights say: lum_sky_resolve (sky.c). */
const struct lum_light_kind_row lum_light_kind_sky = {.emitter = &lum_emitter_environment, .check = check_sky};

const struct lum_light_kind_row lum_light_kind_sun = {
    .emitter = &lum_emitter_directional, .aimed = true, .check = check_diameter, .resolve = resolve_far};

/* ---- all ---- */

/* Bounds candela in scene units so that 1 / r^2 at LUM_POINT_LIGHT_NEAR (2^32) stays 2^32 inside the range of float,
 * for sharp lobes and rare picks. Nothing real reaches it: 1e9 cd, an arc searchlight, does in a scene of 0.5 mm. */
static float bounded_power(float power)
{
    return lum_min(power, 0x1p64f);
}

static bool from_afar(const struct lum_light_kind_row *row)
{
    return row->emitter->from_afar;
}

void lum_light_kind_resolve(const struct lum_light_desc *d, const struct lum_normalisation *norm, struct lum_light *l)
{
    const struct lum_light_kind_row *row = d->kind;
    bool in_candela = row->emitter->unit == LUM_POWER_INTENSITY;
    l->kind = row->emitter;
    l->falloff = row->falloff;
    l->delta = row->emitter->unit != LUM_POWER_LUMINANCE; /* those that open up are not, then (open_up) */
    l->power = lum_rgb_scale(d->color, (float)(d->intensity * (in_candela ? norm->scale * norm->scale : 1.0)));
    l->power = lum_rgb(bounded_power(l->power.r), bounded_power(l->power.g), bounded_power(l->power.b));
    if (!from_afar(row))
        l->p = lum_world_to_scene(norm, d->position);
    if (row->aimed)
        l->n = unit(d->direction);
    if (row->resolve)
        row->resolve(d, norm->scale, l);
}

enum lum_status lum_light_kind_check(const struct lum_light_desc *d, struct lum_error *err)
{
    if (!d->kind)
        return lum_fail(err, LUM_ERR_INVALID, "kind", "is not a kind of light");
    const struct lum_light_kind_row *row = d->kind;
    enum lum_status status = LUM_OK;
    if (!from_afar(row))
        status = lum_check_vec("position", d->position, err);
    if (status == LUM_OK && row->aimed) {
        status = lum_check_vec("direction", d->direction, err);
        if (status == LUM_OK && !(lum_v3d_length(d->direction) > 0.0))
            return lum_fail(err, LUM_ERR_INVALID, "direction", "must not be the zero vector");
    }
    return status == LUM_OK && row->check ? row->check(d, err) : status;
}

enum lum_status lum_light_from_flux(const struct lum_light_desc *light, double flux_lm, double *ret_intensity,
                                    struct lum_error *err)
{
    enum lum_status status = lum_light_kind_check(light, err);
    if (status == LUM_OK)
        status = lum_check_range("flux_lm", flux_lm, 0.0, LUM_POWER_MAX, err);
    if (status != LUM_OK)
        return status;
    const struct lum_light_kind_row *row = light->kind;
    if (!row->flux)
        return lum_fail(err, LUM_ERR_INVALID, "flux_lm", "a light from afar has no flux");
    double per_intensity = row->flux(light);
    if (!(flux_lm <= LUM_POWER_MAX * per_intensity))
        return lum_fail(err, LUM_ERR_INVALID, "flux_lm", "must be from 0 to %g of so small a light, not %g",
                        LUM_POWER_MAX * per_intensity, flux_lm);
    *ret_intensity = flux_lm > 0.0 ? flux_lm / per_intensity : 0.0;
    return LUM_OK;
}
