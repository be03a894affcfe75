#include "core/scene/light_kind.h"

#include "core/scene/tables.h"

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

/* ---- areas: Lambertian, pi times area ---- */

static enum lum_status check_edges(const struct lum_light_desc *d, struct lum_error *err)
{
    enum lum_status status = lum_check_vec("u", d->u, LUM_LENGTH_MAX, err);
    if (status == LUM_OK)
        status = lum_check_vec("v", d->v, LUM_LENGTH_MAX, err);
    /* the sine of the angle between the edges: below, the area and the normal are mostly rounding */
    if (status == LUM_OK && !(lum_v3d_cross_length(d->u, d->v) > 1e-6 * lum_v3d_length(d->u) * lum_v3d_length(d->v)))
        return lum_fail(err, LUM_ERR_INVALID, "u", "u and v must span an area");
    return status;
}

static double flux_of_quad(const struct lum_light_desc *d)
{
    return LUM_PI_D * lum_v3d_cross_length(d->u, d->v);
}

static enum lum_status check_radius(const struct lum_light_desc *d, struct lum_error *err)
{
    return lum_check_range("radius_m", d->radius_m, 1e-12, LUM_LENGTH_MAX, err);
}

static double flux_of_disc(const struct lum_light_desc *d)
{
    return LUM_PI_D * LUM_PI_D * (d->radius_m * d->radius_m);
}

static double flux_of_sphere(const struct lum_light_desc *d)
{
    return 4.0 * LUM_PI_D * LUM_PI_D * (d->radius_m * d->radius_m);
}

/* ---- from afar ---- */

static enum lum_status check_rotation(const struct lum_light_desc *d, struct lum_error *err)
{
    return lum_check_range("rotation_rad", d->rotation_rad, -1e3, 1e3, err);
}

/* ---- all ---- */

const struct lum_light_kind_row lum_light_kinds[LUM_LIGHT_KIND_COUNT] = {
    [LUM_LIGHT_POINT] = {"point", LUM_EMIT_POINT, LUM_FALLOFF_EVEN, .flux = flux_of_point},
    [LUM_LIGHT_SPOT] = {"spot", LUM_EMIT_POINT, LUM_FALLOFF_SPOT, .aimed = true, check_cone, flux_of_spot},
    [LUM_LIGHT_DIRECTIONAL] = {"directional", LUM_EMIT_DIRECTIONAL, .aimed = true},
    [LUM_LIGHT_QUAD] = {"quad", LUM_EMIT_QUAD, .check = check_edges, .flux = flux_of_quad},
    [LUM_LIGHT_DISC] = {"disc", LUM_EMIT_DISC, .aimed = true, .check = check_radius, .flux = flux_of_disc},
    [LUM_LIGHT_SPHERE] = {"sphere", LUM_EMIT_SPHERE, .check = check_radius, .flux = flux_of_sphere},
    [LUM_LIGHT_ENVIRONMENT] = {"environment", LUM_EMIT_ENVIRONMENT, .check = check_rotation},
};

enum lum_status lum_light_kind_check(const struct lum_light_desc *d, struct lum_error *err)
{
    if ((unsigned)d->kind >= LUM_LIGHT_KIND_COUNT)
        return lum_fail(err, LUM_ERR_INVALID, "kind", "is not a kind of light");
    const struct lum_light_kind_row *row = &lum_light_kinds[d->kind];
    enum lum_status status = LUM_OK;
    if (row->emitter != LUM_EMIT_DIRECTIONAL && row->emitter != LUM_EMIT_ENVIRONMENT)
        status = lum_check_vec("position", d->position, LUM_LENGTH_MAX, err);
    if (status == LUM_OK && row->aimed) {
        status = lum_check_vec("direction", d->direction, LUM_LENGTH_MAX, err);
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
    const struct lum_light_kind_row *row = &lum_light_kinds[light->kind];
    if (!row->flux)
        return lum_fail(err, LUM_ERR_INVALID, "flux_lm", "a directional or environment light has no flux");
    double per_intensity = row->flux(light);
    if (!(flux_lm <= LUM_POWER_MAX * per_intensity))
        return lum_fail(err, LUM_ERR_INVALID, "flux_lm", "must be from 0 to %g of so small a light, not %g",
                        LUM_POWER_MAX * per_intensity, flux_lm);
    *ret_intensity = flux_lm > 0.0 ? flux_lm / per_intensity : 0.0;
    return LUM_OK;
}
